//! The `particles` technique (Tanaka 2012): translucent things become sets of opaque particles, each set is drawn by depth
//! alone, and the pictures are averaged. Nothing is sorted.
//!
//! Particles come from an object's own data where there is a sampler for it: lines through a field, triangles, the cells of a
//! volume. Raw points, and what must be splats for another reason, are sampled splat by splat: one of cross-section K gives a
//! Poisson number of particles distributed as its kernel, so that its optical depth is that of the `points` technique. Opaque
//! surfaces are drawn exactly and hide particles behind them. Light comes from the same shadow maps.
//!
//! An average is a segment of its own: what lies in a range of depths hides what lies behind it as its mean opacity does, for
//! the particles of two ranges are independent.

mod checkpoint;
mod ensemble;
mod form;
mod kept;
mod parts;
mod unit;

use crate::cost::{Count, Item, Translucent, samples};
use crate::frame::Frame;
use crate::load::Loaded;
use crate::load::own::{Body, Own};
use crate::pass;
use crate::scene::{Scene, Source as SceneSource, SurfaceSampler, Technique};
use crate::technique::{EVERYWHERE, Finished, Fold, OwnWork, Session};
use crate::{CostRecord, Error, RenderOptions, Sets, stage};
pub(crate) use checkpoint::Checkpoint;
use ensemble::{Average, average_bytes, fold, fold_params};
pub(crate) use form::form;
pub(crate) use kept::Kept;
use parts::{Part, Source, sources};
use pbsr::LineParams;
use splat_core::raster::OpaqueImage;
use splat_core::{Accumulator, Interpolation, LayerData};
use std::ops::Range;

/// Particles and samples of all sets.
pub(crate) fn counts(scene: &Scene, translucent: &Translucent) -> Vec<Count> {
    let sets = f64::from(scene.render.particles.repeat_level);
    let is_there = f64::from(u8::from(translucent.any));
    let OwnWork { items, particles, .. } = translucent.own_work;
    vec![
        Count::new(Item::Particle, items * sets),
        Count::new(Item::CellParticle, particles.in_cells * sets),
        Count::new(Item::FieldParticle, particles.in_fields * sets),
        Count::new(Item::LatticeParticle, particles.in_lattices * sets),
        Count::new(Item::CubicParticle, particles.in_cubics * sets),
        Count::new(Item::ScatteredParticle, particles.in_points * sets),
        Count::new(Item::SetSample, samples(scene) * sets * translucent.ranges * is_there),
    ]
}

/// Voxels of the volumes that particles are sampled from, of which samplers look at all for those that matter, and cells in which they search for surfaces
/// through scattered points.
pub(crate) fn counts_preparing(scene: &Scene, loaded: &Loaded) -> Vec<Count> {
    let natives = || loaded.own.iter().filter(|native| native.technique == Technique::Particles);
    let voxels = natives().filter_map(Own::grid).map(|grid| grid.values.len() as f64).sum();
    let cells = |native: &Own| match &native.body {
        Body::Surface { spacing, .. } if is_scattered(scene, native.object) => {
            f64::from(LineParams::for_spacing(native.bounds.size().max_element(), *spacing).resolution).powi(3)
        }
        _ => 0.0,
    };
    vec![Count::new(Item::SurveyedVoxel, voxels), Count::new(Item::SearchedCell, natives().map(cells).sum())]
}

/// Whether an object is a surface through scattered points.
fn is_scattered(scene: &Scene, object: usize) -> bool {
    matches!(scene.objects[object].source, SceneSource::LevelSet(_))
}

/// Bytes of averaging the picture of a scene.
pub(crate) fn bytes(scene: &Scene, colored_extinction: bool, options: &RenderOptions) -> u64 {
    let size = scene.camera.size.map(|s| u64::from(s) * u64::from(scene.render.antialias));
    average_bytes(size, &scene.render.layers.set(), colored_extinction, options)
}

/// Begins a frame.
pub(crate) fn begin<'a>(frame: &'a Frame<'a>) -> Box<dyn Fold + 'a> {
    Box::new(Particles { frame, parts: None, average: None })
}

/// What particles are sampled from, and what they left.
struct Particles<'a> {
    frame: &'a Frame<'a>,
    /// Once they were prepared.
    parts: Option<Vec<Part<'a>>>,
    /// The sets of the last range.
    average: Option<Average>,
}

impl Particles<'_> {
    /// Adds the particles of a set of one part, by what they are found in.
    fn add(&self, part: &Part<'_>, work: &mut OwnWork) {
        let number = part.object().sampler.expected_particles();
        let native = self.frame.loaded.own.iter().find(|native| native.object as u32 == part.object);
        let is_scattered = is_scattered(self.frame.scene, part.object as usize);
        match native.map(|native| &native.body) {
            Some(Body::Cells { .. }) => work.particles.in_cells += number,
            Some(Body::Lattice { interpolation: Interpolation::CatmullRom, .. }) => work.particles.in_cubics += number,
            Some(Body::Lattice { .. }) => work.particles.in_lattices += number,
            Some(Body::Surface { .. }) if is_scattered => work.particles.in_points += number,
            Some(Body::Surface { .. }) => work.particles.in_fields += number,
            _ => work.items += number,
        }
    }
}

impl Fold for Particles<'_> {
    fn prepare(&mut self, session: &mut Session<'_>, cost: &mut CostRecord) -> Result<(), Error> {
        self.parts = Some(parts(self.frame, session, cost)?);
        Ok(())
    }

    /// Refuses sets of more particles than may be in memory. Surfaces by Brownian motion are not asked: it counts by a run as long as some sets.
    fn check(&mut self, options: &RenderOptions, cost: &mut CostRecord) -> Result<(), Error> {
        if matches!(self.frame.settings.particles.surface_sampler, SurfaceSampler::Brownian { .. }) {
            return Ok(());
        }
        // Drawing tells them.
        let mut warnings = Vec::new();
        let made = prepared(self.frame, sources(self.frame), None, &mut warnings, cost)?;
        let parts: Vec<&Part<'_>> = made.iter().collect();
        let expected = parts.iter().map(|part| part.object().sampler.expected_particles()).sum();
        fold_params(options).check_set(expected).map_err(|e| refuse(&parts::named(&parts), e))?;
        self.parts = Some(made);
        Ok(())
    }

    /// Every range samples whole sets of the objects that reach into it, and is passed over without any.
    fn own_work(&self, ranges: &[Range<f32>]) -> OwnWork {
        let parts = self.parts.as_deref().unwrap_or_default();
        let mut work = OwnWork::default();
        let mut drawn = 0;
        for range in ranges {
            let inside = parts.iter().filter(|part| part.reaches(range, &self.frame.camera));
            let before = work.items + work.particles.sum();
            inside.for_each(|part| self.add(part, &mut work));
            drawn += usize::from(work.items + work.particles.sum() > before);
        }
        OwnWork { ranges: Some(drawn), ..work }
    }

    /// An interrupt after two sets leaves the picture of the sets so far.
    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        session: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let frame = self.frame;
        let opaque = frame.opaque(cost)?;
        let parts = self.parts.as_deref().unwrap_or_default();
        let inside: Vec<&Part<'_>> = parts.iter().filter(|part| part.reaches(&range, &frame.camera)).collect();
        if inside.is_empty() {
            return Ok(());
        }
        let occluder = occluder(opaque);
        let maps = frame.maps(cost)?;
        let average = cost.measure(pass::PARTICLES, |stage| {
            let average = fold(frame, &inside, maps, range.clone(), occluder, session)?;
            stage.items_in = inside.len() as u64;
            stage.items_out = average.particles;
            stage.bytes = average.ensemble.bytes();
            Ok::<_, Error>(average)
        })?;
        let asked = frame.settings.particles.repeat_level;
        let averaged = average.ensemble.levels();
        let interrupted = average.interrupted;
        session.sets = Some(Sets { averaged, asked, interrupted });
        let mut segment = frame.accumulator();
        let objects: Vec<u32> = inside.iter().map(|part| part.object).collect();
        average.ensemble.accumulate(&frame.layout(), &objects, &mut segment);
        into.append(&segment);
        self.average = (range == EVERYWHERE).then_some(average);
        Ok(())
    }

    fn finish(&mut self, finished: &mut Finished<'_>) {
        if !self.frame.settings.layers.names().any(|name| name == "std_error") {
            return;
        }
        // Without particles there is no noise.
        let none = || LayerData::Scalar(vec![0.0; finished.layers.size.iter().map(|s| *s as usize).product()]);
        let error = self.average.as_ref().map_or_else(none, |average| {
            let occluder = finished.opaque.and_then(occluder);
            let background = self.frame.background();
            average.ensemble.std_error(&|x, y| background.radiance(x, y), occluder, self.frame.settings.antialias)
        });
        finished.layers.insert("std_error", error);
    }
}

/// Everything translucent in view that is drawn by particles; sets that are kept where there are some.
fn parts<'a>(frame: &'a Frame<'a>, session: &mut Session<'_>, cost: &mut CostRecord) -> Result<Vec<Part<'a>>, Error> {
    let mut sources = sources(frame);
    if let Some(kept) = session.kept.as_deref_mut() {
        kept.sample(&mut sources, frame, cost, session.warnings)?;
    }
    prepared(frame, sources, session.kept.as_deref(), session.warnings, cost)
}

/// The same of these sources.
fn prepared<'a>(
    frame: &'a Frame<'a>,
    sources: Vec<Source<'a>>,
    kept: Option<&Kept>,
    warnings: &mut Vec<String>,
    cost: &mut CostRecord,
) -> Result<Vec<Part<'a>>, Error> {
    if sources.is_empty() {
        return Ok(Vec::new());
    }
    frame.progress.begin(stage::SAMPLERS);
    cost.measure(pass::SAMPLERS, |stage| {
        stage.items_in = sources.len() as u64;
        let mut parts = Vec::with_capacity(sources.len());
        for mut source in sources {
            let sets = kept.and_then(|kept| kept.sets_of(source.own_object()?));
            match sets {
                Some(sets) => parts.push(source.part_of(parts::Particles::Kept(sets))),
                None => parts.extend(source.part(warnings)?),
            }
        }
        stage.items_out = parts.len() as u64;
        Ok(parts)
    })
}

/// What hides particles.
fn occluder(opaque: &OpaqueImage) -> Option<&OpaqueImage> {
    (!opaque.depth.is_empty()).then_some(opaque)
}

/// What went wrong with the particles of the named object or objects: a limit, or data that samplers do not take. They are
/// refused by the samplers' own checks, so that it is never the program's fault.
fn refuse(whose: &str, error: pbsr::Error) -> Error {
    match error {
        pbsr::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        pbsr::Error::Limit(exceeded) => {
            let hint =
                "use a lower extinction or opacity, a smaller image or render.antialias, or a larger --max-memory";
            Error::Limit(exceeded.owned_by(whose, hint))
        }
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
