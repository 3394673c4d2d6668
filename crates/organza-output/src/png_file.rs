//! The displayed picture as an 8-bit PNG: exposure, clamp, sRGB.

use super::{Metadata, WriteReport};
use crate::Error;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use splat_core::Layers;

/// The bytes of the PNG file.
pub(super) fn encode(layers: &Layers, metadata: &Metadata, report: &mut WriteReport) -> Result<Vec<u8>, Error> {
    let beauty = layers.rgb("beauty").ok_or_else(|| Error::Internal("a render has no beauty layer".into()))?;
    let gain = libm::exp2(metadata.exposure) as f32;
    let mut pixels = Vec::with_capacity(beauty.len() * 3);
    for channel in beauty.iter().flatten() {
        report.not_a_number += u64::from(channel.is_nan());
        pixels.push(displayed(channel * gain));
    }
    let mut bytes = Vec::new();
    let [width, height] = layers.size;
    PngEncoder::new(&mut bytes)
        .write_image(&pixels, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| Error::Internal(format!("PNG encoder: {e}")))?;
    Ok(bytes)
}

/// Linear radiance → sRGB (IEC 61966-2-1) in 8 bits; NaN gives 0.
pub fn displayed(linear: f32) -> u8 {
    // Before the curve: its power is undefined below 0. NaN.max(0) is 0, where NaN.clamp would stay NaN.
    let x = linear.max(0.0).clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::powf(x, 1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::displayed;

    #[test]
    fn ou4_hostile_values_are_displayable() {
        let cases = [(-1e-9, 0), (-1e30, 0), (f32::NAN, 0), (1e30, 255), (f32::INFINITY, 255), (0.0, 0), (1.0, 255)];
        for (linear, expected) in cases {
            assert_eq!(displayed(linear), expected, "{linear}");
        }
        // 18 % grey is 117.6 in sRGB.
        assert_eq!(displayed(0.18), 118);
    }
}
