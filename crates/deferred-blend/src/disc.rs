//! Discs as the rays of an image meet them, exactly in perspective.
//!
//! A disc has the centre c, the unit normal n and the semi-axes a and b. The ray of a pixel that lies (dx, dy) from the image of the
//! centre has the direction d = c/c_z + e with e = (dx/f, −dy/f, 0), so that its z is view depth. The ray meets the disc's plane at
//! the depth z = (n·c)/(n·d), and there, in units of the semi-axes, at
//!
//! (c_z/N)·(m·(e·a) − (N − m)·(c·a)/c_z)/|a|² along a, with m = n·c/c_z and N = n·d = m + n·e,
//!
//! and likewise along b. Numerators and N are linear in (dx, dy), and the numerators vanish at the centre, so nothing cancels in
//! f32. No number is divided by m, which is 0 for a disc that is seen edge-on. For a disc that reaches through the eye plane the
//! image's middle replaces the centre: there both numerators have a constant, (n·c)·a_z − (a·c)·n_z over |a|². Parallel
//! rays have N = n_z everywhere and a depth that is linear in (dx, dy).

use crate::Params;
use crate::cone::Cone;
use crate::grouping::Membership;
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::optics::{self, SurfaceOpacity};
use splat_core::raster::kernel::Kernel;
use splat_core::raster::lanes::{Broadcast, Lanes};
use splat_core::raster::pulp::Simd;
use splat_core::{Camera, Cloud, FootprintStack, Material, SplatKind};

/// Discs projected by one task.
const CHUNK: usize = 4096;

/// One disc in the image.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Disc {
    /// Image position of the centre, pixels; of a disc through the eye plane the image's middle.
    pub(crate) center: [f32; 2],
    /// Place on the disc's plane along its semi-axes, times N, there, and its change per pixel.
    pub(crate) along: [f32; 2],
    pub(crate) along_slope: [[f32; 2]; 2],
    /// N there, and its change per pixel.
    pub(crate) facing: f32,
    pub(crate) facing_slope: [f32; 2],
    /// Depth times N there, and its change per pixel.
    pub(crate) depth: f32,
    pub(crate) depth_slope: [f32; 2],
    /// Geometric mean of the semi-axes, world units.
    pub(crate) radius: f32,
    /// Pixels [x0, x1, y0, y1) that may see it.
    pub(crate) pixels: [u32; 4],
}

/// The input of a projection of discs.
#[derive(Debug, Clone, Copy)]
pub struct DiscInput<'a> {
    /// The splats.
    pub cloud: &'a Cloud,
    /// Places in the cloud of the discs that are blended, translucent or opaque; near ones first is fastest.
    pub ids: &'a [u32],
    /// The viewer.
    pub camera: &'a Camera,
    /// Footprints by id: the weights w of Eq. 1.
    pub footprints: &'a FootprintStack,
    /// Materials by id.
    pub materials: &'a [Material],
}

/// Discs of one view.
#[derive(Debug, Clone)]
pub struct Discs {
    /// Image size, pixels.
    pub(crate) size: [u32; 2],
    pub(crate) discs: Vec<Disc>,
    /// Places in the cloud.
    pub(crate) ids: Vec<u32>,
    pub(crate) looks: Vec<Look>,
    pub(crate) kernels: Vec<Kernel>,
    /// Normals that light is bent about, and sides are told by, in the camera's space.
    pub(crate) normals: Vec<Vec3>,
    /// By id.
    pub(crate) materials: Vec<Material>,
    /// View depths of the nearest and the farthest disc before the eye.
    pub(crate) depths: [f32; 2],
    /// Into the camera's space from the cloud's, see [`into_view`].
    pub(crate) view: (DMat3, DVec3),
    /// Focal length, pixels, or pixels in a unit of the cloud for parallel rays.
    focal: f32,
    parallel: bool,
}

/// The ray of a pixel, in the camera's space.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    /// The eye, or a place of its plane.
    pub(crate) from: Vec3,
    /// Unit length.
    pub(crate) along: Vec3,
    /// Distance along it over view depth.
    pub(crate) length: f32,
    /// At its start.
    pub(crate) cone: Cone,
}

impl Ray {
    /// Its place at a view depth.
    pub(crate) fn at(&self, depth: f32) -> Vec3 {
        self.from + self.along * (depth * self.length)
    }
}

/// What one disc shows, beside its values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// Of one crossing, by channel: the opacity, or for a slab the optical depth at right angles.
    pub(crate) crossing: [f32; 3],
    pub(crate) is_slab: bool,
    pub(crate) footprint: u8,
    pub(crate) material: u16,
    pub(crate) object: u32,
}

impl Look {
    /// Opacity of one crossing in a channel, by a ray at some |cosine| to the normal.
    #[inline]
    pub(crate) fn opacity(&self, channel: usize, cosine: f32) -> f32 {
        if self.is_slab {
            let factor = SurfaceOpacity::ThinSlab.optical_depth_factor(cosine);
            -libm::expm1f(-self.crossing[channel] * factor)
        } else {
            self.crossing[channel]
        }
    }
}

impl Discs {
    /// Projects discs; those that no ray meets are kept, and are in no pixel.
    ///
    /// # Panics
    /// If an id, a material or a footprint is out of range, or a splat is a piece of a medium.
    pub fn project(input: &DiscInput<'_>, params: &Params) -> Self {
        Self::project_members(input, params, None)
    }

    /// The same with discs as large as their groups draw them.
    ///
    /// # Panics
    /// As [`Discs::project`], and if `members` are not of the input's cloud.
    pub fn project_members(input: &DiscInput<'_>, params: &Params, members: Option<&Membership>) -> Self {
        let view = View::new(input, members);
        let chunks = input.ids.par_chunks(CHUNK);
        let depths = |ids: &[u32]| ids.iter().map(|&i| view.depths(i as usize, params)).fold(NO_DEPTHS, wider);
        let depths = chunks.clone().map(depths).reduce(|| NO_DEPTHS, wider).map(|d| d as f32);
        let parts: Vec<Vec<(Disc, Look)>> =
            chunks.map(|ids| ids.iter().map(|&i| view.disc(i as usize, params)).collect()).collect();
        let (discs, looks) = parts.into_iter().flatten().unzip();
        let kernels = input.footprints.layers().iter().map(Kernel::new).collect();
        let normal = |&i: &u32| (view.rotation * input.cloud.shading_normal_of(i as usize).as_dvec3()).as_vec3();
        Self {
            size: input.camera.size,
            discs,
            ids: input.ids.to_vec(),
            looks,
            kernels,
            normals: input.ids.par_iter().map(normal).collect(),
            materials: input.materials.to_vec(),
            depths,
            view: (view.rotation, view.shift),
            focal: view.focal as f32,
            parallel: view.parallel,
        }
    }

    /// n of Eq. 10 for which a step of depth is as long as ε: the gap of the parameters, times the mean radius of the discs.
    pub fn depth_steps(&self, params: &Params) -> u32 {
        let of_chunk = |discs: &[Disc]| discs.iter().map(|disc| f64::from(disc.radius)).sum::<f64>();
        // Chunk by chunk in order, so that the sum does not depend on threads.
        let sums: Vec<f64> = self.discs.par_chunks(CHUNK).map(of_chunk).collect();
        let radius = sums.iter().sum::<f64>() / self.discs.len().max(1) as f64;
        let [near, far] = self.depths.map(f64::from);
        let steps = ((far - near) / (f64::from(params.gap) * radius)).ceil();
        if steps.is_finite() { steps.clamp(1.0, f64::from(u32::MAX)) as u32 } else { 1 }
    }

    /// The ray of a pixel.
    pub(crate) fn ray(&self, pixel: [usize; 2]) -> Ray {
        let [x, y] = pixel;
        let offset = |at: usize, size: u32| (at as f32 + 0.5 - 0.5 * size as f32) / self.focal;
        let at = Vec3::new(offset(x, self.size[0]), -offset(y, self.size[1]), 0.0);
        if self.parallel {
            let cone = Cone { width: 1.0 / self.focal, spread: 0.0 };
            return Ray { from: at, along: Vec3::Z, length: 1.0, cone };
        }
        let length = (1.0 + at.length_squared()).sqrt();
        let cone = Cone { width: 0.0, spread: 1.0 / (self.focal * length * length) };
        Ray { from: Vec3::ZERO, along: (at + Vec3::Z) / length, length, cone }
    }

    /// Where a ray is at a view depth, relative to the cloud's origin.
    pub(crate) fn place(&self, ray: &Ray, depth: f32) -> Vec3 {
        let (rotation, shift) = self.view;
        (rotation.transpose() * ray.at(depth).as_dvec3() - shift).as_vec3()
    }

    /// Width of a pixel at a view depth.
    pub(crate) fn pixel_width(&self, depth: f32) -> f32 {
        if self.parallel { 1.0 / self.focal } else { depth / self.focal }
    }

    /// Number of discs that some pixel may see.
    pub fn visible(&self) -> u64 {
        self.discs.par_iter().with_min_len(CHUNK).filter(|d| d.is_in_view()).count() as u64
    }

    /// Bytes of all discs.
    pub fn bytes(&self) -> u64 {
        let normals = size_of_val(&*self.normals);
        (size_of_val(&*self.discs) + size_of_val(&*self.ids) + size_of_val(&*self.looks) + normals) as u64
    }
}

/// Of no disc.
const NO_DEPTHS: [f64; 2] = [f64::INFINITY, 0.0];

fn wider(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Where the rays of some pixels meet a disc's plane.
pub(crate) struct Meeting<S: Simd> {
    /// N, and one over it.
    pub(crate) facing: Lanes<S>,
    pub(crate) inverse: Lanes<S>,
    /// ρ²/R², R the radius within which the disc counts; not below 1, or no number, where the ray lies in the plane.
    pub(crate) distance_sq: Lanes<S>,
    pub(crate) depth: Lanes<S>,
}

impl Disc {
    /// The rays of pixels at some offsets from [`Disc::center`].
    #[inline(always)]
    pub(crate) fn meet<S: Simd>(&self, simd: S, offset: [Lanes<S>; 2]) -> Meeting<S> {
        let [dx, dy] = offset;
        let linear = |at: f32, slope: [f32; 2]| {
            simd.lanes(slope[1]).mul_add(dy, simd.lanes(slope[0]).mul_add(dx, simd.lanes(at)))
        };
        let facing = linear(self.facing, self.facing_slope);
        let inverse = simd.lanes(1.0) / facing;
        // Not by a map of an array: the compiler does not inline that, and calls a function for every instruction.
        let u = linear(self.along[0], self.along_slope[0]) * inverse;
        let v = linear(self.along[1], self.along_slope[1]) * inverse;
        let depth = linear(self.depth, self.depth_slope) * inverse;
        Meeting { facing, inverse, distance_sq: u * u + v * v, depth }
    }

    fn is_in_view(&self) -> bool {
        let [x0, x1, y0, y1] = self.pixels;
        x0 < x1 && y0 < y1
    }
}

/// The camera's side of a projection.
struct View<'a> {
    input: &'a DiscInput<'a>,
    members: Option<&'a Membership>,
    rotation: DMat3,
    /// From the cloud's origin to the eye.
    shift: DVec3,
    focal: f64,
    half: [f64; 2],
    parallel: bool,
}

impl<'a> View<'a> {
    fn new(input: &'a DiscInput<'a>, members: Option<&'a Membership>) -> Self {
        let camera = input.camera;
        let (rotation, shift) = into_view(input);
        Self {
            input,
            members,
            rotation,
            shift,
            focal: camera.focal_px(),
            half: camera.size.map(|s| 0.5 * f64::from(s)),
            parallel: camera.is_orthographic(),
        }
    }

    /// Semi-axes of a disc, in the camera's space.
    fn axes(&self, i: usize, params: &Params) -> [DVec3; 2] {
        let reach = self.members.map_or(1.0, |members| f64::from(members.reach(i)));
        axes(self.input.cloud, i, f64::from(params.disc_scale) * reach).map(|a| self.rotation * a)
    }

    /// Nearest and farthest depth of a disc, cut at the eye plane.
    fn depths(&self, i: usize, params: &Params) -> [f64; 2] {
        let cloud = self.input.cloud;
        let depth = (self.rotation * (cloud.position[i].as_dvec3() + self.shift)).z;
        let reach = squares(self.axes(i, params), 2).sqrt();
        if depth + reach > 0.0 { [(depth - reach).max(0.0), depth + reach] } else { NO_DEPTHS }
    }

    fn disc(&self, i: usize, params: &Params) -> (Disc, Look) {
        let cloud = self.input.cloud;
        assert_ne!(cloud.kind[i], SplatKind::Medium, "invariant: discs alone are blended");
        let center = self.rotation * (cloud.position[i].as_dvec3() + self.shift);
        let normal = self.rotation * cloud.normal_of(i).as_dvec3();
        let axes = self.axes(i, params);
        let disc =
            if self.parallel { self.parallel(center, normal, axes) } else { self.perspective(center, normal, axes) };
        (disc, look(self.input, i))
    }

    /// Rays from the eye.
    fn perspective(&self, center: DVec3, normal: DVec3, axes: [DVec3; 2]) -> Disc {
        let z = center.z;
        let reach = squares(axes, 2).sqrt();
        let crosses = z <= reach;
        // Where the disc is seen by any pixel each fragment tells which.
        let ranges = if crosses { [[f64::NEG_INFINITY, f64::INFINITY]; 2] } else { self.touching(center, axes) };
        let toward = if crosses { DVec3::Z } else { center / z };
        let facing = normal.dot(toward);
        let distance = normal.dot(center);
        let facing_slope = [normal.x / self.focal, -normal.y / self.focal];
        let of_axis = |a: DVec3| {
            let along_center = a.dot(center);
            let scale = 1.0 / a.length_squared();
            let at = if crosses { (distance * a.z - along_center * normal.z) * scale } else { 0.0 };
            let slope = |e: f64, n: f64| ((distance * e - along_center * n) * scale) as f32;
            (at as f32, [slope(a.x / self.focal, facing_slope[0]), slope(-a.y / self.focal, facing_slope[1])])
        };
        let along = axes.map(of_axis);
        Disc {
            center: [self.half[0] + self.focal * toward.x, self.half[1] - self.focal * toward.y].map(|v| v as f32),
            along: along.map(|a| a.0),
            along_slope: along.map(|a| a.1),
            facing: facing as f32,
            facing_slope: facing_slope.map(|v| v as f32),
            depth: distance as f32,
            depth_slope: [0.0; 2],
            radius: mean_radius(axes),
            pixels: if z + reach > 0.0 { self.pixels(ranges) } else { [0; 4] },
        }
    }

    /// Columns and rows between the planes through the eye that touch an ellipse: (c_x − u·c_z)² = (a_x − u·a_z)² + (b_x − u·b_z)².
    fn touching(&self, center: DVec3, axes: [DVec3; 2]) -> [[f64; 2]; 2] {
        let range = |axis: usize| {
            let square = center.z * center.z - squares(axes, 2);
            let mixed = center[axis] * center.z - axes[0][axis] * axes[0].z - axes[1][axis] * axes[1].z;
            let other = center[axis] * center[axis] - squares(axes, axis);
            let root = (mixed * mixed - square * other).max(0.0).sqrt();
            [(mixed - root) / square, (mixed + root) / square]
        };
        let [left, right] = range(0);
        let [down, up] = range(1);
        let place = |axis: usize, v: f64| self.half[axis] + self.focal * v;
        [[place(0, left), place(0, right)], [place(1, -up), place(1, -down)]]
    }

    /// Rays along the view.
    fn parallel(&self, center: DVec3, normal: DVec3, axes: [DVec3; 2]) -> Disc {
        let facing = normal.z;
        let slope = [-normal.x / self.focal, normal.y / self.focal];
        let along = axes.map(|a| {
            let scale = 1.0 / a.length_squared();
            let part = |e: f64, z: f64| ((facing * e + a.z * z) * scale) as f32;
            [part(a.x / self.focal, slope[0]), part(-a.y / self.focal, slope[1])]
        });
        let at = [self.half[0] + self.focal * center.x, self.half[1] - self.focal * center.y];
        let range = |axis: usize| {
            let reach = self.focal * squares(axes, axis).sqrt();
            [at[axis] - reach, at[axis] + reach]
        };
        Disc {
            center: at.map(|v| v as f32),
            along: [0.0; 2],
            along_slope: along,
            facing: facing as f32,
            facing_slope: [0.0; 2],
            depth: (center.z * facing) as f32,
            depth_slope: slope.map(|v| v as f32),
            radius: mean_radius(axes),
            pixels: self.pixels([range(0), range(1)]),
        }
    }

    /// Pixels whose centres may lie in a rectangle of the image, with one pixel around for rounding.
    fn pixels(&self, ranges: [[f64; 2]; 2]) -> [u32; 4] {
        let clamp = |v: f64, axis: usize| v.clamp(0.0, 2.0 * self.half[axis]) as u32;
        let [x, y] = ranges;
        [clamp(x[0] - 1.0, 0), clamp(x[1] + 1.0, 0), clamp(y[0] - 1.0, 1), clamp(y[1] + 1.0, 1)]
    }
}

/// What a disc shows.
pub(crate) fn look(input: &DiscInput<'_>, i: usize) -> Look {
    let cloud = input.cloud;
    let material = &input.materials[cloud.material[i] as usize];
    let footprint = &input.footprints.layers()[cloud.footprint[i] as usize];
    let is_slab = material.surface_opacity == SurfaceOpacity::ThinSlab;
    let tau = f64::from(cloud.crossing_depth_of(i, footprint.spacing_for_radius(cloud.radius[i])));
    let crossing = material.extinction_rgb.map(|factor| {
        let tau = tau * f64::from(factor);
        (if is_slab { tau } else { optics::opacity(tau) }) as f32
    });
    Look { crossing, is_slab, footprint: cloud.footprint[i], material: cloud.material[i], object: cloud.object[i] }
}

/// The map from the cloud's space to the camera's (x right, y up, z along the view): add the vector, then rotate by the matrix.
pub(crate) fn into_view(input: &DiscInput<'_>) -> (DMat3, DVec3) {
    let [right, up, forward] = input.camera.axes;
    (DMat3::from_cols(right, up, forward).transpose(), input.cloud.origin - input.camera.position)
}

/// Semi-axes of a disc, in the cloud's space.
pub(crate) fn axes(cloud: &Cloud, i: usize, scale: f64) -> [DVec3; 2] {
    let normal = cloud.normal_of(i).as_dvec3().normalize_or(DVec3::Z);
    let tangent = cloud.tangent_of(i).as_dvec3();
    let radius = f64::from(cloud.radius[i]) * scale;
    let first = if tangent == DVec3::ZERO { normal.any_orthonormal_vector() * radius } else { tangent * scale };
    let across = normal.cross(first).normalize_or(normal.any_orthonormal_vector());
    [first, across * radius]
}

fn squares(axes: [DVec3; 2], axis: usize) -> f64 {
    axes[0][axis] * axes[0][axis] + axes[1][axis] * axes[1][axis]
}

fn mean_radius(axes: [DVec3; 2]) -> f32 {
    (axes[0].length() * axes[1].length()).sqrt() as f32
}
