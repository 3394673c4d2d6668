//! Shadow maps on a device: the CPU's lists, bit for bit, and its look-ups within a stated tolerance.

use gpu_conformance::{Device, open};
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::AbsorbanceModel;
use splat_core::{Cloud, Light, LightShape, Material, Receiver, Splat, SplatKind, Transmittance, rng};
use tsm::gpu::{Capacities, Room, record, record_look_up};
use tsm::{Deposits, MappingChoice, Params, Resolution, ShadowMap};

/// Media, surfaces and opaque discs at random places; some coincide.
fn mixed(n: u64, origin: DVec3, kinds: &[SplatKind]) -> Cloud {
    let mut cloud = Cloud::new(origin);
    for i in 0..n {
        let number = |k| rng::unit_f32(31, 0, i - u64::from(i % 7 == 0 && i > 0), k);
        let normal = Vec3::new(number(3) - 0.5, number(4) - 0.5, number(5) - 0.5).normalize();
        let kind = kinds[(i % kinds.len() as u64) as usize];
        cloud.push(&Splat {
            position: Vec3::new(number(0), number(1), number(2)) * 2.0 - 1.0,
            radius: 0.02 + 0.06 * number(6),
            cross_section: 1e-3 * number(7),
            kind,
            normal: if kind == SplatKind::Medium { Vec3::ZERO } else { normal },
            material: (i % 2) as u16,
            ..Splat::default()
        });
    }
    cloud
}

const ALL: [SplatKind; 4] = [SplatKind::Medium, SplatKind::Surface, SplatKind::Medium, SplatKind::Opaque];

fn point(position: DVec3) -> Light {
    Light { shape: LightShape::Point { position }, intensity: [1.0; 3] }
}

fn materials(coloured: bool) -> [Material; 2] {
    let extinction_rgb = if coloured { [1.0, 0.4, 0.05] } else { [1.0; 3] };
    [Material::default(), Material { extinction_rgb, ..Material::default() }]
}

fn deposits(cloud: &Cloud, coloured: bool, light: &Light, params: &Params) -> Deposits {
    Deposits::new(&tsm::Scene { cloud, materials: &materials(coloured), objects: &[] }, light, params, None).unwrap()
}

/// The lists by the device, in batches of at most so many entries and cells.
fn on_device(device: &mut Device, deposits: &Deposits, most: Capacities) -> (ShadowMap, usize) {
    let channels = deposits.channels() as u32;
    let batches = deposits.batches(Capacities { channels, ..most }).unwrap();
    let largest = |number: fn(&tsm::gpu::Batch) -> u64| batches.iter().map(number).max().unwrap_or(0) as u32;
    let room = Capacities { entries: largest(|b| b.entries()), cells: largest(|b| b.cells()), channels };
    let recorded = record(room);
    let mut ready = device.prepare(&recorded.recording).unwrap();
    let mut list = |batch| {
        let uploads = recorded.uploads(deposits, batch).unwrap();
        let run = ready.run(&recorded.inputs(&uploads)).unwrap();
        let reads = [recorded.spans, recorded.distances, recorded.totals].map(|b| run.bytes(b));
        recorded.listed(reads, batch).unwrap()
    };
    let listed = batches.iter().map(&mut list).collect();
    (deposits.join(listed).unwrap(), batches.len())
}

const ANY: Capacities = Capacities { entries: u32::MAX, cells: u32::MAX, channels: 1 };

#[test]
fn ou6_the_lists_are_the_cpu_s_bit_for_bit() {
    let mut device = open().unwrap();
    let far = DVec3::new(1e7, -3e6, 5e6);
    let beam = Light {
        shape: LightShape::Directional { direction: DVec3::new(0.3, -0.9, 0.2).normalize() },
        intensity: [1.0; 3],
    };
    let default = Params::default();
    let polar = Params { mapping: MappingChoice::PolarAzimuth, resolution: Resolution::Cells(90), ..Params::default() };
    // Lists that end early, and equal distances of coincident splats.
    let dim = Params { tolerance: 0.9, ..Params::default() };
    for (n, origin, coloured, light, params) in [
        (1, DVec3::ZERO, false, point(DVec3::Y * 3.0), &default),
        (4000, DVec3::ZERO, false, point(DVec3::ZERO), &default),
        (4000, far, true, point(far + DVec3::new(0.4, 2.0, -0.3)), &default),
        (4000, DVec3::ZERO, true, beam, &default),
        (4000, DVec3::ZERO, false, point(DVec3::new(0.1, 0.2, 0.3)), &polar),
        (4000, DVec3::ZERO, true, beam, &dim),
        (4000, DVec3::ZERO, false, point(DVec3::ZERO), &dim),
    ] {
        let deposits = deposits(&mixed(n, origin, &ALL), coloured, &light, params);
        let expected = deposits.clone().into_map();
        assert_eq!(deposits.channels(), if coloured { 3 } else { 1 });
        let (found, batches) = on_device(&mut device, &deposits, ANY);
        assert!(found == expected && batches == 1, "{n} {light:?} {params:?}");
        let counts = expected.counts();
        assert!(n == 1 || counts.entries > 10_000, "{counts:?}");
        assert!(n == 1 || params.tolerance < 0.5 || counts.kept < counts.entries * 9 / 10, "{counts:?}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn media_alone_surfaces_alone_and_nothing() {
    let mut device = open().unwrap();
    let light = point(DVec3::new(0.4, 2.0, -0.3));
    for kinds in [&[SplatKind::Medium][..], &[SplatKind::Surface], &[SplatKind::Opaque]] {
        let deposits = deposits(&mixed(500, DVec3::ZERO, kinds), false, &light, &Params::default());
        let expected = deposits.clone().into_map();
        assert!(on_device(&mut device, &deposits, ANY).0 == expected, "{kinds:?}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn batches_joined_are_the_map_of_all() {
    let mut device = open().unwrap();
    for coloured in [false, true] {
        let light = point(DVec3::new(0.4, 2.0, -0.3));
        let deposits = deposits(&mixed(4000, DVec3::ZERO, &ALL), coloured, &light, &Params::default());
        let expected = deposits.clone().into_map();
        let total: u64 = deposits.entries().iter().sum();
        let some = Capacities { entries: total as u32 / 5, cells: u32::MAX, channels: 1 };
        let (found, batches) = on_device(&mut device, &deposits, some);
        assert!(found == expected && batches > 4, "{batches}");
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

/// Most that a transmittance may differ by.
const TOLERANCE: f32 = 1e-6;
/// How far a receiver may seem to have moved, of lights about four units away: four roundings of its distance. On its way
/// through wgpu a kernel loses its `precise`, and the driver may fuse and factor what the CPU rounds step by step.
const MOVED: f32 = 1e-6;

/// The CPU's least and most light at a receiver, where kernels keep their `precise`; where not, there and around it.
fn lights(map: &ShadowMap, receiver: &Receiver) -> [[f32; 3]; 2] {
    let mut range = [map.transmittance(receiver); 2];
    if std::env::var("ORGANZA_EXECUTOR").is_ok_and(|name| name == "wgpu") {
        for to in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [-MOVED * axis, MOVED * axis]) {
            let light = map.transmittance(&Receiver { position: receiver.position + to, ..*receiver });
            for c in 0..3 {
                range[0][c] = range[0][c].min(light[c]);
                range[1][c] = range[1][c].max(light[c]);
            }
        }
    }
    range
}

/// The splats of a cloud, and bare points around.
fn receivers(cloud: &Cloud) -> Vec<Receiver> {
    let splat = |i: usize| Receiver {
        position: cloud.position[i],
        normal: cloud.normal_of(i),
        radius: cloud.radius[i],
        kind: cloud.kind[i],
    };
    let point = |i: u64| {
        let number = |k| 4.0 * rng::unit_f32(77, 0, i, k) - 2.0;
        let kind = if i.is_multiple_of(2) { SplatKind::Medium } else { SplatKind::Surface };
        Receiver { position: Vec3::new(number(0), number(1), number(2)), normal: Vec3::ZERO, radius: 0.0, kind }
    };
    // Where maps begin and end, and where their directions fold.
    let edges = [Vec3::ZERO, Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::ONE, Vec3::splat(1e6)];
    let edges = edges.map(|position| Receiver { position, normal: Vec3::ZERO, radius: 0.0, kind: SplatKind::Medium });
    (0..cloud.len()).map(splat).chain((0..4000).map(point)).chain(edges).collect()
}

#[test]
fn look_ups_are_the_cpu_s_within_the_tolerance() {
    let mut device = open().unwrap();
    let far = DVec3::new(1e7, -3e6, 5e6);
    let beam = |x, y, z| Light {
        shape: LightShape::Directional { direction: DVec3::new(x, y, z).normalize() },
        intensity: [1.0; 3],
    };
    let spot = |position: DVec3, angle: f64| Light {
        shape: LightShape::Spot { position, direction: DVec3::NEG_Y, inner: 0.5 * angle, outer: angle },
        intensity: [1.0; 3],
    };
    let default = Params::default();
    let paper = Params { absorbance: AbsorbanceModel::Paper, ..Params::default() };
    for (origin, coloured, light, params) in [
        (DVec3::ZERO, false, point(DVec3::ZERO), &default),
        (far, true, point(far + DVec3::new(0.4, 2.0, -0.3)), &default),
        (DVec3::ZERO, true, beam(0.3, -0.9, 0.2), &default),
        (DVec3::ZERO, false, beam(0.0, 0.0, 1.0), &default),
        (DVec3::ZERO, false, spot(DVec3::Y * 4.0, 0.5), &default),
        (DVec3::ZERO, false, point(DVec3::new(0.4, 2.0, -0.3)), &paper),
    ] {
        let cloud = mixed(4000, origin, &ALL);
        let map = deposits(&cloud, coloured, &light, params).into_map();
        let receivers = receivers(&cloud);
        let recorded = record_look_up(Room::for_map(&map, 3000).unwrap());
        recorded.recording.check().unwrap();
        let mut ready = device.prepare(&recorded.recording).unwrap();
        let uploads = recorded.map(&map).unwrap();
        let mut shadowed = 0;
        let mut most = 0f32;
        for (k, part) in receivers.chunks(3000).enumerate() {
            let uploaded = recorded.receivers(&map, &uploads, part).unwrap();
            // The map stays where it is for the runs behind the first.
            let run = ready.run(&recorded.inputs((k == 0).then_some(&uploads), &uploaded)).unwrap();
            let found = recorded.transmittances(run.bytes(recorded.lights), &uploaded).unwrap();
            for (receiver, found) in part.iter().zip(found) {
                let [least, greatest] = lights(&map, receiver);
                shadowed += u32::from(least[0] > 0.01 && greatest[0] < 0.99);
                for c in 0..3 {
                    let off = (least[c] - found[c]).max(found[c] - greatest[c]);
                    most = most.max(off);
                    assert!(off <= TOLERANCE, "{receiver:?}: {found:?}, not {least:?} to {greatest:?}");
                }
            }
        }
        assert!(shadowed > 1000, "{shadowed} are in half shadow");
        println!("{most:e} at most of {:?}", light.shape);
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn ts06_all_points_in_one_cell_and_sums_beyond_what_they_hold() {
        let mut device = open().unwrap();
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..20_000u64 {
            // Most lie behind each other; some are as heavy as a sum can be, and heavier.
            let cross_section = if i % 1000 == 999 { 1e9 } else { 1e-5 * 10f32.powi(-((i % 16) as i32)) };
            let position = Vec3::new(0.9, 0.7, 0.4) * (1.0 + rng::unit_f32(6, 0, i / 3, 0));
            cloud.push(&Splat { position, radius: 0.01, cross_section, ..Splat::default() });
        }
        let params = Params { tolerance: f32::MIN_POSITIVE, resolution: Resolution::Cells(16), ..Params::default() };
        let deposits = deposits(&cloud, false, &point(DVec3::ZERO), &params);
        let expected = deposits.clone().into_map();
        let most = (0..expected.cells()).map(|cell| expected.list(cell).len()).max().unwrap();
        assert!(most > 300, "{most} in one cell");
        assert!(on_device(&mut device, &deposits, ANY).0 == expected);
        assert_eq!(device.take_messages(), [""; 0]);
    }
}
