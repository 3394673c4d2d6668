//! The parts of a grid that lie in several files: whether they are what the list says, fill the whole, and agree where they meet.

use super::pieces::{Source, in_file};
use super::{HINT, arrays, child, extent, place, wrong};
use crate::error::{Place, ReadError};
use crate::volumes::selection::GHOSTS;
use roxmltree::Node;
use splat_core::glam::DVec3;
use splat_core::text::escaped;

/// Indices of the first and the last point along each axis.
pub(super) type Extent = [[i64; 2]; 3];

/// How far apart two pieces may have a point that they share, of the size of the first: what rounding to single precision does.
const SAME: f64 = 1e-5;

/// Boxes that are looked at for a hole, at most: pieces that lie side by side need a few each.
const MOST_BOXES: usize = 1 << 22;

/// What to do with pieces that do not fit each other.
const DISAGREE: &str = "the files are of different datasets or times, or damaged: write or fetch all of them anew";

/// A part of a grid.
pub(super) struct Part<'s> {
    pub(super) extent: Extent,
    /// The name of the file where a list names it.
    pub(super) file: Option<&'s str>,
    /// Whether it marks copies of what lies in other parts.
    has_ghosts: bool,
    place: Place,
}

/// What of a grid parts have to fill.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filling {
    Points,
    Cells,
}

fn shown(extent: Extent) -> String {
    extent.as_flattened().iter().map(i64::to_string).collect::<Vec<_>>().join(" ")
}

/// How a part is called: by its file, or by its extent.
fn called(part: &Part<'_>) -> String {
    part.file.map_or_else(
        || format!("the Piece {}", shown(part.extent)),
        |file| format!("'{}'", escaped(file.as_bytes(), 60)),
    )
}

/// The parts of files. Refuses one that is not the part that the list says; `stated` are those of each file.
pub(super) fn parts<'s>(
    sources: &'s [Source<'_, '_, '_>],
    stated: &[Option<Extent>],
) -> Result<Vec<Part<'s>>, ReadError> {
    let mut parts = Vec::new();
    for (rank, source) in sources.iter().enumerate() {
        let nodes: Vec<Node<'_, '_>> = source.dataset.children().filter(|c| c.has_tag_name("Piece")).collect();
        for node in &nodes {
            let found = extent(*node, "Extent").map_err(|e| in_file(source.file, e))?;
            if let Some(Some(stated)) = stated.get(rank).filter(|_| nodes.len() == 1)
                && *stated != found
            {
                let expected = format!("the Extent {}, as the list has it", shown(*stated));
                let error = ReadError { hint: DISAGREE, ..wrong(*node, &expected, &shown(found)) };
                return Err(in_file(source.file, error));
            }
            let mut of_cells = child(*node, "CellData").into_iter().flat_map(arrays);
            let has_ghosts = of_cells.any(|array| array.attribute("Name") == Some(GHOSTS));
            parts.push(Part { extent: found, file: source.file, has_ghosts, place: place(*node) });
        }
    }
    Ok(parts)
}

/// The box around parts.
fn around(parts: &[Part<'_>]) -> Option<Extent> {
    let extents = parts.iter().map(|part| part.extent);
    extents.reduce(|a, b| [0, 1, 2].map(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])]))
}

/// Refuses parts that leave a hole in the whole that the list states, else in the box around them.
pub(super) fn check_filled(parts: &[Part<'_>], whole: Option<Extent>, filling: Filling) -> Result<(), ReadError> {
    let Some(around) = around(parts) else { return Ok(()) };
    let whole = whole.unwrap_or(around);
    if let Some(part) = parts.iter().find(|part| met(part.extent, whole) != Some(part.extent)) {
        let expected = format!("pieces within the extent {}", shown(whole));
        let found = format!("{} with {}", called(part), shown(part.extent));
        return Err(ReadError::input(part.place, expected, found, DISAGREE));
    }
    // Points and cells from the first to the last; a grid that is flat along an axis has one layer of cells there.
    let filled = |extent: Extent| -> Extent {
        [0, 1, 2].map(|axis| {
            let [low, high] = extent[axis];
            if filling == Filling::Cells && whole[axis][0] < whole[axis][1] { [low, high - 1] } else { [low, high] }
        })
    };
    let mut left = vec![(filled(whole), 0)];
    let mut looked_at = 0;
    while let Some((hole, from)) = left.pop() {
        looked_at += 1;
        let meeting = parts[from..].iter().position(|part| met(filled(part.extent), hole).is_some());
        let Some(next) = meeting.map(|n| from + n).filter(|_| looked_at <= MOST_BOXES) else {
            let what = if filling == Filling::Cells { "cells" } else { "points" };
            let expected = format!("pieces that have all {what} of the extent {}", shown(whole));
            let found = format!("none with those of the extent {}", shown(hole));
            let hint = "fetch the piece that is missing, or write the dataset anew";
            return Err(ReadError::input(parts[0].place, expected, found, hint));
        };
        let part = filled(parts[next].extent);
        let mut rest = hole;
        for (axis, [first, last]) in part.into_iter().enumerate() {
            let [low, high] = rest[axis];
            let mut beside = |ends: [i64; 2]| {
                if ends[0] <= ends[1] {
                    let mut beside = rest;
                    beside[axis] = ends;
                    left.push((beside, next + 1));
                }
            };
            beside([low, high.min(first - 1)]);
            beside([low.max(last + 1), high]);
            rest[axis] = [low.max(first), high.min(last)];
        }
    }
    Ok(())
}

/// What two extents share, if they meet.
fn met(a: Extent, b: Extent) -> Option<Extent> {
    let shared = [0, 1, 2].map(|axis| [a[axis][0].max(b[axis][0]), a[axis][1].min(b[axis][1])]);
    shared.iter().all(|[low, high]| low <= high).then_some(shared)
}

/// Refuses two parts that have the same cells, of which neither is marked as a copy.
pub(super) fn check_beside(parts: &[Part<'_>]) -> Result<(), ReadError> {
    let Some(whole) = around(parts) else { return Ok(()) };
    for (rank, part) in parts.iter().enumerate() {
        for other in &parts[..rank] {
            let Some(shared) = met(part.extent, other.extent) else { continue };
            let has_cells = (0..3).all(|axis| shared[axis][0] < shared[axis][1] || whole[axis][0] == whole[axis][1]);
            if has_cells && !part.has_ghosts && !other.has_ghosts {
                let expected = format!("pieces that share points at most, or mark copies of cells in {GHOSTS}");
                let found = format!(
                    "{} with the extent {} and {} with {}",
                    called(other),
                    shown(other.extent),
                    called(part),
                    shown(part.extent)
                );
                return Err(ReadError::input(part.place, expected, found, DISAGREE));
            }
        }
    }
    Ok(())
}

/// Refuses parts that have a point that they share at different places; `points` has those of each behind those of the parts before it.
pub(super) fn check_points(parts: &[Part<'_>], points: &[DVec3]) -> Result<(), ReadError> {
    let sizes = |part: &Part<'_>| part.extent.map(|[low, high]| (high - low + 1) as usize);
    let mut firsts = vec![0];
    for part in parts {
        firsts.push(firsts.last().copied().unwrap_or(0) + sizes(part).iter().product::<usize>());
    }
    let place = |rank: usize, index: [i64; 3]| {
        let [nx, ny, _] = sizes(&parts[rank]);
        let [x, y, z] = [0, 1, 2].map(|axis| (index[axis] - parts[rank].extent[axis][0]) as usize);
        points.get(firsts[rank] + x + nx * (y + ny * z)).copied()
    };
    for (rank, part) in parts.iter().enumerate() {
        let of_part = points.get(firsts[rank]..).into_iter().flatten().take(sizes(part).iter().product());
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = of_part.fold(none, |(l, h), p| (l.min(*p), h.max(*p)));
        let most = SAME * low.distance(high);
        for (other_rank, other) in parts[..rank].iter().enumerate() {
            let Some([x, y, z]) = met(part.extent, other.extent) else { continue };
            let along = |[low, high]: [i64; 2]| low..=high;
            let indices = along(z).flat_map(|k| along(y).flat_map(move |j| along(x).map(move |i| [i, j, k])));
            for index in indices {
                let Some((found, expected)) = place(rank, index).zip(place(other_rank, index)) else { continue };
                if found.distance(expected) > most {
                    let [i, j, k] = index;
                    let expected = format!("point {i} {j} {k} at {expected}, where {} has it", called(other));
                    let found = format!("{found} in {}", called(part));
                    return Err(ReadError::input(part.place, expected, found, DISAGREE));
                }
            }
        }
    }
    Ok(())
}

/// Refuses a number of a grid that two parts have differently: the coordinate or the value at an index.
pub(super) fn differ(what: &str, expected: f64, found: f64, file: Option<&str>, place: Place) -> ReadError {
    let error = ReadError::input(
        place,
        format!("{what} to be {expected}, as another piece has it"),
        found.to_string(),
        DISAGREE,
    );
    in_file(file, ReadError { hint: DISAGREE, ..error })
}

/// Refuses an array of a part that is not of the type of the same one in another.
pub(super) fn check_alike(array: Node<'_, '_>, other: Node<'_, '_>) -> Result<(), ReadError> {
    let told = |array: Node<'_, '_>| {
        let numbers = array.attribute("NumberOfComponents").unwrap_or("1");
        format!("{numbers} numbers of {}", array.attribute("type").unwrap_or_default())
    };
    if told(array) == told(other) {
        return Ok(());
    }
    let expected = format!("{} a tuple, as the array has in another piece", told(array));
    Err(ReadError::input(place(other), expected, told(other), HINT))
}
