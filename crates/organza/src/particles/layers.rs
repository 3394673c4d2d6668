//! An ensemble of particles as layers: means as what splats would leave, and what only the hits tell.

use super::parts::Part;
use crate::points::Drawing;
use pbsr::{Ensemble, Occluder};
use splat_core::raster::OpaqueImage;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, LayerData, Layers};

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

/// Layers of the distribution of hits that are asked for: the standard error, depths, and objects.
pub(super) struct OfHits<'a> {
    pub(super) ensemble: &'a Ensemble,
    pub(super) parts: &'a [Part<'a>],
    pub(super) occluder: Option<&'a Occluder>,
    pub(super) opaque: &'a OpaqueImage,
}

impl OfHits<'_> {
    /// By name, samples become pixels.
    pub(super) fn layers(&self, drawing: &Drawing<'_>, std_error: bool) -> Vec<(&'static str, LayerData)> {
        let background = drawing.background;
        let samples = self.ensemble.read(&|_, _| background, self.occluder);
        let pixels = Pixels { size: self.ensemble.size(), antialias: drawing.settings.antialias };
        let mut layers = Vec::new();
        if std_error {
            layers.push(("std_error", pixels.error(&samples)));
        }
        if drawing.layers.depth {
            for name in ["depth.first", "depth.median", "depth.mean", "depth.sigma"] {
                let depths = samples.scalar(name).expect("invariant: depths are kept where they are asked for");
                let least = name == "depth.first";
                layers.push((name, LayerData::Scalar(pixels.map(|at| depth(at.map(|k| depths[k]), least)))));
            }
        }
        if let Some(LayerData::Id(objects)) = samples.images.get("object") {
            let seen = |at: usize| match self.parts.get(objects[at] as usize) {
                Some(part) => Some(part.of),
                None => self.opaque.object.get(at).copied().filter(|o| *o != u32::MAX),
            };
            let first = pixels.map(|at| at.filter_map(seen).next().unwrap_or(u32::MAX));
            layers.push(("object", LayerData::Id(first)));
        }
        layers
    }
}

/// The least depth of some samples, or the mean of those that are defined.
fn depth(samples: impl Iterator<Item = f32>, least: bool) -> f32 {
    let defined = samples.filter(|d| d.is_finite());
    if least {
        return defined.fold(f32::INFINITY, f32::min);
    }
    match defined.fold((0.0, 0u32), |(sum, n), d| (sum + d, n + 1)) {
        (_, 0) => f32::INFINITY,
        (sum, n) => sum / n as f32,
    }
}

/// Samples of pixels.
struct Pixels {
    /// Samples.
    size: [u32; 2],
    antialias: u32,
}

impl Pixels {
    /// One value a pixel, of the places of its samples.
    fn map<T>(&self, value: impl Fn(&mut dyn Iterator<Item = usize>) -> T) -> Vec<T> {
        let antialias = self.antialias as usize;
        let [width, height] = self.size.map(|s| s as usize / antialias);
        let of_pixel = |k: usize| {
            let (x, y) = (k % width * antialias, k / width * antialias);
            value(&mut (0..antialias * antialias).map(|s| (y + s / antialias) * width * antialias + x + s % antialias))
        };
        (0..width * height).map(of_pixel).collect()
    }

    /// Standard error of each pixel's luminance: that of the mean of its independent samples.
    fn error(&self, samples: &Layers) -> LayerData {
        let errors = samples.scalar("std_error").expect("invariant: an ensemble has an error");
        let all = (self.antialias * self.antialias) as f32;
        LayerData::Scalar(self.map(|at| at.map(|k| errors[k] * errors[k]).sum::<f32>().sqrt() / all))
    }
}
