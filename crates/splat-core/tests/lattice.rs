//! How evenly footprints on a lattice sum up.

use splat_core::{Footprint, FootprintStack};

/// Most that the sum over a square lattice of distance 1 is off 1, by a profile of s = (r/R)² whose integral is `norm` over R².
fn ripple(radius: f64, norm: f64, profile: &dyn Fn(f64) -> f64) -> f64 {
    let sum = |u: f64, v: f64| {
        let places = (-4..=4).flat_map(|i| (-4..=4).map(move |j| (f64::from(i) - u, f64::from(j) - v)));
        places.map(|(x, y)| profile((x * x + y * y) / (radius * radius))).sum::<f64>() * norm / (radius * radius)
    };
    let phases = (0..16).flat_map(|i| (0..16).map(move |j| (f64::from(i) / 16.0, f64::from(j) / 16.0)));
    phases.map(|(u, v)| (sum(u, v) - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn ia2_a_lattice_is_fifty_times_as_even_as_by_a_gaussian_that_is_cut_off() {
    let f = Footprint::default();
    let radius = f64::from(f.radius_for_spacing(1.0));
    let ours = ripple(radius, f.norm(), &|s| f.profile(s));
    // The same radius, deviation and integral, without the polynomial that brings it to 0 at the rim.
    let half = 0.5 * f64::from(f.cutoff).powi(2);
    let plain = |s: f64| if s < 1.0 { (-half * s).exp() } else { 0.0 };
    let norm = half / (std::f64::consts::PI * (1.0 - (-half).exp()));
    let cut = ripple(radius, norm, &plain);
    println!("{ours:.2e}, cut off {cut:.2e}");
    assert!(ours < 1.5e-4 && cut > 7e-3 && cut > 50.0 * ours, "{ours:e} {cut:e}");
    assert_eq!(FootprintStack::default().layers()[0], f);
}
