//! STEP 3: the average over all sets so far (Tanaka 2012, section 2), in integers.
//!
//! Each set adds at most one hit a pixel: 1 to a u32, each channel to an i64 as a multiple of unit·2⁻²⁴, its square to a
//! u64. Integer sums depend on no order, so any number of threads, any split into batches and any resumed run gives the
//! same bits. The distribution of depths ([`crate::ensemble::depths`]) does depend on the order of the sets, and gets them in order.
//!
//! Where extinction differs by channel, a set has at most one hit a pixel and channel, and hits are counted by channel.

pub(crate) mod checkpoint;
pub(crate) mod depths;
pub(crate) mod picture;
pub(crate) mod segment;
use crate::Error;
use crate::ensemble::depths::DepthSum;
use crate::error::check;
use crate::project::tiles::{AREA, TILE, Tiling};
use splat_core::LayerSet;
use splat_core::shade::ChannelLayout;

/// Bits behind the point of a channel's sum.
pub(crate) const FRACTION: f32 = 16_777_216.0;

/// Where radiance is cut, in its unit.
pub(crate) const BRIGHTEST: f32 = 65536.0;

/// Weights of luminance, Rec.709.
pub(crate) const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// The layers that a pixel keeps beside hits and beauty.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnsembleParams {
    /// Each of [`splat_core::SHADED_EFFECTS`] apart.
    pub effects: bool,
    /// Normal of what is seen.
    pub normal: bool,
    /// Transmittance of the shadows at what is seen.
    pub shadow: bool,
    /// Nearest and farthest view depth, for the distribution of depths; mean and deviation count depths outside as the
    /// ends. `None`: no depths are kept.
    pub depth_range: Option<[f32; 2]>,
    /// The object of the nearest hit.
    pub object: bool,
    /// Whether red, green and blue are hidden apart, by [`splat_core::Material::extinction_rgb`] of each object, to whose
    /// largest channel its particles belong. Else a particle hides all alike.
    pub colored_extinction: bool,
    /// A power of two times which radiances are near 1; 0 stands for 1. Radiance is summed in steps of 2⁻²⁴ of it, and
    /// cut at 2¹⁶ times it.
    pub radiance_unit: f32,
}

impl EnsembleParams {
    /// The parameters that these layers require; `depth_range` is looked at where depths are among them.
    pub fn of_layers(layers: &LayerSet, colored_extinction: bool, depth_range: [f32; 2]) -> Self {
        Self {
            effects: layers.effects,
            normal: layers.normal,
            shadow: layers.shadow,
            depth_range: layers.depth.then_some(depth_range),
            object: layers.object,
            colored_extinction,
            radiance_unit: 0.0,
        }
    }

    /// Numbers a hit brings: 3 for light or for each effect, 3 for a normal, 1 for shadow.
    #[inline]
    pub fn channels(&self) -> usize {
        self.layout().count()
    }

    #[inline]
    pub(crate) fn light_channels(&self) -> usize {
        self.layout().colors()
    }

    /// Which of these numbers is where.
    #[inline]
    pub(crate) fn layout(&self) -> ChannelLayout {
        let Self { effects, normal, shadow, .. } = *self;
        ChannelLayout::new(&LayerSet { effects, normal, shadow, ..LayerSet::default() })
    }

    /// Whether a hit brings nothing but its radiance.
    pub(crate) fn only_beauty(&self) -> bool {
        self.channels() == 3 && self.depth_range.is_none() && !self.object && !self.colored_extinction
    }

    /// Whether a hit brings nothing but numbers that are added up: no depth and no object, and it hides all channels alike.
    #[cfg(feature = "gpu")]
    pub(crate) fn only_numbers(&self) -> bool {
        self.depth_range.is_none() && !self.object && !self.colored_extinction
    }

    /// Hits that a set can have in one pixel.
    pub(crate) fn hit_channels(&self) -> usize {
        if self.colored_extinction { 3 } else { 1 }
    }

    /// Bytes of the sums of an image of whole tiles. A pixel has 36 for beauty, 8 more for each further channel, 184 for
    /// depths, 8 for objects, and 48 more if extinction differs by channel.
    pub fn bytes(&self, size: [u64; 2]) -> u64 {
        let side = |s: u64| s.next_multiple_of(TILE as u64);
        side(size[0]).saturating_mul(side(size[1])).saturating_mul(self.bytes_per_pixel())
    }

    fn bytes_per_pixel(&self) -> u64 {
        let planes = |on: bool, size: usize| if on { size } else { 0 };
        let bytes = 4 * self.hit_channels()
            + 8 * (self.channels() + 1)
            + planes(self.depth_range.is_some(), size_of::<DepthSum>())
            + planes(self.object, size_of::<NearestObject>())
            + planes(self.colored_extinction, size_of::<Apart>());
        bytes as u64
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
    /// One a pixel, or three.
    pub(crate) hits: Vec<u32>,
    pub(crate) sums: Vec<i64>,
    /// Σ luminance².
    pub(crate) squares: Vec<u64>,
    /// Empty when no depths are kept.
    pub(crate) depths: Vec<DepthSum>,
    /// Empty when no objects are kept.
    pub(crate) objects: Vec<NearestObject>,
    /// Empty when a particle hides all channels.
    pub(crate) apart: Vec<Apart>,
}

/// The nearest hit of all sets, and whose it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NearestObject {
    pub(crate) depth: f32,
    pub(crate) object: u32,
}

impl NearestObject {
    const NONE: Self = Self { depth: f32::INFINITY, object: u32::MAX };

    /// The nearer of two; at equal depths the object that comes first.
    pub(crate) fn meet(&mut self, other: Self) {
        if other.depth < self.depth || (other.depth == self.depth && other.object < self.object) {
            *self = other;
        }
    }
}

/// Sums for the error of the luminance, if a set may hit a pixel in some channels alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Apart {
    /// Σ luminance of the hits of the sets that leave a channel open.
    pub(crate) beside: [i64; 3],
    /// Sets that hit at least one of red and green, green and blue, blue and red.
    pub(crate) either: [u32; 3],
}

/// Sums of one tile, to be added to.
#[derive(Default)]
pub(crate) struct TileSums<'a> {
    pub(crate) hits: &'a mut [u32],
    pub(crate) sums: &'a mut [i64],
    pub(crate) squares: &'a mut [u64],
    depths: &'a mut [DepthSum],
    objects: &'a mut [NearestObject],
    apart: &'a mut [Apart],
    pub(crate) inverse_unit: f32,
}

impl TileSums<'_> {
    /// One hit of pixel `k` of the tile in all channels.
    #[inline(always)]
    pub(crate) fn add(&mut self, params: &EnsembleParams, k: usize, values: &[f32]) {
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
    }

    /// The depth of that hit of set `set`, where depths are kept.
    #[inline(always)]
    pub(crate) fn locate(&mut self, params: &EnsembleParams, k: usize, set: u64, depth: f32) {
        if let (Some(sum), Some(range)) = (self.depths.get_mut(k), params.depth_range) {
            sum.add(set, depth, range);
        }
    }

    /// Whose that hit is, where objects are kept.
    #[inline(always)]
    pub(crate) fn name(&mut self, k: usize, depth: f32, object: u32) {
        if let Some(nearest) = self.objects.get_mut(k) {
            nearest.meet(NearestObject { depth, object });
        }
    }

    /// A hit of pixel `k` in some channels (bit c for channel c); returns their luminance. Normal and shadow are no
    /// colours: both go by green.
    pub(crate) fn add_channels(&mut self, params: &EnsembleParams, k: usize, values: &[f32], mask: u32) -> f32 {
        let mut luminance = 0.0;
        let light = params.light_channels();
        for (at, value) in values.iter().enumerate() {
            let channel = if at < light { at % 3 } else { 1 };
            if mask >> channel & 1 == 0 {
                continue;
            }
            let mut v = *value;
            if at < light {
                v = (v * self.inverse_unit).clamp(-BRIGHTEST, BRIGHTEST);
                luminance += v * LUMINANCE[channel];
            }
            raise(&mut self.sums[k * values.len() + at], fixed(v));
        }
        luminance
    }

    /// Adds a set that hit pixel `k` in the channels of `mask`, with the luminance of its hits.
    pub(crate) fn add_set(&mut self, k: usize, mask: u32, luminance: f32) {
        let apart = &mut self.apart[k];
        for c in 0..3 {
            let hit = mask >> c & 1;
            self.hits[3 * k + c] = self.hits[3 * k + c].saturating_add(hit);
            if hit == 0 {
                raise(&mut apart.beside[c], fixed(luminance));
            }
            let either = hit | mask >> ((c + 1) % 3) & 1;
            apart.either[c] = apart.either[c].saturating_add(either);
        }
        let square = &mut self.squares[k];
        *square = square.saturating_add(fixed_square(luminance * luminance * FRACTION));
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

/// A square as a multiple of 2⁻²⁴, from what it is times 2²⁴, below 2⁵⁷; a value that is not a number counts as 0.
#[inline(always)]
pub(crate) fn fixed_square(scaled: f32) -> u64 {
    // The mantissa, shifted by the exponent: a conversion that minds every input is not done in lanes.
    let bits = scaled.max(0.0).to_bits();
    let mantissa = u64::from(bits & 0x7f_ffff | 0x80_0000) << 39;
    mantissa >> (127 + 23 + 39 - (bits >> 23)).min(63)
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
        let pixels = |on: bool| if on { n } else { 0 };
        Ok(Self {
            params: *params,
            tiling,
            levels: 0,
            hits: vec![0; n * params.hit_channels()],
            sums: vec![0; n * params.channels()],
            squares: vec![0; n],
            depths: vec![DepthSum::NONE; pixels(params.depth_range.is_some())],
            objects: vec![NearestObject::NONE; pixels(params.object)],
            apart: vec![Apart::default(); pixels(params.colored_extinction)],
        })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.tiling.size.map(|s| s as u32)
    }

    /// Sets to fold until the next look at the picture, of `most` altogether; `None` when there are as many. More at a time the more
    /// there are, but where the error decides when there are enough: then looks depend on nothing else.
    pub fn next_step(&self, most: u32, error_decides: bool) -> Option<u32> {
        /// Sets of a step, at least.
        const BATCH: u32 = 8;
        /// Sets so far over those of a step.
        const GROWTH: u32 = 16;
        let left = most.checked_sub(self.levels).filter(|left| *left > 0)?;
        let grown = if error_decides { 0 } else { self.levels / GROWTH };
        Some((BATCH + grown).min(left))
    }

    /// Sets so far, the repeat level L_R; the next set has this number.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// The layers that a pixel keeps.
    pub fn params(&self) -> &EnsembleParams {
        &self.params
    }

    /// Sets in which pixel (x, y) was hit; 0 out of the image. Where extinction differs by channel, in green.
    pub fn hits(&self, x: u32, y: u32) -> u32 {
        let inside = (x as usize) < self.tiling.size[0] && (y as usize) < self.tiling.size[1];
        if inside { self.hits_in(self.tiling.index(x as usize, y as usize), 1) } else { 0 }
    }

    /// Sets in which a pixel in tile order was hit in a channel.
    pub(crate) fn hits_in(&self, at: usize, channel: usize) -> u32 {
        if self.params.colored_extinction { self.hits[3 * at + channel] } else { self.hits[at] }
    }

    /// Bytes of the sums, see [`EnsembleParams::bytes`].
    pub fn bytes(&self) -> u64 {
        self.params.bytes(self.tiling.size.map(|s| s as u64))
    }

    /// The sums by tile.
    pub(crate) fn tiles(&mut self) -> Vec<TileSums<'_>> {
        let hits = AREA * self.params.hit_channels();
        let sums = AREA * self.params.channels();
        let inverse_unit = 1.0 / self.params.unit();
        let mut depths = self.depths.chunks_mut(AREA);
        let mut objects = self.objects.chunks_mut(AREA);
        let mut apart = self.apart.chunks_mut(AREA);
        let planes = self.hits.chunks_mut(hits).zip(self.sums.chunks_mut(sums)).zip(self.squares.chunks_mut(AREA));
        let tile = |((hits, sums), squares)| TileSums {
            hits,
            sums,
            squares,
            depths: depths.next().unwrap_or_default(),
            objects: objects.next().unwrap_or_default(),
            apart: apart.next().unwrap_or_default(),
            inverse_unit,
        };
        planes.map(tile).collect()
    }

    /// Adds the sums of other sets of the same scene.
    ///
    /// # Errors
    /// [`Error::Parameter`] when size or kept channels differ, when depths are kept (they depend on the order of the sets),
    /// or the levels sum to more than 2³² − 1.
    pub fn merge(&mut self, other: &Self) -> Result<(), Error> {
        let same = self.tiling == other.tiling && self.params == other.params;
        check(same, "ensemble", other.size(), "an ensemble of the same size and channels")?;
        check(self.depths.is_empty(), "ensemble", self.params, "an ensemble without depths")?;
        let levels = self.levels.checked_add(other.levels);
        self.levels = levels.ok_or_else(|| Error::parameter("levels", other.levels, "at most 2³² − 1 in all"))?;
        self.hits.iter_mut().zip(&other.hits).for_each(|(a, b)| *a = a.saturating_add(*b));
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a = a.saturating_add(*b));
        self.squares.iter_mut().zip(&other.squares).for_each(|(a, b)| *a = a.saturating_add(*b));
        self.objects.iter_mut().zip(&other.objects).for_each(|(a, b)| a.meet(*b));
        for (a, b) in self.apart.iter_mut().zip(&other.apart) {
            (0..3).for_each(|c| a.beside[c] = a.beside[c].saturating_add(b.beside[c]));
            (0..3).for_each(|c| a.either[c] = a.either[c].saturating_add(b.either[c]));
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_cut_to_whole_numbers() {
        let largest = 65536f32 * 65536.0 * FRACTION;
        for v in
            [0.0, -0.0, 1e-45, 0.999_999_94, 1.0, 1.999_999_9, 2.0, 16_777_215.0, 3e9, largest, largest * 1.000_001]
        {
            assert_eq!(fixed_square(v), v as u64, "{v}");
        }
        assert_eq!(fixed_square(f32::NAN), 0);
    }
}
