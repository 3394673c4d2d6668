//! Light depths: the z-buffer of opaque polygons as a light sees them (step 2 of the pseudocode), the lists of translucent ones before that
//! ([`crate::half_vector::polygons::light_layers`]), and what both say of any place.
//!
//! A pixel has the depth of the nearest polygon and the plane that it lies in. A place is hidden where the plane of a pixel about it
//! lies nearer to the light at the place itself, not at the pixel's middle: so a wall hides what is behind its foot. A place on
//! a surface, for which its own plane lies nearer at the pixel's middle, is not hidden: that is the surface itself as it bends away. So
//! nothing has to be lifted from its own surface. The four pixels about a place are weighed.
//!
//! A light with an extent has such a z-buffer for each of its points, of fewer pixels each, and what they see is averaged (section 5). The
//! paper keeps one z-buffer of the light's centre, fills what lies behind it with a thickness guessed from its gradient and convolves that.
//! Points see the polygons themselves, so nothing has to be guessed: an edge at d1 casts a penumbra 2R·d2/d1 wide at d2 behind it.

use super::light_blocks::{BYTES_OF_A_PIXEL, Extent, LightBlocks};
use super::light_layers::{Beside, LightLayers};
use super::light_views::views;
use super::lit_way::{LitWay, Stretch, WayPart};
use super::surfaces::Polygons;
use crate::Error;
use crate::half_vector::sampled_light::SampledLight;
use crate::half_vector::soft::penumbra::received;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::lanes::MAX_LANES;
use splat_core::raster::triangles::{DepthPlanes, PlacedMesh, resolve_depth};
use splat_core::{Camera, Progress, Receiver, Transmittance, ViewTransform};

/// Rounding of depths: as a share of the extent of what receives, and of the farthest depth.
const ROUNDING: [f64; 2] = [1e-6, 2e-7];

/// How much more is asked for before one surface shadows another.
const SAFETY: f64 = 10.0;

/// How far a plane is followed beside the middle of a pixel, in widths of a pixel.
const STEEPEST: f32 = 8.0;

/// Most parts in which a way is looked at, and pixels of one.
const PARTS: usize = 16;
const PIXELS: f32 = 8.0;

/// By how much a box about several ways is larger than they are, as a share of its coordinates.
const MARGIN: f32 = 1e-5;

/// How far from its ends a way is looked at, as a share of it.
const INSET: f32 = 1.0 / 1024.0;

/// Least difference of shares of the light that is a step.
const STEP: f32 = 1e-3;

/// Halvings that find where light ends on a way.
const HALVINGS: usize = 10;

/// Least side of the image of a point, where a light has many.
const LEAST_SIDE: u32 = 16;

/// What the images of a light may take.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DepthLimits {
    /// Pixels a side of one image that has as many as those of all points together.
    pub(crate) most_pixels: u32,
    /// Bytes of lists of translucent polygons.
    pub(crate) most_bytes: u64,
}

/// A straight way between two places, relative to the origin of the depths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    from: Vec3,
    to: Vec3,
}

impl Way {
    /// The place at a share of it.
    fn place(&self, share: f32) -> Vec3 {
        self.from + (self.to - self.from) * share
    }
}

/// What a light sees of the polygons that cast shadows.
pub(crate) struct LightDepths {
    points: Vec<PointDepths>,
    /// What places are taken relative to.
    origin: DVec3,
    /// What is nearer by less than this is not before a surface, and what depths are rounded by; world units.
    bias: f32,
    rounding: f32,
}

/// What one point of the light sees.
struct PointDepths {
    /// One; six for a lamp that is surrounded.
    views: Vec<View>,
    /// Share of the light that comes from it.
    share: f32,
}

/// One image of the light.
struct View {
    planes: DepthPlanes,
    /// Translucent ones, if any cast shadows.
    layers: Option<LightLayers>,
    blocks: LightBlocks,
    transform: ViewTransform,
    focal: f32,
    size: [usize; 2],
    is_parallel: bool,
}

/// A place as a view sees it: x right, y down, z depth.
struct Sighted<'a> {
    view: &'a View,
    place: Vec3,
    pixel: [f32; 2],
}

/// A box about neighbouring ways.
struct Spread {
    middle: Vec3,
    half: Vec3,
    /// The greatest coordinate of an end.
    farthest: f32,
}

/// How much of a way several points of a light reach.
#[derive(Clone, Copy)]
struct Reached {
    sum: f32,
    moment: f32,
    is_whole: bool,
    /// The stretch of the last point, and how many there were.
    last: Stretch,
    points: u32,
}

impl Reached {
    const NONE: Self = Self { sum: 0.0, moment: 0.0, is_whole: true, last: Stretch::WHOLE, points: 0 };

    /// Takes in a point with this share of the light.
    fn add(&mut self, share: f32, stretch: Stretch) {
        let Stretch { from, to } = stretch;
        self.is_whole &= stretch == Stretch::WHOLE;
        self.last = stretch;
        self.points += 1;
        self.sum += share * (to - from);
        self.moment += share * 0.5 * (to - from) * (from + to);
    }

    fn stretch(&self) -> Stretch {
        // Of one point the stretch stays to the bit.
        if self.is_whole || self.points == 1 { self.last } else { stretch_of(self.sum, self.moment) }
    }
}

impl Spread {
    fn new<'w>(ways: impl Iterator<Item = &'w Way>) -> Self {
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let [low, high] =
            ways.fold(none, |[low, high], Way { from, to }| [low.min(*from).min(*to), high.max(*from).max(*to)]);
        Self { middle: 0.5 * (low + high), half: 0.5 * (high - low), farthest: low.abs().max(high.abs()).max_element() }
    }

    /// Whether all of the ways are lit by a point, or none, where blocks of pixels tell; of lamps that are surrounded the first view alone is asked.
    fn whole_by(&self, point: &PointDepths, rounding: f32) -> Option<bool> {
        let view = point.views.first()?;
        let extent = view.extent(self)?;
        view.blocks.whole(&extent, (STEEPEST * view.width(extent.far) + rounding) * (1.0 + MARGIN))
    }
}

impl LightDepths {
    /// Of the points of a light, for what receives at any of these places; `None` where nothing casts shadows, or receives any.
    pub(crate) fn new(
        casters: &[&Polygons<'_>],
        sampled: SampledLight<'_>,
        receivers: &[DVec3],
        limits: DepthLimits,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        if casters.is_empty() || receivers.is_empty() {
            return Ok(None);
        }
        let (low, high) =
            receivers.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let origin = low + 0.5 * (high - low);
        let lights = sampled.points([1.0; 3]);
        let (shares, _) = received(sampled.light, &lights, origin);
        let placed: Vec<PlacedMesh<'_>> = casters.iter().map(|p| p.placed).collect();
        let mut points = Vec::with_capacity(lights.len());
        let mut farthest = 0.0f64;
        let mut bytes = 0;
        for (light, share) in lights.iter().zip(shares) {
            let cameras = views(light, origin, &placed, receivers, side(limits.most_pixels, lights.len() as u32))?;
            let mut views = Vec::with_capacity(cameras.len());
            for camera in &cameras {
                farthest = receivers.iter().map(|p| camera.view_from_world(*p).z).fold(farthest, f64::max);
                let view = View::new(casters, camera, origin, limits.most_bytes.saturating_sub(bytes), progress)?;
                bytes += view.layers.as_ref().map_or(0, LightLayers::bytes);
                views.push(view);
            }
            points.push(PointDepths { views, share });
        }
        let rounding = ROUNDING[0] * (high - low).length() + ROUNDING[1] * farthest;
        Ok(Some(Self { points, origin, bias: (SAFETY * rounding) as f32, rounding: rounding as f32 }))
    }

    /// Bytes of the images of one light with so many points at most.
    pub(crate) fn bytes_of(most: u32, samples: u32) -> u64 {
        if samples == 0 {
            return 0;
        }
        let pixels = u64::from(side(most, samples)).pow(2);
        // Of six views each has half as many pixels a side; while one is made it has depths in double precision too.
        u64::from(samples) * pixels * 3 / 2 * (12 + BYTES_OF_A_PIXEL) + pixels * 8
    }

    /// Bytes of the images.
    pub(crate) fn bytes(&self) -> u64 {
        let views = self.points.iter().flat_map(|point| &point.views);
        let view_bytes = |view: &View| {
            let layers = view.layers.as_ref().map_or(0, LightLayers::bytes);
            12 * view.planes.depth.len() as u64 + view.blocks.bytes() + layers
        };
        views.map(view_bytes).sum()
    }

    /// Share of the light that polygons let through to a world position, by channel, which lies on a surface of this normal or in the open.
    pub(crate) fn visibility(&self, world: DVec3, face: Option<Vec3>) -> [f32; 3] {
        self.each(world, face).fold(Vec3::ZERO, |sum, share| sum + share).to_array()
    }

    /// The same by the points of the light, of all channels together.
    pub(crate) fn visible(&self, world: DVec3, face: Option<Vec3>) -> impl Iterator<Item = f32> {
        self.each(world, face).map(mean)
    }

    fn each(&self, world: DVec3, face: Option<Vec3>) -> impl Iterator<Item = Vec3> {
        let place = (world - self.origin).as_vec3();
        self.points.iter().map(move |point| point.share * self.visibility_of_point(point, place, face))
    }

    fn visibility_of_point(&self, point: &PointDepths, place: Vec3, face: Option<Vec3>) -> Vec3 {
        let Some(sighted) = point.views.iter().find_map(|view| view.sight(place)) else {
            return Vec3::ONE;
        };
        // In the open nothing lies on a surface but what is behind it: the end of a way.
        let bias = if face.is_some() { self.bias } else { -self.rounding };
        sighted.visibility(bias, face.map(|face| sighted.view.turned(face)))
    }

    /// The way between two world positions.
    pub(crate) fn way(&self, from: DVec3, to: DVec3) -> Way {
        Way { from: (from - self.origin).as_vec3(), to: (to - self.origin).as_vec3() }
    }

    /// Which parts of neighbouring ways light reaches; `None` where each point of the light reaches all of every way. Before opaque polygons that is one
    /// part of a way: where it is reached here and there, or by some of the light's points, a part as long as all these, about their middle. How much of
    /// each way each point reaches, times its share of the light, is added to `by_point`, way by way, where there are several points; 0 for all of them
    /// where each reaches all.
    pub(crate) fn lit(&self, ways: &[Option<Way>], by_point: &mut Vec<f32>) -> Option<[LitWay; MAX_LANES]> {
        let spread = Spread::new(ways.iter().flatten());
        let together = |point: &PointDepths| spread.whole_by(point, self.rounding);
        let first_unsure = self.points.iter().position(|point| together(point) != Some(true))?;
        let count = self.points.len();
        if count > 1 {
            by_point.resize(ways.len() * count, 0.0);
        }
        let mut lit = [LitWay::lit(Stretch::WHOLE); MAX_LANES];
        let lanes = || ways.iter().enumerate().filter_map(|(lane, way)| Some((lane, way.as_ref()?)));
        let has_layers = self.points.iter().flat_map(|point| &point.views).any(|view| view.layers.is_some());
        if has_layers {
            let known = if count > 1 { None } else { together(&self.points[0]) };
            for (lane, way) in lanes() {
                lit[lane] = self.lit_through(way, known, by_point.get_mut(lane * count..(lane + 1) * count));
            }
        } else {
            let mut reached = [Reached::NONE; MAX_LANES];
            for (n, point) in self.points.iter().enumerate() {
                let known = if n < first_unsure { Some(true) } else { together(point) };
                for (lane, way) in lanes() {
                    let stretch = self.lit_by(point, way, known);
                    reached[lane].add(point.share, stretch);
                    if count > 1 {
                        by_point[lane * count + n] = point.share * (stretch.to - stretch.from);
                    }
                }
            }
            lanes().for_each(|(lane, _)| lit[lane] = LitWay::lit(reached[lane].stretch()));
        }
        let mut is_whole = true;
        for lane in (0..ways.len()).filter(|lane| ways[*lane].is_some()) {
            if lit[lane].is_whole() {
                by_point.iter_mut().skip(lane * count).take(count).for_each(|reached| *reached = 0.0);
            } else {
                is_whole = false;
            }
        }
        (!is_whole).then_some(lit)
    }

    /// Behind translucent polygons, whose shadows end in steps. How much of the way each point reaches goes into `by_point`, of a light of several. What
    /// is `known` of a light of one point is whether it reaches all of the way, or nothing.
    fn lit_through(&self, way: &Way, known: Option<bool>, by_point: Option<&mut [f32]>) -> LitWay {
        let is_one = self.points.len() == 1;
        if is_one && let Some(is_lit) = known.or_else(|| self.is_whole(&self.points[0], way)) {
            return if is_lit { LitWay::lit(Stretch::WHOLE) } else { LitWay::DARK };
        }
        let mut by_point = by_point.into_iter().flatten();
        let length = self.points.iter().map(|point| pixels(point, way)).fold(0.0, f32::max);
        // Its ends tell what a short way has.
        let count = (2.0 * length / PIXELS).ceil().clamp(1.0, PARTS as f32) as usize;
        let share_at = |n: usize| n as f32 / count as f32;
        let light_at = |point: &PointDepths, share: f32| {
            point.share * self.visibility_of_point(point, way.place(share.clamp(INSET, 1.0 - INSET)), None)
        };
        let mut nodes = [Vec3::ZERO; PARTS + 1];
        for point in &self.points {
            let mut reached = 0.0;
            for (n, node) in nodes[..=count].iter_mut().enumerate() {
                let light = light_at(point, share_at(n));
                *node += light;
                reached += mean(light) * if n == 0 || n == count { 0.5 } else { 1.0 } / count as f32;
            }
            if let Some(by_point) = by_point.next() {
                *by_point = reached;
            }
        }
        let mut lit = LitWay::DARK;
        for n in 0..count {
            let [from, to] = [share_at(n), share_at(n + 1)];
            let [here, next] = [nodes[n], nodes[n + 1]];
            // Penumbras are smooth.
            if !is_one || (here - next).abs().max_element() < STEP {
                lit.push(WayPart { from, to, through: 0.5 * (here + next) });
                continue;
            }
            let edge = edge(&|share| light_at(&self.points[0], share), Stretch { from, to }, here, next);
            lit.push(WayPart { from, to: edge, through: here });
            lit.push(WayPart { from: edge, to, through: next });
        }
        lit
    }

    /// Whether all of a way is lit by a point, or none, where blocks of pixels tell.
    fn is_whole(&self, point: &PointDepths, way: &Way) -> Option<bool> {
        let [from, to] = seen_ends(point, way)?;
        from.view.whole(&from, &to, self.rounding)
    }

    /// Which part of a way one point reaches; it is `known` where it reaches all of it, or nothing.
    fn lit_by(&self, point: &PointDepths, way: &Way, known: Option<bool>) -> Stretch {
        // Before opaque polygons all channels are alike.
        let light_at = |share: f32| self.visibility_of_point(point, way.place(share), None).x;
        if let Some(is_lit) = known.or_else(|| self.is_whole(point, way)) {
            return Stretch { from: 0.0, to: if is_lit { 1.0 } else { 0.0 } };
        }
        let parts = (pixels(point, way) / PIXELS).ceil().clamp(2.0, PARTS as f32);
        // Ends lie on polygons that end the way: whether these are in the light is asked before them.
        let looked = |share: f32| light_at(share.clamp(INSET, 1.0 - INSET));
        let mut sum = 0.0;
        let mut moment = 0.0;
        let mut here = looked(0.0);
        let mut is_whole = here == 1.0;
        for part in 0..parts as usize {
            let [low, high] = [part, part + 1].map(|n| n as f32 / parts);
            let next = looked(high);
            // Lit to some extent up to the edge, and to another from there on.
            let edge = match here == next {
                true => high,
                false => {
                    let part = Stretch { from: low, to: high };
                    edge(&|share| Vec3::splat(looked(share)), part, Vec3::splat(here), Vec3::splat(next))
                }
            };
            for (lit, [from, to]) in [(here, [low, edge]), (next, [edge, high])] {
                sum += lit * (to - from);
                moment += lit * (to - from) * 0.5 * (from + to);
            }
            is_whole &= next == 1.0;
            here = next;
        }
        if is_whole { Stretch::WHOLE } else { stretch_of(sum, moment) }
    }
}

/// Pixels along a side of the image of each of so many points.
pub(super) fn side(most: u32, points: u32) -> u32 {
    let each = (f64::from(most) / f64::from(points.max(1)).sqrt()) as u32;
    each.max(LEAST_SIDE.min(most))
}

/// A stretch of a way as long as `sum`, about its middle, which is `moment` over that.
fn stretch_of(sum: f32, moment: f32) -> Stretch {
    if sum <= 0.0 {
        return Stretch { from: 0.0, to: 0.0 };
    }
    let from = (moment / sum - 0.5 * sum).clamp(0.0, (1.0 - sum).max(0.0));
    Stretch { from, to: (from + sum).min(1.0) }
}

/// Where light changes from what it is at one end of a part to what it is at the other.
fn edge(light_at: &impl Fn(f32) -> Vec3, part: Stretch, here: Vec3, next: Vec3) -> f32 {
    let mut before = part.from;
    let mut behind = part.to;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (before + behind);
        let seen = light_at(middle);
        let difference = |to: Vec3| (seen - to).abs().max_element();
        if difference(here) < difference(next) { before = middle } else { behind = middle }
    }
    0.5 * (before + behind)
}

/// Mean of the channels.
fn mean(channels: Vec3) -> f32 {
    // Of equal ones that is one of them, to the bit.
    if channels.x == channels.y && channels.y == channels.z { channels.x } else { channels.element_sum() / 3.0 }
}

/// The ends of a way in the first image of a point that shows both.
fn seen_ends<'p>(point: &'p PointDepths, way: &Way) -> Option<[Sighted<'p>; 2]> {
    point.views.iter().find_map(|view| Some([view.sight(way.from)?, view.sight(way.to)?]))
}

/// Pixels of a point's image that a way crosses.
fn pixels(point: &PointDepths, way: &Way) -> f32 {
    seen_ends(point, way)
        .map_or(f32::INFINITY, |[a, b]| (a.pixel[0] - b.pixel[0]).abs().max((a.pixel[1] - b.pixel[1]).abs()))
}

impl View {
    fn new(
        casters: &[&Polygons<'_>],
        camera: &Camera,
        origin: DVec3,
        most_bytes: u64,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let (solid, panes): (Vec<&Polygons<'_>>, Vec<_>) = casters.iter().copied().partition(|p| p.is_opaque());
        let solid: Vec<PlacedMesh<'_>> = solid.iter().map(|p| p.placed).collect();
        let planes = resolve_depth(&solid, camera, Some(progress)).map_err(Error::of_polygons)?;
        let size = camera.size.map(|s| s as usize);
        let layers = LightLayers::new(&panes, camera, most_bytes, progress)?;
        Ok(Self {
            blocks: LightBlocks::new(&planes.depth, size, layers.as_ref()),
            layers,
            planes,
            transform: camera.view_from_offset(origin),
            focal: camera.focal_px() as f32,
            size,
            is_parallel: camera.is_orthographic(),
        })
    }

    fn sight(&self, place: Vec3) -> Option<Sighted<'_>> {
        let p = self.transform.apply(place);
        let place_seen = Vec3::new(p.x, -p.y, p.z);
        let scale = if self.is_parallel { self.focal } else { self.focal / place_seen.z };
        let pixel = [0, 1].map(|a| 0.5 * self.size[a] as f32 + place_seen[a] * scale);
        let is_seen = place_seen.z > 0.0 && (0..2).all(|a| pixel[a] >= 0.0 && pixel[a] <= self.size[a] as f32);
        is_seen.then_some(Sighted { view: self, place: place_seen, pixel })
    }

    /// Width of a pixel at a depth, world units.
    fn width(&self, depth: f32) -> f32 {
        if self.is_parallel { self.focal.recip() } else { depth / self.focal }
    }

    /// Whether all of a way is lit, or none, where blocks of pixels tell.
    fn whole(&self, a: &Sighted<'_>, b: &Sighted<'_>, rounding: f32) -> Option<bool> {
        let extent = Extent {
            low: [0, 1].map(|axis| a.pixel[axis].min(b.pixel[axis])),
            high: [0, 1].map(|axis| a.pixel[axis].max(b.pixel[axis])),
            near: a.place.z.min(b.place.z),
            far: a.place.z.max(b.place.z),
        };
        self.blocks.whole(&extent, STEEPEST * self.width(extent.far) + rounding)
    }

    /// Where a box lies in the image; `None` where some of it may not.
    fn extent(&self, spread: &Spread) -> Option<Extent> {
        let middle = self.transform.apply(spread.middle);
        let m = &self.transform.rotation;
        let half = m.x_axis.abs() * spread.half.x + m.y_axis.abs() * spread.half.y + m.z_axis.abs() * spread.half.z;
        // More than sums of such numbers are rounded by: all that is told of the box holds for each of its ways alone.
        let half = half + Vec3::splat(MARGIN * (middle.abs().max_element() + spread.farthest));
        let near = middle.z - half.z;
        let far = middle.z + half.z;
        if near <= 0.0 {
            return None;
        }
        let center = [middle.x, -middle.y];
        let ends = |axis: usize, sign: f32| {
            let end = center[axis] + sign * half[axis];
            // The end that lies farther from the axis of the view is seen farthest from it where it is near.
            let depth = if (end > 0.0) == (sign > 0.0) { near } else { far };
            let scale = if self.is_parallel { self.focal } else { self.focal / depth };
            let pixel = 0.5 * self.size[axis] as f32 + end * scale;
            pixel + sign * MARGIN * (pixel.abs() + self.size[axis] as f32)
        };
        let low = [0, 1].map(|axis| ends(axis, -1.0));
        let high = [0, 1].map(|axis| ends(axis, 1.0));
        let is_seen = (0..2).all(|axis| low[axis] >= 0.0 && high[axis] <= self.size[axis] as f32);
        is_seen.then_some(Extent { low, high, near, far })
    }

    /// A world direction as the view sees it.
    fn turned(&self, direction: Vec3) -> Vec3 {
        let v = self.transform.rotation * direction;
        Vec3::new(v.x, -v.y, v.z)
    }
}

impl Sighted<'_> {
    fn visibility(&self, bias: f32, face: Option<Vec3>) -> Vec3 {
        let View { planes, layers, size, is_parallel, .. } = self.view;
        let mut low = [0; 2];
        let mut share = [0.0; 2];
        for a in 0..2 {
            let place = (self.pixel[a] - 0.5).clamp(0.0, (size[a] - 1) as f32);
            low[a] = (place as usize).min(size[a].saturating_sub(2));
            share[a] = place - low[a] as f32;
        }
        let reach = STEEPEST * self.view.width(self.place.z);
        let mut hidden = 0.0;
        let mut count = 0;
        let mut through = Vec3::ZERO;
        for corner in 0..4 {
            let corner_steps = [corner & 1, corner >> 1];
            let [x, y] = [0, 1].map(|a| (low[a] + corner_steps[a]).min(size[a] - 1));
            let weight = [0, 1].map(|a| if corner_steps[a] == 0 { 1.0 - share[a] } else { share[a] });
            let weight = weight[0] * weight[1];
            let middle = [x as f32 + 0.5, y as f32 + 0.5];
            let k = y * size[0] + x;
            let there = planes.depth[k];
            let step = [self.pixel[0] - middle[0], self.pixel[1] - middle[1]];
            let beside = planes.at(k, step, *is_parallel);
            let is_other = |there: f32| face.is_none_or(|face| there < self.plane_at(face, middle) - bias);
            if beside.clamp(there - reach, there + reach) < self.place.z - bias && is_other(there) {
                (hidden, count) = (hidden + weight, count + 1);
            } else if let Some(layers) = layers {
                let beside = Beside { step, reach, is_parallel: *is_parallel };
                let share = layers.through(k, &beside, self.place.z - bias, is_other);
                through += weight * share;
            }
        }
        match layers {
            Some(_) => through,
            // Nothing is lit by rounding.
            None if count == 4 => Vec3::ZERO,
            None => Vec3::splat((1.0f32 - hidden).max(0.0)),
        }
    }

    /// Depth of the plane through the place, of this normal, at the middle of a pixel.
    fn plane_at(&self, face: Vec3, middle: [f32; 2]) -> f32 {
        let View { size, focal, is_parallel, .. } = self.view;
        let [x, y] = [0, 1].map(|a| (middle[a] - 0.5 * size[a] as f32) / focal);
        if *is_parallel {
            return self.place.z - ((x - self.place.x) * face.x + (y - self.place.y) * face.y) / face.z;
        }
        let along = x * face.x + y * face.y + face.z;
        self.place.dot(face) / along
    }
}

/// What polygons and all else that is not carried let through together.
pub(crate) struct ShadowOfAll<'a> {
    pub(crate) depths: &'a LightDepths,
    pub(crate) others: Option<&'a dyn Transmittance>,
    /// What places of receivers are relative to.
    pub(crate) origin: DVec3,
}

impl Transmittance for ShadowOfAll<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let visible = self.depths.visibility(self.origin + receiver.position.as_dvec3(), None);
        if visible == [0.0; 3] {
            return visible;
        }
        let others = self.others.map_or([1.0; 3], |others| others.transmittance(receiver));
        [0, 1, 2].map(|c| others[c] * visible[c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{Light, LightShape, Material, Mesh, Similarity, rng};

    fn place(k: u64) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|axis| rng::unit_f32(14, axis, k, 0) - 0.5))
    }

    /// Steep triangles everywhere, and a wall behind most of them, so that something is dark altogether.
    fn triangles() -> Mesh {
        let mut mesh = Mesh { triangles: (0..40).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(), ..Mesh::default() };
        mesh.position = (0..120).map(|k| place(k / 3) + Vec3::new(0.1, 0.1, 1.0) * 0.5 * place(1000 + k)).collect();
        mesh.triangles.push([120, 121, 122]);
        mesh.position.extend([[-9.0, -9.0, -0.2], [9.0, -9.0, -0.2], [0.0, 9.0, -0.2]].map(Vec3::from_array));
        mesh
    }

    /// What a light sees of these triangles, of which all of a ray takes this optical depth.
    fn depths(mesh: &Mesh, optical_depth: f32, shape: LightShape, samples: u32) -> LightDepths {
        let polygons = Polygons {
            placed: PlacedMesh { mesh, transform: Similarity::default() },
            material: &Material::default(),
            color: [1.0; 3],
            optical_depth,
            object: 0,
            shadow_coefficient: 1.0,
            casts_shadow: true,
            radius: 0.0,
        };
        let receivers = [DVec3::splat(-1.0), DVec3::ONE];
        let light = Light { shape, intensity: [1.0; 3] };
        let sampled = SampledLight { light: &light, samples };
        let limits = DepthLimits { most_pixels: 128, most_bytes: 1 << 24 };
        LightDepths::new(&[&polygons], sampled, &receivers, limits, &Progress::new()).unwrap().unwrap()
    }

    const SUN: LightShape = LightShape::Directional { direction: DVec3::NEG_Z };
    const LAMP: LightShape = LightShape::Point { position: DVec3::new(0.1, 0.2, 3.0) };
    const BULB: LightShape = LightShape::Sphere { center: DVec3::new(0.1, 0.2, 3.0), radius: 0.2 };

    /// What is asked beside a polygon's edge follows its plane beyond the edge.
    #[test]
    fn blocks_say_of_a_way_what_each_of_its_places_says() {
        let mesh = triangles();
        for shape in [SUN, LAMP] {
            let depths = depths(&mesh, f32::INFINITY, shape, 1);
            let mut told = [0; 2];
            for k in 0..20_000 {
                let from = place(5000 + k);
                let way = Way { from, to: from + 0.1 * place(50_000 + k) };
                let Some(is_lit) = depths.is_whole(&depths.points[0], &way) else {
                    continue;
                };
                told[usize::from(is_lit)] += 1;
                for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    let seen = depths.visibility_of_point(&depths.points[0], way.place(share), None).x;
                    assert_eq!(seen, f32::from(u8::from(is_lit)), "{way:?} at {share}");
                }
            }
            assert!(told[0] > 50 && told[1] > 1000, "{told:?}");
        }
    }

    #[test]
    fn neighbouring_ways_are_lit_as_each_is_alone() {
        let mesh = triangles();
        // With their number of points.
        for (shape, samples, optical_depth) in [
            (SUN, 1, f32::INFINITY),
            (LAMP, 1, f32::INFINITY),
            (LAMP, 1, 0.7),
            (BULB, 9, f32::INFINITY),
            (BULB, 9, 0.7),
        ] {
            let depths = depths(&mesh, optical_depth, shape, samples);
            let count = depths.points.len();
            let mut told = [0; 3];
            for k in 0..2000 {
                let from = place(5000 + k);
                let lane = |lane: u64| {
                    let from = from + 0.02 * place(90_000 + 8 * k + lane);
                    // Rays that nobody wants are among them.
                    (lane != 5).then_some(Way { from, to: from + 0.05 * place(50_000 + k) })
                };
                let ways: Vec<Option<Way>> = (0..8).map(lane).collect();
                let mut by_point = Vec::new();
                let together = depths.lit(&ways, &mut by_point);
                for (lane, way) in ways.iter().enumerate().filter(|(_, way)| way.is_some()) {
                    let mut alone_by_point = Vec::new();
                    let alone = depths.lit(&[*way], &mut alone_by_point);
                    let is_whole = together.is_none_or(|ways| ways[lane].is_whole());
                    assert_eq!(is_whole, alone.is_none(), "{way:?}");
                    if let (Some(together), Some([alone, ..])) = (together, alone) {
                        assert_eq!(together[lane].parts(), alone.parts(), "{way:?}");
                    }
                    if let Some(reached) = by_point.get(lane * count..(lane + 1) * count) {
                        let none = vec![0.0; count];
                        let alone = if alone_by_point.is_empty() { &none } else { &alone_by_point };
                        assert_eq!(reached, alone, "{way:?}");
                    }
                }
                let is_dark = together.is_some_and(|ways| ways[0].parts().iter().all(|part| part.to == part.from));
                told[if together.is_none() {
                    0
                } else if is_dark {
                    1
                } else {
                    2
                }] += 1;
            }
            let is_dark_somewhere = optical_depth.is_infinite();
            assert!(told[0] > 20 && told[2] > 20 && (told[1] > 20) == is_dark_somewhere, "{told:?} of {samples}");
        }
    }
}
