//! Files that a shape is given as: PLY and NIfTI.

use std::fmt::Write as _;

/// Triangles as a mesh with corners of its own for each.
pub(crate) fn mesh(triangles: &[[[f64; 3]; 3]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * triangles.len(),
        triangles.len()
    );
    for [x, y, z] in triangles.iter().flatten() {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for k in 0..triangles.len() {
        writeln!(text, "3 {} {} {}", 3 * k, 3 * k + 1, 3 * k + 2).unwrap();
    }
    text
}

/// The middles of triangles as raw points.
pub(crate) fn points(triangles: &[[[f64; 3]; 3]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
        triangles.len()
    );
    for [a, b, c] in triangles {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0);
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    text
}

/// A cube of 32-bit floats, x fastest, with the middle at the origin.
pub(crate) fn nifti(cells: &[f32], spacing: f64) -> Vec<u8> {
    let n = (cells.len() as f64).cbrt().round() as i16;
    let mut bytes = vec![0u8; 352];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, &348i32.to_le_bytes());
    [3, n, n, n, 1, 1, 1, 1].iter().enumerate().for_each(|(i, d)| put(40 + 2 * i, &d.to_le_bytes()));
    put(70, &16i16.to_le_bytes());
    put(72, &32i16.to_le_bytes());
    let h = spacing as f32;
    [1.0, h, h, h].iter().enumerate().for_each(|(i, d)| put(76 + 4 * i, &d.to_le_bytes()));
    put(108, &352f32.to_le_bytes());
    put(112, &1f32.to_le_bytes());
    put(254, &1i16.to_le_bytes());
    let first = (-1.0 + 0.5 * spacing) as f32;
    for (row, at) in [280, 296, 312].into_iter().enumerate() {
        put(at + 4 * row, &h.to_le_bytes());
        put(at + 12, &first.to_le_bytes());
    }
    put(344, b"n+1\0");
    cells.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}
