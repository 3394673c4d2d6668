//! Shading on a device: the CPU's values, within a stated tolerance.

use gpu_conformance::{Device, open, words};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::gpu::Attributes;
use splat_core::raster::{Detail, Params, ProjectInput, project};
use splat_core::shade::gpu::{Capacities, received, record, suits};
use splat_core::shade::{ChannelLayout, LitBy, ShadeInput, shade};
use splat_core::{
    Camera, Cloud, Error, FootprintStack, LayerSet, Light, LightShape, Material, Object, Projection, Receiver, Shading,
    Splat, SplatKind, Transmittance, rng,
};

/// Most that a value may differ by, as a share of the largest that its light could give with its material: highlights of
/// exponent 64 multiply a rounding by 64.
const TOLERANCE: f32 = 1e-5;

const VIEWS: [Projection; 2] = [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 3.0 }];

fn unit(i: u64, k: u64) -> f32 {
    rng::unit_f32(91, 0, i, k)
}

/// Splats with a normal or without, of all materials.
fn cloud(n: u64, origin: DVec3, shading: bool) -> Cloud {
    let mut cloud = Cloud::new(origin);
    for i in 0..n {
        let position = Vec3::new(3.0 * unit(i, 0) - 1.5, 2.0 * unit(i, 1) - 1.0, 2.0 * unit(i, 2) - 1.0);
        let kind = [SplatKind::Medium, SplatKind::Surface, SplatKind::Medium][(i % 3) as usize];
        let turn = std::f32::consts::TAU * unit(i, 3);
        let normal = Vec3::new(turn.cos(), turn.sin(), 2.0 * unit(i, 4) - 1.0).normalize();
        cloud.push(&Splat {
            position,
            normal: if i % 3 == 0 { Vec3::ZERO } else { normal },
            // Light is reflected about another one.
            shading_normal: if shading && i % 4 == 1 { (normal + Vec3::X * 0.3).normalize() } else { Vec3::ZERO },
            radius: 0.02 + 0.1 * unit(i, 5),
            kind,
            color: [unit(i, 8), 0.7, 2.0 * unit(i, 9)],
            material: (i % 4) as u16,
            object: (i % 2) as u32,
            shadow_coefficient: unit(i, 10),
            ..Splat::default()
        });
    }
    cloud
}

/// As much as a position says.
struct Veil;

impl Transmittance for Veil {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let t = 0.5 + 0.5 * receiver.position.x.sin();
        [t, 0.9 * t, 0.5]
    }
}

fn materials() -> Vec<Material> {
    let plain = Material { shading: Shading::Unlit, emission: [0.1, 0.2, 0.3], ..Material::default() };
    let forward = Material { shading: Shading::Phase, asymmetry: 0.8, single_scattering_albedo: 0.7, ..plain };
    let glossy = Material { specular: 0.3, shininess: 64.0, transmission: 0.25, ambient: 0.5, ..Material::default() };
    vec![plain, forward, glossy, Material { specular: 0.1, shininess: 0.0, asymmetry: -0.4, ..glossy }]
}

fn lights(origin: DVec3) -> Vec<Light> {
    let position = origin + DVec3::new(0.3, 0.1, 0.2);
    let direction = DVec3::new(0.6, -0.8, 0.0);
    let spot = LightShape::Spot { position: origin + DVec3::new(-1.0, 2.0, 0.5), direction, inner: 0.3, outer: 0.6 };
    let intensity = [3.0, 2.0, 1.0];
    // One light within the cloud, one above that shines to one side, one that gives nothing.
    let patch =
        LightShape::Patch { position: origin + DVec3::new(0.9, 1.8, -0.3), normal: DVec3::new(-0.6, -0.8, 0.0) };
    vec![
        Light { shape: LightShape::Point { position }, intensity },
        Light { shape: LightShape::Directional { direction }, intensity },
        Light { shape: spot, intensity: [20.0; 3] },
        Light { shape: patch, intensity },
        Light { shape: LightShape::Point { position: origin + DVec3::Y * 3.0 }, intensity: [0.0; 3] },
    ]
}

const OBJECTS: [f32; 2] = [1.0, 0.5];

fn objects() -> Vec<Object> {
    let object = |shadow_coefficient| Object { shadow_coefficient, ..Object::default() };
    OBJECTS.map(object).to_vec()
}

fn on_device(device: &mut Device, input: &ShadeInput<'_>, layout: ChannelLayout) -> Vec<f32> {
    let attributes = Attributes::new(input.cloud, None).unwrap();
    let recorded = record(Capacities::for_input(input, attributes.room(), layout));
    let ids: Vec<u32> = (0..input.cloud.len() as u32).collect();
    let light = received(input, &ids, None).unwrap();
    let uploads = recorded.uploads(input, &attributes, &light).unwrap();
    let inputs = [&recorded.inputs(&uploads)[..], &attributes.inputs(&recorded.attributes)[..]].concat();
    let run = device.run(&recorded.recording, &inputs).unwrap();
    words(run.bytes(recorded.values)).into_iter().map(f32::from_bits).collect()
}

#[test]
fn values_are_the_cpu_s() {
    let mut device = open().unwrap();
    let materials = materials();
    let objects = objects();
    for (n, origin) in [(1, DVec3::ZERO), (9000, DVec3::ZERO), (3000, DVec3::new(1e7, -3e6, 5e6))] {
        let cloud = cloud(n, origin, n % 2 == 0);
        let lights = lights(origin);
        let veiled = |(k, light): (usize, &Light)| {
            let shadow = (k % 2 == 0).then_some(&Veil as &dyn Transmittance);
            LitBy { slide: None, light: *light, shadow }
        };
        let lit: Vec<LitBy<'_>> = lights.iter().enumerate().map(veiled).collect();
        for view in VIEWS {
            for set in [
                LayerSet::default(),
                LayerSet { effects: true, normal: true, shadow: true, ..LayerSet::default() },
                LayerSet { shadow: true, ..LayerSet::default() },
            ] {
                let eye = origin + DVec3::new(0.3, 0.2, 4.0);
                let camera = Camera::look_at(eye, origin, DVec3::Y, view, [150, 90]).unwrap();
                let ambient = [0.1, 0.2, 0.3];
                let camera = &camera;
                let input = ShadeInput {
                    cloud: &cloud,
                    materials: &materials,
                    objects: &objects,
                    lights: &lit,
                    ambient,
                    camera,
                };
                suits(&input).unwrap();
                let layout = ChannelLayout::new(&set);
                let projected = project(&ProjectInput {
                    cloud: &cloud,
                    camera,
                    footprints: &FootprintStack::default(),
                    materials: &materials,
                    params: &Params::default(),
                    detail: Detail::ALL,
                });
                let expected = shade(&input, &projected, &layout, None).unwrap();
                let found = on_device(&mut device, &input, layout);
                assert_eq!(found.len(), expected.len());
                let mut most = 0.0f32;
                let mut seen = 0;
                for (i, (a, b)) in expected.chunks(layout.count()).zip(found.chunks(layout.count())).enumerate() {
                    if !projected.is_visible(i) {
                        continue;
                    }
                    seen += 1;
                    let largest = a.iter().fold(1.0, |most: f32, v| most.max(v.abs()));
                    let far = a.iter().zip(b).map(|(a, b)| (a - b).abs() / largest).fold(0.0, f32::max);
                    assert!(far <= TOLERANCE, "{i} of {n} {view:?}: {far:e} {a:?} {b:?}");
                    most = most.max(far);
                }
                println!("{n} {view:?} {}: {most:e}", layout.count());
                assert!(seen > n / 2 && expected.iter().any(|v| *v > 0.05));
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn what_single_precision_does_not_resolve_is_said() {
    let cloud = cloud(4, DVec3::ZERO, false);
    let objects = objects();
    let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, VIEWS[0], [8, 8]).unwrap();
    let spot = |inner, outer| LightShape::Spot { position: DVec3::Y, direction: DVec3::NEG_Y, inner, outer };
    let asks = |shape, shininess| {
        let lights = [LitBy { slide: None, light: Light { shape, intensity: [1.0; 3] }, shadow: None }];
        let materials = vec![Material { specular: 0.1, shininess, ..Material::default() }; 4];
        let cloud = &cloud;
        let objects = &objects[..];
        let ambient = [0.0; 3];
        let input = ShadeInput { cloud, materials: &materials, objects, lights: &lights, ambient, camera: &camera };
        (
            suits(&input),
            Capacities::for_input(&input, Attributes::new(cloud, None).unwrap().room(), ChannelLayout::default()),
        )
    };
    assert_eq!(asks(spot(0.3, 0.6), 64.0).0, Ok(()));
    assert!(asks(spot(0.3, 0.3), 64.0).0.is_err() && asks(spot(0.3, 0.6), 65.0).0.is_err());
    // Room for one light does not hold two, nor light for none that casts shadows.
    let room = asks(spot(0.3, 0.6), 1.0).1;
    assert_eq!((room.lights, room.shadows, room.materials), (1, 0, 4));
    let attributes = Attributes::new(&cloud, None).unwrap();
    let lit = || LitBy { slide: None, light: Light { shape: spot(0.1, 0.5), intensity: [1.0; 3] }, shadow: None };
    let materials = vec![Material::default(); 4];
    let two = [lit(), lit()];
    let input = ShadeInput {
        cloud: &cloud,
        materials: &materials,
        objects: &objects,
        lights: &two,
        ambient: [0.0; 3],
        camera: &camera,
    };
    assert!(matches!(record(room).uploads(&input, &attributes, &[]), Err(Error::Overflow(_))));
    let input = ShadeInput { lights: &two[..1], ..input };
    record(room).uploads(&input, &attributes, &[]).unwrap();
    assert!(matches!(record(room).uploads(&input, &attributes, &[[1.0; 3]]), Err(Error::ColumnLength { .. })));
}
