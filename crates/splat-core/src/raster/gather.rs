//! Attributes of neighbouring splats, turned from the rows of a cloud into lanes.

use super::kernel::Kernel;
use super::lanes::MAX_LANES;
use crate::optics::SurfaceOpacity;
use crate::{Cloud, Material, SplatKind};
use glam::Vec3;

/// One number a lane.
pub(crate) type Column = [f32; MAX_LANES];

/// What projection reads.
#[derive(Clone, Copy)]
pub(crate) struct Columns<'a> {
    pub(crate) cloud: &'a Cloud,
    pub(crate) kernels: &'a [Kernel],
    pub(crate) materials: &'a [Material],
}

/// The attributes of as many splats as there are lanes.
#[derive(Default)]
pub(crate) struct Attributes {
    pub(crate) position: [Column; 3],
    pub(crate) radius: Column,
    pub(crate) cross_section: Column,
    pub(crate) norm: Column,
    pub(crate) cutoff: Column,
    /// Half the width of the share before a plane, for R = 1.
    pub(crate) half_width: Column,
    pub(crate) normal: [Column; 3],
    pub(crate) tangent: [Column; 3],
    /// −1 for a medium, 1 for a disc.
    pub(crate) disc: Column,
    /// −1 for a slab whose optical depth grows at grazing angles, else 1.
    pub(crate) crossing: Column,
    /// −1 for an opaque disc, else 1.
    pub(crate) opaque: Column,
    pub(crate) any_medium: bool,
    pub(crate) any_disc: bool,
    pub(crate) any_tangent: bool,
}

impl Attributes {
    /// Reads `count` splats from splat `first` on; the last of the cloud stands in for those behind it.
    #[inline(always)]
    pub(crate) fn read(&mut self, columns: &Columns<'_>, first: usize, count: usize) {
        let cloud = columns.cloud;
        let last = cloud.len() - 1;
        (self.any_medium, self.any_disc, self.any_tangent) = (false, false, false);
        for l in 0..count {
            let i = (first + l).min(last);
            put(&mut self.position, l, cloud.position[i]);
            self.radius[l] = cloud.radius[i];
            self.cross_section[l] = cloud.cross_section[i];
            let kernel = &columns.kernels[cloud.footprint[i] as usize];
            (self.norm[l], self.cutoff[l], self.half_width[l]) = (kernel.norm, kernel.cutoff, kernel.half_width);
            let medium = cloud.kind[i] == SplatKind::Medium;
            self.any_medium |= medium;
            self.any_disc |= !medium;
            self.disc[l] = if medium { -1.0 } else { 1.0 };
        }
        if self.any_disc {
            self.read_discs(columns, first, count);
        }
    }

    fn read_discs(&mut self, columns: &Columns<'_>, first: usize, count: usize) {
        let cloud = columns.cloud;
        let last = cloud.len() - 1;
        for l in 0..count {
            let i = (first + l).min(last);
            put(&mut self.normal, l, cloud.normal_of(i));
            let tangent = cloud.tangent_of(i);
            put(&mut self.tangent, l, tangent);
            self.any_tangent |= tangent != Vec3::ZERO;
            let opacity = columns.materials[cloud.material[i] as usize].surface_opacity;
            let slab = cloud.kind[i] == SplatKind::Surface && opacity == SurfaceOpacity::ThinSlab;
            self.crossing[l] = if slab { -1.0 } else { 1.0 };
            self.opaque[l] = if cloud.kind[i] == SplatKind::Opaque { -1.0 } else { 1.0 };
        }
    }
}

#[inline(always)]
fn put(to: &mut [Column; 3], lane: usize, v: Vec3) {
    (to[0][lane], to[1][lane], to[2][lane]) = (v.x, v.y, v.z);
}
