//! What slabs across the view and slabs across half vectors have in common: volumes, their lattices and their classes, slabs, kernels, light that is
//! known before.

pub(crate) mod classifier;
pub(crate) mod depths;
pub(crate) mod error;
pub(crate) mod gathered;
pub(crate) mod gradient_volume;
pub(crate) mod input;
pub(crate) mod lattice;
pub(crate) mod lines;
pub(crate) mod params;
pub(crate) mod pixel;
pub(crate) mod preintegrated;
pub(crate) mod reason;
pub mod sections;
pub(crate) mod shadows;
pub(crate) mod slabs;
pub(crate) mod sums;
pub(crate) mod value_range;
pub(crate) mod vectors;
pub(crate) mod volume;
pub(crate) mod voxels;
