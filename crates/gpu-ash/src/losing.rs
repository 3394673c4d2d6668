//! A driver that loses devices on request of a test: `vkQueueSubmit` of the marked devices returns `VK_ERROR_DEVICE_LOST`,
//! or accepts work and never does it.

use ash::vk;
use std::sync::{Mutex, PoisonError};

/// The behaviour that a test requests of a device.
#[derive(Clone, Copy)]
pub(crate) enum Fate {
    Works,
    Lost,
    Hangs,
}

/// A queue, the driver's own function, and what becomes of the device.
struct Watched {
    queue: vk::Queue,
    submit: vk::PFN_vkQueueSubmit,
    fate: Fate,
}

/// Drivers' functions have no state of their own to tell devices apart.
static WATCHED: Mutex<Vec<Watched>> = Mutex::new(Vec::new());

/// The device with its submissions watched.
pub(crate) fn watch(raw: &ash::Device, queue: vk::Queue) -> ash::Device {
    let mut table = raw.fp_v1_0().clone();
    let watched = Watched { queue, submit: table.queue_submit, fate: Fate::Works };
    let mut queues = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    // A queue's number may be that of a device that has ended.
    queues.retain(|w| w.queue != queue);
    queues.push(watched);
    table.queue_submit = submit;
    let later = (raw.fp_v1_1().clone(), raw.fp_v1_2().clone(), raw.fp_v1_3().clone());
    ash::Device::from_parts_1_3(raw.handle(), table, later.0, later.1, later.2)
}

/// From now on this becomes of the device.
pub(crate) fn mark(queue: vk::Queue, fate: Fate) {
    let mut queues = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    queues.iter_mut().filter(|w| w.queue == queue).for_each(|w| w.fate = fate);
}

/// # Safety
/// As `vkQueueSubmit`.
unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    work: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let queues = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    match queues.iter().find(|w| w.queue == queue) {
        Some(Watched { fate: Fate::Works, submit, .. }) => {
            let submit = *submit;
            drop(queues);
            // SAFETY: the caller's promise is passed on to the function that it is made for.
            unsafe { submit(queue, count, work, fence) }
        }
        Some(Watched { fate: Fate::Hangs, .. }) => vk::Result::SUCCESS,
        _ => vk::Result::ERROR_DEVICE_LOST,
    }
}
