//! Mappings: from positions in the light's frame to cells of a table, and back to rays.

mod octahedral;
mod planar;
mod polar;

pub use octahedral::Octahedral;
pub use planar::Planar;
pub use polar::{PolarAzimuth, PolarRange};

use crate::building::shares::between;
use glam::{Vec2, Vec3};

/// A ray of light through the table, in the light's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The point whose distance is zero.
    pub base: Vec3,
    /// Unit direction of travel.
    pub direction: Vec3,
}

/// A position in table coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Column and row, in cells; cell (i, j) covers \[i, i+1) × \[j, j+1).
    pub at: Vec2,
    /// Distance from the light, or along the light's direction; in the light's frame, > 0.
    pub distance: f32,
}

/// The view of a position from the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Its place in the table; arbitrary unless `is_seen`.
    pub place: Place,
    /// [`Mapping::gradients`] there.
    pub gradients: [Vec3; 2],
    /// Whether it has a place.
    pub is_seen: bool,
}

/// Maps positions in the light's frame to cells, and back.
///
/// The frame's origin is the light (for parallel light: a plane before all casters, at z = 0).
pub trait Mapping: Sync {
    /// Columns and rows.
    fn size(&self) -> [u32; 2];

    /// Where `p` lies; `None` at the light itself and outside the table.
    fn locate(&self, p: Vec3) -> Option<Place>;

    /// Gradients of column and row with respect to the position, cells per length, at a `p` that has a place.
    fn gradients(&self, p: Vec3) -> [Vec3; 2];

    /// [`Mapping::locate`] and [`Mapping::gradients`] at once. Without branches where a mapping can, so that a loop over
    /// many positions becomes vector instructions.
    #[inline(always)]
    fn view(&self, p: Vec3) -> View {
        let nowhere = Place { at: Vec2::ZERO, distance: 0.0 };
        let place = self.locate(p);
        let gradients = if place.is_some() { self.gradients(p) } else { [Vec3::ZERO; 2] };
        View { place: place.unwrap_or(nowhere), gradients, is_seen: place.is_some() }
    }

    /// The cell at a column and row that may lie beyond an edge across which the table continues; `None` outside.
    fn wrap(&self, column: i32, row: i32) -> Option<u32>;

    /// The ray through table coordinates.
    fn ray(&self, at: Vec2) -> Ray;

    /// The ray through the centre of a cell.
    fn cell_ray(&self, cell: u32) -> Ray;

    /// The same by column and row inside the table.
    #[inline(always)]
    fn ray_of(&self, column: u32, row: u32) -> Ray {
        self.cell_ray(row.wrapping_mul(self.size()[0]).wrapping_add(column))
    }

    /// Solid angle of a cell, sr; for parallel light its area.
    fn measure(&self, cell: u32) -> f64;

    /// 1/[`Mapping::measure`] of the cell at a column and row inside the table, in f32, cheap.
    fn inverse_measure(&self, column: u32, row: u32) -> f32 {
        (1.0 / self.measure(row.wrapping_mul(self.size()[0]).wrapping_add(column))) as f32
    }

    /// Solid angle per area of the table at a ray, in any unit: how samples inside a cell are weighted.
    fn density(&self, _ray: &Ray) -> f32 {
        1.0
    }

    /// Whether all rays are parallel, so that footprints do not shrink with distance.
    fn is_parallel(&self) -> bool {
        false
    }

    /// Whether the gradients of a footprint's centre hold across its edges only up to an exchange of column and row.
    fn is_folded(&self) -> bool {
        false
    }

    /// The edge within `half` cells of `at` across which gradients change abruptly, the nearest if there are several.
    fn crease(&self, _at: Vec2, _half: Vec2) -> Option<Crease> {
        None
    }

    /// Whether [`Mapping::crease`] finds an edge.
    #[inline(always)]
    fn is_creased(&self, at: Vec2, half: Vec2) -> bool {
        self.crease(at, half).is_some()
    }

    /// Distance from `at` to the nearest point (a pole, a corner of octants) where the table has no gradients at all, in
    /// half extents of a footprint.
    fn clearance(&self, _at: Vec2, _half: Vec2) -> f32 {
        f32::INFINITY
    }
}

/// An edge of the table across which gradients change abruptly, as seen from a place beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crease {
    /// The place in the coordinates of the far side, continued to the near one.
    pub at: Vec2,
    /// Derivatives of the far side's column and row with respect to the near side's.
    pub jacobian: [Vec2; 2],
    /// (a, b, c): a·x + b·y + c is positive on the side of the place.
    pub line: [f32; 3],
}

impl Crease {
    /// Which side the middle of a cell lies on: positive the near one, 0 where a diagonal halves the cell.
    #[inline]
    pub(crate) fn side(&self, column: i32, row: i32) -> f32 {
        let [a, b, c] = self.line;
        a * (column as f32 + 0.5) + b * (row as f32 + 0.5) + c
    }
}

/// The largest number that [`floor`] returns: no table has more columns or rows.
const MOST_CELLS: f32 = 4_194_303.0;
/// 1.5·2²³: adding it rounds to an integer that sits in the low bits of the sum.
const MAGIC: f32 = 12_582_912.0;

/// ⌊x⌋ for |x| < 2²², and the nearest such number for all others; without the test for overflow that conversions to
/// integers make, which keeps loops from becoming vector instructions.
#[inline(always)]
pub(crate) fn floor(x: f32) -> i32 {
    let x = between(x, -MOST_CELLS, MOST_CELLS);
    let shifted = x + MAGIC;
    let nearest = (shifted.to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32);
    nearest - i32::from(shifted - MAGIC > x)
}

/// Calls a generic function with the mapping that a [`Table`] holds.
macro_rules! with_mapping {
    ($table:expr, $m:ident => $body:expr) => {
        match $table {
            $crate::mapping::Table::Octahedral($m) => $body,
            $crate::mapping::Table::PolarAzimuth($m) => $body,
            $crate::mapping::Table::Planar($m) => $body,
        }
    };
}
pub(crate) use with_mapping;

/// The mapping of one shadow map.
#[derive(Debug, Clone, PartialEq)]
pub enum Table {
    /// Equal-area octahedral, the whole sphere.
    Octahedral(Octahedral),
    /// Polar and azimuth angles.
    PolarAzimuth(PolarAzimuth),
    /// A plane.
    Planar(Planar),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floor_is_floor_within_every_table() {
        for x in
            [0.0f32, -0.0, 0.5, -0.5, 1.0, -1.0, 1e-30, -1e-30, 7.999_999_5, -7.000_000_5, 4_194_302.8, -4_194_302.8]
        {
            assert_eq!(floor(x), x.floor() as i32, "{x}");
        }
        for i in 0..100_000 {
            let x = (splat_core::rng::unit_f32(2, 2, i, 0) - 0.5) * 2f32.powi((i % 23) as i32);
            assert_eq!(floor(x), x.floor() as i32, "{x}");
        }
        assert_eq!([floor(f32::INFINITY), floor(-1e30)], [4_194_303, -4_194_303]);
    }
}
