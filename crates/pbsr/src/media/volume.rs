//! Particle-based volume rendering, cell by cell: opaque particles in a volume, as many as its extinction asks for.
//!
//! ν(x) = σ(x)/s
//!
//! | symbol | meaning |
//! |---|---|
//! | ν | mean number of particles in a unit volume |
//! | σ | extinction, 1/world unit |
//! | s | particle cross-section: the area of one pixel |
//!
//! The particles before depth z in the column behind a pixel are a Poisson variable of mean ∫ν·s dz = ∫σ dz = τ, so the
//! share of sets without one is e^−τ: Beer's law, at any resolution and for any σ. (Sakamoto et al. 2010 derive ν from
//! the opacity of one step Δt and the sphere's radius r: −ln(1 − α)/(π·r²·Δt), which is the same with s = π·r².)
//!
//! A cell of volume V gets a Poisson number of mean σ_max·V/s, uniform in the cell, and each is kept with probability
//! σ(x)/σ_max. σ is the transfer function of the trilinearly interpolated value, σ_max its maximum over the range of the
//! eight corners: the law holds within cells too. The usual cell-by-cell method takes one density a cell.
//!
//! A volume ends where its voxels do, half a step beyond the outer lattice points (`places.rs`): a constant one of n points
//! along a ray, h apart, has the optical depth n·h·σ.

use crate::blocks::{BATCH, Batch, Blocks};
use crate::error::check;
#[cfg(feature = "gpu")]
use crate::gpu::{Maker, Twin, columns};
use crate::media::pieces::{Pieces, SEVERAL};
use crate::media::places::{Lattice, Places, between, cells, corners, interpolate, steps};
use crate::params::positive;
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::{Stage, pair};
use crate::{Density, Error, PackedColor, PackedNormal, Particles};
use glam::{Mat3, Vec3};
use rayon::prelude::*;
use splat_core::{Grid, TransferFunction, glam};
#[cfg(feature = "gpu")]
use splat_shaders::layouts::ParticleSource;
use std::borrow::Cow;

/// Parameters of a sampler of volumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeParams {
    /// Particle cross-section s: the area of one pixel in the volume, world units², > 0.
    pub cross_section: f64,
    /// Factor on the extinction, finite and ≥ 0.
    pub extinction_scale: f64,
    /// Whether particles get the normal −∇value, for shading as a surface.
    pub normals: bool,
    /// Seed of all sets.
    pub seed: u64,
}

impl Default for VolumeParams {
    fn default() -> Self {
        Self { cross_section: 1e-4, extinction_scale: 1.0, normals: false, seed: 1 }
    }
}

impl VolumeParams {
    /// Checks ranges.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        positive(self.cross_section, "cross_section")?;
        let scale = self.extinction_scale;
        check(scale.is_finite() && scale >= 0.0, "extinction_scale", scale, "a finite number ≥ 0")
    }
}

/// A cell with extinction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    /// Lattice index of the first corner.
    pub(crate) at: u32,
    /// σ_max.
    most: f32,
    /// The piece of the transfer function in which all values of the cell lie, or [`SEVERAL`].
    piece: u32,
}

/// Particles in a regular volume.
pub struct GridSampler<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) transfer: Cow<'a, TransferFunction>,
    pub(crate) params: VolumeParams,
    density: Option<Density<'a>>,
    /// Each cell with extinction.
    pub(crate) cells: Vec<Cell>,
    pieces: Pieces,
    pub(crate) sets: PoissonSets,
    lattice: Lattice,
    /// World gradient from the gradient in lattice steps.
    gradient: Mat3,
}

impl<'a> GridSampler<'a> {
    /// Finds the cells with extinction and prepares their tables: 20 bytes a cell.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Core`] for a grid that breaks a promise, [`Error::Empty`]
    /// for one without extinction, [`Error::Limit`] for more than 4·10⁹ lattice points, or particles a set.
    pub fn new(
        grid: &'a Grid,
        transfer: &'a TransferFunction,
        params: &VolumeParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        Self::with_transfer(grid, Cow::Borrowed(transfer), params, density)
    }

    /// The same by a transfer function that it keeps.
    ///
    /// # Errors
    /// As [`GridSampler::new`].
    pub fn owning(
        grid: &'a Grid,
        transfer: TransferFunction,
        params: &VolumeParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        Self::with_transfer(grid, Cow::Owned(transfer), params, density)
    }

    pub(crate) fn with_transfer(
        grid: &'a Grid,
        transfer: Cow<'a, TransferFunction>,
        params: &VolumeParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        params.validate()?;
        grid.validate()?;
        density.as_ref().map_or(Ok(()), Density::validate)?;
        if grid.values.len() > u32::MAX as usize {
            let needed = grid.values.len() as u64;
            return Err(Error::limit("a volume", needed, u32::MAX.into(), "lattice points"));
        }
        let [nx, ny, nz] = grid.dims;
        let pieces = Pieces::new(&transfer);
        let rows = cells(ny);
        let cells: Vec<Cell> = (0..rows * cells(nz))
            .into_par_iter()
            .with_min_len(16)
            .flat_map_iter(|row| row_of_cells(grid, &transfer, &pieces, (row / rows * ny + row % rows) * nx))
            .collect();
        let most = density.as_ref().map_or(1.0, |d| d.max);
        let per_cell = grid.cell_volume() / params.cross_section * params.extinction_scale * most;
        let lattice = Lattice::new(grid.axes.as_mat3(), grid.dims.map(|n| n as u32));
        let rate = |c: usize| f64::from(cells[c].most) * f64::from(lattice.volume(cells[c].at)) * per_cell;
        let blocks = Blocks::new(cells.len(), rate)?;
        if blocks.chunks() == 0 {
            return Err(Error::Empty { what: "a volume", reason: "no cell has an extinction" });
        }
        let sets = PoissonSets::new(grid.origin, params.cross_section, blocks);
        let gradient = grid.axes.inverse().transpose().as_mat3();
        Ok(Self { grid, transfer, params: *params, density, cells, pieces, sets, lattice, gradient })
    }

    /// Cells with extinction.
    pub fn active_cells(&self) -> usize {
        self.cells.len()
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        self.sets.blocks.bytes() + (self.cells.len() * size_of::<Cell>()) as u64
    }

    /// Where its cells are.
    pub(crate) fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Value and lattice gradient so many steps from a cell's first corner.
    #[inline]
    pub(crate) fn interpolate(&self, at: u32, within: [f32; 3]) -> (f32, Vec3) {
        interpolate(corners(self.grid, at), between(within))
    }

    /// Appends a particle.
    #[inline]
    pub(crate) fn push(&self, offset: Vec3, color: [f32; 3], gradient: Vec3, particles: &mut Particles) {
        let normal =
            if self.params.normals { PackedNormal::new(-(self.gradient * gradient)) } else { PackedNormal::default() };
        particles.push(offset, normal, PackedColor::at(color, offset));
    }
}

/// The active cells of one row of the lattice that begins at index `first`.
fn row_of_cells(grid: &Grid, transfer: &TransferFunction, pieces: &Pieces, first: usize) -> Vec<Cell> {
    let [next, row, layer] = steps(grid.dims);
    let range = |i: usize| {
        let v = [i, i + row, i + layer, i + layer + row].map(|i| grid.values[i]);
        (v[0].min(v[1]).min(v[2]).min(v[3]), v[0].max(v[1]).max(v[2]).max(v[3]))
    };
    let mut found = Vec::new();
    let mut left = range(first);
    for i in first..first + cells(grid.dims[0]) {
        let right = range(i + next);
        let low = left.0.min(right.0);
        let high = left.1.max(right.1);
        let most = largest_extinction(transfer, low, high);
        if most > 0.0 {
            found.push(Cell { at: i as u32, most, piece: pieces.containing(low, high) });
        }
        left = right;
    }
    found
}

/// Maximum of the extinction over the values `low ..= high`: at an end, or at a control point between.
pub(crate) fn largest_extinction(transfer: &TransferFunction, low: f32, high: f32) -> f32 {
    let points = transfer.points();
    let ends = transfer.at(low).extinction.max(transfer.at(high).extinction);
    let from = points.partition_point(|p| p.value <= low);
    points[from..].iter().take_while(|p| p.value < high).fold(ends, |m, p| m.max(p.extinction))
}

impl Poisson for GridSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        self.sets.blocks.batches(self.params.seed, Stage::Volume, set, chunk, |batch| self.place(batch, particles));
    }

    #[cfg(feature = "gpu")]
    fn tables(&self) -> Option<Twin> {
        if self.density.is_some() {
            return None;
        }
        let mut axes = columns(&self.grid.axes.as_mat3());
        let [gradient_x, gradient_y, gradient_z] = columns(&self.gradient);
        axes.iter_mut().zip(self.lattice.ends().to_array()).for_each(|(axis, end)| axis[3] = end);
        let [axis_x, axis_y, axis_z] = axes;
        let source = ParticleSource {
            axis_x,
            axis_y,
            axis_z,
            gradient_x,
            gradient_y,
            gradient_z,
            lattice: [self.grid.dims[0] as u32, self.grid.dims[1] as u32],
            flags: 2 * u32::from(self.params.normals),
            pieces: self.pieces.len() as u32,
            ..ParticleSource::default()
        };
        let cells = self.cells.iter().flat_map(|c| [c.at, c.most.to_bits(), c.piece]).collect();
        let values = self.grid.values.iter().map(|v| v.to_bits()).collect();
        let tables = vec![cells, values, self.pieces.words()];
        Some(Twin::new(Maker::Volume, self, source, tables, self.params.seed, Stage::Volume))
    }
}

impl GridSampler<'_> {
    /// Appends the particles of some arrivals, step by step, so that what misses the cache is asked for all at once.
    fn place(&self, batch: &Batch<2>, particles: &mut Particles) {
        let n = batch.len;
        let mut cells = [Cell { at: 0, most: 0.0, piece: 0 }; BATCH];
        cells.iter_mut().zip(&batch.elements[..n]).for_each(|(cell, e)| *cell = self.cells[*e]);
        let mut places = Places::EMPTY;
        for j in 0..n {
            places.begin(j, cells[j].at, corners(self.grid, cells[j].at), batch.bits[0][j]);
        }
        places.find(n, &self.lattice);
        for j in 0..n {
            let Cell { most, piece, .. } = cells[j];
            let value = places.value[j];
            let point = if piece == SEVERAL { self.transfer.at(value) } else { self.pieces.at(piece, value) };
            let [kept, dense] = pair(batch.bits[1][j]);
            if kept * most >= point.extinction {
                continue;
            }
            let offset = places.offset(j);
            let thinned = |d: &Density<'_>| f64::from(dense) * d.max >= d.at(self.grid.origin + offset.as_dvec3());
            if self.density.as_ref().is_some_and(thinned) {
                continue;
            }
            self.push(offset, point.color, places.gradient(j), particles);
        }
    }
}
