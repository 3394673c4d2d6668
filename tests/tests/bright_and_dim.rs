//! Radiance far from 1 by every technique: nothing is cut, and nothing is lost.

use organza_tests::{Place, draw, mean_and_ripple, parallel_view, window};
use std::f64::consts::PI;

const TECHNIQUES: [&str; 5] = ["points", "particles", "sheets", "surfels", "reference"];

/// Light of this irradiance straight on a pane of opacity ½, which gives `material` besides.
fn pane(irradiance: f64, material: &str) -> String {
    format!(
        "{}[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [{irradiance:e}, {irradiance:e}, {irradiance:e}]\n\
         [[object]]\nname = 'pane'\nmaterial = 'pane'\n\
         rectangle = {{ center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }}\n\
         [material.pane]\nopacity = 0.5\n{material}\n\
         [render]\nantialias = 1\nparticles = {{ repeat_level = 200 }}\n",
        parallel_view(0.5, 16)
    )
}

#[test]
fn a_pane_reflects_its_share_of_any_light_by_every_technique() {
    for power in [1e-12, 1e-8, 1.0, 1e6, 1e12] {
        for (what, irradiance, material, exact) in [
            ("lit", power, "", 0.5 / PI),
            ("unlit", 0.0, &*format!("shading = 'unlit'\ncolor = [{power:e}, {power:e}, {power:e}]"), 0.5),
            ("emission", 0.0, &*format!("emission = [{power:e}, {power:e}, {power:e}]"), 0.5),
        ] {
            for technique in TECHNIQUES {
                let red = draw(&pane(irradiance, material), &["--technique", technique]).channel("R");
                let (mean, _) = mean_and_ripple(&window(&red, 16, 0..16, 0..16));
                let error = mean / power / exact - 1.0;
                // 256 pixels of 200 sets: five standard errors of 1 / √51,200.
                let most = if technique == "particles" { 0.023 } else { 1e-3 };
                assert!(error.abs() < most, "{technique}, {what}, {power:e}: off by {error:e}");
            }
        }
    }
}

#[test]
fn a_dim_picture_is_told_with_an_exposure() {
    let place = Place::new(&pane(1e-8, ""));
    for technique in TECHNIQUES {
        let arguments = ["render", "s.toml", "-o", "a.exr", "--force", "--technique", technique];
        let told = place.expect(0, &arguments, "try --exposure 27");
        // Of particles the brightest pixel is above the mean.
        let told = String::from_utf8_lossy(&told.stderr).into_owned();
        assert!(told.contains("its brightest radiance is 1.") && told.contains("e-9"), "{told}");
    }
}
