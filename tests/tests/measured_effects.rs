//! `organza explain --measure`: each effect drawn with and without.

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
