//! One tile of the accumulator: optical depths, transmittances, colours, depths; what is still seen through.
//!
//! Front to back: weight = T·(1 − e^−τ), C ← C + weight·L, 1 − e^−τ by a series; T is e^−τ of all so far. Optical depth and radiance are summed with
//! their rounding errors kept (Kahan), so slabs by the hundred thousand cost no digits.

use super::size::{SIDE, TILE};
use crate::Params;
use crate::shared::sums::{Sum, add};
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES, exp_neg};
use splat_core::raster::pulp::Simd;
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use splat_core::{Accumulator, DepthFragment, DepthProfile};

/// Pixels of a tile without its rim.
const PIXELS: usize = TILE * TILE;

/// What neighbouring pixels have of one slab.
#[derive(Debug, Clone)]
pub(crate) struct Fragments {
    /// Whether any volume has optical depth here; what else they hold is of another place if none has.
    pub(crate) any: bool,
    /// Optical depth by plane.
    pub(crate) optical_depth: [[f32; MAX_LANES]; 3],
    /// Radiance and the other channels.
    pub(crate) values: [[f32; MAX_LANES]; MAX_CHANNELS],
    /// View depths between which the medium lies, counted from the first slab.
    pub(crate) near: [f32; MAX_LANES],
    pub(crate) far: [f32; MAX_LANES],
    pub(crate) object: [u32; MAX_LANES],
}

/// The state of one tile.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) corner: [usize; 2],
    /// Columns and rows inside the image.
    inside: [usize; 2],
    pub(crate) planes: usize,
    pub(crate) channels: usize,
    optical_depth: Vec<f32>,
    /// What the sums of optical depth are too large by.
    excess: Vec<f32>,
    transmittance: Vec<f32>,
    values: Vec<f32>,
    /// What the values are too large by.
    value_excess: Vec<f32>,
    depth: Vec<DepthProfile>,
    object: Vec<u32>,
    cutoff: f32,
    /// Whether sums are rounded to half precision.
    half: bool,
    /// Pixels of each row of the tile with its rim that are seen through.
    pub(crate) open: [u64; SIDE],
    /// Of these, those where volumes may be seen: what is opaque lies behind.
    pub(crate) lit: [u64; SIDE],
    /// Whether anything was composited since these were found.
    is_changed: bool,
}

/// Neighbouring pixels of a tile that has one plane of optical depth and three channels, while slab after slab is added to them.
pub(crate) struct Pixels<S: Simd> {
    optical_depth: Sum<S>,
    transmittance: Lanes<S>,
    values: [Sum<S>; 3],
    cutoff: Lanes<S>,
    /// The greatest transmittance of a pixel that is done.
    below_open: Lanes<S>,
}

impl<S: Simd> Pixels<S> {
    /// Composites fragments, as [`Picture::composite`] does.
    #[inline(always)]
    pub(crate) fn composite(&mut self, simd: S, fragments: &Fragments) {
        let zero = simd.lanes(0.0);
        let tau = zero.where_less_or(self.transmittance, self.cutoff, Lanes::load(simd, &fragments.optical_depth[0]));
        let weight = self.transmittance * tau.opacity();
        self.optical_depth.add(simd, tau);
        self.transmittance = self.optical_depth.sum.exp_neg();
        for c in 0..3 {
            self.values[c].add(simd, weight * Lanes::load(simd, &fragments.values[c]));
        }
    }

    /// Whether nothing more is seen through any of them.
    #[inline(always)]
    pub(crate) fn are_done(&self) -> bool {
        !self.below_open.any_less(self.transmittance)
    }
}

impl Picture {
    /// The tile at `corner` as it is so far.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(simd: S, from: &Accumulator, corner: [usize; 2], params: &Params) -> Self {
        let planes = from.optical_depth.len();
        let channels = from.channels.len();
        let inside = [0, 1].map(|a| (from.size[a] as usize - corner[a]).min(TILE));
        let mut tile = Self {
            corner,
            inside,
            planes,
            channels,
            optical_depth: vec![0.0; planes * PIXELS],
            excess: vec![0.0; planes * PIXELS],
            // Nothing outside the image keeps a tile busy.
            transmittance: vec![0.0; planes * PIXELS],
            values: vec![0.0; channels * PIXELS],
            value_excess: vec![0.0; channels * PIXELS],
            depth: if from.depth.is_empty() { Vec::new() } else { vec![DepthProfile::default(); PIXELS] },
            object: if from.object.is_empty() { Vec::new() } else { vec![u32::MAX; PIXELS] },
            cutoff: params.transmittance_cutoff,
            half: params.is_half(),
            open: [0; SIDE],
            lit: [0; SIDE],
            is_changed: true,
        };
        for (image, at) in tile.rows(from.size[0]) {
            for (p, plane) in from.optical_depth.iter().enumerate() {
                let to = p * PIXELS + at..p * PIXELS + at + inside[0];
                tile.optical_depth[to.clone()].copy_from_slice(&plane[image.clone()]);
                let through = tile.transmittance[to].iter_mut().zip(&plane[image.clone()]);
                through.for_each(|(t, optical_depth)| *t = exp_neg(*optical_depth));
            }
            for (c, plane) in from.channels.iter().enumerate() {
                tile.values[c * PIXELS + at..][..inside[0]].copy_from_slice(&plane[image.clone()]);
            }
            if !tile.depth.is_empty() {
                tile.depth[at..at + inside[0]].copy_from_slice(&from.depth[image.clone()]);
            }
            if !tile.object.is_empty() {
                tile.object[at..at + inside[0]].copy_from_slice(&from.object[image.clone()]);
            }
        }
        tile.find_open(simd);
        tile
    }

    /// Rows inside the image: where they are there, and where they begin in a plane of the tile.
    fn rows(&self, width: u32) -> impl Iterator<Item = (std::ops::Range<usize>, usize)> + use<> {
        let [x, y] = self.corner;
        let [columns, rows] = self.inside;
        (0..rows).map(move |row| {
            let begin = (y + row) * width as usize + x;
            (begin..begin + columns, row * TILE)
        })
    }

    /// Writes the tile back.
    pub(crate) fn store(&self, to: &mut Accumulator) {
        let columns = self.inside[0];
        for (image, at) in self.rows(to.size[0]) {
            for (p, plane) in to.optical_depth.iter_mut().enumerate() {
                plane[image.clone()].copy_from_slice(&self.optical_depth[p * PIXELS + at..][..columns]);
            }
            for (c, plane) in to.channels.iter_mut().enumerate() {
                plane[image.clone()].copy_from_slice(&self.values[c * PIXELS + at..][..columns]);
            }
            if !self.depth.is_empty() {
                to.depth[image.clone()].copy_from_slice(&self.depth[at..at + columns]);
            }
            if !self.object.is_empty() {
                to.object[image.clone()].copy_from_slice(&self.object[at..at + columns]);
            }
        }
    }

    /// Finds the pixels that are still seen through.
    #[inline(always)]
    pub(crate) fn find_open<S: Simd>(&mut self, simd: S) {
        if !self.is_changed {
            return;
        }
        self.is_changed = false;
        let least = self.least_open();
        for y in 0..TILE {
            let mut bits = 0;
            for x in (0..TILE).step_by(Lanes::<S>::COUNT) {
                let mut most = simd.lanes(0.0);
                for p in 0..self.planes {
                    most = most.max(Lanes::load(simd, &self.transmittance[p * PIXELS + y * TILE + x..]));
                }
                let mut of_lanes = (1 << Lanes::<S>::COUNT) - 1;
                if most.any_less(simd.lanes(least)) {
                    let mut through = [0.0; MAX_LANES];
                    most.store(&mut through);
                    let lanes = through[..Lanes::<S>::COUNT].iter().rev();
                    of_lanes = lanes.fold(0, |bits, through| bits << 1 | u64::from(*through >= least));
                }
                bits |= of_lanes << (x + 1);
            }
            self.open[y + 1] = bits;
        }
    }

    /// The least transmittance of a pixel that is seen through: what is not 0 is no less than a normal number.
    fn least_open(&self) -> f32 {
        self.cutoff.max(f32::MIN_POSITIVE)
    }

    /// Whether pixels are no more than [`Pixels`] have.
    pub(crate) fn is_plain(&self) -> bool {
        self.planes == 1 && self.channels == 3 && self.depth.is_empty() && self.object.is_empty() && !self.half
    }

    /// The pixels from (x, y) on of a plain tile.
    #[inline(always)]
    pub(crate) fn pixels<S: Simd>(&self, simd: S, y: usize, x: usize) -> Pixels<S> {
        let first = y * TILE + x;
        let optical_depth = Sum::load(simd, &self.optical_depth[first..], &self.excess[first..]);
        let mut values = [optical_depth; 3];
        for c in 0..3 {
            let at = c * PIXELS + first;
            values[c] = Sum::load(simd, &self.values[at..], &self.value_excess[at..]);
        }
        Pixels {
            optical_depth,
            transmittance: Lanes::load(simd, &self.transmittance[first..]),
            values,
            cutoff: simd.lanes(self.cutoff),
            below_open: simd.lanes(self.least_open().next_down()),
        }
    }

    /// Takes them back.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, y: usize, x: usize, pixels: &Pixels<S>) {
        let first = y * TILE + x;
        self.is_changed = true;
        pixels.optical_depth.store(&mut self.optical_depth[first..], &mut self.excess[first..]);
        pixels.transmittance.store(&mut self.transmittance[first..]);
        for c in 0..3 {
            let at = c * PIXELS + first;
            pixels.values[c].store(&mut self.values[at..], &mut self.value_excess[at..]);
        }
    }

    /// Closes to volumes the pixels in which all lies before a depth; `far` has the depth of what hides each, or its bounds.
    pub(crate) fn close(&mut self, far: &[f32], depth: f32) {
        for (row, far) in self.lit[1..].iter_mut().zip(far.chunks_exact(TILE)) {
            let behind = far.iter().rev().fold(0, |bits, far| bits << 1 | u64::from(*far > depth));
            *row &= behind << 1;
        }
    }

    /// Pixels where volumes may be seen, and with `rim` their neighbours.
    pub(crate) fn mask(&self, rim: bool) -> [u64; SIDE] {
        if !rim {
            return self.lit;
        }
        let row = |y: usize| self.lit.get(y).copied().unwrap_or(0);
        std::array::from_fn(|y| row(y) | row(y) << 1 | row(y) >> 1 | row(y.wrapping_sub(1)) | row(y + 1))
    }

    /// Composites the pixels from (x, y) on, and forgets those that are not seen through.
    #[inline(always)]
    pub(crate) fn composite<S: Simd>(&mut self, simd: S, y: usize, x: usize, fragments: &Fragments, origin: f64) {
        let first = y * TILE + x;
        self.is_changed = true;
        let zero = simd.lanes(0.0);
        let mut most = zero;
        for p in 0..self.planes {
            most = most.max(Lanes::load(simd, &self.transmittance[p * PIXELS + first..]));
        }
        let mut weights = [zero; 3];
        let mut before = zero;
        for p in 0..self.planes {
            let plane = p * PIXELS + first;
            let tau = zero.where_less_or(most, simd.lanes(self.cutoff), Lanes::load(simd, &fragments.optical_depth[p]));
            let through = Lanes::load(simd, &self.transmittance[plane..]);
            let opacity = tau.opacity();
            weights[p] = through * opacity;
            let sum = Lanes::load(simd, &self.optical_depth[plane..]);
            if p == self.planes / 2 {
                before = sum;
            }
            let new = add(simd, &mut self.optical_depth[plane..], &mut self.excess[plane..], tau, self.half);
            new.exp_neg().store(&mut self.transmittance[plane..]);
        }
        for c in 0..self.channels {
            let weight = weights[ChannelLayout::plane_of(c, self.channels, self.planes)];
            let channel = c * PIXELS + first;
            let term = weight * Lanes::load(simd, &fragments.values[c]);
            add(simd, &mut self.values[channel..], &mut self.value_excess[channel..], term, self.half);
        }
        if !(self.depth.is_empty() && self.object.is_empty()) {
            let mut nearer = [0.0; MAX_LANES];
            before.store(&mut nearer);
            self.extras(first, &nearer, Lanes::<S>::COUNT, fragments, origin);
        }
    }

    /// Depths and objects, pixel by pixel.
    fn extras(&mut self, first: usize, before: &[f32; MAX_LANES], count: usize, fragments: &Fragments, origin: f64) {
        for lane in 0..count {
            let k = first + lane;
            let after = self.optical_depth[self.planes / 2 * PIXELS + first + lane];
            if after <= before[lane] {
                continue;
            }
            if let Some(depth) = self.depth.get_mut(k) {
                let near = f64::from(fragments.near[lane]);
                let far = f64::from(fragments.far[lane]);
                let thickness = (far - near) as f32;
                let middle = (origin + 0.5 * (near + far)) as f32;
                depth.add(&DepthFragment { depth: middle, thickness, narrow: 1.0, before: before[lane], after });
            }
            if let Some(object) = self.object.get_mut(k).filter(|o| **o == u32::MAX) {
                *object = fragments.object[lane];
            }
        }
    }
}
