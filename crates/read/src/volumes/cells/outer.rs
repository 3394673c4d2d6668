//! The faces around bodies: those that one body alone has.
//!
//! Two bodies share a face where its points lie at the same places: pieces of a dataset have points of their own there.

use super::kind::Kind;
use super::solid::Middle;
use super::{Cells, Faces};
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::DVec3;

/// Faces of a tetrahedron, of which [`super::solid::TETRAHEDRON`] has none.
const OF_TETRAHEDRON: [[u8; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// Points of a face by which it is told from others: faces with as many points that share these four lie on each other.
const TELLING: usize = 4;

/// Bytes that a face takes until it is known whether it is outside: its entries, and four points.
const BYTES_PER_FACE: u64 = (size_of::<Face>() + size_of::<Keyed>() + TELLING * size_of::<u32>()) as u64;

/// Bytes that a point takes until those at one place are found.
const BYTES_PER_PLACE: u64 = 2 * size_of::<u32>() as u64;

/// Faces, each with the cell that it is of.
#[derive(Default)]
pub(super) struct OuterFaces {
    list: Vec<Face>,
    corners: Vec<u32>,
}

/// A face of a body, or a part of it.
#[derive(Clone, Copy)]
struct Face {
    cell: u32,
    /// Where its points end among those of all faces.
    end: usize,
    bend: Bend,
}

/// How a face lies between its points.
#[derive(Clone, Copy)]
enum Bend {
    /// As a polygon does.
    Polygon,
    /// Every second of its points is the middle of an edge.
    MiddlesOfEdges,
    /// This point is its middle.
    Middle(u32),
}

/// A face with what tells it from others.
#[derive(Clone, Copy)]
struct Keyed {
    key: Key,
    /// Its rank among all faces.
    rank: usize,
}

/// The lowest points of a face, and how many it has.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    lowest: [u32; TELLING],
    count: usize,
}

impl OuterFaces {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.list.len()
    }

    /// The cell of each, and the points around it.
    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, &[u32])> {
        (0..self.len()).map(|rank| (self.list[rank].cell, self.around(rank)))
    }

    fn around(&self, rank: usize) -> &[u32] {
        let start = rank.checked_sub(1).map_or(0, |before| self.list[before].end);
        &self.corners[start..self.list[rank].end]
    }

    fn push(&mut self, cell: u32, around: &[u32], bend: Bend) {
        self.corners.extend(around);
        self.list.push(Face { cell, end: self.corners.len(), bend });
    }

    /// The polygons that a face is drawn as.
    fn push_parts(&mut self, face: Face, around: &[u32]) {
        let count = around.len();
        match face.bend {
            Bend::Polygon => self.push(face.cell, around, Bend::Polygon),
            Bend::Middle(middle) => {
                for i in 0..count {
                    self.push(face.cell, &[around[i], around[(i + 1) % count], middle], Bend::Polygon);
                }
            }
            Bend::MiddlesOfEdges => {
                for corner in (0..count).step_by(2) {
                    let before = around[(corner + count - 1) % count];
                    self.push(face.cell, &[before, around[corner], around[corner + 1]], Bend::Polygon);
                }
                let middles: Vec<u32> = around.iter().skip(1).step_by(2).copied().collect();
                self.push(face.cell, &middles, Bend::Polygon);
            }
        }
    }
}

/// The faces around the bodies, in the order of these, and behind them the cells that are faces by themselves and lie on none of a body.
pub(super) fn faces(cells: &Cells, reading: &mut Reading<'_>) -> Result<OuterFaces, ReadError> {
    let place_of = first_at_place(&cells.points, reading)?;
    let of_bodies = faces_of_bodies(cells, reading)?;
    reading.go_on()?;
    let mut keyed: Vec<Keyed> = Vec::new();
    input::reserve(&mut keyed, of_bodies.len())?;
    let with_key = |rank: usize| key(of_bodies.around(rank), &place_of).map(|key| Keyed { key, rank });
    keyed.extend((0..of_bodies.len()).filter_map(with_key));
    keyed.sort_unstable_by_key(|face| (face.key, face.rank));
    let mut outer: Vec<usize> =
        keyed.chunk_by(|a, b| a.key == b.key).filter(|same| same.len() == 1).map(|same| same[0].rank).collect();
    outer.sort_unstable();
    let mut found = OuterFaces::default();
    for rank in outer {
        found.push_parts(of_bodies.list[rank], of_bodies.around(rank));
    }
    for (cell, (number, corners)) in cells.kinds.iter().zip(cells.lists.iter()).enumerate() {
        let Some(kind) = Kind::of_cell(*number, corners.len()) else { continue };
        kind.each_face(corners, |face| {
            let is_of_body =
                key(face, &place_of).is_none_or(|key| keyed.binary_search_by_key(&key, |face| face.key).is_ok());
            if !is_of_body {
                found.push(cell as u32, face, Bend::Polygon);
            }
            Ok::<(), ReadError>(())
        })?;
    }
    Ok(found)
}

/// The faces of all bodies, those that two of them share twice.
fn faces_of_bodies(cells: &Cells, reading: &Reading<'_>) -> Result<OuterFaces, ReadError> {
    let mut of_bodies = OuterFaces::default();
    for body in cells.bodies() {
        let cell = body.cell as u32;
        let point = |rank: &u8| body.corners[usize::from(*rank)];
        match &body.faces {
            Faces::Of(solid) if solid.faces.is_empty() => {
                OF_TETRAHEDRON.iter().for_each(|face| of_bodies.push(cell, &face.each_ref().map(point), Bend::Polygon));
            }
            Faces::Of(solid) => {
                for face in solid.faces {
                    let around: Vec<u32> = face.around.iter().map(point).collect();
                    let bend = match &face.middle {
                        Middle::Point(middle) => Bend::Middle(point(middle)),
                        Middle::Alternating(..) => Bend::MiddlesOfEdges,
                        Middle::Mean | Middle::Groups(_) => Bend::Polygon,
                    };
                    of_bodies.push(cell, &around, bend);
                }
            }
            Faces::Around(faces, _) => faces.iter().for_each(|face| of_bodies.push(cell, face, Bend::Polygon)),
        }
        input::hold("the faces of cells", of_bodies.len() as u64 * BYTES_PER_FACE, reading.params)?;
    }
    Ok(of_bodies)
}

/// The key of a face, which faces on each other share; `None` of a face whose points lie at fewer than three places: it has no area.
fn key(around: &[u32], place_of: &[u32]) -> Option<Key> {
    let mut places: Vec<u32> = around.iter().map(|point| place_of[*point as usize]).collect();
    places.sort_unstable();
    places.dedup();
    let mut lowest = [u32::MAX; TELLING];
    lowest.iter_mut().zip(&places).for_each(|(lowest, place)| *lowest = *place);
    (places.len() >= 3).then_some(Key { lowest, count: places.len() })
}

/// For each point the first one at its place.
fn first_at_place(points: &[DVec3], reading: &Reading<'_>) -> Result<Vec<u32>, ReadError> {
    input::hold("the places of points", points.len() as u64 * BYTES_PER_PLACE, reading.params)?;
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let bits = |point: &u32| (points[*point as usize] + 0.0).to_array().map(f64::to_bits);
    order.sort_unstable_by_key(|point| (bits(point), *point));
    let mut first = vec![0; points.len()];
    for same in order.chunk_by(|a, b| bits(a) == bits(b)) {
        same.iter().for_each(|point| first[*point as usize] = same[0]);
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadParams;
    use crate::error::Place;
    use crate::volumes::cells::{CellSource, Lists};

    /// A row of hexahedra of unit size along x; with `own_points` each has points of its own.
    fn row(count: u32, own_points: bool) -> Cells {
        let mut points = Vec::new();
        let mut corners = Vec::new();
        for cell in 0..count {
            for [x, y, z] in [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]] {
                let place = DVec3::new(f64::from(cell + x), f64::from(y), f64::from(z));
                let known = points.iter().position(|p| *p == place).filter(|_| !own_points);
                corners.push(known.unwrap_or(points.len()) as f64);
                if known.is_none() {
                    points.push(place);
                }
            }
        }
        let ends: Vec<f64> = (1..=count).map(|cell| f64::from(8 * cell)).collect();
        let source = CellSource { points: points.len(), kinds: &[], place: Place::File };
        let lists = Lists::ending(&ends, &corners, source).unwrap();
        Cells { points, lists, kinds: vec![12; count as usize], place: Place::File }
    }

    fn outer(cells: &Cells) -> OuterFaces {
        faces(cells, &mut Reading::new(&ReadParams::default(), None)).unwrap()
    }

    #[test]
    fn faces_between_cells_are_left_out_also_where_cells_have_points_of_their_own() {
        for own_points in [false, true] {
            let found = outer(&row(3, own_points));
            assert_eq!(found.len(), 2 + 3 * 4, "{own_points}");
            assert!(found.iter().map(|(cell, _)| cell).is_sorted());
        }
    }

    #[test]
    fn a_face_on_a_body_is_drawn_once_and_another_beside_it() {
        let mut cells = row(1, false);
        let place = Place::File;
        cells.points.push(DVec3::new(0.0, 0.0, 5.0));
        let source = CellSource { points: cells.points.len(), kinds: &[], place };
        let faces = Lists::ending(&[4.0, 7.0], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0], source).unwrap();
        cells.append(&faces, 7);
        let found = outer(&cells);
        assert_eq!(found.len(), 6 + 1);
        assert_eq!(found.iter().last(), Some((2, &[4, 5, 8][..])));
    }

    #[test]
    fn a_curved_face_goes_through_the_middles_of_its_edges() {
        let mut parts = OuterFaces::default();
        let face = |bend| Face { cell: 3, end: 0, bend };
        parts.push_parts(face(Bend::MiddlesOfEdges), &[0, 4, 1, 5, 2, 6]);
        let found: Vec<&[u32]> = parts.iter().map(|part| part.1).collect();
        assert_eq!(found, [&[6, 0, 4][..], &[4, 1, 5], &[5, 2, 6], &[4, 5, 6]]);
        let mut parts = OuterFaces::default();
        parts.push_parts(face(Bend::Middle(9)), &[0, 1, 2]);
        let found: Vec<&[u32]> = parts.iter().map(|part| part.1).collect();
        assert_eq!(found, [&[0, 1, 9][..], &[1, 2, 9], &[2, 0, 9]]);
    }
}
