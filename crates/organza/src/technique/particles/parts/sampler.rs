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
        native: &'a Own,
        warnings: &mut Vec<String>,
    ) -> Result<Box<dyn Sampler + 'a>, pbsr::Error> {
        let bare = self.bare(native, warnings)?;
        let Some((field, opacity)) = &native.field else { return Ok(bare) };
        let unit = self.look.color_unit;
        let shown = move |place| field.at(place, *opacity).map(|look| (look.color.map(|c| c / unit), look.depth_share));
        Ok(Box::new(ShownSampler::new(bare, Box::new(shown), self.seed)))
    }

    /// The same without a field that it shows.
    fn bare(&self, native: &'a Own, warnings: &mut Vec<String>) -> Result<Box<dyn Sampler + 'a>, pbsr::Error> {
        let named = |warning: String| format!("object '{}': {warning}", crate::shown(&self.name));
        Ok(match &native.body {
            Body::Surface { field, inside, spacing, step } => {
                let bounds = native.bounds;
                let surface = ImplicitSurface { field: field.as_ref(), level: 0.0, bounds, inside: Some(inside) };
                let width = bounds.size().max_element();
                let lines = LineParams::for_spacing(width, *spacing);
                if let Some(step) = step {
                    let paper = BrownianParams::for_width(width);
                    let walk = BrownianParams { step: step * width, resolution: lines.resolution, ..paper };
                    let sampler = BrownianSampler::new(&surface, &walk, &self.surface(native))?;
                    warnings.extend(sampler.report().warning().map(named));
                    return Ok(Box::new(sampler));
                }
                let sampler = LineSampler::new(&surface, &lines, &self.surface(native), None)?;
                warnings.extend(sampler.report().warnings().map(named));
                Box::new(sampler)
            }
            Body::Lattice { grid, interpolation, level } => {
                Box::new(LatticeSampler::new(grid, *interpolation, *level, &self.surface(native))?)
            }
            Body::Triangles(mesh) => Box::new(MeshSampler::new(mesh, &self.surface(native), None)?),
            Body::Cells { grid, transfer, normals, cut, .. } => {
                let params = VolumeParams {
                    cross_section: self.cross_section,
                    extinction_scale: native.extinction_scale,
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
            Body::Field(field) => self.field(native, field)?,
        })
    }

    fn field<'b>(&self, native: &Own, field: &'b BoundedExtinction) -> Result<Box<dyn Sampler + 'b>, pbsr::Error> {
        let extinction = Density { field, max: field.max() };
        let bounds = field.bounds();
        let cells = field.cells();
        let color = self.color(native);
        Ok(Box::new(FieldVolumeSampler::new(
            extinction,
            bounds,
            &pbsr::FieldVolumeParams { resolution: cells, cross_section: self.cross_section, color, seed: self.seed },
        )?))
    }

    /// The colour that the data's are multiplied with, in the unit of the object's colours.
    fn color(&self, native: &Own) -> [f32; 3] {
        native.color.map(|c| c / self.look.color_unit)
    }

    fn surface(&self, native: &Own) -> SurfaceParams {
        SurfaceParams {
            opacity: native.opacity,
            cross_section: self.cross_section,
            surface_opacity: self.look.material.surface_opacity,
            // Without extinction there is no particle, whatever the factor.
            extinction_factor: if native.extinction_factor > 0.0 { native.extinction_factor } else { 1.0 },
            color: self.color(native),
            opaque_optical_depth: DEEPEST,
            seed: self.seed,
        }
    }
}
