//! The sRGB curve (IEC 61966-2-1) between numbers as displays take them and light. Beyond \[0, 1\] it goes on as it is.

/// Light of a displayed number.
pub fn decoded(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
}

/// Linear value of an sRGB component, in \[0, 1\] or beyond.
pub fn linear_from_srgb(c: f64) -> f32 {
    decoded(c) as f32
}

/// Linear value of a colour that is written as 0xRRGGBB in sRGB.
pub fn linear_from_hex(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| linear_from_srgb(f64::from(rgb >> shift & 0xff) / 255.0))
}

/// The number that is displayed for light.
pub fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_the_other_backwards() {
        for i in 0..=300 {
            let c = f64::from(i) / 200.0;
            assert!((encoded(decoded(c)) - c).abs() < 1e-6, "{c}");
        }
    }
}
