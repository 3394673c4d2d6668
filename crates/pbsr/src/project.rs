//! STEP 2, first half: particles onto pixels (Tanaka 2012, section 3, "s is made dependent on view depth").
//!
//! A pixel at view position p = (x, y, z) covers the area s(p) = z³/(f²·|p|) across its ray (perspective, focal length f
//! in pixels), or 1/f² (orthographic). A set has its opacity where s(p) is the cross-section s of its particles. Elsewhere
//! it has s(p)/s times as many particles a pixel as it should have, so with k = s/s(p)
//!
//! - k ≤ 1: each particle is kept with probability k, by a random number that belongs to it. A binomial variable thinned is
//!   binomial: with the share of particles that reach the pixel goes q to k·q = s/(S·cos θ), the same for all depths.
//! - k > 1, nearer than the set was made for: the particle covers the pixels around which a square of side √k holds it, k
//!   being the pixel's at the particle's depth. Each pixel is then hit with k times the probability, each particle at most
//!   once: α is exact where the surface is flat over √k pixels, and blurred by them elsewhere. Fog around the eye has its
//!   optical depth along every ray, since k grows with the angle from pixel to pixel; the particle's own would grow without
//!   limit for what lies beside the image.
//!
//! Both make exactly one pixel, floor(x), floor(y), of k = 1. A surface of angle-independent opacity has k·|cos θ|.

pub(crate) mod bins;
pub(crate) mod colored;
pub(crate) mod flat;
pub(crate) mod nearest;
pub(crate) mod resolve;
pub(crate) mod shade;
pub(crate) mod tiles;

use crate::PackedNormal;
use crate::project::tiles::{Tiling, place};
use glam::{DMat3, DVec3, Mat3, Vec3};
use splat_core::{Camera, Similarity, glam};

/// The widest particle, pixels: more than an image has.
const WIDEST_PX: f32 = 131_072.0;

/// Area of one pixel across its ray at a world position, world units². In perspective it is 0 at the eye and behind it,
/// where there are no pixels; samplers refuse it as a cross-section.
pub fn pixel_area(camera: &Camera, position: DVec3) -> f64 {
    pixel_area_view(camera, camera.view_from_world(position))
}

/// The same at a view position (x right, y up, z depth).
pub(crate) fn pixel_area_view(camera: &Camera, view: DVec3) -> f64 {
    let f = camera.focal_px();
    if camera.is_orthographic() {
        1.0 / (f * f)
    } else if view.z > 0.0 {
        view.z / f * (view.z / f) * (view.z / view.length())
    } else {
        0.0
    }
}

/// The range of view depths of particles, from the corners of boxes that hold them; \[0, 1\] without a box.
pub fn depth_range(corners: impl Iterator<Item = DVec3>, camera: &Camera) -> [f32; 2] {
    let depths = corners.map(|p| camera.view_from_world(p).z.max(0.0) as f32);
    let [near, far] = depths.fold([f32::INFINITY, 0.0], |[near, far], z| [near.min(z), far.max(z)]);
    // A plane that faces the eye has one depth, which lies inside.
    let margin = far * f32::EPSILON * 1024.0;
    if near < far + margin { [(near - margin).max(0.0), far + margin] } else { [0.0, 1.0] }
}

/// The smallest area of a pixel on what lies in a ball, world units²: a cross-section with which no particle needs to be
/// widened. Depths nearer than `near` × radius to the eye, or behind it, count as that depth.
pub fn finest_pixel_area(camera: &Camera, center: DVec3, radius: f64, near: f64) -> f64 {
    let view = camera.view_from_world(center);
    let z = (view.z - radius).max(near * radius);
    let f = camera.focal_px();
    // The farthest from the axis that the image reaches.
    let corner = DVec3::new(0.5 * f64::from(camera.size[0]) / f, 0.5 * f64::from(camera.size[1]) / f, 1.0);
    pixel_area_view(camera, corner * z)
}

/// From the offsets of one object's particles to pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projector {
    pub(crate) linear: Mat3,
    pub(crate) translation: Vec3,
    /// Rotation alone, for normals.
    pub(crate) rotation: Mat3,
    focal: f32,
    middle: [f32; 2],
    size: [f32; 2],
    orthographic: bool,
    /// s·f² in view units: k is this times |d|/z², d the ray of depth 1, or this.
    pub(crate) share: f32,
}

/// Particles that are projected at once.
pub(crate) const BLOCK: usize = 128;

/// Particles in view.
pub(crate) struct View {
    /// Image position, pixels.
    pub(crate) x: [f32; BLOCK],
    pub(crate) y: [f32; BLOCK],
    /// View depth.
    pub(crate) z: [f32; BLOCK],
    /// k of a thin slab; 0 for what is behind the eye.
    pub(crate) k: [f32; BLOCK],
    /// The tile, or [`Tiling::tiles`] out of the image.
    pub(crate) tile: [u32; BLOCK],
    /// The place in the tile, as a record has it.
    pub(crate) place: [u32; BLOCK],
    /// Whether k > 1 for some, and whether k < 1 for some.
    pub(crate) wide: bool,
    pub(crate) thin: bool,
}

impl View {
    pub(crate) const EMPTY: Self = Self {
        x: [0.0; BLOCK],
        y: [0.0; BLOCK],
        z: [0.0; BLOCK],
        k: [0.0; BLOCK],
        tile: [0; BLOCK],
        place: [0; BLOCK],
        wide: false,
        thin: false,
    };
}

impl View {
    /// Leaves out those of `n` particles before the first depth, or at the second or behind it.
    pub(crate) fn leave_out(&mut self, n: usize, range: [f32; 2], outside: u32) {
        let [near, far] = range;
        for i in 0..n {
            if !(near..far).contains(&self.z[i]) {
                (self.tile[i], self.k[i]) = (outside, 0.0);
            }
        }
        self.thin = true;
    }
}

/// All depths.
pub(crate) const EVERYWHERE: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// Pixels that a widened particle may reach: `x[0] .. x[1]` × `y[0] .. y[1]`, of which it covers those that
/// [`Footing::covers`] says.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footing {
    pub(crate) x: [i32; 2],
    pub(crate) y: [i32; 2],
    /// Where the particle falls.
    at: [f32; 2],
    /// k of a pixel that is seen along the view.
    k: f32,
    middle: [f32; 2],
    /// Slope of a ray for each pixel from the middle; 0 for parallel rays.
    slope: f32,
}

impl Footing {
    /// Whether a pixel's square holds the particle.
    #[inline]
    pub(crate) fn covers(&self, x: i32, y: i32) -> bool {
        let centre = [x as f32 + 0.5, y as f32 + 0.5];
        let half = 0.5 * (self.k * stretch(self.slope, self.middle, centre)).sqrt();
        let within = |a: usize| centre[a] - self.at[a] > -half && centre[a] - self.at[a] <= half;
        within(0) && within(1)
    }
}

/// |d| of the ray of depth 1 through a place of the image.
#[inline(always)]
fn stretch(slope: f32, middle: [f32; 2], at: [f32; 2]) -> f32 {
    let [x, y] = [(at[0] - middle[0]) * slope, (at[1] - middle[1]) * slope];
    (1.0 + x * x + y * y).sqrt()
}

impl Projector {
    pub(crate) fn new(camera: &Camera, origin: DVec3, transform: &Similarity, cross_section: f64) -> Self {
        let view = DMat3::from_cols(camera.axes[0], camera.axes[1], camera.axes[2]).transpose();
        let rotation = view * DMat3::from_quat(transform.rotation);
        let f = camera.focal_px();
        Self {
            linear: (rotation * transform.scale).as_mat3(),
            translation: camera.view_from_world(transform.apply(origin)).as_vec3(),
            rotation: rotation.as_mat3(),
            focal: f as f32,
            middle: camera.size.map(|s| 0.5 * s as f32),
            size: camera.size.map(|s| s as f32),
            orthographic: camera.is_orthographic(),
            share: (cross_section * transform.scale * transform.scale * f * f) as f32,
        }
    }

    /// View-space normal, as the object is turned.
    pub(crate) fn view_normal(&self, n: PackedNormal) -> Vec3 {
        self.rotation * n.get()
    }

    /// Brings at most [`BLOCK`] particles into view.
    pub(crate) fn view(&self, offsets: &[Vec3], tiling: &Tiling, view: &mut View) {
        pulp::Arch::new().dispatch(Lanes { projector: self, offsets, tiling, view });
    }

    /// |cos θ| at an offset with a normal; a particle without one is a thin slab.
    pub(crate) fn cosine(&self, offset: Vec3, n: PackedNormal) -> f32 {
        let normal = self.view_normal(n);
        if normal == Vec3::ZERO {
            return 1.0;
        }
        let p = self.linear * offset + self.translation;
        let cosine = if self.orthographic { normal.z } else { normal.dot(p) / p.length() };
        cosine.abs()
    }

    /// The pixels of a particle with k > 1.
    #[inline]
    pub(crate) fn widened(&self, x: f32, y: f32, k: f32) -> Footing {
        let slope = if self.orthographic { 0.0 } else { 1.0 / self.focal };
        let inside = [x.clamp(0.0, self.size[0]), y.clamp(0.0, self.size[1])];
        let k = k / stretch(slope, self.middle, inside);
        let half = 0.5 * (k * stretch(slope, self.middle, [0.0; 2])).sqrt().min(WIDEST_PX);
        let range = |v: f32, size: f32| {
            // Centres i + 1/2 in (v − half, v + half].
            let from = ((v - half - 0.5).floor() + 1.0).max(0.0);
            let to = ((v + half - 0.5).floor() + 1.0).min(size);
            [from as i32, to as i32]
        };
        Footing { x: range(x, self.size[0]), y: range(y, self.size[1]), at: [x, y], k, middle: self.middle, slope }
    }
}

/// One block, in the form that [`pulp`] compiles once per instruction set.
struct Lanes<'a> {
    projector: &'a Projector,
    offsets: &'a [Vec3],
    tiling: &'a Tiling,
    view: &'a mut View,
}

impl pulp::NullaryFnOnce for Lanes<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        if self.projector.orthographic { self.run::<true>() } else { self.run::<false>() }
    }
}

impl Lanes<'_> {
    #[inline(always)]
    fn run<const ORTHOGRAPHIC: bool>(self) {
        let Self { projector, offsets, tiling, view } = self;
        let &Projector { linear, translation, focal, middle, share, size, .. } = projector;
        // Slopes of the rays at the borders: what lies beside the image has the k of the nearest pixel.
        let reach = middle.map(|middle| middle / focal);
        let columns = tiling.columns as u32;
        let outside = tiling.tiles() as u32;
        let n = offsets.len().min(BLOCK);
        for i in 0..n {
            let p = linear * offsets[i] + translation;
            let inverse = if ORTHOGRAPHIC { 1.0 } else { 1.0 / p.z };
            let at = [middle[0] + focal * p.x * inverse, middle[1] - focal * p.y * inverse];
            (view.x[i], view.y[i], view.z[i]) = (at[0], at[1], p.z);
            // NaN is out of the image; in the image nothing is cut.
            let seen = (at[0] >= 0.0) & (at[0] < size[0]) & (at[1] >= 0.0) & (at[1] < size[1]);
            let pixel = at.map(|v| v.clamp(0.0, 65535.0).floor());
            let within = [0, 1].map(|a| whole(((at[a] - pixel[a]) * 256.0).floor()) & 255);
            let pixel = pixel.map(whole);
            let (tile, place) = place(pixel[0], pixel[1], within[0] | within[1] << 8, columns);
            (view.tile[i], view.place[i]) = (if seen { tile } else { outside }, place);
            let [dx, dy] = [p.x * inverse, p.y * inverse];
            let [dx, dy] = [dx.clamp(-reach[0], reach[0]), dy.clamp(-reach[1], reach[1])];
            let long = (1.0 + dx * dx + dy * dy).sqrt();
            let k = if ORTHOGRAPHIC { share } else { share * long * inverse * inverse };
            let k = if p.z > 0.0 { k } else { 0.0 };
            view.k[i] = k;
        }
        // On its own: in the loop above it would keep it from going in lanes.
        let k = &view.k[..n];
        view.wide = k.iter().map(|k| u32::from(*k > 1.0)).sum::<u32>() > 0;
        view.thin = k.iter().map(|k| u32::from(*k >= 1.0)).sum::<u32>() < n as u32;
    }
}

/// The bits of a whole number in 0 .. 65536, in lanes: a conversion that minds every input is not done in lanes.
#[inline(always)]
fn whole(v: f32) -> u32 {
    (v + 8_388_608.0).to_bits() & 0xffff
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{Projection, rng};

    /// The pixels of one particle, none of k ≤ 1 that is thinned out by `random`.
    fn project(projector: &Projector, offset: Vec3, random: f32) -> Vec<[i32; 2]> {
        let mut view = View::EMPTY;
        let tiling = Tiling::new(projector.size.map(|s| s as u32));
        projector.view(&[offset], &tiling, &mut view);
        let x = view.x[0];
        let y = view.y[0];
        let k = view.k[0];
        assert_eq!((view.wide, view.thin), (k > 1.0, k < 1.0));
        if k > 1.0 {
            let foot = projector.widened(x, y, k);
            let pixels = (foot.y[0]..foot.y[1]).flat_map(|y| (foot.x[0]..foot.x[1]).map(move |x| [x, y]));
            return pixels.filter(|[x, y]| foot.covers(*x, *y)).collect();
        }
        let seen = (view.tile[0] as usize) < tiling.tiles();
        if seen && (k >= 1.0 || random < k) { vec![[x as i32, y as i32]] } else { Vec::new() }
    }

    fn camera(projection: Projection) -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, [64, 48]).unwrap()
    }

    #[test]
    fn pb17_a_particle_on_a_border_is_in_one_pixel() {
        // Pixels of side 1/8: borders are exact in f32.
        let camera = camera(Projection::Orthographic { height: 6.0 });
        let area = pixel_area(&camera, DVec3::Z);
        assert_eq!(area, 1.0 / 64.0);
        let at = |share: f64| Projector::new(&camera, DVec3::ZERO, &Similarity::default(), area * share);
        let mut seen = 0;
        for i in -40i32..40 {
            for j in -30i32..30 {
                let p = Vec3::new(i as f32 / 8.0, j as f32 / 8.0, -1.0);
                let pixels = project(&at(1.0), p, 0.5);
                let inside = (-32..32).contains(&i) && (-24..24).contains(&-j);
                assert_eq!(pixels, if inside { vec![[i + 32, 24 - j]] } else { Vec::new() }, "{i} {j}");
                seen += pixels.len();
            }
        }
        assert_eq!(seen, 64 * 48);
    }

    #[test]
    fn pb17_hits_are_the_particles_in_view_times_k() {
        for (projection, depth) in
            [(Projection::Orthographic { height: 4.0 }, 3.0), (Projection::Perspective { fov_y: 0.8 }, 3.0)]
        {
            let camera = camera(projection);
            let width = 8.0 * pixel_area(&camera, DVec3::NEG_Z * depth).sqrt() as f32;
            for k in [0.3, 1.0, 2.7, 40.0] {
                let s = k * pixel_area(&camera, DVec3::NEG_Z * depth);
                let projector = Projector::new(&camera, DVec3::ZERO, &Similarity::default(), s);
                let mut hits = 0.0;
                let mut expected = 0.0;
                let mut variance = 0.0;
                for i in 0..100_000u64 {
                    let u = |c| rng::unit_f32(5, 0, i, c);
                    // Whole pixels around the axis, so that all phases are met, and no widened particle is cut.
                    let p = Vec3::new((u(0) - 0.5) * width, (u(1) - 0.5) * width, -depth as f32);
                    let share = s / pixel_area(&camera, p.as_dvec3());
                    hits += project(&projector, p, u(2)).len() as f64;
                    expected += share;
                    variance += share;
                }
                assert!((hits - expected).abs() < 4.5 * f64::sqrt(variance), "k {k}: {hits} for {expected}");
            }
        }
    }

    #[test]
    fn a_pixel_has_its_area_at_world_positions_and_none_behind_the_eye() {
        let eye = DVec3::new(3.0, -2.0, 5.0);
        let view = Projection::Perspective { fov_y: 0.8 };
        let camera = Camera::look_at(eye, DVec3::new(1.0, 0.5, 0.0), DVec3::Y, view, [64, 48]).unwrap();
        for (x, y, depth) in [(10.5, 3.5, 1.5), (32.0, 24.0, 4.0), (60.0, 47.0, 0.2)] {
            let (_, ray) = camera.view_ray(x, y);
            let turned = camera.axes[0] * ray.x + camera.axes[1] * ray.y + camera.axes[2] * ray.z;
            // The pixel covers 1/f by 1/f at depth 1, seen at an angle.
            let expected = (depth / camera.focal_px()).powi(2) / ray.length();
            let found = pixel_area(&camera, eye + turned * depth);
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} for {expected}");
            assert_eq!(pixel_area(&camera, eye - turned * depth), 0.0);
        }
        assert_eq!(pixel_area(&camera, eye), 0.0);
    }

    #[test]
    fn pixel_areas_add_up_to_the_sphere() {
        // Solid angle of all pixels of a cube's face: 4π/6.
        let camera = Camera::look_at(
            DVec3::ZERO,
            DVec3::NEG_Z,
            DVec3::Y,
            Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2 },
            [256, 256],
        )
        .unwrap();
        let mut sum = 0.0;
        for i in 0..256 {
            for j in 0..256 {
                let (_, d) = camera.view_ray(f64::from(i) + 0.5, f64::from(j) + 0.5);
                let on_sphere = d.normalize();
                sum += pixel_area_view(&camera, on_sphere);
            }
        }
        assert!((sum / (4.0 * std::f64::consts::PI / 6.0) - 1.0).abs() < 1e-5, "{sum}");
        let finest = finest_pixel_area(&camera, DVec3::new(0.0, 0.0, -3.0), 1.0, 1e-3);
        for d in [DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.9, 0.3, 3.0), DVec3::new(2.0, 2.0, 2.0)] {
            assert!(pixel_area_view(&camera, d) >= finest * (1.0 - 1e-12));
        }
    }
}
