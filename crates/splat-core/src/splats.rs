//! Clouds of splats: their attributes, footprints and order, and how they are packed and thinned out.

pub(crate) mod canonical;
pub(crate) mod cloud;
pub(crate) mod fewer;
pub(crate) mod footprint;
pub(crate) mod packed;
pub(crate) mod slice_order;
