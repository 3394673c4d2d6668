//! How much of what is seen the cells of shadow maps are too coarse for.

use super::Frame;
use crate::output::displayed;
use crate::shadows::Coarse;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::shade::joint::{MediumSpacing, THIN, Within};
use splat_core::shade::{LitBy, Radiance, ShadeInput, shade_splat, shade_splat_within};
use splat_core::{FootprintStack, Receiver, SplatKind, Transmittance};
use std::f64::consts::PI;
use tsm::ShadowMap;

/// Splats that are looked at, at most: a share of a tenth is found within a hundredth.
const LOOKED_AT: usize = 2048;
/// Splats among which those are sought that are seen: one in sixteen may be.
const CANDIDATES: usize = 16 * LOOKED_AT;

/// Splats that are looked at while there is the eye's map, before it is known which of them opaque surfaces hide.
const SHOWN: usize = 2 * LOOKED_AT;

/// Share of what splats show that may be off in the cells that are proposed.
const FEW: f64 = 0.05;

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

/// The shadow of nothing.
const NO_SHADOW: Even = Even([1.0; 3]);

/// A splat in view.
struct Sample {
    splat: usize,
    /// Samples of the picture that it stands for, times its opacity.
    area: f64,
    /// Pixels of a length of one at its centre.
    px_per_world: f64,
    /// Sample of the picture that its centre lies in.
    place: usize,
    /// View depth of the face toward the viewer.
    nearest: f64,
    /// Whether it is of a thick medium.
    is_thick: bool,
}

/// A splat that thick media leave something of, as it was looked at while there was the eye's map.
pub(crate) struct Shown {
    sample: Sample,
    /// Where the light of a splat of a thick medium is off.
    off: Option<Off>,
}

/// The error of the light at a splat, where it is above the tolerance.
#[derive(Clone, Copy)]
struct Off {
    /// The light whose map errs most.
    light: usize,
    /// How many times narrower cells would do, where light is smooth; at an edge of a shadow cells of any width err, but on a narrower strip.
    finer: Option<f64>,
}

/// Light of a frame, and from which error on it is displayed off.
struct Look<'a> {
    input: ShadeInput<'a>,
    lit: Vec<(LitBy<'a>, Option<&'a ShadowMap>)>,
    /// The eye's map, where media are lit within, and the footprints of their splats.
    eye: Option<(&'a ShadowMap, &'a FootprintStack)>,
    /// Factor of the exposure.
    gain: f32,
    /// Levels of a byte.
    tolerance: f64,
}

impl Frame<'_> {
    /// Estimates what the cells of the shadow maps are too coarse for, where maps were made, from splats at even distances in the list.
    pub(crate) fn coarse(&self) -> Option<Coarse> {
        let look = self.look(None)?;
        let mut found = Vec::new();
        let shown: &[Shown] = match self.shown.get() {
            Some(shown) => shown,
            None => {
                let samples = self.candidates().filter_map(|i| self.sample(i));
                found.extend(samples.map(|sample| Shown { sample, off: None }));
                &found
            }
        };
        let seen: Vec<&Shown> = shown.iter().filter(|shown| self.is_in_front(&shown.sample)).collect();
        let samples: Vec<&&Shown> = seen.iter().step_by(seen.len().div_ceil(LOOKED_AT).max(1)).collect();
        // In the order of the list, so that sums do not depend on threads.
        let off: Vec<Option<Off>> =
            samples.par_iter().map(|shown| shown.off.or_else(|| look.off(&shown.sample))).collect();
        let mut by_light = vec![0.0; look.lit.len()];
        for (shown, off) in samples.iter().zip(&off) {
            if let Some(off) = off {
                by_light[off.light] += shown.sample.area;
            }
        }
        let area = samples.iter().map(|shown| shown.sample.area).sum::<f64>();
        let worst = (0..by_light.len()).max_by(|a, b| by_light[*a].total_cmp(&by_light[*b]))?;
        let of_worst = samples.iter().zip(&off).filter_map(|(shown, off)| {
            let off = off.as_ref().filter(|off| off.light == worst)?;
            Some((shown.sample.area / area, off.finer))
        });
        let (smooth, edges): (Vec<_>, Vec<_>) = of_worst.partition(|(_, finer)| finer.is_some());
        // Edges of shadows are as wide as a cell, so their share goes with its width.
        let finer_at_edges = edges.iter().map(|(share, _)| share).sum::<f64>() / FEW;
        let mut smooth: Vec<(f64, f64)> =
            smooth.into_iter().filter_map(|(share, finer)| Some((finer?, share))).collect();
        smooth.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut left = FEW;
        let finer = smooth.iter().find(|(_, share)| {
            left -= share;
            left < 0.0
        });
        let tsm::Prediction { size: [columns, rows], bytes, .. } = look.lit[worst].1?.prediction();
        let cells = columns.max(rows) as u32;
        let light = self.with_intensity().nth(worst)?.label.clone();
        let better_cells = f64::from(cells) * finer.map_or(1.0, |(finer, _)| *finer).max(finer_at_edges).max(1.0);
        let share = by_light.iter().sum::<f64>() / area;
        (area > 0.0).then_some(Coarse { share, cells, better_cells, light, bytes })
    }

    /// `None` where there are no shadow maps.
    fn look<'b>(&'b self, eye: Option<&'b ShadowMap>) -> Option<Look<'b>> {
        let maps = &self.maps.get()?.of_all;
        Some(Look {
            input: self.shading(&[]),
            lit: self.shining(maps).collect(),
            eye: eye.map(|eye| (eye, &self.loaded.footprints)),
            gain: libm::exp2(self.settings.exposure) as f32,
            // Rounding to bytes moves each by half a level.
            tolerance: (255.0 * self.settings.tolerance).max(1.0),
        })
    }

    /// Splats at even distances in the list, among which those are sought that are seen.
    fn candidates(&self) -> impl ExactSizeIterator<Item = usize> {
        let splats = self.drawn().len();
        (0..splats).step_by(splats.div_ceil(CANDIDATES).max(1))
    }

    /// The splats in view that thick media leave something of, by the eye's map, which is gone when the picture is there; and where the light of those of
    /// thick media is off.
    pub(super) fn shown(&self, eye: &ShadowMap) -> Vec<Shown> {
        let cloud = self.drawn();
        let in_view: Vec<Sample> = self.candidates().filter_map(|i| self.sample(i)).collect();
        let left = |sample: Sample| {
            let share = eye.transmittance(&Receiver::of_splat(cloud, sample.splat)).iter().sum::<f32>() / 3.0;
            let share = f64::from(share);
            (share > UNSEEN).then_some(Sample { area: share * sample.area, ..sample })
        };
        let samples: Vec<Sample> = in_view.into_par_iter().filter_map(left).collect();
        let step = samples.len().div_ceil(SHOWN).max(1);
        let samples: Vec<Sample> = samples.into_iter().step_by(step).collect();
        let Some(look) = self.look(Some(eye)) else { return Vec::new() };
        let looked_at = |sample: Sample| {
            let off = if sample.is_thick { look.off(&sample) } else { None };
            Shown { sample, off }
        };
        samples.into_par_iter().map(looked_at).collect()
    }

    /// Whether no opaque surface lies before a splat.
    fn is_in_front(&self, sample: &Sample) -> bool {
        let surface = self.opaque.get().and_then(|opaque| opaque.depth.get(sample.place));
        surface.is_none_or(|nearest| f64::from(*nearest) >= sample.nearest)
    }

    /// A splat as it is seen; `None` where its centre is out of the view.
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
        let place = row * camera.size[0] as usize + column;
        let towards = if camera.is_orthographic() { DVec3::Z } else { centre.normalize() };
        let normal = camera.view_from_offset(cloud.origin).rotation * cloud.normal_of(i);
        let slant = if cloud.kind[i] == SplatKind::Medium { 1.0 } else { normal.as_dvec3().dot(towards).abs() };
        let area = f64::from(cloud.cross_section[i]).min(PI * radius * radius);
        let area = slant * area * px_per_world * px_per_world;
        let px_per_world = px_per_world / f64::from(self.settings.antialias);
        Some(Sample { splat: i, area, px_per_world, place, nearest: centre.z - radius, is_thick })
    }
}

impl<'a> Look<'a> {
    /// The light whose map errs most at a splat, where what is displayed of its light is off by more than the tolerance.
    fn off(&self, sample: &Sample) -> Option<Off> {
        let receiver = Receiver::of_splat(self.input.cloud, sample.splat);
        // Nobody sees cells that are finer than a pixel.
        let is_seen = |map: &ShadowMap| map.cell_width(receiver.position) * sample.px_per_world >= 1.0;
        let (expected, changes) = match self.eye {
            Some((eye, footprints)) if sample.is_thick => self.changes_within(sample.splat, eye, footprints),
            // A thick cell is lit at its faces, of which looks about its middle say nothing.
            _ if sample.is_thick => return None,
            _ => self.changes(sample.splat, &receiver),
        };
        // Lights err by themselves: their squares add up.
        let mut variance = [0.0; 3];
        let mut worst = None;
        let mut most = 0.0;
        for (rank, ((_, map), change)) in self.lit.iter().zip(changes).enumerate() {
            if !map.is_some_and(is_seen) {
                continue;
            }
            let squares = change.map(|channel| channel * channel);
            (0..3).for_each(|c| variance[c] += squares[c]);
            let sum = squares.iter().sum::<f32>();
            if sum > most {
                most = sum;
                worst = Some(rank);
            }
        }
        let byte = |radiance: f32| f64::from(displayed(radiance.max(0.0) * self.gain));
        let error = |c: usize| byte(expected[c] + variance[c].sqrt()) - byte(expected[c]);
        let tolerances = (0..3).map(error).fold(0.0, f64::max) / self.tolerance;
        let light = worst.filter(|_| tolerances > 1.0)?;
        // Of smooth light the error goes with the square of a cell's width.
        Some(Off { light, finer: sample.is_thick.then(|| tolerances.sqrt()) })
    }

    /// Radiance of a splat that is lit at its middle, and how far each light's map is off there.
    fn changes(&self, splat: usize, receiver: &Receiver) -> ([f32; 3], Vec<[f32; 3]>) {
        let arrives = |map: &Option<&ShadowMap>| Even(map.map_or([1.0; 3], |map| map.transmittance(receiver)));
        let through: Vec<Even> = self.lit.iter().map(|(_, map)| arrives(map)).collect();
        let radiance = |through: &[Even]| {
            let shadows: Vec<&dyn Transmittance> = through.iter().map(|even| even as &dyn Transmittance).collect();
            let (radiance, _) = shade_splat(&ShadeInput { lights: &self.lights(&shadows), ..self.input }, splat);
            lit(&radiance)
        };
        let expected = radiance(&through);
        let change = |(rank, (_, map)): (usize, &(LitBy<'_>, Option<&ShadowMap>))| {
            let error = map.map_or(0.0, |map| map.interpolation_error(receiver));
            let mut other = through.clone();
            other[rank] = Even(through[rank].0.map(|t| if t > 0.5 { t - error } else { t + error }.clamp(0.0, 1.0)));
            let radiance = radiance(&other);
            [0, 1, 2].map(|c| radiance[c] - expected[c])
        };
        (expected, self.lit.iter().enumerate().map(change).collect())
    }

    /// The same of a splat that is lit within: a third of what cells twice as wide would change.
    fn changes_within(&self, splat: usize, eye: &ShadowMap, footprints: &FootprintStack) -> ([f32; 3], Vec<[f32; 3]>) {
        let radiance = |shadows: &[&dyn Transmittance]| {
            let input = ShadeInput { lights: &self.lights(shadows), ..self.input };
            lit(&shade_splat_within(&Within { input: &input, eye, footprints }, splat).0)
        };
        let shadow = |map: Option<&'a ShadowMap>| map.map_or(&NO_SHADOW as &dyn Transmittance, |map| map);
        let shadows: Vec<&dyn Transmittance> = self.lit.iter().map(|(_, map)| shadow(*map)).collect();
        let expected = radiance(&shadows);
        let mut changes = vec![[0.0; 3]; self.lit.len()];
        for (rank, (_, map)) in self.lit.iter().enumerate() {
            let Some(map) = map else { continue };
            let wider = map.wider();
            let mut wide = shadows.clone();
            wide[rank] = &wider;
            let changed = radiance(&wide);
            changes[rank] = [0, 1, 2].map(|c| (changed[c] - expected[c]) / 3.0);
        }
        (expected, changes)
    }

    /// The lights, those with a map behind these shadows.
    fn lights<'b>(&'b self, shadows: &[&'b dyn Transmittance]) -> Vec<LitBy<'b>> {
        let with = |((lit, map), shadow): (&(LitBy<'b>, Option<&ShadowMap>), &&'b dyn Transmittance)| LitBy {
            shadow: map.map(|_| *shadow),
            ..*lit
        };
        self.lit.iter().zip(shadows).map(with).collect()
    }
}

/// The radiance that hangs on light.
fn lit(radiance: &Radiance) -> [f32; 3] {
    let parts = [radiance.ambient, radiance.emission, radiance.direct, radiance.scatter1];
    [0, 1, 2].map(|c| parts.iter().map(|part| part[c]).sum())
}
