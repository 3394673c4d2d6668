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
//! square of length over thickness. Single precision only. Depths (which the cut-off moves as it does channels) and objects are
//! made where they are asked for.
//!
//! [`project`] makes the footprints on the device too, and [`follow`] composites what a sort on the device has ordered:
//! joined ([`Recording::join`]), splats are uploaded once and the image alone comes back. [`resolve`] draws the opaque surfaces
//! that hide them.
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
//!     depths: false,
//!     objects: false,
//! };
//! let recorded = record(room).unwrap();
//! recorded.recording.check().unwrap();
//! // 32 bytes a splat and 12 of its channels come in; an entry takes 16, to and fro.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 131);
//! ```

mod attributes;
pub mod follow;
mod list;
mod packed;
mod planes;
pub mod project;
pub mod resolve;

pub use attributes::{AttributeBuffers, AttributeRoom, Attributes};
pub use list::Counts;
pub use packed::words;

use super::bins::TILE as TWIN_TILE;
use super::kernel::{Kernel, TABLE};
use super::projected::{Coverage, ProjectedSplat};
use super::{Accumulation, FoldInput, OpaqueImage, Params, Projected};
use crate::shade::{ChannelLayout, MAX_SHADED_CHANNELS};
use crate::{Accumulator, Direction, Error, Material};
use list::{List, ListRoom};
use packed::SPLAT_WORDS;
use rayon::prelude::*;
use splat_shaders::layouts::{MOST_CHANNELS, SortState, SplatView};
use splat_shaders::{BufferId, Groups, Overflow, Recording, kernels};

/// Side of a tile, pixels.
pub const TILE: u32 = 16;
/// The widest image, pixels a side: what one workgroup counts then fits 32 bits.
const WIDEST: u32 = 16_384;

const _: () =
    assert!(MAX_SHADED_CHANNELS == MOST_CHANNELS as usize, "kernels make room for every effect that shading gives");
const _: () = assert!(TWIN_TILE == 32, "`composite.glsl` counts offsets from the corners of the CPU's tiles");

/// What a recording makes room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Width and height of the image, pixels, 1 to 16384 each.
    pub size: [u32; 2],
    /// Planes of optical depth, 1 or 3.
    pub planes: u32,
    /// Channels, 1 to [`MAX_SHADED_CHANNELS`].
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
    /// Whether depths are made, front to back.
    pub depths: bool,
    /// Whether objects are kept.
    pub objects: bool,
}

impl Capacities {
    /// Words of a splat: with depths where something asks for them.
    fn splat_words(&self) -> u32 {
        SPLAT_WORDS[usize::from(self.needs_depth())]
    }

    /// Whether splats come with their depths.
    pub fn needs_depth(&self) -> bool {
        self.opaque || self.depths
    }

    /// Numbers of a pixel.
    fn planes_of_pixel(&self) -> u32 {
        let depths = if self.depths { crate::compositing::depth_profile::WORDS as u32 } else { 0 };
        self.planes + self.channels + depths + u32::from(self.objects)
    }

    fn check(&self) -> Result<(), Error> {
        if !matches!(self.planes, 1 | 3) {
            return refused("planes of optical depth", self.planes.to_string(), "1 or 3");
        }
        check_image(self.size, self.channels)
    }
}

fn refused<T>(name: &'static str, found: String, expected: &'static str) -> Result<T, Error> {
    Err(Error::invalid("recording", 0, name, found, expected))
}

fn check_image(size: [u32; 2], channels: u32) -> Result<(), Error> {
    if !size.iter().all(|s| (1..=WIDEST).contains(s)) {
        return refused("size", format!("{size:?}"), "1 to 16384 pixels a side");
    }
    if !(1..=MAX_SHADED_CHANNELS).contains(&(channels as usize)) {
        return refused("channels", channels.to_string(), "1 to as many as all effects, a normal and a shadow have");
    }
    Ok(())
}

impl FoldInput<'_> {
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
            depths: !accumulator.depth.is_empty(),
            objects: !accumulator.object.is_empty(),
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
    /// By id, where they are kept.
    objects: &'a [u32],
    /// Whether the depths of what hides splats are there already.
    hidden: bool,
}

impl<'a> Image<'a> {
    fn new(input: &FoldInput<'a>) -> Self {
        let FoldInput { projected, order, materials, opaque, direction, params, .. } = *input;
        let size = projected.size;
        let perspective = projected.perspective;
        let kernels = &projected.kernels[..];
        let ordered = order.len() as u32;
        let objects = &projected.objects[..];
        Self { size, perspective, kernels, materials, opaque, direction, params, ordered, objects, hidden: false }
    }

    fn tables(&self, objects: bool) -> Vec<u32> {
        Self::table(self.kernels, self.materials, if objects { self.objects } else { &[] })
    }

    /// Footprints, extinctions, objects: four words a vector.
    fn table(kernels: &[Kernel], materials: &[Material], objects: &[u32]) -> Vec<u32> {
        let footprints = kernels.iter().flat_map(|kernel| kernel.table().map(f32::to_bits));
        let extinctions = materials.iter().flat_map(|m| {
            let [r, g, b] = m.extinction_rgb.map(f32::to_bits);
            [r, g, b, 0]
        });
        footprints.chain(extinctions).chain(objects.iter().copied()).collect()
    }
}

/// Bytes of `Image::table`.
fn table_bytes(footprints: u32, materials: u32, objects: u32) -> u64 {
    let footprints = 4 * TABLE as u64 * u64::from(footprints);
    footprints + 16 * (u64::from(materials) + u64::from(objects.div_ceil(4)))
}

/// The recorded compositing and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What the device is to do.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: one [`SplatState`](splat_shaders::layouts::SplatState).
    pub state: BufferId,
    /// Input, and read back: planes of optical depth, then channels, row by row.
    pub planes: BufferId,
    /// Input: the words of each splat by id, as [`words`] has them.
    pub splats: BufferId,
    /// Input: ids in compositing order.
    pub order: BufferId,
    /// Input: channels of each splat by id.
    pub values: BufferId,
    /// Input: depths of the opaque surface, row by row.
    pub opaque: BufferId,
    /// Of a recording by [`follow::record`]: the input that says how many splats are in the order.
    pub sorted: Option<BufferId>,
    inputs: [BufferId; 6],
}

/// The bytes of some splats.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    bytes: [Vec<u8>; 7],
}

/// Tiles of an image, across and in all.
fn tiles(size: [u32; 2]) -> [u32; 2] {
    let [columns, rows] = size.map(|s| s.div_ceil(TILE));
    [columns, columns * rows]
}

/// The view of an image of which nothing else is known.
fn plain_view(size: [u32; 2], perspective: Option<f32>) -> SplatView {
    let [columns, tiles] = tiles(size);
    let size = size.map(|s| s as f32);
    let middle = size.map(|s| 0.5 * s);
    SplatView { middle, size, focal: perspective.unwrap_or(0.0), columns, tiles, ..SplatView::default() }
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
    let Capacities { size, channels, splats, ordered, entries, .. } = capacities;
    let [_, tiles] = tiles(size);
    let area = u64::from(size[0]) * u64::from(size[1]);
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("view", size_of::<SplatView>() as u64);
    let order = r.input("order", words(ordered));
    let footprints = r.input("splats", words(splats) * u64::from(capacities.splat_words()));
    let values = r.input("values", words(splats) * u64::from(channels));
    let objects = if capacities.objects { splats } else { 0 };
    let tables = r.input("tables", table_bytes(capacities.footprints, capacities.materials, objects));
    let opaque = r.input("opaque", if capacities.opaque { 4 * area } else { 0 });
    let planes = r.input("planes", 4 * area * u64::from(capacities.planes_of_pixel()));
    let room = ListRoom { tiles, ordered, entries };
    let list = List::scratch(r, &room);
    let sorted = follows.then(|| r.input("sorted", size_of::<SortState>() as u64));
    if let Some(sorted) = sorted {
        r.dispatch(&kernels::SPLAT_FOLLOW, Groups::cover(1), &[sorted, view], &[]);
    }
    let ids = list.record(r, &room, [view, order, footprints]);
    let kernel = match (capacities.depths || capacities.objects, capacities.planes, channels) {
        (true, ..) => &kernels::SPLAT_COMPOSITE_LAYERS,
        (false, 1, 3) => &kernels::SPLAT_COMPOSITE_BEAUTY,
        (false, ..) => &kernels::SPLAT_COMPOSITE,
    };
    let composited = [view, list.starts, ids, footprints, values, tables, opaque, planes];
    r.dispatch(kernel, Groups::cover(tiles), &composited, &[]);
    r.read(list.state);
    r.read(planes);
    let inputs = [view, order, footprints, values, tables, opaque];
    let state = list.state;
    let splats = footprints;
    Ok(Recorded { recording, capacities, state, planes, splats, order, values, opaque, sorted, inputs })
}

impl Recorded {
    /// The bytes that the recording takes for this input and what `accumulator` holds already.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for, [`Error::ColumnLength`] for columns of different lengths,
    /// [`Error::Invalid`] for an id that no splat has and for what only the CPU does: half precision, depth and object
    /// planes.
    pub fn uploads(&self, input: &FoldInput<'_>, accumulator: &Accumulator) -> Result<Uploads, Error> {
        let image = Image::new(input);
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
        let tables = image.tables(self.capacities.objects);
        let fresh = planes::is_fresh(accumulator);
        let begun = if fresh { Vec::new() } else { planes::words(accumulator) };
        let view = self.view(image, opaque || image.hidden, fresh);
        let solid: &[f32] = if opaque { &image.opaque.depth } else { &[] };
        let [order, splats, values] = given;
        Uploads {
            bytes: [
                bytemuck::bytes_of(&view).to_vec(),
                order,
                splats,
                values,
                bytemuck::cast_slice(&tables).to_vec(),
                bytemuck::cast_slice(solid).to_vec(),
                bytemuck::cast_slice(&begun).to_vec(),
            ],
        }
    }

    /// The words of all splats, whose ids are known.
    fn splats(&self, input: &FoldInput<'_>) -> Result<Vec<u32>, Error> {
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
        Ok(words(projected, self.capacities.needs_depth()))
    }

    fn view(&self, image: &Image<'_>, opaque: bool, fresh: bool) -> SplatView {
        let room = self.capacities;
        SplatView {
            cutoff: image.params.transmittance_cutoff,
            ordered: image.ordered,
            splat_words: room.splat_words(),
            footprints: image.kernels.len() as u32,
            planes: room.planes,
            channels: room.channels,
            colors: ChannelLayout::colors_of(room.channels as usize) as u32,
            opaque: u32::from(opaque),
            back_to_front: u32::from(image.direction == Direction::BackToFront),
            fresh: u32::from(fresh),
            materials: image.materials.len() as u32,
            depths: u32::from(room.depths),
            objects: u32::from(room.objects),
            ..plain_view(room.size, image.perspective)
        }
    }

    fn check_image(&self, image: &Image<'_>, accumulator: &Accumulator) -> Result<(), Error> {
        let room = self.capacities;
        let only_cpu = |what, found: String, expected| Err(Error::invalid("accumulator", 0, what, found, expected));
        if image.params.accumulation != Accumulation::F32 {
            return only_cpu("precision", format!("{:?}", image.params.accumulation), "F32 on a device");
        }
        if room.depths && image.direction == Direction::BackToFront {
            return only_cpu("direction", "back to front".to_owned(), "front to back, as depths are made");
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
        let of_layer = |on: bool| if on { area } else { 0 };
        let layers = [
            ("depths", accumulator.depth.len(), of_layer(room.depths)),
            ("objects", accumulator.object.len(), of_layer(room.objects)),
        ];
        let planes = planes::sums(accumulator).map(|plane| ("plane", plane.len(), area));
        equal_lengths(lengths.into_iter().chain(layers).chain(planes))
    }

    fn check_splats(&self, input: &FoldInput<'_>) -> Result<(), Error> {
        let projected = input.projected;
        let room = self.capacities;
        check_special(projected)?;
        let n = projected.splats.len();
        fits("splats", n as u64, room.splats)?;
        fits("splats in order", input.order.len() as u64, room.ordered)?;
        let depths = projected.depths.len();
        let objects = projected.objects.len();
        equal_lengths([
            ("values", input.values.len(), n * room.channels as usize),
            ("depths", depths, if room.needs_depth() { n } else { depths }),
            ("objects", objects, if room.objects { n } else { objects }),
        ])?;
        check_ids(input.order, n)
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
    pub fn finish(&self, buffers: [&[u8]; 2], accumulator: &mut Accumulator) -> Result<Counts, Error> {
        let [state, planes] = buffers;
        let counts = self.counts(state)?;
        planes::put(planes, accumulator)?;
        Ok(counts)
    }

    /// What a device did, from what was read back of [`Recorded::state`].
    ///
    /// # Errors
    /// As [`Recorded::finish`].
    pub fn counts(&self, state: &[u8]) -> Result<Counts, Error> {
        Counts::read(state, self.capacities.entries)
    }
}

/// Discs of which their conics do not tell everything are the processor's.
fn check_special(projected: &Projected) -> Result<(), Error> {
    match projected.special.len() {
        0 => Ok(()),
        n => refused("discs through the eye plane or with images as footprints", n.to_string(), "none"),
    }
}

fn check_ids(ids: &[u32], splats: usize) -> Result<(), Error> {
    let wrong = ids.par_iter().with_min_len(1 << 14).position_first(|&id| id as usize >= splats);
    wrong.map_or(Ok(()), |at| Err(Error::invalid("place", at, "id", ids[at], "the id of a splat")))
}

fn equal_lengths(lengths: impl IntoIterator<Item = (&'static str, usize, usize)>) -> Result<(), Error> {
    let wrong = lengths.into_iter().find(|(_, found, expected)| found != expected);
    wrong.map_or(Ok(()), |(attribute, found, expected)| Err(Error::ColumnLength { attribute, found, expected }))
}

fn fits(what: &'static str, needed: u64, had: u32) -> Result<(), Error> {
    let had = u64::from(had);
    if needed > had { Err(Error::Overflow(Overflow { what, needed, had })) } else { Ok(()) }
}
