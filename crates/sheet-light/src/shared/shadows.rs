//! Light that arrives in a volume through the shadows of a light, looked up once for each voxel beside which it is asked for.
//!
//! A sheet asks for light in every pixel of every slab, many times a voxel, and a look-up in a shadow map takes far longer
//! than all else of a pixel. Shadows of translucent things are no sharper than the splats that cast them, so what lies between
//! voxels is interpolated trilinearly, as the values are that it lights. Of a nearly opaque volume few voxels are ever asked for.

use super::lattice::neighbours::{Cells, Neighbours, Receivers, VoxelReceivers, lanes};
use super::voxels::Voxels;
use splat_core::Transmittance;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::LitBy;
use std::sync::atomic::{AtomicU64, Ordering};

/// Transmittances of one volume's needed voxels.
pub(crate) struct Shadows<'a> {
    /// By light; `None` for one without shadows.
    of_lights: Vec<Option<ShadowOfLight<'a>>>,
    voxels: VoxelReceivers,
    pub(crate) neighbours: Neighbours,
}

/// What a light's shadow lets through to voxels.
struct ShadowOfLight<'a> {
    shadow: &'a dyn Transmittance,
    /// By rank among the needed voxels, two more at the end: voxels are read by two, and one that is missing has the rank of the next.
    /// Each has 16 bits a channel, as parts of [`WHOLE`], then [`WHOLE`], whose mean is the weight of all that is known; or it is 0, where nobody
    /// has asked yet. Whoever is first writes what any other would, so no order matters.
    shares: Vec<AtomicU64>,
}

/// A transmittance of one.
const WHOLE: u16 = u16::MAX;

impl<'a> Shadows<'a> {
    /// Bytes of those of so many voxels.
    pub(crate) fn bytes(voxels: u64, lights: &[LitBy<'_>]) -> u64 {
        let shadows = lights.iter().filter(|lit| lit.shadow.is_some()).count() as u64;
        if shadows == 0 { 0 } else { shadows * 8 * voxels + Neighbours::bytes(voxels) }
    }

    /// Those of some lights, relative to `origin`; `None` where no light has shadows, or the volume takes none.
    pub(crate) fn new(receivers: &Receivers<'_>, lights: &[LitBy<'a>], origin: DVec3) -> Option<Self> {
        if lights.iter().all(|lit| lit.shadow.is_none()) || receivers.volume.shadow_coefficient == 0.0 {
            return None;
        }
        let count = receivers.voxels.count() as usize + 2;
        let unasked = || (0..count).map(|_| AtomicU64::new(0)).collect();
        let of_light = |shadow| ShadowOfLight { shadow, shares: unasked() };
        let of_lights = lights.iter().map(|lit| lit.shadow.map(of_light)).collect();
        let neighbours = Neighbours::new(receivers);
        Some(Self { of_lights, voxels: VoxelReceivers::new(receivers, origin), neighbours })
    }

    /// What arrives of a light in cells of `voxels`; all of one without shadows, and where no voxel is known.
    #[inline(always)]
    pub(crate) fn transmittance<S: Simd>(
        &self,
        simd: S,
        voxels: &Voxels,
        cells: &Cells,
        light: usize,
    ) -> [Lanes<S>; 3] {
        let zero = simd.lanes(0.0);
        let one = simd.lanes(1.0);
        let Some(shadow) = &self.of_lights[light] else {
            return [one; 3];
        };
        let mut sums = [[0.0; MAX_LANES]; 4];
        for lane in lanes(cells.lane_bits) {
            let sum = self.mean(shadow, voxels, &cells.ranks[lane], &cells.weights[lane]);
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

    /// Weighted sums over the voxels of a cell: two neighbours lie beside each other.
    #[inline(always)]
    fn mean(
        &self,
        shadow: &ShadowOfLight<'_>,
        voxels: &Voxels,
        ranks: &[usize; 4],
        weights: &[[f32; 2]; 4],
    ) -> [f32; 4] {
        let mut known = [[0; 2]; 4];
        let mut is_all = true;
        for row in 0..4 {
            for e in 0..2 {
                known[row][e] = shadow.shares[ranks[row] + e].load(Ordering::Relaxed);
                is_all &= known[row][e] != 0 || weights[row][e] == 0.0;
            }
        }
        if !is_all {
            self.look_up(shadow, voxels, ranks, weights, &mut known);
        }
        let mut sum = [[0.0; 4]; 2];
        for row in 0..4 {
            for e in 0..2 {
                for c in 0..4 {
                    sum[e][c] += weights[row][e] * f32::from((known[row][e] >> (16 * c)) as u16);
                }
            }
        }
        [sum[0][0] + sum[1][0], sum[0][1] + sum[1][1], sum[0][2] + sum[1][2], sum[0][3] + sum[1][3]]
    }

    /// Looks up those of a cell that count and are not known.
    #[cold]
    #[inline(never)]
    fn look_up(
        &self,
        shadow: &ShadowOfLight<'_>,
        voxels: &Voxels,
        ranks: &[usize; 4],
        weights: &[[f32; 2]; 4],
        known: &mut [[u64; 2]; 4],
    ) {
        for row in 0..4 {
            for e in 0..2 {
                let share = &mut known[row][e];
                if *share != 0 || weights[row][e] == 0.0 {
                    continue;
                }
                let rank = ranks[row] + e;
                let place = self.voxels.place(self.neighbours.voxel(voxels, rank));
                let through = shadow.shadow.transmittance(&self.voxels.receiver(place));
                for (c, through) in through.into_iter().enumerate() {
                    *share |= u64::from((through.clamp(0.0, 1.0) * f32::from(WHOLE) + 0.5) as u16) << (16 * c);
                }
                *share |= u64::from(WHOLE) << 48;
                shadow.shares[rank].store(*share, Ordering::Relaxed);
            }
        }
    }
}
