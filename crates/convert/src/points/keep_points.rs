//! Which points of a cloud are kept: by the numbers of their columns, and by where they lie.

use splat_core::glam::DVec3;
use splat_core::{Clip, Column, PointLattice, RawPoints};

/// The numbers of a column that are kept. Gaps, see [`Column`], never are.
#[derive(Debug, Clone, PartialEq)]
pub enum Within {
    /// From the lowest to the highest, both of them too.
    Range([f64; 2]),
    /// These alone.
    Among(Vec<f64>),
}

/// A column and which of its numbers are kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Name of the column, see [`RawPoints::column`].
    pub column: String,
    /// Its numbers.
    pub within: Within,
}

impl Within {
    fn keeps(&self, number: f64) -> bool {
        match self {
            Self::Range([low, high]) => (*low..=*high).contains(&number),
            Self::Among(numbers) => numbers.contains(&number),
        }
    }
}

/// The points that lie in all of the regions and have a number in each of the columns that is kept; `up` is where `height` grows.
/// A column that the points have not keeps none of them.
///
/// ```
/// use convert::{Kept, Within, kept};
/// use splat_core::RawPoints;
/// use splat_core::glam::{DVec3, Vec3};
/// let points = RawPoints { position: vec![Vec3::ZERO; 3], classification: vec![2, 5, 6], ..RawPoints::default() };
/// let buildings = [Kept { column: "classification".into(), within: Within::Among(vec![6.0]) }];
/// assert_eq!(kept(&points, &buildings, &[], DVec3::Z).classification, [6]);
/// ```
pub fn kept(points: &RawPoints, by: &[Kept], clips: &[Clip], up: DVec3) -> RawPoints {
    let mut keeps: Vec<bool> =
        (0..points.len()).map(|i| clips.iter().all(|clip| clip.keeps(points.exact_position(i)))).collect();
    for Kept { column, within } in by {
        let numbers = points.column(column, up).unwrap_or_else(|| vec![f64::NAN; points.len()]);
        keeps.iter_mut().zip(numbers).for_each(|(keeps, number)| *keeps &= within.keeps(number));
    }
    RawPoints {
        origin: points.origin,
        position: chosen(&points.position, &keeps),
        normal: chosen(&points.normal, &keeps),
        color: chosen(&points.color, &keeps),
        value: chosen(&points.value, &keeps),
        is_intensity: points.is_intensity,
        opacity: chosen(&points.opacity, &keeps),
        classification: chosen(&points.classification, &keeps),
        columns: points
            .columns
            .iter()
            .map(|c| Column { name: c.name.clone(), values: chosen(&c.values, &keeps) })
            .collect(),
        cells: chosen(&points.cells, &keeps),
        lattice: points.lattice.as_ref().map(|l| PointLattice {
            steps: chosen(&l.steps, &keeps),
            offset: l.offset,
            scale: l.scale,
        }),
        dropped: points.dropped,
        gaussians: points.gaussians.chosen(&keeps),
        ready: points.ready.chosen(&keeps),
    }
}

/// The entries of a column that are kept; an empty column stays empty.
fn chosen<T: Copy>(column: &[T], keeps: &[bool]) -> Vec<T> {
    column.iter().zip(keeps).filter(|(_, keeps)| **keeps).map(|(entry, _)| *entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::DAabb;
    use splat_core::glam::Vec3;

    /// Points at 0, 1, … 9 along x, far from the origin.
    fn row() -> RawPoints {
        let tens = (0..10).map(|i| if i == 4 { f64::NAN } else { f64::from(10 * i) }).collect();
        RawPoints {
            origin: DVec3::new(1e7, 0.0, 0.0),
            position: (0..10).map(|i| Vec3::X * i as f32).collect(),
            value: (0..10).map(|i| i as f32).collect(),
            classification: (0..10).map(|i| i % 3).collect(),
            columns: vec![Column { name: "tens".into(), values: tens }],
            ..RawPoints::default()
        }
    }

    fn values(by: &[(&str, Within)], clips: &[Clip]) -> Vec<f32> {
        let by: Vec<Kept> = by.iter().map(|(column, w)| Kept { column: (*column).into(), within: w.clone() }).collect();
        let found = kept(&row(), &by, clips, DVec3::Y);
        assert!(found.validate().is_ok());
        found.value
    }

    #[test]
    fn ranges_have_both_ends_and_gaps_are_never_kept() {
        assert_eq!(values(&[("tens", Within::Range([20.0, 50.0]))], &[]), [2.0, 3.0, 5.0]);
        assert_eq!(values(&[("class", Within::Among(vec![0.0, 9.0]))], &[]), [0.0, 3.0, 6.0, 9.0]);
        assert_eq!(
            values(&[("class", Within::Among(vec![0.0])), ("value", Within::Range([1.0, 6.0]))], &[]),
            [3.0, 6.0]
        );
        assert!(values(&[("nothing", Within::Range([0.0, 1.0]))], &[]).is_empty());
    }

    #[test]
    fn regions_cut_at_places_of_the_file_however_far_away() {
        let half = Clip::HalfSpace { normal: DVec3::X * 2.0, offset: 2e7 + 6.0 };
        assert_eq!(values(&[], &[half]), [0.0, 1.0, 2.0, 3.0]);
        let boxed = Clip::Box(DAabb::new(DVec3::new(1e7 + 2.0, -1.0, -1.0), DVec3::new(1e7 + 9.0, 1.0, 1.0)));
        assert_eq!(values(&[], &[half, boxed]), [2.0, 3.0]);
        assert_eq!(kept(&row(), &[], &[], DVec3::Y).len(), 10);
    }
}
