//! The exact order of splats by a device, in parts where its kernels do not see all of them at once, or where it has no
//! memory for them.

use super::Failure;
use hbsort::gpu::{Capacities, Sorted, join, record};
use hbsort::{Params, SliceOrder};
use splat_core::{Camera, Cloud};
use splat_shaders::{DeviceError, Executor, Lanes, PassTime};

/// Splats of a part that is not halved any more.
const LEAST: u32 = 4096;

/// [`hbsort::slice_cloud`] of the splats `ids` by a device, and the dispatches of all parts.
pub(super) fn order_on(
    device: &mut dyn Executor,
    cloud: &Cloud,
    ids: &[u32],
    camera: &Camera,
    params: &Params,
) -> Result<(SliceOrder, Vec<PassTime>), Failure> {
    let all = ids.len().max(1) as u32;
    let mut splats = match Capacities::most_splats(device.adapter().binding_bytes) {
        // The device refuses, and says why.
        0 => all,
        most => most.min(all),
    };
    let lanes = Lanes::of(device.adapter());
    let (recorded, mut ready) = loop {
        let recorded = record(Capacities { splats, kept: splats });
        match device.prepare(&recorded.recording.by(lanes)) {
            Err(DeviceError::Memory { .. }) if splats > LEAST => splats = splats.div_ceil(2),
            ready => break (recorded, ready?),
        }
    };
    let mut passes = Vec::new();
    let mut sort = |ids: &[u32]| -> Result<Sorted, Failure> {
        let uploads = recorded.uploads(cloud, Some(ids), camera, params)?;
        let run = ready.run(&recorded.inputs(&uploads))?;
        let reads = [recorded.state, recorded.keys, recorded.places].map(|buffer| run.bytes(buffer));
        let sorted = recorded.sorted(reads, cloud, Some(ids))?;
        passes.extend(run.passes);
        Ok(sorted)
    };
    let parts = ids.chunks(splats as usize).map(&mut sort).collect::<Result<Vec<_>, _>>()?;
    Ok((join(&parts, cloud, Some(ids), params)?, passes))
}
