//! Groups by a hash table: K groups of discs whose shapes change, at a fraction of a colouring's time (section 4.3).
//!
//! A disc's place across the largest component of its surroundings' mean normal, in units of its radius, is a cell (x, y) of a plane
//! (Eq. 9). Cells have the groups of a table that repeats in both directions: (a·x + b·y) mod K with b = 1 and the multiplier a that sets the cells of one
//! group farthest apart. For K = 8 that is the table of Figure 9, rows running along y.
//!
//! Deviations:
//! - The mean normal is that of 256 consecutive discs in canonical order, not of the leaf of a BSP tree, which nothing else here needs.
//! - (x, y) is rounded down, not towards 0, which would make the cells around the origin twice as wide.
//! - Two surfaces behind one another have the same (x, y), so tags of collisions hold the third coordinate too, in steps of four radii.
//! - Tags are bits of a table, a few of which are shared. A shared bit only makes a disc choose its group without need.
//! - Collisions are looked for within parts of 8,192 consecutive discs in canonical order, which lie together. A part stays in the cache, no
//!   thread waits for another, and no list is kept. Collisions across the border of two parts are not found.

use super::lattice::Lattice;
use super::surfels::{self, Surfel};
use super::{Groups, check_cancelled, check_count};
use crate::Error;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Cloud, Progress, rng};

/// Discs that share a mean normal.
const LEAF: usize = 256;

/// Discs among which collisions are looked for, a multiple of [`LEAF`].
const PART: usize = 32 * LEAF;

/// Bits of the table of tags of a part.
const TAGS: usize = 16 * PART;

/// Radii a step of the third coordinate of a tag.
const STEP: f64 = 4.0;

/// The treatment of discs in a cell that has one already.
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

/// Parameters of grouping by hashing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HashParams {
    /// Number of groups K, 1 to 256.
    pub groups: u32,
    /// Radius of a disc over the cut-off radius of its splat, in (0, 1\]; see [`Params::disc_scale`](crate::Params::disc_scale).
    pub disc_scale: f32,
    /// The treatment of collisions.
    pub collisions: Collisions,
}

impl Default for HashParams {
    fn default() -> Self {
        Self { groups: 8, disc_scale: 1.0, collisions: Collisions::default() }
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
/// [`Error::Parameter`] and [`Error::Cloud`] for bad input, pieces of a medium among it; [`Error::Cancelled`].
pub fn hash_grouping(cloud: &Cloud, params: &HashParams, progress: Option<&Progress>) -> Result<Groups, Error> {
    params.check()?;
    let order = surfels::order(cloud, params.disc_scale)?;
    let mut sorted = vec![0; order.len()];
    let table = Table { cloud, params, multiplier: multiplier(params.groups) };
    order.par_chunks(PART).zip(sorted.par_chunks_mut(PART)).try_for_each_init(
        Part::default,
        |part, (places, groups)| {
            check_cancelled(progress)?;
            part.hash(&table, places, groups);
            if part.waits.contains(&true) {
                part.resolve(params.groups, groups);
            }
            Ok(())
        },
    )?;
    let mut by_place = vec![0; order.len()];
    order.iter().zip(&sorted).for_each(|(&place, &group)| by_place[place as usize] = group);
    Ok(Groups::of_each(params.groups, by_place))
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

    /// Its tags with both steps.
    fn tags(&self) -> [usize; 2] {
        let [x, y] = self.across.map(|v| v as u64);
        self.steps.map(|step| rng::bits(x, y, step as u64, self.along as u64) as usize % TAGS)
    }
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
    let count = i64::from(groups);
    let mut best = f64::INFINITY;
    let reach = 2 * count.isqrt() + 2;
    let of_group = |&[x, y]: &[i64; 2]| (x, y) != (0, 0) && (a * x + y).rem_euclid(count) == 0;
    let sides: Vec<[i64; 2]> =
        (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| [x, y])).filter(of_group).collect();
    for [x, y] in &sides {
        for [u, v] in &sides {
            // A triangle of neighbours has half the area of the K cells that it stands for, and no obtuse angle.
            let p = x * x + y * y;
            let q = u * u + v * v;
            let third = (x - u).pow(2) + (y - v).pow(2);
            let acute = p + q >= third && p + third >= q && q + third >= p;
            if acute && (x * v - y * u).abs() == count {
                best = best.min((p as f64 * q as f64 * third as f64).sqrt() / (2.0 * count as f64));
            }
        }
    }
    Ok(best)
}

/// What discs are hashed by.
struct Table<'a> {
    cloud: &'a Cloud,
    params: &'a HashParams,
    multiplier: i64,
}

impl Table<'_> {
    fn may_wait(&self, surfel: &Surfel) -> bool {
        match self.params.collisions {
            Collisions::Keep => false,
            Collisions::Resolve => true,
            Collisions::ResolveNear { eye, distance } => {
                surfel.center.as_dvec3().distance_squared(eye - self.cloud.origin) <= distance * distance
            }
        }
    }
}

/// Discs that follow one another in canonical order.
#[derive(Default)]
struct Part {
    surfels: Vec<Surfel>,
    /// Whether a disc chooses its group, and has none yet.
    waits: Vec<bool>,
    /// Bits of tags.
    tags: Vec<u64>,
    lattice: Lattice,
}

impl Part {
    /// Gives each disc the group of its cell. Those whose cell has one before them wait.
    fn hash(&mut self, table: &Table<'_>, places: &[u32], groups: &mut [u8]) {
        let Self { surfels, waits, tags, .. } = self;
        surfels.clear();
        surfels.extend(places.iter().map(|&place| Surfel::new(table.cloud, place, table.params.disc_scale)));
        waits.clear();
        tags.clear();
        tags.resize(TAGS / 64, 0);
        for (leaf, groups) in surfels.chunks(LEAF).zip(groups.chunks_mut(LEAF)) {
            let mean: DVec3 = leaf.iter().map(|surfel| surfel.normal.as_dvec3()).sum();
            let along = mean.abs().max_position();
            for (surfel, group) in leaf.iter().zip(groups) {
                let cell = Cell::new(surfel, along);
                *group = cell.group(table.multiplier, table.params.groups);
                let mut is_tagged = false;
                if table.may_wait(surfel) {
                    let [here, nearer] = cell.tags();
                    is_tagged = (tags[here / 64] >> (here % 64) | tags[nearer / 64] >> (nearer % 64)) & 1 == 1;
                    tags[here / 64] |= 1 << (here % 64);
                }
                waits.push(is_tagged);
            }
        }
    }

    /// Lets each disc that waits take the group whose discs overlap it least, by the overlap of Table 2; one after the other.
    fn resolve(&mut self, count: u32, groups: &mut [u8]) {
        let Self { surfels, waits, lattice, .. } = self;
        lattice.fill(surfels);
        let mut overlap = vec![0u64; count as usize];
        let mut near = Vec::new();
        for node in 0..surfels.len() {
            if !waits[node] {
                continue;
            }
            overlap.fill(0);
            let surfel = &surfels[node];
            lattice.near(surfel, &mut near);
            for n in near.iter().map(|&n| n as usize) {
                if !waits[n] && surfel.overlaps(&surfels[n], 1.0) {
                    overlap[usize::from(groups[n])] += measure(surfel, &surfels[n]);
                }
            }
            let least = (0..overlap.len()).min_by_key(|&group| overlap[group]).unwrap_or(0);
            groups[node] = least as u8;
            waits[node] = false;
        }
    }
}

/// (2r − |p_i − p_k|)/r as a whole number, so that sums do not depend on their order.
fn measure(a: &Surfel, b: &Surfel) -> u64 {
    let r = 0.5 * (a.mean_radius() + b.mean_radius());
    ((2.0 - a.from(b).length() / r) * 65536.0).max(0.0) as u64
}
