//! Channels of a volume's own slab that the faces of others cut: found once, kept from part to part.

use super::place::Place;
use super::size::AREA;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::MAX_CHANNELS;

/// Numbers of a plane: vectors may run over its end.
const PLANE: usize = AREA + MAX_LANES;

/// The channels of one volume in one tile.
#[derive(Debug)]
pub(crate) struct Kept {
    /// By the first pixel of neighbours: whose slab they are.
    slabs: Vec<u32>,
    /// Plane by plane.
    channels: Vec<f32>,
}

impl Kept {
    /// For a volume whose slabs are so many of all volumes' wide: a single one is never cut.
    pub(crate) fn new(stride: u32) -> Self {
        let planes = if stride > 1 { MAX_CHANNELS } else { 0 };
        Self { slabs: vec![u32::MAX; AREA.min(planes * AREA)], channels: vec![0.0; planes * PLANE] }
    }

    /// Bytes of one.
    pub(crate) const fn bytes(stride: u32) -> u64 {
        if stride > 1 { 4 * (AREA + MAX_CHANNELS * PLANE) as u64 } else { 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.slabs.fill(u32::MAX);
    }

    /// Whether nothing is kept of that slab there.
    #[inline(always)]
    pub(crate) fn is_new(&self, place: Place) -> bool {
        self.slabs[place.pixel()] != place.slab
    }

    #[inline(always)]
    pub(crate) fn keep<S: Simd>(&mut self, place: Place, values: &[[f32; MAX_LANES]]) {
        self.slabs[place.pixel()] = place.slab;
        for (plane, from) in self.channels.chunks_exact_mut(PLANE).zip(values) {
            plane[place.pixel()..][..Lanes::<S>::COUNT].copy_from_slice(&from[..Lanes::<S>::COUNT]);
        }
    }

    #[inline(always)]
    pub(crate) fn recall<S: Simd>(&self, place: Place, values: &mut [[f32; MAX_LANES]]) {
        for (plane, to) in self.channels.chunks_exact(PLANE).zip(values) {
            to[..Lanes::<S>::COUNT].copy_from_slice(&plane[place.pixel()..][..Lanes::<S>::COUNT]);
        }
    }
}
