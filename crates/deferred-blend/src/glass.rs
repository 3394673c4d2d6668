//! Bodies of glass: their surfaces mirror and bend light, and their inside absorbs it (section 5.2.3).
//!
//! The paper counts the layers l of a pixel, bends the ray once, at the nearest, by η^l, and lets (1 − α)^l through (Eqs. 15 and 16).
//! `Bending::Power` is that mode. In the others the ray continues from the nearest layer in its bent direction.

use crate::cone::{Cone, onward};
use crate::interface::cross;
use crate::surfaces::{RayTarget, Surfaces};
use crate::trace::{Inside, trace};
use splat_core::Material;
use splat_core::glam::Vec3;

/// Largest power of a ratio of indices; one over it is the least.
const MOST_RATIO: f32 = 1e15;

/// The places where rays are bent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bending {
    /// At every surface that the bent ray meets.
    #[default]
    Traced,
    /// At the nearest layer of an object by η^l, l the number of its layers along the straight ray, each of which has the opacity of
    /// the nearest (Eqs. 15 and 16).
    Power,
    /// At the nearest layer of an object, once.
    Nearest,
}

/// Settings for matter that surfaces bound.
#[derive(Clone, Copy)]
pub struct Glass<'a> {
    /// The places where rays are bent.
    pub bending: Bending,
    /// Radiance from infinitely far, by a unit vector of the camera's space and the solid angle around it.
    pub sky: &'a (dyn Fn(Vec3, f32) -> [f32; 3] + Sync),
    /// The targets of bent and mirrored rays: opaque discs, and for [`Bending::Traced`] those that bound matter.
    pub surfaces: &'a Surfaces<'a>,
    /// Whether opaque surfaces are seen straight on, as in the paper; then they should not be among `surfaces`.
    pub straight: bool,
    /// World units in a unit of the cloud, for what is absorbed.
    pub unit: f32,
}

impl Glass<'_> {
    /// Radiance along a ray that nothing bends any more.
    pub(crate) fn seen(&self, from: Vec3, along: Vec3, cone: Cone) -> [f32; 3] {
        match self.surfaces.nearest(from, along, RayTarget::Opaque) {
            Some(met) => met.radiance,
            None => (self.sky)(along, cone.solid_angle()),
        }
    }

    /// Optical depth of matter along a distance, by channel.
    pub(crate) fn absorbed(&self, material: &Material, distance: f32) -> [f32; 3] {
        material.absorption_inside.map(|a| a * (distance * self.unit).max(0.0))
    }
}

/// A layer that bounds matter.
pub(crate) struct Bound<'m> {
    pub(crate) material: &'m Material,
    pub(crate) object: u32,
    /// How many layers of the same object are nearer, and how many there are in the pixel.
    pub(crate) rank: u32,
    pub(crate) layers: u32,
    pub(crate) normal: Vec3,
    /// One over a length.
    pub(crate) curvature: f32,
    /// Of the pixel's ray there.
    pub(crate) cone: Cone,
    /// Where the straight ray meets it, and how far along the ray that is.
    pub(crate) place: Vec3,
    pub(crate) distance: f32,
}

/// The effect of a layer on light beside its opacity, by channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Passage {
    /// Share that is mirrored, in \[0, 1\].
    pub(crate) reflectance: [f32; 3],
    /// Radiance from where the mirrored rays go, times that share.
    pub(crate) mirrored: [f32; 3],
    /// Optical depth of the matter that the ray has left here.
    pub(crate) inside: [f32; 3],
}

impl Passage {
    /// Nothing.
    pub(crate) const CLEAR: Self = Self { reflectance: [0.0; 3], mirrored: [0.0; 3], inside: [0.0; 3] };

    /// Both as one, `next` behind this.
    pub(crate) fn before(&self, next: &Self) -> Self {
        let through: [f32; 3] = std::array::from_fn(|c| (1.0 - self.reflectance[c]) * libm::expf(-next.inside[c]));
        Self {
            reflectance: std::array::from_fn(|c| 1.0 - (1.0 - self.reflectance[c]) * (1.0 - next.reflectance[c])),
            mirrored: std::array::from_fn(|c| self.mirrored[c] + through[c] * next.mirrored[c]),
            inside: std::array::from_fn(|c| self.inside[c] + next.inside[c]),
        }
    }
}

/// The way of a pixel's ray through its layers.
pub(crate) struct Path<'m> {
    along: Vec3,
    /// Objects that were entered and not left, and how far along the straight ray.
    inside: Vec<(u32, &'m Material, f32)>,
    /// The opacity of the nearest layer of each object that was met.
    nearest: Vec<(u32, [f32; 3])>,
    bent: Option<Bent<'m>>,
}

/// Rays that no longer go straight on, by channel.
struct Bent<'m> {
    along: [Vec3; 3],
    cone: Cone,
    place: Vec3,
    inside: Inside<'m>,
}

impl<'m> Path<'m> {
    /// Begins along the unit vector of the pixel, within the objects that the eye lies in.
    pub(crate) fn begin(along: Vec3, glass: &Glass<'m>) -> Self {
        let inside = glass.surfaces.around_eye().map(|(object, material)| (object, material, 0.0)).collect();
        Self { along, inside, nearest: Vec::new(), bent: None }
    }

    /// The index where the ray is.
    fn index(&self, channel: usize) -> f32 {
        self.inside.last().map_or(1.0, |(_, material, _)| material.index_inside()[channel])
    }

    /// Whether a layer that bounds matter is met by the bent ray, where it lies there, and not by the straight one.
    pub(crate) fn leaves_out(&self, glass: &Glass<'_>) -> bool {
        glass.bending == Bending::Traced && self.bent.is_some()
    }

    /// Through a layer, one after the other from the eye.
    pub(crate) fn cross(&mut self, layer: &Bound<'m>, glass: &Glass<'_>, passage: &mut Passage) {
        let before_index: [f32; 3] = std::array::from_fn(|c| self.index(c));
        match self.inside.iter().position(|(object, ..)| *object == layer.object) {
            Some(at) => {
                let (_, material, from) = self.inside.remove(at);
                passage.inside = glass.absorbed(material, layer.distance - from);
            }
            None => self.inside.push((layer.object, layer.material, layer.distance)),
        }
        let index = layer.material.index_inside();
        if index == [1.0; 3] || layer.rank > 0 {
            return;
        }
        let before = self.bent.as_ref().map_or([self.along; 3], |bent| bent.along);
        let mut along = before;
        let mut cone = layer.cone;
        // Rays of all channels go the same way until something disperses them.
        let rays = if index == [index[0]; 3] && before == [before[0]; 3] { 1 } else { 3 };
        for ray in 0..rays {
            let ratio = match glass.bending {
                Bending::Traced => before_index[ray] / self.index(ray),
                Bending::Nearest => 1.0 / index[ray],
                Bending::Power => power(1.0 / index[ray], layer.layers),
            };
            let crossing = cross(before[ray], layer.normal, ratio);
            let share = crossing.reflectance;
            let [passes, mirrored] = onward(layer.cone, layer.curvature, ratio, &crossing);
            cone = passes;
            let seen = if share > 0.0 { glass.seen(layer.place, crossing.mirrored, mirrored) } else { [0.0; 3] };
            for c in if rays == 1 { 0..3 } else { ray..ray + 1 } {
                along[c] = crossing.bent;
                passage.reflectance[c] = share;
                passage.mirrored[c] = share * seen[c];
            }
        }
        if glass.bending == Bending::Traced {
            // What lies around this object has absorbed up to here.
            for (_, material, from) in self.inside.iter().filter(|(object, ..)| *object != layer.object) {
                let depths = glass.absorbed(material, layer.distance - from);
                passage.inside.iter_mut().zip(depths).for_each(|(sum, depth)| *sum += depth);
            }
        }
        let inside = Inside::new(self.inside.iter().map(|(object, material, _)| (*object, *material)));
        self.bent = Some(Bent { along, cone, place: layer.place, inside });
    }

    /// Opacity of a layer: where layers are counted, that of the nearest of its object (Eq. 15).
    pub(crate) fn opacity(&mut self, object: u32, opacity: [f32; 3], bending: Bending) -> [f32; 3] {
        if bending != Bending::Power {
            return opacity;
        }
        match self.nearest.iter().find(|(other, _)| *other == object) {
            Some((_, nearest)) => *nearest,
            None => {
                self.nearest.push((object, opacity));
                opacity
            }
        }
    }

    /// Optical depth of matter that was entered and is seen up to an opaque surface at a distance along the straight ray.
    pub(crate) fn absorbed_before(&self, distance: f32, glass: &Glass<'_>) -> [f32; 3] {
        if self.leaves_out(glass) {
            return [0.0; 3];
        }
        let absorbed = |(_, material, from): &(u32, &Material, f32)| glass.absorbed(material, distance - from);
        self.inside.iter().map(absorbed).fold([0.0; 3], |sum, depths| std::array::from_fn(|c| sum[c] + depths[c]))
    }

    /// What is seen behind all layers where the ray was bent. `hits` tells whether an opaque surface lies straight on.
    pub(crate) fn behind(&self, glass: &Glass<'_>, hits: bool) -> Option<[f32; 3]> {
        let Bent { along, cone, place, inside } = self.bent.as_ref()?;
        if hits && glass.straight {
            return None;
        }
        let seen = |c: usize| match glass.bending {
            Bending::Traced => trace(glass, *place, along[c], *cone, inside.clone(), c),
            Bending::Power | Bending::Nearest => glass.seen(*place, along[c], *cone),
        };
        let first = seen(0);
        let alike = *along == [along[0]; 3] && !glass.surfaces.disperses();
        Some(if alike { first } else { [first[0], seen(1)[1], seen(2)[2]] })
    }
}

/// η^l, between numbers whose squares are no infinities.
fn power(ratio: f32, layers: u32) -> f32 {
    let log = f64::from(layers) * libm::log(f64::from(ratio));
    (libm::exp(log) as f32).clamp(1.0 / MOST_RATIO, MOST_RATIO)
}
