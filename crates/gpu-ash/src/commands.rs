//! From steps to commands: barriers, copies, dispatches, and the clock after each.

use crate::device::Logical;
use crate::memory::Buffer;
use crate::pipeline::Pipeline;
use ash::vk;
use splat_shaders::{Barrier, Dispatch, Groups, Use};

/// Writes commands into a command buffer; holds the recording's buffers.
pub(crate) struct Commands<'a> {
    pub(crate) logical: &'a Logical,
    pub(crate) raw: vk::CommandBuffer,
    pub(crate) buffers: &'a [Buffer],
    /// Null where the device has no clock.
    pub(crate) clock: vk::QueryPool,
}

impl Commands<'_> {
    /// Waits for these uses.
    pub(crate) fn barrier(&self, waits: &[Barrier]) {
        if waits.is_empty() {
            return;
        }
        let join =
            |uses: &mut dyn Iterator<Item = Use>| uses.map(scope).fold(Scope::default(), |a, b| (a.0 | b.0, a.1 | b.1));
        let (from_stages, _) = join(&mut waits.iter().map(|w| w.from));
        let (to_stages, _) = join(&mut waits.iter().map(|w| w.to));
        let each: Vec<_> = waits
            .iter()
            .map(|wait| {
                vk::BufferMemoryBarrier::default()
                    .src_access_mask(scope(wait.from).1)
                    .dst_access_mask(scope(wait.to).1)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .buffer(self.buffers[wait.buffer.index()].raw)
                    .size(vk::WHOLE_SIZE)
            })
            .collect();
        let flags = vk::DependencyFlags::empty();
        // SAFETY: the command buffer is being recorded and the buffers live until it has run.
        unsafe { self.logical.raw.cmd_pipeline_barrier(self.raw, from_stages, to_stages, flags, &[], &each, &[]) }
    }

    pub(crate) fn copy(&self, from: vk::Buffer, to: vk::Buffer, bytes: u64) {
        let whole = [vk::BufferCopy::default().size(bytes)];
        // SAFETY: both buffers have at least these bytes and live until the commands have run.
        unsafe { self.logical.raw.cmd_copy_buffer(self.raw, from, to, &whole) }
    }

    /// Makes the writes of copies visible to the processor.
    pub(crate) fn copies_to_host(&self) {
        let barrier = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ)];
        let from = vk::PipelineStageFlags::TRANSFER;
        let to = vk::PipelineStageFlags::HOST;
        let flags = vk::DependencyFlags::empty();
        // SAFETY: the command buffer is being recorded.
        unsafe { self.logical.raw.cmd_pipeline_barrier(self.raw, from, to, flags, &barrier, &[], &[]) }
    }

    pub(crate) fn dispatch(&self, dispatch: &Dispatch, pipeline: &Pipeline, set: vk::DescriptorSet) {
        let device = &self.logical.raw;
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: the command buffer is being recorded; pipeline, set and buffers live until it has run; the recording
        // was checked, so push constants and bindings are those of the kernel and sizes lie inside their buffer.
        unsafe {
            device.cmd_bind_pipeline(self.raw, point, pipeline.raw);
            device.cmd_bind_descriptor_sets(self.raw, point, pipeline.layout, 0, &[set], &[]);
            if !dispatch.push.is_empty() {
                let stage = vk::ShaderStageFlags::COMPUTE;
                device.cmd_push_constants(self.raw, pipeline.layout, stage, 0, &dispatch.push);
            }
            match dispatch.groups {
                Groups::Direct([x, y, z]) => device.cmd_dispatch(self.raw, x, y, z),
                Groups::Indirect { buffer, offset } => {
                    device.cmd_dispatch_indirect(self.raw, self.buffers[buffer.index()].raw, offset);
                }
            }
        }
    }

    /// Makes the clock's queries ready and notes the time.
    pub(crate) fn start_clock(&self, queries: u32) {
        if self.clock != vk::QueryPool::null() {
            // SAFETY: the pool has this many queries, and no run is under way.
            unsafe { self.logical.raw.cmd_reset_query_pool(self.raw, self.clock, 0, queries) }
        }
        self.tick(0);
    }

    /// Notes the time when everything so far has ended.
    pub(crate) fn tick(&self, query: u32) {
        if self.clock != vk::QueryPool::null() {
            let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
            // SAFETY: the pool has a query for every step and one more, each was reset and is written once.
            unsafe { self.logical.raw.cmd_write_timestamp(self.raw, stage, self.clock, query) }
        }
    }
}

type Scope = (vk::PipelineStageFlags, vk::AccessFlags);

/// Where in the device a use happens, and how.
fn scope(use_: Use) -> Scope {
    let write = vk::AccessFlags::SHADER_READ | vk::AccessFlags::SHADER_WRITE;
    match use_ {
        Use::CopyWrite => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE),
        Use::CopyRead => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_READ),
        Use::KernelRead => (vk::PipelineStageFlags::COMPUTE_SHADER, vk::AccessFlags::SHADER_READ),
        Use::KernelWrite => (vk::PipelineStageFlags::COMPUTE_SHADER, write),
        Use::Indirect => (vk::PipelineStageFlags::DRAW_INDIRECT, vk::AccessFlags::INDIRECT_COMMAND_READ),
    }
}
