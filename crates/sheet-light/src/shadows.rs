//! Light that arrives in a volume through the shadows of a light, looked up once for each voxel that is needed.
//!
//! A sheet asks for light in every pixel of every slab, many times a voxel, and a look-up in a shadow map takes far longer
//! than all else of a pixel. Shadows of translucent things are no sharper than the splats that cast them, so what lies between
//! voxels is interpolated trilinearly, as the values are that it lights.

use crate::Error;
use crate::error::cancelled;
use crate::fold::Prepared;
use crate::visible::Voxels;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;
use splat_core::{Progress, Receiver, SplatKind, Transmittance};

/// Rows of voxels that are looked up together.
const ROWS: usize = 64;

/// Transmittances of one volume's needed voxels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shadows {
    /// By light; `None` for one without shadows.
    of_lights: Vec<Option<Vec<Share>>>,
    /// Needed voxels before each word of 64.
    ranks: Vec<u64>,
}

/// A transmittance per channel, as parts of 65535.
type Share = [u16; 3];

/// One as a share.
const WHOLE: f32 = 65535.0;

impl Shadows {
    /// Bytes of those of so many voxels.
    pub(crate) fn bytes(voxels: u64, lights: &[LitBy<'_>]) -> u64 {
        let shadows = lights.iter().filter(|lit| lit.shadow.is_some()).count() as u64;
        if shadows == 0 { 0 } else { shadows * 6 * voxels + voxels / 8 }
    }

    /// Looks them up; `None` where no light has shadows, or the volume takes none.
    pub(crate) fn new(
        of: &Prepared<'_>,
        lights: &[LitBy<'_>],
        origin: DVec3,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        if lights.iter().all(|lit| lit.shadow.is_none()) || of.volume.shadow_coefficient == 0.0 {
            return Ok(None);
        }
        let one = |lit: &LitBy<'_>| lit.shadow.map(|shadow| look_up(of, shadow, origin, progress)).transpose();
        let of_lights = lights.iter().map(one).collect::<Result<_, _>>()?;
        Ok(Some(Self { of_lights, ranks: of.voxels.ranks() }))
    }

    /// The needed voxels around a place in lattice coordinates that count from the rim.
    #[inline]
    pub(crate) fn cell(&self, voxels: &Voxels, place: DVec3) -> Cell {
        let dims = voxels.dims();
        let mut first = [0; 3];
        let mut high = [0.0; 3];
        for a in 0..3 {
            first[a] = (place[a].max(0.0) as usize).min(dims[a].saturating_sub(2));
            high[a] = (place[a] - first[a] as f64).clamp(0.0, 1.0) as f32;
        }
        let mut cell = Cell { ranks: [0; 8], weights: [0.0; 8], is_known: false };
        let mut whole = 0.0;
        for corner in 0..8 {
            let steps = [corner & 1, corner >> 1 & 1, corner >> 2];
            let share = |a: usize| if steps[a] == 1 { high[a] } else { 1.0 - high[a] };
            let at = |a: usize| first[a] + steps[a];
            if let Some(rank) = voxels.rank(&self.ranks, at(0), at(1), at(2)) {
                cell.ranks[corner] = rank;
                cell.weights[corner] = share(0) * share(1) * share(2);
                whole += cell.weights[corner];
            }
        }
        if whole > 0.0 {
            cell.is_known = true;
            cell.weights.iter_mut().for_each(|w| *w /= WHOLE * whole);
        }
        cell
    }

    /// What arrives of a light there; `None` for a light without shadows.
    #[inline]
    pub(crate) fn at(&self, cell: &Cell, light: usize) -> Option<[f32; 3]> {
        let shares = self.of_lights[light].as_deref().filter(|_| cell.is_known)?;
        let mut sum = [0.0; 3];
        for (rank, weight) in cell.ranks.iter().zip(cell.weights) {
            if weight > 0.0 {
                (0..3).for_each(|c| sum[c] += weight * f32::from(shares[*rank][c]));
            }
        }
        Some(sum)
    }
}

/// Needed voxels around a place: which they are among all of them, and their shares over [`WHOLE`].
pub(crate) struct Cell {
    ranks: [usize; 8],
    weights: [f32; 8],
    /// Whether there are any.
    is_known: bool,
}

fn look_up(
    of: &Prepared<'_>,
    shadow: &dyn Transmittance,
    origin: DVec3,
    progress: &Progress,
) -> Result<Vec<Share>, Error> {
    let [nx, ny, nz] = of.voxels.dims();
    let (start, axes) = (of.volume.origin() - origin, of.volume.axes());
    let rim = of.lattice.rim.map(|n| n as f64);
    let share = |i: usize, row: usize| {
        let index = DVec3::new(i as f64, (row % ny) as f64, (row / ny) as f64) - DVec3::from_array(rim);
        let position = (start + axes * index).as_vec3();
        let receiver =
            Receiver { position, normal: Default::default(), radius: of.viewed.reach as f32, kind: SplatKind::Medium };
        shadow.transmittance(&receiver).map(|t| (t.clamp(0.0, 1.0) * WHOLE + 0.5) as u16)
    };
    let rows: Vec<usize> = (0..ny * nz).collect();
    let of_rows = |rows: &[usize]| {
        progress.tick(0).map_err(cancelled)?;
        let needed = |row: usize| (0..nx).filter(move |i| of.voxels.has(*i, row % ny, row / ny));
        Ok(rows.iter().flat_map(|row| needed(*row).map(|i| share(i, *row))).collect::<Vec<Share>>())
    };
    let parts = rows.par_chunks(ROWS).map(of_rows).collect::<Result<Vec<_>, Error>>()?;
    Ok(parts.concat())
}
