//! Tile lists: for each square of the image the segments of eight voxels in a row whose footprints may reach it.
//!
//! A list entry for eight voxels rather than one: lists take a bit more than half a byte a voxel, and are made in a time that
//! hardly counts. Rows of the lattice are listed in chunks of fixed size, each with its own lists; a tile's list is the
//! concatenation of those of all chunks. So nothing depends on the number of threads.

use super::viewed::Viewed;
use crate::image_aligned::tile::size::TILE;
use crate::shared::slabs::Slabs;
use crate::shared::voxels::{SEGMENT, Voxels};
use rayon::prelude::*;
use splat_core::glam::Vec3;

/// Planes of the lattice in a chunk.
const PLANES: usize = 4;

/// Bits of the place of a segment in its row: 2^16 voxels.
const PLACE_BITS: u32 = 13;

/// Segments by tile.
#[derive(Debug, Clone, Default)]
pub(crate) struct Segments {
    chunks: Vec<Chunk>,
    rows: usize,
}

/// Lists of one chunk in CSR form.
#[derive(Debug, Clone)]
struct Chunk {
    starts: Vec<u32>,
    /// Row within the chunk, and place in the row.
    entries: Vec<u32>,
}

/// Eight voxels in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Segment {
    pub(crate) eighth: usize,
    pub(crate) j: usize,
    pub(crate) k: usize,
}

impl Segments {
    /// Lists for an image of `tiles` columns and rows of tiles.
    pub(crate) fn new(viewed: &Viewed, slabs: &Slabs, voxels: &Voxels, dims: [usize; 3], tiles: [usize; 2]) -> Self {
        let chunk =
            |c: usize| Chunk::new(viewed, slabs, voxels, dims, tiles, c * PLANES..dims[2].min((c + 1) * PLANES));
        Self { chunks: (0..dims[2].div_ceil(PLANES)).into_par_iter().map(chunk).collect(), rows: dims[1] }
    }

    /// Segments of a tile, in the order of the lattice.
    pub(crate) fn tile(&self, t: usize) -> impl Iterator<Item = Segment> {
        let rows = self.rows;
        self.chunks.iter().enumerate().flat_map(move |(c, chunk)| {
            chunk.entries[chunk.starts[t] as usize..chunk.starts[t + 1] as usize].iter().map(move |entry| {
                let row = (entry >> PLACE_BITS) as usize;
                Segment {
                    eighth: (entry & ((1 << PLACE_BITS) - 1)) as usize,
                    j: row % rows,
                    k: c * PLANES + row / rows,
                }
            })
        })
    }

    /// Bytes of all lists.
    pub(crate) fn bytes(&self) -> u64 {
        self.chunks.iter().map(|c| 4 * (c.starts.len() + c.entries.len()) as u64).sum()
    }
}

impl Chunk {
    fn new(
        viewed: &Viewed,
        slabs: &Slabs,
        voxels: &Voxels,
        dims: [usize; 3],
        tiles: [usize; 2],
        planes: std::ops::Range<usize>,
    ) -> Self {
        let mut found = Vec::new();
        for (row, (k, j)) in planes.flat_map(|k| (0..dims[1]).map(move |j| (k, j))).enumerate() {
            for eighth in (0..dims[0].div_ceil(SEGMENT)).filter(|e| voxels.eight(*e, j, k) != 0) {
                let reached = tiles_of(viewed, slabs, Segment { eighth, j, k }, tiles);
                found.extend(reached.map(|reached| ((row as u32) << PLACE_BITS | eighth as u32, reached)));
            }
        }
        let each = |[first, last]: [[u16; 2]; 2]| {
            let row = move |y: u16| (first[0]..=last[0]).map(move |x| usize::from(y) * tiles[0] + usize::from(x));
            (first[1]..=last[1]).flat_map(row)
        };
        // starts[t + 2] first counts, then starts[t + 1] is the running end of tile t.
        let mut starts = vec![0u32; tiles[0] * tiles[1] + 2];
        found.iter().flat_map(|(_, reached)| each(*reached)).for_each(|t| starts[t + 2] += 1);
        (2..starts.len()).for_each(|t| starts[t] += starts[t - 1]);
        let mut entries = vec![0; starts.last().map_or(0, |n| *n as usize)];
        for (entry, reached) in found {
            for t in each(reached) {
                entries[starts[t + 1] as usize] = entry;
                starts[t + 1] += 1;
            }
        }
        starts.pop();
        Self { starts, entries }
    }
}

/// First and last tile that a segment may reach.
#[inline(always)]
fn tiles_of(viewed: &Viewed, slabs: &Slabs, segment: Segment, tiles: [usize; 2]) -> Option<[[u16; 2]; 2]> {
    let Segment { eighth, j, k } = segment;
    let first = viewed.position(eighth * SEGMENT, j, k);
    let ends = [first, first + viewed.axes.x_axis * (SEGMENT - 1) as f64];
    let far = slabs.width * f64::from(slabs.count);
    // Depths are rounded to a phase.
    let nearest = ends[0].z.min(ends[1].z) - slabs.width;
    if viewed.scale(ends[0].z.max(ends[1].z) + slabs.width).is_none() || nearest > far {
        return None;
    }
    let everywhere = Some([[0; 2], tiles.map(|n| (n - 1) as u16)]);
    let Some(scale) = viewed.scale(nearest) else {
        return everywhere;
    };
    // One pixel for neighbours of gradients, one for rounding.
    let half = viewed.footprint(scale).half.map(|h| h + 2.0);
    let mut low = [f32::INFINITY; 2];
    let mut high = [f32::NEG_INFINITY; 2];
    for end in ends {
        let Some(scale) = viewed.scale(end.z) else {
            return everywhere;
        };
        let pixel: [f32; 2] = viewed.pixel(Vec3::new(end.x as f32, end.y as f32, 0.0), scale as f32);
        (0..2).for_each(|a| {
            low[a] = low[a].min(pixel[a] - half[a]);
            high[a] = high[a].max(pixel[a] + half[a]);
        });
    }
    let inside = |a: usize| high[a] >= 0.0 && low[a] < (tiles[a] * TILE) as f32;
    (inside(0) && inside(1)).then(|| {
        let tile = |v: f32, a: usize| ((v.max(0.0) / TILE as f32) as usize).min(tiles[a] - 1) as u16;
        [[tile(low[0], 0), tile(low[1], 1)], [tile(high[0], 0), tile(high[1], 1)]]
    })
}
