//! Soft shadows: what each slab lets through, moved by where the points of an extended light see it and multiplied up (Zhang and
//! Crawfis, section 5).
//!
//! Each point of the light has an image of Σσ·Δz along its own rays, Δz the depth across the slabs, and the centre has one. A
//! slab is reconstructed once, for the centre, and added to each image where that point's rays meet it ([`Penumbra`]). Light that
//! arrives at a slab is the mean of e^(−l·Σσ·Δz) over the points, l the length per depth of the centre's ray: what is convolved with
//! the light's shape is light, not optical depth. An occluder of its own depth is convolved with a kernel of its own width, and
//! occluders one behind the other are met by one ray or by another, so no distance has to be shared by several. A constant is a
//! constant after any number of slabs; beyond the image nothing attenuates.

use super::moved::{PAD, columns_for, moved, rows_for};
use super::penumbra::{Penumbra, Shift};
use crate::half_vector::light::buffer::LightBand;
use crate::half_vector::light::path::Places;
use crate::half_vector::slicing::band::ROWS;
use crate::half_vector::slicing::sight::Sight;
use crate::shared::depths::DepthRange;
use crate::shared::pixel::Pixel;
use rayon::prelude::*;
use splat_core::glam::{DVec2, DVec3, Vec3};
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};
use std::ops::Range;

/// Least transmittance: its logarithm is a number.
const LEAST: f32 = 1e-37;

/// Share of the optical depth by which a penumbra changes it wholly.
const CHANGED: f32 = 0.05;

/// Where a pixel finds its slab in the light's image: the first of four pixels, and shares of those right of it and below.
#[derive(Debug, Clone, Copy)]
struct Source {
    corner: [u32; 2],
    share: [f32; 2],
}

/// The images of one extended light.
pub(crate) struct SoftBuffer {
    pub(crate) penumbra: Penumbra,
    planes: usize,
    sources: Vec<Option<Source>>,
    /// The present slab, row by row, plane by plane.
    slab: Vec<f32>,
    /// Rows of it that are not empty.
    filled: Range<usize>,
    /// Of the centre and each point, row by row, point by point, plane by plane.
    sums: Vec<f32>,
    /// Optical depth of the light that arrives at the present slab and that of the centre's alone; row by row, plane by plane.
    arriving: Vec<f32>,
    /// An empty row.
    nothing: Vec<f32>,
    /// Images that were moved.
    pub(crate) passes: u64,
}

/// What a penumbra makes of the optical depth towards the light's centre before the slab, by plane: times `share`, plus `rest`.
///
/// Where the penumbra changes nothing, that is known with the exact length of the way; elsewhere what arrives replaces it.
#[derive(Clone, Copy)]
pub(crate) struct Soft<S: Simd> {
    pub(crate) share: [Lanes<S>; 3],
    pub(crate) rest: [Lanes<S>; 3],
}

/// A slab's place: columns and rows, and depth.
struct Part {
    columns: Range<usize>,
    rows: Range<usize>,
    shifts: Vec<Shift>,
}

impl SoftBuffer {
    /// For `planes` channels of extinction that `sight`, the light's image, has slabs of.
    pub(crate) fn new(penumbra: Penumbra, planes: usize, sight: &Sight) -> Self {
        let [width, height] = penumbra.size;
        let stride = width + 2 * PAD;
        let source_of = |k: usize| source(sight, penumbra.place(Pixel { x: k % width, y: k / width }));
        Self {
            sources: (0..width * height).into_par_iter().map(source_of).collect(),
            slab: vec![0.0; planes * stride * height],
            filled: 0..0,
            sums: vec![0.0; (penumbra.count() + 1) * planes * stride * height],
            arriving: vec![0.0; 2 * planes * width * height],
            nothing: vec![0.0; stride],
            passes: 0,
            penumbra,
            planes,
        }
    }

    /// Bytes of all images of `planes` channels.
    pub(crate) fn bytes_of(penumbra: &Penumbra, planes: u64) -> u64 {
        let [width, height] = penumbra.size.map(|n| n as u64);
        let stored = 4 * (width + 2 * PAD as u64);
        let images = penumbra.count() as u64 + 2;
        let source = size_of::<Option<Source>>() as u64;
        height * (planes * (images * stored + 8 * width) + width * source) + stored
    }

    /// Bytes of all images.
    pub(crate) fn bytes(&self) -> u64 {
        Self::bytes_of(&self.penumbra, self.planes as u64)
    }

    fn stride(&self) -> usize {
        self.penumbra.size[0] + 2 * PAD
    }

    fn part(&self, faces: DepthRange) -> Option<Part> {
        let [columns, rows] = self.penumbra.bounds(faces)?;
        let depth = self.penumbra.middle(faces);
        Some(Part {
            columns,
            rows,
            shifts: (0..self.penumbra.count()).map(|n| self.penumbra.shift(n, depth)).collect(),
        })
    }

    /// Finds what arrives at a slab.
    pub(crate) fn arrive(&mut self, faces: DepthRange) {
        let Some(part) = self.part(faces) else { return };
        self.passes += part.shifts.len() as u64;
        let row = 2 * self.planes * self.penumbra.size[0];
        let mut arriving = std::mem::take(&mut self.arriving);
        arriving.par_chunks_mut(row * ROWS).enumerate().for_each(|(chunk, rows)| {
            pulp::Arch::new().dispatch(Arrive { buffer: self, part: &part, first: chunk * ROWS, rows });
        });
        self.arriving = arriving;
    }

    /// Adds a slab that the light's image has in `bands`.
    pub(crate) fn add(&mut self, faces: DepthRange, bands: &[LightBand]) {
        let Some(part) = self.part(faces) else { return };
        if !self.gather(&part, bands) {
            return;
        }
        self.passes += part.shifts.len() as u64;
        let row = (part.shifts.len() + 1) * self.planes * self.stride();
        let mut sums = std::mem::take(&mut self.sums);
        sums.par_chunks_mut(row * ROWS).enumerate().for_each(|(chunk, rows)| {
            pulp::Arch::new().dispatch(Add { buffer: self, part: &part, first: chunk * ROWS, rows });
        });
        self.sums = sums;
    }

    /// Takes a slab over from the light's image. Whether it has anything.
    fn gather(&mut self, part: &Part, bands: &[LightBand]) -> bool {
        let planes = self.planes;
        let stride = self.stride();
        let width = self.penumbra.size[0];
        let row = planes * stride;
        self.slab[self.filled.start * row..self.filled.end * row].fill(0.0);
        self.filled = part.rows.clone();
        let sources = &self.sources;
        let filled_row = |(n, to): (usize, &mut [f32])| {
            let y = part.rows.start + n;
            let mut any = false;
            for x in part.columns.clone() {
                let Some(source) = sources[y * width + x] else {
                    continue;
                };
                for p in 0..planes {
                    let value = source.take(bands, planes, p);
                    to[p * stride + PAD + x] = value;
                    any |= value > 0.0;
                }
            }
            any
        };
        let rows = &mut self.slab[part.rows.start * row..part.rows.end * row];
        rows.par_chunks_mut(row).enumerate().map(filled_row).reduce(|| false, |a, b| a | b)
    }

    /// What the penumbra makes of the optical depth about places of the present slab, in the volumes. Points count by how much of the way there
    /// they light, `lit`, place by place, where polygons keep a part of it from some: that is 0 for all of them where it is not so.
    #[inline(always)]
    pub(crate) fn in_slab<S: Simd>(
        &self,
        simd: S,
        places: &Places<S>,
        is_wanted: &[f32; MAX_LANES],
        lit: &[f32],
    ) -> Soft<S> {
        self.soft(simd, places, is_wanted, |lane, place, plane| match self.points_of(lit, lane) {
            Some(shares) => self.come_to(place, plane, shares),
            None => self.arriving(self.penumbra.pixel(place), plane),
        })
    }

    /// Shares of the points at a place, from those of all places; `None` where there are none or all are 0.
    fn points_of<'a>(&self, shares: &'a [f32], lane: usize) -> Option<&'a [f32]> {
        let count = self.penumbra.count();
        let of_lane = shares.get(lane * count..(lane + 1) * count);
        of_lane.filter(|of_lane| of_lane.iter().any(|v| *v > 0.0))
    }

    /// The same of places anywhere behind what was added so far: each point's own ray is looked up. Points count by what polygons let
    /// through from each to each place, `visible`, or all alike where that is empty: those that are seen past the edge of a polygon may be those that a
    /// volume hides, or those that it does not.
    #[inline(always)]
    pub(crate) fn beside<S: Simd>(
        &self,
        simd: S,
        places: &Places<S>,
        is_wanted: &[f32; MAX_LANES],
        visible: &[f32],
    ) -> Soft<S> {
        let shares = |lane| self.points_of(visible, lane).unwrap_or(&self.penumbra.shares);
        self.soft(simd, places, is_wanted, |lane, place, plane| self.come_to(place, plane, shares(lane)))
    }

    #[inline(always)]
    fn soft<S: Simd>(
        &self,
        simd: S,
        places: &Places<S>,
        is_wanted: &[f32; MAX_LANES],
        arriving: impl Fn(usize, DVec3, usize) -> [f32; 2],
    ) -> Soft<S> {
        let mut stored_places = [[0.0; MAX_LANES]; 3];
        for a in 0..3 {
            places[a].store(&mut stored_places[a]);
        }
        let mut share = [[1.0; MAX_LANES]; 3];
        let mut rest = [[0.0; MAX_LANES]; 3];
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| is_wanted[*lane] > 0.0) {
            let place =
                DVec3::new(stored_places[0][lane].into(), stored_places[1][lane].into(), stored_places[2][lane].into());
            for p in 0..3 {
                if p >= self.planes {
                    (share[p][lane], rest[p][lane]) = (share[0][lane], rest[0][lane]);
                    continue;
                }
                let [soft, hard] = arriving(lane, place, p);
                let changed = (soft - hard).abs() / soft.max(hard).max(f32::MIN_POSITIVE);
                share[p][lane] = (1.0 - changed / CHANGED).max(0.0);
                rest[p][lane] = (1.0 - share[p][lane]) * soft;
            }
        }
        let load = |v: [f32; MAX_LANES]| Lanes::load(simd, &v);
        Soft { share: share.map(load), rest: rest.map(load) }
    }

    /// Optical depth of what arrives at a place and of the centre's light alone, ray by ray, points by these shares.
    fn come_to(&self, place: DVec3, plane: usize, shares: &[f32]) -> [f32; 2] {
        if !self.penumbra.is_behind(place.z) {
            return [0.0; 2];
        }
        let pixel = self.penumbra.pixel(place);
        let length = self.stretch(pixel);
        let mut through = 0.0;
        let mut whole = 0.0;
        for (point, share) in shares.iter().enumerate() {
            let Shift { scale, start } = self.penumbra.shift(point, place.z).inverse();
            let seen_by_point = pixel * (1.0 + scale) + DVec2::from_array(start);
            through += share * self.through(seen_by_point, point + 1, plane, length);
            whole += share;
        }
        let optical = |through: f32| (-libm::logf(through.max(LEAST))).max(0.0);
        [optical(through / whole), optical(self.through(pixel, 0, plane, length))]
    }

    /// What a point's image lets through about a pixel on a way of this length per depth, bilinear; all beyond it. Light is interpolated,
    /// not optical depth, so edges of what is opaque lie in the middle between pixels.
    fn through(&self, pixel: DVec2, point: usize, plane: usize, length: f32) -> f32 {
        let DVec2 { x, y } = pixel;
        let [width, height] = self.penumbra.size.map(|n| n as f64);
        if !(x > -1.0 && y > -1.0 && x < width && y < height) {
            return 1.0;
        }
        let column = (x + PAD as f64) as usize;
        let [u, v] = [x - x.floor(), y - y.floor()].map(|share| share as f32);
        let [upper, lower] = [0, 1].map(|down| {
            let row = &self.sum_row(y.floor() as i64 + down, point, plane)[column..];
            let [one, other] = [row[0], row[1]].map(|optical| libm::expf(-(optical * length).max(0.0)));
            one + (other - one) * u
        });
        upper + (lower - upper) * v
    }

    /// Optical depth of what arrives and of the centre's light alone about a pixel, bilinear.
    #[inline]
    fn arriving(&self, pixel: DVec2, plane: usize) -> [f32; 2] {
        let [width, height] = self.penumbra.size;
        let split = |v: f64, n: usize| {
            let v = v.clamp(0.0, (n - 1) as f64) as f32;
            let low = (v as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), v - low as f32)
        };
        let (x0, x1, u) = split(pixel.x, width);
        let (y0, y1, v) = split(pixel.y, height);
        [0, 1].map(|which| {
            let value = |x: usize, y: usize| self.arriving[((y * self.planes + plane) * 2 + which) * width + x];
            let a = value(x0, y0);
            let b = value(x1, y0);
            let c = value(x0, y1);
            let d = value(x1, y1);
            let upper = a + (b - a) * u;
            let lower = c + (d - c) * u;
            upper + (lower - upper) * v
        })
    }

    /// A row of the present slab.
    fn slab_row(&self, y: i64, plane: usize) -> &[f32] {
        self.row(&self.slab, y, plane, self.planes)
    }

    /// A row of a point's image, 0 for the centre's.
    fn sum_row(&self, y: i64, point: usize, plane: usize) -> &[f32] {
        self.row(&self.sums, y, point * self.planes + plane, (self.penumbra.count() + 1) * self.planes)
    }

    fn row<'a>(&'a self, planes: &'a [f32], y: i64, n: usize, each: usize) -> &'a [f32] {
        let stride = self.stride();
        match usize::try_from(y) {
            Ok(y) if y < self.penumbra.size[1] => &planes[(y * each + n) * stride..][..stride],
            _ => &self.nothing,
        }
    }
}

/// Where slab coordinates lie in the light's image; `None` beyond it, where no volume is.
fn source(sight: &Sight, place: DVec3) -> Option<Source> {
    let [x, y] = sight.pixel(place.as_vec3() as Vec3).map(|v| v - 0.5);
    let [width, height] = sight.camera.size.map(|s| s as f32);
    let inside = x >= 0.0 && y >= 0.0 && x < width - 1.0 && y < height - 1.0;
    inside.then(|| Source { corner: [x as u32, y as u32], share: [x.fract(), y.fract()] })
}

impl Source {
    fn take(&self, bands: &[LightBand], planes: usize, plane: usize) -> f32 {
        let [x, y] = self.corner.map(|v| v as usize);
        let row = |y: usize| {
            let LightBand { band, slab, .. } = &bands[y / ROWS];
            let value = |x: usize| slab[(y % ROWS * band.width + x) * planes + plane];
            value(x) + (value(x + 1) - value(x)) * self.share[0]
        };
        let upper = row(y);
        let lower = row(y + 1);
        upper + (lower - upper) * self.share[1]
    }
}

/// Rows of all points' images to which a slab is added.
struct Add<'a> {
    buffer: &'a SoftBuffer,
    part: &'a Part,
    first: usize,
    rows: &'a mut [f32],
}

impl pulp::WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { buffer, part, first, rows } = self;
        let [width, height] = buffer.penumbra.size;
        let planes = buffer.planes;
        let stride = buffer.stride();
        let each = (part.shifts.len() + 1) * planes * stride;
        let still = Shift { scale: 0.0, start: [0.0; 2] };
        let mut moved_to = [simd.lanes(0.0); ROWS];
        for (point, shift) in std::iter::once(&still).chain(&part.shifts).enumerate() {
            let columns = columns_for(shift, &part.columns, width);
            let rows_here = rows_for(shift, &part.rows, height);
            let rows_here = rows_here.start.max(first)..rows_here.end.min(first + rows.len() / each);
            if rows_here.is_empty() {
                continue;
            }
            for p in 0..planes {
                for x in columns.clone().step_by(Lanes::<S>::COUNT) {
                    moved(simd, |y| buffer.slab_row(y, p), shift, x, rows_here.clone(), &mut moved_to);
                    for (y, more) in rows_here.clone().zip(&moved_to) {
                        let to = &mut rows[(y - first) * each + (point * planes + p) * stride + PAD + x..];
                        (*more + Lanes::load(simd, to)).store(to);
                    }
                }
            }
        }
    }
}

/// Rows of what arrives.
struct Arrive<'a> {
    buffer: &'a SoftBuffer,
    part: &'a Part,
    first: usize,
    rows: &'a mut [f32],
}

impl pulp::WithSimd for Arrive<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { buffer, part, first, rows } = self;
        let width = buffer.penumbra.size[0];
        let planes = buffer.planes;
        let each = 2 * planes * width;
        let rows_here = part.rows.start.max(first)..part.rows.end.min(first + rows.len() / each);
        for p in (0..planes).filter(|_| !rows_here.is_empty()) {
            for x in part.columns.clone().step_by(Lanes::<S>::COUNT) {
                for (y, arriving) in rows_here.clone().zip(buffer.arriving_at(simd, part, x, rows_here.clone(), p)) {
                    for (which, optical) in arriving.into_iter().enumerate() {
                        optical.store(&mut rows[(y - first) * each + (2 * p + which) * width + x..]);
                    }
                }
            }
        }
    }
}

impl SoftBuffer {
    /// Optical depths of what arrives at pixels `x`.. of some rows and of the centre's light alone.
    #[inline(always)]
    fn arriving_at<S: Simd>(
        &self,
        simd: S,
        part: &Part,
        x: usize,
        rows: Range<usize>,
        plane: usize,
    ) -> [[Lanes<S>; 2]; ROWS] {
        // Soft light so far, and length per depth of the centre's rays.
        let mut out = [[simd.lanes(0.0), self.length(simd, Pixel { x, y: 0 })]; ROWS];
        for (y, out) in rows.clone().zip(&mut out) {
            out[1] = self.length(simd, Pixel { x, y });
        }
        let mut optical_depths = [simd.lanes(0.0); ROWS];
        let mut whole = 0.0;
        for (point, (shift, share)) in part.shifts.iter().zip(&self.penumbra.shares).enumerate() {
            whole += share;
            let row = |y: i64| self.sum_row(y, point + 1, plane);
            moved(simd, row, &shift.inverse(), x, rows.clone(), &mut optical_depths);
            for (optical, [soft, length]) in optical_depths[..rows.len()].iter().zip(&mut out) {
                *soft = *soft + (*optical * *length).max(simd.lanes(0.0)).exp_neg() * simd.lanes(*share);
            }
        }
        for (y, [soft, length]) in rows.zip(&mut out) {
            let mean = *soft / simd.lanes(whole);
            *soft = (simd.lanes(0.0) - mean.max(simd.lanes(LEAST)).logarithm()).max(simd.lanes(0.0));
            *length = *length * Lanes::load(simd, &self.sum_row(y as i64, 0, plane)[PAD + x..]);
        }
        out
    }

    /// Length per depth of the centre's rays.
    #[inline(always)]
    fn length<S: Simd>(&self, simd: S, first: Pixel) -> Lanes<S> {
        let mut out = [0.0; MAX_LANES];
        for (n, out) in out.iter_mut().enumerate().take(Lanes::<S>::COUNT) {
            *out = self.stretch(DVec2::new((first.x + n) as f64, first.y as f64));
        }
        Lanes::load(simd, &out)
    }

    /// Length per depth of the centre's ray through a pixel.
    #[inline(always)]
    fn stretch(&self, pixel: DVec2) -> f32 {
        let (slope, step) = self.penumbra.slopes();
        let [right, down] = [slope.x + step * pixel.x, slope.y + step * pixel.y];
        (1.0 + right * right + down * down).sqrt() as f32
    }
}
