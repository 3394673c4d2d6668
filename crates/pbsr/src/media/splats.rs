//! Clouds as particles: each splat becomes a Poisson number of opaque points that have its optical depth in the mean.
//!
//! A splat of cross-section K gets K/s particles in the mean, distributed as its kernel, so that a pixel at u from its
//! centre sees K/s·s·w(u) = τ(u) of them: the optical depth of the splat along that ray.
//!
//! Tables give the place in the kernel (`radial.rs`): a uniform point of the ball or disc, found by rejection, is moved along its
//! radius. A device does the same, in products and sums alone.

use crate::blocks::{Batch, Blocks};
#[cfg(feature = "gpu")]
use crate::gpu::{Maker, Twin};
use crate::media::radial::{Radial, Shape};
use crate::params::positive;
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::{GOLDEN, Stage, pair, scramble, triple};
use crate::{Error, PackedColor, PackedNormal, Particles};
use glam::Vec3;
#[cfg(feature = "gpu")]
use rayon::prelude::*;
use splat_core::optics::SurfaceOpacity;
use splat_core::{Cloud, FootprintStack, SplatKind, glam};
#[cfg(feature = "gpu")]
use splat_shaders::layouts::ParticleSource;
use std::borrow::Cow;

/// Bit of a splat's kernel, where it fills a disc.
#[cfg(feature = "gpu")]
const DISC: u32 = 1 << 31;

/// Parameters of a sampler of clouds.
#[derive(Debug, Clone, PartialEq)]
pub struct SplatParams {
    /// Particle cross-section s: the area of one pixel at the cloud, world units², > 0.
    pub cross_section: f64,
    /// The growth of the opacity of surface splats at grazing angles.
    pub surface_opacity: SurfaceOpacity,
    /// Optical depth at which opaque splats are sampled, in (0, 64\]; draw them by [`crate::Scene::occluder`] where they must be
    /// exact.
    pub opaque_optical_depth: f64,
    /// Kernels by footprint id.
    pub footprints: FootprintStack,
    /// Seed of all sets.
    pub seed: u64,
}

impl Default for SplatParams {
    fn default() -> Self {
        Self {
            cross_section: 1e-4,
            surface_opacity: SurfaceOpacity::PerCrossing,
            opaque_optical_depth: 16.0,
            footprints: FootprintStack::default(),
            seed: 1,
        }
    }
}

/// Particles from splats, by their cross-sections; these are to be those of the channel that absorbs most.
pub struct SplatSampler<'a> {
    cloud: Cow<'a, Cloud>,
    params: SplatParams,
    sets: PoissonSets,
    /// Tables of the kernels that splats have.
    radials: Vec<Radial>,
    /// Of each footprint the table of its ball and of its disc.
    of_footprint: Vec<[usize; 2]>,
}

impl<'a> SplatSampler<'a> {
    /// Prepares the tables: 8 bytes a splat, and 6 KB for each kernel that occurs.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Core`] for a cloud that breaks a promise, a footprint id
    /// out of range or shadow coefficients that differ, [`Error::Empty`] for a cloud without cross-section, [`Error::Limit`] for more than 4·10⁹
    /// particles a set.
    pub fn new(cloud: &'a Cloud, params: &SplatParams) -> Result<Self, Error> {
        Self::with_cloud(Cow::Borrowed(cloud), params)
    }

    /// The same of a cloud that it keeps.
    ///
    /// # Errors
    /// As [`SplatSampler::new`].
    pub fn owning(cloud: Cloud, params: &SplatParams) -> Result<Self, Error> {
        Self::with_cloud(Cow::Owned(cloud), params)
    }

    fn with_cloud(cloud: Cow<'a, Cloud>, params: &SplatParams) -> Result<Self, Error> {
        positive(params.cross_section, "cross_section")?;
        let cap = params.opaque_optical_depth;
        crate::error::check(cap > 0.0 && cap <= 64.0, "opaque_optical_depth", cap, "a number in (0, 64]")?;
        cloud.validate()?;
        let layers = params.footprints.layers().len();
        if let Some(i) = cloud.footprint.iter().position(|f| usize::from(*f) >= layers) {
            let found = cloud.footprint[i];
            return Err(
                splat_core::Error::invalid("splat", i, "footprint", found, "an id of the footprint stack").into()
            );
        }
        if let Some(i) = cloud.shadow_coefficient.windows(2).position(|pair| pair[0] != pair[1]) {
            let found = cloud.shadow_coefficient[i + 1];
            let expected = "one for all its splats (other techniques take one a splat): its particles have one";
            return Err(splat_core::Error::invalid("splat", i + 1, "shadow_coefficient", found, expected).into());
        }
        let rate = |i: usize| {
            let depth = if cloud.kind[i] == SplatKind::Opaque { cap } else { 1.0 };
            depth * f64::from(cloud.cross_section[i]) / params.cross_section
        };
        let blocks = Blocks::new(cloud.len(), rate)?;
        if blocks.chunks() == 0 {
            return Err(Error::Empty { what: "a cloud", reason: "no splat has a cross-section" });
        }
        let sets = PoissonSets::new(cloud.origin, params.cross_section, blocks);
        let (radials, of_footprint) = radials(&cloud, &params.footprints);
        Ok(Self { cloud, params: params.clone(), sets, radials, of_footprint })
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        self.sets.blocks.bytes() + self.radials.iter().map(Radial::bytes).sum::<u64>()
    }
}

/// The tables of the kernels that occur, and where each is.
fn radials(cloud: &Cloud, footprints: &FootprintStack) -> (Vec<Radial>, Vec<[usize; 2]>) {
    let mut radials = Vec::new();
    let mut of_footprint = vec![[usize::MAX; 2]; footprints.layers().len()];
    for (kind, footprint) in cloud.kind.iter().zip(&cloud.footprint) {
        let shape = if *kind == SplatKind::Medium { Shape::Ball } else { Shape::Disc };
        let at = &mut of_footprint[usize::from(*footprint)][shape as usize];
        if *at == usize::MAX {
            *at = radials.len();
            radials.push(Radial::new(&footprints.layers()[usize::from(*footprint)], shape));
        }
    }
    (radials, of_footprint)
}

/// Draws after which a splat's centre stands for a point that was not found: one arrival in 10²⁰.
const TRIES: u64 = 64;

/// A uniform point of the unit ball from 64 random bits, and its square: the first of a stream of points of the cube.
#[inline]
fn in_ball(bits: u64) -> (Vec3, f32) {
    for number in tries(bits) {
        let p = Vec3::from_array(triple(number).map(|u| 2.0 * u - 1.0));
        let square = p.x * p.x + p.y * p.y + p.z * p.z;
        if square < 1.0 {
            return (p, square);
        }
    }
    (Vec3::ZERO, 0.0)
}

/// A uniform point of the unit disc.
#[inline]
fn on_disc(bits: u64) -> ([f32; 2], f32) {
    for number in tries(bits) {
        let [x, y] = pair(number).map(|u| 2.0 * u - 1.0);
        let square = x * x + y * y;
        if square < 1.0 {
            return ([x, y], square);
        }
    }
    ([0.0; 2], 0.0)
}

/// The bits, then those that follow from them.
fn tries(bits: u64) -> impl Iterator<Item = u64> {
    let later = (1..TRIES).map(move |k| scramble(bits.wrapping_add(k.wrapping_mul(GOLDEN))));
    std::iter::once(bits).chain(later)
}

impl SplatSampler<'_> {
    /// The table of a splat's kernel.
    #[inline]
    fn radial(&self, i: usize) -> usize {
        let shape = if self.cloud.kind[i] == SplatKind::Medium { Shape::Ball } else { Shape::Disc };
        self.of_footprint[usize::from(self.cloud.footprint[i])][shape as usize]
    }

    fn normal(&self, i: usize) -> PackedNormal {
        let normal = PackedNormal::new(self.cloud.normal_of(i));
        let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
        if self.cloud.kind[i] != SplatKind::Medium && per_crossing { normal.per_crossing() } else { normal }
    }

    /// The semi-axes of a disc.
    #[inline]
    fn axes(&self, i: usize) -> [Vec3; 2] {
        let normal = self.cloud.normal_of(i);
        let radius = self.cloud.radius[i];
        let tangent = match self.cloud.tangent_of(i) {
            Vec3::ZERO => normal.any_orthonormal_vector() * radius,
            tangent => tangent,
        };
        [tangent, normal.cross(tangent.normalize_or_zero()) * radius]
    }

    /// A particle of splat `i` from 64 random bits: products and sums alone beside what a splat has once.
    #[inline]
    fn place(&self, i: usize, bits: u64) -> Vec3 {
        let radial = &self.radials[self.radial(i)];
        if self.cloud.kind[i] == SplatKind::Medium {
            let (p, square) = in_ball(bits);
            return self.cloud.position[i] + p * radial.stretch(square) * self.cloud.radius[i];
        }
        let ([x, y], square) = on_disc(bits);
        let [tangent, across] = self.axes(i);
        let h = radial.stretch(square);
        self.cloud.position[i] + (tangent * x + across * y) * h
    }
}

impl Poisson for SplatSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        self.sets.blocks.batches(self.params.seed, Stage::Splats, set, chunk, |batch: &Batch<1>| {
            for (&i, &bits) in batch.elements[..batch.len].iter().zip(&batch.bits[0]) {
                let place = self.place(i, bits);
                particles.push(place, self.normal(i), PackedColor::at(self.cloud.color[i], place));
            }
        });
    }

    #[cfg(feature = "gpu")]
    fn tables(&self) -> Option<Twin> {
        let cloud = self.cloud.as_ref();
        let medium = |i: usize| cloud.kind[i] == SplatKind::Medium;
        // Place, normal, colour and kernel; the radius of a ball, or the semi-axes of a disc.
        let words = if (0..cloud.len()).all(medium) { 9 } else { 14 };
        let mut splats = vec![0u32; words as usize * cloud.len()];
        splats.par_chunks_exact_mut(words as usize).enumerate().for_each(|(i, splat)| {
            let place = cloud.position[i].to_array().map(f32::to_bits);
            let kernel = self.radial(i) as u32 | if medium(i) { 0 } else { DISC };
            splat[..3].copy_from_slice(&place);
            splat[3..5].copy_from_slice(&[self.normal(i).bits(), kernel]);
            splat[5..8].copy_from_slice(&cloud.color[i].map(f32::to_bits));
            if medium(i) {
                splat[8] = cloud.radius[i].to_bits();
            } else {
                let axes = self.axes(i).map(|axis| axis.to_array().map(f32::to_bits));
                splat[8..].copy_from_slice(axes.as_flattened());
            }
        });
        let kernels = self.radials.iter().flat_map(|r| r.cells()).flat_map(|cell| cell.map(f32::to_bits)).collect();
        let source = ParticleSource { vertex_words: words, ..ParticleSource::default() };
        Some(Twin::new(Maker::Splats, self, source, vec![splats, kernels], self.params.seed, Stage::Splats))
    }
}
