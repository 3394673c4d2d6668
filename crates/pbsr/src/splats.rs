//! Clouds as particles: each splat becomes a Poisson number of opaque points that have its optical depth in the mean.
//!
//! A splat of cross-section K gets K/s particles in the mean, distributed as its kernel, so that a pixel at u from its
//! centre sees K/s·s·w(u) = τ(u) of them: the optical depth of the splat along that ray.
//!
//! The footprint w(s) = e^(−qs) − e^(−q)(1 + x + x²/2), x = q(1 − s), is the sum over n ≥ 3 of e^(−q)·q^n/n!·(1 − s)^n.
//! Each term has the weight ∫(1 − s)^n dA = π/(n + 1), so n + 1 is a Poisson variable of mean q, given that it is ≥ 4.
//!
//! - A disc has the radius √(1 − u^(1/(n+1))) for uniform u.
//! - (1 − ρ²)^n is the projection of the ball's (1 − r²)^(n−1/2), for every direction of the ray (Abel's transform), which is
//!   the distribution of three coordinates of a uniform point on the sphere in 2n + 4 dimensions: g/√(|g|² + χ²), with
//!   three normal numbers g and χ² of 2n + 1 degrees of freedom.

use crate::blocks::Blocks;
use crate::params::{countable, positive};
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::{Stage, Stream};
use crate::{Error, PackedColor, PackedNormal, Particles};
use glam::Vec3;
use splat_core::optics::SurfaceOpacity;
use splat_core::{Cloud, Footprint, FootprintStack, SplatKind, glam};

/// What a sampler of clouds needs.
#[derive(Debug, Clone, PartialEq)]
pub struct SplatParams {
    /// Particle cross-section s: the area of one pixel at the cloud, world units², > 0.
    pub cross_section: f64,
    /// How the opacity of surface splats grows at grazing angles.
    pub surface_opacity: SurfaceOpacity,
    /// Optical depth at which opaque splats are sampled, in (0, 64\]; draw them by [`crate::Occluder`] where they must be
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
    cloud: &'a Cloud,
    params: SplatParams,
    sets: PoissonSets,
}

impl<'a> SplatSampler<'a> {
    /// Prepares the tables: 8 bytes a splat.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Core`] for a cloud that breaks a promise or a footprint id
    /// out of range, [`Error::Empty`] for a cloud without cross-section, [`Error::TooMuch`] for more than 4·10⁹
    /// particles a set.
    pub fn new(cloud: &'a Cloud, params: &SplatParams) -> Result<Self, Error> {
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
        let rate = |i: usize| {
            let depth = if cloud.kind[i] == SplatKind::Opaque { cap } else { 1.0 };
            depth * f64::from(cloud.cross_section[i]) / params.cross_section
        };
        let blocks = Blocks::new(cloud.len(), rate);
        if blocks.chunks() == 0 {
            return Err(Error::Empty { what: "a cloud", reason: "no splat has a cross-section" });
        }
        countable(blocks.total())?;
        let sets = PoissonSets::new(cloud.origin, params.cross_section, blocks);
        Ok(Self { cloud, params: params.clone(), sets })
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        self.sets.blocks.bytes()
    }
}

/// The order n of one term of the footprint.
fn term(footprint: &Footprint, stream: &mut Stream) -> i32 {
    let q = f64::from(footprint.sharpness());
    // Inversion over the tail n + 1 ≥ 4; the sum of the tail is 1 − e^(−q)(1 + q + q²/2 + q³/6).
    let mut p = q.powi(4) / 24.0;
    let mut rest = stream.unit() * (q.exp() - 1.0 - q - q * q * (0.5 + q / 6.0));
    let mut m = 4;
    while rest > p && m < 400 {
        rest -= p;
        m += 1;
        p *= q / f64::from(m);
    }
    m - 1
}

/// Offset in a kernel of radius 1.
fn in_ball(n: i32, stream: &mut Stream) -> Vec3 {
    let g = stream.normal3();
    let one = stream.normal_pair()[0];
    // χ² of 2n degrees of freedom: −2 ln of a product of n uniform numbers, taken in pieces that do not underflow.
    let mut log = 0.0;
    for part in [n / 2, n - n / 2] {
        log += (0..part.min(16)).map(|_| stream.unit()).product::<f64>().ln();
        log += (16..part).map(|_| stream.unit().ln()).sum::<f64>();
    }
    let chi2 = one * one - 2.0 * log;
    (g / (g.length_squared() + chi2).sqrt()).as_vec3()
}

/// Offset on a disc of radius 1.
fn on_disc(n: i32, stream: &mut Stream) -> [f64; 2] {
    let s = 1.0 - stream.unit().powf(1.0 / f64::from(n + 1));
    let (sin, cos) = (std::f64::consts::TAU * stream.unit()).sin_cos();
    let radius = s.sqrt();
    [radius * cos, radius * sin]
}

impl Poisson for SplatSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        let layers = self.params.footprints.layers();
        self.sets.blocks.arrivals(self.params.seed, Stage::Splats, set, chunk, |i, stream| {
            let n = term(&layers[usize::from(self.cloud.footprint[i])], stream);
            let (normal, radius) = (self.cloud.normal_of(i), self.cloud.radius[i]);
            let mut packed = PackedNormal::new(normal);
            let offset = if self.cloud.kind[i] == SplatKind::Medium {
                in_ball(n, stream) * radius
            } else {
                if self.params.surface_opacity == SurfaceOpacity::PerCrossing {
                    packed = packed.per_crossing();
                }
                let [u, v] = on_disc(n, stream).map(|x| x as f32);
                let tangent = match self.cloud.tangent_of(i) {
                    Vec3::ZERO => normal.any_orthonormal_vector() * radius,
                    tangent => tangent,
                };
                tangent * u + normal.cross(tangent.normalize_or_zero()) * (radius * v)
            };
            particles.push(self.cloud.position[i] + offset, packed, PackedColor::new(self.cloud.color[i]));
        });
    }
}
