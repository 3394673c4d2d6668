//! Colours and thins the particles of another sampler by a field at their places: surfaces whose density of particles is a field (Tanaka
//! 2012, section 6, "non-uniform surface sampling").
//!
//! A Poisson process whose particles are kept independently with probability p(x) is a Poisson process of p(x) times the density.

use crate::particles::PackedColor;
use crate::{Particles, Sampler};
use splat_core::glam::DVec3;
use splat_core::rng;

/// Stage of the random numbers that thin out.
const THINNING: u64 = 0x7368_6f77;

/// Colour, and the share of particles that are kept, in \[0, 1\], at a place in the space of the particles; `None` where they stay as they are.
pub type Look<'a> = dyn Fn(DVec3) -> Option<([f32; 3], f64)> + Sync + 'a;

/// A sampler whose particles show what lies where they are.
pub struct ShownSampler<'a> {
    bare: Box<dyn Sampler + 'a>,
    look: Box<Look<'a>>,
    seed: u64,
}

impl<'a> ShownSampler<'a> {
    /// The particles of `bare`, shown by `look`.
    pub fn new(bare: Box<dyn Sampler + 'a>, look: Box<Look<'a>>, seed: u64) -> Self {
        Self { bare, look, seed }
    }
}

impl Sampler for ShownSampler<'_> {
    fn origin(&self) -> DVec3 {
        self.bare.origin()
    }

    fn cross_section(&self) -> f64 {
        self.bare.cross_section()
    }

    fn chunks(&self) -> usize {
        self.bare.chunks()
    }

    /// At most: how much the looks take away is not known before.
    fn expected(&self, chunk: usize) -> f64 {
        self.bare.expected(chunk)
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        scratch.clear();
        let mut bare = Particles::default();
        let origin = self.origin();
        let bare = self.bare.chunk(set, chunk, &mut bare);
        let draw = rng::bits(self.seed, THINNING, set, chunk as u64);
        for (i, ((position, normal), color)) in bare.position.iter().zip(&bare.normal).zip(&bare.color).enumerate() {
            match (self.look)(origin + position.as_dvec3()) {
                None => scratch.push(*position, *normal, *color),
                Some((color, share)) if rng::unit(draw, THINNING, i as u64, 0) < share => {
                    scratch.push(*position, *normal, PackedColor::at(color, *position));
                }
                Some(_) => {}
            }
        }
        scratch
    }
}
