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
mod at;
mod background;
mod camera;
mod effects;
mod error;
mod footprint;
mod light;
mod limits;
mod load;
mod material;
mod object;
mod paths;
mod render;
mod scene;
mod shown;
mod source;
mod text;
mod written;

pub use animation::stop::{Path, Stop};
pub use background::model::EnvironmentSource;
pub use camera::fit::{CameraFit, DEFAULT_AZIMUTH, DEFAULT_FILL, DEFAULT_SIZE, EachPoint, FoundCamera};
pub use convert::{ColorMap, ColorScale, Label, LabelTable, MapScale, PointColors, ScaleNumbers};
pub use effects::kinds::{EffectKind, HangsOn, SwitchedEffect};
pub use error::Error;
pub use field::Combination;
pub use light::model::{SceneLight, SlideSource};
pub use light::points::{LightPoint, light_points};
pub use load::options::LoadOptions;
pub use load::{check_keys, keys_at, load, parse, schema};
pub use material::model::SceneMaterial;
pub use material::recipes::Recipe;
pub use object::labels::{ObjectLabels, Table as LabelFile, read_label_table};
pub use object::model::{SceneObject, Up, UpBy};
pub use object::points_check::color_map_names;
pub use object::points_look::PointsLook;
pub use paths::{PATH_KEYS, ROOT_KEY, folder_above, relative_path, root_for};
pub use render::layer_choice::{LAYER_NAMES, LayerChoice};
pub use render::settings::{
    Aligned, Bending, Classify, Collisions, ComparedTechnique, Coverage, Goal, Grouping, OpaqueSurfels,
    ParticlesSettings, PointsSettings, Reconstruction, RenderSettings, Scattering, ShadowMapping, ShadowSettings,
    SheetGradients, SheetKernel, SheetsSettings, Slicing, SoftShadows, Stated, SurfaceSampler, SurfelGroups,
    SurfelLayers, SurfelsSettings, Technique, TechniqueKey, VolumeSampler,
};
pub use scene::model::Scene;
pub use shown::{escape_controls, place, printable, short, shown};
pub use source::in_memory::{InMemory, SourceData, name_of as name_in_memory, source_of as source_in_memory};
pub use source::model::{
    CloudSource, CombinedSource, DensitySource, ExtractSource, FieldSource, ImplicitSource, IsosurfaceSource,
    LevelSetSource, MOST_ABSORBANCE, MatterSource, SliceSource, Source, VolumeSource,
};
pub use splat_core::UpAxis;
pub use text::de::nearest_name;
pub use text::file::{MAX_SCENE_BYTES, read};
pub use text::overrides::Override;
pub use text::tree::MAX_SCENE_DEPTH;
pub use written::Written;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
