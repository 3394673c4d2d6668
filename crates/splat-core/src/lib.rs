//! The nouns of splatting, shared by every stage of Organza, and the CPU rasterization of footprints.
//!
//! A scene of meshes, volumes, raw point clouds and implicit surfaces becomes one [`Cloud`] of splats with the
//! rendering-oriented attributes of Gunjee 2007, section 3. Stages meet through the types of this crate alone:
//! `convert` makes clouds, `hbsort` makes a [`SliceOrder`], `tsm` implements [`Transmittance`], and
//! [`raster`] folds shaded splats into an [`Accumulator`].
//!
//! Conventions: right-handed, +Y up, the camera looks along −Z; positions are an f64 origin plus f32 offsets;
//! colours are linear Rec.709; optical depth and absorbance are Napierian; view depth is linear and positive in front.
//!
//! Two splats, one behind the other, hide as much as their optical depths say, together:
//!
//! ```
//! use splat_core::raster::{Detail, FoldInput, OpaqueImage, Params, ProjectInput, fold, project};
//! use splat_core::{Accumulator, Camera, Cloud, Direction, FootprintStack, Material, Projection, Splat, glam::{DVec3, Vec3}};
//!
//! let mut cloud = Cloud::new(DVec3::ZERO);
//! for z in [0.5, -0.5] {
//!     cloud.push(&Splat { position: Vec3::Z * z, radius: 1.0, cross_section: 0.5, ..Splat::default() });
//! }
//! let view = Projection::Orthographic { height: 3.0 };
//! let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, [65, 65]).unwrap();
//! let footprints = FootprintStack::default();
//! let materials = &[Material::default()][..];
//! let opaque = OpaqueImage::default();
//! let params = &Params { resampling_sigma_px: 0.0, ..Params::default() };
//! let detail = Detail::ALL;
//! let seen = ProjectInput { cloud: &cloud, camera: &camera, footprints: &footprints, materials, params, detail };
//! let projected = &project(&seen);
//! let order = &[0, 1];
//! let values = &[1.0; 6];
//! let direction = Direction::FrontToBack;
//! let input = FoldInput { projected, order, values, materials, opaque: &opaque, direction, params };
//! let mut picture = Accumulator::new(camera.size, 1, 3, false, false);
//! fold(&input, &mut picture, None).unwrap();
//!
//! // In the middle: τ = K·norm/R²·w(0) of each, and what is blended of a colour of 1 is 1 − e^−τ of both.
//! let footprint = footprints.layers()[0];
//! let tau = 2.0 * 0.5 * footprint.norm() * footprint.profile(0.0);
//! assert!((f64::from(picture.channels[0][32 * 65 + 32]) + (-tau).exp_m1()).abs() < 1e-6);
//! ```
#![forbid(unsafe_code)]

mod clip;
mod compositing;
mod error;
pub mod optics;
pub mod points;
mod relative;
pub mod rng;
mod scene;
mod shapes;
mod space;
pub mod splat_file;
mod splats;
pub mod srgb;
pub mod text;
mod up_axis;
mod work;

#[cfg(feature = "raster")]
pub mod raster;
#[cfg(feature = "raster")]
pub mod shade;

pub use clip::Clip;
pub use compositing::accumulation::Accumulation;
pub use compositing::arrived::{Arrived, Remembered};
pub use compositing::depth_profile::{DepthFragment, DepthProfile};
pub use compositing::layers::{ADDITIVE_LAYERS, Accumulator, LayerData, LayerSet, Layers, SHADED_EFFECTS};
pub use compositing::pixel_samples::PixelSamples;
pub use compositing::transmittance::{ABOUT, MeanTransmittance, Receiver, TOGETHER, Transmittance};
pub use error::Error;
pub use glam;
pub use points::{Column, PointCell, PointLattice, RawPoints, ReadySplats};
pub use relative::Relative;
pub use scene::camera::{Camera, Projection, ViewTransform};
pub use scene::environment::{Environment, RadianceImage};
pub use scene::light::{Framing, Incidence, Light, LightKey, LightShape, LitBounds, Slide, SlideProjection};
pub use scene::material::{Bump, Material, MaterialTable, Object, ObjectTable, Reflection, Shading};
pub use scene::phase::henyey_greenstein;
pub use scene::transfer::{TransferFunction, TransferPoint};
pub use scene::turns::turns;
pub use shapes::field::ScalarField;
pub use shapes::gaussians::Gaussians;
pub use shapes::grid::{BccGrid, Grid, Interpolation, Packing};
pub use shapes::height_image::HeightImage;
pub use shapes::mesh::{
    Association, Mesh, MeshColumn, crease_bytes, halve_edges, part_at_creases, robust_cross, smooth, vertex_normals,
};
pub use space::{Aabb, DAabb, Similarity};
pub use splats::cloud::{Cloud, Splat, SplatKind, Unfit};
pub use splats::footprint::{Footprint, FootprintImage, FootprintStack, MOST_TEXELS};
pub use splats::packed::PackedCloud;
pub use splats::slice_order::{Direction, SliceOrder};
pub use up_axis::UpAxis;
pub use work::cost::{CostRecord, StageCost};
pub use work::limits::{Exceeded, Limits};
pub use work::memory_account::{MemoryAccount, Reservation};
pub use work::progress::{Progress, Units};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
