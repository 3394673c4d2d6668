//! Shadow maps by a device.

use crate::Helper;
use tsm::gpu::map_on;
use tsm::{Deposits, ShadowMap};

/// The map of these deposits, [`Deposits::into_map`]'s bit for bit, or `None` for the processor to make its lists.
pub fn shadow_map(helper: &Helper<'_>, deposits: &Deposits) -> Option<ShadowMap> {
    if deposits.entries() == [0, 0] {
        return None;
    }
    let made = helper.with(|device| Ok(map_on(device, deposits)?))?;
    if made.is_none() {
        helper.leave("a shadow map's cells have more entries than the device can see: the processor makes its lists");
    }
    made.map(|run| run.map)
}
