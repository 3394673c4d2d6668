//! Reconstruction of volumes in slabs: each voxel writes into them, or each of their pixels reads the lattice.

use super::half;
use crate::cost::extent::Extent;
use crate::load::own::{Body, Own};
use crate::scene::{self, Scene, SheetKernel, Technique};
use sheet_light::{GatherKernel, KernelShape, Params, Reconstruction};
use splat_core::{Accumulation, Camera};

/// Share of voxels with extinction below which the plan has volumes splatted in slabs across the view: a splat is made of such a voxel alone, while all of a lattice
/// is filtered before it is gathered. Where more shows, gathering takes as long or less (`scenes/head.toml`, 1 % to 60 % of its voxels, 1 to 22 samples along one).
const SPARSE: f64 = 0.05;

/// The form of a scene's slabs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chosen {
    pub(super) reconstruction: Reconstruction,
    /// Why, as `explain` says it.
    pub(super) reason: &'static str,
}

/// The form that a scene states, or the plan chooses for it. `camera` is that of samples.
pub(super) fn chosen(scene: &Scene, natives: &[Own], camera: &Camera) -> Chosen {
    let settings = &scene.render.sheets;
    let kernel = match settings.kernel {
        SheetKernel::Gaussian => GatherKernel::Gaussian,
        SheetKernel::Linear => GatherKernel::Linear,
    };
    let volumes = || natives.iter().filter(|native| native.technique == Technique::Sheets && native.grid().is_some());
    let voxels: f64 = volumes().filter_map(Own::grid).map(|grid| grid.values.len() as f64).sum();
    let visible = (volumes().map(|native| native.voxels() as f64).sum::<f64>() / voxels.max(1.0)).min(1.0);
    let splat = |reason| Chosen { reconstruction: Reconstruction::Splat, reason };
    let gather = |reason| Chosen { reconstruction: Reconstruction::Gather(kernel), reason };
    let states_kernel = KernelShape { extent: settings.kernel_extent, sigma: settings.kernel_sigma }
        != KernelShape::default()
        || settings.kernel_sections != Params::default().sections;
    let is_body_centred = |native: &Own| matches!(&native.body, Body::Cells { body_centred: Some(_), .. });
    let samples_along_a_voxel = |native: &Own| {
        let step = native.grid().map_or(0.0, |grid| grid.shortest_step() * native.transform.scale);
        step * Extent::new(&native.world_box(), camera).samples_per_unit
    };
    match settings.reconstruction {
        scene::Reconstruction::Gather => return gather("the scene asks for it"),
        scene::Reconstruction::Splat => return splat("the scene asks for it"),
        scene::Reconstruction::Auto => {}
    }
    if states_kernel {
        splat("the scene states a kernel that is splatted alone")
    } else if settings.classify == scene::Classify::Before {
        splat("values are classified before they are reconstructed")
    } else if settings.aligned == scene::Aligned::Axis {
        splat("slabs lie along the lattice")
    } else if settings.accumulation == Accumulation::F16 {
        splat("slabs sum in half precision")
    } else if volumes().any(is_body_centred) {
        splat("a lattice is body-centred")
    } else if volumes().any(|native| samples_along_a_voxel(native) < 1.0) {
        splat("voxels are finer than samples, which splats average")
    } else if half::is_asked(scene) {
        gather(
            "slabs lie across half vectors, where splatting would draw a voxel into each of its slabs anew, for the eye and for each light",
        )
    } else if visible < SPARSE {
        splat("fewer than a twentieth of the voxels have extinction, and these alone become splats")
    } else {
        gather(
            "a twentieth of the voxels or more has extinction, and pixels read them in less time than all are splatted",
        )
    }
}
