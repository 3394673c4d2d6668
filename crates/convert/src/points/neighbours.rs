//! The k nearest neighbours of every point: a tree of boxes over points, asked by eight at a time.
//!
//! Points are halved by planes across the longest side of what holds them, down to leaves of eight, so boxes adapt to the points' density and
//! hardly overlap; eight boxes of one level make a box of the next, without pointers, in O(n log n). The eight points of a leaf lie close
//! together and so do their neighbours: a query serves all eight at once, a lane each. A query begins in its own leaf, so that its bound is tight
//! at once, and climbs: at each level it looks into those of the seven siblings whose box is nearer to the leaf's box than the farthest k-th
//! neighbour so far, and nearer to one of the eight points than that point's own. Each candidate is compared with eight queries; the k nearest of
//! each are rows of lanes that a nearer candidate moves outwards. Of candidates as near as each other that with the least id counts as nearer, so
//! boxes know their least ids: a point far out sees thousands of others at one distance, as far as f32 can tell.
//!
//! Squares of distances are ordinary numbers of f32 within 2⁻⁴⁸ of the extent and the extent. Points whose neighbours lie nearer ask again, in
//! finer units.

use rayon::prelude::*;
use splat_core::{Aabb, Progress, glam::Vec3};

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

/// The box around the points of a leaf or of a node.
#[derive(Debug, Clone, Copy)]
struct Box3 {
    bounds: Aabb,
    /// The least id of its points.
    first: u32,
}

/// Boxes of one node by coordinate; boxes beyond the last are infinitely far.
#[derive(Debug, Clone, Copy)]
struct Node {
    min: [Lanes; 3],
    max: [Lanes; 3],
    /// The least id in each.
    first: [u32; WIDTH],
}

/// A point on its way to its leaf.
#[derive(Debug, Clone, Copy)]
struct Placed {
    at: Vec3,
    id: u32,
}

/// Puts points, at most `room`, a power of two, in the order of leaves: each half of the room holds those before a plane, or those behind it.
fn arrange(points: &mut [Placed], room: usize, progress: &Progress) {
    /// Fewer points are no task of their own.
    const TASK: usize = 1 << 12;
    let half = room / 2;
    if points.len() <= WIDTH {
        return;
    }
    if points.len() <= half {
        return arrange(points, half, progress);
    }
    let mut bounds = Aabb::EMPTY;
    for point in &*points {
        bounds.min = bounds.min.min(point.at);
        bounds.max = bounds.max.max(point.at);
    }
    // Halves, because the whole of the largest numbers is none.
    let axis = (bounds.max * 0.5 - bounds.min * 0.5).max_position();
    points.select_nth_unstable_by(half, |a, b| a.at[axis].total_cmp(&b.at[axis]).then(a.id.cmp(&b.id)));
    let is_task = points.len() >= TASK;
    if is_task && progress.is_cancelled() {
        return;
    }
    let (before, behind) = points.split_at_mut(half);
    if is_task {
        rayon::join(|| arrange(before, half, progress), || arrange(behind, half, progress));
    } else {
        arrange(before, half, progress);
        arrange(behind, half, progress);
    }
}

impl Leaf {
    fn new(points: &[Placed]) -> Self {
        let mut leaf = Self { at: [[f32::INFINITY; WIDTH]; 3] };
        for (i, point) in points.iter().enumerate() {
            (0..3).for_each(|a| leaf.at[a][i] = point.at[a]);
        }
        leaf
    }

    /// The box around the points that `counts` picks.
    #[inline(always)]
    fn bounds(&self, counts: &[bool; WIDTH]) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for axis in 0..3 {
            for i in 0..WIDTH {
                let at = self.at[axis][i];
                let low = if counts[i] { at } else { f32::INFINITY };
                let high = if counts[i] && at < f32::INFINITY { at } else { f32::NEG_INFINITY };
                bounds.min[axis] = bounds.min[axis].min(low);
                bounds.max[axis] = bounds.max[axis].max(high);
            }
        }
        bounds
    }
}

impl Node {
    fn new(boxes: &[Box3]) -> Self {
        let mut node =
            Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3], first: [u32::MAX; WIDTH] };
        for (i, Box3 { bounds, first }) in boxes.iter().enumerate() {
            (0..3).for_each(|a| (node.min[a][i], node.max[a][i]) = (bounds.min[a], bounds.max[a]));
            node.first[i] = *first;
        }
        node
    }

    /// Squared distances of the eight boxes from another, in units of 1/`unit`; never above those of points in them, rounding included.
    #[inline(always)]
    fn distances_squared(&self, from: &Aabb, unit: f32) -> Lanes {
        let mut distances = [0.0; WIDTH];
        for i in 0..WIDTH {
            for a in 0..3 {
                let gap = (self.min[a][i] - from.max[a]).max(from.min[a] - self.max[a][i]).max(0.0) * unit;
                distances[i] += gap * gap;
            }
        }
        distances
    }

    fn whole(&self) -> Box3 {
        let min = self.min.map(|c| c.into_iter().fold(f32::INFINITY, f32::min));
        let max = self.max.map(|c| c.into_iter().fold(f32::NEG_INFINITY, f32::max));
        let first = self.first.into_iter().fold(u32::MAX, u32::min);
        Box3 { bounds: Aabb { min: min.into(), max: max.into() }, first }
    }
}

/// Leaves, and the nodes of all levels, finest first.
pub(crate) struct Tree {
    leaves: Vec<Leaf>,
    levels: Vec<Vec<Node>>,
    points: usize,
    /// The ids of the points leaf by leaf.
    order: Vec<u32>,
    /// Factor that makes the largest difference of coordinates about 1.
    unit: f32,
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
    /// The points that ask; the others are not answered.
    asks: [bool; WIDTH],
    /// Of the points that ask.
    bounds: Aabb,
    /// Factor that differences of coordinates are multiplied by.
    unit: f32,
    /// Bits of the squared distances of the k-th neighbours, −1 for a point that does not ask, and the largest of these distances.
    limits: [i32; WIDTH],
    limit: f32,
    /// The answers, by row.
    found: [[u32; WIDTH]; MAX_NEIGHBOURS],
}

/// No neighbour: as far as the places beyond the last point.
const NONE: i64 = (f32::INFINITY.to_bits() as i64) << 32;

/// Below this square of a distance parts of it may lie below the ordinary numbers of f32.
const FINE: f32 = 1.0 / (1u128 << 96) as f32;

/// By how much finer units are: distances below [`FINE`] stay far below the largest number.
const FINER: f32 = (1u64 << 60) as f32;

/// The finest of them.
const FINEST: f32 = f32::from_bits(253 << 23);

impl Default for Nearest {
    fn default() -> Self {
        Self {
            rows: [[NONE; WIDTH]; MAX_NEIGHBOURS],
            k: 0,
            query: [[0.0; WIDTH]; 3],
            asks: [false; WIDTH],
            bounds: Aabb::EMPTY,
            unit: 1.0,
            limits: [i32::MAX; WIDTH],
            limit: f32::INFINITY,
            found: [[0; WIDTH]; MAX_NEIGHBOURS],
        }
    }
}

impl Tree {
    /// A tree over points, whose ids are their places. Where `progress` is cancelled it finds others than the nearest.
    pub(crate) fn new(points: &[Vec3], progress: &Progress) -> Self {
        let bounds = Aabb::of_points(points);
        let extent = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element();
        let exponent = if extent > 0.0 { libm::log2(extent).floor().clamp(-126.0, 126.0) } else { 0.0 };
        // Powers of two, which round nothing. Differences of any two coordinates in leaves and boxes are finite.
        let stored = if exponent >= 126.0 { 0.25 } else { 1.0 };
        let unit = libm::exp2(-exponent) as f32 / stored;
        let placed = |(id, at): (usize, &Vec3)| Placed { at: *at * stored, id: id as u32 };
        let mut placed: Vec<Placed> = points.par_iter().enumerate().with_min_len(4096).map(placed).collect();
        arrange(&mut placed, points.len().next_power_of_two(), progress);
        let leaves: Vec<Leaf> = placed.par_chunks(WIDTH).with_min_len(512).map(Leaf::new).collect();
        let whole = |(leaf, points): (&Leaf, &[Placed])| Box3 {
            bounds: leaf.bounds(&[true; WIDTH]),
            first: points.iter().map(|point| point.id).min().unwrap_or_default(),
        };
        let of_leaves = leaves.par_iter().zip(placed.par_chunks(WIDTH)).with_min_len(512);
        let mut boxes: Vec<Box3> = of_leaves.map(whole).collect();
        let order: Vec<u32> = placed.par_iter().with_min_len(4096).map(|point| point.id).collect();
        drop(placed);
        let mut levels: Vec<Vec<Node>> = Vec::new();
        while boxes.len() > 1 {
            let nodes: Vec<Node> = boxes.par_chunks(WIDTH).with_min_len(64).map(Node::new).collect();
            boxes = nodes.par_iter().with_min_len(64).map(Node::whole).collect();
            levels.push(nodes);
        }
        Self { leaves, levels, points: points.len(), order, unit }
    }

    /// The point at `slot`, counted leaf by leaf.
    #[inline(always)]
    pub(crate) fn point(&self, slot: usize) -> usize {
        self.order[slot] as usize
    }

    /// Puts results, `of_each` a point, from the order of leaves into that of points.
    pub(crate) fn by_point<T: Copy + Default + Send + Sync>(&self, by_slot: Vec<T>, of_each: usize) -> Vec<T> {
        if of_each == 0 {
            return by_slot;
        }
        let mut slots = vec![0u32; self.points];
        self.order.iter().enumerate().for_each(|(slot, point)| slots[*point as usize] = slot as u32);
        let mut by_point = vec![T::default(); by_slot.len()];
        by_point.par_chunks_mut(of_each).zip(&slots).with_min_len(1 << 12).for_each(|(items, slot)| {
            let first = *slot as usize * of_each;
            items.copy_from_slice(&by_slot[first..first + of_each]);
        });
        by_point
    }

    /// The places of leaf `leaf`, see [`Tree::point`].
    pub(crate) fn slots_of(&self, leaf: usize) -> std::ops::Range<usize> {
        leaf * WIDTH..self.points.min((leaf + 1) * WIDTH)
    }

    /// Finds the `k` ≤ [`MAX_NEIGHBOURS`] points nearest to each point of a leaf, itself excluded.
    // Loops instead of iterators' closures: those would not be compiled for the caller's instruction set.
    #[inline(always)]
    pub(crate) fn nearest(&self, leaf: usize, k: usize, nearest: &mut Nearest, stack: &mut Stack) {
        let slots = self.slots_of(leaf).len();
        let mut asks = [false; WIDTH];
        for slot in 0..slots {
            asks[slot] = true;
        }
        let mut unit = self.unit;
        loop {
            nearest.ask(&self.leaves[leaf], asks, k, unit);
            self.search(leaf, nearest, stack);
            asks = nearest.answer(self.points - 1);
            let finer = (unit * FINER).min(FINEST);
            if asks == [false; WIDTH] || finer == unit {
                return;
            }
            unit = finer;
        }
    }

    #[inline(always)]
    fn search(&self, leaf: usize, nearest: &mut Nearest, stack: &mut Stack) {
        for slot in 0..WIDTH {
            let mut distances = nearest.distances_squared(&self.leaves[leaf], slot);
            distances[slot] = f32::INFINITY;
            nearest.offer(distances, self.id(leaf * WIDTH + slot));
        }
        nearest.tighten();
        let mut place = leaf;
        for (level, nodes) in self.levels.iter().enumerate() {
            let node = place / WIDTH;
            let home = place % WIDTH;
            let distances = nodes[node].distances_squared(&nearest.bounds, nearest.unit);
            // Siblings that differ in the last bits alone are nearest.
            for bits in 1..WIDTH {
                let slot = home ^ bits;
                let index = (node * WIDTH + slot) as u32;
                self.look(Waiting { distance_squared: distances[slot], level: level as u32, index }, nearest, stack);
            }
            place = node;
        }
    }

    /// The id of the point at `slot`; any number beyond the last.
    #[inline(always)]
    fn id(&self, slot: usize) -> u32 {
        if slot < self.order.len() { self.order[slot] } else { slot as u32 }
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
            let holder = &self.levels[level as usize][index as usize / WIDTH];
            if !nearest.may_lie_in(holder, index as usize % WIDTH) {
                continue;
            }
            if level == 0 {
                self.scan(index as usize, nearest);
                continue;
            }
            let distances =
                self.levels[level as usize - 1][index as usize].distances_squared(&nearest.bounds, nearest.unit);
            // The stack gives back the last box first: so the nearest one goes on last, and before it those with the least ids.
            let mut nearest_slot = 0;
            for slot in 1..WIDTH {
                if distances[slot] < distances[nearest_slot] {
                    nearest_slot = slot;
                }
            }
            let waiting = |slot: usize| {
                let index = index * WIDTH as u32 + slot as u32;
                Waiting { distance_squared: distances[slot], level: level - 1, index }
            };
            for slot in (0..WIDTH).rev() {
                if distances[slot] <= nearest.limit && slot != nearest_slot {
                    stack[n] = waiting(slot);
                    n += 1;
                }
            }
            stack[n] = waiting(nearest_slot);
            n += 1;
        }
    }

    #[inline(always)]
    fn scan(&self, leaf: usize, nearest: &mut Nearest) {
        for slot in 0..WIDTH {
            let distances = nearest.distances_squared(&self.leaves[leaf], slot);
            nearest.offer(distances, self.id(leaf * WIDTH + slot));
        }
        nearest.tighten();
    }
}

impl Nearest {
    #[inline(always)]
    fn ask(&mut self, leaf: &Leaf, asks: [bool; WIDTH], k: usize, unit: f32) {
        self.k = k.clamp(1, MAX_NEIGHBOURS);
        self.unit = unit;
        self.asks = asks;
        for row in &mut self.rows[..self.k] {
            *row = [NONE; WIDTH];
        }
        for axis in 0..3 {
            // Lanes without a point ask for the first one again: infinities would give NaN.
            for i in 0..WIDTH {
                let at = leaf.at[axis][i];
                self.query[axis][i] = if at < f32::INFINITY { at } else { leaf.at[axis][0] };
            }
        }
        self.bounds = leaf.bounds(&asks);
        self.tighten();
    }

    /// Keeps what was found for the points that asked, of `others` other points; gives those that have to ask in finer units.
    #[inline(always)]
    fn answer(&mut self, others: usize) -> [bool; WIDTH] {
        let count = self.k.min(others);
        let mut again = [false; WIDTH];
        for row in 0..count {
            for i in 0..WIDTH {
                self.found[row][i] = if self.asks[i] { self.rows[row][i] as u32 } else { self.found[row][i] };
            }
        }
        if count > 0 {
            for i in 0..WIDTH {
                let farthest = f32::from_bits((self.rows[count - 1][i] >> 32) as u32);
                again[i] = self.asks[i] && farthest < FINE;
            }
        }
        again
    }

    /// The id of neighbour `j`, from near to far, of the leaf's point `slot`; there is one where there are more than j other points.
    #[inline(always)]
    pub(crate) fn id(&self, j: usize, slot: usize) -> u32 {
        self.found[j][slot]
    }

    /// From one point of a leaf to the eight queries.
    #[inline(always)]
    fn distances_squared(&self, leaf: &Leaf, slot: usize) -> Lanes {
        let [px, py, pz] = leaf.at.map(|c| c[slot]);
        let mut distances = [0.0; WIDTH];
        for i in 0..WIDTH {
            let x = (px - self.query[0][i]) * self.unit;
            let y = (py - self.query[1][i]) * self.unit;
            let z = (pz - self.query[2][i]) * self.unit;
            distances[i] = x * x + y * y + z * z;
        }
        distances
    }

    /// Whether a box of a node may hold a neighbour of one of the points that ask: one with its least id at its nearest place would be.
    #[inline(always)]
    fn may_lie_in(&self, node: &Node, slot: usize) -> bool {
        let mut distances = [0.0; WIDTH];
        for axis in 0..3 {
            let min = node.min[axis][slot];
            let max = node.max[axis][slot];
            for i in 0..WIDTH {
                let at = self.query[axis][i];
                let gap = (min - at).max(at - max).max(0.0) * self.unit;
                distances[i] += gap * gap;
            }
        }
        // Negative where the box is nearer than the k-th, and where it is as near or nearer.
        let mut nearer = 0;
        let mut as_near = 0;
        for i in 0..WIDTH {
            let over = (distances[i].to_bits() as i32).wrapping_sub(self.limits[i]);
            nearer |= over;
            as_near |= over.wrapping_sub(1);
        }
        if nearer < 0 || as_near >= 0 {
            return nearer < 0;
        }
        let first = i64::from(node.first[slot]);
        let mut precedes = false;
        for i in 0..WIDTH {
            let key = i64::from(distances[i].to_bits()) << 32 | first;
            precedes |= self.asks[i] && key < self.rows[self.k - 1][i];
        }
        precedes
    }

    #[inline(always)]
    fn tighten(&mut self) {
        let mut farthest = 0;
        for i in 0..WIDTH {
            let limit = (self.rows[self.k - 1][i] >> 32) as i32;
            self.limits[i] = if self.asks[i] { limit } else { -1 };
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
    use splat_core::{glam, rng};

    /// All neighbours of a leaf's point, of `points` points.
    fn ids(nearest: &Nearest, slot: usize, points: usize) -> Vec<u32> {
        (0..nearest.k.min(points - 1)).map(|j| nearest.id(j, slot)).collect()
    }

    /// The ids of the points nearest to one, by distances in f64.
    fn by_brute_force(points: &[Vec3], i: usize, k: usize) -> Vec<u32> {
        let key = |j: usize| {
            let square = points[i].as_dvec3().distance_squared(points[j].as_dvec3());
            (square.to_bits(), j as u32)
        };
        let mut keys: Vec<(u64, u32)> = (0..points.len()).filter(|j| *j != i).map(key).collect();
        keys.sort_unstable();
        keys.iter().take(k).map(|key| key.1).collect()
    }

    /// All neighbours of each point.
    fn by_tree(points: &[Vec3], k: usize) -> Vec<Vec<u32>> {
        let tree = Tree::new(points, &Progress::new());
        let mut nearest = Nearest::default();
        let mut stack = [Waiting::default(); MAX_WAITING];
        let mut found = vec![Vec::new(); points.len()];
        for leaf in 0..points.len().div_ceil(WIDTH) {
            tree.nearest(leaf, k, &mut nearest, &mut stack);
            for slot in tree.slots_of(leaf) {
                found[tree.point(slot)] = ids(&nearest, slot % WIDTH, points.len());
            }
        }
        found
    }

    fn check(points: &[Vec3], k: usize) {
        for (i, found) in by_tree(points, k).into_iter().enumerate() {
            let key = |j: usize| (points[i].distance_squared(points[j]).to_bits(), j as u32);
            let mut keys: Vec<(u32, u32)> = (0..points.len()).filter(|j| *j != i).map(key).collect();
            keys.sort_unstable();
            let expected: Vec<u32> = keys.iter().take(k).map(|key| key.1).collect();
            assert_eq!(found, expected, "point {i}, {k} neighbours");
        }
    }

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        for n in [1usize, 2, 9, 64, 65, 700] {
            let unit = |i: usize, a: u64| rng::unit_f32(3, 0, i as u64, a);
            let points: Vec<Vec3> = (0..n).map(|i| Vec3::new(unit(i, 0), unit(i, 1), 0.1 * unit(i, 2))).collect();
            [1, 10, 32].into_iter().for_each(|k| check(&points, k));
        }
    }

    #[test]
    fn equal_distances_are_ordered_by_id() {
        let mut lattice: Vec<Vec3> =
            (0..343).map(|i| Vec3::new((i % 7) as f32, (i / 7 % 7) as f32, (i / 49) as f32)).collect();
        lattice.sort_by_key(|p| rng::bits(5, 0, (p.x + 7.0 * p.y + 49.0 * p.z) as u64, 0));
        [3, 10, 27].into_iter().for_each(|k| check(&lattice, k));
        let line: Vec<Vec3> = lattice.iter().map(|p| Vec3::X * (p.x + 7.0 * p.y + 49.0 * p.z)).collect();
        [3, 10, 27].into_iter().for_each(|k| check(&line, k));
        let same = vec![Vec3::ONE; 100];
        [3, 10, 27].into_iter().for_each(|k| check(&same, k));
    }

    /// A point that sees all others at one distance, as far as f32 tells, has those with the least ids.
    #[test]
    fn a_point_far_out_has_the_first_of_those_at_one_distance() {
        let unit = |i: usize, a: u64| rng::unit_f32(19, 0, i as u64, a);
        let mut points: Vec<Vec3> = (0..600).map(|i| Vec3::new(unit(i, 0), unit(i, 1), unit(i, 2))).collect();
        points.insert(300, Vec3::new(1e20, 3e19, -1e20));
        assert_eq!(by_tree(&points, 5)[300], [0, 1, 2, 3, 4]);
    }

    /// Scales from 10⁻³⁰ to 10³⁷ beside each other: squares of distances have no common unit in f32.
    #[test]
    fn clusters_of_all_scales_find_what_f64_finds() {
        let unit = |i: usize, a: u64| rng::unit(23, 0, i as u64, a) - 0.5;
        let point = |i: usize| {
            let scale = 10f64.powi(-30 + (i % 12) as i32 * 6);
            let place = glam::DVec3::new(unit(i, 0), unit(i, 1), unit(i, 2)) * scale;
            (place + glam::DVec3::X * 3.0 * scale).as_vec3()
        };
        let points: Vec<Vec3> = (0..600).map(point).collect();
        for (i, found) in by_tree(&points, 8).into_iter().enumerate() {
            let expected = by_brute_force(&points, i, 8);
            let square = |j: u32| points[i].as_dvec3().distance_squared(points[j as usize].as_dvec3());
            for (found, expected) in found.into_iter().zip(expected) {
                let ratio = square(found) / square(expected);
                // As near but for the rounding of f32.
                assert!((ratio - 1.0).abs() < 1e-5, "point {i}: {found} for {expected}, {ratio}");
            }
        }
    }

    #[test]
    fn squares_of_tiny_and_huge_distances_do_not_vanish() {
        let points: Vec<Vec3> = (0..40).map(|i| Vec3::new(i as f32, 0.3 * (i * i % 7) as f32, 0.0)).collect();
        let neighbours = |factor: f32| {
            let scaled: Vec<Vec3> = points.iter().map(|p| *p * factor).collect();
            by_tree(&scaled, 5)
        };
        assert_eq!(neighbours(1.0), neighbours(1e-10f32.log2().floor().exp2()));
        assert_eq!(neighbours(1.0), neighbours((-100f32).exp2()));
        assert_eq!(neighbours(1.0), neighbours(100f32.exp2()));
    }
}
