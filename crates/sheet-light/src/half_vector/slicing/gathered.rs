//! A lattice whose values the pixels of sheets read, and its coordinates at places in the slabs.

use super::band::{Band, STEEPEST, slope_of};
use super::frame::Frame;
use super::placed::Placed;
use super::sheet::Sheet;
use super::sight::Sight;
use crate::shared::depths::DepthRange;
use crate::shared::gathered::bricks::Box3;
use crate::shared::gathered::{Gathered, RIM};
use crate::shared::lattice::Lattice;
use crate::shared::params::GatherKernel;
use crate::shared::voxels::Voxels;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// A volume whose sheets are gathered.
pub(crate) struct GatheredVolume<'a> {
    pub(crate) lattice: Gathered<'a>,
    /// Lattice from slab coordinates.
    rows: [[f32; 4]; 3],
}

impl<'a> GatheredVolume<'a> {
    /// The lattice of a volume, with the rim that kernels reach, and the voxels of it that may matter to the eye's image and the light's.
    pub(crate) fn new(
        placed: &Placed<'a>,
        kernel: GatherKernel,
        frame: &Frame,
        sight: &Sight,
    ) -> (Self, Lattice<'a>, Voxels) {
        let volume = placed.volume;
        let near = kernel.near(steps_to_neighbours(placed, frame, sight));
        let (lattice, voxels) = Gathered::new(volume, kernel, &volume.seen(), placed.base, &near);
        let rows = placed.lattice_rows().map(|row| row.map(|n| n as f32));
        (Self { lattice, rows }, Lattice::new(volume.grid, volume.packing, RIM), voxels)
    }

    /// Bytes of what is kept beside the file's own values.
    pub(crate) fn bytes(&self) -> u64 {
        self.lattice.bytes()
    }
}

impl Sheet {
    /// Reads the lattice at the place of each pixel of the slab between two faces. Number of samples, whole vectors.
    #[inline(always)]
    pub(crate) fn gather<S: Simd>(
        &mut self,
        simd: S,
        volume: &GatheredVolume<'_>,
        band: &Band,
        faces: DepthRange,
    ) -> u64 {
        let middle = simd.lanes(0.5 * (faces.near + faces.far));
        let width = simd.lanes(faces.far - faces.near);
        let one = simd.lanes(1.0);
        let count = Lanes::<S>::COUNT;
        let mut samples = 0;
        for y in self.rows.clone() {
            let mut shown = self.spans[y].end..self.spans[y].start;
            for x in self.spans[y].clone().step_by(count) {
                let k = y * band.stride + x;
                let near = Lanes::load(simd, &self.near[k..]);
                let far = Lanes::load(simd, &self.far[k..]);
                if !near.any_less(far) {
                    continue;
                }
                let a = Lanes::load(simd, &self.places[0][k..]);
                let b = Lanes::load(simd, &self.places[1][k..]);
                let s = Lanes::load(simd, &self.behind[k..]).mul_add(width, middle);
                let mut places = [a; 3];
                for axis in 0..3 {
                    let [of_a, of_b, of_s, start] = volume.rows[axis];
                    let sum = simd.lanes(of_s).mul_add(s, simd.lanes(start));
                    let sum = simd.lanes(of_b).mul_add(b, sum);
                    places[axis] = simd.lanes(of_a).mul_add(a, sum);
                }
                let cells = cells(simd, near, far, &places);
                if !volume.lattice.shows(&cells) {
                    continue;
                }
                let corner = volume.lattice.corner(&cells);
                for axis in 0..3 {
                    places[axis] = places[axis] + simd.lanes(corner.from(axis, 0.0) as f32);
                }
                volume.lattice.values(simd, &corner, &places).store(&mut self.values[k..]);
                one.store(&mut self.weights[k..]);
                shown = shown.start.min(x)..x + count;
                samples += count as u64;
            }
            self.shown[y] = if shown.is_empty() { 0..0 } else { shown };
        }
        samples
    }
}

/// The cells of the places of neighbouring pixels that are inside, and all between them.
#[inline(always)]
fn cells<S: Simd>(simd: S, near: Lanes<S>, far: Lanes<S>, places: &[Lanes<S>; 3]) -> Box3 {
    let nowhere = simd.lanes(f32::INFINITY);
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for a in 0..3 {
        let mut least = [f32::INFINITY; MAX_LANES];
        let mut greatest = [f32::NEG_INFINITY; MAX_LANES];
        places[a].where_less_or(near, far, nowhere).store(&mut least);
        places[a].where_less_or(near, far, simd.lanes(f32::NEG_INFINITY)).store(&mut greatest);
        low[a] = least.iter().fold(f32::INFINITY, |least, n| least.min(*n)).into();
        high[a] = greatest.iter().fold(f32::NEG_INFINITY, |greatest, n| greatest.max(*n)).into();
    }
    Box3::around([low, high])
}

/// Lattice steps along each axis within which the places of neighbouring pixels and sheets lie, where gradients are taken from these.
fn steps_to_neighbours(placed: &Placed<'_>, frame: &Frame, sight: &Sight) -> [usize; 3] {
    if !placed.compares {
        return [0; 3];
    }
    let pixel = sight.widest_pixel(frame, placed);
    let [width, height] = sight.camera.size.map(f64::from);
    let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
    let slopes = corners.map(|[x, y]| slope_of(&frame.ray(&sight.camera, x, y)));
    let rows = placed.lattice_rows();
    rows.map(|[a, b, s, _]| {
        let row = DVec3::new(a, b, s);
        let along = |slope: Option<DVec3>| match slope {
            Some(slope) => row.dot(slope).abs(),
            None => libm::hypot(a, b) * STEEPEST + s.abs(),
        };
        let along = slopes.into_iter().map(along).fold(0.0, f64::max);
        let steps = (a.abs() + b.abs()) * pixel + along * frame.slabs.width;
        // What lies at a step by rounding does.
        (steps - 1e-9).ceil().clamp(0.0, 1e6) as usize
    })
}
