//! Rays of an image in the lattice of a volume: where they enter and leave it.
//!
//! What a pixel's ray has of the medium in a slab is the length of ray ∩ slab ∩ volume, the volume being a parallelepiped: three
//! pairs of planes in lattice coordinates. Lengths of neighbouring slabs add up to that of the whole, so a constant volume has
//! e^−τ at any slab width and through any lens.

use crate::shared::volume::Volume;
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Clip, Similarity};

/// A ray in view space: `from` + `along`·z, z the view depth that it has come from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ViewRay {
    pub(crate) from: DVec3,
    pub(crate) along: DVec3,
}

impl ViewRay {
    /// That through a place of the image, pixels.
    pub(crate) fn through(camera: &Camera, x_px: f64, y_px: f64) -> Self {
        let (from, along) = camera.view_ray(x_px, y_px);
        Self { from, along }
    }
}

/// A view ray in lattice coordinates: `start` + `along`·z, z the view depth that it has come from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LatticeLine {
    pub(crate) start: DVec3,
    pub(crate) along: DVec3,
}

/// A volume's lattice coordinates of a view ray: origin + direction·z, and the planes that it is cut along.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LatticeRays {
    lattice_from_view: DMat3,
    start: DVec3,
    lowest: DVec3,
    highest: DVec3,
    /// Normals that lead out, and what their products with the border are, in view space.
    planes: Vec<(DVec3, f64)>,
    origin: f64,
}

impl LatticeRays {
    /// Depths are counted from `origin`.
    pub(crate) fn new(volume: &Volume<'_>, camera: &Camera, origin: f64) -> Self {
        let world_from_view = DMat3::from_cols(camera.axes[0], camera.axes[1], camera.axes[2]);
        let inverse = volume.axes().inverse();
        let lowest = volume.packing.lowest();
        let Similarity { scale, rotation, .. } = volume.transform;
        let eye = rotation.inverse() * (camera.position - volume.transform.translation) / scale;
        let plane = |(normal, offset): (DVec3, f64)| {
            (world_from_view.transpose() * (rotation * normal), (offset - normal.dot(eye)) * scale)
        };
        Self {
            lattice_from_view: inverse * world_from_view,
            start: inverse * (camera.position - volume.origin()),
            lowest,
            highest: lowest + DVec3::from_array(volume.grid.dims.map(|n| n as f64)),
            planes: volume.clip.iter().flat_map(Clip::half_spaces).map(plane).collect(),
            origin,
        }
    }

    /// Rows of what leads from view positions, depths counted from the origin, to lattice coordinates.
    pub(crate) fn rows(&self) -> [[f64; 4]; 3] {
        let start = self.lattice(DVec3::Z * self.origin);
        [0, 1, 2].map(|a| {
            let row = self.lattice_from_view.row(a);
            [row.x, row.y, row.z, start[a]]
        })
    }

    /// A view ray in lattice coordinates, from the place on it at a depth that is counted from the origin.
    #[inline(always)]
    pub(crate) fn line(&self, ray: ViewRay, depth: f64) -> LatticeLine {
        let start = self.lattice(ray.from + ray.along * (self.origin + depth));
        LatticeLine { start, along: self.lattice_from_view * ray.along }
    }

    /// Lattice coordinates of a view position.
    fn lattice(&self, place: DVec3) -> DVec3 {
        self.start + self.lattice_from_view * place
    }

    /// Where a view ray is inside, counted from the origin, not behind the eye.
    pub(crate) fn crossing(&self, ray: ViewRay) -> [f64; 2] {
        let ViewRay { from, along } = ray;
        let mut near = 0.0f64;
        let mut far = f64::INFINITY;
        for (normal, offset) in &self.planes {
            let to_border = offset - normal.dot(from);
            let leaves = normal.dot(along);
            match leaves {
                0.0 if to_border < 0.0 => return [f64::INFINITY, f64::NEG_INFINITY],
                0.0 => {}
                _ if leaves > 0.0 => far = far.min(to_border / leaves),
                _ => near = near.max(to_border / leaves),
            }
        }
        let from = self.lattice(from);
        let along = self.lattice_from_view * along;
        for a in 0..3 {
            let to_low = self.lowest[a] - from[a];
            let to_high = self.highest[a] - from[a];
            if along[a] == 0.0 {
                if to_low > 0.0 || to_high < 0.0 {
                    return [f64::INFINITY, f64::NEG_INFINITY];
                }
                continue;
            }
            // Divisions are most of what a ray takes.
            let per_step = 1.0 / along[a];
            let one = to_low * per_step;
            let other = to_high * per_step;
            (near, far) = (near.max(one.min(other)), far.min(one.max(other)));
        }
        [near - self.origin, far - self.origin]
    }
}
