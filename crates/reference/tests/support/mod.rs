//! Cameras, meshes and statistics that the tests share.

use reference::{Estimate, PathSettings, Scene, path_trace};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Camera, Mesh, Projection};

/// A parallel camera at `from` that looks at `to`, the image `height` high.
pub(crate) fn parallel(from: DVec3, to: DVec3, height: f64, size: [u32; 2]) -> Camera {
    Camera::look_at(from, to, DVec3::Y, Projection::Orthographic { height }, size).unwrap()
}

pub(crate) fn trace(scene: &Scene<'_>, camera: &Camera, settings: &PathSettings) -> Estimate {
    path_trace(scene, camera, settings, None).unwrap()
}

/// An axis-aligned box as twelve triangles with outward normals.
pub(crate) fn box_mesh(min: Vec3, max: Vec3) -> Mesh {
    let corner = |i: u32| {
        let pick = |bit: u32, a: f32, b: f32| if i >> bit & 1 == 1 { b } else { a };
        Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        position: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect(),
        ..Mesh::default()
    }
}

/// A quadrilateral a, b, c, d as two triangles.
pub(crate) fn quad(corners: [Vec3; 4]) -> Mesh {
    Mesh { position: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
}

/// A ball by repeated subdivision of an octahedron, 8·4^levels triangles.
pub(crate) fn ball_mesh(center: Vec3, radius: f32, levels: u32) -> Mesh {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let mut position = axes.to_vec();
    let mut triangles: Vec<[u32; 3]> = (0..8)
        .map(|i| {
            let x = i & 1;
            let y = i >> 1 & 1;
            let z = i >> 2 & 1;
            let t = [x, 2 + y, 4 + z];
            if (x + y + z) % 2 == 0 { t } else { [t[0], t[2], t[1]] }
        })
        .collect();
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    position.push((position[i as usize] + position[j as usize]).normalize());
                    position.len() as u32 - 1
                })
            };
            let ab = middle(a, b);
            let bc = middle(b, c);
            let ca = middle(c, a);
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = next;
    }
    let position = position.into_iter().map(|p| center + p * radius).collect();
    Mesh { position, triangles, ..Mesh::default() }
}

/// Asserts that every pixel and channel lies within `sigmas` of its standard errors of the truth, and the mean of the
/// image within 3.3 of its own (two-sided 1e-3).
pub(crate) fn assert_mean(estimate: &Estimate, truth: impl Fn(usize) -> [f64; 3], sigmas: f64, what: &str) {
    let s = &estimate.radiance;
    for c in 0..3 {
        let mut off = 0.0;
        let mut variance = 0.0;
        for k in 0..s.mean.len() {
            let found = s.mean[k][c];
            let error = s.standard_error[k][c];
            let exact = truth(k)[c];
            assert!(
                (found - exact).abs() <= sigmas * error + 1e-12,
                "{what}: pixel {k} channel {c} is {found} ± {error}, exactly {exact}"
            );
            off += found - exact;
            variance += error * error;
        }
        assert!(off.abs() <= 3.3 * variance.sqrt() + 1e-9, "{what}: channel {c} is off by {off} ± {}", variance.sqrt());
    }
}
