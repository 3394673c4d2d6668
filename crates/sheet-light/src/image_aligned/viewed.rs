//! A lattice as the view sees it: where its voxels are, how far their kernels reach, and their footprints.
//!
//! In lattice coordinates the kernel is round. In view space its extent is the ellipsoid M = e²·A·Aᵀ, A the steps of the lattice
//! and e the extent; the kernel here is the product of the footprint of M across the view and of sections of M along it. On a
//! lattice of equal steps at right angles that is the paper's kernel. On others it contains the ellipsoid: what a kernel's
//! middle shifts from slab to slab there is not followed.
//!
//! On a body-centred lattice A are the steps of the Cartesian one that holds the same spectrum: a kernel is round and as wide as there.
//!
//! In perspective the kernel is sheared along the ray through its voxel, so that one footprint serves all slabs.

use super::slant::{Slant, plane_step};
use crate::shared::lattice::near::Near;
use crate::shared::params::Aligned;
use crate::shared::sections::PHASES;
use crate::shared::slabs::Slabs;
use crate::{KernelShape, Params, Volume};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Camera, Packing};
use std::ops::Range;

/// Least standard deviation of a footprint in its narrow direction, pixels: none falls between pixels.
const LEAST_SIGMA_PX: f64 = 0.5;

/// Slant of a footprint, as a correlation, that is none.
const UPRIGHT: f64 = 1e-9;

/// Share of its reach that a voxel must lie before the eye: nearer ones have footprints without bounds.
const NEAREST: f64 = 1.0 / 64.0;

/// Directions across the view in which kernels are measured.
const AROUND: u32 = 8;

/// A footprint in pixels: s = conic·(dx², 2·dx·dy, dy²), 1 at the rim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelFootprint {
    pub(crate) conic: [f32; 3],
    /// Half the width and height of its bounds.
    pub(crate) half: [f32; 2],
}

/// M across the view, a symmetric matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Extent {
    xx: f64,
    xy: f64,
    yy: f64,
}

/// Eight voxels in a row.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Eight {
    /// Where their kernels begin, 256ths of a slab.
    pub(crate) places: [f64; 8],
    /// Whether kernels begin behind the first face and end before the eye.
    pub(crate) is_before_the_eye: [bool; 8],
    /// Pixels per world unit.
    pub(crate) scales: [f64; 8],
    /// Pixels of the picture.
    pub(crate) x: [f32; 8],
    pub(crate) y: [f32; 8],
}

/// One lattice in view space.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Viewed {
    /// View position of lattice point (0, 0, 0), its depth counted from the first slab.
    pub(crate) start: DVec3,
    /// Steps in view space.
    pub(crate) axes: DMat3,
    /// How far the planes of the second lattice of a body-centred one are shifted.
    shift: Option<DVec3>,
    /// Whether the first plane, that of the rim, is one of these.
    is_first_shifted: bool,
    /// e·√M_zz: how far a kernel reaches along the view, world units.
    pub(crate) reach: f64,
    /// World units².
    extent: Extent,
    /// Its least eigenvalue.
    smallest: f64,
    /// The footprint of a pixel a world unit.
    unit: PixelFootprint,
    /// Least eigenvalue of a footprint in pixels².
    least: f64,
    /// Pixels per unit of x/z, or per world unit.
    focal: f64,
    center: [f64; 2],
    /// View depth of the first slab, for perspective.
    origin: Option<f64>,
    pub(crate) width: f64,
    /// Places within a slab at which kernels begin, and how many 256ths of a slab they are apart.
    starts: f64,
    apart: u32,
    /// How much farther kernels reach by that than with all 256, world units.
    rounding: f64,
}

/// Steps of a lattice in view space.
pub(crate) fn view_axes(volume: &Volume<'_>, camera: &Camera) -> DMat3 {
    DMat3::from_cols(camera.axes[0], camera.axes[1], camera.axes[2]).transpose() * volume.axes()
}

/// Steps that kernels and slabs are measured by, in view space: those of the Cartesian lattice of the same spectrum.
pub(crate) fn view_steps(volume: &Volume<'_>, camera: &Camera) -> DMat3 {
    volume.packing.equivalent_steps(view_axes(volume, camera))
}

/// View positions of the corners of a volume.
pub(crate) fn corners(volume: &Volume<'_>, camera: &Camera) -> [DVec3; 8] {
    let dims = volume.grid.dims;
    let origin = volume.origin();
    let axes = volume.axes();
    let low = volume.packing.lowest();
    std::array::from_fn(|c| {
        let index = [0, 1, 2].map(|a| if c >> a & 1 == 1 { low[a] + dims[a] as f64 } else { low[a] });
        camera.view_from_world(origin + axes * DVec3::from_array(index))
    })
}

/// Slabs of a volume, its own, that lack kernels of radius `reach`, because these lie behind the eye; from the one before the eye on.
pub(crate) fn lacking(volume: &Volume<'_>, camera: &Camera, slabs: &Slabs, reach: f64) -> Option<Range<u32>> {
    let nearest = corners(volume, camera).iter().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
    let eye = eye_of(slabs);
    let range = (eye - 1.0).max(0.0) as u32..(eye + reach / slabs.width).ceil().max(0.0) as u32;
    (!camera.is_orthographic() && nearest < reach).then_some(range)
}

/// The eye's place, in slabs.
pub(crate) fn eye_of(slabs: &Slabs) -> f64 {
    -slabs.origin / slabs.width
}

/// The footprint that is 1 at the rim of an ellipse.
fn footprint_within(extent: Extent) -> PixelFootprint {
    let Extent { xx, xy, yy } = extent;
    let norm = 1.0 / (xx * yy - xy * xy);
    // No negative zero.
    let conic = [yy, 0.0 - xy, xx].map(|c| (c * norm) as f32);
    PixelFootprint { conic, half: [libm::sqrt(xx) as f32, libm::sqrt(yy) as f32] }
}

impl Viewed {
    pub(crate) fn new(volume: &Volume<'_>, camera: &Camera, slabs: &Slabs, params: &Params, slant: Slant) -> Self {
        let upright = view_axes(volume, camera);
        let axes = if slant.is_any() {
            DMat3::from_cols(
                slant.sheared(upright.x_axis),
                slant.sheared(upright.y_axis),
                slant.sheared(upright.z_axis),
            )
        } else {
            upright
        };
        let e2 = params.kernel.extent * params.kernel.extent;
        let steps = volume.packing.equivalent_steps(axes);
        let m = steps * steps.transpose() * e2;
        let least_radius = LEAST_SIGMA_PX * params.kernel.extent / params.kernel.sigma;
        let xx = m.x_axis.x;
        let xy = m.x_axis.y;
        let yy = m.y_axis.y;
        // Equal steps at right angles leave a rounding of a slant, and what is upright is drawn faster.
        let tilt = if xy.abs() > UPRIGHT * libm::sqrt(xx * yy) { xy } else { 0.0 };
        // Rows of pixels run down.
        let extent = Extent { xx, xy: -tilt, yy };
        let half = 0.5 * (extent.xx - extent.yy);
        let smallest = 0.5 * (extent.xx + extent.yy) - libm::sqrt(half * half + extent.xy * extent.xy);
        let mut start = slant.sheared(camera.view_from_world(volume.origin()));
        start.z -= slabs.origin;
        Self {
            start,
            axes,
            shift: (volume.packing == Packing::BodyCentred).then(|| (axes.x_axis + axes.y_axis) * 0.5),
            is_first_shifted: false,
            reach: match params.aligned {
                Aligned::View => libm::sqrt(m.z_axis.z),
                // All of it in the slab of its plane.
                Aligned::Axis => 0.5 * plane_step(volume, camera),
            },
            extent,
            smallest,
            unit: footprint_within(extent),
            least: least_radius * least_radius,
            focal: camera.focal_px(),
            center: camera.size.map(|s| 0.5 * f64::from(s)),
            origin: (!camera.is_orthographic()).then_some(slabs.origin),
            width: slabs.width,
            starts: f64::from(params.sections),
            apart: PHASES / params.sections,
            rounding: params.rounding() * slabs.width,
        }
    }

    /// Counts lattice points from the corner of a rim around the lattice.
    pub(crate) fn with_rim(self, rim: [usize; 3]) -> Self {
        let steps = DVec3::from_array(rim.map(|n| n as f64));
        Self { start: self.start - self.axes * steps, is_first_shifted: rim[2] % 2 == 1, ..self }
    }

    /// View position of lattice point (i, j, k), depth counted from the first slab.
    pub(crate) fn position(&self, i: usize, j: usize, k: usize) -> DVec3 {
        let place = self.start + self.axes * DVec3::new(i as f64, j as f64, k as f64);
        match self.shift {
            Some(shift) if (k % 2 == 1) != self.is_first_shifted => place + shift,
            _ => place,
        }
    }

    /// Where the kernel of a voxel at this depth begins, in 256ths of a slab: the slab is the quotient by 256, the phase the
    /// rest. Rounded, so that a lattice that lies evenly in the slabs stays clear of the edges of phases. `None` for a kernel that
    /// begins before the first slab, and ends behind the eye.
    #[inline(always)]
    pub(crate) fn place(&self, depth: f32) -> Option<u32> {
        let slabs = (f64::from(depth) - self.reach) / self.width;
        (slabs >= 0.0).then_some((slabs * self.starts + 0.5) as u32 * self.apart)
    }

    /// The depth of the middle of a kernel that begins there.
    #[inline(always)]
    pub(crate) fn depth(&self, place: u32) -> f64 {
        f64::from(place) * (self.width / f64::from(PHASES)) + self.reach
    }

    /// Eight voxels in a row, the first at a view position: [`Viewed::place`], [`Viewed::scale`] and [`Viewed::pixel`] of each.
    #[inline(always)]
    pub(crate) fn eight(&self, start: DVec3) -> Eight {
        let mut out = Eight::default();
        let center = self.center.map(|c| c as f32);
        let origin = self.origin.unwrap_or(0.0);
        for i in 0..8 {
            let place = start + self.axes.x_axis * i as f64;
            let slabs = (f64::from(place.z as f32) - self.reach) / self.width;
            out.places[i] = (slabs * self.starts + 0.5).trunc() * f64::from(self.apart);
            let z = origin + out.places[i] * (self.width / f64::from(PHASES)) + self.reach;
            let is_near = self.origin.is_some() && z < NEAREST * self.reach;
            out.is_before_the_eye[i] = slabs >= 0.0 && !is_near;
            out.scales[i] = if self.origin.is_some() { self.focal / z } else { self.focal };
            let scale = out.scales[i] as f32;
            (out.x[i], out.y[i]) = (center[0] + place.x as f32 * scale, center[1] - place.y as f32 * scale);
        }
        out
    }

    /// Pixels per world unit at a depth; `None` too near the eye.
    #[inline(always)]
    pub(crate) fn scale(&self, depth: f64) -> Option<f64> {
        let Some(origin) = self.origin else {
            return Some(self.focal);
        };
        let z = origin + depth;
        (z >= NEAREST * self.reach).then(|| self.focal / z)
    }

    /// Pixel of a view position at `scale`.
    #[inline(always)]
    pub(crate) fn pixel(&self, place: Vec3, scale: f32) -> [f32; 2] {
        [self.center[0] as f32 + place.x * scale, self.center[1] as f32 - place.y * scale]
    }

    /// The footprint at `scale`; widened where it would fall between pixels.
    #[inline(always)]
    pub(crate) fn footprint(&self, scale: f64) -> PixelFootprint {
        if self.smallest * scale * scale >= self.least {
            let inverse = (1.0 / scale) as f32;
            let scale = scale as f32;
            let PixelFootprint { conic: [a, b, c], half: [x, y] } = self.unit;
            let square = inverse * inverse;
            return PixelFootprint { conic: [a * square, b * square, c * square], half: [x * scale, y * scale] };
        }
        footprint_within(self.extent_px(scale))
    }

    /// Extent of a footprint in pixels².
    #[inline(always)]
    fn extent_px(&self, scale: f64) -> Extent {
        let wider = (self.least - self.smallest * scale * scale).max(0.0);
        let Extent { xx, xy, yy } = self.extent;
        Extent { xx: xx * scale * scale + wider, xy: xy * scale * scale, yy: yy * scale * scale + wider }
    }

    /// The same in world units², where a footprint is widened most.
    fn widest_extent(&self, scale: f64) -> Extent {
        let Extent { xx, xy, yy } = self.extent_px(scale);
        let square = scale * scale;
        Extent { xx: xx / square, xy: xy / square, yy: yy / square }
    }

    /// Lattice steps along each axis within which lie all voxels whose kernels reach a point where a pixel's ray crosses a
    /// slab, or the neighbours that a gradient is taken from.
    pub(crate) fn lattice_reach(&self, camera: &Camera, slabs: &Slabs, gradient: bool) -> [usize; 3] {
        let far = slabs.width * f64::from(slabs.count);
        let scale = self.scale(far).unwrap_or(self.focal);
        let neighbour = if gradient { 1.0 } else { 0.0 };
        let Extent { xx, xy, yy } = self.widest_extent(scale);
        let pixel = neighbour / scale;
        // A sheet holds means over its slab, whose middle may lie beyond a volume's face; values there are in part those of the next sheet.
        let along = self.reach + (1.5 + neighbour) * slabs.width + self.rounding;
        let inverse = self.axes.inverse();
        let rays = corner_rays(camera);
        [0, 1, 2].map(|a| {
            let row = inverse.row(a);
            // Rows of pixels run down, view space up.
            let across = libm::sqrt((row.x * row.x * xx - 2.0 * row.x * row.y * xy + row.y * row.y * yy).max(0.0));
            let slanted = most_along(row, &rays);
            let steps = across + (row.x.abs() + row.y.abs()) * pixel + slanted * along;
            // From any place of a cell; half a step more between planes that are shifted and such that are not.
            let shift = if self.shift.is_some() && a < 2 { 0.5 } else { 0.0 };
            (steps + 0.5 + shift).min(1e6) as usize
        })
    }

    /// Lattice steps along each axis within which the places of sheets lie that are `apart` slabs away, and with `gradient` those of neighbouring pixels.
    pub(crate) fn steps_to_neighbours(&self, camera: &Camera, slabs: &Slabs, apart: f64, gradient: bool) -> [usize; 3] {
        let far = slabs.width * f64::from(slabs.count);
        let pixel = if gradient { 1.0 / self.scale(far).unwrap_or(self.focal) } else { 0.0 };
        let inverse = self.axes.inverse();
        let rays = corner_rays(camera);
        [0, 1, 2].map(|a| {
            let row = inverse.row(a);
            let steps = most_along(row, &rays) * apart * slabs.width + row.x.abs().max(row.y.abs()) * pixel;
            // What lies at a step by rounding does.
            ((steps - 1e-9).ceil()).clamp(0.0, 1e6) as usize
        })
    }

    /// Voxels that have a share in anything that a voxel shapes: both have one in a place where a pixel's ray crosses a slab, or in one of those before
    /// and behind it, which tell how values go on at faces and which gradients are taken from; with `gradient` one of the two in the neighbouring
    /// pixels, too. With `is_near`, values near the eye are told from two sheets, and both have a share in these.
    pub(crate) fn near(
        &self,
        camera: &Camera,
        slabs: &Slabs,
        kernel: &KernelShape,
        gradient: bool,
        is_near: bool,
    ) -> Near {
        /// Half a slab and the next one, for either of the two; depths are rounded to phases.
        const SLABS: f64 = 3.0 + 4.0 / PHASES as f64;
        let far = slabs.width * f64::from(slabs.count);
        let scale = self.scale(far).unwrap_or(self.focal);
        let Extent { xx, xy, yy } = self.widest_extent(scale);
        let pixel = if gradient { 1.0 / scale } else { 0.0 };
        // Kernels, and the corners of a cell, between which shadows are interpolated.
        let twice = 1.0 + (libm::sqrt(3.0) / kernel.extent).max(1.0);
        let along = twice * self.reach + 2.0 * self.rounding + (SLABS + if is_near { 2.0 } else { 0.0 }) * slabs.width;
        let rays = corner_rays(camera);
        let reach = |n: DVec3| {
            // Rows of pixels run down, view space up.
            let across = libm::sqrt((n.x * n.x * xx - 2.0 * n.x * n.y * xy + n.y * n.y * yy).max(0.0));
            let slanted = most_along(n, &rays);
            let shifted = self.shift.map_or(0.0, |shift| n.dot(shift).abs());
            twice * across + n.x.abs().max(n.y.abs()) * pixel + slanted * along + shifted
        };
        let around = |a: u32| {
            let (sin, cos) = libm::sincos(f64::from(a) * (std::f64::consts::PI / f64::from(AROUND)));
            DVec3::new(cos, sin, 0.0)
        };
        let directions: Vec<_> = (0..AROUND).map(around).chain([DVec3::Z]).collect();
        Near::within(&self.axes, &directions, reach)
    }
}

/// Directions of the rays through the corners of the picture, a unit of view depth long.
fn corner_rays(camera: &Camera) -> [DVec3; 4] {
    let [width, height] = camera.size.map(f64::from);
    [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].map(|[x, y]| camera.view_ray(x, y).1)
}

/// How far any of them leads along a direction.
fn most_along(direction: DVec3, rays: &[DVec3]) -> f64 {
    rays.iter().map(|ray| direction.dot(*ray).abs()).fold(0.0, f64::max)
}
