//! The `points` technique (Gunjee 2007): shadow maps, slices, attribute-driven shading, splatting.

mod chained;

use crate::device::{Helper, LookedUp};
use crate::load::Loaded;
use crate::plan::{Plan, pass};
use crate::scene::RenderSettings;
use crate::work::{self, stage};
use crate::{Error, Progress};
use splat_core::raster::gpu::Input;
use splat_core::raster::{self, Background, Detail, OpaqueImage, Projected, RasterCounts};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade};
use splat_core::{
    Accumulator, Camera, CostRecord, Direction, LayerSet, Layers, Light, SliceOrder, SplatKind, StageCost,
    Transmittance,
};
use std::borrow::Cow;
use tsm::{Deposits, ShadowMap};

/// What drawing reads.
pub(crate) struct Drawing<'a> {
    pub(crate) loaded: &'a Loaded,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) background: [f32; 3],
    pub(crate) ambient: [f32; 3],
    pub(crate) layers: LayerSet,
    pub(crate) plan: &'a Plan,
    /// A device that helps.
    pub(crate) helper: Option<&'a Helper>,
    /// Whether it composites splats, which changes the last bits.
    pub(crate) device_composites: bool,
    pub(crate) progress: &'a Progress,
}

/// Runs the planned passes.
pub(crate) fn draw(drawing: &Drawing<'_>, cost: &mut CostRecord) -> Result<Layers, Error> {
    let camera = drawing.sample_camera();
    if let Some(layers) = drawing.staying(&camera, cost)? {
        return Ok(layers);
    }
    let maps = drawing.shadow_maps(cost)?;
    if let Some(layers) = drawing.chained(&maps, &camera, cost)? {
        return Ok(layers);
    }
    let order = drawing.sort(&camera, cost)?;
    let shaded = drawing.light(&maps, &camera, cost)?;
    drawing.compose(&shaded, &order, cost)
}

impl Drawing<'_> {
    /// Footprints and radiance of the splats in view.
    pub(crate) fn light(
        &self,
        maps: &[Option<ShadowMap>],
        camera: &Camera,
        cost: &mut CostRecord,
    ) -> Result<Shaded, Error> {
        let projected = self.project(camera, cost)?;
        let layout = ChannelLayout::new(&self.layers);
        self.progress.begin(stage::SHADE);
        let values = cost.measure(pass::SHADE, |stage| {
            let visible = (0..self.loaded.cloud.len() as u32).filter(|&i| projected.is_visible(i as usize));
            let looked_up = self.look_ups(maps, visible);
            let lights = self.lit_by(maps, &looked_up);
            let values = shade(&self.shading(&lights, camera), &projected, &layout, self.progress);
            stage.items_in = projected.visible();
            stage.items_out = stage.items_in;
            stage.bytes = 4 * values.len() as u64;
            Ok::<_, Error>(values)
        })?;
        self.tick()?;
        Ok(Shaded { projected, values, channels: layout.count() })
    }

    /// For each map the light at these splats, where a device looks it up.
    fn look_ups<'b>(
        &self,
        maps: &'b [Option<ShadowMap>],
        splats: impl Iterator<Item = u32>,
    ) -> Vec<Option<LookedUp<'b>>> {
        let device = self.helper.filter(|_| self.device_composites && maps.iter().any(Option::is_some));
        let Some(device) = device else { return maps.iter().map(|_| None).collect() };
        let ids: Vec<u32> = splats.collect();
        maps.iter().map(|map| device.look_up(map.as_ref()?, &self.loaded.cloud, &ids)).collect()
    }

    /// The lights that have an intensity, with what is known of their shadows, or their maps.
    fn lit_by<'b>(&self, maps: &'b [Option<ShadowMap>], looked_up: &'b [Option<LookedUp<'b>>]) -> Vec<LitBy<'b>> {
        let known = looked_up.iter().zip(maps).map(|(known, map)| {
            let map = map.as_ref().map(|map| map as &dyn Transmittance);
            known.as_ref().map(|known| known as &dyn Transmittance).or(map)
        });
        self.with_light(known).map(|(light, shadow)| LitBy { light, shadow }).collect()
    }

    /// What shading reads.
    fn shading<'b>(&'b self, lights: &'b [LitBy<'b>], camera: &'b Camera) -> ShadeInput<'b> {
        let l = self.loaded;
        let (cloud, materials, objects) = (&l.cloud, &l.materials[..], &l.objects[..]);
        ShadeInput { cloud, materials, objects, lights, ambient: self.ambient, camera }
    }

    /// The lights that have an intensity, with their shadow maps.
    pub(crate) fn shining<'b>(
        &'b self,
        maps: &'b [Option<ShadowMap>],
    ) -> impl Iterator<Item = (Light, Option<&'b ShadowMap>)> {
        self.with_light(maps.iter().map(Option::as_ref))
    }

    /// Lights that have an intensity, each with what is there for it.
    fn with_light<T>(&self, of_each: impl Iterator<Item = T>) -> impl Iterator<Item = (Light, T)> {
        let all = self.loaded.lights.iter().zip(of_each);
        all.filter(|(light, _)| light.intensity != [0.0; 3]).map(|(light, of)| (*light, of))
    }

    /// Splats in this order in front of the opaque ones, as layers.
    pub(crate) fn compose(&self, shaded: &Shaded, order: &SliceOrder, cost: &mut CostRecord) -> Result<Layers, Error> {
        let opaque = self.opaque(shaded, cost)?;
        let accumulator = self.translucent(shaded, &opaque, order, cost)?;
        self.finish(&accumulator, &opaque, cost)
    }

    /// Layers of what was composited in front of the opaque splats.
    fn finish(&self, accumulator: &Accumulator, opaque: &OpaqueImage, cost: &mut CostRecord) -> Result<Layers, Error> {
        self.progress.begin(stage::FINISH);
        cost.measure(pass::FINISH, |stage| {
            let background = Background { color: self.background };
            let [width, height] = accumulator.size;
            stage.items_in = u64::from(width) * u64::from(height);
            let (set, layout) = (&self.layers, ChannelLayout::new(&self.layers));
            self.tick()?;
            Ok::<_, Error>(raster::finish(accumulator, opaque, &background, &layout, set, self.settings.antialias))
        })
    }

    /// The camera with `antialias`² samples a pixel.
    pub(crate) fn sample_camera(&self) -> Camera {
        let mut camera = self.loaded.camera;
        camera.size = camera.size.map(|s| s * self.settings.antialias);
        camera
    }

    fn tick(&self) -> Result<(), Error> {
        self.progress.tick(1).map_err(|_| Error::Cancelled)
    }

    pub(crate) fn raster_params(&self) -> raster::Params {
        raster::Params {
            resampling_sigma_px: if self.settings.points.resampling_filter {
                raster::Params::default().resampling_sigma_px
            } else {
                0.0
            },
            transmittance_cutoff: self.settings.points.transmittance_cutoff as f32,
            accumulation: self.settings.points.accumulation,
        }
    }

    /// How far the resampling filter widens a footprint, pixels.
    pub(crate) fn filter_reach_px(&self) -> f64 {
        let widest = self.loaded.footprints.layers().iter().map(|f| f.cutoff).fold(0.0, f32::max);
        f64::from(widest * self.raster_params().resampling_sigma_px)
    }

    /// One map for each light that the plan gives one.
    pub(crate) fn shadow_maps(&self, cost: &mut CostRecord) -> Result<Vec<Option<ShadowMap>>, Error> {
        let mut maps = Vec::new();
        let mut left = self.plan.shadow_bytes;
        let (mut made, count) = (0, self.plan.shadow_maps.iter().filter(|on| **on).count());
        for (i, (light, table)) in self.loaded.lights.iter().zip(&self.plan.shadow_tables).enumerate() {
            self.tick()?;
            let Some(table) = table else {
                maps.push(None);
                continue;
            };
            made += 1;
            self.progress.begin(&work::shadow_map(made, count));
            let params = table.params(self.settings, self.loaded, left);
            let map = cost.measure(pass::SHADOW_MAP, |stage| {
                let l = self.loaded;
                let deposits = Deposits::new(&l.cloud, &l.materials, &l.objects, light, &params, self.progress)
                    .map_err(|e| shadow_error(i, &e))?;
                let helped = self.helper.and_then(|helper| helper.shadow_map(&deposits));
                let map = helped.unwrap_or_else(|| deposits.into_map());
                stage.items_in = l.cloud.len() as u64;
                stage.items_out = map.counts().kept;
                stage.bytes = map.counts().bytes;
                Ok::<_, Error>(map)
            })?;
            left = left.saturating_sub(map.counts().bytes);
            maps.push(Some(map));
        }
        Ok(maps)
    }

    /// Slices of the translucent splats; an empty order without any.
    pub(crate) fn sort(&self, camera: &Camera, cost: &mut CostRecord) -> Result<SliceOrder, Error> {
        let cloud = &self.loaded.cloud;
        let translucent: Vec<u32> = self.ids(|kind| kind != SplatKind::Opaque);
        if translucent.is_empty() {
            return Ok(SliceOrder::default());
        }
        self.progress.begin(stage::SORT);
        self.tick()?;
        let params = self.sort_params();
        let order = cost.measure(pass::SORT, |stage| {
            let helped = self.helper.and_then(|helper| helper.order(cloud, &translucent, camera, &params));
            let order = helped.map_or_else(
                || hbsort::slice_cloud(cloud, Some(&translucent), camera, &params, &mut hbsort::Scratch::default()),
                Ok,
            );
            let order = order.map_err(|e| Error::Internal(e.to_string()))?;
            stage.items_in = translucent.len() as u64;
            stage.items_out = order.input_from_sorted.len() as u64;
            stage.bytes = 4 * (order.input_from_sorted.len() + order.slice_starts.len()) as u64;
            Ok::<_, Error>(order)
        })?;
        Ok(match self.settings.points.first_slices {
            Some(n) => order.first_slices(usize::try_from(n).unwrap_or(usize::MAX)),
            None => order,
        })
    }

    fn sort_params(&self) -> hbsort::Params {
        let points = &self.settings.points;
        hbsort::Params {
            direction: points.direction,
            thickness: self.loaded.slice_thickness.map_or(hbsort::Thickness::Auto, hbsort::Thickness::World),
            // Depths are made from splats in order, not from slices.
            exact: points.exact || self.layers.depth,
            margin_px: self.filter_reach_px(),
            ..hbsort::Params::default()
        }
    }

    pub(crate) fn ids(&self, keep: impl Fn(SplatKind) -> bool) -> Vec<u32> {
        let kinds = &self.loaded.cloud.kind;
        (0..kinds.len() as u32).filter(|&i| keep(kinds[i as usize])).collect()
    }

    /// Depths are for opaque splats and what they hide, for depth layers, and for telling objects apart.
    fn detail(&self) -> Detail {
        let opaque = self.loaded.cloud.kind.contains(&SplatKind::Opaque);
        Detail { depth: opaque || self.layers.depth || self.layers.object, object: self.layers.object }
    }

    /// Footprints of all splats.
    fn project(&self, camera: &Camera, cost: &mut CostRecord) -> Result<Projected, Error> {
        self.progress.begin(stage::PROJECT);
        self.tick()?;
        let l = self.loaded;
        let projected = cost.measure(pass::PROJECT, |stage| {
            let mut projected = Projected::default();
            let (params, detail) = (self.raster_params(), self.detail());
            raster::project_into(&mut projected, &l.cloud, camera, &l.footprints, &l.materials, &params, detail);
            stage.items_in = l.cloud.len() as u64;
            stage.items_out = projected.visible();
            stage.bytes = projected.bytes();
            Ok::<_, Error>(projected)
        })?;
        self.tick()?;
        Ok(projected)
    }

    /// The opaque splats alone: projected, shaded and resolved.
    pub(crate) fn solid(
        &self,
        maps: &[Option<ShadowMap>],
        camera: &Camera,
        cost: &mut CostRecord,
    ) -> Result<OpaqueImage, Error> {
        let ids = self.ids(|kind| kind == SplatKind::Opaque);
        if ids.is_empty() {
            return Ok(OpaqueImage::default());
        }
        if let Some(image) = self.solid_by_device(maps, &ids, camera, cost)? {
            return Ok(image);
        }
        let all = self.loaded;
        let loaded = Loaded {
            cloud: all.cloud.gather(&ids),
            materials: all.materials.clone(),
            objects: all.objects.clone(),
            footprints: all.footprints.clone(),
            lights: all.lights.clone(),
            casts: all.casts.clone(),
            own: Vec::new(),
            statistics: Vec::new(),
            splats: Vec::new(),
            warnings: Vec::new(),
            notes: Vec::new(),
            ..*all
        };
        let solid = Drawing { loaded: &loaded, layers: self.layers.clone(), ..*self };
        let shaded = solid.light(maps, camera, cost)?;
        solid.opaque(&shaded, cost)
    }

    pub(crate) fn opaque(&self, shaded: &Shaded, cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
        let ids = self.ids(|kind| kind == SplatKind::Opaque);
        if ids.is_empty() {
            return Ok(OpaqueImage::default());
        }
        self.progress.begin(stage::OPAQUE);
        cost.measure(pass::OPAQUE, |stage| {
            stage.items_in = ids.len() as u64;
            let Shaded { projected, values, channels } = shaded;
            let objects = self.layers.object;
            let (image, counts) = raster::resolve_opaque(projected, &ids, values, *channels, objects, self.progress);
            record(stage, &counts);
            Ok(image)
        })
    }

    fn translucent(
        &self,
        shaded: &Shaded,
        opaque: &OpaqueImage,
        order: &SliceOrder,
        cost: &mut CostRecord,
    ) -> Result<Accumulator, Error> {
        let Shaded { projected, values, channels } = shaded;
        let (planes, set) = (self.plan.optical_depth_planes, &self.layers);
        let mut accumulator = Accumulator::new(projected.size, planes, *channels, set.depth, set.object);
        let mut ids = Cow::Borrowed(order.input_from_sorted.as_slice());
        if ids.is_empty() {
            return Ok(accumulator);
        }
        let mut direction = order.direction;
        if set.depth && direction == Direction::BackToFront {
            // Depths are made front to back. The picture is the same.
            ids.to_mut().reverse();
            direction = Direction::FrontToBack;
        }
        self.progress.begin(stage::COMPOSITE);
        self.tick()?;
        cost.measure(pass::SPLAT, |stage| {
            stage.items_in = ids.len() as u64;
            let (materials, params) = (&self.loaded.materials, self.raster_params());
            let input = Input { projected, order: &ids, values, materials, opaque, direction, params: &params };
            let device = self.helper.filter(|_| self.device_composites);
            let counts = device.and_then(|device| device.composite(&input, &mut accumulator)).unwrap_or_else(|| {
                raster::fold(
                    projected,
                    &ids,
                    values,
                    materials,
                    opaque,
                    direction,
                    &params,
                    &mut accumulator,
                    self.progress,
                )
            });
            record(stage, &counts);
            Ok::<_, Error>(())
        })?;
        self.tick()?;
        Ok(accumulator)
    }
}

/// Splats ready to be composited, by id.
pub(crate) struct Shaded {
    pub(crate) projected: Projected,
    pub(crate) values: Vec<f32>,
    pub(crate) channels: usize,
}

fn record(stage: &mut StageCost, counts: &RasterCounts) {
    stage.items_out = counts.splats;
    stage.fragments = counts.fragments;
    stage.bytes = counts.bytes;
}

pub(crate) fn shadow_error(light: usize, error: &tsm::Error) -> Error {
    let what = format!("the shadow map of light {light}");
    match error {
        tsm::Error::Memory { needed_bytes, limit_bytes, .. } => Error::Limit {
            what,
            needed: *needed_bytes,
            limit: *limit_bytes,
            unit: "bytes",
            hint:
                "use fewer lights or samples of lights, fewer cells in render.points.shadow, or a larger --max-memory"
                    .into(),
        },
        tsm::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        other => Error::input(what, other.to_string(), ""),
    }
}
