//! A lattice in slab coordinates, with what its kernels, its values and its classes need.

use super::frame::Frame;
use crate::shared::classifier::{Base, Classifier};
use crate::shared::lattice::Lattice;
use crate::shared::lattice::near::Near;
use crate::shared::lattice::neighbours::Receivers;
use crate::shared::sections::{PHASES, SectionTable};
use crate::shared::value_range::ValueRange;
use crate::shared::voxels::{Voxels, without_extinction};
use crate::{Params, Volume};
use splat_core::Footprint;
use splat_core::glam::{DMat3, DVec3};
use splat_core::raster::kernel::Kernel;

/// One volume of a sweep.
pub(crate) struct Placed<'a> {
    pub(crate) volume: &'a Volume<'a>,
    /// Slab coordinates of lattice point 0, without a rim.
    pub(crate) start: DVec3,
    /// Steps in slab coordinates.
    pub(crate) axes: DMat3,
    /// Extent of a kernel along the slabs, world units²: aa, ab, bb.
    pub(crate) extent: [f64; 3],
    /// How far it reaches across them.
    pub(crate) reach: f64,
    /// Cutoff radius over standard deviation.
    pub(crate) cutoff: f64,
    pub(crate) sections: SectionTable,
    pub(crate) kernel: Kernel,
    pub(crate) classifier: Classifier,
    /// What values are taken relative to.
    pub(crate) base: Base,
    /// Whether gradients are told from neighbouring sheets.
    pub(crate) compares: bool,
    /// Whether sums are rounded to half precision.
    pub(crate) half: bool,
    width: f64,
    /// Places within a slab at which kernels begin, and how many 256ths of a slab they are apart.
    starts: f64,
    apart: u32,
    /// How much farther kernels reach by that than with all 256, slabs.
    rounding: f64,
}

impl<'a> Placed<'a> {
    pub(crate) fn new(volume: &'a Volume<'a>, frame: &Frame, params: &Params) -> Self {
        let axes = frame.steps(volume);
        let steps = volume.packing.equivalent_steps(axes);
        let m = steps * steps.transpose() * (params.kernel.extent * params.kernel.extent);
        let reach = libm::sqrt(m.z_axis.z);
        let cutoff = params.kernel.extent / params.kernel.sigma;
        let footprint = Footprint { cutoff: cutoff as f32 };
        let base = Base::new(ValueRange::of_values(&volume.grid.values), &volume.seen());
        Self {
            volume,
            start: frame.point(volume.origin()),
            axes,
            extent: [m.x_axis.x, m.x_axis.y, m.y_axis.y],
            reach,
            cutoff,
            sections: SectionTable::new(reach / frame.slabs.width, &footprint),
            kernel: Kernel::new(&footprint),
            classifier: Classifier::new(&volume.seen(), volume.extinction_scale, base),
            base,
            compares: params.compares_sheets(volume),
            half: params.is_half(),
            width: frame.slabs.width,
            starts: f64::from(params.sections),
            apart: PHASES / params.sections,
            rounding: params.rounding(),
        }
    }

    /// Where the kernel of a voxel at this depth begins, in 256ths of a slab. Rounded, so that a lattice that lies evenly in the
    /// slabs stays clear of the edges of phases.
    #[inline(always)]
    pub(crate) fn place(&self, depth: f64) -> u32 {
        // `Slabs` begin before the first kernel.
        ((depth - self.reach) / self.width * self.starts + 0.5).max(0.0) as u32 * self.apart
    }

    /// Lattice steps along each axis within which lie all voxels that shape what a pixel has of a slab, for footprints of
    /// `extent`; `gradient` adds the neighbours that gradients are taken from, a pixel being at most `pixel` wide in a slab.
    pub(crate) fn lattice_reach(&self, extent: [f64; 3], pixel: f64) -> [usize; 3] {
        let [aa, ab, bb] = extent;
        let neighbour = if self.compares { 1.0 } else { 0.0 };
        // A sheet holds means over its slab, and where a face cuts it part of the next one's.
        let across = self.reach + (1.5 + neighbour + self.rounding) * self.width;
        let inverse = self.axes.inverse();
        [0, 1, 2].map(|axis| {
            let row = inverse.row(axis);
            let along = libm::sqrt((row.x * row.x * aa + 2.0 * row.x * row.y * ab + row.y * row.y * bb).max(0.0));
            let steps = along + (row.x.abs() + row.y.abs()) * pixel * neighbour + row.z.abs() * across;
            // From any place of a cell; as much more along planes as every second one is shifted.
            (steps + 0.5 + if axis < 2 { self.volume.packing.shift(1) } else { 0.0 }).min(1e6) as usize
        })
    }

    /// The lattice with the rim that kernels reach, and the voxels of it that may matter.
    pub(crate) fn voxels(&self, reach: [usize; 3]) -> (Lattice<'a>, Voxels) {
        let lattice = Lattice::new(self.volume.grid, self.volume.packing, reach);
        let voxels =
            Voxels::needed(&lattice, &without_extinction(&self.volume.seen()), &Near::block(reach.map(|n| 2 * n)));
        (lattice, voxels)
    }

    /// Who receives shadows there: places are slab coordinates.
    pub(crate) fn receivers<'b>(&'b self, voxels: &'b Voxels, rim: [usize; 3]) -> Receivers<'b> {
        Receivers { volume: self.volume, voxels, rim, radius: self.reach as f32, rows: self.lattice_rows() }
    }

    /// Rows of what leads from slab coordinates to lattice coordinates.
    pub(crate) fn lattice_rows(&self) -> [[f64; 4]; 3] {
        let inverse = self.axes.inverse();
        let start = inverse * -self.start;
        [0, 1, 2].map(|a| [inverse.row(a).x, inverse.row(a).y, inverse.row(a).z, start[a]])
    }

    /// Slab coordinates of a lattice point, counted from the corner of a rim.
    pub(crate) fn position(&self, rim: [usize; 3], index: [usize; 3]) -> DVec3 {
        let shift = self.volume.packing.shift(index[2] + rim[2] % 2);
        let shifts = [shift, shift, 0.0];
        let steps = [0, 1, 2].map(|a| index[a] as f64 - rim[a] as f64 + shifts[a]);
        self.start + self.axes * DVec3::from_array(steps)
    }
}
