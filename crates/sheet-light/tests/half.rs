//! Half-vector sheets: closed forms, hard cases, invariances, the slow twin.

mod closed_forms;
pub(crate) mod common;
mod cut;
mod gathered;
mod hard_cases;
mod invariances;
mod panes;
mod paths;
pub(crate) mod polygons;
mod polygons_scattered;
mod scattering;
mod soft;
mod soft_polygons;
mod soft_splats;
mod splats;
mod splats_scattered;
pub(crate) mod twin;
