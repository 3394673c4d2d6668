//! An opened device: one that is lost is opened once more, one that fails is given up and the processor goes on.

use super::chain::{Chained, Splats, chain_on};
use super::order::order_on;
use super::particles::Folding;
use super::shadows::{LookUps, LookedUp, look_up_on, map_on};
use super::splats::{composite_on, why_not_composite};
use super::trial::{order_trial, shadow_trial};
use super::{DeviceChoice, Failure, fault};
use crate::Error;
use hbsort::{Params, SliceOrder};
use pbsr::{Ensemble, Scene};
use splat_core::raster::FoldInput;
use splat_core::raster::RasterCounts;
use splat_core::{Accumulator, Camera, Cloud, Progress, Receiver};
use splat_shaders::{Backend, Choice, DeviceError, Executor, Validation};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tsm::{Deposits, ShadowMap};

/// The device that helps one render, and what was said about it.
pub(crate) struct Helper {
    /// `None` once it was given up.
    opened: Mutex<Option<Opened>>,
    history: Mutex<History>,
    /// Backend and device.
    name: String,
}

struct Opened {
    backend: Arc<dyn Backend>,
    choice: Choice,
    executor: Box<dyn Executor>,
}

#[derive(Default)]
struct History {
    said: Vec<String>,
    /// Whether it did anything.
    helped: bool,
    /// Whether it was lost and opened again.
    reopened: bool,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Helper {
    /// Opens the device that was asked for; whoever asks for one gets it or an error.
    pub(crate) fn open(choice: &DeviceChoice) -> Result<Self, Error> {
        let mut faults = Vec::new();
        for backend in &choice.backends {
            match open_one(backend, &choice.choice) {
                Ok(executor) => {
                    let name = format!("{}, {}", backend.name(), executor.adapter().name);
                    let opened = Opened { backend: backend.clone(), choice: choice.choice.clone(), executor };
                    return Ok(Self { opened: Mutex::new(Some(opened)), history: Mutex::default(), name });
                }
                Err(why) if choice.backends.len() == 1 => faults.push(why.to_string()),
                Err(why) => faults.push(format!("{}: {why}", backend.name())),
            }
        }
        let why = faults.join("; ");
        if !choice.or_processor {
            return Err(fault(&choice.names(), &why));
        }
        let helper = Self { opened: Mutex::new(None), history: Mutex::default(), name: String::new() };
        helper.say(format!("no GPU helps ({why}): the processor draws alone"));
        Ok(helper)
    }

    /// What drew, as metadata and reports name it.
    pub(crate) fn name(&self) -> String {
        match (held(&self.history).helped, held(&self.opened).is_some()) {
            (true, true) => self.name.clone(),
            (true, false) => format!("{}, then cpu", self.name),
            (false, _) => "cpu".to_owned(),
        }
    }

    /// What a user should know, one sentence each.
    pub(crate) fn said(self) -> Vec<String> {
        self.history.into_inner().unwrap_or_else(PoisonError::into_inner).said
    }

    /// The exact order of some splats, or `None` for the processor to find it.
    pub(crate) fn order(&self, cloud: &Cloud, ids: &[u32], camera: &Camera, params: &Params) -> Option<SliceOrder> {
        if !params.exact {
            self.leave("slices without order inside (render.points.exact = false) are made by the processor");
            return None;
        }
        let (order, _) = self.with(|device| order_on(device, cloud, ids, camera, params))?;
        Some(order)
    }

    /// The map of these deposits, or `None` for the processor to make its lists.
    pub(crate) fn shadow_map(&self, deposits: &Deposits) -> Option<ShadowMap> {
        if deposits.entries() == [0, 0] {
            return None;
        }
        let made = self.with(|device| map_on(device, deposits))?;
        if made.is_none() {
            self.leave("a shadow map's cells have more entries than the device can see: the processor makes its lists");
        }
        made.map(|(map, _)| map)
    }

    /// The light at the splats `ids` of a cloud, or `None` for the processor to look it up.
    pub(crate) fn look_up<'a>(&self, map: &'a ShadowMap, cloud: &Cloud, ids: &[u32]) -> Option<LookedUp<'a>> {
        let receiver = |&id: &u32| {
            let i = id as usize;
            Receiver {
                position: cloud.position[i],
                normal: cloud.normal_of(i),
                radius: cloud.radius[i],
                kind: cloud.kind[i],
            }
        };
        let receivers: Vec<Receiver> = ids.iter().map(receiver).collect();
        match self.with(|device| look_up_on(device, map, &receivers))? {
            LookUps::Done(lights, _) => Some(LookedUp::new(map, cloud.len(), ids, lights)),
            LookUps::Left(why) => {
                self.leave(why);
                None
            }
        }
    }

    /// Composites splats in order, or leaves them to the processor.
    pub(crate) fn composite(&self, input: &FoldInput<'_>, accumulator: &mut Accumulator) -> Option<RasterCounts> {
        if let Some(why) = why_not_composite(input) {
            self.leave(why);
            return None;
        }
        let done = self.with(|device| composite_on(device, input, accumulator))?;
        if done.is_none() {
            self.leave("a tile has more splats than the software driver goes through: the processor composites them");
        }
        done.map(|(counts, _)| counts)
    }

    /// Whether shadow maps may be made and stay where the splats are: whether the device makes the processor's, bit for bit.
    pub(crate) fn keeps_shadows(&self) -> bool {
        self.with(|device| shadow_trial(device).or_else(too_small)).unwrap_or(false)
    }

    /// Orders, projects, shades and composites splats, or leaves them to the passes one by one.
    pub(crate) fn chain(&self, splats: &Splats<'_>, accumulator: &mut Accumulator) -> Result<Option<Chained>, Error> {
        let done = self.with(|device| match chain_on(device, splats, accumulator) {
            Err(Failure::Splats(splat_core::Error::Cancelled)) => Ok(Err(Error::Cancelled)),
            done => done.map(Ok),
        });
        done.unwrap_or(Ok(None))
    }

    /// Folds sets of particles until the ensemble has `until` of them, or as many as the device can; the rest is the
    /// processor's. Gives the number of particles. `folding` is that of the steps before.
    pub(crate) fn fold(
        &self,
        folding: &mut Folding<'_>,
        scene: &Scene<'_>,
        ensemble: &mut Ensemble,
        until: u32,
        max_bytes: u64,
        progress: &Progress,
    ) -> Result<u64, pbsr::Error> {
        if let Some(why) = folding.why_not(scene, ensemble) {
            self.leave(why);
            return Ok(0);
        }
        let before = folding.particles;
        let folded = self.with(|device| match folding.fold_on(device, scene, ensemble, until, max_bytes, progress) {
            Err(Failure::Particles(e @ pbsr::Error::Core(splat_core::Error::Cancelled))) => Ok(Err(e)),
            left => left.map(Ok),
        });
        match folded {
            Some(Ok(Some(why))) => self.leave(why),
            _ if folding.uploads() => {
                self.leave("particles by random lines, walks and fields, and of tables too large for the device, are sampled by the processor");
            }
            _ => {}
        }
        folded.unwrap_or(Ok(None)).map(|_| folding.particles - before)
    }

    /// Says why something is the processor's, where somebody could have expected the device to do it.
    pub(crate) fn leave(&self, why: &str) {
        if held(&self.opened).is_some() {
            self.say(why.to_owned());
        }
    }

    /// Does some work on the device, once more on a fresh one if it is lost meanwhile for the first time. `None` when
    /// there is no device, or none any more: what the work was for is the processor's.
    fn with<T>(&self, mut work: impl FnMut(&mut dyn Executor) -> Result<T, Failure>) -> Option<T> {
        let mut opened = held(&self.opened);
        loop {
            let device = opened.as_mut()?;
            let why = match work(&mut *device.executor) {
                Ok(done) => {
                    held(&self.history).helped = true;
                    return Some(done);
                }
                Err(why) => why,
            };
            let lost = matches!(why, Failure::Device(DeviceError::Lost));
            let again = (lost && !std::mem::replace(&mut held(&self.history).reopened, lost))
                .then(|| device.backend.open(&device.choice, Validation::Off));
            match again {
                Some(Ok(executor)) => {
                    device.executor = executor;
                    self.say(format!("{}: {why} and opened once more", self.name));
                }
                _ => {
                    self.say(format!("{}: {why}; the processor goes on", self.name));
                    *opened = None;
                }
            }
        }
    }

    fn say(&self, what: String) {
        let said = &mut held(&self.history).said;
        // Of many batches one line.
        if !said.contains(&what) {
            said.push(what);
        }
    }
}

/// A device on which not even a trial has room does nothing of the kind.
fn too_small(why: Failure) -> Result<bool, Failure> {
    match why {
        Failure::Device(DeviceError::TooLarge { .. } | DeviceError::Memory { .. }) => Ok(false),
        why => Err(why),
    }
}

/// A device that keeps the picture, bit for bit.
fn open_one(backend: &Arc<dyn Backend>, choice: &Choice) -> Result<Box<dyn Executor>, Failure> {
    let mut executor = backend.open(choice, Validation::Off)?;
    if order_trial(&mut *executor)? { Ok(executor) } else { Err(Failure::Rounds) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Projection;
    use splat_core::glam::DVec3;
    use splat_shaders::{Adapter, AdapterKind, Ready, Recording, SubgroupOps};
    use std::sync::atomic::{AtomicU32, Ordering};

    /// Devices that can be opened so many times, and do nothing.
    #[derive(Debug, Default)]
    struct Openings(AtomicU32);

    struct Nothing(Adapter);

    impl Backend for Openings {
        fn name(&self) -> &'static str {
            "test"
        }

        fn adapters(&self) -> Result<Vec<Adapter>, DeviceError> {
            Ok(Vec::new())
        }

        fn open(&self, _: &Choice, _: Validation) -> Result<Box<dyn Executor>, DeviceError> {
            let left = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
            left.map_err(|_| DeviceError::NoDevice { why: "gone".to_owned() })?;
            let (name, driver) = ("X".to_owned(), String::new());
            let kind = AdapterKind::Discrete;
            Ok(Box::new(Nothing(Adapter {
                name,
                driver,
                kind,
                memory_bytes: 0,
                binding_bytes: 0,
                subgroup: 0,
                wide_atomics: false,
                subgroup_ops: SubgroupOps::NONE,
                drawing: Default::default(),
            })))
        }
    }

    impl Executor for Nothing {
        fn adapter(&self) -> &Adapter {
            &self.0
        }

        fn prepare(&mut self, _: &Recording) -> Result<Box<dyn Ready>, DeviceError> {
            Err(DeviceError::Lost)
        }
    }

    /// A helper whose device was opened, and can be so many times more.
    fn helper(openings: u32) -> Helper {
        let backend: Arc<dyn Backend> = Arc::new(Openings(AtomicU32::new(openings + 1)));
        let executor = backend.open(&Choice::Gpu, Validation::Off).expect("the first opening");
        let opened = Mutex::new(Some(Opened { backend, choice: Choice::Gpu, executor }));
        Helper { opened, history: Mutex::default(), name: "test, X".to_owned() }
    }

    /// Works on the device, which is lost at these attempts.
    fn attempt(helper: &Helper, lost: &[u32]) -> Option<u32> {
        let mut attempts = 0;
        helper.with(|_| {
            attempts += 1;
            if lost.contains(&attempts) { Err(DeviceError::Lost.into()) } else { Ok(attempts) }
        })
    }

    #[test]
    fn a_lost_device_is_opened_once_more_in_a_render() {
        let helper = helper(9);
        assert_eq!(attempt(&helper, &[]), Some(1));
        assert_eq!(attempt(&helper, &[1]), Some(2));
        assert_eq!((helper.name(), attempt(&helper, &[])), ("test, X".to_owned(), Some(1)));
        // The second loss is the last, and nobody asks a third device.
        assert_eq!([attempt(&helper, &[1]), attempt(&helper, &[])], [None, None]);
        assert_eq!(helper.name(), "test, X, then cpu");
        let said = helper.said();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].contains("opened once more") && said[1].ends_with("the processor goes on"), "{said:?}");
    }

    #[test]
    fn a_device_that_is_lost_at_once_and_again_leaves_the_processor() {
        let helper = helper(9);
        assert_eq!(attempt(&helper, &[1, 2]), None);
        assert_eq!((helper.name(), helper.said().len()), ("cpu".to_owned(), 2));
    }

    #[test]
    fn what_cannot_be_opened_again_or_fails_otherwise_is_given_up() {
        let lost = helper(0);
        assert_eq!((attempt(&lost, &[1]), lost.said().len()), (None, 1));
        let refused = helper(9);
        let none: Option<()> = refused.with(|_| Err(DeviceError::Memory { bytes: 7 }.into()));
        assert_eq!(
            (none, refused.said()),
            (None, vec!["test, X: the device has no memory for 7 bytes; the processor goes on".to_owned()])
        );
    }

    #[test]
    fn where_no_device_is_left_the_processor_is_asked_without_a_word() {
        let helper = helper(0);
        assert_eq!(attempt(&helper, &[1]), None);
        let view = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, [8, 8]).expect("a camera");
        let params = |exact| Params { exact, ..Params::default() };
        assert_eq!(helper.order(&Cloud::new(DVec3::ZERO), &[], &camera, &params(true)), None);
        assert_eq!(helper.order(&Cloud::new(DVec3::ZERO), &[], &camera, &params(false)), None);
        assert_eq!(helper.said().len(), 1);
    }

    #[test]
    fn a_device_that_fails_its_trial_is_not_taken() {
        let backends: Vec<Arc<dyn Backend>> = vec![Arc::new(Openings(AtomicU32::new(9)))];
        let required = DeviceChoice { backends, choice: Choice::Gpu, or_processor: false };
        assert_eq!(Helper::open(&required).map(|h| h.name()).map_err(|e| e.exit_code()), Err(6));
        let helper = Helper::open(&DeviceChoice { or_processor: true, ..required }).expect("the processor");
        assert_eq!(helper.name(), "cpu");
        assert_eq!(helper.said(), ["no GPU helps (the device was lost): the processor draws alone"]);
    }
}
