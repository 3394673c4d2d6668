//! Brownian motion on a surface through scattered points, with the step of Tanaka 2012, section 5.

use convert::points_to_field;
use field::MpuParams;
use pbsr::{BrownianParams, BrownianSampler, ImplicitSurface, Particles, Sampler, SurfaceParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{RawPoints, ScalarField};
use std::f64::consts::PI;

/// Points on the unit sphere, each beside its neighbours on a spiral, with their normals.
fn sphere(n: u32) -> RawPoints {
    let golden = PI * (3.0 - 5f64.sqrt());
    let at = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        (DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z).as_vec3()
    };
    let position: Vec<Vec3> = (0..n).map(at).collect();
    RawPoints { normal: position.clone(), position, ..RawPoints::default() }
}

#[test]
fn the_papers_step_walks_evenly_on_a_partition_of_unity() {
    let (field, _) = points_to_field(&sphere(3000), &MpuParams::default(), None).unwrap();
    let bounds = field.bounds();
    // Δt = 10⁻⁵ in units of the diagonal: √(2Δt) = 0.0045 of it.
    let step = 2e-5f64.sqrt() * bounds.diagonal();
    let surface = ImplicitSurface { field: &field, level: 0.0, bounds, inside: None };
    let width = bounds.size().max_element();
    let walk = BrownianParams { step, pilot_particles: 4096, ..BrownianParams::for_width(width) };
    let params = SurfaceParams { cross_section: 1e-3, ..SurfaceParams::default() };
    let sampler = BrownianSampler::new(&surface, &walk, &params).unwrap();
    let report = sampler.report();
    assert!((report.area / (4.0 * PI) - 1.0).abs() < 4.0 * report.area_error && report.area_error < 0.05, "{report:?}");
    assert!(report.refused < 0.01, "{report:?}");
    let mut scratch = Particles::default();
    let mut bins = [[0u32; 20]; 3];
    for chunk in 0..sampler.chunks() {
        for p in &sampler.chunk(0, chunk, &mut scratch).position {
            let p = sampler.origin() + p.as_dvec3();
            let off = field.value(p).abs() / field.gradient(p).length();
            assert!(off < 1e-6 * width && (p.length() - 1.0).abs() < 1e-3 * bounds.diagonal(), "{p}: {off:e}");
            // Equal heights cut equal areas from a sphere, along any axis.
            (0..3).for_each(|a| bins[a][((0.5 + 0.5 * p[a]) * 20.0).clamp(0.0, 19.0) as usize] += 1);
        }
    }
    for bins in bins {
        let expected = f64::from(bins.iter().sum::<u32>()) / 20.0;
        let chi2: f64 = bins.iter().map(|n| (f64::from(*n) - expected).powi(2) / expected).sum();
        // χ²(19), 99.9 %.
        assert!(expected > 200.0 && chi2 < 43.8, "{chi2} of {expected} a bin");
    }
}
