//! Transfer functions of volumes that are seen for the first time: colours by a preset, extinction so that a view ray through
//! matter loses about as much light as the preset wants, whatever the volume's size, steps and values are.

use crate::matter::Matter;
use crate::preset::Look;
use convert::ColorMap;
use splat_core::Grid;

/// Tissue without a name: from what lies around to what is densest.
const PLAIN: [[f32; 3]; 3] = [[0.56, 0.23, 0.15], [0.88, 0.62, 0.46], [0.98, 0.93, 0.84]];
const SKIN: [f32; 3] = [0.80, 0.52, 0.38];
const BONE: [[f32; 3]; 2] = [[0.72, 0.56, 0.40], [0.95, 0.92, 0.84]];
/// Brighter than one scattering: it stands for the many in a cloud.
const DROPLETS: [f32; 3] = [3.4, 3.4, 3.5];

/// Hounsfield units of what lets bones show, from flesh to their dense shell, and of the surface of a body.
const BONES: [f64; 4] = [130.0, 220.0, 450.0, 1100.0];
/// The film of soft tissue around bones: Hounsfield units of its edge in air and of flesh; then its extinction over that of bone.
const FILM: [f64; 2] = [-400.0, -150.0];
const FILM_WEIGHT: f64 = 0.012;
const FLESH: [f32; 3] = [0.78, 0.42, 0.32];
const SKINS: [f64; 4] = [-500.0, -250.0, -100.0, 300.0];

/// A control point: colour, and extinction over the largest one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    pub(crate) value: f64,
    pub(crate) color: [f32; 3],
    pub(crate) weight: f64,
}

/// A transfer function.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Transfer {
    pub(crate) points: Vec<Point>,
    /// Extinction where the weight is 1, 1/world unit.
    pub(crate) extinction: f64,
}

impl Transfer {
    /// For a volume of these values, `None` where all are one.
    pub(crate) fn new(grid: &Grid, matter: Option<&Matter>, look: Option<&Look>) -> Self {
        let Some(matter) = matter else { return Self::of_one_value(grid) };
        let (points, depth) = points(matter, look);
        let mut transfer = Self { points: rising(points), extinction: 1.0 };
        let length = transfer.mean_length(grid);
        transfer.extinction = if length > 0.0 { depth / length } else { 1.0 };
        transfer
    }

    /// A box of one value: half of the light comes through it.
    fn of_one_value(grid: &Grid) -> Self {
        let value = grid.values.first().copied().map_or(0.0, f64::from);
        let points = vec![Point { value, color: PLAIN[1], weight: 1.0 }];
        let width = grid.axes.x_axis.length() * grid.dims[0] as f64;
        Self { points, extinction: std::f64::consts::LN_2 / width }
    }

    /// Extinction over the largest one; 0 of a gap.
    pub(crate) fn weight(&self, value: f64) -> f64 {
        if value.is_nan() {
            return 0.0;
        }
        let above = self.points.partition_point(|p| p.value <= value);
        match (above.checked_sub(1).map(|i| self.points[i]), self.points.get(above)) {
            (Some(a), Some(b)) => a.weight + (b.weight - a.weight) * (value - a.value) / (b.value - a.value),
            (Some(a), None) => a.weight,
            (None, b) => b.map_or(0.0, |b| b.weight),
        }
    }

    /// The mean of the weight's integral along lines through what shows, of lines along the three axes of the lattice.
    fn mean_length(&self, grid: &Grid) -> f64 {
        let [nx, ny, nz] = grid.dims;
        let mut sum = 0.0;
        let mut across = [vec![false; ny * nz], vec![false; nx * nz], vec![false; nx * ny]];
        for (row, values) in grid.values.chunks(nx).enumerate() {
            let j = row % ny;
            let k = row / ny;
            for (i, v) in values.iter().enumerate() {
                let weight = self.weight(f64::from(*v));
                sum += weight;
                if weight > SHOWS {
                    across[0][row] = true;
                    across[1][k * nx + i] = true;
                    across[2][j * nx + i] = true;
                }
            }
        }
        let steps = [grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis].map(|a| a.length());
        let lines = across.map(|seen| seen.iter().filter(|s| **s).count().max(1));
        (0..3).map(|a| sum * steps[a] / lines[a] as f64).sum::<f64>() / 3.0
    }
}

/// Weight from which a voxel counts among what shows.
const SHOWS: f64 = 0.02;

/// Control points, and the optical depth of matter that the look wants.
fn points(matter: &Matter, look: Option<&Look>) -> (Vec<Point>, f64) {
    let at = |place: f64| matter.first + place * (matter.last - matter.first);
    let of_body = |place: f64, color: [f32; 3], weight: f64| Point { value: at(place), color, weight };
    if let Some(opposite) = matter.opposite {
        match look {
            None => return (of_both_signs(matter, opposite, ColorMap::COOLWARM), 8.0),
            Some(Look::Map(map)) => return (of_both_signs(matter, opposite, *map), 8.0),
            Some(Look::Field(map)) => return (of_both_signs(matter, opposite, *map), 4.0),
            Some(_) => {}
        }
    }
    match look {
        None | Some(Look::Mri | Look::Labels) => {
            let [low, middle, high] = PLAIN;
            let ramp = [(0.0, low, 0.0), (0.25, low, 0.04), (0.5, middle, 0.22), (0.75, middle, 0.6), (1.0, high, 1.0)];
            (ramp.map(|(place, color, weight)| of_body(place, color, weight)).to_vec(), 12.0)
        }
        Some(Look::Cloud) => (vec![of_body(0.0, DROPLETS, 0.0), of_body(1.0, DROPLETS, 1.0)], 5.0),
        Some(Look::Map(map)) => (of_map(*map, of_body), 8.0),
        Some(Look::Field(map)) => (of_map(*map, of_body), 4.0),
        Some(Look::Tomogram) => {
            let [low, high] = BONE;
            let film = [FILM[0], FILM[1]].into_iter().zip([(FLESH, 0.0), (FLESH, FILM_WEIGHT)]);
            let looks = [(FLESH, FILM_WEIGHT), (low, 0.15), (high, 0.7), (high, 1.0)];
            let point = |(value, (color, weight))| Point { value, color, weight };
            (film.chain(BONES.into_iter().zip(looks)).map(point).collect(), 20.0)
        }
        Some(Look::CtBone) => {
            let [low, high] = BONE;
            let bones =
                if matter.has_units() { BONES } else { between(matter.dense(), matter.last, [0.0, 0.12, 0.4, 1.0]) };
            let looks = [(low, 0.0), (low, 0.15), (high, 0.7), (high, 1.0)];
            (with_looks(bones, looks), 20.0)
        }
        Some(Look::CtSkin) => {
            let skin =
                if matter.has_units() { SKINS } else { between(matter.first, matter.bulk(), [0.0, 0.3, 0.6, 1.0]) };
            (with_looks(skin, [(SKIN, 0.0), (SKIN, 0.5), (SKIN, 1.0), (SKIN, 1.0)]), 60.0)
        }
        Some(Look::Sampled(sampled)) => {
            let [low, high] = sampled.range();
            let least = matter.histogram.low;
            let most = matter.histogram.high;
            // Values of a preset count as they are where they are such as the data has; else they are stretched over the data's.
            let fits = low >= least && high <= most && high - low > 0.1 * (most - least);
            let stretch = if fits || high <= low { 1.0 } else { (most - least) / (high - low) };
            let shift = if fits { 0.0 } else { least - stretch * low };
            let places = sampled.colors.iter().map(|c| c.0).chain(sampled.opacities.iter().map(|o| o.0));
            let point = |v: f64| {
                let value = shift + stretch * v;
                let of_body = ((value - matter.first) / (matter.last - matter.first)).clamp(0.0, 1.0);
                Point { value, color: sampled.color(v), weight: sampled.opacity(v).unwrap_or(of_body * of_body) }
            };
            (places.map(point).collect(), 8.0)
        }
    }
}

/// The colours of a map over the body of the values, of which the higher ones are denser.
fn of_map(map: ColorMap, of_body: impl Fn(f64, [f32; 3], f64) -> Point) -> Vec<Point> {
    let steps = (map.steps() - 1).max(4);
    let point = |i: usize| {
        let place = i as f64 / steps as f64;
        of_body(place, map.at(place), place * place)
    };
    (0..=steps).map(point).collect()
}

/// The colours of a map over values of both signs, of which those farther from 0 are denser; the middle of the map is 0.
fn of_both_signs(matter: &Matter, opposite: [f64; 2], map: ColorMap) -> Vec<Point> {
    const STEPS: usize = 8;
    let sides = [[matter.first, matter.last], opposite];
    let point = |side: usize, step: usize| {
        let [first, last] = sides[side];
        let place = step as f64 / STEPS as f64;
        let sign = if last > first { 1.0 } else { -1.0 };
        Point { value: first + place * (last - first), color: map.at(0.5 + 0.5 * sign * place), weight: place * place }
    };
    (0..2).flat_map(|side| (0..=STEPS).map(move |step| (side, step))).map(|(side, step)| point(side, step)).collect()
}

/// Values at places between two.
fn between(from: f64, to: f64, places: [f64; 4]) -> [f64; 4] {
    places.map(|place| from + place * (to - from))
}

fn with_looks(values: [f64; 4], looks: [([f32; 3], f64); 4]) -> Vec<Point> {
    values.iter().zip(looks).map(|(value, (color, weight))| Point { value: *value, color, weight }).collect()
}

/// In the order of their values, of which none comes twice.
fn rising(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
    points.dedup_by(|b, a| (b.value as f32) <= (a.value as f32));
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    /// A cube of one value in the middle of nothing.
    fn cube(step: f64) -> Grid {
        let n = 24;
        let inside = |i: usize| [i % n, i / n % n, i / n / n].iter().all(|c| (6..18).contains(c));
        let values = (0..n * n * n).map(|i| if inside(i) { 100.0 } else { 0.0 }).collect();
        Grid { origin: DVec3::ZERO, axes: DMat3::from_diagonal(DVec3::splat(step)), dims: [n; 3], values }
    }

    #[test]
    fn a_ray_through_matter_loses_what_the_look_wants_whatever_the_unit() {
        for step in [0.001, 1.0, 250.0] {
            let grid = cube(step);
            let matter = Matter::from_grid(&grid).unwrap();
            for look in
                [None, Some(Look::Cloud), Some(Look::Map(ColorMap::VIRIDIS)), Some(Look::Field(ColorMap::VIRIDIS))]
            {
                let (_, depth) = points(&matter, look.as_ref());
                let transfer = Transfer::new(&grid, Some(&matter), look.as_ref());
                // Twelve voxels of full weight.
                let found = transfer.extinction * transfer.weight(100.0) * 12.0 * step;
                assert!((found - depth).abs() < 1e-6 * depth, "{look:?}: {found}");
                assert_eq!(transfer.weight(0.0), 0.0);
            }
        }
    }

    #[test]
    fn both_signs_show_and_gaps_do_not() {
        let mut grid = cube(1.0);
        // Half of the cube has the other sign.
        (0..24 * 24 * 12).for_each(|i| grid.values[i] = -grid.values[i]);
        let matter = Matter::from_grid(&grid).unwrap();
        for look in [None, Some(Look::Map(ColorMap::VIRIDIS)), Some(Look::Field(ColorMap::VIRIDIS))] {
            let transfer = Transfer::new(&grid, Some(&matter), look.as_ref());
            assert!(transfer.points.windows(2).all(|w| w[0].value < w[1].value), "{transfer:?}");
            let [plus, minus, zero] = [100.0, -100.0, 0.0].map(|value| transfer.weight(value));
            assert!(plus > 0.9 && minus > 0.9 && zero == 0.0, "{plus} {minus} {zero}");
            assert_eq!(transfer.weight(f64::NAN), 0.0);
        }
    }

    #[test]
    fn values_rise_also_where_matter_is_darker_than_air() {
        let mut grid = cube(1.0);
        grid.values.iter_mut().for_each(|v| *v = 100.0 - *v);
        let matter = Matter::from_grid(&grid).unwrap();
        let transfer = Transfer::new(&grid, Some(&matter), None);
        assert!(transfer.points.windows(2).all(|w| w[0].value < w[1].value));
        assert!(transfer.weight(0.0) > 0.9 && transfer.weight(100.0) < 0.01, "{transfer:?}");
    }

    #[test]
    fn bones_of_a_tomogram_are_told_by_units_or_by_what_is_dense() {
        let mut grid = cube(1.0);
        // A rod of bone in a cube of flesh.
        let is_bone = |i: usize| (10..14).contains(&(i % 24)) && (10..14).contains(&(i / 24 % 24));
        for (units, [air, flesh, bone]) in [(true, [-1000.0, 40.0, 1200.0]), (false, [0.0, 60.0, 190.0])] {
            for (i, v) in grid.values.iter_mut().enumerate() {
                let inside = [i % 24, i / 24 % 24, i / 576].iter().all(|c| (6..18).contains(c));
                *v = if !inside {
                    air
                } else if is_bone(i) {
                    bone
                } else {
                    flesh
                };
            }
            let matter = Matter::from_grid(&grid).unwrap();
            assert_eq!(matter.has_units(), units);
            let transfer = Transfer::new(&grid, Some(&matter), Some(&Look::CtBone));
            let [air, flesh, bone] = [air, flesh, bone].map(|v| transfer.weight(f64::from(v)));
            assert!(air == 0.0 && flesh < 0.05 && bone > 0.9, "{air} {flesh} {bone}");
            if units {
                let film = Transfer::new(&grid, Some(&matter), Some(&Look::Tomogram));
                let [air, flesh, bone] = [-1000.0, 40.0, 1200.0].map(|v| film.weight(v));
                assert!(air == 0.0 && flesh == FILM_WEIGHT && bone == 1.0, "{air} {flesh} {bone}");
            }
        }
    }
}
