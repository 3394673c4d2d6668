//! Volumes and homogeneous bodies become media. Before that volumes may have gaps filled, be resampled, or be cut by sections.

pub(crate) mod body_centred;
pub(crate) mod bricks;
pub(crate) mod cell_share;
pub(crate) mod classify;
pub(crate) mod gaps;
pub(crate) mod keep;
pub(crate) mod label_surfaces;
pub(crate) mod odd_values;
#[cfg(feature = "noise")]
pub(crate) mod procedural;
pub(crate) mod resample;
pub(crate) mod section;
pub(crate) mod shapes;
pub(crate) mod sobel;
pub(crate) mod volume_points;
