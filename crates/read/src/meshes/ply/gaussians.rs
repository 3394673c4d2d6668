//! 3D Gaussian splats in PLY: as their trainer writes them, and packed as PlayCanvas does.
//!
//! The trainer's file has `f_dc_*` and `f_rest_*` (coefficients of harmonics: all of red, then of green, then of blue), a logit `opacity`,
//! logarithms `scale_*` of deviations and the quaternion `rot_*`, w first. Without `scale_2` they are discs (2D Gaussians). Other programs have
//! `red`, `green` and `blue` in the place of harmonics.

mod packed;

use super::body::{Source, check_count, look, skip_element, skip_list};
use super::header::{Element, GaussianKind, Header, Property, Shape, Type, at_line};
use crate::error::ReadError;
use crate::points::gaussians::{CONSTANT, Gathered, Gaussian, degree_of, exponentials, refused, sigmoid};
use crate::reading::Reading;
use crate::stream::input;
use splat_core::RawPoints;
use splat_core::glam::DVec3;
use splat_core::srgb::encoded;

/// Properties by place, before coefficients beside the constant.
const NAMES: [&str; 14] = [
    "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0", "f_dc_1",
    "f_dc_2",
];
/// The place of the third deviation, which discs have not.
const THIRD: usize = 5;
/// The place of the constant, and the names of colours that may stand there.
const CONSTANT_PLACE: usize = 11;
const COLORS: [&str; 3] = ["red", "green", "blue"];
/// What coefficients are named, with a number behind it.
const REST: &[u8] = b"f_rest_";
/// Most of them: 15 of each colour.
const MOST_REST: usize = 45;

/// The remark on deviations that are not stored as logarithms: none is below 0, and their exponentials are as large as the scene.
const LINEAR: &str = "its Gaussians would be as large as the scene if scale_0 to scale_2 were logarithms: they are taken as the deviations \
    themselves; write natural logarithms";

/// The remark on Gaussians that are as large as the scene, and whose deviations are logarithms by their signs.
const LARGE: &str = "its Gaussians are as large as the scene: scale_0 to scale_2 are read as natural logarithms of deviations, and look like \
    other numbers";

/// Reads all elements of a file of Gaussians.
pub(super) fn read<S: Source>(
    mut source: S,
    header: &Header,
    kind: GaussianKind,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    if kind == GaussianKind::Packed {
        return packed::read(source, header, reading);
    }
    let mut points = None;
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_slice() {
            b"vertex" => points = Some(trained(&mut source, element, reading)?),
            _ => {
                reading.notes.not_used(element.properties.iter().map(|p| p.name.as_slice()));
                skip_element(&mut source, element, reading)?;
            }
        }
    }
    source.finish()?;
    points.ok_or_else(|| {
        ReadError::input(at_line(header.body_line - 1), "an element 'vertex'", "none", "the header is damaged")
    })
}

/// The record of one Gaussian: numbers by the order of [`NAMES`], then coefficients.
struct Slots {
    /// Place of each property in the record; `None` for those that are read over.
    kept: Vec<Option<usize>>,
    degree: u8,
    /// Whether there is no third deviation.
    is_flat: bool,
    /// The stored type of `red`, `green` and `blue`, if these take the place of the constant.
    colors: Option<Type>,
}

impl Slots {
    fn new(element: &Element) -> Result<Self, ReadError> {
        let is_harmonic = element.properties.iter().any(|p| p.name == NAMES[CONSTANT_PLACE].as_bytes());
        let slot = |p: &Property| match p.shape {
            Shape::Scalar(_) => place_of(&p.name, is_harmonic),
            Shape::List { .. } => None,
        };
        let kept: Vec<Option<usize>> = element.properties.iter().map(slot).collect();
        let has = |place: usize| kept.contains(&Some(place));
        let mut color = element.properties.iter().filter(|p| !is_harmonic && p.name == COLORS[0].as_bytes());
        let colors = color.next().and_then(|p| match p.shape {
            Shape::Scalar(kind) => Some(kind),
            Shape::List { .. } => None,
        });
        let is_flat = !has(THIRD);
        if let Some(missing) = (0..NAMES.len()).find(|place| !has(*place) && *place != THIRD) {
            let name = match missing.checked_sub(CONSTANT_PLACE).filter(|_| !is_harmonic) {
                Some(color) => COLORS[color],
                None => NAMES[missing],
            };
            let expected = format!("a property '{name}' of 'vertex'");
            let hint = "a Gaussian has a place, three deviations, a rotation, an opacity and a colour";
            return Err(ReadError::input(at_line(element.line), expected, "none", hint));
        }
        let rest = kept.iter().flatten().filter(|place| **place >= NAMES.len()).count();
        let whole = (0..rest).all(|k| has(NAMES.len() + k)) && rest.is_multiple_of(3);
        let Some(degree) = degree_of(rest / 3).filter(|_| whole) else {
            let expected = "f_rest_0 to f_rest_8, to f_rest_23 or to f_rest_44, or none of them";
            let hint = "coefficients of harmonics of degree 1, 2 or 3, for each colour";
            return Err(ReadError::input(at_line(element.line), expected, format!("{rest} of them"), hint));
        };
        Ok(Self { kept, degree, is_flat, colors })
    }
}

/// The place of a property; colours have one where there are no harmonics.
fn place_of(name: &[u8], is_harmonic: bool) -> Option<usize> {
    if let Some(color) = COLORS.iter().position(|n| !is_harmonic && n.as_bytes() == name) {
        return Some(CONSTANT_PLACE + color);
    }
    if let Some(number) = name.strip_prefix(REST) {
        let number: usize = std::str::from_utf8(number).ok()?.parse().ok()?;
        return (number < MOST_REST).then(|| NAMES.len() + number);
    }
    NAMES.iter().position(|n| n.as_bytes() == name)
}

fn trained<S: Source>(source: &mut S, element: &Element, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let Slots { kept, degree, is_flat, colors } = Slots::new(element)?;
    let mut is_logarithm = false;
    let mut gathered = Gathered::new(element.count as usize, degree, reading.params)?;
    let mut record = [0.0; NAMES.len() + MOST_REST];
    for i in 0..element.count {
        look(i, reading)?;
        read_record(source, element, &kept, &mut record)?;
        let [x, y, z, a, b, c, rw, rx, ry, rz, logit, red, green, blue, rest @ ..] = &record;
        is_logarithm |= [a, b, c].into_iter().any(|scale| *scale < 0.0);
        let mut deviation = exponentials(DVec3::new(*a, *b, *c));
        if is_flat {
            deviation.z = 0.0;
        }
        let constant = match colors {
            None => [*red, *green, *blue],
            Some(kind) => [*red, *green, *blue].map(|c| (displayed(c, kind) - 0.5) / CONSTANT),
        };
        let gaussian = Gaussian {
            position: DVec3::new(*x, *y, *z),
            deviation,
            rotation: [*rw, *rx, *ry, *rz],
            opacity: sigmoid(*logit),
        };
        let n = (usize::from(degree) + 1).pow(2) - 1;
        let harmonic = |k: usize| match k {
            0 => constant,
            k => [0, 1, 2].map(|c| rest[c * n + k - 1]),
        };
        gathered.push(&gaussian, (0..n + 1).map(harmonic)).map_err(|wrong| refused(source.place(), i, wrong))?;
        source.end_record()?;
    }
    let unused = element.properties.iter().zip(&kept).filter(|(_, slot)| slot.is_none());
    reading.notes.not_used(unused.map(|(p, _)| p.name.as_slice()));
    if gathered.are_as_large_as_all() {
        if is_logarithm {
            reading.notes.remark(LARGE);
        } else {
            gathered.take_logarithms();
            reading.notes.remark(LINEAR);
        }
    }
    gathered.finish(at_line(element.line))
}

/// The displayed number of a stored colour: whole numbers are sRGB, fractions linear.
fn displayed(stored: f64, kind: Type) -> f64 {
    match kind {
        Type::F32 | Type::F64 => encoded(stored.max(0.0)),
        Type::U16 => stored / 65_535.0,
        _ => stored / 255.0,
    }
}

/// The numbers of the next record whose properties have slots; its end is the caller's to ask for.
fn read_record<S: Source>(
    source: &mut S,
    element: &Element,
    slots: &[Option<usize>],
    record: &mut [f64],
) -> Result<(), ReadError> {
    source.begin_record()?;
    for (property, slot) in element.properties.iter().zip(slots) {
        match property.shape {
            Shape::Scalar(kind) => {
                let value = source.number(kind)?;
                slot.iter().for_each(|slot| record[*slot] = value);
            }
            Shape::List { count, item } => skip_list(source, count, item)?,
        }
    }
    Ok(())
}

/// All numbers of an element whose properties have these names, row by row, in the order of the names, each as `of` keeps it.
fn table<S: Source, T>(
    source: &mut S,
    element: &Element,
    names: &[&str],
    convert: fn(f64) -> T,
    reading: &mut Reading<'_>,
) -> Result<Vec<T>, ReadError> {
    let place = |p: &Property| names.iter().position(|n| n.as_bytes() == p.name);
    let slots: Vec<Option<usize>> = element.properties.iter().map(place).collect();
    if let Some(missing) = (0..names.len()).find(|k| !slots.contains(&Some(*k))) {
        let expected = format!("a property '{}' of '{}'", names[missing], splat_core::text::escaped(&element.name, 40));
        let hint = "the header is damaged, or of a later kind";
        return Err(ReadError::input(at_line(element.line), expected, "none", hint));
    }
    let unused = element.properties.iter().zip(&slots).filter(|(_, slot)| slot.is_none());
    reading.notes.not_used(unused.map(|(p, _)| p.name.as_slice()));
    let mut numbers = Vec::new();
    let each = (size_of::<T>() * names.len()) as u64;
    let what = format!("the packed element '{}'", splat_core::text::escaped(&element.name, 40));
    input::hold(&what, element.count.saturating_mul(each), reading.params)?;
    input::reserve(&mut numbers, element.count as usize * names.len())?;
    let mut row = vec![0.0; names.len()];
    for i in 0..element.count {
        look(i, reading)?;
        read_record(source, element, &slots, &mut row)?;
        source.end_record()?;
        numbers.extend(row.iter().map(|v| convert(*v)));
    }
    Ok(numbers)
}
