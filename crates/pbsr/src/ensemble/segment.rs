//! An ensemble as a segment of a picture: means over the sets, in the form that splats leave in an accumulator.

use crate::Ensemble;
use splat_core::raster::OpaqueImage;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, DepthProfile, LayerData, PixelSamples};

/// Optical depth of a pixel that particles hide in every set.
const HIDDEN: f32 = 64.0;

impl Ensemble {
    /// Fills an empty accumulator, whose channels are those of `layout`: optical depths, light by effect, normals, shadow; depths and
    /// objects where it keeps them, `objects` the name there of each object of the scene that was folded.
    ///
    /// # Panics
    /// If the accumulator has another size, or keeps what [`crate::EnsembleParams`] did not ask for.
    pub fn accumulate(&self, layout: &ChannelLayout, objects: &[u32], accumulator: &mut Accumulator) {
        let layers = self.read(&|_, _| [0.0; 3], None);
        let scalar = |name: &str| layers.scalar(name).expect("invariant: an ensemble keeps the layers of its channels");
        let alpha = scalar("alpha");
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
            let shadow = scalar("shadow");
            accumulator.channels[at].iter_mut().enumerate().for_each(|(k, to)| *to = shadow[k] * opacity(k, 1));
        }
        if !accumulator.depth.is_empty() {
            let plane = &accumulator.optical_depth[accumulator.optical_depth.len() / 2];
            let first = scalar("depth.first");
            let median = scalar("depth.median");
            let mean = scalar("depth.mean");
            let sigma = scalar("depth.sigma");
            for (k, profile) in accumulator.depth.iter_mut().enumerate() {
                *profile = DepthProfile::of_depths(first[k], median[k], mean[k], sigma[k], plane[k]);
            }
        }
        if let Some(LayerData::Id(found)) = layers.images.get("object") {
            let named = |object: &u32| objects.get(*object as usize).copied().unwrap_or(u32::MAX);
            accumulator.object.iter_mut().zip(found).for_each(|(to, object)| *to = named(object));
        }
    }

    /// Standard error of each pixel's luminance, before a background and behind nothing but `occluder`; a pixel has `antialias`² samples,
    /// which are independent.
    pub fn std_error(
        &self,
        background: &(dyn Fn(u32, u32) -> [f32; 3] + Sync),
        occluder: Option<&OpaqueImage>,
        antialias: u32,
    ) -> LayerData {
        let samples = self.read(background, occluder);
        let errors = samples.scalar("std_error").expect("invariant: an ensemble has an error");
        let pixels = PixelSamples { size: self.size(), antialias };
        let count = pixels.per_pixel() as f32;
        LayerData::Scalar(pixels.map(|at| at.map(|k| errors[k] * errors[k]).sum::<f32>().sqrt() / count))
    }
}
