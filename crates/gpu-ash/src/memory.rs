//! Buffers and the memory under them.

use crate::device::Logical;
use crate::failure;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use splat_shaders::DeviceError;
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
        let raw = unsafe { device.create_buffer(&info, None) }.map_err(failure::in_call("vkCreateBuffer"))?;
        let mut buffer = Self { raw, allocation: None, memory: memory.clone() };
        // SAFETY: the buffer is the device's.
        let requirements = unsafe { device.get_buffer_memory_requirements(raw) };
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let request = AllocationCreateDesc { name, requirements, location, linear: true, allocation_scheme };
        let mut allocator = memory.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        let allocation = allocator.allocate(&request).map_err(failure::of_memory(bytes))?;
        drop(allocator);
        // SAFETY: memory of the kind and size that the buffer requires, bound once and to nothing else.
        let bound = unsafe { device.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) };
        buffer.allocation = Some(allocation);
        bound.map_err(failure::in_call("vkBindBufferMemory"))?;
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
        if let Some(allocation) = self.allocation.take() {
            let mut allocator = self.memory.allocator.lock().unwrap_or_else(PoisonError::into_inner);
            // It refuses only memory that is not its own.
            let _ = allocator.free(allocation);
        }
    }
}
