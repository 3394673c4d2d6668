//! The values of a volume, from the least to the greatest.

use super::classifier::Base;
use rayon::prelude::*;

/// Values side by side, so that vectors are compared.
const BESIDE: usize = 16;

/// Values of one task.
const CHUNK: usize = 1 << 16;

/// All values from one to another, both included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ValueRange {
    pub(crate) least: f32,
    pub(crate) greatest: f32,
}

impl ValueRange {
    /// That of no value.
    const NONE: Self = Self { least: f32::INFINITY, greatest: f32::NEG_INFINITY };

    /// From the least to the greatest of some values.
    pub(crate) fn of_values(values: &[f32]) -> Self {
        values.par_chunks(CHUNK).map(Self::of_chunk).reduce(|| Self::NONE, Self::join)
    }

    fn of_chunk(chunk: &[f32]) -> Self {
        let mut least = [Self::NONE.least; BESIDE];
        let mut greatest = [Self::NONE.greatest; BESIDE];
        for values in chunk.chunks(BESIDE) {
            for ((least, greatest), v) in least.iter_mut().zip(&mut greatest).zip(values) {
                *least = if *v < *least { *v } else { *least };
                *greatest = if *v > *greatest { *v } else { *greatest };
            }
        }
        let ranges = least.into_iter().zip(greatest).map(|(least, greatest)| Self { least, greatest });
        ranges.fold(Self::NONE, Self::join)
    }

    /// The least range that holds both.
    fn join(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), greatest: self.greatest.max(other.greatest) }
    }

    /// The same of values relative to a base.
    pub(crate) fn relative_to(self, base: Base) -> Self {
        Self { least: base.relative(self.least), greatest: base.relative(self.greatest) }
    }

    /// Whether all of another range lies in this one.
    pub(crate) fn holds(&self, other: &Self) -> bool {
        self.least <= other.least && other.greatest <= self.greatest
    }
}
