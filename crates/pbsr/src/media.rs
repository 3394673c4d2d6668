//! Samplers of media: volumes, procedural densities, clouds of splats.

pub(crate) mod bounded;
pub(crate) mod metropolis;
pub(crate) mod pieces;
pub(crate) mod places;
pub(crate) mod radial;
pub(crate) mod splats;
pub(crate) mod volume;
pub(crate) mod volume_field;
