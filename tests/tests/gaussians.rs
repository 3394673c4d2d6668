//! 3D Gaussians through the whole command, beside a compositor of the same Gaussians that knows nothing of Organza's.

use glam::{DMat2, DMat3, DVec2, DVec3};
use organza_tests::{Picture, draw_in, largest_difference, organza};
use std::path::Path;

const SIZE: [usize; 2] = [72, 54];
/// Where the camera is and looks, and its vertical angle.
const VIEWS: [([f64; 3], [f64; 3], f64); 2] =
    [([0.5, 1.0, 6.0], [0.0, 0.0, 0.0], 50.0), ([-4.0, -1.5, 1.0], [0.5, 0.25, -0.5], 70.0)];
const BACKGROUND: f64 = 0.2;

/// One Gaussian as its file has it: 62 floats in the order of [`names`].
struct One {
    numbers: Vec<f32>,
}

fn names() -> Vec<String> {
    let fixed = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split(' ');
    fixed.map(str::to_owned).chain((0..45).map(|k| format!("f_rest_{k}"))).collect()
}

/// Seeded Gaussians with long, flat and round shapes, transparent and almost opaque, in a ball around the origin.
fn some(n: u64) -> Vec<One> {
    let number = |i: u64, k: u64| {
        let mut z = (i * 131 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32).mul_add(2.0, -1.0)
    };
    let gaussian = |i: u64| {
        let around = |k: u64, mean: f32, reach: f32| mean + reach * number(i, k);
        let mut numbers = vec![around(0, 0.0, 2.0), around(1, 0.0, 2.0), around(2, 0.0, 2.0)];
        numbers.extend((3..6).map(|k| around(k, 0.0, 1.5)));
        numbers.push(around(6, 1.0, 6.0));
        numbers.extend((7..10).map(|k| around(k, -2.6, 1.6)));
        numbers.extend((10..14).map(|k| around(k, 0.0, 1.0)));
        numbers.extend((14..59).map(|k| around(k, 0.0, 0.25)));
        One { numbers }
    };
    (0..n).map(gaussian).collect()
}

fn write(path: &Path, gaussians: &[One]) {
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", gaussians.len());
    names().iter().for_each(|name| text += &format!("property float {name}\n"));
    let mut out = (text + "end_header\n").into_bytes();
    gaussians.iter().flat_map(|gaussian| &gaussian.numbers).for_each(|v| out.extend(v.to_le_bytes()));
    std::fs::write(path, out).unwrap();
}

/// A camera in the axes of the file: the eye, right, up and ahead.
struct Eye {
    at: DVec3,
    axes: [DVec3; 3],
    focal: f64,
}

impl Eye {
    fn new((at, target, fov_y): ([f64; 3], [f64; 3], f64)) -> Self {
        let at = DVec3::from_array(at);
        let target = DVec3::from_array(target);
        let ahead = (target - at).normalize();
        let right = ahead.cross(DVec3::Y).normalize();
        let focal = 0.5 * SIZE[1] as f64 / (0.5 * fov_y.to_radians()).tan();
        Self { at, axes: [right, right.cross(ahead), ahead], focal }
    }

    /// The same of a file that is turned and scaled into the world.
    fn before(mut self, turn: DMat3, scale: f64, shift: DVec3) -> Self {
        self.at = turn.transpose() * (self.at - shift) / scale;
        self.axes = self.axes.map(|axis| turn.transpose() * axis);
        self
    }
}

/// The image model of Kerbl et al. 2023: sorted by the depth of centres, α = min(0.99, o·G), below 1/255 nothing; each colour decoded to light.
fn oracle(gaussians: &[One], eye: &Eye) -> Vec<[f64; 3]> {
    let mut seen: Vec<(f64, DVec2, DMat2, f64, [f64; 3])> =
        gaussians.iter().filter_map(|gaussian| seen(gaussian, eye)).collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pixel = |k: usize| {
        let at = DVec2::new((k % SIZE[0]) as f64 + 0.5, (k / SIZE[0]) as f64 + 0.5);
        let mut left = 1.0;
        let mut sum = [0.0; 3];
        for (_, center, inverse, opacity, color) in &seen {
            let d = at - *center;
            let alpha = (opacity * (-0.5 * d.dot(*inverse * d)).exp()).min(0.99);
            if alpha >= 1.0 / 255.0 {
                (0..3).for_each(|c| sum[c] += left * alpha * color[c]);
                left *= 1.0 - alpha;
            }
        }
        sum.map(|c| c + left * BACKGROUND)
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

fn seen(gaussian: &One, eye: &Eye) -> Option<(f64, DVec2, DMat2, f64, [f64; 3])> {
    let n: Vec<f64> = gaussian.numbers.iter().map(|v| f64::from(*v)).collect();
    let position = DVec3::from_slice(&n);
    let [w, x, y, z] = [10, 11, 12, 13].map(|k| n[k] / n[10..14].iter().map(|v| v * v).sum::<f64>().sqrt());
    let turn = DMat3::from_cols(
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    );
    let axes = turn * DMat3::from_diagonal(DVec3::new(n[7].exp(), n[8].exp(), n[9].exp()));
    let view = DMat3::from_cols_array_2d(&eye.axes.map(|axis| axis.to_array())).transpose();
    // y of the image runs down.
    let down = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    let c = down * view * (position - eye.at);
    let covariance = down * view * axes;
    let covariance = covariance * covariance.transpose();
    if c.z <= covariance.z_axis.z.sqrt() {
        return None;
    }
    let most = DVec2::new(SIZE[0] as f64, SIZE[1] as f64) * 0.5 / eye.focal * 1.3;
    let slant = (c.truncate() / c.z).clamp(-most, most);
    let rows = [DVec3::new(1.0, 0.0, -slant.x), DVec3::new(0.0, 1.0, -slant.y)].map(|row| row * eye.focal / c.z);
    let entry = |i: usize, j: usize| rows[i].dot(covariance * rows[j]) + if i == j { 0.3 } else { 0.0 };
    let in_image = DMat2::from_cols(DVec2::new(entry(0, 0), entry(0, 1)), DVec2::new(entry(1, 0), entry(1, 1)));
    let center = DVec2::new(SIZE[0] as f64, SIZE[1] as f64) * 0.5 + c.truncate() / c.z * eye.focal;
    let d = (position - eye.at).normalize();
    let color = [0, 1, 2].map(|k| {
        let value = 0.5
            + harmonics(d)
                .iter()
                .enumerate()
                .map(|(j, h)| h * if j == 0 { n[3 + k] } else { n[14 + 15 * k + j - 1] })
                .sum::<f64>();
        let value = value.max(0.0);
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    });
    Some((c.z, center, in_image.inverse(), 1.0 / (1.0 + (-n[6]).exp()), color))
}

/// By Legendre functions and angles, with the sign (−1)^m, where the reader has polynomials.
fn harmonics(d: DVec3) -> [f64; 16] {
    let cos = d.z;
    let sin = (1.0 - d.z * d.z).sqrt();
    let around = d.y.atan2(d.x);
    let legendre = |l: usize, m: usize| match (l, m) {
        (0, 0) => 1.0,
        (1, 0) => cos,
        (1, 1) => -sin,
        (2, 0) => 0.5 * (3.0 * cos * cos - 1.0),
        (2, 1) => -3.0 * cos * sin,
        (2, 2) => 3.0 * sin * sin,
        (3, 0) => 0.5 * cos * (5.0 * cos * cos - 3.0),
        (3, 1) => -1.5 * (5.0 * cos * cos - 1.0) * sin,
        (3, 2) => 15.0 * cos * sin * sin,
        _ => -15.0 * sin * sin * sin,
    };
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    let mut harmonics = [0.0; 16];
    for l in 0..4usize {
        for m in 0..=l {
            let norm = ((2 * l + 1) as f64 / (4.0 * std::f64::consts::PI) * factorial(l - m) / factorial(l + m)).sqrt();
            let value = norm * legendre(l, m) * if m == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
            harmonics[l * l + l + m] = value * (m as f64 * around).cos();
            if m > 0 {
                harmonics[l * l + l - m] = value * (m as f64 * around).sin();
            }
        }
    }
    harmonics
}

fn scene(view: usize, object: &str) -> String {
    let (position, target, fov_y) = VIEWS[view];
    format!(
        "version = 1\n[camera]\nposition = {position:?}\ntarget = {target:?}\nfov_y = {fov_y}\nsize = {SIZE:?}\n\
         [render]\nantialias = 1\n[background]\ncolor = [{BACKGROUND}, {BACKGROUND}, {BACKGROUND}]\n\
         [[object]]\nname = 'it'\npoints = 'g.ply'\n{object}"
    )
}

/// Largest difference to the oracle, of light.
fn off(picture: &Picture, exact: &[[f64; 3]]) -> f64 {
    let channels = ["R", "G", "B"].map(|c| picture.channel(c));
    let apart = |k: usize| (0..3).map(|c| (channels[c][k] - exact[k][c]).abs()).fold(0.0, f64::max);
    (0..exact.len()).map(apart).fold(0.0, f64::max)
}

#[test]
fn five_hundred_gaussians_are_what_an_exact_compositor_makes_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let gaussians = some(500);
    write(&folder.path().join("g.ply"), &gaussians);
    // As the file says, y down; and turned, scaled and moved, where harmonics turn along.
    let down = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let [x, y, z] = [20.0f64, -35.0, 50.0].map(f64::to_radians);
    let turned = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    let shift = DVec3::new(0.25, -0.5, 0.125);
    let moved = "transform = { up = 'y', rotate = [20, -35, 50], scale = 0.75, translate = [0.25, -0.5, 0.125] }\n";
    let cases = [
        (0, "", Eye::new(VIEWS[0]).before(down, 1.0, DVec3::ZERO)),
        (1, moved, Eye::new(VIEWS[1]).before(turned, 0.75, shift)),
    ];
    for (view, object, eye) in cases {
        let exact = oracle(&gaussians, &eye);
        for technique in ["points", "reference"] {
            let picture = draw_in(folder.path(), &scene(view, object), &["--technique", technique]);
            let off = off(&picture, &exact);
            println!("view {view}, {technique}: {off:.1e}");
            assert!(off < 1.0 / 255.0, "view {view}, {technique}: {off}");
        }
    }
    // The comparison can fail.
    let other = oracle(&gaussians, &Eye::new(VIEWS[0]));
    assert!(off(&draw_in(folder.path(), &scene(0, ""), &[]), &other) > 0.1);
}

#[test]
fn neither_the_order_of_the_file_nor_threads_nor_a_shift_change_gaussians() {
    let folder = tempfile::tempdir().unwrap();
    let mut gaussians = some(300);
    let path = folder.path().join("g.ply");
    write(&path, &gaussians);
    let picture = draw_in(folder.path(), &scene(0, ""), &["--threads", "1"]);
    assert_eq!(draw_in(folder.path(), &scene(0, ""), &["--threads", "3"]).sha256(1.0), picture.sha256(1.0));
    gaussians.reverse();
    write(&path, &gaussians);
    assert_eq!(draw_in(folder.path(), &scene(0, ""), &[]).sha256(1.0), picture.sha256(1.0));
    let moved = scene(0, "transform = { translate = [1e7, 1e7, 1e7] }\n")
        .replace("[0.5, 1.0, 6.0]", "[10000000.5, 10000001.0, 10000006.0]");
    let moved = moved.replace("target = [0.0, 0.0, 0.0]", "target = [1e7, 1e7, 1e7]");
    let apart = largest_difference(&draw_in(folder.path(), &moved, &[]).channel("G"), &picture.channel("G"));
    assert!(apart < 1e-4, "{apart}");
}

/// A round Gaussian of a deviation of 0.25 at the origin, red, before or behind a grey wall, or above a white floor.
fn one(folder: &Path) {
    let mut numbers = vec![0.0; 59];
    (numbers[3], numbers[4], numbers[5], numbers[10]) = (1.772_453_9, -1.772_453_9, -1.772_453_9, 1.0);
    numbers[6] = (0.6f32 / 0.4).ln();
    numbers[7..10].fill(0.25f32.ln());
    write(&folder.join("g.ply"), &[One { numbers }]);
}

#[test]
fn a_wall_hides_what_lies_behind_it_and_half_of_what_it_cuts() {
    let folder = tempfile::tempdir().unwrap();
    one(folder.path());
    let wall = |z: f64| {
        let object = format!(
            "[[object]]\nname = 'wall'\nmaterial = 'grey'\nrectangle = {{ center = [0, 0, {z}], u = [4, 0, 0], v = [0, 4, 0], spacing = 0.1 }}\n\
             [material.grey]\nshading = 'unlit'\ncolor = [0.2, 0.2, 0.2]\n"
        );
        scene(0, &object).replace("[0.5, 1.0, 6.0]", "[0, 0, 6]")
    };
    // The pixel right and below of the middle, half a pixel from it either way.
    let middle = SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2;
    let deviation = 0.25 * Eye::new(VIEWS[0]).focal / 6.0;
    let alpha = 0.6 * (-0.25 / (deviation * deviation + 0.3)).exp();
    for technique in ["points", "reference", "sheets"] {
        // Red before grey: all of it, half of its optical depth, nothing.
        for (z, share) in [(-2.0, 1.0), (0.0, 0.5), (2.0, 0.0)] {
            let picture = draw_in(folder.path(), &wall(z), &["--technique", technique]);
            let [red, green] = ["R", "G"].map(|c| picture.channel(c)[middle]);
            let left = (1.0 - alpha).powf(share);
            assert!((red - (1.0 - left + 0.2 * left)).abs() < 0.01, "{technique}, wall at {z}: {red}");
            assert!((green - 0.2 * left).abs() < 0.01, "{technique}, wall at {z}: {green}");
        }
    }
}

#[test]
fn gaussians_cast_the_shadow_of_their_opacity() {
    let folder = tempfile::tempdir().unwrap();
    one(folder.path());
    // The middle of the picture is the place of the floor below the Gaussian, which the light passes on its way there.
    let floor = "[[object]]\nname = 'floor'\nrectangle = { center = [0, -2, 0], u = [0, 0, 4], v = [4, 0, 0], spacing = 0.05 }\n\
        [[light]]\nkind = 'directional'\ndirection = [0, -1, 0]\nirradiance = [3, 3, 3]\n[ambient]\ncolor = [0, 0, 0]\n";
    let scene =
        scene(0, floor).replace("target = [0.0, 0.0, 0.0]", "target = [0, -2, 0]").replace("[72, 54]", "[145, 109]");
    let middle = |scene: &str| draw_in(folder.path(), scene, &[]).channel("G")[54 * 145 + 72];
    let lit = middle(&scene.replace("name = 'it'", "name = 'it'\ncasts_shadow = false"));
    let share = middle(&scene) / lit;
    // An opacity of 0.6, spread a little by the cells of the shadow map.
    assert!((share - 0.4).abs() < 0.03, "{share}");
}

#[test]
fn exit_3_techniques_that_do_not_draw_gaussians_refuse_them_by_name() {
    let folder = tempfile::tempdir().unwrap();
    one(folder.path());
    std::fs::write(folder.path().join("s.toml"), scene(0, "")).unwrap();
    for technique in ["particles", "surfels"] {
        let out =
            organza().current_dir(folder.path()).args(["render", "s.toml", "--technique", technique]).output().unwrap();
        let errors = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(3), "{errors}");
        assert!(
            errors.contains("it: ") && errors.contains("3D Gaussians, which its technique does not draw"),
            "{errors}"
        );
    }
    // A thinner one has no meaning.
    let out = organza()
        .current_dir(folder.path())
        .args(["render", "s.toml", "--set", "object.it.spacing=0.1"])
        .output()
        .unwrap();
    assert!(String::from_utf8_lossy(&out.stderr).contains("3D Gaussians have no mean"));
}
