//! Work that is predicted from counts, for the bar: stages by name with rough seconds of one core.
//!
//! The constants are those of the benchmarks to a factor of two or so. A wrong one makes the bar uneven, no more.

use crate::load::{Loaded, SplatCount};
use crate::plan::{Plan, PlannedSampler};
use crate::points::Drawing;
use crate::scene::{Scene, SceneObject, Technique};
use crate::{escape_controls, printable};
use splat_core::{Camera, SplatKind};

/// Stages of a render beside those that are named after an object, a file or a light.
pub(crate) mod stage {
    /// Generated sources are counted.
    pub(crate) const READ: &str = "reading";
    /// What comes after loading, while nobody knows more.
    pub(crate) const DRAW: &str = "drawing";
    /// Translucent splats are culled and sliced.
    pub(crate) const SORT: &str = "sorting";
    /// Splats get their footprints.
    pub(crate) const PROJECT: &str = "projecting";
    /// Splats get their radiance.
    pub(crate) const SHADE: &str = "shading";
    /// Opaque splats are resolved.
    pub(crate) const OPAQUE: &str = "opaque surfaces";
    /// Translucent splats are composited.
    pub(crate) const COMPOSITE: &str = "compositing";
    /// Sets of particles are drawn and averaged.
    pub(crate) const PARTICLES: &str = "particles";
    /// Samples become pixels.
    pub(crate) const FINISH: &str = "finishing";
}

/// Seconds a byte of a file.
const BYTE: f64 = 2e-8;
/// Seconds to look at a generated source on a coarse lattice.
const LOOK: f64 = 2e-3;
/// Seconds a splat of each pass, and a fragment.
const CONVERT: f64 = 1e-6;
const CAST: f64 = 5e-7;
const SORT: f64 = 1e-7;
const PROJECT: f64 = 1e-7;
const SHADE: f64 = 1e-7;
const LOOK_UP: f64 = 2e-7;
const FRAGMENT: f64 = 5e-9;
/// Seconds a sample of the picture, and one of a set of particles.
const SAMPLE: f64 = 5e-8;
const SET: f64 = 4e-7;
/// Splats whose footprints stand for all.
const LOOKED_AT: usize = 4096;

/// Stages with their weights.
pub(crate) type Stages = Vec<(String, f64)>;

/// The stage of reading an object; `None` for one that reads no file.
pub(crate) fn reading(object: &SceneObject) -> Option<String> {
    object.source.path().map(|path| format!("reading {}", printable(path)))
}

/// The stage of converting an object.
pub(crate) fn converting(name: &str) -> String {
    format!("converting {}", escape_controls(name))
}

/// The stage of one of the shadow maps, counted from 1.
pub(crate) fn shadow_map(k: usize, of: usize) -> String {
    format!("shadow map {k} of {of}")
}

/// Before anything is read. What comes after is unknown but at least as much.
pub(crate) fn of_scene(scene: &Scene) -> Stages {
    let objects = || scene.objects.iter().filter(|o| o.visible);
    let generated = objects().filter(|o| o.source.path().is_none()).count() as f64 * LOOK;
    let bytes = |o: &SceneObject| {
        let path = o.source.path()?;
        Some(std::fs::metadata(path).map_or(0.0, |m| m.len() as f64))
    };
    let mut stages = vec![(stage::READ.to_owned(), generated)];
    stages.extend(objects().filter_map(|o| Some((reading(o)?, BYTE * bytes(o)?))));
    let reading: f64 = stages.iter().map(|s| s.1).sum();
    stages.push((stage::DRAW.to_owned(), 2.0 * reading + samples(scene) * SAMPLE));
    stages
}

/// After everything was read and counted.
pub(crate) fn of_counts(scene: &Scene, splats: &[SplatCount], planned: &[PlannedSampler], lights: usize) -> Stages {
    let converted = splats.iter().zip(planned).filter(|(_, plan)| plan.splats.is_some());
    let mut stages: Stages = converted.map(|(s, _)| (converting(&s.object), CONVERT * s.predicted as f64)).collect();
    let all: f64 = splats.iter().map(|s| s.predicted as f64).sum();
    let drawn = all * (SORT + PROJECT + SHADE + 20.0 * FRAGMENT + lights as f64 * (CAST + LOOK_UP));
    stages.push((stage::DRAW.to_owned(), drawn + sets(scene) + samples(scene) * SAMPLE));
    stages
}

/// After everything was loaded: the passes of the plan.
pub(crate) fn of_passes(drawing: &Drawing<'_>, scene: &Scene) -> Stages {
    let (loaded, plan) = (drawing.loaded, drawing.plan);
    let camera = drawing.sample_camera();
    let maps = plan.shadow_maps.iter().filter(|on| **on).count();
    let all = loaded.cloud.len() as f64;
    let (opaque, translucent) = (Count::of(loaded, &camera, true), Count::of(loaded, &camera, false));
    let mut stages: Stages = (1..=maps).map(|k| (shadow_map(k, maps), CAST * all)).collect();
    let mut add = |name: &str, seconds: f64| stages.push((name.to_owned(), seconds));
    let by_particles = scene.render.technique == Technique::Particles;
    let drawn = if by_particles { opaque.splats } else { all };
    if !by_particles {
        add(stage::SORT, SORT * translucent.splats);
    }
    add(stage::PROJECT, PROJECT * drawn);
    add(stage::SHADE, drawn * (SHADE + maps as f64 * LOOK_UP));
    add(stage::OPAQUE, FRAGMENT * opaque.fragments);
    if by_particles {
        add(stage::PARTICLES, if has_particles(plan) { sets(scene) } else { 0.0 });
    } else {
        add(stage::COMPOSITE, FRAGMENT * translucent.fragments);
    }
    add(stage::FINISH, samples(scene) * SAMPLE);
    stages
}

fn has_particles(plan: &Plan) -> bool {
    plan.passes.iter().any(|p| p.name == crate::plan::pass::PARTICLES)
}

fn samples(scene: &Scene) -> f64 {
    scene.camera.size.iter().map(|s| f64::from(*s * scene.render.antialias)).product()
}

fn sets(scene: &Scene) -> f64 {
    match scene.render.technique {
        Technique::Particles => SET * samples(scene) * f64::from(scene.render.particles.repeat_level),
        Technique::Auto | Technique::Points => 0.0,
    }
}

/// Splats of a kind and the fragments of their footprints.
struct Count {
    splats: f64,
    fragments: f64,
}

impl Count {
    /// From splats at even distances in the list.
    fn of(loaded: &Loaded, camera: &Camera, opaque: bool) -> Self {
        let cloud = &loaded.cloud;
        let (place, focal) = (camera.view_from_offset(cloud.origin), camera.focal_px());
        let picture = camera.size.iter().map(|s| f64::from(*s)).product::<f64>();
        let footprint = |i: usize| {
            let p = place.apply(cloud.position[i]).as_dvec3();
            let near = if camera.is_orthographic() { 1.0 } else { p.z.max(f64::from(cloud.radius[i])) };
            let radius = focal * f64::from(cloud.radius[i]) / near;
            let at = |v: f64| (focal * v / near).abs() - radius;
            let half = camera.size.map(|s| 0.5 * f64::from(s));
            let seen = p.z > 0.0 && at(p.x) < half[0] && at(p.y) < half[1];
            if seen { (std::f64::consts::PI * radius * radius).clamp(4.0, picture) } else { 0.0 }
        };
        let stride = cloud.len().div_ceil(LOOKED_AT).max(1);
        let (mut splats, mut fragments) = (0.0, 0.0);
        for i in (0..cloud.len()).step_by(stride).filter(|i| (cloud.kind[*i] == SplatKind::Opaque) == opaque) {
            splats += stride as f64;
            fragments += stride as f64 * footprint(i);
        }
        Self { splats, fragments }
    }
}
