//! Checks of transfer functions.

use super::check::{At, LARGEST};
use super::raw_object::RawObject;
use super::raw_source::RawTransferPoint;
use crate::Error;
use splat_core::{TransferFunction, TransferPoint, optics};

/// A slice and points have colours alone.
pub(super) fn check_transfer(at: &At<'_>, raw: &RawObject, colors_alone: bool) -> Result<TransferFunction, Error> {
    let Some(points) = &raw.transfer else {
        if colors_alone {
            let hint = "such as transfer = [{ value = 0, color = [0, 0, 0] }, { value = 1, color = [1, 1, 1] }]";
            return Err(at.error("a slice needs a key `transfer`, found none", hint));
        }
        let hint = "such as transfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, …]";
        return Err(at.error("a volume needs a key `transfer`, found none", hint));
    };
    let unit_length = raw.unit_length.map(|l| at.length("unit_length", l)).transpose()?;
    let at = at.key("transfer");
    let mut checked: Vec<TransferPoint> = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        let at = at.index(i);
        let value = at.number("value", p.value, -LARGEST..=LARGEST)? as f32;
        if checked.last().is_some_and(|before| value <= before.value) {
            let message = format!("`value`: expected more than that of the point before, found {}", p.value);
            return Err(at.key("value").error(message, "list the points by rising value"));
        }
        let extinction = if colors_alone {
            no_extinction(&at, raw, p).map(|()| 0.0)?
        } else {
            point_extinction(&at, p, unit_length)? as f32
        };
        checked.push(TransferPoint { value, color: at.color("color", p.color)?, extinction });
    }
    TransferFunction::new(checked).map_err(|e| at.error(e.to_string(), ""))
}

fn no_extinction(at: &At<'_>, raw: &RawObject, p: &RawTransferPoint) -> Result<(), Error> {
    for (key, on) in [("extinction", p.extinction.is_some()), ("opacity", p.opacity.is_some())] {
        if on {
            let what = if raw.points.is_some() { "points have" } else { "a slice has" };
            let hint = "the object's `opacity` is that of one crossing";
            return Err(at.key(key).error(format!("{what} no extinction"), hint));
        }
    }
    Ok(())
}

fn point_extinction(at: &At<'_>, p: &RawTransferPoint, unit_length: Option<f64>) -> Result<f64, Error> {
    match (p.extinction, p.opacity) {
        (Some(extinction), None) => at.number("extinction", extinction, 0.0..=LARGEST),
        (None, Some(opacity)) => {
            if !(0.0..1.0).contains(&opacity) {
                let message = format!("`opacity`: expected a number from 0 to below 1, found {opacity}");
                return Err(at.key("opacity").error(message, ""));
            }
            let Some(unit_length) = unit_length else {
                let hint = "the world length over which a point has its opacity";
                return Err(at.key("opacity").error("`opacity` needs the object's `unit_length`, found none", hint));
            };
            at.number("opacity", optics::optical_depth(opacity) / unit_length, 0.0..=LARGEST)
        }
        (Some(_), Some(_)) => {
            Err(at.key("opacity").error("expected one of `extinction` and `opacity`, found both", ""))
        }
        (None, None) => Err(at.error("expected a key `extinction` or `opacity` here, found neither", "")),
    }
}
