//! The side that normals point to.
//!
//! A plane through neighbours has no front. Towards a direction or a viewpoint each normal is turned on its own; without
//! either, the choice spreads from the highest point of each connected part along the pairs of neighbours whose planes
//! agree best first (a minimum spanning tree over 1 − |n·m|; Hoppe et al. 1992).

use crate::ConvertError;
use crate::common::columns::CHUNK;
use crate::common::convert_error::check_cancelled;
use crate::points::pair_queue::{Led, PairQueue};
use crate::points::places::{Neighbours, Place};
use rayon::prelude::*;
use splat_core::Progress;
use splat_core::glam::{DVec3, Vec3};

/// The side that computed normals point to.
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
///
/// # Errors
/// [`ConvertError::Cancelled`].
pub(crate) fn orient(
    places: &mut [Place],
    position: &[Vec3],
    origin: DVec3,
    orientation: Orientation,
    neighbours: &Neighbours,
    progress: &Progress,
) -> Result<(), ConvertError> {
    let turn = |side: &(dyn Fn(Vec3) -> DVec3 + Sync), places: &mut [Place]| {
        let each = places.par_iter_mut().zip(position).with_min_len(CHUNK);
        each.for_each(|(place, p)| place.normal = face(place.normal, side(*p)));
    };
    match orientation {
        Orientation::Toward(d) | Orientation::Auto(d) => turn(&|_| d, places),
        Orientation::Viewpoint(eye) => turn(&|p| eye - origin - p.as_dvec3(), places),
        Orientation::Propagate => propagate(places, position, neighbours, progress)?,
    }
    check_cancelled(progress)
}

/// Whether normals that are alike among neighbours, of places with their areas, enclose something: then they nearly cancel.
pub(crate) fn encloses(places: &[Place]) -> bool {
    /// What is left of a body that lacks its base is less, of half a ball it is a half, of terrain nearly 1.
    const OPEN: f64 = 0.25;
    let add = |(sum, area): (DVec3, f64), p: &Place| (sum + p.normal.as_dvec3() * p.area, area + p.area);
    let (sum, area) = places.iter().fold((DVec3::ZERO, 0.0), add);
    sum.length() < OPEN * area
}

fn face(n: Vec3, side: DVec3) -> Vec3 {
    if n.as_dvec3().dot(side) < 0.0 { -n } else { n }
}

/// The best pair so far that leads to a place.
#[derive(Debug, Clone, Copy)]
struct Lead {
    /// Bits of 1 − |n·m|: floats that are not negative sort as integers.
    disagreement: u64,
    /// The other place of the pair.
    from: u32,
    /// Whether the place's normal has its side.
    is_turned: bool,
}

/// No pair leads to the place yet.
const UNREACHED: Lead = Lead { disagreement: u64::MAX, from: u32::MAX, is_turned: false };

/// Places that are turned between two looks at whether to stop: well below a hundredth of a second.
const BETWEEN_LOOKS: u32 = 1 << 12;

/// Prim's algorithm. A pair comes to wait only if it is the best so far that leads to its place: one that is worse than another would be
/// taken when its place is turned already.
fn propagate(
    places: &mut [Place],
    position: &[Vec3],
    neighbours: &Neighbours,
    progress: &Progress,
) -> Result<(), ConvertError> {
    let incoming = Incoming::new(neighbours, places.len());
    check_cancelled(progress)?;
    let mut normals: Vec<Vec3> = places.iter().map(|place| place.normal).collect();
    let mut leads = vec![UNREACHED; places.len()];
    let mut waiting = PairQueue::new();
    let mut turned = 0;
    for seed in from_highest(position) {
        if leads[seed as usize].is_turned {
            continue;
        }
        // The top of a closed surface faces up.
        let top = &mut normals[seed as usize];
        *top = face(*top, DVec3::Y);
        leads[seed as usize].from = seed;
        waiting.push(Led { disagreement: 0, place: seed });
        while let Some(Led { place: i, .. }) = waiting.pop(|place| leads[place as usize].is_turned) {
            let lead = &mut leads[i as usize];
            if std::mem::replace(&mut lead.is_turned, true) {
                continue;
            }
            let n = face(normals[i as usize], normals[lead.from as usize].as_dvec3());
            normals[i as usize] = n;
            for &j in neighbours.around(i).iter().chain(incoming.around(i)) {
                let lead = &mut leads[j as usize];
                if lead.is_turned {
                    continue;
                }
                let disagreement = (1.0 - n.as_dvec3().dot(normals[j as usize].as_dvec3()).abs()).max(0.0).to_bits();
                if (disagreement, i) < (lead.disagreement, lead.from) {
                    let is_nearer = disagreement < lead.disagreement;
                    lead.disagreement = disagreement;
                    lead.from = i;
                    // Where only its source is another one the pair that waits is taken for this one.
                    if is_nearer {
                        waiting.push(Led { disagreement, place: j });
                    }
                }
            }
            turned += 1;
            if turned % BETWEEN_LOOKS == 0 {
                check_cancelled(progress)?;
            }
        }
    }
    places.par_iter_mut().zip(&normals).with_min_len(CHUNK).for_each(|(place, normal)| place.normal = *normal);
    Ok(())
}

/// Ids of places from the highest down, those of one height in their order.
fn from_highest(position: &[Vec3]) -> impl Iterator<Item = u32> {
    let key = |(i, p): (usize, &Vec3)| {
        let bits = p.y.to_bits();
        // Ascending as floats are; then turned round.
        let ascending = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
        u64::from(!ascending) << 32 | i as u64
    };
    let mut keys: Vec<u64> = position.par_iter().enumerate().with_min_len(CHUNK).map(key).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key as u32)
}

/// For each place the others that have it as a neighbour without being its: a lone point has neighbours that do not have it.
struct Incoming {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl Incoming {
    fn new(neighbours: &Neighbours, places: usize) -> Self {
        let one_sided = |i: u32| {
            let ids = neighbours.around(i).iter().filter(move |j| !neighbours.around(**j).contains(&i));
            ids.map(move |j| Arrow { from: i, to: *j })
        };
        let chunk = |first: usize| {
            let end = places.min(first + CHUNK);
            (first as u32..end as u32).flat_map(one_sided).collect()
        };
        let chunks: Vec<Vec<Arrow>> = (0..places).into_par_iter().step_by(CHUNK).map(chunk).collect();
        let mut starts = vec![0u32; places + 1];
        for arrow in chunks.iter().flatten() {
            starts[arrow.to as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut ids = vec![0u32; starts[places] as usize];
        for arrow in chunks.iter().flatten() {
            let next = &mut next[arrow.to as usize];
            ids[*next as usize] = arrow.from;
            *next += 1;
        }
        Self { starts, ids }
    }

    fn around(&self, i: u32) -> &[u32] {
        &self.ids[self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize]
    }
}

/// A place that has another one as its neighbour.
#[derive(Debug, Clone, Copy)]
struct Arrow {
    from: u32,
    to: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    /// One heap of all pairs, both ways, with their sources.
    fn by_one_heap(normals: &mut [Vec3], position: &[Vec3], neighbours: &Neighbours) {
        let mut both_ways = vec![Vec::new(); normals.len()];
        for i in 0..normals.len() as u32 {
            for &j in neighbours.around(i) {
                both_ways[i as usize].push(j);
                both_ways[j as usize].push(i);
            }
        }
        let mut highest: Vec<u32> = (0..normals.len() as u32).collect();
        highest.sort_by(|a, b| position[*b as usize].y.total_cmp(&position[*a as usize].y).then(a.cmp(b)));
        let mut done = vec![false; normals.len()];
        for seed in highest {
            if done[seed as usize] {
                continue;
            }
            normals[seed as usize] = face(normals[seed as usize], DVec3::Y);
            let mut heap = BinaryHeap::from([Reverse((0u64, seed, seed))]);
            while let Some(Reverse((_, i, from))) = heap.pop() {
                if std::mem::replace(&mut done[i as usize], true) {
                    continue;
                }
                let n = face(normals[i as usize], normals[from as usize].as_dvec3());
                normals[i as usize] = n;
                for &j in both_ways[i as usize].iter().filter(|j| !done[**j as usize]) {
                    let disagreement = (1.0 - n.as_dvec3().dot(normals[j as usize].as_dvec3()).abs()).max(0.0);
                    heap.push(Reverse((disagreement.to_bits(), j, i)));
                }
            }
        }
    }

    /// Normals of few kinds, so that many pairs disagree as much as others, or stand on each other; heights that repeat; several parts.
    #[test]
    fn sides_are_those_that_one_heap_of_all_pairs_gives() {
        for kinds in [2, 5, 26, 4000] {
            let bits = |i: u64, a: u64| rng::bits(29, kinds, i, a);
            let normal = |i: u64| {
                let axis = |a: u64| (bits(bits(i, 9) % kinds, a) % 3) as f32 - 1.0;
                Vec3::new(axis(0), axis(1), axis(2) + 0.5).normalize()
            };
            let normals: Vec<Vec3> = (0..4000).map(normal).collect();
            let position: Vec<Vec3> = (0..4000).map(|i| Vec3::Y * (bits(i, 20) % 50) as f32).collect();
            let near = |i: u64, k: u64| i / 1000 * 1000 + (i + 1 + bits(i, 30 + k) % 40) % 1000;
            let ids = (0..4000).flat_map(|i| (0..6).map(move |k| near(i, k) as u32)).collect();
            let neighbours = Neighbours { ids, of_each: 6 };
            let mut expected = normals.clone();
            by_one_heap(&mut expected, &position, &neighbours);
            let mut places: Vec<Place> = normals.iter().map(|n| Place { normal: *n, ..Place::default() }).collect();
            propagate(&mut places, &position, &neighbours, &Progress::new()).expect("nobody cancels");
            let found: Vec<Vec3> = places.iter().map(|place| place.normal).collect();
            assert!(found == expected, "{kinds} kinds");
        }
    }

    #[test]
    fn a_cancel_is_heard_between_places() {
        let progress = Progress::new();
        progress.cancel();
        let position = vec![Vec3::ZERO; 10_000];
        let neighbours = Neighbours { ids: (0..10_000).map(|i| (i + 1) % 10_000).collect(), of_each: 1 };
        let mut places = vec![Place::default(); 10_000];
        let found = propagate(&mut places, &position, &neighbours, &progress);
        assert!(matches!(found, Err(ConvertError::Cancelled)));
    }
}
