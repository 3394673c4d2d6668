//! One small volume in every format that can hold it.
//!
//! 3 x 2 x 2 voxels of the values −1, −0.5, 0 … 4.5. Where the format has directions, voxel (i, j, k) lies at
//! (10 − 2 j, 20 + 3 i, 4 k − 30) along right, anterior and superior.

use super::gzip;
use std::io::Write;

/// The values.
pub(crate) fn values() -> Vec<f32> {
    (0..12).map(|v| v as f32 * 0.5 - 1.0).collect()
}

/// Their bytes.
pub(crate) fn raw(big: bool) -> Vec<u8> {
    values().iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }).collect()
}

/// Their text.
pub(crate) fn text() -> Vec<u8> {
    values().iter().map(|v| format!("{v} ")).collect::<String>().into_bytes()
}

pub(crate) fn zlib(content: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(content).unwrap();
    encoder.finish().unwrap()
}

/// An NRRD file whose directions are those of its space.
pub(crate) fn nrrd(encoding: &str, big: bool) -> Vec<u8> {
    let endian = if big { "big" } else { "little" };
    let header = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace: RAS\nsizes: 3 2 2\nspace directions: (0,3,0) (-2,0,0) (0,0,4)\n\
         space origin: (10,20,-30)\nendian: {endian}\nencoding: {encoding}\n\n"
    );
    let data = match encoding {
        "raw" => raw(big),
        "gzip" => gzip(&raw(big)),
        _ => text(),
    };
    [header.into_bytes(), data].concat()
}

/// The header of a MetaImage with its data behind it, and more fields.
pub(crate) fn metaimage_header(more: &str) -> String {
    format!(
        "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nElementType = MET_FLOAT\nElementSpacing = 3 2 4\n\
         Offset = -10 -20 -30\nTransformMatrix = 0 -1 0 1 0 0 0 0 1\nCenterOfRotation = 0 0 0\n\
         AnatomicalOrientation = RAI\n{more}ElementDataFile = LOCAL\n"
    )
}

/// A MetaImage in one file: `raw`, `zlib`, `gzip` or `text`.
pub(crate) fn metaimage(encoding: &str, big: bool) -> Vec<u8> {
    let order = format!("BinaryDataByteOrderMSB = {}\n", if big { "True" } else { "False" });
    let (more, data) = match encoding {
        "raw" => (String::new(), raw(big)),
        "zlib" => ("CompressedData = True\n".to_owned(), zlib(&raw(big))),
        "gzip" => ("CompressedData = True\n".to_owned(), gzip(&raw(big))),
        _ => ("BinaryData = False\n".to_owned(), text()),
    };
    [metaimage_header(&(order + &more)).into_bytes(), data].concat()
}

/// How the arrays of [`vti`] are stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vti {
    /// `ascii`, `binary`, `raw` or `base64`, the last two appended.
    pub(crate) encoding: &'static str,
    pub(crate) big: bool,
    /// Sizes of 64 bits.
    pub(crate) wide: bool,
    /// In blocks of 20 bytes.
    pub(crate) compressed: bool,
}

impl Vti {
    fn word(self, size: usize) -> Vec<u8> {
        match (self.wide, self.big) {
            (false, false) => (size as u32).to_le_bytes().to_vec(),
            (false, true) => (size as u32).to_be_bytes().to_vec(),
            (true, false) => (size as u64).to_le_bytes().to_vec(),
            (true, true) => (size as u64).to_be_bytes().to_vec(),
        }
    }

    /// Bytes as an array has them: sizes, and what they are of.
    fn packed(self, bytes: &[u8]) -> [Vec<u8>; 2] {
        if !self.compressed {
            return [self.word(bytes.len()), bytes.to_vec()];
        }
        let blocks: Vec<Vec<u8>> = bytes.chunks(20).map(zlib).collect();
        let sizes = [blocks.len(), 20, bytes.len() % 20].into_iter().chain(blocks.iter().map(Vec::len));
        [sizes.flat_map(|n| self.word(n)).collect(), blocks.concat()]
    }

    pub(crate) fn base64(self, bytes: &[u8]) -> String {
        use base64::Engine;
        let encode = |b: &[u8]| base64::engine::general_purpose::STANDARD.encode(b);
        let [sizes, data] = self.packed(bytes);
        // What is compressed comes as two runs.
        if self.compressed { encode(&sizes) + &encode(&data) } else { encode(&[sizes, data].concat()) }
    }

    /// Image data with the values as `density` behind an array `mask` of bytes.
    pub(crate) fn file(self) -> Vec<u8> {
        let mask = [7u8; 12];
        let shown = |bytes: &[u8], text: String| if self.encoding == "ascii" { text } else { self.base64(bytes) };
        let first = shown(&mask, "7 ".repeat(12));
        let second = shown(&raw(self.big), String::from_utf8(text()).unwrap());
        let offset = if self.encoding == "raw" { self.packed(&mask).concat().len() } else { first.len() };
        let arrays = match self.encoding {
            "raw" | "base64" => {
                ["format=\"appended\" offset=\"0\"/>".to_owned(), format!("format=\"appended\" offset=\"{offset}\"/>")]
            }
            format => [&first, &second].map(|data| format!("format=\"{format}\">\n{data}\n</DataArray>")),
        };
        let head = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"{}\" header_type=\"{}\"{}>\n\
             <ImageData WholeExtent=\"0 2 0 1 0 1\" Origin=\"10 20 -30\" Spacing=\"3 2 4\" \
             Direction=\"0 -1 0 1 0 0 0 0 1\">\n<Piece Extent=\"0 2 0 1 0 1\">\n<PointData Scalars=\"density\">\n\
             <DataArray type=\"UInt8\" Name=\"mask\" {}\n<DataArray type=\"Float32\" Name=\"density\" {}\n\
             </PointData>\n</Piece>\n</ImageData>\n",
            if self.big { "BigEndian" } else { "LittleEndian" },
            if self.wide { "UInt64" } else { "UInt32" },
            if self.compressed { " compressor=\"vtkZLibDataCompressor\"" } else { "" },
            arrays[0],
            arrays[1]
        );
        let appended = match self.encoding {
            "raw" => [self.packed(&mask).concat(), self.packed(&raw(self.big)).concat()].concat(),
            "base64" => (first + &second).into_bytes(),
            _ => return (head + "</VTKFile>").into_bytes(),
        };
        let start = format!("{head}<AppendedData encoding=\"{}\">\n_", self.encoding);
        [start.as_bytes(), &appended, b"\n</AppendedData>\n</VTKFile>"].concat()
    }
}

/// Image data little endian with small sizes.
pub(crate) fn vti(encoding: &'static str, compressed: bool) -> Vec<u8> {
    Vti { encoding, big: false, wide: false, compressed }.file()
}

/// Structured points, whose axes are those of the space.
pub(crate) fn vtk_scalars(binary: bool) -> Vec<u8> {
    let head = format!(
        "# vtk DataFile Version 3.0\na test\n{}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 10 20 -30\n\
         SPACING 3 2 4\nPOINT_DATA 12\nSCALARS density float 1\nLOOKUP_TABLE default\n",
        if binary { "BINARY" } else { "ASCII" }
    );
    [head.into_bytes(), if binary { raw(true) } else { text() }].concat()
}

/// The same with an array of a field behind the values.
pub(crate) fn vtk(binary: bool) -> Vec<u8> {
    let field = b"\nFIELD more 1\nmask 1 12 unsigned_char\n";
    let mask = if binary { vec![7; 12] } else { b"7 ".repeat(12) };
    [&vtk_scalars(binary), &field[..], &mask].concat()
}
