//! Image-aligned sheets: volumes splatted in slabs across the view, classified and shaded after reconstruction. In [`half`]: slabs
//! across the half vector of light and view, with translucent shadows.
//!
//! N. Neophytou, K. Mueller, *GPU Accelerated Image Aligned Splatting*, 2005, here on the processor. Voxels are kernels. Each
//! adds to every slab across the view that it touches, a section of itself (Figure 1) times its footprint; all sections at once, as
//! the paper's four colours do (section 4.2). A slab that is complete is a sheet of values: it is classified, shaded with gradients
//! from the sheets before and behind it, and composited front to back. Classification comes after reconstruction, so zooms show
//! no blur, and slabs turn with the view, so nothing pops.
//!
//! | symbol | here |
//! |---|---|
//! | Δ_s | [`Params::slab_width`], world units |
//! | extent of the basis function, 2.0 | [`KernelShape::extent`], spacings of the lattice |
//! | weight\[i\], coeff\[0..255\] | [`sections::sections`], of 256 phases a slab, four times the paper's |
//! | 0.98 | 1 − [`Params::transmittance_cutoff`], [`Params::PAPERS_CUTOFF`] |
//! | effective splats (Table 1) | [`SheetCounts::visible`] |
//!
//! ```
//! use sheet_light::{Params, SheetInput, Volume, prepare};
//! use splat_core::{Accumulator, Camera, Grid, LayerSet, Material, Packing, Projection, Shading, Similarity};
//! use splat_core::{TransferFunction, TransferPoint, glam::{DMat3, DVec3}, shade::ChannelLayout};
//!
//! // Eight cells of 1/2 along the view: 4 units of a medium of extinction 0.25, which shines white.
//! let axes = DMat3::from_diagonal(DVec3::splat(0.5));
//! let grid = Grid { origin: DVec3::splat(-1.75), axes, dims: [8; 3], values: vec![7.0; 512] };
//! let white = TransferPoint { value: 0.0, color: [1.0; 3], extinction: 0.25 };
//! let transfer = TransferFunction::new(vec![white]).unwrap();
//! let material = Material { shading: Shading::Unlit, ..Material::default() };
//! let volume = Volume {
//!     grid: &grid, packing: Packing::Cartesian, transform: Similarity::default(), transfer: &transfer, material: &material,
//!     extinction_scale: 1.0, normals: false, clip: &[], object: 0, shadow_coefficient: 1.0, casts_shadow: true,
//! };
//! let view = Projection::Orthographic { height: 2.0 };
//! let camera = Camera::look_at(DVec3::Z * 9.0, DVec3::ZERO, DVec3::Y, view, [16, 16]).unwrap();
//! let layout = ChannelLayout::new(&LayerSet::default());
//! let input = SheetInput {
//!     volumes: vec![volume], splats: None, camera: &camera, lights: Vec::new(), shadow_origin: DVec3::ZERO, ambient: [0.0; 3],
//! };
//! let mut image = Accumulator::new([16, 16], 1, 3, false, false);
//! let sheets = prepare(input, &Params::default(), None).unwrap();
//! let everywhere = f32::NEG_INFINITY..f32::INFINITY;
//! let counts = sheets.fold(everywhere, &[], &layout, &mut image, None).unwrap();
//! // τ = 0.25·4, and what is opaque of it is white.
//! assert!(image.optical_depth[0].iter().all(|tau| (tau - 1.0).abs() < 1e-5));
//! assert!(image.channels[0].iter().all(|c| (c - (1.0 - (-1f32).exp())).abs() < 1e-5));
//! assert!(counts.fragments > 0 && counts.visible >= 512);
//! ```
//!
//! The README says how it works and where it deviates from the paper, and why.
#![forbid(unsafe_code)]

pub mod half_vector;
mod image_aligned;
mod shared;

/// The name of [`half_vector`] in paths of other crates.
pub use half_vector as half;
pub use image_aligned::counts::SheetCounts;
pub use image_aligned::prepare::prepare;
pub use image_aligned::prepared::Sheeted;
#[cfg(feature = "reference")]
pub use image_aligned::reference;
pub use shared::error::Error;
pub use shared::input::{SheetInput, Splats};
pub use shared::params::{Aligned, Classify, GatherKernel, Gradients, KernelShape, Lighting, Params, Reconstruction};
pub use shared::sections;
pub use shared::volume::Volume;
/// The nouns that this crate takes and returns.
pub use splat_core;

/// The page's examples compile and hold.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
