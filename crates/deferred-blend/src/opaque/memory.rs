//! Predicts the memory of a picture before it is allocated.

use super::{Averaged, Scratch};
use crate::Error;
use crate::disc::Disc;
use rayon::prelude::*;
use splat_core::Exceeded;
use splat_core::raster::bins::{Bins, TILE, bin_rectangles};
use splat_core::raster::tile::{AREA, BLOCKS};

/// Lists of tiles, if there is memory for all that follows.
pub(super) fn bin(input: &Averaged<'_>) -> Result<Bins, Error> {
    let discs = input.discs;
    let tiles = |low: u32, high: u32| u64::from(high.div_ceil(TILE as u32).saturating_sub(low / TILE as u32));
    let tile_count = |disc: &Disc| {
        let [x0, x1, y0, y1] = disc.pixels;
        tiles(x0, x1) * tiles(y0, y1)
    };
    let entries: u64 = discs.discs.par_iter().with_min_len(4096).map(tile_count).sum();
    afford(input, 4 * entries)?;
    let mut ranks: Vec<u32> = (0..discs.discs.len() as u32).collect();
    // By place in the cloud, so that the order of the discs does not matter.
    if !discs.ids.is_sorted() {
        ranks.par_sort_unstable_by_key(|&i| discs.ids[i as usize]);
    }
    let bins = bin_rectangles(discs.size, &ranks, |i| discs.discs[i as usize].pixels);
    afford(input, lists_bytes(&bins))?;
    Ok(bins)
}

/// Bytes of all that is made.
pub(super) fn bytes(input: &Averaged<'_>, bins: &Bins) -> u64 {
    picture_bytes(input) + lists_bytes(bins)
}

/// Lists of tiles, and of the blocks of the longest one in every thread, at most.
fn lists_bytes(bins: &Bins) -> u64 {
    let lengths = (0..bins.tiles()).map(|t| bins.tile(t).map(<[u32]>::len).sum::<usize>());
    bins.bytes() + (rayon::current_num_threads() * 4 * BLOCKS * lengths.max().unwrap_or(0)) as u64
}

/// The picture, its tiles, and the images of groups in every thread.
fn picture_bytes(input: &Averaged<'_>) -> u64 {
    let [width, height] = input.discs.size.map(u64::from);
    let tiles = width.div_ceil(TILE as u64) * height.div_ceil(TILE as u64);
    let planes = u64::from(input.channels) + 2;
    let picture = width * height * 4 * (planes + u64::from(input.objects)) + tiles * AREA as u64 * 4 * planes;
    picture + rayon::current_num_threads() as u64 * Scratch::bytes(input)
}

fn afford(input: &Averaged<'_>, lists: u64) -> Result<(), Error> {
    let needed = picture_bytes(input) + lists;
    if needed <= input.max_bytes {
        return Ok(());
    }
    let what = "an image of opaque discs".into();
    let limit = Some(input.max_bytes);
    let hint = "make the image smaller, or the discs".into();
    Err(Error::Limit(Exceeded { what, needed, limit, unit: "bytes", hint }))
}
