//! Gradients of a sheet's values from neighbouring pixels and sheets (step 16 of the pseudocode).
//!
//! A sample is the value at a place (a, b, s), s the depth across the slabs, in slabs. With Δ for differences between the samples of two
//! neighbours, columns and rows of pixels and neighbouring sheets give three equations Δv = ∂a·Δa + ∂b·Δb + ∂s·Δs. Differences are central,
//! one-sided beside a sample that is outside the volume. Samples of a sheet differ in s where faces cut its slab.

use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::sheet::Sheet;
use crate::shared::sections::LEAST_WEIGHT;
use crate::shared::vectors::dot;
use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Three sheets of a volume, one behind the other.
#[derive(Clone, Copy)]
pub(crate) struct SheetsAround<'a> {
    pub(crate) before: &'a Sheet,
    pub(crate) here: &'a Sheet,
    pub(crate) after: &'a Sheet,
}

/// What gradients are turned by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gradients {
    /// Of slab coordinates, world space.
    axes: [Vec3; 3],
    /// Slab width.
    width: f32,
}

/// Value, a, b and s, and 1 for a sample that is inside, else 0.
type Sample<S> = [Lanes<S>; 5];

/// Place of the last in a sample.
const INSIDE: usize = 4;

impl Gradients {
    pub(crate) fn new(frame: &Frame) -> Self {
        Self { axes: frame.axes.map(|axis| axis.as_vec3()), width: frame.slabs.width as f32 }
    }

    /// −∇v/|∇v| of neighbouring pixels from place `k` of the sheets on; zero where there is no gradient.
    #[inline(always)]
    pub(crate) fn normals<S: Simd>(
        &self,
        simd: S,
        sheets: SheetsAround<'_>,
        stride: usize,
        k: usize,
    ) -> [Vec3; MAX_LANES] {
        let SheetsAround { before, here, after } = sheets;
        let zero = simd.lanes(0.0);
        let half = simd.lanes(0.5);
        let one = simd.lanes(1.0);
        let sample = sample_at(simd, here, k, 0.0);
        let none = [sample[0], sample[1], sample[2], sample[3], zero];
        let above = if k >= stride { sample_at(simd, here, k - stride, 0.0) } else { none };
        let below = if k + stride < here.near.len() { sample_at(simd, here, k + stride, 0.0) } else { none };
        let [vx, x @ ..] = difference(simd, &sample, &left_of(simd, here, k), &sample_at(simd, here, k + 1, 0.0));
        let [vy, y @ ..] = difference(simd, &sample, &above, &below);
        let before = sample_at(simd, before, k, -1.0);
        let after = sample_at(simd, after, k, 1.0);
        let [vz, mut z @ ..] = difference(simd, &sample, &before, &after);
        // Without a neighbour across the slabs there is no gradient across them.
        z[2] = one.where_less_or(before[INSIDE] + after[INSIDE], half, z[2]);
        let of_x = cross(&y, &z);
        let of_y = cross(&z, &x);
        let of_z = cross(&x, &y);
        let determinant = dot(&x, &of_x);
        let least = simd.lanes(f32::MIN_POSITIVE);
        let size = determinant.abs();
        let inverse = one / one.where_less_or(size, least, determinant);
        let mut gradient = [zero, zero, vz / z[2]];
        for n in 0..3 {
            let sum = vx.mul_add(of_x[n], vy.mul_add(of_y[n], vz * of_z[n])) * inverse;
            gradient[n] = sum.where_less_or(least, size, gradient[n]);
        }
        // Per slab width, so that no scale of the scene makes anything vanish.
        for along in &mut gradient[..2] {
            *along = *along * simd.lanes(self.width);
        }
        let mut parts = [[0.0; MAX_LANES]; 3];
        for n in 0..3 {
            gradient[n].store(&mut parts[n]);
        }
        self.world(&parts)
    }

    /// −∇v/|∇v| of gradients in slab coordinates.
    pub(crate) fn world(&self, gradients: &[[f32; MAX_LANES]; 3]) -> [Vec3; MAX_LANES] {
        std::array::from_fn(|lane| {
            let [a, b, s] = gradients.map(|part| part[lane]);
            -(self.axes[0] * a + self.axes[1] * b + self.axes[2] * s).normalize_or_zero()
        })
    }
}

/// Differences of value, a, b and s between two neighbours, each of which this sample stands for where it is outside.
#[inline(always)]
fn difference<S: Simd>(simd: S, here: &Sample<S>, before: &Sample<S>, after: &Sample<S>) -> [Lanes<S>; 4] {
    let half = simd.lanes(0.5);
    let mut out = [half; 4];
    for n in 0..4 {
        let high = after[n].where_less_or(half, after[INSIDE], here[n]);
        out[n] = high - before[n].where_less_or(half, before[INSIDE], here[n]);
    }
    out
}

#[inline(always)]
fn cross<S: Simd>(x: &[Lanes<S>; 3], y: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
}

/// The samples from pixel `k` on of a sheet that lies `slabs` behind the one that depths are told from.
#[inline(always)]
fn sample_at<S: Simd>(simd: S, sheet: &Sheet, k: usize, slabs: f32) -> Sample<S> {
    let Sheet { near, far, values, weights, places: [a, b], behind, .. } = sheet;
    let planes = [&near[k..], &far[k..], &weights[k..], &values[k..], &a[k..], &b[k..], &behind[k..]];
    sample(simd, slabs, planes)
}

/// Of near, far, kernel sum, value, a, b and s, of which the last is told from another sheet than its own, `slabs` behind that.
#[inline(always)]
fn sample<S: Simd>(simd: S, slabs: f32, planes: [&[f32]; 7]) -> Sample<S> {
    let zero = simd.lanes(0.0);
    let one = simd.lanes(1.0);
    let inside = one.where_less(Lanes::load(simd, planes[0]), Lanes::load(simd, planes[1]));
    let inside = inside.where_less(simd.lanes(LEAST_WEIGHT), Lanes::load(simd, planes[2]));
    let mut out = [inside; 5];
    for n in 0..INSIDE {
        out[n] = Lanes::load(simd, planes[3 + n]).where_less(zero, inside);
    }
    out[3] = out[3] + simd.lanes(slabs);
    out
}

/// The samples one pixel to the left; outside before the first of all.
#[inline(always)]
fn left_of<S: Simd>(simd: S, sheet: &Sheet, k: usize) -> Sample<S> {
    if k > 0 {
        return sample_at(simd, sheet, k - 1, 0.0);
    }
    let Sheet { near, far, values, weights, places: [a, b], behind, .. } = sheet;
    // Of the planes that tell, 0 is outside.
    let mut shifted = [[0.0; MAX_LANES]; 7];
    for (to, from) in shifted.iter_mut().zip([near, far, weights, values, a, b, behind]) {
        to[1..].copy_from_slice(&from[..MAX_LANES - 1]);
    }
    let [near, far, weights, values, a, b, behind] = &shifted;
    sample(simd, 0.0, [near, far, weights, values, a, b, behind])
}
