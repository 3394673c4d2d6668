//! Opacities of vertices, as far as a file means them.

use crate::Notes;
use splat_core::Mesh;

/// What is said of a file all of whose opacities are 0.
const ALL_CLEAR: &str = "its opacities are 0 everywhere, which would leave nothing to see: they are not used";

/// Opacities that are used: none where all are 1, and none, with a remark, where all are 0, as programs write that fill no alpha.
pub(crate) fn meant(opacity: Vec<f32>, notes: &mut Notes) -> Vec<f32> {
    if !opacity.is_empty() && opacity.iter().all(|share| *share == 0.0) {
        notes.remark(ALL_CLEAR);
        return Vec::new();
    }
    if opacity.iter().all(|share| *share == 1.0) { Vec::new() } else { opacity }
}

/// Gives the vertices of a mesh the opacities that are used.
pub(crate) fn give(mesh: &mut Mesh, opacity: Vec<f32>, notes: &mut Notes) {
    mesh.opacity = meant(opacity, notes);
}
