//! Organza renders mixed, translucent 3D data — meshes, volumes, raw point clouds, implicit surfaces — into one image.
//!
//! This crate joins the stages: it reads a scene, plans the passes that the scene requires, runs them and writes
//! images.
//!
//! ```text
//! scene.toml ─► read ─► statistics ─► choose ─► convert ─► plan ─► frame ─► techniques in turns ─► finish ─► output
//! ```
//!
//! Objects are read once, so that what is known of them chooses the technique of each, and the form that it takes. Only those
//! forms are made. A frame makes the data that techniques share (shadow maps, opaque surfaces). Each technique folds its
//! objects into the picture from front to back.
//!
//! ```
//! use organza::{Progress, RenderOptions, render, scene};
//! let text = br#"
//!     version = 1
//!     [camera]
//!     position = [0, 0, 4]
//!     target = [0, 0, 0]
//!     size = [32, 32]
//!     [[object]]
//!     name = "fog"
//!     medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.1 }
//! "#;
//! let scene = scene::parse("fog.toml".as_ref(), text, &Default::default()).unwrap();
//! let image = render(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
//! // The middle ray crosses two units of fog: alpha = 1 − e⁻¹.
//! let alpha = image.layers.scalar("alpha").unwrap()[16 * 32 + 16];
//! assert!((alpha - (1.0 - (-1.0f32).exp())).abs() < 1e-3);
//! ```
#![forbid(unsafe_code)]

mod brightness;
mod choose;
pub mod cost;
mod error;
mod form;
mod frame;
mod load;
mod memory;
mod options;
pub mod pass;
pub mod plan;
mod predict;
mod prepare;
mod render;
mod shadows;
mod stage;
pub mod statistics;
mod technique;
mod warnings;

pub use convert::Cache;
pub use error::Error;
pub use frame::{Frame, Shaded};
pub use load::Loaded;
pub use load::context::Context;
pub use load::files::Files;
pub use options::RenderOptions;
pub use organza_device as device;
pub use organza_output as output;
pub use organza_scene as scene;
pub use organza_scene::{InMemory, SourceData, escape_controls, printable, shown};
pub use prepare::{Explanation, explain, explain_from, fitted, load, plan_loaded, same_splats, seen, settled};
pub use render::budget::{Expected, ExpectedError, GivenUp, WithinGoal, render_within};
pub use render::draw::{Planned, draw_loaded};
pub use render::sequence::Sequence;
pub use render::{Foreseen, Render, render, render_from};
pub use shadows::{ShadowTable, shadow_params};
pub use splat_core::{CostRecord, Layers, Progress};
pub use statistics::{Conversion, SplatCount};
pub use technique::Sets;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
