//! The paper's Brownian motion: stays on the surface, stays uniform, and counts what it must.

use crate::common::*;
use pbsr::{
    BrownianParams, BrownianSampler, Error, ImplicitSurface, LineParams, LineSampler, SurfaceParams, Walk, pixel_area,
};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{DAabb, ScalarField};
use std::f64::consts::PI;

fn boxed(field: &Field, half: f64) -> ImplicitSurface<'_> {
    ImplicitSurface { field, level: 0.0, bounds: DAabb::new(DVec3::splat(-half), DVec3::splat(half)), inside: None }
}

fn walk_on(walk: &Walk<'_>, starts: &[DVec3], steps: u64) -> Vec<DVec3> {
    let walked =
        |(i, start): (usize, &DVec3)| (0..steps).fold(*start, |x, n| walk.step(x, 11, i as u64, n).unwrap_or(x));
    starts.par_iter().enumerate().map(walked).collect()
}

#[test]
fn pb08_walkers_stay_on_the_surface_for_every_step() {
    for (field, half) in [(Field::UNIT, 1.2), (Field::Torus { large: 1.0, small: 0.4 }, 1.6)] {
        for step in [0.2, 0.1, 0.05, 0.01] {
            let surface = boxed(&field, half);
            let walk = Walk::new(&surface, step).unwrap();
            let start = walk.project(DVec3::new(0.9, 0.5, 0.3)).unwrap();
            let mut x = start;
            for n in 0..2000 {
                x = walk.step(x, 1, 0, n).unwrap_or(x);
                let distance = field.value(x).abs() / field.gradient(x).length();
                assert!(distance <= 1e-6 * half, "step {step}: {distance} off the surface");
            }
            assert!((x - start).length() > 0.0);
        }
    }
}

#[test]
fn pb13_walkers_that_are_uniform_stay_so() {
    // Equal-area bins of height, 20 000 walkers after 300 steps of dt = 0.005: more than one relaxation time.
    let field = Field::Ellipsoid { axes: DVec3::new(1.0, 1.0, 2.0) };
    let surface = ImplicitSurface {
        bounds: DAabb::new(DVec3::new(-1.2, -1.2, -2.2), DVec3::new(1.2, 1.2, 2.2)),
        ..boxed(&field, 1.0)
    };
    let params = SurfaceParams { opacity: 0.5, cross_section: 6e-4, ..SurfaceParams::default() };
    let starts = positions(&LineSampler::new(&surface, &LineParams { resolution: 24 }, &params, None).unwrap(), 0);
    assert!(starts.len() >= 20_000, "{}", starts.len());
    // A set lists its particles by place.
    let starts: Vec<DVec3> = (0..20_000).map(|i| starts[i * starts.len() / 20_000]).collect();
    let walk = Walk::new(&surface, 0.1).unwrap();
    let ends = walk_on(&walk, &starts, 300);
    let below = |z: f64| {
        let k = (3.0f64 / 16.0).sqrt();
        let x = (k * z).clamp(-1.0, 1.0);
        0.5 * (x * (1.0 - x * x).sqrt() + x.asin())
    };
    let low = below(-2.0);
    let high = below(2.0);
    let mut bins = [0u64; 20];
    ends.iter().for_each(|p| bins[((below(p.z) - low) / (high - low) * 20.0).clamp(0.0, 19.0) as usize] += 1);
    let chi2 = chi2_equal(&bins);
    assert!(chi2 < chi2_limit(19.0), "χ² {chi2}: {bins:?}");
    // They did move: no memory of where they began.
    let memory: f64 = starts.iter().zip(&ends).map(|(a, b)| a.z * b.z).sum::<f64>() / 20_000.0;
    assert!(memory < 0.8, "{memory}");
}

#[test]
fn pb13_walkers_from_one_place_become_uniform() {
    let surface = boxed(&Field::UNIT, 1.2);
    let walk = Walk::new(&surface, 0.1).unwrap();
    // e^(−2·t) is left of the lowest harmonic after t = n·dt: 10⁻⁶ after 1400 steps of 0.005.
    let ends = walk_on(&walk, &vec![DVec3::Z; 4000], 1400);
    let mut bins = [0u64; 20];
    ends.iter().for_each(|p| bins[((p.z + 1.0) * 10.0).clamp(0.0, 19.0) as usize] += 1);
    let chi2 = chi2_equal(&bins);
    assert!(chi2 < chi2_limit(19.0), "χ² {chi2}: {bins:?}");
}

#[test]
fn pb09_double_roots_converge_or_are_refused() {
    let surface = boxed(&Field::Double, 1.5);
    let walk = Walk::new(&surface, 0.02).unwrap();
    for r in [0.7, 0.95, 1.05, 1.3] {
        let on = walk.project(DVec3::new(0.6, 0.0, 0.8) * r).unwrap();
        assert!((on.length() - 1.0).abs() < 1e-6, "from {r}: {}", on.length());
    }
    let mut x = walk.project(DVec3::X * 1.1).unwrap();
    for n in 0..500 {
        x = walk.step(x, 3, 0, n).unwrap_or(x);
        assert!(x.is_finite() && (x.length() - 1.0).abs() < 1e-5, "{x}");
    }
}

#[test]
fn pb10_a_singular_point_throws_nobody_out() {
    let surface = boxed(&Field::Cone, 1.0);
    let walk = Walk::new(&surface, 0.05).unwrap();
    assert!(walk.project(DVec3::ZERO).is_none_or(|p| p == DVec3::ZERO));
    let mut refused = 0;
    for w in 0..50 {
        let mut x = walk.project(DVec3::new(0.02, 0.01, 0.02)).unwrap();
        for n in 0..300 {
            let next = walk.step(x, 5, w, n);
            refused += u32::from(next.is_none());
            x = next.unwrap_or(x);
            assert!(x.is_finite() && x.abs().max_element() <= 1.0, "{x}");
        }
    }
    // Walkers begin at the apex, where some steps end on the other half of the cone.
    assert!(refused > 0 && refused < 15_000 / 20, "{refused} of 15,000 steps refused");
}

#[test]
fn pb11_walks_do_not_depend_on_the_scale_of_the_field() {
    let at = |scale: f64| {
        let field = Field::Sphere { middle: DVec3::ZERO, radius: 1.0, scale };
        let surface = boxed(&field, 1.2);
        let walk = Walk::new(&surface, 0.05).unwrap();
        (0..200).fold(DVec3::X, |x, n| walk.step(x, 7, 1, n).unwrap_or(x))
    };
    for power in [60, -60, 300, -300] {
        assert_eq!(at(2f64.powi(power)), at(1.0), "2^{power}");
    }
}

#[test]
fn pb12_walkers_do_not_hop_between_sheets_and_visit_all_components() {
    let field = Field::Sheets { gap: 5e-4 };
    let surface = boxed(&field, 1.0);
    let walk = Walk::new(&surface, 0.01).unwrap();
    let mut x = DVec3::new(0.0, 0.0, 5e-4);
    for n in 0..3000 {
        x = walk.step(x, 2, 0, n).unwrap_or(x);
        assert!(x.z > 0.0, "hopped at step {n}");
    }
    let field = Field::Two { radius: [0.3, 0.6], apart: 0.7 };
    let surface = boxed(&field, 1.4);
    let params = SurfaceParams { opacity: 0.3, cross_section: 2e-4, ..SurfaceParams::default() };
    let brownian = BrownianParams::for_width(1.0);
    let sampler = BrownianSampler::new(&surface, &brownian, &params).unwrap();
    let places = positions(&sampler, 0);
    let left = places.iter().filter(|p| p.x < -0.2).count() as f64;
    let expected = places.len() as f64 * 0.2;
    assert!((left - expected).abs() < 4.5 * (2.0 * expected).sqrt(), "{left} for {expected}");
}

#[test]
fn counting_spheres_find_area_and_opacity() {
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let field = Field::Sphere { middle: DVec3::ZERO, radius: 0.8, scale: 1.0 };
    let params = SurfaceParams { opacity: 0.2, cross_section: s, ..SurfaceParams::default() };
    let sampler = BrownianSampler::new(&boxed(&field, 1.0), &BrownianParams::for_width(1.6), &params).unwrap();
    let report = *sampler.report();
    let area = 4.0 * PI * 0.64;
    assert!((report.area / area - 1.0).abs() < 4.0 * report.area_error, "{report:?} for {area}");
    assert!(report.area_error < 0.02 && report.refused < 0.01, "{report:?}");
    // Opacity in the middle, two crossings near right angles.
    let ensemble = render(&camera, &[&sampler], 400);
    let mut hits = 0.0;
    let mut expected = 0.0;
    for y in 12..20 {
        for x in 12..20 {
            let at = |v: u32| (f64::from(v) + 0.5) / 16.0 - 1.0;
            let cosine = (1.0 - at(x).hypot(at(y)).powi(2) / 0.64).sqrt();
            expected += 1.0 - 0.8f64.powf(2.0 / cosine * area / report.area);
            hits += f64::from(ensemble.hits(x, y)) / 400.0;
        }
    }
    let sigma = (64.0 * 0.36 * 0.64 / 400.0f64).sqrt();
    assert!((hits - expected).abs() < 4.0 * sigma, "{hits} for {expected} ± {sigma}");
}

#[test]
fn open_surfaces_reflect_and_keep_their_density() {
    // The plane z = 0 in a box: walkers from everywhere, uniform in x after many steps.
    let field = Field::Plane { normal: DVec3::Z, distance: 0.0 };
    let surface = boxed(&field, 1.0);
    let walk = Walk::new(&surface, 0.1).unwrap();
    let starts: Vec<DVec3> = (0..8000).map(|i| DVec3::new((f64::from(i) + 0.5) / 4000.0 - 1.0, 0.0, 0.0)).collect();
    let ends = walk_on(&walk, &starts, 200);
    let mut bins = [0u64; 20];
    ends.iter().for_each(|p| bins[((p.x + 1.0) * 10.0).clamp(0.0, 19.0) as usize] += 1);
    let chi2 = chi2_equal(&bins);
    assert!(chi2 < chi2_limit(19.0), "χ² {chi2}: {bins:?}");
    assert!(ends.iter().all(|p| p.abs().max_element() <= 1.0));
}

#[test]
fn what_cannot_be_walked_on_says_why() {
    let params = SurfaceParams::default();
    let brownian = BrownianParams::for_width(1.0);
    let refused = |field: &Field| BrownianSampler::new(&boxed(field, 1.2), &brownian, &params).err().unwrap();
    assert!(matches!(refused(&Field::Nothing), Error::Empty { .. }));
    assert!(matches!(refused(&Field::Broken), Error::Field { .. }));
    let no_step = BrownianParams { step: 0.0, ..brownian };
    assert!(BrownianSampler::new(&boxed(&Field::UNIT, 1.2), &no_step, &params).is_err());
}

/// x¹⁰²⁵, which is no number other than 0 within half of its box: lines hardly find where it changes its sign.
struct Steep;

impl ScalarField for Steep {
    fn value(&self, p: DVec3) -> f64 {
        p.x.powi(1025)
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        DVec3::new(1025.0 * p.x.powi(1024), 0.0, 0.0)
    }

    fn bound(&self, center: DVec3, radius: f64) -> Option<(f64, f64)> {
        Some(((center.x - radius).powi(1025), (center.x + radius).powi(1025)))
    }
}

#[test]
fn a_surface_that_lines_hardly_meet_is_not_walked_on() {
    let bounds = DAabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    let surface = ImplicitSurface { field: &Steep, level: 0.0, bounds, inside: None };
    let walk = BrownianParams { step: 0.1, resolution: 8, ..BrownianParams::for_width(2.0) };
    let refused = BrownianSampler::new(&surface, &walk, &SurfaceParams::default()).err().unwrap();
    assert!(matches!(&refused, Error::Empty { reason, .. } if reason.contains("by lines")), "{refused}");
}
