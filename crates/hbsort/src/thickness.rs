//! The slice thickness ε from the splat radii.
//!
//! The paper takes the smallest size of all points (section 4.2, at the example of Figure 1). A single tiny splat
//! among millions would then require millions of empty slices. So the first percentile of the radii is used instead, if the smallest
//! radius needs more than 2¹⁶ slices and is less than a quarter of that percentile.

use crate::scratch::{CHUNK, ThicknessRule};
use rayon::prelude::*;

/// Slices that the smallest radius may ask for without being questioned: 256 buckets a level.
const UNQUESTIONED: f64 = (1u32 << 16) as f64;

/// How far below the percentile a radius is an outlier.
const OUTLIER: f32 = 0.25;

/// Classes of radii among which the percentile is looked for: exponent and three bits of the mantissa.
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

/// The radius that 1 % of the splats fall short of, exactly: rounded to its class it would depend on the unit of length.
fn percentile(n: usize, radius_at: &(impl Fn(usize) -> f32 + Sync)) -> f32 {
    let chunks = n.div_ceil(CHUNK);
    let class_of = |radius: f32| (radius.to_bits() >> CLASS_SHIFT) as usize & (CLASSES - 1);
    let count = |mut classes: [u32; CLASSES], c: usize| {
        for i in c * CHUNK..n.min((c + 1) * CHUNK) {
            classes[class_of(radius_at(i))] += 1;
        }
        classes
    };
    let sum = |mut a: [u32; CLASSES], b: [u32; CLASSES]| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let classes = (0..chunks).into_par_iter().fold(|| [0; CLASSES], count).reduce(|| [0; CLASSES], sum);
    let mut rank = n / 100;
    let class = classes.iter().position(|c| {
        let is_here = rank < *c as usize;
        rank -= if is_here { 0 } else { *c as usize };
        is_here
    });
    let Some(class) = class else { return 0.0 };
    let mut radii: Vec<f32> = (0..n).into_par_iter().map(radius_at).filter(|r| class_of(*r) == class).collect();
    *radii.select_nth_unstable_by(rank, f32::total_cmp).1
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
        // Scaling scales the choice, by a power of two or not.
        for scale in [1024.0, 1.3f32] {
            let scaled = |i: usize| radius(i) * scale;
            let found = choose(10.0 * f64::from(scale), 1e-9 * scale, 100_000, &scaled);
            assert_eq!(found, (f64::from(1e-3f32 * scale), rule));
        }
    }

    #[test]
    fn bs05_the_smallest_rules_where_it_costs_nothing_or_is_common() {
        let radius = |i: usize| if i == 77 { 1e-3 } else { 1e-2 };
        assert_eq!(choose(10.0, 1e-3, 1000, &radius), (f64::from(1e-3f32), ThicknessRule::SmallestRadius));
        assert_eq!(choose(10.0, 1e-7, 1000, &|_| 1e-7), (f64::from(1e-7f32), ThicknessRule::SmallestRadius));
    }
}
