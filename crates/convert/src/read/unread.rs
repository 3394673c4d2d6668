//! Formats that are not read, by what they are: their name, and what a person can do.

use super::format::Format;
use crate::error::{Place, ReadError, escaped};
use std::path::Path;

/// A format that is told apart, but not read.
struct Unread {
    name: &'static str,
    /// Bytes that its files have at an offset.
    marks: &'static [(usize, &'static [u8])],
    extensions: &'static [&'static str],
    hint: &'static str,
}

const TO_GLTF: &str = "convert it to glTF, such as in Blender: File > Import, then File > Export > glTF 2.0";
const TESSELLATE: &str = "it holds no triangles: export it as STL, OBJ or glTF from the program that it comes from";
const TO_PLY: &str = "convert it to PLY, LAS or LAZ, such as with CloudCompare";
const TO_NRRD: &str = "convert it to NRRD or NIfTI, such as with 3D Slicer or ParaView";
const TO_VTU: &str = "save it as one .vti, .vtu or .vtp, such as with ParaView";
const EXTRACT: &str = "extract the files in it; one file inside gzip is read as it is";
const IMAGE: &str =
    "an environment is read from Radiance HDR or OpenEXR, a light's texture from PNG too; convert the image";
const SPLATS: &str = "save it as PLY, compressed PLY, .splat or SPZ, such as with SuperSplat";
const SCENE: &str = "it is a scene, not data: give it to `organza render`";

const fn by_extension(name: &'static str, extensions: &'static [&'static str], hint: &'static str) -> Unread {
    Unread { name, marks: &[], extensions, hint }
}

const UNREAD: [Unread; 43] = [
    Unread { name: "FBX", marks: &[(0, b"Kaydara FBX Binary"), (0, b"; FBX ")], extensions: &["fbx"], hint: TO_GLTF },
    Unread {
        name: "USD",
        marks: &[(0, b"PXR-USDC"), (0, b"#usda ")],
        extensions: &["usd", "usda", "usdc", "usdz"],
        hint: TO_GLTF,
    },
    by_extension("3DS", &["3ds"], TO_GLTF),
    by_extension("COLLADA", &["dae"], TO_GLTF),
    Unread {
        name: "X3D or VRML",
        marks: &[(0, b"#VRML "), (0, b"#X3D ")],
        extensions: &["x3d", "x3dv", "x3dz", "wrl", "vrml"],
        hint: TO_GLTF,
    },
    Unread { name: "a Blender file", marks: &[(0, b"BLENDER")], extensions: &["blend"], hint: TO_GLTF },
    Unread { name: "Alembic", marks: &[(0, b"Ogawa")], extensions: &["abc"], hint: TO_GLTF },
    Unread { name: "Draco", marks: &[(0, b"DRACO")], extensions: &["drc"], hint: TO_GLTF },
    by_extension("3MF", &["3mf"], "save it as STL, such as with a slicer"),
    by_extension("AMF", &["amf"], "save it as STL, such as with a slicer"),
    by_extension("LightWave", &["lwo"], TO_GLTF),
    by_extension("Maya", &["ma", "mb"], TO_GLTF),
    by_extension("3ds Max", &["max"], TO_GLTF),
    by_extension("Cinema 4D", &["c4d"], TO_GLTF),
    by_extension("SketchUp", &["skp"], TO_GLTF),
    by_extension("OBJ materials", &["mtl"], "give the OBJ file: it names its materials"),
    Unread { name: "STEP", marks: &[(0, b"ISO-10303-21")], extensions: &["step", "stp", "ifc"], hint: TESSELLATE },
    by_extension("IGES", &["iges", "igs"], TESSELLATE),
    by_extension("Rhino", &["3dm"], TESSELLATE),
    by_extension("AutoCAD", &["dwg", "dxf"], TESSELLATE),
    by_extension("PTX", &["ptx"], TO_PLY),
    by_extension("ReCap", &["rcp", "rcs"], TO_PLY),
    by_extension("captured packets", &["pcap"], TO_PLY),
    by_extension("a web kind of 3D Gaussian splats", &["ksplat", "sog"], SPLATS),
    Unread { name: "OpenVDB", marks: &[(0, b" BDV\0\0\0\0")], extensions: &["vdb"], hint: TO_NRRD },
    Unread { name: "NanoVDB", marks: &[(0, b"NanoVDB")], extensions: &["nvdb"], hint: TO_NRRD },
    Unread {
        name: "HDF5",
        marks: &[(0, b"\x89HDF\r\n\x1a\n")],
        extensions: &["h5", "hdf5", "hdf", "ims"],
        hint: TO_NRRD,
    },
    Unread { name: "NetCDF", marks: &[(0, b"CDF\x01"), (0, b"CDF\x02")], extensions: &["nc"], hint: TO_NRRD },
    Unread { name: "DICOM", marks: &[(128, b"DICM")], extensions: &["dcm", "dicom", "ima"], hint: TO_NRRD },
    by_extension("FreeSurfer", &["mgh", "mgz"], "convert it to NIfTI, such as with mri_convert"),
    by_extension("MRC", &["mrc", "map", "ccp4"], TO_NRRD),
    Unread { name: "NumPy", marks: &[(0, b"\x93NUMPY")], extensions: &["npy", "npz"], hint: TO_NRRD },
    by_extension("another dataset of VTK", &["vts", "vtr", "vtm", "pvd", "pvtu", "pvtp"], TO_VTU),
    Unread { name: "a JPEG image", marks: &[(0, b"\xff\xd8\xff")], extensions: &["jpg", "jpeg"], hint: IMAGE },
    Unread { name: "a TIFF image", marks: &[(0, b"II*\0"), (0, b"MM\0*")], extensions: &["tif", "tiff"], hint: IMAGE },
    by_extension("an image", &["webp", "bmp", "gif", "tga", "ktx2", "avif"], IMAGE),
    Unread { name: "a zip archive", marks: &[(0, b"PK\x03\x04")], extensions: &["zip"], hint: EXTRACT },
    Unread { name: "a tar archive", marks: &[(257, b"ustar")], extensions: &["tar", "tgz"], hint: EXTRACT },
    Unread { name: "7z", marks: &[(0, b"7z\xbc\xaf\x27\x1c")], extensions: &["7z", "rar"], hint: EXTRACT },
    Unread { name: "xz", marks: &[(0, b"\xfd7zXZ\0")], extensions: &["xz"], hint: EXTRACT },
    Unread { name: "zstd", marks: &[(0, b"\x28\xb5\x2f\xfd")], extensions: &["zst"], hint: EXTRACT },
    Unread { name: "bzip2", marks: &[(0, b"BZh91AY&SY")], extensions: &["bz2"], hint: EXTRACT },
    by_extension("a scene", &["toml", "json"], SCENE),
];

const READ: &str = "PLY, .splat, SPZ, STL, OBJ, OFF, glTF, GLB, PCD, XYZ, CSV, LAS, LAZ, E57, NIfTI, NRRD, MetaImage, VTK images, cells and surfaces, raw voxels, \
    Radiance HDR, OpenEXR and PNG files are read, each also inside gzip";

fn error(unread: &Unread) -> ReadError {
    let found = format!("{}, which is not read", unread.name);
    ReadError::input(Place::File, "a file of a format that is read", found, unread.hint)
}

/// The error for a file that is asked for as an image of coverage and is none.
pub(super) fn without_coverage(path: &Path, head: &[u8], format: Option<Format>) -> ReadError {
    let found = match (format, by_name(path).or_else(|| marked(head))) {
        (Some(format), _) => format!("a file that is read as {format:?}"),
        (None, Some(unread)) => unread.name.to_owned(),
        (None, None) => first_bytes(head),
    };
    ReadError::input(Place::File, "a PNG or OpenEXR image", found, "save it as PNG, or name another file")
}

/// The error for a file whose first bytes are those of a format that is not read, whatever its name says; of archives the
/// name tells what they are.
pub(super) fn by_mark(path: &Path, head: &[u8]) -> Option<ReadError> {
    let marked = marked(head)?;
    Some(error(by_name(path).unwrap_or(marked)))
}

fn marked(head: &[u8]) -> Option<&'static Unread> {
    let has = |(at, mark): &(usize, &[u8])| head.get(*at..).is_some_and(|rest| rest.starts_with(mark));
    UNREAD.iter().find(|u| u.marks.iter().any(has))
}

fn by_name(path: &Path) -> Option<&'static Unread> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let extension = name.strip_suffix(".gz").unwrap_or(&name).rsplit_once('.')?.1;
    UNREAD.iter().find(|u| u.extensions.contains(&extension))
}

/// The error for a file of no format that is read: by its extension, else with its first bytes.
pub(super) fn refused(path: &Path, head: &[u8]) -> ReadError {
    by_name(path).map(error).unwrap_or_else(|| {
        ReadError::input(
            Place::Byte(0),
            "'ply', 'LASF', 'ASTM-E57', 'NRRD', 'glTF', '# .PCD', '#?', a NIfTI-1, OpenEXR or PNG header, or the extension of a \
            format without a mark",
            first_bytes(head),
            READ,
        )
    })
}

fn first_bytes(head: &[u8]) -> String {
    format!("'{}'", escaped(&head[..head.len().min(16)], 16))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_extension_and_no_mark_stands_for_two_formats() {
        let mut extensions: Vec<&str> = UNREAD.iter().flat_map(|u| u.extensions).copied().collect();
        let mut marks: Vec<_> = UNREAD.iter().flat_map(|u| u.marks).collect();
        let counts = [extensions.len(), marks.len()];
        extensions.sort_unstable();
        extensions.dedup();
        marks.sort_unstable();
        marks.dedup();
        assert_eq!([extensions.len(), marks.len()], counts);
        let read = |extension: &&str| super::super::format::by_name(Path::new(&format!("a.{extension}"))).is_some();
        assert_eq!(extensions.iter().find(|e| read(e)), None, "an extension that is read");
    }
}
