//! All layers as one OpenEXR part with dotted channel names, ZIP-compressed.
//!
//! | layer | channels | | layer | channels |
//! |---|---|---|---|---|
//! | beauty, alpha | R G B, A | | depth.first | Z and depth.first.Z |
//! | normal | N.X N.Y N.Z | | other depths | depth.median.Z … |
//! | shadow | shadow.A | | object | object.id (u32) |
//! | direct … | direct.R direct.G direct.B | | opacity before a background | opacity.A |
//!
//! `R G B` are premultiplied with `A`, as the format requires. Both are of the objects alone. If a background is part of the picture,
//! `A` is 1.

use super::{Metadata, Params, WriteReport, texts};
use crate::Error;
use exr::prelude::*;
use splat_core::{LayerData, Layers};

/// Largest finite f16.
const LARGEST_HALF: f32 = 65504.0;
/// Pictures of longer sides than this are packed by several threads.
const LONGEST_ALONE: u32 = 256;
/// Tolerance of the sum of a pixel's samples, as a share of the sum.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// Type of a text in the file layout of OpenEXR, which limits neither its length nor its bytes.
const TEXT: &str = "string";

/// The bytes of the EXR file.
pub(super) fn encode(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
    report: &mut WriteReport,
) -> std::result::Result<Vec<u8>, crate::Error> {
    let mut channels = SmallVec::new();
    for (name, data) in &layers.images {
        match (*name, data) {
            ("beauty", LayerData::Rgb(_)) if params.transparent => {
                let objects = LayerData::Rgb(before_background(layers)?);
                push_channels(&mut channels, name, &objects, params.half, report);
            }
            ("alpha", LayerData::Scalar(opacity)) if params.has_background && !params.transparent => {
                let whole = LayerData::Scalar(vec![1.0; opacity.len()]);
                push_channels(&mut channels, name, &whole, params.half, report);
                push_channels(&mut channels, "opacity", data, params.half, report);
            }
            _ => push_channels(&mut channels, name, data, params.half, report),
        }
    }
    let fail = |e: exr::error::Error| Error::Internal(format!("EXR encoder: {e}"));
    let mut attributes = LayerAttributes::default();
    for (name, value) in texts::pairs(metadata) {
        attributes.other.insert(Text::from(name), text(&value));
    }
    let size = Vec2(layers.size[0] as usize, layers.size[1] as usize);
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = Image::from_layer(layer);
    // Threads of its own are started for each file: of small pictures, such as an animation's, they cost more than they give.
    let writer = image.write();
    let writer = if layers.size[0].max(layers.size[1]) <= LONGEST_ALONE { writer.non_parallel() } else { writer };
    writer.to_buffered(&mut bytes).map_err(fail)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or_else(|| Error::Internal("the EXR header cannot be read back".into()))?;
    Ok(bytes)
}

/// Radiance of what lies before the background, premultiplied. What rounding makes of a bright background is no light.
fn before_background(layers: &Layers) -> std::result::Result<Vec<[f32; 3]>, crate::Error> {
    let layer = |name: &str| layers.rgb(name).ok_or_else(|| Error::Internal(format!("a render has no {name} layer")));
    let beauty = layer("beauty")?;
    let background = layer("background")?;
    let light = |seen: f32, behind: f32| {
        let difference = seen - behind;
        if difference <= ROUNDING * behind { 0.0 } else { difference }
    };
    let of_pixel = |(seen, behind): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| light(seen[c], behind[c]));
    Ok(beauty.iter().zip(background).map(of_pixel).collect())
}

/// A text as an attribute, in UTF-8: the encoder's own texts are Latin, and of 255 bytes at most.
fn text(text: &str) -> AttributeValue {
    AttributeValue::Custom { kind: Text::from(TEXT), bytes: text.as_bytes().into() }
}

type Channels = SmallVec<[AnyChannel<FlatSamples>; 4]>;

fn push_channels(channels: &mut Channels, name: &str, data: &LayerData, half: bool, report: &mut WriteReport) {
    let mut push = |channel: &str, samples| channels.push(AnyChannel::new(channel, samples));
    match (name, data) {
        ("normal", LayerData::Rgb(pixels)) => {
            for (i, axis) in ["X", "Y", "Z"].iter().enumerate() {
                push(&format!("N.{axis}"), full(pixels.iter().map(|p| p[i]), report));
            }
        }
        (_, LayerData::Rgb(pixels)) => {
            let prefix = if name == "beauty" { String::new() } else { format!("{name}.") };
            for (i, c) in ["R", "G", "B"].iter().enumerate() {
                push(&format!("{prefix}{c}"), color(pixels.iter().map(|p| p[i]), half, report));
            }
        }
        (_, LayerData::Scalar(values)) if name.starts_with("depth.") => {
            if name == "depth.first" {
                // What compositing programs look for.
                push("Z", depth(values, &mut WriteReport::default()));
            }
            push(&format!("{name}.Z"), depth(values, report));
        }
        ("alpha", LayerData::Scalar(values)) => push("A", color(values.iter().copied(), half, report)),
        (_, LayerData::Scalar(values)) => push(&format!("{name}.A"), color(values.iter().copied(), half, report)),
        (_, LayerData::Id(ids)) => push(&format!("{name}.id"), FlatSamples::U32(ids.clone())),
    }
}

/// Replaces NaN by 0 and cuts values beyond ±`largest`, counting both.
fn finite(value: f32, largest: f32, report: &mut WriteReport) -> f32 {
    if value.is_nan() {
        report.not_a_number += 1;
        return 0.0;
    }
    if value.abs() > largest {
        report.clamped += 1;
        return value.clamp(-largest, largest);
    }
    value
}

fn full(values: impl Iterator<Item = f32>, report: &mut WriteReport) -> FlatSamples {
    FlatSamples::F32(values.map(|v| finite(v, f32::MAX, report)).collect())
}

fn color(values: impl Iterator<Item = f32>, half: bool, report: &mut WriteReport) -> FlatSamples {
    if half {
        FlatSamples::F16(values.map(|v| f16::from_f32(finite(v, LARGEST_HALF, report))).collect())
    } else {
        full(values, report)
    }
}

/// Depths keep their +∞, which means that they are undefined.
fn depth(values: &[f32], report: &mut WriteReport) -> FlatSamples {
    FlatSamples::F32(values.iter().map(|v| finite(*v, f32::INFINITY, report)).collect())
}

/// Puts the attributes of a single-part header into the order of their names: the encoder writes them in the order of
/// a hash map, which differs from run to run. The header keeps its length, so the offset table stays right.
///
/// Header (OpenEXR file layout): magic and version, 8 bytes; attributes `name 0 type 0 size:i32 value`; 0.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    const START: usize = 8;
    let mut attributes = Vec::new();
    let mut at = START;
    while *file.get(at)? != 0 {
        let begin = at;
        for _name_and_type in 0..2 {
            at += file.get(at..)?.iter().position(|b| *b == 0)? + 1;
        }
        let size = u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?);
        at += 4 + size as usize;
        attributes.push(file.get(begin..at)?.to_vec());
    }
    // A name ends in 0, so whole records order as their names do.
    attributes.sort_unstable();
    file[START..at].copy_from_slice(&attributes.concat());
    Some(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn tiny() -> Layers {
        let mut layers = Layers { size: [2, 1], ..Layers::default() };
        layers.insert("beauty", LayerData::Rgb(vec![[0.0, 1.0, 1e6], [f32::NAN, f32::INFINITY, 1e-8]]));
        layers.insert("alpha", LayerData::Scalar(vec![0.0, 1.0]));
        layers.insert("depth.first", LayerData::Scalar(vec![f32::INFINITY, 2.5]));
        layers.insert("normal", LayerData::Rgb(vec![[0.0; 3], [0.0, 0.0, 1.0]]));
        layers.insert("object", LayerData::Id(vec![u32::MAX, 7]));
        layers
    }

    #[test]
    fn ou3_nothing_but_depth_is_infinite_and_nothing_is_nan() {
        let mut report = WriteReport::default();
        let bytes =
            encode(&tiny(), &Metadata::default(), &Params { half: true, ..Params::default() }, &mut report).unwrap();
        assert_eq!((report.not_a_number, report.clamped), (1, 2));
        let image =
            read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
        let image = image.from_buffered(std::io::Cursor::new(bytes)).unwrap();
        let names: Vec<String> = image.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["A", "B", "G", "N.X", "N.Y", "N.Z", "R", "Z", "depth.first.Z", "object.id"]);
        for channel in &image.layer_data.channel_data.list {
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            assert!(values.iter().all(|v| !v.is_nan()));
            let infinite = values.iter().filter(|v| v.is_infinite()).count();
            assert_eq!(infinite, usize::from(channel.name.to_string().ends_with('Z') && !channel.name.eq("N.Z")));
        }
    }

    #[test]
    fn the_same_layers_give_the_same_bytes_and_any_text_is_taken() {
        let metadata = Metadata { scene: "ügly\n".repeat(1000), backend: "雪".into(), ..Metadata::default() };
        let encoded = || encode(&tiny(), &metadata, &Params::default(), &mut WriteReport::default()).unwrap();
        let first = encoded();
        assert!((0..8).all(|_| encoded() == first));
        let has = |text: &str| first.windows(text.len()).any(|bytes| bytes == text.as_bytes());
        assert!(has(&metadata.scene) && has(&metadata.backend));
        let image =
            read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
        let image = image.from_buffered(std::io::Cursor::new(first)).unwrap();
        let told = &image.layer_data.attributes.other[&Text::from("organza:seed")];
        assert_eq!(*told, AttributeValue::Text(Text::from("0")));
    }
}
