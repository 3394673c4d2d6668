//! An ensemble of particles as layers: means as what splats would leave, and what only the hits tell.

use super::parts::Part;
use crate::frame::Frame;
use pbsr::Ensemble;
use splat_core::raster::OpaqueImage;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, DepthProfile, LayerData, Layers, PixelSamples};

/// Optical depth of a pixel that particles hide in every set.
const HIDDEN: f32 = 64.0;

/// Means over the sets as what translucent splats leave in an accumulator.
pub(super) fn accumulate(ensemble: &Ensemble, layout: &ChannelLayout, accumulator: &mut Accumulator) {
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    let alpha = layers.scalar("alpha").expect("invariant: an ensemble has an opacity");
    let by_channel = layers.rgb("alpha_rgb");
    let opacity = |k: usize, c: usize| by_channel.map_or(alpha[k], |rgb| rgb[k][c]);
    for (c, plane) in accumulator.optical_depth.iter_mut().enumerate() {
        plane.iter_mut().enumerate().for_each(|(k, to)| *to = (-libm::log1pf(-opacity(k, c))).min(HIDDEN));
    }
    let mut put = |first: usize, name: &str, weight: &dyn Fn(usize) -> f32| {
        let image = layers.rgb(name).expect("invariant: an ensemble keeps the layers of its channels");
        for c in 0..3 {
            for (k, to) in accumulator.channels[first + c].iter_mut().enumerate() {
                *to = image[k][c] * weight(k);
            }
        }
    };
    layout.effects().for_each(|(name, first)| put(first, name, &|_| 1.0));
    if let Some(first) = layout.normal() {
        put(first, "normal", &|k| opacity(k, 1));
    }
    if let Some(at) = layout.shadow() {
        let shadow = layers.scalar("shadow").expect("invariant: an ensemble keeps the layers of its channels");
        accumulator.channels[at].iter_mut().enumerate().for_each(|(k, to)| *to = shadow[k] * opacity(k, 1));
    }
}

/// Where the hits lie, and whose they are, where a segment keeps that.
pub(super) fn of_hits(ensemble: &Ensemble, parts: &[&Part<'_>], segment: &mut Accumulator) {
    if segment.depth.is_empty() && segment.object.is_empty() {
        return;
    }
    let samples = ensemble.read(&|_, _| [0.0; 3], None);
    let plane = &segment.optical_depth[segment.optical_depth.len() / 2];
    let depths = ["depth.first", "depth.median", "depth.mean", "depth.sigma"].map(|name| samples.scalar(name));
    for (k, profile) in segment.depth.iter_mut().enumerate() {
        let at = depths.map(|d| d.expect("invariant: depths are kept where they are asked for")[k]);
        *profile = DepthProfile::of_depths(at, plane[k]);
    }
    if let Some(LayerData::Id(of_part)) = samples.images.get("object") {
        let objects = segment.object.iter_mut().zip(of_part);
        objects.for_each(|(to, part)| *to = parts.get(*part as usize).map_or(u32::MAX, |part| part.of));
    }
}

/// Standard error of each pixel's luminance.
pub(super) fn std_error(ensemble: &Ensemble, occluder: Option<&OpaqueImage>, frame: &Frame<'_>) -> LayerData {
    let background = frame.background();
    let samples = ensemble.read(&|x, y| background.radiance(x, y), occluder);
    error(&PixelSamples { size: ensemble.size(), antialias: frame.settings.antialias }, &samples)
}

/// Standard error of each pixel's luminance: that of the mean of its independent samples.
fn error(pixels: &PixelSamples, samples: &Layers) -> LayerData {
    let errors = samples.scalar("std_error").expect("invariant: an ensemble has an error");
    let all = pixels.per_pixel() as f32;
    LayerData::Scalar(pixels.map(|at| at.map(|k| errors[k] * errors[k]).sum::<f32>().sqrt() / all))
}
