//! Light that arrives in a volume through the shadows of a light, looked up once for each voxel that is needed.
//!
//! A sheet asks for light in every pixel of every slab, many times a voxel, and a look-up in a shadow map takes far longer
//! than all else of a pixel. Shadows of translucent things are no sharper than the splats that cast them, so what lies between
//! voxels is interpolated trilinearly, as the values are that it lights.

use crate::Error;
use crate::Volume;
use crate::error::cancelled;
use crate::visible::Voxels;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::LitBy;
use splat_core::{Packing, Progress, Receiver, SplatKind, Transmittance};

/// Rows of voxels that are looked up together.
const ROWS: usize = 64;

/// Transmittances of one volume's needed voxels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shadows {
    /// By light, two more at the end; `None` for one without shadows.
    of_lights: Vec<Option<Vec<Share>>>,
    /// Needed voxels before each word of 64.
    ranks: Vec<u64>,
    /// Of a body-centred lattice: whether the first plane, that of the rim, is a shifted one.
    is_first_shifted: Option<bool>,
    /// From the places that are asked for to lattice coordinates that count from the rim.
    lattice_from_place: [[f32; 4]; 3],
}

/// What receives them.
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

/// A transmittance per channel, as parts of [`WHOLE`], then [`WHOLE`], whose mean is the weight of all that is known.
type Share = [u16; 4];

/// One as a share.
const WHOLE: u16 = u16::MAX;

/// 2²³, from which on floats are natural numbers.
const NATURAL: f32 = 8_388_608.0;

/// Needed voxels around places: by lane, row by row of two voxels, which they are among all of them, and their weights.
pub(crate) struct Cells {
    ranks: [[usize; 4]; MAX_LANES],
    weights: [[[f32; 2]; 4]; MAX_LANES],
    /// Lanes that are asked for, a bit each.
    wanted: u32,
}

impl Shadows {
    /// Bytes of those of so many voxels.
    pub(crate) fn bytes(voxels: u64, lights: &[LitBy<'_>]) -> u64 {
        let shadows = lights.iter().filter(|lit| lit.shadow.is_some()).count() as u64;
        if shadows == 0 { 0 } else { shadows * 8 * voxels + voxels / 8 }
    }

    /// Looks them up; `None` where no light has shadows, or the volume takes none.
    pub(crate) fn new(
        of: &Receivers<'_>,
        lights: &[LitBy<'_>],
        origin: DVec3,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        if lights.iter().all(|lit| lit.shadow.is_none()) || of.volume.shadow_coefficient == 0.0 {
            return Ok(None);
        }
        assert!(of.voxels.dims().iter().all(|n| *n >= 2), "invariant: a lattice has a rim");
        let one = |lit: &LitBy<'_>| lit.shadow.map(|shadow| look_up(of, shadow, origin, progress)).transpose();
        let of_lights = lights.iter().map(one).collect::<Result<_, _>>()?;
        let mut rows = of.rows;
        (0..3).for_each(|a| rows[a][3] += of.rim[a] as f64);
        let lattice_from_place = rows.map(|row| row.map(|v| v as f32));
        let is_first_shifted = (of.volume.packing == Packing::BodyCentred).then_some(of.rim[2] % 2 == 1);
        Ok(Some(Self { of_lights, ranks: of.voxels.ranks(), is_first_shifted, lattice_from_place }))
    }

    /// The needed voxels around places.
    #[inline(always)]
    pub(crate) fn cells<S: Simd>(&self, simd: S, voxels: &Voxels, at: &[Lanes<S>; 3], wanted: u32) -> Cells {
        if let Some(is_first_shifted) = self.is_first_shifted {
            return self.cells_between_shifted_planes(simd, voxels, at, (wanted, is_first_shifted));
        }
        let of = |v: f32| Lanes::splat(simd, v);
        let (zero, one) = (of(0.0), of(1.0));
        let (mut first, mut parts) = ([[0.0; MAX_LANES]; 3], [[[0.0; MAX_LANES]; 2]; 4]);
        let mut high = [zero; 3];
        for a in 0..3 {
            let [x, y, z, start] = self.lattice_from_place[a];
            let place = at[0].mul_add(of(x), at[1].mul_add(of(y), at[2].mul_add(of(z), of(start))));
            // Half a step less, rounded: the voxel before, and for a place at a voxel that or the one before it.
            let last = of(NATURAL + (voxels.dims()[a] - 2) as f32);
            let natural = ((place - of(0.5)) + of(NATURAL)).max(of(NATURAL)).min(last);
            high[a] = (place - (natural - of(NATURAL))).max(zero).min(one);
            natural.store(&mut first[a]);
        }
        let low = [one - high[0], one - high[1], one - high[2]];
        let rows = [low[1] * low[2], high[1] * low[2], low[1] * high[2], high[1] * high[2]];
        for row in 0..4 {
            (rows[row] * low[0]).store(&mut parts[row][0]);
            (rows[row] * high[0]).store(&mut parts[row][1]);
        }
        self.find(voxels, &first, &parts, wanted & ((1 << Lanes::<S>::COUNT) - 1))
    }

    /// Which the voxels are, lane by lane.
    #[inline(always)]
    fn find(
        &self,
        voxels: &Voxels,
        first: &[[f32; MAX_LANES]; 3],
        parts: &[[[f32; MAX_LANES]; 2]; 4],
        wanted: u32,
    ) -> Cells {
        let mut cells = Cells::none(wanted);
        for lane in lanes(wanted) {
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
        at: &[Lanes<S>; 3],
        (wanted, is_first_shifted): (u32, bool),
    ) -> Cells {
        let (mut places, dims) = ([[0.0; MAX_LANES]; 3], voxels.dims());
        for (place, [x, y, z, start]) in places.iter_mut().zip(self.lattice_from_place) {
            let of = |v: f32| Lanes::splat(simd, v);
            at[0].mul_add(of(x), at[1].mul_add(of(y), at[2].mul_add(of(z), of(start)))).store(place);
        }
        let cell = |place: f32, n: usize| {
            let low = (place.max(0.0) as usize).min(n - 2);
            (low, (place - low as f32).clamp(0.0, 1.0))
        };
        let mut cells = Cells::none(wanted & ((1 << Lanes::<S>::COUNT) - 1));
        for lane in lanes(cells.wanted) {
            let (k, w) = cell(places[2][lane], dims[2]);
            for (k, depth) in [(k, 1.0 - w), (k + 1, w)] {
                let shift = if (k % 2 == 1) != is_first_shifted { 0.5 } else { 0.0 };
                let ((i, u), (j, v)) = (cell(places[0][lane] - shift, dims[0]), cell(places[1][lane] - shift, dims[1]));
                for (row, (j, height)) in [(j, 1.0 - v), (j + 1, v)].into_iter().enumerate() {
                    let (found, share) = (voxels.pair(&self.ranks, i, j, k), depth * height);
                    cells.set(lane, row + 2 * (k % 2), found, [share * (1.0 - u), share * u]);
                }
            }
        }
        cells
    }

    /// What arrives of a light there; all of one without shadows, and where no voxel is known.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, cells: &Cells, light: usize) -> [Lanes<S>; 3] {
        let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let Some(shares) = self.of_lights[light].as_deref() else { return [one; 3] };
        let mut sums = [[0.0; MAX_LANES]; 4];
        for lane in lanes(cells.wanted) {
            let sum = mean(shares, &cells.ranks[lane], &cells.weights[lane]);
            for c in 0..4 {
                sums[c][lane] = sum[c];
            }
        }
        let whole = Lanes::load(simd, &sums[3]);
        let inverse = one / whole.max(Lanes::splat(simd, f32::MIN_POSITIVE));
        let through = [Lanes::load(simd, &sums[0]), Lanes::load(simd, &sums[1]), Lanes::load(simd, &sums[2])];
        [
            (through[0] * inverse).where_less_or(zero, whole, one),
            (through[1] * inverse).where_less_or(zero, whole, one),
            (through[2] * inverse).where_less_or(zero, whole, one),
        ]
    }
}

impl Cells {
    fn none(wanted: u32) -> Self {
        Self { ranks: [[0; 4]; MAX_LANES], weights: [[[0.0; 2]; 4]; MAX_LANES], wanted }
    }

    /// Two neighbours of a row: the rank of the first, which of them are known, and their weights.
    #[inline(always)]
    fn set(&mut self, lane: usize, row: usize, (rank, known): (usize, u64), [here, next]: [f32; 2]) {
        self.ranks[lane][row] = rank;
        self.weights[lane][row] = match known {
            3 => [here, next],
            // The next one has the rank of the one that is missing.
            2 => [next, 0.0],
            1 => [here, 0.0],
            _ => [0.0; 2],
        };
    }
}

/// Weighted sums over the voxels of a cell: two neighbours lie beside each other.
#[inline(always)]
fn mean(shares: &[Share], ranks: &[usize; 4], weights: &[[f32; 2]; 4]) -> [f32; 4] {
    let mut sum = [0.0; 8];
    for row in 0..4 {
        let pair = shares[ranks[row]..ranks[row] + 2].as_flattened();
        for e in 0..8 {
            sum[e] += weights[row][e / 4] * f32::from(pair[e]);
        }
    }
    [sum[0] + sum[4], sum[1] + sum[5], sum[2] + sum[6], sum[3] + sum[7]]
}

/// The set bits.
#[inline(always)]
fn lanes(mut wanted: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = wanted.trailing_zeros() as usize;
        (wanted != 0).then(|| {
            wanted &= wanted - 1;
            lane
        })
    })
}

fn look_up(
    of: &Receivers<'_>,
    shadow: &dyn Transmittance,
    origin: DVec3,
    progress: &Progress,
) -> Result<Vec<Share>, Error> {
    let [nx, ny, nz] = of.voxels.dims();
    let (start, axes) = (of.volume.origin() - origin, of.volume.axes());
    let rim = of.rim.map(|n| n as f64);
    let shifts = [0, 1].map(|k| of.volume.packing.shift(k + of.rim[2] % 2));
    let share = |i: usize, row: usize| {
        let shift = shifts[row / ny % 2];
        let index = DVec3::new(i as f64 + shift, (row % ny) as f64 + shift, (row / ny) as f64);
        let position = (start + axes * (index - DVec3::from_array(rim))).as_vec3();
        let receiver = Receiver { position, normal: Default::default(), radius: of.radius, kind: SplatKind::Medium };
        let [red, green, blue] =
            shadow.transmittance(&receiver).map(|t| (t.clamp(0.0, 1.0) * f32::from(WHOLE) + 0.5) as u16);
        [red, green, blue, WHOLE]
    };
    let rows: Vec<usize> = (0..ny * nz).collect();
    let of_rows = |rows: &[usize]| {
        progress.tick(0).map_err(cancelled)?;
        let needed = |row: usize| (0..nx).filter(move |i| of.voxels.has(*i, row % ny, row / ny));
        Ok(rows.iter().flat_map(|row| needed(*row).map(|i| share(i, *row))).collect::<Vec<Share>>())
    };
    let parts = rows.par_chunks(ROWS).map(of_rows).collect::<Result<Vec<_>, Error>>()?;
    let mut shares = parts.concat();
    // Voxels are read by two, and one that is missing has the rank of the next.
    shares.extend([[0; 4]; 2]);
    Ok(shares)
}
