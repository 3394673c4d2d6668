//! The side that normals point to.
//!
//! A plane through neighbours has no front. Towards a direction or a viewpoint each normal is turned on its own; without
//! either, the choice spreads from the highest point of each connected part along the pairs of neighbours whose planes
//! agree best first (a minimum spanning tree over 1 − |n·m|; Hoppe et al. 1992).

use crate::common::columns::CHUNK;
use crate::points::places::{Neighbours, Place};
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Which side computed normals point to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Orientation {
    /// Along this direction, object space: (0, 0, 1) for terrain whose z is up.
    Toward(DVec3),
    /// To this point, object space: where the scanner stood.
    Viewpoint(DVec3),
    /// Outwards and alike among neighbours.
    Propagate,
    /// Outwards where the points enclose something, as the scan of a whole body does, and else along this direction.
    Auto(DVec3),
}

impl Default for Orientation {
    /// Along +Y.
    fn default() -> Self {
        Self::Toward(DVec3::Y)
    }
}

/// Found and expected when the orientation makes no sense.
pub(crate) fn check(orientation: Orientation) -> Result<(), (String, &'static str)> {
    match orientation {
        Orientation::Toward(d) | Orientation::Auto(d) if d.try_normalize().is_none() => {
            Err((d.to_string(), "a finite direction that is not 0"))
        }
        Orientation::Viewpoint(p) if !p.is_finite() => Err((p.to_string(), "a finite point")),
        _ => Ok(()),
    }
}

/// A unit normal across `line` (which may be zero) where no plane is known.
pub(crate) fn guess(orientation: Orientation, line: DVec3) -> DVec3 {
    let wish = match orientation {
        Orientation::Toward(d) | Orientation::Auto(d) => d.normalize_or(DVec3::Y),
        _ => DVec3::Y,
    };
    let Some(line) = line.try_normalize() else { return wish };
    let across = wish - line * line.dot(wish);
    if across.length() > 1e-6 { across.normalize() } else { line.any_orthonormal_vector() }
}

/// Turns the normals of places; `neighbours` are read for [`Orientation::Propagate`] alone. [`Orientation::Auto`] is taken for points that
/// enclose nothing, who knows better names the other one.
pub(crate) fn orient(
    places: &mut [Place],
    position: &[Vec3],
    origin: DVec3,
    orientation: Orientation,
    neighbours: &Neighbours,
) {
    let turn = |side: &(dyn Fn(Vec3) -> DVec3 + Sync), places: &mut [Place]| {
        let each = places.par_iter_mut().zip(position).with_min_len(CHUNK);
        each.for_each(|(place, p)| place.normal = face(place.normal, side(*p)));
    };
    match orientation {
        Orientation::Toward(d) | Orientation::Auto(d) => turn(&|_| d, places),
        Orientation::Viewpoint(eye) => turn(&|p| eye - origin - p.as_dvec3(), places),
        Orientation::Propagate => propagate(places, position, neighbours),
    }
}

/// Whether normals that are alike among neighbours, of places with their areas, enclose something: then they nearly cancel.
pub(crate) fn encloses(places: &[Place]) -> bool {
    /// What is left of a body that lacks its base is less, of half a ball it is a half, of terrain nearly 1.
    const OPEN: f64 = 0.25;
    let add = |(sum, all): (DVec3, f64), p: &Place| (sum + p.normal.as_dvec3() * p.area, all + p.area);
    let (sum, all) = places.iter().fold((DVec3::ZERO, 0.0), add);
    sum.length() < OPEN * all
}

fn face(n: Vec3, side: DVec3) -> Vec3 {
    if n.as_dvec3().dot(side) < 0.0 { -n } else { n }
}

fn propagate(places: &mut [Place], position: &[Vec3], neighbours: &Neighbours) {
    let both_ways = neighbour_lists(neighbours, places.len());
    let mut highest: Vec<u32> = (0..position.len() as u32).collect();
    highest.par_sort_unstable_by(|a, b| position[*b as usize].y.total_cmp(&position[*a as usize].y).then(a.cmp(b)));
    let mut done = vec![false; places.len()];
    let mut heap = BinaryHeap::new();
    for seed in highest {
        if done[seed as usize] {
            continue;
        }
        // The top of a closed surface faces up.
        let top = &mut places[seed as usize].normal;
        *top = face(*top, DVec3::Y);
        heap.push(Reverse((0u64, seed, seed)));
        while let Some(Reverse((_, i, from))) = heap.pop() {
            if std::mem::replace(&mut done[i as usize], true) {
                continue;
            }
            let n = face(places[i as usize].normal, places[from as usize].normal.as_dvec3());
            places[i as usize].normal = n;
            for &j in both_ways.of(i).iter().filter(|j| !done[**j as usize]) {
                let disagreement = (1.0 - n.as_dvec3().dot(places[j as usize].normal.as_dvec3()).abs()).max(0.0);
                // Positive floats sort as integers.
                heap.push(Reverse((disagreement.to_bits(), j, i)));
            }
        }
    }
}

/// Neighbours in both directions: a lone point has neighbours that do not have it.
struct Lists {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl Lists {
    fn of(&self, i: u32) -> &[u32] {
        &self.ids[self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize]
    }
}

fn neighbour_lists(neighbours: &Neighbours, points: usize) -> Lists {
    let mut starts = vec![0u32; points + 1];
    let pairs = |add: &mut dyn FnMut(u32, u32)| {
        for (i, ids) in neighbours.ids.chunks(neighbours.of_each.max(1)).enumerate() {
            for &j in ids {
                add(i as u32, j);
                add(j, i as u32);
            }
        }
    };
    pairs(&mut |i, _| starts[i as usize + 1] += 1);
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut at = starts.clone();
    let mut ids = vec![0u32; starts.last().copied().unwrap_or(0) as usize];
    pairs(&mut |i, j| {
        ids[at[i as usize] as usize] = j;
        at[i as usize] += 1;
    });
    Lists { starts, ids }
}
