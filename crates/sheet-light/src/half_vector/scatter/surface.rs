//! Light that is scattered more than once where it meets surfaces: irradiance of one side of a surface, from the cells before it.
//!
//! Diffuse radiance towards a direction v is (φ + 3J·v)/4π, so a side with the unit normal n receives
//!
//! E = φ/4 − J·n/2,
//!
//! which is the stream that comes against n: next to what lets nothing through, the other stream is 0. Beside it is light that goes
//! ahead, with the cosine. φ and J are known at faces of cells, of which those behind the surface are dark or belong to its other side; so the
//! faces before it count alone, the more, the farther they are before it, and each is carried on to the surface: by Fick's law,
//! ∇φ = −3σ_tr·J, and J along the light grows by what is scattered out of the beam on the way. A surface within a cell is as far from its
//! face, and a black one counts as if it stood at the far face: an error of the first order in the depth of cells.
//!
//! A surface outside of the media receives what their cells emit (`open.rs`), and light that goes ahead. Both forms fade into each other within a
//! quarter of a cell about the media.

use super::grid::{GridPlace, LightGrid};
use super::medium::Cell;
use super::open::{Emission, Emitters};
use super::scene::Scene;
use super::streams::transport;
use super::{FLUENCE, FLUX, Given, NUMBERS};
use crate::half_vector::slicing::serves::travel;
use splat_core::glam::DVec3;
use splat_core::{Light, Material, Shading};
use std::f32::consts::PI;

/// Optical depth of a cell from which it belongs to the media: thinner ones leave light as it is.
const FILLED: f32 = 0.02;

/// What arrives at faces of cells, as it is: neither weighed nor softened.
pub(crate) struct SurfaceLight {
    grid: LightGrid,
    faces: Vec<Face>,
    /// By cell: 1 in the media, 0 in the open.
    filled: Vec<f32>,
    /// What the open receives; `None` for nothing.
    emitters: Option<Emitters>,
}

/// What a surface is made of where it is seen.
pub(crate) struct Facet<'a> {
    pub(crate) material: &'a Material,
    pub(crate) color: [f32; 3],
}

/// By channel, per unit of the light's intensity.
#[derive(Debug, Clone, Copy)]
struct Face {
    ahead: [f32; 3],
    fluence: [f32; 3],
    /// World space.
    flux: [DVec3; 3],
    /// Mean of σ_tr of both layers at the face, 1/length.
    transport: [f64; 3],
    /// What is scattered out of the beam in the layer before it, and in that behind it, per volume.
    sources: [[f64; 3]; 2],
}

impl SurfaceLight {
    /// `faces` are neither weighed nor softened.
    pub(super) fn new(scene: &Scene, faces: &[[f32; NUMBERS]], given: &Given) -> Self {
        let Given { sources, leaving } = given;
        let Scene { grid, cells, .. } = scene;
        let width = grid.columns[0];
        let layers = grid.layers;
        let stored_face = |(at, face): (usize, &[f32; NUMBERS])| {
            let [x, level] = [at % width, at / width % (layers + 1)];
            let y = at / (width * (layers + 1));
            let sides = [level.saturating_sub(1), level.min(layers - 1)].map(|layer| (y * layers + layer) * width + x);
            let three = |first: usize| [0, 1, 2].map(|c| face[first + c]);
            let flux = |c: usize| (0..3).map(|a| grid.axes[a] * f64::from(face[FLUX + 3 * a + c])).sum();
            Face {
                ahead: three(0),
                fluence: three(FLUENCE),
                flux: [0, 1, 2].map(flux),
                transport: [0, 1, 2].map(|c| 0.5 * (transport(&cells[sides[0]], c) + transport(&cells[sides[1]], c))),
                sources: sides.map(|cell| sources[cell]),
            }
        };
        let emission = Emission { grid, cells, faces, sources, leaving: *leaving };
        Self {
            grid: *grid,
            faces: faces.iter().enumerate().map(stored_face).collect(),
            filled: filled(grid, cells),
            emitters: Emitters::new(&emission),
        }
    }

    /// Bytes of the faces.
    pub(crate) fn bytes(&self) -> u64 {
        let kept = size_of_val(self.faces.as_slice()) + size_of_val(self.filled.as_slice());
        kept as u64 + self.emitters.as_ref().map_or(0, Emitters::bytes)
    }

    /// Irradiance of the side of a surface with this unit normal, by channel, per unit of the light's intensity; `travel` is the
    /// unit direction in which light comes there.
    fn irradiance(&self, world: DVec3, normal: DVec3, travel: DVec3) -> [f32; 3] {
        let within = self.within(world);
        let inside = if within > 0.0 { self.inside(world, normal, travel) } else { [0.0; 3] };
        let outside = if within < 1.0 { self.outside(world, normal, travel) } else { [0.0; 3] };
        [0, 1, 2].map(|c| (within * inside[c] + (1.0 - within) * outside[c]) as f32)
    }

    /// The same in the media.
    fn inside(&self, world: DVec3, normal: DVec3, travel: DVec3) -> [f64; 3] {
        let place = self.grid.place(world + normal * self.half_a_cell(normal, world)).to_array();
        let [width, height] = self.grid.columns;
        let layers = self.grid.layers;
        let counts = [width, height, layers + 1];
        let mut sum = [0.0; 3];
        let mut weights = 0.0;
        let ahead = (-travel.dot(normal)).max(0.0);
        for corner in 0..8 {
            let mut weight = 1.0;
            let mut node = [0; 3];
            for a in 0..3 {
                let low = place[a].floor();
                let is_next = corner >> a & 1 == 1;
                weight *= if is_next { place[a] - low } else { 1.0 - (place[a] - low) };
                node[a] = (low + f64::from(u8::from(is_next))).clamp(0.0, (counts[a] - 1) as f64) as usize;
            }
            let place = GridPlace { x: node[0] as f64, y: node[1] as f64, face: node[2] as f64 };
            let from = self.grid.world(place) - world;
            weight *= from.dot(normal).max(0.0);
            // The layer on the other side of the face than the surface, which may be in the dark behind that.
            let along = -from.dot(self.grid.axes[2]);
            let face = &self.faces[(node[1] * counts[2] + node[2]) * width + node[0]];
            let source = &face.sources[usize::from(along < 0.0)];
            for c in 0..3 {
                let flux = face.flux[c] + self.grid.axes[2] * (source[c] * along);
                let fluence = f64::from(face.fluence[c]) + 3.0 * face.transport[c] * face.flux[c].dot(from);
                let diffuse = 0.25 * fluence.max(0.0) - 0.5 * flux.dot(normal);
                sum[c] += weight * (diffuse.max(0.0) + ahead * f64::from(face.ahead[c]));
            }
            weights += weight;
        }
        // Where no face lies before the surface none has a part.
        if weights > 0.0 { sum.map(|v| v / weights) } else { [0.0; 3] }
    }

    /// The same in the open: what all cells emit, and what goes ahead.
    fn outside(&self, world: DVec3, normal: DVec3, travel: DVec3) -> [f64; 3] {
        let mut sum = self.emitters.as_ref().map_or([0.0; 3], |emitters| emitters.irradiance(world, normal));
        let cosine = (-travel.dot(normal)).max(0.0);
        if cosine > 0.0 {
            let ahead = self.ahead(world);
            (0..3).for_each(|c| sum[c] += cosine * ahead[c]);
        }
        sum
    }

    /// Irradiance of light that goes ahead, across its way: none beside the columns, and behind the last face what arrives there.
    fn ahead(&self, world: DVec3) -> [f64; 3] {
        let place = self.grid.place(world).to_array();
        let counts = [self.grid.columns[0], self.grid.columns[1], self.grid.layers + 1];
        let face = place[2].clamp(0.0, self.grid.layers as f64);
        let low = [place[0].floor(), place[1].floor(), face.floor()];
        let share = [place[0] - low[0], place[1] - low[1], face - low[2]];
        let mut sum = [0.0; 3];
        for corner in 0..8 {
            let next = [0, 1, 2].map(|a| f64::from(u8::from(corner >> a & 1 == 1)));
            let node = [0, 1, 2].map(|a| low[a] + next[a]);
            if (0..3).any(|a| node[a] < 0.0 || node[a] >= counts[a] as f64) {
                continue;
            }
            let weight: f64 = (0..3).map(|a| if next[a] > 0.0 { share[a] } else { 1.0 - share[a] }).product();
            let [x, y, z] = node.map(|n| n as usize);
            let ahead = self.faces[(y * counts[2] + z) * counts[0] + x].ahead;
            (0..3).for_each(|c| sum[c] += weight * f64::from(ahead[c]));
        }
        // Columns of a lamp grow wider.
        let spread = self.grid.spread(face) / self.grid.spread(place[2]);
        sum.map(|v| v * spread * spread)
    }

    /// Radiance that a surface shows of it, on the side of this unit normal.
    pub(crate) fn reflected(&self, world: DVec3, normal: DVec3, facet: &Facet<'_>, light: &Light) -> [f32; 3] {
        let Facet { material, color } = *facet;
        if material.shading != Shading::Phong {
            return [0.0; 3];
        }
        let travel = travel(light, world);
        let arriving = |normal: DVec3, share: f32| match share {
            0.0 => [0.0; 3],
            share => self.irradiance(world, normal, travel).map(|e| share * e),
        };
        let front = arriving(normal, 1.0 - material.transmission);
        let back = arriving(-normal, material.transmission);
        [0, 1, 2].map(|c| light.intensity[c] * color[c] * material.diffuse / PI * (front[c] + back[c]))
    }

    /// 1 in the media and at their faces, 0 from a quarter of a cell beside them on.
    fn within(&self, world: DVec3) -> f64 {
        let GridPlace { x, y, face } = self.grid.place(world);
        // Whole numbers at the middles of cells.
        let place = [x, y, face - 0.5];
        let counts = [self.grid.columns[0], self.grid.columns[1], self.grid.layers];
        let mut mean = 0.0;
        for corner in 0..8 {
            let next = [0, 1, 2].map(|a| f64::from(u8::from(corner >> a & 1 == 1)));
            let node = [0, 1, 2].map(|a| place[a].floor() + next[a]);
            if (0..3).any(|a| node[a] < 0.0 || node[a] >= counts[a] as f64) {
                continue;
            }
            let share: f64 = (0..3).map(|a| 1.0 - (node[a] - place[a]).abs()).product();
            let [x, y, layer] = node.map(|n| n as usize);
            mean += share * f64::from(self.filled[(y * counts[2] + layer) * counts[0] + x]);
        }
        // Half of what is about a face of the media is filled, a quarter of what is half as far from it as the middle of a cell.
        (4.0 * mean - 1.0).clamp(0.0, 1.0)
    }

    /// How far a cell goes on along a direction, half of it; world units.
    fn half_a_cell(&self, along: DVec3, world: DVec3) -> f64 {
        let sides = self.grid.sides(self.grid.place(world).face);
        let cells = self.grid.axes.iter().zip(sides).map(|(axis, side)| axis.dot(along).abs() / side);
        0.5 / cells.fold(f64::MIN_POSITIVE, f64::max)
    }
}

/// How much of each cell belongs to the media: its optical depth as a share of the greatest among its neighbours, of which little is next to nothing.
fn filled(grid: &LightGrid, cells: &[Cell]) -> Vec<f32> {
    let [width, height] = grid.columns;
    let layers = grid.layers;
    let optical_depth = |cell: &Cell| cell.extinction.into_iter().fold(0.0, f32::max) * grid.depth as f32;
    let depths: Vec<f32> = cells.iter().map(optical_depth).collect();
    let mut most = depths.clone();
    let mut line = Vec::new();
    for (count, step) in [(width, 1), (layers, width), (height, layers * width)] {
        for start in (0..most.len()).filter(|k| (k / step).is_multiple_of(count)) {
            line.clear();
            line.extend((0..count).map(|i| most[start + i * step]));
            for i in 0..count {
                let near = &line[i.saturating_sub(1)..(i + 2).min(count)];
                most[start + i * step] = near.iter().copied().fold(0.0, f32::max);
            }
        }
    }
    depths.iter().zip(&most).map(|(depths, most)| depths / most.max(FILLED)).collect()
}
