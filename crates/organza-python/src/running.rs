//! Long calls: the interpreter is free meanwhile, an interrupt ends them, and a caller hears how far they are.

use crate::errors::raised;
use organza::{Error, Progress};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Time between looks for an interrupt.
const LOOK: Duration = Duration::from_millis(20);
/// Threads that a caller may ask for.
const MOST_THREADS: usize = 4096;

/// Does `work` on threads of its own, as many as the caller asks for or the machine has. `heard` is called with the name of the stage and the share
/// that is done, from 0 to 1.
///
/// # Errors
/// What `work` returns; what an interrupt raises, or `heard` does.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    heard: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let progress = Progress::new();
    let is_done = AtomicBool::new(false);
    let caller = std::thread::current();
    std::thread::scope(|scope| {
        let progress = &progress;
        let pool = &pool;
        let is_done = &is_done;
        let worker = scope.spawn(move || {
            let result = pool.install(|| work(progress));
            is_done.store(true, Ordering::Release);
            caller.unpark();
            result
        });
        let mut raised_while = None;
        // A thread that panics ends without saying so.
        while !is_done.load(Ordering::Acquire) && !worker.is_finished() {
            py.detach(|| std::thread::park_timeout(LOOK));
            if raised_while.is_some() {
                continue;
            }
            let told = heard.map_or(Ok(()), |heard| {
                let (stage, share) = progress.report();
                heard.call1((stage, share)).map(|_| ())
            });
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
    })
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
    builder.build().map_err(|error| pyo3::exceptions::PyOSError::new_err(format!("threads cannot be started: {error}")))
}
