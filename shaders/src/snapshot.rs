//! A recording as text, one line a buffer and one a step: what tests keep and people read.

use crate::{BufferId, Corners, Draw, Groups, ImageId, Recording, Step};
use std::fmt;

impl fmt::Display for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, buffer) in self.buffers().iter().enumerate() {
            writeln!(f, "buffer {at:>2} {:<16} {} bytes", buffer.name, buffer.bytes)?;
        }
        for (at, image) in self.images().iter().enumerate() {
            let [width, height] = image.size;
            writeln!(f, "image  {at:>2} {:<16} {width}x{height} {:?}", image.name, image.format)?;
        }
        for step in self.steps() {
            match step {
                Step::Upload(buffer) => writeln!(f, "upload {}", self.name(*buffer))?,
                Step::Read(buffer) => writeln!(f, "read {}", self.name(*buffer))?,
                Step::Copy { image, buffer } => {
                    writeln!(f, "copy {} {}*", self.image_name(*image), self.name(*buffer))?
                }
                Step::Draw(draw) => self.write_draw(f, draw)?,
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
                    write_push(f, &d.push)?;
                    writeln!(f)?;
                }
            }
        }
        Ok(())
    }
}

impl Recording {
    fn write_draw(&self, f: &mut fmt::Formatter<'_>, draw: &Draw) -> fmt::Result {
        write!(f, "{}", draw.program.name)?;
        match draw.corners {
            Corners::Direct([corners, strips]) => write!(f, " {corners}x{strips}")?,
            Corners::Indirect { buffer, offset } => write!(f, " {}@{offset}", self.name(buffer))?,
        }
        draw.buffers.iter().try_for_each(|buffer| write!(f, " {}", self.name(*buffer)))?;
        write_push(f, &draw.push)?;
        for target in &draw.targets {
            write!(f, " {:?} {}*", target.blend, self.image_name(target.image))?;
            if let Some(clear) = target.clear {
                write!(f, " from {clear:?}")?;
            }
        }
        writeln!(f)
    }

    fn image_name(&self, image: ImageId) -> &'static str {
        self.images().get(image.index()).map_or("?", |i| i.name)
    }

    fn name(&self, buffer: BufferId) -> &'static str {
        self.buffers().get(buffer.index()).map_or("?", |b| b.name)
    }
}

fn write_push(f: &mut fmt::Formatter<'_>, push: &[u8]) -> fmt::Result {
    let (words, _) = push.as_chunks::<4>();
    words.iter().try_for_each(|w| write!(f, " {}", u32::from_ne_bytes(*w)))
}
