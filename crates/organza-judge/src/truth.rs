//! Physical truth of a scene: the same objects, materials and lights in the path tracer of `reference`, without splats.
//!
//! Light takes the paths of its [`Orders`]. The shortest set is that of the technique `points`: emission, one scattering or reflection, and coloured
//! shadows of translucent objects. [`Truth::beside`] measures the difference to all orders. The path tracer follows a scene's departures from nature
//! too (`reference::Liberty`): shadows that are turned off or weakened, and colours above 1, which scatter more light than arrives. The truth lists
//! them. A volume is classified where light meets it, and reflects about the gradient there where its material asks for that. A scene without a
//! truth gets a reason instead: raw points (the surface that they sample is unknown), or surfaces that scatter by a phase function.

mod medium;
mod object;

use object::Body;
use organza::scene::{Scene, SceneLight};
use organza::{Context, Error, Files, Progress, RenderOptions};
use reference::metrics::{Image, Linear, compare};
use reference::{Environment, LatLong, Liberty, PathRules, PathSettings, PixelSampling, path_trace};
use splat_core::RadianceImage;
use std::path::Path;

/// An unbiased estimate of what is seen, with its error.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The method that computed it, in words.
    pub method: String,
    /// The estimate.
    pub image: Image<Linear>,
    /// Standard error of each pixel and channel, row by row from the top left.
    pub standard_error: Vec<[f64; 3]>,
    /// The difference to all orders of scattering, if it was requested.
    pub all_orders: Option<AllOrders>,
}

/// Light of all orders of scattering beside that of some.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllOrders {
    /// RMSE of the truth of some orders against that of all, noise of both included.
    pub rmse: f64,
    /// Root of the mean squared standard error of the truth of all orders.
    pub rms_standard_error: f64,
    /// Mean radiance of all pixels and channels with some orders, and with all.
    pub mean: [f64; 2],
}

impl Truth {
    /// The difference between this truth of some orders of scattering and `all_orders`.
    ///
    /// # Errors
    /// [`Error::Internal`] for images of different sizes.
    pub fn beside(&self, all_orders: &Self) -> Result<AllOrders, Error> {
        let errors = compare(&self.image, &all_orders.image).map_err(|e| Error::Internal(e.to_string()))?;
        let mean = |image: &Image<Linear>| {
            image.pixels().iter().flatten().sum::<f64>() / (3 * image.pixels().len()).max(1) as f64
        };
        let mean = [mean(&self.image), mean(&all_orders.image)];
        Ok(AllOrders { rmse: errors.rmse, rms_standard_error: all_orders.rms_standard_error(), mean })
    }

    /// Root of the mean squared standard error: the RMSE that a perfect picture would show.
    pub fn rms_standard_error(&self) -> f64 {
        let n = (3 * self.standard_error.len()).max(1) as f64;
        (self.standard_error.iter().flatten().map(|s| s * s).sum::<f64>() / n).sqrt()
    }
}

/// The number of times that light is scattered or reflected on its way to the eye. Emission, ambient light and an
/// environment, which the scene adds to what is seen, light nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orders {
    /// Once.
    One,
    /// By media any number of times, or by a surface once.
    ByMedia,
    /// Any number of times, by media and surfaces in turn.
    All,
}

impl Orders {
    /// The orders that a picture of the scene shows.
    pub fn shown_by(scene: &Scene) -> Self {
        if scene.render.sheets.scattering().is_some() { Self::ByMedia } else { Self::One }
    }

    fn rules(self) -> PathRules {
        PathRules {
            max_bounces: (self == Self::One).then_some(1),
            lights_visible: false,
            emission_illuminates: false,
            environment_illuminates: false,
            reflects_apart: self == Self::ByMedia,
        }
    }

    /// In words.
    const fn name(self) -> &'static str {
        match self {
            Self::One => "single scattering",
            Self::ByMedia => "all orders of scattering by media, one of surfaces",
            Self::All => "all orders of scattering",
        }
    }
}

/// Path-traces a scene with so many samples a pixel; The inner `Err` is the reason why the scene has no truth.
///
/// # Errors
/// As [`organza::load`].
pub fn truth(
    scene: &Scene,
    options: &RenderOptions,
    orders: Orders,
    samples: u32,
    progress: &Progress,
) -> Result<Result<Truth, String>, Error> {
    let (scene, _) = organza::fitted(scene, Context { files: &Files::default(), options, progress })?;
    let scene = &*scene;
    let mut bodies = Vec::new();
    for object in scene.objects.iter().filter(|o| o.visible) {
        match object::body(scene, object, options)? {
            Ok(body) => bodies.push(body),
            Err(reason) => return Ok(Err(format!("object '{}': {reason}", organza::shown(&object.name)))),
        }
    }
    let mut lights = Vec::new();
    let mut slides = Vec::new();
    for light in &scene.lights {
        let known = reference::LightSource::from_light(&light.light);
        lights.push(known.ok_or_else(|| Error::Internal(format!("the reference knows no light such as {light:?}")))?);
        slides.push(slide(light, options)?);
    }
    let environment = environment(scene, options)?;
    let densities: Vec<_> = bodies.iter().map(Body::density).collect::<Result<_, _>>().map_err(fault)?;
    let traced = reference::Scene {
        media: bodies.iter().zip(&densities).filter_map(|(body, whole)| body.medium(whole.as_ref()?)).collect(),
        surfaces: bodies.iter().filter_map(Body::surface).collect(),
        lights,
        unshadowed: scene.lights.iter().map(|l| !l.shadow).collect(),
        slides,
        environment,
        background: None,
    };
    if orders != Orders::One && gains(&traced).any(|gain| gain > 1.0) {
        return Ok(Err("colours above 1 scatter more light than arrives, which would go on for ever".into()));
    }
    let settings = PathSettings {
        seed: scene.render.seed,
        samples: samples.max(2),
        rules: orders.rules(),
        pixel: PixelSampling::Area,
        ..PathSettings::default()
    };
    let estimate = path_trace(&traced, &scene.camera, &settings, Some(progress)).map_err(fault)?;
    if estimate.majorant_violations > 0 {
        return Ok(Err("a density exceeds every bound that could be found for it".into()));
    }
    let size = estimate.size.map(|s| s as usize);
    let image = Image::from_radiance(size, estimate.radiance.mean).map_err(|e| Error::Internal(e.to_string()))?;
    let method = format!(
        "path tracing without splats, {}, {} samples a pixel{}",
        orders.name(),
        estimate.samples,
        liberties(scene, &traced)
    );
    Ok(Ok(Truth { method, image, standard_error: estimate.radiance.standard_error, all_orders: None }))
}

/// What a scene that was checked does not come to, but for being stopped.
fn fault(error: splat_core::Error) -> Error {
    match error {
        splat_core::Error::Cancelled => Error::Cancelled,
        other => Error::Internal(other.to_string()),
    }
}

/// What is seen behind everything, by mirrored and bent rays too.
fn environment(scene: &Scene, options: &RenderOptions) -> Result<Environment, Error> {
    let Some(source) = &scene.environment else { return Ok(Environment::Constant(scene.background.map(f64::from))) };
    let image = image(&source.path, options)?;
    let pixels = image.pixels.iter().map(|p| p.map(|v| f64::from(v) * source.scale)).collect();
    let made = LatLong::new(image.size.map(|s| s as usize), pixels).and_then(|sky| sky.turned(source.turns));
    made.map(Environment::Image)
        .map_err(|e| Error::input(organza::printable(&source.path), e.to_string(), "use a smaller background.scale"))
}

/// What a light shines through, if anything.
fn slide(light: &SceneLight, options: &RenderOptions) -> Result<Option<reference::Slide>, Error> {
    let Some(source) = &light.slide else { return Ok(None) };
    let made = splat_core::Slide::new(&image(&source.path, options)?, &light.light.shape, &source.framing);
    made.map(|slide| Some(reference::Slide::from_slide(&slide)))
        .map_err(|e| Error::input(organza::printable(&source.path), e.to_string(), "place it in another way"))
}

fn image(path: &Path, options: &RenderOptions) -> Result<RadianceImage, Error> {
    let (data, _) = read::file(path, &options.read_params(), None).map_err(|e| Error::from_read(path, &e))?;
    let read::Loaded::Image(image) = data else {
        return Err(Error::wrong_kind(path, "an image of radiance", "name a Radiance HDR, OpenEXR or PNG file"));
    };
    Ok(image)
}

fn all_liberties<'a>(traced: &'a reference::Scene<'_>) -> impl Iterator<Item = &'a Liberty> {
    traced.media.iter().map(|m| &m.liberty).chain(traced.surfaces.iter().map(|s| &s.material.liberty))
}

fn gains(traced: &reference::Scene<'_>) -> impl Iterator<Item = f64> {
    all_liberties(traced).map(|liberty| liberty.gain)
}

/// What the scene asks otherwise than nature, in words.
fn liberties(scene: &Scene, traced: &reference::Scene<'_>) -> String {
    let mut text = String::new();
    if gains(traced).any(|gain| gain > 1.0) {
        text += "; colours above 1 scatter more light than arrives, as the scene asks";
    }
    let weakened = all_liberties(traced).any(|l| !l.casts_shadow || l.shadow_coefficient != 1.0);
    if weakened || scene.lights.iter().any(|l| !l.shadow) {
        text += "; shadows are left out or weakened, as the scene asks";
    }
    text
}
