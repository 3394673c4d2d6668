//! Lines of files that hold nothing else → thin tubes: streamlines, trajectories, contours.
//!
//! Each point of a line is a ring of vertices across the line's direction there. Rings are not twisted against each other: the first axis of
//! each is that of the ring before, turned by as little as the direction turns.

use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::Mesh;
use splat_core::glam::Vec3;
use splat_core::text::counted;

/// Vertices of a ring; shading makes them round.
const SIDES: usize = 6;

/// Radius of a tube beside the diagonal of the bounds: two pixels of a picture of a thousand.
const RADIUS: f32 = 1.0 / 500.0;

/// Directions of the vertices of a ring: (cos, sin) of multiples of 60°.
const RING: [[f32; 2]; SIDES] = [
    [1.0, 0.0],
    [0.5, HALF_ROOT_OF_THREE],
    [-0.5, HALF_ROOT_OF_THREE],
    [-1.0, 0.0],
    [-0.5, -HALF_ROOT_OF_THREE],
    [0.5, -HALF_ROOT_OF_THREE],
];
const HALF_ROOT_OF_THREE: f32 = 0.866_025_4;

/// Bytes of a point of a line: vertices with normals and sources, two triangles for each, and the ranks of their lines.
const BYTES_PER_POINT: u64 = SIDES as u64 * (12 + 12 + 4 + 2 * (12 + 4));

/// Tubes around lines.
#[derive(Default)]
pub(crate) struct Tubes {
    position: Vec<Vec3>,
    normal: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// The point of the file that each vertex is of.
    pub(crate) points: Vec<u32>,
    /// The line that each triangle is of.
    pub(crate) lines: Vec<u32>,
    radius: f32,
    count: u64,
}

impl Tubes {
    /// Tubes around lines, each with its rank and the ranks of its points; `None` where no line has a length.
    pub(crate) fn around<'l>(
        positions: &[Vec3],
        lines: impl Iterator<Item = (u32, &'l [u32])> + Clone,
        reading: &mut Reading<'_>,
    ) -> Result<Option<Self>, ReadError> {
        let corners: u64 = lines.clone().map(|(_, line)| line.len() as u64).sum();
        input::hold("the tubes of lines", corners.saturating_mul(BYTES_PER_POINT), reading.params)?;
        let places = || lines.clone().flat_map(|(_, line)| line).map(|rank| positions[*rank as usize]);
        let bounds = places().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let mut tubes = Self { radius: RADIUS * (bounds.1 - bounds.0).length(), ..Self::default() };
        if !(tubes.radius.is_normal() && corners.saturating_mul(SIDES as u64) <= u64::from(u32::MAX)) {
            return Ok(None);
        }
        for (rank, line) in lines {
            reading.go_on()?;
            tubes.add(rank, line, positions);
        }
        Ok((!tubes.triangles.is_empty()).then_some(tubes))
    }

    /// One line; points that follow themselves count once.
    fn add(&mut self, rank: u32, line: &[u32], positions: &[Vec3]) {
        let place = |point: u32| positions[point as usize];
        let mut path: Vec<u32> = line.to_vec();
        path.dedup_by(|a, b| place(*a).distance(place(*b)) <= f32::EPSILON * self.radius);
        let [first, second, ..] = path.as_slice() else { return };
        let mut axis = (place(*second) - place(*first)).normalize_or_zero().any_orthonormal_vector();
        let start = self.position.len() as u32;
        for (i, point) in path.iter().enumerate() {
            let before = place(path[i.saturating_sub(1)]);
            let after = place(path[(i + 1).min(path.len() - 1)]);
            let straight = (after - before).normalize_or_zero();
            // A line that turns back on itself has no direction at its turn: the one towards it is taken.
            let direction =
                if straight == Vec3::ZERO { (place(*point) - before).normalize_or_zero() } else { straight };
            let across = (axis - direction * axis.dot(direction)).normalize_or_zero();
            axis = if across == Vec3::ZERO { direction.any_orthonormal_vector() } else { across };
            let other = direction.cross(axis);
            for [cosine, sine] in RING {
                let normal = axis * cosine + other * sine;
                self.position.push(place(*point) + self.radius * normal);
                self.normal.push(normal);
                self.points.push(*point);
            }
        }
        let sides = SIDES as u32;
        let last = path.len() as u32 - 1;
        for ring in 0..last {
            let low = start + ring * sides;
            for side in 0..sides {
                let next = (side + 1) % sides;
                self.triangles.push([low + side, low + next, low + sides + next]);
                self.triangles.push([low + side, low + sides + next, low + sides + side]);
            }
        }
        let end = start + last * sides;
        for side in 1..sides - 1 {
            self.triangles.push([start, start + side + 1, start + side]);
            self.triangles.push([end, end + side, end + side + 1]);
        }
        self.lines.resize(self.triangles.len(), rank);
        self.count += 1;
    }

    /// Values of the points as values of the vertices.
    pub(crate) fn of_vertices<T: Copy>(&self, values: &[T]) -> Vec<T> {
        if values.is_empty() {
            return Vec::new();
        }
        self.points.iter().map(|point| values[*point as usize]).collect()
    }

    /// The mesh, which says what it is; the rest of `vertices` is that of the vertices of the tubes.
    pub(crate) fn into_mesh(self, vertices: Mesh, reading: &mut Reading<'_>) -> Mesh {
        let lines = counted(self.count, "line");
        reading.notes.remark(format!(
            "{lines} drawn as tubes whose radius is a 500th of the extent; write tubes as triangles for another radius, such as with \
             ParaView's filter Tube"
        ));
        Mesh { position: self.position, normal: self.normal, triangles: self.triangles, ..vertices }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadParams;
    use splat_core::glam::vec3;

    fn tubes(positions: &[Vec3], lines: &[&[u32]]) -> Option<Tubes> {
        let lines = lines.iter().enumerate().map(|(rank, line)| (rank as u32, *line));
        Tubes::around(positions, lines, &mut Reading::new(&ReadParams::default(), None)).unwrap()
    }

    fn volume(tubes: &Tubes) -> f64 {
        let corner = |i: u32| tubes.position[i as usize].as_dvec3();
        tubes.triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2])))).sum::<f64>() / 6.0
    }

    /// A prism over a hexagon of radius r has the volume 3√3/2 r² times its length, and faces outwards.
    #[test]
    fn a_tube_is_closed_faces_outwards_and_has_its_volume() {
        let positions = [vec3(0.0, 0.0, 0.0), vec3(1.0, 2.0, 2.0), vec3(1.5, 3.0, 3.0)];
        let tubes = tubes(&positions, &[&[0, 1, 1, 2]]).unwrap();
        let radius = f64::from(tubes.radius);
        assert!((radius - 4.5 / 500.0).abs() < 1e-8, "{radius}");
        let expected = 1.5 * 3f64.sqrt() * radius * radius * 4.5;
        assert!((volume(&tubes) / expected - 1.0).abs() < 1e-3, "{} for {expected}", volume(&tubes));
        let mut edges: Vec<[u32; 2]> =
            tubes.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
        edges.sort_unstable();
        assert!(edges.iter().all(|[a, b]| edges.binary_search(&[*b, *a]).is_ok()), "an edge has one side");
        assert_eq!((tubes.points.len(), tubes.lines.len()), (18, 2 * 12 + 8));
        assert_eq!(tubes.of_vertices(&[5.0, 6.0, 7.0])[6..12], [6.0; 6]);
    }

    /// Around a corner a ring lies across the bisector, and rings are not twisted.
    #[test]
    fn rings_follow_a_bend_without_a_twist() {
        let turn = |i: u32| {
            let angle = f64::from(i) * std::f64::consts::TAU / 40.0;
            vec3(libm::cos(angle) as f32, libm::sin(angle) as f32, 0.1 * i as f32)
        };
        let positions: Vec<Vec3> = (0..80).map(turn).collect();
        let line: Vec<u32> = (0..80).collect();
        let tubes = tubes(&positions, &[&line]).unwrap();
        for (ring, (normals, next)) in tubes.normal.chunks(SIDES).zip(tubes.normal[SIDES..].chunks(SIDES)).enumerate() {
            let along = positions[ring + 1] - positions[ring];
            assert!(normals.iter().all(|n| n.dot(along.normalize()).abs() < 0.2), "{ring}");
            // A turn of 9° moves a normal by as much at most.
            assert!(normals.iter().zip(next).all(|(a, b)| a.dot(*b) > 0.98), "{ring}");
        }
    }

    #[test]
    fn lines_without_a_length_are_none() {
        let positions = [Vec3::ONE, Vec3::ONE, Vec3::X];
        assert!(tubes(&positions, &[&[0, 1], &[2]]).is_none());
        assert!(tubes(&positions, &[&[0, 1]]).is_none());
        assert!(tubes(&positions, &[]).is_none());
        // There and back again: no direction at the turn, and numbers nevertheless.
        let there = tubes(&positions, &[&[0, 2, 0]]).unwrap();
        assert!(there.position.iter().chain(&there.normal).all(|p| p.is_finite()));
    }
}
