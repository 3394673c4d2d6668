//! Ordered translucent splats composited by a device.

use super::Failure;
use splat_core::raster::FoldInput;
use splat_core::raster::gpu::{Counts, TILE, record};
use splat_core::raster::{Accumulation, RasterCounts};
use splat_core::{Accumulator, Error};
use splat_shaders::{AdapterKind, Executor, Lanes, PassTime};

/// Room for tile entries before their number is known: so many a splat, and these.
const ENTRIES_OF_SPLAT: usize = 4;
const MORE_ENTRIES: usize = 1 << 16;
/// Splats of a tile that a thread of a software driver goes through: one round each, with some to spare.
pub(super) const MOST_OF_A_TILE: u64 = 60_000;

/// Room for the tile entries of so many splats, before their number is known.
pub(super) fn room_for(splats: usize) -> u32 {
    let guess = ENTRIES_OF_SPLAT.saturating_mul(splats).saturating_add(MORE_ENTRIES);
    u32::try_from(guess).unwrap_or(u32::MAX)
}

/// Whether a driver has left splats away: Mesa's on the processor ends the loops of a thread after 65535 rounds, silently.
pub(super) fn too_long(device: &dyn Executor, counts: &Counts) -> bool {
    device.adapter().kind == AdapterKind::Software && counts.longest > MOST_OF_A_TILE
}

/// The device's counts as the processor's.
pub(super) fn raster_counts(counts: &Counts, bytes: u64) -> RasterCounts {
    // At most: tiles that are done are left.
    let fragments = counts.entries * u64::from(TILE * TILE);
    RasterCounts { splats: counts.splats, tile_entries: counts.entries, fragments, bytes }
}

/// What the recording does not do.
pub(super) fn why_not_composite(input: &FoldInput<'_>) -> Option<&'static str> {
    let half = input.params.accumulation == Accumulation::F16;
    let through = input.projected.crosses_the_eye();
    half.then_some("splats are composited in half precision by the processor")
        .or(through.then_some("surfaces through the eye plane are composited by the processor"))
}

/// [`splat_core::raster::fold`] by a device, with the times of its passes; the accumulator changes only when all is done.
/// `None` where the driver cannot go through all splats of a tile.
pub(super) fn composite_on(
    device: &mut dyn Executor,
    input: &FoldInput<'_>,
    accumulator: &mut Accumulator,
) -> Result<Option<(RasterCounts, Vec<PassTime>)>, Failure> {
    let (mut room, lanes) = (room_for(input.order.len()), Lanes::of(device.adapter()));
    loop {
        let recorded = record(input.capacities(accumulator, room))?;
        let uploads = recorded.uploads(input, accumulator)?;
        let run = device.prepare(&recorded.recording.by(lanes))?.run(&recorded.inputs(&uploads))?;
        match recorded.counts(run.bytes(recorded.state)) {
            // Too little room: found once, for the device says what it needs.
            Err(Error::Overflow { needed, .. }) if u32::try_from(needed).is_ok_and(|needed| needed > room) => {
                room = needed as u32;
            }
            counts => {
                let counts = counts?;
                if too_long(device, &counts) {
                    return Ok(None);
                }
                recorded.finish([recorded.state, recorded.planes].map(|b| run.bytes(b)), accumulator)?;
                return Ok(Some((raster_counts(&counts, recorded.recording.bytes()), run.passes)));
            }
        }
    }
}
