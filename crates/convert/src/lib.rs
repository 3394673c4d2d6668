//! Meshes, volumes, points and fields become clouds.
//!
//! Conversions give clouds of splats with one optical meaning (Gunjee 2007, section 4): [`mesh_to_points`], [`volume_to_points`],
//! [`raw_to_surfels`], [`raw_to_matter`], [`surface_to_points`], [`density_to_points`] and [`procedural_cloud`]. Each takes its parameters
//! and returns a report of counts.
//!
//! ```
//! use convert::{Density, MeshParams, surface_to_points};
//! use field::ExpressionField;
//! use splat_core::{DAabb, glam::DVec3};
//! let ball = ExpressionField::parse("x^2 + y^2 + z^2 - 1").unwrap();
//! let glass = MeshParams { opacity: 0.3, density: Density::Spacing(0.05), ..MeshParams::default() };
//! let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
//! let (cloud, report) = surface_to_points(&ball, bounds, &glass, None).unwrap();
//! assert_eq!(cloud.len() as u64, report.splats);
//! ```
#![forbid(unsafe_code)]

mod color;
mod common;
pub mod cost;
mod field_points;
mod mesh;
mod points;
#[cfg(feature = "reference")]
pub mod reference;
mod splats;
mod volume;

pub use color::color_by::{Classified, ColorBy, Colored, MapScale, PointColors, class_name, colored};
pub use color::color_map::ColorMap;
pub use color::color_scale::{ColorScale, ScaleNumbers};
pub use color::colored_mesh::{ColoredMesh, colored_mesh};
pub use color::label_table::{LARGEST_LABEL, Label, LabelTable};
pub use color::surface_field::{SurfaceField, SurfaceLook};
#[cfg(feature = "cache")]
pub use common::cache::Cache;
pub use common::convert_error::ConvertError;
pub use common::params::{Density, SplatParams};
pub use field_points::{
    DensityParams, density_to_grid, density_to_points, extinction_as_it_is, field_to_grid, field_to_mesh,
    surface_to_mesh, surface_to_points,
};
pub use mesh::clipped_mesh::clipped_mesh;
#[cfg(feature = "lids")]
pub use mesh::lid::{LidReport, LiddedMesh, lidded_mesh};
pub use mesh::mesh_points::{
    MeshParams, MeshReport, flatten_leaning, mesh_to_points, mesh_to_points_into, painted_mesh_to_points,
};
pub use mesh::surface_colors::SurfaceColors;
pub use points::degrees::{looks_like_degrees, metres_of_degrees};
pub use points::discs::{DiscShape, DiscSize};
pub use points::keep_points::{Kept, Within, kept};
pub use points::level_set::points_to_field;
pub use points::materials::PointMaterial;
pub use points::matter::{MatterParams, MatterReport, raw_to_matter};
pub use points::orient::Orientation;
pub use points::outline::Outline;
pub use points::point_cells::with_cells;
pub use points::shown_points::{PointsShown, ShownPoints, shown_points};
pub use points::surfels::{SurfelParams, SurfelReport, raw_to_surfels, scattered_share};
pub use points::thin::thinned;
/// The nouns that this crate takes and returns.
pub use splat_core;
pub use splats::footprints::FootprintChoice;
pub use volume::body_centred::body_centred;
pub use volume::gaps::{ClassifiedGrid, gaps_of_value, gaps_outside, transparent_gaps};
pub use volume::label_surfaces::{label_surface_bytes, label_surfaces, said_of_labels};
pub use volume::odd_values::{FillValue, Strays, without_value, written_value};
#[cfg(feature = "noise")]
pub use volume::procedural::{CloudShape, Ellipsoid, procedural_cloud};
pub use volume::resample::resampled;
pub use volume::section::{Section, volume_section};
pub use volume::shapes::{HomogeneousMedium, MediumBody, Rectangle, medium, medium_to_grid, rectangle};
pub use volume::sobel::{sobel_gradient, sobel_gradient_into};
pub use volume::volume_points::{VolumeParams, VolumeReport, volume_to_points};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
