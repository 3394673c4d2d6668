//! What lists of translucent polygons will take, before any is made.

use super::light_depth::side;
use super::light_layers::LightLayers;
use super::light_views::views;
use super::surfaces::bytes_of_a_pane;
use crate::half_vector::sampled_light::SampledLight;
use crate::half_vector::slicing::bodies::Bodies;
use splat_core::glam::DVec3;
use splat_core::raster::triangles::{PlacedMesh, count_layers};
use splat_core::shade::ChannelLayout;
use splat_core::{Camera, DAabb};

/// How many times coarser an image of a light is in which places are counted, along each side.
const COARSER: u32 = 8;

/// Bytes of the lists of the eye: what they take where nothing opaque hides any of the polygons, and no more where something does. 0 for meshes that are
/// refused when they are drawn.
pub fn pane_bytes(panes: &[PlacedMesh<'_>], camera: &Camera, layout: &ChannelLayout) -> u64 {
    if panes.is_empty() {
        return 0;
    }
    let pixels: u64 = camera.size.into_iter().map(u64::from).product();
    4 * (pixels + 1) + bytes_of_a_pane(layout) * count_layers(panes, camera).unwrap_or(0)
}

/// Bytes of the lists of a light, about: what they take in images that show all of the polygons and of what else receives
/// light. Where a picture shows a part of them the images of a light do, too; they have as many pixels, but more or fewer polygons a pixel.
pub fn light_list_bytes(
    panes: &[PlacedMesh<'_>],
    bodies: &Bodies<'_>,
    light: SampledLight<'_>,
    most_pixels: u32,
) -> u64 {
    let corners = panes.iter().flat_map(|PlacedMesh { mesh, transform }| {
        mesh.position.iter().map(|p| transform.apply(mesh.origin + p.as_dvec3()))
    });
    let receivers: Vec<DVec3> = corners.chain(bodies.corners()).collect();
    if panes.is_empty() || receivers.is_empty() {
        return 0;
    }
    let bounds = DAabb::of_points(receivers.iter().copied());
    let middle = bounds.min + 0.5 * (bounds.max - bounds.min);
    let side = (side(most_pixels, light.samples) / COARSER).max(1);
    let point = light.points(light.light.intensity).into_iter().next().unwrap_or(*light.light);
    let cameras = views(&point, middle, panes, &receivers, side).unwrap_or_default();
    let bytes_of = |camera: &Camera| {
        let pixels: u64 = camera.size.into_iter().map(u64::from).product();
        LightLayers::bytes_of(pixels, count_layers(panes, camera).unwrap_or(0))
    };
    u64::from(light.samples) * u64::from(COARSER).pow(2) * cameras.iter().map(bytes_of).sum::<u64>()
}
