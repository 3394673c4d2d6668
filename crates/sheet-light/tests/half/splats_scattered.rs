//! Translucent surfaces beside light that media scatter again and again: what they take of it, and what they show of it.

use super::common::{exact, input, scattering, sun};
use super::paths::{Block, trace_with};
use super::splats::{Shown, with};
use crate::common::{constant, cubic, grid, parallel, volume};
use sheet_light::Volume;
use sheet_light::half::{HalfParams, Scattering, balance, fold};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::shade::ChannelLayout;
use splat_core::{
    Accumulator, Camera, Cloud, Footprint, LayerSet, Material, Shading, Splat, SplatKind, TransferFunction,
    TransferPoint,
};
use std::f64::consts::PI;

/// Effects apart, `scatterN` among them, and its first channel.
const APART: ChannelLayout =
    ChannelLayout::new(&LayerSet { effects: true, shadow: false, normal: false, depth: false, object: false })
        .with_multiple();
const MORE: usize = 12;

fn params(voxels_per_cell: u32) -> HalfParams {
    let scattering = Scattering::ForwardAndBack;
    HalfParams { scattering, voxels_per_cell, most_light_pixels: 256, ..exact(Some(0.05)) }
}

/// Gives off and reflects nothing.
fn black() -> Material {
    Material { shading: Shading::Unlit, ..Material::default() }
}

/// Discs `step` apart in a square across z, `half` to each side: τ for each crossing.
fn pane(z: f64, (half, step): (f64, f64), tau: f64, color: [f32; 3]) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let n = (half / step) as i32;
    for (i, j) in (-n..=n).flat_map(|i| (-n..=n).map(move |j| (i, j))) {
        cloud.push(&Splat {
            position: DVec3::new(step * f64::from(i), step * f64::from(j), z).as_vec3(),
            normal: Vec3::Z,
            radius: (step * f64::from(Footprint::SIGMA_OVER_SPACING * Footprint::default().cutoff)) as f32,
            cross_section: (tau * step * step) as f32,
            kind: SplatKind::Surface,
            color,
            ..Splat::default()
        });
    }
    cloud
}

/// The middle pixel of scattered light of a slab of τ 2 between z = ±2, lit along −z, beside splats.
fn middle(shown: Option<&Shown>, camera: &Camera) -> [f64; 3] {
    middle_beside(&[], shown, camera)
}

/// The same beside other volumes.
fn middle_beside(others: &[Volume<'_>], shown: Option<&Shown>, camera: &Camera) -> [f64; 3] {
    let slab = grid([48, 48, 8], cubic(0.5), |_| 1.0);
    let tf = constant(0.5);
    let medium = scattering();
    let lights = [sun([0.0, 0.0, 1.0])];
    let volumes: Vec<Volume<'_>> = [volume(&slab, &tf, &medium)].into_iter().chain(others.iter().copied()).collect();
    let plain = input(&volumes, camera, &lights);
    let input = shown.map_or_else(|| plain.clone(), |shown| with(shown, plain.clone()));
    let mut out = Accumulator::new(camera.size, 3, APART.count(), false, false);
    fold(&input, &params(1), &APART, &mut out, None).unwrap();
    let at = (camera.size[1] / 2 * camera.size[0] + camera.size[0] / 2) as usize;
    [0, 1, 2].map(|c| f64::from(out.channels[MORE + c][at]))
}

#[test]
fn a_pane_before_a_medium_tints_what_it_scatters_and_one_behind_it_changes_nothing() {
    // The eye is behind the slab where the pane is before it.
    let tinted = Material { extinction_rgb: [0.5, 1.0, 2.0], ..black() };
    for (z, eye, tau) in [(5.0, -12.0, 0.7), (-5.0, 12.0, 0.0)] {
        let camera = parallel([0.0, 0.0, eye], 2.0, [9, 9]);
        let shown = Shown::new(pane(z, (15.0, 0.25), 0.7, [0.0; 3]), &camera, vec![tinted], 0.1);
        let plain = middle(None, &camera);
        let found = middle(Some(&shown), &camera);
        for (c, factor) in [0.5f64, 1.0, 2.0].into_iter().enumerate() {
            let expected = plain[c] * (-tau * factor).exp();
            assert!(plain[c] > 0.01 && (found[c] / expected - 1.0).abs() < 0.01, "{z}: {found:?}, without {plain:?}");
        }
    }
    // One that casts no shadow takes none.
    let camera = parallel([0.0, 0.0, -12.0], 2.0, [9, 9]);
    let mut shown = Shown::new(pane(5.0, (15.0, 0.25), 0.7, [0.0; 3]), &camera, vec![tinted], 0.1);
    shown.objects[0].casts_shadow = false;
    let plain = middle(None, &camera);
    let found = middle(Some(&shown), &camera);
    assert!((0..3).all(|c| (found[c] / plain[c] - 1.0).abs() < 1e-6), "{found:?}, without {plain:?}");
}

#[test]
fn a_pane_in_a_medium_lets_through_what_paths_do() {
    let slab = grid([192, 192, 8], cubic(0.5), |_| 1.0);
    let medium = scattering();
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    for (tau, passing) in [(1.0, 0.4f64), (4.0, 0.1)] {
        let tf = constant((tau / 4.0) as f32);
        let volumes = [volume(&slab, &tf, &medium)];
        let lights = [sun([0.0, 0.0, 1.0])];
        let shown = Shown::new(pane(0.01, (56.0, 1.0), -passing.ln(), [0.0; 3]), &camera, vec![black()], 0.1);
        let found = balance(&with(&shown, input(&volumes, &camera, &lights)), &params(4), 0).unwrap();
        let share = |v: [f64; 3]| v[1] / found.incident[1];
        let paths = Block { width: f64::INFINITY, depth: tau, albedo: 1.0, asymmetry: 0.0 };
        let [back, through, _] = trace_with(&paths, (0.5 * tau, passing), 40_000, 5);
        let own_back = share(found.reflected);
        let own_through = share(found.transmitted);
        println!(
            "τ {tau}, {passing}: {own_back:.4} {own_through:.4}, paths {back:.4} {through:.4}, sides {:.4}",
            share(found.sides)
        );
        assert!(found.missing().iter().all(|m| m.abs() < 1e-5), "{found:?}");
        assert!((own_back - back).abs() < 0.04 && (own_through - through).abs() < 0.04, "{found:?}");
    }
}

/// By side of the eye: what a white Lambert surface of no thickness shows there in the middle of the slab, over the opacity of it. Half of the fluence and of the
/// net flux of two streams, ψ and J at an optical depth of 1 of 2.
fn on_either_side() -> [(f64, f64); 2] {
    let tau = 2.0f64;
    let first = (1.5 * tau + 0.5 * (-tau).exp_m1()) / (2.0 + 1.5 * tau);
    let psi = first - 1.5 * ((1.0 - first) + (-1f64).exp_m1());
    let net = 1.0 - first - (-1f64).exp();
    [(12.0, 0.5 * (psi + net)), (-12.0, 0.5 * (psi - net))]
}

fn lambert() -> Material {
    Material { ambient: 0.0, diffuse: 1.0, specular: 0.0, ..Material::default() }
}

#[test]
fn a_thin_pane_shows_what_the_medium_scatters_to_either_side_of_it() {
    // Slabs are thin, for what shares one with the medium is seen through half of it.
    let lambert = lambert();
    for (eye, expected) in on_either_side() {
        let camera = parallel([0.0, 0.0, eye], 2.0, [9, 9]);
        let radiance = |color: [f32; 3]| {
            let shown = Shown::new(pane(0.0, (15.0, 0.25), 0.05, color), &camera, vec![lambert], 0.1);
            middle(Some(&shown), &camera)[1]
        };
        // Of a white one more than of a black one, behind half of the slab.
        let found = PI * (radiance([1.0; 3]) - radiance([0.0; 3])) / (-(-0.05f64).exp_m1() * (-1f64).exp());
        assert!((found - expected).abs() < 0.03, "eye {eye}: {found}, not {expected}");
    }
}

#[test]
fn volumes_that_reflect_about_their_gradient_show_what_the_medium_scatters_as_a_thin_pane_does() {
    let tau = 0.005f64;
    let material = lambert();
    for (eye, expected) in on_either_side() {
        let camera = parallel([0.0, 0.0, eye], 2.0, [9, 9]);
        // Values fall towards the eye. What it takes of the light is lost to the medium: as little as can be told.
        let thin = grid([48, 48, 4], DMat3::from_diagonal(DVec3::new(0.5, 0.5, 0.05)), |p| -p.z * eye);
        let radiance = |color: [f32; 3]| {
            let point = TransferPoint { value: 0.0, color, extinction: (tau / 0.2) as f32 };
            let tf = TransferFunction::new(vec![point]).unwrap();
            let facets = Volume { normals: true, ..volume(&thin, &tf, &material) };
            middle_beside(&[facets], None, &camera)[1]
        };
        let found = PI * (radiance([1.0; 3]) - radiance([0.0; 3])) / (-(-tau).exp_m1() * (-1f64).exp());
        println!("eye {eye}: {found}, {expected}");
        assert!((found - expected).abs() < 0.03, "eye {eye}: {found}, not {expected}");
    }
}
