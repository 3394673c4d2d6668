//! Volumes behind a transfer function, shaded by their gradient: the integral against closed forms and a sum of steps, and the
//! path tracer against the integral.

use crate::support::{assert_mean, parallel, trace};
use reference::{
    Classified, Density, Facets, Liberty, LightSource, MarchParams, Medium, PathRules, PathSettings, PixelSampling,
    Ray, Scene, march, march_image, optical_depth,
};
use splat_core::glam::{DMat3, DQuat, DVec3, EulerRot};
use splat_core::{Grid, Similarity, TransferFunction, TransferPoint};
use std::f64::consts::PI;

/// Tight, so that what is left is the method's.
const EXACT: MarchParams = MarchParams { relative_tolerance: 1e-10, max_intervals: 20_000 };

fn transfer(points: &[(f32, [f32; 3], f32)]) -> TransferFunction {
    let point = |&(value, color, extinction)| TransferPoint { value, color, extinction };
    TransferFunction::new(points.iter().map(point).collect()).unwrap()
}

/// Cells of 1/8 in the unit cube with values by their middles.
fn unit_cube(value: impl Fn(DVec3) -> f64) -> Grid {
    let at = |k: usize| DVec3::new((k % 8) as f64, (k / 8 % 8) as f64, (k / 64) as f64) / 8.0 + 0.0625;
    let values = (0..512).map(|k| value(at(k)) as f32).collect();
    Grid { origin: DVec3::splat(0.0625), axes: DMat3::from_diagonal(DVec3::splat(0.125)), dims: [8; 3], values }
}

fn along_z(p: DVec3) -> Ray {
    Ray { origin: p + DVec3::Z * 3.0, direction: DVec3::NEG_Z }
}

#[test]
fn ramps_and_constants_have_their_optical_depth_to_rounding() {
    // Zero up to 1/4, up to 8 at 1/2, down to 2 at 3/4; kinks lie within cells and on none of their faces.
    let tent = || transfer(&[(0.26, [1.0; 3], 0.0), (0.51, [1.0; 3], 8.0), (0.77, [1.0; 3], 2.0)]);
    // Of the ramp v = z, constant in the outer half cells.
    let f64_of = |v: f32| f64::from(v);
    let a = f64_of(0.26);
    let b = f64_of(0.51);
    let c = f64_of(0.77);
    let exact = 0.5 * 8.0 * (b - a) + 0.5 * (8.0 + 2.0) * (c - b) + 2.0 * (1.0 - c);
    let ramp = Classified::new(unit_cube(|p| p.z), tent(), &Similarity::default());
    let constant = Classified::new(unit_cube(|_| 0.385), tent(), &Similarity::default());
    let of_constant = 8.0 * (f64_of(0.385) - a) / (b - a);
    for (volume, exact) in [(&ramp, exact), (&constant, of_constant)] {
        let media = [Medium::new(Density::Volume(volume), 1.0, 0.0)];
        let tau = optical_depth(&media, &along_z(DVec3::new(0.31, 0.64, 0.0)), 0.0, f64::INFINITY, &EXACT);
        assert!((tau.value[1] / exact - 1.0).abs() < 1e-13, "{tau:?}, exactly {exact}");
    }
}

/// A facet of everything that a Phong surface has.
fn facets(normal: &(dyn Fn(DVec3) -> DVec3 + Sync)) -> Facets<'_> {
    Facets { normal, diffuse: 0.75, transmission: 0.2, specular: 0.3, shininess: 12.0, glow: [0.0; 3] }
}

#[test]
fn a_slanted_ramp_under_a_light_from_the_eye_is_as_bright_as_its_closed_form() {
    // Whatever its extinction, light goes in and comes back on one way: f·E·(1 − e^−2τ)/2, f of the one normal that there is.
    let slope = DVec3::new(0.3, -0.4, -0.6);
    let turn = Similarity {
        rotation: DQuat::from_euler(EulerRot::XYZ, 0.3, 0.2, 0.1),
        scale: 1.7,
        translation: DVec3::new(-0.4, 0.2, 0.1),
    };
    let grid = unit_cube(|p| 0.5 + slope.dot(p - 0.5));
    let colors = transfer(&[(0.2, [0.8, 0.6, 0.4], 0.5), (0.5, [0.8, 0.6, 0.4], 3.0), (0.9, [0.8, 0.6, 0.4], 1.0)]);
    let volume = Classified::new(grid, colors, &turn);
    let (color, normal) = (|p: DVec3| volume.color(p), |p: DVec3| volume.normal(p));
    let medium = Medium {
        color: Some(&color),
        facets: Some(facets(&normal)),
        ..Medium::new(Density::Volume(&volume), 1.0, 0.0)
    };
    let light = LightSource::Directional { direction: DVec3::NEG_Z, irradiance: [3.0, 2.0, 1.0] };
    let n = -(turn.rotation * slope).normalize();
    let cosine = n.z;
    // The light's mirror image is as far from the eye as twice its angle to the normal.
    let specular = 0.3 * 14.0 / (2.0 * PI) * (2.0 * cosine * cosine - 1.0).max(0.0).powi(12) * cosine;
    for p in [turn.apply(DVec3::splat(0.5)), turn.apply(DVec3::new(0.3, 0.7, 0.4))] {
        let ray = along_z(DVec3::new(p.x, p.y, 0.0));
        let tau = optical_depth(&[medium], &ray, 0.0, f64::INFINITY, &EXACT).value[1];
        assert!(tau > 1.0);
        let found = march(&[medium], &[light], &ray, [0.0, f64::INFINITY], &EXACT).unwrap().radiance.value;
        for (c, (irradiance, own)) in [3.0, 2.0, 1.0].into_iter().zip([0.8f32, 0.6, 0.4]).enumerate() {
            let f = 0.75 * f64::from(own) * 0.8 * cosine / PI + specular;
            let exact = irradiance * f * -(-2.0 * tau).exp_m1() / 2.0;
            assert!((found[c] / exact - 1.0).abs() < 1e-6, "channel {c}: {found:?}, exactly {exact}");
        }
    }
}

/// A bumpy volume behind a transfer function with a shell, coloured.
fn bumpy() -> Classified {
    let grid = unit_cube(|p| 1.1 - 2.0 * (p - 0.5).length() + 0.2 * (9.0 * p.x).sin() * (7.0 * p.y + 2.0 * p.z).cos());
    let shell = [(0.2, [0.9, 0.3, 0.2], 0.0), (0.5, [0.3, 0.9, 0.3], 6.0), (0.7, [0.2, 0.3, 0.9], 1.0)];
    Classified::new(grid, transfer(&shell), &Similarity::default())
}

#[test]
fn sums_of_steps_tend_to_the_integral_with_the_second_order() {
    let volume = bumpy();
    let (color, normal) = (|p: DVec3| volume.color(p), |p: DVec3| volume.normal(p));
    let facets_of_volume = facets(&normal);
    let medium = Medium {
        color: Some(&color),
        facets: Some(facets_of_volume),
        ..Medium::new(Density::Volume(&volume), 1.0, 0.5)
    };
    let to_light = DVec3::new(0.5, 0.3, 0.7).normalize();
    let light = LightSource::Directional { direction: -to_light, irradiance: [2.0; 3] };
    // Steps of one width for the eye and for the light, each by its middle, and the formulas once more.
    let optical_depth = |p: DVec3, steps: u32| {
        let h = 2.0 / f64::from(steps);
        (0..steps).map(|i| volume.extinction(p + to_light * h * (f64::from(i) + 0.5)) * h).sum::<f64>()
    };
    let radiance = |ray: &Ray, steps: u32| {
        let h = 2.0 / f64::from(steps);
        let mut tau = 0.0;
        let mut sum = 0.0;
        for i in 0..steps {
            let p = ray.at(2.0 + h * (f64::from(i) + 0.5));
            let step = volume.extinction(p) * h;
            let n = volume.normal(p);
            if step > 0.0 && n != DVec3::ZERO {
                let cosine = n.dot(to_light);
                let share =
                    if cosine > 0.0 { 1.0 - facets_of_volume.transmission } else { facets_of_volume.transmission };
                let mirrored = n * (2.0 * cosine) - to_light;
                let lobe = mirrored.dot(-ray.direction).max(0.0).powf(facets_of_volume.shininess) * cosine.max(0.0);
                let f = facets_of_volume.diffuse * volume.color(p)[1] * share * cosine.abs() / PI
                    + facets_of_volume.specular * 14.0 / (2.0 * PI) * lobe;
                // The middle of the step, for the eye too.
                sum += step * f * 2.0 * (-(tau + 0.5 * step) - optical_depth(p, steps)).exp();
            }
            tau += step;
        }
        sum
    };
    let rays: Vec<Ray> = (0..9)
        .map(|i| along_z(DVec3::new(0.21 + 0.19 * f64::from(i % 3), 0.27 + 0.2 * f64::from(i / 3), 0.0)))
        .collect();
    let exact: Vec<f64> = rays
        .iter()
        .map(|ray| {
            let params = MarchParams { relative_tolerance: 1e-6, max_intervals: 4000 };
            march(&[medium], &[light], ray, [0.0, f64::INFINITY], &params).unwrap().radiance.value[1]
        })
        .collect();
    let error = |steps: u32| {
        let square = |(ray, exact): (&Ray, &f64)| (radiance(ray, steps) - exact).powi(2);
        (rays.iter().zip(&exact).map(square).sum::<f64>() / 9.0).sqrt()
    };
    let errors = [50, 100, 200, 400, 800].map(error);
    println!("mean {}, errors {errors:?}", exact.iter().sum::<f64>() / 9.0);
    let order = (errors[0] / errors[4]).log2() / 4.0;
    assert!(order > 1.9, "order {order}: {errors:?}");
    assert!(errors[4] < 1e-4 * exact[4], "{errors:?} of {}", exact[4]);
}

#[test]
fn paths_reflected_in_a_volume_agree_with_the_integral() {
    let volume = bumpy();
    let (color, normal) = (|p: DVec3| volume.color(p), |p: DVec3| volume.normal(p));
    let medium = Medium {
        extinction: [2.0, 1.5, 1.0],
        emission: [0.1, 0.0, 0.2],
        color: Some(&color),
        facets: Some(Facets { glow: [0.3; 3], ..facets(&normal) }),
        ..Medium::new(Density::Volume(&volume), 0.0, 0.5)
    };
    // One light outside of the volume's box, one in it, which is taken along segments.
    let lights = vec![
        LightSource::Directional { direction: DVec3::new(-0.6, -0.8, 0.0), irradiance: [3.0, 2.0, 1.0] },
        LightSource::Point { position: DVec3::new(0.9, 0.85, 0.95), intensity: [0.3; 3] },
    ];
    let scene = Scene { media: vec![medium], lights, background: Some([0.2; 3]), ..Scene::default() };
    let camera = parallel(DVec3::new(0.5, 0.5, 3.0), DVec3::splat(0.5), 1.0, [5, 5]);
    let marched =
        march_image(&scene, &camera, &MarchParams { relative_tolerance: 1e-4, ..MarchParams::default() }, None);
    let marched = marched.unwrap();
    // Alike where surfaces are reflected apart from media: each path is reflected once.
    for reflects_apart in [false, true] {
        let max_bounces = (!reflects_apart).then_some(1);
        let rules = PathRules { max_bounces, emission_illuminates: false, reflects_apart, ..PathRules::default() };
        let settings = PathSettings {
            seed: 11,
            samples: 3000,
            batch: 3000,
            rules,
            pixel: PixelSampling::Center,
            ..PathSettings::default()
        };
        let traced = trace(&scene, &camera, &settings);
        assert_mean(&traced, |k| marched.radiance[k], 4.5, "volume with normals");
    }
    // The comparison can fail: the same volume scatters instead.
    let scene = Scene { media: vec![Medium { facets: None, ..medium }], ..scene };
    let scattered =
        march_image(&scene, &camera, &MarchParams { relative_tolerance: 1e-4, ..MarchParams::default() }, None);
    let [here, there] = [&marched, &scattered.unwrap()].map(|image| image.radiance[12][1]);
    assert!((here / there - 1.0).abs() > 0.1, "{here} {there}");
    assert_eq!(medium.liberty, Liberty::default());
}
