//! Settings of the viewed scene from fast to exact. Each has its predicted time and, once it is drawn, its measured time and its
//! picture.

pub(crate) mod compare;

use crate::picture::{Drawn, Size};
use crate::state::Accuracy;
use organza::cost::Prediction;
use organza::scene::Scene;
use organza::{CostRecord, Error, Foreseen, Progress, RenderOptions, Sequence};
use organza_judge::accuracy::{Facts, Knob, Rung, apart, knobs_of, ladder, lines};
use serde::Serialize;
use std::collections::BTreeMap;

/// Most pixels of pictures that are compared: the perceived difference of more takes seconds.
const MOST_PIXELS: u64 = 4 << 20;

/// Whether pictures of a size are compared.
fn is_compared(size: Size) -> bool {
    u64::from(size.width) * u64::from(size.height) <= MOST_PIXELS
}

/// A position between fast and exact, as a row of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RungRow {
    /// The setting's place, from fastest (negative) to most exact; 0 is the scene's stated setting.
    pub step: i32,
    /// The knobs that are turned, each with its position.
    pub words: Vec<String>,
    /// The settings that it stands for, as `--set` takes them.
    pub set: Vec<String>,
    /// The same as lines of a scene file.
    pub lines: String,
    /// Predicted time of drawing by the clock, milliseconds; `None` where splats would be made anew.
    pub predicted_ms: Option<f64>,
    /// Measured time of drawing, milliseconds; `None` before it was drawn.
    pub measured_ms: Option<f64>,
    /// Root mean square of the differences of displayed numbers, 0 to 1, against the most exact picture seen; `None` before it was drawn.
    pub rmse: Option<f64>,
    /// Mean LDR-FLIP against the most exact picture seen, 0 to 1; `None` before it was drawn.
    pub flip: Option<f64>,
    /// Whether it is the most exact picture seen.
    pub is_reference: bool,
}

/// The positions of a scene, which stay while it is turned.
#[derive(Debug)]
pub(crate) struct Scale {
    /// The scene with the accuracy that it states, from where it is seen now.
    stated: Scene,
    knobs: Vec<Knob>,
    rungs: Vec<Rung>,
    rows: Vec<RungRow>,
    /// Displayed pictures by position, all of this scene from here.
    pictures: BTreeMap<i32, Vec<u8>>,
}

impl Scale {
    /// The positions of a scene, by what was drawn of it last; `None` where that had other splats.
    ///
    /// # Errors
    /// Those of planning.
    pub(crate) fn new(
        stated: &Scene,
        sequence: &mut Sequence,
        options: &RenderOptions,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        let look = |foreseen: &Foreseen<'_>| {
            let facts = Facts::of_plan(foreseen.loaded, foreseen.plan)?;
            let slab_width = foreseen.frame.slab_width(options, &mut CostRecord::default())?;
            Ok(knobs_of(stated, &foreseen.plan.techniques, &facts, slab_width))
        };
        let Some(knobs) = sequence.foresee(stated, options, progress, look)? else { return Ok(None) };
        let mut scale =
            Self { stated: stated.clone(), knobs, rungs: Vec::new(), rows: Vec::new(), pictures: BTreeMap::new() };
        scale.see(stated);
        Ok(Some(scale))
    }

    /// Whether its knobs are those of a scene: whether it was turned alone.
    pub(crate) fn is_of(&self, stated: &Scene) -> bool {
        let Scene { camera, target, sha256, .. } = stated;
        let mut turned = self.stated.clone();
        turned.camera = *camera;
        turned.target = *target;
        turned.sha256.clone_from(sha256);
        turned == *stated
    }

    /// Forgets what was predicted and measured, where the scene is another one or is seen from elsewhere; whether its knobs are those of the scene.
    pub(crate) fn forget_unless(&mut self, stated: &Scene) -> bool {
        if self.stated != *stated {
            self.pictures.clear();
            for row in &mut self.rows {
                row.predicted_ms = None;
                row.measured_ms = None;
                row.rmse = None;
                row.flip = None;
                row.is_reference = false;
            }
        }
        self.is_of(stated)
    }

    /// Takes the scene as it is seen now: what was measured from elsewhere is forgotten.
    pub(crate) fn see(&mut self, stated: &Scene) {
        if self.stated == *stated && !self.rows.is_empty() {
            return;
        }
        self.stated = stated.clone();
        self.rungs = ladder(stated, &self.knobs);
        self.pictures.clear();
        let row = |rung: &Rung| RungRow {
            step: rung.step,
            words: rung.words.clone(),
            set: rung.sets(stated),
            lines: lines(stated, &rung.request),
            predicted_ms: None,
            measured_ms: None,
            rmse: None,
            flip: None,
            is_reference: false,
        };
        self.rows = self.rungs.iter().map(row).collect();
    }

    /// Predicts one position that was not predicted yet, by the splats of what was drawn last; whether there may be another.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn predict_next(
        &mut self,
        sequence: &mut Sequence,
        options: &RenderOptions,
        progress: &Progress,
        tried: &mut Vec<i32>,
    ) -> Result<bool, Error> {
        let is_open = |row: &&mut RungRow| row.predicted_ms.is_none() && !tried.contains(&row.step);
        let mut open = self.rungs.iter().zip(&mut self.rows).filter(|(_, row)| is_open(row));
        let Some((rung, row)) = open.next() else { return Ok(false) };
        tried.push(row.step);
        let time = |foreseen: &Foreseen<'_>| Ok(drawing_ms(foreseen.predicted));
        row.predicted_ms = match sequence.foresee(&rung.request.scene, options, progress, time) {
            Ok(ms) => ms,
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            // It would be refused, which whoever chooses it is told.
            Err(_) => None,
        };
        Ok(true)
    }

    /// Takes the whole picture of a position: its time, and how far each picture is from the most exact one.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that cannot be displayed.
    pub(crate) fn measure(&mut self, accuracy: &Accuracy, drawn: &Drawn) -> Result<(), Error> {
        let set = accuracy.texts();
        let Some(row) = self.rows.iter_mut().find(|row| row.step == accuracy.step && row.set == set) else {
            return Ok(());
        };
        row.measured_ms = Some(drawn.drawing_ms());
        let Size { width, height } = drawn.size();
        if !is_compared(drawn.size()) {
            return Ok(());
        }
        let best = |pictures: &BTreeMap<i32, Vec<u8>>| pictures.last_key_value().map(|(step, _)| *step);
        let before = best(&self.pictures);
        self.pictures.insert(accuracy.step, drawn.displayed()?);
        let now = best(&self.pictures);
        let Some(reference) = now.and_then(|step| self.pictures.get(&step)) else { return Ok(()) };
        for (step, picture) in &self.pictures {
            // Against the same picture as before, only this one is new.
            if before != now || *step == accuracy.step {
                let found = apart([width, height], picture, reference)?;
                for row in self.rows.iter_mut().filter(|row| row.step == *step) {
                    row.rmse = Some(found.rmse);
                    row.flip = Some(found.flip);
                }
            }
        }
        self.rows.iter_mut().for_each(|row| row.is_reference = Some(row.step) == now);
        Ok(())
    }

    /// The positions, from the fastest.
    pub(crate) fn rows(&self) -> Vec<RungRow> {
        self.rows.clone()
    }
}

/// Predicted time of drawing by the clock, milliseconds.
fn drawing_ms(predicted: &Prediction) -> f64 {
    let threads = rayon::current_num_threads();
    1e3 * predicted.drawing.iter().map(|pass| pass.seconds(&predicted.rates, threads)).sum::<f64>()
}
