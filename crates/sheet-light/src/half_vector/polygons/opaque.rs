//! Opaque polygons in a picture of their own, beside slabs of any kind.

use super::light::{PolygonImage, PolygonLight};
use super::light_depth::{DepthLimits, LightDepths, side};
use super::surfaces::{EyePolygons, Polygons};
use crate::Error;
use crate::half_vector::lamps::Lamps;
use crate::half_vector::params::HalfParams;
use crate::half_vector::sampled_light::SampledLight;
use splat_core::glam::DVec3;
use splat_core::raster::OpaqueImage;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{Camera, Progress};

/// A light on opaque polygons.
#[derive(Clone, Copy)]
pub struct PolygonLamp<'a> {
    /// The light. Its shadow is that of everything but the opaque polygons that cast one; of these too where `points` is `None`.
    pub lit: LitBy<'a>,
    /// How many points stand for the same light: their z-buffers of the opaque polygons share [`HalfParams::most_light_pixels`]. `None` for a light
    /// that needs no z-buffer.
    pub points: Option<u32>,
}

/// Opaque polygons as the eye sees them.
pub struct PolygonView<'a> {
    /// The eye.
    pub camera: &'a Camera,
    /// The polygons, of which those that are translucent play no part.
    pub polygons: &'a [Polygons<'a>],
    /// The lights.
    pub lamps: &'a [PolygonLamp<'a>],
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// What positions of receivers of shadows are relative to, world.
    pub shadow_origin: DVec3,
    /// Whether the picture keeps objects.
    pub keeps_objects: bool,
}

/// Draws opaque polygons into a picture of their own. Every pixel asks the z-buffer of each light for the shadows of the polygons themselves: splats
/// that stand for them in a shadow map lie beside their edges. One tick a band of rows.
///
/// # Errors
/// [`Error::Polygons`], [`Error::Light`] or [`Error::Cancelled`].
pub fn opaque_polygons(
    view: &PolygonView<'_>,
    layout: &ChannelLayout,
    progress: Option<&Progress>,
) -> Result<OpaqueImage, Error> {
    let PolygonView { camera, polygons, lamps, ambient, shadow_origin, keeps_objects } = *view;
    polygons.iter().enumerate().try_for_each(|(index, polygons)| polygons.check(index))?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let solid: Vec<Polygons<'_>> = polygons.iter().filter(|p| p.is_opaque()).copied().collect();
    let casters: Vec<&Polygons<'_>> = polygons.iter().filter(|p| p.is_opaque() && p.casts_shadow).collect();
    let solid = EyePolygons::new(solid, camera, &[], progress)?;
    let mut image = PolygonImage::new(&solid, layout);
    let mapped: Vec<LitBy<'_>> = lamps.iter().filter(|lamp| lamp.points.is_none()).map(|lamp| lamp.lit).collect();
    let first = Lamps { carried: None, mapped: &mapped, ambient, camera, shadow_origin, light_alone: false };
    PolygonLight::new(&solid.seen, camera, None).shade(&first, None, &mut image);
    let places = solid.seen.places(camera);
    for PolygonLamp { lit, points } in lamps {
        let Some(points) = points else { continue };
        let most_pixels = side(HalfParams::default().most_light_pixels, *points);
        let light = SampledLight { light: &lit.light, samples: 1 };
        let limits = DepthLimits { most_pixels, most_bytes: 0 };
        let depths = LightDepths::new(&casters, light, &places, limits, progress)?;
        let lamps = Lamps { carried: Some(*lit), mapped: &[], ambient, camera, shadow_origin, light_alone: true };
        PolygonLight::new(&solid.seen, camera, depths.as_ref()).shade(&lamps, None, &mut image);
    }
    Ok(image.finish(&solid, keeps_objects))
}
