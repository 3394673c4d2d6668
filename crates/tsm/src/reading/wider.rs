//! A map as its cells would have it twice as wide, from which the error of its own cells follows.

use crate::ShadowMap;
use crate::mapping::{Mapping, with_mapping};
use glam::Vec3;
use splat_core::{Receiver, Transmittance, glam};

/// A map that is blurred across its rays as cells twice as wide would blur it.
///
/// A cell of width h has the mean of what lies in it, and look-ups are linear between four: together a blur of variance h²/12 + h²/6 along each axis. With
/// cells twice as wide the variance is four times that, and where light is smooth the error too. So a third of the difference between this and the map is
/// the map's own error against the smallest cells, whatever follows from the light.
#[derive(Clone, Copy)]
pub struct Wider<'a> {
    map: &'a ShadowMap,
}

/// Distance of the four looks from a place along each axis, widths of a cell: √¾, so that their variance is what is missing.
const ASIDE: f32 = 0.866_025_4;

impl ShadowMap {
    /// The map as cells twice as wide would have it.
    pub fn wider(&self) -> Wider<'_> {
        Wider { map: self }
    }

    /// Two steps across the rays at a place, as long as its cell is wide, world units; `None` outside of the table.
    fn across_cell(&self, position: Vec3) -> Option<[Vec3; 2]> {
        let (_, _, width) = self.place_of(position)?;
        let place = self.frame.position(position);
        let is_parallel = with_mapping!(&self.table, m => m.is_parallel());
        let towards = if is_parallel { Vec3::Z } else { place.normalize() };
        let first = towards.any_orthonormal_vector();
        let length = self.frame.world_length(width) as f32;
        Some([first, towards.cross(first)].map(|direction| self.frame.world_direction(direction) * length))
    }
}

impl Wider<'_> {
    /// The mean over the four looks about a receiver.
    fn mean(&self, receiver: &Receiver, look: impl Fn(&Receiver) -> [f32; 3]) -> [f32; 3] {
        let Some([first, second]) = self.map.across_cell(receiver.position) else { return look(receiver) };
        let mut sum = [0.0; 3];
        for aside in [first + second, first - second, second - first, -first - second] {
            let looked = look(&Receiver { position: receiver.position + ASIDE * aside, ..*receiver });
            (0..3).for_each(|c| sum[c] += 0.25 * looked[c]);
        }
        sum
    }
}

impl Transmittance for Wider<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        self.mean(receiver, |place| self.map.transmittance(place))
    }

    fn absorbance(&self, receiver: &Receiver) -> [f32; 3] {
        self.mean(receiver, |place| self.map.absorbance(place))
    }
}
