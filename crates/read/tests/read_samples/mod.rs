//! Small valid files of every format, made in memory.
#![allow(dead_code, unused_imports, reason = "each test file uses some of them")]

pub(crate) mod archives;
pub(crate) mod cells;
pub(crate) mod copc;
pub(crate) mod dicom;
pub(crate) mod e57;
pub(crate) mod gaussians;
pub(crate) mod grids;
pub(crate) mod images;
pub(crate) mod meshes;
pub(crate) mod oldest;
pub(crate) mod stacks;
pub(crate) mod volumes;

pub(crate) use meshes::*;

use read::{Loaded, ReadError, ReadParams, bytes};
use std::io::Write;

/// Corners of a unit square; two of them carry colours that test the sRGB curve.
pub(crate) const VERTICES: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [1.0, 1.0, 0.0], [0.0, 1.0, -0.5]];

pub(crate) fn load(name: &str, content: &[u8]) -> Result<Loaded, ReadError> {
    bytes(name, content, &ReadParams::default(), None).map(|read| read.0)
}

pub(crate) fn gzip(content: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(content).unwrap();
    encoder.finish().unwrap()
}

/// A quad and a triangle with normals, colours, ignored properties and an ignored element. Ends with one digit.
pub(crate) fn ply_ascii() -> String {
    let mut text = "ply\nformat ascii 1.0\ncomment a test\nelement vertex 4\nproperty uchar red\nproperty float x\n\
        property list uchar short skipped\nproperty double y\nproperty float z\nproperty float nx\nproperty float ny\n\
        property float nz\nproperty uchar green\nproperty uchar blue\nproperty int skipped_too\nelement camera 1\n\
        property float focal\nelement face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n"
        .to_owned();
    for (i, [x, y, z]) in VERTICES.iter().enumerate() {
        text += &format!("{} {x} {i}{} {y} {z} 0 0 2 255 128 -7\n", i * 10, " 5".repeat(i));
    }
    text + "35.5\n0 4 0 1 2 3\n1 3 0 2 3\n"
}

/// The same as bytes.
pub(crate) fn ply_binary(big: bool) -> Vec<u8> {
    let text = ply_ascii();
    let (header, _) = text.split_once("end_header\n").unwrap();
    let encoding = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut out = header.replace("ascii", encoding).into_bytes();
    out.extend(b"end_header\n");
    let mut put = |le: &[u8]| if big { out.extend(le.iter().rev()) } else { out.extend(le) };
    for (i, [x, y, z]) in VERTICES.iter().enumerate() {
        put(&[i as u8 * 10]);
        put(&x.to_le_bytes());
        put(&[i as u8]);
        (0..i).for_each(|_| put(&5i16.to_le_bytes()));
        put(&f64::from(*y).to_le_bytes());
        [*z, 0.0, 0.0, 2.0].iter().for_each(|v| put(&v.to_le_bytes()));
        put(&[255]);
        put(&[128]);
        put(&(-7i32).to_le_bytes());
    }
    put(&35.5f32.to_le_bytes());
    for face in [&[0u32, 4, 0, 1, 2, 3][..], &[1, 3, 0, 2, 3]] {
        put(&[face[0] as u8]);
        put(&[face[1] as u8]);
        face[2..].iter().for_each(|v| put(&v.to_le_bytes()));
    }
    out
}

/// Voxel type of [`nifti`]: code, bits, and the bytes of a value.
pub(crate) type Dtype = (i16, i16, fn(f64) -> Vec<u8>);

pub(crate) const NIFTI_U8: Dtype = (2, 8, |v| vec![v as u8]);
pub(crate) const NIFTI_F32: Dtype = (16, 32, |v| (v as f32).to_le_bytes().to_vec());

/// A 3 x 2 x 2 volume of the values 0 to 11, little or big endian, with an sform.
pub(crate) fn nifti((code, bits, encode): Dtype, big: bool) -> Vec<u8> {
    let mut h = vec![0u8; 352];
    let mut put = |at: usize, le: &[u8]| {
        let bytes: Vec<u8> = if big { le.iter().rev().copied().collect() } else { le.to_vec() };
        h[at..at + bytes.len()].copy_from_slice(&bytes);
    };
    put(0, &348i32.to_le_bytes());
    for (i, d) in [3i16, 3, 2, 2, 1, 1, 1, 1].iter().enumerate() {
        put(40 + 2 * i, &d.to_le_bytes());
    }
    put(70, &code.to_le_bytes());
    put(72, &bits.to_le_bytes());
    for (i, s) in [1.0f32, 2.0, 3.0, 4.0].iter().enumerate() {
        put(76 + 4 * i, &s.to_le_bytes());
    }
    put(108, &352f32.to_le_bytes());
    put(112, &0.5f32.to_le_bytes());
    put(116, &(-1f32).to_le_bytes());
    put(254, &1i16.to_le_bytes());
    for (i, v) in [0.0f32, -2.0, 0.0, 10.0, 3.0, 0.0, 0.0, 20.0, 0.0, 0.0, 4.0, -30.0].iter().enumerate() {
        put(280 + 4 * i, &v.to_le_bytes());
    }
    h[344..348].copy_from_slice(b"n+1\0");
    for v in 0..12 {
        let mut bytes = encode(f64::from(v));
        if big {
            bytes.reverse();
        }
        h.extend(bytes);
    }
    h
}

/// `n` points with offset 5e6 and scale 1e-3, point format `format`, as LAS or LAZ.
pub(crate) fn las(format: u8, n: i32, compressed: bool) -> Vec<u8> {
    let mut builder = las::Builder::from(if format < 6 { (1, 2) } else { (1, 4) });
    builder.point_format = las::point::Format::new(format).unwrap();
    builder.point_format.is_compressed = compressed;
    let axis = las::Transform { scale: 1e-3, offset: 5e6 };
    builder.transforms = las::Vector { x: axis, y: axis, z: las::Transform { scale: 0.01, offset: 0.0 } };
    builder.date = None;
    let header = builder.into_header().unwrap();
    let mut writer = las::Writer::new(std::io::Cursor::new(Vec::new()), header).unwrap();
    for i in 0..n {
        let [x, y, z] = las_steps(i);
        writer
            .write_point(las::Point {
                x: 5e6 + 1e-3 * f64::from(x),
                y: 5e6 + 1e-3 * f64::from(y),
                z: 0.01 * f64::from(z),
                intensity: (i * 3) as u16,
                classification: las::point::Classification::new((i % 7) as u8).unwrap(),
                color: has_color(format).then(|| las::Color::new(i as u16 % 256, 128, 255)),
                nir: (format == 8).then_some(i as u16),
                gps_time: (format == 1 || format >= 3).then(|| gps_time(i)),
                ..Default::default()
            })
            .unwrap();
    }
    writer.into_inner().unwrap().into_inner()
}

/// Times as of several sensors: steps, gaps, the same time again, and some from another day.
fn gps_time(i: i32) -> f64 {
    let step = f64::from(i / 3) * 0.01 + f64::from(i % 17);
    match i % 11 {
        0 => 1e9 + step,
        1 => 3.0,
        5 | 6 => 2e5,
        _ => step,
    }
}

fn has_color(format: u8) -> bool {
    matches!(format, 2 | 3 | 5 | 7 | 8 | 10)
}

/// Integer coordinates of point `i` of [`las`].
pub(crate) fn las_steps(i: i32) -> [i32; 3] {
    [1_234_500 + 67 * (i % 31).pow(2), -987_654 + i * 13, i % 5]
}

/// Two facets, binary or as text.
pub(crate) fn stl(binary: bool) -> Vec<u8> {
    let corners =
        [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 0.0, 1.0], [6.5, 0.0, 1.0], [5.0, 2.0, 1.0]];
    let mut out = if binary { [vec![b' '; 80], 2u32.to_le_bytes().to_vec()].concat() } else { b"solid two\n".to_vec() };
    for facet in corners.chunks(3) {
        if binary {
            out.extend([0; 12]);
            facet.iter().flatten().for_each(|c| out.extend(c.to_le_bytes()));
            out.extend([0; 2]);
        } else {
            out.extend(b"facet normal 0 0 1\nouter loop\n");
            facet.iter().for_each(|[x, y, z]| out.extend(format!("vertex {x} {y} {z}\n").bytes()));
            out.extend(b"endloop\nendfacet\n");
        }
    }
    if !binary {
        out.extend(b"endsolid\n");
    }
    out
}

/// A quad and a triangle with normals.
pub(crate) fn obj() -> Vec<u8> {
    b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvt 0 0\nvn 0 0 2\nusemtl stone\nf 1//1 2//1 3//1 4//1\nf -4 -2 -1\n"
        .to_vec()
}

/// Points with normals, words between `separator`, after the line `names`.
pub(crate) fn text_points(separator: &str, names: &str) -> Vec<u8> {
    let line = |i: i32| ["0.25", &i.to_string(), "-1.5e1", "0", "0.6", "0.8"].join(separator) + "\n";
    (names.to_owned() + &(0..20).map(line).collect::<String>()).into_bytes()
}

/// A 3 x 2 x 2 volume of floats 0 to 11.
pub(crate) fn nrrd(encoding: &str) -> Vec<u8> {
    let header = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace: right-anterior-superior\nsizes: 3 2 2\n\
         space directions: (2,0,0) (0,-1,0) (0,0,3)\nspace origin: (1,2,3)\nendian: little\nencoding: {encoding}\n\n"
    );
    let raw: Vec<u8> = (0..12).flat_map(|v| (v as f32).to_le_bytes()).collect();
    let data = match encoding {
        "raw" => raw,
        "gzip" => gzip(&raw),
        _ => (0..12).map(|v| format!("{v} ")).collect::<String>().into_bytes(),
    };
    [header.into_bytes(), data].concat()
}
