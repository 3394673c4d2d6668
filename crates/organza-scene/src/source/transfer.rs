//! Checks of transfer functions.

use crate::Error;
use crate::at::At;
use crate::limits::LARGEST;
use crate::object::raw::RawObject;
use crate::source::raw::RawTransferPoint;
use splat_core::{TransferFunction, TransferPoint, optics};

/// What the control points of a transfer function have beside a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Beside {
    /// Nothing, as those of a slice.
    Nothing,
    /// Extinction, as those of a volume.
    Extinction,
    /// The opacity of one crossing.
    Opacity,
}

/// What those have that give points or surfaces their colours: nothing, or what classifies them, if one of them has it.
pub(crate) fn beside_of_points(raw: &RawObject, is_medium: bool) -> Beside {
    let any = raw.transfer.iter().flatten().any(|p| p.extinction.is_some() || p.opacity.is_some());
    match (any, is_medium) {
        (false, _) => Beside::Nothing,
        (true, false) => Beside::Opacity,
        (true, true) => Beside::Extinction,
    }
}

/// The transfer function of a volume, a slice, a surface with a field, or of points, whose control points have that `beside` a colour.
pub(crate) fn check_transfer(at: &At<'_>, raw: &RawObject, beside: Beside) -> Result<TransferFunction, Error> {
    let Some(points) = &raw.transfer else {
        if beside == Beside::Nothing {
            let hint = "such as transfer = [{ value = 0, color = [0, 0, 0] }, { value = 1, color = [1, 1, 1] }]";
            return Err(at.error("a slice needs a key `transfer`, found none", hint));
        }
        let hint = "such as transfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, …]";
        return Err(at.error("a volume needs a key `transfer`, found none", hint));
    };
    // In the unit of the data, so that what is scaled looks the same.
    let scale = raw.transform.scale.unwrap_or(1.0);
    let unit_length = raw.unit_length.map(|l| Ok(at.length("unit_length", l)? * scale)).transpose()?;
    let at = at.key("transfer");
    let mut checked: Vec<TransferPoint> = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        let at = at.index(i);
        let value = at.number("value", p.value, -LARGEST..=LARGEST)? as f32;
        if checked.last().is_some_and(|before| value <= before.value) {
            let message = format!("`value`: expected more than that of the point before, found {}", p.value);
            return Err(at.key("value").error(message, "list the points by rising value"));
        }
        let extinction = match beside {
            Beside::Nothing => no_extinction(&at, p).map(|()| 0.0)?,
            Beside::Extinction => point_extinction(&at, p, unit_length)? as f32,
            Beside::Opacity => crossing_opacity(&at, p)? as f32,
        };
        checked.push(TransferPoint { value, color: at.color("color", p.color)?, extinction });
    }
    TransferFunction::new(checked).map_err(|e| at.error(e.to_string(), ""))
}

fn no_extinction(at: &At<'_>, p: &RawTransferPoint) -> Result<(), Error> {
    for (key, on) in [("extinction", p.extinction.is_some()), ("opacity", p.opacity.is_some())] {
        if on {
            let hint = "the object's `opacity` is that of one crossing";
            return Err(at.key(key).error("a slice has no extinction", hint));
        }
    }
    Ok(())
}

/// The opacity of one crossing of a surface, by which that of its object is multiplied.
fn crossing_opacity(at: &At<'_>, p: &RawTransferPoint) -> Result<f64, Error> {
    if p.extinction.is_some() {
        let hint = "give `opacity`, that of one crossing; points are a medium by as = \"medium\"";
        return Err(at.key("extinction").error("a surface has no extinction", hint));
    }
    match p.opacity {
        Some(opacity) => at.number("opacity", opacity, 0.0..=1.0),
        None => {
            let hint = "as another control point has one: all of them do, or none";
            Err(at.error("expected a key `opacity` here, found none", hint))
        }
    }
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
                let hint = "the length over which a point has its opacity, in the unit of the data";
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
