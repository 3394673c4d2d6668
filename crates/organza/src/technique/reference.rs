//! The `reference` technique: the same splats, exactly. The technique sorts all fragments of a pixel by their depth and composites them in f64, so
//! no error of slices, tables and single precision is left. The technique takes hundreds of times as long as `points`, which it judges.

use crate::frame::{Frame, Shaded};
use crate::pass;
use crate::scene::{Scene, Technique};
use crate::technique::{Fold, Session};
use crate::{CostRecord, Error, stage};
use reference::{Fragment, Input, Order, PixelSum, fold_fragments};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Cloud, DepthFragment, SplatKind};
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
    Box::new(Exact { frame, splats: None, pixels: Vec::new(), narrowing })
}

/// The splats of a frame that are composited exactly.
struct Exact<'a> {
    frame: &'a Frame<'a>,
    /// Once they were gathered: the splats, and the values of each.
    splats: Option<(Cloud, Vec<f32>)>,
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
        let (cloud, values) = self.splats.get_or_insert_with(|| {
            let ids = frame.translucent(Technique::Reference);
            let gathered = ids.iter().flat_map(|i| &values[*i as usize * channels..][..*channels]);
            (frame.drawn().gather(ids), gathered.copied().collect())
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
            let begun = &*into;
            let last = &self.pixels;
            let pixel = |k: usize, fragments: &[Fragment]| {
                let known = last.get(k).filter(|pixel| pixel.sum.is_rounded_in(begun, k));
                let sum = known.map_or_else(|| PixelSum::from_accumulator(begun, k), |pixel| pixel.sum.clone());
                let mut pixel = Pixel { sum, fragments: 0 };
                fragments.iter().filter(|f| range.contains(&f.depth)).for_each(|f| pixel.add(&input, f, narrowing));
                pixel
            };
            let pixels =
                fold_fragments(&input, &opaque.depth, pixel, Some(frame.progress)).map_err(|_| Error::Cancelled)?;
            stage.items_in = cloud.len() as u64;
            stage.items_out = pixels.len() as u64;
            stage.fragments = pixels.iter().map(|p| p.fragments).sum();
            stage.bytes = SAMPLE_BYTES * pixels.len() as u64;
            pixels.iter().enumerate().for_each(|(k, pixel)| pixel.sum.store(into, k));
            self.pixels = pixels;
            Ok(())
        })
    }
}

/// A pixel, and how many fragments the last range gave it.
#[derive(Debug, Clone)]
struct Pixel {
    sum: PixelSum,
    fragments: u64,
}

impl Pixel {
    /// A fragment behind all so far.
    fn add(&mut self, input: &Input<'_>, fragment: &Fragment, narrowing: &[[f32; 2]]) {
        let cloud = input.cloud;
        let i = fragment.splat as usize;
        let planes = self.sum.planes();
        let extinction = input.materials[cloud.material[i] as usize].extinction_rgb;
        let is_medium = cloud.kind[i] == SplatKind::Medium && cloud.gaussian_of(i).is_none();
        let id = cloud.footprint[i] as usize;
        let thickness = || input.footprints.layers()[id].spacing_for_radius(cloud.radius[i]);
        let narrow = || narrowing[id][0] + narrowing[id][1] * fragment.distance_sq as f32;
        self.fragments += 1;
        self.sum.add(
            extinction.map(|e| fragment.optical_depth * f64::from(e)),
            &input.values[i * input.channels..][..input.channels],
            |channel| ChannelLayout::plane_of(channel, input.channels, planes),
            cloud.object[i],
            |[before, after]| DepthFragment {
                depth: fragment.depth.max(0.0) as f32,
                thickness: if is_medium { thickness() } else { 0.0 },
                narrow: if is_medium { narrow() } else { 1.0 },
                before,
                after,
            },
        );
    }
}
