//! The paper's table of polar and azimuth angles (Gunjee 2007, Figure 3, Eqs. 1-3).
//!
//! row = (φ − pol_min)/(pol_max − pol_min)·rows, column = (θ − az_min)/(az_max − az_min)·columns
//!
//! | paper | here | |
//! |---|---|---|
//! | φ | polar angle | from +z, radians |
//! | θ | azimuth | from +x about +z, radians |
//! | k_pol, k_az | rows, columns | divisions of the whole range |
//!
//! Deviations: the paper's Eqs. 2-3 divide radians by degrees; one unit here. Its text makes the polar angle the row,
//! its equation the column; the text is followed. The polar angle is atan2(hypot(x, y), z), which keeps its digits at
//! the poles. The azimuth wraps, and rows continue across a pole on the opposite side. Absorbance is divided by the
//! true solid angle of the cell, Δaz·2·sin(mean)·sin(Δ/2).

use super::{Mapping, Place, Ray};
use glam::{Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// Ranges of angles that a table covers, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarRange {
    /// pol_min and pol_max, within \[0, π\].
    pub polar: [f64; 2],
    /// az_min and the width az_max − az_min, ≤ 2π.
    pub azimuth: [f64; 2],
}

impl PolarRange {
    /// The whole sphere of directions.
    pub const SPHERE: Self = Self { polar: [0.0, PI], azimuth: [0.0, TAU] };
}

/// Table of polar and azimuth angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarAzimuth {
    range: PolarRange,
    columns: u32,
    rows: u32,
}

impl PolarAzimuth {
    /// A table over `range`; columns and rows are at least 1, an empty range is widened.
    pub fn new(columns: u32, rows: u32, mut range: PolarRange) -> Self {
        let floor = 1e-6;
        range.polar[0] = range.polar[0].clamp(0.0, PI - floor);
        range.polar[1] = range.polar[1].clamp(range.polar[0] + floor, PI);
        range.azimuth[1] = range.azimuth[1].clamp(floor, TAU);
        Self { range, columns: columns.max(1), rows: rows.max(1) }
    }

    fn is_full_circle(&self) -> bool {
        self.range.azimuth[1] >= TAU
    }

    fn scale(&self) -> [f64; 2] {
        let [low, high] = self.range.polar;
        [f64::from(self.columns) / self.range.azimuth[1], f64::from(self.rows) / (high - low)]
    }
}

impl Mapping for PolarAzimuth {
    fn size(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    fn locate(&self, p: Vec3) -> Option<Place> {
        let distance = p.length();
        if distance <= 0.0 {
            return None;
        }
        // Adding zero turns −0 into +0, so that both sides of the seam agree on its azimuth.
        let azimuth = libm::atan2(f64::from(p.y + 0.0), f64::from(p.x));
        let polar = libm::atan2(f64::from(libm::hypotf(p.x, p.y)), f64::from(p.z));
        let [per_azimuth, per_polar] = self.scale();
        let turn = (azimuth - self.range.azimuth[0]).rem_euclid(TAU);
        let row = (polar - self.range.polar[0]) * per_polar;
        let column = turn * per_azimuth;
        let inside = column < f64::from(self.columns) + 1.0 && row > -1.0 && row < f64::from(self.rows) + 1.0;
        let column = if self.is_full_circle() { column.min(f64::from(self.columns)) } else { column };
        inside.then(|| Place { at: Vec2::new(column as f32, row as f32), distance })
    }

    fn gradients(&self, p: Vec3) -> [Vec3; 2] {
        let distance = p.length();
        let sin = libm::hypotf(p.x, p.y) / distance;
        let cos = p.z / distance;
        let (c, s) = if sin > 0.0 { (p.x / (sin * distance), p.y / (sin * distance)) } else { (1.0, 0.0) };
        let [per_azimuth, per_polar] = self.scale().map(|v| v as f32);
        let column = Vec3::new(-s, c, 0.0) * (per_azimuth / (distance * sin.max(1e-6)));
        let row = Vec3::new(cos * c, cos * s, -sin) * (per_polar / distance);
        [column, row]
    }

    fn wrap(&self, mut column: i32, mut row: i32) -> Option<u32> {
        let columns = self.columns as i32;
        let rows = self.rows as i32;
        let over_north = row < 0 && self.range.polar[0] <= 0.0;
        let over_south = row >= rows && self.range.polar[1] >= PI;
        if (over_north || over_south) && self.is_full_circle() {
            row = if over_north { -1 - row } else { 2 * rows - 1 - row };
            column += columns / 2;
        }
        if self.is_full_circle() {
            column = column.rem_euclid(columns);
        }
        let inside = (0..columns).contains(&column) && (0..rows).contains(&row);
        inside.then(|| row as u32 * self.columns + column as u32)
    }

    fn ray(&self, at: Vec2) -> Ray {
        let [per_azimuth, per_polar] = self.scale();
        let (sin_a, cos_a) = libm::sincos(self.range.azimuth[0] + f64::from(at.x) / per_azimuth);
        let (sin_p, cos_p) = libm::sincos(self.range.polar[0] + f64::from(at.y) / per_polar);
        let direction = Vec3::new((sin_p * cos_a) as f32, (sin_p * sin_a) as f32, cos_p as f32);
        Ray { base: Vec3::ZERO, direction }
    }

    fn cell_ray(&self, cell: u32) -> Ray {
        self.ray(Vec2::new((cell % self.columns) as f32 + 0.5, (cell / self.columns) as f32 + 0.5))
    }

    fn measure(&self, cell: u32) -> f64 {
        let [per_azimuth, per_polar] = self.scale();
        let row = f64::from(cell / self.columns);
        let middle = self.range.polar[0] + (row + 0.5) / per_polar;
        2.0 * libm::sin(middle) * libm::sin(0.5 / per_polar) / per_azimuth
    }

    fn density(&self, ray: &Ray) -> f32 {
        libm::hypotf(ray.direction.x, ray.direction.y)
    }

    fn clearance(&self, at: Vec2, half: Vec2) -> f32 {
        let to_pole = |pole: f64| ((pole - self.range.polar[0]) * self.scale()[1]) as f32 - at.y;
        to_pole(0.0).abs().min(to_pole(PI).abs()) / half.y
    }
}
