//! The images that one draw blends into, as the driver takes them.

use crate::device::Logical;
use crate::failure;
use crate::memory::{Image, format};
use ash::vk;
use splat_shaders::{DeviceError, Draw, Format, Recording};
use std::sync::Arc;

/// A render pass and its framebuffer; null where making it stopped.
pub(crate) struct Pass {
    pub(crate) raw: vk::RenderPass,
    pub(crate) framebuffer: vk::Framebuffer,
    pub(crate) size: [u32; 2],
    logical: Arc<Logical>,
}

impl Pass {
    /// Of a draw that was checked: it has targets, and they have one size.
    pub(crate) fn new(
        logical: &Arc<Logical>,
        recording: &Recording,
        draw: &Draw,
        images: &[Image],
    ) -> Result<Self, DeviceError> {
        let of = |at: usize| &recording.images()[draw.targets[at].image.index()];
        let kept: Vec<_> = (0..draw.targets.len()).map(|k| (of(k).format, draw.targets[k].clear.is_some())).collect();
        let mut pass = Self {
            raw: render_pass(logical, &kept)?,
            framebuffer: vk::Framebuffer::null(),
            size: of(0).size,
            logical: logical.clone(),
        };
        let views: Vec<_> = draw.targets.iter().map(|target| images[target.image.index()].view).collect();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass.raw)
            .attachments(&views)
            .width(pass.size[0])
            .height(pass.size[1])
            .layers(1);
        // SAFETY: the views are of the formats of the pass, and live as long as the recording that has both.
        pass.framebuffer =
            unsafe { logical.raw.create_framebuffer(&info, None) }.map_err(failure::of("vkCreateFramebuffer"))?;
        Ok(pass)
    }
}

/// One subpass that blends into images of these formats, cleared before where it says so. Barriers come from the recording:
/// images keep their layout.
pub(crate) fn render_pass(logical: &Logical, targets: &[(Format, bool)]) -> Result<vk::RenderPass, DeviceError> {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let attachment = |&(of, clear): &(Format, bool)| {
        vk::AttachmentDescription::default()
            .format(format(of))
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(if clear { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD })
            .store_op(vk::AttachmentStoreOp::STORE)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(layout)
            .final_layout(layout)
    };
    let attachments: Vec<_> = targets.iter().map(attachment).collect();
    let reference = |attachment| vk::AttachmentReference { attachment, layout };
    let references: Vec<_> = (0..targets.len() as u32).map(reference).collect();
    let subpasses = [vk::SubpassDescription::default()
        .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
        .color_attachments(&references)];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
    // SAFETY: the info and what it points to outlive the call.
    unsafe { logical.raw.create_render_pass(&info, None) }.map_err(failure::of("vkCreateRenderPass"))
}

impl Drop for Pass {
    fn drop(&mut self) {
        // SAFETY: whoever submitted work with this pass waited for it; null is allowed.
        unsafe {
            self.logical.raw.destroy_framebuffer(self.framebuffer, None);
            self.logical.raw.destroy_render_pass(self.raw, None);
        }
    }
}
