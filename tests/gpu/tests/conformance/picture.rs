//! A whole picture with a device that helps: the processor's, bit for bit.

use gpu_conformance::{Interface, Loss, Wrapped, adapter};
use organza::device::{self, Device, DeviceChoice};
use organza::{Progress, Render, RenderOptions, render, scene};
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
    medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.2, spacing = 0.1 }
    [[object]]
    name = "pane"
    rectangle = { center = [0, 0, 1.2], u = [0.8, 0, 0.2], v = [0, 0.8, 0], spacing = 0.05 }
    opacity = 0.5
"#;

/// A device that is lost, and its count of submissions.
fn losing(loss: Loss, binding_bytes: u64) -> (Arc<Wrapped>, DeviceChoice) {
    chosen(Wrapped::new(Interface::Ash, loss, binding_bytes))
}

fn chosen(backend: Wrapped) -> (Arc<Wrapped>, DeviceChoice) {
    let backend = Arc::new(backend);
    let choice = DeviceChoice { backends: vec![backend.clone()], choice: adapter(), or_processor: false };
    (backend, choice)
}

fn opened(choice: Option<DeviceChoice>) -> Option<Arc<Device>> {
    choice.map(|choice| Arc::new(Device::open(&choice).unwrap()))
}

fn picture(exact: bool, device: Option<DeviceChoice>) -> Render {
    let text = format!("{SCENE}\n[render]\ntechnique = \"points\"\n[render.points]\nexact = {exact}\n");
    let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    render(&scene, &RenderOptions { device: opened(device), ..RenderOptions::default() }, &Progress::new()).unwrap()
}

#[test]
fn a_picture_with_a_device_is_the_processor_s() {
    let alone = picture(true, None);
    assert_eq!(alone.backend, "cpu");
    let (name, device) = crate::named_device();
    let helped = picture(true, Some(device));
    assert_eq!(alone.layers, helped.layers);
    assert!(helped.backend.starts_with(&name), "{}", helped.backend);
    assert_eq!(alone.warnings, helped.warnings);
    // It is a picture of something.
    let alpha = alone.layers.scalar("alpha").unwrap();
    assert!(alpha.iter().any(|a| *a > 0.5) && alpha.contains(&0.0));
}

#[test]
fn what_a_device_cannot_do_is_said_and_done_by_the_processor() {
    let alone = picture(false, None);
    let (_, device) = crate::named_device();
    let helped = picture(false, Some(device));
    assert_eq!(alone.layers, helped.layers);
    assert!(helped.warnings.iter().any(|w| w.contains("made by the processor")), "{:?}", helped.warnings);
}

#[test]
fn a_driver_that_plays_a_gpu_is_never_taken_silently() {
    let drivers = device::devices().unwrap();
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

/// A picture by particles that are shown as they are.
fn particles(device: Option<DeviceChoice>, more: &str) -> Render {
    let text = format!(
        r#"
        version = 1
        [camera]
        position = [0.4, 0.3, 4]
        target = [0, 0, 0]
        size = [96, 64]
        [material.plain]
        shading = "unlit"
        [[object]]
        name = "pane"
        material = "plain"
        rectangle = {{ center = [0, 0, 1.2], u = [0.8, 0, 0.2], v = [0, 0.8, 0], spacing = 0.05 }}
        color = [0.9, 0.5, 0.2]
        opacity = 0.5
        [[object]]
        name = "behind"
        material = "plain"
        rectangle = {{ center = [0.3, 0, 0], u = [0.9, 0, 0], v = [0, 0.9, 0], spacing = 0.05 }}
        color = [0.1, 0.4, 0.9]
        opacity = 0.7
        [render]
        technique = "particles"
        {more}
        [render.particles]
        repeat_level = 40
        "#
    );
    let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    render(&scene, &RenderOptions { device: opened(device), ..RenderOptions::default() }, &Progress::new()).unwrap()
}

/// Share of pixels of equal opacity, which are those of equal hits.
fn agreement(a: &Render, b: &Render) -> f64 {
    let [a, b] = [a, b].map(|r| r.layers.scalar("alpha").unwrap());
    assert!(a.iter().filter(|a| **a > 0.2).count() > 500);
    a.iter().zip(b).filter(|(a, b)| a == b).count() as f64 / a.len() as f64
}

#[test]
fn particles_by_a_device_are_the_processor_s_in_almost_every_pixel() {
    let alone = particles(None, "");
    let (name, device) = crate::named_device();
    let helped = particles(Some(device), "");
    assert!(helped.backend.starts_with(&name), "{}", helped.backend);
    assert_eq!((helped.sets, &helped.warnings), (alone.sets, &alone.warnings));
    assert!(agreement(&alone, &helped) >= 0.999, "{}", agreement(&alone, &helped));
}

#[test]
fn particles_that_the_device_cannot_make_are_uploaded() {
    let fog = r#"
        [[object]]
        name = "fog"
        material = "plain"
        medium_box = { min = [-0.5, -1, -1], max = [1, 1, 0.5], extinction = 0.8, spacing = 0.2 }
        "#;
    let alone = particles(None, fog);
    let (device, choice) = losing(Loss::Never, u64::MAX);
    let helped = particles(Some(choice), fog);
    assert!(agreement(&alone, &helped) >= 0.999, "{}", agreement(&alone, &helped));
    assert!(helped.warnings.iter().any(|w| w.contains("are sampled by the processor")), "{:?}", helped.warnings);
    assert_eq!((device.submissions(), helped.warnings.len()), (1 + 5, alone.warnings.len() + 1));
}

#[test]
fn particles_that_a_device_cannot_fold_are_the_processor_s() {
    for (layer, why) in [("depth", "depth layers"), ("object", "object layers")] {
        let layers = format!("layers = [\"{layer}\"]");
        let (device, choice) = losing(Loss::Never, u64::MAX);
        let helped = particles(Some(choice), &layers);
        assert!(helped.warnings.iter().any(|w| w.contains(why)), "{:?}", helped.warnings);
        assert_eq!((helped.layers, helped.backend.as_str()), (particles(None, &layers).layers, "cpu"));
        assert_eq!(device.submissions(), 1);
    }
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;
    use organza::device::Agreement;

    #[test]
    fn killing_the_device_in_the_middle_of_a_render_still_yields_the_picture() {
        let alone = picture(true, None);
        // The trial is the first submission, the shadow map the second, the order the third.
        for (interface, name) in [(Interface::Ash, "ash, "), (Interface::Wgpu, "wgpu, ")] {
            for (loss, submissions, backend, said) in [
                (Loss::Once(2), 4, name, "was lost and opened once more"),
                (Loss::Once(3), 4, name, "was lost and opened once more"),
                (Loss::Always(2), 3, "cpu", "was lost; the processor goes on"),
                (Loss::Always(3), 4, name, "was lost; the processor goes on"),
            ] {
                let (device, choice) = chosen(Wrapped::new(interface, loss, u64::MAX));
                let helped = picture(true, Some(choice));
                assert_eq!(alone.layers, helped.layers, "{interface:?} {loss:?}");
                assert_eq!(device.submissions(), submissions, "{interface:?} {loss:?}");
                assert!(helped.backend.starts_with(backend), "{interface:?} {loss:?}: {}", helped.backend);
                assert!(helped.warnings.iter().any(|w| w.contains(said)), "{loss:?}: {:?}", helped.warnings);
            }
        }
    }

    #[test]
    fn lit_particles_by_a_device_are_the_processor_s() {
        for more in ["", r#"layers = ["beauty", "effects", "normal", "shadow"]"#] {
            let alone = lit_particles(None, more);
            let (name, device) = crate::named_device();
            let helped = lit_particles(Some(device), more);
            assert!(helped.backend.starts_with(&name), "{}", helped.backend);
            let (most, brightest) = apart(&alone, &helped);
            assert!(agreement(&alone, &helped) >= 0.999, "{name}: {}", agreement(&alone, &helped));
            assert!(most <= 3e-5 * brightest && brightest > 0.2, "{name}: {most} of {brightest}");
        }
    }

    #[test]
    fn killing_the_device_among_lit_sets_goes_on_from_there() {
        let alone = lit_particles(None, "");
        let whole = losing(Loss::Never, u64::MAX);
        let helped = lit_particles(Some(whole.1), "");
        // The trial, the lists of two maps, and five batches of eight sets.
        assert_eq!(whole.0.submissions(), 1 + 2 + 5);
        let (device, choice) = losing(Loss::Once(6), u64::MAX);
        let again = lit_particles(Some(choice), "");
        assert_eq!((device.submissions(), &again.layers), (1 + 2 + 5 + 1, &helped.layers));
        let (_, choice) = losing(Loss::Always(6), u64::MAX);
        let rest = lit_particles(Some(choice), "");
        let (most, brightest) = apart(&alone, &rest);
        assert!(rest.backend.ends_with("then cpu") && agreement(&alone, &rest) >= 0.999, "{}", rest.backend);
        assert!(most <= 3e-5 * brightest, "{most} of {brightest}");
    }

    #[test]
    fn every_device_has_a_passport() {
        let passports = device::passport("").unwrap();
        assert_eq!(passports.len(), device::devices().unwrap().len());
        for passport in &passports {
            assert!(passport.valid(), "{passport:?}");
            let [order, lists, shadow, project, shade, composite, opaque, chain, particles, made, lit] =
                &passport.recordings[..]
            else {
                panic!("{passport:?}")
            };
            assert_eq!((order.recording, order.items), ("order", 1 << 17));
            assert_eq!(order.outcome.as_ref().map(|a| (a.equal_share, a.mean, a.max)), Ok((1.0, 0.0, 0.0)));
            assert_eq!(lists.outcome.as_ref().map(|a| (a.within, a.equal_share, a.max)), Ok((true, 1.0, 0.0)));
            assert!(lists.items > 50_000);
            assert!(shadow.items.abs_diff(lists.items) * 1000 <= lists.items, "{shadow:?}");
            assert!(shadow.outcome.as_ref().is_ok_and(|a| a.mean < 1e-5), "{shadow:?}");
            let composited = |a: &Agreement| a.within && a.mean < 1e-6 && a.max <= 1e-5;
            for splats in [project, shade, composite, chain] {
                assert!(splats.items == 1 << 14 && splats.outcome.as_ref().is_ok_and(composited), "{splats:?}");
            }
            assert!(opaque.outcome.as_ref().is_ok_and(|a| a.within && a.mean < 1e-6), "{opaque:?}");
            for particles in [particles, made, lit] {
                assert!(particles.items > 100_000 && particles.outcome.as_ref().is_ok_and(|a| a.mean < 1e-3));
            }
            assert_eq!(particles.items, made.items);
            // Of each kernel one row: four passes of the sort are one.
            let scatter = order.passes.iter().filter(|k| k.kernel.contains("scatter")).map(|k| k.dispatches);
            assert!(order.passes.is_empty() || scatter.sum::<u32>() == 4, "{:?}", order.passes);
            assert_eq!(passport.missing.contains(&"timestamps"), order.passes.is_empty());
        }
        assert!(device::passport("no such device").unwrap().is_empty());
    }

    #[test]
    fn killing_the_device_between_sets_goes_on_from_there() {
        let alone = particles(None, "");
        // 40 sets are five batches of eight, after the trial.
        let whole = losing(Loss::Never, u64::MAX);
        let helped = particles(Some(whole.1), "");
        assert_eq!(whole.0.submissions(), 1 + 5);
        let (device, choice) = losing(Loss::Once(4), u64::MAX);
        let again = particles(Some(choice), "");
        // What was folded before the loss is not folded again, and the fresh device gives the same sums.
        assert_eq!((device.submissions(), &again.layers), (1 + 5 + 1, &helped.layers));
        assert!(again.warnings.iter().any(|w| w.contains("opened once more")), "{:?}", again.warnings);
        let (device, choice) = losing(Loss::Always(4), u64::MAX);
        let rest = particles(Some(choice), "");
        assert_eq!((device.submissions(), rest.sets), (5, alone.sets));
        assert!(rest.backend.ends_with("then cpu") && agreement(&alone, &rest) >= 0.999, "{}", rest.backend);
        // Small buffers take fewer sets at once, and less than one set is the processor's.
        let (device, choice) = losing(Loss::Never, 2 << 20);
        let slowly = particles(Some(choice), "");
        assert!(
            device.submissions() > 6 && slowly.warnings.is_empty(),
            "{} {:?}",
            device.submissions(),
            slowly.warnings
        );
        assert_eq!(slowly.layers, helped.layers);
        let (_, choice) = losing(Loss::Never, 1 << 16);
        let refused = particles(Some(choice), "");
        assert_eq!(refused.layers, alone.layers);
        assert!(refused.warnings.iter().any(|w| w.contains("kernels see at most")), "{:?}", refused.warnings);
    }

    #[test]
    fn a_device_with_small_buffers_sorts_in_parts() {
        let alone = picture(true, None);
        // 5461 splats a part: the box alone has more, so the order takes two submissions after the trial. Some of the map's
        // neighbouring cells have more entries than kernels can see, so its lists are the processor's.
        let (device, choice) = losing(Loss::Never, 1 << 16);
        let helped = picture(true, Some(choice));
        assert!(alone.layers == helped.layers && helped.warnings.len() == 1, "{:?}", helped.warnings);
        assert!(helped.warnings[0].contains("the processor makes its lists"), "{:?}", helped.warnings);
        assert_eq!(device.submissions(), 1 + 2);
        // Lost at the second part.
        let (device, choice) = losing(Loss::Once(3), 1 << 16);
        assert!(alone.layers == picture(true, Some(choice)).layers);
        assert_eq!(device.submissions(), 3 + 2);
        // With buffers of four times that the map is made in parts, and the order at once.
        let (device, choice) = losing(Loss::Never, 1 << 18);
        let helped = picture(true, Some(choice));
        assert!(alone.layers == helped.layers && helped.warnings.is_empty(), "{:?}", helped.warnings);
        let lists = device.submissions() - 2;
        assert!(lists > 1, "the map in {lists} parts");
        let (device, choice) = losing(Loss::Once(3), 1 << 18);
        assert!(alone.layers == picture(true, Some(choice)).layers);
        assert_eq!(device.submissions(), 3 + lists + 1);
        // As many parts where the memory is too small for all: 30 bytes a splat.
        let (device, choice) = chosen(Wrapped::new(Interface::Ash, Loss::Never, u64::MAX).with_memory(200_000));
        let short = picture(true, Some(choice));
        assert!(alone.layers == short.layers && short.warnings.len() == 1, "{:?}", short.warnings);
        assert_eq!(device.submissions(), 1 + 2);
        // Too small for anything: refused at the trial.
        let (_, choice) = losing(Loss::Never, 512);
        let error = Device::open(&choice).unwrap_err();
        assert!(error.to_string().contains("kernels see at most 512"), "{error}");
    }

    #[test]
    fn light_that_a_device_does_not_make_is_the_processor_s() {
        let glossy = r#"
            [material.glossy]
            specular = 0.2
            shininess = 100
            [[object]]
            name = "mirror"
            material = "glossy"
            rectangle = { center = [-0.5, 0.5, 1.4], u = [0.3, 0, 0], v = [0, 0.3, 0], spacing = 0.05 }
            opacity = 0.5
            "#;
        let (_, choice) = losing(Loss::Never, u64::MAX);
        let helped = lit_particles(Some(choice), glossy);
        assert!(helped.warnings.iter().any(|w| w.contains("an exponent above 64")), "{:?}", helped.warnings);
        assert_eq!(helped.layers, lit_particles(None, glossy).layers);
    }

    /// A picture by particles that two lamps light, through their shadow maps; a lamp, a pane and fog.
    fn lit_particles(device: Option<DeviceChoice>, more: &str) -> Render {
        let text = format!(
            r#"
            version = 1
            [camera]
            position = [0.4, 0.3, 4]
            target = [0, 0, 0]
            size = [96, 64]
            [[light]]
            kind = "point"
            position = [1, 2, 2]
            intensity = [30, 30, 30]
            [[light]]
            kind = "directional"
            direction = [0.3, -0.8, -0.5]
            irradiance = [2, 1.5, 1]
            [material.plain]
            shading = "unlit"
            [[object]]
            name = "pane"
            rectangle = {{ center = [0, 0, 1.2], u = [0.8, 0, 0.2], v = [0, 0.8, 0], spacing = 0.05 }}
            color = [0.9, 0.5, 0.2]
            opacity = 0.5
            [[object]]
            name = "behind"
            material = "plain"
            rectangle = {{ center = [0.3, 0, 0], u = [0.9, 0, 0], v = [0, 0.9, 0], spacing = 0.05 }}
            color = [0.1, 0.4, 0.9]
            opacity = 0.7
            [[object]]
            name = "fog"
            medium_box = {{ min = [-0.5, -1, -1], max = [1, 1, 0.5], extinction = 0.8, spacing = 0.2 }}
            [render]
            technique = "particles"
            {more}
            [render.particles]
            repeat_level = 40
            "#
        );
        let scene = scene::parse("scene.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
        render(&scene, &RenderOptions { device: opened(device), ..RenderOptions::default() }, &Progress::new()).unwrap()
    }

    /// Largest difference of the pixels of equal opacity, in every layer, and the brightest number of beauty.
    fn apart(a: &Render, b: &Render) -> (f32, f32) {
        let [x, y] = [a, b].map(|r| r.layers.scalar("alpha").unwrap());
        let mut most = 0.0f32;
        for name in ["beauty", "ambient", "emission", "direct", "scatter1", "normal"] {
            let (Some(a), Some(b)) = (a.layers.rgb(name), b.layers.rgb(name)) else { continue };
            let equal = a.iter().zip(b).zip(x.iter().zip(y)).filter(|(_, (x, y))| x == y);
            most = equal.flat_map(|((a, b), _)| (0..3).map(move |c| (a[c] - b[c]).abs())).fold(most, f32::max);
        }
        (most, a.layers.rgb("beauty").unwrap().as_flattened().iter().fold(0.0, |a, b| b.max(a)))
    }
}
