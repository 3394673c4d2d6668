//! Colour of FLIP: opponent space YCxCz, CIELAB with the Hunt effect, and the HyAB distance.

use glam::{DMat3, DVec3};

/// Linear Rec.709 → CIE XYZ, D65, as the paper's implementation rounds it.
const XYZ_FROM_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(10_135_552.0 / 24_577_794.0, 2_613_072.0 / 12_288_897.0, 1_425_312.0 / 73_733_382.0),
    DVec3::new(8_788_810.0 / 24_577_794.0, 8_788_810.0 / 12_288_897.0, 8_788_810.0 / 73_733_382.0),
    DVec3::new(4_435_075.0 / 24_577_794.0, 887_015.0 / 12_288_897.0, 70_074_185.0 / 73_733_382.0),
);

/// Conversions between the spaces that FLIP passes through.
pub(super) struct Colors {
    white: DVec3,
    rgb_from_xyz: DMat3,
}

impl Colors {
    pub(super) fn new() -> Self {
        Self { white: XYZ_FROM_RGB * DVec3::ONE, rgb_from_xyz: XYZ_FROM_RGB.inverse() }
    }

    /// sRGB-encoded → YCxCz, a linear form of CIELAB.
    pub(super) fn opponent(&self, encoded: [f64; 3]) -> [f64; 3] {
        let xyz = XYZ_FROM_RGB * DVec3::from(encoded.map(decode)) / self.white;
        [116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z)]
    }

    /// YCxCz → CIELAB with a and b scaled by L/100 (Hunt), colours outside the gamut clamped.
    pub(super) fn hunt_lab(&self, opponent: [f64; 3]) -> [f64; 3] {
        let y = (opponent[0] + 16.0) / 116.0;
        let xyz = DVec3::new(y + opponent[1] / 500.0, y, y - opponent[2] / 200.0) * self.white;
        self.lab_of_linear((self.rgb_from_xyz * xyz).clamp(DVec3::ZERO, DVec3::ONE))
    }

    /// The largest distance there is: green to blue, to the power `exponent`.
    pub(super) fn largest_distance(&self, exponent: f64) -> f64 {
        hyab(self.lab_of_linear(DVec3::Y), self.lab_of_linear(DVec3::Z)).powf(exponent)
    }

    fn lab_of_linear(&self, rgb: DVec3) -> [f64; 3] {
        let f = (XYZ_FROM_RGB * rgb / self.white).to_array().map(lab_curve);
        let lightness = 116.0 * f[1] - 16.0;
        let hunt = 0.01 * lightness;
        [lightness, hunt * 500.0 * (f[0] - f[1]), hunt * 200.0 * (f[1] - f[2])]
    }
}

/// |ΔL| + √(Δa² + Δb²).
pub(super) fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

fn decode(x: f64) -> f64 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

fn lab_curve(t: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_are_a_hundred_apart_and_grey_has_no_colour() {
        let colors = Colors::new();
        let [white, grey, black] = [1.0, 0.5, 0.0].map(|v| colors.hunt_lab(colors.opponent([v; 3])));
        assert!((hyab(white, black) - 100.0).abs() < 1e-9);
        assert!(grey[1].abs() < 1e-9 && grey[2].abs() < 1e-9);
    }

    #[test]
    fn opponent_space_is_inverted() {
        let colors = Colors::new();
        // CIELAB of sRGB red: 53.24, 80.09, 67.20 (D65).
        let red = colors.hunt_lab(colors.opponent([1.0, 0.0, 0.0]));
        for (found, expected) in red.into_iter().zip([53.24, 0.5324 * 80.09, 0.5324 * 67.20]) {
            assert!((found - expected).abs() < 0.02, "{red:?}");
        }
    }
}
