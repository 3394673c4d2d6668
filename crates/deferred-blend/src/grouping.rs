//! Groups of discs that do not overlap (Zhang and Pajarola 2007, section 4).
//!
//! Discs that share a group are drawn into one image, so they should not overlap. Three methods separate them:
//!
//! | method | paper | number of groups K | remaining overlap |
//! |---|---|---|---|
//! | [`minimum_coloring`] | section 4.1, MGC | found | none beyond the [`Relaxation`] of the graph |
//! | [`weighted_coloring`] | section 4.2, WGC, Eqs. 6-8 | given | little |
//! | [`hash_grouping`] | section 4.3, Eq. 9 | given | more, at a fraction of the time |
//!
//! The colourings work on an [`OverlapGraph`] (Eq. 5). Groups are valid for every view. [`extended`] makes each group cover the surface
//! alone (section 4.4). A [`Recipe`] makes groups and their coverage in one step. [`KeptGroups`] finds them again after an object has moved.
//!
//! No method depends on the order of the cloud, on the number of threads, on the cloud's origin, or on a scale by a power of two:
//! ties are broken by the canonical order of the cloud ([`Cloud::canonical_order`](splat_core::Cloud::canonical_order)).
//!
//! ```
//! use deferred_blend::grouping::{GraphParams, OverlapGraph, minimum_coloring};
//! use splat_core::{Cloud, Splat, SplatKind, glam::{DVec3, Vec3}};
//!
//! let mut cloud = Cloud::new(DVec3::new(1.0e7, 0.0, 0.0));
//! for x in [0.0, 1.5, 3.0, 4.5] {
//!     let position = Vec3::new(x, 0.0, 0.0);
//!     cloud.push(&Splat { position, normal: Vec3::Y, kind: SplatKind::Opaque, ..Splat::default() });
//! }
//! let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None)?;
//! assert_eq!(graph.edges(), 3);
//! let coloring = minimum_coloring(&graph, 256, None)?;
//! assert_eq!(coloring.groups.count(), 2);
//! # Ok::<(), deferred_blend::Error>(())
//! ```

mod area;
mod cells;
pub mod extended;
mod graph;
mod hash;
mod kept;
mod lattice;
mod membership;
mod minimum;
mod recipe;
mod surfels;
mod weighted;

pub use graph::{Coplanar, GraphParams, OverlapGraph, Relaxation};
pub use hash::{Collisions, HashParams, covering_factor, hash_grouping};
pub use kept::{CloudMembers, GroupsOfObjects, KeptGroups, ObjectError, ObjectMembers};
pub use membership::Membership;
pub use minimum::{Coloring, minimum_coloring};
pub use recipe::{Coverage, Method, Recipe};
pub use weighted::{WeightedParams, weighted_coloring, weighted_cost};

use crate::Error;
use splat_core::Progress;

/// Most groups: a disc's group takes one byte.
pub const MOST_GROUPS: u32 = 256;

/// The groups of each disc: the group that it belongs to, and further groups that it was added to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Groups {
    count: u32,
    by_disc: Vec<u8>,
    further: Further,
}

/// Groups of each disc beside its own, as compressed rows; empty where no disc has any.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Further {
    starts: Vec<u32>,
    groups: Vec<u8>,
}

impl Groups {
    /// Groups that the caller states: `by_disc` holds the group of each disc, by its place in the cloud.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a count outside 1..=256 and for a disc whose group is not below the count.
    pub fn new(count: u32, by_disc: Vec<u8>) -> Result<Self, Error> {
        check_count(count)?;
        if let Some(group) = by_disc.iter().find(|&&group| u32::from(group) >= count) {
            return Err(Error::parameter("group of a disc", group, "below the number of groups"));
        }
        Ok(Self::of_each(count, by_disc))
    }

    /// Groups that were made here.
    fn of_each(count: u32, by_disc: Vec<u8>) -> Self {
        Self { count, by_disc, further: Further::default() }
    }

    /// The same groups with discs added to them, such as [`extended::duplicates`]: for each group the places of those in the cloud.
    ///
    /// # Panics
    /// If a place is out of range.
    pub fn with_further(self, added: &[Vec<u32>]) -> Self {
        let mut rows: Vec<Vec<u8>> = vec![Vec::new(); self.by_disc.len()];
        for (group, places) in (0u8..).zip(added) {
            places.iter().for_each(|&place| rows[place as usize].push(group));
        }
        Self { further: Further::from_rows(rows.iter().map(Vec::as_slice)), ..self }
    }

    /// Number of groups K; a group may be empty.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Group of each disc, by its place in the cloud, less than [`Groups::count`].
    pub fn by_disc(&self) -> &[u8] {
        &self.by_disc
    }

    /// Groups that the disc at a place was added to.
    ///
    /// # Panics
    /// If the place is out of range.
    pub fn further(&self, place: usize) -> &[u8] {
        let starts = &self.further.starts;
        if starts.is_empty() { &[] } else { &self.further.groups[starts[place] as usize..starts[place + 1] as usize] }
    }

    /// Whether the disc at a place is a member of a group, by itself or because it was added.
    #[inline]
    pub fn has(&self, place: usize, group: u32) -> bool {
        u32::from(self.by_disc[place]) == group || self.further(place).iter().any(|g| u32::from(*g) == group)
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let Further { starts, groups } = &self.further;
        (size_of_val(&*self.by_disc) + size_of_val(&**starts) + size_of_val(&**groups)) as u64
    }
}

impl Further {
    /// Rows in the order of the discs; all empty ones are none.
    fn from_rows<'a>(rows: impl Iterator<Item = &'a [u8]>) -> Self {
        let mut further = Self { starts: vec![0], groups: Vec::new() };
        for row in rows {
            further.groups.extend_from_slice(row);
            further.starts.push(further.groups.len() as u32);
        }
        if further.groups.is_empty() { Self::default() } else { further }
    }
}

fn check_cancelled(progress: Option<&Progress>) -> Result<(), Error> {
    if progress.is_some_and(Progress::is_cancelled) { Err(Error::Cancelled) } else { Ok(()) }
}

fn check_count(count: u32) -> Result<(), Error> {
    if !(1..=MOST_GROUPS).contains(&count) {
        return Err(Error::parameter("number of groups", count, "between 1 and 256"));
    }
    Ok(())
}
