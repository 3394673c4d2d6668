//! An image with coarser ones behind it, each of half as many texels a side as the one before, whose texels are means over areas.
//!
//! Between the centres of texels look-ups are bilinear; of two levels they see a blend.

use crate::RadianceImage;

/// What lies beyond the border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Border {
    /// The last texel goes on.
    Goes,
    /// The image again.
    Repeats,
}

/// An image, fine to coarse. Its numbers are any.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ImageLevels {
    /// At least one.
    levels: Vec<RadianceImage>,
    border: Border,
}

impl ImageLevels {
    /// Of an image of at least one texel.
    pub(crate) fn new(image: RadianceImage, border: Border) -> Self {
        let mut levels = vec![image];
        while let Some(coarser) = levels.last().and_then(coarser) {
            levels.push(coarser);
        }
        Self { levels, border }
    }

    /// The finest one.
    pub(crate) fn image(&self) -> &RadianceImage {
        &self.levels[0]
    }

    /// What is seen at a place, 0 to 1 from the top left, by who sees a width of so many texels of the finest image.
    pub(crate) fn at(&self, at: [f64; 2], texels: f64) -> [f64; 3] {
        let level = libm::log2(texels.max(1.0)).min((self.levels.len() - 1) as f64);
        let fine = level as usize;
        let share = level.fract();
        let seen = self.in_level(fine, at);
        let coarse = if share > 0.0 { self.in_level(fine + 1, at) } else { seen };
        std::array::from_fn(|c| seen[c] + share * (coarse[c] - seen[c]))
    }

    /// Between the centres of four texels.
    fn in_level(&self, level: usize, at: [f64; 2]) -> [f64; 3] {
        let image = &self.levels[level];
        let [width, height] = image.size.map(|n| n as usize);
        let between = |at: f64, count: usize| {
            let place = at * count as f64 - 0.5;
            match self.border {
                Border::Goes => {
                    let place = place.clamp(0.0, (count - 1) as f64);
                    (place as usize, (place as usize + 1).min(count - 1), place.fract())
                }
                Border::Repeats => {
                    let low = place.floor();
                    let first = (low as i64).rem_euclid(count as i64) as usize;
                    (first, (first + 1) % count, place - low)
                }
            }
        };
        let (left, right, x) = between(at[0], width);
        let (top, low, y) = between(at[1], height);
        let texel = |column: usize, row: usize| image.pixels[row * width + column].map(f64::from);
        let mix = |a: [f64; 3], b: [f64; 3], share: f64| [0, 1, 2].map(|c| a[c] + share * (b[c] - a[c]));
        mix(mix(texel(left, top), texel(right, top), x), mix(texel(left, low), texel(right, low), x), y)
    }

    /// Bytes that it takes.
    pub(crate) fn bytes(&self) -> u64 {
        self.levels.iter().map(RadianceImage::bytes).sum()
    }

    /// Bytes of the levels of an image of this size.
    pub(crate) fn bytes_of(size: [u32; 2]) -> u64 {
        let sizes = std::iter::successors(Some(size.map(|n| n.max(1))), |size| coarser_size(*size));
        let texels = sizes.map(|[w, h]| u64::from(w) * u64::from(h)).fold(0, u64::saturating_add);
        texels.saturating_mul(size_of::<[f32; 3]>() as u64)
    }
}

/// Half as many texels a side; `None` for one texel.
fn coarser_size(size: [u32; 2]) -> Option<[u32; 2]> {
    (size != [1, 1]).then(|| size.map(|n| n.div_ceil(2)))
}

/// The texels of `fine` that texel `k` of `coarse` covers, and how much of each.
fn covered(sizes: [u32; 2], k: u32) -> impl Iterator<Item = (usize, f64)> + Clone {
    let [fine, coarse] = sizes;
    // A fine texel has the length `coarse`, a coarse one the length `fine`.
    let [fine, coarse, k] = [fine, coarse, k].map(u64::from);
    let low = k * fine;
    let high = (k + 1) * fine;
    (low / coarse..high.div_ceil(coarse))
        .map(move |i| (i as usize, (high.min((i + 1) * coarse) - low.max(i * coarse)) as f64))
}

fn coarser(fine: &RadianceImage) -> Option<RadianceImage> {
    let size = coarser_size(fine.size)?;
    let texel = |x: u32, y: u32| {
        let columns = covered([fine.size[0], size[0]], x);
        let rows = covered([fine.size[1], size[1]], y);
        let mut sum = [0.0; 3];
        let mut area = 0.0;
        for (row, height) in rows {
            for (column, width) in columns.clone() {
                let seen = fine.pixels[row * fine.size[0] as usize + column].map(f64::from);
                (0..3).for_each(|c| sum[c] += width * height * seen[c]);
                area += width * height;
            }
        }
        sum.map(|v| (v / area) as f32)
    };
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    let pixels = texels.map(|[x, y]| texel(x, y)).collect();
    Some(RadianceImage { size, pixels })
}
