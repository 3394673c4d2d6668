//! Translucent shadow maps.
//!
//! Z. Gunjee, T. Fujimoto, N. Chiba: *Point Splatting Based on Translucent Shadow Mapping and Hierarchical Bucket
//! Sorting*, The Journal of the Society for Art and Science 6(1), 2007, section 4.1.
//!
//! A [`ShadowMap`] is a table over the directions of one light. Each cell keeps the absorbance of the splats that cover
//! it by rising distance, so the light that arrives at any point follows from one look-up per nearest cell:
//! T = e^−A, A = Σ of all entries nearer than the point.
//!
//! ```
//! use splat_core::{Cloud, Light, LightShape, Receiver, Splat, SplatKind, Transmittance, glam::{DVec3, Vec3}};
//! use tsm::{Params, Scene, ShadowMap};
//!
//! let mut cloud = Cloud::new(DVec3::ZERO);
//! cloud.push(&Splat { radius: 0.5, cross_section: 0.2, ..Splat::default() });
//! let light = Light { shape: LightShape::Point { position: DVec3::new(0.0, 4.0, 0.0) }, intensity: [1.0; 3] };
//! let map = ShadowMap::build(&Scene::from(&cloud), &light, &Params::default(), None).unwrap();
//! let below = Receiver { position: Vec3::NEG_Y, normal: Vec3::ZERO, radius: 0.0, kind: SplatKind::Medium };
//! let [through, ..] = map.transmittance(&below);
//! assert!(through > 0.2 && through < 0.6, "{through}");
//! ```
//!
//! # Complexity
//! O(n·e log) for n splats of e entries each; a look-up takes four binary searches. 8 bytes an entry (16 in colour) and
//! 8 bytes a cell. See `README.md` for symbols, deviations from the paper, and measured speed.
#![forbid(unsafe_code)]

mod building;
mod error;
mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod mapping;
mod params;
mod planning;
mod reading;
#[cfg(feature = "reference")]
pub mod reference;
mod scene;
mod shadow_map;
mod table;

pub use building::deposits::Deposits;
pub use error::Error;
pub use params::{MappingChoice, Params, Resolution};
pub use planning::cost::{Counts, Limit, Prediction};
pub use reading::query::SurfacePoint;
pub use reading::wider::Wider;
pub use scene::Scene;
pub use shadow_map::ShadowMap;
/// The nouns that this crate takes and returns.
pub use splat_core;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
