//! Arrays of surfaces that colours may be taken from: kept where they are asked for by name, else measured where that is asked for.

use crate::points::extras::LONGEST_NAME;
use crate::reading::NamedColumn;
use crate::volumes::selection::length_is_drawn;
use crate::{Notes, ReadParams};
use splat_core::text::escaped;
use splat_core::{Association, MeshColumn};

/// Most numbers of a tuple that can be asked for one by one: those of a tensor.
const MOST_NUMBERS: u64 = 9;

/// An array of numbers of a surface.
pub(crate) struct SurfaceArray<'n> {
    pub(crate) name: &'n str,
    /// Of vertices, or of what is a triangle or several: faces and cells.
    pub(crate) association: Association,
    /// Numbers of a tuple.
    pub(crate) numbers: u64,
}

/// Which number a column has of a tuple.
#[derive(Debug, Clone, Copy)]
enum Part {
    Magnitude,
    Component(usize),
}

/// The arrays of a surface, as far as they are asked for.
pub(crate) struct NamedArrays<'p> {
    params: &'p ReadParams,
    kept: Vec<MeshColumn>,
    told: Vec<NamedColumn>,
    /// Vectors that are asked for by their name alone.
    by_length: Vec<String>,
}

impl SurfaceArray<'_> {
    /// Whether columns can be made of it.
    pub(crate) fn is_offered(&self) -> bool {
        (1..=MOST_NUMBERS).contains(&self.numbers)
    }

    /// Its columns: the array itself, or of several numbers a tuple their magnitude and each of them.
    fn columns(&self) -> Vec<(String, Part)> {
        let name = escaped(self.name.as_bytes(), LONGEST_NAME);
        if self.numbers == 1 {
            return vec![(name, Part::Component(0))];
        }
        let component = |i: usize| match (self.numbers, ["x", "y", "z", "w"].get(i)) {
            (2..=4, Some(axis)) => format!("{name}:{axis}"),
            _ => format!("{name}:{i}"),
        };
        let magnitude = (format!("{name}:magnitude"), Part::Magnitude);
        let components = (0..self.numbers as usize).map(|i| (component(i), Part::Component(i)));
        std::iter::once(magnitude).chain(components).collect()
    }
}

impl Part {
    fn number_of(self, tuple: &[f64]) -> f64 {
        match self {
            Self::Magnitude => tuple.iter().map(|number| number * number).sum::<f64>().sqrt(),
            Self::Component(i) => tuple[i],
        }
    }
}

impl<'p> NamedArrays<'p> {
    pub(crate) fn new(params: &'p ReadParams) -> Self {
        Self { params, kept: Vec::new(), told: Vec::new(), by_length: Vec::new() }
    }

    /// The name by which a column is asked for: one of faces that vertices have too is told by what it belongs to.
    fn own_name(&self, name: String) -> String {
        if self.told.iter().any(|told| told.name == name) { format!("face:{name}") } else { name }
    }

    /// Whether the numbers of an array are needed.
    pub(crate) fn needs(&self, array: &SurfaceArray<'_>) -> bool {
        let is_asked = |(name, _): (String, Part)| self.params.columns.contains(&self.own_name(name));
        let is_needed =
            self.params.ranges || self.bare_name(array).is_some() || array.columns().into_iter().any(is_asked);
        array.is_offered() && is_needed
    }

    /// The name of a vector that is asked for alone, which stands for its length.
    fn bare_name(&self, array: &SurfaceArray<'_>) -> Option<String> {
        let name = escaped(array.name.as_bytes(), LONGEST_NAME);
        let length = format!("{name}:magnitude");
        let column = if self.told.iter().any(|told| told.name == length) { format!("face:{name}") } else { name };
        (array.numbers > 1 && self.params.columns.contains(&column)).then_some(column)
    }

    /// Takes an array, with its numbers where they are needed.
    pub(crate) fn take(&mut self, array: &SurfaceArray<'_>, numbers: Option<&[f64]>) {
        if !array.is_offered() {
            return;
        }
        if let Some((name, numbers)) = self.bare_name(array).zip(numbers) {
            let values =
                numbers.chunks_exact(array.numbers as usize).map(|tuple| Part::Magnitude.number_of(tuple)).collect();
            self.by_length.push(name.clone());
            self.kept.push(MeshColumn { name, association: array.association, values });
        }
        for (name, part) in array.columns() {
            let name = self.own_name(name);
            let association = array.association;
            let tuples =
                numbers.map(|numbers| numbers.chunks_exact(array.numbers as usize).map(|tuple| part.number_of(tuple)));
            let measured = tuples.clone().filter(|_| self.params.ranges).and_then(range);
            if let Some(values) = tuples.filter(|_| self.params.columns.contains(&name)) {
                self.kept.push(MeshColumn { name: name.clone(), association, values: values.collect() });
            }
            self.told.push(NamedColumn { name, range: measured, association: Some(association) });
        }
    }

    /// The columns that are kept; tells the notes of all.
    pub(crate) fn finish(self, notes: &mut Notes) -> Vec<MeshColumn> {
        notes.columns.extend(self.told);
        self.by_length.iter().for_each(|name| notes.remark(length_is_drawn(name)));
        self.kept
    }
}

/// The least and the greatest finite number.
fn range(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] =
        numbers.filter(|n| n.is_finite()).fold(none, |[low, high], number| [low.min(number), high.max(number)]);
    (low <= high).then_some([low, high])
}
