//! Opaque surfaces in one pass over the discs (Zhang and Pajarola 2007, sections 3.2 and 5.1), and in two passes, as in earlier
//! point renderers (section 3.1).
//!
//! | passes | over the discs | over the image |
//! |---|---|---|
//! | 1+1 | each group keeps the nearest disc of a pixel | the discs of all groups that nothing hides are averaged (Figs. 6 and 11) |
//! | 2+1 | the hiding depth; then the sums over discs that nothing hides | sums are divided by Σw |
//!
//! A disc whose core a ray meets at the depth z hides what lies behind z + ε. ε is [`Params::gap`] of the disc's radius across its plane,
//! so it has no unit; where the disc is seen nearly edge-on, it is at most four times that along the ray. A pixel is the
//! average by weight (Eq. 1) of all discs that nothing hides there. A rim without a core near it, such as a rim over a silhouette, is not
//! seen. The core is [`Footprint::CORE`](splat_core::Footprint::CORE) of the cut-off radius, and ends where the surface does.
//!
//! A group's image covers the 16 pixels of a block, and only groups that a block meets are cleared and composited. So neither
//! time nor memory grows with the number of groups times the number of pixels.

mod block;
mod groups;
mod lit;
mod memory;
mod picture;
mod silhouette;
mod visibility;

use crate::disc::Discs;
use crate::fragments::BlockLists;
use crate::grouping::Groups;
use crate::shade::Shown;
use crate::{Error, Params};
use block::{Block, Rules};
use groups::GroupImages;
use picture::Tile;
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::raster::pulp::{self, Simd};
use splat_core::raster::tile::{BLOCKS, PIXELS};
use splat_core::raster::{OpaqueImage, RasterCounts};

/// The number of passes over the discs.
#[derive(Debug, Clone, Copy)]
pub enum Passes<'a> {
    /// 1+1: once, into images of groups, which are composited.
    OnePlusOne {
        /// The group of each disc of the cloud. A disc that was added to further groups counts once, in its own.
        groups: &'a Groups,
        /// Whether of two discs of a group in one step of depth the one is kept whose centre is nearer by its radius (Eq. 14). Else it
        /// is the nearer along the ray, whose rim then covers the middle of the other.
        voronoi: bool,
    },
    /// 2+1: for what they hide, and again for what is seen.
    TwoPlusOne,
}

/// The input of a resolve.
#[derive(Clone, Copy)]
pub struct OpaqueInput<'a> {
    /// The discs of a view, all of them opaque.
    pub discs: &'a Discs,
    /// The values that they show.
    pub shown: Shown<'a>,
    /// The number of values of a disc; for light on pixels, the number of its layout.
    pub channels: u32,
    /// Whether objects are kept.
    pub objects: bool,
    /// How.
    pub passes: Passes<'a>,
    /// Most bytes to take beside the discs, which is about what the picture takes twice.
    pub max_bytes: u64,
}

/// Numbers of discs that are averaged.
#[derive(Clone, Copy)]
struct Averaged<'a> {
    discs: &'a Discs,
    values: &'a [f32],
    /// Whether these are by rank among the discs; else by place in the cloud.
    by_rank: bool,
    channels: u32,
    objects: bool,
    passes: Passes<'a>,
    max_bytes: u64,
}

/// The opaque surfaces of a view.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Opaque {
    /// Depth, which is infinite where no surface covers a pixel, values and objects; averages by weight.
    pub image: OpaqueImage,
    /// The nearest disc of each pixel, by its place in the cloud; `u32::MAX` without a disc.
    pub disc: Vec<u32>,
    /// Work that was done. Fragments are those of all passes over the discs.
    pub counts: RasterCounts,
}

/// Draws opaque discs. One tick a tile. Pixels without a disc stay empty.
///
/// ```
/// use deferred_blend::grouping::Groups;
/// use deferred_blend::{DiscInput, Discs, OpaqueInput, Params, Passes, Shown, resolve_opaque};
/// use splat_core::glam::{DVec3, Vec3};
/// use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat, SplatKind};
///
/// let mut cloud = Cloud::new(DVec3::ZERO);
/// for x in [0.0, 0.5625] {
///     let position = Vec3::new(x, 0.0, 0.0);
///     cloud.push(&Splat { position, normal: Vec3::Z, kind: SplatKind::Opaque, ..Splat::default() });
/// }
/// let view = Projection::Orthographic { height: 4.0 };
/// let camera = Camera::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, view, [64, 64])?;
/// let footprints = &FootprintStack::default();
/// let materials = &[Material::default()];
/// let params = &Params::default();
/// let discs = Discs::project(&DiscInput { cloud: &cloud, ids: &[0, 1], camera: &camera, footprints, materials }, params);
/// let passes = Passes::OnePlusOne { groups: &Groups::new(2, vec![0, 1])?, voronoi: true };
/// let values = &[0.2, 0.4];
/// let input = OpaqueInput { discs: &discs, shown: Shown::Discs(values), channels: 1, objects: false, passes, max_bytes: 1 << 30 };
/// let seen = resolve_opaque(&input, params, None)?;
/// let middle = 32 * 64 + 36;
/// assert!((seen.image.depth[middle] - 3.0).abs() < 1e-6 && (seen.image.channels[0][middle] - 0.3).abs() < 1e-6);
/// assert_eq!((seen.image.depth[0], seen.disc[0]), (f32::INFINITY, u32::MAX));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Parameter`], also for groups of fewer discs than the cloud has; [`Error::Limit`]; [`Error::Cancelled`].
///
/// # Panics
/// If numbers of a disc are missing, or the layout of light has other channels.
pub fn resolve_opaque(input: &OpaqueInput<'_>, params: &Params, progress: Option<&Progress>) -> Result<Opaque, Error> {
    let OpaqueInput { discs, shown, channels, objects, passes, max_bytes } = *input;
    match shown {
        Shown::Discs(values) => {
            let averaged = Averaged { discs, values, by_rank: false, channels, objects, passes, max_bytes };
            average(&averaged, params, progress)
        }
        Shown::Pixels(light) => lit::resolve(input, &light, params, progress),
    }
}

/// Eq. 1 of any numbers.
fn average(input: &Averaged<'_>, params: &Params, progress: Option<&Progress>) -> Result<Opaque, Error> {
    params.check()?;
    let discs = input.discs;
    let Some(last) = discs.ids.par_iter().max() else { return Ok(Opaque::default()) };
    let rows = if input.by_rank { discs.ids.len() } else { *last as usize + 1 };
    assert!(input.values.len() >= rows * input.channels as usize, "invariant: values of every disc");
    if let Passes::OnePlusOne { groups, .. } = input.passes
        && groups.by_disc().len() <= *last as usize
    {
        return Err(Error::parameter("number of discs in groups", groups.by_disc().len(), "that of the cloud"));
    }
    let bins = memory::bin(input)?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    progress.add_total(bins.tiles() as u64);
    let rules = Rules::new(input, params);
    let tiles: Vec<Option<Tile>> = (0..bins.tiles())
        .into_par_iter()
        .map_init(
            || Scratch::new(input),
            |scratch, t| {
                let is_drawn = progress.tick(1).is_ok() && !bins.is_empty(t);
                is_drawn.then(|| {
                    scratch.lists.fill(discs, &bins, t);
                    let mut tile = Tile::new(input.channels as usize);
                    let corner = bins.corner(t);
                    pulp::Arch::new().dispatch(ResolveTile { input, rules: &rules, corner, scratch, tile: &mut tile });
                    tile
                })
            },
        )
        .collect();
    progress.tick(0).map_err(|_| Error::Cancelled)?;
    Ok(picture::assemble(input, &tiles, &bins))
}

/// Scratch memory of a thread for a tile.
struct Scratch {
    lists: BlockLists,
    block: Block,
    images: GroupImages,
}

impl Scratch {
    fn new(input: &Averaged<'_>) -> Self {
        let block = Block::new(input.channels as usize);
        let images = GroupImages::new(group_count(input));
        Self { lists: BlockLists::default(), block, images }
    }

    /// Of one, without its lists.
    fn bytes(input: &Averaged<'_>) -> u64 {
        GroupImages::bytes(group_count(input)) + Block::bytes(input.channels as usize)
    }
}

fn group_count(input: &Averaged<'_>) -> usize {
    if let Passes::OnePlusOne { groups, .. } = input.passes { groups.count() as usize } else { 0 }
}

/// One tile's work, in the form that [`pulp`] compiles once per instruction set.
struct ResolveTile<'a> {
    input: &'a Averaged<'a>,
    rules: &'a Rules,
    corner: [usize; 2],
    scratch: &'a mut Scratch,
    tile: &'a mut Tile,
}

impl pulp::WithSimd for ResolveTile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { input, rules, corner, scratch, tile } = self;
        let Scratch { lists, block, images } = scratch;
        for b in 0..BLOCKS {
            let list = lists.block(b);
            if list.is_empty() {
                continue;
            }
            block.clear(b, corner);
            let passes = match input.passes {
                Passes::OnePlusOne { groups, .. } => {
                    groups::keep(simd, list, input.discs, groups, rules, &mut *block, images);
                    groups::composite(simd, input, images, block);
                    1
                }
                Passes::TwoPlusOne => {
                    visibility::hide(simd, list, input.discs, rules, block);
                    visibility::sum(simd, list, input, rules, block);
                    2
                }
            };
            tile.fragments += passes * (list.len() * PIXELS) as u64;
            block.normalize(simd, b, tile);
        }
    }
}
