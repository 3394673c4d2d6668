//! A physical field that a surface shows at its points, by colour and opacity (Tanaka 2012, section 5, shows a dose
//! beside the body that takes it; here it lies on the body's surface).
//!
//! Every splat takes the value of the field at its centre. A transfer function maps it to the colour and to a share of the surface's
//! opacity, α′ = α·share. So the optical depth of one crossing becomes τ′ = −ln(1 − α′), and K = τ′·a with the area
//! a that the splat stands for.

use crate::common::columns::CHUNK;
use crate::{Classified, ConvertError, SplatParams};
use field::{GridField, Inside};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Cloud, DAabb, Error, Grid, Interpolation, ScalarField, SplatKind, TransferFunction, optics};
use std::sync::Arc;

/// Optical depth of one crossing where a field takes all opacity away: none to the eye, and yet the layer of a surface.
const CLEAR: f64 = 1e-30;

/// A volume whose values a surface shows.
#[derive(Debug, Clone)]
pub struct SurfaceField {
    field: GridField,
    transfer: TransferFunction,
    classified: Classified,
}

/// The appearance of a surface at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLook {
    /// Linear Rec.709.
    pub color: [f32; 3],
    /// The remaining share of the optical depth of a crossing, 0 to 1.
    pub depth_share: f64,
}

impl SurfaceField {
    /// The field of a volume in the coordinates of the surface before its transform. `classified` defines the meaning of the
    /// extinctions of `transfer`: nothing, or a share of the surface's opacity.
    ///
    /// # Errors
    /// As [`GridField::new`].
    pub fn new(
        grid: Arc<Grid>,
        interpolation: Interpolation,
        transfer: TransferFunction,
        classified: Classified,
    ) -> Result<Self, Error> {
        // Its own values: those below 0, with their sign.
        let field = GridField::new(grid, interpolation, 0.0, Inside::Below)?;
        Ok(Self { field, transfer, classified })
    }

    /// The least share of a surface's opacity that the field leaves to it, in \[0, 1\].
    pub fn least_share(&self) -> f64 {
        let shares = self.transfer.points().iter().map(|point| f64::from(point.extinction));
        if self.classified == Classified::Opacity { shares.fold(1.0, f64::min) } else { 1.0 }
    }

    /// The largest channel of the colours that it gives.
    pub fn brightest(&self) -> f32 {
        self.transfer.brightest()
    }

    /// The surface's appearance at a place in object coordinates. `opacity` is that of a crossing, below 1. `None` where the field is not
    /// known.
    pub fn at(&self, place: DVec3, opacity: f64) -> Option<SurfaceLook> {
        let look = self.transfer.at(self.value(place)?);
        let faded = || optics::optical_depth(opacity * f64::from(look.extinction)) / optics::optical_depth(opacity);
        let depth_share = if self.classified == Classified::Opacity { faded() } else { 1.0 };
        Some(SurfaceLook { color: look.color, depth_share })
    }

    fn value(&self, place: DVec3) -> Option<f32> {
        self.field.fills(place).then(|| self.field.value(place) as f32)
    }

    /// Gives the splats of a surface the field's colours and opacities, and with `keeps_values` its values. A volume reaches half a
    /// step beyond its outer lattice points; splats beyond that stay as they are. Returns a warning about the share of such splats, a
    /// clause without a full stop.
    ///
    /// ```
    /// use convert::{Classified, Density, MeshParams, SurfaceField, mesh_to_points};
    /// use splat_core::Interpolation;
    /// use splat_core::{Grid, Mesh, TransferFunction, TransferPoint, glam::{DMat3, DVec3}};
    /// let values = vec![0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0];
    /// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [2; 3], values };
    /// let point = |value| TransferPoint { value, color: [value; 3], extinction: 0.0 };
    /// let transfer = TransferFunction::new(vec![point(0.0), point(1.0)]).unwrap();
    /// let field = SurfaceField::new(grid.into(), Interpolation::Trilinear, transfer, Classified::No).unwrap();
    /// let mesh = Mesh::rectangle(DVec3::splat(0.5), DVec3::X * 0.5, DVec3::Y * 0.5);
    /// let params = MeshParams { density: Density::Spacing(0.1), ..MeshParams::default() };
    /// let (mut cloud, _) = mesh_to_points(&mesh, &params, None).unwrap();
    /// assert_eq!(field.show(&mut cloud, &params.splat, false).unwrap(), None);
    /// assert!((cloud.color[0][0] - cloud.get(0).position.x - cloud.origin.x as f32).abs() < 1e-6);
    /// ```
    ///
    /// # Errors
    /// [`ConvertError::Parameter`] where it covers none of the surface.
    pub fn show(
        &self,
        cloud: &mut Cloud,
        params: &SplatParams,
        keeps_values: bool,
    ) -> Result<Option<String>, ConvertError> {
        let transform = &params.transform;
        let back = transform.rotation.inverse();
        let from = cloud.origin - transform.translation;
        let place = |i: usize| back * (from + cloud.position[i].as_dvec3()) / transform.scale;
        let n = cloud.position.len();
        let values: Vec<Option<f32>> =
            (0..n).into_par_iter().with_min_len(CHUNK).map(|i| self.value(place(i))).collect();
        if n > 0 && values.iter().all(Option::is_none) {
            let known = self.field.bounds();
            let surface = DAabb::of_points((0..n).map(place));
            let [[a, b], [c, d]] = [known, surface].map(|b| [b.min, b.max]);
            let found = format!("known from {a} to {b} alone, and the surface lies from {c} to {d}");
            return Err(params.bad_text(
                "field",
                found,
                "values on the surface, in its coordinates before `transform`",
            ));
        }
        let areas = |known: bool| (0..n).filter(|i| values[*i].is_some() == known).map(|i| area(cloud, i)).sum::<f64>();
        let missed = areas(false) / (areas(true) + areas(false));
        for (i, value) in values.iter().enumerate() {
            let Some(value) = value else { continue };
            let look = self.transfer.at(*value);
            cloud.color[i] = look.color;
            if self.classified == Classified::Opacity {
                fade(cloud, i, f64::from(look.extinction));
            }
        }
        if let (true, Some(values)) = (keeps_values, values.into_iter().collect()) {
            cloud.value = values;
        }
        let share = if missed < 0.001 { "less than 0.1".to_owned() } else { format!("{:.1}", 100.0 * missed) };
        let said = || format!("{share} % of its surface lies where the field is not known, and looks as without it");
        Ok((missed > 0.0).then(said))
    }
}

/// The area that a splat of a surface stands for; of surfaces that let all light through, which do not say, one as small as may be.
fn area(cloud: &Cloud, i: usize) -> f64 {
    let depth = cloud.crossing_depth.get(i).copied().unwrap_or(0.0);
    let area = f64::from(cloud.cross_section[i]) / if depth > 0.0 { f64::from(depth) } else { 1.0 };
    area.max(f64::MIN_POSITIVE)
}

/// Leaves a splat a share of the opacity that its surface has.
fn fade(cloud: &mut Cloud, i: usize, share: f64) {
    let area = area(cloud, i);
    let n = cloud.position.len();
    let opacity = match (cloud.kind[i], cloud.crossing_depth.get(i)) {
        (SplatKind::Opaque, _) => 1.0,
        (_, Some(depth)) if *depth > 0.0 => optics::opacity(f64::from(*depth)),
        // A surface that lets all light through goes on doing so.
        _ => return,
    };
    if opacity * share < 1.0 {
        let depth = optics::optical_depth(opacity * share).max(CLEAR);
        cloud.crossing_depth.resize(n, 0.0);
        (cloud.kind[i], cloud.cross_section[i]) = (SplatKind::Surface, (depth * area) as f32);
        cloud.crossing_depth[i] = depth as f32;
    }
}
