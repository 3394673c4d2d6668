//! Light that arrives in a volume through the shadows of a light, looked up once for each voxel that is needed.
//!
//! A sheet asks for light in every pixel of every slab, many times a voxel, and a look-up in a shadow map takes far longer
//! than all else of a pixel. Shadows of translucent things are no sharper than the splats that cast them, so what lies between
//! voxels is interpolated trilinearly, as the values are that it lights.

use super::error::cancelled;
use super::lattice::neighbours::{Cells, Neighbours, Receivers, lanes};
use crate::Error;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::LitBy;
use splat_core::{Progress, Receiver, SplatKind, Transmittance};

/// Rows of voxels that are looked up together.
const ROWS: usize = 64;

/// Transmittances of one volume's needed voxels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shadows {
    /// By light, two more at the end; `None` for one without shadows.
    of_lights: Vec<Option<Vec<Share>>>,
    pub(crate) neighbours: Neighbours,
}

/// A transmittance per channel, as parts of [`WHOLE`], then [`WHOLE`], whose mean is the weight of all that is known.
type Share = [u16; 4];

/// One as a share.
const WHOLE: u16 = u16::MAX;

impl Shadows {
    /// Bytes of those of so many voxels.
    pub(crate) fn bytes(voxels: u64, lights: &[LitBy<'_>]) -> u64 {
        let shadows = lights.iter().filter(|lit| lit.shadow.is_some()).count() as u64;
        if shadows == 0 { 0 } else { shadows * 8 * voxels + Neighbours::bytes(voxels) }
    }

    /// Looks them up; `None` where no light has shadows, or the volume takes none.
    pub(crate) fn new(
        receivers: &Receivers<'_>,
        lights: &[LitBy<'_>],
        origin: DVec3,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        if lights.iter().all(|lit| lit.shadow.is_none()) || receivers.volume.shadow_coefficient == 0.0 {
            return Ok(None);
        }
        let looked_up =
            |lit: &LitBy<'_>| lit.shadow.map(|shadow| look_up(receivers, shadow, origin, progress)).transpose();
        let of_lights = lights.iter().map(looked_up).collect::<Result<_, _>>()?;
        Ok(Some(Self { of_lights, neighbours: Neighbours::new(receivers) }))
    }

    /// What arrives of a light there; all of one without shadows, and where no voxel is known.
    #[inline(always)]
    pub(crate) fn transmittance<S: Simd>(&self, simd: S, cells: &Cells, light: usize) -> [Lanes<S>; 3] {
        let zero = simd.lanes(0.0);
        let one = simd.lanes(1.0);
        let Some(shares) = self.of_lights[light].as_deref() else {
            return [one; 3];
        };
        let mut sums = [[0.0; MAX_LANES]; 4];
        for lane in lanes(cells.lane_bits) {
            let sum = mean(shares, &cells.ranks[lane], &cells.weights[lane]);
            for c in 0..4 {
                sums[c][lane] = sum[c];
            }
        }
        let whole = Lanes::load(simd, &sums[3]);
        let inverse = one / whole.max(simd.lanes(f32::MIN_POSITIVE));
        let through = [Lanes::load(simd, &sums[0]), Lanes::load(simd, &sums[1]), Lanes::load(simd, &sums[2])];
        [
            (through[0] * inverse).where_less_or(zero, whole, one),
            (through[1] * inverse).where_less_or(zero, whole, one),
            (through[2] * inverse).where_less_or(zero, whole, one),
        ]
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

fn look_up(
    receivers: &Receivers<'_>,
    shadow: &dyn Transmittance,
    origin: DVec3,
    progress: &Progress,
) -> Result<Vec<Share>, Error> {
    let [nx, ny, nz] = receivers.voxels.dims();
    let start = receivers.volume.origin() - origin;
    let axes = receivers.volume.axes();
    let rim = receivers.rim.map(|n| n as f64);
    let shifts = [0, 1].map(|k| receivers.volume.packing.shift(k + receivers.rim[2] % 2));
    let share = |i: usize, row: usize| {
        let shift = shifts[row / ny % 2];
        let index = DVec3::new(i as f64 + shift, (row % ny) as f64 + shift, (row / ny) as f64);
        let position = (start + axes * (index - DVec3::from_array(rim))).as_vec3();
        let receiver =
            Receiver { position, normal: Default::default(), radius: receivers.radius, kind: SplatKind::Medium };
        let [red, green, blue] =
            shadow.transmittance(&receiver).map(|t| (t.clamp(0.0, 1.0) * f32::from(WHOLE) + 0.5) as u16);
        [red, green, blue, WHOLE]
    };
    let rows: Vec<usize> = (0..ny * nz).collect();
    let of_rows = |rows: &[usize]| {
        progress.tick(0).map_err(cancelled)?;
        let needed = |row: usize| (0..nx).filter(move |i| receivers.voxels.has(*i, row % ny, row / ny));
        Ok(rows.iter().flat_map(|row| needed(*row).map(|i| share(i, *row))).collect::<Vec<Share>>())
    };
    let parts = rows.par_chunks(ROWS).map(of_rows).collect::<Result<Vec<_>, Error>>()?;
    let mut shares = parts.concat();
    // Voxels are read by two, and one that is missing has the rank of the next.
    shares.extend([[0; 4]; 2]);
    Ok(shares)
}
