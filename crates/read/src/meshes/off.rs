//! OFF (Geomview's Object File Format, text) → a mesh where there are faces, else raw points.
//!
//! The first word says what a vertex has after its place: `N` a normal, `C` a colour of three or four numbers, `ST` texture
//! coordinates, in the order of the file: normal, colour, texture coordinates. Vertices and faces have a line each, as all
//! writers write them. Colours that are whole numbers, one of them above 1, are sRGB from 0 to 255; others are linear.

use super::fans::Fans;
use super::opacity;
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::points::direction::unit;
use crate::points::origin;
use crate::reading::Reading;
use crate::stream::input;
use crate::text::{Line, Lines, Word};
use splat_core::glam::{DVec3, Vec3};
use splat_core::srgb::linear_from_srgb;
use splat_core::text::escaped;
use splat_core::{Mesh, RawPoints};

/// Bytes that a vertex takes while it is read and converted.
const BYTES_PER_VERTEX: u64 = 24 + 12 + 12 + 24 + 12;
/// Fewest bytes of a vertex and of a face: `0 0 0` and `0`, each with a line end.
const LEAST: [u64; 2] = [6, 2];
/// Lines between two looks at whether to stop.
const LOOK: u64 = 1 << 14;
const TRUNCATED: &str = "the file is truncated, or its header announces too much";

/// Reads an OFF file.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let mut text = Text { lines: Lines::new(content), ahead: None };
    let form = text.form()?;
    let [vertices, faces] = text.counts(content.len() as u64)?;
    input::hold("the vertices", vertices.saturating_mul(BYTES_PER_VERTEX), reading.params)?;
    let mut columns = Columns::new(form, vertices as usize)?;
    for vertex in 0..vertices {
        look(vertex, reading)?;
        let (line, words) = text.next(|| format!("vertex {vertex} of {vertices}"))?;
        columns.vertex(line, &words, reading)?;
    }
    let mut fans = Fans::default();
    for face in 0..faces {
        look(face, reading)?;
        let (line, words) = text.next(|| format!("face {face} of {faces}"))?;
        let corners = corners(line, &words, vertices, reading)?;
        fans.add(face, &corners, words[0].place(), reading)?;
    }
    text.finish()?;
    let mut points = columns.into_points()?;
    points.opacity = opacity::meant(points.opacity, &mut reading.notes);
    if faces == 0 {
        return Ok(Loaded::Points(points));
    }
    let RawPoints { origin, position, normal, color, opacity, .. } = points;
    // Normals of which one is zero are left out: they are to be computed anew.
    let normal = if normal.contains(&Vec3::ZERO) { Vec::new() } else { normal };
    let vertices = Mesh { origin, position, normal, color, opacity, ..Mesh::default() };
    fans.into_mesh(vertices, reading).map(Loaded::Mesh)
}

fn look(record: u64, reading: &Reading<'_>) -> Result<(), ReadError> {
    if record.is_multiple_of(LOOK) { reading.go_on() } else { Ok(()) }
}

/// What a vertex has beside its place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Form {
    texture: bool,
    color: bool,
    normal: bool,
}

/// Lines that have something on them.
struct Text<'a> {
    lines: Lines<'a>,
    /// What stands on the line of the keyword after it.
    ahead: Option<(Line<'a>, Vec<Word<'a>>)>,
}

impl<'a> Text<'a> {
    fn find(&mut self) -> Result<Option<(Line<'a>, Vec<Word<'a>>)>, ReadError> {
        if let Some(ahead) = self.ahead.take() {
            return Ok(Some(ahead));
        }
        while let Some(line) = self.lines.next()? {
            let words: Vec<Word<'a>> = line.words(false).take_while(|w| !w.text.starts_with(b"#")).collect();
            if !words.is_empty() {
                return Ok(Some((line, words)));
            }
        }
        Ok(None)
    }

    fn next(&mut self, expected: impl FnOnce() -> String) -> Result<(Line<'a>, Vec<Word<'a>>), ReadError> {
        let found = self.find()?;
        found.ok_or_else(|| ReadError::input(self.lines.end(), expected(), "the end of the file", TRUNCATED))
    }

    fn form(&mut self) -> Result<Form, ReadError> {
        let Some((line, mut words)) = self.find()? else {
            return Err(ReadError::input(Place::Byte(0), "'OFF'", "an empty file", TRUNCATED));
        };
        let first = words.remove(0);
        let (form, rest) = keyword(first)?;
        if words.first().is_some_and(|w| w.text == b"BINARY") {
            let hint = "save it as text, or as PLY";
            return Err(ReadError::input(words[0].place(), "OFF as text", "'BINARY'", hint));
        }
        // Some writers leave out the line end after the keyword.
        words.splice(0..0, rest);
        self.ahead = (!words.is_empty()).then_some((line, words));
        Ok(form)
    }

    /// Numbers of vertices and faces, refused if `bytes` cannot hold them.
    fn counts(&mut self, bytes: u64) -> Result<[u64; 2], ReadError> {
        let (line, words) = self.next(|| "numbers of vertices, faces and edges".to_owned())?;
        if !matches!(words.len(), 2 | 3) {
            return Err(wrong(line, "numbers of vertices, faces and edges"));
        }
        let mut counts = [0; 2];
        for (i, count) in counts.iter_mut().enumerate() {
            let most = bytes / LEAST[i];
            *count = whole(words[i]).filter(|n| *n <= most).ok_or_else(|| {
                let what = ["vertices", "faces"][i];
                let expected = format!("at most {most} {what}, what {bytes} bytes can hold");
                ReadError::input(words[i].place(), expected, words[i].shown(), TRUNCATED)
            })?;
        }
        Ok(counts)
    }

    fn finish(&mut self) -> Result<(), ReadError> {
        match self.find()? {
            None => Ok(()),
            Some((_, words)) => {
                let hint = "the header announces too little, or the file is damaged";
                let expected = "the end of the file after the last face";
                Err(ReadError::input(words[0].place(), expected, words[0].shown(), hint))
            }
        }
    }
}

/// What the keyword says, and what hangs together with it.
fn keyword(word: Word<'_>) -> Result<(Form, Option<Word<'_>>), ReadError> {
    let mut form = Form::default();
    let mut rest = word.text;
    for (prefix, flag) in [(&b"ST"[..], &mut form.texture), (&b"C"[..], &mut form.color), (&b"N"[..], &mut form.normal)]
    {
        if let Some(after) = rest.strip_prefix(prefix) {
            (*flag, rest) = (true, after);
        }
    }
    match rest.strip_prefix(b"OFF") {
        Some([]) => Ok((form, None)),
        Some(digits) if digits[0].is_ascii_digit() => Ok((form, Some(word.after(word.text.len() - digits.len())))),
        _ => {
            let hint = "places of three coordinates are read; 4OFF and nOFF are not";
            Err(ReadError::input(word.place(), "'OFF', 'COFF', 'NOFF' or 'CNOFF'", word.shown(), hint))
        }
    }
}

fn whole(word: Word<'_>) -> Option<u64> {
    std::str::from_utf8(word.text).ok()?.parse().ok()
}

fn wrong(line: Line<'_>, expected: &str) -> ReadError {
    let found = format!("'{}'", escaped(line.text.trim_ascii(), 60));
    ReadError::input(line.place(), expected, found, "one vertex or face a line, as OFF writers do")
}

/// The vertices of a face; numbers of a colour after them are read over.
fn corners(
    line: Line<'_>,
    words: &[Word<'_>],
    vertices: u64,
    reading: &mut Reading<'_>,
) -> Result<Vec<u32>, ReadError> {
    let count = whole(words[0]).and_then(|n| usize::try_from(n).ok());
    let Some(after) = count.and_then(|n| words[1..].len().checked_sub(n)) else {
        return Err(wrong(line, "a number of corners, and as many vertices"));
    };
    let (corners, color) = words[1..].split_at(words.len() - 1 - after);
    match color.len() {
        0 => {}
        1 | 3 | 4 => reading.notes.not_used([&b"face colours"[..]]),
        _ => return Err(wrong(line, "a number of corners, as many vertices, and a colour of 0, 1, 3 or 4 numbers")),
    }
    color.iter().try_for_each(|w| w.number().map(|_| ()))?;
    let index = |w: &Word<'_>| {
        whole(*w).filter(|n| *n < vertices.min(u64::from(u32::MAX))).map(|n| n as u32).ok_or_else(|| {
            let expected = format!("a vertex from 0 to {}", vertices.saturating_sub(1));
            ReadError::input(w.place(), expected, w.shown(), "the face list is damaged")
        })
    };
    corners.iter().map(index).collect()
}

/// The columns while they are filled.
struct Columns {
    form: Form,
    positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    colors: Vec<DVec3>,
    /// One a vertex with a colour; NaN for one without.
    opacities: Vec<f64>,
    /// The first colour above 1, and whether one is written with a point.
    above_one: Option<(Place, String)>,
    pointed: bool,
}

impl Columns {
    fn new(form: Form, vertices: usize) -> Result<Self, ReadError> {
        let positions = Vec::new();
        let normals = Vec::new();
        let colors = Vec::new();
        let opacities = Vec::new();
        let mut columns = Self { form, positions, normals, colors, opacities, above_one: None, pointed: false };
        input::reserve(&mut columns.positions, vertices)?;
        input::reserve(&mut columns.normals, if form.normal { vertices } else { 0 })?;
        input::reserve(&mut columns.colors, if form.color { vertices } else { 0 })?;
        Ok(columns)
    }

    fn vertex(&mut self, line: Line<'_>, words: &[Word<'_>], reading: &mut Reading<'_>) -> Result<(), ReadError> {
        let Form { texture, color, normal } = self.form;
        let before = 3 + 3 * usize::from(normal);
        let behind = 2 * usize::from(texture);
        let colors = words.len().checked_sub(before + behind);
        if !colors.is_some_and(|n| if color { matches!(n, 3 | 4) } else { n == 0 }) {
            let least = before + behind + 3 * usize::from(color);
            let expected = format!("a vertex of {least} numbers{}", if color { " or one more" } else { "" });
            let found = format!("{} on the line", words.len());
            let hint = "the first word says what a vertex has: COFF has colours, NOFF normals, CNOFF both";
            return Err(ReadError::input(line.place(), expected, found, hint));
        }
        let mut numbers = [0.0; 12];
        for (number, word) in numbers.iter_mut().zip(words) {
            *number = word.number()?;
        }
        self.positions.push(DVec3::from_slice(&numbers));
        if normal {
            self.normals.push(unit(DVec3::from_slice(&numbers[3..])));
        }
        if color {
            self.color(&words[before..before + 3])?;
            self.colors.push(DVec3::from_slice(&numbers[before..]));
            if colors == Some(4) {
                let word = words[before + 3];
                if !(0.0..=255.0).contains(&numbers[before + 3]) {
                    let hint = "opacities are whole numbers from 0 to 255, or 0.0 to 1.0";
                    return Err(ReadError::input(word.place(), "an opacity from 0 to 255", word.shown(), hint));
                }
            }
            input::reserve(&mut self.opacities, 1)?;
            self.opacities.push(if colors == Some(4) { numbers[before + 3] } else { f64::NAN });
        }
        if texture {
            reading.notes.not_used([&b"texture coordinates"[..]]);
        }
        Ok(())
    }

    fn color(&mut self, words: &[Word<'_>]) -> Result<(), ReadError> {
        for word in words {
            let value = word.number()?;
            self.pointed |= !word.text.iter().all(u8::is_ascii_digit);
            if !(0.0..=255.0).contains(&value) {
                let hint = "colours are whole numbers from 0 to 255, or 0.0 to 1.0";
                return Err(ReadError::input(word.place(), "a colour from 0 to 255", word.shown(), hint));
            }
            if value > 1.0 && self.above_one.is_none() {
                self.above_one = Some((word.place(), word.shown()));
            }
        }
        Ok(())
    }

    fn into_points(self) -> Result<RawPoints, ReadError> {
        let (origin, position) = origin::relative(&self.positions, Place::File, |i| format!("vertex {i}"))?;
        let color: Vec<[f32; 3]> = match self.above_one {
            Some((place, found)) if self.pointed => {
                let hint = "colours are whole numbers from 0 to 255, or all of them 0.0 to 1.0";
                return Err(ReadError::input(place, "a colour from 0 to 1, as others have a point", found, hint));
            }
            Some(_) => self.colors.iter().map(|c| c.to_array().map(|v| linear_from_srgb(v / 255.0))).collect(),
            None => self.colors.iter().map(|c| c.as_vec3().to_array()).collect(),
        };
        // Programs write whole colours beside opacities from 0 to 1.
        let top = if self.opacities.iter().any(|alpha| *alpha > 1.0) { 255.0 } else { 1.0 };
        let opacity =
            self.opacities.iter().map(|alpha| if alpha.is_nan() { 1.0 } else { (alpha / top) as f32 }).collect();
        Ok(RawPoints { origin, position, normal: self.normals, color, opacity, ..RawPoints::default() })
    }
}
