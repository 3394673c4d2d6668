//! Rendering-oriented points in files: what is written is read again bit by bit, moved, chosen and refused.

use convert::{
    DiscShape, Kept, MatterParams, PointsShown, SplatParams, SurfelParams, Within, cost, raw_to_matter, raw_to_surfels,
    shown_points, thinned,
};
use read::{Loaded, ReadParams, bytes};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::splat_file::{packed_splats_to_ply, splats_to_ply};
use splat_core::{Cloud, Footprint, FootprintStack, PackedCloud, RawPoints, Similarity, Splat, SplatKind, rng};

/// Splats of all kinds with every attribute, far from zero.
fn cloud(count: u64) -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(637_012.239_87, -3.5e-7, 1.0 / 3.0));
    let unit = |i: u64, a: u64| rng::unit_f32(5, 0, i, a);
    for i in 0..count {
        let normal = Vec3::new(unit(i, 0) - 0.5, unit(i, 1) - 0.5, 0.7).normalize();
        let kind = [SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque][i as usize % 3];
        cloud.push(&Splat {
            position: Vec3::new(unit(i, 2) * 1e-20, unit(i, 3) * 1e3, -unit(i, 4)),
            radius: unit(i, 5) + 1e-30,
            cross_section: unit(i, 6) * 1e-25,
            color: [unit(i, 7), 3.0 * unit(i, 8), 0.0],
            kind,
            normal,
            shading_normal: if i % 2 == 0 { Vec3::ZERO } else { Vec3::Y },
            tangent: if i % 5 == 0 { normal.any_orthonormal_vector() * unit(i, 9) } else { Vec3::ZERO },
            shadow_coefficient: unit(i, 10),
            value: 1e6 * unit(i, 11) - 5e5,
            crossing_depth: if kind == SplatKind::Surface { unit(i, 12) } else { 0.0 },
            ..Splat::default()
        });
    }
    cloud
}

fn file(cloud: &Cloud) -> Vec<u8> {
    splats_to_ply(cloud, &["it".into(), "a\nb".into()], &[], &FootprintStack::default())
}

fn read(file: &[u8]) -> Result<RawPoints, String> {
    match bytes("s.ply", file, &ReadParams::default(), None) {
        Ok((Loaded::Points(points), notes)) => {
            assert!(notes.unused.is_empty(), "{:?}", notes.unused);
            Ok(points)
        }
        Ok(other) => panic!("{other:?}"),
        Err(e) => Err(e.to_string()),
    }
}

fn made(points: &RawPoints, params: &SurfelParams) -> Cloud {
    let (cloud, report) = raw_to_surfels(points, params, None).unwrap();
    cloud.validate().unwrap();
    let predicted = cost::raw_points(points, params).unwrap();
    assert_eq!(
        (predicted.splats, predicted.bytes, report.splats),
        (cloud.len() as u64, cloud.bytes(), cloud.len() as u64)
    );
    cloud
}

#[test]
fn what_is_written_is_read_again_bit_by_bit() {
    let written = cloud(200);
    let points = read(&file(&written)).unwrap();
    let again = made(&points, &SurfelParams::default());
    assert_eq!(again, written);
    assert!(again.origin.to_array().map(f64::to_bits) == written.origin.to_array().map(f64::to_bits));
    assert_eq!(file(&again), file(&written), "and written again the same bytes");
    // Columns that no splat has are not in the file.
    let mut plain = Cloud::new(DVec3::ZERO);
    plain.push(&Splat { position: Vec3::X, ..Splat::default() });
    let bytes = file(&plain);
    let head = String::from_utf8_lossy(&bytes).into_owned();
    assert!(!head.contains("property float nx") && !head.contains("property float tx"), "{head}");
    assert_eq!(made(&read(&bytes).unwrap(), &SurfelParams::default()), plain);
    assert!(
        head.contains("comment object 1: a\\nb\n") && head.contains("comment red green blue: linear Rec.709 colour\n"),
        "{head}"
    );
    assert!(read(&file(&Cloud::new(DVec3::ZERO))).unwrap().is_empty());
}

fn packed(cloud: &Cloud) -> Vec<u8> {
    packed_splats_to_ply(cloud, &["it".into()], &[], &FootprintStack::default()).unwrap()
}

#[test]
fn packed_splats_are_read_as_they_unpack() {
    let written = cloud(2000);
    let unpacked = PackedCloud::new(&written).unwrap().unpack();
    let points = read(&packed(&written)).unwrap();
    assert_eq!(made(&points, &SurfelParams::default()), unpacked);
    // Of what scans and meshes become, in their order.
    let mut discs = Cloud::new(DVec3::ZERO);
    for i in (0..2000).map(|i| written.get(i)) {
        let none = Vec3::ZERO;
        discs.push(&Splat {
            shading_normal: none,
            tangent: none,
            shadow_coefficient: 1.0,
            value: 0.0,
            crossing_depth: 0.0,
            ..i
        });
    }
    discs.canonicalize();
    let small = packed(&discs).len();
    let whole = file(&discs).len();
    assert!(small < 17 * 2000 && whole > 48 * 2000, "{small} {whole}");
    assert!(read(&packed(&Cloud::new(DVec3::ZERO))).unwrap().is_empty());
}

#[test]
fn wrong_packed_files_are_refused_with_their_place() {
    let whole = packed(&cloud(4));
    let end = whole.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let count = format!("element packed {}", whole.len() - end);
    let less = format!("element packed {}", whole.len() - end - 1);
    for (from, to, expected) in [
        (count.as_str(), less.as_str(), "expected packed splats, found"),
        ("property uchar byte", "property char byte", "expected one property 'uchar byte' of 'packed'"),
        ("origin 637012.23987", "origin 637012.5", "expected packed splats about the origin that the header states"),
        (
            "element packed",
            "element vertex 0\nproperty float x\nelement packed",
            "expected an element 'vertex' or 'packed', found both",
        ),
    ] {
        let error = read(&with(&whole, from, to)).unwrap_err();
        assert!(error.starts_with("s.ply") && error.contains(expected), "{from} {to}: {error}");
    }
    // The lowest x of the block is no number.
    let mut broken = whole.clone();
    broken[end + 48..end + 52].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = read(&broken).unwrap_err();
    assert!(error.contains("position of splat 0: "), "{error}");
    let drop = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let Ok((Loaded::Points(points), _)) = bytes("s.ply", &broken, &drop, None) else { panic!("refused") };
    assert_eq!((points.len(), points.dropped), (0, 4));
}

/// Any program may write the same numbers as text.
#[test]
fn text_of_the_same_numbers_is_the_same() {
    let written = cloud(20);
    let bytes = file(&written);
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let mut text = String::from_utf8(bytes[..end].to_vec()).unwrap().replace("binary_little_endian", "ascii");
    for s in (0..written.len()).map(|i| written.get(i)) {
        let v = |v: Vec3| format!("{:?} {:?} {:?}", v.x, v.y, v.z);
        text += &format!(
            "{} {:?} {:?} {:?} {:?} {:?} {} {} {} {} {} {} {} {:?} {:?} {:?}\n",
            v(s.position),
            s.radius,
            s.cross_section,
            s.color[0],
            s.color[1],
            s.color[2],
            s.kind as u8,
            s.material,
            s.footprint,
            s.object,
            v(s.normal),
            v(s.shading_normal),
            v(s.tangent),
            s.shadow_coefficient,
            s.value,
            s.crossing_depth,
        );
    }
    assert_eq!(made(&read(text.as_bytes()).unwrap(), &SurfelParams::default()), written);
}

#[test]
fn splats_are_moved_chosen_and_coloured_as_points_are() {
    let written = cloud(60);
    let points = read(&file(&written)).unwrap();
    let rotation = DQuat::from_rotation_y(0.5);
    let transform = Similarity { scale: 2.0, rotation, translation: DVec3::Z };
    let splat = SplatParams { transform, material: 3, object: 7, color: [0.5; 3], ..SplatParams::default() };
    let moved = made(&points, &SurfelParams { splat, colors: false, ..SurfelParams::default() });
    for i in 0..written.len() {
        let [a, b] = [&written, &moved].map(|c| c.origin + c.position[i].as_dvec3());
        assert!((transform.apply(a) - b).length() < 1e-3, "{a} {b}");
        assert_eq!(
            [moved.radius[i], moved.cross_section[i]],
            [2.0 * written.radius[i], 4.0 * written.cross_section[i]]
        );
        assert!((moved.normal[i].as_dvec3() - rotation * written.normal[i].as_dvec3()).length() < 1e-6);
        assert!((moved.tangent_of(i).length() - 2.0 * written.tangent_of(i).length()).abs() < 1e-6);
        assert_eq!((moved.material[i], moved.object[i], moved.color[i]), (3, 7, [0.5; 3]));
    }
    let keep = [Kept { column: "kind".into(), within: Within::Range([1.0, 1.0]) }];
    let shown = PointsShown { keep: &keep, ..PointsShown::default() };
    let surfaces = shown_points(points.clone().into(), &shown, &SplatParams::default()).unwrap().points;
    assert_eq!(surfaces.ready.kinds(), [0, 20, 0]);
    assert_eq!(
        made(&surfaces, &SurfelParams::default()),
        written.gather(&(0..20).map(|i| 3 * i + 1).collect::<Vec<u32>>())
    );
    let numbers = |name: &str| points.column(name, DVec3::Y).unwrap();
    assert_eq!((numbers("value")[3], numbers("crossing_depth")[0]), (f64::from(written.value[3]), 0.0));
    assert!(points.column_names().any(|name| name == "cross_section") && points.column("heat", DVec3::Y).is_none());
}

#[test]
fn splats_refuse_what_would_make_something_else_of_them() {
    let points = read(&file(&cloud(6))).unwrap();
    let refused = |params: SurfelParams| raw_to_surfels(&points, &params, None).unwrap_err().to_string();
    let elliptical = refused(SurfelParams { shape: DiscShape::Elliptical, ..SurfelParams::default() });
    assert!(elliptical.contains("discs is Elliptical, expected none: splats of a file"), "{elliptical}");
    let profile = Footprint { cutoff: 2.0 };
    let splat = SplatParams { profile, ..SplatParams::default() };
    let other = refused(SurfelParams { splat, ..SurfelParams::default() });
    assert!(other.contains("footprint is cut at 2 standard deviations, where splats of the file are at 3"), "{other}");
    let medium = raw_to_matter(&points, &MatterParams::default(), None).unwrap_err().to_string();
    assert!(medium.contains("splats of a file are what they are"), "{medium}");
    assert!(thinned(&points, 0.1, &SplatParams::default()).is_err());
    let stated = PointsShown { has_opacity: true, ..PointsShown::default() };
    let error = shown_points(points.clone().into(), &stated, &SplatParams::default()).unwrap_err().to_string();
    assert!(error.contains("opacity is stated, expected none"), "{error}");
}

/// Changes a word of the header, whose length may change.
fn with(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = file.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

#[test]
fn wrong_files_are_refused_with_their_place() {
    let whole = file(&cloud(4));
    let body = whole.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let record = (whole.len() - body) / 4;
    for (from, to, expected) in [
        ("organza splats 1", "organza splats 2", "s.ply:3: expected splats of version 1, found '2'"),
        ("comment organza splats 1\n", "", "expected a comment 'organza splats 1' in the header, found none"),
        (
            "comment organza origin",
            "comment origin",
            "expected a comment 'organza origin X Y Z' in the header, found none",
        ),
        ("origin 637012.23987", "origin nan", "s.ply:4: expected three finite numbers, found 'nan "),
        (
            "organza footprint 0 3.0",
            "organza footprint 0 9.0",
            "s.ply:5: expected footprint 0 and its cutoff, from 1 to 8, found '0 9.0'",
        ),
        (
            "property float ny",
            "property float nq",
            ": expected a property of splats, as the header's comments name them, found 'nq'",
        ),
        (
            "property float cross_section",
            "property int cross_section",
            ": expected a float for each 'cross_section', found another type",
        ),
        (
            "property uint object",
            "property float object",
            ": expected a whole number for each 'object', found another type",
        ),
        ("element vertex 4", "element vertex 5", ": expected at most 4 records"),
    ] {
        let error = read(&with(&whole, from, to)).unwrap_err();
        assert!(error.contains(expected), "{from} → {to}: {error}");
    }
    let lines = |from: &str| with(&whole, &format!("property float {from}\n"), "");
    let alone = read(&lines("ny")).unwrap_err();
    assert!(alone.contains("expected a property 'ny' of 'vertex', found 'nx' alone"), "{alone}");
    let alone = read(&lines("cross_section")).unwrap_err();
    assert!(alone.contains("expected a property 'cross_section' of 'vertex', found none"), "{alone}");
    // Numbers of the second splat: its radius, its kind.
    let put = |offset: usize, new: &[u8]| {
        let mut file = whole.clone();
        file[body + record + offset..][..new.len()].copy_from_slice(new);
        read(&file).unwrap_err()
    };
    let radius = put(12, &0f32.to_le_bytes());
    assert!(
        radius.starts_with("s.ply@") && radius.contains("expected radius of splat 1: a finite number > 0, found 0"),
        "{radius}"
    );
    let kind = put(32, &[3]);
    assert!(
        kind.contains(&format!("s.ply@{}: expected kind from 0 to 2 of splat 1, found 3", body + record + 32)),
        "{kind}"
    );
    let footprint = put(35, &[9]);
    assert!(
        footprint.contains("expected a footprint of splat 1 that a comment of the header states, found 9"),
        "{footprint}"
    );
    for cut in (0..whole.len()).step_by(7) {
        let error = read(&whole[..cut]).unwrap_err();
        assert!(error.starts_with("s.ply"), "{cut}: {error}");
    }
    // Those that are not finite may be left out.
    let mut file = whole.clone();
    file[body + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let params = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let Ok((Loaded::Points(points), _)) = bytes("s.ply", &file, &params, None) else { panic!("refused") };
    assert_eq!((points.len(), points.dropped), (3, 1));
}
