//! Fields of an object's own space, in the world: any field inside a box, and boxes that are turned.

use glam::{DMat3, DVec3};
use splat_core::{DAabb, ScalarField, Similarity};

/// Place of a world point in the object's own space.
fn local(t: &Similarity, p: DVec3) -> DVec3 {
    t.rotation.inverse() * (p - t.translation) / t.scale
}

/// A field inside a box of its own space, 0 outside, moved into the world. Values stay as they are; gradients are over world
/// units.
///
/// ```
/// use reference::Placed;
/// use splat_core::glam::DVec3;
/// use splat_core::{DAabb, ScalarField, Similarity};
/// struct Height;
/// impl ScalarField for Height {
///     fn value(&self, p: DVec3) -> f64 { p.y }
///     fn gradient(&self, _: DVec3) -> DVec3 { DVec3::Y }
///     fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> { Some((p.y - radius, p.y + radius)) }
/// }
/// let twice = Similarity { scale: 2.0, ..Similarity::default() };
/// let placed = Placed::new(Height, twice, DAabb::new(DVec3::ZERO, DVec3::ONE));
/// assert_eq!([1.5, 2.5].map(|y| placed.value(DVec3::new(1.0, y, 1.0))), [0.75, 0.0]);
/// ```
pub struct Placed<F> {
    field: F,
    transform: Similarity,
    within: DAabb,
}

impl<F: ScalarField> Placed<F> {
    /// `field` within a box of its own space; `transform` leads to the world.
    pub fn new(field: F, transform: Similarity, within: DAabb) -> Self {
        Self { field, transform, within }
    }

    fn holds(&self, q: DVec3) -> bool {
        self.within.contains(q)
    }
}

impl<F: ScalarField> ScalarField for Placed<F> {
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
        let q = local(&self.transform, p);
        let reach = DVec3::splat(radius / self.transform.scale);
        if (q + reach).cmplt(self.within.min).any() || (q - reach).cmpgt(self.within.max).any() {
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

/// A box that is turned: the largest distance beyond one of its faces, world units, negative inside.
///
/// ```
/// use reference::TurnedBox;
/// use splat_core::glam::{DQuat, DVec3};
/// use splat_core::{DAabb, ScalarField, Similarity};
/// let eighth = Similarity { rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_4), ..Similarity::default() };
/// let cube = TurnedBox::new(DAabb::around(DVec3::ZERO, DVec3::ONE), eighth);
/// // A corner of the square lies on the axis now.
/// assert!(cube.value(DVec3::X * 1.4) < 0.0 && cube.value(DVec3::X * 1.42) > 0.0);
/// ```
pub struct TurnedBox {
    center: DVec3,
    half: DVec3,
    transform: Similarity,
}

impl TurnedBox {
    /// A box of its own space; `transform` leads to the world.
    pub fn new(bounds: DAabb, transform: Similarity) -> Self {
        Self { center: bounds.center(), half: 0.5 * bounds.size(), transform }
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
