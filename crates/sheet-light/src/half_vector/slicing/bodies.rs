//! What slabs hold, as far as it says how they lie.

use crate::Volume;
use crate::shared::slabs::MOST_BY_SPLATS;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Aabb, Cloud, DAabb};

/// What slabs hold.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bodies<'a> {
    /// Volumes.
    pub volumes: &'a [Volume<'a>],
    /// Where splats lie; `None` without any.
    pub splats: Option<SplatBounds>,
}

/// Where splats lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplatBounds {
    /// A box that holds them, world.
    pub bounds: DAabb,
    /// Width of the slabs where neither the parameters nor a volume give one, world units, > 0.
    pub slab_width: f64,
    /// How many there are.
    pub count: u64,
}

impl SplatBounds {
    /// Those of some splats of a cloud, in slabs of half their mean radius, for neighbours are about as far apart; `None` without any.
    pub fn from_cloud(cloud: &Cloud, ids: impl Iterator<Item = u32>) -> Option<Self> {
        let mut bounds_of_splats = Aabb::EMPTY;
        let mut radii = 0.0f64;
        let mut count = 0u64;
        for id in ids {
            let position = cloud.position[id as usize];
            let radius = cloud.radius[id as usize];
            bounds_of_splats = bounds_of_splats.union(Aabb { min: position, max: position });
            (radii, count) = (radii + f64::from(radius), count + 1);
        }
        let place = |p: Vec3| cloud.origin + p.as_dvec3();
        let bounds = (count > 0).then(|| DAabb::new(place(bounds_of_splats.min), place(bounds_of_splats.max)))?;
        let least = (bounds.diagonal() / MOST_BY_SPLATS).max(f64::MIN_POSITIVE);
        Some(Self { bounds, slab_width: (0.5 * radii / count as f64).max(least), count })
    }
}

impl<'a> Bodies<'a> {
    /// Volumes alone.
    pub fn volumes(volumes: &'a [Volume<'a>]) -> Self {
        Self { volumes, splats: None }
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.volumes.is_empty() && self.splats.is_none()
    }

    /// Corners that all of them lie between, world.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> + Clone + use<'a> {
        let splats = self.splats.into_iter().flat_map(|splats| splats.bounds.corners());
        self.volumes.iter().flat_map(Volume::corners).chain(splats)
    }

    /// Middle of the bounds of all, of which there is at least one.
    pub(crate) fn middle(&self) -> DVec3 {
        let low = self.corners().fold(DVec3::INFINITY, DVec3::min);
        low + 0.5 * (self.corners().fold(DVec3::NEG_INFINITY, DVec3::max) - low)
    }

    /// The least step of a Cartesian lattice, or of that of the same spectrum as one that is not, and distance of splats, world units.
    pub(crate) fn least_step(&self) -> f64 {
        let steps = |v: &Volume<'_>| v.packing.equivalent_steps(v.axes());
        let axes = self.volumes.iter().map(steps).flat_map(|axes| [axes.x_axis, axes.y_axis, axes.z_axis]);
        let splats = self.splats.map(|splats| splats.slab_width);
        axes.map(DVec3::length).chain(splats).fold(f64::INFINITY, f64::min)
    }
}
