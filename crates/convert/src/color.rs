//! Colours by numbers: of a column of points, or of a volume that a surface shows.

pub(crate) mod color_by;
pub(crate) mod color_map;
pub(crate) mod color_scale;
pub(crate) mod colored_mesh;
pub(crate) mod distinct;
pub(crate) mod label_table;
pub(crate) mod surface_field;
