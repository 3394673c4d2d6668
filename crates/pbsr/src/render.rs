//! STEPS 1 to 3 for any number of sets: sample, project, keep the nearest of each pixel, add to the ensemble.
//!
//! Sets are folded in batches. First, a task for each (set, object, run of chunks) samples, projects and sorts its
//! particles by tile. Then a task for each tile goes through the sets in order, with a depth buffer for that tile.
//! Nothing is shared between tasks and every sum is in integers: the result has the same bits for any number of threads.
//! Memory depends on the image and on the particles of one batch, never on the number of sets.

use crate::Error;
use crate::cost::Counts;
use crate::ensemble::Ensemble;
use crate::project::bins::{Filling, Staging, Task};
use crate::project::colored::Colored;
use crate::project::nearest::Nearest;
use crate::project::resolve::{Plan, Resolve};
use crate::project::shade::Shader;
use crate::scene::{FoldParams, Scene};
use rayon::prelude::*;
use splat_core::Progress;

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
        let resolve = Resolve { scene, plan, shader: &shader, tasks: &self.tasks, batch };
        let mut tiles = ensemble.tiles();
        let tiles = tiles.par_iter_mut().enumerate();
        if channels.colored_extinction {
            tiles.for_each_init(Colored::new, |nearest, (t, sums)| nearest.fold(&resolve, t, sums));
        } else {
            tiles.for_each_init(Nearest::new, |nearest, (t, sums)| nearest.fold(&resolve, t, sums));
        }
    }
}
