//! The peak memory of a render, counted before it begins.

use crate::Error;
use crate::load::own::Own;
use crate::load::{BYTES_PER_LATTICE_POINT, BYTES_PER_SPLAT, Loaded};
use crate::scene::Scene;
use splat_core::raster;
use splat_core::shade::ChannelLayout;
use splat_core::{Camera, DepthProfile, Exceeded, Grid};

/// Bytes of a render by what takes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Memory {
    /// Accumulators and layers.
    pub(crate) image: u64,
    /// Splats, and what is made for each.
    pub(crate) splats: u64,
    /// Objects that particles are sampled from as they are.
    pub(crate) native: u64,
    /// The environment, what lights shine through, and heights of bumps.
    pub(crate) images: u64,
    /// Averaging sets of particles.
    pub(crate) average: u64,
    /// All shadow maps, the largest of them being built.
    pub(crate) maps: u64,
}

impl Memory {
    /// That of a loaded scene without shadow maps, `average` by its particles.
    pub(crate) fn new(scene: &Scene, loaded: &Loaded, average: u64) -> Self {
        let camera = loaded.camera.with_samples(scene.render.antialias);
        Self {
            image: image_bytes(scene),
            splats: splat_bytes(loaded, &camera, layout(scene)),
            native: own_bytes(loaded),
            images: loaded.images.bytes(),
            average,
            maps: 0,
        }
    }

    /// The same with shadow maps of these bytes.
    pub(crate) fn with_maps(self, maps: u64) -> Self {
        Self { maps, ..self }
    }

    /// All of it.
    pub(crate) fn total(&self) -> u64 {
        let others = [self.splats, self.native, self.images, self.average, self.maps];
        others.into_iter().fold(self.image, u64::saturating_add)
    }
}

/// The channels that a render has at most.
pub(crate) fn layout(scene: &Scene) -> ChannelLayout {
    let layout = ChannelLayout::new(&scene.render.layers.set());
    if scene.render.sheets.scattering().is_some() { layout.with_multiple() } else { layout }
}

/// Bytes of the accumulators and layers.
pub(crate) fn image_bytes(scene: &Scene) -> u64 {
    let set = scene.render.layers.set();
    let pixels = scene.camera.pixels();
    let samples = scene.camera.with_samples(scene.render.antialias).pixels();
    let channels = 4 * layout(scene).count() as u64;
    let profile = if set.depth { size_of::<DepthProfile>() as u64 } else { 0 };
    // Up to three optical depths, and an object.
    let accumulated = channels + 4 * 3 + profile + 4;
    // What lies behind, where particles are averaged until their error is small.
    let behind = if scene.render.particles.target_error.is_some() { 12 } else { 0 };
    // The opaque image and its depths, the accumulator, and a second one: a copy in tiles, or a segment of particles.
    let sample = channels + 4 * 2 + 2 * accumulated + behind;
    samples * sample + pixels * (2 * channels + 4 * 10)
}

/// Bytes that loading takes, or asks for before it knows: while objects are made one cloud, the `inputs` that were read and two
/// of each splat are there; before, each splat that was counted may take its most.
pub(crate) fn loading_bytes(loaded: &Loaded, inputs: u64) -> u64 {
    let counted: u64 = loaded.splats.iter().map(|s| s.predicted.max(s.made)).sum();
    // Lattices that are made of objects are held to as much as their splats could take.
    let points = loaded.own.iter().filter_map(Own::grid).map(|grid| grid.values.len() as u64).max().unwrap_or(0);
    let made = counted.saturating_mul(BYTES_PER_SPLAT).max(points.saturating_mul(BYTES_PER_LATTICE_POINT));
    inputs.saturating_add((2 * loaded.cloud.bytes()).max(made))
}

/// Bytes of what is made for each splat: its attributes, order, footprint, tile entries and values.
fn splat_bytes(loaded: &Loaded, camera: &Camera, layout: ChannelLayout) -> u64 {
    let values = 4 * layout.count() as u64;
    loaded.cloud.bytes() + loaded.cloud.len() as u64 * (8 + 64 + values) + raster::tile_bytes(&loaded.cloud, camera)
}

/// Bytes of what particles are sampled from, files that objects share once, and of the tables for that.
fn own_bytes(loaded: &Loaded) -> u64 {
    let mut grids: Vec<*const Grid> = Vec::new();
    let native_bytes = |native: &Own| {
        let known = native.grid().is_some_and(|grid| {
            let at = std::ptr::from_ref(grid);
            let known = grids.contains(&at);
            grids.push(at);
            known
        });
        native.table_bytes + if known { 0 } else { native.bytes() }
    };
    loaded.own.iter().map(native_bytes).sum()
}

/// Refuses what needs more than the limit.
pub(crate) fn check(what: &str, needed: u64, limit: u64) -> Result<(), Error> {
    let hint = "use fewer lights or samples of lights, a larger spacing, a smaller image, or a larger --max-memory";
    Exceeded::check(what.to_owned(), needed, limit, "bytes", hint).map_err(Error::Limit)
}
