//! A sheet in a band of an image: reconstructed values of one slab of one volume, each at its own pixel's place.
//!
//! v = Σ v_i·w_i / Σ w_i. The weight of a voxel is its footprint at the place of the pixel in the slab, times the section of its
//! kernel in the slab. That place is the middle of what the pixel's ray has of slab and volume, so it never lies outside the
//! volume, however wide and slanted slabs are.
//!
//! Across the slabs a section stands for the slab's middle. Where a face of the volume, the eye's plane or something opaque cuts the slab, the
//! middle of what is left lies before or behind that: there the section is interpolated towards the neighbouring slab's, pixel by pixel. Sheets that are
//! gathered ([`super::gathered`]) read the lattice at that very place.

use super::band::Band;
use super::buckets::{Buckets, Record};
use super::placed::Placed;
use super::sight::{Shape, Sight};
use crate::shared::depths::{DepthRange, DepthSpans};
use crate::shared::sections::LEAST_WEIGHT;
use crate::shared::sections::{PHASES, SectionsAround};
use crate::shared::sums::rounded;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// What all voxels of a volume share in an image.
#[derive(Clone, Copy)]
pub(crate) struct Splatter<'a> {
    pub(crate) placed: &'a Placed<'a>,
    pub(crate) sight: &'a Sight,
    pub(crate) shape: &'a Shape,
    pub(crate) buckets: &'a Buckets,
}

/// Pixels of a band.
struct Rectangle {
    rows: Range<usize>,
    columns: Range<usize>,
}

/// One slab of one volume: planes as those of the band.
#[derive(Debug, Clone)]
pub(crate) struct Sheet {
    /// Depths across the slabs between which rays are in slab and volume.
    pub(crate) near: Vec<f32>,
    pub(crate) far: Vec<f32>,
    /// a and b of the middle between them.
    pub(crate) places: [Vec<f32>; 2],
    /// How many slabs behind the slab's middle it lies, at most half of one.
    pub(crate) behind: Vec<f32>,
    /// Σ v·w, then their quotient.
    pub(crate) values: Vec<f32>,
    pub(crate) weights: Vec<f32>,
    /// By row: columns that may be inside, whole vectors.
    pub(crate) spans: Vec<Range<usize>>,
    /// By row: those of them that may have a value.
    pub(crate) shown: Vec<Range<usize>>,
    /// By row: columns of which all rays that are inside cross the whole slab, the longest run.
    whole: Vec<Range<usize>>,
    /// Rows of which any is inside.
    pub(super) rows: Range<usize>,
    /// Depths that the places lie between.
    depths: DepthRange,
}

impl Sheet {
    pub(crate) fn new(band: &Band) -> Self {
        let plane = || vec![0.0; band.stored * band.stride];
        Self {
            near: vec![f32::INFINITY; band.stored * band.stride],
            far: vec![f32::NEG_INFINITY; band.stored * band.stride],
            places: [plane(), plane()],
            behind: plane(),
            values: plane(),
            weights: plane(),
            spans: vec![0..0; band.stored],
            shown: vec![0..0; band.stored],
            whole: vec![0..0; band.stored],
            rows: 0..0,
            depths: DepthRange { near: 0.0, far: 0.0 },
        }
    }

    /// Bytes of the planes.
    pub(crate) fn bytes(&self) -> u64 {
        4 * 7 * self.near.len() as u64
    }

    /// Whether nothing is inside.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Begins the slab between two depths.
    #[inline(always)]
    pub(crate) fn begin<S: Simd>(&mut self, simd: S, band: &Band, volume: usize, faces: DepthRange) {
        let middle = 0.5 * (faces.near + faces.far);
        self.rows = 0..0;
        self.depths = DepthRange { near: middle, far: middle };
        for y in 0..band.stored {
            let hit = &band.hits[volume][y];
            let is_met = hit.near < faces.far && hit.far > faces.near;
            let old = self.spans[y].clone();
            let count = Lanes::<S>::COUNT;
            // What other pixels ask of these is whether they are inside.
            self.near[y * band.stride + old.start..y * band.stride + old.end].fill(f32::INFINITY);
            self.spans[y] = 0..0;
            self.shown[y] = 0..0;
            if !is_met {
                continue;
            }
            let columns = hit.columns.start / count * count..hit.columns.end.next_multiple_of(count);
            if self.begin_row(simd, band, volume, y, columns.clone(), faces) {
                self.spans[y] = columns.clone();
                self.shown[y] = columns;
                self.rows = if self.rows.is_empty() { y } else { self.rows.start }..y + 1;
            }
        }
    }

    /// Places and ends of a row; whether any is inside.
    #[inline(always)]
    fn begin_row<S: Simd>(
        &mut self,
        simd: S,
        band: &Band,
        volume: usize,
        y: usize,
        columns: Range<usize>,
        faces: DepthRange,
    ) -> bool {
        let first = simd.lanes(faces.near);
        let last = simd.lanes(faces.far);
        let half = simd.lanes(0.5);
        let zero = simd.lanes(0.0);
        let one = simd.lanes(1.0);
        let middle = simd.lanes(0.5 * (faces.near + faces.far));
        let per_slab = simd.lanes(1.0 / (faces.far - faces.near));
        let mut any = false;
        let mut any_cut = false;
        let mut run = columns.start..columns.start;
        self.whole[y] = run.clone();
        let mut x = columns.start;
        while x < columns.end {
            let k = y * band.stride + x;
            let near = Lanes::load(simd, &band.crossings[volume][0][k..]).max(first);
            let far = Lanes::load(simd, &band.crossings[volume][1][k..]).min(last);
            near.store(&mut self.near[k..]);
            far.store(&mut self.far[k..]);
            let inside = one.where_less(near, far);
            let is_cut = is_any(inside.where_less(first, near).max(inside.where_less(far, last)));
            let is_inside = is_cut || is_any(inside);
            if is_inside && !is_cut {
                run = if run.end == x { run.start } else { x }..x + Lanes::<S>::COUNT;
                if run.len() > self.whole[y].len() {
                    self.whole[y] = run.clone();
                }
            }
            (any, any_cut) = (any || is_inside, any_cut || is_cut);
            let depth = ((near + far) * half).where_less_or(near, far, middle);
            ((depth - middle) * per_slab).store(&mut self.behind[k..]);
            for a in 0..2 {
                let slope = Lanes::load(simd, &band.slope[a][k..]);
                slope.mul_add(depth, Lanes::load(simd, &band.place[a][k..])).store(&mut self.places[a][k..]);
            }
            zero.store(&mut self.values[k..]);
            zero.store(&mut self.weights[k..]);
            x += Lanes::<S>::COUNT;
        }
        if any_cut {
            self.depths = faces;
        }
        any
    }

    /// Adds all voxels that reach the slab. Number of footprint numbers.
    #[inline(always)]
    pub(crate) fn splat<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        band: &Band,
        index: usize,
        slab: u32,
    ) -> u64 {
        let mut fragments = 0;
        if self.rows.is_empty() {
            return 0;
        }
        let has_rim = band.stored > band.rows.len();
        // Where nothing cuts the slab its neighbours have no part in it.
        let beside = u32::from(self.depths.near < self.depths.far);
        for record in
            splatter.buckets.reaching(slab.saturating_sub(beside)..slab + 1 + beside, index, has_rim).flatten()
        {
            let from_first = slab as isize - (record.place / PHASES) as isize;
            let sections = splatter.placed.sections.around(record.place % PHASES, from_first);
            if sections.are_none() {
                continue;
            }
            let bounds = splatter.sight.bounds(splatter.shape, record.center, self.depths);
            // Saturating casts: what lies before the first pixel is 0.
            let from = |edge: f32| (edge - 0.5).ceil() as usize;
            let to = |edge: f32| (edge + 0.5).floor() as usize;
            let rows = from(bounds.top).saturating_sub(band.top).max(self.rows.start)
                ..to(bounds.bottom).saturating_sub(band.top).min(self.rows.end);
            let columns = from(bounds.left)..to(bounds.right).min(band.width);
            if !rows.is_empty() && !columns.is_empty() {
                let pixels = Rectangle { rows, columns };
                fragments += self.add(simd, splatter, band.stride, record, sections, &pixels);
                if splatter.placed.half {
                    self.round(simd, band.stride, &pixels);
                }
            }
        }
        fragments
    }

    /// Adds one voxel to the pixels of a rectangle.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        stride: usize,
        record: &Record,
        sections: SectionsAround,
        pixels: &Rectangle,
    ) -> u64 {
        let SectionsAround { before, here, after } = sections;
        let Rectangle { rows, columns } = pixels;
        let [aa, ab, bb] = splatter.shape.conic;
        let aa = simd.lanes(aa);
        let ab = simd.lanes(2.0 * ab);
        let bb = simd.lanes(bb);
        let value = simd.lanes(record.value);
        let section_here = simd.lanes(here);
        let a = simd.lanes(record.center.x);
        let b = simd.lanes(record.center.y);
        let one = simd.lanes(1.0);
        let zero = simd.lanes(0.0);
        let to_before = simd.lanes(before - here);
        let to_after = simd.lanes(after - here);
        let mut fragments = 0;
        let of_neighbour = here == 0.0;
        for y in rows.clone() {
            let span = &self.spans[y];
            let whole = self.whole[y].clone();
            let mut x = columns.start.max(span.start);
            let end = columns.end.min(span.end);
            while x < end {
                let k = y * stride + x;
                let mut section = section_here;
                if x < whole.start || x + Lanes::<S>::COUNT > whole.end {
                    let behind = Lanes::load(simd, &self.behind[k..]);
                    section = to_after.mul_add(behind.max(zero), section);
                    section = to_before.mul_add((zero - behind).max(zero), section);
                } else if of_neighbour {
                    x = whole.end;
                    continue;
                }
                let da = Lanes::load(simd, &self.places[0][k..]) - a;
                let db = Lanes::load(simd, &self.places[1][k..]) - b;
                let s = aa.mul_add(da, ab * db).mul_add(da, bb * db * db);
                let weight = splatter.placed.kernel.profile(simd, (one - s).max(zero)) * section;
                let sums = &mut self.values[k..];
                weight.mul_add(value, Lanes::load(simd, sums)).store(sums);
                let sums = &mut self.weights[k..];
                (weight + Lanes::load(simd, sums)).store(sums);
                fragments += Lanes::<S>::COUNT as u64;
                x += Lanes::<S>::COUNT;
            }
        }
        fragments
    }

    /// Rounds the sums of a rectangle's pixels to half precision.
    #[inline(always)]
    fn round<S: Simd>(&mut self, simd: S, stride: usize, pixels: &Rectangle) {
        let Rectangle { rows, columns } = pixels;
        for y in rows.clone() {
            let mut x = columns.start.max(self.spans[y].start);
            let end = columns.end.min(self.spans[y].end);
            while x < end {
                for sums in [&mut self.values, &mut self.weights] {
                    let sums = &mut sums[y * stride + x..];
                    rounded(simd, Lanes::load(simd, sums)).store(sums);
                }
                x += Lanes::<S>::COUNT;
            }
        }
    }

    /// Divides by kernel sums.
    #[inline(always)]
    pub(crate) fn finish<S: Simd>(&mut self, simd: S, stride: usize) {
        for y in self.rows.clone() {
            let mut x = self.spans[y].start;
            while x < self.spans[y].end {
                let k = y * stride + x;
                let weight = Lanes::load(simd, &self.weights[k..]).max(simd.lanes(LEAST_WEIGHT));
                (Lanes::load(simd, &self.values[k..]) / weight).store(&mut self.values[k..]);
                x += Lanes::<S>::COUNT;
            }
        }
    }

    /// Extinction, where there is a value, and colour from pixel `k` on.
    #[inline(always)]
    pub(crate) fn classify<S: Simd>(&self, simd: S, placed: &Placed<'_>, k: usize) -> [Lanes<S>; 4] {
        let [extinction, red, green, blue] = placed.classifier.classify(simd, Lanes::load(simd, &self.values[k..]));
        let weight = Lanes::load(simd, &self.weights[k..]);
        [extinction.where_less(simd.lanes(LEAST_WEIGHT), weight), red, green, blue]
    }

    /// Depth of what each ray from pixel `k` on has of slab and volume between two depths, 0 for none.
    #[inline(always)]
    pub(crate) fn depth<S: Simd>(&self, simd: S, k: usize, spans: &DepthSpans) -> Lanes<S> {
        let near = Lanes::load(simd, &self.near[k..]).max(Lanes::load(simd, &spans.from));
        let far = Lanes::load(simd, &self.far[k..]).min(Lanes::load(simd, &spans.to));
        (far - near).max(simd.lanes(0.0))
    }
}

/// Whether any lane is above 0.
#[inline(always)]
pub(crate) fn is_any<S: Simd>(lanes: Lanes<S>) -> bool {
    let mut out = [0.0; MAX_LANES];
    lanes.store(&mut out);
    out[..Lanes::<S>::COUNT].iter().any(|v| *v > 0.0)
}
