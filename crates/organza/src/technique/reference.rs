//! The `reference` technique: the same splats, exactly. All fragments of a pixel are sorted by their own depth and composited in
//! f64, so nothing is left of slices, tables and single precision. It takes hundreds of times as long as `points`, which it
//! judges.

use crate::frame::{Frame, Shaded};
use crate::pass;
use crate::scene::{Scene, Technique};
use crate::technique::{Fold, Session};
use crate::{CostRecord, Error, stage};
use reference::{Fragment, Input, Order, fold_fragments};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Cloud, DepthFragment, DepthProfile, SplatKind};
use std::ops::Range;

/// Bytes of a sample: its list of splats, and what it sums up in f64.
const SAMPLE_BYTES: u64 = 512;

/// Bytes of the pixels of a row of tasks.
pub(crate) fn bytes(scene: &Scene) -> u64 {
    SAMPLE_BYTES * scene.camera.with_samples(scene.render.antialias).pixels()
}

/// Begins a frame.
pub(crate) fn begin<'a>(frame: &'a Frame<'a>) -> Box<dyn Fold + 'a> {
    let narrowing = frame.loaded.footprints.layers().iter().map(|f| f.narrowing()).collect();
    Box::new(Exact { frame, own: None, pixels: Vec::new(), narrowing })
}

/// The splats of a frame that are composited exactly.
struct Exact<'a> {
    frame: &'a Frame<'a>,
    /// Once they were gathered: the splats, and the values of each.
    own: Option<(Cloud, Vec<f32>)>,
    /// What the last range left, to go on from without rounding where nobody else has been in between.
    pixels: Vec<Pixel>,
    /// Of each footprint, see [`splat_core::Footprint::narrowing`].
    narrowing: Vec<[f32; 2]>,
}

impl Fold for Exact<'_> {
    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        _: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let frame = self.frame;
        let Shaded { values, channels, .. } = frame.shaded(cost)?;
        let opaque = frame.opaque(cost)?;
        let narrowing = &self.narrowing;
        let (cloud, values) = self.own.get_or_insert_with(|| {
            let ids = frame.translucent(frame.drawn(), Technique::Reference);
            let of = ids.iter().flat_map(|i| &values[*i as usize * channels..][..*channels]);
            (frame.drawn().gather(&ids), of.copied().collect())
        });
        if cloud.is_empty() {
            return Ok(());
        }
        let input = Input {
            cloud,
            camera: &frame.camera,
            footprints: &frame.loaded.footprints,
            materials: &frame.loaded.materials,
            values,
            channels: *channels,
            resampling_sigma_px: frame.raster_params().resampling_sigma_px,
            order: Order::Fragment,
        };
        let range = f64::from(range.start)..f64::from(range.end);
        frame.progress.begin(stage::REFERENCE);
        cost.measure(pass::REFERENCE, |stage| {
            let (begun, last) = (&*into, &self.pixels);
            let pixel = |k: usize, fragments: &[Fragment]| {
                let known = last.get(k).filter(|pixel| pixel.is_rounded_in(begun, k));
                let mut pixel = known.cloned().unwrap_or_else(|| Pixel::of(begun, k));
                pixel.fragments = 0;
                fragments.iter().filter(|f| range.contains(&f.depth)).for_each(|f| pixel.add(&input, f, narrowing));
                pixel
            };
            let pixels =
                fold_fragments(&input, &opaque.depth, pixel, Some(frame.progress)).map_err(|_| Error::Cancelled)?;
            stage.items_in = cloud.len() as u64;
            stage.items_out = pixels.len() as u64;
            stage.fragments = pixels.iter().map(|p| p.fragments).sum();
            stage.bytes = SAMPLE_BYTES * pixels.len() as u64;
            pixels.iter().enumerate().for_each(|(k, pixel)| pixel.store(into, k));
            self.pixels = pixels;
            Ok(())
        })
    }
}

/// What a pixel has so far, in f64.
#[derive(Debug, Clone)]
struct Pixel {
    /// One, or three.
    optical_depth: Vec<f64>,
    channels: Vec<f64>,
    depth: Option<DepthProfile>,
    object: Option<u32>,
    fragments: u64,
}

impl Pixel {
    fn of(accumulator: &Accumulator, k: usize) -> Self {
        let at = |planes: &[Vec<f32>]| planes.iter().map(|plane| f64::from(plane[k])).collect();
        Self {
            optical_depth: at(&accumulator.optical_depth),
            channels: at(&accumulator.channels),
            depth: accumulator.depth.get(k).copied(),
            object: accumulator.object.get(k).copied(),
            fragments: 0,
        }
    }

    /// A fragment behind all so far.
    fn add(&mut self, input: &Input<'_>, fragment: &Fragment, narrowing: &[[f32; 2]]) {
        let (i, count, planes) = (fragment.splat as usize, self.channels.len(), self.optical_depth.len());
        let extinction = input.materials[input.cloud.material[i] as usize].extinction_rgb;
        let own = |plane: usize| fragment.optical_depth * f64::from(extinction[plane]);
        for (c, sum) in self.channels.iter_mut().enumerate() {
            let plane = ChannelLayout::plane_of(c, count, planes);
            let weight = libm::exp(-self.optical_depth[plane]) * -libm::expm1(-own(plane));
            *sum += weight * f64::from(input.values[i * count + c]);
        }
        let before = self.optical_depth[planes / 2];
        self.optical_depth.iter_mut().enumerate().for_each(|(plane, sum)| *sum += own(plane));
        let after = self.optical_depth[planes / 2];
        self.fragments += 1;
        if after <= before {
            return;
        }
        let medium = input.cloud.kind[i] == SplatKind::Medium;
        let footprint = &input.footprints.layers()[input.cloud.footprint[i] as usize];
        let [constant, slope] = narrowing[input.cloud.footprint[i] as usize];
        if let Some(depth) = &mut self.depth {
            depth.add(&DepthFragment {
                depth: fragment.depth.max(0.0) as f32,
                thickness: if medium { footprint.spacing_for_radius(input.cloud.radius[i]) } else { 0.0 },
                narrow: if medium { constant + slope * fragment.distance_sq as f32 } else { 1.0 },
                before: before as f32,
                after: after as f32,
            });
        }
        if let Some(object) = self.object.as_mut().filter(|o| **o == u32::MAX) {
            *object = input.cloud.object[i];
        }
    }

    /// Whether an accumulator has what was stored of it.
    fn is_rounded_in(&self, accumulator: &Accumulator, k: usize) -> bool {
        let same = |planes: &[Vec<f32>], own: &[f64]| planes.iter().zip(own).all(|(plane, v)| plane[k] == *v as f32);
        same(&accumulator.optical_depth, &self.optical_depth) && same(&accumulator.channels, &self.channels)
    }

    fn store(&self, accumulator: &mut Accumulator, k: usize) {
        let store = |planes: &mut [Vec<f32>], own: &[f64]| {
            planes.iter_mut().zip(own).for_each(|(plane, v)| plane[k] = *v as f32);
        };
        store(&mut accumulator.optical_depth, &self.optical_depth);
        store(&mut accumulator.channels, &self.channels);
        accumulator.depth.get_mut(k).into_iter().zip(self.depth).for_each(|(to, from)| *to = from);
        accumulator.object.get_mut(k).into_iter().zip(self.object).for_each(|(to, from)| *to = from);
    }
}
