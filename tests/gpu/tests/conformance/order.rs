//! The sort on a device: the CPU's exact order, bit for bit.

use gpu_conformance::{Device, adapter, open};
use hbsort::gpu::{Capacities, join, record};
use hbsort::{Direction, Error, Params, Scratch, SliceOrder, Thickness, slice_cloud};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Camera, Cloud, Projection, Splat, rng};
use splat_shaders::{DeviceError, Lanes, Overflow, Validation};
use std::time::Duration;

fn cloud(n: u64, origin: DVec3) -> Cloud {
    let mut cloud = Cloud::new(origin);
    for i in 0..n {
        let u = |k| rng::unit_f32(21, 0, i, k);
        // A third of them in one plane across the view, and many pairs of the same depth.
        let z = if i % 3 == 0 { -7.0 } else { (u(2) * 4000.0).floor() / 100.0 - 30.0 };
        let position = Vec3::new(u(0) * 40.0 - 20.0, u(1) * 30.0 - 15.0, z);
        cloud.push(&Splat { position, radius: 0.01 + 0.05 * u(3), ..Splat::default() });
    }
    cloud
}

fn camera(origin: DVec3, projection: Projection) -> Camera {
    let eye = origin + DVec3::new(1.0, 2.0, 8.0);
    Camera::look_at(eye, origin - DVec3::Z, DVec3::Y, projection, [640, 360]).unwrap()
}

/// The order by the portable kernels, and the same by subgroups.
fn on_device(
    device: &mut Device,
    capacities: Capacities,
    cloud: &Cloud,
    ids: Option<&[u32]>,
    camera: &Camera,
    params: &Params,
) -> Result<SliceOrder, Error> {
    let lanes = device.lanes();
    let recorded = record(capacities);
    let uploads = recorded.uploads(cloud, ids, camera, params)?;
    let mut order = |lanes: Lanes| {
        let run = device.run(&recorded.recording.by(lanes), &recorded.inputs(&uploads)).unwrap();
        recorded.order([recorded.state, recorded.keys, recorded.places].map(|b| run.bytes(b)), cloud, ids, params)
    };
    let found = lanes.iter().map(|lanes| order(*lanes)).collect::<Vec<_>>();
    assert!(found.windows(2).all(|w| w[0] == w[1]), "by subgroups it is another");
    found.into_iter().next().unwrap()
}

const VIEWS: [Projection; 2] = [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 12.0 }];

#[test]
fn bs08_the_order_is_the_cpu_s_bit_for_bit() {
    let mut device = open().unwrap();
    for (n, origin) in [(1u64, DVec3::ZERO), (2047, DVec3::ZERO), (40_000, DVec3::new(1e7, -3e6, 5e6))] {
        let cloud = cloud(n, origin);
        for view in VIEWS {
            for direction in [Direction::BackToFront, Direction::FrontToBack] {
                let params = Params { direction, exact: true, margin_px: 1.5, ..Params::default() };
                let camera = camera(origin, view);
                let expected = slice_cloud(&cloud, None, &camera, &params, &mut Scratch::new()).unwrap();
                let room = Capacities { splats: n as u32, kept: n as u32 };
                let found = on_device(&mut device, room, &cloud, None, &camera, &params).unwrap();
                assert_eq!(found, expected, "{n} {view:?} {direction:?}");
                assert!(n < 100 || (expected.culled > 0 && found.non_empty_slices() > 100));
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn bs03_one_depth_is_the_order_of_ids() {
    let mut device = open().unwrap();
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..5000 {
        let position = Vec3::new((i % 70) as f32 * 0.01, (i / 70) as f32 * 0.01, 0.0);
        cloud.push(&Splat { position, radius: 0.1, ..Splat::default() });
    }
    let camera = Camera::look_at(DVec3::Z * 5.0, DVec3::ZERO, DVec3::Y, VIEWS[0], [64, 64]).unwrap();
    let params = Params { exact: true, thickness: Thickness::World(0.5), ..Params::default() };
    let room = Capacities { splats: 6000, kept: 6000 };
    let found = on_device(&mut device, room, &cloud, None, &camera, &params).unwrap();
    assert_eq!(found.input_from_sorted, (0..5000).collect::<Vec<u32>>());
    // A subset keeps the ids of the cloud.
    let some: Vec<u32> = (0..5000).step_by(3).collect();
    let found = on_device(&mut device, room, &cloud, Some(&some), &camera, &params).unwrap();
    assert_eq!(found.input_from_sorted, some);
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn bs09_nothing_in_the_view_is_an_empty_order() {
    let mut device = open().unwrap();
    let cloud = cloud(3000, DVec3::ZERO);
    let away = Camera::look_at(DVec3::Z * 900.0, DVec3::Z * 990.0, DVec3::Y, VIEWS[0], [64, 64]).unwrap();
    let params = Params { exact: true, ..Params::default() };
    for (cloud, kept) in [(&cloud, 3000), (&cloud, 0), (&Cloud::new(DVec3::ZERO), 10)] {
        let expected = slice_cloud(cloud, None, &away, &params, &mut Scratch::new()).unwrap();
        let found = on_device(&mut device, Capacities { splats: 3000, kept }, cloud, None, &away, &params).unwrap();
        assert_eq!(found.input_from_sorted, expected.input_from_sorted);
        assert_eq!((found.culled, found.non_empty_slices()), (expected.culled, 0));
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn too_little_room_is_found_and_recording_again_cures_it() {
    let mut device = open().unwrap();
    let cloud = cloud(20_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO, VIEWS[0]);
    let params = Params { exact: true, ..Params::default() };
    let expected = slice_cloud(&cloud, None, &camera, &params, &mut Scratch::new()).unwrap();
    for kept in [0, 1, 4000] {
        let room = Capacities { splats: 20_000, kept };
        let refused = on_device(&mut device, room, &cloud, None, &camera, &params);
        let Err(Error::Overflow(Overflow { needed, had, .. })) = refused else { panic!("{refused:?}") };
        assert_eq!((needed, had), (expected.input_from_sorted.len() as u64, u64::from(kept)));
        let room = Capacities { kept: needed as u32, ..room };
        assert_eq!(on_device(&mut device, room, &cloud, None, &camera, &params).unwrap(), expected);
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn parts_joined_are_the_order_of_all() {
    let mut device = open().unwrap();
    let cloud = cloud(20_000, DVec3::new(1e7, -3e6, 5e6));
    let camera = camera(cloud.origin, VIEWS[0]);
    let ids: Vec<u32> = (0..20_000).filter(|i| i % 7 > 0).collect();
    for (direction, limit) in [(Direction::BackToFront, 4096), (Direction::FrontToBack, 1 << 16)] {
        let params = Params { direction, exact: true, ..Params::default() };
        let expected = slice_cloud(&cloud, Some(&ids), &camera, &params, &mut Scratch::new()).unwrap();
        let most = Capacities::most_splats(limit);
        let recorded = record(Capacities { splats: most, kept: most });
        assert!(recorded.recording.buffers().iter().all(|b| b.bytes <= limit));
        let mut prepared = device.prepare(&recorded.recording).unwrap();
        let mut sort = |part: &[u32]| {
            let uploads = recorded.uploads(&cloud, Some(part), &camera, &params).unwrap();
            let run = prepared.run(&recorded.inputs(&uploads)).unwrap();
            let reads = [recorded.state, recorded.keys, recorded.places].map(|b| run.bytes(b));
            recorded.sorted(reads, &cloud, Some(part)).unwrap()
        };
        let parts: Vec<_> = ids.chunks(most as usize).map(&mut sort).collect();
        assert!(parts.len() > 3, "{}", parts.len());
        assert_eq!(join(&parts, &cloud, Some(&ids), &params).unwrap(), expected);
        // A part that is missing is missed.
        let missing = join(&parts[1..], &cloud, Some(&ids), &params);
        assert!(matches!(missing, Err(Error::ReadBack { what: "parts of splats", .. })), "{missing:?}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn ou8_ou9_steps_submitted_one_by_one_or_in_batches_give_the_same() {
    // Validation follows one command buffer, so that only what it does not watch is submitted in parts.
    let cloud = cloud(40_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO, Projection::Perspective { fov_y: 0.9 });
    let params = Params { exact: true, ..Params::default() };
    let capacities = Capacities { splats: 40_000, kept: 40_000 };
    let recorded = record(capacities);
    let uploads = recorded.uploads(&cloud, None, &camera, &params).unwrap();
    let inputs = recorded.inputs(&uploads);
    let read = [recorded.state, recorded.keys, recorded.places];
    let watched = open().unwrap().run(&recorded.recording, &inputs).unwrap();
    let mut ash = gpu_ash::Device::open(&adapter(), Validation::Off).unwrap().prepare(&recorded.recording).unwrap();
    let mut wgpu = gpu_wgpu::Device::open(&adapter(), Validation::Off).unwrap().prepare(&recorded.recording).unwrap();
    for run in 0..10 {
        for found in [ash.run(&inputs).unwrap(), wgpu.run(&inputs).unwrap()] {
            assert!(read.iter().all(|b| found.bytes(*b) == watched.bytes(*b)), "run {run}");
        }
    }
}

#[test]
fn a_device_that_does_not_come_back_in_time_is_given_up() {
    let small = (cloud(50, DVec3::ZERO), camera(DVec3::ZERO, Projection::Perspective { fov_y: 0.9 }));
    let params = Params { exact: true, ..Params::default() };
    let recorded = record(Capacities { splats: 50, kept: 50 });
    let uploads = recorded.uploads(&small.0, None, &small.1, &params).unwrap();
    let recording = &recorded.recording;
    let inputs = recorded.inputs(&uploads);

    let mut device = gpu_ash::Device::open(&adapter(), Validation::Off).unwrap();
    assert!(device.run(recording, &inputs).is_ok());
    device.set_patience(Duration::from_millis(50));
    let mut prepared = device.prepare(recording).unwrap();
    device.hang()();
    assert_eq!(prepared.run(&inputs), Err(DeviceError::Lost));
    assert_eq!(prepared.run(&inputs), Err(DeviceError::Lost), "it may still be at work");
    // What the device might use is not taken from it.
    drop((prepared, device));
    let mut fresh = gpu_ash::Device::open(&adapter(), Validation::Off).unwrap();
    assert!(fresh.run(recording, &inputs).is_ok());

    // By wgpu there is no such driver, but no patience. Lavapipe does nearly all work while it is submitted: one run in two to
    // fifty, by the size of its vectors, is not over when the wait begins, and of two thousand none in one case of 10¹⁷.
    let mut device = gpu_wgpu::Device::open(&adapter(), Validation::Off).unwrap();
    device.set_patience(Duration::ZERO);
    let mut prepared = device.prepare(recording).unwrap();
    let mut is_lost = || matches!(prepared.run(&inputs), Err(DeviceError::Lost));
    assert!((0..2000).any(|_| is_lost()));
    assert!(is_lost(), "it may still be at work");
    drop((prepared, device));
    let mut fresh = gpu_wgpu::Device::open(&adapter(), Validation::Off).unwrap();
    assert!(fresh.run(recording, &inputs).is_ok());
}
