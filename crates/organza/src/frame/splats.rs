//! Splats of a frame: those that are drawn, their footprints and radiance, and the opaque ones as an image.

use super::Frame;
use crate::pass;
use crate::{CostRecord, Error, stage};
use splat_core::raster::{
    self, Detail, FinishInput, GlassImage, OpaqueImage, OpaqueInput, ProjectInput, Projected, RasterCounts,
};
use splat_core::shade::{Within, shade_into, shade_within};
use splat_core::{Accumulator, Layers, SplatKind, StageCost};

/// The drawn splats, ready to be composited, by id.
#[derive(Default)]
pub struct Shaded {
    pub(crate) projected: Projected,
    /// Radiance by effect, and whatever else a splat brings to a pixel: [`Shaded::channels`] numbers a splat.
    pub values: Vec<f32>,
    /// Numbers a splat, as many as a pixel of the accumulator has.
    pub channels: usize,
}

impl Frame<'_> {
    /// Footprints and radiance of the drawn splats in view; of those out of view the radiance is 0, but where bent rays may see them. The
    /// passes that were run for it are added to `cost`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and those of [`Frame::maps`].
    pub fn shaded(&self, cost: &mut CostRecord) -> Result<&Shaded, Error> {
        if let Some(shaded) = self.shaded.get() {
            return Ok(shaded);
        }
        let shadows = self.shadows_of_drawn(cost)?;
        let Shaded { projected, mut values, .. } = self.before.take();
        let projected = self.project(projected, cost)?;
        let eye = self.eye_map(cost)?;
        let layout = self.layout();
        self.progress.begin(stage::SHADE);
        cost.measure(pass::SHADE, |stage| {
            let lights = self.lit_by(&shadows);
            let bends = self.plan.bends;
            let progress = Some(self.progress);
            let is_one = |i| bends || projected.is_visible(i);
            let input = &self.shading(&lights);
            let shaded = match &eye {
                Some(eye) => {
                    let within = Within { input, eye, footprints: &self.loaded.footprints };
                    shade_within(&mut values, &within, is_one, &layout, progress)
                }
                None => shade_into(&mut values, input, is_one, &layout, progress),
            };
            shaded.map_err(|e| Error::from_core("shading", e))?;
            stage.items_in = if bends { self.drawn().len() as u64 } else { projected.visible() };
            stage.items_out = stage.items_in;
            stage.bytes = 4 * values.len() as u64;
            Ok::<_, Error>(())
        })?;
        self.tick()?;
        Ok(self.shaded.get_or_init(|| Shaded { projected, values, channels: layout.count() }))
    }

    /// Depths are for opaque splats and what they hide, for what polygons part, for depth layers, and for telling objects apart.
    pub(crate) fn detail(&self) -> Detail {
        let opaque = self.has_polygons() || self.drawn().kind.contains(&SplatKind::Opaque);
        Detail { depth: opaque || self.layers.depth || self.layers.object, object: self.layers.object }
    }

    /// Footprints of the drawn splats, in the memory of those of another frame.
    fn project(&self, mut projected: Projected, cost: &mut CostRecord) -> Result<Projected, Error> {
        self.progress.begin(stage::PROJECT);
        self.tick()?;
        let l = self.loaded;
        let cloud = self.drawn();
        cost.measure(pass::PROJECT, |stage| {
            let params = self.raster_params();
            let detail = self.detail();
            raster::project_into(
                &mut projected,
                &ProjectInput {
                    cloud,
                    camera: &self.camera,
                    footprints: &l.footprints,
                    materials: &l.materials,
                    params: &params,
                    detail,
                },
            );
            stage.items_in = cloud.len() as u64;
            stage.items_out = projected.visible();
            stage.bytes = projected.bytes();
            Ok::<_, Error>(())
        })?;
        self.tick()?;
        Ok(projected)
    }

    /// The nearest opaque surface of every sample; an empty image where nothing is opaque. The passes that were run for it are added to `cost`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and those of [`Frame::maps`].
    pub fn opaque(&self, cost: &mut CostRecord) -> Result<&OpaqueImage, Error> {
        if self.opaque.get().is_none() {
            self.set_opaque(self.solid(cost)?.joined((self.engines.polygons)(self, cost)?));
        }
        Ok(self.opaque.get().expect("invariant: it was set above"))
    }

    /// The same of opaque splats alone, for a technique that adds polygons to it.
    pub(crate) fn solid(&self, cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
        let image = self.solid_splats(cost)?;
        let ids = self.solid_of(true);
        if ids.is_empty() {
            return Ok(image);
        }
        self.progress.begin(stage::OPAQUE);
        Ok(image.joined((self.engines.discs)(self, ids, cost)?))
    }

    fn solid_splats(&self, cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
        let ids = self.solid_ids();
        // Beside translucent splats they have been shaded already.
        let alone = self.shaded.get().is_none() && !ids.is_empty();
        let by_device = if alone { self.solid_by_device(ids, cost)? } else { None };
        let mut image = by_device.unwrap_or_default();
        if !ids.is_empty() && image.depth.is_empty() {
            let Shaded { projected, values, channels } = self.shaded(cost)?;
            self.progress.begin(stage::OPAQUE);
            image = cost.measure(pass::OPAQUE, |stage| {
                stage.items_in = ids.len() as u64;
                let objects = self.layers.object;
                let input = OpaqueInput { projected, ids, values, channels: *channels as u32, objects };
                let resolved = raster::resolve_opaque(&input, Some(self.progress));
                let (image, counts) = resolved.map_err(|e| Error::from_core("opaque splats", e))?;
                record(stage, &counts);
                Ok::<_, Error>(image)
            })?;
        }
        Ok(image)
    }

    /// Takes the opaque image that a device or a technique has made.
    pub(crate) fn set_opaque(&self, image: OpaqueImage) {
        // One that is there already is the same.
        let _ = self.opaque.set(image);
    }

    /// Layers of what was composited in front of the opaque splats, which lie in front of the background. The passes that were run
    /// for it are added to `cost`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and those of [`Frame::maps`].
    pub fn finish(
        &self,
        accumulator: &Accumulator,
        glass: Option<&GlassImage>,
        cost: &mut CostRecord,
    ) -> Result<Layers, Error> {
        let opaque = self.opaque(cost)?;
        self.progress.begin(stage::FINISH);
        cost.measure(pass::FINISH, |stage| {
            stage.items_in = self.camera.pixels();
            let antialias = self.settings.antialias;
            Ok::<_, Error>(raster::finish(&FinishInput {
                accumulator,
                opaque,
                background: self.background(),
                glass,
                layout: &self.layout(),
                layers: &self.layers,
                antialias,
            }))
        })
    }
}

/// What rasterization did, in the record of its stage.
pub(crate) fn record(stage: &mut StageCost, counts: &RasterCounts) {
    stage.items_out = counts.splats;
    stage.fragments = counts.fragments;
    stage.bytes = counts.bytes;
}
