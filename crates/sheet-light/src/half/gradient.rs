//! Gradients of a sheet's values from neighbouring pixels and sheets (step 16 of the pseudocode).
//!
//! A sample is the value of a sheet at a place (a, b) of its slab. With Δ for differences between the samples of two neighbours,
//! columns and rows of pixels give the gradient along the slab, Δv = ∂a·Δa + ∂b·Δb, and neighbouring sheets the rest,
//! Δv = ∂a·Δa + ∂b·Δb + ∂s·Δs. Differences are central, one-sided beside a sample that is outside the volume.

use super::frame::Frame;
use super::sheet::Sheet;
use crate::sheets::LEAST_WEIGHT;
use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// What gradients are turned by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gradients {
    /// Of slab coordinates, world space.
    axes: [Vec3; 3],
    /// Slab width.
    width: f32,
}

/// Value, a and b, and 1 for a sample that is inside, else 0.
type Sample<S> = [Lanes<S>; 4];

/// Place of the last in a sample.
const INSIDE: usize = 3;

impl Gradients {
    pub(crate) fn new(frame: &Frame) -> Self {
        Self { axes: frame.axes.map(|axis| axis.as_vec3()), width: frame.slabs.width as f32 }
    }

    /// −∇v/|∇v| of neighbouring pixels from place `k` of the sheets before, here and behind; zero where there is no gradient.
    #[inline(always)]
    pub(crate) fn normals<S: Simd>(
        &self,
        simd: S,
        [before, here, after]: [&Sheet; 3],
        stride: usize,
        k: usize,
    ) -> [Vec3; MAX_LANES] {
        let of = |v: f32| Lanes::splat(simd, v);
        let own = at(simd, here, k);
        let none = [own[0], own[1], own[2], of(0.0)];
        let above = if k >= stride { at(simd, here, k - stride) } else { none };
        let below = if k + stride < here.near.len() { at(simd, here, k + stride) } else { none };
        let [vx, ax, bx] = difference(simd, &own, &left_of(simd, here, k), &at(simd, here, k + 1));
        let [vy, ay, by] = difference(simd, &own, &above, &below);
        let (before, after) = (at(simd, before, k), at(simd, after, k));
        let [vs, a, b] = difference(simd, &own, &before, &after);
        // Per slab width, so that no scale of the scene makes anything vanish.
        let width = of(self.width);
        let determinant = ax * by - bx * ay;
        let inverse = width / of(1.0).where_less_or(determinant.abs(), of(f32::MIN_POSITIVE), determinant);
        let (least, size) = (of(f32::MIN_POSITIVE), determinant.abs());
        let da = ((vx * by - vy * bx) * inverse).where_less(least, size);
        let db = ((vy * ax - vx * ay) * inverse).where_less(least, size);
        let steps = before[INSIDE] + after[INSIDE];
        let ds = (vs - (da * a + db * b) / width) / steps.max(of(0.5));
        let gradient = [da, db, ds.where_less(of(0.5), steps)];
        let mut parts = [[0.0; MAX_LANES]; 3];
        for n in 0..3 {
            gradient[n].store(&mut parts[n]);
        }
        std::array::from_fn(|lane| {
            let [a, b, s] = parts.map(|part| part[lane]);
            -(self.axes[0] * a + self.axes[1] * b + self.axes[2] * s).normalize_or_zero()
        })
    }
}

/// Differences of value, a and b between two neighbours, each of which this sample stands for where it is outside.
#[inline(always)]
fn difference<S: Simd>(simd: S, own: &Sample<S>, before: &Sample<S>, after: &Sample<S>) -> [Lanes<S>; 3] {
    let half = Lanes::splat(simd, 0.5);
    let mut out = [half; 3];
    for n in 0..3 {
        let high = after[n].where_less_or(half, after[INSIDE], own[n]);
        out[n] = high - before[n].where_less_or(half, before[INSIDE], own[n]);
    }
    out
}

#[inline(always)]
fn at<S: Simd>(simd: S, sheet: &Sheet, k: usize) -> Sample<S> {
    let Sheet { near, far, values, weights, at: [a, b], .. } = sheet;
    sample(simd, [&near[k..], &far[k..], &weights[k..], &values[k..], &a[k..], &b[k..]])
}

/// Of near, far, kernel sum, value, a and b.
#[inline(always)]
fn sample<S: Simd>(simd: S, of: [&[f32]; 6]) -> Sample<S> {
    let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let inside = one.where_less(Lanes::load(simd, of[0]), Lanes::load(simd, of[1]));
    let inside = inside.where_less(Lanes::splat(simd, LEAST_WEIGHT), Lanes::load(simd, of[2]));
    let mut out = [inside; 4];
    for n in 0..INSIDE {
        out[n] = Lanes::load(simd, of[3 + n]).where_less(zero, inside);
    }
    out
}

/// The samples one pixel to the left; outside before the first of all.
#[inline(always)]
fn left_of<S: Simd>(simd: S, sheet: &Sheet, k: usize) -> Sample<S> {
    if k > 0 {
        return at(simd, sheet, k - 1);
    }
    let Sheet { near, far, values, weights, at: [a, b], .. } = sheet;
    // Of the planes that tell, 0 is outside.
    let mut shifted = [[0.0; MAX_LANES]; 6];
    for (to, from) in shifted.iter_mut().zip([near, far, weights, values, a, b]) {
        to[1..].copy_from_slice(&from[..MAX_LANES - 1]);
    }
    let [near, far, weights, values, a, b] = &shifted;
    sample(simd, [near, far, weights, values, a, b])
}
