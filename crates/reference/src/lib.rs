//! Slow f64 truth that the fast stages are judged by.
//!
//! [`composite`] evaluates every splat's footprint at every pixel centre in f64, sorts the fragments of each pixel
//! exactly and composites them one by one. It reads `splat-core`'s nouns as data and calls none of its optics,
//! footprints or rasterization: what it shares with the fast path is the definition of a splat, not code.
//!
//! ```
//! use reference::{composite, Input, Order};
//! use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat, glam::DVec3};
//! let mut cloud = Cloud::new(DVec3::ZERO);
//! cloud.push(&Splat { radius: 0.5, cross_section: 0.1, ..Splat::default() });
//! let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y,
//!     Projection::Orthographic { height: 2.0 }, [9, 9]).unwrap();
//! let image = composite(&Input {
//!     cloud: &cloud, camera: &camera, footprints: &FootprintStack::default(), materials: &[Material::default()],
//!     values: &[1.0, 0.5, 0.25], channels: 3, resampling_sigma_px: 0.0, order: Order::Centre,
//! }, None).unwrap();
//! // The middle pixel is covered, the corner is not.
//! assert!(image.transmittance[40][0] < 1.0 && image.transmittance[0][0] == 1.0);
//! ```
//!
//! What splats stand for is rendered without them: [`march_image`] (media, single scattering, with an error bound),
//! [`composite_surfaces`] (implicit surfaces and meshes in exact order) and [`path_trace`] (everything, with a standard
//! error a pixel).
//!
//! ```
//! use reference::{Density, Medium, PathSettings, Scene, path_trace};
//! use splat_core::{Camera, DAabb, Projection, glam::DVec3};
//! let fog = Medium::new(Density::Box(DAabb::around(DVec3::ZERO, DVec3::ONE)), 0.5, 0.0);
//! let scene = Scene { media: vec![fog], background: Some([1.0; 3]), ..Scene::default() };
//! let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y,
//!     Projection::Orthographic { height: 1.0 }, [4, 4]).unwrap();
//! let image = path_trace(&scene, &camera, &PathSettings::default(), None).unwrap();
//! let mean = image.radiance.mean[0][0];
//! let error = image.radiance.standard_error[0][0];
//! assert!((mean - (-1.0f64).exp()).abs() < 5.0 * error);
//! ```
#![forbid(unsafe_code)]

mod liberty;
mod lights;
mod media;
pub mod metrics;
mod path;
mod placed;
mod ray;
mod scene;
mod splats;
pub mod statistics;
mod surfaces;

pub use liberty::Liberty;
pub use lights::LightSource;
pub use lights::environment::{Environment, LatLong};
pub use lights::slide::Slide;
pub use media::classified::Classified;
pub use media::density::{Density, Lattice};
pub use media::march::{MarchedImage, MarchedRay, march, march_image, optical_depth};
pub use media::medium::{ColorAt, Facets, Medium};
pub use media::phase::{henyey_greenstein, sample_henyey_greenstein};
pub use media::quadrature::{Integral, MarchParams};
pub use path::PathRules;
pub use path::estimate::{Estimate, PathSettings, PixelSampling, Statistics, path_trace};
pub use placed::{Placed, TurnedBox};
pub use ray::Ray;
pub use scene::Scene;
/// The nouns that this crate takes and returns.
pub use splat_core;
pub use splats::composite::{ExactImage, Fragment, Input, Order, composite, fold_fragments};
pub use splats::pixel::PixelSum;
pub use surfaces::dielectric::{
    CHANNEL_WAVELENGTHS_UM, Cauchy, Dielectric, fresnel_reflectance, reflect, refract, transmitted_cosine,
};
pub use surfaces::implicit::{ImplicitSurface, SurfaceImage, SurfaceScene, composite_surfaces};
pub use surfaces::roots::{Crossings, RootParams, crossings};
pub use surfaces::surface::{Surface, SurfaceKind, SurfaceMaterial};
pub use surfaces::visibility::{Hit, Visibility};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
