//! The light buffer: what lies between the light and the present slab, in the light's own image.
//!
//! A pixel holds Στ of the slabs so far and the length Σl of its ray in the volume so far, both with their rounding errors kept
//! (Kahan), so slabs by the hundred thousand cost no digits. Two numbers rather than one, because their quotient, the mean
//! extinction on the way, interpolates: where light enters through a face that lies slanted to the slabs, τ has a kink at which
//! neighbours mislead, while the length on the way to any place is known in closed form.

use crate::Volume;
use crate::half_vector::geometry::{Geometry, Values};
use crate::half_vector::input::HalfSplats;
use crate::half_vector::slicing::band::{Band, ROWS};
use crate::half_vector::slicing::buckets::Buckets;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::placed::Placed;
use crate::half_vector::slicing::sheet::{Sheet, Splatter};
use crate::half_vector::slicing::sight::{PixelsAround, Shape, Sight};
use crate::half_vector::soft::buffer::SoftBuffer;
use crate::half_vector::soft::penumbra::Penumbra;
use crate::half_vector::splats::light::SplatLight;
use crate::shared::depths::DepthSpans;
use crate::shared::pixel::Pixel;
use crate::shared::sums::rounded_one;
use rayon::prelude::*;
use splat_core::Camera;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
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
            soft.arrive(frame.slabs.faces(slab));
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
    pub(crate) fn attenuate(&mut self, slab: u32, geometry: &Geometry<'_>, splats: Option<&SplatLight<'_>>) -> u64 {
        let Self { sight, shapes, buckets, bands, sums, volumes, soft } = self;
        // Splats alone have no sums here.
        let row = sight.camera.size[0] as usize * (*volumes).max(1);
        let chunks = sums.par_chunks_mut(row * ROWS);
        let work = Attenuate { slab, geometry, sight, shapes, buckets };
        let band = |(index, (band, sums)): (usize, (&mut LightBand, &mut [Sums]))| {
            pulp::Arch::new().dispatch(OneBand { work: &work, index, band, sums })
        };
        bands.par_iter_mut().for_each(|band| band.slab.fill(0.0));
        let fragments = bands.par_iter_mut().zip(chunks).enumerate().map(band).sum();
        if let Some(soft) = soft {
            if let Some(splats) = splats {
                bands.par_iter_mut().for_each(|band| band.add_splats(splats));
            }
            soft.add(geometry.frame.slabs.faces(slab), bands);
        }
        fragments
    }

    /// Optical depth and length so far about a place of the image, pixels, bilinear; neighbours at a border are those inside.
    #[inline]
    pub(crate) fn look_up(&self, volume: usize, place: [f32; 2]) -> [f32; 2] {
        let PixelsAround { columns: [x0, x1], rows: [y0, y1], u, v } = self.sight.around(place);
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
                let of_slab = splats.of_slab(Pixel { x, y: band.top + y });
                let to = &mut slab[(y * band.width + x) * planes..][..planes];
                to.iter_mut().zip(of_slab).for_each(|(to, of_slab)| *to += of_slab / band.stretch[y * band.stride + x]);
            }
        }
    }
}

/// What all bands of a slab share.
struct Attenuate<'a> {
    slab: u32,
    geometry: &'a Geometry<'a>,
    sight: &'a Sight,
    shapes: &'a [Shape],
    buckets: &'a [Buckets],
}

/// One band's work, in the form that [`pulp`] compiles once per instruction set.
struct OneBand<'a> {
    work: &'a Attenuate<'a>,
    index: usize,
    band: &'a mut LightBand,
    sums: &'a mut [Sums],
}

impl pulp::WithSimd for OneBand<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        let Attenuate { slab, geometry, sight, shapes, buckets } = *self.work;
        let Geometry { frame, placed, voxels, .. } = geometry;
        let LightBand { band, sheet, slab: depths } = self.band;
        let planes = depths.len() / (band.rows.len() * band.width);
        let faces = frame.slabs.faces(slab);
        let volumes = placed.len();
        let mut fragments = 0;
        for (v, placed) in placed.iter().enumerate().filter(|(_, p)| p.volume.casts_shadow) {
            sheet.begin(simd, band, v, faces);
            if sheet.is_empty() {
                continue;
            }
            match &voxels[v].values {
                Values::Gathered(volume) => fragments += sheet.gather(simd, volume, band, faces),
                Values::Splatted(_) => {
                    let splatter = Splatter { placed, sight, shape: &shapes[v], buckets: &buckets[v] };
                    fragments += sheet.splat(simd, &splatter, band, self.index, slab);
                    sheet.finish(simd, band.stride);
                }
            }
            for y in 0..band.stored {
                let mut x = sheet.spans[y].start;
                while x < sheet.spans[y].end {
                    let k = y * band.stride + x;
                    let depth = sheet.depth(simd, k, &DepthSpans::WHOLE);
                    let length = depth * Lanes::load(simd, &band.stretch[k..]);
                    let mut extinction = simd.lanes(0.0);
                    if sheet.shown[y].contains(&x) {
                        extinction = sheet.classify(simd, placed, k)[0];
                    }
                    let tau = extinction * length;
                    let count = Lanes::<S>::COUNT.min(band.width.saturating_sub(x));
                    let sums = &mut self.sums[(y * band.width + x) * volumes + v..];
                    let sums = sums.iter_mut().step_by(volumes).take(count);
                    add(tau, length, sums, placed.half);
                    if planes > 0 {
                        let to = &mut depths[(y * band.width + x) * planes..][..count * planes];
                        add_depth(extinction * depth, to, planes, placed.volume.material.extinction_rgb);
                    }
                    x += Lanes::<S>::COUNT;
                }
            }
        }
        fragments
    }
}

/// Adds extinction times depth to pixels of so many planes.
#[inline(always)]
fn add_depth<S: Simd>(term: Lanes<S>, to: &mut [f32], planes: usize, factors: [f32; 3]) {
    let mut terms = [0.0; MAX_LANES];
    term.store(&mut terms);
    for (pixel, term) in to.chunks_exact_mut(planes).zip(terms) {
        pixel.iter_mut().zip(factors).for_each(|(to, factor)| *to += term * factor);
    }
}

/// Channels of extinction that differ: one where all volumes and splats attenuate all alike.
pub(crate) fn planes(volumes: &[Volume<'_>], splats: Option<&HalfSplats<'_>>) -> usize {
    let of_splats = splats.into_iter().flat_map(|splats| splats.materials);
    let mut materials = volumes.iter().map(|v| v.material).chain(of_splats);
    if materials.all(|m| m.extinction_rgb.windows(2).all(|w| w[0] == w[1])) { 1 } else { 3 }
}

/// Adds optical depths and lengths to the sums of neighbouring pixels.
#[inline(always)]
fn add<'s, S: Simd>(optical_depth: Lanes<S>, length: Lanes<S>, pixels: impl Iterator<Item = &'s mut Sums>, half: bool) {
    let mut parts = [[0.0; MAX_LANES]; 2];
    optical_depth.store(&mut parts[0]);
    length.store(&mut parts[1]);
    for (lane, sums) in pixels.enumerate() {
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
