//! The slicing axis: the half vector of the directions to the eye and to the light.

use splat_core::glam::DVec3;

/// The axis that slabs lie across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfVector {
    /// Unit vector across the slabs, world space, to the side that light travels to; light crosses slabs at 45° or steeper.
    pub normal: DVec3,
    /// Whether the eye meets first what light meets last.
    pub back_to_front: bool,
}

impl HalfVector {
    /// Of unit directions to the eye and to the light, world space.
    ///
    /// Neither sum below is shorter than √2, so no direction is without an axis.
    pub fn between(to_eye: DVec3, to_light: DVec3) -> Self {
        let (half, back_to_front) = Self::raw(to_eye, to_light);
        Self { normal: -half.normalize(), back_to_front }
    }

    /// The axis on the other side of the right angle, at which [`HalfVector::between`] turns over.
    pub(crate) fn beyond(to_eye: DVec3, to_light: DVec3) -> Self {
        let (_, is_back_to_front) = Self::raw(to_eye, to_light);
        let half = if is_back_to_front { to_eye + to_light } else { to_light - to_eye };
        Self { normal: -half.normalize(), back_to_front: !is_back_to_front }
    }

    /// E + L where E·L ≥ 0, else L − E; and whether it is the latter.
    pub fn raw(to_eye: DVec3, to_light: DVec3) -> (DVec3, bool) {
        if to_eye.dot(to_light) >= 0.0 { (to_eye + to_light, false) } else { (to_light - to_eye, true) }
    }
}
