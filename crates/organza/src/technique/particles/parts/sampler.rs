//! The sampler of an object with data of its own, and what is doubtful about it.

use super::Source;
use crate::load::own::{Body, Own, line_cells};
use pbsr::{
    BoundedExtinction, BrownianParams, BrownianReport, BrownianSampler, Density, FieldVolumeSampler, GridSampler,
    ImplicitSurface, LatticeSampler, LineReport, LineSampler, MeshSampler, Sampler, SurfaceParams, VolumeParams,
};

/// Optical depth of a surface that is not quite opaque, at most.
const DEEPEST: f64 = 64.0;
/// Relative error of a counted area up to which no warning is given; that of the area by lines is a few percent.
const MISCOUNTED: f64 = 0.1;
/// Share of the roots of a surface that may be missed before a warning is given.
const MISSED: f64 = 1e-3;

impl<'a> Source<'a> {
    pub(super) fn sampler(
        &self,
        own: &'a Own,
        warnings: &mut Vec<String>,
    ) -> Result<Box<dyn Sampler + 'a>, pbsr::Error> {
        Ok(match &own.body {
            Body::Surface { field, inside, spacing, step } => {
                let bounds = own.bounds;
                let surface = ImplicitSurface { field: field.as_ref(), level: 0.0, bounds, inside: Some(inside) };
                let width = bounds.size().max_element();
                let cells = line_cells(width, *spacing);
                if let Some(step) = step {
                    let paper = BrownianParams::for_width(width);
                    let walk = BrownianParams { step: step * width, resolution: cells, ..paper };
                    let sampler = BrownianSampler::new(&surface, &walk, &self.surface(own))?;
                    warnings.extend(self.doubtful_area(sampler.report()));
                    return Ok(Box::new(sampler));
                }
                let sampler =
                    LineSampler::new(&surface, &pbsr::LineParams { resolution: cells }, &self.surface(own), None)?;
                warnings.extend(self.doubts(sampler.report()));
                Box::new(sampler)
            }
            Body::Lattice { grid, level } => Box::new(LatticeSampler::new(grid, *level, &self.surface(own))?),
            Body::Triangles(mesh) => Box::new(MeshSampler::new(mesh, &self.surface(own), None)?),
            Body::Cells { grid, transfer, normals, .. } => {
                let params = VolumeParams {
                    cross_section: self.cross_section,
                    extinction_scale: own.extinction_scale,
                    normals: *normals,
                    seed: self.seed,
                };
                Box::new(GridSampler::new(grid, transfer, &params, None)?)
            }
            Body::Field(field) => self.field(own, field)?,
        })
    }

    /// Where the spheres of a Brownian motion count another area than there is.
    fn doubtful_area(&self, report: &BrownianReport) -> Option<String> {
        let more = report.area / report.area_by_lines - 1.0;
        let (name, percent) = (crate::shown(&self.name), 100.0 * more);
        (more.abs() > MISCOUNTED).then(|| {
            format!(
                "object '{name}': its Brownian motion counts {percent:+.0} % of area, and is that much too dense, for borders \
                 or bends lie within a counting sphere"
            )
        })
    }

    /// What a survey of the surface could not settle.
    fn doubts(&self, report: &LineReport) -> Vec<String> {
        let name = crate::shown(&self.name);
        let mut doubts = Vec::new();
        if report.broken > 0 {
            let what = format!(
                "object '{name}': its field is not finite on {} pieces of {} lines",
                report.broken, report.lines
            );
            doubts.push(what);
        }
        if report.missed() > MISSED {
            let percent = 100.0 * report.missed();
            doubts.push(format!(
                "object '{name}': lines miss {percent:.2} % of its surface, which has no bound or a fine fold"
            ));
        }
        doubts
    }

    fn field<'b>(&self, own: &Own, field: &'b BoundedExtinction) -> Result<Box<dyn Sampler + 'b>, pbsr::Error> {
        let extinction = Density { field, max: field.max() };
        let (bounds, cells, color) = (field.bounds(), field.cells(), own.color);
        Ok(Box::new(FieldVolumeSampler::new(
            extinction,
            bounds,
            &pbsr::FieldVolumeParams { resolution: cells, cross_section: self.cross_section, color, seed: self.seed },
        )?))
    }

    fn surface(&self, own: &Own) -> SurfaceParams {
        SurfaceParams {
            opacity: own.opacity,
            cross_section: self.cross_section,
            surface_opacity: self.look.material.surface_opacity,
            color: own.color,
            opaque_optical_depth: DEEPEST,
            seed: self.seed,
        }
    }
}
