//! Bumps: noise or an image as heights over a surface. Their slope tilts the shading normal (Blinn 1978), not the surface.
//!
//! h(p) = H·Σ N(2ᵏp/s)/2ᵏ, k < octaves, N the gradient noise of Perlin (2002) in the object's own space, so that bumps move with it, and
//! n′ ∝ n − (∇h − (n·∇h)·n).
//!
//! An image is projected onto the object from six sides. Each side is weighed by the fourth power of the cosine between normal and
//! axis: a surface that faces an axis shows that side's image alone, and a bend blends several. Seen from ±X and ±Z, +Y of the
//! object is up in the image; seen from +Y, −Z is up, and seen from −Y, +Z. Its lower left corner lies at the object's origin.

use splat_core::glam::{DVec3, IVec3};
use splat_core::{Bump, HeightImage, rng};

/// Stage of the random numbers.
const STAGE: u64 = 0xb0;

/// ∇h at a place on the object, of bumps that are seen by pixels `pixel` wide there: octaves that these cannot show are left out, and
/// fade in from two pixels a length to four.
pub(crate) fn slope(bump: &Bump, place: DVec3, pixel: f64) -> DVec3 {
    let size = f64::from(bump.size);
    let octave = |k: u32| {
        let scale = libm::exp2(f64::from(k));
        let shown = (size / (2.0 * pixel * scale) - 1.0).clamp(0.0, 1.0);
        if shown > 0.0 { noise_slope(place * (scale / size), bump.seed + u64::from(k)) * shown } else { DVec3::ZERO }
    };
    (0..bump.octaves).map(octave).sum::<DVec3>() * (f64::from(bump.height) / size)
}

/// ∇h of an image, at a place and across a unit normal of the object, which is on the viewer's side.
pub(crate) fn image_slope(bump: &Bump, image: &HeightImage, at: DVec3, normal: DVec3, pixel: f64) -> DVec3 {
    let size = f64::from(bump.size);
    let side = normal.signum();
    // Right and up in the image, as they are seen from outside.
    let laid = [(-side.x * DVec3::Z, DVec3::Y), (DVec3::X, -side.y * DVec3::Z), (side.z * DVec3::X, DVec3::Y)];
    let weights = normal.to_array().map(|n| (n * n) * (n * n));
    let of_side = |(weight, (right, up)): (f64, (DVec3, DVec3))| {
        let [rises_right, rises_down] = image.slope([at.dot(right) / size, -at.dot(up) / size], pixel / size);
        weight * (rises_right * right - rises_down * up)
    };
    let sum: DVec3 = weights.into_iter().zip(laid).filter(|(weight, _)| *weight > 0.0).map(of_side).sum();
    sum * (f64::from(bump.height) / size / weights.iter().sum::<f64>())
}

/// ∇N.
fn noise_slope(p: DVec3, seed: u64) -> DVec3 {
    let cell = p.floor();
    let at = p - cell;
    let fade = at.to_array().map(fade);
    let fade_slope = at.to_array().map(fade_slope);
    let mut sum = DVec3::ZERO;
    for corner in 0..8 {
        let is_far = [0, 1, 2].map(|axis| corner >> axis & 1 == 1);
        let offset = DVec3::from_array(is_far.map(|far| f64::from(u8::from(far))));
        let gradient = gradient((cell + offset).as_ivec3(), seed);
        let weight = |axis: usize| if is_far[axis] { fade[axis] } else { 1.0 - fade[axis] };
        let weight_slope = |axis: usize| if is_far[axis] { fade_slope[axis] } else { -fade_slope[axis] };
        let [x, y, z] = [weight(0), weight(1), weight(2)];
        let slope = DVec3::new(weight_slope(0) * y * z, x * weight_slope(1) * z, x * y * weight_slope(2));
        sum += gradient * (x * y * z) + slope * gradient.dot(at - offset);
    }
    sum
}

/// A direction to the middle of an edge of a cube, for a corner of the lattice.
fn gradient(corner: IVec3, seed: u64) -> DVec3 {
    let [x, y, z] = corner.to_array().map(|c| u64::from(c as u32));
    let bits = rng::bits(seed, STAGE, x << 32 | y, z) % 12;
    let [a, b] = [bits & 1, bits >> 1 & 1].map(|sign| 1.0 - 2.0 * sign as f64);
    match bits / 4 {
        0 => DVec3::new(a, b, 0.0),
        1 => DVec3::new(a, 0.0, b),
        _ => DVec3::new(0.0, a, b),
    }
}

/// 6t⁵ − 15t⁴ + 10t³.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn fade_slope(t: f64) -> f64 {
    30.0 * t * t * (t * (t - 2.0) + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::RadianceImage;

    /// N by its definition.
    fn noise(p: DVec3, seed: u64) -> f64 {
        let cell = p.floor();
        let at = p - cell;
        let corners = (0..8).map(|corner| {
            let offset = DVec3::from_array([0, 1, 2].map(|axis| f64::from(corner >> axis & 1)));
            let weight = |axis: usize| {
                let far = fade(at[axis]);
                if offset[axis] > 0.0 { far } else { 1.0 - far }
            };
            weight(0) * weight(1) * weight(2) * gradient((cell + offset).as_ivec3(), seed).dot(at - offset)
        });
        corners.sum()
    }

    #[test]
    fn slopes_are_those_of_the_noise() {
        let step = 1e-5;
        for k in 0..200u64 {
            let p = DVec3::from_array([0, 1, 2].map(|axis| 20.0 * rng::unit(1, 2, k, axis) - 10.0));
            let along = |axis: DVec3| (noise(p + axis * step, 3) - noise(p - axis * step, 3)) / (2.0 * step);
            let slope = DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
            assert!(noise_slope(p, 3).distance(slope) < 1e-8, "{p}: {} {slope}", noise_slope(p, 3));
        }
    }

    /// Ridges along the image's upper side, `count` in its width, as high as 1.
    fn ridges(count: u32) -> HeightImage {
        let height = |x: u32| (0.5 - 0.5 * libm::cos(std::f64::consts::TAU * (f64::from(x % 64) + 0.5) / 64.0)) as f32;
        let pixels = (0..64 * count * 32).map(|k| [height(k % (64 * count)); 3]).collect();
        HeightImage::new(&RadianceImage { size: [64 * count, 32], pixels }).expect("heights")
    }

    #[test]
    fn an_image_lies_upright_on_every_side_and_tells_its_slope() {
        let image = ridges(2);
        let bump = Bump { height: 0.3, size: 4.0, octaves: 0, seed: 0 };
        // h = 0.3·(1 − cos πx)/2 to the right of the image.
        let rises = |right: f64| 0.15 * std::f64::consts::PI * libm::sin(std::f64::consts::PI * right);
        let sides = [
            (DVec3::X, DVec3::NEG_Z),
            (DVec3::NEG_X, DVec3::Z),
            (DVec3::Y, DVec3::X),
            (DVec3::NEG_Y, DVec3::X),
            (DVec3::Z, DVec3::X),
            (DVec3::NEG_Z, DVec3::NEG_X),
        ];
        for (normal, right) in sides {
            for at in [DVec3::new(0.3, -0.7, 0.2), DVec3::new(-13.1, 5.2, 8.6)] {
                let slope = image_slope(&bump, &image, at, normal, 1e-3);
                // Differences over two texels, of 64 a ridge, are lower by a share of 1 − sin(δ)/δ < 0.002, and so is what lies between.
                assert!(
                    slope.distance(right * rises(at.dot(right))) < 0.004 * 0.15 * std::f64::consts::PI,
                    "{normal}: {slope}"
                );
            }
        }
    }

    #[test]
    fn an_image_bends_around_edges_and_fades_where_pixels_cannot_show_it() {
        let image = ridges(1);
        let bump = Bump { height: 0.3, size: 1.0, octaves: 0, seed: 0 };
        let at = DVec3::new(0.2, 0.0, 0.2);
        let slope = |normal: DVec3, pixel: f64| image_slope(&bump, &image, at, normal.normalize(), pixel);
        let half = 0.5 * (slope(DVec3::X, 1e-3) + slope(DVec3::Z, 1e-3));
        assert!(slope(DVec3::new(1.0, 0.0, 1.0), 1e-3).distance(half) < 1e-12);
        assert!(slope(DVec3::new(1.0, 0.0, 0.1), 1e-3).distance(slope(DVec3::X, 1e-3)) < 1e-3);
        assert!(slope(DVec3::Z, 0.25).length() < slope(DVec3::Z, 1e-3).length());
        assert!(slope(DVec3::Z, 1.0).length() < 1e-6, "the mean of a slope over a whole image");
    }

    #[test]
    fn octaves_that_pixels_cannot_show_are_left_out() {
        let bump = Bump { height: 0.1, size: 1.0, octaves: 3, seed: 0 };
        let p = DVec3::new(0.3, 0.4, 0.7);
        assert_eq!(slope(&bump, p, 0.5), DVec3::ZERO);
        let first = slope(&Bump { octaves: 1, ..bump }, p, 1e-3);
        assert_eq!(slope(&bump, p, 0.25), first, "four pixels a length, and two of the next octave");
        assert!(slope(&bump, p, 1e-3).distance(first) > 0.01);
        assert!((slope(&bump, p, 0.375) - first * (1.0 / 3.0)).length() < 1e-12);
    }
}
