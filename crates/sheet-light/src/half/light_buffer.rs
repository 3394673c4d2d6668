//! The light buffer: what lies between the light and the present slab, in the light's own image.
//!
//! A pixel holds Στ of the slabs so far and the length Σl of its ray in the volume so far, both with their rounding errors kept
//! (Kahan), so slabs by the hundred thousand cost no digits. Two numbers rather than one, because their quotient, the mean
//! extinction on the way, interpolates: where light enters through a face that lies slanted to the slabs, τ has a kink at which
//! neighbours mislead, while the length on the way to any place is known in closed form.

use super::HalfSplats;
use super::band::{Band, ROWS};
use super::buckets::Buckets;
use super::eye_sheets::WHOLE;
use super::frame::Frame;
use super::penumbra::Penumbra;
use super::placed::Placed;
use super::sheet::{Sheet, Splatter};
use super::sight::{Shape, Sight};
use super::soft_buffer::SoftBuffer;
use super::splat_light::SplatLight;
use crate::Volume;
use crate::precision::rounded_one;
use rayon::prelude::*;
use splat_core::Camera;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};

/// Optical depth and length so far, then what these sums are too large by.
type Sums = [f32; 4];

/// The buffer of one light.
pub(crate) struct LightBuffer {
    pub(crate) sight: Sight,
    shapes: Vec<Shape>,
    buckets: Vec<Buckets>,
    bands: Vec<LightBand>,
    /// Row by row, volume by volume in a pixel.
    sums: Vec<Sums>,
    volumes: usize,
    /// Where the light has an extent.
    pub(crate) soft: Option<SoftBuffer>,
}

/// A band of the light's image.
pub(crate) struct LightBand {
    pub(crate) band: Band,
    /// One sheet serves all volumes, one after the other.
    sheet: Sheet,
    /// For soft shadows: extinction times depth of the present slab, plane by plane in a pixel; else empty.
    pub(crate) slab: Vec<f32>,
}

impl LightBuffer {
    pub(crate) fn new(frame: &Frame, camera: Camera, volumes: &[Volume<'_>], placed: &[Placed<'_>]) -> Self {
        let sight = Sight::new(frame, camera);
        let [width, height] = camera.size.map(|s| s as usize);
        let band = |b: usize| {
            let band = Band::new(b, 0, frame, &camera, volumes);
            let sheet = Sheet::new(&band);
            LightBand { band, sheet, slab: Vec::new() }
        };
        Self {
            sight,
            shapes: placed.iter().map(|p| sight.shape(frame, p)).collect(),
            buckets: Vec::new(),
            bands: (0..height.div_ceil(ROWS)).into_par_iter().map(band).collect(),
            sums: vec![[0.0; 4]; width * height * volumes.len()],
            volumes: volumes.len(),
            soft: None,
        }
    }

    /// Gives the light an extent, and its images `planes` channels of extinction.
    pub(crate) fn soften(&mut self, penumbra: Penumbra, planes: usize) {
        for LightBand { band, slab, .. } in &mut self.bands {
            *slab = vec![0.0; band.rows.len() * band.width * planes];
        }
        self.soft = Some(SoftBuffer::new(penumbra, planes, &self.sight));
    }

    /// Finds what arrives at a slab, where that is not what the sums have.
    pub(crate) fn arrive(&mut self, slab: u32, frame: &Frame) {
        if let Some(soft) = &mut self.soft {
            soft.arrive([frame.slabs.face(slab), frame.slabs.face(slab + 1)]);
        }
    }

    /// Extents of the footprints along the slabs, by volume.
    pub(crate) fn shape(&self, volume: usize) -> &Shape {
        &self.shapes[volume]
    }

    /// Takes the voxels of the next volume.
    pub(crate) fn push(&mut self, buckets: Buckets) {
        self.buckets.push(buckets);
    }

    /// Bytes of the buffer itself, without lists of voxels.
    pub(crate) fn bytes(&self) -> u64 {
        let bands: u64 = self.bands.iter().map(|b| b.band.bytes() + b.sheet.bytes() + 4 * b.slab.len() as u64).sum();
        bands + (self.sums.len() * size_of::<Sums>()) as u64 + self.soft.as_ref().map_or(0, SoftBuffer::bytes)
    }

    /// Bytes of lists of voxels.
    pub(crate) fn list_bytes(&self) -> u64 {
        self.buckets.iter().map(Buckets::bytes).sum()
    }

    /// Reconstructs a slab in the light's image and attenuates by it (steps 11, 14 and 21 of the pseudocode); a light with an extent by the
    /// splats of the slab, too. Number of footprint numbers.
    pub(crate) fn attenuate(
        &mut self,
        slab: u32,
        frame: &Frame,
        placed: &[Placed<'_>],
        splats: Option<&SplatLight<'_>>,
    ) -> u64 {
        let Self { sight, shapes, buckets, bands, sums, volumes, soft } = self;
        // Splats alone have no sums here.
        let row = sight.camera.size[0] as usize * (*volumes).max(1);
        let chunks = sums.par_chunks_mut(row * ROWS);
        let of = Attenuate { slab, frame, placed, sight, shapes, buckets };
        let band = |(index, (band, sums)): (usize, (&mut LightBand, &mut [Sums]))| {
            pulp::Arch::new().dispatch(OneBand { of: &of, index, band, sums })
        };
        bands.par_iter_mut().for_each(|band| band.slab.fill(0.0));
        let fragments = bands.par_iter_mut().zip(chunks).enumerate().map(band).sum();
        if let Some(soft) = soft {
            if let Some(splats) = splats {
                bands.par_iter_mut().for_each(|band| band.add_splats(splats));
            }
            soft.add([frame.slabs.face(slab), frame.slabs.face(slab + 1)], bands);
        }
        fragments
    }

    /// Optical depth and length so far about a place of the image, pixels, bilinear; neighbours at a border are those inside.
    #[inline]
    pub(crate) fn at(&self, volume: usize, place: [f32; 2]) -> [f32; 2] {
        let ([[x0, x1], [y0, y1]], [u, v]) = self.sight.around(place);
        let width = self.sight.camera.size[0] as usize;
        let sum = |x: usize, y: usize| &self.sums[(y * width + x) * self.volumes + volume];
        let a = sum(x0, y0);
        let b = sum(x1, y0);
        let c = sum(x0, y1);
        let d = sum(x1, y1);
        [0, 1].map(|n| {
            let upper = a[n] + (b[n] - a[n]) * u;
            let lower = c[n] + (d[n] - c[n]) * u;
            upper + (lower - upper) * v
        })
    }
}

impl LightBand {
    /// Adds the splats of the present slab: their optical depths over the length of the light's rays per depth.
    fn add_splats(&mut self, splats: &SplatLight<'_>) {
        let Self { band, slab, .. } = self;
        let planes = slab.len() / (band.rows.len() * band.width);
        for y in 0..band.stored {
            for x in splats.span(band.top + y).into_iter().flatten().take_while(|x| *x < band.width) {
                let own = splats.of_slab([x, band.top + y]);
                let to = &mut slab[(y * band.width + x) * planes..][..planes];
                to.iter_mut().zip(own).for_each(|(to, own)| *to += own / band.stretch[y * band.stride + x]);
            }
        }
    }
}

/// What all bands of a slab share.
struct Attenuate<'a> {
    slab: u32,
    frame: &'a Frame,
    placed: &'a [Placed<'a>],
    sight: &'a Sight,
    shapes: &'a [Shape],
    buckets: &'a [Buckets],
}

/// One band's work, in the form that [`pulp`] compiles once per instruction set.
struct OneBand<'a> {
    of: &'a Attenuate<'a>,
    index: usize,
    band: &'a mut LightBand,
    sums: &'a mut [Sums],
}

impl pulp::WithSimd for OneBand<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        let Attenuate { slab, frame, placed, sight, shapes, buckets } = *self.of;
        let LightBand { band, sheet, slab: depths } = self.band;
        let planes = depths.len() / (band.rows.len() * band.width);
        let faces = [frame.slabs.face(slab), frame.slabs.face(slab + 1)];
        let mut fragments = 0;
        for (v, placed) in placed.iter().enumerate().filter(|(_, p)| p.volume.casts_shadow) {
            sheet.begin(simd, band, v, faces);
            if sheet.is_empty() {
                continue;
            }
            let splatter = Splatter { placed, sight, shape: &shapes[v], buckets: &buckets[v] };
            fragments += sheet.splat(simd, &splatter, band, self.index, slab);
            sheet.finish(simd, band.stride);
            for y in 0..band.stored {
                let mut x = sheet.spans[y].start;
                while x < sheet.spans[y].end {
                    let k = y * band.stride + x;
                    let depth = sheet.depth(simd, k, &WHOLE);
                    let length = depth * Lanes::load(simd, &band.stretch[k..]);
                    let extinction = sheet.classify(simd, placed, k)[0];
                    let tau = extinction * length;
                    let row = &mut self.sums[y * band.width * placed_count(self.of)..];
                    let count = Lanes::<S>::COUNT.min(band.width.saturating_sub(x));
                    add([tau, length], row, [x, count, v, placed_count(self.of)], placed.half);
                    if planes > 0 {
                        let to = &mut depths[(y * band.width + x) * planes..];
                        add_depth(extinction * depth, to, [count, planes], placed.volume.material.extinction_rgb);
                    }
                    x += Lanes::<S>::COUNT;
                }
            }
        }
        fragments
    }
}

/// Adds extinction times depth to `count` pixels, by plane.
#[inline(always)]
fn add_depth<S: Simd>(own: Lanes<S>, to: &mut [f32], [count, planes]: [usize; 2], factors: [f32; 3]) {
    let mut of_each = [0.0; MAX_LANES];
    own.store(&mut of_each);
    for lane in 0..count {
        for p in 0..planes {
            to[lane * planes + p] += of_each[lane] * factors[p];
        }
    }
}

/// Channels of extinction that differ: one where all volumes and splats attenuate all alike.
pub(crate) fn planes(volumes: &[Volume<'_>], splats: Option<&HalfSplats<'_>>) -> usize {
    let of_splats = splats.into_iter().flat_map(|splats| splats.materials);
    let mut all = volumes.iter().map(|v| v.material).chain(of_splats);
    if all.all(|m| m.extinction_rgb.windows(2).all(|w| w[0] == w[1])) { 1 } else { 3 }
}

fn placed_count(of: &Attenuate<'_>) -> usize {
    of.placed.len()
}

/// Adds optical depths and lengths to `count` pixels of a row from `x` on, to volume `v` of `volumes`.
#[inline(always)]
fn add<S: Simd>(terms: [Lanes<S>; 2], row: &mut [Sums], [x, count, v, volumes]: [usize; 4], half: bool) {
    let mut parts = [[0.0; MAX_LANES]; 2];
    terms[0].store(&mut parts[0]);
    terms[1].store(&mut parts[1]);
    for lane in 0..count {
        let sums = &mut row[(x + lane) * volumes + v];
        for n in 0..2 {
            if half {
                sums[n] = rounded_one(sums[n] + parts[n][lane]);
                continue;
            }
            let term = parts[n][lane] - sums[2 + n];
            let new = sums[n] + term;
            sums[2 + n] = (new - sums[n]) - term;
            sums[n] = new;
        }
    }
}
