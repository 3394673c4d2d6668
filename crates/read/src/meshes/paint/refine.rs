//! Triangles are divided until the colours between their corners are those of their texture.
//!
//! Rounds: every triangle says which of its edges it wants halved, the longer ones; each of those edges is halved in all
//! triangles that share it, so that there is no gap and no vertex inside an edge. A triangle wants that as long as an edge
//! is longer than [`COARSE`] texels, for then it cannot be looked at in full; or as long as one is longer than a texel and a
//! colour within is further than [`TOLERANCE`] from what lies between those of its corners.

use super::{Alpha, Painting};
use crate::error::ReadError;
use crate::meshes::texture::Texture;
use crate::reading::Reading;
use crate::stream::input;
use rayon::prelude::*;
use splat_core::glam::Vec2;
use splat_core::{Mesh, halve_edges};

/// Edges longer than this, in texels, are halved whatever the texture has there.
const COARSE: f32 = 16.0;
/// A triangle with a longer edge, in texels, repeats its texture too often to be divided at all.
const LONGEST: f32 = 16_384.0;
/// Largest difference of the square root of a colour, which is about how the eye tells colours apart.
const TOLERANCE: f32 = 1.0 / 32.0;
/// Most triangles that a mesh is divided into; one that has more already keeps them.
const MOST: usize = 2 << 20;
/// Rounds of halving at most: each edge is halved 14 times until it is as long as a texel. What takes more are slivers beside others, a few in
/// each round, and a round takes the time of all triangles.
const MOST_ROUNDS: usize = 32;
/// Bytes that a triangle takes meanwhile, its share of vertices included.
const BYTES_PER_TRIANGLE: u64 = 120;
/// Bytes that a vertex of a divided mesh takes in the end, its place, normal, tint, place in the texture, paint and colours.
const BYTES_PER_VERTEX: u64 = 12 + 12 + 16 + 8 + 4 + super::BYTES_PER_COLOR;
/// Triangles looked at by one task.
const CHUNK: usize = 256;

/// An edge by its vertices, the lower one first.
type Edge = [u32; 2];

/// What keeps triangles from being divided.
pub(super) struct Limits {
    /// Whether opacities alone are looked at, where a texture has some that are used.
    pub(super) alpha_alone: bool,
    /// Length of edges that are not halved, in the mesh's units.
    pub(super) finest: f64,
}

impl Limits {
    /// What of vertices textures become.
    fn became(&self) -> &'static str {
        if self.alpha_alone { "opacities of vertices" } else { "colours of vertices" }
    }
}

/// Divides the triangles of textured paints, and says so.
pub(super) fn refine(
    mesh: &mut Mesh,
    painting: &mut Painting,
    limits: &Limits,
    reading: &mut Reading<'_>,
) -> Result<(), ReadError> {
    let before = mesh.triangles.len();
    let mut is_new = vec![true; before];
    let (mut edges, mut longest) = edges_to_halve(mesh, painting, limits, &is_new);
    // What is too long already stays so.
    let too_long = Some(longest).filter(|l| *l > LONGEST);
    let mut rounds = 0;
    let left_out = loop {
        reading.go_on()?;
        if edges.is_empty() {
            break too_long;
        }
        rounds += 1;
        if rounds > MOST_ROUNDS {
            break Some(too_long.unwrap_or(longest));
        }
        let count: usize = mesh.triangles.iter().map(|t| 1 + halved(t, &edges).iter().flatten().count()).sum();
        let bytes = (count as u64).saturating_mul(BYTES_PER_TRIANGLE);
        if count > MOST || input::hold("the divided triangles", bytes, reading.params).is_err() {
            break Some(too_long.unwrap_or(longest));
        }
        add_middles(painting, &edges);
        let parents = halve_edges(mesh, &edges);
        let mut parts = vec![0u32; is_new.len()];
        parents.iter().for_each(|parent| parts[*parent as usize] += 1);
        is_new = parents.iter().map(|parent| parts[*parent as usize] > 1).collect();
        (edges, longest) = edges_to_halve(mesh, painting, limits, &is_new);
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
            .push(format!("textures became {}: {before} triangles were divided into {after}", limits.became()));
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
fn edges_to_halve(mesh: &Mesh, painting: &Painting, limits: &Limits, is_new: &[bool]) -> (Vec<Edge>, f32) {
    let alpha_alone = limits.alpha_alone;
    let is_looked_at: Vec<bool> = painting.paints.iter().map(|paint| painting.is_divided(paint, alpha_alone)).collect();
    let halved_edges = |(t, is_new): (&[u32; 3], &bool)| {
        let is_looked_at = *is_new && is_looked_at[painting.paint_of[t[0] as usize] as usize];
        let texture = painting.texture_of(t[0]).filter(|_| is_looked_at)?;
        let corners = t.map(|v| Vec2::from(painting.place[v as usize]));
        let alpha = painting.alpha_of(t[0]);
        let lengths = lengths(corners, texture);
        let longest = lengths.iter().copied().fold(0.0, f32::max);
        let end = |k: usize| mesh.position[t[k % 3] as usize].as_dvec3();
        let is_coarse = |k: &usize| limits.finest <= 0.0 || end(*k).distance(end(k + 1)) > limits.finest;
        let is_long = |k: &usize| lengths[*k] > 1.0 && lengths[*k] > 0.5 * longest && is_coarse(k);
        if !((0..3).any(|k| is_long(&k))
            && (longest > COARSE || deviates(corners, texture, longest, alpha, alpha_alone)))
        {
            return None;
        }
        let halved = (0..3).filter(|k| longest <= LONGEST && is_long(k));
        Some((longest, halved.map(|k| edge(t, k)).collect::<Vec<Edge>>()))
    };
    let found: Vec<(f32, Vec<Edge>)> =
        mesh.triangles.par_iter().zip(is_new).with_min_len(CHUNK).filter_map(halved_edges).collect();
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

/// Whether a colour of the texture within the triangle, or an opacity that counts, is not what lies between those of its corners. With `alpha_alone`
/// colours are not looked at.
fn deviates(corners: [Vec2; 3], texture: &Texture, longest: f32, alpha: Alpha, alpha_alone: bool) -> bool {
    // Rounding leads places on the border beyond it, where repetition would have the other side of the image.
    let wrap = texture.wrap_of(&corners.map(|corner| corner.to_array()));
    let at = |place: Vec2| texture.at_wrapped(place.to_array(), wrap);
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
            let is_other = match alpha {
                Alpha::Ignored => false,
                // A triangle is left out or kept as a whole, by the mean of its corners.
                Alpha::Cut(cutoff) => (found[3] < cutoff) != ((a[3] + b[3] + c[3]) / 3.0 < cutoff),
                Alpha::Blended => (found[3] - between[3]).abs() > TOLERANCE,
            };
            !alpha_alone && (0..3).any(differ) || is_other
        })
    })
}

/// Ranks among `edges` of those that are halved of a triangle.
fn halved(t: &[u32; 3], edges: &[Edge]) -> [Option<usize>; 3] {
    [0, 1, 2].map(|k| edges.binary_search(&edge(t, k)).ok())
}

/// Gives the vertices in the middles of edges what they are painted with.
fn add_middles(painting: &mut Painting, edges: &[Edge]) {
    for &[a, b] in edges {
        let [a, b] = [a as usize, b as usize];
        if !painting.tint.is_empty() {
            let of_a = painting.tint[a];
            let of_b = painting.tint[b];
            painting.tint.push(std::array::from_fn(|c| 0.5 * of_a[c] + 0.5 * of_b[c]));
        }
        // Halved before they are added: their sum may be more than a number can be.
        let between = 0.5 * Vec2::from(painting.place[a]) + 0.5 * Vec2::from(painting.place[b]);
        painting.place.push(between.to_array());
        painting.paint_of.push(painting.paint_of[a]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles_between_the_largest_numbers_are_numbers() {
        // Found by fuzzing glTF: the sum of two places was infinite.
        let place = vec![[f32::MAX; 2]; 2];
        let mut painting =
            Painting { paint_of: vec![0; 2], place, tint: vec![[f32::MAX; 4]; 2], ..Painting::default() };
        add_middles(&mut painting, &[[0, 1]]);
        assert_eq!((painting.place[2], painting.tint[2]), ([f32::MAX; 2], [f32::MAX; 4]));
    }
}
