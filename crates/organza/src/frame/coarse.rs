//! How much of what is seen the cells of shadow maps are too coarse for.

use super::Frame;
use crate::output::displayed;
use crate::shadows::Coarse;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::shade::joint::{MediumSpacing, THIN};
use splat_core::shade::{LitBy, ShadeInput, shade_splat};
use splat_core::{Receiver, SplatKind, Transmittance};
use std::f64::consts::PI;
use tsm::ShadowMap;

/// Splats that are looked at, at most: a share of a tenth is found within a hundredth.
const LOOKED_AT: usize = 2048;
/// Splats among which those are sought that are seen: one in sixteen may be.
const CANDIDATES: usize = 16 * LOOKED_AT;

/// Share of a splat that is seen, below which it is as good as hidden.
const UNSEEN: f64 = 1e-3;

/// The same light at every place.
#[derive(Clone, Copy)]
struct Even([f32; 3]);

impl Transmittance for Even {
    fn transmittance(&self, _: &Receiver) -> [f32; 3] {
        self.0
    }
}

/// A splat that is seen.
struct Sample {
    splat: usize,
    /// Samples of the picture that it stands for, times its opacity.
    area: f64,
    /// Pixels of a length of one at its centre.
    px_per_world: f64,
    /// Whether it is of a thick medium.
    is_thick: bool,
}

/// Light of a frame, and from which error on it is displayed off.
struct Look<'a> {
    input: ShadeInput<'a>,
    lit: Vec<(LitBy<'a>, Option<&'a ShadowMap>)>,
    /// Factor of the exposure.
    gain: f32,
    /// Levels of a byte.
    tolerance: f64,
}

impl Frame<'_> {
    /// Estimates what the cells of the shadow maps are too coarse for, where maps were made, from splats at even distances in the list.
    pub(crate) fn coarse(&self) -> Option<Coarse> {
        let maps = &self.maps.get()?.of_all;
        // Thick media hide most of themselves.
        let shown = self.shown_shares.get();
        let share = |candidate: usize| shown.map_or(1.0, |shares| f64::from(shares[candidate]));
        let candidates = self.candidates().enumerate().filter(|(candidate, _)| share(*candidate) > UNSEEN);
        let samples = candidates.filter_map(|(candidate, i)| {
            self.sample(i).map(|sample| Sample { area: share(candidate) * sample.area, ..sample })
        });
        let seen: Vec<Sample> = samples.collect();
        let samples: Vec<&Sample> = seen.iter().step_by(seen.len().div_ceil(LOOKED_AT).max(1)).collect();
        let look = Look {
            input: self.shading(&[]),
            lit: self.shining(maps).collect(),
            gain: libm::exp2(self.settings.exposure) as f32,
            // Rounding to bytes moves each by half a level.
            tolerance: (255.0 * self.settings.tolerance).max(1.0),
        };
        // In the order of the list, so that sums do not depend on threads.
        let worst: Vec<Option<usize>> = samples.par_iter().map(|sample| look.worst_light(sample)).collect();
        let mut off = vec![0.0; look.lit.len()];
        for (sample, worst) in samples.iter().zip(worst) {
            if let Some(light) = worst {
                off[light] += sample.area;
            }
        }
        let area = samples.iter().map(|sample| sample.area).sum::<f64>();
        let worst = (0..off.len()).max_by(|a, b| off[*a].total_cmp(&off[*b]))?;
        let [columns, rows] = look.lit[worst].1?.prediction().size;
        let light = self.with_intensity().nth(worst)?.label.clone();
        (area > 0.0).then_some(Coarse { share: off.iter().sum::<f64>() / area, cells: columns.max(rows) as u32, light })
    }

    /// Splats at even distances in the list, among which those are sought that are seen.
    fn candidates(&self) -> impl ExactSizeIterator<Item = usize> {
        let splats = self.drawn().len();
        (0..splats).step_by(splats.div_ceil(CANDIDATES).max(1))
    }

    /// What thick media leave of each candidate, by the eye's map, which is gone when the picture is there.
    pub(super) fn shares_shown(&self, eye: &ShadowMap) -> Vec<f32> {
        let cloud = self.drawn();
        let candidates: Vec<usize> = self.candidates().collect();
        let share = |i: &usize| eye.transmittance(&Receiver::of_splat(cloud, *i)).iter().sum::<f32>() / 3.0;
        candidates.par_iter().map(share).collect()
    }

    /// A splat as it is seen; `None` where its centre is out of the view or behind opaque surfaces.
    fn sample(&self, i: usize) -> Option<Sample> {
        let cloud = self.drawn();
        let spacing = MediumSpacing::of_splat(cloud, &self.loaded.footprints, i);
        let extinction = self.loaded.materials[cloud.material[i] as usize].greatest_extinction();
        let is_thick = spacing.is_some_and(|spacing| spacing.optical_depth * extinction > THIN);
        let camera = &self.camera;
        let centre = camera.view_from_offset(cloud.origin).apply(cloud.position[i]).as_dvec3();
        if centre.z <= 0.0 || !camera.may_see(centre, 0.0) {
            return None;
        }
        let radius = f64::from(cloud.radius[i]);
        let depth = if camera.is_orthographic() { 1.0 } else { centre.z };
        let px_per_world = camera.focal_px() / depth;
        let [column, row] = [(centre.x, camera.size[0]), (-centre.y, camera.size[1])]
            .map(|(at, size)| (px_per_world * at + 0.5 * f64::from(size)).clamp(0.0, f64::from(size - 1)) as usize);
        let surface = self.opaque.get().and_then(|opaque| opaque.depth.get(row * camera.size[0] as usize + column));
        if surface.is_some_and(|nearest| f64::from(*nearest) < centre.z - radius) {
            return None;
        }
        let towards = if camera.is_orthographic() { DVec3::Z } else { centre.normalize() };
        let normal = camera.view_from_offset(cloud.origin).rotation * cloud.normal_of(i);
        let slant = if cloud.kind[i] == SplatKind::Medium { 1.0 } else { normal.as_dvec3().dot(towards).abs() };
        let area = f64::from(cloud.cross_section[i]).min(PI * radius * radius);
        let area = slant * area * px_per_world * px_per_world;
        let px_per_world = px_per_world / f64::from(self.settings.antialias);
        Some(Sample { splat: i, area, px_per_world, is_thick })
    }
}

impl Look<'_> {
    /// The light whose map errs most at a splat, where what is displayed of its light is off by more than the tolerance.
    fn worst_light(&self, sample: &Sample) -> Option<usize> {
        // A thick cell is lit at its faces, of which looks about its middle say nothing.
        if sample.is_thick {
            return None;
        }
        let splat = sample.splat;
        let receiver = Receiver::of_splat(self.input.cloud, splat);
        let arrives = |map: &Option<&ShadowMap>| Even(map.map_or([1.0; 3], |map| map.transmittance(&receiver)));
        let through: Vec<Even> = self.lit.iter().map(|(_, map)| arrives(map)).collect();
        let expected = self.radiance(splat, &through);
        // Lights err by themselves: their squares add up.
        let mut variance = [0.0; 3];
        let mut worst = None;
        let mut most = 0.0;
        for (rank, (_, map)) in self.lit.iter().enumerate() {
            // Nobody sees cells that are finer than a pixel.
            let is_seen = |map: &&ShadowMap| map.cell_width(receiver.position) * sample.px_per_world >= 1.0;
            let error = map.filter(is_seen).map_or(0.0, |map| map.interpolation_error(&receiver));
            if error == 0.0 {
                continue;
            }
            let mut other = through.clone();
            other[rank] = Even(through[rank].0.map(|t| if t > 0.5 { t - error } else { t + error }.clamp(0.0, 1.0)));
            let radiance = self.radiance(splat, &other);
            let squares = [0, 1, 2].map(|c| (radiance[c] - expected[c]).powi(2));
            (0..3).for_each(|c| variance[c] += squares[c]);
            let sum = squares.iter().sum::<f32>();
            if sum > most {
                most = sum;
                worst = Some(rank);
            }
        }
        let byte = |radiance: f32| f64::from(displayed(radiance.max(0.0) * self.gain));
        let is_off = (0..3).any(|c| byte(expected[c] + variance[c].sqrt()) - byte(expected[c]) > self.tolerance);
        worst.filter(|_| is_off)
    }

    /// Radiance of a splat by such shares of each light.
    fn radiance(&self, splat: usize, through: &[Even]) -> [f32; 3] {
        let lights: Vec<LitBy<'_>> = self
            .lit
            .iter()
            .zip(through)
            .map(|((lit, map), through)| LitBy { shadow: map.map(|_| through as &dyn Transmittance), ..*lit })
            .collect();
        let (radiance, _) = shade_splat(&ShadeInput { lights: &lights, ..self.input }, splat);
        let parts = [radiance.ambient, radiance.emission, radiance.direct, radiance.scatter1];
        [0, 1, 2].map(|c| parts.iter().map(|part| part[c]).sum())
    }
}
