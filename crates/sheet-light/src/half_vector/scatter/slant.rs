//! How much of the stairs that cells make of a surface is its area.
//!
//! What is open to the sides is the area of cells' faces. A surface of normal n has, of an area of 1, |n_x| + |n_y| + |n_z| of such faces:
//! a ball has half as much again as its surface, and would lose half as much light again. Along the light streams leave without
//! stairs, |n_z|, so the sides are left with (1 − |n_z|)/(|n_x| + |n_y|) of theirs. The normal is the gradient of the media about a cell.
//!
//! Streams and diffusion keep light in for too long besides, so the root of that share is taken, which is what paths say: with the whole
//! of it clouds are 9 to 30 % too bright, with none 3 to 22 % too dark
//! (`clouds_that_scatter_again_and_again_come_near_path_tracing`).

use super::streams::{Sources, transport};

/// Weights of the means that gradients are taken of: over a cell on either side.
pub(crate) const WEIGHTS: [f64; 2] = [0.5, 0.25];

/// Share of the sides' area, by cell.
pub(super) fn shares(sources: &Sources<'_>) -> Vec<f64> {
    let [width, height] = sources.grid.columns;
    let layers = sources.grid.layers;
    let lines = [(width, 1), (height, layers * width), (layers, width)];
    let mut media: Vec<f64> = sources.cells.iter().map(|cell| transport(cell, sources.channel)).collect();
    let mut line = Vec::new();
    for (count, step) in lines {
        for start in (0..media.len()).filter(|number| (number / step).is_multiple_of(count)) {
            line.clear();
            line.extend((0..count).map(|i| media[start + i * step]));
            let number = |i: Option<usize>| i.and_then(|i| line.get(i)).copied().unwrap_or(0.0);
            for i in 0..count {
                let beside = |n: usize| WEIGHTS[n] * (number(i.checked_sub(n)) + number(Some(i + n)));
                media[start + i * step] = WEIGHTS[0] * line[i] + (1..WEIGHTS.len()).map(beside).sum::<f64>();
            }
        }
    }
    let share = |cell: usize| {
        let spread = sources.grid.spread((cell / width % layers) as f64 + 0.5);
        let sizes = [sources.grid.step[0] * spread, sources.grid.step[1] * spread, sources.grid.depth];
        let slope = |a: usize| {
            let (count, step) = lines[a];
            let i = cell / step % count;
            let before = if i > 0 { media[cell - step] } else { 0.0 };
            let behind = if i + 1 < count { media[cell + step] } else { 0.0 };
            (behind - before) / sizes[a]
        };
        of_normal([0, 1, 2].map(slope))
    };
    (0..media.len()).map(share).collect()
}

/// √((1 − |n_z|)/(|n_x| + |n_y|)) for a gradient; 1 without any.
pub(crate) fn of_normal(gradient: [f64; 3]) -> f64 {
    let [x, y, z] = gradient.map(f64::abs);
    let length = libm::sqrt(x * x + y * y + z * z);
    let sides = x + y;
    // √(x² + y² + z²) − z without the digits that cancel.
    if sides > 0.0 { libm::sqrt((x * x + y * y) / ((length + z) * sides)) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_along_the_cells_keep_their_area_and_stairs_lose_what_is_not_the_surface_s() {
        assert_eq!((of_normal([3.0, 0.0, 0.0]), of_normal([0.0, -1.0, 0.0]), of_normal([0.0; 3])), (1.0, 1.0, 1.0));
        let root = 2f64.sqrt();
        let square = |gradient: [f64; 3]| of_normal(gradient).powi(2);
        assert!((square([1.0, 1.0, 0.0]) - 1.0 / root).abs() < 1e-12);
        assert!((square([1.0, 0.0, 1.0]) - (root - 1.0)).abs() < 1e-12);
        assert!((square([1e-9, 0.0, 1.0]) - 0.5e-9).abs() < 1e-15);
    }
}
