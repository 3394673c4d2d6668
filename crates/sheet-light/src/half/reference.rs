//! The slow form in f64: the same sheets pixel by pixel, voxel by voxel, without bands, buckets, vectors, bounds or skipped voxels,
//! and light on the way through a slab summed step by step.
//!
//! Normals are those of `normal.rs`, splats those of `splats.rs`, polygons those of `polygons.rs`. Light that is scattered more than once is that of
//! `scatter.rs`, of volumes alone.

mod normal;
mod polygons;
mod scatter;
mod splats;

use super::axis::HalfVector;
use super::eye_sheets::mean_depth;
use super::frame::{Frame, Ray};
use super::placed::Placed;
use super::serves::{axis_of_view, other_axis};
use super::sight::{Shape, Sight};
use super::{Extended, HalfInput, HalfParams, lamp};
use crate::lattice::Lattice;
use crate::reference::Picture;
use crate::sections::{PHASES, sections};
use crate::{Error, Volume};
use polygons::{Hit, Triangles};
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::{LitBy, Point};
use splat_core::{Camera, Footprint, Light};
use splats::Splats;

/// Steps on the way of a ray through a slab.
const STEPS: usize = 200;

/// A voxel: a, b, where its kernel begins, value.
type Voxel = (f64, f64, u32, f64);

/// A voxel that reaches a slab or one of its neighbours: a, b, its sections in the slab before, the slab and the one behind, value.
type Reaching = (f64, f64, [f64; 3], f64);

/// What is the same for all slabs.
struct View<'a> {
    input: &'a HalfInput<'a>,
    params: &'a HalfParams,
    frame: Frame,
    placed: Vec<Placed<'a>>,
    voxels: Vec<Vec<Voxel>>,
    /// Of the kernels, by volume and phase.
    sections: Vec<Vec<Vec<f64>>>,
    polygons: Triangles<'a>,
    diffuse: Option<scatter::Diffuse>,
}

/// One image: its camera, its footprints by volume.
struct Image {
    camera: Camera,
    shapes: Vec<Shape>,
    /// View depths at which its rays end; or nothing.
    ends: Vec<f64>,
}

/// What a ray has of a volume in a slab.
struct Part {
    near: f64,
    far: f64,
    value: f64,
}

/// Optical depth and length so far, by volume and pixel of the light.
type Sums = Vec<Vec<[f64; 2]>>;

/// What light has come through: its image, the volumes' sums there, the splats.
type Carried<'c, 'a> = (&'c Image, &'c Sums, Option<&'c Splats<'a>>);

/// Draws all volumes, splats and polygons under all lights, extended ones as that many points, green extinction for all channels, without the shadows of others and without [`HalfInput::mapped`]. Time grows as voxels times
/// pixels times slabs under a kernel.
///
/// # Errors
/// Those of [`super::fold`], but for memory.
pub fn draw(input: &HalfInput<'_>, params: &HalfParams) -> Result<Picture, Error> {
    params.check()?;
    input.sheets.check()?;
    let mut out: Option<Picture> = None;
    for lit in &lights(input) {
        let own = of_light(input, params, (lit, out.is_none()))?;
        match &mut out {
            None => out = Some(own),
            Some(all) => all.color.iter_mut().zip(own.color).for_each(|(to, own)| (0..3).for_each(|c| to[c] += own[c])),
        }
    }
    let pixels = input.sheets.camera.size.map(|s| s as usize).iter().product();
    Ok(out.unwrap_or(Picture { optical_depth: vec![0.0; pixels], color: vec![[0.0; 3]; pixels] }))
}

/// The sweep of one light, mixed with another one where its half vector is about to turn over.
fn of_light(
    input: &HalfInput<'_>,
    params: &HalfParams,
    (lit, with_ambient): (&LitBy<'_>, bool),
) -> Result<Picture, Error> {
    let bodies = &input.bodies();
    let camera = input.sheets.camera;
    let axis = axis_of_view(bodies, camera, Some(&lit.light));
    let mut own = View::new(input, params, lit, &axis)?.draw(lit, with_ambient);
    if let Some((axis, share)) = other_axis(bodies, camera, (&lit.light, 1)) {
        let other = View::new(input, params, lit, &axis)?.draw(lit, with_ambient);
        let mix = |to: &mut f64, other: f64| *to += (other - *to) * f64::from(share);
        own.optical_depth.iter_mut().zip(other.optical_depth).for_each(|(to, other)| mix(to, other));
        own.color.iter_mut().flatten().zip(other.color.into_iter().flatten()).for_each(|(to, other)| mix(to, other));
    }
    Ok(own)
}

/// All lights that have sweeps, point by point.
fn lights<'a>(input: &HalfInput<'a>) -> Vec<LitBy<'a>> {
    let points = |e: &Extended<'a>| {
        let shadow = e.lit.shadow;
        e.lit.light.points(e.samples).into_iter().map(move |light| LitBy { slide: None, light, shadow })
    };
    input.sheets.lights.iter().copied().chain(input.extended.iter().flat_map(points)).collect()
}

impl<'a> View<'a> {
    fn new(
        input: &'a HalfInput<'a>,
        params: &'a HalfParams,
        lit: &LitBy<'_>,
        axis: &HalfVector,
    ) -> Result<Self, Error> {
        let volumes = &input.sheets.volumes[..];
        let frame = Frame::new(&input.bodies(), input.sheets.camera, &params.sheets, axis)?;
        let placed: Vec<Placed<'a>> = volumes.iter().map(|v| Placed::new(v, &frame, &params.sheets)).collect();
        let of = |placed: &Placed<'_>| {
            let volume = placed.volume;
            let most = [3, 3, 6];
            let lattice = Lattice::new(volume.grid, volume.packing, most);
            let [nx, ny, nz] = lattice.dims;
            let places = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
            let voxel = |at: [usize; 3]| {
                let p = placed.position(lattice.rim, at);
                (p.x, p.y, placed.place(p.z), f64::from(lattice.value(at[0], at[1], at[2])))
            };
            places.map(voxel).collect()
        };
        let voxels = placed.iter().map(of).collect();
        let kernel = params.sheets.kernel;
        let footprint = Footprint { cutoff: (kernel.extent / kernel.sigma) as f32 };
        let of_phases = |reach: f64| (0..PHASES).map(|phase| sections(phase, reach, &footprint)).collect();
        let sections = placed.iter().map(|placed| of_phases(placed.reach / frame.slabs.width)).collect();
        let polygons = Triangles::new(input.polygons);
        let diffuse = scatter::Diffuse::new(volumes, lit, params);
        Ok(Self { input, params, frame, placed, voxels, sections, polygons, diffuse })
    }

    fn image(&self, camera: Camera) -> Image {
        let sight = Sight::new(&self.frame, camera);
        Image { camera, shapes: self.placed.iter().map(|p| sight.shape(&self.frame, p)).collect(), ends: Vec::new() }
    }

    fn draw(&self, lit: &LitBy<'_>, with_ambient: bool) -> Picture {
        let camera = self.input.sheets.camera;
        let mut eye = self.image(*camera);
        let light = self.image(lamp::camera_of(&self.input.bodies(), &lit.light, self.params));
        let pixels = |camera: &Camera| camera.size.map(|s| s as usize).iter().product();
        let mut sums: Sums = vec![vec![[0.0; 2]; pixels(&light.camera)]; self.placed.len()];
        let n: usize = pixels(camera);
        let opaque = |at: usize| self.input.opaque.get(at).map_or(f64::INFINITY, |depth| f64::from(*depth));
        let seen = |at: usize| self.polygons.nearest(&eye, at).filter(|hit| hit.depth < opaque(at));
        let hits: Vec<Option<Hit>> = (0..n).map(seen).collect();
        eye.ends = hits.iter().enumerate().map(|(at, hit)| hit.map_or(opaque(at), |hit| hit.depth)).collect();
        let panes: Vec<Vec<Hit>> = (0..n).map(|at| self.polygons.before(&eye, at)).collect();
        let mut polygons = vec![[0.0; 3]; n];
        let mut splats = self.input.splats.as_ref().map(|splats| Splats::new(splats, self, &light));
        let mut out = Picture { optical_depth: vec![0.0; n], color: vec![[0.0; 3]; n] };
        // Of the slab before, the slab and the one behind.
        let mut around = [Vec::new(), self.voxels_of(0), self.voxels_of(1)];
        for slab in 0..self.frame.slabs.count {
            let mut shown = Vec::new();
            if let Some(splats) = &mut splats {
                splats.enter(slab, self, (&light, &sums), lit);
                shown = splats.radiance(slab, self, (lit, with_ambient));
            }
            let carried = (&light, &sums, splats.as_ref());
            for at in 0..n {
                let own: Vec<&Hit> = panes[at].iter().filter(|hit| self.slab_of(hit) == slab).collect();
                let fragments = self.parted(&own, (slab, carried, (lit, with_ambient)), |part| {
                    let own = self.fragment(&eye, carried, &around, (slab, at, lit, with_ambient), part);
                    splats.as_ref().map_or(own, |splats| splats.mix((&eye, at), &shown, (part, own)))
                });
                for fragment in fragments {
                    self.composite(fragment, (&mut out.optical_depth[at], &mut out.color[at]));
                }
            }
            self.light_polygons((&hits, slab), carried, (lit, with_ambient), &mut polygons);
            self.attenuate(&light, &around[1], slab, &mut sums);
            around.rotate_left(1);
            around[2] = self.voxels_of(slab + 2);
        }
        let last = self.frame.slabs.count;
        if let Some(splats) = &mut splats {
            splats.enter(last, self, (&light, &sums), lit);
        }
        let carried = (&light, &sums, splats.as_ref());
        self.light_polygons((&hits, last), carried, (lit, with_ambient), &mut polygons);
        self.add_behind(&panes, (last, carried, (lit, with_ambient)), &mut out);
        for (at, shown) in polygons.iter().enumerate() {
            let through = libm::exp(-out.optical_depth[at]);
            (0..3).for_each(|c| out.color[at][c] += through * shown[c]);
        }
        out
    }

    /// Adds a slab to a pixel of the eye.
    fn composite(&self, (tau, color): (f64, [f64; 3]), (optical_depth, sums): (&mut f64, &mut [f64; 3])) {
        let through = libm::exp(-*optical_depth);
        let opacity = -libm::expm1(-tau);
        for (sum, color) in sums.iter_mut().zip(color) {
            *sum = if self.frame.back_to_front {
                opacity * color + libm::exp(-tau) * *sum
            } else {
                *sum + through * opacity * color
            };
        }
        *optical_depth += tau;
    }

    /// Adds a slab to the light's image.
    fn attenuate(&self, light: &Image, voxels: &[Vec<Reaching>], slab: u32, sums: &mut Sums) {
        for (v, sums) in sums.iter_mut().enumerate() {
            for (at, sums) in sums.iter_mut().enumerate() {
                if let Some(part) = self.part(light, &voxels[v], v, slab, at) {
                    let length = (part.far - part.near) * self.stretch(&light.camera, at);
                    *sums = [sums[0] + self.extinction(v, part.value) * length, sums[1] + length];
                }
            }
        }
    }

    /// Voxels whose kernels reach a slab or one of its neighbours.
    fn voxels_of(&self, slab: u32) -> Vec<Vec<Reaching>> {
        let of = |(sections, voxels): (&Vec<Vec<f64>>, &Vec<Voxel>)| {
            let around = |place: u32| {
                let all = &sections[(place % PHASES) as usize];
                let of = |slab: u32| slab.checked_sub(place / PHASES).and_then(|behind| all.get(behind as usize));
                let three = [slab.checked_sub(1).and_then(of), of(slab), of(slab + 1)];
                three.iter().any(Option::is_some).then(|| three.map(|section| section.copied().unwrap_or(0.0)))
            };
            voxels.iter().filter_map(|(a, b, place, v)| Some((*a, *b, around(*place)?, *v))).collect()
        };
        self.sections.iter().zip(&self.voxels).map(of).collect()
    }

    fn ray(&self, camera: &Camera, at: usize) -> Ray {
        let width = camera.size[0] as usize;
        self.frame.ray(camera, (at % width) as f64 + 0.5, (at / width) as f64 + 0.5)
    }

    /// Length of a pixel's ray per depth across the slabs.
    fn stretch(&self, camera: &Camera, at: usize) -> f64 {
        let ray = self.ray(camera, at);
        (ray.along / ray.along.z).length()
    }

    fn extinction(&self, v: usize, value: f64) -> f64 {
        let volume = self.placed[v].volume;
        let own = f64::from(volume.transfer.at(value as f32).extinction) * volume.extinction_scale;
        own * f64::from(volume.material.extinction_rgb[1])
    }

    /// Depths across the slabs between which a ray is in the cells of a volume, before the eye.
    fn crossing(&self, volume: &Volume<'_>, image: &Image, at: usize) -> Option<[f64; 2]> {
        let ray = self.ray(&image.camera, at);
        let inverse = self.frame.steps(volume).inverse();
        let origin = self.frame.point(volume.origin());
        let [near, far] = clip(volume, inverse * (ray.from - origin), inverse * ray.along)?;
        let ends = [near, far.min(image.ends.get(at).copied().unwrap_or(f64::INFINITY))];
        let [one, other] = ends.map(|z| ray.from.z + ray.along.z * z.max(0.0));
        (ends[1] > ends[0].max(0.0)).then(|| [one.min(other), one.max(other)])
    }

    /// What a pixel's ray has of a volume in a slab.
    fn part(&self, image: &Image, voxels: &[Reaching], v: usize, slab: u32, at: usize) -> Option<Part> {
        let width = self.frame.slabs.width;
        let [near, far] = self.crossing(self.placed[v].volume, image, at)?;
        let near = near.max(f64::from(slab) * width);
        let far = far.min(f64::from(slab + 1) * width);
        if far <= near {
            return None;
        }
        let q = self.place(&image.camera, at, 0.5 * (near + far));
        // How many slabs it lies behind the slab's middle, which sections stand for.
        let behind = q.z / width - (f64::from(slab) + 0.5);
        let footprint = Footprint { cutoff: self.placed[v].cutoff as f32 };
        let [aa, ab, bb] = image.shapes[v].extent();
        let mut sum = 0.0;
        let mut weights = 0.0;
        for (a, b, [before, own, after], value) in voxels {
            let da = q.x - a;
            let db = q.y - b;
            let s = (bb * da * da - 2.0 * ab * da * db + aa * db * db) / (aa * bb - ab * ab);
            let section = own + behind.max(0.0) * (after - own) + (-behind).max(0.0) * (before - own);
            let weight = footprint.profile(s) * section;
            (sum, weights) = (sum + weight * value, weights + weight);
        }
        (weights > 1e-12).then(|| Part { near, far, value: sum / weights })
    }

    /// Slab coordinates of a pixel's ray at a depth across the slabs.
    fn place(&self, camera: &Camera, at: usize, depth: f64) -> DVec3 {
        let ray = self.ray(camera, at);
        ray.from + ray.along * ((depth - ray.from.z) / ray.along.z)
    }

    /// Optical depth of a pixel in a slab between two depths, and its radiance.
    fn fragment(
        &self,
        eye: &Image,
        (light, sums, splats): Carried<'_, '_>,
        around: &[Vec<Vec<Reaching>>; 3],
        (slab, at, lit, with_ambient): (u32, usize, &LitBy<'_>, bool),
        [low, high]: [f64; 2],
    ) -> (f64, [f64; 3]) {
        let voxels = &around[1];
        // All parts of a slab have its value.
        let cut = |part: Part| Part { near: part.near.max(low), far: part.far.min(high), ..part };
        let part = |v: usize| self.part(eye, &voxels[v], v, slab, at).map(cut).filter(|part| part.near < part.far);
        let parts: Vec<Option<Part>> = (0..self.placed.len()).map(part).collect();
        let extinction: Vec<f64> = parts
            .iter()
            .enumerate()
            .map(|(v, part)| part.as_ref().map_or(0.0, |part| self.extinction(v, part.value)))
            .collect();
        let shown = || parts.iter().zip(&extinction).filter(|(_, e)| **e > 0.0).filter_map(|(part, _)| part.as_ref());
        let near = shown().map(|part| part.near).fold(f64::INFINITY, f64::min);
        let far = shown().map(|part| part.far).fold(f64::NEG_INFINITY, f64::max);
        if near >= far {
            return (0.0, [0.0; 3]);
        }
        let stretch = self.stretch(&eye.camera, at);
        let tau = |v: usize| parts[v].as_ref().map_or(0.0, |part| extinction[v] * (part.far - part.near) * stretch);
        let all: f64 = (0..parts.len()).map(tau).sum();
        let ends = if self.frame.back_to_front { [far, near] } else { [near, far] };
        let [first, last] = ends.map(|depth| self.place(&eye.camera, at, depth));
        let middle = 0.5 * (first + last);
        let means = self.means(light, sums, middle, &extinction);
        let before = splats.map_or(0.0, |splats| splats.before(self, light, (middle, slab))[0]);
        let mut arrives = 0.0;
        for n in 0..STEPS {
            let x = (n as f64 + 0.5) / STEPS as f64;
            let place = first + (last - first) * x;
            let seen = self.polygons.through(&lit.light, self.frame.world(place), None);
            if seen == 0.0 {
                continue;
            }
            let way = before + self.light_depth(&lit.light, place, slab, &means, &extinction);
            arrives += seen * all * libm::exp(-all * x - way) / STEPS as f64;
        }
        let mean = arrives / -libm::expm1(-all);
        let mut color = [0.0; 3];
        for v in (0..parts.len()).filter(|v| tau(*v) > 0.0) {
            let normal = self.normal((eye, around), (v, slab, at), middle);
            let seen = first + (last - first) * f64::from(mean_depth(all as f32));
            let own = self.radiance(v, (&parts[v], normal), ([middle, seen], at), lit, (mean, with_ambient));
            (0..3).for_each(|c| color[c] += own[c] * tau(v) / all);
        }
        (all, color)
    }

    /// The four pixels of the light about a place, and their weights; at a border those inside.
    fn around(&self, light: &Image, at: DVec3) -> [(usize, f64); 4] {
        let camera = &light.camera;
        let view = camera.view_from_world(self.frame.world(at));
        let scale = camera.focal_px() / if camera.is_orthographic() { 1.0 } else { view.z };
        let [width, height] = camera.size.map(|s| s as usize);
        let clamp = |v: f64, n: usize| (v - 0.5).clamp(0.0, n as f64 - 1.0);
        let x = clamp(0.5 * width as f64 + view.x * scale, width);
        let y = clamp(0.5 * height as f64 - view.y * scale, height);
        let i = (x as usize).min(width - 2);
        let j = (y as usize).min(height - 2);
        let u = x - i as f64;
        let v = y - j as f64;
        [(i, j, (1.0 - u) * (1.0 - v)), (i + 1, j, u * (1.0 - v)), (i, j + 1, (1.0 - u) * v), (i + 1, j + 1, u * v)]
            .map(|(i, j, weight)| (j * width + i, weight))
    }

    /// Mean extinctions on the way of light to the present slab, by volume.
    fn means(&self, light: &Image, sums: &Sums, at: DVec3, extinction: &[f64]) -> Vec<f64> {
        let around = self.around(light, at);
        let mean = |(sums, own): (&Vec<[f64; 2]>, &f64)| {
            let [tau, length] = [0, 1].map(|n| around.iter().map(|(at, weight)| weight * sums[*at][n]).sum::<f64>());
            if length > 0.0 { tau / length } else { *own }
        };
        sums.iter().zip(extinction).map(mean).collect()
    }

    /// Optical depth of the volumes on the way of light to a place in a slab, in which the extinction amidst that way counts.
    fn through_volumes(&self, (light, sums): (&Image, &Sums), lamp: &Light, (place, slab): (DVec3, u32)) -> f64 {
        let world = self.frame.world(place);
        let back = -super::serves::travel(lamp, world);
        let begins = (place.z - f64::from(slab) * self.frame.slabs.width).max(0.0) / -self.frame.direction(back).z;
        let own = |volume: &Volume<'_>| {
            let inverse = volume.axes().inverse();
            let way = clip(volume, inverse * (world - volume.origin()), inverse * back);
            let amidst = way.map_or(0.0, |[leaves, enters]| {
                let leaves = leaves.max(0.0);
                leaves + 0.5 * (enters.min(begins) - leaves).max(0.0)
            });
            volume.extinction_at(world + back * amidst) * f64::from(volume.material.extinction_rgb[1])
        };
        let extinction: Vec<f64> = self.placed.iter().map(|placed| own(placed.volume)).collect();
        let means = self.means(light, sums, place, &extinction);
        self.light_depth(lamp, place, slab, &means, &extinction)
    }

    /// Optical depth towards the light at a place in a slab.
    fn light_depth(&self, light: &Light, at: DVec3, slab: u32, means: &[f64], extinction: &[f64]) -> f64 {
        let world = self.frame.world(at);
        let back = -super::serves::travel(light, world);
        let own = (at.z - f64::from(slab) * self.frame.slabs.width).max(0.0) / -self.frame.direction(back).z;
        let mut sum = 0.0;
        for (v, placed) in self.placed.iter().enumerate() {
            let volume = placed.volume;
            if !volume.casts_shadow {
                continue;
            }
            let inverse = volume.axes().inverse();
            let Some([leaves, enters]) = clip(volume, inverse * (world - volume.origin()), inverse * back) else {
                continue;
            };
            let leaves = leaves.max(0.0);
            sum += means[v] * (enters - leaves.max(own)).max(0.0);
            sum += extinction[v] * (enters.min(own) - leaves).max(0.0);
        }
        sum
    }

    fn radiance(
        &self,
        v: usize,
        (part, normal): (&Option<Part>, Vec3),
        ([at, seen], pixel): ([DVec3; 2], usize),
        lit: &LitBy<'_>,
        (mean, with_ambient): (f64, bool),
    ) -> [f64; 3] {
        let volume = self.placed[v].volume;
        let camera = self.input.sheets.camera;
        let value = part.as_ref().map_or(0.0, |part| part.value);
        let [right, up, forward] = camera.axes;
        let width = camera.size[0] as usize;
        let (_, along) = camera.view_ray((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        let point = Point {
            position: self.frame.world(at),
            radius: self.placed[v].reach as f32,
            normal,
            to_eye: -(right * along.x + up * along.y + forward * along.z).normalize().as_vec3(),
            color: volume.transfer.at(value as f32).color,
            material: volume.material,
        };
        let share = (1.0 - f64::from(volume.shadow_coefficient) * (1.0 - mean)) as f32;
        let radiance = point.radiance(self.input.sheets.ambient, std::iter::once(lit), |_, _| [share; 3]);
        let [ambient, emission, direct, scatter] = radiance.effects();
        let others = if with_ambient { 1.0 } else { 0.0 };
        let more =
            |d: &scatter::Diffuse| d.radiance(volume, &lit.light, self.frame.world(seen), point.to_eye, point.color);
        let more = self.diffuse.as_ref().map_or([0.0; 3], more);
        [0, 1, 2].map(|c| f64::from(others * (ambient[c] + emission[c]) + direct[c] + scatter[c]) + more[c])
    }
}

/// Between which multiples of `step` a line from `start`, in lattice coordinates, is in the cells of a volume and not cut away.
fn clip(volume: &Volume<'_>, start: DVec3, step: DVec3) -> Option<[f64; 2]> {
    let mut near = f64::NEG_INFINITY;
    let mut far = f64::INFINITY;
    for (normal, offset) in volume.planes() {
        let depth = offset - normal.dot(start);
        let leaves = normal.dot(step);
        if leaves.abs() < 1e-12 * step.length() {
            if depth < -1e-9 {
                return None;
            }
        } else if leaves > 0.0 {
            far = far.min(depth / leaves);
        } else {
            near = near.max(depth / leaves);
        }
    }
    let [lowest, highest] = volume.ends();
    for a in 0..3 {
        let low = lowest[a] - start[a];
        let high = highest[a] - start[a];
        if step[a].abs() < 1e-12 * step.length() {
            if low > 1e-9 || high < -1e-9 {
                return None;
            }
            continue;
        }
        let one = low / step[a];
        let other = high / step[a];
        (near, far) = (near.max(one.min(other)), far.min(one.max(other)));
    }
    (near < far).then_some([near, far])
}
