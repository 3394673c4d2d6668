//! Closed forms through the whole command, scene file in, EXR out: slabs, shadows of slabs, crossed planes, a ball.

use organza_tests::{draw, mean_and_ripple, parallel_view, window};
use splat_core::Footprint;

/// A slab of thickness ½ and optical depth `tau` along z.
fn slab(tau: f64, footprint: usize) -> String {
    format!(
        "{}[[object]]\nname = 'slab'\nfootprint = {footprint}\n\
         medium_box = {{ min = [-2, -2, -0.25], max = [2, 2, 0.25], extinction = {:?}, spacing = 0.05 }}\n",
        parallel_view(2.0, 96),
        tau / 0.5
    )
}

#[test]
fn slab_has_the_transmittance_of_its_optical_depth() {
    // Ripple falls with the cutoff: footprint 0 ends at 3 σ, footprint 2 at 5 σ.
    for (footprint, most) in [(0, 1e-3), (2, 1e-5)] {
        for tau in [0.01f64, 1.0, 5.0] {
            let picture = draw(&slab(tau, footprint), &[]);
            let alpha = window(&picture.opacity(), 96, 24..72, 24..72);
            let (mean, ripple) = mean_and_ripple(&alpha);
            let error = (1.0 - mean - (-tau).exp()).abs();
            assert!(error < 1e-5, "τ {tau}, footprint {footprint}: mean off by {error:e}");
            assert!(ripple <= most, "τ {tau}, footprint {footprint}: ripple {ripple:e}");
        }
    }
}

#[test]
fn slab_in_perspective_follows_the_length_of_its_rays() {
    let text = slab(1.0, 0).replace("orthographic = 2.0", "fov_y = 30");
    let picture = draw(&text, &[]);
    let alpha = picture.opacity();
    let focal = 48.0 / 15f64.to_radians().tan();
    for y in 10..86u32 {
        for x in 10..86u32 {
            let u = (f64::from(x) - 47.5) / focal;
            let v = (f64::from(y) - 47.5) / focal;
            let exact = 1.0 - (-(1.0 + u * u + v * v).sqrt()).exp();
            let error = (alpha[(y * 96 + x) as usize] - exact).abs();
            assert!(error < 1e-3, "pixel {x} {y}: {error:e}");
        }
    }
}

/// A slab, cut as `clip` says, between a slanted directional light and a wall.
fn shadow(tau: f64, cells: &str, clip: &str) -> (f64, f64) {
    let text = format!(
        "{}[render]\ntechnique = 'points'\nlayers = ['shadow']\n{cells}\n\
         [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
         [[object]]\nname = 'slab'\n\
         medium_box = {{ min = [-3, 0.8, 0.5], max = [3, 5, 0.9], extinction = {:?}, spacing = 0.05 }}\n{clip}\n\
         [[object]]\nname = 'wall'\n\
         rectangle = {{ center = [0, 0, -1], u = [1.5, 0, 0], v = [0, 1.5, 0], spacing = 0.04 }}\n",
        parallel_view(2.0, 96),
        tau / (0.4 * 2f64.sqrt())
    );
    let picture = draw(&text, &[]);
    mean_and_ripple(&window(&picture.channel("shadow.A"), 96, 24..72, 24..72))
}

#[test]
fn shadow_of_a_slab_has_the_transmittance_of_its_optical_depth() {
    for tau in [0.01f64, 1.0, 5.0] {
        let (mean, ripple) = shadow(tau, "", "");
        let error = (mean - (-tau).exp()).abs();
        assert!(error < 1e-4, "τ {tau}: mean off by {error:e}");
        assert!(ripple <= 1e-2, "τ {tau}: ripple {ripple:e}");
    }
    let (mean, _) = shadow(2.0, "", "clip = [{ normal = [0, 0, -1], point = [0, 0, 0.67] }]");
    let error = (mean - (-2.0 * 0.23 / 0.4f64).exp()).abs();
    assert!(error < 1e-4, "cut: mean off by {error:e}");
}

#[test]
fn ripple_of_a_shadow_falls_with_the_size_of_its_table() {
    let ripple = |cells: u32| shadow(1.0, &format!("shadow = {{ cells = {cells} }}"), "").1;
    let coarse = ripple(48);
    let fine = ripple(192);
    assert!(fine < coarse && fine < 1e-2, "48 cells {coarse:e}, 192 cells {fine:e}");
}

#[test]
fn crossed_planes_show_four_regions_in_order() {
    // Red from upper left, green from lower left; they cross where x = 0 and overlap where |y| < 0.4.
    let plane = |name: &str, y: f64, slope: f64, color: &str, opacity: f64| {
        format!(
            "[material.{name}]\nshading = 'unlit'\ncolor = {color}\nopacity = {opacity}\n\
             [[object]]\nname = '{name}'\nmaterial = '{name}'\n\
             rectangle = {{ center = [0, {y:?}, 0], u = [1, 0, {slope:?}], v = [0, 0.7, 0], spacing = 0.02 }}\n"
        )
    };
    let a = 0.6;
    let b = 0.3;
    let text =
        parallel_view(2.4, 120) + &plane("red", 0.3, 0.5, "[1, 0, 0]", a) + &plane("green", -0.3, -0.5, "[0, 1, 0]", b);
    let picture = draw(&text, &[]);
    let red = picture.channel("R");
    let green = picture.channel("G");
    let region = |x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
        (window(&red, 120, x.clone(), y.clone()), window(&green, 120, x, y))
    };
    // 50 pixels a unit; a splat reaches 0.048. On the right red is nearer, on the left green.
    let left = 18..57;
    let right = 63..102;
    for (name, x, y, expected) in [
        ("red alone", 18..102, 16..34, (a, 0.0)),
        ("green alone", 18..102, 86..104, (0.0, b)),
        ("green before red", left, 46..74, (a * (1.0 - b), b)),
        ("red before green", right, 46..74, (a, b * (1.0 - a))),
    ] {
        let (r, g) = region(x, y);
        for (values, exact) in [(&r, expected.0), (&g, expected.1)] {
            let (mean, ripple) = mean_and_ripple(values);
            assert!((mean - exact).abs() < 1e-3, "{name}: mean {mean}, expected {exact}");
            // The two orders differ by 0.18, so every single pixel shows which one it has.
            assert!(ripple < 0.01, "{name}: ripple {ripple:e}");
        }
    }
}

/// Projection of a ball of radius 1 convolved with a footprint of radius `reach` and with a lattice cell of side `cell`,
/// at distance `rho` from the centre.
fn convolved_chord(rho: f64, reach: f64, cell: f64) -> f64 {
    let footprint = Footprint::default();
    let chord = |x: f64, y: f64| 2.0 * (1.0 - x * x - y * y).max(0.0).sqrt();
    // The cell spreads like two samples a side at ±cell/√12.
    let side = cell / 12f64.sqrt();
    let mut sum = 0.0;
    let mut total = 0.0;
    const N: i32 = 60;
    for i in -N..=N {
        for j in -N..=N {
            let x = f64::from(i) / f64::from(N) * reach;
            let y = f64::from(j) / f64::from(N) * reach;
            let w = footprint.profile((x * x + y * y) / (reach * reach));
            total += w;
            for (dx, dy) in [(-side, -side), (-side, side), (side, -side), (side, side)] {
                sum += 0.25 * w * chord(rho + x + dx, y + dy);
            }
        }
    }
    sum / total
}

#[test]
fn ball_has_the_chord_convolved_with_its_kernel() {
    let spacing = 0.05;
    let extinction = 1.5;
    let text = format!(
        "{}[render]\nantialias = 1\npoints = {{ resampling_filter = false }}\n[[object]]\nname = 'ball'\n\
         medium_ball = {{ center = [0, 0, 0], radius = 1, extinction = {extinction:?}, spacing = {spacing:?} }}\n",
        parallel_view(2.6, 96)
    );
    let picture = draw(&text, &[]);
    let alpha = picture.opacity();
    let reach = f64::from(Footprint::default().radius_for_spacing(spacing as f32));
    let mut errors = Vec::new();
    let mut inside = 0.0f64;
    let mut rim = 0.0f64;
    for y in 0..96u32 {
        for x in (0..96u32).filter(|x| (x + y) % 5 == 0) {
            let at = |p: u32| (f64::from(p) - 47.5) * 2.6 / 96.0;
            let tau = extinction * convolved_chord(at(x).hypot(at(y)), reach, spacing);
            let error = alpha[(y * 96 + x) as usize] - (1.0 - (-tau).exp());
            // A lattice cannot follow the rim, where the chord has a vertical tangent.
            let largest = if at(x).hypot(at(y)) < 0.9 { &mut inside } else { &mut rim };
            *largest = largest.max(error.abs());
            errors.push(error);
        }
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean.abs() < 1e-5, "mean error {mean:e}");
    assert!(inside < 1e-3, "largest error inside {inside:e}");
    assert!(rim < 1e-2, "largest error at the rim {rim:e}");
}

#[test]
fn fig_10_the_first_slices_alone_are_the_farthest_part() {
    // Ten lattice layers, ten slices; the first five from the back hold half of the optical depth.
    let text = slab(1.0, 0)
        + "[render]\npoints = { direction = 'back_to_front', slice_thickness = 0.0499, first_slices = 5 }\n";
    let alpha = window(&draw(&text, &[]).opacity(), 96, 24..72, 24..72);
    let (mean, _) = mean_and_ripple(&alpha);
    assert!((1.0 - mean - (-0.5f64).exp()).abs() < 1e-5, "mean {mean}");
    let depth = draw(&(text.replace("'back_to_front'", "'front_to_back'")), &["--layers", "depth"]);
    let (nearest, _) = mean_and_ripple(&window(&depth.channel("depth.mean.Z"), 96, 24..72, 24..72));
    assert!((nearest - (5.0 - 0.125)).abs() < 0.02, "front to back the first slices are the near half: {nearest}");
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    /// A border across cells, and one beside all that is seen.
    #[test]
    fn what_a_cut_leaves_of_a_slab_and_a_ball_has_its_optical_depth_by_every_technique() {
        let clip =
            "clip = [{ normal = [0, 0, 2], point = [9, 0, 0.0875] }, { box = [[-1.5, -1.5, -9], [1.5, 1.5, 9]] }]\n";
        let ball = format!(
            "{}[[object]]\nname = 'ball'\n\
             medium_ball = {{ center = [0, 0, 0], radius = 8, extinction = 0.25, spacing = 0.4 }}\n",
            parallel_view(2.0, 96)
        );
        // Of a ball so large its chord hardly differs among the pixels; cells at its rim count by samples.
        let chord = |at: usize| {
            let [x, y] = [at % 48, at / 48].map(|k| (k as f64 - 23.5) / 48.0);
            (64.0 - x * x - y * y).sqrt() + 0.0875
        };
        let through: f64 = (0..48 * 48).map(|at| (-0.25 * chord(at)).exp()).sum::<f64>() / (48.0 * 48.0);
        let cases = [(slab(2.0, 0), (-4.0 * 0.3375f64).exp(), 0.0, "the slab"), (ball, through, 1e-3, "the ball")];
        for (text, exact, least, what) in cases {
            for (technique, most) in [("points", 2e-5), ("reference", 2e-5), ("sheets", 1e-3), ("particles", 4e-3)] {
                // Most of so large a ball lies beside the picture.
                if technique == "particles" && least > 0.0 {
                    continue;
                }
                let picture = draw(&format!("{text}{clip}[render]\ntechnique = '{technique}'\n"), &[]);
                let (mean, _) = mean_and_ripple(&window(&picture.opacity(), 96, 24..72, 24..72));
                let error = (1.0 - mean - exact).abs();
                assert!(error < f64::max(most, least), "{technique}: {what} is off by {error:e}");
            }
        }
    }
}
