//! Progress of long work: named stages, ticks within them, and a request to stop.

use crate::Error;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Shared between the thread that works and the one that shows a bar or catches an interrupt.
///
/// Work is planned as stages with weights in any unit, predicted ones. A stage that has begun moves with its ticks. Work
/// that makes up a stage of another's can be planned in its turn: [`Progress::enter`].
///
/// ```
/// use splat_core::Progress;
/// let progress = Progress::new();
/// progress.plan([("reading", 1.0), ("drawing", 3.0)]);
/// progress.begin("reading");
/// progress.begin("drawing");
/// assert_eq!(progress.report(), ("drawing".to_owned(), 0.25));
/// progress.add_total(2);
/// progress.tick(1).unwrap();
/// assert_eq!(progress.report().1, 0.625);
/// progress.finish();
/// assert_eq!(progress.report().1, 1.0);
/// ```
#[derive(Default)]
pub struct Progress {
    done: AtomicU64,
    total: AtomicU64,
    cancelled: AtomicBool,
    heard: AtomicBool,
    course: Mutex<Course>,
    announced: Mutex<Vec<String>>,
    on_stage: Option<OnStage>,
}

/// Called with every stage that begins or ends: its name and the fraction done.
type OnStage = Box<dyn Fn(&str, f64) + Send + Sync>;

impl std::fmt::Debug for Progress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Progress").field("report", &self.report()).finish_non_exhaustive()
    }
}

/// Units of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Units {
    /// Those that are done.
    pub done: u64,
    /// Those that were announced.
    pub total: u64,
}

impl Progress {
    /// No work yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// No work yet; `on_stage` is called with the name of every stage that begins and the fraction that is done then, and
    /// with the last one's when all is finished.
    pub fn watched(on_stage: impl Fn(&str, f64) + Send + Sync + 'static) -> Self {
        Self { on_stage: Some(Box::new(on_stage)), ..Self::default() }
    }

    /// What comes after the present stage, in this order, with weights ≥ 0; it shares what is left of the whole, and takes
    /// the place of what was planned before.
    pub fn plan<S: Into<String>>(&self, stages: impl IntoIterator<Item = (S, f64)>) {
        let mut course = self.course();
        course.is_finished = false;
        let frame = course.frame();
        frame.left = stages.into_iter().map(|(name, weight)| (name.into(), weight.max(0.0))).collect();
        frame.weight = frame.left.iter().map(|s| s.1).sum();
    }

    /// Ends the present stage and begins another. Those planned between them are left out; one that was not planned takes
    /// no share.
    pub fn begin(&self, name: &str) {
        let mut course = self.course();
        course.frame().begin(name);
        self.reset();
        self.say(course);
    }

    /// Plans and stages up to [`Progress::leave`] share what the present stage takes.
    pub fn enter(&self) {
        let mut course = self.course();
        let Stage { begin, end, .. } = course.frame().stage;
        course.frames.push(Frame::new(begin, end));
        self.reset();
    }

    /// Back to the stage that was entered, which is over.
    pub fn leave(&self) {
        let mut course = self.course();
        if course.frames.len() > 1 {
            course.frames.pop();
        }
        let frame = course.frame();
        frame.stage.begin = frame.stage.end;
        self.reset();
    }

    /// A stage that is made up of `stages`, which `work` begins one by one.
    pub fn within<S: Into<String>, T>(
        &self,
        name: &str,
        stages: impl IntoIterator<Item = (S, f64)>,
        work: impl FnOnce() -> T,
    ) -> T {
        self.begin(name);
        self.enter();
        self.plan(stages);
        let out = work();
        self.leave();
        out
    }

    /// All is done, or all of the stage that was entered last.
    pub fn finish(&self) {
        let mut course = self.course();
        course.is_finished = course.frames.len() <= 1;
        let frame = course.frame();
        (frame.left, frame.weight) = (VecDeque::new(), 0.0);
        (frame.stage.begin, frame.stage.end) = (frame.end, frame.end);
        self.reset();
        self.say(course);
    }

    /// Leaves a sentence for whoever watches, while the work goes on.
    pub fn announce(&self, sentence: &str) {
        self.announced.lock().unwrap_or_else(PoisonError::into_inner).push(sentence.to_owned());
    }

    /// Takes the sentences that were left since the last call, in order.
    pub fn take_announced(&self) -> Vec<String> {
        std::mem::take(&mut *self.announced.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Announces `n` more units of work of the present stage.
    pub fn add_total(&self, n: u64) {
        self.total.fetch_add(n, Relaxed);
    }

    /// Reports `n` units done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] after [`Progress::cancel`].
    pub fn tick(&self, n: u64) -> Result<(), Error> {
        self.done.fetch_add(n, Relaxed);
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Asks the work to stop at its next tick.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// Whether [`Progress::cancel`] was called: a loop that cannot fail leaves its work undone and its caller asks with
    /// [`Progress::tick`].
    pub fn is_cancelled(&self) -> bool {
        let cancelled = self.cancelled.load(Relaxed);
        if cancelled {
            self.heard.store(true, Relaxed);
        }
        cancelled
    }

    /// Whether the work has noticed [`Progress::cancel`]: if not, it is where nothing is asked.
    pub fn is_heard(&self) -> bool {
        self.heard.load(Relaxed)
    }

    /// Units of the present stage.
    pub fn read(&self) -> Units {
        Units { done: self.done.load(Relaxed), total: self.total.load(Relaxed) }
    }

    /// The present stage, after those that it is a stage of, and the fraction of the whole that is done, 0 to 1, never less
    /// than before; 1 after [`Progress::finish`] alone, 0.99 at most until then.
    pub fn report(&self) -> (String, f64) {
        self.look(&mut self.course())
    }

    fn look(&self, course: &mut Course) -> (String, f64) {
        let Units { done, total } = self.read();
        let share = if total > 0 { (done as f64 / total as f64).min(1.0) } else { 0.0 };
        let Stage { begin, end, .. } = course.frame().stage;
        course.reported = course.reported.max(begin + (end - begin) * share).min(1.0);
        let fraction = if course.is_finished { course.reported } else { course.reported.min(MOST) };
        let names = course.frames.iter().map(|f| f.stage.name.as_str()).filter(|n| !n.is_empty());
        (names.collect::<Vec<_>>().join(": "), fraction)
    }

    fn say(&self, mut course: MutexGuard<'_, Course>) {
        if let Some(on_stage) = &self.on_stage {
            let (name, fraction) = self.look(&mut course);
            // Whoever listens may ask back.
            drop(course);
            on_stage(&name, fraction);
        }
    }

    fn reset(&self) {
        self.done.store(0, Relaxed);
        self.total.store(0, Relaxed);
    }

    fn course(&self) -> MutexGuard<'_, Course> {
        // Its numbers are whole after each statement.
        self.course.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Where the work stands.
#[derive(Default)]
struct Course {
    /// The whole, then what was entered.
    frames: Vec<Frame>,
    /// Largest fraction that was reported.
    reported: f64,
    /// Whether all is done.
    is_finished: bool,
}

/// Fraction of the whole that is reported at most until all is done: predictions fall short, and what is whole is over.
const MOST: f64 = 0.99;

impl Course {
    /// What was entered last.
    fn frame(&mut self) -> &mut Frame {
        if self.frames.is_empty() {
            self.frames.push(Frame::new(0.0, 1.0));
        }
        let last = self.frames.len() - 1;
        &mut self.frames[last]
    }
}

/// Work that is planned together: the whole, or a stage that was entered.
struct Frame {
    /// Fraction of the whole where it ends.
    end: f64,
    stage: Stage,
    /// Later stages with their weights, and the sum of these.
    left: VecDeque<(String, f64)>,
    weight: f64,
}

/// What is done at present, as fractions of the whole.
struct Stage {
    name: String,
    begin: f64,
    end: f64,
}

impl Frame {
    fn new(begin: f64, end: f64) -> Self {
        Self { end, stage: Stage { name: String::new(), begin, end: begin }, left: VecDeque::new(), weight: 0.0 }
    }

    fn begin(&mut self, name: &str) {
        let begin = self.stage.end;
        let mut end = begin;
        if let Some(at) = self.left.iter().position(|(n, _)| n == name) {
            let skipped: f64 = self.left.drain(..at).map(|s| s.1).sum();
            self.weight -= skipped;
            let weight = self.left.pop_front().map_or(0.0, |s| s.1);
            let share = if self.weight > 0.0 { (weight / self.weight).min(1.0) } else { 0.0 };
            self.weight -= weight;
            // The last one ends where all ends, however sums were rounded.
            end = if self.left.is_empty() { self.end } else { begin + (self.end - begin) * share };
        }
        self.stage = Stage { name: name.to_owned(), begin, end };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_plan_shares_what_is_left() {
        let progress = Progress::new();
        progress.plan([("a", 1.0), ("unknown", 1.0)]);
        progress.begin("a");
        progress.plan([("b", 1.0), ("left out", 6.0), ("c", 3.0)]);
        progress.begin("b");
        assert_eq!(progress.report(), ("b".to_owned(), 0.5));
        progress.begin("c");
        assert_eq!(progress.report(), ("c".to_owned(), 0.55));
        progress.add_total(4);
        progress.tick(1).unwrap();
        assert!((progress.report().1 - (0.55 + 0.45 / 4.0)).abs() < 1e-12);
        progress.begin("not planned");
        // All of the plan is behind it, and it is not over.
        assert_eq!(progress.report(), ("not planned".to_owned(), MOST));
        progress.finish();
        assert_eq!(progress.report(), ("not planned".to_owned(), 1.0));
    }

    #[test]
    fn what_is_entered_stays_within_its_stage() {
        let progress = Progress::new();
        progress.plan([("frame 1", 1.0), ("frame 2", 1.0)]);
        for (frame, begin) in [("frame 1", 0.0), ("frame 2", 0.5)] {
            progress.begin(frame);
            progress.enter();
            progress.plan([("read", 1.0), ("draw", 3.0)]);
            progress.begin("read");
            progress.begin("draw");
            assert_eq!(progress.report(), (format!("{frame}: draw"), begin + 0.125));
            progress.finish();
            progress.leave();
            assert_eq!(progress.report(), (frame.to_owned(), (begin + 0.5).min(MOST)));
        }
        progress.finish();
        assert_eq!(progress.report().1, 1.0);
    }

    #[test]
    fn more_work_than_announced_never_goes_back() {
        let progress = Progress::new();
        progress.plan([("a", 1.0)]);
        progress.begin("a");
        progress.add_total(2);
        progress.tick(1).unwrap();
        assert_eq!(progress.report().1, 0.5);
        progress.add_total(100);
        assert_eq!(progress.report().1, 0.5);
    }

    #[test]
    fn a_cancel_is_heard_by_whoever_asks() {
        let asks: [fn(&Progress) -> bool; 2] = [|p| p.tick(1).is_err(), Progress::is_cancelled];
        for ask in asks {
            let progress = Progress::new();
            assert!(!ask(&progress) && !progress.is_heard());
            progress.cancel();
            assert!(!progress.is_heard());
            assert!(ask(&progress) && progress.is_heard());
        }
    }
}
