//! Data files surveyed: what they hold, for people, and a first scene of them, ready to edit.
//!
//! ```text
//! files ─ read ─┬─► facts: counts, bounds, spacing, histogram, faults            (`organza info`)
//!               └─► first scene: camera, light, materials, transfer functions    (`organza init`, `organza render FILE`)
//! ```
//! A first scene is text in TOML, with comments. Nothing about a picture is decided but by that text: who draws it draws the text.
#![forbid(unsafe_code)]

mod data_file;
pub mod documents;
mod facts;
mod first_scene;
mod histogram;
mod labels;
mod lamps;
mod matter;
mod mesh_faults;
mod number;
mod paraview;
mod preset;
mod spacing;
mod stands;
mod transfer;

pub use data_file::{DataFile, ShownColumn};
pub use facts::{Facts, LabelFact, facts};
pub use first_scene::{Written, first_scene, ground_of};
pub use histogram::Histogram;
pub use lamps::lights_of;
pub use number::{counted, grouped, rounded, sized};
pub use preset::{NamedTable, Preset, Wish, material_named};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
