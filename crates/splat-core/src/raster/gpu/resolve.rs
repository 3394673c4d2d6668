//! Opaque splats as a recording: the GPU's twin of [`resolve_opaque`](crate::raster::resolve_opaque).
//!
//! Splats are listed by tile as translucent ones are, in the order of their ids. One workgroup a tile takes its list twice,
//! one thread a pixel: for the nearest depth, then for the weights of all fragments within ε-z of it.
//!
//! Deviations from the CPU: divisions, and on some devices fused products and sums, round otherwise. Where a fragment lies
//! within rounding of the edge of a disc or of ε-z, it may count on one side alone: depths and channels of such a pixel are
//! another blend of the same fragments, and so may the object be of fragments at one depth.
//!
//! ```
//! use splat_core::raster::gpu::resolve::{Capacities, record};
//!
//! let room = Capacities {
//!     size: [1280, 720],
//!     channels: 3,
//!     splats: 1_000_000,
//!     listed: 1_000_000,
//!     entries: 4_000_000,
//!     footprints: 3,
//!     objects: false,
//! };
//! record(room).unwrap().recording.check().unwrap();
//! ```

use super::list::{Counts, List, ListRoom};
use super::{
    Image, SPLAT_WORDS, check_ids, check_image, check_special, equal_lengths, fits, plain_view, table_bytes, tiles,
    words,
};
use crate::raster::kernel::Kernel;
use crate::raster::{OpaqueImage, OpaqueInput};
use crate::{Camera, Error, FootprintStack};
use splat_shaders::layouts::SplatView;
use splat_shaders::{BufferId, Groups, Recording, kernels};

/// What a recording makes room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Width and height of the image, pixels, 1 to 16384 each.
    pub size: [u32; 2],
    /// Channels, 1 to [`MAX_SHADED_CHANNELS`](crate::shade::MAX_SHADED_CHANNELS).
    pub channels: u32,
    /// Splats by id.
    pub splats: u32,
    /// Opaque ones.
    pub listed: u32,
    /// Pairs of a splat and a tile of 16 by 16 pixels that it reaches; a view of more is [`Error::Overflow`].
    pub entries: u32,
    /// Footprints.
    pub footprints: u32,
    /// Whether objects are kept.
    pub objects: bool,
}

impl Capacities {
    /// Numbers of a pixel: depth, channels, object.
    fn planes(&self) -> u32 {
        1 + self.channels + u32::from(self.objects)
    }
}

impl OpaqueInput<'_> {
    /// Room for this input, with so many entries.
    pub fn capacities(&self, entries: u32) -> Capacities {
        Capacities {
            size: self.projected.size,
            channels: self.channels,
            splats: self.projected.splats.len() as u32,
            listed: self.ids.len() as u32,
            entries,
            footprints: self.projected.kernels.len() as u32,
            objects: self.objects,
        }
    }
}

/// The recorded resolving and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What the device is to do.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: one [`SplatState`](splat_shaders::layouts::SplatState).
    pub state: BufferId,
    /// Read back: depths, then channels, then objects, row by row.
    pub image: BufferId,
    /// Input: the words of each splat by id, with depths, as [`words`] has them.
    pub splats: BufferId,
    /// Input: channels of each splat by id.
    pub values: BufferId,
    view: BufferId,
    ids: BufferId,
    tables: BufferId,
}

/// The bytes of some opaque splats.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    bytes: [Vec<u8>; 5],
}

/// Records the resolving with this room.
///
/// # Errors
/// [`Error::Invalid`] for a size or channels out of range.
pub fn record(capacities: Capacities) -> Result<Recorded, Error> {
    let Capacities { size, channels, splats, listed, entries, footprints, objects } = capacities;
    check_image(size, channels)?;
    let [_, tiles] = tiles(size);
    let area = u64::from(size[0]) * u64::from(size[1]);
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("resolve view", size_of::<SplatView>() as u64);
    let ids = r.input("opaque ids", words(listed));
    let at = r.input("splats", words(splats) * u64::from(SPLAT_WORDS[1]));
    let values = r.input("values", words(splats) * u64::from(channels));
    let tables = r.input("resolve tables", table_bytes(footprints, 0, if objects { splats } else { 0 }));
    let image = r.scratch("opaque image", 4 * area * u64::from(capacities.planes()));
    let room = ListRoom { tiles, ordered: listed, entries };
    let list = List::scratch(r, &room);
    let listed = list.record(r, &room, [view, ids, at]);
    let kernel = if channels == 3 { &kernels::SPLAT_RESOLVE_BEAUTY } else { &kernels::SPLAT_RESOLVE };
    r.dispatch(kernel, Groups::cover(tiles), &[view, list.starts, listed, at, values, tables, image], &[]);
    r.read(list.state);
    r.read(image);
    Ok(Recorded { recording, capacities, state: list.state, image, splats: at, values, view, ids, tables })
}

impl Recorded {
    /// The bytes that the recording takes for this input.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for, [`Error::ColumnLength`] for columns of different lengths,
    /// [`Error::Invalid`] for an id that no splat has.
    pub fn uploads(&self, input: &OpaqueInput<'_>) -> Result<Uploads, Error> {
        let projected = input.projected;
        let room = self.capacities;
        check_special(projected)?;
        let n = projected.splats.len();
        fits("splats", n as u64, room.splats)?;
        equal_lengths([
            ("image width", projected.size[0] as usize, room.size[0] as usize),
            ("image height", projected.size[1] as usize, room.size[1] as usize),
            ("values", input.values.len(), n * room.channels as usize),
            ("depths", projected.depths.len(), n),
        ])?;
        check_ids(input.ids, n)?;
        let given = [words(projected, true), input.values.iter().map(|v| v.to_bits()).collect()];
        self.bytes(projected.perspective, &projected.kernels, input.ids, &projected.objects, n, given)
    }

    /// The bytes that it takes where footprints and values come from recordings before it: view, ids and tables; `objects` by
    /// id, where they are kept.
    ///
    /// # Errors
    /// As [`Recorded::uploads`].
    pub fn uploads_beside_splats(
        &self,
        camera: &Camera,
        footprints: &FootprintStack,
        ids: &[u32],
        objects: &[u32],
    ) -> Result<Uploads, Error> {
        let kernels: Vec<Kernel> = footprints.layers().iter().map(Kernel::new).collect();
        let perspective = (!camera.is_orthographic()).then_some(camera.focal_px() as f32);
        let n = self.capacities.splats as usize;
        check_ids(ids, n)?;
        self.bytes(perspective, &kernels, ids, objects, n, [Vec::new(), Vec::new()])
    }

    fn bytes(
        &self,
        perspective: Option<f32>,
        kernels: &[Kernel],
        ids: &[u32],
        objects: &[u32],
        splats: usize,
        given: [Vec<u32>; 2],
    ) -> Result<Uploads, Error> {
        let room = self.capacities;
        fits("opaque splats", ids.len() as u64, room.listed)?;
        fits("footprints", kernels.len() as u64, room.footprints)?;
        let objects = if room.objects { objects } else { &[] };
        equal_lengths([("objects", objects.len(), if room.objects { splats } else { 0 })])?;
        let view = SplatView {
            ordered: ids.len() as u32,
            splat_words: SPLAT_WORDS[1],
            footprints: kernels.len() as u32,
            channels: room.channels,
            objects: u32::from(room.objects),
            ..plain_view(room.size, perspective)
        };
        let tables = Image::table(kernels, &[], objects);
        let cast = |words: &[u32]| bytemuck::cast_slice(words).to_vec();
        let [splats, values] = given;
        Ok(Uploads {
            bytes: [bytemuck::bytes_of(&view).to_vec(), cast(ids), cast(&splats), cast(&values), cast(&tables)],
        })
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> [(BufferId, &'a [u8]); 5] {
        let buffers = [self.view, self.ids, self.splats, self.values, self.tables];
        std::array::from_fn(|k| (buffers[k], &uploads.bytes[k][..]))
    }

    /// What a device did, from what was read back of [`Recorded::state`]. Lists are gone through twice, so that
    /// [`Counts::longest`] is twice the longest.
    ///
    /// # Errors
    /// As [`Recorded::finish`].
    pub fn counts(&self, state: &[u8]) -> Result<Counts, Error> {
        let counts = Counts::read(state, self.capacities.entries)?;
        Ok(Counts { longest: 2 * counts.longest, ..counts })
    }

    /// The image of what was read back of [`Recorded::state`] and [`Recorded::image`].
    ///
    /// # Errors
    /// [`Error::Overflow`] when there are more entries than there is room for: record again with what is needed.
    /// [`Error::ColumnLength`] for bytes that no run gave.
    pub fn finish(&self, buffers: [&[u8]; 2]) -> Result<(OpaqueImage, Counts), Error> {
        let [state, image] = buffers;
        let counts = self.counts(state)?;
        let room = self.capacities;
        let area: usize = room.size.map(|s| s as usize).iter().product();
        equal_lengths([("image read back", image.len(), 4 * area * room.planes() as usize)])?;
        let (words, _) = image.as_chunks::<4>();
        let mut words = words.iter().map(|w| u32::from_ne_bytes(*w));
        let mut plane = || -> Vec<f32> { (&mut words).take(area).map(f32::from_bits).collect() };
        let depth = plane();
        let channels = (0..room.channels).map(|_| plane()).collect();
        Ok((OpaqueImage { depth, channels, object: words.collect() }, counts))
    }
}
