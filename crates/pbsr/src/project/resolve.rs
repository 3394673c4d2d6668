//! Inputs of every tile when its particles become pixels: the plan of a fold, its tasks, and the light on visible particles.

use crate::ensemble::Ensemble;
use crate::error::check;
use crate::project::Projector;
use crate::project::bins::{Record, Task};
use crate::project::shade::{Seen, Shader};
use crate::project::tiles::{TILE, Tiling};
use crate::sampler::{Run, runs};
use crate::scene::{BYTES_IN_BATCH, FoldParams, Object, Scene};
use crate::{Error, PackedNormal};
use glam::{DMat3, DVec3, Mat3};
use splat_core::shade::MAX_CHANNELS;
use splat_core::{Camera, Limits, Shading, glam};

/// Inputs of every tile.
pub(crate) struct Resolve<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) plan: &'a Plan,
    pub(crate) shader: &'a Shader<'a>,
    pub(crate) tasks: &'a [Task],
    /// Sets.
    pub(crate) batch: usize,
}

impl<'a> Resolve<'a> {
    /// The tasks of one set.
    #[inline]
    pub(crate) fn of_set(&self, set: usize) -> impl Iterator<Item = &'a Task> + use<'a> {
        self.tasks.iter().skip(set).step_by(self.batch)
    }

    /// The channels of what is seen, in the tile with this corner.
    #[inline]
    pub(crate) fn shade(
        &self,
        record: &Record,
        normal: PackedNormal,
        object: u32,
        corner: [usize; 2],
        values: &mut [f32; MAX_CHANNELS],
    ) {
        let o = object as usize;
        let pixel = record.pixel();
        let [wx, wy] = record.within().map(f64::from);
        let at_px = [(corner[0] + pixel % TILE) as f64 + wx, (corner[1] + pixel / TILE) as f64 + wy];
        let normal = self.plan.turns[o] * normal.get();
        let from_eye = self.plan.behind_pixel(self.scene.camera, at_px, record.depth);
        let look = &self.scene.objects[o].look;
        let color = record.color.get().map(|c| c * look.color_unit);
        let seen = Seen { look, from_eye, normal, color };
        self.shader.shade(&seen, values);
    }

    /// Depths of the occluder in a tile as keys; what lies at one or behind it is hidden.
    pub(crate) fn limits(&self, corner: [usize; 2], limit: &mut [u64]) {
        limit.fill(solid(f32::INFINITY));
        let Some(occluder) = self.scene.occluder else { return };
        let [w, h] = self.plan.tiling.size;
        for y in corner[1]..(corner[1] + TILE).min(h) {
            let row = corner[0]..(corner[0] + TILE).min(w);
            let from = (y - corner[1]) * TILE;
            let depths = &occluder.depth[y * w + row.start..y * w + row.end];
            limit[from..].iter_mut().zip(depths).for_each(|(limit, depth)| {
                // A depth that is not a number is none.
                *limit = solid(if *depth < f32::INFINITY { depth.max(0.0) } else { f32::INFINITY });
            });
        }
    }
}

/// The key of a depth that hides all that is at it or behind it.
pub(crate) const fn solid(depth: f32) -> u64 {
    (depth.to_bits() as u64) << 32
}

/// Data that all batches share.
pub(crate) struct Plan {
    pub(crate) tiling: Tiling,
    pub(crate) projectors: Vec<Projector>,
    /// Probabilities with which a particle of each object hides a channel; `None` where it hides all.
    pub(crate) shares: Vec<Option<[f32; 3]>>,
    /// Whether what is seen of each object is shaded; else its particles are shown as they are, and nothing but beauty is
    /// asked for: neither place nor normal are needed.
    pub(crate) shaded: Vec<bool>,
    /// Of each task of a set: the object, the rank of the run among those of the object, and the run.
    pub(crate) runs: Vec<(u32, usize, Run)>,
    pub(crate) batch_levels: u32,
    pub(crate) depths: [f32; 2],
    world_from_view: DMat3,
    /// Turn of each object's normals.
    turns: Vec<Mat3>,
    focal: f64,
}

impl Plan {
    pub(crate) fn new(scene: &Scene<'_>, ensemble: &Ensemble, params: &FoldParams) -> Result<Self, Error> {
        let levels = params.levels;
        let size = ensemble.size();
        check(scene.camera.size == size, "camera size", scene.camera.size, "the size of the ensemble")?;
        if let Some(o) = scene.occluder {
            let pixels = size[0] as usize * size[1] as usize;
            let colors = o.channels.get(..ensemble.params.light_channels()).unwrap_or(&[]);
            let ok = o.depth.len() == pixels && !colors.is_empty() && colors.iter().all(|c| c.len() == pixels);
            check(ok, "occluder", o.depth.len(), "a depth and the colours of the ensemble for each pixel")?;
        }
        check(ensemble.levels.checked_add(levels).is_some(), "levels", levels, "at most 2³² − 1 in all")?;
        let expected: f64 = scene.objects.iter().map(|o| o.sampler.expected_particles()).sum();
        params.check_set(expected)?;
        let Limits { max_bytes, max_elements } = params.limits;
        let budget = (max_bytes / BYTES_IN_BATCH).min(params.batch_particles).min(max_elements) as f64;
        let axes = scene.camera.axes;
        let of_object = |(o, object): (usize, &Object<'_>)| {
            runs(object.sampler).into_iter().enumerate().map(move |(rank, run)| (o as u32, rank, run))
        };
        let of_objects = scene.objects.iter().enumerate().flat_map(of_object);
        let project =
            |o: &Object<'_>| Projector::new(scene.camera, o.sampler.origin(), &o.transform, o.sampler.cross_section());
        let shaded = |o: &Object<'_>| !ensemble.params.only_beauty() || o.look.material.shading != Shading::Unlit;
        Ok(Self {
            tiling: ensemble.tiling,
            projectors: scene.objects.iter().map(project).collect(),
            shares: scene.objects.iter().map(|o| shares(o).filter(|_| ensemble.params.colored_extinction)).collect(),
            shaded: scene.objects.iter().map(shaded).collect(),
            runs: of_objects.collect(),
            batch_levels: (budget / expected.max(1.0)).clamp(1.0, 4096.0) as u32,
            depths: params.depths,
            world_from_view: DMat3::from_cols(axes[0], axes[1], axes[2]),
            turns: scene.objects.iter().map(|o| DMat3::from_quat(o.transform.rotation).as_mat3()).collect(),
            focal: scene.camera.focal_px(),
        })
    }
}

/// Extinction of each channel over the largest, to which an object's particles belong; `None` where all are alike. A
/// Poisson process that is thinned out with these probabilities is that of the channel.
fn shares(object: &Object<'_>) -> Option<[f32; 3]> {
    let rgb = object.look.material.extinction_rgb;
    let most = rgb.into_iter().fold(0.0, f32::max);
    rgb.iter().any(|e| *e != most).then(|| rgb.map(|e| e / most))
}

impl Plan {
    /// World position relative to the eye of what is seen at an image position and depth.
    fn behind_pixel(&self, camera: &Camera, at_px: [f64; 2], depth: f32) -> DVec3 {
        let u = (at_px[0] - 0.5 * f64::from(camera.size[0])) / self.focal;
        let v = (0.5 * f64::from(camera.size[1]) - at_px[1]) / self.focal;
        let z = f64::from(depth);
        let view = if camera.is_orthographic() { DVec3::new(u, v, z) } else { DVec3::new(u * z, v * z, z) };
        self.world_from_view * view
    }
}
