//! A layer of a pixel: its discs, averaged (Eq. 1).

use crate::BlendInput;
use crate::cone::curvature;
use crate::disc::Ray;
use crate::fragments::Fragment;
use crate::layers::mean_depth;
use crate::shade::{Place, Shown};
use splat_core::Material;
use splat_core::glam::Vec3;
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};

/// One layer of a pixel, its discs averaged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layer {
    pub(crate) depth: f32,
    pub(crate) opacity: [f32; 3],
    /// Averages by weight and opacity, times opacity.
    pub(crate) values: [f32; MAX_CHANNELS],
}

impl Layer {
    /// Eq. 1 for depth and opacity, and for what is shown, whose weights are w times the opacity. All are averaged as differences from the
    /// nearest disc's, so what is constant stays so to the last bit.
    pub(crate) fn from_fragments(fragments: &[Fragment], input: &BlendInput<'_>, ray: &Ray, sizes: [usize; 2]) -> Self {
        let [planes, channels] = sizes;
        let optics = |f: &Fragment, p: usize| input.discs.looks[f.disc as usize].opacity(p, f.facing / ray.length);
        let first = &fragments[0];
        let mut weights = 0.0;
        let mut layer = Self { depth: mean_depth(fragments), opacity: [0.0; 3], values: [0.0; MAX_CHANNELS] };
        let nearest: [f32; 3] = std::array::from_fn(|p| if p < planes { optics(first, p) } else { 0.0 });
        for fragment in fragments {
            weights += fragment.weight;
            for p in 0..planes {
                layer.opacity[p] += fragment.weight * (optics(fragment, p) - nearest[p]);
            }
        }
        for p in 0..planes {
            layer.opacity[p] = (layer.opacity[p] / weights + nearest[p]).clamp(0.0, 1.0);
        }
        if layer.opacity == [0.0; 3] {
            return layer;
        }
        let share = |f: &Fragment| std::array::from_fn(|p| if p < planes { f.weight * optics(f, p) } else { 0.0 });
        let plane = |c: usize| ChannelLayout::plane_of(c, channels, planes);
        match input.shown {
            Shown::Discs(values) => {
                let disc_values =
                    |f: &Fragment| &values[input.discs.ids[f.disc as usize] as usize * channels..][..channels];
                mean_values(fragments, disc_values, share, plane, &mut layer.values);
            }
            Shown::Pixels(light) => {
                let disc = input.discs.ids[first.disc as usize] as usize;
                let place = Place { discs: input.discs, ray, depth: layer.depth, disc };
                light.on_layer(fragments, &place, share, plane, &mut layer.values);
            }
        }
        for (c, value) in layer.values.iter_mut().enumerate().take(channels) {
            *value *= layer.opacity[plane(c)];
        }
        layer
    }

    /// Another opacity, with the values that it shows.
    pub(crate) fn set_opacity(&mut self, opacity: [f32; 3], sizes: [usize; 2]) {
        let [planes, channels] = sizes;
        if opacity == self.opacity {
            return;
        }
        for c in 0..channels {
            let p = ChannelLayout::plane_of(c, channels, planes);
            self.values[c] *= if self.opacity[p] > 0.0 { opacity[p] / self.opacity[p] } else { 0.0 };
        }
        self.opacity = opacity;
    }
}

/// Averages of the discs' values by what each has of the sum of a plane's weights.
fn mean_values<'v>(
    fragments: &[Fragment],
    disc_values: impl Fn(&Fragment) -> &'v [f32],
    share: impl Fn(&Fragment) -> [f32; 3],
    plane: impl Fn(usize) -> usize,
    means: &mut [f32; MAX_CHANNELS],
) {
    let first = disc_values(&fragments[0]);
    let mut sums = [0.0; 3];
    for fragment in fragments {
        let shares = share(fragment);
        (0..3).for_each(|p| sums[p] += shares[p]);
        for (c, (value, from)) in disc_values(fragment).iter().zip(first).enumerate() {
            means[c] += shares[plane(c)] * (value - from);
        }
    }
    for (c, from) in first.iter().enumerate() {
        let sum = sums[plane(c)];
        means[c] = if sum > 0.0 { means[c] / sum + from } else { 0.0 };
    }
}

/// The material of a layer, if it bounds matter.
pub(crate) fn bound_matter<'a>(fragments: &[Fragment], input: &BlendInput<'a>) -> Option<&'a Material> {
    let material = &input.discs.materials[input.discs.looks[fragments[0].disc as usize].material as usize];
    material.bounds_matter().then_some(material)
}

/// The normal of a layer: the average by weight of normals that point to the nearest disc's side, which stays where they cancel. Of
/// unit length, in the camera's space. With it the curvature, one over a length.
pub(crate) fn normal(fragments: &[Fragment], input: &BlendInput<'_>) -> (Vec3, f32) {
    let disc_normal = |f: &Fragment| input.discs.normals[f.disc as usize];
    let first = disc_normal(&fragments[0]);
    let side = |n: Vec3| if n.dot(first) < 0.0 { -n } else { n };
    let sum: Vec3 = fragments.iter().map(|f| side(disc_normal(f)) * f.weight).sum();
    let weights: f32 = fragments.iter().map(|f| f.weight).sum();
    let radius = input.discs.discs[fragments[0].disc as usize].radius;
    (sum.try_normalize().unwrap_or(first), curvature(sum, weights, radius))
}
