//! The accumulator that splats are folded into, and the named images that a render returns.

use crate::DepthProfile;
use std::collections::BTreeMap;

/// The additive effects, in the order of their sum: background + … = beauty. A technique fills those that it shows; the others
/// are names that are kept for techniques to come.
pub const ADDITIVE_LAYERS: [&str; 8] =
    ["background", "ambient", "emission", "direct", "scatter1", "scatterN", "reflection", "refraction"];

/// The effects that shading gives to what is seen, in the order of their channels. An effect more is a name here and a row of
/// `Radiance::effects`.
///
/// `ambient`: ambient radiance that is reflected or scattered. `emission`: what materials give off, colours shown as they are
/// included. `direct`: light that comes from a light and is reflected about a normal. `scatter1`: light that comes from a
/// light and is scattered once, by a phase function.
pub const SHADED_EFFECTS: [&str; 4] = ["ambient", "emission", "direct", "scatter1"];

/// Which images are kept. Beauty is always made.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LayerSet {
    /// Additive effects that are filled, each an image of its own.
    pub effects: bool,
    /// Transmittance of the shadow maps at what is seen, weighted by opacity.
    pub shadow: bool,
    /// Normal of what is seen, weighted by opacity, world space.
    pub normal: bool,
    /// The four depths: first, median, mean, sigma.
    pub depth: bool,
    /// Object id of the first splat that adds to a pixel; `u32::MAX` where none does.
    pub object: bool,
}

/// Pixels of one layer, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub enum LayerData {
    /// One number a pixel.
    Scalar(Vec<f32>),
    /// Linear Rec.709 radiance, or a vector.
    Rgb(Vec<[f32; 3]>),
    /// An id a pixel.
    Id(Vec<u32>),
}

/// Everything that one render returns, by name: `beauty` and `alpha` always; those of [`ADDITIVE_LAYERS`] that are filled,
/// `shadow`, `normal`, `depth.first`, `depth.median`, `depth.mean`, `depth.sigma`, `object` when asked for.
///
/// Depth is linear view depth and +∞ where it is undefined.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layers {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Images by name.
    pub images: BTreeMap<&'static str, LayerData>,
}

impl Layers {
    /// The pixels of an RGB layer.
    pub fn rgb(&self, name: &str) -> Option<&[[f32; 3]]> {
        match self.images.get(name)? {
            LayerData::Rgb(pixels) => Some(pixels),
            _ => None,
        }
    }

    /// The pixels of a scalar layer.
    pub fn scalar(&self, name: &str) -> Option<&[f32]> {
        match self.images.get(name)? {
            LayerData::Scalar(pixels) => Some(pixels),
            _ => None,
        }
    }

    /// Adds or replaces a layer.
    pub fn insert(&mut self, name: &'static str, data: LayerData) {
        self.images.insert(name, data);
    }

    /// Multiplies all depths by `scale`.
    pub fn scale_depths(&mut self, scale: f32) {
        for (name, data) in &mut self.images {
            if let (true, LayerData::Scalar(depth)) = (name.starts_with("depth."), data) {
                depth.iter_mut().for_each(|d| *d *= scale);
            }
        }
    }
}

/// What a technique folds into, per pixel: colours weighted by absorbed share, optical depth so far, depths.
///
/// Optical depth rather than transmittance is accumulated: T = e^−τ then comes from one sum, and the weights
/// T_before − T_after telescope to 1 − T whatever the number of splats.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Accumulator {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Optical depth so far: one plane when all absorb alike, else three.
    pub optical_depth: Vec<Vec<f32>>,
    /// Channel planes, each Σ weight·value, as many as the shading gives per splat.
    pub channels: Vec<Vec<f32>>,
    /// Where light is absorbed, so far; empty when not asked for.
    pub depth: Vec<DepthProfile>,
    /// Object of the first contribution; empty when not asked for.
    pub object: Vec<u32>,
}

impl Accumulator {
    /// Nothing seen yet: zero colours, zero optical depth, undefined depths.
    pub fn new(size: [u32; 2], optical_depth_planes: usize, channels: usize, depth: bool, object: bool) -> Self {
        let n = size[0] as usize * size[1] as usize;
        Self {
            size,
            optical_depth: vec![vec![0.0; n]; optical_depth_planes],
            channels: vec![vec![0.0; n]; channels],
            depth: if depth { vec![DepthProfile::default(); n] } else { Vec::new() },
            object: if object { vec![u32::MAX; n] } else { Vec::new() },
        }
    }
}
