//! Meshes as they are found: one bad face among many, surfaces turned inside out.

use glam::{DVec3, Vec3};
use organza_tests::{Picture, Place, SMALL_SCENE, draw_in, largest_difference, picture_of};
use read::{Loaded, ReadParams};
use splat_core::Mesh;
use std::path::Path;

/// A scene of one mesh from 2.4 radii away, lit from the side; `material` is the text of its table.
fn scene(mesh: &str, center: DVec3, radius: f64, material: &str) -> String {
    let [x, y, z] = center.to_array();
    format!(
        "version = 1\n[camera]\nposition = [{x:?}, {:?}, {:?}]\ntarget = [{x:?}, {y:?}, {z:?}]\nfov_y = 50\n\
         size = [96, 96]\n[[light]]\nkind = 'directional'\ndirection = [-1, -1, -1]\nirradiance = [3, 3, 3]\n\
         [background]\ncolor = [0.9, 0.9, 0.9]\n\
         [[object]]\nname = 'body'\nmesh = '{mesh}'\nmaterial = 'skin'\nspacing = {:?}\n[material.skin]\n{material}\n",
        y + 0.5 * radius,
        z + 2.4 * radius,
        radius / 40.0
    )
}

#[test]
fn a_sheet_with_faces_for_both_sides_is_drawn() {
    let place = Place::new("");
    place.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\nf 3 2 1\nf 4 3 1\n");
    let front = ["--azimuth", "0", "--elevation", "0", "--size", "40x40", "-o", "a.exr"];
    place.expect(0, &[&["render", "sheet.obj"][..], &front].concat(), "");
    let opacity = picture_of(&place.path("a.exr")).opacity();
    assert!(opacity[20 * 40 + 20] > 0.99, "{}", opacity[20 * 40 + 20]);
}

/// A mesh as an ascii PLY file, with its normals if it has some.
fn ply(mesh: &Mesh) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", mesh.position.len());
    let names = if mesh.normal.is_empty() { &["x", "y", "z"][..] } else { &["x", "y", "z", "nx", "ny", "nz"] };
    names.iter().for_each(|name| text += &format!("property float {name}\n"));
    text += &format!("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.len());
    for (i, p) in mesh.position.iter().enumerate() {
        text += &format!("{} {} {}", p.x, p.y, p.z);
        mesh.normal.get(i).iter().for_each(|n| text += &format!(" {} {} {}", n.x, n.y, n.z));
        text += "\n";
    }
    mesh.triangles.iter().for_each(|t| text += &format!("3 {} {} {}\n", t[0], t[1], t[2]));
    text
}

/// A torus: its own hole is a silhouette before its far side.
fn torus() -> Mesh {
    let n = 48u32;
    let m = 24u32;
    let mut mesh = Mesh::default();
    for i in 0..n * m {
        let a = (i / m) as f32 / n as f32 * std::f32::consts::TAU;
        let b = (i % m) as f32 / m as f32 * std::f32::consts::TAU;
        let out = Vec3::new(a.cos(), 0.3 * a.sin(), a.sin()).normalize();
        mesh.position.push(Vec3::new(a.cos(), 0.3 * a.sin(), a.sin()) + (out * b.cos() + Vec3::Y * b.sin()) * 0.4);
    }
    for i in 0..n {
        for j in 0..m {
            let at = |i: u32, j: u32| i % n * m + j % m;
            let a = at(i, j);
            let b = at(i, j + 1);
            let c = at(i + 1, j + 1);
            let d = at(i + 1, j);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn bunny() -> Mesh {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/stanford-bunny/bunny.ply.gz");
    let Loaded::Mesh(mesh) = read::file(&file, &ReadParams::default(), None).unwrap().0 else { panic!("no mesh") };
    mesh
}

fn turned(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.normal.iter_mut().for_each(|n| *n = -*n);
    mesh
}

fn draw(mesh: &Mesh, center: DVec3, radius: f64, material: &str) -> Picture {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("body.ply"), ply(mesh)).unwrap();
    draw_in(folder.path(), &scene("body.ply", center, radius, material), &["--technique", "points"])
}

#[test]
fn what_was_mended_is_said_and_a_strict_command_refuses() {
    let text = format!("{SMALL_SCENE}[[object]]\nname = 'm'\nmesh = 'm.obj'\nspacing = 0.05\n");
    let place = Place::new(&text);
    place.write("m.obj", "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1//1 2//1 3//1\nf 1 2 3 4\nf 1 2\n");
    let said = [
        "warning: m.obj:5:3: 3 corners name normals, of which the file has none: normals are computed\n",
        "warning: m.obj:6: 1 face of four corners crosses itself and is drawn as two triangles (face 2)\n",
        "warning: m.obj:7:1: 1 face of fewer than three corners is left out (face 3)\n",
    ];
    for command in [&["render", "s.toml", "--force"][..], &["explain", "s.toml"], &["info", "m.obj"]] {
        let out = place.expect(0, command, "");
        let errors = String::from_utf8(out.stderr).unwrap();
        for line in said {
            assert_eq!(errors.matches(line.strip_prefix("warning: ").unwrap()).count(), 1, "{command:?}: {errors}");
        }
        let strict = [command, &["--strict"]].concat();
        place.expect(3, &strict, "m.obj:5:3: expected an index from 1 to 0");
    }
    let info: serde_json::Value =
        serde_json::from_slice(&place.expect(0, &["info", "m.obj", "--json"], "").stdout).unwrap();
    assert_eq!(info["mended"].as_array().map(Vec::len), Some(3));
    assert_eq!(info["counts"]["triangles"], 3);
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    /// Wound inwards, with normals that point inwards, or both, a closed body and a scan with holes look as they do wound
    /// outwards. Without being turned they had dark rims.
    #[test]
    fn a_body_turned_inside_out_looks_the_same() {
        let with_normals = Mesh { normal: splat_core::vertex_normals(&torus()), ..torus() };
        let normals_alone = Mesh { triangles: torus().triangles, ..turned(&with_normals) };
        let faces_alone = Mesh { normal: with_normals.normal.clone(), ..turned(&with_normals) };
        let scan = bunny();
        let (low, high) =
            scan.position.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let middle = 0.5 * (low + high).as_dvec3();
        let reach = 0.5 * f64::from((high - low).max_element());
        for material in ["opacity = 1.0", "opacity = 0.4"] {
            let same = |a: &Mesh, b: &Mesh, center: DVec3, radius: f64| {
                let a = draw(a, center, radius, material);
                let b = draw(b, center, radius, material);
                let worst = ["R", "G", "B", "A"].map(|c| largest_difference(&a.channel(c), &b.channel(c)));
                assert!(worst.iter().all(|w| *w < 1.0 / 255.0), "{material}: {worst:?}");
                assert!(a.opacity().iter().sum::<f64>() > 500.0);
            };
            same(&torus(), &turned(&torus()), DVec3::ZERO, 1.5);
            for other in [turned(&with_normals), normals_alone.clone(), faces_alone.clone()] {
                same(&with_normals, &other, DVec3::ZERO, 1.5);
            }
            same(&scan, &turned(&scan), scan.origin + middle, reach);
        }
    }
}
