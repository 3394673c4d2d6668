//! Conversions on real files and hard cases. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod body_centred;
mod cache;
mod combined_fields;
mod convert_bunny;
mod convert_cost;
mod convert_fields;
mod convert_matter;
mod convert_mesh;
mod convert_surfels;
mod convert_volume;
mod gaussian_files;
mod mpu_fields;
mod point_attributes;
mod point_footprints;
mod point_materials;
mod point_opacity;
#[path = "../../read/tests/read_samples/mod.rs"]
mod read_samples;
mod readme;
mod spaces_of_volumes;
mod splat_files;
mod surface_field;
