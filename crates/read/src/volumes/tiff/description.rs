//! What the first page of a stack says of all: how pages are slices, channels and times, and how far apart voxels lie. ImageJ writes lines of `key=value`, OME
//! a text in XML; other programs state the resolution of pages alone.

use super::HINT;
use super::page::{Page, Pages};
use crate::Notes;
use crate::error::{Place, ReadError};
use crate::text::xml;
use crate::volumes::rounded;
use roxmltree::Node;
use splat_core::glam::DVec3;
use splat_core::text::escaped;
use tiff::tags::Tag;

/// Most elements and texts of the description by OME, which has some for each page.
const MOST_NODES: u32 = 200_000;
/// Millimetres of the units of a resolution.
const INCH: f64 = 25.4;
const CENTIMETRE: f64 = 10.0;
/// Most of a length that is believed, and its reciprocal: a damaged number is none.
const FARTHEST: f64 = 1e12;

/// Planes of one kind that follow each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Run {
    pub(super) count: u64,
    /// Planes from one to the next.
    stride: u64,
}

/// How the planes of a file are slices, channels and times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Planes {
    pub(super) slices: Run,
    pub(super) channels: Run,
    pub(super) times: Run,
    /// Whether the times are taken as slices, of which there is one.
    pub(super) are_times: bool,
    /// Whether all planes may follow the first without pages of their own.
    pub(super) may_follow: bool,
}

impl Planes {
    pub(super) fn count(&self) -> u64 {
        self.slices.count.saturating_mul(self.channels.count).saturating_mul(self.times.count)
    }

    /// Which plane of the file one is.
    pub(super) fn rank(&self, slice: u64, channel: u64, time: u64) -> u64 {
        slice * self.slices.stride + channel * self.channels.stride + time * self.times.stride
    }

    /// Planes whose runs follow each other, the fastest first.
    fn nested(order: Order, counts: Counts, may_follow: bool) -> Self {
        let mut stride = 1u64;
        let mut runs = [Run { count: 1, stride: 1 }; 3];
        for axis in order.0 {
            let count = counts.along(axis);
            runs[axis as usize] = Run { count, stride };
            stride = stride.saturating_mul(count);
        }
        let [slices, channels, times] = runs;
        if slices.count == 1 && times.count > 1 {
            let one = Run { count: 1, stride: 1 };
            return Self { slices: times, channels, times: one, are_times: true, may_follow };
        }
        Self { slices, channels, times, are_times: false, may_follow }
    }
}

/// What changes from plane to plane.
#[derive(Debug, Clone, Copy)]
enum Axis {
    Slice,
    Channel,
    Time,
}

/// Axes of the planes, the one that changes fastest first.
#[derive(Debug, Clone, Copy)]
struct Order([Axis; 3]);

/// The channel of a pixel changes fastest, then the slice, then the time.
const OF_IMAGEJ: Order = Order([Axis::Channel, Axis::Slice, Axis::Time]);

/// How many slices, channels and times there are.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counts {
    slices: u64,
    channels: u64,
    times: u64,
}

impl Counts {
    fn along(self, axis: Axis) -> u64 {
        match axis {
            Axis::Slice => self.slices,
            Axis::Channel => self.channels,
            Axis::Time => self.times,
        }
    }

    fn planes(self) -> Option<u64> {
        self.slices.checked_mul(self.channels)?.checked_mul(self.times)
    }
}

/// How the planes are stated.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stated {
    Nothing,
    /// By the number of slices, channels and times.
    ByImageJ(Counts),
    /// The same by OME, and the order of the axes.
    ByOme(Counts, [char; 3]),
}

/// What the first page says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Description {
    stated: Stated,
    /// Lengths of a voxel, where they are stated.
    lengths: [Option<f64>; 3],
    unit: String,
    /// Names of channels by OME, empty for one without; not all channels may be listed.
    pub(super) channels: Vec<String>,
}

impl Description {
    pub(super) fn read(pages: &mut Pages, page: &Page) -> Result<Self, ReadError> {
        let text = pages.text(page.rank, Tag::ImageDescription)?.unwrap_or_default();
        let trimmed = text.trim_start_matches('\u{feff}').trim_start();
        if trimmed.starts_with('<') && trimmed.contains("<OME") {
            return of_ome(trimmed);
        }
        let mut found = Self { stated: Stated::Nothing, lengths: [None; 3], unit: String::new(), channels: Vec::new() };
        if trimmed.starts_with("ImageJ=") {
            found = of_imagej(trimmed)?;
        }
        let millimetres = match pages.number(Tag::ResolutionUnit).unwrap_or(2) {
            2 => Some(INCH),
            3 => Some(CENTIMETRE),
            _ => None,
        };
        // A resolution of no unit is in that of ImageJ, or says nothing.
        let unit = if found.unit.is_empty() { millimetres } else { Some(1.0) };
        for (axis, tag) in [Tag::XResolution, Tag::YResolution].into_iter().enumerate() {
            let ratio = unit.zip(pages.ratio(tag));
            found.lengths[axis] = ratio.and_then(|(unit, [over, under])| length(unit * under / over));
        }
        if found.unit.is_empty() && millimetres.is_some() {
            "mm".clone_into(&mut found.unit);
        }
        Ok(found)
    }

    /// Width and height of a pixel, where they are stated.
    pub(super) fn width(&self) -> Option<[f64; 2]> {
        let [x, y, _] = self.lengths;
        x.map(|x| [x, y.unwrap_or(x)])
    }

    /// How so many pages of so many numbers a pixel are slices, channels and times.
    pub(super) fn planes(&self, pages: u64, numbers: u64) -> Result<Planes, ReadError> {
        match self.stated {
            Stated::Nothing => Ok(Planes::nested(OF_IMAGEJ, Counts { slices: pages, channels: 1, times: 1 }, false)),
            Stated::ByImageJ(counts) => Ok(Planes::nested(OF_IMAGEJ, counts, true)),
            Stated::ByOme(counts, order) => {
                // Numbers of a pixel are channels too.
                let is_shared = counts.channels.is_multiple_of(numbers);
                let channels = if is_shared { counts.channels / numbers } else { counts.channels };
                let axis = |letter: char| match letter {
                    'Z' => Some(Axis::Slice),
                    'C' => Some(Axis::Channel),
                    'T' => Some(Axis::Time),
                    _ => None,
                };
                let mut sorted = order;
                sorted.sort_unstable();
                let [Some(first), Some(second), Some(third)] = order.map(axis) else {
                    return Err(unknown_order(order));
                };
                if sorted != ['C', 'T', 'Z'] {
                    return Err(unknown_order(order));
                }
                Ok(Planes::nested(Order([first, second, third]), Counts { channels, ..counts }, false))
            }
        }
    }

    /// The steps between voxels, and what is told of them.
    pub(super) fn steps(&self, notes: &mut Notes) -> DVec3 {
        let [x, y, z] = self.lengths;
        let width = x.or(y);
        let steps = DVec3::new(x.or(y).unwrap_or(1.0), y.or(x).unwrap_or(1.0), z.or(width).unwrap_or(1.0));
        let unit = escaped(self.unit.as_bytes(), 20);
        notes.unit = (!unit.is_empty() && width.is_some()).then(|| unit.clone());
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let [x, y, depth] = steps.to_array().map(rounded);
        notes.remark(match (width, z) {
            (_, Some(_)) => format!("voxels of {x} x {y} x {depth}{unit}, as the file says"),
            (Some(_), None) => format!(
                "voxels of {x} x {y}{unit} by the resolution of the pages, and as deep as wide: `voxel_size` of an object, `spacing` of ImageJ (Image > Properties in Fiji) or PhysicalSizeZ of OME states the step between slices"
            ),
            (None, None) => "voxels of 1 x 1 x 1: no step is stated, as `voxel_size` of an object, `spacing` and `unit` of ImageJ (Image > Properties in Fiji) or PhysicalSizeX, Y and Z of OME do".to_owned(),
        });
        steps
    }
}

/// A length that is believed.
fn length(length: f64) -> Option<f64> {
    (1.0 / FARTHEST..=FARTHEST).contains(&length).then_some(length)
}

fn unknown_order(order: [char; 3]) -> ReadError {
    let found = escaped(order.iter().collect::<String>().as_bytes(), 12);
    ReadError::input(Place::File, "a DimensionOrder that begins with XY and has Z, C and T", format!("XY{found}"), HINT)
}

/// Lines of ImageJ.
fn of_imagej(text: &str) -> Result<Description, ReadError> {
    let value = |key: &str| {
        text.lines().filter_map(|line| line.split_once('=')).find(|(k, _)| k.trim() == key).map(|(_, v)| v.trim())
    };
    let count = |key: &str| -> Result<Option<u64>, ReadError> {
        let Some(text) = value(key) else { return Ok(None) };
        let count = text.parse().ok().filter(|count| *count > 0);
        let found = format!("'{}'", escaped(text.as_bytes(), 20));
        count
            .map(Some)
            .ok_or_else(|| ReadError::input(Place::File, format!("a number above 0 as `{key}` of ImageJ"), found, HINT))
    };
    let images = count("images")?.unwrap_or(1);
    let [channels, slices, times] = [count("channels")?, count("slices")?, count("frames")?];
    let counts = match (slices, channels, times) {
        (None, None, None) => Counts { slices: images, channels: 1, times: 1 },
        (slices, channels, times) => {
            Counts { slices: slices.unwrap_or(1), channels: channels.unwrap_or(1), times: times.unwrap_or(1) }
        }
    };
    if counts.planes() != Some(images) {
        let Counts { slices, channels, times } = counts;
        let expected = format!("{images} images, as the description of the first page says");
        let found = format!("{slices} slices of {channels} channels at {times} times");
        return Err(ReadError::input(Place::File, expected, found, HINT));
    }
    let spacing = value("spacing").and_then(|spacing| spacing.parse::<f64>().ok());
    // Its programs write a step that is negative where the stack runs the other way.
    let spacing = spacing.and_then(|spacing| length(spacing.abs()));
    // The letter µ is written as an escape.
    let unit = value("unit").unwrap_or_default().replace("\\u00B5", "µ");
    let unit = if ["pixel", "pixels"].contains(&unit.as_str()) { String::new() } else { unit };
    Ok(Description { stated: Stated::ByImageJ(counts), lengths: [None, None, spacing], unit, channels: Vec::new() })
}

/// The text of OME.
fn of_ome(text: &str) -> Result<Description, ReadError> {
    let document = xml::parse(text.trim_end(), MOST_NODES).map_err(|e| {
        let found = escaped(e.found.as_bytes(), 120);
        ReadError::input(Place::File, format!("{} as the description by OME", e.expected), found, HINT)
    })?;
    let images: Vec<Node<'_, '_>> = document.descendants().filter(|node| node.has_tag_name_of("Pixels")).collect();
    let &[pixels] = images.as_slice() else {
        let hint = "save each image of it as a file, such as with Fiji (Bio-Formats opens one of them)";
        let found = format!("{} of them", images.len());
        return Err(ReadError::input(Place::File, "one image in the description by OME", found, hint));
    };
    let wrong = |name: &str| {
        let found = format!("'{}'", escaped(pixels.attribute(name).unwrap_or_default().as_bytes(), 20));
        ReadError::input(Place::File, format!("a number above 0 as {name} of OME"), found, HINT)
    };
    let count = |name: &str| match pixels.attribute(name) {
        None => Ok(1),
        Some(text) => text.trim().parse::<u64>().ok().filter(|count| *count > 0).ok_or_else(|| wrong(name)),
    };
    let size = |name: &str| match pixels.attribute(name) {
        None => Ok(None),
        Some(text) => text.trim().parse::<f64>().ok().and_then(length).map(Some).ok_or_else(|| wrong(name)),
    };
    let order: Vec<char> = pixels.attribute("DimensionOrder").unwrap_or("XYCZT").chars().collect();
    let order: [char; 5] = order.try_into().map_err(|_| unknown_order(['?'; 3]))?;
    let counts = Counts { slices: count("SizeZ")?, channels: count("SizeC")?, times: count("SizeT")? };
    let lengths = [size("PhysicalSizeX")?, size("PhysicalSizeY")?, size("PhysicalSizeZ")?];
    let unit_of = |axis: &str| pixels.attribute(format!("PhysicalSize{axis}Unit").as_str()).unwrap_or("µm");
    let unit = unit_of("X");
    if let Some(other) = ["Y", "Z"].into_iter().map(unit_of).find(|other| *other != unit) {
        let [unit, other] = [unit, other].map(|unit| escaped(unit.as_bytes(), 20));
        let hint = "save it with one unit, such as with Fiji (Image > Properties)";
        return Err(ReadError::input(Place::File, format!("sizes of voxels in one unit, {unit}"), other, hint));
    }
    let channels = pixels.children().filter(|node| node.has_tag_name_of("Channel"));
    let channels = channels.map(|channel| channel.attribute("Name").unwrap_or_default().to_owned()).collect();
    let stated = Stated::ByOme(counts, [order[2], order[3], order[4]]);
    Ok(Description { stated, lengths, unit: unit.to_owned(), channels })
}

/// Elements by their name alone: each version of OME has a namespace.
trait Named {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl Named for Node<'_, '_> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}
