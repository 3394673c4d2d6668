//! The faces around the bodies of VTK, and how middles follow from their points.
//!
//! Points of a face are listed around it; of a curved one every second is the middle of an edge. The numbering is that of the figures of VTK's
//! file formats; faces are wound alike throughout a body.

/// How the middle of a face or a body follows from its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Middle {
    /// Their mean.
    Mean,
    /// One of the points of the cell.
    Point(u8),
    /// Every second one, a corner, by the first weight and every other one, of an edge, by the second.
    Alternating(f64, f64),
    /// So many points by each weight, one group behind the other.
    Groups(&'static [(u8, f64)]),
}

/// A face of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    /// Its points around it.
    pub(super) around: &'static [u8],
    pub(super) middle: Middle,
}

/// A body with faces around it.
#[derive(Debug)]
pub(super) struct Solid {
    /// None of a tetrahedron, which is itself.
    pub(super) faces: &'static [Face],
    pub(super) middle: Middle,
}

const fn flat(around: &'static [u8]) -> Face {
    Face { around, middle: Middle::Mean }
}

const fn curved(around: &'static [u8], middle: Middle) -> Face {
    Face { around, middle }
}

/// Weights of the corners and the edges at the middle of a triangle of six points.
const TRIANGLE: Middle = Middle::Alternating(-1.0 / 9.0, 4.0 / 9.0);
/// The same of a quad of eight points.
const QUAD: Middle = Middle::Alternating(-0.25, 0.5);

const fn solid(faces: &'static [Face]) -> Solid {
    Solid { faces, middle: Middle::Mean }
}

/// A tetrahedron.
pub(super) const TETRAHEDRON: Solid = solid(&[]);

/// Faces of a voxel, whose points stand row by row.
pub(super) const VOXEL: Solid = solid(&[
    flat(&[0, 2, 3, 1]),
    flat(&[4, 5, 7, 6]),
    flat(&[0, 1, 5, 4]),
    flat(&[2, 6, 7, 3]),
    flat(&[0, 4, 6, 2]),
    flat(&[1, 3, 7, 5]),
]);
pub(super) const HEXAHEDRON: Solid = solid(&[
    flat(&[0, 3, 2, 1]),
    flat(&[4, 5, 6, 7]),
    flat(&[0, 1, 5, 4]),
    flat(&[1, 2, 6, 5]),
    flat(&[2, 3, 7, 6]),
    flat(&[3, 0, 4, 7]),
]);
pub(super) const WEDGE: Solid =
    solid(&[flat(&[0, 1, 2]), flat(&[3, 5, 4]), flat(&[0, 3, 4, 1]), flat(&[1, 4, 5, 2]), flat(&[2, 5, 3, 0])]);
pub(super) const PYRAMID: Solid =
    solid(&[flat(&[0, 3, 2, 1]), flat(&[0, 1, 4]), flat(&[1, 2, 4]), flat(&[2, 3, 4]), flat(&[3, 0, 4])]);
pub(super) const PENTAGONAL_PRISM: Solid = Solid {
    faces: &[
        flat(&[0, 4, 3, 2, 1]),
        flat(&[5, 6, 7, 8, 9]),
        flat(&[0, 1, 6, 5]),
        flat(&[1, 2, 7, 6]),
        flat(&[2, 3, 8, 7]),
        flat(&[3, 4, 9, 8]),
        flat(&[4, 0, 5, 9]),
    ],
    middle: Middle::Mean,
};
pub(super) const HEXAGONAL_PRISM: Solid = Solid {
    faces: &[
        flat(&[0, 5, 4, 3, 2, 1]),
        flat(&[6, 7, 8, 9, 10, 11]),
        flat(&[0, 1, 7, 6]),
        flat(&[1, 2, 8, 7]),
        flat(&[2, 3, 9, 8]),
        flat(&[3, 4, 10, 9]),
        flat(&[4, 5, 11, 10]),
        flat(&[5, 0, 6, 11]),
    ],
    middle: Middle::Mean,
};
pub(super) const QUADRATIC_TETRAHEDRON: Solid = Solid {
    faces: &[
        curved(&[0, 4, 1, 8, 3, 7], TRIANGLE),
        curved(&[1, 5, 2, 9, 3, 8], TRIANGLE),
        curved(&[2, 6, 0, 7, 3, 9], TRIANGLE),
        curved(&[0, 6, 2, 5, 1, 4], TRIANGLE),
    ],
    middle: Middle::Groups(&[(4, -0.125), (6, 0.25)]),
};
pub(super) const QUADRATIC_HEXAHEDRON: Solid = Solid {
    faces: &[
        curved(&[0, 16, 4, 15, 7, 19, 3, 11], QUAD),
        curved(&[1, 9, 2, 18, 6, 13, 5, 17], QUAD),
        curved(&[0, 8, 1, 17, 5, 12, 4, 16], QUAD),
        curved(&[3, 19, 7, 14, 6, 18, 2, 10], QUAD),
        curved(&[0, 11, 3, 10, 2, 9, 1, 8], QUAD),
        curved(&[4, 12, 5, 13, 6, 14, 7, 15], QUAD),
    ],
    middle: Middle::Groups(&[(8, -0.25), (12, 0.25)]),
};
pub(super) const QUADRATIC_WEDGE: Solid = Solid {
    faces: &[
        curved(&[0, 8, 2, 7, 1, 6], TRIANGLE),
        curved(&[3, 9, 4, 10, 5, 11], TRIANGLE),
        curved(&[0, 6, 1, 13, 4, 9, 3, 12], QUAD),
        curved(&[1, 7, 2, 14, 5, 10, 4, 13], QUAD),
        curved(&[2, 8, 0, 12, 3, 11, 5, 14], QUAD),
    ],
    middle: Middle::Groups(&[(6, -2.0 / 9.0), (6, 2.0 / 9.0), (3, 1.0 / 3.0)]),
};
pub(super) const QUADRATIC_PYRAMID: Solid = Solid {
    faces: &[
        curved(&[0, 8, 3, 7, 2, 6, 1, 5], QUAD),
        curved(&[0, 5, 1, 10, 4, 9], TRIANGLE),
        curved(&[1, 6, 2, 11, 4, 10], TRIANGLE),
        curved(&[2, 7, 3, 12, 4, 11], TRIANGLE),
        curved(&[3, 8, 0, 9, 4, 12], TRIANGLE),
    ],
    middle: Middle::Mean,
};
pub(super) const TRIQUADRATIC_HEXAHEDRON: Solid = Solid {
    faces: &[
        curved(&[0, 16, 4, 15, 7, 19, 3, 11], Middle::Point(20)),
        curved(&[1, 9, 2, 18, 6, 13, 5, 17], Middle::Point(21)),
        curved(&[0, 8, 1, 17, 5, 12, 4, 16], Middle::Point(22)),
        curved(&[3, 19, 7, 14, 6, 18, 2, 10], Middle::Point(23)),
        curved(&[0, 11, 3, 10, 2, 9, 1, 8], Middle::Point(24)),
        curved(&[4, 12, 5, 13, 6, 14, 7, 15], Middle::Point(25)),
    ],
    middle: Middle::Point(26),
};
pub(super) const QUADRATIC_LINEAR_WEDGE: Solid = Solid {
    faces: &[
        curved(&[0, 8, 2, 7, 1, 6], TRIANGLE),
        curved(&[3, 9, 4, 10, 5, 11], TRIANGLE),
        flat(&[0, 6, 1, 4, 9, 3]),
        flat(&[1, 7, 2, 5, 10, 4]),
        flat(&[2, 8, 0, 3, 11, 5]),
    ],
    middle: Middle::Groups(&[(6, -1.0 / 18.0), (6, 2.0 / 9.0)]),
};
pub(super) const BIQUADRATIC_WEDGE: Solid = Solid {
    faces: &[
        curved(&[0, 8, 2, 7, 1, 6], TRIANGLE),
        curved(&[3, 9, 4, 10, 5, 11], TRIANGLE),
        curved(&[0, 6, 1, 13, 4, 9, 3, 12], Middle::Point(15)),
        curved(&[1, 7, 2, 14, 5, 10, 4, 13], Middle::Point(16)),
        curved(&[2, 8, 0, 12, 3, 11, 5, 14], Middle::Point(17)),
    ],
    middle: Middle::Groups(&[(12, 0.0), (3, -1.0 / 9.0), (3, 4.0 / 9.0)]),
};
pub(super) const BIQUADRATIC_HEXAHEDRON: Solid = Solid {
    faces: &[
        curved(&[0, 16, 4, 15, 7, 19, 3, 11], Middle::Point(20)),
        curved(&[1, 9, 2, 18, 6, 13, 5, 17], Middle::Point(21)),
        curved(&[0, 8, 1, 17, 5, 12, 4, 16], Middle::Point(22)),
        curved(&[3, 19, 7, 14, 6, 18, 2, 10], Middle::Point(23)),
        curved(&[0, 11, 3, 10, 2, 9, 1, 8], QUAD),
        curved(&[4, 12, 5, 13, 6, 14, 7, 15], QUAD),
    ],
    middle: Middle::Groups(&[(16, 0.0), (4, -0.25), (4, 0.5)]),
};
pub(super) const TRIQUADRATIC_PYRAMID: Solid = Solid {
    faces: &[
        curved(&[0, 8, 3, 7, 2, 6, 1, 5], Middle::Point(13)),
        curved(&[0, 5, 1, 10, 4, 9], Middle::Point(14)),
        curved(&[1, 6, 2, 11, 4, 10], Middle::Point(15)),
        curved(&[2, 7, 3, 12, 4, 11], Middle::Point(16)),
        curved(&[3, 8, 0, 9, 4, 12], Middle::Point(17)),
    ],
    middle: Middle::Point(18),
};
