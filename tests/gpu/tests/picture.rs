//! A whole picture with a device that helps: the processor's, bit for bit.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use gpu_conformance::{Loss, Wrapped, adapter};
use organza::{DeviceChoice, Progress, Render, RenderOptions, render, scene};
use std::sync::Arc;

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
"#;

/// A device that is lost, and its count of submissions.
fn losing(loss: Loss, binding_bytes: u64) -> (Arc<Wrapped>, DeviceChoice) {
    let backend = Arc::new(Wrapped::new(gpu_ash::backend(), loss, binding_bytes));
    let choice = DeviceChoice { backends: vec![backend.clone()], choice: adapter(), or_processor: false };
    (backend, choice)
}

/// The device of the environment, by each executor.
fn devices() -> [(&'static str, DeviceChoice); 2] {
    [("ash, ", DeviceChoice::ash(adapter())), ("wgpu, ", DeviceChoice::wgpu(adapter()))]
}

fn picture(exact: bool, device: Option<DeviceChoice>) -> Render {
    let text = format!("{SCENE}\n[render.points]\nexact = {exact}\n");
    let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    render(&scene, &RenderOptions { device, ..RenderOptions::default() }, &Progress::new()).unwrap()
}

#[test]
fn a_picture_with_a_device_is_the_processor_s() {
    let alone = picture(true, None);
    assert_eq!(alone.backend, "cpu");
    for (name, device) in devices() {
        let helped = picture(true, Some(device));
        assert_eq!(alone.layers, helped.layers);
        assert!(helped.backend.starts_with(name), "{}", helped.backend);
        assert_eq!(alone.warnings, helped.warnings);
    }
    // It is a picture of something.
    let alpha = alone.layers.scalar("alpha").unwrap();
    assert!(alpha.iter().any(|a| *a > 0.5) && alpha.contains(&0.0));
}

#[test]
fn what_a_device_cannot_do_is_said_and_done_by_the_processor() {
    let alone = picture(false, None);
    for (_, device) in devices() {
        let helped = picture(false, Some(device));
        assert_eq!(alone.layers, helped.layers);
        assert!(helped.warnings.iter().any(|w| w.contains("made by the processor")), "{:?}", helped.warnings);
    }
}

#[test]
fn a_driver_that_plays_a_gpu_is_never_taken_silently() {
    let drivers = organza::devices().unwrap();
    assert!(drivers.iter().any(|d| d.backend == "ash") && drivers.iter().any(|d| d.backend == "wgpu"));
    if drivers.iter().any(|d| d.adapter.kind.is_gpu()) {
        return;
    }
    let helped = picture(true, Some(DeviceChoice::auto(None)));
    assert_eq!(helped.backend, "cpu");
    assert!(
        helped.warnings.iter().any(|w| w.starts_with("no GPU helps (ash: no such device")),
        "{:?}",
        helped.warnings
    );
    assert_eq!(helped.layers, picture(true, None).layers);
    // By name it is.
    let named = picture(true, Some(DeviceChoice::auto(Some(drivers[0].adapter.name.clone()))));
    assert!(named.backend.starts_with("ash, "), "{}", named.backend);
}

#[test]
fn killing_the_device_in_the_middle_of_a_render_still_yields_the_picture() {
    let alone = picture(true, None);
    // The trial is the first submission, the order the second.
    for (loss, submissions, backend, said) in [
        (Loss::Once(2), 3, "ash, ", "was lost and opened once more"),
        (Loss::Always(2), 3, "cpu", "was lost; the processor goes on"),
    ] {
        let (device, choice) = losing(loss, u64::MAX);
        let helped = picture(true, Some(choice));
        assert_eq!(alone.layers, helped.layers, "{loss:?}");
        assert_eq!(device.submissions(), submissions, "{loss:?}");
        assert!(helped.backend.starts_with(backend), "{loss:?}: {}", helped.backend);
        assert!(helped.warnings.iter().any(|w| w.contains(said)), "{loss:?}: {:?}", helped.warnings);
    }
}

#[test]
fn a_device_with_small_buffers_sorts_in_parts() {
    let alone = picture(true, None);
    // 5461 splats a part: the box alone has more, so the order takes two submissions after the trial.
    let (device, choice) = losing(Loss::Never, 1 << 16);
    let helped = picture(true, Some(choice));
    assert_eq!((&alone.layers, &alone.warnings), (&helped.layers, &helped.warnings));
    assert_eq!(device.submissions(), 1 + 2);
    // Lost at the second part.
    let (device, choice) = losing(Loss::Once(3), 1 << 16);
    assert_eq!(alone.layers, picture(true, Some(choice)).layers);
    assert_eq!(device.submissions(), 3 + 2);
    // Too small for anything: refused at the trial.
    let (_, choice) = losing(Loss::Never, 512);
    let text = SCENE.as_bytes();
    let scene = scene::parse("scene.toml".as_ref(), text, &Default::default()).unwrap();
    let options = RenderOptions { device: Some(choice), ..RenderOptions::default() };
    let error = render(&scene, &options, &Progress::new()).unwrap_err();
    assert!(error.exit_code() == 6 && error.to_string().contains("kernels see at most 512"), "{error}");
}
