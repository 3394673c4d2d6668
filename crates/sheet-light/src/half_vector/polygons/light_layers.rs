//! Translucent polygons in an image of a light: all that the light meets on its way, pixel by pixel (step 23 of the pseudocode for what lets light
//! through).
//!
//! As of opaque ones each keeps the plane of its triangle, so a place is compared with what lies before it at the place itself.

use super::surfaces::Polygons;
use crate::Error;
use splat_core::glam::Vec3;
use splat_core::raster::triangles::{PlacedMesh, TriangleLayer, TriangleLayers, depth_beside, resolve_layers};
use splat_core::{Camera, Progress};

/// One crossing.
#[derive(Debug, Clone, Copy)]
struct Layer {
    /// View depth.
    depth: f32,
    slope: [f32; 2],
    /// Optical depth by channel.
    optical_depth: [f32; 3],
}

/// A place beside the middle of a pixel, and how far planes are followed to it.
pub(super) struct Beside {
    /// From the middle, pixels.
    pub(super) step: [f32; 2],
    /// Most that a plane's depth may change on the way.
    pub(super) reach: f32,
    pub(super) is_parallel: bool,
}

/// Translucent polygons that one image of a light shows.
pub(super) struct LightLayers {
    layers: TriangleLayers<Layer>,
}

impl LightLayers {
    /// Those that an image shows; `None` without any. They may take `most` bytes.
    pub(super) fn new(
        panes: &[&Polygons<'_>],
        camera: &Camera,
        most: u64,
        progress: &Progress,
    ) -> Result<Option<Self>, Error> {
        if panes.is_empty() {
            return Ok(None);
        }
        let meshes: Vec<PlacedMesh<'_>> = panes.iter().map(|p| p.placed).collect();
        let none = Layer { depth: f32::INFINITY, slope: [0.0; 2], optical_depth: [0.0; 3] };
        let [right, up, forward] = camera.axes;
        let width = camera.size[0] as usize;
        let along = |k: usize| {
            let (_, along) = camera.view_ray((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
            (right * along.x + up * along.y + forward * along.z).normalize().as_vec3()
        };
        let keep = |k: usize, layer: &TriangleLayer| {
            let polygons = panes[layer.hit.mesh as usize];
            let optical_depth = polygons.crossing(&layer.hit, || along(k).dot(polygons.face(&layer.hit)));
            Layer { depth: layer.depth, slope: layer.slope, optical_depth }
        };
        let layers = resolve_layers(&meshes, camera, &[], most, none, keep, Some(progress));
        let layers = layers.map_err(Error::of_polygons)?;
        Ok(Some(Self { layers }))
    }

    /// Depth of the first crossing that a pixel shows.
    pub(super) fn first(&self, k: usize) -> Option<f32> {
        self.layers.at_pixel(k).first().map(|layer| layer.depth)
    }

    /// Share by channel that what lies before a place of this depth lets through, as pixel `k` shows it. `is_other` returns whether a depth at the
    /// pixel's middle lies before the surface that the place lies on.
    pub(super) fn through(&self, k: usize, place: &Beside, depth: f32, is_other: impl Fn(f32) -> bool) -> Vec3 {
        let Beside { step, reach, is_parallel } = *place;
        let mut sum = Vec3::ZERO;
        for layer in self.layers.at_pixel(k) {
            let there = layer.depth;
            if there - reach >= depth {
                break;
            }
            let beside = depth_beside(there, layer.slope, step, is_parallel).clamp(there - reach, there + reach);
            if beside < depth && is_other(there) {
                sum += Vec3::from(layer.optical_depth);
            }
        }
        match sum.to_array() {
            [0.0, 0.0, 0.0] => Vec3::ONE,
            [r, g, b] if r == g && g == b => Vec3::splat(libm::expf(-r)),
            channels => Vec3::from(channels.map(|tau| libm::expf(-tau))),
        }
    }

    /// Bytes of so many crossings in so many pixels.
    pub(super) fn bytes_of(pixels: u64, crossings: u64) -> u64 {
        4 * pixels + size_of::<Layer>() as u64 * crossings
    }

    /// Bytes of the lists.
    pub(super) fn bytes(&self) -> u64 {
        self.layers.bytes()
    }
}
