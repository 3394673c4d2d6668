//! Homogeneous shapes in closed form: boxes and balls of a medium, flat parallelograms of a surface.
//!
//! The cells of a lattice tile the shape exactly: Σ K = σ_t·V and Σ K = τ₁·A hold to rounding. So the optical depth along a
//! ray is the closed form convolved with the kernel. Tests use these shapes, and scenes that need a slab of fog.

use crate::common::columns::ColumnSet;
use crate::mesh::borders::Borders;
use crate::mesh::mesh_points;
use crate::splats::footprints::choose_by_place;
use crate::volume::cell_share::CellShares;
use crate::{ConvertError, SplatParams};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Clip, Cloud, DAabb, Grid, Splat, SplatKind, optics};

/// Sub-samples along each axis of a cell that a ball's surface cuts.
const SUBDIVISION: i32 = 8;

/// A homogeneous medium. Lengths are object units, before the transform of [`SplatParams`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HomogeneousMedium {
    /// The body that it fills.
    pub body: MediumBody,
    /// Extinction σ_t, 1/world unit, ≥ 0.
    pub extinction: f64,
    /// Distance of the lattice points, about, > 0.
    pub spacing: f64,
}

/// The body of a homogeneous medium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MediumBody {
    /// A box along the axes.
    Box(DAabb),
    /// A ball.
    Ball {
        /// Centre.
        center: DVec3,
        /// Radius, > 0.
        radius: f64,
    },
}

impl MediumBody {
    /// The box, or the one around the ball.
    pub fn bounds(&self) -> DAabb {
        match *self {
            Self::Box(bounds) => bounds,
            Self::Ball { center, radius } => DAabb::around(center, DVec3::splat(radius)),
        }
    }
}

/// A homogeneous medium as splats, of which all regions of `clips` keep something. Cells on the surface of a ball count with the share
/// of their volume inside; before clipping, all cells together have the volume 4/3·πr³ exactly. Cells that a region cuts count with
/// their kept share.
///
/// # Errors
/// [`ConvertError::Parameter`] for an empty box, a spacing or an extinction out of range, [`ConvertError::Limit`].
pub fn medium(medium: &HomogeneousMedium, clips: &[Clip], params: &SplatParams) -> Result<Cloud, ConvertError> {
    let lattice = Lattice::new(medium, params)?;
    let cut = lattice.cut(clips);
    let MediumBody::Ball { radius, .. } = medium.body else { return lattice.fill(params, cut) };
    let in_ball = |offset| share_in_ball(offset, radius, lattice.step);
    let mut cloud = lattice.fill(params, in_ball)?;
    let total: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * (radius * params.transform.scale).powi(3);
    let correction = (medium.extinction * volume / total) as f32;
    if !clips.is_empty() {
        cloud = lattice.fill(params, |offset| in_ball(offset) * cut(offset))?;
    }
    cloud.cross_section.iter_mut().for_each(|k| *k *= correction);
    Ok(cloud)
}

/// The same, uncut, as a volume: its extinction (1/world unit) on a lattice of cells that fill its bounds, before the transform of
/// `params`. A cell that the surface of a ball cuts has the share that lies inside.
///
/// # Errors
/// As [`medium`].
pub fn medium_to_grid(medium: &HomogeneousMedium, params: &SplatParams) -> Result<Grid, ConvertError> {
    let lattice = Lattice::new(medium, params)?;
    Ok(match medium.body {
        MediumBody::Box(_) => lattice.grid(|_| 1.0),
        MediumBody::Ball { radius, .. } => lattice.grid(|offset| share_in_ball(offset, radius, lattice.step)),
    })
}

/// A flat parallelogram; its normal is u × v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// The middle, object space.
    pub center: DVec3,
    /// The first half-axis, object units.
    pub u: DVec3,
    /// The other; not parallel to the first.
    pub v: DVec3,
    /// Distance of the splats, about, object units.
    pub spacing: f64,
}

/// A flat parallelogram as splats of a surface, `opacity` that of one crossing, in [0, 1]; 1 is an opaque surface.
///
/// # Errors
/// As [`medium`]; [`ConvertError::Parameter`] for parallel half-axes or another opacity.
pub fn rectangle(rectangle: &Rectangle, opacity: f64, params: &SplatParams) -> Result<Cloud, ConvertError> {
    let Rectangle { center, u, v, spacing } = *rectangle;
    params.check()?;
    let scale = params.transform.scale;
    params.check_spacing(spacing * scale)?;
    let normal = u.cross(v);
    if !(center.is_finite() && normal.is_finite() && normal.length() > 0.0) {
        return Err(params.bad("half-axes", [u, v], "two finite vectors that are not parallel"));
    }
    if !(0.0..=1.0).contains(&opacity) {
        return Err(params.bad("opacity", opacity, "a number in [0, 1]"));
    }
    let [nu, nv] = rectangle_counts(u, v, spacing);
    params.check_cloud(nu * nv, rectangle_columns(opacity, params))?;
    let area = 4.0 * normal.length() * scale * scale / (nu * nv);
    let step = (2.0 * u.length() / nu).max(2.0 * v.length() / nv) * scale;
    let splat = Splat {
        radius: params.radius(step) as f32,
        cross_section: if opacity < 1.0 { area * optics::optical_depth(opacity) } else { area } as f32,
        crossing_depth: if opacity < 1.0 { optics::optical_depth(opacity) as f32 } else { 0.0 },
        kind: if opacity < 1.0 { SplatKind::Surface } else { SplatKind::Opaque },
        normal: params.transform.rotate(normal.normalize()).as_vec3().normalize(),
        ..template(params)
    };
    let mut cloud = Cloud::new(params.transform.apply(center));
    cloud.reserve((nu * nv) as usize);
    for j in 0..nv as u64 {
        for i in 0..nu as u64 {
            let s = (2.0 * i as f64 + 1.0) / nu - 1.0;
            let t = (2.0 * j as f64 + 1.0) / nv - 1.0;
            let offset = params.transform.rotate((u * s + v * t) * scale);
            cloud.push(&Splat { position: offset.as_vec3(), ..splat });
        }
    }
    if splat.kind == SplatKind::Opaque && !params.shows_images() {
        let corners = [u + v, v - u, -u - v, u - v].map(|c| params.transform.rotate(c * scale).as_vec3());
        Borders::new((0..4).map(|i| [corners[i], corners[(i + 1) % 4]])).clip(&mut cloud);
    }
    choose_by_place(&mut cloud, params)?;
    Ok(cloud)
}

/// Splats along the two half-axes of a parallelogram.
pub(crate) fn rectangle_counts(u: DVec3, v: DVec3, spacing: f64) -> [f64; 2] {
    [u, v].map(|axis| (2.0 * axis.length() / spacing).ceil().max(1.0))
}

/// Columns of a parallelogram's cloud.
pub(crate) fn rectangle_columns(opacity: f64, params: &SplatParams) -> ColumnSet {
    ColumnSet { tangent: opacity >= 1.0 || params.shows_images(), ..mesh_points::column_set(opacity) }
}

fn template(params: &SplatParams) -> Splat {
    Splat {
        color: params.color,
        material: params.material,
        footprint: params.footprint,
        object: params.object,
        ..Splat::default()
    }
}

/// Cells that tile a box.
pub(crate) struct Lattice {
    step: DVec3,
    pub(crate) counts: [u64; 3],
    center: DVec3,
    extinction: f64,
}

impl Lattice {
    pub(crate) fn new(medium: &HomogeneousMedium, params: &SplatParams) -> Result<Self, ConvertError> {
        let HomogeneousMedium { extinction, spacing, .. } = *medium;
        let bounds = medium.body.bounds();
        params.check()?;
        params.check_spacing(spacing * params.transform.scale)?;
        let DAabb { min, max } = bounds;
        let extent = bounds.size();
        if !bounds.is_solid() {
            return Err(params.bad("box", [min, max], "a lowest corner below the highest on every axis"));
        }
        if !(extinction.is_finite() && extinction >= 0.0) {
            return Err(params.bad("extinction", extinction, "a finite number ≥ 0"));
        }
        let counts = (extent / spacing).to_array().map(|n| n.ceil().max(1.0));
        params.check_cloud(counts.iter().product(), ColumnSet::default())?;
        let step = extent / DVec3::from_array(counts);
        Ok(Self { step, counts: counts.map(|n| n as u64), center: (min + max) * 0.5, extinction })
    }

    /// The share of the cell around an offset from the middle of the box that all of the regions keep.
    pub(crate) fn cut(&self, clips: &[Clip]) -> impl Fn(DVec3) -> f64 + use<> {
        let shares = CellShares::new(clips, self.center, DMat3::from_diagonal(self.step));
        let step = self.step;
        move |offset| shares.at(offset / step)
    }

    /// The extinction of each cell at its middle, times `share(offset)`.
    fn grid(&self, share: impl Fn(DVec3) -> f64) -> Grid {
        let dims = self.counts.map(|n| n as usize);
        let middle = DVec3::from_array(self.counts.map(|n| 0.5 * (n as f64 - 1.0)));
        let [nx, ny, _] = dims;
        let index = |at: usize| DVec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64);
        let value = |at: usize| (self.extinction * share((index(at) - middle) * self.step)) as f32;
        Grid {
            origin: self.center - middle * self.step,
            axes: DMat3::from_diagonal(self.step),
            dims,
            values: (0..dims.iter().product()).map(value).collect(),
        }
    }

    /// One splat a cell, its cross-section times `share(offset)`; cells without a share make none. Offsets are counted from
    /// the middle of the box, so a box far from 0 has the same ones.
    fn fill(&self, params: &SplatParams, share: impl Fn(DVec3) -> f64) -> Result<Cloud, ConvertError> {
        let scale = params.transform.scale;
        let volume = self.step.element_product() * scale.powi(3);
        let splat = Splat { radius: params.radius(self.step.max_element() * scale) as f32, ..template(params) };
        let mut cloud = Cloud::new(params.transform.apply(self.center));
        for offset in self.offsets() {
            let cross_section = (self.extinction * volume * share(offset)) as f32;
            if cross_section > 0.0 {
                let position: Vec3 = params.transform.rotate(offset * scale).as_vec3();
                cloud.push(&Splat { position, cross_section, ..splat });
            }
        }
        Ok(cloud)
    }

    /// The middles of the cells, from the middle of the box.
    pub(crate) fn offsets(&self) -> impl Iterator<Item = DVec3> {
        let middle = DVec3::from_array(self.counts.map(|n| 0.5 * n as f64));
        let [nx, ny, nz] = self.counts;
        let cells = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        cells.map(move |cell| (DVec3::from_array(cell.map(|n| n as f64 + 0.5)) - middle) * self.step)
    }
}

/// Share of the cell of size `step` around `p` that lies within `radius` of 0.
fn share_in_ball(p: DVec3, radius: f64, step: DVec3) -> f64 {
    let reach = 0.5 * step.length();
    if p.length() + reach <= radius {
        return 1.0;
    }
    if p.length() - reach >= radius {
        return 0.0;
    }
    let mut inside = 0;
    for k in 0..SUBDIVISION {
        for j in 0..SUBDIVISION {
            for i in 0..SUBDIVISION {
                let at = (DVec3::new(f64::from(i), f64::from(j), f64::from(k)) + 0.5) / f64::from(SUBDIVISION) - 0.5;
                inside += i32::from((p + at * step).length_squared() < radius * radius);
            }
        }
    }
    f64::from(inside) / f64::from(SUBDIVISION.pow(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLAB: HomogeneousMedium = HomogeneousMedium {
        body: MediumBody::Box(DAabb::new(DVec3::ZERO, DVec3::new(2.0, 1.0, 0.3))),
        extinction: 5.0,
        spacing: 0.07,
    };

    const BALL: HomogeneousMedium = HomogeneousMedium {
        body: MediumBody::Ball { center: DVec3::ONE, radius: 0.5 },
        extinction: 2.0,
        spacing: 0.04,
    };

    fn total(cloud: &Cloud) -> f64 {
        cloud.cross_section.iter().map(|k| f64::from(*k)).sum()
    }

    #[test]
    fn cross_sections_sum_to_extinction_times_volume() {
        let p = SplatParams::default();
        let slab = medium(&SLAB, &[], &p).unwrap();
        assert!((total(&slab) / 3.0 - 1.0).abs() < 1e-6, "{}", total(&slab));
        let ball = medium(&BALL, &[], &p).unwrap();
        let exact = 2.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((total(&ball) / exact - 1.0).abs() < 1e-6, "{}", total(&ball));
    }

    #[test]
    fn a_volume_has_the_extinction_of_its_splats() {
        let p = SplatParams::default();
        let mass = |grid: &Grid| {
            let cell = grid.axes.determinant();
            grid.values.iter().map(|v| f64::from(*v) * cell).sum::<f64>()
        };
        let slab = medium_to_grid(&SLAB, &p).unwrap();
        assert!((mass(&slab) / 3.0 - 1.0).abs() < 1e-6, "{}", mass(&slab));
        // Cells fill the box.
        assert!((slab.position(0, 0, 0) - 0.5 * slab.axes * DVec3::ONE).length() < 1e-12);
        let ball = medium_to_grid(&BALL, &p).unwrap();
        let exact = 2.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((mass(&ball) / exact - 1.0).abs() < 1e-3, "{}", mass(&ball));
        let [nx, ny, nz] = ball.dims;
        assert!((ball.position(0, 0, 0) + ball.position(nx - 1, ny - 1, nz - 1) - 2.0).length() < 1e-12);
    }

    #[test]
    fn a_cut_leaves_the_part_of_the_volume_that_is_within() {
        let p = SplatParams::default();
        let oblique = Clip::HalfSpace { normal: DVec3::new(1.0, 2.0, 0.0), offset: 2.0 };
        // Half of the slab, by symmetry; of it what lies below a plane that crosses cells.
        let slab = medium(&SLAB, &[oblique], &p).unwrap();
        assert!((total(&slab) / 1.5 - 1.0).abs() < 1e-6, "{}", total(&slab));
        let low = Clip::Box(DAabb::new(DVec3::splat(-1.0), DVec3::new(3.0, 3.0, 0.11)));
        let both = medium(&SLAB, &[oblique, low], &p).unwrap();
        assert!((total(&both) / (1.5 * 0.11 / 0.3) - 1.0).abs() < 1e-6, "{}", total(&both));
        // A cap of height h of a ball has the volume πh²(r − h/3).
        let cap = medium(&BALL, &[Clip::HalfSpace { normal: DVec3::Z, offset: 0.73 }], &p).unwrap();
        let exact = 2.0 * std::f64::consts::PI * 0.23f64.powi(2) * (0.5 - 0.23 / 3.0);
        assert!((total(&cap) / exact - 1.0).abs() < 5e-3, "{} {exact}", total(&cap));
        let nothing = [Clip::HalfSpace { normal: DVec3::Z, offset: -1.0 }];
        assert!(medium(&BALL, &nothing, &p).unwrap().is_empty() && medium(&SLAB, &nothing, &p).unwrap().is_empty());
    }

    #[test]
    fn rectangle_carries_the_optical_depth_of_its_area() {
        let p = SplatParams::default();
        let flat = Rectangle { center: DVec3::ZERO, u: DVec3::X, v: DVec3::Z * 2.0, spacing: 0.05 };
        let plane = rectangle(&flat, 0.75, &p).unwrap();
        assert!((total(&plane) / (8.0 * 4.0_f64.ln()) - 1.0).abs() < 1e-6);
        assert_eq!(plane.normal[0], Vec3::NEG_Y);
        plane.validate().unwrap();
    }

    #[test]
    fn cv10_a_spacing_beyond_the_budget_is_refused() {
        let p = SplatParams { limits: splat_core::Limits::elements(1000), ..SplatParams::default() };
        for spacing in [1e-9, 0.0, f64::INFINITY, f64::NAN] {
            assert!(medium(&HomogeneousMedium { spacing, ..SLAB }, &[], &p).is_err(), "{spacing}");
        }
        let body = MediumBody::Box(DAabb::new(DVec3::ONE, DVec3::ZERO));
        assert!(medium(&HomogeneousMedium { body, ..BALL }, &[], &SplatParams::default()).is_err());
    }
}
