//! Images by path tracing: every pixel with its mean and standard error per channel.
//!
//! Samples come in passes over the image; a pixel's numbers are merged in order (Welford 1962), and random numbers are
//! keyed by (seed, pixel, sample), so that the bits depend on neither threads nor the size of a pass. The stop is decided
//! for the image, not by pixel: stopping a pixel by its own error would bias it.

use crate::path::random::Stream;
use crate::path::{PathRules, Tracer};
use crate::ray::Ray;
use crate::scene::Scene;
use rayon::prelude::*;
use splat_core::{Camera, Error, Progress};

/// Stages of the random numbers.
const RADIANCE: u64 = 0x7261_6469;
const TRANSMITTANCE: u64 = 0x7472_616e;

/// Where in a pixel eye rays go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PixelSampling {
    /// All over the pixel evenly.
    #[default]
    Area,
    /// Through its centre.
    Center,
}

/// How an image is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathSettings {
    /// Key of all random numbers.
    pub seed: u64,
    /// Most samples a pixel, ≥ 2.
    pub samples: u32,
    /// Samples a pixel between two looks at the error, ≥ 1.
    pub batch: u32,
    /// Stops when [`Estimate::relative_error`] is not above this; `None` takes all samples.
    pub target_relative_error: Option<f64>,
    /// Which light paths count.
    pub rules: PathRules,
    /// Where in a pixel rays go.
    pub pixel: PixelSampling,
    /// Whether the transmittance to the background is estimated too.
    pub transmittance: bool,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            samples: 64,
            batch: 16,
            target_relative_error: None,
            rules: PathRules::default(),
            pixel: PixelSampling::default(),
            transmittance: false,
        }
    }
}

/// Means and their standard errors per pixel and channel, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Statistics {
    /// Mean of the samples.
    pub mean: Vec<[f64; 3]>,
    /// Standard deviation of the mean, estimated from the samples.
    pub standard_error: Vec<[f64; 3]>,
}

/// A path-traced image.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Radiance, background included.
    pub radiance: Statistics,
    /// Transmittance to the background, if it was asked for.
    pub transmittance: Option<Statistics>,
    /// Samples a pixel.
    pub samples: u32,
    /// Scattering events of all paths.
    pub bounces: u64,
    /// Density lookups above the promised majorant: no bias, but a broken promise.
    pub majorant_violations: u64,
}

impl Estimate {
    /// Expected relative error of the image: root mean square of the standard errors over that of the radiance, over all
    /// pixels and channels; 0 for a dark image without error.
    pub fn relative_error(&self) -> f64 {
        let squares = |v: &[[f64; 3]]| v.iter().flatten().map(|e| e * e).sum::<f64>();
        let error = squares(&self.radiance.standard_error);
        let light = squares(&self.radiance.mean);
        if error == 0.0 { 0.0 } else { (error / light).sqrt() }
    }
}

/// Running mean and sum of squares of one pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Running {
    n: f64,
    mean: [f64; 3],
    squares: [f64; 3],
}

impl Running {
    fn add(&mut self, sample: [f64; 3]) {
        self.n += 1.0;
        for c in 0..3 {
            let off = sample[c] - self.mean[c];
            self.mean[c] += off / self.n;
            self.squares[c] += off * (sample[c] - self.mean[c]);
        }
    }

    fn standard_error(&self) -> [f64; 3] {
        self.squares.map(|s| (s.max(0.0) / (self.n * (self.n - 1.0).max(1.0))).sqrt())
    }
}

#[derive(Clone, Copy, Default)]
struct Pixel {
    bounces: u64,
    radiance: Running,
    transmittance: Running,
}

/// Path-traces a scene. Rows of pixels are reported to `progress`, those of each batch of samples by themselves, and work stops
/// where that is cancelled.
///
/// # Errors
/// As [`Scene::validate`]; [`Error::Invalid`] for fewer than two samples or no pixels; [`Error::Cancelled`].
pub fn path_trace(
    scene: &Scene<'_>,
    camera: &Camera,
    settings: &PathSettings,
    progress: Option<&Progress>,
) -> Result<Estimate, Error> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    if settings.samples < 2 || settings.batch < 1 {
        let found = [settings.samples, settings.batch];
        return Err(Error::invalid("path settings", 0, "samples, batch", found, "at least 2 samples, batches of 1"));
    }
    if camera.size.contains(&0) {
        return Err(Error::invalid("camera", 0, "size", camera.size, "at least one pixel"));
    }
    let tracer = Tracer::new(scene, settings.rules)?;
    let [width, height] = camera.size.map(|s| s as usize);
    let mut pixels = vec![Pixel::default(); width * height];
    let mut done = 0u32;
    loop {
        let until = done.saturating_add(settings.batch).clamp(2, settings.samples);
        progress.add_total(height as u64);
        let row = |(y, row): (usize, &mut [Pixel])| {
            progress.tick(1)?;
            for (x, pixel) in row.iter_mut().enumerate() {
                for sample in done..until {
                    one_sample(&tracer, camera, settings, x, y, sample, pixel);
                }
            }
            Ok::<(), Error>(())
        };
        pixels.par_chunks_mut(width).enumerate().try_for_each(row)?;
        done = until;
        let estimate = finish(camera, settings, &pixels, done, tracer.violations());
        let reached = settings.target_relative_error.is_some_and(|target| estimate.relative_error() <= target);
        if reached || done >= settings.samples {
            return Ok(estimate);
        }
    }
}

fn one_sample(
    tracer: &Tracer<'_>,
    camera: &Camera,
    settings: &PathSettings,
    x: usize,
    y: usize,
    sample: u32,
    pixel: &mut Pixel,
) {
    let item = (y * camera.size[0] as usize + x) as u64;
    let mut rng = Stream::new(settings.seed, RADIANCE, item, u64::from(sample));
    let [dx, dy] = match settings.pixel {
        PixelSampling::Area => rng.pair(),
        PixelSampling::Center => [0.5; 2],
    };
    let ray = Ray::of_pixel(camera, x as f64 + dx, y as f64 + dy);
    let (radiance, bounces) = tracer.radiance(ray, &mut rng);
    pixel.radiance.add(radiance);
    pixel.bounces += u64::from(bounces);
    if settings.transmittance {
        // Numbers of their own: asking for the transmittance leaves the radiance as it is.
        let mut rng = Stream::new(settings.seed, TRANSMITTANCE, item, u64::from(sample));
        pixel.transmittance.add(tracer.transmittance(&ray, f64::INFINITY, u32::MAX, &mut rng));
    }
}

fn finish(camera: &Camera, settings: &PathSettings, pixels: &[Pixel], samples: u32, violations: u64) -> Estimate {
    let collect = |running: fn(&Pixel) -> &Running| Statistics {
        mean: pixels.iter().map(|p| running(p).mean).collect(),
        standard_error: pixels.iter().map(|p| running(p).standard_error()).collect(),
    };
    Estimate {
        size: camera.size,
        radiance: collect(|p| &p.radiance),
        transmittance: settings.transmittance.then(|| collect(|p| &p.transmittance)),
        samples,
        bounces: pixels.iter().map(|p| p.bounces).sum(),
        majorant_violations: violations,
    }
}
