//! The technique `sheets` through the whole command: closed forms, and what points show of the same scene.

use organza_tests::{Picture, draw, draw_in, organza, parallel_view, window};

fn in_sheets(scene: &str, arguments: &[&str]) -> Picture {
    draw(scene, &[&["--technique", "sheets"], arguments].concat())
}

/// The forms of slabs: splatted, gathered by the same kernel, gathered linearly.
const FORMS: [&str; 3] =
    ["render.sheets.reconstruction='splat'", "render.sheets.reconstruction='gather'", "render.sheets.kernel='linear'"];

/// Largest difference from a number, over pixels.
fn off(seen: &[f64], expected: f64) -> f64 {
    seen.iter().map(|v| (v - expected).abs()).fold(0.0, f64::max)
}

#[test]
fn a_slab_of_fog_has_its_transmittance_at_any_width_of_slabs() {
    for tau in [0.01f64, 1.0, 5.0] {
        let scene = format!(
            "{}[[object]]\nname = 'fog'\nmedium_box = {{ min = [-2, -2, -0.5], max = [2, 2, 0.5], \
             extinction = {tau:?}, spacing = 0.1 }}\n[render.sheets]\ntransmittance_cutoff = 0\n",
            parallel_view(2.0, 32)
        );
        for form in FORMS {
            for width in ["'auto'", "0.033", "0.7", "3"] {
                let width = format!("render.sheets.slab_width={width}");
                let picture = in_sheets(&scene, &["--set", &width, "--set", form]);
                let seen = window(&picture.opacity(), 32, 4..28, 4..28);
                let through: Vec<f64> = seen.iter().map(|a| 1.0 - a).collect();
                let error = off(&through, (-tau).exp());
                assert!(error < 1e-5, "{tau}, {width}, {form}: {error:e}");
            }
        }
    }
}

#[test]
fn rays_of_a_wide_lens_are_as_long_as_they_are() {
    let scene = "version = 1\n[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\nfov_y = 90\nsize = [32, 32]\n\
                 [[object]]\nname = 'fog'\nmedium_box = { min = [-9, -9, -0.5], max = [9, 9, 0.5], \
                 extinction = 0.6, spacing = 0.25 }\n[render]\nantialias = 1\n";
    for form in FORMS {
        let alpha = in_sheets(scene, &["--set", form]).opacity();
        for (k, alpha) in alpha.iter().enumerate() {
            let at = |i: usize| (i as f64 + 0.5) / 16.0 - 1.0;
            let [x, y] = [at(k % 32), at(k / 32)];
            let exact = (-0.6 * (1.0 + x * x + y * y).sqrt()).exp();
            assert!((1.0 - alpha - exact).abs() < 1e-5, "{form}, {k}: {alpha}, expected {}", 1.0 - exact);
        }
    }
}

/// A ball whose values fall off around its middle, classified, lit and shadowed.
const BALL: &str = "[[light]]\nkind = 'directional'\ndirection = [-0.4, -1, -0.6]\nirradiance = [2, 1.9, 1.8]\n\
     [ambient]\ncolor = [0.1, 0.1, 0.12]\n\
     [material.smoke]\nmedium = { extinction = 1.5, albedo = 0.8 }\n\
     [[object]]\nname = 'ball'\nmaterial = 'smoke'\n\
     density = { expression = 'exp(-2*(x^2 + y^2 + z^2))', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.06, extinction = 2.5 }\n\
     [render]\ntechnique = 'sheets'\nlayers = ['effects', 'shadow']\n";

#[test]
fn gathered_slabs_show_what_splatted_ones_do() {
    let scene = parallel_view(2.4, 48) + BALL;
    let across_half_vectors = ["--set", "render.sheets.slicing='half_vector'"];
    for (slicing, channel) in [&[][..], &across_half_vectors]
        .into_iter()
        .flat_map(|slicing| ["R", "G", "A", "scatter1.R"].map(|channel| (slicing, channel)))
    {
        let drawn = |form| in_sheets(&scene, &[slicing, &["--set", form]].concat());
        let [splatted, gathered, linear] = FORMS.map(drawn);
        let a = splatted.channel(channel);
        let mean = a.iter().sum::<f64>() / a.len() as f64;
        assert!(mean > 0.02, "{channel}: mean {mean}");
        let error = |other: &Picture| {
            let square = a.iter().zip(other.channel(channel)).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            (square / a.len() as f64).sqrt()
        };
        println!("{channel}: gathered {:.2e}, linear {:.2e}", error(&gathered), error(&linear));
        // The spline is within .0007 of the range of the kernel at a step edge; a linear kernel blurs less.
        assert!(error(&gathered) < 1e-3, "{channel}: {:e}", error(&gathered));
        assert!(error(&linear) < 1e-2, "{channel}: {:e}", error(&linear));
        // They are not the same form under three names.
        assert!(error(&gathered) > 0.0 && error(&linear) > error(&gathered), "{channel}");
    }
}

const HALF_AND_KERNEL: &[&str] = &["render.sheets.slicing='half_vector'", "render.sheets.kernel_extent=3"];
const HALF_AND_FINE: &[&str] = &["render.sheets.slicing='half_vector'", "object.ball.density.spacing=0.02"];

#[test]
fn explain_says_which_form_draws_and_why() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, parallel_view(2.4, 48) + BALL).unwrap();
    let explained = |settings: &[&str]| {
        let sets = settings.iter().flat_map(|setting| ["--set", setting]);
        let output = organza().arg("explain").arg(&scene).args(sets).output().unwrap();
        assert!(output.status.success(), "{settings:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
    };
    for (settings, form, reason) in [
        (&[][..], "gathered slabs", "a twentieth of the voxels or more has extinction"),
        (&[][..], "gathered slabs", "the value in the middle of a slab has the class"),
        (&["render.sheets.kernel='linear'"], "linearly gathered slabs", "the scene asks for it"),
        (&["render.sheets.reconstruction='splat'"], "splatted slabs", "the scene asks for it"),
        (&["render.sheets.kernel_extent=3"], "splatted slabs", "a kernel that is splatted alone"),
        (&["render.sheets.kernel_sections=64"], "splatted slabs", "a kernel that is splatted alone"),
        (&["render.sheets.classify='before'"], "splatted slabs", "before they are reconstructed"),
        (
            &["render.sheets.classify='preintegrated'"],
            "gathered slabs",
            "render.sheets.classify \"preintegrated\" scene",
        ),
        (&["render.sheets.classify='after'"], "gathered slabs", "render.sheets.classify \"after\" scene"),
        (&["render.sheets.aligned='axis'", "camera.orthographic=2"], "splatted slabs", "along the lattice"),
        (&["render.sheets.accumulation='f16'"], "splatted slabs", "half precision"),
        (&["render.sheets.slicing='half_vector'"], "gathered slabs", "half vectors"),
        (HALF_AND_KERNEL, "splatted slabs", "a kernel that is splatted alone"),
        (HALF_AND_FINE, "splatted slabs", "finer than samples"),
        (&["object.ball.density.spacing=0.02"], "splatted slabs", "finer than samples"),
        (&["object.ball.density.spacing=0.2"], "gathered slabs", "a twentieth of the voxels or more"),
        (
            &["object.ball.density.expression='exp(-2*(x^2+y^2+z^2)) - 0.95'"],
            "splatted slabs",
            "fewer than a twentieth",
        ),
    ] {
        let text = explained(settings);
        assert!(text.contains(form), "{settings:?}: no `{form}` in {text}");
        assert!(text.contains(reason), "{settings:?}: no `{reason}` in {text}");
        assert_eq!(text.contains("gathered slabs"), form.contains("gathered"), "{settings:?}: {text}");
    }
}

#[test]
fn what_gathered_slabs_have_not_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    for (settings, key) in [
        ("reconstruction = 'gather', kernel_extent = 2", "`kernel_extent`"),
        ("reconstruction = 'gather', kernel_sigma = 0.7", "`kernel_sigma`"),
        ("reconstruction = 'gather', kernel_sections = 256", "`kernel_sections`"),
        ("reconstruction = 'gather', classify = 'before'", "`classify`"),
        ("reconstruction = 'gather', aligned = 'axis'", "`aligned`"),
        ("reconstruction = 'gather', accumulation = 'f16'", "`accumulation`"),
        ("reconstruction = 'gather', slicing = 'half_vector', kernel_extent = 2", "`kernel_extent`"),
        ("kernel = 'linear', kernel_extent = 3", "`kernel_extent`"),
        ("kernel = 'linear', reconstruction = 'splat'", "`kernel`"),
        ("gradients = 'kernel', kernel_extent = 3", "`kernel_extent`"),
        ("gradients = 'kernel', reconstruction = 'splat'", "`gradients`"),
        ("classify = 'preintegrated', slicing = 'half_vector'", "`classify`"),
        ("classify = 'during'", "during"),
        ("kernel = 'cubic'", "cubic"),
        ("reconstruction = 'both'", "both"),
    ] {
        std::fs::write(&scene, format!("{}{BALL}sheets = {{ {settings} }}\n", parallel_view(2.4, 8))).unwrap();
        let output = organza().arg("explain").arg(&scene).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{settings}: {said}");
        assert!(said.contains(key) && said.contains("scene.toml:"), "{settings}: {said}");
    }
}

/// A translucent ball of glass, a cloud, a volume of values and raw points, which shadow each other and a wall.
const MIXED: &str = "[[light]]\nkind = 'directional'\ndirection = [-0.4, -1, -0.6]\nirradiance = [2, 1.9, 1.8]\n\
     [ambient]\ncolor = [0.1, 0.1, 0.12]\n\
     [material.glass]\nopacity = 0.4\nextinction_rgb = [0.5, 1, 1]\n\
     [material.smoke]\nmedium = { extinction = 1.5, albedo = 0.8 }\n\
     [[object]]\nname = 'ball'\nmaterial = 'glass'\n\
     implicit = { expression = '(x + 0.5)^2 + (y - 0.7)^2 + z^2 - 0.12', box = [[-1, 0.2, -0.5], [0, 1.2, 0.5]], spacing = 0.04 }\n\
     [[object]]\nname = 'cloud'\nmaterial = 'smoke'\n\
     density = { expression = 'exp(-6*((x - 0.4)^2 + y^2 + z^2))', box = [[-0.7, -1, -1], [1.4, 1, 1]], spacing = 0.05, extinction = 3 }\n\
     [[object]]\nname = 'points'\npoints = 'points.xyz'\nopacity = 0.5\n\
     [[object]]\nname = 'wall'\nrectangle = { center = [0, -0.9, -0.4], u = [1.4, 0, 0], v = [0, 0.3, -0.9], spacing = 0.04 }\n\
     [render]\nlayers = ['effects', 'shadow']\n";

/// A sheet of raw points.
fn points() -> String {
    let at = |i: u32| f64::from(i) * 0.04 - 0.5;
    (0..625u32).map(|k| format!("{} {} {}\n", at(k % 25) - 0.3, 0.3 - 0.2 * at(k / 25), at(k / 25) + 0.4)).collect()
}

#[test]
fn what_shadows_each_other_looks_as_by_points() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("points.xyz"), points()).unwrap();
    let scene = parallel_view(2.4, 64) + MIXED;
    let [points, sheets] = ["points", "sheets"].map(|t| draw_in(folder.path(), &scene, &["--technique", t]));
    for channel in ["R", "G", "B", "A", "direct.R", "shadow.A"] {
        let a = points.channel(channel);
        let b = sheets.channel(channel);
        let square = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
        let mean = a.iter().sum::<f64>() / a.len() as f64;
        println!("{channel}: RMSE {:.5}, mean {mean:.4}", square.sqrt());
        assert!(square.sqrt() < 0.01, "{channel}: RMSE {}", square.sqrt());
        assert!(mean > 0.05, "{channel}: mean {mean}");
    }
}

#[test]
fn effects_sum_to_beauty_and_threads_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("points.xyz"), points()).unwrap();
    let scene = parallel_view(2.4, 48) + MIXED;
    let drawn = |threads: &str| draw_in(folder.path(), &scene, &["--technique", "sheets", "--threads", threads]);
    let picture = drawn("1");
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
        for channel in ["R", "A", "direct.G", "shadow.A"] {
            assert_eq!(drawn(threads).channel(channel), picture.channel(channel), "{threads} threads, {channel}");
        }
    }
}

#[test]
fn a_volume_without_extinction_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let grid = "NRRD0004\ntype: float\ndimension: 3\nsizes: 4 4 4\nencoding: ascii\n\n".to_owned() + &"0.5 ".repeat(64);
    std::fs::write(folder.path().join("grid.nrrd"), grid).unwrap();
    let scene = |extinction: &str| {
        let objects = "[[object]]\nname = 'nothing'\nvolume = 'grid.nrrd'\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = E }, \
             { value = 0.6, color = [1, 1, 1], extinction = E }, { value = 1, color = [1, 1, 1], extinction = 2 }]\n";
        parallel_view(6.0, 16) + &objects.replace("= E", &format!("= {extinction}"))
    };
    let told = "shows nothing: its transfer function gives no value extinction";
    let faint = "is too faint to be seen: no splat has an optical depth above";
    for (technique, extinction, expected) in
        [("sheets", "0", told), ("sheets", "1e-14", told), ("points", "0", "has no splats"), ("points", "1e-14", faint)]
    {
        std::fs::write(folder.path().join("scene.toml"), scene(extinction)).unwrap();
        let mut command = organza();
        let command = command.args(["render", "scene.toml", "--force", "--technique", technique, "-o", "a.exr"]);
        let out = command.current_dir(&folder).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.success() && said.contains(&format!("object 'nothing' {expected}")), "{technique}: {said}");
    }
}

#[test]
fn too_many_slabs_are_refused_with_what_to_change() {
    let folder = tempfile::tempdir().unwrap();
    let scene = parallel_view(2.0, 16)
        + "[[object]]\nname = 'fog'\nmedium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.2 }\n";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let refused = |width: &str, code: i32, words: &str| {
        let mut command = organza();
        command.args(["render", "scene.toml", "--technique", "sheets", "-o", "a.exr", "--set"]);
        let out = command.arg(format!("render.sheets.slab_width={width}")).current_dir(&folder).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(code), "{said}");
        assert!(said.contains(words), "{said}");
        assert!(!folder.path().join("a.exr").exists());
    };
    refused("1e-9", 5, "render.sheets.slab_width");
    refused("0", 2, "slab_width");
    refused("-1", 2, "slab_width");
}

/// A smooth volume of 34³ voxels that fills a cube of side 2, with an object of it.
fn volume(folder: &std::path::Path) -> String {
    let mut grid = "NRRD0004\ntype: float\ndimension: 3\nspace: 3D-right-handed\nsizes: 34 34 34\n\
        space directions: (0.0588235294,0,0) (0,0.0588235294,0) (0,0,0.0588235294)\n\
        space origin: (-0.970588235,-0.970588235,-0.970588235)\nencoding: ascii\n\n"
        .to_owned();
    for n in 0..34 * 34 * 34 {
        let at = |i: i32| 0.0588235294 * f64::from(i) - 0.970588235;
        let x = at(n % 34);
        let y = at(n / 34 % 34);
        let z = at(n / (34 * 34));
        let value = 0.5 + 0.2 * ((7.0 * x).sin() * (5.0 * y).cos() + (6.0 * z + 3.0 * x).sin());
        grid += &format!("{value:.6}\n");
    }
    std::fs::write(folder.join("grid.nrrd"), grid).unwrap();
    "[[light]]\nkind = 'directional'\ndirection = [-0.4, -1, -0.6]\nirradiance = [2, 1.9, 1.8]\n\
     [[object]]\nname = 'it'\nvolume = 'grid.nrrd'\ntransfer = [{ value = 0.4, color = [1, 0.5, 0.2], extinction = 0 }, \
     { value = 0.6, color = [0.2, 0.6, 1], extinction = 2 }, { value = 0.9, color = [1, 1, 1], extinction = 1 }]\n\
     [render]\nantialias = 1\ntechnique = 'sheets'\n"
        .to_owned()
}

#[test]
fn a_volume_on_a_body_centred_lattice_shows_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let scene = parallel_view(2.6, 64) + &volume(folder.path());
    let turn = ["--set", "object.it.transform.rotate=[20, 30, 0]"];
    let bcc = ["--set", "object.it.lattice='bcc'"];
    let drawn = |arguments: &[&str]| draw_in(folder.path(), &scene, &[&turn, arguments].concat());
    let cartesian = drawn(&[]);
    let body_centred = drawn(&bcc);
    for channel in ["R", "G", "B", "A"] {
        let a = cartesian.channel(channel);
        let b = body_centred.channel(channel);
        let square = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
        println!("{channel}: RMSE {:.5}", square.sqrt());
        assert!(square.sqrt() < 0.005 && a != b, "{channel}: RMSE {}", square.sqrt());
        assert!(a.iter().sum::<f64>() / a.len() as f64 > 0.01, "{channel}");
    }
}

#[test]
fn what_the_older_methods_and_body_centred_lattices_do_not_draw_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let scene = parallel_view(2.6, 16)
        + &volume(folder.path())
        + "[[object]]\nname = 'fog'\nvisible = false\nmedium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.2 }\n";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let refused = |set: &[&str], code: i32, words: &str| {
        let mut command = organza();
        command.args(["render", "scene.toml", "-o", "a.exr"]).current_dir(&folder);
        set.iter().for_each(|set| _ = command.args(["--set", set]));
        let out = command.output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(code), "{set:?}: {said}");
        assert!(said.contains(words), "{set:?}: {said}");
        assert!(!folder.path().join("a.exr").exists());
    };
    let bcc = "object.it.lattice='bcc'";
    let axis = "render.sheets.aligned='axis'";
    let half = "render.sheets.slicing='half_vector'";
    refused(&[bcc, "render.technique='points'"], 2, "the technique `points` draws no body-centred lattice");
    refused(&["object.fog.lattice='bcc'"], 2, "`lattice` belongs to a `volume`");
    refused(&["render.sheets.classify='before'", half], 2, "slabs across half vectors have no such choice");
    refused(&["render.sheets.classify='preintegrated'", half], 2, "slabs across half vectors have no such choice");
    refused(&[axis, half], 2, "slabs across half vectors have no such choice");
    refused(&[axis, "render.sheets.slab_width=0.1"], 2, "as wide as its planes are apart");
    refused(&[axis, "camera={position=[0, 0, 4], target=[0, 0, 0], size=[16, 16]}"], 2, "parallel rays alone");
    refused(&[axis, "object.fog.visible=true"], 3, "one volume and nothing beside it");
}
