//! What a draw is: a program, what it reads, the images it blends into.

use crate::{BufferId, Program};

/// An image of one recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ImageId(pub(crate) u32);

impl ImageId {
    /// Its place in [`Recording::images`](crate::Recording::images).
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a pixel of an image is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// One float of 32 bits.
    R32F,
    /// Four of 32 bits.
    Rgba32F,
    /// One of 16 bits.
    R16F,
    /// Four of 16 bits.
    Rgba16F,
}

impl Format {
    /// Numbers a pixel.
    pub fn numbers(self) -> u32 {
        match self {
            Self::R32F | Self::R16F => 1,
            Self::Rgba32F | Self::Rgba16F => 4,
        }
    }

    /// Bytes a pixel.
    pub fn bytes(self) -> u32 {
        self.numbers() * if self.is_single() { 4 } else { 2 }
    }

    /// Whether its numbers have 32 bits, which not every device blends.
    pub fn is_single(self) -> bool {
        matches!(self, Self::R32F | Self::Rgba32F)
    }
}

/// Pixels that draws blend into, on the device while the recording runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// What it holds, for people.
    pub name: &'static str,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// What a pixel is.
    pub format: Format,
}

impl Image {
    /// Rows of a copy in a buffer begin at multiples of this, bytes.
    pub const ROW: u32 = 256;

    /// Bytes from a row to the next where it is copied into a buffer.
    pub fn row_bytes(&self) -> u64 {
        (u64::from(self.size[0]) * u64::from(self.format.bytes())).next_multiple_of(Self::ROW.into())
    }

    /// Bytes of a copy in a buffer.
    pub fn copy_bytes(&self) -> u64 {
        self.row_bytes().saturating_mul(self.size[1].into())
    }
}

/// What becomes of a pixel d where a fragment s falls on it; a is the last of four numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Blend {
    /// d + s.
    Add,
    /// s + (1 − s.a)·d, all four: s lies over what was drawn before, back to front.
    Over,
    /// Colours d + d.a·s, last number d.a·(1 − s.a): s lies under what was drawn before, front to back, and d.a is what
    /// comes through. Begins with 1.
    Under,
}

/// An image that a draw blends into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// The image.
    pub image: ImageId,
    /// How.
    pub blend: Blend,
    /// What all pixels are before; without it what they were.
    pub clear: Option<[f32; 4]>,
}

/// How many corners a draw has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corners {
    /// Corners of one strip of triangles, and strips.
    Direct([u32; 2]),
    /// Four numbers, read from a buffer when the draw begins: corners of a strip, strips, 0, 0.
    Indirect {
        /// The buffer that holds them.
        buffer: BufferId,
        /// Where they begin, bytes; a multiple of 4.
        offset: u64,
    },
}

/// One run of a program over all pixels that its triangles cover. Strips are blended in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// The program.
    pub program: &'static Program,
    /// Its corners and strips.
    pub corners: Corners,
    /// Its buffers, in the order of its bindings; it reads them.
    pub buffers: Vec<BufferId>,
    /// Its push constants.
    pub push: Vec<u8>,
    /// What its outputs go to, in their order: images of one size.
    pub targets: Vec<Target>,
}
