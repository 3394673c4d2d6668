//! The sort on an opened device, in as many parts as it needs.

use super::{Capacities, Sorted, join, record};
use crate::{Error, Params};
use splat_core::{Camera, Cloud, SliceOrder};
use splat_shaders::{Executor, Lanes, PassTime, most_that_fits};

/// Splats of a part that is not halved any more where memory is short.
const LEAST: u32 = 4096;

/// An order of splats that a device has sorted.
pub struct SliceRun {
    /// The order, equal to the processor's bit for bit.
    pub order: SliceOrder,
    /// Times of all dispatches.
    pub passes: Vec<PassTime>,
}

/// [`crate::slice_cloud`] of the splats `ids` of a cloud by a device, with [`Params::exact`]: the same order, bit for bit, where
/// the device rounds products and sums one by one. Splats that it does not take all at once are sorted in parts, which are
/// joined here.
///
/// # Errors
/// [`Error::Device`] for what the device refuses, such as fewer than 4096 splats for which it has no memory; else those of
/// [`crate::slice_cloud`].
pub fn slice_cloud_on(
    device: &mut dyn Executor,
    cloud: &Cloud,
    ids: &[u32],
    camera: &Camera,
    params: &Params,
) -> Result<SliceRun, Error> {
    let splats = ids.len().max(1) as u32;
    let most = match Capacities::most_splats(device.adapter().binding_bytes) {
        // The device refuses, and says why.
        0 => splats,
        most => most.min(splats),
    };
    let lanes = Lanes::for_adapter(device.adapter());
    let prepared = most_that_fits(most, LEAST, |splats| {
        let recorded = record(Capacities { splats, kept: splats });
        Ok::<_, Error>(device.prepare(&recorded.recording.by(lanes)).map(|ready| (recorded, ready)))
    });
    let (recorded, mut ready) = prepared??;
    let mut passes = Vec::new();
    let mut sort = |ids: &[u32]| -> Result<Sorted, Error> {
        let uploads = recorded.uploads(cloud, Some(ids), camera, params)?;
        let run = ready.run(&recorded.inputs(&uploads))?;
        let reads = [recorded.state, recorded.keys, recorded.places].map(|buffer| run.bytes(buffer));
        let sorted = recorded.sorted(reads, cloud, Some(ids))?;
        passes.extend(run.passes);
        Ok(sorted)
    };
    let parts = ids.chunks(recorded.capacities.splats as usize).map(&mut sort).collect::<Result<Vec<_>, _>>()?;
    Ok(SliceRun { order: join(&parts, cloud, Some(ids), params)?, passes })
}
