//! The faces of a PLY file: polygons and triangle strips.

use super::body::{Source, list_length, look, skip_list};
use super::columns::Columns;
use super::header::{Element, Property, Shape, Type, at_line};
use super::texture::{NUMBER, OF_CORNERS, Wedges};
use crate::ReadParams;
use crate::error::ReadError;
use crate::meshes::paint::corners::BYTES_PER_CORNER;
use crate::meshes::polygon::{self, Polygon};
use crate::points::extras::Extras;
use crate::reading::{Fix, Reading};
use crate::stream::input;
use splat_core::{Association, Column, Mesh, MeshColumn};

/// What the list of an element stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// The corners of one face.
    Polygons,
    /// Triangles of three successive corners each, every other one turned around; −1 begins a new strip.
    Strips,
}

/// The faces so far.
pub(super) struct Faces {
    triangles: Vec<[u32; 3]>,
    /// Faces of more than three corners; fans among the triangles until all vertices are known.
    polygons: Vec<Polygon>,
    /// Line of the header that announces the polygons.
    line: u64,
    /// Vertices of the file.
    vertices: u64,
    /// Memory of the triangles.
    held: input::Growing,
    /// Names of the numbers of vertices, which those of faces of the same names stand behind.
    of_vertices: Vec<Vec<u8>>,
    /// Numbers of faces that are asked for, one a triangle, and those of the record.
    extras: Extras,
    record: Vec<f64>,
    /// The corners of faces with their places in textures, where these are asked for; triangles have these as vertices then.
    wedges: Option<Wedges>,
    /// Places of the corners of the record.
    places: Vec<f32>,
}

/// Ranks of textures that are told apart.
const MOST_TEXTURES: u32 = 1 << 20;

/// The number after which a strip begins anew, also as an unsigned number of 32 bits.
const RESTART: [f64; 2] = [-1.0, u32::MAX as f64];

/// The numbers of faces that are asked for.
fn extras(element: &Element, of_vertices: &[Vec<u8>], params: &ReadParams) -> Extras {
    let scalars = element.properties.iter().enumerate().filter(|(_, p)| matches!(p.shape, Shape::Scalar(_)));
    let names: Vec<&[u8]> = of_vertices.iter().map(Vec::as_slice).collect();
    let columns = scalars.map(|(rank, p)| (rank, p.name.as_slice(), false));
    Extras::of_mesh(columns, Association::Triangle, params).without(&names)
}

impl Faces {
    pub(super) fn new(vertices: u64, of_vertices: Vec<Vec<u8>>, has_wedges: bool) -> Self {
        Self {
            of_vertices,
            triangles: Vec::new(),
            polygons: Vec::new(),
            line: 0,
            vertices,
            held: input::Growing::new("the triangles"),
            extras: Extras::default(),
            record: Vec::new(),
            wedges: has_wedges.then(Wedges::default),
            places: Vec::new(),
        }
    }

    /// Reads one element of faces.
    pub(super) fn read<S: Source>(
        &mut self,
        source: &mut S,
        element: &Element,
        form: Form,
        reading: &mut Reading<'_>,
    ) -> Result<(), ReadError> {
        if element.count == 0 {
            return Ok(());
        }
        let is_index = |p: &Property| p.name == b"vertex_indices" || p.name == b"vertex_index";
        let Some(indices) = element.properties.iter().find(|p| is_index(p)) else {
            let hint = "faces without vertices cannot be drawn";
            return Err(ReadError::input(at_line(element.line), "a list 'vertex_indices'", "none", hint));
        };
        if !matches!(indices.shape, Shape::List { item, .. } if item.integer_range().is_some()) {
            let hint = "write 'property list uchar int vertex_indices'";
            return Err(ReadError::input(at_line(indices.line), "a list of integers", "another type", hint));
        }
        if form == Form::Polygons {
            self.line = element.line;
            self.extras = extras(element, &self.of_vertices, reading.params);
            self.record = vec![f64::NAN; element.properties.len()];
            self.room(element.count, reading)?;
            // Strips before faces have no such numbers.
            self.fill_extras(self.triangles.len());
        }
        for record in 0..element.count {
            look(record, reading)?;
            source.begin_record()?;
            let before = self.triangles.len();
            self.places.clear();
            for (index, property) in element.properties.iter().enumerate() {
                match property.shape {
                    Shape::Scalar(kind) => {
                        let number = source.number(kind)?;
                        if let Some(kept) = self.record.get_mut(index) {
                            *kept = number;
                        }
                    }
                    Shape::List { count, item } if is_index(property) => match form {
                        Form::Polygons => self.polygon(source, record, count, item, reading)?,
                        Form::Strips => self.strip(source, record, count, item, reading)?,
                    },
                    Shape::List { count, item } if self.wedges.is_some() && property.name == OF_CORNERS => {
                        for _ in 0..list_length(source, count, item)? {
                            let place = source.number(item)? as f32;
                            self.places.push(place);
                        }
                    }
                    Shape::List { count, item } => skip_list(source, count, item)?,
                }
            }
            source.end_record()?;
            self.place_corners(before, element, form, reading)?;
            if form == Form::Polygons && self.extras.reads() {
                let Self { extras, record, triangles, .. } = self;
                (before..triangles.len()).for_each(|_| extras.push(|index| record[index]));
            }
        }
        Ok(())
    }

    /// Gives the triangles of a record vertices of their own, one for each place in a texture.
    fn place_corners(
        &mut self,
        before: usize,
        element: &Element,
        form: Form,
        reading: &Reading<'_>,
    ) -> Result<(), ReadError> {
        let Some(wedges) = &mut self.wedges else { return Ok(()) };
        let number = element.properties.iter().position(|p| p.name == NUMBER).map_or(0.0, |rank| self.record[rank]);
        // One that is no rank is that of no texture.
        let texture = if (0.0..=f64::from(MOST_TEXTURES)).contains(&number) { number as u32 } else { MOST_TEXTURES };
        let bytes = (wedges.len() as u64 + 3 * (self.triangles.len() - before) as u64) * BYTES_PER_CORNER;
        input::hold("the corners", bytes, reading.params)?;
        let of_fan = |k: usize| if form == Form::Polygons { [0, k + 1, k + 2] } else { [usize::MAX; 3] };
        for (k, t) in self.triangles[before..].iter_mut().enumerate() {
            for (v, corner) in t.iter_mut().zip(of_fan(k)) {
                let at = |axis: usize| corner.checked_mul(2).and_then(|first| self.places.get(first + axis).copied());
                let place = [0, 1].map(|axis| at(axis).unwrap_or(f32::NAN));
                *v = wedges.corner(*v, place, texture, reading)?;
            }
        }
        Ok(())
    }

    /// So many triangles without numbers.
    fn fill_extras(&mut self, triangles: usize) {
        if self.extras.reads() {
            (0..triangles).for_each(|_| self.extras.push(|_| f64::NAN));
        }
    }

    /// A vertex number of a face or strip.
    fn corner<S: Source>(&self, source: &S, index: f64, what: &str, record: u64) -> Result<u32, ReadError> {
        if (0.0..self.vertices as f64).contains(&index) {
            return Ok(index as u32);
        }
        let expected = format!("a vertex of {what} {record} from 0 to {}", self.vertices.saturating_sub(1));
        Err(ReadError::input(source.place(), expected, source.shown(index), "the face list is damaged"))
    }

    /// One polygon → a fan around its first vertex, for now.
    fn polygon<S: Source>(
        &mut self,
        source: &mut S,
        face: u64,
        count: Type,
        item: Type,
        reading: &mut Reading<'_>,
    ) -> Result<(), ReadError> {
        let corners = list_length(source, count, item)?;
        if corners < 3 {
            let place = source.place();
            reading.mend(Fix::TooFewCorners, place, Some(face), || {
                let expected = format!("3 or more corners of face {face}");
                ReadError::input(place, expected, corners.to_string(), "remove degenerate faces")
            })?;
            for _ in 0..corners {
                let index = source.number(item)?;
                self.corner(source, index, "face", face)?;
            }
            return Ok(());
        }
        let count = corners as usize - 2;
        self.room(corners - 2, reading)?;
        if count > 1 {
            input::reserve(&mut self.polygons, 1)?;
            self.polygons.push(Polygon { face, first: self.triangles.len(), count });
        }
        let mut fan = [0; 2];
        for i in 0..corners {
            look(i + 1, reading)?;
            let index = source.number(item)?;
            let next = self.corner(source, index, "face", face)?;
            if i < 2 {
                fan[i as usize] = next;
            } else {
                self.triangles.push([fan[0], fan[1], next]);
                fan[1] = next;
            }
        }
        Ok(())
    }

    /// One record of strips. Triangles with a corner twice join strips and are nothing by themselves.
    fn strip<S: Source>(
        &mut self,
        source: &mut S,
        record: u64,
        count: Type,
        item: Type,
        reading: &Reading<'_>,
    ) -> Result<(), ReadError> {
        let length = list_length(source, count, item)?;
        self.room(length.saturating_sub(2), reading)?;
        let mut last = [0; 2];
        let mut known = 0u64;
        for i in 0..length {
            look(i + 1, reading)?;
            let index = source.number(item)?;
            if RESTART.contains(&index) {
                known = 0;
                continue;
            }
            let next = self.corner(source, index, "strip", record)?;
            let [a, b] = last;
            if known >= 2 && a != b && b != next && a != next {
                self.triangles.push(if known.is_multiple_of(2) { [a, b, next] } else { [b, a, next] });
            }
            last = [b, next];
            known += 1;
        }
        Ok(())
    }

    /// Room for `more` triangles, within the limits.
    fn room(&mut self, more: u64, reading: &Reading<'_>) -> Result<(), ReadError> {
        let total = (self.triangles.len() as u64).saturating_add(more);
        let each = 12 + self.extras.bytes_per_point();
        let bytes = total.saturating_mul(each).saturating_add((self.polygons.len() * size_of::<Polygon>()) as u64);
        self.held.hold(bytes, reading.params)?;
        input::reserve(&mut self.triangles, more as usize)
    }

    /// With the vertices the mesh, and its corners where textures ask for them.
    pub(super) fn into_mesh(
        self,
        columns: Columns,
        reading: &mut Reading<'_>,
    ) -> Result<(Mesh, Option<Wedges>), ReadError> {
        let mut mesh = columns.into_mesh(self.triangles, &mut reading.notes)?;
        let triangles = mesh.triangles.len();
        let association = Association::Triangle;
        mesh.columns.extend(self.extras.finish(&mut reading.notes).into_iter().map(|Column { name, mut values }| {
            // Nor have strips behind faces.
            values.resize(triangles, f64::NAN);
            MeshColumn { name, association, values }
        }));
        if let Some(wedges) = &self.wedges {
            mesh = wedges.expanded(mesh);
        }
        polygon::triangulate(&mut mesh, &self.polygons, reading, |_| at_line(self.line))?;
        Ok((mesh, self.wedges))
    }
}
