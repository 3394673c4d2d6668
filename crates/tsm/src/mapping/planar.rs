//! Planar tables: parallel light, and light from a point within a cone.
//!
//! Parallel: column = (x − min)/cell. Perspective: column = (x/z − min)/cell with z along the axis; a cell at (a, b) on
//! the plane z = 1 has the solid angle cell²·cos³θ, cos θ = 1/√(1 + a² + b²), to second order in the cell.

use super::{Mapping, Place, Ray, View};
use glam::{Vec2, Vec3};

/// A planar table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar {
    /// Lower corner: lengths for parallel light, tangents otherwise.
    pub min: Vec2,
    /// Side of a cell, in the unit of `min`.
    pub cell: f32,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Rays from the origin instead of parallel ones.
    pub perspective: bool,
}

impl Planar {
    #[inline(always)]
    fn coordinates(&self, p: Vec3) -> Vec2 {
        let q = if self.perspective { p.truncate() / p.z } else { p.truncate() };
        (q - self.min) / self.cell
    }
}

impl Mapping for Planar {
    #[inline(always)]
    fn size(&self) -> [u32; 2] {
        self.size
    }

    #[inline(always)]
    fn locate(&self, p: Vec3) -> Option<Place> {
        let view = self.view(p);
        view.is_seen.then_some(view.place)
    }

    #[inline(always)]
    fn view(&self, p: Vec3) -> View {
        let distance = if self.perspective { p.length() } else { p.z };
        let at = self.coordinates(p);
        let limit = Vec2::new(self.size[0] as f32, self.size[1] as f32) + 1.0;
        // Without short circuits: branches would keep a loop of this from being vectors.
        let is_inside = (at.x > -1.0) & (at.y > -1.0) & (at.x < limit.x) & (at.y < limit.y);
        let is_ahead = !self.perspective | ((p.z > 0.0) & (distance > 0.0));
        View { place: Place { at, distance }, gradients: self.gradients(p), is_seen: is_inside & is_ahead }
    }

    #[inline(always)]
    fn gradients(&self, p: Vec3) -> [Vec3; 2] {
        let scale = 1.0 / self.cell;
        if !self.perspective {
            return [Vec3::X * scale, Vec3::Y * scale];
        }
        let scale = scale / p.z;
        [Vec3::new(scale, 0.0, -scale * p.x / p.z), Vec3::new(0.0, scale, -scale * p.y / p.z)]
    }

    #[inline(always)]
    fn wrap(&self, column: i32, row: i32) -> Option<u32> {
        let [columns, rows] = self.size;
        let inside = (0..columns as i32).contains(&column) && (0..rows as i32).contains(&row);
        inside.then(|| row as u32 * columns + column as u32)
    }

    #[inline(always)]
    fn ray(&self, at: Vec2) -> Ray {
        let q = self.min + at * self.cell;
        if self.perspective {
            Ray { base: Vec3::ZERO, direction: q.extend(1.0).normalize() }
        } else {
            Ray { base: q.extend(0.0), direction: Vec3::Z }
        }
    }

    #[inline(always)]
    fn cell_ray(&self, cell: u32) -> Ray {
        let [columns, _] = self.size;
        self.ray_of(cell % columns, cell / columns)
    }

    #[inline(always)]
    fn ray_of(&self, column: u32, row: u32) -> Ray {
        self.ray(Vec2::new(column as f32 + 0.5, row as f32 + 0.5))
    }

    fn measure(&self, cell: u32) -> f64 {
        let area = f64::from(self.cell).powi(2);
        if self.perspective { area * f64::from(self.cell_ray(cell).direction.z).powi(3) } else { area }
    }

    #[inline(always)]
    fn inverse_measure(&self, column: u32, row: u32) -> f32 {
        let area = 1.0 / (self.cell * self.cell);
        if !self.perspective {
            return area;
        }
        let at = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
        let stretch = 1.0 + (self.min + at * self.cell).length_squared();
        area * stretch * stretch.sqrt()
    }

    #[inline(always)]
    fn is_parallel(&self) -> bool {
        !self.perspective
    }
}
