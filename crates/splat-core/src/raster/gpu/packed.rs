//! Footprints as kernels read them: a few words a splat.

use crate::raster::Projected;
use crate::raster::projected::{Coverage, ProjectedDepth, ProjectedSplat};
use rayon::prelude::*;

/// Words of a splat, and with depths.
pub(super) const SPLAT_WORDS: [u32; 2] = [8, 15];

/// The words of all splats, as the kernels read them: 8 each, 15 with depths; 0 for one that no pixel shows.
pub fn words(projected: &Projected, depth: bool) -> Vec<u32> {
    let words = SPLAT_WORDS[usize::from(depth)] as usize;
    let mut splats = vec![0u32; words * projected.splats.len()];
    let places = splats.par_chunks_exact_mut(words).zip(&projected.splats).zip(&projected.coverage).enumerate();
    places.with_min_len(1 << 12).for_each(|(i, ((to, splat), coverage))| {
        if *coverage != Coverage::NONE {
            pack(splat, projected.depths.get(i), to);
        }
    });
    splats
}

/// The words of a splat, as `splats.glsl` reads them; all 0 for one that is not shown.
fn pack(splat: &ProjectedSplat, depth: Option<&ProjectedDepth>, to: &mut [u32]) {
    let [half_x, half_y] = splat.half_extent.map(u32::from);
    let floats = splat.center_px.into_iter().chain(splat.conic).chain([splat.peak]);
    to.iter_mut().zip(floats).for_each(|(to, from)| *to = from.to_bits());
    to[6] = half_x | half_y << 16;
    to[7] = u32::from(splat.material) | u32::from(splat.footprint) << 16 | (splat.kind as u32) << 24;
    if let (Some(to), Some(depth)) = (to.get_mut(8..), depth) {
        let floats = [depth.center, depth.slope[0], depth.slope[1], depth.extent].into_iter().chain(depth.core);
        to.iter_mut().zip(floats).for_each(|(to, from)| *to = from.to_bits());
    }
}
