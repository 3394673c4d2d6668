//! Files and fields become clouds, meshes and grids.
//!
//! Readers give nouns ([`read`]); conversions give clouds of splats with one optical meaning (Gunjee 2007, section 4):
//! [`mesh_to_points`], [`volume_to_points`], [`raw_to_surfels`], [`raw_to_matter`], [`surface_to_points`], [`density_to_points`] and
//! [`procedural_cloud`]. Each takes its parameters and returns a report of counts.
//!
//! ```
//! use convert::{Density, ExpressionField, MeshParams, surface_to_points};
//! use splat_core::{DAabb, glam::DVec3};
//! let ball = ExpressionField::parse("x^2 + y^2 + z^2 - 1").unwrap();
//! let glass = MeshParams { opacity: 0.3, density: Density::Spacing(0.05), ..MeshParams::default() };
//! let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
//! let (cloud, report) = surface_to_points(&ball, bounds, &glass, None).unwrap();
//! assert_eq!(cloud.len() as u64, report.splats);
//! ```
#![forbid(unsafe_code)]

mod body_centred;
mod borders;
mod bricks;
#[cfg(feature = "cache")]
mod cache;
#[cfg(feature = "surfels")]
mod cell_ellipse;
mod cell_share;
#[cfg(feature = "surfels")]
mod cell_volume;
mod classify;
mod clipped_mesh;
mod color_by;
mod color_map;
mod color_scale;
mod columns;
mod combine;
mod convert_error;
pub mod cost;
mod counted;
mod creases;
mod degrees;
#[cfg(feature = "surfels")]
mod discs;
mod domain;
#[cfg(feature = "read")]
mod error;
#[cfg(feature = "expression")]
mod expression;
mod extremes;
mod field_points;
mod footprints;
#[cfg(feature = "surfels")]
mod from_splats;
mod gaps;
#[cfg(feature = "surfels")]
mod gaussian_points;
mod grid_field;
mod isosurface_spacing;
mod keep;
mod keep_points;
#[cfg(feature = "lids")]
mod lid;
mod marching_cubes;
#[cfg(feature = "surfels")]
mod materials;
#[cfg(feature = "surfels")]
mod matter;
mod mesh_points;
#[cfg(feature = "surfels")]
mod mpu;
#[cfg(feature = "surfels")]
mod neighbours;
mod odd_values;
#[cfg(feature = "surfels")]
mod orient;
#[cfg(feature = "read")]
mod outline;
#[cfg(feature = "read")]
mod outwards;
mod params;
mod pieces;
#[cfg(feature = "surfels")]
mod places;
#[cfg(any(feature = "read", feature = "surfels"))]
mod point_attributes;
#[cfg(feature = "surfels")]
mod point_cells;
#[cfg(feature = "noise")]
mod procedural;
mod raw_points;
#[cfg(feature = "read")]
pub mod read;
mod ready_splats;
pub mod reference;
mod resample;
mod search;
mod section;
mod shapes;
#[cfg(feature = "surfels")]
mod shown_points;
mod sobel;
mod solids;
mod srgb;
mod subdivide;
mod surface_field;
mod surface_nets;
#[cfg(feature = "surfels")]
mod surfels;
#[cfg(feature = "surfels")]
mod tangent_plane;
#[cfg(feature = "surfels")]
mod thin;
mod vertex_normals;
mod volume_points;
#[cfg(feature = "surfels")]
mod voronoi_cell;
mod write_splats;

pub use body_centred::body_centred;
#[cfg(feature = "cache")]
pub use cache::Cache;
pub use clipped_mesh::clipped_mesh;
pub use color_by::{Classified, ColorBy, Colored, PointColors, class_name, colored};
pub use color_map::ColorMap;
pub use color_scale::{ColorScale, ScaleNumbers};
pub use combine::{ClippedField, CombinedField, RegionField, SharedField};
pub use convert_error::ConvertError;
pub use creases::{crease_bytes, part_at_creases};
pub use degrees::{looks_like_degrees, metres_of_degrees};
#[cfg(feature = "surfels")]
pub use discs::{DiscShape, DiscSize};
#[cfg(feature = "read")]
pub use error::{Fault, Place, ReadError, escaped_path};
#[cfg(feature = "expression")]
pub use expression::{ExpressionError, ExpressionField};
pub use field_points::{
    DensityParams, density_to_grid, density_to_points, extinction_as_it_is, field_to_grid, field_to_mesh,
    surface_to_mesh, surface_to_points,
};
pub use footprints::FootprintChoice;
pub use gaps::{gaps_of_value, gaps_outside, transparent_gaps};
pub use grid_field::{GridField, Inside};
pub use isosurface_spacing::isosurface_spacing;
pub use keep_points::{Kept, Within, kept};
#[cfg(feature = "lids")]
pub use lid::{LidReport, lidded_mesh};
pub use marching_cubes::isosurface_to_mesh;
#[cfg(feature = "surfels")]
pub use materials::PointMaterial;
#[cfg(feature = "surfels")]
pub use matter::{MatterParams, MatterReport, raw_to_matter};
pub use mesh_points::{MeshParams, MeshReport, flatten_leaning, mesh_to_points, mesh_to_points_into};
#[cfg(feature = "surfels")]
pub use mpu::{MpuField, MpuParams, MpuReport, points_to_field};
pub use odd_values::{FillValue, Strays, without_value, written_value};
#[cfg(feature = "surfels")]
pub use orient::Orientation;
#[cfg(feature = "read")]
pub use outline::Outline;
pub use params::{Density, SplatParams};
#[cfg(feature = "surfels")]
pub use point_cells::with_cells;
#[cfg(feature = "noise")]
pub use procedural::{CloudShape, Ellipsoid, procedural_cloud};
pub use raw_points::{Column, PointCell, PointLattice, RawPoints};
pub use ready_splats::ReadySplats;
pub use resample::resampled;
pub use search::{ZeroSearch, extinct_bounds, visible_ends};
pub use section::{Section, volume_section};
pub use shapes::{HomogeneousMedium, MediumBody, Rectangle, medium, medium_to_grid, rectangle};
#[cfg(feature = "surfels")]
pub use shown_points::{PointsShown, ShownPoints, shown_points};
pub use sobel::{sobel_gradient, sobel_gradient_into};
pub use solids::{Combination, Solid};
pub use splat_core::{Clip, Interpolation};
pub use surface_field::SurfaceField;
#[cfg(feature = "surfels")]
pub use surfels::{SurfelParams, SurfelReport, raw_to_surfels};
#[cfg(feature = "surfels")]
pub use thin::thinned;
pub use vertex_normals::{smooth, vertex_normals};
pub use volume_points::{VolumeParams, VolumeReport, volume_to_points};
pub use write_splats::{packed_splats_to_ply, splats_to_ply};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
