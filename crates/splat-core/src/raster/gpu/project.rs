//! Projection of splats to footprints as a recording: the GPU's twin of [`project`](crate::raster::project).
//!
//! One thread a splat, products and sums in the order of the CPU, each rounded by itself. Where a device divides and takes
//! square roots as IEEE 754 has it, the footprints have the CPU's bits. Vulkan allows 2.5 units in the last place of a
//! quotient, and wgpu's translator drops `precise`: numbers then move by less than 10⁻⁵ of the largest of their kind, the
//! slope of depth of a disc seen edge-on by 2·10⁻³.
//!
//! The words are those that [`record`](super::record) composites, so that a joined recording keeps them on the device.
//!
//! ```
//! use splat_core::raster::gpu::AttributeRoom;
//! use splat_core::raster::gpu::project::{Capacities, record};
//!
//! let attributes = AttributeRoom { splats: 1_000_000, frame_words: 3 };
//! let recorded = record(Capacities { attributes, footprints: 3, materials: 8, depth: false }).unwrap();
//! recorded.recording.check().unwrap();
//! // 52 bytes of a splat's attributes come in, a footprint takes 32.
//! assert_eq!(recorded.recording.bytes() / 1_000_000, 84);
//! ```

use super::attributes::{AttributeBuffers, AttributeRoom, Attributes};
use super::{SPLAT_WORDS, fits};
use crate::optics::SurfaceOpacity;
use crate::raster::Params;
use crate::raster::kernel::{half_width, share_terms};
use crate::{Camera, Error, Footprint, FootprintStack, Material};
use splat_shaders::layouts::{ProjectState, ProjectView};
use splat_shaders::{BufferId, Groups, Recording, kernels};

/// Splats that a workgroup projects.
const BLOCK: u32 = 256;

/// Vectors of a footprint in the tables.
const FOOTPRINT_VECTORS: u64 = 3;

/// What a recording makes room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Splats and their attributes.
    pub attributes: AttributeRoom,
    /// Footprints.
    pub footprints: u32,
    /// Materials.
    pub materials: u32,
    /// Whether depths are made: for what an opaque image may hide.
    pub depth: bool,
}

/// Into what splats are projected, and how: the arguments of [`project`](crate::raster::project) beside the cloud.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// World position that the attributes are relative to.
    pub origin: glam::DVec3,
    /// The view.
    pub camera: &'a Camera,
    /// Footprints.
    pub footprints: &'a FootprintStack,
    /// Materials.
    pub materials: &'a [Material],
    /// The resampling filter.
    pub params: &'a Params,
}

/// The recorded projection and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What the device is to do.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Input: one [`ProjectView`].
    pub view: BufferId,
    /// Input.
    pub attributes: AttributeBuffers,
    /// Input: footprints, then materials.
    pub tables: BufferId,
    /// Read back: the words of each splat, as [`words`](super::words) has them; the peak of one that no pixel shows is 0.
    pub splats: BufferId,
    /// Read back: one [`ProjectState`].
    pub state: BufferId,
}

/// The bytes of a view and its tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    view: Vec<u8>,
    tables: Vec<u8>,
}

/// Records a projection with this room.
///
/// # Errors
/// [`Error::Invalid`] for words of a frame that no cloud has.
pub fn record(capacities: Capacities) -> Result<Recorded, Error> {
    let Capacities { attributes: room, footprints, materials, depth } = capacities;
    if !matches!(room.frame_words, 0 | 3 | 6 | 9) {
        return Err(Error::invalid("recording", 0, "words of a frame", room.frame_words, "0, 3, 6 or 9"));
    }
    let mut recording = Recording::default();
    let r = &mut recording;
    let view = r.input("project view", size_of::<ProjectView>() as u64);
    let attributes = AttributeBuffers::record(r, room);
    let tables = r.input("project tables", 16 * (FOOTPRINT_VECTORS * u64::from(footprints) + u64::from(materials)));
    let words = u64::from(SPLAT_WORDS[usize::from(depth)]);
    let splats = r.scratch("splats", 4 * words * u64::from(room.splats));
    let state = r.scratch("projected", size_of::<ProjectState>() as u64);
    r.dispatch(&kernels::SPLAT_NOTHING, Groups::cover(1), &[state], &[]);
    let [positions, radii, looks, frames] = attributes.buffers();
    let bound = [view, positions, radii, looks, frames, tables, splats, state];
    r.dispatch(&kernels::SPLAT_PROJECT, Groups::cover(room.splats.div_ceil(BLOCK)), &bound, &[]);
    r.read(splats);
    r.read(state);
    Ok(Recorded { recording, capacities, view, attributes, tables, splats, state })
}

impl Recorded {
    /// The bytes that the recording takes beside the attributes.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for, [`Error::Invalid`] for ids that the tables do not have and footprints that are
    /// images, [`Error::ColumnLength`] for attributes of another room.
    pub fn uploads(&self, input: &Input<'_>, attributes: &Attributes) -> Result<Uploads, Error> {
        if input.footprints.has_images() {
            return Err(Error::invalid(
                "footprint stack",
                0,
                "layer",
                "an image",
                "formulas: images are the processor's",
            ));
        }
        let room = self.capacities;
        let footprints = input.footprints.layers();
        attributes.check(room.attributes, input.materials.len(), footprints.len())?;
        fits("footprints", footprints.len() as u64, room.footprints)?;
        fits("materials", input.materials.len() as u64, room.materials)?;
        let camera = input.camera;
        let turn = camera.view_from_offset(input.origin);
        let size = camera.size.map(|s| s as f32);
        let view = ProjectView {
            axis_x: turn.rotation.x_axis.extend(0.0).to_array(),
            axis_y: turn.rotation.y_axis.extend(0.0).to_array(),
            axis_z: turn.rotation.z_axis.extend(0.0).to_array(),
            translation: turn.translation.extend(0.0).to_array(),
            middle: size.map(|s| 0.5 * s),
            size,
            focal: camera.focal_px() as f32,
            filter_sigma: input.params.resampling_sigma_px,
            orthographic: u32::from(camera.is_orthographic()),
            splats: attributes.room().splats,
            splat_words: SPLAT_WORDS[usize::from(room.depth)],
            frame_words: room.attributes.frame_words,
            footprints: footprints.len() as u32,
            unused: 0,
        };
        let rows = |f: &Footprint| {
            let [a, b, c, d, e, g] = share_terms(f);
            [[f.norm() as f32, f.cutoff, half_width(f), 0.0], [a, b, c, d], [e, g, 0.0, 0.0]]
        };
        let footprints = footprints.iter().flat_map(rows);
        let slab = |m: &Material| f32::from(u8::from(m.surface_opacity == SurfaceOpacity::ThinSlab));
        let tables: Vec<[f32; 4]> =
            footprints.chain(input.materials.iter().map(|m| [slab(m), 0.0, 0.0, 0.0])).collect();
        Ok(Uploads { view: bytemuck::bytes_of(&view).to_vec(), tables: bytemuck::cast_slice(&tables).to_vec() })
    }

    /// The uploads with the buffers that they go to; the attributes' are [`Attributes::inputs`].
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> [(BufferId, &'a [u8]); 2] {
        [(self.view, &uploads.view), (self.tables, &uploads.tables)]
    }
}

/// Splats that reach a pixel, from what was read back of [`Recorded::state`].
///
/// # Errors
/// [`Error::ColumnLength`] for bytes that no run gave.
pub fn visible(state: &[u8]) -> Result<u64, Error> {
    Ok(read(state)?.visible.into())
}

/// Discs through the eye plane among them, which only the processor draws: what is composited of this projection is wrong
/// unless there are none.
///
/// # Errors
/// As [`visible`].
pub fn through_the_eye(state: &[u8]) -> Result<u64, Error> {
    Ok(read(state)?.near.into())
}

fn read(state: &[u8]) -> Result<ProjectState, Error> {
    let attribute = "state read back";
    let found = state.len();
    let expected = size_of::<ProjectState>();
    let bytes = state.get(..expected).ok_or(Error::ColumnLength { attribute, found, expected })?;
    Ok(bytemuck::pod_read_unaligned(bytes))
}
