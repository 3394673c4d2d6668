//! A gradient volume: central differences of the values at the voxels that are needed, interpolated trilinearly where light is asked for.
//!
//! The paper names it beside differences of neighbouring sheets (section 4.2), and takes those. Linear fields have their gradient everywhere,
//! quadratic ones wherever no difference reaches beyond a face.

use super::lattice::Lattice;
use super::lattice::neighbours::{Neighbours, Receivers, lanes};
use super::params::Gradients;
use super::voxels::Voxels;
use crate::{Params, Volume};
use rayon::prelude::*;
use splat_core::Packing;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// The gradients of one volume's needed voxels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GradientVolume {
    /// Per step along each axis of the lattice; two more at the end.
    gradients: Vec<[f32; 3]>,
    neighbours: Neighbours,
    /// What a gradient of 1 a step along each axis is in the space of places, the longest of length 1: so no scale of the scene makes anything vanish.
    directions: [[f32; 3]; 3],
}

impl GradientVolume {
    /// Bytes of that of so many voxels.
    pub(crate) fn bytes(voxels: u64, volume: &Volume<'_>, params: &Params) -> u64 {
        if is_wanted(volume, params) { 12 * voxels + Neighbours::bytes(voxels) } else { 0 }
    }

    /// That of a volume, if normals come from one.
    pub(crate) fn new(receivers: &Receivers<'_>, lattice: &Lattice<'_>, params: &Params) -> Option<Self> {
        is_wanted(receivers.volume, params).then(|| {
            let [nx, ny, nz] = lattice.dims;
            let row = |row: usize| {
                let [j, k] = [row % ny, row / ny];
                let needed = (0..nx).filter(move |i| receivers.voxels.has(*i, j, k));
                needed.map(|i| differences(lattice, [i, j, k]).map(|d| d as f32)).collect::<Vec<_>>()
            };
            let mut gradients = (0..ny * nz).into_par_iter().map(row).collect::<Vec<_>>().concat();
            // Voxels are read by two, and one that is missing has the rank of the next.
            gradients.extend([[0.0; 3]; 2]);
            Self { gradients, neighbours: Neighbours::new(receivers), directions: directions(&receivers.rows) }
        })
    }

    /// ∇v at places of the lanes `lane_bits`, in their space, of any length.
    #[inline(always)]
    pub(crate) fn gradients<S: Simd>(
        &self,
        simd: S,
        voxels: &Voxels,
        places: &[Lanes<S>; 3],
        lane_bits: u32,
    ) -> [Lanes<S>; 3] {
        let cells = self.neighbours.cells(simd, voxels, places, lane_bits);
        let mut sums = [[0.0; MAX_LANES]; 3];
        for lane in lanes(cells.lane_bits) {
            for (first, weights) in cells.ranks[lane].iter().zip(&cells.weights[lane]) {
                for (gradient, weight) in self.gradients[*first..*first + 2].iter().zip(weights) {
                    for a in 0..3 {
                        sums[a][lane] += weight * gradient[a];
                    }
                }
            }
        }
        let mut out = [simd.lanes(0.0); 3];
        for a in 0..3 {
            let along = Lanes::load(simd, &sums[a]);
            for c in 0..3 {
                out[c] = along.mul_add(simd.lanes(self.directions[a][c]), out[c]);
            }
        }
        out
    }
}

/// By axis of a lattice: the direction of a gradient along it, in the space of places, which `rows` lead to the lattice. The longest has length 1.
pub(crate) fn directions(rows: &[[f64; 4]; 3]) -> [[f32; 3]; 3] {
    let rows = rows.map(|[x, y, z, _]| DVec3::new(x, y, z));
    let longest = rows.iter().map(|row| row.length()).fold(0.0, f64::max);
    rows.map(|row| (row / longest).as_vec3().to_array())
}

fn is_wanted(volume: &Volume<'_>, params: &Params) -> bool {
    volume.normals && params.gradients == Gradients::Volume
}

/// Central differences at a lattice point, per step along each axis, one-sided at the ends of the rim. Across the planes of a body-centred lattice
/// those of the planes that lie alike.
pub(crate) fn differences(lattice: &Lattice<'_>, index: [usize; 3]) -> [f64; 3] {
    let value = |[i, j, k]: [usize; 3]| f64::from(lattice.value(i, j, k));
    [0, 1, 2].map(|a| {
        let step = if a == 2 && lattice.packing == Packing::BodyCentred { 2 } else { 1 };
        let mut before = index;
        let mut after = index;
        before[a] = if index[a] >= step { index[a] - step } else { index[a] };
        after[a] = if index[a] + step < lattice.dims[a] { index[a] + step } else { index[a] };
        (value(after) - value(before)) / (after[a] - before[a]).max(1) as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::lattice::near::Near;
    use crate::shared::voxels::without_extinction;
    use splat_core::glam::{DMat3, DQuat};
    use splat_core::raster::pulp;
    use splat_core::{Grid, Material, Similarity, TransferFunction, TransferPoint, rng};

    /// Greatest error of gradients over the largest of them, at places around the middle up to `reach` of the lattice's half sides.
    fn worst(packing: Packing, axes: DMat3, reach: f64, field: impl Fn(DVec3) -> (f64, DVec3)) -> f64 {
        let dims = [9, 8, 14];
        let mut grid = Grid { origin: DVec3::ZERO, axes, dims, values: Vec::new() };
        let middle = DVec3::from_array(dims.map(|n| 0.5 * (n as f64 - 1.0)));
        for n in 0..dims.iter().product() {
            let [i, j, k] = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
            let shift = packing.shift(k);
            let place = DVec3::new(i as f64 + shift, j as f64 + shift, k as f64);
            grid.values.push(field(axes * (place - middle)).0 as f32);
        }
        let points = vec![TransferPoint { value: 0.0, color: [1.0; 3], extinction: 1.0 }];
        let transfer = TransferFunction::new(points).unwrap();
        let material = Material::default();
        let volume = Volume {
            grid: &grid,
            packing,
            transform: Similarity::default(),
            transfer: &transfer,
            extinction_scale: 1.0,
            material: &material,
            normals: true,
            clip: &[],
            object: 0,
            shadow_coefficient: 1.0,
            casts_shadow: true,
        };
        let lattice = Lattice::new(&grid, packing, [3, 3, 6]);
        let voxels = Voxels::needed(&lattice, &without_extinction(&transfer), &Near::block([2; 3]));
        // Places are those of the field.
        let inverse = axes.inverse();
        let rows = [0, 1, 2].map(|a| [inverse.row(a).x, inverse.row(a).y, inverse.row(a).z, middle[a]]);
        let receivers = Receivers { volume: &volume, voxels: &voxels, rim: lattice.rim, radius: 1.0, rows };
        let params = Params { gradients: Gradients::Volume, ..Params::default() };
        let gradients = GradientVolume::new(&receivers, &lattice, &params).unwrap();
        let longest = [0, 1, 2].map(|a| inverse.row(a).length()).into_iter().fold(0.0, f64::max);
        let mut worst = 0.0f64;
        let mut most = 0.0f64;
        for n in 0..2000 {
            let side = |a: u64| reach * (2.0 * rng::unit(5, a, n, 0) - 1.0) * middle[a as usize];
            let place = axes * DVec3::new(side(0), side(1), side(2));
            let places = [place.x, place.y, place.z].map(|v| pulp::Scalar.lanes(v as f32));
            let found = gradients.gradients(pulp::Scalar, &voxels, &places, 1).map(|lanes| {
                let mut out = [0.0; MAX_LANES];
                lanes.store(&mut out);
                f64::from(out[0]) * longest
            });
            let expected = field(place).1;
            worst = worst.max((DVec3::from_array(found) - expected).length());
            most = most.max(expected.length());
        }
        worst / most
    }

    #[test]
    fn linear_and_quadratic_fields_have_their_gradients() {
        let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.5).normalize(), 0.7));
        let sheared = turn * DMat3::from_cols_array(&[0.5, 0.1, 0.0, 0.2, 0.6, -0.1, -0.1, 0.1, -0.7]);
        let slope = DVec3::new(2.0, -1.0, 0.5);
        let bent = DMat3::from_cols_array(&[2.0, 0.5, -1.0, 0.5, -1.0, 0.25, -1.0, 0.25, 3.0]);
        for packing in [Packing::Cartesian, Packing::BodyCentred] {
            for axes in [DMat3::from_diagonal(DVec3::splat(0.25)), sheared] {
                let linear = worst(packing, axes, 1.1, |p| (7.0 + slope.dot(p), slope));
                let square = |p: DVec3| (slope.dot(p) + 0.5 * p.dot(bent * p), slope + bent * p);
                // Differences reach one step, and across shifted planes two, beyond the cell.
                let quadratic = worst(packing, axes, 0.5, square);
                assert!(linear < 1e-5 && quadratic < 1e-5, "{packing:?}: {linear:e}, {quadratic:e}");
                // At a face the second difference is missing.
                assert!(worst(packing, axes, 1.0, square) > 1e-2, "{packing:?}");
            }
        }
    }
}
