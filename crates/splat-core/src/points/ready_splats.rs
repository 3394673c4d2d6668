//! Points that are splats already: what a file of rendering-oriented points holds (Gunjee 2007, section 3), one column an attribute.

use crate::splat_file::{COLUMNS, SplatColumn, SplatColumns};
use crate::{Cloud, DAabb};
use glam::DVec3;
use std::collections::BTreeMap;

/// Splats as a file has them, and the kernels that their radii are of.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadySplats {
    /// The splats, in the axes and the unit of the file; their ids of materials, footprints and objects are those of the scene that they were
    /// made in.
    pub cloud: Cloud,
    /// Where each of its footprints is cut, in standard deviations, by id.
    pub cutoffs: Vec<f32>,
}

/// Thickness of a ground at most, over its own size.
const FLAT: f64 = 1e-3;
/// Size of a ground at least, over that of all that stands on it.
const WIDE: f64 = 2.0;

impl ReadySplats {
    /// Bounds of all objects but the ground, a flat one at least twice as large as all others together; `None` where there is none.
    pub fn on_ground(&self) -> Option<DAabb> {
        let cloud = &self.cloud;
        let mut middles: BTreeMap<u32, DAabb> = BTreeMap::new();
        let mut whole: BTreeMap<u32, DAabb> = BTreeMap::new();
        for ((object, position), radius) in cloud.object.iter().zip(&cloud.position).zip(&cloud.radius) {
            let place = cloud.origin + position.as_dvec3();
            let middle = middles.entry(*object).or_insert(DAabb::EMPTY);
            *middle = middle.union(DAabb::new(place, place));
            let around = whole.entry(*object).or_insert(DAabb::EMPTY);
            *around = around.union(DAabb::around(place, DVec3::splat(f64::from(*radius))));
        }
        let ground = middles.iter().max_by(|a, b| a.1.diagonal().total_cmp(&b.1.diagonal()))?;
        let others = whole.iter().filter(|other| other.0 != ground.0).map(|other| *other.1);
        let others = others.fold(DAabb::EMPTY, DAabb::union);
        let is_flat = ground.1.size().min_element() <= FLAT * ground.1.diagonal();
        let is_wide = !others.is_empty() && ground.1.diagonal() >= WIDE * others.diagonal();
        (is_flat && is_wide).then_some(others)
    }

    /// Numbers of a column beside places, by its name in a file.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.columns().find(|column| column.name == name)?;
        Some((0..self.cloud.len()).map(|i| (column.get)(&self.cloud.get(i))).collect())
    }

    /// The columns beside places that these splats have.
    pub fn columns(&self) -> impl Iterator<Item = &'static SplatColumn> {
        let some = |group: &&SplatColumns| {
            !self.cloud.is_empty() && group.is_there.is_none_or(|is_there| is_there(&self.cloud))
        };
        COLUMNS.iter().skip(1).filter(some).flat_map(|group| group.columns)
    }

    /// Name, least and greatest number of each of those columns.
    pub fn ranges(&self) -> Vec<(String, [f64; 2])> {
        let range = |column: &SplatColumn| {
            let numbers = (0..self.cloud.len()).map(|i| (column.get)(&self.cloud.get(i)));
            numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)])
        };
        self.columns().map(|column| (column.name.to_owned(), range(column))).collect()
    }

    /// Those that are kept.
    pub fn chosen(&self, keeps: &[bool]) -> Self {
        let ids: Vec<u32> = (0..self.cloud.len() as u32).filter(|i| keeps[*i as usize]).collect();
        Self { cloud: self.cloud.gather(&ids), cutoffs: self.cutoffs.clone() }
    }

    /// How many are a medium, translucent surfaces, and opaque ones.
    pub fn kinds(&self) -> [u64; 3] {
        let mut counts = [0; 3];
        self.cloud.kind.iter().for_each(|kind| counts[*kind as usize] += 1);
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Splat;
    use glam::Vec3;

    /// Splats of one object along a diagonal of a box.
    fn add(ready: &mut ReadySplats, object: u32, low: Vec3, high: Vec3) {
        for k in 0..5 {
            let position = low.lerp(high, k as f32 / 4.0);
            ready.cloud.push(&Splat { position, object, radius: 0.5, ..Splat::default() });
        }
    }

    #[test]
    fn a_wide_flat_object_is_the_ground_of_the_others() {
        let mut ready = ReadySplats::default();
        add(&mut ready, 0, Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 3.0, 1.0));
        assert_eq!(ready.on_ground(), None, "it stands alone");
        add(&mut ready, 1, Vec3::new(-40.0, 0.0, -40.0), Vec3::new(40.0, 0.0, 40.0));
        let bounds = ready.on_ground().expect("it stands on the second");
        assert_eq!((bounds.min, bounds.max), (DVec3::new(-1.5, -0.5, -1.5), DVec3::new(1.5, 3.5, 1.5)));
        // A wall as large as what stands before it, and a hill, are seen.
        let mut wall = ReadySplats::default();
        add(&mut wall, 0, Vec3::splat(-1.0), Vec3::splat(1.0));
        add(&mut wall, 1, Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(wall.on_ground(), None);
        add(&mut wall, 2, Vec3::new(-40.0, 0.0, -40.0), Vec3::new(40.0, 2.0, 40.0));
        assert_eq!(wall.on_ground(), None);
    }
}
