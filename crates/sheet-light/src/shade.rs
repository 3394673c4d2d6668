//! Shading of finished sheets: classification, gradients, radiance, and the mix of volumes that share a slab.

use crate::fold::Prepared;
use crate::picture::{Fragments, Picture};
use crate::rays::{Crossings, Slopes};
use crate::sheets::{LEAST_WEIGHT, Sheets, difference};
use crate::slabs::Slabs;
use crate::tile::{SIDE, TILE};
use crate::volume::{SheetInput, Volume};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::{ChannelLayout, LitBy, MAX_CHANNELS, Point, Radiance, arriving, facing};
use splat_core::{Camera, LightShape, Receiver, Shading, SplatKind};

/// Neighbouring pixels of one row, from column x of the tile with its rim on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) slab: u32,
    pub(crate) y: usize,
    pub(crate) x: usize,
}

/// What shading reads beside the sheets.
pub(crate) struct Shader<'a> {
    pub(crate) input: &'a SheetInput<'a>,
    pub(crate) slabs: &'a Slabs,
    pub(crate) layout: &'a ChannelLayout,
    pub(crate) slopes: &'a Slopes,
    /// The camera's, in single precision.
    pub(crate) axes: [Vec3; 3],
    pub(crate) is_lit_by_place: bool,
}

/// One volume of a tile, as shading reads it.
pub(crate) struct Reconstructed<'a> {
    pub(crate) prepared: &'a Prepared<'a>,
    pub(crate) crossings: &'a Crossings,
    pub(crate) sheets: &'a Sheets,
    /// View depths between which each pixel of the tile without its rim may have light, counted from the first slab.
    pub(crate) limits: [&'a [f32]; 2],
}

/// What one volume has in neighbouring pixels of one slab.
struct Medium<S: Simd> {
    near: Lanes<S>,
    far: Lanes<S>,
    /// Extinction times the way along the view axis.
    depth: Lanes<S>,
    color: [Lanes<S>; 3],
}

/// Pixels to be lit.
struct Lit {
    /// Optical depth; 0 where nothing has to be lit.
    tau: [f32; MAX_LANES],
    normals: [Vec3; MAX_LANES],
    color: [[f32; MAX_LANES]; 3],
    /// View depths of the middle of the medium, counted from the first slab.
    middle: [f32; MAX_LANES],
}

/// What one volume brings to neighbouring pixels.
struct Shaded<'a> {
    volume: &'a Volume<'a>,
    tau: [f32; MAX_LANES],
    values: Values,
}

/// A number for each channel of each pixel.
type Values = [[f32; MAX_LANES]; MAX_CHANNELS];

impl Shader<'_> {
    /// Adds a volume to the fragments; nothing where it has no optical depth in any of the pixels.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &self,
        simd: S,
        of: &Reconstructed<'_>,
        place: Place,
        picture: &Picture,
        fragments: &mut Fragments,
    ) {
        let medium = self.classify(simd, of, place);
        let secant = self.secants(simd, place);
        let mut tau = [0.0; MAX_LANES];
        (medium.depth * secant).store(&mut tau);
        let mut any = false;
        for lane in 0..Lanes::<S>::COUNT {
            any |= tau[lane] > 0.0;
        }
        if !any {
            return;
        }
        let is_first = !fragments.any;
        fragments.any = true;
        let mut values = [[0.0; MAX_LANES]; MAX_CHANNELS];
        let is_plain = of.prepared.volume.material.shading == Shading::Unlit && self.layout.count() == 3;
        if is_plain {
            for c in 0..3 {
                (medium.color[c] + Lanes::splat(simd, of.prepared.volume.material.emission[c])).store(&mut values[c]);
            }
        } else {
            let normals =
                if of.prepared.volume.normals { self.normals(simd, of, place) } else { [Vec3::ZERO; MAX_LANES] };
            let open = picture.open[place.y] >> place.x;
            let mut lit = Lit { tau, normals, color: [[0.0; MAX_LANES]; 3], middle: [0.0; MAX_LANES] };
            for c in 0..3 {
                medium.color[c].store(&mut lit.color[c]);
            }
            ((medium.near + medium.far) * Lanes::splat(simd, 0.5)).store(&mut lit.middle);
            for lane in 0..Lanes::<S>::COUNT {
                if open >> lane & 1 == 0 {
                    lit.tau[lane] = 0.0;
                }
            }
            self.light::<S>(of, place, &lit, &mut values);
        }
        let extinction = of.prepared.volume.material.extinction_rgb;
        for p in 0..picture.planes {
            let own = Lanes::load(simd, &tau) * Lanes::splat(simd, extinction[p]);
            let all = if is_first { own } else { own + Lanes::load(simd, &fragments.optical_depth[p]) };
            all.store(&mut fragments.optical_depth[p]);
        }
        if is_first {
            fragments.values = values;
            medium.near.store(&mut fragments.near);
            medium.far.store(&mut fragments.far);
            fragments.object = [of.prepared.volume.object; MAX_LANES];
        } else {
            mix(simd, &Shaded { volume: &of.prepared.volume, tau, values }, &medium, fragments, picture);
        }
    }

    /// The medium of a volume in a slab: its length within the limits, its class.
    #[inline(always)]
    fn classify<S: Simd>(&self, simd: S, of: &Reconstructed<'_>, place: Place) -> Medium<S> {
        let at = place.y * SIDE + place.x;
        let limits = of.limits.map(|depths| Lanes::load(simd, &depths[(place.y - 1) * TILE + place.x - 1..]));
        let face = |slab: u32| Lanes::splat(simd, self.slabs.face(slab));
        let near = Lanes::load(simd, &of.crossings.near[at..]).max(limits[0]).max(face(place.slab));
        let far = Lanes::load(simd, &of.crossings.far[at..]).min(limits[1]).min(face(place.slab + 1));
        let length = (far - near).max(Lanes::splat(simd, 0.0));
        let [value, weight] = of.sheets.load(simd, place.slab, place.y, place.x);
        let [extinction, red, green, blue] = of.prepared.classifier.at(simd, value);
        let depth = (extinction * length).where_less(Lanes::splat(simd, LEAST_WEIGHT), weight);
        Medium { near, far, depth, color: [red, green, blue] }
    }

    /// Length of each ray per unit of view depth.
    #[inline(always)]
    fn secants<S: Simd>(&self, simd: S, place: Place) -> Lanes<S> {
        if self.input.camera.is_orthographic() {
            return Lanes::splat(simd, 1.0);
        }
        let [u, v] = self.slopes(simd, place);
        u.mul_add(u, v.mul_add(v, Lanes::splat(simd, 1.0))).sqrt()
    }

    /// x and y per unit of view depth of rays in perspective.
    #[inline(always)]
    fn slopes<S: Simd>(&self, simd: S, place: Place) -> [Lanes<S>; 2] {
        [Lanes::load(simd, &self.slopes.u[place.x..]), Lanes::splat(simd, self.slopes.v[place.y])]
    }

    /// −∇v/|∇v| in world space, zero where there is no gradient.
    #[inline(always)]
    fn normals<S: Simd>(&self, simd: S, of: &Reconstructed<'_>, place: Place) -> [Vec3; MAX_LANES] {
        let gradient = self.gradient(simd, of, place);
        let mut parts = [[0.0; MAX_LANES]; 3];
        for a in 0..3 {
            gradient[a].store(&mut parts[a]);
        }
        let axes = self.axes;
        let mut out = [Vec3::ZERO; MAX_LANES];
        for lane in 0..Lanes::<S>::COUNT {
            let world = axes[0] * parts[0][lane] + axes[1] * parts[1][lane] + axes[2] * parts[2][lane];
            out[lane] = -world.normalize_or_zero();
        }
        out
    }

    /// ∇v in view space, per slab width.
    #[inline(always)]
    fn gradient<S: Simd>(&self, simd: S, of: &Reconstructed<'_>, place: Place) -> [Lanes<S>; 3] {
        let of_place = |slab: u32, y: usize, x: usize| self.sample(simd, of, Place { slab, y, x });
        let Place { slab, y, x } = place;
        let [value, _] = of.sheets.load(simd, slab, y, x);
        let before = if slab > 0 { of_place(slab - 1, y, x) } else { [value, Lanes::splat(simd, 0.0)] };
        let along = difference(simd, value, before, of_place(slab + 1, y, x));
        let right = difference(simd, value, of_place(slab, y, x - 1), of_place(slab, y, x + 1));
        let down = difference(simd, value, of_place(slab, y - 1, x), of_place(slab, y + 1, x));
        let z = self.slabs.origin + (f64::from(slab) + 0.5) * self.slabs.width;
        let pixels = self.input.camera.focal_px() * self.slabs.width;
        if self.input.camera.is_orthographic() {
            let pixels = Lanes::splat(simd, pixels as f32);
            return [right * pixels, Lanes::splat(simd, 0.0) - down * pixels, along];
        }
        let pixels = Lanes::splat(simd, (pixels / z.max(self.slabs.width * 1e-3)) as f32);
        let (gx, gy) = (right * pixels, Lanes::splat(simd, 0.0) - down * pixels);
        let [u, v] = self.slopes(simd, place);
        [gx, gy, along - (u * gx + v * gy)]
    }

    /// Values of a sheet, with 1 where the ray is inside the volume there, else 0.
    #[inline(always)]
    fn sample<S: Simd>(&self, simd: S, of: &Reconstructed<'_>, place: Place) -> [Lanes<S>; 2] {
        let at = place.y * SIDE + place.x;
        let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let face = |slab: u32| Lanes::splat(simd, self.slabs.face(slab));
        let near = Lanes::load(simd, &of.crossings.near[at..]).max(face(place.slab));
        let far = Lanes::load(simd, &of.crossings.far[at..]).min(face(place.slab + 1));
        let [value, weight] = of.sheets.load(simd, place.slab, place.y, place.x);
        let inside = one.where_less_or(near, far, zero);
        [value, inside.where_less(Lanes::splat(simd, LEAST_WEIGHT), weight)]
    }

    /// Radiance of the pixels that have optical depth, by the function that shades every point.
    #[inline(always)]
    fn light<S: Simd>(&self, of: &Reconstructed<'_>, place: Place, lit: &Lit, values: &mut Values) {
        for lane in 0..Lanes::<S>::COUNT {
            if lit.tau[lane] > 0.0 {
                let color = lit.color.map(|channel| channel[lane]);
                let (seen, at) = self.seen(place, lane, lit.middle[lane]);
                let mut out = [0.0; MAX_CHANNELS];
                let Prepared { volume, viewed, shadows, voxels, lattice, rays, .. } = of.prepared;
                let sample = Sample { volume, radius: viewed.reach as f32, seen, color, normal: lit.normals[lane] };
                let cell = shadows.as_ref().map(|shadows| {
                    let rim = DVec3::from_array(lattice.rim.map(|n| n as f64));
                    (shadows, shadows.cell(voxels, rays.lattice(at) + rim))
                });
                let radiance = radiance(self.input, &sample, |light| {
                    let (shadows, cell) = cell.as_ref()?;
                    shadows.at(cell, light)
                });
                radiance.write(lit.normals[lane], self.layout, &mut out);
                for c in 0..self.layout.count() {
                    values[c][lane] = out[c];
                }
            }
        }
    }

    /// What is seen of a ray at a depth, and its view position. Where it lies is found out only where a light asks.
    #[inline(always)]
    fn seen(&self, place: Place, lane: usize, depth: f32) -> (Seen, DVec3) {
        let camera = self.input.camera;
        if self.is_lit_by_place {
            let (from, along) = self.slopes.ray(place.x + lane, place.y);
            let at = from + along * (self.slabs.origin + f64::from(depth));
            return (Seen::new(camera, at, along), at);
        }
        let [right, up, forward] = self.axes;
        let slant = if camera.is_orthographic() {
            Vec3::ZERO
        } else {
            right * self.slopes.u[place.x + lane] + up * self.slopes.v[place.y]
        };
        (Seen { position: DVec3::ZERO, to_eye: -(forward + slant).normalize() }, DVec3::ZERO)
    }
}

/// A point and the unit direction from it to the viewer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    position: DVec3,
    to_eye: Vec3,
}

impl Seen {
    /// The view position `at`, on a ray of the view direction `along`.
    pub(crate) fn new(camera: &Camera, at: DVec3, along: DVec3) -> Self {
        let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
        Self { position: camera.position + world(at), to_eye: -world(along).normalize().as_vec3() }
    }
}

/// Whether light depends on where a point is.
pub(crate) fn is_lit_by_place(input: &SheetInput<'_>) -> bool {
    let by_place = |lit: &LitBy<'_>| lit.shadow.is_some() || !matches!(lit.light.shape, LightShape::Directional { .. });
    input.lights.iter().any(by_place)
}

/// One point of a volume.
pub(crate) struct Sample<'a> {
    pub(crate) volume: &'a Volume<'a>,
    /// Radius of the kernel, world units.
    pub(crate) radius: f32,
    pub(crate) seen: Seen,
    pub(crate) color: [f32; 3],
    pub(crate) normal: Vec3,
}

impl Sample<'_> {
    /// What arrives of a light, looked up at the point itself.
    pub(crate) fn transmittance(&self, input: &SheetInput<'_>, light: usize) -> Option<[f32; 3]> {
        let position = (self.seen.position - input.shadow_origin).as_vec3();
        let receiver = Receiver { position, normal: Vec3::ZERO, radius: self.radius, kind: SplatKind::Medium };
        Some(input.lights[light].shadow?.transmittance(&receiver))
    }
}

/// Radiance of one point of a volume; `transmittance` says what arrives of a light by its place in the list, `None` for all.
#[inline]
pub(crate) fn radiance(
    input: &SheetInput<'_>,
    sample: &Sample<'_>,
    transmittance: impl Fn(usize) -> Option<[f32; 3]>,
) -> Radiance {
    let &Sample { volume, radius, seen: Seen { position, to_eye }, color, normal } = sample;
    let normal = facing(SplatKind::Medium, normal, normal, to_eye);
    let point = Point { position, radius, normal, to_eye, color, material: volume.material };
    point.radiance(input.ambient, input.lights.iter().map(|lit| &lit.light), |rank, irradiance| {
        let shadow = input.lights[rank].shadow.is_some();
        let shadow = shadow.then_some(|| transmittance(rank).unwrap_or([1.0; 3]));
        arriving(irradiance, volume.shadow_coefficient, shadow)
    })
}

/// Adds a volume to those before it: colours weigh by extinction.
#[inline(always)]
fn mix<S: Simd>(simd: S, own: &Shaded<'_>, medium: &Medium<S>, fragments: &mut Fragments, picture: &Picture) {
    let Shaded { volume, tau, values } = own;
    let (extinction, object) = (volume.material.extinction_rgb, volume.object);
    let of = |v: f32| Lanes::splat(simd, v);
    let tau_here = Lanes::load(simd, tau);
    for c in 0..picture.channels {
        let p = ChannelLayout::plane_of(c, picture.channels, picture.planes);
        let all = Lanes::load(simd, &fragments.optical_depth[p]).max(of(f32::MIN_POSITIVE));
        let share = tau_here * of(extinction[p]) / all;
        let before = Lanes::load(simd, &fragments.values[c]);
        let own = Lanes::load(simd, &values[c]);
        (own - before).mul_add(share, before).store(&mut fragments.values[c]);
    }
    let (near, far) = (Lanes::load(simd, &fragments.near), Lanes::load(simd, &fragments.far));
    // A volume without optical depth here, before this one, says nothing of where the medium lies.
    let mut first = [0.0; MAX_LANES];
    for lane in 0..Lanes::<S>::COUNT {
        let green = picture.planes / 2;
        let others = fragments.optical_depth[green][lane] - tau[lane] * extinction[green];
        first[lane] = if others > 0.0 { 1.0 } else { 0.0 };
        if others <= 0.0 {
            fragments.object[lane] = object;
        }
    }
    let (half, first) = (of(0.5), Lanes::load(simd, &first));
    let is = medium.near.where_less_or(of(0.0), tau_here, near);
    let both = near.min(is);
    is.where_less_or(first, half, both).store(&mut fragments.near);
    let is = medium.far.where_less_or(of(0.0), tau_here, far);
    let both = far.max(is);
    is.where_less_or(first, half, both).store(&mut fragments.far);
}
