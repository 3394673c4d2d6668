//! Points with normals in the order of a tree, which finds their neighbours.
//!
//! Samples are sorted by place and normal, so neither the order of the input nor exact copies matter. The tree halves
//! them at the median along the longest side of their box until sixteen are left; node i has the children 2i and 2i + 1.

use rayon::prelude::*;
use splat_core::{DAabb, glam::DVec3};
use std::cmp::Ordering;
use std::ops::Range;

/// Samples in a leaf of the tree, at most.
const LEAF: usize = 16;

/// A point of the surface and its unit normal, outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSample {
    /// Its place.
    pub position: DVec3,
    /// The normal, of length 1.
    pub normal: DVec3,
}

fn order(a: &SurfaceSample, b: &SurfaceSample) -> Ordering {
    let key = |s: &SurfaceSample| [s.position, s.normal].map(|v| v.to_array());
    let a = key(a);
    let b = key(b);
    a.iter().flatten().zip(b.iter().flatten()).fold(Ordering::Equal, |o, (x, y)| o.then(x.total_cmp(y)))
}

/// The samples sorted, without copies.
pub(super) fn in_order(mut samples: Vec<SurfaceSample>) -> Vec<SurfaceSample> {
    // Adding 0 makes one zero of two.
    samples.par_iter_mut().for_each(|sample| {
        sample.position += DVec3::ZERO;
        sample.normal += DVec3::ZERO;
    });
    samples.par_sort_unstable_by(order);
    samples.dedup();
    samples
}

/// Samples that can be asked for neighbours.
pub(super) struct SampleTree {
    pub(super) samples: Vec<SurfaceSample>,
    /// The box of each node; entry 0 is not used.
    boxes: Vec<DAabb>,
}

/// The box of some samples.
pub(super) fn box_of(samples: &[SurfaceSample]) -> DAabb {
    DAabb::of_points(samples.iter().map(|s| s.position))
}

impl SampleTree {
    /// Over at least one sample.
    pub(super) fn new(mut samples: Vec<SurfaceSample>) -> Self {
        let leaves = samples.len().div_ceil(LEAF).next_power_of_two();
        halve(&mut samples, leaves);
        let mut boxes = vec![DAabb::EMPTY; 2 * leaves];
        for node in (1..2 * leaves).rev() {
            boxes[node] = if node >= leaves {
                let (from, to) = range(node, samples.len());
                box_of(&samples[from..to])
            } else {
                boxes[2 * node].union(boxes[2 * node + 1])
            };
        }
        Self { samples, boxes }
    }

    /// One more than the last node; the children of node i are 2i and 2i + 1, as long as there are such.
    pub(super) fn nodes(&self) -> usize {
        self.boxes.len()
    }

    /// The samples of a node from 1 on; all for 0.
    pub(super) fn span(&self, node: usize) -> Range<usize> {
        let (from, to) = range(node.max(1), self.samples.len());
        from..to
    }

    /// Calls `leaf` with the samples of each leaf that is nearer to `p` than `limit(state)`, nearer halves first.
    fn visit<S>(&self, p: DVec3, state: &mut S, limit: fn(&S) -> f64, leaf: &mut impl FnMut(&mut S, usize, usize)) {
        let leaves = self.boxes.len() / 2;
        let mut stack = [(0.0f64, 0usize); 64];
        stack[0] = (self.boxes[1].distance_squared(p), 1);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (distance, node) = stack[top];
            if distance > limit(state) {
                continue;
            }
            if node >= leaves {
                let (from, to) = range(node, self.samples.len());
                leaf(state, from, to);
                continue;
            }
            let child = |c: usize| (self.boxes[c].distance_squared(p), c);
            let a = child(2 * node);
            let b = child(2 * node + 1);
            (stack[top], stack[top + 1]) = if a.0 <= b.0 { (b, a) } else { (a, b) };
            top += 2;
        }
    }

    /// Ids of the samples within `radius` of `p`, ascending.
    pub(super) fn within(&self, p: DVec3, radius: f64, ids: &mut Vec<u32>) {
        ids.clear();
        let limit = radius * radius;
        self.visit(p, &mut (limit, &mut *ids), |s| s.0, &mut |s, from, to| {
            s.1.extend((from..to).filter(|i| self.samples[*i].position.distance_squared(p) <= limit).map(|i| i as u32));
        });
        ids.sort_unstable();
    }

    /// The `k` samples nearest to `p` as (squared distance, id), near to far; equal distances by id.
    pub(super) fn nearest(&self, p: DVec3, k: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        let limit = |s: &(usize, &mut Vec<(f64, u32)>)| if s.1.len() < s.0 { f64::INFINITY } else { s.1[s.0 - 1].0 };
        self.visit(p, &mut (k, &mut *found), limit, &mut |s, from, to| {
            for i in from..to {
                let entry = (self.samples[i].position.distance_squared(p), i as u32);
                if s.1.len() == k && entry >= s.1[k - 1] {
                    continue;
                }
                let at = s.1.partition_point(|e| *e < entry);
                s.1.truncate(k - 1);
                s.1.insert(at.min(s.1.len()), entry);
            }
        });
    }
}

/// First and one past the last sample of a leaf or node.
fn range(node: usize, samples: usize) -> (usize, usize) {
    let level = node.ilog2();
    let mut from = 0;
    let mut to = samples;
    for bit in (0..level).rev() {
        let middle = from + (to - from) / 2;
        if node >> bit & 1 == 0 { to = middle } else { from = middle }
    }
    (from, to)
}

fn halve(samples: &mut [SurfaceSample], leaves: usize) {
    if leaves < 2 {
        return;
    }
    let side = box_of(samples).size();
    let axis = (0..3).fold(0, |best, a| if side[a] > side[best] { a } else { best });
    let middle = samples.len() / 2;
    samples.select_nth_unstable_by(middle, |a, b| a.position[axis].total_cmp(&b.position[axis]).then(order(a, b)));
    let (left, right) = samples.split_at_mut(middle);
    rayon::join(|| halve(left, leaves / 2), || halve(right, leaves / 2));
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    #[test]
    fn the_tree_finds_what_brute_force_finds() {
        for n in [1usize, 17, 700] {
            let unit = |i: usize, a: u64| rng::unit(3, 0, i as u64, a);
            let sample =
                |i| SurfaceSample { position: DVec3::new(unit(i, 0), unit(i, 1), 0.1 * unit(i, 2)), normal: DVec3::Z };
            let tree = SampleTree::new((0..n).map(sample).collect());
            let mut ids = Vec::new();
            let mut found = Vec::new();
            for i in 0..50 {
                let p = sample(1000 + i).position * 1.5;
                let mut distances: Vec<(f64, u32)> =
                    (0..n).map(|j| (tree.samples[j].position.distance_squared(p), j as u32)).collect();
                tree.within(p, 0.4, &mut ids);
                let expected: Vec<u32> = distances.iter().filter(|e| e.0 <= 0.4 * 0.4).map(|e| e.1).collect();
                assert_eq!(ids, expected);
                distances.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                distances.truncate(9);
                tree.nearest(p, 9, &mut found);
                assert_eq!(found, distances);
            }
        }
    }
}
