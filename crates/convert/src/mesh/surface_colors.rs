//! Colours that lie between the vertices of a mesh, as those of a texture do.

use splat_core::glam::Vec2;

/// Colours of the parts of a mesh's triangles.
pub trait SurfaceColors: Sync {
    /// Fills `colors` with linear colours of parts of the triangle of rank `triangle`. Each part has its place by its `weights` of the second and
    /// third corner, and `share` of the triangle's area, over which its colour is averaged.
    fn fill(&self, triangle: usize, share: f64, weights: &mut dyn Iterator<Item = Vec2>, colors: &mut [[f32; 3]]);
}
