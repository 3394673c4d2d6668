//! Effects of objects are left out where nobody sees them, and only there: each family crosses the threshold, and what was left out is forced on.

use crate::light_effects::{
    Crossed, crosses_its_threshold, displayed, largest_change, loaded, render, settings, sizes,
};
use organza::plan::Bound;
use organza_tests::{Place, draw};
use splat_core::rng;
use std::ops::Range;

/// A ground in the light of a sun, before a blue sky; `more` are further objects and materials.
fn scene(more: &str) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nsize = [32, 24]\n[background]\ncolor = [0.2, 0.3, 0.6]\n\
         [[light]]\nname = 'sun'\nkind = 'directional'\ndirection = [0.2, -1, -0.3]\nirradiance = [3, 3, 3]\n\
         [[object]]\nname = 'ground'\n\
         rectangle = {{ center = [0, -0.6, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.1 }}\n{more}\
         [render]\nantialias = 1\ntechnique = 'points'\n"
    )
}

const PANE: &str = "[[object]]\nname = 'pane'\n\
                    rectangle = { center = [0.3, 0.1, 0.5], u = [0.4, 0, 0], v = [0, 0.3, -0.1], spacing = 0.1 }\n";
const FOG: &str = "[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
                   medium_ball = { center = [0, 0, 0], radius = 0.5, spacing = 0.1, extinction = 3 }\n\
                   [material.fog]\nmedium = { albedo = 0.5 }\nextinction_rgb = [0.5, 1, 1.5]\n";
const VOLUME: &str = "[[object]]\nname = 'volume'\nmaterial = 'volume'\n\
                      density = { expression = '1 - x^2 - y^2 - z^2', box = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]], \
                      spacing = 0.1, extinction = 3 }\n[material.volume]\nshading = 'phong'\n";

/// A ball that bounds matter of a material.
fn ball(material: &str) -> String {
    format!(
        "[[object]]\nname = 'ball'\nmaterial = 'ball'\nopacity = 0.1\ntechnique = 'surfels'\n\
         implicit = {{ expression = 'x^2 + y^2 + z^2 - 0.16', box = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]], spacing = 0.1 }}\n\
         [material.ball]\n{material}\n"
    )
}

/// Draws a family and says where it crossed.
#[track_caller]
fn crosses(text: &str, name: &str, key: &str, sizes: &[f64], list: &[&str]) -> Crossed {
    let crossed = crosses_its_threshold(text, name, key, sizes, &settings(list), None);
    println!("{name} {list:?}: {crossed:?}");
    crossed
}

#[test]
fn x7_effect_object_that_hides_nothing_is_left_out_with_its_shadow() {
    let text = scene(PANE);
    let opacity = "object.pane.opacity=SIZE";
    let bare = scene("");
    let crossed = crosses_its_threshold(&text, "object.pane", opacity, &sizes(6e-6, 0.5, 3.0), &[], Some(&bare));
    println!("object.pane: {crossed:?}");
    assert!(crossed.most_skipped >= 0.001 * crossed.least_visible, "{crossed:?}");
    let dark = settings(&[
        "render.exposure=6",
        "render.tolerance=0.0625",
        "light.sun.irradiance=[0.02, 0.02, 0.02]",
        "background.color=[0.002, 0.003, 0.006]",
    ]);
    // It is visible from a third on.
    crosses_its_threshold(&text, "object.pane", opacity, &sizes(6e-6, 0.9, 2.0), &dark, Some(&bare));
}

#[test]
fn x7_an_object_out_of_view_goes_where_its_shadow_falls_out_of_view_too() {
    let text = scene(PANE);
    let settled = |place: &str| {
        let scene = loaded(&text, &settings(&["camera.fov_y=20", place]));
        render(&scene).plan.effects.into_iter().find(|effect| effect.name == "object.pane").unwrap().called_for
    };
    assert!(settled("object.pane.transform={translate=[0, 0, 0]}"));
    assert!(settled("object.pane.transform={translate=[-0.6, 3, 0.9]}"), "it shadows what is seen");
    assert!(!settled("object.pane.transform={translate=[9, 0, 0]}"));
    assert!(!settled("object.pane.transform={translate=[0, 0, 9]}"), "it lies behind the eye");
}

#[test]
fn x7_effect_absorption_that_takes_nothing_is_left_out() {
    let text = scene(&ball("absorption_inside = [0, 0, 0]"));
    let key = "material.ball.absorption_inside=[SIZE, 0, SIZE]";
    let crossed = crosses(&text, "absorption.ball", key, &sizes(3e-6, 3.0, 3.0), &[]);
    assert!(crossed.most_skipped >= 0.03 * crossed.least_visible, "{crossed:?}");
    let settings = settings(&["material.ball.absorption_inside=[1e-6, 0, 1e-6]"]);
    let faint = render(&loaded(&text, &settings));
    assert_eq!(faint.plan.optical_depth_planes, 1);
    assert!(!faint.plan.bends);
}

#[test]
fn x7_effect_color_of_thin_fog_is_left_out() {
    let text = scene(FOG);
    let key = "object.fog.medium_ball.extinction=SIZE";
    let crossed = crosses(&text, "color.fog", key, &sizes(6e-6, 3.0, 3.0), &["effect object.fog=on"]);
    assert!(crossed.most_skipped >= 0.004 * crossed.least_visible, "{crossed:?}");
    let thin = render(&loaded(&text, &settings(&["effect object.fog=on", "object.fog.medium_ball.extinction=3e-6"])));
    assert_eq!(thin.plan.optical_depth_planes, 1);
}

#[test]
fn x7_effect_gradients_of_a_dark_volume_are_left_out() {
    let text = scene(VOLUME);
    crosses(&text, "gradients.volume", "object.volume.color=[SIZE, SIZE, SIZE]", &sizes(1e-5, 1.0, 3.0), &[]);
}

#[test]
fn a_material_that_other_objects_have_stays_as_it_is() {
    // The ground has the default material as well, and no gradients.
    let text = scene(&VOLUME.replace("material = 'volume'\n", ""));
    let dark = settings(&["object.volume.color=[1e-6, 1e-6, 1e-6]", "effect object.volume=on"]);
    let planned = render(&loaded(&text, &dark));
    let gradients = planned.plan.effects.iter().find(|effect| effect.name == "gradients.volume").unwrap();
    assert!(gradients.called_for && gradients.bound == Bound::Unknown, "{gradients:?}");
}

/// Glass that moves out of view.
#[track_caller]
fn goes_with_its_ball(name: &str, material: &str) {
    let text = scene(&ball(material));
    let key = "object.ball.transform={translate=[SIZE, 0, 0]}";
    crosses(&text, name, key, &[0.1, 1.0, 9.0], &["effect object.ball=on"]);
}

#[test]
fn x7_effect_bending_out_of_view_is_left_out() {
    goes_with_its_ball("bending.ball", "ior = 1.5");
}

#[test]
fn x7_effect_dispersion_out_of_view_is_left_out() {
    goes_with_its_ball("dispersion.ball", "cauchy = { a = 1.4, b = 0.05 }");
}

#[test]
fn what_is_switched_off_is_as_if_the_scene_had_never_said_it() {
    let draws_alike = |with: &str, effect: &str, without: &str| {
        let off = draw(&scene(with), &["--effect", &format!("{effect}=off")]).sha256(1.0);
        assert_eq!(off, draw(&scene(without), &[]).sha256(1.0), "{effect}");
        assert_ne!(off, draw(&scene(with), &[]).sha256(1.0), "{effect}");
    };
    draws_alike(&ball("ior = 1.5"), "bending.ball", &ball(""));
    draws_alike(&ball("ior = 1.5\nabsorption_inside = [1, 2, 3]"), "absorption.ball", &ball("ior = 1.5"));
    draws_alike(FOG, "color.fog", &FOG.replace("[0.5, 1, 1.5]", "[1, 1, 1]"));
    draws_alike(VOLUME, "gradients.volume", &VOLUME.replace("'phong'", "'phase'"));
    draws_alike(PANE, "object.pane", "");
}

#[test]
fn a_material_that_objects_share_is_switched_for_one_of_them() {
    let second = "[[object]]\nname = 'mist'\nmaterial = 'fog'\n\
                  medium_ball = { center = [1, 0, 0], radius = 0.5, spacing = 0.1, extinction = 3 }\n";
    let grey_fog = FOG.replace("'fog'\nmedium_ball", "'grey'\nmedium_ball");
    let grey = "[material.grey]\nmedium = { albedo = 0.5 }\n";
    let both = scene(&(second.to_owned() + FOG));
    let apart = scene(&(second.to_owned() + &grey_fog + grey));
    let off = draw(&both, &["--effect", "color.fog=off"]);
    assert_eq!(off.sha256(1.0), draw(&apart, &[]).sha256(1.0));
    assert_ne!(off.sha256(1.0), draw(&both, &["--effect", "color.mist=off"]).sha256(1.0));
}

#[test]
fn effects_of_objects_that_cannot_be_switched_are_refused() {
    // Nothing is known of a technique that is still to be chosen.
    let text = scene(&(PANE.to_owned() + FOG)).replace("technique = 'points'", "technique = 'auto'");
    let place = Place::new(&text);
    let refused = |effect: &str, expected: &str| {
        place.expect(2, &["explain", "s.toml", "--effect", effect], expected);
    };
    refused("object.pain=off", "did you mean `object.pane`?");
    refused("bending.pane=on", "no material of the object has an index other than 1");
    refused("absorption.pane=on", "no material of the object absorbs inside");
    refused("color.pane=on", "all materials of the object absorb red, green and blue alike");
    refused("gradients.fog=on", "no volume of it is shaded by its gradients");
    refused("scatter=of", "expected NAME=on, NAME=off or NAME=auto");
    refused("translucency=off", "`translucency` cannot be switched");
    refused("layers=off", "render.layers says which images are kept");
    place.write("t.toml", scene(&PANE.replace("name = 'pane'", "name = 'pane'\nvisible = false")));
    place.expect(2, &["explain", "t.toml", "--effect", "object.pane=on"], "the object has visible = false");
}

/// By how much a displayed value differs where splats are rounded about another origin.
const ROUNDING: f64 = 1e-5;

/// Objects by chance, in view or not, none of which changes a pixel by more than its bound; nor does the colour of one.
#[track_caller]
fn no_object_exceeds_its_bound(seeds: Range<u64>) {
    let mut left_out = 0;
    for seed in seeds {
        let mut drawn = 0;
        let mut number = |low: f64, high: f64| {
            drawn += 1;
            low + (high - low) * rng::unit(seed, 1, drawn, 0)
        };
        let faint = 10f64.powf(number(-6.0, 0.0));
        let mut more = "[material.tinted]\nextinction_rgb = [0.2, 1, 1.4]\n".to_owned();
        let objects = ["a", "b", "c"];
        for name in objects {
            let center = format!("[{}, {}, {}]", number(-4.0, 4.0), number(-0.5, 3.0), number(-2.0, 6.0));
            let size = number(0.1, 0.6);
            more += &if number(0.0, 2.0) < 1.0 {
                let extinction = faint / size;
                format!(
                    "[[object]]\nname = '{name}'\nmaterial = 'tinted'\n\
                     medium_ball = {{ center = {center}, radius = {size}, extinction = {extinction}, spacing = {} }}\n",
                    0.25 * size
                )
            } else {
                let opacity = faint.min(0.9);
                format!(
                    "[[object]]\nname = '{name}'\nmaterial = 'tinted'\nopacity = {opacity}\n\
                     rectangle = {{ center = {center}, u = [{size}, 0, 0], v = [0, {}, -{size}], spacing = {} }}\n",
                    number(-0.4, 0.4),
                    0.25 * size
                )
            };
        }
        // Automatic cells go by all that casts: an object more would move those of the others.
        let text = scene(&more) + "shadow.cells = 256\n";
        for name in objects {
            for effect in [format!("object.{name}"), format!("color.{name}")] {
                let kept = format!("effect object.{name}=on");
                let whole = loaded(&text, &[]);
                let on = render(&loaded(&text, &[kept.clone(), format!("effect {effect}=on")]));
                let off = format!("effect {effect}=off");
                let is_color = effect.starts_with("color");
                let off = render(&loaded(&text, &if is_color { vec![kept.clone(), off] } else { vec![off] }));
                let change = largest_change(&displayed(&on, &whole), &displayed(&off, &whole));
                let told = on.plan.effects.iter().find(|told| told.name == effect).unwrap();
                let bound = told.bound.number().unwrap_or(1.0);
                left_out += u32::from(told.bound == Bound::Nothing);
                // Splats lie around another origin in a scene without the object.
                assert!(change <= bound + ROUNDING, "seed {seed}, {effect}: {change} beyond {bound}\n{text}");
            }
        }
    }
    assert!(left_out > 0);
}

#[test]
fn no_object_of_scenes_by_chance_exceeds_its_bound() {
    no_object_exceeds_its_bound(0..3);
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn no_object_of_many_scenes_by_chance_exceeds_its_bound() {
        no_object_exceeds_its_bound(3..120);
    }

    #[test]
    fn x7_what_nobody_sees_is_left_out_by_any_technique_and_exposure() {
        let opacity = "object.pane.opacity=SIZE";
        for list in [
            &["render.technique=surfels"][..],
            &["render.technique=reference"],
            &["render.tolerance=0.0009"],
            &["render.exposure=-4", "light.sun.irradiance=[50, 50, 50]"],
        ] {
            crosses(&scene(PANE), "object.pane", opacity, &sizes(1e-6, 0.5, 3.0), list);
        }
        let glass = scene(&ball("ior = 1.5\nabsorption_inside = [0, 0, 0]"));
        let key = "material.ball.absorption_inside=[SIZE, 0, SIZE]";
        crosses(&glass, "absorption.ball", key, &sizes(1e-7, 3.0, 3.0), &[]);
    }
}
