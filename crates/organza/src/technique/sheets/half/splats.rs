//! Translucent splats that are swept with the volumes.

use crate::frame::Frame;
use crate::frame::matter::Matter;
use sheet_light::half::{HalfSplats, SplatBounds};
use splat_core::raster::{self, Detail, ProjectInput, Projected};
use splat_core::{Cloud, SplatKind};

/// Where the splats are that sweeps draw; `None` without any, and before they are made.
pub(super) fn splat_bounds(matter: &Matter<'_>) -> Option<SplatBounds> {
    SplatBounds::from_cloud(matter.cloud?, own_splats(matter))
}

/// Ids of the translucent splats of objects that become nothing else.
fn own_splats<'a>(matter: &Matter<'a>) -> impl Iterator<Item = u32> + use<'a> {
    let mut is_own = vec![false; matter.scene.objects.len()];
    matter.own.iter().for_each(|native| is_own[native.object] = true);
    let kinds = matter.cloud.into_iter().flat_map(|cloud| cloud.kind.iter().zip(&cloud.object));
    let is_one = move |kind: SplatKind, object: u32| kind != SplatKind::Opaque && !is_own[object as usize];
    (0..).zip(kinds).filter_map(move |(id, (kind, object))| is_one(*kind, *object).then_some(id))
}

/// The translucent splats of a frame, for which it has no radiance: theirs is found in sweeps.
pub(super) struct OwnSplats {
    pub(super) cloud: Cloud,
    projected: Projected,
    slab_width: f64,
}

impl OwnSplats {
    pub(super) fn new(frame: &Frame<'_>) -> Option<Self> {
        let slab_width = splat_bounds(&frame.matter())?.slab_width;
        let cloud = frame.loaded.cloud.gather(&own_splats(&frame.matter()).collect::<Vec<u32>>());
        let projected = raster::project(&ProjectInput {
            cloud: &cloud,
            camera: &frame.camera,
            footprints: &frame.loaded.footprints,
            materials: &frame.loaded.materials,
            params: &frame.raster_params(),
            detail: Detail { depth: true, ..frame.detail() },
        });
        Some(Self { cloud, projected, slab_width })
    }

    pub(super) fn input<'a>(&'a self, frame: &'a Frame<'_>) -> HalfSplats<'a> {
        let Self { cloud, projected, slab_width } = self;
        let materials = &frame.loaded.materials;
        let objects = &frame.loaded.objects;
        let footprints = &frame.loaded.footprints;
        HalfSplats { cloud, materials, objects, footprints, projected, slab_width: *slab_width }
    }
}
