//! STEPS 1 to 3 for any number of sets: sample, project, keep the nearest of each pixel, add to the ensemble.
//!
//! Sets are folded in batches. First all (set, object, run of chunks) are sampled, projected and sorted by tile, each by
//! one task; then each tile is taken by one task, which goes through the sets in order with a depth buffer of its own.
//! Nothing is shared between tasks and every sum is in integers: the result has the same bits for any number of threads.
//! Memory depends on the image and on the particles of one batch, never on the number of sets.

use crate::cost::Counts;
use crate::ensemble::Ensemble;
use crate::error::check;
use crate::project::Projector;
use crate::project::bins::{Filling, Record, Staging, TILE, Task, Tiling};
use crate::project::colored::Colored;
use crate::project::nearest::Nearest;
use crate::project::shade::{Appearance, Seen, Shader};
use crate::sampler::{Run, runs};
use crate::{Error, PackedNormal, Sampler};
use glam::{DMat3, DVec3, Mat3};
use rayon::prelude::*;
use splat_core::raster::OpaqueImage;
use splat_core::shade::LitBy;
use splat_core::shade::MAX_CHANNELS;
use splat_core::{Camera, Limits, Progress, Shading, Similarity, glam};

/// One object of the scene.
#[derive(Clone, Copy)]
pub struct Object<'a> {
    /// Where its particles come from.
    pub sampler: &'a dyn Sampler,
    /// From the sampler's space to the world; moving an object needs no new particles.
    pub transform: Similarity,
    /// How they look.
    pub look: Appearance,
}

/// Everything that is seen.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Objects; their order does not matter beyond noise.
    pub objects: &'a [Object<'a>],
    /// Lights with their shadows.
    pub lights: &'a [LitBy<'a>],
    /// World position that what receives shadows is relative to: the origin of the cloud that casts them.
    pub shadow_origin: DVec3,
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// The viewer.
    pub camera: &'a Camera,
    /// Opaque surfaces drawn exactly, by any other means: particles behind them are hidden, and rays that pass all particles
    /// end on them. The way to have α = 1. Its first planes are radiance, three for each colour that the ensemble keeps:
    /// beauty, or [`SHADED_EFFECTS`](splat_core::SHADED_EFFECTS).
    pub occluder: Option<&'a OpaqueImage>,
}

/// How many sets are folded, of what, and what that may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldParams {
    /// Sets to add: what one call adds to the repeat level.
    pub levels: u32,
    /// Nearest and farthest view depth; particles before the first, or at the second or behind it, are left out. Averages of
    /// ranges that meet, one behind the other, are an average of everything: their particles are independent.
    pub depths: [f32; 2],
    /// Of the particles of one batch, 32 bytes each. A set that needs more is refused.
    pub limits: Limits,
    /// Particles of a batch that are worth a pass over the image; more only takes memory.
    pub batch_particles: u64,
}

impl FoldParams {
    /// Bytes of a batch of sets of few particles; a single set of more takes more.
    pub fn batch_bytes(&self) -> u64 {
        self.batch_particles.min(self.limits.max_elements).saturating_mul(BYTES_IN_BATCH).min(self.limits.max_bytes)
    }
}

impl Default for FoldParams {
    fn default() -> Self {
        Self {
            levels: 100,
            depths: [f32::NEG_INFINITY, f32::INFINITY],
            limits: Limits::default(),
            batch_particles: 4 << 20,
        }
    }
}

/// Bytes of a particle in a batch: its record, with room to grow.
pub(crate) const BYTES_IN_BATCH: u64 = 32;

/// Folds sets into an ensemble; keeps its buffers between calls.
#[derive(Debug, Default)]
pub struct Renderer {
    tasks: Vec<Task>,
}

impl Renderer {
    /// Without buffers yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds `params.levels` sets to `ensemble`, from set `ensemble.levels()` on. Sets are reported to `progress`, where the
    /// caller announces them, who may ask for them in several calls; work stops where it is cancelled. When it fails, the
    /// sets of whole batches before are in, and the ensemble is valid.
    ///
    /// # Errors
    /// [`Error::Parameter`] when the sizes of camera, ensemble and occluder differ, or levels overflow;
    /// [`Error::Limit`] when one set needs more than `params.limits`; [`Error::Core`] when cancelled.
    pub fn fold(
        &mut self,
        scene: &Scene<'_>,
        ensemble: &mut Ensemble,
        params: &FoldParams,
        progress: Option<&Progress>,
    ) -> Result<Counts, Error> {
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        let plan = Plan::new(scene, ensemble, params)?;
        let mut counts = Counts::default();
        let mut left = params.levels;
        while left > 0 {
            let batch = left.min(plan.batch_levels);
            self.sample(scene, &plan, u64::from(ensemble.levels), batch, progress);
            // A cancelled batch is incomplete: it is dropped whole.
            progress.tick(0)?;
            self.resolve(scene, &plan, batch as usize, ensemble);
            ensemble.levels += batch;
            left -= batch;
            counts.add(&self.tasks, batch);
            progress.tick(u64::from(batch))?;
        }
        Ok(counts)
    }

    fn sample(&mut self, scene: &Scene<'_>, plan: &Plan, first: u64, batch: u32, progress: &Progress) {
        self.tasks.resize_with(plan.runs.len() * batch as usize, Task::default);
        for (k, task) in self.tasks.iter_mut().enumerate() {
            // Sets of one run one after the other: its triangles or cells are then in the cache.
            let (object, rank, run) = &plan.runs[k / batch as usize];
            task.set = first + (k % batch as usize) as u64;
            (task.object, task.run, task.chunks) = (*object, *rank, run.chunks.clone());
        }
        self.tasks.par_iter_mut().for_each_init(Staging::default, |staging, task| {
            if !progress.is_cancelled() {
                let object = task.object as usize;
                let filling = Filling {
                    sampler: scene.objects[object].sampler,
                    projector: &plan.projectors[object],
                    tiling: &plan.tiling,
                    shares: plan.shares[object],
                    normals: plan.shaded[object],
                    depths: plan.depths,
                };
                task.fill(&filling, staging);
            }
        });
    }

    fn resolve(&self, scene: &Scene<'_>, plan: &Plan, batch: usize, ensemble: &mut Ensemble) {
        let channels = ensemble.params;
        let Scene { lights, shadow_origin, ambient, camera, .. } = *scene;
        let shader = Shader { lights, shadow_origin, ambient, camera, channels };
        let all = Resolve { scene, plan, shader: &shader, tasks: &self.tasks, batch };
        let mut tiles = ensemble.tiles();
        let tiles = tiles.par_iter_mut().enumerate();
        if channels.colored_extinction {
            tiles.for_each_init(Colored::new, |nearest, (t, sums)| nearest.fold(&all, t, sums));
        } else {
            tiles.for_each_init(Nearest::new, |nearest, (t, sums)| nearest.fold(&all, t, sums));
        }
    }
}

/// What every tile reads.
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

/// What is the same for all batches.
pub(crate) struct Plan {
    pub(crate) tiling: Tiling,
    projectors: Vec<Projector>,
    /// Probabilities with which a particle of each object hides a channel; `None` where it hides all.
    shares: Vec<Option<[f32; 3]>>,
    /// Whether what is seen of each object is shaded; else its particles are shown as they are, and nothing but beauty is
    /// asked for: neither place nor normal are needed.
    pub(crate) shaded: Vec<bool>,
    /// Of each task of a set: the object, the rank of the run among those of the object, and the run.
    runs: Vec<(u32, usize, Run)>,
    batch_levels: u32,
    depths: [f32; 2],
    world_from_view: DMat3,
    /// Turn of each object's normals.
    turns: Vec<Mat3>,
    focal: f64,
}

impl FoldParams {
    /// Refuses sets of so many expected particles, as folding them would.
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes or particles than [`FoldParams::limits`].
    pub fn check_set(&self, expected: f64) -> Result<(), Error> {
        let needed = (expected * BYTES_IN_BATCH as f64) as u64;
        let Limits { max_bytes, max_elements } = self.limits;
        for (needed, limit, unit) in [(needed, max_bytes, "bytes"), (expected as u64, max_elements, "particles")] {
            if needed > limit {
                return Err(Error::limit("one set of particles", needed, limit, unit));
            }
        }
        Ok(())
    }
}

impl Plan {
    fn new(scene: &Scene<'_>, ensemble: &Ensemble, params: &FoldParams) -> Result<Self, Error> {
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
