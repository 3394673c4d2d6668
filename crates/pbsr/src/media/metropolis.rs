//! Particles in volumes by the Metropolis method: chains of places whose density is proportional to the extinction.
//!
//! A chain at x is offered, in turns, a uniform place of all cells with extinction and one within a cell's length of x; it
//! goes there with probability min(1, σ(x')/σ(x)). Both offers are symmetric, so places have the density σ/∫σ dV, and a
//! set gets a Poisson number of them of mean ∫σ dV/s. Cells at the border are longer (`places.rs`): chains move among cells
//! as if these were of equal size, by σ times the volume of the cell.
//!
//! With a density, each particle is kept with probability density/greatest density, which is exact thinning.
//!
//! The method of the literature, kept for comparison. Cell by cell ([`GridSampler`]) is faster and exact; here ∫σ dV is a
//! sum over two Gauss points an axis of each cell, a chain starts with the density σ_max of its cell rather than σ, and a
//! place where all offers between two particles are refused is taken twice, which costs opacity where σ is far above its
//! mean. More steps between particles make that rarer.

use crate::error::check;
use crate::media::places::cells;
use crate::media::volume::{Cell, VolumeParams};
use crate::params::countable;
use crate::stream::{Stage, Stream};
use crate::{Density, Error, GridSampler, Particles, Sampler};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use splat_core::{Grid, TransferFunction, TransferPoint, glam};
use std::borrow::Cow;

/// Particles of a chunk, in the mean.
const CHUNK: f64 = 4096.0;

/// Parameters of the chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetropolisParams {
    /// Particles that one chain leaves, ≥ 1.
    pub particles_per_chain: u32,
    /// Steps before the first particle.
    pub burn_in: u32,
    /// Steps from one particle to the next, ≥ 1.
    pub stride: u32,
}

impl Default for MetropolisParams {
    fn default() -> Self {
        Self { particles_per_chain: 64, burn_in: 64, stride: 16 }
    }
}

/// Particles in a regular volume, by Metropolis chains.
pub struct MetropolisSampler<'a> {
    cells: GridSampler<'a>,
    chains: MetropolisParams,
    /// ∫σ dV / s.
    mean: f64,
    /// The density that thins out particles.
    density: Option<Density<'a>>,
    /// Cell of each lattice point, `u32::MAX` for none.
    cell_at: Vec<u32>,
}

/// Where a chain is.
#[derive(Clone, Copy)]
struct Place {
    cell: usize,
    /// Share of the way through the cell along each axis.
    share: [f32; 3],
    gradient: Vec3,
    point: TransferPoint,
    /// Extinction times the volume of the cell in steps³.
    weight: f32,
}

impl<'a> MetropolisSampler<'a> {
    /// Finds the cells with extinction and integrates it. `density` multiplies the mean number of particles.
    ///
    /// # Errors
    /// The errors of [`GridSampler::new`]; [`Error::Parameter`] for counts of 0.
    pub fn new(
        grid: &'a Grid,
        transfer: &'a TransferFunction,
        params: &VolumeParams,
        chains: &MetropolisParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        Self::with_transfer(grid, Cow::Borrowed(transfer), params, chains, density)
    }

    /// The same by a transfer function that it keeps.
    ///
    /// # Errors
    /// As [`MetropolisSampler::new`].
    pub fn owning(
        grid: &'a Grid,
        transfer: TransferFunction,
        params: &VolumeParams,
        chains: &MetropolisParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        Self::with_transfer(grid, Cow::Owned(transfer), params, chains, density)
    }

    fn with_transfer(
        grid: &'a Grid,
        transfer: Cow<'a, TransferFunction>,
        params: &VolumeParams,
        chains: &MetropolisParams,
        density: Option<Density<'a>>,
    ) -> Result<Self, Error> {
        check(chains.particles_per_chain >= 1, "particles_per_chain", chains.particles_per_chain, "at least 1")?;
        check(chains.stride >= 1, "stride", chains.stride, "at least 1")?;
        let cells = GridSampler::with_transfer(grid, transfer, params, None)?;
        const POINTS: [f32; 2] = [0.211_324_87, 0.788_675_1];
        let of_cell = |&Cell { at, .. }: &Cell| {
            let lattice = cells.lattice();
            let at_point = |k: usize| {
                let share = [POINTS[k & 1], POINTS[k >> 1 & 1], POINTS[k >> 2]];
                f64::from(
                    cells.transfer.at(cells.interpolate(at, lattice.within(lattice.corner(at), share)).0).extinction,
                )
            };
            f64::from(lattice.volume(at)) * (0..8).map(at_point).sum::<f64>() / 8.0
        };
        // Chunks of fixed size, summed in order: the same bits for any number of threads.
        let sums: Vec<f64> = cells.cells.par_chunks(4096).map(|c| c.iter().map(of_cell).sum()).collect();
        density.as_ref().map_or(Ok(()), Density::validate)?;
        let volume = grid.cell_volume() * params.extinction_scale * density.as_ref().map_or(1.0, |d| d.max);
        let mean = sums.iter().sum::<f64>() * volume / params.cross_section;
        countable(mean)?;
        let mut cell_at = vec![u32::MAX; grid.values.len()];
        cells.cells.iter().zip(0..).for_each(|(cell, c)| cell_at[cell.at as usize] = c);
        Ok(Self { cells, chains: *chains, mean, density, cell_at })
    }

    fn place(&self, cell: usize, share: [f32; 3]) -> Place {
        let at = self.cells.cells[cell].at;
        let lattice = self.cells.lattice();
        let (value, gradient) = self.cells.interpolate(at, lattice.within(lattice.corner(at), share));
        let point = self.cells.transfer.at(value);
        Place { cell, share, gradient, point, weight: point.extinction * lattice.volume(at) }
    }

    /// A uniform place of all cells with extinction, as if they were alike.
    fn anywhere(&self, stream: &mut Stream) -> Place {
        let cell = (((stream.bits() >> 32) * self.cells.cells.len() as u64) >> 32) as usize;
        self.place(cell, stream.triple())
    }

    /// A place within a cell's length of `from`, or `None` out of all cells with extinction.
    fn nearby(&self, from: &Place, stream: &mut Stream) -> Option<Place> {
        let corner = self.cells.lattice().corner(self.cells.cells[from.cell].at);
        let step = stream.triple();
        let to: [f32; 3] = std::array::from_fn(|a| from.share[a] + 2.0 * step[a] - 1.0);
        let floor = to.map(f32::floor);
        let dims = self.cells.grid.dims;
        let mut at = [0usize; 3];
        for a in 0..3 {
            let i = i64::from(corner[a]) + floor[a] as i64;
            at[a] = usize::try_from(i).ok().filter(|i| *i < cells(dims[a]))?;
        }
        let cell = self.cell_at[(at[2] * dims[1] + at[1]) * dims[0] + at[0]];
        let share = std::array::from_fn(|a| (to[a] - floor[a]).min(1.0));
        (cell != u32::MAX).then(|| self.place(cell as usize, share))
    }

    fn step(&self, place: &mut Place, number: u32, stream: &mut Stream) {
        let offer = if number.is_multiple_of(2) { Some(self.anywhere(stream)) } else { self.nearby(place, stream) };
        let u = stream.pair()[0];
        if let Some(to) = offer.filter(|to| u * place.weight < to.weight) {
            *place = to;
        }
    }
}

impl Sampler for MetropolisSampler<'_> {
    fn origin(&self) -> DVec3 {
        self.cells.origin()
    }

    fn cross_section(&self) -> f64 {
        self.cells.cross_section()
    }

    fn chunks(&self) -> usize {
        (self.mean / CHUNK).ceil() as usize
    }

    fn expected(&self, _chunk: usize) -> f64 {
        self.mean / (self.mean / CHUNK).ceil()
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        scratch.clear();
        let mut stream = Stream::new(self.cells.params.seed, Stage::Metropolis, set, chunk as u64);
        let count = stream.poisson(self.expected(chunk)) as usize;
        scratch.reserve(count);
        let mut made = 0;
        while made < count {
            let mut place = self.anywhere(&mut stream);
            (0..self.chains.burn_in).for_each(|n| self.step(&mut place, n, &mut stream));
            for _ in 0..self.chains.particles_per_chain.min((count - made) as u32) {
                made += 1;
                (0..self.chains.stride).for_each(|n| self.step(&mut place, n, &mut stream));
                let at = self.cells.cells[place.cell].at;
                let lattice = self.cells.lattice();
                let corner = lattice.corner(at);
                let offset = lattice.offset(corner, lattice.within(corner, place.share));
                let at = self.cells.grid.origin + offset.as_dvec3();
                if self.density.as_ref().is_some_and(|d| stream.unit() * d.max >= d.at(at)) {
                    continue;
                }
                self.cells.push(offset, place.point.color, place.gradient, scratch);
            }
        }
        scratch
    }
}
