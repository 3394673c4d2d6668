//! How much light arrives: the noun between shadow maps and shading.

use crate::SplatKind;
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

/// Mean transmittance of several, as to the points of one light; at least one.
pub struct MeanTransmittance<'a>(pub Vec<&'a dyn Transmittance>);

impl Transmittance for MeanTransmittance<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let sum = self.0.iter().fold([0.0; 3], |sum, one| {
            let own = one.transmittance(receiver);
            [0, 1, 2].map(|c| sum[c] + own[c])
        });
        sum.map(|v: f32| v / self.0.len() as f32)
    }
}

/// Transmittance from one light to any point.
pub trait Transmittance: Sync {
    /// Share of the light that arrives at the receiver per channel, in \[0, 1\].
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3];

    /// The same for a splat of the cloud that is shaded, by its place there: for who knows the light at splats beforehand.
    fn at_splat(&self, _splat: usize, receiver: &Receiver) -> [f32; 3] {
        self.transmittance(receiver)
    }
}
