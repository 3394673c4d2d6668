//! `organza explain --measure`: each effect drawn with and without.

use organza::plan::{Bound, Plan};
use organza::scene::{EffectKind, Override};
use organza::{Progress, RenderOptions, explain};
use organza_judge::effects::{Measured, Switch, measure};
use organza_tests::{Place, parallel_view};
use serde_json::Value;

/// A pane over a ground in the light of a sun and of a lamp that nobody sees.
fn scene() -> String {
    parallel_view(2.0, 24)
        + "[[light]]\nname = 'sun'\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
           [[light]]\nname = 'lamp'\nkind = 'point'\nposition = [0, 2, 2]\nintensity = [1e-5, 1e-5, 1e-5]\n\
           [[object]]\nname = 'ground'\nrectangle = { center = [0, 0, -1], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }\n\
           [[object]]\nname = 'pane'\nopacity = 0.5\n\
           rectangle = { center = [0, 0.4, 0], u = [0.5, 0, 0], v = [0, 0.5, 0], spacing = 0.1 }\n\
           [render]\nantialias = 1\n"
}

#[test]
fn each_effect_that_can_be_switched_is_drawn_the_other_way() {
    let place = Place::new(&scene());
    let explain = |more: &[&str]| {
        let out = place.expect(0, &[&["explain", "s.toml", "--measure"], more].concat(), "");
        String::from_utf8(out.stdout).unwrap()
    };
    let document: Value = serde_json::from_str(&explain(&["--json"])).unwrap();
    let measured = &document["measured"];
    let effect = |name: &str| {
        let effects = measured["effects"].as_array().unwrap();
        effects.iter().find(|effect| effect["name"] == name).unwrap_or_else(|| panic!("no {name} in {measured}"))
    };
    let number = |name: &str, key: &str| effect(name)[key].as_f64().unwrap();
    // Without the sun all is black, and its shadow takes half of the light from a part.
    assert!(number("light.sun", "largest_change") > 0.5 && number("light.sun", "share_beyond_tolerance") > 0.5);
    let shadow = number("shadow.sun", "share_beyond_tolerance");
    assert!(number("shadow.sun", "largest_change") > 0.05 && shadow > 0.01 && shadow < 0.5, "{measured}");
    // The lamp was left out, and nobody sees it.
    let lamp = number("light.lamp", "largest_change");
    assert!(lamp > 0.0 && lamp < 1.0 / 255.0 && number("light.lamp", "share_beyond_tolerance") == 0.0, "{measured}");
    let together = measured["left_out_together"].as_f64().unwrap();
    assert!(together >= 0.5 * lamp && together < 1.0 / 255.0, "{measured}");
    assert!(number("light.sun", "seconds_with") > 0.0 && number("light.sun", "seconds_without") > 0.0);
    // What cannot be switched is told with the reason, and nothing is lost.
    let planned = document["plan"]["effects"].as_array().unwrap().len();
    let fixed = measured["not_switched"].as_array().unwrap();
    assert_eq!(measured["effects"].as_array().unwrap().len() + fixed.len(), planned);
    assert!(fixed.iter().all(|effect| effect["reason"].as_str().unwrap().len() > 10), "{measured}");
    let text = explain(&[]);
    assert!(text.contains("effect, measured") && text.contains("all that is left out, simulated together"), "{text}");
}

/// Glass with dispersion, coloured fog, a volume that reflects, in the light of a lamp with a size: a cause of each kind of effect but one.
const MOST_KINDS: &str = "version = 1\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nsize = [24, 24]\n[background]\n\
    color = [0.2, 0.3, 0.6]\n\
    [[light]]\nname = 'bulb'\nkind = 'sphere'\nposition = [1, 3, 2]\nradius = 0.4\nsamples = 4\nintensity = [20, 20, 20]\n\
    [[object]]\nname = 'ground'\nrectangle = { center = [0, -0.6, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.1 }\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
    medium_ball = { center = [0.9, 0, 0], radius = 0.4, spacing = 0.1, extinction = 3 }\n\
    [[object]]\nname = 'volume'\nmaterial = 'phong'\ndensity = { expression = '1 - x^2 - y^2 - z^2', \
    box = [[-1.3, -0.4, -0.4], [-0.5, 0.4, 0.4]], spacing = 0.1, extinction = 3 }\n\
    [[object]]\nname = 'ball'\nmaterial = 'glass'\nopacity = 0.1\ntechnique = 'surfels'\n\
    implicit = { expression = 'x^2 + y^2 + z^2 - 0.16', box = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]], spacing = 0.1 }\n\
    [material.fog]\nmedium = { albedo = 0.5 }\nextinction_rgb = [0.5, 1, 1.5]\n[material.phong]\nshading = 'phong'\n\
    [material.glass]\ncauchy = { a = 1.4, b = 0.05 }\nabsorption_inside = [1, 2, 3]\n\
    [render]\nantialias = 1\ndepth_ranges = 2\ntechnique = 'points'\n";

/// A cloud that scatters light again and again.
const CLOUD: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [24, 24]\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, -0.3]\nirradiance = [3, 3, 3]\n\
    [[object]]\nname = 'cloud'\nmaterial = 'cloud'\n\
    medium_ball = { center = [0, 0, 0], radius = 0.8, spacing = 0.2, extinction = 6 }\n\
    [material.cloud]\nmedium = { albedo = 0.98 }\n[render]\nantialias = 1\n\
    technique = 'sheets'\nsheets = { slicing = 'half_vector', scattering = 'forward_and_back' }\n";

/// The plan of a scene, and each of its effects measured.
fn measured(text: &str) -> (Plan, Measured) {
    let switched = |switches: &[Switch]| {
        let word = |switch: &Switch| format!("{}={}", switch.name, if switch.is_on { "on" } else { "off" });
        let overrides = switches.iter().map(|switch| Override::of_effect(&word(switch)));
        let overrides = overrides.collect::<Result<Vec<_>, _>>()?;
        let options = organza::scene::LoadOptions { overrides, ..Default::default() };
        Ok(organza::scene::parse("s.toml".as_ref(), text.as_bytes(), &options)?)
    };
    let options = RenderOptions::default();
    let progress = Progress::new();
    let scene = switched(&[]).unwrap();
    let plan = explain(&scene, &options, &progress).unwrap().plan;
    let measured = measure(&plan, &scene, &switched, &options, &progress).unwrap();
    (plan, measured)
}

#[test]
fn x7_a_planted_lie_about_any_effect_or_pass_is_found() {
    let mut kinds = Vec::new();
    for text in [MOST_KINDS, CLOUD] {
        let (plan, measured) = measured(text);
        assert_eq!(measured.contradictions(&plan), [""; 0], "the plan itself");
        for (place, effect) in plan.effects.iter().enumerate() {
            if !measured.changes.iter().any(|change| change.name == effect.name) {
                continue;
            }
            let mut lie = plan.clone();
            lie.effects[place].bound = Bound::Nothing;
            let found = measured.contradictions(&lie);
            assert!(found.len() == 1 && found[0].contains(&format!("`{}`", effect.name)), "{}: {found:?}", effect.name);
            let is_its = |kind: &&EffectKind| {
                effect.name == kind.word() || effect.name.starts_with(&format!("{}.", kind.word()))
            };
            kinds.extend(EffectKind::ALL.iter().filter(is_its).map(|kind| kind.word()));
        }
        // A pass that nobody planned.
        assert!(measured.passes.len() > 2, "{:?}", measured.passes);
        for pass in &measured.passes {
            let mut lie = plan.clone();
            lie.passes.retain(|planned| planned.name != *pass);
            let found = measured.contradictions(&lie);
            assert!(found.iter().any(|said| said.contains(&format!("`{pass}` runs"))), "{pass}: {found:?}");
        }
    }
    kinds.sort_unstable();
    kinds.dedup();
    let expected =
        ["absorption", "bending", "color", "dispersion", "gradients", "light", "object", "scatter", "shadow", "soft"];
    assert_eq!(kinds, expected, "of every kind that can be switched");
}
