//! Splats of a frame: those that are drawn, their footprints and radiance, and the opaque ones as an image.

use super::Frame;
use crate::pass;
use crate::{CostRecord, Error, stage};
use glam::Vec3;
use rayon::prelude::*;
use splat_core::raster::{
    self, Cover, Detail, FinishInput, FoldInput, GlassImage, NearestSurfaces, OpaqueImage, OpaqueInput, ProjectInput,
    Projected, RasterCounts, Reached,
};
use splat_core::shade::{ChannelLayout, LitBy, Within, shade_into, shade_within};
use splat_core::{Accumulator, Direction, Layers, Receiver, SplatKind, StageCost, Transmittance};
use tsm::ShadowMap;

/// Splats that are looked at to find whether many lie behind finished pixels.
const SAMPLES: usize = 1 << 12;
/// The share of splats behind finished pixels from which on finding all of them takes less time than lighting them: compositing without colours takes
/// about a fifth of the time of the light within thick media.
const MANY: f64 = 0.25;

/// The drawn splats, ready to be composited, by id.
#[derive(Default)]
pub struct Shaded {
    pub(crate) projected: Projected,
    /// Radiance by effect, and whatever else a splat brings to a pixel: [`Shaded::channels`] numbers a splat.
    pub values: Vec<f32>,
    /// Numbers a splat, as many as a pixel of the accumulator has.
    pub channels: usize,
}

/// What light a splat has, and which numbers of it are kept.
struct Shading<'a> {
    lights: &'a [LitBy<'a>],
    /// The eye's map, where media are lit within.
    eye: Option<&'a ShadowMap>,
    layout: ChannelLayout,
    /// The translucent splats of the whole picture in the order in which they are composited, front to back, where that is known.
    order: Option<&'a [u32]>,
}

impl Frame<'_> {
    /// Footprints and radiance of the drawn splats in view; of those out of view the radiance is 0, but where bent rays may see them, and so it is of
    /// those that opaque ones hide, where no technique asks for them ([`Plan::skips_hidden`](crate::plan::Plan::skips_hidden)). The passes that were run for it are added
    /// to `cost`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and those of [`Frame::maps`].
    pub fn shaded(&self, cost: &mut CostRecord) -> Result<&Shaded, Error> {
        self.shaded_in_order(None, cost)
    }

    /// The same for a picture that is composited in this order, front to back and once: the radiance of splats behind finished pixels is 0, where these are
    /// many and media are thick, so that their light takes up to 25 look-ups a splat and lamp.
    pub(crate) fn shaded_in_order(&self, order: Option<&[u32]>, cost: &mut CostRecord) -> Result<&Shaded, Error> {
        if let Some(shaded) = self.shaded.get() {
            return Ok(shaded);
        }
        let shadows = self.shadows_of_drawn(cost)?;
        let Shaded { projected, mut values, .. } = self.before.take();
        let projected = self.project(projected, cost)?;
        let eye = self.eye_map(cost)?;
        if let Some(eye) = &eye {
            self.shown.get_or_init(|| self.shown(eye));
        }
        // Surfaces that are drawn apart from splats would keep pixels open that splats behind them finish.
        let all_opaque_are_splats = !self.has_polygons() && self.solid_of(true).is_empty();
        let is_deep = |order: &&[u32]| eye.as_ref().is_some_and(|eye| self.is_deep(order, eye));
        let order = order.filter(|_| all_opaque_are_splats).filter(is_deep);
        let shading = Shading { lights: &self.lit_by(&shadows), eye: eye.as_ref(), layout: self.layout(), order };
        if self.skips_hidden(order) {
            let mut stages = CostRecord::default();
            self.shade_seen(&mut values, &projected, &shading, &mut stages)?;
            stages.join(pass::SHADE);
            stages.join(pass::OPAQUE);
            cost.stages.extend(stages.stages);
        } else {
            self.progress.begin(stage::SHADE);
            let bends = self.plan.bends;
            let splats = if bends { self.drawn().len() as u64 } else { projected.visible() };
            self.shade(&mut values, &shading, &|i| bends || projected.is_visible(i), splats, cost)?;
        }
        self.tick()?;
        Ok(self.shaded.get_or_init(|| Shaded { projected, values, channels: shading.layout.count() }))
    }

    /// Whether many of these splats lie behind finished pixels, by a look at some of them in the eye's map.
    fn is_deep(&self, splats: &[u32], eye: &ShadowMap) -> bool {
        let cloud = self.drawn();
        let finished = -libm::logf(self.raster_params().transmittance_cutoff);
        let looked_at = splats.iter().step_by(splats.len().div_ceil(SAMPLES).max(1));
        let receiver = |splat: &u32| {
            let i = *splat as usize;
            Receiver {
                position: cloud.position[i],
                normal: Vec3::ZERO,
                radius: cloud.radius[i],
                kind: SplatKind::Medium,
            }
        };
        let is_behind = |splat: &&u32| eye.absorbance(&receiver(splat)).iter().all(|depth| *depth > finished);
        let behind = looked_at.clone().filter(is_behind).count();
        behind as f64 > MANY * looked_at.len() as f64
    }

    /// Whether splats get no light that opaque ones hide, or that the compositing of all translucent ones in this order does not reach.
    fn skips_hidden(&self, order: Option<&[u32]>) -> bool {
        let hides = order.is_some() || !self.solid_ids().is_empty();
        self.is_one_picture && self.plan.skips_hidden && !self.device_composites && hides
    }

    /// Radiance of what is seen: of the opaque splats that some sample shows, which become an image, and of the translucent ones that do not lie behind
    /// it, nor behind finished pixels.
    fn shade_seen(
        &self,
        values: &mut Vec<f32>,
        projected: &Projected,
        shading: &Shading<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let image = self.shade_seen_solid(values, projected, shading, cost)?;
        if let Some(order) = shading.order {
            let params = self.raster_params();
            let input = FoldInput {
                projected,
                order,
                values: &[],
                materials: &self.loaded.materials,
                opaque: &image,
                direction: Direction::FrontToBack,
                params: &params,
            };
            let planes = self.plan.optical_depth_planes;
            let reached = cost.measure(pass::SHADE, |stage| {
                let reached = Reached::find(&input, planes, Some(self.progress));
                let reached = reached.map_err(|e| Error::from_core("compositing", e))?;
                stage.fragments = reached.counts().fragments;
                Ok::<_, Error>(reached)
            })?;
            self.shade(values, shading, &|i| reached.has(i), reached.count(), cost)?;
        } else if self.solid_ids().len() < projected.splats.len() {
            let kind = &self.drawn().kind;
            let cover = Cover::new(&image, projected.size);
            let splats = (0..kind.len()).into_par_iter().with_min_len(1 << 14);
            let is_seen =
                |i: usize| kind[i] != SplatKind::Opaque && projected.is_visible(i) && !cover.hides(projected, i);
            let seen: Vec<bool> = splats.map(is_seen).collect();
            let count = seen.iter().filter(|is_seen| **is_seen).count() as u64;
            self.shade(values, shading, &|i| seen[i], count, cost)?;
        }
        self.solid.set(Some(image));
        Ok(())
    }

    /// The image of the opaque splats, and the radiance of those that some sample shows; an empty one where nothing is opaque.
    fn shade_seen_solid(
        &self,
        values: &mut Vec<f32>,
        projected: &Projected,
        shading: &Shading<'_>,
        cost: &mut CostRecord,
    ) -> Result<OpaqueImage, Error> {
        let ids = self.solid_ids();
        if ids.is_empty() {
            self.progress.begin(stage::SHADE);
            return Ok(OpaqueImage::default());
        }
        let refused = |e| Error::from_core("opaque splats", e);
        self.progress.begin(stage::OPAQUE);
        let nearest = cost.measure(pass::OPAQUE, |_| {
            NearestSurfaces::find(projected, ids, self.layers.object, Some(self.progress)).map_err(refused)
        })?;
        self.progress.begin(stage::SHADE);
        self.shade(values, shading, &|i| nearest.shows(i), nearest.shown(), cost)?;
        cost.measure(pass::OPAQUE, |stage| {
            stage.items_in = ids.len() as u64;
            let channels = shading.layout.count() as u32;
            let (image, counts) = nearest.resolve(values, channels, Some(self.progress)).map_err(refused)?;
            record(stage, &counts);
            Ok::<_, Error>(image)
        })
    }

    /// Radiance of those of the drawn splats that `is_one` says, so many `splats`, and 0 of the others.
    fn shade(
        &self,
        values: &mut Vec<f32>,
        shading: &Shading<'_>,
        is_one: &(dyn Fn(usize) -> bool + Sync),
        splats: u64,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        cost.measure(pass::SHADE, |stage| {
            let Shading { lights, eye, layout, .. } = shading;
            let progress = Some(self.progress);
            let input = &self.shading(lights);
            let shaded = match eye {
                Some(eye) => {
                    let within = Within { input, eye: *eye, footprints: &self.loaded.footprints };
                    shade_within(values, &within, is_one, layout, progress)
                }
                None => shade_into(values, input, is_one, layout, progress),
            };
            shaded.map_err(|e| Error::from_core("shading", e))?;
            stage.items_in = splats;
            stage.items_out = splats;
            stage.bytes = 4 * values.len() as u64;
            Ok::<_, Error>(())
        })
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
        if ids.is_empty() || !image.depth.is_empty() {
            return Ok(image);
        }
        let Shaded { projected, values, channels } = self.shaded(cost)?;
        if let Some(image) = self.solid.take() {
            return Ok(image);
        }
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
