//! Transparent surfaces: in each pixel the discs of a layer are averaged by their weights (Eq. 1), and layers are composited by their
//! opacities, near to far, without a limit to their number.

use crate::disc::Discs;
use crate::floored::{Floor, Layering};
use crate::fragments::{BlockLists, Fragment, WalkTile};
use crate::glass::Glass;
use crate::layers::GapRule;
use crate::shade::Shown;
use crate::tile::Tile;
use crate::{Error, Params};
use rayon::prelude::*;
use splat_core::raster::GlassImage;
use splat_core::raster::bins::bin_rectangles;
use splat_core::raster::pulp;
use splat_core::{Accumulator, Progress};
use std::ops::Range;

/// The input of a blend.
#[derive(Clone)]
pub struct BlendInput<'a> {
    /// The discs of a view.
    pub discs: &'a Discs,
    /// Their values: as many numbers as the accumulator has channels.
    pub shown: Shown<'a>,
    /// View depth of what hides layers, by pixel; empty where nothing does.
    pub opaque: &'a [f32],
    /// View depths of the layers that are composited; the others are left out.
    pub range: Range<f32>,
    /// The rule that forms layers from discs.
    pub layering: Layering<'a>,
    /// The rendering of matter that surfaces bound; `None` where no material bounds any. By [`Layering::Algorithm1`] and [`Layering::Algorithm2`]
    /// light is mirrored and bent at the nearest layer alone.
    pub glass: Option<Glass<'a>>,
}

/// The result of a blend, beside the accumulator.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Blended {
    /// Work that was done.
    pub counts: BlendCounts,
    /// Light that was mirrored and bent, where [`BlendInput::glass`] is there.
    pub glass: Option<GlassImage>,
}

impl Blended {
    /// Adds what nearer ranges of depth have mirrored; what is behind everything comes with the last one.
    #[must_use]
    pub fn behind(mut self, before: Option<GlassImage>) -> Self {
        match (&mut self.glass, before) {
            (Some(image), Some(before)) => {
                for (sum, plane) in image.mirrored.iter_mut().zip(before.mirrored) {
                    sum.iter_mut().zip(plane).for_each(|(sum, value)| *sum += value);
                }
            }
            (None, before) => self.glass = before,
            (Some(_), None) => {}
        }
        self
    }
}

/// Work that was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BlendCounts {
    /// Discs that some pixel may see.
    pub discs: u64,
    /// Rays that met a disc.
    pub fragments: u64,
    /// Layers that were composited.
    pub layers: u64,
    /// Bytes of discs and lists.
    pub bytes: u64,
}

/// Composites layers of discs behind all that the accumulator holds. One tick a tile.
///
/// # Errors
/// [`Error::Parameter`]; [`Error::Cancelled`], after which the accumulator is of no use as a picture.
///
/// # Panics
/// If sizes of the image, the accumulator, `opaque` and what is shown disagree.
pub fn blend(
    input: &BlendInput<'_>,
    params: &Params,
    accumulator: &mut Accumulator,
    progress: Option<&Progress>,
) -> Result<Blended, Error> {
    params.check()?;
    input.layering.check()?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let discs = input.discs;
    assert_eq!(discs.size, accumulator.size, "invariant: one image size");
    let ranks: Vec<u32> = (0..discs.discs.len() as u32).collect();
    let bins = bin_rectangles(discs.size, &ranks, |i| discs.discs[i as usize].pixels);
    progress.add_total(bins.tiles() as u64);
    let rule = GapRule::new(params);
    let most = if let Layering::Peeled(most) = input.layering { most as usize } else { usize::MAX };
    let floor = Floor::new(&input.layering, discs.depths);
    let done: Vec<Tile> = (0..bins.tiles())
        .into_par_iter()
        .filter(|&t| progress.tick(1).is_ok() && !bins.is_empty(t))
        .map_init(BlockLists::default, |lists, t| {
            lists.fill(discs, &bins, t);
            let corner = bins.corner(t);
            let mut tile = Tile::load(accumulator, input, corner);
            let mut layers = Vec::new();
            let visit = |k: usize, fragments: &mut [Fragment]| {
                rule.split(discs, fragments, &mut layers);
                match &floor {
                    Some(floor) => tile.floored(k, fragments, &layers, input, floor, rule),
                    None => tile.pixel(k, fragments, &layers[..most.min(layers.len())], input, params),
                }
            };
            let fragments = pulp::Arch::new().dispatch(WalkTile { discs, lists, corner, visit });
            tile.fragments = fragments;
            tile
        })
        .collect();
    progress.tick(0).map_err(|_| Error::Cancelled)?;
    let mut counts =
        BlendCounts { discs: bins.splats(), bytes: discs.bytes() + bins.bytes(), ..BlendCounts::default() };
    let mut glass = input.glass.as_ref().map(|_| GlassImage::new(discs.size));
    for tile in done {
        counts.fragments += tile.fragments;
        counts.layers += tile.layers;
        tile.store(accumulator, glass.as_mut());
    }
    Ok(Blended { counts, glass })
}
