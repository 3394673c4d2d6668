//! Light that arrives in a volume through the shadows of a light, looked up once for each voxel that is needed.
//!
//! A sheet asks for light in every pixel of every slab, often a hundred times a voxel, and a look-up in a shadow map takes far longer
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

    /// What arrives of a light at a place in lattice coordinates that count from the rim; `None` for a light without shadows.
    pub(crate) fn at(&self, voxels: &Voxels, light: usize, place: DVec3) -> Option<[f32; 3]> {
        let shares = self.of_lights[light].as_deref()?;
        let [nx, ny, nz] = voxels.dims();
        let cell = |v: f64, n: usize| {
            let first = (v.max(0.0) as usize).min(n.saturating_sub(2));
            (first, (v - first as f64).clamp(0.0, 1.0) as f32)
        };
        let [(i, x), (j, y), (k, z)] = [cell(place.x, nx), cell(place.y, ny), cell(place.z, nz)];
        let (mut sum, mut whole) = ([0.0; 3], 0.0);
        for corner in 0..8 {
            let [a, b, c] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight = |high: usize, t: f32| if high == 1 { t } else { 1.0 - t };
            let weight = weight(a, x) * weight(b, y) * weight(c, z);
            if weight == 0.0 {
                continue;
            }
            if let Some(rank) = voxels.rank(&self.ranks, i + a, j + b, k + c) {
                (0..3).for_each(|c| sum[c] += weight * f32::from(shares[rank][c]));
                whole += weight;
            }
        }
        Some(if whole > 0.0 { sum.map(|s| s / (WHOLE * whole)) } else { [1.0; 3] })
    }
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
