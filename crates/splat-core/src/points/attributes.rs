//! The columns that say what a point looks like, and what their numbers may be: how large it is and where it lies, how much it absorbs,
//! and how much of a shadow it takes.

/// The kernel's reach: beyond that length of the file a point of matter has none. Of a disc the length within which it hides.
pub const RADIUS: &str = "radius";
/// Half the kernel's reach, as the kernels of smoothed particles end at twice this length (Monaghan 1992).
pub const SMOOTHING_LENGTH: &str = "smoothing_length";
/// A factor of the object's extinction.
pub const EXTINCTION: &str = "extinction";
/// What the object's extinction is multiplied by in the place of a volume.
pub const MASS: &str = "mass";
/// One semi-axis of a disc, its length that within which the disc hides.
pub const TANGENT: [&str; 3] = ["tx", "ty", "tz"];
/// Share of a shadow that a point receives.
pub const SHADOW_COEFFICIENT: &str = "shadow_coefficient";

/// The footprint of a disc, by its place in the scene's list.
pub const FOOTPRINT: &str = "footprint";

/// The material of a disc, by its place in the object's list.
pub const MATERIAL: &str = "material";

/// The columns of discs; those of points that are a medium are all.
const OF_DISCS: [&str; 7] = [RADIUS, TANGENT[0], TANGENT[1], TANGENT[2], SHADOW_COEFFICIENT, FOOTPRINT, MATERIAL];
const OF_MATTER: [&str; 3] = [SMOOTHING_LENGTH, EXTINCTION, MASS];

/// Whether its numbers are names of things, of which there is no mean.
pub fn is_id(column: &str) -> bool {
    [FOOTPRINT, MATERIAL].contains(&column)
}

/// The name, where it is that of an attribute: of discs, or of matter too.
pub fn attribute(column: &str, matter: bool) -> Option<&'static str> {
    let of_matter = if matter { &OF_MATTER[..] } else { &[] };
    OF_DISCS.iter().chain(of_matter).copied().find(|name| *name == column)
}

/// What a number of an attribute has to be, in words, where it is not that.
pub fn expected(column: &str, number: f64) -> Option<&'static str> {
    match column {
        EXTINCTION | MASS if !(number.is_finite() && number >= 0.0) => Some("a finite number from 0 on"),
        RADIUS | SMOOTHING_LENGTH if !(number.is_finite() && number > 0.0) => Some("a finite length above 0"),
        FOOTPRINT if !((0.0..=255.0).contains(&number) && number.fract() == 0.0) => {
            Some("a whole number from 0 to 255")
        }
        MATERIAL if !((0.0..=65535.0).contains(&number) && number.fract() == 0.0) => {
            Some("a whole number from 0 to 65535")
        }
        SHADOW_COEFFICIENT if !(0.0..=1.0).contains(&number) => Some("a share from 0 to 1"),
        _ if TANGENT.contains(&column) && !number.is_finite() => Some("a finite number"),
        _ => None,
    }
}
