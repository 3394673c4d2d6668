//! Regions that things are cut to: half-spaces and boxes.

use crate::{DAabb, Error};
use glam::DVec3;

/// A part of space that is kept of what is cut; its border belongs to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clip {
    /// Where normal·p ≤ offset.
    HalfSpace {
        /// Direction that leads out, any length but 0.
        normal: DVec3,
        /// normal·p of the border.
        offset: f64,
    },
    /// Inside a box that is not empty.
    Box(DAabb),
}

impl Clip {
    /// Whether a place is kept.
    pub fn keeps(&self, p: DVec3) -> bool {
        match *self {
            Self::HalfSpace { normal, offset } => normal.dot(p) <= offset,
            Self::Box(bounds) => bounds.contains(p),
        }
    }

    /// Whether something within `radius` of `p` may be kept.
    pub fn may_keep(&self, p: DVec3, radius: f64) -> bool {
        match *self {
            Self::HalfSpace { normal, offset } => normal.dot(p) - offset <= radius * normal.length(),
            Self::Box(bounds) => bounds.distance_squared(p).sqrt() <= radius,
        }
    }

    /// The half-spaces that the region is the intersection of, as pairs of the normal that leads out and its product with the border.
    ///
    /// ```
    /// use splat_core::{Clip, DAabb, glam::DVec3};
    /// let cube = Clip::Box(DAabb::new(DVec3::ZERO, DVec3::ONE));
    /// let is_within = |p: DVec3| cube.half_spaces().all(|(normal, offset)| normal.dot(p) <= offset);
    /// assert!(cube.half_spaces().count() == 6 && is_within(DVec3::splat(0.5)) && !is_within(DVec3::splat(1.5)));
    /// ```
    pub fn half_spaces(&self) -> impl Iterator<Item = (DVec3, f64)> + use<> {
        let (one, six) = match *self {
            Self::HalfSpace { normal, offset } => (Some((normal, offset)), None),
            Self::Box(DAabb { min, max }) => {
                let side = move |k: usize| {
                    let axis = [DVec3::X, DVec3::Y, DVec3::Z][k / 2];
                    if k.is_multiple_of(2) { (axis, axis.dot(max)) } else { (-axis, -axis.dot(min)) }
                };
                (None, Some((0..6).map(side)))
            }
        };
        one.into_iter().chain(six.into_iter().flatten())
    }

    /// Checks that it is a region.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a half-space without a normal, a box whose corners are in the wrong order, and numbers that are not finite.
    pub fn validate(&self) -> Result<(), Error> {
        match *self {
            Self::HalfSpace { normal, offset }
                if !(normal.is_finite() && normal != DVec3::ZERO && offset.is_finite()) =>
            {
                let expected = "finite numbers, a normal that is not 0";
                Err(Error::invalid("half-space", 0, "normal and offset", (normal, offset), expected))
            }
            Self::Box(DAabb { min, max }) if !(min.is_finite() && max.is_finite() && min.cmple(max).all()) => {
                let expected = "two finite corners, the first nowhere above the second";
                Err(Error::invalid("clip box", 0, "corners", [min, max], expected))
            }
            _ => Ok(()),
        }
    }
}
