//! Projection of splats to image-space footprints.
//!
//! **Medium.** For a centre c = z(u₀, v₀, 1) and a ray d = (u₀+du, v₀+dv, 1) the squared distance of the centre from the
//! ray is ρ² = |c × d|²/|d|² = z²·(du² + dv² + (u₀dv − v₀du)²)/|d|²: a quadratic form in the pixel offset, exact in
//! perspective, over a factor that depends on the pixel alone. Nothing cancels for far centres.
//!
//! **Disc.** The tangent disc is projected by its Jacobian at the centre (Zwicker's EWA): conic = (J Jᵀ + filter)⁻¹.

use super::Params;
use super::lanes::exp_neg;
use crate::{Camera, Cloud, FootprintStack, Material, SplatKind, ViewTransform};
use glam::{Mat2, Vec2, Vec3};
use rayon::prelude::*;

/// The footprint of one splat in the image. Pixel centres lie at half-integers, y runs down.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))] // one cache line
pub struct ProjectedSplat {
    /// Image position of the centre, pixels.
    pub center_px: [f32; 2],
    /// s = a·dx² + 2b·dx·dy + c·dy² in 1/pixel², s < 1 inside; for a medium in perspective times the pixel's 1/|d|².
    pub conic: [f32; 3],
    /// View depth of the centre.
    pub depth: f32,
    /// Change of view depth per pixel across a disc; 0 for a medium.
    pub depth_slope: [f32; 2],
    /// Largest distance in depth between a fragment and the centre: R.
    pub depth_extent: f32,
    /// Optical depth where the profile is 1: K·norm/R². For an opaque splat the weight there, area·norm/R².
    pub peak: f32,
    /// q of the footprint.
    pub sharpness: f32,
    /// e^−q.
    pub rim: f32,
    /// Pixel rectangle [x0, x1) × [y0, y1), clipped to the image; empty when nothing is visible.
    pub bounds: [u16; 4],
    /// Object id.
    pub object: u32,
    /// Material id.
    pub material: u16,
    /// Medium, surface or opaque.
    pub kind: SplatKind,
}

/// Footprints of all splats of a cloud, by id; those that no pixel shows are empty.
#[derive(Debug, Clone, Default)]
pub struct Projected {
    /// The footprints.
    pub splats: Vec<ProjectedSplat>,
    /// Focal length, pixels, and image centre for rays; `None` for parallel rays.
    pub(crate) perspective: Option<f32>,
    /// Image size, pixels.
    pub size: [u32; 2],
}

impl Projected {
    /// Whether splat `i` covers a pixel's rectangle at all.
    pub fn is_visible(&self, i: usize) -> bool {
        self.splats[i].is_visible()
    }
}

impl ProjectedSplat {
    /// Whether the footprint has any pixel.
    pub fn is_visible(&self) -> bool {
        self.bounds[0] < self.bounds[1]
    }
}

/// What all splats of a projection share.
struct Projector<'a> {
    cloud: &'a Cloud,
    footprints: Vec<ProjectedFootprint>,
    materials: &'a [Material],
    view: ViewTransform,
    focal: f32,
    half: Vec2,
    orthographic: bool,
    size: [u32; 2],
    filter_sigma_px: f32,
}

/// What projection needs of a footprint, computed once.
struct ProjectedFootprint {
    cutoff: f32,
    sharpness: f32,
    rim: f32,
    norm: f32,
}

/// Projects all splats of `cloud`.
///
/// In the order of ids, which is that of memory: splats in view order lie far apart, and gathering their attributes one
/// column at a time would cost more than projecting those that turn out to be hidden.
///
/// # Panics
/// If a material or a footprint of the cloud is out of range; `Cloud::validate` and the tables promise it is not.
pub fn project(
    cloud: &Cloud,
    camera: &Camera,
    footprints: &FootprintStack,
    materials: &[Material],
    params: &Params,
) -> Projected {
    let projector = Projector {
        cloud,
        footprints: footprints
            .layers()
            .iter()
            .map(|f| ProjectedFootprint {
                cutoff: f.cutoff,
                sharpness: f.sharpness(),
                rim: exp_neg(f.sharpness()),
                norm: f.norm() as f32,
            })
            .collect(),
        materials,
        view: camera.view_from_offset(cloud.origin),
        focal: camera.focal_px() as f32,
        half: Vec2::new(camera.size[0] as f32, camera.size[1] as f32) * 0.5,
        orthographic: camera.is_orthographic(),
        size: camera.size,
        filter_sigma_px: params.resampling_sigma_px,
    };
    let splats = (0..cloud.len()).into_par_iter().with_min_len(4096).map(|i| projector.project(i)).collect();
    let perspective = (!camera.is_orthographic()).then_some(projector.focal);
    Projected { splats, perspective, size: camera.size }
}

impl Projector<'_> {
    fn project(&self, i: usize) -> ProjectedSplat {
        let cloud = self.cloud;
        let center = self.view.apply(cloud.position[i]);
        let radius = cloud.radius[i];
        // A splat around the eye has no image; it is left out as a whole.
        if !self.orthographic && center.z <= radius {
            return ProjectedSplat::default();
        }
        let kind = cloud.kind[i];
        let px_per_world = if self.orthographic { self.focal } else { self.focal / center.z };
        let footprint = &self.footprints[cloud.footprint[i] as usize];
        let filter_px = footprint.cutoff * self.filter_sigma_px;
        let mut out = ProjectedSplat {
            center_px: self.image_position(center, px_per_world),
            depth: center.z,
            depth_extent: radius,
            sharpness: footprint.sharpness,
            rim: footprint.rim,
            object: cloud.object[i],
            material: cloud.material[i],
            kind,
            ..ProjectedSplat::default()
        };
        match kind {
            SplatKind::Medium => self.medium(&mut out, i, center, px_per_world, filter_px, footprint.norm),
            SplatKind::Surface | SplatKind::Opaque => {
                self.disc(&mut out, i, center, px_per_world, filter_px, footprint.norm)
            }
        }
        self.clip(&mut out, radius / center.z.abs().max(radius));
        out
    }

    fn image_position(&self, center: Vec3, px_per_world: f32) -> [f32; 2] {
        [self.half.x + center.x * px_per_world, self.half.y - center.y * px_per_world]
    }

    fn medium(&self, out: &mut ProjectedSplat, i: usize, c: Vec3, px_per_world: f32, filter_px: f32, norm: f32) {
        let filter_world = filter_px / px_per_world;
        let radius_sq = self.cloud.radius[i] * self.cloud.radius[i] + filter_world * filter_world;
        let scale = 1.0 / (px_per_world * px_per_world * radius_sq);
        let (u, v) = if self.orthographic { (0.0, 0.0) } else { (c.x / c.z, c.y / c.z) };
        // y runs down in the image, so the mixed term changes its sign.
        out.conic = [(1.0 + v * v) * scale, u * v * scale, (1.0 + u * u) * scale];
        out.peak = self.cloud.cross_section[i] * norm / radius_sq;
    }

    fn disc(&self, out: &mut ProjectedSplat, i: usize, c: Vec3, px_per_world: f32, filter_px: f32, norm: f32) {
        let normal = self.view.rotation * self.cloud.normal_of(i);
        let (axis_u, axis_v) = self.disc_axes(i, normal);
        let to_image = |a: Vec3| {
            // d(x/z) = (dx − (x/z)·dz)/z; parallel rays have no dz term.
            let (u, v) = if self.orthographic { (0.0, 0.0) } else { (c.x / c.z, c.y / c.z) };
            Vec2::new((a.x - u * a.z) * px_per_world, -(a.y - v * a.z) * px_per_world)
        };
        let (ju, jv) = (to_image(axis_u), to_image(axis_v));
        let filter_sq = filter_px * filter_px;
        let area_sq = ju.perp_dot(jv).powi(2);
        let m = Mat2::from_cols(
            Vec2::new(ju.x * ju.x + jv.x * jv.x + filter_sq, ju.x * ju.y + jv.x * jv.y),
            Vec2::new(ju.x * ju.y + jv.x * jv.y, ju.y * ju.y + jv.y * jv.y + filter_sq),
        );
        // det = |J|² + filter²·trace(JJᵀ) + filter⁴, written so that an edge-on disc does not cancel.
        let det = area_sq + filter_sq * (ju.length_squared() + jv.length_squared()) + filter_sq * filter_sq;
        if det <= 0.0 {
            return;
        }
        out.conic = [m.y_axis.y / det, -m.x_axis.y / det, m.x_axis.x / det];
        let radius_sq = axis_u.length() * axis_v.length();
        // The filter spreads the same optical depth over a larger image area.
        let spread = (area_sq / det).sqrt();
        let view_dir = if self.orthographic { Vec3::Z } else { c / c.length() };
        let cosine = normal.dot(view_dir);
        let factor = if out.kind == SplatKind::Surface {
            self.materials[out.material as usize].surface_opacity.optical_depth_factor(cosine)
        } else {
            1.0
        };
        out.peak = self.cloud.cross_section[i] * norm / radius_sq * spread * factor;
        out.depth_slope = self.plane_slope(normal, c, px_per_world);
    }

    /// Semi-axes of the disc in view space.
    fn disc_axes(&self, i: usize, normal: Vec3) -> (Vec3, Vec3) {
        let (radius, tangent) = (self.cloud.radius[i], self.cloud.tangent_of(i));
        if tangent == Vec3::ZERO {
            let u = normal.any_orthonormal_vector();
            (u * radius, normal.cross(u) * radius)
        } else {
            let u = self.view.rotation * tangent;
            (u, normal.cross(u).normalize_or_zero() * radius)
        }
    }

    /// Change of view depth per pixel in x and y on the plane through `c`.
    fn plane_slope(&self, normal: Vec3, c: Vec3, px_per_world: f32) -> [f32; 2] {
        let along_ray = if self.orthographic { normal.z } else { normal.dot(c) / c.z };
        // An edge-on plane has no slope that could be used; its fragments stay at the centre's depth.
        if along_ray.abs() < 1e-4 {
            return [0.0; 2];
        }
        [-normal.x / along_ray / px_per_world, normal.y / along_ray / px_per_world]
    }

    /// Pixel rectangle of s < 1; `relative_radius` = R/z widens it for the change of |d|² across a medium's footprint.
    fn clip(&self, out: &mut ProjectedSplat, relative_radius: f32) {
        let [a, b, c] = out.conic;
        let det = a * c - b * b;
        if det.is_nan() || det <= 0.0 || out.peak.is_nan() || out.peak <= 0.0 {
            out.peak = 0.0;
            return;
        }
        let mut widen = 1.0;
        if out.kind == SplatKind::Medium && !self.orthographic {
            // |d|² at the centre: the conic holds ρ²·|d|².
            let [x, y] = out.center_px;
            let (u, v) = ((x - self.half.x) / self.focal, (y - self.half.y) / self.focal);
            widen = (1.0 + u * u + v * v).sqrt() * (1.0 + 2.0 * relative_radius);
        }
        let range = |center: f32, extent: f32, limit: u32| {
            // Pixel i is covered when |i + ½ − centre| < extent; casts round down, and on the rim itself w = 0.
            let clamp = |v: f32| v.clamp(0.0, limit as f32) as u16;
            (clamp(center - extent + 0.5), clamp(center + extent + 0.5))
        };
        let (x0, x1) = range(out.center_px[0], (c / det).sqrt() * widen, self.size[0]);
        let (y0, y1) = range(out.center_px[1], (a / det).sqrt() * widen, self.size[1]);
        if x0 < x1 && y0 < y1 {
            out.bounds = [x0, x1, y0, y1];
        }
    }
}
