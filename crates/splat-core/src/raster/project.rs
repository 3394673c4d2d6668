//! Projection of splats to image-space footprints, as many splats at once as the machine has lanes.
//!
//! **Medium.** For a centre c = z(u₀, v₀, 1) and a ray d = (u₀+du, v₀+dv, 1) the squared distance of the centre from the
//! ray is ρ² = |c × d|²/|d|² = z²·(du² + dv² + (u₀dv − v₀du)²)/|d|²: a quadratic form in the pixel offset, exact in
//! perspective, over a factor that depends on the pixel alone. Nothing cancels for far centres. The form spans
//! (r²|u₀| ± r·√(1 + u₀² − r²))/(1 − r²) with r = R/z: the planes through the eye that touch the ball. From r = 1 on it may
//! reach every pixel.
//!
//! What reaches through the eye plane counts with its part before it: a medium with the share of its kernel there, a disc
//! where the ray meets its plane at a positive depth ([`SpecialDisc`]). The form of a medium holds for centres behind the eye
//! too, and loses its digits only where z is much smaller than the splat: such centres are seen from R/32 away.
//!
//! **Gaussian.** See `gaussian.rs`, which writes over the ball that stands for it.
//!
//! **Disc.** The tangent disc is projected by its Jacobian at the centre (Zwicker's EWA): conic = (J Jᵀ + filter)⁻¹, and
//! the diagonal of J Jᵀ + filter is the square of the half extents.

use super::Params;
use super::gather::{Attributes, Column, Columns};
use super::kernel::Kernel;
use super::lanes::{Broadcast, Lanes};
use super::projected::{Coverage, Detail, Projected, ProjectedDepth, ProjectedSplat, SpecialDisc};
use super::shapes::{Image, Shapes};
use crate::optics::faintest;
use crate::{Camera, Cloud, FootprintStack, Material, ViewTransform};
use glam::Vec2;
use pulp::Simd;
use rayon::prelude::*;

/// Weight of an opaque disc that faces away beside one that faces the viewer. Behind the silhouette of a closed surface
/// discs face away and stick out by R sin θ; lit on the side that they turn to the viewer, which is the inside, they would
/// draw a dark rim. Where nothing of the same surface faces the viewer this weight cancels: a back is seen as it is. A
/// power of two, which changes no bit of the quotient.
const FACING_AWAY: f32 = 1.0 / 256.0;

/// Least distance of a centre from the eye as a share of the radius, in perspective: nearer, image positions run to infinity.
const LEAST_DEPTH: f32 = 1.0 / 32.0;

/// Standard filter of what is solid, pixels: an edge-on disc is a line and no number divided by zero.
const CORE_FILTER_PX: f32 = 1.0 / 32.0;

/// Splats projected by one task.
const CHUNK: usize = 4096;

/// What is projected, and how.
#[derive(Debug, Clone, Copy)]
pub struct ProjectInput<'a> {
    /// The splats.
    pub cloud: &'a Cloud,
    /// The viewer.
    pub camera: &'a Camera,
    /// Footprints by id.
    pub footprints: &'a FootprintStack,
    /// Materials by id.
    pub materials: &'a [Material],
    /// The resampling filter.
    pub params: &'a Params,
    /// What is kept of each splat beside its footprint.
    pub detail: Detail,
}

/// Projects all splats into fresh memory; see [`project_into`].
///
/// # Panics
/// As [`project_into`].
pub fn project(input: &ProjectInput<'_>) -> Projected {
    let mut out = Projected::default();
    project_into(&mut out, input);
    out
}

/// Projects all splats; `out` may hold another frame's projection, whose memory is used again.
///
/// In the order of ids, which is that of memory: splats in view order lie far apart, and gathering their attributes one
/// column at a time would cost more than projecting those that turn out to be hidden.
///
/// # Panics
/// If a material or a footprint of the cloud is out of range; `Cloud::validate` and the tables promise it is not.
pub fn project_into(out: &mut Projected, input: &ProjectInput<'_>) {
    let ProjectInput { cloud, camera, footprints, materials, params, detail } = *input;
    out.resize(cloud.len(), detail);
    out.objects.clear();
    if detail.object {
        out.objects.extend_from_slice(&cloud.object);
    }
    out.kernels.clear();
    out.kernels.extend(Kernel::of_stack(footprints));
    out.size = camera.size;
    out.perspective = (!camera.is_orthographic()).then_some(camera.focal_px() as f32);
    let half = Vec2::new(camera.size[0] as f32, camera.size[1] as f32) * 0.5;
    let projector = Projector {
        columns: Columns { cloud, kernels: &out.kernels, materials },
        view: camera.view_from_offset(cloud.origin),
        focal: camera.focal_px() as f32,
        half,
        reach: half / camera.focal_px() as f32,
        orthographic: camera.is_orthographic(),
        size: camera.size,
        filter_sigma_px: params.resampling_sigma_px,
        has_images: footprints.has_images(),
        faintest: faintest(materials),
    };
    let mut depths: Vec<&mut [ProjectedDepth]> = out.depths.chunks_mut(CHUNK).collect();
    depths.resize_with(cloud.len().div_ceil(CHUNK), Default::default);
    let chunks = out.splats.par_chunks_mut(CHUNK).zip(out.coverage.par_chunks_mut(CHUNK)).zip(depths);
    let special: Vec<Vec<SpecialDisc>> = chunks
        .enumerate()
        .map(|(chunk, ((splats, coverage), depths))| {
            let first = chunk * CHUNK;
            pulp::Arch::new().dispatch(ProjectChunk { projector: &projector, first, splats, coverage, depths })
        })
        .collect();
    out.special.clear();
    out.special.extend(special.into_iter().flatten());
}

/// What all splats of a projection share.
pub(super) struct Projector<'a> {
    pub(super) columns: Columns<'a>,
    pub(super) view: ViewTransform,
    pub(super) focal: f32,
    pub(super) half: Vec2,
    /// Half the image over the focal length: |x/z| and |y/z| of its borders.
    pub(super) reach: Vec2,
    pub(super) orthographic: bool,
    pub(super) size: [u32; 2],
    pub(super) filter_sigma_px: f32,
    /// Whether some footprint is an image.
    pub(super) has_images: bool,
    /// Splats whose peak is no more are not drawn.
    faintest: f32,
}

/// One chunk's work, in the form that [`pulp`] compiles once per instruction set.
struct ProjectChunk<'a> {
    projector: &'a Projector<'a>,
    first: usize,
    splats: &'a mut [ProjectedSplat],
    coverage: &'a mut [Coverage],
    /// Empty when not asked for.
    depths: &'a mut [ProjectedDepth],
}

impl pulp::WithSimd for ProjectChunk<'_> {
    /// The discs of which their conics do not tell everything.
    type Output = Vec<SpecialDisc>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<SpecialDisc> {
        let projector = self.projector;
        let lanes = Lanes::<S>::COUNT;
        let mut attributes = Attributes::default();
        let mut image = Image::default();
        let mut special = Vec::new();
        for begin in (0..self.splats.len()).step_by(lanes) {
            attributes.read(&projector.columns, self.first + begin, lanes);
            projector.project(simd, &attributes, &mut image);
            if attributes.any_medium {
                projector.before_the_eye(simd, self.first + begin, &attributes, &mut image);
            }
            let end = self.splats.len().min(begin + lanes);
            let splats = &mut self.splats[begin..end];
            projector.write(self.first + begin, &image, splats, &mut self.coverage[begin..end]);
            if attributes.any_disc && (projector.has_images || image.any_near(splats.len())) {
                projector.write_special(
                    self.first + begin,
                    &attributes,
                    &image,
                    splats,
                    &self.coverage[begin..end],
                    &mut special,
                );
            }
            if !self.depths.is_empty() {
                image.write_depths(&attributes, &mut self.depths[begin..end]);
            }
            if !projector.columns.cloud.gaussian.is_empty() {
                let splats = &mut self.splats[begin..end];
                let coverage = &mut self.coverage[begin..end];
                let depths = self.depths.get_mut(begin..end).unwrap_or_default();
                projector.write_gaussians(self.first + begin, splats, coverage, depths);
            }
        }
        special
    }
}

/// Centres in view space.
struct Centers<S: Simd> {
    position: [Lanes<S>; 3],
    /// View depth; that of `position` keeps a least distance from the eye plane.
    before: Lanes<S>,
    px_per_world: Lanes<S>,
    /// x/z and y/z; 0 for parallel rays.
    u: Lanes<S>,
    v: Lanes<S>,
    filter_px: Lanes<S>,
}

impl Projector<'_> {
    #[inline(always)]
    fn project<S: Simd>(&self, simd: S, attributes: &Attributes, image: &mut Image) {
        let centers = self.centers(simd, attributes);
        let shapes = match (attributes.any_medium, attributes.any_disc) {
            (_, false) => self.media(simd, attributes, &centers),
            (false, true) => self.discs(simd, attributes, &centers),
            (true, true) => {
                let media = self.media(simd, attributes, &centers);
                let discs = self.discs(simd, attributes, &centers);
                media.where_less(Lanes::load(simd, &attributes.disc), simd.lanes(0.0), &discs)
            }
        };
        let [x, y, z] = centers.position;
        (simd.lanes(self.half.x) + x * centers.px_per_world).store(&mut image.center[0]);
        (simd.lanes(self.half.y) - y * centers.px_per_world).store(&mut image.center[1]);
        // Where a ray meets a disc through the eye plane is told from where that is seen.
        z.where_less_or(simd.lanes(0.0), shapes.near, centers.before).store(&mut image.depth);
        // Comparisons with NaN are false: what is no number has no image.
        shapes.peak.where_less(simd.lanes(0.0), shapes.peak).store(&mut image.peak);
        shapes.near.store(&mut image.near);
        for k in 0..3 {
            shapes.conic[k].store(&mut image.conic[k]);
            shapes.core[k].store(&mut image.core[k]);
        }
        for k in 0..2 {
            shapes.half_extent[k].store(&mut image.half_extent[k]);
            shapes.slope[k].store(&mut image.slope[k]);
        }
    }

    #[inline(always)]
    fn centers<S: Simd>(&self, simd: S, attributes: &Attributes) -> Centers<S> {
        let position = self.rotate(simd, &attributes.position);
        let t = self.view.translation;
        let position = [position[0] + simd.lanes(t.x), position[1] + simd.lanes(t.y), position[2] + simd.lanes(t.z)];
        let [x, y, z] = position;
        let filter_px = Lanes::load(simd, &attributes.cutoff) * simd.lanes(self.filter_sigma_px);
        if self.orthographic {
            return Centers {
                position,
                before: z,
                px_per_world: simd.lanes(self.focal),
                u: simd.lanes(0.0),
                v: simd.lanes(0.0),
                filter_px,
            };
        }
        let before = z;
        let least = Lanes::load(simd, &attributes.radius) * simd.lanes(LEAST_DEPTH);
        let side = (simd.lanes(0.0) - least).where_less_or(z, simd.lanes(0.0), least);
        let z = side.where_less_or(z.abs(), least, z);
        let position = [x, y, z];
        Centers { before, position, px_per_world: simd.lanes(self.focal) / z, u: x / z, v: y / z, filter_px }
    }

    /// Into view space, in the order of operations of [`ViewTransform::depth`].
    #[inline(always)]
    fn rotate<S: Simd>(&self, simd: S, v: &[Column; 3]) -> [Lanes<S>; 3] {
        let m = &self.view.rotation;
        let x = Lanes::load(simd, &v[0]);
        let y = Lanes::load(simd, &v[1]);
        let z = Lanes::load(simd, &v[2]);
        let row = |a: f32, b: f32, c: f32| simd.lanes(a) * x + simd.lanes(b) * y + simd.lanes(c) * z;
        [
            row(m.x_axis.x, m.y_axis.x, m.z_axis.x),
            row(m.x_axis.y, m.y_axis.y, m.z_axis.y),
            row(m.x_axis.z, m.y_axis.z, m.z_axis.z),
        ]
    }

    #[inline(always)]
    fn media<S: Simd>(&self, simd: S, attributes: &Attributes, centers: &Centers<S>) -> Shapes<S> {
        let Centers { px_per_world, u, v, filter_px, .. } = *centers;
        let radius = Lanes::load(simd, &attributes.radius);
        let filter_world = filter_px / px_per_world;
        let radius_sq = radius * radius + filter_world * filter_world;
        let reach_sq = px_per_world * px_per_world * radius_sq;
        let scale = simd.lanes(1.0) / reach_sq;
        let x_sq = simd.lanes(1.0) + u * u;
        let y_sq = simd.lanes(1.0) + v * v;
        let mut peak = Lanes::load(simd, &attributes.cross_section) * Lanes::load(simd, &attributes.norm) / radius_sq;
        let mut half_extent = [reach_sq.sqrt(); 2];
        if !self.orthographic {
            let ratio_sq = reach_sq / simd.lanes(self.focal * self.focal);
            half_extent = [self.extent_of_ball(simd, u, x_sq, ratio_sq), self.extent_of_ball(simd, v, y_sq, ratio_sq)];
            peak = self.in_view(simd, centers, radius_sq.sqrt(), peak);
        }
        Shapes {
            // y runs down in the image, so the mixed term changes its sign.
            conic: [y_sq * scale, simd.lanes(2.0) * (u * v * scale), x_sq * scale],
            peak,
            half_extent,
            slope: [simd.lanes(1.0) / (radius * Lanes::load(simd, &attributes.half_width)), simd.lanes(1.0)],
            core: [simd.lanes(0.0); 3],
            near: simd.lanes(-1.0),
        }
    }

    /// Of media through the eye plane only the share before it is seen.
    #[inline(always)]
    fn before_the_eye<S: Simd>(&self, simd: S, first: usize, attributes: &Attributes, image: &mut Image) {
        for l in 0..Lanes::<S>::COUNT {
            let distance = image.depth[l] * image.slope[0][l];
            // Comparisons with NaN are false.
            if attributes.disc[l] < 0.0 && distance < 1.0 && image.peak[l] > 0.0 {
                let mut front = Column::default();
                self.kernel_of(first + l).share_before(simd, simd.lanes(distance)).store(&mut front);
                image.peak[l] *= front[0];
                image.slope[1][l] = 1.0 / front[0];
            }
        }
    }

    pub(super) fn kernel_of(&self, i: usize) -> &Kernel {
        let cloud = self.columns.cloud;
        &self.columns.kernels[cloud.footprint[i.min(cloud.len() - 1)] as usize]
    }

    /// Half the extent of the image of a ball about that of its centre, pixels: `slope` is x/z, `length_sq` 1 + (x/z)², and
    /// `ratio_sq` (R/z)². Everything where the ball reaches the eye plane.
    #[inline(always)]
    fn extent_of_ball<S: Simd>(&self, simd: S, slope: Lanes<S>, length_sq: Lanes<S>, ratio_sq: Lanes<S>) -> Lanes<S> {
        let across = (ratio_sq * (length_sq - ratio_sq)).sqrt();
        let extent = (slope.abs() * ratio_sq + across) / (simd.lanes(1.0) - ratio_sq) * simd.lanes(self.focal);
        extent.where_less_or(ratio_sq, simd.lanes(1.0), simd.lanes(f32::INFINITY))
    }

    /// `peak` where a ball about the centre, or about its mirror image at the eye, reaches into the image; else 0.
    #[inline(always)]
    fn in_view<S: Simd>(&self, simd: S, centers: &Centers<S>, radius: Lanes<S>, peak: Lanes<S>) -> Lanes<S> {
        let [x, y, z] = centers.position;
        let mut peak = peak;
        for (v, reach) in [(x, self.reach.x), (y, self.reach.y)] {
            let outside = v.abs() - z.abs() * simd.lanes(reach);
            peak = peak.where_less(outside, radius * simd.lanes((1.0 + reach * reach).sqrt()));
        }
        peak
    }

    #[inline(always)]
    fn discs<S: Simd>(&self, simd: S, attributes: &Attributes, centers: &Centers<S>) -> Shapes<S> {
        let Centers { px_per_world, u, v, filter_px, .. } = *centers;
        let normal = self.rotate(simd, &attributes.normal);
        let (axis_u, axis_v) = self.disc_axes(simd, attributes, normal);
        // d(x/z) = (dx − (x/z)·dz)/z; parallel rays have no dz term.
        let to_image = |a: [Lanes<S>; 3]| [(a[0] - u * a[2]) * px_per_world, (v * a[2] - a[1]) * px_per_world];
        let ju = to_image(axis_u);
        let jv = to_image(axis_v);
        let filter_sq = filter_px * filter_px;
        let area = ju[0] * jv[1] - ju[1] * jv[0];
        let area_sq = area * area;
        let trace_x = ju[0] * ju[0] + jv[0] * jv[0];
        let trace_y = ju[1] * ju[1] + jv[1] * jv[1];
        let mixed = ju[0] * ju[1] + jv[0] * jv[1];
        // (J Jᵀ + filter)⁻¹, its determinant |J|² + filter²·trace(JJᵀ) + filter⁴ written so that an edge-on disc does not
        // cancel.
        let core_filter_sq = simd.lanes(CORE_FILTER_PX * CORE_FILTER_PX);
        let trace = trace_x + trace_y;
        let core_inverse = simd.lanes(1.0) / (area_sq + core_filter_sq * trace + core_filter_sq * core_filter_sq);
        let core = [
            (trace_y + core_filter_sq) * core_inverse,
            simd.lanes(-2.0) * (mixed * core_inverse),
            (trace_x + core_filter_sq) * core_inverse,
        ];
        let xx = trace_x + filter_sq;
        let yy = trace_y + filter_sq;
        let inverse = simd.lanes(1.0) / (area_sq + filter_sq * trace + filter_sq * filter_sq);
        let conic = [yy * inverse, simd.lanes(-2.0) * (mixed * inverse), xx * inverse];
        let radius_sq = dot(axis_u, axis_u).sqrt() * dot(axis_v, axis_v).sqrt();
        // The filter spreads the same optical depth over a larger image area.
        let spread = (area_sq * inverse).sqrt();
        let mut peak =
            Lanes::load(simd, &attributes.cross_section) * Lanes::load(simd, &attributes.norm) / radius_sq * spread;
        // A slab is thicker along a slanted ray; one over |cos| is cut as `SurfaceOpacity` cuts it.
        let (along, length) = if self.orthographic {
            (normal[2], simd.lanes(1.0))
        } else {
            (dot(normal, [u, v, simd.lanes(1.0)]), (u * u + v * v + simd.lanes(1.0)).sqrt())
        };
        let slab = peak / (along.abs() / length).max(simd.lanes(1e-3));
        peak = slab.where_less_or(Lanes::load(simd, &attributes.crossing), simd.lanes(0.0), peak);
        // The side of the plane that the eye is on: for a centre behind the eye `along` has the other sign.
        let facing = if self.orthographic { along } else { along * centers.position[2] };
        let away = simd.lanes(FACING_AWAY).where_less_or(simd.lanes(0.0), facing, simd.lanes(1.0));
        peak = peak * away.where_less_or(Lanes::load(simd, &attributes.opaque), simd.lanes(0.0), simd.lanes(1.0));
        let (near, half_extent, peak) = self.near_discs(simd, centers, [axis_u, axis_v], [xx.sqrt(), yy.sqrt()], peak);
        // An edge-on plane has no slope that could be used; its fragments stay at the centre's depth.
        let per_px = simd.lanes(1.0) / (along * px_per_world);
        let right = (simd.lanes(0.0) - normal[0] * per_px).where_less(simd.lanes(1e-4), along.abs());
        let down = (normal[1] * per_px).where_less(simd.lanes(1e-4), along.abs());
        Shapes { conic, core, peak, half_extent, slope: [right, down], near }
    }

    /// Which discs reach through the eye plane, where they may lie in the image, and the peaks of those that may be seen. In
    /// perspective all whose ball does, for the affine form holds far from the eye alone.
    #[inline(always)]
    fn near_discs<S: Simd>(
        &self,
        simd: S,
        centers: &Centers<S>,
        axes: [[Lanes<S>; 3]; 2],
        half_extent: [Lanes<S>; 2],
        peak: Lanes<S>,
    ) -> (Lanes<S>, [Lanes<S>; 2], Lanes<S>) {
        let z = centers.before;
        let along = (axes[0][2] * axes[0][2] + axes[1][2] * axes[1][2]).sqrt();
        let peak = peak.where_less(simd.lanes(0.0), z + along);
        if self.orthographic {
            return (simd.lanes(1.0).where_less_or(z, along, simd.lanes(-1.0)), half_extent, peak);
        }
        let radius = dot(axes[0], axes[0]).max(dot(axes[1], axes[1])).sqrt();
        let far = simd.lanes(f32::INFINITY);
        let half_extent = [far.where_less_or(z, radius, half_extent[0]), far.where_less_or(z, radius, half_extent[1])];
        let seen = self.in_view(simd, centers, radius, peak).where_less_or(z, radius, peak);
        (simd.lanes(1.0).where_less_or(z, radius, simd.lanes(-1.0)), half_extent, seen)
    }

    /// Semi-axes of the discs in view space.
    #[inline(always)]
    fn disc_axes<S: Simd>(
        &self,
        simd: S,
        attributes: &Attributes,
        normal: [Lanes<S>; 3],
    ) -> ([Lanes<S>; 3], [Lanes<S>; 3]) {
        let radius = Lanes::load(simd, &attributes.radius);
        // Two vectors across the normal (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
        let [x, y, z] = normal;
        let sign = simd.lanes(-1.0).where_less_or(z, simd.lanes(0.0), simd.lanes(1.0));
        let a = simd.lanes(-1.0) / (sign + z);
        let b = x * y * a;
        let mut axis_u = [b * radius, (sign + y * y * a) * radius, (simd.lanes(0.0) - y) * radius];
        if attributes.any_tangent {
            let tangent = self.rotate(simd, &attributes.tangent);
            let elliptical = tangent[0].abs().max(tangent[1].abs()).max(tangent[2].abs());
            for k in 0..3 {
                axis_u[k] = tangent[k].where_less_or(simd.lanes(0.0), elliptical, axis_u[k]);
            }
        }
        let across = cross(normal, axis_u);
        let length = dot(across, across).sqrt();
        let scale = (radius / length).where_less(simd.lanes(0.0), length);
        (axis_u, [across[0] * scale, across[1] * scale, across[2] * scale])
    }

    /// Packs the footprints and finds their tiles.
    #[inline(always)]
    fn write(&self, first: usize, image: &Image, splats: &mut [ProjectedSplat], coverage: &mut [Coverage]) {
        let cloud = self.columns.cloud;
        for (l, (splat, coverage)) in splats.iter_mut().zip(coverage).enumerate() {
            *splat = ProjectedSplat {
                center_px: [image.center[0][l], image.center[1][l]],
                conic: [image.conic[0][l], image.conic[1][l], image.conic[2][l]],
                peak: image.peak[l],
                material: cloud.material[first + l],
                footprint: cloud.footprint[first + l],
                kind: cloud.kind[first + l],
                ..ProjectedSplat::default()
            };
            splat.set_half_extent([image.half_extent[0][l], image.half_extent[1][l]]);
            let shown = splat.peak > self.faintest;
            *coverage = if shown { Coverage::from_bounds(splat.bounds(self.size)) } else { Coverage::NONE };
        }
    }
}

#[inline(always)]
fn dot<S: Simd>(a: [Lanes<S>; 3], b: [Lanes<S>; 3]) -> Lanes<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<S: Simd>(a: [Lanes<S>; 3], b: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
