//! Footprints that are images (Gunjee 2007, section 4.3: "several ready-to-use textures", one chosen per point).
//!
//! An image says how much of each place a disc covers, from 0 to 1. It lies in the plane of the disc as large as it fits within the rim:
//! its corners are on it, its right side points along the tangent t and its top along n × t, so that whoever looks against the normal n
//! sees it as it is stored. Of a table of texels the value is bilinear between their middles, and 0 beyond the border.
//!
//! **Energy.** Values are multiplied by a constant that gives them the integral over the disc of the formula in whose place the image is,
//! 1/[`crate::Footprint::norm`]. So a cross-section K means for an image what it means for that formula, and whoever knows no
//! images (shadow maps, particles) draws the formula and keeps the energy.
//!
//! **Far away.** Coarser levels halve the texels of the one before, as means over areas, down to [`COARSEST`]; behind the last one comes
//! the formula, which is what a pixel's filter leaves of an image. Every level has the same integral, and where a disc is opaque the same
//! area: a level covers a place where its value is above a threshold of its own.

use crate::Error;

/// Most texels of a table along one side; what has more is averaged over areas.
pub const MOST_TEXELS: usize = 128;
/// Texels along a side from which on no level is coarser.
const COARSEST: usize = 4;
/// Places along a side of a texel at which integrals are taken.
const PLACES: usize = 8;
/// Share of a place that an opaque image covers from which on it is solid.
const SOLID: f32 = 0.5;

/// One image in the place of a formula.
#[derive(Debug, Clone, PartialEq)]
pub struct FootprintImage {
    /// Half the width and the height, as shares of the disc's radius: √(x² + y²) = 1.
    pub(crate) half: [f32; 2],
    /// Fine to coarse.
    pub(crate) levels: Vec<Level>,
    /// The area that it covers, for a radius of 1.
    pub(crate) solid_area: f64,
}

/// One table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Level {
    /// Texels, without the border.
    size: [usize; 2],
    /// Coverage, row by row from the top left, with a border of one texel of 0 around.
    texels: Vec<f32>,
    /// What coverage is multiplied by, so that its integral over a disc of radius 1 is 1.
    pub(crate) gain: f32,
    /// Coverage from which on an opaque disc is solid.
    pub(crate) threshold: f32,
}

impl FootprintImage {
    /// Of coverages, row by row from the top left.
    ///
    /// # Errors
    /// [`Error::ColumnLength`] for another number of pixels than `size` says; [`Error::Invalid`] for no pixels, coverages outside \[0, 1\] or
    /// none above 0.
    pub fn new(size: [u32; 2], coverage: &[f32]) -> Result<Self, Error> {
        let size = size.map(|n| n as usize);
        let expected = size[0].saturating_mul(size[1]);
        if coverage.len() != expected {
            return Err(Error::ColumnLength { attribute: "coverage", found: coverage.len(), expected });
        }
        if let Some(i) = coverage.iter().position(|c| !(0.0..=1.0).contains(c)) {
            return Err(Error::invalid("pixel", i, "coverage", coverage[i], "a share from 0 to 1"));
        }
        if coverage.iter().all(|c| *c == 0.0) {
            return Err(Error::invalid("image", 0, "coverage", 0.0, "a pixel above 0"));
        }
        let diagonal = (size[0] as f64).hypot(size[1] as f64);
        let half = size.map(|n| (n as f64 / diagonal) as f32);
        let mut texels = averaged(size, coverage, size.map(|n| n.min(MOST_TEXELS)));
        let mut tables = Vec::new();
        loop {
            let size: [usize; 2] = texels.0;
            let coarser = size.map(|n| if n > COARSEST { n.div_ceil(2) } else { n });
            let next = (coarser != size).then(|| averaged(size, &texels.1, coarser));
            tables.push(std::mem::replace(&mut texels, next.unwrap_or_default()));
            if coarser == size {
                break;
            }
        }
        let mut levels = Vec::with_capacity(tables.len());
        let mut area = 0.0;
        for (size, texels) in tables {
            let mut level = Level::new(size, &texels);
            let mut samples = level.samples(half);
            let texel = f64::from(half[0]) * f64::from(half[1]) * 4.0 / (PLACES * PLACES * size[0] * size[1]) as f64;
            let sum: f64 = samples.iter().map(|v| f64::from(*v)).sum();
            level.gain = (1.0 / (sum * texel)) as f32;
            if levels.is_empty() {
                let covers = samples.iter().filter(|v| **v >= SOLID).count();
                // An image that is nowhere more than half there covers where it is the most.
                area = (covers.max(1) as f64) * texel;
                level.threshold = if covers > 0 { SOLID } else { samples.iter().copied().fold(0.0, f32::max) };
            } else {
                let covered = ((area / texel) as usize).clamp(1, samples.len()) - 1;
                level.threshold = *samples.select_nth_unstable_by(covered, |a, b| b.total_cmp(a)).1;
            }
            levels.push(level);
        }
        Ok(Self { half, levels, solid_area: area })
    }

    /// Width and height of the finest table, texels.
    pub fn size(&self) -> [usize; 2] {
        self.levels[0].size
    }

    /// Coverage at a texel of the finest table, from the top left.
    ///
    /// # Panics
    /// If it is out of range.
    pub fn texel(&self, pixel: [usize; 2]) -> f32 {
        let [x, y] = pixel;
        self.levels[0].texel(x + 1, y + 1)
    }

    /// Half the width and the height, as shares of the disc's radius.
    pub fn half_size(&self) -> [f32; 2] {
        self.half
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|level| size_of_val(&*level.texels) as u64).sum()
    }
}

#[cfg(feature = "raster")]
impl FootprintImage {
    /// Which level a pixel sees that is so wide, in units of the semi-axes: its texels are about as wide as the pixel. The number of levels
    /// is that of the formula.
    pub(crate) fn level(&self, pixel: f32) -> f32 {
        let [columns, rows] = self.levels[0].size.map(|n| n as f32);
        let texel = 2.0 * (self.half[0] / columns).min(self.half[1] / rows);
        // Comparisons with NaN are false: what has no size is a point.
        let level = libm::log2f(pixel / texel);
        if level < self.levels.len() as f32 { level.max(0.0) } else { self.levels.len() as f32 }
    }

    /// Coverage at a place, times a number of each level, blended between levels; and the share of the formula, by which it is to
    /// be blended with that. What is multiplied is 1 over the threshold for what is solid, and the gain else.
    #[inline]
    pub(crate) fn seen(&self, level: f32, place: [f32; 2], factor: impl Fn(&Level) -> f32) -> (f32, f32) {
        let fine = level as usize;
        let share = level - fine as f32;
        let coverage = |k: usize| self.levels.get(k).map_or(0.0, |l| l.at(self.half, place) * factor(l));
        let formula = match self.levels.len() {
            n if fine >= n => 1.0,
            n if fine + 1 == n => share,
            _ => 0.0,
        };
        let first = coverage(fine);
        (if share > 0.0 { first * (1.0 - share) + coverage(fine + 1) * share } else { first }, formula)
    }
}

impl Level {
    fn new(size: [usize; 2], coverage: &[f32]) -> Self {
        let stride = size[0] + 2;
        let mut texels = vec![0.0; stride * (size[1] + 2)];
        for (row, from) in coverage.chunks_exact(size[0]).enumerate() {
            texels[(row + 1) * stride + 1..][..size[0]].copy_from_slice(from);
        }
        Self { size, texels, gain: 1.0, threshold: SOLID }
    }

    fn texel(&self, x: usize, y: usize) -> f32 {
        self.texels[y * (self.size[0] + 2) + x]
    }

    /// Between the middles of four texels.
    #[inline]
    fn at(&self, half: [f32; 2], place: [f32; 2]) -> f32 {
        let along = |axis: usize, up: f32| {
            let n = self.size[axis] as f32;
            // The border's texels have the places 0 and n + 1.
            let at = ((0.5 + up * 0.5 * place[axis] / half[axis]) * n + 0.5).clamp(0.0, n + 1.0);
            let low = (at as usize).min(self.size[axis]);
            (low, at - low as f32)
        };
        let (x, right) = along(0, 1.0);
        let (y, down) = along(1, -1.0);
        let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
        let row = |y: usize| mix(self.texel(x, y), self.texel(x + 1, y), right);
        mix(row(y), row(y + 1), down)
    }

    /// Coverages at places that lie evenly over the image, those beyond the rim 0; and beyond the border, where the last half texel ends.
    fn samples(&self, half: [f32; 2]) -> Vec<f32> {
        let [columns, rows] = self.size;
        let border = PLACES / 2;
        let along =
            |i: usize, n: usize, half: f32| (2.0 * (i as f32 + 0.5 - border as f32) / (PLACES * n) as f32 - 1.0) * half;
        let places = |n: usize| PLACES * n + 2 * border;
        let mut samples = Vec::with_capacity(places(columns) * places(rows));
        for j in 0..places(rows) {
            let y = along(j, rows, half[1]);
            for i in 0..places(columns) {
                let x = along(i, columns, half[0]);
                samples.push(if x * x + y * y < 1.0 { self.at(half, [x, y]) } else { 0.0 });
            }
        }
        samples
    }
}

/// An image of another size, whose pixels are means over areas.
fn averaged(size: [usize; 2], pixels: &[f32], to: [usize; 2]) -> ([usize; 2], Vec<f32>) {
    let [width, height] = size;
    if to == [width, height] {
        return (to, pixels.to_vec());
    }
    let covered = |fine: usize, coarse: usize, k: usize| {
        // A fine pixel has the length `coarse`, a coarse one the length `fine`.
        let low = k * fine;
        let high = (k + 1) * fine;
        (low / coarse..high.div_ceil(coarse))
            .map(move |i| (i, (high.min((i + 1) * coarse) - low.max(i * coarse)) as f64 / fine as f64))
    };
    let pixel = |x: usize, y: usize| {
        let row = |j: usize| -> f64 {
            covered(width, to[0], x).map(|(i, share)| share * f64::from(pixels[j * width + i])).sum()
        };
        covered(height, to[1], y).map(|(j, share)| share * row(j)).sum::<f64>().min(1.0) as f32
    };
    let places = (0..to[1]).flat_map(|y| (0..to[0]).map(move |x| (x, y)));
    (to, places.map(|(x, y)| pixel(x, y)).collect())
}
