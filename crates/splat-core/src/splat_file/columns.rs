//! What a file of splats stores of each splat.

use crate::{Cloud, Splat, SplatKind};

/// The version of the format. Readers refuse others.
pub const VERSION: &str = "1";

/// The element that holds packed splats, a byte an entry.
pub const PACKED: &str = "packed";

/// How a column is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// Single precision.
    Float,
    /// Eight bits, up to a number.
    Byte(u8),
    /// 16 bits.
    Short,
    /// 32 bits.
    Word,
}

impl Stored {
    /// The largest whole number, where it is of such.
    pub fn most(self) -> Option<f64> {
        match self {
            Self::Float => None,
            Self::Byte(most) => Some(most.into()),
            Self::Short => Some(u16::MAX.into()),
            Self::Word => Some(u32::MAX.into()),
        }
    }
}

/// One number of a splat in a file.
pub struct SplatColumn {
    /// Its name in the file.
    pub name: &'static str,
    /// How the file stores it.
    pub stored: Stored,
    /// The number of a splat.
    pub get: fn(&Splat) -> f64,
    /// Gives a splat this number, which its storage holds.
    pub set: fn(&mut Splat, f64),
}

/// Columns that belong together: a file has all of them, or none where it may lack them.
pub struct SplatColumns {
    /// What they are, for whoever looks into a file.
    pub meaning: &'static str,
    /// Whether a cloud has them; `None` where every cloud does.
    pub is_there: Option<fn(&Cloud) -> bool>,
    /// The columns.
    pub columns: &'static [SplatColumn],
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
pub static COLUMNS: [SplatColumns; 11] = [
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
