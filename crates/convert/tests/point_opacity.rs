//! Points that bring an opacity each: how files state it, what is refused, and the discs that come of it.

use crate::read_samples::load;
use convert::{SurfelParams, cost, raw_to_surfels, reference};
use read::{Loaded, ReadParams, bytes};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, RawPoints, SplatKind, optics};

fn points(name: &str, content: &[u8]) -> RawPoints {
    match load(name, content).unwrap() {
        Loaded::Points(points) => points,
        other => panic!("{other:?}"),
    }
}

/// A PLY file of points in a row, with a column of this type and name.
fn ply(kind: &str, name: &str, values: &[&str]) -> String {
    let rows: String = values.iter().enumerate().map(|(i, v)| format!("{i} 0 0 {v}\n")).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property {kind} {name}\nend_header\n{rows}",
        values.len()
    )
}

#[test]
fn columns_of_every_type_are_read() {
    for name in ["opacity", "alpha"] {
        for kind in ["float", "double"] {
            let read = points("a.ply", ply(kind, name, &["0", "0.25", "1"]).as_bytes());
            assert_eq!(read.opacity, [0.0, 0.25, 1.0], "{kind} {name}");
        }
        assert_eq!(points("a.ply", ply("uchar", name, &["0", "51", "255"]).as_bytes()).opacity, [0.0, 0.2, 1.0]);
        assert_eq!(points("a.ply", ply("ushort", name, &["0", "13107", "65535"]).as_bytes()).opacity, [0.0, 0.2, 1.0]);
        let text = format!("x,y,z,{},red,green,blue\n0,0,0,0.25,1,2,3\n1,0,0,1e0,1,2,3\n", name.to_uppercase());
        let read = points("a.csv", text.as_bytes());
        assert_eq!((read.opacity.as_slice(), read.color.len()), (&[0.25, 1.0][..], 2));
        assert_eq!(read.least_opacity(), 0.25);
    }
    let mut binary = ply("float", "opacity", &[]).replace("vertex 0", "vertex 2").replace("ascii", "binary_big_endian");
    binary.truncate(binary.find("end_header\n").unwrap() + "end_header\n".len());
    let numbers = [0f32, 1.0, 2.0, 0.125, 3.0, 4.0, 5.0, 0.5].map(f32::to_be_bytes).concat();
    assert_eq!(points("a.ply", &[binary.as_bytes(), &numbers].concat()).opacity, [0.125, 0.5]);
    assert_eq!(points("a.xyz", b"0 0 0\n").least_opacity(), 1.0);
}

#[test]
fn columns_that_are_used_are_not_named_and_the_others_are() {
    let unused =
        |name: &str, content: &str| bytes(name, content.as_bytes(), &ReadParams::default(), None).unwrap().1.unused;
    assert!(unused("a.ply", &ply("float", "opacity", &["0.5"])).is_empty());
    assert!(unused("a.xyz", "x y z alpha\n0 0 0 1\n").is_empty());
    // The first name that is there wins.
    let both = ply("float", "alpha\nproperty float opacity", &["0.5 0.25"]);
    assert_eq!(unused("a.ply", &both), ["alpha"]);
    assert_eq!(points("a.ply", both.as_bytes()).opacity, [0.25]);
    // The corners of a mesh have some, too.
    let mesh = |opacities: &[&str; 3]| {
        ply("float", "alpha", opacities)
            .replace("end_header\n", "element face 1\nproperty list uchar int vertex_index\nend_header\n")
            .replacen("1 0 0 ", "0 1 0 ", 1)
            + "3 0 1 2\n"
    };
    let read = mesh(&["0.5", "0", "1"]);
    assert!(unused("a.ply", &read).is_empty());
    let Loaded::Mesh(found) = load("a.ply", read.as_bytes()).unwrap() else { panic!("no mesh") };
    assert_eq!(found.opacity, [0.5, 0.0, 1.0]);
    assert!(load("a.ply", mesh(&["0.5", "nan", "1"]).as_bytes()).is_err());
}

#[test]
fn what_is_no_opacity_is_refused_with_its_place() {
    let refused = |name: &str, content: &[u8], expected: &str| {
        let error = load(name, content).unwrap_err().to_string();
        assert!(error.starts_with(expected) && error.contains("rename the column"), "{error}");
    };
    for bad in ["nan", "-0.5", "1.5", "inf"] {
        let expected = format!("a.ply:10:7: expected an opacity from 0 to 1, found '{bad}'");
        refused("a.ply", ply("float", "opacity", &["0.5", bad]).as_bytes(), &expected);
    }
    let expected = "a.ply:9:7: expected an opacity from 0 to 255, found '256'";
    refused("a.ply", ply("int", "alpha", &["256"]).as_bytes(), expected);
    let header = ply("float", "alpha", &[]).replace("vertex 0", "vertex 1").replace("ascii", "binary_little_endian");
    let header = &header[..header.find("end_header\n").unwrap() + "end_header\n".len()];
    let body = [0f32, 0.0, 0.0, f32::NAN].map(f32::to_le_bytes).concat();
    let expected = format!("a.ply@{}: expected an opacity from 0 to 1, found NaN", header.len() + 12);
    refused("a.ply", &[header.as_bytes(), &body].concat(), &expected);
    for bad in ["-1", "128"] {
        let text = format!("x y z opacity\n0 0 0 1\n0 0 1 {bad}\n");
        let expected = format!("a.xyz:3:7: expected an opacity from 0 to 1, found '{bad}'");
        refused("a.xyz", text.as_bytes(), &expected);
    }
    let error = load("a.xyz", b"x y z opacity\n0 0 0 nan\n").unwrap_err().to_string();
    assert!(error.starts_with("a.xyz:2:7: expected a finite decimal number, found 'nan'"), "{error}");
    let error = load("a.xyz", b"x y z opacity alpha\n0 0 0 1 1\n").unwrap_err().to_string();
    assert!(error.starts_with("a.xyz:1: expected one column 'opacity', found several"), "{error}");
    // Columns made by hand are checked too.
    for opacity in [vec![0.5], vec![0.5, f32::NAN], vec![0.5, 1.5]] {
        let points = RawPoints { position: vec![Vec3::ZERO, Vec3::X], opacity, ..RawPoints::default() };
        let error = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap_err().to_string();
        assert!(error.contains("opacity"), "{error}");
    }
}

const SIDE: u32 = 24;

/// A square lattice of spacing 1, of opacity `near` where x < 12, else `far`.
fn halves(near: f32, far: f32) -> RawPoints {
    let at = |i: u32| Vec3::new((i % SIDE) as f32, 0.0, (i / SIDE) as f32);
    let position: Vec<Vec3> = (0..SIDE * SIDE).map(at).collect();
    let opacity = position.iter().map(|p| if p.x < 12.0 { near } else { far }).collect();
    RawPoints { position, opacity, ..RawPoints::default() }
}

fn surfels(points: &RawPoints, opacity: f64) -> Cloud {
    let params = SurfelParams { opacity, ..SurfelParams::default() };
    let (cloud, _) = raw_to_surfels(points, &params, None).unwrap();
    cloud.validate().unwrap();
    assert_eq!(cost::raw_points(points, &params).unwrap().bytes, cloud.bytes(), "as predicted");
    cloud
}

#[test]
fn two_halves_of_a_plane_have_the_opacities_of_their_points() {
    // That of the surface is a factor.
    for factor in [1.0, 0.5] {
        let cloud = surfels(&halves(0.25, 0.75), factor);
        for (x, own) in [(4.3, 0.25), (6.0, 0.25), (17.0, 0.75), (18.6, 0.75)] {
            let tau = reference::layer_depth(&cloud, Footprint::default(), DVec3::new(x, 0.0, 12.2), DVec3::Y);
            let through = (-tau).exp();
            assert!((through - (1.0 - factor * own)).abs() < 5e-4, "{x}, {factor}: {through}");
        }
        for i in 0..cloud.len() {
            let point_opacity = if cloud.position[i].x < 12.0 { 0.25 } else { 0.75 };
            assert_eq!(cloud.crossing_depth[i], optics::optical_depth(factor * point_opacity) as f32);
            assert_eq!(cloud.kind[i], SplatKind::Surface);
        }
    }
}

#[test]
fn points_of_opacity_one_are_opaque_discs_beside_the_others() {
    let mixed = surfels(&halves(1.0, 0.75), 1.0);
    let alone = surfels(&RawPoints { opacity: Vec::new(), ..halves(1.0, 1.0) }, 1.0);
    for i in 0..mixed.len() {
        let one = mixed.get(i);
        let opaque = alone.get(i);
        if one.position.x < 12.0 {
            assert_eq!(one, opaque, "as without the column");
        } else {
            assert_eq!((one.kind, one.radius), (SplatKind::Surface, opaque.radius));
            let tau = optics::optical_depth(0.75);
            assert!((f64::from(one.cross_section / opaque.cross_section) / tau - 1.0).abs() < 1e-6);
        }
    }
    assert_eq!(surfels(&halves(1.0, 1.0), 1.0), alone, "a column of ones is none");
    // Under a translucent surface nothing is opaque; of opacity 0 nothing is seen.
    let faded = surfels(&halves(1.0, 0.0), 0.5);
    for i in 0..faded.len() {
        let seen = faded.position[i].x < 12.0;
        assert_eq!(faded.kind[i], SplatKind::Surface);
        assert_eq!((faded.cross_section[i] > 0.0, faded.crossing_depth[i] > 0.0), (seen, seen));
    }
}

#[test]
fn points_at_one_place_have_the_mean_of_their_optical_depths_in_any_order() {
    let mut points = halves(0.25, 0.25);
    points.position.extend(points.position.clone());
    points.opacity.extend(vec![0.75; (SIDE * SIDE) as usize]);
    let cloud = surfels(&points, 1.0);
    let tau = reference::layer_depth(&cloud, Footprint::default(), DVec3::new(12.1, 0.0, 11.7), DVec3::Y);
    assert!((tau - 0.5 * (optics::optical_depth(0.25) + optics::optical_depth(0.75))).abs() < 1e-3, "{tau}");
    points.position.reverse();
    points.opacity.reverse();
    assert_eq!(surfels(&points, 1.0), cloud);
}
