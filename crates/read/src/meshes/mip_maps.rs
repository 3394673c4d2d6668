//! Mip maps: an image in its own size and in halves of it down to one texel, each texel the mean of those that it covers.
//!
//! Means are taken of light, not of sRGB numbers, and stored as sRGB of eight bits again: an even image stays as it is in every size.

use super::rgba::{LINEAR, Rgba};
use rayon::prelude::*;
use splat_core::srgb::encoded;
use std::sync::{Arc, LazyLock};

/// The sRGB number of light, by its 4096th parts. The curve rises by at most 12.92 · 255 / 4096 = 0.8 numbers a part, so [`stored`] finds the
/// nearest number next to it.
static ENCODED: LazyLock<[u8; 4097]> =
    LazyLock::new(|| std::array::from_fn(|i| libm::round(255.0 * encoded(i as f64 / 4096.0)) as u8));

/// An image in one size.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Level {
    columns: u32,
    rows: u32,
    /// Empty for an image that is not decoded.
    rgba: Rgba,
}

/// The share by which the colour of a texel counts in means. Colours of clear texels are not seen: they would draw fringes around what is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Weight {
    /// All texels count alike.
    Even,
    /// By their opacity.
    Opacity,
    /// Those of this opacity and more count, others do not.
    Cut(f32),
}

impl Weight {
    fn at(self, opacity: f32) -> f32 {
        match self {
            Self::Even => 1.0,
            Self::Opacity => opacity,
            Self::Cut(cutoff) => f32::from(u8::from(opacity >= cutoff)),
        }
    }

    /// The mean of texels, each with its share of 1: its opacity is that of the shares, its colour that of the weights.
    fn mean(self, texels: impl Iterator<Item = (f32, [f32; 4])> + Clone) -> [f32; 4] {
        let mut plain = [0.0f32; 4];
        let mut weighted = [0.0f32; 4];
        let mut weights = texels.clone().map(|(_, texel)| self.at(texel[3]));
        let first = weights.next().unwrap_or(1.0);
        // Where all count alike, no rounding of weights changes an even colour.
        let is_even = weights.all(|weight| weight == first);
        for (share, texel) in texels {
            (0..4).for_each(|c| plain[c] += share * texel[c]);
            let weight = share * self.at(texel[3]);
            (0..3).for_each(|c| weighted[c] += weight * texel[c]);
            weighted[3] += weight;
        }
        if is_even || weighted[3] <= 0.0 {
            return plain;
        }
        let [r, g, b] = [0, 1, 2].map(|c| weighted[c] / weighted[3]);
        [r, g, b, plain[3]]
    }

    /// The weight in smaller sizes of an image. Opacities of [`Self::Cut`] are there the share of texels that count.
    fn of_smaller(self) -> Self {
        match self {
            Self::Even => Self::Even,
            Self::Opacity | Self::Cut(_) => Self::Opacity,
        }
    }
}

/// An image in its sizes, the largest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MipMaps {
    weight: Weight,
    levels: Vec<Arc<Level>>,
}

impl Level {
    /// An image of `columns` times `rows` texels.
    pub(crate) fn new(columns: u32, rows: u32, rgba: Rgba) -> Self {
        Self { columns, rows, rgba }
    }

    /// An image of which only the size is known; it is white.
    pub(crate) fn undecoded(columns: u32, rows: u32) -> Self {
        Self { columns, rows, rgba: Rgba::Srgb(Vec::new()) }
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// Bytes of its texels.
    pub(crate) fn bytes(&self) -> u64 {
        self.rgba.bytes()
    }

    /// Hands its texels to `take`.
    pub(crate) fn digest(&self, take: &mut dyn FnMut(&[u8])) {
        match &self.rgba {
            Rgba::Srgb(texels) => take(bytemuck::cast_slice(texels)),
            Rgba::Linear(texels) => take(bytemuck::cast_slice(texels)),
        }
    }

    /// Whether a texel is not opaque.
    pub(crate) fn has_alpha(&self) -> bool {
        match &self.rgba {
            Rgba::Srgb(texels) => texels.par_iter().with_min_len(1 << 16).any(|texel| texel[3] < 255),
            Rgba::Linear(texels) => texels.par_iter().with_min_len(1 << 16).any(|texel| texel[3] < 1.0),
        }
    }

    /// Linear colour and opacity of a texel.
    pub(crate) fn linear(&self, column: u32, row: u32) -> [f32; 4] {
        self.rgba.linear(row as usize * self.columns as usize + column as usize)
    }

    /// The image of half the columns and rows.
    fn half(&self, weight: Weight) -> Self {
        let across = spans(self.columns);
        let down = spans(self.rows);
        let columns = across.len() as u32;
        let rows = down.len() as u32;
        let texel = |span_across: &Span, span_down: &Span| {
            let covered = span_down.texels().flat_map(|(row, height)| {
                span_across.texels().map(move |(column, width)| (width * height, self.linear(column, row)))
            });
            let mut mean = weight.mean(covered.clone());
            if let Weight::Cut(_) = weight {
                mean[3] = covered.map(|(share, texel)| share * weight.at(texel[3])).sum();
            }
            mean[3] = mean[3].clamp(0.0, 1.0);
            mean
        };
        let bytes = |[r, g, b, alpha]: [f32; 4]| {
            let [r, g, b] = [r, g, b].map(stored);
            [r, g, b, libm::roundf(255.0 * alpha) as u8]
        };
        let linear = down.par_iter().flat_map_iter(|span_down| across.iter().map(move |a| texel(a, span_down)));
        let rgba = match &self.rgba {
            Rgba::Srgb(_) => Rgba::Srgb(linear.map(bytes).collect()),
            Rgba::Linear(_) => Rgba::Linear(linear.collect()),
        };
        Self { columns, rows, rgba }
    }
}

/// Texels of the larger size that one of the smaller covers along one axis: two, or three of which the outer ones count in part.
struct Span {
    first: u32,
    shares: [f32; 3],
}

impl Span {
    fn texels(&self) -> impl Iterator<Item = (u32, f32)> + Clone + '_ {
        let shares = self.shares.iter().enumerate().filter(|(_, share)| **share > 0.0);
        shares.map(|(k, share)| (self.first + k as u32, *share))
    }
}

/// The spans of all texels of half of `n`; one texel stays one.
fn spans(n: u32) -> Vec<Span> {
    let half = (n / 2).max(1);
    let span = |i: u32| {
        if n == 1 {
            return Span { first: 0, shares: [1.0, 0.0, 0.0] };
        }
        if n.is_multiple_of(2) {
            return Span { first: 2 * i, shares: [0.5, 0.5, 0.0] };
        }
        // Of 2m + 1 texels each of m covers 2 + 1/m.
        let whole = n as f32;
        Span { first: 2 * i, shares: [(half - i) as f32 / whole, half as f32 / whole, (i + 1) as f32 / whole] }
    };
    (0..half).map(span).collect()
}

/// The sRGB number that is nearest to a light.
fn stored(light: f32) -> u8 {
    let light = light.clamp(0.0, 1.0);
    let linear: &[f32; 256] = &LINEAR;
    let near = ENCODED[libm::roundf(4096.0 * light) as usize];
    let candidates = near.saturating_sub(1)..=near.saturating_add(1);
    let distance = |number: &u8| (linear[usize::from(*number)] - light).abs();
    candidates.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(near)
}

impl MipMaps {
    /// An image in its own size alone.
    pub(crate) fn of_level(level: Level) -> Self {
        Self { weight: Weight::Even, levels: vec![level.into()] }
    }

    /// An image in all sizes, whose colours are means by `weight`.
    pub(crate) fn new(first: Arc<Level>, weight: Weight) -> Self {
        let mut levels = vec![first];
        let mut weight_of_level = weight;
        while let Some(last) = levels.last().filter(|last| last.size() != [1, 1]) {
            levels.push(last.half(weight_of_level).into());
            weight_of_level = weight.of_smaller();
        }
        Self { weight, levels }
    }

    /// The mean of texels of one size, each with its share of 1.
    pub(crate) fn mean(&self, level: usize, texels: impl Iterator<Item = (f32, [f32; 4])> + Clone) -> [f32; 4] {
        if level == 0 { self.weight.mean(texels) } else { self.weight.of_smaller().mean(texels) }
    }

    /// All sizes, the largest first.
    pub(crate) fn levels(&self) -> &[Arc<Level>] {
        &self.levels
    }

    /// The image in its own size.
    pub(crate) fn first(&self) -> &Arc<Level> {
        &self.levels[0]
    }

    /// Bytes of all texels.
    pub(crate) fn bytes(&self) -> u64 {
        self.levels.iter().map(|level| level.bytes()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(columns: u32, rows: u32) -> Level {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        Level::new(columns, rows, Rgba::Srgb((0..columns * rows).map(|_| [next(), next(), next(), next()]).collect()))
    }

    #[test]
    fn every_number_is_nearest_to_its_own_light() {
        for number in 0..=255u8 {
            assert_eq!(stored(LINEAR[usize::from(number)]), number);
        }
    }

    #[test]
    fn an_even_image_is_even_in_every_size() {
        for texel in [[1, 2, 3, 255], [200, 100, 13, 77], [255, 255, 255, 0]] {
            for weight in [Weight::Even, Weight::Opacity, Weight::Cut(0.2)] {
                let even = |count: usize| Rgba::Srgb(vec![texel; count]);
                let maps = MipMaps::new(Level::new(13, 6, even(78)).into(), weight);
                let sizes: Vec<_> = maps.levels().iter().map(|level| level.size()).collect();
                assert_eq!(sizes, [[13, 6], [6, 3], [3, 1], [1, 1]]);
                for level in maps.levels() {
                    let expected = even((level.columns * level.rows) as usize);
                    // Of a cut one opacities are shares of texels.
                    let is_cut = level.size() != [13, 6] && matches!(weight, Weight::Cut(_));
                    if is_cut {
                        let shown = level.linear(0, 0);
                        assert!((0..3).all(|c| shown[c] == expected.linear(0)[c]) && [0.0, 1.0].contains(&shown[3]));
                    } else {
                        assert_eq!(level.rgba, expected);
                    }
                }
            }
        }
    }

    #[test]
    fn a_texel_is_the_mean_of_the_light_that_it_covers() {
        // In f64, by the area that each texel of the smaller size covers.
        for level in [noise(7, 5), noise(8, 4), noise(1, 9)] {
            let half = level.half(Weight::Even);
            let covered = |n: u32, m: u32, i: u32, k: u32| {
                let [low, high] = [i, i + 1].map(|edge| f64::from(edge) * f64::from(n) / f64::from(m));
                (high.min(f64::from(k + 1)) - low.max(f64::from(k))).max(0.0) * f64::from(m) / f64::from(n)
            };
            for row in 0..half.rows {
                for column in 0..half.columns {
                    let mut mean = [0.0f64; 4];
                    for r in 0..level.rows {
                        for c in 0..level.columns {
                            let share = covered(level.columns, half.columns, column, c)
                                * covered(level.rows, half.rows, row, r);
                            (0..4).for_each(|k| mean[k] += share * f64::from(level.linear(c, r)[k]));
                        }
                    }
                    let found = half.linear(column, row);
                    // Half a step of eight bits, which is at most 0.0045 in light.
                    (0..4).for_each(|k| assert!((mean[k] - f64::from(found[k])).abs() < 0.0046, "{mean:?} {found:?}"));
                }
            }
        }
    }

    #[test]
    fn clear_texels_lend_no_colour() {
        let level = Level::new(2, 1, Rgba::Srgb(vec![[200, 0, 0, 255], [0, 255, 0, 0]]));
        let red = Rgba::Srgb(vec![[200, 0, 0, 128]]);
        assert_eq!(level.half(Weight::Opacity).rgba, red);
        assert_eq!(level.half(Weight::Cut(0.5)).rgba, red);
        assert_ne!(level.half(Weight::Even).rgba, red);
    }

    #[test]
    fn a_cut_is_made_before_texels_are_averaged() {
        // A mean of 0.5 hides that one texel in four is there.
        let level = Level::new(2, 2, Rgba::Srgb(vec![[9, 9, 9, 255], [0, 0, 0, 85], [0, 0, 0, 85], [0, 0, 0, 85]]));
        assert_eq!(level.half(Weight::Cut(0.5)).rgba, Rgba::Srgb(vec![[9, 9, 9, 64]]));
    }
}
