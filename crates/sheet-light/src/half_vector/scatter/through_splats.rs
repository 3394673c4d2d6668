//! Splats in the way of light that is scattered more than once: what surfaces and media that are classified already let through, by face of the
//! cells.
//!
//! They are taken up layer by layer, in the light's own image, as in the slabs of a sweep. What lies in a layer of cells counts at its far face, as
//! what is opaque does, for light that comes back as well.

use super::grid::{GridPlace, LightGrid};
use crate::half_vector::input::HalfSplats;
use crate::half_vector::slicing::by_slab::BySlab;
use crate::half_vector::slicing::sight::Sight;
use crate::half_vector::splats::light::SplatLight;
use rayon::prelude::*;
use splat_core::Camera;
use splat_core::glam::Vec3;

/// By face: share of each channel, of the light whose image `camera` takes.
pub(crate) fn through(splats: &HalfSplats<'_>, grid: &LightGrid, camera: &Camera) -> Vec<[f32; 3]> {
    let frame = grid.slabs();
    let count = frame.slabs.count;
    let width = frame.slabs.width as f32;
    let place = |p: &Vec3| frame.point(splats.cloud.origin + p.as_dvec3()).as_vec3();
    let places: Vec<Vec3> = splats.cloud.position.par_iter().map(place).collect();
    // What lies before the first slab is in it, what lies behind the last in that.
    let slabs: Vec<u32> = places.iter().map(|p| ((p.z / width) as u32).min(count - 1)).collect();
    let by_slab = BySlab::new(&slabs, count);
    let mut light = SplatLight::new(splats, &frame, &Sight::new(&frame, *camera), 1.0, &places, &by_slab.ids, 3);
    let [columns, rows] = grid.columns;
    let faces = grid.layers + 1;
    let mut out = vec![[1.0; 3]; columns * rows * faces];
    for slab in 0..count {
        light.enter(slab, by_slab.in_slab(slab), &slabs, &places);
        light.leave();
        // The slab ends at this face.
        for k in (0..columns * rows).filter(|_| (slab as usize) < faces) {
            let [x, y, face] = [k % columns, k / columns, slab as usize];
            let place = frame.point(grid.world(GridPlace { x: x as f64, y: y as f64, face: face as f64 })).as_vec3();
            out[(y * faces + face) * columns + x] = light.transmittance_at(place, f32::NEG_INFINITY);
        }
    }
    out
}
