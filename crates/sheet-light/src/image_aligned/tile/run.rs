//! Some slabs at once of a volume that is alone in its tile: what neighbouring pixels have stays in registers from slab to slab.

use super::fold_tile::{FoldTile, Scratch, VolumeScratch};
use super::picture::Picture;
use super::place::Place;
use super::shade::{Reconstructed, Shader};
use super::size::TILE;
use super::sweep::INTERIOR;
use crate::image_aligned::counts::SheetCounts;
use crate::image_aligned::gather::{GROUP, GROUPS};
use crate::shared::depths::DepthRange;
use crate::shared::slabs::BATCH;
use splat_core::raster::lanes::Lanes;
use splat_core::raster::pulp::Simd;
use std::ops::Range;

impl FoldTile<'_> {
    /// Whether the tile holds one volume, that is gathered, and nothing beside it, and its pixels are plain ones.
    pub(crate) fn is_alone(&self, picture: &Picture) -> bool {
        let is_gathered = matches!(&self.sheeted.volumes[..], [only] if only.gathered.is_some() && only.stride == 1);
        is_gathered && self.scratch.splats.is_empty() && self.sheeted.panes.is_none() && picture.is_plain()
    }

    /// The slab behind those whose sheets are finished, the next one's, too; or behind those that hold nothing.
    pub(crate) fn run_end(&self, slab: u32, end: u32) -> u32 {
        if !self.scratch.volumes.iter().any(|volume| volume.active.contains(&slab)) {
            return self.next_face(slab, end);
        }
        let most = end.min(slab + BATCH);
        (slab + 1..most).find(|slab| self.needs_batch(*slab)).unwrap_or(most)
    }

    /// Shades and composites what the volume has in some slabs.
    #[inline(always)]
    pub(crate) fn shade_run<S: Simd>(
        &mut self,
        simd: S,
        shader: &Shader<'_>,
        slabs: Range<u32>,
        picture: &mut Picture,
        counts: &mut SheetCounts,
    ) {
        let Scratch { volumes, near, far, fragments, .. } = &mut *self.scratch;
        let (Some(prepared), Some(scratch)) = (self.sheeted.volumes.first(), volumes.first_mut()) else { return };
        let VolumeScratch { sheets, crossings, kept, active, .. } = scratch;
        // Without anything opaque all pixels have the limits of the range of depths.
        let limits = if self.opaque.is_empty() {
            DepthRange { near: near[0], far: far[0] }
        } else {
            DepthRange { near: f32::INFINITY, far: f32::NEG_INFINITY }
        };
        let slabs = slabs.start.max(active.start)..slabs.end.min(active.end);
        let mut faces = [DepthRange { near: 0.0, far: 0.0 }; BATCH as usize];
        for (faces, slab) in faces.iter_mut().zip(slabs.clone()) {
            *faces = prepared.slabs.faces(slab);
        }
        for y in 1..=TILE {
            let mut tags = 0;
            for slab in slabs.clone() {
                let of_slab = sheets.tags(slab, y);
                counts.touched += u64::from((of_slab & INTERIOR).count_ones());
                tags |= of_slab;
            }
            let tags = tags & picture.lit[y];
            for x in (1..=TILE).step_by(Lanes::<S>::COUNT) {
                let bits = ((1 << Lanes::<S>::COUNT) - 1) << x;
                if tags & bits == 0 {
                    continue;
                }
                let mut pixels = picture.pixels(simd, y - 1, x - 1);
                let open = (picture.open[y] >> x) as u32;
                let inside = crossings.wholes[y * GROUPS + (x - 1) / GROUP];
                let whole = DepthRange { near: inside.near.max(limits.near), far: inside.far.min(limits.far) };
                for (slab, faces) in slabs.clone().zip(faces) {
                    if sheets.tags(slab, y) & bits == 0 {
                        continue;
                    }
                    counts.shaded += Lanes::<S>::COUNT as u64;
                    let is_whole = whole.near <= faces.near && faces.far <= whole.far;
                    let reconstructed = Reconstructed {
                        prepared,
                        crossings,
                        sheets,
                        preclassified: None,
                        limits: [near, far],
                        part: None,
                        faces,
                        is_part: false,
                        is_whole,
                        open,
                    };
                    fragments.any = false;
                    shader.add(simd, &reconstructed, Place { slab, y, x }, picture, kept, fragments);
                    if fragments.any {
                        pixels.composite(simd, fragments);
                        if pixels.are_done() {
                            break;
                        }
                    }
                }
                picture.put(y - 1, x - 1, &pixels);
            }
        }
    }
}
