//! What `technique = "auto"` draws: the technique that is named by hand gives the same bits, and the choice knows neither threads nor the order or
//! unit of a scene.

use organza::scene::{LoadOptions, parse};
use organza::{Progress, RenderOptions, explain};
use organza_tests::{Place, draw, draw_file, largest_difference, parallel_view, window};
use serde_json::Value;

const HALF_VECTORS: [&str; 6] = [
    "--technique",
    "sheets",
    "--set",
    "render.sheets.slicing='half_vector'",
    "--set",
    "render.sheets.scattering='forward_and_back'",
];

/// A cloud over a ground, in a scene whose lengths are `scale` times as large and whose places lie `shift` farther; objects and lights may be reversed.
fn cloud(scale: f64, shift: f64, is_reversed: bool) -> String {
    let place =
        |x: f64, y: f64, z: f64| format!("[{:?}, {:?}, {:?}]", x * scale + shift, y * scale + shift, z * scale + shift);
    let length = |length: f64| length * scale;
    let mut parts = [
        "[[light]]\nkind = 'directional'\ndirection = [0.3, -0.7, -0.5]\nirradiance = [3, 3, 3]\n".to_owned(),
        "[[light]]\nkind = 'directional'\ndirection = [-0.5, -0.7, 0.25]\nirradiance = [0.5, 0.5, 1]\n".to_owned(),
        format!(
            "[[object]]\nname = 'cloud'\nmaterial = 'cloud'\n\
             medium_ball = {{ center = {}, radius = {:?}, extinction = {:?}, spacing = {:?} }}\n",
            place(0.0, 0.25, 0.0),
            length(0.5),
            6.0 / scale,
            length(0.0625)
        ),
        format!(
            "[[object]]\nname = 'ground'\nrectangle = {{ center = {}, u = [{:?}, 0, 0], v = [0, 0, {:?}], spacing = {:?} }}\n",
            place(0.0, -0.5, 0.0),
            length(2.0),
            length(-2.0),
            length(0.125)
        ),
    ];
    if is_reversed {
        parts.reverse();
    }
    format!(
        "version = 1\n[camera]\nposition = {}\ntarget = {}\nsize = [40, 30]\n[background]\ncolor = [0.1, 0.2, 0.4]\n\
         [material.cloud]\nmedium = {{ albedo = 0.98, asymmetry = 0.3 }}\n[render]\nantialias = 1\n{}",
        place(0.0, 0.5, 4.0),
        place(0.0, 0.0, 0.0),
        parts.concat()
    )
}

#[test]
fn auto_is_what_is_named_bit_for_bit() {
    let chosen = draw(&cloud(1.0, 0.0, false), &["--layers", "effects"]);
    assert_eq!(
        chosen.sha256(1.0),
        draw(&cloud(1.0, 0.0, false), &[&HALF_VECTORS[..], &["--layers", "effects"]].concat()).sha256(1.0)
    );
    assert!(chosen.channel("scatterN.G").iter().any(|v| *v > 0.01));
    let points = draw(&cloud(1.0, 0.0, false), &["--technique", "points"]);
    assert!(largest_difference(&points.channel("G"), &draw(&cloud(1.0, 0.0, false), &[]).channel("G")) > 0.05);
    // Black smoke scatters nothing again.
    let smoke = cloud(1.0, 0.0, false).replace("albedo = 0.98", "albedo = 0");
    assert_eq!(draw(&smoke, &[]).sha256(1.0), draw(&smoke, &["--technique", "points"]).sha256(1.0));
    let glass = smoke.replace("[material.cloud]", "[material.glass]\nior = 1.5\n[material.cloud]")
        + "[[object]]\nname = 'glass'\nmaterial = 'glass'\nimplicit = { expression = 'x^2 + y^2 + (z - 1)^2 - 0.09', \
           box = [[-0.5, -0.5, 0.5], [0.5, 0.5, 1.5]], spacing = 0.05 }\n";
    let named = ["--technique", "points", "--set", "object.glass.technique='surfels'"];
    assert_eq!(draw(&glass, &[]).sha256(1.0), draw(&glass, &named).sha256(1.0));
}

#[test]
fn the_choice_knows_no_threads_no_order_and_no_unit() {
    let chosen = |text: &str| {
        let scene = parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap();
        let plan = explain(&scene, &RenderOptions::default(), &Progress::new()).unwrap().plan;
        let mut by: Vec<(String, &str)> = plan.objects.iter().map(|o| (o.object.clone(), o.technique.name())).collect();
        by.sort();
        let errors: Vec<f64> = plan.estimates.iter().map(|estimate| estimate.displayed_error).collect();
        (by, plan.scatters_again, errors)
    };
    let (by, scatters_again, errors) = chosen(&cloud(1.0, 0.0, false));
    assert!(scatters_again && by.iter().all(|(_, technique)| *technique == "sheets"), "{by:?}");
    for text in [cloud(1.0, 0.0, true), cloud(2.0, 0.0, false), cloud(1.0, 1024.0, false)] {
        let (others, again, other_errors) = chosen(&text);
        assert_eq!((&by, scatters_again), (&others, again));
        assert_eq!(errors.len(), other_errors.len());
        assert!(errors.iter().zip(&other_errors).all(|(a, b)| (a - b).abs() < 1e-6), "{errors:?} {other_errors:?}");
    }
    let run = |threads: &str| draw(&cloud(1.0, 0.0, false), &["--threads", threads]).sha256(1.0);
    let one = run("1");
    assert!(["2", "3"].into_iter().all(|threads| run(threads) == one));
    assert_eq!(draw(&cloud(1.0, 0.0, true), &[]).sha256(1.0), one);
    assert_eq!(draw(&cloud(2.0, 0.0, false), &[]).channel("G"), draw(&cloud(1.0, 0.0, false), &[]).channel("G"));
}

/// What `explain` has of an estimate.
struct Told {
    error: f64,
    draws: bool,
}

#[test]
fn explain_says_what_techniques_err_by_and_warns_of_what_is_left_out_once() {
    let place = Place::new(&cloud(1.0, 0.0, false));
    let told = |more: &[&str]| {
        let out = place.expect(0, &[&["explain", "s.toml", "--json"], more].concat(), "");
        let document: Value = serde_json::from_slice(&out.stdout).unwrap();
        (document, String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let estimate = |document: &Value, technique: &str| {
        let estimates = document["plan"]["estimates"].as_array().unwrap().clone();
        let found = estimates.into_iter().find(|e| e["technique"] == technique).unwrap();
        Told { error: found["displayed_error"].as_f64().unwrap(), draws: found["draws"] == true }
    };
    let (document, said) = told(&[]);
    let [sheets, points] = ["sheets", "points"].map(|name| estimate(&document, name));
    assert!(sheets.error < 0.2 * points.error && points.error > 0.1, "{} {}", sheets.error, points.error);
    assert!(sheets.draws && !points.draws);
    assert!(!said.contains("left out"), "{said}");
    // By name a note tells of the effect; where glass keeps `auto` from it, a warning does, once.
    let (document, said) = told(&["--technique", "points"]);
    assert!(estimate(&document, "points").draws && said.matches("again and again").count() == 1, "{said}");
    let glass = "[material.glass]\nior = 1.5\n[[object]]\nname = 'glass'\nmaterial = 'glass'\nimplicit = { \
         expression = 'x^2 + y^2 + (z - 1)^2 - 0.09', box = [[-0.5, -0.5, 0.5], [0.5, 0.5, 1.5]], spacing = 0.05 }\n";
    place.write("s.toml", cloud(1.0, 0.0, false) + glass);
    let (_, said) = told(&[]);
    assert!(said.contains("warning: object 'cloud': `points` errs by about"), "{said}");
    assert_eq!(said.matches("again and again").count(), 1, "{said}");
}

#[test]
fn a_glass_ball_in_fog_before_scanned_points_is_drawn_by_three_techniques() {
    let [first, second, opacity] = [0.5f64, 0.8, 0.35];
    let scan: String = (0..41 * 41)
        .map(|k| format!("{:?},{:?},-2\n", f64::from(k % 41) * 0.1 - 2.0, f64::from(k / 41) * 0.1 - 2.0))
        .collect();
    let fog = |name: &str, low: f64, high: f64, optical_depth: f64| {
        format!(
            "[[object]]\nname = '{name}'\nmaterial = 'fog'\ntechnique = 'sheets'\nmedium_box = {{ min = [-2, -2, {low:?}], \
             max = [2, 2, {high:?}], extinction = {:?}, spacing = 0.1 }}\n",
            optical_depth / (high - low)
        )
    };
    let text = parallel_view(2.0, 32)
        + "[material.fog]\nmedium = { albedo = 0 }\n[material.white]\nshading = 'unlit'\n[material.glass]\nior = 1.5\n\
           [material.pane]\nior = 1.0\nshading = 'unlit'\ncolor = [0, 0, 0]\n\
           [[object]]\nname = 'scan'\nmaterial = 'white'\npoints = 'scan.csv'\n\
           [[object]]\nname = 'ball'\nmaterial = 'glass'\nimplicit = { expression = '(x + 0.7)^2 + (y + 0.7)^2 + z^2 - 0.04', \
           box = [[-1, -1, -0.3], [-0.4, -0.4, 0.3]], spacing = 0.04 }\n"
        + &fog("near", 0.5, 1.0, first)
        + &fog("far", -1.0, -0.5, second)
        + &format!(
            "[[object]]\nname = 'pane'\nmaterial = 'pane'\nopacity = {opacity:?}\n\
             rectangle = {{ center = [0, 0, 0], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }}\n[render]\nantialias = 1\n"
        );
    let place = Place::new(&text);
    place.write("scan.csv", "x,y,z\n".to_owned() + &scan);
    let out = place.expect(0, &["explain", "s.toml", "--json"], "");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    // Opaque points are the frame's, which every technique shares.
    assert_eq!(document["plan"]["technique"], "sheets and surfels");
    let drawing = |name: &str| {
        let objects = document["plan"]["samplers"].as_array().unwrap();
        objects.iter().find(|o| o["object"] == name).unwrap()["technique"].clone()
    };
    let names = ["near", "pane", "ball", "far", "scan"];
    assert_eq!(names.map(drawing), ["sheets", "surfels", "surfels", "sheets", "points"]);
    let picture = draw_file(&place.path("s.toml"), &[]);
    let exact = (-first - second).exp() * (1.0 - opacity);
    for seen in window(&picture.channel("G"), 32, 14..26, 6..18) {
        assert!((seen - exact).abs() < 1e-3, "{seen}, not {exact}");
    }
}

#[test]
fn what_scatters_again_is_chosen_as_the_scene_switches_it() {
    let cloud = cloud(1.0, 0.0, false);
    let points = draw(&cloud, &["--technique", "points"]);
    assert_eq!(draw(&cloud, &["--effect", "scatter=off"]).sha256(1.0), points.sha256(1.0));
    // Haze that scatters too little again for anyone to see, where that is switched on.
    let haze = cloud.replace("extinction = 6.0", "extinction = 0.001");
    assert_ne!(haze, cloud);
    assert_eq!(draw(&haze, &["--effect", "scatter=on"]).sha256(1.0), draw(&haze, &HALF_VECTORS).sha256(1.0));
    // A technique that is named is not changed.
    let place = Place::new(&cloud);
    let named = ["render", "s.toml", "-o", "s.exr", "--technique", "points", "--effect", "scatter=on"];
    place.expect(2, &named, "nothing scatters light more than once");
}

/// The technique of each of these objects, as `explain` tells it of a scene beside which `mesh.obj` and `dots.csv` lie.
fn drawn_by(text: &str, names: &[&str]) -> Vec<String> {
    let place = Place::new(text);
    place.write("mesh.obj", coarse_ball());
    place.write("dots.csv", "x,y,z\n-0.2,0,0\n0.2,0,0\n0,0.2,0\n0,-0.2,0\n");
    let out = place.expect(0, &["explain", "s.toml", "--json"], "");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    let objects = document["plan"]["samplers"].as_array().unwrap();
    // Objects are listed where techniques differ in what they draw of them.
    let technique = |name: &&str| {
        let listed = objects.iter().find(|o| o["object"] == **name).map(|o| &o["technique"]);
        listed.unwrap_or(&document["plan"]["technique"]).as_str().unwrap().to_owned()
    };
    names.iter().map(technique).collect()
}

/// A ball of radius 0.4 whose triangles bend so much at their edges that discs show it.
fn coarse_ball() -> String {
    let mut text = String::new();
    let [sides, rings] = [12, 6];
    for ring in 0..=rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for side in 0..sides {
            let around = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let [x, y, z] = [polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin()];
            text += &format!("v {:?} {:?} {:?}\n", 0.4 * x, 0.4 * y, 0.4 * z);
        }
    }
    for ring in 0..rings {
        for side in 0..sides {
            let [here, next] = [side, (side + 1) % sides].map(|side| ring * sides + side + 1);
            text += &format!("f {here} {next} {} {}\n", next + sides, here + sides);
        }
    }
    text
}

#[test]
fn a_translucent_mesh_stays_triangles_where_no_pixel_has_anything_else_translucent() {
    let scene = |x_of_puff: f64, ground: &str| {
        parallel_view(4.0, 64)
            + "[material.puff]\nmedium = { albedo = 0 }\n[[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [3, 3, 3]\n\
               [[object]]\nname = 'ball'\nmesh = 'mesh.obj'\nopacity = 0.5\ntransform = { translate = [-1, 0, 0] }\n"
            + &format!(
                "[[object]]\nname = 'puff'\nmaterial = 'puff'\n\
                 medium_ball = {{ center = [{x_of_puff:?}, 0, -1], radius = 0.4, extinction = 3, spacing = 0.1 }}\n{ground}"
            )
    };
    assert_eq!(drawn_by(&scene(1.0, ""), &["ball", "puff"]), ["sheets", "points"]);
    // Behind the ball, or no farther beside it than its discs reach.
    assert_eq!(drawn_by(&scene(-1.0, ""), &["ball", "puff"]), ["points", "points"]);
    assert_eq!(drawn_by(&scene(-0.19, ""), &["ball", "puff"]), ["points", "points"]);
    // Points that are opaque hide it or do not, whatever the order; others may lie between.
    let ground = |more: &str| {
        format!("[[object]]\nname = 'ground'\npoints = 'dots.csv'\n{more}transform = {{ translate = [-1, 0, -1] }}\n")
    };
    assert_eq!(drawn_by(&scene(1.0, &ground("")), &["ball"]), ["sheets"]);
    assert_eq!(drawn_by(&scene(1.0, &ground("opacity = 0.5\n")), &["ball"]), ["points"]);
}

#[test]
fn slabs_carry_the_light_of_a_lamp_of_many_points() {
    let volume = "[[object]]\nname = 'plate'\ndensity = { expression = 'max(0, 0.3 - abs(y))', box = [[-1, -0.4, -1], [1, 0.4, 1]], spacing = 0.03, \
                  extinction = 60 }\n";
    let lamp = |samples: u32| {
        format!(
            "[[light]]\nkind = 'sphere'\nposition = [0.5, 4, 1]\nradius = 0.5\nintensity = [20, 20, 20]\nsamples = {samples}\n"
        )
    };
    let text = |samples: u32| parallel_view(4.0, 32) + volume + &lamp(samples);
    assert_eq!(drawn_by(&text(24), &["plate"]), ["sheets"]);
    let named = ["--technique", "sheets", "--set", "render.sheets.slicing='half_vector'"];
    assert_eq!(draw(&text(24), &[]).sha256(1.0), draw(&text(24), &named).sha256(1.0));
    // A single map is no work to save.
    assert_eq!(drawn_by(&text(1), &["plate"]), ["points"]);
    let place = Place::new(&text(24));
    let out = place.expect(0, &["explain", "s.toml"], "");
    let told = String::from_utf8_lossy(&out.stdout).into_owned();
    for setting in ["render.sheets.slicing", "render.sheets.scattering"] {
        assert!(told.lines().any(|line| line.starts_with(setting) && line.contains("plan")), "{told}");
    }
}

#[test]
fn volumes_too_unlike_for_common_slabs_are_drawn_by_splats() {
    let ball = |name: &str, radius: f64, spacing: f64| {
        format!(
            "[[object]]\nname = '{name}'\ndensity = {{ expression = 'max(0, {radius:?} - sqrt(x^2 + y^2 + z^2))', \
             box = [[{0:?}, {0:?}, {0:?}], [{radius:?}, {radius:?}, {radius:?}]], spacing = {spacing:?}, extinction = {1:?} }}\n",
            -radius,
            4.0 / (radius * radius)
        )
    };
    let lamp =
        "[[light]]\nkind = 'sphere'\nposition = [0.5, 4, 1]\nradius = 0.5\nintensity = [20, 20, 20]\nsamples = 24\n";
    let drawn = |fine: f64| {
        let text = parallel_view(4.0, 16) + &ball("large", 1.5, 0.05) + &ball("small", 8.0 * fine, fine) + lamp;
        Place::new(&text).expect(0, &["render", "s.toml", "-o", "s.exr", "--force"], "");
        drawn_by(&text, &["large", "small"])
    };
    // A kernel of the large one would lie in a thousand slabs of the small one's step.
    assert_eq!(drawn(5e-5), ["points", "points"]);
    assert_eq!(drawn(0.05), ["sheets", "sheets"]);
}

#[test]
fn bumps_are_drawn_by_the_technique_that_shows_them() {
    let text = parallel_view(4.0, 32)
        + "[material.clay]\nbump = { height = 0.02, size = 0.25 }\n[[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [3, 3, 3]\n\
           [[object]]\nname = 'ball'\nmaterial = 'clay'\n\
           implicit = { expression = 'x^2 + y^2 + z^2 - 1', box = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]], spacing = 0.2 }\n";
    assert_eq!(drawn_by(&text, &["ball"]), ["surfels"]);
    assert_eq!(drawn_by(&text.replace("height = 0.02", "height = 0"), &["ball"]), ["points"]);
}
