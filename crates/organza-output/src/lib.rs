//! Finished images as OpenEXR and PNG files, whole or not at all.
//!
//! A [`Target`] is checked before any work: it is neither an input, nor another output under a second spelling, nor a file that may not be
//! replaced. [`write()`] makes the file in memory and gives it its name last.
//!
//! ```
//! use organza_output::{Metadata, Params, Target, write};
//! use splat_core::{LayerData, Layers};
//!
//! let mut layers = Layers { size: [2, 1], ..Layers::default() };
//! layers.insert("beauty", LayerData::Rgb(vec![[0.0, 0.5, 1.0]; 2]));
//! layers.insert("alpha", LayerData::Scalar(vec![1.0; 2]));
//! let folder = tempfile::tempdir().unwrap();
//! let target = Target::new(&folder.path().join("two.exr"), false).unwrap();
//! let report = write(&layers, &Metadata::default(), &target, &Params::default()).unwrap();
//! assert_eq!(report.bytes, std::fs::metadata(target.path()).unwrap().len());
//! // The file exists now, and is not replaced without permission.
//! assert!(Target::new(target.path(), false).is_err());
//! ```
#![forbid(unsafe_code)]

mod display;
mod doubt;
mod error;
mod exr_file;
mod jpeg_file;
mod legend;
mod png_file;
mod target;
mod targets;
mod texts;
mod webp_file;

pub use display::displayed;
pub use doubt::doubt;
pub use error::Error;
pub use target::{Target, abandon};
pub use targets::Targets;

use organza_scene::ColorScale;
use splat_core::Layers;
use std::path::Path;

/// Metadata about the origin of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metadata {
    /// SHA-256 of the scene, lower-case hex.
    pub scene_sha256: String,
    /// Text of the scene, so that the picture can be drawn anew from what it says; empty where that is not told, and left out of the file
    /// above 64 KiB.
    pub scene: String,
    /// Name of the technique that drew it.
    pub technique: String,
    /// Effects that the picture lacks, each with its bound; empty where it lacks none.
    pub left_out: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Name of the backend that drew it.
    pub backend: String,
    /// Sets that were averaged, of a technique that averages.
    pub sets: Option<u32>,
    /// Exposure of the displayed picture in stops; only PNG applies it.
    pub exposure: f64,
}

/// How files store a picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Params {
    /// Whether an EXR file has its colours, alpha and shadow in 16 bits.
    pub half: bool,
    /// Whether a PNG file has 16 bits a channel, not 8.
    pub deep: bool,
    /// Whether files have the opacity of their pixels in the place of what lies behind everything: the layer `background` is taken off.
    /// EXR files then hold premultiplied colours, PNG files straight ones.
    pub transparent: bool,
    /// Whether beauty holds a background that is not black. An EXR file with one is opaque: its `A` is 1, and the opacity of what lies before
    /// the background is `opacity.A`, so that no compositing program adds the background twice.
    pub has_background: bool,
    /// Colour scales. PNG, JPEG and WebP files have a legend of each, in proportion to the picture.
    pub legend: Vec<ColorScale>,
    /// Where the legends are.
    pub legend_place: LegendPlace,
}

/// The place of legends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LegendPlace {
    /// Over the right border of the picture, so that the file has the picture's size.
    #[default]
    Over,
    /// In a strip to the right of the picture, which makes the file wider and covers nothing. Only [`write()`] and [`encode`] add the strip.
    Beside,
}

/// Counts of the changes that made the file valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WriteReport {
    /// Bytes of the file.
    pub bytes: u64,
    /// Values too large for the format, cut to its largest.
    pub clamped: u64,
    /// Values that were not a number, written as 0.
    pub not_a_number: u64,
    /// Pixels whose light is brighter than their opacity holds as a straight colour: what is beyond is lost.
    pub too_bright: u64,
    /// Legends that the picture has no room for.
    pub without_room: u64,
    /// Letters of legends that are drawn as boxes: those beyond Latin ones and some Greek ones.
    pub boxes: u64,
}

/// File formats by extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR with all layers.
    Exr,
    /// PNG with the displayed picture.
    Png,
    /// JPEG with the displayed picture, which loses a little of it, and has neither an opacity nor texts.
    Jpeg,
    /// WebP with the displayed picture, without losses, and with its opacity.
    WebP,
}

impl Format {
    /// The format of a path, by its extension.
    ///
    /// # Errors
    /// [`Error::Usage`] for any other extension.
    pub fn of_path(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("exr") {
            Ok(Self::Exr)
        } else if extension.eq_ignore_ascii_case("png") {
            Ok(Self::Png)
        } else if extension.eq_ignore_ascii_case("jpg") || extension.eq_ignore_ascii_case("jpeg") {
            Ok(Self::Jpeg)
        } else if extension.eq_ignore_ascii_case("webp") {
            Ok(Self::WebP)
        } else {
            let path = organza_scene::printable(path);
            let message = format!("{path}: expected a name that ends in .exr, .png, .jpg or .webp");
            Err(Error::Usage { message, hint: "the format follows from the extension".into() })
        }
    }
}

/// Writes layers to a place in the format of its extension.
///
/// The file appears whole or not at all: it is made in memory, written under another name in the same folder, and
/// gets its own name last. NaN is never written.
///
/// # Errors
/// [`Error::Usage`] for an unknown extension, [`Error::Io`] and [`Error::Output`] for the file system; a file that was
/// there before is then unchanged.
pub fn write(layers: &Layers, metadata: &Metadata, target: &Target, params: &Params) -> Result<WriteReport, Error> {
    let (bytes, report) = encode(layers, metadata, Format::of_path(target.path())?, params)?;
    target.write(&bytes)?;
    Ok(report)
}

/// The bytes of a file of this format, as [`write()`] makes it.
///
/// # Errors
/// [`Error::Output`] for a picture that the format cannot hold.
pub fn encode(
    layers: &Layers,
    metadata: &Metadata,
    format: Format,
    params: &Params,
) -> Result<(Vec<u8>, WriteReport), Error> {
    let mut report = WriteReport::default();
    let is_wider = params.legend_place == LegendPlace::Beside && format != Format::Exr;
    let wider = is_wider.then(|| legend::with_strip(layers, &params.legend));
    let layers = wider.as_ref().unwrap_or(layers);
    let bytes = match format {
        Format::Exr => exr_file::encode(layers, metadata, params, &mut report)?,
        Format::Png => png_file::encode(layers, metadata, params, &mut report)?,
        Format::Jpeg => jpeg_file::encode(layers, metadata, params, &mut report)?,
        Format::WebP => webp_file::encode(layers, metadata, params, &mut report)?,
    };
    report.bytes = bytes.len() as u64;
    Ok((bytes, report))
}

/// Refuses a picture that a format has no room for.
///
/// # Errors
/// [`Error::Usage`] for more pixels along a side.
fn check_sides(format: &str, size: [u32; 2], most: u32) -> Result<(), Error> {
    let [width, height] = size;
    if width <= most && height <= most {
        return Ok(());
    }
    let message = format!("a {format} file has at most {most} pixels a side, found {width}x{height}");
    Err(Error::Usage { message, hint: "write a PNG or EXR file".into() })
}

/// The displayed picture, as a PNG file of 8 bits a channel has it: red, green and blue of each pixel, row by row from the top left, and its opacity where
/// the picture is to be transparent.
///
/// # Errors
/// [`Error::Internal`] for layers without `beauty`, or for a transparent picture without `alpha` and `background`.
pub fn displayed_bytes(layers: &Layers, metadata: &Metadata, params: &Params) -> Result<Vec<u8>, Error> {
    displayed_with_report(layers, metadata, params).map(|(bytes, _)| bytes)
}

/// The same, with the report of what the picture cannot show.
///
/// # Errors
/// As [`displayed_bytes`].
pub fn displayed_with_report(
    layers: &Layers,
    metadata: &Metadata,
    params: &Params,
) -> Result<(Vec<u8>, WriteReport), Error> {
    let mut report = WriteReport::default();
    png_file::bytes(layers, metadata, params, &mut report).map(|bytes| (bytes, report))
}

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
