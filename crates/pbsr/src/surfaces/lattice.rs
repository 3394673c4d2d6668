//! Isosurfaces of regular volumes by lines along the axes of their lattice, whose crossings are those of a polynomial.
//!
//! In a cell the trilinear value is linear along each step a_k of the lattice: the line through the place (u, v) of a face
//! meets f = c at t = (c − f₀)/(f₁ − f₀) where its ends lie on both sides of c, and nowhere else. With Catmull-Rom
//! interpolation it is a cubic, with three crossings at most (`cubic.rs`). N lines along each of the three axes, uniform on
//! the faces, meet a piece of area A and normal n in N·A·Σ|n·a_k|/V places, V the volume of a cell.
//! With g the gradient in steps of the lattice, n·a_k = g_k/|∇f|. Of the crossings the share
//!
//! |∇f|/(W·Σ|g_k|), W the greatest length of a column of the inverse transposed steps
//!
//! is kept. It is at most 1: of all n the least Σ|n·a_k| is 1/W. So N = λ·V·W lines leave λ·A particles, λ = τ/s, whatever
//! the place and direction of the piece.
//!
//! This is `lines.rs` without a search, for fields on a lattice: nothing is missed but pairs
//! of roots of a cubic nearer than 2⁻¹² of a cell. Crossings of a trilinear field are independent; up to three of a cubic
//! lie on the same line.

mod cubic;

use crate::blocks::Blocks;
#[cfg(feature = "gpu")]
use crate::gpu::{Maker, Twin, columns};
use crate::media::places::{corners, interpolate};
use crate::particles::Steps;
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::{Stage, Stream};
use crate::{Error, PackedNormal, Particles, SurfaceParams};
use glam::{Mat3, Vec3};
use rayon::prelude::*;
use splat_core::optics::SurfaceOpacity;
use splat_core::{Grid, Interpolation, glam};
#[cfg(feature = "gpu")]
use splat_shaders::layouts::ParticleSource;

/// Lines that the area is estimated by.
const SURVEY_LINES: u32 = 1 << 16;

/// Particles on an isosurface of a volume.
pub struct LatticeSampler<'a> {
    grid: &'a Grid,
    interpolation: Interpolation,
    level: f32,
    params: SurfaceParams,
    /// Lattice index of the first corner of each cell that holds a piece.
    cells: Vec<u32>,
    sets: PoissonSets,
    axes: Mat3,
    /// World gradient from the gradient in lattice steps.
    gradient: Mat3,
    /// W.
    weight: f32,
}

impl<'a> LatticeSampler<'a> {
    /// Finds the cells that the surface `value = level` passes: 12 bytes each.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Core`] for a grid that breaks a promise, [`Error::Empty`] for
    /// a level that no cell has, [`Error::Limit`] for more than 4·10⁹ lattice points, or lines a set.
    pub fn new(
        grid: &'a Grid,
        interpolation: Interpolation,
        level: f32,
        params: &SurfaceParams,
    ) -> Result<Self, Error> {
        params.validate()?;
        grid.validate()?;
        crate::error::check(level.is_finite(), "level", level, "a finite number")?;
        if grid.values.len() > u32::MAX as usize {
            let needed = grid.values.len() as u64;
            return Err(Error::limit("a volume", needed, u32::MAX.into(), "lattice points"));
        }
        let cells = passed(grid, interpolation, level);
        if cells.is_empty() {
            return Err(Error::Empty { what: "an isosurface", reason: "no cell has the level" });
        }
        let inverse = grid.axes.inverse().transpose();
        let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
        // Rounded up, so that no share is above 1.
        let weight = columns.map(|c| c.length()).into_iter().fold(0.0, f64::max) * (1.0 + 1e-6);
        let per_cell = 3.0 * params.particles_per_area() * grid.cell_volume() * weight;
        let blocks = Blocks::new(cells.len(), |_| per_cell)?;
        let sets = PoissonSets::new(grid.origin, params.cross_section, blocks);
        let axes = grid.axes.as_mat3();
        let gradient = inverse.as_mat3();
        let weight = weight as f32;
        let mut sampler = Self { grid, interpolation, level, params: *params, cells, sets, axes, gradient, weight };
        sampler.sets.share = sampler.survey();
        Ok(sampler)
    }

    /// Cells that the surface passes.
    pub fn active_cells(&self) -> usize {
        self.cells.len()
    }

    /// Area of the surface, world units², estimated by a survey of 65536 lines.
    pub fn area(&self) -> f64 {
        let of_cell = 3.0 * self.grid.cell_volume() * f64::from(self.weight);
        self.sets.share * of_cell * self.cells.len() as f64
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        self.sets.blocks.bytes() + 4 * self.cells.len() as u64
    }

    /// Particles that a line leaves, in the mean.
    fn survey(&self) -> f64 {
        let kept = |i: u32| {
            let mut stream = Stream::new(self.params.seed, Stage::Survey, 2, u64::from(i));
            let cell = u64::from(i) * self.cells.len() as u64 / u64::from(SURVEY_LINES);
            let mut kept = 0;
            self.crossings(self.cells[cell as usize], &mut stream, |_, _| kept += 1);
            kept
        };
        let kept: u64 = (0..SURVEY_LINES).into_par_iter().with_min_len(1024).map(kept).sum();
        // None is no proof that there is nothing.
        kept.max(1) as f64 / f64::from(SURVEY_LINES)
    }

    /// Hands over the places in the cell, and the world gradients there, where a random line of it meets the surface and is
    /// kept.
    #[inline]
    fn crossings(&self, at: u32, stream: &mut Stream, mut emit: impl FnMut([f32; 3], Vec3)) {
        let [u, v, _] = stream.triple();
        let [choice, lot] = stream.pair();
        let axis = ((3.0 * choice) as usize).min(2);
        let on_line = |t: f32| match axis {
            0 => [t, u, v],
            1 => [v, t, u],
            _ => [u, v, t],
        };
        let mut keep = |f: [f32; 3], g: Vec3, lot: f32| {
            let world = self.gradient * g;
            let bound = lot * self.weight * (g.x.abs() + g.y.abs() + g.z.abs());
            if bound * bound < world.length_squared() {
                emit(f, world);
            }
        };
        if self.interpolation == Interpolation::CatmullRom {
            let block = cubic::gather(self.grid, at, self.level);
            let mut lot = Some(lot);
            cubic::roots(&cubic::along(&block, axis, on_line(0.0)), &mut |t| {
                let f = on_line(t);
                keep(f, cubic::gradient(&block, f), lot.take().unwrap_or_else(|| stream.pair()[0]));
            });
            return;
        }
        let values = corners(self.grid, at);
        // Not by a closure over both: one that is not inlined mixes gradients that nobody asks for.
        let low = interpolate(values, on_line(0.0)).0;
        let high = interpolate(values, on_line(1.0)).0;
        if (low < self.level) != (high < self.level) {
            let f = on_line((self.level - low) / (high - low));
            keep(f, interpolate(values, f).1, lot);
        }
    }
}

/// First corners of the cells that the surface passes: of a trilinear field those of which some corners are below the level
/// and some are not, of a cubic one those whose control points are.
fn passed(grid: &Grid, interpolation: Interpolation, level: f32) -> Vec<u32> {
    let [nx, ny, nz] = grid.dims;
    let rows = if nx > 1 { ny.saturating_sub(1) * nz.saturating_sub(1) } else { 0 };
    let place = |row: usize| [row % (ny - 1), row / (ny - 1)];
    let trilinear = |row: usize| {
        let [j, k] = place(row);
        let first = (k * ny + j) * nx;
        let below = move |i: usize| {
            [i, i + nx, i + nx * ny, i + nx * ny + nx].into_iter().filter(|i| grid.values[*i] < level).count()
        };
        (first..first + nx - 1).filter(move |i| !matches!(below(*i) + below(*i + 1), 0 | 8)).map(|i| i as u32)
    };
    let rows = (0..rows).into_par_iter().with_min_len(16);
    match interpolation {
        Interpolation::Trilinear => rows.flat_map_iter(trilinear).collect(),
        Interpolation::CatmullRom => rows.flat_map_iter(|row| cubic::passed_in_row(grid, level, place(row))).collect(),
    }
}

impl Poisson for LatticeSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        let color = Steps::new(self.params.color);
        let [nx, ny, _] = self.grid.dims.map(|n| n as u32);
        let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
        self.sets.blocks.arrivals(self.params.seed, Stage::Lattice, set, chunk, |c, stream| {
            let at = self.cells[c];
            self.crossings(at, stream, |f, gradient| {
                let corner = [at % nx, at / nx % ny, at / nx / ny];
                let lattice = Vec3::from_array(std::array::from_fn(|k| corner[k] as f32 + f[k]));
                let normal = PackedNormal::new(gradient);
                let normal = if per_crossing { normal.per_crossing() } else { normal };
                let place = self.axes * lattice;
                particles.push(place, normal, color.at(place));
            });
        });
    }

    #[cfg(feature = "gpu")]
    fn tables(&self) -> Option<Twin> {
        if self.interpolation != Interpolation::Trilinear {
            return None;
        }
        let [axis_x, axis_y, axis_z] = columns(&self.axes);
        let [gradient_x, gradient_y, gradient_z] = columns(&self.gradient);
        let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
        let [r, g, b] = self.params.color;
        let source = ParticleSource {
            axis_x,
            axis_y,
            axis_z,
            gradient_x,
            gradient_y,
            gradient_z,
            lattice: [self.grid.dims[0] as u32, self.grid.dims[1] as u32],
            tint: [r, g, b, 0.0],
            flags: u32::from(per_crossing),
            level: self.level,
            weight: self.weight,
            ..ParticleSource::default()
        };
        let values = self.grid.values.iter().map(|v| v.to_bits()).collect();
        let tables = vec![self.cells.clone(), values];
        Some(Twin::new(Maker::Lattice, self, source, tables, self.params.seed, Stage::Lattice))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sampler;
    use splat_core::glam::{DMat3, DVec3};

    /// A lattice of skewed, unequal steps around the origin.
    fn lattice(f: impl Fn(DVec3) -> f64) -> Grid {
        let axes =
            DMat3::from_cols(DVec3::new(0.11, 0.0, 0.01), DVec3::new(0.03, 0.08, 0.0), DVec3::new(-0.02, 0.01, 0.14));
        let dims = [27usize, 33, 21];
        let middle = axes * DVec3::new(13.0, 16.0, 10.0);
        let mut grid = Grid { origin: DVec3::new(100.0, -7.0, 3.0), axes, dims, values: Vec::new() };
        for i in 0..dims.iter().product::<usize>() {
            let p = axes * DVec3::new((i % 27) as f64, (i / 27 % 33) as f64, (i / (27 * 33)) as f64);
            grid.values.push(f(p - middle) as f32);
        }
        grid
    }

    const BOTH: [Interpolation; 2] = [Interpolation::Trilinear, Interpolation::CatmullRom];

    fn params(seed: u64) -> SurfaceParams {
        SurfaceParams { opacity: 0.5, cross_section: 8e-5, seed, ..SurfaceParams::default() }
    }

    fn particles(sampler: &LatticeSampler<'_>, sets: u64) -> Particles {
        let mut particles = Particles::default();
        let mut scratch = Particles::default();
        for set in 0..sets {
            (0..sampler.chunks()).for_each(|c| particles.append(sampler.chunk(set, c, &mut scratch)));
        }
        particles
    }

    #[test]
    fn planes_of_any_direction_have_the_same_density() {
        let normals = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, -3.0), DVec3::new(-0.3, 1.0, 0.1)];
        let planes = normals.into_iter().enumerate();
        for ((k, normal), interpolation) in planes.flat_map(|plane| BOTH.map(|interpolation| (plane, interpolation))) {
            let n = normal.normalize();
            // A linear field stays one on any lattice, by both.
            let grid = lattice(|p| p.dot(n));
            let params = params(k as u64);
            let sampler = LatticeSampler::new(&grid, interpolation, 0.01, &params).unwrap();
            let found = particles(&sampler, 8);
            let middle = grid.axes * DVec3::new(13.0, 16.0, 10.0);
            let inside = found.position.iter().filter(|p| {
                let d = p.as_dvec3() - middle;
                assert!((d.dot(n) - 0.01).abs() < 1e-5);
                d.length_squared() < 0.3 * 0.3
            });
            let expected =
                8.0 * std::f64::consts::PI * (0.3f64.powi(2) - 0.01f64.powi(2)) * params.particles_per_area();
            let off = (inside.count() as f64 - expected) / expected.sqrt();
            assert!(off.abs() < 4.0, "{normal}: {off} deviations of {expected}");
            assert!(found.normal.iter().all(|m| (m.get().as_dvec3() - n).length() < 1e-3));
        }
    }

    #[test]
    fn a_ball_has_its_area_and_so_have_its_halves() {
        let grid = lattice(|p| p.length());
        let middle = (grid.axes * DVec3::new(13.0, 16.0, 10.0)).as_vec3();
        let area = 4.0 * std::f64::consts::PI * 0.55 * 0.55;
        let expected = 8.0 * area * params(9).particles_per_area();
        // Trilinear pieces of a ball are flatter by half a percent or so.
        for (interpolation, off) in BOTH.into_iter().zip([0.02, 0.006]) {
            let sampler = LatticeSampler::new(&grid, interpolation, 0.55, &params(9)).unwrap();
            let found = particles(&sampler, 8);
            assert!((found.len() as f64 / expected - 1.0).abs() < off, "{} of {expected}", found.len());
            assert!((sampler.area() / area - 1.0).abs() < 0.03 && sampler.active_cells() > 500);
            assert!((sampler.expected_particles() * 8.0 / found.len() as f64 - 1.0).abs() < 0.02);
            for axis in 0..3 {
                let above = found.position.iter().filter(|p| p[axis] > middle[axis]).count() as f64;
                let half = found.len() as f64 / 2.0;
                assert!((above / half - 1.0).abs() < 0.01, "{axis}: {above} of {half}");
            }
        }
    }

    #[test]
    fn a_level_at_lattice_points_counts_once_and_what_is_no_surface_is_refused() {
        // The surface lies in faces of cells, which two cells share.
        let axes = DMat3::from_diagonal(DVec3::splat(0.25));
        let values = (0..125).map(|i| (i / 25) as f32).collect();
        let grid = Grid { origin: DVec3::ZERO, axes, dims: [5; 3], values };
        let thin = Grid { dims: [125, 1, 1], ..grid.clone() };
        let expected = 4.0 * params(3).particles_per_area();
        for interpolation in BOTH {
            let new = |grid, level| LatticeSampler::new(grid, interpolation, level, &params(3));
            let found = particles(&new(&grid, 2.0).unwrap(), 4);
            assert!((found.len() as f64 - expected).abs() < 4.0 * expected.sqrt(), "{} of {expected}", found.len());
            for level in [-1.0, 0.0, 4.5] {
                assert!(matches!(new(&grid, level), Err(Error::Empty { .. })), "{level}");
            }
            assert!(new(&grid, f32::NAN).is_err());
            assert!(matches!(new(&thin, 2.0), Err(Error::Empty { .. })));
        }
    }
}
