//! Which numbers shading gives, and where: effects in threes, then the normal, then the shadow.

use crate::{LayerSet, SHADED_EFFECTS};

/// Channels of the effects where each is kept apart.
const APART: usize = 3 * SHADED_EFFECTS.len();

/// The most channels that a splat or a particle can have: all effects, the normal and the shadow.
pub const MAX_CHANNELS: usize = APART + 3 + 1;

const _: () = assert!(APART > 3 + 3 + 1, "`colors_of` tells effects apart from beauty by the number of channels");

/// Which numbers each splat carries through compositing, and where.
///
/// First the effects: one beauty colour, or each of [`SHADED_EFFECTS`] apart. Then the normal, then the shadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChannelLayout {
    effects: bool,
    normal: bool,
    shadow: bool,
}

impl ChannelLayout {
    /// The channels that `layers` need.
    pub const fn new(layers: &LayerSet) -> Self {
        Self { effects: layers.effects, normal: layers.normal, shadow: layers.shadow }
    }

    /// Numbers a splat.
    #[inline]
    pub const fn count(&self) -> usize {
        self.colors() + 3 * self.normal as usize + self.shadow as usize
    }

    /// How many of them are red, green and blue, in threes; they come first.
    #[inline]
    pub const fn colors(&self) -> usize {
        if self.effects { APART } else { 3 }
    }

    /// How many of `count` channels in all are red, green and blue. The others, normal and shadow, are no colours: where
    /// extinction differs by channel they take one weight, green's.
    pub(crate) const fn colors_of(count: usize) -> usize {
        match count {
            0..3 => 0,
            3..APART => 3,
            _ => APART,
        }
    }

    /// The plane of optical depth, of 1 or 3, that hides channel `channel` of `count`.
    #[inline(always)]
    pub const fn plane_of(channel: usize, count: usize, planes: usize) -> usize {
        if planes == 3 && channel < Self::colors_of(count) { channel % 3 } else { planes / 2 }
    }

    /// Whether effects are kept apart.
    #[inline]
    pub const fn is_apart(&self) -> bool {
        self.effects
    }

    /// Name and first channel of each colour: those of [`SHADED_EFFECTS`], or `beauty` alone.
    pub fn effects(&self) -> impl Iterator<Item = (&'static str, usize)> + use<> {
        let names: &[&str] = if self.effects { &SHADED_EFFECTS } else { &["beauty"] };
        names.iter().copied().zip((0..).step_by(3))
    }

    /// First channel of the normal.
    #[inline]
    pub const fn normal(&self) -> Option<usize> {
        if self.normal { Some(self.colors()) } else { None }
    }

    /// Channel of the shadow.
    #[inline]
    pub const fn shadow(&self) -> Option<usize> {
        if self.shadow { Some(self.count() - 1) } else { None }
    }
}
