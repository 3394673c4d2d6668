//! The vertex properties that are kept, as columns, and what they become.

use super::header::{Element, Property, Shape, Type, at_line};
use crate::error::ReadError;
use crate::meshes::opacity;
use crate::points::direction::unit;
use crate::points::extras::{Extras, UNFIT_HINT};
use crate::points::origin;
use crate::stream::input;
use crate::{Notes, ReadParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::srgb::linear_from_srgb;
use splat_core::{Association, Column, Mesh, MeshColumn, RawPoints};

/// Names of the kept properties by role: x y z, normal, colour, value, opacity. The first name of a role that is there wins.
const ROLES: [&[&str]; 11] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
    &["value", "intensity", "scalar_Intensity", "scalar", "quality"],
    &["opacity", "alpha"],
];
const POSITION: usize = 0;
const NORMAL: usize = 3;
const COLOR: usize = 6;
const VALUE: usize = 9;
const OPACITY: usize = 10;

/// The kept columns; a column that the file lacks stays empty.
pub(super) struct Columns {
    /// Role and stored type of each property, `None` for those that are read over.
    kept: Vec<Option<(usize, Type)>>,
    /// Properties beside them that are asked for by name, and their numbers of the record.
    extras: Extras,
    further: Vec<f64>,
    /// The last property that is kept: with it a record is complete.
    last: usize,
    /// Whether normals, colours, values and opacities are kept.
    has: [bool; 4],
    /// The kept numbers of the record, by role; 0 for the others.
    record: [f64; 11],
    positions: Vec<DVec3>,
    points: RawPoints,
    /// Whether points that are not finite are left out; `None` for the corners of a mesh, which cannot be.
    drop_invalid: Option<bool>,
    line: u64,
}

impl Columns {
    /// Decides which properties of `vertex` to keep, for the corners of a `mesh` or for points.
    pub(super) fn new(vertex: &Element, mesh: bool, params: &ReadParams) -> Result<Self, ReadError> {
        let mut kept = vec![None; vertex.properties.len()];
        let mut found = [false; 11];
        // A mesh has no values: they are numbers as others.
        for (role, names) in ROLES.iter().enumerate().filter(|(role, _)| !(mesh && *role == VALUE)) {
            let property_index = |name: &&str| vertex.properties.iter().position(|p| p.name == name.as_bytes());
            let Some(index) = names.iter().find_map(property_index) else { continue };
            match vertex.properties[index] {
                Property { shape: Shape::Scalar(kind), .. } => kept[index] = Some((role, kind)),
                Property { line, .. } if role < NORMAL => {
                    let hint = "coordinates are scalars";
                    return Err(ReadError::input(at_line(line), "one number for each coordinate", "a list", hint));
                }
                _ => continue,
            }
            found[role] = true;
        }
        if let Some(missing) = (0..NORMAL).find(|&r| !found[r]) {
            let expected = format!("a property '{}' of 'vertex'", ROLES[missing][0]);
            return Err(ReadError::input(at_line(vertex.line), expected, "none", "every vertex needs x, y and z"));
        }
        // A normal or colour with a missing component is none.
        let whole = |role: usize| match role {
            NORMAL..COLOR => found[NORMAL..COLOR].iter().all(|f| *f),
            COLOR..VALUE => found[COLOR..VALUE].iter().all(|f| *f),
            _ => true,
        };
        for slot in &mut kept {
            *slot = slot.filter(|(role, _)| whole(*role));
        }
        let scalars = vertex.properties.iter().enumerate().filter(|(_, p)| matches!(p.shape, Shape::Scalar(_)));
        let others = scalars.map(|(i, p)| (i, p.name.as_slice(), kept[i].is_some()));
        let extras =
            if mesh { Extras::of_mesh(others, Association::Vertex, params) } else { Extras::new(others, params) };
        let of_roles = kept.iter().rposition(Option::is_some).unwrap_or(0);
        let last = extras.read().max().unwrap_or(0).max(of_roles);
        let further = vec![0.0; if extras.read().next().is_some() { kept.len() } else { 0 }];
        let has = [NORMAL, COLOR, VALUE, OPACITY].map(|role| kept.iter().flatten().any(|(r, _)| *r == role));
        let is_intensity = kept.iter().zip(&vertex.properties).any(|(kept, property)| {
            let name = property.name.to_ascii_lowercase();
            kept.is_some_and(|(role, _)| role == VALUE) && name.ends_with(b"intensity")
        });
        let points = RawPoints { is_intensity, ..RawPoints::default() };
        let drop_invalid = (!mesh).then_some(params.drop_invalid);
        let positions = Vec::new();
        let record = [0.0; 11];
        Ok(Self { kept, extras, further, last, has, record, positions, points, drop_invalid, line: vertex.line })
    }

    /// Names of the properties of `vertex` that are read over; of a mesh those that cannot be asked for either.
    pub(super) fn unused<'a>(&'a self, vertex: &'a Element) -> impl Iterator<Item = &'a [u8]> {
        let is_mesh = self.drop_invalid.is_none();
        let unused = vertex.properties.iter().zip(&self.kept).filter(|(_, k)| k.is_none()).map(|(p, _)| p);
        unused.filter(move |p| !(is_mesh && matches!(p.shape, Shape::Scalar(_)))).map(|p| p.name.as_slice())
    }

    /// Bytes that a vertex takes while it is read and converted.
    pub(super) fn bytes_per_vertex(&self) -> u64 {
        let more = self.has.iter().zip([12, 12, 4, 4]).filter(|(has, _)| **has).map(|(_, bytes)| bytes);
        24 + 12 + self.extras.bytes_per_point() + more.sum::<u64>()
    }

    pub(super) fn reserve(&mut self, vertices: usize) -> Result<(), ReadError> {
        let [normals, colors, values, opacities] = self.has.map(|has| if has { vertices } else { 0 });
        self.extras.reserve(vertices)?;
        input::reserve(&mut self.positions, vertices)?;
        input::reserve(&mut self.points.normal, normals)?;
        input::reserve(&mut self.points.color, colors)?;
        input::reserve(&mut self.points.value, values)?;
        input::reserve(&mut self.points.opacity, opacities)
    }

    /// Takes the value of property `index`; `Err` is what was expected, and a hint.
    pub(super) fn push(&mut self, index: usize, value: f64) -> Result<(), (String, &'static str)> {
        if let Some(further) = self.further.get_mut(index) {
            *further = value;
            if let Some(expected) = self.extras.unfit(index, value) {
                return Err((expected.to_owned(), UNFIT_HINT));
            }
        }
        if let Some((role, kind)) = self.kept[index] {
            self.record[role] = self.checked(role, kind, value)?;
        }
        if index == self.last { self.end_record() } else { Ok(()) }
    }

    /// The number of a role, colours and opacities as shares.
    fn checked(&self, role: usize, kind: Type, value: f64) -> Result<f64, (String, &'static str)> {
        Ok(match role {
            COLOR..VALUE => {
                let share = share(value, kind, "a colour", "colours are 0 to 255, or 0.0 to 1.0 as float")?;
                // Stored floats are linear already; stored integers are sRGB.
                if kind.integer_range().is_some() { f64::from(linear_from_srgb(share)) } else { share }
            }
            _ if role == OPACITY => share(
                value,
                kind,
                "an opacity",
                "opacities are 0 to 255, or 0.0 to 1.0 as float; or rename the column",
            )?,
            _ if !value.is_finite() && self.drop_invalid != Some(true) => {
                let hint = match self.drop_invalid {
                    None => "remove the vertex and its faces, or mend its number",
                    Some(_) => "remove the record, or leave such points out with --drop-invalid",
                };
                return Err(("a finite number".to_owned(), hint));
            }
            _ => value,
        })
    }

    /// Takes the record, or counts it as dropped if one of its numbers is not finite.
    fn end_record(&mut self) -> Result<(), (String, &'static str)> {
        let vector = |first: usize| DVec3::from_slice(&self.record[first..]);
        if !self.record.iter().all(|v| v.is_finite()) {
            self.points.dropped += 1;
            return Ok(());
        }
        self.positions.push(vector(POSITION));
        let [has_normal, has_color, has_value, has_opacity] = self.has;
        if has_normal {
            self.points.normal.push(unit(vector(NORMAL)));
        }
        if has_color {
            self.points.color.push(vector(COLOR).as_vec3().to_array());
        }
        if has_value {
            let value = self.record[VALUE] as f32;
            if !value.is_finite() {
                return Err(("a value that fits a 32-bit float".to_owned(), "scale the values"));
            }
            self.points.value.push(value);
        }
        if has_opacity {
            self.points.opacity.push(self.record[OPACITY] as f32);
        }
        self.extras.push(|index| self.further[index]);
        Ok(())
    }

    /// The columns as a mesh. Normals of which one is zero are left out: they are to be computed anew.
    pub(super) fn into_mesh(self, triangles: Vec<[u32; 3]>, notes: &mut Notes) -> Result<Mesh, ReadError> {
        let points = self.into_points(notes)?;
        let normal = if points.normal.contains(&Vec3::ZERO) { Vec::new() } else { points.normal };
        let opacity = opacity::meant(points.opacity, notes);
        let RawPoints { origin, position, color, columns, .. } = points;
        let association = Association::Vertex;
        let columns = columns.into_iter().map(|Column { name, values }| MeshColumn { name, association, values });
        let columns = columns.collect();
        Ok(Mesh { origin, position, normal, color, opacity, triangles, columns })
    }

    /// The columns as points.
    pub(super) fn into_points(self, notes: &mut Notes) -> Result<RawPoints, ReadError> {
        let Self { positions, points, extras, line, .. } = self;
        let (origin, position) = origin::relative(&positions, at_line(line), |i| format!("vertex {i}"))?;
        Ok(RawPoints { origin, position, columns: extras.finish(notes), ..points })
    }
}

/// A stored colour or opacity over what 1 is stored as.
fn share(value: f64, kind: Type, what: &str, hint: &'static str) -> Result<f64, (String, &'static str)> {
    let top = match kind {
        Type::F32 | Type::F64 => 1.0,
        Type::U16 => 65_535.0,
        _ => 255.0,
    };
    if (0.0..=top).contains(&value) { Ok(value / top) } else { Err((format!("{what} from 0 to {top}"), hint)) }
}
