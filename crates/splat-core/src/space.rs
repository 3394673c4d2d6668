//! Spaces: bounds and similarity transforms.

use glam::{DQuat, DVec3, Vec3};

/// Axis-aligned bounds relative to a cloud's origin. Empty bounds have `min > max`.
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

    /// World direction of `d`, length kept.
    pub fn rotate(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }
}
