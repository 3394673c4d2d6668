//! `render.splat_share`: fewer splats, each for several, show the same bodies.

use organza_tests::{Place, draw, parallel_view};

/// A slab of fog that the whole view looks through, and a wall behind its right half.
fn scene(share: &str) -> String {
    parallel_view(2.0, 64)
        + "[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\nshadow = false\n\
           [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
           medium_box = { min = [-3, -3, 0], max = [3, 3, 1], extinction = 0.7, spacing = 0.1 }\n\
           [[object]]\nname = 'wall'\n\
           rectangle = { center = [2, 0, -1], u = [2, 0, 0], v = [0, 3, 0], spacing = 0.03 }\n\
           [material.fog]\nshading = 'phase'\n[render]\nantialias = 1\n"
        + share
}

#[test]
fn a_slab_keeps_its_opacity_and_a_wall_has_no_holes() {
    let whole = draw(&scene(""), &[]);
    for (share, most) in [("splat_share = 0.5\n", 0.03), ("splat_share = 0.125\n", 0.06)] {
        let fewer = draw(&scene(share), &[]);
        let before = whole.opacity();
        let after = fewer.opacity();
        let left: Vec<usize> = (0..64 * 64).filter(|pixel| pixel % 64 < 28).collect();
        let mean = |opacity: &[f64]| left.iter().map(|pixel| opacity[*pixel]).sum::<f64>() / left.len() as f64;
        // 1 − e^(−0.7).
        assert!((mean(&before) - 0.5034).abs() < 0.002, "{}", mean(&before));
        // Uneven fog of the same mean optical depth is never more opaque.
        assert!((-1e-3..0.015).contains(&(mean(&before) - mean(&after))), "{share}: {}", mean(&after));
        let square = left.iter().map(|pixel| (after[*pixel] - before[*pixel]).powi(2)).sum::<f64>();
        let deviation = (square / left.len() as f64).sqrt();
        assert!(deviation < most, "{share}: {deviation}");
        let right = (0..64 * 64).filter(|pixel| pixel % 64 > 36);
        assert!(right.into_iter().all(|pixel| after[pixel] > 0.999), "{share}: a hole in the wall");
    }
}

#[test]
fn a_share_that_leaves_all_splats_is_told_and_one_that_is_none_refused() {
    let lone = "[[object]]\nname = 'ball'\nmedium_ball = { center = [0, 0, 0], radius = 0.1, extinction = 1, spacing = 0.1 }\n\
                [render]\nsplat_share = 0.5\n";
    let few = Place::new(&(parallel_view(2.0, 16) + lone));
    few.expect(0, &["render", "s.toml", "-o", "few.exr"], "render.splat_share changes nothing");
    for wrong in ["0", "1.5"] {
        let place = Place::new(&scene(&format!("splat_share = {wrong}\n")));
        let stated = format!("`splat_share`: expected a number above 0, at most 1, found {wrong}");
        place.expect(3, &["render", "s.toml", "-o", "wrong.exr"], &stated);
        assert!(place.made().is_empty());
    }
}

#[test]
fn what_a_light_sees_is_the_same_of_fewer_splats() {
    let place = Place::new(&scene(""));
    let points = |share: &str, name: &str| {
        let set = format!("render.splat_share={share}");
        place.expect(0, &["extract", "s.toml", "--absorbance", "0.3", "-o", name, "--set", &set], "");
        place.bytes(name)
    };
    assert_eq!(points("1", "whole.ply"), points("0.25", "fewer.ply"));
}
