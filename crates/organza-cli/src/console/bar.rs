//! Progress on stderr, a bar on a terminal and else a line now and then.

use super::signals;
use crate::console;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use organza::{Error, Progress};
use splat_core::Exceeded;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks at the progress.
const INTERVAL: Duration = Duration::from_millis(100);
/// Time between two lines where there is no terminal, and before the first: short work is silent.
const LINES: Duration = Duration::from_secs(10);
/// Time between two looks at the stage where each is told.
const STAGES: Duration = Duration::from_millis(20);
/// Steps of the bar.
const STEPS: f64 = 1000.0;

/// Runs `work`, shows how far it is, and prints what it announces; an interrupt stops it at its next tick, or within two seconds, a second one at once.
pub(crate) fn with_bar<T>(work: impl FnOnce(&Progress) -> Result<T, Error>) -> Result<T, Error> {
    let progress = Arc::new(Progress::new());
    signals::stops(&progress);
    let finished = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let watch = || {
            let is_terminal = std::io::stderr().is_terminal();
            match () {
                () if console::is_verbose() => print_stages(&progress, &finished),
                () if console::is_quiet() => {}
                () if is_terminal => draw_bar(&progress, &finished),
                () => print_lines(&progress, &finished),
            }
        };
        // Where there is no memory for a thread there is none for a picture.
        let watcher = std::thread::Builder::new().spawn_scoped(scope, watch).map_err(|_| no_thread())?;
        let out = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&progress)));
        finished.store(true, Ordering::Relaxed);
        watcher.thread().unpark();
        out.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The refusal where the system gives no thread.
fn no_thread() -> Error {
    Error::Limit(Exceeded {
        what: "a thread that shows progress".into(),
        needed: u64::MAX,
        limit: None,
        unit: "bytes",
        hint: "let the system give more memory and threads".into(),
    })
}

fn draw_bar(progress: &Progress, finished: &AtomicBool) {
    let bar = ProgressBar::with_draw_target(Some(STEPS as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} [{wide_bar}] {percent:>3} % {msg}") {
        bar.set_style(style.progress_chars("=> "));
    }
    while !finished.load(Ordering::Relaxed) {
        bar.suspend(|| print_announced(progress));
        let (stage, fraction) = progress.report();
        bar.set_message(stage);
        bar.set_position((STEPS * fraction) as u64);
        std::thread::park_timeout(INTERVAL);
    }
    bar.finish_and_clear();
}

/// Prints what the work has left to be said, as it goes on.
fn print_announced(progress: &Progress) {
    progress.take_announced().iter().for_each(|sentence| console::remark(sentence));
}

fn print_lines(progress: &Progress, finished: &AtomicBool) {
    let start = Instant::now();
    let mut next = LINES;
    while !finished.load(Ordering::Relaxed) {
        if start.elapsed() >= next {
            let (stage, fraction) = progress.report();
            console::note(&line(start.elapsed(), &stage, fraction));
            next += LINES;
        }
        print_announced(progress);
        std::thread::park_timeout(INTERVAL.min(next.saturating_sub(start.elapsed())));
    }
}

/// A line for each stage as it begins.
fn print_stages(progress: &Progress, finished: &AtomicBool) {
    let start = Instant::now();
    let mut last = String::new();
    while !finished.load(Ordering::Relaxed) {
        let (stage, fraction) = progress.report();
        if stage != last {
            let elapsed = start.elapsed();
            let hundredths = elapsed.subsec_millis() / 10;
            let stage_text = organza::escape_controls(&stage);
            console::note(&format!(
                "{}.{hundredths:02} s, {:.0} %: {stage_text}\n",
                elapsed.as_secs(),
                (100.0 * fraction).floor()
            ));
            last = stage;
        }
        print_announced(progress);
        std::thread::park_timeout(STAGES);
    }
}

fn line(elapsed: Duration, stage: &str, fraction: f64) -> String {
    let stage = organza::escape_controls(stage);
    format!("{} s, {:.0} %: {stage}\n", elapsed.as_secs(), (100.0 * fraction).floor())
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_line_has_time_share_and_stage() {
        let line = super::line(std::time::Duration::from_millis(20_900), "reading a\n.ply", 0.999);
        assert_eq!(line, "20 s, 99 %: reading a\\n.ply\n");
    }
}
