//! The mirrored and bent rays of surfaces that bound matter.

use super::discs::disc_input;
use crate::frame::Frame;
use crate::scene::{self, Technique};
use deferred_blend::{Bending, Surfaces};
use splat_core::{SplatKind, StageCost};

/// World units in a unit of the cloud.
pub(super) fn unit(frame: &Frame<'_>) -> f32 {
    libm::exp2(f64::from(frame.loaded.exponent)) as f32
}

pub(super) fn bending(frame: &Frame<'_>) -> Bending {
    match frame.settings.surfels.bending {
        scene::Bending::Traced => Bending::Traced,
        scene::Bending::Power => Bending::Power,
        scene::Bending::Nearest => Bending::Nearest,
    }
}

/// Opaque surfaces, and those that bound matter where rays are followed: rays from anywhere can meet them.
pub(super) fn surfaces<'a>(frame: &'a Frame<'a>, values: &'a [f32], stage: &mut StageCost) -> Surfaces<'a> {
    let cloud = frame.drawn();
    let settings = &frame.settings.surfels;
    let follows = settings.bending == scene::Bending::Traced;
    let is_met = |&i: &u32| {
        let i = i as usize;
        let bounds = |m: u16| frame.loaded.materials[m as usize].bounds_matter();
        match cloud.kind[i] {
            SplatKind::Opaque => settings.bent_behind,
            SplatKind::Surface => {
                follows && bounds(cloud.material[i]) && frame.plan.by[cloud.object[i] as usize] == Technique::Surfels
            }
            SplatKind::Medium => false,
        }
    };
    let ids: Vec<u32> = (0..cloud.len() as u32).filter(is_met).collect();
    stage.bytes = Surfaces::bytes(ids.len() as u64);
    Surfaces::new(&disc_input(frame, &ids), values, frame.layout())
}
