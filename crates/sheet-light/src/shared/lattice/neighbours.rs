//! The needed voxels around places, and how much each of them counts: trilinear in the lattice.

use crate::Volume;
use crate::shared::vectors::NATURAL;
use crate::shared::voxels::{VoxelPair, VoxelPlace, Voxels};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::{Packing, Receiver, SplatKind};

/// The needed voxels of a volume, and where they are.
pub(crate) struct Receivers<'a> {
    pub(crate) volume: &'a Volume<'a>,
    /// Those that are needed, with a rim around the lattice.
    pub(crate) voxels: &'a Voxels,
    pub(crate) rim: [usize; 3],
    /// Cutoff radius of the kernels, world units.
    pub(crate) radius: f32,
    /// Rows of what leads from places, as they will be asked for, to lattice coordinates.
    pub(crate) rows: [[f64; 4]; 3],
}

/// Voxels as they receive light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VoxelReceivers {
    /// The first voxel of the lattice, relative to what receivers are, and the voxels of the rim before it along each axis.
    start: DVec3,
    rim: DVec3,
    axes: DMat3,
    /// How far planes are shifted, in steps along each of their axes: those of even index, then the others.
    shifts: [f64; 2],
    radius: f32,
}

/// How places lead to voxels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Neighbours {
    /// Needed voxels before each word of 64.
    ranks: Vec<u64>,
    /// Of a body-centred lattice: whether the first plane, that of the rim, is a shifted one.
    is_first_shifted: Option<bool>,
    /// From the places that are asked for to lattice coordinates that count from the rim.
    pub(crate) lattice_from_place: [[f32; 4]; 3],
}

/// Needed voxels around places: by lane, row by row of two voxels, which they are among all of them, and their weights.
pub(crate) struct Cells {
    pub(crate) ranks: [[usize; 4]; MAX_LANES],
    pub(crate) weights: [[[f32; 2]; 4]; MAX_LANES],
    /// Lanes that are asked for, a bit each.
    pub(crate) lane_bits: u32,
}

impl VoxelReceivers {
    /// Those of a volume, relative to `origin`.
    pub(crate) fn new(receivers: &Receivers<'_>, origin: DVec3) -> Self {
        let Receivers { volume, rim, radius, .. } = *receivers;
        Self {
            start: volume.origin() - origin,
            rim: DVec3::from_array(rim.map(|n| n as f64)),
            axes: volume.axes(),
            shifts: [0, 1].map(|k| volume.packing.shift(k + rim[2] % 2)),
            radius,
        }
    }

    /// Where a voxel lies, in lattice coordinates from the rim on.
    pub(crate) fn place(&self, voxel: VoxelPlace) -> DVec3 {
        let shift = self.shifts[voxel.k % 2];
        DVec3::new(voxel.i as f64 + shift, voxel.j as f64 + shift, voxel.k as f64)
    }

    /// The same from the first voxel of the lattice on.
    pub(crate) fn in_lattice(&self, place: DVec3) -> DVec3 {
        place - self.rim
    }

    /// What receives light at a place.
    pub(crate) fn receiver(&self, place: DVec3) -> Receiver {
        let position = (self.start + self.axes * self.in_lattice(place)).as_vec3();
        Receiver { position, normal: Vec3::ZERO, radius: self.radius, kind: SplatKind::Medium }
    }
}

impl Neighbours {
    /// Bytes of those of so many voxels.
    pub(crate) fn bytes(voxels: u64) -> u64 {
        voxels / 8
    }

    pub(crate) fn new(receivers: &Receivers<'_>) -> Self {
        assert!(receivers.voxels.dims().iter().all(|n| *n >= 2), "invariant: a lattice has a rim");
        let mut rows = receivers.rows;
        (0..3).for_each(|a| rows[a][3] += receivers.rim[a] as f64);
        let lattice_from_place = rows.map(|row| row.map(|v| v as f32));
        let is_first_shifted = (receivers.volume.packing == Packing::BodyCentred).then_some(receivers.rim[2] % 2 == 1);
        Self { ranks: receivers.voxels.ranks(), is_first_shifted, lattice_from_place }
    }

    /// Which one of the needed voxels is that of a rank.
    pub(crate) fn voxel(&self, voxels: &Voxels, rank: usize) -> VoxelPlace {
        voxels.nth(&self.ranks, rank)
    }

    /// The needed voxels around places.
    #[inline(always)]
    pub(crate) fn cells<S: Simd>(&self, simd: S, voxels: &Voxels, places: &[Lanes<S>; 3], lane_bits: u32) -> Cells {
        if let Some(is_first_shifted) = self.is_first_shifted {
            return self.cells_between_shifted_planes(simd, voxels, places, lane_bits, is_first_shifted);
        }
        let zero = simd.lanes(0.0);
        let one = simd.lanes(1.0);
        let mut first = [[0.0; MAX_LANES]; 3];
        let mut parts = [[[0.0; MAX_LANES]; 2]; 4];
        let mut high = [zero; 3];
        for a in 0..3 {
            let [x, y, z, start] = self.lattice_from_place[a];
            let place = places[0].mul_add(
                simd.lanes(x),
                places[1].mul_add(simd.lanes(y), places[2].mul_add(simd.lanes(z), simd.lanes(start))),
            );
            // Half a step less, rounded: the voxel before, and for a place at a voxel that or the one before it.
            let last = simd.lanes(NATURAL + (voxels.dims()[a] - 2) as f32);
            let natural = ((place - simd.lanes(0.5)) + simd.lanes(NATURAL)).max(simd.lanes(NATURAL)).min(last);
            high[a] = (place - (natural - simd.lanes(NATURAL))).max(zero).min(one);
            natural.store(&mut first[a]);
        }
        let low = [one - high[0], one - high[1], one - high[2]];
        let rows = [low[1] * low[2], high[1] * low[2], low[1] * high[2], high[1] * high[2]];
        for row in 0..4 {
            (rows[row] * low[0]).store(&mut parts[row][0]);
            (rows[row] * high[0]).store(&mut parts[row][1]);
        }
        self.find(voxels, &first, &parts, lane_bits & ((1 << Lanes::<S>::COUNT) - 1))
    }

    /// Which the voxels are, lane by lane.
    #[inline(always)]
    fn find(
        &self,
        voxels: &Voxels,
        first: &[[f32; MAX_LANES]; 3],
        parts: &[[[f32; MAX_LANES]; 2]; 4],
        lane_bits: u32,
    ) -> Cells {
        let mut cells = Cells::none(lane_bits);
        for lane in lanes(lane_bits) {
            let [i, j, k] = [0, 1, 2].map(|a: usize| (first[a][lane].to_bits() - NATURAL.to_bits()) as usize);
            for row in 0..4 {
                let found = voxels.pair(&self.ranks, i, j + row % 2, k + row / 2);
                cells.set(lane, row, found, [parts[row][0][lane], parts[row][1][lane]]);
            }
        }
        cells
    }

    /// The needed voxels around places in a body-centred lattice: bilinear in the plane before and in the one behind, linear between
    /// them, lane by lane.
    #[inline(always)]
    fn cells_between_shifted_planes<S: Simd>(
        &self,
        simd: S,
        voxels: &Voxels,
        places: &[Lanes<S>; 3],
        lane_bits: u32,
        is_first_shifted: bool,
    ) -> Cells {
        let mut stored = [[0.0; MAX_LANES]; 3];
        let dims = voxels.dims();
        for (along, [x, y, z, start]) in stored.iter_mut().zip(self.lattice_from_place) {
            places[0]
                .mul_add(
                    simd.lanes(x),
                    places[1].mul_add(simd.lanes(y), places[2].mul_add(simd.lanes(z), simd.lanes(start))),
                )
                .store(along);
        }
        let cell = |place: f32, n: usize| {
            let low = (place.max(0.0) as usize).min(n - 2);
            (low, (place - low as f32).clamp(0.0, 1.0))
        };
        let mut cells = Cells::none(lane_bits & ((1 << Lanes::<S>::COUNT) - 1));
        for lane in lanes(cells.lane_bits) {
            let (k, w) = cell(stored[2][lane], dims[2]);
            for (k, depth) in [(k, 1.0 - w), (k + 1, w)] {
                let shift = if (k % 2 == 1) != is_first_shifted { 0.5 } else { 0.0 };
                let (i, u) = cell(stored[0][lane] - shift, dims[0]);
                let (j, v) = cell(stored[1][lane] - shift, dims[1]);
                for (row, (j, height)) in [(j, 1.0 - v), (j + 1, v)].into_iter().enumerate() {
                    let found = voxels.pair(&self.ranks, i, j, k);
                    let share = depth * height;
                    cells.set(lane, row + 2 * (k % 2), found, [share * (1.0 - u), share * u]);
                }
            }
        }
        cells
    }
}

impl Cells {
    fn none(lane_bits: u32) -> Self {
        Self { ranks: [[0; 4]; MAX_LANES], weights: [[[0.0; 2]; 4]; MAX_LANES], lane_bits }
    }

    /// Two neighbours of a row, and their weights.
    #[inline(always)]
    fn set(&mut self, lane: usize, row: usize, pair: VoxelPair, weights: [f32; 2]) {
        let [first, second] = weights;
        self.ranks[lane][row] = pair.rank;
        self.weights[lane][row] = match (pair.has_first, pair.has_second) {
            (true, true) => [first, second],
            // The second one has the rank of the one that is missing.
            (false, true) => [second, 0.0],
            (true, false) => [first, 0.0],
            (false, false) => [0.0; 2],
        };
    }
}

/// The set bits.
#[inline(always)]
pub(crate) fn lanes(mut lane_bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = lane_bits.trailing_zeros() as usize;
        (lane_bits != 0).then(|| {
            lane_bits &= lane_bits - 1;
            lane
        })
    })
}
