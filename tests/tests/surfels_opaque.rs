//! Opaque surfaces by the technique `surfels`, and light that falls on pixels, through the whole command.

use organza::scene::{LoadOptions, Scene, parse};
use organza::{Progress, RenderOptions, explain, render};
use organza_tests::{draw, draw_in, organza, parallel_view, window};

fn scene(text: &str) -> Scene {
    parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap()
}

/// An opaque ball in the light of a sun, its discs a tenth of its radius apart.
fn ball(more: &str) -> String {
    format!(
        "{}[ambient]\ncolor = [0.2, 0.2, 0.2]\n\
         [[light]]\nkind = 'directional'\ndirection = [-0.5, -0.6, -1]\nirradiance = [2, 2, 2]\n\
         [[object]]\nname = 'ball'\nimplicit = {{ expression = '1 - sqrt(x^2 + y^2 + z^2)', \
         box = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]], spacing = 0.1 }}\n{more}",
        parallel_view(2.4, 96)
    )
}

/// Places of the pixels of [`ball`], x and y.
fn places() -> impl Iterator<Item = [f64; 2]> {
    (0..96 * 96).map(|k| [k % 96, k / 96].map(|v| (f64::from(v) - 47.5) * 2.4 / 96.0))
}

/// No rim sticks out over the silhouette, no hole is within it, and nothing there is darker than the ball is.
#[test]
fn an_opaque_ball_ends_where_it_does_and_is_lit_up_to_there() {
    for keys in ["", "opaque = 'one_pass'", "opaque = 'one_pass'\ngroups = 4", "shading = 'discs'", "disc_scale = 1"] {
        let picture = draw(
            &ball(&format!("[render]\ntechnique = 'surfels'\nlayers = ['depth']\n[render.surfels]\n{keys}\n")),
            &[],
        );
        let [alpha, green, depth] = ["A", "G", "depth.first.Z"].map(|c| picture.channel(c));
        let nearest = depth.iter().copied().fold(f64::INFINITY, f64::min);
        for (k, [x, y]) in places().enumerate() {
            let radius = x.hypot(y);
            let light = alpha[k];
            assert!(radius < 1.03 || light == 0.0, "{keys}: {light} at {radius}");
            assert!(radius > 0.97 || light == 1.0, "{keys}: {light} at {radius}");
            if radius < 0.97 {
                // Lambert on the ball, y down in the picture.
                let z = (1.0 - radius * radius).sqrt();
                let cosine = (0.5 * x - 0.6 * y + z) / 1.61f64.sqrt();
                let exact = 0.2 + 2.0 / std::f64::consts::PI * cosine.max(0.0);
                assert!((green[k] - exact).abs() < 0.08, "{keys}: {} for {exact} at {x} {y}", green[k]);
            }
            if radius < 0.5 {
                let z = (1.0 - radius * radius).sqrt();
                let behind = depth[k] - nearest - (1.0 - z);
                // Planes of discs of radius R lie before the ball by up to R²/2, and samples half a pixel beside its middle.
                let reach = 0.24 * if keys == "disc_scale = 1" { 1.0 } else { 0.6 };
                let most = 0.5 * reach * reach + 0.0125 * 2f64.sqrt() * radius / z + 1e-6;
                assert!(behind.abs() < most, "{keys}: {behind} at {radius}");
            }
        }
    }
}

/// Translucent fog by points lies before and behind an opaque ball by surfels as before one by points.
#[test]
fn what_other_techniques_draw_lies_before_and_behind_opaque_surfels() {
    let fog = "technique = 'points'\n[[object]]\nname = 'fog'\ntechnique = 'points'\n\
               medium_box = { min = [-2, -2, -0.5], max = [2, 2, 2], spacing = 0.1, extinction = 0.5 }\n";
    let [points, surfels] = ["points", "surfels"].map(|t| draw(&ball(&fog.replacen("points", t, 1)), &[]));
    for channel in ["R", "G", "B", "A"] {
        let a = points.channel(channel);
        let b = surfels.channel(channel);
        let square = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
        assert!(square.sqrt() < 0.01, "{channel}: RMSE {}", square.sqrt());
    }
}

#[test]
fn splats_are_shaded_only_where_somebody_shows_what_that_gives() {
    let passes = |more: &str| {
        let scene = scene(&ball(&format!("opacity = 0.5\n{more}")));
        let planned = explain(&scene, &RenderOptions::default(), &Progress::new()).unwrap().plan;
        let drawn = render(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
        let planned: Vec<String> = planned.passes.into_iter().map(|p| p.name).collect();
        let mut ran: Vec<String> = drawn.cost.stages.into_iter().map(|s| s.name).collect();
        ran.dedup();
        for pass in ["project", "shade", "opaque", "surfels", "group"] {
            let has_pass = |names: &[String]| names.iter().any(|name| name == pass);
            assert_eq!(has_pass(&planned), has_pass(&ran), "{pass}: {planned:?} {ran:?}");
        }
        ran
    };
    let wall = |technique: &str| {
        format!(
            "[[object]]\nname = 'wall'\ntechnique = '{technique}'\n\
             rectangle = {{ center = [0, 0, -2], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.2 }}\n"
        )
    };
    let render = "[render]\ntechnique = 'surfels'\n";
    assert!(!passes(render).contains(&"shade".into()));
    assert!(!passes(&(wall("surfels") + render)).contains(&"shade".into()));
    assert!(passes(&(wall("points") + render)).contains(&"shade".into()));
    assert!(passes(&format!("{render}surfels = {{ shading = 'discs' }}\n")).contains(&"shade".into()));
    let one_pass = format!("{}{render}surfels = {{ opaque = 'one_pass' }}\n", wall("surfels"));
    assert!(passes(&one_pass).contains(&"group".into()));
}

#[test]
fn who_knows_no_bumps_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[material.rough]\nbump = { height = 0.05, size = 0.3 }\n".to_owned()
        + &ball("material = 'rough'\n").replace("version = 1\n", "");
    std::fs::write(folder.path().join("s.toml"), "version = 1\n".to_owned() + &text).unwrap();
    let said = |arguments: &[&str]| {
        let mut command = organza();
        command.args(["render", "s.toml", "-o", "a.exr", "--force"]).args(arguments).current_dir(&folder);
        let out = command.output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stderr).unwrap()
    };
    assert!(
        said(&["--technique", "points"]).contains("object 'ball' has bumps, which `points` leaves out: use `surfels`")
    );
    let by_discs = said(&["--technique", "surfels", "--set", "render.surfels.shading='discs'"]);
    assert!(by_discs.contains("leaves out: set render.surfels.shading = \"pixels\""), "{by_discs}");
    assert_eq!(said(&["--technique", "surfels"]), "");
}

#[test]
fn keys_of_opaque_surfaces_and_bumps_are_checked() {
    let refused = |text: &str, expected: &str| {
        let error = parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap_err();
        let said = error.to_string() + error.hint();
        assert!(said.contains(expected), "{said}");
    };
    let keys = |keys: &str| ball(&format!("[render.surfels]\n{keys}\n"));
    refused(&keys("voronoi = false"), "`voronoi` belongs to opaque = \"one_pass\"");
    refused(&keys("groups = 4"), "or opaque = \"one_pass\"");
    refused(&keys("opaque = 'three_pass'"), "three_pass");
    refused(&keys("shading = 'vertices'"), "vertices");
    let bump = |bump: &str| ball(&format!("[material.rough]\nbump = {{ {bump} }}\n"));
    refused(&bump("height = -1, size = 1"), "`height`: expected a number");
    refused(&bump("height = 1, size = 0"), "`size`: expected a number above 0");
    refused(&bump("height = 1, size = 1, octaves = 13"), "`octaves`: expected a whole number from 1 to 12");
    refused(&bump("height = 1"), "size");
    refused(
        &bump("height = 1, size = 1, image = 'a.png', seed = 3"),
        "`seed` belongs to noise, and an `image` is named",
    );
    refused(&bump("height = 1, size = 1, octaves = 2, image = 'a.png'"), "`octaves` belongs to noise");
    refused(&bump("height = 1, size = 1, image = '../../a.png'"), "lies outside the scene's root folder");
    refused(&bump("height = 1, size = 1, image = 3"), "expected a text in quotes, found the number 3");
}

/// A ramp from black to white over 2.4 units, 0.48 high, tilts a wall by a fifth, and turns with it; grey as the file stores it is height.
#[test]
fn an_image_has_the_heights_of_bumps() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let ramp = image::ImageBuffer::from_fn(64, 8, |x, _| image::Luma([(1024 * x) as u16]));
    ramp.save(folder.path().join("ramp.png")).unwrap();
    write("mesh.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n");
    write("broken.png", b"\x89PNG\r\n\x1a\nnothing");
    let wall = |image: &str, more: &str| {
        format!(
            "{}[material.rough]\nbump = {{ height = 0.48, size = 2.4, image = '{image}' }}\n\
             [[object]]\nname = 'wall'\nmaterial = 'rough'\n{more}\
             rectangle = {{ center = [0, 0, 0], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }}\n\
             [render]\ntechnique = 'surfels'\nlayers = ['normal']\n",
            parallel_view(2.4, 96)
        )
    };
    for (more, [x, y]) in [("", [-0.2, 0.0]), ("transform = { rotate = [0, 0, 90] }\n", [0.0, -0.2])] {
        let picture = draw_in(folder.path(), &wall("ramp.png", more), &[]);
        let [across, up, ahead] = ["X", "Y", "Z"].map(|c| picture.channel(&format!("N.{c}")));
        for (found, expected) in [(&across, x), (&up, y), (&ahead, 1.0)] {
            // Away from the place where the ramp begins again.
            let (columns, rows) = if x == 0.0 { (4..92, 52..90) } else { (52..90, 4..92) };
            let exact = expected / 1.04f64.sqrt();
            let off = window(found, 96, columns, rows).iter().map(|v| (v - exact).abs()).fold(0.0, f64::max);
            assert!(off < 1e-4, "{more}: {off:e} off {exact}");
        }
    }
    for (image, code, words) in [
        ("none.png", 4, "none.png"),
        ("mesh.ply", 3, "mesh.ply: expected an image of radiance"),
        ("broken.png", 3, "broken.png: expected a complete PNG image"),
    ] {
        write("s.toml", wall(image, "").as_bytes());
        let out = organza().args(["render", "s.toml", "-o", "out.exr"]).current_dir(&folder).output().unwrap();
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(code) && said.contains(words), "{said}");
    }
}
