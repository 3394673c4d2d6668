//! Where a session leaves what is to be drawn, and the artist what is drawn. Only the newest request counts.

use crate::picture::{Drawn, Level, Picture};
use crate::viewpoint::Viewpoint;
use organza::scene::Scene;
use organza::{Error, Progress};
use serde::Serialize;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// A scene that is to be drawn.
#[derive(Debug)]
pub(crate) struct Request {
    /// States of a session are counted from 1.
    pub(crate) generation: u64,
    pub(crate) scene: Scene,
    /// What files tell of the scene.
    pub(crate) told: String,
    /// Whether the camera is the scene's own, whose place may follow from the data.
    pub(crate) has_own_camera: bool,
}

/// Why there is no picture of a state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// The state.
    pub generation: u64,
    /// What was found and what was expected.
    pub message: String,
    /// What to do; may be empty.
    pub hint: String,
}

/// A picture in the making.
struct AtWork {
    level: Level,
    progress: Arc<Progress>,
}

/// What lies on the desk.
struct Papers {
    /// Grows with every change.
    version: u64,
    newest: Option<Arc<Request>>,
    /// Generation of the request that was taken last.
    taken: u64,
    at_work: Option<AtWork>,
    pictures: u64,
    picture: Option<Arc<Picture>>,
    whole: Option<Arc<Drawn>>,
    failure: Option<Failure>,
    /// The viewpoint of the scene's own camera.
    own: Viewpoint,
    is_closed: bool,
}

/// Shared by a session, its artist, and who waits for pictures.
pub(crate) struct Desk {
    papers: Mutex<Papers>,
    changed: Condvar,
    versions: watch::Sender<u64>,
}

/// What the desk shows at one time.
pub(crate) struct Seen {
    pub(crate) version: u64,
    pub(crate) picture: Option<Arc<Picture>>,
    pub(crate) failure: Option<Failure>,
    /// Stage and share done of the picture in the making.
    pub(crate) drawing: Option<(String, f64)>,
    /// Generation of the last whole picture.
    pub(crate) whole: Option<u64>,
}

impl Desk {
    pub(crate) fn new(own: Viewpoint) -> Self {
        let papers = Papers {
            version: 0,
            newest: None,
            taken: 0,
            at_work: None,
            pictures: 0,
            picture: None,
            whole: None,
            failure: None,
            own,
            is_closed: false,
        };
        Self { papers: Mutex::new(papers), changed: Condvar::new(), versions: watch::Sender::new(0) }
    }

    fn papers(&self) -> MutexGuard<'_, Papers> {
        // Papers are whole after each statement.
        self.papers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, mut papers: MutexGuard<'_, Papers>) {
        papers.version += 1;
        let version = papers.version;
        // Whoever is told looks at the papers: they are free by then.
        drop(papers);
        self.versions.send_if_modified(|told| {
            let is_news = version > *told;
            *told = version.max(*told);
            is_news
        });
        self.changed.notify_all();
    }

    /// Versions as they come.
    pub(crate) fn versions(&self) -> watch::Receiver<u64> {
        self.versions.subscribe()
    }

    pub(crate) fn seen(&self) -> Seen {
        let papers = self.papers();
        Seen {
            version: papers.version,
            picture: papers.picture.clone(),
            failure: papers.failure.clone(),
            drawing: papers.at_work.as_ref().map(|at_work| at_work.progress.report()),
            whole: papers.whole.as_ref().map(|whole| whole.generation),
        }
    }

    /// The last whole picture.
    pub(crate) fn whole(&self) -> Option<Arc<Drawn>> {
        self.papers().whole.clone()
    }

    /// The viewpoint of the scene's own camera.
    pub(crate) fn own(&self) -> Viewpoint {
        self.papers().own
    }

    pub(crate) fn set_own(&self, own: Viewpoint) {
        self.papers().own = own;
    }

    /// Asks for a picture in the place of all others. A whole one in the making is stopped; a coarse one is finished, so that a long drag shows pictures.
    pub(crate) fn ask(&self, request: Request) {
        let mut papers = self.papers();
        if let Some(AtWork { level: Level::Whole, progress }) = &papers.at_work {
            progress.cancel();
        }
        papers.failure = None;
        papers.newest = Some(Arc::new(request));
        self.tell(papers);
    }

    /// Ends all work.
    pub(crate) fn close(&self) {
        let mut papers = self.papers();
        papers.is_closed = true;
        papers.at_work.iter().for_each(|at_work| at_work.progress.cancel());
        self.tell(papers);
    }

    /// Waits for a request that was not taken yet; `None` where the desk is closed.
    pub(crate) fn take(&self) -> Option<Arc<Request>> {
        let mut papers = self.papers();
        loop {
            if papers.is_closed {
                return None;
            }
            let newest = papers.newest.clone().filter(|request| request.generation > papers.taken);
            if let Some(request) = newest {
                papers.taken = request.generation;
                return Some(request);
            }
            papers = self.changed.wait(papers).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Begins a picture of a request: its progress, which stops where the desk is closed or, of a whole one, where another request comes.
    pub(crate) fn begin(&self, generation: u64, level: Level) -> Arc<Progress> {
        let mut papers = self.papers();
        let progress = Arc::new(Progress::new());
        let is_old = papers.newest.as_ref().is_some_and(|newest| newest.generation > generation);
        if papers.is_closed || (level == Level::Whole && is_old) {
            progress.cancel();
        }
        papers.at_work = Some(AtWork { level, progress: Arc::clone(&progress) });
        progress
    }

    /// Waits a while for another request; whether this one is still the newest, and the desk open.
    pub(crate) fn stays_newest(&self, generation: u64, patience: Duration) -> bool {
        let end = Instant::now() + patience;
        let mut papers = self.papers();
        loop {
            let is_newest = papers.newest.as_ref().is_some_and(|newest| newest.generation == generation);
            let left = end.saturating_duration_since(Instant::now());
            if papers.is_closed || !is_newest || left.is_zero() {
                return is_newest && !papers.is_closed;
            }
            papers = self.changed.wait_timeout(papers, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Hands a picture out.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that PNG cannot hold.
    pub(crate) fn publish(&self, drawn: Drawn) -> Result<(), Error> {
        let number = self.papers().pictures + 1;
        // Encoding takes a while: nobody waits for the papers meanwhile. One artist publishes, so the number stays free.
        let picture = Arc::new(drawn.picture(number)?);
        let mut papers = self.papers();
        papers.pictures = number;
        papers.picture = Some(picture);
        papers.at_work = None;
        if drawn.level == Level::Whole {
            papers.whole = Some(Arc::new(drawn));
        }
        self.tell(papers);
        Ok(())
    }

    /// Says that there is no picture of a state, where it is still the newest.
    pub(crate) fn fail(&self, generation: u64, error: &Error) {
        let mut papers = self.papers();
        papers.at_work = None;
        let is_newest = papers.newest.as_ref().is_some_and(|newest| newest.generation == generation);
        if is_newest && !matches!(error, Error::Cancelled) {
            papers.failure = Some(Failure { generation, message: error.to_string(), hint: error.hint().to_owned() });
        }
        self.tell(papers);
    }

    /// Waits for the whole picture of the newest request.
    pub(crate) fn wait_for_whole(&self) -> Result<Arc<Picture>, Failure> {
        let mut papers = self.papers();
        loop {
            let generation = papers.newest.as_ref().map_or(0, |newest| newest.generation);
            if let Some(failure) = papers.failure.as_ref().filter(|failure| failure.generation == generation) {
                return Err(failure.clone());
            }
            let is_done =
                |picture: &&Arc<Picture>| picture.facts.level == Level::Whole && picture.facts.generation == generation;
            if let Some(picture) = papers.picture.as_ref().filter(is_done) {
                return Ok(Arc::clone(picture));
            }
            if papers.is_closed {
                return Err(Failure { generation, message: "the view is closed".into(), hint: String::new() });
            }
            papers = self.changed.wait(papers).unwrap_or_else(PoisonError::into_inner);
        }
    }
}
