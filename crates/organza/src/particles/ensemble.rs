//! Sets of particles → means of the pixels, and their error.

use super::fault;
use super::parts::Part;
use crate::points::Drawing;
use crate::scene::ParticlesSettings;
use crate::{Error, RenderOptions};
use pbsr::{Ensemble, EnsembleParams, FoldParams, LitBy, Object, Occluder, Renderer, Scene, SplatSampler};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, Similarity};
use tsm::ShadowMap;

/// Sets between two looks at the error.
const BATCH: u32 = 8;
/// Optical depth of a pixel that particles hide in every set.
const HIDDEN: f32 = 64.0;
/// Share of the allowed memory that the particles of one batch may take.
const BATCH_SHARE: u64 = 4;

/// Folds sets until there are as many as asked for, or the error is small enough.
pub(super) fn fold(
    drawing: &Drawing<'_>,
    parts: &[Part],
    maps: &[Option<ShadowMap>],
    camera: &Camera,
    occluder: Option<&Occluder>,
    options: &RenderOptions,
) -> Result<(Ensemble, u64), Error> {
    let samplers =
        parts.iter().map(|p| SplatSampler::new(&p.cloud, &p.params)).collect::<Result<Vec<_>, _>>().map_err(fault)?;
    let mut objects = Vec::with_capacity(parts.len());
    for (part, sampler) in parts.iter().zip(&samplers) {
        objects.push(Object { sampler, transform: Similarity::default(), look: part.look });
    }
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
    let mut ensemble = Ensemble::new(camera.size, &kept).map_err(fault)?;
    let params = FoldParams { max_bytes: options.max_memory / BATCH_SHARE, ..FoldParams::default() };
    let ParticlesSettings { repeat_level, target_error } = drawing.settings.particles;
    let background = |_, _| drawing.background;
    let mut renderer = Renderer::new();
    let mut particles = 0;
    while ensemble.levels() < repeat_level {
        let step = if target_error.is_some() { BATCH } else { repeat_level };
        let levels = step.min(repeat_level - ensemble.levels());
        let counts = renderer.fold(&scene, &mut ensemble, levels, &params, drawing.progress).map_err(fault)?;
        particles += counts.particles;
        let reached =
            |target: f64| ensemble.rms_error(&background, occluder) / f64::from(drawing.settings.antialias) <= target;
        if target_error.is_some_and(reached) {
            break;
        }
    }
    Ok((ensemble, particles))
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
