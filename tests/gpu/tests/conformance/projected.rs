//! Projection on a device: the CPU's footprints.

use gpu_conformance::{Device, open, words};
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::raster::gpu::project::{Capacities, Input, record, visible};
use splat_core::raster::gpu::{self, Attributes};
use splat_core::raster::{Detail, Params, ProjectInput, project};
use splat_core::{Camera, Cloud, Error, FootprintStack, Material, Projection, Splat, SplatKind, rng};

/// Most that a number of a footprint may differ by, as a share of the larger of its own size and of the largest of its
/// kind in the splat (of the conic's three).
///
/// By `gpu-ash` lavapipe rounds as the CPU does, so that every bit is equal; wgpu's translator drops what keeps products and
/// sums apart, and elsewhere a quotient may be off by 2.5 units in the last place. Measured through wgpu: 5.4·10⁻⁶.
const TOLERANCE: f32 = 1e-5;

/// The same for the slope of depth, one over the cosine under which a disc is seen, of which a rounding takes a share: cosines
/// down to 10⁻⁴ count. Measured through wgpu: 8.6·10⁻⁵.
const SLOPE_TOLERANCE: f32 = 2e-3;

const VIEWS: [Projection; 2] = [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 3.0 }];

fn unit(i: u64, k: u64) -> f32 {
    rng::unit_f32(57, 0, i, k)
}

/// Splats of all kinds around the eye's target, some outside the view, around the eye, or behind it.
fn cloud(n: u64, origin: DVec3) -> Cloud {
    let mut cloud = Cloud::new(origin);
    for i in 0..n {
        let far = if i % 7 == 0 { 4.0 } else { 1.0 };
        let position = Vec3::new(4.0 * unit(i, 0) - 2.0, 3.0 * unit(i, 1) - 1.5, 2.0 * unit(i, 2) - 1.0) * far;
        let kind = [SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque][(i % 3) as usize];
        let turn = std::f32::consts::TAU * unit(i, 3);
        // Every fifth is seen edge-on from the axis.
        let tilt = if i % 5 == 0 { 0.0 } else { 2.0 * unit(i, 4) - 1.0 };
        let normal = Vec3::new(turn.cos(), turn.sin(), tilt).normalize();
        let radius = 0.002 + 0.3 * unit(i, 5) * unit(i, 6);
        cloud.push(&Splat {
            position,
            normal: if kind == SplatKind::Medium { Vec3::ZERO } else { normal },
            tangent: if i % 4 == 1 { normal.any_orthonormal_vector() * radius * 2.0 } else { Vec3::ZERO },
            radius,
            kind,
            cross_section: if i % 11 == 0 { 0.0 } else { radius * radius * unit(i, 7) },
            footprint: (i % 3) as u8,
            material: (i % 2) as u16,
            ..Splat::default()
        });
    }
    cloud
}

fn camera(origin: DVec3, view: Projection) -> Camera {
    Camera::look_at(origin + DVec3::new(0.3, 0.2, 4.0), origin, DVec3::Y, view, [150, 90]).unwrap()
}

fn materials() -> [Material; 2] {
    [Material::default(), Material { surface_opacity: SurfaceOpacity::ThinSlab, ..Material::default() }]
}

/// How far the words of two splats lie apart, and whether they are equal in bits.
fn apart(a: &[u32], b: &[u32]) -> (f32, bool) {
    assert_eq!(a[7], b[7], "ids and kind");
    // Halves of extents: one step of the upper half of a float is 2^-7 of it.
    let extents = |w: u32| [w & 0xffff, w >> 16];
    let steps = extents(a[6]).into_iter().zip(extents(b[6])).map(|(a, b)| a.abs_diff(b)).max().unwrap();
    let share = |places: std::ops::Range<usize>| {
        let numbers = |words: &[u32]| words[places.clone()].iter().map(|w| f32::from_bits(*w)).collect::<Vec<_>>();
        let a = numbers(a);
        let b = numbers(b);
        let largest = a.iter().fold(f32::MIN_POSITIVE, |most, v| most.max(v.abs()));
        a.iter().zip(&b).map(|(a, b)| (a - b).abs() / largest).fold(0.0, f32::max)
    };
    let mut most = [0..2, 2..5, 5..6].map(share).into_iter().fold(0.0, f32::max);
    if a.len() > 8 {
        let slope = share(9..11) * (TOLERANCE / SLOPE_TOLERANCE);
        most = [share(8..9), share(11..12), share(12..15), slope].into_iter().fold(most, f32::max);
    }
    (if steps > 1 { 1.0 } else { most }, a == b)
}

fn on_device(device: &mut Device, cloud: &Cloud, ids: Option<&[u32]>, camera: &Camera, depth: bool) -> (Vec<u32>, u64) {
    let footprints = FootprintStack::default();
    let materials = materials();
    let params = Params::default();
    let attributes = Attributes::new(cloud, ids).unwrap();
    let layers = footprints.layers().len() as u32;
    let room = Capacities { attributes: attributes.room(), footprints: layers, materials: 2, depth };
    let recorded = record(room).unwrap();
    let origin = cloud.origin;
    let input = Input { origin, camera, footprints: &footprints, materials: &materials, params: &params };
    let uploads = recorded.uploads(&input, &attributes).unwrap();
    let inputs = [&recorded.inputs(&uploads)[..], &attributes.inputs(&recorded.attributes)[..]].concat();
    let run = device.run(&recorded.recording, &inputs).unwrap();
    (words(run.bytes(recorded.splats)), visible(run.bytes(recorded.state)).unwrap())
}

#[test]
fn footprints_and_their_number_are_the_cpu_s() {
    let mut device = open().unwrap();
    for (n, origin) in [(1, DVec3::ZERO), (257, DVec3::ZERO), (20_000, DVec3::new(1e7, -3e6, 5e6))] {
        let cloud = cloud(n, origin);
        for view in VIEWS {
            for depth in [false, true] {
                let camera = camera(origin, view);
                let twin = project(&ProjectInput {
                    cloud: &cloud,
                    camera: &camera,
                    footprints: &FootprintStack::default(),
                    materials: &materials(),
                    params: &Params::default(),
                    detail: Detail::ALL,
                });
                let expected = gpu::words(&twin, depth);
                let (found, count) = on_device(&mut device, &cloud, None, &camera, depth);
                assert_eq!(count, twin.visible(), "{n} {view:?}");
                assert!(n < 1000 || (count > n / 4 && count < n), "{count} of {n}");
                let words = if depth { 15 } else { 8 };
                assert_eq!(found.len(), expected.len());
                let mut most = 0.0f32;
                let mut same = 0;
                for (i, (a, b)) in expected.chunks(words).zip(found.chunks(words)).enumerate() {
                    assert_eq!(a[5] == 0, b[5] == 0, "splat {i} is shown by one alone");
                    if a[5] != 0 {
                        let (far, equal) = apart(a, b);
                        most = most.max(far);
                        same += u64::from(equal);
                    }
                }
                println!("{n} {view:?} {depth}: {most:e}, {same} of {count} equal");
                assert!(most <= TOLERANCE, "{n} {view:?}: {most:e}");
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn some_splats_of_a_cloud_are_projected_as_those() {
    let mut device = open().unwrap();
    let cloud = cloud(3000, DVec3::ZERO);
    let ids: Vec<u32> = (0..3000).filter(|i| i % 3 != 2).collect();
    let camera = camera(DVec3::ZERO, VIEWS[0]);
    let some = on_device(&mut device, &cloud, Some(&ids), &camera, true);
    assert_eq!(some, on_device(&mut device, &cloud.gather(&ids), None, &camera, true));
    // Without normals there is nothing to upload for them.
    let media: Vec<u32> = (0..3000).step_by(3).collect();
    let mut bare = cloud.gather(&media);
    let with = on_device(&mut device, &bare, None, &camera, false);
    (bare.normal, bare.tangent) = (Vec::new(), Vec::new());
    assert_eq!(with, on_device(&mut device, &bare, None, &camera, false));
    assert_eq!(on_device(&mut device, &Cloud::new(DVec3::ZERO), None, &camera, false).1, 0);
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn what_the_tables_do_not_have_is_refused() {
    let cloud = cloud(10, DVec3::ZERO);
    let attributes = Attributes::new(&cloud, None).unwrap();
    let footprints = FootprintStack::default();
    let materials = materials();
    let params = Params::default();
    let camera = camera(DVec3::ZERO, VIEWS[0]);
    let room = Capacities { attributes: attributes.room(), footprints: 9, materials: 2, depth: true };
    let uploads = |room: Capacities, materials: &[Material]| {
        let input =
            Input { origin: cloud.origin, camera: &camera, footprints: &footprints, materials, params: &params };
        record(room).unwrap().uploads(&input, &attributes).map(drop)
    };
    uploads(room, &materials).unwrap();
    assert!(matches!(uploads(room, &materials[..1]), Err(Error::Invalid { .. })));
    assert!(matches!(uploads(Capacities { materials: 1, ..room }, &materials), Err(Error::Overflow(_))));
    let mut few = room;
    few.attributes.splats = 9;
    assert!(matches!(uploads(few, &materials), Err(Error::Overflow(_))));
    few = room;
    few.attributes.frame_words = 3;
    assert!(matches!(uploads(few, &materials), Err(Error::ColumnLength { .. })));
    assert!(matches!(Attributes::new(&cloud, Some(&[10])), Err(Error::Invalid { .. })));
}
