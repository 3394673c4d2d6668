//! Half-vector sheets: slabs across the bisector of light and view, so that one sweep composites for the eye and attenuates for
//! the light.
//!
//! C. Zhang, R. Crawfis, *Light Propagation for Mixed Polygonal and Volumetric Data*, section 4 and Figure 5. With E the unit
//! direction from the volume to the eye and L the one to the light, slabs lie across E + L where E·L ≥ 0, and the eye meets them
//! in the order in which light does; else across L − E, and the eye meets them the other way round. Slab after slab is
//! reconstructed in the eye's image, lit by what the light buffer lets through, and composited; then it is reconstructed in the
//! light's image, where it attenuates. A light has one buffer of two dimensions, whatever the number of slabs.
//!
//! | symbol, step of the pseudocode | here |
//! |---|---|
//! | half way vector | [`HalfVector`] |
//! | 3, 4: transform and bucket sort voxels | `buckets.rs` |
//! | 12, 13: rasterize footprints | `sheet.rs` |
//! | 16: gradients | `gradient.rs` |
//! | 17, 19: classify, illuminate | `eye_sheets.rs` |
//! | 20: composite | `eye_buffer.rs` |
//! | 18: map each pixel to the shadow buffer | `illuminate.rs` |
//! | 21: classify and composite into the shadow buffer | `light_buffer.rs` |
//! | the loop over slabs | `sweep.rs` |

mod axis;
mod band;
mod buckets;
mod counts;
mod eye_buffer;
mod eye_sheets;
mod fold;
mod frame;
mod gradient;
mod illuminate;
mod lamp;
mod light_buffer;
mod params;
mod placed;
pub mod reference;
mod serves;
mod sheet;
mod sight;
mod sweep;

pub use axis::HalfVector;
pub use counts::HalfCounts;
pub use fold::fold;
pub use params::{HalfInput, HalfParams};
pub use serves::{LEAST_COSINE, Reason, serves};
