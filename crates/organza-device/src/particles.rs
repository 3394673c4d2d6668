//! Sets of particles, made, projected and averaged by a device.
//!
//! If a sampler has a twin, the device makes its particles itself: only tables are uploaded, once. Other samplers run on the
//! processor, and their particles are uploaded. Sets are independent, so a run takes as many as the
//! device's kernels can see at once. The results of each run are added to the ensemble here, so a lost device costs no more
//! than the sets of its last run.
//!
//! The device also lights particles, through the processor's shadow maps (`lit.rs`).

mod lit;

use crate::{Failure, Helper};
use lit::Light;
pub use lit::Shadow;
use pbsr::gpu::{Capacities, Generated, Nearest, Recorded, Sources, record, record_generated};
use pbsr::{Ensemble, Error, Scene};
use splat_core::Progress;
use splat_shaders::{BufferId, Executor, Lanes, Overflow, PassTime, Ready};

/// Most sets of one run: a look at the clock and at an interrupt comes between two.
const MOST_LEVELS: u32 = 16;
/// Bytes of a particle on the device.
const PARTICLE_BYTES: u64 = 28;
/// Said of particles that a device does not make.
const UPLOADED: &str = "particles by random lines, walks and fields, and of tables too large for the device, are sampled by \
                        the processor";

/// How far sets are folded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Goal {
    /// Sets that the ensemble has then.
    pub until: u32,
    /// Bytes of particles that may lie on the device at once.
    pub max_bytes: u64,
}

/// Sets that are folded by one recording.
#[derive(Clone, Copy)]
struct Batch<'a> {
    scene: &'a Scene<'a>,
    light: &'a Light,
    room: Capacities,
}

/// How a device folds the sets of one scene, kept from step to step, and what it did.
#[derive(Default)]
pub struct Folding<'a> {
    /// Of the lights with a shadow map, in their order.
    shadows: Vec<Shadow<'a>>,
    /// The tables of the samplers, once they were asked for; `None` inside where sets are uploaded.
    sources: Option<Option<Sources>>,
    making: Option<(Generated, Box<dyn Ready>)>,
    uploading: Option<(Recorded, Box<dyn Ready>)>,
    /// Particles that there is room for in a set; more than was expected where that was too few.
    of_set: Option<u32>,
    /// Particles of all runs.
    pub(crate) particles: u64,
    /// The dispatches of all runs.
    pub(crate) passes: Vec<PassTime>,
}

impl<'a> Folding<'a> {
    /// In the light that these maps let through: those of the scene's lights, in their order.
    pub fn new(shadows: Vec<Shadow<'a>>) -> Self {
        Self { shadows, ..Self::default() }
    }

    /// Folds sets of particles until the goal is reached, or as many as the device can; the rest is the processor's. Gives
    /// the number of particles.
    ///
    /// # Errors
    /// When `progress` is cancelled; what was folded before stays in the ensemble.
    pub fn fold(
        &mut self,
        helper: &Helper<'_>,
        scene: &Scene<'_>,
        ensemble: &mut Ensemble,
        goal: Goal,
        progress: &Progress,
    ) -> Result<u64, Error> {
        if let Some(why) = lit::why_not(scene, ensemble, &self.shadows) {
            helper.leave(why);
            return Ok(0);
        }
        let before = self.particles;
        let folded = helper.with(|device| match self.fold_on(device, scene, ensemble, goal, progress) {
            Err(Failure::Particles(e @ Error::Core(splat_core::Error::Cancelled))) => Ok(Err(e)),
            left => left.map(Ok),
        });
        match folded {
            Some(Ok(Some(why))) => helper.leave(why),
            _ if self.uploads() => helper.leave(UPLOADED),
            _ => {}
        }
        folded.unwrap_or(Ok(None)).map(|_| self.particles - before)
    }

    /// Sets that the processor samples, whether or not the device could make them.
    pub(crate) fn uploaded() -> Self {
        Self { sources: Some(None), ..Self::default() }
    }

    /// Whether the processor samples some of the particles.
    fn uploads(&self) -> bool {
        self.sources.as_ref().is_some_and(|sources| sources.as_ref().is_none_or(Sources::has_given))
    }

    /// Folds sets until the goal is reached, or says why the rest is the processor's. What was folded before a failure stays in.
    pub(crate) fn fold_on(
        &mut self,
        device: &mut dyn Executor,
        scene: &Scene<'_>,
        ensemble: &mut Ensemble,
        goal: Goal,
        progress: &Progress,
    ) -> Result<Option<&'static str>, Failure> {
        let folded = self.fold_sets(device, scene, ensemble, goal, progress);
        if folded.is_err() {
            // They belong to a device that may be gone.
            (self.making, self.uploading) = (None, None);
        }
        folded
    }

    fn fold_sets(
        &mut self,
        device: &mut dyn Executor,
        scene: &Scene<'_>,
        ensemble: &mut Ensemble,
        goal: Goal,
        progress: &Progress,
    ) -> Result<Option<&'static str>, Failure> {
        let Goal { until, max_bytes } = goal;
        let most_bytes = device.adapter().binding_bytes.min(max_bytes);
        while ensemble.levels() < until {
            let of_set = *self.of_set.get_or_insert_with(|| expected_of_set(scene));
            let needed = PARTICLE_BYTES * u64::from(of_set.max(1));
            if needed > max_bytes {
                return Err(Error::limit("one set of particles", needed, max_bytes, "bytes").into());
            }
            let levels = (until - ensemble.levels()).min(MOST_LEVELS).min((most_bytes / needed).max(1) as u32);
            let room = capacities(scene, of_set, levels);
            let binding_bytes = device.adapter().binding_bytes;
            let light = Light::record(scene, ensemble, &room, &self.shadows);
            if light.is_larger(binding_bytes) {
                return Ok(Some(
                    "a shadow map is larger than the device's kernels see: the processor lights particles",
                ));
            }
            let batch = Batch { scene, light: &light, room };
            let fit = |s: &Sources| s.largest_bytes() <= binding_bytes && s.bytes() <= max_bytes;
            let sources = || Sources::new(scene).filter(fit);
            let folded = match self.sources.get_or_insert_with(sources).take() {
                None => self.upload(device, batch, ensemble)?,
                Some(sources) => {
                    let folded = self.make(device, &sources, batch, ensemble);
                    self.sources = Some(Some(sources));
                    folded?
                }
            };
            match folded {
                Ok(particles) => self.particles += particles,
                Err(Error::Overflow(Overflow { needed, had, .. })) => {
                    self.of_set = Some(more_of_set(of_set, needed, had)?);
                    continue;
                }
                Err(other) => return Err(other.into()),
            }
            progress.tick(u64::from(levels)).map_err(Error::from)?;
        }
        Ok(None)
    }

    /// Lets the device make as many sets as there is room for, and fold them; the inner error says how much room they need.
    fn make(
        &mut self,
        device: &mut dyn Executor,
        sources: &Sources,
        Batch { scene, light, room }: Batch<'_>,
        ensemble: &mut Ensemble,
    ) -> Result<Result<u64, Error>, Failure> {
        let kept = self.making.take().filter(|(generated, _)| generated.capacities == room);
        let fresh = kept.is_none();
        let (generated, ready) = self.making.insert(match kept {
            Some(kept) => kept,
            None => {
                let nearest = Nearest::for_adapter(device.adapter());
                let generated =
                    light.with(scene, ensemble, |lighting| record_generated(room, nearest, lighting, sources))?;
                let ready = device.prepare(&generated.recording.by(Lanes::for_adapter(device.adapter())))?;
                (generated, ready)
            }
        });
        let mut inputs = match generated.next(sources, scene, ensemble) {
            Ok(inputs) => inputs,
            Err(why) => return Ok(Err(why)),
        };
        let maps = if fresh { light.uploads(scene, &self.shadows)? } else { Vec::new() };
        if fresh {
            inputs.extend(generated.tables(sources, scene, ensemble)?);
        }
        for (k, (shadow, map)) in maps.iter().enumerate() {
            inputs.extend(generated.shadow_inputs(k, shadow.inputs(map)));
        }
        let inputs: Vec<(BufferId, &[u8])> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
        let run = ready.run(&inputs)?;
        let added = generated.add(&run, ensemble);
        self.passes.extend(run.passes);
        Ok(added)
    }

    /// Samples and uploads as many sets as there is room for, and folds them.
    fn upload(
        &mut self,
        device: &mut dyn Executor,
        Batch { scene, light, room }: Batch<'_>,
        ensemble: &mut Ensemble,
    ) -> Result<Result<u64, Error>, Failure> {
        let kept = self.uploading.take().filter(|(recorded, _)| recorded.capacities == room);
        let fresh = kept.is_none();
        let (recorded, ready) = self.uploading.insert(match kept {
            Some(kept) => kept,
            None => {
                let nearest = Nearest::for_adapter(device.adapter());
                let recorded = light.with(scene, ensemble, |lighting| record(room, nearest, lighting))?;
                let ready = device.prepare(&recorded.recording.by(Lanes::for_adapter(device.adapter())))?;
                (recorded, ready)
            }
        });
        let uploads = match recorded.uploads(scene, ensemble) {
            Ok(uploads) => uploads,
            Err(why) => return Ok(Err(why)),
        };
        let mut inputs = recorded.inputs(&uploads);
        let maps = if fresh { light.uploads(scene, &self.shadows)? } else { Vec::new() };
        if fresh {
            inputs.extend(recorded.tables(scene)?);
        }
        for (k, (shadow, map)) in maps.iter().enumerate() {
            inputs.extend(recorded.shadow_inputs(k, shadow.inputs(map)));
        }
        let inputs: Vec<(BufferId, &[u8])> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
        let run = ready.run(&inputs)?;
        recorded.add(run.bytes(recorded.sums), ensemble)?;
        self.passes.extend(run.passes);
        Ok(Ok(uploads.particles))
    }
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
        return Err(Error::limit("one set", needed, had, "particles"));
    }
    Ok(more as u32)
}
