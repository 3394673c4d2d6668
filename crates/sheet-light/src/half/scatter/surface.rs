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
//! face, and a black one counts as if it stood at the far face: an error of the first order in the depth of cells. What has left the cells is not
//! followed: its light fades out within a cell about them.

use super::grid::LightGrid;
use super::scene::Scene;
use super::streams::transport;
use super::{FLUENCE, FLUX, NUMBERS};
use crate::half::serves::travel;
use splat_core::glam::DVec3;
use splat_core::{Light, Material, Shading};
use std::f32::consts::PI;

/// What arrives at faces of cells, as it is: neither weighed nor softened.
pub(crate) struct SurfaceLight {
    grid: LightGrid,
    faces: Vec<Face>,
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
    /// `sources`: by cell, per volume and channel.
    pub(crate) fn new(scene: &Scene, faces: &[[f32; NUMBERS]], sources: &[[f64; 3]]) -> Self {
        let Scene { grid, cells, .. } = scene;
        let (width, layers) = (grid.columns[0], grid.layers);
        let one = |(at, face): (usize, &[f32; NUMBERS])| {
            let ([x, level], y) = ([at % width, at / width % (layers + 1)], at / (width * (layers + 1)));
            let sides = [level.saturating_sub(1), level.min(layers - 1)].map(|layer| (y * layers + layer) * width + x);
            let of = |first: usize| [0, 1, 2].map(|c| face[first + c]);
            let flux = |c: usize| (0..3).map(|a| grid.axes[a] * f64::from(face[FLUX + 3 * a + c])).sum();
            Face {
                ahead: of(0),
                fluence: of(FLUENCE),
                flux: [0, 1, 2].map(flux),
                transport: [0, 1, 2].map(|c| 0.5 * (transport(&cells[sides[0]], c) + transport(&cells[sides[1]], c))),
                sources: sides.map(|cell| sources[cell]),
            }
        };
        Self { grid: *grid, faces: faces.iter().enumerate().map(one).collect() }
    }

    /// Bytes of the faces.
    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.faces.as_slice()) as u64
    }

    /// Irradiance of the side of a surface with this unit normal, by channel, per unit of the light's intensity; `travel` is the
    /// unit direction in which light comes there.
    fn irradiance(&self, world: DVec3, normal: DVec3, travel: DVec3) -> [f32; 3] {
        let (within, place) = (self.within(world), self.grid.place(world + normal * self.half_a_cell(normal, world)));
        let ([width, height], layers) = (self.grid.columns, self.grid.layers);
        let counts = [width, height, layers + 1];
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        let ahead = (-travel.dot(normal)).max(0.0);
        for corner in 0..8 {
            let (mut weight, mut at) = (within, [0; 3]);
            for a in 0..3 {
                let low = place[a].floor();
                let is_next = corner >> a & 1 == 1;
                weight *= if is_next { place[a] - low } else { 1.0 - (place[a] - low) };
                at[a] = (low + f64::from(u8::from(is_next))).clamp(0.0, (counts[a] - 1) as f64) as usize;
            }
            let from = self.grid.world(at.map(|n| n as f64)) - world;
            weight *= from.dot(normal).max(0.0);
            // The layer on the other side of the face than the surface, which may be in the dark behind that.
            let along = -from.dot(self.grid.axes[2]);
            let face = &self.faces[(at[1] * counts[2] + at[2]) * width + at[0]];
            let source = &face.sources[usize::from(along < 0.0)];
            for c in 0..3 {
                let flux = face.flux[c] + self.grid.axes[2] * (source[c] * along);
                let fluence = f64::from(face.fluence[c]) + 3.0 * face.transport[c] * face.flux[c].dot(from);
                let diffuse = 0.25 * fluence.max(0.0) - 0.5 * flux.dot(normal);
                sum[c] += weight * (diffuse.max(0.0) + ahead * f64::from(face.ahead[c]));
            }
            weights += weight;
        }
        // Of places out of the cells no face has a part.
        if weights > 0.0 { sum.map(|v| (within * v / weights) as f32) } else { [0.0; 3] }
    }

    /// Radiance that a surface of a material and colour shows of it, on the side of this unit normal.
    pub(crate) fn reflected(
        &self,
        world: DVec3,
        normal: DVec3,
        (m, color): (&Material, [f32; 3]),
        light: &Light,
    ) -> [f32; 3] {
        if m.shading != Shading::Phong {
            return [0.0; 3];
        }
        let travel = travel(light, world);
        let arriving = |normal: DVec3, share: f32| match share {
            0.0 => [0.0; 3],
            share => self.irradiance(world, normal, travel).map(|e| share * e),
        };
        let (front, back) = (arriving(normal, 1.0 - m.transmission), arriving(-normal, m.transmission));
        [0, 1, 2].map(|c| light.intensity[c] * color[c] * m.diffuse / PI * (front[c] + back[c]))
    }

    /// 1 in the cells, and less within one of them about it; 0 farther away.
    fn within(&self, world: DVec3) -> f64 {
        let ([x, y, face], [width, height]) = (self.grid.place(world), self.grid.columns);
        let [columns, rows, layers] = [width, height, self.grid.layers].map(|n| n as f64);
        let beside = |v: f64, low: f64, high: f64| (low - v).max(v - high).max(0.0);
        let outside = [beside(x, -0.5, columns - 0.5), beside(y, -0.5, rows - 0.5), beside(face, 0.0, layers)];
        outside.into_iter().map(|v| (1.0 - v).max(0.0)).product()
    }

    /// How far a cell goes on along a direction, half of it; world units.
    fn half_a_cell(&self, along: DVec3, world: DVec3) -> f64 {
        let spread = self.grid.spread(self.grid.place(world)[2]).abs();
        let sides = [self.grid.step[0] * spread, self.grid.step[1] * spread, self.grid.depth];
        let cells = self.grid.axes.iter().zip(sides).map(|(axis, side)| axis.dot(along).abs() / side);
        0.5 / cells.fold(f64::MIN_POSITIVE, f64::max)
    }
}
