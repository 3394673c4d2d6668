//! Where the light of one lamp stays: what comes in is reflected, comes through, leaves by the sides, or is absorbed.

use super::beam::Beam;
use super::grid::LightGrid;
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
        for (at, cell) in cells.iter().enumerate() {
            let (lost, omega) = lost(grid, cell, (at, channel), beam);
            self.reflected[channel] += lost * omega;
            self.absorbed[channel] += lost * (1.0 - omega);
        }
    }

    /// What two streams do.
    pub(crate) fn add_streams(
        &mut self,
        channel: usize,
        (grid, cells): (&LightGrid, &[Cell]),
        beam: &Beam,
        streams: &Streams,
        psi: &[f64],
    ) {
        let [width, _] = grid.columns;
        let layers = grid.layers;
        for (at, cell) in cells.iter().enumerate() {
            let face = at + at / (layers * width) * width;
            let [up, down] = streams.given[at];
            let of_beam = lost(grid, cell, (at, channel), beam).0 - up - down;
            let of_streams = (streams.own[at] - streams.through[at]) * (psi[face] + psi[face + width]);
            self.absorbed[channel] += of_beam + of_streams;
        }
        for (at, psi) in psi.iter().enumerate() {
            let face = at / width % (layers + 1);
            self.reflected[channel] += if face == 0 { streams.ends[0] * psi } else { 0.0 };
            self.transmitted[channel] += if face == layers { streams.ends[1] * psi } else { 0.0 };
            self.sides[channel] += streams.open[at].iter().sum::<f64>() * psi;
        }
    }

    /// For a light of this intensity.
    pub(crate) fn scaled(self, intensity: [f32; 3]) -> Self {
        let of = |v: [f64; 3]| [0, 1, 2].map(|c| v[c] * f64::from(intensity[c]));
        Self {
            incident: of(self.incident),
            reflected: of(self.reflected),
            transmitted: of(self.transmitted),
            sides: of(self.sides),
            absorbed: of(self.absorbed),
        }
    }
}

/// Power that a cell takes from its beam, and the share of it that is scattered.
pub(super) fn lost(grid: &LightGrid, cell: &Cell, (at, channel): (usize, usize), beam: &Beam) -> (f64, f64) {
    let [width, _] = grid.columns;
    let optics = optics(cell, channel, grid.length([at % width, at / (width * grid.layers)]));
    (-beam.incoming[at] * libm::expm1(-optics.tau), optics.omega)
}
