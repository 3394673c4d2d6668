//! Does a device give the processor's bits? Generated input, ordered by both.
//!
//! Half of the splats lie in a plane across the view, so that their depths differ by the rounding of products and sums
//! alone: a driver that fuses what the processor rounds apart orders them otherwise.

use crate::Failure;
use hbsort::gpu::{SliceRun, slice_cloud_on};
use hbsort::{Params, Scratch, SliceOrder, slice_cloud};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::gpu::Attributes;
use splat_core::{Camera, Cloud, Light, LightShape, Projection, Splat, SplatKind, rng};
use splat_shaders::Executor;
use tsm::gpu::{Casting, record_map};
use tsm::{Deposits, Params as ShadowParams, Resolution};

/// Splats of the trial before a device is used.
const SPLATS: u32 = 4096;
/// The key of its random numbers.
const SEED: u64 = 0x5452_4941;

/// Whether a device finds the processor's order of generated splats.
pub(super) fn order_trial(device: &mut dyn Executor) -> Result<bool, Failure> {
    let input = OrderInput::new(SPLATS);
    let found = input.on(device)?.order;
    Ok(found == input.by_processor()?)
}

/// Whether a device makes the processor's shadow map of generated splats. Coincident distances are as one to look-ups: where
/// they are rounded apart, a picture moves by more than it may.
pub(super) fn shadow_trial(device: &mut dyn Executor) -> Result<bool, Failure> {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..u64::from(SPLATS / 4) {
        let u = |k| 2.0 * rng::unit_f32(SEED, 1, i, k) - 1.0;
        let position = Vec3::new(u(0), u(1), u(2));
        let normal = Vec3::new(u(3), u(4), u(5)).normalize_or(Vec3::Z);
        let (kind, normal) = if i % 2 == 0 { (SplatKind::Medium, Vec3::ZERO) } else { (SplatKind::Surface, normal) };
        let radius = 0.06 + 0.03 * u(6);
        let cross_section = 1e-3;
        cloud.push(&Splat { position, radius, cross_section, kind, normal, ..Splat::default() });
    }
    let light = Light { shape: LightShape::Point { position: DVec3::new(0.4, 1.3, -0.3) }, intensity: [1.0; 3] };
    let params = ShadowParams { resolution: Resolution::Cells(64), ..ShadowParams::default() };
    let casting = Casting::new(&tsm::Scene::from(&cloud), &light, &params, None)?;
    let expected = Deposits::new(&tsm::Scene::from(&cloud), &light, &params, None)?.into_map();
    let attributes = Attributes::new(&cloud, None)?;
    let entries = u32::try_from(expected.counts().entries).unwrap_or(u32::MAX);
    let recorded = record_map(casting.room(attributes.room(), entries));
    let uploads = recorded.cast.uploads(&casting, None)?;
    let mut inputs = recorded.cast.inputs(&uploads);
    inputs.extend(attributes.inputs(&recorded.cast.attributes));
    let run = device.run(&recorded.recording, &inputs)?;
    let found = recorded.map(&casting, run.bytes(recorded.cast.state), recorded.lists.map(|buffer| run.bytes(buffer)));
    // Where it finds more entries it rounds otherwise, too.
    Ok(found.is_ok_and(|map| map == expected))
}

/// Generated splats and a view of them.
pub(super) struct OrderInput {
    cloud: Cloud,
    camera: Camera,
    ids: Vec<u32>,
    params: Params,
}

impl OrderInput {
    pub(super) fn new(splats: u32) -> Self {
        let eye = DVec3::new(3.1, 2.3, 4.7);
        let target = DVec3::new(0.1, -0.2, 0.3);
        let view = Projection::Perspective { fov_y: 0.7 };
        let camera = Camera::look_at(eye, target, DVec3::Y, view, [640, 480]).expect("invariant: a view of its target");
        let forward = (target - eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..u64::from(splats) {
            let u = |k| 2.0 * f64::from(rng::unit_f32(SEED, 0, i, k)) - 1.0;
            let across = target + 2.5 * u(0) * right + 2.0 * u(1) * up;
            let position = if i % 2 == 0 { across } else { across + 3.0 * u(2) * forward };
            let radius = 0.02 + 0.01 * u(3) as f32;
            cloud.push(&Splat { position: position.as_vec3(), radius, normal: Vec3::Z, ..Splat::default() });
        }
        Self { cloud, camera, ids: (0..splats).collect(), params: Params { exact: true, ..Params::default() } }
    }

    pub(super) fn on(&self, device: &mut dyn Executor) -> Result<SliceRun, Failure> {
        Ok(slice_cloud_on(device, &self.cloud, &self.ids, &self.camera, &self.params)?)
    }

    pub(super) fn by_processor(&self) -> Result<SliceOrder, Failure> {
        Ok(slice_cloud(&self.cloud, Some(&self.ids), &self.camera, &self.params, &mut Scratch::new())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_that_fuses_products_and_sums_is_found_out() {
        let input = OrderInput::new(SPLATS);
        let view = input.camera.view_from_offset(input.cloud.origin);
        let [a, b, c] = [view.rotation.x_axis.z, view.rotation.y_axis.z, view.rotation.z_axis.z];
        let t = view.translation.z;
        let order = |depth: &dyn Fn(Vec3) -> f32| {
            let mut ids = input.ids.clone();
            ids.sort_by(|i, j| {
                let [p, q] = [i, j].map(|k| depth(input.cloud.position[*k as usize]));
                p.total_cmp(&q).then(i.cmp(j))
            });
            ids
        };
        let apart = order(&|p| p.x * a + p.y * b + p.z * c + t);
        let every = order(&|p| p.z.mul_add(c, p.y.mul_add(b, p.x * a)) + t);
        let last = order(&|p| p.z.mul_add(c, p.x * a + p.y * b) + t);
        let first = order(&|p| p.y.mul_add(b, p.x * a) + p.z * c + t);
        for fused in [every, last, first] {
            let moved = apart.iter().zip(&fused).filter(|(i, j)| i != j).count();
            assert!(moved > 50, "{moved}");
        }
        // And something is in the view to be ordered.
        let kept = input.by_processor().expect("an order").input_from_sorted.len();
        assert!(kept > SPLATS as usize / 4, "{kept}");
    }
}
