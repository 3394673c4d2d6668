//! Which axis of data points up.

use glam::DVec3;

/// The axis of a data file that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// As meshes mostly have it, and for formats that say nothing.
    #[default]
    Y,
    /// Elevation in LAS, LAZ and E57; superior in NIfTI, in MetaImage and in an NRRD whose `space` is one of a body.
    Z,
    /// The other way: 3D Gaussians of PLY and `.splat`, whose y points down as in the cameras that they were trained for.
    MinusY,
}

impl UpAxis {
    /// The unit vector along it.
    pub fn direction(self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
            Self::MinusY => DVec3::NEG_Y,
        }
    }

    /// Its letter.
    pub fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusY => "-y",
        }
    }
}
