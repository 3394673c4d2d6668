//! What the system's signals do to the command: an interrupt stops the work that is going on, and what was ignored when the command began
//! stays ignored.

use crate::console;
use organza::{Error, Progress};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time that the work has to hear of an interrupt: where it asks for none so long, it is ended as by a second one.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Interrupts so soon after the first are the same one: a terminal sends it to a program and to the one that started it, which passes it on.
const TOGETHER: Duration = Duration::from_millis(300);

/// Exit code of a limit of resources, [`Error::Limit`]'s.
#[cfg(unix)]
const LIMIT: i32 = 5;

/// The work that an interrupt stops; without any it ends the command.
static AT_WORK: Mutex<Option<Arc<Progress>>> = Mutex::new(None);

/// Blocks the signals that should not end this process, for this thread and all that it starts: SIGXFSZ, so that a write beyond
/// `ulimit -f` is an error with a message, and those that were ignored when the command began, as `nohup` and shells leave them.
#[cfg(unix)]
pub(crate) fn block_ignored() {
    use nix::sys::signal::{SigSet, Signal};
    let mut blocked = SigSet::empty();
    blocked.add(Signal::SIGXFSZ);
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = ignored(&status);
    for signal in [Signal::SIGHUP, Signal::SIGINT, Signal::SIGTERM] {
        if ignored >> (signal as u64 - 1) & 1 == 1 {
            blocked.add(signal);
        }
    }
    // Where it fails, signals do what they did before.
    let _ = blocked.thread_block();
}

#[cfg(not(unix))]
pub(crate) fn block_ignored() {}

/// A system that refuses memory in the middle of the work ends the command with the exit code of a limit: the standard library says how much was
/// asked for, and aborts.
#[cfg(unix)]
pub(crate) fn end_aborts_as_limits() -> Result<(), Error> {
    use signal_hook::{consts::SIGABRT, flag};
    use std::sync::atomic::AtomicBool;
    let always = Arc::new(AtomicBool::new(true));
    let registered = flag::register_conditional_shutdown(SIGABRT, LIMIT, always);
    registered.map(drop).map_err(|e| Error::Internal(format!("handler of aborts: {e}")))
}

#[cfg(not(unix))]
pub(crate) fn end_aborts_as_limits() -> Result<(), Error> {
    Ok(())
}

/// The mask of ignored signals that Linux tells of a process, bit n − 1 for signal n; 0 where it tells none.
fn ignored(status: &str) -> u64 {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// From now on an interrupt stops the work at its next tick, or ends the command where there is none, where the work does not hear of it
/// within two seconds, and the second time, if that is not [`TOGETHER`] with the first.
pub(crate) fn listen() -> Result<(), Error> {
    let first: Mutex<Option<Instant>> = Mutex::new(None);
    let handler = move || {
        let Some(progress) = at_work().clone() else { end_at_once() };
        let mut first = first.lock().unwrap_or_else(PoisonError::into_inner);
        match *first {
            None => *first = Some(Instant::now()),
            Some(then) if then.elapsed() < TOGETHER => return,
            Some(_) => end_at_once(),
        }
        progress.cancel();
        std::thread::spawn(move || {
            std::thread::sleep(PATIENCE);
            if !progress.is_heard() {
                end_at_once();
            }
        });
    };
    ctrlc::set_handler(handler).map_err(|e| Error::Internal(format!("interrupt handler: {e}")))
}

/// Work that an interrupt stops from now on.
pub(crate) fn stops(progress: &Arc<Progress>) {
    *at_work() = Some(Arc::clone(progress));
}

fn at_work() -> std::sync::MutexGuard<'static, Option<Arc<Progress>>> {
    AT_WORK.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Outputs are whole or not there at any time.
fn end_at_once() -> ! {
    console::note("error: interrupted\n");
    organza::output::abandon();
    crate::render::film::abandon();
    std::process::exit(i32::from(Error::Cancelled.exit_code()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn ignored_signals_are_told_by_their_mask() {
        let status =
            "Name:\torganza\nSigBlk:\t00000000ffffffff\nSigIgn:\t0000000000001001\nSigCgt:\t0000000000000000\n";
        assert_eq!(super::ignored(status), 0x1001);
        assert_eq!(super::ignored("Name:\torganza\n"), 0);
    }
}
