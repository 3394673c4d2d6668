//! Shares of the Henyey-Greenstein phase function: what goes on with the light.

use crate::half_vector::params::Scattering;
use libm::{acos, sqrt};

/// Asymmetry below which the phase function is taken as linear, (1 + 3gμ)/4π: the closed forms divide by g.
const ROUND: f64 = 1e-2;

/// Share of scattered light within the cone about its way in which u = 1 + g² − 2gμ is at most `rim`², and the integral of its
/// cosine: those of (1 − g²)/2·u^(−3/2) over μ are powers of u.
fn within(g: f64, rim: f64) -> [f64; 2] {
    let near = 1.0 - g;
    let share = (1.0 - g * g) / (2.0 * g) * (1.0 / near - 1.0 / rim);
    let cosine = (1.0 - g * g) / (4.0 * g * g) * ((1.0 + g * g) * (1.0 / near - 1.0 / rim) - (rim - near));
    [share, cosine]
}

/// The same of all that goes into the half-space ahead.
fn ahead(g: f64) -> [f64; 2] {
    if g.abs() < ROUND { [0.5 + 0.75 * g, 0.25 + 0.5 * g] } else { within(g, sqrt(1.0 + g * g)) }
}

/// Share of scattered light that stays with the light that goes ahead, in \[0, 1\].
///
/// Forward alone, that is all that goes into the half-space ahead. With back scattering it is the peak g² that the
/// delta-Eddington approximation leaves in the beam (J. Joseph, W. Wiscombe, J. Weinman 1976), so that what remains is broad
/// enough for two streams; a phase function that looks back has none.
pub(crate) fn share_ahead(scattering: Scattering, asymmetry: f32) -> f64 {
    let g = f64::from(asymmetry);
    match scattering {
        Scattering::None => 0.0,
        Scattering::Forward => ahead(g)[0],
        Scattering::ForwardAndBack => g.max(0.0) * g.max(0.0),
    }
}

/// Half angle of the cone that light ahead spreads into, radians: that of the mean cosine of the share of it that stays ahead.
pub(crate) fn cone_of(scattering: Scattering, asymmetry: f64) -> f64 {
    let [share, cosine] = match scattering {
        Scattering::ForwardAndBack if asymmetry < ROUND => return 0.0,
        Scattering::ForwardAndBack => {
            let g = asymmetry;
            within(g, 1.0 / (1.0 / (1.0 - g) - 2.0 * g * g * g / (1.0 - g * g)))
        }
        _ => ahead(asymmetry),
    };
    acos((cosine / share).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_ahead_are_integrals_of_the_phase_function() {
        for g in [-0.9, -0.5, -0.011, -0.005, 0.0, 0.005, 0.011, 0.3, 0.85, 0.99] {
            let n = 2_000_000;
            let mut sums = [0.0; 2];
            for i in 0..n {
                let mu = (f64::from(i) + 0.5) / f64::from(n);
                let u = 1.0 + g * g - 2.0 * g * mu;
                let p = 0.5 * (1.0 - g * g) / (u * sqrt(u)) / f64::from(n);
                sums = [sums[0] + p, sums[1] + p * mu];
            }
            let found = ahead(g);
            let off = (found[0] - sums[0]).abs().max((found[1] - sums[1]).abs());
            assert!(off < 2e-4, "g {g}: {found:?}, not {sums:?}");
        }
        let forward = |g: f64| cone_of(Scattering::Forward, g).to_degrees();
        assert!((forward(0.0) - 60.0).abs() < 1e-9 && forward(0.9999) < 2.0);
        let both = |g: f64| cone_of(Scattering::ForwardAndBack, g).to_degrees();
        for g in [0.02, 0.5, 0.85, 0.99] {
            let [share, _] = within(g, 1.0 / (1.0 / (1.0 - g) - 2.0 * g * g * g / (1.0 - g * g)));
            assert!((share - share_ahead(Scattering::ForwardAndBack, g as f32)).abs() < 1e-6, "g {g}: {share}");
            assert!(both(g) > 0.0 && both(g) < forward(g), "g {g}: {} and {}", both(g), forward(g));
        }
        assert_eq!((both(0.0), both(-0.5)), (0.0, 0.0));
    }
}
