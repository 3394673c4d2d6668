//! Which format a file is of.

pub(crate) mod folder;
pub(crate) mod unread;
pub(crate) mod up;

use crate::meshes::stl;
use std::path::Path;

/// A format that may be read.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Format {
    Ply,
    Stl,
    Obj,
    Off,
    Gltf,
    Pcd,
    Xyz,
    Nrrd,
    Las,
    E57,
    Nifti,
    MetaImage,
    VtkXml,
    Vtk,
    Raw,
    Hdr,
    Exr,
    Png,
    Splat,
    Spz,
    Sog,
    Ksplat,
    Tiff,
    Dicom,
}

/// The format of a file by its first bytes, else by the extension of its name.
pub(crate) fn format_of(path: &Path, content: &[u8]) -> Option<Format> {
    let named = by_name(path);
    // No byte of nothing but voxels is a mark.
    if matches!(named, Some(Format::Raw)) {
        return named;
    }
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    if content.starts_with(b"ply") {
        return Some(Format::Ply);
    }
    if content.starts_with(b"LASF") {
        return Some(Format::Las);
    }
    if content.starts_with(b"ASTM-E57") {
        return Some(Format::E57);
    }
    if content.starts_with(b"NRRD000") {
        return Some(Format::Nrrd);
    }
    if content.starts_with(b"#?") {
        return Some(Format::Hdr);
    }
    if content.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Some(Format::Exr);
    }
    if content.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Some(Format::Png);
    }
    if crate::volumes::dicom::is_dicom(content) {
        return Some(Format::Dicom);
    }
    // TIFF and BigTIFF, of both byte orders.
    if [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|mark| content.starts_with(mark)) {
        return Some(Format::Tiff);
    }
    if content.starts_with(b"NGSP") {
        return Some(Format::Spz);
    }
    if is_sog_archive(path, content) || is_sog_description(content) {
        return Some(Format::Sog);
    }
    if content.starts_with(b"glTF") {
        return Some(Format::Gltf);
    }
    if content.starts_with(b"# .PCD") {
        return Some(Format::Pcd);
    }
    if content.get(344..347).is_some_and(|magic| magic == b"n+1" || magic == b"ni1") {
        return Some(Format::Nifti);
    }
    // NIfTI-2.
    if content.get(4..7).is_some_and(|magic| magic == b"n+2" || magic == b"ni2") {
        return Some(Format::Nifti);
    }
    if content.starts_with(b"# vtk DataFile Version") {
        return Some(Format::Vtk);
    }
    if content.windows(8).any(|window| window == b"<VTKFile") {
        return Some(Format::VtkXml);
    }
    if is_metaimage(content) {
        return Some(Format::MetaImage);
    }
    named.or_else(|| stl::is_text(content).then_some(Format::Stl))
}

/// Whether an archive is one of SOG: by its extension, else by the name of its first file.
fn is_sog_archive(path: &Path, content: &[u8]) -> bool {
    /// Names that writers of SOG give their files, and where a name begins behind the head of an entry.
    const NAMES: [&[u8]; 4] = [b"meta.json", b"means_l.webp", b"means_u.webp", b"quats.webp"];
    const NAME: usize = 30;
    if !content.starts_with(ZIP) {
        return false;
    }
    let is_named = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("sog"));
    is_named || NAMES.iter().any(|name| content.get(NAME..).is_some_and(|rest| rest.starts_with(name)))
}

/// The first bytes of a ZIP archive.
pub(crate) const ZIP: &[u8] = b"PK\x03\x04";

/// Whether a text is the description of SOG beside its images.
pub(crate) fn is_sog_description(content: &[u8]) -> bool {
    let has = |word: &[u8]| content.windows(word.len()).any(|window| window == word);
    content.trim_ascii_start().starts_with(b"{") && has(b"\"means\"") && has(b"\"files\"") && has(b"\"mins\"")
}

/// It has no mark, but begins with one of two fields.
fn is_metaimage(content: &[u8]) -> bool {
    let field = content.iter().position(|b| *b == b'=').map_or(&[][..], |end| content[..end].trim_ascii_end());
    [&b"ObjectType"[..], b"NDims"].contains(&field)
}

/// Whether a file is nothing but voxels by its name, not even packed.
pub(crate) fn is_raw(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("raw"))
}

/// The format that an extension stands for.
pub(crate) fn by_name(path: &Path) -> Option<Format> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match name.rsplit_once('.')?.1 {
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        "obj" => Some(Format::Obj),
        "off" => Some(Format::Off),
        "gltf" | "glb" => Some(Format::Gltf),
        "pcd" => Some(Format::Pcd),
        "xyz" | "csv" | "txt" | "pts" | "asc" => Some(Format::Xyz),
        "nrrd" | "nhdr" => Some(Format::Nrrd),
        "las" | "laz" => Some(Format::Las),
        "e57" => Some(Format::E57),
        "nii" | "hdr" => Some(Format::Nifti),
        "mha" | "mhd" => Some(Format::MetaImage),
        "vti" | "vtr" | "vts" | "vtu" | "vtp" => Some(Format::VtkXml),
        // Lists of such files.
        "pvti" | "pvtr" | "pvts" | "pvtu" | "pvtp" | "vtm" | "vtpd" | "vtpc" | "pvd" => Some(Format::VtkXml),
        "vtk" => Some(Format::Vtk),
        "raw" => Some(Format::Raw),
        "splat" => Some(Format::Splat),
        "spz" => Some(Format::Spz),
        "sog" => Some(Format::Sog),
        "ksplat" => Some(Format::Ksplat),
        "tif" | "tiff" => Some(Format::Tiff),
        "dcm" | "dicom" | "ima" => Some(Format::Dicom),
        _ => None,
    }
}
