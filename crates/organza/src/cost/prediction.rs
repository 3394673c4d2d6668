//! Predicted times of a render: of each pass, of all, and of the change that would make a long one short.

use super::{Count, Rates};

/// Seconds from which on a render is announced before it starts.
const LONG: f64 = 20.0;
/// A change is named where it takes at most this share of the predicted time.
const WORTH_NAMING: f64 = 0.6;

/// A pass with its counted work, before the work is done.
#[derive(Debug, Clone, PartialEq)]
pub struct CountedPass {
    /// Name, the same as in the plan and in the cost record.
    pub pass: &'static str,
    /// The stage of progress that runs it.
    pub stage: String,
    /// Items by kind.
    pub counts: Vec<Count>,
    /// The repetition of the work, such as "64 sets"; empty if the work is done once.
    pub repeats: String,
    /// Ranges of depth in which it takes turns with others; 1 where it runs once.
    pub rounds: usize,
}

impl CountedPass {
    pub(crate) fn new(pass: &'static str, stage: String, counts: Vec<Count>) -> Self {
        Self { pass, stage, counts, repeats: String::new(), rounds: 1 }
    }

    /// Predicted seconds on so many threads.
    pub fn seconds(&self, rates: &Rates, threads: usize) -> f64 {
        self.counts.iter().map(|count| rates.seconds(count, threads)).sum()
    }

    /// Whether any work is counted.
    pub fn has_work(&self) -> bool {
        self.counts.iter().any(|count| count.number > 0.0)
    }

    /// A share of it.
    pub(crate) fn scaled(&self, share: f64) -> Self {
        let counts = self.counts.iter().map(|count| Count::new(count.item, share * count.number));
        Self { counts: counts.collect(), ..self.clone() }
    }

    /// Takes in more counted work.
    pub(crate) fn add(&mut self, counts: &[Count]) {
        for count in counts {
            match self.counts.iter_mut().find(|known| known.item == count.item) {
                Some(known) => known.number += count.number,
                None => self.counts.push(*count),
            }
        }
    }

    /// Its counted work in words, the kind that takes most time.
    pub fn work(&self, rates: &Rates) -> String {
        let longest = self.counts.iter().max_by(|a, b| rates.seconds(a, 1).total_cmp(&rates.seconds(b, 1)));
        let repeats = if self.repeats.is_empty() { String::new() } else { format!(" of {}", self.repeats) };
        let words = |count: &Count| match (number_text(count.number), count.item.words()) {
            (number, "objects") if number == "1" => "1 object".to_owned(),
            (number, words) => format!("{number} {words}"),
        };
        longest.map_or_else(String::new, |count| words(count) + &repeats)
    }
}

/// A key of the scene that would shorten a render, and the passes that are drawn with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The key with its value, as a scene has it.
    pub key: String,
    /// Counted work with it.
    pub passes: Vec<CountedPass>,
}

/// The counted work that runs for one effect alone.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EffectWork {
    /// The effect, as the plan names it.
    pub effect: String,
    /// Its work, pass by pass.
    pub passes: Vec<CountedPass>,
    /// Bytes that it takes beside, 0 where none are counted.
    pub bytes: u64,
}

impl EffectWork {
    /// Predicted seconds on so many threads.
    pub fn seconds(&self, rates: &Rates, threads: usize) -> f64 {
        self.passes.iter().map(|pass| pass.seconds(rates, threads)).sum()
    }
}

/// Counted work of a render, with the figures that make time of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Prediction {
    /// Reading, conversion, and what techniques prepare before they draw.
    pub loading: Vec<CountedPass>,
    /// The passes that follow.
    pub drawing: Vec<CountedPass>,
    /// Keys that would change the counted work.
    pub changes: Vec<Change>,
    /// The work of each simulated effect that has work of its own, beside passes that run in any case.
    pub effects: Vec<EffectWork>,
    /// Nanoseconds of each item.
    pub rates: Rates,
}

impl Prediction {
    /// The passes, in the order of running.
    pub fn passes(&self) -> impl Iterator<Item = &CountedPass> {
        self.loading.iter().chain(&self.drawing)
    }

    /// The same, those of one name as one.
    pub fn joined(&self) -> Vec<CountedPass> {
        joined(self.passes())
    }

    /// Predicted seconds of all passes on so many threads.
    pub fn seconds(&self, threads: usize) -> f64 {
        self.passes().map(|pass| pass.seconds(&self.rates, threads)).sum()
    }

    /// Warns of a render that is long on this number of threads: its longest pass, the counted work, and the change that would shorten it
    /// most. `None` for a short one.
    pub fn announcement(&self, threads: usize) -> Option<String> {
        let seconds = |passes: &[CountedPass]| passes.iter().map(|p| p.seconds(&self.rates, threads)).sum::<f64>();
        let total = seconds(&self.drawing);
        if total < LONG {
            return None;
        }
        let of_pass = |pass: &CountedPass| pass.seconds(&self.rates, threads);
        let longest = self.drawing.iter().max_by(|a, b| of_pass(a).total_cmp(&of_pass(b)))?;
        let changes = self.changes.iter().map(|change| (change, seconds(&change.passes)));
        let fastest = changes.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, time)| *time <= WORTH_NAMING * total);
        let instead = fastest.map(|(change, time)| format!("; `{}` takes about {}", change.key, duration_text(time)));
        Some(format!(
            "drawing takes about {} on {threads} thread{} by {}, {} of it the pass `{}` with {}{}",
            duration_text(total),
            if threads == 1 { "" } else { "s" },
            self.rates.source(),
            duration_text(of_pass(longest)),
            longest.pass,
            longest.work(&self.rates),
            instead.unwrap_or_default(),
        ))
    }
}

/// Passes, those of one name as one.
pub(crate) fn joined<'p>(passes: impl Iterator<Item = &'p CountedPass>) -> Vec<CountedPass> {
    let mut joined: Vec<CountedPass> = Vec::new();
    for pass in passes {
        match joined.iter_mut().find(|known| known.pass == pass.pass) {
            Some(known) => known.add(&pass.counts),
            None => joined.push(pass.clone()),
        }
    }
    joined
}

/// A sentence about frames that are long together, of which each is drawn in so many seconds by these figures, about. `None` for few of them, and
/// where each is announced by itself.
pub fn announcement_of_frames(frames: usize, seconds: f64, rates: &Rates) -> Option<String> {
    let total = frames as f64 * seconds;
    let is_long = frames > 1 && total >= LONG && seconds < LONG;
    let whole = duration_text(total);
    let each = duration_text(seconds);
    is_long.then(|| format!("drawing {frames} frames takes about {whole} by {}, {each} each", rates.source()))
}

/// A number in the unit that leaves two or three digits.
fn number_text(number: f64) -> String {
    match number {
        n if n >= 1e9 => format!("{:.1} billion", 1e-9 * n),
        n if n >= 1e7 => format!("{:.0} million", 1e-6 * n),
        n if n >= 1e6 => format!("{:.1} million", 1e-6 * n),
        n if n >= 1e4 => format!("{:.0} thousand", 1e-3 * n),
        n => format!("{n:.0}"),
    }
}

/// A readable time: "2 min 30 s", "4 s", "30 ms".
pub fn duration_text(seconds: f64) -> String {
    match seconds {
        s if s >= 5400.0 => format!("{:.1} h", s / 3600.0),
        s if s >= 60.0 => {
            let tens = libm::round(s / 10.0) as u64;
            format!("{} min {} s", tens / 6, 10 * (tens % 6))
        }
        s if s >= 10.0 => format!("{s:.0} s"),
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 1e-3 => format!("{:.0} ms", 1e3 * s),
        s => format!("{:.2} ms", 1e3 * s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Item;
    use crate::pass;

    fn particles(number: f64) -> CountedPass {
        let counts = vec![Count::new(Item::Particle, number)];
        CountedPass { repeats: "64 sets".into(), ..CountedPass::new(pass::PARTICLES, "particles".into(), counts) }
    }

    #[test]
    fn a_long_render_is_announced_with_its_pass_its_count_and_what_is_faster() {
        let ns = |item| if item == Item::Particle { 50.0 } else { 1.0 };
        let rates = Rates::measured(ns, "figures of a test".into());
        let change = |number, key: &str| Change { key: key.into(), passes: vec![particles(number)] };
        let changes = vec![change(2e7, "render.technique = \"points\""), change(2e9, "antialias = 1")];
        let mut long = Prediction { drawing: vec![particles(3e9)], changes, rates, ..Prediction::default() };
        assert_eq!(
            long.announcement(1).as_deref(),
            Some(
                "drawing takes about 2 min 30 s on 1 thread by figures of a test, 2 min 30 s of it the pass `particles` with 3.0 billion \
                 particles of 64 sets; `render.technique = \"points\"` takes about 1.0 s"
            )
        );
        // A change that saves little is not named, a short render is not announced.
        long.changes.remove(0);
        long.changes[0].passes = vec![particles(2.9e9)];
        assert!(long.announcement(1).is_some_and(|said| !said.contains("takes about 2 min 20 s;")));
        long.drawing = vec![particles(3e8)];
        assert_eq!(long.announcement(1), None);
    }

    #[test]
    fn frames_are_announced_by_their_sum() {
        let rates = Rates::default();
        let expected = "drawing 2400 frames takes about 4 min 0 s by built-in figures, 100 ms each";
        assert_eq!(announcement_of_frames(2400, 0.1, &rates).as_deref(), Some(expected));
        assert_eq!(announcement_of_frames(190, 0.1, &rates), None);
        assert_eq!(announcement_of_frames(1, 19.0, &rates), None);
        assert_eq!(announcement_of_frames(5, 30.0, &rates), None, "each is announced");
    }

    #[test]
    fn durations_read_as_people_say_them() {
        let said = [4e-5, 0.0301, 1.04, 12.3, 148.0, 7200.0].map(duration_text);
        assert_eq!(said, ["0.04 ms", "30 ms", "1.0 s", "12 s", "2 min 30 s", "2.0 h"]);
    }
}
