//! Ways of light in a volume: what it comes through before it reaches a place, and where on a ray that changes.
//!
//! A volume is three pairs of faces, a slab has one more. Light that comes to a place has passed a face of each pair at a distance
//! depth/step; it is in the volume since the least of the three, and in the slab since the fourth. Planes that it is cut along are faces, too, each
//! without another side. Along a ray the quotients of two
//! faces agree where depth_i·step_k − depth_k·step_i changes sign, which is linear there, wherever the light comes from.

use crate::Volume;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::serves::travel;
use splat_core::Light;
use splat_core::glam::{DVec3, Mat3, Vec3};
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Share of the steepest direction below which light is parallel to a pair of faces.
const PARALLEL: f32 = 1e-6;

/// How far outside of parallel faces a place is still inside, cells.
const ROUNDING: f32 = 1e-4;

/// Farther than anything.
const FAR: f32 = 1e30;

/// The ways of light in one volume, a parallelepiped in lattice coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LightPath {
    /// Lattice from slab coordinates.
    start: Vec3,
    steps: Mat3,
    lowest: Vec3,
    highest: Vec3,
    /// Planes that it is cut along, in lattice coordinates: unit normals that lead out, and their products with the border.
    planes: Vec<(Vec3, f32)>,
    /// Lattice steps per unit of length, for directional light.
    direction: Vec3,
    /// Slab coordinates per unit of length, for directional light.
    travel: Vec3,
    /// Slab and lattice coordinates of a lamp.
    pub(crate) lamp: Option<[Vec3; 2]>,
}

/// Slab coordinates of neighbouring pixels.
pub(crate) type Places<S> = [Lanes<S>; 3];

/// The ends of each ray's part in a slab.
#[derive(Clone, Copy)]
pub(crate) struct RayEnds<S: Simd> {
    /// To the eye.
    pub(crate) nearer: Places<S>,
    pub(crate) farther: Places<S>,
}

impl<S: Simd> RayEnds<S> {
    /// The places at a share of the way from the nearer ends to the farther ones.
    #[inline(always)]
    pub(crate) fn place(&self, share: Lanes<S>) -> Places<S> {
        let Self { nearer, farther } = self;
        let mut out = *nearer;
        for a in 0..3 {
            out[a] = (farther[a] - nearer[a]).mul_add(share, nearer[a]);
        }
        out
    }
}

/// Three numbers a pixel, lane by lane.
#[inline(always)]
pub(crate) fn stored<S: Simd>(lanes: &[Lanes<S>; 3]) -> [[f32; MAX_LANES]; 3] {
    let mut out = [[0.0; MAX_LANES]; 3];
    for a in 0..3 {
        lanes[a].store(&mut out[a]);
    }
    out
}

impl LightPath {
    pub(crate) fn new(volume: &Volume<'_>, light: &Light, frame: &Frame) -> Self {
        let inverse = volume.axes().inverse();
        let lattice = |world: DVec3| inverse * (world - volume.origin());
        let start = lattice(frame.world(DVec3::ZERO));
        let steps = frame.steps(volume).inverse();
        let direction = travel(light, frame.world(DVec3::ZERO));
        let lamp = light.shape.place();
        Self {
            start: start.as_vec3(),
            steps: steps.as_mat3(),
            lowest: volume.ends()[0].as_vec3(),
            highest: volume.ends()[1].as_vec3(),
            planes: volume.planes().map(|(normal, offset)| (normal.as_vec3(), offset as f32)).collect(),
            direction: (inverse * direction).as_vec3(),
            travel: frame.direction(direction).as_vec3(),
            lamp: lamp.map(|p| [frame.point(p).as_vec3(), lattice(p).as_vec3()]),
        }
    }

    /// The place that light passes so far before it comes to a place; slab coordinates.
    pub(crate) fn before(&self, place: Vec3, distance: f32) -> Vec3 {
        let travel = self.lamp.map_or(self.travel, |[lamp, _]| (place - lamp).normalize_or_zero());
        place - travel * distance
    }

    /// The ways of light in the volume up to each place, of which the slab begins at depth `face`.
    #[inline(always)]
    pub(crate) fn ways<S: Simd>(&self, simd: S, places: &Places<S>, face: f32) -> Ways<S> {
        let zero = simd.lanes(0.0);
        let tiny = simd.lanes(PARALLEL);
        // No closures around vectors: what is vectorised must be inlined.
        let mut here = [zero; 3];
        for a in 0..3 {
            let row = self.steps.row(a);
            here[a] = simd.lanes(row.x).mul_add(
                places[0],
                simd.lanes(row.y).mul_add(places[1], simd.lanes(row.z).mul_add(places[2], simd.lanes(self.start[a]))),
            );
        }
        let (length, towards, across) = self.ray(simd, places, &here);
        let steepest = towards[0].abs().max(towards[1].abs()).max(towards[2].abs());
        let mut enters = [simd.lanes(FAR); FACES];
        let mut leaves = zero;
        let mut depths = [zero; FACES];
        let mut steps = [zero; FACES];
        for a in 0..3 {
            let above = here[a] - simd.lanes(self.lowest[a]);
            let below = simd.lanes(self.highest[a]) - here[a];
            let rate = length / towards[a].abs().max(tiny * steepest);
            let is_parallel = [towards[a].abs(), tiny * steepest];
            let inside = simd.lanes(FAR).where_less_or(simd.lanes(-ROUNDING), above.min(below), simd.lanes(-FAR));
            (depths[a], steps[a]) = (above.where_less_or(zero, towards[a], below), towards[a].abs());
            let leave = (zero - below.where_less_or(zero, towards[a], above)) * rate;
            enters[a] = inside.where_less_or(is_parallel[0], is_parallel[1], depths[a] * rate);
            leaves = leaves.max(zero.where_less_or(is_parallel[0], is_parallel[1], leave));
        }
        let mut cut = simd.lanes(FAR);
        for (normal, offset) in &self.planes {
            let mut depth = simd.lanes(*offset);
            let mut step = zero;
            for a in 0..3 {
                depth = depth - simd.lanes(normal[a]) * here[a];
                step = simd.lanes(normal[a]).mul_add(towards[a], step);
            }
            let along = step.abs();
            let flat = tiny * steepest;
            let distance = depth * (length / along.max(flat));
            let enter = distance.where_less_or(step, zero, simd.lanes(FAR));
            let inside = simd.lanes(FAR).where_less_or(simd.lanes(-ROUNDING), depth, simd.lanes(-FAR));
            let leave = (zero - distance).where_less(zero, step);
            cut = cut.min(inside.where_less_or(along, flat, enter));
            leaves = leaves.max(zero.where_less_or(along, flat, leave));
        }
        (depths[SLAB], steps[SLAB]) = ((places[2] - simd.lanes(face)).max(zero), across);
        enters[SLAB] = depths[SLAB] * length / across;
        Ways { enters, cut, depths, steps, leaves }
    }

    /// Of the light's ray to each place: a length, the lattice steps on it, and the depth across the slabs.
    #[inline(always)]
    fn ray<S: Simd>(&self, simd: S, places: &Places<S>, here: &Places<S>) -> (Lanes<S>, Places<S>, Lanes<S>) {
        let [x, y, z] = self.direction.to_array();
        let Some([slab, lattice]) = self.lamp else {
            return (simd.lanes(1.0), [simd.lanes(x), simd.lanes(y), simd.lanes(z)], simd.lanes(self.travel.z));
        };
        let mut from = [simd.lanes(0.0); 3];
        let mut towards = [simd.lanes(0.0); 3];
        for a in 0..3 {
            (from[a], towards[a]) = (places[a] - simd.lanes(slab[a]), here[a] - simd.lanes(lattice[a]));
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
const PAIRS: [FacePair; 6] = [
    FacePair { first: 0, second: 1 },
    FacePair { first: 0, second: 2 },
    FacePair { first: 0, second: SLAB },
    FacePair { first: 1, second: 2 },
    FacePair { first: 1, second: SLAB },
    FacePair { first: 2, second: SLAB },
];

/// Two of the faces that light comes through.
#[derive(Clone, Copy)]
struct FacePair {
    first: usize,
    second: usize,
}

/// Places within a ray's part in a slab at which optical depth towards the light may bend, and three between, for it is curved
/// where light of a lamp grazes a face.
pub(crate) const BENDS: usize = PAIRS.len() + 3;

/// Distances back to where light comes through faces.
#[derive(Clone, Copy)]
pub(crate) struct Ways<S: Simd> {
    /// Light is in the volume once it has come through a face of each pair.
    enters: [Lanes<S>; FACES],
    /// And through the planes that the volume is cut along.
    cut: Lanes<S>,
    /// How far behind each face a place is, and how far light comes towards it on a way of one length for all.
    depths: [Lanes<S>; FACES],
    steps: [Lanes<S>; FACES],
    /// Where light leaves the volume before this place, else 0.
    leaves: Lanes<S>,
}

impl<S: Simd> Ways<S> {
    #[inline(always)]
    fn entered(&self) -> Lanes<S> {
        self.enters[0].min(self.enters[1]).min(self.enters[2]).min(self.cut)
    }

    /// How much later light comes through the first face of a pair than through the other, times both steps.
    #[inline(always)]
    fn lead(&self, pair: FacePair) -> Lanes<S> {
        let FacePair { first: i, second: k } = pair;
        self.depths[i] * self.steps[k] - self.depths[k] * self.steps[i]
    }

    /// Length of the way in the volume before the slab, and within it.
    #[inline(always)]
    fn lengths(&self, simd: S) -> [Lanes<S>; 2] {
        let zero = simd.lanes(0.0);
        let in_slab = self.enters[SLAB];
        let before = (self.entered() - self.leaves.max(in_slab)).max(zero);
        [before, (self.entered().min(in_slab) - self.leaves).max(zero)]
    }

    /// How far before a place light is amidst its way through the volume in the slab.
    #[inline(always)]
    pub(crate) fn amidst(&self, simd: S) -> Lanes<S> {
        let [_, length] = self.lengths(simd);
        length.mul_add(simd.lanes(0.5), self.leaves)
    }

    /// Optical depth towards the light, of one extinction before the slab and another within it.
    #[inline(always)]
    pub(crate) fn optical_depth(&self, simd: S, before: Lanes<S>, within: Lanes<S>) -> Lanes<S> {
        let lengths = self.lengths(simd);
        before.mul_add(lengths[0], within * lengths[1])
    }

    /// Where between this place and another the faces that light comes through last may change, as shares of the way,
    /// ascending; and 1 where they do, else 0.
    #[inline(always)]
    pub(crate) fn bends(&self, simd: S, other: &Self) -> ([Lanes<S>; BENDS], Lanes<S>) {
        let zero = simd.lanes(0.0);
        let one = simd.lanes(1.0);
        let here = self.entered();
        let there = other.entered();
        // No face of the volume is the last one at both places, or only at one of them light comes into the slab later.
        let mut does = one.where_less(here, self.cut).max(one.where_less(there, other.cut));
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
            bends[n] = simd.lanes((n + 1 - PAIRS.len()) as f32 / (BENDS + 1 - PAIRS.len()) as f32);
        }
        for n in 1..BENDS {
            for k in (0..n).rev() {
                (bends[k], bends[k + 1]) = (bends[k].min(bends[k + 1]), bends[k].max(bends[k + 1]));
            }
        }
        (bends, does)
    }
}
