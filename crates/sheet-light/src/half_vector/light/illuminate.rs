//! What arrives of the light on the way of a view ray through a slab (step 18 of the pseudocode).
//!
//! The light at a place is attenuated by the slabs before, whose mean extinction the light buffer knows, and by its own slab as
//! far as light has come in it, of the extinction that is seen there. So optical depth towards the light runs on without a step
//! from slab to slab. It is g at the end of the ray's part that is nearer to the eye and f at the other, and linear between, so
//! what the eye gets of the light that is scattered there is
//!
//! ∫₀¹ τ·e^(−τx)·e^(−g−(f−g)x) dx = τ·e^(−g)·φ(τ + f − g), φ(y) = (1 − e^(−y))/y,
//!
//! and the mean transmittance, which turns the opacity τ·φ(τ) into that, is e^(−min(g, f+τ))·φ(|τ + f − g|)/φ(τ). Seen from the
//! light itself, f − g = τ, the first slab gives (1 − e^(−2τ))/2, however wide it is. The paper takes one value a slab. Where light
//! comes into the volume, or into the slab, through one face up to some place of the part and through another from there on, optical
//! depth towards it has a bend, and the integral is that of the pieces.

use super::buffer::LightBuffer;
use super::path::{BENDS, LightPath, Places, RayEnds, Ways, stored};
use crate::Volume;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::sheet::is_any;
use crate::half_vector::soft::buffer::Soft;
use crate::half_vector::splats::light::SplatLight;
use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};

/// What neighbouring pixels ask of the light.
pub(crate) struct Asked<'a, S: Simd> {
    pub(crate) ends: RayEnds<S>,
    /// Extinction that is seen in the slab, by volume.
    pub(crate) extinction: &'a [[f32; MAX_LANES]],
    /// Optical depth of the part, by plane.
    pub(crate) optical_depth: &'a [[f32; MAX_LANES]; 3],
    /// How much of the part each point of the light reaches, ray by ray, where polygons keep some of it from some of them; all 0 for a ray that
    /// they do not.
    pub(crate) lit: &'a [f32],
}

/// The way of light through a volume to a place, and the extinctions on it.
struct VolumeWay<'a, S: Simd> {
    ways: &'a Ways<S>,
    /// Mean extinction before the slab.
    before: Lanes<S>,
    /// Extinction within it.
    within: Lanes<S>,
}

/// Optical depth towards the light at each node of a ray's part, by plane.
type NodeDepths<S> = [[Lanes<S>; NODES]; 3];

/// The light of one sweep as it arrives at a slab.
pub(crate) struct Illumination<'a> {
    pub(crate) buffer: &'a LightBuffer,
    pub(crate) paths: &'a [LightPath],
    pub(crate) volumes: &'a [Volume<'a>],
    /// Splats before the volumes, and among them.
    pub(crate) splats: Option<&'a SplatLight<'a>>,
    /// Near face of the slab.
    pub(crate) face: f32,
    /// Width of the slabs.
    pub(crate) width: f32,
}

impl Illumination<'_> {
    /// Mean transmittance towards the light, by plane, for pixels of which `is_wanted` is above 0.
    #[inline(always)]
    pub(crate) fn transmittance<S: Simd>(
        &self,
        simd: S,
        asked: &Asked<'_, S>,
        is_wanted: &[f32; MAX_LANES],
        planes: usize,
    ) -> [[f32; MAX_LANES]; 3] {
        let RayEnds { nearer, farther } = &asked.ends;
        let middle = asked.ends.place(simd.lanes(0.5));
        let mut soft = None;
        if let Some(buffer) = &self.buffer.soft {
            soft = Some(buffer.in_slab(simd, &middle, is_wanted, asked.lit));
        }
        let mut optical = [[simd.lanes(0.0); NODES]; 3];
        let mut bends = [simd.lanes(1.0); BENDS];
        let mut is_bent = simd.lanes(0.0);
        for v in 0..self.volumes.len() {
            let mean = self.means(simd, v, &middle, asked.extinction, is_wanted);
            let ways = [self.paths[v].ways(simd, nearer, self.face), self.paths[v].ways(simd, farther, self.face)];
            let within = Lanes::load(simd, &asked.extinction[v]);
            let ends = [ways[0].optical_depth(simd, mean, within), ways[1].optical_depth(simd, mean, within)];
            self.add(simd, v, 0, &VolumeWay { ways: &ways[0], before: mean, within }, &soft, &mut optical);
            self.add(simd, v, NODES - 1, &VolumeWay { ways: &ways[1], before: mean, within }, &soft, &mut optical);
            // The first volume that is seen and bends decides.
            let (at, does) = ways[0].bends(simd, &ways[1]);
            let mut does = does.where_less(simd.lanes(0.0), within);
            if self.paths[v].lamp.is_some() || self.volumes.len() > 1 {
                let half = self.paths[v].ways(simd, &middle, self.face).optical_depth(simd, mean, within);
                let line = (ends[0] + ends[1]) * simd.lanes(0.5);
                does = does.max(simd.lanes(1.0).where_less(simd.lanes(CURVED), (half - line).abs()));
            }
            for n in 0..BENDS {
                bends[n] = at[n].where_less_or(is_bent, does, bends[n]);
            }
            is_bent = is_bent.max(does);
        }
        if is_any(is_bent) {
            self.add_bends(simd, asked, &bends, is_wanted, &soft, &mut optical);
        }
        if let Some(soft) = &soft {
            for p in 0..planes {
                for node in &mut optical[p] {
                    *node = *node + soft.rest[p];
                }
            }
        }
        if let Some(splats) = self.splats {
            self.add_splats(simd, splats, &middle, is_wanted, &soft, &mut optical);
        }
        let mut out = [[1.0; MAX_LANES]; 3];
        for p in 0..planes {
            let tau = Lanes::load(simd, &asked.optical_depth[p]);
            let mut mean = part(simd, tau, optical[p][0], optical[p][NODES - 1]);
            if is_any(is_bent) {
                mean = bent(simd, tau, &bends, &optical[p]).where_less_or(simd.lanes(0.0), is_bent, mean);
            }
            (mean / mean_of_exponential(simd, tau)).store(&mut out[p]);
        }
        out
    }

    /// Adds the optical depths at bends.
    #[inline(always)]
    fn add_bends<S: Simd>(
        &self,
        simd: S,
        asked: &Asked<'_, S>,
        bends: &[Lanes<S>; BENDS],
        is_wanted: &[f32; MAX_LANES],
        soft: &Option<Soft<S>>,
        to: &mut NodeDepths<S>,
    ) {
        let middle = asked.ends.place(simd.lanes(0.5));
        for v in 0..self.volumes.len() {
            let mean = self.means(simd, v, &middle, asked.extinction, is_wanted);
            let within = Lanes::load(simd, &asked.extinction[v]);
            for n in 0..BENDS {
                let ways = self.paths[v].ways(simd, &asked.ends.place(bends[n]), self.face);
                self.add(simd, v, n + 1, &VolumeWay { ways: &ways, before: mean, within }, soft, to);
            }
        }
    }

    /// Adds what splats have about the middle.
    #[inline(always)]
    fn add_splats<S: Simd>(
        &self,
        simd: S,
        splats: &SplatLight<'_>,
        middle: &Places<S>,
        is_wanted: &[f32; MAX_LANES],
        soft: &Option<Soft<S>>,
        to: &mut NodeDepths<S>,
    ) {
        let places = stored(middle);
        let mut tau = [[[0.0; MAX_LANES]; 2]; 3];
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| is_wanted[*lane] > 0.0) {
            let place = Vec3::new(places[0][lane], places[1][lane], places[2][lane]);
            let of_each = splats.optical_depth(place, (place.z - self.face) / self.width);
            (0..3).for_each(|p| (0..2).for_each(|n| tau[p][n][lane] = of_each[p][n]));
        }
        for p in 0..3 {
            let mut before = Lanes::load(simd, &tau[p][0]);
            let within = Lanes::load(simd, &tau[p][1]);
            if let Some(soft) = soft {
                before = before * soft.share[p];
            }
            for node in &mut to[p] {
                *node = *node + before + within;
            }
        }
    }

    /// Adds the optical depth of a volume at a node, by plane.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        v: usize,
        node: usize,
        way: &VolumeWay<'_, S>,
        soft: &Option<Soft<S>>,
        to: &mut NodeDepths<S>,
    ) {
        if !self.volumes[v].casts_shadow {
            return;
        }
        for p in 0..3 {
            let tau = match soft {
                None => way.ways.optical_depth(simd, way.before, way.within),
                Some(soft) => way.ways.optical_depth(simd, way.before * soft.share[p], way.within),
            };
            let share = simd.lanes(self.volumes[v].material.extinction_rgb[p]);
            to[p][node] = tau.mul_add(share, to[p][node]);
        }
    }

    /// Mean extinction of a volume on the way of light to the present slab, about each place.
    #[inline(always)]
    fn means<S: Simd>(
        &self,
        simd: S,
        v: usize,
        spots: &Places<S>,
        extinction: &[[f32; MAX_LANES]],
        is_wanted: &[f32; MAX_LANES],
    ) -> Lanes<S> {
        let places = stored(spots);
        // Where light has come no way before the slab, what is seen in it stands for what nearly does.
        let mut means = extinction[v];
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| is_wanted[*lane] > 0.0) {
            let spots = Vec3::new(places[0][lane], places[1][lane], places[2][lane]);
            let [tau, length] = self.buffer.look_up(v, self.buffer.sight.pixel(spots));
            if length > 0.0 {
                means[lane] = tau / length;
            }
        }
        Lanes::load(simd, &means)
    }
}

/// What volumes let through to places in a slab on the way from the light's centre, by channel, in the form that [`pulp`] compiles once per
/// instruction set.
pub(crate) struct ThroughVolumes<'a> {
    pub(crate) light: &'a Illumination<'a>,
    pub(crate) frame: &'a Frame,
    /// Slab coordinates.
    pub(crate) places: &'a [Vec3],
    /// Optical depths that are added, place by place; or nothing.
    pub(crate) more: &'a [[f32; 3]],
    pub(crate) out: &'a mut [[f32; 3]],
}

impl pulp::WithSimd for ThroughVolumes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { light, frame, places, more, out } = self;
        let mut extinction = vec![[0.0; MAX_LANES]; light.volumes.len()];
        let chunks = places.chunks(Lanes::<S>::COUNT).zip(out.chunks_mut(Lanes::<S>::COUNT));
        for (chunk, (places, out)) in chunks.enumerate() {
            let (spots, is_wanted) = lanes(simd, places);
            let mut optical = [[simd.lanes(0.0); NODES]; 3];
            for v in 0..light.volumes.len() {
                let ways = light.paths[v].ways(simd, &spots, light.face);
                let mut amidst = [0.0; MAX_LANES];
                ways.amidst(simd).store(&mut amidst);
                for (lane, place) in places.iter().enumerate() {
                    let inside = frame.world(light.paths[v].before(*place, amidst[lane]).as_dvec3());
                    extinction[v][lane] = light.volumes[v].extinction_at(inside) as f32;
                }
                let mean = light.means(simd, v, &spots, &extinction, &is_wanted);
                let within = Lanes::load(simd, &extinction[v]);
                light.add(simd, v, 0, &VolumeWay { ways: &ways, before: mean, within }, &None, &mut optical);
            }
            for p in 0..3 {
                let mut added = [0.0; MAX_LANES];
                let mut through = [0.0; MAX_LANES];
                let more = more.iter().skip(chunk * Lanes::<S>::COUNT);
                added.iter_mut().zip(more).for_each(|(added, more)| *added = more[p]);
                (optical[p][0] + Lanes::load(simd, &added)).exp_neg().store(&mut through);
                out.iter_mut().zip(through).for_each(|(out, through)| out[p] = through);
            }
        }
    }
}

/// What the extent of a light changes at places behind the slabs so far, by channel, in the form that [`pulp`] compiles once per instruction
/// set: the optical depth of what comes through volumes and splats of those slabs from all of its points, less that of the volumes alone from its
/// centre.
pub(crate) struct Around<'a> {
    pub(crate) light: &'a Illumination<'a>,
    /// Slab coordinates.
    pub(crate) places: &'a [Vec3],
    /// What polygons let through of each point of the light, place by place; or nothing.
    pub(crate) visible: &'a [f32],
    pub(crate) out: &'a mut [[f32; 3]],
}

impl pulp::WithSimd for Around<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { light, places, visible, out } = self;
        let Some(soft) = &light.buffer.soft else {
            return out.fill([0.0; 3]);
        };
        let points = visible.len() / places.len().max(1);
        let none = vec![[0.0; MAX_LANES]; light.volumes.len()];
        let one = simd.lanes(1.0);
        let zero = simd.lanes(0.0);
        let chunks = places.chunks(Lanes::<S>::COUNT).zip(out.chunks_mut(Lanes::<S>::COUNT));
        for (chunk, (places, out)) in chunks.enumerate() {
            let (spots, is_wanted) = lanes(simd, places);
            let soft = soft.beside(simd, &spots, &is_wanted, &visible[chunk * Lanes::<S>::COUNT * points..]);
            let mut optical = soft.rest;
            for (v, volume) in light.volumes.iter().enumerate().filter(|(_, v)| v.casts_shadow) {
                let mean = light.means(simd, v, &spots, &none, &is_wanted);
                let before = light.paths[v].ways(simd, &spots, light.face).optical_depth(simd, mean, zero);
                for p in 0..3 {
                    let share = (soft.share[p] - one) * simd.lanes(volume.material.extinction_rgb[p]);
                    optical[p] = before.mul_add(share, optical[p]);
                }
            }
            let share = stored(&soft.share);
            let optical = stored(&optical);
            for (lane, (place, out)) in places.iter().zip(out).enumerate() {
                let splats = light.splats.map(|splats| splats.optical_depth(*place, f32::NEG_INFINITY));
                *out = [0, 1, 2].map(|p| optical[p][lane] + splats.map_or(0.0, |tau| share[p][lane] * tau[p][0]));
            }
        }
    }
}

/// Places of neighbours, and which there are.
#[inline(always)]
fn lanes<S: Simd>(simd: S, places: &[Vec3]) -> (Places<S>, [f32; MAX_LANES]) {
    let mut spots = [[0.0; MAX_LANES]; 3];
    let mut is_wanted = [0.0; MAX_LANES];
    for (lane, place) in places.iter().enumerate() {
        (0..3).for_each(|a| spots[a][lane] = place[a]);
        is_wanted[lane] = 1.0;
    }
    ([Lanes::load(simd, &spots[0]), Lanes::load(simd, &spots[1]), Lanes::load(simd, &spots[2])], is_wanted)
}

/// Difference to a straight line at which optical depth towards a lamp is curved.
const CURVED: f32 = 1e-4;

/// Places at which it is known: these and the ends.
const NODES: usize = BENDS + 2;

/// ∫₀¹ e^(−τx)·e^(−g−(f−g)x) dx over a part without a bend: e^(−min(g, f+τ))·φ(|τ + f − g|), g at the nearer end and f at the farther one.
#[inline(always)]
fn part<S: Simd>(simd: S, tau: Lanes<S>, nearer: Lanes<S>, farther: Lanes<S>) -> Lanes<S> {
    let behind = farther + tau;
    nearer.min(behind).exp_neg() * mean_of_exponential(simd, (behind - nearer).abs())
}

/// The same over parts that meet at the shares `bends` of the way.
#[inline(always)]
fn bent<S: Simd>(simd: S, tau: Lanes<S>, bends: &[Lanes<S>; BENDS], optical: &[Lanes<S>; NODES]) -> Lanes<S> {
    let mut sum = simd.lanes(0.0);
    let mut from = simd.lanes(0.0);
    for n in 0..NODES - 1 {
        let to = if n < BENDS { bends[n] } else { simd.lanes(1.0) };
        let of_part = part(simd, tau * (to - from), optical[n], optical[n + 1]);
        sum = ((to - from) * (tau * from).exp_neg()).mul_add(of_part, sum);
        from = to;
    }
    sum
}

/// φ(y) = (1 − e^(−y))/y, 1 at 0.
#[inline(always)]
fn mean_of_exponential<S: Simd>(simd: S, y: Lanes<S>) -> Lanes<S> {
    let y = y.max(simd.lanes(1e-30));
    y.opacity() / y
}
