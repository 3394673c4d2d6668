//! Opaque discs end at the open borders of their surface.
//!
//! A disc hides what is behind within [`CORE`] of its radius R, 1.08 spacings, so that neighbours leave no hole; a disc half a
//! spacing from a border would hide that much beyond it. There it becomes an ellipse: across the border its core ends where
//! the surface does, along the border it stays as it is, unless another border is near. Cores reach [`OVERLAP`] further:
//! where two surfaces meet along borders that are one but for rounding, nothing is seen between them.

use crate::common::columns::CHUNK;
use rayon::prelude::*;
use rstar::primitives::Line;
use rstar::{AABB, RTree};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, Mesh, SplatKind};

/// Share of a disc's radius within which it hides.
const CORE: f32 = Footprint::CORE;

/// How far a core reaches beyond a border, as a share of the core of a whole disc: ellipses that touch a line from inside leave
/// out a twelfth of a spacing between them.
const OVERLAP: f64 = 0.1;

/// Splats that are asked for together whether a border is near.
const GROUP: usize = 64;

/// Least cosine between the way to a border and the disc's plane: other borders pass above or below.
const IN_PLANE: f64 = 0.8;

/// The edges of a mesh that one triangle has alone. Vertices at one place are one, so that seams of textures are none.
pub(crate) fn open_edges(mesh: &Mesh) -> Vec<[u32; 2]> {
    let mut edges = vec![[0; 2]; 3 * mesh.triangles.len()];
    let written = edges.par_chunks_exact_mut(3).zip(&mesh.triangles).with_min_len(CHUNK);
    written.for_each(|(edges, &[a, b, c])| edges.copy_from_slice(&[sorted(a, b), sorted(b, c), sorted(c, a)]));
    edges.par_sort_unstable();
    let open: Vec<[u32; 2]> =
        edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect();
    drop(edges);
    let first_there = first_vertices(mesh, &open);
    let joined = |[a, b]: [u32; 2]| sorted(first_there[a as usize], first_there[b as usize]);
    // With their place among the open ones, which they keep.
    let mut joined: Vec<([u32; 2], usize)> = open.par_iter().map(|edge| joined(*edge)).zip(0..open.len()).collect();
    joined.par_sort_unstable();
    let alone = joined.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0]);
    let mut kept: Vec<usize> = alone.filter(|([a, b], _)| a != b).map(|(_, rank)| rank).collect();
    kept.par_sort_unstable();
    kept.into_iter().map(|rank| open[rank]).collect()
}

/// For each vertex of some edges the least one at its place; of other vertices anything.
fn first_vertices(mesh: &Mesh, edges: &[[u32; 2]]) -> Vec<u32> {
    // −0 is 0.
    let place = |v: u32| (mesh.position[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut vertices: Vec<([u32; 3], u32)> = edges.par_iter().flatten_iter().map(|v| (place(*v), *v)).collect();
    vertices.par_sort_unstable();
    let mut first_there = vec![0; mesh.position.len()];
    for at_one_place in vertices.chunk_by(|a, b| a.0 == b.0) {
        at_one_place.iter().for_each(|(_, v)| first_there[*v as usize] = at_one_place[0].1);
    }
    first_there
}

fn sorted(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Least sine between the ways to two borders that bound a disc on two sides.
const LEAST_TURN: f64 = 0.1;

/// Open borders near a cloud's splats.
pub(crate) struct Borders {
    edges: RTree<Line<[f64; 3]>>,
}

impl Borders {
    /// From segments relative to the cloud's origin.
    pub(crate) fn new(segments: impl IntoIterator<Item = [Vec3; 2]>) -> Self {
        let line = |[a, b]: [Vec3; 2]| Line::new(a.as_dvec3().to_array(), b.as_dvec3().to_array());
        Self { edges: RTree::bulk_load(segments.into_iter().map(line).collect()) }
    }

    /// Makes the opaque discs of `cloud` end at the borders.
    pub(crate) fn clip(&self, cloud: &mut Cloud) {
        let n = cloud.len();
        cloud.tangent.clear();
        cloud.tangent.resize(n, Vec3::ZERO);
        let groups = cloud.position.par_chunks(GROUP).zip(cloud.normal.par_chunks(GROUP));
        let discs = cloud.radius.par_chunks_mut(GROUP).zip(cloud.tangent.par_chunks_mut(GROUP));
        let discs = discs.zip(cloud.kind.par_chunks(GROUP));
        groups.zip(discs).with_min_len(CHUNK / GROUP).for_each(|((position, normal), ((radius, tangent), kind))| {
            let reach = Vec3::splat(radius.iter().fold(0.0, |most, r| r.max(most)) * CORE);
            let (low, high) = position.iter().fold((position[0], position[0]), |(l, h), p| (l.min(*p), h.max(*p)));
            let around = |p: Vec3| p.as_dvec3().to_array();
            let around = AABB::from_corners(around(low - reach), around(high + reach));
            if self.edges.locate_in_envelope_intersecting(&around).next().is_none() {
                return;
            }
            for k in (0..position.len()).filter(|k| kind[*k] == SplatKind::Opaque) {
                if let Some((first, second)) = self.ellipse(position[k], normal[k], radius[k]) {
                    (tangent[k], radius[k]) = (first.as_vec3(), second as f32);
                }
            }
        });
    }

    /// The first semi-axis of the disc at `position` and the length of the second; `None` where no border is near.
    fn ellipse(&self, position: Vec3, normal: Vec3, radius: f32) -> Option<(DVec3, f64)> {
        let p = position.as_dvec3();
        let n = normal.as_dvec3();
        let whole = f64::from(radius * CORE);
        let overlap = OVERLAP * whole;
        // Ways into the surface from borders near, and how far.
        let inwards = |edge: &Line<[f64; 3]>| {
            let way = p - DVec3::from_array(edge.nearest_point(&p.to_array()));
            let across = way - n * n.dot(way);
            let distance = way.length();
            let along = DVec3::from_array(edge.to) - DVec3::from_array(edge.from);
            // On the border itself every way across it will do.
            let way = if distance > 1e-3 * overlap { across.try_normalize() } else { n.cross(along).try_normalize() };
            way.filter(|_| across.length() >= IN_PLANE * distance).map(|way| (distance, way))
        };
        let near = self.edges.locate_within_distance(p.to_array(), whole * whole).filter_map(inwards);
        let mut near: Vec<(f64, DVec3)> = near.collect();
        // Of two equally near the one that any order of the edges gives.
        let key = |(distance, way): &(f64, DVec3)| [*distance, way.x, way.y, way.z].map(f64::to_bits);
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| key(a).cmp(&key(b))));
        let &(nearest, way) = near.first()?;
        let across = (nearest + overlap).min(whole);
        let along = n.cross(way).normalize();
        let mut length = whole;
        for (distance, other) in &near {
            let over = across * other.dot(way);
            let beside = other.dot(along).abs();
            // The same border, or one behind it.
            if beside < LEAST_TURN {
                continue;
            }
            // How far the ellipse may reach for its extent towards the other border.
            let most = ((distance + overlap).powi(2) - over * over).max(0.0).sqrt() / beside;
            length = length.min(most.max(overlap));
        }
        let core = f64::from(CORE);
        Some((along * (length / core), across / core))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares of two triangles each beside each other; their common edge has vertices of its own on either side.
    fn seamed() -> Mesh {
        let p = |x, y| Vec3::new(x, y, 0.0);
        Mesh {
            position: vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.), p(1., -0.), p(2., 0.), p(2., 1.), p(1., 1.)],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            ..Mesh::default()
        }
    }

    #[test]
    fn seams_of_textures_are_no_borders() {
        assert_eq!(open_edges(&seamed()), [[0, 1], [0, 3], [2, 3], [4, 5], [5, 6], [6, 7]]);
        let tetrahedron = Mesh {
            position: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        };
        assert!(open_edges(&tetrahedron).is_empty());
    }

    #[test]
    fn cores_end_at_every_border_near_them() {
        let corner = Borders::new([[Vec3::ZERO, Vec3::X], [Vec3::Y, Vec3::ZERO]]);
        let whole = 0.1;
        let least = 0.01;
        for (x, y) in [(0.05, 0.03), (0.02, 0.09), (0.5, 0.06), (0.07, 0.07), (0.001, 0.04), (0.3, 0.0)] {
            let (first, second) = corner.ellipse(Vec3::new(x, y, 0.0), Vec3::Z, whole / CORE).unwrap();
            let core = f64::from(CORE);
            let second = Vec3::Z.as_dvec3().cross(first.normalize()) * second * core;
            let first = first * core;
            for (axis, distance) in [(DVec3::X, x), (DVec3::Y, y)] {
                let reach = first.dot(axis).hypot(second.dot(axis));
                let most = (f64::from(distance) + least).min(f64::from(whole)) + 1e-6;
                assert!(reach <= most, "({x}, {y}) reaches {reach} along {axis}");
                assert!(reach > 0.99 * most || axis.dot(first.normalize()).abs() > 0.5, "({x}, {y}): {reach}");
            }
        }
        // Away from it, and above it, discs stay whole.
        assert!(corner.ellipse(Vec3::new(0.5, 0.2, 0.0), Vec3::Z, whole / CORE).is_none());
        assert!(corner.ellipse(Vec3::new(0.5, 0.001, 0.05), Vec3::Z, whole / CORE).is_none());
    }
}
