//! STEP 3: the average over all sets so far (Tanaka 2012, section 2), in integers.
//!
//! Each set adds at most one hit a pixel: 1 to a u32, each channel to an i64 as a multiple of unit·2⁻²⁴, its square to a
//! u64. Integer sums depend on no order, so any number of threads, any split into batches and any resumed run gives the
//! same bits. The value of a pixel in one set is a random variable; its mean is the picture, and
//!
//! standard error = √((Σy²/L − (Σy/L)²)/(L − 1)), y the luminance with what lies behind.

use crate::bins::{AREA, Tiling};
use crate::error::check;
use crate::{Error, Occluder};
use splat_core::{LayerData, Layers};

/// Bits behind the point of a channel's sum.
pub(crate) const FRACTION: f32 = 16_777_216.0;

/// Where radiance is cut, in its unit.
pub(crate) const BRIGHTEST: f32 = 65536.0;

/// Steps of a depth between the two ends of the range.
const DEPTH_STEPS: f32 = 1_048_576.0;

/// Weights of luminance, Rec.709.
pub(crate) const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// What a pixel keeps beside hits and beauty.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnsembleParams {
    /// Ambient, emission and direct light apart.
    pub effects: bool,
    /// Normal of what is seen.
    pub normal: bool,
    /// Transmittance of the shadows at what is seen.
    pub shadow: bool,
    /// Nearest and farthest view depth, for the distribution of depths; depths outside count as the ends. `None`: no
    /// depths are kept.
    pub depth_range: Option<[f32; 2]>,
    /// A power of two times which radiances are near 1; 0 stands for 1. Radiance is summed in steps of 2⁻²⁴ of it, and
    /// cut at 2¹⁶ times it.
    pub radiance_unit: f32,
}

impl EnsembleParams {
    /// Numbers a hit brings: 3 or 9 for light, 3 for a normal, 1 for shadow.
    pub fn channels(&self) -> usize {
        self.light_channels() + 3 * usize::from(self.normal) + usize::from(self.shadow)
    }

    pub(crate) fn light_channels(&self) -> usize {
        if self.effects { 9 } else { 3 }
    }

    /// Whether a hit brings nothing but its radiance.
    pub(crate) fn only_beauty(&self) -> bool {
        self.channels() == 3 && self.depth_range.is_none()
    }

    pub(crate) fn unit(&self) -> f32 {
        if self.radiance_unit == 0.0 { 1.0 } else { self.radiance_unit }
    }

    /// Checks ranges.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a depth range or a unit out of range.
    pub fn validate(&self) -> Result<(), Error> {
        if let Some([near, far]) = self.depth_range {
            let ok = near.is_finite() && far.is_finite() && near < far;
            check(ok, "depth_range", [near, far], "two finite numbers, the first less")?;
        }
        let u = self.unit();
        let power = u.is_normal() && u > 0.0 && u.to_bits() & 0x7f_ffff == 0;
        check(power, "radiance_unit", u, "a power of two")
    }
}

/// Sums over sets, by tile.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    pub(crate) params: EnsembleParams,
    pub(crate) tiling: Tiling,
    pub(crate) levels: u32,
    pub(crate) hits: Vec<u32>,
    pub(crate) sums: Vec<i64>,
    /// Σ luminance².
    pub(crate) squares: Vec<u64>,
    /// Nearest depth as bits, Σ steps, Σ steps²; empty when no depths are kept.
    pub(crate) depths: Vec<DepthSum>,
}

/// Distribution of the depths of one pixel's hits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DepthSum {
    /// Bits of a positive f32, which sort as numbers.
    pub(crate) nearest: u32,
    pub(crate) sum: u64,
    pub(crate) square: u64,
}

impl DepthSum {
    const NONE: Self = Self { nearest: f32::INFINITY.to_bits(), sum: 0, square: 0 };
}

/// Sums of one tile, to be added to.
pub(crate) struct TileSums<'a> {
    pub(crate) hits: &'a mut [u32],
    pub(crate) sums: &'a mut [i64],
    pub(crate) squares: &'a mut [u64],
    pub(crate) depths: &'a mut [DepthSum],
    pub(crate) inverse_unit: f32,
}

impl TileSums<'_> {
    /// One hit of pixel `k` of the tile.
    #[inline(always)]
    pub(crate) fn add(&mut self, params: &EnsembleParams, k: usize, values: &[f32], depth: f32) {
        self.hits[k] = self.hits[k].saturating_add(1);
        let (light, other) = values.split_at(params.light_channels());
        let (light_sums, other_sums) = self.sums[k * values.len()..].split_at_mut(light.len());
        let mut luminance = 0.0;
        for (sums, color) in light_sums.chunks_exact_mut(3).zip(light.chunks_exact(3)) {
            for c in 0..3 {
                let v = (color[c] * self.inverse_unit).clamp(-BRIGHTEST, BRIGHTEST);
                luminance += v * LUMINANCE[c];
                raise(&mut sums[c], fixed(v));
            }
        }
        other_sums.iter_mut().zip(other).for_each(|(sum, v)| raise(sum, fixed(*v)));
        let square = &mut self.squares[k];
        *square = square.saturating_add(fixed_square(luminance * luminance * FRACTION));
        if let ([_, ..], Some([near, far])) = (&*self.depths, params.depth_range) {
            let d = &mut self.depths[k];
            let steps = ((depth - near) / (far - near) * DEPTH_STEPS + 0.5).clamp(0.0, DEPTH_STEPS) as u64;
            d.nearest = d.nearest.min(depth.to_bits());
            d.sum = d.sum.saturating_add(steps);
            d.square = d.square.saturating_add(steps * steps);
        }
    }
}

/// Adds, and stays at the ends of the range.
#[inline(always)]
pub(crate) fn raise(sum: &mut i64, by: i64) {
    // A branch that is never taken: selections are slower, above all when they are put into lanes.
    *sum = match sum.checked_add(by) {
        Some(sum) => sum,
        None => sum.saturating_add(by),
    };
}

/// A square as a multiple of 2⁻²⁴, from what it is times 2²⁴; a value that is not a number counts as 0.
#[inline(always)]
pub(crate) fn fixed_square(scaled: f32) -> u64 {
    // Below 2⁶³, where the signed conversion is the cheaper one.
    scaled as i64 as u64
}

/// Nearest multiple of 2⁻²⁴, for |v| < 2²⁷; a value that is not a number counts as 0.
#[inline(always)]
pub(crate) fn fixed(v: f32) -> i64 {
    // Where the last bit of the sum is 1, the sum's bits count. Cheaper than a conversion that minds every input.
    const ONES: f64 = 6_755_399_441_055_744.0;
    let v = if v.is_nan() { 0.0 } else { v };
    (f64::from(v) * f64::from(FRACTION) + ONES).to_bits() as i64 - ONES.to_bits() as i64
}

impl Ensemble {
    /// Nothing seen yet.
    ///
    /// # Errors
    /// [`Error::Parameter`] for parameters out of range or an image of no pixels or more than 65536 a side.
    pub fn new(size: [u32; 2], params: &EnsembleParams) -> Result<Self, Error> {
        params.validate()?;
        check(size.iter().all(|s| (1..=65536).contains(s)), "size", size, "1 to 65536 pixels a side")?;
        let tiling = Tiling::new(size);
        let n = tiling.tiles() * AREA;
        Ok(Self {
            params: *params,
            tiling,
            levels: 0,
            hits: vec![0; n],
            sums: vec![0; n * params.channels()],
            squares: vec![0; n],
            depths: if params.depth_range.is_some() { vec![DepthSum::NONE; n] } else { Vec::new() },
        })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.tiling.size.map(|s| s as u32)
    }

    /// Sets so far, the repeat level L_R; the next set has this number.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// What a pixel keeps.
    pub fn params(&self) -> &EnsembleParams {
        &self.params
    }

    /// Sets in which pixel (x, y) was hit; 0 out of the image.
    pub fn hits(&self, x: u32, y: u32) -> u32 {
        let inside = (x as usize) < self.tiling.size[0] && (y as usize) < self.tiling.size[1];
        if inside { self.hits[self.tiling.index(x as usize, y as usize)] } else { 0 }
    }

    /// Bytes of the sums: 36 a pixel for beauty, 8 more a further channel, 24 with depths.
    pub fn bytes(&self) -> u64 {
        let of = |n: usize, size: usize| (n * size) as u64;
        of(self.hits.len(), 4) + of(self.sums.len(), 8) + of(self.squares.len(), 8) + of(self.depths.len(), 24)
    }

    /// Adds the sums of other sets of the same scene.
    ///
    /// # Errors
    /// [`Error::Parameter`] when size or kept channels differ, or the levels sum to more than 2³² − 1.
    pub fn merge(&mut self, other: &Self) -> Result<(), Error> {
        let same = self.tiling == other.tiling && self.params == other.params;
        check(same, "ensemble", other.size(), "an ensemble of the same size and channels")?;
        let levels = self.levels.checked_add(other.levels);
        self.levels = levels.ok_or_else(|| Error::parameter("levels", other.levels, "at most 2³² − 1 in all"))?;
        self.hits.iter_mut().zip(&other.hits).for_each(|(a, b)| *a = a.saturating_add(*b));
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a = a.saturating_add(*b));
        self.squares.iter_mut().zip(&other.squares).for_each(|(a, b)| *a = a.saturating_add(*b));
        for (a, b) in self.depths.iter_mut().zip(&other.depths) {
            a.nearest = a.nearest.min(b.nearest);
            a.sum = a.sum.saturating_add(b.sum);
            a.square = a.square.saturating_add(b.square);
        }
        Ok(())
    }

    /// Sum of one channel of a pixel in tile order, in its unit.
    pub(crate) fn sum(&self, at: usize, channel: usize) -> f64 {
        let unit = if channel < self.params.light_channels() { self.params.unit() } else { 1.0 };
        self.sums[at * self.params.channels() + channel] as f64 / f64::from(FRACTION) * f64::from(unit)
    }

    /// Sum of luminance² of a pixel in tile order.
    pub(crate) fn square(&self, at: usize) -> f64 {
        self.squares[at] as f64 / f64::from(FRACTION) * f64::from(self.params.unit()).powi(2)
    }

    /// Mean and deviation of the depths of a pixel in tile order.
    fn depth_moments(&self, at: usize, [near, far]: [f32; 2]) -> [f64; 2] {
        let (n, d) = (f64::from(self.hits[at]), &self.depths[at]);
        let step = f64::from(far - near) / f64::from(DEPTH_STEPS);
        let mean = d.sum as f64 / n;
        [f64::from(near) + mean * step, (d.square as f64 / n - mean * mean).max(0.0).sqrt() * step]
    }

    /// The picture so far, valid after any number of sets: `beauty`, `alpha` and `std_error` (of the luminance of beauty),
    /// and what else was kept: `background`, `ambient`, `emission`, `direct`, `normal`, `shadow`, `depth.first` (the
    /// nearest hit), `depth.mean`, `depth.sigma`.
    ///
    /// `background` gives the radiance behind pixel (x, y); `occluder` must be the one that the sets were made with.
    pub fn read(&self, background: &dyn Fn(u32, u32) -> [f32; 3], occluder: Option<&Occluder>) -> Layers {
        let mut layers = Layers { size: self.size(), ..Layers::default() };
        let pixels: Vec<Pixel> = (0..self.tiling.size[1])
            .flat_map(|y| (0..self.tiling.size[0]).map(move |x| (x, y)))
            .map(|(x, y)| self.pixel(x, y, background, occluder))
            .collect();
        let rgb = |f: &dyn Fn(&Pixel) -> [f32; 3]| LayerData::Rgb(pixels.iter().map(f).collect());
        let scalar = |f: &dyn Fn(&Pixel) -> f32| LayerData::Scalar(pixels.iter().map(f).collect());
        layers.insert("beauty", rgb(&|p| p.beauty));
        layers.insert("alpha", scalar(&|p| p.alpha));
        layers.insert("std_error", scalar(&|p| p.std_error));
        if self.params.effects {
            layers.insert("background", rgb(&|p| p.behind));
            for (name, e) in ["ambient", "emission", "direct"].into_iter().zip(0..) {
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
            for (name, d) in ["depth.first", "depth.mean", "depth.sigma"].into_iter().zip(0..) {
                layers.insert(name, scalar(&|p| p.depth[d]));
            }
        }
        layers
    }

    fn pixel(
        &self,
        x: usize,
        y: usize,
        background: &dyn Fn(u32, u32) -> [f32; 3],
        occluder: Option<&Occluder>,
    ) -> Pixel {
        let at = self.tiling.index(x, y);
        let levels = f64::from(self.levels.max(1));
        let hits = f64::from(self.hits[at]);
        let solid = occluder.and_then(|o| o.at(y * self.tiling.size[0] + x));
        let behind = solid.unwrap_or_else(|| background(x as u32, y as u32)).map(f64::from);
        let open = (levels - hits) / levels;
        let mean = |c: usize| self.sum(at, c) / levels;
        let mut pixel = Pixel { behind: behind.map(|b| (b * open) as f32), ..Pixel::default() };
        let effects = self.params.light_channels() / 3;
        for c in 0..3 {
            (0..effects).for_each(|e| pixel.effects[e][c] = mean(3 * e + c) as f32);
            pixel.beauty[c] = ((0..effects).map(|e| mean(3 * e + c)).sum::<f64>() + behind[c] * open) as f32;
        }
        pixel.alpha = if solid.is_some() { 1.0 } else { (hits / levels) as f32 };
        pixel.std_error = self.std_error(at, behind) as f32;
        let seen = hits.max(1.0);
        if self.params.normal {
            let first = self.params.light_channels();
            pixel.normal = std::array::from_fn(|c| (self.sum(at, first + c) / seen) as f32);
        }
        pixel.shadow = 1.0;
        if self.params.shadow && hits > 0.0 {
            pixel.shadow = (self.sum(at, self.params.channels() - 1) / seen) as f32;
        }
        pixel.depth = [f32::INFINITY; 3];
        if let (Some(range), true) = (self.params.depth_range, hits > 0.0) {
            let [mean, sigma] = self.depth_moments(at, range);
            pixel.depth = [f32::from_bits(self.depths[at].nearest), mean as f32, sigma as f32];
        }
        pixel
    }

    /// Standard error of the luminance of one pixel in tile order; infinite below two sets.
    fn std_error(&self, at: usize, behind: [f64; 3]) -> f64 {
        if self.levels < 2 {
            return f64::INFINITY;
        }
        let levels = f64::from(self.levels);
        let open = levels - f64::from(self.hits[at]);
        let luminance = |f: &dyn Fn(usize) -> f64| (0..3).map(|c| f64::from(LUMINANCE[c]) * f(c)).sum::<f64>();
        let back = luminance(&|c| behind[c]);
        let effects = self.params.light_channels() / 3;
        let hit = luminance(&|c| (0..effects).map(|e| self.sum(at, 3 * e + c)).sum());
        let mean = (hit + back * open) / levels;
        let square = (self.square(at) + back * back * open) / levels;
        ((square - mean * mean).max(0.0) / (levels - 1.0)).sqrt()
    }

    /// Root mean square of the standard error over all pixels, for a stop at a wanted error; infinite below two sets.
    pub fn rms_error(&self, background: &dyn Fn(u32, u32) -> [f32; 3], occluder: Option<&Occluder>) -> f64 {
        let [w, h] = self.tiling.size;
        let mut sum = 0.0;
        for y in 0..h {
            for x in 0..w {
                let solid = occluder.and_then(|o| o.at(y * w + x));
                let behind = solid.unwrap_or_else(|| background(x as u32, y as u32)).map(f64::from);
                sum += self.std_error(self.tiling.index(x, y), behind).powi(2);
            }
        }
        (sum / (w * h) as f64).sqrt()
    }
}

/// One pixel of the picture.
#[derive(Default)]
struct Pixel {
    beauty: [f32; 3],
    behind: [f32; 3],
    effects: [[f32; 3]; 3],
    alpha: f32,
    std_error: f32,
    normal: [f32; 3],
    shadow: f32,
    depth: [f32; 3],
}
