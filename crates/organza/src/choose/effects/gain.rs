//! From radiance to a change of a displayed pixel.
//!
//! A pixel is a mean of radiances with weights that sum to 1 at most, and a displayed value grows with radiance by the gain g = 12.92·2^E at most: 12.92
//! is the greatest slope of sRGB, E the exposure in stops. A picture that is dark at that exposure is meant for another: g is no less than what makes
//! the brightest light white.
//!
//! Where an effect moves at most the share a of the weights of a pixel, from radiances to others between 0 and L, the pixel changes by a·L at most: what
//! the weights gain in one place they lose in another, so each of the two is a at most.
//!
//! Where a pixel only loses, and at most the share b of what it has, it falls by 1 − s(1 − b) at most, s the encoding of sRGB: x·s'(x) grows up to white,
//! so that white falls most, by 0.44·b for small b. A pixel that loses several shares one after another keeps their product.

use crate::plan::Bound;
use crate::shadows::DISPLAY_SLOPE;
use crate::statistics::{LightStatistics, Statistics};
use splat_core::srgb;

/// Lights that may shine.
pub(super) fn shining(statistics: &Statistics) -> impl Iterator<Item = &LightStatistics> + Clone {
    statistics.lights.iter().filter(|light| !light.is_dark && light.is_on != Some(false))
}

/// How much a displayed value grows with radiance, at most.
pub(super) fn gain(statistics: &Statistics) -> f64 {
    // Of a light whose radiance has no bound, white is not known.
    let radiances = shining(statistics).map(|light| light.radiance).filter(|radiance| radiance.is_finite());
    let brightest = radiances.fold(0.0, f64::max);
    let white = if brightest > 0.0 { brightest.recip() } else { 0.0 };
    DISPLAY_SLOPE * libm::exp2(statistics.exposure).max(white)
}

/// The most that this radiance can add to a displayed pixel.
pub(super) fn displayed(radiance: f64, gain: f64) -> f64 {
    // Nothing is shown of no radiance, however large the gain.
    if radiance == 0.0 { 0.0 } else { (gain * radiance).min(1.0) }
}

/// The most that a displayed pixel falls when its radiance loses this share, 0 to 1.
pub(super) fn darkened(share: f64) -> f64 {
    // Of a small share the difference of two encoded values would keep few digits.
    const SMALL: f64 = 1e-6;
    let slope_at_white = 1.055 / 2.4;
    if share < SMALL { slope_at_white * (1.0 + SMALL) * share } else { 1.0 - srgb::encoded(1.0 - share) }
}

/// The bound of a change of radiance.
pub(super) fn bound(radiance: f64, statistics: &Statistics) -> Bound {
    if radiance.is_finite() { Bound::at_most(displayed(radiance, gain(statistics))) } else { Bound::Unknown }
}

/// A share of a radiance: nothing is left of none, even where the radiance is not known.
pub(super) fn share_of(radiance: f64, share: f64) -> f64 {
    if share == 0.0 { 0.0 } else { radiance * share }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_pixel_falls_by_more_than_white_does() {
        for share in (0..=60).map(|k| libm::exp2(-0.5 * f64::from(k))) {
            for radiance in (-20..=4).map(|stop| libm::exp2(0.5 * f64::from(stop))) {
                let shown = |radiance: f64| srgb::encoded(radiance.min(1.0));
                let fall = shown(radiance) - shown(radiance * (1.0 - share));
                assert!(fall <= darkened(share) + 1e-15, "{share} of {radiance}: {fall} and {}", darkened(share));
            }
        }
        assert_eq!([darkened(0.0), darkened(1.0)], [0.0, 1.0]);
    }

    #[test]
    fn what_falls_grows_with_the_share() {
        let shares: Vec<f64> = (0..400).map(|k| libm::exp2(-0.1 * f64::from(k))).collect();
        assert!(shares.windows(2).all(|pair| darkened(pair[1]) < darkened(pair[0])));
    }
}
