//! Objects: `[[object]]`, what points among them look like, and what draws them.

pub(crate) mod check;
pub(crate) mod color_scales;
pub(crate) mod drawn;
pub(crate) mod labels;
pub(crate) mod labels_raw;
pub(crate) mod lit;
pub(crate) mod model;
pub(crate) mod points_check;
pub(crate) mod points_look;
pub(crate) mod points_raw;
pub(crate) mod raw;
