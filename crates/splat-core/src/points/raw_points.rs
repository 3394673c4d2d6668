//! Points as a scanner or a file gives them: no radius, perhaps no normal.

use crate::points::attributes::attribute;
use crate::{DAabb, Error, Gaussians, Mesh, ReadySplats, SplatKind, vertex_normals};
use glam::{DVec3, Vec3};

/// Raw points as columns; all but the positions may be empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RawPoints {
    /// Position that every point is relative to, units of the file.
    pub origin: DVec3,
    /// Positions.
    pub position: Vec<Vec3>,
    /// Unit normals, zero for none.
    pub normal: Vec<Vec3>,
    /// Linear Rec.709 colours.
    pub color: Vec<[f32; 3]>,
    /// Physical values (intensity, temperature …), any finite number.
    pub value: Vec<f32>,
    /// Whether the values are how much light came back, as LAS, LAZ, E57 and PCD have it: [`RawPoints::value_name`].
    pub is_intensity: bool,
    /// Opacities of one crossing of the surface that the points are samples of, in \[0, 1\]; 1 is opaque.
    pub opacity: Vec<f32>,
    /// Classes as the file numbers them (LAS: 2 is ground, 5 high vegetation …).
    pub classification: Vec<u8>,
    /// Further columns of the file, those that were asked for by name (`read::ReadParams::columns`).
    pub columns: Vec<Column>,
    /// The matter that each point stands for, where that was found already: see `convert::with_cells`.
    pub cells: Vec<PointCell>,
    /// The integers that the positions were made from, where the file stores integers.
    pub lattice: Option<PointLattice>,
    /// Points of the file that were left out because a coordinate was not finite.
    pub dropped: u64,
    /// The Gaussian that each point is the centre of, units and axes of the file; empty for points that are none.
    pub gaussians: Gaussians,
    /// The splat that each point is already; empty for points that are still to become some.
    pub ready: ReadySplats,
}

/// A column of a file that has no meaning of its own here. A number that is none, or is not finite, is a gap.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Column {
    /// Its name in the file.
    pub name: String,
    /// One number a point, in f64: times of a day have more digits than f32.
    pub values: Vec<f64>,
}

/// What a point stands for if all that is given is matter, cubed and plain units of the file.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointCell {
    /// Its share of the volume of its place; infinite where there is no other place.
    pub volume: f64,
    /// Edge of the cube that all points of its place stand for.
    pub spacing: f64,
}

/// Names that people have for columns, with those of files and of [`RawPoints`].
const ALIASES: [(&str, &str); 3] = [("intensity", "value"), ("return", "return_number"), ("class", "classification")];

/// Coordinates as integers on a lattice: exact, whatever the offset. Position i is `offset + scale · steps[i]`.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLattice {
    /// Position of the integer coordinates (0, 0, 0), units of the file.
    pub offset: DVec3,
    /// Length of one step along each axis, > 0.
    pub scale: DVec3,
    /// Integer coordinates, one triple a point.
    pub steps: Vec<[i32; 3]>,
}

impl RawPoints {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// The vertices of a mesh that triangles use, with their normals: those of the file, or smooth ones.
    ///
    /// # Panics
    /// If an index is out of range, which [`Mesh::validate`] tells.
    pub fn of_vertices(mesh: &Mesh) -> Self {
        let normal = if mesh.normal.is_empty() { vertex_normals(mesh) } else { mesh.normal.clone() };
        // A vertex without a triangle has no normal, and says nothing of the surface.
        let known: Vec<usize> = (0..normal.len()).filter(|i| normal[*i] != Vec3::ZERO).collect();
        Self {
            origin: mesh.origin,
            position: known.iter().map(|i| mesh.position[*i]).collect(),
            normal: known.iter().map(|i| normal[*i]).collect(),
            ..Self::default()
        }
    }

    /// Bounds of what a camera that finds its place looks at, where that is not all points. Of Gaussians two deviations around each, without
    /// the farthest hundredth to every side, which in captured scenes lies anywhere; of splats of several objects those that stand on a ground.
    pub fn bulk(&self) -> Option<DAabb> {
        self.bulk_of_gaussians().or_else(|| self.ready.on_ground())
    }

    fn bulk_of_gaussians(&self) -> Option<DAabb> {
        /// Gaussians of which one may lie outside, to every side.
        const ONE_OF: usize = 100;
        let g = &self.gaussians;
        let seen: Vec<usize> = (0..g.len()).filter(|i| g.opacity[*i] >= Gaussians::LEAST_OPACITY).collect();
        let end = |axis: usize, sign: f32| {
            let reach = |i: usize| 2.0 * Vec3::from_array(g.axes[i].map(|a| a[axis])).length();
            let mut ends: Vec<f32> = seen.iter().map(|i| sign * self.position[*i][axis] + reach(*i)).collect();
            let far = ends.len() - 1 - ends.len() / ONE_OF;
            f64::from(sign * *ends.select_nth_unstable_by(far, f32::total_cmp).1)
        };
        let ends = |sign: f32| self.origin + DVec3::new(end(0, sign), end(1, sign), end(2, sign));
        (!seen.is_empty()).then(|| DAabb::new(ends(-1.0), ends(1.0)))
    }

    /// The numbers of one of [`RawPoints::columns`].
    pub fn own_column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| &c.values[..])
    }

    /// The numbers of a column by its name, the one of the file before the ones that all points have:
    ///
    /// | name | numbers |
    /// |---|---|
    /// | that of one of [`RawPoints::columns`] | as the file has them |
    /// | `value` or `intensity` | [`RawPoints::value`] |
    /// | `classification` or `class` | [`RawPoints::classification`] |
    /// | `return` | the column `return_number` |
    /// | `opacity` | [`RawPoints::opacity`] |
    /// | `x`, `y`, `z` | coordinates in the unit of the file, as exact as it has them |
    /// | `height` | the coordinate along `up` |
    /// | that of an attribute of [`RawPoints::ready`] | as files of splats name it |
    ///
    /// `None` where the points have no such column.
    pub fn column(&self, name: &str, up: DVec3) -> Option<Vec<f64>> {
        let along = |axis: DVec3| Some((0..self.len()).map(|i| self.exact_position(i).dot(axis)).collect());
        let own_column = |name: &str| self.own_column(name).map(<[f64]>::to_vec);
        let some =
            |column: &[f32]| (!column.is_empty()).then(|| column.iter().map(|v| f64::from(*v)).collect::<Vec<f64>>());
        if let Some(values) =
            own_column(name).or_else(|| own_column(unaliased(name))).or_else(|| self.ready.column(unaliased(name)))
        {
            return Some(values);
        }
        match unaliased(name) {
            "value" => some(&self.value),
            "opacity" => some(&self.opacity),
            "classification" if !self.classification.is_empty() => {
                Some(self.classification.iter().map(|c| f64::from(*c)).collect())
            }
            "x" => along(DVec3::X),
            "y" => along(DVec3::Y),
            "z" => along(DVec3::Z),
            "height" => along(up),
            _ => None,
        }
    }

    /// The name of its values in messages and legends: `intensity` or `value`. [`RawPoints::column`] takes both.
    pub fn value_name(&self) -> &'static str {
        if self.is_intensity { "intensity" } else { "value" }
    }

    /// Which of the columns that are read in any case nobody asks for: `asked` are names as [`RawPoints::column`] takes them.
    pub fn not_asked_for<'a>(&'a self, asked: &'a [String]) -> impl Iterator<Item = &'static str> + 'a {
        let columns = [(self.value_name(), self.value.is_empty()), ("classification", self.classification.is_empty())];
        let is_asked = |name: &str| asked.iter().any(|asked| unaliased(asked) == unaliased(name));
        columns.into_iter().filter(move |(name, is_empty)| !is_empty && !is_asked(name)).map(|(name, _)| name)
    }

    /// What a field through the points makes no use of in their columns, one sentence without a full stop each.
    pub fn unused_by_fields(&self) -> Vec<String> {
        let opacity = "`level_set` does not use opacities: it has that of its object".to_owned();
        let attribute = self.columns.iter().find(|c| attribute(&c.name, true).is_some());
        let attribute =
            attribute.map(|c| format!("`level_set` does not use `{}`: its points are places alone", c.name));
        (!self.opacity.is_empty()).then_some(opacity).into_iter().chain(attribute).collect()
    }

    /// Names that [`RawPoints::column`] knows for these points.
    pub fn column_names(&self) -> impl Iterator<Item = &str> {
        let some = [
            (self.value_name(), !self.value.is_empty()),
            ("classification", !self.classification.is_empty()),
            ("opacity", !self.opacity.is_empty()),
        ];
        let attributes = some.into_iter().filter(|(_, is_there)| *is_there).map(|(name, _)| name);
        let columns = self.columns.iter().map(|c| c.name.as_str());
        attributes.chain(["x", "y", "z", "height"]).chain(columns).chain(self.ready.columns().map(|column| column.name))
    }

    /// Bytes held by the columns, all of them counted: position, normal, colour, value, opacity, class, integers and further ones; and
    /// Gaussians.
    pub fn bytes(&self) -> u64 {
        let cells = (self.cells.len() * size_of::<PointCell>()) as u64;
        let columns = (64 + 8 * self.columns.len() as u64) * self.len() as u64;
        columns + cells + self.gaussians.bytes() + self.ready.cloud.bytes()
    }

    /// The least opacity of a point; 1 where the file has none, and without points. That of a Gaussian is below 1; of splats it is 0 if one of
    /// them is not opaque.
    pub fn least_opacity(&self) -> f32 {
        if self.ready.cloud.kind.iter().any(|kind| *kind != SplatKind::Opaque) {
            return 0.0;
        }
        let most = if self.gaussians.is_empty() { 1.0 } else { Gaussians::MOST_OPACITY };
        self.opacity.iter().chain(&self.gaussians.opacity).copied().fold(most, f32::min)
    }

    /// Position of point `i` in f64: from the file's integers where it has them, else from the f32 offset.
    ///
    /// # Panics
    /// If `i` is out of range.
    pub fn exact_position(&self, i: usize) -> DVec3 {
        match &self.lattice {
            Some(l) => l.offset + l.scale * DVec3::from_array(l.steps[i].map(f64::from)),
            None => self.origin + self.position[i].as_dvec3(),
        }
    }

    /// Checks column lengths and finite numbers.
    ///
    /// # Errors
    /// [`Error::ColumnLength`] or [`Error::Invalid`] for the first that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        let expected = self.len();
        let columns = [
            ("normal", self.normal.len()),
            ("color", self.color.len()),
            ("value", self.value.len()),
            ("opacity", self.opacity.len()),
            ("classification", self.classification.len()),
            ("cells", self.cells.len()),
            ("lattice", self.lattice.as_ref().map_or(0, |l| l.steps.len())),
            ("gaussians", self.gaussians.len()),
            ("splats", self.ready.cloud.len()),
        ];
        for (attribute, found) in columns.into_iter().chain(self.columns.iter().map(|c| ("columns", c.values.len()))) {
            if found != 0 && found != expected {
                return Err(Error::ColumnLength { attribute, found, expected });
            }
        }
        if !self.origin.is_finite() {
            return Err(Error::invalid("points", 0, "origin", self.origin, "finite numbers"));
        }
        if let Some(i) = self.position.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid("point", i, "position", self.position[i], "finite numbers"));
        }
        if let Some(i) = self.normal.iter().position(|n| !n.is_finite()) {
            return Err(Error::invalid("point", i, "normal", self.normal[i], "finite numbers"));
        }
        if let Some(i) = self.color.iter().position(|c| !c.iter().all(|v| v.is_finite() && *v >= 0.0)) {
            return Err(Error::invalid("point", i, "color", self.color[i], "three finite numbers ≥ 0"));
        }
        if let Some(i) = self.value.iter().position(|v| !v.is_finite()) {
            return Err(Error::invalid("point", i, "value", self.value[i], "a finite number"));
        }
        if let Some(i) = self.opacity.iter().position(|a| !(0.0..=1.0).contains(a)) {
            return Err(Error::invalid("point", i, "opacity", self.opacity[i], "a number in [0, 1]"));
        }
        self.gaussians.validate()?;
        self.ready.cloud.validate()
    }
}

/// The name that files, or [`RawPoints`], have for what people call otherwise.
pub fn unaliased(name: &str) -> &str {
    ALIASES.iter().find(|(alias, _)| *alias == name).map_or(name, |(_, known)| known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_the_file_comes_before_the_one_that_all_points_have() {
        let column = |name: &str, values: [f64; 2]| Column { name: name.to_owned(), values: values.to_vec() };
        let mut points = RawPoints {
            origin: DVec3::new(1e7, 0.0, 5.0),
            position: vec![Vec3::ZERO, Vec3::new(0.25, 1.0, 2.0)],
            value: vec![7.0, 8.0],
            classification: vec![2, 6],
            columns: vec![column("return_number", [1.0, 3.0])],
            ..RawPoints::default()
        };
        let numbers = |points: &RawPoints, name: &str| points.column(name, DVec3::Z);
        assert_eq!(numbers(&points, "intensity"), Some(vec![7.0, 8.0]));
        assert_eq!(numbers(&points, "class"), Some(vec![2.0, 6.0]));
        assert_eq!(numbers(&points, "return"), Some(vec![1.0, 3.0]));
        assert_eq!(
            [numbers(&points, "x"), numbers(&points, "height")],
            [Some(vec![1e7, 1e7 + 0.25]), Some(vec![5.0, 7.0])]
        );
        assert_eq!([numbers(&points, "opacity"), numbers(&points, "gps_time")], [None, None]);
        points.columns.push(column("height", [0.5, 0.75]));
        assert_eq!(numbers(&points, "height"), Some(vec![0.5, 0.75]));
    }
}
