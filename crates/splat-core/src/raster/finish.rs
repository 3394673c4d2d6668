//! The last step: opaque surface and background behind the translucent splats, samples averaged to pixels, named layers.

use super::OpaqueImage;
use super::lanes::exp_neg;
use crate::shade::ChannelLayout;
use crate::{Accumulator, Camera, Environment, LayerData, LayerSet, Layers};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Pixel rows handled by one task.
const BAND: usize = 16;

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
    let FinishInput { accumulator, layout, layers, antialias, .. } = *input;
    let size = accumulator.size.map(|s| s / antialias);
    let mut planes = Planes::new(size[0] as usize * size[1] as usize, input);
    planes.bands(BAND * size[0] as usize).into_par_iter().enumerate().for_each(|(band, mut rows)| {
        let mut samples = SampleRow::new(accumulator.size[0] as usize);
        for row in 0..rows.beauty.len() / size[0] as usize {
            rows.fill(input, &mut samples, row, band * BAND + row);
        }
    });
    planes.into_layers(size, layout, layers)
}

/// The layers of a picture while they are filled. Beauty is the sum of background, effects, reflection and refraction, so these exist even if no layer shows
/// them. Other planes are empty unless the layout or the layer set requests them.
struct Planes {
    beauty: Vec<[f32; 3]>,
    background: Vec<[f32; 3]>,
    /// One plane per entry of [`ChannelLayout::effects`].
    effects: Vec<Vec<[f32; 3]>>,
    /// Empty without glass, as `refraction`.
    reflection: Vec<[f32; 3]>,
    refraction: Vec<[f32; 3]>,
    normal: Vec<[f32; 3]>,
    shadow: Vec<f32>,
    depth: [Vec<f32>; 4],
    object: Vec<u32>,
    alpha: Vec<f32>,
}

/// The planes of a band of rows, which one task fills.
struct Rows<'a> {
    beauty: &'a mut [[f32; 3]],
    background: &'a mut [[f32; 3]],
    effects: Vec<&'a mut [[f32; 3]]>,
    reflection: &'a mut [[f32; 3]],
    refraction: &'a mut [[f32; 3]],
    normal: &'a mut [[f32; 3]],
    shadow: &'a mut [f32],
    depth: [&'a mut [f32]; 4],
    object: &'a mut [u32],
    alpha: &'a mut [f32],
}

impl Planes {
    /// Allocates planes in which nothing is seen.
    fn new(pixels: usize, input: &FinishInput<'_>) -> Self {
        let FinishInput { layout, layers, glass, .. } = input;
        let colors = |asked: bool| if asked { vec![[0.0; 3]; pixels] } else { Vec::new() };
        Self {
            beauty: colors(true),
            background: colors(true),
            effects: layout.effects().map(|_| colors(true)).collect(),
            reflection: colors(glass.is_some()),
            refraction: colors(glass.is_some()),
            normal: colors(layout.normal().is_some()),
            shadow: vec![0.0; if layout.shadow().is_some() { pixels } else { 0 }],
            depth: std::array::from_fn(|_| vec![f32::INFINITY; if layers.depth { pixels } else { 0 }]),
            object: vec![u32::MAX; if layers.object { pixels } else { 0 }],
            alpha: vec![0.0; pixels],
        }
    }

    /// Splits the planes into bands of `length` pixels; the last band may be shorter.
    fn bands(&mut self, length: usize) -> Vec<Rows<'_>> {
        let bands = self.beauty.len().div_ceil(length);
        let mut background = self.background.chunks_mut(length);
        let mut effects: Vec<_> = self.effects.iter_mut().map(|plane| plane.chunks_mut(length)).collect();
        let mut reflection = self.reflection.chunks_mut(length);
        let mut refraction = self.refraction.chunks_mut(length);
        let mut normal = self.normal.chunks_mut(length);
        let mut shadow = self.shadow.chunks_mut(length);
        let mut depth = self.depth.each_mut().map(|plane| plane.chunks_mut(length));
        let mut object = self.object.chunks_mut(length);
        let mut alpha = self.alpha.chunks_mut(length);
        let mut rows = Vec::with_capacity(bands);
        for beauty in self.beauty.chunks_mut(length) {
            rows.push(Rows {
                beauty,
                background: background.next().unwrap_or_default(),
                effects: effects.iter_mut().map(|plane| plane.next().unwrap_or_default()).collect(),
                reflection: reflection.next().unwrap_or_default(),
                refraction: refraction.next().unwrap_or_default(),
                normal: normal.next().unwrap_or_default(),
                shadow: shadow.next().unwrap_or_default(),
                depth: depth.each_mut().map(|plane| plane.next().unwrap_or_default()),
                object: object.next().unwrap_or_default(),
                alpha: alpha.next().unwrap_or_default(),
            });
        }
        rows
    }

    fn into_layers(self, size: [u32; 2], layout: &ChannelLayout, set: &LayerSet) -> Layers {
        let mut layers = Layers { size, ..Layers::default() };
        layers.insert("beauty", LayerData::Rgb(self.beauty));
        if set.effects {
            for (name, plane) in [("reflection", self.reflection), ("refraction", self.refraction)] {
                if !plane.is_empty() {
                    layers.insert(name, LayerData::Rgb(plane));
                }
            }
            layers.insert("background", LayerData::Rgb(self.background));
            for ((name, _), plane) in layout.effects().zip(self.effects) {
                layers.insert(name, LayerData::Rgb(plane));
            }
        }
        if layout.normal().is_some() {
            layers.insert("normal", LayerData::Rgb(self.normal));
        }
        if layout.shadow().is_some() {
            layers.insert("shadow", LayerData::Scalar(self.shadow));
        }
        if set.depth {
            for (name, plane) in
                ["depth.first", "depth.median", "depth.mean", "depth.sigma"].into_iter().zip(self.depth)
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

/// One row of samples, stored by plane so that its loops vectorise.
struct SampleRow {
    /// Transmittance of all translucent splats, by colour.
    transmittance: [Vec<f32>; 3],
    /// Weight of the opaque surface's colours: `transmittance`, or 0 without a surface and where the ray is bent away from it.
    surface: [Vec<f32>; 3],
    /// Weight of the opaque surface's normal and shadow: green's transmittance, or 0 without a surface. A bent ray keeps this weight, because normal and
    /// shadow describe the surface straight ahead.
    straight: Vec<f32>,
    /// Weight of the background, by colour: `transmittance`, or 0 behind an opaque surface.
    through: [Vec<f32>; 3],
    /// Scratch: the values of one channel, or the alpha.
    values: Vec<f32>,
}

impl SampleRow {
    fn new(width: usize) -> Self {
        let row = || vec![0.0; width];
        Self {
            transmittance: std::array::from_fn(|_| row()),
            surface: std::array::from_fn(|_| row()),
            straight: row(),
            through: std::array::from_fn(|_| row()),
            values: row(),
        }
    }

    /// Computes the weights of the row whose first sample is `begin`.
    fn read(&mut self, input: &FinishInput<'_>, begin: usize) {
        let FinishInput { accumulator, opaque, glass, .. } = input;
        let planes = accumulator.optical_depth.len();
        let width = self.values.len();
        for c in 0..3 {
            let depths = &accumulator.optical_depth[if planes == 3 { c } else { 0 }][begin..begin + width];
            for (share, depth) in self.transmittance[c].iter_mut().zip(depths) {
                *share = exp_neg(*depth);
            }
            self.through[c].copy_from_slice(&self.transmittance[c]);
        }
        if !opaque.depth.is_empty() {
            for i in 0..width {
                let is_solid = opaque.depth[begin + i].is_finite();
                self.straight[i] = if is_solid { self.transmittance[1][i] } else { 0.0 };
                for c in 0..3 {
                    self.surface[c][i] = if is_solid { self.transmittance[c][i] } else { 0.0 };
                    self.through[c][i] = if is_solid { 0.0 } else { self.transmittance[c][i] };
                }
            }
        }
        let bent = glass.iter().flat_map(|glass| glass.behind[begin..begin + width].iter().enumerate());
        for (i, _) in bent.filter(|(_, behind)| !behind[0].is_nan()) {
            for c in 0..3 {
                self.surface[c][i] = 0.0;
            }
        }
    }

    /// Returns the values of a channel: the composited splats plus the weighted opaque surface behind them.
    fn channel(&mut self, input: &FinishInput<'_>, begin: usize, channel: usize) -> &[f32] {
        let FinishInput { accumulator, opaque, layout, .. } = input;
        let samples = begin..begin + self.values.len();
        self.values.copy_from_slice(&accumulator.channels[channel][samples.clone()]);
        if !opaque.depth.is_empty() {
            let plane = ChannelLayout::plane_of(channel, accumulator.channels.len(), 3);
            let shares = if channel < layout.colors() { &self.surface[plane] } else { &self.straight };
            let behind = &opaque.channels[channel][samples];
            for ((value, share), behind) in self.values.iter_mut().zip(shares).zip(behind) {
                // Even an infinite radiance adds nothing where its weight is 0.
                *value += if *share > 0.0 { share * behind } else { 0.0 };
            }
        }
        &self.values
    }
}

/// Adds `share` times each sample to its pixel. Every pixel has the same number of consecutive samples.
fn add<'a>(sums: impl ExactSizeIterator<Item = &'a mut f32>, samples: &[f32], share: f32) {
    let a_pixel = samples.len() / sums.len();
    for (sum, samples) in sums.zip(samples.chunks_exact(a_pixel)) {
        for value in samples {
            *sum += share * value;
        }
    }
}

impl Rows<'_> {
    /// Fills row `row` of this band, which is row `y` of the picture.
    fn fill(&mut self, input: &FinishInput<'_>, samples: &mut SampleRow, row: usize, y: usize) {
        let FinishInput { accumulator, layout, glass, antialias, .. } = *input;
        let antialias = antialias as usize;
        let sample_width = accumulator.size[0] as usize;
        let width = sample_width / antialias;
        let pixels = row * width..(row + 1) * width;
        let share = 1.0 / (antialias * antialias) as f32;
        for sample_row in y * antialias..(y + 1) * antialias {
            let begin = sample_row * sample_width;
            samples.read(input, begin);
            self.see_through(input, samples, pixels.clone(), sample_row, share);
            for ((_, at), plane) in layout.effects().zip(&mut self.effects) {
                for c in 0..3 {
                    let values = samples.channel(input, begin, at + c);
                    add(plane[pixels.clone()].iter_mut().map(|sum| &mut sum[c]), values, share);
                }
            }
            if let Some(at) = layout.normal() {
                for c in 0..3 {
                    let values = samples.channel(input, begin, at + c);
                    add(self.normal[pixels.clone()].iter_mut().map(|sum| &mut sum[c]), values, share);
                }
            }
            if let Some(at) = layout.shadow() {
                add(self.shadow[pixels.clone()].iter_mut(), samples.channel(input, begin, at), share);
            }
        }
        for k in pixels {
            let mut sum = self.background[k];
            let glass = glass.map(|_| [self.reflection[k], self.refraction[k]]);
            for part in self.effects.iter().map(|plane| plane[k]).chain(glass.into_iter().flatten()) {
                for c in 0..3 {
                    sum[c] += part[c];
                }
            }
            self.beauty[k] = sum;
            self.depth_and_object(input, k, k - row * width, y);
        }
    }

    /// Adds alpha, background, reflection and refraction of one row of samples.
    fn see_through(
        &mut self,
        input: &FinishInput<'_>,
        samples: &mut SampleRow,
        pixels: Range<usize>,
        sample_row: usize,
        share: f32,
    ) {
        let [red, green, blue] = &samples.through;
        for (i, value) in samples.values.iter_mut().enumerate() {
            *value = 1.0 - (red[i] + green[i] + blue[i]) / 3.0;
        }
        add(self.alpha[pixels.clone()].iter_mut(), &samples.values, share);
        let begin = sample_row * samples.values.len();
        for i in 0..samples.values.len() {
            let pixel = pixels.start + i / input.antialias as usize;
            let through: [f32; 3] = std::array::from_fn(|c| samples.through[c][i]);
            let bent = input.glass.and_then(|glass| glass.bent(begin + i));
            // Looking up an environment is slow, so skip it where the background is hidden.
            if through != [0.0; 3] && bent.is_none() {
                let behind = input.background.radiance(i as u32, sample_row as u32);
                for c in 0..3 {
                    self.background[pixel][c] += share * (through[c] * behind[c]);
                }
            }
            let Some(glass) = input.glass else { continue };
            for c in 0..3 {
                self.reflection[pixel][c] += share * glass.mirrored[begin + i][c];
                let behind = bent.map_or(0.0, |behind| samples.transmittance[c][i] * behind[c]);
                self.refraction[pixel][c] += share * behind;
            }
        }
    }

    /// Writes depths and object of pixel `k` of this band, which is pixel (x, y) of the picture.
    fn depth_and_object(&mut self, input: &FinishInput<'_>, k: usize, x: usize, y: usize) {
        let FinishInput { accumulator, opaque, antialias, .. } = input;
        let antialias = *antialias as usize;
        let sample_width = accumulator.size[0] as usize;
        let samples = (y * antialias..(y + 1) * antialias)
            .flat_map(|row| (0..antialias).map(move |column| row * sample_width + x * antialias + column));
        if let Some(object) = self.object.get_mut(k) {
            let nearest =
                |k: usize| [&accumulator.object, &opaque.object].into_iter().filter_map(move |ids| ids.get(k));
            *object = samples.clone().flat_map(nearest).copied().find(|id| *id != u32::MAX).unwrap_or(u32::MAX);
        }
        if self.depth[0].is_empty() || accumulator.depth.is_empty() {
            return;
        }
        let plane = accumulator.optical_depth.len() / 2;
        let mut sums = [0.0; 4];
        let mut defined = [0u32; 4];
        for sample in samples {
            let solid = opaque.depth.get(sample).copied().filter(|depth| depth.is_finite());
            let depths = accumulator.depth[sample].depths(accumulator.optical_depth[plane][sample], solid);
            self.depth[0][k] = self.depth[0][k].min(depths[0]);
            for d in 1..4 {
                if depths[d].is_finite() {
                    sums[d] += depths[d];
                    defined[d] += 1;
                }
            }
        }
        for d in 1..4 {
            if defined[d] > 0 {
                self.depth[d][k] = sums[d] / defined[d] as f32;
            }
        }
    }
}
