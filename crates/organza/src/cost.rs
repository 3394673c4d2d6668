//! The cost model: items of work, counted before the work is done, times the nanoseconds that an item takes.
//!
//! The counted work drives the progress bar, `explain`, and the sentence about a long run. No picture depends on it: it reads no clock and
//! decides nothing.

mod loading;
mod prediction;
mod rates;

pub(crate) use loading::{before_conversion, before_reading, converting, reading, reading_file, samples};
pub use prediction::{Change, CountedPass, Prediction, announcement_of_frames, duration_text};
pub(crate) use rates::Growth;
pub use rates::{BUILT_IN_MACHINE, Item, Rates};

/// The number of items of one kind that a pass handles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// The kind.
    pub item: Item,
    /// Predicted number, ≥ 0.
    pub number: f64,
}

impl Count {
    pub(crate) fn new(item: Item, number: f64) -> Self {
        Self { item, number }
    }
}

/// The translucent part of a scene that one technique draws.
pub(crate) struct Translucent {
    /// Predicted number of its splats in view.
    pub(crate) splats: f64,
    /// Predicted number of fragments of their footprints.
    pub(crate) fragments: f64,
    /// What the technique counts of objects that it draws from their own data: particles of a set over all ranges, fragments of voxels.
    pub(crate) of_own_data: f64,
    /// Samples of the picture that a slab of sheets covers, times slabs and lights.
    pub(crate) slab_samples: f64,
    /// Ranges of depth.
    pub(crate) ranges: f64,
    /// Whether the technique draws anything, splats or objects from their own data.
    pub(crate) any: bool,
}

/// Entries of a shadow map from which on its stage names their number: tens of seconds.
const MANY_ENTRIES: f64 = 5e7;

/// The stage of shadow map `rank` of `count`, counted from 1, with its predicted number of entries.
pub(crate) fn shadow_map(rank: usize, count: usize, entries: f64) -> String {
    let many = (entries >= MANY_ENTRIES).then(|| format!(", {:.0} million entries", 1e-6 * entries));
    format!("shadow map {rank} of {count}{}", many.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shadow_map_of_many_entries_tells_them_before_it_is_built() {
        assert_eq!(shadow_map(1, 2, 3e6), "shadow map 1 of 2");
        assert_eq!(shadow_map(1, 2, 1.16e8), "shadow map 1 of 2, 116 million entries");
    }
}
