//! Discs of which their conics do not tell everything: they reach through the eye plane, or their footprints are images. How they lie in the
//! pixels of the camera, and what each of them sees.
//!
//! **Images.** With the Jacobian J of the disc's semi-axes the widened disc has the form M = J·Jᵀ + filter, whose inverse is the conic C.
//! Places on it are p = Rᵀ·√C·d for an offset d of d pixels: |p|² is dᵀCd = s, so the image is widened as the formula is and keeps its energy. R is
//! the rotation, or reflection where the back is seen, of the polar decomposition of J, which turns J and √M alike.

use super::gather::Attributes;
use super::kernel::Kernel;
use super::lanes::{Broadcast, Lanes, MAX_LANES};
use super::project::Projector;
use super::projected::{Coverage, ImageFrame, ProjectedSplat, SpecialDisc};
use super::shapes::Image;
use super::tile::Run;
use crate::splats::footprint::Level;
use crate::{FootprintImage, SplatKind};
use glam::{Mat2, Vec2, Vec3};
use pulp::Simd;

impl Projector<'_> {
    /// Marks and lists the discs of a group that may be seen and of which their conics do not tell everything.
    #[cold]
    pub(super) fn write_special(
        &self,
        first: usize,
        attributes: &Attributes,
        image: &Image,
        splats: &mut [ProjectedSplat],
        coverage: &[Coverage],
        list: &mut Vec<SpecialDisc>,
    ) {
        for (l, splat) in splats.iter_mut().enumerate() {
            let crosses = image.near[l] > 0.0;
            let pattern = self.kernel_of(first + l).pattern.as_ref().filter(|_| splat.kind != SplatKind::Medium);
            if !(crosses || pattern.is_some()) || coverage[l] == Coverage::NONE {
                continue;
            }
            splat.set_special();
            let id = (first + l) as u32;
            let center = image.depth[l];
            let is_slab = crosses && attributes.crossing[l] < 0.0;
            list.push(SpecialDisc {
                id,
                center,
                slope: image.slope.map(|s| s[l]),
                extent: attributes.radius[l],
                crosses,
                slab: if is_slab { self.slab_of(id, splat.center_px) } else { [0.0; 2] },
                image: pattern.map(|pattern| {
                    let core = image.core.map(|c| c[l]);
                    self.image_frame(first + l, splat, core, &pattern.image, crosses, center)
                }),
            });
        }
    }

    /// n·c/z of a slab with the image position of its centre, and the |cosine| that its peak was divided by.
    fn slab_of(&self, id: u32, at: [f32; 2]) -> [f32; 2] {
        let normal = self.view.rotation * self.columns.cloud.normal_of(id as usize);
        let ray = if self.orthographic {
            Vec3::Z
        } else {
            Vec3::new((at[0] - self.half.x) / self.focal, (self.half.y - at[1]) / self.focal, 1.0)
        };
        let along = normal.dot(ray);
        [along, (along.abs() / ray.length()).max(1e-3)]
    }

    /// How the image of disc `i` lies, which has the conic of `splat` and the conic `core` without the filter; whether it crosses the eye
    /// plane, and its depth. What crosses it in perspective is seen from so near that its finest table is.
    fn image_frame(
        &self,
        i: usize,
        splat: &ProjectedSplat,
        core: [f32; 3],
        pattern: &FootprintImage,
        crosses: bool,
        depth: f32,
    ) -> ImageFrame {
        let cloud = self.columns.cloud;
        let normal = cloud.normal_of(i);
        let tangent = match cloud.tangent_of(i) {
            Vec3::ZERO => normal.any_orthonormal_vector() * cloud.radius[i],
            tangent => tangent,
        };
        // Before they are turned: the axes of the view are left-handed.
        let across = normal.cross(tangent).normalize_or_zero() * cloud.radius[i];
        let [tangent, across] = [tangent, across].map(|axis| self.view.rotation * axis);
        let slant = if self.orthographic {
            Vec2::ZERO
        } else {
            (Vec2::from_array(splat.center_px) - self.half) * Vec2::new(1.0, -1.0) / self.focal
        };
        // Of the pixels in a world unit their sign alone, which is that of the depth: they turn nothing else.
        let side = if self.orthographic { 1.0 } else { depth.signum() };
        let to_image = |a: Vec3| Vec2::new(a.x - slant.x * a.z, slant.y * a.z - a.y) * side;
        let turn = turn(to_image(tangent), to_image(across)).transpose();
        let to_disc = turn * root(splat.conic);
        // A pixel is as wide as on the narrower side of the disc.
        let is_near = crosses && !self.orthographic;
        let pixel = (0.5 * (splat.conic[0] + splat.conic[2]) + half_difference(splat.conic)).sqrt();
        ImageFrame {
            to_disc: rows(to_disc),
            to_core: rows(turn * root(core)),
            level: if is_near { 0.0 } else { pattern.level(pixel) },
        }
    }
}

/// The rotation or reflection that is nearest to a matrix with these columns.
fn turn(u: Vec2, v: Vec2) -> Mat2 {
    // J and its cofactors, added where it turns and subtracted where it reflects.
    let side = if u.perp_dot(v) < 0.0 { -1.0 } else { 1.0 };
    let first = Vec2::new(u.x + side * v.y, u.y - side * v.x).try_normalize().unwrap_or(Vec2::X);
    Mat2::from_cols(first, Vec2::new(-first.y, first.x) * side)
}

/// Half the difference of the eigenvalues of a conic.
fn half_difference(conic: [f32; 3]) -> f32 {
    let [a, b, c] = conic;
    (0.25 * (a - c) * (a - c) + 0.25 * b * b).sqrt()
}

/// The symmetric root of a conic a·x² + b·xy + c·y².
fn root(conic: [f32; 3]) -> Mat2 {
    let [a, b, c] = conic;
    let mixed = 0.5 * b;
    let determinant = (a * c - mixed * mixed).max(0.0).sqrt();
    let scale = 1.0 / (a + c + 2.0 * determinant).max(f32::MIN_POSITIVE).sqrt();
    Mat2::from_cols(Vec2::new(a + determinant, mixed), Vec2::new(mixed, c + determinant)) * scale
}

fn rows(m: Mat2) -> [f32; 4] {
    [m.x_axis.x, m.y_axis.x, m.x_axis.y, m.y_axis.y]
}

/// Profile and view depths of a special disc.
#[inline(always)]
pub(super) fn profile<S: Simd>(
    simd: S,
    run: Run<S>,
    splat: &ProjectedSplat,
    disc: &SpecialDisc,
    kernel: &Kernel,
    perspective: bool,
) -> [Lanes<S>; 2] {
    Shown { simd, run, splat, disc, kernel, perspective, asked: Asked::Profile }.met()
}

/// What takes the place of s where a special disc is solid, and its view depths: s itself, or of an image 0 where that is solid and 1 where
/// it is not. The conic of `splat` is that of the core.
#[inline(always)]
pub(super) fn solid<S: Simd>(
    simd: S,
    run: Run<S>,
    splat: &ProjectedSplat,
    disc: &SpecialDisc,
    kernel: &Kernel,
    perspective: bool,
) -> [Lanes<S>; 2] {
    Shown { simd, run, splat, disc, kernel, perspective, asked: Asked::Solid }.met()
}

/// A special disc on a run of pixels. What it takes is kept out of the loops over others, which would lose registers to it.
struct Shown<'a, S: Simd> {
    simd: S,
    run: Run<S>,
    splat: &'a ProjectedSplat,
    disc: &'a SpecialDisc,
    kernel: &'a Kernel,
    perspective: bool,
    asked: Asked,
}

/// What is asked of it.
#[derive(Clone, Copy)]
enum Asked {
    Profile,
    Solid,
}

impl<S: Simd> Shown<'_, S> {
    #[cold]
    #[inline(never)]
    fn met(self) -> [Lanes<S>; 2] {
        self.simd.vectorize(self)
    }
}

impl<S: Simd> pulp::NullaryFnOnce for Shown<'_, S> {
    type Output = [Lanes<S>; 2];

    #[inline(always)]
    fn call(self) -> [Lanes<S>; 2] {
        let Self { simd, run, splat, disc, kernel, perspective, asked } = self;
        let [s, depth] = run.meet(simd, splat, disc, perspective);
        let formula = kernel.profile(simd, (simd.lanes(1.0) - s).max(simd.lanes(0.0)));
        let (Some(pattern), Some(frame)) = (&kernel.pattern, &disc.image) else {
            return match asked {
                Asked::Profile => [formula, depth],
                Asked::Solid => [s, depth],
            };
        };
        let (to_disc, scale) = match asked {
            Asked::Profile => (&frame.to_disc, 1.0),
            Asked::Solid => (&frame.to_core, 1.0 / pattern.solid_profile),
        };
        let factor = |level: &Level| match asked {
            Asked::Profile => level.gain * pattern.integral,
            Asked::Solid => 1.0 / level.threshold,
        };
        let [x, y] = run.places(simd, to_disc, disc, perspective);
        let mut distance = [0.0; MAX_LANES];
        let mut out = [0.0; MAX_LANES];
        s.store(&mut distance);
        formula.store(&mut out);
        for l in 0..Lanes::<S>::COUNT {
            let (table, share) = pattern.image.seen(frame.level, [x[l], y[l]], factor);
            out[l] = if distance[l] < 1.0 { table + share * out[l] * scale } else { 0.0 };
        }
        let seen = Lanes::load(simd, &out);
        match asked {
            Asked::Profile => [seen, depth],
            Asked::Solid => [simd.lanes(1.0).where_less_or(seen, simd.lanes(1.0), simd.lanes(0.0)), depth],
        }
    }
}
