//! Before any work: what the casters are, how large the tables become, and what they cost.

pub(crate) mod appearance;
pub(crate) mod cost;
pub(crate) mod lit;
pub(crate) mod plan;
pub(crate) mod survey;
