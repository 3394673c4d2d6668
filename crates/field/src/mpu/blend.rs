//! The blend f = Σ wᵢQᵢ / Σ wᵢ at a place with exact derivatives, and its range over a ball.
//!
//! ∇f = (Σ∇(wᵢQᵢ) − f·Σ∇wᵢ)/W; Hf = (Σ H(wᵢQᵢ) − f·Σ Hwᵢ − ∇W∇fᵀ − ∇f∇Wᵀ)/W with W = Σwᵢ > 0: every place lies in the
//! ball of its own cell, at most 1/(2α) of the radius from the middle.
//!
//! Range: f is a convex combination of the Qᵢ with weight, so it stays in the hull of their ranges. For small balls that
//! hull does not close onto the value c in the middle, but f − c = Σ wᵢ(Qᵢ − c)/W does, with each |Qᵢ − c| under the greatest weight that
//! it has in the ball: shapes are far off where their weight ends, and there they count for little. Likewise
//!
//! |∇f| ≤ (Σ wᵢ|∇Qᵢ| + Σ |∇wᵢ||Qᵢ − c| + |f − c|·Σ |∇wᵢ|)/W,
//!
//! each part bounded over the ball, and |∇f| times the radius bounds |f − c| too. All hold, so their intersection does.

use super::octree::{EMPTY, Node, Octree, child_center, union};
use super::quadric::{active_piece, shape_over_ball};
use super::weight::{steepest, weight, weight_hessian, weight_slope};
use splat_core::glam::{DMat3, DVec3};

/// Value and derivatives; those above the order asked for are 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blend {
    pub(super) value: f64,
    pub(super) gradient: DVec3,
    pub(super) hessian: DMat3,
}

/// a bᵀ + b aᵀ.
fn both_ways(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x + b * a.x, a * b.y + b * a.y, a * b.z + b * a.z)
}

impl Octree {
    /// The leaf of a place in the cube.
    fn leaf_at(&self, p: DVec3) -> usize {
        let mut node = 0;
        let mut center = self.center;
        let mut half = self.half;
        loop {
            match self.node(node) {
                Node::Leaf(leaf) => return leaf,
                Node::Inner(first) => {
                    let c = usize::from(p.x >= center.x)
                        | usize::from(p.y >= center.y) << 1
                        | usize::from(p.z >= center.z) << 2;
                    node = first + c;
                    center = child_center(center, half, c);
                    half *= 0.5;
                }
            }
        }
    }

    /// Derivatives up to order `D` ≤ 2 at a place in the cube.
    pub(super) fn blend<const D: usize>(&self, p: DVec3) -> Blend {
        self.blend_of::<D>(self.leaf_at(p), p)
    }

    /// The same in the cell of a leaf.
    fn blend_of<const D: usize>(&self, leaf: usize, p: DVec3) -> Blend {
        let mut sum = 0.0;
        let mut total = 0.0;
        let mut sum_slope = DVec3::ZERO;
        let mut total_slope = DVec3::ZERO;
        let mut sum_bend = DMat3::ZERO;
        let mut total_bend = DMat3::ZERO;
        for &id in self.listed(leaf) {
            let support = &self.supports[id as usize];
            let y = (p - support.center) * support.inverse;
            let r2 = y.length_squared();
            if r2 >= 1.0 {
                continue;
            }
            let (pieces, joint) = self.function(id);
            let piece = active_piece(pieces, joint, y);
            if D == 0 {
                let w = weight(r2);
                sum += w * piece.value(y);
                total += w;
                continue;
            }
            let (w, slope) = weight_slope(r2);
            let (q, q_slope) = piece.value_gradient(y);
            let w_slope = y * (slope * support.inverse);
            let q_slope = q_slope * support.inverse;
            sum += w * q;
            total += w;
            sum_slope += w_slope * q + q_slope * w;
            total_slope += w_slope;
            if D == 2 {
                let squared = support.inverse * support.inverse;
                let w_bend = weight_hessian(y) * squared;
                let q_bend = piece.hessian() * squared;
                sum_bend += q_bend * w + w_bend * q + both_ways(w_slope, q_slope);
                total_bend += w_bend;
            }
        }
        let inverse = 1.0 / total;
        let value = sum * inverse;
        let gradient = (sum_slope - total_slope * value) * inverse;
        let hessian = (sum_bend - total_bend * value - both_ways(total_slope, gradient)) * inverse;
        Blend { value, gradient, hessian }
    }

    /// Range within `radius` of a place in the cube, as far as that lies in the cube.
    pub(super) fn over_ball(&self, p: DVec3, radius: f64) -> [f64; 2] {
        let mut range = EMPTY;
        self.descend(0, self.center, self.half, p, radius, &mut range);
        range
    }

    /// Widens `range` by that of a node's cell within a ball.
    fn descend(&self, node: usize, center: DVec3, half: f64, p: DVec3, radius: f64, range: &mut [f64; 2]) {
        let stored = self.range(node);
        let known = range[0] <= stored[0] && range[1] >= stored[1];
        let nearest = p.clamp(center - half, center + half);
        if known || nearest.distance_squared(p) > radius * radius * (1.0 + 1e-12) {
            return;
        }
        match self.node(node) {
            // The ball is no smaller than the cell.
            _ if half <= radius => *range = union(*range, &stored),
            Node::Inner(first) => {
                for c in 0..8 {
                    self.descend(first + c, child_center(center, half, c), 0.5 * half, p, radius, range);
                }
            }
            Node::Leaf(leaf) => {
                let [low, high] = self.over_part(leaf, nearest, radius).0;
                *range = union(*range, &[low.max(stored[0]), high.min(stored[1])]);
            }
        }
    }

    /// Greatest gradient within `radius` of a place in the cube; infinite where the ball is so large that it is not worth its search.
    pub(super) fn steepest(&self, p: DVec3, radius: f64) -> f64 {
        self.steepest_below(0, self.center, self.half, p, radius)
    }

    /// The same in a node's cell within a ball.
    fn steepest_below(&self, node: usize, center: DVec3, half: f64, p: DVec3, radius: f64) -> f64 {
        let nearest = p.clamp(center - half, center + half);
        if nearest.distance_squared(p) > radius * radius * (1.0 + 1e-12) {
            return 0.0;
        }
        match self.node(node) {
            _ if 4.0 * half <= radius => f64::INFINITY,
            Node::Inner(first) => {
                let child = |c| self.steepest_below(first + c, child_center(center, half, c), 0.5 * half, p, radius);
                (0..8).map(child).fold(0.0, f64::max)
            }
            Node::Leaf(leaf) => self.over_part(leaf, nearest, radius).1,
        }
    }

    /// Range and greatest gradient over the part of a leaf's cell within `radius` of `p`, which lies in the cell.
    fn over_part(&self, leaf: usize, p: DVec3, radius: f64) -> ([f64; 2], f64) {
        let value = self.blend_of::<0>(leaf, p).value;
        let mut hull = EMPTY;
        let mut steepest_shape = 0.0f64;
        // Sums of least and greatest weights and of greatest |∇wᵢ|, and of the latter two with greatest |Qᵢ − value|.
        let mut least = 0.0;
        let mut most_slope = 0.0;
        let mut slopes = 0.0;
        let mut off = 0.0;
        let mut slopes_off = 0.0;
        for &id in self.listed(leaf) {
            let support = &self.supports[id as usize];
            let y = (p - support.center) * support.inverse;
            let reach = radius * support.inverse;
            let r2 = y.length_squared();
            if r2 >= (1.0 + reach) * (1.0 + reach) {
                continue;
            }
            let r = r2.sqrt();
            let (pieces, joint) = self.function(id);
            let (range, slope) = shape_over_ball(pieces, joint, y, reach);
            let far = (range[1] - value).max(value - range[0]);
            let near = (r - reach).max(0.0);
            let most = steepest(r - reach, r + reach) * support.inverse;
            let most_weight = weight(near * near);
            hull = union(hull, &range);
            steepest_shape = steepest_shape.max(slope * support.inverse);
            least += weight((r + reach) * (r + reach));
            most_slope += most_weight * slope * support.inverse;
            off += most_weight * far;
            slopes += most;
            slopes_off += most * far;
        }
        let width = hull[1] - hull[0];
        let blended = slopes_off + (off / least).min(width) * slopes;
        let slope = (most_slope / least).min(steepest_shape) + blended.min(width * slopes) / least;
        // 1e-14: rounding of the sums; the hull has its own slack.
        let reach = (off / least).min(slope * radius) + 1e-14 * hull[0].abs().max(hull[1].abs());
        let range = if reach.is_finite() { [hull[0].max(value - reach), hull[1].min(value + reach)] } else { hull };
        (range, if slope.is_nan() { f64::INFINITY } else { slope })
    }
}
