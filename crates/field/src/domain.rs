//! Meshes of zero sets end where their field's domain does ([`ScalarField::in_domain`]): triangles beyond it are left out,
//! and triangles across its border are cut along it.
//!
//! Bisection finds the border on the edges of triangles, on the assumption of one crossing between a vertex inside and a
//! vertex outside. A piece of the outside that touches no vertex is not found.

use rayon::prelude::*;
use splat_core::{
    Mesh, ScalarField,
    glam::{DVec3, Vec3},
};

/// Halvings of an edge: f32 positions know no more.
const HALVINGS: u32 = 24;

/// Cuts a mesh without colours at the border of the field's domain. One that lies inside stays as it is.
pub(crate) fn cut<F: ScalarField + ?Sized>(field: &F, mesh: Mesh) -> Mesh {
    let inside: Vec<bool> = mesh.position.par_iter().map(|p| field.in_domain(mesh.origin + p.as_dvec3())).collect();
    if inside.iter().all(|inside| *inside) {
        return mesh;
    }
    let mut part = Mesh { origin: mesh.origin, ..Mesh::default() };
    let mut index = vec![u32::MAX; inside.len()];
    for triangle in &mesh.triangles {
        let mut corners = Vec::with_capacity(4);
        for k in 0..3 {
            let a = triangle[k] as usize;
            let b = triangle[(k + 1) % 3] as usize;
            if inside[a] {
                if index[a] == u32::MAX {
                    index[a] = push(&mut part, mesh.position[a], mesh.normal[a]);
                }
                corners.push(index[a]);
            }
            if inside[a] != inside[b] {
                // From the vertex inside, whichever triangle asks: neighbours get the same place.
                let (from, to) = if inside[a] { (a, b) } else { (b, a) };
                let share = border(field, mesh.origin, mesh.position[from], mesh.position[to]);
                let normal = mesh.normal[from].lerp(mesh.normal[to], share).normalize_or_zero();
                corners.push(push(&mut part, mesh.position[from].lerp(mesh.position[to], share), normal));
            }
        }
        // One corner inside leaves a triangle, two a quadrilateral.
        for k in 2..corners.len() {
            part.triangles.push([corners[0], corners[k - 1], corners[k]]);
        }
    }
    part
}

fn push(mesh: &mut Mesh, position: Vec3, normal: Vec3) -> u32 {
    mesh.position.push(position);
    mesh.normal.push(normal);
    (mesh.position.len() - 1) as u32
}

/// The share of the way from a place inside to one outside that is inside.
fn border<F: ScalarField + ?Sized>(field: &F, origin: DVec3, from: Vec3, to: Vec3) -> f32 {
    let mut low = 0.0f32;
    let mut high = 1.0f32;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if field.in_domain(origin + from.lerp(to, middle).as_dvec3()) { low = middle } else { high = middle }
    }
    low
}
