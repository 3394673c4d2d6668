//! Slabs across the view: volumes splatted tile by tile, classified and shaded after reconstruction.

pub(crate) mod counts;
pub(crate) mod fold;
pub(crate) mod gather;
pub(crate) mod light;
pub(crate) mod panes;
pub(crate) mod prepare;
pub(crate) mod prepared;
#[cfg(feature = "reference")]
pub mod reference;
pub(crate) mod segments;
pub(crate) mod slant;
pub(crate) mod tile;
pub(crate) mod view_slabs;
pub(crate) mod viewed;
pub(crate) mod within;
