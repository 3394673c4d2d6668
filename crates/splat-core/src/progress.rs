//! Progress of long work: ticks and a request to stop.

use crate::Error;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// Shared between the thread that works and the one that shows a bar or catches an interrupt.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicU64,
    total: AtomicU64,
    cancelled: AtomicBool,
    heard: AtomicBool,
}

impl Progress {
    /// No work yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Announces `n` more units of work.
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

    /// Units done and announced.
    pub fn read(&self) -> (u64, u64) {
        (self.done.load(Relaxed), self.total.load(Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
