//! The slow form in f64: the same sheets pixel by pixel and slab by slab, without tiles, vectors, rings, lists or skipped voxels.

use super::slant::Slant;
use super::view_slabs::{slabs_of, stride};
use super::viewed::{Viewed, eye_of, lacking};
use crate::image_aligned::tile::near_eye::LEAST_APART;
use crate::shared::gathered::exact::Exact;
use crate::shared::gradient_volume::differences;
use crate::shared::lattice::Lattice;
use crate::shared::lattice::rays::{LatticeRays, ViewRay};
use crate::shared::params::{Classify, Gradients, Reconstruction};
use crate::shared::sections::{PHASES, sections};
use crate::shared::slabs::Slabs;
use crate::{Error, Params, SheetInput, Volume};
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::{Point, arriving};
use splat_core::{Footprint, Receiver, Shading, SplatKind, TransferFunction};

/// What it draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Optical depth of each pixel, green.
    pub optical_depth: Vec<f64>,
    /// Radiance of each pixel, linear Rec.709.
    pub color: Vec<[f64; 3]>,
}

/// A voxel, with what is splatted of it.
struct Voxel {
    /// View position, depth counted from the first slab.
    place: DVec3,
    value: f64,
    /// Extinction, and the colours times it.
    class: [f64; 4],
}

/// Sheets of one volume: by slab of its own, by pixel.
struct Sheets {
    slabs: Slabs,
    /// Slabs of all volumes in one of its own.
    stride: u32,
    values: Vec<f64>,
    weights: Vec<f64>,
    /// Σ of kernels times the depths of voxels, in slabs from the eye.
    depths: Vec<f64>,
    /// Extinction and colours times it, where voxels are classified before they are splatted.
    classes: Vec<[f64; 4]>,
    /// Where each ray is inside.
    crossings: Vec<[f64; 2]>,
    /// The slab behind those that lack kernels behind the eye; 0 where none does.
    lacking: u32,
    /// The lattice that pixels read, where sheets are gathered.
    lattice: Option<Exact>,
    size: [usize; 2],
}

/// Draws all of the volumes, green extinction for all channels. Time grows as voxels times pixels under a footprint times slabs
/// under a kernel, memory as pixels times slabs.
///
/// # Errors
/// [`Error::Parameter`], [`Error::Volume`] or [`Error::Limit`].
pub fn draw(input: &SheetInput<'_>, params: &Params) -> Result<Picture, Error> {
    params.check_any_mode()?;
    input.check()?;
    let slant = Slant::new(input, params)?;
    let slabs = slabs_of(input, params, slant)?;
    let view = View { input, params, slant };
    let sheets: Vec<Sheets> = input.volumes.iter().map(|v| Sheets::new(v, &view, &slabs)).collect();
    let [width, height] = input.camera.size.map(|s| s as usize);
    let mut out = Picture { optical_depth: vec![0.0; width * height], color: vec![[0.0; 3]; width * height] };
    for slab in 1..slabs.count - 1 {
        for pixel in 0..width * height {
            let mut tau = 0.0;
            let mut color = [0.0; 3];
            for (volume, sheets) in input.volumes.iter().zip(&sheets) {
                let (optical_depth, radiance) = sheets.fragment(&view, volume, &slabs, slab, pixel);
                tau += optical_depth;
                (0..3).for_each(|c| color[c] += optical_depth * radiance[c]);
            }
            if tau > 0.0 {
                let weight = libm::exp(-out.optical_depth[pixel]) * -libm::expm1(-tau);
                (0..3).for_each(|c| out.color[pixel][c] += weight * color[c] / tau);
                out.optical_depth[pixel] += tau;
            }
        }
    }
    Ok(out)
}

/// What is drawn.
struct View<'a> {
    input: &'a SheetInput<'a>,
    params: &'a Params,
    slant: Slant,
}

impl Sheets {
    fn new(volume: &Volume<'_>, view: &View<'_>, slabs: &Slabs) -> Self {
        let View { input, params, slant } = *view;
        let camera = input.camera;
        let stride = stride(volume, input, params, slabs.width);
        let slabs = &slabs.wider(stride);
        let size = camera.size.map(|s| s as usize);
        let rays = LatticeRays::new(volume, camera, slabs.origin);
        let pixels = 0..size[0] * size[1];
        let ray =
            |pixel: usize| ViewRay::through(camera, (pixel % size[0]) as f64 + 0.5, (pixel / size[0]) as f64 + 0.5);
        let crossing = |ray: ViewRay| {
            // Of parallel rays; where they are not slabs lie across the view.
            rays.crossing(ray).map(|depth| slant.snapped(depth + slant.offset(ray.from.x, ray.from.y), slabs))
        };
        let n = pixels.len() * slabs.count as usize;
        let mut sheets = Self {
            slabs: *slabs,
            stride,
            values: vec![0.0; n],
            weights: vec![0.0; n],
            depths: vec![0.0; n],
            classes: vec![[0.0; 4]; if params.classify == Classify::Before { n } else { 0 }],
            crossings: pixels.map(|pixel| crossing(ray(pixel))).collect(),
            lacking: 0,
            lattice: None,
            size,
        };
        if let Reconstruction::Gather(kernel) = params.reconstruction {
            let lattice = Exact::new(volume, kernel);
            sheets.gather(&lattice, &rays, ray);
            sheets.lattice = Some(lattice);
            return sheets;
        }
        let viewed = Viewed::new(volume, camera, slabs, params, slant);
        let further = params.compares_sheets(volume) || params.classify == Classify::Preintegrated;
        let reach = viewed.lattice_reach(camera, slabs, further);
        let lattice = Lattice::new(volume.grid, volume.packing, reach);
        let viewed = viewed.with_rim(lattice.rim);
        let [nx, ny, nz] = lattice.dims;
        for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
            let value = lattice.value(i, j, k);
            let class = volume.transfer.at(value);
            let extinction = f64::from(class.extinction);
            let [red, green, blue] = class.color.map(|c| extinction * f64::from(c));
            let voxel = Voxel {
                place: viewed.position(i, j, k),
                value: f64::from(value),
                class: [extinction, red, green, blue],
            };
            sheets.splat(&viewed, params, slabs, &voxel);
        }
        let lacking = lacking(volume, camera, slabs, viewed.reach).unwrap_or(0..0);
        sheets.lacking = lacking.end;
        for slab in lacking {
            sheets.mend(slab);
        }
        sheets
    }

    /// Reads the lattice at each pixel of each sheet.
    fn gather(&mut self, lattice: &Exact, rays: &LatticeRays, ray: impl Fn(usize) -> ViewRay) {
        let pixels = self.size[0] * self.size[1];
        for slab in 0..self.slabs.count as usize {
            let depth = (slab as f64 + 0.5) * self.slabs.width;
            for at in 0..pixels {
                self.values[slab * pixels + at] = lattice.at(rays.line(ray(at), depth).start);
                self.weights[slab * pixels + at] = 1.0;
            }
        }
    }

    /// Tells the values of a sheet that lacks kernels behind the eye in the middle of its slab, from the place that they are of and from the next sheet.
    fn mend(&mut self, slab: u32) {
        let count = self.size[0] * self.size[1];
        let middle = f64::from(slab) + 0.5 - eye_of(&self.slabs);
        for pixel in 0..count {
            let (Some(value), Some(next)) = (self.value(slab, pixel), self.value(slab + 1, pixel)) else {
                continue;
            };
            let here = slab as usize * count + pixel;
            let behind = (slab as usize + 1) * count + pixel;
            let [depth, next_depth] = [here, behind].map(|sheet| self.depths[sheet] / self.weights[sheet]);
            if next_depth - depth > LEAST_APART {
                self.values[here] += self.weights[here] * (middle - depth) * (next - value) / (next_depth - depth);
            }
        }
    }

    /// Adds one voxel to every slab and pixel that it touches.
    fn splat(&mut self, viewed: &Viewed, params: &Params, slabs: &Slabs, voxel: &Voxel) {
        let Voxel { place: center, value, class } = voxel;
        let Some(place) = viewed.place(center.z as f32) else {
            return;
        };
        let Some(scale) = viewed.scale(viewed.depth(place)) else {
            return;
        };
        let depth = viewed.depth(place) / slabs.width - eye_of(slabs);
        let footprint = viewed.footprint(scale);
        let [a, b, c] = footprint.conic.map(f64::from);
        let [x0, y0] = viewed.pixel(Vec3::new(center.x as f32, center.y as f32, 0.0), scale as f32).map(f64::from);
        let cutoff = params.kernel.extent / params.kernel.sigma;
        let profile = Footprint { cutoff: cutoff as f32 };
        let sections = sections(place % PHASES, viewed.reach / slabs.width, &profile);
        let range = |center: f64, half: f32, n: usize| {
            let half = f64::from(half) + 1.0;
            (center - half).max(0.0) as usize..((center + half).max(0.0) as usize).min(n)
        };
        for y in range(y0, footprint.half[1], self.size[1]) {
            for x in range(x0, footprint.half[0], self.size[0]) {
                let dx = x as f64 + 0.5 - x0;
                let dy = y as f64 + 0.5 - y0;
                let weight = profile.profile(a * dx * dx + 2.0 * b * dx * dy + c * dy * dy);
                for (s, section) in sections.iter().enumerate() {
                    let slab = (place / PHASES) as usize + s;
                    let sheet = slab * self.size[0] * self.size[1] + y * self.size[0] + x;
                    if let Some(sum) = self.weights.get_mut(sheet) {
                        *sum += weight * section;
                        self.values[sheet] += weight * section * value;
                        self.depths[sheet] += weight * section * depth;
                        if let Some(sums) = self.classes.get_mut(sheet) {
                            (0..4).for_each(|c| sums[c] += weight * section * class[c]);
                        }
                    }
                }
            }
        }
    }

    /// Value of a pixel in a slab, where there is one.
    fn value(&self, slab: u32, pixel: usize) -> Option<f64> {
        let sheet = slab as usize * self.size[0] * self.size[1] + pixel;
        (self.weights[sheet] > 1e-12).then(|| self.values[sheet] / self.weights[sheet])
    }

    /// Extinction and colour of a pixel in a slab.
    fn class(&self, volume: &Volume<'_>, slab: u32, pixel: usize, value: f64) -> (f64, [f32; 3]) {
        let sheet = slab as usize * self.size[0] * self.size[1] + pixel;
        let Some([extinction, colors @ ..]) = self.classes.get(sheet) else {
            let class = volume.transfer.at(value as f32);
            return (f64::from(class.extinction), class.color);
        };
        (extinction / self.weights[sheet], colors.map(|c| (c / extinction.max(f64::MIN_POSITIVE)) as f32))
    }

    /// The medium between two depths of a slab, whose front half hides its back half. `factor` makes an optical depth of an extinction over a unit of depth.
    fn integrated(&self, volume: &Volume<'_>, slab: u32, pixel: usize, depths: [f64; 2], factor: f64) -> Part {
        let [near, far] = depths;
        let center = (f64::from(slab) + 0.5) * self.slabs.width;
        let here = self.value(slab, pixel).unwrap_or(0.0);
        let beside = |steps: i32| self.value(slab.saturating_add_signed(steps), pixel);
        let face = |way: i32| {
            let Some(next) = beside(way) else { return here };
            let far = if self.is_lacking(slab) { None } else { beside(2 * way) };
            let bend = far.zip(beside(-way)).map_or(0.0, |(far, other)| (here + next - far - other) / 16.0);
            (0.5 * (here + next) + bend).clamp(here.min(next), here.max(next))
        };
        let value = |depth: f64| {
            let behind = (depth - center) / self.slabs.width;
            here + 2.0 * behind.abs() * (face(if behind < 0.0 { -1 } else { 1 }) - here)
        };
        let middle = center.clamp(near, far);
        let [front, back] =
            [[near, middle], [middle, far]].map(|ends| HalfPart::new(volume.transfer, ends, ends.map(value)));
        let opacity = |depth: f64| -libm::expm1(-depth * factor);
        let weights = [opacity(front.depth), libm::exp(-front.depth * factor) * opacity(back.depth)];
        let share = weights[1] / (weights[0] + weights[1]).max(f64::MIN_POSITIVE);
        let mix = |front: f64, back: f64| front + share * (back - front);
        Part {
            extinction: (front.depth + back.depth) / (far - near),
            color: [0, 1, 2].map(|c| mix(front.color[c], back.color[c]) as f32),
            middle: mix(front.middle, back.middle),
        }
    }

    /// Whether kernels near a slab lie behind the eye.
    fn is_lacking(&self, slab: u32) -> bool {
        slab < self.lacking + 2 && self.lacking > 0
    }

    /// Where a ray is inside, within a slab.
    fn inside(&self, slabs: &Slabs, slab: u32, pixel: usize) -> Option<[f64; 2]> {
        let [near, far] = self.crossings[pixel];
        let near = near.max(f64::from(slab) * slabs.width);
        let far = far.min(f64::from(slab + 1) * slabs.width);
        (far > near).then_some([near, far])
    }

    /// Optical depth of a pixel in a slab, and the radiance of the volume's own slab, in the middle of what lies there.
    fn fragment(
        &self,
        view: &View<'_>,
        volume: &Volume<'_>,
        slabs: &Slabs,
        slab: u32,
        pixel: usize,
    ) -> (f64, [f64; 3]) {
        let View { input, params, slant } = *view;
        let nothing = (0.0, [0.0; 3]);
        let own_slab = slab / self.stride;
        let (Some(value), Some([near, far])) = (self.value(own_slab, pixel), self.inside(slabs, slab, pixel)) else {
            return nothing;
        };
        let x = (pixel % self.size[0]) as f64 + 0.5;
        let y = (pixel / self.size[0]) as f64 + 0.5;
        let (from, along) = input.camera.view_ray(x, y);
        let [begin, end] = self.inside(&self.slabs, own_slab, pixel).unwrap_or([near, far]);
        let behind = 0.5 * (begin + end) / self.slabs.width - (f64::from(own_slab) + 0.5);
        let beside = if behind < 0.0 { own_slab - 1 } else { own_slab + 1 };
        let value = value + behind.abs() * (self.value(beside, pixel).unwrap_or(value) - value);
        let mut middle = 0.5 * (begin + end);
        let (class, color) = if params.classify == Classify::Preintegrated {
            let factor = volume.extinction_scale * f64::from(volume.material.extinction_rgb[1]) * along.length();
            let part = self.integrated(volume, own_slab, pixel, [near, far], factor);
            // Light is looked up once for a slab of the volume, also where limits cut it into parts.
            let lit = if volume.material.shading == Shading::Unlit { [near, far] } else { [begin, end] };
            let lit = self.integrated(volume, own_slab, pixel, lit, factor);
            middle = lit.middle;
            (part.extinction, lit.color)
        } else {
            self.class(volume, own_slab, pixel, value)
        };
        if class == 0.0 {
            return nothing;
        }
        let extinction = class * volume.extinction_scale * f64::from(volume.material.extinction_rgb[1]);
        let tau = extinction * (far - near) * along.length();
        let viewed = Viewed::new(volume, input.camera, &self.slabs, params, slant);
        let depth = slabs.origin + middle - slant.offset(from.x, from.y);
        let axes = input.camera.axes;
        let world = |v: DVec3| axes[0] * v.x + axes[1] * v.y + axes[2] * v.z;
        let position = input.camera.position + world(from + along * depth);
        let normal = match params.gradients {
            _ if !volume.normals => Vec3::ZERO,
            Gradients::Sheets => self.normal(view, own_slab, pixel, along),
            Gradients::Volume => normal_of_volume(volume, position),
            Gradients::Kernel => self.lattice.as_ref().map_or(Vec3::ZERO, |l| normal_of_field(volume, l, position)),
        };
        let point = Point {
            position,
            radius: viewed.reach as f32,
            normal,
            to_eye: -world(along).normalize().as_vec3(),
            color,
            material: volume.material,
        };
        (tau, radiance(input, volume, &point))
    }

    /// −∇v/|∇v| in world space, from the neighbours that are inside.
    fn normal(&self, view: &View<'_>, slab: u32, pixel: usize, along: DVec3) -> Vec3 {
        let camera = view.input.camera;
        let slabs = &self.slabs;
        let x = pixel % self.size[0];
        let y = pixel / self.size[0];
        let sample =
            |slab: u32, pixel: usize| self.value(slab, pixel).filter(|_| self.inside(slabs, slab, pixel).is_some());
        let here = self.value(slab, pixel).unwrap_or(0.0);
        let difference = |before: Option<f64>, after: Option<f64>| {
            let steps = f64::from(u8::from(before.is_some()) + u8::from(after.is_some()));
            (after.unwrap_or(here) - before.unwrap_or(here)) / steps.max(1.0)
        };
        let beside = |x: Option<usize>, y: Option<usize>| {
            let x = x.filter(|x| *x < self.size[0])?;
            let y = y.filter(|y| *y < self.size[1])?;
            sample(slab, y * self.size[0] + x)
        };
        let right = difference(beside(x.checked_sub(1), Some(y)), beside(Some(x + 1), Some(y)));
        let down = difference(beside(Some(x), y.checked_sub(1)), beside(Some(x), Some(y + 1)));
        let z = difference(sample(slab - 1, pixel), sample(slab + 1, pixel)) / slabs.width;
        let depth = slabs.origin + (f64::from(slab) + 0.5) * slabs.width;
        let scale = camera.focal_px() / if camera.is_orthographic() { 1.0 } else { depth.max(slabs.width * 1e-3) };
        // Along a slab that does not lie across the view depth changes, too.
        let gx = right * scale + z * view.slant.offset(1.0, 0.0);
        let gy = -down * scale + z * view.slant.offset(0.0, 1.0);
        let gradient = camera.axes[0] * gx + camera.axes[1] * gy + camera.axes[2] * (z - along.x * gx - along.y * gy);
        -(gradient * slabs.width).normalize_or_zero().as_vec3()
    }
}

/// Radiance of a point of a volume, all effects together.
fn radiance(input: &SheetInput<'_>, volume: &Volume<'_>, point: &Point<'_>) -> [f64; 3] {
    let radiance = point.radiance(input.ambient, input.lights.iter(), |rank, irradiance| {
        let shadow = input.lights[rank].shadow.map(|shadow| {
            let position = (point.position - input.shadow_origin).as_vec3();
            let kind = SplatKind::Medium;
            move || shadow.transmittance(&Receiver { position, normal: Vec3::ZERO, radius: point.radius, kind })
        });
        arriving(irradiance, volume.shadow_coefficient, shadow)
    });
    let effects = radiance.effects();
    [0, 1, 2].map(|c| effects.iter().map(|effect| f64::from(effect[c])).sum())
}

/// A part of a slab, and what is seen of it.
struct Part {
    extinction: f64,
    color: [f32; 3],
    /// Depth that it is lit at.
    middle: f64,
}

/// Half of a part of a slab, values being linear in it.
struct HalfPart {
    /// ∫σ over its depths.
    depth: f64,
    color: [f64; 3],
    /// Mean depth, weighed by extinction.
    middle: f64,
}

impl HalfPart {
    fn new(transfer: &TransferFunction, depths: [f64; 2], values: [f64; 2]) -> Self {
        let length = depths[1] - depths[0];
        let [extinction, red, green, blue, value] = mean_class(transfer, values[0], values[1]);
        if extinction == 0.0 {
            return Self { depth: 0.0, color: [0.0; 3], middle: depths[0] + 0.5 * length };
        }
        let rise = values[1] - values[0];
        let share = if rise == 0.0 { 0.5 } else { (value / extinction - values[0]) / rise };
        let color = [red, green, blue].map(|color| color / extinction);
        Self { depth: extinction * length, color, middle: depths[0] + share * length }
    }
}

/// Means of the extinction, and of the colours and the value times it, over all values between two: the transfer function is cut at its control points, and between these Simpson's rule
/// is exact.
fn mean_class(transfer: &TransferFunction, from: f64, to: f64) -> [f64; 5] {
    let class = |value: f64| {
        let points = transfer.points();
        let upper = points.partition_point(|point| f64::from(point.value) <= value);
        let [low, high] = [upper.saturating_sub(1), upper.min(points.len() - 1)].map(|i| points[i]);
        let width = f64::from(high.value) - f64::from(low.value);
        let part = if width > 0.0 { (value - f64::from(low.value)) / width } else { 0.0 };
        let mix = |a: f32, b: f32| f64::from(a) + part * (f64::from(b) - f64::from(a));
        let extinction = mix(low.extinction, high.extinction);
        let [red, green, blue] = [0, 1, 2].map(|c| extinction * mix(low.color[c], high.color[c]));
        [extinction, red, green, blue, extinction * value]
    };
    if from == to {
        return class(from);
    }
    let [least, greatest] = [from.min(to), from.max(to)];
    let inner = transfer.points().iter().map(|point| f64::from(point.value));
    let cuts: Vec<f64> = std::iter::once(least)
        .chain(inner.filter(|value| least < *value && *value < greatest))
        .chain([greatest])
        .collect();
    let mut sums = [0.0; 5];
    for pair in cuts.windows(2) {
        let [low, middle, high] = [pair[0], 0.5 * (pair[0] + pair[1]), pair[1]].map(class);
        (0..5).for_each(|n| sums[n] += (pair[1] - pair[0]) / 6.0 * (low[n] + 4.0 * middle[n] + high[n]));
    }
    sums.map(|sum| sum / (greatest - least))
}

/// −∇v/|∇v| of the field that gathered sheets read, at a world position.
pub(crate) fn normal_of_field(volume: &Volume<'_>, lattice: &Exact, world: DVec3) -> Vec3 {
    let inverse = volume.axes().inverse();
    let gradient = lattice.gradient(inverse * (world - volume.origin()));
    -(inverse.transpose() * gradient).normalize_or_zero().as_vec3()
}

/// −∇v/|∇v| of a gradient volume at a world position: central differences at the lattice points around it, linear along each axis.
pub(crate) fn normal_of_volume(volume: &Volume<'_>, world: DVec3) -> Vec3 {
    let lattice = Lattice::new(volume.grid, volume.packing, [usize::MAX; 3]);
    let inverse = volume.axes().inverse();
    let place = inverse * (world - volume.origin()) + DVec3::from_array(lattice.rim.map(|n| n as f64));
    // Two neighbours along an axis, and their shares.
    let two =
        |place: f64| [(place.floor(), 1.0 - (place - place.floor())), (place.floor() + 1.0, place - place.floor())];
    let mut gradient = DVec3::ZERO;
    for (k, deep) in two(place.z) {
        let shift = volume.packing.shift(k as usize + lattice.rim[2] % 2);
        for (j, high) in two(place.y - shift) {
            for (i, wide) in two(place.x - shift) {
                let difference = differences(&lattice, [i as usize, j as usize, k as usize]);
                gradient += deep * high * wide * DVec3::from_array(difference);
            }
        }
    }
    -(inverse.transpose() * gradient).normalize_or_zero().as_vec3()
}
