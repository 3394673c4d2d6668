//! From steps to commands: barriers, copies, dispatches, draws, and the clock after each.

use crate::device::Logical;
use crate::memory::{Buffer, Image, whole};
use crate::pass::Pass;
use crate::pipeline::Pipeline;
use ash::vk;
use splat_shaders::{Barrier, Corners, Dispatch, Draw, Groups, Resource, Use};

/// What commands are written with: a command buffer that is being recorded, and the recording's buffers
/// and images.
pub(crate) struct Commands<'a> {
    pub(crate) logical: &'a Logical,
    pub(crate) raw: vk::CommandBuffer,
    pub(crate) buffers: &'a [Buffer],
    pub(crate) images: &'a [Image],
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
        let (mut buffers, mut images) = (Vec::new(), Vec::new());
        for wait in waits {
            match wait.of {
                Resource::Buffer(buffer) => buffers.push(
                    vk::BufferMemoryBarrier::default()
                        .src_access_mask(scope(wait.from).1)
                        .dst_access_mask(scope(wait.to).1)
                        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .buffer(self.buffers[buffer.index()].raw)
                        .size(vk::WHOLE_SIZE),
                ),
                Resource::Image(image) => images.push(
                    vk::ImageMemoryBarrier::default()
                        .src_access_mask(scope(wait.from).1)
                        .dst_access_mask(scope(wait.to).1)
                        .old_layout(layout(wait.from))
                        .new_layout(layout(wait.to))
                        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .image(self.images[image.index()].raw)
                        .subresource_range(whole()),
                ),
            }
        }
        let (device, flags) = (&self.logical.raw, vk::DependencyFlags::empty());
        // SAFETY: the command buffer is being recorded; buffers and images live until it has run.
        unsafe { device.cmd_pipeline_barrier(self.raw, from_stages, to_stages, flags, &[], &buffers, &images) }
    }

    pub(crate) fn copy(&self, from: vk::Buffer, to: vk::Buffer, bytes: u64) {
        let whole = [vk::BufferCopy::default().size(bytes)];
        // SAFETY: both buffers have at least these bytes and live until the commands have run.
        unsafe { self.logical.raw.cmd_copy_buffer(self.raw, from, to, &whole) }
    }

    /// Rows of the image, as far apart as the recording says.
    pub(crate) fn copy_image(&self, from: &Image, to: vk::Buffer, of: &splat_shaders::Image) {
        let [width, height] = of.size;
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let rows = [vk::BufferImageCopy::default()
            .buffer_row_length((of.row_bytes() / u64::from(of.format.bytes())) as u32)
            .image_subresource(layers)
            .image_extent(vk::Extent3D { width, height, depth: 1 })];
        let layout = layout(Use::CopyRead);
        // SAFETY: the recording was checked, so the buffer has room; both live until the commands have run.
        unsafe { self.logical.raw.cmd_copy_image_to_buffer(self.raw, from.raw, layout, to, &rows) }
    }

    /// What a copy wrote becomes visible to the processor.
    pub(crate) fn copies_to_host(&self) {
        let barrier = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ)];
        let (from, to) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::HOST);
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
                device.cmd_push_constants(self.raw, pipeline.layout, pipeline.stages, 0, &dispatch.push);
            }
            match dispatch.groups {
                Groups::Direct([x, y, z]) => device.cmd_dispatch(self.raw, x, y, z),
                Groups::Indirect { buffer, offset } => {
                    device.cmd_dispatch_indirect(self.raw, self.buffers[buffer.index()].raw, offset);
                }
            }
        }
    }

    pub(crate) fn draw(&self, draw: &Draw, pipeline: &Pipeline, set: vk::DescriptorSet, pass: &Pass) {
        let device = &self.logical.raw;
        let point = vk::PipelineBindPoint::GRAPHICS;
        let clear = |target: &splat_shaders::Target| vk::ClearValue {
            color: vk::ClearColorValue { float32: target.clear.unwrap_or_default() },
        };
        let clears: Vec<_> = draw.targets.iter().map(clear).collect();
        let [width, height] = pass.size;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let (w, h) = (width as f32, height as f32);
        // Upwards, as the other executor has it.
        let view = vk::Viewport { x: 0.0, y: h, width: w, height: -h, min_depth: 0.0, max_depth: 1.0 };
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(pass.raw)
            .framebuffer(pass.framebuffer)
            .render_area(area)
            .clear_values(&clears);
        // SAFETY: the command buffer is being recorded; pass, pipeline, set and buffers live until it has run; the
        // recording was checked, so push constants and bindings are those of the program and sizes lie inside their
        // buffer; the pipeline was made for the formats of the pass.
        unsafe {
            device.cmd_begin_render_pass(self.raw, &begin, vk::SubpassContents::INLINE);
            device.cmd_bind_pipeline(self.raw, point, pipeline.raw);
            device.cmd_set_viewport(self.raw, 0, &[view]);
            device.cmd_set_scissor(self.raw, 0, &[area]);
            device.cmd_bind_descriptor_sets(self.raw, point, pipeline.layout, 0, &[set], &[]);
            if !draw.push.is_empty() {
                device.cmd_push_constants(self.raw, pipeline.layout, pipeline.stages, 0, &draw.push);
            }
            match draw.corners {
                Corners::Direct([corners, strips]) => device.cmd_draw(self.raw, corners, strips, 0, 0),
                Corners::Indirect { buffer, offset } => {
                    device.cmd_draw_indirect(self.raw, self.buffers[buffer.index()].raw, offset, 1, 16);
                }
            }
            device.cmd_end_render_pass(self.raw);
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
    let drawing = vk::PipelineStageFlags::VERTEX_SHADER | vk::PipelineStageFlags::FRAGMENT_SHADER;
    let blend = vk::AccessFlags::COLOR_ATTACHMENT_READ | vk::AccessFlags::COLOR_ATTACHMENT_WRITE;
    match use_ {
        Use::Nothing => (vk::PipelineStageFlags::TOP_OF_PIPE, vk::AccessFlags::empty()),
        Use::DrawRead => (drawing, vk::AccessFlags::SHADER_READ),
        Use::Target => (vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, blend),
        Use::CopyWrite => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE),
        Use::CopyRead => (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_READ),
        Use::KernelRead => (vk::PipelineStageFlags::COMPUTE_SHADER, vk::AccessFlags::SHADER_READ),
        Use::KernelWrite => (vk::PipelineStageFlags::COMPUTE_SHADER, write),
        Use::Indirect => (vk::PipelineStageFlags::DRAW_INDIRECT, vk::AccessFlags::INDIRECT_COMMAND_READ),
    }
}

/// How an image lies while a use of it lasts.
fn layout(use_: Use) -> vk::ImageLayout {
    match use_ {
        Use::Target => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        Use::CopyRead => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        Use::Nothing | Use::CopyWrite | Use::KernelRead | Use::KernelWrite | Use::Indirect | Use::DrawRead => {
            vk::ImageLayout::UNDEFINED
        }
    }
}
