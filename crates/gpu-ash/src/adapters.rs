//! The devices that this machine's drivers offer.

use crate::failure;
use crate::instance::Instance;
use ash::{khr, vk};
use splat_shaders::{Adapter, AdapterKind, DeviceError, SubgroupOps, Validation};

/// A device before it is opened.
pub(crate) struct Found {
    pub(crate) physical: vk::PhysicalDevice,
    /// A family of queues that compute.
    pub(crate) family: u32,
    /// Nanoseconds a tick of the device's clock; 0 where it has none.
    pub(crate) tick_ns: f64,
    /// Bits of the clock that count.
    pub(crate) tick_mask: u64,
    pub(crate) adapter: Adapter,
}

/// Every adapter of this machine that speaks Vulkan 1.1 and computes, software drivers included. None is no error.
///
/// # Errors
/// [`DeviceError::NoDevice`] without a Vulkan loader, [`DeviceError::Driver`] when a driver fails.
pub fn adapters() -> Result<Vec<Adapter>, DeviceError> {
    Ok(find(&Instance::new(Validation::Off)?)?.into_iter().map(|found| found.adapter).collect())
}

pub(crate) fn find(instance: &Instance) -> Result<Vec<Found>, DeviceError> {
    // SAFETY: the instance is alive.
    let physicals = unsafe { instance.raw.enumerate_physical_devices() };
    let physicals = physicals.map_err(failure::in_call("vkEnumeratePhysicalDevices"))?;
    Ok(physicals.into_iter().filter_map(|physical| describe(instance, physical)).collect())
}

fn describe(instance: &Instance, physical: vk::PhysicalDevice) -> Option<Found> {
    // SAFETY: `physical` comes from this living instance.
    let basic = unsafe { instance.raw.get_physical_device_properties(physical) };
    if basic.api_version < vk::API_VERSION_1_1 {
        return None;
    }
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroup);
    // SAFETY: as above; the chain holds structs of Vulkan 1.1, which the device speaks.
    let (families, memory) = unsafe {
        instance.raw.get_physical_device_properties2(physical, &mut properties);
        let families = instance.raw.get_physical_device_queue_family_properties(physical);
        (families, instance.raw.get_physical_device_memory_properties(physical))
    };
    let computes = |f: &vk::QueueFamilyProperties| f.queue_flags.contains(vk::QueueFlags::COMPUTE);
    let family = families.iter().position(computes)?;
    let bits = families[family].timestamp_valid_bits;
    let heaps = memory.memory_heaps_as_slice().iter();
    let local = heaps.filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    let adapter = Adapter {
        name: basic.device_name_as_c_str().unwrap_or(c"?").to_string_lossy().into_owned(),
        driver: format!("Vulkan {}, driver {}", version(basic.api_version), version(basic.driver_version)),
        kind: kind(basic.device_type),
        memory_bytes: local.map(|heap| heap.size).sum(),
        binding_bytes: u64::from(basic.limits.max_storage_buffer_range),
        subgroup: subgroup.subgroup_size,
        wide_atomics: wide_atomics(instance, physical),
        subgroup_ops: subgroup_ops(&subgroup),
    };
    let tick_ns = if bits == 0 { 0.0 } else { f64::from(basic.limits.timestamp_period) };
    Some(Found { physical, family: family as u32, tick_ns, tick_mask: u64::MAX >> (64 - bits.clamp(1, 64)), adapter })
}

/// Whether a device has the extension and both features that kernels with 64-bit atomics need.
fn wide_atomics(instance: &Instance, physical: vk::PhysicalDevice) -> bool {
    // SAFETY: `physical` comes from this living instance.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(physical) }.unwrap_or_default();
    if !extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::shader_atomic_int64::NAME)) {
        return false;
    }
    let mut atomics = vk::PhysicalDeviceShaderAtomicInt64Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut atomics);
    // SAFETY: as above; the struct in the chain belongs to an extension that the device has.
    unsafe { instance.raw.get_physical_device_features2(physical, &mut features) };
    let whole = features.features.shader_int64 == vk::TRUE;
    whole && atomics.shader_buffer_int64_atomics == vk::TRUE
}

/// Returns the subgroup operations of compute shaders.
fn subgroup_ops(had: &vk::PhysicalDeviceSubgroupProperties<'_>) -> SubgroupOps {
    use vk::SubgroupFeatureFlags as Ops;
    let has =
        |ops| had.supported_stages.contains(vk::ShaderStageFlags::COMPUTE) && had.supported_operations.contains(ops);
    SubgroupOps {
        ballot: has(Ops::BASIC | Ops::BALLOT),
        shuffle: has(Ops::BASIC | Ops::SHUFFLE),
        arithmetic: has(Ops::BASIC | Ops::ARITHMETIC),
    }
}

fn version(v: u32) -> String {
    format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v))
}

fn kind(device_type: vk::PhysicalDeviceType) -> AdapterKind {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => AdapterKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => AdapterKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => AdapterKind::Virtual,
        vk::PhysicalDeviceType::CPU => AdapterKind::Software,
        _ => AdapterKind::Other,
    }
}
