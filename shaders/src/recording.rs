//! What a device is to do, as plain data.

use crate::Kernel;

/// A buffer of one recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BufferId(pub(crate) u32);

impl BufferId {
    /// Its place in [`Recording::buffers`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Memory that the device holds while the recording runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Buffer {
    /// What it holds, for people.
    pub name: &'static str,
    /// Its size, bytes; a multiple of 4.
    pub bytes: u64,
}

/// How many workgroups a dispatch starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Groups {
    /// Across, down and deep.
    Direct([u32; 3]),
    /// The same three numbers, read from a buffer when the dispatch begins.
    Indirect {
        /// The buffer that holds them.
        buffer: BufferId,
        /// Where they begin, bytes; a multiple of 4.
        offset: u64,
    },
}

impl Groups {
    /// Most workgroups across; beyond, blocks run down as well. Every device takes 65535 each way.
    pub const ACROSS: u32 = 32768;

    /// At least `blocks` workgroups; kernels leave the surplus of the last row alone.
    pub fn cover(blocks: u32) -> Self {
        Self::Direct([blocks.min(Self::ACROSS), blocks.div_ceil(Self::ACROSS), 1])
    }
}

/// One start of a kernel.
#[derive(Debug, Clone, PartialEq)]
pub struct Dispatch {
    /// The kernel.
    pub kernel: &'static Kernel,
    /// Its workgroups.
    pub groups: Groups,
    /// Its buffers, in the order of its bindings. What it reads and writes of them the kernel declares.
    pub buffers: Vec<BufferId>,
    /// Its push constants.
    pub push: Vec<u8>,
}

/// One thing to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// The caller's bytes go into the buffer, from its beginning.
    Upload(BufferId),
    /// A kernel runs.
    Dispatch(Dispatch),
    /// The buffer's bytes go to the caller.
    Read(BufferId),
}

/// Buffers, and steps in order. Each step sees what the steps before it wrote.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) steps: Vec<Step>,
}

impl Recording {
    /// The buffers; a [`BufferId`] is a place here.
    pub fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    /// The steps in order.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Bytes of all buffers together.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|b| b.bytes).sum()
    }

    /// A buffer that steps fill. `bytes` is rounded up to a multiple of 4, and to 4 at least.
    pub fn scratch(&mut self, name: &'static str, bytes: u64) -> BufferId {
        self.buffers.push(Buffer { name, bytes: bytes.max(4).next_multiple_of(4) });
        BufferId(self.buffers.len() as u32 - 1)
    }

    /// A buffer that the caller fills, and the step that uploads it.
    pub fn input(&mut self, name: &'static str, bytes: u64) -> BufferId {
        let id = self.scratch(name, bytes);
        self.steps.push(Step::Upload(id));
        id
    }

    /// Runs a kernel on these buffers.
    pub fn dispatch(&mut self, kernel: &'static Kernel, groups: Groups, buffers: &[BufferId], push: &[u32]) {
        let push = push.iter().flat_map(|word| word.to_ne_bytes()).collect();
        self.steps.push(Step::Dispatch(Dispatch { kernel, groups, buffers: buffers.to_vec(), push }));
    }

    /// Gives the buffer's bytes to the caller.
    pub fn read(&mut self, buffer: BufferId) {
        self.steps.push(Step::Read(buffer));
    }
}
