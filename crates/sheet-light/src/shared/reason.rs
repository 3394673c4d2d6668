//! Why half vectors cannot serve a light.

use splat_core::glam::DVec3;

/// Least cosine at which a ray of the eye or of the light may meet the slabs' normal: it crosses a slab of width w on a way of at
/// most w/[`LEAST_COSINE`].
pub const LEAST_COSINE: f64 = 0.2;

/// How far a point of a light may lie from its centre across the slabs, of the centre's distance to the nearest volume.
pub const MOST_DEPTH: f64 = 0.4;

/// Why half vectors cannot serve a light: it takes a shadow map instead.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Reason {
    /// No direction bisects light and view for all of a volume around the lamp.
    #[error("the lamp at {position} lies inside volume {volume}, expected outside")]
    LampInside {
        /// Place of the volume in the input.
        volume: usize,
        /// World position of the lamp.
        position: DVec3,
    },
    /// The same, where the lamp lies in the bounds of the splats.
    #[error("the lamp at {position} lies among the splats, expected outside of their bounds")]
    LampAmong {
        /// World position of the lamp.
        position: DVec3,
    },
    /// Light of a near lamp runs along the slabs somewhere in the volumes, or crosses them backwards.
    #[error(
        "light meets the normal of the slabs at a cosine of {cosine:.3}, expected at least {LEAST_COSINE}: the lamp is too near"
    )]
    LightAlongSlabs {
        /// The least cosine in the volumes.
        cosine: f64,
    },
    /// View rays of a wide lens do.
    #[error(
        "view rays meet the normal of the slabs at a cosine of {cosine:.3}, expected at least {LEAST_COSINE}: the lens is too wide"
    )]
    ViewAlongSlabs {
        /// The least cosine of what is in the picture.
        cosine: f64,
    },
    /// Points of a light with an extent lie too unequally far from the slabs.
    #[error(
        "the light's points lie up to {share:.2} of its distance nearer to the slabs or farther, expected at most {MOST_DEPTH}"
    )]
    TooLarge {
        /// The farthest point's distance to the centre across the slabs over that of the centre to the nearest volume.
        share: f64,
    },
    /// Light of a sphere, a disk or a rectangle comes from many directions.
    #[error("the light has an extent, expected a point of it, or `HalfInput::extended`")]
    Extended,
}
