//! The sampler of a native object, with warnings about its data.

use super::Source;
use crate::load::own::{Body, Own};
use crate::scene::VolumeSampler;
use pbsr::{
    BoundedExtinction, BrownianParams, BrownianSampler, Density, FieldVolumeSampler, GridSampler, ImplicitSurface,
    LatticeSampler, LineParams, LineSampler, MeshSampler, MetropolisParams, MetropolisSampler, Sampler, ShownSampler,
    SurfaceParams, VolumeParams,
};

/// Optical depth of a surface that is not quite opaque, at most.
const DEEPEST: f64 = 64.0;

impl<'a> Source<'a> {
    pub(super) fn sampler(
        &self,
        own: &'a Own,
        warnings: &mut Vec<String>,
    ) -> Result<Box<dyn Sampler + 'a>, pbsr::Error> {
        let bare = self.bare(own, warnings)?;
        let Some((field, opacity)) = &own.field else { return Ok(bare) };
        let unit = self.look.color_unit;
        let shown = move |place| field.at(place, *opacity).map(|(color, share)| (color.map(|c| c / unit), share));
        Ok(Box::new(ShownSampler::new(bare, Box::new(shown), self.seed)))
    }

    /// The same without a field that it shows.
    fn bare(&self, own: &'a Own, warnings: &mut Vec<String>) -> Result<Box<dyn Sampler + 'a>, pbsr::Error> {
        let named = |doubt: String| format!("object '{}': {doubt}", crate::shown(&self.name));
        Ok(match &own.body {
            Body::Surface { field, inside, spacing, step } => {
                let bounds = own.bounds;
                let surface = ImplicitSurface { field: field.as_ref(), level: 0.0, bounds, inside: Some(inside) };
                let width = bounds.size().max_element();
                let lines = LineParams::for_spacing(width, *spacing);
                if let Some(step) = step {
                    let paper = BrownianParams::for_width(width);
                    let walk = BrownianParams { step: step * width, resolution: lines.resolution, ..paper };
                    let sampler = BrownianSampler::new(&surface, &walk, &self.surface(own))?;
                    warnings.extend(sampler.report().doubt().map(named));
                    return Ok(Box::new(sampler));
                }
                let sampler = LineSampler::new(&surface, &lines, &self.surface(own), None)?;
                warnings.extend(sampler.report().doubts().map(named));
                Box::new(sampler)
            }
            Body::Lattice { grid, interpolation, level } => {
                Box::new(LatticeSampler::new(grid, *interpolation, *level, &self.surface(own))?)
            }
            Body::Triangles(mesh) => Box::new(MeshSampler::new(mesh, &self.surface(own), None)?),
            Body::Cells { grid, transfer, normals, cut, .. } => {
                let params = VolumeParams {
                    cross_section: self.cross_section,
                    extinction_scale: own.extinction_scale,
                    normals: *normals,
                    seed: self.seed,
                };
                let kept = cut.as_ref().map(|field| Density { field: field.as_ref(), max: 1.0 });
                let transfer = transfer.with_colors_times(1.0 / self.look.color_unit);
                let VolumeSampler::Metropolis { stride } = self.volumes_by else {
                    return Ok(Box::new(GridSampler::owning(grid, transfer, &params, kept)?));
                };
                let chains = MetropolisParams { stride, ..MetropolisParams::default() };
                Box::new(MetropolisSampler::owning(grid, transfer, &params, &chains, kept)?)
            }
            Body::Field(field) => self.field(own, field)?,
        })
    }

    fn field<'b>(&self, own: &Own, field: &'b BoundedExtinction) -> Result<Box<dyn Sampler + 'b>, pbsr::Error> {
        let extinction = Density { field, max: field.max() };
        let bounds = field.bounds();
        let cells = field.cells();
        let color = self.color(own);
        Ok(Box::new(FieldVolumeSampler::new(
            extinction,
            bounds,
            &pbsr::FieldVolumeParams { resolution: cells, cross_section: self.cross_section, color, seed: self.seed },
        )?))
    }

    /// The colour that the data's are multiplied with, in the unit of the object's colours.
    fn color(&self, own: &Own) -> [f32; 3] {
        own.color.map(|c| c / self.look.color_unit)
    }

    fn surface(&self, own: &Own) -> SurfaceParams {
        SurfaceParams {
            opacity: own.opacity,
            cross_section: self.cross_section,
            surface_opacity: self.look.material.surface_opacity,
            // Without extinction there is no particle, whatever the factor.
            extinction_factor: if own.extinction_factor > 0.0 { own.extinction_factor } else { 1.0 },
            color: self.color(own),
            opaque_optical_depth: DEEPEST,
            seed: self.seed,
        }
    }
}
