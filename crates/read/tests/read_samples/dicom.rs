//! Slices of DICOM, written element by element.

/// How a slice is stored.
#[derive(Debug, Clone)]
pub(crate) struct Dicom {
    /// The end of its transfer syntax behind `1.2.840.10008.1.2`.
    pub(crate) syntax: &'static str,
    pub(crate) series: &'static str,
    pub(crate) description: &'static str,
    pub(crate) number: u32,
    pub(crate) position: [f64; 3],
    pub(crate) orientation: &'static str,
    pub(crate) meaning: &'static str,
    /// Bits of a number, allocated and stored.
    pub(crate) bits: [u16; 2],
    pub(crate) frames: &'static str,
    pub(crate) values: Vec<i32>,
}

/// Columns and rows.
pub(crate) const SIZE: [u16; 2] = [3, 2];

impl Default for Dicom {
    fn default() -> Self {
        Self {
            syntax: ".1",
            series: "1.2.3",
            description: "head",
            number: 1,
            position: [10.0, 20.0, 30.0],
            orientation: "1\\0\\0\\0\\1\\0",
            meaning: "MONOCHROME2",
            bits: [16, 12],
            frames: "1",
            values: (-2..4).collect(),
        }
    }
}

impl Dicom {
    /// The slice of this rank of a series along z, with steps of 1.5.
    pub(crate) fn at(rank: u32) -> Self {
        let first = 6 * rank as i32;
        Self {
            number: rank + 1,
            position: [10.0, 20.0, 30.0 + 1.5 * f64::from(rank)],
            values: (first - 2..first + 4).collect(),
            ..Self::default()
        }
    }

    /// The bytes of the file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut out = [&[0; 128][..], b"DICM"].concat();
        let has_types = !self.syntax.is_empty();
        element(&mut out, true, [2, 0x10], *b"UI", format!("1.2.840.10008.1.2{}", self.syntax).as_bytes());
        let mut put = |tag: [u16; 2], kind: [u8; 2], value: &[u8]| element(&mut out, has_types, tag, kind, value);
        let [x, y, z] = self.position;
        put([8, 0x103e], *b"LO", self.description.as_bytes());
        // A sequence of one item, both of an unknown length, with a sequence in it.
        put([8, 0x1032], *b"SQ", NESTED);
        put([0x20, 0x0e], *b"UI", self.series.as_bytes());
        put([0x20, 0x13], *b"IS", self.number.to_string().as_bytes());
        put([0x20, 0x32], *b"DS", format!("{x}\\{y}\\{z}").as_bytes());
        put([0x20, 0x37], *b"DS", self.orientation.as_bytes());
        put([0x28, 2], *b"US", &1u16.to_le_bytes());
        put([0x28, 4], *b"CS", self.meaning.as_bytes());
        put([0x28, 8], *b"IS", self.frames.as_bytes());
        put([0x28, 0x10], *b"US", &SIZE[1].to_le_bytes());
        put([0x28, 0x11], *b"US", &SIZE[0].to_le_bytes());
        put([0x28, 0x30], *b"DS", b"0.5\\0.25");
        put([0x28, 0x100], *b"US", &self.bits[0].to_le_bytes());
        put([0x28, 0x101], *b"US", &self.bits[1].to_le_bytes());
        put([0x28, 0x102], *b"US", &(self.bits[1] - 1).to_le_bytes());
        put([0x28, 0x103], *b"US", &1u16.to_le_bytes());
        put([0x28, 0x1052], *b"DS", b"-1000");
        put([0x28, 0x1053], *b"DS", b"2");
        let size = usize::from(self.bits[0] / 8);
        let mask = (1u64 << self.bits[1]) - 1;
        let stored = |value: &i32| (i64::from(*value).cast_unsigned() & mask).to_le_bytes()[..size].to_vec();
        let pixels: Vec<Vec<u8>> = self.values.iter().map(stored).collect();
        if self.syntax != ".5" {
            put([0x7fe0, 0x10], *b"OW", &pixels.concat());
            return out;
        }
        let mut segments = vec![(size as u32).to_le_bytes().to_vec()];
        let runs: Vec<Vec<u8>> =
            (0..size).rev().map(|i| runs_of(&pixels.iter().map(|p| p[i]).collect::<Vec<_>>())).collect();
        let mut start = 64;
        for run in &runs {
            segments.push((start as u32).to_le_bytes().to_vec());
            start += run.len();
        }
        let mut frame = segments.concat();
        frame.resize(64, 0);
        frame.extend(runs.concat());
        out.extend(b"\xe0\x7f\x10\0OB\0\0\xff\xff\xff\xff\xfe\xff\0\xe0\0\0\0\0\xfe\xff\0\xe0");
        out.extend((frame.len() as u32).to_le_bytes());
        out.extend(frame);
        out.extend(b"\xfe\xff\xdd\xe0\0\0\0\0");
        out
    }
}

/// A file whose frames of the numbers −2 to 3 lie at these places along z, with what they share and their places in groups.
pub(crate) fn frames(places: &[f64], ends_by_delimiter: bool) -> Vec<u8> {
    let mut out = [&[0; 128][..], b"DICM"].concat();
    let sequence = |tag: [u16; 2], items: &[Vec<u8>]| {
        let mut out: Vec<u8> = tag.iter().flat_map(|part| part.to_le_bytes()).chain(*b"SQ\0\0").collect();
        let unknown = u32::MAX.to_le_bytes();
        let mut content = Vec::new();
        for item in items {
            content.extend(b"\xfe\xff\0\xe0");
            content.extend(if ends_by_delimiter { unknown } else { (item.len() as u32).to_le_bytes() });
            content.extend(item);
            if ends_by_delimiter {
                content.extend(b"\xfe\xff\x0d\xe0\0\0\0\0");
            }
        }
        out.extend(if ends_by_delimiter { unknown } else { (content.len() as u32).to_le_bytes() });
        out.extend(content);
        if ends_by_delimiter {
            out.extend(b"\xfe\xff\xdd\xe0\0\0\0\0");
        }
        out
    };
    let text = |tag: [u16; 2], value: &str| {
        let mut out = Vec::new();
        element(&mut out, true, tag, *b"DS", value.as_bytes());
        out
    };
    let mut put = |tag: [u16; 2], kind: [u8; 2], value: &[u8]| element(&mut out, true, tag, kind, value);
    put([2, 0x10], *b"UI", b"1.2.840.10008.1.2.1");
    put([0x20, 0x0e], *b"UI", b"1.2.5");
    put([0x28, 2], *b"US", &1u16.to_le_bytes());
    put([0x28, 4], *b"CS", b"MONOCHROME2");
    put([0x28, 8], *b"IS", places.len().to_string().as_bytes());
    put([0x28, 0x10], *b"US", &SIZE[1].to_le_bytes());
    put([0x28, 0x11], *b"US", &SIZE[0].to_le_bytes());
    for (number, value) in [(0x100, 16u16), (0x101, 16), (0x102, 15), (0x103, 1)] {
        put([0x28, number], *b"US", &value.to_le_bytes());
    }
    let measures = sequence([0x28, 0x9110], &[text([0x28, 0x30], "0.5\\0.25")]);
    let directions = sequence([0x20, 0x9116], &[text([0x20, 0x37], "1\\0\\0\\0\\1\\0")]);
    let scaling = [text([0x28, 0x1052], "-1000"), text([0x28, 0x1053], "2")].concat();
    let shared = [directions, measures, sequence([0x28, 0x9145], &[scaling])].concat();
    let place = |z: &f64| sequence([0x20, 0x9113], &[text([0x20, 0x32], &format!("10\\20\\{z}"))]);
    out.extend(sequence([0x5200, 0x9229], &[shared]));
    out.extend(sequence([0x5200, 0x9230], &places.iter().map(place).collect::<Vec<_>>()));
    let pixels: Vec<u8> = (0..6 * places.len() as i16).flat_map(|k| (k - 2).to_le_bytes()).collect();
    element(&mut out, true, [0x7fe0, 0x10], *b"OW", &pixels);
    out
}

/// What marks a sequence of unknown length with a sequence in it; [`element`] writes it.
const NESTED: &[u8] = b"nested";

/// Runs of equal bytes and of others, an even number of bytes.
fn runs_of(bytes: &[u8]) -> Vec<u8> {
    let mut out = match bytes.iter().all(|b| *b == bytes[0]) {
        true => vec![(257 - bytes.len()) as u8, bytes[0]],
        false => [&[bytes.len() as u8 - 1], bytes].concat(),
    };
    if out.len() % 2 == 1 {
        out.push(0x80);
    }
    out
}

fn element(out: &mut Vec<u8>, has_types: bool, tag: [u16; 2], kind: [u8; 2], value: &[u8]) {
    tag.iter().for_each(|part| out.extend(part.to_le_bytes()));
    let is_long = [*b"OB", *b"OW", *b"SQ"].contains(&kind);
    if has_types {
        out.extend(kind);
        if is_long {
            out.extend([0; 2]);
        }
    }
    if value == NESTED {
        out.extend(b"\xff\xff\xff\xff\xfe\xff\0\xe0\xff\xff\xff\xff");
        element(out, has_types, [8, 0x100], *b"SH", b"1");
        [8u16, 0x1110].iter().for_each(|part| out.extend(part.to_le_bytes()));
        if has_types {
            out.extend(b"SQ\0\0");
        }
        out.extend(b"\xff\xff\xff\xff\xfe\xff\0\xe0\x02\0\0\0xx\xfe\xff\xdd\xe0\0\0\0\0");
        out.extend(b"\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0");
        return;
    }
    let padded = [value, if value.len() % 2 == 1 { b" " } else { b"" }].concat();
    match has_types && !is_long {
        true => out.extend((padded.len() as u16).to_le_bytes()),
        false => out.extend((padded.len() as u32).to_le_bytes()),
    }
    out.extend(padded);
}
