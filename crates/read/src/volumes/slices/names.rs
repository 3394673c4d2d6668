//! Names of slices: those of one series differ in one number, at equal steps.

use super::HINT;
use crate::Notes;
use crate::error::{Place, ReadError};
use crate::format::folder::{Part, parts};
use splat_core::text::escaped;
use std::collections::BTreeMap;

/// The name without its extension, whose digits count nothing.
fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

const OTHER_HINT: &str =
    "take other files out of the folder: the slices of one volume need one of their own, in one format, size and type";

/// Whether names differ in numbers alone.
fn are_alike(parts: &[Part], others: &[Part]) -> bool {
    let is_alike = |(part, other): (&Part, &Part)| match (part, other) {
        (Part::Number(_), Part::Number(_)) => true,
        _ => part == other,
    };
    parts.len() == others.len() && parts.iter().zip(others).all(is_alike)
}

/// The rank of the first of those names that most others are like.
fn most_common(split: &[Vec<Part>]) -> usize {
    let mut kinds: BTreeMap<Vec<Option<&Part>>, (usize, usize)> = BTreeMap::new();
    for (rank, parts) in split.iter().enumerate() {
        let kind = parts.iter().map(|part| if let Part::Text(_) = part { Some(part) } else { None });
        kinds.entry(kind.collect()).or_insert((0, rank)).0 += 1;
    }
    let earlier = |rank: usize| std::cmp::Reverse(rank);
    kinds.into_values().max_by_key(|(count, first)| (*count, earlier(*first))).map_or(0, |(_, first)| first)
}

/// Refuses names, in their order, that are not those of one series without gaps.
pub(super) fn check(names: &[String], notes: &mut Notes) -> Result<(), ReadError> {
    let quoted = |name: &str| format!("'{}'", escaped(name.as_bytes(), 60));
    let [first, .., last] = names else {
        let found = names.first().map_or_else(|| "none".to_owned(), |name| format!("one, {}", quoted(name)));
        return Err(ReadError::input(Place::File, "two slices or more", found, HINT));
    };
    let split: Vec<Vec<Part>> = names.iter().map(|name| parts(stem(name))).collect();
    // The names of most files are those of the series: a picture of all of it may lie beside its slices.
    let like_most = most_common(&split);
    let is_alike = |parts: &[Part]| are_alike(parts, &split[like_most]);
    if let Some(other) = split.iter().position(|parts| !is_alike(parts)) {
        if split.iter().flatten().all(|part| matches!(part, Part::Text(_))) {
            let [first, last] = [first, last].map(|name| quoted(name));
            notes.remark(format!("names without numbers: slices lie in the order of the alphabet, {first} to {last}"));
            return Ok(());
        }
        let expected = format!("names that differ in one number, such as {}", quoted(&names[like_most]));
        return Err(ReadError::input(Place::File, expected, quoted(&names[other]), OTHER_HINT));
    }
    let differs = |at: &usize| split.iter().any(|parts| parts[*at] != split[0][*at]);
    let places: Vec<usize> = (0..split[0].len()).filter(differs).collect();
    let &[place] = places.as_slice() else {
        let found = format!("{} and {}, which differ in {}", quoted(first), quoted(last), places.len());
        return Err(ReadError::input(Place::File, "names that differ in one number", found, HINT));
    };
    let number = |parts: &Vec<Part>| if let Part::Number(number) = parts[place] { number } else { 0 };
    let numbers: Vec<u128> = split.iter().map(number).collect();
    let step = numbers.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap_or(1);
    let is_wrong = |pair: &[u128]| if step == 0 { pair[0] == pair[1] } else { pair[1] - pair[0] != step };
    let Some(gap) = numbers.windows(2).position(is_wrong) else {
        let step = if step == 1 { String::new() } else { format!(", every {step}th") };
        let [first, last] = [first, last].map(|name| quoted(name));
        notes.remark(format!("{} slices, {first} to {last}{step}", names.len()));
        return Ok(());
    };
    let [before, behind] = [&names[gap], &names[gap + 1]].map(|name| quoted(name));
    if step == 0 {
        let hint = "take one of them out of the folder";
        let found = format!("{before} and {behind}");
        return Err(ReadError::input(Place::File, "one slice for each number", found, hint));
    }
    let expected = format!("the slice of number {} behind {before}", numbers[gap] + step);
    let hint = "put the missing slices into the folder, or number those that are there anew if they lie at equal steps";
    Err(ReadError::input(Place::File, expected, behind, hint))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(names: &[&str]) -> Result<Vec<String>, String> {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let mut notes = Notes::default();
        check(&names, &mut notes)
            .map(|()| notes.remarks)
            .map_err(|e| format!("expected {}, found {}", e.expected, e.found))
    }

    #[test]
    fn gaps_doubles_and_other_names_are_refused_by_name() {
        assert_eq!(checked(&["a1_2.tif", "a1_3.tif", "a1_4.tif"]).unwrap(), ["3 slices, 'a1_2.tif' to 'a1_4.tif'"]);
        assert_eq!(checked(&["a0.tif", "a5.tif", "a10.tif"]).unwrap(), ["3 slices, 'a0.tif' to 'a10.tif', every 5th"]);
        assert!(checked(&["back.png", "front.png"]).unwrap()[0].contains("order of the alphabet"));
        for (names, said) in [
            (&["a1.tif", "a2.tif", "a4.tif"][..], "expected the slice of number 3 behind 'a2.tif', found 'a4.tif'"),
            (&["a1.tif", "a4.tif", "a5.tif"], "expected the slice of number 2 behind 'a1.tif', found 'a4.tif'"),
            (&["a01.tif", "a1.tif", "a2.tif"], "expected one slice for each number, found 'a01.tif' and 'a1.tif'"),
            (
                &["a1.tif", "a2.tif", "a03.tif", "a3.tif"],
                "expected one slice for each number, found 'a03.tif' and 'a3.tif'",
            ),
            (
                &["preview.tif", "slice_1.tif", "slice_2.tif"],
                "expected names that differ in one number, such as 'slice_1.tif', found 'preview.tif'",
            ),
            (&["a1.tif", "b1.tif"], "expected names that differ in one number, such as 'a1.tif', found 'b1.tif'"),
            (
                &["a1b1.tif", "a2b2.tif"],
                "expected names that differ in one number, found 'a1b1.tif' and 'a2b2.tif', which differ in 2",
            ),
            (&["a1.tif"], "expected two slices or more, found one, 'a1.tif'"),
            (
                &["a1.tif", "a1.tiff"],
                "expected names that differ in one number, found 'a1.tif' and 'a1.tiff', which differ in 0",
            ),
        ] {
            assert_eq!(checked(names).unwrap_err(), said);
        }
    }
}
