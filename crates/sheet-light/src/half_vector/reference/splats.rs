//! Splats of a sweep: each whole in the slab of its centre, lit by what lies before it in the light's image, pixel by pixel.
//!
//! Footprints in both images, and where a splat asks for light, are the functions of the fast form; discs and media without images, special
//! discs and Gaussians, and without what hides them from the eye.

use super::{Between, Fragment, Image, Lamp, Sums, View, WeightedPixel};
use crate::half_vector::input::HalfSplats;
use crate::half_vector::splats::light::asks_at;
use splat_core::glam::DVec3;
use splat_core::raster::Projected;
use splat_core::shade::{LitBy, ShadeInput, shade_splat};
use splat_core::{Receiver, SplatKind, Transmittance};

/// The splats, and what is known of them.
pub(super) struct Splats<'a> {
    splats: HalfSplats<'a>,
    /// Slab coordinates of the centres; their slabs.
    places: Vec<DVec3>,
    slabs: Vec<u32>,
    /// Where each asks for light, in slabs.
    asks: Vec<f64>,
    /// Share of the light that comes to each.
    through: Vec<f32>,
    seen_by_light: Projected,
    /// By pixel of the light: optical depth of the slabs before, that of the present one, and its depths in the slab times it.
    pixels: Vec<[f64; 3]>,
}

/// What is carried to splats, and what all else lets through.
struct Carried<'a> {
    through: &'a [f32],
    others: Option<&'a dyn Transmittance>,
}

impl Transmittance for Carried<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        self.others.map_or([1.0; 3], |others| others.transmittance(receiver))
    }

    fn at_splat(&self, splat: usize, receiver: &Receiver) -> [f32; 3] {
        self.transmittance(receiver).map(|t| t * self.through[splat])
    }
}

/// A splat, and the radiance that it shows.
pub(super) struct ShownSplat {
    /// Its place in the cloud.
    id: usize,
    radiance: [f64; 3],
}

impl<'a> Splats<'a> {
    pub(super) fn new(splats: &HalfSplats<'a>, view: &View<'_>, light: &Image) -> Self {
        let cloud = splats.cloud;
        let frame = &view.frame;
        let camera = &light.camera;
        let world = |p: &splat_core::glam::Vec3| cloud.origin + p.as_dvec3();
        let places: Vec<DVec3> = cloud.position.iter().map(|p| frame.point(world(p))).collect();
        let slab = |depth: f64| ((depth / frame.slabs.width).max(0.0) as u32).min(frame.slabs.count - 1);
        let asks_at = |(i, p): (usize, &DVec3)| f64::from(asks_at(splats, frame, camera, 1.0, i, p.as_vec3()));
        Self {
            slabs: places.iter().map(|p| slab(p.z)).collect(),
            asks: places.iter().enumerate().map(asks_at).collect(),
            places,
            through: vec![1.0; cloud.len()],
            seen_by_light: splats.seen_by(camera),
            pixels: vec![[0.0; 3]; camera.size.iter().map(|s| *s as usize).product()],
            splats: *splats,
        }
    }

    /// Green optical depth of a splat in a pixel.
    fn optical_depth(&self, seen: &Projected, image: &Image, i: usize, pixel: usize) -> f64 {
        if !seen.is_visible(i) {
            return 0.0;
        }
        let splat = &seen.splats[i];
        let width = image.camera.size[0] as usize;
        let [x, y] = [pixel % width, pixel / width].map(|v| v as f64 + 0.5);
        let [dx, dy] = [x - f64::from(splat.center_px[0]), y - f64::from(splat.center_px[1])];
        let [a, b, c] = splat.conic.map(f64::from);
        let mut s = a * dx * dx + b * dx * dy + c * dy * dy;
        if splat.kind == SplatKind::Medium && !image.camera.is_orthographic() {
            s /= image.camera.view_ray(x, y).1.length_squared();
        }
        let profile = self.splats.footprints.layers()[usize::from(splat.footprint)].profile(s);
        f64::from(splat.peak)
            * profile
            * f64::from(self.splats.materials[usize::from(splat.material)].extinction_rgb[1])
    }

    /// Comes to a slab: what its splats keep from those behind them, and what comes to those that ask there.
    pub(super) fn enter(&mut self, slab: u32, view: &View<'_>, light: &Image, sums: &Sums, lit: &LitBy<'_>) {
        let mut pixels = std::mem::take(&mut self.pixels);
        for (at, [before, within, depths]) in pixels.iter_mut().enumerate() {
            *before += *within;
            (*within, *depths) = (0.0, 0.0);
            for i in self.of_slab(slab).filter(|i| self.casts(*i)) {
                let tau = self.optical_depth(&self.seen_by_light, light, i, at);
                *within += tau;
                *depths += tau * (self.places[i].z / view.frame.slabs.width - f64::from(slab));
            }
        }
        self.pixels = pixels;
        for i in (0..self.places.len()).filter(|i| (self.asks[*i] as u32).min(view.frame.slabs.count - 1) == slab) {
            let is_medium = self.splats.cloud.kind[i] == SplatKind::Medium;
            let depth = if is_medium { self.asks[i] - f64::from(slab) } else { f64::NEG_INFINITY };
            let pixels = view.around(light, self.places[i]);
            let through = pixels.map(|near| near.weight * libm::exp(-self.of_pixel(near.pixel, depth)));
            self.through[i] *= through.iter().sum::<f64>() as f32;
        }
        for i in self.of_slab(slab).collect::<Vec<_>>() {
            let tau = view.through_volumes(light, sums, &lit.light, self.places[i], slab);
            let seen = view.polygons.through(&lit.light, view.frame.world(self.places[i]), None);
            self.through[i] *= (seen * libm::exp(-tau)) as f32;
        }
    }

    fn of_slab(&self, slab: u32) -> impl Iterator<Item = usize> + use<'_, 'a> {
        (0..self.places.len()).filter(move |i| self.slabs[*i] == slab)
    }

    fn casts(&self, i: usize) -> bool {
        self.splats.objects[self.splats.cloud.object[i] as usize].casts_shadow
    }

    /// Optical depth of what a pixel of the light has up to a depth in the present slab, in slabs: that slab's as if it lay spread over a slab's width
    /// about its mean depth.
    fn of_pixel(&self, pixel: usize, depth: f64) -> f64 {
        let [before, within, depths] = self.pixels[pixel];
        let mean = depths / within.max(f64::MIN_POSITIVE);
        before + within * (depth - mean + 0.5).clamp(0.0, 1.0)
    }

    /// Mean optical depth, and mean transmittance, of the splats before a place in the present slab.
    pub(super) fn before(&self, view: &View<'_>, light: &Image, place: DVec3, slab: u32) -> [f64; 2] {
        let depth = place.z / view.frame.slabs.width - f64::from(slab);
        let pixels = view.around(light, place);
        let mean = |number: fn(f64) -> f64| {
            let term = |near: &WeightedPixel| near.weight * number(self.of_pixel(near.pixel, depth));
            pixels.iter().map(term).sum::<f64>()
        };
        [mean(|tau| tau), mean(|tau| libm::exp(-tau))]
    }

    /// The splats of a slab.
    pub(super) fn radiance(&self, slab: u32, view: &View<'_>, lamp: Lamp<'_, '_>) -> Vec<ShownSplat> {
        let Lamp { lit, with_ambient } = lamp;
        let HalfSplats { cloud, materials, objects, .. } = self.splats;
        let carried = Carried { through: &self.through, others: lit.shadow };
        let lights = [LitBy { shadow: Some(&carried), ..*lit }];
        let ambient = view.input.sheets.ambient;
        let camera = view.input.sheets.camera;
        let input = ShadeInput { cloud, materials, objects, lights: &lights, ambient, camera };
        let radiance = |i: usize| {
            let mut radiance = shade_splat(&input, i).0;
            if !with_ambient {
                (radiance.ambient, radiance.emission) = ([0.0; 3], [0.0; 3]);
            }
            let effects = radiance.effects();
            let radiance = [0, 1, 2].map(|c| effects.iter().map(|effect| f64::from(effect[c])).sum());
            ShownSplat { id: i, radiance }
        };
        self.of_slab(slab).map(radiance).collect()
    }

    /// Mixes the splats of a slab with what volumes have of it in a pixel of the eye: extinctions add, and colours weigh by them. Of a slab that
    /// translucent polygons part the splats lie in the part of their mean depth.
    pub(super) fn mix(
        &self,
        eye: &Image,
        pixel: usize,
        shown: &[ShownSplat],
        part: Between,
        volumes: Fragment,
    ) -> Fragment {
        let tau = |id: usize| self.optical_depth(self.splats.projected, eye, id, pixel);
        let sum = |number: &dyn Fn(usize) -> f64| shown.iter().map(|s| tau(s.id) * number(s.id)).sum::<f64>();
        let mean = sum(&|id| self.places[id].z) / sum(&|_| 1.0).max(f64::MIN_POSITIVE);
        if !(part.low <= mean && mean < part.high) {
            return volumes;
        }
        let mut optical_depth = volumes.optical_depth;
        let mut sum = volumes.color.map(|c| c * volumes.optical_depth);
        for ShownSplat { id, radiance } in shown {
            let tau = tau(*id);
            optical_depth += tau;
            (0..3).for_each(|c| sum[c] += tau * radiance[c]);
        }
        let is_any = optical_depth > 0.0;
        if is_any { Fragment { optical_depth, color: sum.map(|c| c / optical_depth) } } else { Fragment::default() }
    }
}
