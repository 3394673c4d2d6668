//! Colour and extinction of a voxel's cell: the mean of the transfer function over what the trilinear field takes there.
//!
//! Taken at the voxel alone, a structure thinner than a cell is hit by some voxels and missed by others, and its splats show
//! moiré. Where the transfer function bends within the values of a cell, the cell is run through by q² lines along the axis
//! on which the field changes most; between lattice planes and half planes the field is linear along a line, so
//! ∫ σ dv and ∫ σ·colour dv between two values, differences of cubics, give its mean there in closed form (the integrals of
//! K. Engel et al. 2001, "High-quality pre-integrated volume rendering", over a cell instead of along a ray).

use crate::common::extremes::{greater, lesser};
use splat_core::{Grid, TransferFunction, TransferPoint, glam::DVec3};

/// Colour and extinction of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Class {
    /// Mean colour, by extinction.
    pub(crate) color: [f32; 3],
    /// Mean extinction, 1/world unit.
    pub(crate) extinction: f32,
}

/// Extinction, and colour times extinction.
type Four = [f64; 4];

/// One piece of the transfer function: its integral is a + b·d + c·d² + e·d³ at a distance d of values from `base`.
#[derive(Debug, Clone, Copy)]
struct Piece {
    base: f64,
    a: Four,
    b: Four,
    c: Four,
    e: Four,
}

/// A bend must matter this many times more for lines to be taken in sixteen places of a cell instead of four.
const SHARP: f64 = 64.0;

/// A transfer function with its integrals.
pub(crate) struct Classes<'a> {
    tf: &'a TransferFunction,
    knots: Vec<f64>,
    /// Before the first knot, between knots, after the last.
    pieces: Vec<Piece>,
    /// For each knot the greatest change of slope among the four integrands.
    bends: Vec<f64>,
    /// Optical depth of a unit of extinction along a cell, divided by the permitted error of a cell's optical depth.
    weight: f64,
    /// For each piece without extinction, the greatest value up to which the extinction stays 0; −∞ for a piece with extinction.
    dark_until: Vec<f32>,
    /// Smaller sums of extinction are rounding errors.
    something: f64,
}

impl<'a> Classes<'a> {
    /// `spacing` is the length of a cell, world units; `error` the permitted error of a cell's optical depth.
    pub(crate) fn new(tf: &'a TransferFunction, spacing: f64, error: f64) -> Self {
        let points = tf.points();
        let knots: Vec<f64> = points.iter().map(|p| f64::from(p.value)).collect();
        let four = |p: &TransferPoint| (f64::from(p.extinction), p.color.map(f64::from));
        let constant = |base: f64, a: Four, p: &TransferPoint| {
            let (s, [r, g, b]) = four(p);
            Piece { base, a, b: [s, s * r, s * g, s * b], c: [0.0; 4], e: [0.0; 4] }
        };
        let mut pieces = vec![constant(knots[0], [0.0; 4], &points[0])];
        let mut sum = [0.0; 4];
        for pair in points.windows(2) {
            let (s0, c0) = four(&pair[0]);
            let (s1, c1) = four(&pair[1]);
            let base = f64::from(pair[0].value);
            let width = f64::from(pair[1].value) - base;
            let slope = (s1 - s0) / width;
            let mut piece = Piece { base, a: sum, b: [s0; 4], c: [0.5 * slope; 4], e: [0.0; 4] };
            for (i, (c0, c1)) in c0.into_iter().zip(c1).enumerate() {
                let turn = (c1 - c0) / width;
                piece.b[i + 1] = s0 * c0;
                piece.c[i + 1] = 0.5 * (s0 * turn + slope * c0);
                piece.e[i + 1] = slope * turn / 3.0;
            }
            let mean = piece.mean(base, base + width);
            sum = std::array::from_fn(|i| sum[i] + width * mean[i]);
            pieces.push(piece);
        }
        let last = points.len() - 1;
        pieces.push(constant(knots[last], sum, &points[last]));
        let bend = |k: usize| {
            let left = &pieces[k];
            let right = &pieces[k + 1];
            let d = knots[k] - left.base;
            let slopes = (0..4).map(|i| (2.0 * right.c[i] - 2.0 * left.c[i] - 6.0 * left.e[i] * d).abs());
            slopes.fold(0.0, f64::max)
        };
        let bends = (0..knots.len()).map(bend).collect();
        // Without any error allowed every bend matters.
        let weight = if error > 0.0 { spacing / error } else { f64::INFINITY };
        let most = points.iter().fold(0.0, |most: f32, p| most.max(p.extinction));
        let something = (1e-6 * f64::from(most)).max(1e-30);
        Self { tf, knots, pieces, bends, weight, dark_until: dark_until(points), something }
    }

    /// Whether some value from `low` to `high` has extinction.
    pub(crate) fn shows(&self, low: f32, high: f32) -> bool {
        high > self.dark_until[self.piece(f64::from(low))]
    }

    /// The piece that a value lies in.
    fn piece(&self, value: f64) -> usize {
        self.knots.partition_point(|k| *k <= value)
    }

    /// The class of a value.
    pub(crate) fn at(&self, value: f32) -> Class {
        let at = self.tf.at(value);
        Class { color: at.color, extinction: at.extinction }
    }

    /// The class of the cell around a voxel, whose neighbours have values from `range[0]` to `range[1]`; with true where it is a mean.
    pub(crate) fn cell(&self, lattice: &Grid, voxel: [usize; 3], range: [f32; 2]) -> (Class, bool) {
        let at_voxel = || self.at(value(lattice, voxel));
        let Some([s, r, g, b]) = self.mean_of_cell(lattice, voxel, range, f64::INFINITY) else {
            return (at_voxel(), false);
        };
        let extinction = s as f32;
        if extinction > 0.0 {
            return (Class { color: [r / s, g / s, b / s].map(|c| c as f32), extinction }, true);
        }
        (Class { color: at_voxel().color, extinction: 0.0 }, true)
    }

    /// Whether the class of the cell has extinction.
    pub(crate) fn is_extinct(&self, lattice: &Grid, voxel: [usize; 3], range: [f32; 2]) -> bool {
        match self.mean_of_cell(lattice, voxel, range, self.something) {
            Some([s, ..]) => s as f32 > 0.0,
            None => self.at(value(lattice, voxel)).extinction > 0.0,
        }
    }

    /// The mean over the cell around a voxel, or of a part of it that has more than `enough` extinction; `None` where the function bends too
    /// little for a mean.
    fn mean_of_cell(&self, lattice: &Grid, voxel: [usize; 3], range: [f32; 2], enough: f64) -> Option<Four> {
        let [low, high] = range;
        if self.bend(f64::from(low), f64::from(high)) <= 1.0 {
            return None;
        }
        let nodes = nodes(lattice, voxel);
        let mut low = nodes[1][1][1];
        let mut high = nodes[1][1][1];
        for v in nodes.as_flattened().as_flattened() {
            (low, high) = (lesser(*v, low), greater(*v, high));
        }
        let bend = self.bend(low, high);
        if bend <= 1.0 {
            return None;
        }
        Some(if bend <= SHARP { self.mean::<2>(&nodes, enough) } else { self.mean::<4>(&nodes, enough) })
    }

    /// How much the bends between two values may change the optical depth of a cell of these values, in units of what may
    /// be wrong: a bend in the middle of evenly spread values changes their mean by an eighth of its slope times the spread.
    fn bend(&self, low: f64, high: f64) -> f64 {
        let first = self.piece(low);
        let within = self.knots[first..].iter().zip(&self.bends[first..]).take_while(|(k, _)| **k < high);
        let slopes: f64 = within.map(|(_, bend)| bend).sum();
        if slopes > 0.0 { 0.125 * slopes * (high - low) * self.weight } else { 0.0 }
    }

    /// The mean over a cell, by lines through Q² places; by those up to which there is more than `enough` extinction.
    fn mean<const Q: usize>(&self, nodes: &Nodes, enough: f64) -> Four {
        let change = |a: f64, b: f64, c: f64| (b - a).abs() + (c - b).abs();
        let n = nodes;
        let along = [
            change(n[1][1][0], n[1][1][1], n[1][1][2]),
            change(n[1][0][1], n[1][1][1], n[1][2][1]),
            change(n[0][1][1], n[1][1][1], n[2][1][1]),
        ];
        let axis = (0..3).fold(0, |a, i| if along[i] > along[a] { i } else { a });
        // The axis last, the next ones before it.
        let turned = |b: usize, a: usize| {
            std::array::from_fn::<f64, 3, _>(|m| match axis {
                0 => n[b][a][m],
                1 => n[a][m][b],
                _ => n[m][b][a],
            })
        };
        let lines: Nodes = std::array::from_fn(|b| std::array::from_fn(|a| turned(b, a)));
        let mut sum = [0.0; 4];
        for i in 0..Q * Q {
            let (a, s) = place::<Q>(i % Q);
            let (b, t) = place::<Q>(i / Q);
            let mix = |x: f64, y: f64, t: f64| x + (y - x) * t;
            let [low, high] = [&lines[b], &lines[b + 1]];
            let at = |m: usize| mix(mix(low[a][m], low[a + 1][m], s), mix(high[a][m], high[a + 1][m], s), t);
            let [v0, v1, v2] = [at(0), at(1), at(2)];
            let first = self.between(v0, v1);
            let second = self.between(v1, v2);
            for c in 0..4 {
                sum[c] += first[c] + second[c];
            }
            if sum[0] > enough {
                break;
            }
        }
        sum.map(|x| x * (0.5 / (Q * Q) as f64))
    }

    /// The mean between two values.
    fn between(&self, a: f64, b: f64) -> Four {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let first = self.piece(low);
        let last = self.piece(high);
        if first == last {
            return self.pieces[first].mean(low, high);
        }
        // Whole pieces come from sums, parts of them from their own polynomial: nothing cancels.
        let rise = self.knots[first] - low;
        let fall = high - self.knots[last - 1];
        let head = self.pieces[first].mean(low, self.knots[first]);
        let tail = self.pieces[last].mean(self.knots[last - 1], high);
        let start = &self.pieces[first + 1].a;
        let end = &self.pieces[last].a;
        let mut mean = [0.0; 4];
        for i in 0..4 {
            mean[i] = (rise * head[i] + (end[i] - start[i]) + fall * tail[i]) / (high - low);
        }
        mean
    }
}

/// See [`Classes::dark_until`].
fn dark_until(points: &[TransferPoint]) -> Vec<f32> {
    let n = points.len();
    let is_dark =
        |piece: usize| points[piece.saturating_sub(1)..(piece + 1).min(n)].iter().all(|p| p.extinction == 0.0);
    let mut until = vec![f32::NEG_INFINITY; n + 1];
    for piece in (0..=n).rev().filter(|piece| is_dark(*piece)) {
        until[piece] = match points.get(piece) {
            Some(end) => end.value.max(until[piece + 1]),
            None => f32::INFINITY,
        };
    }
    until
}

impl Piece {
    /// The mean between two values of the piece.
    fn mean(&self, low: f64, high: f64) -> Four {
        let x = low - self.base;
        let y = high - self.base;
        let first = x + y;
        let second = x * x + x * y + y * y;
        let mut mean = [0.0; 4];
        for i in 0..4 {
            mean[i] = self.b[i] + self.c[i] * first + self.e[i] * second;
        }
        mean
    }
}

/// The value of a voxel.
fn value(lattice: &Grid, cell: [usize; 3]) -> f32 {
    let [i, j, k] = cell;
    lattice.values[(k * lattice.dims[1] + j) * lattice.dims[0] + i]
}

/// The field at the corners of a cell's eight octants, z slowest.
type Nodes = [[[f64; 3]; 3]; 3];

/// Values beyond the lattice are its border's.
fn nodes(lattice: &Grid, voxel: [usize; 3]) -> Nodes {
    let [nx, ny, _] = lattice.dims;
    let around = |a: usize| [voxel[a].saturating_sub(1), voxel[a], (voxel[a] + 1).min(lattice.dims[a] - 1)];
    let [xs, ys, zs] = [around(0), around(1), around(2)];
    let mut n: Nodes = zs.map(|k| ys.map(|j| xs.map(|i| f64::from(lattice.values[(k * ny + j) * nx + i]))));
    let halves = |[a, b, c]: [f64; 3]| [0.5 * (a + b), b, 0.5 * (b + c)];
    n.iter_mut().flatten().for_each(|row| *row = halves(*row));
    for plane in &mut n {
        for i in 0..3 {
            let column = halves([plane[0][i], plane[1][i], plane[2][i]]);
            (0..3).for_each(|j| plane[j][i] = column[j]);
        }
    }
    for j in 0..3 {
        for i in 0..3 {
            let column = halves([n[0][j][i], n[1][j][i], n[2][j][i]]);
            (0..3).for_each(|k| n[k][j][i] = column[k]);
        }
    }
    n
}

/// Where the middle of part `i` of Q parts of a cell lies: after which node, and how far to the next.
const fn place<const Q: usize>(i: usize) -> (usize, f64) {
    let at = (2 * i + 1) as f64 / Q as f64;
    let node = if at < 1.0 { 0 } else { 1 };
    (node, at - node as f64)
}

/// The distance of lattice points in the world that a cell's optical depth is judged by.
pub(crate) fn cell_length(lattice: &Grid, scale: f64) -> f64 {
    let axes = [lattice.axes.x_axis, lattice.axes.y_axis, lattice.axes.z_axis];
    axes.iter().map(|a: &DVec3| a.length()).fold(0.0, f64::max) * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::DMat3;

    fn function() -> TransferFunction {
        let point = |value, extinction, red| TransferPoint { value, color: [red, 0.5, 1.0], extinction };
        TransferFunction::new(vec![
            point(-1.0, 0.5, 0.0),
            point(0.0, 2.0, 1.0),
            point(0.25, 0.0, 0.5),
            point(4.0, 1.0, 0.5),
        ])
        .unwrap()
    }

    #[test]
    fn means_between_values_are_the_integrals_of_the_function() {
        let tf = function();
        let classes = Classes::new(&tf, 1.0, 0.0);
        for (a, b) in [(-3.0, 7.0), (-0.5, -0.25), (-0.5, 0.125), (5.0, 0.125), (-3.0, -2.0), (9.0, 5.0), (0.0, 0.0)] {
            let steps = 40_000;
            let mut exact = [0.0; 4];
            for i in 0..steps {
                let at = tf.at((a + (b - a) * (f64::from(i) + 0.5) / f64::from(steps)) as f32);
                let s = f64::from(at.extinction);
                let four = [s, s * f64::from(at.color[0]), s * f64::from(at.color[1]), s * f64::from(at.color[2])];
                (0..4).for_each(|c| exact[c] += four[c] / f64::from(steps));
            }
            let found = classes.between(a, b);
            assert!((0..4).all(|c| (found[c] - exact[c]).abs() < 1e-5), "{a} {b}: {found:?} {exact:?}");
        }
        // A difference far below what the integrals from the first knot could resolve.
        let close = classes.between(0.25 - 1e-13, 0.25 + 1e-13);
        assert!(close[0] > 0.0 && close[0] < 1e-12, "{close:?}");
    }

    #[test]
    fn a_cell_on_which_the_function_is_straight_keeps_its_voxels_class() {
        let tf = function();
        let values = (0..27).map(|n| 0.5 + 0.125 * (n % 3) as f32 - 0.0625 * (n / 9) as f32).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [3; 3], values };
        let at = tf.at(grid.values[13]);
        let expected = (Class { color: at.color, extinction: at.extinction }, false);
        assert_eq!(Classes::new(&tf, 1.0, 0.0).cell(&grid, [1; 3], [0.375, 0.75]), expected);
        // Where it bends, but too little to matter.
        let tiny = Grid { values: grid.values.iter().map(|v| v * 1e-6).collect(), ..grid };
        assert!(!Classes::new(&tf, 1.0, 1e-3).cell(&tiny, [1; 3], [-1e-6, 1e-6]).1);
    }

    #[test]
    fn values_without_extinction_are_told_between_and_beyond_points() {
        let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
        let points = [(0.0, 0.0), (1.0, 2.0), (2.0, 0.0), (3.0, 0.0), (4.0, 0.0), (5.0, 1.0)];
        let tf = TransferFunction::new(points.map(|(v, e)| point(v, e)).to_vec()).unwrap();
        let classes = Classes::new(&tf, 1.0, 0.0);
        for (range, shows) in [
            ([-9.0, 0.0], false),
            ([-9.0, 0.1], true),
            ([1.9, 1.9], true),
            ([2.0, 4.0], false),
            ([2.5, 3.5], false),
            ([2.5, 4.5], true),
            ([7.0, 8.0], true),
        ] {
            assert_eq!(classes.shows(range[0], range[1]), shows, "{range:?}");
        }
        let nothing = TransferFunction::new(vec![point(0.0, 0.0)]).unwrap();
        assert!(!Classes::new(&nothing, 1.0, 0.0).shows(-1.0, 1.0));
    }

    /// Against a sum over 40³ places of the cell.
    #[test]
    fn the_mean_over_a_cell_is_that_of_the_trilinear_field() {
        let tf = function();
        let values: Vec<f32> = (0..27u32).map(|n| (n * 7 % 11) as f32 * 0.2 - 1.0).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [3; 3], values };
        let n = nodes(&grid, [1; 3]);
        let mut exact = 0.0;
        let steps = 40usize;
        let mix = |x: f64, y: f64, t: f64| x + (y - x) * t;
        for i in 0..steps.pow(3) {
            let [(a, s), (b, t), (c, u)] = [i % steps, i / steps % steps, i / steps / steps].map(|i| {
                let at = (2 * i + 1) as f64 / steps as f64;
                (usize::from(at >= 1.0), at - f64::from(at >= 1.0))
            });
            let row = |k: usize, j: usize| mix(n[k][j][a], n[k][j][a + 1], s);
            let plane = |k: usize| mix(row(k, b), row(k, b + 1), t);
            exact += f64::from(tf.at(mix(plane(c), plane(c + 1), u) as f32).extinction);
        }
        exact /= steps.pow(3) as f64;
        let (found, is_mean) = Classes::new(&tf, 1.0, 0.0).cell(&grid, [1; 3], [-1.0, 1.0]);
        assert!(is_mean);
        assert!((f64::from(found.extinction) / exact - 1.0).abs() < 0.02, "{found:?} {exact}");
    }
}
