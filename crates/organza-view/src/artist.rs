//! The thread that draws: of every request a coarse picture first, then the whole one, always the newest request alone.

use crate::accuracy::Scale;
use crate::coarse::{BUDGET, DEPTH_LAYER, Detail, OBJECT_LAYER, drawing_time};
use crate::curve::values_of;
use crate::depths::Depths;
use crate::depths::below::DataOfObject;
use crate::desk::{Desk, Job, Request, Task};
use crate::picture::{Drawn, Level};
use crate::viewpoint::Viewpoint;
use organza::scene::{Scene, SceneObject, Source, Technique};
use organza::{Context, Error, Files, Progress, Render, RenderOptions, Sequence};
use splat_core::LayerData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// How long a request has to be the newest before its whole picture is begun: events of a drag come more often.
const PAUSE: Duration = Duration::from_millis(120);

/// Pixels up to which a coarse picture comes before it is known whether the whole one is refused: a screen's.
const SURE_PIXELS: u64 = 1920 * 1200;

/// Coarse pictures that are drawn at rest until one keeps to its time, at most: pixels give way twice, and splats once or twice.
const MOST_TRIES: usize = 6;

/// What draws, and what it keeps from one picture to the next: files, splats and shadow maps where the camera alone has moved.
pub(crate) struct Artist {
    /// Coarse pictures.
    coarse: Sequence,
    /// Whole ones, once there was one.
    whole: Option<Sequence>,
    options: RenderOptions,
    detail: Detail,
    /// The detail that coarse pictures get while nobody waits, by the time of the last one; `None` where that had it.
    rested: Option<Detail>,
    /// The scene of the last request whose coarse pictures `points` refused.
    refused: Option<Scene>,
    /// Time and pixels of the last whole picture.
    last_whole: Option<Pace>,
    /// Settings from fast to exact.
    scale: Option<Scale>,
    /// The scene of the last whole picture, with the accuracy that it states.
    stated: Option<Scene>,
    /// Most pixels that were found to be within the limits.
    accepted: u64,
    /// What is read from disk has changed when this does.
    edition: u64,
}

/// How long a picture took, beside what serves the next view.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pace {
    time: Duration,
    pixels: u64,
}

impl Artist {
    pub(crate) fn new(files: Files, options: RenderOptions) -> Self {
        Self {
            coarse: Sequence::of_previews(files),
            whole: None,
            options,
            detail: Detail::default(),
            rested: None,
            refused: None,
            last_whole: None,
            scale: None,
            stated: None,
            accepted: SURE_PIXELS,
            edition: 0,
        }
    }

    /// Draws what comes to the desk until that is closed.
    pub(crate) fn work(mut self, desk: &Desk) {
        while let Some(job) = desk.take() {
            let request = match job {
                Job::Draw(request) => request,
                Job::Measure(request) => {
                    self.answer(desk, &request);
                    continue;
                }
                Job::Forget => {
                    self.forget();
                    desk.forget_values();
                    desk.rests();
                    continue;
                }
            };
            if request.edition != self.edition {
                self.forget();
                desk.forget_values();
                self.edition = request.edition;
            }
            let drawn = catch_unwind(AssertUnwindSafe(|| self.draw(desk, &request)));
            let outcome = drawn.unwrap_or_else(|_| {
                // What was kept may be half made.
                self.forget();
                Err(Error::Internal("drawing this picture failed; the next one begins from nothing".into()))
            });
            if let Err(error) = outcome {
                desk.fail(request.generation, &error);
            }
        }
    }

    /// Says of the last whole picture how exact it is; a failure leaves that open, for the picture is there.
    fn answer(&mut self, desk: &Desk, request: &Request) {
        let Some(stated) = self.stated.clone() else { return };
        let measured = catch_unwind(AssertUnwindSafe(|| self.measure(&stated, desk, request)));
        if measured.is_err() {
            // What was kept may be half made.
            self.forget();
        }
        desk.end();
    }

    /// Lets everything go that was read and made.
    fn forget(&mut self) {
        self.coarse = Sequence::of_previews(Files::default());
        self.whole = None;
        self.rested = None;
        self.refused = None;
        self.last_whole = None;
        self.scale = None;
        self.stated = None;
        self.accepted = SURE_PIXELS;
    }

    /// Draws a request, as far as no other comes.
    fn draw(&mut self, desk: &Desk, request: &Request) -> Result<(), Error> {
        let generation = request.generation;
        let progress = desk.begin(generation, Task::Coarse);
        let context = Context { files: self.coarse.files(), options: &self.options, progress: &progress };
        // Settled once for both levels: what `auto` chooses depends on the size of the picture.
        let (scene, found) = organza::settled(&request.scene, context)?;
        let scene = scene.into_owned();
        // Coarse pictures are as fast as they have to be, whatever the accuracy of the whole one.
        let stated = if request.accuracy.set.is_empty() {
            scene.clone()
        } else {
            organza::settled(&request.stated, context)?.0.into_owned()
        };
        if request.has_own_camera {
            let first =
                found.map_or_else(|| Viewpoint::of_scene(&scene), |f| Viewpoint::of_camera(&f.camera, f.target));
            desk.set_scene_viewpoint(first);
        }
        if desk.wants_rungs() {
            // What was measured of another scene, or from elsewhere, says nothing of this one.
            self.scale = self.scale.take().and_then(|mut scale| scale.forget_unless(&stated).then_some(scale));
            desk.keep_rungs(self.scale.as_ref().map_or_else(Vec::new, Scale::rows), true);
        }
        let pixels = scene.camera.pixels();
        if pixels > self.accepted {
            // Nobody is shown the beginning of a picture that is refused.
            let options = self.options.clone();
            self.whole().prepare(&scene, &options, &progress)?;
            self.accepted = pixels;
        }
        // Of another accuracy alone, the picture that is there shows more than a coarse one.
        let is_seen = self.stated.as_ref() == Some(&stated) && !request.accuracy.set.is_empty();
        if !is_seen && !self.is_fluent(&scene) {
            // The whole picture tells what is wrong, if that is not the coarse one alone.
            if let Err(Error::Cancelled) = self.draw_coarse(&stated, desk, request, &progress, Showing::Page) {
                return Err(Error::Cancelled);
            }
            if !desk.stays_newest(generation, PAUSE) {
                return Err(Error::Cancelled);
            }
            // The coarse picture has read the files.
            self.count_values(&scene, desk, generation)?;
        }
        let progress = desk.begin(generation, Task::Whole);
        let start = Instant::now();
        let options = self.options.clone();
        let render = self.whole().render(&scene, &options, &progress)?;
        // An average that was interrupted is a picture, but not that of the scene.
        if render.sets.is_some_and(|sets| sets.interrupted) {
            return Err(Error::Cancelled);
        }
        self.last_whole = Some(Pace { time: drawing_time(&render.cost), pixels });
        desk.publish(Drawn::new(render, &scene, request, Level::Whole, start.elapsed()))?;
        self.stated = Some(stated.clone());
        // What a first drag would wait for, and the depths below the pointer, are made while nobody waits.
        for _ in 0..MOST_TRIES {
            if desk.has_depths(generation) && self.rested.is_none() {
                break;
            }
            self.detail = self.rested.unwrap_or(self.detail);
            if !desk.stays_newest(generation, PAUSE) {
                return Err(Error::Cancelled);
            }
            let progress = desk.begin(generation, Task::Ahead);
            let drawn = self.draw_coarse(&stated, desk, request, &progress, Showing::Nobody);
            desk.end();
            match drawn {
                Ok(()) => {}
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                // The picture is there; what cannot be coarse has no place below the pointer.
                Err(_) => break,
            }
        }
        self.count_values(&scene, desk, generation)?;
        self.leave_data(&scene, desk);
        self.measure(&stated, desk, request)
    }

    /// Says of settings from fast to exact what they are predicted to take, and of the whole picture how exact it is, while nobody waits.
    fn measure(&mut self, stated: &Scene, desk: &Desk, request: &Request) -> Result<(), Error> {
        if !desk.wants_rungs() {
            return Ok(());
        }
        let generation = request.generation;
        let options = self.options.clone();
        let progress = desk.begin(generation, Task::Ahead);
        let mut scale = self.scale.take().filter(|scale| scale.is_of(stated));
        desk.keep_rungs(scale.as_ref().map_or_else(Vec::new, Scale::rows), true);
        if scale.is_none() {
            scale = match Scale::new(stated, self.whole(), &options, &progress) {
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                // The picture is there, and has no positions.
                found => found.unwrap_or(None),
            };
        }
        let Some(mut scale) = scale else {
            desk.end();
            desk.keep_rungs(Vec::new(), false);
            return Ok(());
        };
        scale.see(stated);
        desk.keep_rungs(scale.rows(), true);
        let mut tried = Vec::new();
        let predicted = loop {
            match scale.predict_next(self.whole(), &options, &progress, &mut tried) {
                Ok(true) if progress.is_cancelled() => break Err(Error::Cancelled),
                Ok(true) => desk.keep_rungs(scale.rows(), true),
                Ok(false) => break Ok(()),
                Err(error) => break Err(error),
            }
        };
        desk.keep_rungs(scale.rows(), false);
        let measured = predicted.and_then(|()| match desk.whole().filter(|whole| whole.generation == generation) {
            Some(drawn) => scale.measure(&request.accuracy, &drawn),
            None => Ok(()),
        });
        desk.keep_rungs(scale.rows(), false);
        desk.end();
        self.scale = Some(scale);
        measured
    }

    /// Counts how often the values of volumes occur, where that is not known.
    fn count_values(&self, scene: &Scene, desk: &Desk, generation: u64) -> Result<(), Error> {
        let is_volume = |object: &&SceneObject| object.visible && matches!(object.source, Source::Volume(_));
        for object in scene.objects.iter().filter(is_volume).filter(|object| !desk.has_values(&object.name)) {
            let progress = desk.begin(generation, Task::Ahead);
            let values = values_of(
                scene,
                object,
                Context { files: self.coarse.files(), options: &self.options, progress: &progress },
            );
            desk.end();
            if let Some(values) = values? {
                desk.keep_values(&object.name, values);
            }
        }
        Ok(())
    }

    /// Leaves what objects are made of on the desk, as far as files are kept: it is neither read anew nor held.
    fn leave_data(&self, scene: &Scene, desk: &Desk) {
        let files = self.coarse.files();
        for object in scene.objects.iter().filter(|object| object.visible) {
            let frame = if let Source::Volume(volume) = &object.source { volume.frame } else { 0 };
            if let (Source::Mesh(path) | Source::Points(path), None) = (&object.source, &object.labels) {
                desk.keep_columns(&object.name, files.columns(scene, path, frame));
            }
            let data = object.source.path().and_then(|path| files.kept(scene, path, frame));
            if let Some(data) = data.as_ref().and_then(DataOfObject::new) {
                desk.keep_data(&object.name, data);
            }
        }
    }

    /// The sequence of whole pictures, which begins with the files that coarse ones have read.
    fn whole(&mut self) -> &mut Sequence {
        let files = self.coarse.files();
        self.whole.get_or_insert_with(|| Sequence::of_files(files.clone()))
    }

    /// Whether the whole picture is as fast as a coarse one has to be, by the last one.
    fn is_fluent(&self, scene: &Scene) -> bool {
        self.last_whole.is_some_and(|pace| pace.time <= BUDGET && scene.camera.pixels() <= pace.pixels)
    }

    /// Draws a coarse picture and keeps its depths.
    fn draw_coarse(
        &mut self,
        scene: &Scene,
        desk: &Desk,
        request: &Request,
        progress: &Progress,
        showing: Showing,
    ) -> Result<(), Error> {
        let start = Instant::now();
        let (coarse, render) = self.render_coarse(scene, request, progress)?;
        if render.sets.is_some_and(|sets| sets.interrupted) {
            return Err(Error::Cancelled);
        }
        let time = start.elapsed();
        let boxes = coarse.objects.iter().zip(self.coarse.object_bounds());
        boxes.filter(|(_, bounds)| !bounds.is_empty()).for_each(|(object, bounds)| desk.keep_box(&object.name, bounds));
        let rested = self.detail.at_rest(&render.cost);
        // More pixels cost nothing before they are drawn.
        let is_rested = rested.share == self.detail.share && rested.divisor <= self.detail.divisor;
        self.rested = (!is_rested).then_some(rested);
        self.detail = match showing {
            Showing::Page => self.detail.next(&render.cost),
            Showing::Nobody => rested,
        };
        if let Some(depth) = render.layers.scalar(DEPTH_LAYER) {
            let object = match render.layers.images.get(OBJECT_LAYER) {
                Some(LayerData::Id(ids)) => ids.clone(),
                _ => Vec::new(),
            };
            let depth = depth.to_vec();
            desk.keep_depths(Depths { generation: request.generation, camera: coarse.camera, depth, object });
        }
        match showing {
            Showing::Page => desk.publish(Drawn::new(render, &coarse, request, Level::Coarse, time)),
            Showing::Nobody => Ok(()),
        }
    }

    /// A coarse picture by `points`, or by the scene's own technique where that refuses it.
    fn render_coarse(
        &mut self,
        scene: &Scene,
        request: &Request,
        progress: &Progress,
    ) -> Result<(Scene, Render), Error> {
        let layer = request.layer.as_deref();
        if !self.refused.as_ref().is_some_and(|refused| differ_in_camera_alone(refused, scene)) {
            let coarse = self.detail.of_scene(scene, layer, Some(Technique::Points));
            let whole = uncut(&coarse, &request.uncut);
            match self.coarse.preview(&coarse, &whole, &self.options, progress) {
                Ok(render) => return Ok((coarse, render)),
                Err(Error::Input { .. } | Error::Usage { .. } | Error::Scene(_) | Error::Limit(_)) => {
                    self.refused = Some(scene.clone());
                }
                Err(error) => return Err(error),
            }
        }
        let coarse = self.detail.of_scene(scene, layer, None);
        let render = self.coarse.render(&coarse, &self.options, progress)?;
        Ok((coarse, render))
    }
}

/// A scene before the view hid or cut objects of it.
fn uncut(scene: &Scene, objects: &[SceneObject]) -> Scene {
    let mut whole = scene.clone();
    for (object, before) in whole.objects.iter_mut().zip(objects) {
        object.visible |= before.visible;
        object.clip.clone_from(&before.clip);
    }
    whole
}

/// Who sees a coarse picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Showing {
    Page,
    /// Its depths are kept, and what was made for it.
    Nobody,
}

fn differ_in_camera_alone(a: &Scene, b: &Scene) -> bool {
    *a == Scene { camera: a.camera, target: a.target, sha256: a.sha256.clone(), ..b.clone() }
}
