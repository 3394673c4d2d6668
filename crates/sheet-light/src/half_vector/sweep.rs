//! One light's sweep over all slabs: the eye's sheets, then the light's (the loop of the pseudocode, steps 9 to 24).

use super::counts::HalfCounts;
use super::geometry::Geometry;
use super::input::{HalfInput, HalfSplats};
use super::lighting::Lighting;
use super::params::HalfParams;
use super::sampled_light::CarriedLight;
use super::scatter::Scattered;
use crate::Error;
use crate::half_vector::eye::buffer::Pixels;
use crate::half_vector::eye::shade::{is_lit, reflects};
use crate::half_vector::eye::sheets::{EyeBand, OneSlab, SlabWork, Step};
use crate::half_vector::light::buffer::LightBuffer;
use crate::half_vector::polygons::eye::Eye;
use crate::half_vector::polygons::light::{PolygonImage, PolygonLight, PolygonSlabs};
use crate::half_vector::polygons::light_depth::LightDepths;
use crate::half_vector::polygons::panes::PaneSheets;
use crate::half_vector::slicing::axis::HalfVector;
use crate::half_vector::slicing::band::{Band, ROWS};
use crate::half_vector::slicing::serves::axis_of_view;
use crate::half_vector::slicing::slab_place::SlabPlace;
use crate::half_vector::splats::light::SplatLight;
use crate::half_vector::splats::sheets::SplatSheets;
use crate::shared::depths::{DepthRange, DepthSpans};
use crate::shared::error::cancelled;
use crate::shared::pixel::PixelForm;
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::raster::pulp;
use splat_core::shade::{ChannelLayout, LitBy};

/// What a sweep is asked for.
#[derive(Clone, Copy)]
pub(crate) struct SweepRequest<'a> {
    /// `None` for ambient and emitted light alone.
    pub(crate) light: Option<CarriedLight<'a>>,
    /// The axis that slabs lie across; `None` for the light's half vector, or the view's axis without a light.
    pub(crate) axis: Option<HalfVector>,
    /// Whether ambient and emitted light, and lights with known shadows, belong to another sweep.
    pub(crate) light_alone: bool,
}

/// A sweep that is about to run.
pub(crate) struct Sweep<'a> {
    input: &'a HalfInput<'a>,
    eye: &'a Eye<'a>,
    pub(crate) geometry: Geometry<'a>,
    pub(crate) lighting: Lighting<'a>,
}

/// What a sweep has drawn.
pub(crate) struct Swept {
    pub(crate) bands: Vec<EyeBand>,
    pub(crate) counts: HalfCounts,
}

/// Opaque polygons of a sweep.
struct SolidPolygons<'a> {
    light: PolygonLight<'a>,
    slabs: PolygonSlabs,
}

impl<'a> Sweep<'a> {
    /// Prepares a sweep for a light that half vectors serve.
    pub(crate) fn new(
        input: &'a HalfInput<'a>,
        params: &HalfParams,
        eye: &'a Eye<'a>,
        request: SweepRequest<'a>,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let sheets = &input.sheets;
        let volumes = &sheets.volumes[..];
        let splats = input.splats.as_ref();
        let is_lit = volumes.iter().any(is_lit) || splats.is_some_and(HalfSplats::are_lit) || eye.are_lit();
        let carried = request.light.filter(|_| is_lit);
        let mapped = if is_lit && !request.light_alone { &input.mapped[..] } else { &[] };
        let view_axis = || axis_of_view(&input.bodies(), sheets.camera, carried.map(|carried| &carried.lit.light));
        let axis = request.axis.unwrap_or_else(view_axis);
        let mut geometry = Geometry::new(input, &params.sheets, &axis)?;
        let mut lighting = Lighting::new(input, params, &geometry, carried, mapped, request.light_alone);
        let lights: Vec<LitBy<'a>> = lighting.light.iter().chain(mapped).copied().collect();
        geometry.sort_voxels(&lights, lighting.buffer.as_mut(), sheets.shadow_origin);
        let lit = lighting.light.as_ref().zip(carried);
        let lit = lit.map(|(lit, carried)| CarriedLight { lit, samples: carried.samples });
        lighting.depths = eye.light_depths(input, params, lit, progress)?;
        let lights_surfaces =
            eye.are_lit() || splats.is_some_and(HalfSplats::have_surfaces) || volumes.iter().any(reflects);
        lighting.scattered = lighting.scatter(input, params, lights_surfaces);
        Ok(Self { input, eye, geometry, lighting })
    }

    /// Runs the sweep. One tick a slab.
    pub(crate) fn run(
        mut self,
        layout: &ChannelLayout,
        form: PixelForm,
        image: Option<&mut PolygonImage>,
        progress: &Progress,
    ) -> Result<Swept, Error> {
        let mut bands = self.bands(form);
        let mut splats = self.splats(form);
        let mut counts = self.counts(&bands);
        let depths = self.lighting.depths.take();
        let depths = depths.as_ref();
        counts.bytes += depths.map_or(0, LightDepths::bytes);
        let mut solid = self.solid(depths);
        if let Some(solid) = &solid {
            counts.polygon_pixels = solid.slabs.regions;
            counts.bytes += solid.slabs.bytes();
        }
        let mut panes = self.panes(depths);
        for slab in 0..self.geometry.frame.slabs.count {
            progress.tick(1).map_err(cancelled)?;
            let place = SlabPlace::Slab(slab);
            if let Some(buffer) = &mut self.lighting.buffer {
                buffer.arrive(slab, &self.geometry.frame);
            }
            if let Some(splats) = &mut splats {
                let volumes = self.lighting.illumination(&self.geometry, place, None);
                let lamps = self.lighting.lamps(self.input);
                let fragments =
                    splats.enter(slab, &lamps, volumes.as_ref(), depths, self.lighting.at_surfaces(), layout);
                counts.eye_fragments += fragments.eye;
                counts.light_fragments += fragments.light;
            }
            if let Some(panes) = &mut panes {
                self.enter_panes(panes, place, splats.as_ref(), layout);
            }
            let work = self.work(place, Step::Draw, layout);
            let work = SlabWork { splats: splats.as_ref(), panes: panes.as_ref(), depths, ..work };
            counts.eye_fragments += draw(&mut bands, work);
            if let Some(solid) = &mut solid {
                self.light_polygons(solid, place, splats.as_ref());
            }
            if let Some(buffer) = &mut self.lighting.buffer {
                let splats = splats.as_ref().and_then(|splats| splats.light.as_ref());
                counts.light_fragments += buffer.attenuate(slab, &self.geometry, splats);
            }
            if let Some(splats) = &mut splats {
                splats.leave();
            }
        }
        if let Some(panes) = &mut panes {
            self.enter_panes(panes, SlabPlace::Behind, splats.as_ref(), layout);
            let work = self.work(SlabPlace::Behind, Step::Draw, layout);
            draw(&mut bands, SlabWork { panes: Some(panes), depths, ..work });
            counts.bytes += panes.bytes();
        }
        if let (Some(mut solid), Some(image)) = (solid, image) {
            self.light_polygons(&mut solid, SlabPlace::Behind, splats.as_ref());
            solid.light.shade(&self.lighting.lamps(self.input), self.lighting.at_surfaces(), image);
        }
        counts.bytes += splats.as_ref().map_or(0, SplatSheets::bytes);
        let soft = self.lighting.buffer.as_ref().and_then(|buffer| buffer.soft.as_ref());
        counts.soft_passes = soft.map_or(0, |soft| soft.passes);
        // Depths are summed from the eye on, so a sweep that comes towards it needs a second one for them.
        if self.geometry.frame.back_to_front && form.has_depths && !self.lighting.light_alone {
            counts.eye_fragments += self.sum_depths(&mut bands, layout, form, progress)?;
        }
        Ok(Swept { bands, counts })
    }

    /// Sums depths in a sweep from the last slab to the first. Number of footprint numbers.
    fn sum_depths(
        &self,
        bands: &mut [EyeBand],
        layout: &ChannelLayout,
        form: PixelForm,
        progress: &Progress,
    ) -> Result<u64, Error> {
        let form = PixelForm { channels: 0, ..form };
        let mut drawn = self.bands(form);
        let mut splats = self.splats(form);
        let mut panes = self.panes(None);
        let mut fragments = 0;
        let slabs = (0..self.geometry.frame.slabs.count).rev().map(SlabPlace::Slab);
        for place in std::iter::once(SlabPlace::Behind).chain(slabs) {
            progress.tick(0).map_err(cancelled)?;
            let splats = match (&mut splats, place) {
                (Some(splats), SlabPlace::Slab(slab)) => {
                    fragments += splats.draw(slab);
                    Some(&*splats)
                }
                _ => None,
            };
            panes.iter_mut().for_each(|panes| panes.draw(place));
            let work = self.work(place, Step::Depths, layout);
            fragments += draw(&mut drawn, SlabWork { splats, panes: panes.as_ref(), ..work });
        }
        for (band, drawn) in bands.iter_mut().zip(drawn) {
            band.pixels.depth = drawn.pixels.depth;
        }
        Ok(fragments)
    }

    /// One slab in the eye's image, without splats and polygons.
    fn work<'b>(&'b self, place: SlabPlace, step: Step, layout: &'b ChannelLayout) -> SlabWork<'b> {
        let Self { geometry, lighting, .. } = self;
        SlabWork { geometry, lighting, layout, splats: None, panes: None, depths: None, place, step }
    }

    /// Light of the sweep on the polygons of a slab, or of what is behind the last.
    fn light_polygons(&self, solid: &mut SolidPolygons<'_>, place: SlabPlace, splats: Option<&SplatSheets<'_>>) {
        let splats = splats.and_then(|splats| splats.light.as_ref());
        if let Some(light) = self.lighting.illumination(&self.geometry, place, splats) {
            solid.light.enter(&solid.slabs, place, &self.geometry.frame, &light);
        }
    }

    /// Opaque polygons of the sweep, if there are any.
    fn solid<'b>(&self, depths: Option<&'b LightDepths>) -> Option<SolidPolygons<'b>>
    where
        'a: 'b,
    {
        let surfaces = &self.eye.solid.as_ref()?.seen;
        let camera = self.input.sheets.camera;
        let slabs = PolygonSlabs::new(surfaces, &self.geometry.frame, camera, self.bodies());
        Some(SolidPolygons { light: PolygonLight::new(surfaces, camera, depths), slabs })
    }

    /// Translucent polygons of the sweep, if any are seen.
    fn panes<'b>(&self, depths: Option<&'b LightDepths>) -> Option<PaneSheets<'b>>
    where
        'a: 'b,
    {
        let panes = self.eye.panes.as_ref()?;
        Some(PaneSheets::new(panes, &self.geometry.frame, self.input.sheets.camera, depths, self.bodies()))
    }

    /// Takes up those of a slab, or of what is behind the last, with the light of the sweep.
    fn enter_panes(
        &self,
        panes: &mut PaneSheets<'_>,
        place: SlabPlace,
        splats: Option<&SplatSheets<'_>>,
        layout: &ChannelLayout,
    ) {
        let splats: Option<&SplatLight<'_>> = splats.and_then(|splats| splats.light.as_ref());
        let light = self.lighting.illumination(&self.geometry, place, splats);
        let lamps = self.lighting.lamps(self.input);
        panes.enter(place, &self.geometry.frame, light.as_ref(), &lamps, self.lighting.at_surfaces(), layout);
    }

    /// Depths across the slabs between which all bodies lie.
    fn bodies(&self) -> DepthRange {
        self.geometry.depths_of(self.input.bodies().corners())
    }

    /// The splats of the sweep, if there are any.
    fn splats(&self, form: PixelForm) -> Option<SplatSheets<'a>> {
        let splats = self.input.splats.as_ref().filter(|splats| !splats.cloud.is_empty())?;
        // Which of them lie before a translucent polygon their depths say.
        let form = PixelForm { has_depths: form.has_depths || self.eye.panes.is_some(), ..form };
        let buffer = self.lighting.buffer.as_ref();
        Some(SplatSheets::new(splats, &self.geometry.frame, buffer, self.input.opaque, form))
    }

    fn bands(&self, form: PixelForm) -> Vec<EyeBand> {
        let Geometry { frame, sight, placed, volumes, params, .. } = &self.geometry;
        let camera = &sight.camera;
        let opaque = self.input.opaque;
        let rim = usize::from(placed.iter().any(|v| v.compares));
        let eye_band = |b: usize| {
            let mut band = Band::new(b, rim, frame, camera, volumes);
            if !opaque.is_empty() {
                band.end_at(opaque, frame, camera);
            }
            let pixels = Pixels::new(&band, form, params.is_half());
            EyeBand::new(band, placed, pixels)
        };
        (0..(camera.size[1] as usize).div_ceil(ROWS)).into_par_iter().map(eye_band).collect()
    }

    fn counts(&self, bands: &[EyeBand]) -> HalfCounts {
        let Geometry { volumes, voxels, frame, .. } = &self.geometry;
        let buffer = self.lighting.buffer.as_ref();
        let scattered = self.lighting.scattered.as_ref();
        let light_bytes = buffer.map_or(0, LightBuffer::bytes) + scattered.map_or(0, Scattered::bytes);
        let lists: u64 = voxels.iter().map(|v| v.values.bytes()).sum();
        let eye: u64 = bands.iter().map(EyeBand::bytes).sum();
        HalfCounts {
            voxels: volumes.iter().map(|v| v.grid.values.len() as u64).sum(),
            visible: voxels.iter().map(|v| v.voxels.count()).sum(),
            sweeps: 1,
            slabs: frame.slabs.count.into(),
            scatter_cells: scattered.map_or(0, Scattered::cells),
            scatter_passes: scattered.map_or(0, |s| s.passes),
            light_bytes,
            bytes: light_bytes + lists + eye + buffer.map_or(0, LightBuffer::list_bytes),
            ..HalfCounts::default()
        }
    }
}

/// Draws one slab in all bands of the eye's image. Number of footprint numbers.
fn draw(bands: &mut [EyeBand], work: SlabWork<'_>) -> u64 {
    let footprints = |(index, eye): (usize, &mut EyeBand)| {
        pulp::Arch::new().dispatch(OneSlab { work, index, eye, part: DepthSpans::WHOLE })
    };
    bands.par_iter_mut().enumerate().map(footprints).sum()
}
