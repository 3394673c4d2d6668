//! Isosurfaces of volumes as scalar fields, trilinear or Catmull-Rom (Tanaka 2012, section 4; Catmull and Rom 1974).
//!
//! f(p) = ±(v(u) − c) with u = A⁻¹(p − o): o the lattice's origin, A its steps, c the isovalue. ∇f = A⁻ᵀ∇ᵤv and
//! Hf = A⁻ᵀ(Hᵤv)A⁻¹, so sheared and mirrored lattices have exact derivatives. The surface exists between the lattice
//! points only ([`ScalarField::in_domain`], [`GridField::bounds`]); elsewhere the field has the value of the nearest place
//! of the lattice (in lattice coordinates), so that it is bounded and no zero appears out there.
//!
//! A bound comes from control points: the interpolation of a cell stays between the least and the greatest of its
//! corners (trilinear) or Bernstein control points (Catmull-Rom). The ranges of whole cells are the bound if they exclude the
//! surface. Else balls of at most two cells along each axis use the control points of the box around the ball,
//! which shrink onto the field with its radius.

mod jet;
mod ranges;
mod stencil;

use jet::{Slope, control_range, hessian, slope};
use ranges::{Ranges, widen};
use splat_core::glam::{BVec3, DMat3, DVec3};
use splat_core::{Clip, DAabb, Error, Grid, Interpolation, ScalarField};
use std::sync::Arc;
use stencil::{Control, Stencil};

/// The inner side of an isosurface, where the field is negative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Inside {
    /// Where values are above the isovalue: bone in a scan, matter in a density.
    #[default]
    Above,
    /// Where values are below the isovalue: distances.
    Below,
}

impl Inside {
    /// The sign that makes the inside negative.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Above => -1.0,
            Self::Below => 1.0,
        }
    }
}

/// Data of a volume that does not depend on the isovalue.
#[derive(Debug)]
struct Volume {
    grid: Arc<Grid>,
    ranges: Ranges,
}

/// An isosurface of a volume as a field.
///
/// ```
/// use field::{GridField, Inside};
/// use splat_core::Interpolation;
/// use splat_core::{Grid, ScalarField, glam::{DMat3, DVec3}};
/// let values = (0..64).map(|i| (i % 4) as f32).collect();
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [4; 3], values };
/// let field = GridField::new(grid.into(), Interpolation::CatmullRom, 1.5, Inside::Below).unwrap();
/// assert_eq!(field.value(DVec3::new(1.75, 2.0, 0.5)), 0.25);
/// assert_eq!(field.gradient(DVec3::new(1.75, 2.0, 0.5)), DVec3::X);
/// ```
#[derive(Debug, Clone)]
pub struct GridField {
    volume: Arc<Volume>,
    interpolation: Interpolation,
    isovalue: f64,
    sign: f64,
    /// Lattice coordinates from positions, see [`Grid::axes`].
    lattice_from_object: DMat3,
    /// Lengths of its rows: how far a lattice coordinate moves on a way of length 1.
    reach: DVec3,
    /// The last lattice point along each axis.
    last: DVec3,
    /// How far lattice coordinates of places on the border may be off by rounding.
    rounding: DVec3,
}

impl GridField {
    /// The isosurface of `grid` at `isovalue` (units of its values).
    ///
    /// Takes O(voxels) once, also for several isovalues: see [`GridField::with_isovalue`].
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::ColumnLength`] for a grid that does not validate, steps that have no inverse in
    /// f64, or an isovalue that is not finite.
    pub fn new(grid: Arc<Grid>, interpolation: Interpolation, isovalue: f64, inside: Inside) -> Result<Self, Error> {
        grid.validate()?;
        let lattice_from_object = grid.axes.inverse();
        let rows = lattice_from_object.transpose();
        let reach = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        if !(reach.is_finite() && lattice_from_object.is_finite()) {
            return Err(Error::invalid("grid", 0, "axes", grid.axes, "steps that have an inverse"));
        }
        let last = DVec3::from_array(grid.dims.map(|n| (n - 1) as f64));
        let far = grid.origin.abs().max_element() + (grid.axes * last).abs().max_element();
        let rounding = reach * (8.0 * f64::EPSILON * far);
        let ranges = Ranges::new(&grid, interpolation);
        let volume = Arc::new(Volume { grid, ranges });
        Self { volume, interpolation, isovalue: 0.0, sign: 1.0, lattice_from_object, reach, last, rounding }
            .with_isovalue(isovalue, inside)
    }

    /// Another isosurface of the same volume, which is shared.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the isovalue is not finite.
    pub fn with_isovalue(&self, isovalue: f64, inside: Inside) -> Result<Self, Error> {
        if !isovalue.is_finite() {
            return Err(Error::invalid("isosurface", 0, "isovalue", isovalue, "a finite number"));
        }
        Ok(Self { isovalue, sign: inside.sign(), ..self.clone() })
    }

    /// The volume.
    pub fn grid(&self) -> &Grid {
        &self.volume.grid
    }

    /// The box around the lattice; a sheared lattice fills it in part.
    pub fn bounds(&self) -> DAabb {
        let far = self.grid().axes * DMat3::from_diagonal(self.last);
        let zero = DVec3::ZERO;
        let origin = self.grid().origin;
        let low = far.x_axis.min(zero) + far.y_axis.min(zero) + far.z_axis.min(zero);
        let high = far.x_axis.max(zero) + far.y_axis.max(zero) + far.z_axis.max(zero);
        DAabb::new(origin + low, origin + high)
    }

    /// The six sides of the lattice, between which the surface lies.
    pub fn walls(&self) -> Vec<Clip> {
        let rows = self.lattice_from_object.transpose();
        let origin = self.grid().origin;
        let sides = |(row, last): (DVec3, f64)| {
            let low = row.dot(origin);
            let high = Clip::HalfSpace { normal: row, offset: low + last };
            [Clip::HalfSpace { normal: -row, offset: -low }, high]
        };
        [rows.x_axis, rows.y_axis, rows.z_axis].into_iter().zip(self.last.to_array()).flat_map(sides).collect()
    }

    /// Whether a place is within half a step of the lattice, which voxels fill.
    pub fn fills(&self, p: DVec3) -> bool {
        let u = self.lattice_coordinate(p);
        (u - u.clamp(DVec3::ZERO, self.last)).abs().cmple(self.rounding + 0.5).all()
    }

    #[inline(always)]
    fn lattice_coordinate(&self, p: DVec3) -> DVec3 {
        self.lattice_from_object * (p - self.grid().origin)
    }

    /// Value and gradient of the volume with respect to lattice coordinates; constant along axes on which `u` lies outside.
    #[inline(always)]
    fn lattice_slope(&self, u: DVec3) -> Slope {
        let grid = self.grid();
        let inside = u.clamp(DVec3::ZERO, self.last);
        let [x, y, z] = inside.to_array();
        let [nx, ny, nz] = grid.dims;
        let (value, gradient) = match self.interpolation {
            Interpolation::Trilinear => {
                slope(grid, &[Stencil::linear(x, nx), Stencil::linear(y, ny), Stencil::linear(z, nz)])
            }
            Interpolation::CatmullRom => {
                slope(grid, &[Stencil::catmull_rom(x, nx), Stencil::catmull_rom(y, ny), Stencil::catmull_rom(z, nz)])
            }
        };
        (value, DVec3::select(self.is_between(u, inside), gradient, DVec3::ZERO))
    }

    /// Along which axes `u` lies between lattice points, the border included; `inside` is the nearest place that does.
    #[inline(always)]
    fn is_between(&self, u: DVec3, inside: DVec3) -> BVec3 {
        (u - inside).abs().cmple(self.rounding)
    }

    #[inline(always)]
    fn slope(&self, p: DVec3) -> Slope {
        let (value, gradient) = self.lattice_slope(self.lattice_coordinate(p));
        (self.sign * (value - self.isovalue), self.lattice_from_object.transpose() * (gradient * self.sign))
    }

    /// Range of the volume over a box of lattice coordinates that lies in the lattice.
    #[inline(always)]
    fn range(&self, low: DVec3, high: DVec3) -> [f64; 2] {
        let dims = self.grid().dims;
        let cells = |u: DVec3| [0, 1, 2].map(|a| (u[a] as usize).min(dims[a].saturating_sub(2)));
        let first = cells(low);
        let last = cells(high);
        let coarse = self.volume.ranges.over(first, last).map(f64::from);
        let across = (coarse[0] - self.isovalue) * (coarse[1] - self.isovalue) <= 0.0;
        if !across || (0..3).any(|a| last[a] - first[a] > 1) {
            return coarse;
        }
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for corner in 0..8usize {
            let cell: [usize; 3] = std::array::from_fn(|a| if corner >> a & 1 == 0 { first[a] } else { last[a] });
            if (0..3).any(|a| corner >> a & 1 == 1 && first[a] == last[a]) {
                continue;
            }
            let part = widen(self.cell_range(cell, low, high));
            range = [range[0].min(part[0]), range[1].max(part[1])];
        }
        range
    }

    /// Range over the part of one cell that lies in a box.
    #[inline(always)]
    fn cell_range(&self, cell: [usize; 3], low: DVec3, high: DVec3) -> [f64; 2] {
        let (grid, [nx, ny, nz]) = (self.grid(), self.grid().dims);
        let first = DVec3::from_array(cell.map(|c| c as f64));
        let [from, to] = [low, high].map(|u| (u - first).clamp(DVec3::ZERO, DVec3::ONE));
        let [x, y, z] = [[from.x, to.x], [from.y, to.y], [from.z, to.z]];
        let [i, j, k] = cell;
        match self.interpolation {
            Interpolation::Trilinear => {
                control_range(grid, &[Control::linear(i, x, nx), Control::linear(j, y, ny), Control::linear(k, z, nz)])
            }
            Interpolation::CatmullRom => control_range(
                grid,
                &[Control::catmull_rom(i, x, nx), Control::catmull_rom(j, y, ny), Control::catmull_rom(k, z, nz)],
            ),
        }
    }
}

/// Many places, in the form that [`pulp`] compiles once per instruction set.
struct Slopes<'a> {
    field: &'a GridField,
    at: &'a [DVec3],
    out: &'a mut [(f64, DVec3)],
}

impl pulp::NullaryFnOnce for Slopes<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.at.iter().zip(self.out).for_each(|(p, out)| *out = self.field.slope(*p));
    }
}

/// The range over a box, compiled likewise.
struct Over<'a> {
    field: &'a GridField,
    low: DVec3,
    high: DVec3,
}

impl pulp::NullaryFnOnce for Over<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn call(self) -> [f64; 2] {
        self.field.range(self.low, self.high)
    }
}

impl ScalarField for GridField {
    fn value(&self, p: DVec3) -> f64 {
        self.slope(p).0
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.slope(p).1
    }

    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        self.slope(p)
    }

    fn value_gradients(&self, at: &[DVec3], out: &mut [(f64, DVec3)]) {
        pulp::Arch::new().dispatch(Slopes { field: self, at, out });
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let u = self.lattice_coordinate(p);
        let grid = self.grid();
        let inside = u.clamp(DVec3::ZERO, self.last);
        let lattice = match self.interpolation {
            Interpolation::Trilinear => hessian(grid, &[0, 1, 2].map(|a| Stencil::linear(inside[a], grid.dims[a]))),
            Interpolation::CatmullRom => {
                hessian(grid, &[0, 1, 2].map(|a| Stencil::catmull_rom(inside[a], grid.dims[a])))
            }
        };
        let keep = DMat3::from_diagonal(DVec3::select(self.is_between(u, inside), DVec3::ONE, DVec3::ZERO));
        let inverse = self.lattice_from_object;
        inverse.transpose() * (keep * lattice * keep * self.sign) * inverse
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let u = self.lattice_coordinate(p);
        // The last term covers the rounding of positions and of lattice coordinates.
        let far = p.abs().max_element() + self.grid().origin.abs().max_element() + radius;
        let half = self.reach * (radius + 8.0 * f64::EPSILON * far);
        if !(u.is_finite() && half.is_finite() && radius >= 0.0) {
            return None;
        }
        let clamp = |u: DVec3| u.clamp(DVec3::ZERO, self.last);
        let over = Over { field: self, low: clamp(u - half), high: clamp(u + half) };
        let [low, high] = pulp::Arch::new().dispatch(over).map(|v| self.sign * (v - self.isovalue));
        Some((low.min(high), low.max(high)))
    }

    fn in_domain(&self, p: DVec3) -> bool {
        let u = self.lattice_coordinate(p);
        u.cmpge(DVec3::ZERO).all() && u.cmple(self.last).all()
    }
}
