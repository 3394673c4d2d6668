//! The desk between a session and its artist: the session leaves requests on it, the artist finished pictures. Only
//! the newest request counts.

use crate::accuracy::RungRow;
use crate::curve::Values;
use crate::depths::Depths;
use crate::depths::below::DataOfObject;
use crate::picture::{Drawn, EffectRow, Level, Picture};
use crate::state::Accuracy;
use crate::viewpoint::Viewpoint;
use crate::wording::{self, Said};
use organza::scene::{Scene, SceneObject};
use organza::{Error, Progress};
use serde::Serialize;
use splat_core::DAabb;
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// A scene that is to be drawn.
#[derive(Debug)]
pub(crate) struct Request {
    /// States of a session are counted from 1.
    pub(crate) generation: u64,
    pub(crate) scene: Scene,
    /// The same scene with the accuracy that it states.
    pub(crate) stated: Scene,
    /// Its objects before the view hid or cut any.
    pub(crate) uncut: Arc<Vec<SceneObject>>,
    /// The position between fast and exact.
    pub(crate) accuracy: Accuracy,
    /// What files tell of the scene.
    pub(crate) told: String,
    /// The layer that the page shows in the place of the beauty.
    pub(crate) layer: Option<String>,
    /// Grows when files are to be read anew.
    pub(crate) edition: u64,
    /// Whether the camera is the scene's own, whose place may follow from the data.
    pub(crate) has_own_camera: bool,
}

/// Why there is no picture of a state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// The state.
    pub generation: u64,
    /// The value that was found, and the expected one.
    pub message: String,
    /// The remedy; may be empty.
    pub hint: String,
}

impl Failure {
    fn of_error(generation: u64, error: &Error) -> Self {
        let Said { message, hint } = wording::said(error);
        Self { generation, message, hint }
    }
}

/// What the artist does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// A coarse picture, which is finished whatever comes, so that a long drag shows pictures.
    Coarse,
    /// A whole picture.
    Whole,
    /// What the next request will ask for; no page hears of it.
    Ahead,
}

/// A picture in the making.
struct AtWork {
    task: Task,
    progress: Arc<Progress>,
}

/// What the artist is to do next.
#[derive(Debug)]
pub(crate) enum Job {
    /// Draw a request.
    Draw(Arc<Request>),
    /// Say of the request whose whole picture is there how exact it is.
    Measure(Arc<Request>),
    /// Let everything go that was read and made.
    Forget,
}

/// What lies on the desk.
struct Papers {
    /// Grows with every change.
    version: u64,
    newest: Option<Arc<Request>>,
    /// Generation of the request that was taken last.
    taken: u64,
    /// Generation of the request that was the newest when the hand let go last.
    let_go: u64,
    at_work: Option<AtWork>,
    pictures: u64,
    picture: Option<Arc<Picture>>,
    whole: Option<Arc<Drawn>>,
    depths: Option<Arc<Depths>>,
    /// How often values of volumes occur, by the names of the objects.
    curves: BTreeMap<String, Values>,
    /// Boxes around what was drawn of objects, world units, by the objects' names.
    boxes: BTreeMap<String, DAabb>,
    /// Names of columns that objects can be coloured by, by the objects' names.
    columns: BTreeMap<String, Vec<String>>,
    /// What objects are made of, by their names.
    data: BTreeMap<String, DataOfObject>,
    /// Settings from fast to exact; `None` before a page asks for them.
    rungs: Option<Vec<RungRow>>,
    /// Whether the times of some of them are still to be predicted.
    is_predicting: bool,
    /// Whether they were asked for since a picture was measured.
    is_asked: bool,
    failure: Option<Failure>,
    /// The viewpoint of the camera that the scene states.
    scene_viewpoint: Viewpoint,
    /// Whether nothing is to be drawn, and whether what was read and made is forgotten since.
    is_resting: bool,
    is_forgotten: bool,
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
    /// Effects of the last whole picture: a coarse one has a plan of its own.
    pub(crate) effects: Option<Vec<EffectRow>>,
    /// How often values of volumes occur, by the names of the objects.
    pub(crate) curves: BTreeMap<String, Values>,
    /// Boxes around what was drawn of objects, world units, by the objects' names.
    pub(crate) boxes: BTreeMap<String, DAabb>,
    /// Names of columns that objects can be coloured by, by the objects' names.
    pub(crate) columns: BTreeMap<String, Vec<String>>,
    /// Settings from fast to exact; `None` before a page asks for them.
    pub(crate) rungs: Option<Vec<RungRow>>,
    /// Whether the times of some of them are still to be predicted.
    pub(crate) is_predicting: bool,
}

impl Desk {
    pub(crate) fn new(scene_viewpoint: Viewpoint) -> Self {
        let papers = Papers {
            version: 0,
            newest: None,
            taken: 0,
            let_go: 0,
            at_work: None,
            pictures: 0,
            picture: None,
            whole: None,
            depths: None,
            curves: BTreeMap::new(),
            boxes: BTreeMap::new(),
            columns: BTreeMap::new(),
            data: BTreeMap::new(),
            rungs: None,
            is_predicting: false,
            is_asked: false,
            failure: None,
            scene_viewpoint,
            is_resting: false,
            is_forgotten: false,
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

    /// Tells whoever waits that something beside the pictures has changed.
    pub(crate) fn tell_change(&self) {
        self.tell(self.papers());
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
            drawing: papers
                .at_work
                .as_ref()
                .filter(|at_work| at_work.task != Task::Ahead)
                .map(|at_work| at_work.progress.report()),
            whole: papers.whole.as_ref().map(|whole| whole.generation),
            effects: papers.whole.as_ref().map(|whole| whole.effects().to_vec()),
            curves: papers.curves.clone(),
            boxes: papers.boxes.clone(),
            columns: papers.columns.clone(),
            rungs: papers.rungs.clone(),
            is_predicting: papers.is_predicting,
        }
    }

    /// The last whole picture.
    pub(crate) fn whole(&self) -> Option<Arc<Drawn>> {
        self.papers().whole.clone()
    }

    /// The viewpoint of the scene's own camera.
    pub(crate) fn scene_viewpoint(&self) -> Viewpoint {
        self.papers().scene_viewpoint
    }

    pub(crate) fn set_scene_viewpoint(&self, viewpoint: Viewpoint) {
        self.papers().scene_viewpoint = viewpoint;
    }

    /// Asks for a picture in the place of all others. What is in the making is stopped, unless it is a coarse picture.
    pub(crate) fn ask(&self, request: Request) {
        let mut papers = self.papers();
        if let Some(AtWork { task: Task::Whole | Task::Ahead, progress }) = &papers.at_work {
            progress.cancel();
        }
        papers.failure = None;
        papers.newest = Some(Arc::new(request));
        self.tell(papers);
    }

    /// The hand has let go: the newest request is unlikely to be followed by another at once.
    pub(crate) fn let_go(&self) {
        let mut papers = self.papers();
        papers.let_go = papers.newest.as_ref().map_or(0, |newest| newest.generation);
        self.changed.notify_all();
    }

    /// Has the artist forget what it read and made, and draw nothing until [`Desk::wake`]; false where that takes too long.
    pub(crate) fn rest(&self, patience: Duration) -> bool {
        let end = Instant::now() + patience;
        let mut papers = self.papers();
        papers.is_resting = true;
        papers.is_forgotten = false;
        papers.at_work.iter().for_each(|at_work| at_work.progress.cancel());
        self.changed.notify_all();
        loop {
            let left = end.saturating_duration_since(Instant::now());
            if papers.is_forgotten || papers.is_closed || left.is_zero() {
                return papers.is_forgotten;
            }
            papers = self.changed.wait_timeout(papers, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Everything is forgotten that was read and made.
    pub(crate) fn rests(&self) {
        let mut papers = self.papers();
        papers.is_forgotten = true;
        self.tell(papers);
    }

    /// Has the artist draw again.
    pub(crate) fn wake(&self) {
        let mut papers = self.papers();
        papers.is_resting = false;
        self.tell(papers);
    }

    /// Ends all work.
    pub(crate) fn close(&self) {
        let mut papers = self.papers();
        papers.is_closed = true;
        papers.at_work.iter().for_each(|at_work| at_work.progress.cancel());
        self.tell(papers);
    }

    /// Waits for a request that was not taken yet, or for a question about the last one; `None` where the desk is closed.
    pub(crate) fn take(&self) -> Option<Job> {
        let mut papers = self.papers();
        loop {
            if papers.is_closed {
                return None;
            }
            if papers.is_resting {
                if !papers.is_forgotten {
                    return Some(Job::Forget);
                }
                papers = self.changed.wait(papers).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            let newest = papers.newest.clone().filter(|request| request.generation > papers.taken);
            if let Some(request) = newest {
                papers.taken = request.generation;
                return Some(Job::Draw(request));
            }
            if std::mem::take(&mut papers.is_asked) {
                let whole = papers.whole.as_ref().map(|whole| whole.generation);
                let drawn = papers.newest.clone().filter(|request| Some(request.generation) == whole);
                if let Some(request) = drawn {
                    return Some(Job::Measure(request));
                }
                // The next whole picture is measured.
            }
            papers = self.changed.wait(papers).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Begins a task for a request: its progress, which stops where the desk is closed or, unless the picture is coarse, where another request comes.
    pub(crate) fn begin(&self, generation: u64, task: Task) -> Arc<Progress> {
        let mut papers = self.papers();
        let progress = Arc::new(Progress::new());
        let is_old = papers.newest.as_ref().is_some_and(|newest| newest.generation > generation);
        if papers.is_closed || papers.is_resting || (task != Task::Coarse && is_old) {
            progress.cancel();
        }
        papers.at_work = Some(AtWork { task, progress: Arc::clone(&progress) });
        progress
    }

    /// Ends a task of which no page hears.
    pub(crate) fn end(&self) {
        self.papers().at_work = None;
    }

    /// Keeps the depths of a coarse picture, in the place of those before.
    pub(crate) fn keep_depths(&self, depths: Depths) {
        let mut papers = self.papers();
        papers.depths = Some(Arc::new(depths));
        self.tell(papers);
    }

    /// Keeps the names of columns that an object can be coloured by.
    pub(crate) fn keep_columns(&self, object: &str, columns: Vec<String>) {
        let mut papers = self.papers();
        if papers.columns.get(object) != Some(&columns) {
            papers.columns.insert(object.to_owned(), columns);
            self.tell(papers);
        }
    }

    /// Keeps a box around what was drawn of an object, beside what was drawn before: a cut leaves less, and may go back.
    pub(crate) fn keep_box(&self, object: &str, bounds: DAabb) {
        let mut papers = self.papers();
        let known = papers.boxes.get(object).copied();
        let whole = known.map_or(bounds, |before| before.union(bounds));
        if known != Some(whole) {
            papers.boxes.insert(object.to_owned(), whole);
            self.tell(papers);
        }
    }

    /// Keeps how often values of a volume occur.
    pub(crate) fn keep_values(&self, object: &str, values: Values) {
        let mut papers = self.papers();
        papers.curves.insert(object.to_owned(), values);
        self.tell(papers);
    }

    /// Asks for settings from fast to exact, where nobody has asked before.
    pub(crate) fn ask_for_rungs(&self) {
        let mut papers = self.papers();
        if papers.rungs.is_none() {
            papers.rungs = Some(Vec::new());
            papers.is_predicting = true;
            papers.is_asked = true;
            self.tell(papers);
        }
    }

    /// Whether a page has asked for settings from fast to exact.
    pub(crate) fn wants_rungs(&self) -> bool {
        self.papers().rungs.is_some()
    }

    /// Keeps settings from fast to exact, in the place of those before.
    pub(crate) fn keep_rungs(&self, rungs: Vec<RungRow>, is_predicting: bool) {
        let mut papers = self.papers();
        if papers.rungs.as_ref() != Some(&rungs) || papers.is_predicting != is_predicting {
            papers.rungs = Some(rungs);
            papers.is_predicting = is_predicting;
            self.tell(papers);
        }
    }

    /// Forgets what is known of data.
    pub(crate) fn forget_values(&self) {
        let mut papers = self.papers();
        papers.boxes.clear();
        papers.columns.clear();
        papers.curves.clear();
        papers.data.clear();
    }

    /// Keeps what an object is made of, for as long as something else does.
    pub(crate) fn keep_data(&self, object: &str, data: DataOfObject) {
        self.papers().data.insert(object.to_owned(), data);
    }

    /// What an object is made of.
    pub(crate) fn data_of(&self, object: &str) -> Option<DataOfObject> {
        self.papers().data.get(object).cloned()
    }

    /// The depths of the newest request, where they are there.
    pub(crate) fn depths(&self) -> Option<Arc<Depths>> {
        let papers = self.papers();
        let generation = papers.newest.as_ref().map_or(0, |newest| newest.generation);
        papers.depths.clone().filter(|depths| depths.generation == generation)
    }

    /// Whether it is known how often values of a volume occur.
    pub(crate) fn has_values(&self, object: &str) -> bool {
        self.papers().curves.contains_key(object)
    }

    /// Whether there are depths of a state.
    pub(crate) fn has_depths(&self, generation: u64) -> bool {
        self.papers().depths.as_ref().is_some_and(|depths| depths.generation == generation)
    }

    /// Waits for the depths of the newest request; `None` where they do not come in time.
    pub(crate) fn wait_for_depths(&self, patience: Duration) -> Option<Arc<Depths>> {
        let end = Instant::now() + patience;
        let mut papers = self.papers();
        loop {
            let generation = papers.newest.as_ref().map_or(0, |newest| newest.generation);
            if let Some(depths) = papers.depths.as_ref().filter(|depths| depths.generation == generation) {
                return Some(Arc::clone(depths));
            }
            let left = end.saturating_duration_since(Instant::now());
            let has_failed = papers.failure.as_ref().is_some_and(|failure| failure.generation == generation);
            if papers.is_closed || has_failed || left.is_zero() {
                return None;
            }
            papers = self.changed.wait_timeout(papers, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Waits a while for another request, unless the hand has let go; whether this one is still the newest, and the desk open.
    pub(crate) fn stays_newest(&self, generation: u64, patience: Duration) -> bool {
        let end = Instant::now() + patience;
        let mut papers = self.papers();
        loop {
            let is_newest = papers.newest.as_ref().is_some_and(|newest| newest.generation == generation);
            let left = end.saturating_duration_since(Instant::now());
            let has_let_go = papers.let_go == generation;
            if papers.is_closed || !is_newest || has_let_go || left.is_zero() {
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

    /// Says why the present state cannot be made anew; its picture stays.
    pub(crate) fn refuse(&self, error: &Error) {
        let mut papers = self.papers();
        let generation = papers.newest.as_ref().map_or(0, |newest| newest.generation);
        papers.failure = Some(Failure::of_error(generation, error));
        self.tell(papers);
    }

    /// Says that there is no picture of a state, where it is still the newest.
    pub(crate) fn fail(&self, generation: u64, error: &Error) {
        let mut papers = self.papers();
        papers.at_work = None;
        let is_newest = papers.newest.as_ref().is_some_and(|newest| newest.generation == generation);
        if is_newest && !matches!(error, Error::Cancelled) {
            papers.failure = Some(Failure::of_error(generation, error));
        }
        self.tell(papers);
    }

    /// Waits for a first picture, whole or coarse, or for the reason why there is none; after `patience` nothing is known against it.
    pub(crate) fn wait_for_first(&self, patience: Duration) -> Result<(), Failure> {
        let end = Instant::now() + patience;
        let mut papers = self.papers();
        loop {
            if let Some(failure) = papers.failure.clone() {
                return Err(failure);
            }
            let left = end.saturating_duration_since(Instant::now());
            if papers.picture.is_some() || papers.is_closed || left.is_zero() {
                return Ok(());
            }
            papers = self.changed.wait_timeout(papers, left).unwrap_or_else(PoisonError::into_inner).0;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use organza::scene::{LoadOptions, parse};

    const SCENE: &[u8] = br#"
        version = 1
        [camera]
        position = [0, 0, 2]
        target = [0, 0, 0]
        size = [8, 8]
        [[object]]
        name = "pane"
        rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.5 }
    "#;

    fn request(generation: u64) -> Request {
        let scene = parse("pane.toml".as_ref(), SCENE, &LoadOptions::default()).unwrap();
        Request {
            generation,
            stated: scene.clone(),
            scene,
            uncut: Arc::default(),
            accuracy: Accuracy::default(),
            told: String::new(),
            layer: None,
            edition: 0,
            has_own_camera: true,
        }
    }

    #[test]
    fn nobody_waits_once_the_hand_has_let_go() {
        let desk = Desk::new(Viewpoint::of_scene(&request(1).scene));
        let hour = Duration::from_secs(3600);
        desk.ask(request(1));
        desk.let_go();
        // Both would last an hour.
        assert!(desk.stays_newest(1, hour));
        desk.ask(request(2));
        assert!(!desk.stays_newest(1, hour));
        // Another drag is another wait.
        assert!(desk.stays_newest(2, Duration::ZERO) && desk.papers().let_go == 1);
        desk.close();
        assert!(!desk.stays_newest(2, hour));
    }
}
