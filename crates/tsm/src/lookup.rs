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
        let (mut light, mut seen) = ([0.0; C], 0.0);
        for (cell, weight) in cells.into_iter().zip(weights) {
            let through = match cell {
                None => [1.0; C],
                Some(cell) => match target.distances(mapping, cell) {
                    None => continue,
                    Some(distances) => self.through(matter, cell, distances),
                },
            };
            (0..C).for_each(|c| light[c] += weight * through[c]);
            seen += weight;
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
        cell.map_or([1.0; C], |cell| self.through(matter, cell, [target.distance, 0.0]))
    }

    /// Transmittance of one cell up to the distances for media and for surfaces.
    #[inline]
    fn through<const C: usize>(&self, matter: &Matter<C>, cell: u32, [medium, surface]: [f32; 2]) -> [f32; C] {
        if self.opaque.get(cell as usize).is_some_and(|d| *d < surface) {
            return [0.0; C];
        }
        let mut absorbance = [0.0; C];
        if let Some(lists) = &matter.media {
            absorbance = continuous(lists.list(cell), medium, self.ramp);
        }
        if let Some(lists) = &matter.surfaces {
            let step = steps(lists.list(cell), surface);
            (0..C).for_each(|c| absorbance[c] += step[c]);
        }
        absorbance.map(|a| if self.dark_from.is_some_and(|limit| a > limit) { 0.0 } else { libm::expf(-a) })
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

/// Sum of the entries nearer than `distance`.
#[inline]
pub(crate) fn steps<const C: usize>(list: List<'_, C>, distance: f32) -> [f32; C] {
    let before = list.distance.partition_point(|d| *d < distance);
    if before == 0 { [0.0; C] } else { list.total[before - 1] }
}

/// Most parts into which the entries about a distance are taken; beyond, neighbours share the distance of one.
const MOST_PARTS: usize = 64;

/// Absorbance at `distance`, every entry spread evenly over `ramp` to either side of its own distance.
#[inline]
pub(crate) fn continuous<const C: usize>(list: List<'_, C>, distance: f32, ramp: f32) -> [f32; C] {
    let begin = list.distance.partition_point(|d| *d <= distance - ramp);
    let mut sum = if begin == 0 { [0.0; C] } else { list.total[begin - 1] };
    let about = list.distance[begin..].partition_point(|d| *d < distance + ramp);
    let stride = about.div_ceil(MOST_PARTS).max(1);
    let (inverse, mut before) = (0.5 / ramp, sum);
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

    #[test]
    fn media_absorb_continuously_and_by_half_at_their_own_distance() {
        let (distance, total) = sums(&[(1.0, 0.4), (2.0, 0.2), (9.0, 1.0)]);
        let list = List { distance: &distance, total: &total };
        let at = |d: f32| continuous(list, d, 1.0)[0];
        for (d, a) in
            [(0.0, 0.0), (1.0, 0.2), (1.5, 0.35), (2.0, 0.5), (3.0, 0.6), (5.0, 0.6), (9.0, 1.1), (10.0, 1.6)]
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
            let (a, b) = (continuous(one, d, 0.5)[0], continuous(many, d, 0.5)[0]);
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
            let exact: f64 = entries.iter().map(|e| f64::from(e.1) * f64::from((d - e.0) / 0.2 + 0.5).clamp(0.0, 1.0)).sum();
            let a = f64::from(continuous(list, d, 0.1)[0]);
            assert!((a - exact).abs() < 2e-4, "A({d}) = {a}, not {exact}");
        }
    }

    #[test]
    fn surfaces_are_steps_behind_their_distance() {
        let (distance, total) = sums(&[(1.0, 0.4), (2.0, 0.2)]);
        let list = List { distance: &distance, total: &total };
        for (d, a) in [(0.5, 0.0), (1.0, 0.0), (1.001, 0.4), (2.0, 0.4), (7.0, 0.6)] {
            assert!((steps(list, d)[0] - a).abs() < 1e-6);
        }
    }
}
