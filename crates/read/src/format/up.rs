//! Which axis of a file points up, where its format says so.

use crate::format::folder;
use crate::volumes::dicom::is_dicom;
use crate::{Format, LOOKED_AT, format_of};
use flate2::bufread::MultiGzDecoder;
use splat_core::UpAxis;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes in which a header tells its space.
const HEADER: u64 = 1 << 16;

/// The axis that points up by a file's format; `None` where that says nothing of it, and for a file that cannot be read, which
/// [`crate::file()`] has the words for. Only the file's beginning is looked at.
pub fn stated_up_axis(path: &Path) -> Option<UpAxis> {
    of_content(path, &unpacked_beginning(path)?)
}

/// The same, y where nothing is stated.
pub fn up_axis(path: &Path) -> UpAxis {
    stated_up_axis(path).unwrap_or_default()
}

/// The first bytes of a file, unpacked where it is gzip; of a folder those of the file that tells its format.
pub(crate) fn unpacked_beginning(path: &Path) -> Option<Vec<u8>> {
    // Asked before opening: opening a FIFO waits for its writer.
    let about = std::fs::metadata(path).ok()?;
    if about.is_dir() {
        let files = folder::files(path).ok()?;
        if let Some(description) = folder::sog_description(&files) {
            return unpacked_beginning(description);
        }
        // Slices of DICOM lie in a patient's space.
        return files
            .iter()
            .take(LOOKED_AT)
            .find_map(|file| unpacked_beginning(file).filter(|content| is_dicom(content)));
    }
    if !about.is_file() {
        return None;
    }
    let mut content = Vec::new();
    File::open(path).ok()?.take(HEADER).read_to_end(&mut content).ok()?;
    if !content.starts_with(&[0x1f, 0x8b]) {
        return Some(content);
    }
    let mut unpacked = Vec::new();
    // The compressed bytes end early, which is no error here.
    let _ = MultiGzDecoder::new(content.as_slice()).take(HEADER).read_to_end(&mut unpacked);
    Some(unpacked)
}

fn of_content(path: &Path, content: &[u8]) -> Option<UpAxis> {
    match format_of(path, content)? {
        Format::Las | Format::E57 | Format::Dicom | Format::Nifti | Format::MetaImage => Some(UpAxis::Z),
        Format::Nrrd if is_of_a_body(content) => Some(UpAxis::Z),
        Format::Splat | Format::Sog | Format::Ksplat => Some(UpAxis::MinusY),
        Format::Ply if has_gaussians(content) => Some(UpAxis::MinusY),
        Format::Gltf | Format::Spz => Some(UpAxis::Y),
        _ => None,
    }
}

/// Whether a PLY header has a property that only Gaussians have.
fn has_gaussians(content: &[u8]) -> bool {
    let lines = content.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let mut header = lines.take_while(|line| *line != b"end_header");
    header
        .any(|line| line.starts_with(b"property") && (line.ends_with(b" rot_0") || line.ends_with(b" packed_rotation")))
}

/// Whether an NRRD header names an anatomical space: the third axis of each leads to the head.
fn is_of_a_body(content: &[u8]) -> bool {
    let lines = content.split(|b| *b == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line));
    let header = lines.take_while(|line| !line.is_empty());
    let mut spaces = header.filter_map(|line| line.strip_prefix(b"space:"));
    spaces.next().is_some_and(|name| {
        let name = String::from_utf8_lossy(name).trim().to_ascii_lowercase();
        let name = name.strip_suffix("-time").unwrap_or(&name);
        let name = name.strip_suffix('t').filter(|n| n.len() == 3).unwrap_or(name);
        ["ras", "las", "lps"].contains(&name)
            || ["right-anterior-superior", "left-anterior-superior", "left-posterior-superior"].contains(&name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_formats_that_state_it_have_z() {
        let stated = |name: &str, content: &[u8]| of_content(Path::new(name), content);
        let up_axis = |name: &str, content: &[u8]| stated(name, content).unwrap_or_default();
        assert_eq!(stated("a.glb", b"glTF\x02\0\0\0"), Some(UpAxis::Y));
        assert_eq!(stated("a.ply", b"ply\nformat ascii 1.0\n"), None);
        assert_eq!(up_axis("a", b"LASF\x01\x02"), UpAxis::Z);
        assert_eq!(up_axis("a.ply", b"ply\nformat ascii 1.0\n"), UpAxis::Y);
        assert_eq!(up_axis("a.stl", b"solid a\n"), UpAxis::Y);
        assert_eq!(up_axis("a.xyz", b"0 0 0\n"), UpAxis::Y);
        assert_eq!(up_axis("a.nii", &[0; 348]), UpAxis::Z);
        assert_eq!(up_axis("a", b"ObjectType = Image\nNDims = 3\n"), UpAxis::Z);
        assert_eq!(up_axis("a.vti", b"<VTKFile type=\"ImageData\">"), UpAxis::Y);
        assert_eq!(up_axis("a.raw", b"LASF"), UpAxis::Y);
        assert_eq!(up_axis("a.splat", &[0; 32]), UpAxis::MinusY);
        assert_eq!(up_axis("a.ksplat", &[0, 1]), UpAxis::MinusY);
        assert_eq!(up_axis("a.spz", b"NGSP"), UpAxis::Y);
        assert_eq!(up_axis("a.sog", b"PK\x03\x04"), UpAxis::MinusY);
        assert_eq!(up_axis("meta.json", b"{\"means\":{\"mins\":[0],\"files\":[]}}"), UpAxis::MinusY);
        for name in ["float rot_0", "uint packed_rotation"] {
            let header = format!("ply\r\nelement vertex 1\r\nproperty {name}\r\nend_header\r\n");
            assert_eq!(up_axis("a.ply", header.as_bytes()), UpAxis::MinusY, "{name}");
        }
        assert_eq!(up_axis("a.nrrd", b"NRRD0004\ntype: float\n\nspace: RAS\n"), UpAxis::Y);
        for (space, up) in [
            ("RAS", UpAxis::Z),
            ("left-posterior-superior", UpAxis::Z),
            ("LPST", UpAxis::Z),
            ("left-anterior-superior-time", UpAxis::Z),
            ("scanner-xyz", UpAxis::Y),
            ("3D-right-handed", UpAxis::Y),
        ] {
            let header = format!("NRRD0005\r\ndimension: 3\r\nspace: {space}\r\n\r\n");
            assert_eq!(up_axis("a.nrrd", header.as_bytes()), up, "{space}");
        }
    }

    #[test]
    fn a_file_inside_gzip_tells_it_too_and_one_that_is_not_there_tells_nothing() {
        use std::io::Write;
        let folder = std::env::temp_dir().join(format!("organza-up-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("a.las.gz");
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(b"LASF and more").expect("memory");
        std::fs::write(&path, packed.finish().expect("memory")).expect("a file");
        assert_eq!(up_axis(&path), UpAxis::Z);
        assert_eq!(up_axis(&folder), UpAxis::Y);
        assert_eq!(up_axis(&folder.join("none.las")), UpAxis::Y);
        std::fs::remove_dir_all(&folder).expect("its own folder");
    }
}
