//! Keys of a light that say what it shines through.

use crate::Error;
use crate::at::At;
use crate::light::model::SlideSource;
use crate::limits::{LARGEST, SMALLEST};
use crate::paths::Paths;
use glam::DVec3;
use splat_core::{Framing, LightShape};

/// How nearly +Y the axis of a light is where +Z is upwards in its picture.
const ALONG: f64 = 1.0 - 1e-6;

/// The keys as they are written.
pub(crate) struct SlideKeys<'a> {
    pub(crate) texture: Option<&'a str>,
    pub(crate) up: Option<[f64; 3]>,
    /// Width of the picture with its key: degrees before a spot, world units in parallel light.
    pub(crate) width: (&'static str, Option<f64>),
    pub(crate) center: Option<[f64; 3]>,
}

/// The slide before a light of this shape, if it has one.
pub(crate) fn check_slide(
    at: &At<'_>,
    keys: &SlideKeys<'_>,
    shape: &LightShape,
    paths: &Paths,
) -> Result<Option<SlideSource>, Error> {
    let (name, width) = keys.width;
    let Some(texture) = keys.texture else {
        let of_texture =
            [("texture_up", keys.up.is_some()), (name, width.is_some()), ("texture_center", keys.center.is_some())];
        return match of_texture.iter().find(|(_, is_there)| *is_there) {
            Some((key, _)) => {
                Err(at.key(key).error(format!("`{key}` belongs to a `texture`"), "name one, or leave it out"))
            }
            None => Ok(None),
        };
    };
    let path = paths.resolve(&at.key("texture"), texture)?;
    let (direction, width) = match *shape {
        LightShape::Spot { direction, .. } => (direction, width.map(|angle| before_spot(at, angle)).transpose()?),
        LightShape::Directional { direction } => {
            let hint = "parallel light has no cone: say how wide the picture is, in world units";
            let width = width.ok_or_else(|| at.error("expected a key `texture_width` here, found none", hint))?;
            (direction, Some(at.length(name, width)?))
        }
        _ => return Err(Error::Internal("a spot or parallel light was expected".into())),
    };
    let up = match keys.up {
        Some(up) => at.direction("texture_up", up)?,
        None if direction.y.abs() > ALONG => DVec3::Z,
        None => DVec3::Y,
    };
    if direction.cross(up).length() < 1e-9 {
        let message = format!("`texture_up`: expected a direction that is not along the light, found {up}");
        return Err(at.key("texture_up").error(message, ""));
    }
    let center = at.vector("texture_center", keys.center.unwrap_or_default())?;
    Ok(Some(SlideSource { path, framing: Framing { up, width, center } }))
}

/// Width at a distance of 1 of a picture that is seen under this angle.
fn before_spot(at: &At<'_>, degrees: f64) -> Result<f64, Error> {
    if !(degrees > 0.0 && degrees < 180.0) {
        let message = format!("`texture_angle`: expected degrees between 0 and 180, found {}", crate::short(degrees));
        return Err(at.key("texture_angle").error(message, "it is the angle across the width of the picture"));
    }
    at.number("texture_angle", 2.0 * libm::tan(0.5 * degrees.to_radians()), SMALLEST..=LARGEST)
}
