//! Looking up the light that arrives: T = e^−A between the four nearest cells (Gunjee 2007, Eqs. 8 and 9).
//!
//! A medium's absorbance grows continuously along a cell's ray: A(d_i) = Σ_{j<i} a_j + a_i/2 at an entry, linear
//! between entries and within `ramp` of them; so a medium shadows itself by half its own absorbance, coincident
//! splats get equal light, and there are no bands. A surface is a step at its tangent plane on the cell's ray. A
//! receiving surface is compared at its own tangent plane on the same ray, lifted towards the light by half a splat:
//! a plane then lies exactly on itself at any angle, in cells of any size.

use crate::ShadowMap;
use crate::deposit::plane_distance;
use crate::mapping::{Mapping, floor, with_mapping};
use crate::shadow_map::{Absorbances, Matter};
use crate::table::List;
use glam::Vec3;
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
        let corner = [floor(place.at.x - 0.5), floor(place.at.y - 0.5)];
        let part = place.at - 0.5 - glam::Vec2::new(corner[0] as f32, corner[1] as f32);
        let (mut light, mut seen) = ([0.0; C], 0.0);
        for (i, j, weight) in [
            (0, 0, (1.0 - part.x) * (1.0 - part.y)),
            (1, 0, part.x * (1.0 - part.y)),
            (0, 1, (1.0 - part.x) * part.y),
            (1, 1, part.x * part.y),
        ] {
            let through = match mapping.wrap(corner[0] + i, corner[1] + j) {
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
        at: glam::Vec2,
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

/// Sum of the entries nearer than `distance`.
#[inline]
pub(crate) fn steps<const C: usize>(list: List<'_, C>, distance: f32) -> [f32; C] {
    let before = list.distance.partition_point(|d| *d < distance);
    if before == 0 { [0.0; C] } else { list.total[before - 1] }
}

/// Absorbance at `distance`, half of each entry before it and half behind, spread over at most `ramp` to either side.
#[inline]
pub(crate) fn continuous<const C: usize>(list: List<'_, C>, distance: f32, ramp: f32) -> [f32; C] {
    let after = list.distance.partition_point(|d| *d <= distance);
    let total = |i: usize| if i == 0 { [0.0; C] } else { list.total[i - 1] };
    let half = |i: usize| -> [f32; C] { std::array::from_fn(|c| 0.5 * (total(i)[c] + total(i + 1)[c])) };
    let mix = |a: [f32; C], b: [f32; C], t: f32| -> [f32; C] { std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t) };
    let flat = total(after);
    let last = if after > 0 { list.distance[after - 1] } else { f32::NEG_INFINITY };
    let next = list.distance.get(after).copied().unwrap_or(f32::INFINITY);
    let reach = ramp.min(0.5 * (next - last));
    if reach <= 0.0 {
        return if last == distance { half(after - 1) } else { flat };
    }
    if distance - last < reach {
        return mix(half(after - 1), flat, (distance - last) / reach);
    }
    if next - distance < reach {
        return mix(half(after), flat, (next - distance) / reach);
    }
    flat
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
        for (d, a) in [(0.0, 0.0), (1.0, 0.2), (1.5, 0.4), (2.0, 0.5), (3.0, 0.6), (5.0, 0.6), (9.0, 1.1), (10.0, 1.6)]
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
    fn surfaces_are_steps_behind_their_distance() {
        let (distance, total) = sums(&[(1.0, 0.4), (2.0, 0.2)]);
        let list = List { distance: &distance, total: &total };
        for (d, a) in [(0.5, 0.0), (1.0, 0.0), (1.001, 0.4), (2.0, 0.4), (7.0, 0.6)] {
            assert!((steps(list, d)[0] - a).abs() < 1e-6);
        }
    }
}
