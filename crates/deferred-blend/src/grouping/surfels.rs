//! Discs as grouping sees them: ellipses in space, in the canonical order of their cloud.

use crate::Error;
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Cloud, SplatKind};

/// Discs read by one task.
pub(crate) const CHUNK: usize = 4096;

/// What is near in f64 is nearer than this in f32, whose differences, sums and squares are off by less.
pub(crate) const MORE: f32 = 1.0 + 1e-6;

/// Rounds of the search for the greatest contact function; each leaves 0.62 of the interval.
const CONTACT_ROUNDS: u32 = 40;

/// One disc.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Surfel {
    /// Centre, relative to the cloud's origin.
    pub(crate) center: Vec3,
    /// The longer semi-axis.
    pub(crate) reach: f32,
    /// Unit normal.
    pub(crate) normal: Vec3,
    /// Place in the cloud.
    pub(crate) place: u32,
    /// First semi-axis of an ellipse, zero for a circle.
    pub(crate) first: Vec3,
    /// Length of the other semi-axis.
    pub(crate) across: f32,
}

/// Reads all discs of a cloud, in canonical order, their radii times `scale`.
pub(crate) fn read(cloud: &Cloud, scale: f32) -> Result<Vec<Surfel>, Error> {
    Ok(gather(cloud, &order(cloud, scale)?, scale))
}

/// The discs at some places.
pub(crate) fn gather(cloud: &Cloud, places: &[u32], scale: f32) -> Vec<Surfel> {
    places.par_iter().with_min_len(CHUNK).map(|&place| Surfel::new(cloud, place, scale)).collect()
}

/// The canonical order of a cloud that was looked through.
pub(crate) fn order(cloud: &Cloud, scale: f32) -> Result<Vec<u32>, Error> {
    if !(scale > 0.0 && scale <= 1.0) {
        return Err(Error::parameter("disc_scale", scale, "above 0 and at most 1"));
    }
    cloud.validate().map_err(Error::Cloud)?;
    if let Some(i) = cloud.kind.par_iter().with_min_len(CHUNK).position_first(|kind| *kind == SplatKind::Medium) {
        let found = splat_core::Error::invalid("splat", i, "kind", SplatKind::Medium, "a disc of a surface");
        return Err(Error::Cloud(found));
    }
    Ok(cloud.canonical_order())
}

impl Surfel {
    /// The disc at a place of a cloud, its radii times `scale`.
    pub(crate) fn new(cloud: &Cloud, place: u32, scale: f32) -> Self {
        let i = place as usize;
        let scale = f64::from(scale);
        let across = (f64::from(cloud.radius[i]) * scale) as f32;
        let first = (cloud.tangent_of(i).as_dvec3() * scale).as_vec3();
        let circle = Self {
            center: cloud.position[i],
            reach: across,
            normal: cloud.normal_of(i),
            place,
            first: Vec3::ZERO,
            across,
        };
        if first == Vec3::ZERO {
            return circle;
        }
        Self { first, reach: across.max(first.as_dvec3().length() as f32), ..circle }
    }

    /// Adds the numbers of those discs, with their centres and reaches, to a list that may lie within a distance that is `factor` times the
    /// sum of both reaches, [`MORE`] included: in f32, and without a branch, which would be foretold wrongly.
    #[inline]
    pub(crate) fn add_near(
        &self,
        discs: impl ExactSizeIterator<Item = (u32, Vec3, f32)>,
        factor: f32,
        near: &mut Vec<u32>,
    ) {
        let mut end = near.len();
        near.resize(end + discs.len(), 0);
        for (number, center, reach) in discs {
            let reach = factor * (self.reach + reach);
            // Squares of the least numbers lose their digits.
            let is_near = self.center.distance_squared(center) <= (reach * reach).max(f32::MIN_POSITIVE);
            near[end] = number;
            end += usize::from(is_near);
        }
        near.truncate(end);
    }

    pub(crate) fn is_circle(&self) -> bool {
        self.first == Vec3::ZERO
    }

    /// The shorter semi-axis.
    pub(crate) fn least(&self) -> f32 {
        if self.is_circle() { self.across } else { self.across.min(self.first.as_dvec3().length() as f32) }
    }

    /// Semi-axes.
    pub(crate) fn axes(&self) -> [DVec3; 2] {
        let normal = self.normal.as_dvec3();
        let across = f64::from(self.across);
        let unit = normal.normalize_or(DVec3::Z);
        let first = if self.is_circle() { unit.any_orthonormal_vector() * across } else { self.first.as_dvec3() };
        [first, unit.cross(first).normalize_or(unit.any_orthonormal_vector()) * across]
    }

    /// Radius of the circle of the same area.
    pub(crate) fn mean_radius(&self) -> f64 {
        if self.is_circle() {
            return f64::from(self.across);
        }
        let [a, b] = self.axes();
        (a.length() * b.length()).sqrt()
    }

    /// From another disc's centre to this one's.
    pub(crate) fn from(&self, other: &Self) -> DVec3 {
        self.center.as_dvec3() - other.center.as_dvec3()
    }

    /// Eq. 5 with the factor c: whether both discs, `factor` times as large, overlap wherever they are seen from. A circle counts
    /// as the ball around it, an ellipse as the ellipsoid whose third semi-axis is its shorter one.
    pub(crate) fn overlaps(&self, other: &Self, factor: f64) -> bool {
        let offset = self.from(other);
        let squared = offset.length_squared();
        let within = |a: f32, b: f32| {
            let reach = factor * (f64::from(a) + f64::from(b));
            squared < reach * reach
        };
        if !within(self.reach, other.reach) {
            return false;
        }
        (self.is_circle() && other.is_circle())
            || within(self.least(), other.least())
            || contact_is_below(offset, self.shape(), other.shape(), factor * factor)
    }

    /// Sum of n·nᵀ over the semi-axes of the ellipsoid.
    fn shape(&self) -> DMat3 {
        let [a, b] = self.axes();
        let least = a.length().min(b.length());
        let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        outer(a) + outer(b) + outer(self.normal.as_dvec3().normalize_or(DVec3::Z) * least)
    }
}

/// Whether two ellipsoids that lie `offset` apart have a contact function below `bound`: the greatest
/// λ(1 − λ)·Rᵀ((1 − λ)A + λB)⁻¹R over λ in \[0, 1\] (Perram and Wertheim 1985), which is 1 where they touch, and squared is the
/// factor by which both must grow to touch. For balls it is |R|²/(r_a + r_b)².
fn contact_is_below(offset: DVec3, a: DMat3, b: DMat3, bound: f64) -> bool {
    let at = |lambda: f64| {
        let mixed = a * (1.0 - lambda) + b * lambda;
        lambda * (1.0 - lambda) * offset.dot(mixed.inverse() * offset)
    };
    // Golden sections: the function is concave.
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let mut low = 0.0;
    let mut high = 1.0;
    let mut left = 1.0 - golden;
    let mut right = golden;
    let mut at_left = at(left);
    let mut at_right = at(right);
    for _ in 0..CONTACT_ROUNDS {
        if at_left.max(at_right) >= bound {
            return false;
        }
        if at_left < at_right {
            (low, left, at_left) = (left, right, at_right);
            right = low + golden * (high - low);
            at_right = at(right);
        } else {
            (high, right, at_right) = (right, left, at_left);
            left = high - golden * (high - low);
            at_left = at(left);
        }
    }
    true
}
