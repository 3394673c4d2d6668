//! The fold of prepared sheets over a range of depths.

use super::counts::SheetCounts;
use super::panes::Panes;
use super::prepared::Sheeted;
use crate::Error;
use crate::image_aligned::tile::fold_tile::{FoldTile, Scratch};
use crate::shared::error::cancelled;
use crate::shared::gathered::Gathered;
use rayon::prelude::*;
use splat_core::raster::bins::Bins;
use splat_core::raster::pulp;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Progress};
use std::ops::Range;

impl Sheeted<'_> {
    /// Slabs, and their width in world units.
    pub fn slabs(&self) -> (u32, f64) {
        (self.slabs.count, self.slabs.width)
    }

    /// Bytes of what was prepared.
    pub fn bytes(&self) -> u64 {
        let volumes: u64 = self
            .volumes
            .iter()
            .map(|v| v.segments.bytes() + v.voxels.held() + v.gathered.as_ref().map_or(0, Gathered::bytes))
            .sum();
        volumes + self.bins.as_ref().map_or(0, Bins::bytes) + self.panes.as_ref().map_or(0, Panes::bytes)
    }

    /// Folds what lies at view depths in `range`, front to back, behind all that `into` holds. Ranges that meet share nothing and
    /// lose nothing, wherever in a slab they do. `opaque` has the view depth of what hides the volumes at each pixel, +∞ for
    /// nothing; or it is empty. One tick a tile.
    ///
    /// # Errors
    /// [`Error::Cancelled`]: the accumulator is of no use as a picture.
    ///
    /// # Panics
    /// If the sizes of the camera's image, `into` and `opaque` disagree, or `into` has other channels than `layout`.
    pub fn fold(
        &self,
        range: Range<f32>,
        opaque: &[f32],
        layout: &ChannelLayout,
        into: &mut Accumulator,
        progress: Option<&Progress>,
    ) -> Result<SheetCounts, Error> {
        assert_eq!(self.input.camera.size, into.size, "invariant: one image size");
        assert_eq!(layout.count(), into.channels.len(), "invariant: one set of channels");
        let pixels = into.size[0] as usize * into.size[1] as usize;
        assert!(opaque.is_empty() || opaque.len() == pixels, "invariant: an opaque depth for each pixel");
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        let range = f64::from(range.start).max(f64::MIN)..f64::from(range.end).min(f64::MAX);
        let tiles = self.tiles[0] * self.tiles[1];
        progress.add_total(tiles as u64);
        let held: &Accumulator = into;
        let fold = |scratch: &mut Scratch, t: usize| {
            progress.tick(1).ok()?;
            let work = FoldTile { sheeted: self, layout, into: held, range: range.clone(), opaque, t, scratch };
            Some(pulp::Arch::new().dispatch(work))
        };
        let done: Vec<_> = (0..tiles).into_par_iter().map_init(|| Scratch::new(&self.volumes), fold).collect();
        progress.tick(0).map_err(cancelled)?;
        let mut counts = self.counts();
        for (picture, of_tile) in done.into_iter().flatten() {
            counts = counts.add(of_tile);
            if let Some(picture) = picture {
                picture.store(into);
            }
        }
        Ok(counts)
    }

    /// What is known before anything is folded.
    fn counts(&self) -> SheetCounts {
        SheetCounts {
            voxels: self.volumes.iter().map(|v| v.volume.grid.values.len() as u64).sum(),
            visible: self.volumes.iter().map(|v| v.voxels.count()).sum(),
            slabs: u64::from(self.slabs.count),
            bytes: self.bytes(),
            ..SheetCounts::default()
        }
    }
}
