//! A view without a window: events go in, pictures and the state come out.

use crate::accuracy::RungRow;
use crate::accuracy::compare::{Comparison, Kept, KeptRow};
use crate::artist::Artist;
use crate::curve::{CurveRow, number};
use crate::depths::PicturePlace;
use crate::depths::below::{Below, below};
pub use crate::desk::Failure;
use crate::desk::{Desk, Request, Seen};
use crate::event::{Cut, Event};
use crate::lights::{Direction, LightRow, direction_of, kind_of as kind_of_light};
use crate::picture::{Drawn, EffectRow, Facts, Level, Picture, Size};
use crate::recording::Recording;
use crate::replay::{EventFile, Replayed, replayed};
use crate::scene_text;
use crate::state::{History, Opening, Source};
use crate::viewpoint::Viewpoint;
use crate::wording::GivenNames;
use organza::output::Format;
use organza::scene::{self, Scene, SceneLight, SceneObject};
use organza::{Context, Error, Progress};
use serde::Serialize;
use splat_core::glam::DVec3;
use splat_core::{DAabb, Projection};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// How long a session waits for its artist when it ends: passes hear of it at their next step.
const FAREWELL: Duration = Duration::from_millis(600);

/// How long whoever asks for the place below the pointer waits for a coarse picture of it.
const LOOK_BELOW: Duration = Duration::from_secs(10);

/// How long a session that is to rest waits for its artist: passes hear of it at their next step.
const REST: Duration = Duration::from_secs(10);

/// Sessions that were begun in this process.
static SESSIONS: AtomicU64 = AtomicU64::new(0);

/// A scene that is viewed: its state, and the thread that draws it.
pub struct Session {
    /// Another one for each session of the process.
    number: u64,
    desk: Arc<Desk>,
    studio: Mutex<Studio>,
    /// The picture that was kept.
    kept: Mutex<Option<Keeping>>,
    artist: Mutex<Option<JoinHandle<()>>>,
}

/// A picture that was kept.
#[derive(Clone)]
struct Keeping {
    kept: Arc<Kept>,
    /// How the last picture that was compared differs from it.
    comparison: Option<Arc<Comparison>>,
}

/// A session that has begun.
pub struct Opened {
    /// The session.
    pub session: Session,
    /// The recorded events that are left out, a sentence for each.
    pub left_out: Vec<String>,
}

/// What events change.
struct Studio {
    title: String,
    names: GivenNames,
    is_fleeting: bool,
    source: Source,
    /// The scene as the command line has it.
    stated: Scene,
    /// Its objects.
    uncut: Arc<Vec<SceneObject>>,
    history: History,
    /// The scene of the state.
    scene: Scene,
    generation: u64,
    /// Grows when files are to be read anew.
    edition: u64,
    /// Whether the scene's text was read from its file; one that is made of data files has none.
    is_on_disk: bool,
    recording: Option<Recording>,
}

/// The state that a page shows beside the picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shown {
    /// The session: it is another one after a page has opened a file.
    pub session: u64,
    /// Grows with every change.
    pub version: u64,
    /// The state; a session's states are counted from 1.
    pub generation: u64,
    /// The names of the opened files.
    pub title: String,
    /// Size of the whole picture.
    pub size: Size,
    /// The viewpoint of the eye.
    pub viewpoint: ShownViewpoint,
    /// Stops.
    pub exposure: f64,
    /// The objects of the scene, in its order.
    pub objects: Vec<ObjectRow>,
    /// The lights of the scene, in its order.
    pub lights: Vec<LightRow>,
    /// The planes that cut objects open, beside those of the scene.
    pub cuts: Vec<Cut>,
    /// A box around everything, cut away or not; `None` before the first picture.
    pub bounds: Option<ShownBox>,
    /// Names of the maps that colour an object by a column.
    pub maps: Vec<&'static str>,
    /// The effects of the newest picture, with the present switches. The whole picture of the state counts as newest
    /// once it is drawn.
    pub effects: Vec<EffectRow>,
    /// Whether there is a step to take back.
    pub can_undo: bool,
    /// Whether there is a step that was taken back.
    pub can_redo: bool,
    /// The layer in the place of the beauty.
    pub layer: Option<String>,
    /// Settings from fast to exact; `None` before a page asks for them.
    pub accuracy: Option<ShownAccuracy>,
    /// The technique that was chosen; `None` for the technique that the scene states.
    pub technique: Option<String>,
    /// The picture that was kept.
    pub kept: Option<KeptRow>,
    /// The facts about the newest picture.
    pub picture: Option<Facts>,
    /// The picture in the making.
    pub drawing: Option<Drawing>,
    /// Whether the newest state has its whole picture, which can be saved.
    pub is_whole: bool,
    /// Why the newest state has no picture.
    pub failure: Option<Failure>,
}

/// Settings from fast to exact, as the page shows them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShownAccuracy {
    /// The position that was chosen; 0 is what the scene states.
    pub step: i32,
    /// The settings that were chosen, as `--set` takes them.
    pub set: Vec<String>,
    /// The positions, from the fastest; empty before a whole picture with the scene's stated settings is drawn.
    pub rungs: Vec<RungRow>,
    /// Whether times of some positions are still to be predicted.
    pub is_predicting: bool,
}

/// A box along the axes of the world, world units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShownBox {
    /// Its lowest corner.
    pub low: [f64; 3],
    /// Its highest corner.
    pub high: [f64; 3],
}

impl ShownBox {
    const fn new(bounds: &DAabb) -> Self {
        Self { low: bounds.min.to_array(), high: bounds.max.to_array() }
    }
}

/// The viewpoint of the eye, as the page shows it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShownViewpoint {
    /// Degrees about the pole.
    pub azimuth: f64,
    /// Degrees above the horizon.
    pub elevation: f64,
    /// World units between the eye and the centre.
    pub distance: f64,
    /// World position in the middle of the picture.
    pub centre: [f64; 3],
    /// Unit vector to the right of the picture, in the world.
    pub right: [f64; 3],
    /// Unit vector to its top.
    pub up: [f64; 3],
    /// Height of what the picture shows around the centre, world units.
    pub height: f64,
    /// Whether rays of the view are parallel.
    pub is_parallel: bool,
    /// The places of an eye that looks against the axes of the world, x, y and z.
    pub axes: Vec<Direction>,
}

impl ShownViewpoint {
    fn new(viewpoint: &Viewpoint) -> Self {
        Self {
            azimuth: viewpoint.azimuth.to_degrees(),
            elevation: viewpoint.elevation.to_degrees(),
            distance: viewpoint.distance,
            centre: viewpoint.centre.to_array(),
            right: viewpoint.right().to_array(),
            up: viewpoint.upwards().to_array(),
            height: viewpoint.height(),
            is_parallel: matches!(viewpoint.projection, Projection::Orthographic { .. }),
            axes: DVec3::AXES.map(|axis| viewpoint.direction_to(axis)).to_vec(),
        }
    }
}

/// An object, as a row of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectRow {
    /// Name of the object.
    pub name: String,
    /// The kind of its data, in a word.
    pub kind: &'static str,
    /// Whether it is drawn.
    pub visible: bool,
    /// Opacity of one crossing, 0 to 1; `None` for a medium, which has none.
    pub opacity: Option<f64>,
    /// The colour that it has by the scene or by the view, linear; `None` where its data tell it.
    pub color: Option<[f64; 3]>,
    /// Whether that is the view's.
    pub is_recolored: bool,
    /// Names of columns of its file that it can be coloured by.
    pub columns: Vec<String>,
    /// The column that was chosen; `None` for what the scene says.
    pub color_by: Option<String>,
    /// The map that was chosen for that.
    pub map: Option<String>,
    /// The technique that was chosen for it alone.
    pub technique: Option<String>,
    /// Whether it can have a colour of its own: a volume and a slice have those of their values.
    pub takes_color: bool,
    /// The transfer function of a volume.
    pub curve: Option<CurveRow>,
    /// A box around it, cut away or not; `None` before the first picture, and for an object without anything.
    pub bounds: Option<ShownBox>,
}

/// A picture in the making.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drawing {
    /// The stage at work.
    pub stage: String,
    /// Share done, 0 to 1.
    pub share: f64,
}

impl Session {
    /// Reads a scene, finds its camera, and begins to draw.
    ///
    /// # Errors
    /// Those of [`scene::parse`], and those of reading data where that places the camera.
    pub fn open(opening: Opening, progress: &Progress) -> Result<Self, Error> {
        Ok(Self::open_playing(opening, &EventFile::default(), progress)?.session)
    }

    /// The same with recorded events: what is drawn first is the state behind the last of them. Events that name an object or a light which the scene lacks
    /// are left out.
    ///
    /// # Errors
    /// As [`Session::open`]. [`Error::Input`] that names the place of an event for a scene that is refused with it, and for a column that its file lacks.
    pub fn open_playing(opening: Opening, played: &EventFile, progress: &Progress) -> Result<Opened, Error> {
        let Opening { title, inputs, is_fleeting, file, text, load, options, files } = opening;
        let is_on_disk = file.is_file();
        let source = Source { file, text, load };
        let mut stated = source.scene(source.load.overrides.clone())?;
        let context = Context { files: &files, options: &options, progress };
        let first = Viewpoint::of_scene(&organza::fitted(&stated, context)?.0);
        // Where the scene has its camera found, this is what lights go around.
        stated.target = first.centre;
        let names = GivenNames::new(&stated, &inputs);
        let Replayed { history, left_out } = replayed(played, &source, &stated, &first, context)?;
        let desk = Arc::new(Desk::new(first));
        let artist = Artist::new(files, options);
        let board = Arc::clone(&desk);
        let thread = std::thread::Builder::new().name("artist".into()).spawn(move || artist.work(&board));
        let thread = thread.map_err(|e| Error::Internal(format!("a thread that draws: {e}")))?;
        let scene = stated.clone();
        let uncut = Arc::new(stated.objects.clone());
        let mut studio = Studio {
            title,
            names,
            is_fleeting,
            source,
            stated,
            uncut,
            history: History::default(),
            scene,
            generation: 0,
            edition: 0,
            is_on_disk,
            recording: None,
        };
        studio.take(history, &desk)?;
        let number = SESSIONS.fetch_add(1, Ordering::Relaxed);
        let session =
            Self { number, desk, studio: Mutex::new(studio), kept: Mutex::new(None), artist: Mutex::new(Some(thread)) };
        Ok(Opened { session, left_out })
    }

    fn studio(&self) -> MutexGuard<'_, Studio> {
        // It is changed as a whole, after all that can fail.
        self.studio.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes events in, all of them or none, and asks for a picture of the state behind the last.
    ///
    /// # Errors
    /// Errors of the scene with these changes; the state is then as before.
    pub fn apply(&self, events: &[Event]) -> Result<(), Error> {
        let mut studio = self.studio();
        let first = self.desk.scene_viewpoint();
        let mut history = studio.history.clone();
        events.iter().try_for_each(|event| history.apply(event, &studio.stated, &first))?;
        if history.present() == studio.history.present() {
            // The picture in the making serves still.
            studio.history = history;
            self.desk.tell_change();
        } else {
            studio.take(history, &self.desk)?;
        }
        if let Some(Event::Done {}) = events.last() {
            self.desk.let_go();
        }
        if let Some(recording) = &mut studio.recording {
            recording.add(events);
        }
        Ok(())
    }

    /// Turns the scene around what is seen at a place of the picture: it comes to the middle, at the same distance. Whether there is anything.
    ///
    /// # Errors
    /// As [`Session::apply`].
    pub fn centre_on(&self, place: PicturePlace) -> Result<bool, Error> {
        let Some(depths) = self.desk.wait_for_depths(LOOK_BELOW) else { return Ok(false) };
        let Some(centre) = depths.point_at(place) else { return Ok(false) };
        let viewpoint =
            self.studio().history.present().viewpoint().copied().unwrap_or_else(|| self.desk.scene_viewpoint());
        self.apply(&[Event::LookFrom {
            azimuth: viewpoint.azimuth.to_degrees(),
            elevation: viewpoint.elevation.to_degrees(),
            distance: None,
            centre: Some(centre.to_array()),
        }])?;
        Ok(true)
    }

    fn kept(&self) -> MutexGuard<'_, Option<Keeping>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps the whole picture of the present state to compare others with, in the place of the one before; false while it is drawn.
    pub fn keep(&self) -> bool {
        let step = self.studio().history.present().accuracy().step;
        let picture = self.picture();
        let Some(drawn) = self.finished() else { return false };
        let Some(picture) = picture.filter(|picture| picture.facts.generation == drawn.generation) else {
            return false;
        };
        if picture.facts.level != Level::Whole {
            return false;
        }
        *self.kept() = Some(Keeping { kept: Arc::new(Kept::new(drawn, picture, step)), comparison: None });
        self.desk.tell_change();
        true
    }

    /// Lets the picture go that was kept.
    pub fn let_go(&self) {
        *self.kept() = None;
        self.desk.tell_change();
    }

    /// The picture that was kept.
    pub fn kept_picture(&self) -> Option<Arc<Picture>> {
        self.kept().as_ref().map(|keeping| Arc::clone(&keeping.kept.picture))
    }

    /// The difference between the whole picture of the present state and the kept picture; `None` without either.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that cannot be displayed.
    pub fn comparison(&self) -> Result<Option<Arc<Comparison>>, Error> {
        let Some(drawn) = self.finished() else { return Ok(None) };
        let Some(Keeping { kept, comparison }) = self.kept().clone() else { return Ok(None) };
        if let Some(known) = comparison.filter(|known| known.generation == drawn.generation) {
            return Ok(Some(known));
        }
        let found = Arc::new(kept.compared(&drawn)?);
        if let Some(keeping) = self.kept().as_mut().filter(|keeping| Arc::ptr_eq(&keeping.kept, &kept)) {
            keeping.comparison = Some(Arc::clone(&found));
        }
        Ok(Some(found))
    }

    /// The depth, the object and the data below a place of the picture; `None` before depths of the present view are
    /// known.
    pub fn below(&self, place: PicturePlace) -> Option<Below> {
        let depths = self.desk.depths()?;
        let scene = self.studio().scene.clone();
        Some(below(place, &scene, &depths, self.finished().as_deref(), |object| self.desk.data_of(object)))
    }

    /// Asks for settings from fast to exact, which [`Shown::accuracy`] has once the whole picture is drawn.
    pub fn ask_for_accuracy(&self) {
        self.desk.ask_for_rungs();
    }

    /// Lets everything go that was read and made, and draws nothing until [`Session::wake`]; false where that takes too long.
    pub(crate) fn rest(&self) -> bool {
        self.desk.rest(REST)
    }

    /// Draws again, with files that are read anew.
    pub(crate) fn wake(&self) {
        self.desk.wake();
        self.reload();
    }

    /// Whether its events are recorded.
    pub(crate) fn is_recording(&self) -> bool {
        self.studio().recording.is_some()
    }

    /// Records events from now on.
    pub fn record(&self, recording: Recording) {
        self.studio().recording = Some(recording);
    }

    /// Ends the recording; whether it holds as many events as one may.
    ///
    /// # Errors
    /// [`Error::Io`] where not all events could be written.
    pub fn end_recording(&self) -> Result<bool, Error> {
        let recording = self.studio().recording.take();
        recording.map_or(Ok(false), Recording::end)
    }

    /// The scene file and the files that it reads.
    pub fn files(&self) -> Vec<PathBuf> {
        self.studio().stated.files()
    }

    /// Reads the scene's file and its data anew, and asks for a picture with the present changes. A scene that is made of data files keeps its text.
    pub fn reload(&self) {
        let mut studio = self.studio();
        studio.edition += 1;
        if let Err(error) = studio.reread().and_then(|history| studio.take(history, &self.desk)) {
            self.desk.refuse(&error);
        }
    }

    /// The state that a page shows beside the picture.
    pub fn shown(&self) -> Shown {
        let studio = self.studio();
        let state = studio.history.present();
        let Seen { version, picture, failure, drawing, whole, effects, curves, boxes, columns, rungs, is_predicting } =
            self.desk.seen();
        let viewpoint = state.viewpoint().copied().unwrap_or_else(|| self.desk.scene_viewpoint());
        let row = |(rank, object): (usize, &SceneObject)| ObjectRow {
            name: object.name.clone(),
            kind: kind_of(&object.source),
            visible: object.visible,
            opacity: (!object.source.is_medium()).then(|| studio.scene.opacity_of(object)),
            color: object.color.map(|color| color.map(number)),
            columns: columns.get(&object.name).cloned().unwrap_or_default(),
            color_by: state.color_by_of(rank).map(|by| by.column.clone()),
            map: state.color_by_of(rank).and_then(|by| by.map.clone()),
            technique: state.technique_of(rank).map(str::to_owned),
            is_recolored: state.is_recolored(rank),
            takes_color: takes_color(object),
            curve: CurveRow::of_object(object, curves.get(&object.name)),
            bounds: boxes.get(&object.name).map(ShownBox::new),
        };
        let light = |(rank, light): (usize, &SceneLight)| LightRow {
            name: light.label.clone(),
            kind: kind_of_light(light),
            stops: state.stops_of(rank),
            direction: direction_of(light, studio.stated.target),
            shadow: light.shadow,
        };
        let switched = |effect: &EffectRow| EffectRow {
            switch: state.switch_of(&effect.name).unwrap_or(effect.switch),
            ..effect.clone()
        };
        let facts = picture.as_ref().map(|picture| &picture.facts);
        let effects = effects.as_deref().or(facts.map(|facts| facts.effects.as_slice())).unwrap_or_default();
        Shown {
            session: self.number,
            version,
            generation: studio.generation,
            title: studio.title.clone(),
            size: Size::of_scene(&studio.scene),
            viewpoint: ShownViewpoint::new(&viewpoint),
            exposure: studio.scene.render.exposure,
            objects: studio.scene.objects.iter().enumerate().map(row).collect(),
            lights: studio.scene.lights.iter().enumerate().map(light).collect(),
            cuts: state.cuts().to_vec(),
            bounds: boxes.values().copied().reduce(DAabb::union).as_ref().map(ShownBox::new),
            maps: scene::color_map_names().collect(),
            effects: effects.iter().map(switched).collect(),
            can_undo: studio.history.can_undo(),
            can_redo: studio.history.can_redo(),
            layer: state.layer().map(str::to_owned),
            accuracy: rungs.map(|rungs| ShownAccuracy {
                step: state.accuracy().step,
                set: state.accuracy().texts(),
                rungs,
                is_predicting,
            }),
            technique: state.technique().map(str::to_owned),
            kept: self.kept().as_ref().map(|keeping| keeping.kept.row.clone()),
            picture: picture.map(|picture| studio.names.in_facts(&picture.facts)),
            drawing: drawing.map(|(stage, share)| Drawing { stage, share }),
            is_whole: whole == Some(studio.generation),
            failure: failure.map(|failure| Failure { message: studio.names.in_text(&failure.message), ..failure }),
        }
    }

    /// The newest picture, if any is drawn yet.
    pub fn picture(&self) -> Option<Arc<Picture>> {
        self.desk.seen().picture
    }

    /// Waits for a first picture, coarse or whole, as long as `patience`.
    ///
    /// # Errors
    /// The reason why none is drawn.
    pub(crate) fn first_picture(&self, patience: Duration) -> Result<(), Failure> {
        let named = |failure: Failure| Failure { message: self.studio().names.in_text(&failure.message), ..failure };
        self.desk.wait_for_first(patience).map_err(named)
    }

    /// Waits for the whole picture of the present state.
    ///
    /// # Errors
    /// The reason why no whole picture is drawn.
    pub fn whole_picture(&self) -> Result<Arc<Picture>, Failure> {
        self.desk.wait_for_whole()
    }

    /// The last whole picture where it is that of the present state: what can be saved.
    pub(crate) fn finished(&self) -> Option<Arc<Drawn>> {
        let generation = self.studio().generation;
        self.desk.whole().filter(|whole| whole.generation == generation)
    }

    /// The file of the whole picture, as `organza render` writes it; `None` while it is drawn.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that the format cannot hold.
    pub fn file(&self, format: Format) -> Result<Option<Vec<u8>>, Error> {
        self.finished().map(|drawn| drawn.file(format)).transpose()
    }

    /// The scene of the present state as the text of a scene file, with the comments of the first.
    ///
    /// # Errors
    /// [`Error::Internal`] where the text would not be that of the same scene.
    pub fn scene_text(&self) -> Result<String, Error> {
        let studio = self.studio();
        let Studio { source, history, stated, scene, .. } = &*studio;
        let text = scene_text::changed(source, &source.overrides(history.present(), stated)?)?;
        // What is saved is read as what is seen, or is not saved.
        let load = scene::LoadOptions { overrides: Vec::new(), ..source.load.clone() };
        let mut read = scene::parse(&source.file, text.as_bytes(), &load)?;
        read.sha256.clone_from(&scene.sha256);
        let differs = || Error::Internal("the text of this scene is not read as the scene that is seen".into());
        if read != *scene {
            return Err(differs());
        }
        if studio.is_fleeting {
            return Ok(text);
        }
        let data: Vec<PathBuf> = scene.files().into_iter().filter(|file| *file != source.file).collect();
        let text = scene_text::anywhere(source, &text, &data)?;
        let load = scene::LoadOptions { allow_path: false, sandbox: false, ..load };
        let moved = scene::parse(&source.file, text.as_bytes(), &load)?;
        if moved.files().len() != scene.files().len() {
            return Err(differs());
        }
        Ok(text)
    }

    /// Whether the scene is written in JSON.
    pub(crate) fn is_json(&self) -> bool {
        self.studio().source.is_json()
    }

    /// Versions as they come.
    pub(crate) fn versions(&self) -> watch::Receiver<u64> {
        self.desk.versions()
    }

    /// Stops drawing, and waits a moment for that.
    pub fn close(&self) {
        self.desk.close();
        let thread = self.artist.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(thread) = thread else { return };
        let end = Instant::now() + FAREWELL;
        while !thread.is_finished() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(5));
        }
        // One that does not hear of it ends with the process.
        if thread.is_finished() {
            let _ = thread.join();
        }
    }
}

impl Studio {
    /// Takes steps in the place of the present ones, and asks for a picture of the last.
    ///
    /// # Errors
    /// What its scene is refused for; the present state stays.
    fn take(&mut self, history: History, desk: &Desk) -> Result<(), Error> {
        let state = history.present();
        let overrides = self.source.overrides(state, &self.stated)?;
        let told = self.source.told(&overrides);
        let scene = self.source.scene(overrides)?;
        let stated = if state.accuracy().set.is_empty() {
            scene.clone()
        } else {
            self.source.scene(self.source.overrides(&state.at_stated_accuracy(), &self.stated)?)?
        };
        self.generation += 1;
        desk.ask(Request {
            generation: self.generation,
            scene: scene.clone(),
            stated,
            uncut: Arc::clone(&self.uncut),
            accuracy: state.accuracy().clone(),
            told,
            edition: self.edition,
            has_own_camera: state.viewpoint().is_none(),
            layer: state.layer().map(str::to_owned),
        });
        self.history = history;
        self.scene = scene;
        Ok(())
    }

    /// Reads the scene's file again; the changes of objects and lights that it still has stay.
    fn reread(&mut self) -> Result<History, Error> {
        if !self.is_on_disk {
            return Ok(self.history.clone());
        }
        let text = scene::read(&self.source.file)?;
        let source = Source { text, file: self.source.file.clone(), load: self.source.load.clone() };
        let mut stated = source.scene(source.load.overrides.clone())?;
        if stated.fit.is_some() {
            stated.target = self.stated.target;
        }
        let history = self.history.of_another_scene(&self.stated, &stated);
        self.source = source;
        self.uncut = Arc::new(stated.objects.clone());
        self.stated = stated;
        Ok(history)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.close();
    }
}

/// Whether an object takes a colour: others have those of their values or of their labels.
fn takes_color(object: &SceneObject) -> bool {
    let has_values = matches!(object.source, scene::Source::Volume(_) | scene::Source::Slice(_));
    !has_values && object.field.is_none() && object.labels.is_none()
}

/// What an object is made of, in a word.
fn kind_of(source: &scene::Source) -> &'static str {
    use scene::Source;
    match source {
        Source::Mesh(_) => "mesh",
        Source::Points(_) => "points",
        Source::Matter(_) => "points as a medium",
        Source::Extract(_) => "extract",
        Source::Volume(_) => "volume",
        Source::Implicit(_) => "implicit surface",
        Source::Isosurface(_) => "isosurface",
        Source::LevelSet(_) => "level set",
        Source::Combined(_) => "solid",
        Source::Slice(_) => "slice",
        Source::Density(_) => "density",
        Source::Cloud(_) => "cloud",
        Source::Rectangle(_) => "rectangle",
        Source::Medium(_) => "medium",
    }
}
