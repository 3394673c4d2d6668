//! Attributes of single points through the whole command: ellipses, balls, shadow coefficients, opacities and extinctions by a column, masses.
//! Each changes the picture as a closed form says.

use organza_tests::{draw_in, largest_difference, mean_and_ripple, organza, parallel_view, window};
use splat_core::Footprint;
use std::fmt::Write as _;
use std::path::Path;

fn write(folder: &Path, text: &str) {
    std::fs::write(folder.join("p.xyz"), text).unwrap();
}

fn scene(height: f64, keys: &str) -> String {
    format!("{}[[object]]\nname = 'p'\npoints = 'p.xyz'\n{keys}\n", parallel_view(height, 48))
}

/// Points of a plane that lie `across` apart along x and `along` apart along y, each with these further numbers.
fn plane(head: &str, [across, along]: [f64; 2], further: impl Fn(f64, f64) -> String) -> String {
    let count = |step: f64| (2.0 / step).ceil() as i32;
    let mut text = format!("x y z {head}\n");
    for (i, j) in (-count(across)..count(across)).flat_map(|i| (-count(along)..count(along)).map(move |j| (i, j))) {
        let x = across * (f64::from(i) + 0.5);
        let y = along * (f64::from(j) + 0.5);
        writeln!(text, "{x:?} {y:?} 0 {}", further(x, y)).unwrap();
    }
    text
}

#[test]
fn a_disc_with_a_tangent_has_the_opacity_of_its_ellipse_in_every_pixel() {
    let folder = tempfile::tempdir().unwrap();
    // Semi-axes of the core, by a tangent at 30 degrees.
    let [long, short, turn] = [0.5f64, 0.2, 30f64.to_radians()];
    let (sin, cos) = turn.sin_cos();
    write(
        folder.path(),
        &format!("x y z nx ny nz tx ty tz radius\n0 0 0 0 0 1 {:?} {:?} 0 {short}\n", long * cos, long * sin),
    );
    let keys = "opacity = 0.2\n[render]\nantialias = 1\n[render.points]\nresampling_filter = false\ntransmittance_cutoff = 0.0\n";
    let footprint = Footprint::default();
    let core = f64::from(Footprint::CORE);
    // A point alone stands for a unit of area.
    let most = -0.8f64.ln() * footprint.norm() / (long * short / (core * core));
    let expected: Vec<f64> = (0..48 * 48)
        .map(|k| {
            let at = |i: i32| (f64::from(i) + 0.5) / 48.0 * 3.0 - 1.5;
            let x = at(k % 48);
            let y = -at(k / 48);
            let u = x * cos + y * sin;
            let v = y * cos - x * sin;
            let square = (u * core / long).powi(2) + (v * core / short).powi(2);
            -(-most * footprint.profile(square)).exp_m1()
        })
        .collect();
    for technique in ["points", "reference", "sheets"] {
        let alpha = draw_in(folder.path(), &scene(3.0, keys), &["--technique", technique]).opacity();
        let off = largest_difference(&alpha, &expected);
        assert!(off < 2e-5, "{technique}: {off:e}");
    }
    // By surfels and by particles it is as long and as narrow: second moments of what is covered, in its own axes.
    for technique in ["surfels", "particles"] {
        let more = ["--technique", technique, "--set", "render.particles.repeat_level=400"];
        let alpha = draw_in(folder.path(), &scene(3.0, keys), &more).opacity();
        let moments = |alpha: &[f64]| {
            let mut total = 0.0;
            let mut sums = [0.0; 3];
            for (k, a) in alpha.iter().enumerate() {
                let at = |i: usize| (i as f64 + 0.5) / 48.0 * 3.0 - 1.5;
                let x = at(k % 48);
                let y = -at(k / 48);
                let u = x * cos + y * sin;
                let v = y * cos - x * sin;
                total += a;
                [u * u, v * v, u * v].iter().zip(&mut sums).for_each(|(m, sum)| *sum += a * m);
            }
            sums.map(|sum| sum / total)
        };
        let [u, v, mixed] = moments(&alpha);
        let [of_u, of_v, _] = moments(&expected);
        let ratio = (u / v).sqrt() / (of_u / of_v).sqrt();
        assert!((ratio - 1.0).abs() < 0.08 && mixed.abs() < 0.05 * u, "{technique}: {ratio}, {mixed}");
    }
}

#[test]
fn ellipses_of_cells_keep_lines_of_a_scan_sharp_and_their_plane_even() {
    let folder = tempfile::tempdir().unwrap();
    let colored = |x: f64, _: f64| if x < 0.0 { "0 0 0" } else { "255 255 255" }.to_owned();
    let text = plane("red green blue", [0.04, 0.12], colored);
    write(folder.path(), &text);
    let keys = "opacity = 0.6\nunlit = true\ndiscs = 'elliptical'";
    let elliptical = draw_in(folder.path(), &scene(1.0, keys), &[]);
    let (mean, ripple) = mean_and_ripple(&window(&elliptical.opacity(), 48, 8..40, 8..40));
    assert!((mean - 0.6).abs() < 1e-3 && ripple < 2e-3, "{mean}, {ripple:e}");
    // Of a thin plane the colour in a pixel is the mean of those of points by their kernels, 0.8 steps wide along and across.
    let thin = |keys: &str| {
        let more = format!(
            "opacity = 0.01\nunlit = true\n{keys}[render]\nantialias = 1\npoints = {{ resampling_filter = false }}\n"
        );
        let picture = draw_in(folder.path(), &scene(1.0, &more), &[]);
        let row = |channel: &str| window(&picture.channel(channel), 48, 0..48, 24..25);
        row("R").iter().zip(row("A")).map(|(r, a)| r / a).collect::<Vec<f64>>()
    };
    let places: Vec<[f64; 2]> = text
        .lines()
        .skip(1)
        .map(|line| {
            let mut words = line.split(' ').map(|word| word.parse().unwrap_or(0.0));
            [words.next().unwrap(), words.next().unwrap()]
        })
        .collect();
    let footprint = Footprint::default();
    let expected: Vec<f64> = (0..48)
        .map(|k| {
            let x = (f64::from(k) + 0.5) / 48.0 - 0.5;
            let y = -0.5 / 48.0;
            let weight = |p: &[f64; 2]| {
                footprint.profile(((p[0] - x) / (2.4 * 0.04)).powi(2) + ((p[1] - y) / (2.4 * 0.12)).powi(2))
            };
            let white: f64 = places.iter().filter(|p| p[0] > 0.0).map(weight).sum();
            white / places.iter().map(weight).sum::<f64>()
        })
        .collect();
    let off = |keys: &str| largest_difference(&thin(keys), &expected);
    assert!(off("discs = 'elliptical'\n") < 0.01, "{}", off("discs = 'elliptical'\n"));
    assert!(off("") > 0.1, "round discs blur: {}", off(""));
}

#[test]
fn a_shadow_coefficient_is_the_share_of_the_shadow_that_its_point_receives() {
    let folder = tempfile::tempdir().unwrap();
    let light = "[ambient]\ncolor = [0, 0, 0]\n[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n\
        [[object]]\nname = 'pane'\nrectangle = { center = [0, 0, 9], u = [3, 0, 0], v = [0, 3, 0], spacing = 0.1 }\nopacity = 0.75\n";
    for (form, keys) in [("surface", ""), ("medium", "as = 'medium'\nextinction = 40\n")] {
        let red = |share: Option<f64>, technique: &str| {
            let head = if share.is_some() { "shadow_coefficient" } else { "" };
            write(folder.path(), &plane(head, [0.1, 0.1], |_, _| share.map_or_else(String::new, |s| s.to_string())));
            let picture = draw_in(folder.path(), &(scene(1.0, keys) + light), &["--technique", technique]);
            mean_and_ripple(&window(&picture.channel("R"), 48, 12..36, 12..36)).0
        };
        for technique in ["points", "reference", "sheets", "surfels"] {
            if form == "medium" && technique != "points" {
                continue;
            }
            let [none, half, all, plain] = [Some(0.0), Some(0.5), Some(1.0), None].map(|s| red(s, technique));
            assert!(
                (half - 0.5 * (none + all)).abs() < 1e-4 * none && all == plain,
                "{form} {technique}: {none} {half} {all}"
            );
            // The surface receives what the pane lets through; matter shadows itself too.
            let expected = if form == "surface" { 0.25 * none } else { all };
            assert!((all - expected).abs() < 2e-3 && all < 0.3 * none, "{form} {technique}: {all} of {none}");
        }
    }
    // Particles have one for all of an object: as good as the key, and no two.
    let share = |of: fn(f64) -> f64| plane("shadow_coefficient", [0.1, 0.1], |x, _| of(x).to_string());
    let particles = ["--technique", "particles", "--set", "render.particles.repeat_level=4"];
    let text = scene(1.0, "opacity = 0.5") + light;
    write(folder.path(), &share(|_| 0.5));
    let by_column = draw_in(folder.path(), &text, &particles);
    write(folder.path(), &plane("", [0.1, 0.1], |_, _| String::new()));
    let by_key = draw_in(folder.path(), &(scene(1.0, "opacity = 0.5\nshadow_coefficient = 0.5") + light), &particles);
    assert_eq!(by_column, by_key);
    write(folder.path(), &share(|x| if x < 0.0 { 0.0 } else { 1.0 }));
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    let out = organza()
        .args(["render", "s.toml", "-o", "a.exr", "--technique", "particles"])
        .current_dir(&folder)
        .output()
        .unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(
        out.status.code() == Some(3) && said.contains("object 'p'") && said.contains("shadow_coefficient is"),
        "{said}"
    );
}

#[test]
fn a_transfer_function_makes_points_opaque_and_thick_by_a_column() {
    let folder = tempfile::tempdir().unwrap();
    let heat = |x: f64, _: f64| if x < 0.0 { "10" } else { "30" }.to_owned();
    write(folder.path(), &plane("heat", [0.05, 0.05], heat));
    let transfer = |factors: [f64; 2], key: &str| {
        format!(
            "color_by = {{ column = 'heat' }}\ntransfer = [{{ value = 0, color = [1, 1, 1], {key} = {} }}, {{ value = 40, color = [1, 1, 1], {key} = {} }}]\n",
            factors[0], factors[1]
        )
    };
    let halves = |keys: &str, technique: &str| {
        let alpha = draw_in(folder.path(), &scene(2.0, keys), &["--technique", technique]).opacity();
        [4..18, 30..44].map(|columns| mean_and_ripple(&window(&alpha, 48, columns, 8..40)).0)
    };
    for technique in ["points", "reference", "sheets", "surfels"] {
        // 0.1 and 0.5 are what is between at 10 and 30; half of that with the object's own.
        let [left, right] = halves(&transfer([0.0, 0.8], "opacity"), technique);
        assert!((left - 0.2).abs() < 1e-3 && (right - 0.6).abs() < 1e-3, "{technique}: {left} {right}");
        let [left, right] = halves(&(transfer([0.0, 0.8], "opacity") + "opacity = 0.5\n"), technique);
        assert!((left - 0.1).abs() < 1e-3 && (right - 0.3).abs() < 1e-3, "{technique}: {left} {right}");
    }
    // A slab of matter, five layers 0.05 apart: τ = σ·0.25.
    let slab: String = plane("heat", [0.05, 0.05], heat)
        .lines()
        .enumerate()
        .flat_map(|(n, line)| {
            let words: Vec<&str> = line.split(' ').collect();
            let layers: Vec<String> = if n == 0 {
                vec![line.to_owned()]
            } else {
                (-2..=2).map(|k| format!("{} {} {:?} {}", words[0], words[1], 0.05 * f64::from(k), words[3])).collect()
            };
            layers.into_iter().map(|line| line + "\n")
        })
        .collect();
    write(folder.path(), &slab);
    for technique in ["points", "reference", "sheets"] {
        let [left, right] = halves(&("as = 'medium'\n".to_owned() + &transfer([0.0, 8.0], "extinction")), technique);
        let [thin, thick] = [2.0, 6.0].map(|sigma: f64| -(-0.25 * sigma).exp_m1());
        assert!((left - thin).abs() < 2e-3 && (right - thick).abs() < 2e-3, "{technique}: {left} {right}");
    }
    // Opacities over a length, as those of a volume: that at 40 is −ln(1 − 0.75)/0.5.
    let over = "as = 'medium'\nunit_length = 0.5\n".to_owned() + &transfer([0.0, 0.75], "opacity");
    let [left, _] = halves(&over, "points");
    assert!((left + (-0.25 * 0.25 * -0.25f64.ln() / 0.5).exp_m1()).abs() < 2e-3, "{left}");
}

#[test]
fn masses_of_a_simulation_absorb_alike_however_dense_they_lie() {
    let folder = tempfile::tempdir().unwrap();
    let depth = |size: f64, mass: &str| {
        let mut text = format!("x y z {}\n", if mass.is_empty() { "" } else { "mass" });
        for n in 0..512 {
            let at = |k: i32| (f64::from(n / 8i32.pow(k as u32) % 8) - 3.5) / 8.0 * size;
            writeln!(text, "{:?} {:?} {:?} {mass}", at(0), at(1), at(2)).unwrap();
        }
        write(folder.path(), &text);
        let picture = draw_in(folder.path(), &scene(2.0, "as = 'medium'\nextinction = 0.5"), &[]);
        picture.opacity().iter().map(|a| -(1.0 - a).ln()).sum::<f64>() * (2.0f64 / 48.0).powi(2)
    };
    // Σ τ·(area of a pixel) = κ·Σ m, however much room they have.
    for size in [0.5, 1.0, 1.4] {
        let found = depth(size, "0.0003");
        assert!((found / (0.5 * 512.0 * 0.0003) - 1.0).abs() < 2e-3, "{size}: {found}");
    }
    let volumes = [0.5, 1.0].map(|size| depth(size, ""));
    assert!((volumes[1] / volumes[0] - 8.0).abs() < 0.1, "{volumes:?}");
}

/// Radiance along the middle ray through 27 Gaussian kernels of this deviation, seen from a light at infinity, for an albedo of 1, an isotropic
/// phase function and an irradiance of 4π, where shadow maps have the matter of a kernel within half a spacing of its centre: by the light that
/// falls on each place of the medium.
fn puff(extinction: f64, step: f64, deviation: f64) -> f64 {
    let places: Vec<[f64; 3]> = (0..27)
        .map(|n| [2, 1, 0].map(|k| f64::from(n / 3i32.pow(k) % 3 - 1) * step))
        .map(|[z, y, x]| [x, y, z])
        .collect();
    let depth = |p: &[f64; 3], x: f64, y: f64| {
        let square = ((p[0] - x).powi(2) + (p[1] - y).powi(2)) / (deviation * deviation);
        extinction * step.powi(3) / (std::f64::consts::TAU * deviation * deviation) * (-0.5 * square).exp()
    };
    // A kernel's deviation is 0.8 spacings.
    let half = 0.5 * deviation / 0.8;
    let lit = |x: f64, y: f64, z: f64| {
        let before = |p: &[f64; 3]| ((p[2] - z + half) / (2.0 * half)).clamp(0.0, 1.0);
        (-places.iter().map(|p| depth(p, x, y) * before(p)).sum::<f64>()).exp()
    };
    let mut through = 1.0f64;
    let mut by_place = 0.0;
    let count = 2000;
    let ends = 1.2;
    for z in (0..count).map(|k| ends - (f64::from(k) + 0.5) * 2.0 * ends / f64::from(count)) {
        let share =
            |p: &[f64; 3]| (-0.5 * ((p[2] - z) / deviation).powi(2)).exp() / (deviation * std::f64::consts::TAU.sqrt());
        let tau = places.iter().map(|p| depth(p, 0.0, 0.0) * share(p)).sum::<f64>() * 2.0 * ends / f64::from(count);
        by_place += through * -(-tau).exp_m1() * lit(0.0, 0.0, z);
        through *= (-tau).exp();
    }
    by_place
}

/// Kernels of an optical depth of half to one, which shadow maps take for narrower than they are: single scattering is (1 − e^−2τ)/2 in truth.
#[test]
fn light_falls_on_particles_where_they_are_and_within_thick_splats() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "x y z radius mass\n".to_owned();
    for n in 0..27 {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(n / 3i32.pow(k) % 3 - 1) * 0.2);
        writeln!(text, "{x:?} {y:?} {z:?} 0.6 0.008").unwrap();
    }
    write(folder.path(), &text);
    let light = 4.0 * std::f64::consts::PI;
    for extinction in [5.0, 10.0] {
        let keys = format!(
            "as = 'medium'\nextinction = {extinction}\n[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [{light}, {light}, {light}]\n"
        );
        let middle = |technique: &str| {
            let more = ["--technique", technique, "--set", "render.particles.repeat_level=100"];
            let red = draw_in(folder.path(), &scene(1.0, &keys), &more).channel("R");
            mean_and_ripple(&window(&red, 48, 22..26, 22..26)).0
        };
        let by_place = puff(extinction, 0.2, 0.2);
        let [points, reference, particles] = ["points", "reference", "particles"].map(middle);
        assert!((particles / by_place - 1.0).abs() < 0.1, "{extinction}: {particles}, {by_place}");
        // Single scattering in truth; by the centres of kernels it was 0.53 and 0.45, and less the thicker they are.
        assert!((points - 0.5).abs() < 0.1, "{extinction}: {points}");
        assert!((reference / points - 1.0).abs() < 1e-3, "{reference} {points}");
    }
}

#[test]
fn a_point_that_is_a_ball_looks_alike_from_all_sides_and_is_as_large_as_its_radius() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "x y z radius\n0 0 0 0.6\n");
    let light =
        "[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [3.14159265, 3.14159265, 3.14159265]\n";
    for rotate in ["[0, 0, 0]", "[40, 20, 0]", "[90, 0, 70]"] {
        let keys = format!("discs = 'balls'\ntransform = {{ rotate = {rotate} }}\n{light}");
        let picture = draw_in(folder.path(), &scene(2.0, &keys), &[]);
        // Its outline has the area of a circle, and light that falls from the eye shows the cosine to its normal: 2/3 in the mean.
        let pixel = (2.0f64 / 48.0).powi(2);
        let area: f64 = picture.opacity().iter().sum::<f64>() * pixel;
        let circle = std::f64::consts::PI * 0.36;
        assert!((area / circle - 1.0).abs() < 0.03, "{rotate}: {area} of {circle}");
        let brightness = picture.channel("R").iter().sum::<f64>() * pixel / area;
        assert!((brightness / (2.0 / 3.0) - 1.0).abs() < 0.03, "{rotate}: {brightness}");
    }
}
