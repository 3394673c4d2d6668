//! The points of many cells, one cell behind the other.

use super::HINT;
use crate::error::{Place, ReadError};

/// Ranks of points, and where the cells end among them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lists {
    ends: Vec<usize>,
    corners: Vec<u32>,
}

impl Lists {
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.corners[start..*end])
    }

    /// So many cells, each with the number of its points before them: how VTK wrote them up to version 4.
    pub(crate) fn counted(numbers: &[f64], cells: u64, points: usize, place: Place) -> Result<Self, ReadError> {
        let mut lists = Self::default();
        let mut left = numbers;
        while let Some((count, rest)) = left.split_first() {
            let cell = lists.len();
            let Some(n) = whole(*count, rest.len()) else {
                let expected = format!("a number of points of cell {cell}, at most {}, and as many points", rest.len());
                return Err(ReadError::input(place, expected, count.to_string(), HINT));
            };
            lists.push(&rest[..n], points, place)?;
            left = &rest[n..];
        }
        if lists.len() as u64 == cells {
            return Ok(lists);
        }
        Err(ReadError::input(place, format!("{cells} cells"), lists.len().to_string(), HINT))
    }

    /// Cells that end at these of their points.
    pub(crate) fn ending(ends: &[f64], corners: &[f64], points: usize, place: Place) -> Result<Self, ReadError> {
        let mut lists = Self::default();
        let mut start = 0;
        for (cell, end) in ends.iter().enumerate() {
            let Some(end) = whole(*end, corners.len()).filter(|end| *end >= start) else {
                let expected = format!("cell {cell} to end at {start} to {} of the points of cells", corners.len());
                return Err(ReadError::input(place, expected, end.to_string(), HINT));
            };
            lists.push(&corners[start..end], points, place)?;
            start = end;
        }
        if start == corners.len() {
            return Ok(lists);
        }
        let expected = format!("{} points in the cells, as many as there are", corners.len());
        Err(ReadError::input(place, expected, start.to_string(), HINT))
    }

    fn push(&mut self, corners: &[f64], points: usize, place: Place) -> Result<(), ReadError> {
        let cell = self.len();
        for corner in corners {
            let rank = points.checked_sub(1).and_then(|last| whole(*corner, last));
            let Some(rank) = rank.and_then(|rank| u32::try_from(rank).ok()) else {
                let expected = format!("points of cell {cell} among the {points} that there are, counted from 0");
                return Err(ReadError::input(place, expected, corner.to_string(), HINT));
            };
            self.corners.push(rank);
        }
        self.ends.push(self.corners.len());
        Ok(())
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(self.ends.as_slice()) + size_of_val(self.corners.as_slice())) as u64
    }

    /// These cells and others behind them, whose points begin at this rank.
    pub(crate) fn append(&mut self, others: &Self, first: u32) {
        let before = self.corners.len();
        self.corners.extend(others.corners.iter().map(|corner| first + corner));
        self.ends.extend(others.ends.iter().map(|end| before + end));
    }
}

/// A whole number from 0 to `most`.
fn whole(number: f64, most: usize) -> Option<usize> {
    (number >= 0.0 && number <= most as f64 && number.fract() == 0.0).then_some(number as usize)
}
