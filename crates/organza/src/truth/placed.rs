//! Fields of an object's own space, in the world: expressions, and boxes that are turned.

use convert::ExpressionField;
use glam::{DMat3, DVec3};
use splat_core::{ScalarField, Similarity};

/// Place of a world point in the object's own space.
fn local(t: &Similarity, p: DVec3) -> DVec3 {
    t.rotation.inverse() * (p - t.translation) / t.scale
}

/// An expression inside a box of its own space, 0 outside.
pub(super) struct Placed {
    field: ExpressionField,
    transform: Similarity,
    within: [DVec3; 2],
}

impl Placed {
    pub(super) fn new(field: ExpressionField, transform: Similarity, within: [DVec3; 2]) -> Self {
        Self { field, transform, within }
    }

    fn holds(&self, q: DVec3) -> bool {
        q.cmpge(self.within[0]).all() && q.cmple(self.within[1]).all()
    }
}

impl ScalarField for Placed {
    fn value(&self, p: DVec3) -> f64 {
        let q = local(&self.transform, p);
        if self.holds(q) { self.field.value(q) } else { 0.0 }
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.transform.rotate(self.field.gradient(local(&self.transform, p))) / self.transform.scale
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let turn = DMat3::from_quat(self.transform.rotation);
        let scale = self.transform.scale * self.transform.scale;
        turn * self.field.hessian(local(&self.transform, p)) * turn.transpose() * (1.0 / scale)
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let (q, reach) = (local(&self.transform, p), DVec3::splat(radius / self.transform.scale));
        if (q + reach).cmplt(self.within[0]).any() || (q - reach).cmpgt(self.within[1]).any() {
            return Some((0.0, 0.0));
        }
        let (low, high) = self.field.bound(q, reach.x)?;
        if self.holds(q - reach) && self.holds(q + reach) {
            Some((low, high))
        } else {
            Some((low.min(0.0), high.max(0.0)))
        }
    }
}

/// A box that is turned: the largest distance beyond one of its faces, negative inside.
pub(super) struct TurnedBox {
    center: DVec3,
    half: DVec3,
    transform: Similarity,
}

impl TurnedBox {
    pub(super) fn new([low, high]: [DVec3; 2], transform: Similarity) -> Self {
        Self { center: 0.5 * (low + high), half: 0.5 * (high - low), transform }
    }
}

impl ScalarField for TurnedBox {
    fn value(&self, p: DVec3) -> f64 {
        ((local(&self.transform, p) - self.center).abs() - self.half).max_element() * self.transform.scale
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        let from = local(&self.transform, p) - self.center;
        let beyond = from.abs() - self.half;
        let axis = (0..3).find(|a| beyond[*a] == beyond.max_element()).unwrap_or(0);
        let mut out = DVec3::ZERO;
        out[axis] = from[axis].signum();
        self.transform.rotate(out)
    }

    fn hessian(&self, _p: DVec3) -> DMat3 {
        DMat3::ZERO
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let value = self.value(p);
        Some((value - radius, value + radius))
    }
}
