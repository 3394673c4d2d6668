//! Light depths: the z-buffer of opaque polygons as a light sees them (step 2 of the pseudocode), and what it says of any place.
//!
//! A pixel has the depth of the nearest polygon and the plane that it lies in. A place is hidden where the plane of a pixel about it
//! lies nearer to the light at the place itself, not at the pixel's middle: so a wall hides what is behind its foot. A place on
//! a surface, for which its own plane lies nearer at the pixel's middle, is not hidden: that is the surface itself as it bends away. So
//! nothing has to be lifted from its own surface. The four pixels about a place are weighed.
//!
//! A light with an extent has such a z-buffer for each of its points, of fewer pixels each, and what they see is averaged (section 5). The
//! paper keeps one z-buffer of the light's centre, fills what lies behind it with a thickness guessed from its gradient and convolves that.
//! Points see the polygons themselves, so nothing has to be guessed: an edge at d1 casts a penumbra 2R·d2/d1 wide at d2 behind it.

use super::light_views::views;
use super::penumbra::received;
use crate::Error;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::triangles::{DepthPlanes, PlacedMesh, resolve_depth};
use splat_core::{Camera, Light, Progress, Receiver, Transmittance, ViewTransform};

/// Rounding of depths: as a share of the extent of what receives, and of the farthest depth.
const ROUNDING: [f64; 2] = [1e-6, 2e-7];

/// How much more is asked for before one surface shadows another.
const SAFETY: f64 = 10.0;

/// How far a plane is followed beside the middle of a pixel, in widths of a pixel.
const STEEPEST: f32 = 8.0;

/// Most parts in which a way is looked at, and pixels of one.
const PARTS: f32 = 16.0;
const PIXELS: f32 = 8.0;

/// Side of a block of pixels, and most blocks that are asked whether all of a way is lit, or none.
const BLOCK: usize = 16;
const MOST_BLOCKS: usize = 36;

/// How far from its ends a way is looked at, as a share of it.
const INSET: f32 = 1.0 / 1024.0;

/// Halvings that find where light ends on a way.
const HALVINGS: usize = 10;

/// Least side of the image of a point, where a light has many.
const LEAST_SIDE: u32 = 16;

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
    /// Least and greatest depth of each block.
    blocks: Vec<[f32; 2]>,
    transform: ViewTransform,
    focal: f32,
    size: [usize; 2],
    is_parallel: bool,
}

/// A place as a view sees it: x right, y down, z depth.
struct Sighted<'a> {
    view: &'a View,
    at: Vec3,
    pixel: [f32; 2],
}

impl LightDepths {
    /// Of as many points of a light, for what receives at any of these places, of which there is at least one, in images that have
    /// together no more pixels than one of `most` a side; `None` where nothing casts shadows.
    pub(crate) fn new(
        casters: &[PlacedMesh<'_>],
        (light, samples): (&Light, u32),
        receivers: &[DVec3],
        most: u32,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        if casters.is_empty() || receivers.is_empty() {
            return Ok(None);
        }
        let (low, high) =
            receivers.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let origin = low + 0.5 * (high - low);
        let lights = Light { intensity: [1.0; 3], ..*light }.points(samples);
        let (shares, _) = received(light, &lights, origin);
        let (mut points, mut farthest) = (Vec::with_capacity(lights.len()), 0.0f64);
        for (light, share) in lights.iter().zip(shares) {
            let cameras = views(light, origin, casters, (receivers, side(most, lights.len() as u32)))?;
            for camera in &cameras {
                farthest = receivers.iter().map(|p| camera.view_from_world(*p).z).fold(farthest, f64::max);
            }
            let view = |camera| View::new(casters, camera, origin, progress);
            points.push(PointDepths { views: cameras.iter().map(view).collect::<Result<_, Error>>()?, share });
        }
        let rounding = ROUNDING[0] * (high - low).length() + ROUNDING[1] * farthest;
        Ok(Some(Self { points, origin, bias: (SAFETY * rounding) as f32, rounding: rounding as f32 }))
    }

    /// Bytes of the images of one light with so many points at most.
    pub(crate) fn bytes_of(most: u32, samples: u32) -> u64 {
        let pixels = u64::from(side(most, samples)).pow(2);
        // Of six views each has half as many pixels a side; while one is made it has depths in double precision too.
        u64::from(samples) * pixels * 3 / 2 * 12 + pixels * 8
    }

    /// Bytes of the images.
    pub(crate) fn bytes(&self) -> u64 {
        let views = self.points.iter().flat_map(|point| &point.views);
        views.map(|view| 12 * view.planes.depth.len() as u64).sum()
    }

    /// Share of the light that polygons let through to a world position, which lies on a surface of this normal or in the open.
    pub(crate) fn visibility(&self, world: DVec3, face: Option<Vec3>) -> f32 {
        self.visible(world, face).sum()
    }

    /// The same by the points of the light.
    pub(crate) fn visible(&self, world: DVec3, face: Option<Vec3>) -> impl Iterator<Item = f32> {
        let place = (world - self.origin).as_vec3();
        self.points.iter().map(move |point| point.share * self.at(point, place, face))
    }

    fn at(&self, point: &PointDepths, place: Vec3, face: Option<Vec3>) -> f32 {
        let Some(sighted) = point.views.iter().find_map(|view| view.sight(place)) else { return 1.0 };
        // In the open nothing lies on a surface but what is behind it: the end of a way.
        let bias = if face.is_some() { self.bias } else { -self.rounding };
        sighted.visibility(bias, face.map(|face| sighted.view.turned(face)))
    }

    /// Points of the light.
    pub(crate) fn points(&self) -> usize {
        self.points.len()
    }

    /// Which part of a way between world positions light reaches: shares at which that begins and ends. Where it is reached here
    /// and there, or by some of the light's points, a part as long as all these, about their middle. How much of it each point reaches, times its
    /// share of the light, is added to `by_point` where there are several.
    pub(crate) fn lit(&self, ends: [DVec3; 2], by_point: &mut Vec<f32>) -> [f32; 2] {
        let ends = ends.map(|p| (p - self.origin).as_vec3());
        if let [point] = &self.points[..] {
            return self.lit_by(point, ends);
        }
        let (mut sum, mut moment, mut is_whole) = (0.0, 0.0, true);
        for point in &self.points {
            let [from, to] = self.lit_by(point, ends);
            is_whole &= [from, to] == [0.0, 1.0];
            by_point.push(point.share * (to - from));
            sum += point.share * (to - from);
            moment += point.share * 0.5 * (to - from) * (from + to);
        }
        if is_whole { [0.0, 1.0] } else { part_of(sum, moment) }
    }

    /// The same of one point, from its origin.
    fn lit_by(&self, point: &PointDepths, [from, to]: [Vec3; 2]) -> [f32; 2] {
        let at = |share: f32| self.at(point, from + (to - from) * share, None);
        let seen = point.views.iter().find_map(|view| Some([view.sight(from)?, view.sight(to)?]));
        if let Some(is_lit) = seen.as_ref().and_then(|ends| ends[0].view.whole(ends, self.rounding)) {
            return [0.0, if is_lit { 1.0 } else { 0.0 }];
        }
        let length =
            seen.map_or(f32::INFINITY, |[a, b]| (a.pixel[0] - b.pixel[0]).abs().max((a.pixel[1] - b.pixel[1]).abs()));
        let parts = (length / PIXELS).ceil().clamp(2.0, PARTS);
        // Ends lie on polygons that end the way: whether these are in the light is asked before them.
        let looked = |share: f32| at(share.clamp(INSET, 1.0 - INSET));
        let (mut sum, mut moment, mut here) = (0.0, 0.0, looked(0.0));
        let mut is_whole = here == 1.0;
        for part in 0..parts as usize {
            let [low, high] = [part, part + 1].map(|n| n as f32 / parts);
            let next = looked(high);
            // Lit to some extent up to the edge, and to another from there on.
            let edge = if here == next { high } else { edge(&looked, [low, high], [here, next]) };
            for (lit, [from, to]) in [(here, [low, edge]), (next, [edge, high])] {
                sum += lit * (to - from);
                moment += lit * (to - from) * 0.5 * (from + to);
            }
            is_whole &= next == 1.0;
            here = next;
        }
        if is_whole { [0.0, 1.0] } else { part_of(sum, moment) }
    }
}

/// Pixels along a side of the image of each of so many points.
fn side(most: u32, points: u32) -> u32 {
    let each = (f64::from(most) / f64::from(points.max(1)).sqrt()) as u32;
    each.max(LEAST_SIDE.min(most))
}

/// A part of a way as long as `sum`, about its middle, which is `moment` over that.
fn part_of(sum: f32, moment: f32) -> [f32; 2] {
    if sum <= 0.0 {
        return [0.0; 2];
    }
    let from = (moment / sum - 0.5 * sum).clamp(0.0, (1.0 - sum).max(0.0));
    [from, (from + sum).min(1.0)]
}

/// Where light changes from what it is at one end of a part to what it is at the other.
fn edge(at: &impl Fn(f32) -> f32, [low, high]: [f32; 2], [here, next]: [f32; 2]) -> f32 {
    let (mut before, mut behind) = (low, high);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (before + behind);
        let seen = at(middle);
        if (seen - here).abs() < (seen - next).abs() { before = middle } else { behind = middle }
    }
    0.5 * (before + behind)
}

impl View {
    fn new(casters: &[PlacedMesh<'_>], camera: &Camera, origin: DVec3, progress: &Progress) -> Result<Self, Error> {
        let planes = resolve_depth(casters, camera, Some(progress)).map_err(Error::of_polygons)?;
        let size = camera.size.map(|s| s as usize);
        Ok(Self {
            blocks: blocks(&planes.depth, size),
            planes,
            transform: camera.view_from_offset(origin),
            focal: camera.focal_px() as f32,
            size,
            is_parallel: camera.is_orthographic(),
        })
    }

    fn sight(&self, place: Vec3) -> Option<Sighted<'_>> {
        let p = self.transform.apply(place);
        let at = Vec3::new(p.x, -p.y, p.z);
        let scale = if self.is_parallel { self.focal } else { self.focal / at.z };
        let pixel = [0, 1].map(|a| 0.5 * self.size[a] as f32 + at[a] * scale);
        let is_seen = at.z > 0.0 && (0..2).all(|a| pixel[a] >= 0.0 && pixel[a] <= self.size[a] as f32);
        is_seen.then_some(Sighted { view: self, at, pixel })
    }

    /// Width of a pixel at a depth, world units.
    fn width(&self, depth: f32) -> f32 {
        if self.is_parallel { self.focal.recip() } else { depth / self.focal }
    }

    /// Whether all of a way is lit, or none, where blocks of pixels tell.
    fn whole(&self, [a, b]: &[Sighted<'_>; 2], rounding: f32) -> Option<bool> {
        let (near, far) = (a.at.z.min(b.at.z), a.at.z.max(b.at.z));
        let reach = STEEPEST * self.width(far) + rounding;
        let [columns, rows] = [0, 1].map(|axis| {
            // A look-up asks the pixels about a place.
            let [low, high] = [a.pixel[axis].min(b.pixel[axis]) - 1.0, a.pixel[axis].max(b.pixel[axis]) + 1.0];
            let block = |v: f32| (v.max(0.0) as usize).min(self.size[axis] - 1) / BLOCK;
            block(low)..block(high) + 1
        });
        if columns.len() * rows.len() > MOST_BLOCKS {
            return None;
        }
        let (mut is_lit, mut is_dark) = (true, true);
        for y in rows {
            for [least, most] in &self.blocks[y * self.size[0].div_ceil(BLOCK)..][columns.clone()] {
                (is_lit, is_dark) = (is_lit && *least > far + reach, is_dark && *most < near - reach);
            }
        }
        (is_lit || is_dark).then_some(is_lit)
    }

    /// A world direction as the view sees it.
    fn turned(&self, direction: Vec3) -> Vec3 {
        let v = self.transform.rotation * direction;
        Vec3::new(v.x, -v.y, v.z)
    }
}

impl Sighted<'_> {
    fn visibility(&self, bias: f32, face: Option<Vec3>) -> f32 {
        let View { planes, size, is_parallel, .. } = self.view;
        let (mut low, mut share) = ([0; 2], [0.0; 2]);
        for a in 0..2 {
            let place = (self.pixel[a] - 0.5).clamp(0.0, (size[a] - 1) as f32);
            low[a] = (place as usize).min(size[a].saturating_sub(2));
            share[a] = place - low[a] as f32;
        }
        let width = self.view.width(self.at.z);
        let (mut hidden, mut count) = (0.0, 0);
        for corner in 0..4 {
            let at = [corner & 1, corner >> 1];
            let [x, y] = [0, 1].map(|a| (low[a] + at[a]).min(size[a] - 1));
            let weight = [0, 1].map(|a| if at[a] == 0 { 1.0 - share[a] } else { share[a] });
            let middle = [x as f32 + 0.5, y as f32 + 0.5];
            let k = y * size[0] + x;
            let there = planes.depth[k];
            let beside = planes.at(k, [self.pixel[0] - middle[0], self.pixel[1] - middle[1]], *is_parallel);
            let reach = STEEPEST * width;
            let is_before = beside.clamp(there - reach, there + reach) < self.at.z - bias
                && face.is_none_or(|face| there < self.plane_at(face, middle) - bias);
            if is_before {
                (hidden, count) = (hidden + weight[0] * weight[1], count + 1);
            }
        }
        // Nothing is lit by rounding.
        if count == 4 { 0.0 } else { (1.0f32 - hidden).max(0.0) }
    }

    /// Depth of the plane through the place, of this normal, at the middle of a pixel.
    fn plane_at(&self, face: Vec3, middle: [f32; 2]) -> f32 {
        let View { size, focal, is_parallel, .. } = self.view;
        let [x, y] = [0, 1].map(|a| (middle[a] - 0.5 * size[a] as f32) / focal);
        if *is_parallel {
            return self.at.z - ((x - self.at.x) * face.x + (y - self.at.y) * face.y) / face.z;
        }
        let along = x * face.x + y * face.y + face.z;
        self.at.dot(face) / along
    }
}

/// Least and greatest depth of each block of an image.
fn blocks(depth: &[f32], [width, height]: [usize; 2]) -> Vec<[f32; 2]> {
    let columns = width.div_ceil(BLOCK);
    let mut all = vec![[f32::INFINITY, f32::NEG_INFINITY]; columns * height.div_ceil(BLOCK)];
    for (k, depth) in depth.iter().enumerate() {
        let [least, most] = &mut all[k / width / BLOCK * columns + k % width / BLOCK];
        (*least, *most) = (least.min(*depth), most.max(*depth));
    }
    all
}

/// What polygons and all else that is not carried let through together.
pub(crate) struct Beside<'a> {
    pub(crate) depths: &'a LightDepths,
    pub(crate) others: Option<&'a dyn Transmittance>,
    /// What places of receivers are relative to.
    pub(crate) origin: DVec3,
}

impl Transmittance for Beside<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let visible = self.depths.visibility(self.origin + receiver.position.as_dvec3(), None);
        if visible == 0.0 {
            return [0.0; 3];
        }
        self.others.map_or([1.0; 3], |others| others.transmittance(receiver)).map(|t| t * visible)
    }
}
