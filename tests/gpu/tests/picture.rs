//! A whole picture with a device that helps: the processor's, bit for bit.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza::{Choice, Progress, Render, RenderOptions, render, scene};

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

fn adapter() -> Choice {
    std::env::var("ORGANZA_ADAPTER").map_or(Choice::Software, Choice::Named)
}

fn picture(exact: bool, device: Option<Choice>) -> Render {
    let text = format!("{SCENE}\n[render.points]\nexact = {exact}\n");
    let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    render(&scene, &RenderOptions { device, ..RenderOptions::default() }, &Progress::new()).unwrap()
}

#[test]
fn a_picture_with_a_device_is_the_processor_s() {
    let (alone, helped) = (picture(true, None), picture(true, Some(adapter())));
    assert_eq!(alone.layers, helped.layers);
    assert_eq!(alone.backend, "cpu");
    assert!(helped.backend.starts_with("ash, "), "{}", helped.backend);
    assert_eq!(alone.warnings, helped.warnings);
    // It is a picture of something.
    let alpha = alone.layers.scalar("alpha").unwrap();
    assert!(alpha.iter().any(|a| *a > 0.5) && alpha.contains(&0.0));
}

#[test]
fn what_a_device_cannot_do_is_said_and_done_by_the_processor() {
    let (alone, helped) = (picture(false, None), picture(false, Some(adapter())));
    assert_eq!(alone.layers, helped.layers);
    assert!(helped.warnings.iter().any(|w| w.contains("made by the processor")), "{:?}", helped.warnings);
}
