//! What the eye sees of polygons: opaque ones, and translucent ones before them.

use super::light_depth::{DepthLimits, LightDepths};
use super::surfaces::{EyePanes, EyePolygons, Polygons};
use crate::Error;
use crate::half_vector::input::HalfInput;
use crate::half_vector::memory::needed;
use crate::half_vector::params::HalfParams;
use crate::half_vector::sampled_light::CarriedLight;
use splat_core::glam::DVec3;
use splat_core::shade::ChannelLayout;
use splat_core::{Camera, Progress};

/// What the eye sees of polygons.
pub(crate) struct Eye<'a> {
    polygons: &'a [Polygons<'a>],
    /// Opaque ones.
    pub(crate) solid: Option<EyePolygons<'a>>,
    /// Translucent ones.
    pub(crate) panes: Option<EyePanes<'a>>,
}

impl<'a> Eye<'a> {
    /// That of an input, whose lists of translucent polygons may take `most` bytes.
    pub(crate) fn new(
        input: &HalfInput<'a>,
        most: u64,
        layout: &ChannelLayout,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let those =
            |opaque: bool| input.polygons.iter().filter(|p| p.is_opaque() == opaque).copied().collect::<Vec<_>>();
        let solid = those(true);
        let panes = those(false);
        let camera = input.sheets.camera;
        let solid = match solid.is_empty() {
            true => None,
            false => Some(EyePolygons::new(solid, camera, input.opaque, progress)?),
        };
        let panes = match panes.is_empty() {
            true => None,
            false => {
                let opaque = solid.as_ref().map_or(input.opaque, |solid| &solid.opaque);
                Some(EyePanes::new(panes, camera, opaque, most, layout, progress)?)
            }
        };
        Ok(Self { polygons: input.polygons, solid, panes })
    }

    /// Whether any asks for light.
    pub(crate) fn are_lit(&self) -> bool {
        self.polygons.iter().any(Polygons::is_lit)
    }

    /// Those that cast shadows.
    pub(crate) fn casters(&self) -> Vec<&'a Polygons<'a>> {
        self.polygons.iter().filter(|p| p.casts_shadow).collect()
    }

    /// All places that are seen of them; world.
    pub(crate) fn places(&self, camera: &Camera) -> Vec<DVec3> {
        let surfaces = self.solid.iter().map(|solid| &solid.seen).chain(self.panes.iter().map(|panes| &panes.seen));
        surfaces.flat_map(|seen| seen.places(camera)).collect()
    }

    /// What the points of a light see of the polygons that cast shadows, for all that receives its light; `None` where there is no light
    /// or no such polygon.
    pub(crate) fn light_depths(
        &self,
        input: &HalfInput<'_>,
        params: &HalfParams,
        light: Option<CarriedLight<'_>>,
        progress: &Progress,
    ) -> Result<Option<LightDepths>, Error> {
        let casters = self.casters();
        let Some(light) = light.filter(|_| !casters.is_empty()) else {
            return Ok(None);
        };
        let mut receivers = self.places(input.sheets.camera);
        receivers.extend(input.bodies().corners());
        let taken = needed(input, params) + self.panes.as_ref().map_or(0, EyePanes::bytes);
        let limits = DepthLimits {
            most_pixels: params.most_light_pixels,
            most_bytes: params.sheets.limits.max_bytes.saturating_sub(taken),
        };
        LightDepths::new(&casters, light.sampled(), &receivers, limits, progress)
    }
}
