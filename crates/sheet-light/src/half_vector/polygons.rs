//! Triangles that stay triangles, opaque and translucent ones, for the eye and for the light.

pub(crate) mod eye;
pub(crate) mod light;
mod light_blocks;
pub(crate) mod light_depth;
pub(crate) mod light_layers;
pub(crate) mod light_views;
pub(crate) mod list_bytes;
pub(crate) mod lit_part;
pub(crate) mod lit_way;
pub(crate) mod opaque;
pub(crate) mod panes;
pub(crate) mod surfaces;
