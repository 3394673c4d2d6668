//! Translucent polygons of a sweep: each place that a pixel shows of one is lit when the sweep has come to its slab, and is seen there at its own
//! depth, between what the slab has before it and behind it.
//!
//! It receives what an opaque polygon would there ([`crate::half_vector::polygons::light`]); other translucent polygons in the light's way are known by its images
//! ([`crate::half_vector::polygons::light_depth`]), wherever they lie.

use super::light::{PolygonLight, PolygonSlabs, add_diffuse};
use super::light_depth::LightDepths;
use super::surfaces::EyePanes;
use crate::half_vector::eye::buffer::Fragments;
use crate::half_vector::lamps::Lamps;
use crate::half_vector::light::illuminate::Illumination;
use crate::half_vector::scatter::surface::SurfaceLight;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::slab_place::SlabPlace;
use crate::shared::depths::DepthRange;
use rayon::prelude::*;
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use splat_core::{Accumulator, Camera};
use std::ops::Range;

/// Places of one task.
const CHUNK: usize = 256;

/// The translucent polygons of a sweep, and what those of the present slab show.
pub(crate) struct PaneSheets<'a> {
    panes: &'a EyePanes<'a>,
    camera: &'a Camera,
    slabs: PolygonSlabs,
    light: PolygonLight<'a>,
    place: SlabPlace,
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

/// Where a translucent polygon lies in a pixel.
#[derive(Clone, Copy)]
pub(crate) struct PaneDepths {
    pub(crate) across_slabs: f32,
    pub(crate) view: f32,
}

impl OfPixel<'_> {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.ranks.len()
    }
}

impl<'a> PaneSheets<'a> {
    pub(crate) fn new(
        panes: &'a EyePanes<'a>,
        frame: &Frame,
        camera: &'a Camera,
        depths: Option<&'a LightDepths>,
        bodies: DepthRange,
    ) -> Self {
        let slabs = PolygonSlabs::new(&panes.seen, frame, camera, bodies);
        let light = PolygonLight::new(&panes.seen, camera, depths);
        Self { panes, camera, slabs, light, place: SlabPlace::Slab(0), values: Vec::new(), channels: 0 }
    }

    /// Takes up those of a slab, or of what is behind the last, behind the volumes and the splats before them.
    pub(crate) fn enter(
        &mut self,
        place: SlabPlace,
        frame: &Frame,
        light: Option<&Illumination<'_>>,
        lamps: &Lamps<'_>,
        diffuse: Option<&SurfaceLight>,
        layout: &ChannelLayout,
    ) {
        if let Some(light) = light {
            self.light.enter(&self.slabs, place, frame, light);
        }
        self.draw(place);
        let ranks = self.slabs.ranks(place);
        let channels = layout.count();
        self.channels = channels;
        self.values.resize(ranks.len() * channels, 0.0);
        let listed = &lamps.listed();
        let chunks = self.values.par_chunks_mut(CHUNK * channels).zip(ranks.par_chunks(CHUNK));
        chunks.for_each(|(values, ranks)| {
            for (values, rank) in values.chunks_exact_mut(channels).zip(ranks) {
                let seen = self.panes.seen.seen(*rank as usize, self.camera);
                let (point, radiance) = self.light.radiance(&seen, *rank as usize, listed);
                radiance.write(point.normal, layout, values);
                add_diffuse(diffuse, &lamps.carried, &seen, layout, values);
            }
        });
    }

    /// Takes up those of a slab for the eye, without what they show.
    pub(crate) fn draw(&mut self, place: SlabPlace) {
        self.place = place;
        self.channels = 0;
        self.values.clear();
    }

    /// Columns of a row of pixels between which any of the slab is seen.
    pub(crate) fn span(&self, y: usize) -> Option<Range<usize>> {
        let ranks = self.slabs.ranks(self.place);
        let width = self.camera.size[0] as usize;
        let begins = |row: usize| ranks.partition_point(|rank| (self.pixel(*rank) as usize) < row * width);
        let ranks_of_row = &ranks[begins(y)..begins(y + 1)];
        let column = |rank: &u32| self.pixel(*rank) as usize % width;
        ranks_of_row.first().zip(ranks_of_row.last()).map(|(first, last)| column(first)..column(last) + 1)
    }

    fn pixel(&self, rank: u32) -> u32 {
        self.panes.seen.pixel(rank as usize)
    }

    /// Those of the slab that a pixel shows.
    pub(crate) fn of_pixel(&self, pixel: usize) -> OfPixel<'_> {
        let ranks = self.slabs.ranks(self.place);
        let range = self.panes.of_pixel(pixel);
        if range.is_empty() {
            return OfPixel::default();
        }
        let first = ranks.partition_point(|rank| *rank < range.start);
        let count = ranks[first..].partition_point(|rank| *rank < range.end);
        OfPixel { ranks: &ranks[first..first + count], first }
    }

    /// Where the `n`-th of a pixel lies.
    pub(crate) fn depths(&self, pixel_panes: &OfPixel<'_>, n: usize) -> PaneDepths {
        let rank = pixel_panes.ranks[n] as usize;
        PaneDepths { across_slabs: self.slabs.places[rank].z, view: self.panes.seen.depth(rank) }
    }

    /// Writes what the `n`-th of a pixel has into a lane of fragments.
    pub(crate) fn write(&self, pixel_panes: &OfPixel<'_>, n: usize, lane: usize, to: &mut Fragments) {
        let rank = pixel_panes.ranks[n] as usize;
        let tau = self.panes.seen.seen(rank, self.camera).crossing();
        (0..3).for_each(|p| to.optical_depth[p][lane] = tau[p]);
        let values = &self.values[(pixel_panes.first + n) * self.channels..][..self.channels];
        values.iter().enumerate().for_each(|(c, value)| to.values[c][lane] = *value);
        to.object[lane] = self.panes.seen.polygons(rank).object;
    }

    /// Bytes of the values of a slab.
    pub(crate) fn bytes(&self) -> u64 {
        4 * self.values.capacity() as u64
    }
}

/// What translucent polygons show where there is nothing else (Table 1: the images of the light alone), of all lights so far.
pub(crate) struct PanesInTheOpen<'a> {
    panes: &'a EyePanes<'a>,
    layout: ChannelLayout,
    /// Channels of each place.
    values: Vec<f32>,
}

impl<'a> PanesInTheOpen<'a> {
    pub(crate) fn new(panes: &'a EyePanes<'a>, layout: &ChannelLayout) -> Self {
        Self { panes, layout: *layout, values: vec![0.0; panes.seen.count() * layout.count()] }
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
    pub(crate) fn shade(&mut self, depths: Option<&LightDepths>, lamps: &Lamps<'_>) {
        let camera = lamps.camera;
        let light = PolygonLight::new(&self.panes.seen, camera, depths);
        let channels = self.layout.count();
        let listed = &lamps.listed();
        let seen = &self.panes.seen;
        let layout = &self.layout;
        self.values.par_chunks_mut(channels).enumerate().for_each(|(rank, values)| {
            let mut shown = [0.0; MAX_CHANNELS];
            let (point, radiance) = light.radiance(&seen.seen(rank, camera), rank, listed);
            radiance.write(point.normal, layout, &mut shown);
            (0..layout.colors()).for_each(|c| values[c] += shown[c]);
            if !lamps.light_alone {
                values[layout.colors()..].copy_from_slice(&shown[layout.colors()..channels]);
            }
        });
    }

    /// Composites them, nearest first.
    pub(crate) fn store(&self, camera: &Camera, into: &mut Accumulator) {
        let planes = into.optical_depth.len();
        let channels = self.layout.count();
        for rank in 0..self.panes.seen.count() {
            let k = self.panes.seen.pixel(rank) as usize;
            let seen = self.panes.seen.seen(rank, camera);
            let tau = seen.crossing();
            let before = [0, 1, 2].map(|p| into.optical_depth[p.min(planes - 1)][k]);
            for (c, value) in self.values[rank * channels..][..channels].iter().enumerate() {
                let p = ChannelLayout::plane_of(c, channels, planes);
                into.channels[c][k] += libm::expf(-before[p]) * -libm::expm1f(-tau[p]) * value;
            }
            (0..planes).for_each(|p| into.optical_depth[p][k] += tau[p]);
            let green = planes / 2;
            if let Some(profile) = into.depth.get_mut(k).filter(|_| tau[green] > 0.0) {
                profile.add(&surface(self.panes.seen.depth(rank), before[green], before[green] + tau[green]));
            }
            if let Some(object) = into.object.get_mut(k).filter(|object| **object == u32::MAX && tau[green] > 0.0) {
                *object = seen.polygons.object;
            }
        }
    }
}

/// A surface on a ray: no thickness, optical depth before it and behind it.
fn surface(depth: f32, before: f32, after: f32) -> splat_core::DepthFragment {
    splat_core::DepthFragment { depth, thickness: 0.0, narrow: 1.0, before, after }
}
