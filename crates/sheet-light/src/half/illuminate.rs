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

use super::frame::Frame;
use super::light_buffer::LightBuffer;
use super::light_path::{BENDS, LightPath, Places, Ways, stored};
use super::sheet::is_any;
use super::soft_buffer::Soft;
use super::splat_light::SplatLight;
use crate::Volume;
use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};

/// What neighbouring pixels ask of the light.
pub(crate) struct Asked<'a, S: Simd> {
    /// Slab coordinates of the ends of each ray's part in the slab, that nearer to the eye first.
    pub(crate) ends: [Places<S>; 2],
    /// Extinction that is seen in the slab, by volume.
    pub(crate) extinction: &'a [[f32; MAX_LANES]],
    /// Optical depth of the part, by plane.
    pub(crate) optical_depth: &'a [[f32; MAX_LANES]; 3],
    /// How much of the part each point of the light reaches, ray by ray, where polygons keep some of it from some of them; all 0 for a ray that
    /// they do not.
    pub(crate) lit: &'a [f32],
}

/// The place at a share of the way between the ends.
#[inline(always)]
fn between<S: Simd>(asked: &Asked<'_, S>, share: Lanes<S>) -> Places<S> {
    let [nearer, farther] = &asked.ends;
    let mut out = *nearer;
    for a in 0..3 {
        out[a] = (farther[a] - nearer[a]).mul_add(share, nearer[a]);
    }
    out
}

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
    /// Mean transmittance towards the light, by plane, for pixels of which `wanted` is above 0.
    #[inline(always)]
    pub(crate) fn transmittance<S: Simd>(
        &self,
        simd: S,
        asked: &Asked<'_, S>,
        wanted: &[f32; MAX_LANES],
        planes: usize,
    ) -> [[f32; MAX_LANES]; 3] {
        let of = |v: f32| Lanes::splat(simd, v);
        let [nearer, farther] = &asked.ends;
        let middle = between(asked, of(0.5));
        let soft = self.buffer.soft.as_ref().map(|soft| soft.at(simd, &middle, wanted, asked.lit));
        let mut optical = [[of(0.0); NODES]; 3];
        let mut bends = [of(1.0); BENDS];
        let mut is_bent = of(0.0);
        for v in 0..self.volumes.len() {
            let mean = self.means(simd, v, &middle, asked.extinction, wanted);
            let ways = [self.paths[v].ways(simd, nearer, self.face), self.paths[v].ways(simd, farther, self.face)];
            let own = Lanes::load(simd, &asked.extinction[v]);
            let ends = [ways[0].optical_depth(simd, mean, own), ways[1].optical_depth(simd, mean, own)];
            self.add(simd, (&ways[0], mean, own), &soft, [v, 0], &mut optical);
            self.add(simd, (&ways[1], mean, own), &soft, [v, NODES - 1], &mut optical);
            // The first volume that is seen and bends decides.
            let (at, does) = ways[0].bends(simd, &ways[1]);
            let mut does = does.where_less(of(0.0), own);
            if self.paths[v].lamp.is_some() || self.volumes.len() > 1 {
                let half = self.paths[v].ways(simd, &middle, self.face).optical_depth(simd, mean, own);
                let line = (ends[0] + ends[1]) * of(0.5);
                does = does.max(of(1.0).where_less(of(CURVED), (half - line).abs()));
            }
            for n in 0..BENDS {
                bends[n] = at[n].where_less_or(is_bent, does, bends[n]);
            }
            is_bent = is_bent.max(does);
        }
        if is_any(is_bent) {
            self.add_bends(simd, asked, &bends, wanted, (&soft, &mut optical));
        }
        if let Some(soft) = &soft {
            for p in 0..planes {
                for node in &mut optical[p] {
                    *node = *node + soft.rest[p];
                }
            }
        }
        if let Some(splats) = self.splats {
            self.add_splats(simd, splats, &middle, wanted, (&soft, &mut optical));
        }
        let mut out = [[1.0; MAX_LANES]; 3];
        for p in 0..planes {
            let tau = Lanes::load(simd, &asked.optical_depth[p]);
            let mut mean = part(simd, tau, [optical[p][0], optical[p][NODES - 1]]);
            if is_any(is_bent) {
                mean = bent(simd, tau, &bends, &optical[p]).where_less_or(of(0.0), is_bent, mean);
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
        wanted: &[f32; MAX_LANES],
        (soft, to): (&Option<Soft<S>>, &mut [[Lanes<S>; NODES]; 3]),
    ) {
        let middle = between(asked, Lanes::splat(simd, 0.5));
        for v in 0..self.volumes.len() {
            let mean = self.means(simd, v, &middle, asked.extinction, wanted);
            let own = Lanes::load(simd, &asked.extinction[v]);
            for n in 0..BENDS {
                let ways = self.paths[v].ways(simd, &between(asked, bends[n]), self.face);
                self.add(simd, (&ways, mean, own), soft, [v, n + 1], to);
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
        wanted: &[f32; MAX_LANES],
        (soft, to): (&Option<Soft<S>>, &mut [[Lanes<S>; NODES]; 3]),
    ) {
        let places = stored(middle);
        let mut tau = [[[0.0; MAX_LANES]; 2]; 3];
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| wanted[*lane] > 0.0) {
            let at = Vec3::new(places[0][lane], places[1][lane], places[2][lane]);
            let of_each = splats.optical_depth(at, (at.z - self.face) / self.width);
            (0..3).for_each(|p| (0..2).for_each(|n| tau[p][n][lane] = of_each[p][n]));
        }
        for p in 0..3 {
            let [before, own] = [0, 1].map(|n| Lanes::load(simd, &tau[p][n]));
            let before = soft.as_ref().map_or(before, |soft| before * soft.share[p]);
            (0..NODES).for_each(|n| to[p][n] = to[p][n] + before + own);
        }
    }

    /// Adds the optical depth of a volume at a node, by plane.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        (ways, mean, own): (&Ways<S>, Lanes<S>, Lanes<S>),
        soft: &Option<Soft<S>>,
        [v, node]: [usize; 2],
        to: &mut [[Lanes<S>; NODES]; 3],
    ) {
        if !self.volumes[v].casts_shadow {
            return;
        }
        for p in 0..3 {
            let tau = match soft {
                None => ways.optical_depth(simd, mean, own),
                Some(soft) => ways.optical_depth(simd, mean * soft.share[p], own),
            };
            let share = Lanes::splat(simd, self.volumes[v].material.extinction_rgb[p]);
            to[p][node] = tau.mul_add(share, to[p][node]);
        }
    }

    /// Mean extinction of a volume on the way of light to the present slab, about each place.
    #[inline(always)]
    fn means<S: Simd>(
        &self,
        simd: S,
        v: usize,
        at: &Places<S>,
        extinction: &[[f32; MAX_LANES]],
        wanted: &[f32; MAX_LANES],
    ) -> Lanes<S> {
        let places = stored(at);
        // Where light has come no way before the slab, what is seen in it stands for what nearly does.
        let mut means = extinction[v];
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| wanted[*lane] > 0.0) {
            let at = Vec3::new(places[0][lane], places[1][lane], places[2][lane]);
            let [tau, length] = self.buffer.at(v, self.buffer.sight.pixel(at));
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
    pub(crate) of: &'a Illumination<'a>,
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
        let Self { of, frame, places, more, out } = self;
        let mut extinction = vec![[0.0; MAX_LANES]; of.volumes.len()];
        let chunks = places.chunks(Lanes::<S>::COUNT).zip(out.chunks_mut(Lanes::<S>::COUNT));
        for (chunk, (places, out)) in chunks.enumerate() {
            let (at, wanted) = lanes(simd, places);
            let mut optical = [[Lanes::splat(simd, 0.0); NODES]; 3];
            for v in 0..of.volumes.len() {
                let ways = of.paths[v].ways(simd, &at, of.face);
                let mut amidst = [0.0; MAX_LANES];
                ways.amidst(simd).store(&mut amidst);
                for (lane, place) in places.iter().enumerate() {
                    let inside = frame.world(of.paths[v].before(*place, amidst[lane]).as_dvec3());
                    extinction[v][lane] = of.volumes[v].extinction_at(inside) as f32;
                }
                let mean = of.means(simd, v, &at, &extinction, &wanted);
                let own = Lanes::load(simd, &extinction[v]);
                of.add(simd, (&ways, mean, own), &None, [v, 0], &mut optical);
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
    pub(crate) of: &'a Illumination<'a>,
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
        let Self { of, places, visible, out } = self;
        let Some(soft) = &of.buffer.soft else { return out.fill([0.0; 3]) };
        let points = visible.len() / places.len().max(1);
        let none = vec![[0.0; MAX_LANES]; of.volumes.len()];
        let one = Lanes::splat(simd, 1.0);
        let zero = Lanes::splat(simd, 0.0);
        let chunks = places.chunks(Lanes::<S>::COUNT).zip(out.chunks_mut(Lanes::<S>::COUNT));
        for (chunk, (places, out)) in chunks.enumerate() {
            let (at, wanted) = lanes(simd, places);
            let soft = soft.beside(simd, &at, &wanted, &visible[chunk * Lanes::<S>::COUNT * points..]);
            let mut optical = soft.rest;
            for (v, volume) in of.volumes.iter().enumerate().filter(|(_, v)| v.casts_shadow) {
                let mean = of.means(simd, v, &at, &none, &wanted);
                let before = of.paths[v].ways(simd, &at, of.face).optical_depth(simd, mean, zero);
                for p in 0..3 {
                    let share = (soft.share[p] - one) * Lanes::splat(simd, volume.material.extinction_rgb[p]);
                    optical[p] = before.mul_add(share, optical[p]);
                }
            }
            let share = stored(&soft.share);
            let optical = stored(&optical);
            for (lane, (place, out)) in places.iter().zip(out).enumerate() {
                let splats = of.splats.map(|splats| splats.optical_depth(*place, f32::NEG_INFINITY));
                *out = [0, 1, 2].map(|p| optical[p][lane] + splats.map_or(0.0, |tau| share[p][lane] * tau[p][0]));
            }
        }
    }
}

/// Places of neighbours, and which there are.
#[inline(always)]
fn lanes<S: Simd>(simd: S, places: &[Vec3]) -> (Places<S>, [f32; MAX_LANES]) {
    let mut at = [[0.0; MAX_LANES]; 3];
    let mut wanted = [0.0; MAX_LANES];
    for (lane, place) in places.iter().enumerate() {
        (0..3).for_each(|a| at[a][lane] = place[a]);
        wanted[lane] = 1.0;
    }
    ([Lanes::load(simd, &at[0]), Lanes::load(simd, &at[1]), Lanes::load(simd, &at[2])], wanted)
}

/// Difference to a straight line at which optical depth towards a lamp is curved.
const CURVED: f32 = 1e-4;

/// Places at which it is known: these and the ends.
const NODES: usize = BENDS + 2;

/// ∫₀¹ e^(−τx)·e^(−g−(f−g)x) dx over a part without a bend: e^(−min(g, f+τ))·φ(|τ + f − g|).
#[inline(always)]
fn part<S: Simd>(simd: S, tau: Lanes<S>, [g, f]: [Lanes<S>; 2]) -> Lanes<S> {
    let behind = f + tau;
    g.min(behind).exp_neg() * mean_of_exponential(simd, (behind - g).abs())
}

/// The same over parts that meet at the shares `bends` of the way.
#[inline(always)]
fn bent<S: Simd>(simd: S, tau: Lanes<S>, bends: &[Lanes<S>; BENDS], optical: &[Lanes<S>; NODES]) -> Lanes<S> {
    let mut sum = Lanes::splat(simd, 0.0);
    let mut from = Lanes::splat(simd, 0.0);
    for n in 0..NODES - 1 {
        let to = if n < BENDS { bends[n] } else { Lanes::splat(simd, 1.0) };
        let own = part(simd, tau * (to - from), [optical[n], optical[n + 1]]);
        sum = ((to - from) * (tau * from).exp_neg()).mul_add(own, sum);
        from = to;
    }
    sum
}

/// φ(y) = (1 − e^(−y))/y, 1 at 0.
#[inline(always)]
fn mean_of_exponential<S: Simd>(simd: S, y: Lanes<S>) -> Lanes<S> {
    let y = y.max(Lanes::splat(simd, 1e-30));
    y.opacity() / y
}
