//! LDR-FLIP: P. Andersson et al., *FLIP: A Difference Evaluator for Alternating Images*, Proc. ACM Comput. Graph.
//! Interact. Tech. 3(2), 2020.
//!
//! Colour: both pictures in YCxCz, each channel blurred by the eye's contrast sensitivity, then CIELAB with the Hunt
//! effect; ΔE = HyAB^0.7, mapped so that 0.4 of the largest distance is 0.95. Features: differences of edges and points
//! of the luminance, found by first and second derivatives of a Gaussian of 0.041°; ΔF = (max/√2)^0.5.
//! FLIP = ΔE^(1 − ΔF). The filters are applied as separable ones (sums of two for blue-yellow); same result.

use super::flip_color::{Colors, hyab};
use super::flip_filter::{Plane, balanced, taps};
use super::{Display, Image, MetricError};
use std::f64::consts::{PI, SQRT_2};

/// Exponents and bends of the paper.
const COLOR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
const BEND_AT: f64 = 0.4;
const BEND_VALUE: f64 = 0.95;
/// Width of the feature detectors, degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Contrast sensitivity: (a₁, b₁), (a₂, b₂) of achromatic, red-green and blue-yellow.
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// From where the picture is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewing {
    /// Pixels in a degree of the field of view, > 0.
    pub pixels_per_degree: f64,
}

impl Default for Viewing {
    /// 0.7 m from a screen 0.7 m wide with 3840 pixels, as in the paper.
    fn default() -> Self {
        Self { pixels_per_degree: 3840.0 * PI / 180.0 }
    }
}

/// Perceived difference of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipMap {
    /// 0 (none) to 1, row by row.
    pub values: Vec<f64>,
    /// Mean over the picture, 0 for one without pixels.
    pub mean: f64,
}

/// LDR-FLIP of two displayed pictures.
///
/// # Errors
/// [`MetricError::Size`].
pub fn flip(image: &Image<Display>, reference: &Image<Display>, viewing: &Viewing) -> Result<FlipMap, MetricError> {
    reference.same_size(image)?;
    if image.pixels().is_empty() {
        return Ok(FlipMap { values: Vec::new(), mean: 0.0 });
    }
    let colors = Colors::new();
    let [a, b] = [image, reference].map(|i| Seen::new(i, &colors, viewing.pixels_per_degree));
    let largest = colors.largest_distance(COLOR_EXPONENT);
    let values: Vec<f64> = (0..a.lab.len())
        .map(|k| {
            let color = bent(hyab(a.lab[k], b.lab[k]).powf(COLOR_EXPONENT), largest);
            let feature = (a.edge[k] - b.edge[k]).abs().max((a.point[k] - b.point[k]).abs());
            color.powf(1.0 - (feature / SQRT_2).powf(FEATURE_EXPONENT))
        })
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Ok(FlipMap { values, mean })
}

/// What the eye makes of one picture.
struct Seen {
    lab: Vec<[f64; 3]>,
    edge: Vec<f64>,
    point: Vec<f64>,
}

impl Seen {
    fn new(image: &Image<Display>, colors: &Colors, pixels_per_degree: f64) -> Self {
        let width = image.size()[0];
        let opponent: Vec<[f64; 3]> = image.pixels().iter().map(|p| colors.opponent(*p)).collect();
        let plane = |c: usize| Plane { width, values: opponent.iter().map(|p| p[c]).collect() };
        let blurred: [Plane; 3] = std::array::from_fn(|c| sensitive(&plane(c), SENSITIVITY[c], pixels_per_degree));
        let lab = (0..opponent.len())
            .map(|k| colors.hunt_lab([blurred[0].values[k], blurred[1].values[k], blurred[2].values[k]]))
            .collect();
        let luminance = Plane { width, values: opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect() };
        let [edge, point] = features(&luminance, pixels_per_degree);
        Self { lab, edge, point }
    }
}

/// One channel blurred by the eye.
fn sensitive(plane: &Plane, terms: [(f64, f64); 2], pixels_per_degree: f64) -> Plane {
    let reach = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    let gaussian = |b: f64| taps(reach, |x| (-(PI * x / pixels_per_degree).powi(2) / b).exp());
    let parts = terms.map(|(a, b)| {
        let g = gaussian(b);
        let weight = a * (PI / b).sqrt();
        let sum: f64 = g.iter().sum();
        (weight, weight * sum * sum, g)
    });
    let total = parts[0].1 + parts[1].1;
    let mut out = Plane { width: plane.width, values: vec![0.0; plane.values.len()] };
    for (weight, _, g) in parts.iter().filter(|p| p.0 > 0.0) {
        let part = plane.filtered(g, g);
        out.values.iter_mut().zip(part.values).for_each(|(o, p)| *o += weight / total * p);
    }
    out
}

/// Strength of edges and of points at each pixel.
fn features(luminance: &Plane, pixels_per_degree: f64) -> [Vec<f64>; 2] {
    let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let reach = (3.0 * sigma).ceil() as usize;
    let bell = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let across = taps(reach, bell);
    let sum: f64 = across.iter().sum();
    let across: Vec<f64> = across.into_iter().map(|t| t / sum).collect();
    let first = balanced(taps(reach, |x| -x * bell(x)));
    let second = balanced(taps(reach, |x| (x * x / (sigma * sigma) - 1.0) * bell(x)));
    [first, second].map(|taps| {
        let dx = luminance.filtered(&taps, &across);
        let dy = luminance.filtered(&across, &taps);
        dx.values.iter().zip(&dy.values).map(|(x, y)| x.hypot(*y)).collect()
    })
}

/// Small distances spread over most of \[0, 1\].
fn bent(distance: f64, largest: f64) -> f64 {
    let at = BEND_AT * largest;
    if distance < at {
        distance * BEND_VALUE / at
    } else {
        BEND_VALUE + (distance - at) / (largest - at) * (1.0 - BEND_VALUE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(f: impl Fn(usize, usize) -> [f64; 3]) -> Image<Display> {
        let pixels = (0..48 * 64).map(|k| f(k % 64, k / 64)).collect();
        Image::from_encoded([64, 48], pixels).unwrap()
    }

    #[test]
    fn equal_pictures_do_not_differ_and_flat_ones_follow_the_formula() {
        let grey = shown(|_, _| [0.5; 3]);
        assert_eq!(flip(&grey, &grey, &Viewing::default()).unwrap().mean, 0.0);
        // Black to white: HyAB = 100, no feature.
        let [black, white] = [0.0, 1.0].map(|v| shown(move |_, _| [v; 3]));
        let largest = Colors::new().largest_distance(COLOR_EXPONENT);
        let expected = bent(100f64.powf(COLOR_EXPONENT), largest);
        let found = flip(&white, &black, &Viewing::default()).unwrap();
        assert!((found.mean - expected).abs() < 1e-6, "{} {expected}", found.mean);
    }

    #[test]
    fn a_feature_counts_more_than_a_flat_change_of_the_same_size() {
        let grey = shown(|_, _| [0.5; 3]);
        let flat = shown(|_, _| [0.52; 3]);
        let lined = shown(|x, _| if x % 16 == 0 { [0.52; 3] } else { [0.5; 3] });
        let at = |image: &Image<Display>| flip(image, &grey, &Viewing { pixels_per_degree: 8.0 }).unwrap();
        let flat = at(&flat).values;
        let lined = at(&lined).values;
        assert!(lined[20 * 64 + 16] > 0.0 && flat[20 * 64 + 16] > 0.0);
        assert!(at(&shown(|x, _| if x < 32 { [0.5; 3] } else { [0.0; 3] })).mean > 0.2);
        assert_eq!(flip(&grey, &Image::from_encoded([1, 1], vec![[0.0; 3]]).unwrap(), &Viewing::default()).ok(), None);
    }
}
