//! How to render: `[render]`, with the settings of each technique.

pub(crate) mod check;
pub(crate) mod layer_choice;
pub(crate) mod raw;
pub(crate) mod settings;
pub(crate) mod surfels_check;
pub(crate) mod surfels_raw;
