//! How wrong an order of splats is, ray by ray.
//!
//! On one ray the fragments in front of the nearest opaque surface, in the order in which they are composited, should have
//! rising depths. A pair that does not is wrong; a backtrack is how far a fragment lies in front of one that came before it.

use crate::Input;
use crate::splats::footprint::{Splat, profiles};
use rayon::prelude::*;
use splat_core::SplatKind;

/// Translucent fragments on some rays of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Rays {
    /// For each ray that meets any: splat and depth of each fragment.
    fragments: Vec<Vec<(u32, f64)>>,
    rays: usize,
}

/// Disorder of one order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disorder {
    /// Rays that were looked at.
    pub rays: usize,
    /// Pairs of fragments in wrong order, a ray in the mean.
    pub wrong_pairs_per_ray: f64,
    /// Pairs of fragments, a ray in the mean.
    pub pairs_per_ray: f64,
    /// Farthest that any fragment lies in front of one composited before it, world units.
    pub worst_backtrack: f64,
}

impl Rays {
    /// Finds the fragments at every `stride`-th pixel of every `stride`-th row.
    pub fn new(input: &Input<'_>, stride: usize) -> Self {
        let stride = stride.max(1);
        let size = input.camera.size.map(|s| s as usize);
        let [columns, rows] = size.map(|s| s.div_ceil(stride));
        let profiles = profiles(input.footprints);
        let splats: Vec<Option<Splat<'_>>> =
            (0..input.cloud.len()).into_par_iter().map(|i| Splat::new(input, &profiles, i)).collect();
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); columns * rows];
        for (i, splat) in (0u32..).zip(&splats) {
            let Some(splat) = splat else { continue };
            let grid = |axis: usize| {
                let range = splat.range(axis, size[axis]);
                range.start.div_ceil(stride)..range.end.div_ceil(stride)
            };
            for y in grid(1) {
                grid(0).for_each(|x| lists[y * columns + x].push(i));
            }
        }
        let ray =
            |(k, ids): (usize, Vec<u32>)| on_ray(input, &splats, &ids, k % columns * stride, k / columns * stride);
        let fragments = lists.into_par_iter().enumerate().map(ray).filter(|f| !f.is_empty()).collect();
        Self { fragments, rays: columns * rows }
    }

    /// Disorder of the order in which splat `i` comes at place `rank[i]`, nearest first; splats without a rank
    /// (`u32::MAX`) are not composited.
    pub fn disorder(&self, rank: &[u32]) -> Disorder {
        let of_ray = |fragments: &Vec<(u32, f64)>| {
            let mut placed: Vec<(u32, f64)> =
                fragments.iter().map(|(i, d)| (rank[*i as usize], *d)).filter(|p| p.0 != u32::MAX).collect();
            placed.sort_by_key(|p| p.0);
            let depths: Vec<f64> = placed.into_iter().map(|p| p.1).collect();
            let n = depths.len() as f64;
            (wrong_pairs(&depths) as f64, 0.5 * n * (n - 1.0).max(0.0), backtrack(&depths))
        };
        let of_rays: Vec<(f64, f64, f64)> = self.fragments.par_iter().map(of_ray).collect();
        let rays = self.rays.max(1) as f64;
        Disorder {
            rays: self.rays,
            wrong_pairs_per_ray: of_rays.iter().map(|r| r.0).sum::<f64>() / rays,
            pairs_per_ray: of_rays.iter().map(|r| r.1).sum::<f64>() / rays,
            worst_backtrack: of_rays.iter().map(|r| r.2).fold(0.0, f64::max),
        }
    }
}

fn on_ray(input: &Input<'_>, splats: &[Option<Splat<'_>>], ids: &[u32], x: usize, y: usize) -> Vec<(u32, f64)> {
    let mut surface = f64::INFINITY;
    let mut found = Vec::new();
    for &i in ids {
        let Some(splat) = &splats[i as usize] else { continue };
        let Some(f) = splat.fragment(input, x, y) else { continue };
        if splat.kind != SplatKind::Opaque {
            found.push((i, f.depth));
        } else if f.is_solid {
            surface = surface.min(f.depth);
        }
    }
    found.retain(|f| f.1 < surface);
    found
}

/// Pairs i < j with a greater value at i, by merging.
fn wrong_pairs(values: &[f64]) -> u64 {
    fn sorted(values: &[f64]) -> (Vec<f64>, u64) {
        if values.len() < 2 {
            return (values.to_vec(), 0);
        }
        let (a, b) = values.split_at(values.len() / 2);
        let (a, wrong_a) = sorted(a);
        let (b, wrong_b) = sorted(b);
        let mut merged = Vec::with_capacity(values.len());
        let mut wrong = wrong_a + wrong_b;
        let mut i = 0;
        for v in b {
            while i < a.len() && a[i] <= v {
                merged.push(a[i]);
                i += 1;
            }
            wrong += (a.len() - i) as u64;
            merged.push(v);
        }
        merged.extend_from_slice(&a[i..]);
        (merged, wrong)
    }
    sorted(values).1
}

fn backtrack(values: &[f64]) -> f64 {
    let mut farthest = f64::NEG_INFINITY;
    let mut worst = 0.0f64;
    for &v in values {
        worst = worst.max(farthest - v);
        farthest = farthest.max(v);
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Order;
    use splat_core::glam::{DVec3, Vec3};
    use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat as Noun};

    #[test]
    fn pairs_and_backtracks_by_hand() {
        assert_eq!((wrong_pairs(&[1.0, 2.0, 2.0, 3.0]), backtrack(&[1.0, 2.0, 2.0, 3.0])), (0, 0.0));
        assert_eq!((wrong_pairs(&[3.0, 2.0, 1.0]), backtrack(&[3.0, 2.0, 1.0])), (3, 2.0));
        assert_eq!((wrong_pairs(&[2.0, 5.0, 1.0, 4.0]), backtrack(&[2.0, 5.0, 1.0, 4.0])), (3, 4.0));
        let values: Vec<f64> = (0..200).map(|i| splat_core::rng::unit(3, 0, i, 0)).collect();
        let slow = (0..200).flat_map(|i| (i..200).map(move |j| (i, j))).filter(|&(i, j)| values[i] > values[j]).count();
        assert_eq!(wrong_pairs(&values), slow as u64);
    }

    #[test]
    fn three_media_in_a_row_and_a_wall() {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for z in [0.0, -1.0, -2.0] {
            let position = Vec3::new(0.0, 0.0, z);
            cloud.push(&Noun { position, radius: 0.5, cross_section: 0.1, ..Noun::default() });
        }
        let view = Projection::Orthographic { height: 2.0 };
        let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, [9, 9]).unwrap();
        let footprints = FootprintStack::default();
        let materials = [Material::default()];
        let input = Input {
            cloud: &cloud,
            camera: &camera,
            footprints: &footprints,
            materials: &materials,
            values: &[0.0; 9],
            channels: 3,
            resampling_sigma_px: 0.0,
            order: Order::Centre,
        };
        let rays = Rays::new(&input, 4);
        let right = rays.disorder(&[0, 1, 2]);
        // One of nine rays meets all three.
        assert_eq!((right.rays, right.pairs_per_ray, right.wrong_pairs_per_ray), (9, 3.0 / 9.0, 0.0));
        let wrong = rays.disorder(&[2, 1, 0]);
        assert!((wrong.wrong_pairs_per_ray - 3.0 / 9.0).abs() < 1e-12 && (wrong.worst_backtrack - 2.0).abs() < 1e-6);
        assert_eq!(rays.disorder(&[0, u32::MAX, 1]).pairs_per_ray, 1.0 / 9.0);
        // A wall hides what lies behind it.
        let normal = Vec3::Z;
        let kind = SplatKind::Opaque;
        let position = Vec3::new(0.0, 0.0, -0.5);
        let mut walled = cloud.clone();
        walled.push(&Noun { position, radius: 2.0, cross_section: 1.0, kind, normal, ..Noun::default() });
        let input = Input { cloud: &walled, values: &[0.0; 12], ..input };
        assert_eq!(Rays::new(&input, 4).disorder(&[0, 1, 2, u32::MAX]).pairs_per_ray, 0.0);
    }
}
