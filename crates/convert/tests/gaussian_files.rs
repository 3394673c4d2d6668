//! 3D Gaussians: every kind of file gives the numbers that it was written from, within its own steps.

use crate::read_samples::gaussians::{
    CONSTANT, EXACT, Steps, Trained, agree, packed_ply, points, splat, spz, trained, trained_ply,
};
use crate::read_samples::{gzip, load};
use convert::{SurfelParams, raw_to_surfels};
use read::{Loaded, ReadParams, bytes};
use splat_core::RawPoints;
use splat_core::glam::DVec3;

#[test]
fn trained_gaussians_come_back_from_text_and_bytes() {
    for degree in 0..4 {
        let written: Vec<Trained> = (0..9).map(|i| trained(i, degree)).collect();
        for encoding in ["ascii", "binary_little_endian"] {
            agree(encoding, &points("a.ply", &trained_ply(&written, degree, encoding)), &written, degree, &EXACT);
        }
    }
    // Normals are named, for they are not used.
    let file = trained_ply(&[trained(0, 1)], 1, "binary_little_endian");
    let notes = bytes("a.ply", &file, &ReadParams::default(), None).unwrap().1;
    assert_eq!((notes.unused.join(" "), notes.format), ("nx ny nz".to_owned(), "Ply".to_owned()));
}

#[test]
fn packed_gaussians_come_back_within_the_steps_of_their_chunks() {
    for degree in [0, 1, 2, 3] {
        let written: Vec<Trained> = (0..300).map(|i| trained(i, degree)).collect();
        let steps = Steps {
            place: 4.01 / 1023.0,
            scale: 1.51 / 1023.0,
            turn: 0.004,
            opacity: 0.501 / 255.0,
            constant: 0.51 / 255.0,
            others: 4.01 / 256.0,
        };
        agree("packed", &points("a.compressed.ply", &packed_ply(&written, degree)), &written, degree, &steps);
    }
}

#[test]
fn splat_files_keep_all_but_the_color_of_directions() {
    let written: Vec<Trained> = (0..50).map(|i| trained(i, 2)).collect();
    let half = 0.501 / 255.0;
    // Four numbers within half a step of 1/128, which an angle has twice.
    let turn = 2.0 * 2.0 * 0.501 / 128.0;
    let steps = Steps { turn, opacity: half, constant: half / CONSTANT, ..EXACT };
    for (name, content) in [("a.splat", splat(&written)), ("a.splat.gz", gzip(&splat(&written)))] {
        agree(name, &points(name, &content), &written, 0, &steps);
    }
}

#[test]
fn spz_of_both_versions_comes_back_within_its_steps() {
    for (version, turn) in [(2, 0.15), (3, 0.004)] {
        for degree in 0..4 {
            let written: Vec<Trained> = (0..50).map(|i| trained(i, degree)).collect();
            let steps = Steps {
                place: 0.501 / 4096.0,
                scale: 0.501 / 16.0,
                turn,
                opacity: 0.501 / 255.0,
                constant: 0.501 / (255.0 * 0.15),
                others: 0.501 / 128.0,
            };
            let content = spz(&written, degree, version);
            let name = format!("version {version}");
            agree(&name, &points("a.spz", &gzip(&content)), &written, degree, &steps);
            // Its mark tells it, packed or not, whatever its name.
            agree(&name, &points("unnamed", &content), &written, degree, &steps);
        }
    }
}

#[test]
fn what_is_wrong_with_gaussians_is_said_with_its_place() {
    let one = [trained(0, 1)];
    let text = String::from_utf8(trained_ply(&one, 1, "ascii")).unwrap();
    let header = |from: &str, to: &str| text.replace(from, to).into_bytes();
    let last = text.lines().last().unwrap();
    let value = |place: usize, to: &str| {
        let mut words: Vec<&str> = last.split(' ').collect();
        words[place] = to;
        text.replace(last, &words.join(" ")).into_bytes()
    };
    let packed = packed_ply(&one, 1);
    let cut = |from: &str, to: &str| {
        let at = packed.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&packed[..at], to.as_bytes(), &packed[at + from.len()..]].concat()
    };
    let many: Vec<Trained> = (0..257).map(|i| trained(i, 0)).collect();
    let mut without_chunk = packed_ply(&many, 0);
    let body = without_chunk.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    without_chunk.drain(body..body + 18 * 4);
    let chunks = without_chunk.windows(15).position(|w| w == b"element chunk 2").unwrap();
    without_chunk[chunks + 14] = b'1';
    let bytes_of = |at: usize, to: u8| {
        let mut content = spz(&one, 1, 3);
        content[at] = to;
        content
    };
    for (name, content, expected) in [
        ("a.ply", header("rot_3", "rot_4"), "a.ply:3: expected a property 'rot_3' of 'vertex', found none"),
        ("a.ply", header("f_rest_8", "f_rest_9"), "f_rest_0 to f_rest_8, to f_rest_23 or to f_rest_44"),
        ("a.ply", value(2, "nan"), "expected a place of finite numbers for Gaussian 0"),
        ("a.ply", value(19, "90"), "deviations of a reasonable size"),
        ("a.ply", value(6, "inf"), "colours of numbers from −10000 to 10000"),
        ("a.ply", cut("element chunk 1", "element chunk 0"), "the end of the file after the last element"),
        ("a.ply", without_chunk, "a chunk for each 256 of 257 Gaussians"),
        ("a.ply", cut("max_scale_z", "max_scale_w"), "a property 'max_scale_z' of 'chunk'"),
        ("a.ply", cut("f_rest_8", "f_rest_7"), "each property name once"),
        ("a.splat", vec![0; 33], "records of 32 bytes, at least one, found 33 bytes"),
        ("a.splat", Vec::new(), "records of 32 bytes"),
        ("a.spz", bytes_of(4, 5), "a.spz@4: expected version 1 to 4, found 5"),
        ("a.spz", bytes_of(12, 5), "harmonics of degree 0 to 4, found 5"),
        ("a.spz", bytes_of(8, 2), "bytes for 2 Gaussians of degree 1"),
        ("a.spz", b"NGSP".to_vec(), "a header of 16 bytes"),
    ] {
        let error = load(name, &content).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\nis not: {expected}");
    }
}

#[test]
fn gaussians_that_are_no_numbers_are_dropped_where_that_is_asked_for() {
    let mut written: Vec<Trained> = (0..3).map(|i| trained(i, 1)).collect();
    written[1].position[0] = f64::NAN;
    let params = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let file = trained_ply(&written, 1, "binary_little_endian");
    let Loaded::Points(points) = bytes("a.ply", &file, &params, None).unwrap().0 else { panic!("no points") };
    assert_eq!(points.dropped, 1);
    written.remove(1);
    agree("dropped", &points, &written, 1, &EXACT);
}

#[test]
fn a_cloud_has_the_gaussians_and_balls_that_stand_for_them() {
    let written: Vec<Trained> = (0..20).map(|i| trained(i, 3)).collect();
    let points = points("a.ply", &trained_ply(&written, 3, "binary_little_endian"));
    let cloud = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap().0;
    cloud.validate().unwrap();
    assert_eq!(*cloud.gaussians, points.gaussians);
    let predicted = convert::cost::raw_points(&points, &SurfelParams::default()).unwrap();
    assert_eq!((predicted.splats, predicted.bytes), (20, cloud.bytes()));
    for (i, t) in written.iter().enumerate() {
        assert_eq!((cloud.gaussian_of(i), cloud.color[i]), (Some(i), points.color[i]));
        let footprint = splat_core::Footprint::default();
        let peak = footprint.norm() * footprint.profile(0.0) / f64::from(cloud.radius[i]).powi(2);
        let depth = f64::from(cloud.cross_section[i]) * peak;
        assert!((-(-depth).exp_m1() - t.opacity.min(0.99)).abs() < 1e-5, "{i}: {depth}");
    }
    let thin = convert::thinned(&points, 0.1, &SurfelParams::default().splat).unwrap_err().to_string();
    assert!(thin.contains("3D Gaussians have no mean"), "{thin}");
    // Half as transparent, in one colour.
    let params = SurfelParams { opacity: 0.5, colors: false, ..SurfelParams::default() };
    let plain = raw_to_surfels(&points, &params, None).unwrap().0;
    assert_eq!((plain.gaussians.degree, plain.gaussians.opacity[0]), (0, 0.5 * cloud.gaussians.opacity[0]));
    let color = plain.color_along(0, DVec3::X.as_vec3());
    assert!(color.iter().all(|c| (c - 1.0).abs() < 1e-6), "{color:?}");
}

#[test]
fn the_bulk_of_gaussians_leaves_the_farthest_out() {
    assert_eq!(RawPoints::default().bulk(), None);
    let mut written: Vec<Trained> = (0..200).map(|i| trained(i, 0)).collect();
    written[7].position = [1e4, -1e4, 1e4];
    let bulk = points("a.ply", &trained_ply(&written, 0, "ascii")).bulk().unwrap();
    assert!(bulk.size().max_element() < 12.0 && bulk.size().min_element() > 7.0, "{bulk:?}");
    // Of few all count, with two deviations of each.
    let one = Trained { scale: [0.0; 3], ..trained(0, 0) };
    let bulk = points("a.ply", &trained_ply(&[one], 0, "ascii")).bulk().unwrap();
    assert!((bulk.size() - DVec3::splat(4.0)).abs().max_element() < 1e-5, "{bulk:?}");
}
