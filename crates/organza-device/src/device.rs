//! An opened device. A lost device is opened once more in a picture. A failed one is given up, and the processor continues.

use crate::trial::order_trial;
use crate::{DeviceChoice, Error, Failure};
use splat_shaders::{Backend, Choice, DeviceError, Executor, Validation};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A device that was opened once, for as many pictures as one likes.
pub struct Device {
    /// `None` where it is left to the processor, and once the device was given up.
    opened: Mutex<Option<Opened>>,
    /// Backend and device.
    name: String,
    /// Why it is left to the processor from the beginning.
    absent: Option<String>,
}

struct Opened {
    backend: Arc<dyn Backend>,
    choice: Choice,
    executor: Box<dyn Executor>,
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Device").field("name", &self.name).field("absent", &self.absent).finish_non_exhaustive()
    }
}

impl Device {
    /// Opens the device that was asked for, if it finds the processor's order of generated splats, bit for bit. Whoever asks
    /// for one gets it or an error.
    ///
    /// # Errors
    /// Where no backend opens such a device, and [`DeviceChoice::or_processor`] does not leave it to the processor.
    pub fn open(choice: &DeviceChoice) -> Result<Self, Error> {
        let mut faults = Vec::new();
        for backend in &choice.backends {
            match open_one(backend, &choice.choice) {
                Ok(executor) => {
                    let name = format!("{}, {}", backend.name(), executor.adapter().name);
                    let opened = Opened { backend: backend.clone(), choice: choice.choice.clone(), executor };
                    return Ok(Self { opened: Mutex::new(Some(opened)), name, absent: None });
                }
                Err(why) if choice.backends.len() == 1 => faults.push(why.to_string()),
                Err(why) => faults.push(format!("{}: {why}", backend.name())),
            }
        }
        let why = faults.join("; ");
        if !choice.or_processor {
            return Err(Error { backend: choice.names(), why });
        }
        Ok(Self { opened: Mutex::new(None), name: String::new(), absent: Some(why) })
    }
}

/// A device that keeps the picture, bit for bit.
fn open_one(backend: &Arc<dyn Backend>, choice: &Choice) -> Result<Box<dyn Executor>, Failure> {
    let mut executor = backend.open(choice, Validation::Off)?;
    if order_trial(&mut *executor)? { Ok(executor) } else { Err(Failure::Rounds) }
}

/// The work of a device on one picture, and what was said about it.
pub struct Helper<'d> {
    device: &'d Device,
    history: Mutex<History>,
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

impl<'d> Helper<'d> {
    /// Nothing done yet.
    pub fn new(device: &'d Device) -> Self {
        let absent = device.absent.iter().map(|why| format!("no GPU helps ({why}): the processor draws alone"));
        let history = History { said: absent.collect(), ..History::default() };
        Self { device, history: Mutex::new(history) }
    }

    /// Name of the drawing device for metadata and reports.
    pub fn name(&self) -> String {
        match (held(&self.history).helped, held(&self.device.opened).is_some()) {
            (true, true) => self.device.name.clone(),
            (true, false) => format!("{}, then cpu", self.device.name),
            (false, _) => "cpu".to_owned(),
        }
    }

    /// Returns messages for the user, one sentence each.
    pub fn said(self) -> Vec<String> {
        self.history.into_inner().unwrap_or_else(PoisonError::into_inner).said
    }

    /// Says why something is the processor's, where somebody could have expected the device to do it.
    pub fn leave(&self, why: &str) {
        if held(&self.device.opened).is_some() {
            self.say(why.to_owned());
        }
    }

    /// Does some work on the device, once more on a fresh one if it is lost meanwhile for the first time. `None` when
    /// there is no device, or none any more: what the work was for is the processor's.
    pub(crate) fn with<T>(&self, mut work: impl FnMut(&mut dyn Executor) -> Result<T, Failure>) -> Option<T> {
        let mut opened = held(&self.device.opened);
        let name = &self.device.name;
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
                    self.say(format!("{name}: {why} and opened once more"));
                }
                _ => {
                    self.say(format!("{name}: {why}; the processor goes on"));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::order;
    use hbsort::Params;
    use splat_core::glam::DVec3;
    use splat_core::{Camera, Cloud, Projection};
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
            let name = "X".to_owned();
            let driver = String::new();
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

    /// A device that was opened, and can be so many times more.
    fn device(openings: u32) -> Device {
        let backend: Arc<dyn Backend> = Arc::new(Openings(AtomicU32::new(openings + 1)));
        let executor = backend.open(&Choice::Gpu, Validation::Off).expect("the first opening");
        let opened = Mutex::new(Some(Opened { backend, choice: Choice::Gpu, executor }));
        Device { opened, name: "test, X".to_owned(), absent: None }
    }

    /// Works on the device, which is lost at these attempts.
    fn attempt(helper: &Helper<'_>, lost: &[u32]) -> Option<u32> {
        let mut attempts = 0;
        helper.with(|_| {
            attempts += 1;
            if lost.contains(&attempts) { Err(DeviceError::Lost.into()) } else { Ok(attempts) }
        })
    }

    #[test]
    fn a_lost_device_is_opened_once_more_in_a_render() {
        let device = device(9);
        let helper = Helper::new(&device);
        assert_eq!(attempt(&helper, &[]), Some(1));
        assert_eq!(attempt(&helper, &[1]), Some(2));
        assert_eq!((helper.name(), attempt(&helper, &[])), ("test, X".to_owned(), Some(1)));
        // The second loss is the last, and nobody asks a third device.
        assert_eq!([attempt(&helper, &[1]), attempt(&helper, &[])], [None, None]);
        assert_eq!(helper.name(), "test, X, then cpu");
        let said = helper.said();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].contains("opened once more") && said[1].ends_with("the processor goes on"), "{said:?}");
        // It stays given up, which was said where it happened.
        let next = Helper::new(&device);
        assert_eq!((attempt(&next, &[]), next.name(), next.said()), (None, "cpu".to_owned(), vec![]));
    }

    #[test]
    fn every_picture_may_lose_its_device_once() {
        let device = device(9);
        for _ in 0..3 {
            let helper = Helper::new(&device);
            assert_eq!((attempt(&helper, &[1]), helper.said().len()), (Some(2), 1));
        }
    }

    #[test]
    fn a_device_that_is_lost_at_once_and_again_leaves_the_processor() {
        let device = device(9);
        let helper = Helper::new(&device);
        assert_eq!(attempt(&helper, &[1, 2]), None);
        assert_eq!((helper.name(), helper.said().len()), ("cpu".to_owned(), 2));
    }

    #[test]
    fn what_cannot_be_opened_again_or_fails_otherwise_is_given_up() {
        let gone = device(0);
        let whole = device(9);
        let lost = Helper::new(&gone);
        assert_eq!((attempt(&lost, &[1]), lost.said().len()), (None, 1));
        let refused = Helper::new(&whole);
        let none: Option<()> = refused.with(|_| Err(DeviceError::Memory { bytes: 7 }.into()));
        assert_eq!(
            (none, refused.said()),
            (None, vec!["test, X: the device has no memory for 7 bytes; the processor goes on".to_owned()])
        );
    }

    #[test]
    fn where_no_device_is_left_the_processor_is_asked_without_a_word() {
        let device = device(0);
        let helper = Helper::new(&device);
        assert_eq!(attempt(&helper, &[1]), None);
        let view = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, [8, 8]).expect("a camera");
        let params = |exact| Params { exact, ..Params::default() };
        assert_eq!(order(&helper, &Cloud::new(DVec3::ZERO), &[], &camera, &params(true)), None);
        assert_eq!(order(&helper, &Cloud::new(DVec3::ZERO), &[], &camera, &params(false)), None);
        assert_eq!(helper.said().len(), 1);
    }

    #[test]
    fn a_device_that_fails_its_trial_is_not_taken() {
        let backends: Vec<Arc<dyn Backend>> = vec![Arc::new(Openings(AtomicU32::new(9)))];
        let required = DeviceChoice { backends, choice: Choice::Gpu, or_processor: false };
        let refused = Device::open(&required).map(|_| ()).map_err(|e| e.to_string());
        assert_eq!(refused, Err("--backend test: the device was lost".to_owned()));
        let device = Device::open(&DeviceChoice { or_processor: true, ..required }).expect("the processor");
        let helper = Helper::new(&device);
        assert_eq!(helper.name(), "cpu");
        assert_eq!(helper.said(), ["no GPU helps (the device was lost): the processor draws alone"]);
    }

    #[test]
    fn a_device_that_is_not_there_is_an_error_for_who_asked() {
        let name = || "no such device".to_owned();
        let named = || Choice::Named(name());
        for choice in [DeviceChoice::ash(named()), DeviceChoice::wgpu(named()), DeviceChoice::auto(Some(name()))] {
            let Err(error) = Device::open(&choice) else { panic!("opened") };
            assert!(error.to_string().starts_with(&format!("--backend {}: ", choice.names())), "{error}");
        }
    }
}
