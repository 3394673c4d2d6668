//! Media: densities, phase functions, and light through them by marching and by tracking.

pub(crate) mod classified;
pub(crate) mod density;
pub(crate) mod majorant;
pub(crate) mod march;
pub(crate) mod medium;
pub(crate) mod phase;
pub(crate) mod quadrature;
pub(crate) mod tracking;
