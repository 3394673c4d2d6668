//! Partial slabs for the light: of a ray's part in a slab, what a polygon lets light come to (section 4.1, Figure 7).
//!
//! Only that scatters light: of τ·∫₀¹ e^(−τx)·… dx the part from a to b is left, a ray's part of its own behind the optical depth
//! τ·a, and what it has is weighed by the opacity of the whole.

use super::frame::Frame;
use super::light_depth::LightDepths;
use super::light_path::{Places, stored};
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Shares of the way of neighbouring pixels' rays through a slab at which light begins and ends, from the end that is nearer to the eye.
pub(crate) struct LitPart {
    from: [f32; MAX_LANES],
    to: [f32; MAX_LANES],
    /// How much of the way each point of the light reaches, ray by ray, times its share of the light; 0 for all where each reaches all. Empty for a
    /// light of one point.
    pub(crate) by_point: Vec<f32>,
}

impl LitPart {
    /// Of rays between two ends; `None` where all of them are lit, of those that are wanted.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        _: S,
        (depths, frame): (&LightDepths, &Frame),
        [nearer, farther]: &[Places<S>; 2],
        wanted: &[f32; MAX_LANES],
    ) -> Option<Self> {
        let ends = [stored(nearer), stored(farther)];
        let mut part = Self { from: [0.0; MAX_LANES], to: [1.0; MAX_LANES], by_point: Vec::new() };
        let points = depths.points();
        let mut is_whole = true;
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| wanted[*lane] > 0.0) {
            let world =
                |end: &[[f32; MAX_LANES]; 3]| frame.world(DVec3::from_array([0, 1, 2].map(|a| end[a][lane].into())));
            part.by_point.resize(lane * points, 0.0);
            let [from, to] = depths.lit([world(&ends[0]), world(&ends[1])], &mut part.by_point);
            (part.from[lane], part.to[lane]) = (from, to);
            if from <= 0.0 && to >= 1.0 {
                part.by_point.truncate(lane * points);
            } else {
                is_whole = false;
            }
        }
        (!is_whole).then_some(part)
    }

    /// Where the lit part begins and ends.
    #[inline(always)]
    pub(crate) fn ends<S: Simd>(&self, simd: S, [nearer, farther]: &[Places<S>; 2]) -> [Places<S>; 2] {
        let shares = [Lanes::load(simd, &self.from), Lanes::load(simd, &self.to)];
        let mut out = [*nearer, *farther];
        for (end, share) in out.iter_mut().zip(shares) {
            for a in 0..3 {
                end[a] = (farther[a] - nearer[a]).mul_add(share, nearer[a]);
            }
        }
        out
    }

    /// Optical depth of the lit part, by plane.
    pub(crate) fn optical_depth(&self, whole: &[[f32; MAX_LANES]; 3]) -> [[f32; MAX_LANES]; 3] {
        let mut own = *whole;
        for plane in &mut own {
            (0..MAX_LANES).for_each(|lane| plane[lane] *= self.to[lane] - self.from[lane]);
        }
        own
    }

    /// Turns mean transmittances of the lit part into those of the whole: e^(−τa)·(1 − e^(−τ(b − a)))/(1 − e^(−τ)).
    pub(crate) fn weigh(&self, whole: &[[f32; MAX_LANES]; 3], through: &mut [[f32; MAX_LANES]; 3]) {
        for (through, tau) in through.iter_mut().zip(whole) {
            for lane in 0..MAX_LANES {
                let (tau, length) = (tau[lane].max(f32::MIN_POSITIVE), self.to[lane] - self.from[lane]);
                let share = libm::expm1f(-tau * length) / libm::expm1f(-tau);
                // What is too thin for a quotient is lit by its length.
                let share = if share.is_finite() { share } else { length };
                through[lane] *= libm::expf(-tau * self.from[lane]) * share;
            }
        }
    }
}
