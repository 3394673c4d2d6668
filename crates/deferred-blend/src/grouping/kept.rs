//! Groups that are valid for every view. They are kept by the places of the discs on their object, and found again after the object has moved.

use super::{Membership, Recipe};
use crate::Error;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Progress, Similarity};
use std::collections::BTreeMap;

/// Share of its radius by which a disc may have moved on its object, by rounding, and is still the same.
const NEAR: f64 = 1.0 / 64.0;

/// Along which discs are sorted: of unit length, and such that planes of a lattice do not lie across it.
const ALONG: DVec3 = DVec3::new(0.754_877_666, 0.569_840_291, 0.324_717_957);

/// A disc on its object.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    along: f64,
    at: DVec3,
    /// Rank among the discs that the groups are of.
    disc: u32,
}

/// The groups of an object's discs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KeptGroups {
    /// By rising `along`.
    places: Vec<Place>,
    /// Of the smallest disc.
    radius: f64,
    membership: Membership,
}

impl KeptGroups {
    /// Keeps groups of discs that lie at these places of their object; `radius` is that of the smallest disc, in the same unit.
    ///
    /// # Panics
    /// If there are not as many places as discs.
    pub fn new(places: &[DVec3], radius: f64, membership: Membership) -> Self {
        assert_eq!(places.len(), membership.discs(), "invariant: one place a disc");
        Self { places: sorted(places), radius, membership }
    }

    /// The groups of the same discs in another order, or `None` where they are not the same.
    ///
    /// Discs that lie nearer to one another than a 64th of the radius may take one another's groups.
    pub fn for_discs(&self, places: &[DVec3], radius: f64) -> Option<Membership> {
        let near = NEAR * self.radius;
        if places.len() != self.places.len() || (radius - self.radius).abs() > near {
            return None;
        }
        let mut first = 0;
        let mut is_taken = vec![false; self.places.len()];
        let mut from = vec![0; places.len()];
        for sought in sorted(places) {
            while first < is_taken.len() && (is_taken[first] || self.places[first].along < sought.along - near) {
                first += 1;
            }
            let reach = self.places[first..].iter().take_while(|place| place.along <= sought.along + near);
            let free = (first..).zip(reach).filter(|(k, _)| !is_taken[*k]);
            let distance = |place: &Place| place.at.distance_squared(sought.at);
            let (k, nearest) = free.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))?;
            if distance(nearest) > near * near {
                return None;
            }
            is_taken[k] = true;
            from[sought.disc as usize] = nearest.disc;
        }
        Some(self.membership.rearranged(&from))
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.membership.bytes() + size_of_val(&*self.places) as u64
    }

    /// Bytes of the places of so many discs, kept and looked for.
    pub const fn place_bytes(discs: u64) -> u64 {
        discs * (2 * size_of::<Place>() as u64 + size_of::<DVec3>() as u64 + 5)
    }
}

/// Groups of objects by their ranks, and how they were made: for pictures that follow one another.
#[derive(Debug, Clone, Default)]
pub struct GroupsOfObjects(BTreeMap<usize, (Recipe, KeptGroups)>);

/// The groups of an object's discs.
pub struct ObjectMembers {
    /// By place in the object's cloud.
    pub membership: Membership,
    /// Whether the discs were grouped anew, because no kept groups fit them.
    pub is_new: bool,
}

/// The groups of the discs of several objects.
pub struct CloudMembers {
    /// By place in the cloud.
    pub membership: Membership,
    /// Number of discs that were grouped anew.
    pub regrouped: u64,
}

/// An object whose discs cannot be grouped.
#[derive(Debug)]
pub struct ObjectError {
    /// The object's rank.
    pub object: usize,
    /// The reason.
    pub error: Error,
}

impl GroupsOfObjects {
    /// Groups the discs of object `rank`, which `transform` has brought into the world. Returns the kept groups if the object has only
    /// moved, else groups the discs anew and keeps the groups.
    ///
    /// # Errors
    /// As [`Recipe::group`].
    pub fn members(
        &mut self,
        rank: usize,
        cloud: &Cloud,
        transform: &Similarity,
        recipe: &Recipe,
        progress: Option<&Progress>,
    ) -> Result<ObjectMembers, Error> {
        let Similarity { scale, rotation, translation } = *transform;
        let place = |p: &Vec3| rotation.inverse() * (cloud.origin + p.as_dvec3() - translation) / scale;
        let places: Vec<DVec3> = cloud.position.iter().map(place).collect();
        let radius = f64::from(cloud.radius.iter().copied().fold(f32::INFINITY, f32::min)) / scale;
        let kept = self.0.get(&rank).filter(|(kept, _)| kept == recipe);
        if let Some(membership) = kept.and_then(|(_, groups)| groups.for_discs(&places, radius)) {
            return Ok(ObjectMembers { membership, is_new: false });
        }
        let membership = recipe.group(cloud, progress)?;
        self.0.insert(rank, (*recipe, KeptGroups::new(&places, radius, membership.clone())));
        Ok(ObjectMembers { membership, is_new: true })
    }

    /// Groups the discs `ids` of a cloud, each object's separately. `placed_recipe` returns an object's transform to the world, and the
    /// recipe of its groups.
    ///
    /// # Errors
    /// As [`Recipe::group`], with the object's rank.
    pub fn members_of_all(
        &mut self,
        cloud: &Cloud,
        ids: &[u32],
        placed_recipe: impl Fn(usize) -> (Similarity, Recipe),
        progress: Option<&Progress>,
    ) -> Result<CloudMembers, ObjectError> {
        let mut of_object: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for &id in ids {
            of_object.entry(cloud.object[id as usize] as usize).or_default().push(id);
        }
        let mut parts = Vec::new();
        let mut regrouped = 0;
        for (&rank, ids) in &of_object {
            let (transform, recipe) = placed_recipe(rank);
            let discs = cloud.gather(ids);
            let members = self.members(rank, &discs, &transform, &recipe, progress);
            let ObjectMembers { membership, is_new } = members.map_err(|error| ObjectError { object: rank, error })?;
            regrouped += if is_new { ids.len() as u64 } else { 0 };
            parts.push((ids.as_slice(), membership));
        }
        Ok(CloudMembers { membership: Membership::join(cloud.len(), &parts), regrouped })
    }
}

fn sorted(places: &[DVec3]) -> Vec<Place> {
    let place = |(disc, at): (u32, &DVec3)| Place { along: at.dot(ALONG), at: *at, disc };
    let mut sorted: Vec<Place> = (0..).zip(places).map(place).collect();
    sorted.sort_unstable_by(|a, b| a.along.total_cmp(&b.along).then(a.disc.cmp(&b.disc)));
    sorted
}
