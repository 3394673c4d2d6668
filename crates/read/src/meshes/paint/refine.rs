//! Triangles are divided until the colours between their corners are those of their texture.
//!
//! Rounds: every triangle says which of its edges it wants halved, the longer ones; each of those edges is halved in all
//! triangles that share it, so that there is no gap and no vertex inside an edge. A triangle wants that as long as an edge
//! is longer than [`COARSE`] texels, for then it cannot be looked at in full; or as long as one is longer than a texel and a
//! colour within is further than [`TOLERANCE`] from what lies between those of its corners.

use super::Painting;
use crate::error::ReadError;
use crate::meshes::texture::Texture;
use crate::reading::Reading;
use crate::stream::input;
use rayon::prelude::*;
use splat_core::Mesh;
use splat_core::glam::Vec2;

/// Edges longer than this, in texels, are halved whatever the texture has there.
const COARSE: f32 = 16.0;
/// A triangle with a longer edge, in texels, repeats its texture too often to be divided at all.
const LONGEST: f32 = 16_384.0;
/// Largest difference of the square root of a colour, which is about how the eye tells colours apart.
const TOLERANCE: f32 = 1.0 / 32.0;
/// Most triangles that a mesh is divided into; one that has more already keeps them.
const MOST: usize = 2 << 20;
/// Bytes that a triangle takes meanwhile, its share of vertices included.
const BYTES_PER_TRIANGLE: u64 = 120;
/// Bytes that a vertex of a divided mesh takes in the end, its place, normal, tint, place in the texture, paint and colours.
const BYTES_PER_VERTEX: u64 = 12 + 12 + 16 + 8 + 4 + super::BYTES_PER_COLOR;
/// Triangles looked at by one task.
const CHUNK: usize = 256;

/// An edge by its vertices, the lower one first.
type Edge = [u32; 2];

/// Divides the triangles of textured paints, and says so.
pub(super) fn refine(mesh: &mut Mesh, painting: &mut Painting, reading: &mut Reading<'_>) -> Result<(), ReadError> {
    let before = mesh.triangles.len();
    let mut is_new = vec![true; before];
    let (mut edges, mut longest) = wanted(mesh, painting, &is_new);
    // What is too long already stays so.
    let too_long = Some(longest).filter(|l| *l > LONGEST);
    let left_out = loop {
        reading.go_on()?;
        if edges.is_empty() {
            break too_long;
        }
        let count: usize = mesh.triangles.iter().map(|t| 1 + halved(t, &edges).iter().flatten().count()).sum();
        let bytes = (count as u64).saturating_mul(BYTES_PER_TRIANGLE);
        if count > MOST || input::hold("the divided triangles", bytes, reading.params).is_err() {
            break Some(too_long.unwrap_or(longest));
        }
        add_middles(mesh, painting, &edges);
        divide(mesh, &edges, &mut is_new);
        (edges, longest) = wanted(mesh, painting, &is_new);
    };
    let after = mesh.triangles.len();
    if after > before {
        let bytes = after as u64 * 12 + mesh.position.len() as u64 * BYTES_PER_VERTEX;
        input::hold("the divided triangles", bytes, reading.params)?;
    }
    if after > before {
        reading
            .notes
            .remarks
            .push(format!("textures became colours of vertices: {before} triangles were divided into {after}"));
    }
    if let Some(longest) = left_out {
        reading.notes.remarks.push(format!(
            "textures lost detail: triangles are not divided further where colours between corners up to {} texels \
             apart are not those of the texture",
            longest.ceil()
        ));
    }
    Ok(())
}

/// The edges that new triangles want halved, in order, each once; and the longest, in texels, of a triangle that is not as
/// its texture.
fn wanted(mesh: &Mesh, painting: &Painting, is_new: &[bool]) -> (Vec<Edge>, f32) {
    let of = |(t, is_new): (&[u32; 3], &bool)| {
        let texture = painting.texture_of(t[0]).filter(|_| *is_new)?;
        let corners = t.map(|v| Vec2::from(painting.place[v as usize]));
        let cutoff = painting.paints[painting.paint_of[t[0] as usize] as usize].cutoff;
        let lengths = lengths(corners, texture);
        let longest = lengths.iter().copied().fold(0.0, f32::max);
        if !(longest > 1.0 && (longest > COARSE || deviates(corners, texture, longest, cutoff))) {
            return None;
        }
        let is_long = |k: &usize| longest <= LONGEST && lengths[*k] > 1.0 && lengths[*k] > 0.5 * longest;
        Some((longest, (0..3).filter(is_long).map(|k| edge(t, k)).collect::<Vec<Edge>>()))
    };
    let found: Vec<(f32, Vec<Edge>)> =
        mesh.triangles.par_iter().zip(is_new).with_min_len(CHUNK).filter_map(of).collect();
    let longest = found.iter().map(|f| f.0).fold(0.0, f32::max);
    let mut edges: Vec<Edge> = found.into_iter().flat_map(|f| f.1).collect();
    edges.par_sort_unstable();
    edges.dedup();
    (edges, longest)
}

/// Edge `k` of a triangle, from its corner `k` to the next.
fn edge(t: &[u32; 3], k: usize) -> Edge {
    let a = t[k];
    let b = t[(k + 1) % 3];
    [a.min(b), a.max(b)]
}

/// Lengths of the edges in texels.
fn lengths(corners: [Vec2; 3], texture: &Texture) -> [f32; 3] {
    let size = Vec2::from(texture.size().map(|n| n as f32));
    [0, 1, 2].map(|k| ((corners[(k + 1) % 3] - corners[k]) * size).length())
}

/// Whether a colour of the texture within the triangle is not what lies between those of its corners.
fn deviates(corners: [Vec2; 3], texture: &Texture, longest: f32, cutoff: Option<f32>) -> bool {
    let at = |place: Vec2| texture.at(place.to_array());
    let [a, b, c] = corners.map(at);
    // A sample a texel: `longest` is at most COARSE.
    let n = longest.ceil() as usize;
    (0..=n).any(|i| {
        // The corners themselves are as they are.
        let is_corner = |j: &usize| [i, *j, n - i - j].contains(&n);
        (0..=n - i).filter(|j| !is_corner(j)).any(|j| {
            let [u, v] = [i, j].map(|k| k as f32 / n as f32);
            let w = 1.0 - u - v;
            let found = at(corners[0] * w + corners[1] * u + corners[2] * v);
            let between: [f32; 4] = std::array::from_fn(|k| a[k] * w + b[k] * u + c[k] * v);
            let differ = |k: usize| (found[k].sqrt() - between[k].max(0.0).sqrt()).abs() > TOLERANCE;
            (0..3).any(differ) || cutoff.is_some_and(|cutoff| (found[3] < cutoff) != (between[3] < cutoff))
        })
    })
}

/// Ranks among `edges` of those that are halved of a triangle.
fn halved(t: &[u32; 3], edges: &[Edge]) -> [Option<usize>; 3] {
    [0, 1, 2].map(|k| edges.binary_search(&edge(t, k)).ok())
}

/// Appends a vertex in the middle of every edge.
fn add_middles(mesh: &mut Mesh, painting: &mut Painting, edges: &[Edge]) {
    for &[a, b] in edges {
        let [a, b] = [a as usize, b as usize];
        // Halved before they are added: their sum may be more than a number can be.
        mesh.position.push(0.5 * mesh.position[a] + 0.5 * mesh.position[b]);
        if !mesh.normal.is_empty() {
            let between = mesh.normal[a] + mesh.normal[b];
            // Opposite normals have none between them.
            mesh.normal.push(between.try_normalize().unwrap_or(mesh.normal[a]));
        }
        if !painting.tint.is_empty() {
            let of_a = painting.tint[a];
            let of_b = painting.tint[b];
            painting.tint.push(std::array::from_fn(|c| 0.5 * of_a[c] + 0.5 * of_b[c]));
        }
        let between = 0.5 * Vec2::from(painting.place[a]) + 0.5 * Vec2::from(painting.place[b]);
        painting.place.push(between.to_array());
        painting.paint_of.push(painting.paint_of[a]);
    }
}

/// Divides the triangles whose edges are halved; the last vertices are the middles of the edges.
fn divide(mesh: &mut Mesh, edges: &[Edge], is_new: &mut Vec<bool>) {
    let first = mesh.position.len() - edges.len();
    let old = std::mem::take(&mut mesh.triangles);
    let mut triangles = Vec::new();
    is_new.clear();
    for t in old {
        let middles = halved(&t, edges).map(|m| m.map(|rank| (first + rank) as u32));
        let count = triangles.len();
        // Turned so that the halved edges come first.
        let turned = |k: usize| ([0, 1, 2].map(|i| t[(k + i) % 3]), [0, 1, 2].map(|i| middles[(k + i) % 3]));
        let k = (0..3).find(|k| middles[*k].is_some() && middles[(k + 2) % 3].is_none()).unwrap_or(0);
        match turned(k) {
            ([a, b, c], [Some(ab), Some(bc), Some(ca)]) => {
                triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            ([a, b, c], [Some(ab), Some(bc), None]) => triangles.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]),
            ([a, b, c], [Some(ab), None, _]) => triangles.extend([[a, ab, c], [ab, b, c]]),
            _ => triangles.push(t),
        }
        let divided = triangles.len() - count > 1;
        is_new.extend((count..triangles.len()).map(|_| divided));
    }
    mesh.triangles = triangles;
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::Vec3;

    #[test]
    fn halves_share_their_middles_and_keep_the_area_and_the_winding() {
        // Two triangles with a common edge; all subsets of the five edges.
        let all: [Edge; 5] = [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]];
        for subset in 0..32u32 {
            let edges: Vec<Edge> = (0..5).filter(|i| subset >> i & 1 == 1).map(|i| all[i as usize]).collect();
            let mut mesh = Mesh {
                position: [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Mesh::default()
            };
            let mut painting = Painting { paint_of: vec![0; 4], place: vec![[0.0; 2]; 4], ..Painting::default() };
            let mut is_new = Vec::new();
            add_middles(&mut mesh, &mut painting, &edges);
            divide(&mut mesh, &edges, &mut is_new);
            let twice = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| mesh.position[v as usize]);
                (b - a).cross(c - a).z
            };
            assert!(mesh.triangles.iter().all(|t| twice(t) > 0.0), "{subset}");
            assert_eq!(mesh.triangles.iter().map(twice).sum::<f32>(), 32.0, "{subset}");
            // No edge runs through another's middle: those inside have two triangles.
            let of = |v: u32| mesh.position[v as usize];
            let mut count = std::collections::BTreeMap::new();
            mesh.triangles
                .iter()
                .flat_map(|t| [0, 1, 2].map(|k| edge(t, k)))
                .for_each(|e| *count.entry(e).or_insert(0) += 1);
            for ([a, b], n) in count {
                let a = of(a);
                let b = of(b);
                let is_rim = [0.0, 4.0].iter().any(|w| a.x == *w && b.x == *w || a.y == *w && b.y == *w);
                assert_eq!(n, if is_rim { 1 } else { 2 }, "{subset}: {a} {b}");
            }
        }
    }

    #[test]
    fn middles_between_the_largest_numbers_are_numbers() {
        // Found by fuzzing glTF: the sum of two places was infinite.
        let far = Vec3::splat(f32::MAX);
        let place = vec![[f32::MAX; 2]; 2];
        let mut mesh = Mesh { position: vec![far; 2], ..Mesh::default() };
        let mut painting =
            Painting { paint_of: vec![0; 2], place, tint: vec![[f32::MAX; 4]; 2], ..Painting::default() };
        add_middles(&mut mesh, &mut painting, &[[0, 1]]);
        assert_eq!((mesh.position[2], painting.place[2], painting.tint[2]), (far, [f32::MAX; 2], [f32::MAX; 4]));
    }
}
