//! Light within the sheets of a volume whose spacing is optically thick: the joint integral over the part of a ray in a slab, of what is left
//! of the light on its way in, and on its way out to the eye. See [`splat_core::shade::joint`] for where depths come from.
//!
//! Toward the light the absorbance is linear about each voxel, A(x) = A_v − g_v·(x − x_v), and mixed trilinearly. On the ray it grows by
//! a from the near end to the far one, and with the optical depth e of the part the eye gets the share
//!
//! ∫₀¹ e^(−A₀ − a·s − e·s) e ds/(1 − e^−e) = e^−A₀·M(a + e)/M(e),   M(x) = (1 − e^−x)/x,
//!
//! and of light that comes from behind, a < 0, e^(−A₁ − max(|a|, e) + …): see [`share`]. A face of the volume is sharp in a sheet, so nothing
//! is blurred: a slab of any slabs has its closed form.

use crate::Volume;
use crate::shared::lattice::neighbours::{Cells, Neighbours, Receivers, VoxelReceivers, lanes};
use crate::shared::vectors::dot;
use crate::shared::voxels::{VoxelPlace, Voxels};
use splat_core::glam::{DMat3, DVec3};
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::LitBy;
use splat_core::shade::joint::{MediumCell, THICK, THIN};
use splat_core::{Receiver, Transmittance};
use std::sync::OnceLock;

/// What a voxel knows of a light, by channel: the absorbance and its slopes, per step along each axis of the lattice.
type Slopes = [[f32; 4]; 3];

/// Voxels, neighbours among those that are needed, whose slopes are kept together: where none of them is asked for they take nothing.
const TOGETHER: usize = 64;

/// Slopes of some voxels, once they were asked for; `None` of a voxel beyond the faces of the volume, where nothing goes on as inside.
type Part = [OnceLock<Option<Slopes>>; TOGETHER];

/// A thick volume in its lights.
pub(crate) struct Within<'a> {
    volume: Volume<'a>,
    /// `None` for a light without shadows.
    lights: Vec<Option<LightWithin<'a>>>,
    voxels: VoxelReceivers,
    axes: DMat3,
    /// Mean step of the lattice, world units.
    width: f64,
}

/// A light, and the slopes of the needed voxels, by rank.
struct LightWithin<'a> {
    lit: LitBy<'a>,
    shadow: &'a dyn Transmittance,
    parts: Vec<OnceLock<Box<Part>>>,
}

/// The parts of neighbouring rays in a slab of a thick volume.
pub(crate) struct RayParts<'a, S: Simd> {
    within: &'a Within<'a>,
    /// Their middles, in lattice coordinates from the rim on.
    middle: [Lanes<S>; 3],
    /// Their ways to the eye, in steps along each axis of the lattice.
    to_eye: [Lanes<S>; 3],
    /// To be multiplied with the material's extinctions.
    optical_depth: Lanes<S>,
    /// How much the joint integral counts, 0 to 1.
    weight: Lanes<S>,
}

impl<'a> Within<'a> {
    /// Before any voxel was asked for; `None` where no step through the volume is thick, or no light has shadows.
    pub(crate) fn new(
        volume: &Volume<'a>,
        receivers: &Receivers<'_>,
        lights: &[LitBy<'a>],
        origin: DVec3,
    ) -> Option<Self> {
        let has_shadows = lights.iter().any(|lit| lit.shadow.is_some());
        if !has_shadows || volume.shadow_coefficient == 0.0 || !is_thick(receivers) {
            return None;
        }
        let parts = (receivers.voxels.count() as usize).div_ceil(TOGETHER);
        let unasked = || std::iter::repeat_with(OnceLock::new).take(parts).collect();
        let within = |lit: &LitBy<'a>| lit.shadow.map(|shadow| LightWithin { lit: *lit, shadow, parts: unasked() });
        Some(Self {
            volume: *volume,
            lights: lights.iter().map(within).collect(),
            voxels: VoxelReceivers::new(receivers, origin),
            axes: volume.axes(),
            width: width(receivers),
        })
    }

    /// The parts of rays about some places, `to_eye` being unit vectors, and lengths in world units.
    #[inline(always)]
    pub(crate) fn parts<S: Simd>(
        &self,
        simd: S,
        neighbours: &Neighbours,
        places: &[Lanes<S>; 3],
        to_eye: &[Lanes<S>; 3],
        length: Lanes<S>,
        optical_depth: Lanes<S>,
    ) -> RayParts<'_, S> {
        let zero = simd.lanes(0.0);
        let mut middle = [zero; 3];
        let mut way = [zero; 3];
        for axis in 0..3 {
            let [x, y, z, start] = neighbours.lattice_from_place[axis];
            let row = [simd.lanes(x), simd.lanes(y), simd.lanes(z)];
            middle[axis] = dot(&row, places) + simd.lanes(start);
            way[axis] = dot(&row, to_eye) * length;
        }
        let extinction = self.volume.material.extinction_rgb;
        let thickest = extinction.iter().fold(0.0f32, |most, e| most.max(*e)) * self.width as f32;
        // Of no length nothing is seen, and what is no number is not thick.
        let of_spacing = optical_depth * simd.lanes(thickest) / length.max(simd.lanes(f32::MIN_POSITIVE));
        let thickness = (of_spacing - simd.lanes(THIN)) * simd.lanes(1.0 / (THICK - THIN));
        RayParts { within: self, middle, to_eye: way, optical_depth, weight: thickness.max(zero).min(simd.lanes(1.0)) }
    }

    /// Writes the weighted mean of the slopes of the voxels of a cell that lie in the volume, number by number, in the place of a lane. Whether any does.
    #[inline]
    fn mean_of_voxels(
        &self,
        light: &LightWithin<'_>,
        neighbours: &Neighbours,
        voxels: &Voxels,
        cells: &Cells,
        lane: usize,
        slopes: &mut [[f32; MAX_LANES]; 12],
    ) -> bool {
        let mut sum = [0.0; 12];
        let mut whole = 0.0;
        for row in 0..4 {
            for e in 0..2 {
                let rank = cells.ranks[lane][row] + e;
                let weight = cells.weights[lane][row][e];
                // A voxel that is missing has no weight.
                if weight == 0.0 {
                    continue;
                }
                let found = light.slopes(rank, || self.slopes(light, neighbours.voxel(voxels, rank)));
                let Some(found) = found else {
                    continue;
                };
                whole += weight;
                let found = found.as_flattened();
                for n in 0..12 {
                    sum[n] += weight * found[n];
                }
            }
        }
        if whole == 0.0 {
            return false;
        }
        for n in 0..12 {
            slopes[n][lane] = sum[n] / whole;
        }
        true
    }

    /// The slopes of a light at a voxel; `None` outside of the volume.
    fn slopes(&self, light: &LightWithin<'_>, voxel: VoxelPlace) -> Option<Slopes> {
        let place = self.voxels.place(voxel);
        let in_lattice = self.voxels.in_lattice(place);
        let value = self.volume.value_at(in_lattice)?;
        let receiver = self.voxels.receiver(place);
        let straight = f64::from(self.volume.transfer.at(value).extinction) * self.volume.extinction_scale * self.width;
        let optical_depth = self.volume.material.extinction_rgb.map(|factor| factor * straight as f32);
        if optical_depth.iter().all(|depth| *depth <= PART * THIN) {
            return Some(light.shadow.absorbance(&receiver).map(|middle| [middle, 0.0, 0.0, 0.0]));
        }
        let world = self.volume.origin() + self.axes * in_lattice;
        let to_light = light.lit.light.irradiance(world, 0.0).to_light;
        let Receiver { position, radius, .. } = receiver;
        let width = self.width as f32;
        let cell = MediumCell { position, width, radius, optical_depth, absorbs: self.volume.casts_shadow };
        let depths = cell.depths(light.shadow, to_light.as_vec3().normalize_or_zero());
        Some(depths.map(|depth| {
            let slope = self.axes.transpose() * (depth.across.as_dvec3() / self.width);
            let here = f64::from(depth.middle()) + slope.dot(place);
            [here as f32, slope.x as f32, slope.y as f32, slope.z as f32]
        }))
    }

    /// Bytes of that of so many voxels, if the volume is thick.
    pub(crate) fn bytes(receivers: &Receivers<'_>, voxels: u64, lights: &[LitBy<'_>]) -> u64 {
        let shadows = lights.iter().filter(|lit| lit.shadow.is_some()).count();
        let of_voxel = size_of::<Part>().div_ceil(TOGETHER) + 1;
        if shadows > 0 && is_thick(receivers) { voxels * (shadows * of_voxel) as u64 } else { 0 }
    }
}

impl<S: Simd> RayParts<'_, S> {
    /// Share of a light that the eye gets from each part of a ray. Where the medium is thin that is `through`, the share that arrives at the middle of the part.
    #[inline(always)]
    pub(crate) fn replace(
        &self,
        simd: S,
        neighbours: &Neighbours,
        voxels: &Voxels,
        cells: &Cells,
        light: usize,
        through: [Lanes<S>; 3],
    ) -> [Lanes<S>; 3] {
        let zero = simd.lanes(0.0);
        let Some(light) = &self.within.lights[light] else {
            return through;
        };
        if !zero.any_less(self.weight) {
            return through;
        }
        let mut weights = [0.0; MAX_LANES];
        self.weight.store(&mut weights);
        let mut slopes = [[0.0; MAX_LANES]; 12];
        for lane in lanes(cells.lane_bits) {
            if weights[lane] > 0.0 && !self.within.mean_of_voxels(light, neighbours, voxels, cells, lane, &mut slopes) {
                weights[lane] = 0.0;
            }
        }
        let weight = Lanes::load(simd, &weights);
        let mut sent = through;
        for channel in 0..3 {
            let [absorbance, x, y, z] = [4 * channel, 4 * channel + 1, 4 * channel + 2, 4 * channel + 3];
            let slope = [Lanes::load(simd, &slopes[x]), Lanes::load(simd, &slopes[y]), Lanes::load(simd, &slopes[z])];
            let middle = Lanes::load(simd, &slopes[absorbance]) - dot(&slope, &self.middle);
            let growth = dot(&slope, &self.to_eye);
            let optical_depth = self.optical_depth * simd.lanes(self.within.volume.material.extinction_rgb[channel]);
            let share = share(simd, middle, growth, optical_depth);
            sent[channel] = weight.mul_add(share - through[channel], through[channel]);
        }
        sent
    }
}

impl LightWithin<'_> {
    /// The slopes of a voxel by its rank; `find` finds them where nobody has asked yet. Whoever is first finds what any other would.
    #[inline]
    fn slopes(&self, rank: usize, find: impl FnOnce() -> Option<Slopes>) -> &Option<Slopes> {
        let part = self.parts[rank / TOGETHER].get_or_init(|| Box::new([const { OnceLock::new() }; TOGETHER]));
        part[rank % TOGETHER].get_or_init(find)
    }
}

/// Mean step of a volume's lattice, world units.
fn width(receivers: &Receivers<'_>) -> f64 {
    libm::cbrt(receivers.volume.axes().determinant().abs())
}

/// Whether a step through the volume may be thick.
pub(crate) fn is_thick(receivers: &Receivers<'_>) -> bool {
    let greatest = receivers.volume.transfer.points().iter().map(|p| p.extinction).fold(0.0, f32::max);
    let straight =
        f64::from(greatest * receivers.volume.material.greatest_extinction()) * receivers.volume.extinction_scale;
    straight * width(receivers) > f64::from(THIN)
}

/// Share of [`THIN`] below which a voxel's slopes are not looked up: what is mixed of it and of thick ones is thin.
const PART: f32 = 0.25;

/// Share of a light that the eye gets of what a part of a ray sends: `middle` is the absorbance toward the light in its middle, which grows by
/// `growth` away from the eye, and `optical_depth` is that of the part, ≥ 0.
#[inline(always)]
fn share<S: Simd>(simd: S, middle: Lanes<S>, growth: Lanes<S>, optical_depth: Lanes<S>) -> Lanes<S> {
    let zero = simd.lanes(0.0);
    let least = (middle - simd.lanes(0.5) * growth.abs()).max(zero);
    // Where light comes from behind, e^−x·M(e − x), x the absorbance from the far end to the near one: M of what is negative is e^… of what is positive.
    let nearer = (zero - growth).max(zero).min(optical_depth);
    (least + nearer).exp_neg() * mean(simd, (growth + optical_depth).abs()) / mean(simd, optical_depth)
}

/// M(x) = (1 − e^−x)/x, x ≥ 0; see [`splat_core::shade::joint::mean`].
#[inline(always)]
fn mean<S: Simd>(simd: S, depth: Lanes<S>) -> Lanes<S> {
    let depth = depth.max(simd.lanes(TINY));
    depth.opacity() / depth
}

/// Its M is 1 in single precision.
const TINY: f32 = 1e-8;

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::raster::pulp;

    #[test]
    fn a_part_of_a_ray_sends_what_quadrature_finds() {
        const STEPS: usize = 20_000;
        for optical_depth in [1e-5, 0.03, 1.0, 9.0] {
            for growth in [-20.0, -3.0, -0.1, 0.0, 1e-4, 0.7, 14.0] {
                let middle = 0.5 * f64::abs(growth) + 0.4;
                let sum = |power: f64| {
                    let term = |k: usize| {
                        let weight = if k == 0 || k == STEPS { 1.0 } else { [2.0, 4.0][k % 2] };
                        let s = k as f64 / STEPS as f64;
                        weight * libm::exp(-power * (middle + growth * (s - 0.5)) - optical_depth * s)
                    };
                    (0..=STEPS).map(term).sum::<f64>()
                };
                let exact = sum(1.0) / sum(0.0);
                let [in_middle, grows, depth] = [middle, growth, optical_depth].map(|v| pulp::Scalar.lanes(v as f32));
                let mut found = [0.0; MAX_LANES];
                share(pulp::Scalar, in_middle, grows, depth).store(&mut found);
                let found = f64::from(found[0]);
                assert!((found / exact - 1.0).abs() < 1e-5, "{optical_depth}, {growth}: {found} for {exact}");
            }
        }
    }
}
