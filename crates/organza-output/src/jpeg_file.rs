//! The displayed picture as a JPEG, for pages and letters: smaller than a PNG, and not exact.

use super::{Metadata, Params, WriteReport, check_sides, png_file};
use crate::Error;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use splat_core::Layers;

/// Quality, 1 to 100: of a smooth picture no byte is off by more than a few.
const QUALITY: u8 = 95;
/// The largest side that the format has, pixels.
const MOST_PIXELS: u32 = 65535;

/// The bytes of the JPEG file.
pub(super) fn encode(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
    report: &mut WriteReport,
) -> Result<Vec<u8>, Error> {
    let [width, height] = layers.size;
    if params.transparent {
        let hint = "write a PNG or EXR file, or leave --transparent out";
        return Err(Error::Usage { message: "a JPEG file has no opacity".into(), hint: hint.into() });
    }
    check_sides("JPEG", layers.size, MOST_PIXELS)?;
    let pixels = png_file::bytes(layers, metadata, params, report)?;
    let mut bytes = Vec::new();
    let encoded =
        JpegEncoder::new_with_quality(&mut bytes, QUALITY).encode(&pixels, width, height, ExtendedColorType::Rgb8);
    encoded.map_err(|e| Error::Internal(format!("JPEG encoder: {e}")))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::LayerData;

    /// A smooth picture.
    fn layers() -> Layers {
        let size = [64, 48];
        let pixel = |k: u32| [(k % 64) as f32 / 64.0, (k / 64) as f32 / 48.0, 0.25];
        let mut layers = Layers { size, ..Layers::default() };
        layers.insert("beauty", LayerData::Rgb((0..64 * 48).map(pixel).collect()));
        layers
    }

    #[test]
    fn a_smooth_picture_is_off_by_a_few_bytes_at_most() {
        let metadata = Metadata::default();
        let params = Params::default();
        let mut report = WriteReport::default();
        let file = encode(&layers(), &metadata, &params, &mut report).unwrap();
        let read = image::load_from_memory_with_format(&file, image::ImageFormat::Jpeg).unwrap().to_rgb8();
        assert_eq!(read.dimensions(), (64, 48));
        let exact = png_file::bytes(&layers(), &metadata, &params, &mut report).unwrap();
        let off = read.as_raw().iter().zip(&exact).map(|(found, expected)| found.abs_diff(*expected));
        assert!(off.clone().max() <= Some(12), "{:?}", off.max());
    }

    #[test]
    fn opacity_is_refused() {
        let params = Params { transparent: true, ..Params::default() };
        let error = encode(&layers(), &Metadata::default(), &params, &mut WriteReport::default()).unwrap_err();
        assert!(error.to_string().contains("no opacity"), "{error}");
    }
}
