//! Layers mean what they say: effects sum to beauty, and depth is one thing for every primitive.

use crate::many_forms::write;
use organza_tests::{
    EFFECTS, Picture, draw, draw_in, largest_difference, mean_and_ripple, parallel_view, sum_of_effects, window,
};
use splat_core::glam::DVec3;

/// A cloud that glows and scatters before a surface that reflects and one that is opaque, under a light and an ambient one, with
/// a background beside them.
const EVERY_EFFECT: &str = "[background]\ncolor = [0.2, 0.3, 0.4]\n[ambient]\ncolor = [0.1, 0.2, 0.3]\n\
     [material.cloud]\nmedium = { extinction = 2.0, asymmetry = 0.4 }\nemission = [0.05, 0.1, 0.15]\n\
     [material.sheet]\ncolor = [0.9, 0.5, 0.2]\nspecular = 0.2\n\
     [[light]]\nkind = 'directional'\ndirection = [0.3, -0.4, -1]\nirradiance = [2, 1.5, 1]\n\
     [[object]]\nname = 'cloud'\nmaterial = 'cloud'\n\
     medium_box = { min = [-0.8, -0.8, 0.2], max = [0.3, 0.8, 0.7], extinction = 2.0, spacing = 0.06 }\n\
     [[object]]\nname = 'sheet'\nmaterial = 'sheet'\nopacity = 0.5\n\
     rectangle = { center = [0.2, 0, 0], u = [0.6, 0, 0.1], v = [0, 0.6, 0], spacing = 0.04 }\n\
     [[object]]\nname = 'wall'\nmaterial = 'sheet'\n\
     rectangle = { center = [0, 0.5, -1], u = [0.8, 0, 0], v = [0, 0.4, 0], spacing = 0.04 }\n";

/// Arguments of each technique.
const TECHNIQUES: [&[&str]; 2] =
    [&["--technique", "points"], &["--technique", "particles", "--repeat-level", "20", "--seed", "3"]];

#[test]
fn effects_sum_to_the_beauty_of_a_picture_without_them() {
    let text = parallel_view(2.0, 40) + EVERY_EFFECT;
    for technique in TECHNIQUES {
        let plain = draw(&text, technique);
        assert_eq!(plain.names(), ["A", "B", "G", "R", "opacity.A"]);
        let apart = draw(&text, &[technique, &["--layers", "effects"]].concat());
        for c in ["R", "G", "B"] {
            let largest = largest_difference(&sum_of_effects(&apart, c), &plain.channel(c));
            assert!(largest < 1e-5, "{technique:?}, {c}: {largest:e}");
            for effect in EFFECTS {
                let part = apart.channel(&format!("{effect}.{c}"));
                let most = part.iter().copied().fold(0.0, f64::max);
                assert!(most > 0.01, "{technique:?}: {effect}.{c} is at most {most:e}, the sum says nothing of it");
            }
        }
    }
}

#[test]
fn what_surfaces_reflect_is_direct_and_what_media_scatter_once_is_scatter1() {
    let (head, objects) = EVERY_EFFECT.split_at(EVERY_EFFECT.find("[[object]]").unwrap());
    let (cloud, surfaces) = objects.split_at(objects.find("[[object]]\nname = 'sheet'").unwrap());
    for technique in TECHNIQUES {
        for (what, object, filled, empty) in
            [("cloud", cloud, "scatter1", "direct"), ("surfaces", surfaces, "direct", "scatter1")]
        {
            let text = parallel_view(2.0, 24) + head + object;
            let picture = draw(&text, &[technique, &["--layers", "effects"]].concat());
            let most = |effect: &str| picture.channel(&format!("{effect}.G")).iter().copied().fold(0.0, f64::max);
            assert!(most(filled) > 0.01, "{technique:?}, {what}: {filled} is at most {}", most(filled));
            assert_eq!(most(empty), 0.0, "{technique:?}, {what}: {empty}");
        }
    }
}

/// First, median, mean and standard deviation of depth, means over the middle of a picture; no pixel is farther from
/// them than `ripple`.
fn depths(picture: &Picture, ripple: f64) -> [f64; 4] {
    ["first", "median", "mean", "sigma"].map(|name| {
        let values = window(&picture.channel(&format!("depth.{name}.Z")), 32, 8..24, 8..24);
        if values.iter().all(|v| *v == f64::INFINITY) {
            return f64::INFINITY;
        }
        let (mean, largest) = mean_and_ripple(&values);
        assert!(largest <= ripple, "{name}: {mean} ± {largest:e}");
        mean
    })
}

fn agree(found: [f64; 4], expected: [f64; 4], what: &str) {
    for ((f, e), name) in found.into_iter().zip(expected).zip(["first", "median", "mean", "sigma"]) {
        assert!((f - e).abs() < 1e-4 || f == e, "{what}, depth.{name}: {f}, expected {e}");
    }
}

/// Depths of absorption in a homogeneous slab of optical depth `tau` from `z` on, `length` thick.
fn slab(z: f64, length: f64, tau: f64) -> [f64; 4] {
    let at = |level: f64| if level <= tau { z + length * level / tau } else { f64::INFINITY };
    let mean = 1.0 / tau - 1.0 / tau.exp_m1();
    let variance = 1.0 / (tau * tau) - tau.exp() / (tau.exp_m1() * tau.exp_m1());
    [at(-(-1.0f64 / 255.0).ln_1p()), at(2f64.ln()), z + length * mean, length * variance.sqrt()]
}

#[test]
fn depths_of_a_slab_are_its_closed_form_whatever_it_is_made_of() {
    for tau in [0.1, 1.0, 4.0] {
        let extinction = tau / 0.5;
        let bounds = "box = [[-1, -1, -0.25], [1, 1, 0.25]]";
        let folder = tempfile::tempdir().unwrap();
        let cells: Vec<f32> = (0..40 * 40 * 40).map(|k| f32::from(u8::from((15..25).contains(&(k / 1600))))).collect();
        std::fs::write(folder.path().join("grid.nii"), write::nifti(&cells, 0.05)).unwrap();
        for object in [
            format!(
                "medium_box = {{ min = [-1, -1, -0.25], max = [1, 1, 0.25], extinction = {extinction:?}, spacing = 0.05 }}"
            ),
            format!("density = {{ expression = '1', {bounds}, spacing = 0.05, extinction = {extinction:?} }}"),
            format!(
                "volume = 'grid.nii'\ntransform = {{ up = 'y' }}\ntransfer = [{{ value = 0, color = [1, 1, 1], extinction = 0 }}, \
                 {{ value = 1, color = [1, 1, 1], extinction = {extinction:?} }}]"
            ),
        ] {
            let text = parallel_view(1.0, 32) + "[[object]]\nname = 'slab'\nfootprint = 2\n" + &object + "\n";
            let picture = draw_in(folder.path(), &text, &["--layers", "depth"]);
            agree(depths(&picture, 1e-4), slab(4.75, 0.5, tau), &format!("τ {tau}, {object}"));
        }
    }
}

/// Two layers at depths 4.5 and 5.5 of opacities `a` and `b`, perhaps a wall at 7 behind.
fn two_layers(a: f64, b: f64, wall: bool) -> [f64; 4] {
    let weights = [a, (1.0 - a) * b, if wall { (1.0 - a) * (1.0 - b) } else { 0.0 }];
    let at = [4.5, 5.5, 7.0];
    let total: f64 = weights.iter().sum();
    let mean = weights.iter().zip(at).map(|(w, z)| w * z).sum::<f64>() / total;
    let variance = weights.iter().zip(at).map(|(w, z)| w * (z - mean).powi(2)).sum::<f64>() / total;
    let opaque = weights.iter().scan(0.0, |sum, w| {
        *sum += w;
        Some(*sum)
    });
    let median = opaque.zip(at).find(|(sum, _)| *sum >= 0.5).map_or(f64::INFINITY, |(_, z)| z);
    [4.5, median, mean, variance.sqrt()]
}

#[test]
fn depths_of_two_layers_are_theirs_whatever_they_are_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let quad = |z: f64| {
        let [a, b, c, d] = [[-1.0, -1.0, z], [1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z]];
        vec![[a, b, c], [a, c, d]]
    };
    let mut lattice = Vec::new();
    for k in 0..80 * 80 {
        let at = |i: i32| -1.0 + 0.025 * (f64::from(i) + 0.5);
        lattice.push([[at(k % 80), at(k / 80), 0.0]; 3]);
    }
    std::fs::write(folder.path().join("quad.ply"), write::mesh(&quad(0.0))).unwrap();
    std::fs::write(folder.path().join("lattice.ply"), write::points(&lattice)).unwrap();
    for source in [
        "rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }",
        "mesh = 'quad.ply'\nspacing = 0.025",
        "points = 'lattice.ply'",
        "implicit = { expression = 'z', box = [[-1, -1, -0.2], [1, 1, 0.21]], spacing = 0.025 }",
    ] {
        for (a, b, wall) in [(0.3, 0.6, false), (0.6, 0.3, false), (0.1, 0.2, true)] {
            let layer = |z: f64, opacity: f64| {
                format!(
                    "[[object]]\nname = 'at {z}'\ntransform = {{ up = 'y', translate = [0, 0, {z:?}] }}\nfootprint = 2\nopacity = {opacity}\n{source}\n"
                )
            };
            let mut text = parallel_view(1.0, 32) + &layer(0.5, a) + &layer(-0.5, b);
            if wall {
                text += "[[object]]\nname = 'wall'\n\
                         rectangle = { center = [0, 0, -2], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }\n";
            }
            let picture = draw_in(folder.path(), &text, &["--layers", "depth"]);
            let what = format!("{source}, {a}, {b}, wall {wall}");
            agree(depths(&picture, 1e-3), two_layers(a, b, wall), &what);
        }
    }
}

#[test]
fn nothing_has_no_depth() {
    let picture = draw(&parallel_view(1.0, 32), &["--layers", "depth"]);
    assert_eq!(depths(&picture, 0.0), [f64::INFINITY; 4]);
}

/// The layer of normals at a pixel.
fn normals(picture: &Picture) -> Vec<DVec3> {
    let [x, y, z] = ["N.X", "N.Y", "N.Z"].map(|name| window(&picture.channel(name), 32, 8..24, 8..24));
    (0..x.len()).map(|k| DVec3::new(x[k], y[k], z[k])).collect()
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn a_wall_s_normal_keeps_its_direction_behind_coloured_extinction() {
        // Optical depth 1 in green, 2 in red, ¼ in blue; a normal is no colour and takes green's weight as a whole.
        let head = parallel_view(1.0, 32) + "[material.red]\nextinction_rgb = [2, 1, 0.25]\n";
        let wall = "[[object]]\nname = 'wall'\n\
                    rectangle = { center = [0, 0, -1], u = [1.5, 0, 0.5], v = [0, 1.5, 0.3], spacing = 0.025 }\n";
        let slanted = DVec3::new(1.5, 0.0, 0.5).cross(DVec3::new(0.0, 1.5, 0.3)).normalize();
        let through = (-1f64).exp();
        let fog = "medium_box = { min = [-1, -1, -0.25], max = [1, 1, 0.25], extinction = 2.0, spacing = 0.05 }";
        let sheet = format!(
            "opacity = {:?}\nrectangle = {{ center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.025 }}",
            1.0 - through
        );
        for (front, own) in [(fog, DVec3::ZERO), (&sheet, DVec3::Z)] {
            let text = format!("{head}[[object]]\nname = 'front'\nmaterial = 'red'\nfootprint = 2\n{front}\n{wall}");
            for layers in ["normal", "normal,effects,shadow"] {
                let seen = normals(&draw(&text, &["--layers", layers]));
                let expected = own * (1.0 - through) + slanted * through;
                let off = seen.iter().map(|n| (*n - expected).length()).fold(0.0, f64::max);
                assert!(off < 1e-3, "points, {layers}, {front}: off by {off}, {} for {expected}", seen[0]);
                // Each particle picture has its own share of green, and nothing across the plane of both normals.
                let arguments = ["--technique", "particles", "--repeat-level", "400", "--layers", layers];
                let seen = normals(&draw(&text, &arguments));
                let across = own.cross(slanted);
                let across = if across == DVec3::ZERO { slanted.any_orthonormal_vector() } else { across.normalize() };
                let off = seen.iter().map(|n| n.dot(across).abs()).fold(0.0, f64::max);
                let mean = seen.iter().sum::<DVec3>() / seen.len() as f64;
                assert!(off < 1e-3, "particles, {layers}, {front}: across by {off}");
                // 256 pixels of four samples of 400 sets: five standard errors are 4·10⁻³.
                assert!((mean - expected).length() < 4e-3, "particles, {layers}, {front}: {mean} for {expected}");
            }
        }
    }
}
