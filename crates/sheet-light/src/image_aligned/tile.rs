//! One tile of the image: its lists of voxels, its sheets in the making, its pixels.

pub(crate) mod fold_tile;
pub(crate) mod kept;
pub(crate) mod near_eye;
pub(crate) mod picture;
pub(crate) mod place;
pub(crate) mod preclassified;
pub(crate) mod queue;
pub(crate) mod rays;
pub(crate) mod ring;
pub(crate) mod run;
pub(crate) mod shade;
pub(crate) mod sheets;
pub(crate) mod size;
pub(crate) mod splat_sheet;
pub(crate) mod sweep;
pub(crate) mod waiting_panes;
