//! The k nearest neighbours of every point: a tree of boxes over points in Morton order, asked by eight at a time.
//!
//! Eight points in Morton order make a leaf, eight boxes of one level a box of the next: no choice of splits, no
//! pointers, built in O(n). The eight points of a leaf lie close together and so do their neighbours: they are asked
//! for at once, one point a lane. A query begins in its own leaf, so that its bound is tight at once, and climbs: at
//! each level it looks into those of the seven siblings whose box is nearer to the leaf's box than the farthest k-th
//! neighbour so far. Each candidate is compared with eight queries; the k nearest of each are rows of lanes that a
//! nearer candidate moves outwards.

use rayon::prelude::*;
use splat_core::{Aabb, glam::Vec3};

/// Points in a leaf and boxes in a node.
pub(crate) const WIDTH: usize = 8;

/// Largest number of neighbours.
pub(crate) const MAX_NEIGHBOURS: usize = 32;

/// Boxes waiting to be looked into: at most seven siblings on each of eleven levels (8¹¹ > 2³²), and one node's eight.
pub(crate) const MAX_WAITING: usize = 96;

/// Eight numbers, one for each query, each point of a leaf or each box of a node.
pub(crate) type Lanes = [f32; WIDTH];

/// Points of one leaf by coordinate; places beyond the last point are infinitely far.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    at: [Lanes; 3],
}

/// Boxes of one node by coordinate; boxes beyond the last are infinitely far.
#[derive(Debug, Clone, Copy)]
struct Node {
    min: [Lanes; 3],
    max: [Lanes; 3],
}

impl Leaf {
    fn of(points: &[Vec3], factor: f32) -> Self {
        let mut leaf = Self { at: [[f32::INFINITY; WIDTH]; 3] };
        for (i, p) in points.iter().enumerate() {
            (0..3).for_each(|a| leaf.at[a][i] = p[a] * factor);
        }
        leaf
    }

    #[inline(always)]
    fn bounds(&self) -> [Vec3; 2] {
        let [mut min, mut max] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for axis in 0..3 {
            for v in self.at[axis] {
                min[axis] = min[axis].min(v);
                max[axis] = max[axis].max(if v < f32::INFINITY { v } else { f32::NEG_INFINITY });
            }
        }
        [min, max]
    }
}

impl Node {
    fn of(boxes: &[[Vec3; 2]]) -> Self {
        let mut node = Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3] };
        for (i, [min, max]) in boxes.iter().enumerate() {
            (0..3).for_each(|a| (node.min[a][i], node.max[a][i]) = (min[a], max[a]));
        }
        node
    }

    /// Squared distances of the eight boxes from another; never above those of points in them, rounding included.
    #[inline(always)]
    fn distances_squared(&self, [min, max]: [Vec3; 2]) -> Lanes {
        let mut distances = [0.0; WIDTH];
        for i in 0..WIDTH {
            for a in 0..3 {
                let gap = (self.min[a][i] - max[a]).max(min[a] - self.max[a][i]).max(0.0);
                distances[i] += gap * gap;
            }
        }
        distances
    }

    fn bounds(&self) -> [Vec3; 2] {
        let min = self.min.map(|c| c.into_iter().fold(f32::INFINITY, f32::min));
        let max = self.max.map(|c| c.into_iter().fold(f32::NEG_INFINITY, f32::max));
        [min.into(), max.into()]
    }
}

/// Leaves, and the nodes of all levels, finest first.
pub(crate) struct Tree {
    leaves: Vec<Leaf>,
    levels: Vec<Vec<Node>>,
    points: usize,
}

/// Scratch of a query.
pub(crate) type Stack = [Waiting; MAX_WAITING];

/// A box to look into: a leaf (level 0) or a node of `levels[level − 1]`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Waiting {
    distance_squared: f32,
    level: u32,
    index: u32,
}

/// The nearest so far of the eight points of a leaf: row j has each query's (j + 1)-th neighbour, as a key of squared
/// distance (high bits; floats that are not negative sort as integers) and id (low bits).
pub(crate) struct Nearest {
    rows: [[i64; WIDTH]; MAX_NEIGHBOURS],
    k: usize,
    query: [Lanes; 3],
    bounds: [Vec3; 2],
    /// Bits of the squared distances of the k-th neighbours, and the largest of them.
    limits: [i32; WIDTH],
    limit: f32,
}

/// No neighbour: as far as the places beyond the last point.
const NONE: i64 = (f32::INFINITY.to_bits() as i64) << 32;

impl Default for Nearest {
    fn default() -> Self {
        Self {
            rows: [[NONE; WIDTH]; MAX_NEIGHBOURS],
            k: 0,
            query: [[0.0; WIDTH]; 3],
            bounds: [Vec3::ZERO; 2],
            limits: [i32::MAX; WIDTH],
            limit: f32::INFINITY,
        }
    }
}

impl Tree {
    /// A tree over points in Morton order. Coordinates are scaled by a power of two, so that squares of any extent are
    /// ordinary numbers.
    pub(crate) fn new(points: &[Vec3]) -> Self {
        let bounds = Aabb::of_points(points);
        let extent = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element();
        let exponent = if extent > 0.0 { libm::log2(extent).floor().clamp(-126.0, 126.0) } else { 0.0 };
        let factor = libm::exp2(-exponent) as f32;
        let leaves: Vec<Leaf> = points.par_chunks(WIDTH).with_min_len(512).map(|c| Leaf::of(c, factor)).collect();
        let mut boxes: Vec<[Vec3; 2]> = leaves.par_iter().with_min_len(512).map(Leaf::bounds).collect();
        let mut levels: Vec<Vec<Node>> = Vec::new();
        while boxes.len() > 1 {
            let nodes: Vec<Node> = boxes.par_chunks(WIDTH).with_min_len(64).map(Node::of).collect();
            boxes = nodes.par_iter().with_min_len(64).map(Node::bounds).collect();
            levels.push(nodes);
        }
        Self { leaves, levels, points: points.len() }
    }

    /// The points of leaf `leaf`.
    pub(crate) fn points_of(&self, leaf: usize) -> std::ops::Range<usize> {
        leaf * WIDTH..self.points.min((leaf + 1) * WIDTH)
    }

    /// Finds the `k` ≤ [`MAX_NEIGHBOURS`] points nearest to each point of a leaf, itself excluded.
    // Loops instead of iterators' closures: those would not be compiled for the caller's instruction set.
    #[inline(always)]
    pub(crate) fn nearest(&self, leaf: usize, k: usize, nearest: &mut Nearest, stack: &mut Stack) {
        nearest.ask(&self.leaves[leaf], self.points_of(leaf).len(), k);
        for slot in 0..WIDTH {
            let mut distances = nearest.distances_squared(&self.leaves[leaf], slot);
            distances[slot] = f32::INFINITY;
            nearest.offer(distances, (leaf * WIDTH + slot) as u32);
        }
        nearest.tighten();
        let mut place = leaf;
        for (level, nodes) in self.levels.iter().enumerate() {
            let node = place / WIDTH;
            let own = place % WIDTH;
            let distances = nodes[node].distances_squared(nearest.bounds);
            let waiting = |slot: usize| Waiting {
                distance_squared: distances[slot],
                level: level as u32,
                index: (node * WIDTH + slot) as u32,
            };
            // In Morton order, siblings that differ in the last bits alone are nearest.
            for bits in 1..WIDTH {
                self.look(waiting(own ^ bits), nearest, stack);
            }
            place = node;
        }
    }

    /// Looks into a box that does not hold the leaf.
    #[inline(always)]
    fn look(&self, first: Waiting, nearest: &mut Nearest, stack: &mut Stack) {
        stack[0] = first;
        let mut n = 1;
        while n > 0 {
            n -= 1;
            let Waiting { distance_squared, level, index } = stack[n];
            // Boxes beyond the last are infinitely far, and so is the limit while there are too few neighbours.
            if distance_squared > nearest.limit || distance_squared == f32::INFINITY {
                continue;
            }
            if level == 0 {
                nearest.scan(&self.leaves[index as usize], index as usize);
                continue;
            }
            let distances = self.levels[level as usize - 1][index as usize].distances_squared(nearest.bounds);
            for slot in 0..WIDTH {
                if distances[slot] <= nearest.limit {
                    let index = index * WIDTH as u32 + slot as u32;
                    stack[n] = Waiting { distance_squared: distances[slot], level: level - 1, index };
                    n += 1;
                }
            }
        }
    }
}

impl Nearest {
    #[inline(always)]
    fn ask(&mut self, leaf: &Leaf, points: usize, k: usize) {
        self.k = k.clamp(1, MAX_NEIGHBOURS);
        for row in &mut self.rows[..self.k] {
            *row = [NONE; WIDTH];
        }
        for axis in 0..3 {
            // Lanes without a point ask for the first one again: infinities would give NaN.
            for i in 0..WIDTH {
                self.query[axis][i] = if i < points { leaf.at[axis][i] } else { leaf.at[axis][0] };
            }
        }
        self.bounds = leaf.bounds();
        self.tighten();
    }

    /// The id of neighbour `j`, from near to far, of the leaf's point `slot`; there is one where there are more than j other points.
    #[inline(always)]
    pub(crate) fn id(&self, j: usize, slot: usize) -> u32 {
        self.rows[j][slot] as u32
    }

    /// From one point of a leaf to the eight queries.
    #[inline(always)]
    fn distances_squared(&self, leaf: &Leaf, slot: usize) -> Lanes {
        let [px, py, pz] = leaf.at.map(|c| c[slot]);
        let mut distances = [0.0; WIDTH];
        for i in 0..WIDTH {
            let x = px - self.query[0][i];
            let y = py - self.query[1][i];
            let z = pz - self.query[2][i];
            distances[i] = x * x + y * y + z * z;
        }
        distances
    }

    #[inline(always)]
    fn scan(&mut self, leaf: &Leaf, index: usize) {
        for slot in 0..WIDTH {
            self.offer(self.distances_squared(leaf, slot), (index * WIDTH + slot) as u32);
        }
        self.tighten();
    }

    #[inline(always)]
    fn tighten(&mut self) {
        let mut farthest = 0;
        for i in 0..WIDTH {
            self.limits[i] = (self.rows[self.k - 1][i] >> 32) as i32;
            farthest = farthest.max(self.limits[i]);
        }
        self.limit = f32::from_bits(farthest as u32);
    }

    /// Offers one point to all queries.
    // Integers, minima and signs instead of conditions, and none that is checked: so it becomes vector instructions. Nothing wraps, as keys are
    // not negative.
    #[inline(always)]
    fn offer(&mut self, distances: Lanes, id: u32) {
        let mut keys = [0; WIDTH];
        let mut signs = 0;
        for i in 0..WIDTH {
            let bits = distances[i].to_bits() as i32;
            // Negative where the point is as near as the k-th or nearer.
            signs |= bits.wrapping_sub(self.limits[i]).wrapping_sub(1);
            keys[i] = i64::from(bits) << 32 | i64::from(id);
        }
        if signs >= 0 {
            return;
        }
        let mut j = self.k - 1;
        while j > 0 {
            let above = self.rows[j - 1];
            let row = &mut self.rows[j];
            let mut signs = 0;
            for i in 0..WIDTH {
                row[i] = row[i].min(keys[i]).max(above[i]);
                signs |= keys[i].wrapping_sub(above[i]);
            }
            if signs >= 0 {
                return;
            }
            j -= 1;
        }
        for i in 0..WIDTH {
            self.rows[0][i] = self.rows[0][i].min(keys[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    /// All neighbours of a leaf's point, of `points` points.
    fn ids(nearest: &Nearest, slot: usize, points: usize) -> Vec<u32> {
        (0..nearest.k.min(points - 1)).map(|j| nearest.id(j, slot)).collect()
    }

    fn check(points: &[Vec3], k: usize) {
        let tree = Tree::new(points);
        let mut nearest = Nearest::default();
        let mut stack = [Waiting::default(); MAX_WAITING];
        for i in 0..points.len() {
            let key = |j: usize| (points[i].distance_squared(points[j]).to_bits(), j as u32);
            let mut all: Vec<(u32, u32)> = (0..points.len()).filter(|j| *j != i).map(key).collect();
            all.sort_unstable();
            let expected: Vec<u32> = all.iter().take(k).map(|k| k.1).collect();
            tree.nearest(i / WIDTH, k, &mut nearest, &mut stack);
            assert_eq!(ids(&nearest, i % WIDTH, points.len()), expected);
        }
    }

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        for n in [1usize, 2, 9, 700] {
            let unit = |i: usize, a: u64| rng::unit_f32(3, 0, i as u64, a);
            let points: Vec<Vec3> = (0..n).map(|i| Vec3::new(unit(i, 0), unit(i, 1), 0.1 * unit(i, 2))).collect();
            [1, 10, 32].into_iter().for_each(|k| check(&points, k));
        }
    }

    #[test]
    fn equal_distances_are_ordered_by_id() {
        let mut lattice: Vec<Vec3> =
            (0..343).map(|i| Vec3::new((i % 7) as f32, (i / 7 % 7) as f32, (i / 49) as f32)).collect();
        // Any order is allowed, a bad one makes wide boxes.
        lattice.sort_by_key(|p| rng::bits(5, 0, (p.x + 7.0 * p.y + 49.0 * p.z) as u64, 0));
        [3, 10, 27].into_iter().for_each(|k| check(&lattice, k));
    }

    #[test]
    fn squares_of_tiny_and_huge_distances_do_not_vanish() {
        let points: Vec<Vec3> = (0..40).map(|i| Vec3::new(i as f32, 0.3 * (i * i % 7) as f32, 0.0)).collect();
        let all = |factor: f32| {
            let scaled: Vec<Vec3> = points.iter().map(|p| *p * factor).collect();
            let tree = Tree::new(&scaled);
            let mut nearest = Nearest::default();
            let mut stack = [Waiting::default(); MAX_WAITING];
            let mut of = |i: usize| {
                tree.nearest(i / WIDTH, 5, &mut nearest, &mut stack);
                ids(&nearest, i % WIDTH, 40)
            };
            (0..40).map(&mut of).collect::<Vec<Vec<u32>>>()
        };
        assert_eq!(all(1.0), all(1e-10f32.log2().floor().exp2()));
        assert_eq!(all(1.0), all((-100f32).exp2()));
        assert_eq!(all(1.0), all(100f32.exp2()));
    }
}
