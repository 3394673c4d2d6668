//! What polygons let through along a way between two places: parts with a share each.
//!
//! Opaque ones alone leave one part, lit as a whole. Behind translucent ones light has steps where the shadow of one ends and that of another
//! begins: these are found, and of more than [`MOST_PARTS`] those that differ least count as one.

use splat_core::glam::Vec3;

/// Most parts of a way.
pub(crate) const MOST_PARTS: usize = 4;

/// Difference of shares that is none.
const SAME: f32 = 1e-6;

/// A stretch of a way, as shares of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    pub(crate) from: f32,
    pub(crate) to: f32,
}

impl Stretch {
    /// All of the way.
    pub(crate) const WHOLE: Self = Self { from: 0.0, to: 1.0 };
}

/// A part of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WayPart {
    /// Shares of the way at which it begins and ends.
    pub(crate) from: f32,
    pub(crate) to: f32,
    /// Share of the light that it receives, by channel.
    pub(crate) through: Vec3,
}

/// The parts of a way that are lit, one after the other; the rest is dark.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LitWay {
    parts: [WayPart; MOST_PARTS + 1],
    count: usize,
}

impl WayPart {
    const NONE: Self = Self { from: 0.0, to: 0.0, through: Vec3::ZERO };

    fn length(&self) -> f32 {
        self.to - self.from
    }
}

impl LitWay {
    /// All dark.
    pub(crate) const DARK: Self = Self { parts: [WayPart::NONE; MOST_PARTS + 1], count: 0 };

    /// One part that is wholly lit.
    pub(crate) fn lit(stretch: Stretch) -> Self {
        let Stretch { from, to } = stretch;
        let mut way = Self::DARK;
        way.parts[0] = WayPart { from, to, through: Vec3::ONE };
        way.count = 1;
        way
    }

    pub(crate) fn parts(&self) -> &[WayPart] {
        &self.parts[..self.count]
    }

    /// Whether all of it is lit by all of the light.
    pub(crate) fn is_whole(&self) -> bool {
        self.parts() == [WayPart { from: 0.0, to: 1.0, through: Vec3::ONE }]
    }

    /// Appends what follows.
    pub(crate) fn push(&mut self, part: WayPart) {
        if part.length() <= 0.0 || part.through == Vec3::ZERO {
            return;
        }
        if let Some(last) = self.parts[..self.count].last_mut()
            && last.to == part.from
            && (last.through - part.through).abs().max_element() <= SAME
        {
            last.to = part.to;
            return;
        }
        self.parts[self.count] = part;
        self.count += 1;
        if self.count > MOST_PARTS {
            self.join();
        }
    }

    /// Makes one part of the two neighbours that differ least.
    fn join(&mut self) {
        let cost = |n: &usize| {
            let [a, b] = [self.parts[*n], self.parts[n + 1]];
            let gap = (b.from - a.to) * (a.through + b.through).max_element();
            gap + (a.through - b.through).abs().max_element() * a.length().min(b.length())
        };
        let pairs = 0..self.count - 1;
        let Some(n) = pairs.min_by(|a, b| cost(a).total_cmp(&cost(b))) else {
            return;
        };
        let [a, b] = [self.parts[n], self.parts[n + 1]];
        let sum = a.through * a.length() + b.through * b.length();
        self.parts[n] = WayPart { from: a.from, to: b.to, through: sum / (b.to - a.from) };
        self.parts.copy_within(n + 2..self.count, n + 1);
        self.count -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_joined_where_they_are_alike_and_keep_their_light() {
        let shares = [1.0, 1.0, 0.5, 0.5 + 1e-7, 0.0, 0.25, 0.24, 0.9, 0.8];
        let mut way = LitWay::DARK;
        let mut light = 0.0;
        for (n, share) in shares.into_iter().enumerate() {
            let [from, to] = [n, n + 1].map(|n| n as f32 / shares.len() as f32);
            way.push(WayPart { from, to, through: Vec3::splat(share) });
            light += share * (to - from);
        }
        let found: f32 = way.parts().iter().map(|part| part.through.x * part.length()).sum();
        assert_eq!(way.parts().len(), MOST_PARTS);
        assert!((found - light).abs() < 1e-6, "{found}, not {light}");
        let expected = [(0.0, 1.0), (2.0, 0.5), (5.0, 0.245), (7.0, 0.85)];
        for (part, (from, share)) in way.parts().iter().zip(expected) {
            assert!((part.from - from / 9.0).abs() < 1e-6 && (part.through.x - share).abs() < 1e-6, "{part:?}");
        }
        assert!(LitWay::lit(Stretch::WHOLE).is_whole() && !way.is_whole() && !LitWay::DARK.is_whole());
    }
}
