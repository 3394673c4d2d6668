//! A progress bar on stderr when it is a terminal, and the interrupt.

use super::console;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use organza::{Error, Progress};
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time between two looks at the progress.
const INTERVAL: Duration = Duration::from_millis(100);

/// Time that the work has to hear of an interrupt: where it asks for none so long, it is ended as by a second one.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Runs `work` with a bar; an interrupt stops it at its next tick, or within two seconds, a second one at once.
pub(super) fn with_bar<T>(work: impl FnOnce(&Progress) -> Result<T, Error>) -> Result<T, Error> {
    let progress = Arc::new(Progress::new());
    cancel_on_interrupt(&progress)?;
    if !std::io::stderr().is_terminal() {
        return work(&progress);
    }
    let finished = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let watcher = scope.spawn(|| watch(&progress, &finished));
        let out = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&progress)));
        finished.store(true, Ordering::Relaxed);
        watcher.thread().unpark();
        out.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn cancel_on_interrupt(progress: &Arc<Progress>) -> Result<(), Error> {
    let progress = Arc::clone(progress);
    let asked = AtomicBool::new(false);
    let handler = move || {
        if asked.swap(true, Ordering::Relaxed) {
            end_at_once();
        }
        progress.cancel();
        let progress = Arc::clone(&progress);
        std::thread::spawn(move || {
            std::thread::sleep(PATIENCE);
            if !progress.is_heard() {
                end_at_once();
            }
        });
    };
    ctrlc::set_handler(handler).map_err(|e| Error::Internal(format!("interrupt handler: {e}")))
}

/// Outputs are whole or not there at any time.
fn end_at_once() -> ! {
    console::note("error: interrupted\n");
    organza::output::abandon();
    std::process::exit(i32::from(Error::Cancelled.exit_code()))
}

fn watch(progress: &Progress, finished: &AtomicBool) {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} [{wide_bar}] {percent:>3} %") {
        bar.set_style(style.progress_chars("=> "));
    }
    while !finished.load(Ordering::Relaxed) {
        let (done, total) = progress.read();
        bar.set_length(total);
        bar.set_position(done.min(total));
        std::thread::park_timeout(INTERVAL);
    }
    bar.finish_and_clear();
}
