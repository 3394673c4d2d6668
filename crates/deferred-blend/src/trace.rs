//! Traces a ray within and between bodies of glass, from the nearest layer of a pixel on. At each surface the ray follows the larger
//! part of its light. The smaller part takes the radiance of an unbent ray in its direction.
//!
//! The transmitted and the mirrored share add up to 1 at every surface. So in surroundings of one colour every ray has that colour, whatever
//! bodies it meets.

use crate::cone::{Cone, onward};
use crate::glass::Glass;
use crate::interface::cross;
use crate::surfaces::{Met, RayTarget};
use splat_core::Material;
use splat_core::glam::Vec3;

/// Surfaces that a ray is followed through; behind the last one nothing bends it.
const MOST_SURFACES: usize = 12;

/// Share of its light below which a ray is not followed.
const LEAST_SHARE: f32 = 1e-4;

/// Objects that a place lies in, by the order in which they were entered; their indices are those of the last one.
#[derive(Debug, Clone)]
pub(crate) struct Inside<'m>(Vec<(u32, &'m Material)>);

impl<'m> Inside<'m> {
    pub(crate) fn new(objects: impl Iterator<Item = (u32, &'m Material)>) -> Self {
        Self(objects.collect())
    }

    fn index(&self, channel: usize) -> f32 {
        self.0.last().map_or(1.0, |(_, material)| material.index_inside()[channel])
    }

    /// Through a surface of an object: out of it, or into it.
    fn crossed(&self, object: u32, material: &'m Material) -> Self {
        let mut other = self.clone();
        match other.0.iter().rposition(|(entered, _)| *entered == object) {
            Some(at) => _ = other.0.remove(at),
            None => other.0.push((object, material)),
        }
        other
    }
}

/// Radiance along a ray that starts on a surface, inside of these objects, and is bent by the index of one channel. The other channels
/// are those of a ray that goes the same way.
pub(crate) fn trace<'m>(
    glass: &'m Glass<'_>,
    mut from: Vec3,
    mut along: Vec3,
    mut cone: Cone,
    mut inside: Inside<'m>,
    channel: usize,
) -> [f32; 3] {
    let mut sum = [0.0; 3];
    let mut share = [1.0f32; 3];
    let mut leaves = inside.0.last().map_or(u32::MAX, |(object, _)| *object);
    for _ in 0..MOST_SURFACES {
        let Some(met) = glass.surfaces.nearest(from, along, RayTarget::AllBut(leaves)) else {
            add(&mut sum, share, (glass.sky)(along, cone.solid_angle()));
            return sum;
        };
        for (_, material) in inside.0.iter().rev().take(1) {
            let depth = glass.absorbed(material, met.distance);
            (0..3).for_each(|c| share[c] *= libm::expf(-depth[c]));
        }
        if met.is_opaque {
            add(&mut sum, share, met.radiance);
            return sum;
        }
        from += along * met.distance;
        cone = cone.after(met.distance);
        leaves = met.object;
        let beyond = inside.crossed(met.object, met.material);
        let ratio = inside.index(channel) / beyond.index(channel);
        let crossing = cross(along, met.normal, ratio);
        let [passing, thrown] = onward(cone, met.curvature, ratio, &crossing);
        let mirrored = crossing.reflectance;
        let passes = share.map(|s| s * (1.0 - mirrored));
        if mirrored > 0.5 {
            if mirrored < 1.0 {
                let (shown, left) = through(&met, passes);
                add(&mut sum, [1.0; 3], shown);
                add(&mut sum, left, glass.seen(from, crossing.bent, passing));
            }
            share = share.map(|s| s * mirrored);
            (along, cone) = (crossing.mirrored, thrown);
        } else {
            if mirrored > 0.0 {
                add(&mut sum, share.map(|s| s * mirrored), glass.seen(from, crossing.mirrored, thrown));
            }
            let (shown, left) = through(&met, passes);
            add(&mut sum, [1.0; 3], shown);
            (share, along, cone, inside) = (left, crossing.bent, passing, beyond);
        }
        if share.iter().all(|s| *s < LEAST_SHARE) {
            return sum;
        }
    }
    add(&mut sum, share, glass.seen(from, along, cone));
    sum
}

/// Returns the radiance that a layer adds to a ray of a given share, and the share behind it.
fn through(met: &Met<'_>, share: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let radiance = std::array::from_fn(|c| share[c] * met.radiance[c]);
    (radiance, std::array::from_fn(|c| share[c] * (1.0 - met.opacity[c])))
}

fn add(sum: &mut [f32; 3], share: [f32; 3], radiance: [f32; 3]) {
    (0..3).for_each(|c| sum[c] += share[c] * radiance[c]);
}
