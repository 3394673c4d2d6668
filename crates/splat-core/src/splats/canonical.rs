//! Canonical order of a cloud: Morton code of the position, then all attribute bits, so that nothing depends on the
//! order of a file.

use crate::{Aabb, Cloud};
use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Bits per axis of the Morton code.
const BITS: u32 = 21;

impl Cloud {
    /// Puts the splats in canonical order, see [`Cloud::canonical_order`].
    pub fn canonicalize(&mut self) {
        *self = self.gather(&self.canonical_order());
    }

    /// Places of the splats in canonical order: by the Morton code of their position within the cloud's bounds, then by
    /// the bits of all attributes. Shuffled input gives the same splats in this order bit by bit; identical splats are
    /// interchangeable.
    pub fn canonical_order(&self) -> Vec<u32> {
        let bounds = self.bounds();
        let mut keys: Vec<(u64, u32)> = self
            .position
            .par_iter()
            .enumerate()
            .with_min_len(8192)
            .map(|(i, p)| (morton(*p, &bounds), i as u32))
            .collect();
        keys.par_sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then_with(|| compare_splats(self, a.1 as usize, b.1 as usize)).then(a.1.cmp(&b.1))
        });
        keys.into_par_iter().with_min_len(8192).map(|(_, i)| i).collect()
    }
}

/// Interleaves 21 bits an axis of the position within `bounds`.
fn morton(p: Vec3, bounds: &Aabb) -> u64 {
    let extent = bounds.max - bounds.min;
    let axis = |v: f32, min: f32, extent: f32| -> u64 {
        // Bounds contain the point, so the ratio lies in [0, 1]; a flat axis has no bits.
        if extent > 0.0 { ((f64::from(v - min) / f64::from(extent)) * f64::from((1u32 << BITS) - 1)) as u64 } else { 0 }
    };
    spread(axis(p.x, bounds.min.x, extent.x))
        | spread(axis(p.y, bounds.min.y, extent.y)) << 1
        | spread(axis(p.z, bounds.min.z, extent.z)) << 2
}

/// Moves bit i to bit 3i.
fn spread(v: u64) -> u64 {
    let mut v = v & 0x1f_ffff;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

/// Total order on all attributes by their bits.
fn compare_splats(cloud: &Cloud, a: usize, b: usize) -> Ordering {
    let vector = |v: Vec3| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
    let attributes = |i: usize| {
        let s = cloud.get(i);
        (
            (s.radius.to_bits(), s.cross_section.to_bits(), s.color.map(f32::to_bits)),
            (s.kind, s.material, s.footprint, s.object),
            (vector(s.normal), vector(s.shading_normal), vector(s.tangent)),
            (s.shadow_coefficient.to_bits(), s.value.to_bits(), s.crossing_depth.to_bits()),
        )
    };
    // Where some splats lie far out, most others have one code: their places tell nearly all of them apart.
    vector(cloud.position[a])
        .cmp(&vector(cloud.position[b]))
        .then_with(|| attributes(a).cmp(&attributes(b)))
        .then_with(|| cloud.compare_gaussians(a, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Splat, rng};
    use glam::DVec3;

    #[test]
    fn spread_moves_each_bit_to_three_times_its_place() {
        for bit in 0..BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
    }

    #[test]
    fn x4_shuffled_input_gives_the_same_cloud() {
        let splat = |i: u64| Splat {
            position: Vec3::new(rng::unit_f32(1, 0, i % 50, 0), rng::unit_f32(1, 0, i % 50, 1), 0.0),
            value: (i / 50) as f32,
            ..Splat::default()
        };
        let mut forward = Cloud::new(DVec3::ZERO);
        let mut backward = Cloud::new(DVec3::ZERO);
        (0..200).for_each(|i| forward.push(&splat(i)));
        (0..200).rev().for_each(|i| backward.push(&splat(i)));
        assert_ne!(forward, backward);
        forward.canonicalize();
        backward.canonicalize();
        assert_eq!(forward, backward);
    }
}
