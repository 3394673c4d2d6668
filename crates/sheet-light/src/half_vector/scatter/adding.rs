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
    streams: &'a Streams,
    /// Numbers of a row.
    row: usize,
    /// By face: 1 over what it and everything behind it take, for one column.
    taken: Vec<f64>,
}

/// Solves for one channel.
pub(crate) fn solve(streams: &Streams) -> Solution {
    let adding = Adding::new(streams);
    let n = streams.faces();
    let mut psi = vec![0.0; n];
    let mut left = streams.source.clone();
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
    fn new(streams: &'a Streams) -> Self {
        let width = streams.columns[0];
        let layers = streams.layers;
        let row = (layers + 1) * width;
        let mut taken = vec![0.0; streams.faces()];
        taken.par_chunks_mut(row).enumerate().for_each(|(y, taken)| {
            for k in (0..row).rev() {
                let outflow = streams.outflow[y * row + k];
                let through = if k + width < row { streams.through[y * layers * width + k] } else { 0.0 };
                let behind = if k + width < row { taken[k + width] } else { 0.0 };
                taken[k] = 1.0 / (outflow - through * through * behind);
            }
        });
        Self { streams, row, taken }
    }

    /// Adds layers along all columns: what `left` makes where nothing comes back from the sides.
    fn along(&self, left: &[f64], out: &mut [f64]) {
        let row = self.row;
        let width = self.streams.columns[0];
        let layers = self.streams.layers;
        out.par_chunks_mut(row).enumerate().for_each(|(y, out)| {
            let taken = &self.taken[y * row..];
            let through = &self.streams.through[y * layers * width..];
            out.copy_from_slice(&left[y * row..(y + 1) * row]);
            for k in (0..row - width).rev() {
                out[k] += through[k] * taken[k + width] * out[k + width];
            }
            (0..width).for_each(|k| out[k] *= taken[k]);
            for k in width..row {
                let psi = taken[k] * (out[k] + through[k - width] * out[k - width]);
                out[k] = if psi.abs() < END { 0.0 } else { psi };
            }
        });
    }

    /// What leaves each face for `psi`, less what comes in from others.
    fn apply(&self, psi: &[f64], out: &mut [f64]) {
        let row = self.row;
        let width = self.streams.columns[0];
        let layers = self.streams.layers;
        let streams = self.streams;
        let height = streams.columns[1];
        out.par_chunks_mut(row).enumerate().for_each(|(y, out)| {
            let first = y * row;
            let psi_of_row = &psi[first..first + row];
            let through = &streams.through[y * layers * width..];
            for k in 0..row {
                out[k] = streams.outflow[first + k] * psi_of_row[k];
            }
            for k in width..row {
                out[k] -= through[k - width] * psi_of_row[k - width];
                out[k - width] -= through[k - width] * psi_of_row[k];
            }
            for face in (0..row).step_by(width) {
                for k in face..face + width - 1 {
                    let across = streams.across[0][first + k];
                    out[k] -= across * psi_of_row[k + 1];
                    out[k + 1] -= across * psi_of_row[k];
                }
            }
            if y > 0 {
                (0..row).for_each(|k| out[k] -= streams.across[1][first - row + k] * psi[first - row + k]);
            }
            if y + 1 < height {
                (0..row).for_each(|k| out[k] -= streams.across[1][first + k] * psi[first + row + k]);
            }
        });
    }

    /// A sum over all faces, row by row, so that it knows no threads.
    fn sum(&self, term: impl Fn(usize) -> f64 + Sync) -> f64 {
        let rows = self.taken.len() / self.row;
        let row_sum = |y: usize| (y * self.row..(y + 1) * self.row).map(&term).sum::<f64>();
        (0..rows).into_par_iter().map(row_sum).collect::<Vec<f64>>().into_iter().sum()
    }

    fn each(&self, plane: &mut [f64], change: impl Fn(usize, &mut f64) + Sync) {
        let row = |(y, row): (usize, &mut [f64])| {
            row.iter_mut().enumerate().for_each(|(k, value)| change(y * self.row + k, value));
        };
        plane.par_chunks_mut(self.row).enumerate().for_each(row);
    }
}
