//! Groups of discs that do not overlap.

use crate::Error;

/// For each disc, the group that it is a member of.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Groups {
    count: u32,
    of: Vec<u8>,
}

impl Groups {
    /// Groups told from outside: `of` holds the group of each disc, by its place in the cloud.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a count outside 1..=256 and for a disc whose group is not below the count.
    pub fn new(count: u32, of: Vec<u8>) -> Result<Self, Error> {
        if !(1..=256).contains(&count) {
            return Err(Error::parameter("number of groups", count, "between 1 and 256"));
        }
        if let Some(group) = of.iter().find(|&&group| u32::from(group) >= count) {
            return Err(Error::parameter("group of a disc", group, "below the number of groups"));
        }
        Ok(Self { count, of })
    }

    /// Number of groups K; a group may be empty.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Group of each disc, by its place in the cloud, less than [`Groups::count`].
    pub fn of(&self) -> &[u8] {
        &self.of
    }
}
