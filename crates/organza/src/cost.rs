//! The cost model: items of work, counted before the work is done, times the nanoseconds that an item takes.
//!
//! The counted work drives the progress bar, `explain`, and the sentence about a long run. No picture depends on it: it reads no clock and
//! decides nothing.

pub(crate) mod extent;
mod loading;
mod prediction;
mod rates;

pub(crate) use loading::{before_conversion, before_reading, converting, reading, reading_file, samples};
pub(crate) use prediction::joined;
pub use prediction::{Change, CountedPass, EffectWork, Prediction, announcement_of_frames, duration_text};
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

/// Counted work of a technique on objects that it draws from their own data.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct OwnWork {
    /// Particles of a set over all ranges that take no longer than most, or fragments of voxels.
    pub(crate) items: f64,
    /// Particles of a set over all ranges that take longer, by what they are found in.
    pub(crate) particles: FoundParticles,
    /// Samples of the picture that show in slabs of sheets, by what each takes over reading and classifying it.
    pub(crate) slab_samples: f64,
    /// Rows of footprints in slabs of sweeps.
    pub(crate) swept_rows: f64,
    /// Samples of the eye's images and of lights' that read volumes in slabs across half vectors.
    pub(crate) medium_samples: f64,
    /// Looks of points of lights for the polygons before volumes and surfaces.
    pub(crate) polygon_looks: f64,
    /// Samples of lights' images that are moved for points of lights, in all slabs.
    pub(crate) soft_samples: f64,
    /// Ranges of depth that it draws in; `None` where it does not pass over any.
    pub(crate) ranges: Option<usize>,
}

/// Entries of a shadow map for each splat, as long as its cells are not known: 18 to 62 in scenes of a hundred thousand to three million splats.
pub(crate) const ENTRIES_PER_SPLAT: f64 = 20.0;

/// Particles of a set by what they are found in.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FoundParticles {
    /// In cells of volumes.
    pub(crate) in_cells: f64,
    /// On lines through fields by formulas.
    pub(crate) in_fields: f64,
    /// On lines through cells that an isosurface passes, between eight lattice points.
    pub(crate) in_lattices: f64,
    /// The same by cubics between 64 of them.
    pub(crate) in_cubics: f64,
    /// On lines through surfaces of scattered points.
    pub(crate) in_points: f64,
}

impl FoundParticles {
    /// All of them.
    pub(crate) fn sum(&self) -> f64 {
        self.in_cells + self.in_fields + self.in_lattices + self.in_cubics + self.in_points
    }
}

/// The translucent part of a scene that one technique draws.
pub(crate) struct Translucent {
    /// Predicted number of its splats in view.
    pub(crate) splats: f64,
    /// Predicted number of fragments of their footprints.
    pub(crate) fragments: f64,
    /// What the technique counts of objects that it draws from their own data.
    pub(crate) own_work: OwnWork,
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
