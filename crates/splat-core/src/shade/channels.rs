//! Which numbers shading gives, and where: effects in threes, then the normal, then the shadow.

use crate::{LayerSet, SHADED_EFFECTS};

/// Channels of the effects where each is kept apart.
const APART: usize = 3 * SHADED_EFFECTS.len();

/// Channels of the effects where light that is scattered many times is one of them.
const WITH_MULTIPLE: usize = APART + 3;

/// The most channels that shading gives to a splat or a particle: all of [`SHADED_EFFECTS`], the normal and the shadow. Kernels on
/// the GPU have room for no more.
pub const MAX_SHADED_CHANNELS: usize = APART + 3 + 1;

/// The most channels of any layout: those, and `scatterN`.
pub const MAX_CHANNELS: usize = WITH_MULTIPLE + 3 + 1;

const _: () = assert!(APART > 3 + 3 + 1, "`colors_of` tells effects apart from beauty by the number of channels");
const _: () =
    assert!(WITH_MULTIPLE + 3 > MAX_SHADED_CHANNELS, "`colors_of` tells `scatterN` by the number of channels");

/// Which numbers each splat carries through compositing, and where.
///
/// First the effects: one beauty colour, or each of [`SHADED_EFFECTS`] apart, and `scatterN` where
/// [`ChannelLayout::with_multiple`] asks for it. Then the normal, then the shadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChannelLayout {
    effects: bool,
    multiple: bool,
    normal: bool,
    shadow: bool,
}

impl ChannelLayout {
    /// The channels that `layers` need.
    pub const fn new(layers: &LayerSet) -> Self {
        Self { effects: layers.effects, multiple: false, normal: layers.normal, shadow: layers.shadow }
    }

    /// The same, with light that is scattered more than once as an effect of its own, `scatterN`, where effects are kept apart;
    /// in beauty it is one of the summands. For techniques that simulate it.
    ///
    /// Such a layout has a normal, asked for or not: so the number of channels tells what they are.
    #[must_use]
    pub const fn with_multiple(self) -> Self {
        Self { multiple: true, normal: self.normal || self.effects, ..self }
    }

    /// Numbers a splat.
    #[inline]
    pub const fn count(&self) -> usize {
        self.colors() + 3 * self.normal as usize + self.shadow as usize
    }

    /// How many of them are red, green and blue, in threes; they come first.
    #[inline]
    pub const fn colors(&self) -> usize {
        match (self.effects, self.multiple) {
            (true, true) => WITH_MULTIPLE,
            (true, false) => APART,
            _ => 3,
        }
    }

    /// How many of `count` channels in all are red, green and blue. The others, normal and shadow, are no colours: where
    /// extinction differs by channel they take one weight, green's.
    pub(crate) const fn colors_of(count: usize) -> usize {
        match count {
            0..3 => 0,
            3..APART => 3,
            APART..=MAX_SHADED_CHANNELS => APART,
            _ => WITH_MULTIPLE,
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

    /// The first channel that light is added to that is scattered more than once: its own, or beauty's; `None` where effects are
    /// kept apart without it.
    #[inline]
    pub const fn multiple(&self) -> Option<usize> {
        match (self.effects, self.multiple) {
            (true, true) => Some(APART),
            (true, false) => None,
            _ => Some(0),
        }
    }

    /// Name and first channel of each colour: those of [`SHADED_EFFECTS`] and `scatterN` where it is asked for, or `beauty` alone.
    pub fn effects(&self) -> impl Iterator<Item = (&'static str, usize)> + use<> {
        let names: &[&str] = if self.effects { &SHADED_EFFECTS } else { &["beauty"] };
        let more: &[&str] = if self.effects && self.multiple { &["scatterN"] } else { &[] };
        names.iter().chain(more).copied().zip((0..).step_by(3))
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
