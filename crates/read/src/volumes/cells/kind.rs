//! Kinds of cells as VTK numbers them.

/// What a cell of a kind is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// Points alone.
    Points,
    Line,
    /// Points around a face.
    Face,
    /// The points of a face row by row.
    Pixel,
    /// Points of triangles, each of which has two of the one before it.
    Strip,
    /// The faces around a body, seen from outside counter-clockwise; a tetrahedron has none and is itself.
    Body(&'static [&'static [u8]]),
}

/// A kind of cell that is read.
pub(super) struct Kind {
    number: u8,
    pub(super) name: &'static str,
    /// How many points it has, if that is one number.
    pub(super) corners: Option<usize>,
    pub(super) shape: Shape,
}

const VOXEL: &[&[u8]] = &[&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];
const HEXAHEDRON: &[&[u8]] =
    &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];
const WEDGE: &[&[u8]] = &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]];
const PYRAMID: &[&[u8]] = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

const fn kind(number: u8, name: &'static str, corners: Option<usize>, shape: Shape) -> Kind {
    Kind { number, name, corners, shape }
}

const KINDS: [Kind; 15] = [
    kind(0, "empty cell", Some(0), Shape::Points),
    kind(1, "vertex", Some(1), Shape::Points),
    kind(2, "poly vertex", None, Shape::Points),
    kind(3, "line", Some(2), Shape::Line),
    kind(4, "poly line", None, Shape::Line),
    kind(5, "triangle", Some(3), Shape::Face),
    kind(6, "triangle strip", None, Shape::Strip),
    kind(7, "polygon", None, Shape::Face),
    kind(8, "pixel", Some(4), Shape::Pixel),
    kind(9, "quad", Some(4), Shape::Face),
    kind(10, "tetrahedron", Some(4), Shape::Body(&[])),
    kind(11, "voxel", Some(8), Shape::Body(VOXEL)),
    kind(12, "hexahedron", Some(8), Shape::Body(HEXAHEDRON)),
    kind(13, "wedge", Some(6), Shape::Body(WEDGE)),
    kind(14, "pyramid", Some(5), Shape::Body(PYRAMID)),
];

impl Kind {
    /// The kind of a number, `None` for one that is not read.
    pub(super) fn of(number: u8) -> Option<&'static Self> {
        KINDS.iter().find(|kind| kind.number == number)
    }
}

/// The name of a kind that is not read.
pub(super) fn unread(number: u8) -> &'static str {
    match number {
        15 => "a pentagonal prism",
        16 => "a hexagonal prism",
        21 => "a quadratic edge",
        22 => "a quadratic triangle",
        23 => "a quadratic quad",
        24 => "a quadratic tetrahedron",
        25 => "a quadratic hexahedron",
        26 => "a quadratic wedge",
        27 => "a quadratic pyramid",
        28..=37 => "another quadratic cell",
        41 => "a convex point set",
        42 => "a polyhedron",
        51..=67 => "a parametric cell",
        68..=74 => "a Lagrange cell",
        75..=81 => "a Bézier cell",
        _ => "an unknown cell",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::DVec3;

    /// Places of the points of a body of unit size, as VTK's figures show them.
    fn places(number: u8) -> Vec<DVec3> {
        let text: &[&str] = match number {
            11 => &["000", "100", "010", "110", "001", "101", "011", "111"],
            12 => &["000", "100", "110", "010", "001", "101", "111", "011"],
            13 => &["000", "010", "100", "001", "011", "101"],
            _ => &["000", "100", "110", "010", "001"],
        };
        let place = |t: &&str| DVec3::from_array(std::array::from_fn(|i| f64::from(t.as_bytes()[i] - b'0')));
        text.iter().map(place).collect()
    }

    #[test]
    fn faces_close_a_body_and_face_outwards() {
        for (number, volume) in [(11, 1.0), (12, 1.0), (13, 0.5), (14, 1.0 / 3.0)] {
            let kind = Kind::of(number).unwrap();
            let places = places(number);
            let Shape::Body(faces) = kind.shape else { panic!("a body") };
            assert_eq!(places.len(), kind.corners.unwrap());
            let mut edges: Vec<[u8; 2]> = Vec::new();
            let mut enclosed = 0.0;
            for face in faces {
                edges.extend((0..face.len()).map(|i| [face[i], face[(i + 1) % face.len()]]));
                let at = |i: usize| places[face[i] as usize];
                enclosed += (1..face.len() - 1).map(|i| at(0).dot(at(i).cross(at(i + 1))) / 6.0).sum::<f64>();
            }
            assert!(edges.iter().all(|[a, b]| edges.contains(&[*b, *a])), "{}", kind.name);
            assert!((enclosed - volume).abs() < 1e-12, "{}: {enclosed}", kind.name);
        }
    }
}
