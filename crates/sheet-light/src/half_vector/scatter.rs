//! Light that is scattered more than once (Zhang and Crawfis, section 3, Eqs. 1 to 5): how much of it arrives where.
//!
//! The light buffer has what arrives unscattered, pixel by pixel. What is scattered is smooth, and is kept in cells larger than
//! voxels, along the light's own rays ([`grid`]): they hold the same, however many slabs there are.
//!
//! | step | here |
//! |---|---|
//! | shares of the phase function | `phase.rs` |
//! | means of the media in the cells | `medium.rs` |
//! | light that falls on them, and what stands between | `scene.rs` |
//! | Eqs. 3 and 5, forward: marched ahead, a convolution a layer | `beam.rs`, `blur.rs` |
//! | Eq. 4, back and forth: two streams in a layer | `layer.rs` |
//! | … in all columns | `streams.rs`, `slant.rs` |
//! | … added from the far side to the light, and back | `adding.rs` |
//! | where the power stays | `balance.rs` |
//! | Eq. 2: radiance towards the eye | [`Scattered::radiance`] |
//! | … towards polygons and translucent surfaces | `surface.rs`, `open.rs` |
//! | translucent surfaces and points in the light's way | `through_splats.rs` |

pub(crate) mod adding;
pub(crate) mod balance;
pub(crate) mod beam;
mod blur;
pub(crate) mod grid;
mod layer;
pub(crate) mod medium;
mod open;
pub(crate) mod phase;
pub(crate) mod scene;
pub(crate) mod slant;
pub(crate) mod streams;
pub(crate) mod surface;
#[cfg(test)]
mod tests;
mod through_splats;

use super::params::{HalfParams, Scattering};
use crate::Volume;
use balance::Balance;
use grid::LightGrid;
use medium::Cell;
use scene::Scene;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Light, henyey_greenstein};
use std::f32::consts::PI;
use surface::SurfaceLight;

/// Numbers of a face: by channel what was scattered ahead and the fluence φ; the net flux J along x, y and the light, by channel;
/// and how much there is that scatters.
pub(crate) const NUMBERS: usize = 16;

/// Places of φ, J and the weight among them.
const FLUENCE: usize = 3;
const FLUX: usize = 6;
const WEIGHT: usize = 15;

/// Weight of a face at which nothing scatters: no mean divides by 0.
const LEAST: f32 = 1e-6;

/// Irradiance of a light of intensity 1 below which there is none.
const END: f64 = 1e-24;

/// What arrives at faces of cells, per unit of the light's intensity.
pub(crate) struct Scattered {
    grid: LightGrid,
    /// By face, but for the weight times it.
    faces: Vec<[f32; NUMBERS]>,
    /// The same for polygons, where there are any to light.
    pub(crate) at_surfaces: Option<SurfaceLight>,
    /// For a light of intensity 1.
    pub(crate) balance: Balance,
    /// Convolutions and corrections.
    pub(crate) passes: u64,
}

/// What the two streams get, and what leaves them.
struct Given {
    /// By cell, where surfaces are lit: power that the beam scatters, per volume and channel.
    sources: Vec<[f64; 3]>,
    /// Power that leaves the cells, by channel.
    leaving: [f64; 3],
}

/// Whether a volume scatters light from all sides: it is seen, and its material has a phase function and a single-scattering albedo above 0.
pub fn scatters(volume: &Volume<'_>) -> bool {
    medium::scatters(volume) && volume.is_seen()
}

/// Whether there is anything to do.
pub(crate) fn is_wanted(volumes: &[Volume<'_>], light: &Light, params: &HalfParams) -> bool {
    params.scattering != Scattering::None && light.intensity.iter().any(|i| *i > 0.0) && volumes.iter().any(scatters)
}

impl Scattered {
    pub(crate) fn new(scene: &Scene, scattering: Scattering, lights_surfaces: bool) -> Self {
        let [width, height] = scene.grid.columns;
        let layers = scene.grid.layers;
        let mut out = Self {
            grid: scene.grid,
            faces: vec![[0.0; NUMBERS]; width * height * (layers + 1)],
            at_surfaces: None,
            balance: Balance::default(),
            passes: 0,
        };
        let cells = if lights_surfaces { scene.grid.cells() } else { 0 };
        let mut given = Given { sources: vec![[0.0; 3]; cells], leaving: [0.0; 3] };
        for channel in 0..3 {
            match (0..channel).find(|other| scene.is_like(channel, *other)) {
                Some(other) => {
                    out.copy(other, channel);
                    given.sources.iter_mut().for_each(|source| source[channel] = source[other]);
                    given.leaving[channel] = given.leaving[other];
                }
                None => out.fill(scene, scattering, channel, &mut given),
            }
        }
        out.at_surfaces = lights_surfaces.then(|| SurfaceLight::new(scene, &out.faces, &given));
        out.weigh(&scene.cells);
        for axis in 0..3 {
            out.soften(axis);
        }
        out
    }

    /// Bytes of what is kept.
    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.faces.as_slice()) as u64 + self.at_surfaces.as_ref().map_or(0, SurfaceLight::bytes)
    }

    /// Cells.
    pub(crate) fn cells(&self) -> u64 {
        self.grid.cells() as u64
    }

    /// One channel.
    fn fill(&mut self, scene: &Scene, scattering: Scattering, channel: usize, given: &mut Given) {
        let grid = &scene.grid;
        let (beam, psi, streams) = if scattering == Scattering::Forward {
            let beam = scene.path().march(channel);
            self.balance.add_beam(channel, &beam);
            self.balance.add_forward(channel, grid, &scene.cells, &beam);
            (beam, Vec::new(), None)
        } else {
            let (beam, streams) = scene.streams(channel);
            let solution = adding::solve(&streams);
            self.passes += solution.passes;
            self.balance.add_beam(channel, &beam);
            self.balance.add_streams(channel, grid, &scene.cells, &beam, &streams, &solution.psi);
            let Balance { reflected, transmitted, sides, .. } = &self.balance;
            given.leaving[channel] = reflected[channel] + transmitted[channel] + sides[channel];
            given.leaving[channel] -= beam.transmitted + beam.sides;
            for (at, source) in given.sources.iter_mut().enumerate() {
                let lost = balance::lost(grid, &scene.cells[at], at, channel, &beam);
                let layer = (at / grid.columns[0] % grid.layers) as f64 + 0.5;
                source[channel] = lost.power * lost.scattered / (grid.area(layer) * grid.depth);
            }
            (beam, solution.psi, Some(streams))
        };
        self.passes += beam.passes;
        let [width, _] = grid.columns;
        // What is less is no normal number, and slow.
        let number = |v: f64| if v.abs() < END { 0.0 } else { v as f32 };
        for (at, face) in self.faces.iter_mut().enumerate() {
            face[channel] = number(beam.ahead[at] / grid.area((at / width % (grid.layers + 1)) as f64));
            if let Some(streams) = &streams {
                face[FLUENCE + channel] = number(2.0 * psi[at]);
                let flux = streams.flux(grid, &psi, at);
                (0..3).for_each(|a| face[FLUX + 3 * a + channel] = number(flux[a]));
            }
        }
    }

    /// A channel as another.
    fn copy(&mut self, from: usize, to: usize) {
        for face in &mut self.faces {
            (0..5).for_each(|n| face[3 * n + to] = face[3 * n + from]);
        }
        let Balance { incident, reflected, transmitted, sides, absorbed } = &mut self.balance;
        [incident, reflected, transmitted, sides, absorbed].into_iter().for_each(|v| v[to] = v[from]);
    }

    /// Multiplies by how much scatters at each face, so that what is in the open, where nothing arrives that counts, does not darken
    /// what is beside it.
    fn weigh(&mut self, cells: &[Cell]) {
        let [width, _] = self.grid.columns;
        let layers = self.grid.layers;
        let length = self.grid.depth as f32;
        for (at, face) in self.faces.iter_mut().enumerate() {
            let [x, level] = [at % width, at / width % (layers + 1)];
            let y = at / (width * (layers + 1));
            let share = |layer: usize| {
                let cell = &cells[(y * layers + layer) * width + x];
                let scattering = cell.scattering.iter().copied().fold(0.0, f32::max);
                -libm::expm1f(-scattering * length)
            };
            let before = if level > 0 { share(level - 1) } else { 0.0 };
            let behind = if level < layers { share(level) } else { 0.0 };
            let weight = LEAST + before.max(behind);
            face[..WEIGHT].iter_mut().for_each(|v| *v *= weight);
            face[WEIGHT] = weight;
        }
    }

    /// Means over neighbours along an axis, 1/4, 1/2, 1/4: interpolated linearly they have no edges where cells meet.
    fn soften(&mut self, axis: usize) {
        let [width, height] = self.grid.columns;
        let faces = self.grid.layers + 1;
        let (count, step) = [(width, 1), (height, width * faces), (faces, width)][axis];
        let mut line = Vec::with_capacity(count);
        for start in (0..self.faces.len()).filter(|k| (k / step).is_multiple_of(count)) {
            line.clear();
            line.extend((0..count).map(|i| self.faces[start + i * step]));
            for i in 0..count {
                let before = &line[i.saturating_sub(1)];
                let behind = &line[(i + 1).min(count - 1)];
                let face = &mut self.faces[start + i * step];
                // Both sides first: a mirrored cloud gives mirrored bits.
                (0..NUMBERS).for_each(|n| face[n] = 0.5 * line[i][n] + 0.25 * (before[n] + behind[n]));
            }
        }
    }

    /// What arrives at a world position, weighted means of the faces about it.
    fn arriving(&self, world: DVec3) -> [f32; NUMBERS] {
        let place = self.grid.place(world).to_array();
        let [width, height] = self.grid.columns;
        let counts = [width, height, self.grid.layers + 1];
        let mut low = [0; 3];
        let mut next = [0; 3];
        let mut share = [0.0f32; 3];
        for a in 0..3 {
            let v = place[a].clamp(0.0, (counts[a] - 1) as f64);
            low[a] = (v as usize).min(counts[a].saturating_sub(2));
            next[a] = (low[a] + 1).min(counts[a] - 1);
            share[a] = (v - low[a] as f64) as f32;
        }
        let mut out = [0.0; NUMBERS];
        for corner in 0..8 {
            let [x, y, z] =
                [0, 1, 2].map(|a| if corner >> a & 1 == 0 { (low[a], 1.0 - share[a]) } else { (next[a], share[a]) });
            let weight = x.1 * y.1 * z.1;
            let face = &self.faces[(y.0 * counts[2] + z.0) * width + x.0];
            for n in 0..NUMBERS {
                out[n] += weight * face[n];
            }
        }
        let weight = out[WEIGHT].recip();
        out.map(|v| v * weight)
    }

    /// Radiance of light that is scattered more than once, towards the eye, of a point of a medium of which 1 is seen: Eq. 2, with the
    /// phase function for what goes ahead, and (φ + 3gJ·v)/4π for what comes from all sides.
    pub(crate) fn radiance(&self, volume: &Volume<'_>, light: &Light, seen: &Seen) -> [f32; 3] {
        let material = volume.material;
        let here = self.arriving(seen.world);
        let travel = crate::half_vector::slicing::serves::travel(light, seen.world).as_vec3();
        // What goes ahead was scattered before: twice is the phase function of g².
        let phase = henyey_greenstein(travel, seen.to_eye, material.asymmetry * material.asymmetry.abs());
        let towards = self.grid.axes.map(|axis| axis.as_vec3().dot(seen.to_eye));
        let albedo = medium::albedo(volume, seen.color);
        [0, 1, 2].map(|c| {
            let flux: f32 = (0..3).map(|a| here[FLUX + 3 * a + c] * towards[a]).sum();
            let diffuse = (here[FLUENCE + c] + 3.0 * material.asymmetry * flux).max(0.0) / (4.0 * PI);
            light.intensity[c] * albedo[c] * (phase * here[c] + diffuse)
        })
    }
}

/// A point of a medium that is seen.
pub(crate) struct Seen {
    pub(crate) world: DVec3,
    /// Unit direction.
    pub(crate) to_eye: Vec3,
    pub(crate) color: [f32; 3],
}
