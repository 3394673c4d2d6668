//! Long calls: the interpreter is free meanwhile, an interrupt ends them, and a caller hears how far they are.

use crate::errors::raised;
use crate::wording::sentence;
use organza::{Error, Progress};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time between looks for an interrupt.
const LOOK: Duration = Duration::from_millis(20);
/// Looks after an interrupt for work that ends by itself, a fifth of a second.
const LAST_LOOKS: u32 = 10;
/// Threads that a caller may ask for.
const MOST_THREADS: usize = 4096;

/// Does `work` on threads of its own, as many as the caller asks for or the machine has. `heard` is called with the name of the stage and the share
/// that is done, from 0 to 1. An interrupted call returns within a moment: work that has not ended by then goes on to its next tick, and its result is
/// dropped.
///
/// # Errors
/// What `work` returns; what an interrupt raises, or `heard` does.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    heard: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let progress = Arc::new(Progress::new());
    let is_done = Arc::new(AtomicBool::new(false));
    let caller = std::thread::current();
    let worker = {
        let progress = Arc::clone(&progress);
        let is_done = Arc::clone(&is_done);
        let body = move || {
            let result = pool.install(|| work(&progress));
            is_done.store(true, Ordering::Release);
            caller.unpark();
            result
        };
        std::thread::Builder::new().name("draw".into()).spawn(body).map_err(|error| no_threads(&error))?
    };
    let mut raised_while = None;
    let mut looks_left = LAST_LOOKS;
    // A thread that panics ends without saying so.
    while !is_done.load(Ordering::Acquire) && !worker.is_finished() {
        py.detach(|| std::thread::park_timeout(LOOK));
        if let Some(error) = raised_while.take() {
            if looks_left == 0 {
                return Err(error);
            }
            looks_left -= 1;
            raised_while = Some(error);
            continue;
        }
        let told = heard.map_or(Ok(()), |heard| {
            let (stage, share) = progress.report();
            heard.call1((stage, share)).map(|_| ())
        });
        let told = told.and_then(|()| announce(py, &progress));
        if let Err(error) = py.check_signals().and(told) {
            progress.cancel();
            raised_while = Some(error);
        }
    }
    let result = py.detach(|| worker.join());
    if let Some(error) = raised_while {
        return Err(error);
    }
    match result {
        Ok(result) => result.map_err(|error| raised(&error)),
        Err(_) => Err(raised(&Error::Internal("a thread that draws ended without a result; this is a bug".into()))),
    }
}

/// Prints what the work announces, such as the time that a long drawing takes, where Python's own errors go.
fn announce(py: Python<'_>, progress: &Progress) -> PyResult<()> {
    for announced in progress.take_announced() {
        let errors = py.import("sys")?.getattr("stderr")?;
        // A program without a console has none.
        if !errors.is_none() {
            errors.call_method1("write", (format!("{}\n", sentence(&announced)),))?;
        }
    }
    Ok(())
}

/// Threads of this call alone: those of a process that was forked do not live on in its child.
fn pool(threads: Option<usize>) -> PyResult<ThreadPool> {
    let mut builder = ThreadPoolBuilder::new();
    if let Some(threads) = threads {
        if !(1..=MOST_THREADS).contains(&threads) {
            let found = threads.to_string();
            return Err(crate::errors::refused("threads", &format!("1 to {MOST_THREADS}"), &found));
        }
        builder = builder.num_threads(threads);
    }
    builder.build().map_err(|error| no_threads(&error))
}

/// The error of a system that gives no thread.
fn no_threads(error: &dyn std::fmt::Display) -> PyErr {
    PyOSError::new_err(format!("threads cannot be started: {error}; ask for fewer by `threads`"))
}
