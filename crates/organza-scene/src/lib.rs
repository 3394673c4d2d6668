//! Scene files: text → located value tree → raw tables → checked [`Scene`].
//!
//! ```text
//! .toml ─ read_toml ─┐
//!                    ├─► tree ─► overrides ─► animation ─► de ─► raw ─► check ─► Scene
//! .json ─ read_json ─┘ (places)   (--set)     (a frame)        (serde)
//! ```
//! Serde stops here: a [`Scene`] has radians, f64 world units, resolved paths and nothing left to check.
//! The schema is described in `docs/scene.md` and printed by `organza schema`. Every error has a place in the file, or
//! names the option, and says what to do.
#![forbid(unsafe_code)]

mod animation;
mod check;
mod check_background;
mod check_camera;
mod check_drawn;
mod check_effects;
mod check_extract;
mod check_field;
mod check_footprint;
mod check_light;
mod check_material;
mod check_object;
mod check_points;
mod check_render;
mod check_slide;
mod check_source;
mod check_surfels;
mod check_transfer;
mod color_scales;
mod de;
mod effects;
mod error;
mod fit;
mod in_memory;
mod layer_choice;
mod light_points;
mod lights;
mod lit;
mod load;
mod model;
mod overrides;
mod paths;
mod points;
mod raw;
mod raw_camera;
mod raw_footprint;
mod raw_light;
mod raw_material;
mod raw_object;
mod raw_points;
mod raw_render;
mod raw_source;
mod raw_surfels;
mod read_json;
mod read_toml;
mod settings;
mod shown;
mod source;
mod stops;
mod switched;
mod tree;
mod written;

pub use convert::{ColorMap, ColorScale, PointColors, ScaleNumbers};
pub use effects::{EffectKind, HangsOn, SwitchedEffect};
pub use error::Error;
pub use field::Combination;
pub use fit::{CameraFit, DEFAULT_AZIMUTH, DEFAULT_FILL, DEFAULT_SIZE, EachPoint, FoundCamera};
pub use in_memory::{InMemory, SourceData, name_of as name_in_memory, source_of as source_in_memory};
pub use layer_choice::{LAYER_NAMES, LayerChoice};
pub use light_points::{LightPoint, light_points};
pub use lights::{SceneLight, SlideSource};
pub use load::{LoadOptions, MAX_SCENE_BYTES, MAX_SCENE_DEPTH, load, parse, read, schema};
pub use model::{EnvironmentSource, Scene, SceneMaterial, SceneObject, Up, UpBy};
pub use overrides::Override;
pub use paths::{ROOT_KEY, relative_path, root_for};
pub use points::PointsLook;
pub use settings::{
    Aligned, Bending, Classify, Collisions, Coverage, Grouping, OpaqueSurfels, ParticlesSettings, PointsSettings,
    RenderSettings, Scattering, ShadowMapping, ShadowSettings, SheetsSettings, Slicing, SoftShadows, SurfaceSampler,
    SurfelGroups, SurfelLayers, SurfelsSettings, Technique, VolumeSampler,
};
pub use shown::{escape_controls, place, printable, short, shown};
pub use source::{
    CloudSource, CombinedSource, DensitySource, ExtractSource, FieldSource, ImplicitSource, IsosurfaceSource,
    LevelSetSource, MOST_ABSORBANCE, MatterSource, SliceSource, Source, VolumeSource,
};
pub use splat_core::UpAxis;
pub use stops::{Path, Stop};
pub use written::Written;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
