//! Opaque surfaces at their silhouette: closed ones have no dark rim, open ones show their back.

use glam::{DVec3, Vec3};
use splat_core::raster::{Detail, OpaqueImage, OpaqueInput, Params, ProjectInput, project, resolve_opaque};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade};
use splat_core::{
    Camera, Cloud, Footprint, FootprintStack, LayerSet, Light, LightShape, Material, Object, Projection, Splat,
    SplatKind,
};
use std::f64::consts::PI;

const SIZE: u32 = 160;
const SPLATS: u32 = 8000;

/// Opaque discs on the unit sphere, normals outwards times `side`.
fn ball(side: f32) -> Cloud {
    let area = 4.0 * PI / f64::from(SPLATS);
    let radius = Footprint::default().radius_for_spacing(area.sqrt() as f32);
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..SPLATS {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(SPLATS);
        let (sin, cos) = (f64::from(i) * PI * (3.0 - 5.0f64.sqrt())).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let at = Vec3::new((cos * across) as f32, (sin * across) as f32, z as f32);
        let kind = SplatKind::Opaque;
        let normal = at.normalize() * side;
        cloud.push(&Splat { position: at, radius, cross_section: area as f32, kind, normal, ..Splat::default() });
    }
    cloud
}

/// The ball in parallel rays along −z, 2.5 high, lit along −`to_light` with radiance 1 at right angles.
fn picture(cloud: &Cloud, to_light: DVec3) -> OpaqueImage {
    let camera =
        Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, Projection::Orthographic { height: 2.5 }, [SIZE, SIZE]);
    let camera = camera.unwrap();
    let materials = [Material::default()];
    let footprints = FootprintStack::default();
    let object = Object { name: "ball".into(), casts_shadow: false, shadow_coefficient: 0.0 };
    let projected = project(&ProjectInput {
        cloud,
        camera: &camera,
        footprints: &footprints,
        materials: &materials,
        params: &Params::default(),
        detail: Detail::ALL,
    });
    let shape = LightShape::Directional { direction: -to_light };
    let light = Light { shape, intensity: [std::f32::consts::PI; 3] };
    let input = ShadeInput {
        cloud,
        materials: &materials,
        objects: &[object],
        lights: &[LitBy { slide: None, light, shadow: None }],
        ambient: [0.0; 3],
        camera: &camera,
    };
    let values = shade(&input, &projected, &ChannelLayout::new(&LayerSet::default()), None).unwrap();
    let ids: Vec<u32> = (0..cloud.len() as u32).collect();
    let input = OpaqueInput { projected: &projected, ids: &ids, values: &values, channels: 3, objects: false };
    resolve_opaque(&input, None).unwrap().0
}

/// Position of a pixel on the image plane.
fn plane(k: usize) -> (f64, f64) {
    let at = |v: usize| ((v as f64 + 0.5) / f64::from(SIZE) - 0.5) * 2.5;
    (at(k % SIZE as usize), -at(k / SIZE as usize))
}

#[test]
fn a_lit_closed_ball_has_no_dark_rim() {
    let to_light = DVec3::new(-0.5, 0.8, 0.3).normalize();
    let cloud = ball(1.0);
    let image = picture(&cloud, to_light);
    let blur = 2.0 * f64::from(cloud.radius[0]);
    let mut rim = 0;
    for (k, depth) in image.depth.iter().enumerate().filter(|(_, d)| d.is_finite()) {
        let (x, y) = plane(k);
        // At and beyond the silhouette the normal is that of the silhouette.
        let across = x.hypot(y);
        let normal = DVec3::new(x, y, (1.0 - across * across).max(0.0).sqrt()).normalize();
        let explained = normal.dot(to_light).max(0.0) - blur;
        rim += usize::from(across > 0.97 && explained > 0.5);
        assert!(f64::from(image.channels[0][k]) > explained, "{x} {y}, depth {depth}: {}", image.channels[0][k]);
    }
    assert!(rim > 100, "{rim} bright pixels at the rim");
}

#[test]
fn a_surface_that_faces_away_everywhere_is_lit_on_the_side_that_is_seen() {
    let to_light = DVec3::new(0.0, 0.0, 1.0);
    let front = picture(&ball(1.0), to_light);
    let back = picture(&ball(-1.0), to_light);
    let middle = (SIZE * SIZE / 2 + SIZE / 2) as usize;
    assert!((front.channels[0][middle] - 1.0).abs() < 0.01);
    assert!((front.channels[0][middle] - back.channels[0][middle]).abs() < 1e-5);
    assert!((front.depth[middle] - back.depth[middle]).abs() < 1e-5);
}
