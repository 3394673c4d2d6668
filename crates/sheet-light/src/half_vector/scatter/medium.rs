//! What the cells of diffuse light are filled with: means of extinction and scattering over places in each cell.
//!
//! Values are interpolated linearly between voxels and classified then, as in the sheets. Volumes that share a cell add: their
//! extinctions, and their scattering with its own phase function, so media mix by how much they scatter.

use super::grid::{Column, GridNode, GridPlace, LightGrid};
use super::phase::share_ahead;
use super::streams::optics;
use crate::Volume;
use crate::half_vector::params::{HalfParams, Scattering};
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Shading, TransferPoint};

/// Places in a cell along its width, its height and its depth: one a voxel.
const PLACES: [usize; 3] = [4, 4, 2];

/// A cell; by channel, per world unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Cell {
    /// σ_t.
    pub(crate) extinction: [f32; 3],
    /// σ_s.
    pub(crate) scattering: [f32; 3],
    /// σ_s·g.
    pub(crate) forward: [f32; 3],
    /// σ_s·f: what stays with the light that goes ahead.
    pub(crate) ahead: [f32; 3],
}

/// Whether light that comes from all sides is scattered here by a phase function.
pub(crate) fn scatters(volume: &Volume<'_>) -> bool {
    let by_phase = match volume.material.shading {
        Shading::Phase => true,
        Shading::Phong => !volume.normals,
        Shading::Unlit => false,
    };
    by_phase && volume.material.single_scattering_albedo > 0.0
}

/// Single-scattering albedo of a colour, by channel, in \[0, 1\].
pub(crate) fn albedo(volume: &Volume<'_>, color: [f32; 3]) -> [f32; 3] {
    color.map(|c| (c * volume.material.single_scattering_albedo).clamp(0.0, 1.0))
}

/// A volume and where its lattice lies.
struct Lattice<'a> {
    volume: &'a Volume<'a>,
    inverse: DMat3,
    origin: DVec3,
    /// f.
    ahead: f32,
    scatters: bool,
}

impl<'a> Lattice<'a> {
    fn new(volume: &'a Volume<'a>, scattering: Scattering) -> Self {
        let ahead = share_ahead(scattering, volume.material.asymmetry) as f32;
        let inverse = volume.axes().inverse();
        let origin = volume.origin();
        Self { volume, inverse, origin, ahead, scatters: scatters(volume) }
    }

    /// Classified value at a world position; `None` outside and where it is cut away.
    fn classified(&self, world: DVec3) -> Option<TransferPoint> {
        let value = self.volume.value_at(self.inverse * (world - self.origin))?;
        Some(self.volume.transfer.at(value))
    }
}

/// Greatest optical depth of a layer, that of light that stays ahead left out: fluence is taken as linear within one.
const THICKEST: f64 = 0.5;

/// Most cells that thin layers may make: 31 MiB.
pub(crate) const MOST_THIN: u64 = 1 << 16;

/// The cells of a light, and their media: layers that are optically thick are cut into thinner ones, as far as [`MOST_THIN`] allows.
pub(crate) fn resolved(volumes: &[Volume<'_>], camera: &Camera, params: &HalfParams) -> (LightGrid, Vec<Cell>) {
    let grid = LightGrid::new(volumes, camera, params.voxels_per_cell);
    let media = cells(&grid, volumes, params.scattering);
    let thickness = |cell: &Cell| (0..3).map(|c| optics(cell, c, grid.depth).tau).fold(0.0, f64::max);
    let thickest = media.iter().map(thickness).fold(0.0, f64::max);
    let most = MOST_THIN as usize / grid.cells();
    let factor = (libm::ceil(thickest / THICKEST * (1.0 - 1e-6)) as usize).min(most);
    if factor <= 1 {
        return (grid, media);
    }
    let grid = grid.with_layers_times(factor);
    let media = cells(&grid, volumes, params.scattering);
    (grid, media)
}

/// The cells of a light, row by row, layer by layer in a row.
fn cells(grid: &LightGrid, volumes: &[Volume<'_>], scattering: Scattering) -> Vec<Cell> {
    // What casts no shadow takes no light that others would get.
    let casters = volumes.iter().filter(|volume| volume.casts_shadow);
    let lattices: Vec<Lattice<'_>> = casters.map(|volume| Lattice::new(volume, scattering)).collect();
    let mut out = vec![Cell::default(); grid.cells()];
    let row = grid.layers * grid.columns[0];
    out.par_chunks_mut(row).enumerate().for_each(|(y, cells)| {
        for (k, cell) in cells.iter_mut().enumerate() {
            let column = Column { x: k % grid.columns[0], y };
            fill(cell, grid, &lattices, GridNode { column, level: k / grid.columns[0] });
        }
    });
    out
}

fn fill(cell: &mut Cell, grid: &LightGrid, lattices: &[Lattice<'_>], node: GridNode) {
    let corner = [node.column.x, node.column.y, node.level];
    let share = 1.0 / PLACES.iter().product::<usize>() as f32;
    let place = |n: usize, a: usize| corner[a] as f64 + (n as f64 + 0.5) / PLACES[a] as f64;
    for (i, j, k) in
        (0..PLACES[2]).flat_map(|k| (0..PLACES[1]).flat_map(move |j| (0..PLACES[0]).map(move |i| (i, j, k))))
    {
        let world = grid.world(GridPlace { x: place(i, 0) - 0.5, y: place(j, 1) - 0.5, face: place(k, 2) });
        for lattice in lattices {
            let Some(point) = lattice.classified(world) else {
                continue;
            };
            let material = lattice.volume.material;
            let extinction_share = point.extinction * lattice.volume.extinction_scale as f32 * share;
            let albedo = if lattice.scatters { albedo(lattice.volume, point.color) } else { [0.0; 3] };
            for c in 0..3 {
                let extinction = extinction_share * material.extinction_rgb[c];
                let scattering = extinction * albedo[c];
                cell.extinction[c] += extinction;
                cell.scattering[c] += scattering;
                cell.forward[c] += scattering * material.asymmetry;
                cell.ahead[c] += scattering * lattice.ahead;
            }
        }
    }
}

/// Mean asymmetry of all that is scattered, 0 where nothing is.
pub(crate) fn mean_asymmetry(cells: &[Cell]) -> f64 {
    let sum = |color: fn(&Cell) -> [f32; 3]| cells.iter().flat_map(color).map(f64::from).sum::<f64>();
    let scattering = sum(|cell| cell.scattering);
    if scattering > 0.0 { sum(|cell| cell.forward) / scattering } else { 0.0 }
}
