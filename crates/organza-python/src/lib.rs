//! The extension `organza._organza` of the Python package: data from arrays, pictures as arrays. What people call is the package beside it.
//!
//! ```text
//! numpy arrays ─► Data ─┐
//!                       ├─► first_scene ─► a scene's document ─► render ─► Picture ─► numpy arrays, files
//! files ────────────────┘
//! ```
//! The interpreter is free while something is drawn, and an interrupt ends that within a moment.
#![forbid(unsafe_code)]

mod arrays;
mod calls;
mod data;
mod documents;
mod errors;
mod legends;
mod picture;
mod running;
mod view;
mod wording;

/// The parts of the extension that the package uses.
#[pyo3::pymodule(name = "_organza", gil_used = false)]
mod organza_module {
    #[pymodule_export]
    use crate::calls::{
        check, check_keys, first_scene, goal_keys, ground_of, in_words, lights_of, map_colors, render, schema,
        toml_text,
    };
    #[pymodule_export]
    use crate::data::Data;
    #[pymodule_export]
    use crate::documents::{explain, info_of_file, info_of_scene, judge_accuracy, judge_orders};
    #[pymodule_export]
    use crate::errors::{InputError, LimitError};
    #[pymodule_export]
    use crate::picture::Picture;
    #[pymodule_export]
    use crate::view::{View, view};
}
