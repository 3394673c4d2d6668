//! Directions of any length → unit vectors.

use splat_core::glam::{DVec3, Vec3};

/// `n` with length 1; zero stays zero. Scaled first, so that neither 1e-200 nor 1e200 is lost in the squares.
pub(crate) fn unit(n: DVec3) -> Vec3 {
    let largest = n.abs().max_element();
    if largest > 0.0 { (n / largest).normalize().as_vec3() } else { Vec3::ZERO }
}
