//! Polygons become triangles: a fan where a polygon is strictly convex, else a constrained Delaunay triangulation.
//!
//! A polygon lies in the plane across its Newell normal, its best-fit plane up to a choice of weights. Instead of turning
//! it into that plane, the coordinate along the normal's largest component is left out: an affine map of the plane, and
//! an exact one, so that the turns at the corners are decided without rounding (J. Shewchuk's predicates).
//!
//! What is inside is decided by parity: crossing an edge that is run through an odd number of times changes sides. So
//! holes that are joined to the rim by an edge run through twice stay open. A polygon that crosses itself has no inside
//! and is refused.

use rayon::prelude::*;
use robust::{Coord, orient2d};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use splat_core::Mesh;
use splat_core::glam::{DVec2, DVec3, Vec3};

/// Coordinates below this share of the extent become 0: spade takes none that are tiny.
const NOTHING: f64 = f64::from_bits((1023 - 100) << 52); // 2⁻¹⁰⁰

/// A face of more than three corners, held as a fan: `[c0, c1, c2], [c0, c2, c3], …`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Polygon {
    /// Number of the face in the file.
    pub(super) face: u64,
    /// First triangle of the fan, and their number.
    pub(super) first: usize,
    pub(super) count: usize,
}

/// Replaces the fans of polygons that are not strictly convex; `Err` is the first polygon that crosses itself.
pub(super) fn triangulate(mesh: &mut Mesh, polygons: &[Polygon]) -> Result<(), Polygon> {
    let better: Vec<Result<Option<Vec<[u32; 3]>>, Polygon>> = polygons
        .par_iter()
        .with_min_len(256)
        .map(|p| {
            let fan = &mesh.triangles[p.first..p.first + p.count];
            let corners: Vec<u32> = fan[0][..2].iter().copied().chain(fan.iter().map(|t| t[2])).collect();
            match project(&corners, &mesh.position) {
                Some(flat) if !is_strictly_convex(&flat) => constrained(&corners, &flat).map(Some).ok_or(*p),
                // Without any area every triangulation is as good.
                _ => Ok(None),
            }
        })
        .collect();
    let better = better.into_iter().collect::<Result<Vec<_>, _>>()?;
    if better.iter().all(Option::is_none) {
        return Ok(());
    }
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    let mut copied = 0;
    for (polygon, better) in polygons.iter().zip(&better) {
        if let Some(better) = better {
            triangles.extend_from_slice(&mesh.triangles[copied..polygon.first]);
            triangles.extend_from_slice(better);
            copied = polygon.first + polygon.count;
        }
    }
    triangles.extend_from_slice(&mesh.triangles[copied..]);
    mesh.triangles = triangles;
    Ok(())
}

/// Two coordinates of each corner, counter-clockwise seen from where the normal points; scaled by a power of two. `None`
/// for a polygon without area.
fn project(corners: &[u32], position: &[Vec3]) -> Option<Vec<DVec2>> {
    let at = |i: usize| position[corners[i % corners.len()] as usize].as_dvec3();
    // Relative to the first corner, which loses nothing but the rounding of a direction that need not be exact.
    let newell: DVec3 = (1..corners.len()).map(|i| (at(i) - at(0)).cross(at(i + 1) - at(0))).sum();
    let size = newell.abs();
    if !(size.max_element() > 0.0 && size.is_finite()) {
        return None;
    }
    let axis = (0..3).fold(0, |a, i| if size[i] > size[a] { i } else { a });
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if newell[axis] < 0.0 {
        (u, v) = (v, u);
    }
    let largest = (0..corners.len()).fold(0.0, |l: f64, i| l.max(at(i)[u].abs()).max(at(i)[v].abs()));
    let factor = (-largest.log2().floor()).exp2();
    let scaled = |x: f64| if (x * factor).abs() < NOTHING { 0.0 } else { x * factor };
    Some((0..corners.len()).map(|i| DVec2::new(scaled(at(i)[u]), scaled(at(i)[v]))).collect())
}

/// Positive for a turn to the left, exactly.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Every corner turns left, and the polygon goes around once: it has one lowest corner.
fn is_strictly_convex(p: &[DVec2]) -> bool {
    let n = p.len();
    let below = |a: DVec2, b: DVec2| (a.y, a.x) < (b.y, b.x);
    let at = |i: usize| (p[(i + n - 1) % n], p[i], p[(i + 1) % n]);
    let lowest = (0..n).filter(|&i| below(at(i).1, at(i).0) && below(at(i).1, at(i).2)).count();
    lowest == 1 && (0..n).all(|i| turn(at(i).0, at(i).1, at(i).2) > 0.0)
}

/// A corner in the plane.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: Point2<f64>,
    id: u32,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The triangles inside; `None` where edges cross.
fn constrained(corners: &[u32], flat: &[DVec2]) -> Option<Vec<[u32; 3]>> {
    let mut plane = ConstrainedDelaunayTriangulation::<Corner>::new();
    let mut handles: Vec<FixedVertexHandle> = Vec::with_capacity(corners.len());
    for (id, p) in corners.iter().zip(flat) {
        // Coordinates are 0 or within what spade takes, see `project`.
        handles.push(plane.insert(Corner { at: Point2::new(p.x, p.y), id: *id }).ok()?);
    }
    let mut times = vec![0u32; plane.num_undirected_edges()];
    for (i, &from) in handles.iter().enumerate() {
        let to = handles[(i + 1) % handles.len()];
        if from == to {
            continue;
        }
        let edges = plane.try_add_constraint(from, to);
        if edges.is_empty() {
            return None;
        }
        for edge in edges {
            times[edge.as_undirected().index()] += 1;
        }
    }
    let inside = sides(&plane, &times);
    let faces = plane.inner_faces().filter(|f| inside[f.fix().index()] == Some(true));
    Some(faces.map(|f| f.vertices().map(|v| v.data().id)).collect())
}

/// For each face whether it is inside.
fn sides(plane: &ConstrainedDelaunayTriangulation<Corner>, times: &[u32]) -> Vec<Option<bool>> {
    let mut inside = vec![None; plane.num_all_faces()];
    inside[plane.outer_face().fix().index()] = Some(false);
    let mut waiting: Vec<_> = plane.convex_hull().flat_map(|e| [e, e.rev()]).filter(|e| e.is_outer_edge()).collect();
    while let Some(edge) = waiting.pop() {
        let (here, next) = (edge.face().fix().index(), edge.rev().face());
        if inside[next.fix().index()].is_some() {
            continue;
        }
        let crossed = times[edge.as_undirected().fix().index()] % 2 == 1;
        inside[next.fix().index()] = inside[here].map(|side: bool| side ^ crossed);
        if let Some(face) = next.as_inner() {
            waiting.extend(face.adjacent_edges());
        }
    }
    inside
}
