//! Volumes that are cut along planes, and body-centred lattices: closed forms, the slow form, and what slabs across the view show of them.

use super::common::{draw, exact, half_forms, input, inside, ray, scattering, sun};
use super::twin::differences;
use crate::common::{
    bcc_volume, body_centred, constant, cubic, grid, largest, noise, parallel, perspective, transfer, volume,
};
use sheet_light::Volume;
use sheet_light::half::{HalfParams, Scattering};
use splat_core::glam::{DQuat, DVec3};
use splat_core::{Camera, Clip, DAabb, Grid, LightShape, Similarity};
use std::f64::consts::PI;

fn oblique() -> Clip {
    Clip::HalfSpace { normal: DVec3::new(0.5, -1.0, -0.5), offset: 0.6 }
}

/// What a ray has of a lattice's cells before all planes of some regions.
fn kept(grid: &Grid, clip: &[Clip], from: DVec3, along: DVec3) -> Option<[f64; 2]> {
    let [mut near, mut far] = inside(grid, from, along)?;
    for (normal, offset) in clip.iter().flat_map(Clip::half_spaces) {
        let left = offset - normal.dot(from);
        let leaves = normal.dot(along);
        if leaves > 0.0 { far = far.min(left / leaves) } else { near = near.max(left / leaves) }
    }
    (far > near).then_some([near, far])
}

/// Greatest differences from the closed form of a constant volume: transmittance, and light that is scattered once, times 4π.
fn apart(clip: &[Clip], from: [f64; 3], camera: &Camera, params: &HalfParams) -> [f64; 2] {
    let grid = grid([20, 16, 12], cubic(0.25), |_| 5.0);
    let sigma = 0.4f64;
    let tf = constant(sigma as f32);
    let material = scattering();
    let light = sun(from);
    let volumes = [Volume { clip, ..volume(&grid, &tf, &material) }];
    let forms = half_forms(params).map(|params| draw(&input(&volumes, camera, &[light]), &params).unwrap().0);
    let LightShape::Directional { direction } = light.light.shape else { panic!("the sun") };
    let mut worst = [0.0f64; 2];
    let mut cut = 0;
    for at in (0..forms[0].optical_depth[0].len()).step_by(7) {
        let (from, along) = ray(camera, at % 40, at / 40);
        let Some([near, far]) = kept(&grid, clip, from, along) else { continue };
        cut += usize::from(inside(&grid, from, along).is_some_and(|[n, f]| f - n > far - near + 1e-6));
        let through = (-sigma * (far - near)).exp();
        let n = 2000;
        let step = (far - near) / f64::from(n);
        let lit = |i: i32| {
            let t = (f64::from(i) + 0.5) * step;
            let way = kept(&grid, clip, from + along * (near + t), -direction).map_or(0.0, |[_, far]| far.max(0.0));
            sigma * step * (-sigma * (t + way)).exp()
        };
        let expected: f64 = (0..n).map(lit).sum();
        for out in &forms {
            worst[0] = worst[0].max(((-f64::from(out.optical_depth[0][at])).exp() - through).abs());
            worst[1] = worst[1].max((f64::from(out.channels[0][at]) * 4.0 * PI - expected).abs());
        }
    }
    assert!(cut > 8, "{cut} pixels are cut");
    worst
}

#[test]
fn rays_of_the_eye_and_of_light_end_at_planes_and_boxes() {
    let boxed = Clip::Box(DAabb::new(DVec3::new(-1.9, -0.3, -9.0), DVec3::new(1.3, 1.1, 0.4)));
    let across = Clip::HalfSpace { normal: DVec3::Z, offset: 0.3 };
    for clip in [vec![across], vec![oblique()], vec![boxed], vec![oblique(), boxed]] {
        for camera in [parallel([3.0, 4.0, 12.0], 8.0, [40, 30]), perspective([1.0, 2.0, 6.0], 60.0, [40, 30])] {
            for from in [[1.0, 3.0, 2.0], [-1.0, 2.0, -3.0]] {
                // Where light comes in through another face in the midst of a slab it is followed in four steps.
                for (width, most) in [(0.05, 1e-4), (0.3, 3e-3)] {
                    let [through, scattered] = apart(&clip, from, &camera, &exact(Some(width)));
                    let what = format!("{} regions from {from:?}, slabs {width}", clip.len());
                    println!("{what}: {through:e} {scattered:e}");
                    assert!(through < 2e-5 && scattered < most, "{what}: {through:e} {scattered:e}");
                }
            }
        }
    }
}

/// A slab of τ 1 that is cut to 0.65 is one of 0.65, for the eye, for light that comes from there and for light that comes from behind.
#[test]
fn a_slab_that_is_cut_is_a_thinner_one() {
    let grid = grid([40, 40, 8], cubic(0.25), |_| 1.0);
    let tf = constant(0.5);
    let material = scattering();
    let clip = [Clip::HalfSpace { normal: DVec3::Z, offset: 0.3 }];
    let volumes = [Volume { clip: &clip, ..volume(&grid, &tf, &material) }];
    let camera = parallel([0.0, 0.0, 9.0], 0.5, [9, 9]);
    let tau = 0.65f64;
    for width in [0.01, 0.25, 5.0] {
        for (from, expected) in [(1.0, -(-2.0 * tau).exp_m1() / 2.0), (-1.0, tau * (-tau).exp())] {
            let out = draw(&input(&volumes, &camera, &[sun([0.0, 0.0, from])]), &exact(Some(width))).unwrap().0;
            let found = f64::from(out.channels[0][40]) * 4.0 * PI;
            let seen = f64::from(out.optical_depth[0][40]);
            assert!((found - expected).abs() < 1e-5 && (seen - tau).abs() < 1e-5, "{from}, {width}: {found} {seen}");
        }
    }
}

#[test]
fn cut_and_body_centred_lattices_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = scattering();
    let whole = grid([8, 7, 6], cubic(0.5), noise);
    let bcc = body_centred([6, 6, 12], 3.6, noise);
    let clip = [oblique()];
    let all = [
        Volume { clip: &clip, ..volume(&whole, &tf, &material) },
        bcc_volume(&bcc, &tf, &material),
        Volume { clip: &clip, ..bcc_volume(&bcc, &tf, &material) },
    ];
    let again = HalfParams { scattering: Scattering::ForwardAndBack, voxels_per_cell: 12, ..exact(None) };
    let cameras = [parallel([3.0, 2.0, 8.0], 7.0, [28, 20]), perspective([2.0, 3.0, 8.0], 40.0, [20, 28])];
    for (volume, camera) in all.into_iter().zip(cameras.iter().cycle()) {
        for (from, params) in
            [([1.0, 3.0, 2.0], exact(Some(0.07))), ([-1.0, 2.0, -3.0], exact(Some(0.1))), ([1.0, 3.0, 2.0], again)]
        {
            let [tau, color] = differences(&input(&[volume], camera, &[sun(from)]), &params);
            let what = format!("{:?}, {} regions", volume.packing, volume.clip.len());
            println!("{what}, from {from:?}: {tau:e} {color:e}");
            assert!(tau < 2e-5 && color < 5e-4, "{what}, from {from:?}: {tau:e} {color:e}");
        }
    }
}

#[test]
fn hv17_alpha_of_cut_and_body_centred_lattices_is_that_of_slabs_across_the_view() {
    let wave = |p: DVec3| 0.5 + 0.2 * (1.1 * p.x + 0.7 * p.y).sin() + 0.2 * (0.9 * p.z - 0.4 * p.y).cos();
    let tf = transfer(&[(0.0, 0.0), (1.0, 1.0)]);
    let material = scattering();
    let whole = grid([24, 20, 16], cubic(0.25), wave);
    let bcc = body_centred([18, 18, 36], 4.5, wave);
    let clip = [oblique()];
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let transform = Similarity { scale: 1.2, rotation: turn, translation: DVec3::new(0.2, -0.3, 0.1) };
    for volume in [volume(&whole, &tf, &material), bcc_volume(&bcc, &tf, &material)] {
        let volumes = [Volume { clip: &clip, transform, ..volume }];
        let camera = perspective([2.0, 3.0, 12.0], 35.0, [48, 48]);
        let across_view = crate::common::draw(&crate::common::input(&volumes, &camera, &[]), &crate::common::exact());
        let across_half = draw(&input(&volumes, &camera, &[sun([2.0, 1.0, 0.4])]), &exact(None)).unwrap().0;
        let apart = largest(&across_view.unwrap().0.optical_depth[0], &across_half.optical_depth[0]);
        println!("{:?}: {apart}", volume.packing);
        assert!(apart < 0.02 && across_half.optical_depth[0].iter().any(|tau| *tau > 1.0), "{apart}");
    }
}
