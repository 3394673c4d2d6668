//! The thread that draws: of every request a coarse picture first, then the whole one, always the newest request alone.

use crate::desk::{Desk, Request};
use crate::picture::{Drawn, Level, Size};
use crate::viewpoint::Viewpoint;
use organza::scene::Scene;
use organza::{Error, Files, Progress, RenderOptions, Sequence};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// A picture that takes no longer follows a drag.
const FLUENT: Duration = Duration::from_millis(100);

/// How long a request has to be the newest before its whole picture is begun: events of a drag come more often.
const PAUSE: Duration = Duration::from_millis(120);

/// Most pixels of the whole picture along each side of one of the coarse picture.
const COARSEST: u32 = 8;

/// What draws, and what it keeps from one picture to the next: files, splats and shadow maps where the camera alone has moved.
pub(crate) struct Artist {
    sequence: Sequence,
    options: RenderOptions,
    /// Pixels of the whole picture along each side of one of the coarse picture.
    divisor: u32,
    /// Time and pixels of the last whole picture.
    last_whole: Option<Pace>,
}

/// How long a picture took.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pace {
    time: Duration,
    pixels: u64,
}

impl Artist {
    pub(crate) fn new(files: Files, options: RenderOptions) -> Self {
        Self { sequence: Sequence::of_files(files), options, divisor: 4, last_whole: None }
    }

    /// Draws what comes to the desk until that is closed.
    pub(crate) fn work(mut self, desk: &Desk) {
        while let Some(request) = desk.take() {
            let drawn = catch_unwind(AssertUnwindSafe(|| self.draw(desk, &request)));
            let outcome = drawn.unwrap_or_else(|_| {
                // What was kept may be half made.
                self.sequence = Sequence::default();
                Err(Error::Internal("drawing this picture failed; the next one begins from nothing".into()))
            });
            if let Err(error) = outcome {
                desk.fail(request.generation, &error);
            }
        }
    }

    /// Draws a request, as far as no other comes.
    fn draw(&mut self, desk: &Desk, request: &Request) -> Result<(), Error> {
        let generation = request.generation;
        let progress = desk.begin(generation, Level::Coarse);
        // Settled once for both levels: what `auto` chooses depends on the size of the picture.
        let (scene, found) = organza::settled(&request.scene, &self.options, &progress, self.sequence.files())?;
        let scene = scene.into_owned();
        if request.has_own_camera {
            let first =
                found.map_or_else(|| Viewpoint::of_scene(&scene), |f| Viewpoint::of_camera(&f.camera, f.target));
            desk.set_own(first);
        }
        if !self.is_fluent(&scene) {
            let mut coarse = scene.clone();
            let size = Size::of_scene(&scene).divided(self.divisor);
            coarse.camera.size = [size.width, size.height];
            let drawn = self.render(&coarse, request, Level::Coarse, &progress)?;
            self.divisor = next_divisor(self.divisor, drawn.time);
            desk.publish(drawn)?;
            if !desk.stays_newest(generation, PAUSE) {
                return Err(Error::Cancelled);
            }
        }
        let progress = desk.begin(generation, Level::Whole);
        let drawn = self.render(&scene, request, Level::Whole, &progress)?;
        self.last_whole = Some(Pace { time: drawn.time, pixels: scene.camera.pixels() });
        desk.publish(drawn)
    }

    /// Whether the whole picture is as fast as a coarse one has to be, by the last one.
    fn is_fluent(&self, scene: &Scene) -> bool {
        self.last_whole.is_some_and(|pace| pace.time <= FLUENT && scene.camera.pixels() <= pace.pixels)
    }

    fn render(&mut self, scene: &Scene, request: &Request, level: Level, progress: &Progress) -> Result<Drawn, Error> {
        let start = Instant::now();
        let render = self.sequence.render(scene, &self.options, progress)?;
        // An average that was interrupted is a picture, but not that of the scene.
        if render.sets.is_some_and(|sets| sets.interrupted) {
            return Err(Error::Cancelled);
        }
        Ok(Drawn::new(render, scene, &request.told, request.generation, level, start.elapsed()))
    }
}

/// The divisor of the next coarse picture, after one that took so long.
fn next_divisor(divisor: u32, time: Duration) -> u32 {
    if time > 2 * FLUENT {
        (divisor * 2).min(COARSEST)
    } else if time < FLUENT / 3 {
        (divisor / 2).max(2)
    } else {
        divisor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_pictures_keep_to_their_time() {
        let next = |divisor, ms| next_divisor(divisor, Duration::from_millis(ms));
        assert_eq!([next(4, 80), next(4, 201), next(8, 900)], [4, 8, 8]);
        assert_eq!([next(4, 20), next(2, 1), next(8, 30)], [2, 2, 4]);
    }
}
