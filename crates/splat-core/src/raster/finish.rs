//! The last step: opaque surface and background behind the translucent splats, samples averaged to pixels, named layers.

use super::OpaqueImage;
use super::lanes::exp_neg;
use crate::shade::{ChannelLayout, MAX_CHANNELS};
use crate::{Accumulator, Camera, Environment, LayerData, LayerSet, Layers};
use glam::DVec3;
use rayon::prelude::*;

/// Pixel rows handled by one task.
const BAND: u32 = 16;

/// What is seen where nothing else is.
#[derive(Debug, Clone, Copy)]
pub enum Background<'a> {
    /// The same radiance everywhere, linear Rec.709.
    Color([f32; 3]),
    /// An environment, by the camera whose pixels are the samples.
    Environment(&'a Environment, &'a Camera),
}

impl Background<'_> {
    /// Mean radiance over a solid angle around a direction, a unit vector of the world.
    pub fn toward(&self, direction: DVec3, solid_angle: f64) -> [f32; 3] {
        match self {
            Self::Color(color) => *color,
            Self::Environment(environment, _) => environment.radiance(direction, solid_angle),
        }
    }

    /// Mean radiance behind sample (x, y), counted from the top left.
    pub fn radiance(&self, x: u32, y: u32) -> [f32; 3] {
        match self {
            Self::Color(color) => *color,
            Self::Environment(environment, camera) => {
                let (direction, solid_angle) = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
                environment.radiance(direction, solid_angle)
            }
        }
    }
}

/// Light that was mirrored or bent on its way to the eye, by sample: it comes from elsewhere than straight ahead.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GlassImage {
    /// Radiance that surfaces mirror, through all that lies before them.
    pub mirrored: Vec<[f32; 3]>,
    /// Radiance that is seen behind everything in the place of what lies straight ahead, before anything weakens it;
    /// [`GlassImage::STRAIGHT`] where no ray was bent.
    pub behind: Vec<[f32; 3]>,
}

impl GlassImage {
    /// Where what lies straight ahead is seen.
    pub const STRAIGHT: [f32; 3] = [f32::NAN; 3];

    /// Nothing mirrored, nothing bent.
    pub fn new(size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Self { mirrored: vec![[0.0; 3]; pixels], behind: vec![Self::STRAIGHT; pixels] }
    }

    fn bent(&self, k: usize) -> Option<[f32; 3]> {
        Some(self.behind[k]).filter(|b| !b[0].is_nan())
    }
}

/// One sample with everything behind it added.
struct Sample {
    transmittance: [f32; 3],
    background: [f32; 3],
    /// `reflection` and `refraction`.
    glass: [[f32; 3]; 2],
    values: [f32; MAX_CHANNELS],
    depth: [f32; 4],
    object: u32,
}

/// Samples that are to become a picture.
#[derive(Debug, Clone, Copy)]
pub struct FinishInput<'a> {
    /// What was composited.
    pub accumulator: &'a Accumulator,
    /// Nearest opaque surfaces; may be empty.
    pub opaque: &'a OpaqueImage,
    /// What is seen where nothing else is.
    pub background: Background<'a>,
    /// What was mirrored and bent, if something was: the effects `reflection` and `refraction`.
    pub glass: Option<&'a GlassImage>,
    /// What the accumulator's channels are.
    pub layout: &'a ChannelLayout,
    /// Layers to make.
    pub layers: &'a LayerSet,
    /// Samples along each side of a pixel, ≥ 1.
    pub antialias: u32,
}

/// Turns an accumulator with `antialias`² samples a pixel into layers of `accumulator.size / antialias`.
///
/// Colours, alpha, shadow and normal are box-filtered. `depth.first` is the least of the samples, the other depths are
/// means over the samples where they are defined, and `object` is that of the first sample that has one.
pub fn finish(input: &FinishInput<'_>) -> Layers {
    let FinishInput { accumulator, glass, layout, layers, antialias, .. } = *input;
    let size = accumulator.size.map(|s| s / antialias);
    let bands: Vec<Output> = (0..size[1].div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let rows = band * BAND..size[1].min((band + 1) * BAND);
            let mut out = Output::new(rows.len() * size[0] as usize, layout.count(), glass.is_some());
            let mut samples = Vec::with_capacity((antialias * antialias) as usize);
            for (k, (y, x)) in rows.flat_map(|y| (0..size[0]).map(move |x| (y, x))).enumerate() {
                samples.clear();
                for sy in y * antialias..(y + 1) * antialias {
                    for sx in x * antialias..(x + 1) * antialias {
                        samples.push(sample(input, [sx, sy]));
                    }
                }
                out.pixel(k, &samples);
            }
            out
        })
        .collect();
    let mut out = Output::new(0, layout.count(), glass.is_some());
    bands.into_iter().for_each(|band| out.append(band));
    out.into_layers(size, layout, layers)
}

fn sample(input: &FinishInput<'_>, pixel: [u32; 2]) -> Sample {
    let [x, y] = pixel;
    let FinishInput { accumulator: acc, opaque, background, .. } = *input;
    let k = y as usize * acc.size[0] as usize + x as usize;
    let planes = acc.optical_depth.len();
    let transmittance: [f32; 3] =
        std::array::from_fn(|c| exp_neg(acc.optical_depth[if planes == 3 { c } else { 0 }][k]));
    let solid = opaque.depth.get(k).copied().filter(|d| d.is_finite());
    let bent = input.glass.and_then(|glass| glass.bent(k));
    let count = acc.channels.len();
    let mut values = [0.0; MAX_CHANNELS];
    for (c, (value, plane)) in values.iter_mut().zip(&acc.channels).enumerate() {
        *value = plane[k];
        // Of what lies straight ahead a bent ray shows nothing; what is no light, its normal and shadow, is still told.
        if solid.is_some() && (bent.is_none() || c >= input.layout.colors()) {
            *value += transmittance[ChannelLayout::plane_of(c, count, 3)] * opaque.channels[c][k];
        }
    }
    let through = if solid.is_some() { [0.0; 3] } else { transmittance };
    // What is hidden is not looked up.
    let behind = if through == [0.0; 3] || bent.is_some() { [0.0; 3] } else { background.radiance(x, y) };
    let unseen = acc.object.get(k).is_none_or(|o| *o == u32::MAX);
    Sample {
        transmittance: through,
        background: std::array::from_fn(|c| through[c] * behind[c]),
        glass: [
            input.glass.map_or([0.0; 3], |glass| glass.mirrored[k]),
            bent.map_or([0.0; 3], |behind| std::array::from_fn(|c| transmittance[c] * behind[c])),
        ],
        values,
        depth: acc.depth.get(k).map_or([f32::INFINITY; 4], |d| d.depths(acc.optical_depth[planes / 2][k], solid)),
        object: if unseen { opaque.object.get(k).copied().unwrap_or(u32::MAX) } else { acc.object[k] },
    }
}

/// Pixels being filled.
struct Output {
    alpha: Vec<f32>,
    background: Vec<[f32; 3]>,
    /// `reflection` and `refraction`; empty without.
    glass: [Vec<[f32; 3]>; 2],
    /// Channel planes.
    values: Vec<Vec<f32>>,
    depth: [Vec<f32>; 4],
    object: Vec<u32>,
}

impl Output {
    fn new(n: usize, channels: usize, glass: bool) -> Self {
        Self {
            alpha: vec![0.0; n],
            background: vec![[0.0; 3]; n],
            glass: std::array::from_fn(|_| if glass { vec![[0.0; 3]; n] } else { Vec::new() }),
            values: vec![vec![0.0; n]; channels],
            depth: std::array::from_fn(|_| vec![f32::INFINITY; n]),
            object: vec![u32::MAX; n],
        }
    }

    /// Appends the pixels of the next band.
    fn append(&mut self, band: Self) {
        self.alpha.extend(band.alpha);
        self.background.extend(band.background);
        self.glass.iter_mut().zip(band.glass).for_each(|(to, from)| to.extend(from));
        self.values.iter_mut().zip(band.values).for_each(|(to, from)| to.extend(from));
        self.depth.iter_mut().zip(band.depth).for_each(|(to, from)| to.extend(from));
        self.object.extend(band.object);
    }

    fn pixel(&mut self, k: usize, samples: &[Sample]) {
        let share = 1.0 / samples.len() as f32;
        for s in samples {
            self.alpha[k] += share * (1.0 - (s.transmittance[0] + s.transmittance[1] + s.transmittance[2]) / 3.0);
            for c in 0..3 {
                self.background[k][c] += share * s.background[c];
                for (plane, effect) in self.glass.iter_mut().zip(&s.glass) {
                    plane.get_mut(k).into_iter().for_each(|sum| sum[c] += share * effect[c]);
                }
            }
            for (plane, value) in self.values.iter_mut().zip(&s.values) {
                plane[k] += share * value;
            }
            if self.object[k] == u32::MAX {
                self.object[k] = s.object;
            }
            self.depth[0][k] = self.depth[0][k].min(s.depth[0]);
        }
        for (d, plane) in self.depth.iter_mut().enumerate().skip(1) {
            let defined: Vec<f32> = samples.iter().map(|s| s.depth[d]).filter(|v| v.is_finite()).collect();
            if !defined.is_empty() {
                plane[k] = defined.iter().sum::<f32>() / defined.len() as f32;
            }
        }
    }

    fn into_layers(self, size: [u32; 2], layout: &ChannelLayout, set: &LayerSet) -> Layers {
        let mut layers = Layers { size, ..Layers::default() };
        let rgb = |at: usize| -> Vec<[f32; 3]> {
            (0..self.alpha.len()).map(|k| std::array::from_fn(|c| self.values[at + c][k])).collect()
        };
        let mut beauty = self.background.clone();
        for (_, at) in layout.effects() {
            for (sum, part) in beauty.iter_mut().zip(rgb(at)) {
                for c in 0..3 {
                    sum[c] += part[c];
                }
            }
        }
        for effect in &self.glass {
            for (sum, part) in beauty.iter_mut().zip(effect) {
                for c in 0..3 {
                    sum[c] += part[c];
                }
            }
        }
        layers.insert("beauty", LayerData::Rgb(beauty));
        if set.effects {
            for (name, effect) in ["reflection", "refraction"].into_iter().zip(self.glass) {
                if !effect.is_empty() {
                    layers.insert(name, LayerData::Rgb(effect));
                }
            }
            layers.insert("background", LayerData::Rgb(self.background.clone()));
            for (name, at) in layout.effects() {
                layers.insert(name, LayerData::Rgb(rgb(at)));
            }
        }
        if let Some(at) = layout.normal() {
            layers.insert("normal", LayerData::Rgb(rgb(at)));
        }
        if let Some(at) = layout.shadow() {
            layers.insert("shadow", LayerData::Scalar(self.values[at].clone()));
        }
        if set.depth {
            let [first, median, mean, sigma] = self.depth;
            for (name, plane) in
                [("depth.first", first), ("depth.median", median), ("depth.mean", mean), ("depth.sigma", sigma)]
            {
                layers.insert(name, LayerData::Scalar(plane));
            }
        }
        if set.object {
            layers.insert("object", LayerData::Id(self.object));
        }
        layers.insert("alpha", LayerData::Scalar(self.alpha));
        layers
    }
}
