//! The same for more splats than fit a device at once. They are ordered first, then projected, shaded and composited in parts, one
//! after the other in compositing order. Each part continues the composited picture of the part before.

use super::{Chained, MOST_OF_A_TILE, Reason, Splats, room_for, run_on};
use crate::Failure;
use hbsort::gpu::{SliceRun, slice_cloud_on};
use splat_core::Accumulator;
use splat_core::raster::RasterCounts;
use splat_shaders::Executor;

/// Splats of a part that is not halved any more.
const LEAST: usize = 256;

/// Translucent splats into an accumulator by a device, in parts of at most so many; the accumulator changes only when all is
/// done. Where even few splats are too many it says why.
pub(super) fn chain_in_parts(
    device: &mut dyn Executor,
    splats: &Splats<'_>,
    mut most: usize,
    accumulator: &mut Accumulator,
) -> Result<Result<Chained, Reason>, Failure> {
    let SliceRun { order, mut passes } =
        slice_cloud_on(device, splats.input.cloud, splats.ids, splats.input.camera, splats.sort)?;
    let mut begun = accumulator.clone();
    let mut visible = 0;
    let mut raster = RasterCounts::default();
    let mut rest = &order.input_from_sorted[..];
    while !rest.is_empty() {
        let (ids, behind) = rest.split_at(most.min(rest.len()));
        let part = Splats { ids, ..*splats };
        match run_on(device, &part, false, room_for(ids.len()), &mut begun)? {
            Ok(done) => {
                rest = behind;
                visible += done.visible;
                add(&mut raster, &done.raster);
                passes.extend(done.passes);
            }
            Err(Reason::TooLarge) if ids.len() > LEAST => most = ids.len().div_ceil(2),
            Err(Reason::TooLong) if ids.len() > MOST_OF_A_TILE as usize => most = MOST_OF_A_TILE as usize,
            Err(reason) => return Ok(Err(reason)),
        }
    }
    *accumulator = begun;
    Ok(Ok(Chained { visible, raster, opaque: None, passes }))
}

/// Counts of what goes through the same memory one after the other.
pub(super) fn add(sum: &mut RasterCounts, part: &RasterCounts) {
    sum.splats += part.splats;
    sum.tile_entries += part.tile_entries;
    sum.fragments += part.fragments;
    sum.bytes = sum.bytes.max(part.bytes);
}
