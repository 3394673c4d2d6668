//! Light that arrived at splats, remembered: it does not depend on the viewer, so when he alone moves it need not be looked up
//! again.

use crate::{Receiver, Transmittance};
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
    of: Vec<[AtomicU64; 2]>,
}

/// No bits of shares, which are numbers.
const UNKNOWN: u64 = u64::MAX;

fn packed([r, g, b]: [f32; 3]) -> [u64; 2] {
    let [r, g, b] = [r, g, b].map(|share| u64::from(share.to_bits()));
    [r | g << 32, b]
}

#[inline]
fn unpacked([red_green, blue]: [u64; 2]) -> [f32; 3] {
    [red_green as u32, (red_green >> 32) as u32, blue as u32].map(f32::from_bits)
}

impl Arrived {
    /// Nothing known yet of a cloud's first `splats` splats. Of others nothing is remembered.
    pub fn new(splats: usize) -> Self {
        let unknown = || [AtomicU64::new(UNKNOWN), AtomicU64::new(UNKNOWN)];
        Self { of: std::iter::repeat_with(unknown).take(splats).collect() }
    }

    /// Bytes that it takes of so many splats.
    pub fn bytes_of(splats: usize) -> u64 {
        (splats as u64).saturating_mul(size_of::<[AtomicU64; 2]>() as u64)
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

    fn at_splat(&self, splat: usize, receiver: &Receiver) -> [f32; 3] {
        let Some(of) = self.arrived.of.get(splat) else { return self.shadow.at_splat(splat, receiver) };
        let known = [of[0].load(Relaxed), of[1].load(Relaxed)];
        if known[0] != UNKNOWN && known[1] != UNKNOWN {
            return unpacked(known);
        }
        // Whoever asks at the same time finds the same numbers.
        let share = self.shadow.at_splat(splat, receiver);
        of.iter().zip(packed(share)).for_each(|(of, bits)| of.store(bits, Relaxed));
        share
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
}
