//! Frames of one scene, one after the other: what was sampled for one serves the next.

use crate::load::files::Files;
use crate::render::{Foreseen, Left, plan_keeping, prepare_keeping, render_keeping};
use crate::scene::Scene;
use crate::{Error, Progress, Render, RenderOptions};
use splat_core::DAabb;

/// Draws the frames of an animation.
///
/// A frame that differs from the one before in the camera alone reuses its splats, its shadow maps and the light that arrived at splats. Its
/// cost record then has no pass `read`, `convert` or `tsm build`. Its picture equals that of the frame drawn alone, bit by bit. Light is
/// remembered while it fits in a quarter of [`RenderOptions::max_memory`]. Scenes whose points are as large as some pixels, or whose light is
/// carried by half-vector sheets, are made anew for each camera.
///
/// The technique `particles` samples an object once, as finely as any frame needs it. It keeps the sets while they fit in a
/// quarter of [`RenderOptions::max_memory`]. So a change of transform, of visibility or of the viewpoint needs no new
/// sampling. The cost record of a frame has a pass `sample` where something was. Files are read once, while what they hold
/// fits in another quarter.
///
/// ```
/// use organza::{Progress, RenderOptions, Sequence, scene};
/// let text = br#"
///     version = 1
///     [camera]
///     position = [0, 0, 4]
///     target = [0, 0, 0]
///     size = [16, 16]
///     [[object]]
///     name = "ball"
///     implicit = { expression = "x^2 + y^2 + z^2 - 1", box = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]], spacing = 0.1 }
///     opacity = 0.5
///     [render]
///     technique = "particles"
///     [animation]
///     frames = 2
///     [[animation.track]]
///     set = "object.ball.transform.translate"
///     keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 1, value = [0.5, 0, 0] }]
/// "#;
/// let frame = |k| {
///     let options = scene::LoadOptions { frame: Some(k), ..Default::default() };
///     scene::parse("ball.toml".as_ref(), text, &options).unwrap()
/// };
/// let scenes = [frame(0), frame(1)];
/// let mut sequence = Sequence::new(&scenes);
/// let options = RenderOptions::default();
/// let progress = Progress::new();
/// let [first, second] = scenes.each_ref().map(|s| sequence.render(s, &options, &progress).unwrap());
/// let sampled = |r: &organza::Render| r.cost.stages.iter().any(|s| s.name == "sample");
/// assert!(sampled(&first) && !sampled(&second));
/// ```
#[derive(Default)]
pub struct Sequence {
    left: Left,
}

impl Sequence {
    /// Nothing drawn yet; `frames` are all that will be drawn.
    pub fn new(frames: &[Scene]) -> Self {
        let mut sequence = Self::default();
        frames.iter().for_each(|frame| sequence.add(frame));
        sequence
    }

    /// Begins with files that were read before.
    pub fn of_files(files: Files) -> Self {
        let mut sequence = Self::default();
        sequence.left.files = files.for_previews(false);
        sequence
    }

    /// Begins with files that were read before, for previews: light that a thick splat sends to the eye is not attenuated within it.
    pub fn of_previews(files: Files) -> Self {
        let mut sequence = Self::default();
        sequence.left.files = files.for_previews(true);
        sequence.left.is_preview = true;
        sequence
    }

    /// The files that were read so far.
    pub fn files(&self) -> &Files {
        &self.left.files
    }

    /// A box around all that the last frame made of each object of its scene, in view or not and cut away from a preview or not, world units. It is empty
    /// for an object without anything, and there is none before the first frame.
    pub fn object_bounds(&self) -> Vec<DAabb> {
        self.left.object_bounds()
    }

    /// Also a frame that will be drawn: all are added before the first is drawn, with the camera that [`crate::fitted`] finds. Little is
    /// kept of it.
    pub fn add(&mut self, frame: &Scene) {
        self.left.add(frame);
    }

    /// Draws a preview of a scene that hides or cuts objects of another one, `whole`, and differs from it in nothing else. Splats are made of the whole, so
    /// that the next cut needs no others: cuts are as rough as splats, and have no lids.
    ///
    /// # Errors
    /// As [`crate::render`].
    pub fn preview(
        &mut self,
        frame: &Scene,
        whole: &Scene,
        options: &RenderOptions,
        progress: &Progress,
    ) -> Result<Render, Error> {
        render_keeping(frame, Some(whole), options, progress, &mut self.left)
    }

    /// Reads, converts and plans a frame without drawing it: a frame that would be refused is refused here.
    /// [`Sequence::render`] of this frame reuses the prepared data.
    ///
    /// # Errors
    /// As [`crate::render`].
    pub fn prepare(&mut self, frame: &Scene, options: &RenderOptions, progress: &Progress) -> Result<(), Error> {
        prepare_keeping(frame, options, progress, &mut self.left)
    }

    /// Plans a frame that differs from the one drawn last in settings of the render alone, and shows `look` what it would take; `None` where other
    /// splats are needed. Nothing is drawn or read, and what was made stays.
    ///
    /// # Errors
    /// As [`crate::render`], and those of `look`.
    pub fn foresee<T>(
        &mut self,
        frame: &Scene,
        options: &RenderOptions,
        progress: &Progress,
        look: impl FnOnce(&Foreseen<'_>) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        plan_keeping(frame, options, progress, &mut self.left, look)
    }

    /// Draws one of the frames.
    ///
    /// # Errors
    /// As [`crate::render`].
    pub fn render(&mut self, frame: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Render, Error> {
        render_keeping(frame, None, options, progress, &mut self.left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render;
    use crate::scene::{LoadOptions, Override, parse};

    /// Fog, a pane and a wall in the light of a lamp and of a sun.
    const SCENE: &[u8] = br#"
        version = 1
        [camera]
        position = [0.2, 0.1, 4]
        target = [0, 0, 0]
        size = [24, 16]
        [ambient]
        color = [0.1, 0.1, 0.1]
        [[light]]
        name = "lamp"
        kind = "point"
        position = [2, 3, 4]
        intensity = [20, 18, 16]
        [[light]]
        name = "sun"
        kind = "directional"
        direction = [-1, -1, -0.5]
        irradiance = [1, 1, 1]
        [material.smoke]
        medium = { extinction = 1.5, albedo = 0.8 }
        [[object]]
        name = "fog"
        material = "smoke"
        medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.7, spacing = 0.25 }
        [[object]]
        name = "pane"
        rectangle = { center = [0, 0, 0.3], u = [1.2, 0, 0.5], v = [0, 1.2, 0], spacing = 0.15 }
        opacity = 0.4
        [[object]]
        name = "wall"
        rectangle = { center = [0.5, 0, -2], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.2 }
        [render]
        technique = "points"
        particles = { repeat_level = 4 }
    "#;

    fn changed(changes: &[&str]) -> Scene {
        let overrides = changes.iter().map(|change| Override::parse(change).unwrap()).collect();
        parse("lights.toml".as_ref(), SCENE, &LoadOptions { overrides, ..LoadOptions::default() }).unwrap()
    }

    #[test]
    fn splats_serve_other_lights_and_settings_with_the_same_bits() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        // Each follows the one before it.
        let states: [(&[&str], bool); 9] = [
            (&[], false),
            (&["render.exposure=1"], true),
            (&["light.sun.irradiance=[0.2, 0.3, 0.1]"], true),
            (&["light.lamp.position=[-2, 3, 4]"], true),
            (&["light.lamp.shadow=false"], true),
            (&["light.lamp.shadow=false", "camera.position=[1, 1, 4]"], true),
            // Of another opacity splats are made anew, and a share of them is another cloud.
            (&["object.pane.opacity=0.5"], false),
            (&["object.pane.opacity=0.5", "render.tolerance=0.01"], true),
            (&["object.pane.opacity=0.5", "render.splat_share=0.5"], false),
        ];
        for technique in ["points", "particles", "sheets"] {
            let mut sequence = Sequence::default();
            for (changes, serves) in states {
                let technique = format!("render.technique=\"{technique}\"");
                let scene = changed(&[&[technique.as_str()], changes].concat());
                let kept = sequence.render(&scene, &options, &progress).unwrap();
                let alone = render(&scene, &options, &progress).unwrap();
                assert_eq!(kept.layers, alone.layers, "{technique}: {changes:?}");
                assert_eq!(kept.plan, alone.plan, "{technique}: {changes:?}");
                let is_read = kept.cost.stages.iter().any(|stage| stage.name == crate::pass::READ);
                assert_eq!(!is_read, serves, "{technique}: {changes:?}");
            }
        }
    }

    #[test]
    fn previews_convert_what_has_changed() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        let preview = |sequence: &mut Sequence, changes: &[&str]| {
            let scene = Scene { frames: Some(2), ..changed(&[&["render.splat_share=0.5"], changes].concat()) };
            sequence.render(&scene, &options, &progress).unwrap()
        };
        let mut sequence = Sequence::of_previews(Files::default());
        let converted = |render: &Render| {
            render.cost.stages.iter().find(|stage| stage.name == crate::pass::CONVERT).map(|stage| stage.items_in)
        };
        let states: [(&[&str], u64); 5] = [
            (&[], 3),
            (&["object.pane.opacity=0.5"], 1),
            (&["object.pane.opacity=0.6", "object.wall.color=[1, 0, 0]"], 2),
            // Another share is another choice of all splats, and materials are of all objects.
            (&["render.splat_share=0.25"], 3),
            (&["render.splat_share=0.25", "material.smoke.medium.albedo=0.5"], 3),
        ];
        for (changes, count) in states {
            let kept = preview(&mut sequence, changes);
            assert_eq!(converted(&kept), Some(count), "{changes:?}");
            let alone = preview(&mut Sequence::of_previews(Files::default()), changes);
            assert_eq!(kept.layers, alone.layers, "{changes:?}");
        }
    }

    /// Each state follows the one before it.
    #[test]
    fn shadow_maps_serve_lights_that_are_brighter_with_the_same_bits() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        let states: [(&[&str], bool); 6] = [
            (&[], false),
            (&["light.sun.irradiance=[0.8, 0.9, 1]"], true),
            (&["light.lamp.intensity=[25, 18, 16]", "camera.position=[1, 1, 4]"], true),
            (&["light.lamp.intensity=[25, 18, 16]", "render.exposure=1"], true),
            (&["light.lamp.position=[2, 3.5, 4]", "light.lamp.intensity=[25, 18, 16]"], false),
            (&["light.lamp.position=[2, 3.5, 4]", "light.lamp.shadow=false"], false),
        ];
        let mut sequence = Sequence::default();
        let mut previews = Sequence::of_previews(Files::default());
        let mut kept_maps = 0;
        for (changes, serves) in states {
            let scene = Scene { frames: Some(2), ..changed(changes) };
            let kept = sequence.render(&scene, &options, &progress).unwrap();
            let alone = render(&scene, &options, &progress).unwrap();
            assert_eq!((&kept.layers, &kept.plan), (&alone.layers, &alone.plan), "{changes:?}");
            let has_map = |render: &Render| has_pass(render, crate::pass::SHADOW_MAP);
            // How bright lights are decides the tolerance that a picture's maps have.
            assert!(has_map(&kept) || serves, "{changes:?}");
            kept_maps += usize::from(!has_map(&kept));
            let preview = previews.render(&scene, &options, &progress).unwrap();
            assert_eq!(!has_map(&preview), serves, "{changes:?}");
        }
        assert!(kept_maps > 0);
    }

    /// Radiance by which pictures of the same splats differ at most, whatever these are counted from.
    const ALIKE: f32 = 2e-3;

    #[test]
    fn previews_of_parts_are_made_of_the_splats_of_the_whole() {
        // Previews are planned for all views, so that what is not seen in one of them stays.
        let turning = |changes: &[&str]| Scene { frames: Some(2), ..changed(changes) };
        let options = RenderOptions::default();
        let progress = Progress::new();
        let mut sequence = Sequence::of_previews(Files::default());
        let mut preview = |changes: &[&str]| {
            let share = changes.iter().filter(|change| change.contains("share")).copied().collect::<Vec<_>>();
            sequence.preview(&turning(changes), &turning(&share), &options, &progress).unwrap()
        };
        let alone = |changes: &[&str]| {
            Sequence::of_previews(Files::default()).render(&turning(changes), &options, &progress).unwrap()
        };
        let cut = "object.fog.clip=[{ normal = [1, 0, 0], point = [0, 0, 0] }]";
        let more = "object.fog.clip=[{ normal = [1, 0, 0], point = [0.25, 0, 0] }]";
        let nothing = "object.fog.clip=[{ normal = [1, 0, 0], point = [-5, 0, 0] }]";
        // A plane between splats leaves out those of one side. Those of another box are rounded about another origin, and have other cells of shadow maps.
        let differ = |a: &Render, b: &Render| {
            let values =
                |render: &Render| render.layers.rgb("beauty").unwrap().iter().flatten().copied().collect::<Vec<_>>();
            values(a).iter().zip(values(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        let half = preview(&[cut]);
        assert!(has_pass(&half, crate::pass::READ), "what was read for the whole counts");
        assert!(differ(&half, &alone(&["object.fog.medium_box.max=[0, 1, 1]"])) < ALIKE);
        assert!(differ(&half, &alone(&[])) > 10.0 * ALIKE);
        for (changes, same) in [
            (&[more][..], &["object.fog.medium_box.max=[0.25, 1, 1]"][..]),
            (&[nothing], &["object.fog.visible=false"]),
            (&["object.pane.visible=false"], &["object.pane.visible=false"]),
            (
                &[cut, "object.pane.visible=false"],
                &["object.fog.medium_box.max=[0, 1, 1]", "object.pane.visible=false"],
            ),
            (&["render.splat_share=0.5"], &["render.splat_share=0.5"]),
            (&[], &[]),
        ] {
            let part = preview(changes);
            assert!(!has_pass(&part, crate::pass::READ), "{changes:?}");
            let difference = differ(&part, &alone(same));
            assert!(difference < ALIKE, "{changes:?}: {difference}");
        }
    }

    fn has_pass(render: &Render, name: &str) -> bool {
        render.cost.stages.iter().any(|stage| stage.name == name)
    }

    #[test]
    fn a_frame_that_was_prepared_is_drawn_from_what_was_made() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        let scene = changed(&[]);
        let mut sequence = Sequence::default();
        sequence.prepare(&scene, &options, &progress).unwrap();
        let kept = sequence.render(&scene, &options, &progress).unwrap();
        let alone = render(&scene, &options, &progress).unwrap();
        assert!(!has_pass(&kept, crate::pass::READ) && has_pass(&alone, crate::pass::READ));
        assert_eq!((&kept.layers, &kept.plan), (&alone.layers, &alone.plan));
        // What would be refused is refused before it is drawn.
        let large = changed(&["camera.size=[8192, 8192]"]);
        let little = RenderOptions { max_memory: 1 << 28, ..options };
        let refused = sequence.prepare(&large, &little, &progress).unwrap_err().to_string();
        assert_eq!(refused, render(&large, &little, &progress).unwrap_err().to_string());
    }

    #[test]
    fn a_frame_is_foreseen_from_splats_that_stay() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        let scene = changed(&[]);
        let mut sequence = Sequence::default();
        let seconds =
            |foreseen: &Foreseen<'_>| Ok(foreseen.predicted.drawing.iter().map(|p| p.seconds(&options.rates, 1)).sum());
        assert_eq!(
            sequence.foresee(&scene, &options, &progress, seconds).unwrap(),
            None::<f64>,
            "nothing was drawn yet"
        );
        let drawn = sequence.render(&scene, &options, &progress).unwrap();
        let mut foreseen =
            |changes: &[&str]| sequence.foresee(&changed(changes), &options, &progress, seconds).unwrap();
        let as_stated: f64 = foreseen(&[]).unwrap();
        let fewer = foreseen(&["render.splat_share=0.25"]).unwrap();
        let finer = foreseen(&["render.antialias=8"]).unwrap();
        assert!(fewer < as_stated && as_stated < finer, "{fewer} {as_stated} {finer}");
        // Of another opacity splats are others.
        assert_eq!(foreseen(&["object.pane.opacity=0.5"]), None);
        // The splats are those from before.
        let again = sequence.render(&scene, &options, &progress).unwrap();
        assert!(!has_pass(&again, crate::pass::READ));
        assert_eq!(again.layers, drawn.layers);
    }

    #[test]
    fn previews_do_not_wait_for_the_cells_that_are_asked_for() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        let cells = |mut sequence: Sequence, asked: u32| {
            let asked = format!("light.lamp.shadow_cells={asked}");
            let scene = Scene { frames: Some(2), ..changed(&[asked.as_str()]) };
            let render = sequence.render(&scene, &options, &progress).unwrap();
            let tables = render.plan.tables().filter_map(|table| table.cells);
            tables.collect::<Vec<_>>()
        };
        let preview = |asked| cells(Sequence::of_previews(Files::default()), asked);
        // Few cells cost little; a picture has as many as are asked for.
        assert_eq!((preview(64), preview(1024), cells(Sequence::default(), 1024)), (vec![64], vec![], vec![1024]));
    }

    #[test]
    fn previews_of_thick_media_have_no_map_of_the_eye() {
        let options = RenderOptions::default();
        let progress = Progress::new();
        let thick = "object.fog.medium_box={ min = [-1, -1, -1], max = [1, 1, 1], extinction = 30, spacing = 0.25 }";
        let mut preview = Sequence::of_previews(Files::default());
        let mut sequence = Sequence::default();
        for position in ["[0.2, 0.1, 4]", "[1, 0.5, 4]"] {
            let position = format!("camera.position={position}");
            let mut scene = changed(&[thick, position.as_str()]);
            // As one frame of many, it is planned once for all views.
            scene.frames = Some(2);
            let draw = |sequence: &mut Sequence| sequence.render(&scene, &options, &progress).unwrap();
            assert!(has_pass(&draw(&mut sequence), crate::pass::EYE_MAP));
            assert!(!has_pass(&draw(&mut preview), crate::pass::EYE_MAP));
        }
    }
}
