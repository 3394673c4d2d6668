//! Discs whose footprints are images, in f64: the definition of `splat_core::FootprintImage`, from the texels of its finest table.
//!
//! Coarser tables are means over areas, down to four texels a side; values are bilinear between the middles of texels and 0 beyond the
//! rim. What a value is multiplied by, and from which one on it is solid, is told by sums over 8 x 8 places a texel. A pixel sees the level
//! whose texels are as wide as it is, blended with the next coarser one, and after the last one the formula.

use glam::{DMat2, DVec2};
use splat_core::FootprintImage;
use std::f64::consts::PI;

const COARSEST: usize = 4;
const PLACES: usize = 8;
const SOLID: f64 = 0.5;

/// An image by its tables.
pub(crate) struct Pattern {
    half: DVec2,
    levels: Vec<Table>,
    /// Profile of the formula at the rim of a circle of the solid area.
    solid_profile: f64,
}

struct Table {
    size: [usize; 2],
    texels: Vec<f64>,
    gain: f64,
    threshold: f64,
}

/// How the image of a disc lies in that of the camera.
pub(crate) struct Laid {
    /// From pixels to the units of the semi-axes.
    to_disc: DMat2,
    to_core: DMat2,
    level: f64,
}

impl Laid {
    /// What is seen at an offset in pixels.
    pub(crate) fn at(&self, offset: DVec2) -> Seen {
        Seen { level: self.level, place: self.to_disc * offset, in_core: self.to_core * offset }
    }
}

/// Where a ray meets it, in units of the semi-axes, with and without the filter.
pub(crate) struct Seen {
    pub(crate) level: f64,
    pub(crate) place: DVec2,
    pub(crate) in_core: DVec2,
}

impl Pattern {
    /// `formula` is the profile that it stands for, by s, and `norm` one over its integral.
    pub(crate) fn new(image: &FootprintImage, formula: impl Fn(f64) -> f64, norm: f64) -> Self {
        let mut size = image.size();
        let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let mut texels: Vec<f64> = texels.map(|at| f64::from(image.texel(at))).collect();
        let half = DVec2::from_array(image.half_size().map(f64::from));
        let mut levels = Vec::new();
        let mut area = 0.0;
        loop {
            let mut table = Table { size, texels, gain: 1.0, threshold: SOLID };
            let mut places = table.places(half);
            let each = 4.0 * half.x * half.y / (PLACES * PLACES * size[0] * size[1]) as f64;
            table.gain = 1.0 / (norm * each * places.iter().sum::<f64>());
            places.sort_by(|a, b| b.total_cmp(a));
            if levels.is_empty() {
                let solid = places.iter().filter(|v| **v >= SOLID).count();
                area = solid.max(1) as f64 * each;
                table.threshold = if solid > 0 { SOLID } else { places[0] };
            } else {
                table.threshold = places[((area / each) as usize).clamp(1, places.len()) - 1];
            }
            let coarser = size.map(|n| if n > COARSEST { n.div_ceil(2) } else { n });
            let is_last = coarser == size;
            texels = table.averaged(coarser);
            size = coarser;
            levels.push(table);
            if is_last {
                return Self { half, levels, solid_profile: formula(area / PI) };
            }
        }
    }

    /// How the disc with this Jacobian lies, whose image the filter has given `metric`; `core` without it.
    pub(crate) fn laid(&self, jacobian: DMat2, metric: DMat2, core: DMat2) -> Laid {
        // The polar decomposition by its definition: J = S·R, S² = J·Jᵀ.
        let s = root(jacobian * jacobian.transpose());
        let turn = if s.determinant() > 0.0 { (s.inverse() * jacobian).transpose() } else { DMat2::IDENTITY };
        let [a, b, d] = [metric.x_axis.x, metric.x_axis.y, metric.y_axis.y];
        let widest = 0.5 * (a + d) + (0.25 * (a - d) * (a - d) + b * b).sqrt();
        let size = DVec2::from_array(self.levels[0].size.map(|n| n as f64));
        let level = (widest.sqrt() / (2.0 * self.half / size).min_element()).log2();
        let level = level.clamp(0.0, self.levels.len() as f64);
        Laid { to_disc: turn * root(metric), to_core: turn * root(core), level }
    }

    /// Profile where the formula has `formula`.
    pub(crate) fn profile(&self, seen: &Seen, formula: f64) -> f64 {
        self.seen(seen.level, seen.place, |table| table.gain, formula)
    }

    /// Whether an opaque disc is solid, where the formula without the filter has `formula`.
    pub(crate) fn is_solid(&self, seen: &Seen, formula: f64) -> bool {
        seen.in_core.length_squared() < 1.0
            && self.seen(seen.level, seen.in_core, |table| 1.0 / table.threshold, formula / self.solid_profile) >= 1.0
    }

    fn seen(&self, level: f64, place: DVec2, factor: impl Fn(&Table) -> f64, formula: f64) -> f64 {
        let coverage =
            |k: usize| self.levels.get(k).map_or(formula, |table| factor(table) * table.at(self.half, place));
        let fine = level.floor();
        let share = level - fine;
        coverage(fine as usize) * (1.0 - share) + if share > 0.0 { share * coverage(fine as usize + 1) } else { 0.0 }
    }
}

impl Table {
    fn texel(&self, x: i64, y: i64) -> f64 {
        let [columns, rows] = self.size.map(|n| n as i64);
        let is_there = (0..columns).contains(&x) && (0..rows).contains(&y);
        if is_there { self.texels[(y * columns + x) as usize] } else { 0.0 }
    }

    fn at(&self, half: DVec2, place: DVec2) -> f64 {
        let size = DVec2::from_array(self.size.map(|n| n as f64));
        let at = (0.5 + 0.5 * DVec2::new(place.x, -place.y) / half) * size - 0.5;
        let low = at.floor();
        let share = at - at.floor();
        let x = low.x as i64;
        let y = low.y as i64;
        let row = |y: i64| self.texel(x, y) * (1.0 - share.x) + self.texel(x + 1, y) * share.x;
        row(y) * (1.0 - share.y) + row(y + 1) * share.y
    }

    /// Values at all places, with those of the half texel beyond the border.
    fn places(&self, half: DVec2) -> Vec<f64> {
        let range = |n: usize| -(PLACES as i64) / 2..(PLACES * n + PLACES / 2) as i64;
        let along = |i: i64, n: usize| 2.0 * (i as f64 + 0.5) / (PLACES * n) as f64 - 1.0;
        let [columns, rows] = self.size;
        let places = range(rows).flat_map(|j| range(columns).map(move |i| (i, j)));
        let place = places.map(|(i, j)| DVec2::new(along(i, columns), along(j, rows)) * half);
        place.map(|p| if p.length_squared() < 1.0 { self.at(half, p) } else { 0.0 }).collect()
    }

    /// Texels of another size, means over areas.
    fn averaged(&self, to: [usize; 2]) -> Vec<f64> {
        let scale = [0, 1].map(|axis| self.size[axis] as f64 / to[axis] as f64);
        let share = |fine: usize, coarse: usize, axis: usize| {
            let low = coarse as f64 * scale[axis];
            let high = (coarse + 1) as f64 * scale[axis];
            ((fine as f64 + 1.0).min(high) - (fine as f64).max(low)).max(0.0) / scale[axis]
        };
        let mean = |x: usize, y: usize| {
            let covered = |k: usize, axis: usize| {
                let low = k as f64 * scale[axis];
                let high = (k + 1) as f64 * scale[axis];
                low as usize..(high.ceil() as usize).min(self.size[axis])
            };
            let row =
                |j: usize| -> f64 { covered(x, 0).map(|i| share(i, x, 0) * self.texels[j * self.size[0] + i]).sum() };
            covered(y, 1).map(|j| share(j, y, 1) * row(j)).sum::<f64>()
        };
        (0..to[1]).flat_map(|y| (0..to[0]).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
    }
}

/// The symmetric root of a symmetric matrix without negative eigenvalues, by Cayley and Hamilton.
fn root(m: DMat2) -> DMat2 {
    let determinant = m.determinant().max(0.0).sqrt();
    let trace = (m.x_axis.x + m.y_axis.y + 2.0 * determinant).sqrt();
    if trace > 0.0 { (m + DMat2::IDENTITY * determinant) * (1.0 / trace) } else { DMat2::ZERO }
}
