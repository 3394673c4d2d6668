//! Light among splats: the optical depth of those before the present slab in the light's own image, and what arrives at each splat.
//!
//! Within a slab, light has come through as much as it would if all that a pixel has there lay spread over a slab's width about its mean
//! depth. So it makes no difference whether a layer of splats lies in the midst of a slab or on a face, and a slab of many layers
//! is a ramp.
//!
//! Beside the points of a light with an extent these images are those of its centre: what its points get is known by [`crate::half_vector::soft::buffer`], to
//! which the splats of each slab are added.

use super::squares::{Slab, Squares};
use crate::half_vector::input::HalfSplats;
use crate::half_vector::slicing::by_slab::BySlab;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::sight::{PixelsAround, Sight};
use crate::shared::lines::Lines;
use crate::shared::pixel::{Pixel, PixelForm};
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::Projected;
use splat_core::raster::bins::TILE;
use splat_core::shade::ChannelLayout;
use splat_core::{Camera, SplatKind};
use std::ops::Range;

/// A pixel, and its share in a mean.
struct WeightedPixel {
    pixel: Pixel,
    weight: f32,
}

/// The splats of one light.
pub(crate) struct SplatLight<'a> {
    splats: &'a HalfSplats<'a>,
    sight: Sight,
    projected: Projected,
    /// Those that cast shadows; the present slab.
    squares: Squares,
    /// Slabs before, by square.
    sums: Vec<Lines>,
    columns: usize,
    planes: usize,
    slab_width: f32,
    /// For each splat the depth across the slabs, in slabs, at which it asks for light; and the ids by that slab.
    asks: Vec<f32>,
    by_slab: BySlab,
    /// Share of the light that is let through, by id; for a light with an extent, what its points change, until the sweep comes to the splat.
    through: Vec<[f32; 3]>,
}

impl<'a> SplatLight<'a> {
    /// `places` are slab coordinates of the centres; `order` has the ids slab by slab. A look-up has a part of what lies so many pixels around a place.
    pub(crate) fn new(
        splats: &'a HalfSplats<'a>,
        frame: &Frame,
        sight: &Sight,
        around_px: f64,
        places: &[Vec3],
        order: &[u32],
        planes: usize,
    ) -> Self {
        let projected = splats.seen_by(&sight.camera);
        let casts = |id: &u32| splats.objects[splats.cloud.object[*id as usize] as usize].casts_shadow;
        let casters: Vec<u32> = order.iter().copied().filter(casts).collect();
        let form = PixelForm { planes, channels: 1, has_depths: false, has_objects: false };
        let squares = Squares::new(&projected, &casters, &[], form);
        let last = frame.slabs.count - 1;
        let asks_at = |i: usize| asks_at(splats, frame, &sight.camera, around_px, i, places[i]);
        let asks: Vec<f32> = (0..places.len()).into_par_iter().map(asks_at).collect();
        let slabs: Vec<u32> = asks.iter().map(|slab| (*slab as u32).min(last)).collect();
        Self {
            splats,
            sight: *sight,
            columns: (sight.camera.size[0] as usize).div_ceil(TILE),
            sums: vec![Lines::default(); squares.lines().count()],
            squares,
            projected,
            planes,
            slab_width: frame.slabs.width as f32,
            asks,
            by_slab: BySlab::new(&slabs, frame.slabs.count),
            through: vec![[1.0; 3]; places.len()],
        }
    }

    /// Share of the light that is let through to each, by id; known once the sweep has come to its slab.
    pub(crate) fn through(&self) -> &[[f32; 3]] {
        &self.through
    }

    /// Those that ask for light in a slab.
    pub(crate) fn asking(&self, slab: u32) -> &[u32] {
        self.by_slab.in_slab(slab)
    }

    /// Sets what some of them get.
    pub(crate) fn set(&mut self, ids: &[u32], through: &[[f32; 3]]) {
        ids.iter().zip(through).for_each(|(id, share)| self.through[*id as usize] = *share);
    }

    /// Optical depth at a splat beside that of the volumes from the light's centre, of a light with an extent, by channel: what its points change,
    /// and what lies before the splat in its own slab.
    pub(crate) fn more(&self, id: u32, place: Vec3, slab: u32) -> [f32; 3] {
        let around = self.through[id as usize];
        let in_slab = self.optical_depth(place, self.depth_of(id, slab));
        [0, 1, 2].map(|p| around[p] + in_slab[p][1])
    }

    /// Attenuates what some of them get by what volumes let through.
    pub(crate) fn attenuate(&mut self, ids: &[u32], volumes: &[[f32; 3]]) {
        for (id, share) in ids.iter().zip(volumes) {
            let through = &mut self.through[*id as usize];
            (0..3).for_each(|c| through[c] *= share[c]);
        }
    }

    /// Bytes of lists and sums.
    pub(crate) fn bytes(&self) -> u64 {
        let sums: u64 = self.sums.iter().map(Lines::bytes).sum();
        self.squares.bytes() + sums + self.projected.bytes() + 20 * self.asks.len() as u64
    }

    /// Begins a slab, of these splats. Fragments.
    pub(crate) fn enter(&mut self, slab: u32, ids: &[u32], slabs: &[u32], places: &[Vec3]) -> u64 {
        let projected = &self.projected;
        let materials = self.splats.materials;
        // Depths in the slab, for the mean depth of a pixel.
        let values: Vec<f32> = ids.iter().map(|id| places[*id as usize].z / self.slab_width - slab as f32).collect();
        self.squares.fill(Slab { projected, materials, slabs, slab, ids, values: &values })
    }

    /// Finds what arrives of a light without an extent at those that ask in the present slab.
    pub(crate) fn ask(&mut self, slab: u32, places: &[Vec3]) {
        let arrives = |id: &u32| self.transmittance(self.sight.pixel(places[*id as usize]), self.depth_of(*id, slab));
        let found: Vec<[f32; 3]> = self.asking(slab).par_iter().map(arrives).collect();
        let ids = self.asking(slab).to_vec();
        self.set(&ids, &found);
    }

    /// Up to which depth in a slab, in slabs, a splat counts what lies there: what is a surface lets through nothing or all of a slab's others.
    pub(crate) fn depth_of(&self, id: u32, slab: u32) -> f32 {
        let is_medium = self.splats.cloud.kind[id as usize] == SplatKind::Medium;
        if is_medium { self.asks[id as usize] - slab as f32 } else { f32::NEG_INFINITY }
    }

    /// Ends a slab: its splats lie before all that comes.
    pub(crate) fn leave(&mut self) {
        for (sum, line) in self.sums.iter_mut().zip(self.squares.lines()) {
            if let Some(line) = line {
                sum.join(line);
            }
        }
    }

    /// Optical depth by plane of the present slab at a pixel.
    pub(crate) fn of_slab(&self, pixel: Pixel) -> [f32; 3] {
        let found = self.squares.find(pixel, 1);
        [0, 1, 2].map(|p| found.map_or(0.0, |found| found.lines.optical_depth(p.min(self.planes - 1), found.pixel)))
    }

    /// Columns of a row of pixels between which any splat of the present slab lies.
    pub(crate) fn span(&self, y: usize) -> Option<Range<usize>> {
        self.squares.span(y)
    }

    /// Optical depth by plane, at a pixel, of the splats of all slabs before; and of the present one up to a depth, in slabs.
    #[inline]
    fn of_pixel(&self, pixel: Pixel, depth: f32) -> [[f32; 2]; 3] {
        let Pixel { x, y } = pixel;
        let square = y / TILE * self.columns + x / TILE;
        let within = Pixel { x: x % TILE, y: y % TILE };
        let present = self.squares.find(pixel, 1).map(|found| {
            let plane = ChannelLayout::plane_of(0, 1, self.planes);
            let weight = found.lines.optical_depth(plane, found.pixel).max(f32::MIN_POSITIVE);
            let mean = found.lines.optical_depth(self.planes, found.pixel) / weight;
            (found, (depth - mean + 0.5).clamp(0.0, 1.0))
        });
        [0, 1, 2].map(|p| {
            let p = p.min(self.planes - 1);
            let here = present.map_or(0.0, |(found, share)| share * found.lines.optical_depth(p, found.pixel));
            [self.sums[square].optical_depth(p, within), here]
        })
    }

    /// The four pixels about a place, and their weights; those at a border are those inside.
    #[inline]
    fn patch(&self, place: [f32; 2]) -> [WeightedPixel; 4] {
        let PixelsAround { columns: [x0, x1], rows: [y0, y1], u, v } = self.sight.around(place);
        let pixel = |x: usize, y: usize, weight: f32| WeightedPixel { pixel: Pixel { x, y }, weight };
        let left = 1.0 - u;
        let upper = 1.0 - v;
        [pixel(x0, y0, left * upper), pixel(x1, y0, u * upper), pixel(x0, y1, left * v), pixel(x1, y1, u * v)]
    }

    /// Mean optical depth by plane about slab coordinates, of the slabs before, and of the present one up to a depth, in slabs; 0 where the light's
    /// image does not show them.
    #[inline]
    pub(crate) fn optical_depth(&self, place: Vec3, depth: f32) -> [[f32; 2]; 3] {
        let mut sum = [[0.0; 2]; 3];
        if !self.sight.shows(place) {
            return sum;
        }
        for WeightedPixel { pixel, weight } in self.patch(self.sight.pixel(place)) {
            let tau = self.of_pixel(pixel, depth);
            (0..3).for_each(|p| (0..2).for_each(|n| sum[p][n] += weight * tau[p][n]));
        }
        sum
    }

    /// Mean transmittance at slab coordinates, up to a depth in the present slab, in slabs; 1 where the light's image does not show them.
    pub(crate) fn transmittance_at(&self, place: Vec3, depth: f32) -> [f32; 3] {
        if self.sight.shows(place) { self.transmittance(self.sight.pixel(place), depth) } else { [1.0; 3] }
    }

    /// Mean transmittance about a place of the light's image, up to a depth in the present slab, in slabs.
    fn transmittance(&self, place: [f32; 2], depth: f32) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for WeightedPixel { pixel, weight } in self.patch(place) {
            let tau = self.of_pixel(pixel, depth);
            (0..3).for_each(|p| sum[p] += weight * libm::expf(-(tau[p][0] + tau[p][1])));
        }
        sum
    }
}

/// Reach of the resampling filter, pixels.
const FILTER_PX: f64 = 1.5;

/// Least cosine by which pixels on a surface are widened: one that light grazes gets next to none.
const LEAST_COSINE: f64 = 0.3;

/// Where a splat asks for light, in slabs: a medium at its centre; a surface before the centres of all discs that cover a pixel about it, if
/// the surface is flat.
pub(crate) fn asks_at(
    splats: &HalfSplats<'_>,
    frame: &Frame,
    camera: &Camera,
    around_px: f64,
    i: usize,
    place: Vec3,
) -> f32 {
    let lift = if splats.cloud.kind[i] == SplatKind::Medium {
        0.0
    } else {
        let normal = splats.cloud.normal_of(i).as_dvec3();
        let view = camera.view_from_world(splats.cloud.origin + splats.cloud.position[i].as_dvec3());
        let [pixel, to_light] = if camera.is_orthographic() {
            [1.0 / camera.focal_px(), camera.axes[2].dot(normal)]
        } else {
            let [right, up, forward] = camera.axes.map(|axis| axis.dot(normal));
            [view.z / camera.focal_px(), DVec3::new(right, up, forward).dot(view) / view.length()]
        };
        let across = frame.axes[2].dot(normal);
        // A pixel on the surface: what the filter reaches, and what a look-up does.
        let pixel = pixel / to_light.abs().max(LEAST_COSINE);
        let reach = f64::from(splats.cloud.radius[i]).hypot(FILTER_PX * pixel) + around_px * pixel;
        reach * (1.0 - across * across).max(0.0).sqrt()
    };
    ((f64::from(place.z) - lift) / frame.slabs.width).max(0.0) as f32
}
