//! Clouds as PLY files of rendering-oriented points: what the crate `read` gives back bit by bit.
//!
//! Little-endian, 32-bit floats, one property an attribute; comments say the version, the origin in f64, the footprints that radii are of, the
//! objects and what each property is.

use super::columns::{COLUMNS, PACKED, SplatColumn, SplatColumns, Stored, VERSION};
use crate::{Cloud, Error, FootprintStack, PackedCloud};
use std::fmt::Write as _;

/// The file of a cloud, in which no splat is a Gaussian. `objects` and `materials` are names by id; names and whatever else a comment cannot hold are escaped.
///
/// # Panics
/// If a splat is a Gaussian.
pub fn splats_to_ply(cloud: &Cloud, objects: &[String], materials: &[String], footprints: &FootprintStack) -> Vec<u8> {
    assert!(cloud.gaussians.is_empty(), "invariant: Gaussians have a format of their own");
    let some = |group: &&SplatColumns| group.is_there.is_none_or(|is_there| is_there(cloud));
    let groups: Vec<&SplatColumns> = COLUMNS.iter().filter(some).collect();
    let columns: Vec<&SplatColumn> = groups.iter().flat_map(|group| group.columns).collect();
    let mut head = head(cloud, objects, materials, footprints);
    for group in &groups {
        let names: Vec<&str> = group.columns.iter().map(|column| column.name).collect();
        let _ = writeln!(head, "comment {}: {}", names.join(" "), group.meaning);
    }
    let _ = writeln!(head, "element vertex {}", cloud.len());
    for column in &columns {
        let _ = writeln!(head, "property {} {}", type_name(column.stored), column.name);
    }
    head += "end_header\n";
    let mut file = head.into_bytes();
    file.reserve_exact(cloud.len() * columns.iter().map(|column| size(column.stored)).sum::<usize>());
    for splat in (0..cloud.len()).map(|i| cloud.get(i)) {
        for column in &columns {
            let number = (column.get)(&splat);
            match column.stored {
                Stored::Float => file.extend((number as f32).to_le_bytes()),
                Stored::Byte(_) => file.push(number as u8),
                Stored::Short => file.extend((number as u16).to_le_bytes()),
                Stored::Word => file.extend((number as u32).to_le_bytes()),
            }
        }
    }
    file
}

/// The same file with its splats packed ([`PackedCloud`]): some 16 bytes each in the place of 50, off by half a step of their blocks at most.
///
/// # Errors
/// [`Error::Invalid`] for a cloud that breaks a promise, or has Gaussians.
pub fn packed_splats_to_ply(
    cloud: &Cloud,
    objects: &[String],
    materials: &[String],
    footprints: &FootprintStack,
) -> Result<Vec<u8>, Error> {
    let packed = PackedCloud::new(cloud)?.to_bytes();
    let mut head = head(cloud, objects, materials, footprints);
    let _ = writeln!(head, "comment {PACKED}: {} splats in blocks, quantized; Organza reads them", cloud.len());
    let _ = write!(head, "element {PACKED} {}\nproperty uchar byte\nend_header\n", packed.len());
    Ok([head.into_bytes(), packed].concat())
}

/// The header as far as all files have it.
fn head(cloud: &Cloud, objects: &[String], materials: &[String], footprints: &FootprintStack) -> String {
    let mut head = format!("ply\nformat binary_little_endian 1.0\ncomment organza splats {VERSION}\n");
    let [x, y, z] = cloud.origin.to_array();
    let _ = writeln!(head, "comment organza origin {x:?} {y:?} {z:?}");
    for (id, footprint) in footprints.layers().iter().enumerate() {
        let _ = writeln!(head, "comment organza footprint {id} {:?}", footprint.cutoff);
    }
    for (what, names) in [("object", objects), ("material", materials)] {
        for (id, name) in names.iter().enumerate() {
            let _ = writeln!(head, "comment {what} {id}: {}", name.escape_debug());
        }
    }
    head
}

fn type_name(stored: Stored) -> &'static str {
    match stored {
        Stored::Float => "float",
        Stored::Byte(_) => "uchar",
        Stored::Short => "ushort",
        Stored::Word => "uint",
    }
}

fn size(stored: Stored) -> usize {
    match stored {
        Stored::Float | Stored::Word => 4,
        Stored::Byte(_) => 1,
        Stored::Short => 2,
    }
}
