//! The cost of a map: predicted before any work, counted afterwards.

use crate::mapping::Octahedral;
use crate::planning::appearance::{Appearance, Entries};
use crate::planning::lit::Lit;
use crate::planning::survey::Survey;
use splat_core::SplatKind;
use std::fmt;

/// The rule that determines the size of a table's cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// [`crate::Resolution::Cells`].
    Asked,
    /// Half the spacing of splats: nothing made it coarser.
    Spacing,
    /// The most cells that a table of so many splats has.
    Cells,
    /// The most entries that so many splats make, see [`crate::Resolution::Auto`].
    Entries,
    /// [`crate::Params::limits`].
    Memory,
}

/// In words, said of cells.
impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Asked => "as asked for",
            Self::Spacing => "of half a spacing",
            Self::Cells => "coarser by their number",
            Self::Entries => "coarser by the number of entries",
            Self::Memory => "coarser by memory",
        })
    }
}

/// Work and memory predicted from the casters' apparent sizes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Columns and rows of the table.
    pub size: [u64; 2],
    /// The rule that determines its cells.
    pub limit: Limit,
    /// Entries that translucent splats deposit; of a ball 0.6 to 1.4 times the counted ones.
    pub entries: f64,
    /// Rays of cells that sample splats: several a cell where footprints bend, near a lamp; none where the closed form serves.
    pub rays: f64,
    /// Bytes that the build takes at its peak.
    pub bytes: u64,
    /// Bytes of the finished map among them.
    pub map_bytes: u64,
}

/// The counts of a build.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Splats that throw shadows.
    pub casters: u64,
    /// Translucent casters among them, which deposit entries.
    pub translucent: u64,
    /// Cells of the table.
    pub cells: u64,
    /// Entries deposited.
    pub entries: u64,
    /// Entries kept: equal distances are merged, and lists stop at the visible limit.
    pub kept: u64,
    /// Bytes of the finished map.
    pub bytes: u64,
}

/// Entries and bytes for a table of so many columns and rows of cells of side `cell`.
pub(crate) fn predict(
    look: &Appearance,
    survey: &Survey,
    lit: &Lit,
    cell: f64,
    size: [f64; 2],
    limit: Limit,
    octahedral: bool,
) -> Prediction {
    let cells = size[0] * size[1];
    let kinds = survey.kinds;
    let [media, surfaces] = [SplatKind::Medium, SplatKind::Surface].map(|kind| kinds[kind as usize]);
    let Entries { entries, rays } = look.entries(cell, cells, lit.wide());
    let entries = lit.share.min(lit.unhidden) * entries;
    let channels = if survey.coloured { 3.0 } else { 1.0 };
    // A distance and its sum.
    let knot = 4.0 + 4.0 * channels;
    let lists = u64::from(media > 0) + u64::from(surfaces > 0);
    let depth = 4.0 * u64::from(kinds[SplatKind::Opaque as usize] > 0) as f64;
    let directions = if octahedral { Octahedral::bytes(size[0] as u32) as f64 } else { 0.0 };
    let map = cells * (8.0 * lists as f64 + depth) + directions + entries * knot;
    // Before they stand in the lists, entries stand with their cells, parted by ranges.
    let peak = map + entries * (8.0 + 4.0 * channels);
    let [bytes, map_bytes] = [peak, map].map(|bytes| bytes.min(u64::MAX as f64) as u64);
    let rays = lit.share * rays;
    Prediction { size: size.map(|n| n as u64), limit, entries, rays, bytes, map_bytes }
}
