//! `organza extract`: the surface that a light sees first, and what is asked for in vain.

use convert::read::{Loaded, ReadParams, file};
use organza_tests::Place;

/// A ball of fog before a wall that casts no shadow, one light from above and one from the side.
const SCENE: &str = "version = 1\n[camera]\nposition = [0, 2, 5]\ntarget = [0, 0, 0]\nsize = [24, 18]\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n\
    [[light]]\nkind = 'sphere'\nposition = [1006, 0, 0]\nradius = 0.5\nintensity = [9, 9, 9]\n\
    [[object]]\nname = 'fog'\nmedium_ball = { center = [1000, 0, 0], radius = 1, extinction = 8, spacing = 0.05 }\n\
    [[object]]\nname = 'wall'\nrectangle = { center = [1003, 0, 0], u = [0, 2, 0], v = [0, 0, 2], spacing = 0.1 }\ncasts_shadow = false\n";

#[test]
fn a_light_sees_a_ball_of_fog_where_it_is_as_thick_as_is_asked_for() {
    let place = Place::new(SCENE);
    for (light, absorbance, axis) in [("0", 0.5, 1), ("1", 2.0, 0)] {
        let out = format!("{light}.ply");
        place.expect(
            0,
            &["extract", "s.toml", "--light", light, "--absorbance", &format!("{absorbance}"), "-o", &out],
            "",
        );
        let Ok((Loaded::Points(points), notes)) = file(&place.path(&out), &ReadParams::default(), None) else {
            panic!()
        };
        assert!(points.len() > 500 && points.normal.len() == points.len() && notes.unused.is_empty());
        let mut near = 0;
        for (p, normal) in points.position.iter().zip(&points.normal) {
            let p = points.origin + p.as_dvec3() - glam::DVec3::X * 1000.0;
            let axis = glam::DVec3::AXES[axis];
            // Straight in, in the middle of what the light sees: the way into the ball is absorbance / extinction.
            if p.reject_from(axis).length() < 0.2 {
                let depth = (1.0 - p.reject_from(axis).length_squared()).sqrt() - p.dot(axis);
                assert!((depth - absorbance / 8.0).abs() < 0.06, "light {light}: {depth}");
                assert!(normal.as_dvec3().dot(axis) > 0.8, "light {light}: {normal}");
                near += 1;
            }
            assert!(p.length() < 1.1, "the wall casts no shadow: {p}");
        }
        assert!(near > 10, "{near}");
    }
    // A scene draws them as the points that they are.
    let drawn = SCENE.replace(
        "[[object]]\nname = 'fog'",
        "[[object]]\nname = 'seen'\npoints = '0.ply'\n[[object]]\nname = 'fog'\nvisible = false",
    );
    place.write(
        "drawn.toml",
        drawn.replace("[0, 2, 5]", "[1000, 2, 5]").replace("target = [0, 0, 0]", "target = [1000, 0, 0]"),
    );
    place.expect(0, &["render", "drawn.toml", "-o", "drawn.png"], "");
}

#[test]
fn what_no_light_sees_is_refused_and_nothing_is_written() {
    let place = Place::new(SCENE);
    for (arguments, code, said) in [
        (["--light", "2"], 2, "--light: expected a light below 2, found 2"),
        (["--absorbance", "0"], 2, "--absorbance: expected a number above 0, at most 10, found 0"),
        (["--absorbance", "nan"], 2, "--absorbance: expected a number above 0, at most 10, found NaN"),
        (["--set", "object.fog.casts_shadow=false"], 3, "light 0: none of its rays meets an absorbance of 1"),
    ] {
        place.expect(code, &[&["extract", "s.toml", "-o", "seen.ply"], &arguments[..]].concat(), said);
        assert!(!place.path("seen.ply").exists(), "{arguments:?}");
    }
    place.expect(2, &["extract", "s.toml", "-o", "seen.png"], "expected a name that ends in .ply");
}
