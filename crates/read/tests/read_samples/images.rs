//! Small images of radiance, made in memory.

use exr::prelude::*;
use std::io::Cursor;

/// Width and height of the samples.
pub(crate) const SIZE: [u32; 2] = [12, 5];

/// Values of a pixel, of many brightnesses; all of them fit an RGBE pixel exactly.
pub(crate) fn pixel(x: usize, y: usize) -> [u8; 4] {
    if x < 5 { [90, 128, 200, 129] } else { [(10 * x + y) as u8, 255, (7 * y) as u8, 120 + (x + y) as u8] }
}

fn rows() -> impl Iterator<Item = Vec<[u8; 4]>> {
    (0..SIZE[1] as usize).map(|y| (0..SIZE[0] as usize).map(|x| pixel(x, y)).collect())
}

/// A Radiance HDR file with these lines in its header.
pub(crate) fn hdr_of(lines: &str, scanlines: &[u8]) -> Vec<u8> {
    let [width, height] = SIZE;
    let mut out =
        format!("#?RADIANCE\n# a test\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    out.extend(scanlines);
    out
}

/// Scanlines channel by channel, in runs and stretches.
pub(crate) fn newer() -> Vec<u8> {
    let mut out = Vec::new();
    for row in rows() {
        out.extend([2, 2, 0, SIZE[0] as u8]);
        for channel in 0..4 {
            out.extend([128 + 5, row[0][channel], SIZE[0] as u8 - 5]);
            out.extend(row[5..].iter().map(|p| p[channel]));
        }
    }
    out
}

/// Scanlines of pixels, the last one repeated.
pub(crate) fn older() -> Vec<u8> {
    rows().flat_map(|row| [&[row[0], [1, 1, 1, 4]][..], &row[5..]].concat()).flatten().collect()
}

/// Scanlines of pixels.
pub(crate) fn plain() -> Vec<u8> {
    rows().flatten().flatten().collect()
}

/// A part of an OpenEXR image of these pixels: channels of these names.
pub(crate) fn layer_of(
    names: [&str; 3],
    (compression, blocks): (Compression, Blocks),
    pixel: impl Fn(usize, usize) -> [f32; 3],
) -> Layer<AnyChannels<FlatSamples>> {
    let [width, height] = SIZE.map(|s| s as usize);
    let samples = |c: usize| (0..width * height).map(|k| pixel(k % width, k / width)[c]).collect();
    let channels = (0..3).map(|c| AnyChannel::new(names[c], FlatSamples::F32(samples(c)))).collect();
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    Layer::new((width, height), LayerAttributes::default(), encoding, AnyChannels::sort(channels))
}

/// The file of one part.
pub(crate) fn exr_of(layer: Layer<AnyChannels<FlatSamples>>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// The pixels of the samples as an OpenEXR file.
pub(crate) fn exr(compression: Compression, blocks: Blocks) -> Vec<u8> {
    exr_of(layer_of(["R", "G", "B"], (compression, blocks), radiance))
}

/// The radiance of [`pixel`].
pub(crate) fn radiance(x: usize, y: usize) -> [f32; 3] {
    let [r, g, b, e] = pixel(x, y);
    [r, g, b].map(|m| f32::from(m) * 2.0f32.powi(i32::from(e) - 136))
}

/// A PNG file of [`SIZE`] with these samples.
pub(crate) fn png(color: image::ExtendedColorType, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    image::ImageEncoder::write_image(encoder, samples, SIZE[0], SIZE[1], color).unwrap();
    bytes
}

/// So many bytes for each pixel, all of them different from their neighbours.
pub(crate) fn png_bytes(a_pixel: usize) -> Vec<u8> {
    (0..SIZE[0] as usize * SIZE[1] as usize * a_pixel).map(|k| (k * 37 % 256) as u8).collect()
}
