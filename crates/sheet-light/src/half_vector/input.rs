//! What half-vector sheets draw.

use crate::SheetInput;
use crate::half_vector::polygons::surfaces::Polygons;
use crate::half_vector::slicing::bodies::{Bodies, SplatBounds};
use splat_core::glam::Vec3;
use splat_core::raster::{Detail, Params, ProjectInput, Projected, project};
use splat_core::shade::LitBy;
use splat_core::{Camera, Cloud, DAabb, FootprintStack, Material, Object, Shading, SplatKind};

/// What is drawn.
#[derive(Clone)]
pub struct HalfInput<'a> {
    /// Volumes, view, lights and ambient radiance. The shadow of a [`LitBy`] is that of everything but the
    /// volumes here, which shadow themselves and each other by the light buffer; `None` for no shadow else. Materials take
    /// [`crate::Volume::shadow_coefficient`] of both.
    pub sheets: SheetInput<'a>,
    /// Splats among the volumes: they shadow them and each other, and take shadows of them. Those of `sheets` are refused, for their
    /// light is known.
    pub splats: Option<HalfSplats<'a>>,
    /// Opaque polygons, anywhere: before, among and behind all that. They hide what is behind them, for the eye and for the lights of
    /// `sheets` and `extended`, and are lit by what comes through to them.
    pub polygons: &'a [Polygons<'a>],
    /// Lights with an extent, a sweep each, whose shadows are soft.
    pub extended: Vec<Extended<'a>>,
    /// Lights beside those, for which there is no sweep: their shadow, that of these volumes included, is known, or they
    /// cast none.
    pub mapped: Vec<LitBy<'a>>,
    /// View depth of what else hides all that at each pixel, +∞ for nothing; or empty.
    pub opaque: &'a [f32],
}

impl HalfInput<'_> {
    /// What there is, as far as it says how slabs lie.
    pub fn bodies(&self) -> Bodies<'_> {
        let splats = self.splats.as_ref().and_then(HalfSplats::bounds);
        Bodies { volumes: &self.sheets.volumes, splats }
    }
}

/// A light with an extent: a sphere, a disk, a rectangle.
///
/// One sweep attenuates along the rays of each of its points, of which each has a z-buffer of the polygons. Unattenuated, it lights as its centre does, by
/// [`splat_core::Light::irradiance`]; and so it is scattered more than once.
#[derive(Clone, Copy)]
pub struct Extended<'a> {
    /// The light, and the shadow of everything but the volumes and polygons, its mean over the light. One without an extent is a point.
    pub lit: LitBy<'a>,
    /// Points that stand for it, those of [`splat_core::Light::points`], 1 to [`MOST_SAMPLES`].
    pub samples: u32,
}

/// Most points of an extended light.
pub const MOST_SAMPLES: u32 = 1024;

/// Splats of the input.
#[derive(Clone, Copy)]
pub struct HalfSplats<'a> {
    /// The splats, all of which are drawn and none of which is opaque. Shadows of lights lie relative to its origin.
    pub cloud: &'a Cloud,
    /// Materials by id.
    pub materials: &'a [Material],
    /// Objects by id: who casts shadows, and how much of one each receives.
    pub objects: &'a [Object],
    /// Footprints by id.
    pub footprints: &'a FootprintStack,
    /// Their footprints in the eye's image, with depths where something opaque hides them, polygons are translucent or depths are asked for, with
    /// objects where these are.
    pub projected: &'a Projected,
    /// Width of the slabs where neither the parameters nor a volume give one, world units, > 0.
    pub slab_width: f64,
}

impl HalfSplats<'_> {
    /// Where they lie; `None` without any.
    pub fn bounds(&self) -> Option<SplatBounds> {
        let bounds_of_cloud = self.cloud.bounds();
        let place = |p: Vec3| self.cloud.origin + p.as_dvec3();
        let bounds = DAabb::new(place(bounds_of_cloud.min), place(bounds_of_cloud.max));
        let Self { slab_width, .. } = *self;
        (!bounds_of_cloud.is_empty()).then_some(SplatBounds { bounds, slab_width, count: self.cloud.len() as u64 })
    }

    /// Whether any asks for light.
    pub(crate) fn are_lit(&self) -> bool {
        let is_lit: Vec<bool> = self.materials.iter().map(|m| m.shading != Shading::Unlit).collect();
        self.cloud.material.iter().any(|m| is_lit[usize::from(*m)])
    }

    /// Whether light that is scattered to surfaces is reflected by any.
    pub(crate) fn have_surfaces(&self) -> bool {
        let is_lit: Vec<bool> = self.materials.iter().map(|m| m.shading == Shading::Phong).collect();
        let mut kinds = self.cloud.kind.iter().zip(&self.cloud.material);
        kinds.any(|(kind, material)| *kind != SplatKind::Medium && is_lit[usize::from(*material)])
    }

    /// The first that is opaque.
    pub(crate) fn opaque(&self) -> Option<usize> {
        self.cloud.kind.iter().position(|kind| *kind == SplatKind::Opaque)
    }

    /// Their footprints in another image.
    pub(crate) fn seen_by(&self, camera: &Camera) -> Projected {
        let Self { cloud, footprints, materials, .. } = *self;
        let params = &Params::default();
        let detail = Detail { depth: false, object: false };
        project(&ProjectInput { cloud, camera, footprints, materials, params, detail })
    }
}
