//! The exact order of splats by a device.

use super::Failure;
use hbsort::gpu::{Capacities, record};
use hbsort::{Params, SliceOrder};
use splat_core::{Camera, Cloud};
use splat_shaders::Executor;

/// [`hbsort::slice_cloud`] of the splats `ids` by a device.
pub(super) fn order_on(
    device: &mut dyn Executor,
    cloud: &Cloud,
    ids: &[u32],
    camera: &Camera,
    params: &Params,
) -> Result<SliceOrder, Failure> {
    let splats = ids.len() as u32;
    let recorded = record(Capacities { splats, kept: splats });
    let uploads = recorded.uploads(cloud, Some(ids), camera, params)?;
    let run = device.run(&recorded.recording, &recorded.inputs(&uploads))?;
    let reads = [recorded.state, recorded.keys, recorded.places].map(|buffer| run.bytes(buffer));
    Ok(recorded.order(reads, cloud, Some(ids), params)?)
}
