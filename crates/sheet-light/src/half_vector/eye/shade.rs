//! Radiance of a point of a volume under the light of one sweep (step 19 of the pseudocode).

use crate::Volume;
use crate::half_vector::geometry::Geometry;
use crate::half_vector::lighting::Lighting;
use crate::half_vector::scatter::surface::Facet;
use crate::half_vector::scatter::{Seen, medium};
use crate::shared::pixel::Pixel;
use splat_core::Shading;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::lanes::MAX_LANES;
use splat_core::shade::{Point, Radiance, arriving};

/// A point of a volume that is lit.
pub(crate) struct Lit<'a> {
    pub(crate) volume: &'a Volume<'a>,
    /// Cutoff radius of the kernels, world units.
    pub(crate) radius: f32,
    pub(crate) color: [f32; 3],
    /// As gradients have it, or zero.
    pub(crate) normal: Vec3,
    /// Share of the light of the sweep that volumes and splats let through.
    pub(crate) arrives: [f32; 3],
    /// Share of each light that all else lets through, of neighbouring pixels, of which this is one; nothing where nothing else casts
    /// shadows.
    pub(crate) others: &'a [Through],
    pub(crate) lane: usize,
}

/// Transmittance by channel of neighbouring pixels.
pub(crate) type Through = [[f32; MAX_LANES]; 3];

impl Lit<'_> {
    /// Radiance of the point at these slab coordinates towards the eye of a pixel.
    pub(crate) fn radiance(
        &self,
        geometry: &Geometry<'_>,
        lighting: &Lighting<'_>,
        pixel: Pixel,
        place: DVec3,
    ) -> Radiance {
        let position = if lighting.is_lit_by_place { geometry.frame.world(place) } else { DVec3::ZERO };
        let point = Point {
            position,
            radius: self.radius,
            normal: self.normal,
            to_eye: geometry.to_eye(pixel),
            color: self.color,
            material: self.volume.material,
        };
        let mut radiance =
            point.radiance(lighting.ambient, lighting.light.iter().chain(lighting.mapped), |rank, irradiance| {
                // The light of the sweep comes first.
                let carried = if rank == 0 && lighting.light.is_some() { self.arrives } else { [1.0; 3] };
                let shadow = || {
                    let others = self.others.get(rank);
                    [0, 1, 2].map(|c| carried[c] * others.map_or(1.0, |through| through[c][self.lane]))
                };
                arriving(irradiance, self.volume.shadow_coefficient, Some(shadow))
            });
        if lighting.light_alone {
            (radiance.ambient, radiance.emission) = ([0.0; 3], [0.0; 3]);
        }
        radiance
    }

    /// What the point shows of light that is scattered more than once, where that is simulated: scattered once more by a medium, reflected about the
    /// gradient by one that has it.
    pub(crate) fn scattered(
        &self,
        geometry: &Geometry<'_>,
        lighting: &Lighting<'_>,
        pixel: Pixel,
        place: DVec3,
    ) -> Option<[f32; 3]> {
        let scattered = lighting.scattered.as_ref()?;
        let light = &lighting.light.as_ref()?.light;
        let world = geometry.frame.world(place);
        if reflects(self.volume) {
            let surfaces = scattered.at_surfaces.as_ref()?;
            let facet = Facet { material: self.volume.material, color: self.color };
            return Some(surfaces.reflected(world, self.normal.as_dvec3(), &facet, light));
        }
        if !medium::scatters(self.volume) {
            return None;
        }
        let seen = Seen { world, to_eye: geometry.to_eye(pixel), color: self.color };
        Some(scattered.radiance(self.volume, light, &seen))
    }
}

/// Whether a volume asks for light at all.
pub(crate) fn is_lit(volume: &Volume<'_>) -> bool {
    volume.material.shading != Shading::Unlit
}

/// Whether a volume reflects light about its gradient.
pub(crate) fn reflects(volume: &Volume<'_>) -> bool {
    volume.normals && volume.material.shading == Shading::Phong
}
