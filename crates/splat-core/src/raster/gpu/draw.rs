//! Compositing of ordered translucent splats by a device's rasterizer: another way to what [`record`](super::record) does by
//! tiles, with the same input, result and numbers.
//!
//! One rectangle of whole pixels a splat, in the exact order; the vertex shader pulls the splat by its place in the order,
//! the fragment shader takes the optical depth τ that a tile takes, and the device blends in the order of splats: with
//! α = 1 − e^−τ, C ← C + T·α·c, T ← T·(1 − α), and A ← A + τ in a second image. An order back to front is drawn from its end.
//! Then what was drawn is put under what the planes hold, or over it, back to front. There are no tiles, so nothing is counted, scanned or
//! sorted again and there is no room for entries; what is behind an opaque pixel is blended all the same.
//!
//! A pixel of an image has one opacity, so one draw does at most three channels that one plane of optical depth hides: a
//! picture with one plane and three channels is one draw, one with coloured extinction three, in which the splats are
//! rasterized again. That needs no second source of blending, which not every device has.
//!
//! Deviations from the CPU: no transmittance cut-off, so behind it values differ by as much as it allows; α·c is rounded
//! before it is blended, and a plane that holds something already gets what was drawn as a whole. With
//! [`Precision::Single`] transmittances, and channels as a share of the largest value, agree within 10⁻⁵ as those of tiles
//! do. With [`Precision::Half`] each of n blends is rounded to 11 bits: within 0.02 for a few hundred splats a pixel, and
//! thin ones fall away when their share is below half a step of the sum. It is for devices that blend no others.
//!
//! ```
//! use splat_core::raster::gpu::draw::{Precision, record};
//! use splat_core::raster::gpu::Capacities;
//!
//! let room = Capacities {
//!     size: [1280, 720],
//!     planes: 1,
//!     channels: 3,
//!     splats: 1_000_000,
//!     ordered: 800_000,
//!     entries: 0,
//!     footprints: 3,
//!     materials: 8,
//!     opaque: false,
//!     depths: false,
//!     objects: false,
//! };
//! let recorded = record(room, Precision::Single).unwrap();
//! recorded.recording.check().unwrap();
//! // 32 bytes a splat and 12 of its channels come in, and 56 a pixel.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 98);
//! ```

use super::common::Common;
use super::{Capacities, Recorded, refused};
use crate::Error;
use crate::shade::ChannelLayout;
use splat_shaders::{Blend, BufferId, Corners, Format, Groups, Image, ImageId, Recording, Target, kernels, programs};

/// Numbers that a device blends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Precision {
    /// Of 32 bits; devices that do not blend them refuse the recording.
    Single,
    /// Of 16 bits.
    Half,
}

/// Pixels of a workgroup.
const BLOCK: u32 = 256;
/// No channel.
const NONE: u32 = u32::MAX;

/// What one draw does: a plane of optical depth, and up to three channels that it hides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Group {
    plane: u32,
    channels: [u32; 3],
    /// Whether it is the last of its plane.
    last: bool,
}

/// Channels by the plane that hides them.
fn groups(planes: u32, channels: u32) -> Vec<Group> {
    let plane_of = |c: u32| ChannelLayout::plane_of(c as usize, channels as usize, planes as usize) as u32;
    let mut groups = Vec::new();
    for plane in 0..planes {
        let mut own: Vec<u32> = (0..channels).filter(|c| plane_of(*c) == plane).collect();
        own.resize(own.len().next_multiple_of(3).max(3), NONE);
        let (threes, _) = own.as_chunks::<3>();
        let last = threes.len() - 1;
        groups.extend(threes.iter().enumerate().map(|(k, c)| Group { plane, channels: *c, last: k == last }));
    }
    groups
}

/// Records the compositing with this room; [`Capacities::entries`] is not used. More splats in the order than there is room
/// for are [`Error::Overflow`] when the state is read back, and none is drawn.
///
/// # Errors
/// [`Error::Invalid`] for a size, planes or channels out of range, and for depths and objects, which no blending makes.
pub fn record(capacities: Capacities, precision: Precision) -> Result<Recorded, Error> {
    record_as(capacities, precision, false)
}

/// The same in the order that a sort has left on the device, as [`follow::record`](super::follow::record);
/// [`follow::uploads`](super::follow::uploads) gives the bytes.
///
/// # Errors
/// As [`record`].
pub fn follow(capacities: Capacities, precision: Precision) -> Result<Recorded, Error> {
    record_as(capacities, precision, true)
}

fn record_as(capacities: Capacities, precision: Precision, follows: bool) -> Result<Recorded, Error> {
    if capacities.depths || capacities.objects {
        return refused("layers", "depths or objects".to_owned(), "colours and optical depth for a rasterizer");
    }
    let mut recording = Recording::default();
    let r = &mut recording;
    let common = Common::record(r, capacities)?;
    let strips = r.scratch("strips", 16);
    let drawn = Drawn::new(r, capacities, precision);
    let sorted = common.follow(r, follows);
    let counted = [common.view, strips, common.state];
    r.dispatch(&kernels::SPLAT_INSTANCES, Groups::cover(1), &counted, &[capacities.ordered]);
    for group in groups(capacities.planes, capacities.channels) {
        drawn.draw(r, &common, strips, group);
    }
    Ok(common.finish(recording, capacities, sorted, ("splats in order", capacities.ordered)))
}

/// What splats are drawn into, front to back whatever the order: the vertex shader takes the other from its end.
struct Drawn {
    images: [ImageId; 2],
    copies: [BufferId; 2],
    /// Words from a row of a copy to the next.
    row_words: [u32; 2],
    halves: bool,
    pixels: u32,
}

impl Drawn {
    fn new(r: &mut Recording, capacities: Capacities, precision: Precision) -> Self {
        let formats = match precision {
            Precision::Single => [Format::Rgba32F, Format::R32F],
            Precision::Half => [Format::Rgba16F, Format::R16F],
        };
        let size = capacities.size;
        let images = [0, 1].map(|k| r.image(["colors", "depths"][k], size, formats[k]));
        let layouts = images.map(|image| r.images()[image.index()].clone());
        let copies = [0, 1].map(|k| r.scratch(["colors drawn", "depths drawn"][k], layouts[k].copy_bytes()));
        let row_words = layouts.map(|image: Image| (image.row_bytes() / 4) as u32);
        Self { images, copies, row_words, halves: precision == Precision::Half, pixels: size[0] * size[1] }
    }

    fn draw(&self, r: &mut Recording, common: &Common, strips: BufferId, group: Group) {
        let [red, green, blue] = group.channels;
        let target = |k: usize, blend, clear| Target { image: self.images[k], blend, clear: Some(clear) };
        let targets = [target(0, Blend::Under, [0.0, 0.0, 0.0, 1.0]), target(1, Blend::Add, [0.0; 4])];
        let bound = [common.view, common.order, common.splats, common.values, common.tables, common.opaque];
        let corners = Corners::Indirect { buffer: strips, offset: 0 };
        r.draw(&programs::SPLAT_DRAW, corners, &bound, &[group.plane, red, green, blue], &targets);
        (0..2).for_each(|k| r.copy(self.images[k], self.copies[k]));
        let [color_words, sum_words] = self.row_words;
        let flags = [u32::from(self.halves), u32::from(group.last)];
        let push = [group.plane, red, green, blue, color_words, sum_words, flags[0], flags[1]];
        let resolved = [common.view, self.copies[0], self.copies[1], common.planes];
        let blocks = self.pixels.div_ceil(BLOCK);
        r.dispatch(&kernels::SPLAT_DRAWN, Groups::cover(blocks), &resolved, &push);
    }
}
