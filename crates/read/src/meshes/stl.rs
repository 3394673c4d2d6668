//! STL, binary and text → a mesh of separate facets.
//!
//! A binary file has 84 + 50·n bytes; that decides, as many binary files begin with `solid` like a text. Where the size
//! fits neither, the content does: a text has no zero byte, the first 512 bytes of a binary file have some. The parser
//! is our own, for lines and columns. Corners are not joined: STL says facets, so each keeps its own plane. Its
//! stored normals are read over: normals follow from the order of the corners.
//!
//! The two attribute bytes of a facet are its colour in two forms, five bits a channel, taken as sRGB. Where the header has `COLOR=` and
//! four bytes (Materialise), those are the colour and the opacity of the body, and a facet has red in its lowest bits and its own colour
//! where bit 15 is 0. Else (VisCAM, SolidView) blue is lowest, and a facet has a colour where bit 15 is 1.

use super::opacity;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use crate::points::origin;
use crate::reading::{Fix, Reading};
use crate::stream::input;
use crate::text::{Line, Lines, Word};
use splat_core::Mesh;
use splat_core::glam::DVec3;
use splat_core::srgb::linear_from_srgb;
use splat_core::text::counted;

const HEADER: usize = 84;
const FACET: usize = 50;
/// Bytes in which a binary file has a zero.
const BEGINNING: usize = 512;
/// Facets between two looks at whether to stop.
const LOOK: usize = 1 << 14;
/// Bytes that a facet takes while it is read and converted.
const BYTES_PER_FACET: u64 = 3 * (24 + 12) + 12;
/// Bytes of the colour and the opacity of a corner.
const BYTES_PER_COLOR: u64 = 12 + 4;

/// What is wrong with a file that is longer than it says.
const LONGER: &str = "the file holds more than the facets that its header counts: the count is wrong, or it is no STL";

/// Reads an STL file.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
    let announced = content.get(80..HEADER).map(|b| u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    let length = content.len() as u64;
    // At most 2³²·50 + 84.
    let needed = announced.map(|n| HEADER as u64 + FACET as u64 * n);
    if needed == Some(length) {
        return binary(content, reading);
    }
    if is_text(content) {
        return text(content, reading);
    }
    let refused = || {
        let expected = match (announced, needed) {
            (Some(n), Some(needed)) => {
                format!("84 + 50 x {n} = {needed} bytes of a binary STL, or a text that begins with 'solid'")
            }
            _ => "a binary STL of at least 84 bytes, or a text that begins with 'solid'".to_owned(),
        };
        let found = format!("{length} bytes");
        let is_longer = needed.is_some_and(|needed| needed < length);
        let hint = if is_longer { LONGER } else { "the file is truncated, damaged or not STL" };
        ReadError::input(Place::Byte(80), expected, found, hint)
    };
    match needed {
        // Less than a facet more is padding; more, and the number of facets is not to be believed.
        Some(needed) if needed < length && length - needed < FACET as u64 => {
            for _ in needed..length {
                reading.mend(Fix::TrailingBytes, Place::Byte(needed), None, refused)?;
            }
            binary(&content[..needed as usize], reading)
        }
        _ => Err(refused()),
    }
}

/// Whether a file begins like a text.
pub(crate) fn is_text(content: &[u8]) -> bool {
    let beginning = &content[..content.len().min(BEGINNING)];
    let words = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content).trim_ascii_start();
    words.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !beginning.contains(&0)
}

/// The colour of what states none, beside facets that do.
const PLAIN: [f32; 3] = [1.0; 3];

/// How facets have their colours.
#[derive(Debug, Clone, Copy)]
enum FacetColors {
    /// In the header the body's colour, and its opacity.
    Materialise { body: [f32; 3], opacity: f32 },
    /// Each by itself.
    VisCam,
}

impl FacetColors {
    /// How the facets after a header have them; `None` where they have none.
    fn from_header(header: &[u8], facets: &[[u8; FACET]]) -> Option<Self> {
        const MARK: &[u8] = b"COLOR=";
        let mark = header[..80].windows(MARK.len()).position(|bytes| bytes == MARK);
        if let Some([r, g, b, alpha]) = mark.and_then(|at| header[at + MARK.len()..80].first_chunk::<4>()) {
            let body = [r, g, b].map(|byte| linear_from_srgb(f64::from(*byte) / 255.0));
            return Some(Self::Materialise { body, opacity: f32::from(*alpha) / 255.0 });
        }
        facets.iter().any(|facet| attribute(facet) >> 15 == 1).then_some(Self::VisCam)
    }

    /// The colour of a facet; `None` where it states none.
    fn color(self, facet: &[u8; FACET]) -> Option<[f32; 3]> {
        let bits = attribute(facet);
        let channel = |shift: u32| linear_from_srgb(f64::from(bits >> shift & 31) / 31.0);
        let is_set = bits >> 15 == 1;
        match self {
            Self::Materialise { body, .. } if is_set => Some(body),
            Self::Materialise { .. } => Some([0, 5, 10].map(channel)),
            Self::VisCam => is_set.then(|| [10, 5, 0].map(channel)),
        }
    }
}

/// The attribute bytes of a facet.
fn attribute(facet: &[u8; FACET]) -> u16 {
    u16::from_le_bytes([facet[48], facet[49]])
}

/// A header and its facets.
fn binary(content: &[u8], reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
    let (header, content) = content.split_at(HEADER);
    let facets = content.as_chunks::<FACET>().0;
    let colors = FacetColors::from_header(header, facets);
    if colors.is_none() && facets.iter().any(|facet| facet[48..] != [0; 2]) {
        reading.notes.remark("its facets have attribute bytes that are no colours, and are not used");
    }
    let mut mesh = facets_of(facets, reading)?;
    if let Some(colors) = colors {
        paint(&mut mesh, facets, colors, reading)?;
    }
    Ok(mesh)
}

/// Gives facets their colours, and the body its opacity.
fn paint(
    mesh: &mut Mesh,
    facets: &[[u8; FACET]],
    colors: FacetColors,
    reading: &mut Reading<'_>,
) -> Result<(), ReadError> {
    let corners = mesh.position.len();
    input::hold("the colours of facets", corners as u64 * BYTES_PER_COLOR, reading.params)?;
    input::reserve(&mut mesh.color, corners)?;
    let stated = |facet: &[u8; FACET]| colors.color(facet);
    mesh.color.extend(facets.iter().flat_map(|facet| [stated(facet).unwrap_or(PLAIN); 3]));
    let plain = facets.iter().filter(|facet| stated(facet).is_none()).count();
    if plain > 0 {
        let facets = counted(facets.len() as u64, "facet");
        reading.notes.remark(format!("{plain} of {facets} state no colour: they are white"));
    }
    if let FacetColors::Materialise { opacity: share, .. } = colors {
        opacity::give(mesh, vec![share; corners], &mut reading.notes);
    }
    Ok(())
}

/// The facets as triangles.
fn facets_of(facets: &[[u8; FACET]], reading: &Reading<'_>) -> Result<Mesh, ReadError> {
    let mut corners = reserved(facets.len(), reading.params)?;
    for (n, facet) in facets.iter().enumerate() {
        if n.is_multiple_of(LOOK) {
            reading.go_on()?;
        }
        let numbers = facet[12..48].as_chunks::<4>().0;
        for (i, c) in numbers.as_chunks::<3>().0.iter().enumerate() {
            let corner = DVec3::from_array(c.map(|b| f64::from(f32::from_le_bytes(b))));
            if !corner.is_finite() {
                let place = Place::Byte((HEADER + n * FACET + 12 + 12 * i) as u64);
                let found = format!("{corner} in facet {n}");
                return Err(ReadError::input(place, "finite coordinates", found, "remove the facet"));
            }
            corners.push(corner);
        }
    }
    mesh(&corners)
}

fn reserved(facets: usize, params: &ReadParams) -> Result<Vec<DVec3>, ReadError> {
    input::hold("the facets", facets as u64 * BYTES_PER_FACET, params)?;
    let mut corners = Vec::new();
    input::reserve(&mut corners, 3 * facets)?;
    Ok(corners)
}

fn mesh(corners: &[DVec3]) -> Result<Mesh, ReadError> {
    let (origin, position) = origin::relative(corners, Place::File, |i| format!("a corner of facet {}", i / 3))?;
    let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Ok(Mesh { origin, position, triangles, ..Mesh::default() })
}

/// Lines that have something on them.
struct Text<'a> {
    lines: Lines<'a>,
}

impl<'a> Text<'a> {
    fn next(&mut self, expected: &str) -> Result<(Line<'a>, Vec<Word<'a>>), ReadError> {
        while let Some(line) = self.lines.next()? {
            let words: Vec<Word<'a>> = line.words(false).collect();
            if !words.is_empty() {
                return Ok((line, words));
            }
        }
        Err(ReadError::input(self.lines.end(), expected, "the end of the file", "the file is truncated"))
    }

    /// A line that says exactly `keywords`.
    fn expect(&mut self, keywords: &[&str]) -> Result<(), ReadError> {
        let (line, words) = self.next(&format!("'{}'", keywords.join(" ")))?;
        if words.len() == keywords.len() && words.iter().zip(keywords).all(|(w, k)| is(*w, k)) {
            return Ok(());
        }
        Err(wrong(line, &keywords.join(" ")))
    }
}

fn is(word: Word<'_>, keyword: &str) -> bool {
    word.text.eq_ignore_ascii_case(keyword.as_bytes())
}

/// Whether a word is a number as C's printf writes one: also `-nan`, `nan(ind)`, `-1.#IND` and `inf`.
fn is_number(word: Word<'_>) -> bool {
    let Ok(text) = std::str::from_utf8(word.text) else { return false };
    let plain = text.trim_start_matches('-').to_ascii_lowercase();
    text.parse::<f64>().is_ok() || plain.starts_with("1.#") || plain.starts_with("nan(")
}

fn wrong(line: Line<'_>, expected: &str) -> ReadError {
    let found = format!("'{}'", splat_core::text::escaped(line.text.trim_ascii(), 60));
    ReadError::input(line.place(), format!("'{expected}'"), found, "one statement a line, as STL writers do")
}

/// One or several solids of facets.
fn text(content: &[u8], reading: &Reading<'_>) -> Result<Mesh, ReadError> {
    let mut text = Text { lines: Lines::new(content) };
    let mut corners: Vec<DVec3> = Vec::new();
    let mut inside = false;
    let mut held = input::Growing::new("the facets");
    loop {
        let (line, words) = match text.next("'endsolid'") {
            Ok(found) => found,
            Err(_) if !inside => return mesh(&corners),
            Err(error) => return Err(error),
        };
        match words.as_slice() {
            [first, ..] if !inside && is(*first, "solid") => inside = true,
            [first, ..] if inside && is(*first, "endsolid") => inside = false,
            [facet, normal, numbers @ ..] if inside && is(*facet, "facet") && is(*normal, "normal") => {
                // Read over, but numbers they must be; some writers store what is none for facets without area.
                if numbers.len() != 3 || !numbers.iter().all(|n| is_number(*n)) {
                    return Err(wrong(line, "facet normal X Y Z"));
                }
                if corners.len().is_multiple_of(3 * LOOK) {
                    reading.go_on()?;
                }
                held.hold((corners.len() as u64 / 3 + 1) * BYTES_PER_FACET, reading.params)?;
                input::reserve(&mut corners, 3)?;
                facet_corners(&mut text, &mut corners)?;
            }
            _ if inside => return Err(wrong(line, "facet normal X Y Z' or 'endsolid")),
            _ => return Err(wrong(line, "solid")),
        }
    }
}

fn facet_corners(text: &mut Text<'_>, corners: &mut Vec<DVec3>) -> Result<(), ReadError> {
    text.expect(&["outer", "loop"])?;
    for _ in 0..3 {
        let (line, words) = text.next("'vertex X Y Z'")?;
        match words.as_slice() {
            [vertex, x, y, z] if is(*vertex, "vertex") => {
                corners.push(DVec3::new(x.number()?, y.number()?, z.number()?));
            }
            _ => return Err(wrong(line, "vertex X Y Z")),
        }
    }
    text.expect(&["endloop"])?;
    text.expect(&["endfacet"])
}
