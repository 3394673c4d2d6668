//! Sets of particles → means of the pixels, and their error.

use super::checkpoint::Checkpoint;
use super::fault;
use super::parts::Part;
use crate::device::Helper;
use crate::points::Drawing;
use crate::scene::ParticlesSettings;
use crate::{Error, Progress, RenderOptions};
use pbsr::{Ensemble, EnsembleParams, FoldParams, LitBy, Object, Occluder, Renderer, Scene};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera};
use tsm::ShadowMap;

/// Sets between two looks at the error.
const BATCH: u32 = 8;
/// Without a wanted error, a step is the number of sets so far over this.
const GROWTH: u32 = 16;
/// Optical depth of a pixel that particles hide in every set.
const HIDDEN: f32 = 64.0;
/// Share of the allowed memory that the particles of one batch may take.
const BATCH_SHARE: u64 = 4;

/// Folds sets until there are as many as asked for, or the error is small enough.
pub(super) fn fold(
    drawing: &Drawing<'_>,
    parts: &[Part<'_>],
    maps: &[Option<ShadowMap>],
    camera: &Camera,
    occluder: Option<&Occluder>,
    options: &RenderOptions,
    mut checkpoint: Option<&mut Checkpoint>,
) -> Result<Average, Error> {
    let objects: Vec<Object<'_>> = parts.iter().map(Part::object).collect();
    let origin = drawing.loaded.cloud.origin;
    let lit = drawing.shining(maps).map(|(light, map)| LitBy { light, shadow: map.map(|m| (m, origin)) });
    let lights: Vec<LitBy<'_>> = lit.collect();
    let scene = Scene { objects: &objects, lights: &lights, ambient: drawing.ambient, camera, occluder };
    let set = &drawing.layers;
    let kept = EnsembleParams {
        effects: set.effects,
        normal: set.normal,
        shadow: set.shadow,
        depth_range: None,
        radiance_unit: 0.0,
    };
    let ensemble = match checkpoint.as_deref_mut().and_then(Checkpoint::take) {
        Some(found) => found,
        None => Ensemble::new(camera.size, &kept).map_err(fault)?,
    };
    let mut average = Average { ensemble, particles: 0, interrupted: false };
    let params = FoldParams { max_bytes: options.max_memory / BATCH_SHARE, ..FoldParams::default() };
    let settings = &drawing.settings.particles;
    let background = |_, _| drawing.background;
    let mut renderer = Renderer::new();
    let helper = helper(drawing, checkpoint.is_some());
    drawing.progress.add_total(u64::from(settings.repeat_level.saturating_sub(average.ensemble.levels())));
    while let Some(levels) = average.next_step(settings) {
        let step = Step { until: average.ensemble.levels() + levels, helper, params, progress: drawing.progress };
        let folded = step.fold(&mut renderer, &scene, &mut average.ensemble);
        match folded.map_err(fault) {
            Ok(particles) => average.particles += particles,
            // Two sets are a picture, with its error.
            Err(Error::Cancelled) if average.ensemble.levels() >= 2 => average.interrupted = true,
            Err(error) => return Err(error),
        }
        if let Some(checkpoint) = checkpoint.as_deref_mut() {
            checkpoint.write_if_due(&average.ensemble)?;
        }
        let reached = |target: f64| {
            average.ensemble.rms_error(&background, occluder) / f64::from(drawing.settings.antialias) <= target
        };
        if average.interrupted || settings.target_error.is_some_and(reached) {
            break;
        }
    }
    if let Some(checkpoint) = checkpoint {
        checkpoint.write(&average.ensemble)?;
    }
    Ok(average)
}

/// The device that folds, if there is one and it may.
fn helper<'a>(drawing: &Drawing<'a>, checkpoint: bool) -> Option<&'a Helper> {
    let helper = drawing.helper?;
    if checkpoint {
        helper.leave("particles with a checkpoint are the processor's, whose bits do not depend on where it went on");
    }
    (!checkpoint).then_some(helper)
}

/// Sets between two looks.
struct Step<'a> {
    until: u32,
    helper: Option<&'a Helper>,
    params: FoldParams,
    progress: &'a Progress,
}

impl Step<'_> {
    /// Folds by the device, and what that did not do by the processor, from where it was. Gives the number of particles.
    fn fold(&self, renderer: &mut Renderer, scene: &Scene<'_>, ensemble: &mut Ensemble) -> Result<u64, pbsr::Error> {
        let by_device = match self.helper {
            Some(helper) => helper.fold(scene, ensemble, self.until, self.params.max_bytes, self.progress)?,
            None => 0,
        };
        match self.until - ensemble.levels() {
            0 => Ok(by_device),
            left => Ok(by_device + renderer.fold(scene, ensemble, left, &self.params, self.progress)?.particles),
        }
    }
}

/// Sets that were folded.
pub(super) struct Average {
    pub(super) ensemble: Ensemble,
    /// Particles of the sets that this run made.
    pub(super) particles: u64,
    /// Whether it was stopped before there were enough.
    pub(super) interrupted: bool,
}

impl Average {
    /// Sets until the next look at error and clock; `None` when there are enough.
    fn next_step(&self, settings: &ParticlesSettings) -> Option<u32> {
        let left = settings.repeat_level.checked_sub(self.ensemble.levels()).filter(|left| *left > 0)?;
        // Where the error decides, the looks depend on nothing else.
        let grown = if settings.target_error.is_some() { 0 } else { self.ensemble.levels() / GROWTH };
        Some((BATCH + grown).min(left))
    }
}

/// Means over the sets as what translucent splats leave in an accumulator.
pub(super) fn accumulate(ensemble: &Ensemble, layout: &ChannelLayout, accumulator: &mut Accumulator) {
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    let alpha = layers.scalar("alpha").expect("invariant: an ensemble has an opacity");
    for (to, a) in accumulator.optical_depth[0].iter_mut().zip(alpha) {
        *to = (-(-a).ln_1p()).min(HIDDEN);
    }
    let mut put = |first: usize, name: &str, weighted: bool| {
        let image = layers.rgb(name).expect("invariant: an ensemble keeps the layers of its channels");
        for c in 0..3 {
            for (k, to) in accumulator.channels[first + c].iter_mut().enumerate() {
                *to = image[k][c] * if weighted { alpha[k] } else { 1.0 };
            }
        }
    };
    let effects: Vec<usize> = layout.effects().collect();
    if let [beauty] = effects[..] {
        put(beauty, "beauty", false);
    } else {
        effects.iter().zip(["ambient", "emission", "direct"]).for_each(|(first, name)| put(*first, name, false));
    }
    if let Some(first) = layout.normal() {
        put(first, "normal", true);
    }
    if let Some(at) = layout.shadow() {
        let shadow = layers.scalar("shadow").expect("invariant: an ensemble keeps the layers of its channels");
        accumulator.channels[at].iter_mut().enumerate().for_each(|(k, to)| *to = shadow[k] * alpha[k]);
    }
}

/// Standard error of each pixel's luminance: that of the mean of its independent samples.
pub(super) fn error_layer(ensemble: &Ensemble, drawing: &Drawing<'_>, occluder: Option<&Occluder>) -> Vec<f32> {
    let layers = ensemble.read(&|_, _| drawing.background, occluder);
    let samples = layers.scalar("std_error").expect("invariant: an ensemble has an error");
    let antialias = drawing.settings.antialias as usize;
    let [width, height] = ensemble.size().map(|s| s as usize / antialias);
    let pixel = |k: usize| {
        let (x, y) = (k % width * antialias, k / width * antialias);
        let square = |s: usize| {
            let at = (y + s / antialias) * width * antialias + x + s % antialias;
            samples[at] * samples[at]
        };
        (0..antialias * antialias).map(square).sum::<f32>().sqrt() / (antialias * antialias) as f32
    };
    (0..width * height).map(pixel).collect()
}
