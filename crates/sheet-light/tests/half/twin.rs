//! Bands, buckets, bounds, lanes and closed forms of light against the slow form in f64.

use super::common::{draw, exact, half_forms, input, lamp, scattering, sun};
use super::polygons::{polygons, wall, white};
use super::splats::{Shown, lambert, plane, with};
use crate::common::{BEAUTY, cubic, grid, noise, parallel, perspective, transfer, unlit, volume};
use sheet_light::half::{HalfInput, HalfParams, Scattering, fold, reference};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Accumulator, Camera, Cloud, Light, Material, Packing, Splat, SplatKind, rng};

/// Greatest differences from the twin, in all forms that sheets of the volumes have: optical depth, colour times 4π.
pub(crate) fn differences(input: &HalfInput<'_>, params: &HalfParams) -> [f64; 2] {
    let is_cartesian = input.sheets.volumes.iter().all(|volume| volume.packing == Packing::Cartesian);
    let forms = half_forms(params).into_iter().take(if is_cartesian { 3 } else { 1 });
    let each = forms.enumerate().map(|(form, params)| {
        let found = differences_of_form(input, &params);
        println!("form {form}: {:e} {:e}", found[0], found[1]);
        found.map(|difference| if form == 1 { difference / STEEPER } else { difference })
    });
    each.fold([0.0; 2], |worst, form| [worst[0].max(form[0]), worst[1].max(form[1])])
}

/// How much more rounding of places may do to what is gathered linearly: noise is blurred less, so that its values are steeper.
const STEEPER: f64 = 4.0;

/// Greatest differences from the twin: optical depth, colour times 4π.
pub(crate) fn differences_of_form(input: &HalfInput<'_>, params: &HalfParams) -> [f64; 2] {
    let (found, counts) = draw(input, params).unwrap();
    let twin = reference::draw(input, params).unwrap();
    let mut worst = [0.0f64; 2];
    for (at, expected) in twin.optical_depth.iter().enumerate() {
        worst[0] = worst[0].max((f64::from(found.optical_depth[0][at]) - expected).abs());
        for c in 0..3 {
            let difference = f64::from(found.channels[c][at]) - twin.color[at][c];
            worst[1] = worst[1].max(difference.abs() * 4.0 * std::f64::consts::PI);
        }
    }
    let seen = twin.optical_depth.iter().filter(|t| **t > 0.01).count();
    assert!(seen > 100 && counts.eye_fragments > 0 && counts.light_fragments > 0, "{seen} pixels show anything");
    worst
}

#[test]
fn hv_lit_sheets_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = scattering();
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.2, 0.6, -0.1), DVec3::new(-0.1, 0.1, -0.7));
    let bright = |at: [f64; 3]| {
        let mut lit = lamp(at);
        lit.light = Light { intensity: [100.0; 3], ..lit.light };
        lit
    };
    for axes in [cubic(0.5), sheared] {
        let grid = grid([8, 7, 6], axes, noise);
        let volumes = [volume(&grid, &tf, &material)];
        for camera in [parallel([3.0, 2.0, 8.0], 7.0, [28, 20]), perspective([2.0, 3.0, 8.0], 40.0, [20, 28])] {
            let suns = [sun([1.0, 3.0, 2.0]), sun([-1.0, 2.0, -3.0])];
            for (light, slab_width) in
                [(suns[0], None), (suns[1], Some(0.3)), (suns[0], Some(1.3)), (suns[1], Some(9.0))]
            {
                let [tau, color] = differences(&input(&volumes, &camera, &[light]), &exact(slab_width));
                assert!(tau < 2e-5 && color < 5e-5, "{slab_width:?}, {:?}: {tau:e} {color:e}", light.light.shape);
            }
            // Where view and light are at right angles two sweeps are mixed.
            let [tau, color] = differences(&input(&volumes, &camera, &[sun([8.0, 0.1, -3.0])]), &exact(None));
            assert!(tau < 2e-5 && color < 5e-5, "at a right angle: {tau:e} {color:e}");
            // On the way through a slab optical depth towards a lamp is curved, where its light grazes a face most.
            for (light, slab_width) in [(bright([6.0, 8.0, 2.0]), Some(0.2)), (bright([-4.0, 3.0, -9.0]), None)] {
                let [tau, color] = differences(&input(&volumes, &camera, &[light]), &exact(slab_width));
                assert!(tau < 2e-5 && color < 5e-4, "{slab_width:?}, {:?}: {tau:e} {color:e}", light.light.shape);
            }
        }
    }
}

#[test]
fn hv_volumes_that_overlap_shadow_each_other_as_in_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.7, 0.9)]);
    let other_tf = transfer(&[(300.0, 0.0), (900.0, 0.5), (1000.0, 0.0)]);
    let plain = scattering();
    let glowing = Material { emission: [0.02, 0.0, 0.1], ..unlit() };
    let one = grid([9, 7, 6], cubic(0.5), noise);
    let mut two = grid([5, 6, 5], cubic(0.6), |p| 1000.0 * noise(p));
    two.origin += DVec3::new(1.0, 0.3, 0.8);
    let volumes = [volume(&one, &tf, &plain), volume(&two, &other_tf, &glowing)];
    let camera = perspective([2.0, 3.0, 9.0], 40.0, [24, 24]);
    for light in [sun([1.0, 3.0, 2.0]), sun([2.0, 1.0, -3.0])] {
        let [tau, color] = differences(&input(&volumes, &camera, &[light]), &exact(Some(0.1)));
        assert!(tau < 2e-5 && color < 2e-4, "{:?}: {tau:e} {color:e}", light.light.shape);
    }
}

#[test]
fn ms_scattered_light_is_that_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.8), (0.8, 0.1), (0.9, 4.0)]);
    let grid = grid([16, 14, 12], cubic(0.5), noise);
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [24, 20]);
    let bright = {
        let mut lit = lamp([6.0, 8.0, 9.0]);
        lit.light = Light { intensity: [200.0, 100.0, 50.0], ..lit.light };
        lit
    };
    for (k, (asymmetry, albedo)) in [(0.85, 1.0), (0.0, 0.7), (-0.4, 1.0)].into_iter().enumerate() {
        let material = Material { asymmetry, single_scattering_albedo: albedo, ..scattering() };
        let volumes = [volume(&grid, &tf, &material)];
        for (l, light) in [sun([1.0, 3.0, 2.0]), sun([-1.0, 2.0, -3.0]), bright].into_iter().enumerate() {
            // Every light meets both, and every medium does.
            let mode = [Scattering::Forward, Scattering::ForwardAndBack][(k + l) % 2];
            let once = exact(Some(0.4));
            let params = HalfParams { scattering: mode, voxels_per_cell: 12, ..once };
            let lights = [light];
            let input = input(&volumes, &camera, &lights);
            let [tau, color] = differences(&input, &params);
            assert!(tau < 2e-5 && color < 5e-4, "{mode:?}, g {asymmetry}, {:?}: {color:e}", light.light.shape);
            let [one, more] = [once, params].map(|params| draw(&input, &params).unwrap().0);
            let seen = |out: &splat_core::Accumulator| out.channels[1].iter().sum::<f32>();
            assert!(seen(&more) > 1.01 * seen(&one), "{mode:?}, g {asymmetry}: nothing was scattered again");
        }
    }
}

/// A slanted layer of discs, and a cloud of a medium beside it and before it, some of which cast no shadow.
fn discs_and_matter(camera: &Camera) -> Shown {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let at = (DVec3::new(0.4, -0.2, 0.5), DVec3::new(0.3, 0.5, 1.0).normalize());
    plane(&mut cloud, at, 1.2, 0.7, &Splat::default());
    for n in 0..60 {
        let side = |a: u64| (rng::unit(11, a, n, 0) - 0.5) as f32;
        let position = [3.0 * side(0), 3.0 * side(1), 2.5 * side(2) + 0.5].into();
        let radius = 0.45;
        let cross_section = 0.12;
        let kind = SplatKind::Medium;
        let object = 1 + (n % 2) as u32;
        let material = 1;
        cloud.push(&Splat { position, radius, cross_section, kind, object, material, ..Splat::default() });
    }
    let medium = Material { asymmetry: 0.3, extinction_rgb: [1.0; 3], ..scattering() };
    let mut shown = Shown::new(cloud, camera, vec![lambert(), medium], 0.2);
    shown.objects[2].casts_shadow = false;
    shown.objects[1].shadow_coefficient = 0.6;
    shown
}

#[test]
fn hv_splats_among_volumes_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = scattering();
    let grid = grid([8, 7, 6], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let mut bright = lamp([6.0, 8.0, 7.0]);
    bright.light = Light { intensity: [100.0; 3], ..bright.light };
    for camera in [parallel([3.0, 2.0, 8.0], 5.0, [26, 22]), perspective([2.0, 3.0, 8.0], 35.0, [22, 26])] {
        let shown = discs_and_matter(&camera);
        for volumes in [&volumes[..], &[]] {
            for (light, slab_width) in
                [(sun([1.0, 3.0, 2.0]), None), (sun([-1.0, 2.0, -3.0]), Some(0.3)), (bright, Some(0.4))]
            {
                let lights = [light];
                let scene = with(&shown, input(volumes, &camera, &lights));
                let [tau, color] = differences(&scene, &exact(slab_width));
                let what = (volumes.len(), slab_width, light.light.shape);
                assert!(tau < 1e-5 && color < 2e-4, "{what:?}: {tau:e} {color:e}");
            }
        }
    }
}

#[test]
fn hv_polygons_among_volumes_are_those_of_the_twin_but_at_the_edges_of_shadows() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.5), (1.2, 0.1), (1.5, 1.0)]);
    let medium = scattering();
    let material = white();
    let field = |p: DVec3| (1.3 * p.x).sin() + (0.9 * p.y + p.z).cos() + 0.2 * p.z;
    let grid = grid([8, 7, 6], cubic(0.5), field);
    let volumes = [volume(&grid, &tf, &medium)];
    let floor = wall([0.0, -1.3, 0.0], [2.5, 0.1, 0.0], [0.0, 0.1, -2.5]);
    let pane = wall([-0.4, 0.3, 0.4], [0.5, 0.2, 0.1], [0.1, -0.1, 0.6]);
    let all = [polygons(&floor, &material), polygons(&pane, &material)];
    let mut bright = lamp([3.0, 8.0, 5.0]);
    bright.light = Light { intensity: [80.0; 3], ..bright.light };
    for camera in [parallel([3.0, 4.0, 8.0], 5.0, [40, 36]), perspective([2.0, 5.0, 8.0], 38.0, [36, 40])] {
        for (light, slab_width) in [(sun([1.0, 3.0, 2.0]), None), (bright, Some(0.3))] {
            let lights = [light];
            let scene = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
            let params = HalfParams { most_light_pixels: 1024, ..exact(slab_width) };
            let mut out = Accumulator::new(camera.size, 1, 3, false, false);
            let drawn = fold(&scene, &params, &BEAUTY, &mut out, None).unwrap();
            let twin = reference::draw(&scene, &params).unwrap();
            let behind = &drawn.polygons.channels[1];
            let mut apart = Vec::new();
            let mut shown = 0;
            for (at, expected) in twin.color.iter().enumerate() {
                let tau = f64::from(out.optical_depth[0][at]);
                // At the edges of polygons one form sees them, the other does not.
                if (tau - twin.optical_depth[at]).abs() < 1e-3 {
                    let color = f64::from(out.channels[1][at]) + (-tau).exp() * f64::from(behind[at]);
                    apart.push((color - expected[1]).abs());
                    shown += usize::from(behind[at] > 0.05);
                }
            }
            let size = apart.len();
            apart.sort_by(f64::total_cmp);
            // A white wall in full light shows 1/π. Edges of shadows are pixels of the light's z-buffer.
            let most = apart[size * 97 / 100];
            let edges = apart.iter().filter(|d| **d > 2e-3).count();
            assert!(shown > 200 && size > twin.color.len() * 98 / 100, "{shown} pixels of polygons, {size} in all");
            let worst = apart[size - 1];
            assert!(most < 1e-5 && edges < 6, "{:?}: {most:e}, {edges} edges, {worst:e}", light.light.shape);
        }
    }
}
