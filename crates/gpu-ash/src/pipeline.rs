//! A kernel as the driver compiled it.

use crate::device::Logical;
use crate::failure;
use ash::vk;
use splat_shaders::{DeviceError, Kernel};
use std::sync::Arc;

/// A compute pipeline with its layouts; null where making it stopped.
pub(crate) struct Pipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set_layout: vk::DescriptorSetLayout,
    module: vk::ShaderModule,
    logical: Arc<Logical>,
}

impl Pipeline {
    pub(crate) fn new(logical: &Arc<Logical>, kernel: &Kernel) -> Result<Self, DeviceError> {
        let mut made = Self {
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            module: vk::ShaderModule::null(),
            logical: logical.clone(),
        };
        made.make(kernel)?;
        Ok(made)
    }

    fn make(&mut self, kernel: &Kernel) -> Result<(), DeviceError> {
        let device = &self.logical.raw;
        let storage = |binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        };
        let bindings: Vec<_> = (0..kernel.bindings.len() as u32).map(storage).collect();
        let sets = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the info and what it points to outlive the call.
        self.set_layout = unsafe { device.create_descriptor_set_layout(&sets, None) }
            .map_err(failure::in_call("vkCreateDescriptorSetLayout"))?;
        let set_layouts = [self.set_layout];
        let push =
            [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(kernel.push_bytes)];
        let push = if kernel.push_bytes > 0 { &push[..] } else { &[] };
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(push);
        // SAFETY: as above.
        self.layout = unsafe { device.create_pipeline_layout(&layout, None) }
            .map_err(failure::in_call("vkCreatePipelineLayout"))?;
        let words = kernel.words();
        let module = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a committed module, which was validated when it was compiled.
        self.module =
            unsafe { device.create_shader_module(&module, None) }.map_err(failure::in_call("vkCreateShaderModule"))?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(self.module)
            .name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout)];
        // SAFETY: module and layout were made above, for each other: a test holds the table of kernels against them.
        let made = unsafe { device.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
        let made = made.map_err(|(_, result)| failure::in_call("vkCreateComputePipelines")(result))?;
        self.raw = made.first().copied().unwrap_or_default();
        Ok(())
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = &self.logical.raw;
        // SAFETY: whoever submitted work with this pipeline holds it until the work is done; null is allowed.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_shader_module(self.module, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
