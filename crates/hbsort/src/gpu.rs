//! The sort as a recording: cull and project, move the kept together, four passes of a stable radix sort.
//!
//! The order is that of [`crate::slice_cloud`] with [`Params::exact`], bit for bit: (slice, depth, id) is (depth, id),
//! because the slice is a monotone function of the depth. Depths come from the same products and sums, each rounded by
//! itself, and every pass of the radix sort keeps equal digits in their order. Each pass counts digits per block of
//! 2048 splats, scans the counts (reduce, spine, apply) and scatters; no workgroup waits for another.
//!
//! Deviation from Gunjee 2007, section 4.2: no buckets of slices. A radix sort moves the same bytes for any ε, and the
//! slices are cut from the sorted depths when they are read back.
//!
//! A device limits how many bytes of a buffer its kernels can see ([`Capacities::most_splats`]). More splats are sorted in parts,
//! one after the other ([`Recorded::sorted`]), and joined on the host ([`join`]): the same order, bit for bit.
//!
//! ```
//! use hbsort::gpu::{Capacities, record};
//!
//! let recorded = record(Capacities { splats: 1_000_000, kept: 400_000 });
//! recorded.recording.check().unwrap();
//! // A splat has 20 bytes of input and a key of 4; kept splats move to and fro between two tables of 8 bytes an entry.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 30);
//! ```

mod parts;
mod run;

use crate::project::{Frustum, bounding_radius};
use crate::radix::depth_of_key;
use crate::slicing::Slicing;
use crate::sort::{check_count, check_ids};
use crate::{Error, Params};
use glam::DVec3;
use splat_core::{Camera, Cloud, Direction, SliceOrder};
use splat_shaders::kernels;
use splat_shaders::layouts::{Scan, SortState, SortView};
use splat_shaders::radix::{SCAN_BLOCK, Scanned, SortPass, sort_pass};
use splat_shaders::{BufferId, Groups, Overflow, Recording};

pub use parts::{Sorted, join};
pub use run::{SliceRun, slice_cloud_on};

/// Splats that a workgroup projects.
const PROJECT_BLOCK: u32 = 1024;

/// Capacities of a recording, in elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Splats that are looked at.
    pub splats: u32,
    /// Splats that may be in the view at once, at most `splats`; a view of more is [`Error::Overflow`].
    pub kept: u32,
}

/// The recorded sort and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The commands of the device.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Input: one [`SortView`].
    pub view: BufferId,
    /// Input: three f32 a splat, world offsets.
    pub positions: BufferId,
    /// Input: two f32 a splat, the radius of its kernel and of the sphere that holds it.
    pub radii: BufferId,
    /// Read back: one [`SortState`].
    pub state: BufferId,
    /// Read back: keys of the depths in order.
    pub keys: BufferId,
    /// Read back: places of the splats in order.
    pub places: BufferId,
}

/// The bytes of a view and its splats.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    view: Vec<u8>,
    positions: Vec<u8>,
    radii: Vec<u8>,
}

/// Records a sort with this room.
pub fn record(capacities: Capacities) -> Recorded {
    let Capacities { splats, kept } = capacities;
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("view", size_of::<SortView>() as u64);
    let positions = r.input("positions", 3 * words(splats));
    let radii = r.input("radii", 2 * words(splats));
    let state = r.scratch("state", size_of::<SortState>() as u64);
    let blocks = splats.div_ceil(PROJECT_BLOCK);
    let block_scan = r.scratch("block scan", size_of::<Scan>() as u64);
    let blocks_kept = Scanned::scratch(r, block_scan, ["block places", "block sums"], blocks);
    let block_places = blocks_kept.numbers;
    let all_keys = r.scratch("all keys", words(splats));
    let keys = [r.scratch("keys", words(kept)), r.scratch("keys'", words(kept))];
    let places = [r.scratch("places", words(kept)), r.scratch("places'", words(kept))];
    let digit_scan = r.scratch("digit scan", size_of::<Scan>() as u64);
    let digits = Scanned::digits(r, digit_scan, kept);

    r.dispatch(&kernels::HBSORT_BEGIN, Groups::cover(1), &[view, state, block_scan], &[]);
    let projected = [view, positions, radii, all_keys, block_places, state];
    r.dispatch(&kernels::HBSORT_PROJECT, Groups::cover(blocks), &projected, &[]);
    blocks_kept.record(r, Groups::cover(blocks.div_ceil(SCAN_BLOCK)));
    let compacted = [view, all_keys, block_places, keys[0], places[0]];
    r.dispatch(&kernels::HBSORT_COMPACT, Groups::cover(blocks), &compacted, &[kept]);
    r.dispatch(&kernels::HBSORT_PREPARE, Groups::cover(1), &[block_scan, state, digit_scan], &[kept]);
    for pass in 0..4 {
        let from = pass % 2;
        let to = 1 - pass % 2;
        sort_pass(
            r,
            SortPass {
                shift: 8 * pass as u32,
                state,
                from: [keys[from], places[from]],
                to: [keys[to], places[to]],
                digits,
            },
        );
    }
    r.read(state);
    r.read(keys[0]);
    r.read(places[0]);
    Recorded { recording, capacities, view, positions, radii, state, keys: keys[0], places: places[0] }
}

impl Recorded {
    /// The bytes that the recording takes for this view of a cloud, or of the splats `ids` of it.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more splats than there is room for, [`Error::Ids`], [`Error::Limit`].
    pub fn uploads(
        &self,
        cloud: &Cloud,
        ids: Option<&[u32]>,
        camera: &Camera,
        params: &Params,
    ) -> Result<Uploads, Error> {
        let len = cloud.len().min(cloud.radius.len());
        check_count(len)?;
        ids.map_or(Ok(()), |ids| check_ids(ids, len))?;
        let needed = ids.map_or(len, <[u32]>::len) as u64;
        let had = u64::from(self.capacities.splats);
        if needed > had {
            return Err(Error::Overflow(Overflow { what: "splats", needed, had }));
        }
        let id = |place: usize| ids.map_or(place, |ids| ids[place] as usize);
        let places = || (0..needed as usize).map(id);
        let positions: Vec<f32> = places().flat_map(|i| cloud.position[i].to_array()).collect();
        let radii: Vec<f32> =
            places().flat_map(|i| [cloud.radius[i], bounding_radius(cloud.radius[i], cloud.tangent_of(i))]).collect();
        let view = view_bytes(cloud.origin, needed as u32, camera, params);
        let bytes = |floats: &[f32]| bytemuck::cast_slice(floats).to_vec();
        Ok(Uploads { view, positions: bytes(&positions), radii: bytes(&radii) })
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> [(BufferId, &'a [u8]); 3] {
        [(self.view, &uploads.view), (self.positions, &uploads.positions), (self.radii, &uploads.radii)]
    }

    /// The order, from the bytes that were read back of [`Recorded::state`], [`Recorded::keys`] and
    /// [`Recorded::places`] after a run with the uploads of the same arguments.
    ///
    /// # Errors
    /// [`Error::Overflow`] when the view holds more splats than there is room for, [`Error::Thickness`],
    /// [`Error::ReadBack`] for bytes that no run gave.
    pub fn order(
        &self,
        buffers: [&[u8]; 3],
        cloud: &Cloud,
        ids: Option<&[u32]>,
        params: &Params,
    ) -> Result<SliceOrder, Error> {
        let [state, keys, places] = buffers;
        join(&[self.sorted([state, keys, places], cloud, ids)?], cloud, ids, params)
    }
}

/// The bytes of [`Recorded::view`] for the first `splats` of the splats, whose positions are relative to `origin`: all that
/// a recording takes whose positions and radii another one uploads.
pub fn view_bytes(origin: DVec3, splats: u32, camera: &Camera, params: &Params) -> Vec<u8> {
    let view = camera.view_from_offset(origin);
    let frustum = Frustum::new(camera, params.margin_px);
    let view = SortView {
        axis_x: view.rotation.x_axis.extend(0.0).to_array(),
        axis_y: view.rotation.y_axis.extend(0.0).to_array(),
        axis_z: view.rotation.z_axis.extend(0.0).to_array(),
        translation: view.translation.extend(0.0).to_array(),
        plane_cos: frustum.cos,
        plane_sin: frustum.sin,
        half_extent: frustum.half,
        splats,
        back_to_front: u32::from(params.direction == Direction::BackToFront),
    };
    bytemuck::bytes_of(&view).to_vec()
}

/// Where each slice begins among the sorted keys, then their number; and which slices these are, counted from near.
fn slices_of(slicing: &Slicing, keys: impl ExactSizeIterator<Item = u32>) -> (Vec<u32>, Vec<u64>) {
    let end = keys.len() as u32;
    let mut starts = Vec::new();
    let mut indices = Vec::new();
    // The slice of the last key that was asked for its slice, and the keys that surely share it.
    let mut current: Option<(u64, u32)> = None;
    for (at, key) in (0u32..).zip(keys) {
        let depth = depth_of_key(if slicing.direction == Direction::BackToFront { !key } else { key });
        let relative = slicing.relative_key(depth);
        if current.is_some_and(|(_, surely)| relative <= surely) {
            continue;
        }
        let slice = slicing.slice_of(depth);
        if current.is_none_or(|(last, _)| last != slice) {
            starts.push(at);
            indices.push(slice);
            current = Some((slice, slicing.surely_within(slice)));
        }
    }
    starts.push(end);
    (starts, indices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radix::key_of;

    #[test]
    fn bs01_slices_of_sorted_keys_are_those_of_their_depths() {
        for direction in [Direction::FrontToBack, Direction::BackToFront] {
            let mut depths: Vec<f32> = (0..500u16).map(|i| 1.0 + f32::from(i % 97) * 0.0931).collect();
            depths.sort_by(f32::total_cmp);
            if direction == Direction::BackToFront {
                depths.reverse();
            }
            let slicing = Slicing::new(1.0, 10.0, 0.25, direction, 0);
            let key = |depth: &f32| if direction == Direction::BackToFront { !key_of(*depth) } else { key_of(*depth) };
            let (starts, indices) = slices_of(&slicing, depths.iter().map(key));
            let of_depths: Vec<u64> = depths.iter().map(|depth| slicing.slice_of(*depth)).collect();
            let (mut begins, mut slices): (Vec<u32>, Vec<u64>) = (0..500)
                .filter(|at| *at == 0 || of_depths[*at] != of_depths[*at - 1])
                .map(|at| (at as u32, of_depths[at]))
                .unzip();
            begins.push(500);
            slices.dedup();
            assert!(slices.len() > 20);
            assert_eq!((starts, indices), (begins, slices), "{direction:?}");
        }
    }
}
