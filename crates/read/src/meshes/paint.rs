//! Colours of materials and textures.
//!
//! A texture has more detail than a mesh has vertices. With [`Textures::Divided`] triangles are divided where colours between their corners are not
//! those of the texture, down to its texels, within a bounded number of triangles, and colours become those of vertices. With [`Textures::Kept`] the
//! mesh keeps its triangles, and its [`Painting`] has the colour of any part of one. Opacities become those of vertices in both.

#[cfg(any(feature = "obj", feature = "ply"))]
pub(crate) mod corners;
mod refine;

use super::mip_maps::Weight;
use super::opacity;
use super::texture::{Texture, Wrap};
use crate::error::ReadError;
use crate::reading::{Notes, Reading, Textures};
use crate::stream::input;
use crate::{ReadParams, meshes::paint::refine::Limits};
use splat_core::glam::{Vec2, Vec3};
use splat_core::{Association, Mesh, Progress};

/// Squares along the diagonal of a mesh over which opacities are averaged where textures are kept: four a splat of the usual distance. Opacities are
/// those of vertices, so finer squares would divide the surface into more triangles than splats show.
const OPACITY_STEPS: f64 = 1600.0;
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

/// Colours of materials and textures, for the vertices of a mesh in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Painting {
    pub(crate) paints: Vec<Paint>,
    pub(crate) textures: Vec<Texture>,
    /// Rank of its paint, one a vertex.
    pub(crate) paint_of: Vec<u32>,
    /// Linear colour and opacity, one a vertex; empty for white.
    pub(crate) tint: Vec<[f32; 4]>,
    /// Place in its texture, one a vertex; empty without textures.
    pub(crate) place: Vec<[f32; 2]>,
    /// Triangles of the mesh before any was divided.
    pub(crate) stated_triangles: u64,
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

    /// Colours of the vertices without their textures.
    pub(crate) fn bare_colors(&self) -> Vec<[f32; 3]> {
        let color = |(vertex, paint): (usize, &u32)| {
            let tint = self.tint.get(vertex).copied().unwrap_or([1.0; 4]);
            let factor = self.paints[*paint as usize].factor;
            std::array::from_fn(|channel| factor[channel] * tint[channel])
        };
        self.paint_of.iter().enumerate().map(color).collect()
    }

    fn alpha_of(&self, vertex: u32) -> Alpha {
        self.paints[self.paint_of[vertex as usize] as usize].alpha
    }

    /// Whether triangles of a paint may be divided; with `alpha_alone` those whose texture has opacities that are used.
    fn is_divided(&self, paint: &Paint, alpha_alone: bool) -> bool {
        let Some(texture) = paint.texture.and_then(|rank| self.textures.get(rank)) else { return false };
        !alpha_alone || paint.alpha != Alpha::Ignored && texture.has_alpha()
    }

    /// The mesh with the colours and opacities of its vertices; [`Reading::painting`] gets those between them where textures are kept. Where a paint says so, what is too thin to be
    /// there is left out.
    pub(crate) fn paint(mut self, mut mesh: Mesh, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
        input::hold("the colours of vertices", mesh.position.len() as u64 * BYTES_PER_COLOR, reading.params)?;
        let is_kept = reading.params.textures == Textures::Kept
            && mesh.triangles.iter().any(|[first, ..]| self.texture_of(*first).is_some());
        let is_decoded = reading.params.textures != Textures::Undecoded;
        self.stated_triangles = mesh.triangles.len() as u64;
        let finest = if is_kept { mesh.bounds().diagonal() / OPACITY_STEPS } else { 0.0 };
        // Sizes of an image know nothing of opacities that lie between vertices.
        let cuts_texels = !is_kept || self.tint.iter().any(|tint| tint[3] < 1.0);
        if is_kept {
            self.make_sizes(reading)?;
        }
        if is_decoded && !self.textures.is_empty() {
            let limits = Limits { alpha_alone: is_kept, finest: if cuts_texels { 0.0 } else { finest } };
            refine::refine(&mut mesh, &mut self, &limits, reading)?;
        }
        let colors = self.averaged(&mesh, finest);
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
            let mut are_there: Vec<bool> = mesh.triangles.iter().map(is_there).collect();
            if !cuts_texels {
                self.cut_by_area(&mesh, &mut are_there);
            }
            leave_out(&mut mesh, is_kept.then_some(&mut self), &are_there);
        }
        if is_kept {
            self.textures = Texture::released(&self.textures);
            reading.painting = Some(self);
        }
        Ok(mesh)
    }

    /// Decides for triangles of paints that cut out which are there, so that they have the area of the texels that are there: what one has too much or too
    /// little is made up by the next.
    fn cut_by_area(&self, mesh: &Mesh, are_there: &mut [bool]) {
        let mut owed = 0.0;
        for (triangle, is_there) in mesh.triangles.iter().zip(are_there) {
            let (Some(cutoff), Some(texture)) = (self.alpha_of(triangle[0]).cutoff(), self.texture_of(triangle[0]))
            else {
                continue;
            };
            let corners = triangle.map(|v| self.place[v as usize]);
            let middle = corners.iter().fold(Vec2::ZERO, |sum, corner| sum + Vec2::from(*corner) / 3.0).to_array();
            let width = self.texels(triangle).sqrt() as f32;
            let wrap = texture.wrap_of(&corners);
            // Opacities of the smaller sizes are shares of texels that are there.
            let share = if width < 2.0 {
                let factor = self.paints[self.paint_of[triangle[0] as usize] as usize].factor[3];
                f32::from(u8::from(factor * texture.averaged(middle, 0.0, wrap)[3] >= cutoff))
            } else {
                texture.averaged(middle, width, wrap)[3]
            };
            let [a, b, c] = triangle.map(|v| mesh.position[v as usize].as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            owed += f64::from(share) * area;
            *is_there = owed >= 0.5 * area && share > 0.0;
            if *is_there {
                owed -= area;
            }
            // No more than a triangle is made up: large ones beside small ones would be paid by many.
            owed = owed.clamp(-0.5 * area, 0.5 * area);
        }
    }

    /// Gives each paint a texture in all sizes, whose means are weighed as its opacities are used.
    fn make_sizes(&mut self, reading: &Reading<'_>) -> Result<(), ReadError> {
        let stated = std::mem::take(&mut self.textures);
        let mut known = Vec::new();
        for paint in &mut self.paints {
            let Some(texture) = paint.texture.and_then(|rank| stated.get(rank)) else { continue };
            let weight = match paint.alpha {
                Alpha::Ignored => Weight::Even,
                Alpha::Blended => Weight::Opacity,
                // The factor of the paint counts for what is cut out too.
                Alpha::Cut(cutoff) => Weight::Cut(if paint.factor[3] > 0.0 { cutoff / paint.factor[3] } else { 1.0 }),
            };
            paint.texture = Some(self.textures.len());
            self.textures.push(texture.with_mip_maps(weight, &mut known, reading)?);
        }
        Ok(())
    }

    /// Triangles of the mesh before any was divided.
    pub fn stated_triangles(&self) -> u64 {
        self.stated_triangles
    }

    /// Vertices of the mesh that it belongs to.
    #[expect(clippy::len_without_is_empty, reason = "an empty mesh is not painted")]
    pub fn len(&self) -> usize {
        self.paint_of.len()
    }

    /// Hands all of its numbers to `take`.
    pub fn digest(&self, take: &mut dyn FnMut(&[u8])) {
        take(format!("{:?}", self.paints).as_bytes());
        take(bytemuck::cast_slice(&self.paint_of));
        take(bytemuck::cast_slice(&self.tint));
        take(bytemuck::cast_slice(&self.place));
        self.textures.iter().for_each(|texture| texture.digest(take));
    }

    /// Bytes that it holds.
    pub fn bytes(&self) -> u64 {
        let of_vertices = size_of_val(&self.paint_of[..]) + size_of_val(&self.tint[..]) + size_of_val(&self.place[..]);
        of_vertices as u64 + Texture::bytes_of(&self.textures)
    }

    /// Texels within a triangle of these vertices; 0 without a texture.
    pub fn texels(&self, triangle: &[u32; 3]) -> f64 {
        let Some(texture) = self.texture_of(triangle[0]) else { return 0.0 };
        let size = Vec2::from(texture.size().map(|n| n as f32)).as_dvec2();
        let [a, b, c] = triangle.map(|v| Vec2::from(self.place[v as usize]).as_dvec2() * size);
        0.5 * (b - a).perp_dot(c - a).abs()
    }

    /// Fills `colors` with the linear colours of parts of a triangle. Each part has its place by its `weights` of the second and third corner, and the
    /// `share` of the triangle's area over which its texture is averaged.
    pub fn colors(
        &self,
        triangle: &[u32; 3],
        share: f64,
        weights: &mut dyn Iterator<Item = Vec2>,
        colors: &mut [[f32; 3]],
    ) {
        let factor = self.paints[self.paint_of[triangle[0] as usize] as usize].factor;
        let tint = triangle.map(|v| self.tint.get(v as usize).map_or(Vec3::ONE, |t| Vec3::new(t[0], t[1], t[2])));
        let texture = self.texture_of(triangle[0]);
        let place = triangle.map(|v| self.place.get(v as usize).map_or(Vec2::ZERO, |p| Vec2::from(*p)));
        let wrap = texture.map_or([Wrap::Clamp; 2], |texture| texture.wrap_of(&place.map(|p| p.to_array())));
        let width = (self.texels(triangle) * share).sqrt() as f32;
        for (color, w) in colors.iter_mut().zip(weights) {
            let first = 1.0 - w.x - w.y;
            let base = Vec3::new(factor[0], factor[1], factor[2])
                // Even tints stay as they are.
                * (tint[0] + (tint[1] - tint[0]) * w.x + (tint[2] - tint[0]) * w.y).max(Vec3::ZERO);
            // Weights whose sum is 1 lead to no infinite place between finite ones.
            let at = place[0] * first + place[1] * w.x + place[2] * w.y;
            let shown = texture.map_or([1.0; 4], |texture| texture.averaged(at.to_array(), width, wrap));
            *color = (base * Vec3::new(shown[0], shown[1], shown[2])).to_array();
        }
    }

    /// The mesh with colours of vertices: triangles are divided as with [`Textures::Divided`], but no edge that is shorter than `finest`, in the
    /// mesh's units. Colours are averaged over squares with such sides. The notes have remarks about the division.
    ///
    /// # Errors
    /// [`ReadError`] of too little memory, and of a reader that was stopped.
    pub fn divided(
        &self,
        mesh: &Mesh,
        finest: f64,
        params: &ReadParams,
        progress: Option<&Progress>,
    ) -> Result<(Mesh, Notes), ReadError> {
        let mut reading = Reading::new(params, progress);
        let mut mesh = mesh.clone();
        let mut painting = self.clone();
        let limits = Limits { alpha_alone: false, finest };
        refine::refine(&mut mesh, &mut painting, &limits, &mut reading)?;
        mesh.color = painting.averaged(&mesh, finest).iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
        Ok((mesh, reading.notes))
    }

    /// Colours and opacities of vertices, averaged over squares of sides `finest` on the surface; those of what is cut out by single texels.
    fn averaged(&self, mesh: &Mesh, finest: f64) -> Vec<[f32; 4]> {
        if finest <= 0.0 {
            return (0..mesh.position.len() as u32).map(|v| self.at(v)).collect();
        }
        let mut widths = vec![f64::INFINITY; mesh.position.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.position[v as usize].as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            let density = if area > 0.0 { (self.texels(triangle) / area).sqrt() } else { 0.0 };
            // The least of the triangles around it: what lies beyond may belong to something else.
            triangle.iter().for_each(|v| widths[*v as usize] = widths[*v as usize].min(finest * density));
        }
        let color = |(v, width): (usize, &f64)| {
            if self.alpha_of(v as u32).cutoff().is_some() {
                return self.at(v as u32);
            }
            let tint = self.tint.get(v).copied().unwrap_or([1.0; 4]);
            let texture = self.texture_of(v as u32);
            // A vertex of no triangle has the colour of its texel.
            let width = if width.is_finite() { *width as f32 } else { 0.0 };
            let shown = texture
                .map_or([1.0; 4], |texture| texture.averaged(self.place[v], width, texture.wrap_of(&[self.place[v]])));
            let factor = self.paints[self.paint_of[v] as usize].factor;
            std::array::from_fn(|c| factor[c] * tint[c] * shown[c])
        };
        widths.iter().enumerate().map(color).collect()
    }
}

/// Leaves out triangles that are not there, with the vertices that no other triangle has: they would count for bounds.
/// `painting` is that of the mesh where it is kept.
fn leave_out(mesh: &mut Mesh, painting: Option<&mut Painting>, are_there: &[bool]) {
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
    if let Some(painting) = painting {
        keep(&mut painting.paint_of, &stays);
        keep(&mut painting.tint, &stays);
        keep(&mut painting.place, &stays);
    }
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
