//! One splat as the rays of a tile meet it: the optical depth and the view depth of each fragment.

use super::gaussian;
use super::kernel::Kernel;
use super::lanes::{Broadcast, Lanes};
use super::projected::{Projected, ProjectedDepth, ProjectedSplat, SpecialDisc};
use super::special;
use super::tile::{Run, tile_of};
use crate::SplatKind;
use pulp::Simd;

/// The rays of one tile, and where opaque surfaces end them.
#[derive(Debug, Clone)]
pub struct TileRays {
    /// 1/|d|² of each pixel's ray, 1 for parallel rays.
    factors: Vec<f32>,
    is_perspective: bool,
    /// Depth of the opaque surface, +∞ without; empty when no pixel has one.
    opaque: Vec<f32>,
    /// The least and the largest of these depths.
    ends: [f32; 2],
}

/// Where a splat lies by the opaque surfaces of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    /// Before all of them, or there are none.
    Before,
    /// Before some, or through them.
    Among,
    /// Behind all.
    Behind,
}

/// One splat, ready for fragments.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// Its footprint.
    pub splat: &'a ProjectedSplat,
    /// Of a disc of which its conic does not tell everything.
    pub(crate) special: Option<&'a SpecialDisc>,
    /// Only defined where the projection has depths.
    pub(crate) depth: ProjectedDepth,
    pub(crate) kernel: &'a Kernel,
    /// Whether the opaque surfaces of a tile, if it has any, may hide a part of it.
    pub(crate) is_met: bool,
}

impl TileRays {
    /// The rays of the tile whose first pixel is `corner`; `opaque` has the view depth of what hides splats at each pixel of the image,
    /// or nothing.
    pub fn new(projected: &Projected, opaque: &[f32], corner: [usize; 2]) -> Self {
        let mut opaque = tile_of(opaque, projected.size, corner, f32::INFINITY);
        if opaque.iter().all(|d| *d == f32::INFINITY) {
            opaque.clear();
        }
        let ends = [f32::min, f32::max].map(|extreme| opaque.iter().copied().reduce(extreme).unwrap_or(f32::INFINITY));
        Self { factors: projected.ray_factors(corner), is_perspective: projected.is_perspective(), opaque, ends }
    }

    /// Where a splat lies, as far as it is told without a look at pixels: what a kernel or a plane tells of each of them is the same.
    #[inline(always)]
    pub(crate) fn place(&self, source: &Source<'_>) -> Place {
        let ProjectedDepth { center, slope, extent, .. } = source.depth;
        let [near, far] = self.ends;
        let before = if self.opaque.is_empty() {
            true
        } else if source.special.is_some() || source.splat.is_gaussian() {
            false
        } else if source.splat.kind == SplatKind::Medium {
            (near - center) * slope[0] >= 1.0
        } else {
            center + extent < near
        };
        let behind = !self.opaque.is_empty() && source.is_behind(far);
        match (before, behind) {
            (true, _) => Place::Before,
            (_, true) => Place::Behind,
            _ => Place::Among,
        }
    }

    /// Whether nothing opaque is in the tile.
    pub(crate) fn are_free(&self) -> bool {
        self.opaque.is_empty()
    }

    /// 1/|d|² of the pixels of a run.
    #[inline(always)]
    pub(crate) fn factors<S: Simd>(&self, simd: S, run: Run<S>) -> Lanes<S> {
        Lanes::load(simd, &self.factors[run.pixel()..])
    }
}

impl<'a> Source<'a> {
    /// Splat `i` of a projection.
    pub fn new(projected: &'a Projected, i: u32) -> Self {
        let splat = &projected.splats[i as usize];
        Self {
            splat,
            special: projected.special_disc(splat, i),
            depth: projected.depths.get(i as usize).copied().unwrap_or_default(),
            kernel: projected.kernel(splat),
            is_met: true,
        }
    }

    /// Whether it lies behind surfaces that are nowhere farther than so deep, as far as it is told without a look at pixels.
    #[inline(always)]
    pub(crate) fn is_behind(&self, farthest: f32) -> bool {
        let ProjectedDepth { center, slope, extent, .. } = self.depth;
        if self.special.is_some() || self.splat.is_gaussian() {
            false
        } else if self.splat.kind == SplatKind::Medium {
            (farthest - center) * slope[0] <= -1.0 && slope[1] >= 1.0
        } else {
            center - extent >= farthest
        }
    }

    /// τ of a run of pixels, before a material's factor for each channel. What lies behind an opaque surface does not count: of a
    /// disc by its plane, of a medium by the share of its kernel.
    #[inline(always)]
    pub fn optical_depth<S: Simd>(&self, simd: S, run: Run<S>, rays: &TileRays) -> Lanes<S> {
        match self.special {
            None if self.splat.is_gaussian() => self.of_gaussian(simd, run, rays),
            None => self.before_the_eye(simd, run, rays),
            Some(disc) => self.of_special(simd, run, rays, disc),
        }
    }

    /// Whether [`Source::of_kernel`] tells τ.
    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        self.special.is_none() && !self.splat.is_gaussian() && !self.is_met
    }

    /// τ by the kernel alone, from s as [`Run::distance_sq`] has it.
    #[inline(always)]
    pub(crate) fn of_kernel<S: Simd>(&self, simd: S, s: Lanes<S>, run: Run<S>, rays: &TileRays) -> Lanes<S> {
        let t = if self.splat.kind == SplatKind::Medium {
            s.negate_mul_add(rays.factors(simd, run), simd.lanes(1.0))
        } else {
            simd.lanes(1.0) - s
        };
        simd.lanes(self.splat.peak) * self.kernel.profile(simd, t.max(simd.lanes(0.0)))
    }

    #[inline(always)]
    fn before_the_eye<S: Simd>(&self, simd: S, run: Run<S>, rays: &TileRays) -> Lanes<S> {
        let medium = self.splat.kind == SplatKind::Medium;
        let mut tau = self.of_kernel(simd, run.distance_sq(simd, self.splat), run, rays);
        if self.is_met && !rays.opaque.is_empty() {
            let opaque = Lanes::load(simd, &rays.opaque[run.pixel()..]);
            tau = if medium {
                // What is seen is the part between the eye and the surface, as a share of all before the eye.
                let [per_depth, per_front] = self.depth.slope;
                let distance = (opaque - simd.lanes(self.depth.center)) * simd.lanes(per_depth);
                let behind = simd.lanes(1.0) - self.kernel.share_before(simd, distance);
                tau * behind.negate_mul_add(simd.lanes(per_front), simd.lanes(1.0)).max(simd.lanes(0.0))
            } else {
                tau.where_less(run.depth(simd, &self.depth), opaque)
            };
        }
        tau
    }

    #[inline(always)]
    fn of_gaussian<S: Simd>(&self, simd: S, run: Run<S>, rays: &TileRays) -> Lanes<S> {
        let tau = gaussian::optical_depth(simd, self.splat.peak, run.distance_sq(simd, self.splat));
        if rays.opaque.is_empty() {
            return tau;
        }
        let before = Lanes::load(simd, &rays.opaque[run.pixel()..]) - run.depth(simd, &self.depth);
        tau * self.kernel.share_before(simd, before * simd.lanes(self.depth.core[0]))
    }

    #[inline(always)]
    fn of_special<S: Simd>(&self, simd: S, run: Run<S>, rays: &TileRays, disc: &SpecialDisc) -> Lanes<S> {
        let [profile, depth] = special::profile(simd, run, self.splat, disc, self.kernel, rays.is_perspective);
        let mut tau = simd.lanes(self.splat.peak) * profile;
        if disc.slab[1] > 0.0 && rays.is_perspective {
            let w = simd.lanes(disc.center) / depth;
            let ray = rays.factors(simd, run).sqrt();
            tau = tau * simd.lanes(disc.slab[1]) / ((simd.lanes(disc.slab[0]) * w).abs() * ray).max(simd.lanes(1e-3));
        }
        if !rays.opaque.is_empty() {
            tau = tau.where_less(depth, Lanes::load(simd, &rays.opaque[run.pixel()..]));
        }
        tau
    }

    /// View depths of a run of pixels; a medium has its centre's, and nothing lies behind the eye.
    ///
    /// Defined where the projection was made with depths.
    #[inline(always)]
    pub fn view_depth<S: Simd>(&self, simd: S, run: Run<S>, rays: &TileRays) -> Lanes<S> {
        match self.special {
            Some(disc) => run.meet(simd, self.splat, disc, rays.is_perspective)[1],
            None if self.splat.kind == SplatKind::Medium => simd.lanes(self.depth.center.max(0.0)),
            None => run.depth(simd, &self.depth),
        }
    }

    /// How thick it is along a ray: a medium's cell, 0 for a surface and a Gaussian. Defined where the projection was made with depths.
    #[inline(always)]
    pub fn thickness(&self) -> f32 {
        if self.splat.kind == SplatKind::Medium && !self.splat.is_gaussian() {
            self.depth.extent * self.kernel.spacing
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::bins::bin;
    use crate::raster::tile::Runs;
    use crate::raster::{Detail, Params, ProjectInput, project};
    use crate::{Camera, Cloud, FootprintStack, Material, Projection, Splat, rng};
    use glam::{DVec3, Vec3};

    /// Bits of the optical depths of a splat in a tile.
    struct Depths<'a>(Source<'a>, &'a TileRays, [usize; 2], [u32; 2]);

    impl pulp::WithSimd for Depths<'_> {
        type Output = Vec<u32>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<u32> {
            let Self(source, rays, corner, size) = self;
            let mut bits = Vec::new();
            for run in Runs::new(simd, source.splat, size, corner) {
                let mut tau = vec![0.0; Lanes::<S>::COUNT];
                source.optical_depth(simd, run, rays).store(&mut tau);
                bits.extend(tau.into_iter().map(f32::to_bits));
            }
            bits
        }
    }

    #[test]
    fn what_lies_before_or_behind_all_that_is_opaque_is_what_each_pixel_finds() {
        let size = [96, 64];
        let unit = |i: usize, stream: u64| rng::unit_f32(3, stream, i as u64, 0);
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..8000 {
            let [x, y, z, u, v] = [0, 1, 2, 3, 4].map(|stream| unit(i, stream) - 0.5);
            let (kind, normal) = match i % 2 {
                0 => (SplatKind::Medium, Vec3::ZERO),
                _ => (SplatKind::Surface, Vec3::new(u, v, 0.3).normalize()),
            };
            let position = Vec3::new(3.0 * x, 2.0 * y, 3.0 * z);
            cloud.push(&Splat { position, radius: 0.15, cross_section: 0.01, kind, normal, ..Splat::default() });
        }
        for view in [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 2.0 }] {
            let camera = Camera::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, view, size).unwrap();
            let footprints = &FootprintStack::default();
            let materials = &[Material::default()];
            let cloud = &cloud;
            let camera = &camera;
            let params = &Params::default();
            let detail = Detail::ALL;
            let projected = project(&ProjectInput { cloud, camera, footprints, materials, params, detail });
            // A slope with a hole.
            let depth = |i: u32| if i % size[0] < 40 { f32::INFINITY } else { 2.5 + (i / size[0]) as f32 / 64.0 };
            let opaque: Vec<f32> = (0..size[0] * size[1]).map(depth).collect();
            let ids: Vec<u32> = (0..cloud.len() as u32).collect();
            let bins = bin(&projected, &ids);
            let mut found = [0; 3];
            for t in 0..bins.tiles() {
                let rays = TileRays::new(&projected, &opaque, bins.corner(t));
                for id in bins.tile(t).flatten() {
                    let source = Source::new(&projected, *id);
                    let depths = |source| pulp::Arch::new().dispatch(Depths(source, &rays, bins.corner(t), size));
                    let place = rays.place(&source);
                    let each = depths(source);
                    found[place as usize] += 1;
                    match place {
                        Place::Before => assert_eq!(each, depths(Source { is_met: false, ..source }), "splat {id}"),
                        Place::Behind => assert!(each.iter().all(|tau| *tau == 0), "splat {id}"),
                        Place::Among => {}
                    }
                }
            }
            assert!(found.iter().all(|n| *n > 100), "{found:?} before, among and behind");
        }
    }
}
