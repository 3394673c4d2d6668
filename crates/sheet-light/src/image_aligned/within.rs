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
use crate::shared::voxels::{VoxelPlace, Voxels};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::raster::lanes::MAX_LANES;
use splat_core::shade::LitBy;
use splat_core::shade::joint::{MediumCell, THIN, mean, thickness};
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

/// The part of a ray in a slab.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RayPart {
    /// Its middle, and its way to the eye, in lattice coordinates from the rim on.
    pub(crate) middle: Vec3,
    pub(crate) to_eye: Vec3,
    /// World units.
    pub(crate) length: f32,
    /// Optical depth, to be multiplied with the material's extinctions.
    pub(crate) optical_depth: f32,
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

    /// Puts what the eye gets of a light in the place of what arrives at the middle, `through`, in the lanes whose medium is thick.
    pub(crate) fn replace(
        &self,
        neighbours: &Neighbours,
        voxels: &Voxels,
        cells: &Cells,
        light: usize,
        parts: &[RayPart; MAX_LANES],
        through: &mut [[f32; MAX_LANES]; 3],
    ) {
        let Some(light) = &self.lights[light] else {
            return;
        };
        let extinction = self.volume.material.extinction_rgb;
        let thickest = extinction.iter().fold(0.0f32, |most, e| most.max(*e)) * self.width as f32;
        for lane in lanes(cells.lane_bits) {
            let part = &parts[lane];
            let weight = thickness(part.optical_depth * thickest / part.length);
            // Of no length nothing is seen, and the weight is no number.
            if weight.is_nan() || weight <= 0.0 {
                continue;
            }
            let slopes = |rank| *light.slopes(rank, || self.slopes(light, neighbours.voxel(voxels, rank)));
            let Some(about) = mean_of_voxels(&cells.ranks[lane], &cells.weights[lane], slopes) else {
                continue;
            };
            for channel in 0..3 {
                let [absorbance, slope @ ..] = about[channel];
                let slope = Vec3::from_array(slope);
                let middle = absorbance - slope.dot(part.middle);
                let growth = slope.dot(part.to_eye);
                let sent = share(middle, growth, part.optical_depth * extinction[channel]);
                through[channel][lane] += weight * (sent - through[channel][lane]);
            }
        }
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

impl LightWithin<'_> {
    /// The slopes of a voxel by its rank; `find` finds them where nobody has asked yet. Whoever is first finds what any other would.
    #[inline]
    fn slopes(&self, rank: usize, find: impl FnOnce() -> Option<Slopes>) -> &Option<Slopes> {
        let part = self.parts[rank / TOGETHER].get_or_init(|| Box::new([const { OnceLock::new() }; TOGETHER]));
        part[rank % TOGETHER].get_or_init(find)
    }
}

/// The weighted mean of the voxels of a cell that lie in the volume: two neighbours have ranks beside each other.
#[inline]
fn mean_of_voxels(
    ranks: &[usize; 4],
    weights: &[[f32; 2]; 4],
    slopes: impl Fn(usize) -> Option<Slopes>,
) -> Option<Slopes> {
    let mut sum = [[0.0; 4]; 3];
    let mut whole = 0.0;
    for (first, weights) in ranks.iter().zip(weights) {
        // A voxel that is missing has no weight.
        for (rank, weight) in (*first..).zip(weights).filter(|(_, weight)| **weight > 0.0) {
            let Some(slopes) = slopes(rank) else {
                continue;
            };
            whole += weight;
            for (sum, number) in sum.as_flattened_mut().iter_mut().zip(slopes.as_flattened()) {
                *sum += weight * number;
            }
        }
    }
    (whole > 0.0).then(|| sum.map(|channel| channel.map(|number| number / whole)))
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
/// `growth` away from the eye, and `optical_depth` is that of the part.
fn share(middle: f32, growth: f32, optical_depth: f32) -> f32 {
    let least = (middle - 0.5 * growth.abs()).max(0.0);
    if growth >= 0.0 {
        return libm::expf(-least) * mean(growth + optical_depth) / mean(optical_depth);
    }
    // e^−x·M(e − x), x the absorbance from the far end to the near one: M of what is negative is e^… of what is positive.
    let back = -growth;
    let nearer = back.min(optical_depth);
    libm::expf(-least - nearer) * mean((back - optical_depth).abs()) / mean(optical_depth)
}

#[cfg(test)]
mod tests {
    use super::*;

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
                let found = f64::from(share(middle as f32, growth as f32, optical_depth as f32));
                assert!((found / exact - 1.0).abs() < 1e-5, "{optical_depth}, {growth}: {found} for {exact}");
            }
        }
    }
}
