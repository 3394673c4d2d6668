//! Slabs across an axis: where they lie, what lies in them, and a sheet of one of them in a band of an image.

pub(crate) mod axis;
pub(crate) mod band;
pub(crate) mod bodies;
pub(crate) mod buckets;
pub(crate) mod by_slab;
pub(crate) mod frame;
pub(crate) mod gathered;
pub(crate) mod placed;
pub(crate) mod serves;
pub(crate) mod sheet;
pub(crate) mod sight;
pub(crate) mod slab_place;
