//! The axes of an NRRD file: three of space, and one before or behind them at most.

use super::header::{Fields, wrong};
use crate::error::{Place, ReadError};
use crate::volumes::lattice;
use splat_core::glam::{DMat3, DVec3};
use splat_core::text::escaped;

/// Spaces of three dimensions, their short names, and how their axes point along right, anterior and superior; those of a
/// scanner or of no patient are taken as they are.
const SPACES: [(&str, &str, DVec3); 6] = [
    ("right-anterior-superior", "ras", DVec3::ONE),
    ("left-anterior-superior", "las", DVec3::new(-1.0, 1.0, 1.0)),
    ("left-posterior-superior", "lps", DVec3::new(-1.0, -1.0, 1.0)),
    ("scanner-xyz", "scanner-xyz", DVec3::ONE),
    ("3d-right-handed", "3d-right-handed", DVec3::ONE),
    ("3d-left-handed", "3d-left-handed", DVec3::ONE),
];

/// Kinds of axes along which a volume goes on in space.
const OF_SPACE: [&str; 2] = ["domain", "space"];
/// Kinds along which it goes on otherwise, as a series of volumes.
const OF_SERIES: [&str; 5] = ["list", "time", "none", "???", "stub"];
/// Kinds of the numbers of one voxel that are a colour.
const OF_COLOR: [&str; 4] = ["rgb-color", "rgba-color", "3-color", "4-color"];

/// The axes, those of space in a right-anterior-superior one where the file says how its own lies to it.
#[derive(Debug, Clone)]
pub(super) struct Axes {
    pub(super) sizes: [u64; 3],
    pub(super) place_of_sizes: Place,
    /// The axis that is not one of space.
    pub(super) other: Option<Other>,
    /// Place of voxel (0, 0, 0).
    pub(super) origin: DVec3,
    /// Steps of the lattice.
    pub(super) steps: DMat3,
    /// What the file calls the space that its axes were converted from.
    pub(super) converted_from: Option<&'static str>,
}

/// An axis that is not one of space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Other {
    pub(super) size: u64,
    /// Whether it is the fastest, so that its numbers lie side by side; else it is the slowest.
    pub(super) is_fastest: bool,
    pub(super) meaning: Meaning,
    /// Where the file says so.
    pub(super) place: Place,
}

/// What lies along an axis that is not one of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Volumes of a series.
    Series,
    /// Red, green, blue and perhaps alpha.
    Color,
    /// Components of something else.
    Components,
}

/// The axes that these fields tell of; `end` is where the header ends.
pub(super) fn read(fields: &Fields<'_>, end: Place) -> Result<Axes, ReadError> {
    let (dimension, at) = fields.required("dimension", end)?;
    let rank = match dimension {
        "3" => 3,
        "4" => 4,
        _ => {
            let hint = "extract one volume, or a series of volumes, first";
            return Err(ReadError::input(at, "dimension: 3 or 4", escaped(dimension.as_bytes(), 20), hint));
        }
    };
    let (text, place_of_sizes) = fields.required("sizes", end)?;
    let sizes: Vec<u64> = text.split_ascii_whitespace().map_while(|w| w.parse().ok()).filter(|n| *n > 0).collect();
    if sizes.len() != rank || text.split_ascii_whitespace().count() != rank {
        let expected = if rank == 3 { "three sizes above 0" } else { "four sizes above 0" };
        return Err(wrong(place_of_sizes, expected, text));
    }
    let other = if rank == 3 { None } else { Some(other(fields, &sizes, at)?) };
    // The axes of space are the first three, or those after the first.
    let first = usize::from(other.is_some_and(|o| o.is_fastest));
    let (origin, steps, converted_from) = affine(fields, rank, first)?;
    let sizes = [sizes[first], sizes[first + 1], sizes[first + 2]];
    Ok(Axes { sizes, place_of_sizes, other, origin, steps, converted_from })
}

/// Which of four axes is not one of space, and what it is; `at` is where the file says that there are four.
fn other(fields: &Fields<'_>, sizes: &[u64], at: Place) -> Result<Other, ReadError> {
    let words = |text: &str| text.split_ascii_whitespace().map(str::to_ascii_lowercase).collect::<Vec<_>>();
    let kinds = fields.find("kinds").map(|(text, at)| (words(text), at)).filter(|(kinds, _)| kinds.len() == 4);
    let directions = fields.find("space directions").map(|(text, at)| (words(text), at));
    let is_space = |i: usize| match (&directions, &kinds) {
        // Of four dimensions of space the last is that of a series, as ITK writes one.
        (Some((words, _)), _) => words.get(i).is_none_or(|w| w != "none" && vector(w, 4).is_none_or(|v| v[3] == 0.0)),
        (None, Some((kinds, _))) => OF_SPACE.contains(&kinds[i].as_str()),
        (None, None) => true,
    };
    let found: Vec<usize> = (0..4).filter(|i| !is_space(*i)).collect();
    let &[axis @ (0 | 3)] = found.as_slice() else {
        let hint = "`space directions` has `none` for such an axis, or `kinds` has `list`, `time` or `RGB-color`";
        let expected = "dimension: 3, or 4 with the first axis or the last not one of space";
        return Err(ReadError::input(at, expected, "4 axes that are not said to be so", hint));
    };
    let kind = kinds.as_ref().map_or("none", |(kinds, _)| kinds[axis].as_str());
    let meaning = match kind {
        kind if OF_SERIES.contains(&kind) || OF_SPACE.contains(&kind) => Meaning::Series,
        kind if OF_COLOR.contains(&kind) => Meaning::Color,
        _ => Meaning::Components,
    };
    let place = kinds.as_ref().map(|(_, at)| *at).or(directions.as_ref().map(|(_, at)| *at)).unwrap_or(at);
    if axis == 3 && meaning != Meaning::Series {
        let hint = "write the components side by side, or one of them as a volume of its own";
        return Err(ReadError { hint, ..wrong(place, "components of a voxel along the first axis", kind) });
    }
    Ok(Other { size: sizes[axis], is_fastest: axis == 0, meaning, place })
}

/// So many finite numbers as `(x,y,z)`.
fn vector(text: &str, n: usize) -> Option<Vec<f64>> {
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let parts = inner.split(',').map(|c| c.trim().parse::<f64>().ok().filter(|v| v.is_finite()));
    parts.collect::<Option<Vec<f64>>>().filter(|v| v.len() == n)
}

/// A place or step in space, of which a fourth dimension is that of a series.
fn in_space(text: &str, is_step: bool) -> Option<DVec3> {
    let v = vector(text, 3).or_else(|| vector(text, 4).filter(|v| !is_step || v[3] == 0.0))?;
    Some(DVec3::new(v[0], v[1], v[2]))
}

/// Signs that make a right-anterior-superior space of the file's, and its name if that changes anything.
fn space(fields: &Fields<'_>) -> Result<(DVec3, Option<&'static str>), ReadError> {
    let Some((name, place)) = fields.find("space") else { return Ok((DVec3::ONE, None)) };
    let lower = name.to_ascii_lowercase();
    // Such names of four dimensions say of the fourth that it is time.
    let short = || lower.strip_suffix('t').filter(|name| name.len() == 3);
    let lower = lower.strip_suffix("-time").or_else(short).unwrap_or(&lower);
    let Some((long, _, signs)) = SPACES.iter().find(|(long, short, _)| lower == *long || lower == *short) else {
        let expected = "a space of three dimensions: right-anterior-superior, left-posterior-superior, scanner-xyz …";
        return Err(wrong(place, expected, name));
    };
    Ok((*signs, (*signs != DVec3::ONE).then_some(*long)))
}

/// The words of the axes of space among those of `rank` axes; none if there are not so many.
fn of_space(text: &str, rank: usize, first: usize) -> impl Iterator<Item = &str> {
    let fits = text.split_ascii_whitespace().count() == rank;
    text.split_ascii_whitespace().skip(first).take(if fits { 3 } else { 0 })
}

/// Place of voxel (0, 0, 0) and the steps of the lattice along three of `rank` axes from the `first` on, in a
/// right-anterior-superior space where the file says how its own lies to it, and then the name of that.
fn affine(fields: &Fields<'_>, rank: usize, first: usize) -> Result<(DVec3, DMat3, Option<&'static str>), ReadError> {
    let (signs, converted_from) = space(fields)?;
    let mut axes = DMat3::IDENTITY;
    let mut place = Place::File;
    if let Some((text, at)) = fields.find("space directions") {
        let columns: Option<Vec<DVec3>> = of_space(text, rank, first).map(|w| in_space(w, true)).collect();
        let Some([x, y, z]) = columns.as_deref() else {
            return Err(wrong(at, "three vectors such as (1,0,0) (0,1,0) (0,0,1)", text));
        };
        (axes, place) = (DMat3::from_cols(*x, *y, *z), at);
    } else if let Some((text, at)) = fields.find("spacings") {
        // A step that is not known is NaN.
        let steps: Option<Vec<f64>> = of_space(text, rank, first).map(|w| w.parse::<f64>().ok()).collect();
        let Some([x, y, z]) = steps.as_deref() else { return Err(wrong(at, "three spacings", text)) };
        let known = |s: f64| if s.is_nan() { 1.0 } else { s };
        (axes, place) = (DMat3::from_diagonal(DVec3::new(known(*x), known(*y), known(*z))), at);
    }
    let origin = match fields.find("space origin") {
        None => DVec3::ZERO,
        Some((text, at)) => in_space(text, false).ok_or_else(|| wrong(at, "an origin such as (0,0,0)", text))?,
    };
    lattice::check(origin, &axes, place, super::HINT)?;
    // Spacings alone do not say how the volume lies in the space.
    if fields.find("space directions").is_none() {
        return Ok((origin, axes, None));
    }
    Ok((signs * origin, DMat3::from_diagonal(signs) * axes, converted_from))
}
