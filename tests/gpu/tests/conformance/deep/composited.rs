//! Whole pictures whose splats a device composites: the processor's, within a stated tolerance.

use gpu_conformance::{Interface, Loss, Wrapped, adapter, backend};
use organza::device::{Device, DeviceChoice};
use organza::{Progress, Render, RenderOptions, render, scene};
use splat_core::LayerData;
use std::path::Path;
use std::sync::Arc;

/// Most that beauty and alpha may differ by, as a share of the brightest pixel, and of 1.
const TOLERANCE: f32 = 1e-5;

/// Fog so thin in a spacing that a device lights it.
const SCENE: &str = r#"
    version = 1
    [camera]
    position = [0.4, 0.3, 4]
    target = [0, 0, 0]
    size = [96, 64]
    [[light]]
    kind = "point"
    position = [1, 2, 2]
    intensity = [30, 30, 30]
    [[object]]
    name = "fog"
    medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.2, spacing = 0.1 }
    [[object]]
    name = "pane"
    rectangle = { center = [0, 0, 1.2], u = [0.8, 0, 0.2], v = [0, 0.8, 0], spacing = 0.05 }
    opacity = 0.5
    [[object]]
    name = "wall"
    rectangle = { center = [0.3, 0, 0], u = [0.5, 0, 0.5], v = [0, 0.5, 0], spacing = 0.05 }
    opacity = 1.0
"#;

fn picture(settings: &str, device: Option<DeviceChoice>) -> Render {
    picture_of(SCENE, settings, device)
}

/// Without a shadow map, so that all that a device does is of the splats.
fn unshadowed(settings: &str, device: Option<DeviceChoice>) -> Render {
    picture_of(&SCENE.replace("intensity", "shadow = false\n    intensity"), settings, device)
}

fn picture_of(scene: &str, settings: &str, device: Option<DeviceChoice>) -> Render {
    let text = format!("{scene}\n{settings}\n");
    let points = scene::Override::parse("render.technique='points'").unwrap();
    let overrides = if settings.contains("technique") { Vec::new() } else { vec![points] };
    let options = scene::LoadOptions { overrides, ..Default::default() };
    let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &options).unwrap();
    render_of(&scene, device)
}

fn render_of(scene: &scene::Scene, device: Option<DeviceChoice>) -> Render {
    let device = device.map(|choice| Arc::new(Device::open(&choice).unwrap()));
    let options = RenderOptions { device_composites: device.is_some(), device, ..RenderOptions::default() };
    render(scene, &options, &Progress::new()).unwrap()
}

/// The largest difference of beauty as a share of the brightest pixel, and of alpha.
fn apart(alone: &Render, helped: &Render) -> f32 {
    let beauty = |r: &Render| r.layers.rgb("beauty").unwrap().as_flattened().to_vec();
    let alpha = |r: &Render| r.layers.scalar("alpha").unwrap().to_vec();
    // What is no number is as far apart as can be.
    let most = |a: Vec<f32>, b: Vec<f32>, unit: f32| {
        assert_eq!(a.len(), b.len());
        let pairs = a.iter().zip(&b).map(|(a, b)| (a - b).abs() / unit);
        pairs.fold(0.0, |most: f32, d| if d <= most { most } else { d })
    };
    let brightest = beauty(alone).into_iter().fold(0.0, f32::max);
    assert!(brightest > 0.1, "a picture of something");
    most(beauty(alone), beauty(helped), brightest).max(most(alpha(alone), alpha(helped), 1.0))
}

/// Whether a device left nothing to the processor: whether cells are coarse is told of maps that the processor has, if it has them.
fn says_no_more(helped: &Render, alone: &Render) -> bool {
    helped.warnings.iter().all(|warning| alone.warnings.contains(warning))
}

/// A device made worse, and its count of submissions.
fn worse(loss: Loss, binding_bytes: u64) -> (Arc<Wrapped>, DeviceChoice) {
    let backend = Arc::new(Wrapped::new(Interface::Ash, loss, binding_bytes));
    let choice = DeviceChoice { backends: vec![backend.clone()], choice: adapter(), or_processor: false };
    (backend, choice)
}

#[test]
fn a_composited_picture_is_the_processor_s_within_the_tolerance() {
    for direction in ["front_to_back", "back_to_front"] {
        let settings = format!("[render.points]\ndirection = \"{direction}\"");
        let alone = picture(&settings, None);
        let beauty = alone.layers.rgb("beauty").unwrap();
        let alpha = alone.layers.scalar("alpha").unwrap();
        let brightest = beauty.iter().flatten().fold(0.0, |most: f32, v| most.max(*v));
        assert!(brightest > 0.1 && alpha.iter().any(|a| *a > 0.5) && alpha.contains(&0.0), "a picture of something");
        let (name, device) = crate::named_device();
        let helped = picture(&settings, Some(device));
        assert!(helped.backend.starts_with(&name), "{}", helped.backend);
        assert_eq!(alone.warnings, helped.warnings);
        let same = |a: f32, b: f32, most: f32| (a - b).abs() <= TOLERANCE * most;
        let found = helped.layers.rgb("beauty").unwrap();
        assert!(beauty.iter().flatten().zip(found.iter().flatten()).all(|(a, b)| same(*a, *b, brightest)));
        let found = helped.layers.scalar("alpha").unwrap();
        assert!(alpha.iter().zip(found).all(|(a, b)| same(*a, *b, 1.0)));
        // The device did it: counts of its tiles and not of the processor's.
        let fragments = |r: &Render| r.cost.stages.iter().find(|s| s.name == "splat").unwrap().fragments;
        assert!(fragments(&helped) != fragments(&alone) && fragments(&helped) % 256 == 0);
    }
}

#[test]
fn what_a_device_does_not_composite_is_said_and_done_by_the_processor() {
    let settings = "[render.points]\naccumulation = \"f16\"";
    let alone = picture(settings, None);
    let (_, device) = crate::named_device();
    let helped = picture(settings, Some(device));
    assert_eq!(apart(&alone, &helped), 0.0);
    assert!(helped.warnings.iter().any(|w| w.contains("half precision by the processor")), "{:?}", helped.warnings);
}

#[test]
fn splats_stay_on_the_device_from_their_attributes_to_the_unshadowed() {
    let alone = unshadowed("", None);
    // The trial, and everything else at once.
    let (device, choice) = worse(Loss::Never, u64::MAX);
    let helped = unshadowed("", Some(choice));
    assert_eq!((device.submissions(), &helped.warnings), (2, &alone.warnings));
    assert!(apart(&alone, &helped) <= TOLERANCE, "{:e}", apart(&alone, &helped));
    // One more trial, and all with the shadow map at once.
    let alone = picture("", None);
    let (device, choice) = worse(Loss::Never, u64::MAX);
    let helped = picture("", Some(choice));
    assert_eq!((device.submissions(), &helped.warnings), (3, &alone.warnings));
    assert!(apart(&alone, &helped) <= TOLERANCE, "{:e}", apart(&alone, &helped));
    // More tile entries than there was room for are recorded again, once.
    let large = "[render]\nantialias = 5";
    let alone = unshadowed(large, None);
    let (device, choice) = worse(Loss::Never, u64::MAX);
    let helped = unshadowed(large, Some(choice));
    assert_eq!((device.submissions(), &helped.warnings), (3, &alone.warnings));
    assert!(apart(&alone, &helped) <= TOLERANCE, "{:e}", apart(&alone, &helped));
}

/// A beam, and a lamp without a shadow.
const MORE_LIGHTS: &str = r#"
    [[light]]
    kind = "directional"
    direction = [-0.4, -1, -0.3]
    irradiance = [1, 0.8, 0.6]
    [[light]]
    kind = "point"
    position = [-2, 1, 1]
    intensity = [3, 3, 3]
    shadow = false
"#;

/// Fog and pane alone, with more lights.
fn translucent(lights: &str) -> String {
    let (clear, _) = SCENE.split_once("    [[object]]\n    name = \"wall\"").unwrap();
    clear.replacen("    [[object]]", &format!("{lights}    [[object]]"), 1)
}

#[test]
fn every_layer_that_is_shaded_is_the_processor_s() {
    let settings = "[ambient]\ncolor = [0.1, 0.2, 0.3]\n[render]\nlayers = [\"effects\", \"normal\", \"shadow\"]";
    let alone = picture(settings, None);
    let (device, choice) = worse(Loss::Never, u64::MAX);
    let helped = picture(settings, Some(choice));
    assert_eq!(device.submissions(), 3);
    assert!(apart(&alone, &helped) <= TOLERANCE);
    let names = |r: &Render| r.layers.images.keys().copied().collect::<Vec<_>>();
    assert_eq!(names(&alone), names(&helped));
    for name in ["ambient", "direct", "scatter1", "normal"] {
        let numbers = |r: &Render| r.layers.rgb(name).unwrap().as_flattened().to_vec();
        let a = numbers(&alone);
        let b = numbers(&helped);
        let largest = a.iter().fold(0.0, |most: f32, v| most.max(v.abs()));
        assert!(largest > 0.0 && a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= TOLERANCE * largest), "{name}");
    }
}

#[test]
fn what_hides_particles_is_resolved_by_the_device() {
    let settings = "[render]\ntechnique = \"particles\"\nlayers = [\"object\"]\n[render.particles]\nrepeat_level = 2";
    let scene = SCENE.replace("center = [0.3, 0, 0]", "center = [0.3, 0.3, 1.1]");
    let alone = picture_of(&scene, settings, None);
    let (name, device) = crate::named_device();
    let helped = picture_of(&scene, settings, Some(device));
    assert!(helped.backend.starts_with(&name), "{}", helped.backend);
    let beauty = |r: &Render| r.layers.rgb("beauty").unwrap().to_vec();
    let near = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).all(|c| (a[c] - b[c]).abs() <= TOLERANCE * 10.0);
    let same = beauty(&alone).iter().zip(&beauty(&helped)).filter(|p| near(*p)).count();
    // A particle may lie within rounding of the wall.
    assert!(same >= 96 * 64 * 999 / 1000, "{same}");
    let tiles = |r: &Render| r.cost.stages.iter().find(|s| s.name == "opaque").unwrap().fragments % 256;
    assert!(tiles(&helped) == 0 && beauty(&alone) != beauty(&helped), "the device did it");
}

#[test]
fn a_device_that_cannot_take_all_at_once_or_is_lost_still_yields_the_unshadowed() {
    let alone = unshadowed("", None);
    // The planes of the image just fit; the order is made in parts, and the rest too.
    for direction in ["front_to_back", "back_to_front"] {
        let settings = format!("[render]\nantialias = 1\n[render.points]\ndirection = \"{direction}\"");
        let (device, choice) = worse(Loss::Never, 100_000);
        let parts = unshadowed(&settings, Some(choice));
        assert!(parts.warnings.is_empty() && device.submissions() > 1 + 2 + 2, "{:?}", parts.warnings);
        let alone = unshadowed(&settings, None);
        assert!(apart(&alone, &parts) <= TOLERANCE, "{:e}", apart(&alone, &parts));
    }
    // Nothing fits but a part of the order.
    let (device, choice) = worse(Loss::Never, 1 << 16);
    let refused = unshadowed("", Some(choice));
    assert!(device.submissions() >= 3 && apart(&alone, &refused) == 0.0, "{}", device.submissions());
    assert!(refused.warnings.iter().any(|w| w.contains("no room for even few splats")), "{:?}", refused.warnings);
    for (loss, submissions, said) in
        [(Loss::Once(2), 4, "was lost and opened once more"), (Loss::Always(2), 3, "was lost; the processor goes on")]
    {
        let (device, choice) = worse(loss, u64::MAX);
        let helped = unshadowed("", Some(choice));
        assert!(apart(&alone, &helped) <= TOLERANCE, "{loss:?}");
        assert!(device.submissions() <= submissions, "{loss:?}: {}", device.submissions());
        assert!(helped.warnings.iter().any(|w| w.contains(said)), "{loss:?}: {:?}", helped.warnings);
    }
}

#[test]
fn shadow_maps_stay_on_the_device() {
    let scene = SCENE.replacen("    [[object]]", &format!("{MORE_LIGHTS}    [[object]]"), 1);
    let settings = "[render]\nlayers = [\"effects\", \"shadow\"]";
    let alone = picture_of(&scene, settings, None);
    let bright = scene.replace("shadow = false", "").replace("[[light]]", "[[light]]\n    shadow = false");
    assert!(apart(&alone, &picture_of(&bright, settings, None)) > 0.01, "shadows that can be seen");
    // Two trials, and everything else at once.
    let (device, choice) = worse(Loss::Never, u64::MAX);
    let helped = picture_of(&scene, settings, Some(choice));
    assert_eq!((device.submissions(), &helped.warnings), (3, &alone.warnings));
    assert!(apart(&alone, &helped) <= TOLERANCE, "{:e}", apart(&alone, &helped));
    let maps = |r: &Render| r.cost.stages.iter().filter(|s| s.name == "tsm build").count();
    assert_eq!((maps(&alone), maps(&helped)), (2, 2));
    // There it fails the second trial, and makes lists and looks them up as ever.
    let through_wgpu = picture_of(&scene, settings, Some(DeviceChoice::wgpu(adapter())));
    assert!(through_wgpu.backend.starts_with("wgpu, "), "{}", through_wgpu.backend);
    assert!(apart(&alone, &through_wgpu) <= TOLERANCE, "{:e}", apart(&alone, &through_wgpu));
    let alone = picture_of(&scene, "", None);
    // Too large for the device even in parts, the picture is the processor's.
    let (device, choice) = worse(Loss::Never, 1 << 18);
    let parts = picture_of(&scene, "", Some(choice));
    assert!(parts.warnings.iter().any(|w| w.contains("no room for even few splats")), "{:?}", parts.warnings);
    assert!(device.submissions() > 2, "{}", device.submissions());
    assert!(apart(&alone, &parts) <= TOLERANCE, "{:e}", apart(&alone, &parts));
    for (loss, said) in
        [(Loss::Once(3), "was lost and opened once more"), (Loss::Always(3), "was lost; the processor goes on")]
    {
        let (_, choice) = worse(loss, u64::MAX);
        let helped = picture_of(&scene, "", Some(choice));
        assert!(apart(&alone, &helped) <= TOLERANCE, "{loss:?}");
        assert!(helped.warnings.iter().any(|w| w.contains(said)), "{loss:?}: {:?}", helped.warnings);
    }
    // Maps of polar angles are the processor's, with a line said.
    let polar = "[render.shadow]\nmapping = \"polar\"";
    let lamp = translucent("");
    let alone = picture_of(&lamp, polar, None);
    let (_, choice) = worse(Loss::Never, u64::MAX);
    let helped = picture_of(&lamp, polar, Some(choice));
    assert!(apart(&alone, &helped) <= TOLERANCE);
    assert!(helped.warnings.iter().any(|w| w.contains("polar angles are the processor's")), "{:?}", helped.warnings);
}

#[test]
fn a_small_picture_of_a_scene_is_the_processor_s() {
    // A lamp inside a cloud, a fountain, a tree of translucent leaves, opaque ground.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/light-inside.toml");
    // Media as thick as those of the scene are lit by the processor.
    let thinner = ["material.cloud.medium.extinction=6", "material.water.medium.extinction=3"];
    let overrides = thinner.map(|change| scene::Override::parse(change).unwrap()).to_vec();
    let options = scene::LoadOptions { overrides, ..Default::default() };
    let mut scene = scene::parse(&path, &std::fs::read(&path).unwrap(), &options).unwrap();
    scene.camera.size = [192, 144];
    // What is behind where a pixel is done counts for one and not for the other.
    scene.render.points.transmittance_cutoff = 0.0;
    let alone = render_of(&scene, None);
    let device = DeviceChoice { backends: vec![backend().unwrap()], choice: adapter(), or_processor: false };
    let helped = render_of(&scene, Some(device));
    let far = apart(&alone, &helped);
    assert!(helped.backend != "cpu" && says_no_more(&helped, &alone), "{:?}", helped.warnings);
    assert!(far <= TOLERANCE, "{far:e}");
}

#[test]
fn what_a_software_driver_would_leave_away_goes_through_it_in_parts() {
    // 90 thousand splats on four tiles: Mesa's driver on the processor ends a thread's loops before that.
    let text = r#"
        version = 1
        [camera]
        position = [0, 0, 9]
        target = [0, 0, 0]
        size = [24, 24]
        [[light]]
        kind = "point"
        position = [1, 2, 4]
        intensity = [90, 90, 90]
        [[object]]
        name = "fog"
        medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.0444 }
    "#;
    // Opaque splats are gone through twice, so that half as many are too many.
    let wall = "rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.0093 }\nopacity = 1.0";
    let (before, _) = text.split_once("medium_box").unwrap();
    let points = "\n[render]\ntechnique = \"points\"\n";
    for (text, said) in [(text.to_owned() + points, None), (format!("{before}{wall}"), Some("a tile has more splats"))]
    {
        let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
        let alone = render_of(&scene, None);
        let (_, device) = crate::named_device();
        let helped = render_of(&scene, Some(device));
        assert!(apart(&alone, &helped) <= TOLERANCE, "{:e}", apart(&alone, &helped));
        assert_eq!(helped.warnings.len(), usize::from(said.is_some()), "{:?}", helped.warnings);
        assert!(said.is_none_or(|said| helped.warnings[0].starts_with(said)), "{:?}", helped.warnings);
    }
}

#[test]
fn depth_and_object_layers_are_the_processor_s() {
    // The wall stands out of the fog.
    let scene = SCENE.replace("center = [0.3, 0, 0]", "center = [0.3, 0.3, 1.1]");
    for direction in ["front_to_back", "back_to_front"] {
        let settings =
            format!("[render]\nlayers = [\"depth\", \"object\"]\n[render.points]\ndirection = \"{direction}\"");
        let alone = picture_of(&scene, &settings, None);
        let (name, device) = crate::named_device();
        let helped = picture_of(&scene, &settings, Some(device));
        assert!(helped.backend.starts_with(&name) && says_no_more(&helped, &alone), "{:?}", helped.warnings);
        assert!(apart(&alone, &helped) <= TOLERANCE);
        let LayerData::Id(expected) = &alone.layers.images["object"] else { panic!("ids") };
        let LayerData::Id(found) = &helped.layers.images["object"] else { panic!("ids") };
        let mut others = expected.iter().zip(found).filter(|(a, b)| a != b).count();
        assert!((0..3).all(|o| expected.contains(&o)) && expected.contains(&u32::MAX));
        for layer in ["depth.first", "depth.median", "depth.mean", "depth.sigma"] {
            let a = alone.layers.scalar(layer).unwrap();
            let b = helped.layers.scalar(layer).unwrap();
            assert!(a.iter().any(|z| *z < f32::INFINITY));
            // A level may be reached one splat earlier or later; a deviation is the root of a variance.
            let near = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= 1e-3;
            others += a.iter().zip(b).filter(|pair| !near(*pair)).count();
        }
        assert!(others <= 96 * 64 / 500, "{name} {direction}: {others}");
    }
}
