//! Long work as its caller sees it: progress, limits, memory, cost.

pub(crate) mod cost;
pub(crate) mod limits;
pub(crate) mod memory_account;
pub(crate) mod progress;
