//! What can be wrong with a recording, found before any device sees it.

use crate::barriers::{Resource, Use, uses};
use crate::{Blend, BufferId, Corners, Dispatch, Draw, Groups, ImageId, Recording, Step};

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
    /// Finds the first fault: a buffer or image of another recording, bindings or push constants that the kernel or program
    /// does not have, a buffer that one dispatch both writes and uses otherwise, a size read from where there is none,
    /// memory that is read before anything was written to it, an upload after a dispatch or a draw; an image without
    /// pixels or that nobody draws into, a draw with targets that its program does not have or that are not of one size,
    /// a copy into too small a buffer.
    ///
    /// # Errors
    /// [`Fault`] names the step.
    pub fn check(&self) -> Result<(), Fault> {
        let mut written =
            Written { buffers: vec![false; self.buffers().len()], images: vec![false; self.images().len()] };
        for (at, step) in self.steps().iter().enumerate() {
            self.check_step(&self.steps()[..at], step, &mut written).map_err(|what| Fault { step: at, what })?;
        }
        if let Some((image, _)) = self.images().iter().zip(&written.images).find(|(_, drawn)| !**drawn) {
            return Err(Fault { step: self.steps().len(), what: format!("nobody draws into {}", image.name) });
        }
        Ok(())
    }

    fn check_step(&self, before: &[Step], step: &Step, written: &mut Written) -> Result<(), String> {
        match step {
            Step::Dispatch(dispatch) => self.check_dispatch(dispatch)?,
            Step::Draw(draw) => self.check_draw(draw)?,
            Step::Copy { image, buffer } => self.check_copy(*image, *buffer)?,
            Step::Upload(_) if before.iter().any(|s| matches!(s, Step::Dispatch(_) | Step::Draw(_))) => {
                return Err("an upload after a dispatch: executors upload before all else".into());
            }
            Step::Upload(_) | Step::Read(_) => {}
        }
        let uses = uses(step);
        for (at, (of, use_)) in uses.iter().enumerate() {
            let Some(name) = self.name_of(*of) else {
                return Err("a buffer of another recording".into());
            };
            if reads(step, *of, *use_) && !*written.of(*of) {
                return Err(format!("{name} is read before anything was written to it"));
            }
            let again = uses[..at].iter().find(|(other, earlier)| other == of && (earlier.writes() || use_.writes()));
            if again.is_some() {
                return Err(format!("{name} is written and used otherwise by one dispatch"));
            }
        }
        uses.iter().filter(|(_, u)| u.writes()).for_each(|(of, _)| *written.of(*of) = true);
        Ok(())
    }

    fn name_of(&self, of: Resource) -> Option<&'static str> {
        match of {
            Resource::Buffer(buffer) => self.buffers().get(buffer.index()).map(|b| b.name),
            Resource::Image(image) => self.images().get(image.index()).map(|i| i.name),
        }
    }

    fn check_draw(&self, draw: &Draw) -> Result<(), String> {
        let (program, given) = (draw.program, draw.buffers.len());
        let name = program.name;
        if given != program.bindings as usize {
            return Err(format!("{name} takes {} buffers, got {given}", program.bindings));
        }
        if draw.push.len() != program.push_bytes as usize {
            return Err(format!(
                "{name} takes {} bytes of push constants, got {}",
                program.push_bytes,
                draw.push.len()
            ));
        }
        if draw.targets.len() != program.outputs.len() || draw.targets.is_empty() {
            return Err(format!("{name} draws into {} images, got {}", program.outputs.len(), draw.targets.len()));
        }
        let mut size = None;
        for (target, numbers) in draw.targets.iter().zip(program.outputs) {
            let Some(image) = self.images().get(target.image.index()) else {
                return Err("an image of another recording".into());
            };
            if image.size.contains(&0) {
                return Err(format!("{} has no pixels", image.name));
            }
            if image.format.numbers() != *numbers {
                let has = image.format.numbers();
                return Err(format!("{name} gives {numbers} numbers a pixel, {} has {has}", image.name));
            }
            if *size.get_or_insert(image.size) != image.size {
                return Err(format!("{name} draws into images of several sizes"));
            }
            if target.blend != Blend::Add && image.format.numbers() != 4 {
                return Err(format!("{} has no opacity to blend by", image.name));
            }
        }
        match draw.corners {
            Corners::Indirect { buffer, offset } => self.check_size(name, "draw", buffer, offset, 16),
            Corners::Direct(_) => Ok(()),
        }
    }

    fn check_copy(&self, image: ImageId, buffer: BufferId) -> Result<(), String> {
        let (Some(image), Some(buffer)) = (self.images().get(image.index()), self.buffers().get(buffer.index())) else {
            return Err("an image or a buffer of another recording".into());
        };
        let needed = image.copy_bytes();
        if needed > buffer.bytes {
            return Err(format!("{} takes {needed} bytes, {} has {}", image.name, buffer.name, buffer.bytes));
        }
        Ok(())
    }

    fn check_size(&self, name: &str, of: &str, buffer: BufferId, offset: u64, bytes: u64) -> Result<(), String> {
        let room = self.buffers().get(buffer.index()).map_or(0, |b| b.bytes);
        if !offset.is_multiple_of(4) || offset.checked_add(bytes).is_none_or(|end| end > room) {
            return Err(format!("{name}: no size of a {of} at byte {offset} of {room}"));
        }
        Ok(())
    }

    fn check_dispatch(&self, dispatch: &Dispatch) -> Result<(), String> {
        let (kernel, given) = (dispatch.kernel, dispatch.buffers.len());
        if given != kernel.bindings.len() {
            return Err(format!("{} takes {} buffers, got {given}", kernel.name, kernel.bindings.len()));
        }
        if dispatch.push.len() != kernel.push_bytes as usize {
            let got = dispatch.push.len();
            return Err(format!("{} takes {} bytes of push constants, got {got}", kernel.name, kernel.push_bytes));
        }
        match dispatch.groups {
            Groups::Indirect { buffer, offset } => self.check_size(kernel.name, "dispatch", buffer, offset, 12),
            Groups::Direct(_) => Ok(()),
        }
    }
}

/// What has been written so far.
struct Written {
    buffers: Vec<bool>,
    images: Vec<bool>,
}

impl Written {
    /// Of a buffer or image that is known.
    fn of(&mut self, of: Resource) -> &mut bool {
        match of {
            Resource::Buffer(buffer) => &mut self.buffers[buffer.index()],
            Resource::Image(image) => &mut self.images[image.index()],
        }
    }
}

/// Whether a use needs what was written before: a draw does of the targets that it does not clear.
fn reads(step: &Step, of: Resource, use_: Use) -> bool {
    match (step, of) {
        (Step::Draw(draw), Resource::Image(image)) => {
            draw.targets.iter().any(|t| t.image == image && t.clear.is_none())
        }
        _ => !use_.writes(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{HBSORT_PREPARE, SCAN_SPINE};
    use crate::programs::SPLAT_DRAW;
    use crate::{Format, Target};

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

    /// A draw of one strip into images of these sizes and formats, changed by `change`.
    fn drawn(images: [([u32; 2], Format); 2], change: impl Fn(&mut Recording, &mut Draw)) -> String {
        fault(|r| {
            let b = r.input("b", 16);
            let [color, sum] = [("color", images[0]), ("sum", images[1])].map(|(n, (size, f))| r.image(n, size, f));
            let target = |image, blend| Target { image, blend, clear: Some([0.0; 4]) };
            let targets = [target(color, Blend::Over), target(sum, Blend::Add)];
            r.draw(&SPLAT_DRAW, Corners::Direct([4, 1]), &[b; 6], &[0; 4], &targets);
            let Some(Step::Draw(mut draw)) = r.steps.pop() else { unreachable!("a draw was recorded") };
            change(r, &mut draw);
            r.steps.push(Step::Draw(draw));
            r.copy(sum, b);
        })
    }

    #[test]
    fn each_fault_of_a_draw_is_named() {
        use Format::{R16F, R32F, Rgba32F};
        let good = [([9, 9], Rgba32F), ([9, 9], R32F)];
        let cases = [
            (drawn(good, |_, _| ()), "step 2: sum takes 2304 bytes, b has 16"),
            (drawn(good, |_, d| d.targets.clear()), "step 1: splat_draw draws into 2 images, got 0"),
            (drawn([([9, 0], Rgba32F), ([9, 0], R32F)], |_, _| ()), "step 1: color has no pixels"),
            (
                drawn([([9, 9], R32F), ([9, 9], R32F)], |_, _| ()),
                "step 1: splat_draw gives 4 numbers a pixel, color has 1",
            ),
            (
                drawn([([9, 9], Rgba32F), ([9, 8], R16F)], |_, _| ()),
                "step 1: splat_draw draws into images of several sizes",
            ),
            (drawn(good, |_, d| d.targets[1].blend = Blend::Under), "step 1: sum has no opacity to blend by"),
            (drawn(good, |_, d| d.targets[0].clear = None), "step 1: color is read before anything was written to it"),
            (drawn(good, |_, d| d.buffers.truncate(5)), "step 1: splat_draw takes 6 buffers, got 5"),
            (drawn(good, |_, d| d.push.clear()), "step 1: splat_draw takes 16 bytes of push constants, got 0"),
            (
                drawn(good, |_, d| d.corners = Corners::Indirect { buffer: d.buffers[0], offset: 4 }),
                "step 1: splat_draw: no size of a draw at byte 4 of 16",
            ),
            (
                drawn(good, |r, d| d.buffers[2] = r.scratch("new", 4)),
                "step 1: new is read before anything was written to it",
            ),
            (
                drawn(good, |_, d| {
                    let mut other = Recording::default();
                    d.targets[1].image = [(); 3].map(|()| other.image("x", [9, 9], R32F))[2];
                }),
                "step 1: an image of another recording",
            ),
        ];
        for (found, expected) in cases {
            assert_eq!(found, expected);
        }
        let never = fault(|r| {
            let (b, never) = (r.input("b", 4096), r.image("never", [2, 2], R32F));
            r.copy(never, b);
        });
        assert_eq!(never, "step 1: never is read before anything was written to it");
        let idle = fault(|r| {
            r.input("b", 4);
            r.image("idle", [2, 2], R32F);
        });
        assert_eq!(idle, "step 1: nobody draws into idle");
    }
}
