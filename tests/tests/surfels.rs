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
            let alpha = by_surfels(&scene, &["--set", set]).channel("A");
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
        let alpha = by_surfels(&scene, &[]).channel("A");
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
        let (a, b) = (points.channel(channel), surfels.channel(channel));
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
        let alpha = draw_in(folder.path(), &scene, &["--technique", t]).channel("A");
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
