//! An opened device and what it keeps between recordings.

use crate::adapters::{Found, find};
use crate::failure;
use crate::instance::Instance;
use crate::memory::Memory;
use crate::pipeline::Pipeline;
use crate::prepared::Prepared;
use ash::{khr, vk};
use splat_shaders::{Adapter, Barrier, Choice, DeviceError, Inputs, Kernel, Recording, Run, Validation, barriers};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The logical device and its one queue; everything made from it holds it.
pub(crate) struct Logical {
    pub(crate) raw: ash::Device,
    pub(crate) instance: Instance,
    pub(crate) found: Found,
    /// Only one thread at a time may submit.
    pub(crate) queue: Mutex<vk::Queue>,
}

impl Drop for Logical {
    fn drop(&mut self) {
        // SAFETY: whatever was made from the device holds it, so nothing is left.
        unsafe { self.raw.destroy_device(None) }
    }
}

/// A device that runs recordings. Everything it made lives as long as somebody holds it.
pub struct Device {
    logical: Arc<Logical>,
    memory: Arc<Memory>,
    pipelines: HashMap<&'static str, Arc<Pipeline>>,
    patience: Duration,
    watched: bool,
}

impl Device {
    /// Opens the chosen adapter.
    ///
    /// # Errors
    /// [`DeviceError::NoDevice`] when there is none, or no validation layer where one is asked for;
    /// [`DeviceError::Driver`] when the driver refuses.
    pub fn open(choice: &Choice, validation: Validation) -> Result<Self, DeviceError> {
        let instance = Instance::new(validation)?;
        let mut found = find(&instance)?;
        let adapters: Vec<Adapter> = found.iter().map(|f| f.adapter.clone()).collect();
        let Some(at) = choice.pick(&adapters) else {
            let names: Vec<&str> = adapters.iter().map(|a| a.name.as_str()).collect();
            return Err(DeviceError::NoDevice { why: format!("{choice:?} of [{}]", names.join(", ")) });
        };
        let found = found.swap_remove(at);
        let priorities = [1.0];
        let queues =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(found.family).queue_priorities(&priorities)];
        // What a kernel reads beyond its buffers is defined then. GPU-assisted validation is to see it instead.
        let robust = vk::PhysicalDeviceFeatures::default().robust_buffer_access(validation != Validation::GpuAssisted);
        let wide = found.adapter.wide_atomics;
        let enabled = robust.shader_int64(wide);
        let extensions = [khr::shader_atomic_int64::NAME.as_ptr()];
        let mut atomics = vk::PhysicalDeviceShaderAtomicInt64Features::default().shader_buffer_int64_atomics(true);
        let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&enabled);
        if wide {
            info = info.enabled_extension_names(&extensions).push_next(&mut atomics);
        }
        // SAFETY: the adapter belongs to the instance; every device has robust access, and this one was asked for the rest.
        let raw = unsafe { instance.raw.create_device(found.physical, &info, None) };
        let raw = raw.map_err(failure::in_call("vkCreateDevice"))?;
        // SAFETY: the device was made with one queue of this family.
        let queue = unsafe { raw.get_device_queue(found.family, 0) };
        #[cfg(feature = "losing")]
        let raw = crate::losing::watch(&raw, queue);
        let patience = found.adapter.kind.patience();
        let logical = Arc::new(Logical { raw, instance, found, queue: Mutex::new(queue) });
        let memory = Arc::new(Memory::new(&logical)?);
        Ok(Self { logical, memory, pipelines: HashMap::new(), patience, watched: validation != Validation::Off })
    }

    /// Lets what is prepared from now on run that long until the device counts as hung, instead of
    /// [`splat_shaders::AdapterKind::patience`].
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// Returns a function after whose call the driver reports the device as lost.
    #[cfg(feature = "losing")]
    pub fn loss(&self) -> impl Fn() + Send + Sync + 'static {
        self.mark(crate::losing::Fate::Lost)
    }

    /// Returns a function after whose call the driver accepts work and never does it.
    #[cfg(feature = "losing")]
    pub fn hang(&self) -> impl Fn() + Send + Sync + 'static {
        self.mark(crate::losing::Fate::Hangs)
    }

    #[cfg(feature = "losing")]
    fn mark(&self, fate: crate::losing::Fate) -> impl Fn() + Send + Sync + 'static {
        let queue = *self.logical.queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        move || crate::losing::mark(queue, fate)
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.logical.found.adapter
    }

    /// Returns the messages of validation since the last call; empty when it is off, or without faults.
    pub fn take_messages(&self) -> Vec<String> {
        self.logical.instance.take_messages()
    }

    /// Takes the memory of a recording, compiles its kernels and writes its commands.
    ///
    /// # Errors
    /// [`DeviceError::Recording`] for a recording at fault, [`DeviceError::TooLarge`], [`DeviceError::Lacking`],
    /// [`DeviceError::Memory`], [`DeviceError::Driver`].
    pub fn prepare(&mut self, recording: &Recording) -> Result<Prepared, DeviceError> {
        self.prepare_with(recording, &barriers(recording))
    }

    /// The same with no barrier at all, so that a test can hear validation complain: never run what this gives.
    ///
    /// # Errors
    /// As [`Device::prepare`].
    #[cfg(feature = "unsynchronized")]
    pub fn prepare_without_barriers(&mut self, recording: &Recording) -> Result<Prepared, DeviceError> {
        self.prepare_with(recording, &vec![Vec::new(); recording.steps().len()])
    }

    fn prepare_with(&mut self, recording: &Recording, waits: &[Vec<Barrier>]) -> Result<Prepared, DeviceError> {
        self.adapter().accept(recording)?;
        Prepared::new(self, recording, waits)
    }

    /// Prepares a recording and runs it once.
    ///
    /// # Errors
    /// As [`Device::prepare`] and [`Prepared::run`].
    pub fn run(&mut self, recording: &Recording, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        self.prepare(recording)?.run(inputs)
    }

    pub(crate) fn logical(&self) -> &Arc<Logical> {
        &self.logical
    }

    /// Whether validation looks on.
    pub(crate) fn is_watched(&self) -> bool {
        self.watched
    }

    pub(crate) fn patience(&self) -> Duration {
        self.patience
    }

    pub(crate) fn memory(&self) -> &Arc<Memory> {
        &self.memory
    }

    /// The kernel, compiled once.
    pub(crate) fn pipeline(&mut self, kernel: &'static Kernel) -> Result<Arc<Pipeline>, DeviceError> {
        if let Some(known) = self.pipelines.get(kernel.name) {
            return Ok(known.clone());
        }
        let made = Arc::new(Pipeline::new(&self.logical, kernel)?);
        self.pipelines.insert(kernel.name, made.clone());
        Ok(made)
    }
}
