//! Small pictures of a part of the splats: what trials and probes draw.

use super::super::draw::draw;
use super::super::foreseen;
use super::rung::Rung;
use crate::cost::{CountedPass, Prediction};
use crate::frame::Frame;
use crate::load::Loaded;
use crate::prepare::plan_alone;
use crate::scene::Scene;
use crate::technique::Session;
use crate::{CostRecord, Error, Layers, Progress, RenderOptions};
use std::time::Instant;

/// A scene that was loaded with all its splats, and what may be taken to draw it.
#[derive(Clone, Copy)]
pub(super) struct Drawing<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a RenderOptions,
    pub(super) progress: &'a Progress,
}

/// A small picture with its account.
pub(super) struct Small {
    /// `None` where it was predicted to take too long, and was not drawn.
    pub(super) layers: Option<Layers>,
    pub(super) predicted: Prediction,
    pub(super) cost: CostRecord,
    /// Seconds of planning.
    pub(super) planning: f64,
}

impl Drawing<'_> {
    /// Draws the scene with these settings, so many pixels wide and high; only its work is counted where it is predicted to take longer than `most_seconds`.
    pub(super) fn small(
        &self,
        loaded: &mut Loaded,
        rung: Rung,
        size: [u32; 2],
        most_seconds: f64,
    ) -> Result<Small, Error> {
        let mut small = rung.applied_to(self.scene);
        small.camera.size = size;
        let whole = loaded.keep_share(rung.splat_share);
        let drawn = self.drawn(&small, loaded, most_seconds);
        loaded.take_back(whole);
        drawn
    }

    fn drawn(&self, small: &Scene, loaded: &mut Loaded, most_seconds: f64) -> Result<Small, Error> {
        loaded.retarget(small);
        let begun = Instant::now();
        let planned = plan_alone(small, loaded, self.options)?;
        let planning = begun.elapsed().as_secs_f64();
        let mut cost = CostRecord::default();
        let mut warnings = Vec::new();
        let frame = Frame::new(small, loaded, &planned.plan, self.progress);
        if most_seconds.is_finite() {
            let predicted = foreseen(&frame, self.options)?;
            let seconds = |pass: &CountedPass| pass.seconds(&predicted.rates, rayon::current_num_threads());
            if predicted.drawing.iter().map(seconds).sum::<f64>() > most_seconds {
                return Ok(Small { layers: None, predicted, cost, planning });
            }
        }
        let mut session = Session {
            options: self.options,
            checkpoint: None,
            kept: None,
            warnings: &mut warnings,
            sets: None,
            predicted: Prediction::default(),
            announces: false,
        };
        let layers = Some(draw(&frame, &mut session, &mut cost)?);
        if session.sets.is_some_and(|sets| sets.interrupted) {
            return Err(Error::Cancelled);
        }
        let predicted = session.predicted;
        Ok(Small { layers, predicted, cost, planning })
    }
}

/// The size of a picture that is so many times smaller along each side.
pub(super) fn part_of(size: [u32; 2], part: u32) -> [u32; 2] {
    size.map(|side| side.div_ceil(part))
}
