//! The eye's sheets: a slab in a band of the eye's image, reconstructed, classified, lit (steps 10 to 19 of the pseudocode).

use super::buffer::{Fragments, Pixels};
use super::gradient::SheetsAround;
use super::shade::{Lit, Through};
use crate::half_vector::geometry::{Geometry, Values, VolumeVoxels};
use crate::half_vector::light::illuminate::Asked;
use crate::half_vector::light::path::{Places, RayEnds, stored};
use crate::half_vector::lighting::Lighting;
use crate::half_vector::polygons::light_depth::LightDepths;
use crate::half_vector::polygons::lit_part::LitParts;
use crate::half_vector::polygons::panes::PaneSheets;
use crate::half_vector::slicing::band::Band;
use crate::half_vector::slicing::placed::Placed;
use crate::half_vector::slicing::sheet::{Sheet, Splatter, is_any};
use crate::half_vector::slicing::slab_place::SlabPlace;
use crate::half_vector::splats::sheets::SplatSheets;
use crate::half_vector::splats::squares::SquarePixel;
use crate::shared::depths::DepthSpans;
use crate::shared::lines::{Backdrop, PixelDepths};
use crate::shared::pixel::Pixel;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use std::ops::Range;

/// Sheets kept of a volume whose gradients are asked for: the present one and its neighbours.
const KEPT: u32 = 3;

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
    /// All else of the same.
    classified: Vec<Classified>,
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

/// What all bands do with a slab.
#[derive(Clone, Copy)]
pub(crate) struct SlabWork<'a> {
    pub(crate) geometry: &'a Geometry<'a>,
    pub(crate) lighting: &'a Lighting<'a>,
    pub(crate) layout: &'a ChannelLayout,
    /// Those of the slab.
    pub(crate) splats: Option<&'a SplatSheets<'a>>,
    /// Those of the slab.
    pub(crate) panes: Option<&'a PaneSheets<'a>>,
    /// Polygons in the way of the light.
    pub(crate) depths: Option<&'a LightDepths>,
    pub(crate) place: SlabPlace,
    pub(crate) step: Step,
}

/// One band's work on one slab, in the form that [`pulp`] compiles once per instruction set.
pub(crate) struct OneSlab<'a> {
    pub(crate) work: SlabWork<'a>,
    /// Of the band.
    pub(crate) index: usize,
    pub(crate) eye: &'a mut EyeBand,
    /// Depths across the slabs between which rays are being lit and composited: translucent polygons part them.
    pub(crate) part: DepthSpans,
}

/// A volume in neighbouring pixels of a slab.
#[derive(Debug, Clone, Copy)]
struct Classified {
    /// Whether it has a sheet there.
    is_shown: bool,
    /// The depth that it has across the slab.
    depth: [f32; MAX_LANES],
    color: [[f32; MAX_LANES]; 3],
}

impl Classified {
    const NOTHING: Self = Self { is_shown: false, depth: [0.0; MAX_LANES], color: [[0.0; MAX_LANES]; 3] };
}

/// Splats of neighbouring pixels.
struct Splatted<'a> {
    /// The first of the pixels.
    found: SquarePixel<'a>,
    /// How much of them lies in the part.
    share: [f32; MAX_LANES],
}

/// Depths across the slabs between which volumes have something in neighbouring pixels.
#[derive(Clone, Copy)]
struct MediumDepths<S: Simd> {
    near: Lanes<S>,
    far: Lanes<S>,
}

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
        let extinction = vec![[0.0; MAX_LANES]; volumes.len()];
        let classified = vec![Classified::NOTHING; volumes.len()];
        Self { band, sheets, pixels, extinction, classified, others: Vec::new() }
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
        let SlabWork { geometry, splats, panes, step, .. } = self.work;
        let slab = self.slab();
        // What gradients are taken from is needed beside pixels that are done.
        let volumes = self.volumes();
        let cutoff = geometry.params.transmittance_cutoff;
        let may_close = cutoff > 0.0 && !geometry.placed.iter().any(|v| v.compares);
        if may_close && !geometry.frame.back_to_front && slab.is_multiple_of(CLOSING) {
            self.eye.close(cutoff);
        }
        for v in volumes.clone() {
            // Gradients need the sheet behind; the first one is made with it.
            let is_ahead = geometry.placed[v].compares && step == Step::Draw;
            if !is_ahead || slab == 0 {
                fragments += self.reconstruct(simd, v, slab);
            }
            if is_ahead && slab + 1 < geometry.frame.slabs.count {
                fragments += self.reconstruct(simd, v, slab + 1);
            }
        }
        let top = self.eye.band.top;
        let rows = self.eye.band.rows.clone();
        for y in rows.start - top..rows.end - top {
            let spans = || volumes.clone().map(|v| &self.eye.sheet(v, slab).shown[y]);
            let of_splats = splats.and_then(|splats| splats.squares.span(top + y));
            let of_panes = panes.and_then(|panes| panes.span(top + y));
            let inside = || spans().filter(|span| !span.is_empty()).chain(&of_splats).chain(&of_panes);
            let (Some(first), Some(last)) = (inside().map(|s| s.start).min(), inside().map(|s| s.end).max()) else {
                continue;
            };
            let count = Lanes::<S>::COUNT;
            for x in (first / count * count..last).step_by(count) {
                let k = y * self.eye.band.stride + x;
                let chunk = Chunk { x, y: top + y, k };
                match panes.filter(|_| of_panes.as_ref().is_some_and(|span| span.start < x + count && x < span.end)) {
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
        let Geometry { frame, placed, sight, shapes, voxels, .. } = self.work.geometry;
        let EyeBand { band, sheets, .. } = &mut *self.eye;
        let kept = sheets[v].len();
        let sheet = &mut sheets[v][slab as usize % kept];
        let faces = frame.slabs.faces(slab);
        sheet.begin(simd, band, v, faces);
        let buckets = match &voxels[v].values {
            Values::Gathered(volume) => return sheet.gather(simd, volume, band, faces),
            Values::Splatted(buckets) => buckets,
        };
        let splatter = Splatter { placed: &placed[v], sight, shape: &shapes[v], buckets };
        let fragments = sheet.splat(simd, &splatter, band, self.index, slab);
        sheet.finish(simd, band.stride);
        fragments
    }

    /// The number of the slab.
    fn slab(&self) -> u32 {
        self.work.place.index(&self.work.geometry.frame.slabs)
    }

    /// Volumes of the slab: none behind the last.
    fn volumes(&self) -> Range<usize> {
        match self.work.place {
            SlabPlace::Slab(_) => 0..self.work.geometry.placed.len(),
            SlabPlace::Behind => 0..0,
        }
    }

    /// Whether what comes lies before what was drawn.
    pub(super) fn prepends(&self) -> bool {
        self.work.geometry.frame.back_to_front && self.work.step == Step::Draw
    }

    /// Whether depths are summed now.
    pub(super) fn keeps_depths(&self) -> bool {
        !self.eye.pixels.depth.is_empty() && !self.prepends()
    }

    /// Lights and composites neighbouring pixels, with so much of their splats.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(&mut self, simd: S, chunk: &Chunk, share: [f32; MAX_LANES]) {
        let k = chunk.k;
        let SlabWork { geometry, splats, step, .. } = self.work;
        let slab = self.slab();
        let planes = self.eye.pixels.planes;
        let closed = simd.lanes(1.0).where_less_or(
            self.eye.pixels.most(simd, k),
            simd.lanes(geometry.params.transmittance_cutoff),
            simd.lanes(0.0),
        );
        let stretch = Lanes::load(simd, &self.eye.band.stretch[k..]);
        let mut optical_depth = [simd.lanes(0.0); 3];
        let mut near = simd.lanes(f32::INFINITY);
        let mut far = simd.lanes(f32::NEG_INFINITY);
        let lower = Lanes::load(simd, &self.part.from);
        let upper = Lanes::load(simd, &self.part.to);
        for v in self.volumes() {
            let Some(extinction) = self.classify(simd, v, k) else {
                continue;
            };
            let length = Lanes::load(simd, &self.eye.classified[v].depth);
            let tau = simd.lanes(0.0).where_less_or(simd.lanes(0.5), closed, extinction * length * stretch);
            for p in 0..planes {
                optical_depth[p] =
                    tau.mul_add(simd.lanes(geometry.volumes[v].material.extinction_rgb[p]), optical_depth[p]);
            }
            let sheet = self.eye.sheet(v, slab);
            let from = Lanes::load(simd, &sheet.near[k..]).max(lower);
            let to = Lanes::load(simd, &sheet.far[k..]).min(upper);
            near = near.min(from.where_less_or(simd.lanes(0.0), tau, near));
            far = far.max(to.where_less_or(simd.lanes(0.0), tau, far));
        }
        let most = optical_depth[0].max(optical_depth[1]).max(optical_depth[2]);
        let first = Pixel { x: chunk.x, y: chunk.y };
        let splats = splats.and_then(|splats| splats.squares.find(first, Lanes::<S>::COUNT));
        let splats = splats.map(|found| Splatted { found, share });
        let is_medium = is_any(most);
        if !is_medium && splats.is_none() {
            return;
        }
        let mut fragments = Fragments::NONE;
        for p in 0..planes {
            optical_depth[p].store(&mut fragments.optical_depth[p]);
        }
        // Lanes without any optical depth have no meaning, but are numbers.
        let medium =
            MediumDepths { near: near.where_less(simd.lanes(0.0), most), far: far.where_less(simd.lanes(0.0), most) };
        if is_medium && step == Step::Draw {
            self.light(simd, chunk, medium, most, &mut fragments);
        }
        self.composite(simd, chunk, medium, splats, &mut fragments);
    }

    /// Classifies a volume in neighbouring pixels, and returns its extinction; `None` where it has no sheet.
    #[inline(always)]
    fn classify<S: Simd>(&mut self, simd: S, v: usize, k: usize) -> Option<Lanes<S>> {
        let sheet = self.eye.sheet(v, self.slab());
        let stride = self.eye.band.stride;
        // No closure: what is vectorised must be inlined.
        if !sheet.shown[k / stride].contains(&(k % stride)) {
            self.eye.extinction[v] = [0.0; MAX_LANES];
            self.eye.classified[v] = Classified::NOTHING;
            return None;
        }
        let [extinction, red, green, blue] = sheet.classify(simd, &self.work.geometry.placed[v], k);
        let depth = sheet.depth(simd, k, &self.part);
        extinction.store(&mut self.eye.extinction[v]);
        let classified = &mut self.eye.classified[v];
        classified.is_shown = true;
        depth.store(&mut classified.depth);
        red.store(&mut classified.color[0]);
        green.store(&mut classified.color[1]);
        blue.store(&mut classified.color[2]);
        Some(extinction)
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
    fn light<S: Simd>(&mut self, simd: S, chunk: &Chunk, medium: MediumDepths<S>, most: Lanes<S>, out: &mut Fragments) {
        let SlabWork { geometry, lighting, .. } = self.work;
        let MediumDepths { near, far } = medium;
        let mut is_wanted = [0.0; MAX_LANES];
        most.store(&mut is_wanted);
        let planes = self.eye.pixels.planes;
        let arrives = self.arrives(simd, chunk.k, medium, &is_wanted, out);
        let middle = (near + far) * simd.lanes(0.5);
        let middles = self.places(simd, chunk.k, middle);
        let places = stored(&middles);
        let mut seen = None;
        if lighting.scattered.is_some() {
            let [first, last] = if geometry.frame.back_to_front { [far, near] } else { [near, far] };
            let share = out.optical_depth[planes / 2].map(mean_depth);
            let depth = first + (last - first) * Lanes::load(simd, &share);
            seen = Some(stored(&self.places(simd, chunk.k, depth)));
        }
        let stretch = Lanes::load(simd, &self.eye.band.stretch[chunk.k..]);
        let mut others = std::mem::take(&mut self.eye.others);
        let mut so_far = [[0.0; MAX_LANES]; 3];
        for (v, volume) in geometry.volumes.iter().enumerate() {
            let Classified { is_shown, depth, color } = self.eye.classified[v];
            if !is_shown {
                continue;
            }
            let extinction = Lanes::load(simd, &self.eye.extinction[v]);
            let mut tau = [0.0; MAX_LANES];
            (extinction * Lanes::load(simd, &depth) * stretch).store(&mut tau);
            let normals = self.normals(simd, v, chunk, &middles, &is_wanted);
            self.find_others(simd, v, &middles, &is_wanted, &mut others);
            for lane in 0..Lanes::<S>::COUNT {
                if is_wanted[lane] > 0.0 && tau[lane] > 0.0 {
                    let share = [0, 1, 2].map(|p| {
                        let optical_depth = tau[lane] * volume.material.extinction_rgb[p];
                        so_far[p][lane] += optical_depth;
                        optical_depth / so_far[p][lane].max(f32::MIN_POSITIVE)
                    });
                    let middles = DVec3::new(places[0][lane].into(), places[1][lane].into(), places[2][lane].into());
                    let lit = Lit {
                        volume,
                        radius: geometry.placed[v].reach as f32,
                        color: color.map(|c| c[lane]),
                        normal: normals[lane],
                        arrives: [0, 1, 2].map(|c| arrives[if planes == 3 { c } else { 0 }][lane]),
                        others: &others,
                        lane,
                    };
                    let seen = seen.as_ref().map(|seen| [0, 1, 2].map(|a| f64::from(seen[a][lane])).into());
                    let pixel = Pixel { x: chunk.x + lane, y: chunk.y };
                    self.mix(&lit, pixel, middles, seen, share, out);
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
        medium: MediumDepths<S>,
        is_wanted: &[f32; MAX_LANES],
        fragments: &Fragments,
    ) -> [[f32; MAX_LANES]; 3] {
        let SlabWork { geometry, lighting, splats, depths, place, .. } = self.work;
        let splats = splats.and_then(|splats| splats.light.as_ref());
        let Some(light) = lighting.illumination(geometry, place, splats) else {
            return [[1.0; MAX_LANES]; 3];
        };
        let MediumDepths { near, far } = medium;
        let [nearer, farther] = if geometry.frame.back_to_front { [far, near] } else { [near, far] };
        let ends = RayEnds { nearer: self.places(simd, k, nearer), farther: self.places(simd, k, farther) };
        let extinction = &self.eye.extinction[..];
        let planes = self.eye.pixels.planes;
        let parts = depths.and_then(|depths| LitParts::new(simd, depths, &geometry.frame, &ends, is_wanted));
        let Some(parts) = parts else {
            let asked = Asked { ends, extinction, optical_depth: &fragments.optical_depth, lit: &[] };
            return light.transmittance(simd, &asked, is_wanted, planes);
        };
        let mut through = [[0.0; MAX_LANES]; 3];
        for part in parts.parts() {
            let optical_depth = &part.optical_depth(&fragments.optical_depth, planes);
            let asked = Asked { ends: part.ends(simd, &ends), extinction, optical_depth, lit: &parts.by_point };
            let of_part = light.transmittance(simd, &asked, is_wanted, planes);
            part.add(&fragments.optical_depth, &of_part, planes, &mut through);
        }
        through
    }

    /// What lets light through to a volume beside what the sweep carries it through.
    #[inline(always)]
    fn find_others<S: Simd>(
        &self,
        simd: S,
        v: usize,
        places: &Places<S>,
        is_wanted: &[f32; MAX_LANES],
        others: &mut Vec<Through>,
    ) {
        others.clear();
        let SlabWork { geometry, lighting, .. } = self.work;
        let VolumeVoxels { voxels, shadows: Some(shadows), .. } = &geometry.voxels[v] else {
            return;
        };
        let cells = shadows.neighbours.cells(simd, voxels, places, bits(is_wanted));
        for light in 0..lighting.light.iter().len() + lighting.mapped.len() {
            others.push(stored(&shadows.transmittance(simd, voxels, &cells, light)));
        }
    }

    #[inline(always)]
    fn normals<S: Simd>(
        &self,
        simd: S,
        v: usize,
        chunk: &Chunk,
        places: &Places<S>,
        is_wanted: &[f32; MAX_LANES],
    ) -> [Vec3; MAX_LANES] {
        let geometry = self.work.geometry;
        let VolumeVoxels { voxels, values, gradients, kernel_gradients, .. } = &geometry.voxels[v];
        if let Some(gradients) = gradients {
            return geometry.gradients.world(&stored(&gradients.gradients(simd, voxels, places, bits(is_wanted))));
        }
        if let (Values::Gathered(volume), Some(gradients)) = (values, kernel_gradients) {
            let gradients = gradients.gradients(simd, &volume.lattice, places, bits(is_wanted));
            return geometry.gradients.world(&stored(&gradients));
        }
        if !geometry.volumes[v].normals {
            return [Vec3::ZERO; MAX_LANES];
        }
        let slab = self.slab();
        let sheets = SheetsAround {
            before: self.eye.sheet(v, slab.max(1) - 1),
            here: self.eye.sheet(v, slab),
            after: self.eye.sheet(v, (slab + 1).min(geometry.frame.slabs.count - 1)),
        };
        geometry.gradients.normals(simd, sheets, self.eye.band.stride, chunk.k)
    }

    /// Mixes the radiance of one point of a volume, with its share of the optical depth so far, into a lane of the fragments; light that is scattered
    /// more than once is that of the place `seen`.
    fn mix(
        &self,
        lit: &Lit<'_>,
        pixel: Pixel,
        place: DVec3,
        seen: Option<DVec3>,
        share: [f32; 3],
        out: &mut Fragments,
    ) {
        let SlabWork { geometry, lighting, layout, .. } = self.work;
        let lane = lit.lane;
        let mut values = [0.0; MAX_CHANNELS];
        lit.radiance(geometry, lighting, pixel, place).write(lit.normal, layout, &mut values);
        if let (Some(first), Some(seen)) = (layout.multiple(), seen) {
            let scattered = lit.scattered(geometry, lighting, pixel, seen).unwrap_or([0.0; 3]);
            (0..3).for_each(|c| values[first + c] += scattered[c]);
        }
        let count = layout.count();
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
        medium: MediumDepths<S>,
        splats: Option<Splatted<'_>>,
        fragments: &mut Fragments,
    ) {
        let is_last_first = self.prepends();
        let keeps_depths = self.keeps_depths();
        let geometry = self.work.geometry;
        let eye = &mut *self.eye;
        let mut before = [0.0; MAX_LANES];
        eye.pixels.so_far(simd, chunk.k).store(&mut before);
        let mut share = [0.0; MAX_LANES];
        if let Some(Splatted { found, share: part }) = &splats {
            let Fragments { optical_depth, values, object } = fragments;
            let SquarePixel { lines, pixel: Pixel { x, y } } = *found;
            share = lines.blend(simd, found.pixel, part, Backdrop { optical_depth, values, is_any: true });
            for lane in (0..Lanes::<S>::COUNT).filter(|lane| share[*lane] > 0.5) {
                object[lane] = lines.object(Pixel { x: x + lane, y }).unwrap_or(object[lane]);
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
        medium.near.store(&mut ends[0]);
        medium.far.store(&mut ends[1]);
        let green = eye.pixels.planes / 2;
        let mut depths_of_splats = PixelDepths::default();
        if let Some(splats) = splats {
            depths_of_splats = splats.found.lines.depths(simd, splats.found.pixel);
        }
        for lane in 0..Lanes::<S>::COUNT.min(eye.band.width.saturating_sub(chunk.x)) {
            let optical_depth = fragments.optical_depth[green][lane];
            if optical_depth > 0.0 {
                let pixel = Pixel { x: chunk.x + lane, y: chunk.y };
                let ends = ends.map(|end| geometry.view_depth(pixel, end[lane]));
                let depth = f64::from(depths_of_splats.depth[lane]);
                let thickness = f64::from(depths_of_splats.thickness[lane]);
                let half = 0.5 * thickness;
                let mix = |volumes: f64, optical_depth: f64| match share[lane] {
                    // What has no part is of no meaning.
                    0.0 => volumes,
                    1.0.. => optical_depth,
                    share => volumes + (optical_depth - volumes) * f64::from(share),
                };
                let near = mix(ends[0].min(ends[1]), depth - half);
                let far = mix(ends[0].max(ends[1]), depth + half);
                eye.pixels.add_depth(chunk.k + lane, near, far, before[lane], optical_depth);
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
fn bits(is_wanted: &[f32; MAX_LANES]) -> u32 {
    is_wanted.iter().rev().fold(0, |bits, lane| bits << 1 | u32::from(*lane > 0.0))
}
