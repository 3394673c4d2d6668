//! Particles in a procedural medium: the extinction is a field over a box.
//!
//! As in `volume.rs`, ν = σ/s: each cell gets a Poisson number of mean σ_max·V/s, σ_max from the field's bound, and each
//! particle is kept with probability σ(x)/σ_max.

use crate::blocks::Blocks;
use crate::error::check;
use crate::params::{color, positive};
use crate::particles::Steps;
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::Stage;
use crate::{Density, Error, PackedNormal, Particles};
use glam::DVec3;
use splat_core::{DAabb, glam};

/// Parameters of a sampler of a field's medium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldVolumeParams {
    /// Cells along each axis of the box, 1 to 512; each cell has a bound.
    pub resolution: u32,
    /// Particle cross-section s: the area of one pixel in the medium, world units², > 0.
    pub cross_section: f64,
    /// Linear Rec.709 colour of every particle, each channel ≥ 0.
    pub color: [f32; 3],
    /// Seed of all sets.
    pub seed: u64,
}

impl Default for FieldVolumeParams {
    fn default() -> Self {
        Self { resolution: 24, cross_section: 1e-4, color: [1.0; 3], seed: 1 }
    }
}

/// Particles in the box of a field of extinction, 1/world unit.
pub struct FieldVolumeSampler<'a> {
    extinction: Density<'a>,
    min: DVec3,
    /// Sides of a cell.
    side: DVec3,
    cells: usize,
    color: [f32; 3],
    seed: u64,
    sets: PoissonSets,
}

impl<'a> FieldVolumeSampler<'a> {
    /// `extinction` in a box. A field without a bound uses `extinction.max`, and values above it are cut.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Empty`] when the extinction is bounded by 0 everywhere,
    /// [`Error::Limit`] for more than 4·10⁹ particles a set.
    pub fn new(extinction: Density<'a>, bounds: DAabb, params: &FieldVolumeParams) -> Result<Self, Error> {
        let FieldVolumeParams { resolution, cross_section, color: tint, seed } = *params;
        extinction.validate()?;
        positive(cross_section, "cross_section")?;
        color(tint)?;
        check((1..=512).contains(&resolution), "resolution", resolution, "1 to 512 cells")?;
        let DAabb { min, max } = bounds;
        check(bounds.is_solid(), "box", (min, max), "two finite corners, the first less in all three")?;
        let n = resolution as usize;
        let side = bounds.size() / f64::from(resolution);
        let radius = 0.5 * side.length() * (1.0 + 1e-12);
        let per_cell = side.element_product() / cross_section;
        let middle = |c: usize| min + side * (corner(c, n) + 0.5);
        let blocks = Blocks::new(n * n * n, |c| extinction.bound(middle(c), radius) * per_cell)?;
        if blocks.chunks() == 0 {
            return Err(Error::Empty { what: "a medium", reason: "its extinction is bounded by 0" });
        }
        let sets = PoissonSets::new(min, cross_section, blocks);
        Ok(Self { extinction, min, side, cells: n, color: tint, seed, sets })
    }
}

/// Lattice coordinates of a cell.
fn corner(cell: usize, n: usize) -> DVec3 {
    DVec3::new((cell % n) as f64, (cell / n % n) as f64, (cell / (n * n)) as f64)
}

impl Poisson for FieldVolumeSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        let color = Steps::new(self.color);
        let radius = 0.5 * self.side.length() * (1.0 + 1e-12);
        self.sets.blocks.arrivals(self.seed, Stage::Volume, set, chunk, |c, stream| {
            let low = corner(c, self.cells);
            let within = DVec3::from_array(stream.triple().map(f64::from));
            let offset = self.side * (low + within);
            let most = self.extinction.bound(self.min + self.side * (low + 0.5), radius);
            if stream.unit() * most < self.extinction.at(self.min + offset) {
                let place = offset.as_vec3();
                particles.push(place, PackedNormal::default(), color.at(place));
            }
        });
    }
}
