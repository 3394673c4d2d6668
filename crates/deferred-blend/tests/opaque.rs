//! Opaque surfaces in 1+1 and in 2+1 passes: closed forms, the twin in f64, hard cases.

#[path = "opaque/invariance.rs"]
mod invariance;
#[path = "opaque/voronoi.rs"]
mod voronoi;

use crate::floored::by_turns;
use crate::scenes::{Scene, camera, disc, parallel, plane, soup, sphere};
use deferred_blend::grouping::{
    Collisions, GraphParams, Groups, HashParams, OverlapGraph, hash_grouping, minimum_coloring,
};
use deferred_blend::{Discs, Error, Opaque, OpaqueInput, Params, Passes, Shown, reference, resolve_opaque};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Progress, Splat};

const SIZE: [u32; 2] = [40, 30];

/// 1+1 passes with the depth of Eq. 14.
pub(crate) fn voronoi(groups: &Groups) -> Passes<'_> {
    Passes::OnePlusOne { groups, voronoi: true }
}

/// 1+1 passes with plain depth.
pub(crate) fn plain(groups: &Groups) -> Passes<'_> {
    Passes::OnePlusOne { groups, voronoi: false }
}

/// The picture with three channels.
pub(crate) fn resolve(scene: &Scene, params: &Params, passes: Passes<'_>) -> Opaque {
    let discs = Discs::project(&scene.input(), params);
    let input = OpaqueInput {
        discs: &discs,
        shown: Shown::Discs(&scene.values),
        channels: 3,
        objects: true,
        passes,
        max_bytes: 1 << 30,
    };
    resolve_opaque(&input, params, None).expect("in range")
}

/// The colouring of least number.
fn minimum(scene: &Scene, params: &Params) -> Groups {
    let graph = GraphParams { disc_scale: params.disc_scale, ..GraphParams::default() };
    let graph = OverlapGraph::build(&scene.cloud, &graph, None).expect("a valid cloud");
    minimum_coloring(&graph, 256, None).expect("in range").groups
}

/// Places in an image of tens of pixels have this digit.
const STEP: f64 = 4e-6;

/// Every pixel against the twin. What is ε but for rounding may be told either way. Places in the image have 24 bits: where a disc is seen
/// nearly edge-on, or only rims are met, so small a step is seen in the twin too.
fn agrees_with_the_twin(scene: &Scene, (params, step): (&Params, f64), (name, passes): (&str, Passes<'_>)) {
    let picture = resolve(scene, params, passes);
    let [width, height] = scene.camera.size;
    let mut met = 0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let k = (y * width + x) as usize;
        let twin = |factor: f32, step: [f64; 2]| {
            let params = Params { gap: params.gap * factor, ..*params };
            let at = [f64::from(x) + 0.5 + step[0], f64::from(y) + 0.5 + step[1]];
            let seen = reference::opaque(&scene.input(), &params, passes, at, &scene.values, 3)?;
            assert_eq!(picture.disc[k], seen.disc as u32, "{name}, pixel {x} {y}");
            Some([seen.depth, seen.values[0], seen.values[1], seen.values[2]])
        };
        let channel = |c: usize| f64::from(picture.image.channels[c][k]);
        let drawn = [f64::from(picture.image.depth[k]), channel(0), channel(1), channel(2)];
        let apart = |a: [f64; 4], b: [f64; 4]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let difference = |factor: f32| {
            let Some(seen) = twin(factor, [0.0; 2]) else { return if drawn[0] == f64::INFINITY { 0.0 } else { 1.0 } };
            let error = apart(seen, drawn);
            if error < 2e-5 {
                return error;
            }
            let steps = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]];
            let of_steps: f64 =
                steps.map(|step| twin(factor, step).map_or(1.0, |other| apart(seen, other))).iter().sum();
            error - of_steps
        };
        let agrees = [1.0, 1.0 - 1e-4, 1.0 + 1e-4].into_iter().any(|factor| difference(factor) < 2e-5);
        assert!(agrees, "{name}, pixel {x} {y}: {:e}", difference(1.0));
        met += usize::from(picture.disc[k] != u32::MAX);
    }
    assert!(met > (width * height / 4) as usize, "{met} pixels");
}

fn every_way_agrees(scene: &Scene, params: (&Params, f64)) {
    agrees_with_the_twin(scene, params, ("2+1", Passes::TwoPlusOne));
    for count in [1, 3, 50] {
        let groups = by_turns(&scene.cloud, count);
        agrees_with_the_twin(scene, params, ("1+1 by Eq. 14", voronoi(&groups)));
        agrees_with_the_twin(scene, params, ("1+1 by depth", plain(&groups)));
    }
}

#[test]
fn every_opaque_pixel_is_the_twins() {
    let eye = DVec3::new(0.4, 0.3, 4.0);
    for view in [camera(eye, SIZE), parallel(eye, 2.5, SIZE)] {
        every_way_agrees(&Scene::new(soup(300, 1.0), view), (&Params::default(), STEP));
    }
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 300, 0.5);
    cloud.color.iter_mut().enumerate().for_each(|(k, color)| color[0] = (k % 7) as f32 / 7.0);
    let params = Params { disc_scale: 0.8, gap: 0.2, ..Params::default() };
    every_way_agrees(&Scene::new(cloud, camera(DVec3::new(0.0, 0.5, 3.0), SIZE)), (&params, STEP));
}

/// The eye is among the discs: behind some, on some, and some reach through its plane. Centres lie up to hundreds of pixels beside the
/// image, and places there have three bits less.
#[test]
fn db14_opaque_discs_edge_on_and_through_the_eye_plane_are_met_where_rays_meet_them() {
    let mut cloud = soup(200, 0.5);
    for k in 0..20 {
        // Edge-on for the middle of the image, to the last bit.
        let place = Vec3::new(0.0, 0.02 * (k - 10) as f32, -0.5) - cloud.origin.as_vec3();
        cloud.push(&disc(place, Vec3::Y, 0.1, 0.4));
    }
    for view in [camera(DVec3::new(0.05, 0.0, 0.1), SIZE), camera(DVec3::new(0.0, 0.0, 0.4), [41, 31])] {
        every_way_agrees(&Scene::new(cloud.clone(), view), (&Params::default(), 8.0 * STEP));
    }
}

/// Depths that 24 bits tell apart by more than ε: the plane is one surface all the same.
#[test]
fn db2_opaque_discs_a_million_units_away_are_one_surface() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let normal = Vec3::new(0.3, 0.2, 1.0);
    plane(&mut cloud, Vec3::ZERO, normal, 24, &disc(Vec3::ZERO, normal, 0.04, 0.5));
    cloud.color.iter_mut().enumerate().for_each(|(k, color)| color[0] = (k % 7) as f32 / 7.0);
    let scene = Scene::new(cloud, parallel(DVec3::Z * 1e6, 1.0, SIZE));
    let groups = minimum(&scene, &Params::default());
    let twin = |k: u32| {
        let at = [k % SIZE[0], k / SIZE[0]].map(|v| f64::from(v) + 0.5);
        let passes = Passes::TwoPlusOne;
        reference::opaque(&scene.input(), &Params::default(), passes, at, &scene.values, 3).expect("a large plane")
    };
    let twin: Vec<reference::Seen> = (0..SIZE[0] * SIZE[1]).map(twin).collect();
    for passes in [Passes::TwoPlusOne, plain(&groups), voronoi(&groups)] {
        let picture = resolve(&scene, &Params::default(), passes);
        for (k, seen) in twin.iter().enumerate() {
            assert!((f64::from(picture.image.depth[k]) - seen.depth).abs() < 0.1);
            assert!((f64::from(picture.image.channels[0][k]) - seen.values[0]).abs() < 2e-5, "pixel {k}");
        }
    }
}

#[test]
fn db1_opaque_discs_of_one_color_show_that_color_to_the_last_bit() {
    let mut cloud = soup(600, 1.0);
    cloud.color.fill([0.7, 1.0 / 3.0, 1e-30]);
    let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.0, 4.0), [48, 36]));
    let groups = [1, 2, 8, 256].map(|count| by_turns(&scene.cloud, count));
    let ways = groups.iter().flat_map(|groups| [plain(groups), voronoi(groups)]).chain([Passes::TwoPlusOne]);
    for passes in ways {
        let picture = resolve(&scene, &Params { disc_scale: 1.0, gap: 4.0, ..Params::default() }, passes);
        let seen = (0..48 * 36).filter(|&k| picture.image.depth[k] < f32::INFINITY);
        let color = |k: usize| [0, 1, 2].map(|c| picture.image.channels[c][k]);
        assert!(seen.clone().count() > 400);
        assert!(seen.clone().all(|k| color(k) == [0.7, 1.0 / 3.0, 1e-30]));
    }
}

#[test]
fn disjoint_discs_are_equal_by_every_way() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 0..49 {
        let at = Vec3::new((k % 7) as f32 - 3.0, (k / 7) as f32 - 3.0, 0.1 * (k % 5) as f32);
        let one = disc(at * 0.3, Vec3::new(0.1, 0.2, 1.0), 0.04, 0.5);
        cloud.push(&Splat { color: [0.02 * k as f32, 0.3, 0.9], ..one });
    }
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 2.2, [96, 96]));
    let one = by_turns(&scene.cloud, 1);
    let four = by_turns(&scene.cloud, 4);
    let expected = resolve(&scene, &Params::default(), Passes::TwoPlusOne);
    assert!(expected.disc.iter().filter(|disc| **disc != u32::MAX).count() > 300);
    for passes in [plain(&one), voronoi(&one), plain(&four), voronoi(&four)] {
        let picture = resolve(&scene, &Params::default(), passes);
        assert_eq!((&picture.image, &picture.disc), (&expected.image, &expected.disc));
    }
}

/// Figs. 3 and 4: where no two discs of a group overlap, the group's image has all of it that is seen.
#[test]
fn groups_that_do_not_overlap_lose_nothing() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for z in [0.0, -1.0] {
        let normal = Vec3::new(0.4, 0.2, 1.0);
        plane(&mut cloud, Vec3::Z * z, normal, 60, &disc(Vec3::ZERO, normal, 0.05, 0.5));
    }
    let planes = cloud.len();
    sphere(&mut cloud, Vec3::new(0.0, 0.3, 1.0), 0.4, 1500, 0.5);
    cloud.object[planes..].fill(1);
    cloud.color.iter_mut().enumerate().for_each(|(k, color)| *color = [(k % 7) as f32 / 7.0, (k % 2) as f32, 0.2]);
    let width = 120;
    let height = 90;
    let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.2, 4.0), [width, height].map(|s| s as u32)));
    let params = Params::default();
    let groups = minimum(&scene, &params);
    let expected = resolve(&scene, &params, Passes::TwoPlusOne);
    // Near a silhouette a ray meets the rims of two discs that lie apart; those of the ball are two pixels long.
    let object = |x: usize, y: usize| expected.image.object[y * width + x];
    let is_rim = |x: usize, y: usize| {
        let around = |v: usize, end: usize| v.saturating_sub(2)..(v + 3).min(end);
        around(y, height).any(|v| around(x, width).any(|u| object(u, v) != object(x, y)))
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let others: Vec<usize> = pixels.filter(|&(x, y)| !is_rim(x, y)).map(|(x, y)| y * width + x).collect();
    assert!(others.len() > 9000, "{}", others.len());
    for (name, passes) in [("depth", plain(&groups)), ("Eq. 14", voronoi(&groups))] {
        let picture = resolve(&scene, &params, passes);
        let apart = |&k: &usize| {
            let depth = (picture.image.depth[k] - expected.image.depth[k]).abs();
            let difference = |c: usize| (picture.image.channels[c][k] - expected.image.channels[c][k]).abs();
            depth.max(difference(0)).max(difference(1)).max(difference(2))
        };
        let worst = others.iter().map(apart).fold(0.0, f32::max);
        assert!(worst < 2e-5, "{name}: {worst:e}");
    }
}

/// A ball before a wall: its discs, their object and their depth are seen, and nothing of what they hide.
#[test]
fn what_is_nearest_is_told_by_disc_and_object() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, Vec3::Z * -1.0, Vec3::Z, 60, &Splat { object: 7, ..disc(Vec3::ZERO, Vec3::Z, 0.05, 0.5) });
    let wall = cloud.len();
    sphere(&mut cloud, Vec3::ZERO, 0.5, 1500, 0.5);
    cloud.object[wall..].fill(3);
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 2.0, [64, 64]));
    let groups = by_turns(&scene.cloud, 5);
    for passes in [Passes::TwoPlusOne, plain(&groups), voronoi(&groups)] {
        let picture = resolve(&scene, &Params::default(), passes);
        for k in 0..64 * 64 {
            let [x, y] = [(k % 64) as f32 - 31.5, (k / 64) as f32 - 31.5].map(|v| v / 32.0);
            let square = 0.25 - x * x - y * y;
            let object = picture.image.object[k];
            let depth = picture.image.depth[k];
            assert_eq!(object, scene.cloud.object[picture.disc[k] as usize]);
            if square > 0.02 {
                assert!(object == 3 && (depth - 3.0 + square.sqrt()).abs() < 0.02, "{depth}");
            } else if square < -0.05 {
                assert!(object == 7 && (depth - 4.0).abs() < 1e-5, "{depth}");
            }
        }
    }
}

#[test]
fn any_number_of_channels_is_taken_and_two_passes_meet_twice_as_many_fragments() {
    let scene = Scene::new(soup(300, 1.0), camera(DVec3::new(0.0, 0.0, 4.0), SIZE));
    let params = Params::default();
    let groups = by_turns(&scene.cloud, 4);
    let discs = Discs::project(&scene.input(), &params);
    let fragments = [voronoi(&groups), Passes::TwoPlusOne].map(|passes| {
        let one = resolve(&scene, &params, passes);
        for channels in [0, 1, 17] {
            let values: Vec<f32> = scene.values.chunks(3).flat_map(|v| (0..channels).map(move |c| v[c % 3])).collect();
            let channels = channels as u32;
            let max_bytes = 1 << 24;
            let input = OpaqueInput {
                discs: &discs,
                shown: Shown::Discs(&values),
                channels,
                objects: false,
                passes,
                max_bytes,
            };
            let image = resolve_opaque(&input, &params, None).expect("in range").image;
            assert_eq!((image.depth, image.object.len()), (one.image.depth.clone(), 0));
            assert_eq!(image.channels.len(), channels as usize);
            assert!(image.channels.iter().enumerate().all(|(c, plane)| *plane == one.image.channels[c % 3]));
        }
        one.counts.fragments
    });
    assert_eq!(2 * fragments[0], fragments[1]);
}

#[test]
fn db9_ten_thousand_opaque_discs_at_one_place_are_one_surface() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    (0..10_000).for_each(|_| cloud.push(&disc(Vec3::ZERO, Vec3::Z, 1.0, 0.5)));
    let scene = Scene::new(cloud, camera(DVec3::Z * 3.0, [16, 16]));
    let params = HashParams { groups: 8, collisions: Collisions::Keep, ..HashParams::default() };
    let one = hash_grouping(&scene.cloud, &params, None).expect("a valid cloud");
    let eight = by_turns(&scene.cloud, 8);
    for passes in [Passes::TwoPlusOne, plain(&one), voronoi(&one), plain(&eight), voronoi(&eight)] {
        let picture = resolve(&scene, &Params::default(), passes);
        let middle = 8 * 16 + 8;
        assert_eq!([0, 1, 2].map(|c| picture.image.channels[c][middle]), [0.7, 0.5, 0.25]);
        assert!((picture.image.depth[middle] - 3.0).abs() < 1e-5);
        assert_eq!(picture.disc[middle], 0, "of equals the first");
    }
}

/// 8 x 8 samples a pixel are an image 64 times as large, and 256 groups another 256 times if each had an image of its own.
#[test]
fn db16_memory_does_not_grow_with_groups_times_samples() {
    let params = Params::default();
    let bytes = |side: u32, count: u32| {
        let scene = Scene::new(soup(100, 1.0), camera(DVec3::new(0.0, 0.0, 4.0), [side; 2]));
        let groups = by_turns(&scene.cloud, count);
        resolve(&scene, &params, voronoi(&groups)).counts.bytes
    };
    let few = bytes(32, 1);
    let many = bytes(32, 256);
    let few_of_samples = bytes(256, 1);
    let many_of_samples = bytes(256, 256);
    let of_groups = rayon::current_num_threads() as u64 * 255 * 7 * 64;
    assert_eq!((many - few, many_of_samples - few_of_samples), (of_groups, of_groups));
    // Twelve planes of four bytes, twice five for the picture, two for the lists.
    assert!(few_of_samples < 256 * 256 * 48 + (1 << 20), "{few_of_samples}");
}

#[test]
fn what_is_too_much_is_refused_and_what_is_wrong_is_named() {
    let scene = Scene::new(soup(100, 1.0), camera(DVec3::new(0.0, 0.0, 4.0), [256, 256]));
    let params = Params::default();
    let discs = Discs::project(&scene.input(), &params);
    let groups = by_turns(&scene.cloud, 4);
    let passes = voronoi(&groups);
    let max_bytes = 1 << 24;
    let input = OpaqueInput {
        discs: &discs,
        shown: Shown::Discs(&scene.values),
        channels: 3,
        objects: false,
        passes,
        max_bytes,
    };
    let counts = resolve_opaque(&input, &params, None).expect("in range").counts;
    let enough = OpaqueInput { max_bytes: counts.bytes, ..input };
    assert!(resolve_opaque(&enough, &params, None).is_ok());
    for max_bytes in [counts.bytes - 1, 1000] {
        let refused = resolve_opaque(&OpaqueInput { max_bytes, ..input }, &params, None);
        assert!(matches!(refused, Err(Error::Limit(e)) if e.needed > max_bytes), "{max_bytes}");
    }
    let short = Groups::new(4, vec![0; 99]).expect("below the count");
    let refused = resolve_opaque(&OpaqueInput { passes: voronoi(&short), ..input }, &params, None);
    assert!(matches!(refused, Err(Error::Parameter { .. })), "{refused:?}");
    let refused = resolve_opaque(&input, &Params { gap: 0.0, ..params }, None);
    assert!(matches!(refused, Err(Error::Parameter { .. })));
    for count in [0, 257] {
        assert!(matches!(Groups::new(count, vec![]), Err(Error::Parameter { .. })));
    }
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(resolve_opaque(&input, &params, Some(&progress)), Err(Error::Cancelled));
}

#[test]
fn nothing_is_drawn_of_no_disc_and_of_discs_out_of_view() {
    let mut scene = Scene::new(soup(10, 1.0), camera(DVec3::new(0.0, 0.0, -40.0), SIZE));
    scene.camera = splat_core::Camera { axes: scene.camera.axes.map(|axis| -axis), ..scene.camera };
    let groups = by_turns(&scene.cloud, 2);
    for passes in [Passes::TwoPlusOne, voronoi(&groups)] {
        let picture = resolve(&scene, &Params::default(), passes);
        assert!(picture.image.depth.iter().all(|depth| *depth == f32::INFINITY));
        assert!(picture.disc.iter().chain(&picture.image.object).all(|id| *id == u32::MAX));
        assert!(picture.image.channels.iter().flatten().all(|value| *value == 0.0));
        let none = Scene { ids: Vec::new(), ..Scene::new(scene.cloud.clone(), scene.camera) };
        assert_eq!(resolve(&none, &Params::default(), passes), Opaque::default());
    }
}
