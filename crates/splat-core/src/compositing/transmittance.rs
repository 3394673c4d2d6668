//! How much light arrives: the noun between shadow maps and shading.

use crate::{Cloud, SplatKind};
use glam::Vec3;

/// What receives light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Position relative to the origin of the cloud that casts the shadows, world units.
    pub position: Vec3,
    /// Unit normal, or zero for none.
    pub normal: Vec3,
    /// Cutoff radius of the receiving splat, world units; 0 for a bare point.
    pub radius: f32,
    /// A medium shadows itself, a surface does not.
    pub kind: SplatKind,
}

impl Receiver {
    /// Splat `i` of a cloud as it receives light.
    ///
    /// # Panics
    /// If there is no such splat.
    #[inline]
    pub fn of_splat(cloud: &Cloud, i: usize) -> Self {
        Self { position: cloud.position[i], normal: cloud.normal_of(i), radius: cloud.radius[i], kind: cloud.kind[i] }
    }
}

/// The most splats whose light is asked for together.
pub const TOGETHER: usize = 16;

/// A place and two beside it along each axis: as many look-ups tell how fast light falls off there.
pub const ABOUT: usize = 7;

/// Mean transmittance of several, as to the points of one light; at least one.
pub struct MeanTransmittance<'a>(pub Vec<&'a dyn Transmittance>);

impl Transmittance for MeanTransmittance<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let sum = self.0.iter().fold([0.0; 3], |sum, map| {
            let transmittance = map.transmittance(receiver);
            [0, 1, 2].map(|c| sum[c] + transmittance[c])
        });
        sum.map(|v: f32| v / self.0.len() as f32)
    }

    fn at_splats(&self, splats: &[usize], receiver: &dyn Fn(usize) -> Receiver) -> [[f32; 3]; TOGETHER] {
        let mut sum = [[0.0; 3]; TOGETHER];
        for map in &self.0 {
            let transmittances = map.at_splats(splats, receiver);
            sum.as_flattened_mut().iter_mut().zip(transmittances.as_flattened()).for_each(|(sum, t)| *sum += t);
        }
        sum.map(|sum| sum.map(|v: f32| v / self.0.len() as f32))
    }
}

/// Transmittance from one light to any point.
pub trait Transmittance: Sync {
    /// Share of the light that arrives at the receiver per channel, in \[0, 1\].
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3];

    /// Its absorbance −ln T per channel, for whoever tells how fast light falls off: at most 87.4, where f32 tells T from 0. A table that has it
    /// interpolates it as it is; means of e^−A between rays would be those of the brightest.
    fn absorbance(&self, receiver: &Receiver) -> [f32; 3] {
        self.transmittance(receiver).map(|through| -libm::logf(through.clamp(f32::MIN_POSITIVE, 1.0)))
    }

    /// The same, to the bit, for a place and those about it: together they take less time.
    fn absorbances_about(&self, receivers: &[Receiver; ABOUT]) -> [[f32; 3]; ABOUT] {
        receivers.each_ref().map(|receiver| self.absorbance(receiver))
    }

    /// The same as [`Transmittance::transmittance`] for a splat of the cloud that is shaded, by its place there: for who knows the light at splats beforehand.
    fn at_splat(&self, _splat: usize, receiver: &Receiver) -> [f32; 3] {
        self.transmittance(receiver)
    }

    /// The same, to the bit, for some splats, at most [`TOGETHER`], in their order: of many this takes less time. `receiver` tells each.
    ///
    /// # Panics
    /// It may, if there are more.
    fn at_splats(&self, splats: &[usize], receiver: &dyn Fn(usize) -> Receiver) -> [[f32; 3]; TOGETHER] {
        let mut light = [[0.0; 3]; TOGETHER];
        light.iter_mut().zip(splats).for_each(|(light, splat)| *light = self.at_splat(*splat, &receiver(*splat)));
        light
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shadow that tells places apart, and no two of its channels are alike.
    struct Haze(f32);

    impl Transmittance for Haze {
        fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
            [1.0, 0.5, 0.25].map(|share| share * (-self.0 * receiver.position.x).exp())
        }
    }

    #[test]
    fn a_mean_of_splats_together_has_the_bits_of_each() {
        let mean = MeanTransmittance(vec![&Haze(0.1), &Haze(0.7), &Haze(2.3)]);
        let receiver = |i: usize| Receiver {
            position: Vec3::X * i as f32,
            normal: Vec3::ZERO,
            radius: 0.0,
            kind: SplatKind::Medium,
        };
        let splats = [3, 1, 0, 8];
        let together = mean.at_splats(&splats, &receiver);
        assert_eq!(together[..4], splats.map(|i| mean.at_splat(i, &receiver(i))));
        assert!((together[1][1] - 0.5 * ((-0.1f32).exp() + (-0.7f32).exp() + (-2.3f32).exp()) / 3.0).abs() < 1e-6);
    }
}
