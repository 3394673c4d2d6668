//! Cells of VTK (`vtk`, `vti`): bodies become a volume of their field, faces a mesh, points alone a cloud.

mod kind;
mod lists;
mod outer;
mod parting;
mod polyhedron;
mod resample;
mod solid;
pub(crate) mod structured;

use super::selection::Selection;
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::meshes::fans::Fans;
use crate::meshes::opacity;
use crate::meshes::outwards::turn_outwards;
use crate::meshes::tubes::Tubes;
use crate::points::direction::unit;
use crate::points::origin;
use crate::reading::Reading;
use crate::stream::input;
pub(crate) use kind::POLYHEDRON;
use kind::{HIDDEN, Kind, Shape};
pub(crate) use lists::{CellSource, Lists};
use resample::{Body, Faces};
use splat_core::glam::{DVec3, Vec3};
use splat_core::srgb::linear_from_srgb;
use splat_core::text::counted;
use splat_core::{Association, Column, Mesh, MeshColumn, RawPoints, Reservation};
use std::ops::Deref;

const HINT: &str = "the file is damaged, or its header states other sizes";

/// Bytes of a vertex of a surface: its place, its normal and its colour.
const BYTES_PER_VERTEX: u64 = 3 * 12;

/// Numbers of VTK's kinds of cells that a surface has.
pub(crate) const VERTICES: u8 = 2;
pub(crate) const LINES: u8 = 4;
pub(crate) const STRIPS: u8 = 6;
pub(crate) const POLYGONS: u8 = 7;

/// The cells of a file.
pub(crate) struct Cells {
    pub(crate) points: Vec<DVec3>,
    /// Points of each cell.
    pub(crate) lists: Lists,
    /// What each cell is, as VTK numbers it.
    pub(crate) kinds: Vec<u8>,
    /// Where they are told of.
    pub(crate) place: Place,
}

/// The numbers that a volume shows.
pub(crate) enum Field {
    /// One a point.
    Points(Vec<f64>),
    /// One a cell.
    Cells(Vec<f64>),
    /// None: cells are full of 1.
    One,
}

impl Field {
    /// The value of a cell at one of its points.
    fn at(&self, cell: usize, corner: u32) -> f64 {
        match self {
            Self::Points(values) => values[corner as usize],
            Self::Cells(values) => values[cell],
            Self::One => 1.0,
        }
    }
}

/// What points and cells of a surface have beside their places; empty where the file has none.
#[derive(Default)]
pub(crate) struct PointColumns {
    pub(crate) normal: Vec<Vec3>,
    pub(crate) color: Vec<[f32; 3]>,
    pub(crate) opacity: Vec<f32>,
    /// Columns of points and of cells that are asked for.
    pub(crate) named: Vec<MeshColumn>,
}

/// Points out of their coordinates.
pub(crate) fn places(numbers: &[f64], place: Place, reading: &Reading<'_>) -> Result<Vec<DVec3>, ReadError> {
    input::hold("the points of a piece", size_of_val(numbers) as u64, reading.params)?;
    let points: Vec<DVec3> = numbers.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(*p)).collect();
    match points.iter().position(|p| !p.is_finite()) {
        None => Ok(points),
        Some(i) => Err(ReadError::input(place, "finite coordinates", format!("{} at point {i}", points[i]), HINT)),
    }
}

/// Kinds of cells out of their numbers.
pub(crate) fn kinds(numbers: &[f64], place: Place) -> Result<Vec<u8>, ReadError> {
    let kind = |(i, number): (usize, &f64)| {
        let fits = (0.0..255.0).contains(number) && number.fract() == 0.0;
        let found = || format!("{number} at cell {i}");
        if fits {
            Ok(*number as u8)
        } else {
            Err(ReadError::input(place, "types of cells from 0 to 254", found(), HINT))
        }
    };
    numbers.iter().enumerate().map(kind).collect()
}

/// Refuses an array that has not as many tuples as there are points or cells.
pub(crate) fn check_count(found: u64, count: usize, what: &str, place: Place) -> Result<(), ReadError> {
    if found == count as u64 {
        return Ok(());
    }
    Err(ReadError::input(
        place,
        format!("{}, one for each of the {what}", counted(count as u64, "value")),
        found.to_string(),
        HINT,
    ))
}

/// The field of an array of that name, of points or of cells: one number of each tuple.
pub(crate) fn field(
    numbers: &[f64],
    selection: &Selection,
    name: &str,
    of_points: bool,
    place: Place,
    reading: &mut Reading<'_>,
) -> Result<Field, ReadError> {
    let params = reading.params;
    let notes = &mut reading.notes;
    let tuples = numbers.chunks_exact(selection.numbers as usize);
    input::hold("the field", 8 * tuples.len() as u64, params)?;
    let values: Vec<f64> = tuples.map(|tuple| selection.value.evaluate(|i| tuple[i])).collect();
    if let Some(i) = values.iter().position(|v| (*v as f32).is_infinite()) {
        let found = format!("{} at value {i} of {name}", values[i]);
        let hint = "scale the values, or write NaN where there is none: it draws nothing";
        return Err(ReadError::input(place, "values that fit 32-bit floats", found, hint));
    }
    notes.remarks.push(format!("the field is {name}, of the {}", if of_points { "points" } else { "cells" }));
    Ok(if of_points { Field::Points(values) } else { Field::Cells(values) })
}

/// Unit normals out of three numbers each, zero for what is none.
pub(crate) fn normals(numbers: &[f64]) -> Vec<Vec3> {
    let normal = |n: &[f64; 3]| if n.iter().all(|c| c.is_finite()) { unit(DVec3::from_array(*n)) } else { Vec3::ZERO };
    numbers.as_chunks().0.iter().map(normal).collect()
}

/// Linear colours out of three or four numbers each, sRGB from 0 to `top`.
pub(crate) fn colors(numbers: &[f64], each: u64, top: f64) -> Vec<[f32; 3]> {
    let color = |c: &[f64]| std::array::from_fn(|i| linear_from_srgb((c[i] / top).clamp(0.0, 1.0)));
    numbers.chunks_exact(each as usize).map(color).collect()
}

/// Opacities out of colours of four numbers each, of which 1 is `top`; none out of colours of three.
pub(crate) fn opacities(numbers: &[f64], each: u64, top: f64) -> Vec<f32> {
    let fourth = numbers.chunks_exact(each as usize).filter_map(|c| c.get(3));
    fourth.map(|alpha| (alpha / top).clamp(0.0, 1.0) as f32).collect()
}

impl Cells {
    /// Cells of one kind behind the others.
    pub(crate) fn append(&mut self, lists: &Lists, kind: u8) {
        self.kinds.extend(std::iter::repeat_n(kind, lists.len()));
        self.lists.append(lists, 0);
    }

    /// The points and the cells of another piece of the same dataset behind these.
    pub(crate) fn join(&mut self, other: Self, reading: &Reading<'_>) -> Result<(), ReadError> {
        let points = (self.points.len() + other.points.len()) as u64;
        input::hold("the points of all pieces", points * size_of::<DVec3>() as u64, reading.params)?;
        let Some(first) = u32::try_from(points).ok().and(u32::try_from(self.points.len()).ok()) else {
            let expected = format!("at most {} points in all pieces", u32::MAX);
            return Err(ReadError::input(other.place, expected, points.to_string(), HINT));
        };
        let cells = (self.kinds.len() + other.kinds.len()) as u64;
        input::hold("the cells of all pieces", self.lists.bytes() + other.lists.bytes() + cells, reading.params)?;
        input::reserve(&mut self.points, other.points.len())?;
        self.points.extend(other.points);
        self.lists.append(&other.lists, first);
        self.kinds.extend(other.kinds);
        Ok(())
    }

    /// Whether some cell encloses a volume.
    pub(crate) fn has_bodies(&self) -> bool {
        let is_body = |kind: &Kind| matches!(kind.shape, Shape::Body(_) | Shape::Polyhedron);
        self.kinds.iter().any(|number| Kind::numbered(*number).is_some_and(is_body))
    }

    /// Leaves out the cells that VTK marks as copies of those of another piece or as not to be seen; `marks` has a number of each cell.
    pub(crate) fn hide(&mut self, marks: &[f64]) {
        /// Bits of a copy, of a cell that finer ones stand for, and of one that is not to be seen.
        const UNSEEN: u8 = 1 | 8 | 32;
        for (kind, mark) in self.kinds.iter_mut().zip(marks) {
            if (*mark as u8) & UNSEEN != 0 {
                *kind = HIDDEN;
            }
        }
    }

    /// Whether some cells are left out.
    pub(crate) fn has_hidden(&self) -> bool {
        self.kinds.contains(&HIDDEN)
    }

    /// Refuses cells that are not read, and those that have not as many points as their kind.
    pub(crate) fn check(&self) -> Result<(), ReadError> {
        if self.kinds.len() != self.lists.len() {
            let expected = format!("{} kinds of cells", self.lists.len());
            let found = self.kinds.len().to_string();
            return Err(ReadError::input(self.place, expected, found, HINT));
        }
        for (i, (number, corners)) in self.kinds.iter().zip(self.lists.iter()).enumerate() {
            let Some(kind) = Kind::of_cell(*number, corners.len()) else {
                let hint = "read are cells of straight edges, quadratic ones, Lagrange and Bézier cells by their corners, and polyhedra; \
                    ParaView's filter Tetrahedralize makes tetrahedra of others";
                let found = format!("{} (type {number}) at cell {i}", kind::unread(*number));
                return Err(ReadError::input(self.place, "cells of a kind that is read", found, hint));
            };
            if let Some(expected) = kind.refused(corners.len()) {
                let expected = format!("{expected} points of cell {i}, a {}", kind.name);
                return Err(ReadError::input(self.place, expected, corners.len().to_string(), HINT));
            }
            if matches!(kind.shape, Shape::Polyhedron) && self.lists.faces(i).is_none() {
                let expected = format!("the faces of cell {i}, a polyhedron");
                return Err(ReadError::input(self.place, expected, "none", HINT));
            }
        }
        Ok(())
    }

    /// Says which cells are left out, and which are drawn by their corners alone.
    fn remark_kinds(&self, reading: &mut Reading<'_>) {
        let hidden = self.kinds.iter().filter(|kind| **kind == HIDDEN).count();
        if hidden > 0 {
            let hidden = counted(hidden as u64, "cell");
            reading.notes.remark(format!("{hidden} that the file marks as copies or as hidden are left out"));
        }
        let is_cut = |(number, corners): &(&u8, &[u32])| {
            Kind::of_cell(**number, corners.len()).is_some_and(|kind| kind.is_cut(corners.len()))
        };
        let cut = self.kinds.iter().zip(self.lists.iter()).filter(is_cut).count();
        if cut > 0 {
            let cut = counted(cut as u64, "curved cell");
            reading.notes.remark(format!("{cut} drawn by the corners alone: points of higher order are not used"));
        }
    }

    /// What the cells are: a volume, a mesh or points.
    pub(crate) fn loaded(
        self,
        field: Field,
        columns: PointColumns,
        reading: &mut Reading<'_>,
    ) -> Result<Loaded, ReadError> {
        self.remark_kinds(reading);
        if self.has_bodies() && reading.params.surfaces {
            return self.surface(columns, reading).map(Loaded::Mesh);
        }
        if self.has_bodies() {
            let hidden = self.kinds.iter().filter(|kind| **kind == HIDDEN).count();
            let flat = self.kinds.len() - hidden - self.bodies().count();
            if flat > 0 {
                reading.notes.not_used([format!("{} without a volume", counted(flat as u64, "cell")).as_bytes()]);
            }
            if matches!(field, Field::One) {
                reading.notes.remarks.push("cells without a field of numbers: they are full of 1".to_owned());
            }
            let count = self.bodies().count() as u64;
            input::hold("the bodies", count * size_of::<Body<'_>>() as u64, reading.params)?;
            let mut bodies: Vec<Body<'_>> = self.bodies().collect();
            polyhedron::check(&self.points, &mut bodies, self.place, reading)?;
            return resample::grid(&self.points, &bodies, self.place, &field, reading).map(Loaded::Grid);
        }
        let PointColumns { normal, color, opacity, mut named } = columns;
        let (fans, lines, cell_of) = self.fans(&named, reading)?;
        input::hold("the vertices", self.points.len() as u64 * BYTES_PER_VERTEX, reading.params)?;
        let (origin, position) = origin::relative(&self.points, self.place, |i| format!("point {i}"))?;
        let tubes = if fans.is_none() { self.tubes(&position, reading)? } else { None };
        if lines > 0 && tubes.is_none() {
            reading.notes.not_used([counted(lines as u64, "line").as_bytes()]);
        }
        if let Some(tubes) = tubes {
            for column in &mut named {
                column.values = match column.association {
                    Association::Vertex => tubes.of_vertices(&column.values),
                    Association::Triangle => tubes.lines.iter().map(|line| column.values[*line as usize]).collect(),
                };
            }
            let mut vertices = Mesh { origin, color: tubes.of_vertices(&color), columns: named, ..Mesh::default() };
            opacity::give(&mut vertices, tubes.of_vertices(&opacity), &mut reading.notes);
            return Ok(Loaded::Mesh(tubes.into_mesh(vertices, reading)));
        }
        let Some(fans) = fans else {
            let opacity = opacity::meant(opacity, &mut reading.notes);
            named.retain(|column| column.association == Association::Vertex);
            let columns = named.into_iter().map(|MeshColumn { name, values, .. }| Column { name, values }).collect();
            let points = RawPoints { origin, position, normal, color, opacity, columns, ..RawPoints::default() };
            return Ok(Loaded::Points(points));
        };
        // Normals of which one is zero are left out: they are to be computed anew.
        let normal = if normal.contains(&Vec3::ZERO) { Vec::new() } else { normal };
        for column in named.iter_mut().filter(|column| column.association == Association::Triangle) {
            column.values = cell_of.iter().map(|cell| column.values[*cell as usize]).collect();
        }
        let mut vertices = Mesh { origin, position, normal, color, columns: named, ..Mesh::default() };
        opacity::give(&mut vertices, opacity, &mut reading.notes);
        fans.into_mesh(vertices, reading).map(Loaded::Mesh)
    }

    /// The faces around the bodies, and cells that are faces by themselves, with the points that they have.
    fn surface(self, columns: PointColumns, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
        let faces = outer::faces(&self, reading)?;
        let bodies = counted(self.bodies().count() as u64, "cell");
        let outer = counted(faces.len() as u64, "face");
        reading.notes.remark(format!(
            "{bodies} drawn as the {outer} around them; `volume` in the place of `mesh` draws what is inside"
        ));
        let PointColumns { color, opacity, mut named, .. } = columns;
        let mut fans = Fans::default();
        let mut cell_of = Vec::new();
        // Points within the bodies are no vertices.
        const NOT_USED: u32 = u32::MAX;
        let mut vertex_of = vec![NOT_USED; self.points.len()];
        let mut points_used: Vec<u32> = Vec::new();
        for (cell, corners) in faces.iter() {
            let mut vertices = Vec::with_capacity(corners.len());
            for corner in corners {
                let vertex = &mut vertex_of[*corner as usize];
                if *vertex == NOT_USED {
                    *vertex = points_used.len() as u32;
                    points_used.push(*corner);
                }
                vertices.push(*vertex);
            }
            fans.add(u64::from(cell), &vertices, self.place, reading)?;
            cell_of.resize(fans.len(), cell);
        }
        input::hold("the vertices", points_used.len() as u64 * BYTES_PER_VERTEX, reading.params)?;
        let of_vertices = |values: &[f64]| points_used.iter().map(|point| values[*point as usize]).collect();
        for column in &mut named {
            column.values = match column.association {
                Association::Vertex => of_vertices(&column.values),
                Association::Triangle => cell_of.iter().map(|cell| column.values[*cell as usize]).collect(),
            };
        }
        let places: Vec<DVec3> = points_used.iter().map(|point| self.points[*point as usize]).collect();
        let (origin, position) = origin::relative(&places, self.place, |i| format!("point {}", points_used[i]))?;
        let used = |point: &u32| *point as usize;
        let color = points_used.iter().filter_map(|point| color.get(used(point)).copied()).collect();
        let opacity = points_used.iter().filter_map(|point| opacity.get(used(point)).copied()).collect();
        let mut vertices = Mesh { origin, position, color, columns: named, ..Mesh::default() };
        opacity::give(&mut vertices, opacity, &mut reading.notes);
        let mut mesh = fans.into_mesh(vertices, reading)?;
        // Cells may be inside out: that is no fault of a surface.
        turn_outwards(&mut mesh);
        Ok(mesh)
    }

    /// The cells that enclose a volume, each with its rank among all cells.
    fn bodies(&self) -> impl Iterator<Item = Body<'_>> {
        self.kinds.iter().zip(self.lists.iter()).enumerate().filter_map(|(cell, (number, corners))| {
            let kind = Kind::of_cell(*number, corners.len())?;
            let faces = match kind.shape {
                Shape::Body(solid) => Faces::Of(solid),
                Shape::Polyhedron => Faces::Around(self.lists.faces(cell)?, None),
                _ => return None,
            };
            Some(Body { cell, corners: kind.drawn(corners), faces })
        })
    }

    /// Tubes around the lines, if there are some.
    fn tubes(&self, positions: &[Vec3], reading: &mut Reading<'_>) -> Result<Option<Tubes>, ReadError> {
        let lines = self.kinds.iter().zip(self.lists.iter()).enumerate().filter_map(|(i, (number, corners))| {
            let kind = Kind::of_cell(*number, corners.len())?;
            matches!(kind.shape, Shape::Line).then(|| (i as u32, kind.drawn(corners)))
        });
        Tubes::around(positions, lines, reading)
    }

    /// The faces, if there are some, and the number of lines; and where columns of cells need it the cell of each triangle.
    fn fans(
        &self,
        named: &[MeshColumn],
        reading: &mut Reading<'_>,
    ) -> Result<(Option<Fans>, usize, Vec<u32>), ReadError> {
        let has_columns = named.iter().any(|column| column.association == Association::Triangle);
        let mut cell_of = Vec::new();
        let mut fans = Fans::default();
        let mut faces = 0;
        let mut lines = 0;
        for (i, (number, corners)) in self.kinds.iter().zip(self.lists.iter()).enumerate() {
            let Some(kind) = Kind::of_cell(*number, corners.len()) else { continue };
            if matches!(kind.shape, Shape::Line) {
                lines += 1;
            }
            if !kind.each_face(corners, |face| fans.add(i as u64, face, self.place, reading))? {
                continue;
            }
            faces += 1;
            if has_columns {
                cell_of.resize(fans.len(), i as u32);
            }
        }
        Ok(((faces > 0).then_some(fans), lines, cell_of))
    }
}

/// Numbers of an array, with the memory that they take.
pub(crate) struct Numbers {
    pub(crate) all: Vec<f64>,
    held: Reservation,
}

impl Numbers {
    /// Room for so many numbers of the file, which is known to hold them.
    pub(crate) fn room(count: u64, reading: &Reading<'_>) -> Result<Self, ReadError> {
        let held = reading.params.memory.take(NUMBERS, 0)?;
        let mut numbers = Self { all: Vec::new(), held };
        numbers.reserve(count)?;
        Ok(numbers)
    }

    /// Room for so many more.
    pub(crate) fn reserve(&mut self, more: u64) -> Result<(), ReadError> {
        let count = (self.all.len() as u64).saturating_add(more);
        self.held.set(NUMBERS, count.saturating_mul(size_of::<f64>() as u64))?;
        input::reserve(&mut self.all, more as usize)
    }
}

impl Deref for Numbers {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.all
    }
}

/// The entry of [`Numbers`] in the account of memory.
const NUMBERS: &str = "the numbers of an array";

/// Memory of the cells of a piece: so many cells with so many points of cells.
pub(crate) fn hold_lists(cells: usize, corners: usize, reading: &Reading<'_>) -> Result<(), ReadError> {
    let bytes = cells * (size_of::<usize>() + size_of::<u8>()) + corners * size_of::<u32>();
    input::hold("the cells of a piece", bytes as u64, reading.params)
}

/// Memory of the faces of polyhedra, which so many numbers tell of.
pub(crate) fn hold_faces(numbers: usize, reading: &Reading<'_>) -> Result<(), ReadError> {
    let bytes = numbers * (size_of::<usize>() + size_of::<u32>());
    input::hold("the faces of polyhedra", bytes as u64, reading.params)
}
