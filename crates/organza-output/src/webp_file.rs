//! The displayed picture as a WebP file without losses: the bytes of a PNG file of 8 bits a channel, in less room.

use super::{Metadata, Params, WriteReport, check_sides, png_file};
use crate::Error;
use image::ExtendedColorType;
use image::codecs::webp::WebPEncoder;
use splat_core::Layers;

/// The largest side that the format has, pixels.
const MOST_PIXELS: u32 = 16384;

/// The bytes of the WebP file.
pub(super) fn encode(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
    report: &mut WriteReport,
) -> Result<Vec<u8>, Error> {
    let [width, height] = layers.size;
    check_sides("WebP", layers.size, MOST_PIXELS)?;
    let pixels = png_file::bytes(layers, metadata, params, report)?;
    let color = if params.transparent { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
    let mut bytes = Vec::new();
    let encoded = WebPEncoder::new_lossless(&mut bytes).encode(&pixels, width, height, color);
    encoded.map_err(|e| Error::Internal(format!("WebP encoder: {e}")))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::LayerData;

    /// A picture whose right half is translucent, before a background of 0.25.
    fn layers() -> Layers {
        let size = [64, 48];
        let pixel = |k: u32| [(k % 64) as f32 / 64.0, (k / 64) as f32 / 48.0, 0.25];
        let mut layers = Layers { size, ..Layers::default() };
        layers.insert("beauty", LayerData::Rgb((0..64 * 48).map(pixel).collect()));
        layers.insert("background", LayerData::Rgb(vec![[0.0; 3]; 64 * 48]));
        layers.insert("alpha", LayerData::Scalar((0..64 * 48).map(|k| if k % 64 < 32 { 1.0 } else { 0.5 }).collect()));
        layers
    }

    #[test]
    fn the_file_has_the_bytes_of_the_displayed_picture() {
        for transparent in [false, true] {
            let params = Params { transparent, ..Params::default() };
            let mut report = WriteReport::default();
            let file = encode(&layers(), &Metadata::default(), &params, &mut report).unwrap();
            let read = image::load_from_memory_with_format(&file, image::ImageFormat::WebP).unwrap();
            let exact = png_file::bytes(&layers(), &Metadata::default(), &params, &mut report).unwrap();
            assert_eq!(read.color().has_alpha(), transparent);
            assert_eq!(read.as_bytes(), exact);
        }
    }
}
