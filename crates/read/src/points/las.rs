//! LAS 1.0 to 1.4 and LAZ → raw points with colours, intensity as value, classes, their exact integers, and what is asked for by name.

mod further;

use super::copc::Levels;
use super::extras::{Extras, UNFIT_HINT};
use super::laz;
use crate::error::{Place, ReadError};
use crate::stream::input;
use crate::stream::input::Content;
use crate::{Notes, ReadParams};
use ::las::point::Format;
use ::las::{PointData, PointDataBuilder, raw};
use splat_core::glam::{DVec3, Vec3};
use splat_core::srgb::linear_from_srgb;
use splat_core::{PointLattice, RawPoints};

/// Points decoded at once: the reader's working memory does not depend on the announced count.
const BLOCK: usize = 1 << 16;
/// Bytes that a point takes in the columns at most.
const BYTES_PER_POINT: u64 = 12 + 12 + 6 + 12 + 4 + 1;
const HINT: &str = "the file is truncated or damaged; fetch it again";
const RECORD_HEADER: usize = 54;
/// The record that describes extra bytes, and the length of one description.
const EXTRA_BYTES: u16 = 4;
const DESCRIPTION: usize = 192;

/// What the checked header says.
pub(crate) struct Layout {
    /// Point format without the compression bits, 0 to 10.
    pub(crate) format_id: u8,
    pub(crate) format: Format,
    pub(crate) count: u64,
    /// The levels of detail that are read, where those are not all.
    pub(crate) levels: Option<Levels>,
    /// Bytes of one uncompressed record.
    pub(crate) record: u64,
    /// First byte of the points.
    pub(crate) points: usize,
    /// First byte of the variable-length records, and their number.
    pub(crate) records: (usize, u32),
    compressed: bool,
    scale: DVec3,
    offset: DVec3,
}

impl Layout {
    /// Points that are read.
    pub(crate) fn read(&self) -> u64 {
        self.levels.as_ref().map_or(self.count, |levels| levels.points)
    }
}

/// Reads a LAS or LAZ file.
pub(crate) fn read(content: Content, params: &ReadParams, notes: &mut Notes) -> Result<RawPoints, ReadError> {
    let mut layout = layout(&content)?;
    if let Some(most) = params.most_points.filter(|most| layout.compressed && *most < layout.count) {
        layout.levels = Levels::within(&content, &layout, most)?;
    }
    if let Some(Levels { points, read, count, .. }) = layout.levels {
        let selection = format!(
            "{points} of {} points, as at most {} are asked for",
            layout.count,
            params.most_points.unwrap_or(points)
        );
        notes.remarks.push(format!("COPC, {read} of {count} levels of detail: {selection}"));
    }
    // What the file cannot hold is its fault, not the limit's.
    let plain = (!layout.compressed).then(|| plain_records(&content, &layout)).transpose()?;
    let fields = further::fields(&layout, described(&content, &layout));
    let ranks = fields.iter().enumerate().map(|(rank, f)| (rank, f.name.as_bytes(), f.is_spare()));
    let mut extras = Extras::new(ranks, params);
    let asked: Vec<usize> = extras.read().collect();
    let selection = further::selection(asked.iter().map(|rank| &fields[*rank]));
    let bytes = BYTES_PER_POINT + extras.bytes_per_point();
    input::hold("the points", layout.read().saturating_mul(bytes), params)?;
    notes.not_used(unused(&content, &layout).iter().map(String::as_bytes));
    let mut columns = Columns::default();
    let mut take = |records: Vec<u8>| {
        let data = PointDataBuilder::new().with_format(layout.format).build_from_bytes(records);
        let data = data.map_err(|e| damaged(layout.points, "whole point records", &e.to_string()))?;
        extras.reserve(data.len())?;
        asked.iter().for_each(|rank| fields[*rank].numbers(&data, |numbers| extras.extend(*rank, numbers)));
        if let Some((expected, found)) = extras.unfit_of_many() {
            return Err(ReadError { hint: UNFIT_HINT, ..damaged(layout.points, expected, found) });
        }
        columns.append(&data, &layout)
    };
    match plain {
        Some(records) => {
            let block = BLOCK * layout.record as usize;
            input::hold("a block of records", block.min(records.len()) as u64, params)?;
            records.chunks(block).try_for_each(|block| take(block.to_vec()))?;
        }
        None => laz::decompress(&content, &layout, params, selection, take)?,
    }
    // Before the columns are converted: the file takes about as much as they do.
    drop(content);
    let points = columns.into_points(&layout)?;
    Ok(RawPoints { columns: extras.finish(notes), ..points })
}

/// Names of the dimensions of its points that are read over.
fn unused(content: &[u8], layout: &Layout) -> Vec<String> {
    let Format { has_gps_time, has_waveform, has_nir, extra_bytes, .. } = layout.format;
    let always = ["return_number", "number_of_returns", "flags", "scan_angle", "user_data", "point_source_id"];
    let some = [(has_gps_time, "gps_time"), (has_nir, "nir"), (has_waveform, "waveform")];
    let mut names: Vec<String> = always.map(str::to_owned).to_vec();
    names.extend(some.iter().filter(|(has, _)| *has).map(|(_, name)| (*name).to_owned()));
    if extra_bytes > 0 {
        let described = extra_names(content, layout);
        names.extend(if described.is_empty() { vec![format!("{extra_bytes} extra bytes")] } else { described });
    }
    names
}

/// Names of the extra dimensions, as far as the file describes them.
fn extra_names(content: &[u8], layout: &Layout) -> Vec<String> {
    let described = described(content, layout).as_chunks::<DESCRIPTION>().0;
    let name = |d: &[u8; DESCRIPTION]| {
        let name = d[4..36].split(|b| *b == 0).next().unwrap_or_default();
        String::from_utf8_lossy(name).into_owned()
    };
    described.iter().map(name).filter(|n| !n.is_empty()).collect()
}

/// The descriptions of the extra dimensions, one behind the other.
fn described<'a>(content: &'a [u8], layout: &Layout) -> &'a [u8] {
    let described = variable_records(content, layout).find(|r| r.user == b"LASF_Spec" && r.id == EXTRA_BYTES);
    described.map_or(&[], |r| r.data)
}

/// A variable-length record before the points.
pub(crate) struct VariableRecord<'a> {
    /// Byte offset of its header.
    pub(crate) at: usize,
    pub(crate) user: &'a [u8],
    pub(crate) id: u16,
    pub(crate) data: &'a [u8],
}

/// The variable-length records between the header and the points, as many as are whole.
pub(crate) fn variable_records<'a>(content: &'a [u8], layout: &Layout) -> impl Iterator<Item = VariableRecord<'a>> {
    let (mut at, count) = layout.records;
    let before_points = &content[..layout.points];
    (0..count).map_while(move |_| {
        let head = before_points.get(at..)?.first_chunk::<RECORD_HEADER>()?;
        let begin = at + RECORD_HEADER;
        let length = usize::from(u16::from_le_bytes([head[20], head[21]]));
        let data = before_points.get(begin..begin + length)?;
        let user = &before_points[at + 2..at + 18];
        let user = user.split(|b| *b == 0).next().unwrap_or_default();
        let record = VariableRecord { at, user, id: u16::from_le_bytes([head[18], head[19]]), data };
        at = begin + length;
        Some(record)
    })
}

fn damaged(byte: usize, expected: &str, found: &str) -> ReadError {
    ReadError::input(Place::Byte(byte as u64), expected, found, HINT)
}

/// Refuses other versions before their header is parsed, whose length may be another.
fn check_version(content: &[u8]) -> Result<(), ReadError> {
    let Some([major, minor]) = content.get(24..26) else { return Ok(()) };
    if *major == 1 && *minor <= 4 {
        return Ok(());
    }
    let hint = "save it as LAS 1.4 from the program that it comes from";
    Err(ReadError { hint, ..damaged(24, "LAS version 1.0 to 1.4", &format!("{major}.{minor}")) })
}

/// Parses the header and checks it against the file.
fn layout(content: &[u8]) -> Result<Layout, ReadError> {
    check_version(content)?;
    let header = raw::Header::read_from(content)
        .map_err(|e| damaged(0, "'LASF' at byte 0 and a complete LAS header", &e.to_string()))?;
    let version = header.version;
    let points = header.offset_to_point_data as usize;
    if header.header_size < version.header_size() || points < usize::from(header.header_size) || points > content.len()
    {
        let found =
            format!("a header of {} bytes, points at {points}, {} bytes in all", header.header_size, content.len());
        return Err(damaged(94, "points after the header, inside the file", &found));
    }
    let stored_id = header.point_data_record_format;
    let format_id = stored_id & 0x3f;
    let compressed = stored_id & 0xc0 != 0;
    let mut format = match Format::new(format_id) {
        Ok(format) if format_id <= 10 && stored_id & 0x40 == 0 => format,
        _ => return Err(damaged(104, "point format 0 to 10, with bit 7 for LAZ", &stored_id.to_string())),
    };
    let record = header.point_data_record_length;
    format.extra_bytes = record
        .checked_sub(format.len())
        .ok_or_else(|| damaged(105, &format!("records of at least {} bytes", format.len()), &record.to_string()))?;
    let (scale, offset) = transform(&header)?;
    Ok(Layout {
        format_id,
        format,
        count: count(&header)?,
        levels: None,
        record: record.into(),
        points,
        records: (header.header_size.into(), header.number_of_variable_length_records),
        compressed,
        scale,
        offset,
    })
}

/// The number of points; the legacy field of a 1.4 file is 0 or agrees.
fn count(header: &raw::Header) -> Result<u64, ReadError> {
    let legacy = u64::from(header.number_of_point_records);
    match header.large_file {
        Some(large) if legacy != 0 && legacy != large.number_of_point_records => {
            let found = format!("{legacy} in the legacy field, {} in the 1.4 field", large.number_of_point_records);
            Err(damaged(107, "one number of points", &found))
        }
        Some(large) => Ok(large.number_of_point_records),
        None => Ok(legacy),
    }
}

fn transform(header: &raw::Header) -> Result<(DVec3, DVec3), ReadError> {
    let scale = DVec3::new(header.x_scale_factor, header.y_scale_factor, header.z_scale_factor);
    let offset = DVec3::new(header.x_offset, header.y_offset, header.z_offset);
    let reach = offset.abs() + scale * 2f64.powi(31);
    if scale.cmpgt(DVec3::ZERO).all() && reach.is_finite() {
        return Ok((scale, offset));
    }
    let expected = "scales > 0 and offsets, all finite";
    Err(damaged(131, expected, &format!("scales {scale}, offsets {offset}")))
}

/// The records of an uncompressed file: all that are announced, and no more than that.
fn plain_records<'a>(content: &'a [u8], layout: &Layout) -> Result<&'a [u8], ReadError> {
    let needed = layout.count.checked_mul(layout.record);
    let stored = &content[layout.points..];
    match needed.and_then(|n| usize::try_from(n).ok()).and_then(|n| stored.get(..n)) {
        Some(records) => {
            let end = layout.points + records.len();
            let spare = first_byte_after_points(content, end) - end;
            if (spare as u64) < layout.record {
                return Ok(records);
            }
            let found = format!("{spare} bytes more than that before the next part of the file");
            let hint = "the header announces fewer points than the file holds: write the file anew, such as with `pdal translate`";
            Err(ReadError { hint, ..damaged(107, &format!("{} points, as the header says", layout.count), &found) })
        }
        None => {
            let whole = stored.len() as u64 / layout.record;
            let found = format!("{whole} in the {} bytes left", stored.len());
            Err(damaged(layout.points, &format!("{} points of {} bytes", layout.count, layout.record), &found))
        }
    }
}

/// Where extended records or waveforms begin behind the points, else the end of the file.
pub(crate) fn first_byte_after_points(content: &[u8], end: usize) -> usize {
    let Ok(header) = raw::Header::read_from(content) else { return content.len() };
    let evlrs = header.evlr.filter(|e| e.number_of_evlrs > 0).map(|e| e.start_of_first_evlr);
    let parts = [evlrs, header.start_of_waveform_data_packet_record];
    let starts = parts.into_iter().flatten().filter_map(|start| usize::try_from(start).ok());
    starts.filter(|start| (end..content.len()).contains(start)).min().unwrap_or(content.len())
}

/// Columns while they are filled.
#[derive(Default)]
struct Columns {
    steps: Vec<[i32; 3]>,
    rgb: Vec<[u16; 3]>,
    value: Vec<f32>,
    classification: Vec<u8>,
}

impl Columns {
    fn append(&mut self, data: &PointData, layout: &Layout) -> Result<(), ReadError> {
        if self.steps.is_empty() {
            // Once some records are there: until then a damaged file may announce what it does not hold.
            let n = layout.read() as usize;
            input::reserve(&mut self.steps, n)?;
            input::reserve(&mut self.value, n)?;
            input::reserve(&mut self.classification, n)?;
            if layout.format.has_color {
                input::reserve(&mut self.rgb, n)?;
            }
        }
        self.steps.extend(data.x_raw().zip(data.y_raw()).zip(data.z_raw()).map(|((x, y), z)| [x, y, z]));
        self.value.extend(data.intensity().map(f32::from));
        self.classification.extend(data.classification());
        if let Some(rgb) = data.rgb() {
            self.rgb.extend(rgb.map(|(r, g, b)| [r, g, b]));
        }
        Ok(())
    }

    /// Positions relative to a lattice point in the middle, so that offsets are small multiples of the scale.
    fn into_points(self, layout: &Layout) -> Result<RawPoints, ReadError> {
        let Self { steps, rgb, value, classification } = self;
        let middle = middle(&steps);
        let origin = layout.offset + layout.scale * DVec3::from_array(middle.map(|m| m as f64));
        let offset_of = |s: &[i32; 3]| {
            let from_middle = [0, 1, 2].map(|a| (i64::from(s[a]) - middle[a]) as f64);
            (layout.scale * DVec3::from_array(from_middle)).as_vec3()
        };
        let mut position: Vec<Vec3> = Vec::new();
        input::reserve(&mut position, steps.len())?;
        position.extend(steps.iter().map(offset_of));
        if let Some(i) = position.iter().position(|p| !p.is_finite()) {
            let found = format!("{} at point {i}", position[i]);
            return Err(damaged(131, "offsets from the middle that fit 32-bit floats", &found));
        }
        let lattice = Some(PointLattice { offset: layout.offset, scale: layout.scale, steps });
        let color = linear_colors(&rgb)?;
        let is_intensity = true;
        Ok(RawPoints { origin, position, color, value, is_intensity, classification, lattice, ..RawPoints::default() })
    }
}

fn middle(steps: &[[i32; 3]]) -> [i64; 3] {
    [0, 1, 2].map(|axis| {
        let low = steps.iter().map(|s| i64::from(s[axis])).min().unwrap_or(0);
        let high = steps.iter().map(|s| i64::from(s[axis])).max().unwrap_or(0);
        (low + high).div_euclid(2)
    })
}

/// sRGB components → linear. Many writers put 8-bit colours into the 16-bit fields: a file without any component above
/// 255 is taken as such.
fn linear_colors(rgb: &[[u16; 3]]) -> Result<Vec<[f32; 3]>, ReadError> {
    let largest = rgb.iter().flatten().copied().max().unwrap_or(0);
    let top = if largest <= 255 { 255.0 } else { 65_535.0 };
    let linear = |c: u16| linear_from_srgb(f64::from(c) / top);
    // The table of a small file would take longer than its colours.
    let entries = if 3 * rgb.len() > usize::from(largest) { 0..=largest } else { 0..=0 };
    let table: Vec<f32> = entries.map(linear).collect();
    let mut color = Vec::new();
    input::reserve(&mut color, rgb.len())?;
    color.extend(rgb.iter().map(|c| c.map(|v| table.get(usize::from(v)).copied().unwrap_or_else(|| linear(v)))));
    Ok(color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_those_of_many() {
        for top in [255, 65_535] {
            let many: Vec<[u16; 3]> = (0..=top).map(|c| [c, top - c, top]).collect();
            let linear = linear_colors(&many).unwrap();
            for c in (0..=top).step_by(51) {
                let few = linear_colors(&[many[usize::from(c)]]).unwrap();
                assert_eq!(few, [linear[usize::from(c)]], "{c} of {top}");
            }
        }
    }
}
