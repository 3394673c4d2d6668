//! A light and its shadow are left out where nobody sees it, and only there: each family crosses the threshold, and what was left out is forced on.

use organza::scene::{LoadOptions, Override, Scene, parse};
use organza::{Progress, Render, RenderOptions};
use organza_tests::{Place, draw};
use splat_core::rng;
use std::io::Write;
use std::path::Path;

/// Fog over a ground, of which a spot lights a part; `lamp` and `more` are further lights and objects.
fn scene(lamp: &str, more: &str) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nsize = [32, 24]\n\
         [[light]]\nname = 'key'\nkind = 'spot'\nposition = [1, 3, 1]\ntarget = [0.3, 0, 0]\nouter = 15\nintensity = [9, 9, 9]\n{lamp}\
         [[object]]\nname = 'ground'\n\
         rectangle = {{ center = [0, -0.6, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.05 }}\n\
         [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
         medium_ball = {{ center = [0, 0, 0], radius = 0.5, spacing = 0.1, extinction = 3 }}\n{more}\
         [material.fog]\nmedium = {{ albedo = 0.9 }}\n[render]\ntechnique = 'points'\nantialias = 1\n"
    )
}

const FILL: &str = "[[light]]\nname = 'fill'\nkind = 'point'\nposition = [-1, 2, 2]\nintensity = [1, 1, 1]\n";
const PANE: &str = "[[object]]\nname = 'pane'\nopacity = 0.5\n\
                    rectangle = { center = [0.7, 1.6, 0.5], u = [0.4, 0, 0], v = [0, 0, -0.4], spacing = 0.4 }\n";

pub(crate) fn loaded(text: &str, changes: &[String]) -> Scene {
    let overrides = changes.iter().map(|change| match change.strip_prefix("effect ") {
        Some(effect) => Override::of_effect(effect).unwrap(),
        None => Override::parse(change).unwrap(),
    });
    let options = LoadOptions { overrides: overrides.collect(), ..LoadOptions::default() };
    parse(Path::new("s.toml"), text.as_bytes(), &options).unwrap()
}

pub(crate) fn render(scene: &Scene) -> Render {
    organza::render(scene, &RenderOptions::default(), &Progress::new()).unwrap()
}

/// Values of a picture as they are displayed.
pub(crate) fn displayed(render: &Render, scene: &Scene) -> Vec<f64> {
    let gain = scene.render.exposure.exp2();
    let encode = |v: f64| if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    let beauty = render.layers.rgb("beauty").unwrap();
    beauty.iter().flatten().map(|v| encode((gain * f64::from(*v)).clamp(0.0, 1.0))).collect()
}

pub(crate) fn largest_change(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// What a family showed.
#[derive(Debug)]
pub(crate) struct Crossed {
    pub(crate) least_visible: f64,
    pub(crate) most_skipped: f64,
    /// The largest change of a pixel where the effect was left out, in tolerances.
    most_left_out: f64,
    /// The bound over the change that the effect makes, of each size that changes anything.
    ratios: Vec<f64>,
}

impl Crossed {
    /// Adds a row to the table of families, where `cargo xtask effects` asks for it.
    fn note(&mut self, name: &str, key: &str, settings: &[String]) {
        let Some(path) = std::env::var_os("ORGANZA_FAMILIES") else { return };
        self.ratios.sort_by(f64::total_cmp);
        let median = self.ratios[self.ratios.len() / 2];
        let Self { least_visible, most_skipped, most_left_out, .. } = self;
        let grows = key.split_once('=').map_or(key, |(key, _)| key);
        let settings = settings.join(" and ").replace(',', "");
        let row =
            format!("{name},{grows},{settings},{least_visible:e},{most_skipped:e},{most_left_out:.3},{median:.1}\n");
        let mut table = std::fs::OpenOptions::new().append(true).create(true).open(path).unwrap();
        // One write is not torn by other tests.
        table.write_all(row.as_bytes()).unwrap();
    }
}

/// Draws a family whose effect grows from invisible to plain, as planned, with the effect on and with it off; `bare` is the scene without its cause.
#[track_caller]
pub(crate) fn crosses_its_threshold(
    text: &str,
    name: &str,
    key: &str,
    sizes: &[f64],
    settings: &[String],
    bare: Option<&str>,
) -> Crossed {
    let mut crossed =
        Crossed { least_visible: f64::INFINITY, most_skipped: 0.0, most_left_out: 0.0, ratios: Vec::new() };
    for size in sizes {
        let with = |more: &[String]| {
            let size = key.replace("SIZE", &format!("{size:e}"));
            loaded(text, &[settings, &[size], more].concat())
        };
        let planned_scene = with(&[]);
        let tolerance = planned_scene.render.tolerance;
        let planned = render(&planned_scene);
        let effect = planned.plan.effects.iter().find(|effect| effect.name == name).unwrap();
        let on = render(&with(&[format!("effect {name}=on")]));
        let off = render(&with(&[format!("effect {name}=off")]));
        let truth = displayed(&on, &planned_scene);
        let seen = largest_change(&displayed(&off, &planned_scene), &truth);
        let bound = effect.bound.number().unwrap_or(1.0);
        assert!(seen <= bound, "{name} at {size}: {seen} beyond the bound {bound}");
        if effect.called_for {
            assert_eq!(planned.layers, on.layers, "{name} at {size}");
        } else {
            let change = largest_change(&displayed(&planned, &planned_scene), &truth);
            assert!(change <= tolerance, "{name} at {size}: {change} left out");
            crossed.most_left_out = crossed.most_left_out.max(change / tolerance);
            assert_eq!(planned.layers, off.layers, "{name} at {size}");
            if let Some(bare) = bare {
                let bare = render(&loaded(bare, settings));
                assert_eq!(planned.layers, bare.layers, "{name} at {size}: its cause leaves a trace");
                let maps = |render: &Render| render.cost.stages.iter().filter(|s| s.name == "tsm build").count();
                assert_eq!(maps(&planned), maps(&bare), "{name} at {size}: a map of it was built");
            }
            crossed.most_skipped = crossed.most_skipped.max(*size);
        }
        if seen > tolerance {
            crossed.least_visible = crossed.least_visible.min(*size);
        }
        if seen > 0.0 {
            crossed.ratios.push(bound / seen);
        }
    }
    assert!(crossed.most_skipped > 0.0 && crossed.least_visible.is_finite(), "{name}: {crossed:?}");
    crossed.note(name, key, settings);
    crossed
}

/// Sizes from one end to the other, each so many times the last. They are others where the environment states another seed, as `cargo xtask effects` does.
pub(crate) fn sizes(from: f64, to: f64, ratio: f64) -> Vec<f64> {
    let seed = std::env::var("ORGANZA_SEED").ok().and_then(|seed| seed.parse().ok());
    let shift = seed.map_or(0.0, |seed: u64| rng::unit(seed, 2, from.to_bits(), to.to_bits()));
    let first = from * ratio.powf(shift);
    std::iter::successors(Some(first), |size| Some(size * ratio)).take_while(|size| *size <= to).collect()
}

pub(crate) fn settings(list: &[&str]) -> Vec<String> {
    list.iter().map(|setting| (*setting).to_owned()).collect()
}

/// A lamp that grows, beside a brighter one that lights another part of the ground.
#[track_caller]
fn a_lamp_crosses_its_threshold(list: &[&str], from: f64) {
    let with = scene(FILL, "");
    let without = scene("", "");
    let key = "light.fill.intensity=[SIZE, SIZE, SIZE]";
    let crossed = crosses_its_threshold(
        &with,
        "light.fill",
        key,
        &sizes(from, 300.0 * from, 1.4),
        &settings(list),
        Some(&without),
    );
    println!("{list:?}: {crossed:?}");
    assert!(crossed.most_skipped >= 0.1 * crossed.least_visible, "{list:?}: {crossed:?}");
}

/// A pane whose opacity grows, in the light of the key; nothing else casts a shadow.
#[track_caller]
fn a_shadow_crosses_its_threshold(list: &[&str]) {
    let text = scene("", PANE);
    let alone = ["object.fog.casts_shadow=false", "object.ground.casts_shadow=false"];
    let settings = settings(&[&alone[..], list].concat());
    let crossed =
        crosses_its_threshold(&text, "shadow.key", "object.pane.opacity=SIZE", &sizes(3e-5, 0.5, 1.4), &settings, None);
    println!("{list:?}: {crossed:?}");
    // The bound takes the ground to be black where the pane's shadow falls, and sRGB to be as steep as there.
    assert!(crossed.most_skipped >= 0.03 * crossed.least_visible, "{list:?}: {crossed:?}");
}

#[test]
fn x7_effect_light_that_nobody_sees_is_left_out() {
    a_lamp_crosses_its_threshold(&[], 3e-4);
}

#[test]
fn x7_effect_shadow_that_nobody_sees_is_left_out() {
    a_shadow_crosses_its_threshold(&[]);
}

/// A lamp with a size, and the words of the same lamp without one.
const BULB: &str = "[[light]]\nname = 'bulb'\nkind = 'sphere'\nposition = [-1, 2, 2]\nradius = 0.4\nsamples = 9\nintensity = [3, 3, 3]\n";
const LAMP: &str = "[[light]]\nname = 'bulb'\nkind = 'point'\nposition = [-1, 2, 2]\nintensity = [3, 3, 3]\n";

#[test]
fn x7_effect_soft_is_the_size_of_a_light() {
    let text = scene(BULB, PANE);
    let planned_scene = loaded(&text, &[]);
    let planned = render(&planned_scene);
    let sharp = render(&loaded(&text, &["effect soft.bulb=off".to_owned()]));
    let lamp = render(&loaded(&scene(LAMP, PANE), &[]));
    assert_eq!(sharp.layers, lamp.layers, "a light without size is a lamp in its middle");
    let maps = |render: &Render| render.plan.tables().count();
    assert_eq!(
        [&planned, &sharp, &lamp].map(maps),
        [11, 3, 3],
        "one for each point, one for the spot, one for the eye"
    );
    let effect = |render: &Render, name: &str| render.plan.effects.iter().find(|effect| effect.name == name).cloned();
    let soft = effect(&planned, "soft.bulb").unwrap();
    let change = largest_change(&displayed(&planned, &planned_scene), &displayed(&sharp, &planned_scene));
    assert!(soft.called_for && change > planned_scene.render.tolerance, "{soft:?}, {change}");
    assert!(change <= soft.bound.number().unwrap(), "{soft:?}, {change}");
    assert!(!effect(&sharp, "soft.bulb").unwrap().called_for);
    // Of a lamp nobody can ask for what it has no cause of.
    assert!(effect(&lamp, "soft").unwrap().is_absent);
    let options =
        LoadOptions { overrides: vec![Override::of_effect("soft.key=on").unwrap()], ..LoadOptions::default() };
    let refused = parse(Path::new("s.toml"), text.as_bytes(), &options).unwrap_err().to_string();
    assert!(refused.contains("`soft.key` is on, and the light has no size"), "{refused}");
}

#[test]
fn x7_flat_lights_without_size_shine_from_their_middle_to_their_side() {
    let flat = |kind: &str| format!("[[light]]\nname = 'bulb'\n{kind}\nsamples = 9\nintensity = [3, 3, 3]\n");
    let disk = "kind = 'disk'\nposition = [-1, 2, 2]\nnormal = [1, -2, -2]\nradius = 0.3";
    let rect = "kind = 'rect'\nposition = [-1, 2, 2]\nu = [0, 0.2, -0.2]\nv = [0.4, 0.1, 0.1]";
    let tiny_rect = ["light.bulb.u=[0, 2e-7, -2e-7]", "light.bulb.v=[4e-7, 1e-7, 1e-7]"];
    for (kind, tiny) in [(disk, &["light.bulb.radius=1e-6"][..]), (rect, &tiny_rect)] {
        let with = |more: &[&str]| {
            let scene = loaded(&scene(&flat(kind), ""), &settings(more));
            displayed(&render(&scene), &scene)
        };
        let sharp = with(&["effect soft.bulb=off"]);
        assert!(largest_change(&sharp, &with(&[])) > 1.0 / 255.0, "{kind}");
        assert!(largest_change(&sharp, &with(tiny)) < 1e-3, "{kind}");
    }
}

/// Fog over the ground whose extinction grows: thousands of splats, of which a ray of the light meets a few.
#[track_caller]
fn the_shadow_of_fog_crosses_its_threshold(list: &[&str]) {
    let text = scene("", "");
    let settings =
        settings(&[&["object.ground.casts_shadow=false", "object.fog.medium_ball.spacing=0.05"][..], list].concat());
    let key = "object.fog.medium_ball.extinction=SIZE";
    let crossed = crosses_its_threshold(&text, "shadow.key", key, &sizes(3e-5, 1.0, 1.4), &settings, None);
    println!("{list:?}: {crossed:?}");
    assert!(crossed.most_skipped >= 0.02 * crossed.least_visible, "{list:?}: {crossed:?}");
}

#[test]
fn x7_the_shadow_of_thin_fog_is_left_out() {
    the_shadow_of_fog_crosses_its_threshold(&[]);
}

/// The effect of this name, of a picture drawn as planned; where it is left out the picture is within its bound of the one with it.
#[track_caller]
fn is_called_for(text: &str, changes: &[String], name: &str) -> bool {
    let planned_scene = loaded(text, changes);
    let planned = render(&planned_scene);
    let effect = planned.plan.effects.iter().find(|effect| effect.name == name).unwrap();
    let on = render(&loaded(text, &[changes, &[format!("effect {name}=on")]].concat()));
    let change = largest_change(&displayed(&planned, &planned_scene), &displayed(&on, &planned_scene));
    assert!(
        effect.called_for || change <= effect.bound.number().unwrap(),
        "{name}: {change} beyond {:?}",
        effect.bound
    );
    effect.called_for
}

#[test]
fn x7_a_shadow_that_falls_on_nothing_that_is_seen_is_left_out() {
    let plate = |place: &str| {
        format!(
            "[[object]]\nname = 'plate'\nrectangle = {{ center = {place}, u = [0.3, 0, 0], v = [0, 0, -0.3], spacing = 0.05 }}\n"
        )
    };
    let text = |place: &str| {
        let whole = scene("", &plate(place)).replace("outer = 15", "outer = 60");
        let fog = whole.find("[[object]]\nname = 'fog'").unwrap();
        let end = whole.find("[[object]]\nname = 'plate'").unwrap();
        whole[..fog].to_owned() + &whole[end..]
    };
    let settings =
        settings(&["object.ground.casts_shadow=false", "object.plate.shadow_coefficient=0", "camera.fov_y=15"]);
    for (place, expected) in [
        // Over the ground, below it, and where its shadow falls beside the ground that is seen.
        ("[0, 0, 0]", true),
        ("[0, -1.5, 0]", false),
        ("[-1.8, -0.4, 1.7]", false),
    ] {
        assert_eq!(is_called_for(&text(place), &settings, "shadow.key"), expected, "{place}");
    }
    // A mirror would show it.
    let glass = "[[object]]\nname = 'glass'\nmaterial = 'glass'\nopacity = 0.1\ntechnique = 'surfels'\n\
                 implicit = { expression = 'x^2 + y^2 + z^2 - 0.04', box = [[-0.21, -0.21, -0.21], [0.21, 0.21, 0.21]], spacing = 0.05 }\n\
                 [material.glass]\nior = 1.5\n";
    let with_glass = text("[-1.8, -0.4, 1.7]").replace("[material.fog]", &format!("{glass}[material.fog]"));
    assert!(is_called_for(&with_glass, &settings, "shadow.key"));
}

#[test]
fn x7_a_lamp_far_away_shadows_as_a_sun_does() {
    let text = scene("", PANE);
    let settings = settings(&[
        "object.fog.casts_shadow=false",
        "object.ground.casts_shadow=false",
        "light.key={name='key', kind='point', position=[7e8, 1.6e9, 5e8], intensity=[1e19, 1e19, 1e19]}",
    ]);
    assert!(is_called_for(&text, &settings, "shadow.key"));
}

/// Objects and lights by chance, of which no shadow changes a pixel by more than its bound.
#[track_caller]
fn no_shadow_exceeds_its_bound(seeds: std::ops::Range<u64>) {
    let mut left_out = 0;
    for seed in seeds {
        let mut drawn = 0;
        let mut number = |low: f64, high: f64| {
            drawn += 1;
            low + (high - low) * rng::unit(seed, 0, drawn, 0)
        };
        let mut text = "version = 1\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nsize = [24, 24]\n[render]\nantialias = 1\n".to_owned();
        for name in ["a", "b"] {
            let position = format!("[{}, {}, {}]", number(-3.0, 3.0), number(0.5, 3.0), number(-3.0, 3.0));
            text += &match number(0.0, 3.0) as u32 {
                0 => format!(
                    "[[light]]\nname = '{name}'\nkind = 'directional'\ndirection = [{}, -1, {}]\nirradiance = [2, 2, 2]\n",
                    number(-1.0, 1.0),
                    number(-1.0, 1.0)
                ),
                1 => format!(
                    "[[light]]\nname = '{name}'\nkind = 'point'\nposition = {position}\nintensity = [9, 9, 9]\n"
                ),
                _ => format!(
                    "[[light]]\nname = '{name}'\nkind = 'sphere'\nposition = {position}\nradius = 0.3\nsamples = 3\nintensity = [9, 9, 9]\n"
                ),
            };
        }
        text += "[[object]]\nname = 'ground'\ncasts_shadow = false\nrectangle = { center = [0, -0.6, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.08 }\n";
        let faint = 10f64.powf(number(-4.5, 0.0));
        for k in 0..3 {
            let center = format!("[{}, {}, {}]", number(-1.5, 1.5), number(-0.5, 1.5), number(-1.5, 1.5));
            let size = number(0.1, 0.6);
            text += &match number(0.0, 2.0) as u32 {
                0 => format!(
                    "[[object]]\nname = 'o{k}'\nmedium_ball = {{ center = {center}, radius = {size}, extinction = {}, spacing = {} }}\n",
                    faint / size,
                    0.2 * size
                ),
                _ => format!(
                    "[[object]]\nname = 'o{k}'\nopacity = {}\nrectangle = {{ center = {center}, u = [{size}, 0, 0], v = [0, {}, -{size}], spacing = {} }}\n",
                    faint.min(0.9),
                    number(-0.4, 0.4),
                    0.2 * size
                ),
            };
        }
        for name in ["shadow.a", "shadow.b"] {
            let whole = loaded(&text, &[]);
            let [on, off] = ["on", "off"].map(|way| render(&loaded(&text, &[format!("effect {name}={way}")])));
            let change = largest_change(&displayed(&on, &whole), &displayed(&off, &whole));
            let effects = render(&whole).plan.effects;
            let effect = effects.iter().find(|effect| effect.name == name).unwrap();
            left_out += u32::from(!effect.called_for);
            let bound = effect.bound.number().unwrap_or(1.0);
            assert!(change <= bound, "seed {seed}, {name}: {change} beyond {bound}\n{text}");
        }
    }
    assert!(left_out > 0);
}

#[test]
fn no_shadow_of_scenes_by_chance_exceeds_its_bound() {
    no_shadow_exceeds_its_bound(6..12);
}

#[test]
fn x7_effect_scatter_stays_within_its_bound_and_is_told_where_it_lacks() {
    let text = scene("", "");
    let once = ["render.technique=sheets", "render.sheets.slicing=half_vector"];
    let mut said = [0, 0];
    for extinction in [1e-5, 1e-4, 0.03, 1.0, 8.0] {
        let fog = format!("object.fog.medium_ball.extinction={extinction:e}");
        let with = |more: &[&str]| loaded(&text, &settings(&[&once[..], &[&fog], more].concat()));
        let planned_scene = with(&[]);
        let planned = render(&planned_scene);
        let again = render(&with(&["render.sheets.scattering=forward_and_back"]));
        let effect = planned.plan.effects.iter().find(|effect| effect.name == "scatter").unwrap();
        let change = largest_change(&displayed(&planned, &planned_scene), &displayed(&again, &planned_scene));
        let bound = effect.bound.number().unwrap_or(1.0);
        assert!(change <= bound, "extinction {extinction}: {change} beyond {bound}");
        assert_eq!(effect.is_lacking, bound > planned_scene.render.tolerance, "extinction {extinction}");
        assert_eq!(effect.called_for, effect.is_lacking);
        let notes = planned.notes.iter().filter(|note| note.contains("'fog' may scatter light again and again"));
        assert_eq!(notes.count(), usize::from(effect.is_lacking), "{:?}", planned.notes);
        said[usize::from(effect.is_lacking)] += 1;
        let asked = again.plan.effects.iter().find(|effect| effect.name == "scatter").unwrap();
        assert!(asked.called_for && !asked.is_lacking);
    }
    assert!(said[0] > 1 && said[1] > 1, "{said:?}");
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn x7_a_light_that_nobody_sees_is_left_out_by_any_technique_and_tolerance() {
        for (list, from) in [
            (&["render.exposure=6"][..], 5e-6),
            (&["render.exposure=-4", "render.tolerance=0.0625", "light.key.intensity=[1000, 1000, 1000]"], 0.1),
            (&["render.tolerance=0.0009"], 7e-5),
            (&["render.technique=particles"], 3e-4),
            (&["render.technique=sheets"], 3e-4),
            (&["render.technique=surfels", "object.fog.technique=sheets"], 3e-4),
        ] {
            a_lamp_crosses_its_threshold(list, from);
        }
    }

    #[test]
    fn no_shadow_of_many_scenes_by_chance_exceeds_its_bound() {
        no_shadow_exceeds_its_bound(0..120);
    }

    #[test]
    fn x7_a_shadow_that_nobody_sees_is_left_out_by_any_technique_and_exposure() {
        for list in [&["render.exposure=3"], &["render.technique=particles"], &["render.technique=sheets"]] {
            a_shadow_crosses_its_threshold(list);
        }
    }
}

#[test]
fn the_only_light_is_not_left_out_however_dim() {
    let text = scene("", "");
    let dim = loaded(&text, &["light.key.intensity=[1e-9, 1e-9, 1e-9]".to_owned()]);
    let picture = render(&dim);
    assert!(picture.plan.lights == [true] && picture.layers.rgb("beauty").unwrap().iter().flatten().any(|v| *v > 0.0));
}

#[test]
fn a_dim_light_beside_one_that_is_switched_off_is_the_only_one() {
    let text = scene(FILL, "");
    let dim = "light.fill.intensity=[1e-9, 1e-9, 1e-9]".to_owned();
    let beside = render(&loaded(&text, std::slice::from_ref(&dim)));
    let alone = render(&loaded(&text, &[dim, "effect light.key=off".to_owned()]));
    let shines = |picture: &Render| picture.plan.effects.iter().any(|e| e.name == "light.fill" && e.called_for);
    assert!(!shines(&beside) && shines(&alone));
    assert!(alone.layers.rgb("beauty").unwrap().iter().flatten().any(|v| *v > 0.0));
}

#[test]
fn lights_are_called_by_their_names_wherever_they_stand() {
    let text = scene(FILL, "");
    let effects = |text: &str| -> Vec<(String, bool)> {
        let plan = render(&loaded(text, &["effect light.fill=off".to_owned()])).plan;
        let mut effects: Vec<_> = plan.effects.into_iter().map(|effect| (effect.name, effect.called_for)).collect();
        effects.sort();
        effects
    };
    let key_at = text.find("[[light]]").unwrap();
    let fill_at = text.find(FILL).unwrap();
    let key = &text[key_at..fill_at];
    let exchanged = text.replace(FILL, "").replace(key, &format!("{FILL}{key}"));
    assert_eq!(effects(&text), effects(&exchanged));
    assert!(effects(&text).contains(&("shadow.fill".to_owned(), false)));
    assert!(effects(&text).contains(&("shadow.key".to_owned(), true)));
}

#[test]
fn effects_that_cannot_be_switched_are_refused_with_their_place() {
    let place = Place::new(&scene(FILL, ""));
    let refused = |effect: &str, code: i32, expected: &str| {
        place.expect(code, &["explain", "s.toml", "--effect", effect], expected);
    };
    refused("shadow.sun=off", 2, "there is no effect `shadow.sun` that can be switched");
    refused("shadow.fil=off", 2, "did you mean `shadow.fill`?");
    refused("shadow.fill=perhaps", 2, "expected NAME=on, NAME=off or NAME=auto");
    refused("=off", 2, "expected NAME=on");
    place.write("t.toml", scene(&FILL.replace("'fill'", "'key'"), ""));
    place.expect(3, &["explain", "t.toml"], "duplicate light name `key`");
    place.write("t.toml", scene(&FILL.replace("'fill'", "'7'"), ""));
    place.expect(3, &["explain", "t.toml"], "expected a name with a letter in it");
    let contrary = FILL.to_owned() + "shadow = false\n";
    place.write("t.toml", scene(&contrary, ""));
    place.expect(2, &["explain", "t.toml", "--effect", "shadow.fill=on"], "the light has shadow = false");
    // The scene's own table.
    let written = scene(FILL, "") + "effects = { 'shadow.fill' = 'off' }\n";
    let plain = draw(&scene(FILL, ""), &["--effect", "shadow.fill=off"]).sha256(1.0);
    assert_eq!(draw(&written, &[]).sha256(1.0), plain);
    assert_ne!(draw(&scene(FILL, ""), &[]).sha256(1.0), plain);
}
