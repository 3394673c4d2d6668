//! Kinds of cells as VTK numbers them.

use super::solid::{self, Solid};

/// VTK's number of a polyhedron.
pub(crate) const POLYHEDRON: u8 = 42;

/// The number of a cell that is left out: no file has it, as VTK's numbers end far below.
pub(super) const HIDDEN: u8 = 255;

/// What a cell of a kind is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    /// Points alone.
    Points,
    /// A copy of a cell of another piece, or one that is not to be seen.
    Hidden,
    Line,
    /// Points around a face.
    Face,
    /// The points of a face row by row.
    Pixel,
    /// Points of triangles, each of which has two of the one before it.
    Strip,
    /// Several faces, each by ranks among the points.
    Faces(&'static [&'static [u8]]),
    /// Corners around a face, and behind them the middles of its edges.
    CurvedFace,
    /// A body by its first points.
    Body(&'static Solid),
    /// A body whose faces stand beside its points.
    Polyhedron,
}

/// How many points a cell has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Points {
    Any,
    Exactly(usize),
    /// These are its corners, and those behind them are not used.
    Corners(usize),
}

/// A kind of cell that is read.
pub(super) struct Kind {
    number: u8,
    pub(super) name: &'static str,
    pub(super) points: Points,
    pub(super) shape: Shape,
}

/// Three triangles at the corners and the one between them.
const CURVED_TRIANGLE: Shape = Shape::Faces(&[&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]]);
/// Four triangles at the corners, and what is between them.
const CURVED_QUAD: Shape = Shape::Faces(&[&[0, 4, 7], &[4, 1, 5], &[5, 2, 6], &[6, 3, 7], &[4, 5, 6], &[4, 6, 7]]);
/// Eight triangles around the middle.
const BIQUADRATIC_QUAD: Shape =
    Shape::Faces(&[&[0, 4, 8], &[4, 1, 8], &[1, 5, 8], &[5, 2, 8], &[2, 6, 8], &[6, 3, 8], &[3, 7, 8], &[7, 0, 8]]);
/// Two quads side by side.
const QUADRATIC_LINEAR_QUAD: Shape = Shape::Faces(&[&[0, 4, 5, 3], &[4, 1, 2, 5]]);

const fn kind(number: u8, name: &'static str, points: Points, shape: Shape) -> Kind {
    Kind { number, name, points, shape }
}

const fn body(number: u8, name: &'static str, points: usize, solid: &'static Solid) -> Kind {
    kind(number, name, Points::Exactly(points), Shape::Body(solid))
}

const fn cut(number: u8, name: &'static str, corners: usize, shape: Shape) -> Kind {
    kind(number, name, Points::Corners(corners), shape)
}

const KINDS: [Kind; 49] = [
    kind(0, "empty cell", Points::Exactly(0), Shape::Points),
    kind(1, "vertex", Points::Exactly(1), Shape::Points),
    kind(2, "poly vertex", Points::Any, Shape::Points),
    kind(3, "line", Points::Exactly(2), Shape::Line),
    kind(4, "poly line", Points::Any, Shape::Line),
    kind(5, "triangle", Points::Exactly(3), Shape::Face),
    kind(6, "triangle strip", Points::Any, Shape::Strip),
    kind(7, "polygon", Points::Any, Shape::Face),
    kind(8, "pixel", Points::Exactly(4), Shape::Pixel),
    kind(9, "quad", Points::Exactly(4), Shape::Face),
    body(10, "tetrahedron", 4, &solid::TETRAHEDRON),
    body(11, "voxel", 8, &solid::VOXEL),
    body(12, "hexahedron", 8, &solid::HEXAHEDRON),
    body(13, "wedge", 6, &solid::WEDGE),
    body(14, "pyramid", 5, &solid::PYRAMID),
    body(15, "pentagonal prism", 10, &solid::PENTAGONAL_PRISM),
    body(16, "hexagonal prism", 12, &solid::HEXAGONAL_PRISM),
    cut(21, "quadratic edge", 2, Shape::Line),
    kind(22, "quadratic triangle", Points::Exactly(6), CURVED_TRIANGLE),
    kind(23, "quadratic quad", Points::Exactly(8), CURVED_QUAD),
    body(24, "quadratic tetrahedron", 10, &solid::QUADRATIC_TETRAHEDRON),
    body(25, "quadratic hexahedron", 20, &solid::QUADRATIC_HEXAHEDRON),
    body(26, "quadratic wedge", 15, &solid::QUADRATIC_WEDGE),
    body(27, "quadratic pyramid", 13, &solid::QUADRATIC_PYRAMID),
    kind(28, "biquadratic quad", Points::Exactly(9), BIQUADRATIC_QUAD),
    body(29, "triquadratic hexahedron", 27, &solid::TRIQUADRATIC_HEXAHEDRON),
    kind(30, "quadratic linear quad", Points::Exactly(6), QUADRATIC_LINEAR_QUAD),
    body(31, "quadratic linear wedge", 12, &solid::QUADRATIC_LINEAR_WEDGE),
    body(32, "biquadratic wedge", 18, &solid::BIQUADRATIC_WEDGE),
    body(33, "biquadratic hexahedron", 24, &solid::BIQUADRATIC_HEXAHEDRON),
    kind(34, "biquadratic triangle", Points::Exactly(7), CURVED_TRIANGLE),
    cut(35, "cubic line", 2, Shape::Line),
    kind(36, "quadratic polygon", Points::Any, Shape::CurvedFace),
    body(37, "triquadratic pyramid", 19, &solid::TRIQUADRATIC_PYRAMID),
    kind(POLYHEDRON, "polyhedron", Points::Any, Shape::Polyhedron),
    cut(68, "Lagrange curve", 2, Shape::Line),
    cut(69, "Lagrange triangle", 3, Shape::Face),
    cut(70, "Lagrange quad", 4, Shape::Face),
    cut(71, "Lagrange tetrahedron", 4, Shape::Body(&solid::TETRAHEDRON)),
    cut(72, "Lagrange hexahedron", 8, Shape::Body(&solid::HEXAHEDRON)),
    cut(73, "Lagrange wedge", 6, Shape::Body(&solid::WEDGE)),
    cut(74, "Lagrange pyramid", 5, Shape::Body(&solid::PYRAMID)),
    cut(75, "Bézier curve", 2, Shape::Line),
    cut(76, "Bézier triangle", 3, Shape::Face),
    cut(77, "Bézier quad", 4, Shape::Face),
    cut(78, "Bézier tetrahedron", 4, Shape::Body(&solid::TETRAHEDRON)),
    cut(79, "Bézier hexahedron", 8, Shape::Body(&solid::HEXAHEDRON)),
    cut(80, "Bézier wedge", 6, Shape::Body(&solid::WEDGE)),
    cut(81, "Bézier pyramid", 5, Shape::Body(&solid::PYRAMID)),
];

const LEFT_OUT: Kind = kind(HIDDEN, "hidden cell", Points::Any, Shape::Hidden);

impl Kind {
    /// The kind of a number, `None` for one that is not read.
    pub(super) fn numbered(number: u8) -> Option<&'static Self> {
        if number == HIDDEN { Some(&LEFT_OUT) } else { KINDS.iter().find(|kind| kind.number == number) }
    }

    /// The same of a cell of so many points: a Lagrange cell of second order is a quadratic one where its points stand alike.
    pub(super) fn of_cell(number: u8, points: usize) -> Option<&'static Self> {
        match (number, points) {
            (69, 6) => Self::numbered(22),
            (70, 9) => Self::numbered(28),
            (71, 10) => Self::numbered(24),
            _ => Self::numbered(number),
        }
    }

    /// Whether it is drawn by its corners alone, of so many points.
    pub(super) fn is_cut(&self, points: usize) -> bool {
        matches!(self.points, Points::Corners(corners) if corners < points)
    }

    /// Refused numbers of points, in words; `None` for as many as it has.
    pub(super) fn refused(&self, points: usize) -> Option<String> {
        match self.points {
            Points::Exactly(needed) if needed != points => Some(needed.to_string()),
            Points::Corners(needed) if needed > points => Some(format!("{needed} or more")),
            _ => None,
        }
    }

    /// Calls `each` with the points around every face of a cell that is a face or several, in the order of its points; returns false for other cells.
    pub(super) fn each_face<E>(
        &self,
        corners: &[u32],
        mut each: impl FnMut(&[u32]) -> Result<(), E>,
    ) -> Result<bool, E> {
        match self.shape {
            Shape::Face => each(self.drawn(corners))?,
            Shape::Faces(parts) => {
                for part in parts {
                    let corners: Vec<u32> = part.iter().map(|rank| corners[usize::from(*rank)]).collect();
                    each(&corners)?;
                }
            }
            Shape::CurvedFace => {
                let half = corners.len() / 2;
                let around = corners[..half].iter().zip(&corners[half..]).flat_map(|(a, b)| [*a, *b]);
                each(&around.collect::<Vec<_>>())?;
            }
            // Its second row runs the other way.
            Shape::Pixel => each(&[corners[0], corners[1], corners[3], corners[2]])?,
            Shape::Strip => {
                for (k, t) in corners.windows(3).enumerate() {
                    each(&if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })?;
                }
            }
            Shape::Points | Shape::Hidden | Shape::Line | Shape::Body(_) | Shape::Polyhedron => return Ok(false),
        }
        Ok(true)
    }

    /// Those of the points of a cell that are drawn.
    pub(super) fn drawn<'c>(&self, points: &'c [u32]) -> &'c [u32] {
        match self.points {
            Points::Corners(corners) => &points[..corners.min(points.len())],
            _ => points,
        }
    }
}

/// The name of a kind that is not read.
pub(super) fn unread(number: u8) -> &'static str {
    match number {
        41 => "a convex point set",
        51..=67 => "a parametric cell",
        _ => "an unknown cell",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volumes::cells::solid::Middle;
    use splat_core::glam::DVec3;

    /// Corners of a body of unit size, as VTK's figures show them; behind them the middles of edges follow.
    fn corners(number: u8) -> Vec<DVec3> {
        let text: &[&str] = match number {
            11 => &["000", "100", "010", "110", "001", "101", "011", "111"],
            12 | 25 | 29 | 33 => &["000", "100", "110", "010", "001", "101", "111", "011"],
            13 => &["000", "010", "100", "001", "011", "101"],
            24 => &["000", "100", "010", "001"],
            26 | 31 | 32 => &["000", "100", "010", "001", "101", "011"],
            15 => &["000", "200", "210", "120", "010", "001", "201", "211", "121", "011"],
            16 => &["100", "200", "210", "120", "020", "010", "101", "201", "211", "121", "021", "011"],
            _ => &["000", "100", "110", "010", "001"],
        };
        let place = |t: &&str| DVec3::from_array(std::array::from_fn(|i| f64::from(t.as_bytes()[i] - b'0')));
        text.iter().map(place).collect()
    }

    /// The edges whose middles stand behind the corners.
    fn edges(number: u8) -> &'static [[usize; 2]] {
        match number {
            24 => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
            25 | 29 | 33 => {
                &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
            }
            26 | 32 => &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
            31 => &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3]],
            27 | 37 => &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
            _ => &[],
        }
    }

    /// All points of a body, those inside faces and inside it too.
    fn places(number: u8, solid: &Solid, points: usize) -> Vec<DVec3> {
        let corners = corners(number);
        let middle = |pair: &[usize; 2]| 0.5 * (corners[pair[0]] + corners[pair[1]]);
        let mut places: Vec<DVec3> = corners.iter().copied().chain(edges(number).iter().map(middle)).collect();
        let whole = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let flat = places.clone();
        places.resize(points, whole);
        for face in solid.faces {
            if let Middle::Point(rank) = face.middle {
                let around = face.around.iter().step_by(2).map(|rank| flat[usize::from(*rank)]);
                places[usize::from(rank)] = around.sum::<DVec3>() / (face.around.len() / 2) as f64;
            }
        }
        places
    }

    #[test]
    fn faces_close_a_body_are_wound_alike_and_enclose_its_volume() {
        let bodies = KINDS.iter().filter_map(|kind| match (kind.shape, kind.points) {
            (Shape::Body(solid), Points::Exactly(points)) if !solid.faces.is_empty() => Some((kind, solid, points)),
            _ => None,
        });
        let mut count = 0;
        for (kind, solid, points) in bodies {
            count += 1;
            let volume = match kind.number {
                11 | 12 | 25 | 29 | 33 => 1.0,
                13 | 26 | 31 | 32 => 0.5,
                24 => 1.0 / 6.0,
                15 | 16 => 3.0,
                _ => 1.0 / 3.0,
            };
            let places = places(kind.number, solid, points);
            assert_eq!(places.len(), points, "{}", kind.name);
            let mut edges: Vec<[u8; 2]> = Vec::new();
            let mut enclosed = 0.0;
            for face in solid.faces {
                let around = face.around;
                edges.extend((0..around.len()).map(|i| [around[i], around[(i + 1) % around.len()]]));
                let place = |i: usize| places[around[i] as usize];
                let fan = 1..around.len() - 1;
                enclosed += fan.map(|i| place(0).dot(place(i).cross(place(i + 1))) / 6.0).sum::<f64>();
            }
            assert!(edges.iter().all(|[a, b]| edges.contains(&[*b, *a])), "{}", kind.name);
            assert!((enclosed.abs() - volume).abs() < 1e-12, "{}: {enclosed}", kind.name);
            let used: std::collections::BTreeSet<u8> = edges.concat().into_iter().collect();
            let middles = solid.faces.iter().filter(|face| matches!(face.middle, Middle::Point(_))).count();
            let inside = usize::from(matches!(solid.middle, Middle::Point(_)));
            assert_eq!(used.len() + middles + inside, points, "{}", kind.name);
        }
        assert_eq!(count, 15);
    }

    /// The middle of the points of a straight body is that of the body, or a field that is linear would not stay so.
    #[test]
    fn weights_of_a_middle_are_one_together() {
        for kind in &KINDS {
            let (Shape::Body(solid), Points::Exactly(points)) = (kind.shape, kind.points) else { continue };
            if let Middle::Groups(groups) = solid.middle {
                assert_eq!(groups.iter().map(|(n, _)| usize::from(*n)).sum::<usize>(), points, "{}", kind.name);
                let sum: f64 = groups.iter().map(|(n, weight)| f64::from(*n) * weight).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{}", kind.name);
            }
            for face in solid.faces {
                if let Middle::Alternating(corner, edge) = face.middle {
                    let half = face.around.len() as f64 / 2.0;
                    assert!((half * (corner + edge) - 1.0).abs() < 1e-12, "{}", kind.name);
                }
            }
        }
    }
}
