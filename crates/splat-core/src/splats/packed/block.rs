//! What the splats of a block have in common: the corner and the steps that their numbers are counted from and in, and their looks.

use crate::{Aabb, Cloud, SplatKind};
use glam::Vec3;
use std::ops::Range;

/// What tables tell of a splat, and whether it has a normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Look {
    pub(super) object: u32,
    pub(super) material: u16,
    pub(super) footprint: u8,
    pub(super) kind: SplatKind,
    pub(super) has_normal: bool,
}

impl Look {
    pub(super) fn from_splat(cloud: &Cloud, i: usize) -> Self {
        Self {
            object: cloud.object[i],
            material: cloud.material[i],
            footprint: cloud.footprint[i],
            kind: cloud.kind[i],
            has_normal: cloud.normal_of(i) != Vec3::ZERO,
        }
    }
}

/// Even steps from the least number of a block to its greatest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Even {
    pub(super) low: f32,
    pub(super) step: f32,
}

impl Even {
    fn new(range: [f32; 2], steps: f64) -> Self {
        let [low, high] = range;
        let mut even = Self { low, step: ((f64::from(high) - f64::from(low)) / steps) as f32 };
        // Rounded up, the last step may be beyond the greatest number, and a share of shadows beyond 1.
        let last = |even: Self| even.value(steps as f32);
        while last(even) > high && last(even).is_finite() {
            even.step = even.step.next_down();
        }
        even
    }

    /// The nearest step.
    #[inline]
    pub(super) fn step_of(self, v: f32) -> u16 {
        // From f64: none is lost to a large offset. A range of nothing has step 0, and NaN becomes 0.
        ((f64::from(v) - f64::from(self.low)) / f64::from(self.step)).round() as u16
    }

    #[inline]
    pub(super) fn value(self, step: f32) -> f32 {
        self.low + self.step * step
    }
}

/// Steps that are even in the square roots of numbers ≥ 0, so that small ones are more exact than large ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rooted {
    pub(super) low: f32,
    pub(super) root: f32,
    pub(super) step: f32,
}

impl Rooted {
    fn new(range: [f32; 2], steps: f64) -> Self {
        let [low, high] = range;
        let [root, top] = [low, high].map(|v| f64::from(v).sqrt());
        Self { low, root: root as f32, step: ((top - root) / steps) as f32 }
    }

    /// The nearest step.
    #[inline]
    pub(super) fn step_of(self, v: f32) -> u16 {
        ((f64::from(v).sqrt() - f64::from(self.low).sqrt()) / f64::from(self.step)).round() as u16
    }

    /// (root + step·n)², less what rounding takes from the least.
    #[inline]
    pub(super) fn value(self, n: f32) -> f32 {
        let way = self.step * n;
        self.low + way * (2.0 * self.root + way)
    }
}

/// What a block's numbers are counted from and in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block {
    pub(super) position: [Even; 3],
    pub(super) radius: Rooted,
    pub(super) cross_section: Rooted,
    pub(super) color: Rooted,
    pub(super) value: Even,
    pub(super) crossing_depth: Rooted,
    /// Of lengths, where there is a tangent.
    pub(super) tangent: Rooted,
    pub(super) shadow_coefficient: Even,
    /// Where its looks begin in the list of all.
    pub(super) first_look: u32,
}

/// Least and greatest of some numbers; 0 for none.
fn range_of(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.map(|v| [v; 2]).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]).unwrap_or([0.0; 2])
}

impl Block {
    /// Of some splats of a cloud, and their looks.
    pub(super) fn new(cloud: &Cloud, splats: Range<usize>) -> (Self, Vec<Look>) {
        let range = |column: &[f32]| range_of(column.get(splats.clone()).unwrap_or(&[]).iter().copied());
        let box_of = Aabb::of_points(&cloud.position[splats.clone()]);
        let lengths = cloud.tangent.get(splats.clone()).unwrap_or(&[]).iter().map(|t| t.length());
        let [_, brightest] = range_of(cloud.color[splats.clone()].as_flattened().iter().copied());
        let block = Self {
            position: [0, 1, 2].map(|a| Even::new([box_of.min[a], box_of.max[a]], 65535.0)),
            radius: Rooted::new(range(&cloud.radius), 255.0),
            cross_section: Rooted::new(range(&cloud.cross_section), 65535.0),
            color: Rooted::new([0.0, brightest], 255.0),
            value: Even::new(range(&cloud.value), 65535.0),
            crossing_depth: Rooted::new(range(&cloud.crossing_depth), 65535.0),
            tangent: Rooted::new(range_of(lengths.filter(|l| *l > 0.0)), 255.0),
            shadow_coefficient: Even::new(range(&cloud.shadow_coefficient), 255.0),
            first_look: 0,
        };
        let mut looks = Vec::new();
        for look in splats.map(|i| Look::from_splat(cloud, i)) {
            if !looks.contains(&look) {
                looks.push(look);
            }
        }
        (block, looks)
    }

    #[inline]
    pub(super) fn places(&self, p: Vec3) -> [u16; 3] {
        [0, 1, 2].map(|a| self.position[a].step_of(p[a]))
    }

    #[inline]
    pub(super) fn place(&self, steps: [u16; 3]) -> Vec3 {
        Vec3::from([0, 1, 2].map(|a| self.position[a].value(f32::from(steps[a]))))
    }
}
