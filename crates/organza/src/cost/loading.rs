//! Counted work of loading: bytes of files, objects that are generated, splats that are converted.

use super::{Count, CountedPass, Item, OwnWork, Translucent};
use crate::form::PlannedObject;
use crate::scene::{Scene, SceneObject};
use crate::{SplatCount, escape_controls, pass, printable, stage};
use std::path::Path;

/// Fragments of a splat of middling size, before splats are there to be measured.
const FRAGMENTS_OF_SPLAT: f64 = 20.0;

/// Slabs of a volume of middling size, before one is there to be measured.
const SLABS: f64 = 100.0;

/// The stage of reading an object; `None` for one that reads no file.
pub(crate) fn reading(object: &SceneObject) -> Option<String> {
    object.source.path().map(reading_file)
}

/// The stage of reading a file.
pub(crate) fn reading_file(path: &Path) -> String {
    format!("reading {}", printable(path))
}

/// The stage of converting an object.
pub(crate) fn converting(name: &str) -> String {
    format!("converting {}", escape_controls(name))
}

/// Samples of the picture.
pub(crate) fn samples(scene: &Scene) -> f64 {
    scene.camera.with_samples(scene.render.antialias).pixels() as f64
}

/// Work of reading. Drawing follows as one stage with the least that is known of it: as much as twice the reading, the samples of the
/// picture, and what techniques make `beside` splats.
pub(crate) fn before_reading(scene: &Scene, beside: &[Count]) -> Vec<CountedPass> {
    let objects = || scene.objects.iter().filter(|o| o.visible);
    let read = |stage: String, path: &Path| {
        let bytes = std::fs::metadata(path).map_or(0.0, |file| file.len() as f64);
        CountedPass::new(pass::READ, stage, vec![Count::new(Item::FileByte, bytes)])
    };
    let generated = objects().filter(|o| o.source.path().is_none()).count() as f64;
    let mut passes =
        vec![CountedPass::new(pass::READ, stage::READ.to_owned(), vec![Count::new(Item::GeneratedObject, generated)])];
    passes.extend(objects().filter_map(|o| Some(read(reading(o)?, o.source.path()?))));
    passes.extend(scene.images().map(|path| read(reading_file(path), path)));
    let mut rest: Vec<Count> = passes.iter().flat_map(|pass| pass.counts.clone()).collect();
    rest.iter_mut().for_each(|count| count.number *= 2.0);
    rest.push(Count::new(Item::FinishedSample, samples(scene)));
    rest.extend(beside);
    passes.push(CountedPass::new(pass::FINISH, stage::DRAW.to_owned(), rest));
    passes
}

/// Work of conversion, after everything was read and counted. Drawing follows as one stage: the splats by the points of lights, and what
/// techniques make `beside` splats.
pub(crate) fn before_conversion(
    scene: &Scene,
    splats: &[SplatCount],
    planned: &[PlannedObject],
    light_points: usize,
    beside: &[Count],
) -> Vec<CountedPass> {
    let converted = splats.iter().zip(planned).filter(|(_, plan)| plan.splats.is_some());
    let convert = |(s, _): (&SplatCount, _)| {
        let counts = vec![Count::new(Item::of_conversion(s.conversion), s.predicted as f64)];
        CountedPass::new(pass::CONVERT, converting(&s.object), counts)
    };
    let mut passes: Vec<CountedPass> = converted.map(convert).collect();
    let number: f64 = splats.iter().map(|s| s.predicted as f64).sum();
    let lit = number * light_points as f64;
    let mut drawn = vec![
        Count::new(Item::SortedSplat, number),
        Count::new(Item::ProjectedSplat, number),
        Count::new(Item::ShadedSplat, number),
        Count::new(Item::BlendedFragment, FRAGMENTS_OF_SPLAT * number),
        Count::new(Item::CastSplat, lit),
        Count::new(Item::ShadowLookUp, lit),
        Count::new(Item::FinishedSample, samples(scene)),
    ];
    drawn.extend(beside);
    passes.push(CountedPass::new(pass::SPLAT, stage::DRAW.to_owned(), drawn));
    passes
}

impl Translucent {
    /// Unknown, but there, before anything is converted: about as much as fills the picture, in particles of a set and in slabs.
    pub(crate) fn unknown(scene: &Scene) -> Self {
        let samples = samples(scene);
        let own_work = OwnWork { items: samples, slab_samples: SLABS * samples, ..OwnWork::default() };
        Self { splats: 0.0, fragments: 0.0, own_work, ranges: 1.0, any: true }
    }
}
