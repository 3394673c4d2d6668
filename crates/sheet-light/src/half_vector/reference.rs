//! The slow form in f64: the same sheets pixel by pixel, voxel by voxel, without bands, buckets, vectors, bounds or skipped voxels,
//! and light on the way through a slab summed step by step.
//!
//! Normals are those of `normal.rs`, splats those of `splats.rs`, polygons those of `polygons.rs`. Light that is scattered more than once is that of
//! `scatter.rs`, of volumes alone.

mod normal;
mod polygons;
mod scatter;
mod splats;

use super::input::{Extended, HalfInput};
use super::light::camera::camera_of;
use super::params::HalfParams;
use super::sampled_light::SampledLight;
use crate::half_vector::eye::sheets::mean_depth;
use crate::half_vector::slicing::axis::HalfVector;
use crate::half_vector::slicing::frame::{Frame, Ray};
use crate::half_vector::slicing::placed::Placed;
use crate::half_vector::slicing::serves::{axis_of_view, other_axis};
use crate::half_vector::slicing::sight::{Shape, Sight};
use crate::image_aligned::reference::Picture;
use crate::shared::gathered::exact::Exact;
use crate::shared::lattice::Lattice;
use crate::shared::params::Reconstruction;
use crate::shared::sections::{PHASES, sections};
use crate::{Error, Volume};
use polygons::{Hit, Triangles};
use splat_core::glam::{DVec2, DVec3, Vec3};
use splat_core::shade::{LitBy, Point};
use splat_core::{Camera, Footprint, Light};
use splats::Splats;

/// Steps on the way of a ray through a slab.
const STEPS: usize = 200;

/// A voxel.
struct Voxel {
    /// Slab coordinates along the slabs.
    center: DVec2,
    /// Where its kernel begins, 256ths of a slab.
    place: u32,
    value: f64,
}

/// A voxel that reaches a slab or one of its neighbours.
struct Reaching {
    center: DVec2,
    value: f64,
    /// Its sections in the slab before, the slab and the one behind.
    before: f64,
    here: f64,
    after: f64,
}

/// Voxels that reach the slab before, a slab and the one behind, by volume.
struct SlabVoxels {
    before: Vec<Vec<Reaching>>,
    here: Vec<Vec<Reaching>>,
    after: Vec<Vec<Reaching>>,
}

/// What is the same for all slabs.
struct View<'a> {
    input: &'a HalfInput<'a>,
    params: &'a HalfParams,
    frame: Frame,
    placed: Vec<Placed<'a>>,
    voxels: Vec<Vec<Voxel>>,
    /// Lattices that pixels read, by volume; or nothing.
    gathered: Vec<Exact>,
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

/// What light has come through.
#[derive(Clone, Copy)]
struct Carried<'c, 'a> {
    light: &'c Image,
    /// Those of the volumes in the light's image.
    sums: &'c Sums,
    splats: Option<&'c Splats<'a>>,
}

/// The light of a sweep.
#[derive(Clone, Copy)]
struct Lamp<'l, 'a> {
    lit: &'l LitBy<'a>,
    /// Whether ambient and emitted light are added.
    with_ambient: bool,
}

/// What a pixel has of something.
#[derive(Debug, Clone, Copy, Default)]
struct Fragment {
    optical_depth: f64,
    color: [f64; 3],
}

/// Depths across the slabs, from one to another.
#[derive(Debug, Clone, Copy)]
struct Between {
    low: f64,
    high: f64,
}

/// A pixel of an image with its share in a mean.
struct WeightedPixel {
    pixel: usize,
    weight: f64,
}

/// Draws all volumes, splats and polygons under all lights, extended ones as that many points, green extinction for all channels, without the shadows of others and without [`HalfInput::mapped`]. Time grows as voxels times
/// pixels times slabs under a kernel.
///
/// # Errors
/// Those of [`crate::half_vector::fold`], but for memory.
pub fn draw(input: &HalfInput<'_>, params: &HalfParams) -> Result<Picture, Error> {
    params.check()?;
    input.sheets.check()?;
    let mut out: Option<Picture> = None;
    for lit in &lights(input) {
        let swept = sweep(input, params, Lamp { lit, with_ambient: out.is_none() })?;
        match &mut out {
            None => out = Some(swept),
            Some(sum) => {
                sum.color.iter_mut().zip(swept.color).for_each(|(to, from)| (0..3).for_each(|c| to[c] += from[c]));
            }
        }
    }
    let pixels = input.sheets.camera.size.map(|s| s as usize).iter().product();
    Ok(out.unwrap_or(Picture { optical_depth: vec![0.0; pixels], color: vec![[0.0; 3]; pixels] }))
}

/// The sweep of one light, mixed with another one where its half vector is about to turn over.
fn sweep(input: &HalfInput<'_>, params: &HalfParams, lamp: Lamp<'_, '_>) -> Result<Picture, Error> {
    let bodies = &input.bodies();
    let camera = input.sheets.camera;
    let light = &lamp.lit.light;
    let axis = axis_of_view(bodies, camera, Some(light));
    let mut out = View::new(input, params, lamp.lit, &axis)?.draw(lamp);
    if let Some((axis, share)) = other_axis(bodies, camera, SampledLight { light, samples: 1 }) {
        let other = View::new(input, params, lamp.lit, &axis)?.draw(lamp);
        let mix = |to: &mut f64, other: f64| *to += (other - *to) * f64::from(share);
        out.optical_depth.iter_mut().zip(other.optical_depth).for_each(|(to, other)| mix(to, other));
        out.color.iter_mut().flatten().zip(other.color.into_iter().flatten()).for_each(|(to, other)| mix(to, other));
    }
    Ok(out)
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
        let voxels_of = |placed: &Placed<'_>| {
            let volume = placed.volume;
            let most = [3, 3, 6];
            let lattice = Lattice::new(volume.grid, volume.packing, most);
            let [nx, ny, nz] = lattice.dims;
            let places = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
            let voxel = |index: [usize; 3]| {
                let p = placed.position(lattice.rim, index);
                let value = f64::from(lattice.value(index[0], index[1], index[2]));
                Voxel { center: p.truncate(), place: placed.place(p.z), value }
            };
            places.map(voxel).collect()
        };
        let voxels = placed.iter().map(voxels_of).collect();
        let kernel = params.sheets.kernel;
        let footprint = Footprint { cutoff: (kernel.extent / kernel.sigma) as f32 };
        let of_phases = |reach: f64| (0..PHASES).map(|phase| sections(phase, reach, &footprint)).collect();
        let sections = placed.iter().map(|placed| of_phases(placed.reach / frame.slabs.width)).collect();
        let polygons = Triangles::new(input.polygons);
        let diffuse = scatter::Diffuse::new(volumes, lit, params);
        let gathered = match params.sheets.reconstruction {
            Reconstruction::Splat => Vec::new(),
            Reconstruction::Gather(kernel) => volumes.iter().map(|volume| Exact::new(volume, kernel)).collect(),
        };
        Ok(Self { input, params, frame, placed, voxels, gathered, sections, polygons, diffuse })
    }

    fn image(&self, camera: Camera) -> Image {
        let sight = Sight::new(&self.frame, camera);
        Image { camera, shapes: self.placed.iter().map(|p| sight.shape(&self.frame, p)).collect(), ends: Vec::new() }
    }

    fn draw(&self, lamp: Lamp<'_, '_>) -> Picture {
        let lit = lamp.lit;
        let camera = self.input.sheets.camera;
        let mut eye = self.image(*camera);
        let light = self.image(camera_of(&self.input.bodies(), &lit.light, self.params));
        let pixels = |camera: &Camera| camera.size.map(|s| s as usize).iter().product();
        let mut sums: Sums = vec![vec![[0.0; 2]; pixels(&light.camera)]; self.placed.len()];
        let n: usize = pixels(camera);
        let opaque = |pixel: usize| self.input.opaque.get(pixel).map_or(f64::INFINITY, |depth| f64::from(*depth));
        let seen = |pixel: usize| self.polygons.nearest(&eye, pixel).filter(|hit| hit.depth < opaque(pixel));
        let hits: Vec<Option<Hit>> = (0..n).map(seen).collect();
        eye.ends = hits.iter().enumerate().map(|(pixel, hit)| hit.map_or(opaque(pixel), |hit| hit.depth)).collect();
        let panes: Vec<Vec<Hit>> = (0..n).map(|pixel| self.polygons.before(&eye, pixel)).collect();
        let mut polygons = vec![[0.0; 3]; n];
        let mut splats = self.input.splats.as_ref().map(|splats| Splats::new(splats, self, &light));
        let mut out = Picture { optical_depth: vec![0.0; n], color: vec![[0.0; 3]; n] };
        let mut around = SlabVoxels { before: Vec::new(), here: self.voxels_of(0), after: self.voxels_of(1) };
        for slab in 0..self.frame.slabs.count {
            let mut shown = Vec::new();
            if let Some(splats) = &mut splats {
                splats.enter(slab, self, &light, &sums, lit);
                shown = splats.radiance(slab, self, lamp);
            }
            let carried = Carried { light: &light, sums: &sums, splats: splats.as_ref() };
            for pixel in 0..n {
                let hits: Vec<&Hit> = panes[pixel].iter().filter(|hit| self.slab_of(hit) == slab).collect();
                let fragments = self.parted(&hits, slab, carried, lamp, |part| {
                    let volumes = self.fragment(&eye, carried, &around, slab, pixel, lamp, part);
                    splats.as_ref().map_or(volumes, |splats| splats.mix(&eye, pixel, &shown, part, volumes))
                });
                for fragment in fragments {
                    self.composite(fragment, pixel, &mut out);
                }
            }
            self.light_polygons(&hits, slab, carried, lamp, &mut polygons);
            self.attenuate(&light, &around.here, slab, &mut sums);
            around = SlabVoxels { before: around.here, here: around.after, after: self.voxels_of(slab + 2) };
        }
        let last = self.frame.slabs.count;
        if let Some(splats) = &mut splats {
            splats.enter(last, self, &light, &sums, lit);
        }
        let carried = Carried { light: &light, sums: &sums, splats: splats.as_ref() };
        self.light_polygons(&hits, last, carried, lamp, &mut polygons);
        self.add_behind(&panes, last, carried, lamp, &mut out);
        for (pixel, shown) in polygons.iter().enumerate() {
            let through = libm::exp(-out.optical_depth[pixel]);
            (0..3).for_each(|c| out.color[pixel][c] += through * shown[c]);
        }
        out
    }

    /// Adds a fragment to a pixel of the eye.
    fn composite(&self, fragment: Fragment, pixel: usize, out: &mut Picture) {
        let tau = fragment.optical_depth;
        let through = libm::exp(-out.optical_depth[pixel]);
        let opacity = -libm::expm1(-tau);
        for (sum, color) in out.color[pixel].iter_mut().zip(fragment.color) {
            *sum = if self.frame.back_to_front {
                opacity * color + libm::exp(-tau) * *sum
            } else {
                *sum + through * opacity * color
            };
        }
        out.optical_depth[pixel] += tau;
    }

    /// Adds a slab to the light's image.
    fn attenuate(&self, light: &Image, voxels: &[Vec<Reaching>], slab: u32, sums: &mut Sums) {
        for (v, sums) in sums.iter_mut().enumerate() {
            for (pixel, sums) in sums.iter_mut().enumerate() {
                if let Some(part) = self.part(light, &voxels[v], v, slab, pixel) {
                    let length = (part.far - part.near) * self.stretch(&light.camera, pixel);
                    *sums = [sums[0] + self.extinction(v, part.value) * length, sums[1] + length];
                }
            }
        }
    }

    /// Voxels whose kernels reach a slab or one of its neighbours.
    fn voxels_of(&self, slab: u32) -> Vec<Vec<Reaching>> {
        let of_volume = |(sections, voxels): (&Vec<Vec<f64>>, &Vec<Voxel>)| {
            let reaching = |voxel: &Voxel| {
                let Voxel { center, place, value } = *voxel;
                let of_phase = &sections[(place % PHASES) as usize];
                let section = |slab: u32| slab.checked_sub(place / PHASES).and_then(|n| of_phase.get(n as usize));
                let three = [slab.checked_sub(1).and_then(section), section(slab), section(slab + 1)];
                let reaches = three.iter().any(Option::is_some);
                let [before, here, after] = three.map(|section| section.copied().unwrap_or(0.0));
                reaches.then_some(Reaching { center, value, before, here, after })
            };
            voxels.iter().filter_map(reaching).collect()
        };
        self.sections.iter().zip(&self.voxels).map(of_volume).collect()
    }

    fn ray(&self, camera: &Camera, pixel: usize) -> Ray {
        let width = camera.size[0] as usize;
        self.frame.ray(camera, (pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5)
    }

    /// Length of a pixel's ray per depth across the slabs.
    fn stretch(&self, camera: &Camera, pixel: usize) -> f64 {
        let ray = self.ray(camera, pixel);
        (ray.along / ray.along.z).length()
    }

    fn extinction(&self, v: usize, value: f64) -> f64 {
        let volume = self.placed[v].volume;
        let extinction = f64::from(volume.transfer.at(value as f32).extinction) * volume.extinction_scale;
        extinction * f64::from(volume.material.extinction_rgb[1])
    }

    /// Depths across the slabs between which a ray is in the cells of a volume, before the eye.
    fn crossing(&self, volume: &Volume<'_>, image: &Image, pixel: usize) -> Option<[f64; 2]> {
        let ray = self.ray(&image.camera, pixel);
        let inverse = self.frame.steps(volume).inverse();
        let origin = self.frame.point(volume.origin());
        let [near, far] = clip(volume, inverse * (ray.from - origin), inverse * ray.along)?;
        let ends = [near, far.min(image.ends.get(pixel).copied().unwrap_or(f64::INFINITY))];
        let [one, other] = ends.map(|z| ray.from.z + ray.along.z * z.max(0.0));
        (ends[1] > ends[0].max(0.0)).then(|| [one.min(other), one.max(other)])
    }

    /// What a pixel's ray has of a volume in a slab.
    fn part(&self, image: &Image, voxels: &[Reaching], v: usize, slab: u32, pixel: usize) -> Option<Part> {
        let width = self.frame.slabs.width;
        let [near, far] = self.crossing(self.placed[v].volume, image, pixel)?;
        let near = near.max(f64::from(slab) * width);
        let far = far.min(f64::from(slab + 1) * width);
        if far <= near {
            return None;
        }
        let q = self.place(&image.camera, pixel, 0.5 * (near + far));
        if let Some(gathered) = self.gathered.get(v) {
            let placed = &self.placed[v];
            return Some(Part { near, far, value: gathered.at(placed.axes.inverse() * (q - placed.start)) });
        }
        // How many slabs it lies behind the slab's middle, which sections stand for.
        let behind = q.z / width - (f64::from(slab) + 0.5);
        let footprint = Footprint { cutoff: self.placed[v].cutoff as f32 };
        let [aa, ab, bb] = image.shapes[v].extent();
        let mut sum = 0.0;
        let mut weights = 0.0;
        for Reaching { center, value, before, here, after } in voxels {
            let da = q.x - center.x;
            let db = q.y - center.y;
            let s = (bb * da * da - 2.0 * ab * da * db + aa * db * db) / (aa * bb - ab * ab);
            let section = here + behind.max(0.0) * (after - here) + (-behind).max(0.0) * (before - here);
            let weight = footprint.profile(s) * section;
            (sum, weights) = (sum + weight * value, weights + weight);
        }
        (weights > 1e-12).then(|| Part { near, far, value: sum / weights })
    }

    /// Slab coordinates of a pixel's ray at a depth across the slabs.
    fn place(&self, camera: &Camera, pixel: usize, depth: f64) -> DVec3 {
        let ray = self.ray(camera, pixel);
        ray.from + ray.along * ((depth - ray.from.z) / ray.along.z)
    }

    /// Optical depth of a pixel in a slab between two depths, and its radiance.
    fn fragment(
        &self,
        eye: &Image,
        carried: Carried<'_, '_>,
        around: &SlabVoxels,
        slab: u32,
        pixel: usize,
        lamp: Lamp<'_, '_>,
        part: Between,
    ) -> Fragment {
        let Carried { light, sums, splats } = carried;
        let lit = lamp.lit;
        let Between { low, high } = part;
        let voxels = &around.here;
        // All parts of a slab have its value.
        let cut = |part: Part| Part { near: part.near.max(low), far: part.far.min(high), ..part };
        let part = |v: usize| self.part(eye, &voxels[v], v, slab, pixel).map(cut).filter(|part| part.near < part.far);
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
            return Fragment::default();
        }
        let stretch = self.stretch(&eye.camera, pixel);
        let tau = |v: usize| parts[v].as_ref().map_or(0.0, |part| extinction[v] * (part.far - part.near) * stretch);
        let whole: f64 = (0..parts.len()).map(tau).sum();
        let ends = if self.frame.back_to_front { [far, near] } else { [near, far] };
        let [first, last] = ends.map(|depth| self.place(&eye.camera, pixel, depth));
        let middle = 0.5 * (first + last);
        let means = self.means(light, sums, middle, &extinction);
        let before = splats.map_or(0.0, |splats| splats.before(self, light, middle, slab)[0]);
        let mut arrives = 0.0;
        for n in 0..STEPS {
            let x = (n as f64 + 0.5) / STEPS as f64;
            let place = first + (last - first) * x;
            let seen = self.polygons.through(&lit.light, self.frame.world(place), None);
            if seen == 0.0 {
                continue;
            }
            let way = before + self.light_depth(&lit.light, place, slab, &means, &extinction);
            arrives += seen * whole * libm::exp(-whole * x - way) / STEPS as f64;
        }
        let mean = arrives / -libm::expm1(-whole);
        let mut color = [0.0; 3];
        for v in (0..parts.len()).filter(|v| tau(*v) > 0.0) {
            let normal = self.normal(eye, around, v, slab, pixel, middle);
            let seen = first + (last - first) * f64::from(mean_depth(whole as f32));
            let value = parts[v].as_ref().map_or(0.0, |part| part.value);
            let point = self.point(v, value, normal, middle, pixel);
            let radiance = self.radiance(v, &point, seen, lamp, mean);
            (0..3).for_each(|c| color[c] += radiance[c] * tau(v) / whole);
        }
        Fragment { optical_depth: whole, color }
    }

    /// The four pixels of the light about a place, and their weights; at a border those inside.
    fn around(&self, light: &Image, place: DVec3) -> [WeightedPixel; 4] {
        let camera = &light.camera;
        let view = camera.view_from_world(self.frame.world(place));
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
            .map(|(i, j, weight)| WeightedPixel { pixel: j * width + i, weight })
    }

    /// Mean extinctions on the way of light to the present slab, by volume.
    fn means(&self, light: &Image, sums: &Sums, place: DVec3, extinction: &[f64]) -> Vec<f64> {
        let around = self.around(light, place);
        let mean = |(sums, extinction): (&Vec<[f64; 2]>, &f64)| {
            let [tau, length] =
                [0, 1].map(|n| around.iter().map(|near| near.weight * sums[near.pixel][n]).sum::<f64>());
            if length > 0.0 { tau / length } else { *extinction }
        };
        sums.iter().zip(extinction).map(mean).collect()
    }

    /// Optical depth of the volumes on the way of light to a place in a slab, in which the extinction amidst that way counts.
    fn through_volumes(&self, light: &Image, sums: &Sums, lamp: &Light, place: DVec3, slab: u32) -> f64 {
        let world = self.frame.world(place);
        let back = -crate::half_vector::slicing::serves::travel(lamp, world);
        let begins = (place.z - f64::from(slab) * self.frame.slabs.width).max(0.0) / -self.frame.direction(back).z;
        let extinction_of = |volume: &Volume<'_>| {
            let inverse = volume.axes().inverse();
            let way = clip(volume, inverse * (world - volume.origin()), inverse * back);
            let amidst = way.map_or(0.0, |[leaves, enters]| {
                let leaves = leaves.max(0.0);
                leaves + 0.5 * (enters.min(begins) - leaves).max(0.0)
            });
            volume.extinction_at(world + back * amidst) * f64::from(volume.material.extinction_rgb[1])
        };
        let extinction: Vec<f64> = self.placed.iter().map(|placed| extinction_of(placed.volume)).collect();
        let means = self.means(light, sums, place, &extinction);
        self.light_depth(lamp, place, slab, &means, &extinction)
    }

    /// Optical depth towards the light at a place in a slab.
    fn light_depth(&self, light: &Light, place: DVec3, slab: u32, means: &[f64], extinction: &[f64]) -> f64 {
        let world = self.frame.world(place);
        let back = -crate::half_vector::slicing::serves::travel(light, world);
        let in_slab = (place.z - f64::from(slab) * self.frame.slabs.width).max(0.0) / -self.frame.direction(back).z;
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
            sum += means[v] * (enters - leaves.max(in_slab)).max(0.0);
            sum += extinction[v] * (enters.min(in_slab) - leaves).max(0.0);
        }
        sum
    }

    /// A place of a volume, slab coordinates, as a pixel of the eye sees it.
    fn point(&self, v: usize, value: f64, normal: Vec3, place: DVec3, pixel: usize) -> Point<'a> {
        let volume = self.placed[v].volume;
        let camera = self.input.sheets.camera;
        let [right, up, forward] = camera.axes;
        let width = camera.size[0] as usize;
        let (_, along) = camera.view_ray((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        Point {
            position: self.frame.world(place),
            radius: self.placed[v].reach as f32,
            normal,
            to_eye: -(right * along.x + up * along.y + forward * along.z).normalize().as_vec3(),
            color: volume.transfer.at(value as f32).color,
            material: volume.material,
        }
    }

    /// Radiance of a point of a volume, of which the share `mean` of the light arrives; light that is scattered more than once is that of
    /// the place `seen`.
    fn radiance(&self, v: usize, point: &Point<'_>, seen: DVec3, lamp: Lamp<'_, '_>, mean: f64) -> [f64; 3] {
        let Lamp { lit, with_ambient } = lamp;
        let volume = self.placed[v].volume;
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
