//! Particles that are lit, in the light that shadow maps let through: the CPU's ensemble, within a stated tolerance.

use gpu_conformance::{Device, open};
use pbsr::gpu::{Capacities, Lighting, Nearest, ShadowOf, Sources, record, record_generated};
use pbsr::{
    Appearance, Ensemble, EnsembleParams, Error, FoldParams, GridSampler, LitBy, MeshSampler, Object, Renderer,
    Sampler, Scene, SurfaceParams, VolumeParams, finest_pixel_area,
};
use splat_core::glam::{DMat3, DQuat, DVec3, Vec3};
use splat_core::{
    Camera, Cloud, Grid, Light, LightShape, Material, Mesh, Projection, Shading, Similarity, Splat, SplatKind,
    TransferFunction, TransferPoint, Transmittance, rng,
};
use splat_shaders::Overflow;
use tsm::gpu::{Room, record_received};
use tsm::{Params, Resolution, ShadowMap};

const SIZE: [u32; 2] = [120, 80];
const ROOM: Capacities = Capacities { size: SIZE, objects: 3, levels: 3, of_set: 66_000, particles: 198_000 };
const VIEWS: [Projection; 2] = [Projection::Perspective { fov_y: 0.6 }, Projection::Orthographic { height: 2.6 }];

/// Most that the mean of a pixel may differ by, as a share of the brightest one: what shading promises, and what look-ups do
/// where places are some units in the last place apart, which maps of steep steps multiply.
const TOLERANCE: f32 = 3e-5;
/// Share of pixels that may differ by more: those whose hits do, and where a step of a map lies within rounding of what is seen.
const OTHERS: f64 = 1e-3;

/// A bent sheet with normals, a wall, a volume, and what throws shadows on them.
struct World {
    origin: DVec3,
    sheet: Mesh,
    wall: Mesh,
    grid: Grid,
    transfer: TransferFunction,
    casters: Cloud,
}

impl World {
    fn new(origin: DVec3) -> Self {
        let mut sheet = Mesh { origin: origin + DVec3::new(0.1, 0.0, 0.3), ..Mesh::default() };
        let n = 32u32;
        for k in 0..(n + 1) * (n + 1) {
            let [u, v] = [k % (n + 1), k / (n + 1)].map(|i| i as f32 / n as f32 * 2.0 - 1.0);
            sheet.position.push(Vec3::new(u, 0.8 * v, 0.3 * (3.0 * u).sin() * (2.0 * v).cos()));
            sheet.normal.push(Vec3::new(-0.9 * (3.0 * u).cos() * (2.0 * v).cos(), 0.6 * v, 1.0).normalize());
            sheet.color.push([0.5 + 0.5 * u, 0.5 + 0.4 * v, 0.3]);
        }
        for k in (0..n * n).map(|k| k / n * (n + 1) + k % n) {
            sheet.triangles.extend([[k, k + 1, k + n + 1], [k + 1, k + n + 2, k + n + 1]]);
        }
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let position = corners.map(|(x, y)| Vec3::new(1.3 * x, 0.9 * y, -0.7 + 0.1 * x)).to_vec();
        let wall = Mesh { origin, position, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        let axes = DMat3::from_cols(DVec3::X / 9.0, DVec3::new(0.01, 0.1, 0.0), DVec3::new(0.0, 0.02, 0.11));
        let value = |i: usize| 1.0 - 0.004 * (i % 21) as f32 - 0.01 * (i / 21 % 18) as f32;
        let values = (0..21 * 18 * 16).map(value).collect();
        let grid = Grid { origin: origin + DVec3::new(-1.1, -0.9, -0.8), axes, dims: [21, 18, 16], values };
        let point = |value, color, extinction| TransferPoint { value, color, extinction };
        let transfer = TransferFunction::new(vec![point(0.0, [0.2, 0.1, 0.9], 0.1), point(1.0, [0.9, 0.8, 0.6], 0.6)]);
        let mut casters = Cloud::new(origin);
        for i in 0..600u64 {
            let u = |k| 2.0 * rng::unit_f32(77, 0, i, k) - 1.0;
            let kind = [SplatKind::Medium, SplatKind::Surface, SplatKind::Medium, SplatKind::Opaque][(i % 4) as usize];
            let normal = Vec3::new(u(3), u(4), u(5)).normalize_or(Vec3::Z);
            casters.push(&Splat {
                position: Vec3::new(1.4 * u(0), 0.9 + 0.4 * u(1), u(2)),
                radius: 0.12,
                cross_section: if kind == SplatKind::Opaque { 2e-3 } else { 8e-3 },
                kind,
                normal: if kind == SplatKind::Medium { Vec3::ZERO } else { normal },
                material: (i % 3 == 0).into(),
                ..Splat::default()
            });
        }
        Self { origin, sheet, wall, grid, transfer: transfer.unwrap(), casters }
    }

    fn camera(&self, view: Projection, size: [u32; 2]) -> Camera {
        let eye = self.origin + DVec3::new(0.4, 0.3, 4.0);
        Camera::look_at(eye, self.origin, DVec3::Y, view, size).unwrap()
    }

    /// A lamp with a map, parallel light with another, and a lamp without.
    fn lights(&self) -> [Light; 3] {
        let at = |x, y, z| self.origin + DVec3::new(x, y, z);
        let direction = DVec3::new(0.2, -0.9, -0.3).normalize();
        [
            Light { shape: LightShape::Point { position: at(0.4, 2.2, 1.0) }, intensity: [6.0, 5.0, 4.0] },
            Light { shape: LightShape::Directional { direction }, intensity: [0.9, 1.0, 1.2] },
            Light { shape: LightShape::Point { position: at(-1.5, -0.5, 2.0) }, intensity: [1.0; 3] },
        ]
    }

    /// The maps of the first two, of the second by channel.
    fn maps(&self) -> [ShadowMap; 2] {
        let [lamp, beam, _] = self.lights();
        let params = Params { resolution: Resolution::Cells(48), ..Params::default() };
        let build = |light, extinction_rgb| {
            let tinted = Material { extinction_rgb, ..Material::default() };
            let materials = [Material::default(), tinted];
            ShadowMap::build(
                &tsm::Scene { cloud: &self.casters, materials: &materials, objects: &[] },
                light,
                &params,
                None,
            )
            .unwrap()
        };
        [build(&lamp, [1.0; 3]), build(&beam, [1.0, 0.4, 0.1])]
    }

    /// A glossy sheet, a lit or plain wall, a medium; `scale` of the area that no particle needs to be widened for.
    fn with<T>(&self, view: Projection, scale: f64, plain: bool, work: impl FnOnce(&[Object<'_>], &Camera) -> T) -> T {
        let camera = self.camera(view, SIZE);
        let s = scale * finest_pixel_area(&camera, self.origin, 1.5, 1e-3);
        let surface =
            |opacity, seed, color| SurfaceParams { opacity, cross_section: s, seed, color, ..SurfaceParams::default() };
        let sheet = MeshSampler::new(&self.sheet, &surface(0.5, 1, [1.0, 0.8, 0.6]), None).unwrap();
        let wall = MeshSampler::new(&self.wall, &surface(0.8, 2, [0.9, 0.4, 0.1]), None).unwrap();
        let fog = VolumeParams { cross_section: s, extinction_scale: 1.0, normals: false, seed: 3 };
        let fog = GridSampler::new(&self.grid, &self.transfer, &fog, None).unwrap();
        let glossy = Material { specular: 0.3, shininess: 20.0, transmission: 0.3, ..Material::default() };
        let shading = if plain { Shading::Unlit } else { Shading::Phong };
        let hung = Material { shading, emission: [0.05, 0.0, 0.1], ..Material::default() };
        let forward = Material { shading: Shading::Phase, asymmetry: 0.6, ..Material::default() };
        let object = |sampler, turn, kind, material, radius, shadow_coefficient| Object {
            sampler,
            transform: Similarity { rotation: DQuat::from_rotation_z(turn), ..Similarity::default() },
            // Twice the colours of its particles.
            look: Appearance { material, kind, radius, shadow_coefficient, color_unit: 2.0 },
        };
        // An object turns around the world's origin: one far away stays as it is.
        let turn = if self.origin == DVec3::ZERO { 0.2 } else { 0.0 };
        let objects = [
            object(&sheet as &dyn Sampler, turn, SplatKind::Surface, glossy, 0.05, 1.0),
            object(&wall, 0.0, SplatKind::Surface, hung, 0.03, 0.5),
            object(&fog, 0.0, SplatKind::Medium, forward, 0.1, 0.8),
        ];
        work(&objects, &camera)
    }
}

/// What is kept, and how the sets come about.
#[derive(Clone, Copy)]
struct Way {
    params: EnsembleParams,
    nearest: Nearest,
    made: bool,
}

/// Folds two runs on the device; the first begins where `begun` ends.
fn by_device(
    device: &mut Device,
    scene: &Scene<'_>,
    maps: &[(&ShadowMap, DVec3)],
    way: Way,
    room: Capacities,
) -> Ensemble {
    let seen = room.seen();
    let mut ensemble = Ensemble::new(room.size, &way.params).unwrap();
    let rooms = maps.iter().map(|(map, _)| Room::for_map(map, seen.splats).unwrap());
    let recorded: Vec<_> = (0..).zip(rooms).map(|(light, room)| record_received(room, seen, light)).collect();
    let shadows: Vec<_> = recorded
        .iter()
        .map(|s| ShadowOf {
            recording: &s.recording,
            attributes: &s.attributes,
            shares: s.shares,
            received: s.received,
        })
        .collect();
    let lighting = Lighting { params: way.params, lights: scene.lights.len() as u32, shadows: &shadows };
    let eye = scene.camera.position;
    let uploads: Vec<_> =
        recorded.iter().zip(maps).map(|(s, (map, origin))| s.uploads(map, eye, *origin, &[]).unwrap()).collect();
    let each = || recorded.iter().zip(&uploads).enumerate();
    if way.made {
        let sources = Sources::new(scene).unwrap();
        let generated = record_generated(room, way.nearest, Some(&lighting), &sources).unwrap();
        let mut ready = device.prepare(&generated.recording).unwrap();
        let mut inputs = generated.tables(&sources, scene, &ensemble).unwrap();
        each().for_each(|(k, (s, map))| inputs.extend(generated.shadow_inputs(k, s.inputs(map))));
        for _ in 0..2 {
            inputs.extend(generated.next(&sources, scene, &ensemble).unwrap());
            let given: Vec<_> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
            generated.add(&ready.run(&given).unwrap(), &mut ensemble).unwrap();
            inputs.clear();
        }
    } else {
        let recorded = record(room, way.nearest, Some(&lighting)).unwrap();
        let mut ready = device.prepare(&recorded.recording).unwrap();
        let mut inputs = recorded.tables(scene).unwrap();
        each().for_each(|(k, (s, map))| inputs.extend(recorded.shadow_inputs(k, s.inputs(map))));
        for _ in 0..2 {
            let uploads = recorded.uploads(scene, &ensemble).unwrap();
            let mut given = inputs.clone();
            given.extend(recorded.inputs(&uploads));
            let given: Vec<_> = given.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
            let run = ready.run(&given).unwrap();
            recorded.add(run.bytes(recorded.sums), &mut ensemble).unwrap();
            inputs.clear();
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
    ensemble
}

fn by_processor(scene: &Scene<'_>, params: EnsembleParams, levels: u32) -> Ensemble {
    let mut ensemble = Ensemble::new(scene.camera.size, &params).unwrap();
    Renderer::new().fold(scene, &mut ensemble, &FoldParams { levels, ..FoldParams::default() }, None).unwrap();
    ensemble
}

/// Share of pixels whose hits agree, share of those whose means of all layers do, and the brightest mean.
fn agreement(a: &Ensemble, b: &Ensemble) -> (f64, f64, f32) {
    let [width, height] = a.size();
    let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let same = |&(x, y): &(u32, u32)| a.hits(x, y) == b.hits(x, y);
    let [one, other] = [a, b].map(|e| e.read(&|_, _| [0.0; 3], None));
    let names: Vec<&str> = ["beauty", "ambient", "emission", "direct", "scatter1", "normal"]
        .into_iter()
        .filter(|n| one.rgb(n).is_some())
        .collect();
    let brightest = one.rgb("beauty").unwrap().as_flattened().iter().fold(0.0f32, |a, b| a.max(*b));
    let far = |k: usize| {
        let of_rgb = names.iter().map(|name| {
            let [a, b] = [&one, &other].map(|layers| layers.rgb(name).unwrap()[k]);
            (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
        });
        let of_shadow = one.scalar("shadow").zip(other.scalar("shadow")).map(|(a, b)| (a[k] - b[k]).abs());
        of_rgb.chain(of_shadow).fold(0.0, f32::max)
    };
    let near = (0..(width * height) as usize).filter(|k| far(*k) <= TOLERANCE * brightest.max(1.0)).count();
    let pixel_count = f64::from(width * height);
    (pixels().filter(same).count() as f64 / pixel_count, near as f64 / pixel_count, brightest)
}

const ALL: EnsembleParams = EnsembleParams {
    effects: true,
    normal: true,
    shadow: true,
    depth_range: None,
    object: false,
    colored_extinction: false,
    radiance_unit: 0.5,
};

/// The two lights with maps, and the one without.
fn lit<'a>(lights: &[Light; 3], maps: &'a [ShadowMap; 2]) -> Vec<LitBy<'a>> {
    let shadow = |k: usize| maps.get(k).map(|map| map as &dyn Transmittance);
    lights.iter().enumerate().map(|(k, light)| LitBy { slide: None, light: *light, shadow: shadow(k) }).collect()
}

/// Whether every access of a kernel is looked at: that takes minutes, and few sets show all accesses.
fn assisted() -> bool {
    std::env::var("ORGANZA_VALIDATION").is_ok_and(|v| v == "gpu-assisted")
}

#[test]
fn ambient_light_alone_and_lights_without_maps() {
    let mut device = open().unwrap();
    let world = World::new(DVec3::ZERO);
    let lights = world.lights().map(|light| LitBy { slide: None, light, shadow: None });
    for lights in [&lights[..0], &lights[..]] {
        world.with(VIEWS[0], 0.7, false, |objects, camera| {
            let scene =
                Scene { objects, lights, shadow_origin: DVec3::ZERO, ambient: [0.4, 0.5, 0.6], camera, occluder: None };
            let expected = by_processor(&scene, ALL, 2 * ROOM.levels);
            let way = Way { params: ALL, nearest: Nearest::for_adapter(device.adapter()), made: true };
            let (same, near, brightest) = agreement(&expected, &by_device(&mut device, &scene, &[], way, ROOM));
            assert!(
                same >= 1.0 - OTHERS && near >= 1.0 - 2.0 * OTHERS && brightest > 0.05,
                "{same} {near} {brightest}"
            );
        });
    }
}

#[test]
fn faults_of_light_are_found() {
    if assisted() {
        return;
    }
    let mut device = open().unwrap();
    let world = World::new(DVec3::ZERO);
    let lights = world.lights();
    let maps = world.maps();
    let lights = lit(&lights, &maps);
    let way = Way { params: EnsembleParams::default(), nearest: Nearest::for_adapter(device.adapter()), made: false };
    world.with(VIEWS[0], 0.7, false, |objects, camera| {
        let scene =
            Scene { objects, lights: &lights, shadow_origin: world.origin, ambient: [0.1; 3], camera, occluder: None };
        let expected = by_processor(&scene, way.params, 2 * ROOM.levels);
        let mut near = |scene: &Scene<'_>, maps: [(&ShadowMap, DVec3); 2]| {
            let (same, near, _) = agreement(&expected, &by_device(&mut device, scene, &maps, way, ROOM));
            assert!(same >= 1.0 - OTHERS, "{same}");
            near
        };
        let right = [(&maps[0], DVec3::ZERO), (&maps[1], DVec3::ZERO)];
        assert!(near(&scene, right) >= 1.0 - 2.0 * OTHERS);
        // Shares of shadows that are dropped, a radius, a map that lies elsewhere by a hundredth, or for another light.
        let mut others = objects.to_vec();
        others.iter_mut().for_each(|o| o.look.shadow_coefficient = 0.0);
        assert!(near(&Scene { objects: &others, ..scene }, right) < 0.95);
        others.clone_from_slice(objects);
        others.iter_mut().for_each(|o| o.look.radius *= 3.0);
        assert!(near(&Scene { objects: &others, ..scene }, right) < 0.95);
        assert!(near(&scene, [right[0], (&maps[1], DVec3::X * 0.01)]) < 0.95);
        assert!(near(&scene, [(&maps[0], DVec3::X * 0.01), right[1]]) < 0.95);
        let ambient = Scene { ambient: [0.101; 3], ..scene };
        assert!(near(&ambient, right) < 0.95);
    });
}

#[test]
fn widened_particles_are_lit_as_the_cpu_s_in_the_mean() {
    if assisted() {
        return;
    }
    let mut device = open().unwrap();
    let world = World::new(DVec3::ZERO);
    let lights = world.lights();
    let maps = world.maps();
    let lights = lit(&lights, &maps);
    let with_maps = [(&maps[0], DVec3::ZERO), (&maps[1], DVec3::ZERO)];
    world.with(VIEWS[0], 8.0, false, |objects, camera| {
        let scene =
            Scene { objects, lights: &lights, shadow_origin: world.origin, ambient: [0.1; 3], camera, occluder: None };
        let expected = by_processor(&scene, EnsembleParams::default(), 2 * ROOM.levels);
        let way =
            Way { params: EnsembleParams::default(), nearest: Nearest::for_adapter(device.adapter()), made: false };
        let found = by_device(&mut device, &scene, &with_maps, way, ROOM);
        // Places within pixels are others, by chance: pixels differ, their mean does not.
        let (same, near, _) = agreement(&expected, &found);
        let sum = |e: &Ensemble| -> f64 {
            e.read(&|_, _| [0.0; 3], None).rgb("beauty").unwrap().iter().map(|p| f64::from(p[1])).sum()
        };
        let ratio = sum(&found) / sum(&expected);
        assert!(same >= 1.0 - OTHERS && near < 0.9 && (ratio - 1.0).abs() < 1e-3, "{same} {near} {ratio}");
    });
}

#[test]
fn too_little_room_and_other_lights_are_refused() {
    let mut device = open().unwrap();
    let world = World::new(DVec3::ZERO);
    world.with(VIEWS[0], 0.7, false, |objects, camera| {
        let lights = world.lights().map(|light| LitBy { slide: None, light, shadow: None });
        let scene =
            Scene { objects, lights: &lights, shadow_origin: world.origin, ambient: [0.1; 3], camera, occluder: None };
        let sources = Sources::new(&scene).unwrap();
        let mut ensemble = Ensemble::new(SIZE, &ALL).unwrap();
        let lighting = Lighting { params: ALL, lights: 3, shadows: &[] };
        let room = Capacities { of_set: 10, ..ROOM };
        let generated =
            record_generated(room, Nearest::for_adapter(device.adapter()), Some(&lighting), &sources).unwrap();
        let mut inputs = generated.tables(&sources, &scene, &ensemble).unwrap();
        inputs.extend(generated.next(&sources, &scene, &ensemble).unwrap());
        let inputs: Vec<_> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
        let run = device.run(&generated.recording, &inputs).unwrap();
        // Nothing is folded of what is incomplete.
        assert!(run.bytes(generated.sums).iter().all(|byte| *byte == 0));
        assert!(matches!(generated.add(&run, &mut ensemble), Err(Error::Overflow(Overflow { had: 10, .. }))));
        assert_eq!((ensemble.levels(), device.take_messages()), (0, Vec::new()));
        let refused = |lighting: Lighting<'_>| {
            let recorded = record(ROOM, Nearest::Ranked, Some(&lighting))?;
            recorded.tables(&scene)?;
            recorded.uploads(&scene, &ensemble).map(drop)
        };
        let parameter = |lighting| match refused(lighting) {
            Err(Error::Parameter { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        assert!(refused(lighting).is_ok());
        assert_eq!(parameter(Lighting { lights: 2, ..lighting }), "lights");
        assert_eq!(parameter(Lighting { params: EnsembleParams::default(), ..lighting }), "ensemble");
        let depths = EnsembleParams { depth_range: Some([1.0, 2.0]), ..ALL };
        assert_eq!(parameter(Lighting { params: depths, ..lighting }), "ensemble");
        let few = record(Capacities { objects: 2, ..ROOM }, Nearest::Ranked, Some(&lighting)).unwrap();
        assert!(few.tables(&scene).is_err() && few.uploads(&scene, &ensemble).is_err());
        let sharp = Material { specular: 0.1, shininess: 65.0, ..Material::default() };
        let mut others = objects.to_vec();
        others[0].look.material = sharp;
        let sharp = Scene { objects: &others, ..scene };
        assert!(pbsr::gpu::suits(&scene).is_ok() && pbsr::gpu::suits(&sharp).is_err());
    });
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn a_large_image_goes_in_parts() {
        if assisted() {
            return;
        }
        let mut device = open().unwrap();
        let world = World::new(DVec3::ZERO);
        // 22 × 13 tiles: more pixels than are lit at once.
        let size = [1400, 800];
        let room = Capacities { size, levels: 1, ..ROOM };
        let pixels = 22 * 13 * 4096;
        assert!(room.seen().splats < pixels && room.seen().splats.is_multiple_of(256));
        let lights = world.lights();
        let maps = world.maps();
        let lights = lit(&lights, &maps);
        let camera = world.camera(VIEWS[0], size);
        // Sets for a smaller picture: sparse in this one, in all parts.
        world.with(VIEWS[0], 1.0, true, |objects, small| {
            let s =
                finest_pixel_area(small, DVec3::ZERO, 1.5, 1e-3) / finest_pixel_area(&camera, DVec3::ZERO, 1.5, 1e-3);
            assert!(s > 50.0, "{s}");
            let scene = Scene {
                objects,
                lights: &lights,
                shadow_origin: world.origin,
                ambient: [0.1; 3],
                camera: &camera,
                occluder: None,
            };
            let expected = by_processor(&scene, EnsembleParams::default(), 2);
            for nearest in ways(&device) {
                let way = Way { params: EnsembleParams::default(), nearest, made: true };
                let found =
                    by_device(&mut device, &scene, &[(&maps[0], DVec3::ZERO), (&maps[1], DVec3::ZERO)], way, room);
                let sum = |e: &Ensemble| -> f64 {
                    e.read(&|_, _| [0.0; 3], None).rgb("beauty").unwrap().iter().map(|p| f64::from(p[1])).sum()
                };
                let (same, ..) = agreement(&expected, &found);
                let ratio = sum(&found) / sum(&expected);
                assert!(same >= 1.0 - OTHERS && (ratio - 1.0).abs() < 1e-3, "{same} {ratio}");
            }
        });
    }

    #[test]
    fn lit_sets_are_the_cpu_s() {
        let mut device = open().unwrap();
        for (origin, views) in [(DVec3::ZERO, &VIEWS[..]), (DVec3::new(1e7, -3e6, 5e6), &VIEWS[..1])] {
            let world = World::new(origin);
            let lights = world.lights();
            let maps = world.maps();
            let lights = lit(&lights, &maps);
            let with_maps = [(&maps[0], origin), (&maps[1], origin)];
            for (view, plain) in views.iter().zip([true, false]) {
                world.with(*view, 0.7, plain, |objects, camera| {
                    let ambient = [0.1, 0.2, 0.3];
                    let scene =
                        Scene { objects, lights: &lights, shadow_origin: origin, ambient, camera, occluder: None };
                    for params in [ALL, EnsembleParams::default()] {
                        let expected = by_processor(&scene, params, 2 * ROOM.levels);
                        for nearest in ways(&device) {
                            for made in [false, true] {
                                if assisted() && (params != ALL || made == (nearest == Nearest::Ranked) || !plain) {
                                    continue;
                                }
                                let way = Way { params, nearest, made };
                                let found = by_device(&mut device, &scene, &with_maps, way, ROOM);
                                let (same, near, brightest) = agreement(&expected, &found);
                                assert!(same >= 1.0 - OTHERS, "{view:?} {nearest:?} {made}: {same}");
                                assert!(near >= 1.0 - 2.0 * OTHERS, "{view:?} {nearest:?} {made}: {near}");
                                assert!(brightest > 0.2, "{brightest}");
                            }
                        }
                    }
                });
            }
        }
    }

    fn ways(device: &Device) -> Vec<Nearest> {
        let best = Nearest::for_adapter(device.adapter());
        if best == Nearest::Wide { vec![Nearest::Ranked, best] } else { vec![best] }
    }
}
