//! STEPS 1 to 3 for any number of sets: sample, project, keep the nearest of each pixel, add to the ensemble.
//!
//! Sets are folded in batches. First all (set, object, run of chunks) are sampled, projected and sorted by tile, each by
//! one task; then each tile is taken by one task, which goes through the sets in order with a depth buffer of its own.
//! Nothing is shared between tasks and every sum is in integers: the result has the same bits for any number of threads.
//! Memory depends on the image and on the particles of one batch, never on the number of sets.

use crate::bins::{AREA, Record, Staging, TILE, Task, Tiling};
use crate::cost::Counts;
use crate::ensemble::{Ensemble, TileSums};
use crate::error::check;
use crate::project::Projector;
use crate::sampler::{Run, runs};
use crate::shade::{Appearance, LitBy, MAX_CHANNELS, Seen, Shader};
use crate::{Error, PackedColor, Sampler, flat};
use glam::{DMat3, DVec3, Mat3};
use rayon::prelude::*;
use splat_core::{Camera, Progress, Shading, Similarity, glam};

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

/// Opaque surfaces drawn exactly, by any other means: particles behind them are hidden, and rays that pass all
/// particles end on them. The way to have α = 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Occluder {
    /// View depth per pixel, rows from the top left; +∞ where there is none.
    pub depth: Vec<f32>,
    /// Radiance per pixel.
    pub color: Vec<[f32; 3]>,
}

impl Occluder {
    /// Radiance at a pixel that has a surface.
    pub(crate) fn at(&self, pixel: usize) -> Option<[f32; 3]> {
        (*self.depth.get(pixel)? < f32::INFINITY).then(|| self.color[pixel])
    }
}

/// Everything that is seen.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Objects; their order does not matter beyond noise.
    pub objects: &'a [Object<'a>],
    /// Lights with their shadows.
    pub lights: &'a [LitBy<'a>],
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// The viewer.
    pub camera: &'a Camera,
    /// Exact opaque surfaces.
    pub occluder: Option<&'a Occluder>,
}

/// What folding may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoldParams {
    /// Bytes of the particles of one batch: 32 a particle. A set that needs more is refused.
    pub max_bytes: u64,
    /// Particles of a batch that are worth a pass over the image; more only takes memory.
    pub batch_particles: u64,
}

impl Default for FoldParams {
    fn default() -> Self {
        Self { max_bytes: 2 << 30, batch_particles: 4 << 20 }
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

    /// Adds `levels` sets to `ensemble`, from set `ensemble.levels()` on; ticks once a set (the caller announces
    /// them). When it fails, the sets of
    /// whole batches before are in, and the ensemble is valid.
    ///
    /// # Errors
    /// [`Error::Parameter`] when the sizes of camera, ensemble and occluder differ, or levels overflow;
    /// [`Error::TooMuch`] when one set needs more than `params.max_bytes`; [`Error::Core`] when cancelled.
    pub fn fold(
        &mut self,
        scene: &Scene<'_>,
        ensemble: &mut Ensemble,
        levels: u32,
        params: &FoldParams,
        progress: &Progress,
    ) -> Result<Counts, Error> {
        let plan = Plan::new(scene, ensemble, levels, params)?;
        let mut counts = Counts::default();
        let mut left = levels;
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
                task.fill(scene.objects[object].sampler, &plan.projectors[object], &plan.tiling, staging);
            }
        });
    }

    fn resolve(&self, scene: &Scene<'_>, plan: &Plan, batch: usize, ensemble: &mut Ensemble) {
        let channels = ensemble.params;
        let shader = Shader { lights: scene.lights, ambient: scene.ambient, camera: scene.camera, channels };
        let n = channels.channels();
        // Without depths every tile gets an empty slice.
        let mut none = vec![[]; if ensemble.depths.is_empty() { plan.tiling.tiles() } else { 0 }];
        let with = ensemble.depths.par_chunks_mut(AREA).chain(none.par_iter_mut().map(|e: &mut [_; 0]| &mut e[..]));
        let sums = ensemble.hits.par_chunks_mut(AREA).zip(ensemble.sums.par_chunks_mut(AREA * n));
        let sums = sums.zip(ensemble.squares.par_chunks_mut(AREA)).zip(with).enumerate();
        sums.for_each_init(Nearest::new, |nearest, (t, (((hits, sums), squares), depths))| {
            let mut tile = TileSums { hits, sums, squares, depths, inverse_unit: 1.0 / channels.unit() };
            nearest.begin(scene, &plan.tiling, t);
            for set in 0..batch {
                nearest.collect(&self.tasks, set, batch, t);
                nearest.add(&self.tasks, [set, batch, t], scene, plan, &shader, &mut tile);
            }
        });
    }
}

/// What is the same for all batches.
struct Plan {
    tiling: Tiling,
    projectors: Vec<Projector>,
    /// Of each task of a set: the object, the rank of the run among those of the object, and the run.
    runs: Vec<(u32, usize, Run)>,
    batch_levels: u32,
    world_from_view: DMat3,
    /// Turn of each object's normals.
    turns: Vec<Mat3>,
    focal: f64,
}

impl Plan {
    fn new(scene: &Scene<'_>, ensemble: &Ensemble, levels: u32, params: &FoldParams) -> Result<Self, Error> {
        let size = ensemble.size();
        check(scene.camera.size == size, "camera size", scene.camera.size, "the size of the ensemble")?;
        if let Some(o) = scene.occluder {
            let pixels = size[0] as usize * size[1] as usize;
            let ok = o.depth.len() == pixels && o.color.len() == pixels;
            check(ok, "occluder", o.depth.len(), "a depth and a colour for each pixel")?;
        }
        check(ensemble.levels.checked_add(levels).is_some(), "levels", levels, "at most 2³² − 1 in all")?;
        let expected: f64 = scene.objects.iter().map(|o| o.sampler.expected_particles()).sum();
        let needed = (expected * BYTES_IN_BATCH as f64) as u64;
        if needed > params.max_bytes {
            return Err(Error::TooMuch { what: "bytes of one set of particles", needed, had: params.max_bytes });
        }
        let budget = (params.max_bytes / BYTES_IN_BATCH).min(params.batch_particles) as f64;
        let axes = scene.camera.axes;
        let of_object = |(o, object): (usize, &Object<'_>)| {
            runs(object.sampler).into_iter().enumerate().map(move |(rank, run)| (o as u32, rank, run))
        };
        let of_objects = scene.objects.iter().enumerate().flat_map(of_object);
        let project =
            |o: &Object<'_>| Projector::new(scene.camera, o.sampler.origin(), &o.transform, o.sampler.cross_section());
        Ok(Self {
            tiling: ensemble.tiling,
            projectors: scene.objects.iter().map(project).collect(),
            runs: of_objects.collect(),
            batch_levels: (budget / expected.max(1.0)).clamp(1.0, 4096.0) as u32,
            world_from_view: DMat3::from_cols(axes[0], axes[1], axes[2]),
            turns: scene.objects.iter().map(|o| DMat3::from_quat(o.transform.rotation).as_mat3()).collect(),
            focal: scene.camera.focal_px(),
        })
    }
}

/// The depth buffer of one tile.
struct Nearest {
    /// [`Record::key`] of the nearest particle, or `limit` where none is.
    nearest: Vec<u64>,
    /// What a pixel starts with: the occluder's depth, and nothing is behind it or at it.
    limit: Vec<u64>,
    /// Records of one task that are seen: their numbers, or their pixels and colours.
    seen: Vec<(u32, PackedColor)>,
    corner: [usize; 2],
}

/// The key of a depth that hides all that is at it or behind it.
fn solid(depth: f32) -> u64 {
    u64::from(depth.to_bits()) << 32
}

impl Nearest {
    fn new() -> Self {
        let open = vec![solid(f32::INFINITY); AREA];
        Self { nearest: open.clone(), limit: open, seen: Vec::new(), corner: [0; 2] }
    }

    fn begin(&mut self, scene: &Scene<'_>, tiling: &Tiling, t: usize) {
        self.corner = [t % tiling.columns * TILE, t / tiling.columns * TILE];
        self.limit.fill(solid(f32::INFINITY));
        if let Some(occluder) = scene.occluder {
            let [w, h] = tiling.size;
            for y in self.corner[1]..(self.corner[1] + TILE).min(h) {
                let row = self.corner[0]..(self.corner[0] + TILE).min(w);
                let from = (y - self.corner[1]) * TILE;
                let depths = &occluder.depth[y * w + row.start..y * w + row.end];
                self.limit[from..].iter_mut().zip(depths).for_each(|(limit, depth)| {
                    // A depth that is not a number is none.
                    *limit = solid(if *depth < f32::INFINITY { depth.max(0.0) } else { f32::INFINITY });
                });
            }
        }
        self.nearest.copy_from_slice(&self.limit);
    }

    /// The nearest particle of each pixel among all objects of one set, whose tasks are `batch` apart.
    #[inline]
    fn collect(&mut self, tasks: &[Task], set: usize, batch: usize, t: usize) {
        for task in tasks.iter().skip(set).step_by(batch) {
            for record in task.tile(t) {
                let nearest = &mut self.nearest[record.pixel()];
                *nearest = record.key().min(*nearest);
            }
        }
    }

    /// Shades what is seen of that set, adds it, and clears the buffer.
    #[inline]
    fn add(
        &mut self,
        tasks: &[Task],
        [set, batch, t]: [usize; 3],
        scene: &Scene<'_>,
        plan: &Plan,
        shader: &Shader<'_>,
        sums: &mut TileSums<'_>,
    ) {
        for task in tasks.iter().skip(set).step_by(batch) {
            let records = task.tile(t);
            let object = &scene.objects[task.object as usize];
            // Beauty alone of what is shown as it is needs neither place nor normal.
            if shader.channels.only_beauty() && object.look.material.shading == Shading::Unlit {
                let n = self.see(records, |seen, _, record| *seen = (record.pixel() as u32, record.color));
                flat::add(sums, &self.seen[..n], object.look.material.emission);
            } else {
                let n = self.see(records, |seen, i, _| seen.0 = i as u32);
                self.shade(n, records, task.object as usize, object, scene, plan, shader, sums);
            }
        }
    }

    /// Lists the records that are the nearest of their pixels, and makes their pixels empty; returns their number.
    #[inline]
    fn see(&mut self, records: &[Record], note: impl Fn(&mut (u32, PackedColor), usize, &Record)) -> usize {
        if self.seen.len() < records.len() {
            self.seen.resize(records.len().next_power_of_two(), Default::default());
        }
        // Written always, kept when seen: whether a particle is seen cannot be foreseen.
        let mut n = 0;
        for (i, record) in records.iter().enumerate() {
            let pixel = record.pixel();
            let is_seen = self.nearest[pixel] == record.key();
            self.nearest[pixel] = if is_seen { self.limit[pixel] } else { self.nearest[pixel] };
            note(&mut self.seen[n], i, record);
            n += usize::from(is_seen);
        }
        n
    }

    fn shade(
        &self,
        n: usize,
        records: &[Record],
        o: usize,
        object: &Object<'_>,
        scene: &Scene<'_>,
        plan: &Plan,
        shader: &Shader<'_>,
        sums: &mut TileSums<'_>,
    ) {
        let channels = shader.channels.channels();
        let mut values = [0.0; MAX_CHANNELS];
        for &(i, _) in &self.seen[..n] {
            let record = &records[i as usize];
            let pixel = record.pixel();
            let [wx, wy] = record.within().map(f64::from);
            let at_px = [(self.corner[0] + pixel % TILE) as f64 + wx, (self.corner[1] + pixel / TILE) as f64 + wy];
            let normal = plan.turns[o] * record.normal.get();
            let from_eye = plan.behind_pixel(scene.camera, at_px, record.depth);
            let seen = Seen { look: &object.look, from_eye, normal, color: record.color.get() };
            shader.shade(&seen, &mut values);
            sums.add(&shader.channels, pixel, &values[..channels], record.depth);
        }
    }
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
