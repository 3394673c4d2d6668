//! Meshes: a reader a format, and what these share: polygons become triangles, textures colours, and faces look outwards.

#[cfg(any(feature = "obj", feature = "off", feature = "vti", feature = "vtk"))]
pub(crate) mod fans;
#[cfg(feature = "gltf")]
pub(crate) mod gltf;
#[cfg(feature = "textures")]
pub(crate) mod mip_maps;
#[cfg(feature = "obj")]
pub(crate) mod mtl;
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) mod named_arrays;
#[cfg(feature = "obj")]
pub(crate) mod obj;
#[cfg(feature = "off")]
pub(crate) mod off;
pub(crate) mod opacity;
pub(crate) mod outwards;
#[cfg(feature = "textures")]
#[cfg_attr(not(any(feature = "obj", feature = "gltf", feature = "ply")), expect(dead_code, reason = "readers paint"))]
pub(crate) mod paint;
#[cfg(feature = "ply")]
pub(crate) mod places;
#[cfg(feature = "ply")]
pub(crate) mod ply;
#[cfg(any(feature = "ply", feature = "obj", feature = "off", feature = "vti", feature = "vtk"))]
pub(crate) mod polygon;
#[cfg(feature = "textures")]
pub(crate) mod rgba;
#[cfg(feature = "obj")]
pub(crate) mod statements;
pub(crate) mod stl;
#[cfg(feature = "textures")]
#[cfg_attr(not(any(feature = "obj", feature = "gltf", feature = "ply")), expect(dead_code, reason = "readers decode"))]
pub(crate) mod texture;
#[cfg(feature = "ply")]
pub(crate) mod textured;
#[cfg(any(feature = "obj", feature = "vti", feature = "vtk"))]
pub(crate) mod tubes;
