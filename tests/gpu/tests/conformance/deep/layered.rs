//! Depths and objects of composited splats: the CPU's, within a stated tolerance.

use crate::splat::{Both, SIZE, Scene, TOLERANCE, VIEWS, discs, media, unit};
use gpu_conformance::open;
use splat_core::glam::DVec3;
use splat_core::raster::OpaqueImage;
use splat_core::{Cloud, DepthProfile, Direction, Material};

/// Most that a depth may differ by, of depths of about 4: the mean is a sum of as many shares as there are splats, and the
/// deviation the root of one of squares. Measured on lavapipe: 2.4·10⁻⁵ and 1.5·10⁻⁴.
const DEPTH_TOLERANCE: f32 = 5e-5;
/// Share of the pixels of which the first depth, the median or the object may be another splat's, and mean and deviation may
/// differ by more: where an optical depth lies within rounding of the level that is looked for, a splat adds an optical depth
/// that rounding swallows, or a piece of a medium ends a cell earlier or later.
const OTHER_SHARE: f64 = 1e-3;

/// Differences of mean and deviation that no more than that share of the pixels exceeds, and the share of pixels in which
/// first, median or object are others.
fn apart(both: &Both, solid: &OpaqueImage) -> ([f32; 2], f64) {
    let depths = |profile: &DepthProfile, acc: &splat_core::Accumulator, k: usize| {
        let plane = &acc.optical_depth[acc.optical_depth.len() / 2];
        let wall = solid.depth.get(k).copied().filter(|z| *z < f32::INFINITY);
        profile.depths(plane[k], wall)
    };
    let mut off = [vec![0f32], vec![0f32]];
    let mut others = 0;
    let n = both.cpu.depth.len().max(both.cpu.object.len());
    for k in 0..n {
        let mut other = both.cpu.object.get(k) != both.gpu.object.get(k);
        if let (Some(a), Some(b)) = (both.cpu.depth.get(k), both.gpu.depth.get(k)) {
            let a = depths(a, &both.cpu, k);
            let b = depths(b, &both.gpu, k);
            // Where nothing is, both say so; what is no number is as far apart as can be.
            let apart = |i: usize| if a[i] == b[i] { 0.0 } else { (a[i] - b[i]).abs().min(f32::INFINITY) };
            other |= !(apart(0) <= DEPTH_TOLERANCE && apart(1) <= DEPTH_TOLERANCE);
            (0..2).for_each(|i| off[i].push(apart(2 + i)));
        }
        others += usize::from(other);
    }
    let allowed = |mut off: Vec<f32>| {
        off.sort_by(f32::total_cmp);
        off[off.len() - 1 - (off.len() as f64 * OTHER_SHARE) as usize]
    };
    (off.map(allowed), others as f64 / n as f64)
}

/// Both kinds, of seven objects.
fn mixed() -> Cloud {
    let mut cloud = media(2000, DVec3::ZERO);
    let panes = discs(1500);
    (0..panes.len()).for_each(|i| cloud.push(&panes.get(i)));
    (0..cloud.len()).for_each(|i| cloud.object[i] = (7.0 * unit(i as u64, 90)) as u32 + 70_000);
    cloud
}

#[test]
fn depths_and_objects_are_the_cpu_s() {
    let mut device = open().unwrap();
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let wall = |k: usize| if (k / 9).is_multiple_of(2) { 3.7 } else { f32::INFINITY };
    let walls = OpaqueImage { depth: (0..pixels).map(wall).collect(), ..OpaqueImage::default() };
    let green = Material { extinction_rgb: [0.2, 1.0, 0.7], ..Material::default() };
    for opaque in [OpaqueImage::default(), walls] {
        for view in VIEWS {
            for (depths, objects, planes, channels) in
                [(true, true, 1, 3), (true, false, 3, 6), (false, true, 1, 3), (true, true, 3, 16)]
            {
                let mut cloud = mixed();
                (0..cloud.len()).step_by(2).for_each(|i| cloud.material[i] = u16::from(planes == 3));
                let opaque = opaque.clone();
                let materials = vec![Material::default(), green];
                let scene = Scene { depths, objects, planes, channels, opaque, materials, ..Scene::new(cloud, view) };
                let (both, difference) = scene.compare(&mut device);
                let ([mean, sigma], others) = apart(&both, &scene.opaque);
                let what = format!("{view:?} {depths} {objects} {planes}: {mean:e} {sigma:e} {others} {difference:e}");
                assert!(difference < TOLERANCE && others <= OTHER_SHARE, "{what}");
                // A deviation is the root of a variance: near 0 it loses half of the digits.
                assert!(mean <= DEPTH_TOLERANCE && sigma <= 20.0 * DEPTH_TOLERANCE, "{what}");
                assert_eq!((both.gpu.depth.is_empty(), both.gpu.object.is_empty()), (!depths, !objects));
                if objects {
                    let seen = both.gpu.object.iter().filter(|o| **o != u32::MAX).count();
                    assert!(seen > pixels / 2 && both.gpu.object.contains(&70_006), "{seen}");
                }
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn the_last_object_is_seen_back_to_front_and_wrong_depths_are_found() {
    let mut device = open().unwrap();
    let scene = Scene { objects: true, direction: Direction::BackToFront, ..Scene::new(mixed(), VIEWS[0]) };
    let (mut both, _) = scene.compare(&mut device);
    assert!(apart(&both, &scene.opaque).1 <= OTHER_SHARE);
    // Front to back it is another, and so are depths of a cloud that was moved by a thousandth.
    let forwards = Scene { objects: true, ..Scene::new(mixed(), VIEWS[0]) };
    both.cpu = forwards.compare(&mut device).0.cpu;
    assert!(apart(&both, &scene.opaque).1 < 0.2, "front and back agree on what is seen first");
    let deep = Scene { depths: true, ..Scene::new(mixed(), VIEWS[0]) };
    let (mut both, _) = deep.compare(&mut device);
    let mut moved = Scene { depths: true, ..Scene::new(mixed(), VIEWS[0]) };
    moved.cloud.position.iter_mut().for_each(|p| p.z += 1e-3);
    both.cpu = moved.compare(&mut device).0.cpu;
    let ([mean, _], others) = apart(&both, &deep.opaque);
    assert!(mean > 5e-4 && others > 0.5, "{mean:e} {others}");
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn depths_go_on_where_a_fold_before_ended() {
    let mut device = open().unwrap();
    let scene = Scene { depths: true, objects: true, ..Scene::new(mixed(), VIEWS[1]) };
    let order = scene.order();
    let empty = scene.accumulator();
    let (near, far) = order.split_at(1500);
    let whole = scene.both(&mut device, &order, &empty, 1 << 18).unwrap().gpu;
    let first = scene.both(&mut device, near, &empty, 1 << 18).unwrap().gpu;
    let second = scene.both(&mut device, far, &first, 1 << 18).unwrap().gpu;
    let both = Both { cpu: whole, gpu: second, counts: Default::default() };
    let ([mean, sigma], others) = apart(&both, &scene.opaque);
    assert!(
        mean <= DEPTH_TOLERANCE && sigma <= 20.0 * DEPTH_TOLERANCE && others <= OTHER_SHARE,
        "{mean} {sigma} {others}"
    );
    assert_eq!(device.take_messages(), [""; 0]);
}
