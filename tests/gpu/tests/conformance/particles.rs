//! The ensemble of uploaded particles on a device: the CPU's sums.

use gpu_conformance::open;
use pbsr::gpu::{Capacities, Nearest, record};
use pbsr::{
    Appearance, Ensemble, EnsembleParams, Error, FoldParams, MeshSampler, Object, Renderer, Sampler, Scene,
    SurfaceParams, pixel_area,
};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::raster::OpaqueImage;
use splat_core::{Camera, Material, Mesh, Progress, Projection, Shading, Similarity};
use splat_shaders::Overflow;

const SIZE: [u32; 2] = [150, 90];
const ROOM: Capacities = Capacities { size: SIZE, objects: 2, levels: 3, of_set: 200_000, particles: 600_000 };

/// A square in the plane z.
fn wall(side: f32, z: f32) -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let position = corners.map(|(x, y)| Vec3::new(side * x, side * y, z)).to_vec();
    Mesh { position, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

fn object(sampler: &dyn Sampler, turn: f64, emission: [f32; 3]) -> Object<'_> {
    let material = Material { shading: Shading::Unlit, emission, ..Material::default() };
    let transform = Similarity { rotation: DQuat::from_rotation_y(turn), ..Similarity::default() };
    Object { sampler, transform, look: Appearance { material, ..Appearance::default() } }
}

/// Folds three sets on the CPU and three on the device; the first begins where the other ends, then both again. Whatever way
/// the device finds the nearest, sums are the same.
fn both(scene: &Scene<'_>) -> [Ensemble; 2] {
    let mut device = open().unwrap();
    let mut ways = vec![Nearest::Ranked];
    ways.extend((Nearest::for_adapter(device.adapter()) == Nearest::Wide).then_some(Nearest::Wide));
    let empty = Ensemble::new(SIZE, &EnsembleParams { radiance_unit: 0.5, ..EnsembleParams::default() }).unwrap();
    let mut cpu = empty.clone();
    let mut gpu = empty;
    let params = FoldParams::default();
    let progress = Progress::default();
    Renderer::new().fold(scene, &mut cpu, &FoldParams { levels: 2 * ROOM.levels, ..params }, Some(&progress)).unwrap();
    let empty = gpu.clone();
    for way in ways {
        let recorded = record(ROOM, way, None).unwrap();
        let mut prepared = device.prepare(&recorded.recording).unwrap();
        let mut sums = empty.clone();
        for _ in 0..2 {
            let uploads = recorded.uploads(scene, &sums).unwrap();
            let inputs = recorded.inputs(&uploads);
            let inputs: Vec<_> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
            let run = prepared.run(&inputs).unwrap();
            recorded.add(run.bytes(recorded.sums), &mut sums).unwrap();
        }
        assert!(gpu == empty || gpu == sums, "{way:?} finds others");
        gpu = sums;
    }
    assert_eq!(device.take_messages(), [""; 0]);
    assert_eq!((cpu.levels(), gpu.levels()), (2 * ROOM.levels, 2 * ROOM.levels));
    [cpu, gpu]
}

fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)))
}

/// Share of pixels whose hits agree, and hits in all.
fn agreement([cpu, gpu]: &[Ensemble; 2]) -> (f64, u64) {
    let same = pixels().filter(|&(x, y)| cpu.hits(x, y) == gpu.hits(x, y)).count();
    let hits = pixels().map(|(x, y)| u64::from(cpu.hits(x, y))).sum();
    (same as f64 / f64::from(SIZE[0] * SIZE[1]), hits)
}

/// The widest difference of a channel between the two pictures.
fn difference([cpu, gpu]: &[Ensemble; 2]) -> f32 {
    let [a, b] = [cpu, gpu].map(|e| e.read(&|_, _| [0.1, 0.2, 0.3], None));
    let a = a.rgb("beauty").unwrap();
    let b = b.rgb("beauty").unwrap();
    a.iter().zip(b).flat_map(|(a, b)| (0..3).map(move |c| (a[c] - b[c]).abs())).fold(0.0, f32::max)
}

#[test]
fn hits_and_sums_are_the_cpu_s() {
    let near = wall(0.7, 0.8);
    let far = wall(1.5, -0.5);
    for (projection, opacity) in [
        (Projection::Perspective { fov_y: 0.7 }, SurfaceOpacity::PerCrossing),
        (Projection::Perspective { fov_y: 0.7 }, SurfaceOpacity::ThinSlab),
        (Projection::Orthographic { height: 2.4 }, SurfaceOpacity::PerCrossing),
    ] {
        let camera = Camera::look_at(DVec3::new(0.3, 0.2, 4.0), DVec3::ZERO, DVec3::Y, projection, SIZE).unwrap();
        // Seen from nearer than made for, particles are widened; from farther, thinned out.
        let middle = pixel_area(&camera, camera.position + 4.0 * camera.axes[2]);
        let params = |s: f64, seed, color| SurfaceParams {
            opacity: 0.4,
            cross_section: s * middle,
            surface_opacity: opacity,
            color,
            seed,
            ..SurfaceParams::default()
        };
        let a = MeshSampler::new(&near, &params(3.0, 1, [0.9, 0.4, 0.1]), None).unwrap();
        let b = MeshSampler::new(&far, &params(0.5, 2, [0.1, 0.5, 2.0]), None).unwrap();
        let objects = [object(&a, 0.5, [0.0, 0.25, 0.0]), object(&b, -0.3, [0.0; 3])];
        let scene = Scene {
            objects: &objects,
            lights: &[],
            shadow_origin: DVec3::ZERO,
            ambient: [0.0; 3],
            camera: &camera,
            occluder: None,
        };
        let ensembles = both(&scene);
        let (same, hits) = agreement(&ensembles);
        assert!(hits > 10_000 && same >= 0.999, "{projection:?}: {same} of {hits} hits");
        assert!(difference(&ensembles) < 1e-6 || same < 1.0, "{}", difference(&ensembles));
    }
}

#[test]
fn what_hides_particles_hides_them_and_its_own_depth_is_the_surface_s() {
    let mesh = wall(1.5, 0.0);
    let view = Projection::Orthographic { height: 2.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, SIZE).unwrap();
    let params =
        SurfaceParams { opacity: 0.9, cross_section: pixel_area(&camera, DVec3::Z), ..SurfaceParams::default() };
    let sampler = MeshSampler::new(&mesh, &params, None).unwrap();
    let objects = [object(&sampler, 0.0, [0.0; 3])];
    // All particles are at depth 4: behind, at, and before what hides.
    let depth = pixels().map(|(x, _)| [3.5, 4.0, 4.5, f32::INFINITY][x as usize % 4]).collect();
    let channels = vec![vec![1.0; (SIZE[0] * SIZE[1]) as usize]; 3];
    let occluder = OpaqueImage { depth, channels, ..OpaqueImage::default() };
    let scene = Scene {
        objects: &objects,
        lights: &[],
        shadow_origin: DVec3::ZERO,
        ambient: [0.0; 3],
        camera: &camera,
        occluder: Some(&occluder),
    };
    let [cpu, gpu] = both(&scene);
    assert_eq!(agreement(&[cpu, gpu.clone()]).0, 1.0);
    assert!(pixels().all(|(x, y)| x % 4 > 1 || gpu.hits(x, y) == 0));
    assert!(pixels().filter(|&(x, y)| gpu.hits(x, y) > 0).count() > 6000);
}

#[test]
fn pb16_equals_share_a_pixel_fairly() {
    // Two surfaces in one place, one white, one black: what is seen must be grey, whatever the order of the objects.
    let mesh = wall(1.5, 0.0);
    let view = Projection::Orthographic { height: 2.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, SIZE).unwrap();
    let s = pixel_area(&camera, DVec3::Z);
    let params =
        |color, seed| SurfaceParams { opacity: 0.9, cross_section: s, color, seed, ..SurfaceParams::default() };
    let white = MeshSampler::new(&mesh, &params([1.0; 3], 1), None).unwrap();
    let black = MeshSampler::new(&mesh, &params([0.0; 3], 2), None).unwrap();
    let objects = [object(&white, 0.0, [0.0; 3]), object(&black, 0.0, [0.0; 3])];
    let scene = Scene {
        objects: &objects,
        lights: &[],
        shadow_origin: DVec3::ZERO,
        ambient: [0.0; 3],
        camera: &camera,
        occluder: None,
    };
    let [_, gpu] = both(&scene);
    let layers = gpu.read(&|_, _| [0.0; 3], None);
    let hits: f64 = pixels().map(|(x, y)| f64::from(gpu.hits(x, y))).sum();
    let seen: f64 = layers.rgb("beauty").unwrap().iter().map(|p| f64::from(p[0])).sum();
    let share = seen * f64::from(gpu.levels()) / hits;
    // 5 standard deviations of a fair coin.
    assert!((share - 0.5).abs() < 2.5 / hits.sqrt(), "{share} of {hits}");
}

#[test]
fn too_little_room_is_refused_with_what_is_needed() {
    let mesh = wall(1.0, 0.0);
    let view = Projection::Orthographic { height: 2.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, SIZE).unwrap();
    let params = SurfaceParams { opacity: 0.5, cross_section: 1e-3, ..SurfaceParams::default() };
    let sampler = MeshSampler::new(&mesh, &params, None).unwrap();
    let objects = [object(&sampler, 0.0, [0.0; 3])];
    let scene = Scene {
        objects: &objects,
        lights: &[],
        shadow_origin: DVec3::ZERO,
        ambient: [0.0; 3],
        camera: &camera,
        occluder: None,
    };
    let ensemble = Ensemble::new(SIZE, &EnsembleParams::default()).unwrap();
    let uploads = |room| record(room, Nearest::Ranked, None).unwrap().uploads(&scene, &ensemble);
    let Err(Error::Overflow(Overflow { what: "particles of one set", needed, had: 10, .. })) =
        uploads(Capacities { of_set: 10, ..ROOM })
    else {
        panic!("room for 10 particles is enough")
    };
    assert!(needed > 1000, "{needed}");
    assert!(uploads(Capacities { of_set: 2 * needed as u32, ..ROOM }).is_ok());
    assert!(matches!(
        uploads(Capacities { objects: 0, ..ROOM }),
        Err(Error::Overflow(Overflow { what: "objects", .. }))
    ));
    let lit = Object { look: Appearance::default(), ..objects[0] };
    let lit = Scene { objects: &[lit], ..scene };
    assert!(matches!(
        record(ROOM, Nearest::Ranked, None).unwrap().uploads(&lit, &ensemble),
        Err(Error::Parameter { name: "scene", .. })
    ));
}
