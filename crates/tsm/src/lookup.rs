//! Looking up the light that arrives: T = e^−A between the four nearest cells (Gunjee 2007, Eqs. 8 and 9).
//!
//! A medium's entry is spread evenly over half a spacing to either side of its distance, as its splat stands for a cell of
//! the lattice that deep: A(d) = Σ_j a_j·clamp((d − d_j)/2r + ½). So a medium shadows itself by half its own absorbance,
//! there are no bands, and light changes continuously with every distance, whether or not some are equal. A surface is a
//! step at its tangent plane on the cell's ray. A receiving surface is compared at its own tangent plane on the same ray,
//! lifted towards the light by half a splat: a plane then lies exactly on itself at any angle, in cells of any size.
//!
//! Cells are weighted so that their rays, weighted alike, meet the receiver. Where the table is smooth those are the
//! bilinear weights of its place; across an edge between octants, where directions are not, the place is looked for.

use crate::ShadowMap;
use crate::deposit::plane_distance;
use crate::mapping::{Mapping, floor, with_mapping};
use crate::shadow_map::{Absorbances, Matter};
use crate::table::List;
use glam::{Vec2, Vec3};
use splat_core::{Receiver, SplatKind, Transmittance, glam};

/// Least lift over the distance: f32 planes agree to about 2⁻²⁰.
const ROUNDING: f32 = 1.0 / 262_144.0;

impl Transmittance for ShadowMap {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let p = self.frame.position(receiver.position);
        with_mapping!(&self.table, m => match &self.absorbances {
            Absorbances::Mono(matter) => [self.look_up(m, matter, receiver, p)[0]; 3],
            Absorbances::Rgb(matter) => self.look_up(m, matter, receiver, p),
        })
    }
}

/// A receiver in the light's frame.
struct Target {
    position: Vec3,
    normal: Vec3,
    distance: f32,
    /// Lift of the tangent plane towards the light, along the normal.
    lift: f32,
    is_surface: bool,
}

impl Target {
    /// Distances along the ray of a cell: for media, and for surfaces. `None` where the cell does not see the plane.
    fn distances<M: Mapping>(&self, mapping: &M, cell: u32) -> Option<[f32; 2]> {
        if !self.is_surface {
            return Some([self.distance; 2]);
        }
        if self.normal == Vec3::ZERO {
            return Some([self.distance, self.distance - self.lift]);
        }
        let ray = mapping.cell_ray(cell);
        let plane = plane_distance(self.position, self.normal, &ray)?;
        // Far from the receiver its plane no longer stands for the surface that it is part of.
        let near = plane > 0.5 * self.distance && plane < 2.0 * self.distance;
        if !near && !mapping.is_parallel() {
            return None;
        }
        Some([plane, plane - self.lift / ray.direction.dot(self.normal).abs()])
    }
}

impl ShadowMap {
    fn look_up<M: Mapping, const C: usize>(
        &self,
        mapping: &M,
        matter: &Matter<C>,
        receiver: &Receiver,
        p: Vec3,
    ) -> [f32; C] {
        let Some(place) = mapping.locate(p) else { return [1.0; C] };
        let target = Target {
            position: p,
            normal: self.frame.turn(receiver.normal),
            distance: place.distance,
            lift: (self.frame.length(receiver.radius) * self.bias).max(place.distance * ROUNDING),
            is_surface: receiver.kind != SplatKind::Medium,
        };
        let at = if mapping.is_creased(place.at, Vec2::ONE) { met_at(mapping, p, place.at) } else { place.at };
        let Patch { cells, weights, .. } = Patch::at(mapping, at);
        let distances = cells.map(|cell| match cell {
            None => Some([place.distance; 2]),
            Some(cell) => target.distances(mapping, cell),
        });
        let through = self.through(matter, cells, distances.map(Option::unwrap_or_default));
        let (mut light, mut seen) = ([0.0; C], 0.0);
        for k in (0..4).filter(|k| distances[*k].is_some()) {
            (0..C).for_each(|c| light[c] += weights[k] * through[k][c]);
            seen += weights[k];
        }
        if seen > 0.0 { light.map(|l| (l / seen).min(1.0)) } else { self.grazing(mapping, matter, &target, place.at) }
    }

    /// A plane that no near cell sees, being almost parallel to the light: it gets next to none, and no surface can be
    /// told to be before or behind it, so media alone shadow it.
    fn grazing<M: Mapping, const C: usize>(
        &self,
        mapping: &M,
        matter: &Matter<C>,
        target: &Target,
        at: Vec2,
    ) -> [f32; C] {
        let cell = mapping.wrap(floor(at.x), floor(at.y));
        self.through(matter, [cell, None, None, None], [[target.distance, 0.0]; 4])[0]
    }

    /// Transmittance of four cells, each up to its distances for media and for surfaces; 1 outside of the table.
    #[inline]
    fn through<const C: usize>(
        &self,
        matter: &Matter<C>,
        cells: [Option<u32>; 4],
        distances: [[f32; 2]; 4],
    ) -> [[f32; C]; 4] {
        let is_dark =
            |k: usize| cells[k].and_then(|c| self.opaque.get(c as usize)).is_some_and(|d| *d < distances[k][1]);
        let mut absorbance = [[0.0; C]; 4];
        if let Some(lists) = &matter.media {
            let lists = cells.map(|c| c.map_or(List::NONE, |c| lists.list(c)));
            let nearest = distances.map(|[medium, _]| medium - self.ramp);
            let begin = places(lists.map(|l| l.distance), nearest, |d, nearest| d <= nearest);
            for k in 0..4 {
                absorbance[k] = continuous(lists[k], begin[k], distances[k][0], self.ramp);
            }
        }
        if let Some(lists) = &matter.surfaces {
            let lists = cells.map(|c| c.map_or(List::NONE, |c| lists.list(c)));
            let before =
                places(lists.map(|l| l.distance), distances.map(|[_, surface]| surface), |d, surface| d < surface);
            for k in 0..4 {
                let step = lists[k].total_of(before[k]);
                (0..C).for_each(|c| absorbance[k][c] += step[c]);
            }
        }
        let light = |a: f32| if self.dark_from.is_some_and(|limit| a > limit) { 0.0 } else { libm::expf(-a) };
        std::array::from_fn(|k| if is_dark(k) { [0.0; C] } else { absorbance[k].map(light) })
    }
}

/// The four cells about a place, and their bilinear weights.
struct Patch {
    cells: [Option<u32>; 4],
    part: Vec2,
    weights: [f32; 4],
}

impl Patch {
    #[inline(always)]
    fn at<M: Mapping>(mapping: &M, at: Vec2) -> Self {
        let (column, row) = (floor(at.x - 0.5), floor(at.y - 0.5));
        let part = at - 0.5 - Vec2::new(column as f32, row as f32);
        let rest = Vec2::ONE - part;
        Self {
            cells: [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| mapping.wrap(column + i, row + j)),
            part,
            weights: [rest.x * rest.y, part.x * rest.y, rest.x * part.y, part.x * part.y],
        }
    }
}

/// Newton steps of [`met_at`]; across an edge the first makes up for it and the second for the first's slope.
const STEPS: usize = 3;
/// Least solid angle of four rays, in cells, that says where to go: at the corners of octants two of them may be one.
const LEAST_SPREAD: f32 = 0.1;

/// Where the rays of the four nearest cells, weighted bilinearly, meet `p`: from its place `at` in the table by Newton
/// steps, each with the slopes of the rays that it finds there.
fn met_at<M: Mapping>(mapping: &M, p: Vec3, at: Vec2) -> Vec2 {
    let (mut met, towards) = (at, p.normalize());
    for _ in 0..STEPS {
        let Patch { cells: [Some(a), Some(b), Some(c), Some(d)], part, weights } = Patch::at(mapping, met) else {
            return at;
        };
        let [a, b, c, d] = [a, b, c, d].map(|cell| mapping.cell_ray(cell).direction);
        let ray = a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3];
        let along_x = (b - a) * (1.0 - part.y) + (d - c) * part.y;
        let along_y = (c - a) * (1.0 - part.x) + (d - b) * part.x;
        // ray + x·along_x + y·along_y is to be along p.
        let area = along_x.cross(along_y).dot(towards);
        if area.abs() < LEAST_SPREAD * mapping.measure(0) as f32 {
            return at;
        }
        let step = Vec2::new(along_y.cross(ray).dot(towards), ray.cross(along_x).dot(towards)) / area;
        met += step.clamp(Vec2::NEG_ONE, Vec2::ONE);
    }
    met
}

/// How many numbers of each rising list come before a bound. All four are searched at once: a search by halves waits for
/// memory at every step, four of them wait together.
#[inline]
fn places(lists: [&[f32]; 4], bounds: [f32; 4], is_before: impl Fn(f32, f32) -> bool) -> [usize; 4] {
    let mut begin = [0; 4];
    let mut size = lists.map(<[f32]>::len);
    while size.iter().any(|n| *n > 0) {
        for k in 0..4 {
            let half = size[k].div_ceil(2);
            let is_before = lists[k].get((begin[k] + half).wrapping_sub(1)).is_some_and(|x| is_before(*x, bounds[k]));
            begin[k] += if is_before { half } else { 0 };
            size[k] -= half;
        }
    }
    begin
}

/// Most parts into which the entries about a distance are taken; beyond, neighbours share the distance of one.
const MOST_PARTS: usize = 64;

/// Absorbance at `distance`, every entry spread evenly over `ramp` to either side of its own distance; those before `begin`
/// lie wholly before it.
#[inline]
fn continuous<const C: usize>(list: List<'_, C>, begin: usize, distance: f32, ramp: f32) -> [f32; C] {
    let mut sum = list.total_of(begin);
    let (inverse, farthest, mut before) = (0.5 / ramp, distance + ramp, sum);
    let about = list.distance[begin..].iter().take(MOST_PARTS + 1).take_while(|d| **d < farthest).count();
    let about = if about <= MOST_PARTS { about } else { list.distance[begin..].partition_point(|d| *d < farthest) };
    let stride = about.div_ceil(MOST_PARTS).max(1);
    for first in (begin..begin + about).step_by(stride) {
        let last = (first + stride).min(begin + about) - 1;
        let share = (distance - list.distance[first + (last - first) / 2]) * inverse + 0.5;
        (0..C).for_each(|c| sum[c] += (list.total[last][c] - before[c]) * share);
        before = list.total[last];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances and running sums.
    fn sums(entries: &[(f32, f32)]) -> (Vec<f32>, Vec<[f32; 1]>) {
        let mut sum = 0.0;
        let sums = entries.iter().map(|&(distance, a)| {
            sum += a;
            (distance, [sum])
        });
        sums.unzip()
    }

    fn absorbance(list: List<'_, 1>, distance: f32, ramp: f32) -> f32 {
        let [begin, ..] = places([list.distance; 4], [distance - ramp; 4], |d, nearest| d <= nearest);
        continuous(list, begin, distance, ramp)[0]
    }

    #[test]
    fn media_absorb_continuously_and_by_half_at_their_own_distance() {
        let (distance, total) = sums(&[(1.0, 0.4), (2.0, 0.2), (9.0, 1.0)]);
        let list = List { distance: &distance, total: &total };
        let at = |d: f32| absorbance(list, d, 1.0);
        for (d, a) in [(0.0, 0.0), (1.0, 0.2), (1.5, 0.35), (2.0, 0.5), (3.0, 0.6), (5.0, 0.6), (9.0, 1.1), (10.0, 1.6)]
        {
            assert!((at(d) - a).abs() < 1e-6, "A({d}) = {}, not {a}", at(d));
        }
        let mut last = 0.0;
        for i in 0..1200 {
            let a = at(i as f32 * 0.01);
            assert!(a >= last && a - last < 0.011, "monotone and without jumps at {i}");
            last = a;
        }
    }

    #[test]
    fn equal_distances_that_rounding_parts_absorb_as_one() {
        let part = f32::EPSILON;
        let (one, many) = (sums(&[(1.0, 0.9)]), sums(&[(1.0, 0.3), (1.0 + part, 0.3), (1.0 + 2.0 * part, 0.3)]));
        let (one, many) = (List { distance: &one.0, total: &one.1 }, List { distance: &many.0, total: &many.1 });
        for i in 0..400 {
            let d = i as f32 * 0.005;
            let (a, b) = (absorbance(one, d, 0.5), absorbance(many, d, 0.5));
            assert!((a - b).abs() < 1e-6, "A({d}) = {a} or {b}");
        }
    }

    #[test]
    fn crowds_of_entries_are_taken_in_parts() {
        let entries: Vec<(f32, f32)> = (0..10_000).map(|i| (1.0 + i as f32 * 1e-5, 1e-4)).collect();
        let (distance, total) = sums(&entries);
        let list = List { distance: &distance, total: &total };
        for i in 0..300 {
            let d = 0.8 + i as f32 * 0.001;
            let exact: f64 =
                entries.iter().map(|e| f64::from(e.1) * f64::from((d - e.0) / 0.2 + 0.5).clamp(0.0, 1.0)).sum();
            let a = f64::from(absorbance(list, d, 0.1));
            assert!((a - exact).abs() < 2e-4, "A({d}) = {a}, not {exact}");
        }
    }

    #[test]
    fn surfaces_are_steps_behind_their_distance() {
        let (distance, total) = sums(&[(1.0, 0.4), (2.0, 0.2)]);
        let list = List { distance: &distance, total: &total };
        for (d, a) in [(0.5, 0.0), (1.0, 0.0), (1.001, 0.4), (2.0, 0.4), (7.0, 0.6)] {
            let [before, ..] = places([list.distance; 4], [d; 4], |entry, d| entry < d);
            assert!((list.total_of(before)[0] - a).abs() < 1e-6);
        }
    }

    #[test]
    fn four_searches_at_once_find_what_each_finds() {
        let numbers: Vec<f32> = (0..200).map(|i| (i / 3) as f32).collect();
        for (i, lengths) in [[0, 1, 2, 3], [7, 64, 0, 200], [199, 5, 128, 1]].into_iter().enumerate() {
            let lists = lengths.map(|n| &numbers[..n]);
            for step in 0..150 {
                let bounds = [0, 1, 2, 3].map(|k| 0.5 * (step + k * i) as f32 - 1.0);
                for (found, k) in places(lists, bounds, |d, bound| d < bound).into_iter().zip(0..) {
                    assert_eq!(found, lists[k].partition_point(|d| *d < bounds[k]));
                }
            }
        }
    }
}
