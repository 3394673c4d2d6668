//! Look-ups in environments: constants, the seam, poles and peaks, turns, and what is refused.

use splat_core::glam::DVec3;
use splat_core::rng::unit;
use splat_core::{Environment, RadianceImage};
use std::f64::consts::PI;

const PEAK: f32 = 6496.0;

fn image(size: [u32; 2], texel: impl Fn(u32, u32) -> [f32; 3]) -> RadianceImage {
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
    RadianceImage { size, pixels }
}

/// Texels of many brightnesses.
fn noise(size: [u32; 2]) -> RadianceImage {
    let value = |c: u64, x: u32, y: u32| (6.0 * unit(c, 0, u64::from(x), u64::from(y))).exp() as f32;
    image(size, |x, y| [value(1, x, y), value(2, x, y), value(3, x, y)])
}

/// Black, but for one texel.
fn peak(size: [u32; 2], at: [u32; 2]) -> RadianceImage {
    image(size, |x, y| if [x, y] == at { [PEAK; 3] } else { [0.0; 3] })
}

fn direction(turn: f64, polar: f64) -> DVec3 {
    let (s, c) = (2.0 * PI * turn).sin_cos();
    DVec3::new(s * polar.sin(), polar.cos(), -c * polar.sin())
}

/// Unit vectors that cover the sphere evenly, on a spiral of the golden angle.
fn directions(n: usize) -> impl Iterator<Item = DVec3> {
    (0..n).map(move |i| direction(i as f64 * 0.381_966_011_250_105, (1.0 - (2 * i + 1) as f64 / n as f64).acos()))
}

/// Mean of the first channel over the sphere, the image constant over each texel.
fn mean_of(image: &RadianceImage) -> f64 {
    let [width, height] = image.size.map(f64::from);
    let row = |y: usize| (PI * y as f64 / height).cos() - (PI * (y + 1) as f64 / height).cos();
    let rows = image.pixels.chunks(image.size[0] as usize).enumerate();
    rows.map(|(y, texels)| row(y) / (2.0 * width) * texels.iter().map(|t| f64::from(t[0])).sum::<f64>()).sum()
}

/// A look-up in the finest image by its definition: every texel of the sphere.
fn by_definition(image: &RadianceImage, d: DVec3, solid_angle: f64) -> [f64; 3] {
    let [width, height] = image.size.map(f64::from);
    let texel = (PI / height).max(2.0 * PI / width);
    let radius_sq = 8.0 * (solid_angle / 6.0 + 1.5 * texel * texel / 8.0);
    let mut sum = [0.0; 3];
    let mut weights = 0.0;
    for (k, pixel) in image.pixels.iter().enumerate() {
        let x = (k % image.size[0] as usize) as f64;
        let y = (k / image.size[0] as usize) as f64;
        let top = PI * y / height;
        let bottom = PI * (y + 1.0) / height;
        let solid_angle = top.cos() - bottom.cos();
        let polar = (bottom.sin() - bottom * bottom.cos() - top.sin() + top * top.cos()) / solid_angle;
        let center = direction((x + 0.5) / width, 0.5 * (polar + PI * (y + 0.5) / height));
        let weight = solid_angle * (1.0 - (center - d).length_squared() / radius_sq).max(0.0).powi(2);
        (0..3).for_each(|c| sum[c] += weight * f64::from(pixel[c]));
        weights += weight;
    }
    sum.map(|s| s / weights)
}

#[test]
fn db15_a_constant_map_is_that_constant_in_every_direction_and_footprint() {
    for (size, color) in [([256, 128], [0.1, 0.7, 6496.0]), ([17, 9], [1e-30, 1e30, 1.0 / 3.0]), ([1, 1], [0.3; 3])] {
        let sky = Environment::new(&image(size, |_, _| color), 0.123, 1.0).unwrap();
        for (i, d) in directions(2000).chain([DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]).enumerate() {
            let solid_angle = if i % 7 == 0 { 0.0 } else { 4.0 * PI * unit(5, 0, i as u64, 0).powi(6) };
            assert_eq!(sky.radiance(d, solid_angle), color, "{size:?} {d} {solid_angle}");
        }
    }
}

#[test]
fn look_ups_in_the_finest_image_are_their_definition() {
    for size in [[64, 32], [37, 11], [8, 40], [3, 1]] {
        let image = noise(size);
        let sky = Environment::new(&image, 0.0, 1.0).unwrap();
        let texel = (PI / f64::from(size[1])).max(2.0 * PI / f64::from(size[0]));
        for d in directions(300).chain([DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]) {
            for share in [0.0, 0.25, 0.5] {
                let found = sky.radiance(d, share * texel * texel);
                let exact = by_definition(&image, d, share * texel * texel);
                for c in 0..3 {
                    // The rounding of f32.
                    assert!(
                        (f64::from(found[c]) - exact[c]).abs() <= 1e-7 * exact[c],
                        "{size:?} {d}: {found:?} {exact:?}"
                    );
                }
            }
        }
    }
}

/// How far the mean of look-ups over the sphere is from that of the image, relative to it.
fn gain(image: &RadianceImage, solid_angle: f64) -> f64 {
    let sky = Environment::new(image, 0.0, 1.0).unwrap();
    let n = 200_000;
    let mean = directions(n).map(|d| f64::from(sky.radiance(d, solid_angle)[0])).sum::<f64>() / n as f64;
    mean / mean_of(image) - 1.0
}

#[test]
fn db15_the_mean_over_the_sphere_is_that_of_the_image_wherever_a_peak_lies() {
    let size = [64, 32];
    for solid_angle in [0.0, 0.003, 0.03, 0.3] {
        // The seam, and elsewhere.
        for at in [[0, 15], [63, 16], [30, 8], [9, 3]] {
            let off = gain(&peak(size, at), solid_angle);
            assert!(off.abs() < 3e-4, "{at:?}, {solid_angle} sr: {off:+.2e}");
        }
        // A texel at a pole, and in the row below: triangles, or nearly so.
        for at in [[0, 0], [40, 31], [20, 1]] {
            let off = gain(&peak(size, at), solid_angle);
            assert!(off.abs() < 4e-3, "{at:?}, {solid_angle} sr: {off:+.2e}");
        }
        let off = gain(&noise(size), solid_angle);
        assert!(off.abs() < 2e-6, "{solid_angle} sr: {off:+.2e}");
    }
}

#[test]
fn db15_a_peak_far_away_does_not_sparkle() {
    // A texel of 1.2e-3 sr seen by pixels of 0.04 sr, from a camera that turns by fractions of a pixel.
    let sky = Environment::new(&peak([128, 64], [70, 31]), 0.0, 1.0).unwrap();
    let texel = 2.0 * PI / 128.0 * ((PI * 31.0 / 64.0).cos() - (PI * 32.0 / 64.0).cos());
    let side = 0.2;
    let solid_angle = 0.04;
    let mut sums = Vec::new();
    for step in 0..20 {
        let turned = f64::from(step) / 20.0 * side;
        let mut sum = 0.0;
        for pixel in 0..31 * 15 {
            let x = f64::from(pixel % 31) * side + turned;
            let y = 0.5 * PI + (f64::from(pixel / 31) - 7.3) * side;
            if !(0.0..=PI).contains(&y) {
                continue;
            }
            let seen = f64::from(sky.radiance(direction(x / (2.0 * PI), y), solid_angle)[0]);
            // A kernel of radius R has 3/(πR²) in its middle, and R² = 4/3·Ω at least.
            assert!(seen <= f64::from(PEAK) * texel * 2.25 / PI / solid_angle, "{seen}");
            sum += seen * side * side;
        }
        sums.push(sum / (f64::from(PEAK) * texel));
    }
    // Pixels share the peak between them: neither is it lost between two of them nor counted twice.
    assert!(sums.iter().all(|s| (s - 1.0).abs() < 0.08), "{sums:?}");
}

#[test]
fn db15_the_seam_and_the_poles_are_no_edges() {
    let sky = Environment::new(&noise([32, 16]), 0.0, 1.0).unwrap();
    for solid_angle in [0.0, 0.02, 0.5] {
        for polar in [0.01, 0.7, 1.5, 2.6, 3.13] {
            let [left, right] = [-1e-9, 1e-9].map(|turn| sky.radiance(direction(turn, polar), solid_angle));
            let [above, below] = [-1e-9, 1e-9].map(|by| sky.radiance(direction(0.3, PI + by), solid_angle));
            for c in 0..3 {
                assert!((left[c] / right[c] - 1.0).abs() < 1e-6, "{polar}: {left:?} {right:?}");
                assert!((above[c] / below[c] - 1.0).abs() < 1e-6, "{above:?} {below:?}");
            }
        }
    }
    // Footprints change levels without a step.
    let d = direction(0.21, 1.1);
    let at = |i: i32| sky.radiance(d, 1e-3 * 1.0005f64.powi(i))[0];
    assert!((0..18_000).all(|i| (at(i + 1) / at(i) - 1.0).abs() < 2e-3));
}

#[test]
fn turns_by_whole_texels_are_exact_and_a_whole_turn_is_none() {
    let size = [36, 18];
    let image = noise(size);
    let still = Environment::new(&image, 0.0, 1.0).unwrap();
    for turns in [1.0, -1.0, 5.0] {
        assert_eq!(Environment::new(&image, turns, 1.0).unwrap(), still);
    }
    for texels in [1u32, 7, 35] {
        let turned = Environment::new(&image, f64::from(10 * texels) / 360.0, 1.0).unwrap();
        let mut moved = image.clone();
        moved.pixels.chunks_exact_mut(36).for_each(|row| row.rotate_left(texels as usize));
        assert_eq!(turned, Environment::new(&moved, 0.0, 1.0).unwrap());
    }
    // What lay towards −Z lies towards −X after a quarter of a turn, and a part of a texel counts.
    for turns in [0.25, 0.25 + 0.013, 0.777] {
        let turned = Environment::new(&image, turns, 1.0).unwrap();
        for (turn, polar) in [(0.11, 0.9), (0.74, 2.0)] {
            let [a, b] =
                [turned.radiance(direction(turn - turns, polar), 0.1), still.radiance(direction(turn, polar), 0.1)];
            assert!((0..3).all(|c| (a[c] / b[c] - 1.0).abs() < 0.05), "{turns}: {a:?} {b:?}");
        }
    }
    let bright = image_with_one_bright_texel();
    let quarter = Environment::new(&bright, 0.25, 1.0).unwrap();
    assert!(quarter.radiance(DVec3::NEG_X, 0.0)[0] > 0.0 && quarter.radiance(DVec3::NEG_Z, 0.0)[0] == 0.0);
}

/// Bright around −Z alone.
fn image_with_one_bright_texel() -> RadianceImage {
    image([64, 32], |x, y| if (x == 0 || x == 63) && (y == 15 || y == 16) { [PEAK; 3] } else { [0.0; 3] })
}

#[test]
fn what_is_no_radiance_is_refused() {
    let good = noise([4, 2]);
    let refused =
        |image: &RadianceImage, turns: f64, scale: f64| Environment::new(image, turns, scale).unwrap_err().to_string();
    for value in [f32::NAN, f32::INFINITY, -1e-30] {
        let mut image = good.clone();
        image.pixels[5][1] = value;
        let error = refused(&image, 0.0, 1.0);
        assert!(error.starts_with("pixel 5: radiance is [") && error.ends_with("three finite numbers ≥ 0"), "{error}");
    }
    for size in [[0, 0], [4, 3], [u32::MAX, u32::MAX]] {
        assert!(refused(&RadianceImage { size, ..good.clone() }, 0.0, 1.0).contains("size"));
    }
    assert!(refused(&good, f64::NAN, 1.0).contains("rotation"));
    for scale in [-1.0, f64::INFINITY, f64::NAN, 1e39] {
        assert!(refused(&good, 0.0, scale).contains("scale"), "{scale}");
    }
}

#[test]
fn bytes_are_known_before_and_dim_with_the_scale() {
    for size in [[256, 128], [17, 9], [1, 1], [5, 400]] {
        let sky = Environment::new(&noise(size), 0.0, 0.5).unwrap();
        assert_eq!(sky.bytes(), Environment::bytes_of(size), "{size:?}");
    }
    let [half, whole] = [0.5, 1.0].map(|scale| Environment::new(&noise([8, 4]), 0.0, scale).unwrap());
    assert_eq!(half.radiance(DVec3::X, 0.2), whole.radiance(DVec3::X, 0.2).map(|v| 0.5 * v));
}
