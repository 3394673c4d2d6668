//! Solves the equations of diffuse light: layers added column by column, corrected for what flows sideways until all power is there.
//!
//! Column by column, elimination from the far face to the light leaves for each face what everything behind it takes, and a march from
//! the light on gives ψ: that is the adding of layers, T₁T₂/(1 − R₁R₂), and exact where columns are alike, however thick. What
//! flows between columns is found by conjugate gradients with that as their preconditioner. The sum of what is left over is the
//! error of the balance of power, so its size tells when to stop.

use super::streams::Streams;
use rayon::prelude::*;

/// Share of all sources that may be left over.
const LEFT_OVER: f64 = 1e-7;

/// Most corrections: the balance says what is missing then.
const MOST: u64 = 2000;

/// ψ below which there is none: what fades through many thick layers comes to numbers that are not normal, and slow.
const END: f64 = 1e-60;

/// ψ at all faces.
pub(crate) struct Solution {
    pub(crate) psi: Vec<f64>,
    /// Corrections, one at least.
    pub(crate) passes: u64,
}

/// What stays the same from correction to correction.
struct Adding<'a> {
    of: &'a Streams,
    /// Numbers of a row.
    row: usize,
    /// By face: 1 over what it and everything behind it take, for one column.
    taken: Vec<f64>,
}

/// Solves for one channel.
pub(crate) fn solve(of: &Streams) -> Solution {
    let adding = Adding::new(of);
    let n = of.faces();
    let mut psi = vec![0.0; n];
    let mut left = of.source.clone();
    let mut to = vec![0.0; n];
    let mut change = vec![0.0; n];
    let mut across = vec![0.0; n];
    let enough = LEFT_OVER * adding.sum(|k| left[k].abs());
    let mut before = 1.0;
    for pass in 0..MOST {
        if adding.sum(|k| left[k].abs()) <= enough {
            return Solution { psi, passes: pass };
        }
        adding.along(&left, &mut change);
        let now = adding.sum(|k| left[k] * change[k]);
        let keep = if pass == 0 { 0.0 } else { now / before };
        adding.each(&mut to, |k, to| *to = change[k] + keep * *to);
        adding.apply(&to, &mut across);
        let step = now / adding.sum(|k| to[k] * across[k]);
        if !step.is_finite() {
            return Solution { psi, passes: pass };
        }
        adding.each(&mut psi, |k, psi| *psi += step * to[k]);
        adding.each(&mut left, |k, left| *left -= step * across[k]);
        before = now;
    }
    Solution { psi, passes: MOST }
}

impl<'a> Adding<'a> {
    fn new(of: &'a Streams) -> Self {
        let width = of.columns[0];
        let layers = of.layers;
        let row = (layers + 1) * width;
        let mut taken = vec![0.0; of.faces()];
        taken.par_chunks_mut(row).enumerate().for_each(|(y, taken)| {
            for at in (0..row).rev() {
                let all = of.all[y * row + at];
                let through = if at + width < row { of.through[y * layers * width + at] } else { 0.0 };
                let behind = if at + width < row { taken[at + width] } else { 0.0 };
                taken[at] = 1.0 / (all - through * through * behind);
            }
        });
        Self { of, row, taken }
    }

    /// Adds layers along all columns: what `left` makes where nothing comes back from the sides.
    fn along(&self, left: &[f64], out: &mut [f64]) {
        let row = self.row;
        let width = self.of.columns[0];
        let layers = self.of.layers;
        out.par_chunks_mut(row).enumerate().for_each(|(y, out)| {
            let taken = &self.taken[y * row..];
            let through = &self.of.through[y * layers * width..];
            out.copy_from_slice(&left[y * row..(y + 1) * row]);
            for at in (0..row - width).rev() {
                out[at] += through[at] * taken[at + width] * out[at + width];
            }
            (0..width).for_each(|at| out[at] *= taken[at]);
            for at in width..row {
                let psi = taken[at] * (out[at] + through[at - width] * out[at - width]);
                out[at] = if psi.abs() < END { 0.0 } else { psi };
            }
        });
    }

    /// What leaves each face for `psi`, less what comes in from others.
    fn apply(&self, psi: &[f64], out: &mut [f64]) {
        let row = self.row;
        let width = self.of.columns[0];
        let layers = self.of.layers;
        let of = self.of;
        let height = of.columns[1];
        out.par_chunks_mut(row).enumerate().for_each(|(y, out)| {
            let first = y * row;
            let own = &psi[first..first + row];
            let through = &of.through[y * layers * width..];
            for at in 0..row {
                out[at] = of.all[first + at] * own[at];
            }
            for at in width..row {
                out[at] -= through[at - width] * own[at - width];
                out[at - width] -= through[at - width] * own[at];
            }
            for face in (0..row).step_by(width) {
                for at in face..face + width - 1 {
                    let across = of.across[0][first + at];
                    out[at] -= across * own[at + 1];
                    out[at + 1] -= across * own[at];
                }
            }
            if y > 0 {
                (0..row).for_each(|at| out[at] -= of.across[1][first - row + at] * psi[first - row + at]);
            }
            if y + 1 < height {
                (0..row).for_each(|at| out[at] -= of.across[1][first + at] * psi[first + row + at]);
            }
        });
    }

    /// A sum over all faces, row by row, so that it knows no threads.
    fn sum(&self, of: impl Fn(usize) -> f64 + Sync) -> f64 {
        let rows = self.taken.len() / self.row;
        let one = |y: usize| (y * self.row..(y + 1) * self.row).map(&of).sum::<f64>();
        (0..rows).into_par_iter().map(one).collect::<Vec<f64>>().into_iter().sum()
    }

    fn each(&self, plane: &mut [f64], of: impl Fn(usize, &mut f64) + Sync) {
        let row = |(y, row): (usize, &mut [f64])| {
            row.iter_mut().enumerate().for_each(|(at, value)| of(y * self.row + at, value));
        };
        plane.par_chunks_mut(self.row).enumerate().for_each(row);
    }
}
