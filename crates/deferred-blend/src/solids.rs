//! Opaque discs as rays meet them that were bent or mirrored, and so come from elsewhere than the eye.

use crate::DiscInput;
use crate::disc::{axes, into_view};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::ray::{Ray, RayHit};
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::shade::ChannelLayout;
use splat_core::{Footprint, FootprintStack};
use std::time::Duration;

/// ρ²/R² within which a disc is solid.
const CORE: f32 = Footprint::CORE * Footprint::CORE;

/// How near to the nearest disc others belong to the same surface, in radii across their planes.
const SAME: f32 = 0.5;

/// |cosine| below which planes count as if they were met at it.
const LEAST_FACING: f32 = 0.25;

/// Weight of a disc that faces away: behind a silhouette it is lit on the inside.
const FACES_AWAY: f32 = 1.0 / 256.0;

/// The opaque discs of a view, in the space of its camera: x right, y up, z along the view, the eye at the origin.
pub struct Solids<'a> {
    bvh: Option<Bvh2>,
    discs: Vec<Solid>,
    footprints: FootprintStack,
    values: &'a [f32],
    layout: ChannelLayout,
    largest: f32,
}

/// One opaque disc.
#[derive(Debug, Clone, Copy)]
struct Solid {
    center: Vec3,
    normal: Vec3,
    /// Semi-axes over their squared lengths.
    dual: [Vec3; 2],
    radius: f32,
    id: u32,
    footprint: u8,
}

/// Where a ray meets a disc's plane.
struct Hit {
    along: f32,
    distance_sq: f32,
    /// Cosine of the angle to the normal; above 0 where it faces away.
    cosine: f32,
}

impl<'a> Solids<'a> {
    /// Of the discs `input.ids`, which are opaque; `values` are by place in the cloud, as `layout` says.
    pub fn new(input: &DiscInput<'_>, values: &'a [f32], layout: ChannelLayout) -> Self {
        let (rotation, shift) = into_view(input);
        let solid = |&id: &u32| {
            let (cloud, i) = (input.cloud, id as usize);
            let [a, b] = axes(cloud, i, 1.0).map(|a| rotation * a);
            let dual = [a, b].map(|a| (a / a.length_squared()).as_vec3());
            let center = (rotation * (cloud.position[i].as_dvec3() + shift)).as_vec3();
            let normal = (rotation * cloud.normal_of(i).as_dvec3()).as_vec3();
            let reach = (a * a + b * b).to_array().map(|s| s.sqrt() as f32);
            let solid = Solid { center, normal, dual, radius: cloud.radius[i], id, footprint: cloud.footprint[i] };
            (solid, Aabb::new((center - Vec3::from(reach)).into(), (center + Vec3::from(reach)).into()))
        };
        let (discs, boxes): (Vec<Solid>, Vec<Aabb>) = input.ids.par_iter().map(solid).unzip();
        let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::fast_build() };
        let bvh = (!boxes.is_empty()).then(|| build_bvh2(&boxes, params, &mut Duration::default()));
        let largest = discs.iter().map(|d| d.radius).fold(0.0, f32::max);
        Self { bvh, discs, footprints: input.footprints.clone(), values, layout, largest }
    }

    /// Bytes that discs and their hierarchy take.
    pub const fn bytes(discs: u64) -> u64 {
        // A binary tree of boxes has twice as many nodes as leaves.
        discs * (size_of::<Solid>() + size_of::<Aabb>() + 2 * 32 + 4) as u64
    }

    /// Radiance of the nearest opaque surface from a place along a unit vector: its discs averaged by weight, as Eq. 1; `None` where
    /// there is none.
    pub(crate) fn radiance(&self, from: Vec3, along: Vec3) -> Option<[f32; 3]> {
        let bvh = self.bvh.as_ref()?;
        let ray = |end: f32| Ray::new(from.into(), along.into(), 0.0, end);
        let mut nearest = f32::INFINITY;
        bvh.ray_traverse(ray(f32::INFINITY), &mut RayHit::none(), |_, i| {
            let hit = self.discs[bvh.primitive_indices[i] as usize].meet(from, along);
            if hit.along > 0.0 && hit.distance_sq < CORE {
                nearest = nearest.min(hit.along);
            }
            nearest
        });
        if nearest == f32::INFINITY {
            return None;
        }
        let (mut weights, mut sum) = (0.0, [0.0; 3]);
        bvh.ray_traverse_anyhit(ray(nearest + SAME / LEAST_FACING * self.largest), |_, i| {
            let disc = &self.discs[bvh.primitive_indices[i] as usize];
            let hit = disc.meet(from, along);
            let apart = (hit.along - nearest).abs() * hit.cosine.abs().max(LEAST_FACING);
            if hit.along > 0.0 && hit.distance_sq < 1.0 && apart < SAME * disc.radius {
                let profile = self.footprints.layers()[disc.footprint as usize].profile(f64::from(hit.distance_sq));
                let weight = profile as f32 * if hit.cosine > 0.0 { FACES_AWAY } else { 1.0 };
                let own = self.color(disc.id as usize);
                weights += weight;
                sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += weight * own);
            }
        });
        (weights > 0.0).then(|| sum.map(|s| s / weights))
    }

    /// All effects of a splat.
    fn color(&self, id: usize) -> [f32; 3] {
        let own = &self.values[id * self.layout.count()..][..self.layout.colors()];
        own.chunks_exact(3).fold([0.0; 3], |sum, effect| std::array::from_fn(|c| sum[c] + effect[c]))
    }
}

impl Solid {
    #[inline]
    fn meet(&self, from: Vec3, along: Vec3) -> Hit {
        let (to, cosine) = (self.center - from, self.normal.dot(along));
        let t = self.normal.dot(to) / cosine;
        let place = along * t - to;
        let [u, v] = self.dual.map(|axis| place.dot(axis));
        Hit { along: t, distance_sq: u * u + v * v, cosine }
    }
}
