//! Sheets that are gathered: what they refuse, how near they are to splatted ones, and that nothing is skipped that shows.

use crate::common::{
    bcc_volume, body_centred, cubic, draw, exact, forms, grid, input, noise, parallel, perspective, transfer, unlit,
    volume,
};
use sheet_light::{Classify, Error, GatherKernel, KernelShape, Params, Reconstruction, prepare};
use splat_core::glam::DVec3;
use splat_core::raster::Accumulation;
use splat_core::rng;

#[test]
fn gathered_sheets_are_the_splatted_ones_but_for_the_kernel() {
    let tf = transfer(&[(0.1, 0.0), (0.5, 0.6), (0.9, 1.5)]);
    let material = unlit();
    // An edge, and noise, which no kernel keeps.
    let edge = grid([24, 22, 20], cubic(0.3), |p| if p.dot(DVec3::new(0.5, 0.3, 0.8)) < 0.2 { 0.0 } else { 1.0 });
    let rough = grid([24, 22, 20], cubic(0.3), noise);
    for (field, most) in [(&edge, 0.004), (&rough, 0.01)] {
        let volumes = [volume(field, &tf, &material)];
        for camera in [parallel([3.0, 2.0, 8.0], 8.0, [64, 56]), perspective([2.0, 3.0, 8.0], 60.0, [64, 56])] {
            let input = input(&volumes, &camera, &[]);
            let [splatted, _, gathered] = forms(&exact()).map(|params| draw(&input, &params).unwrap().0);
            let squares = splatted.channels.iter().zip(&gathered.channels).flat_map(|(a, b)| a.iter().zip(b));
            let count = 3.0 * 64.0 * 56.0;
            let rmse = (squares.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / count).sqrt();
            println!("RMSE {rmse:e}");
            assert!(rmse < most, "{rmse} of {most}");
        }
    }
}

/// Bricks without visible voxels are not read: with a transfer function that gives a trace of extinction everywhere nothing is skipped, and the picture is the
/// same but for that.
#[test]
fn bricks_never_hide_what_shows() {
    let material = unlit();
    for seed in 0..60u64 {
        let unit = |k: u64| rng::unit(17, seed, k, 0);
        let dims = [0, 1, 2].map(|a| 1 + (unit(a) * 40.0) as usize);
        let middle = DVec3::new(unit(3) - 0.5, unit(4) - 0.5, unit(5) - 0.5) * 6.0;
        let sharpness = 0.2 + 3.0 * unit(6);
        let field = grid(dims, cubic(0.25), |p| (-sharpness * (p - middle).length_squared()).exp() + 0.02 * noise(p));
        let low = (0.1 + 0.6 * unit(7)) as f32;
        let shown = [(low, 0.0), (low + 0.01, 4.0), (low + 0.1, 4.0), (low + 0.11, 0.0)];
        let tf = transfer(&shown);
        let traced = transfer(&shown.map(|(value, extinction)| (value, extinction + 1e-4)));
        let size = [20 + (unit(8) * 60.0) as u32, 20 + (unit(9) * 60.0) as u32];
        let from = [6.0 * unit(10) - 3.0, 6.0 * unit(11) - 3.0, 1.0 + 7.0 * unit(12)];
        for camera in [perspective(from, 20.0 + 60.0 * unit(13), size), parallel(from, 1.0 + 8.0 * unit(14), size)] {
            for params in &forms(&exact())[1..] {
                let tau = |tf| {
                    let volumes = [volume(&field, tf, &material)];
                    draw(&input(&volumes, &camera, &[]), params).unwrap().0.optical_depth[0].clone()
                };
                let longest = 0.25 * dims.iter().map(|n| *n as f32).sum::<f32>();
                for (at, (skipped, whole)) in tau(&tf).iter().zip(tau(&traced)).enumerate() {
                    let trace = whole - skipped;
                    assert!(
                        (-1e-5..=1e-4 * longest + 1e-4).contains(&trace),
                        "seed {seed}, pixel {at}: {skipped}, {whole}"
                    );
                }
            }
        }
    }
}

#[test]
fn what_only_splats_have_is_refused_by_name() {
    let tf = transfer(&[(0.0, 0.0), (1.0, 1.0)]);
    let material = unlit();
    let field = grid([4, 4, 4], cubic(0.5), noise);
    let volumes = [volume(&field, &tf, &material)];
    let camera = parallel([0.0, 0.0, 4.0], 3.0, [16, 16]);
    let input = input(&volumes, &camera, &[]);
    let gaussian = Params { reconstruction: Reconstruction::Gather(GatherKernel::Gaussian), ..exact() };
    for (params, name) in [
        (Params { kernel: KernelShape { extent: 1.5, sigma: 0.6 }, ..gaussian }, "kernel"),
        (Params { sections: 64, ..gaussian }, "sections"),
        (Params { classify: Classify::Before, ..gaussian }, "classify"),
        (Params { accumulation: Accumulation::F16, ..gaussian }, "accumulation"),
    ] {
        let Err(Error::Parameter { name: found, .. }) = prepare(input.clone(), &params, None) else { panic!("{name}") };
        assert_eq!(found, name);
    }
    let bcc = body_centred([4, 4, 8], 2.0, noise);
    let mut other = input.clone();
    other.volumes = vec![bcc_volume(&bcc, &tf, &material)];
    assert!(matches!(prepare(other, &gaussian, None), Err(Error::Parameter { name: "reconstruction", .. })));
}
