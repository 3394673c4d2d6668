//! Which step waits for which, from what each declares to read and write.
//!
//! A device may run dispatches at the same time. A step that reads what an earlier one wrote, writes what it wrote, or
//! writes what it read, must wait for it. No tool can find every such wait that is missing (two dispatches of one
//! kernel that change one buffer look innocent), so they are computed here and never written by hand.

use crate::{Access, BufferId, Groups, Recording, Step};

/// How a step touches a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Use {
    /// A copy writes it.
    CopyWrite,
    /// A copy reads it.
    CopyRead,
    /// A kernel reads it.
    KernelRead,
    /// A kernel writes it, and may read it.
    KernelWrite,
    /// The device reads the size of a dispatch from it.
    Indirect,
}

impl Use {
    /// Whether the buffer may be different afterwards.
    pub fn writes(self) -> bool {
        matches!(self, Self::CopyWrite | Self::KernelWrite)
    }
}

/// A wait before a step: earlier uses of this kind of the buffer end before this step's use begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Barrier {
    /// The buffer.
    pub buffer: BufferId,
    /// What is waited for.
    pub from: Use,
    /// What waits.
    pub to: Use,
}

/// What a step does to buffers, in the order of its bindings.
pub(crate) fn uses(step: &Step) -> Vec<(BufferId, Use)> {
    match step {
        Step::Upload(buffer) => vec![(*buffer, Use::CopyWrite)],
        Step::Read(buffer) => vec![(*buffer, Use::CopyRead)],
        Step::Dispatch(dispatch) => {
            let kind = |access: &Access| match access {
                Access::Read => Use::KernelRead,
                Access::Write => Use::KernelWrite,
            };
            let bound = dispatch.buffers.iter().copied().zip(dispatch.kernel.bindings.iter().map(kind));
            let size = match dispatch.groups {
                Groups::Indirect { buffer, .. } => Some((buffer, Use::Indirect)),
                Groups::Direct(_) => None,
            };
            bound.chain(size).collect()
        }
    }
}

/// What a buffer went through since its last write.
#[derive(Debug, Clone, Default)]
struct History {
    write: Option<Use>,
    /// Kinds of reads since; each has waited for the write.
    reads: Vec<Use>,
}

/// For each step the waits before it.
pub fn barriers(recording: &Recording) -> Vec<Vec<Barrier>> {
    let mut histories = vec![History::default(); recording.buffers().len()];
    recording.steps().iter().map(|step| before(step, &mut histories)).collect()
}

fn before(step: &Step, histories: &mut [History]) -> Vec<Barrier> {
    let uses = uses(step);
    let mut found = Vec::new();
    for &(buffer, to) in &uses {
        let Some(history) = histories.get(buffer.index()) else { continue };
        let wait = |from| Barrier { buffer, from, to };
        // Whoever read since has waited for the write already; a kind of read that has not must.
        let seen = !to.writes() && history.reads.contains(&to);
        found.extend(history.write.filter(|_| !seen).map(wait));
        if to.writes() {
            found.extend(history.reads.iter().copied().map(wait));
        }
    }
    // A step's own uses do not wait for each other: its reads are noted first, so that its writes come last.
    for &(buffer, to) in uses.iter().filter(|u| !u.1.writes()).chain(uses.iter().filter(|u| u.1.writes())) {
        let Some(history) = histories.get_mut(buffer.index()) else { continue };
        if to.writes() {
            *history = History { write: Some(to), reads: Vec::new() };
        } else if !history.reads.contains(&to) {
            history.reads.push(to);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{HBSORT_BEGIN, SCAN_APPLY, SCAN_SPINE};

    fn between(recording: &Recording, step: usize) -> Vec<(usize, Use, Use)> {
        barriers(recording)[step].iter().map(|b| (b.buffer.index(), b.from, b.to)).collect()
    }

    #[test]
    fn two_runs_of_one_kernel_on_one_buffer_wait() {
        let mut r = Recording::default();
        let [scan, sums] = [r.input("scan", 8), r.input("sums", 64)];
        r.dispatch(&SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
        r.dispatch(&SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
        let both = [(0, Use::KernelWrite, Use::KernelWrite), (1, Use::KernelWrite, Use::KernelWrite)];
        assert_eq!(between(&r, 3), both);
    }

    #[test]
    fn reads_share_one_wait_and_a_write_waits_for_every_read() {
        let mut r = Recording::default();
        let [scan, sums, a, b] = [r.input("scan", 8), r.input("sums", 8), r.input("a", 8), r.input("b", 8)];
        r.dispatch(&SCAN_APPLY, Groups::cover(1), &[scan, a, sums], &[]);
        let indirect = Groups::Indirect { buffer: sums, offset: 0 };
        r.dispatch(&SCAN_APPLY, indirect, &[scan, b, sums], &[]);
        r.dispatch(&SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
        // The second run reads scan and sums as the first did; only b and the size are new.
        let second = [(3, Use::CopyWrite, Use::KernelWrite), (1, Use::CopyWrite, Use::Indirect)];
        assert_eq!(between(&r, 5), second);
        let third = between(&r, 6);
        assert!(third.contains(&(1, Use::KernelRead, Use::KernelWrite)), "{third:?}");
        assert!(third.contains(&(1, Use::Indirect, Use::KernelWrite)), "{third:?}");
    }

    #[test]
    fn what_nobody_touched_waits_for_nothing() {
        let mut r = Recording::default();
        let view = r.input("view", 128);
        let [state, scan] = [r.scratch("state", 64), r.scratch("scan", 8)];
        r.dispatch(&HBSORT_BEGIN, Groups::cover(1), &[view, state, scan], &[]);
        r.read(state);
        assert_eq!(between(&r, 1), [(0, Use::CopyWrite, Use::KernelRead)]);
        assert_eq!(between(&r, 2), [(1, Use::KernelWrite, Use::CopyRead)]);
    }
}
