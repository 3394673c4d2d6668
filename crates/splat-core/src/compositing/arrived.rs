//! Light that arrived at splats, remembered: it does not depend on the viewer, so when he alone moves it need not be looked up
//! again.

use crate::{ABOUT, Receiver, TOGETHER, Transmittance};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What arrived of one light at each splat of a cloud, as far as it was asked for.
///
/// ```
/// use splat_core::glam::Vec3;
/// use splat_core::{Arrived, Receiver, SplatKind, Transmittance};
/// struct Fog;
/// impl Transmittance for Fog {
///     fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
///         [(-receiver.position.z).exp(); 3]
///     }
/// }
/// let splat = Receiver { position: Vec3::Z, normal: Vec3::Z, radius: 0.1, kind: SplatKind::Medium };
/// let arrived = Arrived::new(1);
/// assert_eq!(arrived.through(&Fog).at_splat(0, &splat), Fog.transmittance(&splat));
/// ```
pub struct Arrived {
    /// Bits of what arrives at each splat: of red and green, and of blue; [`UNKNOWN`] where nobody asked yet. In this form a share is
    /// written as it is read, eight bytes and four: a load that takes two stores together waits for both to leave the processor.
    shares: Vec<[AtomicU64; 2]>,
}

/// No bits of shares, which are numbers.
const UNKNOWN: u64 = u64::MAX;

fn packed(color: [f32; 3]) -> [u64; 2] {
    let [r, g, b] = color;
    let [r, g, b] = [r, g, b].map(|share| u64::from(share.to_bits()));
    [r | g << 32, b]
}

#[inline]
fn unpacked(words: [u64; 2]) -> [f32; 3] {
    let [red_green, blue] = words;
    [red_green as u32, (red_green >> 32) as u32, blue as u32].map(f32::from_bits)
}

impl Arrived {
    /// Nothing known yet of a cloud's first `splats` splats. Of others nothing is remembered.
    pub fn new(splats: usize) -> Self {
        let unknown = || [AtomicU64::new(UNKNOWN), AtomicU64::new(UNKNOWN)];
        Self { shares: std::iter::repeat_with(unknown).take(splats).collect() }
    }

    /// Bytes that it takes of so many splats.
    pub fn bytes_of(splats: usize) -> u64 {
        (splats as u64).saturating_mul(size_of::<[AtomicU64; 2]>() as u64)
    }

    #[inline]
    fn known(&self, splat: usize) -> Option<[f32; 3]> {
        let stored = self.shares.get(splat)?;
        let known = [stored[0].load(Relaxed), stored[1].load(Relaxed)];
        known.iter().all(|bits| *bits != UNKNOWN).then(|| unpacked(known))
    }

    /// Whoever asks at the same time finds the same numbers.
    #[inline]
    fn remember(&self, splat: usize, share: [f32; 3]) {
        if let Some(stored) = self.shares.get(splat) {
            stored.iter().zip(packed(share)).for_each(|(word, bits)| word.store(bits, Relaxed));
        }
    }

    /// A shadow that is asked once for each splat. It must be that of the same light among the same casters each time.
    pub fn through<'a>(&'a self, shadow: &'a dyn Transmittance) -> Remembered<'a> {
        Remembered { arrived: self, shadow }
    }
}

/// A shadow whose light at splats is remembered, see [`Arrived::through`].
#[derive(Clone, Copy)]
pub struct Remembered<'a> {
    arrived: &'a Arrived,
    shadow: &'a dyn Transmittance,
}

impl Transmittance for Remembered<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        self.shadow.transmittance(receiver)
    }

    fn absorbance(&self, receiver: &Receiver) -> [f32; 3] {
        self.shadow.absorbance(receiver)
    }

    fn absorbances_about(&self, receivers: &[Receiver; ABOUT]) -> [[f32; 3]; ABOUT] {
        self.shadow.absorbances_about(receivers)
    }

    fn at_splat(&self, splat: usize, receiver: &Receiver) -> [f32; 3] {
        self.arrived.known(splat).unwrap_or_else(|| {
            let share = self.shadow.at_splat(splat, receiver);
            self.arrived.remember(splat, share);
            share
        })
    }

    fn at_splats(&self, splats: &[usize], receiver: &dyn Fn(usize) -> Receiver) -> [[f32; 3]; TOGETHER] {
        let mut light = [[0.0; 3]; TOGETHER];
        let mut asked = [0; TOGETHER];
        let mut places = [0; TOGETHER];
        let mut unknown = 0;
        for (place, splat) in splats.iter().enumerate() {
            if let Some(known) = self.arrived.known(*splat) {
                light[place] = known;
            } else {
                (asked[unknown], places[unknown]) = (*splat, place);
                unknown += 1;
            }
        }
        if unknown > 0 {
            let shares = self.shadow.at_splats(&asked[..unknown], receiver);
            for ((splat, place), share) in asked[..unknown].iter().zip(places).zip(shares) {
                self.arrived.remember(*splat, share);
                light[place] = share;
            }
        }
        light
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SplatKind;
    use glam::Vec3;
    use std::sync::atomic::AtomicUsize;

    /// A shadow that counts how often it is asked.
    struct Counted(AtomicUsize);

    impl Transmittance for Counted {
        fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
            self.0.fetch_add(1, Relaxed);
            [0.25, 0.5, receiver.position.x]
        }
    }

    #[test]
    fn a_shadow_is_asked_once_for_a_splat_and_each_time_for_others() {
        let shadow = Counted(AtomicUsize::new(0));
        let arrived = Arrived::new(2);
        let receiver =
            |x: f32| Receiver { position: Vec3::X * x, normal: Vec3::ZERO, radius: 0.0, kind: SplatKind::Medium };
        let remembered = arrived.through(&shadow);
        let ask = |splat: usize| remembered.at_splat(splat, &receiver(splat as f32));
        for _ in 0..3 {
            assert_eq!([0, 1, 2].map(ask), [[0.25, 0.5, 0.0], [0.25, 0.5, 1.0], [0.25, 0.5, 2.0]]);
        }
        // Splats 0 and 1 once, splat 2 three times.
        assert_eq!(shadow.0.load(Relaxed), 5);
        assert_eq!(remembered.transmittance(&receiver(0.75)), [0.25, 0.5, 0.75]);
        assert_eq!(shadow.0.load(Relaxed), 6);
        assert_eq!(Arrived::bytes_of(2), 32);
    }

    #[test]
    fn splats_together_are_asked_for_where_they_are_not_known() {
        let shadow = Counted(AtomicUsize::new(0));
        let arrived = Arrived::new(6);
        let receiver = |i: usize| Receiver {
            position: Vec3::X * i as f32,
            normal: Vec3::ZERO,
            radius: 0.0,
            kind: SplatKind::Medium,
        };
        let remembered = arrived.through(&shadow);
        for splat in [4, 1] {
            remembered.at_splat(splat, &receiver(splat));
        }
        // Splats 1 and 4 are known by now, splat 7 will never be.
        for (splats, asked) in [([0, 1, 4, 7, 2], 3), ([0, 1, 4, 7, 2], 1), ([5, 4, 3, 2, 1], 2)] {
            let before = shadow.0.load(Relaxed);
            let together = remembered.at_splats(&splats, &receiver);
            assert_eq!(together[..5], splats.map(|i| [0.25, 0.5, i as f32]));
            assert_eq!(shadow.0.load(Relaxed) - before, asked);
        }
    }
}
