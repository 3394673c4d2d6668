//! Vectors of neighbouring pixels, lane by lane.

use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// 2²³, from which on floats are natural numbers.
pub(crate) const NATURAL: f32 = 8_388_608.0;

/// 0, 1, 2 …
pub(crate) const COUNTING: [f32; MAX_LANES] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

/// A vector on all lanes.
#[inline(always)]
pub(crate) fn vector<S: Simd>(simd: S, v: Vec3) -> [Lanes<S>; 3] {
    [simd.lanes(v.x), simd.lanes(v.y), simd.lanes(v.z)]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: &[Lanes<S>; 3], b: &[Lanes<S>; 3]) -> Lanes<S> {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(crate) fn sum<S: Simd>(a: &[Lanes<S>; 3], b: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn difference<S: Simd>(a: &[Lanes<S>; 3], b: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
