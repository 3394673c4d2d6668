//! Lists of a map on an opened device, in as many batches as they need.

use super::{Batch, Capacities, record};
use crate::{Deposits, Error, ShadowMap};
use splat_shaders::{Executor, Lanes, PassTime, most_that_fits};

/// Entries of a batch that are not halved any more where memory is short.
const LEAST: u32 = 4096;

/// A shadow map that a device has listed.
pub struct MapRun {
    /// The map, equal to the processor's bit for bit.
    pub map: ShadowMap,
    /// Times of all dispatches.
    pub passes: Vec<PassTime>,
}

/// [`Deposits::into_map`] by a device: the same map, bit for bit. If its kernels cannot see all entries at once, or it has no
/// memory for them, it lists the cells run by run. `None` where cells that lie together have more entries than the device can
/// see.
///
/// # Errors
/// [`Error::Device`] for what the device refuses.
pub fn map_on(device: &mut dyn Executor, deposits: &Deposits) -> Result<Option<MapRun>, Error> {
    let most = Capacities::most(device.adapter().binding_bytes, deposits.channels() as u32);
    let lanes = Lanes::for_adapter(device.adapter());
    let total = u32::try_from(deposits.entries().iter().sum::<u64>()).unwrap_or(u32::MAX);
    let prepared = most_that_fits(most.entries.min(total), LEAST, |entries| {
        let batches = deposits.batches(Capacities { entries, ..most })?;
        let largest = |number: fn(&Batch) -> u64| batches.iter().map(number).max().unwrap_or(0) as u32;
        let recorded = record(Capacities { entries: largest(Batch::entries), cells: largest(Batch::cells), ..most });
        Ok(device.prepare(&recorded.recording.by(lanes)).map(|ready| (batches, recorded, ready)))
    });
    let (batches, recorded, mut ready) = match prepared {
        Err(Error::Overflow(_)) => return Ok(None),
        prepared => prepared??,
    };
    let mut passes = Vec::new();
    let mut list = |batch: &Batch| -> Result<_, Error> {
        let uploads = recorded.uploads(deposits, batch)?;
        let run = ready.run(&recorded.inputs(&uploads))?;
        let reads = [recorded.spans, recorded.distances, recorded.totals].map(|buffer| run.bytes(buffer));
        let listed = recorded.listed(reads, batch)?;
        passes.extend(run.passes);
        Ok(listed)
    };
    let listed = batches.iter().map(&mut list).collect::<Result<Vec<_>, _>>()?;
    Ok(Some(MapRun { map: deposits.join(listed)?, passes }))
}
