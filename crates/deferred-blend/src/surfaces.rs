//! Discs as bent or mirrored rays meet them, which do not start at the eye.

use crate::DiscInput;
use crate::cone::curvature;
use crate::disc::{Look, axes, into_view, look};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::ray::{Ray, RayHit};
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::shade::ChannelLayout;
use splat_core::{Footprint, FootprintStack, Material, SplatKind};
use std::collections::BTreeMap;
use std::time::Duration;

/// Radius within which a disc is blended, over its cut-off radius: as little as leaves it smooth, for rays test all discs that they come
/// near to.
const DISC_SCALE: f32 = 0.6;

/// ρ²/R² within which a disc is solid, R the radius within which it is blended.
const CORE: f32 = (Footprint::CORE / DISC_SCALE) * (Footprint::CORE / DISC_SCALE);

/// How near to the nearest disc others belong to the same surface, in radii across their planes.
const SAME: f32 = 0.5;

/// |cosine| below which planes count as if they were met at it.
const LEAST_FACING: f32 = 0.25;

/// Rays that tell what a place lies in, and most surfaces that each of them is followed through.
const WAYS: usize = 15;
const MOST_CROSSINGS: usize = 64;

/// Turn between one of these rays and the next, radians.
const GOLDEN_ANGLE: f32 = 2.399_963_2;

/// Weight of an opaque disc that faces away: behind a silhouette it is lit on the inside.
const FACES_AWAY: f32 = 1.0 / 256.0;

/// Discs of a view, in the space of its camera: x right, y up, z along the view, the eye at the origin.
pub struct Surfaces<'a> {
    bvh: Option<Bvh2>,
    discs: Vec<Surface>,
    footprints: FootprintStack,
    materials: Vec<Material>,
    values: &'a [f32],
    layout: ChannelLayout,
    /// Largest radius by object.
    largest: Vec<f32>,
    /// Objects that the eye lies in, with their materials; none for parallel rays, which have no eye.
    around: Vec<(u32, u16)>,
}

/// One disc.
#[derive(Debug, Clone, Copy)]
struct Surface {
    center: Vec3,
    normal: Vec3,
    /// The normal of refraction and reflection.
    shading_normal: Vec3,
    /// Semi-axes over their squared lengths.
    dual: [Vec3; 2],
    radius: f32,
    id: u32,
    is_opaque: bool,
    look: Look,
}

/// Where a ray meets a disc's plane.
struct Hit {
    along: f32,
    distance_sq: f32,
    /// Cosine of the angle to the normal; above 0 where it faces away.
    cosine: f32,
}

/// The surfaces that a ray may meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RayTarget {
    /// Opaque surfaces alone.
    Opaque,
    /// All, but not the layer that the ray leaves, which is of this object.
    AllBut(u32),
}

/// A layer of a surface that a ray meets: its discs averaged by weight, as Eq. 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Met<'a> {
    /// Along the ray.
    pub(crate) distance: f32,
    pub(crate) object: u32,
    pub(crate) is_opaque: bool,
    pub(crate) material: &'a Material,
    material_id: u16,
    /// Unit length; it may point to either side.
    pub(crate) normal: Vec3,
    /// One over a length.
    pub(crate) curvature: f32,
    /// By channel.
    pub(crate) opacity: [f32; 3],
    /// All effects of its colours times its opacity.
    pub(crate) radiance: [f32; 3],
}

impl<'a> Surfaces<'a> {
    /// Of the discs `input.ids`; `values` are by place in the cloud, in the order of `layout`.
    pub fn new(input: &DiscInput<'_>, values: &'a [f32], layout: ChannelLayout) -> Self {
        let (rotation, shift) = into_view(input);
        let surface = |&id: &u32| {
            let cloud = input.cloud;
            let i = id as usize;
            let [a, b] = axes(cloud, i, f64::from(DISC_SCALE)).map(|a| rotation * a);
            let center = (rotation * (cloud.position[i].as_dvec3() + shift)).as_vec3();
            Surface {
                center,
                normal: (rotation * cloud.normal_of(i).as_dvec3()).as_vec3(),
                shading_normal: (rotation * cloud.shading_normal_of(i).as_dvec3()).as_vec3(),
                dual: [a, b].map(|a| (a / a.length_squared()).as_vec3()),
                radius: DISC_SCALE * cloud.radius[i],
                id,
                is_opaque: cloud.kind[i] == SplatKind::Opaque,
                look: look(input, i),
            }
        };
        let discs: Vec<Surface> = input.ids.par_iter().map(surface).collect();
        let boxes: Vec<Aabb> = discs.par_iter().map(Surface::bounds).collect();
        let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
        let bvh = (!boxes.is_empty()).then(|| build_bvh2(&boxes, params, &mut Duration::default()));
        let objects = discs.iter().map(|d| d.look.object as usize + 1).max().unwrap_or(0);
        let mut largest = vec![0.0f32; objects];
        for disc in &discs {
            let most = &mut largest[disc.look.object as usize];
            *most = most.max(disc.radius);
        }
        let footprints = input.footprints.clone();
        let materials = input.materials.to_vec();
        let mut made = Self { bvh, discs, footprints, materials, values, layout, largest, around: Vec::new() };
        if !input.camera.is_orthographic() {
            made.around = made.around(Vec3::ZERO);
        }
        made
    }

    /// Objects that the eye lies in.
    pub(crate) fn around_eye(&self) -> impl Iterator<Item = (u32, &Material)> {
        self.around.iter().map(|(object, material)| (*object, &self.materials[*material as usize]))
    }

    /// Translucent objects that a place lies in: those whose surfaces most rays from there cross an odd number of times, whichever way
    /// normals point.
    fn around(&self, place: Vec3) -> Vec<(u32, u16)> {
        let mut odd: BTreeMap<(u32, u16), usize> = BTreeMap::new();
        for way in 0..WAYS {
            let z = 1.0 - (2 * way + 1) as f32 / WAYS as f32;
            let turn = way as f32 * GOLDEN_ANGLE;
            let across = (1.0 - z * z).sqrt();
            let along = Vec3::new(across * libm::cosf(turn), across * libm::sinf(turn), z);
            for (object, count) in self.crossings(place, along) {
                *odd.entry(object).or_default() += count % 2;
            }
        }
        odd.into_iter().filter(|(_, ways)| 2 * ways > WAYS).map(|(object, _)| object).collect()
    }

    /// How often a ray crosses each translucent object.
    fn crossings(&self, mut from: Vec3, along: Vec3) -> BTreeMap<(u32, u16), usize> {
        let mut counts = BTreeMap::new();
        let mut target = RayTarget::AllBut(u32::MAX);
        for _ in 0..MOST_CROSSINGS {
            let Some(met) = self.nearest(from, along, target) else { break };
            if !met.is_opaque {
                *counts.entry((met.object, met.material_id)).or_default() += 1;
            }
            from += along * met.distance;
            target = RayTarget::AllBut(met.object);
        }
        counts
    }

    /// Bytes that discs and their hierarchy take while that is built.
    pub const fn bytes(discs: u64) -> u64 {
        // A binary tree of boxes has twice as many nodes as leaves; it is built from lists of nodes of each round, and of their order.
        const NODE: usize = size_of::<Bvh2Node>();
        discs * (size_of::<Surface>() + size_of::<Aabb>() + 6 * NODE + 32) as u64
    }

    /// Whether an index differs by channel.
    pub(crate) fn disperses(&self) -> bool {
        self.materials.iter().map(Material::index_inside).any(|index| index != [index[0]; 3])
    }

    /// The nearest layer from a place along a unit vector; `None` where there is none.
    pub(crate) fn nearest(&self, from: Vec3, along: Vec3, target: RayTarget) -> Option<Met<'_>> {
        let bvh = self.bvh.as_ref()?;
        let mut nearest: Option<(f32, usize)> = None;
        bvh.ray_traverse(Ray::new(from.into(), along.into(), 0.0, f32::INFINITY), &mut RayHit::none(), |_, i| {
            let k = bvh.primitive_indices[i] as usize;
            let hit = self.discs[k].meet(from, along);
            let nearer = nearest.is_none_or(|(t, other)| (hit.along, k) < (t, other));
            if hit.along > 0.0 && hit.distance_sq < CORE && nearer && self.counts(k, &hit, target) {
                nearest = Some((hit.along, k));
            }
            nearest.map_or(f32::INFINITY, |(t, _)| t)
        });
        nearest.map(|(t, k)| self.average(from, along, target, t, k))
    }

    fn counts(&self, k: usize, hit: &Hit, target: RayTarget) -> bool {
        let disc = &self.discs[k];
        match target {
            RayTarget::Opaque => disc.is_opaque,
            RayTarget::AllBut(object) => {
                disc.look.object != object || hit.along * hit.cosine.abs().max(LEAST_FACING) >= SAME * disc.radius
            }
        }
    }

    /// The layer that a disc belongs to, which a ray meets at some distance.
    fn average(&self, from: Vec3, along: Vec3, target: RayTarget, nearest: f32, first: usize) -> Met<'_> {
        let bvh = self.bvh.as_ref().expect("invariant: something was met");
        let first = &self.discs[first];
        let reach = SAME / LEAST_FACING * self.largest[first.look.object as usize];
        let ray = Ray::new(from.into(), along.into(), (nearest - reach).max(0.0), nearest + reach);
        let mut weights = 0.0;
        let mut distance = 0.0;
        let mut normal = Vec3::ZERO;
        let mut opacity = [0.0; 3];
        let mut radiance = [0.0; 3];
        bvh.ray_traverse_anyhit(ray, |_, i| {
            let k = bvh.primitive_indices[i] as usize;
            let disc = &self.discs[k];
            let hit = disc.meet(from, along);
            let apart = (hit.along - nearest).abs() * hit.cosine.abs().max(LEAST_FACING);
            let same = disc.look.object == first.look.object && disc.is_opaque == first.is_opaque;
            let near = hit.along > 0.0 && hit.distance_sq < 1.0 && apart < SAME * disc.radius;
            if !(same && near && self.counts(k, &hit, target)) {
                return;
            }
            let profile = self.footprints.layers()[disc.look.footprint as usize].profile(f64::from(hit.distance_sq));
            let weight = profile as f32 * if disc.is_opaque && hit.cosine > 0.0 { FACES_AWAY } else { 1.0 };
            let side = if disc.shading_normal.dot(first.shading_normal) < 0.0 { -weight } else { weight };
            let color = self.color(disc.id as usize);
            weights += weight;
            distance += weight * (hit.along - nearest);
            normal += side * disc.shading_normal;
            for c in 0..3 {
                let share = if disc.is_opaque { 1.0 } else { disc.look.opacity(c, hit.cosine.abs()) };
                opacity[c] += weight * share;
                radiance[c] += weight * share * color[c];
            }
        });
        Met {
            distance: nearest + distance / weights,
            object: first.look.object,
            is_opaque: first.is_opaque,
            material: &self.materials[first.look.material as usize],
            material_id: first.look.material,
            normal: normal.try_normalize().unwrap_or(first.shading_normal),
            curvature: curvature(normal, weights, first.radius),
            opacity: opacity.map(|sum| (sum / weights).min(1.0)),
            radiance: radiance.map(|sum| sum / weights),
        }
    }

    /// All effects of a splat.
    fn color(&self, id: usize) -> [f32; 3] {
        let effects = &self.values[id * self.layout.count()..][..self.layout.colors()];
        effects.chunks_exact(3).fold([0.0; 3], |sum, effect| std::array::from_fn(|c| sum[c] + effect[c]))
    }
}

impl Surface {
    fn bounds(&self) -> Aabb {
        let [a, b] = self.dual.map(|d| d / d.length_squared());
        let reach = (a * a + b * b).map(f32::sqrt);
        Aabb::new((self.center - reach).into(), (self.center + reach).into())
    }

    #[inline]
    fn meet(&self, from: Vec3, along: Vec3) -> Hit {
        let to = self.center - from;
        let cosine = self.normal.dot(along);
        let t = self.normal.dot(to) / cosine;
        let place = along * t - to;
        let [u, v] = self.dual.map(|axis| place.dot(axis));
        Hit { along: t, distance_sq: u * u + v * v, cosine }
    }
}
