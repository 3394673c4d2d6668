//! Random lines on implicit surfaces: uniform, exact in opacity, and clear about what they could not find.

use crate::common::*;
use pbsr::{Density, Error, ImplicitSurface, LineParams, LineSampler, Sampler, SurfaceParams, pixel_area};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{DAabb, ScalarField};
use std::f64::consts::PI;

fn boxed(field: &Field, half: f64) -> ImplicitSurface<'_> {
    ImplicitSurface { field, level: 0.0, bounds: DAabb::new(DVec3::splat(-half), DVec3::splat(half)), inside: None }
}

fn params(opacity: f64, cross_section: f64) -> SurfaceParams {
    SurfaceParams { opacity, cross_section, ..SurfaceParams::default() }
}

#[test]
fn pb13_lines_are_uniform_on_spheres_and_ellipsoids() {
    // Equal heights cut equal areas from a sphere.
    let sampler =
        LineSampler::new(&boxed(&Field::UNIT, 1.1), &LineParams { resolution: 32 }, &params(0.5, 1e-4), None).unwrap();
    let places = positions(&sampler, 0);
    for axis in 0..3 {
        let mut bins = [0u64; 20];
        places.iter().for_each(|p| bins[((p[axis] + 1.0) * 10.0).clamp(0.0, 19.0) as usize] += 1);
        let chi2 = chi2_equal(&bins);
        assert!(chi2 < chi2_limit(19.0), "axis {axis}: χ² {chi2}");
    }
    assert!(places.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
    let report = sampler.report();
    assert!((report.area / (4.0 * PI) - 1.0).abs() < 0.03, "{report:?}");
    // The same lines hold the same roots, however finely they are looked at.
    assert!(report.roots > 1000 && report.fine_roots.abs_diff(report.roots) * 500 < report.roots, "{report:?}");
    // A prolate ellipsoid: area below height z by its closed form.
    let field = Field::Ellipsoid { axes: DVec3::new(1.0, 1.0, 3.0) };
    let surface = ImplicitSurface {
        bounds: DAabb::new(DVec3::new(-1.1, -1.1, -3.1), DVec3::new(1.1, 1.1, 3.1)),
        ..boxed(&field, 1.0)
    };
    let sampler = LineSampler::new(&surface, &LineParams { resolution: 48 }, &params(0.5, 1e-4), None).unwrap();
    let below = |z: f64| {
        // ∫ √(1 + (e·z)²…): with k² = 8/81, area element ∝ √(1 − k²z²).
        let k = (8.0f64 / 81.0).sqrt();
        let x = (k * z).clamp(-1.0, 1.0);
        0.5 * (x * (1.0 - x * x).sqrt() + x.asin())
    };
    let low = below(-3.0);
    let high = below(3.0);
    let mut bins = [0u64; 20];
    let places = positions(&sampler, 1);
    places.iter().for_each(|p| bins[((below(p.z) - low) / (high - low) * 20.0).clamp(0.0, 19.0) as usize] += 1);
    let chi2 = chi2_equal(&bins);
    assert!(chi2 < chi2_limit(19.0), "χ² {chi2} of {}", places.len());
}

#[test]
fn pb13_lines_are_uniform_on_tori_and_across_edges() {
    // The area of a torus below angle φ around its tube: φ + r/R·sin φ.
    let field = Field::Torus { large: 0.7, small: 0.3 };
    let sampler =
        LineSampler::new(&boxed(&field, 1.1), &LineParams { resolution: 32 }, &params(0.5, 4e-5), None).unwrap();
    let places = positions(&sampler, 0);
    let mut tube = [0u64; 40];
    let mut ring = [0u64; 40];
    for p in &places {
        let phi = p.z.atan2(p.x.hypot(p.y) - 0.7);
        let share = 0.5 + (phi + 3.0 / 7.0 * phi.sin()) / (2.0 * PI);
        tube[((share * 40.0) as usize).min(39)] += 1;
        ring[(((p.y.atan2(p.x) / (2.0 * PI) + 0.5) * 40.0) as usize).min(39)] += 1;
    }
    for (name, bins) in [("tube", tube), ("ring", ring)] {
        let chi2 = chi2_equal(&bins);
        assert!(chi2 < chi2_limit(39.0), "{name}: χ² {chi2}");
    }
    let expected = 4.0 * PI * PI * 0.7 * 0.3 * 2f64.ln() / 4e-5;
    assert!((places.len() as f64 - expected).abs() < 4.5 * expected.sqrt(), "{} for {expected}", places.len());
    let report = sampler.report();
    assert_eq!((report.graphs, report.missed()), (report.leaves, 0.0), "{report:?}");
    // The six faces of a cube, in rings of equal area around their middles: edges are where graphs end.
    let sampler =
        LineSampler::new(&boxed(&Field::Cube, 0.8), &LineParams { resolution: 20 }, &params(0.5, 4e-5), None).unwrap();
    let places = positions(&sampler, 0);
    let mut bins = [0u64; 60];
    for p in &places {
        let axis = (0..3).max_by(|a, b| p[*a].abs().total_cmp(&p[*b].abs())).unwrap();
        let across = (0..3).filter(|a| *a != axis).map(|a| p[a].abs()).fold(0.0, f64::max);
        let ring = ((across * across * 40.0) as usize).min(9);
        bins[(2 * axis + usize::from(p[axis] > 0.0)) * 10 + ring] += 1;
    }
    let chi2 = chi2_equal(&bins);
    // Up to three crossings of a line near an edge come together.
    assert!(chi2 < 1.1 * chi2_limit(59.0), "χ² {chi2}: {bins:?}");
    let expected = 6.0 * 2f64.ln() / 4e-5;
    assert!((places.len() as f64 - expected).abs() < 4.5 * expected.sqrt(), "{} for {expected}", places.len());
}

#[test]
fn planes_on_round_coordinates_are_counted_once() {
    for distance in [0.0, 0.25, 0.5, -0.75] {
        let field = Field::Plane { normal: DVec3::Z, distance };
        for resolution in [1, 8, 32] {
            let sampler =
                LineSampler::new(&boxed(&field, 1.0), &LineParams { resolution }, &params(0.5, 4e-5), None).unwrap();
            let found = positions(&sampler, 0).len() as f64;
            let expected = 4.0 * 2f64.ln() / 4e-5;
            assert!(
                (found - expected).abs() < 4.5 * expected.sqrt(),
                "{distance} {resolution}: {found} for {expected}"
            );
        }
    }
}

#[test]
fn pb05_opacity_of_a_sphere_grows_to_its_silhouette() {
    let camera = front(64);
    let s = pixel_area(&camera, DVec3::Z);
    let field = Field::Sphere { middle: DVec3::ZERO, radius: 0.8, scale: 1.0 };
    let sampler = LineSampler::new(&boxed(&field, 1.0), &LineParams { resolution: 24 }, &params(0.2, s), None).unwrap();
    let ensemble = render(&camera, &[&sampler], 600);
    // Hits of a pixel are those of its mean of 2/cos θ, by Poisson: ∫dy/√(1 − x² − y²) = asin(y/√(1 − x²)), which holds at the silhouette
    // too, where 1/cos θ has no bound.
    let alpha = |x: u32, y: u32| {
        let n = 512;
        let edge = |v: u32| (f64::from(v) / 32.0 - 1.0) / 0.8;
        let along = |k: u32| {
            let x = edge(x) + (f64::from(k) + 0.5) / f64::from(n) * (edge(1) - edge(0));
            let half = (1.0 - x * x).max(0.0).sqrt();
            let part = |y: f64| if half > 0.0 { (y / half).clamp(-1.0, 1.0).asin() } else { 0.0 };
            part(edge(y + 1)) - part(edge(y))
        };
        let mean = (0..n).map(along).sum::<f64>() / f64::from(n) / (edge(1) - edge(0));
        Some(1.0 - 0.8f64.powf(2.0 * mean))
    };
    let found = bias(&ensemble, &alpha);
    assert!(found.none(), "{found:?}");
    let brightest = (0..64).map(|x| alpha(x, 32).unwrap()).fold(0.0, f64::max);
    assert!(brightest > 2.0 * alpha(32, 32).unwrap(), "{brightest}");
}

#[test]
fn pb11_the_scale_of_the_field_changes_no_bit() {
    let at = |scale: f64| {
        let field = Field::Sphere { middle: DVec3::new(0.1, 0.2, -0.1), radius: 0.7, scale };
        positions(
            &LineSampler::new(&boxed(&field, 1.0), &LineParams { resolution: 16 }, &params(0.5, 1e-3), None).unwrap(),
            3,
        )
    };
    let one = at(1.0);
    assert!(one.len() > 1000);
    for power in [60, -60, 200, -200] {
        assert_eq!(at(2f64.powi(power)), one, "2^{power}");
    }
}

#[test]
fn pb09_double_roots_are_found_where_lines_touch_them() {
    let sampler =
        LineSampler::new(&boxed(&Field::Double, 1.1), &LineParams { resolution: 24 }, &params(0.5, 1e-4), None)
            .unwrap();
    let places = positions(&sampler, 0);
    assert!(places.iter().all(|p| (p.length() - 1.0).abs() < 1e-4), "all on the sphere");
    let expected = 4.0 * PI * 0.5f64.ln().abs() / 1e-4;
    assert!((places.len() as f64 - expected).abs() < 6.0 * expected.sqrt(), "{} for {expected}", places.len());
    let report = sampler.report();
    // The survey's roots are few.
    let spread = 4.0 / (report.roots as f64).sqrt();
    assert!((report.area / (4.0 * PI) - 1.0).abs() < spread, "{report:?}");
}

#[test]
fn pb10_the_apex_of_a_cone_is_no_trouble() {
    let sampler =
        LineSampler::new(&boxed(&Field::Cone, 1.0), &LineParams { resolution: 20 }, &params(0.5, 1e-3), None).unwrap();
    let places = positions(&sampler, 0);
    assert!(places.iter().all(|p| p.is_finite() && p.abs().max_element() <= 1.0));
    // Two cones of height 1 and slope 1: 2·π·√2 within the box, as its corners are out of their reach.
    let report = sampler.report();
    assert!((report.area / (2.0 * PI * 2f64.sqrt()) - 1.0).abs() < 0.04, "{report:?}");
    // What lines could not settle about the apex is told, and is little.
    assert!(report.broken == 0 && report.missed() < 1e-3, "{report:?}");
}

#[test]
fn pb12_components_get_particles_by_their_areas() {
    let field = Field::Two { radius: [0.3, 0.6], apart: 0.7 };
    let surface = ImplicitSurface { bounds: DAabb::new(DVec3::splat(-1.4), DVec3::splat(1.4)), ..boxed(&field, 1.0) };
    let sampler = LineSampler::new(&surface, &LineParams { resolution: 32 }, &params(0.5, 1e-4), None).unwrap();
    let places = positions(&sampler, 0);
    let left = places.iter().filter(|p| p.x < -0.2).count() as f64;
    let expected = places.len() as f64 * 0.2;
    assert!((left - expected).abs() < 4.5 * (expected * 2.0).sqrt(), "{left} for {expected}");
    // Two sheets far nearer to each other than a cell.
    let field = Field::Sheets { gap: 5e-4 };
    let sampler =
        LineSampler::new(&boxed(&field, 1.0), &LineParams { resolution: 20 }, &params(0.5, 1e-3), None).unwrap();
    assert!((sampler.report().area / 8.0 - 1.0).abs() < 0.05, "{:?}", sampler.report());
    assert!(sampler.report().missed() < 0.01, "{:?}", sampler.report());
}

#[test]
fn pb14_sets_are_independent() {
    let sampler =
        LineSampler::new(&boxed(&Field::UNIT, 1.1), &LineParams { resolution: 16 }, &params(0.5, 2e-3), None).unwrap();
    // Counts of a cap in 600 sets: variance of a binomial, no correlation at any lag.
    const SETS: u64 = 600;
    let counts: Vec<f64> =
        (0..SETS).map(|set| positions(&sampler, set).iter().filter(|p| p.z > 0.9).count() as f64).collect();
    let mean = counts.iter().sum::<f64>() / SETS as f64;
    let variance = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / SETS as f64;
    assert!((variance / mean - 1.0).abs() < 4.0 * (2.0 / SETS as f64).sqrt(), "variance {variance} of mean {mean}");
    for lag in 1..=5 {
        let sum: f64 = counts.windows(lag + 1).map(|w| (w[0] - mean) * (w[lag] - mean)).sum();
        let r = sum / (variance * SETS as f64);
        assert!(r.abs() < 3.0 / (SETS as f64).sqrt(), "lag {lag}: {r}");
    }
}

#[test]
fn open_surfaces_and_densities_take_their_share() {
    let upper = |p: DVec3| p.z > 0.0;
    let surface = ImplicitSurface { inside: Some(&upper), ..boxed(&Field::UNIT, 1.1) };
    let sampler = LineSampler::new(&surface, &LineParams { resolution: 24 }, &params(0.5, 1e-4), None).unwrap();
    let places = positions(&sampler, 0);
    assert!(places.iter().all(|p| p.z > 0.0));
    let expected = 2.0 * PI * 0.5f64.ln().abs() / 1e-4;
    // Two crossings on a line widen the spread a little.
    assert!((places.len() as f64 - expected).abs() < 6.0 * expected.sqrt(), "{} for {expected}", places.len());
    // Density x, 0 for x < 0: the mean over the sphere is 1/4.
    let density = Density { field: &Field::Ramp, max: 1.0 };
    let sampler =
        LineSampler::new(&boxed(&Field::UNIT, 1.1), &LineParams { resolution: 24 }, &params(0.5, 1e-4), Some(density))
            .unwrap();
    let places = positions(&sampler, 0);
    let expected = 4.0 * PI * 0.25 * 0.5f64.ln().abs() / 1e-4;
    assert!((places.len() as f64 - expected).abs() < 6.0 * expected.sqrt(), "{} for {expected}", places.len());
    let mean = places.iter().map(|p| p.x).sum::<f64>() / places.len() as f64;
    assert!((mean - 2.0 / 3.0).abs() < 0.01, "∫x²/∫x = 2/3, found {mean}");
}

#[test]
fn what_cannot_be_sampled_says_why() {
    let no = |field: &Field| {
        LineSampler::new(&boxed(field, 1.1), &LineParams { resolution: 16 }, &params(0.5, 1e-3), None).err().unwrap()
    };
    assert!(matches!(no(&Field::Nothing), Error::Empty { .. }));
    assert!(matches!(no(&Field::Broken), Error::Field { .. }));
    let flat =
        ImplicitSurface { bounds: DAabb::new(DVec3::splat(-1.1), DVec3::splat(-1.1)), ..boxed(&Field::UNIT, 1.1) };
    assert!(matches!(
        LineSampler::new(&flat, &LineParams { resolution: 16 }, &params(0.5, 1e-3), None),
        Err(Error::Parameter { .. })
    ));
    assert!(matches!(
        LineSampler::new(&boxed(&Field::UNIT, 1.1), &LineParams { resolution: 16 }, &params(0.5, 1e-30), None),
        Err(Error::Limit(_))
    ));
    // Without a bound everything is searched, and the report says so.
    let sampler =
        LineSampler::new(&boxed(&Field::Unbounded, 1.1), &LineParams { resolution: 16 }, &params(0.5, 1e-3), None)
            .unwrap();
    let report = sampler.report();
    assert_eq!(report.cells.unbounded, report.cells.active);
    assert!(report.missed() < 0.01, "{report:?}");
    assert!((report.area / (4.0 * PI) - 1.0).abs() < 0.05, "{report:?}");
    assert!(sampler.expected_particles() > 1000.0);
}

/// The plane z = 0.8 with a needle down to z = −1, thinner than a cube is looked at.
struct Needle;

impl Needle {
    fn hill(p: DVec3) -> f64 {
        let [x, y] = [p.x - 0.019, p.y - 0.0093];
        1.8 * (-30000.0 * (x * x + y * y)).exp()
    }
}

impl ScalarField for Needle {
    fn value(&self, p: DVec3) -> f64 {
        p.z - 0.8 + Self::hill(p)
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        DVec3::new((p.x - 0.019) * -60000.0 * Self::hill(p), (p.y - 0.0093) * -60000.0 * Self::hill(p), 1.0)
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let d = DVec3::new(p.x - 0.019, p.y - 0.0093, 0.0);
        let hill = Self::hill(p);
        let second = |a: f64, b: f64, same: f64| (60000.0 * 60000.0 * a * b - 60000.0 * same) * hill;
        let cross = second(d.x, d.y, 0.0);
        DMat3::from_cols(
            DVec3::new(second(d.x, d.x, 1.0), cross, 0.0),
            DVec3::new(cross, second(d.y, d.y, 1.0), 0.0),
            DVec3::ZERO,
        )
    }

    fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
        None
    }
}

#[test]
fn pieces_in_cubes_that_were_taken_for_empty_are_reported() {
    let needle = ImplicitSurface { field: &Needle, ..boxed(&Field::UNIT, 1.0) };
    let sampler = LineSampler::new(&needle, &LineParams { resolution: 8 }, &params(0.5, 1e-3), None).unwrap();
    let report = sampler.report();
    // Where the needle has the radius r = √(ln(1.8/(0.8 − z))/3000); its lateral area is near 0.13.
    assert!(report.missed() > 0.003 && (0.01..0.1).contains(&report.stray_area), "{report:?}");
}
