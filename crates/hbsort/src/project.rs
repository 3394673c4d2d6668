//! Step 1 (Figure 9): view culling and view depths, with the nearest and farthest kept depth and the smallest radius.
//!
//! A splat is the sphere of its cutoff radius r around its view position (x, y, z); of an elliptical disc r is the
//! longer semi-axis. It is kept when z > −r and |x|·c − z·s − h ≤ r, the same for y: (c, s, h) = (cos φ, sin φ, 0) for
//! a pinhole with half angle φ, (1, 0, half extent) for parallel rays. Behind the eye the test takes |z|: the mirror image of
//! a pixel's ray passes such a splat, and a renderer counts the share of it that lies before the eye plane. The paper
//! tests centres alone, but a splat whose centre lies outside may still reach into the image.

use crate::scratch::CHUNK;
use glam::Vec3;
use rayon::prelude::*;
use splat_core::{Camera, Cloud, ViewTransform};

/// Splats that are projected at once, in vector registers.
const LANES: usize = 16;

/// Marks a culled splat in the place of its depth.
pub(crate) const CULLED: f32 = f32::NAN;

/// The side planes of the view, as two slopes by symmetry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frustum {
    pub(crate) cos: [f32; 2],
    pub(crate) sin: [f32; 2],
    pub(crate) half: [f32; 2],
}

impl Frustum {
    pub(crate) fn new(camera: &Camera, margin_px: f64) -> Self {
        let extent = camera.size.map(|s| (0.5 * f64::from(s) + margin_px.max(0.0)) / camera.focal_px());
        if camera.is_orthographic() {
            return Self { cos: [1.0; 2], sin: [0.0; 2], half: extent.map(|e| e as f32) };
        }
        let length = extent.map(|e| libm::hypot(e, 1.0));
        let sin = [extent[0] / length[0], extent[1] / length[1]].map(|v| v as f32);
        Self { cos: length.map(|l| (1.0 / l) as f32), sin, half: [0.0; 2] }
    }

    #[inline(always)]
    fn keeps(&self, p: Vec3, radius: f32) -> bool {
        let x = p.x.abs() * self.cos[0] - p.z.abs() * self.sin[0] - self.half[0];
        let y = p.y.abs() * self.cos[1] - p.z.abs() * self.sin[1] - self.half[1];
        // `&` keeps the lanes free of branches; comparisons with NaN are false, so what is no number is culled.
        (p.z > -radius) & (p.z <= f32::MAX) & (x <= radius) & (y <= radius)
    }
}

/// Extremes of the depths and radii seen, one per lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremes {
    near: [f32; LANES],
    far: [f32; LANES],
    radius: [f32; LANES],
}

impl Extremes {
    pub(crate) const NONE: Self =
        Self { near: [f32::INFINITY; LANES], far: [f32::NEG_INFINITY; LANES], radius: [f32::INFINITY; LANES] };

    #[inline(always)]
    pub(crate) fn take(&mut self, lane: usize, depth: f32, radius: f32) {
        // Comparisons with NaN are false: a culled depth changes nothing.
        self.near[lane] = if depth < self.near[lane] { depth } else { self.near[lane] };
        self.far[lane] = if depth > self.far[lane] { depth } else { self.far[lane] };
        self.radius[lane] = if radius < self.radius[lane] { radius } else { self.radius[lane] };
    }

    pub(crate) fn join(mut self, other: Self) -> Self {
        for l in 0..LANES {
            self.near[l] = self.near[l].min(other.near[l]);
            self.far[l] = self.far[l].max(other.far[l]);
            self.radius[l] = self.radius[l].min(other.radius[l]);
        }
        self
    }

    /// Nearest and farthest kept depth; `None` when nothing was kept. −0 has become +0.
    pub(crate) fn depths(&self) -> Option<(f32, f32)> {
        let near = self.near.iter().copied().fold(f32::INFINITY, f32::min);
        let far = self.far.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        (near <= far).then_some((near + 0.0, far + 0.0))
    }

    /// Smallest radius, of culled splats too, so that ε does not change while the camera moves.
    pub(crate) fn smallest_radius(&self) -> f32 {
        self.radius.iter().copied().fold(f32::INFINITY, f32::min)
    }
}

/// Cutoff radius of the sphere around a splat, the longer semi-axis of a disc.
#[inline(always)]
pub(crate) fn bounding_radius(radius: f32, tangent: Vec3) -> f32 {
    radius.max(tangent.length())
}

/// The view of one cloud.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projector<'a> {
    cloud: &'a Cloud,
    ids: Option<&'a [u32]>,
    view: ViewTransform,
    frustum: Frustum,
}

impl<'a> Projector<'a> {
    pub(crate) fn new(cloud: &'a Cloud, ids: Option<&'a [u32]>, camera: &Camera, margin_px: f64) -> Self {
        let view = camera.view_from_offset(cloud.origin);
        Self { cloud, ids, view, frustum: Frustum::new(camera, margin_px) }
    }

    /// View depth of splat `id`; the same bits as [`Projector::project`] writes.
    pub(crate) fn depth(&self, id: u32) -> f32 {
        self.view.depth(self.cloud.position[id as usize]) + 0.0
    }

    /// Writes the bits of every splat's depth, [`CULLED`] for those outside the view.
    pub(crate) fn project(&self, depth_bits: &mut [u32]) -> Extremes {
        depth_bits
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(c, out)| pulp::Arch::new().dispatch(ProjectChunk { projector: self, begin: c * CHUNK, out }))
            .reduce(|| Extremes::NONE, Extremes::join)
    }

    #[inline(always)]
    fn project_chunk(&self, begin: usize, out: &mut [u32]) -> Extremes {
        let mut extremes = Extremes::NONE;
        match self.ids {
            None => {
                let (position, _) = self.cloud.position[begin..].as_chunks();
                let (radius, _) = self.cloud.radius[begin..].as_chunks();
                let (blocks, rest) = out.as_chunks_mut();
                let mut id = begin;
                for ((out, position), radius) in blocks.iter_mut().zip(position).zip(radius) {
                    *out = self.project_block(position, radius, |l| Some(id + l), &mut extremes);
                    id += LANES;
                }
                let last = id + rest.len();
                self.project_gathered(|l| (id + l < last).then_some(id + l), rest, &mut extremes);
            }
            Some(ids) => {
                for (ids, out) in ids[begin..].chunks(LANES).zip(out.chunks_mut(LANES)) {
                    self.project_gathered(|l| ids.get(l).map(|id| *id as usize), out, &mut extremes);
                }
            }
        }
        extremes
    }

    /// A block whose splats do not lie side by side, or are fewer than [`LANES`].
    #[inline(always)]
    fn project_gathered(&self, id: impl Fn(usize) -> Option<usize>, out: &mut [u32], extremes: &mut Extremes) {
        // Lanes without a splat are culled, and change nothing.
        let mut position = [Vec3::NAN; LANES];
        let mut radius = [f32::INFINITY; LANES];
        for l in 0..LANES {
            if let Some(id) = id(l) {
                (position[l], radius[l]) = (self.cloud.position[id], self.cloud.radius[id]);
            }
        }
        let depth_bits = self.project_block(&position, &radius, id, extremes);
        out.copy_from_slice(&depth_bits[..out.len()]);
    }

    /// A block in vectors. The radii of most splats keep them already, and the tangents of those are not read.
    #[inline(always)]
    fn project_block(
        &self,
        position: &[Vec3; LANES],
        radius: &[f32; LANES],
        id: impl Fn(usize) -> Option<usize>,
        extremes: &mut Extremes,
    ) -> [u32; LANES] {
        let view = std::array::from_fn(|l| self.view_of(position[l]));
        let mut depth = self.depths(&view, radius);
        if !self.cloud.tangent.is_empty() && depth.iter().any(|d| d.is_nan()) {
            let tangent = |l| id(l).map_or(Vec3::ZERO, |id| self.cloud.tangent_of(id));
            depth = self.depths(&view, &std::array::from_fn(|l| bounding_radius(radius[l], tangent(l))));
        }
        for l in 0..LANES {
            extremes.take(l, depth[l], radius[l]);
        }
        depth.map(f32::to_bits)
    }

    /// Depths of the splats that their bounding radii keep, [`CULLED`] for the others.
    #[inline(always)]
    fn depths(&self, view: &[Vec3; LANES], bound: &[f32; LANES]) -> [f32; LANES] {
        // + 0.0 turns −0 into +0: equal depths have equal bits.
        std::array::from_fn(|l| if self.frustum.keeps(view[l], bound[l]) { view[l].z + 0.0 } else { CULLED })
    }

    #[inline(always)]
    fn view_of(&self, p: Vec3) -> Vec3 {
        let m = &self.view.rotation;
        let t = self.view.translation;
        // The order of operations of ViewTransform::depth, so that the bits agree.
        Vec3::new(
            m.x_axis.x * p.x + m.y_axis.x * p.y + m.z_axis.x * p.z + t.x,
            m.x_axis.y * p.x + m.y_axis.y * p.y + m.z_axis.y * p.z + t.y,
            m.x_axis.z * p.x + m.y_axis.z * p.y + m.z_axis.z * p.z + t.z,
        )
    }
}

/// One chunk's work, in the form that [`pulp`] compiles once per instruction set.
struct ProjectChunk<'a> {
    projector: &'a Projector<'a>,
    begin: usize,
    out: &'a mut [u32],
}

impl pulp::NullaryFnOnce for ProjectChunk<'_> {
    type Output = Extremes;

    #[inline(always)]
    fn call(self) -> Extremes {
        // A copy that lives in registers, which writing the depths cannot change.
        let projector = *self.projector;
        projector.project_chunk(self.begin, self.out)
    }
}

/// As [`ProjectChunk`], for ready depths.
struct ScanChunk<'a>(&'a [f32]);

impl pulp::NullaryFnOnce for ScanChunk<'_> {
    type Output = (Extremes, bool);

    #[inline(always)]
    fn call(self) -> (Extremes, bool) {
        scan(self.0)
    }
}

/// Extremes of ready depths, or the first one that is not finite.
pub(crate) fn extremes_of(depth: &[f32]) -> Result<Extremes, crate::Error> {
    let (extremes, finite) = depth
        .par_chunks(CHUNK)
        .map(|chunk| pulp::Arch::new().dispatch(ScanChunk(chunk)))
        .reduce(|| (Extremes::NONE, true), |a, b| (a.0.join(b.0), a.1 & b.1));
    if finite {
        return Ok(extremes);
    }
    let index = depth.iter().position(|d| !d.is_finite()).unwrap_or(0);
    Err(crate::Error::Depth { index, found: depth[index] })
}

#[inline(always)]
fn scan(depth: &[f32]) -> (Extremes, bool) {
    let mut extremes = Extremes::NONE;
    let mut worst = [0u32; LANES];
    let (blocks, rest) = depth.as_chunks::<LANES>();
    for block in blocks {
        for l in 0..LANES {
            extremes.take(l, block[l], f32::INFINITY);
            // As integers, infinities and NaN are the greatest of all absolute values.
            worst[l] = worst[l].max(block[l].to_bits() & 0x7fff_ffff);
        }
    }
    for (l, d) in rest.iter().enumerate() {
        extremes.take(l, *d, f32::INFINITY);
        worst[l] = worst[l].max(d.to_bits() & 0x7fff_ffff);
    }
    (extremes, worst.iter().all(|w| f32::from_bits(*w).is_finite()))
}
