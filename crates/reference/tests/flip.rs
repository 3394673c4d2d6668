//! LDR-FLIP against the implementation of its authors (crate `nv-flip`, C++), pixel by pixel.

use nv_flip::{FlipImageRgb8, FlipPool};
use reference::metrics::{Display, Image, Viewing, flip};
use splat_core::rng::unit;

const SIZE: [usize; 2] = [96, 64];

/// Waves, an edge, and noise of an amplitude: what both metrics read, in 8 bits.
fn picture(seed: u64, noise: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for k in 0..SIZE[0] * SIZE[1] {
        let x = (k % SIZE[0]) as f64;
        let y = (k / SIZE[0]) as f64;
        let base = [0.5 + 0.4 * (0.21 * x).sin(), 0.5 + 0.4 * (0.13 * y).cos(), if x > y { 0.8 } else { 0.2 }];
        for (c, b) in base.into_iter().enumerate() {
            let value = b + noise * (unit(seed, 0, k as u64, c as u64) - 0.5);
            bytes.push((value.clamp(0.0, 1.0) * 255.0).round() as u8);
        }
    }
    bytes
}

fn image(bytes: &[u8]) -> Image<Display> {
    let pixels = bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]].map(|v| f64::from(v) / 255.0)).collect();
    Image::from_encoded(SIZE, pixels).unwrap()
}

fn theirs(test: &[u8], reference: &[u8], pixels_per_degree: f32) -> (f64, Vec<f64>) {
    let image = |bytes: &[u8]| FlipImageRgb8::with_data(SIZE[0] as u32, SIZE[1] as u32, bytes);
    let map = nv_flip::flip(image(reference), image(test), pixels_per_degree);
    let mean = f64::from(FlipPool::from_image(&map).mean());
    (mean, map.to_vec().into_iter().map(f64::from).collect())
}

#[test]
fn flip_agrees_with_the_authors_implementation() {
    let reference = picture(1, 0.0);
    for (noise, shift) in [(0.02, 0), (0.3, 0), (1.0, 0), (0.0, 40)] {
        let mut test = picture(2, noise);
        test.iter_mut().step_by(3).for_each(|r| *r = r.saturating_add(shift));
        for pixels_per_degree in [nv_flip::DEFAULT_PIXELS_PER_DEGREE, 25.0] {
            let viewing = Viewing { pixels_per_degree: f64::from(pixels_per_degree) };
            let ours = flip(&image(&test), &image(&reference), &viewing).unwrap();
            let (mean, map) = theirs(&test, &reference, pixels_per_degree);
            assert!((ours.mean - mean).abs() < 1e-4, "{noise} {shift}: {} {mean}", ours.mean);
            let worst = ours.values.iter().zip(&map).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 2e-3, "{noise} {shift}: {worst}");
            assert!(mean > 1e-3, "nothing to compare");
        }
    }
}

#[test]
fn the_comparison_sees_swapped_channels() {
    let reference = picture(1, 0.0);
    let test = picture(2, 0.3);
    let swapped: Vec<u8> = test.chunks_exact(3).flat_map(|p| [p[1], p[0], p[2]]).collect();
    let ours = flip(&image(&swapped), &image(&reference), &Viewing::default()).unwrap();
    assert!((ours.mean - theirs(&test, &reference, nv_flip::DEFAULT_PIXELS_PER_DEGREE).0).abs() > 1e-2);
}
