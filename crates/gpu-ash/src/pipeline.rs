//! A kernel or a program as the driver compiled it.

use crate::device::Logical;
use crate::failure;
use crate::pass::render_pass;
use ash::vk;
use splat_shaders::{Blend, DeviceError, Format, Kernel, Program};
use std::sync::Arc;

/// A pipeline with its layouts; null where making it stopped.
pub(crate) struct Pipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set_layout: vk::DescriptorSetLayout,
    /// Who sees buffers and push constants.
    pub(crate) stages: vk::ShaderStageFlags,
    modules: Vec<vk::ShaderModule>,
    logical: Arc<Logical>,
}

impl Pipeline {
    pub(crate) fn new(logical: &Arc<Logical>, kernel: &Kernel) -> Result<Self, DeviceError> {
        let mut made = Self::begin(logical, vk::ShaderStageFlags::COMPUTE);
        made.make_layouts(kernel.bindings.len() as u32, kernel.push_bytes)?;
        let module = made.make_module(&kernel.words())?;
        let stage = stage(vk::ShaderStageFlags::COMPUTE, module);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(made.layout)];
        // SAFETY: module and layout were made above, for each other: a test holds the table of kernels against them.
        let pipelines = unsafe { logical.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
        let pipelines = pipelines.map_err(|(_, result)| failure::of("vkCreateComputePipelines")(result))?;
        made.raw = pipelines.first().copied().unwrap_or_default();
        Ok(made)
    }

    /// For images of these formats, blended so.
    pub(crate) fn of_program(
        logical: &Arc<Logical>,
        program: &Program,
        targets: &[(Format, Blend)],
    ) -> Result<Self, DeviceError> {
        let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
        let mut made = Self::begin(logical, stages[0] | stages[1]);
        made.make_layouts(program.bindings, program.push_bytes)?;
        let [vertex, fragment] = program.words();
        let modules = [made.make_module(&vertex)?, made.make_module(&fragment)?];
        let formats: Vec<_> = targets.iter().map(|(format, _)| (*format, true)).collect();
        // What is compatible with this pass is all that the pipeline asks of it, so it need not stay.
        let pass = render_pass(logical, &formats)?;
        let pipeline = made.make_drawing(pass, [0, 1].map(|k| stage(stages[k], modules[k])), targets);
        // SAFETY: the pass was made above and nobody else has it.
        unsafe { logical.raw.destroy_render_pass(pass, None) };
        made.raw = pipeline?;
        Ok(made)
    }

    fn begin(logical: &Arc<Logical>, stages: vk::ShaderStageFlags) -> Self {
        Self {
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            stages,
            modules: Vec::new(),
            logical: logical.clone(),
        }
    }

    fn make_layouts(&mut self, buffers: u32, push_bytes: u32) -> Result<(), DeviceError> {
        let device = &self.logical.raw;
        let storage = |binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .descriptor_count(1)
                .stage_flags(self.stages)
        };
        let bindings: Vec<_> = (0..buffers).map(storage).collect();
        let sets = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the info and what it points to outlive the call.
        self.set_layout = unsafe { device.create_descriptor_set_layout(&sets, None) }
            .map_err(failure::of("vkCreateDescriptorSetLayout"))?;
        let set_layouts = [self.set_layout];
        let push = [vk::PushConstantRange::default().stage_flags(self.stages).size(push_bytes)];
        let push = if push_bytes > 0 { &push[..] } else { &[] };
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(push);
        // SAFETY: as above.
        self.layout =
            unsafe { device.create_pipeline_layout(&layout, None) }.map_err(failure::of("vkCreatePipelineLayout"))?;
        Ok(())
    }

    fn make_module(&mut self, words: &[u32]) -> Result<vk::ShaderModule, DeviceError> {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words are a committed module, which was validated when it was compiled.
        let module = unsafe { self.logical.raw.create_shader_module(&info, None) };
        let module = module.map_err(failure::of("vkCreateShaderModule"))?;
        self.modules.push(module);
        Ok(module)
    }

    /// Strips of triangles, of which neither side is hidden, into images of the size that the draw has.
    fn make_drawing(
        &self,
        pass: vk::RenderPass,
        stages: [vk::PipelineShaderStageCreateInfo<'_>; 2],
        targets: &[(Format, Blend)],
    ) -> Result<vk::Pipeline, DeviceError> {
        let vertices = vk::PipelineVertexInputStateCreateInfo::default();
        let corners =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_STRIP);
        let area = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let triangles = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let blends: Vec<_> = targets.iter().map(|(_, blend)| blended(*blend)).collect();
        let blending = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let given = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&given);
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&corners)
            .viewport_state(&area)
            .rasterization_state(&triangles)
            .multisample_state(&samples)
            .color_blend_state(&blending)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .render_pass(pass)];
        // SAFETY: modules and layout were made for each other: a test holds the table of programs against them; the
        // formats are those of the pass, and the device blends them.
        let made = unsafe { self.logical.raw.create_graphics_pipelines(vk::PipelineCache::null(), &info, None) };
        let made = made.map_err(|(_, result)| failure::of("vkCreateGraphicsPipelines")(result))?;
        Ok(made.first().copied().unwrap_or_default())
    }
}

fn stage(stage: vk::ShaderStageFlags, module: vk::ShaderModule) -> vk::PipelineShaderStageCreateInfo<'static> {
    vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
}

fn blended(blend: Blend) -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    // Of the fragment and of the pixel: colours, then the last number.
    let [color, last] = match blend {
        Blend::Add => [[Factor::ONE, Factor::ONE]; 2],
        Blend::Over => [[Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA]; 2],
        Blend::Under => [[Factor::DST_ALPHA, Factor::ONE], [Factor::ZERO, Factor::ONE_MINUS_SRC_ALPHA]],
    };
    vk::PipelineColorBlendAttachmentState::default()
        .blend_enable(true)
        .src_color_blend_factor(color[0])
        .dst_color_blend_factor(color[1])
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(last[0])
        .dst_alpha_blend_factor(last[1])
        .alpha_blend_op(vk::BlendOp::ADD)
        .color_write_mask(vk::ColorComponentFlags::RGBA)
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = &self.logical.raw;
        // SAFETY: whoever submitted work with this pipeline holds it until the work is done; null is allowed.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            self.modules.iter().for_each(|module| device.destroy_shader_module(*module, None));
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
