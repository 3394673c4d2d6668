//! The light of one sweep: what it is, how it is carried, and what it is scattered to.

use super::geometry::Geometry;
use super::input::HalfInput;
use super::lamps::Lamps;
use super::light::camera::camera_of;
use super::params::HalfParams;
use super::sampled_light::CarriedLight;
use super::scatter;
use super::scatter::Scattered;
use crate::half_vector::light::buffer::{LightBuffer, planes};
use crate::half_vector::light::illuminate::Illumination;
use crate::half_vector::light::path::LightPath;
use crate::half_vector::polygons::light_depth::{LightDepths, ShadowOfAll};
use crate::half_vector::scatter::scene::Scene;
use crate::half_vector::scatter::surface::SurfaceLight;
use crate::half_vector::slicing::slab_place::SlabPlace;
use crate::half_vector::soft::penumbra::Penumbra;
use crate::half_vector::splats::light::SplatLight;
use splat_core::shade::LitBy;
use splat_core::{Light, LightShape, Transmittance};

/// The light of a sweep.
pub(crate) struct Lighting<'a> {
    /// `None` for ambient and emitted light alone. One with an extent gives at its centre what all its points give.
    pub(crate) light: Option<LitBy<'a>>,
    /// Lights that the sweep adds without carrying them.
    pub(crate) mapped: &'a [LitBy<'a>],
    pub(crate) ambient: [f32; 3],
    /// Whether ambient and emitted light belong to another sweep.
    pub(crate) light_alone: bool,
    /// Whether light depends on where a point is.
    pub(crate) is_lit_by_place: bool,
    pub(crate) buffer: Option<LightBuffer>,
    /// Ways of the light, by volume.
    pub(crate) paths: Vec<LightPath>,
    /// Polygons that keep the light from others.
    pub(crate) depths: Option<LightDepths>,
    /// Light that is scattered more than once, where it is asked for.
    pub(crate) scattered: Option<Scattered>,
}

impl<'a> Lighting<'a> {
    /// The light that is carried, and those that are mapped; without polygons in its way, and scattered once.
    pub(crate) fn new(
        input: &HalfInput<'_>,
        params: &HalfParams,
        geometry: &Geometry<'_>,
        carried: Option<CarriedLight<'a>>,
        mapped: &'a [LitBy<'a>],
        light_alone: bool,
    ) -> Self {
        let by_place = |lit: &LitBy<'_>| {
            let is_parallel = matches!(lit.light.shape, LightShape::Directional { .. });
            lit.shadow.is_some() || lit.slide.is_some() || !is_parallel
        };
        let buffer = carried.map(|carried| light_buffer(input, params, geometry, carried));
        let gain = buffer.as_ref().and_then(|b| b.soft.as_ref()).map_or(1.0, |soft| soft.penumbra.gain);
        let light = carried.map(|carried| LitBy { light: brighter(&carried.lit.light, gain), ..*carried.lit });
        let path =
            |lit: &LitBy<'_>| geometry.volumes.iter().map(|v| LightPath::new(v, &lit.light, &geometry.frame)).collect();
        Self {
            light,
            mapped,
            ambient: input.sheets.ambient,
            light_alone,
            is_lit_by_place: light.iter().chain(mapped).any(by_place),
            buffer,
            paths: light.as_ref().map_or_else(Vec::new, path),
            depths: None,
            scattered: None,
        }
    }

    /// Light that is scattered more than once, where it is asked for: polygons and what casts shadows keep it off.
    pub(crate) fn scatter(
        &self,
        input: &HalfInput<'_>,
        params: &HalfParams,
        lights_surfaces: bool,
    ) -> Option<Scattered> {
        let volumes = &input.sheets.volumes[..];
        let lit = self.light.as_ref().filter(|lit| scatter::is_wanted(volumes, &lit.light, params))?;
        let origin = input.sheets.shadow_origin;
        let of_all = self.depths.as_ref().map(|depths| ShadowOfAll { depths, others: lit.shadow, origin });
        let shadow = of_all.as_ref().map(|shadow| shadow as &dyn Transmittance).or(lit.shadow);
        let splats = input.splats.as_ref().filter(|splats| !splats.cloud.is_empty());
        let scene = Scene::new(volumes, splats, &LitBy { shadow, ..*lit }, params, origin);
        Some(Scattered::new(&scene, params.scattering, lights_surfaces))
    }

    /// Light that is scattered to surfaces.
    pub(crate) fn at_surfaces(&self) -> Option<&SurfaceLight> {
        self.scattered.as_ref().and_then(|scattered| scattered.at_surfaces.as_ref())
    }

    /// The lights, for splats and polygons.
    pub(crate) fn lamps(&self, input: &HalfInput<'a>) -> Lamps<'a> {
        Lamps {
            carried: self.light,
            mapped: self.mapped,
            ambient: self.ambient,
            camera: input.sheets.camera,
            shadow_origin: input.sheets.shadow_origin,
            light_alone: self.light_alone,
        }
    }

    /// The light as it arrives at a slab, behind splats and among them; `None` where none is carried.
    pub(crate) fn illumination<'b>(
        &'b self,
        geometry: &'b Geometry<'_>,
        place: SlabPlace,
        splats: Option<&'b SplatLight<'b>>,
    ) -> Option<Illumination<'b>> {
        let slabs = &geometry.frame.slabs;
        let buffer = self.buffer.as_ref()?;
        Some(Illumination {
            buffer,
            paths: &self.paths,
            volumes: geometry.volumes,
            splats,
            face: slabs.face(place.index(slabs)),
            width: slabs.width as f32,
        })
    }
}

/// The light's image, and those of its points where it has an extent.
fn light_buffer(
    input: &HalfInput<'_>,
    params: &HalfParams,
    geometry: &Geometry<'_>,
    carried: CarriedLight<'_>,
) -> LightBuffer {
    let Geometry { frame, volumes, placed, .. } = geometry;
    let bodies = &input.bodies();
    let camera = camera_of(bodies, &carried.lit.light, params);
    let mut buffer = LightBuffer::new(frame, camera, volumes, placed);
    if let Some(penumbra) = Penumbra::new(frame, bodies, carried.sampled(), &camera, params.most_light_pixels) {
        buffer.soften(penumbra, planes(volumes, input.splats.as_ref()));
    }
    buffer
}

fn brighter(light: &Light, gain: f64) -> Light {
    Light { intensity: light.intensity.map(|i| (f64::from(i) * gain) as f32), ..*light }
}
