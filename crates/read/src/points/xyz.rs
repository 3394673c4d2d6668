//! Points as text: `.xyz`, `.csv`, `.txt`, `.pts` → raw points.
//!
//! One point a line, columns between blanks, commas, semicolons or tabs. A first line of names says what the columns
//! are; without names there are three (x y z), four (and a value), six (and a normal if the first one has length 1, else
//! colours from 0 to 255) or seven (value before colours, as .pts files have it). `#` and `//` begin comments. A line with
//! nothing but a whole number before the first point is a count, which is checked.

use super::direction::unit;
use super::extras::{Extras, UNFIT_HINT};
use super::origin;
use crate::error::{Place, ReadError};
use crate::stream::input;
use crate::text::{Line, Lines, Word};
use crate::{Notes, ReadParams};
use splat_core::RawPoints;
use splat_core::glam::DVec3;
use splat_core::srgb::linear_from_srgb;
use splat_core::text::counted;

/// Roles of columns: x y z, normal, colour, value, opacity; and their names, lower case.
const ROLES: [&[&str]; 11] = [
    &["x", "x_coordinate", "easting"],
    &["y", "y_coordinate", "northing"],
    &["z", "z_coordinate", "height", "elevation"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["r", "red"],
    &["g", "green"],
    &["b", "blue"],
    &["value", "intensity", "scalar", "i"],
    &["opacity", "alpha"],
];
/// Names of x, y and z that count where no column has one of the names above, lower case.
const OTHER_PLACES: [&[&str]; 3] =
    [&["x_utm", "utm_x", "utm_easting"], &["y_utm", "utm_y", "utm_northing"], &["altitude", "alt", "elev"]];
const NORMAL: usize = 3;
const COLOR: usize = 6;
const VALUE: usize = 9;
const OPACITY: usize = 10;

/// Columns above which numbers without names are a grid, and no points.
const MOST_COLUMNS: usize = 32;

/// Bytes that a point takes while it is read and converted.
const BYTES_PER_POINT: u64 = 24 + 12 + 12 + 12 + 4 + 4;

/// Reads points.
pub(crate) fn read(content: &[u8], params: &ReadParams, notes: &mut Notes) -> Result<RawPoints, ReadError> {
    let mut lines = Lines::new(content);
    let mut columns: Option<Vec<Option<usize>>> = None;
    let mut count = None;
    let mut positions = Vec::new();
    let mut points = RawPoints::default();
    let is_intensity = |words: &[Word<'_>], roles: &[Option<usize>]| {
        words.iter().zip(roles).any(|(w, role)| *role == Some(VALUE) && bare(w).eq_ignore_ascii_case(b"intensity"))
    };
    let mut extras = Extras::default();
    let mut held = input::Growing::new("the points");
    while let Some(line) = lines.next()? {
        let comment = |w: &Word<'_>| w.text.starts_with(b"#") || w.text.starts_with(b"//");
        let words: Vec<Word<'_>> = line.words(true).take_while(|w| !comment(w)).collect();
        let [first, rest @ ..] = words.as_slice() else { continue };
        if columns.is_none() {
            if rest.is_empty() && count.is_none() {
                count = Some((whole(*first)?, line.place()));
                continue;
            }
            if first.number().is_err() {
                let roles = named(line, &words, count.is_some())?;
                points.is_intensity = is_intensity(&words, &roles);
                notes.not_used(words.iter().zip(&roles).filter(|(_, r)| r.is_none()).map(|(w, _)| bare(w)));
                let others = words.iter().zip(&roles).enumerate().map(|(i, (w, role))| (i, bare(w), role.is_some()));
                extras = Extras::new(others, params);
                columns = Some(roles);
                continue;
            }
        }
        let columns = match &mut columns {
            Some(columns) => columns,
            unknown => {
                refuse_decimal_commas(line)?;
                unknown.insert(guessed(line, &words)?)
            }
        };
        if words.len() != columns.len() {
            refuse_decimal_commas(line)?;
            refuse_empty_cells(line, columns.len())?;
            let expected = format!("{} columns", columns.len());
            let found = format!("{}", words.len());
            return Err(ReadError::input(line.place(), expected, found, "every line has the same columns"));
        }
        let bytes = (positions.len() as u64 + 1) * (BYTES_PER_POINT + extras.bytes_per_point());
        held.hold(bytes, params)?;
        input::reserve(&mut positions, 1)?;
        if point(&words, columns, params, &mut positions, &mut points)? {
            further(&words, &mut extras)?;
        }
    }
    if let Some((announced, place)) = count
        && announced != positions.len() as u64 + points.dropped
    {
        let held = positions.len() as u64 + points.dropped;
        let hint = if held > announced {
            "the file holds more points than its first line counts: mend the count, or remove it"
        } else {
            "the file is truncated"
        };
        let expected = format!("{}, as announced", counted(announced, "point"));
        return Err(ReadError::input(place, expected, counted(held, "point"), hint));
    }
    let (origin, position) = origin::relative(&positions, Place::File, |i| format!("point {i}"))?;
    Ok(RawPoints { origin, position, columns: extras.finish(notes), ..points })
}

/// Takes the numbers of a line's further columns; where one is kept, a word that is no number is refused.
fn further(words: &[Word<'_>], extras: &mut Extras) -> Result<(), ReadError> {
    let is_text = |i: &usize| extras.keeps(*i) && words[*i].decimal().is_none();
    if let Some(i) = extras.read().find(is_text) {
        let hint = "a column that is asked for has numbers alone; nan is a gap";
        return Err(ReadError::input(words[i].place(), "a number", words[i].shown(), hint));
    }
    let unfit = |i: usize| Some((i, extras.unfit(i, words[i].decimal()?)?));
    if let Some((i, expected)) = extras.read().find_map(unfit) {
        return Err(ReadError::input(words[i].place(), expected, words[i].shown(), UNFIT_HINT));
    }
    extras.reserve(1)?;
    extras.push(|i| words[i].decimal().unwrap_or(f64::NAN));
    Ok(())
}

fn whole(word: Word<'_>) -> Result<u64, ReadError> {
    std::str::from_utf8(word.text).ok().and_then(|t| t.parse().ok()).ok_or_else(|| {
        let hint = "points need three columns at least";
        ReadError::input(word.place(), "x, y and z, names of columns, or a number of points", word.shown(), hint)
    })
}

/// Refuses a line whose numbers have commas in the place of points, which would be read as twice as many numbers: cells between semicolons, or all of
/// those between blanks, with one comma between digits each.
fn refuse_decimal_commas(line: Line<'_>) -> Result<(), ReadError> {
    let has_semicolons = line.text.contains(&b';');
    let parts = |byte: &u8| if has_semicolons { *byte == b';' } else { byte.is_ascii_whitespace() };
    let cells: Vec<&[u8]> = line.text.split(parts).map(<[u8]>::trim_ascii).filter(|cell| !cell.is_empty()).collect();
    let is_decimal = |cell: &&&[u8]| {
        let mut pieces = cell.split(|byte| *byte == b',');
        let ends = |piece: Option<&[u8]>, at_end: bool| {
            piece.and_then(|piece| if at_end { piece.last() } else { piece.first() }).is_some_and(u8::is_ascii_digit)
        };
        ends(pieces.next(), true) && ends(pieces.next(), false) && pieces.next().is_none()
    };
    let decimal: Vec<&&[u8]> = cells.iter().filter(is_decimal).collect();
    let others = cells.iter().filter(|cell| cell.contains(&b',')).count() - decimal.len();
    let least = if has_semicolons { 1 } else { cells.len() };
    let Some(first) = decimal.first().filter(|_| cells.len() >= 3 && others == 0 && decimal.len() >= least) else {
        return Ok(());
    };
    let column = line.text.windows(first.len()).position(|part| part == **first).unwrap_or(0) as u64 + 1;
    let found = format!("'{}', whose comma parts columns", splat_core::text::escaped(first, 40));
    let hint = "write 1.5 for 1,5, as programs do in an English locale";
    Err(ReadError::input(Place::Line { line: line.number, column }, "numbers with a decimal point", found, hint))
}

/// Refuses a line that has so many cells between separators as there are columns, of which some are empty.
fn refuse_empty_cells(line: Line<'_>, columns: usize) -> Result<(), ReadError> {
    let Some(separator) = [b';', b',', b'\t'].into_iter().find(|separator| line.text.contains(separator)) else {
        return Ok(());
    };
    let mut column = 1;
    let mut empty = None;
    let mut count = 0;
    for (rank, cell) in line.text.split(|byte| *byte == separator).enumerate() {
        if cell.trim_ascii().is_empty() && empty.is_none() {
            empty = Some((rank + 1, column));
        }
        column += cell.len() as u64 + 1;
        count = rank + 1;
    }
    let Some((rank, column)) = empty.filter(|_| count == columns) else { return Ok(()) };
    let found = format!("an empty cell, the {rank}. of {columns}");
    let hint = "remove such points, or write nan in a column beside x, y and z that `color_by` or `keep` names";
    Err(ReadError::input(Place::Line { line: line.number, column }, "a number in each column", found, hint))
}

/// A name without quotes.
fn bare<'a>(word: &Word<'a>) -> &'a [u8] {
    word.text.strip_prefix(b"\"").and_then(|n| n.strip_suffix(b"\"")).unwrap_or(word.text)
}

/// Roles of columns with names; others are read over. With `is_counted` a number of points stands before the line.
fn named(line: Line<'_>, words: &[Word<'_>], is_counted: bool) -> Result<Vec<Option<usize>>, ReadError> {
    let role =
        |w: &Word<'_>| ROLES.iter().position(|names| names.iter().any(|n| bare(w).eq_ignore_ascii_case(n.as_bytes())));
    let mut columns: Vec<Option<usize>> = words.iter().map(role).collect();
    for (role, names) in OTHER_PLACES.iter().enumerate() {
        let is_named = |w: &Word<'_>| names.iter().any(|name| bare(w).eq_ignore_ascii_case(name.as_bytes()));
        if !columns.contains(&Some(role))
            && let Some(other) = words.iter().position(is_named)
        {
            columns[other] = Some(role);
        }
    }
    let found: Vec<usize> = columns.iter().flatten().copied().collect();
    if let Some(twice) = (0..ROLES.len()).find(|r| found.iter().filter(|f| *f == r).count() > 1) {
        let expected = format!("one column '{}'", ROLES[twice][0]);
        return Err(ReadError::input(line.place(), expected, "several", "rename all but one"));
    }
    if let Some(missing) = (0..NORMAL).find(|r| !found.contains(r)) {
        let expected = format!("columns x, y and z; '{}' is missing", ROLES[missing][0]);
        let text = format!("'{}'", splat_core::text::escaped(line.text.trim_ascii(), 60));
        let hint = if is_counted {
            "of an XMol file of atoms, which has a number, a comment and lines such as C 0 0 0, replace the first two lines by: element x y z"
        } else {
            "name the columns of the coordinates x, y and z in the first line, or leave that line out"
        };
        return Err(ReadError::input(line.place(), expected, text, hint));
    }
    // A normal or colour with a missing component is none.
    for group in [NORMAL..COLOR, COLOR..VALUE] {
        if !group.clone().all(|r| found.contains(&r)) {
            columns.iter_mut().filter(|c| c.is_some_and(|r| group.contains(&r))).for_each(|c| *c = None);
        }
    }
    Ok(columns)
}

/// Roles of columns without names.
fn guessed(line: Line<'_>, words: &[Word<'_>]) -> Result<Vec<Option<usize>>, ReadError> {
    // One that is not finite is refused, or left out, with the point.
    let number = |w: &Word<'_>| w.decimal().map_or_else(|| w.number(), Ok);
    let numbers: Vec<f64> = words.iter().map(number).collect::<Result<_, _>>()?;
    let roles = match numbers.as_slice() {
        [_, _, _] => vec![0, 1, 2],
        [_, _, _, _] => vec![0, 1, 2, VALUE],
        [_, _, _, x, y, z] if (DVec3::new(*x, *y, *z).length() - 1.0).abs() < 0.01 => vec![0, 1, 2, 3, 4, 5],
        [_, _, _, color @ ..] if color.len() == 3 && color.iter().all(|c| (0.0..=255.0).contains(c)) => {
            vec![0, 1, 2, 6, 7, 8]
        }
        [_, _, _, _, ..] if numbers.len() == 7 => vec![0, 1, 2, VALUE, 6, 7, 8],
        _ => {
            let expected = "3, 4, 6 or 7 columns, or a first line with their names";
            let found = format!("{} columns", words.len());
            let hint = if words.len() > MOST_COLUMNS {
                "a grid of heights has to become points, a line x y z for each of its numbers; of points name the columns in a first line"
            } else {
                "begin with a line such as: x y z nx ny nz"
            };
            return Err(ReadError::input(line.place(), expected, found, hint));
        }
    };
    Ok(roles.into_iter().map(Some).collect())
}

/// Takes a point, or leaves it out and gives false.
fn point(
    words: &[Word<'_>],
    columns: &[Option<usize>],
    params: &ReadParams,
    positions: &mut Vec<DVec3>,
    points: &mut RawPoints,
) -> Result<bool, ReadError> {
    let mut values = [0.0; 11];
    let mut has = [false; 11];
    for (word, role) in words.iter().zip(columns).filter_map(|(w, c)| c.map(|role| (w, role))) {
        match word.number() {
            Ok(value) => values[role] = value,
            // Only what is a number, but not a finite one, may be dropped.
            Err(_) if params.drop_invalid && is_float(*word) => {
                points.dropped += 1;
                return Ok(false);
            }
            Err(error) if is_float(*word) => {
                let hint = "remove the point, or leave such points out with --drop-invalid";
                return Err(ReadError { hint, ..error });
            }
            Err(error) => return Err(error),
        }
        if (COLOR..VALUE).contains(&role) && !(0.0..=255.0).contains(&values[role]) {
            return Err(ReadError::input(word.place(), "a colour from 0 to 255", word.shown(), "colours are 0 to 255"));
        }
        if role == VALUE && !(values[role] as f32).is_finite() {
            let expected = "a value that fits a 32-bit float";
            return Err(ReadError::input(word.place(), expected, word.shown(), "scale the values"));
        }
        if role == OPACITY && !(0.0..=1.0).contains(&values[role]) {
            let hint = "opacities are 0 to 1; or rename the column";
            return Err(ReadError::input(word.place(), "an opacity from 0 to 1", word.shown(), hint));
        }
        has[role] = true;
    }
    positions.push(DVec3::new(values[0], values[1], values[2]));
    if has[NORMAL] {
        points.normal.push(unit(DVec3::from_slice(&values[NORMAL..])));
    }
    if has[COLOR] {
        points.color.push([6, 7, 8].map(|i| linear_from_srgb(values[i] / 255.0)));
    }
    if has[VALUE] {
        points.value.push(values[VALUE] as f32);
    }
    if has[OPACITY] {
        points.opacity.push(values[OPACITY] as f32);
    }
    Ok(true)
}

fn is_float(word: Word<'_>) -> bool {
    std::str::from_utf8(word.text).is_ok_and(|t| t.parse::<f64>().is_ok())
}
