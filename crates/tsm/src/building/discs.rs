//! Discs side by side: surfaces and opaque splats in the light's frame, as [`Casters::get`] makes them one by one.

use crate::building::caster::{Casters, disc};
use crate::building::lanes::{Columns, LANES};
use crate::frame::Frame;
use glam::Vec3;
use splat_core::glam;

/// Columns of a disc: position, unit normal, semi-axes, the longer of them.
const POSITION: usize = 0;
const NORMAL: usize = 3;
const AXES: usize = 6;
const RADIUS: usize = 12;
const COUNT: usize = 13;

/// Discs in the light's frame.
#[derive(Debug, Default)]
pub(crate) struct Discs {
    columns: Columns<COUNT>,
    /// Normal and tangent, radius, radius of the shadow, as they lie in the cloud.
    splats: Columns<11>,
}

impl Discs {
    /// Up to [`LANES`] splats, opaque ones in the size of their shadow; lanes without one keep what they had.
    #[inline(always)]
    pub(crate) fn load(&mut self, casters: &Casters<'_>, ids: &[u32], frame: &Frame, is_opaque: bool) {
        let cloud = casters.cloud;
        for (l, &id) in ids.iter().enumerate().take(LANES) {
            let i = id as usize;
            self.splats.set(0, l, cloud.position[i].to_array());
            self.splats.set(3, l, cloud.normal_of(i).to_array());
            self.splats.set(6, l, cloud.tangent_of(i).to_array());
            self.splats.set(9, l, [cloud.radius[i], cloud.cross_section[i]]);
        }
        let read = |first: usize, l: usize| Vec3::from_array([0, 1, 2].map(|k| self.splats.column[first + k][l]));
        for l in 0..LANES {
            let p = frame.position(read(0, l));
            self.columns.set(POSITION, l, p.to_array());
        }
        for l in 0..LANES {
            let radius = self.splats.column[9][l];
            let area = self.splats.column[10][l];
            let shadow = is_opaque.then(|| frame.length(casters.shadow_radius_of_area(area)));
            let tangent = frame.displacement(read(6, l));
            let (axes, normal, radius) = disc(frame.turn(read(3, l)), tangent, frame.length(radius), shadow);
            self.columns.set(NORMAL, l, normal.to_array());
            self.columns.set(AXES, l, axes[0].to_array());
            self.columns.set(AXES + 3, l, axes[1].to_array());
            self.columns.set(RADIUS, l, [radius]);
        }
    }

    #[inline(always)]
    fn vector(&self, first: usize, l: usize) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|k| self.columns.column[first + k][l]))
    }

    #[inline(always)]
    pub(crate) fn position(&self, l: usize) -> Vec3 {
        self.vector(POSITION, l)
    }

    /// Unit normal.
    #[inline(always)]
    pub(crate) fn normal(&self, l: usize) -> Vec3 {
        self.vector(NORMAL, l)
    }

    #[inline(always)]
    pub(crate) fn axes(&self, l: usize) -> [Vec3; 2] {
        [self.vector(AXES, l), self.vector(AXES + 3, l)]
    }

    /// The longer semi-axis.
    #[inline(always)]
    pub(crate) fn radius(&self, l: usize) -> f32 {
        self.columns.column[RADIUS][l]
    }
}
