//! Transparent surfaces: in each pixel the discs of a layer are averaged by their weights (Eq. 1), and layers are composited by their
//! opacities, near to far, without a limit to their number.

use crate::disc::Discs;
use crate::fragments::{BlockLists, Fragment, WalkTile};
use crate::layers::{GapRule, mean_depth};
use crate::{Error, Params};
use rayon::prelude::*;
use splat_core::raster::bins::bin_rectangles;
use splat_core::raster::lanes::exp_neg;
use splat_core::raster::pulp;
use splat_core::raster::tile::{for_each_span, position, tile_of};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use splat_core::{Accumulator, DepthFragment, DepthProfile, Progress};
use std::ops::Range;

/// Optical depth of a layer that lets nothing through: e^−87 is the least normal number.
const OPAQUE: f32 = 87.0;

/// What is blended.
#[derive(Debug, Clone)]
pub struct BlendInput<'a> {
    /// The discs of a view.
    pub discs: &'a Discs,
    /// As many numbers a splat as the accumulator has channels, by place in the cloud.
    pub values: &'a [f32],
    /// View depth of what hides layers, by pixel; empty where nothing does.
    pub opaque: &'a [f32],
    /// View depths of the layers that are composited; the others are left out.
    pub range: Range<f32>,
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
/// If sizes of the image, the accumulator, `opaque` and `values` disagree.
pub fn blend(
    input: &BlendInput<'_>,
    params: &Params,
    accumulator: &mut Accumulator,
    progress: Option<&Progress>,
) -> Result<BlendCounts, Error> {
    params.check()?;
    let quiet = Progress::new();
    let (progress, discs) = (progress.unwrap_or(&quiet), input.discs);
    assert_eq!(discs.size, accumulator.size, "invariant: one image size");
    let ranks: Vec<u32> = (0..discs.discs.len() as u32).collect();
    let bins = bin_rectangles(discs.size, &ranks, |i| discs.discs[i as usize].pixels);
    progress.add_total(bins.tiles() as u64);
    let rule = GapRule::new(params);
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
                tile.pixel(k, layers.iter().map(|layer| &fragments[layer.clone()]), input, params);
            };
            let fragments = pulp::Arch::new().dispatch(WalkTile { discs, lists, corner, visit });
            tile.fragments = fragments;
            tile
        })
        .collect();
    progress.tick(0).map_err(|_| Error::Cancelled)?;
    let mut counts =
        BlendCounts { discs: bins.splats(), bytes: discs.bytes() + bins.bytes(), ..BlendCounts::default() };
    for tile in done {
        counts.fragments += tile.fragments;
        counts.layers += tile.layers;
        tile.store(accumulator);
    }
    Ok(counts)
}

/// A tile of the accumulator.
struct Tile {
    corner: [usize; 2],
    /// Planes of `AREA` numbers: optical depths, then channels.
    optical_depth: Vec<Vec<f32>>,
    channels: Vec<Vec<f32>>,
    /// Empty when not asked for, as is the next.
    depth: Vec<DepthProfile>,
    object: Vec<u32>,
    /// Depth of what hides layers; empty without.
    opaque: Vec<f32>,
    fragments: u64,
    layers: u64,
}

impl Tile {
    fn load(from: &Accumulator, input: &BlendInput<'_>, corner: [usize; 2]) -> Self {
        let planes = |planes: &[Vec<f32>]| planes.iter().map(|p| tile_of(p, from.size, corner, 0.0)).collect();
        Self {
            corner,
            optical_depth: planes(&from.optical_depth),
            channels: planes(&from.channels),
            depth: tile_of(&from.depth, from.size, corner, DepthProfile::default()),
            object: tile_of(&from.object, from.size, corner, u32::MAX),
            opaque: tile_of(input.opaque, from.size, corner, f32::INFINITY),
            fragments: 0,
            layers: 0,
        }
    }

    fn pixel<'f>(
        &mut self,
        k: usize,
        layers: impl Iterator<Item = &'f [Fragment]>,
        input: &BlendInput<'_>,
        params: &Params,
    ) {
        let limit = self.opaque.get(k).copied().unwrap_or(f32::INFINITY);
        let [x, y] = self.corner;
        let ray = input.discs.ray_length(position(k, x, y));
        for layer in layers {
            let planes = self.optical_depth.len();
            let least = self.optical_depth.iter().map(|plane| plane[k]).fold(f32::INFINITY, f32::min);
            if exp_neg(least) < params.transmittance_cutoff {
                return;
            }
            let blended = Layer::of(layer, input, ray, [planes, self.channels.len()]);
            if blended.depth >= limit {
                return;
            }
            if input.range.contains(&blended.depth) {
                self.add(k, &blended, layer[0].object);
                self.layers += 1;
            }
        }
    }

    /// A layer behind all so far.
    fn add(&mut self, k: usize, layer: &Layer, object: u32) {
        let (count, planes) = (self.channels.len(), self.optical_depth.len());
        let through: [f32; 3] = std::array::from_fn(|p| self.optical_depth.get(p).map_or(0.0, |a| exp_neg(a[k])));
        for (c, plane) in self.channels.iter_mut().enumerate() {
            plane[k] += through[ChannelLayout::plane_of(c, count, planes)] * layer.values[c];
        }
        let before = self.optical_depth[planes / 2][k];
        for (plane, opacity) in self.optical_depth.iter_mut().zip(layer.opacity) {
            plane[k] += (-libm::log1pf(-opacity)).min(OPAQUE);
        }
        let after = self.optical_depth[planes / 2][k];
        if after <= before {
            return;
        }
        if let Some(profile) = self.depth.get_mut(k) {
            profile.add(&DepthFragment { depth: layer.depth, thickness: 0.0, narrow: 1.0, before, after });
        }
        if let Some(first) = self.object.get_mut(k).filter(|first| **first == u32::MAX) {
            *first = object;
        }
    }

    fn store(self, to: &mut Accumulator) {
        let [x, y] = self.corner;
        let planes = to.optical_depth.iter_mut().chain(&mut to.channels);
        for (plane, own) in planes.zip(self.optical_depth.iter().chain(&self.channels)) {
            for_each_span(to.size, x, y, |tile, image| plane[image].copy_from_slice(&own[tile]));
        }
        if !self.depth.is_empty() {
            for_each_span(to.size, x, y, |tile, image| to.depth[image].copy_from_slice(&self.depth[tile]));
        }
        if !self.object.is_empty() {
            for_each_span(to.size, x, y, |tile, image| to.object[image].copy_from_slice(&self.object[tile]));
        }
    }
}

/// One layer of a pixel, its discs averaged.
#[derive(Debug, Clone, Copy)]
struct Layer {
    depth: f32,
    opacity: [f32; 3],
    /// Averages by weight and opacity, times opacity.
    values: [f32; MAX_CHANNELS],
}

impl Layer {
    /// Eq. 1 for depth and opacity, and for values, whose weights are w times the opacity. All are averaged as differences from the
    /// nearest disc's, so what is constant stays so to the last bit.
    fn of(fragments: &[Fragment], input: &BlendInput<'_>, ray: f32, [planes, channels]: [usize; 2]) -> Self {
        let optics = |f: &Fragment, p: usize| input.discs.looks[f.disc as usize].opacity(p, f.facing / ray);
        let values = |f: &Fragment| &input.values[input.discs.ids[f.disc as usize] as usize * channels..][..channels];
        let (first, mut weights, mut shares) = (&fragments[0], 0.0, [0.0; 3]);
        let mut layer = Self { depth: mean_depth(fragments), opacity: [0.0; 3], values: [0.0; MAX_CHANNELS] };
        let own: [f32; 3] = std::array::from_fn(|p| if p < planes { optics(first, p) } else { 0.0 });
        for fragment in fragments {
            let weight = fragment.weight;
            weights += weight;
            let mut share = [0.0; 3];
            for p in 0..planes {
                let opacity = optics(fragment, p);
                share[p] = weight * opacity;
                shares[p] += share[p];
                layer.opacity[p] += weight * (opacity - own[p]);
            }
            for (c, (value, from)) in values(fragment).iter().zip(values(first)).enumerate() {
                layer.values[c] += share[ChannelLayout::plane_of(c, channels, planes)] * (value - from);
            }
        }
        for p in 0..planes {
            layer.opacity[p] = (layer.opacity[p] / weights + own[p]).clamp(0.0, 1.0);
        }
        for (c, from) in values(first).iter().enumerate() {
            let p = ChannelLayout::plane_of(c, channels, planes);
            let mean = if shares[p] > 0.0 { layer.values[c] / shares[p] + from } else { 0.0 };
            layer.values[c] = layer.opacity[p] * mean;
        }
        layer
    }
}
