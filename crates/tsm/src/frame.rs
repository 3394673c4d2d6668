//! The light's frame: positions relative to the light (Gunjee 2007, Eq. 1), turned to the table's axes.
//!
//! P' = P − L is taken in f64, so that a scene at 1e7 keeps its digits. Lengths are divided by a power of two near the
//! farthest caster, so that squares of 1e20 or 1e-23 neither overflow nor vanish. A scene that is scaled by a power of
//! two keeps every bit of its table.

use splat_core::glam::{DMat3, DVec3, Mat3, Vec3};
use std::cmp::Ordering;

/// From offsets of the cloud to the light's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    /// Light, or a point on the plane where parallel light starts; relative to the cloud's origin, world units.
    origin: DVec3,
    /// Rows are the table's axes.
    rotation: Mat3,
    /// Frame units per world unit, a power of two.
    unit: f64,
    /// The largest distance that occurs.
    extent: f32,
}

impl Frame {
    /// Axes are rows; `extent` is the largest distance that occurs, world units.
    pub(crate) fn new(origin: DVec3, axes: [DVec3; 3], extent: f64) -> Self {
        let rotation = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose().as_mat3();
        let unit = inverse_power_of_two(extent);
        let of_frame = if extent > 0.0 { (extent * unit) as f32 } else { 1.0 };
        Self { origin, rotation, unit, extent: of_frame }
    }

    /// The largest distance that occurs, in the frame.
    #[inline(always)]
    pub(crate) fn extent(&self) -> f32 {
        self.extent
    }

    /// Position in the frame.
    #[inline(always)]
    pub(crate) fn position(&self, offset: Vec3) -> Vec3 {
        self.rotation * ((offset.as_dvec3() - self.origin) * self.unit).as_vec3()
    }

    /// The light relative to the cloud's origin, the rotation, and frame units per world unit.
    #[cfg(feature = "gpu")]
    pub(crate) fn parts(&self) -> (DVec3, Mat3, f64) {
        (self.origin, self.rotation, self.unit)
    }

    /// Direction in the frame.
    #[inline(always)]
    pub(crate) fn turn(&self, direction: Vec3) -> Vec3 {
        self.rotation * direction
    }

    /// A displacement in the frame.
    #[inline(always)]
    pub(crate) fn displacement(&self, d: Vec3) -> Vec3 {
        self.rotation * (d.as_dvec3() * self.unit).as_vec3()
    }

    /// A length in the frame.
    #[inline(always)]
    pub(crate) fn length(&self, world: f32) -> f32 {
        (f64::from(world) * self.unit) as f32
    }

    /// An area in the frame.
    #[inline(always)]
    pub(crate) fn area(&self, world: f32) -> f32 {
        (f64::from(world) * self.unit * self.unit) as f32
    }

    /// World length of a length in the frame.
    pub(crate) fn world_length(&self, length: f32) -> f64 {
        f64::from(length) / self.unit
    }

    /// Offset from the cloud's origin of a position in the frame.
    pub(crate) fn offset(&self, p: Vec3) -> Vec3 {
        ((self.rotation.transpose() * p).as_dvec3() / self.unit + self.origin).as_vec3()
    }

    /// World direction of a direction in the frame.
    pub(crate) fn world_direction(&self, d: Vec3) -> Vec3 {
        self.rotation.transpose() * d
    }
}

/// 2^−⌊log₂ x⌋ for finite x > 0 within 2^±1000, else 1.
fn inverse_power_of_two(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) & 0x7ff) as i64 - 1023;
    if x > 0.0 && exponent.abs() <= 1000 { f64::from_bits(((1023 - exponent) as u64) << 52) } else { 1.0 }
}

/// Right, up and `forward`: right is the world axis most across it, among equals the one along which the casters extend
/// farther, so that a scene that is turned with its axes keeps its table.
pub(crate) fn axes_along(forward: DVec3, extent: DVec3) -> [DVec3; 3] {
    let forward = forward.normalize();
    let across = |k: &usize| (forward[*k].abs(), -extent[*k]);
    let order = |a: &usize, b: &usize| across(a).partial_cmp(&across(b)).unwrap_or(Ordering::Equal);
    let right = [0, 1, 2].into_iter().min_by(order).map_or(DVec3::X, |k| DVec3::AXES[k]);
    let right = (right - forward * forward.dot(right)).normalize();
    [right, forward.cross(right), forward]
}

/// World axes with the one last along which the casters extend least: the poles of a table of the whole sphere. A scene
/// that is turned with its axes keeps its table unless two extents are equal.
pub(crate) fn axes_about(extent: DVec3) -> [DVec3; 3] {
    let order = |a: &usize, b: &usize| extent[*a].partial_cmp(&extent[*b]).unwrap_or(Ordering::Equal);
    let pole = [2, 1, 0].into_iter().min_by(order).unwrap_or(2);
    [1, 2, 0].map(|k| DVec3::AXES[(pole + k) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_is_the_power_of_two_below() {
        for (x, unit) in [(1.0, 1.0), (1.99, 1.0), (2.0, 0.5), (0.75, 2.0), (0.0, 1.0), (1e20, 2f64.powi(-66))] {
            assert_eq!(inverse_power_of_two(x), unit, "{x}");
        }
    }

    #[test]
    fn offset_inverts_position() {
        let frame = Frame::new(DVec3::new(1.0, 2.0, 3.0), axes_along(DVec3::new(1.0, 1.0, -0.3), DVec3::ONE), 700.0);
        let p = Vec3::new(10.0, -20.0, 30.0);
        assert!((frame.offset(frame.position(p)) - p).length() < 1e-4);
    }
}
