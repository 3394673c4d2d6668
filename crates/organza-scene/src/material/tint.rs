//! A surface of which each crossing lets a stated share of the light pass, channel by channel.

/// Colour, opacity and extinction of a surface that tints light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tint {
    pub(crate) color: [f64; 3],
    pub(crate) opacity: f64,
    pub(crate) extinction_rgb: [f64; 3],
}

impl Tint {
    /// Least share of light that a tint lets pass: of less, a surface is opaque.
    pub(crate) const LEAST: f64 = 1e-3;

    /// The surface of which each crossing lets these shares of light pass, or one of their ratio whose most opaque channel has this opacity.
    pub(crate) fn new(shares: [f64; 3], opacity: Option<f64>) -> Self {
        let depths = shares.map(|share| -libm::log(share));
        let deepest = depths.into_iter().fold(0.0, f64::max);
        let extinction_rgb = depths.map(|depth| if deepest > 0.0 { depth / deepest } else { 1.0 });
        let opacity = opacity.unwrap_or(1.0 - libm::exp(-deepest));
        let taken = extinction_rgb.map(|ratio| 1.0 - libm::pow(1.0 - opacity, ratio));
        // Radiance is colour times opacity: scattered light has the tint where the colour is the tint over the opacity, as bright as the channel
        // that takes least of the light allows.
        let weakest = [0, 1, 2].map(|c| taken[c] / shares[c]).into_iter().fold(f64::INFINITY, f64::min);
        let color = [0, 1, 2].map(|c| if taken[c] > 0.0 { (weakest * shares[c] / taken[c]).min(1.0) } else { 1.0 });
        Self { color, opacity, extinction_rgb }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_channel_lets_its_share_pass_and_scatters_light_of_the_tint() {
        let shares = [0.9, 0.2, 0.1];
        let tint = Tint::new(shares, None);
        let passes = tint.extinction_rgb.map(|ratio| (1.0 - tint.opacity).powf(ratio));
        for c in 0..3 {
            assert!((passes[c] - shares[c]).abs() < 1e-12, "{passes:?}");
            let radiance = [c, 0].map(|c| tint.color[c] * (1.0 - passes[c]));
            assert!((radiance[0] / radiance[1] - shares[c] / shares[0]).abs() < 1e-12);
            assert!((0.0..=1.0).contains(&tint.color[c]));
        }
        // The strength alone is another one.
        let stronger = Tint::new(shares, Some(0.99));
        assert_eq!((stronger.extinction_rgb, stronger.opacity), (tint.extinction_rgb, 0.99));
        // A surface that tints nothing is not seen.
        assert_eq!(Tint::new([1.0; 3], None), Tint { color: [1.0; 3], opacity: 0.0, extinction_rgb: [1.0; 3] });
        // One channel that passes whole leaves nothing of its colour to scatter.
        assert_eq!(Tint::new([1.0, 0.5, 0.5], None).color[1], 0.0);
    }
}
