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
use super::serves::travel;
use super::sheet::is_any;
use crate::Volume;
use splat_core::Light;
use splat_core::glam::{DVec3, Mat3, Vec3};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Share of the steepest direction below which light is parallel to a pair of faces.
const PARALLEL: f32 = 1e-6;

/// How far outside of parallel faces a place is still inside, cells.
const ROUNDING: f32 = 1e-4;

/// Farther than anything.
const FAR: f32 = 1e30;

/// The ways of light in one volume, a parallelepiped in lattice coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightPath {
    /// Lattice from slab coordinates.
    start: Vec3,
    steps: Mat3,
    highest: Vec3,
    /// Lattice steps per unit of length, for directional light.
    direction: Vec3,
    /// Depth across the slabs per unit of length, for directional light.
    across: f32,
    /// Slab and lattice coordinates of a lamp.
    lamp: Option<[Vec3; 2]>,
}

/// Slab coordinates of neighbouring pixels.
pub(crate) type Places<S> = [Lanes<S>; 3];

impl LightPath {
    pub(crate) fn new(volume: &Volume<'_>, light: &Light, frame: &Frame) -> Self {
        let inverse = volume.grid.axes.inverse();
        let lattice = |world: DVec3| inverse * (world - volume.grid.origin);
        let start = lattice(frame.world(DVec3::ZERO));
        let steps = frame.steps(volume).inverse();
        let direction = travel(light, frame.world(DVec3::ZERO));
        let lamp = light.shape.place();
        Self {
            start: start.as_vec3(),
            steps: steps.as_mat3(),
            highest: Vec3::from_array(volume.grid.dims.map(|n| n as f32 - 0.5)),
            direction: (inverse * direction).as_vec3(),
            across: frame.direction(direction).z as f32,
            lamp: lamp.map(|p| [frame.point(p).as_vec3(), lattice(p).as_vec3()]),
        }
    }

    /// The ways of light in the volume up to each place, of which the slab begins at depth `face`.
    #[inline(always)]
    fn ways<S: Simd>(&self, simd: S, at: &Places<S>, face: f32) -> Ways<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        let (zero, tiny) = (of(0.0), of(PARALLEL));
        // No closures around vectors: what is vectorised must be inlined.
        let mut here = [zero; 3];
        for a in 0..3 {
            let row = self.steps.row(a);
            here[a] = of(row.x).mul_add(at[0], of(row.y).mul_add(at[1], of(row.z).mul_add(at[2], of(self.start[a]))));
        }
        let (length, towards, across) = self.ray(simd, at, &here);
        let steepest = towards[0].abs().max(towards[1].abs()).max(towards[2].abs());
        let (mut enters, mut leaves, mut depths, mut steps) = ([of(FAR); FACES], zero, [zero; FACES], [zero; FACES]);
        for a in 0..3 {
            let (above, below) = (here[a] - of(-0.5), of(self.highest[a]) - here[a]);
            let rate = length / towards[a].abs().max(tiny * steepest);
            let is_parallel = [towards[a].abs(), tiny * steepest];
            let inside = of(FAR).where_less_or(of(-ROUNDING), above.min(below), of(-FAR));
            (depths[a], steps[a]) = (above.where_less_or(zero, towards[a], below), towards[a].abs());
            let leave = (zero - below.where_less_or(zero, towards[a], above)) * rate;
            enters[a] = inside.where_less_or(is_parallel[0], is_parallel[1], depths[a] * rate);
            leaves = leaves.max(zero.where_less_or(is_parallel[0], is_parallel[1], leave));
        }
        (depths[SLAB], steps[SLAB]) = ((at[2] - of(face)).max(zero), across);
        enters[SLAB] = depths[SLAB] * length / across;
        Ways { enters, depths, steps, leaves }
    }

    /// Of the light's ray to each place: a length, the lattice steps on it, and the depth across the slabs.
    #[inline(always)]
    fn ray<S: Simd>(&self, simd: S, at: &Places<S>, here: &Places<S>) -> (Lanes<S>, Places<S>, Lanes<S>) {
        let of = |v: f32| Lanes::splat(simd, v);
        let [x, y, z] = self.direction.to_array();
        let Some([slab, lattice]) = self.lamp else {
            return (of(1.0), [of(x), of(y), of(z)], of(self.across));
        };
        let (mut from, mut towards) = ([of(0.0); 3], [of(0.0); 3]);
        for a in 0..3 {
            (from[a], towards[a]) = (at[a] - of(slab[a]), here[a] - of(lattice[a]));
        }
        let length = from[0].mul_add(from[0], from[1].mul_add(from[1], from[2] * from[2])).sqrt();
        (length, towards, from[2])
    }
}

/// What light comes through on its way to a place: a face of each pair of a volume's, and the slab's.
const FACES: usize = 4;

/// Place of the slab's face among them.
const SLAB: usize = 3;

/// Pairs of them.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, SLAB], [1, 2], [1, SLAB], [2, SLAB]];

/// Distances back to where light comes through faces.
#[derive(Clone, Copy)]
struct Ways<S: Simd> {
    /// Light is in the volume once it has come through a face of each pair.
    enters: [Lanes<S>; FACES],
    /// How far behind each face a place is, and how far light comes towards it on a way of one length for all.
    depths: [Lanes<S>; FACES],
    steps: [Lanes<S>; FACES],
    /// Where light leaves the volume before this place, else 0.
    leaves: Lanes<S>,
}

impl<S: Simd> Ways<S> {
    #[inline(always)]
    fn entered(&self) -> Lanes<S> {
        self.enters[0].min(self.enters[1]).min(self.enters[2])
    }

    /// How much later light comes through the first face of a pair than through the other, times both steps.
    #[inline(always)]
    fn lead(&self, [i, k]: [usize; 2]) -> Lanes<S> {
        self.depths[i] * self.steps[k] - self.depths[k] * self.steps[i]
    }

    /// Length of the way in the volume before the slab, and within it.
    #[inline(always)]
    fn lengths(&self, simd: S) -> [Lanes<S>; 2] {
        let (zero, own) = (Lanes::splat(simd, 0.0), self.enters[SLAB]);
        let before = (self.entered() - self.leaves.max(own)).max(zero);
        [before, (self.entered().min(own) - self.leaves).max(zero)]
    }

    /// Optical depth towards the light, of one extinction before the slab and another within it.
    #[inline(always)]
    fn optical_depth(&self, simd: S, before: Lanes<S>, within: Lanes<S>) -> Lanes<S> {
        let lengths = self.lengths(simd);
        before.mul_add(lengths[0], within * lengths[1])
    }

    /// Where between this place and another the faces that light comes through last may change, as shares of the way,
    /// ascending; and 1 where they do, else 0.
    #[inline(always)]
    fn bends(&self, simd: S, other: &Self) -> ([Lanes<S>; BENDS], Lanes<S>) {
        let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let (here, there) = (self.entered(), other.entered());
        // No face of the volume is the last one at both places, or only at one of them light comes into the slab later.
        let mut does = one;
        for f in 0..SLAB {
            does = does.min(one.where_less(here, self.enters[f]).max(one.where_less(there, other.enters[f])));
        }
        let inside = [one.where_less(self.enters[SLAB], here), one.where_less(other.enters[SLAB], there)];
        does = does.max((inside[0] - inside[1]).abs());
        // Where depth_i/step_i − depth_k/step_k changes sign: times both steps it is linear, from wherever light comes.
        let mut bends = [one; BENDS];
        for (bend, pair) in bends.iter_mut().zip(PAIRS) {
            let lead = self.lead(pair);
            let change = lead - other.lead(pair);
            *bend = (lead / change.where_less_or(zero, change.abs(), one)).max(zero).min(one);
        }
        for n in PAIRS.len()..BENDS {
            bends[n] = Lanes::splat(simd, (n + 1 - PAIRS.len()) as f32 / (BENDS + 1 - PAIRS.len()) as f32);
        }
        for n in 1..BENDS {
            for k in (0..n).rev() {
                (bends[k], bends[k + 1]) = (bends[k].min(bends[k + 1]), bends[k].max(bends[k + 1]));
            }
        }
        (bends, does)
    }
}

/// What neighbouring pixels ask of the light.
pub(crate) struct Asked<'a, S: Simd> {
    /// Slab coordinates of the ends of each ray's part in the slab, that nearer to the eye first.
    pub(crate) ends: [Places<S>; 2],
    /// Extinction that is seen in the slab, by volume.
    pub(crate) extinction: &'a [[f32; MAX_LANES]],
    /// Optical depth of the part, by plane.
    pub(crate) optical_depth: &'a [[f32; MAX_LANES]; 3],
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
    /// Near face of the slab.
    pub(crate) face: f32,
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
        let (mut optical, mut bends, mut is_bent) = ([[of(0.0); NODES]; 3], [of(1.0); BENDS], of(0.0));
        for v in 0..self.volumes.len() {
            let mean = self.means(simd, v, &middle, asked.extinction, wanted);
            let ways = [self.paths[v].ways(simd, nearer, self.face), self.paths[v].ways(simd, farther, self.face)];
            let own = Lanes::load(simd, &asked.extinction[v]);
            let ends = [ways[0].optical_depth(simd, mean, own), ways[1].optical_depth(simd, mean, own)];
            self.add(simd, ends[0], v, 0, &mut optical);
            self.add(simd, ends[1], v, NODES - 1, &mut optical);
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
            self.add_bends(simd, asked, &bends, wanted, &mut optical);
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
        to: &mut [[Lanes<S>; NODES]; 3],
    ) {
        let middle = between(asked, Lanes::splat(simd, 0.5));
        for v in 0..self.volumes.len() {
            let mean = self.means(simd, v, &middle, asked.extinction, wanted);
            let own = Lanes::load(simd, &asked.extinction[v]);
            for n in 0..BENDS {
                let ways = self.paths[v].ways(simd, &between(asked, bends[n]), self.face);
                self.add(simd, ways.optical_depth(simd, mean, own), v, n + 1, to);
            }
        }
    }

    /// Adds the optical depth of a volume at a node, by plane.
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, tau: Lanes<S>, v: usize, node: usize, to: &mut [[Lanes<S>; NODES]; 3]) {
        for p in 0..3 {
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
        let mut places = [[0.0; MAX_LANES]; 3];
        for a in 0..3 {
            at[a].store(&mut places[a]);
        }
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

/// Places within a ray's part in a slab at which optical depth towards the light may bend, and three between, for it is curved
/// where light of a lamp grazes a face.
const BENDS: usize = PAIRS.len() + 3;

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
    let (mut sum, mut from) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 0.0));
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
