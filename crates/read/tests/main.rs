//! Readers on real files, hard cases and bad inputs. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod bad_inputs;
mod read_assets;
mod read_cells;
mod read_columns;
mod read_copc;
mod read_dicom;
mod read_e57;
#[cfg(all(feature = "gltf", feature = "ply", feature = "sog"))]
mod read_gaussians;
#[cfg(all(feature = "off", feature = "gltf"))]
mod read_gltf;
mod read_grids;
#[cfg(all(feature = "exr", feature = "png"))]
mod read_images;
mod read_las;
mod read_lists;
#[cfg(feature = "obj")]
mod read_materials;
#[cfg(feature = "obj")]
mod read_memory;
mod read_mended;
mod read_mesh_columns;
mod read_metaimage;
mod read_more;
mod read_nifti;
mod read_notes;
mod read_numbers;
#[cfg(all(feature = "off", feature = "gltf"))]
mod read_off;
#[cfg(all(feature = "off", feature = "gltf"))]
mod read_pcd;
mod read_ply;
mod read_polygons;
mod read_raw;
mod read_samples;
mod read_series;
#[cfg(all(feature = "tiff", feature = "png"))]
mod read_stacks;
#[cfg(all(feature = "obj", feature = "ply"))]
mod read_textured;
#[cfg(all(feature = "off", feature = "gltf"))]
mod read_textures;
mod read_unread;
mod read_volumes;
mod read_vti;
mod read_vtk;
mod readme;
mod true_words;
