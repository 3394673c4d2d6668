//! The older methods that the paper improves on: voxels classified before they are splatted, and slabs along the lattice.

use crate::common::{
    BEAUTY, apart, bcc_volume, body_centred, constant, cubic, draw, exact, grid, in_box, input, noise, parallel,
    perspective, transfer, unlit, volume,
};
use crate::twin::{Slope, differences};
use sheet_light::half::{HalfInput, HalfParams, fold};
use sheet_light::{Aligned, Classify, Error, Params, Volume, prepare};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{Accumulator, Camera, Grid, LayerSet, Light, LightShape, Material, Projection};

const BEFORE: Params = Params { classify: Classify::Before, ..EXACT };
const ALONG: Params = Params { aligned: Aligned::Axis, ..EXACT };
const EXACT: Params = Params {
    slab_width: None,
    reconstruction: sheet_light::Reconstruction::Splat,
    kernel: sheet_light::KernelShape { extent: 2.0, sigma: 0.7 },
    sections: 256,
    accumulation: splat_core::raster::Accumulation::F32,
    gradients: sheet_light::Gradients::Sheets,
    lighting: sheet_light::Lighting::Middle,
    classify: Classify::After,
    aligned: Aligned::View,
    transmittance_cutoff: 0.0,
    limits: splat_core::Limits { max_bytes: 1 << 33, max_elements: u64::MAX },
};

/// From the z axis so many degrees towards the x axis, around the origin.
fn turned(degrees: f64, height: f64, size: [u32; 2]) -> Camera {
    let (sin, cos) = degrees.to_radians().sin_cos();
    parallel([40.0 * sin, 0.0, 40.0 * cos], height, size)
}

fn smooth(p: DVec3) -> f64 {
    (1.3 * p.x).sin() + (0.9 * p.y + p.z).cos() + 0.2 * p.z
}

#[test]
fn older_methods_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = unlit();
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.2, 0.6, -0.1), DVec3::new(-0.1, 0.1, -0.7));
    let grids = [cubic(0.5), sheared].map(|axes| grid([17, 13, 11], axes, noise));
    let bcc = body_centred([11, 9, 18], 7.0, noise);
    let volumes =
        [volume(&grids[0], &tf, &material), volume(&grids[1], &tf, &material), bcc_volume(&bcc, &tf, &material)];
    let both = Params { classify: Classify::Before, ..ALONG };
    for volume in volumes {
        // Along k, i and j.
        for eye in [[3.0, 2.0, 8.0], [-8.0, 2.0, 3.0], [1.0, 8.0, -3.0]] {
            let camera = parallel(eye, 14.0, [60, 50]);
            for params in [BEFORE, ALONG, both] {
                let [tau, color] = differences(&input(&[volume], &camera, &[]), &params);
                assert!(tau < 2e-5 && color < 2e-5, "{eye:?}: {tau:e} {color:e}");
            }
        }
        let camera = perspective([2.0, 3.0, 6.0], 60.0, [50, 70]);
        let [tau, color] = differences(&input(&[volume], &camera, &[]), &BEFORE);
        assert!(tau < 2e-5 && color < 2e-5, "{tau:e} {color:e}");
    }
}

#[test]
fn lit_older_methods_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material { specular: 0.3, shininess: 12.0, ..Material::default() };
    let light = |shape, shadow| LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow };
    let sun = LightShape::Directional { direction: DVec3::new(-1.0, -2.0, -1.5).normalize() };
    let lamp = LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) };
    let lights = [light(sun, Some(&Slope as _)), light(lamp, None)];
    let grid = grid([22, 20, 18], cubic(0.3), smooth);
    let mut volumes = [volume(&grid, &tf, &material)];
    for normals in [false, true] {
        volumes[0].normals = normals;
        for eye in [[3.0, 2.0, 8.0], [-8.0, 2.0, 3.0]] {
            for params in [BEFORE, ALONG] {
                let camera = parallel(eye, 14.0, [70, 60]);
                let [tau, color] = differences(&input(&volumes, &camera, &lights), &params);
                assert!(tau < 2e-5 && color < 3e-4, "{eye:?}, normals {normals}: {tau:e} {color:e}");
            }
        }
    }
}

#[test]
fn values_classified_before_blur_a_thin_shell_and_after_do_not() {
    // A ramp of 1 a voxel along x, and a shell of 2 voxels in it: an extinction of 1 at its middle.
    let tf = transfer(&[(-1.0, 0.0), (0.0, 1.0), (1.0, 0.0)]);
    let material = unlit();
    let ramp = grid([25, 25, 5], cubic(1.0), |p| p.x);
    let volumes = [volume(&ramp, &tf, &material)];
    // 16 pixels a voxel.
    let camera = parallel([0.0, 0.0, 20.0], 1.0, [160, 16]);
    let row =
        |params| draw(&input(&volumes, &camera, &[]), params).unwrap().0.optical_depth[0][8 * 160..9 * 160].to_vec();
    let params = exact();
    let after = row(&params);
    let before = row(&BEFORE);
    let mut worst = 0.0f64;
    for (at, tau) in after.iter().enumerate() {
        let x = (at as f64 + 0.5 - 80.0) / 16.0;
        worst = worst.max((f64::from(*tau) - 5.0 * (1.0 - x.abs()).max(0.0)).abs());
    }
    let width = |row: &[f32]| {
        let most = row.iter().copied().fold(0.0, f32::max);
        row.iter().filter(|tau| **tau > 0.5 * most).count() as f64 / 16.0
    };
    let peak = before.iter().copied().fold(0.0, f32::max);
    println!(
        "after: width {:.3}, off by {worst:.4}; before: width {:.3}, peak {peak:.3} of 5",
        width(&after),
        width(&before)
    );
    // Reconstruction of a ramp by a smooth kernel waves a little.
    assert!(worst < 0.05, "{worst}");
    assert!((width(&after) - 1.0).abs() < 0.13, "{}", width(&after));
    // The voxel of the shell and no other has a class: what is seen is the kernel, σ 0.7.
    assert!(width(&before) > 1.4 && peak < 3.5, "{} {peak}", width(&before));
}

/// Root mean squares of the steps between pictures of a volume that turns by 0.1° each, from 44.5° to 45.5°.
fn steps(volume: Volume<'_>, params: &Params) -> Vec<f64> {
    let picture = |n: u32| {
        let camera = turned(44.45 + 0.1 * f64::from(n), 16.0, [48, 48]);
        draw(&input(&[volume], &camera, &[]), params).unwrap().0.channels
    };
    let pictures: Vec<_> = (0..=11).map(picture).collect();
    let step = |pair: &[Vec<Vec<f32>>]| {
        let squares = pair[0].iter().flatten().zip(pair[1].iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2));
        (squares.sum::<f64>() / f64::from(3 * 48 * 48)).sqrt()
    };
    pictures.windows(2).map(step).collect()
}

#[test]
fn slabs_along_the_lattice_pop_at_45_degrees_and_those_across_the_view_do_not() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = unlit();
    let grid = grid([16; 3], cubic(0.5), noise);
    let volume = volume(&grid, &tf, &material);
    let along = steps(volume, &ALONG);
    let across = steps(volume, &exact());
    let most = |steps: &[f64]| steps.iter().copied().fold(0.0, f64::max);
    let pop = most(&along) / most(&across);
    println!("steps along the lattice {along:.5?}, across the view {across:.5?}: pop score {pop:.2}");
    assert_eq!(along.iter().position(|s| *s == most(&along)), Some(5), "{along:?}");
    assert!(pop > 5.0, "{pop}");
    // No other step stands out.
    assert!(most(&across) < 1.5 * across.iter().copied().fold(f64::INFINITY, f64::min), "{across:?}");
}

#[test]
fn a_constant_volume_is_the_same_along_the_lattice() {
    let tf = constant(0.4);
    let material = unlit();
    let cartesian = grid([14, 12, 9], DMat3::from_diagonal(DVec3::new(0.4, 0.5, 0.7)), |_| 3.0);
    let bcc = body_centred([9, 8, 20], 5.0, |_| 3.0);
    let opaque: Vec<f32> = (0..3000).map(|at| 38.0 + (at % 60) as f32 * 0.08).collect();
    let of_cartesian = (volume(&cartesian, &tf, &material), DVec3::new(5.6, 6.0, 6.3));
    for (volume, side) in [of_cartesian, (bcc_volume(&bcc, &tf, &material), DVec3::splat(5.0))] {
        for degrees in [0.0, 30.0, 44.9, 45.1, 118.0] {
            let camera = turned(degrees, 8.0, [60, 50]);
            let drawn = |params: &Params, opaque: &[f32], cuts: &[f32]| {
                let mut out = Accumulator::new(camera.size, 1, 3, true, true);
                let volumes = [volume];
                let sheeted = prepare(input(&volumes, &camera, &[]), params, None).unwrap();
                for range in cuts.windows(2) {
                    sheeted.fold(range[0]..range[1], opaque, &BEAUTY, &mut out, None).unwrap();
                }
                out
            };
            // All of it, what is before a wall, and in ranges.
            let whole = [f32::NEG_INFINITY, f32::INFINITY];
            for (opaque, cuts) in
                [(&[][..], &whole[..]), (&opaque, &whole), (&[], &[f32::NEG_INFINITY, 39.3, 40.7, f32::INFINITY])]
            {
                let along = drawn(&ALONG, opaque, cuts);
                let across = drawn(&exact(), opaque, &whole);
                assert!(across.optical_depth[0].iter().any(|t| *t > 0.5));
                assert!(apart(&along, &across) < 1e-5, "{degrees}: {:e}", apart(&along, &across));
                // Profiles are of whole slabs.
                let seen = along.optical_depth[0].iter().enumerate().filter(|(_, tau)| **tau > 1.2 && cuts.len() == 2);
                for (at, tau) in seen {
                    let expected = in_box(&camera, side, at)[0] - (-1.0f64 / 255.0).ln_1p() / 0.4;
                    let [first, ..] = along.depth[at].depths(*tau, None);
                    assert!((f64::from(first) - expected).abs() < 0.01, "{degrees}, {at}: {first}, not {expected}");
                }
            }
        }
    }
}

#[test]
fn what_older_methods_do_not_draw_is_refused() {
    let tf = constant(0.4);
    let material = unlit();
    let grid: Grid = grid([6; 3], cubic(0.5), |_| 3.0);
    let volumes = [volume(&grid, &tf, &material); 2];
    let view = parallel([0.0, 0.0, 9.0], 3.0, [8, 8]);
    let lens =
        Camera::look_at(DVec3::Z * 9.0, DVec3::ZERO, DVec3::Y, Projection::Perspective { fov_y: 0.5 }, [8, 8]).unwrap();
    let refused = |volumes: &[Volume<'_>], camera: &Camera, params: Params, name: &str| {
        let refused = draw(&input(volumes, camera, &[]), &params);
        assert!(matches!(&refused, Err(Error::Parameter { name: n, .. }) if *n == name), "{name}: {refused:?}");
    };
    refused(&volumes[..1], &lens, ALONG, "aligned");
    refused(&volumes, &view, ALONG, "aligned");
    refused(&volumes[..1], &view, Params { slab_width: Some(0.5), ..ALONG }, "slab_width");
    let layout = ChannelLayout::new(&LayerSet::default());
    for (sheets, name) in [(BEFORE, "classify"), (ALONG, "aligned")] {
        let half = HalfInput {
            sheets: input(&volumes, &view, &[]),
            splats: None,
            polygons: &[],
            extended: Vec::new(),
            mapped: Vec::new(),
            opaque: &[],
        };
        let mut out = Accumulator::new([8, 8], 1, layout.count(), false, false);
        let refused = fold(&half, &HalfParams { sheets, ..HalfParams::default() }, &layout, &mut out, None);
        assert!(matches!(&refused, Err(Error::Parameter { name: n, .. }) if *n == name), "{name}: {refused:?}");
    }
}

#[test]
fn any_number_of_threads_gives_older_methods_the_same_bits() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = Material::default();
    let grid = grid([30, 26, 22], cubic(0.3), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([2.0, 3.0, 8.0], 10.0, [100, 80]);
    for params in [BEFORE, ALONG] {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| draw(&input(&volumes, &camera, &[]), &params).unwrap())
        };
        let one = with(1);
        for threads in [2, 3, 7] {
            assert_eq!(with(threads), one, "{threads} threads");
        }
    }
}
