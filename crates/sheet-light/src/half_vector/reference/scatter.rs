//! Scattered light in f64, as plainly as it can be said: convolutions in two dimensions, layers by their reflectance and
//! transmittance, and one face after the other until nothing changes.
//!
//! Cells and what fills them are those of the fast form; shadows of others are left out, as in all of this twin.

use crate::Volume;
use crate::half_vector::light::camera::camera_of;
use crate::half_vector::params::{HalfParams, Scattering};
use crate::half_vector::scatter;
use crate::half_vector::scatter::grid::{Column, GridNode, GridPlace, LightGrid};
use crate::half_vector::scatter::medium;
use crate::half_vector::scatter::medium::Cell;
use crate::half_vector::slicing::bodies::Bodies;
use crate::half_vector::slicing::serves;
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::LitBy;
use splat_core::{Light, henyey_greenstein};
use std::f64::consts::PI;

/// Change of ψ, relative to the largest, at which it is found.
const STILL: f64 = 1e-12;

/// What arrives at one face, by channel.
#[derive(Debug, Clone, Copy, Default)]
struct Face {
    ahead: [f64; 3],
    psi: [f64; 3],
    /// Along x, y and the light.
    flux: [[f64; 3]; 3],
    weight: f64,
}

/// What arrives at all faces of cells, per unit of intensity.
pub(crate) struct Diffuse {
    grid: LightGrid,
    cells: Vec<Cell>,
    faces: Vec<Face>,
    cone: f64,
}

/// Two streams in one layer of area 1.
struct Slab {
    /// a and b.
    conductance: f64,
    through: f64,
    /// What a beam of 1 gives to both faces.
    gives: [f64; 2],
}

impl Diffuse {
    /// `None` where nothing is scattered more than once.
    pub(crate) fn new(volumes: &[Volume<'_>], lit: &LitBy<'_>, params: &HalfParams) -> Option<Self> {
        if !scatter::is_wanted(volumes, &lit.light, params) {
            return None;
        }
        let camera = camera_of(&Bodies::volumes(volumes), &lit.light, params);
        let (grid, cells) = medium::resolved(volumes, &camera, params);
        let cone =
            params.cone.unwrap_or_else(|| scatter::phase::cone_of(params.scattering, medium::mean_asymmetry(&cells)));
        let [width, height] = grid.columns;
        let mut out = Self { grid, cells, faces: vec![Face::default(); width * height * (grid.layers + 1)], cone };
        for channel in 0..3 {
            let incoming = out.march(lit, channel);
            if params.scattering == Scattering::ForwardAndBack {
                out.relax(&incoming, channel);
            }
        }
        out.weigh();
        out.faces = out.softened();
        Some(out)
    }

    fn face(&self, x: usize, y: usize, k: usize) -> usize {
        (y * (self.grid.layers + 1) + k) * self.grid.columns[0] + x
    }

    fn cell(&self, x: usize, y: usize, k: usize) -> &Cell {
        &self.cells[(y * self.grid.layers + k) * self.grid.columns[0] + x]
    }

    fn columns(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let [width, height] = self.grid.columns;
        (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
    }

    /// Light ahead; power of the beam that comes into each layer of each column.
    fn march(&mut self, lit: &LitBy<'_>, c: usize) -> Vec<Vec<f64>> {
        let one = LitBy { light: Light { intensity: [1.0; 3], ..lit.light }, ..*lit };
        let enters = |(x, y): (usize, usize)| {
            let place = self.grid.world(GridPlace { x: x as f64, y: y as f64, face: 0.0 });
            scatter::scene::entering(&one, place, self.grid.area(0.0))[c]
        };
        let entering: Vec<f64> = self.columns().map(enters).collect();
        let mut beam = entering.clone();
        let mut ahead = vec![0.0; entering.len()];
        let mut incoming = Vec::new();
        let mut since = None;
        for k in 0..self.grid.layers {
            incoming.push(beam.iter().zip(&ahead).map(|(b, a)| b + a).collect::<Vec<f64>>());
            for (k_face, (x, y)) in self.columns().enumerate() {
                let cell = self.cell(x, y, k);
                let length = self.grid.length(Column { x, y });
                let [tau, stays] = [cell.extinction[c], cell.ahead[c]].map(|v| f64::from(v) * length);
                ahead[k_face] =
                    (beam[k_face] + ahead[k_face]) * libm::exp(stays - tau) - beam[k_face] * libm::exp(-tau);
                beam[k_face] *= libm::exp(-tau);
                since = since.or((stays > 0.0).then_some(k));
            }
            if let Some(since) = since {
                ahead = self.spread(&ahead, k, since);
            }
            for (k_face, (x, y)) in self.columns().enumerate() {
                let face = self.face(x, y, k + 1);
                self.faces[face].ahead[c] = ahead[k_face] / self.grid.area((k + 1) as f64);
            }
        }
        incoming
    }

    /// One convolution in two dimensions.
    fn spread(&self, power: &[f64], layer: usize, since: usize) -> Vec<f64> {
        let [width, height] = self.grid.columns.map(|n| n as isize);
        let behind = |n: usize| (n - since) as f64 * self.grid.depth;
        let slope = libm::tan(self.cone);
        let variance = slope * slope * (behind(layer + 1) * behind(layer + 1) - behind(layer) * behind(layer)) / 3.0;
        let [along, down] = [0, 1].map(|a| {
            let cell = self.grid.step[a] * self.grid.spread(layer as f64 + 0.5);
            weights((variance / (cell * cell)).min(0.25 * (self.grid.columns[a] * self.grid.columns[a]) as f64))
        });
        let [reach_x, reach_y] = [&along, &down].map(|w| w.len() as isize - 1);
        let mut out = vec![0.0; power.len()];
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            for (i, j) in (-reach_y..=reach_y).flat_map(|j| (-reach_x..=reach_x).map(move |i| (i, j))) {
                let px = x + i;
                let py = y + j;
                if (0..width).contains(&px) && (0..height).contains(&py) {
                    let weight = along[i.unsigned_abs()] * down[j.unsigned_abs()];
                    out[(y * width + x) as usize] += weight * power[(py * width + px) as usize];
                }
            }
        }
        out
    }

    /// Gauss and Seidel's iteration over all columns of a channel.
    fn relax(&mut self, incoming: &[Vec<f64>], c: usize) {
        let grid = self.grid;
        let layers = grid.layers;
        let width = grid.columns[0];
        let slab = |x: usize, y: usize, k: usize| {
            let mut slab = Slab::new(self.cell(x, y, k), c, grid.length(Column { x, y }));
            let area = grid.area(k as f64 + 0.5);
            (slab.conductance, slab.through) = (slab.conductance * area, slab.through * area);
            slab.gives = slab.gives.map(|s| s * incoming[k][y * width + x]);
            slab
        };
        let slabs: Vec<Vec<Slab>> = self.columns().map(|(x, y)| (0..layers).map(|k| slab(x, y, k)).collect()).collect();
        let sides: Vec<Vec<[[f64; 2]; 4]>> =
            self.columns().map(|(x, y)| (0..=layers).map(|k| self.sides(x, y, k, c)).collect()).collect();
        let mut psi = vec![0.0; self.faces.len()];
        loop {
            let mut change = 0.0f64;
            let mut most = 0.0f64;
            for (column, (x, y)) in self.columns().enumerate() {
                let found = self.column(&psi, &slabs[column], &sides[column], Column { x, y });
                for (k, found) in found.into_iter().enumerate() {
                    let k_face = self.face(x, y, k);
                    change = change.max((found - psi[k_face]).abs());
                    most = most.max(found.abs());
                    psi[k_face] = found;
                }
            }
            assert!(change.is_finite(), "invariant: media are numbers");
            if change <= STILL * most {
                break;
            }
        }
        self.keep(&psi, &slabs, &sides, c);
    }

    /// ψ of one column between what its neighbours have: three unknowns an equation.
    fn column(&self, psi: &[f64], slabs: &[Slab], sides: &[[[f64; 2]; 4]], column: Column) -> Vec<f64> {
        let Column { x, y } = column;
        let grid = self.grid;
        let layers = grid.layers;
        let mut takes = Vec::new();
        let mut comes = Vec::new();
        for k in 0..=layers {
            let beside = self.beside(x, y, k);
            let exchange = |side: usize| beside[side].map_or(0.0, |next| sides[k][side][0] * psi[next]);
            let before = if k == 0 { (grid.area(0.0), 0.0) } else { (slabs[k - 1].conductance, slabs[k - 1].gives[1]) };
            let behind =
                if k == layers { (grid.area(k as f64), 0.0) } else { (slabs[k].conductance, slabs[k].gives[0]) };
            takes.push(sides[k].as_flattened().iter().sum::<f64>() + before.0 + behind.0);
            comes.push((0..4).map(exchange).sum::<f64>() + before.1 + behind.1);
        }
        for k in 1..=layers {
            let share = slabs[k - 1].through / takes[k - 1];
            takes[k] -= share * slabs[k - 1].through;
            comes[k] += share * comes[k - 1];
        }
        for k in (0..=layers).rev() {
            let next = if k == layers { 0.0 } else { slabs[k].through * comes[k + 1] };
            comes[k] = (comes[k] + next) / takes[k];
        }
        comes
    }

    /// Writes ψ and the net flux of all faces.
    fn keep(&mut self, psi: &[f64], slabs: &[Vec<Slab>], sides: &[Vec<[[f64; 2]; 4]>], c: usize) {
        let grid = self.grid;
        let layers = grid.layers;
        let width = grid.columns[0];
        for (column, (x, y)) in self.columns().enumerate() {
            for k in 0..=layers {
                let k_face = self.face(x, y, k);
                let before = match k.checked_sub(1).map(|n| &slabs[column][n]) {
                    Some(slab) => slab.through * psi[k_face - width] - slab.conductance * psi[k_face] + slab.gives[1],
                    None => -grid.area(0.0) * psi[k_face],
                };
                let behind = match slabs[column].get(k) {
                    Some(slab) => slab.conductance * psi[k_face] - slab.through * psi[k_face + width] - slab.gives[0],
                    None => grid.area(layers as f64) * psi[k_face],
                };
                let leaves = |side: usize| {
                    let next = self.beside(x, y, k)[side].map_or(0.0, |next| psi[k_face] - psi[next]);
                    sides[column][k][side][0] * next + sides[column][k][side][1] * psi[k_face]
                };
                let share = if k == 0 || k == layers { 0.5 } else { 1.0 };
                let wall = grid.spread(k as f64) * grid.depth * share;
                let along = 0.5 * (leaves(1) - leaves(0)) / (wall * grid.step[1]);
                let down = 0.5 * (leaves(3) - leaves(2)) / (wall * grid.step[0]);
                let face = &mut self.faces[k_face];
                face.psi[c] = psi[k_face];
                face.flux[0][c] = along;
                face.flux[1][c] = down;
                face.flux[2][c] = 0.5 * (before + behind) / grid.area(k as f64);
            }
        }
    }

    /// Faces before and behind along x, along y.
    fn beside(&self, x: usize, y: usize, k: usize) -> [Option<usize>; 4] {
        let [width, height] = self.grid.columns;
        [
            (x > 0).then(|| self.face(x - 1, y, k)),
            (x + 1 < width).then(|| self.face(x + 1, y, k)),
            (y > 0).then(|| self.face(x, y - 1, k)),
            (y + 1 < height).then(|| self.face(x, y + 1, k)),
        ]
    }

    /// For each side of a face: what flows to the next column, and out into the open, for ψ = 1.
    fn sides(&self, x: usize, y: usize, k: usize, c: usize) -> [[f64; 2]; 4] {
        let mut out = [[0.0; 2]; 4];
        for layer in k.saturating_sub(1)..(k + 1).min(self.grid.layers) {
            for (side, out) in out.iter_mut().enumerate() {
                let found = self.side(side, GridNode { column: Column { x, y }, level: layer }, c);
                (0..2).for_each(|n| out[n] += 0.5 * found[n]);
            }
        }
        out
    }

    /// The same of one layer.
    fn side(&self, side: usize, node: GridNode, c: usize) -> [f64; 2] {
        let GridNode { column: Column { x, y }, level: layer } = node;
        let grid = self.grid;
        let direction = side / 2;
        let spread = grid.spread(layer as f64 + 0.5);
        let along = grid.step[direction] * spread;
        let wall = grid.step[1 - direction] * spread * grid.depth;
        let tau = |n: usize| {
            let cell = if direction == 0 { self.cell(n, y, layer) } else { self.cell(x, n, layer) };
            f64::from((cell.extinction[c] - cell.forward[c]).max(0.0)) * along
        };
        let here = if direction == 0 { x } else { y };
        let count = grid.columns[direction];
        let before = |n: usize| libm::exp(-1.5 * (0..n).map(tau).sum::<f64>());
        let behind = |n: usize| libm::exp(-1.5 * (n + 1..count).map(tau).sum::<f64>());
        let beyond = if side.is_multiple_of(2) { before(here) } else { behind(here) };
        let stops = 1.0 - libm::exp(-1.5 * tau(here));
        let thin = libm::exp(-0.75 * (0..count).map(tau).sum::<f64>());
        let open = self.slant([x, y, layer], c) * wall * beyond * stops * (0.423 + 0.577 * stops.max(thin))
            / (1.0 + 0.75 * tau(here));
        let next = if side.is_multiple_of(2) { here.checked_sub(1) } else { Some(here + 1).filter(|n| *n < count) };
        let across = next.map_or(0.0, |next| {
            let low = here.min(next);
            let high = here.max(next);
            let thinnest = 2.0 / count as f64;
            let optical = 0.5 * (tau(here).max(thinnest) + tau(next).max(thinnest));
            wall * (1.0 - behind(low)) * (1.0 - before(high)) / (1.5 * optical)
        });
        [across, open]
    }

    /// Share of the stairs' area that is the surface's, by the gradient of the media about a cell.
    fn slant(&self, cell: [usize; 3], c: usize) -> f64 {
        let grid = self.grid;
        let counts = [grid.columns[0], grid.columns[1], grid.layers].map(|n| n as isize);
        let mean = |cell: [isize; 3]| {
            let mut sum = 0.0;
            for n in 0..27 {
                let steps = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
                let next = [0, 1, 2].map(|a| cell[a] + steps[a]);
                if (0..3).all(|a| (0..counts[a]).contains(&next[a]) && (0..counts[a]).contains(&cell[a])) {
                    let weight: f64 = steps.iter().map(|n| scatter::slant::WEIGHTS[n.unsigned_abs()]).product();
                    let cell = self.cell(next[0] as usize, next[1] as usize, next[2] as usize);
                    sum += weight * f64::from((cell.extinction[c] - cell.forward[c]).max(0.0));
                }
            }
            sum
        };
        let spread = grid.spread(cell[2] as f64 + 0.5);
        let sizes = [grid.step[0] * spread, grid.step[1] * spread, grid.depth];
        let slope = |a: usize| {
            let mut before = cell.map(|n| n as isize);
            let mut behind = cell.map(|n| n as isize);
            (before[a], behind[a]) = (before[a] - 1, behind[a] + 1);
            (mean(behind) - mean(before)) / sizes[a]
        };
        scatter::slant::of_normal([0, 1, 2].map(slope))
    }

    fn weigh(&mut self) {
        for (x, y) in self.columns() {
            for k in 0..=self.grid.layers {
                let share = |layer: usize| {
                    let most = self.cell(x, y, layer).scattering.into_iter().fold(0.0, f32::max);
                    1.0 - libm::exp(-f64::from(most) * self.grid.depth)
                };
                let layers = k.saturating_sub(1)..(k + 1).min(self.grid.layers);
                let weight = 1e-6 + layers.map(share).fold(0.0, f64::max);
                let k_face = self.face(x, y, k);
                self.faces[k_face].weight = weight;
            }
        }
    }

    /// Each face as the mean of the 27 about it, those beyond a border as those at it.
    fn softened(&self) -> Vec<Face> {
        let counts = [self.grid.columns[0], self.grid.columns[1], self.grid.layers + 1];
        let near = |n: usize, step: usize, a: usize| (n + step).saturating_sub(1).min(counts[a] - 1);
        let mut out = self.faces.clone();
        for (x, y) in self.columns() {
            for k in 0..counts[2] {
                let mut sum = Face::default();
                for step in 0..27 {
                    let steps = [step % 3, step / 3 % 3, step / 9];
                    let share: f64 = steps.iter().map(|n| [0.25, 0.5, 0.25][*n]).product();
                    let beside =
                        &self.faces[self.face(near(x, steps[0], 0), near(y, steps[1], 1), near(k, steps[2], 2))];
                    sum.weight += share * beside.weight;
                    for c in 0..3 {
                        sum.ahead[c] += share * beside.weight * beside.ahead[c];
                        sum.psi[c] += share * beside.weight * beside.psi[c];
                        (0..3).for_each(|a| sum.flux[a][c] += share * beside.weight * beside.flux[a][c]);
                    }
                }
                let whole = |v: [f64; 3]| v.map(|v| v / sum.weight);
                let ahead = whole(sum.ahead);
                let psi = whole(sum.psi);
                let flux = sum.flux.map(whole);
                out[self.face(x, y, k)] = Face { ahead, psi, flux, weight: sum.weight };
            }
        }
        out
    }

    /// Radiance towards the eye of a point of a medium of which 1 is seen.
    pub(crate) fn radiance(
        &self,
        volume: &Volume<'_>,
        light: &Light,
        world: DVec3,
        to_eye: Vec3,
        color: [f32; 3],
    ) -> [f64; 3] {
        if !medium::scatters(volume) {
            return [0.0; 3];
        }
        let counts = [self.grid.columns[0], self.grid.columns[1], self.grid.layers + 1];
        let place = self.grid.place(world).to_array();
        let mut sum = [[0.0; 3]; 2];
        let mut weights = 0.0;
        let towards = self.grid.axes.map(|axis| axis.dot(to_eye.as_dvec3()));
        let g = f64::from(volume.material.asymmetry);
        for (x, y) in self.columns() {
            for k in 0..counts[2] {
                let share = |n: usize, a: usize| {
                    (1.0 - (place[a].clamp(0.0, (counts[a] - 1) as f64) - n as f64).abs()).max(0.0)
                };
                let face = &self.faces[self.face(x, y, k)];
                let weight = share(x, 0) * share(y, 1) * share(k, 2) * face.weight;
                weights += weight;
                for c in 0..3 {
                    let flux: f64 = (0..3).map(|a| face.flux[a][c] * towards[a]).sum();
                    sum[0][c] += weight * face.ahead[c];
                    sum[1][c] += weight * (2.0 * face.psi[c] + 3.0 * g * flux);
                }
            }
        }
        let travel = serves::travel(light, world).as_vec3();
        let phase = f64::from(henyey_greenstein(travel, to_eye, (g * g.abs()) as f32));
        let albedo = medium::albedo(volume, color);
        [0, 1, 2].map(|c| {
            let arrives = phase * sum[0][c] / weights + (sum[1][c] / weights).max(0.0) / (4.0 * PI);
            f64::from(light.intensity[c] * albedo[c]) * arrives
        })
    }
}

impl Slab {
    /// From reflectance and transmittance, and from what comes out of both faces of a layer under a beam of 1.
    fn new(cell: &Cell, c: usize, length: f64) -> Self {
        let optics = scatter::streams::optics(cell, c, length);
        let omega = optics.omega;
        let g = optics.asymmetry.clamp(-2.0 / 3.0, 2.0 / 3.0);
        let (omega, tau) = if optics.tau < 1e-6 { (1.0, 1e-6) } else { (omega, optics.tau) };
        let gamma2 = ((omega * (4.0 - 3.0 * g) - 1.0) / 4.0).max(0.0);
        let gamma1 = 2.0 * (1.0 - omega) + gamma2;
        let (reflects, transmits, k) = if omega == 1.0 {
            (gamma2 * tau / (1.0 + gamma2 * tau), 1.0 / (1.0 + gamma2 * tau), 0.0)
        } else {
            let k = libm::sqrt(gamma1 * gamma1 - gamma2 * gamma2);
            let e = libm::exp(-k * tau);
            let below = k + gamma1 + (k - gamma1) * e * e;
            (gamma2 * (1.0 - e * e) / below, 2.0 * k * e / below, k)
        };
        let behind = (2.0 - 3.0 * g) / 4.0;
        let ahead = (2.0 + 3.0 * g) / 4.0;
        let from_alike = k * k - 1.0;
        let with = optics.omega * (ahead * (gamma1 + 1.0) + gamma2 * behind) / from_alike;
        let against = optics.omega * (behind * (gamma1 - 1.0) + gamma2 * ahead) / from_alike;
        let left = libm::exp(-optics.tau);
        let up = against - reflects * with - transmits * against * left;
        let down = with * left - transmits * with - reflects * against * left;
        let even = 1.0 + reflects + transmits;
        let odd = 1.0 + reflects - transmits;
        let slow = (1.0 - reflects - transmits) / even;
        let fast = (1.0 - reflects + transmits) / odd;
        Self {
            conductance: 0.5 * (slow + fast),
            through: 0.5 * (fast - slow),
            gives: [(up + down) / even + (up - down) / odd, (up + down) / even - (up - down) / odd],
        }
    }
}

/// Weights of a convolution at 0, 1, 2, … cells.
fn weights(variance: f64) -> Vec<f64> {
    if variance <= 0.5 {
        return vec![1.0 - variance, 0.5 * variance];
    }
    let reach = (4.5 * variance.sqrt()).ceil() as i64;
    let sample = |n: i64| libm::exp(-0.5 * (n * n) as f64 / variance);
    let sum: f64 = (-reach..=reach).map(sample).sum();
    (0..=reach).map(|n| sample(n) / sum).collect()
}
