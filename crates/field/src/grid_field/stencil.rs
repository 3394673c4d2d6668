//! An axis of an interpolation: the weights of lattice values at a place, and in the control points of a stretch.
//!
//! Trilinear: (1 − t, t) on the two ends of a cell. Catmull-Rom (1974): the cubic through both ends of the cell with the
//! central difference mᵢ = (vᵢ₊₁ − vᵢ₋₁)/2 as slope at each. Its Bernstein form has the control points
//! vᵢ, vᵢ + mᵢ/3, vᵢ₊₁ − mᵢ₊₁/3, vᵢ₊₁, between whose extremes the cubic stays.
//!
//! Beyond the border stands a ghost value by linear extrapolation, v₋₁ = 2v₀ − v₁: its weight is given to v₀ and v₁, so
//! no value outside the lattice is ever read, and linear fields stay linear. Along an axis with a single lattice point
//! the field is constant.

/// Where `N` values along an axis lie and how they weigh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stencil<const N: usize> {
    pub(super) index: [usize; N],
    /// For the value, its first and its second derivative with respect to the lattice coordinate.
    pub(super) weight: [[f64; N]; 3],
}

/// Control points of an interpolation on a stretch of one cell: row i weighs the values at `index` for control point i.
#[derive(Debug, Clone, Copy)]
pub(super) struct Control<const N: usize> {
    pub(super) index: [usize; N],
    pub(super) row: [[f64; N]; N],
}

/// The cell of a coordinate in 0 ..= n − 1 and the place within it, 0 to 1.
#[inline(always)]
fn cell_of(u: f64, n: usize) -> (usize, f64) {
    if n < 2 {
        return (0, 0.0);
    }
    let cell = (u as usize).min(n - 2);
    (cell, u - cell as f64)
}

impl Stencil<2> {
    /// Linear interpolation at lattice coordinate `u`, which lies in 0 ..= n − 1.
    #[inline(always)]
    pub(super) fn linear(u: f64, n: usize) -> Self {
        let (cell, t) = cell_of(u, n);
        let slope = if n < 2 { [0.0; 2] } else { [-1.0, 1.0] };
        Self { index: [cell, (cell + 1).min(n - 1)], weight: [[1.0 - t, t], slope, [0.0; 2]] }
    }
}

impl Stencil<4> {
    /// Catmull-Rom interpolation at lattice coordinate `u`, which lies in 0 ..= n − 1.
    #[inline(always)]
    pub(super) fn catmull_rom(u: f64, n: usize) -> Self {
        let (cell, t) = cell_of(u, n);
        if n < 2 {
            return Self { index: [0; 4], weight: [[0.0, 1.0, 0.0, 0.0], [0.0; 4], [0.0; 4]] };
        }
        let value = [
            0.5 * t * (t * (2.0 - t) - 1.0),
            0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
            0.5 * t * (t * (4.0 - 3.0 * t) + 1.0),
            0.5 * t * t * (t - 1.0),
        ];
        let first = [
            0.5 * (t * (4.0 - 3.0 * t) - 1.0),
            0.5 * t * (9.0 * t - 10.0),
            0.5 * (t * (8.0 - 9.0 * t) + 1.0),
            0.5 * t * (3.0 * t - 2.0),
        ];
        let second = [2.0 - 3.0 * t, 9.0 * t - 5.0, 4.0 - 9.0 * t, 3.0 * t - 1.0];
        Self { index: indices(cell, n), weight: [fold(value, cell, n), fold(first, cell, n), fold(second, cell, n)] }
    }
}

impl Control<2> {
    /// Weights at both ends of a stretch of a cell: `ends` are ascending, both 0 to 1.
    #[inline(always)]
    pub(super) fn linear(cell: usize, ends: [f64; 2], n: usize) -> Self {
        let [a, b] = ends;
        Self { index: [cell, (cell + 1).min(n - 1)], row: [[1.0 - a, a], [1.0 - b, b]] }
    }
}

impl Control<4> {
    /// Bernstein control points of the cubic on a stretch of a cell: `ends` are ascending, both 0 to 1.
    #[inline(always)]
    pub(super) fn catmull_rom(cell: usize, ends: [f64; 2], n: usize) -> Self {
        let [a, b] = ends;
        if n < 2 {
            return Self { index: [0; 4], row: [[0.0, 1.0, 0.0, 0.0]; 4] };
        }
        let mut row = [blossom(a, a, a), blossom(a, a, b), blossom(a, b, b), blossom(b, b, b)];
        for weights in &mut row {
            *weights = fold(*weights, cell, n);
        }
        Self { index: indices(cell, n), row }
    }
}

/// The polar form of the cell's cubic: the value at t for r = s = t, the control points for r, s, t among two numbers.
#[inline(always)]
fn blossom(r: f64, s: f64, t: f64) -> [f64; 4] {
    let p = 1.0 - r;
    let q = 1.0 - s;
    let o = 1.0 - t;
    let b = [p * q * o, r * q * o + p * s * o + p * q * t, p * s * t + r * q * t + r * s * o, r * s * t];
    const SIXTH: f64 = 1.0 / 6.0;
    [-SIXTH * b[1], b[0] + b[1] + SIXTH * b[2], SIXTH * b[1] + b[2] + b[3], -SIXTH * b[2]]
}

/// The four values around a cell, none outside the lattice.
#[inline(always)]
fn indices(cell: usize, n: usize) -> [usize; 4] {
    [cell.saturating_sub(1), cell, cell + 1, (cell + 2).min(n - 1)]
}

/// Gives the weights of ghosts to the two values that extrapolate to them.
#[inline(always)]
fn fold(mut w: [f64; 4], cell: usize, n: usize) -> [f64; 4] {
    if cell == 0 {
        w = [0.0, w[1] + 2.0 * w[0], w[2] - w[0], w[3]];
    }
    if cell + 2 >= n {
        w = [w[0], w[1] - w[3], w[2] + 2.0 * w[3], 0.0];
    }
    w
}
