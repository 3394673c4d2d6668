//! Objects of the scene → what their particles are sampled from.

use crate::load::Loaded;
use crate::points::Drawing;
use pbsr::{Appearance, SplatParams};
use splat_core::{Camera, Cloud, SplatKind, rng};
use std::collections::BTreeMap;

/// Stage of the random numbers that seed the objects.
const SEEDS: u64 = 0x7061_7274;
/// Depth, in radii of an object, nearer than which particles are widened rather than made finer.
const NEAR: f64 = 0.5;

/// The translucent splats of one object.
pub(super) struct Part {
    pub(super) cloud: Cloud,
    pub(super) look: Appearance,
    pub(super) params: SplatParams,
}

/// Translucent splats by object; an object has one material and one kind of translucent splats.
pub(super) fn parts(drawing: &Drawing<'_>, camera: &Camera) -> Vec<Part> {
    let Loaded { cloud, objects, materials, footprints, .. } = drawing.loaded;
    let mut of_object: BTreeMap<(u32, bool), Vec<u32>> = BTreeMap::new();
    for i in drawing.ids(|kind| kind != SplatKind::Opaque) {
        let k = i as usize;
        if cloud.cross_section[k] > 0.0 {
            of_object.entry((cloud.object[k], cloud.kind[k] == SplatKind::Surface)).or_default().push(i);
        }
    }
    let part = |((object, _), ids): ((u32, bool), Vec<u32>)| {
        let first = ids[0] as usize;
        let kind = cloud.kind[first];
        let own = cloud.gather(&ids);
        let material = materials[cloud.material[first] as usize];
        let radius = own.radius.iter().map(|r| f64::from(*r)).sum::<f64>() / own.len() as f64;
        let bounds = own.bounds();
        let center = own.origin + bounds.center().as_dvec3();
        let reach = 0.5 * f64::from(bounds.diagonal()) + radius;
        let params = SplatParams {
            cross_section: pbsr::finest_pixel_area(camera, center, reach, NEAR),
            surface_opacity: material.surface_opacity,
            footprints: footprints.clone(),
            seed: rng::bits(drawing.settings.seed, SEEDS, u64::from(object), kind as u64),
            ..SplatParams::default()
        };
        let shadow_coefficient = objects[object as usize].shadow_coefficient * cloud.shadow_coefficient_of(first);
        let look = Appearance { material, kind, radius: radius as f32, shadow_coefficient };
        Part { cloud: own, look, params }
    };
    of_object.into_iter().map(part).collect()
}
