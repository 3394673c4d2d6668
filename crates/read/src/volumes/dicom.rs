//! DICOM: a series of slices, a file each in one folder, or frames of one file that says where each lies → a volume in right, anterior, superior, of the values that slope and intercept make of the numbers
//! (of CT these are Hounsfield units).
//!
//! Slices lie where `ImagePositionPatient` says; they have to lie at equal steps along a line, which may be tilted. The parser is written here because
//! `dicom-object` 0.10 takes up to 4 GiB for a damaged length.

mod elements;

use super::lattice;
use crate::ReadParams;
use crate::error::{Fault, Place, ReadError};
use crate::format::folder::{check_inside, files};
use crate::points::extras::LONGEST_NAME;
use crate::reading::Reading;
use crate::stream::input::{self, Stream};
use crate::volumes::selection::Selection;
pub(crate) use elements::is_dicom;
use elements::{CONVERT, DAMAGED, Elements, Packing, Tag};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};
use splat_core::text::{counted, escaped};
use std::path::{Path, PathBuf};

const HINT: &str = "convert the series, such as with `dcm2niix FOLDER`, which writes NIfTI";

/// How the axes of a patient in DICOM, to the left and to the back, point along right, anterior and superior.
const SIGNS: DVec3 = DVec3::new(-1.0, -1.0, 1.0);
/// How far a slice may lie from its place between the others, over the step: positions are written with few digits.
const SAME_PLACE: f64 = 0.02;
/// How far directions of slices may differ, over their length.
const SAME_DIRECTION: f64 = 1e-3;
/// How far a slice may lie from the line of the others, over the step.
const OFF_LINE: f64 = 0.1;
/// Sine of the tilt from which it is told.
const TILT: f64 = 1e-3;
/// Most pixels along a side.
const LONGEST: u16 = 16384;
/// Bytes that tell the format.
const HEAD: usize = 132;
/// The first bytes of gzip, in which a slice may lie.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// Bytes of memory that a frame takes, and that what is found in a group takes for each of its bytes.
const BYTES_OF_A_FRAME: u64 = 2 * BYTES_OF_A_SLICE;
const MOST_OF_AN_ELEMENT: u64 = 6;
/// Bytes of memory that a slice takes until its numbers are read.
const BYTES_OF_A_SLICE: u64 = 512;
/// Most frames of a file.
const MOST_FRAMES: usize = 1 << 16;
/// Most series that are named.
const MOST_NAMED: usize = 8;

const DESCRIPTION: Tag = Tag(0x08, 0x103e);
/// Groups of what all frames of a file share, and of each frame; sequences within a group.
const SHARED: Tag = Tag(0x5200, 0x9229);
const PER_FRAME: Tag = Tag(0x5200, 0x9230);
const PLANE_POSITION: Tag = Tag(0x20, 0x9113);
const PLANE_ORIENTATION: Tag = Tag(0x20, 0x9116);
const PIXEL_MEASURES: Tag = Tag(0x28, 0x9110);
const VALUES: Tag = Tag(0x28, 0x9145);
const SERIES: Tag = Tag(0x20, 0x0e);
const NUMBER: Tag = Tag(0x20, 0x13);
const POSITION: Tag = Tag(0x20, 0x32);
const ORIENTATION: Tag = Tag(0x20, 0x37);
const SAMPLES: Tag = Tag(0x28, 0x02);
const MEANING: Tag = Tag(0x28, 0x04);
const FRAMES: Tag = Tag(0x28, 0x08);
const ROWS: Tag = Tag(0x28, 0x10);
const COLUMNS: Tag = Tag(0x28, 0x11);
const SPACING: Tag = Tag(0x28, 0x30);
const ALLOCATED: Tag = Tag(0x28, 0x100);
const STORED: Tag = Tag(0x28, 0x101);
const HIGHEST: Tag = Tag(0x28, 0x102);
const IS_SIGNED: Tag = Tag(0x28, 0x103);
const INTERCEPT: Tag = Tag(0x28, 0x1052);
const SLOPE: Tag = Tag(0x28, 0x1053);

/// What a file says of its slice.
#[derive(Debug, Clone)]
struct Slice {
    file: PathBuf,
    series: String,
    description: String,
    number: i64,
    columns: u16,
    rows: u16,
    position: DVec3,
    /// Steps from column to column and from row to row.
    along_row: DVec3,
    along_column: DVec3,
    is_inverted: bool,
    /// The rank of its frame in the file, and how many that has.
    frame: usize,
    frames: usize,
    slope: f64,
    intercept: f64,
}

/// The slices of a file, or why it has none that can be read: it matters where its series is the one that is drawn.
#[derive(Default)]
struct OfFile {
    slices: Vec<Slice>,
    refused: Option<Refused>,
}

/// A file with a picture that cannot be read as a slice.
struct Refused {
    series: String,
    description: String,
    error: ReadError,
}

/// How its numbers are stored.
struct Numbers {
    bytes: usize,
    /// Bits of a number, and bits below them.
    bits: u32,
    below: u32,
    is_signed: bool,
}

/// Reads the series of a folder that `params` name, else the one of most slices; of a file its own.
pub(crate) fn read(folder: &Path, named: Option<&Path>, reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
    let mut slices: Vec<Slice> = Vec::new();
    let mut refused: Vec<Refused> = Vec::new();
    let mut series_of_file = None;
    for file in files(folder)? {
        reading.go_on()?;
        let is_named = named.is_some_and(|named| named.file_name() == file.file_name());
        if !is_named && check_inside(folder, &file).is_err() {
            reading.notes.not_used([format!("file {}, a link out of the folder", name(&file)).as_bytes()]);
            continue;
        }
        input::hold("the slices", ((slices.len() + refused.len()) as u64 + 1) * BYTES_OF_A_SLICE, reading.params)?;
        let of_file = with_elements(&file, reading.params, |elements| of_file(&file, elements, reading.params));
        let of_file = of_file.map_err(|e| in_file(&file, e))?;
        let series = of_file.refused.as_ref().map(|refused| &refused.series);
        let Some(series) = of_file.slices.first().map(|slice| &slice.series).or(series) else {
            reading.notes.not_used([format!("file {}", name(&file)).as_bytes()]);
            continue;
        };
        if is_named {
            series_of_file = Some(series.clone());
        }
        slices.extend(of_file.slices);
        refused.extend(of_file.refused);
    }
    if let Some(named) = named.filter(|_| series_of_file.is_none()) {
        let found = format!("'{}', which has none", name(named));
        return Err(ReadError::input(
            Place::File,
            "a DICOM file with a picture and the mark DICM at byte 128",
            found,
            HINT,
        ));
    }
    let slices = of_series(slices, refused, series_of_file, reading)?;
    let slices = of_frame(slices, reading)?;
    let (origin, axes) = placed(&slices, reading)?;
    reading.notes.unit = Some("mm".to_owned());
    let first = &slices[0];
    let dims = [first.columns.into(), first.rows.into(), slices.len()];
    let count = dims[0] * dims[1];
    lattice::check(origin, &axes, Place::File, HINT)?;
    if first.is_inverted {
        reading.notes.remark("low numbers are bright (MONOCHROME1): they are read as they are stored");
    }
    input::hold("a slice", 8 * count as u64, reading.params)?;
    input::hold("the voxels", (4 * count * slices.len()) as u64, reading.params)?;
    let mut values = Vec::new();
    input::reserve(&mut values, count * slices.len())?;
    // Frames of one file are read at once.
    for part in slices.chunk_by(|a, b| a.file == b.file) {
        reading.go_on()?;
        let first = &part[0];
        let read = with_elements(&first.file, reading.params, |elements| {
            let numbers = numbers(elements)?;
            let pixels = elements.pixels(count * first.frames, numbers.bytes)?;
            let bytes = count * numbers.bytes;
            for slice in part {
                let stored = &pixels[slice.frame * bytes..][..bytes];
                values.extend(stored.chunks_exact(numbers.bytes).map(|stored| slice.value(numbers.number(stored))));
            }
            Ok(())
        });
        read.map_err(|e| in_file(&first.file, e))?;
    }
    super::voxels::check_finite(&values, |_| Place::File)?;
    Ok(Grid { origin: SIGNS * origin, axes: DMat3::from_diagonal(SIGNS) * axes, dims, values })
}

/// What is made of the elements of a file, whose memory comes back after it; `T::default()` of a file of another format.
fn with_elements<T: Default>(
    file: &Path,
    params: &ReadParams,
    made: impl FnOnce(&Elements<'_>) -> Result<T, ReadError>,
) -> Result<T, ReadError> {
    let params = ReadParams { memory: params.memory.part(), ..params.clone() };
    let mut stream = Stream::open(file, &params)?;
    if stream.peek(GZIP.len())? == GZIP {
        stream = stream.gunzip();
    }
    if !is_dicom(stream.peek(HEAD)?) {
        return Ok(T::default());
    }
    let content = stream.rest()?;
    made(&Elements::parse(&content)?)
}

/// The slices of a file; what is wrong with one is kept beside its series.
fn of_file(file: &Path, elements: &Elements<'_>, params: &ReadParams) -> Result<OfFile, ReadError> {
    match slices_of(file, elements, params) {
        Ok(slices) => Ok(OfFile { slices, refused: None }),
        Err(error) if error.fault == Fault::Input => {
            let series = elements.text(SERIES).unwrap_or_default();
            let description = elements.text(DESCRIPTION).unwrap_or_default();
            let refused = Some(Refused { series, description, error: in_file(file, error) });
            Ok(OfFile { slices: Vec::new(), refused })
        }
        Err(error) => Err(error),
    }
}

/// The slices of a file, one for each of its frames; none of one without a picture.
fn slices_of(file: &Path, elements: &Elements<'_>, params: &ReadParams) -> Result<Vec<Slice>, ReadError> {
    if !elements.has_pixels() {
        return Ok(Vec::new());
    }
    elements.check_packing()?;
    let missing = |what: &str| ReadError::input(Place::File, what, "none, or another one", HINT);
    let meaning = elements.text(MEANING).unwrap_or_default();
    let is_grey = elements.short(SAMPLES).is_none_or(|samples| samples == 1) && meaning.starts_with("MONOCHROME");
    if !is_grey {
        let found = format!("{} as PhotometricInterpretation", escaped(meaning.as_bytes(), 20));
        return Err(ReadError::input(Place::File, "one number a pixel", found, HINT));
    }
    let side = |tag| elements.short(tag).filter(|side| (1..=LONGEST).contains(side));
    let columns = side(COLUMNS).ok_or_else(|| missing("Columns from 1 to 16384"))?;
    let rows = side(ROWS).ok_or_else(|| missing("Rows from 1 to 16384"))?;
    let frames = match elements.text(FRAMES) {
        None => 1,
        Some(text) => text.parse().ok().filter(|frames| (1..=MOST_FRAMES).contains(frames)).ok_or_else(|| {
            let found = format!("'{}'", escaped(text.as_bytes(), 12));
            ReadError::input(Place::File, format!("1 to {MOST_FRAMES} frames"), found, DAMAGED)
        })?,
    };
    let stored = numbers(elements)?;
    if frames > 1 && elements.packing != Packing::None {
        let hint = "unpack it: `gdcmconv --raw IN OUT`";
        return Err(ReadError::input(
            Place::File,
            "one frame a file, or frames that are not packed",
            "packed frames",
            hint,
        ));
    }
    elements.check_room(usize::from(columns) * usize::from(rows) * frames, stored.bytes)?;
    let groups = (elements.bytes_of(SHARED) + elements.bytes_of(PER_FRAME)) as u64;
    input::hold("the frames", frames as u64 * BYTES_OF_A_FRAME + MOST_OF_AN_ELEMENT * groups, params)?;
    let shared = elements.items(SHARED, 1)?;
    let of_frames = elements.items(PER_FRAME, frames)?;
    if frames > 1 && of_frames.len() != frames {
        let expected = format!("the place of each of {frames} frames (PerFrameFunctionalGroupsSequence)");
        return Err(ReadError::input(Place::File, expected, format!("{} of them", of_frames.len()), HINT));
    }
    let slice = Slice {
        file: file.to_owned(),
        series: elements.text(SERIES).unwrap_or_default(),
        description: elements.text(DESCRIPTION).unwrap_or_default(),
        number: elements.text(NUMBER).and_then(|number| number.parse().ok()).unwrap_or(0),
        columns,
        rows,
        position: DVec3::ZERO,
        along_row: DVec3::ZERO,
        along_column: DVec3::ZERO,
        is_inverted: meaning == "MONOCHROME1",
        frame: 0,
        frames,
        slope: 1.0,
        intercept: 0.0,
    };
    let each = |frame: usize| {
        let groups: Vec<&Elements<'_>> = of_frames.get(frame).into_iter().chain(&shared).collect();
        // Of several frames the number in the series is that of their order.
        let number = if frames > 1 { frame as i64 } else { slice.number };
        placed_frame(Slice { frame, number, ..slice.clone() }, elements, &groups)
    };
    (0..frames).map(each).collect()
}

/// The slice with what its frame's groups say of it, or those of all frames, or the file.
fn placed_frame(slice: Slice, elements: &Elements<'_>, groups: &[&Elements<'_>]) -> Result<Slice, ReadError> {
    let missing = |what: &str| ReadError::input(Place::File, what, "none, or another one", HINT);
    let position = said(elements, groups, PLANE_POSITION, POSITION)?;
    let position = position.ok_or_else(|| missing("three numbers of ImagePositionPatient"))?;
    let orientation = said(elements, groups, PLANE_ORIENTATION, ORIENTATION)?;
    let [a, b, c, d, e, f] = orientation.ok_or_else(|| missing("six numbers of ImageOrientationPatient"))?;
    let [row, column] = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
    let is_square =
        [row.length(), column.length()].iter().all(|n| (n - 1.0).abs() < 0.01) && row.dot(column).abs() < 0.01;
    if !is_square {
        return Err(missing("two directions at right angles as ImageOrientationPatient"));
    }
    let spacing = said(elements, groups, PIXEL_MEASURES, SPACING)?;
    let [between_rows, between_columns] = spacing.ok_or_else(|| missing("two numbers of PixelSpacing"))?;
    if !(between_rows > 0.0 && between_columns > 0.0) {
        return Err(missing("a PixelSpacing above 0"));
    }
    let scaling = |tag, usual| match said(elements, groups, VALUES, tag)? {
        Some([number]) => Ok(number),
        None if elements.text(tag).is_none() => Ok(usual),
        None => {
            Err(ReadError::input(Place::File, "a finite RescaleSlope and RescaleIntercept", "another text", DAMAGED))
        }
    };
    Ok(Slice {
        position: DVec3::from_array(position),
        along_row: row * between_columns,
        along_column: column * between_rows,
        slope: scaling(SLOPE, 1.0)?,
        intercept: scaling(INTERCEPT, 0.0)?,
        ..slice
    })
}

/// So many numbers of an element: of the first of some groups that has it in a sequence, else of the file.
fn said<const N: usize>(
    elements: &Elements<'_>,
    groups: &[&Elements<'_>],
    sequence: Tag,
    tag: Tag,
) -> Result<Option<[f64; N]>, ReadError> {
    for group in groups {
        if let Some(item) = group.items(sequence, 1)?.first()
            && let Some(numbers) = item.numbers(tag)
        {
            return Ok(Some(numbers));
        }
    }
    Ok(elements.numbers(tag))
}

/// How the numbers of a file are stored.
fn numbers(elements: &Elements<'_>) -> Result<Numbers, ReadError> {
    let allocated = elements.short(ALLOCATED).unwrap_or(0);
    let bits = elements.short(STORED).unwrap_or(allocated);
    let highest = elements.short(HIGHEST).unwrap_or(bits.saturating_sub(1));
    let is_whole = [8, 16, 32].contains(&allocated) && (1..=allocated).contains(&bits);
    if allocated == 1 {
        let hint = "convert it to NRRD, such as with `segimage2itkimage` of dcmqi or with 3D Slicer";
        return Err(ReadError::input(
            Place::File,
            "numbers of 8, 16 or 32 bits",
            "a segmentation of 1 bit a pixel",
            hint,
        ));
    }
    if !(is_whole && highest < allocated && highest + 1 >= bits) {
        let hint = if allocated == 0 { DAMAGED } else { CONVERT };
        let found = format!("{bits} of {allocated}, the highest {highest}");
        return Err(ReadError::input(Place::File, "bits of a number within 8, 16 or 32", found, hint));
    }
    let is_signed = elements.short(IS_SIGNED) == Some(1);
    let below = u32::from(highest + 1 - bits);
    Ok(Numbers { bytes: usize::from(allocated / 8), bits: bits.into(), below, is_signed })
}

impl Numbers {
    /// A stored number.
    fn number(&self, stored: &[u8]) -> f64 {
        let whole = stored.iter().rev().fold(0u64, |n, byte| n << 8 | u64::from(*byte));
        // To the top of the word and back, which leaves out other bits and continues the sign.
        let top = whole << (64 - self.bits - self.below);
        if self.is_signed { (top.cast_signed() >> (64 - self.bits)) as f64 } else { (top >> (64 - self.bits)) as f64 }
    }
}

impl Slice {
    /// Its file, and its frame where that has several.
    fn shown(&self) -> String {
        let file = name(&self.file);
        if self.frames == 1 { file } else { format!("{file}, frame {}", self.frame + 1) }
    }

    /// The value of a stored number.
    fn value(&self, number: f64) -> f32 {
        (number * self.slope + self.intercept) as f32
    }
}

/// The slices of the series that is asked for.
fn of_series(
    slices: Vec<Slice>,
    refused: Vec<Refused>,
    series_of_file: Option<String>,
    reading: &mut Reading<'_>,
) -> Result<Vec<Slice>, ReadError> {
    let mut series: Vec<(String, String, usize)> = Vec::new();
    for slice in &slices {
        match series.iter_mut().find(|(known, _, _)| *known == slice.series) {
            Some((_, _, count)) => *count += 1,
            None => series.push((slice.series.clone(), slice.description.clone(), 1)),
        }
    }
    for Refused { series: uid, description, .. } in &refused {
        if !series.iter().any(|(known, _, _)| known == uid) {
            series.push((uid.clone(), description.clone(), 0));
        }
    }
    // Those of most slices first, in the order of their names where they are alike.
    series.sort_by(|a, b| (b.2, &a.0).cmp(&(a.2, &b.0)));
    let told = |(uid, description, count): &(String, String, usize)| {
        let description = escaped(description.as_bytes(), LONGEST_NAME);
        let count = if *count == 0 { "refused".to_owned() } else { counted(*count as u64, "slice") };
        format!("{} ({description}, {count})", escaped(uid.as_bytes(), 64))
    };
    let offered = || series.iter().take(MOST_NAMED).map(told).collect::<Vec<_>>().join(", ");
    let asked = reading.params.array.as_ref();
    let found = series.iter().find(|(uid, description, _)| match (asked, &series_of_file) {
        (Some(asked), _) => asked == uid || asked == description,
        (None, Some(named)) => named == uid,
        (None, None) => true,
    });
    let Some(chosen) = found else {
        let Some(asked) = asked else {
            return Err(ReadError::input(Place::File, "slices of DICOM", "none", HINT));
        };
        let found = format!("'{}'", escaped(asked.as_bytes(), 64));
        return Err(ReadError::input(
            Place::File,
            format!("a series among {}", offered()),
            found,
            "choose one of these",
        ));
    };
    let uid = chosen.0.clone();
    let (of_chosen, of_others): (Vec<_>, Vec<_>) = refused.into_iter().partition(|refused| refused.series == uid);
    if let Some(Refused { error, .. }) = of_chosen.into_iter().next() {
        return Err(error);
    }
    for Refused { error, .. } in of_others.iter().take(MOST_NAMED) {
        let named = format!(
            "another series is left out, as it is no volume: expected {}, found {}",
            error.expected, error.found
        );
        reading.notes.remark(named);
    }
    if let Some(further) = of_others.len().checked_sub(MOST_NAMED).filter(|further| *further > 0) {
        reading.notes.remark(format!("{} more of other series are left out", counted(further as u64, "file")));
    }
    if series.len() > 1 {
        let others: Vec<String> = series.iter().filter(|one| one.0 != chosen.0).take(MOST_NAMED).map(told).collect();
        let others = others.join(", ");
        reading.notes.remark(format!(
            "series {} is drawn; `array` of a scene or --color-by chooses another: {others}",
            told(chosen)
        ));
    } else {
        reading.notes.remark(format!("series {}", told(chosen)));
    }
    Ok(slices.into_iter().filter(|slice| slice.series == uid).collect())
}

/// The slices of one time, in their order along the normal: where several lie at each place, they are a series of times.
fn of_frame(mut slices: Vec<Slice>, reading: &mut Reading<'_>) -> Result<Vec<Slice>, ReadError> {
    let first = slices[0].clone();
    let alike = |slice: &Slice| {
        let near = |a: DVec3, b: DVec3| a.distance(b) <= SAME_DIRECTION * a.length();
        [slice.columns, slice.rows] == [first.columns, first.rows]
            && near(first.along_row, slice.along_row)
            && near(first.along_column, slice.along_column)
    };
    if let Some(other) = slices.iter().find(|slice| !alike(slice)) {
        let expected = format!("slices of one size, spacing and direction, as '{}' has them", first.shown());
        return Err(ReadError::input(Place::File, expected, format!("others in '{}'", other.shown()), HINT));
    }
    let normal = first.along_row.cross(first.along_column).normalize_or_zero();
    let depth = |slice: &Slice| slice.position.dot(normal);
    slices.sort_by(|a, b| depth(a).total_cmp(&depth(b)).then(a.number.cmp(&b.number)).then(a.file.cmp(&b.file)));
    let thickness = first.along_row.length();
    let mut places: Vec<Vec<Slice>> = Vec::new();
    for slice in slices {
        match places.last_mut().filter(|place| depth(&slice) - depth(&place[0]) <= 1e-4 * thickness) {
            Some(place) => place.push(slice),
            None => places.push(vec![slice]),
        }
    }
    let times = places[0].len();
    if let Some(other) = places.iter().find(|place| place.len() != times) {
        let more = if other.len() > times { other } else { &places[0] };
        let [a, b] = [&more[0], more.last().unwrap_or(&more[0])].map(|slice| slice.shown());
        let expected = "one slice at each place, or as many at each";
        return Err(ReadError::input(Place::File, expected, format!("'{a}' and '{b}' at one place"), HINT));
    }
    let frame = Selection::of_frames(times as u64, Place::File, reading.params, &mut reading.notes)?.frame as usize;
    Ok(places.into_iter().map(|mut place| place.swap_remove(frame)).collect())
}

/// Where the slices lie: the place of the first voxel and the steps, in the directions of DICOM.
fn placed(slices: &[Slice], reading: &mut Reading<'_>) -> Result<(DVec3, DMat3), ReadError> {
    let [first, .., last] = slices else {
        let hint = "name the folder in which the other slices of the series lie";
        return Err(ReadError::input(Place::File, "two slices or more", "one", hint));
    };
    let gaps: Vec<f64> = slices.windows(2).map(|pair| pair[1].position.distance(pair[0].position)).collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    if let Some(i) = gaps.iter().position(|gap| (gap - usual).abs() > SAME_PLACE * usual) {
        let [a, b] = [&slices[i], &slices[i + 1]].map(|slice| slice.shown());
        let found = format!("{} between '{a}' and '{b}'", super::rounded(gaps[i]));
        let expected = format!("slices at equal steps of {}", super::rounded(usual));
        let hint = "fetch the slices that are missing, or convert the series with dcm2niix";
        return Err(ReadError::input(Place::File, expected, found, hint));
    }
    let step = (last.position - first.position) / gaps.len() as f64;
    let is_off =
        |(i, slice): &(usize, &Slice)| slice.position.distance(first.position + step * *i as f64) > OFF_LINE * usual;
    if let Some((_, other)) = slices.iter().enumerate().find(is_off) {
        let found = format!("'{}' beside it", other.shown());
        return Err(ReadError::input(Place::File, "slices along one line", found, HINT));
    }
    let normal = first.along_row.cross(first.along_column).normalize_or_zero();
    let sine = (step - normal * step.dot(normal)).length() / step.length();
    if sine > TILT {
        let degrees = super::rounded(libm::asin(sine.min(1.0)).to_degrees());
        reading.notes.remark(format!("slices are tilted by {degrees} degrees, as by a gantry: voxels are sheared"));
    }
    reading.notes.remark("space: left-posterior-superior, converted to right-anterior-superior");
    Ok((first.position, DMat3::from_cols(first.along_row, first.along_column, step)))
}

/// The error of one file, which names it.
fn in_file(file: &Path, error: ReadError) -> ReadError {
    if error.fault == crate::Fault::Cancelled {
        return error;
    }
    let expected = format!("the slice '{}': {}", name(file), error.expected);
    ReadError { expected, ..error }
}

fn name(path: &Path) -> String {
    path.file_name().map(|name| escaped(name.as_encoded_bytes(), 60)).unwrap_or_default()
}
