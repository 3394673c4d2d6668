//! One image of an environment, and means of its texels.

use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Rows of the coarsest level: the widest footprint asks for no wider texels.
const FEWEST_ROWS: usize = 4;

/// A direction in the coordinates of the image.
pub(super) struct Place {
    /// Turns from the first column's edge, in \[0, 1\].
    turn: f64,
    /// Angle from +Y, radians.
    polar: f64,
    sine: f64,
    cosine: f64,
}

impl Place {
    /// Where `direction` lies in an image that is turned by `offset`, turns.
    pub(super) fn new(direction: DVec3, offset: f64) -> Self {
        let d = direction.normalize();
        let sine = (d.x * d.x + d.z * d.z).sqrt();
        let turn = (libm::atan2(d.x, -d.z) / (2.0 * PI) + offset).rem_euclid(1.0);
        Self { turn, polar: libm::atan2(sine, d.y), sine, cosine: d.y }
    }
}

/// A row of texels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    sine: f64,
    cosine: f64,
    /// Solid angle of a texel over that of a column: the difference of the cosines of its edges.
    weight: f64,
}

/// An image over all directions, texels square at the equator or nearly so.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Level {
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
    rows: Vec<Row>,
    /// Cosine and sine of the angle between columns so many apart.
    columns: Vec<[f64; 2]>,
    texel: f64,
}

/// Cosine of the polar angle at `y` rows of `height`.
fn edge(y: f64, height: usize) -> f64 {
    libm::cos(PI * y / height as f64)
}

/// The size of the level behind that of `size`: half as many texels along each axis, or along that of the shorter ones where they
/// are far from square.
pub(super) fn coarser_size(size: [usize; 2]) -> Option<[usize; 2]> {
    let [width, height] = size;
    let wide = 2.0 * PI / width as f64;
    let high = PI / height as f64;
    let fewer = |n: usize, side: f64, other: f64| if side < 1.5 * other { n.div_ceil(2) } else { n };
    (height > FEWEST_ROWS).then(|| [fewer(width, wide, high), fewer(height, high, wide)])
}

/// Bytes of a level of a size.
pub(super) fn bytes_of(size: [usize; 2]) -> u64 {
    let [width, height] = size;
    (width * height * size_of::<[f32; 3]>() + height * size_of::<Row>() + width * size_of::<[f64; 2]>()) as u64
}

impl Level {
    pub(super) fn new(size: [usize; 2], texels: Vec<[f32; 3]>) -> Self {
        let [width, height] = size;
        let row = |y: usize| {
            let weight = edge(y as f64, height) - edge((y + 1) as f64, height);
            // At a pole texels are triangles. Halfway between the middle of their sides and the mean of their solid angle the sum of
            // all weights around a direction hardly depends on the direction.
            let moment = |y: usize| {
                let polar = PI * y as f64 / height as f64;
                libm::sin(polar) - polar * libm::cos(polar)
            };
            let (sine, cosine) =
                libm::sincos(0.5 * (PI * (y as f64 + 0.5) / height as f64 + (moment(y + 1) - moment(y)) / weight));
            Row { sine, cosine, weight }
        };
        let column = |j: usize| {
            let (sine, cosine) = libm::sincos(2.0 * PI * j as f64 / width as f64);
            [cosine, sine]
        };
        let rows = (0..height).map(row).collect();
        let columns = (0..width).map(column).collect();
        Self { size, texels, rows, columns, texel: (2.0 * PI / width as f64).max(PI / height as f64) }
    }

    /// The longer side of a texel, radians.
    pub(super) fn texel(&self) -> f64 {
        self.texel
    }

    pub(super) fn texel_sq(&self) -> f64 {
        self.texel * self.texel
    }

    pub(super) fn bytes(&self) -> u64 {
        bytes_of(self.size)
    }

    /// The level of [`coarser_size`], each texel the mean of the radiance of its solid angle.
    pub(super) fn coarser(&self) -> Option<Self> {
        let size = coarser_size(self.size)?;
        let [width, height] = self.size;
        // What of the finer texels [from, to) covers, with what share.
        let covered = |k: usize, coarse: usize, fine: usize| {
            let from = (k * fine) as f64 / coarse as f64;
            let to = ((k + 1) * fine) as f64 / coarse as f64;
            let range = from as usize..(to.ceil() as usize).min(fine);
            range.map(move |i| (i, from.max(i as f64), to.min((i + 1) as f64)))
        };
        let texel = |k: usize| {
            let x = k % size[0];
            let y = k / size[0];
            let mut sum = [0.0; 3];
            let mut weights = 0.0;
            for (row, top, bottom) in covered(y, size[1], height) {
                let share = edge(top, height) - edge(bottom, height);
                for (column, left, right) in covered(x, size[0], width) {
                    add(&mut sum, &mut weights, share * (right - left), self.texels[row * width + column]);
                }
            }
            sum.map(|s| (s / weights) as f32)
        };
        let texels = (0..size[0] * size[1]).into_par_iter().with_min_len(1 << 12).map(texel).collect();
        Some(Self::new(size, texels))
    }

    /// Mean with weights ω·(1 − d²/R²)², d the chord to a texel, `radius_sq` = R².
    pub(super) fn mean(&self, place: &Place, radius_sq: f64) -> [f64; 3] {
        let [width, height] = self.size;
        let step = 2.0 * PI / width as f64;
        let x = place.turn * width as f64;
        // A turn of 1 is one of 0.
        let column = x as usize % width;
        let within = x - x.floor();
        let (sine, cosine) = libm::sincos((0.5 - within) * step);
        let reach = 2.0 * libm::asin((0.5 * radius_sq.sqrt()).min(1.0)) / PI * height as f64;
        let y = place.polar / PI * height as f64;
        let mut sum = [0.0; 3];
        let mut weights = 0.0;
        for row in (y - reach).max(0.0) as usize..((y + reach).ceil() as usize).min(height) {
            let Row { sine: row_sine, cosine: row_cosine, weight } = self.rows[row];
            // R² − d² = a + b·cos Δφ
            let a = radius_sq - 2.0 + 2.0 * place.cosine * row_cosine;
            let b = 2.0 * place.sine * row_sine;
            if a + b <= 0.0 {
                continue;
            }
            let widest = if a >= b { PI } else { libm::acos(-a / b) };
            let first = (within - 0.5 - widest / step).ceil() as i64;
            let count = ((within - 0.5 + widest / step).floor() as i64 - first + 1).min(width as i64).max(0) as usize;
            // Where all columns are met they are met in the order from the nearest, which a turned image has too.
            let first = if count == width { 0 } else { first.rem_euclid(width as i64) as usize };
            let texels = &self.texels[row * width..][..width];
            for k in first..first + count {
                let apart = if k < width { k } else { k - width };
                let [column_cosine, column_sine] = self.columns[apart];
                let inside = a + b * (column_cosine * cosine - column_sine * sine);
                if inside > 0.0 {
                    let at = column + apart;
                    let texel = texels[if at < width { at } else { at - width }];
                    add(&mut sum, &mut weights, weight * inside * inside, texel);
                }
            }
        }
        sum.map(|s| s / weights)
    }
}

fn add(sum: &mut [f64; 3], weights: &mut f64, weight: f64, texel: [f32; 3]) {
    for c in 0..3 {
        sum[c] += weight * f64::from(texel[c]);
    }
    *weights += weight;
}
