//! Translucent polygons of a sweep: each place that a pixel shows of one is lit when the sweep has come to its slab, and is seen there at its own
//! depth, between what the slab has before it and behind it.
//!
//! It receives what an opaque polygon would there ([`super::polygon_light`]); other translucent polygons in the light's way are known by its images
//! ([`super::light_depth`]), wherever they lie.

use super::eye_buffer::Fragments;
use super::frame::Frame;
use super::illuminate::Illumination;
use super::light_depth::LightDepths;
use super::polygon_light::{PolygonLight, PolygonSlabs, add_diffuse};
use super::polygons::EyePanes;
use super::scatter::SurfaceLight;
use super::splat_light::SplatLight;
use super::splats::Lamps;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::shade::{ChannelLayout, LitBy, MAX_CHANNELS};
use splat_core::{Accumulator, Camera};
use std::ops::Range;

/// Places of one task.
const CHUNK: usize = 256;

/// The translucent polygons of a sweep, and what those of the present slab show.
pub(crate) struct PaneSheets<'a> {
    of: &'a EyePanes<'a>,
    camera: &'a Camera,
    slabs: PolygonSlabs,
    light: PolygonLight<'a>,
    slab: u32,
    /// Channels of each place of the present slab, one place after the other; or nothing.
    values: Vec<f32>,
    channels: usize,
}

/// Places of the present slab that a pixel shows, nearest to the eye first.
#[derive(Clone, Copy, Default)]
pub(crate) struct OfPixel<'a> {
    ranks: &'a [u32],
    /// Of the first among those of the slab.
    first: usize,
}

impl OfPixel<'_> {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.ranks.len()
    }
}

impl<'a> PaneSheets<'a> {
    pub(crate) fn new(
        of: &'a EyePanes<'a>,
        frame: &Frame,
        camera: &'a Camera,
        (depths, inside): (Option<&'a LightDepths>, [f32; 2]),
    ) -> Self {
        let slabs = PolygonSlabs::new(&of.seen, frame, camera, inside);
        let light = PolygonLight::new(&of.seen, camera, depths);
        Self { of, camera, slabs, light, slab: 0, values: Vec::new(), channels: 0 }
    }

    /// Takes up those of a slab, or of what is behind the last, behind the volumes and the splats before them.
    pub(crate) fn enter(
        &mut self,
        slab: u32,
        frame: &Frame,
        carried: Option<(&Illumination<'_>, Option<&SplatLight<'_>>)>,
        (lamps, origin, diffuse): (&Lamps<'_>, DVec3, Option<&SurfaceLight>),
        layout: &ChannelLayout,
    ) {
        if let Some(carried) = carried {
            self.light.enter(&self.slabs, slab, frame, carried);
        }
        self.draw(slab);
        let ranks = self.slabs.by_slab.of(slab);
        let channels = layout.count();
        self.channels = channels;
        self.values.resize(ranks.len() * channels, 0.0);
        let lights: Vec<LitBy<'_>> = lamps.carried.iter().chain(lamps.mapped).copied().collect();
        let chunks = self.values.par_chunks_mut(CHUNK * channels).zip(ranks.par_chunks(CHUNK));
        chunks.for_each(|(values, ranks)| {
            for (values, rank) in values.chunks_exact_mut(channels).zip(ranks) {
                let seen = self.of.seen.seen(*rank as usize, self.camera);
                let (point, radiance) = self.light.radiance(&seen, *rank as usize, (lamps, &lights, origin));
                radiance.write(point.normal, layout, values);
                add_diffuse(diffuse, &lamps.carried, &seen, layout, values);
            }
        });
    }

    /// Takes up those of a slab for the eye, without what they show.
    pub(crate) fn draw(&mut self, slab: u32) {
        (self.slab, self.channels) = (slab, 0);
        self.values.clear();
    }

    /// Columns of a row of pixels between which any of the slab is seen.
    pub(crate) fn span(&self, y: usize) -> Option<Range<usize>> {
        let ranks = self.slabs.by_slab.of(self.slab);
        let width = self.camera.size[0] as usize;
        let begins = |row: usize| ranks.partition_point(|rank| (self.pixel(*rank) as usize) < row * width);
        let own = &ranks[begins(y)..begins(y + 1)];
        let column = |rank: &u32| self.pixel(*rank) as usize % width;
        own.first().zip(own.last()).map(|(first, last)| column(first)..column(last) + 1)
    }

    fn pixel(&self, rank: u32) -> u32 {
        self.of.seen.pixel(rank as usize)
    }

    /// Those of the slab that a pixel shows.
    pub(crate) fn of_pixel(&self, pixel: usize) -> OfPixel<'_> {
        let ranks = self.slabs.by_slab.of(self.slab);
        let all = self.of.of_pixel(pixel);
        if all.is_empty() {
            return OfPixel::default();
        }
        let first = ranks.partition_point(|rank| *rank < all.start);
        let count = ranks[first..].partition_point(|rank| *rank < all.end);
        OfPixel { ranks: &ranks[first..first + count], first }
    }

    /// Depth across the slabs, and view depth, of the `n`-th of a pixel.
    pub(crate) fn depths(&self, of: &OfPixel<'_>, n: usize) -> [f32; 2] {
        let rank = of.ranks[n] as usize;
        [self.slabs.places[rank].z, self.of.seen.depth(rank)]
    }

    /// Writes what the `n`-th of a pixel has into a lane of fragments.
    pub(crate) fn write(&self, of: &OfPixel<'_>, n: usize, lane: usize, to: &mut Fragments) {
        let rank = of.ranks[n] as usize;
        let tau = self.of.seen.seen(rank, self.camera).crossing();
        (0..3).for_each(|p| to.optical_depth[p][lane] = tau[p]);
        let values = &self.values[(of.first + n) * self.channels..][..self.channels];
        values.iter().enumerate().for_each(|(c, value)| to.values[c][lane] = *value);
        to.object[lane] = self.of.seen.polygons(rank).object;
    }

    /// Bytes of the values of a slab.
    pub(crate) fn bytes(&self) -> u64 {
        4 * self.values.capacity() as u64
    }
}

/// What translucent polygons show where there is nothing else (Table 1: the images of the light alone), of all lights so far.
pub(crate) struct PanesInTheOpen<'a> {
    of: &'a EyePanes<'a>,
    layout: ChannelLayout,
    /// Channels of each place.
    values: Vec<f32>,
}

impl<'a> PanesInTheOpen<'a> {
    pub(crate) fn new(of: &'a EyePanes<'a>, layout: &ChannelLayout) -> Self {
        Self { of, layout: *layout, values: vec![0.0; of.seen.count() * layout.count()] }
    }

    /// Bytes of the values.
    pub(crate) fn bytes(&self) -> u64 {
        4 * self.values.len() as u64
    }

    /// Channels of each place.
    pub(crate) fn into_values(self) -> Vec<f32> {
        self.values
    }

    /// Adds what they show of some lights; normals and shadows are those of the first.
    pub(crate) fn shade(&mut self, camera: &Camera, depths: Option<&LightDepths>, lamps: &Lamps<'_>, origin: DVec3) {
        let light = PolygonLight::new(&self.of.seen, camera, depths);
        let channels = self.layout.count();
        let lights: Vec<LitBy<'_>> = lamps.carried.iter().chain(lamps.mapped).copied().collect();
        let seen = &self.of.seen;
        let layout = &self.layout;
        self.values.par_chunks_mut(channels).enumerate().for_each(|(rank, values)| {
            let mut own = [0.0; MAX_CHANNELS];
            let (point, radiance) = light.radiance(&seen.seen(rank, camera), rank, (lamps, &lights, origin));
            radiance.write(point.normal, layout, &mut own);
            (0..layout.colors()).for_each(|c| values[c] += own[c]);
            if !lamps.light_alone {
                values[layout.colors()..].copy_from_slice(&own[layout.colors()..channels]);
            }
        });
    }

    /// Composites them, nearest first.
    pub(crate) fn store(&self, camera: &Camera, into: &mut Accumulator) {
        let planes = into.optical_depth.len();
        let channels = self.layout.count();
        for rank in 0..self.of.seen.count() {
            let k = self.of.seen.pixel(rank) as usize;
            let seen = self.of.seen.seen(rank, camera);
            let tau = seen.crossing();
            let before = [0, 1, 2].map(|p| into.optical_depth[p.min(planes - 1)][k]);
            for (c, value) in self.values[rank * channels..][..channels].iter().enumerate() {
                let p = ChannelLayout::plane_of(c, channels, planes);
                into.channels[c][k] += libm::expf(-before[p]) * -libm::expm1f(-tau[p]) * value;
            }
            (0..planes).for_each(|p| into.optical_depth[p][k] += tau[p]);
            let green = planes / 2;
            if let Some(profile) = into.depth.get_mut(k).filter(|_| tau[green] > 0.0) {
                profile.add(&surface(self.of.seen.depth(rank), [before[green], before[green] + tau[green]]));
            }
            if let Some(object) = into.object.get_mut(k).filter(|object| **object == u32::MAX && tau[green] > 0.0) {
                *object = seen.of.object;
            }
        }
    }
}

/// A surface on a ray: no thickness, optical depth before it and behind it.
fn surface(depth: f32, [before, after]: [f32; 2]) -> splat_core::DepthFragment {
    splat_core::DepthFragment { depth, thickness: 0.0, narrow: 1.0, before, after }
}
