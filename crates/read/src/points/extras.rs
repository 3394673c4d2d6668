//! Columns of points that have no meaning of their own: kept where they are asked for by name, else measured where that is asked for.

use crate::error::ReadError;
use crate::reading::NamedColumn;
use crate::stream::input;
use crate::{Notes, ReadParams};
use splat_core::points::attributes::{attribute, expected};
use splat_core::points::unaliased;
use splat_core::text::escaped;
use splat_core::{Association, Column};

/// Most bytes of a name that are shown.
pub(crate) const LONGEST_NAME: usize = 40;

/// What to do about a number that an attribute cannot have.
pub(crate) const UNFIT_HINT: &str = "points are drawn by this column: repair it, or give it another name";

/// The further columns of a file while it is read, each by its rank among the fields of a point.
#[derive(Default)]
pub(crate) struct Extras {
    list: Vec<Extra>,
    /// What their numbers belong to, of a mesh.
    association: Option<Association>,
    /// What was expected, and what was found.
    unfit: Option<(&'static str, String)>,
}

struct Extra {
    rank: usize,
    column: Column,
    is_kept: bool,
    /// Whether its numbers are looked at.
    is_read: bool,
    /// Whether they say what points look like.
    is_attribute: bool,
    range: [f64; 2],
}

impl Extras {
    /// Of the columns of a file, in the order of their ranks, those that `params` ask for; `spare` says which have a meaning already, and are there only if they are
    /// asked for by name.
    pub(crate) fn new<'a>(columns: impl IntoIterator<Item = (usize, &'a [u8], bool)>, params: &ReadParams) -> Self {
        let extra = |(rank, name, spare): (usize, &[u8], bool)| {
            let asked = |asked: &String| asked.as_bytes() == name || unaliased(asked).as_bytes() == name;
            let column = Column { name: String::from_utf8_lossy(name).into_owned(), values: Vec::new() };
            let is_attribute = attribute(&column.name, params.matter).is_some();
            let is_kept = is_attribute || params.columns.iter().any(asked);
            let is_read = is_kept || params.ranges;
            let range = [f64::INFINITY, f64::NEG_INFINITY];
            (is_kept || !spare).then_some(Extra { rank, column, is_kept, is_read, is_attribute, range })
        };
        Self { list: columns.into_iter().filter_map(extra).collect(), association: None, unfit: None }
    }

    /// The same of a mesh, whose columns have no meaning but their numbers.
    pub(crate) fn of_mesh<'a>(
        columns: impl IntoIterator<Item = (usize, &'a [u8], bool)>,
        association: Association,
        params: &ReadParams,
    ) -> Self {
        let mut extras = Self { association: Some(association), ..Self::new(columns, params) };
        for extra in &mut extras.list {
            extra.is_kept = params.columns.contains(&extra.column.name);
            extra.is_read = extra.is_kept || params.ranges;
            extra.is_attribute = false;
        }
        extras
    }

    /// Leaves out the columns of these names.
    pub(crate) fn without(mut self, names: &[&[u8]]) -> Self {
        self.list.retain(|extra| !names.contains(&extra.column.name.as_bytes()));
        self
    }

    /// Whether there are any whose numbers are to be pushed.
    pub(crate) fn reads(&self) -> bool {
        self.list.iter().any(|extra| extra.is_read)
    }

    /// Ranks of the columns whose numbers are to be pushed.
    pub(crate) fn read(&self) -> impl Iterator<Item = usize> {
        self.list.iter().filter(|e| e.is_read).map(|e| e.rank)
    }

    /// Whether the column of a rank is kept.
    pub(crate) fn keeps(&self, rank: usize) -> bool {
        self.rank(rank).is_some_and(|i| self.list[i].is_kept)
    }

    /// Where the column of a rank is: they are in the order of their ranks, and a file may have very many.
    fn rank(&self, rank: usize) -> Option<usize> {
        self.list.binary_search_by_key(&rank, |e| e.rank).ok()
    }

    /// Bytes that a point takes in the columns that are kept.
    pub(crate) fn bytes_per_point(&self) -> u64 {
        8 * self.list.iter().filter(|e| e.is_kept).count() as u64
    }

    /// Room for so many more points.
    pub(crate) fn reserve(&mut self, points: usize) -> Result<(), ReadError> {
        self.list.iter_mut().filter(|e| e.is_kept).try_for_each(|e| input::reserve(&mut e.column.values, points))
    }

    /// What was expected in the place of a point's number in the column of a rank, where an attribute cannot have it.
    pub(crate) fn unfit(&self, rank: usize, number: f64) -> Option<&'static str> {
        let extra = self.rank(rank).map(|i| &self.list[i]).filter(|e| e.is_attribute)?;
        expected(&extra.column.name, number)
    }

    /// Takes the numbers of a point by their ranks.
    pub(crate) fn push(&mut self, number: impl Fn(usize) -> f64) {
        self.list.iter_mut().filter(|e| e.is_read).for_each(|e| e.push(number(e.rank)));
    }

    /// Takes the numbers of many points of the column of a rank.
    pub(crate) fn extend(&mut self, rank: usize, numbers: impl Iterator<Item = f64>) {
        let Some(extra) = self.rank(rank).map(|i| &mut self.list[i]) else { return };
        for number in numbers {
            let Column { name, values } = &extra.column;
            let expected = if extra.is_attribute { expected(name, number) } else { None };
            if let (Some(expected), None) = (expected, &self.unfit) {
                self.unfit = Some((expected, format!("{number} of {name} at point {}", values.len())));
            }
            extra.push(number);
        }
    }

    /// The first number of [`Extras::extend`] that an attribute cannot have: what was expected and what was found.
    pub(crate) fn unfit_of_many(&self) -> Option<(&'static str, &str)> {
        self.unfit.as_ref().map(|(expected, found)| (*expected, found.as_str()))
    }

    /// The columns that are kept; tells the notes of all.
    pub(crate) fn finish(self, notes: &mut Notes) -> Vec<Column> {
        let range = |e: &Extra| (e.range[0] <= e.range[1]).then_some(e.range);
        let named = |e: &Extra| NamedColumn {
            name: escaped(e.column.name.as_bytes(), LONGEST_NAME),
            range: range(e),
            association: self.association,
        };
        notes.columns.extend(self.list.iter().map(named));
        self.list.into_iter().filter(|e| e.is_kept).map(|e| e.column).collect()
    }
}

impl Extra {
    fn push(&mut self, number: f64) {
        if number.is_finite() {
            self.range = [self.range[0].min(number), self.range[1].max(number)];
        }
        if self.is_kept {
            self.column.values.push(number);
        }
    }
}
