//! Sets of particles that the device makes itself: the CPU's of the same seeds.

use gpu_conformance::{Device, open, words};
use pbsr::gpu::{Capacities, Nearest, Sources, record, record_generated};
use pbsr::{
    Appearance, Density, Ensemble, EnsembleParams, Error, FoldParams, GridSampler, KeptSets, LatticeSampler,
    MeshSampler, Object, Renderer, Sampler, Scene, SplatParams, SplatSampler, SurfaceParams, VolumeParams,
    finest_pixel_area,
};
use splat_core::glam::{DMat3, DQuat, DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{
    Camera, Cloud, Grid, Interpolation, Material, Mesh, Projection, Shading, Similarity, Splat, SplatKind,
    TransferFunction, TransferPoint, rng,
};
use splat_shaders::Overflow;
use std::collections::BTreeSet;

pub(crate) const SIZE: [u32; 2] = [96, 64];
pub(crate) const ROOM: Capacities =
    Capacities { size: SIZE, objects: 3, levels: 8, of_set: 40_000, particles: 320_000 };

/// Walls, a bent sheet with normals and colours, and a volume of more than one piece of its transfer function.
pub(crate) struct World {
    pub(crate) wall: Mesh,
    sheet: Mesh,
    grid: Grid,
    transfer: TransferFunction,
    pub(crate) cloud: Cloud,
    pub(crate) camera: Camera,
}

/// A ball of media and discs, round and long ones, of every kernel; a few of them opaque.
pub(crate) fn splats() -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(-0.1, 0.1, 0.2));
    for i in 0..3000u64 {
        let u = |k| rng::unit_f32(77, 0, i, k);
        let from_middle = Vec3::new(u(0) - 0.5, u(1) - 0.5, u(2) - 0.5) * 1.6;
        let normal = (from_middle + Vec3::splat(0.1)).normalize();
        let radius = 0.03 + 0.07 * u(3);
        let kind = match i % 16 {
            0 => SplatKind::Opaque,
            1..8 => SplatKind::Surface,
            _ => SplatKind::Medium,
        };
        let disc = kind != SplatKind::Medium;
        cloud.push(&Splat {
            position: from_middle,
            normal: if disc { normal } else { Vec3::ZERO },
            tangent: if disc && i % 3 == 0 { normal.any_orthonormal_vector() * radius * 1.7 } else { Vec3::ZERO },
            radius,
            cross_section: if kind == SplatKind::Opaque { 1e-4 } else { 2e-4 + 2e-3 * u(4) },
            color: [u(5), 0.6, 1.0 - u(5)],
            kind,
            footprint: (i % 3) as u8,
            ..Splat::default()
        });
    }
    cloud
}

impl World {
    pub(crate) fn new() -> Self {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let position = corners.map(|(x, y)| Vec3::new(1.3 * x, 0.9 * y, -0.7)).to_vec();
        let wall = Mesh { position, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        let mut sheet = Mesh { origin: DVec3::new(0.1, 0.0, 0.3), ..Mesh::default() };
        let n = 48u32;
        for k in 0..(n + 1) * (n + 1) {
            let [u, v] = [k % (n + 1), k / (n + 1)].map(|i| i as f32 / n as f32 * 2.0 - 1.0);
            let z = 0.3 * (3.0 * u).sin() * (2.0 * v).cos();
            sheet.position.push(Vec3::new(u, 0.8 * v, z));
            sheet.normal.push(Vec3::new(-0.9 * (3.0 * u).cos() * (2.0 * v).cos(), 0.6 * v, 1.0).normalize());
            sheet.color.push([0.5 + 0.5 * u, 0.5 + 0.4 * v, 0.3]);
        }
        for k in (0..n * n).map(|k| k / n * (n + 1) + k % n) {
            sheet.triangles.extend([[k, k + 1, k + n + 1], [k + 1, k + n + 2, k + n + 1]]);
        }
        let dims = [21usize, 18, 16];
        let value = |i: usize| {
            let [x, y, z] = [i % 21, i / 21 % 18, i / (21 * 18)].map(|i| i as f32 / 8.0 - 1.0);
            1.0 - (x * x + y * y + z * z) + 0.2 * (7.0 * x).sin()
        };
        let axes = DMat3::from_cols(DVec3::X / 9.0, DVec3::new(0.01, 0.1, 0.0), DVec3::new(0.0, 0.02, 0.11));
        let values = (0..dims.iter().product()).map(value).collect();
        let grid = Grid { origin: DVec3::new(-1.1, -0.9, -0.8), axes, dims, values };
        let point = |value, color, extinction| TransferPoint { value, color, extinction };
        let points = vec![
            point(0.0, [0.2, 0.1, 0.9], 0.0),
            point(0.35, [0.9, 0.8, 0.1], 1.5),
            point(0.5, [0.1, 0.9, 0.4], 0.2),
            point(0.9, [1.0, 0.2, 0.1], 3.0),
        ];
        let transfer = TransferFunction::new(points).unwrap();
        let view = Projection::Perspective { fov_y: 0.6 };
        let camera = Camera::look_at(DVec3::new(0.4, 0.3, 4.0), DVec3::ZERO, DVec3::Y, view, SIZE).unwrap();
        Self { wall, sheet, grid, transfer, cloud: splats(), camera }
    }

    /// The three samplers; `scale` of the area that no particle needs to be widened for, `bias` of their optical depths.
    pub(crate) fn samplers(
        &self,
        seed: u64,
        scale: f64,
        bias: f64,
    ) -> (MeshSampler<'_>, MeshSampler<'_>, GridSampler<'_>) {
        let s = scale * finest_pixel_area(&self.camera, DVec3::ZERO, 1.5, 1e-3);
        let params = |opacity: f64, surface_opacity, seed, color| SurfaceParams {
            opacity: 1.0 - (1.0 - opacity).powf(bias),
            cross_section: s,
            surface_opacity,
            color,
            seed,
            ..SurfaceParams::default()
        };
        let wall = params(0.4, SurfaceOpacity::ThinSlab, seed, [0.9, 0.4, 0.1]);
        let sheet = params(0.3, SurfaceOpacity::PerCrossing, seed + 1, [1.0, 0.8, 0.6]);
        let volume = VolumeParams { cross_section: s, extinction_scale: bias, normals: true, seed: seed + 2 };
        (
            MeshSampler::new(&self.wall, &wall, None).unwrap(),
            MeshSampler::new(&self.sheet, &sheet, None).unwrap(),
            GridSampler::new(&self.grid, &self.transfer, &volume, None).unwrap(),
        )
    }

    /// Of the surface that the volume's value makes.
    pub(crate) fn crossings(&self, seed: u64, scale: f64, bias: f64) -> LatticeSampler<'_> {
        let params = SurfaceParams {
            opacity: 1.0 - 0.6f64.powf(bias),
            cross_section: scale * finest_pixel_area(&self.camera, DVec3::ZERO, 1.5, 1e-3),
            surface_opacity: SurfaceOpacity::PerCrossing,
            color: [0.2, 0.7, 0.9],
            seed: seed + 3,
            ..SurfaceParams::default()
        };
        LatticeSampler::new(&self.grid, Interpolation::Trilinear, 0.4, &params).unwrap()
    }

    /// Of the cloud.
    pub(crate) fn splats(&self, seed: u64, scale: f64) -> SplatSampler<'_> {
        let params = SplatParams {
            cross_section: scale * finest_pixel_area(&self.camera, DVec3::ZERO, 1.5, 1e-3),
            seed: seed + 4,
            ..SplatParams::default()
        };
        SplatSampler::new(&self.cloud, &params).unwrap()
    }

    pub(crate) fn with<T>(&self, samplers: [&dyn Sampler; 3], work: impl FnOnce(&Scene<'_>) -> T) -> T {
        let object = |sampler, turn, emission| {
            let material = Material { shading: Shading::Unlit, emission, ..Material::default() };
            let transform = Similarity { rotation: DQuat::from_rotation_y(turn), ..Similarity::default() };
            Object { sampler, transform, look: Appearance { material, ..Appearance::default() } }
        };
        let [wall, sheet, volume] = samplers;
        let objects =
            [object(wall, 0.2, [0.0; 3]), object(sheet, -0.3, [0.0, 0.25, 0.0]), object(volume, 0.4, [0.0; 3])];
        let objects = &objects[..];
        let camera = &self.camera;
        let shadow_origin = DVec3::ZERO;
        work(&Scene { objects, lights: &[], shadow_origin, ambient: [0.0; 3], camera, occluder: None })
    }
}

pub(crate) fn empty() -> Ensemble {
    Ensemble::new(SIZE, &EnsembleParams::default()).unwrap()
}

/// Sets that the device makes and folds.
pub(crate) fn by_device(device: &mut Device, scene: &Scene<'_>, runs: u32) -> Ensemble {
    let sources = Sources::new(scene).unwrap();
    let mut ensemble = empty();
    let generated = record_generated(ROOM, Nearest::for_adapter(device.adapter()), None, &sources).unwrap();
    let mut prepared = device.prepare(&generated.recording).unwrap();
    let tables = generated.tables(&sources, scene, &ensemble).unwrap();
    for run in 0..runs {
        // Tables go up once.
        let mut inputs = if run == 0 { tables.clone() } else { Vec::new() };
        inputs.extend(generated.next(&sources, scene, &ensemble).unwrap());
        let inputs: Vec<_> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
        let done = prepared.run(&inputs).unwrap();
        let particles = generated.add(&done, &mut ensemble).unwrap();
        assert!(particles > 15_000, "{particles}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
    ensemble
}

pub(crate) fn by_processor(scene: &Scene<'_>, levels: u32) -> Ensemble {
    let mut ensemble = empty();
    Renderer::new().fold(scene, &mut ensemble, &FoldParams { levels, ..FoldParams::default() }, None).unwrap();
    ensemble
}

pub(crate) fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)))
}

/// Sets and particles of the first run, made by the device, with the states of its streams; and uploaded ones.
fn particles(device: &mut Device, scene: &Scene<'_>) -> ([[Vec<u32>; 2]; 2], Vec<u32>) {
    let sources = Sources::new(scene).unwrap();
    let mut generated = record_generated(ROOM, Nearest::for_adapter(device.adapter()), None, &sources).unwrap();
    let buffers = [generated.sets, generated.particles, generated.arrivals];
    buffers.iter().for_each(|buffer| generated.recording.read(*buffer));
    let mut inputs = generated.tables(&sources, scene, &empty()).unwrap();
    inputs.extend(generated.next(&sources, scene, &empty()).unwrap());
    let inputs: Vec<_> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
    let run = device.run(&generated.recording, &inputs).unwrap();
    assert_eq!(device.take_messages(), [""; 0]);
    let [sets, particles, arrivals] = buffers.map(|buffer| words(run.bytes(buffer)));
    let recorded = record(ROOM, Nearest::Ranked, None).unwrap();
    let uploads = recorded.uploads(scene, &empty()).unwrap();
    let inputs = recorded.inputs(&uploads);
    let [.., (_, of_sets), (_, of_particles)] = &inputs[..] else { panic!("five inputs") };
    ([[sets, particles], [words(of_sets), words(of_particles)]], arrivals)
}

/// What of a particle must be equal: its place, object and set in bits.
fn places([sets, particles]: &[Vec<u32>; 2]) -> BTreeSet<[u32; 5]> {
    let mut places = BTreeSet::new();
    for (set, span) in sets.chunks(3).enumerate() {
        let words = &particles[7 * span[0] as usize..][..7 * span[1] as usize];
        places.extend(words.chunks(7).map(|p| [set as u32, p[0], p[1], p[2], p[6]]));
    }
    places
}

#[test]
fn particles_of_one_seed_are_the_cpu_s() {
    let world = World::new();
    let (wall, sheet, volume) = world.samplers(11, 1.0, 1.0);
    let mut device = open().unwrap();
    are_alike(&mut device, &world, [&wall, &sheet, &volume]);
    are_alike(&mut device, &world, [&wall, &world.crossings(11, 1.0, 1.0), &volume]);
    are_alike(&mut device, &world, [&wall, &world.splats(11, 1.0), &volume]);
}

fn are_alike(device: &mut Device, world: &World, samplers: [&dyn Sampler; 3]) {
    let ([device, uploaded], _) = world.with(samplers, |scene| particles(device, scene));
    let [found, expected] = [places(&device), places(&uploaded)];
    let same = found.intersection(&expected).count() as f64;
    let both = found.union(&expected).count() as f64;
    assert!(expected.len() > 75_000 && same >= 0.9999 * both, "{same} of {both}");
    assert!((0..3).all(|object| expected.iter().any(|p| p[4] == object)));
    // Where no set has another number of particles, all stand in the same places: normals and colours are steps apart at
    // most, and thinning numbers equal.
    assert_eq!(device[0], uploaded[0], "sets");
    let count = expected.len();
    let differ = |w: usize| (0..count).filter(|i| device[1][7 * i + w] != uploaded[1][7 * i + w]).count();
    assert_eq!([differ(5), differ(6)], [0, 0]);
    let apart = [differ(3), differ(4)].map(|n| n as f64 / count as f64);
    assert!(apart.iter().all(|share| *share < 1e-3), "{apart:?}");
    let step = |a: u32, b: u32, at: u32, bits: u32| {
        ((a >> at) & ((1 << bits) - 1)).abs_diff((b >> at) & ((1 << bits) - 1)) <= 1
    };
    for i in 0..count {
        let [a, b] = [&device[1], &uploaded[1]].map(|words| (words[7 * i + 3], words[7 * i + 4]));
        assert!(a.0 >> 30 == b.0 >> 30 && [0, 15].iter().all(|at| step(a.0, b.0, *at, 15)), "normal {i}: {a:?} {b:?}");
        let close = a.1 >> 27 != b.1 >> 27 || [0, 9, 18].iter().all(|at| step(a.1, b.1, *at, 9));
        assert!(close, "colour {i}: {a:?} {b:?}");
    }
}

#[test]
fn streams_are_the_cpu_s_bit_for_bit() {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    const STAGES: [u64; 3] = [0x5042_0001, 0x5042_0001, 0x5042_0002];
    let world = World::new();
    let (wall, sheet, volume) = world.samplers(11, 1.0, 1.0);
    let samplers: [&dyn Sampler; 3] = [&wall, &sheet, &volume];
    let (_, arrivals) = world.with(samplers, |scene| particles(&mut open().unwrap(), scene));
    let mut arrivals = arrivals.chunks(3);
    let mut sum = 0.0;
    let mut mean = 0.0;
    for level in 0..u64::from(ROOM.levels) {
        for (k, sampler) in samplers.iter().enumerate() {
            for chunk in 0..sampler.chunks() {
                let &[count, low, high] = arrivals.next().unwrap() else { panic!("three words") };
                let begin = rng::bits(11 + k as u64, STAGES[k], level, chunk as u64);
                let state = u64::from(low) | u64::from(high) << 32;
                // One number for a small mean, pairs of them for a large one.
                let drawn = (1u64..40).find(|n| begin.wrapping_add(n.wrapping_mul(GOLDEN)) == state);
                assert!(drawn.is_some_and(|n| n == 1 || n % 2 == 0), "{level} {k} {chunk}: {drawn:?}");
                if k < 2 {
                    sum += f64::from(count);
                    mean += sampler.expected(chunk);
                }
            }
        }
    }
    assert!(mean > 5e4 && (sum - mean).abs() < 4.0 * mean.sqrt(), "{sum} for {mean}");
}

#[test]
fn hits_of_one_seed_are_the_cpu_s() {
    let world = World::new();
    let mut device = open().unwrap();
    // Widened and thinned out; the second run begins where the first ends.
    for scale in [0.5, 6.0] {
        let (wall, sheet, volume) = world.samplers(5, scale, 1.0);
        let crossings = world.crossings(5, scale, 1.0);
        let splats = world.splats(5, scale);
        for samplers in
            [[&wall as &dyn Sampler, &sheet, &volume], [&wall, &crossings, &volume], [&wall, &sheet, &splats]]
        {
            world.with(samplers, |scene| {
                let [cpu, gpu] = [by_processor(scene, 2 * ROOM.levels), by_device(&mut device, scene, 2)];
                let same = pixels().filter(|&(x, y)| cpu.hits(x, y) == gpu.hits(x, y)).count();
                assert!(same as f64 >= 0.999 * f64::from(SIZE[0] * SIZE[1]), "{scale}: {same}");
            });
        }
    }
}

#[test]
fn too_little_room_folds_nothing_and_says_what_is_needed() {
    let world = World::new();
    let (wall, sheet, volume) = world.samplers(3, 1.0, 1.0);
    let splats = world.splats(3, 1.0);
    for samplers in [[&wall as &dyn Sampler, &sheet, &volume], [&wall, &splats, &sheet]] {
        room_is_told(&world, samplers);
    }
}

fn room_is_told(world: &World, samplers: [&dyn Sampler; 3]) {
    world.with(samplers, |scene| {
        let mut device = open().unwrap();
        let sources = Sources::new(scene).unwrap();
        let mut run = |room: Capacities| {
            let mut ensemble = empty();
            let generated = record_generated(room, Nearest::for_adapter(device.adapter()), None, &sources).unwrap();
            let mut inputs = generated.tables(&sources, scene, &ensemble).unwrap();
            inputs.extend(generated.next(&sources, scene, &ensemble).unwrap());
            let inputs: Vec<_> = inputs.iter().map(|(buffer, bytes)| (*buffer, &bytes[..])).collect();
            let done = device.run(&generated.recording, &inputs).unwrap();
            let sums_are_zero = done.bytes(generated.sums).iter().all(|byte| *byte == 0);
            (generated.add(&done, &mut ensemble), ensemble, sums_are_zero)
        };
        let (Err(Error::Overflow(Overflow { what: "particles of one set", needed, had: 10, .. })), none, true) =
            run(Capacities { of_set: 10, ..ROOM })
        else {
            panic!("room for 10 particles is enough")
        };
        assert_eq!(none, empty());
        let (Err(Error::Overflow(Overflow { what: "particles", needed: all, had: 1000, .. })), none, true) =
            run(Capacities { particles: 1000, ..ROOM })
        else {
            panic!("room for 1000 particles is enough")
        };
        assert_eq!(none, empty());
        let exactly = Capacities { of_set: needed as u32, particles: all as u32, ..ROOM };
        let (particles, ensemble, _) = run(exactly);
        assert_eq!((particles, ensemble.levels()), (Ok(all), ROOM.levels));
        assert!(matches!(run(Capacities { of_set: needed as u32 - 1, ..exactly }).0, Err(Error::Overflow(_))));
        assert!(matches!(run(Capacities { particles: all as u32 - 1, ..exactly }).0, Err(Error::Overflow(_))));
        let fewer = record_generated(Capacities { objects: 2, ..ROOM }, Nearest::Ranked, None, &sources).unwrap();
        assert!(matches!(
            fewer.tables(&sources, scene, &empty()),
            Err(Error::Overflow(Overflow { what: "objects", .. }))
        ));
        assert_eq!(device.take_messages(), [""; 0]);
    });
}

/// 1/2 everywhere.
struct Half;

impl splat_core::ScalarField for Half {
    fn value(&self, _: DVec3) -> f64 {
        0.5
    }

    fn gradient(&self, _: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    fn hessian(&self, _: DVec3) -> DMat3 {
        DMat3::ZERO
    }

    fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
        Some((0.5, 0.5))
    }
}

#[test]
fn what_has_no_twin_is_uploaded() {
    let world = World::new();
    let (wall, sheet, volume) = world.samplers(3, 1.0, 1.0);
    let kept = KeptSets::new(&sheet, 0, 1);
    let thinned =
        MeshSampler::new(&world.wall, &SurfaceParams::default(), Some(Density { field: &Half, max: 1.0 })).unwrap();
    let clear = SurfaceParams { opacity: 0.0, ..SurfaceParams::default() };
    let nothing = MeshSampler::new(&world.wall, &clear, None).unwrap();
    for samplers in
        [[&kept as &dyn Sampler, &kept, &thinned], [&thinned, &nothing, &kept], [&nothing, &nothing, &nothing]]
    {
        assert_eq!(world.with(samplers, Sources::new), None);
    }
    // One without particles is no hindrance.
    let given = |samplers| world.with(samplers, |scene| Sources::new(scene).map(|sources| sources.has_given()));
    assert_eq!(given([&nothing, &sheet, &nothing]), Some(false));
    assert_eq!(given([&nothing, &sheet, &kept]), Some(true));
    // What the device makes stands beside what is uploaded: all where they are when all of it is.
    let kept = KeptSets::new(&sheet, 0, ROOM.levels as usize);
    let mut device = open().unwrap();
    for samplers in [[&wall as &dyn Sampler, &kept, &volume], [&kept, &kept, &wall]] {
        world.with(samplers, |scene| {
            let ([made, uploaded], _) = particles(&mut device, scene);
            assert_eq!(made[0], uploaded[0], "sets");
            let [found, expected] = [places(&made), places(&uploaded)];
            assert!(expected.len() > 10_000 && found == expected, "{} of {}", found.len(), expected.len());
            let [cpu, gpu] = [by_processor(scene, 2 * ROOM.levels), by_device(&mut device, scene, 2)];
            let same = pixels().filter(|&(x, y)| cpu.hits(x, y) == gpu.hits(x, y)).count();
            assert!(same as f64 >= 0.999 * f64::from(SIZE[0] * SIZE[1]), "{same}");
            // Room is asked for before anything is uploaded.
            let sources = Sources::new(scene).unwrap();
            let few = Capacities { particles: 1000, ..ROOM };
            let generated = record_generated(few, Nearest::Ranked, None, &sources).unwrap();
            let refused = generated.next(&sources, scene, &empty());
            assert!(matches!(refused, Err(Error::Overflow(Overflow { what: "particles", .. }))), "{refused:?}");
        });
    }
}
