//! What arrives of the light on the way of a view ray through a slab (step 18 of the pseudocode).
//!
//! The light at a place is attenuated by the slabs before, whose mean extinction the light buffer knows, and by its own slab as
//! far as light has come in it, of the extinction that is seen there. So optical depth towards the light runs on without a step
//! from slab to slab. It is g at the end of the ray's part that is nearer to the eye and f at the other, and linear between, so
//! what the eye gets of the light that is scattered there is
//!
//! ∫₀¹ τ·e^(−τx)·e^(−g−(f−g)x) dx = τ·e^(−g)·φ(τ + f − g), φ(y) = (1 − e^(−y))/y,
//!
//! and the mean transmittance, which turns the opacity τ·φ(τ) into that, is e^(−min(g, f+τ))·φ(|τ + f − g|)/φ(τ). Seen from the
//! light itself, f − g = τ, the first slab gives (1 − e^(−2τ))/2, however wide it is. The paper takes one value a slab.

use super::frame::Frame;
use super::light_buffer::LightBuffer;
use super::serves::travel;
use crate::Volume;
use splat_core::Light;
use splat_core::glam::{DVec3, Mat3, Vec3};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Share of the steepest direction below which light is parallel to a pair of faces.
const PARALLEL: f32 = 1e-6;

/// How far outside of parallel faces a place is still inside, cells.
const ROUNDING: f32 = 1e-4;

/// Farther than anything.
const FAR: f32 = 1e30;

/// The ways of light in one volume, a parallelepiped in lattice coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightPath {
    /// Lattice from slab coordinates.
    start: Vec3,
    steps: Mat3,
    highest: Vec3,
    /// Lattice steps per unit of length, for directional light.
    direction: Vec3,
    /// Length per depth across the slabs, for directional light.
    stretch: f32,
    /// Slab and lattice coordinates of a lamp.
    lamp: Option<[Vec3; 2]>,
}

/// Slab coordinates of neighbouring pixels.
pub(crate) type Places<S> = [Lanes<S>; 3];

impl LightPath {
    pub(crate) fn new(volume: &Volume<'_>, light: &Light, frame: &Frame) -> Self {
        let inverse = volume.grid.axes.inverse();
        let lattice = |world: DVec3| inverse * (world - volume.grid.origin);
        let start = lattice(frame.world(DVec3::ZERO));
        let steps = frame.steps(volume).inverse();
        let direction = travel(light, frame.world(DVec3::ZERO));
        let lamp = light.shape.place();
        Self {
            start: start.as_vec3(),
            steps: steps.as_mat3(),
            highest: Vec3::from_array(volume.grid.dims.map(|n| n as f32 - 0.5)),
            direction: (inverse * direction).as_vec3(),
            stretch: (1.0 / frame.direction(direction).z) as f32,
            lamp: lamp.map(|p| [frame.point(p).as_vec3(), lattice(p).as_vec3()]),
        }
    }

    /// Length of the way of light in the volume up to each place: before the slab that begins at depth `face`, and within it.
    #[inline(always)]
    pub(crate) fn lengths<S: Simd>(&self, simd: S, at: &Places<S>, face: f32) -> [Lanes<S>; 2] {
        let of = |v: f32| Lanes::splat(simd, v);
        let (zero, tiny) = (of(0.0), of(PARALLEL));
        let here: [Lanes<S>; 3] = std::array::from_fn(|a| {
            let row = self.steps.row(a);
            of(row.x).mul_add(at[0], of(row.y).mul_add(at[1], of(row.z).mul_add(at[2], of(self.start[a]))))
        });
        let (length, towards, stretch) = self.ray(simd, at, &here);
        let steepest = towards[0].abs().max(towards[1].abs()).max(towards[2].abs());
        // Distances back to where light enters and leaves.
        let (mut enters, mut leaves) = (of(FAR), zero);
        for a in 0..3 {
            let (above, below) = (here[a] - of(-0.5), of(self.highest[a]) - here[a]);
            let rate = length / towards[a].abs().max(tiny * steepest);
            let is_parallel = [towards[a].abs(), tiny * steepest];
            let inside = of(FAR).where_less_or(of(-ROUNDING), above.min(below), of(-FAR));
            let enter = above.where_less_or(zero, towards[a], below) * rate;
            let leave = (zero - below.where_less_or(zero, towards[a], above)) * rate;
            enters = enters.min(inside.where_less_or(is_parallel[0], is_parallel[1], enter));
            leaves = leaves.max(zero.where_less_or(is_parallel[0], is_parallel[1], leave));
        }
        let own = (at[2] - of(face)).max(zero) * stretch;
        let before = (enters - leaves.max(own)).max(zero);
        [before, (enters.min(own) - leaves).max(zero)]
    }

    /// Of the light's ray to each place: a length, the lattice steps on it, and length per depth across the slabs.
    #[inline(always)]
    fn ray<S: Simd>(&self, simd: S, at: &Places<S>, here: &Places<S>) -> (Lanes<S>, Places<S>, Lanes<S>) {
        let of = |v: f32| Lanes::splat(simd, v);
        let Some([slab, lattice]) = self.lamp else {
            return (of(1.0), self.direction.to_array().map(of), of(self.stretch));
        };
        let from: [Lanes<S>; 3] = std::array::from_fn(|a| at[a] - of(slab[a]));
        let length = from[0].mul_add(from[0], from[1].mul_add(from[1], from[2] * from[2])).sqrt();
        (length, std::array::from_fn(|a| here[a] - of(lattice[a])), length / from[2])
    }
}

/// What neighbouring pixels ask of the light.
pub(crate) struct Asked<'a, S: Simd> {
    /// Slab coordinates of the ends of each ray's part in the slab, that nearer to the eye first.
    pub(crate) ends: [Places<S>; 2],
    /// Extinction that is seen in the slab, by volume.
    pub(crate) extinction: &'a [[f32; MAX_LANES]],
    /// Optical depth of the part, by plane.
    pub(crate) optical_depth: &'a [[f32; MAX_LANES]; 3],
}

/// The light of one sweep as it arrives at a slab.
pub(crate) struct Illumination<'a> {
    pub(crate) buffer: &'a LightBuffer,
    pub(crate) paths: &'a [LightPath],
    pub(crate) volumes: &'a [Volume<'a>],
    /// Near face of the slab.
    pub(crate) face: f32,
}

impl Illumination<'_> {
    /// Mean transmittance towards the light, by plane, for pixels of which `wanted` is above 0.
    #[inline(always)]
    pub(crate) fn transmittance<S: Simd>(
        &self,
        simd: S,
        asked: &Asked<'_, S>,
        wanted: &[f32; MAX_LANES],
        planes: usize,
    ) -> [[f32; MAX_LANES]; 3] {
        let of = |v: f32| Lanes::splat(simd, v);
        let [nearer, farther] = &asked.ends;
        let middle: Places<S> = std::array::from_fn(|a| (nearer[a] + farther[a]) * of(0.5));
        let mut coordinates = [[0.0; MAX_LANES]; 3];
        (0..3).for_each(|a| middle[a].store(&mut coordinates[a]));
        let mut optical = [[of(0.0); 2]; 3];
        for (v, volume) in self.volumes.iter().enumerate() {
            let mut mean = asked.extinction[v];
            for lane in (0..Lanes::<S>::COUNT).filter(|lane| wanted[*lane] > 0.0) {
                let at = Vec3::new(coordinates[0][lane], coordinates[1][lane], coordinates[2][lane]);
                let [tau, length] = self.buffer.at(v, self.buffer.sight.pixel(at));
                if length > 0.0 {
                    mean[lane] = tau / length;
                }
            }
            let (mean, own) = (Lanes::load(simd, &mean), Lanes::load(simd, &asked.extinction[v]));
            for (end, at) in asked.ends.iter().enumerate() {
                let [before, within] = self.paths[v].lengths(simd, at, self.face);
                let tau = mean.mul_add(before, own * within);
                for p in 0..planes {
                    optical[p][end] = tau.mul_add(of(volume.material.extinction_rgb[p]), optical[p][end]);
                }
            }
        }
        let mut out = [[1.0; MAX_LANES]; 3];
        for p in 0..planes {
            let tau = Lanes::load(simd, &asked.optical_depth[p]);
            mean_transmittance(simd, tau, optical[p]).store(&mut out[p]);
        }
        out
    }
}

/// e^(−min(g, f+τ))·φ(|τ + f − g|)/φ(τ).
#[inline(always)]
fn mean_transmittance<S: Simd>(simd: S, tau: Lanes<S>, [g, f]: [Lanes<S>; 2]) -> Lanes<S> {
    let behind = f + tau;
    g.min(behind).exp_neg() * mean_of_exponential(simd, (behind - g).abs()) / mean_of_exponential(simd, tau)
}

/// φ(y) = (1 − e^(−y))/y, 1 at 0.
#[inline(always)]
fn mean_of_exponential<S: Simd>(simd: S, y: Lanes<S>) -> Lanes<S> {
    let y = y.max(Lanes::splat(simd, 1e-30));
    y.opacity() / y
}
