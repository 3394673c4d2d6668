//! The fields of a point that are kept, as columns.

use super::header::{Field, Header, Kind};
use crate::error::{Place, ReadError};
use crate::points::direction::unit;
use crate::points::extras::{Extras, UNFIT_HINT};
use crate::points::origin;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::RawPoints;
use splat_core::glam::{DVec3, Vec3};
use splat_core::srgb::linear_from_srgb;

/// A stored number: its value, and its lower 32 bits as they are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) bits: u32,
}

/// What was expected of a field, and a hint.
type Unfit = (usize, String, &'static str);

/// Ranks of the kept fields, and the columns that they fill.
pub(super) struct Columns {
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    color: Option<usize>,
    value: Option<usize>,
    /// With what stands for 1.
    opacity: Option<(usize, f64)>,
    extras: Extras,
    positions: Vec<DVec3>,
    points: RawPoints,
    drop_invalid: bool,
    /// Whether a colour has an alpha that hides something.
    has_alpha: bool,
    /// Points that the file marks as none.
    without_place: u64,
    place: Place,
    /// Memory of points that come one by one.
    held: input::Growing,
}

impl Columns {
    /// Finds the fields that are kept, and names the others.
    pub(super) fn new(header: &Header, reading: &mut Reading<'_>) -> Result<Self, ReadError> {
        let fields = &header.fields;
        let field_index = |names: &[&str]| {
            let is = |f: &Field, name: &str| f.count == 1 && f.name.eq_ignore_ascii_case(name.as_bytes());
            names.iter().find_map(|name| fields.iter().position(|f| is(f, name)))
        };
        let needed = |name: &str| {
            let hint = "every point needs x, y and z";
            field_index(&[name]).ok_or_else(|| {
                ReadError::input(header.place_of_fields, format!("a field '{name}' of one number"), "none", hint)
            })
        };
        let position = [needed("x")?, needed("y")?, needed("z")?];
        // A normal with a missing component is none.
        let normal = [["normal_x", "nx"], ["normal_y", "ny"], ["normal_z", "nz"]].map(|names| field_index(&names));
        let normal = if let [Some(x), Some(y), Some(z)] = normal { Some([x, y, z]) } else { None };
        let color = field_index(&["rgb", "rgba"]).filter(|i| fields[*i].size == 4);
        let value = field_index(&["intensity", "value", "i"]);
        let is_intensity = field_index(&["intensity", "i"]).is_some_and(|rank| value == Some(rank));
        let top = |i: usize| match (fields[i].kind, fields[i].size) {
            (Kind::Float, _) => 1.0,
            (_, 2) => 65_535.0,
            _ => 255.0,
        };
        let opacity = field_index(&["opacity", "alpha"]).map(|i| (i, top(i)));
        let kept = position.into_iter().chain(normal.into_iter().flatten()).chain(color).chain(value);
        let kept: Vec<usize> = kept.chain(opacity.map(|o| o.0)).collect();
        let others = fields.iter().enumerate().filter(|(i, f)| !kept.contains(i) && f.name != b"_");
        reading.notes.not_used(others.map(|(_, f)| f.name.as_slice()));
        let numbers = fields.iter().enumerate().filter(|(_, f)| f.count == 1 && f.name != b"_");
        let spare = |i: usize| kept.contains(&i);
        let numbers = numbers.map(|(i, f)| (i, f.name.as_slice(), spare(i)));
        let extras = Extras::new(numbers, reading.params);
        if header.has_viewpoint {
            reading.notes.not_used([&b"VIEWPOINT"[..]]);
        }
        Ok(Self {
            position,
            normal,
            color,
            value,
            opacity,
            extras,
            positions: Vec::new(),
            points: RawPoints { is_intensity, ..RawPoints::default() },
            drop_invalid: reading.params.drop_invalid,
            has_alpha: false,
            without_place: 0,
            place: header.place_of_fields,
            held: input::Growing::new("the points"),
        })
    }

    fn bytes_per_point(&self) -> u64 {
        let has = [self.normal.is_some(), self.color.is_some(), self.value.is_some(), self.opacity.is_some()];
        36 + self.extras.bytes_per_point()
            + has.iter().zip([12, 12, 4, 4]).filter(|(has, _)| **has).map(|(_, bytes)| bytes).sum::<u64>()
    }

    /// Room for all points, which the file is known to hold.
    pub(super) fn reserve(&mut self, points: u64, reading: &Reading<'_>) -> Result<(), ReadError> {
        input::hold("the points", points.saturating_mul(self.bytes_per_point()), reading.params)?;
        let n = points as usize;
        let entries = |has: bool| if has { n } else { 0 };
        self.extras.reserve(n)?;
        input::reserve(&mut self.positions, n)?;
        input::reserve(&mut self.points.normal, entries(self.normal.is_some()))?;
        input::reserve(&mut self.points.color, entries(self.color.is_some()))?;
        input::reserve(&mut self.points.value, entries(self.value.is_some()))?;
        input::reserve(&mut self.points.opacity, entries(self.opacity.is_some()))
    }

    /// Room for one point after `before`.
    pub(super) fn reserve_one(&mut self, before: u64, reading: &Reading<'_>) -> Result<(), ReadError> {
        self.held.hold((before + 1).saturating_mul(self.bytes_per_point()), reading.params)?;
        input::reserve(&mut self.positions, 1)
    }

    /// Takes a point whose fields `number` tells by their ranks.
    pub(super) fn push(&mut self, number: impl Fn(usize) -> Number) -> Result<(), Unfit> {
        let vector = |ranks: [usize; 3]| DVec3::from_array(ranks.map(|i| number(i).value));
        let position = vector(self.position);
        if position.is_nan() {
            self.without_place += 1;
            self.points.dropped += 1;
            return Ok(());
        }
        if let Some(axis) = (0..3).find(|a| !position[*a].is_finite()) {
            if self.drop_invalid {
                self.points.dropped += 1;
                return Ok(());
            }
            let hint = "remove the point, or leave such points out with --drop-invalid";
            return Err((self.position[axis], "a finite number".to_owned(), hint));
        }
        let value = self.value.map(|i| (i, number(i).value as f32));
        if let Some((i, _)) = value.filter(|(_, v)| !v.is_finite()) {
            return Err((i, "a value that fits a 32-bit float".to_owned(), "scale the values, or remove the point"));
        }
        let opacity = self.opacity.map(|(i, top)| (i, top, number(i).value / top));
        if let Some((i, top, _)) = opacity.filter(|(_, _, share)| !(0.0..=1.0).contains(share)) {
            return Err((i, format!("an opacity from 0 to {top}"), "or rename the field"));
        }
        let unfit = |rank: usize| Some((rank, self.extras.unfit(rank, number(rank).value)?));
        if let Some((rank, expected)) = self.extras.read().find_map(unfit) {
            return Err((rank, expected.to_owned(), UNFIT_HINT));
        }
        self.positions.push(position);
        self.extras.push(|rank| number(rank).value);
        if let Some(ranks) = self.normal {
            // Where there is none, it is NaN.
            let normal = vector(ranks);
            self.points.normal.push(if normal.is_finite() { unit(normal) } else { Vec3::ZERO });
        }
        if let Some(i) = self.color {
            let [alpha, rgb @ ..] = number(i).bits.to_be_bytes();
            // Many writers leave the alpha 0, which cannot be meant.
            self.has_alpha |= !matches!(alpha, 0 | 255);
            self.points.color.push(rgb.map(|c| linear_from_srgb(f64::from(c) / 255.0)));
        }
        self.points.value.extend(value.map(|(_, v)| v));
        self.points.opacity.extend(opacity.map(|(_, _, share)| share as f32));
        Ok(())
    }

    /// The columns as points.
    pub(super) fn into_points(self, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
        if self.has_alpha {
            reading.notes.not_used([&b"alpha of rgba"[..]]);
        }
        if self.without_place > 0 {
            let n = self.without_place;
            let these = if n == 1 { "point has no place (nan) and is" } else { "points have no place (nan) and are" };
            reading.notes.remarks.push(format!("{n} {these} left out"));
        }
        let (origin, position) = origin::relative(&self.positions, self.place, |i| format!("point {i}"))?;
        Ok(RawPoints { origin, position, columns: self.extras.finish(&mut reading.notes), ..self.points })
    }
}
