//! The adapters that wgpu finds.

use splat_shaders::{Adapter, AdapterKind, DeviceError, SubgroupOps, Validation};

/// Features without which no recording runs.
const NEEDED: wgpu::Features = wgpu::Features::IMMEDIATES;

/// Every adapter of this machine that wgpu reaches by Vulkan and that runs recordings, software drivers included.
///
/// # Errors
/// None today; a driver that fails offers no adapter.
pub fn adapters() -> Result<Vec<Adapter>, DeviceError> {
    Ok(find(&instance(Validation::Off)).iter().map(describe).collect())
}

pub(crate) fn instance(validation: Validation) -> wgpu::Instance {
    use wgpu::InstanceFlags as Flags;
    // Not `DEBUG`: what naga writes for debuggers is no valid module to older layers.
    let flags = match validation {
        Validation::Off => Flags::empty(),
        Validation::Synchronization => Flags::VALIDATION,
        Validation::GpuAssisted => Flags::VALIDATION | Flags::GPU_BASED_VALIDATION,
    };
    let backends = wgpu::Backends::VULKAN;
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        flags,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

pub(crate) fn find(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    found.retain(|adapter| adapter.features().contains(NEEDED));
    found
}

/// What kernels need that take the least of 64 bits.
const WIDE_ATOMICS: wgpu::Features = wgpu::Features::SHADER_INT64
    .union(wgpu::Features::SHADER_INT64_ATOMIC_MIN_MAX)
    .union(wgpu::Features::SHADER_INT64_ATOMIC_ALL_OPS);

/// What is asked of an adapter: the needed features, clocks, subgroups and 64-bit atomics where it has them.
pub(crate) fn features(adapter: &wgpu::Adapter) -> wgpu::Features {
    let wide = if adapter.features().contains(WIDE_ATOMICS) { WIDE_ATOMICS } else { wgpu::Features::empty() };
    NEEDED | wide | (adapter.features() & (wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::SUBGROUP))
}

pub(crate) fn describe(adapter: &wgpu::Adapter) -> Adapter {
    let info = adapter.get_info();
    let limits = adapter.limits();
    Adapter {
        name: info.name,
        driver: format!("{} {} through wgpu", info.driver, info.driver_info),
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
            wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
            wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
            wgpu::DeviceType::Cpu => AdapterKind::Software,
            wgpu::DeviceType::Other => AdapterKind::Other,
        },
        // wgpu does not say.
        memory_bytes: 0,
        binding_bytes: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        subgroup: info.subgroup_min_size,
        wide_atomics: adapter.features().contains(WIDE_ATOMICS),
        // It asks for all operations at once.
        subgroup_ops: if adapter.features().contains(wgpu::Features::SUBGROUP) {
            SubgroupOps::ALL
        } else {
            SubgroupOps::NONE
        },
    }
}
