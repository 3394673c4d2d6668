//! Colours of materials and textures → colours of vertices, the only ones that meshes have.
//!
//! A texture has more detail than a mesh has vertices: triangles are divided where colours between their corners are not
//! those of the texture, down to its texels, within a bounded number of triangles. So pictures show the texture, and every
//! stage that follows knows vertices alone.

mod refine;

use super::texture::Texture;
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::Mesh;

/// Bytes of the colour and opacity of a vertex, and of its colour in the mesh.
const BYTES_PER_COLOR: u64 = 16 + 12;

/// What a surface is painted with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Paint {
    /// Linear colour and opacity that everything is multiplied by.
    pub(crate) factor: [f32; 4],
    /// Rank of its texture.
    pub(crate) texture: Option<usize>,
    /// Opacity below which nothing is there; `None` where opacities are not asked for.
    pub(crate) cutoff: Option<f32>,
}

/// What the vertices of a mesh are painted with.
#[derive(Default)]
pub(crate) struct Painting {
    pub(crate) paints: Vec<Paint>,
    pub(crate) textures: Vec<Texture>,
    /// Rank of its paint, one a vertex.
    pub(crate) paint_of: Vec<u32>,
    /// Linear colour and opacity, one a vertex; empty for white.
    pub(crate) tint: Vec<[f32; 4]>,
    /// Place in its texture, one a vertex; empty without textures.
    pub(crate) place: Vec<[f32; 2]>,
}

impl Painting {
    fn texture_of(&self, vertex: u32) -> Option<&Texture> {
        self.textures.get(self.paints[self.paint_of[vertex as usize] as usize].texture?)
    }

    /// Colour and opacity of a vertex.
    fn at(&self, vertex: u32) -> [f32; 4] {
        let v = vertex as usize;
        let tint = self.tint.get(v).copied().unwrap_or([1.0; 4]);
        let texture = self.texture_of(vertex).map_or([1.0; 4], |t| t.at(self.place[v]));
        let factor = self.paints[self.paint_of[v] as usize].factor;
        std::array::from_fn(|c| factor[c] * tint[c] * texture[c])
    }

    /// The mesh with its colours; where a paint says so, what is too thin to be there is left out.
    pub(crate) fn paint(mut self, mut mesh: Mesh, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
        input::hold("the colours of vertices", mesh.position.len() as u64 * BYTES_PER_COLOR, reading.params)?;
        if !self.textures.is_empty() {
            refine::refine(&mut mesh, &mut self, reading)?;
        }
        let vertices = 0..mesh.position.len() as u32;
        let colors: Vec<[f32; 4]> = vertices.map(|v| self.at(v)).collect();
        if self.paints.iter().any(|p| p.cutoff.is_some()) {
            let is_there = |t: &[u32; 3]| {
                let cutoff = self.paints[self.paint_of[t[0] as usize] as usize].cutoff;
                let mean = t.iter().map(|v| colors[*v as usize][3]).sum::<f32>() / 3.0;
                cutoff.is_none_or(|cutoff| mean >= cutoff)
            };
            mesh.triangles.retain(is_there);
        }
        mesh.color = colors.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
        Ok(mesh)
    }
}
