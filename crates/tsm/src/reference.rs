//! Slow and obvious: the paper's insertion lists with their number of steps, and optical depth by brute force in f64.

use crate::building::sampling::erf;
use glam::{DVec3, Vec3};
use splat_core::{Cloud, FootprintStack, SplatKind, glam};

/// The linked lists of Gunjee 2007, section 4.1, steps 1-3: each point is inserted by walking from the head.
#[derive(Debug, Clone)]
pub struct InsertionLists {
    lists: Vec<Vec<(f32, f32)>>,
    limit: f64,
    steps: u64,
}

impl InsertionLists {
    /// Empty lists for `cells` cells; a point behind `limit` of absorbance is not inserted.
    pub fn new(cells: usize, limit: f64) -> Self {
        Self { lists: vec![Vec::new(); cells], limit, steps: 0 }
    }

    /// Step 3 for one point: walks from the head to its place, or until the absorbance passed reaches the limit.
    pub fn insert(&mut self, cell: usize, distance: f32, absorbance: f32) {
        let Some(list) = self.lists.get_mut(cell) else { return };
        let mut passed = 0.0;
        for (i, &(d, a)) in list.iter().enumerate() {
            self.steps += 1;
            if distance < d {
                list.insert(i, (distance, absorbance));
                return;
            }
            passed += f64::from(a);
            if passed > self.limit {
                return;
            }
        }
        list.push((distance, absorbance));
    }

    /// The list of a cell, (distance, absorbance) by rising distance; empty for a cell out of range.
    pub fn list(&self, cell: usize) -> &[(f32, f32)] {
        self.lists.get(cell).map_or(&[], Vec::as_slice)
    }

    /// Elements that were compared so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }
}

/// Optical depth of all media and translucent surfaces between two offsets from the cloud's origin, in f64. Media are
/// three-dimensional kernels (a Gaussian along the ray, cut with the kernel), surfaces crossings of discs. Infinite
/// through an opaque disc. Angle dependence of thin slabs and colours are left out.
pub fn optical_depth(cloud: &Cloud, footprints: &FootprintStack, from: DVec3, to: DVec3) -> f64 {
    let length = (to - from).length();
    let direction = (to - from) / length;
    (0..cloud.len()).map(|i| splat_absorbance(cloud, footprints, i, from, direction, length)).sum()
}

fn splat_absorbance(
    cloud: &Cloud,
    footprints: &FootprintStack,
    i: usize,
    from: DVec3,
    direction: DVec3,
    length: f64,
) -> f64 {
    let [radius, k] = [cloud.radius[i], cloud.cross_section[i]].map(f64::from);
    let centre = cloud.position[i].as_dvec3() - from;
    let footprint = footprints.layers()[cloud.footprint[i] as usize % footprints.layers().len()];
    let along = centre.dot(direction);
    if cloud.kind[i] == SplatKind::Medium {
        let s = (centre - direction * along).length_squared() / (radius * radius);
        if s >= 1.0 {
            return 0.0;
        }
        let half = radius * (1.0 - s).sqrt();
        let sigma = radius / f64::from(footprint.cutoff) * std::f64::consts::SQRT_2;
        let cdf = |t: f64| 0.5 * (1.0 + erf(t.clamp(-half, half) / sigma) / erf(half / sigma));
        return k * footprint.norm() / (radius * radius) * footprint.profile(s) * (cdf(length - along) - cdf(-along));
    }
    let normal = cloud.normal_of(i).as_dvec3();
    let t = centre.dot(normal) / direction.dot(normal);
    if !(t > 0.0 && t < length) {
        return 0.0;
    }
    let hit = direction * t - centre;
    let tangent = if cloud.tangent_of(i) == Vec3::ZERO {
        cloud.normal_of(i).any_orthonormal_vector().as_dvec3() * radius
    } else {
        cloud.tangent_of(i).as_dvec3()
    };
    let second = normal.cross(tangent.normalize()) * radius;
    let s = (hit.dot(tangent) / tangent.length_squared()).powi(2) + (hit.dot(second) / (radius * radius)).powi(2);
    if cloud.kind[i] == SplatKind::Opaque {
        let area = s * radius * tangent.length() * std::f64::consts::PI;
        return if area <= k { f64::INFINITY } else { 0.0 };
    }
    k * footprint.norm() / (radius * tangent.length()) * footprint.profile(s)
}
