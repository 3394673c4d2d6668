//! The vertex properties that are kept, as columns, and what they become.

use super::header::{Element, Property, Shape, Type, at_line};
use crate::error::{Place, ReadError};
use crate::raw_points::RawPoints;
use crate::read::{color::linear_from_srgb, input, origin};
use splat_core::Mesh;
use splat_core::glam::{DVec3, Vec3};

/// Names of the kept properties by role: x y z, normal, colour, value. The first name of a role that is there wins.
const ROLES: [&[&str]; 10] = [
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
];
const POSITION: usize = 0;
const NORMAL: usize = 3;
const COLOR: usize = 6;
const VALUE: usize = 9;

/// The kept columns; a column that the file lacks stays empty.
pub(super) struct Columns {
    /// Role and stored type of each property, `None` for those that are read over.
    kept: Vec<Option<(usize, Type)>>,
    data: [Vec<f64>; 10],
    drop_invalid: bool,
    count: u64,
    line: u64,
}

impl Columns {
    /// Decides which properties of `vertex` to keep.
    pub(super) fn new(vertex: &Element, drop_invalid: bool) -> Result<Self, ReadError> {
        let mut kept = vec![None; vertex.properties.len()];
        let mut found = [false; 10];
        for (role, names) in ROLES.iter().enumerate() {
            let of = |name: &&str| vertex.properties.iter().position(|p| p.name == name.as_bytes());
            let Some(index) = names.iter().find_map(of) else { continue };
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
        Ok(Self { kept, data: Default::default(), drop_invalid, count: vertex.count, line: vertex.line })
    }

    /// Bytes that a vertex takes while it is read and converted.
    pub(super) fn bytes_per_vertex(&self) -> u64 {
        self.kept.iter().flatten().count() as u64 * 12 + 24
    }

    pub(super) fn reserve(&mut self, vertices: usize) -> Result<(), ReadError> {
        for (role, _) in self.kept.iter().flatten() {
            input::reserve(&mut self.data[*role], vertices)?;
        }
        Ok(())
    }

    /// Takes the value of property `index`; `Err` is what was expected, and a hint.
    pub(super) fn push(&mut self, index: usize, value: f64) -> Result<(), (String, &'static str)> {
        let Some((role, kind)) = self.kept[index] else { return Ok(()) };
        let value = match role {
            COLOR..VALUE => {
                let top = match kind {
                    Type::F32 | Type::F64 => 1.0,
                    Type::U16 => 65_535.0,
                    _ => 255.0,
                };
                if !(0.0..=top).contains(&value) {
                    return Err((format!("a colour from 0 to {top}"), "colours are 0 to 255, or 0.0 to 1.0 as float"));
                }
                // Stored floats are linear already; stored integers are sRGB.
                if kind.integer_range().is_some() { f64::from(linear_from_srgb(value / top)) } else { value }
            }
            _ if !value.is_finite() && !self.drop_invalid => {
                return Err(("a finite number".to_owned(), "remove the record, or ask to drop invalid points"));
            }
            _ => value,
        };
        self.data[role].push(value);
        Ok(())
    }

    /// The columns as a mesh. Normals of which one is zero are left out: they are to be computed anew.
    pub(super) fn into_mesh(self, triangles: Vec<[u32; 3]>) -> Result<Mesh, ReadError> {
        let points = self.into_points()?;
        let normal = if points.normal.contains(&Vec3::ZERO) { Vec::new() } else { points.normal };
        Ok(Mesh { origin: points.origin, position: points.position, normal, color: points.color, triangles })
    }

    /// The columns as points.
    pub(super) fn into_points(mut self) -> Result<RawPoints, ReadError> {
        let dropped = self.drop_records();
        let triple = |first: usize, i: usize| [0, 1, 2].map(|c| self.data[first + c][i]);
        let positions: Vec<DVec3> =
            (0..self.data[POSITION].len()).map(|i| DVec3::from_array(triple(POSITION, i))).collect();
        let (origin, position) = origin::split(&positions).map_err(|i| {
            ReadError::input(
                at_line(self.line),
                "coordinates that fit 32-bit floats once the middle is subtracted",
                format!("{} at vertex {i}", positions[i]),
                "scale the data, or remove outliers",
            )
        })?;
        let normal = (0..self.data[NORMAL].len()).map(|i| unit(DVec3::from_array(triple(NORMAL, i)))).collect();
        let color = (0..self.data[COLOR].len()).map(|i| triple(COLOR, i).map(|c| c as f32)).collect();
        let value: Vec<f32> = self.data[VALUE].iter().map(|v| *v as f32).collect();
        if let Some(i) = value.iter().position(|v| !v.is_finite()) {
            let found = format!("{} at vertex {i}", self.data[VALUE][i]);
            return Err(ReadError::input(Place::File, "a value that fits a 32-bit float", found, "scale the values"));
        }
        Ok(RawPoints { origin, position, normal, color, value, dropped, ..RawPoints::default() })
    }

    /// Removes records with a number that is not finite; there are none unless they are to be dropped.
    fn drop_records(&mut self) -> u64 {
        if !self.drop_invalid {
            return 0;
        }
        let columns = self.data.iter().filter(|c| !c.is_empty());
        let valid: Vec<bool> = (0..self.count as usize).map(|i| columns.clone().all(|c| c[i].is_finite())).collect();
        for column in self.data.iter_mut().filter(|c| !c.is_empty()) {
            let mut flags = valid.iter();
            column.retain(|_| flags.next().copied().unwrap_or(false));
        }
        valid.iter().filter(|v| !**v).count() as u64
    }
}

/// `n` with length 1; zero stays zero. Scaled first, so that neither 1e-200 nor 1e200 is lost in the squares.
fn unit(n: DVec3) -> Vec3 {
    let largest = n.abs().max_element();
    if largest > 0.0 { (n / largest).normalize().as_vec3() } else { Vec3::ZERO }
}
