//! Groups and their coverage in one go, for the discs of one object.

use super::extended::{DuplicateParams, EnlargeParams, duplicates, enlarged_radii};
use super::{
    Collisions, GraphParams, Groups, HashParams, Membership, OverlapGraph, Relaxation, WeightedParams, check_count,
    covering_factor, hash_grouping, minimum_coloring, weighted_coloring,
};
use crate::Error;
use splat_core::{Cloud, Progress};

/// Bytes of neighbours a disc that may be listed, and how many there may be of few discs.
const LISTED: [u64; 2] = [512, 1 << 24];

/// Bytes a disc of what is made beside lists: the disc twice, its group, what it covers.
const BESIDE: u64 = 200;

/// The method that forms groups of discs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Section 4.1, MGC: as few groups as are found, [`Recipe::groups`] at most.
    Minimum {
        /// c of section 4.1: radii are so much shorter when edges are found, in (0, 1\].
        factor: f32,
    },
    /// Section 4.2, WGC.
    Weighted,
    /// Section 4.3, by a hash table.
    Hash(Collisions),
}

/// The method by which each group covers the surface (section 4.4.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coverage {
    /// It does not: groups have holes.
    Partial,
    /// Discs of other groups are added where it has holes.
    Duplicates,
    /// Its discs are enlarged (Eqs. 11-13).
    Enlarged,
    /// Its discs are enlarged as the hash table says: √50/4 for 8 groups (Figure 10).
    Bound,
}

/// The recipe of an object's groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recipe {
    /// How groups are found.
    pub method: Method,
    /// Number of groups K, 1 to 256.
    pub groups: u32,
    /// How groups are extended.
    pub coverage: Coverage,
    /// Radius of a disc over the cut-off radius of its splat, in (0, 1\]; see [`Params::disc_scale`](crate::Params::disc_scale).
    pub disc_scale: f32,
    /// ε of Eq. 8 as a share of the discs' radius, > 0.
    pub gap: f32,
}

impl Recipe {
    /// Groups the discs of a cloud.
    ///
    /// # Errors
    /// [`Error::Parameter`] and [`Error::Cloud`] for bad input; [`Error::Limit`] for discs that overlap too many others, see
    /// [`Recipe::bytes`]; [`Error::Cancelled`].
    pub fn group(&self, cloud: &Cloud, progress: Option<&Progress>) -> Result<Membership, Error> {
        check_count(self.groups)?;
        let max_bytes = listed(cloud.len() as u64);
        let overlaps = |relaxation: Relaxation| {
            OverlapGraph::build(cloud, &GraphParams { disc_scale: self.disc_scale, relaxation, max_bytes }, progress)
        };
        let mut graph = None;
        let groups = match self.method {
            Method::Minimum { factor } => {
                let relaxed = overlaps(Relaxation { factor, ..Relaxation::default() })?;
                let groups = minimum_coloring(&relaxed, self.groups, progress)?.groups;
                graph = (factor == 1.0).then_some(relaxed);
                groups
            }
            Method::Weighted => {
                let graph = graph.insert(overlaps(Relaxation::default())?);
                let params = WeightedParams { groups: self.groups, gap: self.gap, ..WeightedParams::default() };
                weighted_coloring(graph, &params, progress)?
            }
            Method::Hash(collisions) => {
                let params = HashParams { groups: self.groups, disc_scale: self.disc_scale, collisions };
                hash_grouping(cloud, &params, progress)?
            }
        };
        self.extended(cloud, groups, graph, max_bytes, progress)
    }

    fn extended(
        &self,
        cloud: &Cloud,
        groups: Groups,
        graph: Option<OverlapGraph>,
        max_bytes: u64,
        progress: Option<&Progress>,
    ) -> Result<Membership, Error> {
        let Self { disc_scale, gap, .. } = *self;
        let factors: Vec<f64> = match self.coverage {
            Coverage::Partial => return Ok(groups.into()),
            Coverage::Duplicates => {
                let params = GraphParams { disc_scale, max_bytes, ..GraphParams::default() };
                let graph = graph.map_or_else(|| OverlapGraph::build(cloud, &params, progress), Ok)?;
                let params = DuplicateParams { gap, ..DuplicateParams::default() };
                let added = duplicates(&graph, &groups, &params, progress)?;
                return Ok(groups.with_further(&added).into());
            }
            Coverage::Enlarged => {
                let params = EnlargeParams { disc_scale, gap, max_bytes };
                enlarged_radii(cloud, &groups, &params, progress)?.iter().map(|group| group.factor).collect()
            }
            Coverage::Bound => vec![covering_factor(groups.count())?.max(1.0); groups.count() as usize],
        };
        let reach = groups.by_disc().iter().map(|&group| factors[usize::from(group)] as f32).collect();
        Ok(Membership { groups, reach })
    }

    /// Most bytes that grouping so many discs takes, with what is left of it.
    pub fn bytes(&self, discs: u64) -> u64 {
        let further = if self.coverage == Coverage::Duplicates { 4 + u64::from(self.groups) } else { 4 };
        match (self.method, self.coverage) {
            (Method::Hash(_), Coverage::Partial | Coverage::Bound) => discs * (BESIDE + further),
            // Half as much again for the shares of overlapped area, and a second list where a relaxed graph does not tell all.
            _ => discs * (BESIDE + further) + 2 * listed(discs),
        }
    }
}

fn listed(discs: u64) -> u64 {
    LISTED[0] * discs + LISTED[1]
}
