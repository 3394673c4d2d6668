//! Triangles in the picture, by whole numbers: which pixels' middles lie inside, decided without rounding.
//!
//! Corners are multiples of 1/4096 pixel at most 2¹⁷ pixels from the corner of the picture, so coordinates take 30 bits and the cross
//! products of their differences 62.

use super::clip::{GUARD, clip};
use super::view::Meshes;
use glam::DVec3;
use std::ops::Range;

/// Bits behind the point.
const BITS: u32 = 12;

/// Units of a pixel.
const PIXEL: i64 = 1 << BITS;

/// One triangle that is left of a clipped one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) mesh: u32,
    pub(super) triangle: u32,
    /// x to the right, y down from the picture's corner, such that the cross product of the first two edges is above 0.
    corners: [[i32; 2]; 3],
}

impl Piece {
    /// Appends what of a triangle may cover a pixel of the picture.
    pub(super) fn push(meshes: &Meshes<'_>, mesh: u32, triangle: u32, to: &mut Vec<Self>) {
        let polygon = clip(meshes, meshes.triangle(mesh, triangle));
        let mut corners = polygon.corners().iter().map(|p| snapped(meshes, *p));
        let (Some(first), Some(mut second)) = (corners.next(), corners.next()) else { return };
        for third in corners {
            let area = cross(first, second, third);
            let corners = if area < 0 { [first, third, second] } else { [first, second, third] };
            let piece = Self { mesh, triangle, corners };
            if area != 0
                && !piece.rows(meshes.camera.size[1]).is_empty()
                && !piece.columns(meshes.camera.size[0]).is_empty()
            {
                to.push(piece);
            }
            second = third;
        }
    }

    /// Rows of pixels whose middles lie between the uppermost and the lowest corner.
    pub(super) fn rows(&self, height: u32) -> Range<usize> {
        self.middles(1, height)
    }

    fn columns(&self, width: u32) -> Range<usize> {
        self.middles(0, width)
    }

    fn middles(&self, axis: usize, size: u32) -> Range<usize> {
        let [a, b, c] = self.corners.map(|corner| i64::from(corner[axis]));
        let low = a.min(b).min(c);
        let high = a.max(b).max(c);
        // Pixel n has its middle at n + 1/2.
        let first = (low - PIXEL / 2).div_ceil_euclid(PIXEL).max(0);
        let end = ((high - PIXEL / 2).div_euclid(PIXEL) + 1).min(i64::from(size));
        first as usize..(end.max(first)) as usize
    }

    /// Columns of a row whose middles are inside.
    pub(super) fn span(&self, row: usize, width: u32) -> Range<usize> {
        let y = row as i64 * PIXEL + PIXEL / 2;
        let mut first = 0;
        let mut end = i64::from(width);
        for k in 0..3 {
            let [a, b] = [self.corners[k], self.corners[(k + 1) % 3]].map(|corner| corner.map(i64::from));
            let dx = b[0] - a[0];
            let dy = b[1] - a[1];
            // To the right of an edge upwards, or below one to the right: a middle on it is inside.
            let least = if dy < 0 || (dy == 0 && dx > 0) { 0 } else { 1 };
            // Above or at `least` where the place is inside; at column 0, and what each further column takes away.
            let here = dx * (y - a[1]) - dy * (PIXEL / 2 - a[0]);
            let step = dy * PIXEL;
            match step.signum() {
                0 if here < least => end = first,
                0 => {}
                1 => end = end.min((here - least).div_euclid(step) + 1),
                _ => first = first.max((least - here).div_ceil_euclid(-step)),
            }
        }
        first as usize..end.max(first) as usize
    }
}

trait CeilingDivision {
    /// The quotient by what is above 0, rounded up.
    fn div_ceil_euclid(self, by: Self) -> Self;
}

impl CeilingDivision for i64 {
    fn div_ceil_euclid(self, by: Self) -> Self {
        -(-self).div_euclid(by)
    }
}

/// Place of a clipped corner in the picture.
fn snapped(meshes: &Meshes<'_>, p: DVec3) -> [i32; 2] {
    let scale = if meshes.camera.is_orthographic() { meshes.focal } else { meshes.focal / p.z };
    let [width, height] = meshes.camera.size.map(|s| 0.5 * f64::from(s));
    let place = |middle: f64, offset: f64| {
        let pixels = middle + offset.clamp(-GUARD, GUARD);
        (pixels * PIXEL as f64 + 0.5).floor() as i32
    };
    [place(width, p.x * scale), place(height, -p.y * scale)]
}

/// Twice the area of a triangle, above 0 where its corners run clockwise as they are seen.
fn cross(a: [i32; 2], b: [i32; 2], c: [i32; 2]) -> i64 {
    let [a, b, c] = [a, b, c].map(|corner| corner.map(i64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng;

    fn is_inside(piece: &Piece, x: i64, y: i64) -> bool {
        let middle = [x, y].map(|v| i128::from(v * PIXEL + PIXEL / 2));
        (0..3).all(|k| {
            let [a, b] = [piece.corners[k], piece.corners[(k + 1) % 3]].map(|c| c.map(i128::from));
            let dx = b[0] - a[0];
            let dy = b[1] - a[1];
            let side = dx * (middle[1] - a[1]) - dy * (middle[0] - a[0]);
            side > 0 || (side == 0 && (dy < 0 || (dy == 0 && dx > 0)))
        })
    }

    /// Spans are those of each pixel by itself, in 128 bits: slivers, corners on middles, and corners as far away as there are any.
    #[test]
    fn hv11_spans_are_those_of_exact_edge_functions() {
        let width = 24;
        let height = 16;
        for item in 0..3000u64 {
            let unit = |n: u64| rng::unit(11, 0, item, n);
            let corner = |n: u64| -> [i32; 2] {
                let reach = [40.0, 40.0, 1e5][(item % 3) as usize];
                let at = [unit(2 * n), unit(2 * n + 1)].map(|u| (u - 0.4) * reach);
                // Every second one on corners and middles of pixels.
                let grid = if item % 2 == 0 { 2048.0 } else { 1.0 };
                at.map(|v| ((v * 4096.0 / grid).round() * grid) as i32)
            };
            let [a, b, mut c] = [corner(0), corner(1), corner(2)];
            if item % 5 == 0 {
                c = [b[0] + 1, b[1]];
            }
            if cross(a, b, c) == 0 {
                continue;
            }
            let corners = if cross(a, b, c) < 0 { [a, c, b] } else { [a, b, c] };
            let piece = Piece { mesh: 0, triangle: 0, corners };
            for y in 0..height {
                let rows = piece.rows(height as u32);
                let span = if rows.contains(&y) { piece.span(y, width) } else { 0..0 };
                for x in 0..width as usize {
                    let expected = is_inside(&piece, x as i64, y as i64);
                    assert_eq!(span.contains(&x), expected, "{corners:?}: {x}, {y}");
                }
            }
        }
    }
}
