//! The cost of folding: predicted from the samplers, counted while it runs.

use crate::project::bins::Task;
use crate::scene::BYTES_IN_BATCH;
use crate::{EnsembleParams, FoldParams, Scene};

/// Work and memory of some sets, before any of it is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Particles in the mean; their number has the variance of its mean.
    pub particles: f64,
    /// Bytes of the particles of one batch.
    pub batch_bytes: u64,
    /// Bytes of the ensemble.
    pub ensemble_bytes: u64,
}

/// The counts of the work done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Sets folded.
    pub levels: u64,
    /// Particles sampled, or read from kept sets.
    pub particles: u64,
    /// Particles on pixels: in view and not thinned out; a widened one counts for each of its pixels.
    pub fragments: u64,
    /// The most bytes that a batch took.
    pub bytes: u64,
}

impl Counts {
    pub(crate) fn add(&mut self, tasks: &[Task], levels: u32) {
        self.levels += u64::from(levels);
        self.particles += tasks.iter().map(|t| t.particles).sum::<u64>();
        self.fragments += tasks.iter().map(Task::records).sum::<u64>();
        self.bytes = self.bytes.max(tasks.iter().map(Task::bytes).sum());
    }
}

/// Predicts the cost of folding sets of `scene`.
pub fn predict(scene: &Scene<'_>, ensemble: &EnsembleParams, params: &FoldParams) -> Prediction {
    let of_set: f64 = scene.objects.iter().map(|o| o.sampler.expected_particles()).sum();
    let particles = of_set * f64::from(params.levels);
    let in_batch = (params.batch_particles as f64).min(particles).max(of_set);
    Prediction {
        particles,
        batch_bytes: ((in_batch * BYTES_IN_BATCH as f64) as u64).min(params.limits.max_bytes),
        ensemble_bytes: ensemble.bytes(scene.camera.size.map(u64::from)),
    }
}
