//! Files of a scene that change while it is viewed.

use crate::session::Session;
use organza::{Error, Progress};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

/// Time between two looks at the files.
const INTERVAL: Duration = Duration::from_millis(500);

/// Time between two looks whether it is to end.
const STEP: Duration = Duration::from_millis(50);

/// What a file system tells of a file: it has changed when this does.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Stamp {
    path: PathBuf,
    /// Time of the last change and size, bytes; `None` for what is not there.
    seen: Option<(SystemTime, u64)>,
}

fn stamps(session: &Session) -> Vec<Stamp> {
    let stamp = |path: PathBuf| {
        let meta = std::fs::metadata(&path).ok();
        let seen = meta.and_then(|meta| Some((meta.modified().ok()?, meta.len())));
        Stamp { path, seen }
    };
    session.files().into_iter().map(stamp).collect()
}

/// A thread that looks at the files of a session, and has it read them again when they change.
pub struct Watch {
    ending: Arc<Progress>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Begins to look.
    ///
    /// # Errors
    /// [`Error::Internal`] where the system has no thread for it.
    pub fn begin(session: &Arc<Session>) -> Result<Self, Error> {
        let ending = Arc::new(Progress::new());
        let session = Arc::clone(session);
        let is_over = Arc::clone(&ending);
        let thread = std::thread::Builder::new().name("watch".into()).spawn(move || look(&session, &is_over));
        let thread = thread.map_err(|e| Error::Internal(format!("a thread that watches files: {e}")))?;
        Ok(Self { ending, thread: Some(thread) })
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.ending.cancel();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn look(session: &Session, is_over: &Progress) {
    let mut known = stamps(session);
    // What is seen to change is read once it has stayed the same for an interval: a program may still be writing it.
    let mut before = known.clone();
    while !is_over.is_cancelled() {
        for _ in 0..INTERVAL.as_millis() / STEP.as_millis() {
            if is_over.is_cancelled() {
                return;
            }
            std::thread::sleep(STEP);
        }
        let now = stamps(session);
        if now != known && now == before {
            session.reload();
            // The scene may name other files now.
            known = stamps(session);
        }
        before = now;
    }
}
