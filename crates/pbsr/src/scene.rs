//! The scene of particles, and the number of sets to fold.

use crate::project::shade::Appearance;
use crate::{Error, Sampler};
use glam::DVec3;
use splat_core::raster::OpaqueImage;
use splat_core::shade::LitBy;
use splat_core::{Camera, Limits, Similarity, glam};

/// An object of the scene.
#[derive(Clone, Copy)]
pub struct Object<'a> {
    /// The source of its particles.
    pub sampler: &'a dyn Sampler,
    /// The transform from the sampler's space to the world; a moved object needs no new particles.
    pub transform: Similarity,
    /// The appearance of its particles.
    pub look: Appearance,
}

/// Everything that is seen.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Objects; their order does not matter beyond noise.
    pub objects: &'a [Object<'a>],
    /// Lights with their shadows.
    pub lights: &'a [LitBy<'a>],
    /// World position that what receives shadows is relative to: the origin of the cloud that casts them.
    pub shadow_origin: DVec3,
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// The viewer.
    pub camera: &'a Camera,
    /// Opaque surfaces drawn exactly, by any other means: particles behind them are hidden, and rays that pass all particles
    /// end on them. The way to have α = 1. Its first planes are radiance, three for each colour that the ensemble keeps:
    /// beauty, or [`SHADED_EFFECTS`](splat_core::SHADED_EFFECTS).
    pub occluder: Option<&'a OpaqueImage>,
}

/// The number of sets to fold, with the limits of memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldParams {
    /// Sets to add: what one call adds to the repeat level.
    pub levels: u32,
    /// Nearest and farthest view depth; particles before the first, or at the second or behind it, are left out. Averages of
    /// ranges that meet, one behind the other, are an average of everything: their particles are independent.
    pub depths: [f32; 2],
    /// Of the particles of one batch, 32 bytes each. A set that needs more is refused.
    pub limits: Limits,
    /// Particles of a batch that are worth a pass over the image; more only takes memory.
    pub batch_particles: u64,
}

impl FoldParams {
    /// Bytes of a batch of sets of few particles; a single set of more takes more.
    pub fn batch_bytes(&self) -> u64 {
        self.batch_particles.min(self.limits.max_elements).saturating_mul(BYTES_IN_BATCH).min(self.limits.max_bytes)
    }
}

impl Default for FoldParams {
    fn default() -> Self {
        Self {
            levels: 100,
            depths: [f32::NEG_INFINITY, f32::INFINITY],
            limits: Limits::default(),
            batch_particles: 4 << 20,
        }
    }
}

/// Bytes of a particle in a batch: its record, with room to grow.
pub(crate) const BYTES_IN_BATCH: u64 = 32;

impl FoldParams {
    /// Refuses sets of so many expected particles, as folding them would.
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes or particles than [`FoldParams::limits`].
    pub fn check_set(&self, expected: f64) -> Result<(), Error> {
        let needed = (expected * BYTES_IN_BATCH as f64) as u64;
        let Limits { max_bytes, max_elements } = self.limits;
        for (needed, limit, unit) in [(needed, max_bytes, "bytes"), (expected as u64, max_elements, "particles")] {
            if needed > limit {
                return Err(Error::limit("one set of particles", needed, limit, unit));
            }
        }
        Ok(())
    }
}
