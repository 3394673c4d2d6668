//! The surface that a light sees first, by `organza extract` and as an object; where things stop; and what is asked for in vain.

use organza::{Context, scene};
use organza_tests::Place;
use read::{Loaded, ReadParams, file};
use serde_json::Value;

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
                // A tenth of the spacing.
                assert!((depth - absorbance / 8.0).abs() < 0.005, "light {light}: {depth}");
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
        (
            ["--set", "object.fog.casts_shadow=false"],
            3,
            "s.toml: `absorbance`: expected matter on rays of light 0 in all that is visible, found none",
        ),
    ] {
        place.expect(code, &[&["extract", "s.toml", "-o", "seen.ply"], &arguments[..]].concat(), said);
        assert!(!place.path("seen.ply").exists(), "{arguments:?}");
    }
    place.expect(2, &["extract", "s.toml", "-o", "seen.png"], "expected a name that ends in .ply");
}

/// What a scene is drawn as, 24 by 18 pixels.
fn drawn(text: &str, frame: Option<u32>) -> Result<Vec<[f32; 3]>, organza::Error> {
    let options = scene::LoadOptions { frame, ..Default::default() };
    let scene = scene::parse("s.toml".as_ref(), text.as_bytes(), &options)?;
    let render = organza::render(&scene, &organza::RenderOptions::default(), &organza::Progress::new())?;
    Ok(render.layers.rgb("beauty").unwrap().to_vec())
}

#[test]
fn an_extraction_is_drawn_as_its_points_are_by_every_technique() {
    let scene = SCENE.replace("[0, 2, 5]", "[1000, 2, 5]").replace("target = [0, 0, 0]", "target = [1000, 0, 0]");
    let place = Place::new(&scene);
    place.expect(0, &["extract", "s.toml", "--light", "1", "--absorbance", "2", "-o", "1.ply"], "");
    let hidden = scene.replace("name = 'fog'", "name = 'fog'\nvisible = false");
    for (technique, opacity) in
        [("points", 1.0), ("particles", 0.5), ("surfels", 0.5), ("sheets", 1.0), ("reference", 1.0)]
    {
        let with = |source: &str| {
            format!(
                "{hidden}[[object]]\nname = 'seen'\n{source}\nopacity = {opacity}\n[render]\ntechnique = '{technique}'\n"
            )
        };
        let seen = with("extract = { light = 1, absorbance = 2.0, objects = ['fog'] }");
        place.write("a.toml", &seen);
        place.write("b.toml", with("points = '1.ply'"));
        for name in ["a", "b"] {
            place.expect(0, &["render", &format!("{name}.toml"), "-o", &format!("{name}.{technique}.png")], "");
        }
        let [a, b] = ["a", "b"].map(|name| place.pixels(&format!("{name}.{technique}.png")));
        assert!(a == b, "{technique}");
        // It has the colours of its object, and what casts no shadow is not seen.
        assert_ne!(drawn(&seen, None).unwrap(), drawn(&hidden, None).unwrap(), "{technique}");
    }
    let explained = place.run(&["explain", "a.toml"]);
    assert!(String::from_utf8_lossy(&explained.stdout).contains("seen"), "{explained:?}");
    let info = place.run(&["info", "a.toml"]);
    assert!(String::from_utf8_lossy(&info.stdout).contains("extract"), "{info:?}");
    // What lights look at counts as memory.
    let explained: Value = serde_json::from_slice(&place.run(&["explain", "a.toml", "--json"]).stdout).unwrap();
    let bytes = explained["memory_bytes"].to_string();
    place.expect(0, &["render", "a.toml", "-o", "c.exr", "--max-memory", &bytes], "");
    place.expect(5, &["render", "a.toml", "-o", "d.exr", "--max-memory", "1000000"], "");
    place.write("a.toml", format!("{hidden}[[object]]\nname = 'seen'\nextract = {{ objects = ['wall'] }}\n"));
    place.expect(
        3,
        &["render", "a.toml", "-o", "c.png"],
        "object `seen`: `absorbance`: expected matter on rays of light 0 in `wall`, found none",
    );
    assert!(!place.path("c.png").exists());
}

#[test]
fn too_great_an_absorbance_is_refused_where_it_is_written_with_what_there_is() {
    let thin = SCENE.replace("extinction = 8", "extinction = 1");
    let head = thin.lines().count();
    let place = Place::new(&thin);
    place.write(
        "a.toml",
        format!("{thin}[[object]]\nname = 'seen'\nextract = {{ absorbance = 5, objects = ['fog'] }}\n"),
    );
    let output = place.run(&["render", "a.toml", "-o", "a.png"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let begin = format!("a.toml:{}:26: object `seen`: `absorbance`: expected at most ", head + 3);
    let most = said
        .split_once(&begin)
        .and_then(|(_, rest)| rest.split_once(", which is all that a ray of light 0 meets in `fog`, found 5"));
    let most = most.unwrap_or_else(|| panic!("{said}")).0.to_owned();
    // Through its middle the ball is two radii thick.
    assert!((most.parse::<f64>().unwrap() / 2.0 - 1.0).abs() < 0.1, "{most}");
    // As much as that is seen, and a little more is not, wherever it is asked for.
    let set = |absorbance: f64| format!("object.seen.extract.absorbance={absorbance}");
    let absorbance: f64 = most.parse().unwrap();
    place.expect(0, &["render", "a.toml", "-o", "a.png", "--set", &set(absorbance)], "");
    let more = set(absorbance * 1.01);
    let said = format!("--set {more}: object `seen`: `absorbance`: expected at most {most}");
    place.expect(2, &["render", "a.toml", "-o", "b.png", "--set", &more], &said);
    let said = format!(
        "s.toml: `absorbance`: expected at most {most}, which is all that a ray of light 0 meets in all that is visible, found 6"
    );
    place.expect(3, &["extract", "s.toml", "--absorbance", "6", "-o", "b.ply"], &said);
}

/// A ball that falls through a table, seen by a light from above.
const FALLING: &str = "version = 1\n[camera]\nposition = [0, 0.5, 5]\ntarget = [0, 0, 0]\nsize = [24, 18]\n\
    [[light]]\nkind = 'directional'\ndirection = [0.1, -1, -0.2]\nirradiance = [2, 2, 2]\n\
    [[object]]\nname = 'table'\nrectangle = { center = [0, -0.5, 0], u = [1, 0, 0], v = [0, 0, -1], spacing = 0.05 }\n\
    [[object]]\nname = 'ball'\nimplicit = { expression = 'x^2 + y^2 + z^2 - 0.04', \
    box = [[-0.3, -0.3, -0.3], [0.3, 0.3, 0.3]], spacing = 0.04 }\n\
    [animation]\nframes = 9\n[[animation.track]]\nset = 'object.ball.transform.translate'\n\
    keys = [{ frame = 0, value = [0, 1, 0] }, { frame = 8, value = [0, -1, 0] }]\nstop = {}\n";

#[test]
fn what_falls_stops_where_the_light_sees_it_meet_the_table_in_whatever_frames_are_drawn() {
    // It touches the table when its middle is at −0.3: at frame 5.2, within a hundredth of a frame.
    let held = |y: f64| {
        let still = FALLING.split("[animation]").next().unwrap().to_owned();
        drawn(&format!("{still}transform = {{ translate = [0, {y}, 0] }}\n"), None).unwrap()
    };
    let far = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let frames: Vec<_> = (0..9).map(|k| drawn(FALLING, Some(k)).unwrap()).collect();
    assert!(frames[5] == held(-0.25));
    assert!(far(&frames[8], &held(-0.3)) < 0.02 && frames[6] == frames[8]);
    assert!(far(&frames[8], &held(-0.25)) > 0.05, "{}", far(&frames[8], &held(-0.25)));
    // A frame alone, and among others that were drawn before it.
    let place = Place::new(FALLING);
    place.expect(0, &["render", "s.toml", "-o", "all.png", "--frames"], "object 'ball' stops at frame 5.2");
    place.expect(0, &["render", "s.toml", "-o", "one.png", "--frames=7-7"], "object 'ball' stops at frame 5.2");
    assert!(place.bytes("all.0007.png") == place.bytes("one.0007.png"));
    // Without its light's table it falls on.
    let through = FALLING.replace("stop = {}", "");
    assert!(drawn(&through, Some(5)).unwrap() == frames[5] && drawn(&through, Some(8)).unwrap() != frames[8]);
}

/// A ball of fog that goes away from frame 2 on, what a light sees of it, and a camera that moves.
const SEEN_MOVING: &str = "version = 1\n[camera]\nposition = [0, 0.5, 5]\ntarget = [0, 0, 0]\nsize = [24, 18]\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, -0.3]\nirradiance = [2, 2, 2]\n\
    [[object]]\nname = 'fog'\nvisible = false\nmedium_ball = { center = [0, 0, 0], radius = 1, extinction = 8, spacing = 0.1 }\n\
    [[object]]\nname = 'seen'\nextract = { objects = ['fog'] }\n\
    [[object]]\nname = 'aside'\nrectangle = { center = [0, -1, 0], u = [1, 0, 0], v = [0, 0, -1], spacing = 0.1 }\n\
    [animation]\nframes = 4\n[[animation.track]]\nset = 'camera.position'\n\
    keys = [{ frame = 0, value = [0, 0.5, 5] }, { frame = 3, value = [1, 0.5, 5] }]\n\
    [[animation.track]]\nset = 'object.aside.transform.translate'\n\
    keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 3, value = [0, -1, 0] }]\n\
    [[animation.track]]\nset = 'object.fog.transform.translate'\n\
    keys = [{ frame = 1, value = [0, 0, 0] }, { frame = 3, value = [-0.5, 0, 0] }]\n";

#[test]
fn what_a_light_sees_is_kept_while_it_stays_and_frames_are_as_those_alone() {
    let frame = |frame| {
        let options = scene::LoadOptions { frame: Some(frame), ..Default::default() };
        scene::parse("s.toml".as_ref(), SEEN_MOVING.as_bytes(), &options).unwrap()
    };
    let options = organza::RenderOptions::default();
    let progress = organza::Progress::new();
    let frames = [0, 1, 2, 3].map(frame);
    let files = organza::Files::default();
    let points = frames.each_ref().map(|frame| {
        let (fitted, _) =
            organza::fitted(frame, Context { files: &files, options: &options, progress: &progress }).unwrap();
        let scene::Source::Extract(source) = &fitted.objects[1].source else { panic!() };
        source.points.clone().unwrap()
    });
    // Camera and table move, what the light sees does not; then it does.
    assert!(std::sync::Arc::ptr_eq(&points[0], &points[1]));
    let places = points.each_ref().map(|p| (p.origin, &p.position));
    assert!(places[1] != places[2] && places[2] != places[3]);
    let mut sequence = organza::Sequence::new(&frames);
    let picture = |render: organza::Render| render.layers.rgb("beauty").unwrap().to_vec();
    for frame in &frames {
        let alone = picture(organza::render(frame, &options, &progress).unwrap());
        assert!(picture(sequence.render(frame, &options, &progress).unwrap()) == alone);
    }
}
