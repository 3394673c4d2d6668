//! The path tracer in media against closed forms. Every statistical check has a fixed seed; a pixel is held to 4 or 4.5
//! of its standard errors (two-sided 6e-5 and 7e-6), an image's mean to 3.3 (1e-3).

use crate::support::{assert_mean, parallel, trace};
use reference::{
    Density, Environment, LatLong, Lattice, LightSource, MarchParams, Medium, PathRules, PathSettings, PixelSampling,
    Scene, march_image,
};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Clip, DAabb, Grid};
use std::f64::consts::PI;

const WIDE: f64 = 1e6;

/// A slab between z = −thickness and z = 0, as wide as the sea.
fn slab<'a>(thickness: f64) -> Density<'a> {
    Density::Box(DAabb::new(DVec3::new(-WIDE, -WIDE, -thickness), DVec3::new(WIDE, WIDE, 0.0)))
}

fn settings(samples: u32, max_bounces: Option<u32>) -> PathSettings {
    let rules = PathRules { max_bounces, ..PathRules::default() };
    PathSettings { seed: 11, samples, batch: samples, rules, pixel: PixelSampling::Center, ..PathSettings::default() }
}

/// A blobby volume of n³ lattice points in the unit cube.
fn blobs(n: usize) -> Grid {
    let h = 1.0 / n as f64;
    let value = |i: usize| {
        let at = |k: usize| (k as f64 + 0.5) * h;
        let x = at(i % n);
        let y = at(i / n % n);
        let z = at(i / (n * n));
        let blob = |cx: f64, cy: f64, cz: f64, r: f64| {
            let d = DVec3::new(x - cx, y - cy, z - cz).length_squared() / (r * r);
            (1.0 - d).max(0.0).powi(2)
        };
        (blob(0.4, 0.45, 0.5, 0.4) + 0.7 * blob(0.65, 0.6, 0.4, 0.3)) as f32
    };
    Grid {
        origin: DVec3::splat(0.5 * h),
        axes: DMat3::from_diagonal(DVec3::splat(h)),
        dims: [n; 3],
        values: (0..n * n * n).map(value).collect(),
    }
}

/// Half a ball and a slab cut by an oblique plane and a box, against the chords that are left; what lies in a volume between its lattice points is cut likewise.
#[test]
fn what_a_cut_leaves_transmits_e_to_the_minus_tau_of_its_chord() {
    let camera = parallel(DVec3::Z * 3.0, DVec3::ZERO, 2.4, [8, 8]);
    let ball = Density::Ball { center: DVec3::ZERO, radius: 1.0 };
    let slab = slab(1.0);
    let ones = Grid { values: vec![1.0; 64], ..blobs(4) };
    let cube = Density::Grid(Lattice::new(&ones).unwrap());
    type Chord = fn(f64, f64) -> [f64; 2];
    let cases: [(&Density<'_>, Chord); 3] = [
        (&ball, |x, y| {
            let half = (1.0 - x * x - y * y).max(0.0).sqrt();
            [-half, half]
        }),
        (&slab, |_, _| [-1.0, 0.0]),
        (&cube, |x, y| if x.min(y) > 0.0 && x.max(y) < 1.0 { [0.0, 1.0] } else { [0.0, 0.0] }),
    ];
    let oblique = Clip::HalfSpace { normal: DVec3::new(1.0, -2.0, 4.0), offset: 0.3 };
    let boxed = Clip::Box(DAabb::new(DVec3::new(-0.7, -9.0, -0.9), DVec3::new(9.0, 0.8, 0.75)));
    let mut apart = 0;
    for (whole, chord) in cases {
        for clips in [&[oblique][..], &[oblique, boxed]] {
            let medium = Medium::new(Density::Cut { whole, clips }, 1.5, 0.0);
            let scene = Scene { media: vec![medium], background: Some([1.0; 3]), ..Scene::default() };
            let left = |pixel: usize| {
                let at = |k: usize| (k as f64 + 0.5) * 0.3 - 1.2;
                let x = at(pixel % 8);
                let y = -at(pixel / 8);
                let [near, far] = chord(x, y);
                let below = (0.3 - x + 2.0 * y) / 4.0;
                let within = clips.len() == 1 || (x > -0.7 && y < 0.8);
                let [near, far] = if clips.len() == 1 { [near, far] } else { [near.max(-0.9), far.min(0.75)] };
                if within { (far.min(below) - near).max(0.0) } else { 0.0 }
            };
            let marched = march_image(&scene, &camera, &MarchParams::default(), None).unwrap();
            let traced = trace(&scene, &camera, &settings(2000, None));
            for (pixel, found) in marched.radiance.iter().enumerate() {
                let exact = (-1.5 * left(pixel)).exp();
                assert!((found[0] - exact).abs() < 1e-6, "pixel {pixel}: {found:?}, expected {exact}");
                apart += usize::from(left(pixel) > 0.0);
            }
            assert_mean(&traced, |pixel| [(-1.5 * left(pixel)).exp(); 3], 4.5, "cut");
        }
    }
    assert!(apart > 60, "{apart} pixels show something");
}

#[test]
fn slab_transmits_e_to_the_minus_tau_per_channel() {
    let camera = parallel(DVec3::Z, DVec3::ZERO, 1.0, [4, 4]);
    for extinction in [[1.5; 3], [0.5, 1.5, 3.0]] {
        let medium = Medium { extinction, ..Medium::new(slab(1.0), 0.0, 0.0) };
        let scene = Scene { media: vec![medium], background: Some([1.0; 3]), ..Scene::default() };
        let with = PathSettings { transmittance: true, ..settings(2000, None) };
        let image = trace(&scene, &camera, &with);
        let truth = extinction.map(|e| (-e).exp());
        assert_mean(&image, |_| truth, 4.5, "slab");
        let through = image.transmittance.clone().unwrap();
        let ratio_tracked = reference::Estimate { radiance: through, ..image };
        assert_mean(&ratio_tracked, |_| truth, 4.5, "slab by ratio tracking");
    }
}

#[test]
fn homogeneous_ball_transmits_by_its_chords() {
    let size = [8, 8];
    let sigma = [0.7, 1.4, 2.8];
    let camera = parallel(DVec3::Z * 5.0, DVec3::ZERO, 2.4, size);
    let medium =
        Medium { extinction: sigma, ..Medium::new(Density::Ball { center: DVec3::ZERO, radius: 1.0 }, 0.0, 0.0) };
    let scene = Scene { media: vec![medium], background: Some([1.0; 3]), ..Scene::default() };
    let truth = |k: usize| {
        let at = |i: usize| ((i as f64 + 0.5) / 8.0 - 0.5) * 2.4;
        let apart = at(k % 8).powi(2) + at(k / 8).powi(2);
        sigma.map(|s| (-2.0 * s * (1.0 - apart).max(0.0).sqrt()).exp())
    };
    assert_mean(&trace(&scene, &camera, &settings(2000, None)), truth, 4.5, "ball");
    let marched = march_image(&scene, &camera, &MarchParams::default(), None).unwrap();
    for (k, t) in marched.transmittance.iter().enumerate() {
        (0..3).for_each(|c| assert!((t[c] - truth(k)[c]).abs() < 1e-13, "marched pixel {k}"));
    }
}

#[test]
fn light_at_the_centre_of_a_ball_sends_out_what_the_medium_scattered() {
    // Albedo 1: all of the intensity I leaves, the share e^{−σR} unscattered, the rest as the ball's own image.
    let sigma = 2.0;
    let intensity = [3.0, 2.0, 1.0];
    let medium = Medium::new(Density::Ball { center: DVec3::ONE, radius: 1.0 }, sigma, 1.0);
    let light = LightSource::Point { position: DVec3::ONE, intensity };
    let scene = Scene { media: vec![medium], lights: vec![light], ..Scene::default() };
    let camera = parallel(DVec3::new(1.0, 1.0, 5.0), DVec3::ONE, 2.0, [16, 16]);
    let image = trace(&scene, &camera, &PathSettings { pixel: PixelSampling::Area, ..settings(1000, None) });
    let pixel_area = (2.0f64 / 16.0).powi(2);
    for c in 0..3 {
        let found: f64 = image.radiance.mean.iter().map(|m| m[c]).sum::<f64>() * pixel_area;
        let variance: f64 = image.radiance.standard_error.iter().map(|e| e[c] * e[c]).sum();
        let error = variance.sqrt() * pixel_area;
        let exact = intensity[c] * (1.0 - (-sigma).exp());
        // Two-sided 1e-3.
        assert!((found - exact).abs() < 3.3 * error, "channel {c}: {found} ± {error}, exactly {exact}");
        assert!(error < 0.03 * exact, "channel {c}: ± {error} proves little");
    }
}

#[test]
fn sphere_light_in_a_ball_loses_nothing() {
    // Power 4πr²·πL, albedo 1: the image of the ball, its light included, integrates to πr²L from every side.
    let ball = Density::Ball { center: DVec3::ZERO, radius: 1.0 };
    let medium = Medium { asymmetry: 0.5, ..Medium::new(ball, 2.0, 1.0) };
    let light = LightSource::Sphere { center: DVec3::ZERO, radius: 0.3, radiance: [10.0; 3] };
    let scene = Scene { media: vec![medium], lights: vec![light], ..Scene::default() };
    let camera = parallel(DVec3::Z * 5.0, DVec3::ZERO, 2.0, [16, 16]);
    let image = trace(&scene, &camera, &PathSettings { pixel: PixelSampling::Area, ..settings(1000, None) });
    let sum = image.radiance.mean.iter().map(|m| m[0]).sum::<f64>();
    let variance = image.radiance.standard_error.iter().map(|e| e[0] * e[0]).sum::<f64>();
    let per = (2.0f64 / 16.0).powi(2);
    let found = sum * per;
    let error = variance.sqrt() * per;
    let exact = PI * 0.09 * 10.0;
    // Two-sided 1e-3.
    assert!((found - exact).abs() < 3.3 * error, "{found} ± {error}, exactly {exact}");
    assert!(error < 0.01 * exact, "± {error} proves little");
}

#[test]
fn light_in_a_ball_once_scattered_agrees_with_quadrature_and_the_marcher() {
    let sigma = 1.5;
    let omega = 0.8;
    let medium = Medium::new(Density::Ball { center: DVec3::ZERO, radius: 1.0 }, sigma, omega);
    let light = LightSource::Point { position: DVec3::ZERO, intensity: [2.0; 3] };
    let scene = Scene { media: vec![medium], lights: vec![light], ..Scene::default() };
    let camera = parallel(DVec3::Z * 3.0, DVec3::ZERO, 2.0, [6, 6]);
    // L = ωσI/4πb ∫ e^{−σ(t + h)} e^{−σd} dθ, t = b tan θ, d = b/cos θ, |θ| < atan(h/b), by the midpoint rule.
    let truth = |k: usize| {
        let at = |i: usize| ((i as f64 + 0.5) / 6.0 - 0.5) * 2.0;
        let b = at(k % 6).hypot(at(k / 6));
        if b >= 1.0 {
            return [0.0; 3];
        }
        let h = (1.0 - b * b).sqrt();
        let limit = (h / b).atan();
        let n = 20_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let theta = limit * ((2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0);
                (-sigma * (b * theta.tan() + h + b / theta.cos())).exp()
            })
            .sum();
        [omega * sigma * 2.0 / (4.0 * PI * b) * sum * 2.0 * limit / f64::from(n); 3]
    };
    assert_mean(&trace(&scene, &camera, &settings(4000, Some(1))), truth, 4.0, "once scattered");
    let marched = march_image(&scene, &camera, &MarchParams::default(), None).unwrap();
    for k in 0..36 {
        let found = marched.radiance[k][0];
        let error = marched.error[k][0];
        assert!((found - truth(k)[0]).abs() <= error + 1e-7, "pixel {k}: {found} ± {error}, {}", truth(k)[0]);
        assert!(error <= 3e-6 * found, "pixel {k}: {error}");
    }
}

#[test]
fn white_furnace_of_a_medium_of_albedo_one() {
    let grid = blobs(16);
    let lattice = Lattice::new(&grid).unwrap();
    let ball = Density::Ball { center: DVec3::splat(0.5), radius: 1.0 };
    let one = LatLong::new([4, 3], vec![[1.0; 3]; 12]).unwrap();
    let camera = parallel(DVec3::new(0.5, 0.5, 3.0), DVec3::splat(0.5), 1.2, [8, 8]);
    // Channels of other extinction in the ball alone: at the thin rim of the blobs collisions are so rare that the
    // standard error of a few hundred samples misses them.
    let cases = [
        (Density::Grid(lattice), [20.0; 3], 0.0),
        (Density::Grid(lattice), [20.0; 3], -0.5),
        (ball, [2.0, 4.0, 6.0], 0.7),
    ];
    for (density, extinction, asymmetry) in cases {
        let medium = Medium { extinction, asymmetry, ..Medium::new(density, 0.0, 1.0) };
        for environment in [Environment::Constant([1.0; 3]), Environment::Image(one.clone())] {
            let scene = Scene { media: vec![medium], environment, ..Scene::default() };
            let image = trace(&scene, &camera, &settings(600, None));
            assert_mean(&image, |_| [1.0; 3], 4.5, "furnace");
            assert_eq!(image.majorant_violations, 0);
        }
    }
}

#[test]
fn thin_slab_scatters_parallel_light_once() {
    // L = ωp(θ)E·(1 − e^{−τ(1/μ + 1/μ₀)})/(1 + μ/μ₀), seen from the lit side along μ; Chandrasekhar 1960, §47.
    let omega = 0.9;
    let g = 0.6;
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let light = LightSource::Directional { direction, irradiance: [1.0, 2.0, 3.0] };
    let eye = DVec3::new(0.0, 0.28, 0.96);
    let camera = parallel(eye, DVec3::ZERO, 1.0, [3, 3]);
    let p = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * direction.dot(eye)).powf(1.5));
    for tau in [0.01, 1.0, 4.0] {
        let medium = Medium { asymmetry: g, ..Medium::new(slab(1.0), tau, omega) };
        let scene = Scene { media: vec![medium], lights: vec![light], ..Scene::default() };
        let mu = 0.96;
        let mu0 = 0.8;
        let l = omega * p * (-(-tau * (1.0 / mu + 1.0 / mu0)).exp_m1()) / (1.0 + mu / mu0);
        let truth = [1.0, 2.0, 3.0].map(|e| e * l);
        assert_mean(&trace(&scene, &camera, &settings(20_000, Some(1))), |_| truth, 4.0, "thin slab");
        let marched = march_image(&scene, &camera, &MarchParams::default(), None).unwrap();
        (0..3).for_each(|c| assert!((marched.radiance[4][c] / truth[c] - 1.0).abs() < 2e-6, "marched, tau {tau}"));
    }
}

/// A sky of radiance `above` for z > 0 and `below` for z < 0 does not fit rows around +Y, so slabs here lie across y.
fn slab_under_sky(tau: f64, g: f64, above: f64, below: f64) -> (Medium<'static>, Environment) {
    let density = Density::Box(DAabb::new(DVec3::new(-WIDE, -1.0, -WIDE), DVec3::new(WIDE, 0.0, WIDE)));
    let sky = LatLong::new([1, 2], vec![[above; 3], [below; 3]]).unwrap();
    (Medium { asymmetry: g, ..Medium::new(density, tau, 1.0) }, Environment::Image(sky))
}

#[test]
fn thick_slab_transmits_as_diffusion_theory_says() {
    // Conservative isotropic scattering under a uniform sky: L(μ) = K(μ)·(4/3)/(τ + 2q∞), q∞ = 0.710446 the extrapolation
    // length of Milne's problem, K(1) = √3/4·H(1), H(1) = 2.9078 (Chandrasekhar 1960). The next term is of order e^−τ:
    // 0.03 % at τ = 8. H has five digits. What is left is noise.
    let camera = |from: f64| parallel(DVec3::new(0.0, from, 0.0), DVec3::new(0.0, 10.0 + from, 0.0), 1.0, [8, 8]);
    let (medium, environment) = slab_under_sky(8.0, 0.0, 1.0, 0.0);
    let scene = Scene { media: vec![medium], environment, ..Scene::default() };
    let image = trace(&scene, &camera(-2.0), &settings(600, None));
    let exact = 3f64.sqrt() / 4.0 * 2.9078 * (4.0 / 3.0) / (8.0 + 2.0 * 0.710446);
    let n = image.radiance.mean.len() as f64;
    let found = image.radiance.mean.iter().map(|m| m[1]).sum::<f64>() / n;
    let error = image.radiance.standard_error.iter().map(|e| e[1] * e[1]).sum::<f64>().sqrt() / n;
    // Two-sided 1e-3, and the series' remainder.
    assert!((found - exact).abs() < 3.3 * error + 5e-4 * exact, "{found} ± {error}, exactly {exact}");
    assert!(error < 0.02 * exact, "± {error} proves little");
}

#[test]
fn slab_of_albedo_one_reflects_what_it_does_not_transmit() {
    let camera = parallel(DVec3::new(0.0, -2.0, 0.0), DVec3::ZERO, 1.0, [6, 6]);
    let run = |above: f64, below: f64, seed: u64| {
        let (medium, environment) = slab_under_sky(3.0, 0.5, above, below);
        let scene = Scene { media: vec![medium], environment, ..Scene::default() };
        trace(&scene, &camera, &PathSettings { seed, ..settings(1500, None) })
    };
    let transmitted = run(1.0, 0.0, 1);
    let reflected = run(0.0, 1.0, 2);
    let mut sum = transmitted.clone();
    for k in 0..36 {
        for c in 0..3 {
            sum.radiance.mean[k][c] += reflected.radiance.mean[k][c];
            let errors = [&transmitted, &reflected].map(|e| e.radiance.standard_error[k][c].powi(2));
            sum.radiance.standard_error[k][c] = (errors[0] + errors[1]).sqrt();
        }
    }
    assert_mean(&sum, |_| [1.0; 3], 4.0, "R + T");
}

#[test]
fn single_scattering_in_a_volume_agrees_with_the_marcher() {
    let grid = blobs(12);
    let medium = Medium {
        extinction: [4.0, 8.0, 12.0],
        albedo: [0.9, 0.8, 0.7],
        asymmetry: 0.5,
        emission: [0.1, 0.0, 0.2],
        ..Medium::new(Density::Grid(Lattice::new(&grid).unwrap()), 0.0, 0.0)
    };
    let lights = vec![
        LightSource::Directional { direction: DVec3::new(-0.6, -0.8, 0.0), irradiance: [3.0, 2.0, 1.0] },
        LightSource::Point { position: DVec3::new(0.6, 0.7, 0.8), intensity: [0.3; 3] },
    ];
    let scene = Scene { media: vec![medium], lights, background: Some([0.2; 3]), ..Scene::default() };
    let camera = parallel(DVec3::new(0.5, 0.5, 3.0), DVec3::splat(0.5), 1.0, [6, 6]);
    let marched = march_image(&scene, &camera, &MarchParams::default(), None).unwrap();
    let rules = PathRules { max_bounces: Some(1), emission_illuminates: false, ..PathRules::default() };
    let traced = trace(&scene, &camera, &PathSettings { rules, ..settings(3000, None) });
    assert_mean(&traced, |k| marched.radiance[k], 4.5, "volume");
    assert!(marched.error.iter().flatten().all(|e| *e < 1e-5));
}

#[test]
fn a_broken_majorant_is_counted_and_does_not_bias() {
    let density = |_: DVec3| 2.0;
    let bounds = DAabb::new(DVec3::new(-WIDE, -WIDE, -1.0), DVec3::new(WIDE, WIDE, 0.0));
    let density = Density::Function { function: &density, bounds, majorant: 1.6 };
    let scene = Scene { media: vec![Medium::new(density, 1.0, 0.0)], background: Some([1.0; 3]), ..Scene::default() };
    let camera = parallel(DVec3::Z, DVec3::ZERO, 1.0, [4, 4]);
    let image = trace(&scene, &camera, &settings(4000, None));
    assert!(image.majorant_violations > 0);
    assert_mean(&image, |_| [(-2.0f64).exp(); 3], 4.5, "broken majorant");
}
