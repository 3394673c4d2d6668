//! Cells of a volume with Catmull-Rom interpolation: along a line parallel to an axis the value is a cubic.
//!
//! The interpolation is a tensor product. Where two coordinates are fixed, the 64 values around a cell leave four, v₀ to v₃, and
//! the cubic between v₁ and v₂ has the Bernstein control points v₁, v₁ + (v₂ − v₀)/6, v₂ − (v₃ − v₁)/6, v₂. Where they
//! do not change sign there is no root, where they change it once there is one; else the halves are looked at (de Casteljau).
//! Beyond the border values go on along the line through the last two, as in `field::GridField`.

use glam::Vec3;
use splat_core::{Grid, glam};

/// Values around a cell less the level, \[k\]\[j\]\[i\]. At lattice points that have the level they are 0, not rounded.
pub(super) type Block = [[[f32; 4]; 4]; 4];

/// Halvings after which a piece with both ends on one side holds no root: pairs nearer than 2⁻¹² of a cell are left out.
const DEPTH: u32 = 12;

/// No interpolated value is farther from the middle of the 64 values than their half range times (5/4)³: along an axis the
/// magnitudes of weights add to at most 5/4.
const OVERSHOOT: f32 = 1.954;

/// The values around the cell whose first corner has a lattice index.
#[inline]
pub(super) fn gather(grid: &Grid, at: u32, level: f32) -> Block {
    let [nx, ny, nz] = grid.dims.map(|n| n as u32);
    let corner = [at % nx, at / nx % ny, at / (nx * ny)];
    let mut block = [[[0.0; 4]; 4]; 4];
    if (0..3).any(|a| corner[a] == 0 || corner[a] + 2 >= [nx, ny, nz][a]) {
        at_border(grid, corner, level, &mut block);
        return block;
    }
    let first = (at - 1 - nx - nx * ny) as usize;
    for k in 0..4 {
        for j in 0..4 {
            let row = &grid.values[first + (k * grid.dims[1] + j) * grid.dims[0]..][..4];
            for i in 0..4 {
                block[k][j][i] = row[i] - level;
            }
        }
    }
    block
}

#[cold]
fn at_border(grid: &Grid, corner: [u32; 3], level: f32, block: &mut Block) {
    let [x, y, z] = corner.map(|c| c as isize - 1);
    for k in 0..4 {
        for j in 0..4 {
            for i in 0..4 {
                let value = grid.at_clamped(x + i as isize, y + j as isize, z + k as isize);
                block[k][j][i] = value - level;
            }
        }
    }
    for axis in 0..3 {
        if corner[axis] == 0 {
            extrapolate(block, axis, 0, 1, 2);
        }
        if corner[axis] as usize + 2 == grid.dims[axis] {
            extrapolate(block, axis, 3, 2, 1);
        }
    }
}

/// Sets the values of one plane to where the line through those of two others leads.
fn extrapolate(block: &mut Block, axis: usize, beyond: usize, near: usize, far: usize) {
    for p in 0..4 {
        for q in 0..4 {
            let index = |s: usize| match axis {
                0 => [p, q, s],
                1 => [p, s, q],
                _ => [s, p, q],
            };
            let [a, b, c] = [index(beyond), index(near), index(far)];
            block[a[0]][a[1]][a[2]] = 2.0 * block[b[0]][b[1]][b[2]] - block[c[0]][c[1]][c[2]];
        }
    }
}

/// Weights of four values at `t` in \[0, 1\] between the second and the third.
#[inline(always)]
fn weights(t: f32) -> [f32; 4] {
    [
        0.5 * t * (t * (2.0 - t) - 1.0),
        0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
        0.5 * t * (t * (4.0 - 3.0 * t) + 1.0),
        0.5 * t * t * (t - 1.0),
    ]
}

/// Their derivatives.
#[inline(always)]
fn slopes(t: f32) -> [f32; 4] {
    [
        0.5 * (t * (4.0 - 3.0 * t) - 1.0),
        0.5 * t * (9.0 * t - 10.0),
        0.5 * (t * (8.0 - 9.0 * t) + 1.0),
        0.5 * t * (3.0 * t - 2.0),
    ]
}

#[inline(always)]
fn dot(a: &[f32; 4], b: &[f32; 4]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

/// The sum of four rows, each times its weight.
#[inline(always)]
fn sum(rows: [&[f32; 4]; 4], weights: &[f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| {
        (rows[0][i] * weights[0] + rows[1][i] * weights[1]) + (rows[2][i] * weights[2] + rows[3][i] * weights[3])
    })
}

/// Row j of a block where z is fixed.
#[inline(always)]
fn at_z(block: &Block, j: usize, z: &[f32; 4]) -> [f32; 4] {
    sum([&block[0][j], &block[1][j], &block[2][j], &block[3][j]], z)
}

/// Row k of a block where y is fixed.
#[inline(always)]
fn at_y(block: &Block, k: usize, y: &[f32; 4]) -> [f32; 4] {
    let [a, b, c, d] = &block[k];
    sum([a, b, c, d], y)
}

/// Control points along the line through a place that is parallel to an axis.
#[inline(always)]
pub(super) fn along(block: &Block, axis: usize, place: [f32; 3]) -> [f32; 4] {
    let [x, y, z] = place.map(weights);
    let values = match axis {
        0 => {
            let rows: [[f32; 4]; 4] = std::array::from_fn(|j| at_z(block, j, &z));
            sum(rows.each_ref(), &y)
        }
        1 => std::array::from_fn(|j| dot(&at_z(block, j, &z), &x)),
        _ => std::array::from_fn(|k| dot(&at_y(block, k, &y), &x)),
    };
    control(values)
}

#[inline(always)]
fn control(values: [f32; 4]) -> [f32; 4] {
    let [a, b, c, d] = values;
    [b, b + (c - a) * (1.0 / 6.0), c - (d - b) * (1.0 / 6.0), c]
}

/// The gradient at a place, in steps of the lattice.
#[inline(always)]
pub(super) fn gradient(block: &Block, place: [f32; 3]) -> Vec3 {
    let [x, y, z] = place.map(weights);
    let [dx, dy, dz] = place.map(slopes);
    let rows: [[f32; 4]; 4] = std::array::from_fn(|k| at_y(block, k, &y));
    let derived: [[f32; 4]; 4] = std::array::from_fn(|k| at_y(block, k, &dy));
    let row = sum(rows.each_ref(), &z);
    Vec3::new(dot(&row, &dx), dot(&sum(derived.each_ref(), &z), &x), dot(&sum(rows.each_ref(), &dz), &x))
}

/// How often control points change sign; 0 counts as above.
#[inline(always)]
fn changes(c: &[f32; 4]) -> u32 {
    let below = c.map(|c| u32::from(c < 0.0));
    (below[0] ^ below[1]) + (below[1] ^ below[2]) + (below[2] ^ below[3])
}

/// Hands over the roots between the ends of a cubic, rising.
#[inline]
pub(super) fn roots(control: &[f32; 4], found: &mut impl FnMut(f32)) {
    match changes(control) {
        0 => {}
        1 => found(bracket(control)),
        _ => search(control, 0.0, 1.0, DEPTH, found),
    }
}

/// The same on the piece of a cell that begins at `from` and is `length` long.
fn search(c: &[f32; 4], from: f32, length: f32, depth: u32, found: &mut impl FnMut(f32)) {
    let changes = changes(c);
    if changes == 1 || (depth == 0 && changes == 3) {
        found(from + length * bracket(c));
    } else if changes > 0 && depth > 0 {
        let [ab, bc, cd] = [0.5 * (c[0] + c[1]), 0.5 * (c[1] + c[2]), 0.5 * (c[2] + c[3])];
        let [abc, bcd] = [0.5 * (ab + bc), 0.5 * (bc + cd)];
        let middle = 0.5 * (abc + bcd);
        search(&[c[0], ab, abc, middle], from, 0.5 * length, depth - 1, found);
        search(&[middle, bcd, cd, c[3]], from + 0.5 * length, 0.5 * length, depth - 1, found);
    }
}

/// The root between ends of different sign, by Newton's method within a bracket.
#[inline]
fn bracket(c: &[f32; 4]) -> f32 {
    let p = 3.0 * (c[1] - c[0]);
    let q = 3.0 * (c[0] - 2.0 * c[1] + c[2]);
    let r = c[3] - c[0] - 3.0 * (c[2] - c[1]);
    let mut low = 0.0f32;
    let mut high = 1.0f32;
    let falls = c[0] >= 0.0;
    let mut t = c[0] / (c[0] - c[3]);
    for _ in 0..32 {
        let value = c[0] + t * (p + t * (q + t * r));
        if (value < 0.0) == falls {
            high = t;
        } else {
            low = t;
        }
        let newton = t - value / (p + t * (2.0 * q + t * (3.0 * r)));
        // Not a number where the slope is 0.
        let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
        if (next - t).abs() <= 1e-6 {
            return next;
        }
        t = next;
    }
    t
}

/// Whether the interpolation may pass 0 in the cell: whether its 64 control points differ in sign.
fn may_pass(block: &Block) -> bool {
    // Along z, y and x in turn.
    let mut by_z = [[[0.0; 4]; 4]; 4];
    for j in 0..4 {
        for i in 0..4 {
            let column = control([0, 1, 2, 3].map(|k| block[k][j][i]));
            (0..4).for_each(|k| by_z[k][j][i] = column[k]);
        }
    }
    let mut below = false;
    let mut above = false;
    for plane in &by_z {
        let mut rows = [[0.0; 4]; 4];
        for i in 0..4 {
            let column = control([0, 1, 2, 3].map(|j| plane[j][i]));
            (0..4).for_each(|j| rows[j][i] = column[j]);
        }
        for value in rows.into_iter().flat_map(control) {
            below |= value < 0.0;
            above |= value >= 0.0;
        }
    }
    below && above
}

/// First corners of the cells of a row that the surface may pass; `row` is (j, k) of its first corners.
pub(super) fn passed_in_row(grid: &Grid, level: f32, row: [usize; 2]) -> Vec<u32> {
    let [j, k] = row;
    let [nx, ny, nz] = grid.dims;
    let mut low = vec![f32::INFINITY; nx];
    let mut high = vec![f32::NEG_INFINITY; nx];
    for k in k.saturating_sub(1)..=(k + 2).min(nz - 1) {
        for j in j.saturating_sub(1)..=(j + 2).min(ny - 1) {
            let row = &grid.values[(k * ny + j) * nx..][..nx];
            low.iter_mut().zip(row).for_each(|(low, v)| *low = low.min(*v));
            high.iter_mut().zip(row).for_each(|(high, v)| *high = high.max(*v));
        }
    }
    let near = |i: usize| {
        let around = i.saturating_sub(1)..(i + 3).min(nx);
        // Less the level first: values beside it lose no digit to the middle of the range.
        let least = low[around.clone()].iter().copied().fold(f32::INFINITY, f32::min) - level;
        let most = high[around].iter().copied().fold(f32::NEG_INFINITY, f32::max) - level;
        (least + most).abs() <= OVERSHOOT * (most - least)
    };
    let first = (k * ny + j) * nx;
    let cells = (0..nx - 1).filter(|i| near(*i)).map(|i| (first + i) as u32);
    cells.filter(|at| may_pass(&gather(grid, *at, level))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LatticeSampler, Particles, Sampler, SurfaceParams};
    use splat_core::glam::{DMat3, DVec3};
    use splat_core::{Interpolation, rng};

    fn grid(dims: [usize; 3], seed: u64) -> Grid {
        let values = (0..dims.iter().product()).map(|i: usize| (rng::unit(seed, 0, i as u64, 0) * 8.0) as f32);
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values: values.collect() }
    }

    /// Catmull-Rom of four values by differences at both ends (Hermite).
    fn hermite([a, b, c, d]: [f64; 4], t: f64) -> f64 {
        let from = 0.5 * (c - a);
        let to = 0.5 * (d - b);
        let o = 1.0 - t;
        o * o * (b * (1.0 + 2.0 * t) + from * t) + t * t * (c * (3.0 - 2.0 * t) - to * o)
    }

    /// Cell and weights of the four values along an axis of `n` lattice points.
    fn axis(n: usize, at: f64) -> (isize, [f64; 4]) {
        let cell = (at.floor() as isize).clamp(0, n as isize - 2);
        let weight = |m: usize| hermite(std::array::from_fn(|i| f64::from(u8::from(i == m))), at - cell as f64);
        let [mut a, mut b, mut c, mut d] = [0, 1, 2, 3].map(weight);
        if cell == 0 {
            (a, b, c) = (0.0, b + 2.0 * a, c - a);
        }
        if cell + 2 == n as isize {
            (b, c, d) = (b - d, c + 2.0 * d, 0.0);
        }
        (cell, [a, b, c, d])
    }

    /// The value at lattice coordinates.
    fn value(grid: &Grid, at: [f64; 3]) -> f64 {
        let [(i, x), (j, y), (k, z)] = [0, 1, 2].map(|a| axis(grid.dims[a], at[a]));
        let mut sum = 0.0;
        for n in 0..64 {
            let [p, q, r] = [n % 4, n / 4 % 4, n / 16];
            let value = grid.at_clamped(i + p as isize - 1, j + q as isize - 1, k + r as isize - 1);
            sum += f64::from(value) * x[p] * y[q] * z[r];
        }
        sum
    }

    #[test]
    fn lines_and_gradients_are_those_of_hermite_splines_border_included() {
        for (dims, seed) in [([5, 6, 7], 1), ([2, 3, 2], 2), ([3, 2, 4], 3)] {
            let grid = grid(dims, seed);
            for n in 0..2000u64 {
                let random = |d: u64| rng::unit(9, 0, n, d);
                let corner: [usize; 3] = std::array::from_fn(|a| (random(a as u64) * (dims[a] - 1) as f64) as usize);
                let within: [f64; 3] = std::array::from_fn(|a| random(3 + a as u64));
                let at = ((corner[2] * dims[1] + corner[1]) * dims[0] + corner[0]) as u32;
                let place = within.map(|t| t as f32);
                let lattice: [f64; 3] = std::array::from_fn(|a| corner[a] as f64 + f64::from(place[a]));
                let block = gather(&grid, at, 4.0);
                let slope = gradient(&block, place);
                let expected = value(&grid, lattice) - 4.0;
                for axis in 0..3 {
                    let [c0, c1, c2, c3] = along(&block, axis, place);
                    let t = place[axis];
                    let o = 1.0 - place[axis];
                    let found = o * o * o * c0 + 3.0 * o * o * t * c1 + 3.0 * o * t * t * c2 + t * t * t * c3;
                    assert!((f64::from(found) - expected).abs() < 3e-5, "{dims:?} {lattice:?}: {found} {expected}");
                    // Within the cell: the second derivative jumps at its faces.
                    let t = lattice[axis].clamp(corner[axis] as f64 + 1e-5, corner[axis] as f64 + 1.0 - 1e-5);
                    let [low, high] = [-1e-6, 1e-6].map(|h| {
                        let mut near = lattice;
                        near[axis] = t + h;
                        value(&grid, near)
                    });
                    let by = (high - low) * 5e5;
                    assert!((f64::from(slope[axis]) - by).abs() < 2e-3, "{lattice:?} {axis}: {} {by}", slope[axis]);
                }
            }
        }
    }

    #[test]
    fn all_roots_of_a_cubic_are_found() {
        let mut counts = [0u32; 4];
        for n in 0..20_000u64 {
            // Three roots of any place, a few of them in the cell.
            let [a, b, c] = [0, 1, 2].map(|d| rng::unit(4, 0, n, d) * 4.0 - 1.5);
            let f = |t: f64| (t - a) * (t - b) * (t - c);
            let slope = |t: f64| (t - a) * (t - b) + (t - b) * (t - c) + (t - c) * (t - a);
            let control = [f(0.0), f(0.0) + slope(0.0) / 3.0, f(1.0) - slope(1.0) / 3.0, f(1.0)].map(|c| c as f32);
            let mut expected: Vec<f64> = [a, b, c].into_iter().filter(|t| (0.0..1.0).contains(t)).collect();
            expected.sort_by(f64::total_cmp);
            let apart = |x: f64, y: f64| (x - y).abs() > 2e-3;
            let clear = [a, b, c].iter().all(|t| apart(*t, 0.0) && apart(*t, 1.0));
            if !(clear && apart(a, b) && apart(b, c) && apart(c, a)) {
                continue;
            }
            let mut found = Vec::new();
            roots(&control, &mut |t| found.push(t));
            counts[expected.len()] += 1;
            assert_eq!(found.len(), expected.len(), "{a} {b} {c}: {found:?}");
            // Rounding of control points by 2⁻²⁴ of their size over the slope, at least 2e-3².
            let near = |(t, e): (&f32, &f64)| (f64::from(*t) - e).abs() < 2e-6 / slope(*e).abs().max(1e-3) + 2e-6;
            assert!(found.iter().zip(&expected).all(near), "{found:?} {expected:?}");
        }
        assert!(counts.iter().all(|n| *n > 100), "{counts:?}");
    }

    /// Area by the co-area formula, ∫ |∇f| δ(f − c) dV, with its standard error: places that are uniform in the lattice, δ the box
    /// of half width ε.
    fn area(grid: &Grid, level: f64) -> [f64; 2] {
        const PLACES: u64 = 1_500_000;
        const EPSILON: f64 = 0.05;
        let sides = grid.dims.map(|n| (n - 1) as f64);
        let [mut sum, mut squares] = [0.0; 2];
        for n in 0..PLACES {
            let at: [f64; 3] = std::array::from_fn(|a| sides[a] * rng::unit(11, 0, n, a as u64));
            if (value(grid, at) - level).abs() < EPSILON {
                let slope = |a: usize| {
                    let [low, high] = [-1e-6, 1e-6].map(|h| {
                        let mut near = at;
                        near[a] += h;
                        value(grid, near)
                    });
                    (high - low) * 5e5
                };
                let squared: f64 = (0..3).map(|a| slope(a).powi(2)).sum();
                (sum, squares) = (sum + squared.sqrt(), squares + squared);
            }
        }
        let scale = sides.iter().product::<f64>() / (PLACES as f64 * 2.0 * EPSILON);
        [sum * scale, squares.sqrt() * scale]
    }

    #[test]
    fn noise_has_the_area_of_the_co_area_formula() {
        let grid = grid([5, 4, 5], 8);
        let params = SurfaceParams { opacity: 0.5, cross_section: 1e-3, ..SurfaceParams::default() };
        let sampler = LatticeSampler::new(&grid, Interpolation::CatmullRom, 5.0, &params).unwrap();
        let mut scratch = Particles::default();
        let count: f64 = (0..sampler.chunks()).map(|c| sampler.chunk(0, c, &mut scratch).len() as f64).sum();
        let [expected, error] = area(&grid, 5.0);
        let [found, noise] = [count, count.sqrt()].map(|n| n / params.particles_per_area());
        let off = (found - expected) / error.hypot(noise);
        assert!(off.abs() < 4.0, "{found} for {expected}: {off} deviations");
        assert!(error < 0.01 * expected && noise < 0.01 * expected, "{error} {noise}");
    }

    #[test]
    fn no_cell_that_the_surface_passes_is_left_out() {
        for (dims, seed) in [([6, 5, 7], 5), ([2, 2, 3], 6)] {
            let grid = grid(dims, seed);
            let rows = || (0..dims[2] - 1).flat_map(|k| (0..dims[1] - 1).map(move |j| [j, k]));
            let passed: Vec<u32> = rows().flat_map(|row| passed_in_row(&grid, 6.5, row)).collect();
            let cells = rows().flat_map(|[j, k]| (0..dims[0] - 1).map(move |i| [i, j, k]));
            let mut left_out = 0;
            for corner @ [i, j, k] in cells {
                let at = ((k * dims[1] + j) * dims[0] + i) as u32;
                let at_place = |n: u64| {
                    let coordinate = |a: usize| corner[a] as f64 + rng::unit(7, 0, n, a as u64);
                    value(&grid, [coordinate(0), coordinate(1), coordinate(2)]) < 6.5
                };
                let below = (0..300).filter(|n| at_place(*n)).count();
                let known = passed.contains(&at);
                assert!(known || below == 0 || below == 300, "{corner:?}: {below}");
                left_out += u32::from(!known);
            }
            assert!(left_out > 0 || dims[0] == 2, "nothing is told apart");
        }
    }

    #[test]
    fn a_step_of_one_rounding_is_passed() {
        let low = 1000.0f32;
        let high = 1000.0f32.next_up();
        let values = (0..5 * 5 * 5).map(|i| if i / 25 < 2 { low } else { high }).collect();
        let grid = Grid { values, ..grid([5; 3], 1) };
        let passed = (0..4).map(|k| passed_in_row(&grid, high, [1, k]).len());
        assert_eq!(passed.collect::<Vec<_>>()[1], 4);
    }
}
