//! Mip maps: an image in its own size and in halves of it down to one texel, each texel the mean of those that it covers.
//!
//! Means are taken of light, not of sRGB numbers, and stay numbers of light: an even image is even in every size, to the bit.

use super::rgba::Rgba;
use rayon::prelude::*;
use std::sync::Arc;

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
    /// Texels of this opacity and more count, others do not.
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
        // Differences to one of them: no rounding of shares changes an even colour.
        let first = texels.clone().next().map_or([0.0; 4], |(_, texel)| texel);
        let mut plain = [0.0f32; 4];
        let mut weighted = [0.0f32; 3];
        let mut sum = 0.0;
        for (share, texel) in texels {
            let differences: [f32; 4] = std::array::from_fn(|c| texel[c] - first[c]);
            let weight = share * self.at(texel[3]);
            (0..4).for_each(|c| plain[c] += share * differences[c]);
            (0..3).for_each(|c| weighted[c] += weight * differences[c]);
            sum += weight;
        }
        let [r, g, b] = [0, 1, 2].map(|c| first[c] + if sum > 0.0 { weighted[c] / sum } else { plain[c] });
        [r, g, b, first[3] + plain[3]]
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

    /// Its texels, row by row from the top.
    #[cfg(feature = "ply")]
    pub(crate) fn rgba(&self) -> &Rgba {
        &self.rgba
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
        let linear = down.par_iter().flat_map_iter(|span_down| across.iter().map(move |a| texel(a, span_down)));
        Self { columns, rows, rgba: Rgba::Linear(linear.collect()) }
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
    fn an_even_image_is_even_in_every_size() {
        for texel in [[1, 2, 3, 255], [200, 100, 13, 77], [255, 255, 255, 0]] {
            for weight in [Weight::Even, Weight::Opacity, Weight::Cut(0.2)] {
                let even = |count: usize| Rgba::Srgb(vec![texel; count]);
                let maps = MipMaps::new(Level::new(13, 6, even(78)).into(), weight);
                let sizes: Vec<_> = maps.levels().iter().map(|level| level.size()).collect();
                assert_eq!(sizes, [[13, 6], [6, 3], [3, 1], [1, 1]]);
                for level in maps.levels() {
                    let expected = even(1).linear(0);
                    // Of a cut one opacities are shares of texels.
                    let is_cut = level.size() != [13, 6] && matches!(weight, Weight::Cut(_));
                    for rank in 0..(level.columns * level.rows) as usize {
                        let shown = level.rgba.linear(rank);
                        assert_eq!(shown[..3], expected[..3]);
                        assert!(if is_cut { [0.0, 1.0].contains(&shown[3]) } else { shown[3] == expected[3] });
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
                    (0..4).for_each(|k| assert!((mean[k] - f64::from(found[k])).abs() < 1e-6, "{mean:?} {found:?}"));
                }
            }
        }
    }

    #[test]
    fn clear_texels_lend_no_colour() {
        let level = Level::new(2, 1, Rgba::Srgb(vec![[200, 0, 0, 255], [0, 255, 0, 0]]));
        let [light, ..] = level.linear(0, 0);
        let red = Rgba::Linear(vec![[light, 0.0, 0.0, 0.5]]);
        assert_eq!(level.half(Weight::Opacity).rgba, red);
        assert_eq!(level.half(Weight::Cut(0.5)).rgba, red);
        assert_ne!(level.half(Weight::Even).rgba, red);
    }

    #[test]
    fn a_cut_is_made_before_texels_are_averaged() {
        // A mean of 0.5 hides that one texel in four is there.
        let level = Level::new(2, 2, Rgba::Srgb(vec![[9, 9, 9, 255], [0, 0, 0, 85], [0, 0, 0, 85], [0, 0, 0, 85]]));
        let [light, ..] = level.linear(0, 0);
        assert_eq!(level.half(Weight::Cut(0.5)).rgba, Rgba::Linear(vec![[light, light, light, 0.25]]));
    }
}
