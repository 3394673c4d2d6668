//! Checks of the camera: one whose place is given, or one whose place is to be found.

use super::fit::{CameraFit, DEFAULT_AZIMUTH, DEFAULT_FILL, DEFAULT_SIZE};
use crate::Error;
use crate::at::At;
use crate::camera::raw::RawCamera;
use crate::load::options::Turn;
use glam::DVec3;
use splat_core::{Camera, Projection};
use std::f64::consts::TAU;

/// Vertical angle of view of a camera that states none, degrees.
const DEFAULT_FOV_Y: f64 = 35.0;

/// A camera, and how it is to be placed where it has no place yet.
pub(crate) struct Seen {
    pub(crate) camera: Camera,
    pub(crate) target: DVec3,
    pub(crate) fit: Option<CameraFit>,
}

/// Checks the camera at a turn of a turntable; `goes_around` where a track of the animation takes it around.
pub(crate) fn check_camera(at: &At<'_>, raw: &RawCamera, turn: Option<Turn>, goes_around: bool) -> Result<Seen, Error> {
    refuse_what_does_not_apply(at, raw)?;
    let angle = turn.map_or(0.0, Turn::angle);
    if raw.auto {
        let projection = check_projection(at, raw)?;
        let size = check_size(at, raw)?;
        let degrees = at.number("azimuth", raw.azimuth.unwrap_or(DEFAULT_AZIMUTH), -360.0..=360.0)?;
        let elevation = raw.elevation.map(|e| at.number("elevation", e, -90.0..=90.0)).transpose()?;
        let fill = raw.fit.unwrap_or(DEFAULT_FILL);
        if !(fill > 0.0 && fill <= 1.0) {
            let message = format!("`fit`: expected a number above 0, at most 1, found {}", crate::short(fill));
            return Err(at.key("fit").error(message, "the share of the picture that is filled"));
        }
        let fit = CameraFit {
            azimuth: degrees.to_radians() + angle,
            elevation: elevation.map(f64::to_radians),
            fill,
            around: goes_around || turn.is_some(),
        };
        let camera = Camera { position: DVec3::Z, axes: [DVec3::X, DVec3::Y, DVec3::NEG_Z], projection, size };
        return Ok(Seen { camera, target: DVec3::ZERO, fit: Some(fit) });
    }
    let needed = |key, value: Option<[f64; 3]>| {
        value.ok_or_else(|| {
            let hint = "or say `auto = true` for a camera that sees all objects";
            at.error(format!("expected a key `{key}` here, found none"), hint)
        })
    };
    let position = at.vector("position", needed("position", raw.position)?)?;
    let target = at.vector("target", needed("target", raw.target)?)?;
    let up = at.vector("up", raw.up.unwrap_or([0.0, 1.0, 0.0]))?;
    let projection = check_projection(at, raw)?;
    let size = check_size(at, raw)?;
    let position = target + turned(position - target, angle);
    let camera = Camera::look_at(position, target, turned(up, angle), projection, size).map_err(|e| match e {
        splat_core::Error::Invalid { attribute, found, expected, .. } => {
            let key = if attribute == "target" { "target" } else { "position" };
            at.key(key).error(format!("`{attribute}`: expected {expected}, found {found}"), "")
        }
        other => at.error(other.to_string(), ""),
    })?;
    Ok(Seen { camera, target, fit: None })
}

/// A key that would silently do nothing is an error.
fn refuse_what_does_not_apply(at: &At<'_>, raw: &RawCamera) -> Result<(), Error> {
    let given = [("position", raw.position), ("target", raw.target), ("up", raw.up)].map(|(k, v)| (k, v.is_some()));
    let found =
        [("azimuth", raw.azimuth), ("elevation", raw.elevation), ("fit", raw.fit)].map(|(k, v)| (k, v.is_some()));
    let (keys, message, hint) = if raw.auto {
        (given, "is not for a camera with `auto`, whose place is found", "leave it or `auto` out")
    } else {
        (found, "belongs to a camera with `auto = true`", "set camera.auto, or leave it out")
    };
    if let Some((key, _)) = keys.iter().find(|(_, on)| *on) {
        return Err(at.key(key).error(format!("`{key}` {message}"), hint));
    }
    if raw.auto && raw.orthographic.is_some() {
        let message = "`orthographic`: the height that parallel rays see is not found by `auto`";
        return Err(at.key("orthographic").error(message, "use `fov_y`, small for nearly parallel rays"));
    }
    Ok(())
}

fn check_projection(at: &At<'_>, raw: &RawCamera) -> Result<Projection, Error> {
    match (raw.fov_y, raw.orthographic) {
        (Some(fov_y), None) => {
            if !(fov_y > 0.0 && fov_y < 180.0) {
                let message = format!("`fov_y`: expected degrees between 0 and 180, found {}", crate::short(fov_y));
                return Err(at.key("fov_y").error(message, ""));
            }
            Ok(Projection::Perspective { fov_y: fov_y.to_radians() })
        }
        (None, Some(height)) => Ok(Projection::Orthographic { height: at.length("orthographic", height)? }),
        (Some(_), Some(_)) => {
            let message = "expected one of `fov_y` and `orthographic`, found both";
            Err(at.key("orthographic").error(message, ""))
        }
        (None, None) => Ok(Projection::Perspective { fov_y: DEFAULT_FOV_Y.to_radians() }),
    }
}

fn check_size(at: &At<'_>, raw: &RawCamera) -> Result<[u32; 2], Error> {
    let Some(size) = raw.size.or(raw.auto.then_some(DEFAULT_SIZE)) else {
        return Err(at.error("expected a key `size` here, found none", "such as size = [960, 540]"));
    };
    for (i, side) in size.into_iter().enumerate() {
        if !(1..=65536).contains(&side) {
            let message = format!("`size`: expected 1 to 65536 pixels a side, found {side}");
            return Err(at.key("size").index(i).error(message, ""));
        }
    }
    Ok(size)
}

/// A vector turned about +Y; by nothing it keeps its bits.
fn turned(v: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(angle.rem_euclid(TAU));
    if angle == 0.0 { v } else { DVec3::new(v.x * cos + v.z * sin, v.y, v.z * cos - v.x * sin) }
}
