//! A bound of the light that anything visible can lose, before any shadow map is built, by tiles of the light's directions.
//!
//! | light | tiles | a depth |
//! |---|---|---|
//! | parallel | squares across its direction | along it |
//! | any other | squares on the faces of a cube about it | the distance |
//!
//! Every tile first learns how far behind it something receives shadows that the view may show. Each caster that begins before that adds, to all
//! tiles under its footprint, the most that its footprint has there, so no ray in a tile can have more optical depth than the tile's sum. Footprints
//! are taken as balls: one that is seen aslant, or is longer than wide, covers less. Sums are whole numbers, which know no order of threads.
//!
//! Most shadows take all light, which is the trivial bound. A pass over some splats in a few large tiles finds these first.

use super::casters::wider;
use crate::load::Loaded;
use crate::load::own::Own;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{Camera, Cloud, DAabb, Footprint, Light, LightShape, Shading, SplatKind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Splats of a task.
const CHUNK: usize = 1 << 12;
/// Splats that are looked at first.
const SAMPLES: usize = 1 << 13;
/// Large tiles along a side, for these.
const LARGE_TILES: f64 = 24.0;
/// Mean optical depth of a large tile from which on a shadow is plain.
const PLAIN: f64 = 0.5;
/// Tiles along a side of the plane or of a face.
const LEAST_TILES: f64 = 4.0;
const MOST_TILES: f64 = 192.0;
/// Width of the tiles for one object, as a share of those for all.
const FINER: f64 = 0.25;
/// Tiles by which what receives is taken to reach farther: look-ups in a shadow map interpolate between its cells. Faces of a cube reach beyond
/// their edges by as many.
const MARGIN: usize = 2;
/// Optical depth from which on everything is taken.
const OPAQUE: f64 = 16.0;
/// A unit of optical depth in the sums, which hold that of 2³⁰ opaque splats.
const UNIT: f64 = (1u64 << 29) as f64;
/// Steps of the table of a footprint's profile.
const STEPS: usize = 64;

/// What casts and what receives shadows in a loaded scene.
pub(crate) struct Probe<'a> {
    loaded: &'a Loaded,
    /// The view that receivers lie in; `None` where all count.
    view: Option<Camera>,
    profiles: Arc<[Profile]>,
    bounds: DAabb,
    casters: Casters,
}

/// What a ray loses light to.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Casters {
    /// Everything that casts shadows.
    All,
    /// What casts shadows of the object of this rank.
    Shadows(usize),
    /// What is seen of the object of this rank, as far as it may lie in the view.
    Seen(usize),
}

/// The most that a footprint has at a distance.
struct Profile {
    norm: f64,
    /// At squared distances from each step on, as shares of the squared radius.
    from: [f64; STEPS],
}

/// A ball as a light sees it.
#[derive(Clone, Copy)]
struct Ball {
    center: DVec3,
    reach: f64,
}

impl<'a> Probe<'a> {
    /// Of what the camera of the scene may see, or of everything where the picture shows light that `leaves_view`, or other views follow.
    pub(crate) fn new(loaded: &'a Loaded, leaves_view: bool) -> Self {
        let footprints = &loaded.footprints;
        let profile = |footprint: &Footprint| Profile {
            norm: footprint.norm(),
            from: std::array::from_fn(|step| footprint.profile(step as f64 / STEPS as f64)),
        };
        let splats = loaded.cloud.bounds();
        let origin = loaded.cloud.origin;
        let centers = match loaded.cloud.is_empty() {
            true => DAabb::EMPTY,
            false => DAabb::new(origin + splats.min.as_dvec3(), origin + splats.max.as_dvec3()),
        };
        let bounds = loaded.own.iter().fold(centers, |joined, native| joined.union(native.world_box()));
        Self {
            loaded,
            view: (!leaves_view).then(|| wider(&loaded.camera)),
            profiles: footprints.layers().iter().map(profile).collect(),
            bounds,
            casters: Casters::All,
        }
    }

    /// The same of other casters.
    pub(crate) fn with_casters(&self, casters: Casters) -> Self {
        Self { profiles: Arc::clone(&self.profiles), casters, ..*self }
    }

    /// A bound of the share of its light that a ray of one point of a light can lose on the way to anything that receives shadows and may be seen: 1 where
    /// some rays lose much of it.
    pub(crate) fn greatest_opacity(&self, light: &Light) -> f64 {
        let depth = self.greatest_depth(light);
        if depth >= OPAQUE { 1.0 } else { -libm::expm1(-depth) }
    }

    /// The same as an optical depth, in the channel that has most: infinite where it is large. What is [seen](Casters::Seen) hides all that lies behind
    /// it along the rays of this light, whose place is the eye's.
    pub(crate) fn greatest_depth(&self, light: &Light) -> f64 {
        let is_view = matches!(self.casters, Casters::Seen(_));
        if self.bounds.is_empty() {
            return 0.0;
        }
        if !is_view && self.is_plain(&light.shape) {
            return f64::INFINITY;
        }
        // One object has fewer splats: its tiles may be finer, and its bound nearer.
        let share = if self.casters == Casters::All { 1.0 } else { FINER };
        let tiles = Tiles::new(&light.shape, &self.bounds, share * self.mean_reach(&light.shape));
        // Nothing is behind what is nowhere.
        let nearest = if is_view { u32::MAX } else { 0 };
        let farthest: Vec<AtomicU32> = (0..tiles.count()).map(|_| AtomicU32::new(nearest)).collect();
        let receive = |ball: Ball| {
            // Rounded outwards: far from a lamp single precision is coarser than splats.
            let back = ordered(((tiles.depth(ball.center) + ball.reach) as f32).next_up());
            tiles.each_under(&ball, |tile, _| {
                farthest[tile].fetch_max(back, Ordering::Relaxed);
            });
        };
        if !is_view {
            self.each_receiver(&receive);
        }
        let farthest = tiles.widened(farthest.into_iter().map(AtomicU32::into_inner).collect());
        let is_opaque = AtomicBool::new(false);
        let sums: Vec<AtomicU64> = (0..tiles.count()).map(|_| AtomicU64::new(0)).collect();
        self.each_caster(&is_opaque, &|ball, optical_depth, profile| {
            let front = ordered(((tiles.depth(ball.center) - ball.reach) as f32).next_down());
            let per_area = (ball.reach * ball.reach).recip();
            tiles.each_under(&ball, |tile, distance_sq| {
                if front >= farthest[tile] {
                    return;
                }
                let share = profile.map_or(1.0, |profile| profile.at(distance_sq * per_area));
                let added = (optical_depth * share).min(OPAQUE);
                let before = sums[tile].fetch_add(libm::ceil(added * UNIT) as u64, Ordering::Relaxed);
                if before as f64 / UNIT + added >= OPAQUE {
                    is_opaque.store(true, Ordering::Relaxed);
                }
            });
        });
        if is_opaque.into_inner() {
            return f64::INFINITY;
        }
        let most = sums.into_iter().map(AtomicU64::into_inner).max().unwrap_or(0);
        most as f64 / UNIT
    }

    /// Whether some splats tell that a shadow is plain: the mean optical depth before a receiver in a large tile is more than a half.
    fn is_plain(&self, shape: &LightShape) -> bool {
        let tiles = Tiles::large(shape, &self.bounds);
        let cloud = &self.loaded.cloud;
        let step = cloud.len().div_ceil(SAMPLES).max(1);
        let samples = || (0..cloud.len()).step_by(step);
        let mut farthest = vec![f64::NEG_INFINITY; tiles.count()];
        for ball in samples().filter(|i| self.receives(*i)).map(|i| self.ball(i)).filter(|ball| self.may_be_seen(ball))
        {
            let (tile, _) = tiles.of_center(ball.center);
            farthest[tile] = farthest[tile].max(tiles.depth(ball.center));
        }
        let mut sums = vec![0.0; tiles.count()];
        for i in samples().filter(|i| self.casts(*i)) {
            let ball = self.ball(i);
            let (tile, area) = tiles.of_center(ball.center);
            if tiles.depth(ball.center) < farthest[tile] {
                let extinction = self.loaded.materials[cloud.material[i] as usize].greatest_extinction();
                let cross_section = match cloud.kind[i] {
                    SplatKind::Opaque => f64::from(Footprint::CORE * cloud.radius[i]).powi(2),
                    _ => f64::from(cloud.cross_section[i]) * f64::from(extinction),
                };
                sums[tile] += step as f64 * cross_section / area;
            }
        }
        sums.into_iter().any(|optical_depth| optical_depth > PLAIN)
    }

    fn ball(&self, i: usize) -> Ball {
        let cloud = &self.loaded.cloud;
        Ball { center: cloud.origin + cloud.position[i].as_dvec3(), reach: reach(cloud, i) }
    }

    fn casts(&self, i: usize) -> bool {
        let loaded = self.loaded;
        let cloud = &loaded.cloud;
        let material = &loaded.materials[cloud.material[i] as usize];
        let object = cloud.object[i] as usize;
        let is_among = match self.casters {
            Casters::All => loaded.objects[object].casts_shadow,
            Casters::Shadows(rank) => object == rank && loaded.objects[object].casts_shadow,
            Casters::Seen(rank) => object == rank && self.may_be_seen(&self.ball(i)),
        };
        is_among
            && cloud.cross_section[i] > 0.0
            && (cloud.kind[i] == SplatKind::Opaque || material.greatest_extinction() > 0.0)
    }

    /// Mean reach of some casters: a length across parallel light, else over their distance.
    fn mean_reach(&self, shape: &LightShape) -> f64 {
        let step = self.loaded.cloud.len().div_ceil(SAMPLES).max(1);
        let mut sum = 0.0;
        let mut casters = 0;
        for i in (0..self.loaded.cloud.len()).step_by(step).filter(|i| self.casts(*i)) {
            let ball = self.ball(i);
            let distance = shape.place().map_or(1.0, |place| ball.center.distance(place).max(ball.reach));
            sum += ball.reach / distance;
            casters += 1;
        }
        if casters > 0 { sum / f64::from(casters) } else { 0.0 }
    }

    fn receives(&self, i: usize) -> bool {
        let loaded = self.loaded;
        let cloud = &loaded.cloud;
        let object = &loaded.objects[cloud.object[i] as usize];
        object.shadow_coefficient * cloud.shadow_coefficient_of(i) > 0.0
            && loaded.materials[cloud.material[i] as usize].shading != Shading::Unlit
    }

    fn may_be_seen(&self, ball: &Ball) -> bool {
        self.view.is_none_or(|view| view.may_see(view.view_from_world(ball.center), ball.reach))
    }

    /// Hands on whatever receives shadows and may be seen.
    fn each_receiver(&self, visit: &(dyn Fn(Ball) + Sync)) {
        let loaded = self.loaded;
        let cloud = &loaded.cloud;
        let chunks = (0..cloud.len().div_ceil(CHUNK)).into_par_iter();
        chunks.for_each(|chunk| {
            for i in (chunk * CHUNK..cloud.len().min((chunk + 1) * CHUNK)).filter(|i| self.receives(*i)) {
                let ball = self.ball(i);
                if self.may_be_seen(&ball) {
                    visit(ball);
                }
            }
        });
        for native in loaded.own.iter().filter(|native| loaded.objects[native.object].shadow_coefficient > 0.0) {
            let ball = about(&native.world_box());
            if self.may_be_seen(&ball) {
                visit(ball);
            }
        }
    }

    /// Hands on whatever casts shadows, with the optical depth of its middle and its profile, until something is opaque.
    fn each_caster(&self, is_opaque: &AtomicBool, visit: &(dyn Fn(Ball, f64, Option<&Profile>) + Sync)) {
        let loaded = self.loaded;
        let cloud = &loaded.cloud;
        let is_among = |native: &&Own| match self.casters {
            Casters::All => true,
            Casters::Shadows(rank) | Casters::Seen(rank) => native.object == rank,
        };
        let casting =
            loaded.own.iter().filter(|native| !native.has_splats && loaded.objects[native.object].casts_shadow);
        for native in casting.filter(is_among) {
            visit(about(&native.world_box()), native.optical_depth(), None);
        }
        let chunks = (0..cloud.len().div_ceil(CHUNK)).into_par_iter();
        chunks.for_each(|chunk| {
            if is_opaque.load(Ordering::Relaxed) {
                return;
            }
            for i in (chunk * CHUNK..cloud.len().min((chunk + 1) * CHUNK)).filter(|i| self.casts(*i)) {
                let profile = &self.profiles[cloud.footprint[i] as usize];
                let radius = f64::from(cloud.radius[i]);
                let peak = f64::from(cloud.cross_section[i]) * profile.norm / (radius * radius);
                let extinction = loaded.materials[cloud.material[i] as usize].greatest_extinction();
                // A few texels of an image may hold all of its cross-section.
                let is_image = loaded.footprints.image(usize::from(cloud.footprint[i])).is_some();
                let hides = is_image || cloud.kind[i] == SplatKind::Opaque;
                let optical_depth = if hides { f64::INFINITY } else { peak * f64::from(extinction) };
                // All of an opaque splat is: its profile is cut where it hides what lies behind.
                let profile = (!hides).then_some(profile);
                visit(self.ball(i), optical_depth, profile);
            }
        });
    }
}

impl Profile {
    /// At a squared distance as a share of the squared radius; profiles fall.
    fn at(&self, distance_sq: f64) -> f64 {
        self.from.get((distance_sq * STEPS as f64) as usize).copied().unwrap_or(0.0)
    }
}

/// How far a splat reaches.
fn reach(cloud: &Cloud, i: usize) -> f64 {
    f64::from(cloud.radius[i].max(cloud.tangent_of(i).length()))
}

fn about(bounds: &DAabb) -> Ball {
    Ball { center: 0.5 * (bounds.min + bounds.max), reach: 0.5 * bounds.size().length() }
}

/// Bits of a number, above 0, in the order of numbers.
fn ordered(depth: f32) -> u32 {
    let bits = depth.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Squares of the directions of a light.
struct Tiles {
    shape: Shape,
    /// Along x and y.
    counts: [usize; 2],
    side: f64,
}

enum Shape {
    /// Across x and y from the corner on, along z.
    Plane { axes: [DVec3; 3], corner: [f64; 2] },
    /// On the faces of a cube with sides from −1 to 1.
    Cube { center: DVec3 },
}

impl Tiles {
    /// Tiles about as wide as the footprints of the casters, which lie in `bounds`.
    fn new(shape: &LightShape, bounds: &DAabb, reach: f64) -> Self {
        if let Some(center) = shape.place() {
            let count = (2.0 / reach).clamp(LEAST_TILES, MOST_TILES) as usize;
            return Self { shape: Shape::Cube { center }, counts: [count + 2 * MARGIN; 2], side: 2.0 / count as f64 };
        }
        let along = match shape {
            LightShape::Directional { direction } => *direction,
            _ => DVec3::Z,
        };
        let (x, y) = along.any_orthonormal_pair();
        let corners = bounds.corners();
        let span = |axis: DVec3| {
            let places = corners.map(|corner| axis.dot(corner));
            let low = places.into_iter().fold(f64::INFINITY, f64::min) - reach;
            [low, places.into_iter().fold(f64::NEG_INFINITY, f64::max) + reach - low]
        };
        let spans = [span(x), span(y)];
        let longest = spans[0][1].max(spans[1][1]).max(f64::MIN_POSITIVE);
        let side = longest / (longest / reach).clamp(LEAST_TILES, MOST_TILES).floor();
        let counts = spans.map(|[_, length]| (libm::ceil(length / side) as usize).max(1));
        Self { shape: Shape::Plane { axes: [x, y, along], corner: spans.map(|[low, _]| low) }, counts, side }
    }

    /// A few large ones.
    fn large(shape: &LightShape, bounds: &DAabb) -> Self {
        let side = if shape.place().is_some() { 2.0 } else { bounds.size().length() };
        Self::new(shape, bounds, side / LARGE_TILES)
    }

    fn count(&self) -> usize {
        let faces = if self.is_parallel() { 1 } else { 6 };
        faces * self.counts[0] * self.counts[1]
    }

    fn is_parallel(&self) -> bool {
        matches!(self.shape, Shape::Plane { .. })
    }

    fn depth(&self, place: DVec3) -> f64 {
        match &self.shape {
            Shape::Plane { axes, .. } => axes[2].dot(place),
            Shape::Cube { center } => center.distance(place),
        }
    }

    /// Tiles between two numbers along an axis; those beside all tiles are none.
    fn between(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let first = libm::floor(low / self.side).max(0.0) as usize;
        let end = (libm::floor(high / self.side) + 1.0).max(0.0) as usize;
        first.min(self.counts[axis])..end.min(self.counts[axis])
    }

    /// The place of a direction on a face, in its plane from the first tile on, from its middle.
    fn offset(&self, place: f64) -> f64 {
        place + 1.0 + MARGIN as f64 * self.side
    }

    /// The tile of a place, and its area at the place's depth, across the light.
    fn of_center(&self, center: DVec3) -> (usize, f64) {
        let tile = |places: [f64; 2]| {
            let [x, y] = [0, 1].map(|a: usize| ((places[a] / self.side).max(0.0) as usize).min(self.counts[a] - 1));
            y * self.counts[0] + x
        };
        match &self.shape {
            Shape::Plane { axes, corner } => {
                (tile([0, 1].map(|a: usize| axes[a].dot(center) - corner[a])), self.side * self.side)
            }
            Shape::Cube { center: light } => {
                let towards = center - *light;
                let axis = towards.abs().max_position();
                let z = towards[axis].abs().max(f64::MIN_POSITIVE);
                let face = 2 * axis + usize::from(towards[axis] < 0.0);
                let places = [1, 2].map(|a| self.offset(towards[(axis + a) % 3] / z));
                let across = self.side * z;
                (face * self.counts[0] * self.counts[1] + tile(places), across * across * z / towards.length().max(z))
            }
        }
    }

    /// The greatest of the numbers of a tile and of those that lie up to [`MARGIN`] beside it.
    fn widened(&self, numbers: Vec<u32>) -> Vec<u32> {
        let [width, height] = self.counts;
        let mut numbers = numbers;
        let mut line = Vec::new();
        for (count, step) in [(width, 1), (height, width)] {
            for start in (0..numbers.len()).filter(|at| (at / step).is_multiple_of(count)) {
                line.clear();
                line.extend((0..count).map(|k| numbers[start + k * step]));
                for k in 0..count {
                    let near = &line[k.saturating_sub(MARGIN)..(k + MARGIN + 1).min(count)];
                    numbers[start + k * step] = near.iter().copied().max().unwrap_or(0);
                }
            }
        }
        numbers
    }

    /// Hands on each tile that a ball may cover, and the square of a distance: no ray in the tile passes the ball's centre nearer.
    fn each_under(&self, ball: &Ball, mut visit: impl FnMut(usize, f64)) {
        let reach_sq = ball.reach * ball.reach;
        match &self.shape {
            Shape::Plane { axes, corner } => {
                let place = [0, 1].map(|a: usize| axes[a].dot(ball.center) - corner[a]);
                let [columns, rows] = [0, 1].map(|a| self.between(a, place[a] - ball.reach, place[a] + ball.reach));
                for row in rows {
                    let beside = self.beside(row, place[1]).powi(2);
                    for column in columns.clone() {
                        let distance_sq = beside + self.beside(column, place[0]).powi(2);
                        if distance_sq < reach_sq {
                            visit(row * self.counts[0] + column, distance_sq);
                        }
                    }
                }
            }
            Shape::Cube { center } => {
                let seen = Ball { center: ball.center - *center, reach: ball.reach };
                (0..6).for_each(|face| self.each_on_face(face, &seen, &mut visit));
            }
        }
    }

    /// The same on one face of the cube, of a ball whose centre is as seen from that of the cube.
    fn each_on_face(&self, face: usize, ball: &Ball, visit: &mut impl FnMut(usize, f64)) {
        let axis = face / 2;
        let z = if face.is_multiple_of(2) { ball.center[axis] } else { -ball.center[axis] };
        let across = [ball.center[(axis + 1) % 3], ball.center[(axis + 2) % 3]];
        // A face ends beyond its edges.
        let end = 1.0 + MARGIN as f64 * self.side;
        let beyond = ball.reach * libm::hypot(1.0, end);
        if across.iter().any(|x| x.abs() - end * z > beyond) {
            return;
        }
        let tiles = |a: usize| {
            let distance_sq = across[a] * across[a] + z * z;
            let tangent_sq = distance_sq - ball.reach * ball.reach;
            if tangent_sq <= 0.0 {
                return 0..self.counts[a];
            }
            // The tangents of the ball from the light, as turned vectors: sine and cosine of half its angle, times the squared distance.
            let sine = ball.reach;
            let cosine = libm::sqrt(tangent_sq);
            let tangent = |x: f64, z: f64| if z > 0.0 { x / z } else { f64::INFINITY.copysign(across[a]) };
            let low = tangent(across[a] * cosine - z * sine, z * cosine + across[a] * sine);
            let high = tangent(across[a] * cosine + z * sine, z * cosine - across[a] * sine);
            self.between(a, self.offset(low.min(end)), self.offset(high.max(-end)))
        };
        let [columns, rows] = [0, 1].map(tiles);
        let distance = ball.center.length();
        // Where the centre meets the plane of the face, if it does, and how long the way to there is.
        let is_before = z > ball.reach;
        let place = across.map(|x| self.offset(if is_before { x / z } else { 0.0 }));
        let slant = if is_before { distance / z } else { 1.0 };
        for row in rows {
            for column in columns.clone() {
                let beside_sq = self.beside(column, place[0]).powi(2) + self.beside(row, place[1]).powi(2);
                // The area between two ways to the plane is at least half of the distance in it: no line there comes nearer to the light than 1.
                let farthest_sq = 1.0 + self.farthest_sq(column) + self.farthest_sq(row);
                let distance_sq =
                    if is_before { distance * distance * beside_sq / (slant * slant * farthest_sq) } else { 0.0 };
                if distance_sq < ball.reach * ball.reach {
                    visit((face * self.counts[1] + row) * self.counts[0] + column, distance_sq);
                }
            }
        }
    }

    /// How far a place lies beside a tile, along an axis.
    fn beside(&self, tile: usize, place: f64) -> f64 {
        let low = tile as f64 * self.side;
        (low - place).max(place - low - self.side).max(0.0)
    }

    /// The farthest that a tile of a face reaches from the middle of the face along an axis, squared.
    fn farthest_sq(&self, tile: usize) -> f64 {
        let low = tile as f64 * self.side - self.offset(0.0);
        low.abs().max((low + self.side).abs()).powi(2)
    }
}
