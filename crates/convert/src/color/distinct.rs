//! Colours that are told apart, for whole numbers without a meaning of their own.
//!
//! The first ones are listed. Each further one is the colour of a lattice in sRGB that is farthest, in `OKLab` (Ottosson 2020), from all colours before
//! it: so many numbers have as many colours, the less alike the fewer numbers there are.

use splat_core::glam::DVec3;
use splat_core::srgb::linear_from_hex;
use std::sync::LazyLock;

/// The first colours, as 0xRRGGBB.
pub(super) const FIRST: [u32; 12] = [
    0x4e79a7, 0xf28e2b, 0x59a14f, 0xe15759, 0x76b7b2, 0xedc948, 0xb07aa1, 0x9c755f, 0x86bcb6, 0xff9da7, 0x5b6abf,
    0xb6992d,
];

/// Colours before they come again: the distance of further ones falls below what is told apart side by side.
pub(super) const COUNT: usize = 256;

/// Levels of a channel in the lattice of candidates, and the step between them in bytes.
const LEVELS: u32 = 16;
const STEP: u32 = 17;

/// Lightness of candidates in `OKLab`: darker ones show no shading, and lighter ones are lost on paper.
const LIGHTNESS: [f64; 2] = [0.35, 0.93];
/// Their least chroma: greys stand for numbers that are missing.
const CHROMA: f64 = 0.03;

static COLORS: LazyLock<Vec<[f32; 3]>> = LazyLock::new(spread);

/// The colour of a whole number, linear Rec.709; numbers that are [`COUNT`] apart share theirs.
pub(crate) fn distinct(number: f64) -> [f32; 3] {
    let place = number.round().rem_euclid(COUNT as f64) as usize;
    COLORS[place.min(COUNT - 1)]
}

/// The colours by rising number.
fn spread() -> Vec<[f32; 3]> {
    let mut colors: Vec<[f32; 3]> = FIRST.into_iter().map(linear_from_hex).collect();
    let candidate = |i: u32| {
        let color = linear_from_hex(
            (i / (LEVELS * LEVELS) * STEP) << 16 | (i / LEVELS % LEVELS * STEP) << 8 | (i % LEVELS * STEP),
        );
        let lab = ok_lab(color);
        let is_shown =
            (LIGHTNESS[0]..=LIGHTNESS[1]).contains(&lab.x) && libm::sqrt(lab.y * lab.y + lab.z * lab.z) >= CHROMA;
        is_shown.then_some((color, lab))
    };
    let candidates: Vec<([f32; 3], DVec3)> = (0..LEVELS.pow(3)).filter_map(candidate).collect();
    let mut nearest = vec![f64::INFINITY; candidates.len()];
    let mut approach = |lab: DVec3| {
        for (least, (_, other)) in nearest.iter_mut().zip(&candidates) {
            *least = least.min(lab.distance_squared(*other));
        }
        // The first of equal ones.
        (0..nearest.len()).fold(0, |best, i| if nearest[i] > nearest[best] { i } else { best })
    };
    let mut farthest = 0;
    for color in &colors {
        farthest = approach(ok_lab(*color));
    }
    while colors.len() < COUNT {
        let (color, lab) = candidates[farthest];
        colors.push(color);
        farthest = approach(lab);
    }
    colors
}

/// Linear Rec.709 → `OKLab`, by the matrices of Ottosson.
fn ok_lab(color: [f32; 3]) -> DVec3 {
    let color = DVec3::from_array(color.map(f64::from));
    let cones = DVec3::new(
        libm::cbrt(color.dot(DVec3::new(0.412_221_470_8, 0.536_332_536_3, 0.051_445_992_9))),
        libm::cbrt(color.dot(DVec3::new(0.211_903_498_2, 0.680_699_545_1, 0.107_396_956_6))),
        libm::cbrt(color.dot(DVec3::new(0.088_302_461_9, 0.281_718_837_6, 0.629_978_700_5))),
    );
    DVec3::new(
        cones.dot(DVec3::new(0.210_454_255_3, 0.793_617_785_0, -0.004_072_046_8)),
        cones.dot(DVec3::new(1.977_998_495_1, -2.428_592_205_0, 0.450_593_709_9)),
        cones.dot(DVec3::new(0.025_904_037_1, 0.782_771_766_2, -0.808_675_766_0)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_numbers_have_as_many_colours_that_are_told_apart() {
        let apart = |count: usize| {
            let labs: Vec<DVec3> = COLORS[..count].iter().map(|color| ok_lab(*color)).collect();
            let pairs = (FIRST.len()..count).flat_map(|i| (0..i).map(move |k| (i, k)));
            pairs.map(|(i, k)| labs[i].distance(labs[k])).fold(f64::INFINITY, f64::min)
        };
        // About 0.02 is just noticed side by side.
        for (count, least) in [(30, 0.1), (64, 0.07), (COUNT, 0.03)] {
            assert!(apart(count) > least, "{count} colours: {}", apart(count));
        }
        assert_eq!((COLORS.len(), COLORS[0]), (COUNT, linear_from_hex(FIRST[0])));
    }

    #[test]
    fn numbers_without_a_place_have_a_colour() {
        assert_eq!(distinct(256.0), distinct(0.0));
        assert_eq!(distinct(-1.0), distinct(255.0));
        for number in [1e300, -1e300, f64::NAN, f64::INFINITY] {
            assert!(distinct(number).iter().all(|channel| (0.0..=1.0).contains(channel)));
        }
    }
}
