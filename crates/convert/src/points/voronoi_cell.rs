//! The part of its tangent plane that a point owns, for eight points at once: area and farthest corner of its Voronoi cell.
//!
//! Cells tile, so areas sum to that of the surface. The bisector of a neighbour at q is the line x = q/2 + t·q⊥, and of another one at p it
//! keeps t·(q × p) ≤ ½ p·(p − q): every pair of neighbours bounds t on both lines, by one division and without a branch. Between its
//! bounds a line is a side of the cell, of the area ¼|q|²·Δt with the point. Lines at one place share that side: one has what is
//! before its middle, the other what is behind it.
//!
//! The square that holds a cell lies along the way to its nearest neighbour, so that cells turn with their points.

use crate::common::extremes::{greater, lesser};
use crate::points::neighbours::{Lanes, MAX_NEIGHBOURS, WIDTH};
use crate::points::tangent_plane::{Eight, Offset};
use splat_core::glam::{DVec2, DVec3};

/// Share of the way to a neighbour that lies in the plane from which on it has a direction there.
const FLAT: f64 = 0.5;

/// Half the side of the square that holds a cell, over the distance of the farthest neighbour. What lies within 0.5 is
/// known exactly; beyond, neighbours that were not asked for would cut too. Measured so that areas of scattered points
/// are right in the mean with ten neighbours.
const CELL_LIMIT: f64 = 0.56;

/// Sides of that square.
const SIDES: usize = 4;

/// A line that nothing bounds ends here, in its own length; squares are ordinary numbers.
const FAR: f32 = 1e15;

/// Squares and products of offsets that are 1 to 2 long at most, below which they count as nothing.
const NOTHING: f32 = 1e-30;

/// Cells of eight points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cells {
    pub(crate) area: Eight,
    /// Distances of the farthest corners.
    pub(crate) reach: Eight,
}

/// Lines in the planes of eight points, and the parts of them that are sides of cells.
pub(crate) struct Lines {
    q: [[Lanes; 2]; SIDES + MAX_NEIGHBOURS],
    low: [Lanes; SIDES + MAX_NEIGHBOURS],
    high: [Lanes; SIDES + MAX_NEIGHBOURS],
    count: usize,
    /// What lengths are counted in, a power of two for each point.
    unit: Eight,
    /// The two unit vectors of each plane.
    axes: [[DVec3; 2]; WIDTH],
}

/// The sides of the Voronoi cells of points among neighbours at `offsets` (near to far, at least one), in the planes across `normals`, within
/// squares of 0.56 times the farthest neighbour: at the rim of the points nothing else would end them.
#[inline(always)]
pub(crate) fn voronoi_sides(offsets: &[Offset], normals: &[DVec3; WIDTH]) -> Lines {
    let unit = units(&offsets[offsets.len() - 1]);
    let mut axes = [[DVec3::ZERO; 2]; WIDTH];
    let [mut u, mut v] = [[[0.0; WIDTH]; 3]; 2];
    for i in 0..WIDTH {
        axes[i] = axes_of(offsets, i, normals[i]);
        let [along, across] = axes[i];
        for a in 0..3 {
            // The unit is a power of two.
            (u[a][i], v[a][i]) = (along[a] / unit[i], across[a] / unit[i]);
        }
    }
    let mut lines = Lines::of_square(&offsets[offsets.len() - 1], unit, axes);
    for offset in offsets {
        let mut q = [[0.0; WIDTH]; 2];
        for i in 0..WIDTH {
            let [x, y, z] = [f64::from(offset[0][i]), f64::from(offset[1][i]), f64::from(offset[2][i])];
            q[0][i] = (x * u[0][i] + y * u[1][i] + z * u[2][i]) as f32;
            q[1][i] = (x * v[0][i] + y * v[1][i] + z * v[2][i]) as f32;
        }
        lines.add(q);
    }
    lines
}

/// Unit vectors across a normal, the first of them towards the nearest neighbour that has a direction in their plane.
#[inline(always)]
fn axes_of(offsets: &[Offset], i: usize, normal: DVec3) -> [DVec3; 2] {
    for offset in offsets {
        let to = DVec3::new(offset[0][i].into(), offset[1][i].into(), offset[2][i].into());
        let flat = to - normal * normal.dot(to);
        if flat.length_squared() > FLAT * FLAT * to.length_squared() {
            let along = flat.normalize();
            return [along, normal.cross(along)];
        }
    }
    // All neighbours are above the point or below it: the square alone is left, as large whichever way it lies.
    normal.any_orthonormal_pair().into()
}

/// A power of two for each point, such that its farthest neighbour is 1 to 2 away.
#[inline(always)]
fn units(farthest: &Offset) -> Eight {
    let mut units = [0.0; WIDTH];
    for i in 0..WIDTH {
        let [x, y, z] = [f64::from(farthest[0][i]), f64::from(farthest[1][i]), f64::from(farthest[2][i])];
        let length = (x * x + y * y + z * z).sqrt();
        units[i] = f64::from_bits(length.to_bits() & f64::INFINITY.to_bits());
    }
    units
}

impl Lines {
    #[inline(always)]
    fn of_square(farthest: &Offset, unit: Eight, axes: [[DVec3; 2]; WIDTH]) -> Self {
        let mut side = [0.0; WIDTH];
        for i in 0..WIDTH {
            let [x, y, z] = [f64::from(farthest[0][i]), f64::from(farthest[1][i]), f64::from(farthest[2][i])];
            side[i] = (2.0 * CELL_LIMIT * (x * x + y * y + z * z).sqrt() / unit[i]) as f32;
        }
        let mut lines = Self {
            q: [[[0.0; WIDTH]; 2]; SIDES + MAX_NEIGHBOURS],
            low: [[-0.5; WIDTH]; SIDES + MAX_NEIGHBOURS],
            high: [[0.5; WIDTH]; SIDES + MAX_NEIGHBOURS],
            count: SIDES,
            unit,
            axes,
        };
        for i in 0..WIDTH {
            (lines.q[0][0][i], lines.q[1][1][i]) = (side[i], side[i]);
            (lines.q[2][0][i], lines.q[3][1][i]) = (-side[i], -side[i]);
        }
        lines
    }

    /// Adds the bisectors of neighbours at `q`, which end other lines and are ended by them.
    #[inline(always)]
    fn add(&mut self, mut q: [Lanes; 2]) {
        for i in 0..WIDTH {
            // What lies above its point cuts nothing: it shares a side of the square.
            let is_above = q[0][i] * q[0][i] + q[1][i] * q[1][i] < NOTHING;
            (q[0][i], q[1][i]) = if is_above { (self.q[0][0][i], 0.0) } else { (q[0][i], q[1][i]) };
        }
        let [mut low, mut high] = [[-FAR; WIDTH], [FAR; WIDTH]];
        for other in 0..self.count {
            // Copies: a compiler cannot see that lines of two indices lie apart.
            let p = self.q[other];
            let mut p_low = self.low[other];
            let mut p_high = self.high[other];
            for i in 0..WIDTH {
                let dx = q[0][i] - p[0][i];
                let dy = q[1][i] - p[1][i];
                let cross = p[0][i] * dy - p[1][i] * dx;
                let cross = if cross.abs() < NOTHING { NOTHING } else { cross };
                let half = 0.5 / cross;
                let on_p = (q[0][i] * dx + q[1][i] * dy) * half;
                let on_q = (p[0][i] * dx + p[1][i] * dy) * half;
                let is_left = cross > 0.0;
                low[i] = greater(low[i], if is_left { on_q } else { -FAR });
                high[i] = lesser(high[i], if is_left { FAR } else { on_q });
                p_low[i] = greater(p_low[i], if is_left { -FAR } else { on_p });
                p_high[i] = lesser(p_high[i], if is_left { on_p } else { FAR });
            }
            (self.low[other], self.high[other]) = (p_low, p_high);
        }
        (self.q[self.count], self.low[self.count], self.high[self.count]) = (q, low, high);
        self.count += 1;
    }

    /// What lies at a place of the plane of point `i`, from the point.
    pub(crate) fn in_space(&self, i: usize, place: DVec2) -> DVec3 {
        self.axes[i][0] * place.x + self.axes[i][1] * place.y
    }

    /// The sides of the cell of point `i`, each as its two ends in its plane.
    pub(crate) fn sides(&self, i: usize) -> impl Iterator<Item = [DVec2; 2]> {
        (0..self.count).filter_map(move |line| {
            let q = DVec2::from(self.q[line].map(|lanes| f64::from(lanes[i])));
            let [low, high] = [self.low[line][i], self.high[line][i]].map(f64::from);
            let at = |t: f64| self.unit[i] * (0.5 * q + t * q.perp());
            (high > low).then(|| [at(low), at(high)])
        })
    }

    /// The cells within the lines.
    #[inline(always)]
    pub(crate) fn cells(&self) -> Cells {
        let unit = &self.unit;
        let [mut area, mut reach_squared] = [[0.0f32; WIDTH]; 2];
        for line in 0..self.count {
            for i in 0..WIDTH {
                let [x, y] = [self.q[line][0][i], self.q[line][1][i]];
                let low = self.low[line][i];
                let high = self.high[line][i];
                let squared = x * x + y * y;
                area[i] += 0.25 * squared * greater(high - low, 0.0);
                let corner = squared * (0.25 + greater(low * low, high * high));
                reach_squared[i] = if high > low { greater(reach_squared[i], corner) } else { reach_squared[i] };
            }
        }
        let mut cells = Cells { area: [0.0; WIDTH], reach: [0.0; WIDTH] };
        for i in 0..WIDTH {
            cells.area[i] = f64::from(area[i]) * unit[i] * unit[i];
            cells.reach[i] = f64::from(reach_squared[i]).sqrt() * unit[i];
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(offsets: &[DVec3], normal: DVec3) -> Cells {
        let lanes: Vec<Offset> = offsets.iter().map(|o| o.as_vec3().to_array().map(|c| [c; WIDTH])).collect();
        voronoi_sides(&lanes, &[normal; WIDTH]).cells()
    }

    fn lattice() -> Vec<DVec3> {
        let place = |n: i32| DVec3::new(f64::from(n % 5 - 2), 0.0, f64::from(n / 5 - 2));
        let mut offsets: Vec<DVec3> = (0..25).map(place).filter(|o| *o != DVec3::ZERO).collect();
        offsets.sort_by(|a, b| a.length().total_cmp(&b.length()));
        offsets.truncate(10);
        offsets
    }

    #[test]
    fn a_lattice_point_owns_one_square() {
        for scale in [1.0, 1e-30, 2f64.powi(90)] {
            let offsets: Vec<DVec3> = lattice().iter().map(|o| *o * scale).collect();
            let found = cells(&offsets, DVec3::Y);
            assert!((found.area[3] / scale / scale - 1.0).abs() < 1e-6, "{found:?}");
            assert!((found.reach[3] / scale - 0.5f64.sqrt()).abs() < 1e-6, "{found:?}");
        }
    }

    /// The line of a neighbour counts once, however many others share it, and what lies above the point cuts nothing.
    #[test]
    fn neighbours_one_above_another_change_nothing() {
        let mut offsets = lattice();
        offsets.extend([DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.0, 1.5, 0.0), DVec3::new(1.0, -1.5, 0.0)]);
        offsets.extend([DVec3::new(2.0, 0.25, 0.0), DVec3::new(0.0, -2.25, 0.0)]);
        let found = cells(&offsets, DVec3::Y);
        assert!((found.area[0] - 1.0).abs() < 1e-6 && (found.reach[7] - 0.5f64.sqrt()).abs() < 1e-6, "{found:?}");
        // All of them above: the square alone, half of which is 0.56 of the farthest.
        let above = [DVec3::Y, DVec3::Y * 2.0];
        assert!((cells(&above, DVec3::Y).area[0] - (2.0 * CELL_LIMIT * 2.0f64).powi(2)).abs() < 1e-5);
    }

    /// Against clipping of a polygon corner by corner, in f64.
    #[test]
    fn cells_of_scattered_neighbours_are_those_that_clipping_leaves() {
        for seed in 0..200 {
            let unit = |i: u64, a: u64| 2.0 * splat_core::rng::unit(seed, 0, i, a) - 1.0;
            let normal = DVec3::new(unit(90, 0), unit(90, 1), unit(90, 2)).normalize();
            let (u, v) = normal.any_orthonormal_pair();
            let mut offsets: Vec<DVec3> =
                (0..10).map(|i| u * unit(i, 0) + v * unit(i, 1) + normal * 0.1 * unit(i, 2)).collect();
            offsets.sort_by(|a, b| a.length().total_cmp(&b.length()));
            let half = CELL_LIMIT * offsets[9].length();
            let lanes: Vec<Offset> = offsets.iter().map(|o| o.as_vec3().to_array().map(|c| [c; WIDTH])).collect();
            let [u, v] = axes_of(&lanes, 0, normal);
            let mut corners = vec![[-half, -half], [half, -half], [half, half], [-half, half]];
            for o in &offsets {
                let q = [o.dot(u), o.dot(v)];
                let beyond = |c: &[f64; 2]| c[0] * q[0] + c[1] * q[1] - 0.5 * (q[0] * q[0] + q[1] * q[1]);
                let n = corners.len();
                let edge = |k: usize| {
                    let a = corners[k];
                    let b = corners[(k + 1) % n];
                    let d = beyond(&a);
                    let e = beyond(&b);
                    let cut = || [a[0] + (b[0] - a[0]) * d / (d - e), a[1] + (b[1] - a[1]) * d / (d - e)];
                    [(d <= 0.0).then_some(a), ((d <= 0.0) != (e <= 0.0)).then(cut)]
                };
                corners = (0..n).flat_map(edge).flatten().collect();
            }
            let n = corners.len();
            let twice: f64 =
                (0..n).map(|k| (corners[k], corners[(k + 1) % n])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
            let reach = corners.iter().map(|c| c[0].hypot(c[1])).fold(0.0, f64::max);
            let found = cells(&offsets, normal);
            assert!((found.area[0] / (0.5 * twice) - 1.0).abs() < 1e-4, "{seed}: {found:?} {twice}");
            assert!((found.reach[0] / reach - 1.0).abs() < 1e-4, "{seed}: {found:?} {reach}");
        }
    }
}
