//! Ordered translucent splats composited by a device.

use super::Failure;
use splat_core::raster::gpu::{Input, TILE, record};
use splat_core::raster::{Accumulation, RasterCounts};
use splat_core::{Accumulator, Error};
use splat_shaders::{Executor, PassTime};

/// Room for tile entries before their number is known: so many a splat, and these.
const ENTRIES_OF_SPLAT: usize = 4;
const MORE_ENTRIES: usize = 1 << 16;

/// What the recording does not do.
pub(super) fn why_not_composite(input: &Input<'_>, accumulator: &Accumulator) -> Option<&'static str> {
    match (accumulator.depth.is_empty(), accumulator.object.is_empty(), input.params.accumulation) {
        (false, ..) => Some("depth layers are made by the processor, and so are the splats composited"),
        (_, false, _) => Some("object layers are made by the processor, and so are the splats composited"),
        (.., Accumulation::F16) => Some("splats are composited in half precision by the processor"),
        _ => None,
    }
}

/// [`splat_core::raster::fold`] by a device, with the times of its passes; the accumulator changes only when all is done.
pub(super) fn composite_on(
    device: &mut dyn Executor,
    input: &Input<'_>,
    accumulator: &mut Accumulator,
) -> Result<(RasterCounts, Vec<PassTime>), Failure> {
    let guess = ENTRIES_OF_SPLAT.saturating_mul(input.order.len()).saturating_add(MORE_ENTRIES);
    let mut room = u32::try_from(guess).unwrap_or(u32::MAX);
    loop {
        let recorded = record(input.capacities(accumulator, room))?;
        let uploads = recorded.uploads(input, accumulator)?;
        let run = device.prepare(&recorded.recording)?.run(&recorded.inputs(&uploads))?;
        match recorded.finish([recorded.state, recorded.planes].map(|b| run.bytes(b)), accumulator) {
            // Too little room: found once, for the device says what it needs.
            Err(Error::Overflow { needed, .. }) if u32::try_from(needed).is_ok_and(|needed| needed > room) => {
                room = needed as u32;
            }
            counts => {
                let counts = counts?;
                let counts = RasterCounts {
                    splats: counts.splats,
                    tile_entries: counts.entries,
                    // At most: tiles that are done are left.
                    fragments: counts.entries * u64::from(TILE * TILE),
                    bytes: recorded.recording.bytes(),
                };
                return Ok((counts, run.passes));
            }
        }
    }
}
