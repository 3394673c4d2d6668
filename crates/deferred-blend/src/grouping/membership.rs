//! The groups that draw a disc, and the radius in each.

use super::Groups;

/// Groups of discs that cover what they show: further members, or larger radii.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Membership {
    pub(super) groups: Groups,
    /// By place in the cloud; empty where all are 1.
    pub(super) reach: Vec<f32>,
}

impl From<Groups> for Membership {
    /// Each group draws its discs as large as they are.
    fn from(groups: Groups) -> Self {
        Self { groups, reach: Vec::new() }
    }
}

impl Membership {
    /// The groups.
    pub fn groups(&self) -> &Groups {
        &self.groups
    }

    /// Factor on the radius of the disc at a place, ≥ 1.
    ///
    /// # Panics
    /// If the place is out of range.
    #[inline]
    pub fn reach(&self, place: usize) -> f32 {
        if self.reach.is_empty() { 1.0 } else { self.reach[place] }
    }

    /// Number of discs.
    pub fn discs(&self) -> usize {
        self.groups.by_disc.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.groups.bytes() + size_of_val(&*self.reach) as u64
    }

    /// The same with its discs in another order: place i gets what place `from[i]` had.
    ///
    /// # Panics
    /// If a place is out of range.
    pub fn rearranged(&self, from: &[u32]) -> Self {
        let Groups { count, by_disc, .. } = &self.groups;
        let mut groups = Groups::of_each(*count, from.iter().map(|&i| by_disc[i as usize]).collect());
        groups.further = super::Further::from_rows(from.iter().map(|&i| self.groups.further(i as usize)));
        let reach =
            if self.reach.is_empty() { Vec::new() } else { from.iter().map(|&i| self.reach[i as usize]).collect() };
        Self { groups, reach }
    }

    /// The membership of a cloud of `discs` splats of which each part has some, by their places; the others are in group 0.
    ///
    /// Parts may differ in their number of groups. Where one has fewer, its groups are drawn again and again, so that no image lacks it.
    ///
    /// # Panics
    /// If a place is out of range, or a part has not as many places as discs.
    pub fn join(discs: usize, parts: &[(&[u32], Self)]) -> Self {
        let count = parts.iter().map(|(_, part)| part.groups.count).max().unwrap_or(1);
        let mut by_disc: Vec<u8> = vec![0; discs];
        let mut rows: Vec<Vec<u8>> = Vec::new();
        let has_rows = parts.iter().any(|(_, p)| p.groups.count < count || !p.groups.further.starts.is_empty());
        rows.resize(if has_rows { discs } else { 0 }, Vec::new());
        let mut reach = vec![1.0; if parts.iter().any(|(_, part)| !part.reach.is_empty()) { discs } else { 0 }];
        for (places, part) in parts {
            assert_eq!(places.len(), part.discs(), "invariant: one place a disc");
            for (i, &place) in places.iter().enumerate() {
                let first = part.groups.by_disc[i];
                let place = place as usize;
                by_disc[place] = first;
                if let Some(row) = rows.get_mut(place) {
                    let again = |group: u8| (u32::from(group)..count).step_by(part.groups.count as usize);
                    let members = std::iter::once(first).chain(part.groups.further(i).iter().copied()).flat_map(again);
                    row.extend(members.map(|group| group as u8).filter(|group| *group != first));
                }
                if let Some(reach) = reach.get_mut(place) {
                    *reach = part.reach(i);
                }
            }
        }
        let mut groups = Groups::of_each(count, by_disc);
        groups.further = super::Further::from_rows(rows.iter().map(Vec::as_slice));
        Self { groups, reach }
    }
}
