//! Compositing that follows other stages on the device.
//!
//! The footprints and the values come from recordings before it, joined by [`Recording::join`], and so does the order, or it is
//! given; how many splats are in an order that a sort has made is read where the sort has left it. What is uploaded is the
//! view, the tables and the opaque surface's depths.
//!
//! [`Recording::join`]: splat_shaders::Recording::join

use super::{Capacities, Image, Recorded, Uploads, record_as};
use crate::raster::kernel::Kernel;
use crate::raster::{OpaqueImage, Params};
use crate::{Accumulator, Camera, Direction, Error, FootprintStack, Material};

/// What is composited into, and how.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The view that splats were projected into.
    pub camera: &'a Camera,
    /// Footprints.
    pub footprints: &'a FootprintStack,
    /// Extinctions.
    pub materials: &'a [Material],
    /// What hides splats; `None` where it lies on the device, resolved by a recording before.
    pub opaque: Option<&'a OpaqueImage>,
    /// Which end comes first.
    pub direction: Direction,
    /// The cut-off; the precision must be single.
    pub params: &'a Params,
    /// Ids in compositing order; none where a sort on the device makes it.
    pub order: &'a [u32],
    /// Objects by id, where the recording keeps them.
    pub objects: &'a [u32],
}

/// Records the compositing with this room; [`Capacities::ordered`] is the most that the sort may leave.
///
/// # Errors
/// As [`record`](super::record).
pub fn record(capacities: Capacities) -> Result<Recorded, Error> {
    record_as(capacities, true)
}

/// The bytes that a recording by [`record`] takes beside footprints and values, of which there are none here; or one by
/// [`record`](super::record), whose order is given.
///
/// # Errors
/// As [`Recorded::uploads`].
pub fn uploads(recorded: &Recorded, input: &Input<'_>, accumulator: &Accumulator) -> Result<Uploads, Error> {
    let kernels: Vec<Kernel> = input.footprints.layers().iter().map(Kernel::new).collect();
    let Input { camera, materials, direction, params, order, objects, .. } = *input;
    super::fits("splats in order", order.len() as u64, recorded.capacities.ordered)?;
    let perspective = (!camera.is_orthographic()).then_some(camera.focal_px() as f32);
    let size = camera.size;
    let kernels = &kernels[..];
    let none = OpaqueImage::default();
    let ordered = order.len() as u32;
    let opaque = input.opaque.unwrap_or(&none);
    let hidden = input.opaque.is_none();
    let image = Image { size, perspective, kernels, materials, opaque, direction, params, ordered, objects, hidden };
    recorded.check_image(&image, accumulator)?;
    let splats = recorded.capacities.splats as usize;
    super::equal_lengths([(
        "objects",
        objects.len(),
        if recorded.capacities.objects { splats } else { objects.len() },
    )])?;
    let given = [bytemuck::cast_slice(order).to_vec(), Vec::new(), Vec::new()];
    Ok(recorded.image_uploads(&image, accumulator, given))
}
