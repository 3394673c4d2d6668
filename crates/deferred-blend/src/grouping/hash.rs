//! Groups by a hash table: K groups of discs whose shapes change, at a fraction of a colouring's time (section 4.3).
//!
//! A disc's place across the largest component of its surroundings' mean normal, in units of its radius, is a cell (x, y) of a plane
//! (Eq. 9). Cells have the groups of a table that repeats in both directions: (a·x + b·y) mod K with b = 1 and the multiplier a that sets the cells of one
//! group farthest apart. For K = 8 that is the table of Figure 9, rows running along y.
//!
//! Deviations: the mean normal is that of 256 discs that follow one another in canonical order, in place of the leaf of a BSP tree,
//! which is not needed for anything else here. (x, y) is rounded down, not towards 0, which would make the cells around the origin
//! twice as wide. Two surfaces behind one another have the same (x, y); so the tags of Collisions have the third coordinate too, in steps
//! of four radii, and tags lie in a table of bits of which a few are shared: that only lets a disc choose its group that need not.

use super::graph::{OverlapGraph, Search};
use super::surfels::{self, CHUNK, Surfel};
use super::{Groups, check_count};
use crate::Error;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Cloud, Progress, rng};

/// Discs that share a mean normal.
const LEAF: usize = 256;

/// Bits of the table of tags, a disc.
const BITS_PER_DISC: usize = 16;

/// Radii a step of the third coordinate of a tag.
const STEP: f64 = 4.0;

/// What is done with discs in a cell that has one already.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Collisions {
    /// Nothing: they share its group, and overlap.
    Keep,
    /// Each takes the group whose discs overlap it least.
    #[default]
    Resolve,
    /// The same for discs that are near the eye; groups then depend on the view.
    ResolveNear {
        /// The eye, in world space.
        eye: DVec3,
        /// Distance from there, world units, ≥ 0.
        distance: f64,
    },
}

/// How discs are grouped by hashing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HashParams {
    /// Number of groups K, 1 to 256.
    pub groups: u32,
    /// Radius of a disc over the cut-off radius of its splat, in (0, 1\]; see [`Params::disc_scale`](crate::Params::disc_scale).
    pub disc_scale: f32,
    /// What is done with collisions.
    pub collisions: Collisions,
    /// Most bytes of the lists of discs that overlap one that chooses its group.
    pub max_bytes: u64,
}

impl Default for HashParams {
    fn default() -> Self {
        Self { groups: 8, disc_scale: 1.0, collisions: Collisions::default(), max_bytes: 1 << 32 }
    }
}

impl HashParams {
    fn check(&self) -> Result<(), Error> {
        check_count(self.groups)?;
        let Collisions::ResolveNear { eye, distance } = self.collisions else { return Ok(()) };
        if !eye.is_finite() {
            return Err(Error::parameter("eye", eye, "finite numbers"));
        }
        if !(distance >= 0.0 && distance.is_finite()) {
            return Err(Error::parameter("distance from the eye", distance, "a finite number of at least 0"));
        }
        Ok(())
    }
}

/// Parts discs into K groups by their places.
///
/// # Errors
/// [`Error::Parameter`] and [`Error::Cloud`] for bad input, pieces of a medium among it; [`Error::Limit`] where the discs that
/// collide overlap more others than fit into the memory that there may be; [`Error::Cancelled`].
pub fn hash_grouping(cloud: &Cloud, params: &HashParams, progress: Option<&Progress>) -> Result<Groups, Error> {
    params.check()?;
    let surfels = surfels::read(cloud, params.disc_scale)?;
    let cells = cells(&surfels);
    let multiplier = multiplier(params.groups);
    let of = |cell: &Cell| cell.group(multiplier, params.groups);
    let groups: Vec<u8> = cells.par_iter().with_min_len(CHUNK).map(of).collect();
    let is_near = |surfel: &Surfel| match params.collisions {
        Collisions::Keep => false,
        Collisions::Resolve => true,
        Collisions::ResolveNear { eye, distance } => {
            surfel.center.as_dvec3().distance_squared(eye - cloud.origin) <= distance * distance
        }
    };
    let chooses = match params.collisions {
        Collisions::Keep => Vec::new(),
        _ => collisions(&surfels, &cells, is_near),
    };
    let mut by_place = vec![0; groups.len()];
    surfels.iter().zip(&groups).for_each(|(surfel, &group)| by_place[surfel.place as usize] = group);
    let mut groups = Groups::of_each(params.groups, by_place);
    if chooses.contains(&true) {
        resolve(&surfels, &chooses, params, progress, &mut groups)?;
    }
    Ok(groups)
}

/// A disc's cell: Eq. 9, and a third coordinate along the normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cell {
    /// Largest component of the mean normal.
    along: usize,
    across: [i64; 2],
    /// Step along the normal, and the nearer one of its neighbours.
    steps: [i64; 2],
}

impl Cell {
    fn new(surfel: &Surfel, along: usize) -> Self {
        let at = surfel.center.as_dvec3() / f64::from(surfel.reach);
        let step = at[along] / STEP;
        let near = if step - step.floor() < 0.5 { -1 } else { 1 };
        Self {
            along,
            // `as` saturates, which joins cells that are more than 10¹⁸ radii away.
            across: [at[(along + 1) % 3].floor() as i64, at[(along + 2) % 3].floor() as i64],
            steps: [step.floor() as i64, step.floor() as i64 + near],
        }
    }

    fn group(&self, multiplier: i64, groups: u32) -> u8 {
        let groups = i64::from(groups);
        let [x, y] = self.across.map(|v| v.rem_euclid(groups));
        ((multiplier * x + y) % groups) as u8
    }

    /// Bit of the tag with one of both steps, in a table of a power of two.
    fn tag(&self, step: i64, bits: usize) -> usize {
        let [x, y] = self.across.map(|v| v as u64);
        rng::bits(x, y, step as u64, self.along as u64) as usize & (bits - 1)
    }
}

fn cells(surfels: &[Surfel]) -> Vec<Cell> {
    let leaves = surfels.par_chunks(LEAF).with_min_len(CHUNK / LEAF);
    let of_leaf = |leaf: &[Surfel]| {
        let mean: DVec3 = leaf.iter().map(|surfel| surfel.normal.as_dvec3()).sum();
        let along = mean.abs().max_position();
        leaf.iter().map(|surfel| Cell::new(surfel, along)).collect::<Vec<_>>()
    };
    leaves.flat_map_iter(of_leaf).collect()
}

/// The multiplier of x that sets cells of one group farthest apart; the least of equals.
fn multiplier(groups: u32) -> i64 {
    let groups = i64::from(groups);
    (0..groups).rev().max_by_key(|&a| shortest(a, groups)).unwrap_or(0)
}

/// Least squared distance between two cells of one group.
fn shortest(a: i64, groups: i64) -> i64 {
    let columns = (0..=groups).map(|x| {
        let y = (a * x).rem_euclid(groups);
        let y = y.min(groups - y);
        let squared = x * x + y * y;
        if squared == 0 { groups * groups } else { squared }
    });
    columns.min().unwrap_or(0)
}

/// Radius, over that of the discs, with which the discs of one group cover a plane if each cell of Eq. 9 has one in its middle: the circle
/// through three neighbouring cells of the group. For K = 8 it is √50/4 (Figure 10).
///
/// # Errors
/// [`Error::Parameter`] for a number of groups outside 1..=256.
pub fn covering_factor(groups: u32) -> Result<f64, Error> {
    check_count(groups)?;
    let a = multiplier(groups);
    let (count, mut best) = (i64::from(groups), f64::INFINITY);
    let reach = 2 * count.isqrt() + 2;
    let of_group = |&[x, y]: &[i64; 2]| (x, y) != (0, 0) && (a * x + y).rem_euclid(count) == 0;
    let sides: Vec<[i64; 2]> =
        (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| [x, y])).filter(of_group).collect();
    for [x, y] in &sides {
        for [u, v] in &sides {
            // A triangle of neighbours has half the area of the K cells that it stands for, and no obtuse angle.
            let (p, q) = (x * x + y * y, u * u + v * v);
            let third = (x - u).pow(2) + (y - v).pow(2);
            let acute = p + q >= third && p + third >= q && q + third >= p;
            if acute && (x * v - y * u).abs() == count {
                best = best.min((p as f64 * q as f64 * third as f64).sqrt() / (2.0 * count as f64));
            }
        }
    }
    Ok(best)
}

/// For each disc whether its cell has one before it.
fn collisions(surfels: &[Surfel], cells: &[Cell], is_near: impl Fn(&Surfel) -> bool) -> Vec<bool> {
    let bits = (BITS_PER_DISC * surfels.len().max(4)).next_power_of_two();
    let mut tags = vec![0u64; bits / 64];
    let meets = |(surfel, cell): (&Surfel, &Cell)| {
        if !is_near(surfel) {
            return false;
        }
        let tagged = cell.steps.map(|step| {
            let bit = cell.tag(step, bits);
            tags[bit / 64] >> (bit % 64) & 1 == 1
        });
        let bit = cell.tag(cell.steps[0], bits);
        tags[bit / 64] |= 1 << (bit % 64);
        tagged.contains(&true)
    };
    surfels.iter().zip(cells).map(meets).collect()
}

/// Lets each disc that collides take the group whose discs overlap it least, by the overlap of Table 2; one after the other.
fn resolve(
    surfels: &[Surfel],
    chooses: &[bool],
    params: &HashParams,
    progress: Option<&Progress>,
    groups: &mut Groups,
) -> Result<(), Error> {
    let mut waits = vec![false; groups.of.len()];
    surfels.iter().zip(chooses).for_each(|(surfel, &chooses)| waits[surfel.place as usize] = chooses);
    let search = Search { factor: 1.0, max_bytes: params.max_bytes, progress };
    let wanted = |surfel: &Surfel| waits[surfel.place as usize];
    let graph = OverlapGraph::of_some(surfels, &search, wanted, |a, b| a.overlaps(b, 1.0))?;
    let mut overlap = vec![0u64; params.groups as usize];
    for node in 0..graph.nodes() {
        if !waits[graph.place(node)] {
            continue;
        }
        overlap.fill(0);
        for &n in graph.neighbors(node) {
            let n = n as usize;
            // Those that wait have no group yet.
            if !waits[graph.place(n)] {
                overlap[usize::from(groups.of[graph.place(n)])] += measure(graph.surfel(node), graph.surfel(n));
            }
        }
        let least = (0..overlap.len()).min_by_key(|&group| overlap[group]).unwrap_or(0);
        groups.of[graph.place(node)] = least as u8;
        waits[graph.place(node)] = false;
    }
    Ok(())
}

/// (2r − |p_i − p_k|)/r as a whole number, so that sums do not depend on their order.
fn measure(a: &Surfel, b: &Surfel) -> u64 {
    let r = 0.5 * (a.mean_radius() + b.mean_radius());
    ((2.0 - a.from(b).length() / r) * 65536.0).max(0.0) as u64
}
