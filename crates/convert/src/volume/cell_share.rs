//! How much of a lattice's cell lies within regions: the volume of a cube below planes, in closed form.

use splat_core::Clip;
use splat_core::glam::{DMat3, DVec3};

/// Components of a plane's normal below this part of the largest do not tilt it.
const FLAT: f64 = 1e-6;

/// The regions that a lattice is cut to, in its own coordinates.
pub(crate) struct CellShares {
    /// Normals that lead out, and what their products with the border are.
    planes: Vec<(DVec3, f64)>,
}

impl CellShares {
    /// Of a lattice whose point 0 is `origin` and whose steps are the columns of `axes`.
    pub(crate) fn new(clips: &[Clip], origin: DVec3, axes: DMat3) -> Self {
        let of_lattice = |(normal, offset): (DVec3, f64)| (axes.transpose() * normal, offset - normal.dot(origin));
        Self { planes: clips.iter().flat_map(Clip::half_spaces).map(of_lattice).collect() }
    }

    /// Share of the cell around a lattice point that lies within, from 0 to 1: exact for one plane and for planes across each other.
    pub(crate) fn at(&self, index: DVec3) -> f64 {
        self.planes.iter().map(|(normal, offset)| below(*normal, offset - normal.dot(index))).product()
    }
}

/// Share of the unit cube about 0 in which normal·p ≤ distance.
///
/// Of the cube [0, 1]ⁿ and a normal a > 0 it is Σ over subsets S of the axes of (−1)^|S|·max(t − Σ a of S, 0)ⁿ/(n!·Π a).
fn below(normal: DVec3, distance: f64) -> f64 {
    let components = normal.abs().to_array();
    let half = 0.5 * (components[0] + components[1] + components[2]);
    if distance >= half || distance <= -half {
        return if distance > 0.0 { 1.0 } else { 0.0 };
    }
    let largest = components.into_iter().fold(0.0, f64::max);
    let mut a = [0.0; 3];
    let mut n = 0;
    for component in components.into_iter().filter(|c| *c > FLAT * largest) {
        a[n] = component / largest;
        n += 1;
    }
    let a = &a[..n];
    let t = distance / largest + 0.5 * a.iter().sum::<f64>();
    let term = |subset: usize| {
        let corner = a.iter().enumerate().filter(|(i, _)| subset >> i & 1 == 1).map(|(_, a)| a).sum::<f64>();
        let sign = if subset.count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * (t - corner).max(0.0).powi(n as i32)
    };
    let sum: f64 = (0..1 << n).map(term).sum();
    let factorial = [1.0, 1.0, 2.0, 6.0][n];
    (sum / (factorial * a.iter().product::<f64>())).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Grid;

    #[test]
    fn shares_of_a_cube_are_those_of_closed_forms() {
        assert_eq!(below(DVec3::X * 3.0, 0.75), 0.75);
        assert_eq!(below(-DVec3::Z, -0.25), 0.25);
        assert_eq!([below(DVec3::ONE, -1.5), below(DVec3::ONE, 1.5)], [0.0, 1.0]);
        assert_eq!(below(DVec3::ONE, 0.0), 0.5);
        // The corner that a plane through three neighbours cuts off, and half of a prism.
        assert!((below(DVec3::ONE, -0.5) - 1.0 / 6.0).abs() < 1e-15);
        assert!((below(DVec3::new(1.0, 1.0, 1e-12), -0.5) - 0.125).abs() < 1e-15);
    }

    #[test]
    fn shares_agree_with_counting() {
        let n = 64;
        let place = |i: usize| (i as f64 + 0.5) / f64::from(n) - 0.5;
        for (normal, distance) in [(DVec3::new(0.3, -0.9, 0.2), 0.1), (DVec3::new(-2.0, 1.0, 0.5), -0.9)] {
            let side = n as usize;
            let inside = (0..side.pow(3)).filter(|i| {
                normal.dot(DVec3::new(place(i % side), place(i / side % side), place(i / side / side))) <= distance
            });
            let counted = inside.count() as f64 / f64::from(n).powi(3);
            assert!((below(normal, distance) - counted).abs() < 1e-3, "{normal}: {counted}");
        }
    }

    #[test]
    fn a_lattice_of_any_axes_is_cut_where_its_places_are() {
        let axes = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.0, 2.0, 0.0), DVec3::new(0.3, 0.0, 1.0));
        let grid = Grid { origin: DVec3::new(1e6, 0.0, 0.0), axes, dims: [4; 3], values: vec![0.0; 64] };
        let middle = grid.position(2, 1, 3);
        let shares = CellShares::new(&[Clip::HalfSpace { normal: DVec3::Y, offset: middle.y }], grid.origin, axes);
        assert!((shares.at(DVec3::new(2.0, 1.0, 3.0)) - 0.5).abs() < 1e-9);
        assert_eq!([shares.at(DVec3::new(2.0, 0.0, 3.0)), shares.at(DVec3::new(2.0, 3.0, 3.0))], [1.0, 0.0]);
    }
}
