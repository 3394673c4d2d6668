//! The sums of an ensemble as a picture, with its error.
//!
//! The value of a pixel in one set is a random variable; its mean is the picture, and
//!
//! standard error = √((Σy²/L − (Σy/L)²)/(L − 1)), y the luminance, background included.
//!
//! Where extinction differs by channel, y = h + Σ wᵢ·bᵢ over the channels i that the set leaves open, h the luminance of its
//! hits, b the background and w the weights of luminance. So with nᵢ sets that leave i open and nᵢⱼ that leave both open
//!
//! Σy² = Σh² + 2·Σᵢ wᵢbᵢ·(Σ h of the sets that leave i open) + Σᵢ wᵢ²bᵢ²·nᵢ + 2·Σ_{i<j} wᵢbᵢ·wⱼbⱼ·nᵢⱼ.

use crate::EnsembleParams;
use crate::ensemble::{Ensemble, FRACTION, LUMINANCE};
use rayon::prelude::*;
use splat_core::raster::OpaqueImage;
use splat_core::{LayerData, Layers, SHADED_EFFECTS};

/// The four depths.
const DEPTHS: [&str; 4] = ["depth.first", "depth.median", "depth.mean", "depth.sigma"];

/// One pixel of the picture.
#[derive(Default)]
struct Pixel {
    beauty: [f32; 3],
    behind: [f32; 3],
    effects: [[f32; 3]; SHADED_EFFECTS.len()],
    alpha: [f32; 3],
    std_error: f32,
    normal: [f32; 3],
    shadow: f32,
    depth: [f32; 4],
    object: u32,
}

impl EnsembleParams {
    /// Bytes that [`Ensemble::read`] takes for one pixel, its layers included.
    pub fn bytes_to_read_pixel(&self) -> u64 {
        let count = |on: bool, numbers: usize| if on { numbers } else { 0 };
        let numbers = 8
            + count(self.effects, 3 * (1 + SHADED_EFFECTS.len()))
            + count(self.normal, 3)
            + count(self.shadow, 1)
            + count(self.depth_range.is_some(), 4)
            + count(self.object, 1);
        (size_of::<Pixel>() + 4 * numbers) as u64
    }
}

impl Ensemble {
    /// The picture so far, valid after any number of sets: `beauty`, `alpha` and `std_error` (of the luminance of beauty),
    /// and what else was kept: `background` and [`SHADED_EFFECTS`], `normal`, `shadow`, `depth.first`, `depth.median`,
    /// `depth.mean`, `depth.sigma` (of what is seen, the occluder included; of green where extinction
    /// differs by channel), `object` (the rank of the object of the nearest hit; `u32::MAX` without one), and `alpha_rgb`
    /// where extinction differs by channel, of which `alpha` is then the mean.
    ///
    /// `background` gives the radiance behind pixel (x, y); `occluder` must be the one that the sets were made with.
    pub fn read(&self, background: &(dyn Fn(u32, u32) -> [f32; 3] + Sync), occluder: Option<&OpaqueImage>) -> Layers {
        let mut layers = Layers { size: self.size(), ..Layers::default() };
        let [width, height] = self.tiling.size;
        let pixel = |k: usize| self.pixel(k % width, k / width, background, occluder);
        let pixels: Vec<Pixel> = (0..width * height).into_par_iter().with_min_len(1024).map(pixel).collect();
        let rgb = |f: &dyn Fn(&Pixel) -> [f32; 3]| LayerData::Rgb(pixels.iter().map(f).collect());
        let scalar = |f: &dyn Fn(&Pixel) -> f32| LayerData::Scalar(pixels.iter().map(f).collect());
        layers.insert("beauty", rgb(&|p| p.beauty));
        layers.insert("std_error", scalar(&|p| p.std_error));
        if self.params.colored_extinction {
            layers.insert("alpha", scalar(&|p| p.alpha.iter().sum::<f32>() / 3.0));
            layers.insert("alpha_rgb", rgb(&|p| p.alpha));
        } else {
            layers.insert("alpha", scalar(&|p| p.alpha[1]));
        }
        if self.params.effects {
            layers.insert("background", rgb(&|p| p.behind));
            for (name, e) in SHADED_EFFECTS.into_iter().zip(0..) {
                layers.insert(name, rgb(&|p| p.effects[e]));
            }
        }
        if self.params.normal {
            layers.insert("normal", rgb(&|p| p.normal));
        }
        if self.params.shadow {
            layers.insert("shadow", scalar(&|p| p.shadow));
        }
        if self.params.depth_range.is_some() {
            for (name, d) in DEPTHS.into_iter().zip(0..) {
                layers.insert(name, scalar(&|p| p.depth[d]));
            }
        }
        if self.params.object {
            layers.insert("object", LayerData::Id(pixels.iter().map(|p| p.object).collect()));
        }
        layers
    }

    fn pixel(
        &self,
        x: usize,
        y: usize,
        background: &dyn Fn(u32, u32) -> [f32; 3],
        occluder: Option<&OpaqueImage>,
    ) -> Pixel {
        let at = self.tiling.index(x, y);
        let levels = f64::from(self.levels.max(1));
        let hits: [f64; 3] = std::array::from_fn(|c| f64::from(self.hits_in(at, c)));
        let behind_it = y * self.tiling.size[0] + x;
        let solid = occluder.and_then(|o| self.solid(o, behind_it));
        let behind = solid.unwrap_or_else(|| background(x as u32, y as u32)).map(f64::from);
        let open = hits.map(|hits| (levels - hits) / levels);
        let mean = |c: usize| self.sum(at, c) / levels;
        let mut pixel = Pixel { std_error: self.error_at(at, behind) as f32, object: u32::MAX, ..Pixel::default() };
        let effects = self.params.light_channels() / 3;
        for c in 0..3 {
            pixel.behind[c] = (behind[c] * open[c]) as f32;
            (0..effects).for_each(|e| pixel.effects[e][c] = mean(3 * e + c) as f32);
            pixel.beauty[c] = ((0..effects).map(|e| mean(3 * e + c)).sum::<f64>() + behind[c] * open[c]) as f32;
            pixel.alpha[c] = if solid.is_some() { 1.0 } else { (hits[c] / levels) as f32 };
        }
        let seen = hits[1].max(1.0);
        if self.params.normal {
            let first = self.params.light_channels();
            pixel.normal = std::array::from_fn(|c| (self.sum(at, first + c) / seen) as f32);
        }
        pixel.shadow = 1.0;
        if self.params.shadow && hits[1] > 0.0 {
            pixel.shadow = (self.sum(at, self.params.channels() - 1) / seen) as f32;
        }
        if let (Some(range), Some(depths)) = (self.params.depth_range, self.depths.get(at)) {
            let wall = solid.and(occluder).map(|o| o.depth[behind_it]);
            pixel.depth = depths.depths(self.levels, self.hits_in(at, 1), range, wall);
        }
        if let Some(nearest) = self.objects.get(at) {
            pixel.object = nearest.object;
        }
        pixel
    }

    /// Radiance of the opaque surface at a pixel, rows from the top left, where there is one.
    fn solid(&self, image: &OpaqueImage, pixel: usize) -> Option<[f32; 3]> {
        let colors = image.channels.get(..self.params.light_channels())?;
        let sum = |c: usize| colors.iter().skip(c).step_by(3).map(|plane| plane[pixel]).sum::<f32>();
        (*image.depth.get(pixel)? < f32::INFINITY).then(|| [sum(0), sum(1), sum(2)])
    }

    /// Standard error of the luminance of one pixel in tile order; infinite below two sets.
    fn error_at(&self, at: usize, behind: [f64; 3]) -> f64 {
        if self.levels < 2 {
            return f64::INFINITY;
        }
        let levels = f64::from(self.levels);
        let open: [f64; 3] = std::array::from_fn(|c| levels - f64::from(self.hits_in(at, c)));
        let weights = LUMINANCE.map(f64::from);
        let back: [f64; 3] = std::array::from_fn(|c| weights[c] * behind[c]);
        let effects = self.params.light_channels() / 3;
        let hit_by = |c: usize| weights[c] * (0..effects).map(|e| self.sum(at, 3 * e + c)).sum::<f64>();
        let hit: f64 = (0..3).map(hit_by).sum();
        let (back_sum, back_squares) = match self.apart.get(at) {
            None => {
                let back = back.iter().sum::<f64>();
                (back * open[1], back * back * open[1])
            }
            Some(apart) => {
                let unit = f64::from(self.params.unit()) / f64::from(FRACTION);
                let of_channel = |c: usize| {
                    let next = (c + 1) % 3;
                    let both = levels - f64::from(apart.either[c]);
                    let pair = open[c] * back[c] + 2.0 * both * back[next];
                    back[c] * (2.0 * apart.beside[c] as f64 * unit + pair)
                };
                ((0..3).map(|c| back[c] * open[c]).sum(), (0..3).map(of_channel).sum())
            }
        };
        let mean = (hit + back_sum) / levels;
        let square = (self.square(at) + back_squares) / levels;
        ((square - mean * mean).max(0.0) / (levels - 1.0)).sqrt()
    }

    /// Root mean square of the standard error over all pixels, for a stop at a target error; infinite below two sets.
    pub fn rms_error(&self, background: &dyn Fn(u32, u32) -> [f32; 3], occluder: Option<&OpaqueImage>) -> f64 {
        let [w, h] = self.tiling.size;
        let mut sum = 0.0;
        for y in 0..h {
            for x in 0..w {
                let solid = occluder.and_then(|o| self.solid(o, y * w + x));
                let behind = solid.unwrap_or_else(|| background(x as u32, y as u32)).map(f64::from);
                sum += self.error_at(self.tiling.index(x, y), behind).powi(2);
            }
        }
        (sum / (w * h) as f64).sqrt()
    }
}
