//! Fields of an object's own space, in the world: any field inside a box, and boxes that are turned.

use glam::{DMat3, DVec3};
use splat_core::{ScalarField, Similarity};

/// Place of a world point in the object's own space.
fn local(t: &Similarity, p: DVec3) -> DVec3 {
    t.rotation.inverse() * (p - t.translation) / t.scale
}

/// Lowest and highest corner of the box along the world's axes around a box whose corners are moved by `place`, which is
/// affine.
pub fn box_around(place: impl Fn(DVec3) -> DVec3, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
    let corner = |k: usize| {
        let pick = |bit: usize| if k >> bit & 1 == 1 { high[bit] } else { low[bit] };
        place(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let both = |[a, b]: [DVec3; 2], p: DVec3| [a.min(p), b.max(p)];
    (0..8).map(corner).fold([DVec3::INFINITY, DVec3::NEG_INFINITY], both)
}

/// A field inside a box of its own space, 0 outside, moved into the world. Values stay as they are; gradients are over world
/// units.
///
/// ```
/// use reference::Placed;
/// use splat_core::glam::{DMat3, DVec3};
/// use splat_core::{ScalarField, Similarity};
/// struct Height;
/// impl ScalarField for Height {
///     fn value(&self, p: DVec3) -> f64 { p.y }
///     fn gradient(&self, _: DVec3) -> DVec3 { DVec3::Y }
///     fn hessian(&self, _: DVec3) -> DMat3 { DMat3::ZERO }
///     fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> { Some((p.y - radius, p.y + radius)) }
/// }
/// let twice = Similarity { scale: 2.0, ..Similarity::default() };
/// let placed = Placed::new(Height, twice, [DVec3::ZERO, DVec3::ONE]);
/// assert_eq!([1.5, 2.5].map(|y| placed.value(DVec3::new(1.0, y, 1.0))), [0.75, 0.0]);
/// ```
pub struct Placed<F> {
    field: F,
    transform: Similarity,
    within: [DVec3; 2],
}

impl<F: ScalarField> Placed<F> {
    /// `field` within the lowest and the highest corner of `within`, both in its own space; `transform` leads to the world.
    pub fn new(field: F, transform: Similarity, within: [DVec3; 2]) -> Self {
        Self { field, transform, within }
    }

    fn holds(&self, q: DVec3) -> bool {
        q.cmpge(self.within[0]).all() && q.cmple(self.within[1]).all()
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

/// A box that is turned: the largest distance beyond one of its faces, world units, negative inside.
///
/// ```
/// use reference::TurnedBox;
/// use splat_core::glam::{DQuat, DVec3};
/// use splat_core::{ScalarField, Similarity};
/// let eighth = Similarity { rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_4), ..Similarity::default() };
/// let cube = TurnedBox::new([DVec3::splat(-1.0), DVec3::ONE], eighth);
/// // A corner of the square lies on the axis now.
/// assert!(cube.value(DVec3::X * 1.4) < 0.0 && cube.value(DVec3::X * 1.42) > 0.0);
/// ```
pub struct TurnedBox {
    center: DVec3,
    half: DVec3,
    transform: Similarity,
}

impl TurnedBox {
    /// The box between two corners of its own space; `transform` leads to the world.
    pub fn new([low, high]: [DVec3; 2], transform: Similarity) -> Self {
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
