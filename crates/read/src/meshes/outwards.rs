//! Meshes turned inside out are turned back: opaque discs that face away count little, so the inner side of a silhouette
//! must not face the viewer.
//!
//! A part is what hangs together by corners at one place. Its triangles enclose, seen from a place c, the signed volume
//! V = ⅓ ∮ (x − c)·n dA, which is positive where they are wound outwards; c is the middle of the part's box. The vector area
//! A = ∮ n dA is 0 for a closed part. An open part is told from one inside out where |V| > Σ |A_k|·size_k, more than prisms
//! over its holes through the whole box hold: a scan with holes is, a bowl or a terrain is left as the file has it.
//!
//! A wall of a hollow body is wound towards the cavity. So a part whose box lies within another's is turned with the
//! outermost of those, or not at all.
//!
//! Sums are those of integers: neither the order of triangles nor a scale of 2ᵏ matters.

use rayon::prelude::*;
use splat_core::Mesh;
use splat_core::glam::{DVec3, Vec3};

/// Binary digits of the sums after the point, for a part of size one.
const DIGITS: i32 = 56;

/// Volumes below this share of what the triangles span one by one are rounding.
const ROUNDING_SHIFT: u32 = 40;

/// What is known of a part.
#[derive(Debug, Clone, Copy)]
struct Part {
    low: Vec3,
    high: Vec3,
    /// Six times the signed volume, and the same with each triangle's positive.
    volume: i128,
    spanned: i128,
    /// Twice the vector area.
    area: [i128; 3],
    /// Agreement of the normals of the corners with the triangles.
    agreement: i128,
}

/// What a part's sums say of its winding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Out,
    In,
    Unknown,
}

/// Turns the triangles of parts that are inside out, and normals that contradict them. Returns the number of parts turned.
pub(crate) fn turn_outwards(mesh: &mut Mesh) -> u64 {
    let part_of = parts(mesh);
    let parts = measured(mesh, &part_of);
    let sides: Vec<Side> = parts.iter().map(Part::side).collect();
    if !sides.contains(&Side::In) && parts.iter().all(|p| p.agreement >= 0) {
        return 0;
    }
    let turned = turned(&parts, &sides);
    // Normals that contradict the winding follow it where that is known.
    let negated: Vec<bool> = (0..parts.len())
        .map(|i| sides[i] != Side::Unknown && parts[i].agreement != 0 && (parts[i].agreement < 0) != turned[i])
        .collect();
    for t in &mut mesh.triangles {
        if turned[part_of[t[0] as usize] as usize] {
            t.swap(1, 2);
        }
    }
    for (n, part) in mesh.normal.iter_mut().zip(&part_of) {
        if *part != NO_PART && negated[*part as usize] {
            *n = -*n;
        }
    }
    (0..parts.len()).filter(|i| turned[*i] || negated[*i]).count() as u64
}

/// The part of vertices that no triangle uses.
const NO_PART: u32 = u32::MAX;

/// The part of each vertex; parts are numbered by their first vertex.
fn parts(mesh: &Mesh) -> Vec<u32> {
    let n = mesh.position.len();
    let mut parent: Vec<u32> = (0..n as u32).collect();
    // −0 and 0 are one place.
    let key = |v: u32| mesh.position[v as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut sorted: Vec<u32> = (0..n as u32).collect();
    sorted.par_sort_unstable_by_key(|v| (key(*v), *v));
    for pair in sorted.windows(2) {
        if key(pair[0]) == key(pair[1]) {
            join(&mut parent, pair[0], pair[1]);
        }
    }
    drop(sorted);
    for [a, b, c] in &mesh.triangles {
        join(&mut parent, *a, *b);
        join(&mut parent, *b, *c);
    }
    let mut is_used = vec![false; n];
    mesh.triangles.iter().flatten().for_each(|v| is_used[*v as usize] = true);
    let mut number = vec![NO_PART; n];
    let mut count = 0;
    let mut part_of = vec![NO_PART; n];
    for v in (0..n).filter(|v| is_used[*v]) {
        let root = root(&mut parent, v as u32) as usize;
        if number[root] == NO_PART {
            number[root] = count;
            count += 1;
        }
        part_of[v] = number[root];
    }
    part_of
}

/// The least vertex that hangs together with `v`, as far as is known; ways to it are halved.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        let above = parent[parent[v as usize] as usize];
        parent[v as usize] = above;
        v = above;
    }
    v
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let a = root(parent, a);
    let b = root(parent, b);
    parent[a.max(b) as usize] = a.min(b);
}

fn measured(mesh: &Mesh, part_of: &[u32]) -> Vec<Part> {
    let count = part_of.iter().filter(|p| **p != NO_PART).max().map_or(0, |p| *p as usize + 1);
    let none =
        Part { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, volume: 0, spanned: 0, area: [0; 3], agreement: 0 };
    let mut parts = vec![none; count];
    for (p, part) in mesh.position.iter().zip(part_of).filter(|(_, part)| **part != NO_PART) {
        let part = &mut parts[*part as usize];
        (part.low, part.high) = (part.low.min(*p), part.high.max(*p));
    }
    for t in &mesh.triangles {
        let part = &mut parts[part_of[t[0] as usize] as usize];
        let middle = part.middle();
        let factor = part.factor();
        let [a, b, c] = t.map(|v| (mesh.position[v as usize].as_dvec3() - middle) * factor);
        let cross = (b - a).cross(c - a);
        let volume = fixed(a.dot(cross));
        part.volume += volume;
        part.spanned += volume.abs();
        let twice = cross.to_array().map(fixed);
        (0..3).for_each(|k| part.area[k] += twice[k]);
        if let [Some(m), Some(n), Some(o)] = t.map(|v| mesh.normal.get(v as usize)) {
            part.agreement += fixed(cross.dot((*m + *n + *o).as_dvec3()));
        }
    }
    parts
}

/// A number below 2⁷ with a fixed point.
fn fixed(x: f64) -> i128 {
    const SCALE: f64 = (1u64 << DIGITS) as f64;
    i128::from((x * SCALE) as i64)
}

impl Part {
    fn middle(&self) -> DVec3 {
        0.5 * (self.low.as_dvec3() + self.high.as_dvec3())
    }

    /// The power of two that gives the part a size from one to two; 0 for a part of one place.
    fn factor(&self) -> f64 {
        let size = (self.high.as_dvec3() - self.low.as_dvec3()).max_element();
        // The exponent of an f64: sizes of f32 places are normal numbers of it.
        let exponent = (size.to_bits() >> 52) as i32 - 1023;
        if size > 0.0 { libm::exp2(f64::from(-exponent)) } else { 0.0 }
    }

    fn side(&self) -> Side {
        let size = (self.high.as_dvec3() - self.low.as_dvec3()) * self.factor();
        // 6 V against 6 Σ |A|·size, in 1024ths of the size.
        let doubt = (0..3).map(|k| 3 * self.area[k].abs() * (size[k] * 1024.0).ceil() as i128).sum::<i128>() >> 10;
        if self.volume.abs() <= doubt + (self.spanned >> ROUNDING_SHIFT) {
            Side::Unknown
        } else if self.volume > 0 {
            Side::Out
        } else {
            Side::In
        }
    }

    fn volume_of_box(&self) -> f64 {
        let size = self.high.as_dvec3() - self.low.as_dvec3();
        size.x * size.y * size.z
    }

    fn holds(&self, other: &Self) -> bool {
        self.low.cmple(other.low).all() && self.high.cmpge(other.high).all()
    }
}

/// Which parts are turned: those inside out that no known part holds, and all known ones that the largest part around them
/// takes along.
fn turned(parts: &[Part], sides: &[Side]) -> Vec<bool> {
    let mut turned: Vec<bool> = sides.iter().map(|s| *s == Side::In).collect();
    if !(sides.contains(&Side::In) && sides.contains(&Side::Out)) {
        return turned;
    }
    let mut known: Vec<usize> = (0..parts.len()).filter(|i| sides[*i] != Side::Unknown).collect();
    known.sort_by(|a, b| parts[*a].low.x.total_cmp(&parts[*b].low.x));
    // Parts that begin before and may reach beyond, in the order of x.
    let mut open: Vec<usize> = Vec::new();
    let mut at = 0;
    for &part in &known {
        open.retain(|o| parts[*o].high.x >= parts[part].low.x);
        while at < known.len() && parts[known[at]].low.x <= parts[part].low.x {
            open.push(known[at]);
            at += 1;
        }
        let around =
            open.iter().filter(|o| **o != part && parts[**o].holds(&parts[part]) && !parts[part].holds(&parts[**o]));
        let size = |i: &&usize| (parts[**i].volume_of_box(), parts[**i].high.to_array(), parts[**i].low.to_array());
        let outermost = around.max_by(|a, b| size(a).partial_cmp(&size(b)).unwrap_or(std::cmp::Ordering::Equal));
        if let Some(outermost) = outermost {
            turned[part] = sides[*outermost] == Side::In;
        }
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of half a side `r` at `center`, of separate facets as in STL.
    fn cube(center: Vec3, r: f32, inwards: bool) -> Mesh {
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let n = Vec3::AXES[axis] * sign;
                let u = Vec3::AXES[(axis + 1) % 3];
                let v = n.cross(u);
                let first = mesh.position.len() as u32;
                mesh.position.extend([-u - v, u - v, u + v, -u + v].map(|p| center + (n + p) * r));
                let turn = |t: [u32; 3]| if inwards { [t[0], t[2], t[1]] } else { t };
                mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| turn(t.map(|i| first + i))));
            }
        }
        mesh
    }

    fn join_all(meshes: &[Mesh]) -> Mesh {
        let mut whole = Mesh::default();
        for mesh in meshes {
            let first = whole.position.len() as u32;
            whole.position.extend(&mesh.position);
            whole.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        whole
    }

    /// Number of parts that were turned, and which cubes are inwards afterwards.
    fn after(cubes: &[(f32, f32, bool)]) -> (u64, Vec<bool>) {
        let [mut mesh, outwards] = [false, true].map(|all_out| {
            join_all(&cubes.iter().map(|&(x, r, i)| cube(Vec3::X * x, r, i && !all_out)).collect::<Vec<_>>())
        });
        let count = turn_outwards(&mut mesh);
        let sides = mesh.triangles.chunks(12).zip(outwards.triangles.chunks(12)).map(|(a, b)| a != b);
        (count, sides.collect())
    }

    #[test]
    fn closed_parts_are_turned_outwards_and_walls_of_hollow_bodies_stay() {
        let body = (0.0, 2.0, false);
        let cavity = (0.5, 1.0, true);
        assert_eq!(after(&[body]), (0, vec![false]));
        assert_eq!(after(&[(0.0, 2.0, true)]), (1, vec![false]));
        assert_eq!(after(&[body, cavity]), (0, vec![false, true]));
        // The same inside out: both are turned.
        assert_eq!(after(&[(0.5, 1.0, false), (0.0, 2.0, true)]), (2, vec![true, false]));
        // A body inside out in another's box is left, as it may be a cavity; one beside it is turned.
        assert_eq!(after(&[body, cavity, (9.0, 1.0, true)]), (1, vec![false, true, false]));
        // In a cavity lies a body.
        assert_eq!(after(&[cavity, (0.5, 0.25, false), body]), (0, vec![true, false, false]));
    }

    #[test]
    fn open_parts_are_turned_only_where_their_holes_are_small() {
        // A cube with a hole of one triangle; an open box; half of it; one side alone.
        for (left, count) in [(11, 1), (10, 0), (6, 0), (2, 0), (0, 0)] {
            let mut mesh = cube(Vec3::ONE, 0.5, true);
            mesh.triangles.truncate(left);
            let before = mesh.clone();
            assert_eq!(turn_outwards(&mut mesh), count, "{left} triangles");
            assert_eq!(mesh == before, count == 0);
        }
    }

    #[test]
    fn normals_of_the_file_follow_the_surface() {
        let inwards = |mesh: &Mesh| mesh.position.iter().map(|p| -p.normalize()).collect::<Vec<_>>();
        for turned_in in [false, true] {
            let mut mesh = cube(Vec3::ZERO, 1.0, turned_in);
            mesh.normal = inwards(&mesh);
            assert_eq!(turn_outwards(&mut mesh), 1);
            assert!(mesh.normal.iter().zip(&mesh.position).all(|(n, p)| n.dot(*p) > 0.0));
            assert_eq!(mesh.triangles, cube(Vec3::ZERO, 1.0, false).triangles);
            assert_eq!(turn_outwards(&mut mesh), 0);
        }
        let mut right = cube(Vec3::ZERO, 1.0, true);
        right.normal = right.position.iter().map(|p| p.normalize()).collect();
        assert_eq!(turn_outwards(&mut right), 1);
        assert!(right.normal.iter().zip(&right.position).all(|(n, p)| n.dot(*p) > 0.0));
    }

    #[test]
    fn neither_scale_nor_place_nor_order_matters() {
        let base = join_all(&[cube(Vec3::ZERO, 1.0, true), cube(Vec3::X * 5.0, 0.75, false)]);
        for exponent in [-60, 0, 60] {
            let mut mesh = base.clone();
            mesh.position.iter_mut().for_each(|p| *p *= f32::exp2(exponent as f32));
            mesh.triangles.reverse();
            assert_eq!(turn_outwards(&mut mesh), 1, "2^{exponent}");
        }
        let mut far = base;
        far.position.iter_mut().for_each(|p| *p += Vec3::splat(4096.0));
        assert_eq!(turn_outwards(&mut far), 1);
    }
}
