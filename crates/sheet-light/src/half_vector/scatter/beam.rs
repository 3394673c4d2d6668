//! Light that goes ahead: the unscattered and what is scattered forward, marched through the layers (Eqs. 3 and 5).
//!
//! The paper's I₍ₖ₊₁₎ = g_k + T_k·I_k with g = a·τ·p gains energy where a·τ + e^(−τ) > 1. The share that is scattered in a layer is
//! −ω·expm1(−τ), whatever its thickness, and here a layer may be scattered in many times: of light that stays ahead with the share f
//! of each scattering, e^(−(1 − ωf)τ) is left. What that has more than e^(−τ) was scattered, and spreads on its way by convolution.

use super::blur::{Kernel, convolve};
use super::grid::{Column, LightGrid};
use super::medium::Cell;

/// Power below which light of the beam is at its end: what is smaller may be no normal number, and slow.
const END: f64 = 1e-30;

/// What a channel of a light does on its way. Powers are those of a light of intensity 1; flat planes and rows as in [`LightGrid`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Beam {
    /// By face: power of what was scattered ahead.
    pub(crate) ahead: Vec<f64>,
    /// By cell: power that comes in, scattered ahead or not.
    pub(crate) incoming: Vec<f64>,
    pub(crate) incident: f64,
    pub(crate) transmitted: f64,
    /// Of light ahead.
    pub(crate) sides: f64,
    /// By what casts shadows and is no volume.
    pub(crate) blocked: f64,
    /// Convolutions.
    pub(crate) passes: u64,
}

/// What a beam goes through.
pub(crate) struct Path<'a> {
    pub(crate) grid: &'a LightGrid,
    pub(crate) cells: &'a [Cell],
    /// Power that enters each column, by channel.
    pub(crate) entering: &'a [Vec<f64>; 3],
    /// Transmittance of all but the volumes at each face, by channel; empty where nothing casts shadows.
    pub(crate) others: &'a [[f32; 3]],
    /// Half angle of the cone that light ahead spreads into, radians.
    pub(crate) cone: f64,
}

/// Power of a channel on its way through the layers, by column.
struct Powers {
    /// Not scattered.
    beam: Vec<f64>,
    /// Scattered ahead.
    ahead: Vec<f64>,
}

impl Path<'_> {
    /// Share that all but the volumes leave between two faces.
    pub(crate) fn passing(&self, face: usize, column: Column, channel: usize) -> f64 {
        let [before, behind] = [face, face + 1].map(|f| self.others_at(f, column, channel));
        if before > 0.0 { (behind / before).min(1.0) } else { 0.0 }
    }

    fn others_at(&self, face: usize, column: Column, channel: usize) -> f64 {
        let [width, _] = self.grid.columns;
        let index = (column.y * (self.grid.layers + 1) + face) * width + column.x;
        self.others.get(index).map_or(1.0, |t| f64::from(t[channel]))
    }

    /// Marches one channel.
    pub(crate) fn march(&self, channel: usize) -> Beam {
        let [width, height] = self.grid.columns;
        let layers = self.grid.layers;
        let n = width * height;
        let mut out = Beam {
            ahead: vec![0.0; n * (layers + 1)],
            incoming: vec![0.0; n * layers],
            incident: self.entering[channel].iter().sum(),
            ..Beam::default()
        };
        let first =
            |k: usize| self.entering[channel][k] * self.others_at(0, Column { x: k % width, y: k / width }, channel);
        let mut powers = Powers { beam: (0..n).map(first).collect(), ahead: vec![0.0; n] };
        out.blocked = out.incident - powers.beam.iter().sum::<f64>();
        let mut since = None;
        for layer in 0..layers {
            let is_any = self.through(channel, layer, &mut powers, &mut out);
            // The cone begins where something scatters.
            since = since.or(is_any.then_some(layer));
            if let Some(since) = since {
                let kernels = self.kernels(layer, since);
                let before: f64 = powers.ahead.iter().sum();
                convolve(&mut powers.ahead, width, &kernels, 0.0);
                out.sides += before - powers.ahead.iter().sum::<f64>();
                out.passes += kernels.iter().filter(|k| !k.is_point()).count() as u64;
            }
            for (k, ahead) in powers.ahead.iter().enumerate() {
                out.ahead[(k / width * (layers + 1) + layer + 1) * width + k % width] = *ahead;
            }
        }
        out.transmitted = powers.beam.iter().sum::<f64>() + powers.ahead.iter().sum::<f64>();
        out
    }

    /// One layer; whether it scatters.
    fn through(&self, channel: usize, layer: usize, powers: &mut Powers, out: &mut Beam) -> bool {
        let [width, _] = self.grid.columns;
        let mut is_any = false;
        for (k, (beam, ahead)) in powers.beam.iter_mut().zip(&mut powers.ahead).enumerate() {
            let column = Column { x: k % width, y: k / width };
            let cell = (column.y * self.grid.layers + layer) * width + column.x;
            let length = self.grid.length(column);
            let tau = f64::from(self.cells[cell].extinction[channel]) * length;
            let stays = f64::from(self.cells[cell].ahead[channel]) * length;
            is_any |= stays > 0.0;
            out.incoming[cell] = *beam + *ahead;
            let unscattered = libm::exp(-tau);
            let remaining = libm::exp(stays - tau);
            let passing = self.passing(layer, column, channel);
            // The first form keeps the digits of thin layers, the second has no powers that are too large.
            let gained = if stays < 1.0 { unscattered * libm::expm1(stays) } else { remaining - unscattered };
            let scattered = *ahead * remaining + *beam * gained;
            out.blocked += (1.0 - passing) * (scattered + *beam * unscattered);
            let flush = |power: f64| if power < END { 0.0 } else { power };
            *beam = flush(*beam * unscattered * passing);
            *ahead = flush(scattered * passing);
        }
        is_any
    }

    /// How a layer spreads light ahead that has come from all over the layers since `since`: the mean square of its distance
    /// from where it would have come is tan²·z²/3, and these are differences of that.
    fn kernels(&self, layer: usize, since: usize) -> [Kernel; 2] {
        let behind = |n: usize| (n - since) as f64 * self.grid.depth;
        let near = behind(layer);
        let far = behind(layer + 1);
        let slope = libm::tan(self.cone);
        let variance = slope * slope * (far * far - near * near) / 3.0;
        [0, 1].map(|a| {
            let cells = self.grid.step[a] * self.grid.spread(layer as f64 + 0.5);
            // No wider than the buffer.
            let most = 0.25 * (self.grid.columns[a] * self.grid.columns[a]) as f64;
            Kernel::new((variance / (cells * cells)).min(most))
        })
    }
}
