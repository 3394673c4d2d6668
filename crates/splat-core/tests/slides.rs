//! Slides: where points lie in them, what they let through, coarser pictures, and what is refused.

use glam::DVec3;
use splat_core::{Framing, LightShape, RadianceImage, Slide};

fn image(size: [u32; 2], texel: impl Fn(u32, u32) -> [f32; 3]) -> RadianceImage {
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
    RadianceImage { size, pixels }
}

const SUN: LightShape = LightShape::Directional { direction: DVec3::NEG_Z };
const FRAMING: Framing = Framing { up: DVec3::Y, width: Some(2.0), center: DVec3::ZERO };

/// Red from left to right, green from top to bottom, at centres of texels.
fn ramp(size: [u32; 2]) -> RadianceImage {
    let at = |k: u32, n: u32| (k as f32 + 0.5) / n as f32;
    image(size, |x, y| [at(x, size[0]), at(y, size[1]), 1.0])
}

#[test]
fn points_lie_where_the_light_takes_them() {
    // Twice as wide as high: 2 by 1 in parallel light around the origin.
    let slide = Slide::new(&ramp([64, 32]), &SUN, &FRAMING).unwrap();
    for (x, y, z) in [(0.3, 0.1, 0.0), (-0.7, -0.3, 9.0), (0.0, 0.4, -5.0)] {
        let [red, green, _] = slide.passing(DVec3::new(x, y, z), 0.0);
        assert!((f64::from(red) - (0.5 + 0.5 * x)).abs() < 1e-6, "{red}");
        assert!((f64::from(green) - (0.5 - y)).abs() < 1e-6, "{green}");
    }
    // A spot turned to +x with +z upwards: to its right, seen along the light, is −y.
    let spot = LightShape::Spot { position: DVec3::ONE, direction: DVec3::X, inner: 0.1, outer: 0.5 };
    let framing = Framing { up: DVec3::Z, width: None, center: DVec3::ZERO };
    let slide = Slide::new(&ramp([64, 32]), &spot, &framing).unwrap();
    let half = libm::tan(0.5);
    for distance in [0.1, 1.0, 30.0] {
        let p = DVec3::ONE + distance * DVec3::new(1.0, -0.4 * half, 0.2 * half);
        let [red, green, _] = slide.passing(p, 0.0);
        // The cone is as wide as the picture is high, half of its width.
        assert!((red - 0.6).abs() < 1e-6 && (green - 0.4).abs() < 1e-6, "{red} {green}");
        assert_eq!(slide.passing(DVec3::ONE - distance * DVec3::X, 0.0), [0.0; 3]);
    }
}

#[test]
fn the_frame_lets_nothing_through_and_the_picture_reaches_to_it() {
    let slide = Slide::new(&image([4, 4], |_, _| [0.5, 1.0, 2.0]), &SUN, &FRAMING).unwrap();
    let seen = |x: f64, spread: f64| slide.passing(DVec3::new(x, 0.3, 0.0), spread);
    for spread in [0.0, 0.01, 0.3, 50.0] {
        assert_eq!(seen(0.999, spread), [0.5, 1.0, 2.0]);
        assert_eq!(seen(-1.001, spread), [0.0; 3]);
    }
    assert_eq!(slide.brightest(), 2.0);
}

#[test]
fn one_everywhere_is_one_to_the_last_bit() {
    for size in [[1, 1], [3, 7], [13, 5], [64, 48]] {
        let slide = Slide::new(&image(size, |_, _| [1.0; 3]), &SUN, &FRAMING).unwrap();
        for k in 0..400 {
            let at = [f64::from(k % 20) / 19.0, f64::from(k / 20) / 19.0];
            assert_eq!(slide.look_up(at, 0.003 * f64::from(k)), [1.0; 3], "{size:?} {at:?}");
        }
    }
}

#[test]
fn wide_receivers_see_means_and_the_step_between_two_pictures_is_none() {
    let noise = image([37, 21], |x, y| [(x * 31 + y * 17) as f32 % 11.0, (x + y) as f32 % 2.0, 1.0]);
    let slide = Slide::new(&noise, &SUN, &FRAMING).unwrap();
    let mean = |c: usize| noise.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / noise.pixels.len() as f64;
    let seen = slide.look_up([0.3, 0.6], 3.0);
    (0..3).for_each(|c| assert!((f64::from(seen[c]) - mean(c)).abs() < 1e-5 * mean(c)));
    // A wave of period 8 texels loses height step by step, and has none where receivers are as wide as half of it.
    let wave = image([128, 128], |x, _| [1.0 + (std::f32::consts::TAU * (x as f32 + 0.5) / 8.0).cos(); 3]);
    let slide = Slide::new(&wave, &SUN, &FRAMING).unwrap();
    let height = |texels: f64| {
        let seen = (0..64).map(|i| slide.look_up([0.5 + f64::from(i) / 1024.0, 0.5], texels / 128.0)[0]);
        let [low, high] = seen.fold([f32::MAX, f32::MIN], |[low, high], v| [low.min(v), high.max(v)]);
        high - low
    };
    let heights: Vec<f32> = (0..=40).map(|k| height(0.1 * f64::from(k))).collect();
    assert!(heights[0] > 1.8 && heights[5] == heights[0] && heights[40] < 1e-6, "{heights:?}");
    assert!(heights.windows(2).all(|pair| (-1e-6..0.25).contains(&(pair[0] - pair[1]))), "{heights:?}");
}

#[test]
fn a_scaled_world_sees_the_same_and_bytes_are_predicted() {
    let spot = LightShape::Spot { position: DVec3::ONE, direction: DVec3::NEG_Z, inner: 0.1, outer: 0.9 };
    for (light, scale) in [(SUN, 0.25), (spot, 8.0)] {
        let slide = Slide::new(&ramp([9, 5]), &light, &Framing { center: DVec3::X, ..FRAMING }).unwrap();
        let mut other = slide.clone();
        other.scale_world(scale);
        for p in [DVec3::new(0.3, 0.7, 0.1), DVec3::new(1.2, 0.2, -2.0)] {
            assert_eq!(slide.passing(p, 0.03), other.passing(p * scale, 0.03 * scale));
        }
        assert_eq!(slide.bytes(), Slide::bytes_of([9, 5]));
    }
}

#[test]
fn what_is_no_slide_is_refused() {
    let good = ramp([4, 4]);
    let refused = |image: &RadianceImage, light: &LightShape, framing: Framing| {
        Slide::new(image, light, &framing).unwrap_err().to_string()
    };
    let point = LightShape::Point { position: DVec3::ZERO };
    for (said, expected) in [
        (refused(&good, &point, FRAMING), "a spot or parallel light"),
        (refused(&good, &SUN, Framing { up: DVec3::Z, ..FRAMING }), "not along the light"),
        (refused(&good, &SUN, Framing { up: DVec3::NAN, ..FRAMING }), "not along the light"),
        (refused(&good, &SUN, Framing { width: None, ..FRAMING }), "a finite length > 0"),
        (refused(&good, &SUN, Framing { width: Some(f64::NAN), ..FRAMING }), "a finite length > 0"),
        (refused(&good, &SUN, Framing { center: DVec3::INFINITY, ..FRAMING }), "finite numbers"),
        (refused(&image([2, 2], |_, _| [f32::NAN; 3]), &SUN, FRAMING), "three finite numbers"),
    ] {
        assert!(said.contains(expected), "{said}");
    }
}
