//! Input that breaks naive sheets.

use crate::common::{
    BEAUTY, apart, bcc_volume, body_centred, constant, cubic, draw, exact, grid, input, noise, parallel, perspective,
    transfer, unlit, volume,
};
use sheet_light::{Error, KernelShape, Params, prepare};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Exceeded, LayerSet, Limits, Material, Progress, TransferFunction, TransferPoint};

#[test]
fn ia02_a_flat_field_is_flat() {
    // Sums of kernels ripple by some percent, and colour and extinction follow the value: what is left of it shows.
    let tf = transfer(&[(0.0, 0.0), (1.0, 0.5), (2.0, 0.1)]);
    let material = unlit();
    let camera = parallel([1.0, 2.0, 12.0], 2.0, [64, 64]);
    let mut cartesian = grid([16; 3], cubic(0.5), |_| 0.6);
    let mut bcc = body_centred([11, 11, 22], 8.0, |_| 0.6);
    // Far beside the picture values are others: sums are of differences to the middle of all, which else were 0.
    (cartesian.values[0], bcc.planes.values[0]) = (2.0, 2.0);
    for volume in [volume(&cartesian, &tf, &material), bcc_volume(&bcc, &tf, &material)] {
        for sigma in [0.5, 0.7, 1.0] {
            let params = Params { kernel: KernelShape { extent: 2.0, sigma }, ..exact() };
            let (out, _) = draw(&input(&[volume], &camera, &[]), &params).unwrap();
            for plane in out.channels.iter().chain(&out.optical_depth) {
                let (least, most) = plane.iter().fold((f32::INFINITY, 0.0f32), |(l, m), v| (l.min(*v), m.max(*v)));
                assert!(most > 0.1 && most - least < 3e-6 * most, "{:?}, {sigma}: {least} to {most}", volume.packing);
            }
        }
    }
}

#[test]
fn ia04_sums_of_a_hundred_thousand_small_values_keep_their_digits() {
    // All in one pixel of one slab, where sums of 16 bits stall at a thirtieth of theirs.
    let tf = transfer(&[(0.0, 0.0), (1.0, 1.0)]);
    let material = unlit();
    let grid = grid([100, 100, 10], cubic(1.0), |_| 0.01);
    let camera = parallel([0.0, 0.0, 50.0], 100.0, [1, 1]);
    let params = Params { slab_width: Some(10.0), ..exact() };
    let (out, _) = draw(&input(&[volume(&grid, &tf, &material)], &camera, &[]), &params).unwrap();
    let found = out.optical_depth[0][0];
    assert!((found - 0.1).abs() < 1e-6, "{found}");
}

#[test]
fn ia11_five_thousand_slabs_front_to_back_are_those_back_to_front() {
    let tf = transfer(&[(0.1, 0.0), (0.5, 0.0008), (0.9, 0.002)]);
    let material = unlit();
    let grid = grid([4, 4, 1250], cubic(1.0), noise);
    let camera = parallel([0.0, 0.0, 700.0], 2.0, [6, 6]);
    let count = 5000u16;
    let volumes = [volume(&grid, &tf, &material)];
    let sheeted = prepare(input(&volumes, &camera, &[]), &Params { slab_width: Some(0.25), ..exact() }, None).unwrap();
    let fold = |range: std::ops::Range<f32>| {
        let mut out = Accumulator::new([6, 6], 1, 3, false, false);
        sheeted.fold(range, &[], &BEAUTY, &mut out, None).unwrap();
        out
    };
    let front_to_back = fold(f32::NEG_INFINITY..f32::INFINITY);
    let mut back_to_front = vec![[0.0f64; 3]; 36];
    for slab in (0..count).rev() {
        let near = 75.0 + 0.25 * f32::from(slab);
        let layer = fold(near..near + 0.25);
        for (at, color) in back_to_front.iter_mut().enumerate() {
            let through = f64::exp(-f64::from(layer.optical_depth[0][at]));
            (0..3).for_each(|c| color[c] = f64::from(layer.channels[c][at]) + through * color[c]);
        }
    }
    let limit = 2.0 * f64::from(count) * f64::from(f32::EPSILON);
    for (at, expected) in back_to_front.iter().enumerate() {
        for c in 0..3 {
            let off = (f64::from(front_to_back.channels[c][at]) - expected[c]).abs();
            assert!(off < limit.min(1e-5) && expected[c] > 0.1, "{at}: {off:e} of {}", expected[c]);
        }
    }
}

#[test]
fn ia06_pixels_that_are_done_err_by_no_more_than_what_they_hide() {
    let tf = transfer(&[(0.1, 0.0), (0.5, 2.0), (0.9, 6.0)]);
    let material = unlit();
    let grid = grid([40, 40, 40], cubic(0.25), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 12.0], 50.0, [90, 90]);
    let input = input(&volumes, &camera, &[]);
    let (full, all) = draw(&input, &exact()).unwrap();
    for cutoff in [1e-3, Params::PAPERS_CUTOFF] {
        let (early, counts) = draw(&input, &Params { transmittance_cutoff: cutoff, ..Params::default() }).unwrap();
        // No colour is above 1.
        assert!(apart(&full, &early) <= cutoff, "{cutoff}: {}", apart(&full, &early));
        assert!(counts.fragments < all.fragments * 3 / 4, "{counts:?} of {all:?}");
        assert!(counts.hidden > all.hidden && counts.shaded < all.shaded, "{counts:?} of {all:?}");
    }
}

#[test]
fn ia07_a_ramp_has_the_same_normal_everywhere() {
    let layers = LayerSet { normal: true, ..LayerSet::default() };
    let layout = ChannelLayout::new(&layers);
    let tf = constant(0.5);
    let material = Material::default();
    for (slope, tolerance) in [(DVec3::X, 0.01), (DVec3::Z, 0.01), (DVec3::new(1.0, 2.0, -1.5), 0.01)] {
        let grid = grid([20, 20, 20], cubic(0.5), |p| 1e3 + slope.dot(p));
        let mut volumes = [volume(&grid, &tf, &material)];
        volumes[0].normals = true;
        for camera in [parallel([0.0, 0.0, 12.0], 9.0, [60, 60]), perspective([0.0, 0.0, 12.0], 40.0, [60, 60])] {
            let input = input(&volumes, &camera, &[]);
            let mut out = Accumulator::new(camera.size, 1, layout.count(), false, false);
            prepare(input.clone(), &exact(), None)
                .unwrap()
                .fold(f32::NEG_INFINITY..f32::INFINITY, &[], &layout, &mut out, None)
                .unwrap();
            let first = layout.normal().unwrap();
            for at in 0..3600 {
                let opacity = 1.0 - (-out.optical_depth[0][at]).exp();
                if opacity > 0.2 {
                    let n = [0, 1, 2].map(|a| f64::from(out.channels[first + a][at] / opacity));
                    let off = (DVec3::from_array(n) + slope.normalize()).length();
                    assert!(off < tolerance, "{slope}, pixel {at}: {n:?}, off by {off}");
                }
            }
        }
    }
}

#[test]
fn cv08_without_a_gradient_there_is_no_normal_and_no_nan() {
    let tf = constant(0.5);
    let material = Material::default();
    let grid = grid([12, 12, 12], cubic(0.5), |_| 4.0);
    let mut volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 9.0], 50.0, [60, 60]);
    let plain = draw(&input(&volumes, &camera, &[]), &exact()).unwrap().0;
    volumes[0].normals = true;
    let shaded = draw(&input(&volumes, &camera, &[]), &exact()).unwrap().0;
    assert_eq!(plain.channels, shaded.channels);
    assert!(plain.channels[0].iter().all(|c| c.is_finite()) && plain.channels[0].iter().any(|c| *c > 0.01));
}

#[test]
fn ia09_any_zoom_keeps_the_mean_brightness() {
    let tf = transfer(&[(0.0, 0.0), (1.0, 0.05)]);
    let material = unlit();
    let grid = grid([16, 16, 16], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    // The same part of the image plane in pixels of 1/10 to 16 voxels.
    let mean = |pixels: u32| {
        let camera = parallel([0.0, 0.0, 12.0], 8.0, [pixels, pixels]);
        let out = draw(&input(&volumes, &camera, &[]), &exact()).unwrap().0;
        f64::from(out.optical_depth[0].iter().sum::<f32>()) / f64::from(pixels * pixels)
    };
    let fine = mean(64);
    for pixels in [1, 4, 16, 160] {
        assert!((mean(pixels) / fine - 1.0).abs() < 0.01, "{pixels}: {} of {fine}", mean(pixels));
    }
    // 1000 pixels a voxel, and the eye in the midst of one.
    let near = perspective([0.0, 0.0, 0.01], 20.0, [64, 64]);
    let out = draw(&input(&volumes, &near, &[]), &exact()).unwrap().0;
    assert!(out.optical_depth[0].iter().all(|t| t.is_finite() && *t > 0.0));
}

#[test]
fn ia14_one_field_on_two_lattices_and_finer_ones() {
    let field = |p: DVec3| (1.1 * p.x).sin() * (0.8 * p.y).cos() + 0.4 * p.z;
    let tf = transfer(&[(-0.5, 0.0), (0.3, 0.3), (1.5, 1.0)]);
    let material = unlit();
    let camera = parallel([3.0, 4.0, 9.0], 4.0, [40, 40]);
    let shear = DMat3::from_cols(DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.4, -0.9, 0.0), DVec3::new(0.0, 0.3, 1.2));
    let picture = |axes: DMat3, n: usize| {
        // Large enough for the picture, so that no face is in it.
        let dims = [n, n, n].map(|n| n + 1);
        let grid = grid(dims, axes * (12.0 / n as f64), field);
        let volumes = [volume(&grid, &tf, &material)];
        let params = Params { slab_width: Some(0.1), ..exact() };
        let mut out = Accumulator::new(camera.size, 1, 3, false, false);
        // A range that lies in both.
        let sheeted = input(&volumes, &camera, &[]);
        prepare(sheeted.clone(), &params, None).unwrap().fold(9.3..11.3, &[], &BEAUTY, &mut out, None).unwrap();
        out
    };
    let rmse = |n: usize| {
        let a = picture(DMat3::IDENTITY, n);
        let b = picture(shear, n);
        let squares = a.optical_depth[0].iter().zip(&b.optical_depth[0]).map(|(a, b)| f64::from((a - b) * (a - b)));
        (squares.sum::<f64>() / 1600.0).sqrt()
    };
    let coarse = rmse(24);
    let fine = rmse(48);
    assert!(coarse > 1e-4 && fine < 0.5 * coarse, "{coarse} → {fine}");
}

#[test]
fn depths_of_a_constant_volume_have_their_closed_form() {
    let extinction = 0.4f64;
    let length = 8.0f64;
    let tf = constant(extinction as f32);
    let material = unlit();
    let grid = grid([16, 16, 16], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, 10.0], 4.0, [24, 24]);
    for slab_width in [None, Some(0.3), Some(1.9)] {
        let out = draw(&input(&volumes, &camera, &[]), &Params { slab_width, ..exact() }).unwrap().0;
        let tau = extinction * length;
        let first = 6.0 - (-1.0f64 / 255.0).ln_1p() / extinction;
        let median = 6.0 + 2f64.ln() / extinction;
        let mean = 6.0 + length * (1.0 / tau - 1.0 / tau.exp_m1());
        for (at, profile) in out.depth.iter().enumerate() {
            let found = profile.depths(out.optical_depth[0][at], None);
            for (found, expected) in found.into_iter().zip([first, median, mean]) {
                assert!((f64::from(found) - expected).abs() < 0.01, "{slab_width:?}: {found}, expected {expected}");
            }
        }
        assert!(out.object.iter().all(|o| *o == 0));
    }
}

#[test]
fn extinction_by_channel_hides_each_channel_by_its_own() {
    let tf = TransferFunction::new(vec![TransferPoint { value: 0.0, color: [1.0; 3], extinction: 0.5 }]).unwrap();
    let material = Material { extinction_rgb: [0.5, 1.0, 2.0], ..unlit() };
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, 10.0], 3.0, [24, 24]);
    let mut out = Accumulator::new(camera.size, 3, 3, false, false);
    let input = input(&volumes, &camera, &[]);
    prepare(input.clone(), &exact(), None)
        .unwrap()
        .fold(f32::NEG_INFINITY..f32::INFINITY, &[], &BEAUTY, &mut out, None)
        .unwrap();
    for (c, factor) in [0.5f32, 1.0, 2.0].into_iter().enumerate() {
        let tau = 0.5 * 6.0 * factor;
        assert!(
            (out.optical_depth[c][300] - tau).abs() < 1e-5 && (out.channels[c][300] - 1.0 + (-tau).exp()).abs() < 1e-5
        );
    }
}

#[test]
fn empty_space_costs_no_fragments() {
    let tf = transfer(&[(0.5, 0.0), (1.0, 1.0)]);
    let material = unlit();
    let camera = parallel([3.0, 4.0, 40.0], 24.0, [120, 120]);
    let ball = |p: DVec3| (3.0 - p.length()).max(0.0);
    let cost = |n: usize| {
        let grid = grid([n, n, n], cubic(0.5), ball);
        draw(&input(&[volume(&grid, &tf, &material)], &camera, &[]), &exact()).unwrap().1
    };
    let small = cost(24);
    let large = cost(48);
    assert_eq!((small.visible, small.fragments), (large.visible, large.fragments));
    // Slabs begin elsewhere.
    assert!((large.shaded as f64 / small.shaded as f64 - 1.0).abs() < 0.05, "{small:?}, {large:?}");
    // Pixels of sheets that were touched alone: a ball of 3 in a picture of 24, and no more slabs than it has.
    assert!(large.shaded * 8 < 120 * 120 * large.slabs, "{large:?}");
    assert!(small.visible > 0 && large.voxels == 8 * small.voxels);
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let tf = constant(0.5);
    let material = unlit();
    let good = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let camera = parallel([0.0, 0.0, 10.0], 3.0, [24, 24]);
    let with = |params: Params| {
        let volumes = [volume(&good, &tf, &material)];
        draw(&input(&volumes, &camera, &[]), &params).map(|_| ())
    };
    for slab_width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = with(Params { slab_width: Some(slab_width), ..exact() });
        assert!(matches!(refused, Err(Error::Parameter { name: "slab_width", .. })), "{slab_width}: {refused:?}");
    }
    assert!(matches!(
        with(Params { slab_width: Some(1e-9), ..exact() }),
        Err(Error::Limit(Exceeded { unit: "slabs", .. }))
    ));
    let kernel = KernelShape { extent: 2.0, sigma: 0.1 };
    assert!(matches!(with(Params { kernel, ..exact() }), Err(Error::Parameter { name: "kernel.sigma", .. })));
    assert!(matches!(
        with(Params { limits: Limits::bytes(1000), ..exact() }),
        Err(Error::Limit(Exceeded { limit: Some(1000), .. }))
    ));
    assert!(matches!(with(Params { transmittance_cutoff: f32::NAN, ..exact() }), Err(Error::Parameter { .. })));
    let mut bad = good.clone();
    bad.values[7] = f32::NAN;
    let volumes = [volume(&good, &tf, &material), volume(&bad, &tf, &material)];
    assert!(matches!(draw(&input(&volumes, &camera, &[]), &exact()), Err(Error::Volume { volume: 1, .. })));
    let progress = Progress::new();
    progress.cancel();
    let input = input(&volumes[..1], &camera, &[]);
    assert!(matches!(prepare(input.clone(), &exact(), Some(&progress)), Err(Error::Cancelled)));
    let sheeted = prepare(input.clone(), &exact(), None).unwrap();
    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
    let all = f32::NEG_INFINITY..f32::INFINITY;
    assert!(matches!(sheeted.fold(all, &[], &BEAUTY, &mut out, Some(&progress)), Err(Error::Cancelled)));
}

#[test]
fn nothing_is_drawn_of_nothing() {
    let camera = parallel([0.0, 0.0, 10.0], 3.0, [24, 24]);
    let (out, counts) = draw(&input(&[], &camera, &[]), &exact()).unwrap();
    assert!(out.optical_depth[0].iter().all(|t| *t == 0.0) && counts.fragments == 0);
    let tf = constant(0.5);
    let material = unlit();
    let behind = {
        let mut grid = grid([4, 4, 4], cubic(0.5), |_| 1.0);
        grid.origin.z += 20.0;
        grid
    };
    let volumes = [volume(&behind, &tf, &material)];
    let (out, counts) = draw(&input(&volumes, &camera, &[]), &exact()).unwrap();
    assert!(out.optical_depth[0].iter().all(|t| *t == 0.0) && counts.shaded == 0);
}
