//! The text of a scene file: a tree of values that know their places, from TOML or JSON, changed by options, read by serde.

pub(crate) mod de;
pub(crate) mod file;
pub(crate) mod json;
pub(crate) mod overrides;
pub(crate) mod toml;
pub(crate) mod tree;
