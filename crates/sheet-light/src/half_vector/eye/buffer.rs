//! The eye's image: what is composited so far in a band, front to back or back to front (step 20 of the pseudocode).
//!
//! Front to back: weight = T·(1 − e^(−τ)), C ← C + weight·L, T = e^(−Στ). Back to front: C ← (1 − e^(−τ))·L + e^(−τ)·C. Optical
//! depth and radiance are summed with their rounding errors kept (Kahan), whichever way, so alpha does not know the order, and what many
//! thin slabs add is not too little to be added.

use crate::half_vector::slicing::band::Band;
use crate::shared::pixel::PixelForm;
use crate::shared::sums::add;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use splat_core::{Accumulator, DepthFragment, DepthProfile};

/// What neighbouring pixels have of one slab.
#[derive(Debug, Clone)]
pub(crate) struct Fragments {
    /// Optical depth by plane.
    pub(crate) optical_depth: [[f32; MAX_LANES]; 3],
    /// Radiance and the other channels.
    pub(crate) values: [[f32; MAX_LANES]; MAX_CHANNELS],
    pub(crate) object: [u32; MAX_LANES],
}

impl Fragments {
    pub(crate) const NONE: Self = Self {
        optical_depth: [[0.0; MAX_LANES]; 3],
        values: [[0.0; MAX_LANES]; MAX_CHANNELS],
        object: [u32::MAX; MAX_LANES],
    };
}

/// The pixels of a band; planes as those of the band.
#[derive(Debug, Clone)]
pub(crate) struct Pixels {
    pub(crate) planes: usize,
    pub(crate) channels: usize,
    optical_depth: Vec<Vec<f32>>,
    /// What the sums of optical depth are too large by.
    excess: Vec<Vec<f32>>,
    transmittance: Vec<Vec<f32>>,
    values: Vec<Vec<f32>>,
    /// What the values are too large by.
    value_excess: Vec<Vec<f32>>,
    /// Whether sums are rounded to half precision.
    half: bool,
    pub(crate) depth: Vec<DepthProfile>,
    pub(crate) object: Vec<u32>,
}

impl Pixels {
    /// Nothing seen yet; whether sums are rounded to half precision.
    pub(crate) fn new(band: &Band, form: PixelForm, half: bool) -> Self {
        let n = band.stored * band.stride;
        let PixelForm { planes, channels, has_depths, has_objects } = form;
        let plane = |fill: f32| vec![fill; n];
        let has = |kept: bool| if kept { n } else { 0 };
        Self {
            planes,
            channels,
            optical_depth: vec![plane(0.0); planes],
            excess: vec![plane(0.0); planes],
            transmittance: vec![plane(1.0); planes],
            values: vec![plane(0.0); channels],
            value_excess: vec![plane(0.0); channels],
            half,
            depth: vec![DepthProfile::default(); has(has_depths)],
            object: vec![u32::MAX; has(has_objects)],
        }
    }

    /// Bytes of the planes.
    pub(crate) fn bytes(&self) -> u64 {
        let floats: usize = self.optical_depth.iter().map(|p| 3 * p.len()).sum::<usize>()
            + self.values.iter().map(|v| 2 * v.len()).sum::<usize>();
        (4 * floats + self.depth.len() * size_of::<DepthProfile>() + 4 * self.object.len()) as u64
    }

    /// The greatest transmittance of the pixels from `k` on.
    #[inline(always)]
    pub(crate) fn most<S: Simd>(&self, simd: S, k: usize) -> Lanes<S> {
        let mut most = Lanes::load(simd, &self.transmittance[0][k..]);
        for plane in &self.transmittance[1..] {
            most = most.max(Lanes::load(simd, &plane[k..]));
        }
        most
    }

    /// Whether nothing is seen through pixel `k` any more.
    #[inline]
    pub(crate) fn is_done(&self, k: usize, cutoff: f32) -> bool {
        self.transmittance.iter().all(|plane| plane[k] < cutoff)
    }

    /// Optical depth so far, green.
    #[inline(always)]
    pub(crate) fn so_far<S: Simd>(&self, simd: S, k: usize) -> Lanes<S> {
        Lanes::load(simd, &self.optical_depth[self.planes / 2][k..])
    }

    /// Puts a slab behind what is there.
    #[inline(always)]
    pub(crate) fn append<S: Simd>(&mut self, simd: S, k: usize, fragments: &Fragments) {
        let mut weights = [simd.lanes(0.0); 3];
        for p in 0..self.planes {
            let through = Lanes::load(simd, &self.transmittance[p][k..]);
            let opacity = Lanes::load(simd, &fragments.optical_depth[p]).opacity();
            weights[p] = through * opacity;
            self.sum(simd, p, k, fragments).exp_neg().store(&mut self.transmittance[p][k..]);
        }
        for c in 0..self.channels {
            let weight = weights[ChannelLayout::plane_of(c, self.channels, self.planes)];
            let term = weight * Lanes::load(simd, &fragments.values[c]);
            add(simd, &mut self.values[c][k..], &mut self.value_excess[c][k..], term, self.half);
        }
        self.add_objects(simd, k, fragments, false);
    }

    /// Puts a slab before what is there.
    #[inline(always)]
    pub(crate) fn prepend<S: Simd>(&mut self, simd: S, k: usize, fragments: &Fragments) {
        let mut weights = [simd.lanes(0.0); 3];
        for p in 0..self.planes {
            weights[p] = Lanes::load(simd, &fragments.optical_depth[p]).opacity();
            self.sum(simd, p, k, fragments);
        }
        for c in 0..self.channels {
            let weight = weights[ChannelLayout::plane_of(c, self.channels, self.planes)];
            let sum = &mut self.values[c][k..];
            let term = (Lanes::load(simd, &fragments.values[c]) - Lanes::load(simd, sum)) * weight;
            add(simd, sum, &mut self.value_excess[c][k..], term, self.half);
        }
        self.add_objects(simd, k, fragments, true);
    }

    /// Adds to the optical depth of plane `p`, which it returns.
    #[inline(always)]
    fn sum<S: Simd>(&mut self, simd: S, p: usize, k: usize, fragments: &Fragments) -> Lanes<S> {
        let term = Lanes::load(simd, &fragments.optical_depth[p]);
        add(simd, &mut self.optical_depth[p][k..], &mut self.excess[p][k..], term, self.half)
    }

    #[inline(always)]
    fn add_objects<S: Simd>(&mut self, _: S, k: usize, fragments: &Fragments, is_before: bool) {
        if self.object.is_empty() {
            return;
        }
        for lane in 0..Lanes::<S>::COUNT {
            let object = &mut self.object[k + lane];
            if fragments.optical_depth[self.planes / 2][lane] > 0.0 && (is_before || *object == u32::MAX) {
                *object = fragments.object[lane];
            }
        }
    }

    /// Adds to the depths of pixel `k` a medium of the optical depth `added` between two view depths, behind the optical depth `before`.
    pub(crate) fn add_depth(&mut self, k: usize, near: f64, far: f64, before: f32, added: f32) {
        if let Some(depth) = self.depth.get_mut(k).filter(|_| added > 0.0) {
            let middle = (0.5 * (near + far)) as f32;
            let thickness = (far - near) as f32;
            depth.add(&DepthFragment { depth: middle, thickness, narrow: 1.0, before, after: before + added });
        }
    }

    /// Mixes in a share of the optical depths and values of others.
    pub(crate) fn mix(&mut self, other: &Self, share: f32) {
        let floats = self.optical_depth.iter_mut().chain(&mut self.values).flatten();
        let others = other.optical_depth.iter().chain(&other.values).flatten();
        floats.zip(others).for_each(|(to, other)| *to += (other - *to) * share);
    }

    /// Writes the band's own rows.
    pub(crate) fn store(&self, band: &Band, to: &mut Accumulator) {
        let width = band.width;
        for row in band.rows.clone() {
            let image = row * width..(row + 1) * width;
            let from = (row - band.top) * band.stride;
            let columns = from..from + width;
            let floats = to.optical_depth.iter_mut().zip(&self.optical_depth);
            for (to, from) in floats.chain(to.channels.iter_mut().zip(&self.values)) {
                to[image.clone()].copy_from_slice(&from[columns.clone()]);
            }
            if !self.depth.is_empty() {
                to.depth[image.clone()].copy_from_slice(&self.depth[columns.clone()]);
            }
            if !self.object.is_empty() {
                to.object[image].copy_from_slice(&self.object[columns]);
            }
        }
    }

    /// Adds the first channels of the band's own rows.
    pub(crate) fn add_colors(&self, band: &Band, colors: usize, to: &mut Accumulator) {
        for row in band.rows.clone() {
            let from = (row - band.top) * band.stride;
            for (to, plane) in to.channels.iter_mut().zip(&self.values).take(colors) {
                let to = &mut to[row * band.width..][..band.width];
                to.iter_mut().zip(&plane[from..]).for_each(|(to, value)| *to += value);
            }
        }
    }
}
