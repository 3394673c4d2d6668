//! The `surfels` technique (Zhang and Pajarola 2007): translucent surfaces as discs that are averaged in each layer, by rays that meet
//! them exactly, and layers that are composited in order.

use crate::frame::{Frame, Shaded};
use crate::lights::LightPoint;
use crate::matter::Matter;
use crate::pass;
use crate::scene::Technique;
use crate::technique::{Fold, Session, points};
use crate::{CostRecord, Error, RenderOptions, stage};
use deferred_blend::{BlendInput, DiscInput, Discs, Params, blend};
use splat_core::{Accumulator, Direction};
use std::ops::Range;

/// Bytes of a disc: where rays meet it, what it shows, its place, and an entry in the lists of two tiles.
const DISC_BYTES: u64 = 96 + 24 + 4 + 2 * 4;

/// Bytes of the discs.
pub(crate) fn bytes(matter: &Matter<'_>, _: &[LightPoint], _: bool, _: &RenderOptions) -> u64 {
    matter.cloud.map_or(0, |cloud| DISC_BYTES * cloud.len() as u64)
}

/// Begins a frame.
pub(crate) fn begin<'a>(frame: &'a Frame<'a>) -> Box<dyn Fold + 'a> {
    Box::new(Surfels { frame, discs: None })
}

/// The discs of a frame that are the technique's own.
struct Surfels<'a> {
    frame: &'a Frame<'a>,
    /// Once they were projected.
    discs: Option<Discs>,
}

impl Fold for Surfels<'_> {
    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        _: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let frame = self.frame;
        let params = params(frame);
        frame.maps(cost)?;
        if self.discs.is_none() {
            self.discs = Some(project(frame, &params, cost)?);
        }
        let Shaded { values, .. } = frame.shaded(cost)?;
        let opaque = &frame.opaque(cost)?.depth;
        let discs = self.discs.as_ref().expect("invariant: discs were projected above");
        frame.progress.begin(stage::SURFELS);
        frame.tick()?;
        cost.measure(pass::SURFELS, |stage| {
            let counts = blend(&BlendInput { discs, values, opaque, range }, &params, into, Some(frame.progress));
            let counts = counts.map_err(refuse)?;
            stage.items_in = counts.discs;
            stage.items_out = counts.layers;
            stage.fragments = counts.fragments;
            stage.bytes = counts.bytes;
            Ok(())
        })
    }
}

fn params(frame: &Frame<'_>) -> Params {
    let settings = &frame.settings.surfels;
    Params {
        disc_scale: settings.disc_scale as f32,
        gap: settings.gap as f32,
        transmittance_cutoff: settings.transmittance_cutoff as f32,
    }
}

/// The discs, near ones first.
fn project(frame: &Frame<'_>, params: &Params, cost: &mut CostRecord) -> Result<Discs, Error> {
    let near_first = hbsort::Params { direction: Direction::FrontToBack, ..hbsort::Params::default() };
    let order = points::sorted(frame, Technique::Surfels, &near_first, cost)?;
    let loaded = frame.loaded;
    frame.progress.begin(stage::SURFELS);
    frame.tick()?;
    cost.measure(pass::SURFELS, |stage| {
        let input = DiscInput {
            cloud: frame.drawn(),
            ids: &order.input_from_sorted,
            camera: &frame.camera,
            footprints: &loaded.footprints,
            materials: &loaded.materials,
        };
        let discs = Discs::project(&input, params);
        stage.bytes = discs.bytes();
        Ok(discs)
    })
}

fn refuse(error: deferred_blend::Error) -> Error {
    match error {
        deferred_blend::Error::Cancelled => Error::Cancelled,
        other => Error::Internal(other.to_string()),
    }
}
