//! Bands of rows: each has the list of the pieces that it meets, and a depth buffer of its own.

use super::crossing::{Crossing, Plane};
use super::piece::Piece;
use super::view::Meshes;
use crate::{Error, Progress};
use rayon::prelude::*;

/// Rows of a band.
pub(super) const ROWS: usize = 16;

/// Triangles that are clipped by one task.
const CHUNK: usize = 1 << 12;

/// Depth of each pixel, and what `keep` makes of the nearest triangle there; +∞ and `none` where there is none.
pub(super) fn resolve<T: Copy + Send>(
    meshes: &Meshes<'_>,
    none: T,
    keep: impl Fn(u32, u32, &Crossing) -> T + Sync,
    progress: Option<&Progress>,
) -> Result<(Vec<f32>, Vec<T>), Error> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let [width, height] = meshes.camera.size.map(|s| s as usize);
    let found = Found::new(meshes);
    progress.add_total(height.div_ceil(ROWS) as u64);
    let mut depth = vec![f32::INFINITY; width * height];
    let mut kept = vec![none; width * height];
    let bands = depth.par_chunks_mut(width * ROWS).zip(kept.par_chunks_mut(width * ROWS)).enumerate();
    bands.for_each(|(b, (depth, kept))| {
        if progress.tick(1).is_err() {
            return;
        }
        let mut nearest = vec![f64::INFINITY; depth.len()];
        found.meet(meshes, b, |k, (_, piece), at| {
            if at.depth < nearest[k] {
                (nearest[k], kept[k]) = (at.depth, keep(piece.mesh, piece.triangle, at));
            }
        });
        depth.iter_mut().zip(nearest).for_each(|(to, nearest)| *to = nearest as f32);
    });
    progress.tick(0)?;
    Ok((depth, kept))
}

/// What bands of rows meet of the triangles.
pub(super) struct Found {
    pieces: Vec<Piece>,
    lists: Lists,
}

impl Found {
    pub(super) fn new(meshes: &Meshes<'_>) -> Self {
        let pieces = pieces(meshes);
        Self { lists: Lists::new(&pieces, meshes.camera.size[1]), pieces }
    }

    /// Hands on all that rays of a band meet, triangle by triangle in their order: the pixel in the band, the piece of a triangle and its rank, the place.
    #[inline]
    pub(super) fn meet(
        &self,
        meshes: &Meshes<'_>,
        band: usize,
        mut hand_on: impl FnMut(usize, (u32, &Piece), &Crossing),
    ) {
        let [width, height] = meshes.camera.size;
        for id in self.lists.in_band(band) {
            let piece = &self.pieces[*id as usize];
            let plane = Plane::new(meshes, meshes.triangle(piece.mesh, piece.triangle));
            let rows = piece.rows(height);
            for y in rows.start.max(band * ROWS)..rows.end.min((band + 1) * ROWS) {
                for x in piece.span(y, width) {
                    hand_on((y - band * ROWS) * width as usize + x, (*id, piece), &plane.at([x, y]));
                }
            }
        }
    }

    /// How many of them there are in a band.
    pub(super) fn count(&self, meshes: &Meshes<'_>, band: usize) -> u64 {
        let [width, height] = meshes.camera.size;
        let rows = |piece: &Piece| {
            let rows = piece.rows(height);
            rows.start.max(band * ROWS)..rows.end.min((band + 1) * ROWS)
        };
        let of_piece = |piece: &Piece| rows(piece).map(|y| piece.span(y, width).len() as u64).sum::<u64>();
        self.lists.in_band(band).iter().map(|id| of_piece(&self.pieces[*id as usize])).sum()
    }
}

/// All pieces of all triangles, in their order.
fn pieces(meshes: &Meshes<'_>) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (mesh, triangles) in meshes.triangles.iter().enumerate() {
        let chunk = |(chunk, triangles): (usize, &[[u32; 3]])| {
            let mut of_chunk = Vec::new();
            (0..triangles.len())
                .for_each(|k| Piece::push(meshes, mesh as u32, (chunk * CHUNK + k) as u32, &mut of_chunk));
            of_chunk
        };
        let chunks: Vec<Vec<Piece>> = triangles.par_chunks(CHUNK).enumerate().map(chunk).collect();
        chunks.into_iter().for_each(|mut of_chunk| pieces.append(&mut of_chunk));
    }
    pieces
}

/// Pieces by band, in their order.
struct Lists {
    starts: Vec<usize>,
    ids: Vec<u32>,
}

impl Lists {
    fn new(pieces: &[Piece], height: u32) -> Self {
        let bands = |piece: &Piece| {
            let rows = piece.rows(height);
            rows.start / ROWS..(rows.end - 1) / ROWS + 1
        };
        // starts[b + 1] first counts, then is the running end of band b.
        let mut starts = vec![0; (height as usize).div_ceil(ROWS) + 2];
        pieces.iter().flat_map(bands).for_each(|b| starts[b + 2] += 1);
        (2..starts.len()).for_each(|b| starts[b] += starts[b - 1]);
        let mut ids = vec![0; starts[starts.len() - 1]];
        for (id, piece) in (0..).zip(pieces) {
            for b in bands(piece) {
                ids[starts[b + 1]] = id;
                starts[b + 1] += 1;
            }
        }
        Self { starts, ids }
    }

    fn in_band(&self, band: usize) -> &[u32] {
        &self.ids[self.starts[band]..self.starts[band + 1]]
    }
}
