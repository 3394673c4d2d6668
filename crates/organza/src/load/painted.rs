//! Meshes whose colours lie between their vertices, as those of textures do.

use super::object_context::ObjectContext;
use crate::Error;
use convert::{Density, SplatParams, SurfaceColors, cost};
use glam::Vec2;
use read::{Painting, ReadParams};
use splat_core::{Mesh, Similarity};
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

/// Most splats that a texture asks for: two a pixel of a picture of 1280x720 that a mesh fills half of, front and back.
const MOST_SPLATS: f64 = 1_000_000.0;

/// A mesh in the colours that an object shows.
pub(super) struct ShownMesh {
    pub(super) mesh: Arc<Mesh>,
    /// Colours between the vertices, in the place of those that the mesh has at them.
    pub(super) painting: Option<Arc<Painting>>,
}

impl Deref for ShownMesh {
    type Target = Mesh;

    fn deref(&self) -> &Mesh {
        &self.mesh
    }
}

impl From<Arc<Mesh>> for ShownMesh {
    fn from(mesh: Arc<Mesh>) -> Self {
        Self { mesh, painting: None }
    }
}

impl ShownMesh {
    /// The mesh with all of its colours at vertices, for techniques that draw triangles: they are divided down to `finest`, object units.
    pub(super) fn divided(&self, path: &Path, finest: f64, context: &ObjectContext<'_>) -> Result<Mesh, Error> {
        let Some(painting) = &self.painting else { return Ok(Mesh::clone(&self.mesh)) };
        let memory = context.files.memory(context.options);
        let params = ReadParams { memory, ..context.options.read_params() };
        let divided = painting.divided(&self.mesh, finest, &params, Some(context.progress));
        let (mesh, notes) = divided.map_err(|e| Error::from_read(path, &e))?;
        context.files.note(path, notes.remarks);
        Ok(mesh)
    }

    /// The density of splats where the object states none.
    ///
    /// It is that of the mesh before opacities divided triangles, or as many splats as the texture has texels on it: up to [`MOST_SPLATS`], over each of which
    /// the texture is averaged.
    pub(super) fn density(&self, splat: &SplatParams) -> Density {
        let Some(painting) = &self.painting else { return Density::Auto };
        let texels: f64 = self.mesh.triangles.iter().map(|triangle| painting.texels(triangle)).sum();
        let pieces = painting.stated_triangles().max(texels.min(MOST_SPLATS) as u64);
        cost::usual_spacing(&self.mesh, pieces, splat).map_or(Density::Auto, Density::Spacing)
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> u64 {
        self.mesh.bytes() + self.painting.as_ref().map_or(0, |painting| painting.bytes())
    }
}

impl SurfaceColors for ShownMesh {
    fn fill(&self, triangle: usize, share: f64, weights: &mut dyn Iterator<Item = Vec2>, colors: &mut [[f32; 3]]) {
        if let Some(painting) = &self.painting {
            painting.colors(&self.mesh.triangles[triangle], share, weights, colors);
        }
    }
}

/// The distance that is no longer seen of a mesh that is divided before its splats are made, object units.
pub(super) fn finest(density: Density, transform: &Similarity) -> f64 {
    match density {
        Density::Spacing(spacing) => spacing / transform.scale,
        Density::Splats(_) | Density::Auto => 0.0,
    }
}
