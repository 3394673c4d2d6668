//! An image, the eye's or the light's, as slab coordinates see it: where places are in it, and how far kernels reach there.
//!
//! A kernel is a footprint along its slab times sections across it: in the slab's plane an ellipse s(q) = 1 about the voxel. A
//! pixel has the value of the place q at which its own ray is in the midst of slab and volume, so the eye and the light see one
//! and the same sheet, each at its own places.

use super::frame::Frame;
use super::placed::Placed;
use crate::shared::depths::DepthRange;
use splat_core::Camera;
use splat_core::glam::{DMat2, DVec2, DVec3, Vec2, Vec3};

/// Least standard deviation of a footprint in its narrow direction, pixels: none falls between pixels.
const LEAST_SIGMA_PX: f64 = 0.5;

/// What rounding may move an edge by, pixels.
const MARGIN: f32 = 0.05;

/// One image in slab coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight {
    pub(crate) camera: Camera,
    /// Place of slab coordinates 0: x right, y down, z depth.
    origin: Vec3,
    /// What moves it per unit of the three.
    steps: [Vec3; 3],
    focal: f32,
    center: [f32; 2],
    is_parallel: bool,
}

/// The footprint of one volume in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shape {
    /// s = conic·(da², 2·da·db, db²), 1 at the rim.
    pub(crate) conic: [f32; 3],
    /// Extent of the ellipse in the slab, world units²: aa, ab, bb.
    extent: [f64; 3],
    /// For columns and for rows: extents of the image's two directions x and z, xx, xz, zz.
    bounds: [[f32; 3]; 2],
}

/// Where a kernel begins and ends in an image, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelBounds {
    pub(crate) left: f32,
    pub(crate) right: f32,
    pub(crate) top: f32,
    pub(crate) bottom: f32,
}

impl PixelBounds {
    const ENDLESS: Self =
        Self { left: f32::NEG_INFINITY, right: f32::INFINITY, top: f32::NEG_INFINITY, bottom: f32::INFINITY };
}

/// The pixels about a place, and the shares of the second of each pair; those at a border are those inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelsAround {
    pub(crate) columns: [usize; 2],
    pub(crate) rows: [usize; 2],
    /// Of the second column.
    pub(crate) u: f32,
    /// Of the second row.
    pub(crate) v: f32,
}

impl Sight {
    pub(crate) fn new(frame: &Frame, camera: Camera) -> Self {
        let view = |p: DVec3| {
            let v = camera.view_from_world(frame.world(p));
            DVec3::new(v.x, -v.y, v.z)
        };
        let origin = view(DVec3::ZERO);
        let [right, up, forward] = camera.axes.map(|axis| frame.direction(axis));
        let step = |a: usize| Vec3::new(right[a] as f32, -up[a] as f32, forward[a] as f32);
        Self {
            camera,
            origin: origin.as_vec3(),
            steps: [0, 1, 2].map(step),
            focal: camera.focal_px() as f32,
            center: camera.size.map(|s| 0.5 * s as f32),
            is_parallel: camera.is_orthographic(),
        }
    }

    /// x, y and depth of slab coordinates, world units.
    #[inline(always)]
    fn image(&self, p: Vec3) -> Vec3 {
        let [a, b, across] = self.steps;
        self.origin + a * p.x + b * p.y + across * p.z
    }

    /// Pixel of slab coordinates before the image.
    #[inline(always)]
    pub(crate) fn pixel(&self, p: Vec3) -> [f32; 2] {
        let seen = self.image(p);
        let scale = if self.is_parallel { self.focal } else { self.focal / seen.z };
        [self.center[0] + seen.x * scale, self.center[1] + seen.y * scale]
    }

    /// Whether slab coordinates lie within the image.
    pub(crate) fn shows(&self, p: Vec3) -> bool {
        let pixel = self.pixel(p);
        let is_before = self.is_parallel || self.image(p).z > 0.0;
        is_before && (0..2).all(|a| pixel[a] >= 0.0 && pixel[a] <= self.camera.size[a] as f32)
    }

    /// The pixels about a place of the image, pixels.
    #[inline(always)]
    pub(crate) fn around(&self, place: [f32; 2]) -> PixelsAround {
        let mut pixels = [[0; 2]; 2];
        let mut shares = [0.0; 2];
        for a in 0..2 {
            let n = self.camera.size[a] as usize;
            let v = (place[a] - 0.5).clamp(0.0, (n - 1) as f32);
            let low = (v as usize).min(n.saturating_sub(2));
            (pixels[a], shares[a]) = ([low, (low + 1).min(n - 1)], v - low as f32);
        }
        PixelsAround { columns: pixels[0], rows: pixels[1], u: shares[0], v: shares[1] }
    }

    /// Bounds of all pixels that see the kernel of a voxel at these coordinates along the slabs, between two depths.
    #[inline(always)]
    pub(crate) fn bounds(&self, shape: &Shape, center: Vec2, depths: DepthRange) -> PixelBounds {
        let one = self.bounds_at(shape, center.extend(depths.near));
        if depths.near == depths.far {
            return one;
        }
        let other = self.bounds_at(shape, center.extend(depths.far));
        PixelBounds {
            left: one.left.min(other.left),
            right: one.right.max(other.right),
            top: one.top.min(other.top),
            bottom: one.bottom.max(other.bottom),
        }
    }

    #[inline(always)]
    fn bounds_at(&self, shape: &Shape, p: Vec3) -> PixelBounds {
        let seen = self.image(p);
        let [[xx, xz, zz], [yy, yz, _]] = shape.bounds;
        let (x, y, half_x, half_y, scale) = if self.is_parallel {
            (seen.x, seen.y, xx.sqrt(), yy.sqrt(), self.focal)
        } else {
            // The nearest place of the ellipse: |x/z − x₀/z₀| = |δx − (x₀/z₀)·δz|/z.
            let nearest = seen.z - zz.sqrt();
            if nearest <= 1e-3 * zz.sqrt() {
                return PixelBounds::ENDLESS;
            }
            let x = seen.x / seen.z;
            let y = seen.y / seen.z;
            let half = |v: f32, [vv, vz, zz]: [f32; 3]| (vv - 2.0 * v * vz + v * v * zz).max(0.0).sqrt() / nearest;
            (x, y, half(x, [xx, xz, zz]), half(y, [yy, yz, zz]), self.focal)
        };
        let cx = self.center[0] + x * scale;
        let cy = self.center[1] + y * scale;
        let hx = half_x * scale + MARGIN;
        let hy = half_y * scale + MARGIN;
        PixelBounds { left: cx - hx, right: cx + hx, top: cy - hy, bottom: cy + hy }
    }

    /// The footprint of a volume whose ellipse has this extent along the slabs, widened where it would fall between pixels.
    pub(crate) fn shape(&self, frame: &Frame, placed: &Placed<'_>) -> Shape {
        let pixel = self.pixel_in_slab(frame, placed);
        let inverse = pixel.inverse();
        let [aa, ab, bb] = placed.extent;
        let kernel = DMat2::from_cols(DVec2::new(aa, ab), DVec2::new(ab, bb));
        let in_pixels = inverse * kernel * inverse.transpose();
        let half = 0.5 * (in_pixels.x_axis.x - in_pixels.y_axis.y);
        let slant = in_pixels.x_axis.y;
        let smallest = 0.5 * (in_pixels.x_axis.x + in_pixels.y_axis.y) - libm::sqrt(half * half + slant * slant);
        let least = LEAST_SIGMA_PX * placed.cutoff;
        let wider = pixel * pixel.transpose() * (least * least - smallest).max(0.0);
        Shape::new(self, [aa + wider.x_axis.x, ab + wider.x_axis.y, bb + wider.y_axis.y])
    }

    /// The longer side of a pixel in the slabs' plane, world units, at the farthest corner of a volume.
    pub(crate) fn widest_pixel(&self, frame: &Frame, placed: &Placed<'_>) -> f64 {
        let pixel = self.pixel_in_slab(frame, placed);
        pixel.x_axis.length().max(pixel.y_axis.length())
    }

    /// What a pixel is in the slabs' plane, at the farthest corner of a volume: columns for a step right and one down.
    fn pixel_in_slab(&self, frame: &Frame, placed: &Placed<'_>) -> DMat2 {
        let depth = |p: DVec3| self.camera.view_from_world(p).z;
        let middle = frame.world(DVec3::new(0.0, 0.0, -frame.slabs.origin));
        let view = self.camera.view_from_world(middle);
        let far = placed.volume.corners().map(depth).into_iter().fold(view.z, f64::max);
        let [x, y] = match self.is_parallel || view.z <= 0.0 {
            true => self.center.map(f64::from),
            false => {
                let p = self.pixel(Vec3::new(0.0, 0.0, -frame.slabs.origin as f32));
                [0, 1].map(|a| f64::from(p[a]).clamp(0.0, 2.0 * f64::from(self.center[a])))
            }
        };
        let place = |x: f64, y: f64| {
            let ray = frame.ray(&self.camera, x, y);
            let z = (-frame.slabs.origin - ray.from.z) / ray.along.z;
            (DVec2::new(ray.from.x + ray.along.x * z, ray.from.y + ray.along.y * z), z)
        };
        let (here, z) = place(x, y);
        let scale = if self.is_parallel { 1.0 } else { far / z.abs().max(1e-9 * far) };
        DMat2::from_cols(place(x + 1.0, y).0 - here, place(x, y + 1.0).0 - here) * scale
    }
}

impl Shape {
    fn new(sight: &Sight, extent: [f64; 3]) -> Self {
        let [aa, ab, bb] = extent;
        let norm = 1.0 / (aa * bb - ab * ab);
        let [a, b, _] = sight.steps;
        let product = |i: usize, k: usize| {
            let ai = f64::from(a[i]);
            let bi = f64::from(b[i]);
            let ak = f64::from(a[k]);
            let bk = f64::from(b[k]);
            (ai * ak * aa + (ai * bk + bi * ak) * ab + bi * bk * bb) as f32
        };
        Self {
            conic: [bb, 0.0 - ab, aa].map(|c| (c * norm) as f32),
            extent,
            bounds: [0, 1].map(|i| [product(i, i), product(i, 2), product(2, 2)]),
        }
    }

    /// Extent of the ellipse in the slab, world units²: aa, ab, bb.
    pub(crate) fn extent(&self) -> [f64; 3] {
        self.extent
    }
}
