//! Whole pictures whose splats a device composites: the processor's, within a stated tolerance.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use gpu_conformance::adapter;
use organza::{DeviceChoice, Progress, Render, RenderOptions, render, scene};
use splat_core::LayerData;

/// Most that beauty and alpha may differ by, as a share of the brightest pixel, and of 1.
const TOLERANCE: f32 = 1e-5;

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
    medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.1 }
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
    let text = format!("{SCENE}\n{settings}\n");
    let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    let options = RenderOptions { device_composites: device.is_some(), device, ..RenderOptions::default() };
    render(&scene, &options, &Progress::new()).unwrap()
}

/// The device of the environment, by each executor.
fn devices() -> [(&'static str, DeviceChoice); 2] {
    [("ash, ", DeviceChoice::ash(adapter())), ("wgpu, ", DeviceChoice::wgpu(adapter()))]
}

#[test]
fn a_composited_picture_is_the_processor_s_within_the_tolerance() {
    for direction in ["front_to_back", "back_to_front"] {
        let settings = format!("[render.points]\ndirection = \"{direction}\"");
        let alone = picture(&settings, None);
        let (beauty, alpha) = (alone.layers.rgb("beauty").unwrap(), alone.layers.scalar("alpha").unwrap());
        let brightest = beauty.iter().flatten().fold(0.0, |most: f32, v| most.max(*v));
        assert!(brightest > 0.1 && alpha.iter().any(|a| *a > 0.5) && alpha.contains(&0.0), "a picture of something");
        for (name, device) in devices() {
            let helped = picture(&settings, Some(device));
            assert!(helped.backend.starts_with(name), "{}", helped.backend);
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
}

/// Largest difference as a share of the brightest pixel.
fn apart([a, b]: &[LayerData; 2]) -> f32 {
    let (LayerData::Rgb(a), LayerData::Rgb(b)) = (a, b) else { panic!("beauty has three channels") };
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let most = |values: &mut dyn Iterator<Item = f32>| values.fold(0.0, f32::max);
    most(&mut a.iter().zip(b).map(|(a, b)| (a - b).abs())) / most(&mut a.iter().copied())
}

#[test]
fn what_a_device_does_not_composite_is_said_and_done_by_the_processor() {
    let settings = "[render]\nlayers = [\"depth\"]";
    let alone = picture(settings, None);
    for (_, device) in devices() {
        let helped = picture(settings, Some(device));
        // The light was looked up by the device all the same; nothing else can differ.
        let [mut alone, mut helped] = [&alone, &helped].map(|r| (r.layers.clone(), r.warnings.clone()));
        let beauties = [&mut alone.0, &mut helped.0].map(|l| l.images.remove("beauty").unwrap());
        assert!(alone.0 == helped.0 && apart(&beauties) <= TOLERANCE);
        assert!(helped.1.iter().any(|w| w.contains("depth layers are made by the processor")));
    }
}
