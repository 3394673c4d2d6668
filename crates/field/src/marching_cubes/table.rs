//! The triangles of the 256 cases of a cell, derived from one rule for its faces.
//!
//! Corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1); a case has bit c set where the value is at or above the isovalue. Edge
//! 4a + u + 2v runs along axis a, at u on the axis after it and at v on the one after that.
//!
//! On a face the surface cuts off every run of corners below the isovalue, so two such corners on a diagonal stay
//! apart. The rule sees the face alone: both cells of a face draw the same lines on it, and the surface has no cracks.
//! Going around each face counter-clockwise seen from outside, a line leads from where a run begins to where it
//! ends; each crossed edge begins a run on one of its faces and ends one on the other, so lines join to closed polygons.
//! Polygons are cut along diagonals that lie in no face: a diagonal in a face could meet its like of the other cell
//! and make an edge of four triangles.

use std::sync::LazyLock;

/// The triangles of each case.
pub(super) struct Table {
    /// Three edges a triangle, counter-clockwise seen from where values are above.
    pub(super) triangles: [Vec<[u8; 3]>; 256],
}

/// The table, made when it is first used.
pub(super) static TABLE: LazyLock<Table> =
    LazyLock::new(|| Table { triangles: std::array::from_fn(|case| triangles(case as u8)) });

/// The edge between two corners that differ in one axis.
fn edge_between(a: usize, b: usize) -> usize {
    let axis = (a ^ b).trailing_zeros() as usize;
    4 * axis + (a >> ((axis + 1) % 3) & 1) + 2 * (a >> ((axis + 2) % 3) & 1)
}

/// Corners of face 2a + side, counter-clockwise seen from outside.
fn face_corners(face: usize) -> [usize; 4] {
    let axis = face / 2;
    let side = face % 2;
    let u = 1 << ((axis + 1) % 3);
    let v = 1 << ((axis + 2) % 3);
    let base = side << axis;
    let around = [base, base | u, base | u | v, base | v];
    if side == 1 { around } else { [around[3], around[2], around[1], around[0]] }
}

/// One bit for each face that an edge lies in.
fn faces_of(edge: usize) -> u8 {
    let axis = edge / 4;
    let u = edge & 1;
    let v = edge >> 1 & 1;
    1 << (2 * ((axis + 1) % 3) + u) | 1 << (2 * ((axis + 2) % 3) + v)
}

/// For each crossed edge, the next one around its polygon.
fn lines(case: u8) -> [Option<usize>; 12] {
    let below = |c: usize| case >> c & 1 == 0;
    let mut next = [None; 12];
    for face in 0..6 {
        let corner = face_corners(face);
        for i in 0..4 {
            let here = corner[i];
            let ahead = corner[(i + 1) % 4];
            if !below(here) || below(ahead) {
                continue;
            }
            // A run ends here; back to where it began.
            let mut first = i;
            while below(corner[(first + 3) % 4]) {
                first = (first + 3) % 4;
            }
            next[edge_between(corner[(first + 3) % 4], corner[first])] = Some(edge_between(here, ahead));
        }
    }
    next
}

fn triangles(case: u8) -> Vec<[u8; 3]> {
    let mut next = lines(case);
    let mut triangles = Vec::new();
    for start in 0..12 {
        let mut polygon = Vec::new();
        let mut edge = start;
        while let Some(n) = next[edge].take() {
            polygon.push(edge as u8);
            edge = n;
        }
        if !polygon.is_empty() {
            triangles.extend(cut(&polygon).expect("invariant: every polygon has a cut, see the test of the table"));
        }
    }
    triangles
}

/// Triangles of a polygon whose diagonals lie in no face.
fn cut(polygon: &[u8]) -> Option<Vec<[u8; 3]>> {
    let n = polygon.len();
    if n == 3 {
        return Some(vec![[polygon[0], polygon[1], polygon[2]]]);
    }
    (0..n).find_map(|i| {
        let before = polygon[(i + n - 1) % n];
        let after = polygon[(i + 1) % n];
        if faces_of(before.into()) & faces_of(after.into()) != 0 {
            return None;
        }
        let rest: Vec<u8> = polygon.iter().copied().filter(|e| *e != polygon[i]).collect();
        let mut triangles = cut(&rest)?;
        triangles.push([before, polygon[i], after]);
        Some(triangles)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directed sides of the triangles of a case that no other triangle of it uses backwards.
    fn border(case: usize) -> Vec<(u8, u8)> {
        let sides: Vec<(u8, u8)> =
            TABLE.triangles[case].iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
        assert!(sides.iter().all(|s| sides.iter().filter(|o| *o == s).count() == 1), "case {case}");
        sides.iter().copied().filter(|s| !sides.contains(&(s.1, s.0))).collect()
    }

    #[test]
    fn every_case_is_a_surface_that_ends_on_the_faces_alone() {
        for case in 0..256 {
            let border = border(case);
            assert!(border.iter().all(|(a, b)| faces_of(*a as usize) & faces_of(*b as usize) != 0), "case {case}");
            // Each crossed edge is a vertex that the border passes once.
            let crossed = (0..12).filter(|e| lines(case as u8)[*e].is_some()).count();
            assert_eq!(border.len(), crossed, "case {case}");
            assert!(TABLE.triangles[case].len() <= 5 || case == 0, "case {case}");
        }
        assert!(TABLE.triangles[0].is_empty() && TABLE.triangles[255].is_empty());
    }

    #[test]
    fn both_cells_of_a_face_draw_the_same_lines_on_it() {
        // The upper face of a cell along each axis is the lower one of the next.
        for axis in 0..3 {
            let u = (axis + 1) % 3;
            let v = (axis + 2) % 3;
            for signs in 0..16usize {
                let case = |side: usize| {
                    (0..4).fold(0usize, |c, i| {
                        let corner = side << axis | (i & 1) << u | (i >> 1) << v;
                        c | (signs >> i & 1) << corner
                    })
                };
                let on = |side: usize| {
                    let face = 1u8 << (2 * axis + side);
                    let lies = |e: u8| faces_of(e as usize) & face != 0;
                    // An edge along the axis after: its second place is that of `axis`.
                    let plain = |e: u8| {
                        let a = e / 4;
                        if a as usize == u { e & !2 } else { e & !1 }
                    };
                    let mut lines: Vec<(u8, u8)> = border(case(side))
                        .into_iter()
                        .filter(|(a, b)| lies(*a) && lies(*b))
                        .map(|(a, b)| (plain(a), plain(b)))
                        .collect();
                    lines.sort_unstable();
                    lines
                };
                let mut back: Vec<(u8, u8)> = on(0).iter().map(|(a, b)| (*b, *a)).collect();
                back.sort_unstable();
                assert_eq!(on(1), back, "axis {axis} signs {signs:b}");
            }
        }
    }
}
