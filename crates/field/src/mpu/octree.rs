//! The adaptive octree (Ohtake et al. 2003, section 3): a cell whose shape misses the tolerance is divided.
//!
//! A cell of diagonal d has a support ball of radius R = αd around its middle. With fewer than N_min samples in it, the
//! shape is fitted in a larger ball that holds N_min. Such a cell is not divided if its samples are about as far apart as
//! the ball is large, because smaller cells would see the same samples. Subtrees are built in parallel and joined in order.
//!
//! Deviations: the paper divides on unless the ball is empty. It also gives the weight the larger ball, so that shapes
//! of empty cells reach the surface. Here the weight ends at αd, so shapes of empty cells have no weight at
//! samples: the surface is nearer to the samples, and the blend three times as fast.
//!
//! For evaluation each leaf cell lists the functions whose balls meet it, so that a place is answered by one descent and
//! one list, and each node keeps the range of the blend over its cell.

use super::fit::{Ball, Scratch};
use super::quadric::{Joint, Quadric, Shape, shape_over_ball};
use super::samples::SampleTree;
use super::side::Sides;
use super::{MpuReport, Tolerances};
use crate::FieldError;
use crate::error::check_cancelled;
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::glam::DVec3;

/// Levels whose children are built in parallel.
const PARALLEL_LEVELS: u32 = 4;
/// Over the distance of the N_min-th sample, so that it has weight too.
const ENLARGED: f64 = 1.125;
/// Radius of a support with few samples over how far these are apart, above which it only grazes the surface.
const GRAZES: f64 = 2.5;
/// Marks an entry of `Octree::nodes` as a leaf.
const LEAF: u32 = 1 << 31;

/// The kind of a node.
pub(super) enum Node {
    /// Index of the first of eight children; child bits are x, y, z from the lowest.
    Inner(usize),
    /// Index of the leaf and of its function.
    Leaf(usize),
}

/// Where a local function has weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Support {
    pub(super) center: DVec3,
    /// 1/R.
    pub(super) inverse: f64,
}

/// Which pieces a local function has.
#[derive(Debug, Clone, Copy)]
struct Pieces {
    first: u32,
    count: u32,
    joint: Joint,
}

/// The tree and its local functions, relative to the samples' origin.
#[derive(Debug)]
pub(super) struct Octree {
    pub(super) center: DVec3,
    pub(super) half: f64,
    nodes: Vec<u32>,
    /// Range of the blend over the cell of each node.
    ranges: Vec<[f64; 2]>,
    pub(super) supports: Vec<Support>,
    functions: Vec<Pieces>,
    pieces: Vec<Quadric>,
    /// Where the list of each leaf begins in `list`, and its end.
    starts: Vec<u32>,
    list: Vec<u32>,
}

/// A part of the tree while it is built.
enum Part {
    Leaf { support: Support, shape: Shape, error: f64 },
    Inner(Vec<Part>),
}

/// Data that all cells share.
struct Build<'a> {
    tree: &'a SampleTree,
    sides: Sides<'a>,
    asked: &'a Tolerances,
    progress: &'a Progress,
}

/// Middle of child `c` of a cell.
pub(super) fn child_center(center: DVec3, half: f64, c: usize) -> DVec3 {
    let side = |a: usize| if c >> a & 1 == 0 { -0.5 * half } else { 0.5 * half };
    center + DVec3::new(side(0), side(1), side(2))
}

impl Build<'_> {
    fn cell(&self, center: DVec3, half: f64, depth: u32, scratch: &mut Scratch) -> Part {
        if self.progress.is_cancelled() {
            return Part::Inner(Vec::new());
        }
        let before = self.asked.support * half * 12f64.sqrt();
        self.tree.within(center, before, &mut scratch.ids);
        let inside = scratch.ids.len();
        let mut radius = before;
        let support = Support { center, inverse: 1.0 / before };
        if inside < self.asked.samples {
            self.tree.nearest(center, self.asked.samples, &mut scratch.nearest);
            let farthest = scratch.nearest.last().map_or(0.0, |n| n.0.sqrt());
            radius = before.max(ENLARGED * farthest);
            self.tree.within(center, radius, &mut scratch.ids);
        }
        let ball = Ball::new(self.tree, &scratch.ids, center, radius, before);
        let grazes = || inside > 0 && before > GRAZES * self.sides.spacing(scratch.nearest[0].1);
        let last = inside < self.asked.samples && !grazes() || depth >= self.asked.depth;
        if inside == 0 {
            let distance = self.sides.distance(center, &scratch.nearest);
            let shape = ball.beside(distance / radius, scratch.nearest[0].0.sqrt() / radius);
            return Part::Leaf { support, shape: rescaled(shape, radius, before), error: 0.0 };
        }
        match ball.best(self.tree, half, self.asked, last, scratch) {
            Some(fit) if last || fit.error * radius <= self.asked.error => {
                Part::Leaf { support, shape: rescaled(fit.shape, radius, before), error: fit.error * radius }
            }
            _ => Part::Inner(self.children(center, half, depth, scratch)),
        }
    }

    fn children(&self, center: DVec3, half: f64, depth: u32, scratch: &mut Scratch) -> Vec<Part> {
        let child =
            |c: usize, scratch: &mut Scratch| self.cell(child_center(center, half, c), 0.5 * half, depth + 1, scratch);
        if depth < PARALLEL_LEVELS {
            (0..8).into_par_iter().map_init(Scratch::default, |scratch, c| child(c, scratch)).collect()
        } else {
            (0..8).map(|c| child(c, scratch)).collect()
        }
    }
}

/// Values become lengths of the samples' space; the unit of coordinates changes from `radius` to `support`.
fn rescaled(mut shape: Shape, radius: f64, support: f64) -> Shape {
    shape.pieces.iter_mut().for_each(|q| *q = q.rescaled(radius, support / radius));
    shape
}

impl Octree {
    /// Bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let words = size_of_val(self.nodes.as_slice())
            + size_of_val(self.starts.as_slice())
            + size_of_val(self.list.as_slice());
        let leaves = size_of_val(self.supports.as_slice()) + size_of_val(self.functions.as_slice());
        let shapes = size_of_val(self.ranges.as_slice()) + size_of_val(self.pieces.as_slice());
        (words + leaves + shapes) as u64
    }

    /// Builds over a cube.
    pub(super) fn new(
        tree: &SampleTree,
        center: DVec3,
        half: f64,
        asked: &Tolerances,
        progress: &Progress,
    ) -> Result<(Self, MpuReport), FieldError> {
        let build = Build { tree, sides: Sides::new(tree, progress), asked, progress };
        let root = build.cell(center, half, 0, &mut Scratch::default());
        // Cells that were left out have no children.
        check_cancelled(progress)?;
        let mut octree = Self {
            center,
            half,
            nodes: vec![0],
            ranges: Vec::new(),
            supports: Vec::new(),
            functions: Vec::new(),
            pieces: Vec::new(),
            starts: vec![0],
            list: Vec::new(),
        };
        let mut report =
            MpuReport { samples: tree.samples.len() as u64, tolerance: asked.error, ..MpuReport::default() };
        octree.place(root, 0, 0, &mut report);
        let ids: Vec<u32> = (0..octree.supports.len() as u32).collect();
        let cells = octree.cells(0, center, half, 0, &ids);
        octree.ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; octree.nodes.len()];
        for cell in cells {
            octree.list.extend(cell.list);
            octree.starts.push(octree.list.len() as u32);
            octree.ranges[cell.node] = cell.range;
        }
        for node in (0..octree.nodes.len()).rev() {
            if let Node::Inner(first) = octree.node(node) {
                octree.ranges[node] = octree.ranges[first..first + 8].iter().fold(octree.ranges[node], union);
            }
        }
        report.listed = octree.list.len() as u64;
        Ok((octree, report))
    }

    /// Stores a part at `node`; leaves are numbered in the order of a descent.
    fn place(&mut self, part: Part, node: usize, depth: u32, report: &mut MpuReport) {
        match part {
            Part::Leaf { support, shape, error } => {
                self.nodes[node] = LEAF | self.supports.len() as u32;
                self.supports.push(support);
                let first = self.pieces.len() as u32;
                let count = shape.pieces.len() as u32;
                self.functions.push(Pieces { first, count, joint: shape.joint });
                self.pieces.extend(shape.pieces);
                report.leaves += 1;
                report.sharp += u64::from(count > 1);
                report.depth = report.depth.max(depth);
                report.missed += u64::from(error > report.tolerance);
                report.largest_error = report.largest_error.max(error);
            }
            Part::Inner(children) => {
                let first = self.nodes.len();
                self.nodes[node] = first as u32;
                self.nodes.resize(first + 8, 0);
                for (c, child) in children.into_iter().enumerate() {
                    self.place(child, first + c, depth + 1, report);
                }
            }
        }
    }

    pub(super) fn node(&self, i: usize) -> Node {
        let entry = self.nodes[i];
        if entry & LEAF == 0 { Node::Inner(entry as usize) } else { Node::Leaf((entry & !LEAF) as usize) }
    }

    pub(super) fn range(&self, node: usize) -> [f64; 2] {
        self.ranges[node]
    }

    /// Functions that may have weight in the cell of a leaf.
    pub(super) fn listed(&self, leaf: usize) -> &[u32] {
        &self.list[self.starts[leaf] as usize..self.starts[leaf + 1] as usize]
    }

    /// The pieces of a function and their joint.
    #[inline]
    pub(super) fn function(&self, i: u32) -> (&[Quadric], Joint) {
        let Pieces { first, count, joint } = self.functions[i as usize];
        (&self.pieces[first as usize..(first + count) as usize], joint)
    }

    /// Lists and ranges of the leaves below a node, of the functions whose balls meet the parent's cell.
    fn cells(&self, node: usize, center: DVec3, half: f64, depth: u32, candidates: &[u32]) -> Vec<Cell> {
        let meets = |id: &u32| {
            let s = &self.supports[*id as usize];
            let gap = ((s.center - center).abs() - DVec3::splat(half)).max(DVec3::ZERO);
            // One part in a million more: rounding must not cut a ball off.
            gap.length_squared() * s.inverse * s.inverse <= 1.0 + 1e-6
        };
        let list: Vec<u32> = candidates.iter().copied().filter(meets).collect();
        let Node::Inner(first) = self.node(node) else {
            let range = list.iter().map(|id| self.over_cell(*id, center, half)).fold(EMPTY, |a, b| union(a, &b));
            return vec![Cell { node, list, range }];
        };
        let child = |c: usize| self.cells(first + c, child_center(center, half, c), 0.5 * half, depth + 1, &list);
        if depth < PARALLEL_LEVELS {
            (0..8).into_par_iter().flat_map_iter(child).collect()
        } else {
            (0..8).flat_map(child).collect()
        }
    }

    /// Range of a function over the part of its ball that lies in a cell.
    fn over_cell(&self, id: u32, center: DVec3, half: f64) -> [f64; 2] {
        let s = &self.supports[id as usize];
        let (pieces, joint) = self.function(id);
        // A little beyond the corners of the cell, for rounding.
        let cell = shape_over_ball(pieces, joint, (center - s.center) * s.inverse, 1.7321 * half * s.inverse).0;
        let ball = shape_over_ball(pieces, joint, DVec3::ZERO, 1.0).0;
        [cell[0].max(ball[0]), cell[1].min(ball[1])]
    }
}

/// One leaf's list and range.
struct Cell {
    node: usize,
    list: Vec<u32>,
    range: [f64; 2],
}

pub(super) const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

pub(super) fn union(a: [f64; 2], b: &[f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}
