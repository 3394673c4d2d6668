//! A tile of the accumulator, and layers that are composited into it.

use crate::BlendInput;
use crate::Params;
use crate::disc::Ray;
use crate::floored::Floor;
use crate::fragments::Fragment;
use crate::glass::{Bound, Glass, Passage, Path};
use crate::layer::{Layer, bound_matter, normal};
use crate::layers::{GapRule, mean_depth};
use splat_core::raster::GlassImage;
use splat_core::raster::lanes::exp_neg;
use splat_core::raster::tile::{AREA, for_each_span, position, tile_of};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, DepthFragment, DepthProfile};
use std::ops::Range;

/// Optical depth of a layer that lets nothing through: e^−87 is the least normal number.
const OPAQUE: f32 = 87.0;

/// Planes of `AREA` numbers.
pub(crate) struct Tile {
    corner: [usize; 2],
    optical_depth: Vec<Vec<f32>>,
    channels: Vec<Vec<f32>>,
    /// Empty when not asked for, as is the next.
    depth: Vec<DepthProfile>,
    object: Vec<u32>,
    /// Depth of what hides layers; empty without.
    opaque: Vec<f32>,
    /// As in [`GlassImage`]; empty without glass.
    mirrored: Vec<[f32; 3]>,
    behind: Vec<[f32; 3]>,
    pub(crate) fragments: u64,
    pub(crate) layers: u64,
}

impl Tile {
    pub(crate) fn load(from: &Accumulator, input: &BlendInput<'_>, corner: [usize; 2]) -> Self {
        let planes = |planes: &[Vec<f32>]| planes.iter().map(|p| tile_of(p, from.size, corner, 0.0)).collect();
        let glass = |value: [f32; 3]| if input.glass.is_some() { vec![value; AREA] } else { Vec::new() };
        Self {
            corner,
            optical_depth: planes(&from.optical_depth),
            channels: planes(&from.channels),
            depth: tile_of(&from.depth, from.size, corner, DepthProfile::default()),
            object: tile_of(&from.object, from.size, corner, u32::MAX),
            opaque: tile_of(input.opaque, from.size, corner, f32::INFINITY),
            mirrored: glass([0.0; 3]),
            behind: glass(GlassImage::STRAIGHT),
            fragments: 0,
            layers: 0,
        }
    }

    /// Composites the layers of a pixel, which are ranges of its fragments.
    pub(crate) fn pixel(
        &mut self,
        k: usize,
        fragments: &[Fragment],
        layers: &[Range<usize>],
        input: &BlendInput<'_>,
        params: &Params,
    ) {
        let limit = self.opaque.get(k).copied().unwrap_or(f32::INFINITY);
        let [x, y] = self.corner;
        let ray = input.discs.ray(position(k, x, y));
        let sizes = [self.optical_depth.len(), self.channels.len()];
        let mut way = input.glass.as_ref().map(|glass| (glass, Path::begin(ray.along, glass)));
        for layer in layers {
            let least = self.optical_depth.iter().map(|plane| plane[k]).fold(f32::INFINITY, f32::min);
            if exp_neg(least) < params.transmittance_cutoff {
                return;
            }
            let layer_fragments = &fragments[layer.clone()];
            let mut blended = Layer::from_fragments(layer_fragments, input, &ray, sizes);
            if blended.depth >= limit {
                break;
            }
            let mut passage = Passage::CLEAR;
            if let Some((glass, path)) = &mut way
                && let Some(material) = bound_matter(layer_fragments, input)
            {
                if path.leaves_out(glass) {
                    continue;
                }
                let [rank, of_object] = count(layer_fragments[0].object, layer.start, limit, fragments, layers);
                let place = ray.at(blended.depth);
                let distance = ray.length * blended.depth;
                let (normal, curvature) = normal(layer_fragments, input);
                let object = layer_fragments[0].object;
                let cone = ray.cone.after(distance);
                let layers = of_object;
                let bound = Bound { material, object, rank, layers, normal, curvature, cone, place, distance };
                path.cross(&bound, glass, &mut passage);
                blended.set_opacity(path.opacity(object, blended.opacity, glass.bending), sizes);
            }
            if input.range.contains(&blended.depth) {
                self.add(k, &blended, &passage, layer_fragments[0].object);
                self.layers += 1;
            }
        }
        if let Some((glass, path)) = way {
            self.end(k, glass, &path, limit, ray.length, &input.range);
        }
    }

    /// A pixel as the paper has it, of whose fragments those that are hidden or lie outside the range are left out.
    ///
    /// Light is mirrored and bent at the nearest layer that bounds matter (section 5.2.3). `layers` are the ranges of fragments that gaps tell
    /// apart: their number bends light by [`Bending::Power`], and between them matter absorbs.
    pub(crate) fn floored(
        &mut self,
        k: usize,
        fragments: &mut [Fragment],
        layers: &[Range<usize>],
        input: &BlendInput<'_>,
        floor: &Floor<'_>,
        rule: GapRule,
    ) {
        let limit = self.opaque.get(k).copied().unwrap_or(f32::INFINITY);
        let [x, y] = self.corner;
        let ray = input.discs.ray(position(k, x, y));
        let mut way = input.glass.as_ref().map(|glass| (glass, Path::begin(ray.along, glass)));
        // The ranges of layers hold for this order of the fragments alone.
        let crossed = match &mut way {
            Some((glass, path)) => cross_layers(path, glass, input, &ray, limit, fragments, layers),
            None => Crossed::default(),
        };
        fragments.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let mut seen: Vec<Fragment> = fragments.iter().filter(|f| f.depth < limit).copied().collect();
        let bounds = |f: &Fragment| bound_matter(std::slice::from_ref(f), input).is_some();
        let first = way.as_ref().and_then(|_| seen.iter().position(bounds));
        let mut segment = |fragments: &[Fragment], crossing: Option<&Crossing>| {
            self.floored_segment(k, fragments, crossing, input, &ray, floor, rule);
        };
        match first {
            None => segment(&seen, None),
            Some(first) => {
                let is_behind = |f: &Fragment| !rule.joins(input.discs, &seen[first], f);
                let after = seen[first..].iter().position(is_behind).map_or(seen.len(), |n| first + n);
                let mut rest = seen.split_off(after);
                if way.as_ref().is_some_and(|(glass, path)| path.leaves_out(glass)) {
                    // The bent ray meets them where they lie there.
                    rest.retain(|f| !bounds(f));
                }
                segment(&seen[..first], None);
                segment(&seen[first..], crossed.nearest.as_ref());
                segment(&rest, crossed.others.as_ref());
            }
        }
        if let Some((glass, path)) = way {
            self.end(k, glass, &path, limit, ray.length, &input.range);
        }
    }

    /// Adds the fragments in the range, which lie near to far, as one layer behind all so far; `crossing` says what its surface does to light.
    fn floored_segment(
        &mut self,
        k: usize,
        fragments: &[Fragment],
        crossing: Option<&Crossing>,
        input: &BlendInput<'_>,
        ray: &Ray,
        floor: &Floor<'_>,
        rule: GapRule,
    ) {
        let sizes = [self.optical_depth.len(), self.channels.len()];
        let inside: Vec<Fragment> = fragments.iter().filter(|f| input.range.contains(&f.depth)).copied().collect();
        // A surface is crossed in one range of depths alone.
        let crossing = crossing.filter(|crossing| input.range.contains(&crossing.depth));
        let (depth, object) = match (inside.first(), crossing) {
            (Some(nearest), _) => (nearest.depth, nearest.object),
            (None, Some(crossing)) => (crossing.depth, u32::MAX),
            (None, None) => return,
        };
        let blended = floor.blend(&inside, input, rule, ray, sizes);
        let opacity = blended.through.map(|t| (1.0 - t).clamp(0.0, 1.0));
        let layer = Layer { depth, opacity, values: blended.values };
        self.add(k, &layer, crossing.map_or(&Passage::CLEAR, |crossing| &crossing.passage), object);
        self.layers += 1;
    }

    /// What a ray sees that has come through all layers: matter before an opaque surface absorbs, and where the ray was bent
    /// something else is seen.
    fn end(&mut self, k: usize, glass: &Glass<'_>, path: &Path<'_>, limit: f32, ray: f32, range: &Range<f32>) {
        if limit.is_finite() && range.contains(&limit) {
            let depth = path.absorbed_before(limit * ray, glass);
            let planes = self.optical_depth.len();
            for (p, plane) in self.optical_depth.iter_mut().enumerate() {
                plane[k] += depth[channel_of(p, planes)];
            }
        }
        if range.end == f32::INFINITY {
            self.behind[k] = path.behind(glass, limit.is_finite()).unwrap_or(GlassImage::STRAIGHT);
        }
    }

    /// A layer behind all so far.
    fn add(&mut self, k: usize, layer: &Layer, passage: &Passage, object: u32) {
        let count = self.channels.len();
        let planes = self.optical_depth.len();
        let before = self.optical_depth[planes / 2][k];
        for (p, plane) in self.optical_depth.iter_mut().enumerate() {
            plane[k] += passage.inside[channel_of(p, planes)];
        }
        let through: [f32; 3] = std::array::from_fn(|p| self.optical_depth.get(p).map_or(0.0, |a| exp_neg(a[k])));
        if let Some(mirrored) = self.mirrored.get_mut(k) {
            for (c, sum) in mirrored.iter_mut().enumerate() {
                *sum += through[if planes == 3 { c } else { 0 }] * passage.mirrored[c];
            }
        }
        let enters: [f32; 3] = std::array::from_fn(|p| through[p] * (1.0 - passage.reflectance[channel_of(p, planes)]));
        for (c, plane) in self.channels.iter_mut().enumerate() {
            plane[k] += enters[ChannelLayout::plane_of(c, count, planes)] * layer.values[c];
        }
        for (p, plane) in self.optical_depth.iter_mut().enumerate() {
            let optical_depth = |share: f32| (-libm::log1pf(-share)).min(OPAQUE);
            plane[k] += optical_depth(layer.opacity[p]) + optical_depth(passage.reflectance[channel_of(p, planes)]);
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

    pub(crate) fn store(self, to: &mut Accumulator, glass: Option<&mut GlassImage>) {
        let [x, y] = self.corner;
        let planes = to.optical_depth.iter_mut().chain(&mut to.channels);
        for (plane, values) in planes.zip(self.optical_depth.iter().chain(&self.channels)) {
            for_each_span(to.size, x, y, |tile, image| plane[image].copy_from_slice(&values[tile]));
        }
        if !self.depth.is_empty() {
            for_each_span(to.size, x, y, |tile, image| to.depth[image].copy_from_slice(&self.depth[tile]));
        }
        if !self.object.is_empty() {
            for_each_span(to.size, x, y, |tile, image| to.object[image].copy_from_slice(&self.object[tile]));
        }
        if let Some(glass) = glass {
            for_each_span(to.size, x, y, |tile, image| {
                glass.mirrored[image.clone()].copy_from_slice(&self.mirrored[tile.clone()]);
                glass.behind[image].copy_from_slice(&self.behind[tile]);
            });
        }
    }
}

/// A surface that bounds matter, as a ray crosses it.
struct Crossing {
    depth: f32,
    passage: Passage,
}

/// The surfaces of a pixel that bound matter: the nearest, and all others together.
#[derive(Default)]
struct Crossed {
    nearest: Option<Crossing>,
    others: Option<Crossing>,
}

/// Goes through the layers that bound matter, up to an opaque surface or to where the ray is bent for good.
fn cross_layers<'m>(
    path: &mut Path<'m>,
    glass: &Glass<'m>,
    input: &BlendInput<'m>,
    ray: &Ray,
    limit: f32,
    fragments: &[Fragment],
    layers: &[Range<usize>],
) -> Crossed {
    let mut crossed = Crossed::default();
    for layer in layers {
        let of_layer = &fragments[layer.clone()];
        let depth = mean_depth(of_layer);
        let object = of_layer[0].object;
        if depth >= limit || path.leaves_out(glass) {
            break;
        }
        let Some(material) = bound_matter(of_layer, input) else { continue };
        let [rank, layers] = count(object, layer.start, limit, fragments, layers);
        let (normal, curvature) = normal(of_layer, input);
        let distance = ray.length * depth;
        let cone = ray.cone.after(distance);
        let bound = Bound { material, object, rank, layers, normal, curvature, cone, place: ray.at(depth), distance };
        let mut passage = Passage::CLEAR;
        path.cross(&bound, glass, &mut passage);
        match (&crossed.nearest, &mut crossed.others) {
            (None, _) => crossed.nearest = Some(Crossing { depth, passage }),
            (Some(_), None) => crossed.others = Some(Crossing { depth, passage }),
            (Some(_), Some(others)) => others.passage = others.passage.before(&passage),
        }
    }
    crossed
}

/// How many layers of an object lie before the one that starts at a fragment, and how many before an opaque surface.
fn count(object: u32, start: usize, limit: f32, fragments: &[Fragment], layers: &[Range<usize>]) -> [u32; 2] {
    let of_object = layers.iter().filter(|l| fragments[l.start].object == object);
    let rank = of_object.clone().take_while(|l| l.start != start).count() as u32;
    let before_surface = of_object.take_while(|l| mean_depth(&fragments[(*l).clone()]) < limit).count() as u32;
    [rank, before_surface]
}

/// The channel that stands for a plane of optical depth.
const fn channel_of(plane: usize, planes: usize) -> usize {
    if planes == 3 { plane } else { 1 }
}
