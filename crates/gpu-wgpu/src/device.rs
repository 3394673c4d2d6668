//! An opened device and the kernels it compiled.

use crate::adapters::{describe, features, find, instance};
use crate::prepared::Prepared;
use splat_shaders::{Access, Adapter, Choice, DeviceError, Inputs, Kernel, Recording, Run, Validation};
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What went wrong since somebody asked.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    said: Mutex<Vec<String>>,
    memory: AtomicBool,
    lost: AtomicBool,
}

impl Faults {
    fn note(&self, error: &wgpu::Error) {
        if matches!(error, wgpu::Error::OutOfMemory { .. }) {
            self.memory.store(true, Ordering::Relaxed);
        }
        self.said.lock().unwrap_or_else(PoisonError::into_inner).push(error.to_string());
    }

    /// The first fault as an error; all are forgotten.
    pub(crate) fn check(&self, call: &'static str, bytes: u64) -> Result<(), DeviceError> {
        let said = std::mem::take(&mut *self.said.lock().unwrap_or_else(PoisonError::into_inner));
        let memory = self.memory.swap(false, Ordering::Relaxed);
        // A lost device says all sorts of things afterwards.
        if self.lost.load(Ordering::Relaxed) {
            return Err(DeviceError::Lost);
        }
        match said.into_iter().next() {
            None => Ok(()),
            Some(_) if memory => Err(DeviceError::Memory { bytes }),
            Some(why) => Err(DeviceError::Driver { call, why }),
        }
    }
}

/// A device that runs recordings.
pub struct Device {
    raw: wgpu::Device,
    queue: wgpu::Queue,
    adapter: Adapter,
    faults: Arc<Faults>,
    pipelines: HashMap<&'static str, wgpu::ComputePipeline>,
    patience: Duration,
}

impl Device {
    /// Opens the chosen adapter.
    ///
    /// # Errors
    /// [`DeviceError::NoDevice`] when there is none, [`DeviceError::Driver`] when the driver refuses.
    pub fn open(choice: &Choice, validation: Validation) -> Result<Self, DeviceError> {
        let instance = instance(validation);
        let found = find(&instance);
        let adapters: Vec<Adapter> = found.iter().map(describe).collect();
        let Some(at) = choice.pick(&adapters) else {
            let names: Vec<&str> = adapters.iter().map(|a| a.name.as_str()).collect();
            return Err(DeviceError::NoDevice { why: format!("{choice:?} of [{}]", names.join(", ")) });
        };
        let request = wgpu::DeviceDescriptor {
            required_features: features(&found[at]),
            // All that the adapter has: a buffer is refused by its own limits alone.
            required_limits: found[at].limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let opened = pollster::block_on(found[at].request_device(&request));
        let driver = |e: wgpu::RequestDeviceError| DeviceError::Driver { call: "request_device", why: e.to_string() };
        let (raw, queue) = opened.map_err(driver)?;
        let faults = Arc::new(Faults::default());
        let noted = faults.clone();
        let lost = faults.clone();
        raw.on_uncaptured_error(Arc::new(move |error: wgpu::Error| noted.note(&error)));
        raw.set_device_lost_callback(move |_, _| lost.lost.store(true, Ordering::Relaxed));
        let adapter = adapters[at].clone();
        let patience = adapter.kind.patience();
        Ok(Self { raw, queue, adapter, faults, pipelines: HashMap::new(), patience })
    }

    /// Lets what is prepared from now on run that long until the device counts as hung, instead of
    /// [`splat_shaders::AdapterKind::patience`].
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Takes the memory of a recording, compiles its kernels and binds its buffers.
    ///
    /// # Errors
    /// [`DeviceError::Recording`] for a recording at fault, [`DeviceError::TooLarge`], [`DeviceError::Lacking`],
    /// [`DeviceError::Memory`], [`DeviceError::Driver`].
    pub fn prepare(&mut self, recording: &Recording) -> Result<Prepared, DeviceError> {
        self.adapter.accept(recording)?;
        let prepared = Prepared::new(self, recording, self.patience);
        self.faults.check("prepare", recording.bytes())?;
        Ok(prepared)
    }

    /// Prepares a recording and runs it once.
    ///
    /// # Errors
    /// As [`Device::prepare`] and [`Prepared::run`].
    pub fn run(&mut self, recording: &Recording, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        self.prepare(recording)?.run(inputs)
    }

    /// What throws the device away, as a driver does that loses it: what runs on it from then on is [`DeviceError::Lost`].
    #[cfg(feature = "losing")]
    pub fn loss(&self) -> impl Fn() + Send + Sync + 'static {
        let raw = self.raw.clone();
        move || raw.destroy()
    }

    pub(crate) fn parts(&self) -> (&wgpu::Device, &wgpu::Queue, &Arc<Faults>) {
        (&self.raw, &self.queue, &self.faults)
    }

    /// The kernel, compiled once.
    pub(crate) fn pipeline(&mut self, kernel: &'static Kernel) -> wgpu::ComputePipeline {
        if let Some(known) = self.pipelines.get(kernel.name) {
            return known.clone();
        }
        let made = compile(&self.raw, kernel);
        self.pipelines.insert(kernel.name, made.clone());
        made
    }
}

fn compile(device: &wgpu::Device, kernel: &Kernel) -> wgpu::ComputePipeline {
    let label = Some(kernel.name);
    let entry = |(binding, access): (u32, &Access)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: *access == Access::Read },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = (0..).zip(kernel.bindings).map(entry).collect();
    let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(&group)],
        immediate_size: kernel.push_bytes,
    });
    let source = wgpu::ShaderSource::SpirV(kernel.words().into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label,
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}
