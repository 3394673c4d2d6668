//! Compositing on a device: the CPU's accumulator, within a stated tolerance.

use gpu_conformance::{Device, open};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::FoldInput;
use splat_core::raster::gpu::{Counts, record};
use splat_core::raster::{Detail, OpaqueImage, Params, ProjectInput, Projected, fold, project_into};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, Error, FootprintStack, Material, Projection, Splat, SplatKind, rng,
};
use splat_shaders::Overflow;

/// Most that a channel may differ by, as a share of the largest value that a splat has, and transmittance.
///
/// A sum of n weights that add up to at most 1 is off by about √n·2⁻²⁴. The offset of a pixel from the middle of a long thin
/// ellipse enters the square of its distance multiplied by the square of length over thickness, and fused products are
/// rounded once or twice, as the device has it. Measured on lavapipe, by either executor: 4·10⁻⁷ for round splats,
/// 2.4·10⁻⁶ for discs seen edge-on that are 120 pixels long.
pub(crate) const TOLERANCE: f32 = 1e-5;

pub(crate) const SIZE: [u32; 2] = [150, 90];
pub(crate) const VIEWS: [Projection; 2] =
    [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 3.0 }];

/// What is drawn, and how.
pub(crate) struct Scene {
    pub(crate) cloud: Cloud,
    pub(crate) camera: Camera,
    pub(crate) materials: Vec<Material>,
    pub(crate) footprints: FootprintStack,
    pub(crate) planes: usize,
    pub(crate) channels: usize,
    pub(crate) opaque: OpaqueImage,
    pub(crate) direction: Direction,
    pub(crate) params: Params,
    pub(crate) depths: bool,
    pub(crate) objects: bool,
}

impl Scene {
    pub(crate) fn new(cloud: Cloud, view: Projection) -> Self {
        let eye = cloud.origin + DVec3::new(0.3, 0.2, 4.0);
        Self {
            camera: Camera::look_at(eye, cloud.origin, DVec3::Y, view, SIZE).unwrap(),
            cloud,
            materials: vec![Material::default()],
            footprints: FootprintStack::default(),
            planes: 1,
            channels: 3,
            opaque: OpaqueImage::default(),
            direction: Direction::FrontToBack,
            params: Params::default(),
            depths: false,
            objects: false,
        }
    }

    pub(crate) fn accumulator(&self) -> Accumulator {
        Accumulator::new(self.camera.size, self.planes, self.channels, self.depths, self.objects)
    }

    pub(crate) fn project(&self) -> Projected {
        let mut projected = Projected::default();
        let detail =
            Detail { depth: self.depths || self.objects || !self.opaque.depth.is_empty(), object: self.objects };
        let camera = &self.camera;
        let params = &self.params;
        project_into(
            &mut projected,
            &ProjectInput {
                cloud: &self.cloud,
                camera,
                footprints: &self.footprints,
                materials: &self.materials,
                params,
                detail,
            },
        );
        projected
    }

    /// Ids by depth.
    pub(crate) fn order(&self) -> Vec<u32> {
        let view = self.camera.view_from_offset(self.cloud.origin);
        let mut order: Vec<u32> = (0..self.cloud.len() as u32).collect();
        order.sort_by(|&a, &b| {
            let depth = |i: u32| view.depth(self.cloud.position[i as usize]);
            depth(a).total_cmp(&depth(b))
        });
        if self.direction == Direction::BackToFront {
            order.reverse();
        }
        order
    }

    /// Composites on the CPU and on the device, into two that were alike; `room` is that for entries.
    pub(crate) fn both(
        &self,
        device: &mut Device,
        order: &[u32],
        begin: &Accumulator,
        room: u32,
    ) -> Result<Both, Error> {
        let projected = self.project();
        let n = (self.cloud.len() * self.channels) as u64;
        let values: Vec<f32> = (0..n).map(|i| 3.0 * rng::unit_f32(77, 0, i, 0)).collect();
        let direction = self.direction;
        let params = &self.params;
        let materials = &self.materials[..];
        let opaque = &self.opaque;
        let mut cpu = begin.clone();
        let input = FoldInput { projected: &projected, order, values: &values, materials, opaque, direction, params };
        fold(&input, &mut cpu, None).unwrap();
        let mut gpu = begin.clone();
        let recorded = record(input.capacities(&gpu, room))?;
        let uploads = recorded.uploads(&input, &gpu)?;
        let run = device.run(&recorded.recording, &recorded.inputs(&uploads)).unwrap();
        let counts = recorded.finish([recorded.state, recorded.planes].map(|b| run.bytes(b)), &mut gpu)?;
        Ok(Both { cpu, gpu, counts })
    }

    /// The same from nothing, and how far the two lie apart at most.
    pub(crate) fn compare(&self, device: &mut Device) -> (Both, f32) {
        let both = self.both(device, &self.order(), &self.accumulator(), 1 << 20).unwrap();
        let difference = both.difference();
        (both, difference)
    }
}

pub(crate) struct Both {
    pub(crate) cpu: Accumulator,
    pub(crate) gpu: Accumulator,
    pub(crate) counts: Counts,
}

impl Both {
    /// The greatest difference of a transmittance, or of a channel as a share of the greatest value.
    pub(crate) fn difference(&self) -> f32 {
        let [a, b] = [&self.cpu, &self.gpu];
        let largest = |a: &[Vec<f32>], b: &[Vec<f32>], map: fn(f32) -> f32| {
            let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
            // What is no number is as far apart as can be.
            pairs.map(|(a, b)| (map(*a) - map(*b)).abs()).fold(0.0, |most: f32, d| if d <= most { most } else { d })
        };
        let transmittances = largest(&a.optical_depth, &b.optical_depth, |v| (-v).exp());
        transmittances.max(largest(&a.channels, &b.channels, |v| v / 3.0))
    }

    /// Pixels that anything was added to.
    fn touched(&self) -> usize {
        self.gpu.optical_depth[0].iter().filter(|a| **a > 0.0).count()
    }
}

pub(crate) fn unit(i: u64, k: u64) -> f32 {
    rng::unit_f32(31, 0, i, k)
}

pub(crate) fn position(i: u64) -> Vec3 {
    Vec3::new(4.0 * unit(i, 0) - 2.0, 3.0 * unit(i, 1) - 1.5, 2.0 * unit(i, 2) - 1.0)
}

/// Pieces of a medium of many sizes.
pub(crate) fn media(n: u64, origin: DVec3) -> Cloud {
    let mut cloud = Cloud::new(origin);
    for i in 0..n {
        let radius = 0.02 + 0.2 * unit(i, 3) * unit(i, 4);
        let footprint = (3.0 * unit(i, 5)) as u8;
        let cross_section = radius * radius * unit(i, 6);
        cloud.push(&Splat { position: position(i), radius, cross_section, footprint, ..Splat::default() });
    }
    cloud
}

/// Tangent discs, every third seen edge-on from the axis.
pub(crate) fn discs(n: u64) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..n {
        let turn = std::f32::consts::TAU * unit(i, 7);
        let tilt = if i % 3 == 0 { 1e-3 * unit(i, 8) } else { 2.0 * unit(i, 8) - 1.0 };
        let normal = Vec3::new(turn.cos(), turn.sin(), tilt).normalize();
        // Some are as long as the image, and edge-on thinner than a pixel.
        let radius = if i % 30 == 0 { 2.0 } else { 0.03 + 0.3 * unit(i, 3) * unit(i, 4) };
        let kind = SplatKind::Surface;
        let cross_section = radius * radius * unit(i, 6);
        cloud.push(&Splat { kind, position: position(i), normal, radius, cross_section, ..Splat::default() });
    }
    cloud
}

#[test]
fn pictures_are_the_cpu_s() {
    let mut device = open().unwrap();
    for cloud in [media(4000, DVec3::ZERO), media(1500, DVec3::new(1e7, -3e6, 5e6)), discs(3000)] {
        for view in VIEWS {
            for direction in [Direction::FrontToBack, Direction::BackToFront] {
                let scene = Scene { direction, ..Scene::new(cloud.clone(), view) };
                let (both, difference) = scene.compare(&mut device);
                assert!(difference < TOLERANCE, "{} {view:?} {direction:?}: {difference:e}", cloud.len());
                assert!(both.touched() > 10_000, "{}", both.touched());
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn every_number_of_planes_and_channels_is_the_cpu_s() {
    let mut device = open().unwrap();
    let mut cloud = media(2000, DVec3::ZERO);
    (0..2000).step_by(2).for_each(|i| cloud.material[i] = 1);
    let green = Material { extinction_rgb: [0.2, 1.0, 0.7], ..Material::default() };
    for (planes, channels) in [(1, 1), (1, 2), (1, 7), (3, 3), (3, 4), (3, 13), (3, 16)] {
        for direction in [Direction::FrontToBack, Direction::BackToFront] {
            let materials = vec![Material::default(), green];
            let scene = Scene { planes, channels, materials, direction, ..Scene::new(cloud.clone(), VIEWS[0]) };
            let (_, difference) = scene.compare(&mut device);
            assert!(difference < TOLERANCE, "{planes} {channels} {direction:?}: {difference:e}");
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn tiny_splats_huge_ones_and_those_outside_are_the_cpu_s() {
    let mut device = open().unwrap();
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..3000u64 {
        // Far smaller than a pixel; larger than the image; beside and behind it.
        let (radius, cross_section) = match i % 3 {
            0 => (1e-4, 1e-4),
            1 if i < 120 => (2.5, 0.1),
            _ => (0.05, 2e-3),
        };
        let away = if i % 5 == 0 { Vec3::new(20.0 * unit(i, 3) - 10.0, 0.0, 9.0 * unit(i, 4)) } else { Vec3::ZERO };
        cloud.push(&Splat { position: position(i) + away, radius, cross_section, ..Splat::default() });
    }
    for view in VIEWS {
        // Without a resampling filter what is tiny falls between pixels, or hits one with full force.
        for resampling_sigma_px in [0.5, 0.0] {
            let params = Params { resampling_sigma_px, ..Params::default() };
            let scene = Scene { params, ..Scene::new(cloud.clone(), view) };
            let (both, difference) = scene.compare(&mut device);
            assert!(difference < TOLERANCE, "{view:?} {resampling_sigma_px}: {difference:e}");
            assert!(both.counts.splats < 3000 && both.counts.entries > 40 * 40, "{:?}", both.counts);
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn any_size_of_image_is_the_cpu_s() {
    let mut device = open().unwrap();
    // One tile needs no sort, 257 need two passes.
    for size in [[1, 1], [16, 16], [17, 33], [257 * 16, 9]] {
        let mut scene = Scene::new(media(500, DVec3::ZERO), VIEWS[1]);
        scene.camera.size = size;
        let (both, difference) = scene.compare(&mut device);
        assert!(difference < TOLERANCE, "{size:?}: {difference:e}");
        assert!(both.touched() > 0, "{size:?}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn what_is_opaque_hides_splats_as_on_the_cpu() {
    let mut device = open().unwrap();
    for cloud in [media(3000, DVec3::ZERO), discs(3000)] {
        for view in VIEWS {
            let mut scene = Scene::new(cloud.clone(), view);
            // Before everything, through the midst, behind everything, nowhere.
            let depth = |k: usize| [0.5, 3.6 + 0.01 * (k % 90) as f32, 9.0, f32::INFINITY][k / 7 % 4];
            let pixels = (SIZE[0] * SIZE[1]) as usize;
            scene.opaque = OpaqueImage { depth: (0..pixels).map(depth).collect(), ..OpaqueImage::default() };
            let (both, difference) = scene.compare(&mut device);
            assert!(difference < TOLERANCE, "{view:?}: {difference:e}");
            assert!((0..pixels).all(|k| k / 7 % 4 > 0 || both.gpu.optical_depth[0][k] < 1e-6));
            assert!(both.touched() > pixels / 2);
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn one_tile_takes_any_number_of_splats_in_their_order() {
    let mut device = open().unwrap();
    // Many batches of one tile: were equal tiles not kept in their order, it would be another picture.
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..20_000 {
        cloud.push(&Splat { radius: 0.3, cross_section: 5e-5, ..Splat::default() });
        cloud.position[i] = Vec3::new(0.1 * unit(i as u64, 0), 0.1 * unit(i as u64, 1), 0.0);
    }
    let mut scene = Scene::new(cloud, VIEWS[1]);
    scene.camera.size = [12, 10];
    let order: Vec<u32> = (0..20_000u32).map(|i| i * 7919 % 20_000).collect();
    let mut both = scene.both(&mut device, &order, &scene.accumulator(), 20_000).unwrap();
    assert_eq!(both.counts, Counts { splats: 20_000, entries: 20_000, longest: 20_000 });
    assert!(both.difference() < TOLERANCE, "{:e}", both.difference());
    let reversed: Vec<u32> = order.iter().rev().copied().collect();
    both.cpu = scene.both(&mut device, &reversed, &scene.accumulator(), 20_000).unwrap().cpu;
    assert!(both.difference() > 20.0 * TOLERANCE, "another order is another picture: {:e}", both.difference());
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn a_fold_goes_on_where_another_ended() {
    let mut device = open().unwrap();
    let scene = Scene::new(media(3000, DVec3::ZERO), VIEWS[0]);
    let order = scene.order();
    let empty = scene.accumulator();
    let (near, far) = order.split_at(1500);
    let whole = scene.both(&mut device, &order, &empty, 1 << 18).unwrap().gpu;
    let first = scene.both(&mut device, near, &empty, 1 << 18).unwrap().gpu;
    let mut both = scene.both(&mut device, far, &first, 1 << 18).unwrap();
    assert!(both.difference() < TOLERANCE, "{:e}", both.difference());
    both.cpu = whole;
    assert!(both.difference() < TOLERANCE, "{:e}", both.difference());
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn behind_the_cut_off_nothing_is_seen() {
    let mut device = open().unwrap();
    let mut cloud = media(6000, DVec3::ZERO);
    cloud.cross_section.iter_mut().for_each(|k| *k *= 300.0);
    for transmittance_cutoff in [1e-6, 1e-2] {
        let params = Params { transmittance_cutoff, ..Params::default() };
        let scene = Scene { params, ..Scene::new(cloud.clone(), VIEWS[0]) };
        let (both, difference) = scene.compare(&mut device);
        assert!(difference < TOLERANCE.max(transmittance_cutoff), "{transmittance_cutoff}: {difference:e}");
        let opaque = both.gpu.optical_depth[0].iter().filter(|a| (-**a).exp() < transmittance_cutoff).count();
        assert!(opaque > 5000, "{opaque}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn nothing_to_composite_leaves_everything_as_it_was() {
    let mut device = open().unwrap();
    let scene = Scene::new(media(50, DVec3::ZERO), VIEWS[0]);
    let begin = scene.both(&mut device, &scene.order(), &scene.accumulator(), 5000).unwrap().gpu;
    for (cloud, order) in [(scene.cloud.clone(), vec![]), (Cloud::new(DVec3::ZERO), vec![])] {
        let scene = Scene { cloud, ..Scene::new(Cloud::new(DVec3::ZERO), VIEWS[0]) };
        for begin in [&begin, &scene.accumulator()] {
            let both = scene.both(&mut device, &order, begin, 0).unwrap();
            assert_eq!((&both.gpu, both.counts), (begin, Counts::default()));
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn too_little_room_is_found_and_recording_again_cures_it() {
    let mut device = open().unwrap();
    let scene = Scene::new(media(3000, DVec3::ZERO), VIEWS[0]);
    let order = scene.order();
    let begin = scene.accumulator();
    let expected = scene.both(&mut device, &order, &begin, 1 << 18).unwrap();
    for room in [0, 1, 4000] {
        let Err(Error::Overflow(Overflow { needed, had, .. })) = scene.both(&mut device, &order, &begin, room) else {
            panic!("room for {room} entries is enough")
        };
        assert_eq!((needed, had), (expected.counts.entries, u64::from(room)));
        let cured = scene.both(&mut device, &order, &begin, needed as u32).unwrap();
        assert_eq!((cured.gpu, cured.counts), (expected.gpu.clone(), expected.counts));
    }
    assert_eq!(device.take_messages(), [""; 0]);
}
