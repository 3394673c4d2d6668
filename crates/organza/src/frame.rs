//! One frame: what all techniques share. The camera of samples, lights and their shadow maps, the splats that are drawn with their footprints and
//! radiance, the opaque image, the device, progress. Whatever is made for it is made once, when it is first asked for.

mod coarse;
mod engines;
mod light;
mod lists;
pub(crate) mod matter;
mod on_device;
mod splats;

use coarse::Shown;
pub(crate) use engines::OpaqueEngines;
pub(crate) use light::Maps;
use lists::Lists;
pub(crate) use on_device::Chained;
pub use splats::Shaded;
pub(crate) use splats::record;

use crate::device::Helper;
use crate::frame::matter::Matter;
use crate::load::Loaded;
use crate::plan::Plan;
use crate::scene::{LightPoint, RenderSettings, Scene};
use crate::{Error, Progress};
use deferred_blend::grouping::GroupsOfObjects;
use splat_core::raster::{self, Background, OpaqueImage};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, LayerSet};
use std::cell::{Cell, OnceCell, RefCell};

/// One frame of a loaded scene: what techniques read, each part made once, when it is first asked for.
///
/// Lengths are in the scale of [`Loaded::cloud`]; ids of splats are places in [`Frame::drawn`].
pub struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) loaded: &'a Loaded,
    pub(crate) plan: &'a Plan,
    /// What a pixel keeps.
    pub(crate) layers: LayerSet,
    /// The camera of samples: the scene's, with `render.antialias` times its pixels along each side.
    pub camera: Camera,
    /// A device that helps.
    pub(crate) helper: Option<&'a Helper<'a>>,
    /// Whether it composites splats, which changes the last bits.
    pub(crate) device_composites: bool,
    pub(crate) progress: &'a Progress,
    /// Groups of discs, which serve all frames of an animation.
    pub(crate) groups: RefCell<KeptGroups>,
    engines: OpaqueEngines,
    /// Whether frames follow that ask for the same light again.
    remembers: bool,
    /// Those of the frame before it, whose memory is used again.
    before: Cell<Shaded>,
    lists: Lists,
    light_points: OnceCell<Vec<LightPoint>>,
    maps: OnceCell<Maps>,
    shaded: OnceCell<Shaded>,
    /// Splats that thick media leave something of, from which light that is too coarse is told.
    shown: OnceCell<Vec<Shown>>,
    /// Opaque splats alone, from when they were shaded until they are asked for.
    solid: Cell<Option<OpaqueImage>>,
    opaque: OnceCell<OpaqueImage>,
    /// Whether its radiance serves this picture alone: what the frame's opaque splats hide needs none then.
    is_one_picture: bool,
}

/// Groups that frames of an animation keep: of translucent discs, and of opaque ones, for an object may have both.
#[derive(Default)]
pub(crate) struct KeptGroups {
    pub(crate) translucent: GroupsOfObjects,
    pub(crate) opaque: GroupsOfObjects,
}

/// What a frame leaves for the next of the same splats.
#[derive(Default)]
pub(crate) struct Leaves {
    pub(crate) maps: Option<Maps>,
    lists: Lists,
    /// For the memory that it takes.
    shaded: Shaded,
}

impl Leaves {
    /// What serves a frame of the same splats whose lights are brighter or darker: shadow maps. Which splats are drawn may be another choice there.
    pub(crate) fn of_lights(self) -> Self {
        Self { maps: self.maps, shaded: self.shaded, lists: Lists::default() }
    }

    /// What the cells of each shadow map follow from: those whose entries were more than predicted are coarser than the plan has them.
    pub(crate) fn shadow_limits(&self, plan: &Plan) -> Vec<tsm::Limit> {
        match &self.maps {
            Some(maps) => maps.limits().chain(plan.eye_table.map(|table| table.predicted.limit)).collect(),
            None => plan.shadow_limits(),
        }
    }
}

impl<'a> Frame<'a> {
    /// A frame by the processor, with nothing made yet, whose opaque surfaces these engines draw.
    pub(crate) fn with_engines(
        scene: &'a Scene,
        loaded: &'a Loaded,
        plan: &'a Plan,
        progress: &'a Progress,
        engines: OpaqueEngines,
    ) -> Self {
        Self {
            scene,
            settings: &scene.render,
            loaded,
            plan,
            layers: scene.render.layers.set(),
            camera: loaded.camera.with_samples(scene.render.antialias),
            helper: None,
            device_composites: false,
            progress,
            groups: RefCell::default(),
            engines,
            remembers: false,
            before: Cell::default(),
            lists: Lists::default(),
            light_points: OnceCell::new(),
            maps: OnceCell::new(),
            shaded: OnceCell::new(),
            shown: OnceCell::new(),
            solid: Cell::default(),
            opaque: OnceCell::new(),
            is_one_picture: true,
        }
    }

    /// With a device that helps, and whether it composites.
    pub(crate) fn helped_by(mut self, device: Option<(&'a Helper<'a>, bool)>) -> Self {
        self.helper = device.map(|(helper, _)| helper);
        self.device_composites = device.is_some_and(|(_, composites)| composites);
        self
    }

    /// With the radiance of what opaque splats hide, too, for pictures of other views or without what hides it.
    #[must_use]
    pub fn with_hidden(mut self) -> Self {
        self.is_one_picture = false;
        self
    }

    /// With what was made for the frame before it, and whether what arrives through shadow maps is remembered.
    pub(crate) fn following(mut self, before: Leaves, remembers: bool) -> Self {
        self.maps = before.maps.map_or_else(OnceCell::new, OnceCell::from);
        self.lists = before.lists;
        self.before = Cell::new(before.shaded);
        self.remembers = remembers;
        self
    }

    /// What it leaves when it is drawn.
    pub(crate) fn leaves(self) -> Leaves {
        let maps = self.maps.into_inner();
        let shaded = self.shaded.into_inner().unwrap_or_default();
        Leaves { maps, lists: self.lists, shaded }
    }

    /// Whether there are shadow maps already.
    pub(crate) fn has_maps(&self) -> bool {
        self.maps.get().is_some()
    }

    /// What techniques draw.
    pub(crate) fn matter(&self) -> Matter<'_> {
        let Self { scene, loaded, plan, .. } = self;
        let cloud = Some(&loaded.cloud);
        Matter { scene, own: &loaded.own, planned: &plan.objects, cloud, camera: &self.camera }
    }

    /// An interrupt, if there was one.
    pub(crate) fn tick(&self) -> Result<(), Error> {
        self.progress.tick(1).map_err(|_| Error::Cancelled)
    }

    /// The numbers that a splat, or a hit, brings to a pixel.
    pub(crate) fn layout(&self) -> ChannelLayout {
        let layout = ChannelLayout::new(&self.layers);
        if self.plan.scatters_again { layout.with_multiple() } else { layout }
    }

    /// An empty accumulator of the frame's samples, with the channels that its layers need.
    pub fn accumulator(&self) -> Accumulator {
        let set = &self.layers;
        Accumulator::new(self.camera.size, self.plan.optical_depth_planes, self.layout().count(), set.depth, set.object)
    }

    /// How splats are rasterized.
    pub fn raster_params(&self) -> raster::Params {
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

    /// How far the resampling filter widens a footprint, pixels of [`Frame::camera`].
    pub fn filter_reach_px(&self) -> f64 {
        let widest = self.loaded.footprints.layers().iter().map(|f| f.cutoff).fold(0.0, f32::max);
        f64::from(widest * self.raster_params().resampling_sigma_px)
    }

    /// What is seen behind everything.
    pub fn background(&self) -> Background<'_> {
        match &self.loaded.images.environment {
            Some(environment) => Background::Environment(environment, &self.camera),
            None => Background::Color(self.scene.background),
        }
    }
}
