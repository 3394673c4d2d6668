//! The technique `surfels` through the whole command: closed forms, and what it refuses.

use organza_tests::{Picture, draw, draw_in, organza, parallel_view, window};

fn by_surfels(scene: &str, arguments: &[&str]) -> Picture {
    draw(scene, &[&["--technique", "surfels"], arguments].concat())
}

/// Largest difference from a number, over pixels.
fn off(seen: &[f64], expected: f64) -> f64 {
    seen.iter().map(|v| (v - expected).abs()).fold(0.0, f64::max)
}

#[test]
fn panes_let_through_what_their_materials_do_in_every_pixel() {
    // Tilted by 45°, so that discs of one pane lie at many depths.
    for (panes, spacing) in [(1, 0.1), (2, 0.07), (5, 0.03)] {
        let mut scene = parallel_view(2.0, 32);
        for k in 0..panes {
            let z = f64::from(k) * 0.4 - 0.8;
            scene += &format!(
                "[[object]]\nname = 'pane {k}'\nopacity = 0.5\n\
                 rectangle = {{ center = [0, 0, {z:?}], u = [2, 0, 2], v = [0, 3, 0], spacing = {spacing:?} }}\n"
            );
        }
        scene += "[render.surfels]\ntransmittance_cutoff = 0\n";
        for set in ["render.surfels.gap=0.1", "render.surfels.gap=1", "render.surfels.disc_scale=0.45"] {
            let alpha = by_surfels(&scene, &["--set", set]).opacity();
            let through: Vec<f64> = window(&alpha, 32, 4..28, 4..28).iter().map(|a| 1.0 - a).collect();
            let exact = 0.5f64.powi(panes);
            assert!(off(&through, exact) < 1e-6, "{panes} panes, {set}: {:e}", off(&through, exact));
        }
    }
}

#[test]
fn panes_that_cross_or_coincide_are_two_layers() {
    for far in ["[0, 0, 0], u = [2, 0, -1]", "[0, 0, 0], u = [2, 0, 1]"] {
        let scene = format!(
            "{}[[object]]\nname = 'a'\nopacity = 0.5\n\
             rectangle = {{ center = [0, 0, 0], u = [2, 0, 1], v = [0, 3, 0], spacing = 0.1 }}\n\
             [[object]]\nname = 'b'\nopacity = 0.4\nrectangle = {{ center = {far}, v = [0, 3, 0], spacing = 0.1 }}\n",
            parallel_view(2.0, 32)
        );
        let alpha = by_surfels(&scene, &[]).opacity();
        let seen = window(&alpha, 32, 4..28, 4..28);
        assert!(off(&seen, 0.7) < 1e-6, "{far}: {:e}", off(&seen, 0.7));
    }
}

/// A translucent ball of raw points, fog within and around it, and an opaque wall behind.
fn ball_in_fog(surfels: &str, fog: &str) -> String {
    format!(
        "{}[ambient]\ncolor = [0.1, 0.1, 0.12]\n[background]\ncolor = [0.1, 0.2, 0.3]\n\
         [[light]]\nkind = 'directional'\ndirection = [-0.4, -1, -0.6]\nirradiance = [2, 1.9, 1.8]\n\
         [material.glass]\nopacity = 0.4\nextinction_rgb = [0.5, 1, 1]\n\
         [[object]]\nname = 'ball'\nmaterial = 'glass'\ntechnique = '{surfels}'\n\
         implicit = {{ expression = 'x^2 + y^2 + z^2 - 0.25', box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.04 }}\n\
         [[object]]\nname = 'fog'\ntechnique = '{fog}'\n\
         medium_box = {{ min = [-1, -1, -0.3], max = [1, 1, 0.3], spacing = 0.05, extinction = 0.8 }}\n\
         [[object]]\nname = 'wall'\nrectangle = {{ center = [0, 0, -0.9], u = [0.7, 0, 0], v = [0, 2, 0], spacing = 0.06 }}\n\
         [render]\nlayers = ['effects', 'shadow', 'depth']\n",
        parallel_view(2.0, 48)
    )
}

#[test]
fn effects_sum_to_beauty_beside_fog_and_threads_change_no_bit() {
    let scene = ball_in_fog("surfels", "points");
    let picture = draw(&scene, &["--threads", "1"]);
    for channel in ["R", "G", "B"] {
        let beauty = picture.channel(channel);
        let mut sum = vec![0.0; beauty.len()];
        for effect in ["background", "ambient", "emission", "direct", "scatter1"] {
            let layer = picture.channel(&format!("{effect}.{channel}"));
            sum.iter_mut().zip(layer).for_each(|(sum, v)| *sum += v);
        }
        let apart = beauty.iter().zip(&sum).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{channel}: {apart:e}");
    }
    for threads in ["2", "3", "7"] {
        let again = draw(&scene, &["--threads", threads]);
        for channel in ["R", "A", "direct.G", "shadow.A", "depth.first.Z"] {
            assert_eq!(again.channel(channel), picture.channel(channel), "{threads} threads, {channel}");
        }
    }
}

#[test]
fn a_ball_in_fog_looks_as_by_points() {
    let [points, surfels] = ["points", "surfels"].map(|t| draw(&ball_in_fog(t, "points"), &[]));
    for channel in ["R", "G", "B", "A", "direct.R"] {
        let a = points.channel(channel);
        let b = surfels.channel(channel);
        let square = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
        println!("{channel}: RMSE {:.5}", square.sqrt());
        assert!(square.sqrt() < 0.01, "{channel}: RMSE {}", square.sqrt());
    }
}

#[test]
fn a_scan_without_order_has_the_opacity_of_its_material() {
    let folder = tempfile::tempdir().unwrap();
    // A jittered square: places from the plastic number's sequence.
    let at = |i: u32, step: f64| (f64::from(i) * step).fract() * 2.4 - 1.2;
    let points: String = (0..4000u32)
        .map(|i| format!("{} {} {}\n", at(i, 0.754_877_666_246_692_8), at(i, 0.569_840_290_998_053_3), 0.0))
        .collect();
    std::fs::write(folder.path().join("scan.xyz"), points).unwrap();
    let scene = format!("{}[[object]]\nname = 'scan'\npoints = 'scan.xyz'\nopacity = 0.3\n", parallel_view(2.0, 48));
    let [by_points, surfels] = ["points", "surfels"].map(|t| {
        let alpha = draw_in(folder.path(), &scene, &["--technique", t]).opacity();
        let seen = window(&alpha, 48, 4..44, 4..44);
        (seen.iter().map(|a| (a - 0.3).powi(2)).sum::<f64>() / seen.len() as f64).sqrt()
    });
    println!("ripple: points {by_points:.5}, surfels {surfels:.2e}");
    assert!(surfels < by_points / 3.0 && surfels < 1e-6, "points {by_points}, surfels {surfels:e}");
}

#[test]
fn media_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ball_in_fog("surfels", "surfels");
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let out = organza().args(["render", "scene.toml", "-o", "a.exr"]).current_dir(&folder).output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(3), "{said}");
    assert!(said.contains("`fog` is a medium, and the technique `surfels` draws surfaces alone"), "{said}");
    assert!(said.contains("technique = \"sheets\""), "{said}");
    assert!(!folder.path().join("a.exr").exists());
}

/// A ball of clear glass before a background.
const GLASS_BALL: &str = "[background]\ncolor = [0.4, 0.5, 0.7]\n[material.glass]\nior = 1.5\n\
     [[object]]\nname = 'ball'\nmaterial = 'glass'\n\
     implicit = { expression = 'x^2 + y^2 + z^2 - 0.25', box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.04 }\n";

#[test]
fn clear_glass_before_one_color_is_not_seen_and_its_effects_are() {
    let scene = parallel_view(1.6, 40) + GLASS_BALL + "[render]\nlayers = ['effects']\n";
    for set in ["bending='traced'", "bending='power'", "bending='nearest'", "behind='straight'"] {
        let set = format!("render.surfels.{set}");
        for index in ["ior=1.5", "cauchy={ a = 1.4, b = 0.05 }"] {
            let index = format!("material.glass.{index}");
            let cleared = if index.contains("cauchy") { "material.glass.ior" } else { "material.glass.cauchy" };
            let scene = if cleared.ends_with("ior") { scene.replace("ior = 1.5\n", "") } else { scene.clone() };
            let picture = draw(&scene, &["--set", &set, "--set", &index]);
            for (channel, expected) in [("R", 0.4), ("G", 0.5), ("B", 0.7)] {
                assert!(off(&picture.channel(channel), expected) < 1e-6, "{set}, {index}, {channel}");
            }
            let [mirrored, bent] = ["reflection.G", "refraction.G"].map(|c| picture.channel(c).iter().sum::<f64>());
            assert!((0.05..0.35).contains(&(mirrored / bent)), "{set}, {index}: {mirrored} {bent}");
        }
    }
}

/// Rays leave the ball to all sides, where walls stand that no pixel sees; the eye lies in their midst.
#[test]
fn glass_shows_opaque_surfaces_that_lie_out_of_view() {
    let wall = |k: usize| {
        let axis = k % 3;
        let side = if k < 3 { 6 } else { -6 };
        let along = |a: usize, v: i32| {
            let mut vector = [0; 3];
            vector[a] = v;
            vector
        };
        let [center, u, v] = [along(axis, side), along((axis + 1) % 3, 6), along((axis + 2) % 3, 6)];
        format!(
            "[[object]]\nname = 'wall {k}'\nmaterial = 'grey'\n\
             rectangle = {{ center = {center:?}, u = {u:?}, v = {v:?}, spacing = 0.4 }}\n"
        )
    };
    let scene = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nfov_y = 20\nsize = [40, 40]\n[render]\nantialias = 1\n"
        .to_owned()
        + GLASS_BALL
        + "[material.grey]\nshading = 'unlit'\ncolor = [0.4, 0.5, 0.7]\n"
        + &(0..6).map(wall).collect::<String>();
    let picture = draw(&scene, &[]);
    for (channel, expected) in [("R", 0.4), ("G", 0.5), ("B", 0.7)] {
        let off = off(&picture.channel(channel), expected);
        assert!(off < 1e-6, "{channel}: {off:e}");
    }
}

#[test]
fn a_ball_of_glass_turns_what_is_behind_it_upside_down() {
    // Red above, blue below: seen through the ball the other way round.
    let walls = |y: f64, name: &str, color: &str| {
        format!(
            "[[object]]\nname = '{name}'\nmaterial = '{name}'\n\
             rectangle = {{ center = [0, {y:?}, -2], u = [3, 0, 0], v = [0, 2, 0], spacing = 0.05 }}\n\
             [material.{name}]\nshading = 'unlit'\ncolor = {color}\n"
        )
    };
    let scene = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nfov_y = 25\nsize = [60, 60]\n"
        .to_owned()
        + GLASS_BALL
        + &walls(2.0, "above", "[1, 0, 0]")
        + &walls(-2.0, "below", "[0, 0, 1]");
    let seen = |set: &[&str]| {
        let picture = draw(&scene, set);
        // Pixels above and below the middle, within the ball and beside it.
        [(30, 24), (30, 35), (3, 24), (3, 35)].map(|(x, y)| ["R", "B"].map(|c| picture.channel(c)[y * 60 + x]))
    };
    let [above, below, beside_above, beside_below] = seen(&[]);
    assert!(beside_above[0] > 0.9 && beside_below[1] > 0.9, "{beside_above:?} {beside_below:?}");
    assert!(above[1] > 0.8 && above[0] < 0.15, "{above:?}");
    assert!(below[0] > 0.8 && below[1] < 0.15, "{below:?}");
    let [above, below, ..] = seen(&["--set", "render.surfels.behind='straight'"]);
    assert!(above[0] > 0.8 && below[1] > 0.8, "{above:?} {below:?}");
}

#[test]
fn a_technique_that_does_not_bend_light_says_so_and_auto_takes_one_that_does() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), parallel_view(1.6, 24) + GLASS_BALL).unwrap();
    let drawn = |technique: &str| {
        let arguments = ["render", "scene.toml", "--technique", technique, "-o", "a.exr", "--force"];
        let out = organza().args(arguments).current_dir(&folder).output().unwrap();
        assert!(out.status.success());
        String::from_utf8(out.stderr).unwrap()
    };
    for technique in ["points", "particles", "sheets", "reference"] {
        let said = drawn(technique);
        assert!(said.contains(&format!("which `{technique}` leaves out: use `surfels`")), "{said}");
    }
    let said = drawn("auto");
    // Glass before an even background shows what is around it.
    assert!(said.contains("all of one colour") && !said.contains("leaves out") && !said.contains("no light"), "{said}");
    let out = organza().args(["explain", "scene.toml"]).current_dir(&folder).output().unwrap();
    let said = String::from_utf8(out.stdout).unwrap();
    assert!(said.contains("technique: surfels") && said.contains("its surfaces bound matter with an index"), "{said}");
}
