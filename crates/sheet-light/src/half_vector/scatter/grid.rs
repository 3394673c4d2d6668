//! Cells of diffuse light: columns along the light's own rays, cut into layers across its axis.
//!
//! Diffuse light is smooth, so cells are larger than voxels, twice as wide as they are deep; their number follows from that of the
//! voxels alone. Columns of a lamp are as wide as its rays are apart. Rows of cells lie together, layer by layer: what is swept along
//! the light is one piece of memory for each row, and rows are tasks.

use crate::Volume;
use crate::half_vector::slicing::frame::Frame;
use crate::shared::slabs::Slabs;
use splat_core::Camera;
use splat_core::glam::DVec3;

/// Width of a cell in its depths.
const FLATNESS: f64 = 2.0;

/// A column of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Column {
    pub(crate) x: usize,
    pub(crate) y: usize,
}

/// A cell, or a face of one, by its column and by its number along the light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GridNode {
    pub(crate) column: Column,
    /// Number of the layer, or of the face before it.
    pub(crate) level: usize,
}

/// A place among the cells: whole numbers at the middles of columns and at faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GridPlace {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) face: f64,
}

impl GridPlace {
    /// By axis.
    pub(crate) fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.face]
    }
}

/// Numbers of a plane or of all cells that lie on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GridLine {
    /// Place of the first.
    pub(crate) start: usize,
    /// From one to the next.
    pub(crate) step: usize,
    pub(crate) count: usize,
}

impl GridLine {
    /// Place of a number of the line.
    #[inline]
    pub(crate) fn index(self, i: usize) -> usize {
        self.start + i * self.step
    }
}

/// Cells of one light. Layers are counted the way that light travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightGrid {
    /// Right, up, and the way that light travels, world space.
    pub(crate) axes: [DVec3; 3],
    position: DVec3,
    is_lamp: bool,
    /// x and y of the first column's corner; per depth for a lamp.
    corner: [f64; 2],
    /// Width of a column along x and y; per depth for a lamp.
    pub(crate) step: [f64; 2],
    /// Depth of the first face.
    pub(crate) near: f64,
    /// Depth of a layer, world units.
    pub(crate) depth: f64,
    /// Columns of a row, rows.
    pub(crate) columns: [usize; 2],
    pub(crate) layers: usize,
}

impl LightGrid {
    /// About the volumes, of which there is at least one, with at most one cell for `voxels` voxels but one layer of one column.
    pub(crate) fn new(volumes: &[Volume<'_>], camera: &Camera, voxels: u32) -> Self {
        let is_lamp = !camera.is_orthographic();
        let views = || volumes.iter().flat_map(Volume::corners).map(|p| camera.view_from_world(p));
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for p in views() {
            let spread = if is_lamp { p.z } else { 1.0 };
            let p = DVec3::new(p.x / spread, p.y / spread, p.z);
            (low, high) = (low.min(p), high.max(p));
        }
        let extent = high - low;
        let middle = if is_lamp { 0.5 * (low.z + high.z) } else { 1.0 };
        let all_voxels: f64 = volumes.iter().map(|v| v.grid.values.len() as f64).sum();
        let size = extent.x * middle * extent.y * middle * extent.z;
        // FLATNESS² · depth³ is a cell.
        let depth = libm::cbrt(size * f64::from(voxels) / all_voxels) / libm::cbrt(FLATNESS * FLATNESS);
        let most = (all_voxels / f64::from(voxels)).max(1.0);
        // What is flatter than a cell is one layer.
        let width = (FLATNESS * depth).max(middle * libm::sqrt(extent.x * extent.y / most));
        let width = if depth > extent.z { width } else { FLATNESS * depth };
        // Rounding a place down to a cell less would make pictures depend on it.
        let count = |extent: f64| libm::floor((extent / width * (1.0 + 1e-9)).max(1.0));
        let columns = [extent.x, extent.y].map(|e| count(e * middle));
        let layers = libm::floor((most / (columns[0] * columns[1])).max(1.0)).min(libm::ceil(extent.z / depth));
        Self {
            axes: camera.axes,
            position: camera.position,
            is_lamp,
            corner: [low.x, low.y],
            step: [extent.x / columns[0], extent.y / columns[1]],
            near: low.z,
            depth: extent.z / layers,
            columns: columns.map(|n| n as usize),
            layers: layers as usize,
        }
    }

    /// The same columns with so many layers in the place of each.
    pub(super) fn with_layers_times(self, factor: usize) -> Self {
        Self { layers: self.layers * factor, depth: self.depth / factor as f64, ..self }
    }

    /// Number of cells.
    pub(crate) fn cells(&self) -> usize {
        self.columns[0] * self.columns[1] * self.layers
    }

    /// Slabs that are the layers, with one more before them and one behind them for all that is there.
    pub(crate) fn slabs(&self) -> Frame {
        let [width, height] = self.columns.map(|n| n as f64);
        let half = 0.5 * self.layers as f64;
        let center = self.world(GridPlace { x: 0.5 * (width - 1.0), y: 0.5 * (height - 1.0), face: half });
        // Along the axis: the middle of a lamp's cells may lie beside it.
        let slabs = Slabs { origin: -(half + 1.0) * self.depth, width: self.depth, count: self.layers as u32 + 2 };
        Frame::along(center, self.axes, slabs)
    }

    /// The place of a world position.
    #[inline]
    pub(crate) fn place(&self, world: DVec3) -> GridPlace {
        let from = world - self.position;
        let [x, y, z] = self.axes.map(|axis| axis.dot(from));
        let spread = if self.is_lamp { z } else { 1.0 };
        let along = |v: f64, a: usize| (v / spread - self.corner[a]) / self.step[a] - 0.5;
        GridPlace { x: along(x, 0), y: along(y, 1), face: (z - self.near) / self.depth }
    }

    /// World position of such a place.
    pub(crate) fn world(&self, place: GridPlace) -> DVec3 {
        let GridPlace { x, y, face } = place;
        let z = self.near + face * self.depth;
        let spread = self.spread(face);
        let along = |v: f64, a: usize| (self.corner[a] + (v + 0.5) * self.step[a]) * spread;
        let [right, up, forward] = self.axes;
        self.position + right * along(x, 0) + up * along(y, 1) + forward * z
    }

    /// Unit direction of the light at a world position.
    pub(crate) fn travel(&self, world: DVec3) -> DVec3 {
        if self.is_lamp { (world - self.position).normalize_or_zero() } else { self.axes[2] }
    }

    /// Sides of a cell at a face, world units.
    pub(crate) fn sides(&self, face: f64) -> [f64; 3] {
        let spread = self.spread(face).abs();
        [self.step[0] * spread, self.step[1] * spread, self.depth]
    }

    /// Factor on the widths of columns at a face.
    #[inline]
    pub(crate) fn spread(&self, face: f64) -> f64 {
        if self.is_lamp { self.near + face * self.depth } else { 1.0 }
    }

    /// Area of a column at a face, world units².
    pub(crate) fn area(&self, face: f64) -> f64 {
        self.step[0] * self.step[1] * self.spread(face) * self.spread(face)
    }

    /// Length of a column's ray in a layer, world units.
    pub(crate) fn length(&self, column: Column) -> f64 {
        if !self.is_lamp {
            return self.depth;
        }
        let along = |n: usize, a: usize| self.corner[a] + (n as f64 + 0.5) * self.step[a];
        let x = along(column.x, 0);
        let y = along(column.y, 1);
        self.depth * libm::sqrt(1.0 + x * x + y * y)
    }
}
