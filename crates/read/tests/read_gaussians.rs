//! 3D Gaussians as web viewers and exchange formats write them.

use crate::read_samples::archives::{
    archive, gaussian_glb, gaussian_glb_with, ksplat, sog, sog_files, spz_glb, webp, zip,
};
use crate::read_samples::gaussians::{
    CONSTANT, EXACT, Steps, Trained, agree, points, spz, spz_4, trained, trained_ply,
};
use crate::read_samples::{gzip, load};
use read::{Loaded, Notes, ReadError, ReadParams, bytes, file, up_axis};
use splat_core::UpAxis;
use std::fs;
use std::path::PathBuf;

fn written(count: usize, degree: usize) -> Vec<Trained> {
    (0..count).map(|i| trained(i, degree)).collect()
}

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("gaussians-{name}"));
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn read(name: &str, content: &[u8]) -> Result<(Loaded, Notes), ReadError> {
    bytes(name, content, &ReadParams::default(), None)
}

#[track_caller]
fn refused(name: &str, content: &[u8], expected: &str) {
    let error = load(name, content).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}\nis not: {expected}");
}

/// Steps of SOG: half a step of the tables of the samples.
fn sog_steps(is_coded: bool) -> Steps {
    let opacity = if is_coded { 0.501 / 255.0 } else { 0.25 * 8.0 * 0.501 / 255.0 };
    // The derivative of a place by its logarithm is 1 + |p|, at most 5.
    let place = 5.0 * 2.0 * 5f64.ln() * 0.501 / 65535.0;
    Steps { place, scale: 3.0 * 0.501 / 255.0, turn: 0.02, opacity, constant: 0.501 / 255.0, others: 0.501 / 255.0 }
}

#[test]
fn sog_comes_back_within_its_steps() {
    for degree in 0..4 {
        // More than a row of the palette.
        let written = written(70, degree);
        agree("sog", &points("a.sog", &sog(&written, degree)), &written, degree, &sog_steps(true));
        let oldest = zip(&sog_files(&written, degree, 1));
        agree("version 1", &points("unnamed", &oldest), &written, degree, &sog_steps(false));
    }
}

#[test]
fn sog_lies_in_a_folder_too_or_in_one_of_an_archive() {
    let written = written(5, 2);
    let files = sog_files(&written, 2, 2);
    let folder = folder("sog");
    files.iter().for_each(|(name, content)| fs::write(folder.join(name), content).unwrap());
    for path in [folder.clone(), folder.join("meta.json")] {
        let (loaded, notes) = file(&path, &ReadParams::default(), None).unwrap();
        let Loaded::Points(points) = loaded else { panic!("points") };
        agree("folder", &points, &written, 2, &sog_steps(true));
        assert_eq!((notes.format.as_str(), up_axis(&path)), ("Sog", UpAxis::MinusY));
    }
    let within: Vec<_> = files.iter().map(|(name, content)| (format!("scene/{name}"), content.clone())).collect();
    agree("within", &points("a.sog", &zip(&within)), &written, 2, &sog_steps(true));
    agree("packed", &points("a.sog", &archive(&files, true)), &written, 2, &sog_steps(true));
    // Images are not looked for outside of the folder.
    let json = String::from_utf8(files[0].1.clone()).unwrap().replace("means_l.webp", "../means_l.webp");
    fs::write(folder.join("meta.json"), json).unwrap();
    let error = file(&folder, &ReadParams::default(), None).unwrap_err().to_string();
    assert!(error.contains("a file in the same folder or below"), "{error}");
}

/// The archive of a scene with one of its files changed.
fn changed(name: &str, change: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let mut files = sog_files(&written(5, 1), 1, 2);
    let (_, content) = files.iter_mut().find(|(file, _)| file == name).unwrap();
    *content = change(content);
    zip(&files)
}

fn described(from: &str, to: &str) -> Vec<u8> {
    changed("meta.json", |content| {
        let text = String::from_utf8(content.to_vec()).unwrap();
        assert!(text.contains(from), "{text}");
        text.replace(from, to).into_bytes()
    })
}

#[test]
fn what_is_wrong_with_sog_is_said() {
    let mut without = sog_files(&written(5, 1), 1, 2);
    without.remove(4);
    for (content, expected) in [
        (zip(&without), "an archive without 'quats.webp'"),
        (zip(&without[1..]), "an archive without meta.json"),
        (described("\"version\":2", "\"version\":3"), "expected version 1 or 2 in meta.json, found 3"),
        (
            described("\"count\":5,\"means\"", "\"means\""),
            "a `count` of Gaussians in meta.json, at least 1, found none",
        ),
        (
            described("\"count\":5,\"means\"", "\"count\":9,\"means\""),
            "a pixel for each of 9 Gaussians, found 4 x 2 pixels",
        ),
        (
            described("\"codebook\":[-4.0,", "\"codebook\":["),
            "256 numbers in `scales.codebook` of meta.json, found 255",
        ),
        (described("\"bands\":1", "\"bands\":2"), "a width of 512 pixels of 'shN_centroids.webp', found 192 pixels"),
        (
            described("\"count\":5,\"bands\"", "\"count\":4,\"bands\""),
            "a row of the palette of harmonics for Gaussian 0, found row 4 of 4",
        ),
        (described("\"quats\"", "\"quads\""), "missing field `quats`"),
        (changed("quats.webp", |_| webp(&[[0; 4]; 8], 4)), "an alpha of a rotation from 252 to 255 for Gaussian"),
        (
            changed("sh0.webp", |content| content[..content.len() - 9].to_vec()),
            "'sh0.webp' as a whole WebP or PNG image",
        ),
        (changed("sh0.webp", |_| b"BM".to_vec()), "'sh0.webp' as a whole WebP or PNG image"),
        (b"{\"means\":".to_vec(), "a.sog: expected meta.json of SOG"),
    ] {
        refused("a.sog", &content, expected);
    }
    // A rotation of 255 is valid: the other values of black pixels are not.
    let params = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let dropped =
        changed("quats.webp", |_| webp(&[[128, 128, 128, 252], [0, 0, 0, 0], [9; 4], [9; 4], [128, 128, 128, 255]], 4));
    let Loaded::Points(points) = bytes("a.sog", &dropped, &params, None).unwrap().0 else { panic!("points") };
    assert_eq!((points.len(), points.dropped), (2, 3));
}

#[test]
fn sog_says_what_it_is_of() {
    let remarks = |content: &[u8]| read("a.sog", content).unwrap().1.remarks;
    assert!(remarks(&described("\"version\":2", "\"version\":2,\"antialias\":true"))[0].contains("keeps their light"));
    assert!(remarks(&described("\"version\":2", "\"version\":2,\"model\":\"new\""))[0].contains("'new'"));
    // Discs have no third deviation; a first number of a table that is null lies a step below the second.
    let flat = described("\"version\":2", "\"version\":2,\"model\":\"2dgs\"");
    let flat = points("a.sog", &flat).gaussians;
    assert!(flat.axes.iter().all(|axes| axes[2].length() == 0.0 && axes[1].length() > 0.0));
    let patched = described("\"codebook\":[-4.0,", "\"codebook\":[null,");
    agree("null", &points("a.sog", &patched), &written(5, 1), 1, &sog_steps(true));
}

#[test]
fn damaged_images_of_sog_are_refused_or_valid() {
    /// Every how manieth bit is flipped.
    const STRIDE: usize = 7;
    let files = sog_files(&written(5, 1), 1, 2);
    for at in [1, 4, 6, 7] {
        let (name, whole) = files[at].clone();
        let with = |content: &[u8]| {
            let mut files = files.clone();
            files[at].1 = content.to_vec();
            load("a.sog", &zip(&files))
        };
        for length in 0..whole.len() - 1 {
            // The last byte of a chunk may be padding.
            let is_refused = with(&whole[..length]).is_err();
            assert!(is_refused || length + 2 > whole.len(), "{name}: {length} of {}", whole.len());
        }
        for bit in (0..8 * whole.len()).step_by(STRIDE) {
            let mut content = whole.clone();
            content[bit / 8] ^= 1 << (bit % 8);
            if let Ok(Loaded::Points(points)) = with(&content) {
                points.validate().unwrap();
            }
        }
    }
}

#[test]
fn ksplat_of_every_level_comes_back_within_its_steps() {
    for level in 0..3 {
        for degree in 0..3 {
            // Full buckets, and one that is not full, in two sections.
            let written = written(11, degree);
            let half = 2f64.powi(-11);
            let place = 5.0 / 32767.0 * 0.501 + 1e-6;
            let packed = Steps { place, scale: 1.01 * half, turn: 4.0 * half, others: half, ..EXACT };
            let steps = match level {
                0 => EXACT,
                1 => packed,
                _ => Steps { others: 1.5 * 0.501 / 255.0, ..packed },
            };
            let steps = Steps { opacity: 0.501 / 255.0, constant: 0.501 / 255.0 / CONSTANT, ..steps };
            let content = ksplat(&written, degree, level);
            agree(&format!("level {level}"), &points("a.ksplat", &content), &written, degree, &steps);
        }
    }
}

#[test]
fn what_is_wrong_with_ksplat_is_said() {
    let with = |at: usize, to: u8| {
        let mut content = ksplat(&written(4, 1), 1, 1);
        content[at] = to;
        content
    };
    let longer = [&with(0, 0)[..], &[0; 3]].concat();
    for (content, expected) in [
        (with(0, 1), "a.ksplat@0: expected version 0.1 of .ksplat, found version 1.1"),
        (with(1, 0), "found version 0.0"),
        (with(20, 3), "a.ksplat@20: expected a level of compression from 0 to 2, found 3"),
        (with(16, 0), "at least one Gaussian, found none"),
        (with(16, 5), "a.ksplat@16: expected 4 Gaussians, as the sections hold, found 5"),
        (with(6, 1), "section headers of 1024 bytes"),
        (with(4096, 3), "at most 2 Gaussians, for which there is room, found 3"),
        (with(4096 + 40, 3), "harmonics of degree 0 to 2, found 3"),
        (with(4096 + 20, 16), "12 bytes for the middle of a bucket, found 16"),
        (with(4096 + 36, 0), "1 buckets with 2 Gaussians, found 0 with 0"),
        (longer, "the end of the file after the last section, found 3 bytes more"),
        (vec![0; 100], "a header of 4096 bytes, found 100 bytes"),
    ] {
        refused("a.ksplat", &content, expected);
    }
}

/// Steps of SPZ with 12 bits behind the point.
fn spz_steps(place: f64, turn: f64) -> Steps {
    Steps {
        place,
        scale: 0.501 / 16.0,
        turn,
        opacity: 0.501 / 255.0,
        constant: 0.501 / (255.0 * 0.15),
        others: 0.501 / 128.0,
    }
}

#[test]
fn spz_of_the_first_and_the_last_version_comes_back_within_its_steps() {
    for degree in 0..4 {
        let written = written(20, degree);
        // Half floats below 4 are a 512th apart at most.
        let first = gzip(&spz(&written, degree, 1));
        agree("version 1", &points("a.spz", &first), &written, degree, &spz_steps(1.01 / 1024.0, 0.15));
        let last = spz_4(&written, degree);
        agree("version 4", &points("a.spz", &last), &written, degree, &spz_steps(0.501 / 4096.0, 0.004));
    }
    // Degree 4 is stored, and drawn to degree 3.
    let mut fourth = written(3, 3);
    fourth.iter_mut().for_each(|t| t.harmonics.resize(25, [0.25; 3]));
    let content = spz_4(&fourth, 4);
    agree("degree 4", &points("a.spz", &content), &fourth, 3, &spz_steps(0.501 / 4096.0, 0.004));
    assert!(read("a.spz", &content).unwrap().1.warnings[0].contains("degree 4"));
}

#[test]
fn what_is_wrong_with_spz_of_version_4_is_said() {
    let whole = spz_4(&written(2, 1), 1);
    let with = |at: usize, to: u8| {
        let mut content = whole.clone();
        content[at] = to;
        content
    };
    let longer = [&whole[..], &[0]].concat();
    let data = 32 + 6 * 16;
    for (content, expected) in [
        (with(15, 5), "a.spz@15: expected 6 parts for 2 Gaussians of degree 1, found 5"),
        (with(16, 31), "a.spz@16: expected a list of 6 parts from byte 32 on"),
        (with(19, 1), "a.spz@16: expected a list of 6 parts from byte 32 on"),
        (with(40, 17), "a.spz@40: expected 18 bytes of part 0, found 17"),
        (with(39, 1), "a.spz@32: expected part 0 within the"),
        (with(data, 0), "expected 18 bytes packed with Zstandard"),
        (longer, "the end of the file after the last part, found 1 bytes more"),
        (whole[..20].to_vec(), "a header of 32 bytes, found 20 bytes"),
        (with(4, 5), "a.spz@4: expected version 1 to 4, found 5"),
    ] {
        refused("a.spz", &content, expected);
    }
    // An extension of four bytes, and the one that states axes.
    let mut extended = whole.clone();
    extended[14] = 2;
    extended[16] = 32 + 24;
    let records = [[2, 0, 0xbe, 0xad, 4, 0, 0, 0, 9, 9, 9, 9], [3, 0, 0xbe, 0xad, 4, 0, 0, 0, 1, 0, 0, 0]];
    extended.splice(32..32, records.as_flattened().iter().copied());
    let notes = read("a.spz", &extended).unwrap().1;
    assert_eq!(notes.unused, ["extension 0xadbe0002", "extension 0xadbe0003"]);
    assert!(notes.warnings[0].contains("states its axes"), "{notes:?}");
}

#[test]
fn gltf_has_gaussians_as_attributes() {
    for degree in 0..4 {
        let written = written(9, degree);
        agree("glb", &points("a.glb", &gaussian_glb(&written, degree)), &written, degree, &EXACT);
        let drafted = gaussian_glb_with(&written, degree, "\"colorSpace\":\"srgb_rec709_display\"", |s| s, "");
        agree("draft", &points("a.glb", &drafted), &written, degree, &EXACT);
        assert!(read("a.glb", &drafted).unwrap().1.remarks[0].contains("natural logarithms"));
    }
    // A node turns shapes and colours along: a half turn about y negates x and z.
    let written = written(4, 1);
    let node = "\"rotation\":[0,1,0,0],\"scale\":[2,2,2],\"translation\":[1,2,3],";
    let turned = points("a.glb", &gaussian_glb_with(&written, 1, "\"projection\":\"perspective\"", f64::exp, node));
    for (i, t) in written.iter().enumerate() {
        let [x, y, z] = t.position;
        let place = [1.0 - 2.0 * x, 2.0 + 2.0 * y, 3.0 - 2.0 * z];
        assert!(turned.exact_position(i).distance(place.into()) < 1e-5, "{i}");
        let axis = turned.gaussians.axes[i][0];
        assert!((f64::from(axis.length()) / (2.0 * t.scale[0].exp()) - 1.0).abs() < 1e-5, "{i}");
        // Harmonics of degree 1 are −y, z, −x.
        let harmonics = &turned.gaussians.harmonics[4 * i..][..4];
        for (k, sign) in [1.0, 1.0, -1.0, -1.0].into_iter().enumerate() {
            assert!((f64::from(harmonics[k][0]) - sign * t.harmonics[k][0]).abs() < 1e-5, "{i} {k}");
        }
    }
    let linear =
        points("a.glb", &gaussian_glb_with(&written, 0, "\"colorSpace\":\"lin_rec709_display\"", f64::exp, ""));
    for (i, t) in written.iter().enumerate() {
        let stated = t.harmonics[0].map(|c| 0.5 + CONSTANT * c);
        (0..3).for_each(|c| assert!((f64::from(linear.color[i][c]) - stated[c]).abs() < 1e-5, "{i}"));
    }
}

#[test]
fn gltf_has_gaussians_as_spz() {
    let written = written(9, 2);
    for content in [gzip(&spz(&written, 2, 2)), spz(&written, 2, 2)] {
        for is_nested in [false, true] {
            let file = spz_glb(&content, is_nested);
            agree("spz", &points("a.glb", &file), &written, 2, &spz_steps(0.501 / 4096.0, 0.15));
        }
    }
    let file = spz_glb(&spz_4(&written, 2), true);
    agree("version 4", &points("a.glb", &file), &written, 2, &spz_steps(0.501 / 4096.0, 0.004));
}

#[test]
fn what_is_wrong_with_gaussians_in_gltf_is_said() {
    let with = |from: &str, to: &str| {
        let content = gaussian_glb(&written(2, 1), 1);
        let at = content.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&content[..at], to.as_bytes(), &content[at + from.len()..]].concat()
    };
    let node = |keys: &str| gaussian_glb_with(&written(2, 1), 1, "\"kernel2\":1", f64::exp, keys);
    for (content, expected) in [
        (with("\"mode\":0", "\"mode\":4"), "3D Gaussians in a primitive of points (mode 0), found mode 4"),
        (with("SH_DEGREE_1_COEF_0", "SH_DEGREE_1_COEF_7"), "an attribute KHR_gaussian_splatting:SH_DEGREE_1_COEF_0"),
        (with("splatting:OPACITY", "splatting:0PACITY"), "an attribute KHR_gaussian_splatting:OPACITY of 3D Gaussians"),
        (
            with("\"count\":2,\"type\":\"VEC4\"", "\"count\":1,\"type\":\"VEC4\""),
            "2 entries of each attribute of 3D Gaussians, found 1",
        ),
        (node("\"scale\":[1,2,1],"), "moved, turned and scaled by one number"),
        (
            spz_glb(b"NGSP", true),
            "a.glb: expected a header of 16 bytes in the SPZ file of buffer view 0, found 4 bytes",
        ),
    ] {
        refused("a.glb", &content, expected);
    }
    let notes = read("a.glb", &with("\"ellipse\"", "\"sphere!\"")).unwrap().1;
    assert_eq!(notes.remarks, ["its kernel 'sphere!' is not known: ellipse is taken in its place"]);
}

#[test]
fn ply_has_gaussians_with_colors_in_the_place_of_harmonics_and_without_a_third_deviation() {
    let written = written(3, 0);
    let text = String::from_utf8(trained_ply(&written, 0, "ascii")).unwrap();
    // Columns of the sample: x y z nx ny nz, three of colours, opacity, three deviations, four of a rotation.
    let rewritten = |kind: &str, color: &dyn Fn(f64) -> String| {
        let (header, body) = text.split_once("end_header\n").unwrap();
        let mut header = header.to_owned();
        for (k, name) in ["red", "green", "blue"].iter().enumerate() {
            header = header.replace(&format!("float f_dc_{k}"), &format!("{kind} {name}"));
        }
        let record = |(line, t): (&str, &Trained)| {
            let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            (0..3).for_each(|c| words[6 + c] = color(0.5 + CONSTANT * t.harmonics[0][c]));
            words.join(" ") + "\n"
        };
        let body: String = body.lines().zip(&written).map(record).collect();
        header + "end_header\n" + &body
    };
    let bytes = rewritten("uchar", &|c| format!("{}", (255.0 * c).round()));
    agree(
        "bytes",
        &points("a.ply", bytes.as_bytes()),
        &written,
        0,
        &Steps { constant: 0.501 / 255.0 / CONSTANT, ..EXACT },
    );
    let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    let floats = rewritten("float", &|c| format!("{:e}", linear(c)));
    agree("floats", &points("a.ply", floats.as_bytes()), &written, 0, &EXACT);
    refused("a.ply", bytes.replace("uchar green", "uchar gruen").as_bytes(), "a property 'green' of 'vertex'");
    // Discs: the third deviation is another property.
    let discs = points("a.ply", text.replace("scale_2", "other").as_bytes()).gaussians;
    for (axes, t) in discs.axes.iter().zip(&written) {
        assert!((f64::from(axes[1].length()) / t.scale[1].exp() - 1.0).abs() < 1e-5 && axes[2].length() == 0.0);
    }
}
