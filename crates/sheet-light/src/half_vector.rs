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
//! | 3, 4: transform and bucket sort voxels | `slicing/buckets.rs` |
//! | 12, 13: rasterize footprints | `slicing/sheet.rs`; `slicing/gathered.rs` where pixels read the lattice |
//! | 16: gradients | `eye/gradient.rs` |
//! | 17, 19: classify, illuminate | `eye/sheets.rs`, `eye/shade.rs` |
//! | 20: composite | `eye/buffer.rs` |
//! | 18: map each pixel to the shadow buffer | `light/illuminate.rs`, `light/path.rs` |
//! | 21: classify and composite into the shadow buffer | `light/buffer.rs` |
//! | 1, 2: polygons with respect to the eye and to the light | `polygons/surfaces.rs`, `polygons/light_depth.rs`, `polygons/light_views.rs` |
//! | 7, 22, 25: light on polygons of the three regions | `polygons/light.rs`, `polygons/lit_part.rs` |
//! | 22, 23: translucent polygons for eye and light | `polygons/panes.rs`, `eye/parted.rs`, `polygons/light_layers.rs`, `polygons/lit_way.rs` |
//! | 22, 23: what enters as discs | `splats/sheets.rs`, `splats/light.rs` |
//! | the loop over slabs | `sweep.rs` |
//! | section 5: soft shadows | `soft/penumbra.rs`, `soft/moved.rs`, `soft/buffer.rs` |
//! | section 3: light that is scattered more than once | `scatter.rs` |
//!
//! ```
//! use sheet_light::half::{HalfInput, HalfParams, fold};
//! use sheet_light::{SheetInput, Volume};
//! use splat_core::{Accumulator, Camera, Grid, LayerSet, Light, LightShape, Material, Packing, Projection, Shading};
//! use splat_core::{Similarity, TransferFunction, TransferPoint, glam::{DMat3, DVec3}, shade::{ChannelLayout, LitBy}};
//!
//! // A medium of τ = 1, lit from where it is seen: light comes in, is scattered, and goes out again.
//! let axes = DMat3::from_diagonal(DVec3::splat(0.5));
//! let grid = Grid { origin: DVec3::splat(-1.75), axes, dims: [8; 3], values: vec![7.0; 512] };
//! let transfer = TransferFunction::new(vec![TransferPoint { value: 0.0, color: [1.0; 3], extinction: 0.25 }]).unwrap();
//! let material = Material { shading: Shading::Phase, ..Material::default() };
//! let volume = Volume {
//!     grid: &grid, packing: Packing::Cartesian, transform: Similarity::default(), transfer: &transfer,
//!     extinction_scale: 1.0, material: &material, normals: false, clip: &[], object: 0, shadow_coefficient: 1.0, casts_shadow: true,
//! };
//! let view = Projection::Orthographic { height: 2.0 };
//! let camera = Camera::look_at(DVec3::Z * 9.0, DVec3::ZERO, DVec3::Y, view, [16, 16]).unwrap();
//! let shape = LightShape::Directional { direction: DVec3::NEG_Z };
//! let lights = vec![LitBy { slide: None, light: Light { shape, intensity: [1.0; 3] }, shadow: None }];
//! let sheets = SheetInput {
//!     volumes: vec![volume], splats: None, camera: &camera, lights, shadow_origin: DVec3::ZERO, ambient: [0.0; 3],
//! };
//! let mut image = Accumulator::new([16, 16], 1, 3, false, false);
//! let layout = ChannelLayout::new(&LayerSet::default());
//! let input = HalfInput { sheets, splats: None, polygons: &[], extended: Vec::new(), mapped: Vec::new(), opaque: &[] };
//! fold(&input, &HalfParams::default(), &layout, &mut image, None).unwrap();
//! // (1 − e^(−2τ))/2 of what is scattered to all sides alike.
//! let expected = 0.5 * (1.0 - (-2f32).exp()) / (4.0 * std::f32::consts::PI);
//! assert!(image.channels[0].iter().all(|c| (c - expected).abs() < 1e-5));
//! ```

mod counts;
mod eye;
mod fold;
mod geometry;
mod input;
pub(crate) mod lamps;
mod light;
mod lighting;
mod memory;
mod params;
pub(crate) mod polygons;
#[cfg(feature = "reference")]
pub mod reference;
mod sampled_light;
mod scatter;
mod slicing;
mod soft;
mod splats;
mod sweep;

pub use crate::shared::reason::{LEAST_COSINE, MOST_DEPTH, Reason};
pub use counts::HalfCounts;
pub use fold::{Drawn, balance, fold, has_slabs, slab_width};
pub use input::{Extended, HalfInput, HalfSplats, MOST_SAMPLES};
pub use memory::{bytes, polygon_bytes};
pub use params::{HalfParams, Scattering};
pub use polygons::list_bytes::{light_list_bytes, pane_bytes};
pub use polygons::opaque::{PolygonLamp, PolygonView, opaque_polygons};
pub use polygons::surfaces::Polygons;
pub use sampled_light::SampledLight;
pub use scatter::balance::Balance;
pub use scatter::scatters;
pub use slicing::axis::HalfVector;
pub use slicing::bodies::{Bodies, SplatBounds};
pub use slicing::serves::{penumbra_widening, serves, serves_extended};
