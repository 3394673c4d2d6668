//! The order of translucent splats by a device.

use crate::Helper;
use hbsort::Params;
use hbsort::gpu::slice_cloud_on;
use splat_core::{Camera, Cloud, SliceOrder};

/// The exact order of some splats of a cloud, [`hbsort::slice_cloud`]'s bit for bit, or `None` for the processor to find it.
pub fn order(helper: &Helper<'_>, cloud: &Cloud, ids: &[u32], camera: &Camera, params: &Params) -> Option<SliceOrder> {
    if !params.exact {
        helper.leave("slices without order inside (render.points.exact = false) are made by the processor");
        return None;
    }
    let run = helper.with(|device| Ok(slice_cloud_on(device, cloud, ids, camera, params)?))?;
    Some(run.order)
}
