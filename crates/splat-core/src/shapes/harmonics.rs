//! Real spherical harmonics up to degree 3, orthonormal over the sphere, in the order and with the signs of Kerbl et al. 2023.

use glam::{DQuat, DVec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// The highest degree.
pub(crate) const MOST_DEGREE: u8 = 3;
/// Numbers of that degree.
const MOST: usize = terms(MOST_DEGREE);

/// Harmonics up to a degree.
pub(crate) const fn terms(degree: u8) -> usize {
    (degree as usize + 1) * (degree as usize + 1)
}

/// All harmonics at a unit vector.
pub(crate) fn basis(d: DVec3) -> [f64; MOST] {
    let DVec3 { x, y, z } = d;
    let xx = x * x;
    let yy = y * y;
    let zz = z * z;
    let c = |squared: f64| (squared * FRAC_1_PI).sqrt();
    let c1 = c(0.75);
    let c2 = c(3.75);
    let c30 = c(7.0 / 16.0);
    let c31 = c(21.0 / 32.0);
    let c33 = c(35.0 / 32.0);
    let c20 = c(5.0 / 16.0);
    let c32 = c(105.0 / 4.0);
    [
        c(0.25),
        -c1 * y,
        c1 * z,
        -c1 * x,
        c2 * x * y,
        -c2 * y * z,
        c20 * (2.0 * zz - xx - yy),
        -c2 * x * z,
        0.5 * c2 * (xx - yy),
        -c33 * y * (3.0 * xx - yy),
        c32 * x * y * z,
        -c31 * y * (4.0 * zz - xx - yy),
        c30 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -c31 * x * (4.0 * zz - xx - yy),
        0.5 * c32 * z * (xx - yy),
        -c33 * x * (xx - 3.0 * yy),
    ]
}

/// Nodes and weights of Gauss and Legendre for four points of \[−1, 1\]: exact up to the seventh power.
const NODES: [[f64; 2]; 4] = [
    [-0.861_136_311_594_052_6, 0.347_854_845_137_453_85],
    [-0.339_981_043_584_856_26, 0.652_145_154_862_546_1],
    [0.339_981_043_584_856_26, 0.652_145_154_862_546_1],
    [0.861_136_311_594_052_6, 0.347_854_845_137_453_85],
];
/// Directions around the axis for each of them.
const AROUND: usize = 8;

/// What turns the coefficients of a function on the sphere into those of the function that was rotated: D_{jk} = ∫ Y_j(d)·Y_k(R⁻¹d) dΩ,
/// by a quadrature that is exact for products of two harmonics.
pub(crate) fn rotation(by: DQuat) -> [[f64; MOST]; MOST] {
    let mut matrix = [[0.0; MOST]; MOST];
    for [z, weight] in NODES {
        for k in 0..AROUND {
            let (sin, cos) = libm::sincos(2.0 * PI * (k as f64 + 0.5) / AROUND as f64);
            let across = (1.0 - z * z).sqrt();
            let d = DVec3::new(across * cos, across * sin, z);
            let to = basis(d);
            let from = basis(by.inverse() * d);
            let weight = weight * 2.0 * PI / AROUND as f64;
            for (row, to) in matrix.iter_mut().zip(to) {
                row.iter_mut().zip(from).for_each(|(sum, from)| *sum += weight * to * from);
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_are_orthonormal_and_have_the_constants_of_the_trainers() {
        let matrix = rotation(DQuat::IDENTITY);
        for (j, row) in matrix.iter().enumerate() {
            for (k, v) in row.iter().enumerate() {
                assert!((v - f64::from(u8::from(j == k))).abs() < 1e-14, "{j} {k}: {v}");
            }
        }
        // Kerbl et al. 2023, their program's constants, at a direction that tells all apart.
        let d = DVec3::new(0.36, 0.48, 0.8);
        let x = d.x;
        let y = d.y;
        let z = d.z;
        let expected = [
            0.282_094_791_773_878_14,
            -0.488_602_511_902_919_9 * y,
            0.488_602_511_902_919_9 * z,
            -0.488_602_511_902_919_9 * x,
            1.092_548_430_592_079_2 * x * y,
            -1.092_548_430_592_079_2 * y * z,
            0.315_391_565_252_520_05 * (2.0 * z * z - x * x - y * y),
            -1.092_548_430_592_079_2 * x * z,
            0.546_274_215_296_039_6 * (x * x - y * y),
            -0.590_043_589_926_643_5 * y * (3.0 * x * x - y * y),
            2.890_611_442_640_554 * x * y * z,
            -0.457_045_799_464_465_8 * y * (4.0 * z * z - x * x - y * y),
            0.373_176_332_590_115_4 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y),
            -0.457_045_799_464_465_8 * x * (4.0 * z * z - x * x - y * y),
            1.445_305_721_320_277 * z * (x * x - y * y),
            -0.590_043_589_926_643_5 * x * (x * x - 3.0 * y * y),
        ];
        for (k, (found, expected)) in basis(d).iter().zip(expected).enumerate() {
            assert!((found - expected).abs() < 1e-14, "{k}: {found} {expected}");
        }
    }

    #[test]
    fn rotated_coefficients_are_those_of_the_rotated_function() {
        let by = DQuat::from_xyzw(0.3, -0.5, 0.2, 0.7).normalize();
        let matrix = rotation(by);
        let coefficient = |k: usize| f64::from((k * 37 % 11) as u32) - 5.0;
        for d in [DVec3::X, DVec3::new(0.6, 0.0, -0.8), DVec3::new(2.0, -3.0, 6.0) / 7.0] {
            let before: f64 = basis(by.inverse() * d).iter().enumerate().map(|(k, y)| y * coefficient(k)).sum();
            let turned = |row: &[f64; MOST]| row.iter().enumerate().map(|(k, m)| m * coefficient(k)).sum::<f64>();
            let after: f64 = basis(d).iter().zip(&matrix).map(|(y, row)| y * turned(row)).sum();
            assert!((before - after).abs() < 1e-12, "{d}: {before} {after}");
        }
    }
}
