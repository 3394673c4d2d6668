//! HBS, hierarchical bucket sort: slices of translucent splats in linear time.
//!
//! Translucent splats must be composited in the order of their depth. Splats whose depths differ by less than the size of the smallest
//! splat may be composited in any order. So they are sliced, and sorted within slices only if [`Params::exact`] is set: Z. Gunjee et al., *Point Splatting
//! Based on Translucent Shadow Mapping and Hierarchical Bucket Sorting*, 2007, section 4.2, Eqs. 10-13, Figures 8-9.
//!
//! | symbol | here |
//! |---|---|
//! | P_near, P_far | [`SliceOrder::near`], [`SliceOrder::far`]: depths of the nearest and the farthest kept splat |
//! | P_dist | view depth of a splat's centre, f32, the camera subtracted in f64 |
//! | ε | [`SliceOrder::thickness`], chosen by [`Thickness`] |
//! | N_slices (Eq. 10) | [`SliceOrder::slices`] |
//! | N_buckets (Eq. 11) | [`SortInfo::buckets`] |
//!
//! ```
//! use hbsort::{Params, Scratch, Thickness, slice_cloud};
//! use splat_core::{Camera, Cloud, Projection, Splat, glam::{DVec3, Vec3}};
//!
//! let mut cloud = Cloud::new(DVec3::new(0.0, 0.0, -1.0e7));
//! for z in [0.0, 0.25, 3.0, 9.0] {
//!     cloud.push(&Splat { position: Vec3::new(0.0, 0.0, -z), radius: 0.1, ..Splat::default() });
//! }
//! let eye = DVec3::new(0.0, 0.0, 5.0 - 1.0e7);
//! let view = Projection::Perspective { fov_y: 0.8 };
//! let camera = Camera::look_at(eye, eye - DVec3::Z, DVec3::Y, view, [640, 480]).unwrap();
//!
//! let params = Params { thickness: Thickness::World(0.5), ..Params::default() };
//! let mut scratch = Scratch::new();
//! let order = slice_cloud(&cloud, None, &camera, &params, &mut scratch).unwrap();
//! // Far to near; the empty slices between are gone.
//! let slices: Vec<&[u32]> = (0..order.non_empty_slices()).map(|k| order.slice(k)).collect();
//! assert_eq!(slices, [&[3][..], &[2], &[0, 1]]);
//! assert_eq!((order.near, order.far, order.slices), (5.0, 14.0, 18));
//! // Slice 0 is the nearest, so the farthest is the last of 18.
//! assert_eq!(order.slice_indices, [17, 6, 0]);
//! scratch.recycle(order); // The next frame allocates nothing.
//! ```
//!
//! O(n + slices) time; at most 8 bytes a splat plus the buckets beside the result ([`cost`]). The README lists
//! deviations from the paper, with their reasons.
#![forbid(unsafe_code)]

mod along;
mod buckets;
pub mod comparison;
pub mod cost;
mod crowd;
mod depth_bits;
mod error;
mod first_level;
#[cfg(feature = "gpu")]
pub mod gpu;
mod params;
mod project;
mod radix;
mod ranges;
#[cfg(feature = "reference")]
pub mod reference;
mod scratch;
mod second_level;
mod slicing;
mod sort;
mod thickness;

pub use along::{SliceAxis, slice_along};
pub use error::Error;
pub use params::{Params, Thickness};
pub use scratch::{Method, Scratch, SortInfo, ThicknessRule};
pub use sort::{slice_cloud, slice_depths};
/// The nouns that this crate takes and returns.
pub use splat_core;
pub use splat_core::{Direction, SliceOrder};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
