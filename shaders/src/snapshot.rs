//! A recording as text, one line a buffer and one a step: what tests keep and people read.

use crate::{BufferId, Groups, Recording, Step};
use std::fmt;

impl fmt::Display for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, buffer) in self.buffers().iter().enumerate() {
            writeln!(f, "buffer {at:>2} {:<16} {} bytes", buffer.name, buffer.bytes)?;
        }
        for step in self.steps() {
            match step {
                Step::Upload(buffer) => writeln!(f, "upload {}", self.name(*buffer))?,
                Step::Read(buffer) => writeln!(f, "read {}", self.name(*buffer))?,
                Step::Dispatch(d) => {
                    write!(f, "{}", d.kernel.name)?;
                    match d.groups {
                        Groups::Direct([x, y, z]) => write!(f, " {x}x{y}x{z}")?,
                        Groups::Indirect { buffer, offset } => write!(f, " {}@{offset}", self.name(buffer))?,
                    }
                    for (buffer, access) in d.buffers.iter().zip(d.kernel.bindings) {
                        let mark = if *access == crate::Access::Write { "*" } else { "" };
                        write!(f, " {}{mark}", self.name(*buffer))?;
                    }
                    let (words, _) = d.push.as_chunks::<4>();
                    words.iter().try_for_each(|w| write!(f, " {}", u32::from_ne_bytes(*w)))?;
                    writeln!(f)?;
                }
            }
        }
        Ok(())
    }
}

impl Recording {
    fn name(&self, buffer: BufferId) -> &'static str {
        self.buffers().get(buffer.index()).map_or("?", |b| b.name)
    }
}
