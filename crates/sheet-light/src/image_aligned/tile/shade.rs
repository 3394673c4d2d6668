//! Shading of finished sheets: classification, gradients, radiance, and the mix of volumes that share a slab.

use super::kept::Kept;
use super::picture::{Fragments, Picture};
use super::place::Place;
use super::preclassified::Preclassified;
use super::rays::{Crossings, Slopes};
use super::sheets::{Sheets, difference};
use super::size::TILE;
use crate::image_aligned::light::{Lamp, Lit, Reflector, Spots};
use crate::image_aligned::prepared::Prepared;
use crate::shared::depths::{DepthRange, DepthSpans};
use crate::shared::input::SheetInput;
use crate::shared::pixel::Pixel;
use crate::shared::preintegrated::{Preintegrated, Values};
use crate::shared::sections::LEAST_WEIGHT;
use crate::shared::vectors::dot;
use crate::shared::volume::Volume;
use splat_core::Shading;
use splat_core::glam::Vec3;
use splat_core::optics::TRACE;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};

/// What shading reads beside the sheets.
pub(crate) struct Shader<'a> {
    pub(crate) input: &'a SheetInput<'a>,
    pub(crate) layout: &'a ChannelLayout,
    pub(crate) slopes: &'a Slopes,
    /// The camera's, in single precision.
    pub(crate) axes: [Vec3; 3],
    pub(crate) lamps: &'a [Lamp<'a>],
}

/// One volume of a tile, as shading reads it.
pub(crate) struct Reconstructed<'a> {
    pub(crate) prepared: &'a Prepared<'a>,
    pub(crate) crossings: &'a Crossings,
    pub(crate) sheets: &'a Sheets,
    /// Classes, where voxels have them.
    pub(crate) preclassified: Option<&'a Preclassified>,
    /// View depths between which each pixel of the tile without its rim may have light, counted from the first slab.
    pub(crate) limits: [&'a [f32]; 2],
    /// The same of the part of each of the pixels that is shaded, where there are several.
    pub(crate) part: Option<&'a DepthSpans>,
    /// Depths between which the volume is shaded.
    pub(crate) faces: DepthRange,
    /// Whether that is not the whole of its own slab.
    pub(crate) is_part: bool,
    /// Whether each pixel has all of these depths, inside of the volume and within the limits.
    pub(crate) is_whole: bool,
    /// Pixels that are seen through, from the first one on, a bit each.
    pub(crate) open: u32,
}

/// What one volume has in neighbouring pixels between two depths.
struct Medium<S: Simd> {
    near: Lanes<S>,
    far: Lanes<S>,
    /// View depth of the place that it is lit at.
    middle: Lanes<S>,
    /// Optical depth.
    depth: Lanes<S>,
    /// Length of each ray per unit of view depth.
    secant: Lanes<S>,
    color: [Lanes<S>; 3],
}

/// The values of neighbouring rays beside the middle of a slab.
struct Course<S: Simd> {
    /// In the middle.
    value: Lanes<S>,
    /// How they grow from there towards the eye, per unit of view depth.
    before: Lanes<S>,
    /// How they grow away from it.
    after: Lanes<S>,
}

impl<S: Simd> Course<S> {
    /// The values at depths behind the middle.
    #[inline(always)]
    fn at(&self, simd: S, behind: Lanes<S>) -> Lanes<S> {
        let zero = simd.lanes(0.0);
        let grown = behind.max(zero).mul_add(self.after, self.value);
        (zero - behind).max(zero).mul_add(self.before, grown)
    }
}

/// What one volume brings to neighbouring pixels.
struct Shaded<'a> {
    volume: &'a Volume<'a>,
    tau: [f32; MAX_LANES],
    values: Channels,
}

/// A number for each channel of each pixel.
type Channels = [[f32; MAX_LANES]; MAX_CHANNELS];

impl Shader<'_> {
    /// Adds a volume to the fragments; nothing where it has no optical depth in any of the pixels.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        place: Place,
        picture: &Picture,
        kept: &mut Kept,
        fragments: &mut Fragments,
    ) {
        let medium = self.classify(simd, reconstructed, place, reconstructed.faces);
        if !simd.lanes(0.0).any_less(medium.depth) {
            return;
        }
        let volume = &reconstructed.prepared.volume;
        let extinction = volume.material.extinction_rgb;
        if !fragments.any {
            fragments.any = true;
            self.values(simd, reconstructed, place, &medium, kept, &mut fragments.values);
            for p in 0..picture.planes {
                (medium.depth * simd.lanes(extinction[p])).store(&mut fragments.optical_depth[p]);
            }
            medium.near.store(&mut fragments.near);
            medium.far.store(&mut fragments.far);
            fragments.object = [volume.object; MAX_LANES];
            return;
        }
        let mut shaded = Shaded { volume, tau: [0.0; MAX_LANES], values: [[0.0; MAX_LANES]; MAX_CHANNELS] };
        self.values(simd, reconstructed, place, &medium, kept, &mut shaded.values);
        medium.depth.store(&mut shaded.tau);
        for p in 0..picture.planes {
            let before = Lanes::load(simd, &fragments.optical_depth[p]);
            (medium.depth * simd.lanes(extinction[p]) + before).store(&mut fragments.optical_depth[p]);
        }
        mix(simd, &shaded, &medium, fragments, picture);
    }

    /// All channels of a medium in neighbouring pixels.
    #[inline(always)]
    fn values<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        place: Place,
        medium: &Medium<S>,
        kept: &mut Kept,
        values: &mut Channels,
    ) {
        let material = reconstructed.prepared.volume.material;
        if material.shading == Shading::Unlit && self.layout.count() == 3 {
            for c in 0..3 {
                (medium.color[c] + simd.lanes(material.emission[c])).store(&mut values[c]);
            }
        } else if !reconstructed.is_part {
            self.light(simd, reconstructed, place, medium, values);
        } else {
            if kept.is_new(place) {
                let whole = self.classify(simd, reconstructed, place, reconstructed.prepared.slabs.faces(place.slab));
                self.light(simd, reconstructed, place, &whole, values);
                kept.keep::<S>(place, &values[..self.layout.count()]);
            }
            kept.recall::<S>(place, &mut values[..self.layout.count()]);
        }
    }

    /// The medium of a volume between two depths in its slab: its length within the limits, its class.
    #[inline(always)]
    fn classify<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        place: Place,
        faces: DepthRange,
    ) -> Medium<S> {
        let [near, far] = if reconstructed.is_whole {
            [simd.lanes(faces.near), simd.lanes(faces.far)]
        } else {
            self.ends(simd, reconstructed, place, faces)
        };
        if let Some(preintegrated) = &reconstructed.prepared.preintegrated {
            return self.integrate(simd, reconstructed, preintegrated, place, near, far);
        }
        let length = (far - near).max(simd.lanes(0.0));
        let [value, weight] = if reconstructed.is_whole {
            reconstructed.sheets.load(simd, place.slab, place.y, place.x)
        } else {
            self.amid(simd, reconstructed, place)
        };
        let [extinction, red, green, blue] = match reconstructed.preclassified {
            None => reconstructed.prepared.classifier.classify_seen(simd, value),
            Some(classes) => classes.load(simd, place.slab, place.y, place.x),
        };
        let secant = self.secants(simd, place);
        let depth = (extinction * length * secant).where_less(simd.lanes(LEAST_WEIGHT), weight);
        let middle = (near + far) * simd.lanes(0.5);
        Medium { near, far, middle, depth, secant, color: [red, green, blue] }
    }

    /// The medium between two depths of each ray in its slab, of all values between these: the front half of the slab hides the back half.
    #[inline(always)]
    fn integrate<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        preintegrated: &Preintegrated,
        place: Place,
        near: Lanes<S>,
        far: Lanes<S>,
    ) -> Medium<S> {
        let Place { slab, y, x } = place;
        let zero = simd.lanes(0.0);
        let least = simd.lanes(LEAST_WEIGHT);
        let slabs = &reconstructed.prepared.slabs;
        let faces = slabs.faces(slab);
        // Rays that are not inside have any depths, infinite ones too.
        let near = near.min(simd.lanes(faces.far));
        let far = far.max(near);
        let center = simd.lanes(0.5 * (faces.near + faces.far));
        let per_half = simd.lanes(2.0 / slabs.width as f32);
        let sheets = reconstructed.sheets;
        let here = sheets.load(simd, slab, y, x);
        let before = sheets.load(simd, slab.max(1) - 1, y, x);
        let after = sheets.load(simd, slab + 1, y, x);
        let mut ends = [[zero; 2]; 2];
        if !reconstructed.prepared.is_lacking(slab) {
            ends = [sheets.load(simd, slab.max(2) - 2, y, x), sheets.load(simd, slab + 2, y, x)];
        }
        let [value, weight] = here;
        let middle = center.max(near).min(far);
        let course = Course {
            value,
            before: (at_face(simd, [ends[0], before, here, after]) - value) * per_half,
            after: (at_face(simd, [ends[1], after, here, before]) - value) * per_half,
        };
        let values = Values {
            near: course.at(simd, near - center),
            middle: course.at(simd, middle - center),
            far: course.at(simd, far - center),
        };
        let [first, second] = preintegrated.halves(simd, &values);
        let secant = self.secants(simd, place);
        let first_depth = first.extinction * (middle - near) * secant;
        let second_depth = second.extinction * (far - middle) * secant;
        let depth = (first_depth + second_depth).where_less(least, weight);
        let extinction = reconstructed.prepared.volume.material.extinction_rgb;
        let is_grey = extinction == [extinction[0]; 3];
        let mut color = first.color;
        let mut shares = [zero; 3];
        for c in 0..3 {
            shares[c] = if c > 0 && is_grey {
                shares[0]
            } else {
                let factor = simd.lanes(extinction[c]);
                let opacity = (first_depth * factor).opacity();
                let behind = (simd.lanes(1.0) - opacity) * (second_depth * factor).opacity();
                behind / (opacity + behind).max(simd.lanes(f32::MIN_POSITIVE))
            };
            color[c] = (second.color[c] - first.color[c]).mul_add(shares[c], first.color[c]);
        }
        let first_place = (middle - near).mul_add(first.place, near);
        let second_place = (far - middle).mul_add(second.place, middle);
        let middle = (second_place - first_place).mul_add(shares[1], first_place);
        Medium { near, far, middle, depth, secant, color }
    }

    /// The depths between two others within which each ray is inside of the volume and of the limits.
    #[inline(always)]
    fn ends<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        place: Place,
        faces: DepthRange,
    ) -> [Lanes<S>; 2] {
        let pixel = place.pixel();
        // Without the rim.
        let inner = (place.y - 1) * TILE + place.x - 1;
        let near = Lanes::load(simd, &reconstructed.crossings.near[pixel..])
            .max(Lanes::load(simd, &reconstructed.limits[0][inner..]))
            .max(simd.lanes(faces.near));
        let far = Lanes::load(simd, &reconstructed.crossings.far[pixel..])
            .min(Lanes::load(simd, &reconstructed.limits[1][inner..]))
            .min(simd.lanes(faces.far));
        match reconstructed.part {
            None => [near, far],
            Some(part) => [near.max(Lanes::load(simd, &part.from)), far.min(Lanes::load(simd, &part.to))],
        }
    }

    /// The value in the middle of what each ray has of slab and volume, and the kernels' sum. A sheet has that of the middle of its slab; where a
    /// face of the volume cuts the slab, the sheet to the other side tells how values go on from there. Whether the ray is inside the volume
    /// there does not count: it may end at the slab's face, before or behind it.
    #[inline(always)]
    fn amid<S: Simd>(&self, simd: S, reconstructed: &Reconstructed<'_>, place: Place) -> [Lanes<S>; 2] {
        let Place { slab, y, x } = place;
        let [value, weight] = reconstructed.sheets.load(simd, slab, y, x);
        let slabs = &reconstructed.prepared.slabs;
        let zero = simd.lanes(0.0);
        let faces = slabs.faces(slab);
        let first = simd.lanes(faces.near);
        let last = simd.lanes(faces.far);
        let near = Lanes::load(simd, &reconstructed.crossings.near[place.pixel()..]).max(first);
        let far = Lanes::load(simd, &reconstructed.crossings.far[place.pixel()..]).min(last);
        // Twice as far as the middle lies behind that of the slab.
        let behind = ((near - first) + (far - last)).where_less(near, far);
        if !zero.any_less(behind.abs()) {
            return [value, weight];
        }
        let half = simd.lanes(0.5 / slabs.width as f32);
        let least = simd.lanes(LEAST_WEIGHT);
        let [value_after, weight_after] = reconstructed.sheets.load(simd, slab + 1, y, x);
        let [value_before, weight_before] = reconstructed.sheets.load(simd, slab.max(1) - 1, y, x);
        let after = behind.max(zero) * half * (value_after - value).where_less(least, weight_after);
        let before = (zero - behind).max(zero) * half * (value_before - value).where_less(least, weight_before);
        [value + after + before, weight]
    }

    /// Length of each ray per unit of view depth.
    #[inline(always)]
    fn secants<S: Simd>(&self, simd: S, place: Place) -> Lanes<S> {
        if self.input.camera.is_orthographic() {
            return simd.lanes(1.0);
        }
        let [u, v] = self.slopes(simd, place);
        u.mul_add(u, v.mul_add(v, simd.lanes(1.0))).sqrt()
    }

    /// x and y per unit of view depth of rays in perspective.
    #[inline(always)]
    fn slopes<S: Simd>(&self, simd: S, place: Place) -> [Lanes<S>; 2] {
        [Lanes::load(simd, &self.slopes.u[place.x..]), simd.lanes(self.slopes.v[place.y])]
    }

    /// Where light is asked for: the middle of the medium.
    #[inline(always)]
    fn spots<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        place: Place,
        medium: &Medium<S>,
        lane_bits: u32,
    ) -> Spots<S> {
        let zero = simd.lanes(0.0);
        let towards = simd.lanes(-1.0) / medium.secant;
        let to_eye = if self.input.camera.is_orthographic() {
            [zero, zero, towards]
        } else {
            let [u, v] = self.slopes(simd, place);
            [u * towards, v * towards, towards]
        };
        let places = self.slopes.places(simd, Pixel { x: place.x, y: place.y }, medium.middle);
        let prepared = reconstructed.prepared;
        let (normal, is_normal) = if let Some(gradients) = &prepared.gradients {
            unit(simd, &gradients.gradients(simd, &prepared.voxels, &places, lane_bits))
        } else if let (Some(gradients), Some(lattice)) = (&prepared.kernel_gradients, &prepared.gathered) {
            unit(simd, &gradients.gradients(simd, lattice, &places, lane_bits))
        } else if prepared.volume.normals {
            unit(simd, &self.gradient(simd, reconstructed, place))
        } else {
            ([zero; 3], zero)
        };
        Spots { places, to_eye, normal, is_normal, color: medium.color }
    }

    /// ∇v in view space, per slab width.
    #[inline(always)]
    fn gradient<S: Simd>(&self, simd: S, reconstructed: &Reconstructed<'_>, place: Place) -> [Lanes<S>; 3] {
        let Place { slab, y, x } = place;
        let [value, _] = reconstructed.sheets.load(simd, slab, y, x);
        let neighbours = [
            Place { slab: slab.max(1) - 1, y, x },
            Place { slab: slab + 1, y, x },
            Place { slab, y, x: x - 1 },
            Place { slab, y, x: x + 1 },
            Place { slab, y: y - 1, x },
            Place { slab, y: y + 1, x },
        ];
        let mut samples = [[value, simd.lanes(0.0)]; 6];
        // Before the first slab there is no sample.
        for k in usize::from(slab == 0)..6 {
            samples[k] = self.sample(simd, reconstructed, neighbours[k]);
        }
        let along = difference(simd, value, samples[0], samples[1]);
        let right = difference(simd, value, samples[2], samples[3]);
        let down = difference(simd, value, samples[4], samples[5]);
        let slabs = &reconstructed.prepared.slabs;
        let z = slabs.origin + (f64::from(slab) + 0.5) * slabs.width;
        let pixels = self.input.camera.focal_px() * slabs.width;
        if self.input.camera.is_orthographic() {
            let pixels = simd.lanes(pixels as f32);
            let right = right * pixels;
            let up = simd.lanes(0.0) - down * pixels;
            if !self.slopes.slant.is_any() {
                return [right, up, along];
            }
            // Along a slab depth changes, too.
            let [sx, sy] = self.slopes.slant.single();
            let [sx, sy] = [simd.lanes(sx), simd.lanes(sy)];
            return [right + sx * along, up + sy * along, along];
        }
        let pixels = simd.lanes((pixels / z.max(slabs.width * 1e-3)) as f32);
        let gx = right * pixels;
        let gy = simd.lanes(0.0) - down * pixels;
        let [u, v] = self.slopes(simd, place);
        [gx, gy, along - (u * gx + v * gy)]
    }

    /// Values of a sheet, with 1 where the ray is inside the volume there, else 0.
    #[inline(always)]
    fn sample<S: Simd>(&self, simd: S, reconstructed: &Reconstructed<'_>, place: Place) -> [Lanes<S>; 2] {
        let pixel = place.pixel();
        let zero = simd.lanes(0.0);
        let one = simd.lanes(1.0);
        let slabs = &reconstructed.prepared.slabs;
        let near = Lanes::load(simd, &reconstructed.crossings.near[pixel..]).max(simd.lanes(slabs.face(place.slab)));
        let far = Lanes::load(simd, &reconstructed.crossings.far[pixel..]).min(simd.lanes(slabs.face(place.slab + 1)));
        let [value, weight] = reconstructed.sheets.load(simd, place.slab, place.y, place.x);
        let inside = one.where_less_or(near, far, zero);
        [value, inside.where_less(simd.lanes(LEAST_WEIGHT), weight)]
    }

    /// All channels of a medium where it is seen, 0 elsewhere.
    #[inline(always)]
    fn light<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        place: Place,
        medium: &Medium<S>,
        values: &mut Channels,
    ) {
        let mut tau = [0.0; MAX_LANES];
        medium.depth.store(&mut tau);
        let mut lane_bits = 0;
        for lane in 0..Lanes::<S>::COUNT {
            lane_bits |= u32::from(tau[lane] > 0.0) << lane;
        }
        let lane_bits = lane_bits & reconstructed.open;
        self.channels(
            simd,
            reconstructed,
            &self.spots(simd, reconstructed, place, medium, lane_bits),
            medium,
            lane_bits,
            values,
        );
        for c in 0..self.layout.count() {
            // What is not seen may be no number.
            let zero = simd.lanes(0.0);
            let value = Lanes::load(simd, &values[c]);
            let least = simd.lanes(if c < self.layout.colors() { TRACE } else { -1.0 });
            value.where_less(zero, medium.depth).where_less(least, value.abs()).store(&mut values[c]);
        }
    }

    /// The channels of the spots: effects, normals, shadows. Of the lanes that are not `lane_bits` anything.
    #[inline(always)]
    fn channels<S: Simd>(
        &self,
        simd: S,
        reconstructed: &Reconstructed<'_>,
        spots: &Spots<S>,
        medium: &Medium<S>,
        lane_bits: u32,
        values: &mut Channels,
    ) {
        let volume = &reconstructed.prepared.volume;
        let radius = reconstructed.prepared.viewed.reach as f32 / 3.0;
        let reflector = Reflector {
            material: volume.material,
            has_normals: volume.normals,
            spread: radius * radius,
            shadow_coefficient: volume.shadow_coefficient,
        };
        let mut lit = Lit::dark(simd);
        if volume.material.shading != Shading::Unlit {
            let mut through = [simd.lanes(1.0); 3];
            if let Some(shadows) = &reconstructed.prepared.shadows {
                let voxels = &reconstructed.prepared.voxels;
                let neighbours = &shadows.neighbours;
                let cells = neighbours.cells(simd, voxels, &spots.places, lane_bits);
                let mut thick_parts = None;
                if let Some(within) = &reconstructed.prepared.within {
                    // What lies to one side of the middle of its part begins there.
                    let reach = (medium.middle - medium.near).min(medium.far - medium.middle);
                    let length = (reach + reach) * medium.secant;
                    let Spots { places, to_eye, .. } = spots;
                    thick_parts = Some(within.parts(simd, neighbours, places, to_eye, length, medium.depth));
                }
                for (rank, lamp) in self.lamps.iter().enumerate() {
                    through = shadows.transmittance(simd, voxels, &cells, rank);
                    if let Some(parts) = &thick_parts {
                        through = parts.replace(simd, neighbours, voxels, &cells, rank, through);
                    }
                    reflector.add(simd, lamp, spots, &through, &mut lit);
                }
            } else {
                for lamp in self.lamps {
                    reflector.add(simd, lamp, spots, &through, &mut lit);
                }
            }
        }
        let effects = reflector.effects(simd, spots, self.input.ambient, &lit);
        for c in 0..3 {
            if self.layout.is_apart() {
                (0..effects.len()).for_each(|e| effects[e][c].store(&mut values[3 * e + c]));
            } else {
                (effects[0][c] + effects[1][c] + effects[2][c] + effects[3][c]).store(&mut values[c]);
            }
        }
        if let Some(first) = self.layout.normal() {
            for a in 0..3 {
                let [right, up, forward] = &self.axes;
                let along = [simd.lanes(right[a]), simd.lanes(up[a]), simd.lanes(forward[a])];
                dot(&spots.normal, &along).store(&mut values[first + a]);
            }
        }
        if let Some(at) = self.layout.shadow() {
            lit.shadow(simd).store(&mut values[at]);
        }
    }
}

/// Values at the face between the second and the third of four sheets, each with its kernels' sum: by a cubic through all four, and no further than between the two beside it, so that
/// what is hidden stays hidden. Sheets that are not read show nothing, and nor do the values on the way there.
#[inline(always)]
fn at_face<S: Simd>(simd: S, sheets: [[Lanes<S>; 2]; 4]) -> Lanes<S> {
    let [[first, first_weight], [second, second_weight], [third, _], [fourth, fourth_weight]] = sheets;
    let least = simd.lanes(LEAST_WEIGHT);
    let both = second + third;
    let bend = ((both - first) - fourth) * simd.lanes(1.0 / 16.0);
    let bend = bend.where_less(least, first_weight).where_less(least, fourth_weight);
    let face = both.mul_add(simd.lanes(0.5), bend);
    face.max(second.min(third)).min(second.max(third)).where_less_or(least, second_weight, third)
}

/// −∇v/|∇v|, and 1 where there is a gradient, else 0.
#[inline(always)]
fn unit<S: Simd>(simd: S, gradient: &[Lanes<S>; 3]) -> ([Lanes<S>; 3], Lanes<S>) {
    let inverse = simd.lanes(-1.0) / dot(gradient, gradient).sqrt();
    let is_normal = simd.lanes(1.0).where_less(inverse, simd.lanes(0.0)).where_less(simd.lanes(-f32::MAX), inverse);
    let [x, y, z] = [gradient[0] * inverse, gradient[1] * inverse, gradient[2] * inverse];
    let half = simd.lanes(0.5);
    ([x.where_less(half, is_normal), y.where_less(half, is_normal), z.where_less(half, is_normal)], is_normal)
}

/// Adds a volume to those before it: colours weigh by extinction.
#[inline(always)]
fn mix<S: Simd>(simd: S, shaded: &Shaded<'_>, medium: &Medium<S>, fragments: &mut Fragments, picture: &Picture) {
    let Shaded { volume, tau, values } = shaded;
    let extinction = volume.material.extinction_rgb;
    let object = volume.object;
    let tau_here = Lanes::load(simd, tau);
    for c in 0..picture.channels {
        let p = ChannelLayout::plane_of(c, picture.channels, picture.planes);
        let whole = Lanes::load(simd, &fragments.optical_depth[p]).max(simd.lanes(f32::MIN_POSITIVE));
        let share = tau_here * simd.lanes(extinction[p]) / whole;
        let before = Lanes::load(simd, &fragments.values[c]);
        let shaded = Lanes::load(simd, &values[c]);
        (shaded - before).mul_add(share, before).store(&mut fragments.values[c]);
    }
    let near = Lanes::load(simd, &fragments.near);
    let far = Lanes::load(simd, &fragments.far);
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
    let half = simd.lanes(0.5);
    let first = Lanes::load(simd, &first);
    let is = medium.near.where_less_or(simd.lanes(0.0), tau_here, near);
    let both = near.min(is);
    is.where_less_or(first, half, both).store(&mut fragments.near);
    let is = medium.far.where_less_or(simd.lanes(0.0), tau_here, far);
    let both = far.max(is);
    is.where_less_or(first, half, both).store(&mut fragments.far);
}
