//! Procedural clouds: ellipsoids whose boundaries are disturbed by Perlin turbulence (Gunjee 2007, Figures 7 and 16).
//!
//! | symbol | meaning |
//! |---|---|
//! | e(p) | signed depth below the nearest ellipsoid's boundary, in its mean radii: 1 at a centre, 0 on it, < 0 outside |
//! | t(p) | turbulence Σ gⁱ·(2·\|noise(f·lⁱ·p)\| − ½)/Σ gⁱ, f frequency, l lacunarity, g gain |
//! | d(p) | density: smoothstep of (e + amplitude·t)/edge |
//!
//! \|noise\| has creases where the noise changes sign and rounded hills between: added outwards it gives the
//! cauliflower of a cumulus. The gain 2^−0.9 keeps the small octaves visible. Ellipsoids merge by a smooth maximum, so
//! no seam shows where two meet. A base below which nothing condenses flattens the underside.

use crate::ConvertError;
use crate::common::convert_error::check_cancelled;
use crate::common::params::SplatParams;
use crate::volume::volume_points::check_lattice;
use noise::{NoiseFn, Perlin};
use rayon::prelude::*;
use splat_core::{
    DAabb, Grid, Progress,
    glam::{DMat3, DVec3},
};

/// |t| is at most this, |noise| being at most 1.
const MOST_TURBULENCE: f64 = 1.5;
/// Depth over which ellipsoids merge.
const MERGE_WIDTH: f64 = 0.15;
/// Share of the amplitude that moves the base.
const BASE_WAVE: f64 = 0.3;

/// An axis-aligned ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    /// Centre, object units.
    pub center: DVec3,
    /// Radii along x, y and z, object units, > 0.
    pub radii: DVec3,
}

/// The shape of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudShape {
    /// Ellipsoids that the cloud is made of.
    pub ellipsoids: Vec<Ellipsoid>,
    /// Octaves of turbulence, 1 to 16.
    pub octaves: u32,
    /// Frequency of an octave over that of the one before, > 1.
    pub lacunarity: f64,
    /// Strength of an octave over that of the one before, in (0, 1\].
    pub gain: f64,
    /// Displacement of the boundary by turbulence, in mean radii of the ellipsoid, ≥ 0.
    pub amplitude: f64,
    /// Frequency of the first octave, cells of noise per object unit, > 0.
    pub frequency: f64,
    /// Depth over which the density rises from 0 to its core value, in mean radii, > 0.
    pub edge: f64,
    /// Height (y, object units) of the flat base, if any.
    pub base: Option<f64>,
    /// Seed of the noise.
    pub seed: u32,
    /// Extinction at the core, 1/world unit, ≥ 0.
    pub extinction: f64,
}

impl Default for CloudShape {
    /// A cumulus of five ellipsoids, 4 units long, on a flat base at y = 0.
    fn default() -> Self {
        let e = |x: f64, y: f64, z: f64, r: [f64; 3]| Ellipsoid { center: DVec3::new(x, y, z), radii: r.into() };
        Self {
            ellipsoids: vec![
                e(0.0, 0.55, 0.0, [1.0, 0.8, 0.85]),
                e(-1.05, 0.3, 0.1, [0.8, 0.5, 0.65]),
                e(1.0, 0.35, -0.1, [0.85, 0.55, 0.7]),
                e(0.3, 0.95, 0.15, [0.6, 0.6, 0.55]),
                e(-0.45, 0.8, -0.2, [0.55, 0.5, 0.5]),
            ],
            octaves: 6,
            lacunarity: 2.03,
            gain: 0.54,
            amplitude: 0.55,
            frequency: 0.9,
            edge: 0.22,
            base: Some(0.0),
            seed: 1,
            extinction: 12.0,
        }
    }
}

impl CloudShape {
    /// Density in \[0, 1\] at a point, before the factor `extinction`.
    pub fn density(&self, p: DVec3) -> f64 {
        self.density_with(&Perlin::new(self.seed), p)
    }

    pub(crate) fn density_with(&self, noise: &Perlin, p: DVec3) -> f64 {
        let depth = self.depth(p);
        // |t| ≤ MOST_TURBULENCE, so nothing can reach up here.
        if depth + MOST_TURBULENCE * self.amplitude <= 0.0 {
            return 0.0;
        }
        let disturbed = depth + self.amplitude * self.turbulence(noise, p);
        let above = self.base.map_or(f64::INFINITY, |base| {
            // The base undulates less than the top billows.
            let wave = BASE_WAVE * self.amplitude * self.turbulence(noise, p + DVec3::splat(37.5));
            (p.y - base) / self.mean_height() + wave
        });
        let t = (disturbed.min(above) / self.edge).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    fn mean_height(&self) -> f64 {
        self.ellipsoids.iter().map(|e| e.radii.y).sum::<f64>() / self.ellipsoids.len() as f64
    }

    /// Smooth maximum of the depths below the ellipsoids' boundaries.
    fn depth(&self, p: DVec3) -> f64 {
        let depth = |e: &Ellipsoid| 1.0 - ((p - e.center) / e.radii).length();
        let deepest = self.ellipsoids.iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = self.ellipsoids.iter().map(|e| libm::exp((depth(e) - deepest) / MERGE_WIDTH)).sum();
        // Bounded by the number of ellipsoids, so an empty place stays empty.
        deepest + MERGE_WIDTH * libm::log(sum)
    }

    fn turbulence(&self, noise: &Perlin, p: DVec3) -> f64 {
        let mut q = p * self.frequency;
        let mut strength = 1.0;
        let mut sum = 0.0;
        let mut total = 0.0;
        for octave in 0..self.octaves {
            // Shifted, so that the zeros of Perlin noise at whole coordinates do not fall together.
            let at = q + DVec3::new(0.37, 0.71, 0.19) * f64::from(octave + 1);
            sum += strength * (2.0 * noise.get(at.to_array()).abs() - 0.5);
            total += strength;
            strength *= self.gain;
            q *= self.lacunarity;
        }
        sum / total
    }

    /// A box outside of which the density is 0, object units.
    pub fn bounds(&self) -> DAabb {
        // The smooth maximum adds at most MERGE_WIDTH·ln n to the depth.
        let reach =
            1.0 + MOST_TURBULENCE * self.amplitude + MERGE_WIDTH * libm::log(self.ellipsoids.len().max(1) as f64);
        let around = |e: &Ellipsoid| DAabb::around(e.center, e.radii * reach);
        let DAabb { min: mut low, max: high } =
            self.ellipsoids.iter().fold(DAabb::EMPTY, |bounds, e| bounds.union(around(e)));
        if let Some(base) = self.base.filter(|_| !self.ellipsoids.is_empty()) {
            low.y = low.y.max(base - MOST_TURBULENCE * BASE_WAVE * self.amplitude * self.mean_height()).min(high.y);
        }
        DAabb::new(low, high)
    }

    /// Lattice points along x, y and z.
    pub(crate) fn lattice(&self, spacing: f64, splat: &SplatParams) -> Result<[usize; 3], ConvertError> {
        self.check(splat)?;
        let counts = (self.bounds().size() / splat.check_spacing(spacing)?).ceil().to_array();
        check_lattice(splat, counts)?;
        Ok(counts.map(|n| n.max(1.0) as usize))
    }

    fn check(&self, p: &SplatParams) -> Result<(), ConvertError> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if self.ellipsoids.is_empty() {
            return Err(p.bad("ellipsoids", 0, "at least one"));
        }
        if let Some(e) = self
            .ellipsoids
            .iter()
            .find(|e| !(e.center.is_finite() && e.radii.is_finite() && e.radii.min_element() > 0.0))
        {
            return Err(p.bad("ellipsoid", e, "a finite centre and radii > 0"));
        }
        if !(1..=16).contains(&self.octaves) {
            return Err(p.bad("octaves", self.octaves, "1 to 16"));
        }
        if !(positive(self.lacunarity) && self.lacunarity > 1.0) {
            return Err(p.bad("lacunarity", self.lacunarity, "a finite number > 1"));
        }
        if !(positive(self.gain) && self.gain <= 1.0) {
            return Err(p.bad("gain", self.gain, "a number in (0, 1]"));
        }
        if !(self.amplitude.is_finite() && self.amplitude >= 0.0) {
            return Err(p.bad("amplitude", self.amplitude, "a finite number ≥ 0"));
        }
        if !(positive(self.frequency) && positive(self.edge)) {
            return Err(p.bad("frequency, edge", (self.frequency, self.edge), "finite numbers > 0"));
        }
        if !(self.extinction.is_finite() && self.extinction >= 0.0 && self.base.is_none_or(f64::is_finite)) {
            return Err(p.bad(
                "extinction, base",
                (self.extinction, self.base),
                "a finite number ≥ 0, a finite height",
            ));
        }
        Ok(())
    }
}

/// The extinction of a cloud on a cubic lattice of `spacing` (object units), values in 1/world unit.
///
/// ```
/// use convert::{CloudShape, SplatParams, procedural_cloud};
/// let shape = CloudShape::default();
/// let grid = procedural_cloud(&shape, 0.1, &SplatParams::default(), None).unwrap();
/// assert!(grid.values.iter().all(|v| (0.0..=12.0).contains(v)));
/// ```
///
/// Lattice points are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::Parameter`], [`ConvertError::Limit`] before memory is taken, or [`ConvertError::Cancelled`].
pub fn procedural_cloud(
    shape: &CloudShape,
    spacing: f64,
    splat: &SplatParams,
    progress: Option<&Progress>,
) -> Result<Grid, ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    splat.check()?;
    let dims = shape.lattice(spacing, splat)?;
    let low = shape.bounds().min;
    let noise = Perlin::new(shape.seed);
    let mut values = vec![0.0f32; dims[0] * dims[1] * dims[2]];
    progress.add_total(values.len() as u64);
    values.par_chunks_mut(dims[0]).enumerate().for_each(|(row, out)| {
        if progress.tick(out.len() as u64).is_err() {
            return;
        }
        for (i, value) in out.iter_mut().enumerate() {
            let index = DVec3::new(i as f64, (row % dims[1]) as f64, (row / dims[1]) as f64);
            *value = (shape.extinction * shape.density_with(&noise, low + index * spacing)) as f32;
        }
    });
    check_cancelled(progress)?;
    Ok(Grid { origin: low, axes: DMat3::from_diagonal(DVec3::splat(spacing)), dims, values })
}
