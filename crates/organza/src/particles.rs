//! The `particles` technique (Tanaka 2012): translucent things become sets of opaque particles, each set is drawn by depth
//! alone, and the pictures are averaged. Nothing is sorted.
//!
//! Splats are the particles' source: a splat of cross-section K gives a Poisson number of particles distributed as its
//! kernel, so that its optical depth is that of the `points` technique. Opaque surfaces are drawn exactly and hide particles
//! behind them. Light comes from the same shadow maps.

use crate::load::Loaded;
use crate::plan::pass;
use crate::points::Drawing;
use crate::scene::ParticlesSettings;
use crate::{Error, RenderOptions};
use pbsr::{
    Appearance, Ensemble, EnsembleParams, FoldParams, LitBy, Object, Occluder, Renderer, Scene, SplatParams,
    SplatSampler,
};
use splat_core::raster::{self, Background, OpaqueImage};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, Cloud, CostRecord, LayerData, Layers, Similarity, SplatKind, rng};
use std::collections::BTreeMap;
use tsm::ShadowMap;

/// Stage of the random numbers that seed the objects.
const SEEDS: u64 = 0x7061_7274;
/// Depth, in radii of an object, nearer than which particles are widened rather than made finer.
const NEAR: f64 = 0.5;
/// Sets between two looks at the error.
const BATCH: u32 = 8;
/// Optical depth of a pixel that particles hide in every set.
const HIDDEN: f32 = 64.0;
/// Share of the allowed memory that the particles of one batch may take.
const BATCH_SHARE: u64 = 4;

/// The translucent splats of one object.
struct Part {
    cloud: Cloud,
    look: Appearance,
    params: SplatParams,
}

/// Runs the planned passes.
pub(crate) fn draw(drawing: &Drawing<'_>, options: &RenderOptions, cost: &mut CostRecord) -> Result<Layers, Error> {
    let maps = drawing.shadow_maps(cost)?;
    let camera = drawing.sample_camera();
    let layout = ChannelLayout::new(&drawing.layers);
    let opaque = opaque(drawing, &maps, &camera, cost)?;
    let parts = parts(drawing, &camera);
    let mut accumulator = Accumulator::new(camera.size, 1, layout.count(), false, false);
    let wanted = drawing.settings.layers.names().any(|name| name == "std_error");
    let mut std_error = Vec::new();
    if !parts.is_empty() {
        let occluder = occluder(&opaque, &layout);
        let ensemble = cost.measure(pass::PARTICLES, |stage| {
            let (ensemble, particles) = fold(drawing, &parts, &maps, &camera, occluder.as_ref(), options)?;
            stage.items_in = parts.iter().map(|p| p.cloud.len() as u64).sum();
            stage.items_out = particles;
            stage.bytes = ensemble.bytes();
            Ok::<_, Error>(ensemble)
        })?;
        accumulate(&ensemble, &layout, &mut accumulator);
        if wanted {
            std_error = error_layer(&ensemble, drawing, occluder.as_ref());
        }
    }
    cost.measure(pass::FINISH, |stage| {
        stage.items_in = u64::from(camera.size[0]) * u64::from(camera.size[1]);
        let background = Background { color: drawing.background };
        let (set, antialias) = (&drawing.layers, drawing.settings.antialias);
        let mut layers = raster::finish(&accumulator, &opaque, &background, &layout, set, antialias);
        if wanted {
            // Without particles there is no noise.
            std_error.resize(layers.size.iter().map(|s| *s as usize).product(), 0.0);
            layers.insert("std_error", LayerData::Scalar(std_error));
        }
        Ok(layers)
    })
}

/// The opaque splats alone, by the rasterizer.
fn opaque(
    drawing: &Drawing<'_>,
    maps: &[Option<ShadowMap>],
    camera: &Camera,
    cost: &mut CostRecord,
) -> Result<OpaqueImage, Error> {
    let ids = drawing.ids(|kind| kind == SplatKind::Opaque);
    if ids.is_empty() {
        return Ok(OpaqueImage::default());
    }
    let all = drawing.loaded;
    let loaded = Loaded {
        cloud: all.cloud.gather(&ids),
        materials: all.materials.clone(),
        objects: all.objects.clone(),
        footprints: all.footprints.clone(),
        lights: all.lights.clone(),
        casts: all.casts.clone(),
        splats: Vec::new(),
        warnings: Vec::new(),
        ..*all
    };
    let solid = Drawing { loaded: &loaded, layers: drawing.layers.clone(), ..*drawing };
    let shaded = solid.light(maps, camera, cost)?;
    solid.opaque(&shaded, cost)
}

/// What hides particles, with its beauty.
fn occluder(opaque: &OpaqueImage, layout: &ChannelLayout) -> Option<Occluder> {
    if opaque.depth.is_empty() {
        return None;
    }
    let color =
        |k: usize| std::array::from_fn(|c| layout.effects().map(|first| opaque.channels[first + c][k]).sum::<f32>());
    Some(Occluder { depth: opaque.depth.clone(), color: (0..opaque.depth.len()).map(color).collect() })
}

/// Translucent splats by object; an object has one material and one kind of translucent splats.
fn parts(drawing: &Drawing<'_>, camera: &Camera) -> Vec<Part> {
    let Loaded { cloud, objects, materials, footprints, .. } = drawing.loaded;
    let mut of_object: BTreeMap<(u32, bool), Vec<u32>> = BTreeMap::new();
    for i in drawing.ids(|kind| kind != SplatKind::Opaque) {
        let k = i as usize;
        if cloud.cross_section[k] > 0.0 {
            of_object.entry((cloud.object[k], cloud.kind[k] == SplatKind::Surface)).or_default().push(i);
        }
    }
    let part = |((object, _), ids): ((u32, bool), Vec<u32>)| {
        let first = ids[0] as usize;
        let kind = cloud.kind[first];
        let own = cloud.gather(&ids);
        let material = materials[cloud.material[first] as usize];
        let radius = own.radius.iter().map(|r| f64::from(*r)).sum::<f64>() / own.len() as f64;
        let bounds = own.bounds();
        let center = own.origin + bounds.center().as_dvec3();
        let reach = 0.5 * f64::from(bounds.diagonal()) + radius;
        let params = SplatParams {
            cross_section: pbsr::finest_pixel_area(camera, center, reach, NEAR),
            surface_opacity: material.surface_opacity,
            footprints: footprints.clone(),
            seed: rng::bits(drawing.settings.seed, SEEDS, u64::from(object), kind as u64),
            ..SplatParams::default()
        };
        let shadow_coefficient = objects[object as usize].shadow_coefficient * cloud.shadow_coefficient_of(first);
        let look = Appearance { material, kind, radius: radius as f32, shadow_coefficient };
        Part { cloud: own, look, params }
    };
    of_object.into_iter().map(part).collect()
}

/// Folds sets until there are as many as asked for, or the error is small enough.
fn fold(
    drawing: &Drawing<'_>,
    parts: &[Part],
    maps: &[Option<ShadowMap>],
    camera: &Camera,
    occluder: Option<&Occluder>,
    options: &RenderOptions,
) -> Result<(Ensemble, u64), Error> {
    let samplers =
        parts.iter().map(|p| SplatSampler::new(&p.cloud, &p.params)).collect::<Result<Vec<_>, _>>().map_err(fault)?;
    let mut objects = Vec::with_capacity(parts.len());
    for (part, sampler) in parts.iter().zip(&samplers) {
        objects.push(Object { sampler, transform: Similarity::default(), look: part.look });
    }
    let origin = drawing.loaded.cloud.origin;
    let lit = drawing.shining(maps).map(|(light, map)| LitBy { light, shadow: map.map(|m| (m, origin)) });
    let lights: Vec<LitBy<'_>> = lit.collect();
    let scene = Scene { objects: &objects, lights: &lights, ambient: drawing.ambient, camera, occluder };
    let set = &drawing.layers;
    let kept = EnsembleParams {
        effects: set.effects,
        normal: set.normal,
        shadow: set.shadow,
        depth_range: None,
        radiance_unit: 0.0,
    };
    let mut ensemble = Ensemble::new(camera.size, &kept).map_err(fault)?;
    let params = FoldParams { max_bytes: options.max_memory / BATCH_SHARE, ..FoldParams::default() };
    let ParticlesSettings { repeat_level, target_error } = drawing.settings.particles;
    let background = |_, _| drawing.background;
    let mut renderer = Renderer::new();
    let mut particles = 0;
    while ensemble.levels() < repeat_level {
        let step = if target_error.is_some() { BATCH } else { repeat_level };
        let levels = step.min(repeat_level - ensemble.levels());
        let counts = renderer.fold(&scene, &mut ensemble, levels, &params, drawing.progress).map_err(fault)?;
        particles += counts.particles;
        let reached =
            |target: f64| ensemble.rms_error(&background, occluder) / f64::from(drawing.settings.antialias) <= target;
        if target_error.is_some_and(reached) {
            break;
        }
    }
    Ok((ensemble, particles))
}

/// Means over the sets as what translucent splats leave in an accumulator.
fn accumulate(ensemble: &Ensemble, layout: &ChannelLayout, accumulator: &mut Accumulator) {
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    let alpha = layers.scalar("alpha").expect("invariant: an ensemble has an opacity");
    for (to, a) in accumulator.optical_depth[0].iter_mut().zip(alpha) {
        *to = (-(-a).ln_1p()).min(HIDDEN);
    }
    let mut put = |first: usize, name: &str, weighted: bool| {
        let image = layers.rgb(name).expect("invariant: an ensemble keeps the layers of its channels");
        for c in 0..3 {
            for (k, to) in accumulator.channels[first + c].iter_mut().enumerate() {
                *to = image[k][c] * if weighted { alpha[k] } else { 1.0 };
            }
        }
    };
    let effects: Vec<usize> = layout.effects().collect();
    if let [beauty] = effects[..] {
        put(beauty, "beauty", false);
    } else {
        effects.iter().zip(["ambient", "emission", "direct"]).for_each(|(first, name)| put(*first, name, false));
    }
    if let Some(first) = layout.normal() {
        put(first, "normal", true);
    }
    if let Some(at) = layout.shadow() {
        let shadow = layers.scalar("shadow").expect("invariant: an ensemble keeps the layers of its channels");
        accumulator.channels[at].iter_mut().enumerate().for_each(|(k, to)| *to = shadow[k] * alpha[k]);
    }
}

/// Standard error of each pixel's luminance: that of the mean of its independent samples.
fn error_layer(ensemble: &Ensemble, drawing: &Drawing<'_>, occluder: Option<&Occluder>) -> Vec<f32> {
    let layers = ensemble.read(&|_, _| drawing.background, occluder);
    let samples = layers.scalar("std_error").expect("invariant: an ensemble has an error");
    let antialias = drawing.settings.antialias as usize;
    let [width, height] = ensemble.size().map(|s| s as usize / antialias);
    let pixel = |k: usize| {
        let (x, y) = (k % width * antialias, k / width * antialias);
        let square = |s: usize| {
            let at = (y + s / antialias) * width * antialias + x + s % antialias;
            samples[at] * samples[at]
        };
        (0..antialias * antialias).map(square).sum::<f32>().sqrt() / (antialias * antialias) as f32
    };
    (0..width * height).map(pixel).collect()
}

fn fault(error: pbsr::Error) -> Error {
    match error {
        pbsr::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        pbsr::Error::TooMuch { what, needed, had } => Error::Limit {
            what: what.into(),
            needed,
            limit: had,
            unit: "bytes",
            hint: "use a smaller image or render.antialias, or a larger --max-memory".into(),
        },
        other => Error::Internal(other.to_string()),
    }
}
