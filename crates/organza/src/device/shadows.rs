//! Shadow maps by a device: their lists, bit for bit the processor's, and look-ups in them.

use super::Failure;
use splat_core::{Receiver, Transmittance};
use splat_shaders::{DeviceError, Executor, Lanes, PassTime};
use tsm::gpu::{Batch, Capacities, Room, record, record_look_up};
use tsm::{Deposits, Error, ShadowMap};

/// Entries of a batch, and receivers of a run, that are not halved any more where memory is short.
const LEAST: u32 = 4096;

/// [`Deposits::into_map`] by a device, in batches where its kernels do not see all entries at once or where it has no memory
/// for them; with the dispatches of all. `None` where cells that lie together have more entries than it can take.
pub(super) fn map_on(
    device: &mut dyn Executor,
    deposits: &Deposits,
) -> Result<Option<(ShadowMap, Vec<PassTime>)>, Failure> {
    let mut most = Capacities::most(device.adapter().binding_bytes, deposits.channels() as u32);
    let lanes = Lanes::of(device.adapter());
    let (batches, recorded, mut ready) = loop {
        let batches = match deposits.batches(most) {
            Err(Error::Overflow { .. }) => return Ok(None),
            batches => batches?,
        };
        let largest = |number: fn(&Batch) -> u64| batches.iter().map(number).max().unwrap_or(0) as u32;
        let recorded = record(Capacities { entries: largest(Batch::entries), cells: largest(Batch::cells), ..most });
        match device.prepare(&recorded.recording.by(lanes)) {
            Err(DeviceError::Memory { .. }) if recorded.capacities.entries > LEAST => {
                most.entries = recorded.capacities.entries.div_ceil(2);
            }
            ready => break (batches, recorded, ready?),
        }
    };
    let mut passes = Vec::new();
    let mut list = |batch: &Batch| -> Result<_, Failure> {
        let uploads = recorded.uploads(deposits, batch)?;
        let run = ready.run(&recorded.inputs(&uploads))?;
        let reads = [recorded.spans, recorded.distances, recorded.totals].map(|buffer| run.bytes(buffer));
        let listed = recorded.listed(reads, batch)?;
        passes.extend(run.passes);
        Ok(listed)
    };
    let listed = batches.iter().map(&mut list).collect::<Result<Vec<_>, _>>()?;
    Ok(Some((deposits.join(listed)?, passes)))
}

/// What became of look-ups.
pub(super) enum LookUps {
    /// Transmittances in the order of the receivers, and the dispatches of all runs.
    Done(Vec<[f32; 3]>, Vec<PassTime>),
    /// They are the processor's, for this reason.
    Left(&'static str),
}

/// The light that arrives at receivers, by a device; in runs where not all fit into one.
pub(super) fn look_up_on(
    device: &mut dyn Executor,
    map: &ShadowMap,
    receivers: &[Receiver],
) -> Result<LookUps, Failure> {
    let binding_bytes = device.adapter().binding_bytes;
    let mut at_once = Room::most_receivers(binding_bytes).min(receivers.len().max(1) as u32);
    let (recorded, mut ready) = loop {
        let Some(room) = Room::of(map, at_once) else {
            return Ok(LookUps::Left("shadow maps of polar angles are looked up by the processor"));
        };
        let recorded = record_look_up(room);
        if recorded.recording.buffers().iter().any(|b| b.bytes > binding_bytes) {
            return Ok(LookUps::Left(
                "a shadow map is larger than the device's kernels see: the processor looks it up",
            ));
        }
        match device.prepare(&recorded.recording) {
            Err(DeviceError::Memory { .. }) if at_once > LEAST => at_once = at_once.div_ceil(2),
            ready => break (recorded, ready?),
        }
    };
    let uploads = recorded.map(map)?;
    let (mut lights, mut passes) = (Vec::with_capacity(receivers.len()), Vec::new());
    for (k, part) in receivers.chunks(at_once.max(1) as usize).enumerate() {
        // The map stays where it is for the runs behind the first.
        let own = recorded.receivers(map, &uploads, part)?;
        let run = ready.run(&recorded.inputs((k == 0).then_some(&uploads), &own))?;
        lights.extend(recorded.transmittances(run.bytes(recorded.lights), &own)?);
        passes.extend(run.passes);
    }
    Ok(LookUps::Done(lights, passes))
}

/// A map with the light at the splats that it was looked up for.
pub(crate) struct LookedUp<'a> {
    map: &'a ShadowMap,
    /// By id of a splat: the place of its light among `lights`, or `NONE`.
    place: Vec<u32>,
    lights: Vec<[f32; 3]>,
}

/// No place.
const NONE: u32 = u32::MAX;

impl<'a> LookedUp<'a> {
    /// The map and the light at these splats of a cloud of so many.
    pub(super) fn new(map: &'a ShadowMap, splats: usize, ids: &[u32], lights: Vec<[f32; 3]>) -> Self {
        let mut place = vec![NONE; splats];
        (0u32..).zip(ids).for_each(|(at, id)| place[*id as usize] = at);
        Self { map, place, lights }
    }
}

impl Transmittance for LookedUp<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        self.map.transmittance(receiver)
    }

    fn at_splat(&self, splat: usize, receiver: &Receiver) -> [f32; 3] {
        let known = self.place.get(splat).and_then(|at| self.lights.get(*at as usize));
        known.copied().unwrap_or_else(|| self.transmittance(receiver))
    }
}
