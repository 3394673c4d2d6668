//! Colours of materials and textures → colours of vertices, the only ones that meshes have.
//!
//! A texture has more detail than a mesh has vertices: triangles are divided where colours between their corners are not
//! those of the texture, down to its texels, within a bounded number of triangles. So pictures show the texture, and every
//! stage that follows knows vertices alone.

#[cfg(any(feature = "obj", feature = "ply"))]
pub(crate) mod corners;
mod refine;

use super::opacity;
use super::texture::Texture;
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::{Association, Mesh};

/// Bytes of the colour and opacity of a vertex, and of both in the mesh.
const BYTES_PER_COLOR: u64 = 16 + 12 + 4;

/// What a surface is painted with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Paint {
    /// Linear colour and opacity that everything is multiplied by.
    pub(crate) factor: [f32; 4],
    /// Rank of its texture.
    pub(crate) texture: Option<usize>,
    /// What its opacity does.
    pub(crate) alpha: Alpha,
}

/// What the opacity of a paint does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Alpha {
    /// Nothing: surfaces are opaque.
    Ignored,
    /// Below this one nothing is there, and what is there is opaque.
    Cut(f32),
    /// It is that of the surface.
    Blended,
}

impl Alpha {
    /// Opacity below which nothing is there; `None` where nothing is cut out.
    fn cutoff(self) -> Option<f32> {
        match self {
            Self::Cut(cutoff) => Some(cutoff),
            Self::Ignored | Self::Blended => None,
        }
    }
}

impl Paint {
    /// Whether it leaves surfaces as they are without it.
    pub(crate) fn is_none(&self) -> bool {
        let is_blended = self.alpha == Alpha::Blended && self.factor[3] < 1.0;
        self.factor[..3] == [1.0; 3] && self.texture.is_none() && self.alpha.cutoff().is_none() && !is_blended
    }
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

    fn alpha_of(&self, vertex: u32) -> Alpha {
        self.paints[self.paint_of[vertex as usize] as usize].alpha
    }

    /// The mesh with its colours and opacities; where a paint says so, what is too thin to be there is left out.
    pub(crate) fn paint(mut self, mut mesh: Mesh, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
        input::hold("the colours of vertices", mesh.position.len() as u64 * BYTES_PER_COLOR, reading.params)?;
        if !self.textures.is_empty() {
            refine::refine(&mut mesh, &mut self, reading)?;
        }
        let vertices = 0..mesh.position.len() as u32;
        let colors: Vec<[f32; 4]> = vertices.map(|v| self.at(v)).collect();
        mesh.color = colors.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
        if self.paints.iter().any(|p| p.alpha != Alpha::Ignored) {
            let opacity = |(v, color): (usize, &[f32; 4])| match self.alpha_of(v as u32) {
                Alpha::Blended => color[3].clamp(0.0, 1.0),
                Alpha::Ignored | Alpha::Cut(_) => 1.0,
            };
            opacity::give(&mut mesh, colors.iter().enumerate().map(opacity).collect(), &mut reading.notes);
            let alpha = |v: u32| colors[v as usize][3];
            let is_there = |t: &[u32; 3]| match self.alpha_of(t[0]) {
                Alpha::Ignored => true,
                Alpha::Cut(cutoff) => t.iter().map(|v| alpha(*v)).sum::<f32>() / 3.0 >= cutoff,
                Alpha::Blended => mesh.opacity.is_empty() || t.iter().any(|v| alpha(*v) > 0.0),
            };
            let are_there: Vec<bool> = mesh.triangles.iter().map(is_there).collect();
            leave_out(&mut mesh, &are_there);
        }
        Ok(mesh)
    }
}

/// Leaves out triangles that are not there, with the vertices that no other triangle has: they would count for bounds.
fn leave_out(mesh: &mut Mesh, are_there: &[bool]) {
    if are_there.iter().all(|is_there| *is_there) {
        return;
    }
    let mut stays = vec![true; mesh.position.len()];
    let of_triangles =
        |is_kept: bool| mesh.triangles.iter().zip(are_there).filter(move |(_, there)| **there == is_kept);
    of_triangles(false).for_each(|(t, _)| t.iter().for_each(|v| stays[*v as usize] = false));
    of_triangles(true).for_each(|(t, _)| t.iter().for_each(|v| stays[*v as usize] = true));
    keep(&mut mesh.triangles, are_there);
    keep(&mut mesh.position, &stays);
    keep(&mut mesh.normal, &stays);
    keep(&mut mesh.color, &stays);
    keep(&mut mesh.opacity, &stays);
    for column in &mut mesh.columns {
        keep(
            &mut column.values,
            match column.association {
                Association::Vertex => &stays,
                Association::Triangle => are_there,
            },
        );
    }
    let mut new = 0;
    let ranks: Vec<u32> = stays
        .iter()
        .map(|stays| {
            let rank = new;
            new += u32::from(*stays);
            rank
        })
        .collect();
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = ranks[*v as usize]);
}

/// Keeps entries that are there.
fn keep<T>(entries: &mut Vec<T>, are_there: &[bool]) {
    let mut there = are_there.iter();
    entries.retain(|_| there.next().copied().unwrap_or(true));
}
