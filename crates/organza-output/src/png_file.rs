//! The displayed picture as a PNG: exposure, clamp, sRGB, in 8 or 16 bits, with its background or without.

use super::{Metadata, Params, WriteReport, legend, texts};
use crate::Error;
use crate::display::{encoded, rounded, stepped};
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError, SrgbRenderingIntent};
use splat_core::Layers;

/// A function from linear radiance to a displayed value, 0 to 1.
type Curve = fn(f32) -> f32;

/// The bytes of the PNG file.
pub(super) fn encode(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
    report: &mut WriteReport,
) -> Result<Vec<u8>, Error> {
    let depth = if params.deep { BitDepth::Sixteen } else { BitDepth::Eight };
    let samples = samples(layers, metadata, params, depth, report)?;
    let color = if params.transparent { ColorType::Rgba } else { ColorType::Rgb };
    let mut bytes = Vec::new();
    written(&mut bytes, layers.size, color, depth, &quantized(&samples, depth), metadata)
        .map_err(|e| Error::Internal(format!("PNG encoder: {e}")))?;
    Ok(bytes)
}

/// The displayed picture, as a PNG file of 8 bits a channel has it: red, green and blue of each pixel, and its opacity where `params` are of a transparent
/// one.
pub(super) fn bytes(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
    report: &mut WriteReport,
) -> Result<Vec<u8>, Error> {
    Ok(quantized(&samples(layers, metadata, params, BitDepth::Eight, report)?, BitDepth::Eight))
}

/// Returns the displayed picture with its legends, values from 0 to 1. With 8 bits the values are whole bytes.
fn samples(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
    depth: BitDepth,
    report: &mut WriteReport,
) -> Result<Vec<f32>, Error> {
    let gain = libm::exp2(metadata.exposure) as f32;
    let curve = if depth == BitDepth::Sixteen { encoded } else { stepped };
    let mut samples = if params.transparent {
        transparent(layers, gain, curve, report)?
    } else {
        opaque(layers, gain, curve, report)?
    };
    let channels = if params.transparent { 4 } else { 3 };
    let mut canvas = legend::Canvas::new(&mut samples, layers.size[0], channels);
    let lacking = legend::draw(&mut canvas, &params.legend, params.legend_place);
    report.without_room += lacking.without_room;
    report.boxes += lacking.boxes;
    Ok(samples)
}

fn written(
    bytes: &mut Vec<u8>,
    size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
    pixels: &[u8],
    metadata: &Metadata,
) -> Result<(), EncodingError> {
    let [width, height] = size;
    let mut encoder = Encoder::new(bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    // `Balanced` takes longer than a coarse picture of a view: 45 to 98 ms at 960x540, where `Fast` takes 3 ms for files 10 to 25 % larger.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    for (name, text) in texts::pairs(metadata) {
        encoder.add_itxt_chunk(name.to_owned(), text)?;
    }
    encoder.write_header()?.write_image_data(pixels)
}

fn layer<'a>(layers: &'a Layers, name: &str) -> Result<&'a [[f32; 3]], Error> {
    layers.rgb(name).ok_or_else(|| Error::Internal(format!("a render has no {name} layer")))
}

/// Displayed colours, 0 to 1.
fn opaque(layers: &Layers, gain: f32, curve: Curve, report: &mut WriteReport) -> Result<Vec<f32>, Error> {
    let beauty = layer(layers, "beauty")?;
    report.not_a_number += beauty.iter().flatten().filter(|v| v.is_nan()).count() as u64;
    Ok(beauty.iter().flatten().map(|v| curve(v * gain)).collect())
}

/// Displayed colours with the opacity of each pixel, not multiplied by it, of what lies before the background.
fn transparent(layers: &Layers, gain: f32, curve: Curve, report: &mut WriteReport) -> Result<Vec<f32>, Error> {
    let beauty = layer(layers, "beauty")?;
    let behind = layer(layers, "background")?;
    let alpha = layers.scalar("alpha").ok_or_else(|| Error::Internal("a render has no alpha layer".into()))?;
    let mut samples = Vec::with_capacity(4 * beauty.len());
    for ((beauty, behind), alpha) in beauty.iter().zip(behind).zip(alpha) {
        report.not_a_number += beauty.iter().filter(|v| v.is_nan()).count() as u64;
        // One step of 8 bits is lost by rounding alone.
        let lost = |c: usize| (beauty[c] - behind[c]) * gain - alpha.max(0.0) > 1.0 / 255.0;
        // Opaque pixels are clamped alike in a picture with a background.
        report.too_bright += u64::from(*alpha < 1.0 - 1.0 / 255.0 && (0..3).any(lost));
        let straight = gain / alpha.max(f32::MIN_POSITIVE);
        let seen = alpha.is_finite() && *alpha > 0.0;
        samples.extend([0, 1, 2].map(|c| if seen { curve((beauty[c] - behind[c]) * straight) } else { 0.0 }));
        samples.push(if seen { alpha.min(1.0) } else { 0.0 });
    }
    Ok(samples)
}

/// Samples from 0 to 1 as a PNG file has them, those of 16 bits with the high byte first.
fn quantized(samples: &[f32], depth: BitDepth) -> Vec<u8> {
    match depth {
        BitDepth::Sixteen => samples.iter().flat_map(|v| ((v * 65535.0 + 0.5) as u16).to_be_bytes()).collect(),
        _ => samples.iter().map(|v| rounded(*v)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::LayerData;

    /// Two pixels before a background of 0.5: one that hides a quarter of it and adds light, one of which nothing is seen.
    fn layers() -> Layers {
        let mut layers = Layers { size: [2, 1], ..Layers::default() };
        layers.insert("beauty", LayerData::Rgb(vec![[0.375 + 0.25 * 0.18, 0.375, 0.375 + 0.25], [0.5; 3]]));
        layers.insert("background", LayerData::Rgb(vec![[0.375; 3], [0.5; 3]]));
        layers.insert("alpha", LayerData::Scalar(vec![0.25, 0.0]));
        layers
    }

    fn read(bytes: &[u8]) -> (png::Info<'static>, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        (reader.info().clone(), pixels)
    }

    fn encode_with(params: &Params) -> (png::Info<'static>, Vec<u8>) {
        let metadata = Metadata { technique: "points".into(), scene: "π = \"3\"\n".repeat(99), ..Metadata::default() };
        read(&encode(&layers(), &metadata, params, &mut WriteReport::default()).unwrap())
    }

    #[test]
    fn without_its_background_a_picture_has_straight_colours_and_opacity() {
        let (info, pixels) = encode_with(&Params { transparent: true, ..Params::default() });
        assert_eq!((info.color_type, info.bit_depth), (ColorType::Rgba, BitDepth::Eight));
        assert_eq!(pixels, [118, 0, 255, 64, 0, 0, 0, 0]);
    }

    #[test]
    fn light_beyond_its_opacity_is_counted() {
        let count = |exposure: f64| {
            let metadata = Metadata { exposure, ..Metadata::default() };
            let params = Params { transparent: true, ..Params::default() };
            let mut report = WriteReport::default();
            encode(&layers(), &metadata, &params, &mut report).unwrap();
            report.too_bright
        };
        // Its blue is as bright as its opacity at most, then twice as bright.
        assert_eq!([count(0.0), count(1.0)], [0, 1]);
    }

    #[test]
    fn sixteen_bits_tell_apart_what_eight_do_not() {
        let (info, pixels) = encode_with(&Params { deep: true, ..Params::default() });
        assert_eq!((info.color_type, info.bit_depth), (ColorType::Rgb, BitDepth::Sixteen));
        let samples: Vec<u16> = pixels.chunks(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect();
        // sRGB of a half is 0.735 357.
        assert_eq!(samples[3..], [48192; 3]);
        assert_eq!((u32::from(samples[1]) + 128) / 257, u32::from(crate::displayed(0.375)));
    }

    #[test]
    fn a_picture_tells_what_made_it() {
        let (info, _) = encode_with(&Params::default());
        let text = |name: &str| {
            let chunk = info.utf8_text.iter().find(|chunk| chunk.keyword == name).unwrap();
            chunk.get_text().unwrap()
        };
        assert_eq!((text("organza:technique"), text("organza:seed")), ("points".to_owned(), "0".to_owned()));
        assert_eq!(text("organza:scene"), "π = \"3\"\n".repeat(99));
        assert!(info.srgb.is_some());
    }
}
