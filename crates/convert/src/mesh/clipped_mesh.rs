//! Meshes cut along half-spaces and boxes: triangles that cross a border are divided there.

use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Clip, Mesh, vertex_normals};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The part of a mesh that lies in all of the regions. The mesh ends open at their borders, without a lid. New corners lie on the edges
/// of triangles, in f64 until they are stored. Triangles that meet there get the same place, whether they share vertices or have
/// coinciding ones. Normals and colours are interpolated. A mesh without normals gets smooth ones, so that the cut does not change how it
/// is shaded. Without regions the mesh is the same one.
///
/// ```
/// use splat_core::{Clip, Mesh, glam::DVec3};
/// use convert::clipped_mesh;
/// let square = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
/// let half = clipped_mesh(square.into(), &[Clip::HalfSpace { normal: DVec3::X, offset: 0.25 }]);
/// assert_eq!(half.area(), 2.5);
/// ```
///
/// # Panics
/// If an index is out of range; see [`Mesh::validate`].
pub fn clipped_mesh(mesh: Arc<Mesh>, clips: &[Clip]) -> Arc<Mesh> {
    clipped_by(mesh, clips, |mesh, normal, offset| cut(mesh, normal, offset, None))
}

/// A mesh cut by one half-space after the other, whose normals are known before.
pub(crate) fn clipped_by(mesh: Arc<Mesh>, clips: &[Clip], mut cut: impl FnMut(Mesh, DVec3, f64) -> Mesh) -> Arc<Mesh> {
    if clips.is_empty() {
        return mesh;
    }
    let mut whole = Arc::unwrap_or_clone(mesh);
    if whole.normal.is_empty() {
        whole.normal = vertex_normals(&whole);
    }
    clips.iter().flat_map(Clip::half_spaces).fold(whole, |mesh, (normal, offset)| cut(mesh, normal, offset)).into()
}

/// A vertex on the border of a half-space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rim {
    /// Its index.
    pub(crate) vertex: u32,
    /// Where it is relative to the mesh's origin, before that was rounded.
    pub(crate) place: DVec3,
}

/// The part where normal·p ≤ offset. With `rims` it is that of a body: of triangles in the border itself those are kept that it ends at,
/// and edges along the border are told, each as often as a triangle has it, in the triangle's direction.
pub(crate) fn cut(mesh: Mesh, normal: DVec3, offset: f64, mut rims: Option<&mut Vec<[Rim; 2]>>) -> Mesh {
    let base = normal.dot(mesh.origin) - offset;
    let beyond: Vec<f64> = mesh.position.par_iter().map(|p| normal.dot(p.as_dvec3()) + base).collect();
    if beyond.iter().all(|beyond| *beyond <= 0.0) {
        return mesh;
    }
    let kept = Mesh { origin: mesh.origin, ..Mesh::default() };
    let mut part = Part { mesh: kept, whole: &mesh, known: BTreeMap::new(), border: (normal, -base) };
    for triangle in &mesh.triangles {
        let is_in_border = || triangle.iter().all(|v| beyond[*v as usize] == 0.0);
        if rims.is_some() && is_in_border() && part.facing(*triangle).dot(normal) <= 0.0 {
            continue;
        }
        let mut corners = Vec::with_capacity(4);
        for k in 0..3 {
            let a = triangle[k];
            let b = triangle[(k + 1) % 3];
            let [from_a, from_b] = [a, b].map(|v| beyond[v as usize]);
            if from_a <= 0.0 {
                let (vertex, place) = part.corner([a, a], 0.0);
                corners.push((vertex, (from_a == 0.0).then_some(place)));
            }
            // A corner on the border is a corner already.
            if from_a < 0.0 && from_b > 0.0 || from_a > 0.0 && from_b < 0.0 {
                // From the lower place on, whichever triangle asks: neighbours get the same corner.
                let is_first = part.at(a).to_array() < part.at(b).to_array();
                let (edge, share) =
                    if is_first { ([a, b], from_a / (from_a - from_b)) } else { ([b, a], from_b / (from_b - from_a)) };
                let (vertex, place) = part.corner(edge, share);
                corners.push((vertex, Some(place)));
            }
        }
        if corners.len() < 3 {
            continue;
        }
        // One corner inside leaves a triangle, two a quadrilateral.
        part.mesh.triangles.extend((2..corners.len()).map(|k| [corners[0].0, corners[k - 1].0, corners[k].0]));
        if let Some(rims) = &mut rims {
            let rim = |(vertex, place): (u32, Option<DVec3>)| Some(Rim { vertex, place: place? });
            let edges = (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]);
            rims.extend(edges.filter_map(|[a, b]| Some([rim(a)?, rim(b)?])));
        }
    }
    part.mesh
}

/// What is kept, while it is collected.
struct Part<'a> {
    mesh: Mesh,
    whole: &'a Mesh,
    /// Corners that it has, by the ends of the edges that they lie on; of a vertex both are itself.
    known: BTreeMap<[u32; 2], u32>,
    /// The normal of the border, and its product with places there, relative to the mesh's origin.
    border: (DVec3, f64),
}

impl Part<'_> {
    /// Where a vertex of the whole is.
    fn at(&self, vertex: u32) -> Vec3 {
        self.whole.position[vertex as usize]
    }

    /// Where the front of a triangle of the whole points.
    fn facing(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|v| self.at(v).as_dvec3());
        (b - a).cross(c - a)
    }

    /// Index of the corner at a share of an edge, and its place before that is rounded.
    fn corner(&mut self, edge: [u32; 2], share: f64) -> (u32, DVec3) {
        let [a, b] = edge.map(|v| v as usize);
        let Self { mesh, whole, known, border } = self;
        let mut place = whole.position[a].as_dvec3().lerp(whole.position[b].as_dvec3(), share);
        if a != b {
            // Exactly in the border, so that corners which differ in nothing else are one place.
            let (normal, offset) = *border;
            let axis = normal.abs().max_position();
            place[axis] = 0.0;
            place[axis] = (offset - normal.dot(place)) / normal[axis];
        }
        let vertex = *known.entry(edge).or_insert_with(|| {
            let between = |a: Vec3, b: Vec3| a.as_dvec3().lerp(b.as_dvec3(), share).as_vec3();
            mesh.position.push(place.as_vec3());
            let normal = between(whole.normal[a], whole.normal[b]);
            mesh.normal.push(if a == b { normal } else { normal.normalize_or_zero() });
            if !whole.opacity.is_empty() {
                let [here, there] = [whole.opacity[a], whole.opacity[b]].map(f64::from);
                mesh.opacity.push((here + (there - here) * share).clamp(0.0, 1.0) as f32);
            }
            if !whole.color.is_empty() {
                mesh.color.push(between(whole.color[a].into(), whole.color[b].into()).to_array());
            }
            (mesh.position.len() - 1) as u32
        });
        (vertex, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::DAabb;

    fn clipped(mesh: &Mesh, clips: &[Clip]) -> Mesh {
        Arc::unwrap_or_clone(clipped_mesh(mesh.clone().into(), clips))
    }

    /// A ball of triangles with corners on a sphere of radius 1: rings of equal height.
    fn ball(rings: usize, at: DVec3) -> Mesh {
        let around = 2 * rings;
        let place = |i: usize, k: usize| {
            let theta = std::f64::consts::PI * i as f64 / rings as f64;
            let phi = std::f64::consts::TAU * k as f64 / around as f64;
            DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()).as_vec3()
        };
        let position = (0..=rings).flat_map(|i| (0..around).map(move |k| place(i, k))).collect();
        let v = |i: usize, k: usize| (i * around + k % around) as u32;
        let squares = (0..rings).flat_map(|i| (0..around).map(move |k| (i, k)));
        let triangles = squares
            .flat_map(|(i, k)| [[v(i, k), v(i + 1, k + 1), v(i + 1, k)], [v(i, k), v(i, k + 1), v(i + 1, k + 1)]]);
        Mesh { origin: at, position, triangles: triangles.collect(), ..Mesh::default() }
    }

    #[test]
    fn a_ball_s_caps_have_the_area_of_archimedes() {
        // 2πh of a cap of height h; the polyhedron is smaller by the square of its edges.
        for height in [0.3, 1.0, 1.7] {
            let cap = clipped(
                &ball(96, DVec3::ZERO),
                &[Clip::HalfSpace { normal: DVec3::new(0.6, 0.0, 0.8), offset: height - 1.0 }],
            );
            let expected = std::f64::consts::TAU * height;
            assert!((cap.area() - expected).abs() < 2e-3 * expected, "{height}: {}", cap.area());
            assert!(cap.validate().is_ok());
        }
    }

    #[test]
    fn parts_on_both_sides_add_up_and_share_their_border_exactly() {
        let ball = ball(24, DVec3::new(1e7, -3e6, 5.0));
        let plane = DVec3::new(0.48, 0.6, 0.64);
        let offset = plane.dot(ball.origin) + 0.2;
        let inside = clipped(&ball, &[Clip::HalfSpace { normal: plane, offset }]);
        let outside = clipped(&ball, &[Clip::HalfSpace { normal: -plane, offset: -offset }]);
        assert!((inside.area() + outside.area() - ball.area()).abs() < 1e-6);
        let border = |mesh: &Mesh| {
            let on = |p: &&Vec3| (plane.dot(mesh.origin + p.as_dvec3()) - offset).abs() < 1e-6;
            let mut found: Vec<[u32; 3]> =
                mesh.position.iter().filter(on).map(|p| p.to_array().map(f32::to_bits)).collect();
            found.sort_unstable();
            found
        };
        assert!(border(&inside).len() > 40);
        assert_eq!(border(&inside), border(&outside));
    }

    #[test]
    fn a_shift_and_a_power_of_two_change_no_bit_but_the_scale() {
        let at = DVec3::new(1e7, 0.0, -1e7);
        let half = |mesh: &Mesh, place: f64| clipped(mesh, &[Clip::HalfSpace { normal: DVec3::X, offset: place }]);
        let near = half(&ball(8, DVec3::ZERO), 0.375);
        let far = half(&ball(8, at), at.x + 0.375);
        assert_eq!((&near.position, &near.triangles), (&far.position, &far.triangles));
        let mut large = ball(8, DVec3::ZERO);
        large.position.iter_mut().for_each(|p| *p *= 1024.0);
        let large = half(&large, 384.0);
        assert_eq!(large.position, near.position.iter().map(|p| *p * 1024.0).collect::<Vec<_>>());
    }

    #[test]
    fn a_box_keeps_what_lies_within_and_colours_go_on_to_its_border() {
        let mut square = Mesh::rectangle(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0);
        square.color = square.position.iter().map(|p| [p.x + 2.0, 0.0, p.y + 2.0]).collect();
        let window = Clip::Box(DAabb::new(DVec3::new(-1.0, -0.5, -1.0), DVec3::new(0.5, 1.5, 1.0)));
        let seen = clipped(&square, &[window]);
        assert!((seen.area() - 3.0).abs() < 1e-12);
        for (p, color) in seen.position.iter().zip(&seen.color) {
            assert!((color[0] - p.x - 2.0).abs() < 1e-6 && (color[2] - p.y - 2.0).abs() < 1e-6, "{p}: {color:?}");
        }
        assert!(clipped(&square, &[Clip::HalfSpace { normal: DVec3::Z, offset: -1.0 }]).triangles.is_empty());
    }

    #[test]
    fn corners_on_the_border_make_no_triangle_without_area() {
        let square = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
        let half = clipped(&square, &[Clip::HalfSpace { normal: DVec3::X - DVec3::Y, offset: 0.0 }]);
        assert_eq!((half.triangles.len(), half.position.len(), half.area()), (1, 3, 2.0));
    }
}
