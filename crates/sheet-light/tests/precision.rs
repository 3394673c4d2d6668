//! What kernel sections and the format of buffers cost: few places for kernels to begin, sums of half precision.

use crate::common::{
    BEAUTY, constant, cubic, draw, exact, grid, input, largest, noise, parallel, transfer, unlit, volume,
};
use crate::half::common::{draw as draw_half, exact as exact_half, input as half_input, scattering, sun};
use crate::half::twin::differences_of_form as differences_half;
use crate::twin::differences;
use sheet_light::half::{HalfParams, fold};
use sheet_light::{Error, Params, prepare};
use splat_core::raster::Accumulation;
use splat_core::{Accumulator, Exceeded};

const F16: Accumulation = Accumulation::F16;

/// Half a unit in the last of 11 bits.
const HALF_UNIT: f64 = 1.0 / 4096.0;

#[test]
fn few_sections_are_those_of_the_twin_and_show() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let plain = unlit();
    let scattering = scattering();
    let grid = grid([9, 8, 7], cubic(0.5), noise);
    let camera = parallel([3.0, 2.0, 8.0], 7.0, [36, 30]);
    let volumes = [volume(&grid, &tf, &plain)];
    let media = [volume(&grid, &tf, &scattering)];
    let lights = [sun([1.0, 3.0, 2.0])];
    let view = input(&volumes, &camera, &[]);
    let half = half_input(&media, &camera, &lights);
    let mut before = [f64::INFINITY; 2];
    for sections in [1, 4, 64] {
        let params = Params { sections, slab_width: Some(0.37), ..exact() };
        let [tau, color] = differences(&view, &params);
        assert!(tau < 2e-5 && color < 1e-5, "{sections}: {tau:e} {color:e}");
        let of_half = HalfParams { sheets: params, ..exact_half(None) };
        // Pixels that read the lattice have all sections.
        let [tau, color] = differences_half(&half, &of_half);
        assert!(tau < 2e-5 && color < 5e-5, "{sections}, half vector: {tau:e} {color:e}");
        // How far that is from all sections.
        let all = Params { sections: 256, ..params };
        let [few, all] = [params, all].map(|sheets| {
            let of_half = draw_half(&half, &HalfParams { sheets, ..of_half }).unwrap().0;
            [draw(&view, &sheets).unwrap().0.optical_depth[0].clone(), of_half.optical_depth[0].clone()]
        });
        for (slicing, before) in before.iter_mut().enumerate() {
            let apart = f64::from(largest(&few[slicing], &all[slicing]));
            assert!(apart > 1e-4 && apart < 0.7 * *before, "{sections}, slicing {slicing}: {apart:e} after {before:e}");
            *before = apart;
        }
    }
}

#[test]
fn sums_of_half_precision_lose_as_many_bits_as_slabs_round() {
    let tf = constant(0.25);
    let material = scattering();
    let grid = grid([10, 10, 8], cubic(0.5), |_| 1.0);
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [20, 20]);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 3.0, 2.0])];
    let view = input(&volumes, &camera, &[]);
    let half = half_input(&volumes, &camera, &lights);
    for slabs in [8.0, 64.0, 512.0] {
        let params = Params { accumulation: F16, slab_width: Some(4.0 / slabs), ..exact() };
        let of_half = HalfParams { sheets: params, ..exact_half(None) };
        for found in [draw(&view, &params).unwrap().0, draw_half(&half, &of_half).unwrap().0] {
            for tau in &found.optical_depth[0] {
                let lost = (f64::from(*tau) - 1.0).abs();
                // A rounding a slab, and one more for what is not whole.
                assert!(lost < (slabs + 1.0) * HALF_UNIT, "{slabs} slabs: {tau}");
                assert_eq!(tau.to_bits() & 0x1fff, 0, "{tau} has more than 11 bits");
            }
        }
    }
}

#[test]
fn sums_of_half_precision_show_in_sheets_and_light() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = scattering();
    let grid = grid([9, 8, 7], cubic(0.5), noise);
    let camera = parallel([3.0, 2.0, 8.0], 7.0, [36, 30]);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 3.0, 2.0])];
    let view = input(&volumes, &camera, &lights);
    let half = half_input(&volumes, &camera, &lights);
    let pictures = |accumulation| {
        let params = Params { accumulation, ..exact() };
        let of_half = HalfParams { sheets: params, ..exact_half(None) };
        [draw(&view, &params).unwrap().0, draw_half(&half, &of_half).unwrap().0]
    };
    for (exact, coarse) in pictures(Accumulation::F32).into_iter().zip(pictures(F16)) {
        let planes = [(&exact.optical_depth[0], &coarse.optical_depth[0]), (&exact.channels[1], &coarse.channels[1])];
        for (exact, coarse) in planes {
            let apart = largest(exact, coarse);
            let most = exact.iter().copied().fold(0.0, f32::max);
            // A value of 50 voxels is off by a few units, and more where the transfer function is steep.
            assert!(apart > 1e-4 * most && apart < 0.02 * most, "{apart:e} of {most:e}");
        }
    }
}

#[test]
fn sums_that_would_stall_are_refused() {
    let tf = constant(0.25);
    let material = scattering();
    let grid = grid([8, 8, 8], cubic(0.25), |_| 1.0);
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [20, 20]);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 3.0, 2.0])];
    let view = input(&volumes, &camera, &[]);
    let half = half_input(&volumes, &camera, &lights);
    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
    for (width, is_refused) in [(2.0 / 1000.0, false), (2.0 / 2100.0, true)] {
        let sheets = Params { accumulation: F16, slab_width: Some(width), kernel: THIN, ..exact() };
        let of_view = prepare(view.clone(), &sheets, None).map(|_| ());
        let of_half = fold(&half, &HalfParams { sheets, ..exact_half(None) }, &BEAUTY, &mut out, None).map(|_| ());
        for found in [of_view, of_half] {
            let stalls = matches!(found, Err(Error::Limit(Exceeded { limit: Some(2048), unit: "slabs", .. })));
            assert_eq!((stalls, found.is_ok()), (is_refused, !is_refused), "{found:?}");
        }
    }
    for sections in [0, 3, 512] {
        let refused = prepare(view.clone(), &Params { sections, ..exact() }, None);
        assert!(matches!(refused, Err(Error::Parameter { name: "sections", .. })), "{sections}");
    }
}

/// Kernels that touch few slabs, however thin these are.
const THIN: sheet_light::KernelShape = sheet_light::KernelShape { extent: 0.5, sigma: 0.2 };
