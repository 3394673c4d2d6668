//! Shading after blending (section 5.2.4): in each pixel places, normals and colours of a layer's discs are averaged, and light falls on
//! that once. A disc that was shaded before it was blended has one radiance, so highlights and the ends of shadows show single discs.

use crate::bump;
use crate::disc::{Discs, Ray};
use crate::fragments::Fragment;
use splat_core::glam::Vec3;
use splat_core::shade::{ChannelLayout, MAX_CHANNELS, Point, ShadeInput, arriving, facing};
use splat_core::{Cloud, HeightImage, Receiver, Similarity};

/// The values that discs show.
#[derive(Clone, Copy)]
pub enum Shown<'a> {
    /// Numbers of each disc, which was shaded before it is blended: as many as there are channels, by place in the cloud.
    Discs(&'a [f32]),
    /// Light on what was averaged.
    Pixels(Light<'a>),
}

/// Light, and what it falls on.
#[derive(Clone, Copy)]
pub struct Light<'a> {
    /// Lights and tables, with the cloud of the discs.
    pub input: &'a ShadeInput<'a>,
    /// The numbers that it gives.
    pub layout: ChannelLayout,
    /// Of each object, by id: bumps lie in its own space.
    pub transforms: &'a [Similarity],
    /// Of each material, by id, whose bumps an image has; there may be fewer.
    pub heights: &'a [Option<HeightImage>],
}

/// Numbers of [`Attributes`].
pub(crate) const ATTRIBUTES: usize = 10;

/// The attributes of discs that are averaged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attributes {
    /// The normal that the surface lies across.
    pub(crate) face: Vec3,
    /// The one that light is reflected about.
    pub(crate) normal: Vec3,
    pub(crate) color: [f32; 3],
    pub(crate) radius: f32,
}

impl Attributes {
    fn from_cloud(cloud: &Cloud, i: usize) -> Self {
        let face = cloud.normal_of(i);
        let normal = cloud.shading_normal_of(i);
        Self { face, normal, color: cloud.color[i], radius: cloud.radius[i] }
    }

    fn to_array(self) -> [f32; ATTRIBUTES] {
        let [a, b, c] = self.face.to_array();
        let [d, e, f] = self.normal.to_array();
        let [g, h, i] = self.color;
        [a, b, c, d, e, f, g, h, i, self.radius]
    }

    fn from_array(values: [f32; ATTRIBUTES]) -> Self {
        let [a, b, c, d, e, f, g, h, i, radius] = values;
        Self { face: Vec3::new(a, b, c), normal: Vec3::new(d, e, f), color: [g, h, i], radius }
    }
}

impl Light<'_> {
    /// Attributes of disc `i` of the cloud for an average, with its normals on the viewer's side.
    pub(crate) fn attributes(&self, i: usize) -> [f32; ATTRIBUTES] {
        let cloud = self.input.cloud;
        let disc = Attributes::from_cloud(cloud, i);
        let to_eye = self.toward_eye(cloud.position[i]);
        let side = |n: Vec3| if disc.face.dot(to_eye) < 0.0 { -n } else { n };
        Attributes { face: side(disc.face), normal: side(disc.normal), ..disc }.to_array()
    }

    /// Of an opaque pixel, from averages of [`Light::attributes`].
    pub(crate) fn on_averages(&self, averages: [f32; ATTRIBUTES], place: &Place<'_>, out: &mut [f32; MAX_CHANNELS]) {
        self.on(&Attributes::from_array(averages), place, out);
    }

    /// Of a layer. Normals are averaged by weight on the side of the nearest disc's, colours by what each disc has of the sum of a
    /// plane's weights.
    pub(crate) fn on_layer(
        &self,
        fragments: &[Fragment],
        place: &Place<'_>,
        share: impl Fn(&Fragment) -> [f32; 3],
        plane: impl Fn(usize) -> usize,
        out: &mut [f32; MAX_CHANNELS],
    ) {
        let attributes =
            |f: &Fragment| Attributes::from_cloud(self.input.cloud, place.discs.ids[f.disc as usize] as usize);
        let first = attributes(&fragments[0]);
        let mut sum = Attributes { face: Vec3::ZERO, normal: Vec3::ZERO, color: [0.0; 3], radius: 0.0 };
        let mut weights = 0.0;
        let mut shares = [0.0; 3];
        for fragment in fragments {
            let disc = attributes(fragment);
            let side = if disc.face.dot(first.face) < 0.0 { -fragment.weight } else { fragment.weight };
            sum.face += disc.face * side;
            sum.normal += disc.normal * side;
            sum.radius += (disc.radius - first.radius) * fragment.weight;
            weights += fragment.weight;
            let own_share = share(fragment);
            for c in 0..3 {
                sum.color[c] += own_share[plane(c)] * (disc.color[c] - first.color[c]);
                shares[c] += own_share[plane(c)];
            }
        }
        let color = |c: usize| if shares[c] > 0.0 { sum.color[c] / shares[c] } else { 0.0 } + first.color[c];
        let mean = Attributes {
            face: sum.face.try_normalize().unwrap_or(first.face),
            normal: sum.normal.try_normalize().unwrap_or(first.normal),
            color: [0, 1, 2].map(color),
            radius: sum.radius / weights + first.radius,
        };
        self.on(&mean, place, out);
    }

    /// Writes the channels of the layout.
    fn on(&self, mean: &Attributes, place: &Place<'_>, out: &mut [f32; MAX_CHANNELS]) {
        let ShadeInput { cloud, materials, objects, lights, ambient, .. } = *self.input;
        let position = place.discs.place(place.ray, place.depth);
        let i = place.disc;
        let kind = cloud.kind[i];
        let object = cloud.object[i] as usize;
        let material = &materials[cloud.material[i] as usize];
        let to_eye = self.toward_eye(position);
        let face = mean.face.normalize_or_zero();
        let mut normal = facing(kind, face, mean.normal.normalize_or_zero(), to_eye);
        if material.bump.height > 0.0 {
            let slope = self.slope(place, position, normal);
            normal = (normal - (slope - normal * slope.dot(normal))).normalize_or(normal);
        }
        let world = cloud.origin + position.as_dvec3();
        let point = Point { position: world, radius: mean.radius, normal, to_eye, color: mean.color, material };
        let coefficient = cloud.shadow_coefficient_of(i) * objects[object].shadow_coefficient;
        let receiver = Receiver { position, normal: face, radius: mean.radius, kind };
        let radiance = point.radiance(ambient, lights.iter(), |rank, irradiance| {
            let shadow = lights[rank].shadow.map(|shadow| move || shadow.transmittance(&receiver));
            arriving(irradiance, coefficient, shadow)
        });
        radiance.write(normal, &self.layout, out);
    }

    /// ∇h of bumps on a surface across `normal`.
    fn slope(&self, place: &Place<'_>, position: Vec3, normal: Vec3) -> Vec3 {
        let cloud = self.input.cloud;
        let material = cloud.material[place.disc] as usize;
        let Similarity { scale, rotation, translation } = self.transforms[cloud.object[place.disc] as usize];
        let at = rotation.inverse() * (cloud.origin + position.as_dvec3() - translation) / scale;
        let bump = &self.input.materials[material].bump;
        let pixel = f64::from(place.discs.pixel_width(place.depth)) / scale;
        let slope = match self.heights.get(material).and_then(Option::as_ref) {
            Some(image) => bump::image_slope(bump, image, at, rotation.inverse() * normal.as_dvec3(), pixel),
            None => bump::slope(bump, at, pixel),
        };
        (rotation * slope).as_vec3()
    }

    /// Unit direction to the viewer.
    pub(crate) fn toward_eye(&self, position: Vec3) -> Vec3 {
        let camera = self.input.camera;
        if camera.is_orthographic() {
            return -camera.axes[2].as_vec3();
        }
        ((camera.position - self.input.cloud.origin).as_vec3() - position).normalize_or_zero()
    }
}

/// Where a surface is seen.
pub(crate) struct Place<'a> {
    pub(crate) discs: &'a Discs,
    pub(crate) ray: &'a Ray,
    /// View depth.
    pub(crate) depth: f32,
    /// The nearest disc, as a place in the cloud: material, object and share of shadows are its.
    pub(crate) disc: usize,
}
