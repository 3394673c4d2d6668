//! A driver that loses devices when a test wants it: `vkQueueSubmit` of the marked devices answers `VK_ERROR_DEVICE_LOST`.

use ash::vk;
use std::sync::{Mutex, PoisonError};

/// A queue, the driver's own function, and whether the device is lost.
struct Watched {
    queue: vk::Queue,
    submit: vk::PFN_vkQueueSubmit,
    lost: bool,
}

/// Drivers' functions have no state of their own to tell devices apart.
static WATCHED: Mutex<Vec<Watched>> = Mutex::new(Vec::new());

/// The device with its submissions watched.
pub(crate) fn watch(raw: &ash::Device, queue: vk::Queue) -> ash::Device {
    let mut table = raw.fp_v1_0().clone();
    let watched = Watched { queue, submit: table.queue_submit, lost: false };
    let mut all = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    // A queue's number may be that of a device that has ended.
    all.retain(|w| w.queue != queue);
    all.push(watched);
    table.queue_submit = submit;
    let later = (raw.fp_v1_1().clone(), raw.fp_v1_2().clone(), raw.fp_v1_3().clone());
    ash::Device::from_parts_1_3(raw.handle(), table, later.0, later.1, later.2)
}

/// From now on the device is lost.
pub(crate) fn lose(queue: vk::Queue) {
    let mut all = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    all.iter_mut().filter(|w| w.queue == queue).for_each(|w| w.lost = true);
}

/// # Safety
/// As `vkQueueSubmit`.
unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    work: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let all = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    match all.iter().find(|w| w.queue == queue) {
        Some(Watched { lost: false, submit, .. }) => {
            let submit = *submit;
            drop(all);
            // SAFETY: the caller's promise is passed on to the function that it is made for.
            unsafe { submit(queue, count, work, fence) }
        }
        _ => vk::Result::ERROR_DEVICE_LOST,
    }
}
