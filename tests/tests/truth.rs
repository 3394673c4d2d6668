//! The points technique against physical truth: the same scene path-traced without splats.

use crate::many_forms::write;
use organza::scene::{self, Scene, Technique};
use organza::{Progress, RenderOptions, render};
use organza_judge::truth::{AllOrders, Orders, Truth, truth};
use std::path::Path;

const SAMPLES: u32 = 64;
/// Pixels along a side of the squares that are compared: means of 64 pixels, 4096 paths.
const SIDE: usize = 8;

fn scene(size: [u32; 2]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/truth.toml");
    let mut scene = scene::parse(&path, &std::fs::read(&path).unwrap(), &Default::default()).unwrap();
    scene.camera.size = size;
    scene
}

fn traced(scene: &Scene) -> Result<Truth, String> {
    truth(scene, &RenderOptions::default(), Orders::One, SAMPLES, &Progress::new()).unwrap()
}

/// The picture, media by points where the scene names nothing else: they scatter light once, as the truth here.
fn drawn(scene: &Scene) -> Vec<[f64; 3]> {
    let mut scene = scene.clone();
    if scene.render.technique == Technique::Auto {
        let media = scene.objects.iter_mut().filter(|object| object.source.is_medium());
        media.for_each(|object| _ = object.technique.get_or_insert(Technique::Points));
    }
    let image = render(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
    image.layers.rgb("beauty").unwrap().iter().map(|p| p.map(f64::from)).collect()
}

/// Mean over each square of `SIDE`² pixels.
fn squares(image: &[[f64; 3]], [width, height]: [u32; 2]) -> Vec<[f64; 3]> {
    let across = width as usize / SIDE;
    let down = height as usize / SIDE;
    let mut out = vec![[0.0; 3]; across * down];
    for (k, pixel) in image.iter().enumerate() {
        let x = k % width as usize / SIDE;
        let y = k / width as usize / SIDE;
        (0..3).for_each(|c| out[y * across + x][c] += pixel[c] / (SIDE * SIDE) as f64);
    }
    out
}

fn rmse(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    (a.iter().zip(b).map(square).sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

#[test]
fn points_agree_with_path_tracing_of_meshes_media_and_translucent_surfaces() {
    let size = [160, 88];
    let scene = scene(size);
    let truth = traced(&scene).unwrap();
    let exact = squares(truth.image.pixels(), size);
    let image = drawn(&scene);
    let error = rmse(&squares(&image, size), &exact);
    // The truth's own error: a square holds 64 pixels.
    let noise = (truth.standard_error.iter().flatten().map(|s| s * s).sum::<f64>()
        / (3 * truth.standard_error.len() * SIDE * SIDE) as f64)
        .sqrt();
    println!("RMSE {error:.5}, truth's standard error {noise:.5}");
    assert!(noise < 0.003, "truth's standard error {noise}");
    assert!(error < 0.006, "RMSE {error}");
    // The comparison can fail: a fifth less light, or no shadows.
    let mut dimmer = scene.clone();
    dimmer.lights.iter_mut().for_each(|l| l.shadow = false);
    assert!(rmse(&squares(&drawn(&dimmer), size), &exact) > 3.0 * error);
}

/// A turned box, a turned formula, a classified volume and a ground, with one sun, and no border in view; `volume.nii` lies in the scene's folder.
fn mixed(folder: &Path, changes: &[[&str; 2]]) -> Scene {
    let cell = |k: usize| {
        let at = |a: usize| (a as f64 + 0.5) / 16.0 - 1.0;
        let p = [at(k % 32), at(k / 32 % 32), at(k / 1024)];
        (1.2 - p.iter().map(|c| c * c).sum::<f64>()).max(0.0) as f32
    };
    let cells: Vec<f32> = (0..32768).map(cell).collect();
    std::fs::write(folder.join("volume.nii"), write::nifti(&cells, 0.0625)).unwrap();
    let mut text = MIXED.to_owned();
    for [from, to] in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let path = folder.join("scene.toml");
    std::fs::write(&path, &text).unwrap();
    scene::parse(&path, text.as_bytes(), &Default::default()).unwrap()
}

const MIXED: &str = r#"version = 1
[camera]
position = [0, 3, 5]
target = [0, 0.3, 0]
fov_y = 32
size = [96, 64]
[background]
color = [0.1, 0.2, 0.4]
[ambient]
color = [0.1, 0.1, 0.1]
[[light]]
kind = "directional"
direction = [0.3, -1, -0.4]
irradiance = [3, 3, 3]
shadow = true
[material.fog]
color = [0.9, 0.8, 0.7]
medium = { extinction = 2, albedo = 0.9, asymmetry = 0.1 }
[[object]]
name = "box"
transform = { rotate = [20, 35, 10], translate = [-1.0, 0.7, 0] }
medium_box = { min = [-0.5, -0.4, -0.4], max = [0.5, 0.4, 0.4], extinction = 2.5, spacing = 0.03 }
material = "fog"
[[object]]
name = "formula"
transform = { rotate = [0, 50, 0], translate = [0.2, 0.5, -0.9] }
density = { expression = "1 + x", box = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]], spacing = 0.03, extinction = 2 }
material = "fog"
[[object]]
name = "volume"
volume = "volume.nii"
transform = { up = "z", scale = 0.55, rotate = [0, 25, 0], translate = [1.0, 0.7, 0.1] }
transfer = [
  { value = 0.2, color = [1.0, 0.3, 0.2], extinction = 0 },
  { value = 0.7, color = [0.4, 0.9, 0.3], extinction = 2.5 },
  { value = 1.2, color = [0.2, 0.3, 1.0], extinction = 4 },
]
material = "fog"
[[object]]
name = "ground"
rectangle = { center = [0, 0, -3], u = [0, 0, 8], v = [9, 0, 0], spacing = 0.05 }
color = [0.7, 0.7, 0.7]
"#;

/// Pairs of texts: what a scene asks otherwise than nature, and a medium that is cut.
const LIBERTIES: [(&str, [&str; 2]); 6] = [
    ("as nature has it", ["shadow = true", "shadow = true"]),
    ("a light without shadows", ["shadow = true", "shadow = false"]),
    ("a box without shadow", ["name = \"box\"", "name = \"box\"\ncasts_shadow = false"]),
    ("half of the shadow", ["name = \"ground\"", "name = \"ground\"\nshadow_coefficient = 0.5"]),
    (
        "a cut formula",
        [
            "extinction = 2 }\nmaterial",
            "extinction = 2 }\nclip = [{ normal = [1, 0.5, 0.3], point = [0.1, 0, 0] }]\nmaterial",
        ],
    ),
    ("too bright a colour", ["color = [0.4, 0.9, 0.3]", "color = [0.4, 3.0, 0.3]"]),
];

#[test]
fn points_agree_with_path_tracing_of_turned_media_classified_volumes_and_unnatural_shadows() {
    let folder = tempfile::tempdir().unwrap();
    let mut natural = Vec::new();
    for (what, change) in LIBERTIES {
        let scene = mixed(folder.path(), &[change]);
        let size = scene.camera.size;
        let truth = traced(&scene).unwrap();
        let exact = squares(truth.image.pixels(), size);
        let error = rmse(&squares(&drawn(&scene), size), &exact);
        let noise = truth.rms_standard_error() / SIDE as f64;
        println!("{what}: RMSE {error:.5}, truth's standard error {noise:.5}");
        assert!(error < 0.005 && noise < 0.002, "{what}: RMSE {error}, truth's standard error {noise}");
        if natural.is_empty() {
            natural = exact;
            continue;
        }
        // The comparison can fail: the picture of another scene is told apart.
        let apart = rmse(&exact, &natural);
        assert!(apart > 2.0 * error, "{what}: {apart} apart, RMSE {error}");
        assert_eq!(truth.method.contains("scatter more light"), what == "too bright a colour", "{}", truth.method);
        let is_weakened = what != "too bright a colour" && what != "a cut formula";
        assert_eq!(truth.method.contains("left out or weakened"), is_weakened, "{}", truth.method);
    }
}

#[test]
fn points_and_sheets_agree_with_path_tracing_of_volumes_that_reflect_about_their_gradients() {
    let folder = tempfile::tempdir().unwrap();
    let phong = ["medium = {", "shading = \"phong\"\nspecular = 0.2\nshininess = 8\nmedium = {"];
    let scattering = squares(traced(&mixed(folder.path(), &[])).unwrap().image.pixels(), [96, 64]);
    let mut scene = mixed(folder.path(), &[phong]);
    let truth = traced(&scene).unwrap();
    let exact = squares(truth.image.pixels(), [96, 64]);
    let noise = truth.rms_standard_error() / SIDE as f64;
    for technique in [Technique::Points, Technique::Sheets] {
        scene.render.technique = technique;
        let error = rmse(&squares(&drawn(&scene), [96, 64]), &exact);
        println!("{technique:?}: RMSE {error:.5}, truth's standard error {noise:.5}");
        assert!(error < 0.005 && noise < 0.002, "{technique:?}: RMSE {error}, truth's standard error {noise}");
    }
    // The comparison can fail: what scatters is told apart.
    assert!(rmse(&scattering, &exact) > 0.02);
}

#[test]
fn points_agree_with_path_tracing_of_a_solid_of_solids() {
    let folder = tempfile::tempdir().unwrap();
    let medium = "medium_box = { min = [-0.5, -0.4, -0.4], max = [0.5, 0.4, 0.4], extinction = 2.5, spacing = 0.03 }\nmaterial = \"fog\"";
    let block = "{ implicit = { expression = 'max(abs(x) - 0.5, max(abs(y), abs(z)) - 0.4)', \
                 box = [[-0.55, -0.55, -0.55], [0.55, 0.55, 0.55]], spacing = 0.02 } }";
    // A ball about (0.4, 0.3, 0.3) by its distances on a lattice, and one about (-0.5, 0.4, 0.4) by points on it.
    let length = |p: [f64; 3]| p.iter().map(|c| c * c).sum::<f64>().sqrt();
    let lattice = (0..25 * 25 * 25).map(|i| [i % 25, i / 25 % 25, i / 625].map(|k| f64::from(k) * 0.05 - 0.6));
    let distances: String = lattice.map(|p| format!("{}\n", length(p))).collect();
    let header = "NRRD0004\ntype: float\ndimension: 3\nsizes: 25 25 25\nspace directions: (0.05,0,0) (0,0.05,0) (0,0,0.05)\n\
                  space origin: (-0.2,-0.3,-0.3)\nencoding: ascii\n\n";
    std::fs::write(folder.path().join("ball.nrrd"), header.to_owned() + &distances).unwrap();
    let spiral = (0..900).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 900.0;
        let turn = 2.4 * f64::from(i);
        let n = [turn.cos() * (1.0 - z * z).sqrt(), turn.sin() * (1.0 - z * z).sqrt(), z];
        format!("{} {} {} {} {} {}\n", 0.3 * n[0] - 0.5, 0.3 * n[1] + 0.4, 0.3 * n[2] + 0.4, n[0], n[1], n[2])
    });
    let points = "x y z nx ny nz\n".to_owned() + &spiral.collect::<String>();
    std::fs::write(folder.path().join("ball.xyz"), points).unwrap();
    let (ball, points) = (
        "{ isosurface = { volume = 'ball.nrrd', level = 0.45, inside = 'below' } }",
        "{ level_set = { points = 'ball.xyz' } }",
    );
    let solid = |parts: &[&str]| {
        let source = format!("difference = [{}]\nspacing = 0.02\ncolor = [0.8, 0.5, 0.3]", parts.join(", "));
        mixed(folder.path(), &[[medium, &source]])
    };
    let carved = solid(&[block, ball, points]);
    let truth = traced(&carved).unwrap();
    let exact = squares(truth.image.pixels(), [96, 64]);
    let off = |scene: &Scene| rmse(&squares(&drawn(scene), [96, 64]), &exact);
    let error = off(&carved);
    let noise = truth.rms_standard_error() / SIDE as f64;
    println!("RMSE {error:.5}, truth's standard error {noise:.5}");
    assert!(error < 0.005 && noise < 0.002, "RMSE {error}, truth's standard error {noise}");
    // The comparison can fail: without either of the balls it is another solid.
    for parts in [[block, points], [block, ball]] {
        assert!(off(&solid(&parts)) > 2.0 * error, "{parts:?}: {}", off(&solid(&parts)));
    }
}

#[test]
fn what_has_no_truth_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let scattering = mixed(folder.path(), &[["color = [0.7, 0.7, 0.7]", "material = \"fog\""]]);
    assert!(traced(&scattering).unwrap_err().contains("phase function"));
    std::fs::write(folder.path().join("raw.xyz"), "0 0 0\n1 0 0\n0 1 0\n").unwrap();
    let ground = "rectangle = { center = [0, 0, -3], u = [0, 0, 8], v = [9, 0, 0], spacing = 0.05 }";
    let raw = mixed(folder.path(), &[[ground, "points = \"raw.xyz\""]]);
    assert!(traced(&raw).unwrap_err().contains("no truth by nature"));
}

/// What one order of scattering leaves out of a scene of 16² pixels under a sun from the eye.
fn left_out(objects: &str) -> AllOrders {
    let head = "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\northographic = 1.0\nsize = [16, 16]\n\
                [[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [3, 3, 3]\n";
    let text = head.to_owned() + objects;
    let scene = scene::parse(Path::new("s.toml"), text.as_bytes(), &Default::default()).unwrap();
    let all_orders = truth(&scene, &RenderOptions::default(), Orders::All, SAMPLES, &Progress::new()).unwrap().unwrap();
    assert!(all_orders.method.contains("all orders"));
    traced(&scene).unwrap().beside(&all_orders).unwrap()
}

#[test]
fn truth_of_all_orders_adds_what_is_scattered_again_and_nothing_else() {
    // Nothing lies where a plane's light goes: radiance ρE/π, whatever the orders.
    let plane = "[material.grey]\ncolor = [0.5, 0.5, 0.5]\n[[object]]\nname = 'plane'\nmaterial = 'grey'\n\
                 rectangle = { center = [0, 0, 0], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }\n";
    let found = left_out(plane);
    let exact = 1.5 / std::f64::consts::PI;
    assert!(found.rmse < 1e-9 && found.mean.iter().all(|m| (m - exact).abs() < 1e-3), "{found:?}");
    // A deep layer that absorbs nothing: once scattered, back along the sun, E/4π·(1 − e^−2τ)/2. As a half-space gives it all
    // back, with E·H(1)²/8π (Chandrasekhar), H(1) = 2.908 for isotropic scattering; this one lets some through and out of its sides.
    let layer = "[material.fog]\nshading = 'phase'\n[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
                 medium_box = { min = [-4, -4, -1], max = [4, 4, 0], extinction = 10.0, spacing = 0.5 }\n";
    let found = left_out(layer);
    let once = 3.0 / (8.0 * std::f64::consts::PI);
    let most = once * 2.908f64.powi(2);
    println!("{found:?}, once {once}, at most {most}");
    assert!((found.mean[0] / once - 1.0).abs() < 0.02, "{found:?}, expected {once}");
    assert!(found.mean[1] > 0.8 * most && found.mean[1] < 1.02 * most, "{found:?}, at most {most}");
    assert!((found.rmse / (found.mean[1] - found.mean[0]) - 1.0).abs() < 0.2, "{found:?}");
}

#[test]
fn orders_by_media_leave_out_what_surfaces_and_media_do_to_each_other() {
    let head = "version = 1\n[camera]\nposition = [0, 1.5, 5]\ntarget = [0, 0, 0]\northographic = 2.0\nsize = [24, 24]\n\
                [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [3, 3, 3]\n";
    let fog = "[material.fog]\nshading = 'phase'\n[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
               medium_box = { min = [-1, 0, -1], max = [1, 0.8, 1], extinction = 4.0, spacing = 0.2 }\n";
    let plane = "[[object]]\nname = 'plane'\nrectangle = { center = [0, -0.1, 0], u = [0, 0, 2], v = [2, 0, 0], spacing = 0.1 }\n";
    let mean = |objects: &str, orders: Orders| {
        let text = head.to_owned() + objects;
        let scene = scene::parse(Path::new("s.toml"), text.as_bytes(), &Default::default()).unwrap();
        let truth = truth(&scene, &RenderOptions::default(), orders, SAMPLES, &Progress::new()).unwrap().unwrap();
        truth.image.pixels().iter().map(|p| p[1]).sum::<f64>() / truth.image.pixels().len() as f64
    };
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.01;
    // Alone fog is the same by all orders, and a plane by one.
    assert!(near(mean(fog, Orders::ByMedia), mean(fog, Orders::All)));
    assert!(near(mean(plane, Orders::ByMedia), mean(plane, Orders::One)));
    // Together there is light from fog on the plane and from the plane in the fog, which is neither's own.
    let both = fog.to_owned() + plane;
    let [one, by_media, all] = [Orders::One, Orders::ByMedia, Orders::All].map(|orders| mean(&both, orders));
    println!("one {one}, by media {by_media}, all {all}");
    let again = mean(fog, Orders::All) - mean(fog, Orders::One);
    assert!(by_media > one + 0.3 * again && all > by_media + 0.3 * again, "{one} {by_media} {all}, again {again}");
}

#[test]
fn colours_above_1_have_a_truth_of_one_order_alone() {
    let text = "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\northographic = 2.0\nsize = [4, 4]\n\
                [material.fog]\ncolor = [1.6, 1.5, 1.4]\nmedium = { extinction = 3 }\n[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
                medium_ball = { center = [0, 0, 0], radius = 0.7, spacing = 0.1 }\n";
    let scene = scene::parse(Path::new("s.toml"), text.as_bytes(), &Default::default()).unwrap();
    assert!(traced(&scene).is_ok());
    for orders in [Orders::ByMedia, Orders::All] {
        let reason = truth(&scene, &RenderOptions::default(), orders, 4, &Progress::new()).unwrap().unwrap_err();
        assert!(reason.contains("colours above 1"), "{reason}");
    }
}

/// A ball of glass before two walls that are shown as they are.
const GLASS: &str = r#"version = 1
[camera]
position = [0.3, 0.2, 4]
target = [0, 0, 0]
fov_y = 25
size = [64, 64]
[background]
color = [0.4, 0.5, 0.7]
[material.glass]
ior = 1.5
absorption_inside = [0.3, 0.1, 0.6]
[[object]]
name = "ball"
material = "glass"
implicit = { expression = "x^2 + y^2 + z^2 - 0.25", box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.02 }
[material.red]
shading = "unlit"
color = [1, 0.1, 0]
[[object]]
name = "above"
material = "red"
rectangle = { center = [0, 1, -2], u = [1.5, 0, 0], v = [0, 1, 0], spacing = 0.03 }
[material.blue]
shading = "unlit"
color = [0, 0.2, 1]
[[object]]
name = "below"
material = "blue"
rectangle = { center = [0, -1, -2], u = [1.5, 0, 0], v = [0, 1, 0], spacing = 0.03 }
"#;

#[test]
fn traced_glass_is_nearer_to_path_tracing_than_the_papers_heuristics() {
    let size = [64, 64];
    let scene_of = |set: &str| {
        let overrides = vec![scene::Override::parse(set).unwrap()];
        let options = scene::LoadOptions { overrides, ..Default::default() };
        scene::parse("glass.toml".as_ref(), GLASS.as_bytes(), &options).unwrap()
    };
    let truth = traced(&scene_of("render.antialias=4")).unwrap();
    let exact = squares(truth.image.pixels(), size);
    let errors = ["traced", "power", "nearest"].map(|bending| {
        let scene = scene_of(&format!("render.surfels.bending='{bending}'"));
        rmse(&squares(&drawn(&scene), size), &exact)
    });
    println!("RMSE from path tracing: traced, power, nearest {errors:.4?}");
    assert!(errors[0] < 0.02 && errors[1] > 3.0 * errors[0] && errors[2] > 3.0 * errors[0], "{errors:?}");
    // What has an opacity of its own, too, has no truth.
    let both = scene_of("object.ball.opacity=0.2");
    assert!(traced(&both).unwrap_err().contains("an opacity of their own"));
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;
    use organza::scene::SceneLight;
    use splat_core::{Light, LightShape};

    /// A floor, fog above it, and one light above both.
    const BELOW: &str = r#"version = 1
    [camera]
    position = [0, 2.5, 3]
    target = [0, 0.1, 0]
    fov_y = 36
    size = [64, 40]
    [render]
    particles = { repeat_level = 16 }
    [material.fog]
    medium = { extinction = 5, albedo = 0.5 }
    [[object]]
    name = "fog"
    medium_ball = { center = [0.35, 0.35, 0], radius = 0.25, spacing = 0.03 }
    material = "fog"
    [[object]]
    name = "floor"
    rectangle = { center = [0, 0, 0], u = [0, 0, 4], v = [4, 0, 0], spacing = 0.08 }
    color = [0.8, 0.7, 0.6]
    [[light]]
    intensity = [4, 4, 4]
    samples = 16
    "#;

    /// The points of a light, shining to all sides alike.
    fn without_cosine(whole: &SceneLight) -> Vec<SceneLight> {
        let bare = |point: Light| {
            let shape = LightShape::Point { position: point.shape.place().unwrap() };
            let light = Light { shape, ..point };
            let label = "0".to_owned();
            let slide = None;
            SceneLight { label, light, slide, samples: 1, states_samples: true, shadow: true, shadow_cells: None }
        };
        whole.light.points(whole.samples).into_iter().map(bare).collect()
    }

    #[test]
    fn extended_lights_shine_as_path_tracing_has_them() {
        for light in [
            "kind = 'rect'\nposition = [0, 1, 0]\nu = [0.5, 0, 0]\nv = [0, 0, 0.4]\n",
            "kind = 'disk'\nposition = [0.8, 0.9, -0.3]\nnormal = [-1, -1, 0.2]\nradius = 0.5\n",
            "kind = 'sphere'\nposition = [-0.5, 1, 0.2]\nradius = 0.3\n",
        ] {
            let text = BELOW.to_owned() + light;
            let mut scene = scene::parse(Path::new("s.toml"), text.as_bytes(), &Default::default()).unwrap();
            let size = scene.camera.size;
            let truth = traced(&scene).unwrap();
            let exact = squares(truth.image.pixels(), size);
            let noise = truth.rms_standard_error() / SIDE as f64;
            let points = rmse(&squares(&drawn(&scene), size), &exact);
            scene.render.technique = scene::Technique::Particles;
            let particles = rmse(&squares(&drawn(&scene), size), &exact);
            scene.render.technique = scene::Technique::Points;
            scene.lights = without_cosine(&scene.lights[0]);
            let without = rmse(&squares(&drawn(&scene), size), &exact);
            let mean = exact.iter().flatten().sum::<f64>() / (3 * exact.len()) as f64;
            println!(
                "{light}mean {mean:.4}, RMSE of points {points:.5}, of particles {particles:.5}, without cosine {without:.5}, \
                 truth's standard error {noise:.5}"
            );
            assert!(noise < 0.003, "truth's standard error {noise}");
            assert!(points < 0.006 && particles < 0.006, "RMSE of points {points}, of particles {particles}");
            // The comparison can fail: a flat light that shines to all sides. Points of a sphere do.
            assert_eq!(without > 5.0 * points, !light.contains("sphere"), "{without}");
        }
    }
}
