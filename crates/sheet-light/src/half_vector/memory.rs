//! Bytes that half-vector sheets take, before they are taken.

use super::input::HalfInput;
use super::light::camera::camera_of;
use super::params::{HalfParams, Scattering};
use super::sampled_light::{CarriedLight, SampledLight};
use crate::half_vector::light::buffer::planes;
use crate::half_vector::polygons::light_depth::LightDepths;
use crate::half_vector::scatter::medium::MOST_THIN;
use crate::half_vector::slicing::band::ROWS;
use crate::half_vector::slicing::bodies::Bodies;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::serves::{axis_of_view, other_axis};
use crate::half_vector::soft::buffer::SoftBuffer;
use crate::half_vector::soft::penumbra::Penumbra;
use crate::shared::gradient_volume::GradientVolume;
use crate::shared::lattice::Lattice;
use crate::shared::params::{GatherKernel, Reconstruction};
use crate::shared::voxels::Voxels;
use crate::{Error, Params, Volume};
use splat_core::Camera;
use splat_core::shade::MAX_CHANNELS;

/// Bytes of a splat in one sweep: its footprint in the light's image, places, slabs, and lists of squares.
const BYTES_A_SPLAT: u64 = 160;

/// Lights that have a sweep, each with the points that stand for it.
pub(crate) fn carried<'a>(input: &'a HalfInput<'a>) -> impl Iterator<Item = CarriedLight<'a>> {
    let points = input.sheets.lights.iter().map(|lit| CarriedLight { lit, samples: 1 });
    let extended = input.extended.iter();
    points.chain(extended.map(|extended| CarriedLight { lit: &extended.lit, samples: extended.samples }))
}

/// Points of the light that has most.
pub(crate) fn most_samples(input: &HalfInput<'_>) -> u32 {
    carried(input).map(|light| light.samples).max().unwrap_or(1)
}

/// Refuses what takes more than it may, before it does.
pub(crate) fn check_memory(input: &HalfInput<'_>, params: &HalfParams) -> Result<(), Error> {
    let needed = needed(input, params);
    let limit = params.sheets.limits.max_bytes;
    let hint = || {
        "use fewer voxels, a smaller picture, fewer pixels of the light buffer or fewer points of an extended light"
            .to_owned()
    };
    if needed > limit { Err(Error::limit("half-vector sheets", needed, limit, "bytes", hint())) } else { Ok(()) }
}

/// Bytes of everything but lists of translucent polygons, which are counted when they are made.
pub(crate) fn needed(input: &HalfInput<'_>, params: &HalfParams) -> u64 {
    let camera = input.sheets.camera;
    let needed =
        bytes(&input.bodies(), camera, carried(input).map(|light| light.sampled()), input.mapped.len(), params);
    needed + if input.polygons.is_empty() { 0 } else { polygon_bytes(camera, most_samples(input), params) }
}

/// Bytes that [`fold`](crate::half::fold) takes at most for such lights, of which sweeps follow one another; and `mapped` others, whose shadows are known.
pub fn bytes<'l>(
    bodies: &Bodies<'_>,
    camera: &Camera,
    lights: impl Iterator<Item = SampledLight<'l>>,
    mapped: usize,
    params: &HalfParams,
) -> u64 {
    if bodies.is_empty() {
        return 0;
    }
    let volumes = bodies.volumes;
    // Of a pixel: rays, sheets, sums; and sums of splats, as many as there are channels at most.
    let of_splats = bodies.splats.map_or(0, |_| 4 * (3 + MAX_CHANNELS as u64));
    let of_a_pixel = 4 * (5 + 12 * volumes.len() as u64) + of_splats;
    let [width, height] = camera.size.map(u64::from);
    let sheets: usize = if volumes.iter().any(|v| params.sheets.compares_sheets(v)) { 3 } else { 1 };
    let eye = width
        * height
        * (of_a_pixel + 4 * (6 * sheets * volumes.len() + MAX_CHANNELS) as u64 + 160)
        * (ROWS as u64 + 2)
        / ROWS as u64;
    let voxels = |v: &Volume<'_>| {
        let dims = Lattice::new(v.grid, v.packing, [usize::MAX; 3]).dims;
        let of_values = match params.sheets.reconstruction {
            // A record once in the order of the lattice and once for each image, with its bucket.
            Reconstruction::Splat => 3 * 16 + 24,
            // A filtered lattice is made of one that is filtered across alone.
            Reconstruction::Gather(GatherKernel::Gaussian) => 8,
            Reconstruction::Gather(GatherKernel::Linear) => 0,
        };
        // The shadows of what is not carried, of the light of a sweep and of those without one.
        let of_a_voxel = of_values + 8 * (1 + mapped as u64);
        let count = dims.iter().map(|n| *n as u64).product::<u64>();
        Voxels::bytes(dims) + count * of_a_voxel + GradientVolume::bytes(count, v, &params.sheets)
    };
    let cells: u64 = if params.scattering == Scattering::None {
        0
    } else {
        // Media, two streams of one channel, what is kept of all, for media and for polygons.
        let voxels: u64 = volumes.iter().map(|v| v.grid.values.len() as u64).sum();
        2 * (voxels / u64::from(params.voxels_per_cell) + 1).max(MOST_THIN) * 480
    };
    let splats = bodies.splats.map_or(0, |splats| splats.count * BYTES_A_SPLAT);
    let lights: Vec<SampledLight<'_>> = lights.collect();
    // Where two sweeps of a light are mixed the image of the first is kept.
    let eyes = 1 + u64::from(lights.iter().any(|light| other_axis(bodies, camera, *light).is_some()));
    let light = |light: SampledLight<'_>| {
        let image = camera_of(bodies, light.light, params);
        let pixels: u64 = image.size.into_iter().map(u64::from).product();
        of_a_pixel * pixels + soft_bytes(bodies, camera, light, &image, params)
    };
    eyes * eye
        + lights.into_iter().map(light).max().unwrap_or(0)
        + cells
        + splats
        + volumes.iter().map(voxels).sum::<u64>()
}

/// Bytes that [`fold`](crate::half::fold) takes at most for polygons beside [`bytes`]: buffers of the eye and of one light, of at most so many points; 0 for no
/// light. Lists of translucent ones are [`crate::half::pane_bytes`] and [`crate::half::light_list_bytes`].
pub fn polygon_bytes(camera: &Camera, samples: u32, params: &HalfParams) -> u64 {
    let pixels: u64 = camera.size.into_iter().map(u64::from).product();
    // Depths, hits, the picture; lists, places, and sums of what is seen, of two sweeps beside those of all where they are mixed.
    pixels * (28 + 4 * (MAX_CHANNELS as u64 + 2))
        + pixels * (60 + 3 * 4 * MAX_CHANNELS as u64)
        + LightDepths::bytes_of(params.most_light_pixels, samples)
}

/// Bytes of the images of an extended light's points.
fn soft_bytes(
    bodies: &Bodies<'_>,
    camera: &Camera,
    light: SampledLight<'_>,
    image: &Camera,
    params: &HalfParams,
) -> u64 {
    let sheets = Params { slab_width: None, ..params.sheets };
    let frame = Frame::new(bodies, camera, &sheets, &axis_of_view(bodies, camera, Some(light.light)));
    let penumbra = frame.ok().and_then(|frame| Penumbra::new(&frame, bodies, light, image, params.most_light_pixels));
    penumbra.map_or(0, |penumbra| {
        // The materials of splats are not known here.
        let planes = if bodies.splats.is_some() { 3 } else { planes(bodies.volumes, None) as u64 };
        SoftBuffer::bytes_of(&penumbra, planes) + 4 * planes * image.size.into_iter().map(u64::from).product::<u64>()
    })
}
