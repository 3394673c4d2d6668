//! Polyhedra: whether their faces close, and a point inside that sees all of them.
//!
//! Polyhedra are parted around a point. The parts fill them where it sees every face: then the volume that the faces enclose, by the
//! divergence theorem, is that of the parts. Where the mean of the corners does not, a point that does is looked for in the half spaces of the faces.

use super::HINT;
use super::resample::{Body, Faces};
use crate::error::{Place, ReadError};
use crate::reading::{Fix, Reading};
use splat_core::glam::{DMat3, DVec3};

/// By what part of the volume the parts may exceed what the faces enclose: faces that are not flat are rounded so far.
const ROUNDING: f64 = 1e-6;

/// Most steps towards a point that sees all faces.
const STEPS: usize = 256;
/// How far inside of each face it is looked for, of the size of the polyhedron, and how far beyond its goal a step goes.
const INSIDE: f64 = 1e-3;
const BEYOND: f64 = 1.2;

/// A part of a face, wound outwards.
struct Triangle {
    corners: [DVec3; 3],
}

/// The use of an edge by a face.
struct Edge {
    /// The lesser rank of its ends comes first.
    ends: [u32; 2],
    face: u32,
    /// Whether the face goes from the greater rank to the lesser.
    is_back: bool,
}

/// Gives polyhedra a point that sees all of their faces where the mean of their corners does not, and counts those that have none or do not close.
pub(super) fn check(
    points: &[DVec3],
    bodies: &mut [Body<'_>],
    place: Place,
    reading: &mut Reading<'_>,
) -> Result<(), ReadError> {
    for body in bodies {
        let Faces::Around(faces, seeing) = &mut body.faces else { continue };
        reading.go_on()?;
        let faces: Vec<&[u32]> = faces.iter().collect();
        let cell = body.cell;
        let strict = |expected: &str, found: &str| {
            ReadError::input(place, format!("{expected} of cell {cell}, a polyhedron"), found, HINT)
        };
        let Some(is_turned) = turned(&faces) else {
            reading.mend(Fix::OpenPolyhedron, place, Some(cell as u64), || {
                strict("faces that close around the inside", "an edge that has not two of them")
            })?;
            continue;
        };
        let triangles: Vec<Triangle> =
            faces.iter().zip(&is_turned).flat_map(|(face, is_turned)| triangles(face, *is_turned, points)).collect();
        let mean = body.corners.iter().map(|c| points[*c as usize]).sum::<DVec3>() / body.corners.len() as f64;
        if sees_all(mean, &triangles) {
            continue;
        }
        let point = seeing_point(mean, &triangles).filter(|point| sees_all(*point, &triangles));
        *seeing = point.and_then(|point| weights(point, mean, body.corners, points));
        if seeing.is_none() {
            reading.mend(Fix::HiddenFaces, place, Some(cell as u64), || {
                strict("a point inside that sees all faces", "faces that hide others")
            })?;
        }
    }
    Ok(())
}

/// The weights by which corners have a point as their sum, and as its value that of the linear field that fits them best; `None` of flat ones.
fn weights(point: DVec3, mean: DVec3, corners: &[u32], points: &[DVec3]) -> Option<Vec<f64>> {
    let from_mean = || corners.iter().map(|corner| points[*corner as usize] - mean);
    let squares =
        from_mean().fold(DMat3::ZERO, |sum, from| sum + DMat3::from_cols(from.x * from, from.y * from, from.z * from));
    let towards = squares.inverse() * (point - mean);
    let even = 1.0 / corners.len() as f64;
    towards.is_finite().then(|| from_mean().map(|from| even + towards.dot(from)).collect())
}

/// Which faces have to be turned so that all are wound alike; `None` where an edge has not two faces, or they cannot be.
fn turned(faces: &[&[u32]]) -> Option<Vec<bool>> {
    let mut edges = Vec::new();
    for (rank, face) in faces.iter().enumerate() {
        for (i, a) in face.iter().enumerate() {
            let b = face[(i + 1) % face.len()];
            edges.push(Edge { ends: [*a.min(&b), b.max(*a)], face: rank as u32, is_back: *a > b });
        }
    }
    edges.sort_by_key(|edge| edge.ends);
    // Each edge joins two faces, which go along it in opposite directions once they are wound alike.
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); faces.len()];
    for pair in edges.chunk_by(|a, b| a.ends == b.ends) {
        let [a, b] = pair else { return None };
        let is_turned = a.is_back == b.is_back;
        neighbours[a.face as usize].push((b.face, is_turned));
        neighbours[b.face as usize].push((a.face, is_turned));
    }
    let mut known: Vec<Option<bool>> = vec![None; faces.len()];
    let mut left = vec![0u32];
    *known.first_mut()? = Some(false);
    while let Some(face) = left.pop() {
        let is_turned = known[face as usize]?;
        for (other, differs) in &neighbours[face as usize] {
            let expected = is_turned != *differs;
            match &mut known[*other as usize] {
                Some(found) if *found != expected => return None,
                Some(_) => {}
                unknown => {
                    *unknown = Some(expected);
                    left.push(*other);
                }
            }
        }
    }
    // Faces that do not hang together with the first are another body.
    known.into_iter().collect()
}

/// The parts of a face, as it is drawn: itself, or triangles around the mean of its corners.
fn triangles(face: &[u32], is_turned: bool, points: &[DVec3]) -> Vec<Triangle> {
    let corner = |i: usize| points[face[i % face.len()] as usize];
    let wound = |a: DVec3, b: DVec3, c: DVec3| Triangle { corners: if is_turned { [a, c, b] } else { [a, b, c] } };
    if face.len() == 3 {
        return vec![wound(corner(0), corner(1), corner(2))];
    }
    let center = (0..face.len()).map(corner).sum::<DVec3>() / face.len() as f64;
    (0..face.len()).map(|i| wound(center, corner(i), corner(i + 1))).collect()
}

/// Six times the signed volume between a point and a triangle.
fn between(point: DVec3, triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.corners.map(|corner| corner - point);
    a.dot(b.cross(c))
}

/// Whether what lies between a point and the faces is what they enclose.
fn sees_all(point: DVec3, triangles: &[Triangle]) -> bool {
    let parts = || triangles.iter().map(|triangle| between(point, triangle));
    let enclosed = parts().sum::<f64>().abs();
    parts().map(f64::abs).sum::<f64>() <= (1.0 + ROUNDING) * enclosed
}

/// A point on the inner side of all faces, if some steps from the mean lead there: each to the face that it lies farthest outside of.
fn seeing_point(mean: DVec3, triangles: &[Triangle]) -> Option<DVec3> {
    let inside_out = triangles.iter().map(|triangle| between(mean, triangle)).sum::<f64>() < 0.0;
    let planes = || {
        triangles.iter().filter_map(|Triangle { corners: [a, b, c] }| {
            let normal = (*b - *a).cross(*c - *a).try_normalize()?;
            Some((*a, if inside_out { -normal } else { normal }))
        })
    };
    let size = triangles.iter().flat_map(|t| t.corners).map(|corner| corner.distance(mean)).fold(0.0, f64::max);
    let mut point = mean;
    for _ in 0..STEPS {
        let outside = planes().map(|(corner, normal)| ((point - corner).dot(normal) + INSIDE * size, normal));
        let (farthest, normal) = outside.max_by(|a, b| a.0.total_cmp(&b.0))?;
        if farthest <= 0.0 {
            return Some(point);
        }
        point -= BEYOND * farthest * normal;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sides of a prism of height 1 over a polygon, its floor wound one way and all others the other, if `is_mixed`.
    fn prism(floor: &[[f64; 2]], is_mixed: bool) -> (Vec<DVec3>, Vec<Vec<u32>>) {
        let n = floor.len() as u32;
        let points = [0.0, 1.0].iter().flat_map(|z| floor.iter().map(move |[x, y]| DVec3::new(*x, *y, *z))).collect();
        let mut bottom: Vec<u32> = (0..n).collect();
        if !is_mixed {
            bottom.reverse();
        }
        let sides = (0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]);
        (points, [bottom, (n..2 * n).collect()].into_iter().chain(sides).collect())
    }

    fn seen(floor: &[[f64; 2]], is_mixed: bool) -> Option<DVec3> {
        let (points, faces) = prism(floor, is_mixed);
        let faces: Vec<&[u32]> = faces.iter().map(Vec::as_slice).collect();
        let is_turned = turned(&faces)?;
        let triangles: Vec<Triangle> =
            faces.iter().zip(&is_turned).flat_map(|(face, turned)| triangles(face, *turned, &points)).collect();
        let mean = points.iter().sum::<DVec3>() / points.len() as f64;
        let found = if sees_all(mean, &triangles) { Some(mean) } else { seeing_point(mean, &triangles) };
        found.filter(|point| sees_all(*point, &triangles))
    }

    #[test]
    fn a_point_that_sees_all_faces_is_found_where_there_is_one() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for is_mixed in [false, true] {
            assert_eq!(seen(&square, is_mixed), Some(DVec3::splat(0.5)));
        }
        // A hook of which the tip alone sees both arms.
        let hook = [[0.0, 0.0], [4.0, 0.0], [4.0, 0.4], [0.4, 0.4], [0.4, 4.0], [0.0, 4.0]];
        let (points, _) = prism(&hook, false);
        assert!(points.iter().sum::<DVec3>().x / 12.0 > 0.4);
        // The middles of its floor and ceiling lie outside of them: no point sees all of their parts.
        assert_eq!(seen(&hook, false), None);
        let (points, faces) = prism(&square, false);
        assert_eq!(turned(&faces[1..].iter().map(Vec::as_slice).collect::<Vec<_>>()), None);
        assert_eq!(points.len(), 8);
    }
}
