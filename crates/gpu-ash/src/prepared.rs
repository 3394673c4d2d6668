//! A recording on the device: its memory, its commands and its runs.

use crate::commands::Commands;
use crate::device::{Device, Logical};
use crate::failure;
use crate::memory::Buffer;
use crate::pipeline::Pipeline;
use ash::vk;
use gpu_allocator::MemoryLocation;
use splat_shaders::{Barrier, BufferId, DeviceError, Dispatch, Inputs, PassTime, Recording, Run, Step, batches};
use std::mem;
use std::ops::Range;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

/// A buffer that the processor sees, beside one of the recording.
struct Beside {
    id: BufferId,
    name: &'static str,
    bytes: u64,
    buffer: Buffer,
}

/// A recording that is ready to run, as often as one likes. Handles are null where making it stopped.
pub struct Prepared {
    uploads: Vec<Beside>,
    reads: Vec<Beside>,
    buffers: Vec<Buffer>,
    /// The steps that are dispatches, with their kernels.
    dispatches: Vec<(usize, &'static str)>,
    pipelines: Vec<Arc<Pipeline>>,
    steps: usize,
    sets: vk::DescriptorPool,
    pool: vk::CommandPool,
    /// One for each step; one for all under validation, which follows accesses inside a command buffer alone.
    commands: Vec<vk::CommandBuffer>,
    /// Command buffers that are submitted together, by what they took in the run before.
    batches: Vec<Range<usize>>,
    clock: vk::QueryPool,
    fence: vk::Fence,
    patience: Duration,
    /// Whether the device did not come back from a run, and may still be at it.
    hung: bool,
    logical: Arc<Logical>,
}

impl Prepared {
    pub(crate) fn new(device: &mut Device, recording: &Recording, waits: &[Vec<Barrier>]) -> Result<Self, DeviceError> {
        let mut made = Self {
            uploads: Vec::new(),
            reads: Vec::new(),
            buffers: Vec::new(),
            dispatches: Vec::new(),
            pipelines: Vec::new(),
            steps: recording.steps().len(),
            sets: vk::DescriptorPool::null(),
            pool: vk::CommandPool::null(),
            commands: Vec::new(),
            batches: Vec::new(),
            clock: vk::QueryPool::null(),
            fence: vk::Fence::null(),
            patience: device.patience(),
            hung: false,
            logical: device.logical().clone(),
        };
        made.take_memory(device, recording)?;
        made.make_objects(recording, if device.is_watched() { 1 } else { made.steps })?;
        for (at, step) in recording.steps().iter().enumerate() {
            if let Step::Dispatch(dispatch) = step {
                made.dispatches.push((at, dispatch.kernel.name));
                made.pipelines.push(device.pipeline(dispatch.kernel)?);
            }
        }
        made.write(recording, waits)?;
        Ok(made)
    }

    fn take_memory(&mut self, device: &Device, recording: &Recording) -> Result<(), DeviceError> {
        use vk::BufferUsageFlags as Usage;
        let memory = device.memory();
        let device_usage = Usage::STORAGE_BUFFER | Usage::INDIRECT_BUFFER | Usage::TRANSFER_SRC | Usage::TRANSFER_DST;
        for b in recording.buffers() {
            self.buffers.push(Buffer::new(memory, b.name, b.bytes, device_usage, MemoryLocation::GpuOnly)?);
        }
        for step in recording.steps() {
            let (id, usage, location, side) = match step {
                Step::Upload(id) => (*id, Usage::TRANSFER_SRC, MemoryLocation::CpuToGpu, &mut self.uploads),
                Step::Read(id) => (*id, Usage::TRANSFER_DST, MemoryLocation::GpuToCpu, &mut self.reads),
                Step::Dispatch(_) => continue,
            };
            let recorded = &recording.buffers()[id.index()];
            let mut buffer = Buffer::new(memory, recorded.name, recorded.bytes, usage, location)?;
            // Nobody reads what other programs left there.
            buffer.bytes_mut().fill(0);
            side.push(Beside { id, name: recorded.name, bytes: recorded.bytes, buffer });
        }
        Ok(())
    }

    fn make_objects(&mut self, recording: &Recording, commands: usize) -> Result<(), DeviceError> {
        let device = &self.logical.raw;
        let family = self.logical.found.family;
        let dispatches = || recording.steps().iter().filter_map(dispatch_of);
        let bindings = dispatches().map(|d| d.buffers.len() as u32).sum::<u32>().max(1);
        let sizes =
            [vk::DescriptorPoolSize::default().ty(vk::DescriptorType::STORAGE_BUFFER).descriptor_count(bindings)];
        let sets =
            vk::DescriptorPoolCreateInfo::default().max_sets(dispatches().count().max(1) as u32).pool_sizes(&sizes);
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(family);
        // SAFETY: the infos and what they point to outlive the calls; `Drop` destroys what was made.
        unsafe {
            self.sets =
                device.create_descriptor_pool(&sets, None).map_err(failure::in_call("vkCreateDescriptorPool"))?;
            self.pool = device.create_command_pool(&pool, None).map_err(failure::in_call("vkCreateCommandPool"))?;
            let fence = vk::FenceCreateInfo::default();
            self.fence = device.create_fence(&fence, None).map_err(failure::in_call("vkCreateFence"))?;
            if self.steps > 0 {
                let each = vk::CommandBufferAllocateInfo::default()
                    .command_pool(self.pool)
                    .command_buffer_count(commands as u32);
                self.commands =
                    device.allocate_command_buffers(&each).map_err(failure::in_call("vkAllocateCommandBuffers"))?;
                self.batches = batches(&vec![f64::INFINITY; commands]);
            }
            if self.logical.found.tick_ns > 0.0 {
                let clock = vk::QueryPoolCreateInfo::default()
                    .query_type(vk::QueryType::TIMESTAMP)
                    .query_count(self.steps as u32 + 1);
                self.clock = device.create_query_pool(&clock, None).map_err(failure::in_call("vkCreateQueryPool"))?;
            }
        }
        Ok(())
    }

    fn write(&self, recording: &Recording, waits: &[Vec<Barrier>]) -> Result<(), DeviceError> {
        let device = &self.logical.raw;
        let mut uploads = self.uploads.iter();
        let mut reads = self.reads.iter();
        let mut pipelines = self.pipelines.iter();
        for (at, (step, waits)) in recording.steps().iter().zip(waits).enumerate() {
            let steps_of_one = self.steps / self.commands.len();
            let raw = self.commands[at / steps_of_one];
            let commands = Commands { logical: &self.logical, raw, buffers: &self.buffers, clock: self.clock };
            if at % steps_of_one == 0 {
                let begin = vk::CommandBufferBeginInfo::default();
                // SAFETY: the command buffer is new and nobody else has it.
                unsafe { device.begin_command_buffer(raw, &begin) }
                    .map_err(failure::in_call("vkBeginCommandBuffer"))?;
            }
            if at == 0 {
                commands.start_clock(self.steps as u32 + 1);
            }
            // It waits for what other command buffers do as for its own: they go to one queue, in order.
            commands.barrier(waits);
            match step {
                Step::Upload(id) => {
                    let beside = uploads.next().expect("invariant: one for each upload");
                    commands.copy(beside.buffer.raw, self.buffers[id.index()].raw, beside.bytes);
                }
                Step::Read(id) => {
                    let beside = reads.next().expect("invariant: one for each read");
                    commands.copy(self.buffers[id.index()].raw, beside.buffer.raw, beside.bytes);
                }
                Step::Dispatch(dispatch) => {
                    let pipeline = pipelines.next().expect("invariant: one for each dispatch");
                    commands.dispatch(dispatch, pipeline, self.bind(dispatch, pipeline)?);
                }
            }
            commands.tick(at as u32 + 1);
            if at + 1 == self.steps {
                commands.copies_to_host();
            }
            if (at + 1) % steps_of_one == 0 {
                // SAFETY: the command buffer is being recorded.
                unsafe { device.end_command_buffer(raw) }.map_err(failure::in_call("vkEndCommandBuffer"))?;
            }
        }
        Ok(())
    }

    /// The buffers of a dispatch as the kernel sees them.
    fn bind(&self, dispatch: &Dispatch, pipeline: &Pipeline) -> Result<vk::DescriptorSet, DeviceError> {
        let device = &self.logical.raw;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.sets).set_layouts(&layouts);
        // SAFETY: the pool was made with room for every dispatch's set.
        let made =
            unsafe { device.allocate_descriptor_sets(&info) }.map_err(failure::in_call("vkAllocateDescriptorSets"))?;
        let set = made.first().copied().unwrap_or_default();
        let whole = |id: &BufferId| {
            [vk::DescriptorBufferInfo::default().buffer(self.buffers[id.index()].raw).range(vk::WHOLE_SIZE)]
        };
        let infos: Vec<_> = dispatch.buffers.iter().map(whole).collect();
        let write = |(binding, info)| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(binding)
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .buffer_info(info)
        };
        let writes: Vec<_> = (0..).zip(&infos).map(|(binding, info)| write((binding, &info[..]))).collect();
        // SAFETY: the set is new, the buffers live as long as the pool.
        unsafe { device.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }

    /// Uploads the inputs, runs the steps, waits, and gives what they read back. An input that is not given keeps its
    /// bytes of the run before, zeros at first; so does what lies beyond a shorter one.
    ///
    /// # Errors
    /// [`DeviceError::Input`] for bytes that do not fit, [`DeviceError::Lost`] for a device that is lost or hangs,
    /// [`DeviceError::Driver`].
    pub fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        if self.hung {
            return Err(DeviceError::Lost);
        }
        for (id, bytes) in inputs {
            for beside in self.uploads.iter_mut().filter(|b| b.id == *id) {
                let found = bytes.len() as u64;
                if found > beside.bytes || !found.is_multiple_of(4) {
                    return Err(DeviceError::Input { name: beside.name, found, had: beside.bytes });
                }
                beside.buffer.bytes_mut()[..bytes.len()].copy_from_slice(bytes);
            }
        }
        self.submit()?;
        let taken = |b: &Beside| (b.id, b.buffer.bytes()[..b.bytes as usize].to_vec());
        Ok(Run { reads: self.reads.iter().map(taken).collect(), passes: self.passes()? })
    }

    fn submit(&mut self) -> Result<(), DeviceError> {
        let device = &self.logical.raw;
        let queue = self.logical.queue.lock().unwrap_or_else(PoisonError::into_inner);
        let patience = u64::try_from(self.patience.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the fence is not in use: every run waits for its own, and a device that failed to is lost or hangs, and
        // then no run comes here. The commands hold what they use, `self` holds that, and leaves only after the wait, or
        // never.
        unsafe {
            device.reset_fences(&[self.fence]).map_err(failure::in_call("vkResetFences"))?;
            for batch in &self.batches {
                let work = [vk::SubmitInfo::default().command_buffers(&self.commands[batch.clone()])];
                device.queue_submit(*queue, &work, vk::Fence::null()).map_err(failure::in_call("vkQueueSubmit"))?;
            }
            // It is signalled when all that was submitted before has ended.
            device.queue_submit(*queue, &[], self.fence).map_err(failure::in_call("vkQueueSubmit"))?;
            drop(queue);
            match device.wait_for_fences(&[self.fence], true, patience) {
                Err(vk::Result::TIMEOUT) => {
                    self.hung = true;
                    Err(DeviceError::Lost)
                }
                waited => waited.map_err(failure::in_call("vkWaitForFences")),
            }
        }
    }

    /// Reads the clock, and plans the next run's submissions by it.
    fn passes(&mut self) -> Result<Vec<PassTime>, DeviceError> {
        if self.clock == vk::QueryPool::null() {
            return Ok(Vec::new());
        }
        let mut ticks = vec![0u64; self.steps + 1];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the pool has one query for every step and one more, all written by the run that has ended.
        unsafe { self.logical.raw.get_query_pool_results(self.clock, 0, &mut ticks, flags) }
            .map_err(failure::in_call("vkGetQueryPoolResults"))?;
        let found = &self.logical.found;
        let between = |t: &[u64]| (t[1].wrapping_sub(t[0]) & found.tick_mask) as f64 * found.tick_ns;
        let took: Vec<f64> = ticks.windows(2).map(between).collect();
        if self.commands.len() == took.len() {
            self.batches = batches(&took);
        }
        let pass = |&(step, kernel): &(usize, &'static str)| PassTime { kernel, nanoseconds: took[step] };
        Ok(self.dispatches.iter().map(pass).collect())
    }
}

fn dispatch_of(step: &Step) -> Option<&Dispatch> {
    match step {
        Step::Dispatch(dispatch) => Some(dispatch),
        Step::Upload(_) | Step::Read(_) => None,
    }
}

impl Drop for Prepared {
    fn drop(&mut self) {
        if self.hung {
            // Nothing may end that the device might still use: this is the one leak, of a device that is given up.
            mem::forget((mem::take(&mut self.uploads), mem::take(&mut self.reads), mem::take(&mut self.buffers)));
            mem::forget((mem::take(&mut self.pipelines), self.logical.clone()));
            return;
        }
        let device = &self.logical.raw;
        // SAFETY: every run waits until the device is done or lost; null is allowed; each is destroyed once.
        unsafe {
            device.destroy_fence(self.fence, None);
            device.destroy_query_pool(self.clock, None);
            device.destroy_command_pool(self.pool, None);
            device.destroy_descriptor_pool(self.sets, None);
        }
    }
}
