//! Compositing of ordered translucent splats as a recording: the GPU's twin of [`fold`](super::fold).
//!
//! The tiles that each splat of the order reaches are counted and scanned, and an entry (tile, splat) is written for
//! each; a stable radix sort by tile, eight bits a pass, keeps the order inside a tile. Then one workgroup a tile takes
//! its entries through shared memory in batches, one thread a pixel, with the sums and products of the CPU.
//!
//! Deviations from the CPU: tiles are 16 pixels wide, and a tile is done when its own pixels are, so behind the
//! transmittance cut-off optical depths differ, and transmittances and channels by as much as the cut-off allows; divisions,
//! and on some devices fused products and sums, round otherwise. Transmittances, and channels as a share of the largest
//! value, agree within 10⁻⁵ for footprints up to 120 pixels long; for long thin ones the error of either grows with the
//! square of length over thickness. Single precision only; depth and object planes are the CPU's.
//!
//! [`project`] makes the footprints on the device too, and [`follow`] composites what a sort on the device has ordered:
//! joined ([`Recording::join`]), splats are uploaded once and the image alone comes back.
//!
//! ```
//! use splat_core::raster::gpu::{Capacities, record};
//!
//! let room = Capacities {
//!     size: [1280, 720],
//!     planes: 1,
//!     channels: 3,
//!     splats: 1_000_000,
//!     ordered: 800_000,
//!     entries: 4_000_000,
//!     footprints: 3,
//!     materials: 8,
//!     opaque: false,
//! };
//! let recorded = record(room).unwrap();
//! recorded.recording.check().unwrap();
//! // 32 bytes a splat and 12 of its channels come in; an entry takes 16, to and fro.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 131);
//! ```

mod attributes;
pub mod follow;
pub mod project;
mod sort;

pub use attributes::{AttributeBuffers, AttributeRoom, Attributes};

use super::bins::TILE as TWIN_TILE;
use super::kernel::Kernel;
use super::projected::{Coverage, ProjectedDepth, ProjectedSplat};
use super::{Accumulation, OpaqueImage, Params, Projected};
use crate::shade::MAX_CHANNELS;
use crate::{Accumulator, Direction, Error, Material};
use rayon::prelude::*;
use sort::{Scanned, sort_pass};
use splat_shaders::layouts::{SortState, SplatState, SplatView};
use splat_shaders::{BufferId, Groups, Recording, kernels};

/// Side of a tile, pixels.
pub const TILE: u32 = 16;
/// The widest image, pixels a side: what one workgroup counts then fits 32 bits.
const WIDEST: u32 = 16_384;
/// Splats whose tiles a workgroup counts.
const COUNT_BLOCK: u32 = 1024;
/// Splats whose entries a workgroup writes, and threads of any workgroup.
const EMIT_BLOCK: u32 = 256;
/// Entries that a workgroup sorts.
const SORT_BLOCK: u32 = 2048;
/// Numbers that a workgroup scans.
pub(crate) const SCAN_BLOCK: u32 = 1024;
/// Words of a splat, and with depths.
const SPLAT_WORDS: [u32; 2] = [8, 12];

const _: () = assert!(TWIN_TILE == 32, "`composite.glsl` counts offsets from the corners of the CPU's tiles");

/// What a recording makes room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Width and height of the image, pixels, 1 to 16384 each.
    pub size: [u32; 2],
    /// Planes of optical depth, 1 or 3.
    pub planes: u32,
    /// Channels, 1 to 13.
    pub channels: u32,
    /// Splats by id.
    pub splats: u32,
    /// Splats of the order.
    pub ordered: u32,
    /// Pairs of a splat and a tile of 16 by 16 pixels that it reaches; a view of more is [`Error::Overflow`].
    pub entries: u32,
    /// Footprints.
    pub footprints: u32,
    /// Materials.
    pub materials: u32,
    /// Whether an opaque image may hide splats.
    pub opaque: bool,
}

impl Capacities {
    fn check(&self) -> Result<(), Error> {
        let Self { size, planes, channels, .. } = *self;
        let refuse = |name, found: String, expected| Err(Error::invalid("recording", 0, name, found, expected));
        if !size.iter().all(|s| (1..=WIDEST).contains(s)) {
            return refuse("size", format!("{size:?}"), "1 to 16384 pixels a side");
        }
        if !matches!(planes, 1 | 3) {
            return refuse("planes of optical depth", planes.to_string(), "1 or 3");
        }
        if !(1..=MAX_CHANNELS).contains(&(channels as usize)) {
            return refuse("channels", channels.to_string(), "1 to 13");
        }
        Ok(())
    }
}

/// What is folded: the arguments of [`fold`](super::fold) before the accumulator.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// Footprints by id.
    pub projected: &'a Projected,
    /// Ids in compositing order.
    pub order: &'a [u32],
    /// As many numbers a splat as the accumulator has channels, by id.
    pub values: &'a [f32],
    /// Extinctions.
    pub materials: &'a [Material],
    /// What hides splats.
    pub opaque: &'a OpaqueImage,
    /// Which end comes first.
    pub direction: Direction,
    /// The cut-off; the precision must be single.
    pub params: &'a Params,
}

impl Input<'_> {
    /// Room for this input, with so many entries.
    pub fn capacities(&self, accumulator: &Accumulator, entries: u32) -> Capacities {
        Capacities {
            size: accumulator.size,
            planes: accumulator.optical_depth.len() as u32,
            channels: accumulator.channels.len() as u32,
            splats: self.projected.splats.len() as u32,
            ordered: self.order.len() as u32,
            entries,
            footprints: self.projected.kernels.len() as u32,
            materials: self.materials.len() as u32,
            opaque: !self.opaque.depth.is_empty(),
        }
    }
}

/// What compositing reads beside splats and their order.
struct Image<'a> {
    size: [u32; 2],
    perspective: Option<f32>,
    kernels: &'a [Kernel],
    materials: &'a [Material],
    opaque: &'a OpaqueImage,
    direction: Direction,
    params: &'a Params,
    ordered: u32,
}

impl<'a> Image<'a> {
    fn of(input: &Input<'a>) -> Self {
        let Input { projected, order, materials, opaque, direction, params, .. } = *input;
        let (size, perspective, kernels) = (projected.size, projected.perspective, &projected.kernels[..]);
        Self { size, perspective, kernels, materials, opaque, direction, params, ordered: order.len() as u32 }
    }
}

/// The recorded compositing and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What the device is to do.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: one [`SplatState`].
    pub state: BufferId,
    /// Input, and read back: planes of optical depth, then channels, row by row.
    pub planes: BufferId,
    /// Input: the words of each splat by id, as [`words`] has them.
    pub splats: BufferId,
    /// Input: ids in compositing order.
    pub order: BufferId,
    /// Input: channels of each splat by id.
    pub values: BufferId,
    /// Of a recording by [`follow::record`]: the input that says how many splats are in the order.
    pub sorted: Option<BufferId>,
    inputs: [BufferId; 6],
}

/// The bytes of some splats.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    bytes: [Vec<u8>; 7],
}

/// What a device did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Splats that reach a tile.
    pub splats: u64,
    /// Pairs of a splat and a tile that it reaches.
    pub entries: u64,
    /// Those of the tile that has most: as many splats one thread folds in a row.
    pub longest: u64,
}

/// Tiles of an image, across and in all.
fn tiles(size: [u32; 2]) -> [u32; 2] {
    let [columns, rows] = size.map(|s| s.div_ceil(TILE));
    [columns, columns * rows]
}

/// Records the compositing with this room.
///
/// # Errors
/// [`Error::Invalid`] for a size, planes or channels out of range.
pub fn record(capacities: Capacities) -> Result<Recorded, Error> {
    record_as(capacities, false)
}

/// The same, in the order that a sort has left on the device where `follows`.
fn record_as(capacities: Capacities, follows: bool) -> Result<Recorded, Error> {
    capacities.check()?;
    let Capacities { size, planes, channels, splats, ordered, entries, .. } = capacities;
    let [_, tiles] = tiles(size);
    let area = u64::from(size[0]) * u64::from(size[1]);
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("view", size_of::<SplatView>() as u64);
    let order = r.input("order", words(ordered));
    let splat_words = SPLAT_WORDS[usize::from(capacities.opaque)];
    let footprints = r.input("splats", words(splats) * u64::from(splat_words));
    let values = r.input("values", words(splats) * u64::from(channels));
    let tables = r.input("tables", 16 * (3 * u64::from(capacities.footprints) + u64::from(capacities.materials)));
    let opaque = r.input("opaque", if capacities.opaque { 4 * area } else { 0 });
    let image = r.input("planes", 4 * area * u64::from(planes + channels));
    let state = r.scratch("state", size_of::<SplatState>() as u64);
    let places = Scanned::scratch(r, ["place scan", "places", "place sums"], ordered);
    let sort = r.scratch("sort", size_of::<SortState>() as u64);
    let digits = Scanned::scratch(r, ["digit scan", "digits", "digit sums"], 256 * entries.div_ceil(SORT_BLOCK));
    let keys = [r.scratch("tiles", words(entries)), r.scratch("tiles'", words(entries))];
    let ids = [r.scratch("ids", words(entries)), r.scratch("ids'", words(entries))];
    let starts = r.scratch("starts", words(tiles + 1));

    let sorted = follows.then(|| r.input("sorted", size_of::<SortState>() as u64));
    if let Some(sorted) = sorted {
        r.dispatch(&kernels::SPLAT_FOLLOW, Groups::cover(1), &[sorted, view], &[]);
    }
    r.dispatch(&kernels::SPLAT_BEGIN, Groups::cover(1), &[view, state, places.scan], &[]);
    let counted = [view, order, footprints, places.numbers, state];
    r.dispatch(&kernels::SPLAT_COUNT, Groups::cover(ordered.div_ceil(COUNT_BLOCK)), &counted, &[]);
    places.scan(r, Groups::cover(ordered.div_ceil(SCAN_BLOCK)));
    r.dispatch(&kernels::SPLAT_PREPARE, Groups::cover(1), &[state, sort, digits.scan], &[entries]);
    let emitted = [view, order, footprints, places.numbers, places.scan, sort, keys[0], ids[0]];
    r.dispatch(&kernels::SPLAT_EMIT, Groups::cover(ordered.div_ceil(EMIT_BLOCK)), &emitted, &[]);
    // Bits of the greatest tile.
    let passes = (tiles - 1).checked_ilog2().map_or(0, |top| top as usize / 8 + 1);
    for pass in 0..passes {
        let (from, to) = (pass % 2, 1 - pass % 2);
        sort_pass(r, 8 * pass as u32, sort, [keys[from], ids[from]], [keys[to], ids[to]], &digits);
    }
    let (keys, ids) = (keys[passes % 2], ids[passes % 2]);
    r.dispatch(
        &kernels::SPLAT_RANGES,
        Groups::cover((tiles + 1).div_ceil(256)),
        &[view, sort, keys, starts, state],
        &[],
    );
    let plain = (planes, channels) == (1, 3);
    let kernel = if plain { &kernels::SPLAT_COMPOSITE_BEAUTY } else { &kernels::SPLAT_COMPOSITE };
    let composited = [view, starts, ids, footprints, values, tables, opaque, image];
    r.dispatch(kernel, Groups::cover(tiles), &composited, &[]);
    r.read(state);
    r.read(image);
    let inputs = [view, order, footprints, values, tables, opaque];
    Ok(Recorded { recording, capacities, state, planes: image, splats: footprints, order, values, sorted, inputs })
}

impl Recorded {
    /// The bytes that the recording takes for this input and what `accumulator` holds already.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for, [`Error::ColumnLength`] for columns of different lengths,
    /// [`Error::Invalid`] for an id that no splat has and for what only the CPU does: half precision, depth and object
    /// planes.
    pub fn uploads(&self, input: &Input<'_>, accumulator: &Accumulator) -> Result<Uploads, Error> {
        let image = Image::of(input);
        self.check_image(&image, accumulator)?;
        self.check_splats(input)?;
        let splats = self.splats(input)?;
        let bytes = |order, splats, values| [order, splats, values].map(<[u8]>::to_vec);
        let order = bytemuck::cast_slice(input.order);
        let given = bytes(order, bytemuck::cast_slice(&splats), bytemuck::cast_slice(input.values));
        Ok(self.image_uploads(&image, accumulator, given))
    }

    fn image_uploads(&self, image: &Image<'_>, accumulator: &Accumulator, given: [Vec<u8>; 3]) -> Uploads {
        let opaque = self.capacities.opaque && !image.opaque.depth.is_empty();
        let extinctions =
            image.materials.iter().map(|m| [m.extinction_rgb[0], m.extinction_rgb[1], m.extinction_rgb[2], 0.0]);
        let footprints = image.kernels.iter().flat_map(|kernel| kernel.table());
        let tables: Vec<f32> = footprints.chain(extinctions.flatten()).collect();
        let fresh = all_planes(accumulator).all(|plane| plane.iter().all(|v| v.to_bits() == 0));
        let begun: Vec<f32> = if fresh { Vec::new() } else { all_planes(accumulator).flatten().copied().collect() };
        let view = self.view(image, opaque, fresh);
        let floats = |column: &[f32]| bytemuck::cast_slice(column).to_vec();
        let [order, splats, values] = given;
        Uploads {
            bytes: [
                bytemuck::bytes_of(&view).to_vec(),
                order,
                splats,
                values,
                floats(&tables),
                floats(if opaque { &image.opaque.depth } else { &[] }),
                floats(&begun),
            ],
        }
    }

    /// The words of all splats, whose ids are known.
    fn splats(&self, input: &Input<'_>) -> Result<Vec<u32>, Error> {
        let projected = input.projected;
        let unknown = |(splat, coverage): (&ProjectedSplat, &Coverage)| {
            *coverage != Coverage::NONE
                && (splat.material as usize >= input.materials.len()
                    || splat.footprint as usize >= projected.kernels.len())
        };
        let splats = projected.splats.par_iter().zip(&projected.coverage).with_min_len(1 << 14);
        if let Some(i) = splats.position_first(unknown) {
            let splat = &projected.splats[i];
            let looks = format!("{} and {}", splat.material, splat.footprint);
            return Err(Error::invalid("splat", i, "material or footprint", looks, "a known one"));
        }
        Ok(words(projected, self.capacities.opaque))
    }

    fn view(&self, image: &Image<'_>, opaque: bool, fresh: bool) -> SplatView {
        let Capacities { size, planes, channels, .. } = self.capacities;
        let [columns, tiles] = tiles(size);
        let size = size.map(|s| s as f32);
        SplatView {
            middle: size.map(|s| 0.5 * s),
            size,
            focal: image.perspective.unwrap_or(0.0),
            cutoff: image.params.transmittance_cutoff,
            columns,
            tiles,
            ordered: image.ordered,
            splat_words: SPLAT_WORDS[usize::from(self.capacities.opaque)],
            footprints: image.kernels.len() as u32,
            planes,
            channels,
            opaque: u32::from(opaque),
            back_to_front: u32::from(image.direction == Direction::BackToFront),
            fresh: u32::from(fresh),
        }
    }

    fn check_image(&self, image: &Image<'_>, accumulator: &Accumulator) -> Result<(), Error> {
        let room = self.capacities;
        let only_cpu = |what, found: String, expected| Err(Error::invalid("accumulator", 0, what, found, expected));
        if image.params.accumulation != Accumulation::F32 {
            return only_cpu("precision", format!("{:?}", image.params.accumulation), "F32 on a device");
        }
        if !(accumulator.depth.is_empty() && accumulator.object.is_empty()) {
            return only_cpu("planes", "depths or objects".to_owned(), "colours and optical depth on a device");
        }
        for (what, needed, had) in [
            ("footprints", image.kernels.len(), room.footprints),
            ("materials", image.materials.len(), room.materials),
            ("opaque images", usize::from(!image.opaque.depth.is_empty()), room.opaque.into()),
        ] {
            fits(what, needed as u64, had)?;
        }
        let area = room.size.map(|s| s as usize).iter().product();
        let lengths = [
            ("image width", image.size[0] as usize, room.size[0] as usize),
            ("image height", image.size[1] as usize, room.size[1] as usize),
            ("optical depth", accumulator.optical_depth.len(), room.planes as usize),
            ("channels", accumulator.channels.len(), room.channels as usize),
            ("opaque depth", image.opaque.depth.len(), if image.opaque.depth.is_empty() { 0 } else { area }),
        ];
        let planes = all_planes(accumulator).map(|plane| ("plane", plane.len(), area));
        equal_lengths(lengths.into_iter().chain(planes))
    }

    fn check_splats(&self, input: &Input<'_>) -> Result<(), Error> {
        let (projected, room) = (input.projected, self.capacities);
        let n = projected.splats.len();
        fits("splats", n as u64, room.splats)?;
        fits("splats in order", input.order.len() as u64, room.ordered)?;
        let depths = projected.depths.len();
        equal_lengths([
            ("values", input.values.len(), n * room.channels as usize),
            ("depths", depths, if room.opaque { n } else { depths }),
        ])?;
        let wrong = input.order.par_iter().with_min_len(1 << 14).position_first(|&id| id as usize >= n);
        wrong.map_or(Ok(()), |at| Err(Error::invalid("place", at, "id", input.order[at], "the id of a splat")))
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> [(BufferId, &'a [u8]); 7] {
        std::array::from_fn(|k| (self.inputs.get(k).copied().unwrap_or(self.planes), &uploads.bytes[k][..]))
    }

    /// Puts what was read back of [`Recorded::state`] and [`Recorded::planes`] into the accumulator that the uploads were
    /// made for.
    ///
    /// # Errors
    /// [`Error::Overflow`] when there are more entries than there is room for: record again with what is needed.
    /// [`Error::ColumnLength`] for bytes that no run gave.
    pub fn finish(&self, [state, planes]: [&[u8]; 2], accumulator: &mut Accumulator) -> Result<Counts, Error> {
        let counts = self.counts(state)?;
        let bytes = 4 * all_planes(accumulator).map(<[f32]>::len).sum::<usize>();
        equal_lengths([("planes read back", planes.len(), bytes)])?;
        let (words, _) = planes.as_chunks::<4>();
        let mut words = words.iter().map(|w| f32::from_ne_bytes(*w));
        for plane in accumulator.optical_depth.iter_mut().chain(&mut accumulator.channels) {
            plane.iter_mut().zip(&mut words).for_each(|(to, from)| *to = from);
        }
        Ok(counts)
    }

    /// What a device did, from what was read back of [`Recorded::state`].
    ///
    /// # Errors
    /// As [`Recorded::finish`].
    pub fn counts(&self, state: &[u8]) -> Result<Counts, Error> {
        let (attribute, found, expected) = ("state read back", state.len(), size_of::<SplatState>());
        let bytes = state.get(..expected).ok_or(Error::ColumnLength { attribute, found, expected })?;
        let state: SplatState = bytemuck::pod_read_unaligned(bytes);
        let entries = u64::from(state.entries_low) | u64::from(state.entries_high) << 32;
        fits("tile entries", entries, self.capacities.entries)?;
        Ok(Counts { splats: state.splats.into(), entries, longest: state.longest.into() })
    }
}

/// Planes of optical depth, then channels.
fn all_planes(accumulator: &Accumulator) -> impl Iterator<Item = &[f32]> {
    accumulator.optical_depth.iter().chain(&accumulator.channels).map(Vec::as_slice)
}

fn equal_lengths(lengths: impl IntoIterator<Item = (&'static str, usize, usize)>) -> Result<(), Error> {
    let wrong = lengths.into_iter().find(|(_, found, expected)| found != expected);
    wrong.map_or(Ok(()), |(attribute, found, expected)| Err(Error::ColumnLength { attribute, found, expected }))
}

/// The words of all splats, as the kernels read them: 8 each, 12 with depths; 0 for one that no pixel shows.
pub fn words(projected: &Projected, depth: bool) -> Vec<u32> {
    let words = SPLAT_WORDS[usize::from(depth)] as usize;
    let mut splats = vec![0u32; words * projected.splats.len()];
    let places = splats.par_chunks_exact_mut(words).zip(&projected.splats).zip(&projected.coverage).enumerate();
    places.with_min_len(1 << 12).for_each(|(i, ((to, splat), coverage))| {
        if *coverage != Coverage::NONE {
            pack(splat, projected.depths.get(i), to);
        }
    });
    splats
}

fn fits(what: &'static str, needed: u64, had: u32) -> Result<(), Error> {
    let had = u64::from(had);
    if needed > had { Err(Error::Overflow { what, needed, had }) } else { Ok(()) }
}

/// The words of a splat, as `splats.glsl` reads them; all 0 for one that is not shown.
fn pack(splat: &ProjectedSplat, depth: Option<&ProjectedDepth>, to: &mut [u32]) {
    let [half_x, half_y] = splat.half_extent.map(u32::from);
    let floats = splat.center_px.into_iter().chain(splat.conic).chain([splat.peak]);
    to.iter_mut().zip(floats).for_each(|(to, from)| *to = from.to_bits());
    to[6] = half_x | half_y << 16;
    to[7] = u32::from(splat.material) | u32::from(splat.footprint) << 16 | (splat.kind as u32) << 24;
    if let (Some(to), Some(depth)) = (to.get_mut(8..12), depth) {
        to.copy_from_slice(&[depth.center, depth.slope[0], depth.slope[1], depth.extent].map(f32::to_bits));
    }
}
