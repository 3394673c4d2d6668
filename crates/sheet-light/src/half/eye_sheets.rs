//! The eye's sheets: a slab in a band of the eye's image, reconstructed, classified, lit (steps 10 to 19 of the pseudocode).

use super::band::Band;
use super::eye_buffer::{Fragments, Pixels};
use super::illuminate::Asked;
use super::light_depth::LightDepths;
use super::light_path::{Places, stored};
use super::lit_part::LitParts;
use super::pane_sheets::PaneSheets;
use super::placed::Placed;
use super::shade::{Lit, Through};
use super::sheet::{Sheet, Splatter, is_any};
use super::splats::SplatSheets;
use super::sweep::{Known, Sweep};
use crate::lines::Lines;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use std::ops::Range;

/// Sheets kept of a volume whose gradients are asked for: the present one and its neighbours.
const KEPT: u32 = 3;

/// Depths across the slabs between which all of a ray lies.
pub(crate) const WHOLE: [[f32; MAX_LANES]; 2] = [[f32::NEG_INFINITY; MAX_LANES], [f32::INFINITY; MAX_LANES]];

/// Slabs after which pixels that are done are looked for.
const CLOSING: u32 = 8;

/// A band of the eye's image.
#[derive(Debug, Clone)]
pub(crate) struct EyeBand {
    pub(crate) band: Band,
    /// By volume, the last slabs.
    pub(crate) sheets: Vec<Vec<Sheet>>,
    pub(crate) pixels: Pixels,
    /// Extinction of the pixels that are being lit, by volume.
    extinction: Vec<[f32; MAX_LANES]>,
    /// What all else lets through to them, by light.
    others: Vec<Through>,
}

/// What a band does with a slab.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// Reconstructs, lights and composites.
    Draw,
    /// Reconstructs, and adds to depths alone.
    Depths,
}

/// One band's work on one slab, in the form that [`pulp`] compiles once per instruction set.
pub(crate) struct OneSlab<'a> {
    pub(crate) of: &'a Sweep<'a>,
    pub(crate) layout: &'a ChannelLayout,
    /// Those of the slab.
    pub(crate) splats: Option<&'a SplatSheets<'a>>,
    /// Those of the slab.
    pub(crate) panes: Option<&'a PaneSheets<'a>>,
    /// Polygons in the way of the light.
    pub(crate) depths: Option<&'a LightDepths>,
    pub(crate) index: usize,
    pub(crate) slab: u32,
    pub(crate) step: Step,
    pub(crate) eye: &'a mut EyeBand,
    /// Depths across the slabs between which rays are being lit and composited: translucent polygons part them.
    pub(crate) part: [[f32; MAX_LANES]; 2],
}

/// Splats of neighbouring pixels: their sums, the place there, and how much of them lies in the part.
type Splatted<'a> = Option<(&'a Lines, [usize; 2], [f32; MAX_LANES])>;

/// Neighbouring pixels being lit.
pub(super) struct Chunk {
    /// In the image.
    pub(super) x: usize,
    pub(super) y: usize,
    /// In the planes of the band.
    pub(super) k: usize,
}

impl EyeBand {
    pub(crate) fn new(band: Band, volumes: &[Placed<'_>], pixels: Pixels) -> Self {
        let kept = |v: &Placed<'_>| if v.compares { KEPT } else { 1 };
        let sheets = volumes.iter().map(|v| (0..kept(v)).map(|_| Sheet::new(&band)).collect()).collect();
        Self { band, sheets, pixels, extinction: vec![[0.0; MAX_LANES]; volumes.len()], others: Vec::new() }
    }

    /// Bytes of all planes.
    pub(crate) fn bytes(&self) -> u64 {
        let sheets: u64 = self.sheets.iter().flatten().map(Sheet::bytes).sum();
        self.band.bytes() + sheets + self.pixels.bytes()
    }

    /// Ends the rays of pixels that are done.
    fn close(&mut self, cutoff: f32) {
        let Self { band, pixels, .. } = self;
        for y in 0..band.stored {
            for k in y * band.stride..y * band.stride + band.width {
                if pixels.is_done(k, cutoff) {
                    band.crossings.iter_mut().for_each(|[_, far]| far[k] = f32::NEG_INFINITY);
                }
            }
        }
        band.find_hits();
    }

    fn sheet(&self, volume: usize, slab: u32) -> &Sheet {
        let sheets = &self.sheets[volume];
        &sheets[slab as usize % sheets.len()]
    }
}

impl pulp::WithSimd for OneSlab<'_> {
    /// Footprint numbers.
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> u64 {
        let mut fragments = 0;
        // What gradients are taken from is wanted beside pixels that are done.
        let volumes = self.volumes();
        let may_close = self.of.params.transmittance_cutoff > 0.0 && !self.of.placed.iter().any(|v| v.compares);
        if may_close && !self.of.frame.back_to_front && self.slab.is_multiple_of(CLOSING) {
            self.eye.close(self.of.params.transmittance_cutoff);
        }
        for v in volumes.clone() {
            // Gradients need the sheet behind; the first one is made with it.
            let is_ahead = self.of.placed[v].compares && self.step == Step::Draw;
            if !is_ahead || self.slab == 0 {
                fragments += self.reconstruct(simd, v, self.slab);
            }
            if is_ahead && self.slab + 1 < self.of.frame.slabs.count {
                fragments += self.reconstruct(simd, v, self.slab + 1);
            }
        }
        let top = self.eye.band.top;
        let own = self.eye.band.rows.clone();
        for y in own.start - top..own.end - top {
            let spans = || volumes.clone().map(|v| &self.eye.sheet(v, self.slab).spans[y]);
            let splats = self.splats.and_then(|splats| splats.squares.span(top + y));
            let panes = self.panes.and_then(|panes| panes.span(top + y));
            let inside = || spans().filter(|span| !span.is_empty()).chain(&splats).chain(&panes);
            let (Some(first), Some(last)) = (inside().map(|s| s.start).min(), inside().map(|s| s.end).max()) else {
                continue;
            };
            let count = Lanes::<S>::COUNT;
            for x in (first / count * count..last).step_by(count) {
                let k = y * self.eye.band.stride + x;
                let chunk = Chunk { x, y: top + y, k };
                match self.panes.filter(|_| panes.as_ref().is_some_and(|span| span.start < x + count && x < span.end)) {
                    None => self.draw(simd, &chunk, [1.0; MAX_LANES]),
                    Some(panes) => self.draw_parted(simd, &chunk, panes),
                }
            }
        }
        fragments
    }
}

impl OneSlab<'_> {
    #[inline(always)]
    fn reconstruct<S: Simd>(&mut self, simd: S, v: usize, slab: u32) -> u64 {
        let Sweep { frame, placed, sight, shapes, buckets, .. } = self.of;
        let EyeBand { band, sheets, .. } = &mut *self.eye;
        let kept = sheets[v].len();
        let sheet = &mut sheets[v][slab as usize % kept];
        sheet.begin(simd, band, v, [frame.slabs.face(slab), frame.slabs.face(slab + 1)]);
        let splatter = Splatter { placed: &placed[v], sight, shape: &shapes[v], buckets: &buckets[v] };
        let fragments = sheet.splat(simd, &splatter, band, self.index, slab);
        sheet.finish(simd, band.stride);
        fragments
    }

    /// Volumes of the slab: none behind the last.
    fn volumes(&self) -> Range<usize> {
        0..if self.slab < self.of.frame.slabs.count { self.of.placed.len() } else { 0 }
    }

    /// Whether what comes lies before what was drawn.
    pub(super) fn prepends(&self) -> bool {
        self.of.frame.back_to_front && self.step == Step::Draw
    }

    /// Whether depths are summed now.
    pub(super) fn keeps_depths(&self) -> bool {
        !self.eye.pixels.depth.is_empty() && !self.prepends()
    }

    /// Lights and composites neighbouring pixels, with so much of their splats.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(&mut self, simd: S, chunk: &Chunk, of_splats: [f32; MAX_LANES]) {
        let (k, of) = (chunk.k, |v: f32| Lanes::splat(simd, v));
        let planes = self.eye.pixels.planes;
        let closed =
            of(1.0).where_less_or(self.eye.pixels.most(simd, k), of(self.of.params.transmittance_cutoff), of(0.0));
        let stretch = Lanes::load(simd, &self.eye.band.stretch[k..]);
        let mut all = [of(0.0); 3];
        let mut near = of(f32::INFINITY);
        let mut far = of(f32::NEG_INFINITY);
        let [lower, upper] = [0, 1].map(|end| Lanes::load(simd, &self.part[end]));
        for v in self.volumes() {
            let Some([extinction, length]) = self.extinction(simd, v, k) else {
                self.eye.extinction[v] = [0.0; MAX_LANES];
                continue;
            };
            let tau = of(0.0).where_less_or(of(0.5), closed, extinction * length * stretch);
            extinction.store(&mut self.eye.extinction[v]);
            for p in 0..planes {
                all[p] = tau.mul_add(of(self.of.volumes[v].material.extinction_rgb[p]), all[p]);
            }
            let sheet = self.eye.sheet(v, self.slab);
            let from = Lanes::load(simd, &sheet.near[k..]).max(lower);
            let to = Lanes::load(simd, &sheet.far[k..]).min(upper);
            near = near.min(from.where_less_or(of(0.0), tau, near));
            far = far.max(to.where_less_or(of(0.0), tau, far));
        }
        let most = all[0].max(all[1]).max(all[2]);
        let splats = self.splats.and_then(|splats| splats.squares.at([chunk.x, chunk.y], Lanes::<S>::COUNT));
        let splats = splats.map(|(lines, at)| (lines, at, of_splats));
        let is_medium = is_any(most);
        if !is_medium && splats.is_none() {
            return;
        }
        let mut fragments = Fragments::NONE;
        for p in 0..planes {
            all[p].store(&mut fragments.optical_depth[p]);
        }
        // Lanes without any are of no meaning, but are numbers.
        let near = near.where_less(of(0.0), most);
        let far = far.where_less(of(0.0), most);
        if is_medium && self.step == Step::Draw {
            self.light(simd, chunk, [near, far], most, &mut fragments);
        }
        self.composite(simd, chunk, [near, far], splats, &mut fragments);
    }

    /// Extinction of a volume, and the depth that it has; `None` where it has no sheet.
    #[inline(always)]
    fn extinction<S: Simd>(&self, simd: S, v: usize, k: usize) -> Option<[Lanes<S>; 2]> {
        let sheet = self.eye.sheet(v, self.slab);
        let stride = self.eye.band.stride;
        // No closure: what is vectorised must be inlined.
        if !sheet.spans[k / stride].contains(&(k % stride)) {
            return None;
        }
        let [extinction, ..] = sheet.classify(simd, &self.of.placed[v], k);
        Some([extinction, sheet.depth(simd, k, &self.part)])
    }

    /// Slab coordinates of rays at a depth.
    #[inline(always)]
    fn places<S: Simd>(&self, simd: S, k: usize, depth: Lanes<S>) -> Places<S> {
        let band = &self.eye.band;
        let mut out = [depth; 3];
        for a in 0..2 {
            let slope = Lanes::load(simd, &band.slope[a][k..]);
            out[a] = slope.mul_add(depth, Lanes::load(simd, &band.place[a][k..]));
        }
        out
    }

    /// Radiance of the pixels that have optical depth.
    #[inline(always)]
    fn light<S: Simd>(
        &mut self,
        simd: S,
        chunk: &Chunk,
        [near, far]: [Lanes<S>; 2],
        most: Lanes<S>,
        out: &mut Fragments,
    ) {
        let of = self.of;
        let mut wanted = [0.0; MAX_LANES];
        most.store(&mut wanted);
        let planes = self.eye.pixels.planes;
        let arrives = self.arrives(simd, chunk.k, [near, far], &wanted, out);
        let middle = (near + far) * Lanes::splat(simd, 0.5);
        let at = self.places(simd, chunk.k, middle);
        let places = stored(&at);
        let seen = self.of.scattered.is_some().then(|| {
            let [first, last] = if of.frame.back_to_front { [far, near] } else { [near, far] };
            let share = out.optical_depth[planes / 2].map(mean_depth);
            let depth = first + (last - first) * Lanes::load(simd, &share);
            stored(&self.places(simd, chunk.k, depth))
        });
        let stretch = Lanes::load(simd, &self.eye.band.stretch[chunk.k..]);
        let mut others = std::mem::take(&mut self.eye.others);
        let mut so_far = [[0.0; MAX_LANES]; 3];
        for (v, volume) in of.volumes.iter().enumerate() {
            let Some([extinction, depth]) = self.extinction(simd, v, chunk.k) else { continue };
            let mut tau = [0.0; MAX_LANES];
            (extinction * depth * stretch).store(&mut tau);
            let [_, red, green, blue] = self.eye.sheet(v, self.slab).classify(simd, &of.placed[v], chunk.k);
            let color = stored(&[red, green, blue]);
            let normals = self.normals(simd, v, chunk, (&at, &wanted));
            self.find_others(simd, v, &at, &wanted, &mut others);
            for lane in 0..Lanes::<S>::COUNT {
                if wanted[lane] > 0.0 && tau[lane] > 0.0 {
                    let share = [0, 1, 2].map(|p| {
                        let own = tau[lane] * volume.material.extinction_rgb[p];
                        so_far[p][lane] += own;
                        own / so_far[p][lane].max(f32::MIN_POSITIVE)
                    });
                    let at = DVec3::new(places[0][lane].into(), places[1][lane].into(), places[2][lane].into());
                    let lit = Lit {
                        volume,
                        radius: of.placed[v].reach as f32,
                        color: color.map(|c| c[lane]),
                        normal: normals[lane],
                        arrives: [0, 1, 2].map(|c| arrives[if planes == 3 { c } else { 0 }][lane]),
                        others: &others,
                        lane,
                    };
                    let seen = seen.as_ref().map(|seen| [0, 1, 2].map(|a| f64::from(seen[a][lane])).into());
                    self.mix(&lit, [chunk.x + lane, chunk.y], (at, seen), share, (lane, out));
                }
            }
        }
        self.eye.others = others;
    }

    /// Share of the light of the sweep that comes through volumes and splats to what rays have between two depths, by plane.
    #[inline(always)]
    fn arrives<S: Simd>(
        &self,
        simd: S,
        k: usize,
        [near, far]: [Lanes<S>; 2],
        wanted: &[f32; MAX_LANES],
        of: &Fragments,
    ) -> [[f32; MAX_LANES]; 3] {
        let Some(buffer) = &self.of.light_buffer else { return [[1.0; MAX_LANES]; 3] };
        let [nearer, farther] = if self.of.frame.back_to_front { [far, near] } else { [near, far] };
        let ends = [self.places(simd, k, nearer), self.places(simd, k, farther)];
        let extinction = &self.eye.extinction[..];
        let planes = self.eye.pixels.planes;
        let splats = self.splats.and_then(|splats| splats.light.as_ref());
        let light = self.of.illumination(buffer, self.slab, splats);
        let parts = self.depths.and_then(|depths| LitParts::new(simd, (depths, &self.of.frame), &ends, wanted));
        let Some(parts) = parts else {
            let asked = Asked { ends, extinction, optical_depth: &of.optical_depth, lit: &[] };
            return light.transmittance(simd, &asked, wanted, planes);
        };
        let mut through = [[0.0; MAX_LANES]; 3];
        for part in parts.parts() {
            let optical_depth = &part.optical_depth(&of.optical_depth);
            let asked = Asked { ends: part.ends(simd, &ends), extinction, optical_depth, lit: &parts.by_point };
            part.add(&of.optical_depth, &light.transmittance(simd, &asked, wanted, planes), &mut through);
        }
        through
    }

    /// What lets light through to a volume beside what the sweep carries it through.
    #[inline(always)]
    fn find_others<S: Simd>(
        &self,
        simd: S,
        v: usize,
        at: &Places<S>,
        wanted: &[f32; MAX_LANES],
        others: &mut Vec<Through>,
    ) {
        others.clear();
        let Known { voxels, shadows: Some(shadows), .. } = &self.of.known[v] else { return };
        let cells = shadows.neighbours.cells(simd, voxels, at, bits(wanted));
        for light in 0..self.of.light.iter().len() + self.of.mapped.len() {
            others.push(stored(&shadows.at(simd, &cells, light)));
        }
    }

    #[inline(always)]
    fn normals<S: Simd>(
        &self,
        simd: S,
        v: usize,
        chunk: &Chunk,
        (at, wanted): (&Places<S>, &[f32; MAX_LANES]),
    ) -> [Vec3; MAX_LANES] {
        let Known { voxels, gradients, .. } = &self.of.known[v];
        if let Some(gradients) = gradients {
            return self.of.gradients.world(&stored(&gradients.at(simd, voxels, at, bits(wanted))));
        }
        if !self.of.volumes[v].normals {
            return [Vec3::ZERO; MAX_LANES];
        }
        let slabs = [self.slab.max(1) - 1, self.slab, (self.slab + 1).min(self.of.frame.slabs.count - 1)];
        let sheets = slabs.map(|slab| self.eye.sheet(v, slab));
        self.of.gradients.normals(simd, sheets, self.eye.band.stride, chunk.k)
    }

    /// Mixes the radiance of one point of a volume, with its share of the optical depth so far, into a lane of the fragments; light that is scattered
    /// more than once is that of the place `seen`.
    fn mix(
        &self,
        lit: &Lit<'_>,
        pixel: [usize; 2],
        (at, seen): (DVec3, Option<DVec3>),
        share: [f32; 3],
        (lane, out): (usize, &mut Fragments),
    ) {
        let mut values = [0.0; MAX_CHANNELS];
        lit.radiance(self.of, pixel, at).write(lit.normal, self.layout, &mut values);
        if let (Some(first), Some(seen)) = (self.layout.multiple(), seen) {
            let scattered = lit.scattered(self.of, pixel, seen).unwrap_or([0.0; 3]);
            (0..3).for_each(|c| values[first + c] += scattered[c]);
        }
        let count = self.layout.count();
        let planes = self.eye.pixels.planes;
        for c in 0..count {
            let sum = &mut out.values[c][lane];
            *sum += (values[c] - *sum) * share[ChannelLayout::plane_of(c, count, planes)];
        }
        // That of the first volume with any.
        if share[planes / 2] >= 1.0 {
            out.object[lane] = lit.volume.object;
        }
    }

    /// Composites what volumes have between two depths across the slabs, with the splats there.
    #[inline(always)]
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        chunk: &Chunk,
        [near, far]: [Lanes<S>; 2],
        splats: Splatted<'_>,
        fragments: &mut Fragments,
    ) {
        let is_last_first = self.prepends();
        let keeps_depths = self.keeps_depths();
        let of = self.of;
        let eye = &mut *self.eye;
        let mut before = [0.0; MAX_LANES];
        eye.pixels.so_far(simd, chunk.k).store(&mut before);
        let mut share = [0.0; MAX_LANES];
        if let Some((lines, at, part)) = splats {
            let Fragments { optical_depth, values, object } = fragments;
            share = lines.blend(simd, at, true, (optical_depth, values, &part));
            for lane in (0..Lanes::<S>::COUNT).filter(|lane| share[*lane] > 0.5) {
                object[lane] = lines.object([at[0] + lane, at[1]]).unwrap_or(object[lane]);
            }
        }
        match is_last_first {
            true => eye.pixels.prepend(simd, chunk.k, fragments),
            false => eye.pixels.append(simd, chunk.k, fragments),
        }
        if !keeps_depths {
            return;
        }
        let mut ends = [[0.0; MAX_LANES]; 2];
        near.store(&mut ends[0]);
        far.store(&mut ends[1]);
        let green = eye.pixels.planes / 2;
        let mut splatted = [[0.0; MAX_LANES]; 3];
        if let Some((lines, at, _)) = splats {
            splatted = lines.depths(simd, at);
        }
        for lane in 0..Lanes::<S>::COUNT.min(eye.band.width.saturating_sub(chunk.x)) {
            let own = fragments.optical_depth[green][lane];
            if own > 0.0 {
                let ends = ends.map(|end| of.view_depth([chunk.x + lane, chunk.y], end[lane]));
                let [depth, half] = [f64::from(splatted[1][lane]), 0.5 * f64::from(splatted[2][lane])];
                let mix = |volumes: f64, own: f64| match share[lane] {
                    // What has no part is of no meaning.
                    0.0 => volumes,
                    1.0.. => own,
                    share => volumes + (own - volumes) * f64::from(share),
                };
                let ends = [mix(ends[0].min(ends[1]), depth - half), mix(ends[0].max(ends[1]), depth + half)];
                eye.pixels.add_depth(chunk.k + lane, ends, before[lane], own);
            }
        }
    }
}

/// Mean depth of what is seen of an optical depth, as a share of it from the eye on: 1/τ − 1/(e^τ − 1). Radiance that is linear along a ray has its
/// mean there.
pub(crate) fn mean_depth(optical_depth: f32) -> f32 {
    // The closed form loses its digits.
    if optical_depth < 0.01 {
        return 0.5 - optical_depth / 12.0;
    }
    optical_depth.recip() - libm::expm1f(optical_depth).recip()
}

/// Lanes above 0, a bit each.
fn bits(wanted: &[f32; MAX_LANES]) -> u32 {
    wanted.iter().rev().fold(0, |bits, lane| bits << 1 | u32::from(*lane > 0.0))
}
