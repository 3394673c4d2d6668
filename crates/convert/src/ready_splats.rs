//! Points that are splats already: what a file of rendering-oriented points holds (Gunjee 2007, section 3), one column an attribute.

use splat_core::{Cloud, DAabb, Splat, SplatKind, glam::DVec3};
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

/// How a column is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stored {
    Float,
    /// Eight bits, up to a number.
    Byte(u8),
    /// 16 bits.
    Short,
    /// 32 bits.
    Word,
}

#[cfg_attr(not(feature = "ply"), allow(dead_code, reason = "files of splats are PLY"))]
impl Stored {
    /// The largest whole number, where it is of such.
    pub(crate) fn most(self) -> Option<f64> {
        match self {
            Self::Float => None,
            Self::Byte(most) => Some(most.into()),
            Self::Short => Some(u16::MAX.into()),
            Self::Word => Some(u32::MAX.into()),
        }
    }
}

/// One number of a splat in a file.
pub(crate) struct SplatColumn {
    pub(crate) name: &'static str,
    pub(crate) stored: Stored,
    pub(crate) get: fn(&Splat) -> f64,
    #[cfg_attr(not(feature = "ply"), allow(dead_code, reason = "files of splats are PLY"))]
    pub(crate) set: fn(&mut Splat, f64),
}

/// Columns that belong together: a file has all of them, or none where it may lack them.
pub(crate) struct SplatColumns {
    /// What they are, for whoever looks into a file.
    pub(crate) meaning: &'static str,
    /// Whether a cloud has them; `None` where every cloud does.
    pub(crate) is_there: Option<fn(&Cloud) -> bool>,
    pub(crate) columns: &'static [SplatColumn],
}

macro_rules! column {
    ($name:literal, $stored:expr, $($field:tt)+) => {
        SplatColumn {
            name: $name,
            stored: $stored,
            get: |splat| f64::from(splat.$($field)+),
            set: |splat, number| splat.$($field)+ = number as _,
        }
    };
}

/// All columns, in the order in which they are written.
pub(crate) static COLUMNS: [SplatColumns; 11] = [
    SplatColumns {
        meaning: "centre, relative to the origin",
        is_there: None,
        columns: &[
            column!("x", Stored::Float, position.x),
            column!("y", Stored::Float, position.y),
            column!("z", Stored::Float, position.z),
        ],
    },
    SplatColumns {
        meaning: "cutoff radius of the kernel; of a disc with a tangent its second semi-axis",
        is_there: None,
        columns: &[column!("radius", Stored::Float, radius)],
    },
    SplatColumns {
        meaning: "extinction cross-section, an area; of an opaque disc the area that it stands for",
        is_there: None,
        columns: &[column!("cross_section", Stored::Float, cross_section)],
    },
    SplatColumns {
        meaning: "linear Rec.709 colour",
        is_there: None,
        columns: &[
            column!("red", Stored::Float, color[0]),
            column!("green", Stored::Float, color[1]),
            column!("blue", Stored::Float, color[2]),
        ],
    },
    SplatColumns {
        meaning: "0 medium, 1 translucent surface, 2 opaque surface; ids of material, footprint and object in the scene of its making",
        is_there: None,
        columns: &[
            SplatColumn {
                name: "kind",
                stored: Stored::Byte(SplatKind::Opaque as u8),
                get: |splat| f64::from(splat.kind as u8),
                set: |splat, number| {
                    let kinds = [SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque];
                    splat.kind = kinds[(number as usize).min(2)];
                },
            },
            column!("material", Stored::Short, material),
            column!("footprint", Stored::Byte(u8::MAX), footprint),
            column!("object", Stored::Word, object),
        ],
    },
    SplatColumns {
        meaning: "unit normal that a disc lies across, or zero for none",
        is_there: Some(|cloud| !cloud.normal.is_empty()),
        columns: &[
            column!("nx", Stored::Float, normal.x),
            column!("ny", Stored::Float, normal.y),
            column!("nz", Stored::Float, normal.z),
        ],
    },
    SplatColumns {
        meaning: "unit normal that light is reflected about, or zero where that is the other",
        is_there: Some(|cloud| !cloud.shading_normal.is_empty()),
        columns: &[
            column!("shading_nx", Stored::Float, shading_normal.x),
            column!("shading_ny", Stored::Float, shading_normal.y),
            column!("shading_nz", Stored::Float, shading_normal.z),
        ],
    },
    SplatColumns {
        meaning: "first semi-axis of an elliptical disc, or zero for a round one",
        is_there: Some(|cloud| !cloud.tangent.is_empty()),
        columns: &[
            column!("tx", Stored::Float, tangent.x),
            column!("ty", Stored::Float, tangent.y),
            column!("tz", Stored::Float, tangent.z),
        ],
    },
    SplatColumns {
        meaning: "share of a shadow that is received",
        is_there: Some(|cloud| !cloud.shadow_coefficient.is_empty()),
        columns: &[column!("shadow_coefficient", Stored::Float, shadow_coefficient)],
    },
    SplatColumns {
        meaning: "physical value that the splat was made from",
        is_there: Some(|cloud| !cloud.value.is_empty()),
        columns: &[column!("value", Stored::Float, value)],
    },
    SplatColumns {
        meaning: "optical depth of one crossing of a translucent surface, 0 where it is not known",
        is_there: Some(|cloud| !cloud.crossing_depth.is_empty()),
        columns: &[column!("crossing_depth", Stored::Float, crossing_depth)],
    },
];

/// Thickness of a ground at most, over its own size.
const FLAT: f64 = 1e-3;
/// Size of a ground at least, over that of all that stands on it.
const WIDE: f64 = 2.0;

impl ReadySplats {
    /// Bounds of all objects but the ground, a flat one at least twice as large as all others together; `None` where there is none.
    pub(crate) fn on_ground(&self) -> Option<DAabb> {
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
    pub(crate) fn column(&self, name: &str) -> Option<Vec<f64>> {
        let of = self.columns().find(|column| column.name == name)?;
        Some((0..self.cloud.len()).map(|i| (of.get)(&self.cloud.get(i))).collect())
    }

    /// The columns beside places that these splats have.
    pub(crate) fn columns(&self) -> impl Iterator<Item = &'static SplatColumn> {
        let some =
            |of: &&SplatColumns| !self.cloud.is_empty() && of.is_there.is_none_or(|is_there| is_there(&self.cloud));
        COLUMNS.iter().skip(1).filter(some).flat_map(|of| of.columns)
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
    pub(crate) fn chosen(&self, keeps: &[bool]) -> Self {
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
    use splat_core::glam::Vec3;

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
