//! Tiles, and the picture that they make.

use super::{Averaged, Opaque, memory};
use rayon::prelude::*;
use splat_core::raster::bins::{Bins, TILE};
use splat_core::raster::tile::{AREA, for_each_span};
use splat_core::raster::{OpaqueImage, RasterCounts};

/// Planes of `AREA` numbers.
pub(super) struct Tile {
    /// Infinite where no disc is.
    pub(super) depth: Vec<f32>,
    /// Rank of the nearest disc, `u32::MAX` where there is none.
    pub(super) disc: Vec<u32>,
    /// Channel by channel.
    pub(super) channels: Vec<f32>,
    pub(super) fragments: u64,
}

impl Tile {
    pub(super) fn new(channels: usize) -> Self {
        let depth = vec![f32::INFINITY; AREA];
        let disc = vec![u32::MAX; AREA];
        Self { depth, disc, channels: vec![0.0; AREA * channels], fragments: 0 }
    }
}

/// The picture of all tiles.
pub(super) fn assemble(input: &Averaged<'_>, tiles: &[Option<Tile>], bins: &Bins) -> Opaque {
    let discs = input.discs;
    let pixels = discs.size.iter().map(|s| *s as usize).product();
    let mut depth = vec![f32::INFINITY; pixels];
    let mut disc = vec![u32::MAX; pixels];
    let mut channels = vec![vec![0.0; pixels]; input.channels as usize];
    copy(tiles, discs.size, &mut depth, |tile| &tile.depth);
    copy(tiles, discs.size, &mut disc, |tile| &tile.disc);
    for (c, plane) in channels.iter_mut().enumerate() {
        copy(tiles, discs.size, plane, |tile| &tile.channels[c * AREA..][..AREA]);
    }
    let object = |&rank: &u32| discs.looks.get(rank as usize).map_or(u32::MAX, |look| look.object);
    let object = if input.objects { disc.par_iter().map(object).collect() } else { Vec::new() };
    disc.par_iter_mut().for_each(|disc| *disc = discs.ids.get(*disc as usize).map_or(u32::MAX, |place| *place));
    let counts = RasterCounts {
        splats: bins.splats(),
        tile_entries: bins.entries(),
        fragments: tiles.iter().flatten().map(|tile| tile.fragments).sum(),
        bytes: memory::bytes(input, bins),
    };
    Opaque { image: OpaqueImage { depth, channels, object }, disc, counts }
}

/// A plane of the picture, a row of tiles by a task.
fn copy<T: Copy + Send + Sync>(
    tiles: &[Option<Tile>],
    size: [u32; 2],
    plane: &mut [T],
    part: impl Fn(&Tile) -> &[T] + Sync,
) {
    let [width, _] = size;
    let row = width as usize;
    let bands = plane.par_chunks_mut(TILE * row).zip(tiles.par_chunks(row.div_ceil(TILE)));
    bands.for_each(|(band, tiles)| {
        let size = [width, (band.len() / row) as u32];
        for (column, tile) in tiles.iter().enumerate() {
            if let Some(part) = tile.as_ref().map(&part) {
                for_each_span(size, column * TILE, 0, |from, to| band[to].copy_from_slice(&part[from]));
            }
        }
    });
}
