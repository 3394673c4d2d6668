//! Formats that are not read, by what they are: their name, and what a person can do.

use crate::error::{Place, ReadError};
use crate::format::Format;
use std::io::Read;
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
const EXPORT: &str = "export it as glTF, OBJ or STL from the program that it comes from";
const TESSELLATE: &str = "it holds no triangles: export it as STL, OBJ or glTF from the program that it comes from";
const TO_PLY: &str = "convert it to PLY, LAS or LAZ, such as with CloudCompare";
const TO_NRRD: &str = "convert it to NRRD or NIfTI, such as with 3D Slicer or ParaView";
const TO_VTU: &str = "save it as one .vti, .vtu or .vtp, such as with ParaView";
const TO_VTU_BY_MESHIO: &str = "convert it to .vtu, such as with `meshio convert` or ParaView";
const TO_XYZ: &str = "convert it to points as text, such as with `gdal_translate -of XYZ FILE heights.xyz`";
const TILES: &str = "name a tile that is .glb; `npx 3d-tiles-tools b3dmToGlb` makes such of .b3dm";
const TO_PLY_BY_TILES: &str =
    "a tile of 3D Tiles holds it: convert the points to PLY, LAS or LAZ, such as with CloudCompare";
const EXTRACT: &str = "extract the files in it; one file inside gzip is read as it is";
const IMAGE: &str =
    "an environment is read from Radiance HDR or OpenEXR, a light's texture from PNG too; convert the image";
const STACK: &str = "a stack of slices is read from TIFF: save it so, such as with Fiji (File > Save As > Tiff)";
const LEVELS: &str = "name the meta.json or the .sog file of one of its parts";
const SCENE: &str = "it is a scene, not data: give it to `organza render`";
const VTK_JS: &str = "its arrays are raw numbers in gzip: copy the one of an image out of its folder `data` to a name with the sizes and the type that index.json states, \
    such as ct_256x256x133_uint8.raw.gz, and state its `spacing` as `voxel_size` of the volume; save other data sets as .vtp or .vtu";

const fn by_extension(name: &'static str, extensions: &'static [&'static str], hint: &'static str) -> Unread {
    Unread { name, marks: &[], extensions, hint }
}

const UNREAD: [Unread; 58] = [
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
    Unread {
        name: "Draco",
        marks: &[(0, b"DRACO")],
        extensions: &["drc"],
        hint: "decode it, such as with `draco_decoder -i FILE -o mesh.ply`",
    },
    by_extension("3MF", &["3mf"], "save it as STL, such as with a slicer"),
    by_extension("AMF", &["amf"], "save it as STL, such as with a slicer"),
    by_extension("LightWave", &["lwo"], EXPORT),
    by_extension("Maya", &["ma", "mb"], EXPORT),
    by_extension("3ds Max", &["max"], EXPORT),
    by_extension("Cinema 4D", &["c4d"], EXPORT),
    by_extension("SketchUp", &["skp"], EXPORT),
    by_extension("OBJ materials", &["mtl"], "give the OBJ file: it names its materials"),
    Unread { name: "STEP", marks: &[(0, b"ISO-10303-21")], extensions: &["step", "stp", "ifc"], hint: TESSELLATE },
    by_extension("IGES", &["iges", "igs"], TESSELLATE),
    by_extension("Rhino", &["3dm"], TESSELLATE),
    by_extension("AutoCAD", &["dwg", "dxf"], TESSELLATE),
    by_extension("PTX", &["ptx"], TO_PLY),
    by_extension("ReCap", &["rcp", "rcs"], TO_PLY),
    by_extension("captured packets", &["pcap"], TO_PLY),
    Unread { name: "OpenVDB", marks: &[(0, b" BDV\0\0\0\0")], extensions: &["vdb"], hint: TO_NRRD },
    Unread { name: "NanoVDB", marks: &[(0, b"NanoVDB")], extensions: &["nvdb"], hint: TO_NRRD },
    Unread {
        name: "HDF5",
        marks: &[(0, b"\x89HDF\r\n\x1a\n")],
        extensions: &["h5", "hdf5", "hdf", "ims"],
        hint: TO_NRRD,
    },
    Unread { name: "NetCDF", marks: &[(0, b"CDF\x01"), (0, b"CDF\x02")], extensions: &["nc"], hint: TO_NRRD },
    by_extension("FreeSurfer", &["mgh", "mgz"], "convert it to NIfTI, such as with mri_convert"),
    by_extension("MRC", &["mrc", "map", "ccp4"], TO_NRRD),
    Unread { name: "NumPy", marks: &[(0, b"\x93NUMPY")], extensions: &["npy", "npz"], hint: TO_NRRD },
    by_extension("another dataset of VTK", &["vth", "vthb", "vtt"], TO_VTU),
    Unread {
        name: "a batched tile of 3D Tiles",
        marks: &[(0, b"b3dm"), (0, b"i3dm")],
        extensions: &["b3dm", "i3dm"],
        hint: TILES,
    },
    Unread { name: "a point tile of 3D Tiles", marks: &[(0, b"pnts")], extensions: &["pnts"], hint: TO_PLY_BY_TILES },
    Unread { name: "a composite tile of 3D Tiles", marks: &[(0, b"cmpt")], extensions: &["cmpt"], hint: TILES },
    Unread {
        name: "OpenCTM",
        marks: &[(0, b"OCTM")],
        extensions: &["ctm"],
        hint: "convert it to PLY or OBJ, such as with MeshLab",
    },
    Unread { name: "Gmsh", marks: &[(0, b"$MeshFormat")], extensions: &["msh"], hint: TO_VTU_BY_MESHIO },
    by_extension("EnSight", &["case", "encas"], TO_VTU),
    by_extension("an EnSight or Houdini geometry", &["geo", "bgeo"], TO_VTU),
    by_extension("Exodus", &["exo", "ex2", "exii"], TO_VTU_BY_MESHIO),
    by_extension("Tecplot", &["tec", "plt"], TO_VTU),
    by_extension("Abaqus or Nastran", &["inp", "bdf", "nas"], TO_VTU_BY_MESHIO),
    by_extension("OpenFOAM", &["foam"], "write it as VTK: `foamToVTK`, or ParaView"),
    by_extension("XDMF", &["xdmf", "xmf"], TO_VTU),
    by_extension("CGNS", &["cgns"], TO_VTU),
    by_extension("a digital elevation model", &["dem", "hgt", "bil"], TO_XYZ),
    by_extension("a VolVis volume", &["slc"], TO_NRRD),
    Unread { name: "FITS", marks: &[(0, b"SIMPLE  =")], extensions: &["fits", "fit"], hint: TO_NRRD },
    by_extension("SEG-Y", &["sgy", "segy"], TO_NRRD),
    by_extension("a stack of a microscope", &["czi", "nd2", "lif", "lsm"], STACK),
    Unread { name: "a JPEG image", marks: &[(0, b"\xff\xd8\xff")], extensions: &["jpg", "jpeg"], hint: IMAGE },
    by_extension("an image", &["webp", "bmp", "gif", "tga", "ktx2", "avif"], IMAGE),
    Unread { name: "a zip archive", marks: &[(0, super::ZIP)], extensions: &["zip"], hint: EXTRACT },
    Unread { name: "a tar archive", marks: &[(257, b"ustar")], extensions: &["tar", "tgz"], hint: EXTRACT },
    Unread { name: "7z", marks: &[(0, b"7z\xbc\xaf\x27\x1c")], extensions: &["7z", "rar"], hint: EXTRACT },
    Unread { name: "xz", marks: &[(0, b"\xfd7zXZ\0")], extensions: &["xz"], hint: EXTRACT },
    Unread { name: "zstd", marks: &[(0, b"\x28\xb5\x2f\xfd")], extensions: &["zst"], hint: EXTRACT },
    Unread { name: "bzip2", marks: &[(0, b"BZh91AY&SY")], extensions: &["bz2"], hint: EXTRACT },
    by_extension("a scene", &["toml", "json"], SCENE),
];

const READ: &str = "PLY, .splat, .ksplat, SPZ, SOG, STL, OBJ, OFF, glTF, GLB, PCD, XYZ, CSV, LAS, LAZ, E57, NIfTI, NRRD, MetaImage, DICOM series, VTK images, grids, cells, surfaces and lists of these, TIFF stacks, folders of TIFF or PNG slices, raw voxels, \
    Radiance HDR, OpenEXR and PNG files are read, each also inside gzip";

fn error(unread: &Unread) -> ReadError {
    let found = format!("{}, which is not read", unread.name);
    ReadError::input(Place::File, "a file of a format that is read", found, unread.hint)
}

/// The error for a file that is asked for as an image of coverage and is none.
pub(crate) fn without_coverage(path: &Path, head: &[u8], format: Option<Format>) -> ReadError {
    let found = match (format, by_name(path).or_else(|| marked(head))) {
        (Some(format), _) => format!("a file that is read as {format:?}"),
        (None, Some(unread)) => unread.name.to_owned(),
        (None, None) => unknown(head).to_owned(),
    };
    ReadError::input(Place::File, "a PNG or OpenEXR image", found, "save it as PNG, or name another file")
}

/// The error for a file whose first bytes are those of a format that is not read, whatever its name says; of archives the
/// name tells what they are.
pub(crate) fn by_mark(path: &Path, head: &[u8]) -> Option<ReadError> {
    if !crate::is_raw(path)
        && let Some(error) = wide_text(head)
    {
        return Some(error);
    }
    if let Some(error) = json(head) {
        return Some(error);
    }
    let marked = marked(head)?;
    Some(error(by_name(path).unwrap_or(marked)))
}

/// The error for a text of two bytes a character, which UTF-16 marks at its beginning.
fn wide_text(head: &[u8]) -> Option<ReadError> {
    /// Characters that are looked at, of which ASCII has a zero byte each.
    const LOOKED_AT: usize = 16;
    let high_byte = match head {
        [0xfe, 0xff, ..] => 0,
        [0xff, 0xfe, ..] => 1,
        _ => return None,
    };
    let characters = head[2..].as_chunks::<2>().0;
    let looked_at = &characters[..characters.len().min(LOOKED_AT)];
    let is_ascii = !looked_at.is_empty() && looked_at.iter().all(|pair| pair[high_byte] == 0);
    is_ascii.then(|| {
        let hint = "save it as UTF-8, such as with `iconv -f UTF-16 -t UTF-8 IN > OUT`";
        ReadError::input(Place::Byte(0), "text in UTF-8", "text in UTF-16", hint)
    })
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

/// The error for a file of no format that is read: by its extension, else by what it is written in.
pub(crate) fn refused(path: &Path, head: &[u8]) -> ReadError {
    by_name(path)
        .map(error)
        .unwrap_or_else(|| ReadError::input(Place::Byte(0), "a file of a format that is read", unknown(head), READ))
}

/// A file of which neither the name nor the beginning tells the format.
fn unknown(head: &[u8]) -> &'static str {
    let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    match head {
        [] => "an empty file",
        head if head.iter().all(is_text) => "a text of a format that neither its name nor its beginning tells",
        _ => "a file whose name and beginning tell no format",
    }
}

/// Formats of JSON that are no scene, by a key or a word that scenes have not.
const IN_JSON: [(&[u8], Unread); 5] = [
    (b"\"vtkClass\"", by_extension("a data set of vtk.js", &[], VTK_JS)),
    (b"\"lodLevels\"", by_extension("a streamed scene of SOG parts", &[], LEVELS)),
    (b"\"geometricError\"", by_extension("a tileset of 3D Tiles", &[], TILES)),
    (b"\"CityJSON\"", by_extension("CityJSON", &[], "convert it to OBJ or glTF, such as with cjio")),
    (
        b"\"FeatureCollection\"",
        by_extension("GeoJSON", &[], "it holds shapes of a map: convert them to OBJ or PLY, such as with QGIS"),
    ),
];

/// The error for a text in JSON that is known to be no scene, by its beginning.
fn json(head: &[u8]) -> Option<ReadError> {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let has = |word: &[u8]| text.starts_with(b"{") && text.windows(word.len()).any(|window| window == word);
    IN_JSON.iter().find(|(word, _)| has(word)).map(|(_, unread)| error(unread))
}

/// Whether a JSON file is data of another program and no scene, by its beginning.
pub fn is_foreign_json(beginning: &[u8]) -> bool {
    json(beginning).is_some() || super::is_sog_description(beginning)
}

/// The error for a folder, which may hold slices or chunks of a volume.
pub(crate) fn folder(path: &Path) -> ReadError {
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries.map(|entry| entry.path()).take(crate::LOOKED_AT).collect();
    if files.is_empty() {
        let hint = "name a file, or a folder that holds the slices of one volume: DICOM, TIFF or PNG";
        return ReadError::file_system("a file, or a folder of slices", "an empty folder", hint);
    }
    files.sort();
    let is_named =
        |names: &[&str]| files.iter().any(|f| f.file_name().is_some_and(|name| names.iter().any(|n| name == *n)));
    if is_named(&[".zarray", ".zgroup", ".zattrs", "zarr.json"]) {
        let hint = "write one array of it as NRRD or NIfTI, such as in Python with zarr and pynrrd";
        return ReadError::input(
            Place::File,
            "a file of a format that is read",
            "a folder of Zarr, which is not read",
            hint,
        );
    }
    // Its index lies beside a folder of arrays.
    if let Some(error) = files.iter().find_map(|file| json(&beginning(file))) {
        return error;
    }
    let found = files.iter().find_map(|file| marked(&beginning(file)).or_else(|| by_name(file)));
    let (found, hint) = match found.map(|unread| unread.name) {
        Some("a JPEG image") => (
            "a folder of JPEG images, which is not read",
            "make one volume of slices, such as a TIFF stack with Fiji (File > Import > Image Sequence, File > Save As > Tiff)",
        ),
        _ => return ReadError::file_system("a regular file", "a directory", "name a file in it"),
    };
    ReadError::input(Place::File, "a file of a format that is read", found, hint)
}

/// The first bytes of a file, those that tell its format; none of what cannot be read.
pub(crate) fn beginning(path: &Path) -> Vec<u8> {
    let mut head = Vec::new();
    // Asked before opening: opening a FIFO waits for its writer.
    if std::fs::metadata(path).is_ok_and(|meta| meta.is_file())
        && let Ok(file) = std::fs::File::open(path)
    {
        // What cannot be read tells nothing.
        let _ = file.take(crate::MARK as u64).read_to_end(&mut head);
    }
    head
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
        let read = |extension: &&str| crate::format::by_name(Path::new(&format!("a.{extension}"))).is_some();
        assert_eq!(extensions.iter().find(|e| read(e)), None, "an extension that is read");
    }
}
