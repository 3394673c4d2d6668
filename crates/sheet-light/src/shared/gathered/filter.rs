//! The filter that makes a cubic B-spline the paper's kernel.
//!
//! Of the voxels' kernels a place has the normalised sum Σ v_i·g(x − i) / Σ g(x − i), g being a Gaussian of deviation 0.7 steps that ends at two steps. A
//! cubic B-spline is narrower (deviation √⅓); over a lattice that was filtered by seven taps h it is Σ h_k·B(x − k), and the taps are those of the
//! least squares ∫ (g(x)/Σ g − Σ h_k·B(x − k))² dx whose sum is 1. They know no view: a volume is filtered once, along one axis after the other.

use crate::KernelShape;
use crate::shared::classifier::Base;
use rayon::prelude::*;
use splat_core::Grid;

/// Taps on either side of the middle one.
const TAPS: usize = 3;

/// Places a step at which kernels are compared.
const SAMPLES: usize = 32;

/// Steps on either side that both kernels end within.
const REACH: usize = 5;

/// Cubic B-spline.
fn spline(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 {
        2.0 / 3.0 - x * x * (1.0 - 0.5 * x)
    } else if x < 2.0 {
        (2.0 - x) * (2.0 - x) * (2.0 - x) / 6.0
    } else {
        0.0
    }
}

/// The paper's kernel along an axis, as [`splat_core::Footprint`] has it.
fn gaussian(x: f64, shape: &KernelShape) -> f64 {
    let cutoff = shape.extent / shape.sigma;
    let q = 0.5 * cutoff * cutoff;
    let s = x * x / (shape.extent * shape.extent);
    if s >= 1.0 {
        return 0.0;
    }
    let y = q * (1.0 - s);
    libm::exp(-q * s) - libm::exp(-q) * (1.0 + y + 0.5 * y * y)
}

/// The same with the sum over a lattice 1 everywhere.
fn normalized(x: f64, shape: &KernelShape) -> f64 {
    let phase = x - x.floor();
    let reach = REACH as i32;
    let sum: f64 = (-reach..=reach).map(|i| gaussian(phase + f64::from(i), shape)).sum();
    gaussian(x, shape) / sum
}

/// The middle tap and those beside it, the same on both sides.
pub(crate) fn taps(shape: &KernelShape) -> [f64; TAPS + 1] {
    // h₀ = 1 − 2·Σ hₖ leaves three unknowns: g − B = Σ hₖ·(B(x − k) + B(x + k) − 2·B(x)).
    let mut matrix = [[0.0f64; TAPS]; TAPS];
    let mut right = [0.0f64; TAPS];
    for n in 0..2 * REACH * SAMPLES {
        let x = (n as f64 + 0.5) / SAMPLES as f64 - REACH as f64;
        let columns: [f64; TAPS] = std::array::from_fn(|k| {
            let k = (k + 1) as f64;
            spline(x - k) + spline(x + k) - 2.0 * spline(x)
        });
        let target = normalized(x, shape) - spline(x);
        for row in 0..TAPS {
            right[row] += columns[row] * target;
            for column in 0..TAPS {
                matrix[row][column] += columns[row] * columns[column];
            }
        }
    }
    // Gauss without pivots: the matrix is that of a least-squares problem.
    for pivot in 0..TAPS {
        for row in pivot + 1..TAPS {
            let share = matrix[row][pivot] / matrix[pivot][pivot];
            for column in pivot..TAPS {
                matrix[row][column] -= share * matrix[pivot][column];
            }
            right[row] -= share * right[pivot];
        }
    }
    let mut solved = [0.0; TAPS];
    for row in (0..TAPS).rev() {
        let known: f64 = (row + 1..TAPS).map(|column| matrix[row][column] * solved[column]).sum();
        solved[row] = (right[row] - known) / matrix[row][row];
    }
    let [first, second, third] = solved;
    [1.0 - 2.0 * (first + second + third), first, second, third]
}

/// The filtered values of a lattice, relative to a base, with `rim` of them before and behind it along each axis. A lattice goes on beyond its faces as
/// 2·v(0) − v(m), and so do its coefficients.
pub(crate) fn coefficients(grid: &Grid, base: Base, rim: usize) -> Vec<f32> {
    let taps = taps(&KernelShape::default()).map(|tap| tap as f32);
    let [nx, ny, nz] = grid.dims;
    let plane = nx * ny;
    let mut across = vec![0.0f32; plane * nz];
    let planes = across.par_chunks_mut(plane).zip(grid.values.par_chunks(plane));
    planes.for_each_init(Vec::new, |rows: &mut Vec<f32>, (out, values)| {
        rows.clear();
        rows.resize(plane, 0.0);
        let mut padded = vec![0.0; nx + 2 * TAPS];
        for (out, values) in rows.chunks_exact_mut(nx).zip(values.chunks_exact(nx)) {
            padded[TAPS..TAPS + nx].iter_mut().zip(values).for_each(|(to, from)| *to = base.relative(*from));
            go_on(&mut padded, TAPS, 1);
            for (i, out) in out.iter_mut().enumerate() {
                let middle = padded[TAPS + i];
                // Differences, so that constants stay what they are.
                let beside = |m: usize| (padded[TAPS + i - m] - middle) + (padded[TAPS + i + m] - middle);
                *out = middle + (taps[1] * beside(1) + taps[2] * beside(2) + taps[3] * beside(3));
            }
        }
        for (j, out) in out.chunks_exact_mut(nx).enumerate() {
            let row = |j: usize| &rows[j * nx..(j + 1) * nx];
            filter_rows(&taps, j, ny, row, out);
        }
    });
    let stride = nx + 2 * rim;
    let stored = stride * (ny + 2 * rim);
    let mut through = vec![0.0f32; stored * (nz + 2 * rim)];
    let inner = &mut through[rim * stored..(rim + nz) * stored];
    inner.par_chunks_exact_mut(stored).enumerate().for_each(|(k, out)| {
        for (j, out) in out.chunks_exact_mut(stride).skip(rim).take(ny).enumerate() {
            let row = |k: usize| &across[(k * ny + j) * nx..][..nx];
            filter_rows(&taps, k, nz, row, &mut out[rim..rim + nx]);
            go_on(out, rim, 1);
        }
        go_on(out, rim, stride);
    });
    go_on(&mut through, rim, stored);
    through
}

/// Lets what lies in the middle go on in `rim` pieces of `size` before and behind it.
fn go_on(values: &mut [f32], rim: usize, size: usize) {
    let count = values.len() / size - 2 * rim;
    let last = rim + count - 1;
    for m in 1..=rim {
        let mirrored = m.min(count - 1);
        for n in 0..size {
            values[(rim - m) * size + n] = 2.0 * values[rim * size + n] - values[(rim + mirrored) * size + n];
            values[(last + m) * size + n] = 2.0 * values[last * size + n] - values[(last - mirrored) * size + n];
        }
    }
}

/// Filters row `at` of `count`, across them.
fn filter_rows<'a>(taps: &[f32; TAPS + 1], at: usize, count: usize, row: impl Fn(usize) -> &'a [f32], out: &mut [f32]) {
    let last = count - 1;
    let middle = row(at);
    if at >= TAPS && at + TAPS <= last {
        let beside = [1, 1, 2, 2, 3, 3];
        let rows = [at - 1, at + 1, at - 2, at + 2, at - 3, at + 3].map(|at| &row(at)[..out.len()]);
        let middle = &middle[..out.len()];
        for i in 0..out.len() {
            let mut sum = middle[i];
            for n in 0..2 * TAPS {
                sum += taps[beside[n]] * (rows[n][i] - middle[i]);
            }
            out[i] = sum;
        }
        return;
    }
    out.copy_from_slice(middle);
    for m in 1..=TAPS {
        let tap = taps[m];
        for is_behind in [false, true] {
            let beyond = if is_behind { at + m > last } else { at < m };
            if !beyond {
                let other = row(if is_behind { at + m } else { at - m });
                out.iter_mut().zip(other).zip(middle).for_each(|((out, other), middle)| *out += tap * (other - middle));
                continue;
            }
            // 2·v(face) − v(mirrored).
            let (face, mirrored) =
                if is_behind { (last, 2 * last as isize - (at + m) as isize) } else { (0, m as isize - at as isize) };
            let mirrored = mirrored.clamp(0, last as isize) as usize;
            let both = row(face).iter().zip(row(mirrored));
            for ((out, (face, mirrored)), middle) in out.iter_mut().zip(both).zip(middle) {
                *out += tap * ((2.0 * face - mirrored) - middle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_over_the_filtered_lattice_is_the_papers_kernel() {
        let shape = KernelShape::default();
        let taps = taps(&shape);
        let both = |x: f64| {
            let beside = |k: usize| taps[k] * (spline(x - k as f64) + spline(x + k as f64));
            taps[0] * spline(x) + beside(1) + beside(2) + beside(3)
        };
        println!("{taps:?}");
        let mut worst = 0.0f64;
        // A step edge: the integral of the kernel.
        let mut edge = [0.0f64; 2];
        for n in 0..10_000 {
            let x = f64::from(n) / 1000.0 - 5.0;
            worst = worst.max((both(x) - normalized(x, &shape)).abs());
            let sums = [0, 1].map(|side| {
                (0..6)
                    .map(|i| if side == 0 { both(x - f64::from(i)) } else { normalized(x - f64::from(i), &shape) })
                    .sum::<f64>()
            });
            edge[0] += (sums[0] - sums[1]).powi(2) / 10_000.0;
            edge[1] = edge[1].max((sums[0] - sums[1]).abs());
        }
        println!("kernel {worst:e}, edge rms {:e} max {:e}", edge[0].sqrt(), edge[1]);
        assert!((taps[0] + 2.0 * (taps[1] + taps[2] + taps[3]) - 1.0).abs() < 1e-12);
        // 0.34 % of an edge at worst.
        assert!(edge[0].sqrt() < 1.7e-3 && edge[1] < 3.5e-3 && worst < 7e-3, "{worst} {edge:?}");
    }
}
