//! Fewer splats that stand for all: for pictures that have little time.

use crate::{Cloud, Gaussians, SplatKind, rng};

/// Stage of the random numbers that choose splats.
const STAGE: u64 = 0x6665_7765_7200;
/// An object keeps at least so many splats, or all that it has.
const LEAST: f64 = 64.0;

/// Opaque discs that lie at even distances on the whole are so much larger than those of a lattice, that they leave no gaps.
const OPAQUE_OVERLAP: f64 = 1.4;

/// What is kept of one object.
#[derive(Debug, Clone, Copy, Default)]
struct OfObject {
    /// Its splats.
    count: u64,
    /// Those that stand for them.
    kept: u64,
    /// Splats that were seen before the present one.
    rank: u64,
}

impl OfObject {
    /// Whether the splat of this rank is kept: of each run of `count / kept` splats that follow each other one is, by chance, so that lattices do
    /// not come through as stripes.
    fn keeps(&self, object: u64) -> bool {
        let run = u128::from(self.rank) * u128::from(self.kept) / u128::from(self.count);
        let first = |run: u128| (run * u128::from(self.count)).div_ceil(u128::from(self.kept)) as u64;
        let start = first(run);
        let length = first(run + 1) - start;
        self.rank == start + rng::bits(0, STAGE, object, run as u64) % length
    }
}

impl Cloud {
    /// About this share of each object's splats, above 0, at most 1, of a cloud in canonical order. Each stands for several: cross-sections grow
    /// so that every object keeps the sum of its own, and radii so that footprints cover as much of each other as before: by the square root of
    /// as many for discs, by the third root in media; opaque discs by up to 1.4 times more, so that they close gaps. Small objects keep 64 splats, and 3D Gaussians all, for their shapes are theirs.
    ///
    /// Canonical order follows a curve that fills space, and one splat is taken from each stretch of it, so that those that are kept lie
    /// evenly. Nothing depends on the order of the input or on threads.
    ///
    /// ```
    /// use splat_core::{Cloud, Splat, glam::{DVec3, Vec3}};
    /// let mut cloud = Cloud::new(DVec3::ZERO);
    /// (0..1000).for_each(|i| cloud.push(&Splat { position: Vec3::X * i as f32, ..Splat::default() }));
    /// cloud.canonicalize();
    /// let fewer = cloud.fewer(0.1);
    /// assert_eq!(fewer.len(), 100);
    /// assert_eq!(fewer.cross_section[0], 10.0 * cloud.cross_section[0]);
    /// ```
    pub fn fewer(&self, share: f64) -> Cloud {
        self.fewer_of_each(|_| share)
    }

    /// The same with a share for each object, by its rank.
    pub fn fewer_of_each(&self, share: impl Fn(usize) -> f64) -> Cloud {
        let is_whole = |i: usize| self.gaussian.get(i).is_some_and(|gaussian| *gaussian != Gaussians::NONE);
        let mut objects: Vec<OfObject> = Vec::new();
        for (_, object) in self.object.iter().enumerate().filter(|(i, _)| !is_whole(*i)) {
            let object = *object as usize;
            if object >= objects.len() {
                objects.resize(object + 1, OfObject::default());
            }
            objects[object].count += 1;
        }
        for (rank, object) in objects.iter_mut().enumerate() {
            let kept = libm::ceil((object.count as f64 * share(rank)).max(LEAST)) as u64;
            object.kept = kept.min(object.count);
        }
        let mut kept: Vec<u32> = Vec::new();
        for (i, object) in self.object.iter().enumerate() {
            if is_whole(i) {
                kept.push(i as u32);
                continue;
            }
            let of_object = &mut objects[*object as usize];
            if of_object.keeps(u64::from(*object)) {
                kept.push(i as u32);
            }
            of_object.rank += 1;
        }
        let mut cloud = self.gather(&kept);
        for (i, whole) in kept.iter().enumerate().filter(|(_, whole)| !is_whole(**whole as usize)) {
            let object = &objects[self.object[*whole as usize] as usize];
            let times = object.count as f64 / object.kept as f64;
            let wider = match cloud.kind[i] {
                SplatKind::Medium => libm::cbrt(times),
                SplatKind::Surface => times.sqrt(),
                // Nothing shows through gaps of an opaque surface that a lattice did not have.
                SplatKind::Opaque => times.sqrt() * times.sqrt().min(OPAQUE_OVERLAP),
            } as f32;
            cloud.radius[i] *= wider;
            cloud.cross_section[i] = (f64::from(cloud.cross_section[i]) * times) as f32;
            if let Some(tangent) = cloud.tangent.get_mut(i) {
                *tangent *= wider;
            }
        }
        cloud
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Splat;
    use glam::{DVec3, Vec3};

    /// A lattice of a medium, object 0, and a square of discs, object 1.
    fn cloud() -> Cloud {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..32 * 32 * 32 {
            let position = Vec3::new((i % 32) as f32, (i / 32 % 32) as f32, (i / 1024) as f32);
            cloud.push(&Splat { position, radius: 2.0, cross_section: 0.5, ..Splat::default() });
        }
        for i in 0..64 * 64 {
            let position = Vec3::new((i % 64) as f32, (i / 64) as f32, -9.0);
            let disc = Splat { position, kind: SplatKind::Surface, object: 1, ..Splat::default() };
            cloud.push(&Splat { normal: Vec3::Z, tangent: Vec3::X, ..disc });
        }
        cloud.canonicalize();
        cloud
    }

    fn of_object(cloud: &Cloud, object: u32) -> Vec<usize> {
        (0..cloud.len()).filter(|i| cloud.object[*i] == object).collect()
    }

    #[test]
    fn objects_keep_their_extinction_and_footprints_their_overlap() {
        let whole = cloud();
        for share in [0.5, 0.3, 0.125, 0.01] {
            let fewer = whole.fewer(share);
            for (object, dimensions) in [(0, 3.0), (1, 2.0)] {
                let before = of_object(&whole, object);
                let after = of_object(&fewer, object);
                let expected = (before.len() as f64 * share).max(LEAST).ceil();
                assert_eq!(after.len() as f64, expected, "{share}");
                let sum =
                    |cloud: &Cloud, ids: &[usize]| ids.iter().map(|i| f64::from(cloud.cross_section[*i])).sum::<f64>();
                let kept = sum(&fewer, &after) / sum(&whole, &before);
                assert!((kept - 1.0).abs() < 1e-6, "{share}: {kept}");
                let wider = f64::from(fewer.radius[after[0]]) / f64::from(whole.radius[before[0]]);
                let times = before.len() as f64 / after.len() as f64;
                assert!((wider.powf(dimensions) / times - 1.0).abs() < 1e-6, "{share}: {wider}");
            }
            let disc = of_object(&fewer, 1)[0];
            assert_eq!(fewer.tangent[disc].length(), fewer.radius[disc]);
        }
    }

    #[test]
    fn those_that_are_kept_lie_evenly() {
        let fewer = cloud().fewer(0.125);
        let mut counts = [0u32; 64];
        for i in of_object(&fewer, 0) {
            let [x, y, z] = fewer.position[i].to_array().map(|p| p as usize / 8);
            counts[x + 4 * (y + 4 * z)] += 1;
        }
        // One of eight of 512 in every cube; by chance alone a standard deviation would be 7.
        assert!(counts.iter().all(|count| count.abs_diff(64) <= 8), "{counts:?}");
    }

    #[test]
    fn all_of_them_are_what_they_were_and_small_objects_stay() {
        let whole = cloud();
        assert_eq!(whole.fewer(1.0), whole);
        let mut small = Cloud::new(DVec3::ZERO);
        (0..5).for_each(|i| small.push(&Splat { position: Vec3::X * i as f32, ..Splat::default() }));
        small.canonicalize();
        assert_eq!(small.fewer(1e-6), small);
        assert_eq!(Cloud::default().fewer(0.5), Cloud::default());
    }

    #[test]
    fn gaussians_are_kept_whole() {
        let mut cloud = cloud();
        cloud.gaussian = vec![Gaussians::NONE; cloud.len()];
        let gaussian = of_object(&cloud, 1)[7];
        cloud.gaussian[gaussian] = 3;
        let fewer = cloud.fewer(0.02);
        let kept: Vec<usize> = (0..fewer.len()).filter(|i| fewer.gaussian[*i] == 3).collect();
        assert_eq!(kept.len(), 1);
        assert_eq!(fewer.get(kept[0]), cloud.get(gaussian));
    }
}
