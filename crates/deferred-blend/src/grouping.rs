//! Groups of discs that do not overlap.

/// For each disc, the group that it is a member of.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Groups {
    /// Number of groups K; a group may be empty.
    pub count: u32,
    /// Group of each disc, by its place in the cloud, less than `count`.
    pub of: Vec<u8>,
}
