//! Points around the visible part of data, for cameras that are placed by it.

use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, DAabb, Footprint, Mesh, RawPoints, Similarity, SplatKind};

/// Points around data, in the data's coordinates.
#[derive(Debug)]
pub enum Outline<'a> {
    /// The corners of all triangles.
    Mesh(&'a Mesh),
    /// All points.
    Points(&'a RawPoints),
    /// These.
    Places(Vec<DVec3>),
}

impl<'a> Outline<'a> {
    /// Of points: of Gaussians the bulk.
    pub fn of_points(points: &'a RawPoints) -> Self {
        points.bulk().map_or(Self::Points(points), |bulk| Self::of_boxes([bulk]))
    }

    /// Of splats: octagons around discs, cubes around balls, as far as they are seen.
    pub fn of_splats(cloud: &Cloud) -> Self {
        Self::Places((0..cloud.len()).flat_map(|i| around(cloud, i)).collect())
    }

    /// Of boxes their corners.
    pub fn of_boxes(boxes: impl IntoIterator<Item = DAabb>) -> Self {
        Self::Places(boxes.into_iter().flat_map(|bounds| bounds.corners()).collect())
    }

    /// Gives all of them, led to the world by a transform.
    pub fn each(&self, transform: &Similarity, add: &mut dyn FnMut(DVec3)) {
        let mut add = |p: DVec3| add(transform.apply(p));
        match self {
            Self::Mesh(mesh) => {
                let corners = mesh.triangles.iter().flatten();
                corners.for_each(|v| add(mesh.origin + mesh.position[*v as usize].as_dvec3()));
            }
            Self::Points(points) => points.position.iter().for_each(|p| add(points.origin + p.as_dvec3())),
            Self::Places(places) => places.iter().copied().for_each(add),
        }
    }
}

/// Deviations of a translucent splat beyond which next to nothing is seen of it.
const SEEN: f32 = 2.0;

/// Corners around what is seen of a splat: of an opaque disc its core.
fn around(cloud: &Cloud, i: usize) -> [DVec3; 8] {
    let middle = cloud.origin + cloud.position[i].as_dvec3();
    let share = if cloud.kind[i] == SplatKind::Opaque { Footprint::CORE } else { SEEN / Footprint::default().cutoff };
    let normal = cloud.normal_of(i);
    let tangent = cloud.tangent_of(i);
    let radius = share * cloud.radius[i];
    if normal == Vec3::ZERO {
        return DAabb::around(middle, DVec3::splat(radius.into())).corners();
    }
    let is_round = tangent == Vec3::ZERO;
    let first = if is_round { normal.any_orthonormal_vector() * radius } else { share * tangent };
    let second = normal.cross(first.normalize()) * radius;
    let sin = std::f32::consts::FRAC_1_SQRT_2;
    let cos = libm::cosf(std::f32::consts::FRAC_PI_8);
    let corners =
        [(1.0, 0.0), (sin, sin), (0.0, 1.0), (-sin, sin), (-1.0, 0.0), (-sin, -sin), (0.0, -1.0), (sin, -sin)];
    corners.map(|(s, t)| middle + ((s * first + t * second) / cos).as_dvec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Splat;

    /// Half the sizes along the axes of what holds a splat, over the share of it that is seen.
    fn half_size(splat: Splat) -> Vec3 {
        let mut cloud = Cloud::new(DVec3::splat(1e6));
        cloud.push(&splat);
        let mut bounds = DAabb::EMPTY;
        Outline::of_splats(&cloud).each(&Similarity::default(), &mut |p| bounds = bounds.union(DAabb::new(p, p)));
        assert!((bounds.center() - DVec3::splat(1e6)).length() < 1e-6);
        (0.5 * bounds.size()).as_vec3() / if splat.kind == SplatKind::Opaque { Footprint::CORE } else { 2.0 / 3.0 }
    }

    #[test]
    fn corners_hold_discs_ellipses_and_balls_and_little_more() {
        let holds = |splat, expected: Vec3| {
            let over = half_size(splat) - expected;
            assert!(over.min_element() > -1e-5 && over.max_element() < 0.09 * expected.max_element(), "{over}");
        };
        let disc = Splat { radius: 2.0, normal: Vec3::new(0.6, 0.0, 0.8), kind: SplatKind::Opaque, ..Splat::default() };
        holds(disc, Vec3::new(1.6, 2.0, 1.2));
        let normal = Vec3::Z;
        let tangent = Vec3::new(3.0, 3.0, 0.0);
        let ellipse = Splat { radius: 1.0, normal, tangent, kind: SplatKind::Surface, ..Splat::default() };
        holds(ellipse, Vec3::new(9.5f32.sqrt(), 9.5f32.sqrt(), 0.0));
        holds(Splat { radius: 2.0, kind: SplatKind::Medium, ..Splat::default() }, Vec3::splat(2.0));
    }
}
