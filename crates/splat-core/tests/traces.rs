//! Matter and light of which there is next to nothing: they change no picture, and cost no arithmetic of numbers below the normal ones.

use glam::{DVec3, Vec3};
use splat_core::optics::{FAINTEST, TRACE, too_faint};
use splat_core::raster::{Detail, FoldInput, OpaqueImage, Params, ProjectInput, Projected, fold, project};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade};
use splat_core::{Accumulator, Camera, Cloud, Direction, FootprintStack, Gaussians, LayerSet, Light, LightShape};
use splat_core::{Material, Object, Projection, Receiver, Splat, SplatKind, Transmittance};

fn camera() -> Camera {
    let view = Projection::Perspective { fov_y: 0.6 };
    Camera::look_at(DVec3::Z * 8.0, DVec3::ZERO, DVec3::Y, view, [48, 48]).unwrap()
}

/// Media and surfaces of these cross-sections in turns, spread over the picture.
fn cloud(cross_sections: &[f32]) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..60 {
        let at = |step: f32| (i as f32 * step).fract() * 3.0 - 1.5;
        let kind = if i % 3 == 0 { SplatKind::Surface } else { SplatKind::Medium };
        for &cross_section in cross_sections {
            let position = Vec3::new(at(0.618), at(0.414), at(0.732));
            let normal = if kind == SplatKind::Surface { Vec3::Z } else { Vec3::ZERO };
            let gaussian = Gaussians::NONE;
            cloud.push(&Splat { position, radius: 0.4, cross_section, kind, normal, gaussian, ..Splat::default() });
        }
    }
    cloud
}

/// What a cloud looks like under a light, and its footprints.
fn draw(cloud: &Cloud, intensity: f32, shadow: Option<&dyn Transmittance>) -> (Accumulator, Projected) {
    let camera = &camera();
    let params = &Params::default();
    let materials = &[Material::default()];
    let footprints = &FootprintStack::default();
    let projected = project(&ProjectInput { cloud, camera, footprints, materials, params, detail: Detail::ALL });
    let shape = LightShape::Directional { direction: DVec3::new(0.6, 0.0, -0.8) };
    let lights = &[LitBy { slide: None, light: Light { shape, intensity: [intensity; 3] }, shadow }];
    let layout = ChannelLayout::new(&LayerSet::default());
    let objects = &[Object::default()];
    let input = ShadeInput { cloud, materials, objects, lights, ambient: [0.0; 3], camera };
    let values = &shade(&input, &projected, &layout, None).unwrap();
    let mut order: Vec<u32> = (0..cloud.len() as u32).collect();
    order.sort_by(|a, b| cloud.position[*b as usize].z.total_cmp(&cloud.position[*a as usize].z));
    let mut out = Accumulator::new(camera.size, 1, layout.count(), true, true);
    let opaque = &OpaqueImage::default();
    let direction = Direction::FrontToBack;
    let input = FoldInput { projected: &projected, order: &order, values, materials, opaque, direction, params };
    fold(&input, &mut out, None).unwrap();
    (out, projected)
}

#[test]
fn x6_traces_of_matter_are_not_drawn() {
    let (thin, thin_projected) = draw(&cloud(&[1e-6]), 2.0, None);
    let (both, projected) = draw(&cloud(&[1e-6, 1e-36]), 2.0, None);
    assert_eq!((both.optical_depth, both.channels), (thin.optical_depth, thin.channels));
    assert_eq!(projected.visible(), thin_projected.visible());
    assert!(projected.visible() > 30);
    // They are not cut before they are traces: the peak of an optical depth is several times a cross-section here.
    let (_, above) = draw(&cloud(&[FAINTEST]), 2.0, None);
    assert_eq!(above.visible(), thin_projected.visible());
}

#[test]
fn x6_matter_is_as_faint_as_its_material_makes_it() {
    let faint = cloud(&[1e-3 * FAINTEST]);
    let camera = camera();
    let visible = |factor: f32| {
        let materials = &[Material { extinction_rgb: [0.0, factor, 0.0], ..Material::default() }];
        let footprints = &FootprintStack::default();
        let params = &Params::default();
        let input = ProjectInput { cloud: &faint, camera: &camera, footprints, materials, params, detail: Detail::ALL };
        project(&input).visible()
    };
    assert!(visible(1.0) == 0 && visible(1e6) > 30);
}

#[test]
fn x6_objects_that_nothing_is_seen_of_are_named() {
    let mut cloud = cloud(&[1e-2 * FAINTEST]);
    // Object 1 has no splats, 3 a thin one, and 4 a clear surface.
    cloud.kind.fill(SplatKind::Medium);
    (0..cloud.len()).for_each(|i| cloud.object[i] = [0, 2, 3, 4][i % 4]);
    (cloud.cross_section[2], cloud.kind[3]) = (1e-6, SplatKind::Surface);
    assert_eq!(too_faint(&cloud, &[Material::default()], 9), [0, 2]);
    assert_eq!(too_faint(&cloud, &[Material { extinction_rgb: [0.0, 0.0, 1e6], ..Material::default() }], 5), [0; 0]);
    assert_eq!(too_faint(&Cloud::default(), &[Material::default()], 0), [0; 0]);
}

#[test]
fn x5_numbers_below_the_normal_ones_give_pictures_of_numbers() {
    type Poison = fn(&mut Cloud, f32);
    let columns: [(&str, Poison); 8] = [
        ("position", |cloud, v| cloud.position[7] = Vec3::new(v, -v, 1.0)),
        ("radius", |cloud, v| cloud.radius[7] = v),
        ("cross_section", |cloud, v| cloud.cross_section[7] = v),
        ("color", |cloud, v| cloud.color[7] = [v, 0.5, v]),
        ("tangent", |cloud, v| cloud.tangent = vec![Vec3::X * v; cloud.len()]),
        ("normal", |cloud, v| cloud.normal[6] = Vec3::new(v, -v, 1.0)),
        ("value", |cloud, v| cloud.value = vec![v; cloud.len()]),
        ("shadow_coefficient", |cloud, v| cloud.shadow_coefficient = vec![v; cloud.len()]),
    ];
    for (name, poison) in columns {
        for number in [1e-45, 1e-40, f32::MIN_POSITIVE, 1e-20] {
            let mut cloud = cloud(&[1e-2]);
            poison(&mut cloud, number);
            cloud.validate().unwrap();
            let (out, _) = draw(&cloud, 2.0, None);
            let numbers = out.optical_depth.iter().chain(&out.channels).flatten();
            assert!(numbers.into_iter().all(|v| v.is_finite()), "{name} {number:e}");
            assert!(out.channels[1].iter().any(|v| *v > 1e-4), "{name} {number:e}");
        }
    }
}

#[test]
fn x6_traces_of_light_are_darkness() {
    struct Never;
    impl Transmittance for Never {
        fn transmittance(&self, _: &Receiver) -> [f32; 3] {
            panic!("a trace of light has no shadow")
        }
    }
    let cloud = cloud(&[1e-2]);
    let (dark, _) = draw(&cloud, 0.0, Some(&Never));
    let (trace, _) = draw(&cloud, 1e-39, Some(&Never));
    assert_eq!(trace.channels, dark.channels);
    let (faint, _) = draw(&cloud, 1e3 * TRACE, None);
    assert!(faint.channels[0].iter().any(|v| *v > 0.0));
}
