//! Converts raw points to discs, a medium or a field: thinning, and estimates from their neighbours.

pub(crate) mod cell_ellipse;
pub(crate) mod cell_volume;
pub(crate) mod degrees;
pub(crate) mod discs;
pub(crate) mod keep_points;
pub(crate) mod level_set;
pub(crate) mod materials;
pub(crate) mod matter;
pub(crate) mod neighbours;
pub(crate) mod orient;
pub(crate) mod outline;
pub(crate) mod pair_queue;
pub(crate) mod place_order;
pub(crate) mod places;
pub(crate) mod point_cells;
pub(crate) mod shown_points;
pub(crate) mod surfels;
pub(crate) mod tangent_plane;
pub(crate) mod thin;
pub(crate) mod voronoi_cell;
