//! Cross products of nearly parallel edges.

use glam::DVec3;

/// a·b − c·d with one rounding of the difference (Kahan): exact to an ulp where the products cancel.
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}

/// Cross product without cancellation.
pub fn robust_cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(
        difference_of_products(a.y, b.z, a.z, b.y),
        difference_of_products(a.z, b.x, a.x, b.z),
        difference_of_products(a.x, b.y, a.y, b.x),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cv02_products_that_nearly_cancel_keep_their_digits() {
        // Nearly parallel edges of length 1e4: the products agree in 14 digits, so plain f64 would keep two.
        let a = DVec3::new(8193.0, 4097.0, 0.0);
        let b = DVec3::new(16385.0, 8193.5, 0.0);
        assert_eq!(robust_cross(a, b).z, 8193.0 * 8193.5 - 4097.0 * 16385.0);
        let tiny = difference_of_products(1.0 + 2e-16, 1.0 - 2e-16, 1.0, 1.0);
        assert!((tiny + (2.0_f64 * f64::EPSILON / 2.0).powi(2)).abs() < 1e-16);
    }
}
