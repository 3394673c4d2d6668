//! Compositing by a device's rasterizer: the CPU's accumulator, within a stated tolerance, and the truth in f64.

use crate::splat::{Both, SIZE, Scene, VIEWS, discs, media, position, unit};
use gpu_conformance::{Device, adapter, bytes, open, open_ash};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::FoldInput;
use splat_core::raster::gpu::draw::{Precision, follow, record};
use splat_core::raster::gpu::{Counts, follow as following};
use splat_core::raster::{OpaqueImage, Params};
use splat_core::{Accumulator, Cloud, Direction, Error, Material, Projection, Splat};
use splat_shaders::layouts::SplatView;
use splat_shaders::{Blend, BufferId, Corners, DeviceError, Format, ImageId, Recording, Target, Validation, programs};
use std::time::Duration;

/// Most that a channel may differ by, as a share of the largest value that a splat has, and transmittance: as by tiles.
/// Measured on lavapipe, by either executor: 2.4·10⁻⁶.
const TOLERANCE: f32 = 1e-5;

/// The same where halves are blended, for up to a few hundred splats a pixel. Measured: 1.1·10⁻².
const HALF_TOLERANCE: f32 = 0.02;

const DIRECTIONS: [Direction; 2] = [Direction::FrontToBack, Direction::BackToFront];

fn drawn(cloud: Cloud, view: Projection) -> Scene {
    Scene { record: |room| record(room, Precision::Single), ..Scene::new(cloud, view) }
}

#[test]
fn drawn_pictures_are_the_cpu_s() {
    let mut device = open().unwrap();
    let mut most = 0.0f32;
    for cloud in [media(4000, DVec3::ZERO), media(1500, DVec3::new(1e7, -3e6, 5e6)), discs(3000)] {
        for view in VIEWS {
            for direction in DIRECTIONS {
                let scene = Scene { direction, ..drawn(cloud.clone(), view) };
                let (both, difference) = scene.compare(&mut device);
                let n = cloud.len() as u64;
                assert_eq!(both.counts, Counts { splats: n, entries: n, longest: 0 });
                assert!(difference < TOLERANCE, "{n} {view:?} {direction:?}: {difference:e}");
                assert!(both.touched() > 10_000, "{}", both.touched());
                most = most.max(difference);
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn every_number_of_planes_and_channels_is_drawn() {
    let mut device = open().unwrap();
    let mut cloud = media(2000, DVec3::ZERO);
    (0..2000).step_by(2).for_each(|i| cloud.material[i] = 1);
    let green = Material { extinction_rgb: [0.2, 1.0, 0.7], ..Material::default() };
    for (planes, channels) in [(1, 1), (1, 7), (3, 1), (3, 3), (3, 4), (3, 13), (3, 16)] {
        for direction in DIRECTIONS {
            let materials = vec![Material::default(), green];
            let scene = Scene { planes, channels, materials, direction, ..drawn(cloud.clone(), VIEWS[0]) };
            let (_, difference) = scene.compare(&mut device);
            assert!(difference < TOLERANCE, "{planes} {channels} {direction:?}: {difference:e}");
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn the_truth_in_f64_is_drawn() {
    let mut device = open().unwrap();
    for cloud in [media(2000, DVec3::ZERO), discs(1000)] {
        let scene = drawn(cloud, VIEWS[0]);
        let (both, _) = scene.compare(&mut device);
        let exact = reference::composite(&reference::Input {
            cloud: &scene.cloud,
            camera: &scene.camera,
            footprints: &scene.footprints,
            materials: &scene.materials,
            values: &scene.values(),
            channels: 3,
            resampling_sigma_px: scene.params.resampling_sigma_px,
            order: reference::Order::Centre,
        });
        let far = |a: &Accumulator| {
            let through = a.optical_depth[0].iter().zip(&exact.transmittance).map(|(a, b)| (-a).exp() - b[0] as f32);
            through.fold(0.0, |most: f32, d| most.max(d.abs()))
        };
        // What the footprint's table costs both alike.
        let [cpu, gpu] = [far(&both.cpu), far(&both.gpu)];
        assert!(gpu < 2e-5 && gpu < cpu + TOLERANCE, "{cpu:e} {gpu:e}");
    }
}

#[test]
fn tiny_splats_huge_ones_and_those_half_outside_are_drawn() {
    let mut device = open().unwrap();
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..2000u64 {
        // Far smaller than a pixel; larger than the image; across its border, beside and behind it.
        let (radius, cross_section) = match i % 3 {
            0 => (1e-4, 1e-4),
            1 if i < 60 => (2.5, 0.1),
            _ => (0.05, 2e-3),
        };
        let away = if i % 5 == 0 { Vec3::new(20.0 * unit(i, 3) - 10.0, 0.0, 9.0 * unit(i, 4)) } else { Vec3::ZERO };
        let at = if i % 7 == 0 { Vec3::new(2.8, 0.0, 0.0) + 0.1 * position(i) } else { position(i) };
        cloud.push(&Splat { position: at + away, radius, cross_section, ..Splat::default() });
    }
    for view in VIEWS {
        for resampling_sigma_px in [0.5, 0.0] {
            let params = Params { resampling_sigma_px, ..Params::default() };
            let scene = Scene { params, ..drawn(cloud.clone(), view) };
            let (_, difference) = scene.compare(&mut device);
            assert!(difference < TOLERANCE, "{view:?} {resampling_sigma_px}: {difference:e}");
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn any_size_of_image_is_drawn() {
    let mut device = open().unwrap();
    for size in [[1, 1], [16, 16], [17, 33], [1, 300], [301, 2]] {
        for precision in [Precision::Single, Precision::Half] {
            let mut scene = drawn(media(300, DVec3::ZERO), VIEWS[1]);
            scene.camera.size = size;
            let mut tolerance = TOLERANCE;
            if precision == Precision::Half {
                (scene.record, tolerance) = (|room| record(room, Precision::Half), HALF_TOLERANCE);
            }
            let (both, difference) = scene.compare(&mut device);
            assert!(difference < tolerance, "{size:?} {precision:?}: {difference:e}");
            assert!(both.touched() > 0, "{size:?}");
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn what_is_opaque_hides_what_is_drawn() {
    let mut device = open().unwrap();
    for cloud in [media(2000, DVec3::ZERO), discs(2000)] {
        let mut scene = drawn(cloud, VIEWS[0]);
        // Before everything, through the midst, behind everything, nowhere.
        let depth = |k: usize| [0.5, 3.6 + 0.01 * (k % 90) as f32, 9.0, f32::INFINITY][k / 7 % 4];
        let pixels = (SIZE[0] * SIZE[1]) as usize;
        scene.opaque = OpaqueImage { depth: (0..pixels).map(depth).collect(), ..OpaqueImage::default() };
        let (both, difference) = scene.compare(&mut device);
        assert!(difference < TOLERANCE, "{difference:e}");
        assert!((0..pixels).all(|k| k / 7 % 4 > 0 || both.gpu.optical_depth[0][k] < 1e-6));
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn what_is_drawn_goes_on_where_another_fold_ended() {
    let mut device = open().unwrap();
    for direction in DIRECTIONS {
        for planes in [1, 3] {
            let scene = Scene { direction, planes, channels: 4, ..drawn(media(3000, DVec3::ZERO), VIEWS[0]) };
            let (order, empty) = (scene.order(), scene.accumulator());
            let (first, second) = order.split_at(1500);
            let whole = scene.both(&mut device, &order, &empty, 0).unwrap().gpu;
            let half = scene.both(&mut device, first, &empty, 0).unwrap().gpu;
            let mut both = scene.both(&mut device, second, &half, 0).unwrap();
            assert!(both.difference() < TOLERANCE, "{direction:?} {planes}: {:e}", both.difference());
            both.cpu = whole;
            assert!(both.difference() < TOLERANCE, "{direction:?} {planes}: {:e}", both.difference());
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn behind_the_cut_off_what_is_drawn_differs_by_no_more_than_it() {
    let mut device = open().unwrap();
    let mut cloud = media(3000, DVec3::ZERO);
    cloud.cross_section.iter_mut().for_each(|k| *k *= 300.0);
    for transmittance_cutoff in [1e-6, 1e-2] {
        let params = Params { transmittance_cutoff, ..Params::default() };
        let (_, difference) = Scene { params, ..drawn(cloud.clone(), VIEWS[0]) }.compare(&mut device);
        assert!(difference < TOLERANCE.max(transmittance_cutoff), "{transmittance_cutoff}: {difference:e}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn halves_are_blended_within_their_own_tolerance() {
    let mut device = open().unwrap();
    let mut most = 0.0f32;
    for cloud in [media(4000, DVec3::ZERO), discs(3000)] {
        for direction in DIRECTIONS {
            let half =
                Scene { direction, record: |room| record(room, Precision::Half), ..drawn(cloud.clone(), VIEWS[0]) };
            let (_, difference) = half.compare(&mut device);
            most = most.max(difference);
        }
    }
    assert!(most < HALF_TOLERANCE && most > 10.0 * TOLERANCE, "{most:e}");
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn another_order_is_another_picture_and_no_splats_are_none() {
    let mut device = open().unwrap();
    let scene = drawn(media(2000, DVec3::ZERO), VIEWS[0]);
    let (order, empty) = (scene.order(), scene.accumulator());
    let mut both = scene.both(&mut device, &order, &empty, 0).unwrap();
    assert!(both.difference() < TOLERANCE);
    // The planted fault: the order reversed.
    let reversed: Vec<u32> = order.iter().rev().copied().collect();
    both.gpu = scene.both(&mut device, &reversed, &empty, 0).unwrap().gpu;
    assert!(both.difference() > 20.0 * TOLERANCE, "{:e}", both.difference());
    // The same said of it: back to front it is the picture.
    let back = Scene { direction: Direction::BackToFront, ..drawn(media(2000, DVec3::ZERO), VIEWS[0]) };
    both.gpu = back.both(&mut device, &reversed, &empty, 0).unwrap().gpu;
    assert!(both.difference() < TOLERANCE, "{:e}", both.difference());
    let begin = both.gpu;
    for (cloud, order) in [(scene.cloud.clone(), vec![]), (Cloud::new(DVec3::ZERO), vec![])] {
        let scene = Scene { cloud, ..drawn(Cloud::new(DVec3::ZERO), VIEWS[0]) };
        for begin in [&begin, &empty] {
            let Both { cpu, gpu, counts } = scene.both(&mut device, &order, begin, 0).unwrap();
            assert_eq!((&gpu, counts), (&cpu, Counts::default()));
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

/// What is drawn where a sort says how many, of a room for so many.
fn followed(device: &mut Device, scene: &Scene, sorted: u32, room: u32) -> Result<Both, Error> {
    let (projected, order, values, empty) = (scene.project(), scene.order(), scene.values(), scene.accumulator());
    let (materials, opaque, direction, params) = (&scene.materials[..], &scene.opaque, scene.direction, &scene.params);
    let order = &order[..room as usize];
    let input = FoldInput { projected: &projected, order, values: &values, materials, opaque, direction, params };
    let recorded = follow(input.capacities(&empty, 0), Precision::Single)?;
    let (camera, footprints) = (&scene.camera, &scene.footprints);
    let view = following::Input {
        camera,
        footprints,
        materials,
        opaque: Some(opaque),
        direction,
        params,
        order,
        objects: &[],
    };
    let view = following::uploads(&recorded, &view, &empty)?;
    let splats = splat_core::raster::gpu::words(&projected, false);
    let state = bytes(&[sorted, sorted, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let values_bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
    let mut inputs = recorded.inputs(&view).to_vec();
    inputs.retain(|(_, bytes)| !bytes.is_empty());
    let splats = bytes(&splats);
    inputs.extend([
        (recorded.splats, &splats[..]),
        (recorded.values, &values_bytes),
        (recorded.sorted.unwrap(), &state),
    ]);
    let run = device.run(&recorded.recording, &inputs).unwrap();
    assert!(run.passes.iter().any(|p| p.kernel == "splat_draw" && p.nanoseconds > 0.0), "{:?}", run.passes);
    let mut gpu = empty.clone();
    let read = [recorded.state, recorded.planes].map(|b| run.bytes(b));
    let planes: Vec<u8> = read[1].to_vec();
    let counts = recorded.finish(read, &mut gpu).inspect_err(|_| {
        assert!(planes.iter().all(|b| *b == 0), "where there is no room nothing is drawn");
    })?;
    let few = &order[..sorted as usize];
    let cpu = scene.both(device, few, &empty, 0)?.cpu;
    Ok(Both { cpu, gpu, counts })
}

#[test]
fn a_sort_on_the_device_says_how_many_are_drawn_and_too_many_are_found() {
    let mut device = open().unwrap();
    let scene = drawn(media(1000, DVec3::ZERO), VIEWS[0]);
    for sorted in [0, 1, 700, 1000] {
        let both = followed(&mut device, &scene, sorted, 1000).unwrap();
        assert!(both.difference() < TOLERANCE, "{sorted}: {:e}", both.difference());
        assert_eq!(both.counts.splats, u64::from(sorted));
    }
    let expected = Error::Overflow { what: "splats in order", needed: 701, had: 700 };
    assert_eq!(followed(&mut device, &scene, 701, 700).err(), Some(expected));
    assert_eq!(device.take_messages(), [""; 0]);
}

/// A recording by hand: one splat of the values red 1, green 2, blue 4 over a whole image of 2 by 1 pixels, drawn `blends.len()`
/// times one after the other, each into what the one before left. Reads colours and optical depths.
struct ByHand {
    recording: Recording,
    inputs: Vec<(BufferId, Vec<u8>)>,
    copies: [BufferId; 2],
}

fn by_hand(blends: &[Blend], begin: [f32; 4], strips: u32) -> ByHand {
    let mut r = Recording::default();
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_ne_bytes()).collect::<Vec<u8>>();
    let view = SplatView {
        middle: [1.0, 0.5],
        size: [2.0, 1.0],
        ordered: 1,
        splat_words: 8,
        footprints: 1,
        planes: 1,
        channels: 3,
        ..SplatView::default()
    };
    let SplatView { middle, size, ordered, splat_words, footprints, planes, channels, .. } = view;
    let floats_of_view = [middle, size].concat().into_iter().map(f32::to_bits);
    let rest = [0, 0, 1, 1, ordered, splat_words, footprints, planes, channels, 0, 0, 1, 0, 0, 0, 0];
    let view: Vec<u32> = floats_of_view.chain(rest).collect();
    let [x, y, peak] = [1.0f32, 0.5, 0.5].map(f32::to_bits);
    // Half extents of 4 pixels, a medium.
    let extents = (4.0f32.to_bits() >> 16) * 0x1_0001;
    let splat = bytes(&[x, y, 0, 0, 0, peak, extents, 0]);
    // A profile of t^3, and t is 1.
    let mut table = [0.0f32; 20];
    (table[0], table[10]) = (1.0, 1.0);
    table[16..].copy_from_slice(&[1.0; 4]);
    let given = [
        ("view", bytes(&view)),
        ("order", bytes(&[0])),
        ("splats", splat),
        ("values", floats(&[1.0, 2.0, 4.0])),
        ("tables", floats(&table)),
        ("opaque", bytes(&[0])),
    ];
    let inputs: Vec<(BufferId, Vec<u8>)> =
        given.into_iter().map(|(name, bytes)| (r.input(name, bytes.len().max(64) as u64), bytes)).collect();
    let images = [r.image("color", [2, 1], Format::Rgba32F), r.image("sum", [2, 1], Format::R32F)];
    let copies = [r.scratch("colors", 256), r.scratch("sums", 256)];
    let bound: Vec<BufferId> = inputs.iter().map(|(id, _)| *id).collect();
    for (at, blend) in blends.iter().enumerate() {
        let clear = |to: [f32; 4]| (at == 0).then_some(to);
        let target = |image: ImageId, blend, clear| Target { image, blend, clear };
        let targets = [target(images[0], *blend, clear(begin)), target(images[1], Blend::Add, clear([0.25; 4]))];
        r.draw(&programs::SPLAT_DRAW, Corners::Direct([4, strips]), &bound, &[0, 0, 1, 2], &targets);
    }
    (0..2).for_each(|k| r.copy(images[k], copies[k]));
    copies.iter().for_each(|copy| r.read(*copy));
    ByHand { recording: r, inputs, copies }
}

impl ByHand {
    fn inputs(&self) -> Vec<(BufferId, &[u8])> {
        self.inputs.iter().map(|(id, bytes)| (*id, &bytes[..])).collect()
    }

    /// Two pixels of colours, and of optical depths.
    fn run(&self, device: &mut Device) -> ([f32; 8], [f32; 2]) {
        let run = device.run(&self.recording, &self.inputs()).unwrap();
        let floats = |k: usize| gpu_conformance::words(run.bytes(self.copies[k])).into_iter().map(f32::from_bits);
        let (colors, sums): (Vec<f32>, Vec<f32>) = (floats(0).take(8).collect(), floats(1).take(2).collect());
        (colors.try_into().unwrap(), sums.try_into().unwrap())
    }
}

#[test]
fn each_blend_is_what_it_says() {
    let mut device = open().unwrap();
    // Optical depth 1/2 times a profile of 1.
    let alpha = 1.0 - (-0.5f32).exp();
    let [s, begin] = [[alpha, 2.0 * alpha, 4.0 * alpha, alpha], [0.5, 0.25, 2.0, 0.75]];
    let blended = |blend: Blend, d: [f32; 4]| -> [f32; 4] {
        std::array::from_fn(|k| match blend {
            Blend::Add => d[k] + s[k],
            Blend::Over => s[k] + (1.0 - s[3]) * d[k],
            Blend::Under if k == 3 => d[3] * (1.0 - s[3]),
            Blend::Under => d[k] + d[3] * s[k],
        })
    };
    use Blend::{Add, Over, Under};
    for blends in [&[Add][..], &[Over], &[Under], &[Under, Under], &[Over, Under, Add]] {
        let expected = blends.iter().fold(begin, |d, blend| blended(*blend, d));
        let (colors, sums) = by_hand(blends, begin, 1).run(&mut device);
        for pixel in colors.chunks(4) {
            let near = pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-6);
            assert!(near, "{blends:?}: {pixel:?} {expected:?}");
        }
        assert_eq!(sums, [0.25 + 0.5 * blends.len() as f32; 2]);
        // The planted fault: any other blend is another picture.
        for other in [Add, Over, Under].into_iter().filter(|other| *other != blends[0]) {
            let wrong = [&[other], &blends[1..]].concat();
            assert_ne!(by_hand(&wrong, begin, 1).run(&mut device).0, colors);
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn a_draw_without_its_barriers_is_heard() {
    let mut device = open_ash().unwrap();
    let recording = by_hand(&[Blend::Under, Blend::Under], [0.0; 4], 1).recording;
    drop(device.prepare(&recording).unwrap());
    assert_eq!(device.take_messages(), [""; 0]);
    drop(device.prepare_without_barriers(&recording).unwrap());
    let said = device.take_messages();
    assert!(said.iter().any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{said:?}");
}

#[test]
fn a_draw_that_reads_beyond_a_buffer_is_heard() {
    if std::env::var("ORGANZA_VALIDATION").as_deref() != Ok("gpu-assisted") {
        return;
    }
    let mut device = open_ash().unwrap();
    // An order of 16 words at most, and a strip for each of 40.
    let hand = by_hand(&[Blend::Under], [0.0; 4], 40);
    device.run(&hand.recording, &hand.inputs()).unwrap();
    let said = device.take_messages();
    assert!(said.iter().any(|m| m.contains("out of bounds")), "{said:?}");
}

#[test]
fn a_device_that_is_lost_or_hangs_while_it_draws_says_so() {
    let hand = by_hand(&[Blend::Under], [0.0, 0.0, 0.0, 1.0], 1);
    macro_rules! lost {
        ($executor:ident) => {
            let mut device = $executor::Device::open(&adapter(), Validation::Off).unwrap();
            let mut prepared = device.prepare(&hand.recording).unwrap();
            let run = prepared.run(&hand.inputs()).unwrap();
            // Again it begins from nothing, and in another batch.
            assert_eq!(prepared.run(&hand.inputs()).unwrap().reads, run.reads);
            device.loss()();
            assert_eq!(prepared.run(&hand.inputs()), Err(DeviceError::Lost));
        };
    }
    lost!(gpu_ash);
    lost!(gpu_wgpu);
    // One that takes the draw and never comes back: what it might still use is not taken from it.
    let mut device = gpu_ash::Device::open(&adapter(), Validation::Off).unwrap();
    device.set_patience(Duration::from_millis(50));
    let mut prepared = device.prepare(&hand.recording).unwrap();
    device.hang()();
    assert_eq!(prepared.run(&hand.inputs()), Err(DeviceError::Lost));
    assert_eq!(prepared.run(&hand.inputs()), Err(DeviceError::Lost), "it may still be at work");
}
