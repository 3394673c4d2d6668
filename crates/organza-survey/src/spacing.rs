//! How far points lie apart: the median distance to the nearest other point, of a sample of the points.

use rayon::prelude::*;
use splat_core::Aabb;
use splat_core::glam::{IVec3, Vec3};

/// Points whose neighbours are looked for.
const SAMPLE: usize = 1000;
/// Points in a cell of the lattice, about, if they filled their box.
const IN_CELL: f64 = 1.0;
/// Shells of cells in which a neighbour is looked for; then all points are asked.
const WIDEST: i32 = 24;
/// Most cells along a side.
const MOST_CELLS: f64 = (1 << 20) as f64;

/// The median over a sample of the distance to the nearest point at another place; `None` where there are not two places.
pub(crate) fn median_spacing(points: &[Vec3]) -> Option<f64> {
    let points = places(points);
    let lattice = Lattice::new(&points)?;
    let step = points.len().div_ceil(SAMPLE).max(1);
    let mut distances: Vec<f64> = points.iter().step_by(step).map(|p| lattice.nearest(*p)).collect();
    let middle = distances.len() / 2;
    Some(*distances.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Points that lie where another one of them lies.
pub(crate) fn duplicates(points: &[Vec3]) -> u64 {
    (points.len() - places(points).len()) as u64
}

/// Each place of a point once.
fn places(points: &[Vec3]) -> Vec<Vec3> {
    let mut keys: Vec<[u32; 3]> = points.iter().map(|p| p.to_array().map(|c| (c + 0.0).to_bits())).collect();
    keys.par_sort_unstable();
    keys.dedup();
    keys.into_iter().map(|bits| Vec3::from_array(bits.map(f32::from_bits))).collect()
}

/// Points in the order of the cells that they lie in.
struct Lattice<'p> {
    points: &'p [Vec3],
    low: Vec3,
    side: f32,
    cells: IVec3,
    /// Cell and point.
    sorted: Vec<(u64, u32)>,
}

impl<'p> Lattice<'p> {
    /// `None` where all points lie at one place.
    fn new(points: &'p [Vec3]) -> Option<Self> {
        let bounds = Aabb::of_points(points);
        let size = (bounds.max - bounds.min).as_dvec3();
        let longest = size.max_element();
        if points.len() < 2 || longest <= 0.0 {
            return None;
        }
        // Points mostly lie on surfaces: then a cell of this side holds about the square root of the points along a side of it.
        let volume = size.max(splat_core::glam::DVec3::splat(1e-3 * longest));
        let side = (volume.x * volume.y * volume.z * IN_CELL / points.len() as f64).cbrt().max(longest / MOST_CELLS);
        let cells = (size / side).as_ivec3() + IVec3::ONE;
        let mut lattice = Self { points, low: bounds.min, side: side as f32, cells, sorted: Vec::new() };
        let key = |i: usize| (lattice.key(lattice.cell(points[i])), i as u32);
        let mut sorted: Vec<(u64, u32)> = (0..points.len()).into_par_iter().map(key).collect();
        sorted.par_sort_unstable();
        lattice.sorted = sorted;
        Some(lattice)
    }

    fn cell(&self, p: Vec3) -> IVec3 {
        ((p - self.low) / self.side).as_ivec3().clamp(IVec3::ZERO, self.cells - 1)
    }

    fn key(&self, cell: IVec3) -> u64 {
        let [x, y, z] = cell.to_array().map(|c| c as u64);
        (z << 21 | y) << 21 | x
    }

    /// Distance to the nearest point at another place, looked for in ever wider shells of cells.
    fn nearest(&self, p: Vec3) -> f64 {
        let middle = self.cell(p);
        let mut least = f64::INFINITY;
        let mut reach = 0;
        // All points within `reach` cells are known once the shell is done.
        while reach <= WIDEST && least > f64::from(self.side) * f64::from(reach - 1).max(0.0) {
            for z in -reach..=reach {
                for y in -reach..=reach {
                    let inner = z.abs() < reach && y.abs() < reach;
                    let stride = if inner { 2 * reach as usize } else { 1 };
                    for x in (-reach..=reach).step_by(stride) {
                        least = least.min(self.nearest_in(middle + IVec3::new(x, y, z), p));
                    }
                }
            }
            reach += 1;
        }
        if reach <= WIDEST { least } else { self.points.iter().map(|q| apart(*q, p)).fold(f64::INFINITY, f64::min) }
    }

    fn nearest_in(&self, cell: IVec3, p: Vec3) -> f64 {
        if cell.cmplt(IVec3::ZERO).any() || cell.cmpge(self.cells).any() {
            return f64::INFINITY;
        }
        let key = self.key(cell);
        let begin = self.sorted.partition_point(|(k, _)| *k < key);
        let of_cell = self.sorted[begin..].iter().take_while(|(k, _)| *k == key);
        of_cell.map(|(_, i)| apart(self.points[*i as usize], p)).fold(f64::INFINITY, f64::min)
    }
}

/// Distance of two points, infinite for those at one place.
fn apart(p: Vec3, q: Vec3) -> f64 {
    let distance = f64::from(p.distance(q));
    if distance > 0.0 { distance } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spacing_of_a_lattice_is_its_step_whatever_its_shape() {
        for [nx, ny, nz] in [[20, 20, 20], [100, 60, 1], [500, 1, 1], [2, 1, 1]] {
            let at = |i: i32| Vec3::new((i % nx) as f32, (i / nx % ny) as f32, (i / nx / ny) as f32) * 0.25;
            let points: Vec<Vec3> = (0..nx * ny * nz).map(at).collect();
            assert_eq!(median_spacing(&points), Some(0.25), "{nx} {ny} {nz}");
        }
    }

    #[test]
    fn points_at_one_place_have_none_and_duplicates_are_counted() {
        assert_eq!(median_spacing(&[Vec3::ONE; 5]), None);
        assert_eq!(median_spacing(&[]), None);
        assert_eq!(duplicates(&[Vec3::ONE, Vec3::ZERO, Vec3::ONE, -Vec3::ZERO]), 2);
    }

    #[test]
    fn the_nearest_is_that_of_a_search_through_all() {
        let fraction = |x: f32| x - x.floor();
        let points: Vec<Vec3> = (0..400)
            .map(|i| {
                Vec3::new(fraction(i as f32 * 0.7549), fraction(i as f32 * 0.5698), 0.01 * fraction(i as f32 * 0.3621))
            })
            .collect();
        let lattice = Lattice::new(&points).unwrap();
        for p in &points {
            let nearest =
                points.iter().map(|q| f64::from(q.distance(*p))).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
            assert_eq!(lattice.nearest(*p), nearest);
        }
    }
}
