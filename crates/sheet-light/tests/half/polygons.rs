//! Opaque polygons among volumes: closed forms, regions, hard cases HV11 to HV13 and MS10.

use super::common::{exact, input, lamp, scattering, sun};
use crate::common::{BEAUTY, constant, cubic, grid, parallel, perspective, volume};
use sheet_light::Error;
use sheet_light::half::{Drawn, HalfInput, HalfParams, Polygons, Scattering, fold};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::triangles::PlacedMesh;
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Material, Mesh, Similarity};
use std::f64::consts::PI;

/// Reflects all light alike in all directions.
pub(crate) fn white() -> Material {
    Material { ambient: 0.0, diffuse: 1.0, specular: 0.0, ..Material::default() }
}

/// A parallelogram about a place.
pub(crate) fn wall(center: [f64; 3], u: [f32; 3], v: [f32; 3]) -> Mesh {
    let corner = |s: f32, t: f32| Vec3::from(u) * s + Vec3::from(v) * t;
    let position = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Mesh { origin: DVec3::from_array(center), position, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

pub(crate) fn polygons<'a>(mesh: &'a Mesh, material: &'a Material) -> Polygons<'a> {
    let placed = PlacedMesh { mesh, transform: Similarity::default() };
    let color = [1.0; 3];
    let object = 7;
    let optical_depth = f32::INFINITY;
    Polygons {
        placed,
        material,
        color,
        optical_depth,
        object,
        shadow_coefficient: 1.0,
        casts_shadow: true,
        radius: 0.0,
    }
}

fn draw(input: &HalfInput<'_>, params: &HalfParams) -> (Accumulator, Drawn) {
    let mut out = Accumulator::new(input.sheets.camera.size, 1, 3, false, true);
    let drawn = fold(input, params, &BEAUTY, &mut out, None).unwrap();
    (out, drawn)
}

/// Shadow maps of fewer pixels suffice for pictures as small.
fn coarse(slab_width: Option<f64>) -> HalfParams {
    HalfParams { most_light_pixels: 256, ..exact(slab_width) }
}

/// What one pixel shows: what is composited, how much that lets through, and the polygon behind it.
fn pixel((out, drawn): &(Accumulator, Drawn), k: usize) -> [f64; 3] {
    let polygon = drawn.polygons.channels.first().map_or(0.0, |plane| plane[k]);
    [f64::from(out.channels[0][k]), (-f64::from(out.optical_depth[0][k])).exp(), f64::from(polygon)]
}

/// What a white wall reflects of an irradiance of 1.
const REFLECTED: f64 = std::f64::consts::FRAC_1_PI;

#[test]
fn a_wall_in_a_medium_is_lit_and_seen_by_the_closed_form_at_any_depth_and_any_slabs() {
    let sigma = 0.4;
    let half = 3.0;
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let tf = constant(sigma as f32);
    let medium = scattering();
    let material = white();
    let volumes = [volume(&grid, &tf, &medium)];
    let camera = parallel([0.0, 0.0, 12.0], 2.0, [9, 9]);
    for (from, secant) in [([0.0, 0.0, 1.0], 1.0), ([0.28, 0.0, 0.96], 1.0 / 0.96)] {
        let lights = [sun(from)];
        for z in [2.9, 1.0, 0.25, 0.0, -0.37, -1.5, -2.95] {
            let mesh = wall([0.0, 0.0, z], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]);
            let all = [polygons(&mesh, &material)];
            for slab_width in [0.1, 0.5, 1.3, 40.0] {
                let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
                let found = pixel(&draw(&input, &coarse(Some(slab_width))), 40);
                let tau: f64 = sigma * (half - z);
                let scattered = -(-tau * (1.0 + secant)).exp_m1() / (1.0 + secant) / (4.0 * PI);
                let lit = REFLECTED / secant * (-tau * secant).exp();
                let expected = [scattered, (-tau).exp(), lit];
                let worst = (0..3).map(|n| (found[n] - expected[n]).abs() / [1.0 / (4.0 * PI), 1.0, 1.0 / PI][n]);
                let worst = worst.fold(0.0, f64::max);
                assert!(worst < 1e-4, "wall at {z}, slabs {slab_width}, {from:?}: {found:?}, not {expected:?}");
            }
        }
    }
}

#[test]
fn nothing_behind_a_wall_is_lit_and_its_back_is_dark() {
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let tf = constant(0.4);
    let medium = scattering();
    let material = white();
    let volumes = [volume(&grid, &tf, &medium)];
    // The light comes from the other side, or past the eye at a right angle.
    for (from, at) in [([0.0, 0.0, -1.0], [0.0, 0.0, 12.0]), ([0.1, 0.2, -1.0], [2.0, 3.0, 12.0])] {
        let camera = perspective(at, 20.0, [16, 16]);
        for (z, slab_width) in [0.0, -1.3].into_iter().flat_map(|z| [0.1, 0.5, 40.0].map(|width| (z, width))) {
            let mesh = wall([0.0, 0.0, z], [30.0, 0.0, 0.0], [0.0, 30.0, 0.0]);
            let all = [polygons(&mesh, &material)];
            let lights = [sun(from)];
            let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
            let (out, drawn) = draw(&input, &coarse(Some(slab_width)));
            assert!(out.channels[0].iter().all(|v| *v == 0.0), "wall at {z}, slabs {slab_width}");
            assert!(drawn.polygons.channels[0].iter().all(|v| *v == 0.0));
            assert!(out.optical_depth[0].iter().any(|tau| *tau > 0.5));
        }
    }
}

/// Light from +x, a wall in the plane x = 0 below y = 0: what of a ray is in its shadow.
#[test]
fn a_ray_through_the_edge_of_a_shadow_is_lit_in_part_at_any_slabs() {
    let sigma = 0.3;
    let grid = grid([16, 16, 16], cubic(0.5), |_| 1.0);
    let tf = constant(sigma as f32);
    let medium = scattering();
    let material = white();
    let volumes = [volume(&grid, &tf, &medium)];
    let mesh = wall([0.0, -20.0, 0.0], [0.0, 0.0, 40.0], [0.0, 20.0, 0.0]);
    let all = [polygons(&mesh, &material)];
    let lights = [sun([1.0, 0.0, 0.0])];
    // Seen from above, behind the wall and before it: rays cross the shadow's upper face.
    for at in [[-6.0, 9.0, 1.0], [3.0, 9.0, 1.0], [-9.0, 5.0, 0.5]] {
        let camera = parallel(at, 4.0, [12, 12]);
        for slab_width in [0.1, 0.5, 2.0, 40.0] {
            let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
            let drawn = draw(&input, &HalfParams { most_light_pixels: 1024, ..coarse(Some(slab_width)) });
            let mut seen = 0;
            for k in (0..144).step_by(7) {
                let (from, along) = super::common::ray(&camera, k % 12, k / 12);
                let Some([near, far]) = super::common::inside(&grid, from, along) else { continue };
                let wall = -from.x / along.x;
                let hits = wall > near && (from + along * wall).y < 0.0;
                let far = if hits { far.min(wall) } else { far };
                let n = 4000;
                let step = (far - near) / f64::from(n);
                let at = |i: i32| {
                    let t = near + (f64::from(i) + 0.5) * step;
                    let p = from + along * t;
                    if p.x < 0.0 && p.y < 0.0 { 0.0 } else { sigma * (-sigma * (t - near) - sigma * (4.0 - p.x)).exp() }
                };
                let expected = (0..n).map(at).sum::<f64>() * step / (4.0 * PI);
                let [found, ..] = pixel(&drawn, k);
                let error = (found - expected).abs() * 4.0 * PI;
                assert!(
                    error < 1.5e-3,
                    "from {at:?}, slabs {slab_width}: {found}, not {expected}",
                    at = camera.position
                );
                seen += 1;
            }
            assert!(seen > 10);
        }
    }
}

#[test]
fn no_light_comes_through_at_the_foot_of_a_wall_and_no_surface_shadows_itself() {
    let material = white();
    let floor = wall([0.0; 3], [5.0, 0.0, 0.0], [0.0, 0.0, 5.0]);
    let upright = wall([0.0, 0.5, 0.0], [5.0, 0.0, 0.0], [0.0, 0.5, 0.0]);
    let all = [polygons(&floor, &material), polygons(&upright, &material)];
    let camera = parallel([0.0, 30.0, -0.3], 2.0, [64, 64]);
    let params = HalfParams { most_light_pixels: 1024, ..exact(None) };
    let lights = [sun([0.3, 1.0, 1.0])];
    let input = HalfInput { polygons: &all, ..input(&[], &camera, &lights) };
    let (_, drawn) = draw(&input, &params);
    assert_eq!(drawn.counts.polygon_pixels, [4096, 0, 0]);
    let lit = REFLECTED / (1.0f64 + 1.0 + 0.09).sqrt();
    for (k, found) in drawn.polygons.channels[0].iter().enumerate() {
        let (from, along) = super::common::ray(&camera, k % 64, k / 64);
        let z = (from - along * (from.y / along.y)).z;
        // A pixel of the light is about 0.01 wide; the wall is seen from above.
        let expected = if z > -1.0 && z < -0.02 { 0.0 } else { lit };
        let is_at_an_edge = z.abs() <= 0.02 || (z + 1.0).abs() <= 0.04;
        if !is_at_an_edge {
            assert!((f64::from(*found) - expected).abs() < 1e-5, "{found} at {z}, not {expected}");
        }
    }
}

#[test]
fn a_ball_of_triangles_is_shaded_without_a_speck_of_its_own_shadow() {
    let material = white();
    let bands = 24u32;
    let turns = 48u32;
    let vertex = |k: u32| {
        let polar = PI * f64::from(k / turns) / f64::from(bands);
        let turn = 2.0 * PI * f64::from(k % turns) / f64::from(turns);
        DVec3::new(polar.sin() * turn.cos(), polar.cos(), polar.sin() * turn.sin()).as_vec3()
    };
    let cell = |k: u32| {
        let a = k;
        let b = k / turns * turns + (k + 1) % turns;
        [[a, b, b + turns], [a, b + turns, a + turns]]
    };
    let position: Vec<Vec3> = (0..(bands + 1) * turns).map(vertex).collect();
    let normal = position.clone();
    let mesh = Mesh { position, normal, triangles: (0..bands * turns).flat_map(cell).collect(), ..Mesh::default() };
    let all = [polygons(&mesh, &material)];
    for lit in [sun([1.0, 1.0, 2.0]), lamp([3.0, 4.0, 5.0])] {
        let camera = perspective([0.0, 0.0, 6.0], 25.0, [64, 64]);
        let lights = [lit];
        let shown = |casts_shadow: bool| {
            let all = [Polygons { casts_shadow, ..all[0] }];
            draw(&HalfInput { polygons: &all, ..input(&[], &camera, &lights) }, &coarse(None)).1.polygons
        };
        let with = shown(true);
        let without = shown(false);
        let brightest = without.channels[0].iter().copied().fold(0.0, f32::max);
        let specks =
            with.channels[0].iter().zip(&without.channels[0]).filter(|(a, b)| (**a - **b).abs() > 0.12 * brightest);
        assert_eq!(specks.count(), 0, "{:?}", lit.light.shape);
        assert!(with.depth.iter().filter(|z| z.is_finite()).count() > 1000);
    }
}

#[test]
fn hv12_walls_before_among_and_behind_slabs_and_on_their_faces_are_lit_once() {
    let sigma = 0.4;
    // Denser towards the eye, so that a slab is told from its neighbour; σ in the mean.
    let grid = grid([12, 12, 12], cubic(0.5), |p| sigma * (1.0 + 0.25 * p.z));
    let tf = crate::common::transfer(&[(0.0, 0.0), (1.0, 1.0)]);
    let medium = scattering();
    let material = white();
    let volumes = [volume(&grid, &tf, &medium)];
    let camera = parallel([0.0, 0.0, 20.0], 2.0, [8, 8]);
    for (from, before) in [([0.0, 0.0, 1.0], [0, 64, 0]), ([0.0, 0.0, -1.0], [0, 64, 0])] {
        let lights = [sun(from)];
        let shown = |z: f64| {
            let mesh = wall([0.0, 0.0, z], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]);
            let all = [polygons(&mesh, &material)];
            let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
            let found = draw(&input, &coarse(Some(0.5)));
            assert_eq!(found.1.counts.polygon_pixels.iter().sum::<u64>(), 64);
            assert!(found.1.polygons.depth.iter().all(|depth| (f64::from(*depth) - (20.0 - z)).abs() < 1e-5));
            (pixel(&found, 27), found.1.counts.polygon_pixels)
        };
        assert_eq!(shown(0.3).1, before);
        let (first, last) = if from[2] > 0.0 { (5.0, -5.0) } else { (-5.0, 5.0) };
        assert_eq!((shown(first).1, shown(last).1), ([64, 0, 0], [0, 0, 64]));
        // Faces of slabs lie half a spacing apart, those of the volume at 3 and −3.
        for z in [3.0, 2.5, 0.0, -1.5, -3.0] {
            let [lower, here, upper] = [z - 1e-6, z, z + 1e-6].map(|z| shown(z).0);
            for n in 0..3 {
                assert!(
                    (here[n] - lower[n]).abs() < 1e-5 && (here[n] - upper[n]).abs() < 1e-5,
                    "{z}: {lower:?} {here:?} {upper:?}"
                );
            }
        }
        // Behind all of the volume, and before it.
        if from[2] > 0.0 {
            let before = shown(4.0).0[2];
            let behind = shown(-4.0).0[2];
            assert!((before - REFLECTED).abs() < 1e-5 && (behind - before * (-sigma * 6.0f64).exp()).abs() < 1e-5);
        }
    }
}

/// A scene with polygons on all sides: intensities, order of lights, threads.
#[test]
fn hv13_hv16_brightness_scales_lights_swap_and_threads_change_no_bit() {
    let grid = grid([10, 10, 10], cubic(0.5), crate::common::noise);
    let tf = crate::common::transfer(&[(0.3, 0.0), (0.9, 1.5)]);
    let medium = scattering();
    let material = white();
    let volumes = [volume(&grid, &tf, &medium)];
    let meshes = [
        wall([0.2, -0.4, 0.1], [1.0, 0.2, 0.0], [0.0, 0.5, 0.9]),
        wall([0.0, -3.0, 0.0], [6.0, 0.0, 0.0], [0.0, 0.0, -6.0]),
    ];
    let all = meshes.each_ref().map(|mesh| polygons(mesh, &material));
    let camera = perspective([3.0, 4.0, 9.0], 40.0, [32, 24]);
    let shown = |lights: &[LitBy<'_>], threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let input = HalfInput { polygons: &all, ..input(&volumes, &camera, lights) };
        let (out, drawn) = pool.install(|| draw(&input, &coarse(None)));
        let bits = |planes: &[Vec<f32>]| planes.iter().flatten().map(|v| v.to_bits()).collect::<Vec<u32>>();
        (out.channels.clone(), drawn.polygons.channels.clone(), bits(&out.channels), bits(&drawn.polygons.channels))
    };
    // Of two the sum is the same either way round.
    let a = sun([1.0, 2.0, 1.0]);
    let b = lamp([-6.0, 7.0, -8.0]);
    let c = sun([-0.3, 1.0, 0.7]);
    let first = shown(&[a, b, c], 1);
    assert!(first.1[0].iter().filter(|v| **v > 0.0).count() > 200);
    for other in [shown(&[c, b, a], 2), shown(&[b, c, a], 3)] {
        assert!(first.2 == other.2 && first.3 == other.3);
    }
    let brighter = [a, b, c].map(|mut lit| {
        lit.light.intensity = lit.light.intensity.map(|i| i * 1048576.0);
        lit
    });
    let found = shown(&brighter, 2);
    for (one, other) in first.0.iter().chain(&first.1).flatten().zip(found.0.iter().chain(&found.1).flatten()) {
        assert_eq!(one * 1048576.0, *other);
    }
}

#[test]
fn a_lamp_with_walls_all_around_lights_them_and_a_post_keeps_its_light_off() {
    let material = white();
    let back = wall([0.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let post = wall([0.0, 0.0, -1.0], [0.2, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let beside = wall([0.0, 0.0, 2.5], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]);
    let all = [&back, &post, &beside].map(|mesh| polygons(mesh, &material));
    let mut lit = lamp([0.0, 0.0, 0.0]);
    lit.light.intensity = [4.0; 3];
    let lights = [lit];
    let camera = perspective([1.0, 0.0, 2.0], 70.0, [48, 48]);
    let input = HalfInput { polygons: &all, ..input(&[], &camera, &lights) };
    let (_, drawn) = draw(&input, &HalfParams { most_light_pixels: 1024, ..exact(None) });
    let mut dark = 0;
    for (k, found) in
        drawn.polygons.channels[0].iter().enumerate().filter(|(k, _)| (3.5..9.0).contains(&drawn.polygons.depth[*k]))
    {
        let (from, along) = super::common::ray(&camera, k % 48, k / 48);
        let p = from + along * ((-2.0 - from.z) / along.z);
        let distance = p.length();
        let lit = REFLECTED * 4.0 / (distance * distance) * (2.0 / distance);
        // The shadow of the post is twice as large.
        let [x, y] = [p.x.abs() - 0.4, p.y.abs() - 0.8];
        if x.max(y).abs() > 0.02 {
            let expected = if x.max(y) < 0.0 { 0.0 } else { lit };
            dark += u32::from(expected == 0.0);
            assert!((f64::from(*found) - expected).abs() < 1e-3 * lit, "{found}, not {expected} at {p}");
        }
    }
    assert!(dark > 10, "{dark}");
}

#[test]
fn ms10_no_flux_passes_a_wall_of_polygons() {
    let grid = grid([16, 16, 16], cubic(0.5), |_| 1.0);
    let tf = constant(1.0);
    let material = white();
    let medium = Material { single_scattering_albedo: 0.99, ..scattering() };
    let volumes = [volume(&grid, &tf, &medium)];
    let mesh = wall([0.0, 0.0, 0.0], [30.0, 0.0, 0.0], [0.0, 30.0, 0.0]);
    let all = [polygons(&mesh, &material)];
    let lights = [sun([0.0, 0.0, -1.0])];
    // From the side, rays beside the wall: before it to the left, behind to the right.
    let camera = parallel([20.0, 0.0, 0.0], 7.0, [32, 32]);
    let layout = BEAUTY.with_multiple();
    let mut out = Accumulator::new(camera.size, 1, layout.count(), false, false);
    let params = HalfParams { scattering: Scattering::ForwardAndBack, voxels_per_cell: 8, ..coarse(None) };
    let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
    fold(&input, &params, &layout, &mut out, None).unwrap();
    let column = |x: usize| (10..22).map(|y| out.channels[0][y * 32 + x]).fold(0.0, f32::max);
    // Two layers of cells are interpolated.
    let lit = column(26).max(column(5));
    let dark = column(26).min(column(5));
    assert!(lit > 0.01 && dark < 1e-6, "{lit} {dark}");
}

#[test]
fn what_is_no_mesh_is_refused_by_name() {
    let material = white();
    let camera = parallel([0.0, 0.0, 20.0], 2.0, [8, 8]);
    let refused = |input: &HalfInput<'_>| {
        let mut out = Accumulator::new([8, 8], 1, 3, false, false);
        fold(input, &exact(None), &BEAUTY, &mut out, None).err().unwrap().to_string()
    };
    let mut mesh = wall([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let shy = [Polygons { shadow_coefficient: f32::NAN, ..polygons(&mesh, &material) }];
    let said = refused(&HalfInput { polygons: &shy, ..input(&[], &camera, &[]) });
    assert!(said.contains("shadow_coefficient is NaN"), "{said}");
    mesh.triangles.push([0, 1, 9]);
    let all = [polygons(&mesh, &material)];
    let said = refused(&HalfInput { polygons: &all, ..input(&[], &camera, &[]) });
    assert!(said.contains("face 2: vertex index is [0, 1, 9]"), "{said}");
    assert!(matches!(Error::Polygons(splat_core::Error::Cancelled), Error::Polygons(_)));
}
