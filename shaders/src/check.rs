//! What can be wrong with a recording, found before any device sees it.

use crate::barriers::{Use, uses};
use crate::{Dispatch, Groups, Recording, Step};

/// A fault in a recording: whoever recorded it is wrong, not the device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("step {step}: {what}")]
pub struct Fault {
    /// The step at fault.
    pub step: usize,
    /// What is wrong with it.
    pub what: String,
}

impl Recording {
    /// Finds the first fault: a buffer of another recording, bindings or push constants that the kernel does not have, a
    /// buffer that one dispatch both writes and uses otherwise, a size read from where there is none, memory that is
    /// read before anything was written to it, an upload after a dispatch.
    ///
    /// # Errors
    /// [`Fault`] names the step.
    pub fn check(&self) -> Result<(), Fault> {
        let mut written = vec![false; self.buffers().len()];
        for (at, step) in self.steps().iter().enumerate() {
            self.check_step(&self.steps()[..at], step, &mut written).map_err(|what| Fault { step: at, what })?;
        }
        Ok(())
    }

    fn check_step(&self, before: &[Step], step: &Step, written: &mut [bool]) -> Result<(), String> {
        if let Step::Dispatch(dispatch) = step {
            self.check_dispatch(dispatch)?;
        }
        if let (Step::Upload(_), Some(_)) = (step, before.iter().find(|s| matches!(s, Step::Dispatch(_)))) {
            return Err("an upload after a dispatch: executors upload before all else".into());
        }
        let uses = uses(step);
        for (at, (buffer, use_)) in uses.iter().enumerate() {
            let Some(known) = self.buffers().get(buffer.index()) else {
                return Err("a buffer of another recording".into());
            };
            if !use_.writes() && !written[buffer.index()] {
                return Err(format!("{} is read before anything was written to it", known.name));
            }
            let again =
                uses[..at].iter().find(|(other, earlier)| other == buffer && (earlier.writes() || use_.writes()));
            if again.is_some() {
                return Err(format!("{} is written and used otherwise by one dispatch", known.name));
            }
        }
        uses.iter()
            .filter(|(_, u)| matches!(u, Use::CopyWrite | Use::KernelWrite))
            .for_each(|(b, _)| written[b.index()] = true);
        Ok(())
    }

    fn check_dispatch(&self, dispatch: &Dispatch) -> Result<(), String> {
        let kernel = dispatch.kernel;
        let given = dispatch.buffers.len();
        if given != kernel.bindings.len() {
            return Err(format!("{} takes {} buffers, got {given}", kernel.name, kernel.bindings.len()));
        }
        if dispatch.push.len() != kernel.push_bytes as usize {
            let got = dispatch.push.len();
            return Err(format!("{} takes {} bytes of push constants, got {got}", kernel.name, kernel.push_bytes));
        }
        if let Groups::Indirect { buffer, offset } = dispatch.groups {
            let room = self.buffers().get(buffer.index()).map_or(0, |b| b.bytes);
            if offset % 4 != 0 || offset.checked_add(12).is_none_or(|end| end > room) {
                return Err(format!("{}: no size of a dispatch at byte {offset} of {room}", kernel.name));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{HBSORT_PREPARE, SCAN_SPINE};

    fn fault(record: impl Fn(&mut Recording)) -> String {
        let mut recording = Recording::default();
        record(&mut recording);
        recording.check().expect_err("a fault").to_string()
    }

    #[test]
    fn each_fault_is_named() {
        let one = Groups::cover(1);
        let cases = [
            (
                fault(|r| {
                    let b = r.scratch("b", 4);
                    r.read(b)
                }),
                "step 0: b is read before anything was written to it",
            ),
            (
                fault(|r| {
                    let b = r.input("b", 8);
                    r.dispatch(&SCAN_SPINE, one, &[b], &[])
                }),
                "step 1: scan_spine takes 2 buffers, got 1",
            ),
            (
                fault(|r| {
                    let b = r.input("b", 8);
                    r.dispatch(&SCAN_SPINE, one, &[b, b], &[])
                }),
                "step 1: b is written and used otherwise by one dispatch",
            ),
            (
                fault(|r| {
                    let b = r.input("b", 8);
                    r.dispatch(&HBSORT_PREPARE, one, &[b, b, b], &[])
                }),
                "step 1: hbsort_prepare takes 4 bytes of push constants, got 0",
            ),
            (
                fault(|r| {
                    let [a, b] = [r.input("a", 8), r.input("b", 8)];
                    r.dispatch(&SCAN_SPINE, Groups::Indirect { buffer: a, offset: 0 }, &[a, b], &[]);
                }),
                "step 2: scan_spine: no size of a dispatch at byte 0 of 8",
            ),
            (
                fault(|r| {
                    let [a, b] = [r.input("a", 8), r.input("b", 8)];
                    r.dispatch(&SCAN_SPINE, one, &[a, b], &[]);
                    r.input("late", 4);
                }),
                "step 3: an upload after a dispatch: executors upload before all else",
            ),
            (
                fault(|r| {
                    let mut other = Recording::default();
                    other.input("x", 4);
                    let foreign = other.input("y", 4);
                    r.read(foreign);
                }),
                "step 0: a buffer of another recording",
            ),
        ];
        for (found, expected) in cases {
            assert_eq!(found, expected);
        }
    }
}
