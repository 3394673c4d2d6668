//! f64 coordinates → an f64 origin and f32 offsets, with the words for what fits none.

use crate::error::{Place, ReadError};
use crate::stream::input;
use splat_core::Relative;
use splat_core::glam::{DVec3, Vec3};

/// [`Relative::from_positions`], with the words for the point that fits no f32: `named` says which it is.
pub(crate) fn relative(
    positions: &[DVec3],
    place: Place,
    named: impl FnOnce(usize) -> String,
) -> Result<(DVec3, Vec<Vec3>), ReadError> {
    let mut room = Vec::new();
    input::reserve(&mut room, positions.len())?;
    let Relative { origin, offsets } = Relative::from_positions(positions, room).map_err(|i| {
        let expected = "coordinates that fit 32-bit floats once the middle is subtracted";
        let found = format!("{} at {}", positions[i], named(i));
        ReadError::input(place, expected, found, "scale the data, or remove outliers")
    })?;
    Ok((origin, offsets))
}
