//! Settings that a scene may leave to the plan by `"auto"`: the value of each that has a part in the picture, and the reason.

use super::row;
use crate::cost::duration_text;
use crate::load::Loaded;
use crate::plan::{Plan, PlannedSetting};
use crate::scene::{ComparedTechnique, Scene, SceneLight};

/// The settings of a picture that is planned but for them: the technique, the samples of a pixel, those of lights, and what techniques add.
pub(crate) fn settings(scene: &Scene, loaded: &Loaded, plan: &Plan) -> Vec<PlannedSetting> {
    let render = &scene.render;
    let mut settings = vec![
        PlannedSetting::new("render.technique", format!("\"{}\"", plan.technique), render.choice.is_none(), &why(plan)),
        PlannedSetting::new(
            "render.antialias",
            render.antialias,
            render.stated.antialias,
            "the mean of 4 samples smooths the edges in a pixel",
        ),
    ];
    let shining = loaded.lights.iter().zip(&plan.lights).filter(|(_, shines)| **shines);
    settings.extend(shining.filter_map(|(light, _)| samples_of(light)));
    settings.extend(plan.techniques.iter().flat_map(|technique| (row(*technique).settings)(scene, loaded, plan)));
    settings
}

/// Errors below it are told as nothing.
const LEAST_TOLD: f64 = 5e-4;

/// Why the techniques were taken that draw.
fn why(plan: &Plan) -> String {
    let weight = |one: &ComparedTechnique| {
        let error = match one.displayed_error {
            error if !error.is_finite() => "its error is not known".to_owned(),
            error if error < LEAST_TOLD => "errs by nothing".to_owned(),
            error => format!("errs by {:.1} %", 100.0 * error),
        };
        format!("{} takes {}, {error}", one.drawn_by, duration_text(one.seconds))
    };
    let is_of_whole = |one: &&ComparedTechnique| one.object.is_none();
    let taken = plan.compared.iter().find(|one| one.is_taken && one.object.is_none());
    match (taken, &plan.compared[..]) {
        (Some(taken), compared) => {
            let compared: Vec<String> = compared.iter().filter(is_of_whole).map(weight).collect();
            format!("{}, of one core and about: {}", taken.reason, compared.join("; "))
        }
        (None, []) => {
            "nothing else is weighed for its objects: other techniques draw them where they are asked for by name"
                .to_owned()
        }
        (None, [first, ..]) if plan.compared.iter().all(|one| one.object == first.object) => {
            let compared: Vec<String> = plan.compared.iter().map(weight).collect();
            let reason = plan.compared.iter().find(|one| one.is_taken).map_or("", |one| &one.reason);
            format!("{reason}, of one core and about: {}", compared.join("; "))
        }
        (None, compared) => format!("each object has its own, of {} that were compared", compared.len()),
    }
}

/// The points that stand for the size of a light; `None` for one without a size.
fn samples_of(light: &SceneLight) -> Option<PlannedSetting> {
    let because = "so many points stand for the size of a light, each with a shadow map where it casts shadows";
    let key = format!("light.{}.samples", light.label);
    let is_extended = light.light.shape.is_extended();
    is_extended.then(|| PlannedSetting::new(key, light.samples, light.states_samples, because))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::{load, plan_loaded, settled};
    use crate::scene::{LoadOptions, Override, parse};
    use crate::{Context, Files, Progress, RenderOptions};

    const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [16, 12]\n\
        [[light]]\nname = 'bulb'\nkind = 'sphere'\nposition = [0, 3, 2]\nradius = 0.2\nintensity = [9, 9, 9]\n\
        [[light]]\nname = 'sun'\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
        [[object]]\nname = 'pane'\nopacity = 0.5\n\
        rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.2 }\n";

    fn planned(changes: &[&str]) -> Vec<PlannedSetting> {
        let overrides = changes.iter().map(|change| Override::parse(change).unwrap()).collect();
        let options = LoadOptions { overrides, ..LoadOptions::default() };
        let scene = parse("s.toml".as_ref(), SCENE.as_bytes(), &options).unwrap();
        let options = RenderOptions::default();
        let progress = Progress::new();
        let files = Files::default();
        let context = Context { files: &files, options: &options, progress: &progress };
        let (scene, _) = settled(&scene, context).unwrap();
        let loaded = load(&scene, context).unwrap();
        plan_loaded(&scene, &loaded, &options).unwrap().settings
    }

    fn values(settings: &[PlannedSetting]) -> Vec<(&str, &str, bool)> {
        settings.iter().map(|s| (s.key.as_str(), s.value.as_str(), s.is_stated)).collect()
    }

    #[test]
    fn what_is_left_to_the_plan_has_a_value_and_a_reason() {
        let open = planned(&[]);
        assert_eq!(
            values(&open),
            [
                ("render.technique", "\"points\"", false),
                ("render.antialias", "2", false),
                ("light.bulb.samples", "16", false),
                ("render.points.exact", "true", false),
                ("render.points.accumulation", "\"f32\"", false),
            ]
        );
        assert!(open.iter().all(|setting| setting.reason.len() > 20), "{open:?}");
        // Said, it is what it is without a word.
        let auto = ["render.antialias='auto'", "light.bulb.samples='auto'", "render.points.exact='auto'"];
        let auto = planned(&[&auto[..], &["render.points.accumulation='auto'", "render.technique='auto'"]].concat());
        assert_eq!(auto, open);
    }

    #[test]
    fn what_a_scene_states_is_told_as_stated() {
        let stated = planned(&[
            "render.technique='points'",
            "render.antialias=2",
            "light.bulb.samples=3",
            "render.points={exact=false, accumulation='f16'}",
        ]);
        assert_eq!(
            values(&stated),
            [
                ("render.technique", "\"points\"", true),
                ("render.antialias", "2", true),
                ("light.bulb.samples", "3", true),
                ("render.points.exact", "false", true),
                ("render.points.accumulation", "\"f16\"", true),
            ]
        );
        // Layers of depth are made in order, whatever a scene states.
        let deep = planned(&["render.points.exact=false", "render.layers=['depth']"]);
        let exact = deep.iter().find(|setting| setting.key == "render.points.exact").unwrap();
        assert!(exact.value == "true" && exact.is_stated && exact.reason.contains("depth"), "{exact:?}");
    }

    #[test]
    fn what_has_no_part_in_the_picture_is_not_told() {
        let solid = planned(&["object.pane.opacity=1", "light.bulb.intensity=[0, 0, 0]"]);
        assert_eq!(values(&solid), [("render.technique", "\"points\"", false), ("render.antialias", "2", false)]);
    }
}
