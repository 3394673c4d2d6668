//! Two recordings in a row, with buffers in common: what one stage leaves on the device another takes up.
//!
//! Neither stage knows the other; whoever knows both names the buffers that are the same.

use crate::recording::Buffer;
use crate::{BufferId, Dispatch, Groups, Recording, Step};

/// Where the buffers of a joined recording lie in the whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joined {
    places: Vec<BufferId>,
}

impl Joined {
    /// The buffer of the whole that stands for this one of the joined recording; of another recording none, which
    /// [`Recording::check`] finds.
    pub fn buffer(&self, buffer: BufferId) -> BufferId {
        self.places.get(buffer.index()).copied().unwrap_or(BufferId(u32::MAX))
    }

    /// Inputs of the joined recording as inputs of the whole. Give none for a buffer that an earlier one fills.
    pub fn inputs<'a>(
        &self,
        inputs: impl IntoIterator<Item = (BufferId, &'a [u8])>,
    ) -> impl Iterator<Item = (BufferId, &'a [u8])> {
        inputs.into_iter().map(|(buffer, bytes)| (self.buffer(buffer), bytes))
    }
}

impl Recording {
    /// Adds the steps of `other` behind these. For each pair in `shared` the buffer of `other`, named first, is the buffer
    /// of `self`: it is as large as the larger, and what `self` leaves there is what `other` finds, instead of an
    /// upload. Other uploads come with those of `self`, before every dispatch.
    pub fn join(&mut self, other: &Recording, shared: &[(BufferId, BufferId)]) -> Joined {
        let joined = self.join_uploads(other, shared);
        for step in &other.steps {
            match step {
                Step::Upload(_) => {}
                Step::Read(buffer) => self.read(joined.buffer(*buffer)),
                Step::Dispatch(dispatch) => self.steps.push(Step::Dispatch(moved(dispatch, &joined))),
            }
        }
        joined
    }

    /// Adds the buffers and uploads of `other` as [`Recording::join`] does, and none of its other steps:
    /// [`Recording::join_dispatches`] adds those it starts, as often as they are wanted.
    pub fn join_uploads(&mut self, other: &Recording, shared: &[(BufferId, BufferId)]) -> Joined {
        let mut places = Vec::with_capacity(other.buffers.len());
        for (at, buffer) in (0u32..).zip(&other.buffers) {
            let known = shared.iter().find(|(from, _)| from.0 == at).map(|(_, to)| *to);
            places.push(known.unwrap_or_else(|| self.scratch(buffer.name, buffer.bytes)));
            if let Some(Buffer { bytes, .. }) = known.and_then(|to| self.buffers.get_mut(to.index())) {
                *bytes = buffer.bytes.max(*bytes);
            }
        }
        let joined = Joined { places };
        let mut uploads = self.steps.iter().take_while(|step| matches!(step, Step::Upload(_))).count();
        for step in &other.steps {
            if let Step::Upload(buffer) = step
                && !shared.iter().any(|(from, _)| from == buffer)
            {
                self.steps.insert(uploads, Step::Upload(joined.buffer(*buffer)));
                uploads += 1;
            }
        }
        joined
    }

    /// Adds the dispatches of `other`, whose buffers were joined before, each over these workgroups instead of its own: those
    /// of items whose number a dispatch before has found.
    pub fn join_dispatches(&mut self, other: &Recording, joined: &Joined, groups: Groups) {
        let dispatches = other.steps.iter().filter_map(|step| match step {
            Step::Dispatch(dispatch) => Some(Step::Dispatch(Dispatch { groups, ..moved(dispatch, joined) })),
            _ => None,
        });
        self.steps.extend(dispatches);
    }

    /// Reads back these buffers alone, of those that are read.
    pub fn read_only(&mut self, buffers: &[BufferId]) {
        self.steps.retain(|step| !matches!(step, Step::Read(read) if !buffers.contains(read)));
    }
}

fn moved(dispatch: &Dispatch, joined: &Joined) -> Dispatch {
    let groups = match dispatch.groups {
        Groups::Indirect { buffer, offset } => Groups::Indirect { buffer: joined.buffer(buffer), offset },
        direct @ Groups::Direct(_) => direct,
    };
    let buffers = dispatch.buffers.iter().map(|buffer| joined.buffer(*buffer)).collect();
    Dispatch { groups, buffers, ..dispatch.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::barriers;
    use crate::kernels::{SCAN_REDUCE, SCAN_SPINE};

    /// Sums of blocks; [scan, numbers, sums].
    fn reduced(bytes: u64) -> (Recording, [BufferId; 3]) {
        let mut r = Recording::default();
        let [scan, numbers] = [r.input("scan", 8), r.input("numbers", bytes)];
        let sums = r.scratch("sums", 16);
        r.dispatch(&SCAN_REDUCE, Groups::Indirect { buffer: numbers, offset: 4 }, &[scan, numbers, sums], &[]);
        r.read(sums);
        (r, [scan, numbers, sums])
    }

    #[test]
    fn what_one_leaves_the_other_takes_up() {
        let (mut first, [scan, numbers, sums]) = reduced(64);
        let (second, buffers) = reduced(128);
        let joined = first.join(&second, &[(buffers[0], scan), (buffers[1], sums)]);
        assert_eq!([joined.buffer(buffers[0]), joined.buffer(buffers[1])], [scan, sums]);
        let text = "\
buffer  0 scan             8 bytes
buffer  1 numbers          64 bytes
buffer  2 sums             128 bytes
buffer  3 sums             16 bytes
upload scan
upload numbers
scan_reduce numbers@4 scan numbers sums*
read sums
scan_reduce sums@4 scan sums sums*
read sums
";
        assert_eq!(first.to_string(), text);
        first.check().expect("no fault");
        // The second run waits for the first, as if both had been recorded at once.
        let waits = barriers(&first);
        assert!(waits[4].iter().any(|wait| wait.buffer == sums && wait.from == crate::Use::KernelWrite));
        first.read_only(&[joined.buffer(buffers[2])]);
        assert_eq!(first.steps().iter().filter(|s| matches!(s, Step::Read(_))).count(), 1);
        let inputs: Vec<_> = joined.inputs([(buffers[0], &[1u8; 8][..]), (buffers[2], &[])]).map(|(b, _)| b).collect();
        assert_eq!(inputs, [scan, joined.buffer(buffers[2])]);
        assert_eq!(numbers.index(), 1);
    }

    #[test]
    fn dispatches_are_repeated_on_the_same_buffers() {
        let (mut whole, [scan, _, sums]) = reduced(64);
        let (other, buffers) = reduced(128);
        let joined = whole.join_uploads(&other, &[(buffers[0], scan)]);
        for offset in [0, 4] {
            whole.join_dispatches(&other, &joined, Groups::Indirect { buffer: sums, offset });
        }
        let text = "\
buffer  0 scan             8 bytes
buffer  1 numbers          64 bytes
buffer  2 sums             16 bytes
buffer  3 numbers          128 bytes
buffer  4 sums             16 bytes
upload scan
upload numbers
upload numbers
scan_reduce numbers@4 scan numbers sums*
read sums
scan_reduce sums@0 scan numbers sums*
scan_reduce sums@4 scan numbers sums*
";
        assert_eq!(whole.to_string(), text);
        whole.check().expect("no fault");
    }

    #[test]
    fn uploads_come_first_and_strangers_are_found() {
        let (mut first, [scan, ..]) = reduced(64);
        let mut second = Recording::default();
        let [late, sums] = [second.input("late", 8), second.input("more", 64)];
        second.dispatch(&SCAN_SPINE, Groups::cover(1), &[late, sums], &[]);
        let joined = first.join(&second, &[(late, scan)]);
        assert!(first.steps()[..3].iter().all(|s| matches!(s, Step::Upload(_))) && first.steps().len() == 6);
        first.check().expect("no fault");
        let mut larger = Recording::default();
        for _ in 0..8 {
            larger.scratch("x", 4);
        }
        let strange = larger.scratch("x", 4);
        first.dispatch(&SCAN_SPINE, Groups::cover(1), &[scan, joined.buffer(strange)], &[]);
        let fault = first.check().expect_err("a stranger").to_string();
        assert!(fault.ends_with("a buffer of another recording"), "{fault}");
    }
}
