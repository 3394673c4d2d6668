//! Half-vector slicing of the technique `sheets` through the whole command: closed forms, what slabs across the view show of the same
//! scene, what is built for it, and what is refused.

use organza::{Progress, RenderOptions, scene};
use organza_judge::accuracy;
use organza_tests::{Picture, draw, largest_difference, organza, parallel_view, sum_of_effects, window};
use std::path::Path;

const HALF: [&str; 4] = ["--technique", "sheets", "--set", "render.sheets.slicing='half_vector'"];

fn in_half_vectors(scene: &str, arguments: &[&str]) -> Picture {
    draw(scene, &[&HALF, arguments].concat())
}

fn rmse(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

fn fog(tau: f64) -> String {
    format!(
        "[[object]]\nname = 'fog'\nmedium_box = {{ min = [-4, -4, -0.5], max = [4, 4, 0.5], extinction = {tau:?}, \
         spacing = 0.1 }}\n[render.sheets]\ntransmittance_cutoff = 0\n"
    )
}

fn sun(direction: &str) -> String {
    format!("[[light]]\nkind = 'directional'\ndirection = {direction}\nirradiance = [1, 1, 1]\n")
}

fn bright(direction: &str) -> String {
    sun(direction).replace("[1, 1, 1]", "[8, 7, 6]")
}

#[test]
fn fog_lit_along_the_view_from_before_and_behind_has_its_closed_forms() {
    for tau in [0.01f64, 1.0, 5.0] {
        for width in ["'auto'", "0.033", "3"] {
            let shown = |direction: &str| {
                let scene = parallel_view(2.0, 24) + &sun(direction) + &fog(tau);
                let picture = in_half_vectors(&scene, &["--set", &format!("render.sheets.slab_width={width}")]);
                let middle = |channel: &str| window(&picture.channel(channel), 24, 8..16, 8..16);
                (middle("R"), middle("A"))
            };
            // What comes in is scattered and goes out: ∫ e^(−2t)/4π dt; from behind all ways are as long as the slab.
            let isotropic = 0.25 / std::f64::consts::PI;
            let before = isotropic * 0.5 * -(-2.0 * tau).exp_m1();
            let behind = isotropic * tau * (-tau).exp();
            for (direction, expected) in [("[0, 0, -1]", before), ("[0, 0, 1]", behind)] {
                let (color, alpha) = shown(direction);
                let off = |seen: &[f64], expected: f64| seen.iter().map(|v| (v - expected).abs()).fold(0.0, f64::max);
                assert!(off(&alpha, -(-tau).exp_m1()) < 1e-5, "{tau}, {width}: alpha {alpha:?}");
                assert!(off(&color, expected) < 1e-6, "{tau}, {width}, {direction}: {color:?}, expected {expected}");
            }
        }
    }
}

/// Two volumes that overlap, and two walls, one of which shadows them.
const MIXED: &str = "[ambient]\ncolor = [0.1, 0.1, 0.12]\n\
     [material.smoke]\nmedium = { extinction = 1.5, albedo = 0.8, asymmetry = 0.3 }\n\
     [[object]]\nname = 'cloud'\nmaterial = 'smoke'\n\
     density = { expression = 'exp(-6*((x - 0.3)^2 + y^2 + z^2))', box = [[-0.8, -1, -1], [1.3, 1, 1]], spacing = 0.05, extinction = 4 }\n\
     [[object]]\nname = 'haze'\nmaterial = 'smoke'\n\
     medium_ball = { center = [-0.5, 0.2, 0.1], radius = 0.5, extinction = 1, spacing = 0.05 }\n\
     [[object]]\nname = 'wall'\nrectangle = { center = [0, -1, -0.4], u = [1.4, 0, 0], v = [0, 0.2, -0.9], spacing = 0.04 }\n\
     [[object]]\nname = 'blind'\nrectangle = { center = [0.3, 1.2, 0.2], u = [0.3, 0, 0], v = [0, 0, 0.3], spacing = 0.03 }\n\
     [render]\nlayers = ['effects', 'shadow']\n";

#[test]
fn threads_and_the_order_of_lights_change_no_bit() {
    let one = bright("[-0.4, -1, -0.6]");
    let other = bright("[0.3, -0.8, 0.7]");
    let scene = |lights: [&str; 2]| parallel_view(2.6, 40) + &lights.concat() + MIXED;
    let picture = in_half_vectors(&scene([&one, &other]), &["--threads", "1"]);
    let same = |with: &Picture| {
        for channel in ["R", "B", "A", "scatter1.G", "shadow.A"] {
            assert_eq!(with.channel(channel), picture.channel(channel), "{channel}");
        }
    };
    same(&in_half_vectors(&scene([&other, &one]), &[]));
    for threads in ["2", "3", "7"] {
        same(&in_half_vectors(&scene([&one, &other]), &["--threads", threads]));
    }
}

/// What `organza explain` writes.
fn explained(scene: &str, arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let mut command = organza();
    command.args(["explain", "scene.toml"]).args(HALF).args(arguments).current_dir(&folder);
    String::from_utf8(command.output().unwrap().stdout).unwrap()
}

#[test]
fn x7_no_map_of_volumes_is_built_that_nobody_else_receives() {
    let maps = |scene: &str, arguments: &[&str]| {
        let is_map = |line: &&str| line.starts_with("tsm build ") && line.contains(" light ");
        explained(scene, arguments).lines().filter(is_map).count()
    };
    let fog = parallel_view(2.0, 16) + &bright("[-0.4, -1, -0.6]") + &fog(1.0);
    assert_eq!(maps(&fog, &[]), 0);
    // Nor does it become splats.
    let of_fog = |arguments: &[&str]| {
        let said = explained(&fog, arguments);
        let counts = said.lines().rfind(|line| line.starts_with("fog ")).map(|line| line.split_whitespace().last());
        counts.flatten().map(str::to_owned)
    };
    assert_eq!(of_fog(&[]).as_deref(), Some("0"));
    assert_eq!(of_fog(&["--set", "render.sheets.slicing='view'"]).as_deref(), Some("64000"));
    assert_eq!(maps(&fog, &["--set", "render.sheets.slicing='view'"]), 1);
    // Walls stay triangles: they receive what slabs let through, and light ends at them.
    let walls = parallel_view(2.6, 16) + &bright("[-0.4, -1, -0.6]") + MIXED;
    assert_eq!(maps(&walls, &[]), 0);
    let said = explained(&walls, &[]);
    assert!(said.contains("opaque triangles end light and view rays where they are"), "{said}");
    assert!(said.lines().any(|line| line.starts_with("wall ") && line.trim_end().ends_with(" 0")), "{said}");
    // A ball that is no mesh receives the shadow of all, the volumes that of the ball.
    let ball = walls
        + "[[object]]\nname = 'ball'\nimplicit = { expression = 'x^2 + y^2 + z^2 - 0.04', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.05 }\n";
    assert_eq!(maps(&ball, &[]), 2);
    assert_eq!(maps(&ball, &["--set", "object.ball.casts_shadow=false"]), 1);
    assert_eq!(maps(&ball, &["--set", "object.ball.shadow_coefficient=0"]), 1);
}

#[test]
fn what_a_volume_does_not_cast_or_does_not_receive_is_left_out() {
    let scene = parallel_view(2.6, 48) + &bright("[-0.4, -1, -0.6]") + MIXED;
    for key in ["object.cloud.casts_shadow=false", "object.cloud.shadow_coefficient=0.3"] {
        let set = ["--set", key];
        let [view, half] = [draw(&scene, &[&HALF[..2], &set].concat()), in_half_vectors(&scene, &set)];
        let apart = rmse(&view.channel("scatter1.G"), &half.channel("scatter1.G"));
        let changed = rmse(&half.channel("scatter1.G"), &in_half_vectors(&scene, &[]).channel("scatter1.G"));
        assert!(apart < 0.01 && changed > 2.0 * apart, "{key}: {apart} of {changed}");
    }
}

#[test]
fn the_ground_beside_a_cloud_is_lit_by_it_without_a_step() {
    let scene = "version = 1\n[camera]\nposition = [0, 1.5, 6]\ntarget = [0, 0.5, 0]\nfov_y = 35\nsize = [240, 180]\n\
         [[light]]\nkind = 'directional'\ndirection = [-1, -1, -0.5]\nirradiance = [3, 3, 3]\n\
         [[object]]\nname = 'ground'\nrectangle = { center = [0, 0, 0], u = [3, 0, 0], v = [0, 0, -3], spacing = 0.03 }\ncolor = [0.5, 0.5, 0.5]\n\
         [[object]]\nname = 'fog'\nmaterial = 'fog'\nmedium_ball = { center = [0, 0.9, 0], radius = 0.8, extinction = 4, spacing = 0.05 }\n\
         [material.fog]\nmedium = { extinction = 4.0, albedo = 0.98, asymmetry = 0.3 }\n";
    let again = ["--set", "render.sheets.scattering='forward_and_back'", "--layers", "effects"];
    let more = in_half_vectors(scene, &again).channel("scatterN.G");
    // Ground alone, from the shadow of the ball to the near end.
    let at = |x: usize, y: usize| more[240 * y + x];
    for (x, y) in (124..150).flat_map(|y| (20..220).map(move |x| (x, y))) {
        let step = (at(x, y) - at(x + 1, y)).abs().max((at(x, y) - at(x, y + 1)).abs());
        assert!(at(x, y) > 1e-3 && step < 1.0 / 255.0, "{x}, {y}: {}, a step of {step}", at(x, y));
    }
    // 4·10⁶ photons through the ball, each weighed by its albedo, times the ground's colour over π.
    for (x, y, expected) in [(60, 124, 0.01042), (180, 124, 0.01700), (60, 140, 0.00631), (180, 140, 0.00734)] {
        assert!((at(x, y) / expected - 1.0).abs() < 0.12, "{x}, {y}: {}, not {expected}", at(x, y));
    }
}

/// Radiance along the normal of slabs lit along it with an irradiance of 1, by 60,000 paths: τ, albedo, asymmetry.
const PATHS: [(f64, f64, f64, f64); 3] =
    [(20.0, 0.5, 0.0, 0.03116), (20.0, 0.9, 0.0, 0.12269), (20.0, 0.99, 0.0, 0.23901)];

#[test]
fn slabs_whose_voxels_are_optically_thick_are_as_bright_as_by_paths() {
    for (tau, albedo, asymmetry, expected) in PATHS {
        let scene = parallel_view(0.5, 4)
            + &sun("[0, 0, -1]")
            + &fog(tau)
            + &format!("[material.m]\nmedium = {{ albedo = {albedo}, asymmetry = {asymmetry} }}\n");
        let again = ["--set", "object.fog.material='m'", "--set", "render.sheets.scattering='forward_and_back'"];
        let seen = in_half_vectors(&scene, &again).channel("G")[5];
        assert!((seen / expected - 1.0).abs() < 0.07, "τ {tau}, ω {albedo}, g {asymmetry}: {seen}, not {expected}");
    }
}

#[test]
fn no_medium_that_is_black_or_invisible_is_said_to_scatter_again_and_again() {
    let medium = |extinction: &str, albedo: &str| {
        parallel_view(2.0, 16)
            + &sun("[0, 0, -1]")
            + &fog(1.0).replace("extinction = 1.0", &format!("extinction = {extinction}"))
            + &format!("[material.m]\nmedium = {{ albedo = {albedo} }}\n")
            + "[[object]]\nname = 'wall'\nrectangle = { center = [0, 0, -2], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.2 }\n"
    };
    let said = |scene: &str| {
        let arguments = ["--set", "object.fog.material='m'", "--set", "render.sheets.scattering='forward_and_back'"];
        explained(scene, &arguments)
    };
    let again = "scattered there again and again";
    assert!(said(&medium("1.0", "0.9")).contains(again));
    for scene in [medium("1.0", "0.0"), medium("1e-20", "0.9")] {
        let said = said(&scene);
        assert!(said.contains("no medium that is seen scatters it") && !said.contains(again), "{said}");
    }
}

/// What is said of a scene that is refused with this exit code; no picture is left.
fn refused(folder: &Path, scene: &str, arguments: &[&str], code: i32) -> String {
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    let mut command = organza();
    command.args(["render", "scene.toml", "-o", "a.exr"]).args(arguments).current_dir(folder);
    let out = command.output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(code), "{said}");
    assert!(!folder.join("a.exr").exists());
    said
}

#[test]
fn what_half_vectors_cannot_draw_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let scene = parallel_view(2.6, 16) + &bright("[-0.4, -1, -0.6]") + MIXED;
    let two = refused(folder.path(), &scene, &[&HALF[..], &["--set", "object.haze.technique='points'"]].concat(), 3);
    assert!(two.contains("object 'haze': drawn by points"), "{two}");
    assert!(two.contains("render.sheets.slicing = \"view\""), "{two}");
    let view = refused(folder.path(), &scene, &["--set", "render.sheets.light_pixels=2"], 2);
    assert!(view.contains("`light_pixels`: slabs across the view do not carry light"), "{view}");
    let many = refused(folder.path(), &scene, &[&HALF[..], &["--set", "render.sheets.slab_width=1e-9"]].concat(), 5);
    assert!(many.contains("render.sheets.slab_width"), "{many}");
    // Without a wall no shadow map is refused before.
    let fog = parallel_view(2.0, 16) + &sun("[-0.4, -1, -0.6]") + &fog(1.0);
    let little = refused(
        folder.path(),
        &fog,
        &[&HALF[..], &["--max-memory", "60M", "--set", "render.sheets.light_pixels=16"]].concat(),
        5,
    );
    assert!(little.contains("rendering needs"), "{little}");
}

#[test]
fn what_is_scattered_again_is_a_layer_of_its_own_and_sums_to_beauty() {
    let scene = parallel_view(2.6, 48) + &bright("[-0.4, -1, -0.6]") + MIXED;
    let again = ["--set", "render.sheets.scattering='forward_and_back'"];
    let [once, many] = [in_half_vectors(&scene, &[]), in_half_vectors(&scene, &again)];
    let more = many.channel("scatterN.G");
    let mean = more.iter().sum::<f64>() / more.len() as f64;
    let least = more.iter().copied().fold(0.0, f64::min);
    assert!(mean > 0.005 && least >= 0.0, "mean {mean}, least {least}");
    for layer in ["scatter1.G", "direct.G", "ambient.G", "A", "shadow.A"] {
        assert_eq!(once.channel(layer), many.channel(layer), "{layer}");
    }
    let off = largest_difference(&many.channel("G"), &sum_of_effects(&many, "G"));
    assert!(off < 1e-5, "{off:e}");
    // Where each object names sheets, too.
    let objects = ["cloud", "haze", "wall", "blind"].map(|object| format!("object.{object}.technique='sheets'"));
    let objects = objects.iter().map(String::as_str).chain([HALF[3], again[1]]);
    let set: Vec<&str> = objects.flat_map(|set| ["--set", set]).collect();
    assert_eq!(draw(&scene, &set).channel("scatterN.G"), more);
    // Beside a translucent wall, which shows some of it: what lies behind gets less.
    let glass = in_half_vectors(&scene, &[&again[..], &["--set", "object.wall.opacity=0.5"]].concat());
    assert!(largest_difference(&glass.channel("scatterN.G"), &more) > 0.003);
    assert!(largest_difference(&glass.channel("G"), &sum_of_effects(&glass, "G")) < 1e-5);
    // A light without shadows goes through all as if it were not there.
    let free = parallel_view(2.6, 48) + &bright("[-0.4, -1, -0.6]") + "shadow = false\n" + MIXED;
    assert!(in_half_vectors(&free, &again).channel("scatterN.G").iter().all(|v| *v == 0.0));
    let said = explained(&free, &again);
    assert!(said.contains("its shadow is left out, and so it is scattered once"), "{said}");
    // In beauty alone it is the same light.
    let plain = in_half_vectors(&scene.replace("layers = ['effects', 'shadow']", ""), &again);
    let off = largest_difference(&many.channel("G"), &plain.channel("G"));
    assert!(off < 1e-5, "{off:e}");
    let folder = tempfile::tempdir().unwrap();
    let layers = ["--layers", "scatterN"];
    for arguments in [&HALF[..], &HALF[..2], &["--technique", "points"]] {
        let said = refused(folder.path(), &scene, &[arguments, &layers].concat(), 2);
        assert!(said.contains("the layer `scatterN` is of light that the technique `sheets` scatters"), "{said}");
    }
    let said = refused(folder.path(), &scene, &[&HALF[..], &["--set", "render.sheets.voxels_per_cell=8"]].concat(), 2);
    assert!(said.contains("light is scattered once"), "{said}");
}

#[test]
fn what_points_are_judged_by_is_known_of_scenes_that_make_no_splats_for_sheets() {
    let set = ["render.technique='sheets'", "render.sheets.slicing='half_vector'"];
    let overrides = set.map(|o| scene::Override::parse(o).unwrap()).to_vec();
    let text = parallel_view(2.0, 16) + &sun("[-0.4, -1, -0.6]") + &fog(1.0);
    let load = scene::LoadOptions { overrides, ..Default::default() };
    let scene = scene::parse(Path::new("s.toml"), text.as_bytes(), &load).unwrap();
    let options = RenderOptions::default();
    let progress = Progress::new();
    let mut renderer = accuracy::Renderer::new(&options, &progress);
    let points = renderer.facts(&accuracy::in_points(&scene)).unwrap();
    assert!(points.slice_thickness.is_some() && points.cells.is_some(), "{points:?}");
    // Half vectors need no map, so no knob of one is turned.
    let sheets = renderer.facts(&accuracy::in_sheets(&scene)).unwrap();
    assert_eq!(sheets.cells, None);
}

/// Six panes about a medium, which tint it and the floor, and each other.
#[test]
fn a_cube_of_translucent_triangles_agrees_with_points_and_stays_discs_for_a_footprint() {
    let corners = (0..8).map(|c| [0, 1, 2].map(|a| if c >> a & 1 == 0 { -0.6 } else { 0.6 }));
    let corners: String = corners.map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let faces = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 1 3 7 5\n4 0 4 6 2\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cube.off"), format!("OFF\n8 6 0\n{corners}{faces}")).unwrap();
    let objects = "footprints = [3, 2]\n\
         [material.glass]\ncolor = [0.4, 0.7, 0.6]\nopacity = 0.4\ntransmission = 0.3\nextinction_rgb = [1, 0.4, 0.7]\n\
         [[object]]\nname = 'cube'\nmaterial = 'glass'\nmesh = 'cube.off'\nspacing = 0.012\n\
         transform = { rotate = [25, 35, 0] }\n\
         [[object]]\nname = 'fog'\nmedium_box = { min = [-0.4, -0.4, -0.4], max = [0.4, 0.4, 0.4], extinction = 1, spacing = 0.04 }\n\
         [[object]]\nname = 'floor'\n\
         rectangle = { center = [0, -1.1, 0], u = [1.2, 0, 0], v = [0, 0.4, -1.2], spacing = 0.012 }\n";
    let scene = objects.split_at("footprints = [3, 2]\n".len());
    let scene = scene.0.to_owned()
        + &parallel_view(2.6, 64)
        + &sun("[-0.4, -1, -0.6]").replace("[1, 1, 1]", "[3, 3, 3]")
        + scene.1;
    // Triangles have sharp edges, and splats have none.
    let smooth = ["--set", "render.antialias=4"];
    let fine = "[render]\nshadow = { cells = 256 }\n";
    let points = organza_tests::draw_in(folder.path(), &(scene.clone() + fine), &smooth);
    let half = organza_tests::draw_in(folder.path(), &scene, &[&HALF[..], &smooth].concat());
    for channel in ["R", "G", "B", "A"] {
        let a = points.channel(channel);
        let b = half.channel(channel);
        let mean = a.iter().sum::<f64>() / a.len() as f64;
        println!("{channel}: RMSE {:.5} of {mean:.4}", rmse(&a, &b));
        assert!(rmse(&a, &b) < 0.01 && mean > 0.1, "{channel}: RMSE {} of {mean}", rmse(&a, &b));
    }
    let said = |more: &[&str]| {
        std::fs::write(folder.path().join("scene.toml"), &scene).unwrap();
        let out = organza().args(["explain", "scene.toml"]).args(HALF).args(more).current_dir(&folder).output();
        String::from_utf8(out.unwrap().stdout).unwrap()
    };
    assert!(said(&[]).contains("translucent triangles are seen, and tint light, where they are"), "{}", said(&[]));
    let discs = said(&["--set", "object.cube.footprint=1"]);
    assert!(discs.contains("footprints are seen on discs alone"), "{discs}");
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    /// Triangles have sharp edges, and splats have none.
    const SMOOTH: [&str; 2] = ["--set", "render.antialias=4"];
    const LAMP: &str = "[[light]]\nkind = 'point'\nposition = [0.5, 4, 1]\nintensity = [160, 150, 120]\n";
    use organza_judge::truth::{Orders, truth};
    use organza_tests::draw_in;

    const AREA: &str = "[[light]]\nkind = 'disk'\nposition = [0.9, 4, 1.6]\nnormal = [-0.2, -1, -0.4]\nradius = 0.8\nintensity = [160, 150, 120]\nsamples = 12\n";

    const ONE_SWEEP: [&str; 2] = ["--set", "render.sheets.soft_shadows='one_sweep'"];

    /// Means over squares of 8² pixels of the green channel, and the same of what path tracing makes of all orders of scattering by media,
    /// with its standard error.
    fn beside_truth(text: &str, scattering: &str) -> (Vec<f64>, Vec<f64>, f64) {
        const SIDE: usize = 8;
        let overrides = [
            "render.technique='sheets'",
            "render.sheets.slicing='half_vector'",
            &format!("render.sheets.scattering='{scattering}'"),
        ];
        let overrides = overrides.map(|o| scene::Override::parse(o).unwrap()).to_vec();
        let load = scene::LoadOptions { overrides, ..Default::default() };
        let scene = scene::parse(Path::new("s.toml"), text.as_bytes(), &load).unwrap();
        let options = RenderOptions::default();
        let progress = Progress::new();
        let size = scene.camera.size.map(|s| s as usize);
        let squares = |image: &dyn Fn(usize) -> f64| {
            let across = size[0] / SIDE;
            let mut out = vec![0.0; across * (size[1] / SIDE)];
            for k in 0..size[0] * size[1] {
                out[k / size[0] / SIDE * across + k % size[0] / SIDE] += image(k) / (SIDE * SIDE) as f64;
            }
            out
        };
        let drawn = organza::render(&scene, &options, &progress).unwrap();
        let beauty = drawn.layers.rgb("beauty").unwrap();
        let truth = truth(&scene, &options, Orders::ByMedia, 64, &progress).unwrap().unwrap();
        let pixels = truth.image.pixels();
        let noise = truth.rms_standard_error() / SIDE as f64;
        (squares(&|k| f64::from(beauty[k][1])), squares(&|k| pixels[k][1]), noise)
    }

    #[test]
    fn translucent_surfaces_volumes_and_raw_points_shadow_each_other_as_by_points() {
        // A sphere of dust, a veil and a ball of glass about two volumes and two walls.
        let dust = (0..4000).map(|i| {
            let z = 1.0 - (f64::from(i) + 0.5) / 2000.0;
            let turn = 2.399_963 * f64::from(i);
            let ring = (1.0 - z * z).sqrt() * 0.4;
            format!("{} {} {}\n", ring * turn.cos() - 0.7, ring * turn.sin() + 0.75, 0.4 * z + 0.2)
        });
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("dust.xyz"), dust.collect::<String>()).unwrap();
        let more = "[material.tinted]\ncolor = [0.9, 0.5, 0.4]\nextinction_rgb = [0.4, 0.8, 1]\n\
             [[object]]\nname = 'dust'\npoints = 'dust.xyz'\nopacity = 0.5\n\
             [[object]]\nname = 'veil'\nmaterial = 'tinted'\nopacity = 0.6\ncolor = [0.5, 0.3, 0.2]\n\
             rectangle = { center = [0.5078125, 0.9546875, 0.1], u = [0.5078125, 0, 0], v = [0, 0.1015625, -0.5], spacing = 0.03 }\n\
             [[object]]\nname = 'ball'\nmaterial = 'tinted'\nopacity = 0.4\n\
             implicit = { expression = '(x - 0.7)^2 + (y + 0.3)^2 + (z - 0.9)^2 - 0.16', box = [[0.2, -0.8, 0.4], [1.2, 0.2, 1.4]], spacing = 0.03 }\n[render]\n";
        let scene = |light: &str| parallel_view(2.6, 64) + light + &MIXED.replace("[render]\n", more);
        for light in [LAMP.to_owned(), bright("[-0.4, -1, -0.6]"), bright("[0.3, -0.8, 0.7]")] {
            let scene = scene(&light);
            // The blind's shadow has edges that are finer than a map's cells; it is looked at above.
            let blind = ["--set", "object.blind.casts_shadow=false"];
            let drawn = |scene: &str, by: &[&str]| draw_in(folder.path(), scene, &[by, &blind, &SMOOTH].concat());
            // Points have edges as wide as their spacing and a sample; those of the veil lie between pixels.
            let finer = finer(&scene).replace("-0.5], spacing = 0.03", "-0.5], spacing = 0.004");
            let [points, half] = [drawn(&finer, &["--technique", "points"]), drawn(&scene, &HALF)];
            for channel in ["R", "G", "B", "A", "scatter1.R", "direct.G"] {
                let a = points.channel(channel);
                let b = half.channel(channel);
                let mean = a.iter().sum::<f64>() / a.len() as f64;
                println!("{channel}: RMSE {:.5} of {mean:.4}", rmse(&a, &b));
                assert!(rmse(&a, &b) < 0.01 && mean > 0.01, "{channel}: RMSE {} of {mean}", rmse(&a, &b));
            }
            // Who casts none changes more than that.
            let veil = ["--set", "object.veil.casts_shadow=false", "--set", "object.dust.casts_shadow=false"];
            let without = drawn(&scene, &[&HALF[..], &veil].concat());
            let changed = rmse(&without.channel("R"), &half.channel("R"));
            assert!(changed > 0.02, "{changed}");
        }
        let said = {
            std::fs::write(folder.path().join("scene.toml"), scene(LAMP)).unwrap();
            let out = organza().args(["explain", "scene.toml"]).args(HALF).current_dir(&folder).output().unwrap();
            String::from_utf8(out.stdout).unwrap()
        };
        assert!(said.contains("it comes through slabs that light and view share"), "{said}");
        assert!(!said.contains("tsm build"), "{said}");
        // Before the volumes, but among the rest.
        let inside = "[[light]]\nkind = 'point'\nposition = [0, 0.4, 1.15]\nintensity = [4, 4, 4]\n";
        std::fs::write(folder.path().join("scene.toml"), scene(inside)).unwrap();
        let out = organza().args(["explain", "scene.toml"]).args(HALF).current_dir(&folder).output().unwrap();
        let said = String::from_utf8(out.stdout).unwrap();
        assert!(said.contains("the lamp lies within the bounds of translucent surfaces or points"), "{said}");
        let [points, half] =
            [draw_in(folder.path(), &scene(inside), &HALF[..0]), draw_in(folder.path(), &scene(inside), &HALF)];
        let apart = rmse(&points.channel("G"), &half.channel("G"));
        assert!(apart < 0.01, "{apart}");
    }

    #[test]
    fn hv15_a_lamp_inside_has_a_shadow_map_and_both_slicings_agree() {
        let lamp = "[[light]]\nkind = 'point'\nposition = [0.3, 0.1, 0.1]\nintensity = [4, 4, 4]\n";
        let scene = parallel_view(2.6, 64) + lamp + &bright("[-0.4, -1, -0.6]") + MIXED;
        let [view, half] = [draw(&finer(&scene), &[&HALF[..2], &SMOOTH].concat()), in_half_vectors(&scene, &SMOOTH)];
        // Beside the lamp radiance has a peak, as high as kernels are small there.
        let is_far = |k: usize| {
            let at = |n: usize| (n as f64 + 0.5) / 64.0 * 2.6 - 1.3;
            (at(k % 64) - 0.3).hypot(-at(k / 64) - 0.1) > 0.3
        };
        for channel in ["R", "A", "scatter1.G"] {
            let [a, b] = [&view, &half].map(|p| p.channel(channel));
            let far =
                |values: Vec<f64>| (0..values.len()).filter(|k| is_far(*k)).map(|k| values[k]).collect::<Vec<_>>();
            let [a, b] = [far(a), far(b)];
            let mean = a.iter().sum::<f64>() / a.len() as f64;
            assert!(rmse(&a, &b) < 0.01 && mean > 0.03, "{channel}: RMSE {} of {mean}", rmse(&a, &b));
        }
        let said = explained(&scene, &[]);
        assert!(!said.contains("scattered once, though"), "{said}");
        let again = ["explain", "scene.toml", "--set", "render.sheets.scattering='forward'"];
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.toml"), &scene).unwrap();
        let out = organza().args(again).args(HALF).current_dir(&folder).output().unwrap();
        let warned = String::from_utf8_lossy(&out.stdout) + String::from_utf8_lossy(&out.stderr);
        assert!(
            warned.contains("a light is scattered once, though render.sheets.scattering asks for more"),
            "{warned}"
        );
        assert!(warned.lines().any(|line| line.starts_with("scatter ") && line.contains(" lacking ")), "{warned}");
        assert!(said.contains("a shadow map has it, scattered once: the lamp lies inside object 'cloud'"), "{said}");
        assert!(said.contains("it comes through slabs that light and view share"), "{said}");
    }

    #[test]
    fn an_area_light_in_one_sweep_is_that_of_its_points() {
        let scene = parallel_view(2.6, 48) + AREA + MIXED;
        let [points, soft] = [in_half_vectors(&scene, &[]), in_half_vectors(&scene, &ONE_SWEEP)];
        // The layer `shadow` is of one sweep: of one point, or of all.
        for channel in ["R", "G", "A", "scatter1.R", "direct.R"] {
            let a = points.channel(channel);
            let b = soft.channel(channel);
            let mean = a.iter().sum::<f64>() / a.len() as f64;
            println!("{channel}: RMSE {:.5} of {mean:.4}", rmse(&a, &b));
            assert!(rmse(&a, &b) < 0.01, "{channel}: RMSE {}", rmse(&a, &b));
            assert!(mean > 0.03, "{channel}: mean {mean}");
        }
        let summed = largest_difference(&soft.channel("G"), &sum_of_effects(&soft, "G"));
        assert!(summed < 1e-5, "{summed:e}");
        let threads = in_half_vectors(&scene, &[&ONE_SWEEP[..], &["--threads", "1"]].concat());
        assert_eq!(threads.channel("R"), soft.channel("R"));
        let said = explained(&scene, &ONE_SWEEP);
        assert!(said.contains("soft.0") && said.contains("one sweep sees each slab from 12 points"), "{said}");
        let said = explained(&scene, &[]);
        assert!(said.contains("a sweep for each of 12 points of it; penumbras widen by 0.3"), "{said}");
        // What no sweep carries has its maps, as ever.
        let inside = scene.replace("[0.9, 4, 1.6]", "[0.3, 0.9, 0.3]");
        assert!(explained(&inside, &ONE_SWEEP).contains("a shadow map for each of 12 points of it"));
    }

    #[test]
    fn clouds_that_scatter_again_and_again_come_near_path_tracing() {
        for (name, direction) in
            [("front", "[0.3, -0.5, -1]"), ("side", "[-1, -0.4, -0.1]"), ("behind", "[0.3, -0.4, 1]")]
        {
            let text = format!(
                "version = 1\n[camera]\nposition = [0, 0.3, 6]\ntarget = [0, 0, 0]\northographic = 2.4\nsize = [72, 48]\n\
                 [[light]]\nkind = 'directional'\ndirection = {direction}\nirradiance = [3, 3, 3]\n\
                 [material.cloud]\nmedium = {{ extinction = 6, albedo = 0.99, asymmetry = 0.6 }}\n\
                 [[object]]\nname = 'cloud'\nmaterial = 'cloud'\n\
                 density = {{ expression = '1.4 - 1.4*(x^2/1.5 + y^2/0.5 + z^2/0.8) + 0.25*sin(5*x)*sin(4*y + 1)*cos(5*z)', \
                 box = [[-1.4, -0.9, -1.1], [1.4, 0.9, 1.1]], spacing = 0.06 }}\n[render]\nantialias = 1\n"
            );
            let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            let mut errors = Vec::new();
            for scattering in ["once", "forward", "forward_and_back"] {
                let (seen, exact, noise) = beside_truth(&text, scattering);
                let error = rmse(&seen, &exact);
                let share = mean(&seen) / mean(&exact);
                println!(
                    "{name}, {scattering}: {share:.3} of the light, RMSE {error:.4} ± {noise:.4}, mean {:.4}",
                    mean(&exact)
                );
                errors.push((error, share));
            }
            let [(once, dark), (forward, _), (both, share)] = errors[..] else { unreachable!() };
            assert!(both < 0.3 * once && both < forward && forward < once, "{name}: RMSE {once} {forward} {both}");
            assert!((0.9..1.2).contains(&share) && dark < 0.5, "{name}: shares {dark} {share}");
        }
    }

    /// The same with walls of finer splats and finer maps, for pictures in which walls are splats and have shadow maps.
    fn finer(scene: &str) -> String {
        let walls = scene.replace("-0.9], spacing = 0.04", "-0.9], spacing = 0.015");
        walls.replace("0.3], spacing = 0.03", "0.3], spacing = 0.01") + "shadow = { cells = 256 }\n"
    }

    #[test]
    fn volumes_and_walls_shadow_each_other_as_in_slabs_across_the_view() {
        for light in [LAMP.to_owned(), bright("[-0.4, -1, -0.6]"), bright("[0.3, -0.8, 0.7]")] {
            let scene = parallel_view(2.6, 64) + &light + MIXED;
            let [view, half] =
                [draw(&finer(&scene), &[&HALF[..2], &SMOOTH].concat()), in_half_vectors(&scene, &SMOOTH)];
            for channel in ["R", "G", "A", "scatter1.R", "direct.R", "shadow.A"] {
                let a = view.channel(channel);
                let b = half.channel(channel);
                let mean = a.iter().sum::<f64>() / a.len() as f64;
                println!("{channel}: RMSE {:.5} of {mean:.4}", rmse(&a, &b));
                assert!(rmse(&a, &b) < 0.01, "{channel}: RMSE {}", rmse(&a, &b));
                assert!(mean > 0.03, "{channel}: mean {mean}");
            }
            let summed = largest_difference(&half.channel("G"), &sum_of_effects(&half, "G"));
            assert!(summed < 1e-5, "{summed:e}");
        }
    }
}
