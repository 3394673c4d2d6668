//! A map in the making: casters leave deposits in the cells that they cover, which are sorted and summed.

pub(crate) mod caster;
pub(crate) mod darkness;
pub(crate) mod deposit;
pub(crate) mod deposits;
pub(crate) mod discs;
pub(crate) mod entries;
pub(crate) mod lanes;
pub(crate) mod media;
pub(crate) mod opaque;
pub(crate) mod overlap;
pub(crate) mod rays;
pub(crate) mod sampling;
pub(crate) mod shares;
pub(crate) mod sort;
pub(crate) mod surfaces;
