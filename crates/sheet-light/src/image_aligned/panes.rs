//! Translucent polygons among slabs across the view. Their light comes through shadows that are known before, so what each shows is, too; a pixel that
//! shows some has what its slabs hold before, among and behind them, one after the other.

use crate::half_vector::polygons::surfaces::EyePanes;
use splat_core::Camera;

/// Translucent polygons that pixels show, lit.
pub(crate) struct Panes<'a> {
    pub(crate) polygons: EyePanes<'a>,
    pub(crate) camera: &'a Camera,
    /// Channels of each place, one place after the other.
    pub(crate) values: Vec<f32>,
    pub(crate) channels: usize,
    /// View depth of the first slab.
    pub(crate) origin: f64,
}

impl Panes<'_> {
    /// Bytes of the lists.
    pub(crate) fn bytes(&self) -> u64 {
        self.polygons.bytes() + 4 * self.values.len() as u64
    }

    /// Depth of a place, counted from the first slab.
    pub(crate) fn depth(&self, rank: u32) -> f32 {
        (f64::from(self.polygons.seen.depth(rank as usize)) - self.origin) as f32
    }
}
