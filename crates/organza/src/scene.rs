//! Scene files: text → located value tree → raw tables → checked [`Scene`].
//!
//! ```text
//! .toml ─ read_toml ─┐
//!                    ├─► tree ── overrides ──► de ──► raw ── check ──► Scene
//! .json ─ read_json ─┘  (places)  (--set)           (serde)
//! ```
//! Serde stops here: a [`Scene`] has radians, f64 world units, resolved paths and nothing left to check.
//! The schema is described in `docs/scene.md` and printed by `organza schema`.

mod animation;
mod check;
mod check_field;
mod check_light;
mod check_material;
mod check_object;
mod check_render;
mod de;
mod layer_choice;
mod lights;
mod load;
mod model;
mod overrides;
mod paths;
mod raw;
mod raw_object;
mod read_json;
mod read_toml;
mod tree;

pub use convert::read::UpAxis;
pub use layer_choice::{LAYER_NAMES, LayerChoice};
pub use lights::{LightSource, SceneLight};
pub use load::{LoadOptions, MAX_SCENE_BYTES, MAX_SCENE_DEPTH, load, parse, read, schema};
pub use model::{
    CloudSource, DensitySource, ImplicitSource, IsosurfaceSource, LevelSetSource, MediumShape, ParticlesSettings,
    PointsSettings, RectangleSource, RenderSettings, Scene, SceneMaterial, SceneObject, ShadowMapping, ShadowSettings,
    SliceSource, Source, SurfaceSampler, Technique, Up, VolumeSource,
};
pub use overrides::Override;
