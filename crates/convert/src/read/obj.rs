//! Wavefront OBJ → a mesh where there are faces, else raw points.
//!
//! Read are `v` (with linear colours after the coordinates, if all have them), `vn` and `f`; texture coordinates, groups,
//! lines and materials are read over: no material file is ever opened, wherever `mtllib` points to. The parser is our
//! own: lines, columns and checked indices are asked of it.

use super::ReadParams;
use super::polygon::{self, Polygon};
use super::reading::{Fix, Reading};
use super::text::{Line, Lines, Word};
use super::{Loaded, input, origin};
use crate::error::{Place, ReadError};
use crate::raw_points::RawPoints;
use splat_core::Mesh;
use splat_core::glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Bytes that a vertex, a corner and a triangle take while they are read and converted.
const BYTES_PER_VERTEX: u64 = 24 + 12 + 12 + 12;
const BYTES_PER_CORNER: u64 = 32;
const BYTES_PER_TRIANGLE: u64 = 12;

/// Statements without a meaning here.
pub(super) const READ_OVER: [&[u8]; 22] = [
    b"vt",
    b"vp",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"usemtl",
    b"mtllib",
    b"l",
    b"p",
    b"usemap",
    b"maplib",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
    b"deg",
    b"cstype",
    b"call",
    b"csh",
];

#[derive(Default)]
struct Content {
    positions: Vec<DVec3>,
    colors: Vec<[f32; 3]>,
    normals: Vec<Vec3>,
    /// Position and normal of each vertex of the mesh; the normal is `NONE` where the corner has none.
    corners: Vec<[u32; 2]>,
    of_corner: HashMap<[u32; 2], u32>,
    triangles: Vec<[u32; 3]>,
    polygons: Vec<Polygon>,
    /// Lines of the polygons.
    lines: Vec<u64>,
    faces: u64,
    /// The first corner that names a normal before there is any.
    without_normal: Option<ReadError>,
}

const NONE: u32 = u32::MAX;

/// Lines between two looks at whether to stop.
const LOOK: u64 = 1 << 14;

/// Reads an OBJ file.
pub(super) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let mut lines = Lines::new(content);
    let mut found = Content::default();
    let mut continued = false;
    while let Some(line) = lines.next()? {
        // A backslash joins lines; only statements that are read over are written so.
        let before = std::mem::replace(&mut continued, line.text.ends_with(b"\\"));
        if !before {
            found.statement(line, continued, reading)?;
        }
        if line.number.is_multiple_of(LOOK) {
            reading.go_on()?;
        }
    }
    found.finish(reading)
}

impl Content {
    fn statement(&mut self, line: Line<'_>, continued: bool, reading: &mut Reading<'_>) -> Result<(), ReadError> {
        let mut words = line.words(false).take_while(|w| !w.text.starts_with(b"#"));
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword.text {
            b"v" | b"vn" | b"f" if continued => {
                let hint = "write the statement on one line";
                Err(ReadError::input(line.place(), "vertices and faces on one line", "a line that goes on", hint))
            }
            b"v" => self.vertex(keyword, words, reading.params),
            b"vn" => self.normal(keyword, words, reading.params),
            b"f" => self.face(keyword, words, reading),
            other if READ_OVER.contains(&other) => Ok(()),
            _ => {
                let hint = "is this a Wavefront OBJ file?";
                Err(ReadError::input(keyword.place(), "a statement of OBJ such as v, vn or f", keyword.shown(), hint))
            }
        }
    }

    fn vertex<'a>(
        &mut self,
        keyword: Word<'a>,
        words: impl Iterator<Item = Word<'a>>,
        params: &ReadParams,
    ) -> Result<(), ReadError> {
        let words: Vec<Word<'a>> = words.collect();
        // x y z, x y z w, x y z r g b.
        if !matches!(words.len(), 3 | 4 | 6) {
            let found = format!("{} numbers", words.len());
            return Err(ReadError::input(keyword.place(), "v X Y Z, or v X Y Z R G B", found, "complete the vertex"));
        }
        input::check_bytes("the vertices", (self.positions.len() as u64 + 1) * BYTES_PER_VERTEX, params)?;
        let mut numbers = [0.0; 6];
        for (number, word) in numbers.iter_mut().zip(&words) {
            *number = word.number()?;
        }
        input::reserve(&mut self.positions, 1)?;
        if words.len() == 6 && self.colors.len() == self.positions.len() {
            for (c, word) in numbers[3..].iter().zip(&words[3..]) {
                if !(0.0..=1.0).contains(c) {
                    let hint = "colours are 0.0 to 1.0";
                    return Err(ReadError::input(word.place(), "a colour from 0 to 1", word.shown(), hint));
                }
            }
            input::reserve(&mut self.colors, 1)?;
            self.colors.push([3, 4, 5].map(|i| numbers[i] as f32));
        }
        self.positions.push(DVec3::new(numbers[0], numbers[1], numbers[2]));
        Ok(())
    }

    fn normal<'a>(
        &mut self,
        keyword: Word<'a>,
        words: impl Iterator<Item = Word<'a>>,
        params: &ReadParams,
    ) -> Result<(), ReadError> {
        let words: Vec<Word<'a>> = words.collect();
        let [x, y, z] = words.as_slice() else {
            let found = format!("{} numbers", words.len());
            return Err(ReadError::input(keyword.place(), "vn X Y Z", found, "complete the normal"));
        };
        let n = DVec3::new(x.number()?, y.number()?, z.number()?);
        input::check_bytes("the normals", (self.normals.len() as u64 + 1) * 12, params)?;
        input::reserve(&mut self.normals, 1)?;
        let largest = n.abs().max_element();
        // Scaled first, so that neither 1e-200 nor 1e200 is lost in the squares.
        self.normals.push(if largest > 0.0 { (n / largest).normalize().as_vec3() } else { Vec3::ZERO });
        Ok(())
    }

    fn face<'a>(
        &mut self,
        keyword: Word<'a>,
        words: impl Iterator<Item = Word<'a>>,
        reading: &mut Reading<'_>,
    ) -> Result<(), ReadError> {
        let mut fan = [0; 2];
        let mut corners = 0;
        let first = self.triangles.len();
        for word in words {
            let corner = self.corner(word, reading)?;
            if corners < 2 {
                fan[corners] = corner;
            } else {
                let bytes = (self.triangles.len() as u64 + 1) * BYTES_PER_TRIANGLE;
                input::check_bytes("the triangles", bytes, reading.params)?;
                input::reserve(&mut self.triangles, 1)?;
                self.triangles.push([fan[0], fan[1], corner]);
                fan[1] = corner;
            }
            corners += 1;
        }
        self.faces += 1;
        if corners < 3 {
            return reading.mend((Fix::TooFewCorners, keyword.place(), Some(self.faces)), || {
                let expected = format!("3 or more corners of face {}", self.faces);
                ReadError::input(keyword.place(), expected, corners.to_string(), "remove degenerate faces")
            });
        }
        if corners > 3 {
            let Place::Line { line, .. } = keyword.place() else { return Ok(()) };
            self.polygons.push(Polygon { face: self.faces, first, count: corners - 2 });
            self.lines.push(line);
        }
        Ok(())
    }

    /// The vertex of the mesh for `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: Word<'_>, reading: &mut Reading<'_>) -> Result<u32, ReadError> {
        let mut parts = word.text.split(|b| *b == b'/');
        let position = index(word, parts.next().unwrap_or_default(), self.positions.len(), "vertices")?;
        let _texture = parts.next();
        let normal = match parts.next() {
            None | Some(b"") => NONE,
            Some(part) => self.normal_index(word, part, reading)?,
        };
        if parts.next().is_some() {
            return Err(ReadError::input(word.place(), "v, v/vt, v//vn or v/vt/vn", word.shown(), "repair the face"));
        }
        let key = [position, normal];
        if let Some(&known) = self.of_corner.get(&key) {
            return Ok(known);
        }
        input::check_bytes("the corners", (self.corners.len() as u64 + 1) * BYTES_PER_CORNER, reading.params)?;
        input::reserve(&mut self.corners, 1)?;
        let new = self.corners.len() as u32;
        self.corners.push(key);
        self.of_corner.insert(key, new);
        Ok(new)
    }

    /// The normal of a corner. Where the file has none so far that is an error only if it gets some later: exporters write
    /// indices of normals that they were told to leave out.
    fn normal_index(&mut self, word: Word<'_>, part: &[u8], reading: &mut Reading<'_>) -> Result<u32, ReadError> {
        let found = index(word, part, self.normals.len(), "normals");
        let is_index = std::str::from_utf8(part).is_ok_and(|t| t.parse::<i64>().is_ok_and(|n| n != 0));
        match found {
            Err(error) if self.normals.is_empty() && is_index => {
                reading.mend((Fix::MissingNormals, word.place(), None), || error.clone())?;
                self.without_normal.get_or_insert(error);
                Ok(NONE)
            }
            found => found,
        }
    }

    fn finish(self, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
        if let Some(error) = self.without_normal.filter(|_| !self.normals.is_empty()) {
            return Err(error);
        }
        let (origin, offsets) = origin::split(&self.positions).map_err(|i| {
            let found = format!("{} at vertex {}", self.positions[i], i + 1);
            let expected = "coordinates that fit 32-bit floats once the middle is subtracted";
            ReadError::input(Place::File, expected, found, "scale the data, or remove outliers")
        })?;
        let colored = self.colors.len() == self.positions.len();
        if self.faces == 0 {
            let color = if colored { self.colors } else { Vec::new() };
            return Ok(Loaded::Points(RawPoints { origin, position: offsets, color, ..RawPoints::default() }));
        }
        let of = |c: &[u32; 2]| self.normals.get(c[1] as usize).copied().unwrap_or(Vec3::ZERO);
        let normals: Vec<Vec3> = self.corners.iter().map(of).collect();
        let mut mesh = Mesh {
            origin,
            position: self.corners.iter().map(|c| offsets[c[0] as usize]).collect(),
            // Normals of which one is missing are to be computed anew.
            normal: if normals.contains(&Vec3::ZERO) { Vec::new() } else { normals },
            color: if colored { self.corners.iter().map(|c| self.colors[c[0] as usize]).collect() } else { Vec::new() },
            triangles: self.triangles,
        };
        let at = |rank: usize| Place::Line { line: self.lines[rank], column: 0 };
        polygon::triangulate(&mut mesh, &self.polygons, reading, at)?;
        Ok(Loaded::Mesh(mesh))
    }
}

/// An index counted from 1, or from the last one backwards: −1 is the last one so far.
fn index(word: Word<'_>, part: &[u8], count: usize, what: &str) -> Result<u32, ReadError> {
    let number = std::str::from_utf8(part).ok().and_then(|t| t.parse::<i64>().ok());
    let count = count as i64;
    let from_zero = match number {
        Some(n) if n > 0 => n - 1,
        Some(n) if n < 0 => count.saturating_add(n),
        _ => -1,
    };
    if (0..count).contains(&from_zero) && from_zero < i64::from(NONE) {
        return Ok(from_zero as u32);
    }
    let expected = format!("an index from 1 to {count}, or from -{count} to -1: there are {count} {what} so far");
    Err(ReadError::input(word.place(), expected, word.shown(), "the face list is damaged, or it comes before its data"))
}
