//! Shadows that the opaque triangles of a rough scan cast on each other by the technique `sheets`, against a ray from every pixel to the light that is
//! tried with every triangle.

use organza_tests::{draw_in, parallel_view};
use splat_core::glam::DVec3;
use splat_core::rng;
use std::fmt::Write;
use tempfile::TempDir;

/// Pixels along a side of the picture.
const SIZE: usize = 96;
/// Squares along a side of the mesh, each of two triangles.
const SQUARES: usize = 100;
/// Half a side of the mesh, world units.
const HALF: f64 = 1.2;
const TO_LIGHT: DVec3 = DVec3::new(0.9, 0.5, 0.6);
/// Difference of radiance that is an error: a tenth of what a lit surface shows.
const ERROR: f64 = 0.08;

/// A field of bumps with the noise of a scanner, on a plane across the view.
fn corners() -> Vec<DVec3> {
    let corner = |k: usize| {
        let [x, y] = [k % (SQUARES + 1), k / (SQUARES + 1)].map(|n| HALF * (2.0 * n as f64 / SQUARES as f64 - 1.0));
        let noise = f64::from(rng::unit_f32(50, 0, k as u64, 0)) - 0.5;
        DVec3::new(x, y, 0.22 * (5.0 * x).sin() * (6.0 * y + x).sin() + 0.006 * noise)
    };
    (0..(SQUARES + 1).pow(2)).map(corner).collect()
}

fn triangles() -> Vec<[usize; 3]> {
    let square = |k: usize| {
        let low = k / SQUARES * (SQUARES + 1) + k % SQUARES;
        let high = low + SQUARES + 1;
        [[low, low + 1, high + 1], [low, high + 1, high]]
    };
    (0..SQUARES.pow(2)).flat_map(square).collect()
}

fn scene(corners: &[DVec3], triangles: &[[usize; 3]], more: &str) -> (TempDir, String) {
    let mut text = String::new();
    corners.iter().for_each(|p| writeln!(text, "v {:?} {:?} {:?}", p.x, p.y, p.z).unwrap());
    triangles.iter().for_each(|t| writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap());
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scan.obj"), text).unwrap();
    let scene = parallel_view(2.0, SIZE as u32)
        + &format!(
            "[[light]]\nkind = 'directional'\ndirection = [{:?}, {:?}, {:?}]\nirradiance = [3, 3, 3]\n\
             [[object]]\nname = 'scan'\nmesh = 'scan.obj'\ncolor = [0.8, 0.8, 0.8]\n{more}\
             [render]\ntechnique = 'sheets'\nlayers = ['effects', 'depth']\nantialias = 1\n",
            -TO_LIGHT.x, -TO_LIGHT.y, -TO_LIGHT.z
        );
    (folder, scene)
}

/// Whether a triangle lies between a place and the light, beyond what rounds the place.
fn hides(corners: [DVec3; 3], place: DVec3) -> bool {
    let [a, b, c] = corners;
    let along = b - a;
    let across = c - a;
    let normal = along.cross(across);
    let steep = TO_LIGHT.dot(normal);
    let way = (a - place).dot(normal) / steep;
    let at = place + TO_LIGHT * way - a;
    let u = at.cross(across).dot(normal);
    let v = along.cross(at).dot(normal);
    steep != 0.0 && way > 1e-5 && u >= 0.0 && v >= 0.0 && u + v <= normal.length_squared()
}

/// Which pixels the triangles leave in the light, by the depths that a picture has of them.
fn lit(corners: &[DVec3], triangles: &[[usize; 3]], depths: &[f64]) -> Vec<bool> {
    let pixel = |(k, depth): (usize, &f64)| {
        let place = |n: usize| 2.0 * (n as f64 + 0.5) / SIZE as f64 - 1.0;
        let at = DVec3::new(place(k % SIZE), -place(k / SIZE), 5.0 - depth);
        !triangles.iter().any(|t| hides(t.map(|corner| corners[corner]), at))
    };
    depths.iter().enumerate().map(pixel).collect()
}

#[test]
fn triangles_shadow_each_other_as_rays_to_the_light_have_it() {
    let corners = corners();
    let triangles = triangles();
    let (folder, scene) = scene(&corners, &triangles, "");
    let unshadowed = draw_in(folder.path(), &scene, &["--set", "light.0.shadow=false"]);
    let direct = unshadowed.channel("direct.G");
    let lit = lit(&corners, &triangles, &unshadowed.channel("depth.first.Z"));
    let dark = lit.iter().filter(|lit| !**lit).count();
    assert!((SIZE * SIZE / 8..SIZE * SIZE / 2).contains(&dark), "{dark} pixels are dark");
    for slicing in ["view", "half_vector"] {
        let picture = draw_in(folder.path(), &scene, &["--set", &format!("render.sheets.slicing='{slicing}'")]);
        let found = picture.channel("direct.G");
        let off = |k: &usize| (found[*k] - if lit[*k] { direct[*k] } else { 0.0 }).abs() > ERROR;
        let wrong = (0..found.len()).filter(off).count();
        println!("{slicing}: {wrong} of {} pixels, {dark} of them dark", found.len());
        assert!(wrong <= 60, "{slicing}: {wrong} of {} pixels are off", found.len());
    }
}

#[test]
fn a_mist_and_an_opaque_ball_beside_triangles_shadow_them_through_their_own_map() {
    let plane = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| DVec3::new(HALF * x, HALF * y, 0.0));
    let mist = "[material.mist]\nmedium = { extinction = 0.6, albedo = 0 }\n\
                [[object]]\nname = 'mist'\nmaterial = 'mist'\n\
                medium_box = { min = [-3.5, -3.5, 1], max = [3.5, 3.5, 2], extinction = 0.6, spacing = 0.1 }\n\
                [[object]]\nname = 'ball'\n\
                implicit = { expression = '0.2 - sqrt((x - 0.45)^2 + (y - 0.25)^2 + (z - 0.3)^2)', \
                box = [[0.2, 0, 0], [0.7, 0.5, 0.55]], spacing = 0.02 }\n";
    let (folder, scene) = scene(&plane, &[[0, 1, 2], [0, 2, 3]], mist);
    let unseen = ["--set", "object.mist.visible=false", "--set", "object.ball.visible=false"];
    let bare = draw_in(folder.path(), &scene, &unseen).channel("direct.G");
    // The eye sees the plane through the mist too.
    let found = draw_in(folder.path(), &scene, &[]).channel("direct.G");
    let expected = (-0.6 * (1.0 + TO_LIGHT.length() / TO_LIGHT.z)).exp();
    let at =
        |x: f64, y: f64| ((1.0 - y) / 2.0 * SIZE as f64) as usize * SIZE + ((1.0 + x) / 2.0 * SIZE as f64) as usize;
    let open = at(-0.6, -0.6);
    let light = found[open];
    assert!((light / (bare[open] * expected) - 1.0).abs() < 0.05, "{light} of {}", bare[open] * expected);
    // The ball's shadow lies half a unit of height towards −x from it.
    let shadow = at(0.45 - 0.3 * TO_LIGHT.x / TO_LIGHT.z, 0.25 - 0.3 * TO_LIGHT.y / TO_LIGHT.z);
    assert!(found[shadow] < 0.05 * found[open], "{} in the shadow, {} beside it", found[shadow], found[open]);
}
