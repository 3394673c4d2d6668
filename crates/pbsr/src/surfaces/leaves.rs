//! Cubes as sources of crossings: where the surface is a graph over one face of its cube, and where nothing is known.
//!
//! In a small cube a smooth surface is the graph t = h(u, v) over the face across the axis k along which the gradient is
//! steepest. h is expanded to second order around the foot of the cube's middle, from gradient and Hessian:
//!
//! h_u = −f_u/f_k, h_uv = −(f_uv + f_uk·h_v + f_vk·h_u + f_kk·h_u·h_v)/f_k
//!
//! and tried against the field at places of the face. A line along k then needs one evaluation: h gives the place, f and ∇f
//! there one Newton step and the normal. The face has the line's place (u, v), the surface the area 1/|n_k| = |∇f|/|f_k|
//! over a unit of it.
//!
//! A cube counts as a graph when the gradient at its corners, at places inside and on the face's points of the surface
//! differs by less than [`TURN`] from that in the middle, so that f rises or falls along all its lines. With as steady a
//! gradient, a cube at whose corners f is clearly on one side of c is empty. A cube that is neither, or whose graph is not
//! accurate enough, is divided. If there are too many cubes already, it is left open: its lines are searched for all roots.

use crate::surfaces::implicit::{Cells, ImplicitSurface};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use splat_core::glam;
use std::f64::consts::TAU;

/// Error of h, over the side, with which a graph is left as it is: below [`NEWTON`], one evaluation a line is enough.
const GOOD: f64 = 2.5e-4;

/// Error of h with which a graph is still used where cubes are divided no more.
const USABLE: f64 = 0.03;

/// The last Newton step, over the side. What is left is its square times the relative change of f_k over the cube.
const NEWTON: f64 = 3e-4;

/// The largest change of the gradient in a graph, over the gradient.
const TURN: f64 = 0.4;

/// How far off c the corners of an empty cube are, over |∇f| times the side: what f can differ by from the interpolation of
/// its corners, with a gradient as steady.
const CLEAR: f64 = 0.5 * TURN;

/// The largest 1/|n_k| in a graph; √3 on a plane.
const STEEPEST: f64 = 2.5;

/// The most times that a graph is halved for one evaluation a line, that an open leaf is, and the number of leaves beyond which no open leaf
/// is; beyond half of it no graph is.
const GRAPH_LEVELS: u32 = 2;
const LEVELS: u32 = 5;
const LEAVES: usize = 1 << 18;

/// Both of open leaves that have more than [`WORTH`] lines in a set, each and in the mean of all. A rough surface, such as one through the
/// points of a scan, would have most of its lines in open leaves otherwise, where each is searched.
const MOST_LEVELS: u32 = 8;
const MOST_LEAVES: usize = 1 << 21;
const WORTH: f64 = 0.25;

/// Cubes that are looked at before what was found of them is put together: memory would hold it twice otherwise.
const CHUNK: usize = 1 << 16;

/// Places in a cube where the gradient is looked at beside its corners, on no lattice.
const INSIDE: [DVec3; 4] = [
    DVec3::new(0.31, 0.17, 0.58),
    DVec3::new(0.77, 0.43, 0.22),
    DVec3::new(0.13, 0.69, 0.86),
    DVec3::new(0.59, 0.88, 0.41),
];

/// Places of the face where the graph is tried.
const TRIED: [[f64; 2]; 11] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [1.0, 1.0],
    [0.5, 0.0],
    [0.0, 0.5],
    [1.0, 0.5],
    [0.5, 1.0],
    [0.5, 0.5],
    [0.27, 0.71],
    [0.68, 0.24],
];

/// A cube that may hold a piece of the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaf {
    /// Lowest corner.
    pub(crate) corner: DVec3,
    pub(crate) side: f64,
    /// `None` for an open leaf.
    pub(crate) graph: Option<Graph>,
    /// Greatest |∇f| in an open leaf; infinite where none is known.
    pub(crate) steepest: f32,
}

/// t = h(u, v) over a face; all lengths in sides of the cube.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Graph {
    /// k; u and v are the next axes in turn.
    axis: u8,
    /// An upper bound of 1/|n_k|.
    pub(crate) weight: f32,
    /// How far outside \[0, 1\] h may be where the surface is inside.
    slack: f32,
    /// Coefficients of 1, u, v, u², uv, v², u and v from the middle of the face.
    height: [f32; 6],
}

/// A vector by its components along u, v and k.
#[inline(always)]
fn turned(axis: u8, u: f64, v: f64, t: f64) -> DVec3 {
    match axis {
        0 => DVec3::new(t, u, v),
        1 => DVec3::new(v, t, u),
        _ => DVec3::new(u, v, t),
    }
}

/// Component of a vector along `axis`.
#[inline(always)]
fn along(axis: u8, p: DVec3) -> f64 {
    match axis {
        0 => p.x,
        1 => p.y,
        _ => p.z,
    }
}

impl Leaf {
    /// Bytes of the most leaves, and of what is known of their cubes and of empty ones while they are looked for.
    pub(crate) const MOST_BYTES: usize = MOST_LEAVES * (size_of::<Self>() + size_of::<Cube>() + 2 * size_of::<DVec3>());

    /// All leaves of some cells, level by level, those of larger cubes first; and the cubes that were taken for empty though no bound says
    /// so. A set has so many particles on a unit of area.
    pub(crate) fn subdivide(surface: &ImplicitSurface<'_>, cells: &Cells, per_area: f64) -> (Vec<Self>, Vec<Empty>) {
        let mut leaves = Vec::new();
        let mut empty = Vec::new();
        let mut corners = cells.active.clone();
        let mut side = cells.side;
        // Cubes of the level before that were divided.
        let mut divided = 0;
        let lines_of = |side| Self::open(DVec3::ZERO, side).reach() * per_area;
        let worth = (lines_of(side) * corners.len() as f64 / WORTH) as usize;
        for level in 0..=MOST_LEVELS {
            let (cubes, nothing) = looks(surface, &corners, side);
            drop(corners);
            empty.push(Empty { corners: nothing, side });
            let poor = |error: f64| cubes.iter().filter(|cube| cube.is_poor(error)).count();
            // Of the eighths of a cube so many hold some of the surface: four of a smooth one, fewer of a rough one.
            let held = if divided == 0 { 4.0 } else { cubes.len() as f64 / divided as f64 };
            let more = |poor: usize| ((held - 1.0).max(0.0) * poor as f64) as usize;
            let is_worth = lines_of(side) > WORTH;
            let (deepest, most) =
                if is_worth { (MOST_LEVELS, worth.clamp(LEAVES, MOST_LEAVES)) } else { (LEVELS, LEAVES) };
            let room = |error: f64| if error == GOOD { LEAVES / 2 } else { most };
            let fits = |error: &f64| level < deepest && leaves.len() + cubes.len() + more(poor(*error)) <= room(*error);
            // Where graphs would become too many, open leaves alone are divided: their lines cost the most.
            let errors = [GOOD, USABLE].into_iter().skip(usize::from(level >= GRAPH_LEVELS));
            let error = errors.into_iter().find(fits).unwrap_or(f64::INFINITY);
            let is_divided = |cube: &Cube| error < f64::INFINITY && cube.is_poor(error);
            let large: Vec<DVec3> = cubes.iter().filter(|cube| is_divided(cube)).map(|cube| cube.corner).collect();
            leaves.reserve_exact(cubes.len() - large.len());
            leaves.extend(cubes.iter().filter(|cube| !is_divided(cube)).map(|cube| cube.leaf(side)));
            if large.is_empty() {
                break;
            }
            divided = large.len();
            side *= 0.5;
            let parts = |corner: DVec3| {
                let part = move |k| corner + corner_of(k) * side;
                (0..8).map(part).filter(|part| !surface.excludes(*part, side).0).collect::<Vec<_>>()
            };
            corners = Vec::new();
            large.chunks(CHUNK).for_each(|large| corners.par_extend(large.par_iter().copied().flat_map_iter(parts)));
        }
        leaves.par_iter_mut().filter(|leaf| leaf.graph.is_none()).for_each(|leaf| {
            let radius = 0.75f64.sqrt() * leaf.side * (1.0 + 1e-12);
            let steepest = surface.field.steepest(leaf.corner + 0.5 * leaf.side, radius);
            leaf.steepest = steepest.map_or(f32::INFINITY, |slope| (slope as f32).next_up());
        });
        (leaves, empty)
    }

    /// An open leaf of which no bound is known.
    pub(crate) fn open(corner: DVec3, side: f64) -> Self {
        Self { corner, side, graph: None, steepest: f32::INFINITY }
    }

    /// Lines times area over the surface's density: a line of the leaf meets a flat piece of area A with probability
    /// A/reach, after thinning. For a graph the face times the weight; for an open leaf 2πr² with r half the diagonal.
    pub(crate) fn reach(&self) -> f64 {
        let square = self.side * self.side;
        self.graph.map_or(0.75 * TAU * square, |g| f64::from(g.weight) * square)
    }

    /// Where the line (u, v) of the graph meets the surface, nearly; `None` when it does so out of the cube.
    #[inline(always)]
    pub(crate) fn start(&self, graph: &Graph, place: [f32; 2]) -> Option<DVec3> {
        let [u, v] = place;
        let x = u - 0.5;
        let y = v - 0.5;
        let h = &graph.height;
        let t = h[0] + x * (h[1] + x * h[3] + y * h[4]) + y * (h[2] + y * h[5]);
        // The interval is mirrored onto itself: one comparison, which NaN fails.
        let inside = (t - 0.5).abs() <= 0.5 + graph.slack;
        inside.then(|| self.corner + turned(graph.axis, f64::from(u), f64::from(v), f64::from(t)) * self.side)
    }

    /// The root on the line of a graph from `p` with f − c and ∇f there: the place, and the last gradient over |f_k|.
    /// `None` when it lies out of the cube.
    #[inline(always)]
    pub(crate) fn refine(
        &self,
        surface: &ImplicitSurface<'_>,
        graph: &Graph,
        mut p: DVec3,
        mut f: f64,
        mut gradient: DVec3,
    ) -> Option<(DVec3, DVec3)> {
        let low = along(graph.axis, self.corner);
        for _ in 0..8 {
            let steep = along(graph.axis, gradient);
            let step = -f / steep;
            p += turned(graph.axis, 0.0, 0.0, step);
            if step.abs() <= NEWTON * self.side {
                let t = along(graph.axis, p);
                return (t >= low && t < low + self.side).then(|| (p, gradient / steep.abs()));
            }
            // A step that leaves the neighbourhood, or is not a number.
            if (along(graph.axis, p) - low - 0.5 * self.side).abs().partial_cmp(&self.side)
                != Some(std::cmp::Ordering::Less)
            {
                return None;
            }
            (f, gradient) = surface.field.value_gradient(p);
            f -= surface.level;
        }
        None
    }

    /// Both ends of the line (u, v) of the graph in the cube.
    pub(crate) fn ends(&self, graph: &Graph, place: [f32; 2]) -> [DVec3; 2] {
        let [u, v] = place;
        [0.0, 1.0].map(|t| self.corner + turned(graph.axis, f64::from(u), f64::from(v), t) * self.side)
    }
}

/// Cubes of a level that were taken for empty.
pub(crate) struct Empty {
    /// Lowest corners.
    pub(crate) corners: Vec<DVec3>,
    pub(crate) side: f64,
}

/// A cube that may hold some of the surface.
struct Cube {
    /// Lowest corner.
    corner: DVec3,
    /// A graph, and its largest error found.
    graph: Option<(Graph, f64)>,
}

impl Cube {
    /// Whether smaller cubes are wanted, where a graph may have this error.
    fn is_poor(&self, most: f64) -> bool {
        self.graph.is_none_or(|(_, error)| error > most)
    }

    /// The leaf of a cube that stays as it is.
    fn leaf(&self, side: f64) -> Leaf {
        let graph = self.graph.filter(|(_, error)| *error <= USABLE).map(|(graph, _)| graph);
        Leaf { graph, ..Leaf::open(self.corner, side) }
    }
}

/// A corner of the unit cube.
fn corner_of(k: usize) -> DVec3 {
    DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64)
}

/// What cubes hold, and those that are empty.
fn looks(surface: &ImplicitSurface<'_>, corners: &[DVec3], side: f64) -> (Vec<Cube>, Vec<DVec3>) {
    let mut cubes = Vec::new();
    let mut nothing = Vec::new();
    for corners in corners.chunks(CHUNK) {
        let looks: Vec<Option<Cube>> = corners.par_iter().map(|corner| look(surface, *corner, side)).collect();
        nothing.extend(corners.iter().zip(&looks).filter(|(_, look)| look.is_none()).map(|(corner, _)| *corner));
        cubes.extend(looks.into_iter().flatten());
    }
    (cubes, nothing)
}

/// Looks at a cube; `None` where the surface is not in it.
fn look(surface: &ImplicitSurface<'_>, corner: DVec3, side: f64) -> Option<Cube> {
    let middle = surface.field.gradient((corner + 0.5 * side).clamp(surface.bounds.min, surface.bounds.max));
    let limit = TURN * TURN * middle.length_squared();
    // False for what is not a number.
    let steady = |g: DVec3| (g - middle).length_squared() <= limit;
    let clear = CLEAR * middle.length() * side;
    let mut above = true;
    let mut below = true;
    for place in (0..8).map(corner_of).chain(INSIDE) {
        let p = (corner + place * side).clamp(surface.bounds.min, surface.bounds.max);
        let (f, gradient) = surface.field.value_gradient(p);
        if !steady(gradient) {
            return Some(Cube { corner, graph: None });
        }
        above &= f - surface.level > clear;
        below &= f - surface.level < -clear;
    }
    if above || below {
        return None;
    }
    let foot = foot(surface, (corner + 0.5 * side).clamp(surface.bounds.min, surface.bounds.max), side)
        .filter(|(_, gradient)| steady(*gradient));
    let graph = foot.and_then(|(foot, gradient)| Graph::new(surface, corner, side, foot, gradient, &steady));
    Some(Cube { corner, graph })
}

impl Graph {
    /// The graph around `foot` and its largest error found, or `None` where it is none.
    fn new(
        surface: &ImplicitSurface<'_>,
        corner: DVec3,
        side: f64,
        foot: DVec3,
        gradient: DVec3,
        steady: &dyn Fn(DVec3) -> bool,
    ) -> Option<(Self, f64)> {
        let size = gradient.abs();
        let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + u8::from(size.z > size.y) };
        let mut graph = Self::taylor(axis, (foot - corner) / side, gradient, surface.field.hessian(foot) * side);
        let mut error = 0.0f64;
        let leaf = Leaf::open(corner, side);
        graph.slack = 0.1;
        for uv in TRIED {
            let Some(p) = leaf.start(&graph, uv.map(|x| x as f32)) else { continue };
            if p.cmplt(surface.bounds.min).any() || p.cmpgt(surface.bounds.max).any() {
                continue;
            }
            let (f, g) = surface.field.value_gradient(p);
            if !steady(g) {
                return None;
            }
            error = error.max(((f - surface.level) / (along(axis, g) * side)).abs());
        }
        graph.slack = (4.0 * error + 1e-4) as f32;
        graph.weight *= (1.005 + 8.0 * error) as f32;
        let usable = graph.height.iter().all(|h| h.is_finite()) && f64::from(graph.weight) <= STEEPEST;
        (usable && error.is_finite()).then_some((graph, error))
    }

    /// The expansion around `foot`, in sides of the cube; `hessian` is that of the field times the side.
    fn taylor(axis: u8, foot: DVec3, gradient: DVec3, hessian: DMat3) -> Self {
        let [u, v, k] = [turned(axis, 1.0, 0.0, 0.0), turned(axis, 0.0, 1.0, 0.0), turned(axis, 0.0, 0.0, 1.0)];
        let steep = gradient.dot(k);
        let hu = -gradient.dot(u) / steep;
        let hv = -gradient.dot(v) / steep;
        let to_u = u + k * hu;
        let to_v = v + k * hv;
        let second = |a: DVec3, b: DVec3| -a.dot(hessian * b) / steep;
        let uu = second(to_u, to_u);
        let uv = second(to_u, to_v);
        let vv = second(to_v, to_v);
        // From the foot to the middle of the face.
        let x = 0.5 - foot.dot(u);
        let y = 0.5 - foot.dot(v);
        let height = foot.dot(k) + hu * x + hv * y + 0.5 * (uu * x * x + vv * y * y) + uv * x * y;
        let slope = [hu + uu * x + uv * y, hv + uv * x + vv * y];
        // √(1 + |∇h|²) is convex where ∇h is linear: greatest at a corner.
        let at_corner = |k: usize| {
            let x = [-0.5, 0.5][k & 1];
            let y = [-0.5, 0.5][k >> 1];
            (1.0 + (slope[0] + uu * x + uv * y).powi(2) + (slope[1] + uv * x + vv * y).powi(2)).sqrt()
        };
        let weight = (0..4).map(at_corner).fold(1.0, f64::max);
        let height = [height, slope[0], slope[1], 0.5 * uu, uv, 0.5 * vv].map(|c| c as f32);
        Self { axis, weight: weight as f32, slack: 0.0, height }
    }
}

/// The place of the surface next to the middle of a cube, and the gradient there; `None` where it is out of the cube by
/// more than its side, or where the field is not smooth enough to find it.
fn foot(surface: &ImplicitSurface<'_>, middle: DVec3, side: f64) -> Option<(DVec3, DVec3)> {
    let mut p = middle;
    for _ in 0..6 {
        let (f, gradient) = surface.field.value_gradient(p);
        let step = gradient * ((surface.level - f) / gradient.length_squared());
        let size = step.length();
        if size <= 1e-6 * side {
            return Some((p, gradient));
        }
        p += step;
        // NaN is not near.
        let near = (p - middle).abs().max_element() <= 1.5 * side;
        if !near {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{DAabb, ScalarField};

    /// A plane folded into ridges that are 0.01 apart along x and along y.
    struct Ridges;

    /// The distance to the nearest multiple of 0.02, and its slope.
    fn ridge(x: f64) -> (f64, f64) {
        let off = x - 0.02 * (x / 0.02).round();
        (off.abs(), off.signum())
    }

    impl ScalarField for Ridges {
        fn value(&self, p: DVec3) -> f64 {
            p.z - ridge(p.x).0 - ridge(p.y).0
        }
        fn gradient(&self, p: DVec3) -> DVec3 {
            DVec3::new(-ridge(p.x).1, -ridge(p.y).1, 1.0)
        }
        fn hessian(&self, _: DVec3) -> DMat3 {
            DMat3::ZERO
        }
        fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
            Some((p.z - radius - 0.02, p.z + radius))
        }
    }

    #[test]
    fn rough_surfaces_are_divided_as_far_as_a_set_has_lines() {
        let bounds = DAabb::around(DVec3::ZERO, DVec3::ONE);
        let surface = ImplicitSurface { field: &Ridges, level: 0.0, bounds, inside: None };
        let cells = Cells::new(&surface, 24);
        let counts = |per_area: f64| {
            let (leaves, _) = Leaf::subdivide(&surface, &cells, per_area);
            let least = leaves.iter().map(|leaf| leaf.side).fold(f64::INFINITY, f64::min);
            // What was divided last.
            let lines = Leaf::open(DVec3::ZERO, 2.0 * least).reach() * per_area;
            assert!(leaves.len() <= if lines > WORTH { MOST_LEAVES } else { LEAVES }, "{}, {lines}", leaves.len());
            (leaves.len(), leaves.iter().filter(|leaf| leaf.graph.is_some()).count())
        };
        let few = counts(1e3);
        let many = counts(1e6);
        assert!(few.0 <= LEAVES && (LEAVES..=MOST_LEAVES).contains(&many.0), "{few:?}, {many:?}");
        // Between the ridges there are graphs.
        assert!(few.1 < 100 && many.1 > 100_000, "{few:?}, {many:?}");
    }
}
