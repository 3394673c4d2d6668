//! Images of radiance: what they hold, against another decoder, and what is refused in them.

use crate::read_samples::images::{SIZE, exr, exr_of, hdr_of, layer_of, newer, older, plain, png, png_bytes, radiance};
use crate::read_samples::{gzip, load};
use exr::prelude::{Blocks, Compression, Vec2};
use image::ExtendedColorType;
use read::{Fault, Loaded, ReadError, ReadParams, bytes};
use splat_core::{MemoryAccount, RadianceImage};

fn image(name: &str, content: &[u8]) -> RadianceImage {
    match load(name, content) {
        Ok(Loaded::Image(image)) => image,
        other => panic!("{name}: {other:?}"),
    }
}

/// The image of all samples, times a factor.
fn expected(factor: f32) -> RadianceImage {
    let [width, height] = SIZE.map(|s| s as usize);
    let pixels = (0..width * height).map(|k| radiance(k % width, k / width).map(|v| v * factor)).collect();
    RadianceImage { size: SIZE, pixels }
}

#[track_caller]
fn refused(name: &str, content: &[u8], beginning: &str) -> ReadError {
    let error = load(name, content).expect_err(name);
    assert!(error.to_string().starts_with(beginning), "{error}");
    assert!(!error.hint.is_empty());
    error
}

#[test]
fn both_codes_of_scanlines_and_plain_pixels_are_one_image_as_another_decoder_reads_it() {
    for scanlines in [newer(), older(), plain()] {
        let content = hdr_of("SOFTWARE=x\n", &scanlines);
        let read = image("a.hdr", &content);
        assert_eq!(read, expected(1.0));
        let other = image::codecs::hdr::HdrDecoder::new(&content[..]).unwrap();
        let other = image::DynamicImage::from_decoder(other).unwrap().into_rgb32f();
        let other: Vec<[f32; 3]> = other.pixels().map(|p| p.0).collect();
        assert_eq!(read.pixels, other);
    }
    let content = hdr_of("", &newer());
    assert_eq!(image("a.pic", &content), expected(1.0));
    assert_eq!(image("a.hdr.gz", &gzip(&content)), expected(1.0));
}

#[test]
fn exposure_is_taken_off_and_unknown_primaries_are_told() {
    let content =
        hdr_of("EXPOSURE=0.5\nEXPOSURE= 0.5\nCOLORCORR=1 1 1\nPRIMARIES=0.6 0.3 0.3 0.6 0.1 0.1 0.3 0.3\n", &newer());
    let (loaded, notes) = bytes("a.hdr", &content, &ReadParams::default(), None).unwrap();
    assert_eq!(loaded, Loaded::Image(expected(4.0)));
    assert_eq!(notes.unused, ["PRIMARIES"]);
}

#[test]
fn openexr_is_read_by_lines_and_tiles_in_any_channel_order() {
    for compression in
        [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ]
    {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 4))] {
            assert_eq!(image("a.exr", &exr(compression, blocks)), expected(1.0), "{compression:?} {blocks:?}");
        }
    }
}

#[test]
fn bi36_headers_that_lie_are_refused_with_their_place() {
    let good = String::from_utf8(hdr_of("", &[])).unwrap();
    let with = |from: &str, to: &str| [good.replace(from, to).into_bytes(), newer()].concat();
    let size = "-Y 5 +X 12";
    for (to, beginning) in [
        ("-Y 5 +X 13", "a.hdr@55: expected 13 pixels in scanline 0 of 5, found 12"),
        ("-Y 6 +X 12", "a.hdr@275: expected 12 more pixels in scanline 5 of 6, found the end of the file"),
        ("-Y 4 +X 12", "a.hdr@231: expected the end of the file after 4 scanlines, found 44 bytes more"),
        ("-Y 0 +X 12", "a.hdr: expected an image of 1 to 65536 pixels a side, found 12 x 0"),
        ("-Y 5 +X 99999", "a.hdr: expected an image of 1 to 65536 pixels a side, found 99999 x 5"),
        ("+X 12 -Y 5", "a.hdr:5: expected -Y HEIGHT +X WIDTH, found '+X 12 -Y 5'"),
        ("-Y 5", "a.hdr:5: expected -Y HEIGHT +X WIDTH, found '-Y 5'"),
    ] {
        refused("a.hdr", &with(size, to), beginning);
    }
    refused("a.hdr", &with("rgbe", "xyze"), "a.hdr:3: expected FORMAT=32-bit_rle_rgbe, found 'FORMAT=32-bit_rle_xyze'");
    refused("a.hdr", &with("# a test", "EXPOSURE=0"), "a.hdr:2: expected EXPOSURE= and a number above 0");
    refused("a.hdr", &with("# a test", "COLORCORR=1 NaN 1"), "a.hdr:2: expected COLORCORR= and three numbers above 0");
    refused("a.hdr", b"#?RADIANCE\nx", "a.hdr@12: expected a header, an empty line and a line of the size");
    // 51 GB of pixels, and a hundred bytes for them.
    let error = refused("a.hdr", &with(size, "-Y 65536 +X 65536"), "a.hdr: expected at most");
    assert_eq!(error.fault, Fault::Limit);
    let error = refused("a.hdr", &with(size, "-Y 32767 +X 2000"), "a.hdr: expected at most 1000 decompressed bytes");
    assert_eq!(error.fault, Fault::Limit);
    let little = ReadParams { memory: MemoryAccount::new(400), ..ReadParams::default() };
    let error = bytes("a.hdr", &hdr_of("", &newer()), &little, None).unwrap_err();
    let message = error.to_string();
    assert!(
        message.starts_with("a.hdr: expected at most 400 bytes of memory for all that is read, found "),
        "{message}"
    );
}

#[test]
fn bi36_scanlines_with_impossible_runs_are_refused_with_their_place() {
    let at = hdr_of("", &[]).len();
    let cases: [(&[u8], &str); 6] = [
        (&[2, 2, 0, 12, 128 + 13, 1], "expected 1 to 12 pixels in scanline 0 of 5, found 13"),
        (&[2, 2, 0, 12, 0], "expected 1 to 12 pixels in scanline 0 of 5, found 0"),
        (&[2, 2, 0, 12, 12, 1], "expected 12 more pixels in scanline 0 of 5, found the end of the file"),
        (&[1, 1, 1, 3], "expected a first pixel in scanline 0 of 5, found a run of 3"),
        (&[9, 9, 9, 9, 1, 1, 1, 12], "expected at most 11 pixels in scanline 0 of 5, found a run of 12"),
        (&[9, 9, 9, 9, 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0], "found a run of 0"),
    ];
    for (scanlines, words) in cases {
        let error = load("a.hdr", &hdr_of("", scanlines)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
        let place: usize = error.strip_prefix("a.hdr@").unwrap().split(':').next().unwrap().parse().unwrap();
        assert!((at..=at + scanlines.len()).contains(&place), "{error}");
    }
    let content = hdr_of("EXPOSURE=1e-9\n", &[255; 240]);
    refused(
        "a.hdr",
        &content,
        "a.hdr@69: expected radiance that fits 32-bit floats, found [inf, inf, inf] at pixel (0, 0)",
    );
}

#[test]
fn bi36_openexr_without_colours_deep_cropped_or_with_what_is_no_radiance() {
    let lines = (Compression::ZIP16, Blocks::ScanLines);
    for value in [f32::NAN, f32::INFINITY, -0.25] {
        let pixel = |x: usize, y: usize| if [x, y] == [7, 3] { [1.0, value, 1.0] } else { [1.0; 3] };
        let beginning =
            format!("a.exr: expected radiance: finite numbers ≥ 0, found {value} in channel G of pixel (7, 3)");
        refused("a.exr", &exr_of(layer_of(["R", "G", "B"], lines, pixel)), &beginning);
    }
    let depths = exr_of(layer_of(["Z", "normal.X", "Y"], lines, radiance));
    refused("a.exr", &depths, "a.exr: expected channels R, G and B, found 'Y Z normal.X'");
    let mut cropped = layer_of(["R", "G", "B"], lines, radiance);
    cropped.attributes.layer_position = Vec2(3, 0);
    let mut image = exr::prelude::Image::from_layer(cropped);
    image.attributes.display_window = exr::meta::attribute::IntegerBounds::from_dimensions(Vec2(40, 20));
    let mut content = std::io::Cursor::new(Vec::new());
    exr::prelude::WritableImage::write(&image).to_buffered(&mut content).unwrap();
    let words = "a.exr: expected pixels in the whole display window, 40 x 20 at (0, 0), found 12 x 5 at (3, 0)";
    refused("a.exr", &content.into_inner(), words);
    // The flag of deep data in the version field.
    let mut deep = exr(Compression::ZIP1, Blocks::ScanLines);
    deep[5] |= 0x08;
    refused("a.exr", &deep, "a.exr: expected one colour a pixel, found a deep image");
    refused("a.exr", b"v/1\x01", "a.exr: expected a complete OpenEXR image");
    let little = ReadParams { memory: MemoryAccount::new(700), ..ReadParams::default() };
    assert_eq!(bytes("a.exr", &exr(lines.0, lines.1), &little, None).unwrap_err().fault, Fault::Limit);
}

#[test]
fn bi36_openexr_whose_tiles_are_said_to_be_huge_is_refused_before_they_take_room() {
    let mut content = exr(Compression::PIZ, Blocks::Tiles(Vec2(8, 4)));
    let name = b"tiledesc\0";
    let at = content.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    content[at..at + 8].copy_from_slice(&[[0, 0, 1, 0], [0, 0, 1, 0]].concat());
    let error = bytes("a.exr", &content, &ReadParams::default(), None).unwrap_err();
    assert!(error.fault == Fault::Limit && error.to_string().contains("a packed tile"), "{error}");
}

#[test]
fn png_of_a_display_becomes_linear_radiance() {
    // IEC 61966-2-1.
    let linear = |v: f64| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    let eight = png_bytes(3);
    let read = image("a.png", &png(ExtendedColorType::Rgb8, &eight));
    assert_eq!(read.size, SIZE);
    for (found, stored) in read.pixels.as_flattened().iter().zip(&eight) {
        assert!((f64::from(*found) - linear(f64::from(*stored) / 255.0)).abs() < 1e-7, "{stored}: {found}");
    }
    let sixteen = png_bytes(2);
    let read = image("b.png", &gzip(&png(ExtendedColorType::L16, &sixteen)));
    for (found, stored) in read.pixels.iter().zip(sixteen.chunks_exact(2)) {
        let expected = linear(f64::from(u16::from_ne_bytes([stored[0], stored[1]])) / 65535.0);
        assert!(found.iter().all(|v| (f64::from(*v) - expected).abs() < 1e-7), "{stored:?}: {found:?}");
    }
    let opaque: Vec<u8> = eight.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
    let with_alpha = image("c.png", &png(ExtendedColorType::Rgba8, &opaque));
    assert_eq!(with_alpha, image("a.png", &png(ExtendedColorType::Rgb8, &eight)));
}

#[test]
fn bi36_png_that_is_translucent_damaged_or_longer_than_it_says() {
    let good = png(ExtendedColorType::Rgb8, &png_bytes(3));
    let translucent = png(ExtendedColorType::Rgba8, &png_bytes(4));
    refused("a.png", &translucent, "a.png: expected opaque pixels, found some that are translucent");
    refused("a.png", &good[..20], "a.png: expected a complete PNG image");
    let [short, long] = [good[..good.len() - 12].to_vec(), [&good[..], b"x"].concat()];
    let beginning =
        format!("a.png@{}: expected a whole chunk, the last one IEND, found the end of the file", short.len());
    refused("a.png", &short, &beginning);
    let beginning = format!("a.png@{}: expected the end of the file after IEND, found 1 bytes more", good.len());
    refused("a.png", &long, &beginning);
    let gamma =
        [&good[..33], &[0, 0, 0, 4][..], b"gAMA", &[0, 0, 0xb1, 0x8f, 0x0b, 0xfc, 0x61, 0x05], &good[33..]].concat();
    let (_, notes) = bytes("a.png", &gamma, &ReadParams::default(), None).unwrap();
    assert_eq!(notes.unused, ["gAMA"]);
    let little = ReadParams { memory: MemoryAccount::new(700), ..ReadParams::default() };
    assert_eq!(bytes("a.png", &good, &little, None).unwrap_err().fault, Fault::Limit);
}
