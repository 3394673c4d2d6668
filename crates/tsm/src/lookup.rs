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
use crate::table::{BLOCK, List, Lists};
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
    #[inline(always)]
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
        let (mut distances, mut weighs) = ([[place.distance; 2]; 4], weights);
        for k in 0..4 {
            match cells[k].map(|cell| target.distances(mapping, cell)) {
                Some(Some(of_cell)) => distances[k] = of_cell,
                // It sees nothing of the receiver.
                Some(None) => weighs[k] = 0.0,
                None => {}
            }
        }
        let through = self.through(matter, cells, distances);
        let (mut light, mut seen) = ([0.0; C], 0.0);
        for k in 0..4 {
            (0..C).for_each(|c| light[c] += weighs[k] * through[k][c]);
            seen += weighs[k];
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
        let mut absorbance = [[0.0; C]; 4];
        let [media, surfaces] = [0, 1].map(|of| distances.map(|both: [f32; 2]| both[of]));
        let is_dark: [bool; 4] = std::array::from_fn(|k| {
            cells[k].and_then(|c| self.opaque.get(c as usize)).is_some_and(|d| *d < surfaces[k])
        });
        // Nothing counts behind what is opaque.
        let spans = |lists: &Lists<C>| -> [[u32; 2]; 4] {
            std::array::from_fn(|k| match cells[k] {
                Some(cell) if !is_dark[k] => lists.span(cell),
                _ => [0, 0],
            })
        };
        if let Some(lists) = &matter.media {
            let spans = spans(lists);
            let begin = lists.places(spans, media.map(|d| d - self.ramp), |d, nearest| d <= nearest);
            for k in 0..4 {
                absorbance[k] = continuous(lists.list_at(spans[k]), begin[k], media[k], self.ramp);
            }
        }
        if let Some(lists) = &matter.surfaces {
            let spans = spans(lists);
            let before = lists.places(spans, surfaces, |d, surface| d < surface);
            for k in 0..4 {
                let step = lists.list_at(spans[k]).total_of(before[k]);
                (0..C).for_each(|c| absorbance[k][c] += step[c]);
            }
        }
        let light = |a: f32| if self.dark_from.is_some_and(|limit| a > limit) { 0.0 } else { libm::expf(-a) };
        std::array::from_fn(|k| if is_dark[k] { [0.0; C] } else { absorbance[k].map(light) })
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
        let mut cells = [None; 4];
        for (k, cell) in (0..).zip(&mut cells) {
            *cell = mapping.wrap(column + (k & 1), row + (k >> 1));
        }
        Self { cells, part, weights: [rest.x * rest.y, part.x * rest.y, rest.x * part.y, part.x * part.y] }
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

/// Absorbance at `distance`, every entry spread evenly over `ramp` to either side of its own distance; those before `begin`
/// lie wholly before it. Of a block of entries about it their sum and [moment](List::moment) are enough.
#[inline(always)]
pub(crate) fn continuous<const C: usize>(list: List<'_, C>, begin: usize, distance: f32, ramp: f32) -> [f32; C] {
    let (len, inverse, farthest) = (list.distance.len(), 0.5 / ramp, distance + ramp);
    let share = |n: usize| (distance - list.distance[n]) * inverse + 0.5;
    let mut before = list.total_of(begin);
    let (mut sum, mut n) = (before, begin);
    let mut add = |sum: &mut [f32; C], total: [f32; C], share: f32| {
        (0..C).for_each(|c| sum[c] += (total[c] - before[c]) * share);
        before = total;
    };
    let block = list.next_block(begin).min(len);
    while n < block && list.distance[n] < farthest {
        add(&mut sum, list.total[n], share(n));
        n += 1;
    }
    if n < block {
        return sum;
    }
    while n + BLOCK <= len && list.distance[n + BLOCK - 1] < farthest {
        add(&mut sum, list.total[n + BLOCK - 1], share(n));
        let moment = list.moment(n);
        (0..C).for_each(|c| sum[c] -= moment[c] * inverse);
        n += BLOCK;
    }
    while n < len && list.distance[n] < farthest {
        add(&mut sum, list.total[n], share(n));
        n += 1;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entries::Entries;
    use crate::table::{Parted, Ranges};

    /// Lists of cells from entries of a cell, a distance and an absorbance each.
    fn lists(cells: usize, entries: &[(u32, f32, f32)]) -> Lists<1> {
        let mut all = Entries::<1>::default();
        entries.iter().for_each(|&(cell, distance, a)| all.push(cell, distance, a, &[1.0; 3]));
        let ranges = Ranges::new(cells, entries.len() as f64);
        Lists::new(&[Parted::new(&all, ranges)], ranges, 1e6)
    }

    fn absorbance(lists: &Lists<1>, cell: u32, distance: f32, ramp: f32) -> f32 {
        let spans = [lists.span(cell); 4];
        let [begin, ..] = lists.places(spans, [distance - ramp; 4], |d, nearest| d <= nearest);
        continuous(lists.list_at(spans[0]), begin, distance, ramp)[0]
    }

    #[test]
    fn media_absorb_continuously_and_by_half_at_their_own_distance() {
        let lists = lists(1, &[(0, 1.0, 0.4), (0, 2.0, 0.2), (0, 9.0, 1.0)]);
        let at = |d: f32| absorbance(&lists, 0, d, 1.0);
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
        let one = lists(1, &[(0, 1.0, 0.9)]);
        let many = lists(1, &[(0, 1.0, 0.3), (0, 1.0 + part, 0.3), (0, 1.0 + 2.0 * part, 0.3)]);
        for i in 0..400 {
            let d = i as f32 * 0.005;
            let (a, b) = (absorbance(&one, 0, d, 0.5), absorbance(&many, 0, d, 0.5));
            assert!((a - b).abs() < 1e-6, "A({d}) = {a} or {b}");
        }
    }

    #[test]
    fn blocks_of_entries_absorb_as_each_of_them_does() {
        // Lists of all lengths, so that blocks begin anywhere in them, and one of thousands, in many ranges of cells.
        let unit = |i: u64, of: u64| splat_core::rng::unit_f32(9, 1, i, of);
        let lengths: Vec<u64> = (0..400).map(|cell| if cell == 77 { 10_000 } else { cell % 45 }).collect();
        let entries: Vec<(u32, f32, f32)> = lengths
            .iter()
            .zip(0..)
            .flat_map(|(n, cell)| (0..*n).map(move |i| (cell, 1.0 + unit(i, u64::from(cell)), 1.0 / *n as f32)))
            .collect();
        let lists = lists(lengths.len(), &entries);
        let mut of_cell = vec![Vec::new(); lengths.len()];
        entries.iter().for_each(|(cell, d, a)| of_cell[*cell as usize].push((f64::from(*d), f64::from(*a))));
        for (cell, of_cell) in (0..).zip(&of_cell) {
            for i in 0..40 {
                let (d, ramp) = (0.8 + i as f32 * 0.04, [0.02, 0.1, 0.7][i % 3]);
                let share = |at: f64| ((f64::from(d) - at) / f64::from(2.0 * ramp) + 0.5).clamp(0.0, 1.0);
                let exact: f64 = of_cell.iter().map(|(at, a)| a * share(*at)).sum();
                let a = f64::from(absorbance(&lists, cell, d, ramp));
                assert!((a - exact).abs() < 2e-6, "cell {cell}: A({d}) = {a}, not {exact}");
            }
        }
    }

    #[test]
    fn surfaces_are_steps_behind_their_distance() {
        let lists = lists(1, &[(0, 1.0, 0.4), (0, 2.0, 0.2)]);
        for (d, a) in [(0.5, 0.0), (1.0, 0.0), (1.001, 0.4), (2.0, 0.4), (7.0, 0.6)] {
            let [before, ..] = lists.places([lists.span(0); 4], [d; 4], |entry, d| entry < d);
            assert!((lists.list(0).total_of(before)[0] - a).abs() < 1e-6);
        }
    }

    #[test]
    fn four_searches_at_once_find_what_each_finds() {
        let lengths = [0, 1, 2, 3, 7, 64, 0, 200, 199, 5, 128, 1];
        let entries: Vec<(u32, f32, f32)> =
            (0..).zip(lengths).flat_map(|(cell, n)| (0..n).map(move |i| (cell, 1.0 + i as f32, 0.1))).collect();
        let lists = lists(lengths.len(), &entries);
        for cells in [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11], [6, 11, 0, 10]] {
            for step in 0..420 {
                let bounds = [0, 1, 2, 3].map(|k: u32| 0.5 * (step + k) as f32);
                let spans = cells.map(|cell| lists.span(cell));
                for (found, k) in lists.places(spans, bounds, |d, bound| d < bound).into_iter().zip(0..) {
                    assert_eq!(found, lists.list(cells[k]).distance.partition_point(|d| *d < bounds[k]));
                }
            }
        }
    }
}
