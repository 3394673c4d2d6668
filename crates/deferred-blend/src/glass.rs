//! Matter that surfaces bound: rays are mirrored and bent at each layer, and what is inside absorbs (section 5.2.3, Eqs. 15-16).
//!
//! The paper counts the layers l of a pixel, bends the ray once, at the nearest, by η^l, and lets (1 − α)^l through. Here every layer
//! has its own normal and its own opacity, so by default each bends by what it is: into the matter and out of it by turns. Both take
//! layers from the straight ray, for a bent one meets others that were not gathered.

use crate::interface::cross;
use crate::solids::Solids;
use splat_core::Material;
use splat_core::glam::Vec3;

/// Largest power of a ratio of indices, and least.
const MOST_RATIO: f32 = 1e15;

/// Where rays are bent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bending {
    /// At each layer by its own normal, in and out by turns; light is mirrored at each.
    #[default]
    EachLayer,
    /// At the nearest layer of an object by η^l, l the number of its layers, each of which has the opacity of the nearest (Eqs. 15
    /// and 16).
    Power,
    /// At the nearest layer of an object, once.
    Nearest,
}

/// What rays see that were bent or mirrored.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// Radiance from infinitely far, by a unit vector of the camera's space.
    pub sky: &'a (dyn Fn(Vec3) -> [f32; 3] + Sync),
    /// Opaque surfaces; without, they are seen straight on, as in the paper.
    pub solids: Option<&'a Solids<'a>>,
}

/// How matter that surfaces bound is drawn.
#[derive(Clone, Copy)]
pub struct Glass<'a> {
    /// Where rays are bent.
    pub bending: Bending,
    /// What they see.
    pub surroundings: Surroundings<'a>,
    /// World units in a unit of the cloud, for what is absorbed.
    pub unit: f32,
}

impl Surroundings<'_> {
    /// Radiance along a ray.
    fn radiance(&self, from: Vec3, along: Vec3) -> [f32; 3] {
        self.solids.and_then(|solids| solids.radiance(from, along)).unwrap_or_else(|| (self.sky)(along))
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
    /// Where the straight ray meets it, and how far along the ray that is.
    pub(crate) place: Vec3,
    pub(crate) distance: f32,
}

/// What a layer does to light beside its own opacity, by channel.
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
}

/// The way of a pixel's ray through its layers.
pub(crate) struct Path<'m> {
    /// Unit direction by channel.
    along: [Vec3; 3],
    /// Where it was bent last, by channel.
    place: [Vec3; 3],
    /// Where the straight ray was then.
    straight: Vec3,
    /// Objects that were entered and not left, and how far along the straight ray.
    inside: Vec<(u32, &'m Material, f32)>,
    /// The opacity of the nearest layer of each object that was met.
    nearest: Vec<(u32, [f32; 3])>,
    bent: bool,
}

impl<'m> Path<'m> {
    /// Begins at the eye, or the plane of parallel rays, along the unit vector of the pixel.
    pub(crate) fn begin(along: Vec3) -> Self {
        Self {
            along: [along; 3],
            place: [Vec3::ZERO; 3],
            straight: Vec3::ZERO,
            inside: Vec::new(),
            nearest: Vec::new(),
            bent: false,
        }
    }

    /// Through a layer.
    pub(crate) fn cross(&mut self, layer: &Bound<'m>, glass: &Glass<'_>, passage: &mut Passage) {
        let entered = self.inside.iter().position(|(object, ..)| *object == layer.object);
        match entered {
            Some(at) => {
                let (_, material, from) = self.inside.swap_remove(at);
                passage.inside = absorbed(material, (layer.distance - from) * glass.unit);
            }
            None => self.inside.push((layer.object, layer.material, layer.distance)),
        }
        let index = layer.material.index;
        if index == [1.0; 3] || (glass.bending != Bending::EachLayer && layer.rank > 0) {
            return;
        }
        self.follow(layer);
        // Rays of all channels go the same way until something disperses them.
        let rays = if index == [index[0]; 3] && self.are_one() { 1 } else { 3 };
        for ray in 0..rays {
            let ratio = match glass.bending {
                Bending::EachLayer if entered.is_some() => index[ray],
                Bending::EachLayer | Bending::Nearest => 1.0 / index[ray],
                Bending::Power => power(1.0 / index[ray], layer.layers),
            };
            let crossing = cross(self.along[ray], layer.normal, ratio);
            let share = crossing.reflectance;
            let seen =
                if share > 0.0 { glass.surroundings.radiance(self.place[ray], crossing.mirrored) } else { [0.0; 3] };
            for c in if rays == 1 { 0..3 } else { ray..ray + 1 } {
                self.along[c] = crossing.bent;
                passage.reflectance[c] = share;
                passage.mirrored[c] = share * seen[c];
            }
        }
        self.bent = true;
    }

    /// Whether the rays of all channels are the same.
    fn are_one(&self) -> bool {
        self.along == [self.along[0]; 3] && self.place == [self.place[0]; 3]
    }

    /// Opacity of a layer: where layers are counted, that of the nearest of its object (Eq. 15).
    pub(crate) fn opacity(&mut self, object: u32, own: [f32; 3], bending: Bending) -> [f32; 3] {
        if bending != Bending::Power {
            return own;
        }
        match self.nearest.iter().find(|(of, _)| *of == object) {
            Some((_, nearest)) => *nearest,
            None => {
                self.nearest.push((object, own));
                own
            }
        }
    }

    /// Brings the bent rays to the plane of a layer: they meet it beside the straight one. At most twice as far as that has gone, where they
    /// run nearly along it.
    fn follow(&mut self, layer: &Bound<'_>) {
        let gap = (layer.place - self.straight).length();
        for (place, along) in self.place.iter_mut().zip(self.along) {
            *place = if self.bent {
                let distance = layer.normal.dot(layer.place - *place) / layer.normal.dot(along);
                *place + along * if distance > 0.0 { distance.min(2.0 * gap) } else { 0.0 }
            } else {
                layer.place
            };
        }
        self.straight = layer.place;
    }

    /// Optical depth of matter that was entered and is seen up to an opaque surface at a distance along the ray.
    pub(crate) fn absorbed_before(&self, distance: f32, glass: &Glass<'_>) -> [f32; 3] {
        let of = |(_, material, from): &(u32, &Material, f32)| absorbed(material, (distance - from) * glass.unit);
        self.inside.iter().map(of).fold([0.0; 3], |sum, own| std::array::from_fn(|c| sum[c] + own[c]))
    }

    /// What is seen behind all layers where the ray has gone another way than straight on. `hits` tells whether an opaque surface lies
    /// straight on: without [`Surroundings::solids`] it is seen there.
    pub(crate) fn behind(&self, glass: &Glass<'_>, hits: bool) -> Option<[f32; 3]> {
        if !self.bent || (hits && glass.surroundings.solids.is_none()) {
            return None;
        }
        let first = glass.surroundings.radiance(self.place[0], self.along[0]);
        if self.are_one() {
            return Some(first);
        }
        let of = |c: usize| glass.surroundings.radiance(self.place[c], self.along[c])[c];
        Some([first[0], of(1), of(2)])
    }
}

fn absorbed(material: &Material, distance: f32) -> [f32; 3] {
    material.absorption_inside.map(|a| a * distance.max(0.0))
}

/// η^l, between numbers whose squares are no infinities.
fn power(ratio: f32, layers: u32) -> f32 {
    let log = f64::from(layers) * libm::log(f64::from(ratio));
    (libm::exp(log) as f32).clamp(1.0 / MOST_RATIO, MOST_RATIO)
}
