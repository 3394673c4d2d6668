//! Merges the orders of parts of a cloud, for more splats than a device's kernels can see in one buffer.
//!
//! A part is a run of the ids. Parts are sorted one after the other by one recording, and merged here by (depth, id),
//! which no two splats share: the result is that of all splats at once, however they were cut.

use super::{Capacities, Recorded, record, slices_of};
use crate::radix::depth_of_key;
use crate::slicing::Slicing;
use crate::{Error, Params, ThicknessRule, thickness};
use rayon::prelude::*;
use splat_core::{Cloud, SliceOrder};
use splat_shaders::Overflow;
use splat_shaders::layouts::SortState;

/// Keys that a part gives to find ranges of about equal size, each of which is merged by one task.
const SAMPLES: usize = 64;

impl Capacities {
    /// The most splats of a part for which no buffer is larger than this; 0 where not even one splat fits.
    pub fn most_splats(binding_bytes: u64) -> u32 {
        // Positions are the largest buffer of many splats, counts of digits that of few.
        let splats = u32::try_from(binding_bytes / 12).unwrap_or(u32::MAX);
        let recorded = record(Self { splats, kept: splats });
        let fits = recorded.recording.buffers().iter().all(|b| b.bytes <= binding_bytes);
        if fits { splats } else { 0 }
    }
}

/// The splats of a part in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Sorted {
    /// Key of the depth above, id below.
    entries: Vec<u64>,
    near_key: u32,
    far_key: u32,
    radius_key: u32,
    /// Splats that were given, culled ones included.
    splats: usize,
}

impl Recorded {
    /// The splats of a part in order, from the bytes that were read back of [`Recorded::state`], [`Recorded::keys`] and
    /// [`Recorded::places`] after a run with the uploads of the same arguments.
    ///
    /// # Errors
    /// [`Error::Overflow`] when the view holds more splats than there is room for, [`Error::ReadBack`] for bytes that no
    /// run gave.
    pub fn sorted(&self, buffers: [&[u8]; 3], cloud: &Cloud, ids: Option<&[u32]>) -> Result<Sorted, Error> {
        let [state, keys, places] = buffers;
        let state_bytes = state.get(..size_of::<SortState>());
        let state: SortState =
            bytemuck::pod_read_unaligned(state_bytes.ok_or(short("state", size_of::<SortState>(), state.len()))?);
        if state.kept > self.capacities.kept {
            let needed = state.kept.into();
            let had = self.capacities.kept.into();
            return Err(Error::Overflow(Overflow { what: "splats in the view", needed, had }));
        }
        let splats = ids.map_or(cloud.len().min(cloud.radius.len()), <[u32]>::len);
        let kept = (state.kept as usize).min(splats);
        let words = |what, bytes: &[u8]| -> Result<Vec<u32>, Error> {
            let used = bytes.get(..4 * kept).ok_or(short(what, 4 * kept, bytes.len()))?;
            let (words, _) = used.as_chunks::<4>();
            Ok(words.iter().map(|w| u32::from_ne_bytes(*w)).collect())
        };
        let keys = words("keys", keys)?;
        let places = words("places", places)?;
        if let Some(&wrong) = places.iter().find(|&&p| p as usize >= splats) {
            return Err(short("places", splats, wrong as usize));
        }
        let id_of = |place: u32| ids.map_or(place, |ids| ids[place as usize]);
        let entries = keys.into_iter().zip(places).map(|(key, place)| u64::from(key) << 32 | u64::from(id_of(place)));
        let SortState { near_key, far_key, radius_key, .. } = state;
        Ok(Sorted { entries: entries.collect(), near_key, far_key, radius_key, splats })
    }
}

/// The order of a cloud, or of the splats `ids` of it, from the orders of its parts.
///
/// # Errors
/// [`Error::Thickness`]; [`Error::ReadBack`] when the parts are not those of all these splats.
pub fn join(parts: &[Sorted], cloud: &Cloud, ids: Option<&[u32]>, params: &Params) -> Result<SliceOrder, Error> {
    let given = params.given_thickness()?;
    let n = ids.map_or(cloud.len().min(cloud.radius.len()), <[u32]>::len);
    let splats = parts.iter().map(|part| part.splats).sum();
    if splats != n {
        return Err(short("parts of splats", n, splats));
    }
    let entries = merged(parts);
    if entries.is_empty() {
        return Ok(SliceOrder { direction: params.direction, culled: n as u64, ..SliceOrder::default() });
    }
    let least = |key: fn(&Sorted) -> u32| parts.iter().map(key).min().unwrap_or(u32::MAX);
    let far_key = parts.iter().map(|part| part.far_key).max().unwrap_or(0);
    let near = depth_of_key(least(|part| part.near_key));
    let far = depth_of_key(far_key);
    let radius_at = |place: usize| cloud.radius[ids.map_or(place, |ids| ids[place] as usize)];
    let chosen = || {
        let span = f64::from(far) - f64::from(near);
        thickness::choose(span, depth_of_key(least(|part| part.radius_key)), n, &radius_at)
    };
    let (thickness, _) = given.map_or_else(chosen, |t| (t, ThicknessRule::Given));
    let slicing = Slicing::new(near, far, thickness, params.direction, 0);
    let (slice_starts, slice_indices) = slices_of(&slicing, entries.iter().map(|entry| (entry >> 32) as u32));
    Ok(SliceOrder {
        slice_starts,
        slice_indices,
        direction: params.direction,
        near,
        far,
        thickness,
        slices: slicing.slices,
        culled: (n - entries.len()) as u64,
        input_from_sorted: entries.into_iter().map(|entry| entry as u32).collect(),
    })
}

fn short(what: &'static str, expected: usize, found: usize) -> Error {
    Error::ReadBack { what, expected: expected as u64, found: found as u64 }
}

/// All entries in order. Ranges of keys are merged side by side.
fn merged(parts: &[Sorted]) -> Vec<u64> {
    if let [one] = parts {
        return one.entries.clone();
    }
    let samples = |part: &Sorted| {
        let every = part.entries.len().div_ceil(SAMPLES).max(1);
        part.entries.iter().copied().step_by(every).collect::<Vec<_>>()
    };
    let mut samples: Vec<u64> = parts.iter().flat_map(samples).collect();
    samples.sort_unstable();
    let bounds: Vec<u64> = samples.into_iter().step_by(parts.len().max(1)).skip(1).collect();
    let range = |r: usize| {
        let place = |part: &Sorted, bound: Option<&u64>, end: usize| {
            bound.map_or(end, |bound| part.entries.partition_point(|entry| entry < bound))
        };
        let mut range = Vec::new();
        for part in parts {
            let from = place(part, r.checked_sub(1).and_then(|before| bounds.get(before)), 0);
            range.extend_from_slice(&part.entries[from..place(part, bounds.get(r), part.entries.len())]);
        }
        // The runs are in order each: the stable sort finds them and merges.
        range.sort();
        range
    };
    let ranges: Vec<Vec<u64>> = (0..=bounds.len()).into_par_iter().map(range).collect();
    ranges.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radix::key_of;
    use crate::{Direction, Scratch, slice_cloud};
    use splat_core::glam::{DVec3, Vec3};
    use splat_core::{Camera, Projection, Splat, rng};

    #[test]
    fn parts_of_any_size_are_merged() {
        for sizes in [&[][..], &[0], &[5], &[0, 1, 0], &[1000, 1, 3000, 0, 77], &[4000; 9]] {
            let part = |(p, size): (u64, &usize)| {
                // Few keys, so that many are equal; ids tell all apart.
                let entry = |i: u64| u64::from(rng::bits(p, i, 0, 1) as u32 % 50) << 32 | (p << 16 | i);
                let mut entries: Vec<u64> = (0..*size as u64).map(entry).collect();
                entries.sort_unstable();
                Sorted { entries, near_key: 0, far_key: 0, radius_key: 0, splats: *size }
            };
            let parts: Vec<Sorted> = (0..).zip(sizes).map(part).collect();
            let mut expected: Vec<u64> = parts.iter().flat_map(|part| part.entries.clone()).collect();
            expected.sort_unstable();
            assert_eq!(merged(&parts), expected, "{sizes:?}");
        }
    }

    /// The bytes that a run would give for the splats `ids` of a cloud of which the camera at 0 sees all, along −z.
    fn read_back(cloud: &Cloud, ids: &[u32]) -> [Vec<u8>; 3] {
        let depth = |place: &u32| -cloud.position[ids[*place as usize] as usize].z;
        let mut places: Vec<u32> = (0..ids.len() as u32).collect();
        places.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        let keys: Vec<u32> = places.iter().map(|place| key_of(depth(place))).collect();
        let smallest = ids.iter().map(|id| cloud.radius[*id as usize]).fold(f32::INFINITY, f32::min);
        let kept = keys.len() as u32;
        let [near_key, far_key] = [keys[0], keys[keys.len() - 1]];
        let state = SortState { kept, near_key, far_key, radius_key: key_of(smallest), ..bytemuck::Zeroable::zeroed() };
        [bytemuck::bytes_of(&state), bytemuck::cast_slice(&keys), bytemuck::cast_slice(&places)].map(<[u8]>::to_vec)
    }

    #[test]
    fn what_devices_read_back_is_joined_to_the_order_of_the_processor() {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..3000 {
            let at = |k| rng::unit_f32(9, 1, i, k) - 0.5;
            // Many are equally deep.
            let position = Vec3::new(at(0), at(1), -1.0 - (200.0 * (at(2) + 0.5)).floor() / 64.0);
            cloud.push(&Splat { position, radius: 0.05 + 0.01 * at(3), ..Splat::default() });
        }
        let sight = Projection::Orthographic { height: 4.0 };
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, sight, [64, 64]).unwrap();
        let params = Params { direction: Direction::FrontToBack, exact: true, ..Params::default() };
        let ids: Vec<u32> = (0..3000).filter(|i| i % 7 != 3).collect();
        let expected = slice_cloud(&cloud, Some(&ids), &camera, &params, &mut Scratch::new()).unwrap();
        let recorded = record(Capacities { splats: 3000, kept: 3000 });
        for sizes in [&[ids.len()][..], &[1000, 1, ids.len() - 1001]] {
            let mut rest = &ids[..];
            let part = |size: &usize| {
                let (taken, others) = rest.split_at(*size);
                rest = others;
                let bytes = read_back(&cloud, taken);
                recorded.sorted([&bytes[0], &bytes[1], &bytes[2]], &cloud, Some(taken)).unwrap()
            };
            let parts: Vec<Sorted> = sizes.iter().map(part).collect();
            assert_eq!(join(&parts, &cloud, Some(&ids), &params).unwrap(), expected, "{sizes:?}");
        }
        assert!(expected.slice_indices.len() > 20 && expected.slices > 20);
    }

    #[test]
    fn the_most_splats_fit_and_one_more_does_not() {
        let largest = |splats| {
            let recorded = record(Capacities { splats, kept: splats });
            recorded.recording.buffers().iter().map(|b| b.bytes).max()
        };
        for bytes in [1024u64, 4096, 65_536, 128 << 20] {
            let most = Capacities::most_splats(bytes);
            assert!(most > 0 && largest(most) <= Some(bytes) && largest(most + 1) > Some(bytes), "{bytes}: {most}");
        }
        assert_eq!([Capacities::most_splats(0), Capacities::most_splats(512)], [0, 0]);
    }
}
