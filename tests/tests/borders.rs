//! Borders and silhouettes of opaque surfaces lie where they are, whatever the spacing of the splats beside a pixel, and a
//! surface has no holes.

use organza_tests::draw;
use std::path::{Path, PathBuf};

const SIZE: u32 = 64;
/// Height of the view, world units, and a sample's side.
const HEIGHT: f64 = 2.0;
const SAMPLE: f64 = HEIGHT / 2.0 / SIZE as f64;

/// Area that is covered, seen by parallel rays along −z, world units².
fn covered(objects: &str, technique: &str) -> f64 {
    let text = format!(
        "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\northographic = {HEIGHT:?}\nsize = [{SIZE}, {SIZE}]\n\
         [render]\nantialias = 2\ntechnique = '{technique}'\n{objects}"
    );
    let side = HEIGHT / f64::from(SIZE);
    draw(&text, &[]).opacity().iter().sum::<f64>() * side * side
}

#[test]
fn open_borders_lie_where_they_are() {
    // Turned by 20 degrees in its plane, and leaning back by 0 and 50 degrees.
    let (sin, cos) = 20f64.to_radians().sin_cos();
    for lean in [0.0f64, 50.0] {
        let down = lean.to_radians().cos();
        let away = lean.to_radians().sin();
        for spacing in [0.1, 0.05, 0.02, 0.005] {
            for technique in ["points", "particles"] {
                let rectangle = format!(
                    "[[object]]\nname = 'sheet'\nrectangle = {{ center = [0, 0, 0], u = [{:?}, {:?}, {:?}], \
                     v = [{:?}, {:?}, {:?}], spacing = {spacing:?} }}\n",
                    0.8 * cos,
                    0.8 * sin * down,
                    0.8 * sin * away,
                    -0.6 * sin,
                    0.6 * cos * down,
                    0.6 * cos * away
                );
                let found = covered(&rectangle, technique);
                // By how much each border would have to be moved outwards, in the sheet's plane.
                let area = 4.0 * 0.8 * 0.6 * down;
                let rim = 4.0 * (0.8 + 0.6) * down;
                let outwards = (found - area) / rim;
                assert!(
                    outwards.abs() < 0.08 * spacing + 0.08 * SAMPLE,
                    "{technique}, lean {lean}, h {spacing}: {outwards}"
                );
            }
        }
    }
}

#[test]
fn silhouettes_lie_where_they_are() {
    for spacing in [0.1, 0.05, 0.02, 0.008] {
        let ball = format!(
            "[[object]]\nname = 'ball'\n\
             implicit = {{ expression = 'x^2 + y^2 + z^2 - 0.49', box = [[-1, -1, -1], [1, 1, 1]], spacing = {spacing:?} }}\n"
        );
        let outwards = (covered(&ball, "points") / std::f64::consts::PI).sqrt() - 0.7;
        assert!(outwards.abs() < 0.08 * spacing + 0.08 * SAMPLE, "h {spacing}: {outwards}");
    }
}

#[test]
fn nothing_shows_between_a_silhouette_and_the_wall_behind() {
    for spacing in [0.05, 0.006] {
        let scene = format!(
            "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\northographic = {HEIGHT:?}\nsize = [{SIZE}, {SIZE}]\n\
             [[object]]\nname = 'ball'\n\
             implicit = {{ expression = 'x^2 + y^2 + z^2 - 0.49', box = [[-1, -1, -1], [1, 1, 1]], spacing = {spacing:?} }}\n\
             [[object]]\nname = 'wall'\n\
             rectangle = {{ center = [0, 0, -2], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }}\n"
        );
        let least = draw(&scene, &[]).opacity().into_iter().fold(1.0, f64::min);
        assert!(least > 0.999, "h {spacing}: {least}");
    }
}

/// An octahedron of eight triangles, its corners one away from 0, with smooth normals.
fn octahedron(folder: &Path) -> PathBuf {
    let axes = ["1 0 0", "-1 0 0", "0 1 0", "0 -1 0", "0 0 1", "0 0 -1"];
    let mut text: String = axes.iter().map(|v| format!("v {v}\nvn {v}\n")).collect();
    for [a, b, c] in [[1, 3, 5], [3, 2, 5], [2, 4, 5], [4, 1, 5], [3, 1, 6], [2, 3, 6], [4, 2, 6], [1, 4, 6]] {
        text += &format!("f {a}//{a} {b}//{b} {c}//{c}\n");
    }
    let path = folder.join("octahedron.obj");
    std::fs::write(&path, text).unwrap();
    path
}

/// Whichever way normals lean, a ray crosses a face once on its way in and once on its way out.
#[test]
fn a_coarse_translucent_mesh_hides_what_its_faces_hide() {
    let folder = tempfile::tempdir().unwrap();
    let path = octahedron(folder.path());
    for (camera, crossings) in [
        ("position = [3, 2, 5]\ntarget = [0, 0, 0]\northographic = 0.125", 2),
        ("position = [0.9, 0.6, 1.5]\ntarget = [0, 0, 0]\nfov_y = 14.25", 2),
        ("position = [0.05, 0.1, 0.1]\ntarget = [0, 0, -1]\nfov_y = 14.25", 1),
    ] {
        // 64 pixels of 400 sets: a standard deviation of 0.003.
        for (technique, bound) in [("points", 1e-3), ("particles", 6e-3)] {
            let scene = format!(
                "version = 1\n[camera]\n{camera}\nsize = [8, 8]\n[render]\ntechnique = '{technique}'\n\
                 particles = {{ repeat_level = 400 }}\n\
                 [[object]]\nname = 'octahedron'\nmesh = '{}'\nspacing = 0.02\nopacity = 0.5\n",
                path.display()
            );
            let alpha = draw(&scene, &[]).opacity();
            let mean = alpha.iter().sum::<f64>() / alpha.len() as f64;
            let expected = 1.0 - 0.5f64.powi(crossings);
            assert!((mean - expected).abs() < bound, "{technique}, {crossings} crossings: {mean}");
        }
    }
}

/// Smooth normals that lean by 55 degrees from the faces at their corners: by such normals discs would stand out as scales.
#[test]
fn a_coarse_mesh_with_smooth_normals_has_no_holes() {
    let folder = tempfile::tempdir().unwrap();
    let path = octahedron(folder.path());
    for spacing in [0.2, 0.05, 0.01] {
        for position in [[0.0, 0.0, 5.0], [3.0, 2.0, 4.0], [1.0, 0.3, 5.0], [4.0, 4.0, 0.1]] {
            let scene = format!(
                "version = 1\n[camera]\nposition = {position:?}\ntarget = [0, 0, 0]\northographic = 2.6\nsize = [{SIZE}, {SIZE}]\n\
                 [render]\nlayers = ['depth']\n[[object]]\nname = 'octahedron'\nmesh = '{}'\nspacing = {spacing:?}\n",
                path.display()
            );
            let image = draw(&scene, &[]);
            let towards = splat_core::glam::DVec3::from_array(position).normalize();
            // Projected area: half the sum over the faces, each √3/2 large.
            let faces = (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|s| 1.0 - 2.0 * f64::from(s)));
            let cosines = faces.map(|n| (splat_core::glam::DVec3::from_array(n) / 3f64.sqrt()).dot(towards).abs());
            let area = 0.5 * cosines.sum::<f64>() * 0.75f64.sqrt();
            let side = 2.6 / f64::from(SIZE);
            let found = image.opacity().iter().sum::<f64>() * side * side;
            // Discs reach beyond sharp edges, half a spacing at most; about four edges of √2 bound the silhouette.
            let rim = 4.0 * 2f64.sqrt();
            assert!(found > area - 0.1 * side * rim, "h {spacing} from {position:?}: {found}, not {area}");
            assert!(found < area + (0.6 * spacing + side) * rim, "h {spacing} from {position:?}: {found}, not {area}");
        }
    }
}
