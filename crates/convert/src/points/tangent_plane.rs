//! The tangent planes of eight points at once, from their neighbours.
//!
//! The normal is the eigenvector of the smallest eigenvalue of the neighbours' covariance (Hoppe et al. 1992): the least root of
//! its characteristic polynomial by Newton's method, which from 0 climbs to it without passing it, then the longest column of
//! the adjugate of what is left.

use crate::common::extremes::greater;
use crate::points::neighbours::{Lanes, WIDTH};
use splat_core::glam::DVec3;

/// Eight numbers, one a point.
pub(crate) type Eight = [f64; WIDTH];

/// One neighbour of each of eight points, relative to it, by coordinate.
pub(crate) type Offset = [Lanes; 3];

/// Product of the smallest eigenvalue's distances from the others, the largest entry being 1, up to which the points lie on a
/// line: every vector across it would do.
const LINE: f64 = 1e-6;

/// Least eigenvalue over the trace from which on points lie on no surface: 1/3 where they lie alike in all directions, some 0.02 on a plane and
/// some 0.2 among ten neighbours of a filled space.
const SCATTERED: f64 = 0.08;

/// Most steps of Newton's method; about five are usual.
const STEPS: usize = 24;

/// Symmetric matrices of eight points.
#[derive(Clone, Copy)]
struct Symmetric {
    /// Entries xx, yy, zz.
    diagonal: [Eight; 3],
    /// Entries yz, zx, xy.
    mixed: [Eight; 3],
}

/// A plane that fits a point and its neighbours best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fitted {
    /// Unit vector across it.
    pub(crate) normal: DVec3,
    /// Whether they lie about as far from it as along it.
    pub(crate) is_scattered: bool,
}

/// The planes of eight points and their neighbours, or `None` where these lie on a line or at one place.
#[inline(always)]
pub(crate) fn fit_planes(offsets: &[Offset]) -> [Option<Fitted>; WIDTH] {
    let mut matrix = Symmetric::covariances(offsets);
    matrix.scale_to_one();
    let smallest = matrix.smallest_eigenvalues();
    let [x, y, z] = matrix.diagonal;
    for diagonal in &mut matrix.diagonal {
        for i in 0..WIDTH {
            diagonal[i] -= smallest[i];
        }
    }
    let columns = matrix.longest_columns();
    let mut planes = [None; WIDTH];
    for i in 0..WIDTH {
        let column = DVec3::new(columns[0][i], columns[1][i], columns[2][i]);
        let length = column.length();
        let is_scattered = smallest[i] > SCATTERED * (x[i] + y[i] + z[i]);
        planes[i] = (length > LINE).then(|| Fitted { normal: column / length, is_scattered });
    }
    planes
}

impl Symmetric {
    /// Covariances, up to a factor, of the points at 0 and their neighbours.
    #[inline(always)]
    fn covariances(offsets: &[Offset]) -> Self {
        let share = 1.0 / (offsets.len() + 1) as f64;
        let mut mean = [[0.0; WIDTH]; 3];
        for offset in offsets {
            for a in 0..3 {
                for i in 0..WIDTH {
                    mean[a][i] += share * f64::from(offset[a][i]);
                }
            }
        }
        let mut sum = Self { diagonal: [[0.0; WIDTH]; 3], mixed: [[0.0; WIDTH]; 3] };
        sum.add(&[[0.0; WIDTH]; 3], &mean);
        for offset in offsets {
            sum.add(offset, &mean);
        }
        sum
    }

    #[inline(always)]
    fn add(&mut self, offset: &Offset, mean: &[Eight; 3]) {
        let Self { diagonal: [xx, yy, zz], mixed: [yz, zx, xy] } = self;
        for i in 0..WIDTH {
            let x = f64::from(offset[0][i]) - mean[0][i];
            let y = f64::from(offset[1][i]) - mean[1][i];
            let z = f64::from(offset[2][i]) - mean[2][i];
            (xx[i], yy[i], zz[i]) = (xx[i] + x * x, yy[i] + y * y, zz[i] + z * z);
            (yz[i], zx[i], xy[i]) = (yz[i] + y * z, zx[i] + z * x, xy[i] + x * y);
        }
    }

    /// Makes the largest entries 1, those of a covariance being on the diagonal; zeros stay.
    #[inline(always)]
    fn scale_to_one(&mut self) {
        let [x, y, z] = self.diagonal;
        let mut factor = [0.0; WIDTH];
        for i in 0..WIDTH {
            factor[i] = 1.0 / greater(greater(x[i], y[i]), greater(z[i], f64::MIN_POSITIVE));
        }
        for entries in self.diagonal.iter_mut().chain(&mut self.mixed) {
            for i in 0..WIDTH {
                entries[i] *= factor[i];
            }
        }
    }

    /// Least roots of λ³ − tr·λ² + s·λ − det, s being the sum of the minors of the diagonal: all three are real and none is
    /// negative, so the polynomial rises and is curved to one side up to the first.
    #[inline(always)]
    fn smallest_eigenvalues(&self) -> Eight {
        let Self { diagonal: [xx, yy, zz], mixed: [yz, zx, xy] } = self;
        let [mut trace, mut minors, mut determinant] = [[0.0; WIDTH]; 3];
        for i in 0..WIDTH {
            let x = xx[i];
            let y = yy[i];
            let z = zz[i];
            let a = yz[i] * yz[i];
            let b = zx[i] * zx[i];
            let c = xy[i] * xy[i];
            trace[i] = x + y + z;
            minors[i] = (y * z - a) + (z * x - b) + (x * y - c);
            determinant[i] = x * (y * z - a) + 2.0 * (yz[i] * zx[i] * xy[i]) - (y * b + z * c);
        }
        let mut root = [0.0; WIDTH];
        for _ in 0..STEPS {
            let mut step = [0.0; WIDTH];
            for i in 0..WIDTH {
                let l = root[i];
                let value = ((l - trace[i]) * l + minors[i]) * l - determinant[i];
                let slope = (3.0 * l - 2.0 * trace[i]) * l + minors[i];
                // The slope at the root is the product of its distances from the others: below the limit there is no plane.
                step[i] = value / greater(slope, LINE);
                root[i] = l - step[i];
            }
            if step.iter().all(|s| s.abs() < 1e-14) {
                break;
            }
        }
        root
    }

    /// The columns of the adjugates that have the largest entries on the diagonal.
    #[inline(always)]
    fn longest_columns(&self) -> [Eight; 3] {
        let Self { diagonal: [xx, yy, zz], mixed: [yz, zx, xy] } = self;
        let mut columns = [[0.0; WIDTH]; 3];
        for i in 0..WIDTH {
            let x = yy[i] * zz[i] - yz[i] * yz[i];
            let y = zz[i] * xx[i] - zx[i] * zx[i];
            let z = xx[i] * yy[i] - xy[i] * xy[i];
            let a = zx[i] * xy[i] - xx[i] * yz[i];
            let b = xy[i] * yz[i] - yy[i] * zx[i];
            let c = yz[i] * zx[i] - zz[i] * xy[i];
            let is_x = x >= y;
            let first = if is_x { x } else { y };
            let is_z = z > first;
            columns[0][i] = if is_z {
                b
            } else if is_x {
                x
            } else {
                c
            };
            columns[1][i] = if is_z {
                a
            } else if is_x {
                c
            } else {
                y
            };
            columns[2][i] = if is_z {
                z
            } else if is_x {
                b
            } else {
                a
            };
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same neighbours for all, around a point that is not at their mean.
    fn normal(offsets: &[DVec3]) -> Option<DVec3> {
        let lanes: Vec<Offset> = offsets.iter().map(|o| o.as_vec3().to_array().map(|c| [c; WIDTH])).collect();
        let planes = fit_planes(&lanes);
        assert!(planes.iter().all(|plane| *plane == planes[0]));
        planes[0].map(|plane| plane.normal)
    }

    #[test]
    fn a_tilted_plane_gives_its_normal() {
        for scale in [1.0, 1e-30, 1e30] {
            let expected = DVec3::new(0.3, 0.9, -0.2).normalize();
            let (u, v) = expected.any_orthonormal_pair();
            let ring = |i: i32| (f64::from(i) * 0.61).sin_cos();
            let at = |i: i32| (u * ring(i).0 + v * ring(i).1) * f64::from(i % 3 + 1) * scale;
            let found = normal(&(0..12).map(at).collect::<Vec<_>>()).unwrap_or_default();
            assert!(found.dot(expected).abs() > 1.0 - 1e-12, "{found}");
        }
    }

    /// Of neighbours that are mirrored at three planes the axes are eigenvectors, and the one along which they are least spread is the normal.
    #[test]
    fn the_normal_lies_where_points_are_spread_least() {
        for (spread, axis) in [([3.0, 2.0, 1.0], 2), ([0.999, 1.0, 1.001], 0), ([5.0, 1e-3, 5.0], 1)] {
            let corner = |i: usize, a: usize| if i >> a & 1 == 1 { spread[a] } else { -spread[a] };
            let corners: Vec<DVec3> = (0..8).map(|i| DVec3::new(corner(i, 0), corner(i, 1), corner(i, 2))).collect();
            let found = normal(&corners).unwrap_or_default();
            assert!((found.abs() - DVec3::AXES[axis]).length() < 1e-9, "{spread:?}: {found}");
        }
    }

    #[test]
    fn points_on_a_line_have_no_plane() {
        let line = |i: i32| DVec3::new(f64::from(i), 2.0 * f64::from(i), 0.0);
        assert_eq!(normal(&(1..5).map(line).collect::<Vec<_>>()), None);
        assert_eq!(normal(&[DVec3::ZERO; 4]), None);
        // Nor have those that are spread to all sides alike.
        let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
        assert_eq!(normal(&axes), None);
    }
}
