//! Polygons become triangles: a fan where a polygon is strictly convex, else a constrained Delaunay triangulation.
//!
//! A polygon lies in the plane across its Newell normal, its best-fit plane up to a choice of weights. Instead of turning
//! it into that plane, the coordinate along the normal's largest component is left out: an affine map of the plane, and
//! an exact one, so that the turns at the corners are decided without rounding (J. Shewchuk's predicates).
//!
//! What is inside is decided by parity: crossing an edge that is run through an odd number of times changes sides. So
//! holes that are joined to the rim by an edge run through twice stay open. A polygon that crosses itself has no inside;
//! it is mended: one of four corners is its two triangles, a larger one fills what its edges go around.
//!
//! All corners are put into the triangulation at once and edges follow in a scattered order, O(n log n); one after the
//! other, the corners of a comb and the edges of a zigzag take O(n²).

use crate::error::{Place, ReadError};
use crate::reading::{Fix, Reading};
use crate::stream::input;
use rayon::prelude::*;
use robust::{Coord, orient2d};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use splat_core::glam::{DVec2, DVec3, Vec3};
use splat_core::{Association, Mesh};
use std::collections::HashMap;

/// Coordinates below this share of the extent become 0: spade takes none that are tiny.
const NOTHING: f64 = f64::from_bits((1023 - 100) << 52); // 2⁻¹⁰⁰

/// Corners of a crossing polygon whose inside is looked for: every triangle asks every edge.
const MOST_CROSSING: usize = 4096;

/// Places of a polygon up to which all are triangulated at once.
const MOST_AT_BULK: usize = 512;

/// Bytes that a corner takes while its polygon is triangulated.
const BYTES_PER_CORNER: u64 = 512;

/// Corners of a polygon beside which no other is triangulated.
const MOST_AT_ONCE: usize = 1 << 14;

/// A face of more than three corners, held as a fan: `[c0, c1, c2], [c0, c2, c3], …`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Polygon {
    /// Number of the face in the file.
    pub(crate) face: u64,
    /// First triangle of the fan, and their number.
    pub(crate) first: usize,
    pub(crate) count: usize,
}

/// What becomes of a polygon.
enum Outcome {
    /// Its fan stays.
    Fan,
    Triangles(Vec<[u32; 3]>),
    Mended(Fix, Vec<[u32; 3]>),
    Refused(ReadError),
}

/// Replaces the fans of polygons that are not strictly convex; `place` tells where the polygon of that rank is.
pub(crate) fn triangulate(
    mesh: &mut Mesh,
    polygons: &[Polygon],
    reading: &mut Reading<'_>,
    place: impl Fn(usize) -> Place,
) -> Result<(), ReadError> {
    let outcomes = outcomes(mesh, polygons, reading)?;
    reading.go_on()?;
    if outcomes.iter().all(|o| matches!(o, Outcome::Fan)) {
        return Ok(());
    }
    let mut triangles = Vec::new();
    input::hold("the triangles of larger faces", size_of_val(mesh.triangles.as_slice()) as u64, reading.params)?;
    input::reserve(&mut triangles, mesh.triangles.len())?;
    let mut copied = 0;
    // Of each triangle the one of the fans that it comes of, for columns.
    let has_columns = mesh.columns.iter().any(|column| column.association == Association::Triangle);
    let mut sources: Vec<usize> = Vec::new();
    for (rank, (polygon, outcome)) in polygons.iter().zip(outcomes).enumerate() {
        let better = match outcome {
            Outcome::Fan => continue,
            Outcome::Triangles(better) => better,
            Outcome::Mended(fix, better) => {
                reading.mend(fix, place(rank), Some(polygon.face), || {
                    let found = format!("face {} of {} corners that crosses itself", polygon.face, polygon.count + 2);
                    let hint = "split the face into triangles, or put its corners in order";
                    ReadError::input(place(rank), "faces whose edges do not cross", found, hint)
                })?;
                better
            }
            Outcome::Refused(error) => return Err(error),
        };
        triangles.extend_from_slice(&mesh.triangles[copied..polygon.first]);
        if has_columns {
            sources.extend(copied..polygon.first);
            sources.extend(std::iter::repeat_n(polygon.first, better.len()));
        }
        triangles.extend_from_slice(&better);
        copied = polygon.first + polygon.count;
    }
    triangles.extend_from_slice(&mesh.triangles[copied..]);
    if has_columns {
        sources.extend(copied..mesh.triangles.len());
    }
    for column in mesh.columns.iter_mut().filter(|column| column.association == Association::Triangle) {
        column.values = sources.iter().map(|source| column.values[*source]).collect();
    }
    mesh.triangles = triangles;
    Ok(())
}

/// Triangulates all polygons: small ones in parallel, large ones one after the other, so that the memory they take does not depend on the number
/// of threads.
fn outcomes(mesh: &Mesh, polygons: &[Polygon], reading: &Reading<'_>) -> Result<Vec<Outcome>, ReadError> {
    let largest = polygons.iter().map(|p| p.count as u64 + 2).max().unwrap_or(0);
    let bytes = largest * BYTES_PER_CORNER + size_of_val(polygons) as u64 * 4;
    input::hold("the corners of a face", bytes, reading.params)?;
    let is_large = |p: &Polygon| p.count > MOST_AT_ONCE;
    let made = |p: &Polygon| outcome(mesh, p, reading).unwrap_or_else(Outcome::Refused);
    let small = |p: &Polygon| if is_large(p) { Outcome::Fan } else { made(p) };
    let mut outcomes: Vec<Outcome> = polygons.par_iter().with_min_len(256).map(small).collect();
    let large = outcomes.iter_mut().zip(polygons).filter(|(_, p)| is_large(p));
    large.for_each(|(outcome, p)| *outcome = made(p));
    Ok(outcomes)
}

fn outcome(mesh: &Mesh, polygon: &Polygon, reading: &Reading<'_>) -> Result<Outcome, ReadError> {
    reading.go_on()?;
    let fan = &mesh.triangles[polygon.first..polygon.first + polygon.count];
    let corners: Vec<u32> = fan[0][..2].iter().copied().chain(fan.iter().map(|t| t[2])).collect();
    // Without any area every triangulation is as good.
    let Some(flat) = project(&corners, &mesh.position) else { return Ok(Outcome::Fan) };
    if is_strictly_convex(&flat) {
        return Ok(Outcome::Fan);
    }
    let Some(flat) = Flat::new(&corners, flat, reading)? else { return Ok(Outcome::Fan) };
    Ok(match flat.by_parity() {
        Some(triangles) => Outcome::Triangles(triangles),
        None if corners.len() == 4 => Outcome::Mended(Fix::CrossingQuad, fan.to_vec()),
        None if corners.len() <= MOST_CROSSING => Outcome::Mended(Fix::CrossingPolygon, flat.by_winding()),
        None => Outcome::Mended(Fix::CrossingLarge, Vec::new()),
    })
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
    let mut u = (axis + 1) % 3;
    let mut v = (axis + 2) % 3;
    if newell[axis] < 0.0 {
        (u, v) = (v, u);
    }
    let largest = (0..corners.len()).fold(0.0, |l: f64, i| l.max(at(i)[u].abs()).max(at(i)[v].abs()));
    let factor = libm::exp2(-libm::log2(largest).floor());
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
    /// Vertex of the mesh.
    id: u32,
    /// Rank among the different places of the polygon.
    rank: usize,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

type Plane = ConstrainedDelaunayTriangulation<Corner>;

/// A polygon in its plane, triangulated.
struct Flat {
    plane: Plane,
    /// The corners in order.
    corners: Vec<DVec2>,
    /// How often the polygon runs through each edge; `None` where edges of it cross.
    times: Option<Vec<u32>>,
}

impl Flat {
    /// `None` where the corners cannot be triangulated, which coordinates of [`project`] can.
    fn new(ids: &[u32], corners: Vec<DVec2>, reading: &Reading<'_>) -> Result<Option<Self>, ReadError> {
        // Corners at one place are one; the first gives the id.
        let mut rank: HashMap<[u64; 2], usize> = HashMap::with_capacity(corners.len());
        let mut places: Vec<Corner> = Vec::with_capacity(corners.len());
        let mut run: Vec<usize> = Vec::with_capacity(corners.len());
        for (&id, &p) in ids.iter().zip(&corners) {
            // −0 and 0 are one place.
            let key = [(p.x + 0.0).to_bits(), (p.y + 0.0).to_bits()];
            run.push(*rank.entry(key).or_insert_with(|| {
                places.push(Corner { at: Point2::new(p.x, p.y), id, rank: places.len() });
                places.len() - 1
            }));
        }
        let count = places.len();
        let plane = if count <= MOST_AT_BULK { Plane::bulk_load(places).ok() } else { inserted(&places, reading)? };
        let Some(mut plane) = plane else { return Ok(None) };
        let mut handles: Vec<Option<FixedVertexHandle>> = vec![None; count];
        plane.vertices().for_each(|v| handles[v.data().rank] = Some(v.fix()));
        let mut times = vec![0u32; plane.num_undirected_edges()];
        for i in scattered(run.len()) {
            reading.go_on()?;
            let from = run[i];
            let to = run[(i + 1) % run.len()];
            let (Some(a), Some(b)) = (handles[from], handles[to]) else { return Ok(None) };
            if from == to {
                continue;
            }
            let edges = plane.try_add_constraint(a, b);
            if edges.is_empty() {
                return Ok(Some(Self { plane, corners, times: None }));
            }
            for edge in edges {
                times[edge.as_undirected().index()] += 1;
            }
        }
        Ok(Some(Self { plane, corners, times: Some(times) }))
    }

    /// The triangles inside; `None` where edges cross.
    fn by_parity(&self) -> Option<Vec<[u32; 3]>> {
        let inside = sides(&self.plane, self.times.as_ref()?);
        let faces = self.plane.inner_faces().filter(|f| inside[f.fix().index()] == Some(true));
        Some(faces.map(|f| f.vertices().map(|v| v.data().id)).collect())
    }

    /// The triangles around whose middle the polygon goes, turned as it goes. Where edges cross there is no corner, so the
    /// rim is off there by parts of a triangle.
    fn by_winding(&self) -> Vec<[u32; 3]> {
        let turned = |[a, b, c]: [Corner; 3]| {
            let at = |v: Corner| DVec2::new(v.at.x, v.at.y);
            match winding(&self.corners, (at(a) + at(b) + at(c)) / 3.0) {
                0 => None,
                n if n > 0 => Some([a.id, b.id, c.id]),
                _ => Some([a.id, c.id, b.id]),
            }
        };
        self.plane.inner_faces().filter_map(|f| turned(f.vertices().map(|v| *v.data()))).collect()
    }
}

/// The triangulation of many places, one after the other, each looked for beside its nearest neighbour in the polygon so far. All at once,
/// those that lie on a line with others take as many steps as there are places. `None` where all lie on a line.
fn inserted(places: &[Corner], reading: &Reading<'_>) -> Result<Option<Plane>, ReadError> {
    let at = |i: usize| DVec2::new(places[i].at.x, places[i].at.y);
    let most = |measure: &dyn Fn(usize) -> f64| (0..places.len()).max_by(|a, b| measure(*a).total_cmp(&measure(*b)));
    let far = most(&|i| at(i).distance_squared(at(0))).unwrap_or(0);
    // With these three it has a triangle before anything else is looked for.
    let off = most(&|i| turn(at(0), at(far), at(i)).abs()).filter(|i| turn(at(0), at(far), at(*i)) != 0.0);
    let Some(off) = off else { return Ok(None) };
    let mut plane = Plane::new();
    let mut handles: Vec<Option<FixedVertexHandle>> = vec![None; places.len()];
    for i in [0, far, off].into_iter().chain(scattered(places.len())) {
        if handles[i].is_some() {
            continue;
        }
        reading.go_on()?;
        // Without its lowest digit the number of a place is that of one that came before.
        let before = handles[i & i.saturating_sub(1)];
        let handle = match before {
            Some(hint) => plane.insert_with_hint(places[i], hint),
            None => plane.insert(places[i]),
        };
        let Ok(handle) = handle else { return Ok(None) };
        handles[i] = Some(handle);
    }
    Ok(Some(plane))
}

/// 0 to n − 1, halves before quarters before eighths: an edge of the polygon crosses the triangles between its nearest
/// neighbours so far. In their own order, the edges of a zigzag would each cross all that are to come.
fn scattered(n: usize) -> impl Iterator<Item = usize> {
    let bits = n.next_power_of_two().trailing_zeros();
    (0..1usize << bits).map(move |i| i.reverse_bits().unbounded_shr(usize::BITS - bits)).filter(move |i| *i < n)
}

/// How often the polygon goes around a place, counter-clockwise.
fn winding(corners: &[DVec2], p: DVec2) -> i64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).fold(0, |turns, (a, b)| match (a.y <= p.y, b.y <= p.y) {
        (true, false) if turn(*a, *b, p) > 0.0 => turns + 1,
        (false, true) if turn(*a, *b, p) < 0.0 => turns - 1,
        _ => turns,
    })
}

/// For each face whether it is inside.
fn sides(plane: &Plane, times: &[u32]) -> Vec<Option<bool>> {
    let mut inside = vec![None; plane.num_all_faces()];
    inside[plane.outer_face().fix().index()] = Some(false);
    let mut waiting: Vec<_> = plane.convex_hull().flat_map(|e| [e, e.rev()]).filter(|e| e.is_outer_edge()).collect();
    while let Some(edge) = waiting.pop() {
        let here = edge.face().fix().index();
        let next = edge.rev().face();
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
