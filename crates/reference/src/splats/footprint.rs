//! The definition of a splat's image in f64, from the geometry of one ray and one splat.
//!
//! Medium: τ = K·n/R'²·w(ρ²/R'²), ρ the distance of the centre from the ray, R'² = R² + (filter in world units)².
//! Disc: the projection of the tangent disc by its Jacobian at the centre, widened by the resampling filter. Of discs that
//! reach through the eye plane what lies on the ray before the eye; in perspective, for all whose ball does, not widened.
//! Gaussian: see `gaussian.rs`. A disc whose footprint is an image: see `pattern.rs`.
//! Share of a medium before a plane across the view: ∫ 35/32·(1 − u²)³ du up to u = distance/3δ, δ the kernel's deviation.
//! w(s) = e^(−qs) − e^(−q)(1 + x + x²/2), x = q(1 − s), q = cutoff²/2.

use crate::Input;
use crate::splats::gaussian::Gaussian;
use crate::splats::pattern::{Laid, Pattern, Seen};
use glam::{DMat2, DVec2, DVec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{FootprintStack, SplatKind};
use std::f64::consts::PI;

/// Weight of an opaque disc that faces away, part of the definition of an opaque splat.
const FACING_AWAY: f64 = 1.0 / 256.0;

/// Share of an opaque disc's radius that hides, squared, and the filter there, part of the definition of an opaque splat.
const CORE: f64 = 0.45 * 0.45;
const CORE_FILTER_PX: f64 = 1.0 / 32.0;

/// One splat seen by the camera, in f64.
pub(crate) struct Splat<'a> {
    pub(crate) kind: SplatKind,
    pub(crate) depth: f64,
    pub(crate) radius: f64,
    pub(crate) material: usize,
    center: DVec3,
    center_px: DVec2,
    cutoff_sq_half: f64,
    /// K·n/R'², or area·n/R² for an opaque disc.
    peak: f64,
    shape: Shape,
    /// What a disc shows in the place of the formula.
    pattern: Option<&'a Pattern>,
    /// Half the pixel extent to look at.
    pub(crate) reach_px: DVec2,
}

enum Shape {
    Ball {
        radius_sq: f64,
    },
    Gaussian(Gaussian),
    Disc {
        metric: DMat2,
        /// Without the filter.
        core: DMat2,
        depth_slope: DVec2,
        /// Whether it reaches through the eye plane: then it is seen where it lies before it.
        crosses: bool,
        laid: Option<Laid>,
    },
    /// Through the eye plane: normal, and the semi-axes over the squares of their lengths.
    Near {
        normal: DVec3,
        axes: [DVec3; 2],
        slab: bool,
    },
}

/// One splat at one pixel.
pub(crate) struct Fragment {
    /// Whether an opaque disc is solid here.
    pub(crate) is_solid: bool,
    /// Optical depth, or weight of an opaque disc.
    pub(crate) amount: f64,
    pub(crate) depth: f64,
    /// Squared distance from the centre over the squared radius.
    pub(crate) distance_sq: f64,
    /// View depth of the middle of the matter on the ray, which of a Gaussian is not that of the centre by which it is sorted.
    middle: f64,
}

impl<'a> Splat<'a> {
    /// Splat `i` of the input, or `None` when the camera cannot see it.
    pub(crate) fn new(input: &Input<'_>, profiles: &'a [Profile], i: usize) -> Option<Self> {
        let s = input.cloud.get(i);
        let world = input.cloud.origin + s.position.as_dvec3();
        let center = input.camera.view_from_world(world);
        let radius = f64::from(s.radius);
        let parallel = input.camera.is_orthographic();
        let px_per_world = input.camera.focal_px() / if parallel { 1.0 } else { center.z };
        let size = input.camera.size.map(f64::from);
        let center_px = DVec2::new(0.5 * size[0] + center.x * px_per_world, 0.5 * size[1] - center.y * px_per_world);
        let cutoff = f64::from(input.footprints.layers()[s.footprint as usize].cutoff);
        let q = 0.5 * cutoff * cutoff;
        let Profile { norm: n, pattern } = &profiles[s.footprint as usize];
        let filter_px = cutoff * f64::from(input.resampling_sigma_px);
        let amount = f64::from(s.cross_section);
        let mut out = Self {
            kind: s.kind,
            depth: center.z,
            radius,
            material: s.material as usize,
            center,
            center_px,
            cutoff_sq_half: q,
            peak: 0.0,
            shape: Shape::Ball { radius_sq: 0.0 },
            pattern: None,
            reach_px: DVec2::ZERO,
        };
        if let Some(g) = input.cloud.gaussian_of(i) {
            let gaussian = Gaussian::new(input, g, center)?;
            out.reach_px = gaussian.reach_px;
            out.radius = cutoff * gaussian.deviation;
            out.shape = Shape::Gaussian(gaussian);
        } else if s.kind == SplatKind::Medium {
            let radius_sq = radius * radius + (filter_px / px_per_world).powi(2);
            out.peak = amount * *n / radius_sq;
            out.shape = Shape::Ball { radius_sq };
            // A ball's image is stretched away from the image centre by up to |d|².
            let d = if parallel { 1.0 } else { (center / center.z).length_squared() };
            let reach = radius_sq.sqrt() * px_per_world * d * (1.0 + 2.0 * radius / center.z.abs()) + 1.0;
            // Near the eye everywhere.
            let near = !parallel && center.z < 2.0 * radius;
            out.reach_px = DVec2::splat(if near { f64::INFINITY } else { reach });
        } else {
            out.pattern = pattern.as_ref();
            out.disc(input, &s, px_per_world, filter_px, amount * n);
        }
        Some(out)
    }

    fn disc(&mut self, input: &Input<'_>, s: &splat_core::Splat, px_per_world: f64, filter_px: f64, amount: f64) {
        let axes = input.camera.axes;
        let to_view = |v: DVec3| DVec3::new(axes[0].dot(v), axes[1].dot(v), axes[2].dot(v));
        let normal = s.normal.as_dvec3();
        let u = if s.tangent == splat_core::glam::Vec3::ZERO {
            normal.any_orthonormal_vector() * self.radius
        } else {
            s.tangent.as_dvec3()
        };
        let v = normal.cross(u).normalize_or_zero() * self.radius;
        let [normal, u, v] = [normal, u, v].map(to_view);
        let parallel = input.camera.is_orthographic();
        let through = u.length().max(v.length());
        let reach_z = u.z.hypot(v.z);
        if self.depth <= -reach_z {
            return;
        }
        if !parallel && self.depth < through {
            return self.near_disc(input, normal, u, v, amount);
        }
        let slope = if parallel { DVec3::ZERO } else { self.center / self.center.z };
        let project =
            |a: DVec3| DVec2::new((a.x - slope.x * a.z) * px_per_world, -(a.y - slope.y * a.z) * px_per_world);
        let jacobian = DMat2::from_cols(project(u), project(v));
        let widened = |by_px: f64| jacobian * jacobian.transpose() + DMat2::from_diagonal(DVec2::splat(by_px * by_px));
        let covariance = widened(filter_px);
        if covariance.determinant() <= 0.0 {
            return;
        }
        let spread = jacobian.determinant().abs() / covariance.determinant().sqrt();
        let view_dir = if parallel { DVec3::Z } else { self.center.normalize() };
        let grazing = match input.materials[self.material].surface_opacity {
            SurfaceOpacity::ThinSlab if self.kind == SplatKind::Surface => 1.0 / normal.dot(view_dir).abs().max(1e-3),
            _ => 1.0,
        };
        // Beside discs of the same surface that face the viewer, opaque ones that face away hardly count.
        let away = self.kind == SplatKind::Opaque && normal.dot(view_dir) > 0.0;
        self.peak = amount / (u.length() * v.length()) * spread * grazing * if away { FACING_AWAY } else { 1.0 };
        let along = if parallel { normal.z } else { normal.dot(self.center) / self.center.z };
        let depth_slope =
            if along.abs() < 1e-4 { DVec2::ZERO } else { DVec2::new(-normal.x, normal.y) / (along * px_per_world) };
        self.reach_px = DVec2::new(covariance.x_axis.x, covariance.y_axis.y).map(|c| c.sqrt() + 1.0);
        let crosses = self.depth < reach_z;
        let metric = covariance.inverse();
        let core = widened(CORE_FILTER_PX).inverse();
        let laid = self.pattern.map(|pattern| pattern.laid(jacobian, metric, core));
        self.shape = Shape::Disc { metric, core, depth_slope, crosses, laid };
    }

    fn near_disc(&mut self, input: &Input<'_>, normal: DVec3, u: DVec3, v: DVec3, amount: f64) {
        let opaque = self.kind == SplatKind::Opaque;
        let away = if opaque && normal.dot(self.center) > 0.0 { FACING_AWAY } else { 1.0 };
        let slab = !opaque && input.materials[self.material].surface_opacity == SurfaceOpacity::ThinSlab;
        self.peak = amount / (u.length() * v.length()) * away;
        self.reach_px = DVec2::INFINITY;
        self.shape = Shape::Near { normal, axes: [u, v].map(|a| a / a.length_squared()), slab };
    }

    /// How much of a fragment of a medium is seen between the eye and a surface at view depth `depth`; a Gaussian is whole before the eye.
    pub(crate) fn share_before(&self, depth: f64, fragment: &Fragment) -> f64 {
        let at = |depth: f64| share_before((depth - fragment.middle) / self.radius, self.cutoff_sq_half);
        let behind_the_eye = if matches!(self.shape, Shape::Gaussian(_)) { 0.0 } else { at(0.0) };
        (at(depth) - behind_the_eye).max(0.0)
    }

    /// Pixel range [low, high) to look at along one axis (0 = x, 1 = y) of `limit` pixels.
    pub(crate) fn range(&self, axis: usize, limit: usize) -> std::ops::Range<usize> {
        if self.reach_px[axis] == f64::INFINITY {
            return 0..limit;
        }
        let clamp = |v: f64| v.clamp(0.0, limit as f64) as usize;
        clamp(self.center_px[axis] - self.reach_px[axis])..clamp(self.center_px[axis] + self.reach_px[axis] + 1.0)
    }

    /// The fragment at pixel (x, y), if the footprint reaches its centre.
    pub(crate) fn fragment(&self, input: &Input<'_>, x: usize, y: usize) -> Option<Fragment> {
        let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let mut peak = self.peak;
        let (s, core, offset, seen) = match &self.shape {
            Shape::Near { normal, axes, slab } => {
                let (origin, d) = input.camera.view_ray(at.x, at.y);
                let depth = (self.center - origin).dot(*normal) / d.dot(*normal);
                if !(depth > 0.0 && depth.is_finite()) {
                    return None;
                }
                let p = origin + d * depth - self.center;
                if *slab {
                    peak /= (d.dot(*normal).abs() / d.length()).max(1e-3);
                }
                let place = DVec2::new(p.dot(axes[0]), p.dot(axes[1]));
                let s = place.length_squared();
                (s, s, depth - self.depth, Some(Seen { level: 0.0, place, in_core: place }))
            }
            Shape::Gaussian(gaussian) => {
                let d = at - self.center_px;
                let amount = gaussian.optical_depth(d)?;
                let depth = self.depth;
                let middle = depth + gaussian.depth_slope.dot(d);
                return Some(Fragment { is_solid: false, amount, depth, distance_sq: 0.0, middle });
            }
            Shape::Ball { radius_sq } => {
                let (origin, d) = input.camera.view_ray(at.x, at.y);
                let rho_sq = (self.center - origin).cross(d).length_squared() / d.length_squared();
                (rho_sq / radius_sq, f64::INFINITY, 0.0, None)
            }
            Shape::Disc { metric, core, depth_slope, crosses, laid } => {
                let d = at - self.center_px;
                let offset = depth_slope.dot(d);
                let offset = if *crosses { offset } else { offset.clamp(-self.radius, self.radius) };
                if *crosses && self.depth + offset <= 0.0 {
                    return None;
                }
                (d.dot(*metric * d), d.dot(*core * d), offset, laid.as_ref().map(|laid| laid.at(d)))
            }
        };
        let shown = self.pattern.zip(seen);
        let formula = |s: f64| profile(s, self.cutoff_sq_half);
        (s < 1.0 && peak > 0.0).then(|| Fragment {
            is_solid: shown
                .as_ref()
                .map_or(core <= CORE, |(pattern, seen)| pattern.is_solid(seen, formula(core.min(1.0)))),
            amount: peak * shown.as_ref().map_or(formula(s), |(pattern, seen)| pattern.profile(seen, formula(s))),
            depth: self.depth + offset,
            distance_sq: s,
            middle: self.depth + offset,
        })
    }
}

fn profile(s: f64, q: f64) -> f64 {
    let x = q * (1.0 - s);
    (-q * s).exp() - (-q).exp() * (1.0 + x + 0.5 * x * x)
}

/// Share of a medium before a plane across the ray at x = distance/R behind its centre: ∫w(u²) du from −1 to x over that to 1.
fn share_before(x: f64, q: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    let gauss = |x: f64| 0.5 * (PI / q).sqrt() * libm::erf(q.sqrt() * x);
    // ∫(1 + y + y²/2) du, y = q(1 − u²).
    let taper = |x: f64| x + q * (x - x.powi(3) / 3.0) + 0.5 * q * q * (x - 2.0 * x.powi(3) / 3.0 + x.powi(5) / 5.0);
    let half = |x: f64| gauss(x) - (-q).exp() * taper(x);
    0.5 + 0.5 * half(x) / half(1.0)
}

/// A footprint: n = 1/∫w dA for R = 1, and the image in the place of w.
pub(crate) struct Profile {
    norm: f64,
    pattern: Option<Pattern>,
}

/// Of each footprint; norms by numerical integration: shares no closed form with the fast path.
pub(crate) fn profiles(footprints: &FootprintStack) -> Vec<Profile> {
    let layer_profile = |(id, layer): (usize, &splat_core::Footprint)| {
        let q = 0.5 * f64::from(layer.cutoff) * f64::from(layer.cutoff);
        let norm = 1.0 / (PI * simpson(|s| profile(s, q)));
        let pattern = footprints.image(id).map(|image| Pattern::new(image, |s| profile(s, q), norm));
        Profile { norm, pattern }
    };
    footprints.layers().iter().enumerate().map(layer_profile).collect()
}

/// Simpson's rule over [0, 1].
fn simpson(f: impl Fn(f64) -> f64) -> f64 {
    const N: usize = 1024;
    let h = 1.0 / N as f64;
    (0..N)
        .map(|i| {
            let a = i as f64 * h;
            (f(a) + 4.0 * f(a + 0.5 * h) + f(a + h)) * h / 6.0
        })
        .sum()
}
