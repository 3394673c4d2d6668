//! The reductions that make a coarse picture keep to a time.

use crate::picture::Size;
use organza::scene::{LayerChoice, Scene, Source, Technique};
use organza::{CostRecord, pass};
use std::time::Duration;

/// Time of a coarse picture: ten a second follow a hand.
pub(crate) const BUDGET: Duration = Duration::from_millis(100);

/// Most pixels of the whole picture along each side of one of the coarse picture: at 8 a picture of 960 × 540 has 120 × 68.
const COARSEST: u32 = 8;

/// Least share of the splats: below it a dense object is a handful of discs.
const LEAST_SHARE: f64 = 1.0 / 256.0;

/// A share that is made anew takes so much of the time alone, so that the next frames stay within it.
const MARGIN: f64 = 0.6;

/// Budgets from which on a picture is made less: times vary by as much by themselves.
const TOO_LONG: f64 = 1.3;

/// Budgets from which on a hand would rather wait once than for each picture.
const SLUGGISH: f64 = 4.0;

/// Most points that an extended light is taken for, where its penumbra is to be guessed alone.
const LIGHT_POINTS: u32 = 4;

/// Most sets of particles that are averaged.
const SETS: u32 = 4;

/// The layer of which depths under a pointer are read.
pub(crate) const DEPTH_LAYER: &str = "depth.median";

/// The layer of which objects under a pointer are read.
pub(crate) const OBJECT_LAYER: &str = "object";

/// Passes whose results serve the next view.
const ONCE: [&str; 4] = [pass::READ, pass::CONVERT, pass::SHADOW_MAP, pass::GROUP];

/// Passes whose time follows the pixels.
const OF_PIXELS: [&str; 3] = [pass::OPAQUE, pass::SPLAT, pass::FINISH];

/// How much of a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Detail {
    /// Pixels of the whole picture along each side of one of the coarse picture.
    pub(crate) divisor: u32,
    /// Share of the splats, in (0, 1].
    pub(crate) share: f64,
}

impl Default for Detail {
    fn default() -> Self {
        Self { divisor: 4, share: 0.25 }
    }
}

impl Detail {
    /// The detail of the next picture, after one that cost this. Pixels give way first, where they take the time. Another share is converted anew,
    /// which a hand waits for: it changes where pictures would hardly follow the hand, and then by as much as helps for good.
    pub(crate) fn next(self, cost: &CostRecord) -> Self {
        self.within(cost, SLUGGISH)
    }

    /// The same while nobody waits: a share that takes too long gives way at once, and one that takes a quarter of the time, and less, gets more.
    pub(crate) fn at_rest(self, cost: &CostRecord) -> Self {
        let next = self.within(cost, TOO_LONG);
        let room = MARGIN * BUDGET.as_secs_f64() / drawing_time(cost).as_secs_f64().max(f64::MIN_POSITIVE);
        if next.share < self.share || room < 4.0 {
            return next;
        }
        let mut share = self.share;
        while share < 1.0 && 2.0 * share <= self.share * room {
            share *= 2.0;
        }
        Self { share: share.min(1.0), ..next }
    }

    /// The next detail; the share changes from `budgets` on, in times of the budget.
    fn within(self, cost: &CostRecord, budgets: f64) -> Self {
        let budget = BUDGET.as_secs_f64();
        let time = drawing_time(cost).as_secs_f64();
        let of_pixels = seconds(cost, |name| OF_PIXELS.contains(&name));
        if time > TOO_LONG * budget && of_pixels > 0.5 * time && self.divisor < COARSEST {
            return Self { divisor: 2 * self.divisor, ..self };
        }
        if time > budgets * budget {
            return Self { share: self.share_within(MARGIN * budget / time), ..self };
        }
        if time < budget / 3.0 && self.divisor > 2 {
            return Self { divisor: self.divisor / 2, ..self };
        }
        self
    }

    /// The greatest power of two that is at most this part of the share.
    fn share_within(self, part: f64) -> f64 {
        let mut share = self.share;
        while share > LEAST_SHARE && share > self.share * part {
            share /= 2.0;
        }
        share
    }

    /// Voxels along each side of a block of a volume that is drawn as one: about as many fewer splats, and no fewer are to be classified.
    fn block(self) -> usize {
        self.share.cbrt().recip().round() as usize
    }

    /// A scene with this detail: of the same view, with fewer pixels and splats, and one depth for each pixel. By `points`, which thins out, where
    /// that draws the scene.
    pub(crate) fn of_scene(self, scene: &Scene, layer: Option<&str>, technique: Option<Technique>) -> Scene {
        let mut coarse = scene.clone();
        let size = Size::of_scene(scene).divided(self.divisor);
        coarse.camera.size = [size.width, size.height];
        // Shadows are planned for all views at once, as in an animation: the plan serves while the scene is turned.
        coarse.frames = Some(2);
        coarse.lights.iter_mut().for_each(|light| light.samples = light.samples.min(LIGHT_POINTS));
        let settings = &mut coarse.render;
        settings.antialias = 1;
        settings.splat_share *= self.share;
        settings.particles.repeat_level = settings.particles.repeat_level.min(SETS);
        settings.particles.target_error = None;
        settings.layers = LayerChoice::default();
        for name in [DEPTH_LAYER, OBJECT_LAYER].into_iter().chain(layer) {
            // The whole scene was refused for a name that is unknown.
            let _ = settings.layers.add(name);
        }
        for object in &mut coarse.objects {
            if let Source::Volume(volume) = &mut object.source {
                volume.block = self.block();
            }
        }
        if let Some(technique) = technique {
            settings.technique = technique;
            coarse.objects.iter_mut().for_each(|object| object.technique = Some(technique));
        }
        coarse
    }
}

/// Time of what each view takes anew.
pub(crate) fn drawing_time(cost: &CostRecord) -> Duration {
    Duration::try_from_secs_f64(seconds(cost, |name| !ONCE.contains(&name))).unwrap_or(Duration::MAX)
}

fn seconds(cost: &CostRecord, counts: impl Fn(&str) -> bool) -> f64 {
    cost.stages.iter().filter(|stage| counts(&stage.name)).map(|stage| stage.seconds).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use organza::CostRecord;

    /// A cost with these milliseconds.
    fn cost(passes: &[(&str, f64)]) -> CostRecord {
        let mut cost = CostRecord::default();
        for (name, ms) in passes {
            cost.measure(name, |_| Ok::<_, ()>(())).unwrap();
            cost.stages.last_mut().unwrap().seconds = ms / 1e3;
        }
        cost
    }

    #[test]
    fn what_takes_the_time_is_made_less() {
        let now = Detail { divisor: 4, share: 0.25 };
        let after = |passes: &[(&str, f64)]| now.next(&cost(passes));
        // Pixels take the time: fewer of them.
        assert_eq!(after(&[(pass::SHADE, 50.0), (pass::SPLAT, 150.0)]), Detail { divisor: 8, share: 0.25 });
        // Splats do: 60 ms of 480 ms are an eighth.
        assert_eq!(after(&[(pass::SHADE, 470.0), (pass::SPLAT, 10.0)]), Detail { divisor: 4, share: 0.25 / 8.0 });
        // A drag does not wait for a conversion that saves little; at rest nobody waits.
        let slow = [(pass::SHADE, 230.0), (pass::SPLAT, 10.0)];
        assert_eq!((after(&slow), now.at_rest(&cost(&slow))), (now, Detail { divisor: 4, share: 0.25 / 4.0 }));
        // Within the time nothing changes, and what happens once does not count.
        assert_eq!(after(&[(pass::READ, 900.0), (pass::CONVERT, 900.0), (pass::SHADE, 80.0)]), now);
        // There is time for more pixels, not for another conversion.
        assert_eq!(after(&[(pass::SHADE, 20.0)]), Detail { divisor: 2, share: 0.25 });
        let finest = Detail { divisor: 2, share: 0.25 };
        assert_eq!(finest.next(&cost(&[(pass::SHADE, 1.0)])), finest);
    }

    #[test]
    fn at_rest_there_is_time_for_more_splats() {
        let now = Detail { divisor: 2, share: 1.0 / 64.0 };
        let after = |ms| now.at_rest(&cost(&[(pass::SHADE, ms)])).share;
        // 60 ms over 5 ms are 12, of which the power of two is 8; over 20 ms they are too few for another conversion.
        assert_eq!([after(5.0), after(20.0), after(90.0)], [8.0 / 64.0, 1.0 / 64.0, 1.0 / 64.0]);
        assert_eq!((after(1e-3), after(0.0), after(600.0)), (1.0, 1.0, LEAST_SHARE));
    }

    #[test]
    fn detail_ends_somewhere() {
        let mut detail = Detail::default();
        for _ in 0..40 {
            detail = detail.next(&cost(&[(pass::SHADE, 5e3), (pass::SPLAT, 6e3)]));
        }
        assert_eq!((detail.divisor, detail.share), (COARSEST, LEAST_SHARE));
    }
}
