//! Constant media: optical depth and self shadow in closed form, whatever the slabs.

use super::common::{draw, exact, half_forms, input, inside, lamp, ray, scattering, single_scattering, sun};
use super::polygons::{polygons, wall, white};
use crate::common::{BEAUTY, constant, cubic, grid, parallel, perspective, transfer, volume};
use sheet_light::half::{HalfInput, HalfParams, fold};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Camera, Grid, Material, TransferFunction, TransferPoint};
use std::f64::consts::PI;

/// Greatest differences from the closed forms over every `step`-th pixel: transmittance, and scattered light, 1 being what a
/// black-backed infinity of the medium would scatter unattenuated.
fn differences(grid: &Grid, sigma: f64, lit: &LitBy<'_>, camera: &Camera, params: &HalfParams) -> [f64; 2] {
    let tf = constant(sigma as f32);
    let material = scattering();
    let volumes = [volume(grid, &tf, &material)];
    let lights = [*lit];
    let forms = half_forms(params).map(|params| draw(&input(&volumes, camera, &lights), &params).unwrap().0);
    let width = camera.size[0] as usize;
    let mut worst = [0.0f64; 2];
    let mut seen = 0;
    // Kernels of extent 2 that receive light have a deviation of a third of it.
    let spread = 2.0 / 3.0 * grid.axes.x_axis.length();
    for at in (0..forms[0].optical_depth[0].len()).step_by(5) {
        let ray = ray(camera, at % width, at / width);
        let [light, tau] = single_scattering(grid, sigma, (&lit.light, spread), ray);
        for out in &forms {
            let found = f64::from(out.optical_depth[0][at]);
            worst[0] = worst[0].max(((-found).exp() - (-tau).exp()).abs());
            worst[1] = worst[1].max((f64::from(out.channels[0][at]) * 4.0 * PI - light).abs());
        }
        seen += usize::from(tau > 0.0);
    }
    assert!(seen > 20, "the volume is out of the picture");
    worst
}

#[test]
fn hv05_a_lamp_before_and_behind_a_cube_converges_to_its_closed_form() {
    let grid = grid([12, 12, 12], cubic(0.5), |_| 3.0);
    let camera = perspective([3.0, 4.0, 12.0], 50.0, [40, 40]);
    for at in [[12.0, 8.0, 3.0], [-3.0, -4.0, -12.0]] {
        let mut light = lamp(at);
        // An irradiance of about 1.
        light.light.intensity = [DVec3::from_array(at).length_squared() as f32; 3];
        for (slab_width, limit) in [(0.06, 1e-4), (0.25, 1e-3), (1.0, 1e-2)] {
            let [through, scattered] = differences(&grid, 0.3, &light, &camera, &exact(Some(slab_width)));
            assert!(through < 1e-5 && scattered < limit, "slabs {slab_width}, {at:?}: {through:e} {scattered:e}");
        }
    }
}

#[test]
fn hv14_a_wide_lens_has_the_length_of_each_ray() {
    let grid = grid([24, 24, 8], cubic(0.25), |_| -7.0);
    let camera = perspective([0.0, 0.0, 4.0], 90.0, [72, 64]);
    for light in [sun([0.3, 0.2, 1.0]), sun([0.2, -0.1, -1.0])] {
        for slab_width in [0.1, 0.25, 3.0] {
            let [through, scattered] = differences(&grid, 0.5, &light, &camera, &exact(Some(slab_width)));
            assert!(through < 1e-5 && scattered < 1e-5, "slabs {slab_width}: {through:e} {scattered:e}");
        }
    }
}

/// Light in the view direction through a slab of optical depth τ, as the middle pixel sees it: transmittance and 4π·radiance.
fn slab(tau: f64, slabs: f64, from: [f64; 3]) -> [f64; 2] {
    // Wide enough for light that comes from aside; many slabs need a finer lattice, for kernels touch no more than 512.
    let length = 4.0;
    let (n, spacing) =
        if slabs > 1e3 { ([6, 6, 160], DVec3::new(1.0, 1.0, 0.025)) } else { ([40, 6, 8], DVec3::splat(0.5)) };
    let grid = grid(n, DMat3::from_diagonal(spacing), |_| 1.0);
    let tf = constant((tau / length) as f32);
    let material = scattering();
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun(from)];
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [9, 9]);
    // A pixel of the light buffer is as wide as a step of the coarser lattice.
    let params = HalfParams { light_pixels: spacing.z / spacing.x, ..exact(Some(length / slabs)) };
    let forms = half_forms(&params).map(|params| draw(&input(&volumes, &camera, &lights), &params).unwrap().0);
    let out = &forms[0];
    for other in &forms[1..] {
        assert_eq!((&other.optical_depth, &other.channels), (&out.optical_depth, &out.channels));
    }
    [(-f64::from(out.optical_depth[0][40])).exp(), 4.0 * PI * f64::from(out.channels[0][40])]
}

#[test]
fn hv03_a_slab_shadows_itself_as_the_closed_form_says() {
    for tau in [0.01, 1.0, 5.0] {
        for slabs in [1.0, 3.0, 8.0, 50.0] {
            // Behind the eye, and 60° off its axis: e^(−τ(1 + 1/cos)).
            for (from, secant) in [([0.0, 0.0, 1.0], 1.0), ([0.75f64.sqrt(), 0.0, 0.5], 2.0)] {
                let [through, scattered] = slab(tau, slabs, from);
                let expected = -(-tau * (1.0 + secant)).exp_m1() / (1.0 + secant);
                assert!((through - (-tau).exp()).abs() < 1e-5, "τ {tau}, {slabs} slabs: {through}");
                assert!((scattered - expected).abs() < 1e-5, "τ {tau}, {slabs} slabs: {scattered}, not {expected}");
            }
            // From the other side: every path has τ in all.
            let [_, scattered] = slab(tau, slabs, [0.0, 0.0, -1.0]);
            assert!((scattered - tau * (-tau).exp()).abs() < 1e-5, "τ {tau}, {slabs} slabs: {scattered}");
        }
    }
}

#[test]
fn hv06_optical_depths_from_next_to_nothing_to_all() {
    for tau in (-8..=8).map(|k| 10f64.powi(k)) {
        for slabs in [1.0, 8.0] {
            let [_, scattered] = slab(tau, slabs, [0.0, 0.0, 1.0]);
            let expected = -0.5 * (-2.0 * tau).exp_m1();
            assert!((scattered / expected - 1.0).abs() < 2e-6, "τ {tau:e}: {scattered:e}, not {expected:e}");
        }
    }
}

#[test]
fn hv04_thousands_of_slabs_lose_no_digits() {
    let [through, scattered] = slab(10.0, 1e4, [0.0, 0.0, 1.0]);
    assert!((through / (-10f64).exp() - 1.0).abs() < 1e-6, "{through:e}");
    assert!((scattered - 0.5).abs() < 1e-6, "{scattered}");
}

#[test]
fn hv17_alpha_by_half_vector_slabs_is_that_by_view_slabs() {
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.3, 0.6, -0.1), DVec3::new(-0.2, 0.1, -0.7));
    let flat = DMat3::from_diagonal(DVec3::new(0.4, 0.4, 1.3));
    for axes in [sheared, flat, -flat] {
        let grid = grid([14, 12, 9], axes, |_| 1.0);
        let tf = constant(0.4);
        let material = scattering();
        let volumes = [volume(&grid, &tf, &material)];
        for camera in [perspective([3.0, 5.0, 12.0], 50.0, [56, 60]), parallel([-5.0, 2.0, 6.0], 12.0, [56, 60])] {
            let through = |out: &Accumulator| out.optical_depth[0].iter().map(|t| (-t).exp()).collect::<Vec<f32>>();
            let own = exact(None);
            let view = crate::common::draw(&crate::common::input(&volumes, &camera, &[]), &own.sheets).unwrap().0;
            for light in [sun([2.0, 1.0, 1.0]), sun([-1.0, 1.0, -2.0]), lamp([9.0, 14.0, 8.0])] {
                for own in half_forms(&own) {
                    let half = draw(&input(&volumes, &camera, &[light]), &own).unwrap().0;
                    let worst = crate::common::largest(&through(&view), &through(&half));
                    assert!(worst < 1e-5, "{axes}, {:?}: {worst:e}", light.light.shape);
                }
            }
        }
    }
}

#[test]
fn extinction_by_channel_shadows_each_channel_by_its_own() {
    let tf = TransferFunction::new(vec![TransferPoint { value: 0.0, color: [1.0; 3], extinction: 0.5 }]).unwrap();
    let material = Material { extinction_rgb: [0.5, 1.0, 2.0], ..scattering() };
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([0.0, 0.0, 1.0])];
    let camera = parallel([0.0, 0.0, 10.0], 3.0, [24, 24]);
    let mut out = Accumulator::new(camera.size, 3, 3, false, false);
    let layout = &crate::common::BEAUTY;
    sheet_light::half::fold(&input(&volumes, &camera, &lights), &exact(None), layout, &mut out, None).unwrap();
    for (c, factor) in [0.5f64, 1.0, 2.0].into_iter().enumerate() {
        let tau = 0.5 * 6.0 * factor;
        let expected = -0.5 * (-2.0 * tau).exp_m1() / (4.0 * PI);
        assert!((f64::from(out.optical_depth[c][300]) - tau).abs() < 1e-5);
        assert!((f64::from(out.channels[c][300]) - expected).abs() < 1e-6, "{c}: {}", out.channels[c][300]);
    }
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    /// Where a face cuts a slab, the middle of what a ray has there lies off the slab's own middle, for the eye as for the light.
    #[test]
    fn a_linear_field_has_its_optical_depth_for_eye_and_light_wherever_faces_cut_slabs() {
        let field = |p: DVec3| 1.5 + p.dot(DVec3::new(0.1, -0.05, 0.6));
        let grid = grid([40, 40, 5], cubic(0.4), field);
        // All light that is taken is lost, so that a floor behind shows what is left of it.
        let tf = transfer(&[(0.0, 0.0), (4.0, 4.0)]);
        let medium = Material { single_scattering_albedo: 0.0, ..scattering() };
        let volumes = [volume(&grid, &tf, &medium)];
        let white = white();
        let mesh = wall([0.0, 0.0, -3.0], [30.0, 0.0, 0.0], [0.0, 30.0, 0.0]);
        let floor = [polygons(&mesh, &white)];
        let tau = |from: DVec3, along: DVec3| {
            let [near, far] = inside(&grid, from, along).expect("rays meet the volume");
            (far - near) * field(from + along * 0.5 * (near + far))
        };
        let suns = [sun([0.0, 0.0, 1.0]), sun([1.0, 0.5, 1.0]), sun([-0.6, 0.9, 1.4]), sun([0.4, 0.3, -1.0])];
        for (camera, sun) in [[0.0, 0.0, 9.0], [3.0, 2.0, 9.0]]
            .iter()
            .flat_map(|eye| suns.map(|sun| (parallel(*eye, 4.0, [12, 12]), sun)))
        {
            let to_light = sun.light.irradiance(DVec3::ZERO, 0.0).to_light;
            let widths = [0.3, 0.4, 0.6, 0.77, 1.3];
            for (slab_width, form) in widths.iter().flat_map(|width| [0, 1, 2].map(|form| (*width, form))) {
                let lights = [sun];
                let input = HalfInput { polygons: &floor, ..input(&volumes, &camera, &lights) };
                let mut out = Accumulator::new(camera.size, 1, 3, false, true);
                let drawn = fold(&input, &half_forms(&exact(Some(slab_width)))[form], &BEAUTY, &mut out, None).unwrap();
                for at in (0..144).step_by(7) {
                    let (from, along) = ray(&camera, at % 12, at / 12);
                    let what = format!("slabs {slab_width}, {to_light}, eye {}, pixel {at}", camera.position);
                    let found = f64::from(out.optical_depth[0][at]);
                    let expected = tau(from, along);
                    assert!((found / expected - 1.0).abs() < 0.01, "{what}: {found}, not {expected}");
                    if to_light.z > 0.0 {
                        let place = from - along * ((from.z + 3.0) / along.z);
                        let lit = f64::from(drawn.polygons.channels[0][at]);
                        let expected = tau(place, to_light);
                        let found = -(lit * PI / to_light.z).ln();
                        assert!((found / expected - 1.0).abs() < 0.01, "{what}: light's {found}, not {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn hv05_a_cube_is_the_same_at_any_number_of_slabs() {
        let grid = grid([12, 12, 12], cubic(0.5), |_| 3.0);
        let suns = [sun([1.0, 3.0, 2.0]), sun([-1.0, 2.0, -3.0]), sun([3.0, 4.0, 12.0]), sun([-3.0, -4.0, -12.0])];
        for camera in [parallel([3.0, 4.0, 12.0], 12.0, [28, 28]), perspective([3.0, 4.0, 12.0], 50.0, [28, 28])] {
            for (light, slab_width) in suns.iter().flat_map(|sun| [0.06, 0.5, 1.3, 40.0].map(|width| (sun, width))) {
                for sigma in [0.01, 0.3, 1.0] {
                    let [through, scattered] = differences(&grid, sigma, light, &camera, &exact(Some(slab_width)));
                    let what = format!("slabs {slab_width}, extinction {sigma}, {:?}", light.light.shape);
                    assert!(through < 1e-5 && scattered < 1e-4, "{what}: {through:e} {scattered:e}");
                }
            }
        }
    }
}
