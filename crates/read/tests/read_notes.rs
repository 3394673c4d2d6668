//! What readers leave aside is named, and what they cannot show is refused by name.
#![cfg(all(feature = "ply", feature = "obj", feature = "las"))]

use crate::read_samples::{las, load, obj, ply_ascii, ply_binary, text_points};
use read::{ReadParams, bytes};

fn unused(name: &str, content: &[u8]) -> Vec<String> {
    bytes(name, content, &ReadParams::default(), None).unwrap().1.unused
}

#[test]
fn every_column_that_is_not_used_is_named() {
    for content in [ply_ascii().into_bytes(), ply_binary(false), ply_binary(true)] {
        assert_eq!(unused("a.ply", &content), ["skipped", "camera.focal"]);
    }
    assert!(unused("a.csv", &text_points(",", "x,y,z,nx,ny,nz\n")).is_empty());
    let names = "x,y,z,nx,\"return number\",t\n".replace(' ', "_");
    assert_eq!(unused("a.csv", &text_points(",", &names)), ["nx", "return_number", "t"]);
    assert!(unused("a.xyz", &text_points(" ", "")).is_empty());
    assert_eq!(unused("a.obj", &obj()), ["usemtl", "vt"]);
    let always = ["return_number", "number_of_returns", "flags", "scan_angle", "user_data", "point_source_id"];
    for compressed in [false, true] {
        assert_eq!(unused("a.las", &las(0, 3, compressed)), always);
        assert_eq!(unused("a.las", &las(1, 3, compressed))[6..], ["gps_time"]);
        assert_eq!(unused("a.las", &las(8, 3, compressed))[6..], ["gps_time", "nir"]);
    }
    // A name cannot steer the terminal.
    let steering = ply_ascii().replace("focal", "a\u{1b}[2J");
    assert_eq!(unused("a.ply", steering.as_bytes())[1], "camera.a\\u{1b}[2J");
}

#[test]
fn extra_bytes_of_las_are_named_as_the_file_does() {
    let plain = las(0, 3, false);
    let points = u32::from_le_bytes(plain[96..100].try_into().unwrap()) as usize;
    let record = 20;
    let widened = |described: &[u8]| {
        let mut out = plain[..points].to_vec();
        out[96..100].copy_from_slice(&((points + described.len()) as u32).to_le_bytes());
        out[100..104].copy_from_slice(&u32::from(!described.is_empty()).to_le_bytes());
        out[105..107].copy_from_slice(&(record as u16 + 2).to_le_bytes());
        out.extend(described);
        plain[points..].chunks_exact(record).for_each(|r| out.extend(r.iter().chain(&[7, 7])));
        out
    };
    assert_eq!(unused("a.las", &widened(&[])).last().unwrap(), "2 extra bytes");
    let mut described = vec![0; 54 + 192];
    described[2..11].copy_from_slice(b"LASF_Spec");
    described[18] = 4;
    described[20] = 192;
    described[54 + 4..54 + 13].copy_from_slice(b"amplitude");
    assert_eq!(unused("a.las", &widened(&described)).last().unwrap(), "amplitude");
}

#[test]
fn points_with_an_opacity_are_no_gaussians() {
    let mut text = "ply\nformat ascii 1.0\nelement vertex 1\n".to_owned();
    let names = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 angle";
    names.split(' ').for_each(|n| text += &format!("property float {n}\n"));
    text += &format!("end_header\n{}1\n", "0 ".repeat(16));
    let error = load("a.ply", text.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("'rot_3'"), "{error}");
    load("a.ply", text.replace("rot_0", "turn").as_bytes()).unwrap();
}

/// Of a line of a megabyte of names each was held against all others, which took minutes.
#[test]
fn of_very_many_names_the_first_are_said() {
    let names: Vec<String> = (0..120_000).map(|i| format!("a{i}")).collect();
    let numbers = "1 ".repeat(names.len() + 3);
    let found = unused("a.xyz", format!("x y z {}\n{numbers}\n", names.join(" ")).as_bytes());
    assert_eq!((found.len(), found[511].as_str(), found[512].as_str()), (513, "a511", "further ones"));
}
