//! Slab coordinates: two along the slabs, the third across them, counted from the first slab the way that light travels.
//!
//! They are taken from the middle of all volumes, subtracted in f64, so that single precision suffices wherever the scene lies.

use super::axis::HalfVector;
use super::bodies::Bodies;
use crate::shared::lattice::spacing_along;
use crate::shared::slabs::Slabs;
use crate::{Error, Params, Volume};
use splat_core::Camera;
use splat_core::glam::{DMat3, DVec3};

/// The coordinates of one sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    center: DVec3,
    /// Rows: two unit vectors along the slabs, one across.
    pub(crate) axes: [DVec3; 3],
    pub(crate) slabs: Slabs,
    /// Whether the eye meets the last slab first.
    pub(crate) back_to_front: bool,
}

/// A ray in slab coordinates: `from` + `along`·z, z the depth in its image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ray {
    pub(crate) from: DVec3,
    pub(crate) along: DVec3,
}

impl Frame {
    /// Slabs across `axis` that hold all bodies.
    pub(crate) fn new(bodies: &Bodies<'_>, camera: &Camera, params: &Params, axis: &HalfVector) -> Result<Self, Error> {
        let across = axis.normal;
        // Rows of pixels lie along the slabs as well as they can.
        let [right, up, _] = camera.axes;
        let along = if right.dot(across).abs() <= up.dot(across).abs() { right } else { up };
        let first = (along - across * along.dot(across)).normalize();
        let axes = [first, across.cross(first), across];
        let nowhere = Slabs { origin: 0.0, width: 1.0, count: 0 };
        let mut frame = Self { center: bodies.middle(), axes, slabs: nowhere, back_to_front: axis.back_to_front };
        let mut spacing = f64::INFINITY;
        let mut reach = 0.0f64;
        for volume in bodies.volumes {
            let along = spacing_along(&volume.packing.equivalent_steps(frame.steps(volume)));
            (spacing, reach) = (spacing.min(along), reach.max(along * params.kernel.extent));
        }
        if let Some(splats) = bodies.splats.filter(|_| bodies.volumes.is_empty()) {
            spacing = splats.slab_width;
        }
        let depths = || bodies.corners().map(|corner| frame.point(corner).z);
        let near = depths().fold(f64::INFINITY, f64::min);
        let far = depths().fold(f64::NEG_INFINITY, f64::max);
        frame.slabs = Slabs::new(near, far, params.slab_width.unwrap_or(spacing), reach)?;
        params.check_slabs(frame.slabs.count)?;
        Ok(frame)
    }

    /// Slabs across the last of three axes, along the others, from a place on; of what no eye sees.
    pub(crate) fn along(center: DVec3, axes: [DVec3; 3], slabs: Slabs) -> Self {
        Self { center, axes, slabs, back_to_front: false }
    }

    /// Slab coordinates of a world direction.
    pub(crate) fn direction(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.axes[0].dot(world), self.axes[1].dot(world), self.axes[2].dot(world))
    }

    /// Slab coordinates of a world position.
    pub(crate) fn point(&self, world: DVec3) -> DVec3 {
        let mut point = self.direction(world - self.center);
        point.z -= self.slabs.origin;
        point
    }

    /// World position of slab coordinates.
    pub(crate) fn world(&self, p: DVec3) -> DVec3 {
        let [a, b, across] = self.axes;
        self.center + a * p.x + b * p.y + across * (p.z + self.slabs.origin)
    }

    /// Steps of a lattice in slab coordinates.
    pub(crate) fn steps(&self, volume: &Volume<'_>) -> DMat3 {
        DMat3::from_cols(self.axes[0], self.axes[1], self.axes[2]).transpose() * volume.axes()
    }

    /// The ray through a place of an image, pixels.
    pub(crate) fn ray(&self, camera: &Camera, x_px: f64, y_px: f64) -> Ray {
        let (from, along) = camera.view_ray(x_px, y_px);
        let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
        Ray { from: self.point(camera.position + world(from)), along: self.direction(world(along)) }
    }
}
