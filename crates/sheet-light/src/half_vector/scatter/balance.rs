//! Where the light of one lamp stays: what comes in is reflected, comes through, leaves by the sides, or is absorbed.

use super::beam::Beam;
use super::grid::{Column, LightGrid};
use super::medium::Cell;
use super::streams::{Streams, optics};

/// Powers by channel: irradiance of the light times the area that it falls on. Each is summed where it happens, so what is missing
/// in their sum is the error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Balance {
    /// All that falls on the box about the volumes.
    pub incident: [f64; 3],
    /// Leaves to the side of the light.
    pub reflected: [f64; 3],
    /// Leaves to the other side, scattered or not.
    pub transmitted: [f64; 3],
    /// Leaves between them.
    pub sides: [f64; 3],
    /// Ends in the media, or on what else casts shadows.
    pub absorbed: [f64; 3],
}

impl Balance {
    /// Incident power that is nowhere else, as a share of it; 0 without any.
    pub fn missing(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| {
            let found = self.reflected[c] + self.transmitted[c] + self.sides[c] + self.absorbed[c];
            if self.incident[c] > 0.0 { 1.0 - found / self.incident[c] } else { 0.0 }
        })
    }

    /// The share of a channel's beam in the balance, all but what its scattered light does.
    pub(crate) fn add_beam(&mut self, channel: usize, beam: &Beam) {
        self.incident[channel] = beam.incident;
        self.transmitted[channel] = beam.transmitted;
        self.sides[channel] = beam.sides;
        self.absorbed[channel] = beam.blocked;
    }

    /// Without back scattering what is not scattered ahead is gone, to the light's side.
    pub(crate) fn add_forward(&mut self, channel: usize, grid: &LightGrid, cells: &[Cell], beam: &Beam) {
        for (k, cell) in cells.iter().enumerate() {
            let Lost { power, scattered } = lost(grid, cell, k, channel, beam);
            self.reflected[channel] += power * scattered;
            self.absorbed[channel] += power * (1.0 - scattered);
        }
    }

    /// What two streams do.
    pub(crate) fn add_streams(
        &mut self,
        channel: usize,
        grid: &LightGrid,
        cells: &[Cell],
        beam: &Beam,
        streams: &Streams,
        psi: &[f64],
    ) {
        let [width, _] = grid.columns;
        let layers = grid.layers;
        for (k, cell) in cells.iter().enumerate() {
            let face = k + k / (layers * width) * width;
            let [up, down] = streams.given[k];
            let of_beam = lost(grid, cell, k, channel, beam).power - up - down;
            let of_streams = (streams.conductance[k] - streams.through[k]) * (psi[face] + psi[face + width]);
            self.absorbed[channel] += of_beam + of_streams;
        }
        for (k, psi) in psi.iter().enumerate() {
            let face = k / width % (layers + 1);
            self.reflected[channel] += if face == 0 { streams.ends[0] * psi } else { 0.0 };
            self.transmitted[channel] += if face == layers { streams.ends[1] * psi } else { 0.0 };
            self.sides[channel] += streams.open[k].iter().sum::<f64>() * psi;
        }
    }

    /// For a light of this intensity.
    pub(crate) fn scaled(self, intensity: [f32; 3]) -> Self {
        let scale = |powers: [f64; 3]| [0, 1, 2].map(|c| powers[c] * f64::from(intensity[c]));
        Self {
            incident: scale(self.incident),
            reflected: scale(self.reflected),
            transmitted: scale(self.transmitted),
            sides: scale(self.sides),
            absorbed: scale(self.absorbed),
        }
    }
}

/// What a cell takes from its beam.
pub(super) struct Lost {
    pub(super) power: f64,
    /// The share of it that is scattered.
    pub(super) scattered: f64,
}

/// What cell `k` takes from the beam of a channel.
pub(super) fn lost(grid: &LightGrid, cell: &Cell, k: usize, channel: usize, beam: &Beam) -> Lost {
    let [width, _] = grid.columns;
    let column = Column { x: k % width, y: k / (width * grid.layers) };
    let optics = optics(cell, channel, grid.length(column));
    Lost { power: -beam.incoming[k] * libm::expm1(-optics.tau), scattered: optics.omega }
}
