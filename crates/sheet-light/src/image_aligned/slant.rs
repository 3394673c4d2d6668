//! Slabs along a lattice instead of across the view (Westover 1990; section 2 of the paper): each plane of voxels that lies most nearly across
//! the view is a sheet, into which its kernels go whole. Which planes these are changes where the view passes 45° to the lattice, and
//! the picture with it: popping, which slabs across the view do not have.
//!
//! Rays are parallel, so slabs along a lattice are slabs across the view in sheared coordinates, z + slant·(x, y), in which footprints
//! and lengths of rays are what they were.

use super::viewed::view_axes;
use crate::shared::params::{Aligned, Params};
use crate::shared::slabs::Slabs;
use crate::{Error, SheetInput, Volume};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Packing};

/// Share of a slab by which a ray that enters the lattice at a face of it misses that by rounding.
const AT_A_FACE: f64 = 1e-6;

/// How slabs lie in view space.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Slant {
    /// How much further a slab lies for each unit of x and of y.
    slope: [f64; 2],
    /// Whether planes of a lattice lie in the midst of slabs, so that its faces are slabs' faces.
    is_along_lattice: bool,
}

impl Slant {
    /// Of the slabs that are asked for.
    pub(crate) fn new(input: &SheetInput<'_>, params: &Params) -> Result<Self, Error> {
        if params.aligned == Aligned::View {
            return Ok(Self::default());
        }
        let refuse = |found: &str, expected| Err(Error::parameter("aligned", found, expected));
        if !input.camera.is_orthographic() {
            return refuse("along a lattice in perspective", "slabs across the view, or parallel rays");
        }
        let ([volume], None) = (&input.volumes[..], &input.splats) else {
            return refuse("along a lattice of several", "slabs across the view, or one volume and nothing beside it");
        };
        let axes = view_axes(volume, input.camera);
        let across = axes.inverse().row(most_across(&axes));
        Ok(Self { slope: [across.x / across.z, across.y / across.z], is_along_lattice: true })
    }

    /// From the depth of the view to that of slabs.
    #[inline(always)]
    pub(crate) fn offset(self, x: f64, y: f64) -> f64 {
        self.slope[0] * x + self.slope[1] * y
    }

    /// Whether slabs do not lie across the view.
    #[inline(always)]
    pub(crate) fn is_any(self) -> bool {
        self.slope != [0.0; 2]
    }

    /// A position or a step in view space with its depth among slabs.
    pub(crate) fn sheared(self, place: DVec3) -> DVec3 {
        place + DVec3::Z * self.offset(place.x, place.y)
    }

    /// A place where a ray enters or leaves, by its depth among slabs: at a slab's face exactly where it is there but for rounding.
    pub(crate) fn snapped(self, depth: f64, slabs: &Slabs) -> f64 {
        let nearest = (depth / slabs.width).round();
        let is_at_a_face = self.is_along_lattice && (depth / slabs.width - nearest).abs() < AT_A_FACE;
        if is_at_a_face { nearest * slabs.width } else { depth }
    }

    /// Slopes in single precision.
    #[inline(always)]
    pub(crate) fn single(self) -> [f32; 2] {
        self.slope.map(|s| s as f32)
    }
}

/// The axis of a lattice, by its steps in view space, whose planes lie most nearly across the view; the first of equal ones.
fn most_across(axes: &DMat3) -> usize {
    let inverse = axes.inverse();
    let cosine = |a: usize| (inverse.row(a).z / inverse.row(a).length()).abs();
    // Equal but for rounding is equal.
    (1..3).fold(0, |best, a| if cosine(a) > cosine(best) * (1.0 + 1e-12) { a } else { best })
}

/// Depth along a ray from one plane of voxels to the next.
pub(crate) fn plane_step(volume: &Volume<'_>, camera: &Camera) -> f64 {
    let axes = view_axes(volume, camera);
    let axis = most_across(&axes);
    // Along i and j of a body-centred lattice points of the second one lie half-way.
    let halves = if volume.packing == Packing::BodyCentred && axis < 2 { 0.5 } else { 1.0 };
    halves / axes.inverse().row(axis).z.abs()
}
