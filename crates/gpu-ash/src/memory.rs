//! Buffers and images, and the memory under them.

use crate::device::Logical;
use crate::failure;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use splat_shaders::{DeviceError, Format};
use std::sync::{Arc, Mutex, PoisonError};

/// The allocator of one device.
pub(crate) struct Memory {
    // Before the device, for it ends first.
    allocator: Mutex<Allocator>,
    logical: Arc<Logical>,
}

impl Memory {
    pub(crate) fn new(logical: &Arc<Logical>) -> Result<Self, DeviceError> {
        let description = AllocatorCreateDesc {
            instance: logical.instance.raw.clone(),
            device: logical.raw.clone(),
            physical_device: logical.found.physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        };
        let allocator = Mutex::new(Allocator::new(&description).map_err(failure::of_memory(0))?);
        Ok(Self { allocator, logical: logical.clone() })
    }
}

impl Memory {
    fn take(&self, wanted: &AllocationCreateDesc<'_>) -> Result<Allocation, DeviceError> {
        let mut allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        allocator.allocate(wanted).map_err(failure::of_memory(wanted.requirements.size))
    }

    fn free(&self, allocation: Option<Allocation>) {
        if let Some(allocation) = allocation {
            let mut allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
            // It refuses only memory that is not its own.
            let _ = allocator.free(allocation);
        }
    }
}

/// A buffer with its memory; both end when it is dropped, which nobody does while the device works on it.
pub(crate) struct Buffer {
    pub(crate) raw: vk::Buffer,
    allocation: Option<Allocation>,
    memory: Arc<Memory>,
}

impl Buffer {
    pub(crate) fn new(
        memory: &Arc<Memory>,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self, DeviceError> {
        let device = &memory.logical.raw;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device lives as long as `memory`; a size of 0 never comes here.
        let raw = unsafe { device.create_buffer(&info, None) }.map_err(failure::of("vkCreateBuffer"))?;
        let mut buffer = Self { raw, allocation: None, memory: memory.clone() };
        // SAFETY: the buffer is the device's.
        let requirements = unsafe { device.get_buffer_memory_requirements(raw) };
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let wanted = AllocationCreateDesc { name, requirements, location, linear: true, allocation_scheme };
        let allocation = memory.take(&wanted)?;
        // SAFETY: memory of the kind and size that the buffer requires, bound once and to nothing else.
        let bound = unsafe { device.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) };
        buffer.allocation = Some(allocation);
        bound.map_err(failure::of("vkBindBufferMemory"))?;
        Ok(buffer)
    }

    /// The bytes, where the processor sees them.
    pub(crate) fn bytes(&self) -> &[u8] {
        self.allocation.as_ref().and_then(Allocation::mapped_slice).unwrap_or_default()
    }

    /// The same to write.
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).unwrap_or_default()
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: whoever submitted work with this buffer waited for it.
        unsafe { self.memory.logical.raw.destroy_buffer(self.raw, None) };
        self.memory.free(self.allocation.take());
    }
}

/// An image that draws blend into, with its memory; ends as a [`Buffer`] does.
pub(crate) struct Image {
    pub(crate) raw: vk::Image,
    /// Null where making it stopped.
    pub(crate) view: vk::ImageView,
    allocation: Option<Allocation>,
    memory: Arc<Memory>,
}

impl Image {
    pub(crate) fn new(memory: &Arc<Memory>, of: &splat_shaders::Image) -> Result<Self, DeviceError> {
        let device = &memory.logical.raw;
        let ([width, height], format) = (of.size, format(of.format));
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
        // SAFETY: the device lives as long as `memory`, and has taken this size and format.
        let raw = unsafe { device.create_image(&info, None) }.map_err(failure::of("vkCreateImage"))?;
        let mut image = Self { raw, view: vk::ImageView::null(), allocation: None, memory: memory.clone() };
        // SAFETY: the image is the device's.
        let requirements = unsafe { device.get_image_memory_requirements(raw) };
        let (location, allocation_scheme) = (MemoryLocation::GpuOnly, AllocationScheme::GpuAllocatorManaged);
        let wanted = AllocationCreateDesc { name: of.name, requirements, location, linear: false, allocation_scheme };
        let allocation = memory.take(&wanted)?;
        // SAFETY: memory of the kind and size that the image requires, bound once and to nothing else.
        let bound = unsafe { device.bind_image_memory(raw, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound.map_err(failure::of("vkBindImageMemory"))?;
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(whole());
        // SAFETY: the image has its memory, and the view names what it is.
        image.view = unsafe { device.create_image_view(&view, None) }.map_err(failure::of("vkCreateImageView"))?;
        Ok(image)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let device = &self.memory.logical.raw;
        // SAFETY: whoever submitted work with this image waited for it; null is allowed.
        unsafe {
            device.destroy_image_view(self.view, None);
            device.destroy_image(self.raw, None);
        }
        self.memory.free(self.allocation.take());
    }
}

/// All of an image.
pub(crate) fn whole() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1)
}

/// The driver's word for a format.
pub(crate) fn format(format: Format) -> vk::Format {
    match format {
        Format::R32F => vk::Format::R32_SFLOAT,
        Format::Rgba32F => vk::Format::R32G32B32A32_SFLOAT,
        Format::R16F => vk::Format::R16_SFLOAT,
        Format::Rgba16F => vk::Format::R16G16B16A16_SFLOAT,
    }
}
