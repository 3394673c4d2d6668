//! All triangles that the ray of a pixel meets, nearest first: a list a pixel (the A-buffer of Carpenter 1984, without coverage).
//!
//! Fragments are counted first, so the lists lie one after the other in memory that is taken once, and is refused before where it is too much.

use super::bands::{self, ROWS};
use super::crossing::Crossing;
use super::piece::Piece;
use super::view::Meshes;
use super::{PlacedMesh, TriangleHit};
use crate::{Camera, Error, Exceeded, Progress};
use rayon::prelude::*;

/// Where the ray through the middle of a pixel meets one of the triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleLayer {
    /// View depth, world units.
    pub depth: f32,
    /// As in [`super::DepthPlanes::slope`].
    pub slope: [f32; 2],
    /// The triangle.
    pub hit: TriangleHit,
}

/// What was kept of the triangles of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangleLayers<T> {
    /// Where the list of each pixel begins, row by row from the top left; and the end of the last.
    starts: Vec<u32>,
    layers: Vec<T>,
}

/// The lists of all pixels, one after the other.
pub struct LayerLists<T> {
    /// The first layer of each pixel, and the end of the last pixel.
    pub starts: Vec<u32>,
    /// Nearest first in each pixel.
    pub layers: Vec<T>,
}

impl<T> TriangleLayers<T> {
    /// Those of pixel `k`, nearest first; equally near ones in the order of meshes and triangles.
    #[inline]
    pub fn at_pixel(&self, k: usize) -> &[T] {
        &self.layers[self.starts[k] as usize..self.starts[k + 1] as usize]
    }

    /// The lists of all pixels.
    pub fn into_lists(self) -> LayerLists<T> {
        LayerLists { starts: self.starts, layers: self.layers }
    }

    /// Bytes of the lists.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.starts) + size_of_val(&*self.layers)) as u64
    }
}

/// Finds all triangles that rays meet before `hidden`, the view depth of what hides them at each pixel, or nothing; `keep` makes of each, and its
/// pixel, what is kept in the place of `none`. One tick a band of rows.
///
/// # Errors
/// As [`super::resolve`]; [`Error::Limit`] where the lists would take more than `most` bytes.
pub fn resolve_layers<T: Copy + Send + Sync>(
    meshes: &[PlacedMesh<'_>],
    camera: &Camera,
    hidden: &[f32],
    most: u64,
    none: T,
    keep: impl Fn(usize, &TriangleLayer) -> T + Sync,
    progress: Option<&Progress>,
) -> Result<TriangleLayers<T>, Error> {
    let meshes = &Meshes::new(meshes, camera)?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let [width, height] = camera.size.map(|s| s as usize);
    let found = bands::Found::new(meshes);
    progress.add_total(height.div_ceil(ROWS) as u64);
    let is_before = |k: usize, at: &Crossing| hidden.get(k).is_none_or(|hidden| at.depth < f64::from(*hidden));
    // starts[k + 1] first counts.
    let mut starts = vec![0u32; width * height + 1];
    starts[1..].par_chunks_mut(width * ROWS).enumerate().for_each(|(band, counts)| {
        let first = band * ROWS * width;
        found.meet(meshes, band, |k, _, at| counts[k] += u32::from(is_before(first + k, at)));
    });
    let total = starts.iter().map(|n| u64::from(*n)).sum::<u64>();
    let needed = (total * size_of::<T>() as u64).max(if total > u64::from(u32::MAX) { u64::MAX } else { 0 });
    let hint = "use fewer or smaller translucent meshes, a smaller picture, or fewer pixels of the light's";
    Exceeded::check("layers of translucent triangles", needed, most, "bytes", hint).map_err(Error::Limit)?;
    (1..starts.len()).for_each(|k| starts[k] += starts[k - 1]);
    let mut layers = vec![none; total as usize];
    let mut lists = Vec::new();
    let mut rest = &mut layers[..];
    for first in (0..width * height).step_by(width * ROWS) {
        let band_starts = &starts[first..=(first + width * ROWS).min(width * height)];
        let (list, behind) = rest.split_at_mut((band_starts[band_starts.len() - 1] - band_starts[0]) as usize);
        lists.push((band_starts, list));
        rest = behind;
    }
    lists.into_par_iter().enumerate().for_each(|(band, (starts, list))| {
        if progress.tick(1).is_err() || list.is_empty() {
            return;
        }
        let base = starts[0];
        let first = band * ROWS * width;
        let mut ends: Vec<u32> = starts[..starts.len() - 1].iter().map(|start| start - base).collect();
        // Depths in double precision, and the order of equal ones.
        let mut met = vec![(f64::INFINITY, 0u32, none); list.len()];
        found.meet(meshes, band, |k, (id, piece), at| {
            if is_before(first + k, at) {
                met[ends[k] as usize] = (at.depth, id, keep(first + k, &layer(piece, at)));
                ends[k] += 1;
            }
        });
        for pixel in starts.windows(2) {
            let of_pixel = &mut met[(pixel[0] - base) as usize..(pixel[1] - base) as usize];
            of_pixel.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        }
        list.iter_mut().zip(met).for_each(|(to, (.., kept))| *to = kept);
    });
    progress.tick(0)?;
    Ok(TriangleLayers { starts, layers })
}

/// How many triangles the rays of all pixels meet: as long are the lists of [`resolve_layers`] together, where nothing hides any.
///
/// # Errors
/// As [`super::resolve`].
pub fn count_layers(meshes: &[PlacedMesh<'_>], camera: &Camera) -> Result<u64, Error> {
    let meshes = &Meshes::new(meshes, camera)?;
    let found = bands::Found::new(meshes);
    Ok((0..(camera.size[1] as usize).div_ceil(ROWS)).into_par_iter().map(|band| found.count(meshes, band)).sum())
}

fn layer(piece: &Piece, at: &Crossing) -> TriangleLayer {
    let [_, b, c] = at.barycentric.map(|v| v as f32);
    let hit = TriangleHit { mesh: piece.mesh, triangle: piece.triangle, barycentric: [b, c] };
    TriangleLayer { depth: at.depth as f32, slope: at.slope.map(|s| s as f32), hit }
}
