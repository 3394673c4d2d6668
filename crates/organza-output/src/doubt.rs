//! Warnings about finished pictures of a single colour: black, white or another.

use crate::displayed;

/// Middle grey, which an exposure is proposed for.
const GREY: f64 = 0.18;

/// Why a picture is of one colour, and what to do, one sentence; `None` for any other, and for a single pixel that is neither black nor white.
/// `beauty` is radiance, `exposure` in stops.
pub fn doubt(beauty: &[[f32; 3]], exposure: f64) -> Option<String> {
    let gain = libm::exp2(exposure) as f32;
    let is_everywhere = |byte: u8| beauty.iter().flatten().all(|v| displayed(v * gain) == byte);
    let stops = |radiance: f32| libm::log2(GREY / f64::from(radiance)).round();
    if beauty.is_empty() {
        return None;
    }
    if is_everywhere(0) {
        let brightest = beauty.iter().flatten().fold(0.0, |most, v| f32::max(most, *v));
        return Some(if brightest > 0.0 {
            let stops = stops(brightest);
            format!("the picture is all black: its brightest radiance is {brightest:.1e}; try --exposure {stops}")
        } else {
            "the picture is all black: no light comes from what the camera sees; move or strengthen a [[light]], or add \
             [ambient]"
                .to_owned()
        });
    }
    if is_everywhere(255) {
        let darkest = beauty.iter().flatten().fold(f32::INFINITY, |least, v| f32::min(least, *v));
        let stops = if darkest.is_finite() { stops(darkest) } else { -60.0 };
        return Some(format!(
            "the picture is all white: its darkest radiance is {darkest:.1e}; try --exposure {stops}"
        ));
    }
    let shown = |pixel: &[f32; 3]| pixel.map(|v| displayed(v * gain));
    let first = shown(&beauty[0]);
    let is_even = beauty.len() > 1 && beauty.iter().all(|pixel| shown(pixel) == first);
    is_even.then(|| {
        "the picture is all of one colour: no object stands out from what is behind it; look whether objects lie in the view, are large \
         enough, and have colours or light of their own"
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::doubt;

    #[test]
    fn pictures_of_one_colour_are_told_with_an_exposure_that_shows_them() {
        assert_eq!(doubt(&[], 0.0), None);
        assert_eq!(doubt(&[[0.0; 3], [0.2; 3]], 0.0), None);
        assert_eq!(doubt(&[[0.2; 3]], 0.0), None);
        assert!(doubt(&[[0.2, 0.3, 0.4]; 2], 0.0).unwrap().contains("one colour"));
        assert!(doubt(&[[0.2, 0.3, 0.4], [0.20001, 0.3, 0.4]], 0.0).unwrap().contains("one colour"));
        assert!(doubt(&[[0.0; 3]; 2], 0.0).unwrap().contains("no light comes"));
        for (radiance, exposure, what) in [(1e-5, 0.0, "black"), (50.0, 0.0, "white"), (0.2, -20.0, "black")] {
            let said = doubt(&[[radiance; 3]; 2], exposure).unwrap();
            assert!(said.contains(what), "{said}");
            let proposed: f64 = said.rsplit(' ').next().unwrap().parse().unwrap();
            assert_eq!(doubt(&[[radiance; 3]; 1], proposed), None, "{said}");
        }
    }
}
