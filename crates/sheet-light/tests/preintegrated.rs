//! Classification of all values that a ray meets in a slab: the twin, closed forms, and what it refuses.

use crate::common::{
    apart, constant, cubic, draw, exact, forms, grid, input, largest, lit_in_middles, noise, parallel, perspective,
    transfer, unlit, volume,
};
use crate::half::common::{exact as exact_half, input as half_input, lit, sun};
use crate::twin::differences;
use sheet_light::half::{HalfParams, fold as fold_half};
use sheet_light::{Aligned, Classify, Error, GatherKernel, Params, Reconstruction, prepare};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Grid, LayerSet, LightShape, Material, TransferFunction, TransferPoint};

fn preintegrated(params: Params) -> Params {
    Params { classify: Classify::Preintegrated, ..params }
}

fn smooth(p: DVec3) -> f64 {
    (1.3 * p.x).sin() + (0.9 * p.y + p.z).cos() + 0.2 * p.z
}

/// The steepest that extinction rises in [`many_points`], per unit of value: by at most ten steps of .08 between two of 64 points.
const STEEPEST: f64 = 0.08 * 10.0 * 63.0;

/// A transfer function of so many points that they are looked up, not tried one by one.
fn many_points() -> TransferFunction {
    let point = |k: u16| {
        let share = f32::from(k) / 63.0;
        let color = [share, 1.0 - share, 0.3 + 0.5 * share * share];
        TransferPoint { value: share, color, extinction: f32::from(k * 37 % 11) * 0.08 }
    };
    TransferFunction::new((0..64).map(point).collect()).unwrap()
}

#[test]
fn preintegrated_sheets_are_those_of_the_twin() {
    let few = transfer(&[(0.2, 0.0), (0.45, 0.4), (0.55, 1.0), (0.65, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = unlit();
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.2, 0.6, -0.1), DVec3::new(-0.1, 0.1, -0.7));
    // A value is rounded to 24 bits, and extinction with it, on a way of 10 units through the volume.
    let rounded = STEEPEST * f64::from(f32::EPSILON) * 10.0;
    for (tf, axes, most) in [(&few, cubic(0.5), 2e-5), (&few, sheared, 2e-5), (&many_points(), sheared, rounded)] {
        let grid = grid([17, 13, 11], axes, noise);
        let volumes = [volume(&grid, tf, &material)];
        for camera in [parallel([3.0, 2.0, 8.0], 11.0, [70, 50]), perspective([2.0, 3.0, 6.0], 60.0, [50, 70])] {
            for slab_width in [None, Some(0.11), Some(1.7)] {
                let params = preintegrated(Params { slab_width, ..exact() });
                let [tau, color] = differences(&input(&volumes, &camera, &[]), &params);
                assert!(tau < most && color < 1e-5, "{slab_width:?}: {tau:e} {color:e}");
            }
        }
    }
}

#[test]
fn lit_preintegrated_sheets_of_several_volumes_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (0.62, 6.0), (0.64, 0.1), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material { specular: 0.3, shininess: 12.0, extinction_rgb: [0.7, 0.7, 0.7], ..Material::default() };
    let lights = [sun([1.0, 2.0, 1.5]), lit(LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) })];
    let fine = grid([16, 14, 12], cubic(0.3), smooth);
    let coarse = grid([7, 6, 5], cubic(0.9), |p| smooth(p + DVec3::X));
    let mut volumes = [volume(&fine, &tf, &material), volume(&coarse, &tf, &material)];
    volumes[0].normals = true;
    for camera in [parallel([3.0, 2.0, 8.0], 6.0, [48, 40]), perspective([2.0, 3.0, 8.0], 60.0, [40, 48])] {
        let [tau, color] = differences(&input(&volumes, &camera, &lights), &preintegrated(lit_in_middles()));
        assert!(tau < 2e-5 && color < 1e-4, "{tau:e} {color:e}");
    }
}

#[test]
fn preintegrated_sheets_along_a_lattice_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = unlit();
    let grid = grid([17, 13, 11], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([3.0, 2.0, 8.0], 11.0, [70, 50]);
    let params = preintegrated(Params { aligned: Aligned::Axis, ..exact() });
    let [tau, color] = differences(&input(&volumes, &camera, &[]), &params);
    assert!(tau < 2e-5 && color < 1e-5, "{tau:e} {color:e}");
}

#[test]
fn preintegrated_sheets_around_the_eye_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.2), (0.8, 0.1), (0.9, 0.5)]);
    let material = unlit();
    let grid = grid([17, 13, 11], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([0.4, 0.3, 1.1], 60.0, [50, 48]);
    let [tau, color] = differences(&input(&volumes, &camera, &[]), &preintegrated(exact()));
    assert!(tau < 2e-5 && color < 1e-5, "{tau:e} {color:e}");
}

/// Of a smooth field and a transfer function with edges, the error against slabs a sixteenth as wide is less than a third of that of the value in the middle.
#[test]
fn preintegrated_slabs_are_nearer_to_thin_ones() {
    let tf = transfer(&[(0.2, 0.0), (0.3, 2.0), (0.6, 0.4), (0.9, 0.4), (0.95, 3.0), (1.5, 3.0)]);
    let material = unlit();
    let field = grid([24, 22, 20], cubic(0.3), smooth);
    let volumes = [volume(&field, &tf, &material)];
    let camera = perspective([2.0, 3.0, 8.0], 50.0, [60, 56]);
    let input = input(&volumes, &camera, &[]);
    for params in &forms(&exact())[1..] {
        let picture = |classify, width| {
            draw(&input, &Params { classify, slab_width: Some(width), ..*params }).unwrap().0.channels
        };
        let thin = picture(Classify::After, 0.3 / 16.0);
        let error = |classify| {
            let found = picture(classify, 0.3);
            let pairs = found.iter().zip(&thin).flat_map(|(a, b)| a.iter().zip(b));
            let squares: Vec<f64> = pairs.map(|(a, b)| f64::from(a - b).powi(2)).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let middle = error(Classify::After);
        let all = error(Classify::Preintegrated);
        println!("{:?}: {middle:e}, {all:e}", params.reconstruction);
        assert!(all < middle / 3.0, "{:?}: {all:e} of {middle:e}", params.reconstruction);
    }
}

/// The picture of a volume by one of the modes, gathered linearly.
fn linear(field: &Grid, tf: &TransferFunction, classify: Classify, slab_width: f64) -> Accumulator {
    let material = unlit();
    let volumes = [volume(field, tf, &material)];
    let camera = parallel([0.0, 0.0, 9.0], 1.0, [16, 16]);
    let reconstruction = Reconstruction::Gather(GatherKernel::Linear);
    let params = Params { classify, reconstruction, slab_width: Some(slab_width), ..exact() };
    draw(&input(&volumes, &camera, &[]), &params).unwrap().0
}

/// Values rise by one per unit along the view, from −5 to 5.
fn ramp() -> Grid {
    grid([20, 20, 20], cubic(0.5), |p| p.z)
}

/// A lattice goes on straight for one step beyond its outermost voxels: where the second slab beyond a face lies farther out, the course of values bends a little.
#[test]
fn a_ramp_of_linear_extinction_has_its_closed_form() {
    // ∫ 0.1·(v + 5) dv from −5 to 5.
    let expected = 5.0;
    let tf = transfer(&[(-5.0, 0.0), (5.0, 1.0)]);
    for (width, most) in [(0.05, 1e-5), (0.07, 1e-5), (0.125, 1e-5), (0.31, 1e-3), (0.5, 1e-3)] {
        let found = linear(&ramp(), &tf, Classify::Preintegrated, width);
        for tau in &found.optical_depth[0] {
            assert!((tau - expected).abs() < most, "{width}: {tau}");
        }
    }
}

/// A peak of extinction a fiftieth of a slab wide has its whole optical depth, and its colour, which the middle of a slab misses.
#[test]
fn a_peak_between_two_sheets_is_seen_whole() {
    let width = 1.0;
    let peak = |at: f32| {
        let point = |value, extinction| TransferPoint { value, color: [0.25, 0.5, 1.0], extinction };
        TransferFunction::new(vec![point(at - 0.01, 0.0), point(at, 100.0), point(at + 0.01, 0.0)]).unwrap()
    };
    let mut missed = 0;
    for at in [-3.1, -0.6, 0.15, 0.2, 1.7] {
        let found = linear(&ramp(), &peak(at), Classify::Preintegrated, width);
        let middle = linear(&ramp(), &peak(at), Classify::After, width);
        for pixel in 0..found.optical_depth[0].len() {
            let tau = found.optical_depth[0][pixel];
            assert!((tau - 1.0).abs() < 1e-4, "{at}: {tau}");
            let opacity = 1.0 - (-1f32).exp();
            for c in 0..3 {
                let expected = [0.25, 0.5, 1.0][c] * opacity;
                assert!((found.channels[c][pixel] - expected).abs() < 1e-4, "{at}: {}", found.channels[c][pixel]);
            }
        }
        missed += usize::from(middle.optical_depth[0].iter().all(|tau| *tau == 0.0));
    }
    assert!(missed >= 4, "the middle of a slab misses {missed} of 5 peaks");
}

/// Extinction that begins at one value somewhere in a slab: the rest of the ray has it, whatever part of its first slab that is.
#[test]
fn a_step_between_two_sheets_has_its_exact_opacity() {
    for at in [-2.3f32, 0.05, 0.4, 3.87] {
        let tf = transfer(&[(at.next_down(), 0.0), (at, 0.2)]);
        let expected = 0.2 * (5.0 - at);
        let error = |classify| {
            let found = linear(&ramp(), &tf, classify, 0.5);
            found.optical_depth[0].iter().map(|tau| (tau - expected).abs()).fold(0.0, f32::max)
        };
        let found = error(Classify::Preintegrated);
        assert!(found < 1e-4, "{at}: {found:e}");
        assert!(error(Classify::After) > 0.001, "{at}: {}", error(Classify::After));
    }
}

#[test]
fn values_that_do_not_change_have_the_bits_of_their_class() {
    let tf = transfer(&[(1.0, 0.3), (3.0, 0.1), (4.0, 0.7)]);
    let material = unlit();
    for value in [0.0, 1.0, 2.2, 3.0, 9.0] {
        let field = grid([12, 10, 9], cubic(0.5), |_| value);
        let volumes = [volume(&field, &tf, &material)];
        for camera in [parallel([3.0, 4.0, 12.0], 8.0, [60, 50]), perspective([2.0, 3.0, 6.0], 60.0, [50, 60])] {
            let input = input(&volumes, &camera, &[]);
            for params in forms(&exact()) {
                let after = draw(&input, &params).unwrap().0;
                let found = draw(&input, &preintegrated(params)).unwrap().0;
                let most = after.optical_depth[0].iter().copied().fold(0.0, f32::max);
                assert!(most > 0.3 && largest(&found.optical_depth[0], &after.optical_depth[0]) < 4e-6 * most.max(1.0));
                assert!(apart(&found, &after) < 2e-6, "{value}: {}", apart(&found, &after));
            }
        }
    }
}

#[test]
fn preintegrated_pictures_do_not_depend_on_threads_or_ranges() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.51, 4.0), (0.52, 0.4), (0.9, 1.5)]);
    let material = unlit();
    let grid = grid([30, 31, 29], cubic(0.2), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 6.0], 60.0, [120, 110]);
    let input = input(&volumes, &camera, &[]);
    for params in forms(&exact()).map(preintegrated) {
        let by = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| draw(&input, &params).unwrap().0)
        };
        let one = by(1);
        let three = by(3);
        assert_eq!(one.channels, three.channels);
        assert_eq!(one.optical_depth, three.optical_depth);
        let mut parts = Accumulator::new(camera.size, 1, 3, true, true);
        let sheets = prepare(input.clone(), &params, None).unwrap();
        let layout = ChannelLayout::new(&LayerSet::default());
        for range in [f32::NEG_INFINITY..5.03, 5.03..6.0, 6.0..7.77, 7.77..f32::INFINITY] {
            sheets.fold(range, &[], &layout, &mut parts, None).unwrap();
        }
        let tau = largest(&one.optical_depth[0], &parts.optical_depth[0]);
        assert!(tau < 2e-5, "{tau:e}");
    }
}

#[test]
fn what_shows_between_hidden_values_is_never_skipped() {
    let material = unlit();
    // Two values that nothing is seen of, and what is seen between them only.
    let shown = [(0.45, 0.0), (0.5, 8.0), (0.55, 0.0)];
    let tf = transfer(&shown);
    let traced = transfer(&shown.map(|(value, extinction)| (value, extinction + 1e-4)));
    let field = grid([40, 38, 36], cubic(0.25), |p| if (p - DVec3::X).length() < 2.2 { 1.0 } else { 0.0 });
    for camera in [perspective([3.0, 2.0, 8.0], 60.0, [70, 64]), parallel([1.0, 5.0, 6.0], 8.0, [70, 64])] {
        for params in forms(&exact()).map(preintegrated) {
            let tau = |tf| {
                let volumes = [volume(&field, tf, &material)];
                draw(&input(&volumes, &camera, &[]), &params).unwrap().0.optical_depth[0].clone()
            };
            for (skipped, whole) in tau(&tf).iter().zip(tau(&traced)) {
                let trace = whole - skipped;
                assert!((-1e-5..=3e-3).contains(&trace), "{skipped}, {whole}");
            }
        }
    }
}

#[test]
fn half_vectors_refuse_it_by_name() {
    let tf = constant(1.0);
    let material = unlit();
    let field = grid([4, 4, 4], cubic(0.5), noise);
    let volumes = [volume(&field, &tf, &material)];
    let camera = parallel([0.0, 0.0, 4.0], 3.0, [16, 16]);
    let half = exact_half(None);
    let params = HalfParams { sheets: preintegrated(half.sheets), ..half };
    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
    let lights = [sun([1.0, 3.0, 2.0])];
    let layout = ChannelLayout::new(&LayerSet::default());
    let refused = fold_half(&half_input(&volumes, &camera, &lights), &params, &layout, &mut out, None);
    assert!(matches!(refused.err(), Some(Error::Parameter { name: "classify", .. })));
}
