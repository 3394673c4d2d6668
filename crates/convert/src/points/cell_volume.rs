//! The volume of every point's Voronoi cell, by rays from the point: V = 4π/3 · mean of t³ over directions.
//!
//! Along a unit vector u the cell ends at t(u) = 1/max_j 2·(u·d_j)/|d_j|², d_j being the ways to the neighbours. Directions come in
//! opposite pairs, so that one product serves two, and in orbits of the cube's rotations, so that data turned by 90° has the same cells. A direction in which the cell reaches farther than [`OPEN`] times the mean
//! distance of the nearest neighbours is open: there the points end. A cell with open directions is completed to a symmetric
//! one by its half that faces the neighbours. So a point at a border has the same volume as inside: in a cubic
//! lattice exactly at faces, and nearly at edges.

use crate::ConvertError;
use crate::common::convert_error::check_cancelled;
use crate::common::extremes::greater;
use crate::points::neighbours::{Lanes, MAX_WAITING, Nearest, Tree, WIDTH, Waiting};
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Neighbours that bound a cell. Farther ones cut some hundredths off the cells of points that lie at random.
const NEIGHBOURS: usize = 24;
/// Those of them whose mean distance says how far a cell may reach.
const NEAREST: usize = 8;
/// How many times that. A cell of a cubic lattice reaches 0.79 times it at most; one of points that lie at random reaches this in a direction
/// with a probability of about e^(−10).
const OPEN: f32 = 1.4;
/// A direction of each orbit, in the sector x > y > z > 0. The mean over all orbits of any polynomial up to degree 19 is that over the sphere, within
/// 10⁻⁴, and the cells of the cubic lattices along the axes are found within 10⁻³. Cubes of any orientation are found within 1.5 %.
const ORBITS: [[f32; 3]; 6] = [
    [0.894_885_8, 0.445_051_5, 0.033_293_3],
    [0.882_431_7, 0.397_583_4, 0.251_479_2],
    [0.734_303_4, 0.666_036_1, 0.131_127_4],
    [0.801_084_8, 0.519_928_1, 0.296_543_1],
    [0.977_531_2, 0.156_957_2, 0.140_702_3],
    [0.688_624_9, 0.580_455_2, 0.434_588_8],
];
/// Pairs of opposite directions of an orbit: six orders of the axes, four pairs of octants. The pairs hold mirror images too.
const ORBIT: usize = 24;
/// All pairs.
const PAIRS: usize = ORBIT * ORBITS.len();
/// Leaves of the tree per parallel task; fixed, so that results do not depend on the thread count.
const LEAVES: usize = 64;

/// The volumes of the cells of distinct points in Morton order, cubed units of theirs; infinite for a point alone.
pub(crate) fn cell_volumes(distinct: &[Vec3], progress: &Progress) -> Result<Vec<f64>, ConvertError> {
    progress.add_total(distinct.len() as u64);
    if distinct.len() < 2 {
        return Ok(vec![f64::INFINITY; distinct.len()]);
    }
    let tree = Tree::new(distinct, progress);
    let rays = rays();
    let mut volumes = vec![0.0; distinct.len()];
    volumes.par_chunks_mut(LEAVES * WIDTH).enumerate().for_each(|(c, out)| {
        if progress.tick(out.len() as u64).is_ok() {
            pulp::Arch::new().dispatch(Task { tree: &tree, distinct, rays: &rays, first: c * LEAVES, out });
        }
    });
    check_cancelled(progress).map(|()| tree.by_point(volumes, 1))
}

/// One direction of each pair, orbit by orbit.
fn rays() -> [Vec3; PAIRS] {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    std::array::from_fn(|i| {
        let [orbit, order, octants] = [i / ORBIT, i % ORBIT / 4, i % 4];
        let direction = Vec3::from_array(ORBITS[orbit]).as_dvec3().normalize().as_vec3();
        let sign = |bit: usize| if octants & bit == 0 { 1.0 } else { -1.0 };
        Vec3::from_array(ORDERS[order].map(|axis| direction[axis])) * Vec3::new(sign(1), sign(2), 1.0)
    })
}

/// The cells of some leaves, in the form that [`pulp`] compiles once per instruction set.
struct Task<'a> {
    tree: &'a Tree,
    distinct: &'a [Vec3],
    rays: &'a [Vec3; PAIRS],
    /// First leaf.
    first: usize,
    out: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Task<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let mut nearest = Nearest::default();
        let mut stack = [Waiting::default(); MAX_WAITING];
        let mut bounds = [[[0.0; WIDTH]; 3]; NEIGHBOURS];
        let count = NEIGHBOURS.min(self.distinct.len() - 1);
        for (l, out) in self.out.chunks_mut(WIDTH).enumerate() {
            let leaf = self.first + l;
            self.tree.nearest(leaf, NEIGHBOURS, &mut nearest, &mut stack);
            let first = self.tree.slots_of(leaf).start;
            let mut units = [0.0; WIDTH];
            for slot in 0..WIDTH {
                // Lanes without a point are those of the first again.
                let lane = if slot < out.len() { slot } else { 0 };
                let at = self.distinct[self.tree.point(first + lane)].as_dvec3();
                let way = |j: usize| self.distinct[nearest.id(j, lane) as usize].as_dvec3() - at;
                units[slot] = unit(count, way);
                for (j, bound) in bounds[..count].iter_mut().enumerate() {
                    let d = way(j);
                    let bounding = d * (2.0 * units[slot] / d.length_squared());
                    (0..3).for_each(|a| bound[a][slot] = bounding[a] as f32);
                }
            }
            let means = mean_cubes(&bounds[..count], self.rays);
            for (out, (mean, unit)) in out.iter_mut().zip(means.into_iter().zip(units)) {
                *out = 4.0 / 3.0 * PI * f64::from(mean) * unit.powi(3);
            }
        }
    }
}

/// The mean distance of the nearest neighbours, in which a point's lengths are measured: so f32 holds them whatever the scale is.
#[inline(always)]
fn unit(count: usize, way: impl Fn(usize) -> DVec3) -> f64 {
    let near = count.min(NEAREST);
    let mut sum = 0.0;
    for j in 0..near {
        sum += way(j).length();
    }
    sum / near as f64
}

/// Means of t³ of the eight points of a leaf, whose neighbours at d are given as 2d/|d|².
// Loops instead of iterators' closures: those would not be compiled for the caller's instruction set.
#[inline(always)]
fn mean_cubes(bounds: &[[Lanes; 3]], rays: &[Vec3; PAIRS]) -> Lanes {
    // The sum leads to where the neighbours are: near ones weigh most.
    let mut inwards = [[0.0; WIDTH]; 3];
    for bound in bounds {
        for a in 0..3 {
            for i in 0..WIDTH {
                inwards[a][i] += bound[a][i];
            }
        }
    }
    // How many directions count, and the sum of t³: of all, and of those of each pair that lead to the neighbours. Orbits are summed by themselves, so
    // that f32 rounds short sums.
    let mut whole = [[0.0; WIDTH]; 2];
    let mut half = [[0.0; WIDTH]; 2];
    for orbit in rays.chunks_exact(ORBIT) {
        let mut whole_of_orbit = [[0.0; WIDTH]; 2];
        let mut half_of_orbit = [[0.0; WIDTH]; 2];
        for ray in orbit {
            let mut ahead = [0.0; WIDTH];
            let mut behind = [0.0; WIDTH];
            for bound in bounds {
                for i in 0..WIDTH {
                    let along = ray.x * bound[0][i] + ray.y * bound[1][i] + ray.z * bound[2][i];
                    ahead[i] = greater(ahead[i], along);
                    behind[i] = greater(behind[i], -along);
                }
            }
            for i in 0..WIDTH {
                let leads = ray.x * inwards[0][i] + ray.y * inwards[1][i] + ray.z * inwards[2][i] >= 0.0;
                let [is_ahead, before] = cubed(ahead[i]);
                let [is_behind, after] = cubed(behind[i]);
                whole_of_orbit[0][i] += is_ahead + is_behind;
                whole_of_orbit[1][i] += before + after;
                // Where the direction that leads to the neighbours is open, the opposite one stands for it.
                let takes_ahead = if leads { is_ahead > 0.0 } else { is_behind == 0.0 };
                half_of_orbit[0][i] += if takes_ahead { is_ahead } else { is_behind };
                half_of_orbit[1][i] += if takes_ahead { before } else { after };
            }
        }
        for k in 0..2 {
            for i in 0..WIDTH {
                whole[k][i] += whole_of_orbit[k][i];
                half[k][i] += half_of_orbit[k][i];
            }
        }
    }
    let mut means = [0.0; WIDTH];
    for i in 0..WIDTH {
        let is_closed = whole[0][i] == 2.0 * PAIRS as f32;
        means[i] = if is_closed { whole[1][i] / whole[0][i] } else { half[1][i] / half[0][i] };
    }
    means
}

/// 1 and t³ of a direction, by its 1/t; zeros where it is open.
#[inline(always)]
fn cubed(inverse: f32) -> [f32; 2] {
    let is_closed = inverse * OPEN >= 1.0;
    let t = if is_closed { 1.0 / inverse } else { 0.0 };
    [if is_closed { 1.0 } else { 0.0 }, t * t * t]
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    const SIDE: usize = 10;

    fn lattice(shift: f32) -> Vec<Vec3> {
        let unit = |i: usize, a: u64| rng::unit_f32(7, 0, i as u64, a) - 0.5;
        let at = |i: usize| Vec3::new((i % SIDE) as f32, (i / SIDE % SIDE) as f32, (i / SIDE / SIDE) as f32);
        (0..SIDE.pow(3)).map(|i| at(i) + shift * Vec3::new(unit(i, 0), unit(i, 1), unit(i, 2))).collect()
    }

    fn volumes(points: &[Vec3]) -> Vec<f64> {
        cell_volumes(points, &Progress::new()).unwrap()
    }

    fn sum(points: &[Vec3]) -> f64 {
        volumes(points).iter().sum()
    }

    #[test]
    fn points_of_a_cubic_lattice_stand_for_their_cubes_at_its_borders_too() {
        let points = lattice(0.0);
        let is_end = |c: f32| c == 0.0 || c == (SIDE - 1) as f32;
        let mut worst = [0.0f64; 4];
        for (p, v) in points.iter().zip(volumes(&points)) {
            let ends = p.to_array().into_iter().filter(|c| is_end(*c)).count();
            worst[ends] = worst[ends].max((v - 1.0).abs());
        }
        // Inside, at faces, at edges and at corners.
        let most = [0.002, 0.002, 0.02, 0.18];
        assert!((0..4).all(|i| worst[i] < most[i]), "{worst:?}");
    }

    #[test]
    fn cells_of_points_that_lie_at_random_fill_their_box() {
        // A lattice whose points lie anywhere within half their cells, and a box of points that know nothing of each other.
        let jittered = sum(&lattice(0.5)) / SIDE.pow(3) as f64;
        assert!((jittered - 1.0).abs() < 0.03, "{jittered}");
        let unit = |i: usize, a: u64| 16.0 * rng::unit_f32(9, 0, i as u64, a);
        let points: Vec<Vec3> = (0..4096).map(|i| Vec3::new(unit(i, 0), unit(i, 1), unit(i, 2))).collect();
        let random = sum(&points) / 4096.0;
        assert!((random - 1.0).abs() < 0.1, "{random}");
    }

    /// The 48 ways to name the axes and their signs; cells are those of the points in their own order, to which Morton order need not hold.
    #[test]
    fn cells_turn_and_mirror_with_their_points() {
        let unit = |i: usize, a: u64| 16.0 * rng::unit_f32(11, 0, i as u64, a) - 8.0;
        let points: Vec<Vec3> = (0..2000).map(|i| Vec3::new(unit(i, 0), unit(i, 1), unit(i, 2))).collect();
        let plain = volumes(&points);
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            for octant in 0..8 {
                let sign = |bit: usize| if octant & bit == 0 { 1.0 } else { -1.0 };
                let signs = Vec3::new(sign(1), sign(2), sign(4));
                let turned: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(order.map(|a| p[a])) * signs).collect();
                for (v, plain) in volumes(&turned).iter().zip(&plain) {
                    assert!((v / plain - 1.0).abs() < 1e-6, "{order:?} {octant}: {v} {plain}");
                }
            }
        }
    }

    #[test]
    fn cells_scale_by_powers_of_two_to_the_bit() {
        let points = lattice(0.7);
        for exponent in [-80, 80] {
            let scaled: Vec<Vec3> = points.iter().map(|p| *p * libm::exp2f(exponent as f32)).collect();
            let back: Vec<f64> = volumes(&scaled).iter().map(|v| v * libm::exp2(-3.0 * f64::from(exponent))).collect();
            assert_eq!(back, volumes(&points));
        }
    }

    #[test]
    fn few_points_and_those_of_planes_and_lines_have_finite_cells() {
        assert_eq!(volumes(&[Vec3::ONE]), [f64::INFINITY]);
        let plane: Vec<Vec3> = lattice(0.0).into_iter().filter(|p| p.z == 0.0).collect();
        let line: Vec<Vec3> = plane.iter().copied().filter(|p| p.y == 0.0).collect();
        for (points, most) in [(&plane[..], 4.0), (&line[..], 60.0), (&line[..2], 4.0), (&line[..3], 8.0)] {
            let found = volumes(points);
            assert!(found.iter().all(|v| (0.3..most).contains(v)), "{} points: {found:?}", points.len());
        }
    }
}
