//! Translucent polygons among slabs across the view: closed forms, what slabs across half vectors show of the same, splats beside them, edges, limits.

use crate::common::{
    BEAUTY, apart, constant, cubic, exact, grid, input, largest, parallel, perspective, unlit, volume,
};
use crate::half::common::{input as half_input, lamp, scattering, sun};
use crate::half::polygons::{polygons, wall, white};
use crate::splats::{Shown, alone};
use sheet_light::half::{Bodies, HalfInput, HalfParams, Polygons, SampledLight, fold, light_list_bytes, pane_bytes};
use sheet_light::{Aligned, Error, Params, SheetInput, prepare};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::triangles::PlacedMesh;
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Cloud, Limits, Material, Mesh, Splat};

/// One that lets e^−τ through.
fn pane<'a>(mesh: &'a Mesh, material: &'a Material, optical_depth: f32) -> Polygons<'a> {
    Polygons { optical_depth, ..polygons(mesh, material) }
}

/// In ranges of depth that end at these, and behind all.
fn draw(
    input: &SheetInput<'_>,
    (panes, opaque): (&[Polygons<'_>], &[f32]),
    params: &Params,
    ends: &[f32],
) -> Accumulator {
    let mut out = Accumulator::new(input.camera.size, 1, 3, true, true);
    let sheeted = prepare(input.clone(), params, None).unwrap();
    let sheeted = sheeted.with_polygons(panes, opaque, &BEAUTY, None).unwrap();
    let ends: Vec<f32> = [f32::NEG_INFINITY].iter().chain(ends).chain(&[f32::INFINITY]).copied().collect();
    ends.windows(2).for_each(|range| {
        sheeted.fold(range[0]..range[1], opaque, &BEAUTY, &mut out, None).unwrap();
    });
    out
}

fn slabs(width: f64) -> Params {
    Params { slab_width: Some(width), ..exact() }
}

#[test]
fn panes_in_a_medium_have_the_closed_form_at_any_slabs_and_in_any_ranges_of_depth() {
    let sigma = 0.4f64;
    let half = 3.0f64;
    let tau = 0.35f64;
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let tf = constant(sigma as f32);
    let medium = unlit();
    let paper = unlit();
    let volumes = [volume(&grid, &tf, &medium)];
    let places = [3.4, 2.2, 0.9, 0.25, 0.0, -0.6, -2.9, -3.2];
    let meshes = places.map(|z| wall([0.0, 0.0, z], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]));
    let all = meshes.each_ref().map(|mesh| Polygons { color: [0.5; 3], ..pane(mesh, &paper, tau as f32) });
    let eye = |z: f64| {
        let before = places.iter().filter(|p| **p > z + 1e-9).count();
        sigma * (half - z).clamp(0.0, 2.0 * half) + tau * before as f64
    };
    let of_panes: f64 = places.iter().map(|z| -(-tau).exp_m1() * 0.5 * (-eye(*z)).exp()).sum();
    let faces: Vec<f64> =
        [half].into_iter().chain(places.into_iter().filter(|z| z.abs() < half)).chain([-half]).collect();
    let of_medium: f64 =
        faces.windows(2).map(|ends| -(-sigma * (ends[0] - ends[1])).exp_m1() * (-eye(ends[0] - 1e-6)).exp()).sum();
    let through = (-sigma * 2.0 * half - tau * places.len() as f64).exp();
    for camera in [parallel([0.0, 0.0, 12.0], 2.0, [9, 9]), perspective([0.0, 0.0, 12.0], 20.0, [9, 9])] {
        for (width, ends) in
            [0.1, 0.5, 1.3, 40.0].into_iter().flat_map(|w| [&[][..], &[8.0, 11.93, 12.0, 15.3]].map(|ends| (w, ends)))
        {
            let out = draw(&input(&volumes, &camera, &[]), (&all, &[]), &slabs(width), ends);
            let found = [out.channels[0][40], (-out.optical_depth[0][40]).exp()].map(f64::from);
            assert!((found[1] - through).abs() < 1e-6, "slabs {width}, {ends:?}: {found:?}, not {through}");
            let error = (found[0] - of_panes - of_medium).abs();
            assert!(error < 1e-5, "slabs {width}, {ends:?}: {}, by {error:e}", found[0]);
        }
    }
}

/// A haze, two panes that cross in it and reach beyond, and a wall.
fn crossing(test: impl Fn(&HalfInput<'_>)) {
    let tf = constant(0.7);
    let medium = scattering();
    let paper = Material { transmission: 0.3, ..white() };
    let grid = grid([4, 4, 4], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &medium)];
    let meshes = [
        wall([0.2, 0.1, 0.0], [1.5, 0.3, 0.2], [0.0, 0.2, 1.6]),
        wall([0.2, 0.1, 0.0], [1.6, -0.3, 0.1], [0.1, 1.3, 0.4]),
        wall([-0.5, 1.0, -0.2], [0.8, 0.0, 0.1], [0.0, 0.7, 0.1]),
    ];
    let [a, b, c] = meshes.each_ref();
    let all = [
        Polygons { object: 3, ..pane(a, &paper, 0.5) },
        Polygons { object: 4, color: [0.2, 0.5, 0.9], ..pane(b, &paper, 0.8) },
        polygons(c, &paper),
    ];
    for camera in [parallel([3.0, 2.0, 8.0], 5.0, [60, 52]), perspective([2.0, 3.0, 8.0], 35.0, [52, 60])] {
        let lights = [sun([1.0, 3.0, 2.0])];
        let mapped = HalfInput { polygons: &all, mapped: lights.to_vec(), ..half_input(&volumes, &camera, &[]) };
        test(&mapped);
    }
}

/// What slabs across the view show of it, and the depths of its wall.
fn across_view(scene: &HalfInput<'_>, params: &Params) -> (Accumulator, Accumulator, Vec<f32>) {
    let mut half = Accumulator::new(scene.sheets.camera.size, 1, 3, true, true);
    let wall = fold(scene, &HalfParams { sheets: *params, ..HalfParams::default() }, &BEAUTY, &mut half, None).unwrap();
    let depth = wall.polygons.depth;
    let input = SheetInput { lights: scene.mapped.clone(), ..scene.sheets.clone() };
    (draw(&input, (scene.polygons, &depth), params, &[]), half, depth)
}

#[test]
fn panes_that_cross_in_a_volume_are_those_of_a_sweep_along_the_view() {
    crossing(|scene| {
        let (own, half, depth) = across_view(scene, &exact());
        let pixels = own.object.len();
        let seen = |object: u32| own.object.iter().filter(|o| **o == object).count();
        let found = [depth.iter().filter(|d| d.is_finite()).count(), seen(3), seen(4)];
        assert!(found.iter().all(|count| *count > 15), "{found:?} pixels of the wall and the panes");
        let by = [largest(&own.optical_depth[0], &half.optical_depth[0]), apart(&own, &half)];
        assert!(by.iter().all(|by| *by < 1e-5), "{by:?}");
        let first = |picture: &Accumulator, k: usize| picture.depth[k].depths(picture.optical_depth[0][k], None)[0];
        for k in (0..pixels).filter(|k| own.object[*k] >= 3 && own.optical_depth[0][*k] > 0.0) {
            assert_eq!(own.object[k], half.object[k], "pixel {k}");
            let by = (first(&own, k) - first(&half, k)).abs();
            assert!(by < 1e-4 || first(&own, k).is_nan(), "pixel {k}: {by}");
        }
    });
}

#[test]
fn any_number_of_threads_gives_the_same_bits_with_panes() {
    crossing(|scene| {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| across_view(scene, &Params::default()).0)
        };
        let one = with(1);
        [2, 3, 7].into_iter().for_each(|threads| assert_eq!(with(threads), one, "{threads} threads"));
    });
}

#[test]
fn an_edge_of_a_pane_is_that_of_an_opaque_one_and_a_wall_hides_it() {
    let haze = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let tf = constant(0.2);
    let medium = unlit();
    let mesh = wall([0.13, -0.21, 0.4], [0.9, 0.31, 0.0], [-0.27, 0.83, 0.1]);
    let white = white();
    let camera = perspective([0.3, 0.4, 6.0], 30.0, [60, 60]);
    let mut nothing = Accumulator::new(camera.size, 1, 3, false, false);
    let solid = HalfInput { polygons: &[polygons(&mesh, &white)], ..half_input(&[], &camera, &[]) };
    let solid = fold(&solid, &HalfParams::default(), &BEAUTY, &mut nothing, None).unwrap().polygons.depth;
    // Hides the left half.
    let opaque: Vec<f32> = (0..3600).map(|k| if k % 60 < 30 { 4.0 } else { f32::INFINITY }).collect();
    for volumes in [&[volume(&haze, &tf, &medium)][..], &[]] {
        let shown = |all: &[Polygons<'_>]| draw(&input(volumes, &camera, &[]), (all, &opaque), &exact(), &[]);
        let with = shown(&[pane(&mesh, &white, 0.5)]);
        let without = shown(&[]);
        let mut covered = 0;
        for k in 0..3600 {
            let expected = if solid[k].is_finite() && k % 60 >= 30 { 0.5 } else { 0.0 };
            covered += usize::from(expected > 0.0);
            let own = with.optical_depth[0][k] - without.optical_depth[0][k];
            assert!((own - expected).abs() < 2e-6, "pixel {k}: {own}, not {expected}");
            if volumes.is_empty() && expected > 0.0 {
                let [first, ..] = with.depth[k].depths(0.5, None).map(|depth| depth - solid[k]);
                assert!(first.abs() < 1e-5, "pixel {k}: {first} too deep");
            }
        }
        assert!(covered > 200, "{covered}");
    }
}

#[test]
fn a_splat_lies_before_a_pane_or_behind_it_however_wide_its_slab() {
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [9, 9]);
    let mesh = wall([0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let flat = unlit();
    for (z, width) in [0.4f32, -0.4].into_iter().flat_map(|z| [0.01, 40.0].map(|width| (z, width))) {
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat {
            position: Vec3::Z * z,
            normal: Vec3::Z,
            radius: 0.9,
            cross_section: 0.4,
            ..Splat::default()
        });
        let shown = Shown::new(cloud, &camera, vec![Material::default()]);
        let all = [Polygons { color: [0.0; 3], ..pane(&mesh, &flat, 0.7) }];
        let with = |all: &[Polygons<'_>]| draw(&alone(shown.splats(width), &camera), (all, &[]), &exact(), &[]);
        let (with, without) = (with(&all), with(&[]));
        let share = with.channels[0][40] / without.channels[0][40];
        let expected = if z > 0.0 { 1.0 } else { (-0.7f32).exp() };
        assert!(without.optical_depth[0][40] > 0.1 && (share - expected).abs() < 1e-5, "{z}, {width}: {share}");
        assert!((with.optical_depth[0][40] - without.optical_depth[0][40] - 0.7).abs() < 1e-6);
    }
}

#[test]
fn lists_that_take_too_much_and_lattices_are_refused() {
    let material = white();
    let tf = constant(0.1);
    let meshes: Vec<Mesh> = (0..40).map(|k| wall([0.0, 0.0, f64::from(k)], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0])).collect();
    let all: Vec<Polygons<'_>> = meshes.iter().map(|mesh| pane(mesh, &material, 0.05)).collect();
    let camera = parallel([0.0, 0.0, 60.0], 2.0, [64, 64]);
    let cube = grid([4, 4, 4], cubic(0.5), |_| 1.0);
    let volumes = [volume(&cube, &tf, &material)];
    let with = |params: &Params| {
        let sheeted = prepare(input(&volumes, &camera, &[]), params, None).unwrap();
        sheeted.with_polygons(&all, &[], &BEAUTY, None).map(|sheeted| sheeted.bytes()).map_err(|e| e.to_string())
    };
    assert!(with(&exact()).unwrap() > 40 * 4096 * 72);
    let said = with(&Params { limits: Limits::bytes(1 << 23), ..exact() }).unwrap_err();
    assert!(said.contains("layers of translucent triangles"), "{said}");
    let said = with(&Params { aligned: Aligned::Axis, ..exact() }).unwrap_err();
    assert!(said.contains("aligned") && said.contains("nothing beside it"), "{said}");
    let bad = [Polygons { shadow_coefficient: 2.0, ..all[0] }];
    let sheeted = prepare(input(&volumes, &camera, &[]), &exact(), None).unwrap();
    let Err(Error::Polygons(said)) = sheeted.with_polygons(&bad, &[], &BEAUTY, None) else { panic!("not refused") };
    assert!(said.to_string().contains("shadow_coefficient"), "{said}");
}

#[test]
fn what_lists_will_take_is_known_before() {
    let material = white();
    let slanted = |k: i32| wall([0.1 * f64::from(k), 0.0, 0.05 * f64::from(k)], [1.5, 0.3, 0.4], [-0.4, 1.2, -0.3]);
    let meshes: Vec<Mesh> = (0..24).map(slanted).collect();
    let all: Vec<Polygons<'_>> = meshes.iter().map(|mesh| pane(mesh, &material, 0.05)).collect();
    let placed: Vec<PlacedMesh<'_>> = all.iter().map(|pane| pane.placed).collect();
    let camera = perspective([1.0, 2.0, 7.0], 40.0, [90, 70]);
    // Of the eye: what is taken, and less where something hides half of it.
    let with = |panes: &[Polygons<'_>], opaque: &[f32]| {
        let sheeted = prepare(input(&[], &camera, &[]), &exact(), None).unwrap();
        sheeted.with_polygons(panes, opaque, &BEAUTY, None).unwrap().bytes()
    };
    let told = pane_bytes(&placed, &camera, &BEAUTY);
    let taken = with(&all, &[]) - with(&[], &[]);
    assert_eq!(told, taken);
    let wall: Vec<f32> = (0..6300).map(|k| if k < 3150 { 1.0 } else { f32::INFINITY }).collect();
    let half = with(&all, &wall) - with(&[], &[]);
    assert!(half > told / 8 && half < told * 7 / 8, "{half} of {told}");
    // Of a light: about, whatever its kind.
    for light in [sun([0.3, 1.0, 0.5]), lamp([2.0, 4.0, 1.0])] {
        let taken = |lights: &[LitBy<'_>]| {
            let mut out = Accumulator::new(camera.size, 1, 3, false, false);
            let input = HalfInput { polygons: &all, ..half_input(&[], &camera, lights) };
            let params = HalfParams { most_light_pixels: 256, ..HalfParams::default() };
            fold(&input, &params, &BEAUTY, &mut out, None).unwrap().counts.bytes
        };
        // What is taken holds twelve bytes a pixel of its images beside the lists.
        let taken = taken(&[light]) - taken(&[]);
        let told = light_list_bytes(&placed, &Bodies::default(), SampledLight { light: &light.light, samples: 1 }, 256);
        assert!(told > taken / 2 && told < taken && told > 1 << 19, "{told} told, {taken} taken");
    }
}
