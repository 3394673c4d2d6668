//! The `particles` technique (Tanaka 2012): translucent things become sets of opaque particles, each set is drawn by depth
//! alone, and the pictures are averaged. Nothing is sorted.
//!
//! Splats are the particles' source: a splat of cross-section K gives a Poisson number of particles distributed as its
//! kernel, so that its optical depth is that of the `points` technique. Opaque surfaces are drawn exactly and hide particles
//! behind them. Light comes from the same shadow maps.

mod checkpoint;
mod ensemble;
mod kept;
mod layers;
mod parts;

use crate::plan::pass;
use crate::points::Drawing;
use crate::scene::Scene;
use crate::{Error, RenderOptions, Sets, work};
pub(crate) use checkpoint::Checkpoint;
pub(crate) use ensemble::average_bytes;
use ensemble::fold;
pub(crate) use kept::Kept;
use layers::{OfHits, accumulate};
use parts::sources;
use pbsr::Occluder;
use splat_core::raster::{self, Background, OpaqueImage};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, CostRecord, LayerData, Layers};

/// Runs the planned passes. An interrupt after two sets leaves the picture of the sets so far.
pub(crate) fn draw(
    drawing: &Drawing<'_>,
    scene: &Scene,
    options: &RenderOptions,
    checkpoint: Option<&mut Checkpoint>,
    mut kept: Option<&mut Kept>,
    cost: &mut CostRecord,
    warnings: &mut Vec<String>,
) -> Result<(Layers, Option<Sets>), Error> {
    let maps = drawing.shadow_maps(cost)?;
    let camera = drawing.sample_camera();
    let layout = ChannelLayout::new(&drawing.layers);
    let opaque = drawing.solid(&maps, &camera, cost)?;
    let mut sources = sources(drawing, &camera);
    if let Some(kept) = kept.as_deref_mut() {
        kept.sample(&mut sources, drawing, scene, cost, warnings)?;
    }
    let parts = match kept {
        Some(kept) => kept.parts(&sources, warnings)?,
        None => sources.iter().filter_map(|s| s.part(warnings).transpose()).collect::<Result<_, _>>()?,
    };
    let set = &drawing.layers;
    let wanted = drawing.settings.layers.names().any(|name| name == "std_error");
    // Where there are particles, their hits say where light is absorbed and by whom.
    let by_splats = parts.is_empty();
    let (planes, count) = (drawing.plan.optical_depth_planes, layout.count());
    let (depths, objects) = (set.depth && by_splats, set.object && by_splats);
    let mut accumulator = Accumulator::new(camera.size, planes, count, depths, objects);
    let (mut of_hits, mut sets) = (Vec::new(), None);
    if !by_splats {
        let occluder = occluder(&opaque, &layout);
        let average = cost.measure(pass::PARTICLES, |stage| {
            let average = fold(drawing, &parts, &maps, &camera, occluder.as_ref(), options, checkpoint)?;
            stage.items_in = parts.len() as u64;
            stage.items_out = average.particles;
            stage.bytes = average.ensemble.bytes();
            Ok::<_, Error>(average)
        })?;
        accumulate(&average.ensemble, &layout, &mut accumulator);
        if wanted || set.depth || set.object {
            let (ensemble, occluder) = (&average.ensemble, occluder.as_ref());
            of_hits = OfHits { ensemble, parts: &parts, occluder, opaque: &opaque }.layers(drawing, wanted);
        }
        let asked = drawing.settings.particles.repeat_level;
        sets = Some(Sets { averaged: average.ensemble.levels(), asked, interrupted: average.interrupted });
    }
    drawing.progress.begin(work::stage::FINISH);
    cost.measure(pass::FINISH, |stage| {
        stage.items_in = u64::from(camera.size[0]) * u64::from(camera.size[1]);
        let background = Background { color: drawing.background };
        let mut layers = raster::finish(&accumulator, &opaque, &background, &layout, set, drawing.settings.antialias);
        if wanted {
            // Without particles there is no noise.
            let none = vec![0.0; layers.size.iter().map(|s| *s as usize).product()];
            layers.insert("std_error", LayerData::Scalar(none));
        }
        of_hits.into_iter().for_each(|(name, data)| layers.insert(name, data));
        Ok((layers, sets))
    })
}

/// What hides particles, with its beauty.
fn occluder(opaque: &OpaqueImage, layout: &ChannelLayout) -> Option<Occluder> {
    if opaque.depth.is_empty() {
        return None;
    }
    let color = |k: usize| {
        std::array::from_fn(|c| layout.effects().map(|(_, first)| opaque.channels[first + c][k]).sum::<f32>())
    };
    Some(Occluder { depth: opaque.depth.clone(), color: (0..opaque.depth.len()).map(color).collect() })
}

/// What went wrong with the particles of the named object or objects: a limit, or data that samplers do not take. They are
/// refused by the samplers' own checks, so that it is never the program's fault.
fn refuse(whose: &str, error: pbsr::Error) -> Error {
    match error {
        pbsr::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        pbsr::Error::TooMuch { what, needed, had, unit } => Error::Limit {
            what: format!("{whose}: {what}"),
            needed,
            limit: had,
            unit,
            hint: "use a lower extinction or opacity, a smaller image or render.antialias, or a larger --max-memory"
                .into(),
        },
        pbsr::Error::Field { .. } => Error::input(
            whose,
            error.to_string(),
            "use a smaller box, or an expression that is finite everywhere in it",
        ),
        other => {
            Error::input(whose, other.to_string(), "use sizes, places, extinctions and opacities within its reach")
        }
    }
}

fn fault(error: pbsr::Error) -> Error {
    match error {
        pbsr::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        other => Error::Internal(other.to_string()),
    }
}
