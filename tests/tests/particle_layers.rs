//! Layers and coloured extinction of the technique `particles`: closed forms within stated statistics, sums, bits.

use crate::many_forms::write;
use organza_tests::{Picture, draw_in, largest_difference, organza, parallel_view, sum_of_effects, window};
use std::path::Path;

const SIZE: u32 = 32;
/// |z| of a mean that chance exceeds once in 10⁴.
const LIMIT: f64 = 3.9;

/// A view of parallel rays with one sample a pixel, so that pixels are independent.
fn view(head: &str) -> String {
    parallel_view(1.0, SIZE) + head + "[render]\nantialias = 1\ntechnique = 'particles'\n"
}

fn particles(folder: &Path, text: &str, levels: u32, layers: &str) -> Picture {
    draw_in(folder, text, &["--repeat-level", &levels.to_string(), "--layers", layers])
}

/// The middle of a channel.
fn middle(picture: &Picture, channel: &str) -> Vec<f64> {
    window(&picture.channel(channel), SIZE, 6..26, 6..26)
}

/// [`agree_within`] without any bias.
fn agree(found: &[f64], expected: [f64; 2], what: &str) {
    agree_within(found, expected, 0.0, what);
}

/// Value and standard error of one pixel against what is found in many: no bias of the mean beyond so many standard errors
/// of a pixel, no wrong spread.
fn agree_within(found: &[f64], [expected, error]: [f64; 2], bias: f64, what: &str) {
    let n = found.len() as f64;
    if expected == f64::INFINITY {
        return assert!(found.iter().all(|v| *v == f64::INFINITY), "{what}: {found:?}");
    }
    if error == 0.0 {
        return assert!(found.iter().all(|v| (v - expected).abs() < 1e-4), "{what}: {expected}, {found:?}");
    }
    let mean = found.iter().sum::<f64>() / n;
    let z = (mean - expected) / (error / n.sqrt());
    let square = found.iter().map(|v| ((v - expected) / error).powi(2)).sum::<f64>() / n;
    assert!(z.abs() < LIMIT + bias * n.sqrt(), "{what}: mean {mean}, expected {expected} ± {error}: z {z:.2}");
    assert!((0.6..1.5).contains(&square), "{what}: mean z² {square:.2}");
}

/// Sources of a plane z = 0 that fills the view.
const PLANES: [&str; 4] = [
    "rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }",
    "mesh = 'quad.ply'\nspacing = 0.025",
    "points = 'lattice.ply'",
    "implicit = { expression = 'z', box = [[-1, -1, -0.2], [1, 1, 0.21]], spacing = 0.025 }",
];

fn planes() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, c, d] = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let at = |i: i32| -1.0 + 0.025 * (f64::from(i) + 0.5);
    let lattice: Vec<_> = (0..80 * 80).map(|k| [[at(k % 80), at(k / 80), 0.0]; 3]).collect();
    std::fs::write(folder.path().join("quad.ply"), write::mesh(&[[a, b, c], [a, c, d]])).unwrap();
    std::fs::write(folder.path().join("lattice.ply"), write::points(&lattice)).unwrap();
    folder
}

fn plane(source: &str, name: &str, z: f64, opacity: f64, more: &str) -> String {
    format!(
        "[[object]]\nname = '{name}'\ntransform = {{ up = 'y', translate = [0, 0, {z:?}] }}\nfootprint = 2\n\
         opacity = {opacity}\n{more}{source}\n"
    )
}

const WALL: &str = "[[object]]\nname = 'wall'\n\
                    rectangle = { center = [0, 0, -2], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }\n";

#[test]
fn what_no_particle_hits_has_the_depth_and_the_object_of_the_wall() {
    let folder = planes();
    let half = "rectangle = { center = [-1, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }";
    let text = view("") + &plane(half, "half", 0.5, 0.7, "") + WALL;
    let picture = particles(folder.path(), &text, 64, "depth,object");
    let first = picture.channel("depth.first.Z");
    let object = picture.channel("object.id");
    let expected = |k: usize| if k % 32 < 16 { (4.5, 0.0) } else { (7.0, 1.0) };
    assert!((0..first.len()).all(|k| (first[k] - expected(k).0).abs() < 1e-4 && object[k] == expected(k).1));
    let points = draw_in(folder.path(), &text, &["--technique", "points", "--layers", "object"]);
    let differ = points.channel("object.id").iter().zip(&object).filter(|(a, b)| a != b).count();
    // Splats reach over the border by their radius and the filter's.
    assert!(differ <= 5 * 32, "{differ} pixels");
    // Nothing at all has neither; without particles it is the wall's.
    let nothing = particles(folder.path(), &view(""), 4, "depth,object");
    assert!(nothing.channel("depth.mean.Z").iter().all(|d| *d == f64::INFINITY));
    assert!(nothing.channel("object.id").iter().all(|o| *o == f64::from(u32::MAX as f32)));
    let wall = particles(folder.path(), &(view("") + WALL), 4, "depth,object");
    assert!(middle(&wall, "depth.median.Z").iter().all(|d| (d - 7.0).abs() < 1e-4));
    assert!(middle(&wall, "object.id").iter().all(|o| *o == 0.0));
}

/// A material that absorbs red most and blue least, and glows.
const COLORED: &str = "[material.c]\nshading = 'phase'\nextinction_rgb = [2, 1, 0.25]\nemission = [0.2, 0.6, 0.4]\n";
const BACK: [f64; 3] = [0.9, 0.7, 0.5];
const GLOW: [f64; 3] = [0.2, 0.6, 0.4];

#[test]
fn transmission_is_that_of_each_channel_whatever_absorbs() {
    const LEVELS: u32 = 400;
    let folder = planes();
    let cells: Vec<f32> = (0..40 * 40 * 40).map(|k| f32::from(u8::from((15..25).contains(&(k / 1600))))).collect();
    std::fs::write(folder.path().join("grid.nii"), write::nifti(&cells, 0.05)).unwrap();
    let bounds = "box = [[-1, -1, -0.25], [1, 1, 0.25]]";
    // Optical depth 1 in green.
    let media = [
        "medium_box = { min = [-1, -1, -0.25], max = [1, 1, 0.25], extinction = 2.0, spacing = 0.05 }".to_owned(),
        format!("density = {{ expression = '1', {bounds}, spacing = 0.05, extinction = 2.0 }}"),
        "volume = 'grid.nii'\ntransform = { up = 'y' }\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, \
         { value = 1, color = [1, 1, 1], extinction = 2.0 }]"
            .to_owned(),
    ];
    let head = format!("[background]\ncolor = {BACK:?}\n{COLORED}");
    let opacity = -(-1f64).exp_m1();
    let of_media = media.iter().map(|m| format!("[[object]]\nname = 'it'\nmaterial = 'c'\n{m}\n"));
    let of_planes = PLANES.iter().map(|p| plane(p, "it", 0.0, opacity, "material = 'c'\n"));
    for object in of_media.chain(of_planes) {
        let picture = particles(folder.path(), &(view(&head) + &object), LEVELS, "effects,std_error");
        let mut alpha = 0.0;
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let t = (-[2.0f64, 1.0, 0.25][c]).exp();
            let spread = (t * (1.0 - t) / f64::from(LEVELS)).sqrt();
            let seen = middle(&picture, name);
            let expected = [BACK[c] * t + GLOW[c] * (1.0 - t), (BACK[c] - GLOW[c]).abs() * spread];
            agree(&seen, expected, &format!("{name}, {object}"));
            agree(&middle(&picture, &format!("background.{name}")), [BACK[c] * t, BACK[c] * spread], &object);
            alpha += (1.0 - t) / 3.0;
            assert!(largest_difference(&sum_of_effects(&picture, name), &picture.channel(name)) < 1e-5, "{object}");
        }
        let found = middle(&picture, "opacity.A");
        assert!((found.iter().sum::<f64>() / found.len() as f64 - alpha).abs() < 0.004, "{object}");
        // The picture's own estimate of the error of its luminance.
        let weights = [0.2126, 0.7152, 0.0722];
        let channels = ["R", "G", "B"].map(|c| middle(&picture, c));
        let error = middle(&picture, "std_error.A");
        let mean: Vec<f64> = channels.iter().map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
        let square = |k: usize| {
            let off: f64 = (0..3).map(|c| weights[c] * (channels[c][k] - mean[c])).sum();
            (off / error[k]).powi(2)
        };
        let mean_square = (0..error.len()).map(square).sum::<f64>() / error.len() as f64;
        assert!((0.75..1.3).contains(&mean_square), "{object}: mean z² of the luminance {mean_square}");
    }
}

/// A blue-absorbing fog in front of a red-absorbing plane that a light casts through, before a wall.
fn fog_and_plane(back: &str) -> String {
    view(
        "[background]\ncolor = [0.9, 0.7, 0.5]\n[ambient]\ncolor = [0.1, 0.1, 0.1]\n\
         [material.fog]\nshading = 'phase'\nextinction_rgb = [0.25, 0.5, 1]\n\
         [material.glass]\ncolor = [0.9, 0.6, 0.3]\nextinction_rgb = [1, 0.5, 0]\n\
         [[light]]\nkind = 'directional'\ndirection = [0.3, -0.4, -1]\nirradiance = [2, 2, 2]\n",
    ) + "[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
         medium_box = { min = [-1, -1, 0.1], max = [1, 1, 0.6], extinction = 2.0, spacing = 0.04 }\n\
         [[object]]\nname = 'plane'\nmaterial = 'glass'\nopacity = 0.5\n\
         rectangle = { center = [0, 0, -0.2], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }\n"
        + back
}

#[test]
fn x7_only_the_planes_that_are_asked_for_take_memory() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |text: &str, layers: &str| {
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        let mut command = organza();
        command.args(["render", "s.toml", "-o", "s.exr", "--force", "--cost", "c.json", "--repeat-level", "4"]);
        let out = command.args(["--layers", layers]).current_dir(&folder).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let cost: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("c.json")).unwrap()).unwrap();
        let stage = cost.as_array().unwrap().iter().find(|s| s["name"] == "particles").unwrap();
        stage["bytes"].as_u64().unwrap() / (64 * 64)
    };
    let grey = fog_and_plane("").replace("extinction_rgb", "# ");
    let grey_bytes = |layers: &str| bytes(&grey, layers);
    assert_eq!([grey_bytes("alpha"), grey_bytes("std_error"), grey_bytes("effects")], [36, 36, 108]);
    assert_eq!(
        [grey_bytes("depth"), grey_bytes("object"), grey_bytes("depth.first,object")],
        [36 + 184, 36 + 8, 36 + 192]
    );
    assert_eq!(bytes(&fog_and_plane(""), "alpha"), 36 + 48);
    // Unequal numbers that are equal are none.
    assert_eq!(bytes(&grey.replace("[material.fog]", "[material.fog]\nextinction_rgb = [2, 2, 2]"), "alpha"), 36);
}

#[test]
fn the_memory_that_explain_states_counts_sums_and_batches() {
    let folder = tempfile::tempdir().unwrap();
    let stated = |text: &str, layers: &str, more: &[&str]| -> Result<u64, String> {
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        let mut command = organza();
        let set = format!("render.layers=[{layers}]");
        command.args(["explain", "s.toml", "--json", "--set", &set]).args(more).current_dir(&folder);
        let out = command.output().unwrap();
        if !out.status.success() {
            return Err(String::from_utf8_lossy(&out.stderr).into_owned());
        }
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        Ok(json["memory_bytes"].as_u64().unwrap())
    };
    let text = fog_and_plane("").replace("extinction_rgb", "# ").replace("[32, 32]", "[2048, 2048]");
    let pixels = 2048 * 2048;
    let plain = stated(&text, "", &[]).unwrap();
    let points = stated(&text.replace("'particles'", "'points'"), "", &[]).unwrap();
    assert!(plain > points + 36 * pixels + (128 << 20), "{plain} and {points}");
    let depths = stated(&text, "'depth'", &[]).unwrap();
    assert!(depths > plain + 184 * pixels, "{depths} and {plain}");
    let colored = stated(&fog_and_plane("").replace("[32, 32]", "[2048, 2048]"), "", &[]).unwrap();
    assert!(colored >= plain + 48 * pixels, "{colored} and {plain}");
    // What is stated is what is refused.
    let refused = stated(&text, "'depth'", &["--max-memory", "1G"]).unwrap_err();
    assert!(refused.contains("bytes"), "{refused}");
}

#[test]
fn frames_of_kept_sets_have_layers_and_the_same_bits_for_any_threads() {
    let folder = tempfile::tempdir().unwrap();
    let plane = "implicit = { expression = 'z', box = [[-1, -1, -0.2], [1, 1, 0.21]], spacing = 0.025 }";
    let text = view(COLORED)
        + &self::plane(plane, "it", 0.0, 0.6, "material = 'c'\n")
        + "[animation]\nframes = 2\n[[animation.track]]\nset = 'object.it.transform.translate'\n\
           keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 1, value = [0, 0, 0.5] }]\n";
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    let run = |name: &str, threads: &str| {
        let mut command = organza();
        command.args(["render", "s.toml", "-o", &format!("{name}.exr"), "--frames", "--threads", threads]);
        let out = command.args(["--layers", "depth,object,effects"]).current_dir(&folder).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        [0, 1].map(|k| std::fs::read(folder.path().join(format!("{name}.000{k}.exr"))).unwrap())
    };
    let one = run("a", "1");
    let three = run("b", "3");
    assert!(one == three && one[0] != one[1]);
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn depths_of_a_slab_are_its_closed_form_within_their_errors_whatever_it_is_made_of() {
        const LEVELS: u32 = 1500;
        let folder = tempfile::tempdir().unwrap();
        let cells: Vec<f32> = (0..40 * 40 * 40).map(|k| f32::from(u8::from((15..25).contains(&(k / 1600))))).collect();
        std::fs::write(folder.path().join("grid.nii"), write::nifti(&cells, 0.05)).unwrap();
        let bounds = "box = [[-1, -1, -0.25], [1, 1, 0.25]]";
        for tau in [0.1f64, 1.0, 4.0] {
            let sigma = tau / 0.5;
            let sharp = |z: f64| if (4.75..5.25).contains(&z) { sigma } else { 0.0 };
            // Between the lattice points inside and outside, extinction is linear.
            let ramp = |z: f64| sigma * ((0.25 - (z - 5.0).abs()) / 0.05 + 0.5).clamp(0.0, 1.0);
            let objects: [(String, &dyn Fn(f64) -> f64); 3] = [
                (
                    format!(
                        "medium_box = {{ min = [-1, -1, -0.25], max = [1, 1, 0.25], extinction = {sigma:?}, spacing = 0.05 }}"
                    ),
                    &sharp,
                ),
                (format!("density = {{ expression = '1', {bounds}, spacing = 0.05, extinction = {sigma:?} }}"), &sharp),
                (
                    format!(
                        "volume = 'grid.nii'\ntransform = {{ up = 'y' }}\ntransfer = [{{ value = 0, color = [1, 1, 1], \
                         extinction = 0 }}, {{ value = 1, color = [1, 1, 1], extinction = {sigma:?} }}]"
                    ),
                    &ramp,
                ),
            ];
            for (object, extinction) in objects {
                let text = view("") + "[[object]]\nname = 'slab'\n" + &object + "\n";
                let picture = particles(folder.path(), &text, LEVELS, "depth");
                let expected = depths_of(4.7, 5.3, LEVELS, extinction);
                // The median of few blocks of 176 sets lies a little behind that of many.
                let first = f64::from(LEVELS / 176).sqrt().recip();
                for ((name, expected), bias) in
                    ["first", "median", "mean", "sigma"].into_iter().zip(expected).zip([first, 0.0, 0.0, 0.0])
                {
                    let what = format!("τ {tau}, depth.{name}, {object}");
                    agree_within(&middle(&picture, &format!("depth.{name}.Z")), expected, bias, &what);
                }
            }
        }
    }

    /// The four depths of a medium whose extinction along a ray is given, each with the standard error of `levels` sets.
    fn depths_of(from: f64, to: f64, levels: u32, extinction: &dyn Fn(f64) -> f64) -> [[f64; 2]; 4] {
        const STEPS: usize = 200_000;
        let step = (to - from) / STEPS as f64;
        let sets = f64::from(levels);
        let mut tau = 0.0f64;
        let mut moments = [0.0; 5];
        let mut found = [[f64::INFINITY, 0.0]; 4];
        for i in 0..STEPS {
            let z = from + step * (i as f64 + 0.5);
            let before = -(-tau).exp_m1();
            let sigma = extinction(z);
            tau += sigma * step;
            let after = -(-tau).exp_m1();
            let density = sigma * (-tau).exp();
            if before < 1.0 / 255.0 && after >= 1.0 / 255.0 {
                found[0] = [z, (0.69 * sets / 255.0).sqrt().recip() / 255.0 / density];
            }
            if before < 0.5 && after >= 0.5 {
                found[1] = [z, 0.5 / sets.sqrt() / density];
            }
            (0..5).for_each(|k| moments[k] += (after - before) * (z - from).powi(k as i32));
        }
        let m = moments.map(|m| m / moments[0]);
        let mean = m[1];
        let variance = m[2] - m[1] * m[1];
        let n = moments[0] * sets;
        let fourth = m[4] - 4.0 * m[3] * mean + 6.0 * m[2] * mean * mean - 3.0 * mean.powi(4);
        found[2] = [from + mean, (variance / n).sqrt()];
        found[3] = [variance.sqrt(), ((fourth - variance * variance) / (4.0 * variance * n)).sqrt()];
        found
    }

    #[test]
    fn coloured_media_and_surfaces_differ_from_points_by_their_noise() {
        let folder = tempfile::tempdir().unwrap();
        for back in ["", WALL] {
            let text = fog_and_plane(back);
            let points = draw_in(folder.path(), &text, &["--technique", "points", "--set", "render.antialias=2"]);
            let picture = particles(folder.path(), &text, 1500, "std_error");
            let error = middle(&picture, "std_error.A");
            assert!(error.iter().all(|e| *e > 1e-4), "noise everywhere");
            for (c, weight) in [("R", 0.2126), ("G", 0.7152), ("B", 0.0722)] {
                let found = middle(&picture, c);
                let exact = middle(&points, c);
                let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
                let a = mean(&found);
                let b = mean(&exact);
                let spread = found.iter().map(|v| (v - a).powi(2)).sum::<f64>() / (found.len() as f64).powi(2);
                // Splats are lit by their centres and blur the fog's shadow: 0.5 % beside the noise.
                let allowed = LIMIT * spread.sqrt() + 0.005 * b;
                assert!((a - b).abs() < allowed, "{c} (weight {weight}): {a} and {b}, allowed {allowed}");
            }
        }
    }

    #[test]
    fn depths_and_objects_of_two_layers_are_theirs_whatever_they_are_made_of() {
        const LEVELS: u32 = 900;
        let folder = planes();
        for source in PLANES {
            for (a, b, wall) in [(0.3, 0.6, false), (0.6, 0.3, false), (0.1, 0.2, true)] {
                let mut text = view("") + &plane(source, "near", 0.5, a, "") + &plane(source, "far", -0.5, b, "");
                if wall {
                    text += WALL;
                }
                let picture = particles(folder.path(), &text, LEVELS, "depth,object");
                let weights = [a, (1.0 - a) * b, if wall { (1.0 - a) * (1.0 - b) } else { 0.0 }];
                let total: f64 = weights.iter().sum();
                let at = [4.5, 5.5, 7.0];
                let moment = |p: i32, around: f64| {
                    weights.iter().zip(at).map(|(w, z)| w / total * (z - around).powi(p)).sum::<f64>()
                };
                let mean = moment(1, 0.0);
                let variance = moment(2, mean);
                let fourth = moment(4, mean);
                let n = total * f64::from(LEVELS);
                let median = if wall {
                    7.0
                } else if a > 0.5 {
                    4.5
                } else {
                    5.5
                };
                let expected = [
                    [4.5, 0.0],
                    [median, 0.0],
                    [mean, (variance / n).sqrt()],
                    [variance.sqrt(), ((fourth - variance * variance) / (4.0 * variance * n)).sqrt()],
                ];
                for (name, expected) in ["first", "median", "mean", "sigma"].into_iter().zip(expected) {
                    let what = format!("{source}, {a}, {b}, wall {wall}, depth.{name}");
                    agree(&middle(&picture, &format!("depth.{name}.Z")), expected, &what);
                }
                // The nearest of all sets.
                assert!(middle(&picture, "object.id").iter().all(|o| *o == 0.0), "{source}, {a}, {b}");
            }
        }
    }

    #[test]
    fn x1_layers_and_coloured_particles_have_the_same_bits_for_any_threads_and_after_a_stop() {
        let folder = tempfile::tempdir().unwrap();
        let layers = "effects,shadow,normal,depth,object,std_error";
        for text in [fog_and_plane(WALL), fog_and_plane(WALL).replace("extinction_rgb", "# ")] {
            let run = |levels: &str, threads: &str, more: &[&str]| {
                let arguments = ["--repeat-level", levels, "--threads", threads, "--layers", layers];
                draw_in(folder.path(), &text, &[&arguments[..], more].concat())
            };
            let whole = run("150", "1", &[]);
            assert!(run("150", "3", &[]) == whole);
            let file = folder.path().join("sums");
            let checkpoint = ["--checkpoint", file.to_str().unwrap()];
            run("70", "2", &checkpoint);
            assert!(run("150", "2", &checkpoint) == whole);
            std::fs::remove_file(&file).unwrap();
            let early = run("4000", "2", &["--target-error", "0.004"]);
            assert!(early != whole && early.channel("depth.median.Z").iter().any(|d| d.is_finite()));
        }
    }
}
