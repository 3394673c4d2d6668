//! Attribute-driven shading: one radiance per splat from its attributes and the lookup tables (Gunjee 2007, section 4.3,
//! Figure 11), before rasterization. [`Point::radiance`] has the formulas, for splats and particles alike.

mod census;
mod channels;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod joint;
mod point;
mod scattering;

pub use census::Census;
pub use channels::{ChannelLayout, MAX_CHANNELS, MAX_SHADED_CHANNELS};
pub use joint::Within;
pub use point::{Point, Radiance, arriving, facing};

use crate::optics::TRACE;
use crate::raster::Projected;
use crate::{
    Camera, Cloud, DAabb, Error, Incidence, Light, Material, Object, Progress, Receiver, Slide, Transmittance,
};
use glam::{DVec3, Vec3};
use joint::ThickSplat;
use point::{is_attenuated, passing};
use rayon::prelude::*;
use scattering::{Batch, Scattering};

/// Splats shaded by one task.
const CHUNK: usize = 4096;

/// A light with what it shines through and its shadow map, if it has them.
#[derive(Clone, Copy)]
pub struct LitBy<'a> {
    /// The light.
    pub light: Light,
    /// The picture that it shines through.
    pub slide: Option<&'a Slide>,
    /// Its transmittance to any point, relative to the origin of the cloud that casts; `None` when nothing casts or receives its
    /// shadow.
    pub shadow: Option<&'a dyn Transmittance>,
}

impl LitBy<'_> {
    /// Direction to the light, and the unshadowed irradiance per channel, as [`Light::irradiance`] has them, behind the slide: the one
    /// place where light arrives, whoever asks. A trace of it ([`crate::optics::TRACE`]) is none.
    #[inline]
    pub fn irradiance(&self, p: DVec3, spread: f64) -> Incidence<DVec3> {
        let Incidence { to_light, irradiance } = self.light.irradiance(p, spread);
        let passing = self.slide.map_or([1.0; 3], |slide| slide.passing(p, spread));
        let arriving = |c: usize| irradiance[c] * passing[c];
        let irradiance = std::array::from_fn(|c| if arriving(c) > TRACE { arriving(c) } else { 0.0 });
        Incidence { to_light, irradiance }
    }

    /// The most of it that a point in a box of the world could receive without shadows, in the channel that has most, W/m²; `spread` as for
    /// [`LitBy::irradiance`]. Infinite where the light may lie at such a point and `spread` is 0.
    pub fn brightest_in(&self, bounds: &DAabb, spread: f64) -> f64 {
        let passing = self.slide.map_or(1.0, |slide| f64::from(slide.brightest()));
        passing * self.light.brightest_in(bounds, DVec3::ZERO, spread)
    }
}

/// What shading reads beside the splats.
pub struct ShadeInput<'a> {
    /// The splats.
    pub cloud: &'a Cloud,
    /// Materials by id.
    pub materials: &'a [Material],
    /// Objects by id.
    pub objects: &'a [Object],
    /// Lights with their shadows, which lie relative to the cloud's origin.
    pub lights: &'a [LitBy<'a>],
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// The viewer, for specular reflection and the phase function.
    pub camera: &'a Camera,
}

/// What is shaded, and how.
#[derive(Clone, Copy)]
struct Shaded<'a> {
    input: &'a ShadeInput<'a>,
    /// What tells the light within thick splats; `None` to light all by their middles.
    within: Option<Within<'a>>,
}

/// Values of all splats that `projected` shows, `layout.count()` numbers each, by id; 0 for the others. One tick for each 2¹⁴ splats or so.
///
/// # Errors
/// [`Error::Cancelled`].
///
/// # Panics
/// If a material or object of the cloud is out of range, or `projected` is of another cloud.
pub fn shade(
    input: &ShadeInput<'_>,
    projected: &Projected,
    layout: &ChannelLayout,
    progress: Option<&Progress>,
) -> Result<Vec<f32>, Error> {
    assert_eq!(projected.splats.len(), input.cloud.len(), "invariant: one footprint a splat");
    let mut values = Vec::new();
    shade_into(&mut values, input, |i| projected.is_visible(i), layout, progress)?;
    Ok(values)
}

/// [`shade`] of those splats that `is_one` says, wherever they are seen; `values` may hold those of another frame, whose memory is
/// used again.
///
/// # Errors
/// [`Error::Cancelled`].
///
/// # Panics
/// If a material or object of the cloud is out of range.
pub fn shade_into(
    values: &mut Vec<f32>,
    input: &ShadeInput<'_>,
    is_one: impl Fn(usize) -> bool + Sync,
    layout: &ChannelLayout,
    progress: Option<&Progress>,
) -> Result<(), Error> {
    shade_all(values, Shaded { input, within: None }, is_one, layout, progress)
}

/// [`shade_into`], where media whose spacing is optically thick are lit within, by [`joint`].
///
/// # Errors
/// [`Error::Cancelled`].
///
/// # Panics
/// If a material, an object or a footprint of the cloud is out of range.
pub fn shade_within(
    values: &mut Vec<f32>,
    within: &Within<'_>,
    is_one: impl Fn(usize) -> bool + Sync,
    layout: &ChannelLayout,
    progress: Option<&Progress>,
) -> Result<(), Error> {
    shade_all(values, Shaded { input: within.input, within: Some(*within) }, is_one, layout, progress)
}

fn shade_all(
    values: &mut Vec<f32>,
    shaded: Shaded<'_>,
    is_one: impl Fn(usize) -> bool + Sync,
    layout: &ChannelLayout,
    progress: Option<&Progress>,
) -> Result<(), Error> {
    let input = shaded.input;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let channels = layout.count();
    values.resize(input.cloud.len() * channels, 0.0);
    progress.add_total(input.cloud.len().div_ceil(CHUNK) as u64);
    let scattering = Scattering::new(shaded);
    values.par_chunks_mut(CHUNK * channels).enumerate().for_each(|(chunk, values)| {
        if progress.tick(1).is_ok() {
            let scattering = scattering.as_ref();
            let chunk = ShadeChunk { shaded, scattering, first: chunk * CHUNK, is_one: &is_one, layout, values };
            pulp::Arch::new().dispatch(chunk);
        }
    });
    progress.tick(0)
}

/// One chunk's work, in the form that [`pulp`] compiles once per instruction set.
struct ShadeChunk<'a, F> {
    shaded: Shaded<'a>,
    scattering: Option<&'a Scattering<'a>>,
    first: usize,
    is_one: &'a F,
    layout: &'a ChannelLayout,
    values: &'a mut [f32],
}

impl<F: Fn(usize) -> bool> pulp::WithSimd for ShadeChunk<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { shaded, scattering, first, is_one, layout, values } = self;
        let channels = layout.count();
        let mut batch = Batch::default();
        let end = first + values.len() / channels;
        let mut i = first;
        while i < end {
            let together = scattering.map_or(0, |by| by.together(i, end));
            let out = &mut values[(i - first) * channels..][..together.max(1) * channels];
            match scattering {
                Some(by) if together > 0 && (i..i + together).any(is_one) => {
                    by.light(simd, i..i + together, &mut batch);
                    by.shade(i, is_one, layout, &mut batch, out);
                }
                _ if together == 0 && is_one(i) => {
                    let (radiance, normal) = shaded.splat(i);
                    radiance.write(normal, layout, out);
                }
                _ => out.fill(0.0),
            }
            i += together.max(1);
        }
    }
}

/// Radiance of splat `i` towards the viewer, and the unit normal that it was shaded by: for who knows its light only when it is drawn.
///
/// # Panics
/// If there is no such splat, or its material or object is out of range.
pub fn shade_splat(input: &ShadeInput<'_>, i: usize) -> (Radiance, Vec3) {
    Shaded { input, within: None }.splat(i)
}

/// [`shade_splat`], where media whose spacing is optically thick are lit within, by [`joint`].
///
/// # Panics
/// If there is no such splat, or its material, object or footprint is out of range.
pub fn shade_splat_within(within: &Within<'_>, i: usize) -> (Radiance, Vec3) {
    Shaded { input: within.input, within: Some(*within) }.splat(i)
}

impl Shaded<'_> {
    /// Radiance of splat `i` towards the viewer, and the unit normal that it was shaded by.
    fn splat(&self, i: usize) -> (Radiance, Vec3) {
        let input = self.input;
        let point = point_of(input, i);
        let thick = self.within.as_ref().and_then(|within| ThickSplat::new(within, i));
        let radiance = point.radiance(input.ambient, input.lights.iter(), |rank, irradiance| match &thick {
            Some(thick) => received_within(input, i, rank, irradiance, thick),
            None => received(input, i, input.lights[rank].shadow, irradiance),
        });
        (radiance, point.normal)
    }
}

/// How much of a shadow splat `i` takes.
#[inline]
fn shadow_share(input: &ShadeInput<'_>, i: usize) -> f32 {
    input.cloud.shadow_coefficient_of(i) * input.objects[input.cloud.object[i] as usize].shadow_coefficient
}

/// Share of a light of this irradiance, with this shadow, that arrives at splat `i`.
#[inline]
fn received(input: &ShadeInput<'_>, i: usize, shadow: Option<&dyn Transmittance>, irradiance: [f32; 3]) -> [f32; 3] {
    let shadow = shadow.map(|shadow| move || shadow.at_splat(i, &Receiver::of_splat(input.cloud, i)));
    arriving(irradiance, shadow_share(input, i), shadow)
}

/// The same of a light by its rank at a splat that is lit by the joint integral.
#[inline]
fn received_within(
    input: &ShadeInput<'_>,
    i: usize,
    rank: usize,
    irradiance: [f32; 3],
    thick: &ThickSplat,
) -> [f32; 3] {
    let coefficient = shadow_share(input, i);
    match input.lights[rank].shadow {
        Some(shadow) if is_attenuated(irradiance, coefficient) => {
            let through = shadow.at_splat(i, &Receiver::of_splat(input.cloud, i));
            thick.received(input, i, rank, through, coefficient)
        }
        _ => [1.0; 3],
    }
}

/// Unit direction from splat `i` to the viewer, or zero at the eye itself.
#[inline]
fn to_eye(input: &ShadeInput<'_>, i: usize) -> Vec3 {
    if input.camera.is_orthographic() {
        -input.camera.axes[2].as_vec3()
    } else {
        let eye = (input.camera.position - input.cloud.origin).as_vec3();
        (eye - input.cloud.position[i]).normalize_or_zero()
    }
}

/// The point that splat `i` is shaded as.
#[inline]
fn point_of<'a>(input: &ShadeInput<'a>, i: usize) -> Point<'a> {
    let cloud = input.cloud;
    let position = cloud.position[i];
    let to_eye = to_eye(input, i);
    Point {
        position: cloud.origin + position.as_dvec3(),
        radius: cloud.radius[i],
        normal: facing(cloud.kind[i], cloud.normal_of(i), cloud.shading_normal_of(i), to_eye),
        to_eye,
        color: cloud.color_along(i, -to_eye),
        material: &input.materials[cloud.material[i] as usize],
    }
}
