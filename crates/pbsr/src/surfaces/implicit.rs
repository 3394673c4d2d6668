//! Implicit surfaces f = c inside a box (Tanaka 2012, section 4), and the cells of the box that may hold a piece of them.
//!
//! The box is parted into cubes; an octree over them drops every cube where the field's `bound` over the ball around it
//! excludes c. If a field has no bound, no cube is dropped, and all results are reported as unproven.

use crate::Error;
use crate::error::check;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{DAabb, ScalarField, glam};

/// The surface f = level inside a box; open where the box or `inside` cuts it.
#[derive(Clone, Copy)]
pub struct ImplicitSurface<'a> {
    /// f.
    pub field: &'a dyn ScalarField,
    /// c.
    pub level: f64,
    /// The box, world units.
    pub bounds: DAabb,
    /// The part of the box that counts; all of it without.
    pub inside: Option<&'a (dyn Fn(DVec3) -> bool + Sync)>,
}

impl ImplicitSurface<'_> {
    /// Checks the box and that the field is finite at its corners and middle.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a box without volume or a level that is not finite, [`Error::Field`].
    pub fn validate(&self) -> Result<(), Error> {
        check(self.level.is_finite(), "level", self.level, "a finite number")?;
        let DAabb { min, max } = self.bounds;
        check(self.bounds.is_solid(), "box", (min, max), "two finite corners, the first less in all three")?;
        for k in 0..9u32 {
            let corner = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1));
            let at = min + self.bounds.size() * if k == 8 { DVec3::splat(0.5) } else { corner };
            let found = self.field.value(at);
            if !found.is_finite() {
                return Err(Error::Field { at: at.to_string(), found: found.to_string() });
            }
        }
        Ok(())
    }

    /// Whether `p` lies in the box, in the part of it that counts, and in the field's own domain.
    pub(crate) fn contains(&self, p: DVec3) -> bool {
        let in_box = self.bounds.contains(p);
        in_box && self.field.in_domain(p) && self.inside.is_none_or(|inside| inside(p))
    }

    /// Whether box, domain or the field's bound show that a cube holds no piece of the surface, and whether they do or there
    /// is a bound.
    pub(crate) fn excludes(&self, corner: DVec3, side: f64) -> (bool, bool) {
        let half = 0.5 * side;
        // √3 rounded up: the ball must hold the cube.
        let radius = half * 1.732_050_807_568_878;
        let beside = corner.cmpgt(self.bounds.max).any() || (corner + side).cmplt(self.bounds.min).any();
        if beside || !self.field.may_be_in_domain(corner + half, radius) {
            return (true, true);
        }
        let bound = self.field.bound(corner + half, radius);
        (bound.is_some_and(|(low, high)| low > self.level || high < self.level), bound.is_some())
    }

    /// f − c.
    #[inline]
    pub(crate) fn value(&self, p: DVec3) -> f64 {
        self.field.value(p) - self.level
    }
}

/// Counts of a search for cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CellCounts {
    /// Cells of the box.
    pub cells: u64,
    /// Cells that may hold a piece of the surface.
    pub active: u64,
    /// Of them, cells over which the field has no bound.
    pub unbounded: u64,
}

/// Where the lattice of cubes begins, in cubes before the box: planes of round coordinates must not lie on the faces of
/// cubes, where rounding would give them to both sides or to none.
const SHIFT: DVec3 = DVec3::new(0.273_9, 0.412_7, 0.161_8);

/// The cubes of the box that may hold a piece of the surface.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    /// Side of a cube.
    pub(crate) side: f64,
    /// Lowest corners.
    pub(crate) active: Vec<DVec3>,
    pub(crate) counts: CellCounts,
}

impl Cells {
    /// Cubes of which the longest side of the box has `resolution`.
    pub(crate) fn new(surface: &ImplicitSurface<'_>, resolution: u32) -> Self {
        let extent = surface.bounds.size();
        let side = extent.max_element() / f64::from(resolution);
        let dims = (extent / side + SHIFT).to_array().map(|n| (n - 1e-9).ceil().max(1.0) as i32);
        let search = Search { surface, min: surface.bounds.min - side * SHIFT, side, dims };
        let blocks = dims.map(|n| (n + 7) / 8);
        let found: Vec<(DVec3, bool)> = (0..blocks[0] * blocks[1] * blocks[2])
            .into_par_iter()
            .flat_map_iter(|b| {
                let corner = [b % blocks[0], b / blocks[0] % blocks[1], b / (blocks[0] * blocks[1])].map(|i| i * 8);
                let mut active = Vec::new();
                search.cube(corner, 8, &mut active);
                active
            })
            .collect();
        let counts = CellCounts {
            cells: dims.iter().map(|n| *n as u64).product(),
            active: found.len() as u64,
            unbounded: found.iter().filter(|(_, unbounded)| *unbounded).count() as u64,
        };
        Self { side, active: found.into_iter().map(|(corner, _)| corner).collect(), counts }
    }

    /// The middle of the box around all active cubes, or `None` without any.
    pub(crate) fn middle(&self) -> Option<DVec3> {
        let low = self.active.iter().copied().reduce(DVec3::min)?;
        let high = self.active.iter().copied().reduce(DVec3::max)?;
        Some(0.5 * (low + high + self.side))
    }
}

/// The octree over the cubes.
struct Search<'a> {
    surface: &'a ImplicitSurface<'a>,
    min: DVec3,
    side: f64,
    dims: [i32; 3],
}

impl Search<'_> {
    /// Active cubes among the `size`³ at `at`, each with whether it has no bound.
    fn cube(&self, at: [i32; 3], size: i32, active: &mut Vec<(DVec3, bool)>) {
        if (0..3).any(|a| at[a] >= self.dims[a]) {
            return;
        }
        let corner = self.min + DVec3::from_array(at.map(f64::from)) * self.side;
        let (excluded, bounded) = self.surface.excludes(corner, f64::from(size) * self.side);
        if excluded {
            return;
        }
        if size == 1 {
            active.push((corner, !bounded));
            return;
        }
        let half = size / 2;
        for k in 0..8 {
            self.cube(std::array::from_fn(|a| at[a] + if k >> a & 1 == 1 { half } else { 0 }), half, active);
        }
    }
}
