//! Facts of meshes: cheap, and known before anything is converted.

use super::context::Context;
use super::loading::Loading;
use crate::Error;
use crate::scene::{Scene, SceneObject, Source, SourceData};
use crate::statistics::MeshFacts;
use convert::cost::usual_spacing;
use glam::DVec3;
use splat_core::{Mesh, optics, vertex_normals};
use std::borrow::Cow;

/// Triangles and vertices that are looked at, of more every nth.
const FEW: usize = 1 << 16;
/// Discs on the area of a square whose side is their spacing: triangles are cut into whole pieces.
const PIECES_OF_A_SQUARE: f64 = 2.0;

/// The facts of all visible meshes in files or in memory, in the order of the scene.
///
/// # Errors
/// Those of reading their files.
pub(crate) fn mesh_facts(scene: &Scene, context: Context<'_>) -> Result<Vec<MeshFacts>, Error> {
    let loading = Loading { scene, context };
    let mut facts = Vec::new();
    for (rank, object) in loading.visible() {
        let Source::Mesh(path) = &object.source else { continue };
        let data = loading.context(rank, 0, 0).read(path).map_err(|e| loading.named(object, e))?;
        // What is no mesh is refused where it is converted.
        let (SourceData::Mesh(mesh) | SourceData::Painted(mesh, _)) = data else { continue };
        let spacing = object.spacing.or_else(|| {
            let splat = loading.context(rank, 0, 0).splat_params(object);
            usual_spacing(&mesh, mesh.triangles.len() as u64, &splat)
        });
        facts.push(looked_at(rank, object, &mesh, scene.opacity_of(object), spacing));
    }
    Ok(facts)
}

/// The facts of a mesh whose discs have this spacing, world units; `None` for a mesh without area.
fn looked_at(object: usize, scene_object: &SceneObject, mesh: &Mesh, opacity: f64, spacing: Option<f64>) -> MeshFacts {
    let vertices = mesh.opacity.iter().step_by(mesh.opacity.len().div_ceil(FEW).max(1));
    let even = mesh.opacity.is_empty().then_some(1.0f32);
    let opacities = even.into_iter().chain(vertices.copied()).map(|of_vertex| opacity * f64::from(of_vertex));
    let is_translucent = opacity * f64::from(mesh.least_opacity()) < 1.0;
    let sensitivity = opacities.map(sensitivity).fold(0.0, f64::max);
    let area = mesh.area() * scene_object.transform.scale.powi(2);
    let pieces = spacing.map_or(0.0, |spacing| PIECES_OF_A_SQUARE * area / spacing.powi(2));
    MeshFacts {
        object,
        is_translucent,
        stays_triangles: scene_object.footprints.is_usual() && scene_object.field.is_none(),
        splats: pieces.max(mesh.triangles.len() as f64),
        sensitivity,
        // Of what is opaque or clear nobody asks.
        bend: if sensitivity > 0.0 { bend(mesh) } else { 0.0 },
    }
}

/// How much the transmittance of one crossing changes with the logarithm of its optical depth: τ·e^−τ.
fn sensitivity(opacity: f64) -> f64 {
    if opacity <= 0.0 || opacity >= 1.0 { 0.0 } else { optics::optical_depth(opacity) * (1.0 - opacity) }
}

/// The sine of the angle between neighbouring triangles, root mean square over their area: a normal at a vertex leans from each triangle around it
/// by about as much over √2.
fn bend(mesh: &Mesh) -> f64 {
    let normals = if mesh.normal.is_empty() { Cow::Owned(vertex_normals(mesh)) } else { Cow::Borrowed(&mesh.normal) };
    let mut area = 0.0;
    let mut square = 0.0;
    for triangle in mesh.triangles.iter().step_by(mesh.triangles.len().div_ceil(FEW).max(1)) {
        let [a, b, c] = triangle.map(|v| mesh.position[v as usize].as_dvec3());
        let cross = splat_core::robust_cross(b - a, c - a);
        let plane: DVec3 = cross.normalize_or_zero();
        let leaning = |v: u32| plane.cross(normals[v as usize].as_dvec3()).length_squared();
        square += cross.length() * triangle.iter().map(|v| leaning(*v)).sum::<f64>() / 3.0;
        area += cross.length();
    }
    if area > 0.0 { (2.0 * square / area).sqrt().min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A prism of `sides` sides around the y-axis, without its ends.
    fn prism(sides: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for k in 0..sides {
            let angle = std::f32::consts::TAU * k as f32 / sides as f32;
            let around = Vec3::new(libm::cosf(angle), 0.0, libm::sinf(angle));
            mesh.position.extend([around, around + Vec3::Y]);
            let next = 2 * ((k + 1) % sides);
            mesh.triangles.extend([[2 * k, 2 * k + 1, next], [next, 2 * k + 1, next + 1]]);
        }
        mesh
    }

    #[test]
    fn a_prism_bends_by_the_angle_of_its_sides() {
        for sides in [12, 24, 96] {
            let angle = std::f64::consts::TAU / f64::from(sides);
            // A normal at a vertex halves the angle between two sides.
            let expected = std::f64::consts::SQRT_2 * (0.5 * angle).sin();
            let found = bend(&prism(sides));
            assert!((found / expected - 1.0).abs() < 1e-3, "{sides} sides: {found}, not {expected}");
        }
    }

    #[test]
    fn a_plane_does_not_bend_and_what_is_opaque_or_clear_has_no_sensitivity() {
        let plane = Mesh {
            position: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        assert_eq!(bend(&plane), 0.0);
        assert_eq!([0.0, 1.0].map(sensitivity), [0.0; 2]);
        // τ·e^−τ is greatest, 1/e, where τ = 1.
        assert!((sensitivity(1.0 - (-1.0f64).exp()) - (-1.0f64).exp()).abs() < 1e-12);
    }
}
