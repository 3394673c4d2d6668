//! Soft shadows of opaque polygons, and on them: penumbras by similar triangles, the same light as many points.

use super::common::{ray, scattering};
use super::polygons::{polygons, wall, white};
use super::soft::{PIXEL, above, as_points, block, edge, extended, fine, on_threads, soft, under};
use crate::common::{BEAUTY, constant, cubic, grid, parallel, perspective, volume};
use sheet_light::half::{Drawn, Extended, HalfInput, HalfParams, Polygons, fold};
use splat_core::glam::DVec3;
use splat_core::{Accumulator, Camera, Grid, LightShape, Material, Mesh};

fn draw(input: &HalfInput<'_>, params: &HalfParams) -> (Accumulator, Drawn) {
    let mut out = Accumulator::new(input.sheets.camera.size, 1, 3, false, false);
    let drawn = fold(input, params, &BEAUTY, &mut out, None).unwrap();
    (out, drawn)
}

/// What lies between a light 6 above and z = 0, and what receives there.
struct Bench<'a> {
    /// Black and opaque.
    blocks: &'a [Grid],
    walls: &'a [Mesh],
    /// Thin.
    haze: Option<&'a Grid>,
    /// White, at z = 0; without it light on the haze there is looked at.
    floor: Option<&'a Mesh>,
}

impl Bench<'_> {
    /// (x, share of the light that arrives) along y = 0 at z = 0.
    fn profile(&self, light: &Extended<'static>, camera: &Camera, params: &HalfParams) -> Vec<[f64; 2]> {
        let thin = constant(0.001);
        let opaque = constant(400.0);
        let material = scattering();
        let paper = white();
        let black = Material { single_scattering_albedo: 0.0, ..material };
        let with = |casts_shadow: bool| {
            let blocks = self.blocks.iter().map(|block| volume(block, &opaque, &black));
            let haze = self.haze.iter().map(|haze| volume(haze, &thin, &material));
            let volumes: Vec<_> = blocks.chain(haze).map(|v| sheet_light::Volume { casts_shadow, ..v }).collect();
            let meshes = self.walls.iter().chain(self.floor);
            let all: Vec<_> = meshes.map(|mesh| Polygons { casts_shadow, ..polygons(mesh, &paper) }).collect();
            let (out, drawn) = draw(&HalfInput { polygons: &all, ..soft(&volumes, camera, vec![*light]) }, params);
            let seen = if self.floor.is_some() { &drawn.polygons.channels } else { &out.channels };
            seen[0].clone()
        };
        let dark = with(true);
        let open = with(false);
        let width = camera.size[0] as usize;
        let mut out = Vec::new();
        for k in 0..dark.len() {
            let (from, along) = ray(camera, k % width, k / width);
            let place = from - along * (from.z / along.z);
            if place.y.abs() < 0.001 && place.x.abs() < 1.55 {
                out.push([place.x, f64::from(dark[k] / open[k])]);
            }
        }
        out.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert!(out.len() > 60, "{} places are seen", out.len());
        out
    }
}

/// Penumbras of an edge at x = 0, 4 below lights and 2 above what receives: 2R·d2/d1 = R, whose deviation is a quarter of that for what
/// projects to a half circle.
fn check(bench: &Bench<'_>, cameras: &[Camera], slabs: &[f64], near: f64) {
    for camera in cameras {
        for (kind, radius, widths) in [(0, 0.3, 4.0), (1, 0.6, 4.0), (2, 0.6, 12f64.sqrt())] {
            for slabs in slabs {
                let profile = bench.profile(&extended(above(kind, radius), 32), camera, &fine(*slabs));
                let [mean, deviation] = edge(&profile);
                let width = deviation * widths;
                let what = format!("{slabs} slabs, light {kind} of {radius}: {width} wide at {mean}");
                println!("{what}");
                assert!((width - radius).abs() < PIXEL + 0.03 * radius && mean.abs() < near * PIXEL, "{what}");
            }
        }
    }
}

fn half_plane() -> Mesh {
    wall([-0.9, 0.0, 2.0], [0.9, 0.0, 0.0], [0.0, 0.6, 0.0])
}

fn from_aside() -> Camera {
    parallel([8.0, 0.0, 5.0], 0.1, [110, 5])
}

#[test]
fn hv09_penumbras_of_polygons_on_a_volume_are_as_wide_as_similar_triangles_say_whatever_the_slabs() {
    let receiver = block([-1.6, -0.4, -0.02], [1.6, 0.4, 0.02], 0.1);
    let walls = &[half_plane()][..];
    let haze = Some(&receiver);
    let bench = Bench { blocks: &[], walls, haze, floor: None };
    check(&bench, &[parallel([0.0, 0.0, -10.0], 0.1, [160, 5]), from_aside()], &[2.0, 50.0], 1.0);
    check(&bench, &[from_aside()], &[800.0], 1.0);
}

#[test]
fn hv09_penumbras_of_a_volume_on_polygons_are_as_wide_as_similar_triangles_say_wherever_these_lie() {
    let blocks = &[block([-1.8, -0.6, 1.98], [0.0, 0.6, 2.02], 0.2)][..];
    let floor = wall([0.0; 3], [1.6, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let around = block([-1.8, -0.6, -0.5], [1.8, 0.6, 1.0], 0.1);
    // Behind all slabs, and among them.
    for haze in [None, Some(&around)] {
        let bench = Bench { blocks, walls: &[], haze, floor: Some(&floor) };
        check(&bench, &[from_aside(), parallel([0.0, 4.0, 9.0], 0.1, [160, 5])], &[50.0], 1.5);
    }
}

/// Points of the light look for the volume far beside its images.
#[test]
fn hv08_polygons_beside_a_volume_keep_all_their_light() {
    let blocks = &[block([-0.3, -0.3, 1.9], [0.3, 0.3, 2.1], 0.1)][..];
    let floor = wall([0.0; 3], [1.6, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let bench = Bench { blocks, walls: &[], haze: None, floor: Some(&floor) };
    for kind in 0..3 {
        let profile = bench.profile(&extended(above(kind, 0.3), 32), &from_aside(), &fine(50.0));
        let (beside, below): (Vec<[f64; 2]>, Vec<[f64; 2]>) = profile.iter().partition(|[x, _]| x.abs() > 0.8);
        assert!(beside.len() > 30 && beside.iter().all(|[_, light]| (light - 1.0).abs() < 1e-6), "{kind}: {beside:?}");
        assert!(below.iter().any(|[_, light]| *light < 0.1), "{kind}: {below:?}");
    }
}

#[test]
fn hv09_penumbras_of_polygons_on_polygons_are_as_wide_as_similar_triangles_say() {
    let walls = &[half_plane()][..];
    let floor = wall([0.0; 3], [1.6, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let around = block([-1.8, -0.6, -0.5], [1.8, 0.6, 1.0], 0.1);
    for haze in [None, Some(&around)] {
        check(&Bench { blocks: &[], walls, haze, floor: Some(&floor) }, &[from_aside()], &[50.0], 1.0);
    }
}

/// Half of a light's points are behind the polygon and half behind the volume, so none is seen, by a polygon or in a medium: what is left is the width of
/// the seam. Shares of each, one times the other, would let a quarter through.
#[test]
fn a_polygon_and_a_volume_side_by_side_leave_no_light_between_them() {
    let blocks = &[block([0.0, -0.6, 1.98], [1.8, 0.6, 2.02], 0.2)][..];
    let walls = &[half_plane()][..];
    let floor = wall([0.0; 3], [1.6, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let receiver = block([-1.6, -0.4, -0.02], [1.6, 0.4, 0.02], 0.1);
    for (kind, in_haze) in (0..3).flat_map(|kind| [false, true].map(|in_haze| (kind, in_haze))) {
        let (haze, floor) = if in_haze { (Some(&receiver), None) } else { (None, Some(&floor)) };
        let bench = Bench { blocks, walls, haze, floor };
        let profile = bench.profile(&extended(above(kind, 0.6), 32), &from_aside(), &fine(50.0));
        let most = profile.iter().filter(|[x, _]| x.abs() < 1.0).map(|[_, light]| *light).fold(0.0, f64::max);
        println!("light {kind}, in haze {in_haze}: {most}");
        assert!(most < 0.05, "light {kind}, in haze {in_haze}: {most} comes through");
    }
}

/// A block of a medium, a floor below it and a plate before the light.
fn mixed(camera: &Camera, light: &Extended<'static>, one_sweep: bool, threads: usize) -> (Accumulator, Drawn) {
    let tf = constant(0.4);
    let material = scattering();
    let paper = white();
    let grid = grid([10, 6, 10], cubic(0.4), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let meshes = [
        wall([0.0, -1.8, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, -3.0]),
        wall([0.9, 2.6, 0.9], [0.5, 0.0, 0.0], [0.0, 0.1, 0.5]),
    ];
    let all = [polygons(&meshes[0], &paper), polygons(&meshes[1], &paper)];
    let points = as_points(light, 16);
    let (input, params) = under(&volumes, camera, (light, &points), one_sweep);
    on_threads(threads, || draw(&HalfInput { polygons: &all, ..input }, &params))
}

#[test]
fn polygons_and_a_medium_under_an_extended_light_are_those_under_many_points_of_it() {
    let camera = perspective([1.0, 2.0, 12.0], 24.0, [24, 24]);
    let center = DVec3::new(2.0, 7.0, 3.0);
    let light = extended(LightShape::Disk { center, normal: -center.normalize(), radius: 0.8 }, 16);
    let [soft, points] = [true, false].map(|one_sweep| mixed(&camera, &light, one_sweep, 2));
    let apart = |a: &[f32], b: &[f32]| {
        let mean = b.iter().map(|v| f64::from(*v)).sum::<f64>() / b.len() as f64;
        let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / a.len() as f64;
        squares.sqrt() / mean
    };
    let medium = apart(&soft.0.channels[1], &points.0.channels[1]);
    let walls = apart(&soft.1.polygons.channels[1], &points.1.polygons.channels[1]);
    println!("RMSE over the mean: medium {medium:.4}, walls {walls:.4}");
    assert!(medium < 0.03 && walls < 0.03, "{medium} {walls}");
    assert!(mixed(&camera, &light, true, 3) == soft, "as with two threads");
}

#[test]
fn hv10_polygons_under_a_light_without_extent_have_the_shadow_of_a_point() {
    let camera = from_aside();
    let walls = &[half_plane()][..];
    let floor = wall([0.0; 3], [1.6, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let bench = Bench { blocks: &[], walls, haze: None, floor: Some(&floor) };
    let center = DVec3::Z * 6.0;
    let [one, many] =
        [1, 32].map(|n| bench.profile(&extended(LightShape::Point { position: center }, n), &camera, &fine(50.0)));
    assert_eq!(one, many);
    let tiny = bench.profile(&extended(LightShape::Sphere { center, radius: 1e-9 }, 32), &camera, &fine(50.0));
    assert!(edge(&tiny)[1] < PIXEL);
}
