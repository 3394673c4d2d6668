//! Spaces: bounds and similarity transforms.

use glam::{BVec3, DQuat, DVec3, Vec3};

/// Axis-aligned bounds relative to a cloud's origin. Empty bounds have `min > max`. [`DAabb`] is the same in f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: Vec3,
    /// Highest corner.
    pub max: Vec3,
}

impl Aabb {
    /// Bounds of nothing.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Bounds of `points`.
    pub fn of_points(points: &[Vec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(*p), max: b.max.max(*p) })
    }

    /// Bounds of what is in either.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// True for bounds of nothing.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Middle of the bounds.
    pub fn center(&self) -> Vec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// Length of the diagonal, 0 for empty bounds.
    pub fn diagonal(&self) -> f32 {
        if self.is_empty() { 0.0 } else { (self.max - self.min).length() }
    }
}

/// Axis-aligned bounds in f64, of an object's own space or of the world. Empty bounds have `min > max`.
///
/// ```
/// use splat_core::{DAabb, glam::DVec3};
/// let cube = DAabb::around(DVec3::ZERO, DVec3::ONE);
/// assert_eq!(cube.union(DAabb::EMPTY), cube);
/// assert_eq!(DAabb::of_points(cube.corners()), cube);
/// assert_eq!(cube.distance_squared(DVec3::new(4.0, 5.0, 0.5)), 25.0);
/// assert!(cube.contains(DVec3::X) && !cube.contains(2.0 * DVec3::X));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DAabb {
    /// Lowest corner.
    pub min: DVec3,
    /// Highest corner.
    pub max: DVec3,
}

impl DAabb {
    /// Bounds of nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Between the lowest and the highest corner.
    pub const fn new(min: DVec3, max: DVec3) -> Self {
        Self { min, max }
    }

    /// `reach` to either side of a place on each axis.
    pub fn around(center: DVec3, reach: DVec3) -> Self {
        Self { min: center - reach, max: center + reach }
    }

    /// Bounds of `points`.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| b.union(Self::new(p, p)))
    }

    /// Bounds of what is in either.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// True for bounds of nothing. Bounds without volume, as of a plane across an axis, are not empty.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether the bounds are finite and have a volume.
    pub fn is_solid(&self) -> bool {
        self.size().is_finite() && self.size().min_element() > 0.0
    }

    /// Lengths of the sides.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal, 0 for empty bounds.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.size().length() }
    }

    /// Middle of the bounds.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Whether `p` lies inside or on the rim.
    #[inline]
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// Square of the distance of `p`, 0 inside.
    #[inline]
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }

    /// The eight corners: bit a of the index is set where the coordinate on axis a is the highest.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|k| {
            let high = BVec3::new(k & 1 == 1, k >> 1 & 1 == 1, k >> 2 & 1 == 1);
            DVec3::select(high, self.max, self.min)
        })
    }
}

/// Scale, then rotate, then translate; f64, so that a translation by 1e7 keeps millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Uniform scale, > 0.
    pub scale: f64,
    /// Rotation.
    pub rotation: DQuat,
    /// Translation, world units.
    pub translation: DVec3,
}

impl Default for Similarity {
    fn default() -> Self {
        Self { scale: 1.0, rotation: DQuat::IDENTITY, translation: DVec3::ZERO }
    }
}

impl Similarity {
    /// World position of `p`.
    pub fn apply(&self, p: DVec3) -> DVec3 {
        self.rotation * (p * self.scale) + self.translation
    }

    /// The same into a world whose lengths are `factor` times as long.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { scale: self.scale * factor, translation: self.translation * factor, ..*self }
    }

    /// World direction of `d`, length kept.
    pub fn rotate(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }
}
