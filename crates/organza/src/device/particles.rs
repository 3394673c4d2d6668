//! Sets of particles, projected and averaged by a device.
//!
//! Sets are independent, so as many go into one run as the device's kernels can see at once; what a run gave is added to
//! the ensemble here, and a device that is lost costs no more than the sets of its last run.

use super::Failure;
use pbsr::gpu::{Capacities, Recorded, record};
use pbsr::{Ensemble, Error, Scene};
use splat_core::{Progress, Shading};
use splat_shaders::{Executor, PassTime, Ready};

/// Most sets of one run: a look at the clock and at an interrupt comes between two.
const MOST_LEVELS: u32 = 16;
/// Bytes of a particle that is uploaded.
const PARTICLE_BYTES: u64 = 28;

/// What folding on a device did, failures included.
#[derive(Debug, Default)]
pub(super) struct Folded {
    /// Particles that were uploaded.
    pub(super) particles: u64,
    /// The dispatches of all runs.
    pub(super) passes: Vec<PassTime>,
}

/// Why a scene's particles are the processor's; `None` when a device can fold them.
pub(super) fn why_not(scene: &Scene<'_>, ensemble: &Ensemble) -> Option<&'static str> {
    let params = ensemble.params();
    if params.channels() != 3 || params.depth_range.is_some() || params.object {
        return Some("particles with layers besides beauty are the processor's");
    }
    if params.colored_extinction {
        return Some("particles that hide red, green and blue apart are the processor's");
    }
    let lit = scene.objects.iter().any(|o| o.look.material.shading != Shading::Unlit);
    lit.then_some("particles that are lit are the processor's (a device does material.shading = \"unlit\")")
}

/// Folds sets until the ensemble has `until` of them, uploading at most so many bytes of particles at once. What was folded before a failure stays in.
pub(super) fn fold_on(
    device: &mut dyn Executor,
    scene: &Scene<'_>,
    ensemble: &mut Ensemble,
    until: u32,
    max_bytes: u64,
    progress: &Progress,
    folded: &mut Folded,
) -> Result<(), Failure> {
    let most_bytes = device.adapter().binding_bytes.min(max_bytes);
    let mut of_set = expected_of_set(scene);
    let mut prepared: Option<(Recorded, Box<dyn Ready>)> = None;
    while ensemble.levels() < until {
        let needed = PARTICLE_BYTES * u64::from(of_set.max(1));
        if needed > max_bytes {
            return Err(Error::TooMuch { what: "bytes of one set of particles", needed, had: max_bytes }.into());
        }
        let fit = most_bytes / needed;
        let levels = (until - ensemble.levels()).min(MOST_LEVELS).min(fit.max(1) as u32);
        let room = capacities(scene, of_set, levels);
        let (recorded, ready) = match prepared.take().filter(|(recorded, _)| recorded.capacities == room) {
            Some(same) => prepared.insert(same),
            None => {
                let recorded = record(room)?;
                let ready = device.prepare(&recorded.recording)?;
                prepared.insert((recorded, ready))
            }
        };
        let uploads = match recorded.uploads(scene, ensemble) {
            Err(Error::TooMuch { needed, had, .. }) => {
                of_set = more_of_set(of_set, needed, had)?;
                continue;
            }
            uploads => uploads?,
        };
        let run = ready.run(&recorded.inputs(&uploads))?;
        recorded.add(run.bytes(recorded.sums), ensemble)?;
        folded.particles += uploads.particles;
        folded.passes.extend(run.passes);
        progress.tick(u64::from(levels)).map_err(Error::from)?;
    }
    Ok(())
}

fn capacities(scene: &Scene<'_>, of_set: u32, levels: u32) -> Capacities {
    let objects = scene.objects.len() as u32;
    Capacities { size: scene.camera.size, objects, levels, of_set, particles: of_set.saturating_mul(levels) }
}

/// Room for the particles of a set: what is expected and six standard deviations of a Poisson number.
fn expected_of_set(scene: &Scene<'_>) -> u32 {
    let expected: f64 = scene.objects.iter().map(|o| o.sampler.expected_particles()).sum();
    (expected + 6.0 * expected.sqrt() + 64.0) as u32
}

/// Room for a set of which there are more particles than that: at least a quarter more.
fn more_of_set(of_set: u32, needed: u64, had: u64) -> Result<u32, Error> {
    let factor = (needed as f64 / had.max(1) as f64).max(1.25);
    let more = (f64::from(of_set) * factor).ceil();
    if more > f64::from(u32::MAX) {
        return Err(Error::TooMuch { what: "particles of one set", needed, had });
    }
    Ok(more as u32)
}
