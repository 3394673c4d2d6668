//! Tile lists: for each square of the image the splats that reach it, in list order.
//!
//! Splats are binned in chunks of fixed size, each with its own lists; a tile's list is the lists of all chunks one
//! after the other. So chunks are binned in parallel without a shared buffer, and the order never depends on threads.

use super::projected::{Coverage, Projected};
use rayon::prelude::*;

/// Side of a tile, pixels.
pub const TILE: usize = 32;

/// Splats binned by one task.
const CHUNK: usize = 1 << 15;

/// Tile lists of all chunks: tiles row by row from the top left.
#[derive(Debug, Clone)]
pub struct Bins {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    chunks: Vec<ChunkLists>,
}

/// Tile lists of one chunk in CSR form.
#[derive(Debug, Clone)]
struct ChunkLists {
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// Splats that reach any tile.
    splats: u64,
}

impl Bins {
    /// The splats of tile `t` in list order, as ids, a slice a chunk.
    ///
    /// # Panics
    /// If there is no tile `t`, as for all that ask for one.
    pub fn tile(&self, t: usize) -> impl Iterator<Item = &[u32]> {
        self.chunks.iter().map(move |c| &c.entries[c.starts[t] as usize..c.starts[t + 1] as usize])
    }

    /// True when no splat reaches tile `t`.
    pub fn is_empty(&self, t: usize) -> bool {
        self.tile(t).all(<[u32]>::is_empty)
    }

    /// First pixel of tile `t`.
    pub fn corner(&self, t: usize) -> [usize; 2] {
        [t % self.columns * TILE, t / self.columns * TILE]
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    /// Entries of all lists.
    pub fn entries(&self) -> u64 {
        self.chunks.iter().map(|c| c.entries.len() as u64).sum()
    }

    /// Splats that reach any tile.
    pub fn splats(&self) -> u64 {
        self.chunks.iter().map(|c| c.splats).sum()
    }

    /// Bytes of all lists.
    pub fn bytes(&self) -> u64 {
        self.chunks.iter().map(|c| 4 * (c.entries.len() + c.starts.len()) as u64).sum()
    }
}

/// Bins the splats `ids`, in that order.
///
/// # Panics
/// If an id is not below the number of projected splats.
pub fn bin(projected: &Projected, ids: &[u32]) -> Bins {
    let bounds = |id: u32| projected.splats[id as usize].bounds(projected.size);
    bin_by(projected.size, ids, |id| projected.coverage[id as usize], bounds)
}

/// Bins what lies in rectangles of pixels [x0, x1, y0, y1) of an image of `size`, given by id; an empty rectangle is in no tile.
pub fn bin_rectangles(size: [u32; 2], ids: &[u32], rectangle: impl Fn(u32) -> [u32; 4] + Sync) -> Bins {
    bin_by(size, ids, |id| Coverage::from_bounds(rectangle(id)), &rectangle)
}

fn bin_by(
    size: [u32; 2],
    ids: &[u32],
    coverage: impl Fn(u32) -> Coverage + Sync,
    bounds: impl Fn(u32) -> [u32; 4] + Sync,
) -> Bins {
    let [columns, rows] = size.map(|s| (s as usize).div_ceil(TILE));
    let chunk = |ids: &[u32]| {
        // One loop that waits for nothing but memory: the splats lie far apart.
        let coverage: Vec<Coverage> = ids.iter().map(|&i| coverage(i)).collect();
        bin_chunk(ids, &coverage, columns, columns * rows, &bounds)
    };
    let chunks = ids.par_chunks(CHUNK).map(chunk).collect();
    Bins { columns, rows, chunks }
}

fn bin_chunk(
    ids: &[u32],
    coverage: &[Coverage],
    columns: usize,
    tiles: usize,
    bounds: &impl Fn(u32) -> [u32; 4],
) -> ChunkLists {
    // starts[t + 1] first counts, then is the end of the tile before, then the running end of tile t.
    let mut starts = vec![0u32; tiles + 2];
    let mut splats = 0;
    for (&coverage, &id) in coverage.iter().zip(ids) {
        splats += u64::from(coverage != Coverage::NONE);
        for_each_tile(coverage, || bounds(id), columns, |t| starts[t + 2] += 1);
    }
    for t in 2..starts.len() {
        starts[t] += starts[t - 1];
    }
    let mut entries = vec![0u32; starts[tiles + 1] as usize];
    for (&coverage, &id) in coverage.iter().zip(ids) {
        for_each_tile(
            coverage,
            || bounds(id),
            columns,
            |t| {
                entries[starts[t + 1] as usize] = id;
                starts[t + 1] += 1;
            },
        );
    }
    starts.pop();
    ChunkLists { starts, entries, splats }
}

#[inline(always)]
fn for_each_tile(coverage: Coverage, bounds: impl FnOnce() -> [u32; 4], columns: usize, mut visit: impl FnMut(usize)) {
    if coverage == Coverage::NONE {
        return;
    }
    let [first, last] = coverage.tiles(bounds);
    for row in first[1]..=last[1] {
        for column in first[0]..=last[0] {
            visit(row * columns + column);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_splat_is_listed_once_in_each_tile_that_it_touches() {
        let bounds = [[0, 1, 0, 1], [31, 33, 0, 1], [0, 0, 0, 0], [0, 64, 0, 64]];
        let coverage = bounds.map(Coverage::from_bounds).to_vec();
        let projected = Projected { coverage, size: [64, 64], ..Projected::default() };
        let bins = bin(&projected, &[3, 0, 2, 1]);
        let lists: Vec<Vec<u32>> = (0..bins.tiles()).map(|t| bins.tile(t).flatten().copied().collect()).collect();
        assert_eq!(lists, [vec![3, 0, 1], vec![3, 1], vec![3], vec![3]]);
        assert_eq!((bins.entries(), bins.splats()), (7, 3));
    }
}
