//! The slabs of a view: how wide they are, and where they begin and end.

use super::slant::{Slant, plane_step};
use super::viewed::{corners, view_steps};
use crate::shared::input::SheetInput;
use crate::shared::lattice::spacing_along;
use crate::shared::params::Aligned;
use crate::shared::slabs::{Kernels, Slabs};
use crate::{Error, Params, Volume};

/// Slabs between the nearest corner of a volume, or the nearest splat, before the eye and the farthest, as narrow as the finest
/// volume needs them.
pub(crate) fn slabs_of(input: &SheetInput<'_>, params: &Params, slant: Slant) -> Result<Slabs, Error> {
    let mut near = f64::INFINITY;
    let mut far = 0.0f64;
    let mut spacing = f64::INFINITY;
    for volume in &input.volumes {
        spacing = spacing.min(spacing_of(volume, input, params));
        for corner in corners(volume, input.camera) {
            // Slabs along a lattice may lie behind the eye in some pixels alone.
            let z = if slant.is_any() { slant.sheared(corner).z } else { corner.z.max(0.0) };
            (near, far) = (near.min(z), far.max(z));
        }
    }
    if let Some(splats) = &input.splats {
        let [nearest, farthest] = splats.reach();
        (near, far) = (near.min(nearest.max(0.0)), far.max(farthest));
        if spacing == f64::INFINITY {
            spacing = splats.slab_width;
        }
    }
    if !near.is_finite() {
        return Slabs::new(0.0, 0.0, 1.0, 1.0);
    }
    let width = params.slab_width.unwrap_or(spacing);
    let kernels = |v: &Volume<'_>| Kernels { reach: reach(v, input, params), stride: stride(v, input, params, width) };
    let slabs = Slabs::for_kernels(near, far, width, &input.volumes.iter().map(kernels).collect::<Vec<_>>())?;
    params.check_slabs(slabs.count)?;
    Ok(slabs)
}

/// Steps of a volume along the view.
fn spacing_of(volume: &Volume<'_>, input: &SheetInput<'_>, params: &Params) -> f64 {
    match params.aligned {
        Aligned::View => spacing_along(&view_steps(volume, input.camera)),
        Aligned::Axis => plane_step(volume, input.camera),
    }
}

/// Radius of a volume's kernels along the view.
pub(crate) fn reach(volume: &Volume<'_>, input: &SheetInput<'_>, params: &Params) -> f64 {
    let extent = if params.aligned == Aligned::View { params.kernel.extent } else { 0.5 };
    spacing_of(volume, input, params) * extent
}

/// How many slabs of this width one of the volume's own has: as many as its spacing along the view has, where that chooses the width.
pub(crate) fn stride(volume: &Volume<'_>, input: &SheetInput<'_>, params: &Params, width: f64) -> u32 {
    /// Steps that are equal but for rounding are.
    const EQUAL: f64 = 1.0 + 1e-6;
    /// Most slabs in one.
    const MOST: f64 = 65536.0;
    let slabs = spacing_of(volume, input, params) / width * EQUAL;
    if params.slab_width.is_some() { 1 } else { slabs.clamp(1.0, MOST) as u32 }
}
