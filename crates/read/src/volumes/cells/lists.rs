//! The points of many cells, one cell behind the other, and the faces of those that are polyhedra.

use super::HINT;
use super::kind::POLYHEDRON;
use crate::error::{Place, ReadError};

/// Ranks of points, and where the cells end among them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lists {
    ends: Vec<usize>,
    corners: Vec<u32>,
    polyhedra: Polyhedra,
}

/// The faces of the polyhedra among cells.
#[derive(Debug, Clone, Default, PartialEq)]
struct Polyhedra {
    /// Ranks of the cells, which rise.
    cells: Vec<usize>,
    /// Where the faces of each end among all faces.
    ends: Vec<usize>,
    /// Where each face ends among their points.
    ends_of_faces: Vec<usize>,
    corners: Vec<u32>,
}

/// The faces around one polyhedron.
#[derive(Clone, Copy)]
pub(super) struct FacesAround<'a> {
    polyhedra: &'a Polyhedra,
    first: usize,
    end: usize,
}

impl<'a> FacesAround<'a> {
    /// The points of each face.
    pub(super) fn iter(self) -> impl Iterator<Item = &'a [u32]> {
        let Self { polyhedra, first, end } = self;
        (first..end).map(move |face| {
            let start = face.checked_sub(1).map_or(0, |before| polyhedra.ends_of_faces[before]);
            &polyhedra.corners[start..polyhedra.ends_of_faces[face]]
        })
    }
}

/// Where cells are told of, and what they are made of.
#[derive(Clone, Copy)]
pub(crate) struct CellSource<'a> {
    /// Points that there are.
    pub(crate) points: usize,
    /// VTK's kinds of the cells where a polyhedron is a list of its faces; else none.
    pub(crate) kinds: &'a [u8],
    pub(crate) place: Place,
}

impl Lists {
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> + Clone {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.corners[start..*end])
    }

    /// So many cells, each with the number of its points before them: how VTK wrote them up to version 4.
    pub(crate) fn counted(numbers: &[f64], cells: u64, source: CellSource<'_>) -> Result<Self, ReadError> {
        let mut lists = Self::default();
        let mut left = numbers;
        while let Some((count, rest)) = left.split_first() {
            let cell = lists.len();
            let Some(n) = whole(*count, rest.len()) else {
                let expected = format!("a number of points of cell {cell}, at most {}, and as many points", rest.len());
                return Err(ReadError::input(source.place, expected, count.to_string(), HINT));
            };
            lists.push(&rest[..n], source)?;
            left = &rest[n..];
        }
        if lists.len() as u64 == cells {
            return Ok(lists);
        }
        Err(ReadError::input(source.place, format!("{cells} cells"), lists.len().to_string(), HINT))
    }

    /// Cells that end at these of their points.
    pub(crate) fn ending(ends: &[f64], corners: &[f64], source: CellSource<'_>) -> Result<Self, ReadError> {
        let mut lists = Self::default();
        let mut start = 0;
        for (cell, end) in ends.iter().enumerate() {
            let Some(end) = whole(*end, corners.len()).filter(|end| *end >= start) else {
                let expected = format!("cell {cell} to end at {start} to {} of the points of cells", corners.len());
                return Err(ReadError::input(source.place, expected, end.to_string(), HINT));
            };
            lists.push(&corners[start..end], source)?;
            start = end;
        }
        if start == corners.len() {
            return Ok(lists);
        }
        let expected = format!("{} points in the cells, as many as there are", corners.len());
        Err(ReadError::input(source.place, expected, start.to_string(), HINT))
    }

    fn push(&mut self, corners: &[f64], source: CellSource<'_>) -> Result<(), ReadError> {
        let cell = self.len();
        if source.kinds.get(cell) == Some(&POLYHEDRON) {
            self.add_faces(cell, corners, source)?;
            let first = self.polyhedra.start_of_last();
            let mut ranks = self.polyhedra.corners[first..].to_vec();
            ranks.sort_unstable();
            ranks.dedup();
            self.push_ranks(ranks.into_iter());
            return Ok(());
        }
        for corner in corners {
            self.corners.push(source.rank(*corner, cell)?);
        }
        self.ends.push(self.corners.len());
        Ok(())
    }

    /// A cell of these points, which are known to be there.
    pub(super) fn push_ranks(&mut self, corners: impl Iterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// The faces of a cell behind those of all cells before it: how many, and each with the number of its points before them.
    pub(crate) fn add_faces(&mut self, cell: usize, stream: &[f64], source: CellSource<'_>) -> Result<(), ReadError> {
        let wrong = |expected: &str, found: String| {
            let expected = format!("{expected} of cell {cell}, a polyhedron");
            Err(ReadError::input(source.place, expected, found, HINT))
        };
        let Some((count, mut left)) = stream.split_first() else {
            return wrong("a number of faces", "none".to_owned());
        };
        let Some(faces) = whole(*count, left.len()) else { return wrong("a number of faces", count.to_string()) };
        for _ in 0..faces {
            let Some((count, rest)) = left.split_first() else { return wrong("as many faces", "fewer".to_owned()) };
            let Some(n) = whole(*count, rest.len()) else {
                return wrong("a number of points of a face, and as many points", count.to_string());
            };
            self.add_face(cell, &rest[..n], source)?;
            left = &rest[n..];
        }
        if !left.is_empty() {
            return wrong("no number behind the faces", format!("{} more", left.len()));
        }
        self.end_faces(cell);
        Ok(())
    }

    /// One face of the polyhedron that is told of.
    pub(crate) fn add_face(&mut self, cell: usize, corners: &[f64], source: CellSource<'_>) -> Result<(), ReadError> {
        for corner in corners {
            self.polyhedra.corners.push(source.rank(*corner, cell)?);
        }
        self.polyhedra.ends_of_faces.push(self.polyhedra.corners.len());
        Ok(())
    }

    /// The faces since the polyhedron before are those of this cell, which comes behind it.
    pub(crate) fn end_faces(&mut self, cell: usize) {
        self.polyhedra.cells.push(cell);
        self.polyhedra.ends.push(self.polyhedra.ends_of_faces.len());
    }

    /// The faces around a cell; `None` where it is told of none.
    pub(super) fn faces(&self, cell: usize) -> Option<FacesAround<'_>> {
        let polyhedra = &self.polyhedra;
        let rank = polyhedra.cells.binary_search(&cell).ok()?;
        let first = rank.checked_sub(1).map_or(0, |before| polyhedra.ends[before]);
        Some(FacesAround { polyhedra, first, end: polyhedra.ends[rank] })
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> u64 {
        let Polyhedra { cells, ends, ends_of_faces, corners } = &self.polyhedra;
        let ends = [&self.ends, cells, ends, ends_of_faces].map(|ends| size_of_val(ends.as_slice()));
        let corners = [&self.corners, corners].map(|corners| size_of_val(corners.as_slice()));
        (ends.iter().sum::<usize>() + corners.iter().sum::<usize>()) as u64
    }

    /// These cells and others behind them, whose points begin at this rank.
    pub(crate) fn append(&mut self, others: &Self, first: u32) {
        let cells = self.ends.len();
        let before = self.corners.len();
        self.corners.extend(others.corners.iter().map(|corner| first + corner));
        self.ends.extend(others.ends.iter().map(|end| before + end));
        let polyhedra = &mut self.polyhedra;
        let faces = polyhedra.ends_of_faces.len();
        let corners = polyhedra.corners.len();
        polyhedra.cells.extend(others.polyhedra.cells.iter().map(|cell| cells + cell));
        polyhedra.ends.extend(others.polyhedra.ends.iter().map(|end| faces + end));
        polyhedra.ends_of_faces.extend(others.polyhedra.ends_of_faces.iter().map(|end| corners + end));
        polyhedra.corners.extend(others.polyhedra.corners.iter().map(|corner| first + corner));
    }
}

impl Polyhedra {
    /// Where the points of the faces of the last polyhedron begin.
    fn start_of_last(&self) -> usize {
        let before = self.ends.len().checked_sub(2).map_or(0, |rank| self.ends[rank]);
        before.checked_sub(1).map_or(0, |face| self.ends_of_faces[face])
    }
}

impl CellSource<'_> {
    /// A number of a cell as the rank of a point.
    fn rank(&self, corner: f64, cell: usize) -> Result<u32, ReadError> {
        let points = self.points;
        let rank = points.checked_sub(1).and_then(|last| whole(corner, last));
        rank.and_then(|rank| u32::try_from(rank).ok()).ok_or_else(|| {
            let expected = format!("points of cell {cell} among the {points} that there are, counted from 0");
            ReadError::input(self.place, expected, corner.to_string(), HINT)
        })
    }
}

/// A whole number from 0 to `most`.
fn whole(number: f64, most: usize) -> Option<usize> {
    (number >= 0.0 && number <= most as f64 && number.fract() == 0.0).then_some(number as usize)
}
