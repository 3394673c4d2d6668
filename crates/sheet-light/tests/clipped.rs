//! Volumes that are cut along planes: the length of each ray, and the values on the cut.

use crate::common::{constant, cubic, draw, exact, grid, in_box, input, parallel, perspective, unlit, volume};
use sheet_light::{Params, Volume};
use splat_core::glam::{DQuat, DVec3};
use splat_core::{Camera, Clip, DAabb, Similarity, TransferFunction, TransferPoint};

/// View depths of a pixel's ray between which it is where normal·p ≤ offset.
fn before_plane(camera: &Camera, at: usize, (normal, offset): (DVec3, f64)) -> [f64; 2] {
    let [x, y] = [at % camera.size[0] as usize, at / camera.size[0] as usize].map(|v| v as f64 + 0.5);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    let (from, along) = camera.view_ray(x, y);
    let left = offset - normal.dot(camera.position + world(from));
    let leaves = normal.dot(world(along));
    if leaves > 0.0 { [f64::NEG_INFINITY, left / leaves] } else { [left / leaves, f64::INFINITY] }
}

/// Every pixel of a constant volume of these sides has e^−τ of what the regions leave of its ray.
fn check(volume: Volume<'_>, camera: &Camera, sides: DVec3, extinction: f64) {
    let (out, _) = draw(&input(&[volume], camera, &[]), &exact()).unwrap();
    let mut cut = 0;
    let mut seen = 0;
    for at in 0..out.optical_depth[0].len() {
        let [x, y] = [at % camera.size[0] as usize, at / camera.size[0] as usize].map(|v| v as f64 + 0.5);
        let in_box = in_box(camera, sides, at);
        let [near, far] = volume.clip.iter().flat_map(Clip::half_spaces).fold(in_box, |[near, far], plane| {
            let [from, to] = before_plane(camera, at, plane);
            [near.max(from), far.min(to)]
        });
        let length = (far - near).max(0.0) * camera.view_ray(x, y).1.length();
        let found = (-f64::from(out.optical_depth[0][at])).exp();
        let expected = (-length * extinction).exp();
        assert!((found - expected).abs() < 2e-5, "pixel {at}: {found}, expected {expected}");
        cut += usize::from(in_box[1] > in_box[0] && in_box[1] - in_box[0] > far - near + 1e-9);
        seen += usize::from(length > 0.0);
    }
    assert!(cut > 50 && seen > 50, "{cut} pixels are cut, {seen} show something");
}

#[test]
fn rays_end_at_planes_and_boxes_in_any_view() {
    let grid = grid([20, 16, 12], cubic(0.25), |_| 5.0);
    let transfer = constant(0.4);
    let material = unlit();
    let sides = DVec3::new(5.0, 4.0, 3.0);
    let oblique = Clip::HalfSpace { normal: DVec3::new(0.5, -1.0, 0.25), offset: 0.3 };
    let boxed = Clip::Box(DAabb::new(DVec3::new(-1.9, -0.3, -9.0), DVec3::new(1.3, 1.1, 0.4)));
    for clip in [vec![oblique], vec![boxed], vec![oblique, boxed]] {
        let volume = Volume { clip: &clip, ..volume(&grid, &transfer, &material) };
        let extinction = f64::from(0.4f32);
        check(volume, &parallel([3.0, 4.0, 12.0], 8.0, [40, 30]), sides, extinction);
        check(volume, &perspective([1.0, 2.0, 6.0], 60.0, [40, 30]), sides, extinction);
    }
}

#[test]
fn regions_move_with_their_volume() {
    let grid = grid([16; 3], cubic(0.25), |p| p.x + 0.5 * p.y);
    let transfer = constant(0.7);
    let material = unlit();
    let clip = [Clip::HalfSpace { normal: DVec3::new(1.0, 2.0, -0.5), offset: 0.25 }];
    let still = Volume { clip: &clip, ..volume(&grid, &transfer, &material) };
    let camera = parallel([2.0, 3.0, 9.0], 6.0, [30, 24]);
    let (before, _) = draw(&input(&[still], &camera, &[]), &exact()).unwrap();
    let motion = Similarity {
        scale: 2.0,
        rotation: DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7),
        translation: DVec3::new(300.0, -20.0, 5.0),
    };
    let moved = Volume { transform: motion, extinction_scale: 0.5, ..still };
    let mut other = camera;
    other.scale_world(motion.scale);
    other.position = motion.apply(camera.position);
    other.axes = camera.axes.map(|axis| motion.rotation * axis);
    let (after, _) = draw(&input(&[moved], &other, &[]), &exact()).unwrap();
    let apart =
        before.optical_depth[0].iter().zip(&after.optical_depth[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 2e-5, "{apart}");
    assert!(before.optical_depth[0].iter().any(|tau| *tau > 0.5));
}

/// Values rise towards the eye, and colours with them: what is seen of matter of extinction σ cut at z is the colour of z − 1/σ, whatever the
/// slabs are.
#[test]
fn a_cut_shows_the_values_that_are_there() {
    let grid = grid([12, 12, 32], cubic(0.125), |p| p.z);
    let point = |value: f32| TransferPoint { value, color: [0.5 + 0.25 * value; 3], extinction: 20.0 };
    let transfer = TransferFunction::new(vec![point(-2.0), point(2.0)]).unwrap();
    let material = unlit();
    let camera = parallel([0.0, 0.0, 9.0], 1.0, [12, 12]);
    for (depth, width) in [(0.3, 0.02), (-0.71, 0.02), (0.3, 0.007)] {
        let clip = [Clip::HalfSpace { normal: DVec3::Z, offset: depth }];
        let volumes = [Volume { clip: &clip, ..volume(&grid, &transfer, &material) }];
        let (out, _) = draw(&input(&volumes, &camera, &[]), &Params { slab_width: Some(width), ..exact() }).unwrap();
        let expected = 0.5 + 0.25 * (depth - 1.0 / 20.0);
        for light in &out.channels[0] {
            assert!((f64::from(*light) - expected).abs() < 0.25 * width, "{light}, expected {expected}");
        }
    }
}
