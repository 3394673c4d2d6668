//! Triangles in slabs across the view: what slabs across half vectors show of them, where light comes through shadow maps, and the memory of their lists.

use organza_tests::{Picture, Place, draw, organza, parallel_view};

/// Haze, two panes that cross in it and reach beyond, an opaque wall across them, a floor.
const SCENE: &str = "[[light]]\nkind = 'directional'\ndirection = [-0.4, -1, -0.6]\nirradiance = [2, 1.9, 1.8]\n\
     [ambient]\ncolor = [0.1, 0.1, 0.12]\n\
     [material.glass]\nopacity = 0.4\nextinction_rgb = [0.5, 1, 1]\ntransmission = 0.5\n\
     [[object]]\nname = 'haze'\nmedium_box = { min = [-0.7, -0.7, -0.5], max = [0.7, 0.7, 0.5], extinction = 0.8, spacing = 0.05 }\n\
     [[object]]\nname = 'one'\nmaterial = 'glass'\nrectangle = { center = [0, 0, 0], u = [0.9, 0, 0.3], v = [0, 0.9, 0], spacing = 0.04 }\n\
     [[object]]\nname = 'other'\nmaterial = 'glass'\ncolor = [0.3, 0.6, 1]\nrectangle = { center = [0, 0, 0], u = [0.9, 0, -0.3], v = [0, 0.8, 0.1], spacing = 0.04 }\n\
     [[object]]\nname = 'wall'\ncolor = [1, 0.6, 0.3]\nrectangle = { center = [0.35, 0.3, -0.1], u = [0.4, 0.1, 0.1], v = [-0.1, 0.4, 0], spacing = 0.02 }\n\
     [[object]]\nname = 'floor'\nrectangle = { center = [0, -0.9, 0], u = [1.1, 0, 0], v = [0, 0.2, -1], spacing = 0.03 }\n\
     [render]\ntechnique = 'sheets'\nlayers = ['effects', 'depth', 'object']\nantialias = 1\n";

fn in_slabs(scene: &str, slicing: &str, more: &[&str]) -> Picture {
    let set = format!("render.sheets.slicing='{slicing}'");
    draw(scene, &[&["--set", &set], more].concat())
}

#[test]
fn both_slicings_have_the_same_edges_opacities_and_depths_and_nearly_the_same_light() {
    let scene = parallel_view(2.4, 72) + SCENE;
    let [view, half] = ["view", "half_vector"].map(|slicing| in_slabs(&scene, slicing, &[]));
    let a = view.opacity();
    let b = half.opacity();
    let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-5, "A: {worst:e}");
    let apart = view.channel("object.id").iter().zip(half.channel("object.id")).filter(|(a, b)| **a != *b).count();
    assert_eq!(apart, 0, "pixels of another object");
    // Of a triangle the depth is its own; of the haze, which the middle shows first, it is that of a part of a slab.
    let objects = view.channel("object.id");
    let a = view.channel("depth.first.Z");
    let b = half.channel("depth.first.Z");
    let haze = objects[36 * 72 + 36];
    for (k, object) in objects.iter().enumerate().filter(|(k, _)| a[*k] != b[*k]) {
        let off = (a[k] - b[k]).abs();
        let most = if *object == haze { 0.01 } else { 1e-5 };
        assert!(off < most, "pixel {k} of object {object}: {} and {}", a[k], b[k]);
    }
    assert!(objects.iter().filter(|object| **object != haze).count() > 2000);
    // An edge is a triangle's: one pixel sees it, the next does not.
    let alone = [
        "--set",
        "object.haze.visible=false",
        "--set",
        "object.one.visible=false",
        "--set",
        "object.other.visible=false",
    ];
    let alpha = in_slabs(&scene, "view", &alone).opacity();
    assert!(alpha.iter().all(|a| *a == 0.0 || *a == 1.0) && alpha.contains(&1.0));
    for channel in ["R", "G", "B", "direct.R"] {
        let a = view.channel(channel);
        let b = half.channel(channel);
        let square = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
        println!("{channel}: RMSE {:.5}", square.sqrt());
        assert!(square.sqrt() < 0.01, "{channel}: RMSE {}", square.sqrt());
    }
}

#[test]
fn effects_sum_to_beauty_other_techniques_lie_among_them_and_threads_change_no_bit() {
    let scene = parallel_view(2.4, 48) + SCENE;
    let mixed = ["--set", "object.haze.technique='points'", "--set", "object.one.technique='points'"];
    for more in [&[][..], &mixed] {
        let drawn = |threads: &str| in_slabs(&scene, "view", &[&["--threads", threads], more].concat());
        let picture = drawn("1");
        for channel in ["R", "G", "B"] {
            let mut sum = vec![0.0; 48 * 48];
            for effect in ["background", "ambient", "emission", "direct", "scatter1"] {
                sum.iter_mut().zip(picture.channel(&format!("{effect}.{channel}"))).for_each(|(sum, v)| *sum += v);
            }
            let beauty = picture.channel(channel);
            let apart = beauty.iter().zip(&sum).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-5, "{channel}: {apart:e}");
        }
        for channel in ["R", "A", "depth.first.Z"] {
            assert_eq!(drawn("3").channel(channel), picture.channel(channel), "{channel}");
        }
    }
    // Who draws haze and pane changes little, for both lie where they did.
    let [sheets, points] = [&[][..], &mixed].map(|more| in_slabs(&scene, "view", more).opacity());
    let square = sheets.iter().zip(&points).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / sheets.len() as f64;
    assert!(square.sqrt() < 0.03, "RMSE {}", square.sqrt());
}

#[test]
fn lists_of_triangles_are_counted_before_and_refused() {
    let pane = |k: i32| {
        format!(
            "[[object]]\nname = 'pane {k}'\nopacity = 0.1\n\
             rectangle = {{ center = [0, 0, {:?}], u = [2, 0, 0.1], v = [0, 2, 0], spacing = 0.5 }}\n",
            f64::from(k) * 0.02
        )
    };
    let light = "[[light]]\nkind = 'directional'\ndirection = [-0.4, -1, -0.6]\nirradiance = [2, 1.9, 1.8]\n";
    let scene = |panes: i32| {
        parallel_view(2.0, 64) + light + "[render]\ntechnique = 'sheets'\n" + &(0..panes).map(pane).collect::<String>()
    };
    let place = Place::new(&scene(40));
    place.write("one.toml", scene(1));
    for slicing in ["view", "half_vector"] {
        let set = format!("render.sheets.slicing='{slicing}'");
        let explained = |file: &str, more: &[&str]| {
            let mut command = organza();
            command.current_dir(place.folder()).args(["explain", file, "--json", "--set", &set]).args(more);
            command.output().unwrap()
        };
        let bytes = |file: &str| {
            let said: serde_json::Value = serde_json::from_slice(&explained(file, &[]).stdout).unwrap();
            said["memory_bytes"].as_u64().unwrap()
        };
        // Samples of 2x2 in each of 64x64 pixels, 39 panes more.
        let more = bytes("s.toml") - bytes("one.toml");
        assert!(more > 39 * 4 * 64 * 64 * 84, "{slicing}: {more}");
        let out = explained("s.toml", &["--size", "4000x4000"]);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(5), "{slicing}: {said}");
        assert!(said.contains("rendering") && said.contains("--max-memory"), "{slicing}: {said}");
    }
}
