//! A band of rows of an image: where its rays are in the slabs, and where in the volumes.
//!
//! Rays cross slabs in one sense, so depth across the slabs tells a place on a ray: (a, b) = place + slope·s. A ray that enters a
//! volume at s₀ and leaves it at s₁ has min(s₁, far face) − max(s₀, near face) of it in a slab, times its own length per depth.
//! Such lengths add up to that of the whole, whatever the slabs.

use super::frame::{Frame, Ray};
use crate::Volume;
use crate::shared::lattice::rays::{LatticeRays, ViewRay};
use crate::shared::pixel::Pixel;
use crate::shared::reason::LEAST_COSINE;
use splat_core::Camera;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::MAX_LANES;
use std::ops::Range;

/// Rows of a band, without its rim.
pub(crate) const ROWS: usize = 16;

/// Rays whose cosine to the slabs' normal is less than this share of what is served meet no volume.
const FLAT: f64 = 0.5;

/// What a ray that meets a volume moves along the slabs at most, per unit of depth.
pub(crate) const STEEPEST: f64 = 1.0 / (FLAT * LEAST_COSINE);

/// The rays of a band; planes of `stored` rows of `stride` numbers.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    /// Rows of the image that are its own.
    pub(crate) rows: Range<usize>,
    /// First row that it has, one before its own where there is a rim.
    pub(crate) top: usize,
    /// Rows that it has.
    pub(crate) stored: usize,
    pub(crate) width: usize,
    pub(crate) stride: usize,
    /// a and b at depth 0.
    pub(crate) place: [Vec<f32>; 2],
    /// The same per unit of depth.
    pub(crate) slope: [Vec<f32>; 2],
    /// Length per unit of depth.
    pub(crate) stretch: Vec<f32>,
    /// By volume: depths at which rays enter and leave, beyond each other for those that miss.
    pub(crate) crossings: Vec<[Vec<f32>; 2]>,
    /// By volume and row: columns that may meet it, and depths between which they do.
    pub(crate) hits: Vec<Vec<Hit>>,
}

/// What a row has of a volume.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hit {
    pub(crate) columns: Range<usize>,
    pub(crate) near: f32,
    pub(crate) far: f32,
}

impl Band {
    /// Band `b` of an image with `rim` rows more on both sides, as far as the image goes.
    pub(crate) fn new(b: usize, rim: usize, frame: &Frame, camera: &Camera, volumes: &[Volume<'_>]) -> Self {
        let [width, height] = camera.size.map(|s| s as usize);
        let rows = b * ROWS..((b + 1) * ROWS).min(height);
        let top = rows.start.saturating_sub(rim);
        let stored = (rows.end + rim).min(height) - top;
        // Vectors may run over the end of a row.
        let stride = (width + 2).next_multiple_of(MAX_LANES) + MAX_LANES;
        let plane = |fill: f32| vec![fill; stored * stride];
        let mut band = Self {
            rows,
            top,
            stored,
            width,
            stride,
            place: [plane(0.0), plane(0.0)],
            slope: [plane(0.0), plane(0.0)],
            stretch: plane(0.0),
            crossings: vec![[plane(f32::INFINITY), plane(f32::NEG_INFINITY)]; volumes.len()],
            hits: Vec::new(),
        };
        let lattices: Vec<LatticeRays> = volumes.iter().map(|v| LatticeRays::new(v, camera, 0.0)).collect();
        for y in 0..stored {
            for x in 0..width {
                band.set(y * stride + x, frame, camera, &lattices, Pixel { x, y: top + y });
            }
        }
        band.find_hits();
        band
    }

    fn set(&mut self, k: usize, frame: &Frame, camera: &Camera, lattices: &[LatticeRays], pixel: Pixel) {
        let x = pixel.x as f64 + 0.5;
        let y = pixel.y as f64 + 0.5;
        let ray = frame.ray(camera, x, y);
        let Some(slope) = slope_of(&ray) else { return };
        for a in 0..2 {
            self.slope[a][k] = slope[a] as f32;
            self.place[a][k] = (ray.from[a] - slope[a] * ray.from.z) as f32;
        }
        self.stretch[k] = slope.length() as f32;
        for (v, lattice) in lattices.iter().enumerate() {
            let ends = lattice.crossing(ViewRay::through(camera, x, y));
            if ends[0] < ends[1] {
                let [one, other] = ends.map(|z| ray.from.z + ray.along.z * z);
                self.crossings[v][0][k] = one.min(other) as f32;
                self.crossings[v][1][k] = one.max(other) as f32;
            }
        }
    }

    /// Ends each ray at an opaque depth of the image, +∞ for none.
    pub(crate) fn end_at(&mut self, opaque: &[f32], frame: &Frame, camera: &Camera) {
        for y in 0..self.stored {
            for x in 0..self.width {
                let depth = f64::from(opaque[(self.top + y) * self.width + x]);
                let ray = frame.ray(camera, x as f64 + 0.5, (self.top + y) as f64 + 0.5);
                let end = ray.from.z + ray.along.z * depth;
                for [near, far] in &mut self.crossings {
                    let k = y * self.stride + x;
                    if ray.along.z > 0.0 {
                        far[k] = far[k].min(end as f32);
                    } else {
                        near[k] = near[k].max(end as f32);
                    }
                }
            }
        }
        self.find_hits();
    }

    /// Finds what each row has of each volume.
    pub(crate) fn find_hits(&mut self) {
        let stride = self.stride;
        let width = self.width;
        let row = |[near, far]: &[Vec<f32>; 2], y: usize| {
            let none = Hit { columns: width..0, near: f32::INFINITY, far: f32::NEG_INFINITY };
            let join = |hit: Hit, x: usize| Hit {
                columns: hit.columns.start.min(x)..hit.columns.end.max(x + 1),
                near: hit.near.min(near[y * stride + x]),
                far: hit.far.max(far[y * stride + x]),
            };
            (0..width).filter(|x| near[y * stride + x] < far[y * stride + x]).fold(none, join)
        };
        let hits_of = |crossing: &[Vec<f32>; 2]| (0..self.stored).map(|y| row(crossing, y)).collect();
        self.hits = self.crossings.iter().map(hits_of).collect();
    }

    /// Bytes of the planes.
    pub(crate) fn bytes(&self) -> u64 {
        4 * (self.stored * self.stride * (5 + 2 * self.crossings.len())) as u64
    }
}

/// What a ray moves per unit of depth; `None` for one that runs along the slabs.
pub(crate) fn slope_of(ray: &Ray) -> Option<DVec3> {
    let cosine = ray.along.z / ray.along.length();
    (cosine.abs() >= FLAT * LEAST_COSINE).then(|| ray.along / ray.along.z)
}
