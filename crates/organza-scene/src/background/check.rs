//! `[background]`: a colour, or an environment.

use crate::at::At;
use crate::background::raw::RawBackground;
use crate::limits::LARGEST;
use crate::paths::Paths;
use crate::{EnvironmentSource, Error};

/// The colour, black where there is none, and the environment that takes its place.
pub(crate) fn check_background(
    at: &At<'_>,
    raw: &RawBackground,
    paths: &Paths,
) -> Result<([f32; 3], Option<EnvironmentSource>), Error> {
    let Some(environment) = &raw.environment else {
        let of_environment = [("rotate", raw.rotate), ("scale", raw.scale)];
        if let Some((key, _)) = of_environment.iter().find(|(_, value)| value.is_some()) {
            let message = format!("`{key}` belongs to an `environment`");
            return Err(at.key(key).error(message, "name one, or leave it out"));
        }
        return Ok((at.color("color", raw.color.unwrap_or_default())?, None));
    };
    if raw.color.is_some() {
        let message = "expected one of `color` and `environment`, found both";
        let hint = "an environment fills the whole background: leave one of both out; `--background COLOUR` takes the place of both";
        return Err(at.key("environment").error(message, hint));
    }
    let degrees = raw.rotate.unwrap_or(0.0);
    Ok((
        [0.0; 3],
        Some(EnvironmentSource {
            path: paths.resolve(&at.key("environment"), environment)?,
            turns: at.number("rotate", degrees, -LARGEST..=LARGEST)? / 360.0,
            scale: at.number("scale", raw.scale.unwrap_or(1.0), 0.0..=LARGEST)?,
        }),
    ))
}
