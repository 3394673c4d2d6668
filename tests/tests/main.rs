//! The whole command, from scene files to pictures. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod accuracy;
mod animation;
mod bad_scenes;
mod borders;
mod cache;
mod closed_forms;
mod command;
mod doubts;
mod environment;
mod every_key;
#[cfg(all(target_os = "linux", feature = "deep"))]
mod every_scene;
mod exact_particles;
mod eye_inside;
mod first_scene;
mod gaussians;
mod half_vector;
mod interrupts;
mod invariances;
mod layers;
mod legends;
mod loading;
mod many_forms;
mod matter;
mod memory;
mod memory_particles;
mod meshes;
mod only_what_is_called_for;
mod orders;
mod output;
mod particle_layers;
mod particles;
mod point_columns;
mod point_opacity;
mod progress;
mod reading;
mod sheets;
mod slanted_slabs;
mod start;
mod surfel_layers;
mod surfels;
mod surfels_opaque;
mod techniques;
mod textured_lights;
mod truth;
