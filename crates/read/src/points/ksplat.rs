//! `.ksplat` of GaussianSplats3D, version 0.1: a header of 4096 bytes, a header of 1024 for each section, then the sections, little endian.
//!
//! At level 0 of compression all numbers of a Gaussian are floats. At levels 1 and 2 a place is three whole numbers of 16 bits around the
//! middle of a bucket, deviations and rotations (w first) are half floats; harmonics are half floats at level 1 and bytes between two bounds
//! at level 2. Colours and opacities are bytes at each level, and harmonics go up to degree 2, all of a degree for red, green, then blue.

use super::gaussians::{CONSTANT, Gathered, Gaussian, refused};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use half::f16;
use splat_core::RawPoints;
use splat_core::glam::DVec3;
use splat_core::text::counted;

/// Bytes of the header, and of that of a section.
const HEADER: usize = 4096;
const SECTION: usize = 1024;
/// Bytes of the middle of a bucket: three floats.
const MIDDLE: usize = 12;
/// Half of the steps of a place, if a section does not state them.
const STEPS: u32 = 32767;
/// Bounds of harmonics in bytes, if the header does not state them.
const BOUND: f32 = 1.5;

const HINT: &str = "the file is truncated or damaged; fetch it again";

/// Where the parts of a Gaussian begin in its record.
struct Layout {
    scale: usize,
    rotation: usize,
    color: usize,
    harmonics: usize,
    /// Bytes of a coefficient of one colour.
    coefficient: usize,
}

/// By level of compression.
const LAYOUTS: [Layout; 3] = [
    Layout { scale: 12, rotation: 24, color: 40, harmonics: 44, coefficient: 4 },
    Layout { scale: 6, rotation: 12, color: 20, harmonics: 24, coefficient: 2 },
    Layout { scale: 6, rotation: 12, color: 20, harmonics: 24, coefficient: 1 },
];

/// Facts of the header.
struct Header {
    sections: usize,
    count: usize,
    level: usize,
    /// Bounds of harmonics in bytes.
    low: f64,
    high: f64,
}

/// A section: where its parts are in the file, and how its numbers are to be read.
struct Section {
    /// Gaussians that it holds.
    count: usize,
    degree: u8,
    /// Gaussians of a full bucket, and how many buckets are full.
    capacity: usize,
    full: usize,
    /// Gaussians of each bucket that is not full.
    partial: Vec<usize>,
    /// The first byte of the middles of buckets.
    middles: usize,
    buckets: usize,
    /// The first byte of Gaussians, and bytes of each.
    records: usize,
    stride: usize,
    steps: u32,
    /// Length of a step.
    step: f64,
}

fn wrong(at: usize, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
    ReadError::input(Place::Byte(at as u64), expected, found, HINT)
}

/// A little-endian word at a byte that the file has.
fn word(content: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([0, 1, 2, 3].map(|b| content[at + b]))
}

fn short(content: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([content[at], content[at + 1]])
}

fn half(content: &[u8], at: usize) -> f64 {
    f16::from_bits(short(content, at)).to_f64()
}

fn float(content: &[u8], at: usize) -> f64 {
    f64::from(f32::from_bits(word(content, at)))
}

/// Reads a `.ksplat` file.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let header = header(content)?;
    let sections = sections(content, &header, reading)?;
    let degree = sections.iter().map(|section| section.degree).max().unwrap_or(0);
    let mut gathered = Gathered::new(header.count, degree, reading.params)?;
    let mut number = 0;
    for section in &sections {
        let mut buckets = Buckets::new(section);
        for i in 0..section.count {
            if i.is_multiple_of(1 << 14) {
                reading.go_on()?;
            }
            let record = section.records + section.stride * i;
            let bucket = buckets.bucket_of(i);
            let gaussian = gaussian(content, &header, section, record, bucket);
            let color = LAYOUTS[header.level].color;
            let constant = [0, 1, 2].map(|c| (f64::from(content[record + color + c]) / 255.0 - 0.5) / CONSTANT);
            let harmonic = |k: usize| match k {
                0 => constant,
                k => [0, 1, 2].map(|c| coefficient(content, &header, section, record, k, c)),
            };
            let terms = (usize::from(degree) + 1).pow(2);
            let taken = gathered.push(&gaussian, (0..terms).map(harmonic));
            taken.map_err(|reason| refused(Place::Byte(record as u64), number, reason))?;
            number += 1;
        }
    }
    gathered.finish(Place::Byte(HEADER as u64))
}

fn header(content: &[u8]) -> Result<Header, ReadError> {
    if content.len() < HEADER {
        return Err(wrong(0, "a header of 4096 bytes", format!("{} bytes", content.len())));
    }
    if content[0] != 0 || content[1] == 0 {
        let hint = "save it anew with a current program, or as PLY, such as with SuperSplat";
        let found = format!("version {}.{}", content[0], content[1]);
        return Err(ReadError::input(Place::Byte(0), "version 0.1 of .ksplat", found, hint));
    }
    let level = usize::from(short(content, 20));
    if level >= LAYOUTS.len() {
        return Err(wrong(20, "a level of compression from 0 to 2", level.to_string()));
    }
    let count = word(content, 16) as usize;
    if count == 0 {
        return Err(wrong(16, "at least one Gaussian", "none"));
    }
    // Zero stands for a bound that is not stated.
    let bound = |at: usize, default: f32| match float(content, at) {
        0.0 => f64::from(default),
        stated => stated,
    };
    Ok(Header { sections: word(content, 4) as usize, count, level, low: bound(36, -BOUND), high: bound(40, BOUND) })
}

/// All sections, each within the file.
fn sections(content: &[u8], header: &Header, reading: &Reading<'_>) -> Result<Vec<Section>, ReadError> {
    let mut at = header.sections.saturating_mul(SECTION).saturating_add(HEADER);
    if at > content.len() {
        let headers = counted(header.sections as u64, "section header");
        let expected = format!("{headers} of 1024 bytes");
        return Err(wrong(HEADER, expected, format!("{} bytes behind the header", content.len() - HEADER)));
    }
    let mut found = Vec::new();
    let mut total = 0usize;
    for k in 0..header.sections {
        reading.go_on()?;
        let head = HEADER + SECTION * k;
        let (section, end) = section(content, head, at, header.level)?;
        at = end;
        total = total.saturating_add(section.count);
        found.push(section);
    }
    if total != header.count {
        return Err(wrong(16, format!("{total} Gaussians, as the sections hold"), header.count.to_string()));
    }
    if at != content.len() {
        return Err(wrong(
            at,
            "the end of the file after the last section",
            format!("{} bytes more", content.len() - at),
        ));
    }
    Ok(found)
}

/// The section whose header begins at byte `head` and whose data begins at byte `at`, and the byte behind it.
fn section(content: &[u8], head: usize, at: usize, level: usize) -> Result<(Section, usize), ReadError> {
    let number = |offset: usize| word(content, head + offset) as usize;
    let [count, room, capacity, buckets] = [0, 4, 8, 12].map(number);
    let full = number(32);
    let partial = number(36);
    let degree = short(content, head + 40);
    if degree > 2 {
        return Err(wrong(head + 40, "harmonics of degree 0 to 2", degree.to_string()));
    }
    if count > room {
        return Err(wrong(head, format!("at most {room} Gaussians, for which there is room"), count.to_string()));
    }
    let width = usize::from(short(content, head + 20));
    if level > 0 && width != MIDDLE {
        return Err(wrong(head + 20, "12 bytes for the middle of a bucket", width.to_string()));
    }
    let terms = (usize::from(degree) + 1).pow(2) - 1;
    let layout = &LAYOUTS[level];
    let stride = layout.harmonics + 3 * terms * layout.coefficient;
    let middles = at as u128 + 4 * partial as u128;
    let records = middles + width as u128 * buckets as u128;
    let end = records + stride as u128 * room as u128;
    if end > content.len() as u128 {
        let expected = format!("{} bytes for {room} Gaussians in {buckets} buckets", end - at as u128);
        return Err(wrong(at, expected, format!("{} bytes", content.len() - at)));
    }
    let partial: Vec<usize> = (0..partial).map(|k| word(content, at + 4 * k) as usize).collect();
    let held = partial.iter().fold(full.saturating_mul(capacity), |sum, n| sum.saturating_add(*n));
    if level > 0 && (full.saturating_add(partial.len()) > buckets || held < count) {
        let expected = format!("{buckets} buckets with {count} Gaussians");
        return Err(wrong(head + 12, expected, format!("{} with {held}", full.saturating_add(partial.len()))));
    }
    let steps = match word(content, head + 24) {
        0 => STEPS,
        stated => stated,
    };
    let step = float(content, head + 16) / 2.0 / f64::from(steps);
    let [middles, records, end] = [middles, records, end].map(|at| at as usize);
    let section = Section {
        count,
        degree: degree as u8,
        capacity,
        full,
        partial,
        middles,
        buckets,
        records,
        stride,
        steps,
        step,
    };
    Ok((section, end))
}

/// The bucket of each Gaussian of a section, in their order.
struct Buckets<'a> {
    section: &'a Section,
    /// The bucket that is not full and has the Gaussian before, and the first Gaussian behind it.
    partial: usize,
    end: usize,
}

impl<'a> Buckets<'a> {
    fn new(section: &'a Section) -> Self {
        let first = section.partial.first().copied().unwrap_or(0);
        Self { section, partial: 0, end: (section.full.saturating_mul(section.capacity)).saturating_add(first) }
    }

    /// The bucket of Gaussian `i`; every one follows the one before.
    fn bucket_of(&mut self, i: usize) -> usize {
        let Section { full, capacity, partial, .. } = self.section;
        if let Some(bucket) = i.checked_div(*capacity).filter(|bucket| bucket < full) {
            return bucket;
        }
        while i >= self.end && self.partial + 1 < partial.len() {
            self.partial += 1;
            self.end = self.end.saturating_add(partial[self.partial]);
        }
        full + self.partial
    }
}

fn gaussian(content: &[u8], header: &Header, section: &Section, record: usize, bucket: usize) -> Gaussian {
    let Layout { scale, rotation, color, .. } = LAYOUTS[header.level];
    let is_whole = header.level == 0;
    // A float, or half of one.
    let number = |start: usize, k: usize| {
        if is_whole { float(content, record + start + 4 * k) } else { half(content, record + start + 2 * k) }
    };
    let place = |k: usize| {
        if is_whole {
            return number(0, k);
        }
        let middle = section.middles + MIDDLE * bucket.min(section.buckets.saturating_sub(1)) + 4 * k;
        let steps = f64::from(short(content, record + 2 * k)) - f64::from(section.steps);
        float(content, middle) + steps * section.step
    };
    Gaussian {
        position: DVec3::from_array([0, 1, 2].map(place)),
        deviation: DVec3::from_array([0, 1, 2].map(|k| number(scale, k))),
        rotation: [0, 1, 2, 3].map(|k| number(rotation, k)),
        opacity: f64::from(content[record + color + 3]) / 255.0,
    }
}

/// Coefficient `k` of one colour, from 1; zero for degrees that the section has not.
fn coefficient(content: &[u8], header: &Header, section: &Section, record: usize, k: usize, c: usize) -> f64 {
    // The first coefficient of the degree, and how many it has.
    let (first, width) = if k < 4 { (1, 3) } else { (4, 5) };
    if k >= (usize::from(section.degree) + 1).pow(2) {
        return 0.0;
    }
    let Layout { harmonics, coefficient, .. } = LAYOUTS[header.level];
    let at = record + harmonics + coefficient * (3 * (first - 1) + width * c + k - first);
    match header.level {
        0 => float(content, at),
        1 => half(content, at),
        _ => header.low + (header.high - header.low) * f64::from(content[at]) / 255.0,
    }
}
