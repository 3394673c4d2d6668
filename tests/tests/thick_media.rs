//! Media whose spacing is optically thick send as much light as their closed form says, whole command: slabs lit and seen straight and aslant.

use organza::scene::{LoadOptions, parse};
use organza::{Progress, RenderOptions};
use organza_tests::{Picture, draw};
use splat_core::glam::DVec3;
use std::f64::consts::PI;
use std::path::Path;

const SIZE: u32 = 8;
/// Layers of the slab, whose top is y = 0.
const LAYERS: f64 = 6.0;

/// A slab of layers of splats with a spacing of 1, an optical depth `tau` each.
#[derive(Clone, Copy)]
struct Slab<'a> {
    technique: &'a str,
    tau: f64,
    /// Degrees from the normal.
    view: f64,
    light: f64,
    /// Degrees about the normal, from the light to the eye.
    azimuth: f64,
}

impl Slab<'_> {
    /// Unit vectors to the eye and to the light.
    fn directions(&self) -> [DVec3; 2] {
        let towards = |angle: f64, azimuth: f64| {
            let [angle, azimuth] = [angle, azimuth].map(f64::to_radians);
            DVec3::new(angle.sin() * azimuth.cos(), angle.cos(), angle.sin() * azimuth.sin())
        };
        [towards(self.view, 0.0), towards(self.light, self.azimuth)]
    }

    fn scene(&self, medium: &str, render: &str) -> String {
        let Self { technique, tau, view, light, .. } = *self;
        let [eye, lamp] = self.directions();
        let eye = 12.0 * eye;
        // Whole spacings, so that none is stretched.
        let side = (6.0 + LAYERS * view.to_radians().tan().max(light.to_radians().tan())).ceil();
        format!(
            "version = 1\n[camera]\nposition = [{:?}, {:?}, {:?}]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\n\
             orthographic = 2.0\nsize = [{SIZE}, {SIZE}]\n\
             [[light]]\nkind = 'directional'\ndirection = [{:?}, {:?}, {:?}]\nirradiance = [{PI:?}, {PI:?}, {PI:?}]\n\
             [[object]]\nname = 'slab'\nmaterial = 'slab'\n\
             medium_box = {{ min = [{:?}, {:?}, {:?}], max = [{side:?}, 0, {side:?}], extinction = {tau:?}, spacing = 1 }}\n\
             [material.slab]\nmedium = {{ albedo = 1{medium} }}\n\
             [render]\ntechnique = '{technique}'\nantialias = 1\n{render}\n",
            eye.x, eye.y, eye.z, -lamp.x, -lamp.y, -lamp.z, -side, -LAYERS, -side,
        )
    }

    /// Radiance of an isotropic slab of albedo 1 whose optical depths are `factor` times as large, for an irradiance of π across the light.
    fn radiance(&self, factor: f64) -> f64 {
        let [view, light] = [self.view, self.light].map(|angle| angle.to_radians().cos());
        let whole = LAYERS * self.tau * factor * (1.0 / view + 1.0 / light);
        0.25 * light / (light + view) * -(-whole).exp_m1()
    }
}

fn mean(picture: &Picture, channel: &str) -> f64 {
    let values = picture.channel(channel);
    values.iter().sum::<f64>() / values.len() as f64
}

const TAUS: [f64; 8] = [0.01, 0.1, 0.25, 1.0, 2.0, 4.0, 8.0, 14.0];

#[track_caller]
fn check(slab: Slab<'_>) {
    let picture = draw(&slab.scene("", ""), &[]);
    let ratio = mean(&picture, "G") / slab.radiance(1.0);
    assert!(
        (ratio - 1.0).abs() < 0.02,
        "{} at {}°, light at {}°, tau {}: {ratio}",
        slab.technique,
        slab.view,
        slab.light,
        slab.tau
    );
}

#[test]
fn slabs_have_their_closed_form_straight_however_thick_a_spacing_is() {
    for technique in ["points", "sheets", "reference"] {
        for tau in TAUS {
            check(Slab { technique, tau, view: 0.0, light: 0.0, azimuth: 0.0 });
        }
    }
}

#[test]
fn slabs_have_their_closed_form_in_slanted_light_and_views() {
    for technique in ["points", "sheets"] {
        for tau in TAUS {
            check(Slab { technique, tau, view: 40.0, light: 0.0, azimuth: 0.0 });
            check(Slab { technique, tau, view: 60.0, light: 0.0, azimuth: 0.0 });
            // Sheets take slopes of the map as they are, which ripple in slanted light.
            if technique == "sheets" && tau > 1.0 {
                continue;
            }
            for [view, light] in [[0.0, 60.0], [40.0, 40.0]] {
                check(Slab { technique, tau, view, light, azimuth: 180.0 });
            }
            check(Slab { technique, tau, view: 40.0, light: 40.0, azimuth: 0.0 });
        }
    }
}

#[test]
fn coloured_slabs_that_scatter_forward_have_their_closed_form_and_their_layers_sum_to_beauty() {
    for technique in ["points", "sheets"] {
        let slab = Slab { technique, tau: 3.0, view: 0.0, light: 30.0, azimuth: 180.0 };
        // The phase function of light that turns by 150 degrees, over that of an even one.
        let g = 0.6f64;
        let cosine = -(30f64.to_radians().cos());
        let phase = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5);
        let text = slab.scene(", asymmetry = 0.6", "layers = ['effects', 'shadow']");
        let text =
            text.replace("[render]", "extinction_rgb = [0.1, 0.5, 2]\n[ambient]\ncolor = [0.5, 0.5, 0.5]\n[render]");
        let picture = draw(&text, &[]);
        for (channel, factor) in [("R", 0.1), ("G", 0.5), ("B", 2.0)] {
            let scattered = mean(&picture, &format!("scatter1.{channel}"));
            let ratio = scattered / (phase * slab.radiance(factor));
            assert!((ratio - 1.0).abs() < 0.02, "{technique}, {channel}: {ratio}");
            let sum = ["ambient", "emission", "direct", "scatter1"].map(|e| mean(&picture, &format!("{e}.{channel}")));
            let beauty = mean(&picture, channel);
            assert!((sum.iter().sum::<f64>() / beauty - 1.0).abs() < 1e-5, "{technique}, {channel}");
        }
    }
}

#[test]
fn two_lights_add_and_light_against_the_view_is_the_same_everywhere_in_a_slab() {
    for technique in ["points", "sheets"] {
        let slab = Slab { technique, tau: 0.7, view: 0.0, light: 0.0, azimuth: 0.0 };
        let above = slab.scene("", "");
        let against = above.replace("direction = [-0.0, -1.0, -0.0]", "direction = [0, 1, 0]");
        assert_ne!(above, against);
        // What scatters at any depth has all of the slab before it, in and out together: T·e^-T/4.
        let whole = LAYERS * slab.tau;
        let alone = draw(&against, &[]);
        let ratio = mean(&alone, "G") / (0.25 * whole * (-whole).exp());
        assert!((ratio - 1.0).abs() < 0.02, "{technique}: {ratio}");
        let second =
            format!("[[light]]\nkind = 'directional'\ndirection = [0, 1, 0]\nirradiance = [{PI:?}, {PI:?}, {PI:?}]\n");
        let both = draw(&above.replacen("[[object]]", &(second + "[[object]]"), 1), &[]);
        let sum = mean(&alone, "G") + mean(&draw(&above, &[]), "G");
        assert!((mean(&both, "G") / sum - 1.0).abs() < 1e-3, "{technique}");
    }
}

#[test]
fn slabs_are_bright_up_to_grazing_views_however_thick_a_spacing_is() {
    for (view, tau) in [(80.0, 4.0), (80.0, 14.0)] {
        let slab = Slab { technique: "points", tau, view, light: 60.0, azimuth: 90.0 };
        let ratio = mean(&draw(&slab.scene("", ""), &[]), "G") / slab.radiance(1.0);
        assert!((0.9..1.05).contains(&ratio), "view at {view}°, tau {tau}: {ratio}");
    }
}

/// A box of 64 layers of 7 optical depths each, lit aslant: light falls within its outermost layer.
#[test]
fn the_shadow_of_a_thick_box_on_itself_has_no_stripes() {
    let scene = |cells: &str| {
        format!(
            "version = 1\n[camera]\nposition = [7, 5, 8]\ntarget = [0, 0, 0]\nfov_y = 14\nsize = [96, 72]\n\
             [[light]]\nkind = 'directional'\ndirection = [0.274, -0.732, -0.623]\nirradiance = [3, 3, 3]\nshadow_cells = {cells}\n\
             [[object]]\nname = 'box'\nmaterial = 'box'\n\
             medium_box = {{ min = [-1, -1, -1], max = [1, 1, 1], extinction = 224, spacing = 0.03125 }}\n\
             [material.box]\nmedium = {{ albedo = 1 }}\n[render]\ntechnique = 'points'\n"
        )
    };
    let found = draw(&scene("").replace("shadow_cells = \n", ""), &[]).channel("G");
    let fine = draw(&scene("768"), &[]).channel("G");
    let square = found.iter().zip(&fine).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let brightest = fine.iter().copied().fold(0.0, f64::max);
    let rms = (square / fine.len() as f64).sqrt() / brightest;
    assert!(rms < 0.01, "{rms}");
}

fn warnings(text: &str) -> Vec<String> {
    let scene = parse(Path::new("s.toml"), text.as_bytes(), &LoadOptions::default()).unwrap();
    let warnings = organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap().warnings;
    // A slab fills the picture.
    warnings.into_iter().filter(|warning| !warning.contains("all of one colour")).collect()
}

#[test]
fn what_splats_cannot_tell_is_told_with_the_spacing_that_would_do() {
    let slab = |tau| Slab { technique: "points", tau, view: 0.0, light: 0.0, azimuth: 0.0 }.scene("", "");
    assert_eq!(warnings(&slab(14.0)), [""; 0]);
    let told = warnings(&slab(40.0));
    assert!(told.len() == 1 && told[0].contains("an optical depth of 40.000 in a spacing of 1"), "{told:?}");
    assert!(told[0].contains("spacing = 0.4 tells"), "{told:?}");
    let by_sheets = |tau| Slab { technique: "sheets", tau, view: 0.0, light: 0.0, azimuth: 0.0 }.scene("", "");
    assert_eq!(warnings(&by_sheets(4.0)), [""; 0]);
    let told = warnings(&by_sheets(8.0));
    assert!(told.len() == 1 && told[0].contains("by which `sheets` shows dark frames along its edges"), "{told:?}");
    assert!(told[0].contains("spacing = 0.5 tells"), "{told:?}");
    let lone = |extinction: f64| {
        let [text, rest] = [0, 1].map(|part| slab(1.0).split("medium_box").nth(part).unwrap().to_owned());
        let (_, rest) = rest.split_once('\n').unwrap();
        let ball =
            format!("medium_box = {{ min = [0, 0, 0], max = [1, 1, 1], extinction = {extinction:?}, spacing = 1 }}\n");
        warnings(&(text + &ball + rest))
    };
    assert_eq!(lone(0.2), Vec::<String>::new());
    let told = lone(2.0);
    assert!(told.len() == 1 && told[0].contains("is no wider than that: spacing = 0.125 tells"), "{told:?}");
}
