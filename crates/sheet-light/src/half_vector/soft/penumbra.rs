//! Where the rays of an extended light's points lie in one another's images (Zhang and Crawfis, section 5).
//!
//! The paper puts a virtual light parallel to the slabs, so that what a slab lets through is convolved with the light's own
//! shape, wider by how far light has come since. Here each point of the light keeps its place; images alone are parallel to the
//! slabs. A place at depth z is called by where the ray from the light's centre c through it meets the reference depth:
//!
//! A = c + (a − c)·h₀/h, h = z − c_z, h₀ that of the reference.
//!
//! A ray from the point q that meets the reference at a₀ is at depth z at q + (a₀ − q)·h′/h₀′, h′ = z − q_z, so
//!
//! A = α·a₀ + β, α = (h′/h₀′)·(h₀/h), β = c + (q − c − q·h′/h₀′)·h₀/h.
//!
//! Between an occluder and a receiver such a ray moves by (q − c)·h₀·(1/h_occluder − 1/h_receiver) for q beside c: similar
//! triangles, an occluder at d1 from the light casting a penumbra 2R·d2/d1 wide at d2 behind it, whatever the slabs between.

use crate::Volume;
use crate::half_vector::sampled_light::SampledLight;
use crate::half_vector::slicing::bodies::Bodies;
use crate::half_vector::slicing::frame::Frame;
use crate::shared::depths::DepthRange;
use crate::shared::pixel::Pixel;
use splat_core::glam::{DVec2, DVec3};
use splat_core::raster::lanes::MAX_LANES;
use splat_core::{Camera, Light};
use std::ops::Range;

/// Shift within the volumes, pixels, below which no ray is told from the centre's.
const LEAST_SHIFT_PX: f64 = 1.0 / 64.0;

/// Pixels around what is looked for, so that a look-up finds neighbours.
const MARGIN: f64 = 2.0;

/// How one image lies in another: pixel x of this one is pixel x + `scale`·x + `start` of that one, along both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shift {
    pub(crate) scale: f64,
    pub(crate) start: [f64; 2],
}

impl Shift {
    /// How that image lies in this one.
    pub(crate) fn inverse(&self) -> Self {
        let scale = 1.0 / (1.0 + self.scale);
        Self { scale: scale - 1.0, start: self.start.map(|start| -start * scale) }
    }
}

/// The rays of an extended light through some volumes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Penumbra {
    /// Slab coordinates of the centre.
    center: DVec3,
    /// Slab coordinates of the points.
    points: Vec<DVec3>,
    /// Share of each in what the middle of the volumes receives where nothing attenuates.
    pub(crate) shares: Vec<f32>,
    /// What all give there over what the centre gives.
    pub(crate) gain: f64,
    /// Corners of the bodies, and depths that they lie between.
    corners: Vec<[DVec3; 8]>,
    ends: [f64; 2],
    /// Whether there are splats, which reach beyond the slab and the corners that their centres lie in.
    has_splats: bool,
    /// Depth of the plane that rays are called by.
    reference: f64,
    /// Where pixel 0 has its middle on that plane.
    low: DVec2,
    pixel: f64,
    /// Columns, a multiple of [`MAX_LANES`], and rows.
    pub(crate) size: [usize; 2],
}

impl Penumbra {
    /// That of the points of a light before the bodies, in pixels as wide as those of the light's image and at most `most`
    /// along a side; `None` where no point's rays differ from the centre's.
    pub(crate) fn new(
        frame: &Frame,
        bodies: &Bodies<'_>,
        sampled: SampledLight<'_>,
        image: &Camera,
        most: u32,
    ) -> Option<Self> {
        let light = sampled.light;
        if !light.shape.is_extended() {
            return None;
        }
        let center = frame.point(light.shape.place()?);
        let lights = sampled.points([1.0; 3]);
        let points: Vec<DVec3> = lights.iter().filter_map(|p| p.shape.place()).map(|p| frame.point(p)).collect();
        let (shares, gain) = received(light, &lights, bodies.middle());
        let boxes = bodies.volumes.iter().map(Volume::corners).chain(bodies.splats.map(|s| s.bounds.corners()));
        let corners: Vec<[DVec3; 8]> = boxes.map(|corners| corners.map(|p| frame.point(p))).collect();
        let has_splats = bodies.splats.is_some();
        let depths = || corners.iter().flatten().map(|p| p.z);
        let ends = [depths().fold(f64::INFINITY, f64::min), depths().fold(f64::NEG_INFINITY, f64::max)];
        let [near, far] = ends.map(|z| z - center.z);
        // Rays move as much before the reference as behind it.
        let reference = center.z + 2.0 / (near.recip() + far.recip());
        let low = DVec2::ZERO;
        let pixel = 1.0;
        let size = [1, 1];
        let mut penumbra =
            Self { center, points, shares, gain, corners, ends, has_splats, reference, low, pixel, size };
        let (low, high, shift) = penumbra.reach();
        let extent = high - low;
        let way = frame.point(bodies.middle()) - center;
        let depth = image.view_from_world(bodies.middle()).z;
        let pixel = depth * (reference - center.z) / way.z / image.focal_px();
        penumbra.pixel = pixel.max(extent.max_element() / (f64::from(most) - 2.0 * (MARGIN + 1.0) - MAX_LANES as f64));
        penumbra.low = low - DVec2::splat(MARGIN * penumbra.pixel);
        let [width, height] = [extent.x, extent.y].map(|e| (e / penumbra.pixel + 2.0 * MARGIN).ceil() as usize + 1);
        penumbra.size = [width.next_multiple_of(MAX_LANES), height];
        (shift > LEAST_SHIFT_PX * penumbra.pixel).then_some(penumbra)
    }

    /// Bounds at the reference depth of all rays of all points to the volumes, and the farthest that one moves in them against the
    /// centre's.
    fn reach(&self) -> (DVec2, DVec2, f64) {
        let places = || self.corners.iter().flatten().map(|p| self.called(*p));
        let seen = [places().fold(DVec2::INFINITY, DVec2::min), places().fold(DVec2::NEG_INFINITY, DVec2::max)];
        let mut low = seen[0];
        let mut high = seen[1];
        let mut shift = 0.0f64;
        for q in &self.points {
            let ways = self.ends.map(|z| self.map(*q, z));
            for place in seen {
                for (scale, start) in ways {
                    let through = (place - start) / scale;
                    (low, high) = (low.min(through), high.max(through));
                }
                let [one, other] = ways.map(|(scale, start)| place * scale + start);
                shift = shift.max((one - other).abs().max_element());
            }
        }
        (low, high, shift)
    }

    /// Where the centre's ray through slab coordinates meets the reference depth.
    fn called(&self, p: DVec3) -> DVec2 {
        let c = self.center;
        c.truncate() + (p - c).truncate() * ((self.reference - c.z) / (p.z - c.z))
    }

    /// α and β for a point of the light at a depth.
    fn map(&self, q: DVec3, depth: f64) -> (f64, DVec2) {
        let of_point = (depth - q.z) / (self.reference - q.z);
        let centre = (self.reference - self.center.z) / (depth - self.center.z);
        let c = self.center.truncate();
        (of_point * centre, c + (q.truncate() - c - q.truncate() * of_point) * centre)
    }

    /// Whether a depth is behind all points, and the centre.
    pub(crate) fn is_behind(&self, depth: f64) -> bool {
        self.points.iter().all(|q| depth > q.z) && depth > self.center.z
    }

    /// Points of the light.
    pub(crate) fn count(&self) -> usize {
        self.points.len()
    }

    /// How the image of a point's own rays lies in that of places at a depth.
    pub(crate) fn shift(&self, point: usize, depth: f64) -> Shift {
        let (scale, start) = self.map(self.points[point], depth);
        let start = (self.low * (scale - 1.0) + start) / self.pixel;
        Shift { scale: scale - 1.0, start: start.to_array() }
    }

    /// Pixel, as a number of pixels from the middle of the first, of slab coordinates behind the light.
    #[inline]
    pub(crate) fn pixel(&self, p: DVec3) -> DVec2 {
        (self.called(p) - self.low) / self.pixel
    }

    /// Slab coordinates of a pixel's middle at the reference depth.
    pub(crate) fn place(&self, pixel: Pixel) -> DVec3 {
        (self.low + DVec2::new(pixel.x as f64, pixel.y as f64) * self.pixel).extend(self.reference)
    }

    /// What the centre's ray moves along the slabs per depth across them, at pixel 0 and from pixel to pixel.
    pub(crate) fn slopes(&self) -> (DVec2, f64) {
        let depth = self.reference - self.center.z;
        ((self.low - self.center.truncate()) / depth, self.pixel / depth)
    }

    /// The middle of what the volumes have between two depths.
    pub(crate) fn middle(&self, depths: DepthRange) -> f64 {
        0.5 * (f64::from(depths.near).max(self.ends[0]) + f64::from(depths.far).min(self.ends[1]))
    }

    /// Columns, by whole vectors, and rows of the volumes between two depths, with a margin, or all of them where there are splats; `None` for
    /// none.
    pub(crate) fn bounds(&self, depths: DepthRange) -> Option<[Range<usize>; 2]> {
        let from = f64::from(depths.near);
        let to = f64::from(depths.far);
        if self.has_splats {
            return Some(self.size.map(|n| 0..n));
        }
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for corners in &self.corners {
            for (c, a) in (0..8).flat_map(|c| (0..3).map(move |a| (c, a))).filter(|(c, a)| c >> a & 1 == 0) {
                let [one, other] = [corners[c], corners[c | 1 << a]];
                let near = one.z.min(other.z).max(from);
                let far = one.z.max(other.z).min(to);
                if near > far {
                    continue;
                }
                let along = other.z - one.z;
                // An edge that lies along the slabs is in them with both its ends.
                let share = |z: f64, end: f64| {
                    if along == 0.0 { end } else { ((z - one.z) / along).clamp(0.0, 1.0) }
                };
                for share in [share(near, 0.0), share(far, 1.0)] {
                    let pixel = self.pixel(one + (other - one) * share);
                    (low, high) = (low.min(pixel), high.max(pixel));
                }
            }
        }
        let end = |v: f64, n: usize| (v.max(0.0) as usize).min(n);
        let [[x0, y0], [x1, y1]] =
            [(low - DVec2::splat(MARGIN)).floor().to_array(), (high + DVec2::splat(MARGIN + 1.0)).ceil().to_array()];
        let columns = end(x0, self.size[0]) / MAX_LANES * MAX_LANES
            ..end(x1, self.size[0]).next_multiple_of(MAX_LANES).min(self.size[0]);
        let rows = end(y0, self.size[1])..end(y1, self.size[1]);
        (low.x <= high.x && !columns.is_empty() && !rows.is_empty()).then_some([columns, rows])
    }
}

/// Share of each point of a light in what a place receives of it, and all of that over what the centre gives alone.
pub(crate) fn received(light: &Light, points: &[Light], place: DVec3) -> (Vec<f32>, f64) {
    let green = |light: &Light| f64::from(light.irradiance(place, 0.0).irradiance[0]);
    let each: Vec<f64> = points.iter().map(green).collect();
    let centre: f64 = green(&Light { intensity: [1.0; 3], ..*light });
    let whole: f64 = each.iter().sum();
    if whole > 0.0 && centre > 0.0 {
        (each.iter().map(|e| (e / whole) as f32).collect(), whole / centre)
    } else {
        (vec![1.0 / points.len() as f32; points.len()], 1.0)
    }
}
