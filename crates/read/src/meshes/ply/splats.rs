//! Rendering-oriented points as `organza convert` writes them: splats, each with all of its attributes.

use super::body::{Source, check_count, look, skip_element};
use super::header::{Comment, Element, Header, Property, Shape, Type, at_line};
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::DVec3;
use splat_core::splat_file::{COLUMNS, PACKED, SplatColumn, VERSION};
use splat_core::text::escaped;
use splat_core::{Cloud, PackedCloud, RawPoints, ReadySplats, Splat};

/// Properties by which a file without a comment of ours is told all the same: some programs leave comments out.
const SIGNATURE: [&[u8]; 3] = [b"cross_section", b"kind", b"radius"];

/// Fewest bytes of a packed splat: its look, place, radius, cross-section and colour.
const LEAST_PACKED: u64 = 13;

const HINT: &str = "write the file anew by `organza convert`, and keep its header as it is";

/// Whether a file holds splats.
pub(super) fn is_of_splats(header: &Header) -> bool {
    let vertex = header.elements.iter().find(|e| e.name == b"vertex");
    let has = |name: &[u8]| vertex.is_some_and(|v| v.properties.iter().any(|p| p.name == name));
    header.comments.iter().any(|c| c.key == b"splats") || SIGNATURE.iter().all(|name| has(name))
}

/// Reads all elements of a file of splats.
pub(super) fn read<S: Source>(
    mut source: S,
    header: &Header,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    let said = Said::new(header)?;
    let mut points = None;
    let is_packed = |element: &Element| element.name == PACKED.as_bytes();
    let has_both = header.elements.iter().any(is_packed) && header.elements.iter().any(|e| e.name == b"vertex");
    if has_both {
        let expected = format!("an element 'vertex' or '{PACKED}'");
        return Err(ReadError::input(at_line(header.body_line - 1), expected, "both", HINT));
    }
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_slice() {
            b"vertex" => points = Some(splats(&mut source, element, &said, reading)?),
            _ if is_packed(element) => points = Some(packed(&mut source, element, &said, reading)?),
            _ => {
                reading.notes.not_used(element.properties.iter().map(|p| p.name.as_slice()));
                skip_element(&mut source, element, reading)?;
            }
        }
    }
    source.finish()?;
    points.ok_or_else(|| ReadError::input(at_line(header.body_line - 1), "an element 'vertex'", "none", HINT))
}

/// What comments say of the splats.
struct Said {
    origin: DVec3,
    cutoffs: Vec<f32>,
}

impl Said {
    fn new(header: &Header) -> Result<Self, ReadError> {
        let comments = |key: &'static [u8]| header.comments.iter().filter(move |comment| comment.key == key);
        let wrong = |comment: &Comment, expected: String| {
            Err(ReadError::input(at_line(comment.line), expected, shown(&comment.rest), HINT))
        };
        let missing = |what: String| Err(ReadError::input(at_line(header.body_line - 1), what, "none", HINT));
        let Some(version) = comments(b"splats").next() else {
            return missing(format!("a comment 'organza splats {VERSION}' in the header"));
        };
        if version.rest != VERSION.as_bytes() {
            let hint = "this version of Organza reads and writes that one: write the file anew by `organza convert`";
            let expected = format!("splats of version {VERSION}");
            return Err(ReadError::input(at_line(version.line), expected, shown(&version.rest), hint));
        }
        let Some(origin) = comments(b"origin").next() else {
            return missing("a comment 'organza origin X Y Z' in the header".into());
        };
        let Some([x, y, z]) = numbers(origin) else { return wrong(origin, "three finite numbers".into()) };
        let mut cutoffs = Vec::new();
        for footprint in comments(b"footprint") {
            match numbers(footprint) {
                Some([id, cutoff]) if id == cutoffs.len() as f64 && (1.0..=8.0).contains(&cutoff) => {
                    cutoffs.push(cutoff as f32);
                }
                _ => return wrong(footprint, format!("footprint {} and its cutoff, from 1 to 8", cutoffs.len())),
            }
        }
        Ok(Self { origin: DVec3::new(x, y, z), cutoffs })
    }

    /// These splats as points.
    fn points(&self, cloud: Cloud, dropped: u64) -> RawPoints {
        let position = cloud.position.clone();
        let ready = ReadySplats { cloud, cutoffs: self.cutoffs.clone() };
        RawPoints { origin: self.origin, position, ready, dropped, ..RawPoints::default() }
    }
}

fn shown(text: &[u8]) -> String {
    format!("'{}'", escaped(text, 60))
}

/// The numbers of a comment, if it has so many and all are finite.
fn numbers<const N: usize>(comment: &Comment) -> Option<[f64; N]> {
    let text = std::str::from_utf8(&comment.rest).ok()?;
    let numbers: Option<Vec<f64>> =
        text.split_ascii_whitespace().map(|word| word.parse().ok().filter(|n: &f64| n.is_finite())).collect();
    numbers?.try_into().ok()
}

/// The column of each property.
fn columns(element: &Element) -> Result<Vec<&'static SplatColumn>, ReadError> {
    let known = |p: &Property| COLUMNS.iter().flat_map(|group| group.columns).find(|c| c.name.as_bytes() == p.name);
    let mut columns = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let Some(column) = known(property) else {
            let expected = "a property of splats, as the header's comments name them";
            return Err(ReadError::input(at_line(property.line), expected, shown(&property.name), HINT));
        };
        let is_whole = |shape: Shape| match shape {
            Shape::Scalar(kind) => Some(kind.integer_range().is_some()),
            Shape::List { .. } => None,
        };
        if is_whole(property.shape) != Some(column.stored.most().is_some()) {
            let kind = if column.stored.most().is_some() { "a whole number" } else { "a float" };
            let expected = format!("{kind} for each '{}'", column.name);
            return Err(ReadError::input(at_line(property.line), expected, "another type", HINT));
        }
        columns.push(column);
    }
    let has = |name: &str| element.properties.iter().any(|p| p.name == name.as_bytes());
    for group in &COLUMNS {
        let first = group.columns.iter().find(|column| has(column.name));
        let missing = group.columns.iter().find(|column| !has(column.name));
        if let (Some(missing), true) = (missing, group.is_there.is_none() || first.is_some()) {
            let found = first.map_or_else(|| "none".to_owned(), |first| format!("'{}' alone", first.name));
            let expected = format!("a property '{}' of 'vertex'", missing.name);
            return Err(ReadError::input(at_line(element.line), expected, found, HINT));
        }
    }
    Ok(columns)
}

fn splats<S: Source>(
    source: &mut S,
    element: &Element,
    said: &Said,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    let columns = columns(element)?;
    let each = (2 * size_of::<Splat>()) as u64;
    input::hold("the splats", element.count.saturating_mul(each), reading.params)?;
    let mut cloud = Cloud::new(said.origin);
    let mut dropped = 0;
    for record in 0..element.count {
        look(record, reading)?;
        source.begin_record()?;
        let mut splat = Splat::default();
        for (property, column) in element.properties.iter().zip(&columns) {
            let Shape::Scalar(kind) = property.shape else { continue };
            let number = source.number(kind)?;
            if column.stored.most().is_some_and(|most| !(0.0..=most).contains(&number)) {
                let most = column.stored.most().unwrap_or_default();
                let expected = format!("{} from 0 to {most} of splat {record}", column.name);
                return Err(ReadError::input(source.place(), expected, source.shown(number), HINT));
            }
            (column.set)(&mut splat, number);
        }
        source.end_record()?;
        if is_valid(&splat, record, source, said, reading)? {
            cloud.push(&splat);
        } else {
            dropped += 1;
        }
    }
    Ok(said.points(cloud, dropped))
}

/// Whether a splat is one, or is to be dropped; else an error with its number.
fn is_valid<S: Source>(
    splat: &Splat,
    record: u64,
    source: &S,
    said: &Said,
    reading: &Reading<'_>,
) -> Result<bool, ReadError> {
    match splat.check() {
        Ok(()) if usize::from(splat.footprint) >= said.cutoffs.len() => {
            let expected = format!("a footprint of splat {record} that a comment of the header states");
            Err(ReadError::input(source.place(), expected, splat.footprint.to_string(), HINT))
        }
        Ok(()) => Ok(true),
        Err(_) if reading.params.drop_invalid => Ok(false),
        Err(e) => {
            let expected = format!("{} of splat {record}: {}", e.attribute, e.expected);
            let hint = "remove the splat, or leave such points out with --drop-invalid";
            Err(ReadError::input(source.place(), expected, e.found, hint))
        }
    }
}

/// Splats that are packed, unpacked.
fn packed<S: Source>(
    source: &mut S,
    element: &Element,
    said: &Said,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    let [Property { shape: Shape::Scalar(kind @ Type::U8), .. }] = element.properties[..] else {
        let expected = format!("one property 'uchar byte' of '{PACKED}'");
        return Err(ReadError::input(at_line(element.line), expected, "others", HINT));
    };
    // A splat of the least bytes that one is packed into becomes a whole one.
    let most = element.count.div_ceil(LEAST_PACKED).saturating_mul(2 * size_of::<Splat>() as u64);
    input::hold("the splats", most.saturating_add(element.count), reading.params)?;
    let mut bytes = Vec::new();
    input::reserve(&mut bytes, element.count as usize)?;
    for record in 0..element.count {
        look(record, reading)?;
        source.begin_record()?;
        bytes.push(source.number(kind)? as u8);
        source.end_record()?;
    }
    let broken = |e: splat_core::Error| ReadError::input(source.place(), "packed splats", e.to_string(), HINT);
    let cloud = PackedCloud::from_bytes(&bytes).map_err(broken)?.unpack();
    if cloud.origin != said.origin {
        let expected = format!("packed splats about the origin that the header states, {:?}", said.origin);
        return Err(ReadError::input(source.place(), expected, format!("{:?}", cloud.origin), HINT));
    }
    let mut kept = Vec::with_capacity(cloud.len());
    for i in 0..cloud.len() {
        if is_valid(&cloud.get(i), i as u64, source, said, reading)? {
            kept.push(i as u32);
        }
    }
    let dropped = (cloud.len() - kept.len()) as u64;
    Ok(said.points(if dropped > 0 { cloud.gather(&kept) } else { cloud }, dropped))
}
