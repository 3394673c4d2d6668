//! Solids: the inside of a field, closed by walls, and combinations of several solids by set operations.

use crate::{CombinedField, GridField, Inside, SharedField};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Clip, DAabb, Error, Grid, Interpolation, ScalarField};
use std::sync::Arc;

/// Steps along a box around scattered points, one for each splat of the surface.
const LEVEL_SET_STEPS: f64 = 192.0;

/// The combination of several solids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Combination {
    /// The union of all solids.
    Union,
    /// The intersection of all solids.
    Intersection,
    /// The first solid without all others.
    Difference,
}

/// A solid: what lies inside of a field and within walls.
#[derive(Clone)]
pub struct Solid {
    /// Its field, negative inside.
    pub field: SharedField,
    /// Regions that it ends with.
    pub walls: Vec<Clip>,
    /// A box that holds it.
    pub bounds: DAabb,
    /// Distance of samples that shows its shape, > 0, in the unit of the box.
    pub step: f64,
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Solid").field("bounds", &self.bounds).field("step", &self.step).finish_non_exhaustive()
    }
}

impl Solid {
    /// One of several; a part that reaches its walls ends flat there. The combined solid has the least step of its parts and no walls. Its
    /// box is a step larger on each side than theirs, so that no face lies on the border.
    ///
    /// ```
    /// use field::{Combination, ExpressionField, Solid};
    /// use splat_core::{DAabb, ScalarField, glam::DVec3};
    /// use std::sync::Arc;
    /// let solid = |text: &str| {
    ///     let bounds = DAabb::around(DVec3::ZERO, DVec3::ONE);
    ///     Solid { field: Arc::new(ExpressionField::parse(text).unwrap()), walls: vec![], bounds, step: 0.1 }.closed()
    /// };
    /// // Half of a ball, and half of the box: an expression says nothing of where it ends.
    /// let dome = Solid::combined(Combination::Intersection, vec![solid("x^2 + y^2 + z^2 - 0.5"), solid("y")]).unwrap();
    /// assert!(dome.field.value(DVec3::Y * 0.1) > 0.0 && dome.field.value(DVec3::Y * -0.1) < 0.0);
    /// let half = Solid::combined(Combination::Union, vec![solid("y"), solid("y")]).unwrap();
    /// assert!(half.field.value(DVec3::Y * -0.9) < 0.0 && half.field.value(DVec3::Y * -1.1) > 0.0);
    /// ```
    ///
    /// # Errors
    /// [`Error::Invalid`] for fewer than two parts, and where the boxes of an intersection have no place in common.
    pub fn combined(combination: Combination, parts: Vec<Self>) -> Result<Self, Error> {
        if parts.len() < 2 {
            return Err(Error::invalid("combination", 0, "parts", parts.len(), "at least two"));
        }
        let step = parts.iter().map(|part| part.step).fold(f64::INFINITY, f64::min);
        let boxes = parts.iter().map(|part| part.bounds);
        let bounds = match combination {
            Combination::Union => boxes.fold(DAabb::EMPTY, DAabb::union),
            Combination::Intersection => {
                let everywhere = DAabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
                boxes.fold(everywhere, |a, b| DAabb::new(a.min.max(b.min), a.max.min(b.max)))
            }
            Combination::Difference => parts[0].bounds,
        };
        if bounds.is_empty() {
            return Err(Error::invalid("intersection", 0, "parts", bounds, "parts whose boxes have a place in common"));
        }
        let mut fields: Vec<SharedField> = parts.into_iter().map(Self::into_field).collect();
        let field = match combination {
            Combination::Union => CombinedField::union(fields)?,
            Combination::Intersection => CombinedField::intersection(fields)?,
            Combination::Difference => {
                let first = fields.remove(0);
                CombinedField::difference(first, Arc::new(CombinedField::union(fields)?))
            }
        };
        let bounds = DAabb::new(bounds.min - step, bounds.max + step);
        Ok(Self { field: Arc::new(field), walls: Vec::new(), bounds, step })
    }

    /// The solid inside of an isosurface of a volume, within the volume.
    ///
    /// # Errors
    /// As [`GridField::new`].
    pub fn of_volume(grid: Arc<Grid>, interpolation: Interpolation, level: f64, inside: Inside) -> Result<Self, Error> {
        let step = grid.shortest_step();
        let field = GridField::new(grid, interpolation, level, inside)?;
        let walls = field.walls();
        let bounds = field.bounds();
        Ok(Self { field: Arc::new(field), walls, bounds, step })
    }

    /// The solid inside of the surface through scattered points, within the box of their field.
    pub fn of_points(field: SharedField, bounds: DAabb) -> Self {
        let step = bounds.size().max_element() / LEVEL_SET_STEPS;
        Self { field, walls: Vec::new(), bounds, step }.closed()
    }

    /// The same with its box as walls.
    pub fn closed(self) -> Self {
        Self { walls: vec![Clip::Box(self.bounds)], ..self }
    }

    /// Its field, closed by its walls.
    fn into_field(self) -> SharedField {
        if self.walls.is_empty() {
            return self.field;
        }
        let unit = |(normal, offset): (DVec3, f64)| (normal / normal.length(), offset / normal.length());
        let sides = self.walls.iter().flat_map(Clip::half_spaces).map(unit).collect();
        let scale = libm::exp2(-libm::log2(slope(self.field.as_ref(), self.bounds)).round());
        Arc::new(ClosedField { field: self.field, scale, sides })
    }
}

/// Cells along the longest side of a box in which [`slope`] looks for a surface.
const LOOKS: f64 = 24.0;

/// How steep a field is where it is zero, the median of what a first look finds; 1 where that is nothing.
fn slope(field: &dyn ScalarField, bounds: DAabb) -> f64 {
    let side = bounds.size().max_element() / LOOKS;
    let [nx, ny, nz] = bounds.size().to_array().map(|length| (length / side).ceil().max(1.0) as usize + 1);
    let at = |i: usize, j: usize, k: usize| bounds.min + DVec3::new(i as f64, j as f64, k as f64) * side;
    let index = |i: usize, j: usize, k: usize| (k * ny + j) * nx + i;
    let places = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
    let values: Vec<f64> = places.clone().map(|[i, j, k]| field.value(at(i, j, k))).collect();
    let mut slopes: Vec<f64> = Vec::new();
    for [i, j, k] in places {
        let here = values[index(i, j, k)];
        let from = at(i, j, k);
        for [l, m, n] in [[i + 1, j, k], [i, j + 1, k], [i, j, k + 1]] {
            let there = if l < nx && m < ny && n < nz { values[index(l, m, n)] } else { here };
            if (here < 0.0) != (there < 0.0) {
                slopes.push(field.gradient(from.lerp(at(l, m, n), here / (here - there))).length());
            }
        }
    }
    slopes.retain(|slope| slope.is_finite() && *slope > 0.0);
    slopes.sort_unstable_by(f64::total_cmp);
    slopes.get(slopes.len() / 2).copied().unwrap_or(1.0)
}

/// A field within flat walls: the maximum of both, so that a solid that reaches a wall ends there, flat.
///
/// Values of a scan, formulas and distances from walls are of different scales. Which of several counts would be another far from where both
/// are zero, too near for Newton's method to end on the surface; so the field is scaled to be about a distance near it, by a power of two,
/// which loses no bit.
struct ClosedField {
    field: SharedField,
    scale: f64,
    /// Unit normals that lead out, and their products with the borders.
    sides: Vec<(DVec3, f64)>,
}

impl ClosedField {
    /// How far `p` lies beyond the farthest wall, negative within all, and the normal of that.
    fn beyond(&self, p: DVec3) -> (f64, DVec3) {
        let distances = self.sides.iter().map(|(normal, offset)| (normal.dot(p) - offset, *normal));
        distances.fold((f64::NEG_INFINITY, DVec3::ZERO), |most, side| if side.0 > most.0 { side } else { most })
    }

    /// Whether a wall counts at `p`, not the field. Where a field has no value outside, as a root has none, the wall does.
    fn is_wall(value: f64, beyond: f64) -> bool {
        beyond > value || (value.is_nan() && beyond > 0.0)
    }
}

impl ScalarField for ClosedField {
    fn value(&self, p: DVec3) -> f64 {
        let value = self.scale * self.field.value(p);
        let beyond = self.beyond(p).0;
        if Self::is_wall(value, beyond) { beyond } else { value }
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.value_gradient(p).1
    }

    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let (value, gradient) = self.field.value_gradient(p);
        let (beyond, normal) = self.beyond(p);
        let value = self.scale * value;
        if Self::is_wall(value, beyond) { (beyond, normal) } else { (value, self.scale * gradient) }
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let is_wall = Self::is_wall(self.scale * self.field.value(p), self.beyond(p).0);
        if is_wall { DMat3::ZERO } else { self.field.hessian(p) * self.scale }
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let (beyond, _) = self.beyond(p);
        let low = beyond - radius;
        let high = beyond + radius;
        if low > 0.0 {
            // Surely outside, whatever the field says.
            return Some((low, f64::INFINITY));
        }
        let scaled = |(least, most): (f64, f64)| ((self.scale * least).max(low), (self.scale * most).max(high));
        self.field.bound(p, radius).map(scaled)
    }

    fn steepest(&self, p: DVec3, radius: f64) -> Option<f64> {
        self.field.steepest(p, radius).map(|slope| (self.scale * slope).max(1.0))
    }

    /// All of its walls, and the field's own domain elsewhere.
    fn in_domain(&self, p: DVec3) -> bool {
        Self::is_wall(self.scale * self.field.value(p), self.beyond(p).0) || self.field.in_domain(p)
    }
}
