//! Several techniques in one picture, and the exact one.

use crate::view::FOG;
use organza_tests::{Place, SMALL_SCENE, draw, organza, parallel_view, window};

/// Fog, a pane of glass across it and a slab behind or around it, each by a technique of its own.
fn three(order: [usize; 3], apart: f64) -> String {
    let at = |k: usize| (order[k] as f64 - 1.0) * apart;
    format!(
        "{}[[object]]\nname = 'fog'\ntechnique = 'points'\n\
         medium_box = {{ min = [-2, -2, {:?}], max = [2, 2, {:?}], extinction = 0.8, spacing = 0.1 }}\n\
         [[object]]\nname = 'glass'\ntechnique = 'particles'\nopacity = 0.4\n\
         rectangle = {{ center = [0, 0, {:?}], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }}\n\
         [[object]]\nname = 'slab'\ntechnique = 'reference'\n\
         medium_box = {{ min = [-2, -2, {:?}], max = [2, 2, {:?}], extinction = 0.5, spacing = 0.2 }}\n\
         [render]\nantialias = 1\ndepth_ranges = 6\nparticles = {{ repeat_level = 100 }}\n",
        parallel_view(2.0, 32),
        at(0) - 0.5,
        at(0) + 0.5,
        at(1),
        at(2) - 0.5,
        at(2) + 0.5,
    )
}

#[test]
fn fog_by_points_glass_by_particles_and_a_slab_by_reference_multiply() {
    let exact = (-0.8f64).exp() * (1.0 - 0.4) * (-0.5f64).exp();
    // Transmittance of the glass is that of 100 sets; the rest of the picture has no noise.
    let error = (-0.8f64).exp() * (-0.5f64).exp() * (0.4 * 0.6 / 100f64).sqrt();
    for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2], [1, 1, 1]] {
        for apart in [2.0, 0.3] {
            let picture = draw(&three(order, apart), &[]);
            let seen = window(&picture.opacity(), 32, 8..24, 8..24);
            let off: Vec<f64> = seen.iter().map(|alpha| (1.0 - alpha - exact) / error).collect();
            // 256 pixels: one of 370 is beyond three standard errors. The rest of the picture is off by at most 0.05 of one.
            let beyond = off.iter().filter(|z| z.abs() > 3.0).count();
            assert!(beyond <= 5, "{order:?}, {apart}: {beyond} of {} pixels", off.len());
            assert!(off.iter().all(|z| z.abs() < 5.0), "{order:?}, {apart}");
            let mean = off.iter().sum::<f64>() / off.len() as f64;
            assert!(mean.abs() < 4.0 / (off.len() as f64).sqrt() + 0.05, "{order:?}, {apart}: mean {mean}");
        }
    }
}

/// A red medium before, or behind, a green one that gives light of its own.
fn two_lights(first: &str, second: &str) -> String {
    let slab = |name: &str, technique: &str, z: f64| {
        format!(
            "[[object]]\nname = '{name}'\nmaterial = '{name}'\ntechnique = '{technique}'\n\
             medium_box = {{ min = [-2, -2, {:?}], max = [2, 2, {:?}], extinction = 2.0, spacing = 0.1 }}\n\
             [material.{name}]\nmedium = {{ extinction = 2, albedo = 0 }}\n",
            z - 0.25,
            z + 0.25
        )
    };
    format!(
        "{}{}emission = [1, 0, 0]\n{}emission = [0, 1, 0]\n[render]\nparticles = {{ repeat_level = 200 }}\n",
        parallel_view(2.0, 24),
        slab("near", first, 0.5),
        slab("far", second, -0.5)
    )
}

#[test]
fn what_lies_in_front_hides_what_lies_behind_whoever_draws_it() {
    let same = draw(&two_lights("points", "points"), &[]);
    let mean = |picture: &organza_tests::Picture, channel: &str| {
        let seen = window(&picture.channel(channel), 24, 6..18, 6..18);
        seen.iter().sum::<f64>() / seen.len() as f64
    };
    let expected = ["R", "G"].map(|c| mean(&same, c));
    assert!(expected[0] > 2.0 * expected[1] && expected[1] > 0.1, "{expected:?}");
    for (first, second, most) in [
        ("reference", "points", 2e-4),
        ("points", "reference", 2e-4),
        ("reference", "reference", 2e-4),
        ("sheets", "points", 2e-4),
        ("points", "sheets", 2e-4),
        ("sheets", "sheets", 2e-4),
        // 144 pixels of 4 samples of 200 sets: three standard errors of at most ½ / √115,200.
        ("points", "particles", 4.5e-3),
        ("particles", "points", 4.5e-3),
    ] {
        let picture = draw(&two_lights(first, second), &[]);
        for (channel, expected) in ["R", "G"].iter().zip(expected) {
            let found = mean(&picture, channel);
            assert!((found - expected).abs() < most, "{first} before {second}, {channel}: {found} for {expected}");
        }
    }
}

/// What the command says of a scene that it refuses.
fn refusal(scene: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, scene).unwrap();
    let out = organza().arg("render").arg(&file).arg("-o").arg(folder.path().join("a.exr")).output().unwrap();
    assert_eq!(out.status.code(), Some(3));
    String::from_utf8(out.stderr).unwrap()
}

#[test]
fn a_technique_that_is_not_there_is_refused_where_it_is_named() {
    let text = three([0, 1, 2], 1.0);
    let refused = refusal(&text.replace("'particles'", "'splats'"));
    assert!(refused.contains("found \"splats\""), "{refused}");
    let refused =
        refusal(&text.replace("antialias = 1", "antialias = 1\ntechnique = 'particles'\nlayers = ['std_error']"));
    assert!(refused.contains("a picture by several techniques has no layer `std_error`"), "{refused}");
}

#[test]
fn a_picture_of_one_pixel_is_drawn_by_every_technique() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    for technique in ["points", "particles", "sheets", "surfels", "reference"] {
        let arguments = ["render", "s.toml", "-o", "one.png", "--size", "1x1", "--technique", technique, "--force"];
        // A medium is no surface.
        let visible = format!("object.fog.visible={}", technique != "surfels");
        let more = ["--set", "render.antialias=1", "--set", &visible, "--repeat-level", "4"];
        place.expect(0, &[&arguments[..], &more].concat(), "");
        assert_eq!(place.pixels("one.png").width(), 1);
    }
}
