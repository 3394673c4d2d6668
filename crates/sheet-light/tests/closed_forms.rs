//! Constant volumes: e^−τ along every ray.

use crate::common::{constant, cubic, draw, exact, forms, grid, input, parallel, perspective, transfer, unlit, volume};
use sheet_light::{KernelShape, Params, SheetInput, prepare, sections};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Footprint, Grid};

/// Length of a pixel's ray inside a lattice's cells, and the middle of that part; the ends are found by bisection, not by planes.
fn inside(grid: &Grid, camera: &Camera, x: usize, y: usize) -> (f64, DVec3) {
    let (from, along) = camera.view_ray(x as f64 + 0.5, y as f64 + 0.5);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    let place = |z: f64| camera.position + world(from + along * z);
    let inverse = grid.axes.inverse();
    let is_inside = |z: f64| {
        let at = inverse * (place(z) - grid.origin);
        (0..3).all(|a| at[a] >= -0.5 && at[a] <= grid.dims[a] as f64 - 0.5)
    };
    let far = 200.0;
    let n = 20_000;
    let step = |i: usize| far * i as f64 / f64::from(n);
    let Some(first) = (0..n as usize).find(|i| is_inside(step(*i))) else { return (0.0, DVec3::ZERO) };
    let last = (first..n as usize).take_while(|i| is_inside(step(*i))).last().unwrap();
    let border = |mut inside: f64, mut outside: f64| {
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            *(if is_inside(middle) { &mut inside } else { &mut outside }) = middle;
        }
        inside
    };
    let near = if first == 0 { 0.0 } else { border(step(first), step(first - 1)) };
    let far = border(step(last), step(last + 1));
    ((far - near) * along.length(), place(0.5 * (near + far)))
}

/// Every pixel of a constant volume has e^−τ and, being white, 1 − e^−τ; every 7th is held against the closed form.
fn check(grid: &Grid, camera: &Camera, tau_per_length: f32, params: &Params) {
    let tf = constant(tau_per_length);
    let material = unlit();
    let volumes = [volume(grid, &tf, &material)];
    let input = input(&volumes, camera, &[]);
    for params in forms(params).iter().filter(|params| prepare(input.clone(), params, None).is_ok()) {
        check_form(grid, camera, tau_per_length, &input, params);
    }
}

fn check_form(grid: &Grid, camera: &Camera, tau_per_length: f32, input: &SheetInput<'_>, params: &Params) {
    let (out, counts) = draw(input, params).unwrap();
    let width = camera.size[0] as usize;
    let mut seen = 0;
    for at in (0..out.optical_depth[0].len()).step_by(7) {
        let (length, _) = inside(grid, camera, at % width, at / width);
        if length < 0.03 {
            // A corner that the search for the ends steps over.
            assert!(out.optical_depth[0][at] < 0.03 * tau_per_length, "pixel {at}");
            continue;
        }
        let expected = (-length * f64::from(tau_per_length)).exp();
        let found = (-f64::from(out.optical_depth[0][at])).exp();
        let light = f64::from(out.channels[0][at]);
        assert!((found - expected).abs() < 1e-5, "pixel {at}: {found}, expected {expected}; {counts:?}");
        assert!((light - (1.0 - expected)).abs() < 1e-5, "pixel {at}: {light}, expected {}", 1.0 - expected);
        seen += 1;
    }
    assert!(seen > 50, "the volume is out of the picture");
}

#[test]
fn hv05_opacity_does_not_depend_on_the_number_of_slabs() {
    let grid = grid([20, 20, 16], cubic(0.5), |_| 3.0);
    let camera = parallel([3.0, 4.0, 12.0], 14.0, [60, 50]);
    for slab_width in [0.06, 0.13, 0.5, 0.77, 2.0, 40.0] {
        for extinction in [0.00125, 0.125, 0.625] {
            check(&grid, &camera, extinction, &Params { slab_width: Some(slab_width), ..exact() });
        }
    }
}

/// Where a face cuts a slab, the slab's own middle lies outside or off the middle of what a ray has of both: there a mean over the slab would be off by up to
/// four hundredths.
#[test]
fn a_linear_field_has_its_optical_depth_wherever_faces_cut_slabs() {
    let field = |p: DVec3| 1.5 + p.dot(DVec3::new(0.1, -0.05, 0.6));
    let grid = grid([30, 30, 5], cubic(0.4), field);
    let tf = transfer(&[(0.0, 0.0), (4.0, 4.0)]);
    let material = unlit();
    let volumes = [volume(&grid, &tf, &material)];
    for camera in [parallel([0.0, 0.0, 9.0], 6.0, [24, 24]), parallel([3.0, 2.0, 9.0], 6.0, [24, 24])] {
        for slab_width in [0.4, 0.6, 0.77, 1.3] {
            for params in forms(&Params { slab_width: Some(slab_width), ..exact() }) {
                let (out, _) = draw(&input(&volumes, &camera, &[]), &params).unwrap();
                for at in (0..576).step_by(7) {
                    let (length, middle) = inside(&grid, &camera, at % 24, at / 24);
                    let found = f64::from(out.optical_depth[0][at]);
                    let expected = length * field(middle);
                    assert!((found / expected - 1.0).abs() < 0.01, "{slab_width}, pixel {at}: {found}, not {expected}");
                }
            }
        }
    }
}

/// Voxels behind the eye have no place in the image, so what is reconstructed beside it is that of places farther off: 0.3 slabs at the eye.
#[test]
fn an_eye_in_a_linear_field_sees_its_optical_depth() {
    let field = |p: DVec3| 1.5 + p.dot(DVec3::new(0.1, -0.05, 0.6));
    let grid = grid([30, 30, 5], cubic(0.4), field);
    let tf = transfer(&[(0.0, 0.0), (4.0, 4.0)]);
    let material = unlit();
    let volumes = [volume(&grid, &tf, &material)];
    let eyes = [[0.0, 0.0, 0.7], [0.0, 0.0, 0.51], [0.3, 0.2, 0.83], [-0.2, 0.1, 1.05], [0.1, 0.0, -0.2]];
    for camera in eyes.iter().flat_map(|eye| [perspective(*eye, 60.0, [24, 24]), parallel(*eye, 3.0, [24, 24])]) {
        for slab_width in [0.2, 0.4, 0.6, 0.77] {
            let params = Params { slab_width: Some(slab_width), ..exact() };
            let input = input(&volumes, &camera, &[]);
            let (out, _) = draw(&input, &params).unwrap();
            for at in (0..576).step_by(7) {
                let (length, middle) = inside(&grid, &camera, at % 24, at / 24);
                let found = f64::from(out.optical_depth[0][at]);
                let expected = length * field(middle);
                let what = format!("{slab_width}, {:?}, pixel {at}", camera.position);
                assert!((found / expected - 1.0).abs() < 0.01, "{what}: {found}, not {expected}");
            }
            let [tau, _] = crate::twin::differences(&input, &params);
            assert!(tau < 2e-5, "{slab_width}, {:?}: {tau:e}", camera.position);
        }
    }
}

#[test]
fn ia12_a_wide_lens_has_the_length_of_each_ray() {
    let grid = grid([40, 40, 8], cubic(0.25), |_| -7.0);
    for from in [[0.0, 0.0, 5.0], [2.0, 1.5, 3.0], [0.3, 0.2, 0.9]] {
        check(&grid, &perspective(from, 90.0, [72, 64]), 0.5, &exact());
    }
}

#[test]
fn hv17_any_lattice_has_the_length_of_each_ray() {
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.3, 0.6, -0.1), DVec3::new(-0.2, 0.1, -0.7));
    let flat = DMat3::from_diagonal(DVec3::new(0.4, 0.4, 1.3));
    for axes in [sheared, flat, -flat] {
        let grid = grid([14, 12, 9], axes, |_| 1.0);
        for params in [exact(), Params { kernel: KernelShape { extent: 3.0, sigma: 1.0 }, ..exact() }] {
            check(&grid, &perspective([3.0, 5.0, 9.0], 50.0, [56, 60]), 0.4, &params);
            check(&grid, &parallel([-5.0, 2.0, 6.0], 12.0, [56, 60]), 0.4, &params);
        }
    }
}

#[test]
fn an_eye_in_the_volume_sees_what_lies_before_it() {
    let grid = grid([24, 24, 24], cubic(0.5), |_| 1.0);
    check(&grid, &perspective([0.1, 0.2, 0.3], 80.0, [64, 64]), 0.3, &exact());
    check(&grid, &parallel([0.1, 0.2, 0.3], 4.0, [64, 64]), 0.3, &exact());
}

#[test]
fn ia01_sections_of_every_phase_sum_to_one() {
    for (reach, cutoff) in [(2.0, 2.857), (0.3, 3.0), (3.7, 5.0), (16.0, 2.857)] {
        for phase in 0..sections::PHASES {
            let sections = sections::sections(phase, reach, &Footprint { cutoff });
            assert_eq!(sections.len(), sections::touched(reach));
            assert!((sections.iter().sum::<f64>() - 1.0).abs() < 1e-12 && sections.iter().all(|w| *w >= 0.0));
            // Its mean is the kernel's middle, but for the slabs being wide.
            let mean: f64 = sections.iter().enumerate().map(|(i, w)| w * (i as f64 + 0.5)).sum();
            let middle = f64::from(phase) / 256.0 + reach;
            assert!((mean - middle).abs() < if reach < 1.0 { 0.5 } else { 0.02 }, "{reach} {phase}: {mean} {middle}");
        }
    }
    // Five slabs, not the paper's four, which lose what the first or the last holds.
    assert_eq!(sections::touched(2.0), 5);
    let KernelShape { extent, sigma } = KernelShape::default();
    let footprint = Footprint { cutoff: (extent / sigma) as f32 };
    let fifth = |phase: u32| sections::sections(phase, extent, &footprint)[4];
    let most = (0..sections::PHASES).map(fifth).fold(0.0, f64::max);
    assert!((0.0435..0.0445).contains(&most), "{most}");
}

#[test]
fn footprints_on_a_lattice_ripple_by_less_than_a_hundredth() {
    let KernelShape { extent, sigma } = KernelShape::default();
    let footprint = Footprint { cutoff: (extent / sigma) as f32 };
    let sum = |x: f64, y: f64| -> f64 {
        let steps = |i: i32| [x, y].map(|v| v - f64::from(i));
        let at = |i: i32, j: i32| (steps(i)[0].powi(2) + steps(j)[1].powi(2)) / (extent * extent);
        (-3..=4).flat_map(|i| (-3..=4).map(move |j| (i, j))).map(|(i, j)| footprint.profile(at(i, j))).sum()
    };
    let places = (0..=32).flat_map(|i| (0..=32).map(move |j| sum(f64::from(i) / 32.0, f64::from(j) / 32.0)));
    let (least, most) = places.fold((f64::INFINITY, 0.0), |(l, m): (f64, f64), s| (l.min(s), m.max(s)));
    let ripple = most / least - 1.0;
    assert!((0.006..0.0075).contains(&ripple), "{ripple}");
}

#[test]
fn ia03_voxels_that_cross_faces_keep_their_weight() {
    // A ramp of eight cells moved through slabs that stay where they are: something nearer holds them. A section that were lost
    // would move the mean of a slab along the ramp.
    let tf = transfer(&[(0.0, 0.0), (8.0, 8.0)]);
    let material = unlit();
    let camera = parallel([0.0, 0.0, 12.0], 1.0, [8, 8]);
    let mut nearer = grid([1, 1, 1], cubic(1.0), |_| 0.0);
    nearer.origin.z += 8.0;
    for step in (0..1024).step_by(16).chain([1, 1023]) {
        let ramp = DMat3::from_diagonal(DVec3::new(4.0, 4.0, 1.0));
        let mut ramp = grid([1, 1, 8], ramp, |p| 0.1 * (p.z + 5.0));
        ramp.origin.z += f64::from(step) / 1024.0;
        let volumes = [volume(&nearer, &tf, &material), volume(&ramp, &tf, &material)];
        let params = Params { slab_width: Some(1.0), ..exact() };
        let (out, _) = draw(&input(&volumes, &camera, &[]), &params).unwrap();
        // Eight cells, 0.5 in the mean.
        let off = out.optical_depth[0].iter().map(|tau| (tau - 4.0).abs()).fold(0.0, f32::max);
        assert!(off < 2e-3, "{step}: {off:e}");
    }
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn hv04_a_hundred_thousand_slabs_lose_no_digits() {
        let grid = grid([8, 8, 1000], DMat3::from_diagonal(DVec3::new(0.5, 0.5, 0.002)), |_| 3.0);
        let material = unlit();
        let camera = parallel([0.0, 0.0, 9.0], 0.5, [9, 9]);
        for (tau, slabs) in [(0.01f64, 1e5), (1.0, 1e4), (10.0, 1e4)] {
            let tf = constant((0.5 * tau) as f32);
            let params = Params { slab_width: Some(2.0 / slabs), ..exact() };
            let (out, _) = draw(&input(&[volume(&grid, &tf, &material)], &camera, &[]), &params).unwrap();
            let opacity = -(-tau).exp_m1();
            let light = f64::from(out.channels[1][40]) / opacity - 1.0;
            let seen = f64::from(out.optical_depth[0][40]) / tau - 1.0;
            println!("τ {tau}, {slabs} slabs: light {light:e}, optical depth {seen:e}");
            assert!(light.abs() < 2e-6 && seen.abs() < 1e-6, "τ {tau}, {slabs} slabs: {light:e} {seen:e}");
        }
    }
}
