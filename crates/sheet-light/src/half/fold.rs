//! Half-vector sheets of some volumes under any number of lights: a sweep a light, one after the other.

use super::axis::HalfVector;
use super::band::ROWS;
use super::bodies::Bodies;
use super::counts::HalfCounts;
use super::eye_sheets::EyeBand;
use super::frame::Frame;
use super::light_buffer::planes;
use super::light_depth::{LightDepths, side};
use super::pane_sheets::PanesInTheOpen;
use super::penumbra::Penumbra;
use super::polygon_light::{PolygonImage, PolygonLight};
use super::polygons::{Eye, EyePanes, EyePolygons, Polygons};
use super::scatter::{self, Scattered, Scene, balance::Balance, medium::MOST_THIN};
use super::serves::{axis_of_view, other_axis, serves, serves_extended};
use super::soft_buffer::SoftBuffer;
use super::splats::Lamps;
use super::sweep::Sweep;
use super::{HalfInput, HalfParams, HalfSplats, MOST_SAMPLES, Scattering, lamp};
use crate::gradient_volume::GradientVolume;
use crate::lattice::Lattice;
use crate::visible::Voxels;
use crate::{Error, Params, Volume};
use splat_core::glam::DVec3;
use splat_core::raster::OpaqueImage;
use splat_core::shade::{ChannelLayout, LitBy, MAX_CHANNELS};
use splat_core::{Accumulator, Camera, Light, Progress};

/// What [`fold`] did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// Work.
    pub counts: HalfCounts,
    /// What is seen of [`HalfInput::polygons`], behind all that was composited; without any pixel where there are none.
    pub polygons: OpaqueImage,
}

/// Draws all volumes in slabs across the half vector of each light, with the shadows that they cast on themselves and each other.
/// `into` becomes a segment of its own, of all depths: what it held is gone, its planes and channels say what is kept, and the
/// caller appends it behind what lies before. Opaque polygons end the rays that meet them, and are a picture of their own; translucent ones are
/// composited where they lie. One tick a slab, and one for each band of rows of polygons.
///
/// Each light is a sweep, or two that are mixed where its half vector is about to turn over; their images add, and optical depth, depths,
/// objects, normals and the share of shadow come from one light. Sweeps are in an order of the lights' own, so the order of the input changes
/// no bit. Without lights, or where no material asks for any, there is one sweep along the view.
///
/// # Errors
/// [`Error::Parameter`], [`Error::Volume`], [`Error::Polygons`], [`Error::Light`], [`Error::HalfVector`] for a light that half vectors cannot serve,
/// [`Error::Limit`] before much is taken, or [`Error::Cancelled`]: then `into` is of no use as a picture.
///
/// # Panics
/// If the sizes of the camera's image, `into` and the opaque depths disagree, or `into` has other channels than `layout`.
pub fn fold(
    input: &HalfInput<'_>,
    params: &HalfParams,
    layout: &ChannelLayout,
    into: &mut Accumulator,
    progress: Option<&Progress>,
) -> Result<Drawn, Error> {
    check(input, params)?;
    let size = input.sheets.camera.size;
    if params.scattering != Scattering::None && layout.multiple().is_none() {
        let expected = "None, or a layout that has room for it: `ChannelLayout::with_multiple`";
        return Err(Error::parameter("scattering", params.scattering, expected));
    }
    assert_eq!(size, into.size, "invariant: one image size");
    assert_eq!(layout.count(), into.channels.len(), "invariant: one set of channels");
    let pixels = size[0] as usize * size[1] as usize;
    assert!(input.opaque.is_empty() || input.opaque.len() == pixels, "invariant: an opaque depth for each pixel");
    let has = |kept: usize| kept > 0;
    let planes = into.optical_depth.len();
    let depth = has(into.depth.len());
    let object = has(into.object.len());
    *into = Accumulator::new(size, planes, layout.count(), depth, object);
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let left = params.sheets.limits.max_bytes.saturating_sub(needed(input, params));
    let eye = Eye::new(input, (left, layout), progress)?;
    let mut image = eye.solid.as_ref().map(|solid| PolygonImage::new(solid, layout));
    let opaque = eye.solid.as_ref().map_or(input.opaque, |solid| &solid.opaque);
    let input = &HalfInput { opaque, ..input.clone() };
    let mut lights: Vec<(&LitBy<'_>, u32)> = carried(input).collect();
    lights.sort_by_key(|(lit, samples)| (lit.light.bits(), *samples));
    let mut counts = HalfCounts::default();
    if !input.bodies().is_empty() {
        counts = sweeps(input, params, (&lights, &eye), (layout, into, image.as_mut()), progress)?;
    } else if eye.solid.is_some() || eye.panes.is_some() {
        counts.polygon_pixels[0] = eye.solid.as_ref().map_or(0, |solid| solid.seen.count() as u64);
        counts.bytes += in_the_open(input, params, (&lights, &eye), (layout, into, image.as_mut()), progress)?;
    }
    counts.bytes += eye.panes.as_ref().map_or(0, EyePanes::bytes);
    let polygons = eye.solid.as_ref().zip(image).map(|(solid, image)| {
        counts.bytes += image.bytes() + polygon_bytes(input.sheets.camera, most_samples(input), params);
        image.finish(solid, !into.object.is_empty())
    });
    Ok(Drawn { counts, polygons: polygons.unwrap_or_default() })
}

/// What a sweep adds to: what is kept of a pixel, the picture, and what polygons show.
type Into<'i> = (&'i ChannelLayout, &'i mut Accumulator, Option<&'i mut PolygonImage>);

/// What sweeps have in common.
struct Sweeps<'a, 's> {
    input: &'a HalfInput<'a>,
    params: &'s HalfParams,
    eye: &'a Eye<'a>,
    layout: &'s ChannelLayout,
    progress: &'s Progress,
}

/// A sweep for each light.
fn sweeps<'a>(
    input: &'a HalfInput<'a>,
    params: &HalfParams,
    (lights, eye): (&[(&'a LitBy<'a>, u32)], &'a Eye<'a>),
    (layout, into, mut image): Into<'_>,
    progress: &Progress,
) -> Result<HalfCounts, Error> {
    let of = Sweeps { input, params, eye, layout, progress };
    let first = of.begin(lights.first().copied(), None, false)?;
    let is_lit = first.light.is_some();
    let (bands, mut counts) = of.finish(first, lights.first().copied(), into, image.as_deref_mut())?;
    bands.iter().for_each(|b| b.pixels.store(&b.band, into));
    for light in lights.iter().skip(1).filter(|_| is_lit) {
        let next = of.begin(Some(*light), None, true)?;
        let form = Accumulator { depth: Vec::new(), object: Vec::new(), ..into.clone() };
        let (bands, more) = of.finish(next, Some(*light), &form, image.as_deref_mut())?;
        counts = counts.join(more);
        bands.iter().for_each(|b| b.pixels.add_colors(&b.band, layout.colors(), into));
    }
    Ok(counts)
}

impl<'a> Sweeps<'a, '_> {
    /// Prepares the sweep of a light, across its half vector or another axis.
    fn begin(
        &self,
        light: Option<(&'a LitBy<'a>, u32)>,
        axis: Option<HalfVector>,
        light_alone: bool,
    ) -> Result<Sweep<'a>, Error> {
        let sweep = Sweep::new(self.input, self.params, (light, self.eye), (axis, light_alone), self.progress)?;
        self.progress.add_total(u64::from(sweep.frame.slabs.count));
        Ok(sweep)
    }

    /// Runs the sweep of a light. Where its half vector is about to turn over that is mixed with another one across the axis that comes then, so
    /// that no picture shows the turn; depths and objects are those of the first.
    fn finish(
        &self,
        sweep: Sweep<'a>,
        light: Option<(&'a LitBy<'a>, u32)>,
        form: &Accumulator,
        image: Option<&mut PolygonImage>,
    ) -> Result<(Vec<EyeBand>, HalfCounts), Error> {
        let bodies = self.input.bodies();
        let lit = light.filter(|_| sweep.light.is_some());
        let other = lit.and_then(|(lit, samples)| other_axis(&bodies, self.input.sheets.camera, (&lit.light, samples)));
        let Some((axis, share)) = other else { return sweep.run(self.layout, form, image, self.progress) };
        let light_alone = sweep.light_alone;
        let blank = || self.eye.solid.as_ref().map(|solid| PolygonImage::new(solid, self.layout));
        let mut own_image = blank();
        let mut other_image = blank();
        let (mut bands, counts) = sweep.run(self.layout, form, own_image.as_mut(), self.progress)?;
        let form = Accumulator { depth: Vec::new(), object: Vec::new(), ..form.clone() };
        let other = self.begin(light, Some(axis), light_alone)?;
        let (mixed, more) = other.run(self.layout, &form, other_image.as_mut(), self.progress)?;
        bands.iter_mut().zip(&mixed).for_each(|(band, other)| band.pixels.mix(&other.pixels, share));
        if let (Some(image), Some(own), Some(other)) = (image, &own_image, &other_image) {
            image.add(own, 1.0 - share);
            image.add(other, share);
        }
        Ok((bands, counts.join(more)))
    }
}

/// Light on polygons where there is nothing else (Table 1: the images of the light alone). Bytes.
fn in_the_open<'a>(
    input: &'a HalfInput<'a>,
    params: &HalfParams,
    (lights, eye): (&[(&'a LitBy<'a>, u32)], &'a Eye<'a>),
    (layout, into, mut image): Into<'_>,
    progress: &Progress,
) -> Result<u64, Error> {
    let (sheets, camera) = (&input.sheets, input.sheets.camera);
    let mut panes = eye.panes.as_ref().map(|panes| PanesInTheOpen::new(panes, layout));
    let mut bytes = panes.as_ref().map_or(0, PanesInTheOpen::bytes);
    let lights: Vec<Option<(&LitBy<'a>, u32)>> = match lights {
        [] => vec![None],
        lights => lights.iter().copied().map(Some).collect(),
    };
    for (n, light) in lights.into_iter().enumerate() {
        let depths = light_depths(input, params, (light, eye), progress)?;
        let carried = light.map(|(lit, _)| *lit);
        let mapped = if n == 0 { &input.mapped[..] } else { &[] };
        let lamps = Lamps { carried, mapped, ambient: sheets.ambient, camera, light_alone: n > 0 };
        if let (Some(solid), Some(image)) = (&eye.solid, &mut image) {
            let light = PolygonLight::new(&solid.seen, camera, depths.as_ref());
            light.shade(&lamps, sheets.shadow_origin, None, image);
        }
        if let Some(panes) = &mut panes {
            panes.shade(camera, depths.as_ref(), &lamps, sheets.shadow_origin);
        }
        bytes = bytes.max(depths.as_ref().map_or(0, LightDepths::bytes));
    }
    if let Some(panes) = panes {
        panes.store(camera, into);
    }
    Ok(bytes)
}

/// A light on opaque polygons.
#[derive(Clone, Copy)]
pub struct PolygonLamp<'a> {
    /// The light. Its shadow is that of everything but the opaque polygons that cast one; of these too where `points` is `None`.
    pub lit: LitBy<'a>,
    /// How many points stand for the same light: their z-buffers of the opaque polygons share [`HalfParams::most_light_pixels`]. `None` for a light
    /// that needs no z-buffer.
    pub points: Option<u32>,
}

/// Opaque polygons as the eye sees them.
pub struct PolygonView<'a> {
    /// The eye.
    pub camera: &'a Camera,
    /// The polygons, of which those that are translucent play no part.
    pub polygons: &'a [Polygons<'a>],
    /// The lights.
    pub lamps: &'a [PolygonLamp<'a>],
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// What positions of receivers of shadows are relative to, world.
    pub shadow_origin: DVec3,
    /// Whether the picture keeps objects.
    pub keeps_objects: bool,
}

/// Draws opaque polygons into a picture of their own. Every pixel asks the z-buffer of each light for the shadows of the polygons themselves: splats
/// that stand for them in a shadow map lie beside their edges. One tick a band of rows.
///
/// # Errors
/// [`Error::Polygons`], [`Error::Light`] or [`Error::Cancelled`].
pub fn opaque_polygons(
    view: &PolygonView<'_>,
    layout: &ChannelLayout,
    progress: Option<&Progress>,
) -> Result<OpaqueImage, Error> {
    let PolygonView { camera, polygons, lamps, ambient, shadow_origin, keeps_objects } = *view;
    polygons.iter().enumerate().try_for_each(|(index, polygons)| polygons.check(index))?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let solid: Vec<Polygons<'_>> = polygons.iter().filter(|p| p.is_opaque()).copied().collect();
    let casters: Vec<&Polygons<'_>> = polygons.iter().filter(|p| p.is_opaque() && p.casts_shadow).collect();
    let solid = EyePolygons::new(solid, (camera, &[]), progress)?;
    let mut image = PolygonImage::new(&solid, layout);
    let mapped: Vec<LitBy<'_>> = lamps.iter().filter(|lamp| lamp.points.is_none()).map(|lamp| lamp.lit).collect();
    let first = Lamps { carried: None, mapped: &mapped, ambient, camera, light_alone: false };
    PolygonLight::new(&solid.seen, camera, None).shade(&first, shadow_origin, None, &mut image);
    let places = solid.seen.places(camera);
    for PolygonLamp { lit, points } in lamps {
        let Some(points) = points else { continue };
        let most_pixels = side(HalfParams::default().most_light_pixels, *points);
        let depths = LightDepths::new(&casters, (&lit.light, 1), &places, (most_pixels, 0), progress)?;
        let lamps = Lamps { carried: Some(*lit), mapped: &[], ambient, camera, light_alone: true };
        PolygonLight::new(&solid.seen, camera, depths.as_ref()).shade(&lamps, shadow_origin, None, &mut image);
    }
    Ok(image.finish(&solid, keeps_objects))
}

/// What so many points of a light see of the polygons that cast shadows, for all that receives its light; `None` where there is no light
/// or no such polygon.
pub(crate) fn light_depths(
    input: &HalfInput<'_>,
    params: &HalfParams,
    (lit, eye): (Option<(&LitBy<'_>, u32)>, &Eye<'_>),
    progress: &Progress,
) -> Result<Option<LightDepths>, Error> {
    let (Some((lit, samples)), casters) = (lit, eye.casters()) else { return Ok(None) };
    if casters.is_empty() {
        return Ok(None);
    }
    let mut receivers = eye.places(input.sheets.camera);
    receivers.extend(input.bodies().corners());
    let taken = needed(input, params) + eye.panes.as_ref().map_or(0, EyePanes::bytes);
    let most = (params.most_light_pixels, params.sheets.limits.max_bytes.saturating_sub(taken));
    LightDepths::new(&casters, (&lit.light, samples), &receivers, most, progress)
}

/// Width of the slabs of the sweep for `light`, or of that without one; world units. Infinite without bodies.
///
/// # Errors
/// [`Error::Parameter`] or [`Error::Limit`] where there would be too many.
pub fn slab_width(bodies: &Bodies<'_>, camera: &Camera, light: Option<&Light>, params: &Params) -> Result<f64, Error> {
    params.check()?;
    if bodies.is_empty() {
        return Ok(f64::INFINITY);
    }
    Ok(Frame::new(bodies, camera, params, &axis_of_view(bodies, camera, light))?.slabs.width)
}

/// Where the light of one lamp of [`HalfInput::sheets`] stays, as its scattering among the volumes is simulated: in cells, by two streams, however
/// the slabs lie. All 0 for a lamp that nothing scatters, or under [`Scattering::None`].
///
/// # Errors
/// Those of [`fold`].
///
/// # Panics
/// If there is no such lamp.
pub fn balance(input: &HalfInput<'_>, params: &HalfParams, light: usize) -> Result<Balance, Error> {
    check(input, params)?;
    let volumes = &input.sheets.volumes[..];
    let lit = &input.sheets.lights[light];
    if !scatter::is_wanted(volumes, &lit.light, params) {
        return Ok(Balance::default());
    }
    let splats = input.splats.as_ref().filter(|splats| !splats.cloud.is_empty());
    let scene = Scene::new((volumes, splats), lit, params, input.sheets.shadow_origin);
    Ok(Scattered::new(&scene, params.scattering, false).balance.scaled(lit.light.intensity))
}

/// Lights that have a sweep, each with the points that stand for it.
fn carried<'a>(input: &'a HalfInput<'a>) -> impl Iterator<Item = (&'a LitBy<'a>, u32)> {
    let points = input.sheets.lights.iter().map(|lit| (lit, 1));
    points.chain(input.extended.iter().map(|extended| (&extended.lit, extended.samples)))
}

/// Points of the light that has most.
fn most_samples(input: &HalfInput<'_>) -> u32 {
    carried(input).map(|(_, samples)| samples).max().unwrap_or(1)
}

fn check(input: &HalfInput<'_>, params: &HalfParams) -> Result<(), Error> {
    params.check()?;
    input.sheets.check()?;
    if let Some(splats) = &input.sheets.splats {
        let found = format!("{} splats", splats.order.len());
        return Err(Error::parameter(
            "sheets.splats",
            found,
            "none: `HalfInput::splats` has those of half-vector sheets",
        ));
    }
    if let Some(splats) = &input.splats {
        check_splats(input, splats)?;
    }
    for (light, lit) in carried(input).map(|(lit, _)| lit).chain(&input.mapped).enumerate() {
        lit.light.validate(light).map_err(Error::Light)?;
    }
    if let Some(samples) = input.extended.iter().map(|e| e.samples).find(|n| !(1..=MOST_SAMPLES).contains(n)) {
        return Err(Error::parameter("extended.samples", samples, "1 to 1024"));
    }
    let bodies = &input.bodies();
    let camera = input.sheets.camera;
    let points = input.sheets.lights.iter().map(|lit| serves(bodies, camera, &lit.light));
    let extended = input.extended.iter().map(|e| serves_extended(bodies, camera, &e.lit.light, e.samples));
    for (light, served) in points.chain(extended).enumerate() {
        served.map_err(|reason| Error::HalfVector { light, reason })?;
    }
    input.polygons.iter().enumerate().try_for_each(|(index, polygons)| polygons.check(index))?;
    check_memory(input, params)
}

/// Bytes of a splat in one sweep: its footprint in the light's image, places, slabs, and lists of squares.
const BYTES_A_SPLAT: u64 = 160;

/// Refuses splats that sweeps cannot take.
fn check_splats(input: &HalfInput<'_>, splats: &HalfSplats<'_>) -> Result<(), Error> {
    if let Some(opaque) = splats.opaque() {
        return Err(Error::parameter("splats", format!("splat {opaque} is opaque"), "surfaces and media"));
    }
    if !(splats.slab_width.is_finite() && splats.slab_width > 0.0) {
        return Err(Error::parameter("splats.slab_width", splats.slab_width, "a finite number > 0, world units"));
    }
    if splats.cloud.origin != input.sheets.shadow_origin {
        return Err(Error::parameter("sheets.shadow_origin", input.sheets.shadow_origin, "the origin of the splats"));
    }
    Ok(())
}

/// Refuses what takes more than it may, before it does.
fn check_memory(input: &HalfInput<'_>, params: &HalfParams) -> Result<(), Error> {
    let needed = needed(input, params);
    let limit = params.sheets.limits.max_bytes;
    let hint = || {
        "use fewer voxels, a smaller picture, fewer pixels of the light buffer or fewer points of an extended light"
            .to_owned()
    };
    if needed > limit { Err(Error::limit("half-vector sheets", needed, limit, "bytes", hint())) } else { Ok(()) }
}

/// Bytes of everything but lists of translucent polygons, which are counted when they are made.
fn needed(input: &HalfInput<'_>, params: &HalfParams) -> u64 {
    let camera = input.sheets.camera;
    let needed = bytes(
        &input.bodies(),
        camera,
        carried(input).map(|(lit, samples)| (&lit.light, samples)),
        input.mapped.len(),
        params,
    );
    needed + if input.polygons.is_empty() { 0 } else { polygon_bytes(camera, most_samples(input), params) }
}

/// Bytes that [`fold`] takes at most for such lights, of which sweeps follow one another: each with the points that stand for it, 1 for
/// one without an extent; and `mapped` others, whose shadows are known.
pub fn bytes<'l>(
    bodies: &Bodies<'_>,
    camera: &Camera,
    lights: impl Iterator<Item = (&'l Light, u32)>,
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
        // A record once in the order of the lattice and once for each image, with its bucket.
        // The shadows of what is not carried, of the light of a sweep and of those without one.
        let of_a_voxel = 3 * 16 + 24 + 8 * (1 + mapped as u64);
        let count = dims.iter().map(|n| *n as u64).product::<u64>();
        Voxels::bytes(dims) + count * of_a_voxel + GradientVolume::bytes(count, v, &params.sheets)
    };
    let cells: u64 = if params.scattering == Scattering::None {
        0
    } else {
        // Media, two streams of one channel, what is kept of all, for media and for polygons.
        let all: u64 = volumes.iter().map(|v| v.grid.values.len() as u64).sum();
        2 * (all / u64::from(params.voxels_per_cell) + 1).max(MOST_THIN) * 480
    };
    let splats = bodies.splats.map_or(0, |splats| splats.count * BYTES_A_SPLAT);
    let lights: Vec<(&Light, u32)> = lights.collect();
    // Where two sweeps of a light are mixed the image of the first is kept.
    let eyes = 1 + u64::from(lights.iter().any(|light| other_axis(bodies, camera, *light).is_some()));
    let light = |(light, samples): (&Light, u32)| {
        let image = lamp::camera_of(bodies, light, params);
        let pixels: u64 = image.size.into_iter().map(u64::from).product();
        of_a_pixel * pixels + soft_bytes((bodies, camera), (light, samples), &image, params)
    };
    eyes * eye
        + lights.into_iter().map(light).max().unwrap_or(0)
        + cells
        + splats
        + volumes.iter().map(voxels).sum::<u64>()
}

/// Bytes that [`fold`] takes at most for polygons beside [`bytes`]: buffers of the eye and of one light, of at most so many points; 0 for no
/// light. Lists of translucent ones are [`super::pane_bytes`] and [`super::light_list_bytes`].
pub fn polygon_bytes(camera: &Camera, samples: u32, params: &HalfParams) -> u64 {
    let pixels: u64 = camera.size.into_iter().map(u64::from).product();
    // Depths, hits, the picture; lists, places, and sums of what is seen, of two sweeps beside those of all where they are mixed.
    pixels * (28 + 4 * (MAX_CHANNELS as u64 + 2))
        + pixels * (60 + 3 * 4 * MAX_CHANNELS as u64)
        + LightDepths::bytes_of(params.most_light_pixels, samples)
}

/// Bytes of the images of an extended light's points.
fn soft_bytes(
    (bodies, camera): (&Bodies<'_>, &Camera),
    light: (&Light, u32),
    image: &Camera,
    params: &HalfParams,
) -> u64 {
    let sheets = Params { slab_width: None, ..params.sheets };
    let frame = Frame::new(bodies, camera, &sheets, &axis_of_view(bodies, camera, Some(light.0)));
    let penumbra = frame.ok().and_then(|frame| Penumbra::new(&frame, bodies, light, image, params.most_light_pixels));
    penumbra.map_or(0, |penumbra| {
        // The materials of splats are not known here.
        let planes = if bodies.splats.is_some() { 3 } else { planes(bodies.volumes, None) as u64 };
        SoftBuffer::bytes_of(&penumbra, planes) + 4 * planes * image.size.into_iter().map(u64::from).product::<u64>()
    })
}
