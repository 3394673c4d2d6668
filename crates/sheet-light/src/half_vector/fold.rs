//! Half-vector sheets of some volumes under any number of lights: a sweep a light, one after the other.

use super::counts::HalfCounts;
use super::input::{HalfInput, HalfSplats, MOST_SAMPLES};
use super::lamps::Lamps;
use super::memory::{carried, check_memory, most_samples, needed, polygon_bytes};
use super::params::{HalfParams, Scattering};
use super::sampled_light::CarriedLight;
use super::scatter;
use super::scatter::Scattered;
use super::sweep::{Sweep, SweepRequest, Swept};
use crate::half_vector::polygons::eye::Eye;
use crate::half_vector::polygons::light::{PolygonImage, PolygonLight};
use crate::half_vector::polygons::light_depth::LightDepths;
use crate::half_vector::polygons::panes::PanesInTheOpen;
use crate::half_vector::polygons::surfaces::EyePanes;
use crate::half_vector::scatter::balance::Balance;
use crate::half_vector::scatter::scene::Scene;
use crate::half_vector::slicing::bodies::Bodies;
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::serves::{axis_of_view, other_axis, serves, serves_extended};
use crate::shared::pixel::PixelForm;
use crate::shared::slabs::Slabs;
use crate::{Error, Params, Reconstruction};
use splat_core::raster::OpaqueImage;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, Light, Packing, Progress};

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
    let eye = Eye::new(input, left, layout, progress)?;
    let mut image = eye.solid.as_ref().map(|solid| PolygonImage::new(solid, layout));
    let opaque = eye.solid.as_ref().map_or(input.opaque, |solid| &solid.opaque);
    let input = &HalfInput { opaque, ..input.clone() };
    let mut lights: Vec<CarriedLight<'_>> = carried(input).collect();
    lights.sort_by_key(|light| (light.lit.light.key(), light.samples));
    let sweeps = Sweeps { input, params, eye: &eye, layout, progress };
    let mut counts = HalfCounts::default();
    if !input.bodies().is_empty() {
        counts = sweeps.run(&lights, into, image.as_mut())?;
    } else if eye.solid.is_some() || eye.panes.is_some() {
        counts.polygon_pixels[0] = eye.solid.as_ref().map_or(0, |solid| solid.seen.count() as u64);
        counts.bytes += sweeps.in_the_open(&lights, into, image.as_mut())?;
    }
    counts.bytes += eye.panes.as_ref().map_or(0, EyePanes::bytes);
    let polygons = eye.solid.as_ref().zip(image).map(|(solid, image)| {
        counts.bytes += image.bytes() + polygon_bytes(input.sheets.camera, most_samples(input), params);
        image.finish(solid, !into.object.is_empty())
    });
    Ok(Drawn { counts, polygons: polygons.unwrap_or_default() })
}

/// What sweeps have in common.
struct Sweeps<'a, 's> {
    input: &'a HalfInput<'a>,
    params: &'s HalfParams,
    eye: &'a Eye<'a>,
    layout: &'s ChannelLayout,
    progress: &'s Progress,
}

impl<'a> Sweeps<'a, '_> {
    /// A sweep for each light, into a picture and into what opaque polygons show.
    fn run(
        &self,
        lights: &[CarriedLight<'a>],
        into: &mut Accumulator,
        mut image: Option<&mut PolygonImage>,
    ) -> Result<HalfCounts, Error> {
        let form = PixelForm::of_image(into);
        let first = self.begin(SweepRequest { light: lights.first().copied(), axis: None, light_alone: false })?;
        let is_lit = first.lighting.light.is_some();
        let Swept { bands, mut counts } = self.finish(first, lights.first().copied(), form, image.as_deref_mut())?;
        bands.iter().for_each(|b| b.pixels.store(&b.band, into));
        for light in lights.iter().skip(1).filter(|_| is_lit) {
            let next = self.begin(SweepRequest { light: Some(*light), axis: None, light_alone: true })?;
            let swept = self.finish(next, Some(*light), form.without_extras(), image.as_deref_mut())?;
            counts = counts.join(swept.counts);
            swept.bands.iter().for_each(|b| b.pixels.add_colors(&b.band, self.layout.colors(), into));
        }
        Ok(counts)
    }

    /// Prepares a sweep.
    fn begin(&self, request: SweepRequest<'a>) -> Result<Sweep<'a>, Error> {
        let sweep = Sweep::new(self.input, self.params, self.eye, request, self.progress)?;
        self.progress.add_total(u64::from(sweep.geometry.frame.slabs.count));
        Ok(sweep)
    }

    /// Runs the sweep of a light. Where its half vector is about to turn over that is mixed with another one across the axis that comes then, so
    /// that no picture shows the turn; depths and objects are those of the first.
    fn finish(
        &self,
        sweep: Sweep<'a>,
        light: Option<CarriedLight<'a>>,
        form: PixelForm,
        image: Option<&mut PolygonImage>,
    ) -> Result<Swept, Error> {
        let bodies = self.input.bodies();
        let lit = light.filter(|_| sweep.lighting.light.is_some());
        let other = lit.and_then(|light| other_axis(&bodies, self.input.sheets.camera, light.sampled()));
        let Some((axis, share)) = other else {
            return sweep.run(self.layout, form, image, self.progress);
        };
        let light_alone = sweep.lighting.light_alone;
        let blank = || self.eye.solid.as_ref().map(|solid| PolygonImage::new(solid, self.layout));
        let mut first_image = blank();
        let mut other_image = blank();
        let mut first = sweep.run(self.layout, form, first_image.as_mut(), self.progress)?;
        let other = self.begin(SweepRequest { light, axis: Some(axis), light_alone })?;
        let other = other.run(self.layout, form.without_extras(), other_image.as_mut(), self.progress)?;
        for (band, other) in first.bands.iter_mut().zip(&other.bands) {
            band.pixels.mix(&other.pixels, share);
        }
        if let (Some(image), Some(first), Some(other)) = (image, &first_image, &other_image) {
            image.add(first, 1.0 - share);
            image.add(other, share);
        }
        Ok(Swept { counts: first.counts.join(other.counts), bands: first.bands })
    }

    /// Light on polygons where there is nothing else (Table 1: the images of the light alone). Bytes.
    fn in_the_open(
        &self,
        lights: &[CarriedLight<'a>],
        into: &mut Accumulator,
        mut image: Option<&mut PolygonImage>,
    ) -> Result<u64, Error> {
        let Self { input, params, eye, layout, progress } = *self;
        let sheets = &input.sheets;
        let camera = sheets.camera;
        let mut panes = eye.panes.as_ref().map(|panes| PanesInTheOpen::new(panes, layout));
        let mut bytes = panes.as_ref().map_or(0, PanesInTheOpen::bytes);
        let lights: Vec<Option<CarriedLight<'a>>> = match lights {
            [] => vec![None],
            lights => lights.iter().copied().map(Some).collect(),
        };
        for (n, light) in lights.into_iter().enumerate() {
            let depths = eye.light_depths(input, params, light, progress)?;
            let lamps = Lamps {
                carried: light.map(|light| *light.lit),
                mapped: if n == 0 { &input.mapped[..] } else { &[] },
                ambient: sheets.ambient,
                camera,
                shadow_origin: sheets.shadow_origin,
                light_alone: n > 0,
            };
            if let (Some(solid), Some(image)) = (&eye.solid, &mut image) {
                PolygonLight::new(&solid.seen, camera, depths.as_ref()).shade(&lamps, None, image);
            }
            if let Some(panes) = &mut panes {
                panes.shade(depths.as_ref(), &lamps);
            }
            bytes = bytes.max(depths.as_ref().map_or(0, LightDepths::bytes));
        }
        if let Some(panes) = panes {
            panes.store(camera, into);
        }
        Ok(bytes)
    }
}

/// Whether there are enough slabs of this width for volumes that lie within this depth and whose kernels have at most this radius; all in one unit of length.
pub fn has_slabs(width: f64, depth: f64, reach: f64) -> bool {
    Slabs::new(0.0, depth, width, reach).is_ok()
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
    let scene = Scene::new(volumes, splats, lit, params, input.sheets.shadow_origin);
    Ok(Scattered::new(&scene, params.scattering, false).balance.scaled(lit.light.intensity))
}

fn check(input: &HalfInput<'_>, params: &HalfParams) -> Result<(), Error> {
    params.check()?;
    input.sheets.check()?;
    let gathers = params.sheets.reconstruction != Reconstruction::Splat;
    if gathers && input.sheets.volumes.iter().any(|v| v.packing != Packing::Cartesian) {
        return Err(Error::parameter("reconstruction", "gathered of a body-centred lattice", "splatted"));
    }
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
    for (light, lit) in carried(input).map(|light| light.lit).chain(&input.mapped).enumerate() {
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
