//! The distance and the side of a place without samples (a deviation: the paper fits a shape there too).
//!
//! A shape that is fitted to samples elsewhere is unreliable here. Beside the rim of a thin sheet and beyond the tip of a
//! horn their normals point aside, and a wrong sign makes a bubble of surface. So the sign is taken from the samples
//! themselves. The nearest samples vote with n·(x − p), weighed by a Gaussian of their distance beyond the nearest. A vote that
//! is small beside their distance means that x lies beside them, not above or below. Then the winding number of all samples decides
//!
//! w = Σ aᵢ nᵢ·(pᵢ − x)/(4π|pᵢ − x|³), aᵢ the area of a sample,
//!
//! which is 1 inside and 0 outside of a closed surface, and ½ behind and −½ before an open one. Its mean at the samples
//! shows whether the surface is closed or open. Samples far off count together (Barill, Dickson, Schmidt, Levin and Jacobson
//! 2018, the first term of their series).

use super::samples::SampleTree;
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::glam::DVec3;
use std::f64::consts::PI;

/// Neighbours by which a sample knows its area.
const AROUND: usize = 6;
/// Cosine of the angle between normals down to which samples are of one side of a thin sheet.
const ONE_SIDE: f64 = -0.5;
/// n·(x − p) over the distance, above which the nearest samples know the side.
const SURE: f64 = 0.5;
/// Samples that are asked whether the surface is closed, at most about.
const ASKED: usize = 4096;
/// Radii from the middle of some samples beyond which they count together.
const APART: f64 = 2.0;

/// Samples that count together.
#[derive(Debug, Clone, Copy, Default)]
struct Patch {
    middle: DVec3,
    /// Σ aᵢ nᵢ.
    area: DVec3,
    radius: f64,
}

/// Samples that can be asked for distance and side.
pub(super) struct Sides<'a> {
    tree: &'a SampleTree,
    areas: Vec<f64>,
    /// One for each node of the tree.
    patches: Vec<Patch>,
    /// w of the surface: ½ where it is closed, −½ where its normals point inwards, 0 where it is open.
    level: f64,
}

/// d/|d|³ times `area`, which may be as large as |d|² is; 0 at d = 0.
fn flux(area: DVec3, d: DVec3) -> f64 {
    let squared = d.length_squared();
    if squared > 0.0 { (area / squared).dot(d / squared.sqrt()) } else { 0.0 }
}

impl<'a> Sides<'a> {
    /// Areas are 0 from where `progress` is cancelled.
    pub(super) fn new(tree: &'a SampleTree, progress: &Progress) -> Self {
        let area = |found: &mut Vec<_>, i: usize| {
            if progress.is_cancelled() {
                return 0.0;
            }
            let sample = &tree.samples[i];
            tree.nearest(sample.position, 2 * AROUND + 1, found);
            found.retain(|e| tree.samples[e.1 as usize].normal.dot(sample.normal) > ONE_SIDE);
            found.truncate(AROUND + 1);
            // The farthest lies on the rim of the disc.
            found.last().map_or(0.0, |e: &(f64, u32)| PI * e.0 / (found.len() as f64 - 0.5))
        };
        let areas: Vec<f64> = (0..tree.samples.len()).into_par_iter().map_init(Vec::new, area).collect();
        let patch = |node: usize| {
            let samples = &tree.samples[tree.span(node)];
            let even = 1.0 / samples.len() as f64;
            let middle: DVec3 = samples.iter().map(|s| s.position * even).sum();
            let radius = samples.iter().map(|s| s.position.distance(middle)).fold(0.0, f64::max);
            let area = samples.iter().zip(&areas[tree.span(node)]).map(|(s, a)| s.normal * *a).sum();
            Patch { middle, area, radius }
        };
        let patches = (0..tree.nodes()).into_par_iter().map(patch).collect();
        let mut sides = Self { tree, areas, patches, level: 0.0 };
        let asked = tree.samples.iter().step_by(tree.samples.len().div_ceil(ASKED));
        let mean = asked.clone().map(|s| sides.winding(s.position)).sum::<f64>() / asked.len() as f64;
        sides.level = 0.5 * (2.0 * mean).round().clamp(-1.0, 1.0);
        sides
    }

    /// About how far a sample's neighbours are.
    pub(super) fn spacing(&self, sample: u32) -> f64 {
        self.areas[sample as usize].sqrt()
    }

    /// w, without samples at the place itself.
    fn winding(&self, p: DVec3) -> f64 {
        let mut stack = vec![1];
        let mut sum = 0.0;
        while let Some(node) = stack.pop() {
            let patch = &self.patches[node];
            let d = patch.middle - p;
            if d.length_squared() > APART * APART * patch.radius * patch.radius {
                sum += flux(patch.area, d);
            } else if 2 * node < self.tree.nodes() {
                stack.extend([2 * node + 1, 2 * node]);
            } else {
                let span = self.tree.span(node);
                let each = self.tree.samples[span.clone()].iter().zip(&self.areas[span]);
                sum += each.map(|(s, a)| flux(s.normal * *a, s.position - p)).sum::<f64>();
            }
        }
        sum / (4.0 * PI)
    }

    /// Signed distance of a place whose nearest samples are given, near to far, at least one.
    pub(super) fn distance(&self, p: DVec3, nearest: &[(f64, u32)]) -> f64 {
        let farther = |e: &(f64, u32)| e.0 - nearest[0].0;
        // Twice as far, in squares, as the ring of samples around the nearest.
        let width = 2.0 * farther(&nearest[AROUND.min(nearest.len() - 1)]);
        let weight = |e: &(f64, u32)| if width > 0.0 { libm::exp(-farther(e) / width) } else { 1.0 };
        let height = |e: &(f64, u32)| {
            let s = &self.tree.samples[e.1 as usize];
            s.normal.dot(p - s.position)
        };
        let told = nearest.iter().map(|e| weight(e) * height(e)).sum::<f64>() / nearest.iter().map(weight).sum::<f64>();
        let distance = nearest[0].0.sqrt();
        if told.abs() > SURE * distance {
            return told;
        }
        distance * (2.0 * (self.level - self.winding(p))).clamp(-1.0, 1.0)
    }
}
