//! Wavefront OBJ → a mesh where there are faces, else raw points.
//!
//! Read are `v` (with linear colours after the coordinates, if all have them), `vn`, `vt`, `f`, and of materials the diffuse
//! colour and its texture (see `mtl.rs`), unless vertices have colours of their own. Vertices are split where materials
//! meet. Groups and curves are read over, and
//! lines too but for a file of lines alone, which are tubes. The parser is our own: lines, columns and checked indices are asked of it.

use super::fans::Fans;
use super::mtl::Materials;
use super::paint::corners::{BYTES_PER_CORNER, Corner, NONE, painted};
use super::statements;
use super::tubes::Tubes;
use crate::error::{Place, ReadError};
use crate::points::direction::unit;
use crate::points::origin;
use crate::reading::{Fix, Reading};
use crate::stream::input;
use crate::stream::input::Growing;
use crate::text::{Line, Lines, Word};
use crate::{Loaded, ReadParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::text::counted;
use splat_core::{Mesh, RawPoints};
use std::collections::HashMap;
use std::path::Path;

/// Bytes that a vertex takes while it is read and converted.
const BYTES_PER_VERTEX: u64 = 24 + 12 + 12 + 12;

/// Statements without a meaning here.
pub(crate) const READ_OVER: [&[u8]; 18] = [
    b"vp",
    b"g",
    b"o",
    b"s",
    b"mg",
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

struct Content<'a> {
    positions: Vec<DVec3>,
    colors: Vec<[f32; 3]>,
    normals: Vec<Vec3>,
    /// NaN where they are no numbers, which matters only where they are used.
    places: Vec<[f32; 2]>,
    corners: Vec<Corner>,
    of_corner: HashMap<Corner, u32>,
    fans: Fans,
    faces: u64,
    /// Points of lines, one line behind the other, and where each ends.
    line_points: Vec<u32>,
    line_ends: Vec<usize>,
    /// The corners of the current face.
    face: Vec<u32>,
    /// The first corner that names a normal before there is any.
    without_normal: Option<ReadError>,
    materials: Materials<'a>,
    held: Held,
}

/// Memory of what is read.
struct Held {
    vertices: Growing,
    lines: Growing,
    normals: Growing,
    places: Growing,
    corners: Growing,
}

/// Lines between two looks at whether to stop.
const LOOK: u64 = 1 << 14;

/// Reads an OBJ file, which lies at `place` if it is no part of memory.
pub(crate) fn read(content: &[u8], place: Option<&Path>, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    reading.notes.not_used(statements::unused(content));
    let mut lines = Lines::new(content);
    let mut found = Content {
        positions: Vec::new(),
        colors: Vec::new(),
        normals: Vec::new(),
        places: Vec::new(),
        corners: Vec::new(),
        of_corner: HashMap::new(),
        fans: Fans::default(),
        faces: 0,
        line_points: Vec::new(),
        line_ends: Vec::new(),
        face: Vec::new(),
        without_normal: None,
        materials: Materials::new(place),
        held: Held {
            vertices: Growing::new("the vertices"),
            lines: Growing::new("the lines"),
            normals: Growing::new("the normals"),
            places: Growing::new("the texture coordinates"),
            corners: Growing::new("the corners"),
        },
    };
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

impl Content<'_> {
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
            b"vt" => self.texture_place(words, reading.params),
            b"f" => self.face(keyword, words, reading),
            // Lines that go on are read over: their points are not known here.
            b"l" if !continued => self.line(words, reading.params),
            b"mtllib" => self.materials.library(line, reading),
            b"usemtl" => self.materials.choose(line, reading),
            b"l" => Ok(()),
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
        self.held.vertices.hold((self.positions.len() as u64 + 1) * BYTES_PER_VERTEX, params)?;
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
        self.held.normals.hold((self.normals.len() as u64 + 1) * 12, params)?;
        input::reserve(&mut self.normals, 1)?;
        self.normals.push(unit(n));
        Ok(())
    }

    fn texture_place<'a>(
        &mut self,
        mut words: impl Iterator<Item = Word<'a>>,
        params: &ReadParams,
    ) -> Result<(), ReadError> {
        let mut number = |missing| words.next().map_or(Some(missing), Word::decimal).unwrap_or(f64::NAN) as f32;
        let u = number(f64::NAN);
        let v = number(0.0);
        self.held.places.hold((self.places.len() as u64 + 1) * 8, params)?;
        input::reserve(&mut self.places, 1)?;
        // Rows of an image are counted from the top.
        self.places.push([u, 1.0 - v]);
        Ok(())
    }

    fn face<'a>(
        &mut self,
        keyword: Word<'a>,
        words: impl Iterator<Item = Word<'a>> + Clone,
        reading: &mut Reading<'_>,
    ) -> Result<(), ReadError> {
        let has_place = |w: Word<'_>| w.text.split(|b| *b == b'/').nth(1).is_some_and(|part| !part.is_empty());
        let has_texture = self.materials.has_texture();
        let is_textured = has_texture && words.clone().all(has_place);
        if has_texture && !is_textured {
            reading.notes.remark("faces without texture coordinates have the Kd of their material alone");
        }
        self.face.clear();
        for word in words {
            let corner = self.corner(word, is_textured, reading)?;
            self.face.push(corner);
        }
        self.faces += 1;
        self.fans.add(self.faces, &self.face, keyword.place(), reading)
    }

    /// A line through vertices, whose texture coordinates are not used.
    fn line<'a>(&mut self, words: impl Iterator<Item = Word<'a>>, params: &ReadParams) -> Result<(), ReadError> {
        let ends = (self.line_ends.len() + 1) * size_of::<usize>();
        for word in words {
            let part = word.text.split(|b| *b == b'/').next().unwrap_or_default();
            let point = index(word, part, self.positions.len(), "vertices")?;
            let points = (self.line_points.len() + 1) * size_of::<u32>();
            self.held.lines.hold((points + ends) as u64, params)?;
            input::reserve(&mut self.line_points, 1)?;
            self.line_points.push(point);
        }
        self.held.lines.hold((size_of_val(self.line_points.as_slice()) + ends) as u64, params)?;
        input::reserve(&mut self.line_ends, 1)?;
        self.line_ends.push(self.line_points.len());
        Ok(())
    }

    /// The tubes around the lines, if there are some.
    fn tubes(&self, positions: &[Vec3], reading: &mut Reading<'_>) -> Result<Option<Tubes>, ReadError> {
        let starts = [0].into_iter().chain(self.line_ends.iter().copied());
        let lines = starts.zip(&self.line_ends).enumerate();
        let lines = lines.map(|(rank, (start, end))| (rank as u32, &self.line_points[start..*end]));
        Tubes::around(positions, lines, reading)
    }

    /// The vertex of the mesh for `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: Word<'_>, is_textured: bool, reading: &mut Reading<'_>) -> Result<u32, ReadError> {
        let mut parts = word.text.split(|b| *b == b'/');
        let position = index(word, parts.next().unwrap_or_default(), self.positions.len(), "vertices")?;
        let place = match parts.next() {
            Some(part) if is_textured => self.place_index(word, part)?,
            _ => NONE,
        };
        let normal = match parts.next() {
            None | Some(b"") => NONE,
            Some(part) => self.normal_index(word, part, reading)?,
        };
        if parts.next().is_some() {
            return Err(ReadError::input(word.place(), "v, v/vt, v//vn or v/vt/vn", word.shown(), "repair the face"));
        }
        let key = [position, normal, place, self.materials.paint(is_textured)];
        if let Some(&known) = self.of_corner.get(&key) {
            return Ok(known);
        }
        self.held.corners.hold((self.corners.len() as u64 + 1) * BYTES_PER_CORNER, reading.params)?;
        input::reserve(&mut self.corners, 1)?;
        self.of_corner.try_reserve(1).map_err(|_| input::none_left("corners"))?;
        let new = self.corners.len() as u32;
        self.corners.push(key);
        self.of_corner.insert(key, new);
        Ok(new)
    }

    /// The texture coordinates of a corner whose material has a texture.
    fn place_index(&self, word: Word<'_>, part: &[u8]) -> Result<u32, ReadError> {
        let place = index(word, part, self.places.len(), "texture coordinates")?;
        if self.places[place as usize].iter().all(|c| c.is_finite()) {
            return Ok(place);
        }
        let hint = "repair the statement vt, or remove the material's texture";
        Err(ReadError::input(word.place(), "texture coordinates that are finite numbers", word.shown(), hint))
    }

    /// The normal of a corner. Where the file has none so far that is an error only if it gets some later: exporters write
    /// indices of normals that they were told to leave out.
    fn normal_index(&mut self, word: Word<'_>, part: &[u8], reading: &mut Reading<'_>) -> Result<u32, ReadError> {
        let found = index(word, part, self.normals.len(), "normals");
        let is_index = std::str::from_utf8(part).is_ok_and(|t| t.parse::<i64>().is_ok_and(|n| n != 0));
        match found {
            Err(error) if self.normals.is_empty() && is_index => {
                reading.mend(Fix::MissingNormals, word.place(), None, || error.clone())?;
                self.without_normal.get_or_insert(error);
                Ok(NONE)
            }
            found => found,
        }
    }

    fn finish(self, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
        if let Some(error) = self.without_normal.as_ref().filter(|_| !self.normals.is_empty()) {
            return Err(error.clone());
        }
        let (origin, offsets) = origin::relative(&self.positions, Place::File, |i| format!("vertex {}", i + 1))?;
        let colored = self.colors.len() == self.positions.len();
        if !self.places.is_empty() && (colored || self.materials.textures.is_empty()) {
            reading.notes.not_used([&b"vt"[..]]);
        }
        let tubes = if self.faces == 0 { self.tubes(&offsets, reading)? } else { None };
        if let Some(tubes) = tubes {
            let color = if colored { tubes.of_vertices(&self.colors) } else { Vec::new() };
            let vertices = Mesh { origin, color, ..Mesh::default() };
            return Ok(Loaded::Mesh(tubes.into_mesh(vertices, reading)));
        }
        if !self.line_ends.is_empty() {
            reading.notes.not_used([counted(self.line_ends.len() as u64, "line").as_bytes()]);
        }
        if self.faces == 0 {
            let color = if colored { self.colors } else { Vec::new() };
            return Ok(Loaded::Points(RawPoints { origin, position: offsets, color, ..RawPoints::default() }));
        }
        drop(self.of_corner);
        let normal = |c: &Corner| self.normals.get(c[1] as usize).copied().unwrap_or(Vec3::ZERO);
        let normals: Vec<Vec3> = self.corners.iter().map(normal).collect();
        let vertices = Mesh {
            origin,
            position: self.corners.iter().map(|c| offsets[c[0] as usize]).collect(),
            // Normals of which one is missing are to be computed anew.
            normal: if normals.contains(&Vec3::ZERO) { Vec::new() } else { normals },
            color: if colored { self.corners.iter().map(|c| self.colors[c[0] as usize]).collect() } else { Vec::new() },
            ..Mesh::default()
        };
        let mesh = self.fans.into_mesh(vertices, reading)?;
        self.materials.remark_unused(reading);
        if self.materials.is_used && colored {
            let is_clear = self.materials.paints.iter().any(|paint| paint.factor[3] < 1.0);
            reading.notes.not_used([&b"Kd"[..]].into_iter().chain(is_clear.then_some(&b"d"[..])));
        }
        if colored || !self.materials.is_used {
            return Ok(Loaded::Mesh(mesh));
        }
        let Materials { paints, textures, .. } = self.materials;
        painted(mesh, self.corners, &self.places, paints, textures, reading).map(Loaded::Mesh)
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
