//! Polygon-by-polygon sampling (Tanaka 2012, section 5): uniform particles on triangles.
//!
//! A triangle of area A gets a Poisson number of particles of mean τ·A/s, by an alias table of all triangles with areas
//! in f64; a particle lies at barycentric coordinates (u, v), folded into the triangle where u + v > 1.
//!
//! Where vertices have opacities, τ is that of the interpolated opacity: particles are drawn at the rate of the greatest τ of a triangle's
//! corners and kept with probability τ over that, so that the opacity of a pixel is exact there too.
//!
//! Deviation: a Poisson number in place of a fixed n. The opacity of a pixel is then 1 − e^(−τ/cos θ) exactly, and each
//! part of the mesh is sampled independently.

use crate::blocks::{BATCH, Batch, Blocks};
#[cfg(feature = "gpu")]
use crate::gpu::{Maker, Twin};
use crate::particles::Steps;
use crate::sampler::{Poisson, PoissonSets};
use crate::stream::{Stage, pair};
use crate::{Density, Error, PackedNormal, Particles, SurfaceParams};
use glam::Vec3;
use rayon::prelude::*;
use splat_core::optics::{self, SurfaceOpacity};
use splat_core::{Mesh, glam};
#[cfg(feature = "gpu")]
use splat_shaders::layouts::ParticleSource;

/// Particles on a mesh.
pub struct MeshSampler<'a> {
    mesh: &'a Mesh,
    params: SurfaceParams,
    density: Option<Density<'a>>,
    /// Opacities of vertices; `None` for a mesh without.
    fading: Option<Fading>,
    sets: PoissonSets,
    /// Of each triangle, where the mesh has none of its own.
    normals: Vec<PackedNormal>,
    area: f64,
}

/// Optical depths of a surface whose opacity varies.
#[derive(Debug, Clone, Copy)]
struct Fading {
    /// Opacity of one crossing where that of the vertices is 1, before the factor.
    opacity: f64,
    /// Factor on optical depths.
    factor: f64,
    /// Optical depth of what is opaque.
    most: f64,
}

impl Fading {
    fn new(mesh: &Mesh, params: &SurfaceParams) -> Option<Self> {
        let factor = params.extinction_factor;
        let opacity = optics::opacity(optics::optical_depth(params.opacity) / factor);
        (!mesh.opacity.is_empty()).then_some(Self { opacity, factor, most: params.opaque_optical_depth })
    }

    /// Optical depth of one crossing at an opacity of vertices.
    fn depth(&self, share: f64) -> f64 {
        (optics::optical_depth(self.opacity * share) * self.factor).min(self.most)
    }
}

impl<'a> MeshSampler<'a> {
    /// Prepares the alias tables. Triangles without area get no particles.
    ///
    /// # Errors
    /// [`Error::Parameter`] for numbers out of range, [`Error::Core`] for a mesh that breaks a promise, [`Error::Empty`]
    /// for one without area, [`Error::Limit`] for more than 4·10⁹ particles a set.
    pub fn new(mesh: &'a Mesh, params: &SurfaceParams, density: Option<Density<'a>>) -> Result<Self, Error> {
        params.validate()?;
        mesh.validate()?;
        density.as_ref().map_or(Ok(()), Density::validate)?;
        let fading = Fading::new(mesh, params);
        let per_area = params.particles_per_area();
        let rate = |t: usize| {
            let per_area =
                fading.map_or(per_area, |fading| fading.depth(greatest_opacity(mesh, t)) / params.cross_section);
            let [a, b, c] = corners(mesh, t).map(Vec3::as_dvec3);
            let most = density.as_ref().map_or(1.0, |d| {
                let middle = (a + b + c) / 3.0;
                let radius = [a, b, c].map(|p| (p - middle).length()).into_iter().fold(0.0, f64::max);
                d.bound(mesh.origin + middle, radius * (1.0 + 1e-12))
            });
            0.5 * (b - a).cross(c - a).length() * per_area * most
        };
        let area: f64 = (0..mesh.triangles.len()).map(|t| area(mesh, t)).sum();
        if area.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            return Err(Error::Empty { what: "a mesh", reason: "no triangle has an area" });
        }
        let blocks = Blocks::new(mesh.triangles.len(), rate)?;
        let sets = PoissonSets::new(mesh.origin, params.cross_section, blocks);
        let flat = if mesh.normal.is_empty() { mesh.triangles.len() } else { 0 };
        let normal = |t: usize| {
            let [a, b, c] = corners(mesh, t);
            pack((b - a).cross(c - a), params)
        };
        let normals = (0..flat).into_par_iter().with_min_len(1024).map(normal).collect();
        Ok(Self { mesh, params: *params, density, fading, sets, normals, area })
    }

    /// Area of the mesh, world units².
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        self.sets.blocks.bytes() + (self.normals.len() * size_of::<PackedNormal>()) as u64
    }

    /// Appends the particles of some arrivals, column by column, so that none waits for another's look-ups.
    fn place(&self, batch: &Batch<1>, base_color: Steps, particles: &mut Particles) {
        let mut places = [[0.0; 2]; BATCH];
        places.iter_mut().zip(&batch.bits[0]).for_each(|(at, bits)| *at = folded(pair(*bits)));
        let arrivals = || batch.elements[..batch.len].iter().zip(&places);
        let first = particles.position.len();
        particles.position.extend(arrivals().map(|(t, at)| point(corners(self.mesh, *t), *at)));
        particles.normal.extend(arrivals().map(|(t, at)| self.normal(*t, *at)));
        let colors =
            arrivals().zip(&particles.position[first..]).map(|((t, at), p)| self.color(*t, *at, base_color).at(*p));
        particles.color.extend(colors);
    }

    #[inline]
    fn normal(&self, t: usize, place: [f32; 2]) -> PackedNormal {
        let [u, v] = place;
        match &*self.mesh.normal {
            [] => self.normals[t],
            normals => {
                let [na, nb, nc] = self.mesh.triangles[t].map(|i| normals[i as usize]);
                pack(na * (1.0 - u - v) + nb * u + nc * v, &self.params)
            }
        }
    }

    /// Opacity of the vertices at a place of a triangle.
    #[inline]
    fn opacity(&self, t: usize, place: [f32; 2]) -> f64 {
        let [u, v] = place.map(f64::from);
        let [a, b, c] = self.mesh.triangles[t].map(|i| f64::from(self.mesh.opacity[i as usize]));
        a + (b - a) * u + (c - a) * v
    }

    #[inline]
    fn color(&self, t: usize, place: [f32; 2], base_color: Steps) -> Steps {
        let [u, v] = place;
        match &*self.mesh.color {
            [] => base_color,
            colors => {
                let [a, b, c] = self.mesh.triangles[t].map(|i| colors[i as usize]);
                let at = |k: usize| (a[k] * (1.0 - u - v) + b[k] * u + c[k] * v) * self.params.color[k];
                Steps::new([at(0), at(1), at(2)])
            }
        }
    }
}

/// The greatest opacity of a triangle's corners.
fn greatest_opacity(mesh: &Mesh, t: usize) -> f64 {
    let opacities = mesh.triangles[t].iter().map(|v| mesh.opacity[*v as usize]);
    f64::from(opacities.fold(0.0, f32::max))
}

/// The normal of a particle.
#[inline]
fn pack(normal: Vec3, params: &SurfaceParams) -> PackedNormal {
    let packed = PackedNormal::new(normal);
    if params.surface_opacity == SurfaceOpacity::PerCrossing { packed.per_crossing() } else { packed }
}

/// Coordinates in a triangle of coordinates in its parallelogram.
#[inline]
fn folded(place: [f32; 2]) -> [f32; 2] {
    let [u, v] = place;
    // Selections, not a branch: whether it is folded cannot be foreseen.
    let beyond = u + v > 1.0;
    [u, v].map(|w| if beyond { 1.0 - w } else { w })
}

#[inline]
fn point(triangle: [Vec3; 3], place: [f32; 2]) -> Vec3 {
    let [a, b, c] = triangle;
    let [u, v] = place;
    a + (b - a) * u + (c - a) * v
}

#[inline]
fn corners(mesh: &Mesh, t: usize) -> [Vec3; 3] {
    mesh.triangles[t].map(|i| mesh.position[i as usize])
}

fn area(mesh: &Mesh, t: usize) -> f64 {
    let [a, b, c] = corners(mesh, t).map(Vec3::as_dvec3);
    0.5 * (b - a).cross(c - a).length()
}

impl Poisson for MeshSampler<'_> {
    fn sets(&self) -> &PoissonSets {
        &self.sets
    }

    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles) {
        let base_color = Steps::new(self.params.color);
        let seed = self.params.seed;
        let blocks = &self.sets.blocks;
        if self.density.is_none() && self.fading.is_none() {
            blocks.batches(seed, Stage::Mesh, set, chunk, |batch| self.place(batch, base_color, particles));
            return;
        }
        blocks.arrivals(seed, Stage::Mesh, set, chunk, |t, stream| {
            let at = folded(stream.pair());
            let triangle = corners(self.mesh, t);
            let p = point(triangle, at);
            let [a, b, c] = triangle.map(Vec3::as_dvec3);
            let middle = (a + b + c) / 3.0;
            let radius = [a, b, c].map(|p| (p - middle).length()).into_iter().fold(0.0, f64::max);
            let is_dense = self.density.as_ref().is_none_or(|density| {
                let most = density.bound(self.mesh.origin + middle, radius * (1.0 + 1e-12));
                stream.unit() * most < density.at(self.mesh.origin + p.as_dvec3())
            });
            let is_kept = is_dense
                && self.fading.is_none_or(|fading| {
                    let most = fading.depth(greatest_opacity(self.mesh, t));
                    stream.unit() * most < fading.depth(self.opacity(t, at))
                });
            if is_kept {
                particles.push(p, self.normal(t, at), self.color(t, at, base_color).at(p));
            }
        });
    }

    #[cfg(feature = "gpu")]
    fn tables(&self) -> Option<Twin> {
        if self.density.is_some() || self.fading.is_some() {
            return None;
        }
        let mesh = self.mesh;
        let has = [!mesh.normal.is_empty(), !mesh.color.is_empty()];
        let vertex = |i: usize| {
            let normal = mesh.normal.get(i).into_iter().flat_map(|n| n.to_array());
            let color = mesh.color.get(i).into_iter().flat_map(|c| [c[0], c[1], c[2]]);
            mesh.position[i].to_array().into_iter().chain(normal).chain(color).map(f32::to_bits)
        };
        let [r, g, b] = self.params.color;
        let per_crossing = self.params.surface_opacity == SurfaceOpacity::PerCrossing;
        let source = ParticleSource {
            tint: [r, g, b, 0.0],
            flags: u32::from(per_crossing) + 2 * u32::from(has[0]) + 4 * u32::from(has[1]),
            vertex_words: 3 * (1 + has.iter().filter(|h| **h).count() as u32),
            ..ParticleSource::default()
        };
        let tables = [mesh.triangles.as_flattened().to_vec(), (0..mesh.position.len()).flat_map(vertex).collect()];
        Some(Twin::new(Maker::Mesh, self, source, tables.into(), self.params.seed, Stage::Mesh))
    }
}
