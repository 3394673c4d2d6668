//! Threads that run side by side: what kernels do across them, and which kernels a recording takes.

use crate::{Adapter, Kernel, Recording, Step, kernels};

/// Operations of the threads of a subgroup on what all of them have; who has any knows its subgroup too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SubgroupOps {
    /// Who of them says yes.
    pub ballot: bool,
    /// What another one has.
    pub shuffle: bool,
    /// Sums, running ones too.
    pub arithmetic: bool,
}

impl SubgroupOps {
    /// None.
    pub const NONE: Self = Self { ballot: false, shuffle: false, arithmetic: false };
    /// Sums alone.
    pub const SUMS: Self = Self { arithmetic: true, ..Self::NONE };
    /// All.
    pub const ALL: Self = Self { ballot: true, shuffle: true, arithmetic: true };

    /// Those and these.
    pub const fn and(self, other: Self) -> Self {
        Self {
            ballot: self.ballot || other.ballot,
            shuffle: self.shuffle || other.shuffle,
            arithmetic: self.arithmetic || other.arithmetic,
        }
    }

    /// The first of these that is not among those, by name.
    pub fn beyond(self, had: Self) -> Option<&'static str> {
        let ops = [
            (self.ballot && !had.ballot, "ballots of subgroups"),
            (self.shuffle && !had.shuffle, "shuffles of subgroups"),
            (self.arithmetic && !had.arithmetic, "sums of subgroups"),
        ];
        ops.into_iter().find(|(lacks, _)| *lacks).map(|(_, name)| name)
    }
}

/// How the threads of kernels that exist both ways work together: what they leave has the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lanes {
    /// By memory that the workgroup shares; every device can.
    #[default]
    Portable,
    /// By subgroups, of any size.
    Subgroup,
}

impl Lanes {
    /// What suits a device: subgroups where it has all that kernels take of them.
    pub fn for_adapter(adapter: &Adapter) -> Self {
        if SubgroupOps::ALL.beyond(adapter.subgroup_ops).is_none() { Self::Subgroup } else { Self::Portable }
    }
}

/// Kernels that exist both ways: the portable one, and the one by subgroups.
const PAIRS: [[&Kernel; 2]; 4] = [
    [&kernels::SCAN_REDUCE, &kernels::SCAN_REDUCE_SUBGROUP],
    [&kernels::SCAN_SPINE, &kernels::SCAN_SPINE_SUBGROUP],
    [&kernels::SCAN_APPLY, &kernels::SCAN_APPLY_SUBGROUP],
    [&kernels::RADIX_SCATTER, &kernels::RADIX_SCATTER_SUBGROUP],
];

impl Recording {
    /// The same work by these kernels, where there are such: stages record the portable ones, and whoever knows the device
    /// chooses. Buffers, push constants and results stay as they are.
    #[must_use]
    pub fn by(&self, lanes: Lanes) -> Self {
        let mut recording = self.clone();
        for step in &mut recording.steps {
            if let Step::Dispatch(dispatch) = step
                && let Some([portable, subgroup]) =
                    PAIRS.iter().find(|p| p.iter().any(|k| k.name == dispatch.kernel.name))
            {
                dispatch.kernel = match lanes {
                    Lanes::Portable => portable,
                    Lanes::Subgroup => subgroup,
                };
            }
        }
        recording
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AdapterKind, BufferId, DeviceError, Groups};

    fn adapter(subgroup_ops: SubgroupOps) -> Adapter {
        Adapter {
            name: String::new(),
            driver: String::new(),
            kind: AdapterKind::Other,
            memory_bytes: 0,
            binding_bytes: 1 << 20,
            subgroup: 8,
            wide_atomics: false,
            subgroup_ops,
        }
    }

    fn sort() -> Recording {
        let mut r = Recording::default();
        let buffers: Vec<BufferId> = ["a", "b", "c", "d", "e", "f"].map(|name| r.input(name, 64)).into();
        r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &buffers[..2], &[]);
        r.dispatch(&kernels::RADIX_HISTOGRAM, Groups::cover(1), &buffers[..3], &[0]);
        r.dispatch(&kernels::RADIX_SCATTER, Groups::cover(1), &buffers, &[0]);
        r
    }

    #[test]
    fn a_pair_takes_the_same_buffers() {
        for [portable, subgroup] in PAIRS {
            assert_eq!(subgroup.name, format!("{}_subgroup", portable.name));
            assert_eq!((portable.bindings, portable.push_bytes), (subgroup.bindings, subgroup.push_bytes));
            assert!(portable.subgroup_ops == SubgroupOps::NONE && subgroup.subgroup_ops != SubgroupOps::NONE);
        }
        let known = PAIRS.map(|[_, subgroup]| subgroup.name);
        let lone = kernels::ALL.iter().find(|k| k.subgroup_ops != SubgroupOps::NONE && !known.contains(&k.name));
        assert_eq!(lone, None, "without a portable one");
    }

    #[test]
    fn kernels_go_to_and_fro() {
        let portable = sort();
        let subgroup = sort().by(Lanes::Subgroup);
        assert!(subgroup.check().is_ok() && portable != subgroup);
        assert_eq!(subgroup.by(Lanes::Portable), portable);
        assert_eq!(portable.by(Lanes::Portable), portable);
        let count = |r: &Recording| r.to_string().matches("_subgroup ").count();
        assert_eq!([count(&portable), count(&subgroup)], [0, 2]);
    }

    #[test]
    fn what_a_device_lacks_is_named_and_not_chosen() {
        let sums = SubgroupOps { ballot: true, shuffle: false, arithmetic: true };
        for (had, what) in [(SubgroupOps::NONE, "sums of subgroups"), (sums, "shuffles of subgroups")] {
            let refused = adapter(had).accept(&sort().by(Lanes::Subgroup));
            assert!(matches!(refused, Err(DeviceError::Lacking { what: found, .. }) if found == what), "{refused:?}");
            assert_eq!(Lanes::for_adapter(&adapter(had)), Lanes::Portable);
            assert_eq!(adapter(had).accept(&sort()), Ok(()));
        }
        let capable = adapter(SubgroupOps::ALL);
        assert_eq!(
            (capable.accept(&sort().by(Lanes::Subgroup)), Lanes::for_adapter(&capable)),
            (Ok(()), Lanes::Subgroup)
        );
    }
}
