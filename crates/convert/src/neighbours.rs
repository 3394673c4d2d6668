//! The k nearest neighbours of every point: a tree of boxes over points in Morton order.
//!
//! Eight points in Morton order make a leaf, eight boxes of one level a box of the next: no choice of splits, no
//! pointers, built in O(n), and eight distances at a time. A query begins in the point's own leaf, so that its bound is
//! tight at once, and climbs: at each level it looks into those of the seven siblings that are nearer than the k-th
//! neighbour so far.

use rayon::prelude::*;
use splat_core::glam::Vec3;

/// Points in a leaf and boxes in a node.
const WIDTH: usize = 8;

/// Largest number of neighbours.
pub(crate) const MAX_NEIGHBOURS: usize = 32;

/// Eight numbers, one for each point of a leaf or each box of a node.
type Lanes = [f32; WIDTH];

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
    fn of(points: &[Vec3]) -> Self {
        let mut leaf = Self { at: [[f32::INFINITY; WIDTH]; 3] };
        for (i, p) in points.iter().enumerate() {
            (0..3).for_each(|a| leaf.at[a][i] = p[a]);
        }
        leaf
    }

    fn distances_squared(&self, p: Vec3) -> Lanes {
        std::array::from_fn(|i| {
            let (x, y, z) = (self.at[0][i] - p.x, self.at[1][i] - p.y, self.at[2][i] - p.z);
            x * x + y * y + z * z
        })
    }

    fn bounds(&self) -> [Vec3; 2] {
        let min = self.at.map(|c| c.into_iter().fold(f32::INFINITY, f32::min));
        let finite = |c: Lanes| c.into_iter().filter(|v| v.is_finite()).fold(f32::NEG_INFINITY, f32::max);
        [min.into(), self.at.map(finite).into()]
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

    fn distances_squared(&self, p: Vec3) -> Lanes {
        let outside = |a: usize, i: usize, p: f32| (self.min[a][i] - p).max(p - self.max[a][i]).max(0.0);
        std::array::from_fn(|i| {
            let (x, y, z) = (outside(0, i, p.x), outside(1, i, p.y), outside(2, i, p.z));
            x * x + y * y + z * z
        })
    }

    fn bounds(&self) -> [Vec3; 2] {
        let min = self.min.map(|c| c.into_iter().fold(f32::INFINITY, f32::min));
        let max = self.max.map(|c| c.into_iter().fold(f32::NEG_INFINITY, f32::max));
        [min.into(), max.into()]
    }
}

/// Leaves, and the nodes of all levels, finest first.
pub(crate) struct Tree<'a> {
    points: &'a [Vec3],
    leaves: Vec<Leaf>,
    levels: Vec<Vec<Node>>,
}

/// The nearest so far, as keys of squared distance (high bits; positive floats sort as integers) and point id (low
/// bits), so that equal distances have one order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    keys: [u64; MAX_NEIGHBOURS],
    len: usize,
    k: usize,
}

impl Nearest {
    /// Ids from near to far.
    pub(crate) fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        self.keys[..self.len].iter().map(|&k| k as u32)
    }

    /// Squared distance beyond which nothing is of use.
    fn limit(&self) -> f32 {
        if self.len < self.k { f32::MAX } else { f32::from_bits((self.keys[self.k - 1] >> 32) as u32) }
    }

    fn offer(&mut self, key: u64) {
        if self.len == self.k && key >= self.keys[self.k - 1] {
            return;
        }
        let mut at = self.len.min(self.k - 1);
        self.len = (self.len + 1).min(self.k);
        while at > 0 && self.keys[at - 1] > key {
            self.keys[at] = self.keys[at - 1];
            at -= 1;
        }
        self.keys[at] = key;
    }
}

impl<'a> Tree<'a> {
    /// Builds over distinct points in Morton order.
    pub(crate) fn new(points: &'a [Vec3]) -> Self {
        let leaves: Vec<Leaf> = points.par_chunks(WIDTH).with_min_len(512).map(Leaf::of).collect();
        let mut boxes: Vec<[Vec3; 2]> = leaves.par_iter().with_min_len(512).map(Leaf::bounds).collect();
        let mut levels: Vec<Vec<Node>> = Vec::new();
        while boxes.len() > 1 {
            let nodes: Vec<Node> = boxes.par_chunks(WIDTH).with_min_len(64).map(Node::of).collect();
            boxes = nodes.par_iter().with_min_len(64).map(Node::bounds).collect();
            levels.push(nodes);
        }
        Self { points, leaves, levels }
    }

    /// The `k` ≤ [`MAX_NEIGHBOURS`] points nearest to point `i`, itself excluded.
    pub(crate) fn nearest(&self, i: usize, k: usize) -> Nearest {
        let mut nearest = Nearest { keys: [0; MAX_NEIGHBOURS], len: 0, k: k.clamp(1, MAX_NEIGHBOURS) };
        let mut place = i / WIDTH;
        self.scan(place, i, &mut nearest);
        for level in 0..self.levels.len() {
            self.visit(level, place / WIDTH, place % WIDTH, i, &mut nearest);
            place /= WIDTH;
        }
        nearest
    }

    /// Looks into the boxes of a node but for number `skip`.
    fn visit(&self, level: usize, node: usize, skip: usize, i: usize, nearest: &mut Nearest) {
        let distances = self.levels[level][node].distances_squared(self.points[i]);
        for (slot, distance) in distances.into_iter().enumerate() {
            if distance > nearest.limit() || slot == skip {
                continue;
            }
            let below = node * WIDTH + slot;
            if level == 0 {
                self.scan(below, i, nearest);
            } else {
                self.visit(level - 1, below, WIDTH, i, nearest);
            }
        }
    }

    fn scan(&self, leaf: usize, i: usize, nearest: &mut Nearest) {
        let first = leaf * WIDTH;
        let distances = self.leaves[leaf].distances_squared(self.points[i]);
        for (slot, distance) in distances.into_iter().enumerate() {
            if distance <= nearest.limit() && first + slot != i {
                nearest.offer(key(distance, (first + slot) as u32));
            }
        }
    }
}

fn key(distance_squared: f32, id: u32) -> u64 {
    u64::from(distance_squared.to_bits()) << 32 | u64::from(id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        for n in [1usize, 2, 9, 700] {
            let unit = |i: usize, a: u64| rng::unit_f32(3, 0, i as u64, a);
            let points: Vec<Vec3> = (0..n).map(|i| Vec3::new(unit(i, 0), unit(i, 1), 0.1 * unit(i, 2))).collect();
            let tree = Tree::new(&points);
            for i in 0..n {
                let mut all: Vec<u64> =
                    (0..n).filter(|j| *j != i).map(|j| key(points[i].distance_squared(points[j]), j as u32)).collect();
                all.sort_unstable();
                let expected: Vec<u32> = all.iter().take(10).map(|k| *k as u32).collect();
                assert_eq!(tree.nearest(i, 10).ids().collect::<Vec<_>>(), expected);
            }
        }
    }
}
