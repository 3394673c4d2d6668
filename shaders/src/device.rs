//! What an executor takes and gives: the same words whichever interface it drives.

use crate::{BufferId, Fault, Recording, Step, SubgroupOps};
use std::fmt::Debug;
use std::time::Duration;

/// What stands behind an adapter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdapterKind {
    /// A GPU with its own memory.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU that a virtual machine is lent.
    Virtual,
    /// A driver that computes on the processor. Never chosen unless it is asked for.
    Software,
    /// The driver does not say.
    Other,
}

impl Adapter {
    /// Refuses a recording that needs more than this device has: memory that kernels can see, 64-bit atomics, or
    /// operations of subgroups.
    ///
    /// # Errors
    /// [`DeviceError::TooLarge`], [`DeviceError::Lacking`], [`DeviceError::Recording`] for a recording at fault.
    pub fn accept(&self, recording: &Recording) -> Result<(), DeviceError> {
        recording.check()?;
        let had = self.binding_bytes;
        if let Some(b) = recording.buffers().iter().find(|b| b.bytes > had) {
            return Err(DeviceError::TooLarge { name: b.name, needed: b.bytes, had });
        }
        let dispatched =
            recording.steps().iter().filter_map(|step| if let Step::Dispatch(d) = step { Some(d) } else { None });
        for kernel in dispatched.map(|d| d.kernel) {
            let atomics = (kernel.wide_atomics && !self.wide_atomics).then_some("atomics of 64 bits");
            if let Some(what) = atomics.or_else(|| kernel.subgroup_ops.beyond(self.subgroup_ops)) {
                return Err(DeviceError::Lacking { kernel: kernel.name, what });
            }
        }
        Ok(())
    }
}

impl AdapterKind {
    /// Whether this is a GPU, and no program that plays one.
    pub fn is_gpu(self) -> bool {
        matches!(self, Self::Discrete | Self::Integrated | Self::Virtual)
    }

    /// How long a run may take until its device counts as hung. Recordings take a GPU less than a second, and drivers that
    /// watch over their devices give up after some; a processor takes as long as the work does.
    pub fn patience(self) -> Duration {
        Duration::from_secs(if self.is_gpu() { 30 } else { 3600 })
    }
}

/// A device that recordings could run on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// The device's name.
    pub name: String,
    /// The driver, with its version.
    pub driver: String,
    /// What it is.
    pub kind: AdapterKind,
    /// Bytes of its own memory.
    pub memory_bytes: u64,
    /// The largest buffer that a kernel can see, bytes.
    pub binding_bytes: u64,
    /// Threads of a subgroup; 0 where not known.
    pub subgroup: u32,
    /// Whether kernels can take the least of numbers of 64 bits in a buffer.
    pub wide_atomics: bool,
    /// What kernels can do across the threads of a subgroup.
    pub subgroup_ops: SubgroupOps,
}

/// Which adapter to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Choice {
    /// The first real GPU, one with its own memory before others; never a software driver.
    #[default]
    Gpu,
    /// The first software driver.
    Software,
    /// The first adapter whose name contains this, whatever it is.
    Named(String),
    /// The adapter in this place of the list that a backend gives, whatever it is.
    Place(usize),
}

impl Choice {
    /// The place of the chosen adapter.
    pub fn pick(&self, adapters: &[Adapter]) -> Option<usize> {
        let rank = |kind| match kind {
            AdapterKind::Discrete => Some(0),
            AdapterKind::Virtual => Some(1),
            AdapterKind::Integrated => Some(2),
            AdapterKind::Software | AdapterKind::Other => None,
        };
        match self {
            Self::Gpu => (0..adapters.len()).filter_map(|i| Some((rank(adapters[i].kind)?, i))).min().map(|(_, i)| i),
            Self::Software => adapters.iter().position(|a| a.kind == AdapterKind::Software),
            Self::Named(part) => adapters.iter().position(|a| a.name.contains(part)),
            Self::Place(at) => Some(*at).filter(|at| *at < adapters.len()),
        }
    }
}

/// How closely the driver's work is watched; costs time, for tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Validation {
    /// Not at all.
    #[default]
    Off,
    /// Every call, and that no access races another.
    Synchronization,
    /// The same, and every access of a kernel against the bounds of its buffers.
    GpuAssisted,
}

/// The caller's bytes for the uploads of a recording. A buffer takes as many as are given, at most its size.
pub type Inputs<'a> = [(BufferId, &'a [u8])];

/// The time of one dispatch on the device.
#[derive(Debug, Clone, PartialEq)]
pub struct PassTime {
    /// The kernel.
    pub kernel: &'static str,
    /// Between the end of what came before and its own end, nanoseconds.
    pub nanoseconds: f64,
}

/// What a recording gave.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// The bytes of each read, in the order of the steps.
    pub reads: Vec<(BufferId, Vec<u8>)>,
    /// The dispatches in order; empty where the device has no clock.
    pub passes: Vec<PassTime>,
}

impl Run {
    /// The bytes that were read of a buffer; none if the recording does not read it.
    pub fn bytes(&self, buffer: BufferId) -> &[u8] {
        self.reads.iter().find(|(read, _)| *read == buffer).map_or(&[], |(_, bytes)| bytes)
    }
}

/// A way to devices: lists them and opens one. Each executor has one; whoever renders takes any.
pub trait Backend: Debug + Send + Sync {
    /// Its name, as users write it.
    fn name(&self) -> &'static str;

    /// Every adapter that it reaches, software drivers included.
    ///
    /// # Errors
    /// [`DeviceError::NoDevice`] where there is no such interface, [`DeviceError::Driver`] when a driver fails.
    fn adapters(&self) -> Result<Vec<Adapter>, DeviceError>;

    /// Opens the chosen adapter.
    ///
    /// # Errors
    /// [`DeviceError::NoDevice`] when there is none, [`DeviceError::Driver`] when the driver refuses.
    fn open(&self, choice: &Choice, validation: Validation) -> Result<Box<dyn Executor>, DeviceError>;
}

/// An opened device.
pub trait Executor: Send {
    /// The adapter that was opened.
    fn adapter(&self) -> &Adapter;

    /// Makes a recording ready to run.
    ///
    /// # Errors
    /// [`DeviceError::Recording`] for a recording at fault, [`DeviceError::TooLarge`], [`DeviceError::Memory`],
    /// [`DeviceError::Lost`], [`DeviceError::Driver`].
    fn prepare(&mut self, recording: &Recording) -> Result<Box<dyn Ready>, DeviceError>;

    /// Prepares a recording and runs it once.
    ///
    /// # Errors
    /// As [`Executor::prepare`] and [`Ready::run`].
    fn run(&mut self, recording: &Recording, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        self.prepare(recording)?.run(inputs)
    }

    /// What validation said to this device since the last call; nothing where it speaks elsewhere.
    fn take_messages(&self) -> Vec<String> {
        Vec::new()
    }
}

/// A recording that is ready to run, as often as one likes.
pub trait Ready: Send {
    /// Uploads the inputs, runs the steps, waits, and gives what they read back. An input that is not given keeps its
    /// bytes of the run before, zeros at first; so does what lies beyond a shorter one.
    ///
    /// # Errors
    /// [`DeviceError::Input`] for bytes that do not fit, [`DeviceError::Lost`], [`DeviceError::Driver`].
    fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError>;
}

/// Why a device could not do it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// There is no driver, or none for this choice.
    #[error("no such device: {why}")]
    NoDevice {
        /// What was looked for and found.
        why: String,
    },
    /// The recording is at fault.
    #[error("the recording is at fault: {0}")]
    Recording(#[from] Fault),
    /// The caller gave bytes that do not fit.
    #[error("input {name}: {found} bytes, expected a multiple of 4 up to {had}")]
    Input {
        /// The buffer.
        name: &'static str,
        /// Bytes given.
        found: u64,
        /// Bytes that it holds.
        had: u64,
    },
    /// A kernel needs what the device does not have.
    #[error("kernel {kernel} needs {what}, which the device does not have")]
    Lacking {
        /// The kernel.
        kernel: &'static str,
        /// What it needs.
        what: &'static str,
    },
    /// A buffer is larger than a kernel can see on this device.
    #[error("buffer {name} has {needed} bytes, the device's kernels see at most {had}")]
    TooLarge {
        /// The buffer.
        name: &'static str,
        /// Its size, bytes.
        needed: u64,
        /// The device's limit, bytes.
        had: u64,
    },
    /// The device or its memory is used up.
    #[error("the device has no memory for {bytes} bytes")]
    Memory {
        /// Bytes asked for.
        bytes: u64,
    },
    /// The device is lost, or did not come back in time: what it held is gone, another may be opened.
    #[error("the device was lost")]
    Lost,
    /// The driver refused.
    #[error("{call} failed: {why}")]
    Driver {
        /// What was asked of it.
        call: &'static str,
        /// What it said.
        why: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(name: &str, kind: AdapterKind) -> Adapter {
        let driver = String::new();
        Adapter {
            name: name.to_owned(),
            driver,
            kind,
            memory_bytes: 0,
            binding_bytes: 0,
            subgroup: 0,
            wide_atomics: false,
            subgroup_ops: SubgroupOps::NONE,
        }
    }

    #[test]
    fn a_software_driver_is_never_chosen_silently() {
        let software = adapter("llvmpipe", AdapterKind::Software);
        assert_eq!(Choice::Gpu.pick(std::slice::from_ref(&software)), None);
        let adapters = [
            software,
            adapter("small", AdapterKind::Integrated),
            adapter("odd", AdapterKind::Other),
            adapter("large", AdapterKind::Discrete),
        ];
        assert_eq!(Choice::Gpu.pick(&adapters), Some(3));
        assert_eq!(Choice::Gpu.pick(&adapters[..3]), Some(1));
        assert_eq!(Choice::Software.pick(&adapters), Some(0));
        assert_eq!(Choice::Named("mal".to_owned()).pick(&adapters), Some(1));
        assert_eq!([Choice::Place(3).pick(&adapters), Choice::Place(4).pick(&adapters)], [Some(3), None]);
    }
}
