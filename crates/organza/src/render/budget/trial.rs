//! A trial: a small picture of a part of the splats, timed. Its counted work, scaled, predicts the time of every
//! rung.

use super::errors::Thinned;
use super::rung::Rung;
use super::small::{Drawing, part_of};
use crate::cost::{Growth, Item, Prediction, Rates};
use crate::load::Loaded;
use crate::{CostRecord, Error};

/// Share of the splats in the trial.
pub(super) const TRIAL_SPLATS: f64 = 1.0 / 16.0;
/// Of the picture's width and height; more of it where objects are drawn from their own data, for what voxels take does not shrink with the picture.
pub(super) const TRIAL_SIDE: u32 = 4;
const TRIAL_SIDE_OF_VOXELS: u32 = 2;
/// Sets of particles in the trial.
pub(super) const TRIAL_SETS: u32 = 4;
/// A pass of the trial that took less tells nothing of its items, seconds.
const SHORTEST: f64 = 5e-4;

/// What a trial told.
pub(super) struct Trial {
    /// Counted work, with the seconds of an item.
    pub(super) predicted: Prediction,
    rung: Rung,
    /// Samples of the picture.
    samples: f64,
    /// Seconds of planning, most of which goes with the splats where there are some.
    planning: f64,
    has_splats: bool,
    /// Seconds of passes that no count foretells, such as the making of samplers: they do not go with the size of a picture.
    pub(super) uncounted: f64,
    /// How the number of each kind of item goes with the splats, in the order of [`Item`].
    orders: Vec<f64>,
}

impl Trial {
    /// Draws it; counts its work alone, by the figures of a machine, where it would take longer than `most_seconds`.
    pub(super) fn new(drawing: &Drawing<'_>, loaded: &mut Loaded, most_seconds: f64) -> Result<Self, Error> {
        let asked = Rung::of_scene(drawing.scene);
        let rung = Rung { splat_share: asked.splat_share * TRIAL_SPLATS, sets: asked.sets.min(TRIAL_SETS), ..asked };
        let part = if loaded.own.is_empty() { TRIAL_SIDE } else { TRIAL_SIDE_OF_VOXELS };
        let size = part_of(drawing.scene.camera.size, part);
        let small = drawing.small(loaded, rung, size, most_seconds)?;
        let [width, height] = size.map(f64::from);
        let samples = width * height * f64::from(rung.antialias).powi(2);
        let rates = measured_rates(&small.predicted, &small.cost);
        let has_splats = !loaded.cloud.is_empty();
        let predicted = Prediction { rates, ..small.predicted };
        let is_counted = |name: &str| predicted.drawing.iter().any(|pass| pass.pass == name);
        let uncounted =
            small.cost.stages.iter().filter(|stage| !is_counted(&stage.name)).map(|stage| stage.seconds).sum();
        let orders = Item::every().map(|_| 0.0).collect();
        Ok(Self { predicted, rung, samples, planning: small.planning, has_splats, uncounted, orders })
    }

    /// Learns from two pictures with more and fewer splats how counts go with them. Entries of shadow maps, and fragments, grow more slowly than splats become
    /// fewer, whose footprints grow; voxels stay. The law is a power, from 0 to 1.
    pub(super) fn learn(&mut self, thinned: &Thinned) {
        let number = |prediction: &Prediction, item: Item| {
            let counts = prediction.drawing.iter().flat_map(|pass| &pass.counts);
            counts.filter(|count| count.item == item).map(|count| count.number).sum::<f64>()
        };
        let order = |item: Item| {
            let more = number(&thinned.base, item);
            let fewer = number(&thinned.quarter, item);
            if more > 0.0 && fewer > 0.0 { (0.5 * libm::log2(more / fewer)).clamp(0.0, 1.0) } else { 1.0 }
        };
        self.orders = Item::every().map(order).collect();
    }

    /// The same counts with figures of a machine in the place of those that a clock gave: what follows from them is the same at each run.
    pub(super) fn by(self, rates: &Rates) -> Self {
        Self { predicted: Prediction { rates: rates.clone(), ..self.predicted }, planning: 0.0, uncounted: 0.0, ..self }
    }

    /// Seconds of planning and drawing with other settings in a picture of this size, from the trial's counts.
    pub(super) fn seconds(&self, rung: Rung, size: [u32; 2]) -> f64 {
        self.planning * self.times_splats(rung) + self.uncounted + self.drawing(rung, size)
    }

    /// How many times the splats of the trial.
    fn times_splats(&self, rung: Rung) -> f64 {
        if self.has_splats { rung.splat_share / self.rung.splat_share } else { 1.0 }
    }

    /// Seconds of drawing alone.
    pub(super) fn drawing(&self, rung: Rung, size: [u32; 2]) -> f64 {
        let threads = rayon::current_num_threads();
        let splats = self.times_splats(rung);
        let [width, height] = size.map(f64::from);
        let samples = width * height * f64::from(rung.antialias).powi(2) / self.samples;
        let sets = f64::from(rung.sets) / f64::from(self.rung.sets);
        let grown = |pass: &crate::cost::CountedPass| {
            let mut pass = pass.clone();
            for count in &mut pass.counts {
                count.number *= libm::pow(splats, self.orders[count.item as usize]);
                count.number *= match count.item.growth() {
                    Growth::Fixed => 1.0,
                    Growth::Samples => samples,
                    Growth::Sets => samples * sets,
                };
            }
            pass.seconds(&self.predicted.rates, threads)
        };
        self.predicted.drawing.iter().map(grown).sum()
    }
}

/// The rates of a prediction, those of each pass times what it took over what was predicted.
fn measured_rates(predicted: &Prediction, cost: &CostRecord) -> Rates {
    let threads = rayon::current_num_threads();
    let ratio = |name: &str| {
        let took = cost.stages.iter().filter(|stage| stage.name == name).map(|stage| stage.seconds).sum::<f64>();
        let passes = predicted.drawing.iter().filter(|pass| pass.pass == name);
        let thought = passes.map(|pass| pass.seconds(&predicted.rates, threads)).sum::<f64>();
        if took > SHORTEST && thought > 0.0 { took / thought } else { 1.0 }
    };
    Rates::measured(|item| predicted.rates.ns(item) * ratio(item.pass()), "a trial".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::{Count, CountedPass};
    use crate::pass;

    fn counted(splats: f64, entries: f64, voxels: f64, samples: f64) -> Prediction {
        let counts = vec![
            Count::new(Item::ShadedSplat, splats),
            Count::new(Item::ShadowEntry, entries),
            Count::new(Item::SheetFragment, voxels),
            Count::new(Item::FinishedSample, samples),
        ];
        let drawing = vec![CountedPass::new(pass::SHADE, String::new(), counts)];
        // A nanosecond for each item.
        let rates = Rates::measured(|_| 1.0, "figures of a test".to_owned());
        Prediction { drawing, rates, ..Prediction::default() }
    }

    #[test]
    fn counts_go_with_splats_as_two_pictures_tell_and_with_samples_by_their_kind() {
        let rung = Rung { antialias: 2, splat_share: 1.0 / 16.0, sets: 4 };
        let mut trial = Trial {
            predicted: counted(1e6, 1e6, 1e6, 1e6),
            rung,
            samples: 1e6,
            planning: 1.0,
            has_splats: true,
            uncounted: 0.5,
            orders: Vec::new(),
        };
        // A quarter of the splats has half of the entries, and as many voxels.
        trial.learn(&Thinned { base: counted(400.0, 80.0, 9.0, 5.0), quarter: counted(100.0, 40.0, 9.0, 5.0) });
        let threads = rayon::current_num_threads();
        let seconds = |splats: f64, entries: f64, voxels: f64, samples: f64| {
            counted(1e6 * splats, 1e6 * entries, 1e6 * voxels, 1e6 * samples).seconds(threads)
        };
        let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        // 500 × 500 pixels of 2 × 2 samples are as many as the trial's.
        near(trial.drawing(rung, [500, 500]), seconds(1.0, 1.0, 1.0, 1.0));
        let whole = Rung { splat_share: 1.0, ..rung };
        near(trial.drawing(whole, [500, 500]), seconds(16.0, 4.0, 1.0, 1.0));
        near(trial.drawing(Rung { antialias: 4, ..whole }, [500, 500]), seconds(16.0, 4.0, 4.0, 4.0));
        near(trial.seconds(whole, [500, 500]), 16.0 + 0.5 + seconds(16.0, 4.0, 1.0, 1.0));
        // Without a clock nothing of it counts.
        let by_figures = trial.by(&Rates::default());
        near(by_figures.seconds(whole, [500, 500]), by_figures.drawing(whole, [500, 500]));
    }
}
