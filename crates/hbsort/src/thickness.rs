//! The slice thickness ε from the splat radii.
//!
//! The paper takes the smallest size of all points (section 4.2, at the example of Figure 1). One tiny splat among
//! millions would then ask for millions of slices that hold nothing. So where the smallest radius asks for more than
//! 2¹⁶ slices and is less than a quarter of the first percentile, the percentile is taken.

use crate::scratch::{CHUNK, ThicknessRule};
use rayon::prelude::*;

/// Slices that the smallest radius may ask for without being questioned: 256 buckets a level.
const UNQUESTIONED: f64 = (1u32 << 16) as f64;

/// How far below the percentile a radius is an outlier.
const OUTLIER: f32 = 0.25;

/// Classes of radii: exponent and three bits of the mantissa, so that scaling by a power of two scales the result.
const CLASSES: usize = 1 << 11;
const CLASS_SHIFT: u32 = 20;

/// ε for kept depths that span `span`, from the radii of all splats given.
pub(crate) fn choose(
    span: f64,
    smallest: f32,
    n: usize,
    radius_at: &(impl Fn(usize) -> f32 + Sync),
) -> (f64, ThicknessRule) {
    // A cloud that was not validated may hold a radius of zero; no slice is thinner than the smallest normal number.
    let smallest = smallest.max(f32::MIN_POSITIVE);
    if span > UNQUESTIONED * f64::from(smallest) {
        let percentile = percentile(n, radius_at).max(f32::MIN_POSITIVE);
        if smallest < OUTLIER * percentile {
            return (f64::from(percentile), ThicknessRule::Percentile);
        }
    }
    (f64::from(smallest), ThicknessRule::SmallestRadius)
}

/// The radius that 1 % of the splats fall short of, rounded down to three bits of the mantissa.
fn percentile(n: usize, radius_at: &(impl Fn(usize) -> f32 + Sync)) -> f32 {
    let chunks = n.div_ceil(CHUNK);
    let count = |mut classes: [u32; CLASSES], c: usize| {
        for i in c * CHUNK..n.min((c + 1) * CHUNK) {
            classes[(radius_at(i).to_bits() >> CLASS_SHIFT) as usize & (CLASSES - 1)] += 1;
        }
        classes
    };
    let sum = |mut a: [u32; CLASSES], b: [u32; CLASSES]| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let classes = (0..chunks).into_par_iter().fold(|| [0; CLASSES], count).reduce(|| [0; CLASSES], sum);
    let mut below = 0;
    let class = classes.iter().position(|c| {
        below += *c as usize;
        below > n / 100
    });
    f32::from_bits((class.unwrap_or(0) as u32) << CLASS_SHIFT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bs05_one_tiny_splat_does_not_rule() {
        let radius = |i: usize| if i == 77 { 1e-9 } else { 1e-3 };
        let (thickness, rule) = choose(10.0, 1e-9, 100_000, &radius);
        assert_eq!(rule, ThicknessRule::Percentile);
        assert!(thickness <= f64::from(1e-3f32) && thickness > 0.85e-3, "{thickness}");
        // Scaling by a power of two scales the choice exactly.
        let scaled = |i: usize| radius(i) * 1024.0;
        assert_eq!(choose(10_240.0, 1e-9 * 1024.0, 100_000, &scaled), (thickness * 1024.0, rule));
    }

    #[test]
    fn bs05_the_smallest_rules_where_it_costs_nothing_or_is_common() {
        let radius = |i: usize| if i == 77 { 1e-3 } else { 1e-2 };
        assert_eq!(choose(10.0, 1e-3, 1000, &radius), (f64::from(1e-3f32), ThicknessRule::SmallestRadius));
        assert_eq!(choose(10.0, 1e-7, 1000, &|_| 1e-7), (f64::from(1e-7f32), ThicknessRule::SmallestRadius));
    }
}
