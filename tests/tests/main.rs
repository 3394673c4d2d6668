//! The whole command, from scene files to pictures. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod accuracy;
mod animation;
mod attributes;
mod auto;
mod bad_scenes;
mod borders;
mod bright_and_dim;
mod brownian_steps;
mod budgets;
mod cache;
mod closed_forms;
mod command;
mod compositing;
mod converted;
mod effects;
mod environment;
mod every_key;
mod exact_particles;
mod extract;
mod eye_inside;
mod fewer_splats;
mod first_scene;
mod footprints;
mod fuzz_seeds;
mod gaussians;
mod half_vector;
mod in_memory;
mod interrupts;
mod invariances;
mod labels;
mod layers;
mod legends;
mod levels;
mod light_effects;
mod loading;
mod many_forms;
mod materials;
mod matter;
mod measured_effects;
mod memory;
mod memory_inputs;
mod memory_particles;
mod mesh_columns;
mod mesh_opacity;
mod meshes;
mod only_what_is_called_for;
mod orders;
mod output;
mod pairs_of_techniques;
mod particle_layers;
mod particles;
mod point_columns;
mod point_materials;
mod point_opacity;
mod predicted;
mod progress;
mod random_effects;
mod reading;
mod scan_shadows;
mod shadow_tables;
mod sheets;
mod shown_fields;
mod signals;
mod slanted_slabs;
mod solids;
mod start;
mod surfel_layers;
mod surfels;
mod surfels_opaque;
mod techniques;
mod textured_lights;
mod textures;
mod thick_media;
mod triangles;
mod truth;
#[cfg(all(unix, feature = "view"))]
mod vectorised;
mod view;
mod warnings;
mod whole_fields;

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    #[cfg(target_os = "linux")]
    mod chromium;
    #[cfg(target_os = "linux")]
    mod every_scene;
    #[cfg(target_os = "linux")]
    mod page;
}
