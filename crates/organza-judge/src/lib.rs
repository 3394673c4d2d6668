//! Judges Organza's pictures: by the limit of their technique, by the exact order, by physics, and by the change that each effect
//! makes.
//!
//! ```text
//! scene ─┬─► accuracy   a technique's knobs are turned ─► error and time of every setting ─► frontier
//!        ├─► orders     the same splats by every ordering, against each pixel's exact order
//!        ├─► truth      the scene path-traced without splats
//!        └─► effects    the picture with each effect and without it
//! ```
//!
//! Pictures are drawn by [`organza`] as any render is, by the processor alone; what is true comes from [`mod@reference`], in
//! f64. A technique joins with an [`accuracy::Sweep`] in `accuracy/`.
#![forbid(unsafe_code)]

pub mod accuracy;
pub mod documents;
pub mod effects;
pub mod orders;
pub mod truth;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
