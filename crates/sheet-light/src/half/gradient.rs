//! Gradients of a sheet's values from neighbouring pixels and sheets (step 16 of the pseudocode).
//!
//! Values are known by pixel (i, j) and by depth s across the slabs. With n the slabs' normal, f pixels per unit of x/z, u = x/z
//! and v = y/z, ∂x = ∂i·f/z + ∂s·(n·right), ∂y = −∂j·f/z + ∂s·(n·up), ∂z = (v·∂j − u·∂i)·f/z + ∂s·(n·forward); f/z is one number
//! and u = v = 0 where rays are parallel. Differences are central, one-sided beside a sample that is outside the volume. A
//! neighbour that lies at another depth, because its ray enters or leaves within the slab, is brought to this one by ∂s.

use super::frame::Frame;
use super::sheet::Sheet;
use crate::sheets::LEAST_WEIGHT;
use splat_core::Camera;
use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// What a view has to do with the slabs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gradients {
    axes: [Vec3; 3],
    /// The slabs' normal along right, up and forward.
    normal: [f32; 3],
    focal: f32,
    center: [f32; 2],
    /// Depth of the eye across the slabs; `None` where rays are parallel.
    eye: Option<f32>,
    width: f32,
}

/// Value, depth across the slabs, and 1 for a sample that is inside, else 0.
type Sample<S> = [Lanes<S>; 3];

impl Gradients {
    pub(crate) fn new(frame: &Frame, camera: &Camera) -> Self {
        Self {
            axes: camera.axes.map(|axis| axis.as_vec3()),
            normal: camera.axes.map(|axis| frame.direction(axis).z as f32),
            focal: camera.focal_px() as f32,
            center: camera.size.map(|s| 0.5 * s as f32),
            eye: (!camera.is_orthographic()).then(|| frame.point(camera.position).z as f32),
            width: frame.slabs.width as f32,
        }
    }

    /// −∇v/|∇v| of neighbouring pixels from (x, y) of the image on, place `k` of the sheets; zero where there is no gradient.
    #[inline(always)]
    pub(crate) fn normals<S: Simd>(
        &self,
        simd: S,
        sheets: [&Sheet; 3],
        stride: usize,
        k: usize,
        [x, y]: [usize; 2],
    ) -> [Vec3; MAX_LANES] {
        let of = |v: f32| Lanes::splat(simd, v);
        let [right, down, along] = differences(simd, sheets, stride, k);
        let mut counting = [0.0; MAX_LANES];
        (0..MAX_LANES).for_each(|lane| counting[lane] = (x + lane) as f32 + 0.5);
        let (mut u, mut v, mut scale) = (of(0.0), of(0.0), of(self.focal));
        let [across, upward, forward] = self.normal;
        if let Some(eye) = self.eye {
            u = (Lanes::load(simd, &counting) - of(self.center[0])) / of(self.focal);
            v = of((self.center[1] - (y as f32 + 0.5)) / self.focal);
            let depth = at(simd, sheets[1], k)[1] - of(eye);
            scale = scale * u.mul_add(of(across), v.mul_add(of(upward), of(forward))) / depth;
        }
        // Per slab width, so that no scale of the scene makes it vanish.
        let (right, down) = (right * scale * of(self.width), down * scale * of(self.width));
        let along = along * of(self.width);
        let gradient = [
            along.mul_add(of(across), right),
            along.mul_add(of(upward), of(0.0) - down),
            along.mul_add(of(forward), v * down - u * right),
        ];
        let mut parts = [[0.0; MAX_LANES]; 3];
        (0..3).for_each(|a| gradient[a].store(&mut parts[a]));
        std::array::from_fn(|lane| {
            let [x, y, z] = parts.map(|part| part[lane]);
            -(self.axes[0] * x + self.axes[1] * y + self.axes[2] * z).normalize_or_zero()
        })
    }
}

/// ∂i, ∂j and ∂s.
#[inline(always)]
fn differences<S: Simd>(simd: S, [before, here, after]: [&Sheet; 3], stride: usize, k: usize) -> [Lanes<S>; 3] {
    let own = at(simd, here, k);
    let along = slope(simd, own, at(simd, before, k), at(simd, after, k));
    let neighbours = |one: Sample<S>, other: Sample<S>| {
        let half = Lanes::splat(simd, 0.5);
        // Brought to this depth.
        let choose = |[v, depth, is]: Sample<S>| (own[1] - depth).mul_add(along, v).where_less_or(half, is, own[0]);
        (choose(other) - choose(one)) / (one[2] + other[2]).max(half)
    };
    let none = [own[0], own[1], Lanes::splat(simd, 0.0)];
    let left = left_of(simd, here, k);
    let rows = here.near.len();
    let above = if k >= stride { at(simd, here, k - stride) } else { none };
    let below = if k + stride < rows { at(simd, here, k + stride) } else { none };
    [neighbours(left, at(simd, here, k + 1)), neighbours(above, below), along]
}

/// ∂s from the sheets before and behind.
#[inline(always)]
fn slope<S: Simd>(simd: S, own: Sample<S>, before: Sample<S>, after: Sample<S>) -> Lanes<S> {
    let (zero, half) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 0.5));
    let choose = |s: Sample<S>| [0, 1].map(|n| s[n].where_less_or(half, s[2], own[n]));
    let ([low, from], [high, to]) = (choose(before), choose(after));
    let one = Lanes::splat(simd, 1.0);
    ((high - low) / (to - from).where_less_or(from, to, one)).where_less(zero, to - from)
}

#[inline(always)]
fn at<S: Simd>(simd: S, sheet: &Sheet, k: usize) -> Sample<S> {
    let [near, far, value, weight] =
        [&sheet.near, &sheet.far, &sheet.values, &sheet.weights].map(|plane| Lanes::load(simd, &plane[k..]));
    sample(simd, near, far, value, weight)
}

#[inline(always)]
fn sample<S: Simd>(simd: S, near: Lanes<S>, far: Lanes<S>, value: Lanes<S>, weight: Lanes<S>) -> Sample<S> {
    let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let inside = one.where_less(near, far).where_less(Lanes::splat(simd, LEAST_WEIGHT), weight);
    let middle = (near + far) * Lanes::splat(simd, 0.5);
    [value.where_less(zero, inside), middle.where_less(zero, inside), inside]
}

/// The samples one pixel to the left; outside before the first of all.
#[inline(always)]
fn left_of<S: Simd>(simd: S, sheet: &Sheet, k: usize) -> Sample<S> {
    if k > 0 {
        return at(simd, sheet, k - 1);
    }
    let shifted = |plane: &[f32], first: f32| {
        let mut out = [first; MAX_LANES];
        out[1..].copy_from_slice(&plane[..MAX_LANES - 1]);
        Lanes::load(simd, &out)
    };
    let near = shifted(&sheet.near, f32::INFINITY);
    sample(simd, near, shifted(&sheet.far, 0.0), shifted(&sheet.values, 0.0), shifted(&sheet.weights, 0.0))
}
