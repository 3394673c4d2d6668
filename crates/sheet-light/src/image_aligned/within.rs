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

use crate::Error;
use crate::shared::error::cancelled;
use crate::shared::lattice::neighbours::{Cells, Receivers, lanes};
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::raster::lanes::MAX_LANES;
use splat_core::shade::LitBy;
use splat_core::shade::joint::{MediumCell, THIN, mean, thickness};
use splat_core::{Progress, Receiver, SplatKind, Transmittance};

/// What a voxel knows of a light, by channel: the absorbance and its slopes, per step along each axis of the lattice.
type Slopes = [[f32; 4]; 3];

/// A thick volume in its lights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Within {
    /// By light, a number of voxels and two more; `None` for one without shadows.
    of_lights: Vec<Option<Vec<Slopes>>>,
    /// Whether a voxel lies in the volume, two more at the end: beyond its faces nothing goes on as inside.
    is_inside: Vec<bool>,
    /// Mean step of the lattice, world units.
    width: f32,
    extinction_rgb: [f32; 3],
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

impl Within {
    /// Looks depths up about each needed voxel; `None` where no step through the volume is thick, or no light has shadows.
    pub(crate) fn new(
        receivers: &Receivers<'_>,
        lights: &[LitBy<'_>],
        origin: DVec3,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        let has_shadows = lights.iter().any(|lit| lit.shadow.is_some());
        if !has_shadows || receivers.volume.shadow_coefficient == 0.0 || !is_thick(receivers) {
            return Ok(None);
        }
        let voxels = VoxelDepths::new(receivers, origin);
        let slopes =
            |lit: &LitBy<'_>| lit.shadow.map(|shadow| voxels.slopes_of_light(lit, shadow, progress)).transpose();
        let of_lights = lights.iter().map(slopes).collect::<Result<_, _>>()?;
        let mut is_inside = voxels.of_each(progress, |place| voxels.value(place).is_some())?;
        is_inside.extend([false; 2]);
        let extinction_rgb = receivers.volume.material.extinction_rgb;
        Ok(Some(Self { of_lights, is_inside, width: voxels.width as f32, extinction_rgb }))
    }

    /// Puts what the eye gets of a light in the place of what arrives at the middle, `through`, in the lanes whose medium is thick.
    pub(crate) fn replace(
        &self,
        cells: &Cells,
        light: usize,
        parts: &[RayPart; MAX_LANES],
        through: &mut [[f32; MAX_LANES]; 3],
    ) {
        let Some(slopes) = self.of_lights[light].as_deref() else {
            return;
        };
        let greatest = self.extinction_rgb.iter().fold(0.0f32, |most, e| most.max(*e));
        for lane in lanes(cells.lane_bits) {
            let part = &parts[lane];
            let weight = thickness(part.optical_depth * greatest * self.width / part.length);
            // Of no length nothing is seen, and the weight is no number.
            if weight.is_nan() || weight <= 0.0 {
                continue;
            }
            let Some(about) = self.mean(slopes, &cells.ranks[lane], &cells.weights[lane]) else {
                continue;
            };
            for channel in 0..3 {
                let [absorbance, slope @ ..] = about[channel];
                let slope = Vec3::from_array(slope);
                let middle = absorbance - slope.dot(part.middle);
                let growth = slope.dot(part.to_eye);
                let sent = share(middle, growth, part.optical_depth * self.extinction_rgb[channel]);
                through[channel][lane] += weight * (sent - through[channel][lane]);
            }
        }
    }

    /// The weighted mean of the voxels of a cell that lie in the volume.
    fn mean(&self, slopes: &[Slopes], ranks: &[usize; 4], weights: &[[f32; 2]; 4]) -> Option<Slopes> {
        let mut sum = [[0.0; 4]; 3];
        let mut whole = 0.0;
        for (first, weights) in ranks.iter().zip(weights) {
            for (rank, weight) in (*first..).zip(weights) {
                if !self.is_inside[rank] {
                    continue;
                }
                whole += weight;
                for (sum, number) in sum.as_flattened_mut().iter_mut().zip(slopes[rank].as_flattened()) {
                    *sum += weight * number;
                }
            }
        }
        (whole > 0.0).then(|| sum.map(|channel| channel.map(|number| number / whole)))
    }

    /// Bytes of that of so many voxels, if the volume is thick.
    pub(crate) fn bytes(receivers: &Receivers<'_>, voxels: u64, lights: &[LitBy<'_>]) -> u64 {
        let shadows = lights.iter().filter(|lit| lit.shadow.is_some()).count();
        if shadows > 0 && is_thick(receivers) { voxels * (shadows * size_of::<Slopes>() + 1) as u64 } else { 0 }
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

/// Rows of voxels that are looked up together.
const ROWS: usize = 64;

/// Share of [`THIN`] below which a voxel's slopes are not looked up: what is mixed of it and of thick ones is thin.
const PART: f32 = 0.25;

/// The needed voxels of a volume as cells that receive light.
struct VoxelDepths<'a, 'v> {
    receivers: &'a Receivers<'v>,
    axes: DMat3,
    /// World position of the lattice's first point, and that of what positions of receivers are relative to.
    start: DVec3,
    origin: DVec3,
    width: f64,
}

impl<'a, 'v> VoxelDepths<'a, 'v> {
    fn new(receivers: &'a Receivers<'v>, origin: DVec3) -> Self {
        Self {
            receivers,
            axes: receivers.volume.axes(),
            start: receivers.volume.origin(),
            origin,
            width: width(receivers),
        }
    }

    /// What `make` makes of the place of each needed voxel, in lattice coordinates from the rim on.
    fn of_each<T: Send>(&self, progress: &Progress, make: impl Fn(DVec3) -> T + Sync) -> Result<Vec<T>, Error> {
        let [nx, ny, nz] = self.receivers.voxels.dims();
        let shifts = [0, 1].map(|k| self.receivers.volume.packing.shift(k + self.receivers.rim[2] % 2));
        let rows: Vec<usize> = (0..ny * nz).collect();
        let of_rows = |rows: &[usize]| {
            progress.tick(0).map_err(cancelled)?;
            let mut made = Vec::new();
            for row in rows {
                let shift = shifts[row / ny % 2];
                for i in (0..nx).filter(|i| self.receivers.voxels.has(*i, row % ny, row / ny)) {
                    made.push(make(DVec3::new(i as f64 + shift, (row % ny) as f64 + shift, (row / ny) as f64)));
                }
            }
            Ok(made)
        };
        let parts = rows.par_chunks(ROWS).map(of_rows).collect::<Result<Vec<Vec<T>>, Error>>()?;
        Ok(parts.into_iter().flatten().collect())
    }

    /// The value at a place; `None` outside of the volume.
    fn value(&self, place: DVec3) -> Option<f32> {
        self.receivers.volume.value_at(place - DVec3::from_array(self.receivers.rim.map(|n| n as f64)))
    }

    /// The slopes of a light at all needed voxels, and two more.
    fn slopes_of_light(
        &self,
        lit: &LitBy<'_>,
        shadow: &dyn Transmittance,
        progress: &Progress,
    ) -> Result<Vec<Slopes>, Error> {
        let mut slopes = self.of_each(progress, |place| self.slopes(lit, shadow, place))?;
        // Voxels are read by two, and one that is missing has the rank of the next.
        slopes.extend([[[0.0; 4]; 3]; 2]);
        Ok(slopes)
    }

    fn slopes(&self, lit: &LitBy<'_>, shadow: &dyn Transmittance, place: DVec3) -> Slopes {
        let volume = self.receivers.volume;
        let Some(value) = self.value(place) else {
            return [[0.0; 4]; 3];
        };
        let world = self.start + self.axes * (place - DVec3::from_array(self.receivers.rim.map(|n| n as f64)));
        let position = (world - self.origin).as_vec3();
        let receiver =
            Receiver { position, normal: Vec3::ZERO, radius: self.receivers.radius, kind: SplatKind::Medium };
        let straight = f64::from(volume.transfer.at(value).extinction) * volume.extinction_scale * self.width;
        let optical_depth = volume.material.extinction_rgb.map(|factor| factor * straight as f32);
        if optical_depth.iter().all(|depth| *depth <= PART * THIN) {
            return shadow.absorbance(&receiver).map(|middle| [middle, 0.0, 0.0, 0.0]);
        }
        let to_light = lit.light.irradiance(world, 0.0).to_light;
        let width = self.width as f32;
        let cell =
            MediumCell { position, width, radius: self.receivers.radius, optical_depth, absorbs: volume.casts_shadow };
        let depths = cell.depths(shadow, to_light.as_vec3().normalize_or_zero());
        depths.map(|depth| {
            let slope = self.axes.transpose() * (depth.across.as_dvec3() / self.width);
            let here = f64::from(depth.middle()) + slope.dot(place);
            [here as f32, slope.x as f32, slope.y as f32, slope.z as f32]
        })
    }
}

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
