//! How much of a light anything that is seen can lose, before any shadow map is built: a bound by tiles of the light's directions.
//!
//! | light | tiles | a depth |
//! |---|---|---|
//! | parallel | squares across its direction | along it |
//! | any other | squares on the faces of a cube about it | the distance |
//!
//! Every tile first learns how far behind it something receives shadows that the view may show. Each caster that begins before that adds, to all
//! tiles under its footprint, the most that its footprint has there, so no ray in a tile can have more optical depth than the tile's sum. Footprints
//! are taken as balls: one that is seen aslant, or is longer than wide, covers less. Sums are whole numbers, which know no order of threads.

use super::casters::wider;
use crate::load::Loaded;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{Camera, Cloud, DAabb, Footprint, Light, LightShape, Shading, SplatKind};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Splats of a task.
const CHUNK: usize = 1 << 12;
/// Splats that the size of tiles is chosen by.
const SAMPLES: usize = 1 << 10;
/// Tiles along a side of the plane or of a face.
const LEAST_TILES: f64 = 4.0;
const MOST_TILES: f64 = 192.0;
/// Tiles by which what receives is taken to reach farther: look-ups in a shadow map interpolate between its cells.
const MARGIN: f64 = 2.0;
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
    profiles: Vec<Profile>,
    bounds: DAabb,
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
        let profile = |(id, footprint): (usize, &Footprint)| Profile {
            norm: footprint.norm(),
            // An image may have its most anywhere.
            from: std::array::from_fn(|step| match footprints.image(id) {
                Some(_) => 1.0,
                None => footprint.profile(step as f64 / STEPS as f64),
            }),
        };
        let splats = loaded.cloud.bounds();
        let origin = loaded.cloud.origin;
        let centers = match loaded.cloud.is_empty() {
            true => DAabb::EMPTY,
            false => DAabb::new(origin + splats.min.as_dvec3(), origin + splats.max.as_dvec3()),
        };
        let bounds = loaded.own.iter().fold(centers, |joined, own| joined.union(own.world_box()));
        Self {
            loaded,
            view: (!leaves_view).then(|| wider(&loaded.camera)),
            profiles: footprints.layers().iter().enumerate().map(profile).collect(),
            bounds,
        }
    }

    /// The greatest share of its light that a ray of one point of a light can lose on the way to anything that receives shadows and may be seen.
    pub(crate) fn greatest_opacity(&self, light: &Light) -> f64 {
        if self.bounds.is_empty() {
            return 0.0;
        }
        let tiles = Tiles::new(&light.shape, &self.bounds, self.mean_reach(&light.shape));
        let count = tiles.count();
        // Nothing is behind what is nowhere.
        let farthest: Vec<AtomicU32> = (0..count).map(|_| AtomicU32::new(0)).collect();
        let margin = MARGIN * tiles.side;
        self.each_receiver(&|ball| {
            let back = ordered((tiles.depth(ball.center) + ball.reach) as f32);
            tiles.each_under(&ball, margin, |tile, _| {
                farthest[tile].fetch_max(back, Ordering::Relaxed);
            });
        });
        let is_opaque = AtomicBool::new(false);
        let sums: Vec<AtomicU64> = (0..count).map(|_| AtomicU64::new(0)).collect();
        self.each_caster(&is_opaque, &|ball, optical_depth, profile| {
            let front = ordered((tiles.depth(ball.center) - ball.reach) as f32);
            let per_area = (ball.reach * ball.reach).recip();
            tiles.each_under(&ball, 0.0, |tile, distance_sq| {
                if front >= farthest[tile].load(Ordering::Relaxed) {
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
            return 1.0;
        }
        let most = sums.into_iter().map(AtomicU64::into_inner).max().unwrap_or(0);
        -libm::expm1(-(most as f64) / UNIT)
    }

    fn ball(&self, i: usize) -> Ball {
        let cloud = &self.loaded.cloud;
        Ball { center: cloud.origin + cloud.position[i].as_dvec3(), reach: reach(cloud, i) }
    }

    fn casts(&self, i: usize) -> bool {
        let (loaded, cloud) = (self.loaded, &self.loaded.cloud);
        let material = &loaded.materials[cloud.material[i] as usize];
        loaded.objects[cloud.object[i] as usize].casts_shadow
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

    /// Hands on whatever receives shadows and may be seen.
    fn each_receiver(&self, visit: &(dyn Fn(Ball) + Sync)) {
        let (loaded, cloud) = (self.loaded, &self.loaded.cloud);
        let receives = |i: usize| {
            let coefficient =
                loaded.objects[cloud.object[i] as usize].shadow_coefficient * cloud.shadow_coefficient_of(i);
            coefficient > 0.0 && loaded.materials[cloud.material[i] as usize].shading != Shading::Unlit
        };
        let may_be_seen =
            |ball: &Ball| self.view.is_none_or(|view| view.may_see(view.view_from_world(ball.center), ball.reach));
        let chunks = (0..cloud.len().div_ceil(CHUNK)).into_par_iter();
        chunks.for_each(|chunk| {
            for i in (chunk * CHUNK..cloud.len().min((chunk + 1) * CHUNK)).filter(|i| receives(*i)) {
                let ball = self.ball(i);
                if may_be_seen(&ball) {
                    visit(ball);
                }
            }
        });
        for own in loaded.own.iter().filter(|own| loaded.objects[own.object].shadow_coefficient > 0.0) {
            let ball = about(&own.world_box());
            if may_be_seen(&ball) {
                visit(ball);
            }
        }
    }

    /// Hands on whatever casts shadows, with the optical depth of its middle and its profile, until something is opaque.
    fn each_caster(&self, is_opaque: &AtomicBool, visit: &(dyn Fn(Ball, f64, Option<&Profile>) + Sync)) {
        let (loaded, cloud) = (self.loaded, &self.loaded.cloud);
        for own in loaded.own.iter().filter(|own| !own.has_splats && loaded.objects[own.object].casts_shadow) {
            visit(about(&own.world_box()), own.optical_depth(), None);
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
                let optical_depth = match cloud.kind[i] {
                    SplatKind::Opaque => f64::INFINITY,
                    _ => peak * f64::from(extinction),
                };
                // All of an opaque splat is: its profile is cut where it hides what lies behind.
                let profile = (cloud.kind[i] != SplatKind::Opaque).then_some(profile);
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

/// Bits of a number that are ordered as it is, above 0.
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
            return Self { shape: Shape::Cube { center }, counts: [count; 2], side: 2.0 / count as f64 };
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

    /// Hands on each tile that a ball may cover, or that lies no farther than `margin` beside such a tile, and the square of a distance: no ray as near
    /// to the tile passes the ball's centre nearer.
    fn each_under(&self, ball: &Ball, margin: f64, mut visit: impl FnMut(usize, f64)) {
        match &self.shape {
            Shape::Plane { axes, corner } => {
                let place = [0, 1].map(|a: usize| axes[a].dot(ball.center) - corner[a]);
                let reach = ball.reach + margin;
                let [columns, rows] = [0, 1].map(|a| self.between(a, place[a] - reach, place[a] + reach));
                for row in rows {
                    for column in columns.clone() {
                        let beside = [self.beside(column, place[0], margin), self.beside(row, place[1], margin)];
                        let distance_sq = beside[0] * beside[0] + beside[1] * beside[1];
                        if distance_sq < ball.reach * ball.reach {
                            visit(row * self.counts[0] + column, distance_sq);
                        }
                    }
                }
            }
            Shape::Cube { center } => {
                let towards = ball.center - *center;
                for face in 0..6 {
                    self.each_on_face(face, &Ball { center: towards, reach: ball.reach }, margin, &mut visit);
                }
            }
        }
    }

    /// The same on one face of the cube, of a ball whose centre is as seen from that of the cube.
    fn each_on_face(&self, face: usize, ball: &Ball, margin: f64, visit: &mut impl FnMut(usize, f64)) {
        let towards = ball.center;
        let distance = towards.length();
        let axis = face / 2;
        let z = if face.is_multiple_of(2) { towards[axis] } else { -towards[axis] };
        let across = [towards[(axis + 1) % 3], towards[(axis + 2) % 3]];
        let reach = ball.reach + margin * (distance + ball.reach);
        if across.iter().any(|x| (x.abs() - z) * FRAC_1_SQRT_2 > reach) {
            return;
        }
        let tiles = |a: usize| {
            let distance = libm::hypot(across[a], z);
            if distance <= reach {
                return 0..self.counts[a];
            }
            let middle = libm::atan2(across[a], z);
            let half = libm::asin(reach / distance);
            let ends = [middle - half, middle + half].map(|angle| libm::tan(angle.clamp(-FRAC_PI_4, FRAC_PI_4)) + 1.0);
            self.between(a, ends[0], ends[1])
        };
        let [columns, rows] = [0, 1].map(tiles);
        // Where the centre meets the plane of the face, if it does, and how long the way to there is.
        let is_before = z > reach;
        let place = across.map(|x| if is_before { x / z } else { 0.0 });
        let slant = if is_before { distance / z } else { 1.0 };
        for row in rows {
            for column in columns.clone() {
                let beside = [self.beside(column, place[0] + 1.0, margin), self.beside(row, place[1] + 1.0, margin)];
                // The area between two ways to the plane is at least half of the distance in it: no line there comes nearer to the light than 1.
                let farthest = 1.0 + self.farthest_sq(column, margin) + self.farthest_sq(row, margin);
                let near = distance * libm::hypot(beside[0], beside[1]) / (slant * libm::sqrt(farthest));
                let distance_sq = if is_before { near * near } else { 0.0 };
                if distance_sq < ball.reach * ball.reach {
                    visit((face * self.counts[1] + row) * self.counts[0] + column, distance_sq);
                }
            }
        }
    }

    /// How far a place lies beside a tile that is wider by `margin` on either side, along an axis.
    fn beside(&self, tile: usize, place: f64, margin: f64) -> f64 {
        let low = tile as f64 * self.side;
        (low - place).max(place - low - self.side).max(margin) - margin
    }

    /// The farthest that such a tile of a face reaches from the middle of the face along an axis, squared.
    fn farthest_sq(&self, tile: usize, margin: f64) -> f64 {
        let low = tile as f64 * self.side - 1.0;
        (low.abs().max((low + self.side).abs()) + margin).powi(2)
    }
}
