//! Sheets against closed forms, invariances, their slow twin, and hard cases. One program: it is linked once.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod body_centred;
mod centre_order;
mod clipped;
mod closed_forms;
mod common;
mod gathered;
mod gradients;
mod half;
mod hard_cases;
mod invariances;
mod modes;
mod panes;
mod precision;
mod preintegrated;
mod skipped;
mod splats;
mod strides;
mod twin;
mod work;
