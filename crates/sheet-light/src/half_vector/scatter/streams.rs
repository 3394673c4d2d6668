//! Diffuse light in the cells: two streams along the light, layers added column by column, and what flows sideways between columns.
//!
//! Each face of a column has ψ = F + B, the flux with the light plus that against it, per area. What arrives at a face leaves it:
//! layers conduct and give as [`Layer`] says, the first and the last face let out ψ, and columns side by side exchange
//! 2/(3σ_tr)·∇ψ, the diffusion that goes with two streams in Eddington's approximation. So there is one equation a face, and their
//! sum is the balance of all power. Where a row of cells goes out into the open, light that comes from its last mean free path leaves by the side.

use super::grid::{Column, GridLine, GridNode, LightGrid};
use super::layer::{Layer, Optics};
use super::medium::Cell;
use super::slant;
use rayon::prelude::*;

/// Share of the grid's width that is the longest mean free path on which light flows between columns.
const LONGEST_WAY: f64 = 0.5;

/// Resistance of a mean free path to ψ: 3/2, of diffusion.
const RESISTANCE: f64 = 1.5;

/// Share of ψ that leaves from the last mean free path before the open, where that is cells deep: ψ then falls to 0 where it would beyond a
/// face that light leaves by at once, 2/3 of a mean free path outside. With u = 1 − e^(−3τ/2) for the way into the medium,
/// d/du[u(1 − u)·dψ/du] = s·ψ; its solution without a pole at 0 is a hypergeometric function, of which the logarithm at 1 has the
/// constant −(digamma(a) + digamma(b) + 2γ), a + b = 1, ab = s. That is 1 for this s.
const OPEN: f64 = 0.423;

/// Beside a column: before it and behind it along x, along y.
const SIDES: usize = 4;

/// The equations of one channel. Faces: row by row, face by face in a row; cells and their faces likewise.
pub(crate) struct Streams {
    pub(crate) columns: [usize; 2],
    pub(crate) layers: usize,
    /// By cell: a and b times the area.
    pub(crate) conductance: Vec<f64>,
    pub(crate) through: Vec<f64>,
    /// By face: to the next column along x, along y.
    pub(crate) across: [Vec<f64>; 2],
    /// By face: out by the sides.
    pub(crate) open: Vec<[f64; SIDES]>,
    /// By cell: power that the beam gives to its first face and to its last, s↑ and s↓ of all light.
    pub(crate) given: Vec<[f64; 2]>,
    /// By face: their sum.
    pub(crate) source: Vec<f64>,
    /// By face: all that leaves it for ψ = 1.
    pub(crate) outflow: Vec<f64>,
    /// Areas of the first face and of the last.
    pub(crate) ends: [f64; 2],
}

/// What the equations are made of.
pub(crate) struct Sources<'a> {
    pub(crate) grid: &'a LightGrid,
    pub(crate) cells: &'a [Cell],
    pub(crate) channel: usize,
    /// By cell: power of the beam that comes in.
    pub(crate) incoming: &'a [f64],
    /// By cell: share that all but the volumes let through; empty for all.
    pub(crate) passing: &'a [f64],
}

/// The optics of a cell without what stays with the beam, for a way of `length`.
pub(crate) fn optics(cell: &Cell, channel: usize, length: f64) -> Optics {
    let [extinction, scattering, forward, ahead] =
        [cell.extinction, cell.scattering, cell.forward, cell.ahead].map(|v| f64::from(v[channel]));
    let left = extinction - ahead;
    let scattered = scattering - ahead;
    Optics {
        tau: left.max(0.0) * length,
        omega: if left > 0.0 { (scattered / left).clamp(0.0, 1.0) } else { 0.0 },
        asymmetry: if scattered > 0.0 { (forward - ahead) / scattered } else { 0.0 },
    }
}

/// σ_tr = σ_t − σ_s·g.
pub(crate) fn transport(cell: &Cell, channel: usize) -> f64 {
    f64::from((cell.extinction[channel] - cell.forward[channel]).max(0.0))
}

impl Streams {
    pub(crate) fn new(sources: &Sources<'_>) -> Self {
        let grid = sources.grid;
        let [width, height] = grid.columns;
        let layers = grid.layers;
        let cells = grid.cells();
        let faces = width * height * (layers + 1);
        let mut out = Self {
            columns: grid.columns,
            layers,
            conductance: vec![0.0; cells],
            through: vec![0.0; cells],
            across: [vec![0.0; faces], vec![0.0; faces]],
            open: vec![[0.0; SIDES]; faces],
            given: vec![[0.0; 2]; cells],
            source: vec![0.0; faces],
            outflow: vec![0.0; faces],
            ends: [0.0, layers as f64].map(|face| grid.area(face)),
        };
        out.add_layers(sources);
        out.add_sides(sources);
        out.add_up();
        out
    }

    /// Fills in what goes along the columns.
    fn add_layers(&mut self, sources: &Sources<'_>) {
        let layers = self.layers;
        let width = self.columns[0];
        let rows = self
            .conductance
            .par_chunks_mut(layers * width)
            .zip(self.through.par_chunks_mut(layers * width))
            .zip(self.given.par_chunks_mut(layers * width));
        rows.enumerate().for_each(|(y, ((conductance, through), given))| {
            for k in 0..layers * width {
                let cell = y * layers * width + k;
                let area = sources.grid.area((k / width) as f64 + 0.5);
                let length = sources.grid.length(Column { x: k % width, y });
                let layer = Layer::new(&optics(&sources.cells[cell], sources.channel, length));
                let passing = sources.passing.get(cell).copied().unwrap_or(1.0);
                // What is opaque stands at the far face of a layer and sends nothing back: ψ is J there, so that
                // ψ' = (through·ψ + s↓)/(1 + own), and what the layer gives back to its first face is less by that.
                let back = (1.0 - passing) * layer.through / (1.0 + layer.conductance);
                (conductance[k], through[k]) =
                    ((layer.conductance - back * layer.through) * area, layer.through * area * passing);
                let [up, down] = layer.sources;
                given[k] = [up + back * down, down * passing].map(|s| s * sources.incoming[cell]);
            }
        });
    }

    /// Fills in what goes between columns and out by the sides.
    fn add_sides(&mut self, sources: &Sources<'_>) {
        let [width, height] = self.columns;
        let layers = self.layers;
        let mut open = vec![[0.0; SIDES]; self.conductance.len()];
        let mut line = Line::default();
        for direction in 0..2 {
            let (count, step) = [(width, 1), (height, layers * width)][direction];
            for start in (0..self.conductance.len()).filter(|k| (k / step).is_multiple_of(count)) {
                let cells = GridLine { start, step, count };
                line.set(sources, direction, cells);
                for i in 0..count {
                    let cell = cells.index(i);
                    open[cell][2 * direction] = line.open[0][i];
                    open[cell][2 * direction + 1] = line.open[1][i];
                    // Half of a layer belongs to each of its faces.
                    let face = cell + cell / (layers * width) * width;
                    self.across[direction][face] += 0.5 * line.across[i];
                    self.across[direction][face + width] += 0.5 * line.across[i];
                }
            }
        }
        let shares = slant::shares(sources);
        for (cell, open) in open.iter().enumerate() {
            let share = 0.5 * shares[cell];
            let face = cell + cell / (layers * width) * width;
            for side in 0..SIDES {
                self.open[face][side] += share * open[side];
                self.open[face + width][side] += share * open[side];
            }
        }
    }

    /// Sums all that leaves each face.
    fn add_up(&mut self) {
        let [width, height] = self.columns;
        let layers = self.layers;
        let row = (layers + 1) * width;
        for k in 0..row * height {
            let [x, face] = [k % width, k / width % (layers + 1)];
            let y = k / row;
            let cell = (y * layers + face) * width + x;
            let (before, down) = if face == 0 {
                (self.ends[0], 0.0)
            } else {
                (self.conductance[cell - width], self.given[cell - width][1])
            };
            let (behind, up) =
                if face == layers { (self.ends[1], 0.0) } else { (self.conductance[cell], self.given[cell][0]) };
            self.source[k] = down + up;
            let [left, above] = [(x > 0, 1), (y > 0, row)];
            let mut sum = before + behind + self.across[0][k] + self.across[1][k];
            sum += if left.0 { self.across[0][k - left.1] } else { 0.0 };
            sum += if above.0 { self.across[1][k - above.1] } else { 0.0 };
            self.outflow[k] = sum + self.open[k].iter().sum::<f64>();
        }
    }

    /// Number of faces.
    pub(crate) fn faces(&self) -> usize {
        self.outflow.len()
    }

    /// Net flux at a face per area: along x, along y, with the light.
    pub(crate) fn flux(&self, grid: &LightGrid, psi: &[f64], k: usize) -> [f64; 3] {
        let [width, _] = self.columns;
        let layers = self.layers;
        let row = (layers + 1) * width;
        let [x, face] = [k % width, k / width % (layers + 1)];
        let y = k / row;
        let node = GridNode { column: Column { x, y }, level: face };
        let along = self.along(psi, node) / grid.area(face as f64);
        let [mut right, mut up] = [0.0; 2];
        let share = if face == 0 || face == layers { 0.5 } else { 1.0 };
        let spread = grid.spread(face as f64) * grid.depth * share;
        let has = [x > 0, x + 1 < width, y > 0, y + 1 < self.columns[1]];
        let across = |direction: usize, k: usize, next: usize| self.across[direction][k] * (psi[k] - psi[next]);
        let open = |side: usize| self.open[k][side] * psi[k];
        right += if has[1] { across(0, k, k + 1) } else { 0.0 } + if has[0] { across(0, k - 1, k) } else { 0.0 };
        up += if has[3] { across(1, k, k + row) } else { 0.0 } + if has[2] { across(1, k - row, k) } else { 0.0 };
        right += open(1) - open(0);
        up += open(3) - open(2);
        [0.5 * right / (spread * grid.step[1]), 0.5 * up / (spread * grid.step[0]), along]
    }

    /// J at a face: the mean of what leaves the layer before and what enters the one behind; sideways flow is the difference.
    fn along(&self, psi: &[f64], node: GridNode) -> f64 {
        let GridNode { column: Column { x, y }, level: face } = node;
        let width = self.columns[0];
        let layers = self.layers;
        let k = (y * (layers + 1) + face) * width + x;
        let cell = (y * layers + face) * width + x;
        let before = match face {
            0 => -self.ends[0] * psi[k],
            _ => {
                let layer = cell - width;
                self.through[layer] * psi[k - width] - self.conductance[layer] * psi[k] + self.given[layer][1]
            }
        };
        let behind = match face {
            _ if face == layers => self.ends[1] * psi[k],
            _ => self.conductance[cell] * psi[k] - self.through[cell] * psi[k + width] - self.given[cell][0],
        };
        0.5 * (before + behind)
    }
}

/// A line of cells along a row or across rows.
#[derive(Default)]
struct Line {
    /// From each cell to the next.
    across: Vec<f64>,
    /// Out to the lower side and to the upper.
    open: [Vec<f64>; 2],
    optical: Vec<f64>,
    beyond: [Vec<f64>; 2],
}

impl Line {
    fn set(&mut self, sources: &Sources<'_>, direction: usize, cells: GridLine) {
        let GridLine { start, count, .. } = cells;
        let grid = sources.grid;
        let layer = start / grid.columns[0] % grid.layers;
        let spread = grid.spread(layer as f64 + 0.5);
        let along = grid.step[direction] * spread;
        let height = grid.step[1 - direction] * spread * grid.depth;
        let thinnest = 1.0 / (LONGEST_WAY * count as f64);
        let tau = |i: usize| transport(&sources.cells[cells.index(i)], sources.channel) * along;
        self.optical.clear();
        self.optical.extend((0..count).map(tau));
        let mut depth = 0.0;
        self.beyond[0].clear();
        for tau in &self.optical {
            self.beyond[0].push(libm::exp(-RESISTANCE * depth));
            depth += tau;
        }
        self.beyond[1].clear();
        self.beyond[1].resize(count, 1.0);
        depth = 0.0;
        for i in (0..count).rev() {
            self.beyond[1][i] = libm::exp(-RESISTANCE * depth);
            depth += self.optical[i];
        }
        let optical = &self.optical;
        let exchange = |i: usize| {
            if i + 1 == count {
                return 0.0;
            }
            // Light that is out in the open does not come back.
            let inside = (1.0 - self.beyond[1][i]) * (1.0 - self.beyond[0][i + 1]);
            height * inside / (RESISTANCE * 0.5 * (optical[i].max(thinnest) + optical[i + 1].max(thinnest)))
        };
        self.across.clear();
        self.across.extend((0..count).map(exchange));
        let thin = libm::exp(-0.5 * RESISTANCE * depth);
        for side in 0..2 {
            let leaves = |i: usize| {
                let here = -libm::expm1(-RESISTANCE * optical[i]);
                let open = here.max(thin);
                let share = self.beyond[side][i] * here * (OPEN + (1.0 - OPEN) * open);
                height * share / (1.0 + 0.5 * RESISTANCE * optical[i])
            };
            self.open[side].clear();
            self.open[side].extend((0..count).map(leaves));
        }
    }
}
