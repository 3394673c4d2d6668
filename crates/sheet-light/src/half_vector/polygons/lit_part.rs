//! Partial slabs for the light: of a ray's part in a slab, what polygons let light come to (section 4.1, Figure 7).
//!
//! Only lit parts scatter. Of τ·∫₀¹ e^(−τx)·… dx keep the intervals [a, b] that are lit. Treat each as a ray of its own behind the optical
//! depth τ·a, and weigh its result by the opacity of the whole ray.

use super::light_depth::LightDepths;
use super::lit_way::{MOST_PARTS, WayPart};
use crate::half_vector::light::path::{RayEnds, stored};
use crate::half_vector::slicing::frame::Frame;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// What of the way of neighbouring pixels' rays through a slab light reaches.
pub(crate) struct LitParts {
    parts: [LitPart; MOST_PARTS],
    /// Most parts of a ray.
    count: usize,
    /// How much of the way each point of the light reaches, ray by ray, times its share of the light; 0 for all where each reaches all. Empty for a
    /// light of one point.
    pub(crate) by_point: Vec<f32>,
}

/// A part of each ray's way: shares at which it begins and ends, from the end that is nearer to the eye, and what comes to it, by channel.
#[derive(Clone, Copy)]
pub(crate) struct LitPart {
    from: [f32; MAX_LANES],
    to: [f32; MAX_LANES],
    through: [[f32; MAX_LANES]; 3],
}

impl LitParts {
    /// Of rays between two ends; `None` where all of them are lit, of those that are wanted.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        _: S,
        depths: &LightDepths,
        frame: &Frame,
        ends: &RayEnds<S>,
        is_wanted: &[f32; MAX_LANES],
    ) -> Option<Self> {
        let nearer = stored(&ends.nearer);
        let farther = stored(&ends.farther);
        let mut out = Self { parts: [LitPart::DARK; MOST_PARTS], count: 1, by_point: Vec::new() };
        // Rays that nobody wants are of no meaning, but are numbers.
        out.parts[0] = LitPart { to: [1.0; MAX_LANES], through: [[1.0; MAX_LANES]; 3], ..LitPart::DARK };
        let mut ways = [None; MAX_LANES];
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| is_wanted[*lane] > 0.0) {
            let world =
                |end: &[[f32; MAX_LANES]; 3]| frame.world(DVec3::from_array([0, 1, 2].map(|a| end[a][lane].into())));
            ways[lane] = Some(depths.way(world(&nearer), world(&farther)));
        }
        let lit = depths.lit(&ways[..Lanes::<S>::COUNT], &mut out.by_point)?;
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| ways[*lane].is_some() && !lit[*lane].is_whole()) {
            out.count = out.count.max(lit[lane].parts().len());
            for (n, part) in out.parts.iter_mut().enumerate() {
                part.set(lane, lit[lane].parts().get(n));
            }
        }
        Some(out)
    }

    /// The parts.
    pub(crate) fn parts(&self) -> &[LitPart] {
        &self.parts[..self.count]
    }
}

impl LitPart {
    const DARK: Self = Self { from: [0.0; MAX_LANES], to: [0.0; MAX_LANES], through: [[0.0; MAX_LANES]; 3] };

    fn set(&mut self, lane: usize, part: Option<&WayPart>) {
        self.from[lane] = part.map_or(0.0, |part| part.from);
        self.to[lane] = part.map_or(0.0, |part| part.to);
        (0..3).for_each(|p| self.through[p][lane] = part.map_or(0.0, |part| part.through[p]));
    }

    /// Where the part begins and ends.
    #[inline(always)]
    pub(crate) fn ends<S: Simd>(&self, simd: S, whole: &RayEnds<S>) -> RayEnds<S> {
        RayEnds {
            nearer: whole.place(Lanes::load(simd, &self.from)),
            farther: whole.place(Lanes::load(simd, &self.to)),
        }
    }

    /// Optical depth of the part in the first `planes`.
    pub(crate) fn optical_depth(&self, whole: &[[f32; MAX_LANES]; 3], planes: usize) -> [[f32; MAX_LANES]; 3] {
        let mut part = *whole;
        for plane in &mut part[..planes] {
            (0..MAX_LANES).for_each(|lane| plane[lane] *= self.to[lane] - self.from[lane]);
        }
        part
    }

    /// Adds mean transmittances of the part to those of the whole, in the first `planes`: e^(−τa)·(1 − e^(−τ(b − a)))/(1 − e^(−τ)), times what comes to
    /// it.
    pub(crate) fn add(
        &self,
        whole: &[[f32; MAX_LANES]; 3],
        through_part: &[[f32; MAX_LANES]; 3],
        planes: usize,
        to: &mut [[f32; MAX_LANES]; 3],
    ) {
        for p in 0..planes {
            for lane in 0..MAX_LANES {
                let tau = whole[p][lane].max(f32::MIN_POSITIVE);
                let length = self.to[lane] - self.from[lane];
                let is_all = length == 1.0 && self.through[p][lane] == 1.0;
                if is_all {
                    to[p][lane] += through_part[p][lane];
                    continue;
                }
                let share = libm::expm1f(-tau * length) / libm::expm1f(-tau);
                // What is too thin for a quotient is lit by its length.
                let share = if share.is_finite() { share } else { length };
                let through = libm::expf(-tau * self.from[lane]) * share * self.through[p][lane];
                to[p][lane] += through_part[p][lane] * through;
            }
        }
    }
}
