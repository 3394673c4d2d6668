//! Triangulates the inside of outlines in a plane: a constrained Delaunay triangulation, reduced to its parts inside.
//!
//! The coordinate along the normal's largest component is left out, which is exact. Outlines of bodies that overlap cross: there they
//! get a corner, which the walls have not.

use super::{Edge, Outlines};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use splat_core::glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Coordinates below this share of the largest are 0: spade takes none that are tiny.
const NOTHING: f64 = f64::from_bits((1023 - 100) << 52); // 2⁻¹⁰⁰

/// A corner of a lid.
pub(super) struct Place {
    /// The rim that it is, or whose colour it has.
    pub(super) rim: usize,
    /// Where outlines cross, if they do here.
    pub(super) crossing: Option<DVec3>,
}

/// A corner in the plane.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: Point2<f64>,
    rim: usize,
    is_crossing: bool,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

type Triangles = ConstrainedDelaunayTriangulation<Corner>;

/// Corners, and triangles of them whose fronts point along the normal.
pub(super) fn fill(outlines: &Outlines, normal: DVec3) -> (Vec<Place>, Vec<[usize; 3]>) {
    let mut places = Vec::new();
    let mut triangles = Vec::new();
    let Some(plane) = Plane::through(outlines, normal) else { return (places, triangles) };
    let Some(flat) = triangulated(outlines, &plane) else { return (places, triangles) };
    let (region, middles) = regions(&flat);
    let inside = inside(outlines, &plane, &middles);
    let mut known = vec![None; flat.num_vertices()];
    for face in flat.inner_faces().filter(|face| inside[region[face.fix().index()]]) {
        triangles.push(face.vertices().map(|vertex| {
            *known[vertex.fix().index()].get_or_insert_with(|| {
                let Corner { at, rim, is_crossing } = *vertex.data();
                places.push(Place { rim, crossing: is_crossing.then(|| plane.lifted(at)) });
                places.len() - 1
            })
        }));
    }
    (places, triangles)
}

/// A plane of which one coordinate is left out.
struct Plane {
    /// The two coordinates that stay, counter-clockwise seen from where the normal points, and the one that does not.
    axes: [usize; 3],
    /// A power of two.
    scale: f64,
    normal: DVec3,
    /// normal·p of its places.
    offset: f64,
}

impl Plane {
    /// `None` where there are no outlines.
    fn through(outlines: &Outlines, normal: DVec3) -> Option<Self> {
        let place = |edge: &Edge| outlines.rims[edge.ends[0]].place;
        let offset = normal.dot(place(outlines.edges.first()?));
        let size = normal.abs();
        let w = (0..3).fold(0, |most, axis| if size[axis] > size[most] { axis } else { most });
        let u = (w + 1) % 3;
        let v = (w + 2) % 3;
        let largest = outlines.edges.iter().map(|e| place(e)[u].abs().max(place(e)[v].abs())).fold(0.0, f64::max);
        let scale = if largest > 0.0 { libm::exp2(-libm::log2(largest).floor()) } else { 1.0 };
        let axes = if normal[w] < 0.0 { [v, u, w] } else { [u, v, w] };
        Some(Self { axes, scale, normal, offset })
    }

    fn flat(&self, place: DVec3) -> DVec2 {
        let scaled = |axis: usize| {
            let x = place[axis] * self.scale;
            // −0 is 0.
            if x.abs() < NOTHING { 0.0 } else { x }
        };
        DVec2::new(scaled(self.axes[0]), scaled(self.axes[1]))
    }

    fn lifted(&self, at: Point2<f64>) -> DVec3 {
        let [u, v, w] = self.axes;
        let mut place = DVec3::ZERO;
        (place[u], place[v]) = (at.x / self.scale, at.y / self.scale);
        place[w] = (self.offset - self.normal.dot(place)) / self.normal[w];
        place
    }
}

/// All corners with the edges of the outlines; `None` where there are none, or coordinates that [`Plane::flat`] does not give.
fn triangulated(outlines: &Outlines, plane: &Plane) -> Option<Triangles> {
    let mut known = HashMap::new();
    let mut corners = Vec::new();
    // Rims at one place of the plane are the first of them.
    let mut first: Vec<Option<usize>> = vec![None; outlines.rims.len()];
    for &rim in outlines.edges.iter().flat_map(|edge| &edge.ends) {
        let at = plane.flat(outlines.rims[rim].place);
        first[rim] = Some(*known.entry(at.to_array().map(f64::to_bits)).or_insert_with(|| {
            corners.push(Corner { at: Point2::new(at.x, at.y), rim, is_crossing: false });
            rim
        }));
    }
    let mut triangles = Triangles::bulk_load(corners).ok()?;
    let mut handles: Vec<Option<FixedVertexHandle>> = vec![None; first.len()];
    triangles.vertices().for_each(|vertex| handles[vertex.data().rim] = Some(vertex.fix()));
    for edge in &outlines.edges {
        let [from, to] = edge.ends.map(|rim| handles[first[rim]?]);
        let from = from?;
        let to = to?;
        if from != to && triangles.try_add_constraint(from, to).is_empty() {
            let crossing = |at| Corner { at, rim: edge.ends[0], is_crossing: true };
            triangles.add_constraint_and_split(from, to, crossing);
        }
    }
    Some(triangles)
}

/// For each face the number of its region, which outlines are around; and in each region the middle of its largest triangle.
fn regions(triangles: &Triangles) -> (Vec<usize>, Vec<DVec2>) {
    let mut region = vec![usize::MAX; triangles.num_all_faces()];
    let mut middles = Vec::new();
    for face in triangles.inner_faces() {
        if region[face.fix().index()] != usize::MAX {
            continue;
        }
        region[face.fix().index()] = middles.len();
        let mut waiting = vec![face];
        let mut largest = (0.0, DVec2::ZERO);
        while let Some(face) = waiting.pop() {
            let [a, b, c] = face.positions().map(|p| DVec2::new(p.x, p.y));
            let area = (b - a).perp_dot(c - a);
            if area > largest.0 {
                largest = (area, (a + b + c) / 3.0);
            }
            for edge in face.adjacent_edges().into_iter().filter(|edge| !edge.is_constraint_edge()) {
                if let Some(next) = edge.rev().face().as_inner()
                    && region[next.fix().index()] == usize::MAX
                {
                    region[next.fix().index()] = middles.len();
                    waiting.push(next);
                }
            }
        }
        middles.push(largest.1);
    }
    (region, middles)
}

/// For each place whether outlines go around it.
fn inside(outlines: &Outlines, plane: &Plane, places: &[DVec2]) -> Vec<bool> {
    let flat = |rim: usize| plane.flat(outlines.rims[rim].place);
    let mut edges: Vec<([DVec2; 2], i64)> = outlines.edges.iter().map(|e| (e.ends.map(flat), e.times)).collect();
    edges.sort_by(|(a, _), (b, _)| a[0].y.min(a[1].y).total_cmp(&b[0].y.min(b[1].y)));
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|a, b| places[*a].y.total_cmp(&places[*b].y));
    let are_wound = outlines.are_wound();
    let mut inside = vec![false; places.len()];
    let mut edges = edges.into_iter().peekable();
    let mut beside = Vec::new();
    for n in order {
        let p = places[n];
        // Those at the height of the place, half-open: a corner at its height counts once.
        while let Some(edge) = edges.next_if(|([a, b], _)| a.y.min(b.y) <= p.y) {
            beside.push(edge);
        }
        beside.retain(|([a, b], _)| a.y.max(b.y) > p.y);
        let mut turns = 0;
        let mut crossed = 0;
        for ([a, b], times) in &beside {
            let rises = a.y < b.y;
            if ((*b - *a).perp_dot(p - *a) > 0.0) == rises {
                turns += if rises { *times } else { -times };
                crossed += times;
            }
        }
        inside[n] = if are_wound { turns != 0 } else { crossed % 2 != 0 };
    }
    inside
}
