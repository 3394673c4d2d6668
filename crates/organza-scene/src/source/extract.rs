//! Checks of what is made of other objects by what a light sees of them.

use crate::at::At;
use crate::source::model::MOST_ABSORBANCE;
use crate::source::raw::RawExtract;
use crate::{Error, ExtractSource, SceneObject, Source, shown};

/// An extraction by itself; the light and the objects that it names are checked when all are known.
pub(crate) fn check_extract(at: &At<'_>, raw: &RawExtract) -> Result<ExtractSource, Error> {
    let absorbance = raw.absorbance.unwrap_or(1.0);
    if !(absorbance > 0.0 && absorbance <= f64::from(MOST_ABSORBANCE)) {
        let message = format!(
            "`absorbance`: expected a number above 0, at most {MOST_ABSORBANCE}, found {}",
            crate::short(absorbance)
        );
        return Err(at.key("absorbance").error(message, "lists of a shadow map go no farther"));
    }
    if raw.objects.as_ref().is_some_and(Vec::is_empty) {
        let message = "`objects`: expected at least one name, found none";
        return Err(at.key("objects").error(message, "leave it out for all visible objects"));
    }
    Ok(ExtractSource {
        light: raw.light as usize,
        absorbance: absorbance as f32,
        objects: raw.objects.clone().unwrap_or_default(),
        written: Some(at.key("absorbance").written()),
        points: None,
    })
}

/// Refuses lights that there are not, and what is not extracted from data.
pub(crate) fn check_extracts(at_objects: &At<'_>, objects: &[SceneObject], lights: usize) -> Result<(), Error> {
    for (i, object) in objects.iter().enumerate() {
        let Source::Extract(source) = &object.source else { continue };
        let at = at_objects.index(i).key("extract");
        check_light_index(&at, source.light, lights)?;
        check_names(&at, &source.objects, objects)?;
        if source.objects.is_empty() && !objects.iter().any(|o| source.sees(o)) {
            let message = "`extract`: the light sees nothing, for no other object is visible";
            return Err(at.error(message, "name some by its key `objects`, which need not be visible"));
        }
    }
    Ok(())
}

/// Refuses an index of no light.
pub(crate) fn check_light_index(at: &At<'_>, light: usize, lights: usize) -> Result<(), Error> {
    if light < lights {
        return Ok(());
    }
    let message = format!("`light`: expected a light below {lights}, found {light}");
    Err(at.key("light").error(message, "lights are counted from 0, in the order of the scene"))
}

/// Refuses names of no object, and of those that are extracted themselves: so none is made of itself.
pub(crate) fn check_names(at: &At<'_>, names: &[String], objects: &[SceneObject]) -> Result<(), Error> {
    for (k, name) in names.iter().enumerate() {
        let at = at.key("objects").index(k);
        match objects.iter().find(|o| o.name == *name) {
            None => {
                let known: Vec<String> = objects.iter().map(|o| shown(&o.name)).collect();
                let message = format!("`objects`: expected the name of an object, found `{}`", shown(name));
                return Err(at.error(message, format!("objects are {}", known.join(", "))));
            }
            Some(SceneObject { source: Source::Extract(_), .. }) => {
                let message = format!("`objects`: `{}` is extracted itself", shown(name));
                return Err(at.error(message, "name what that is extracted from"));
            }
            Some(_) => {}
        }
    }
    Ok(())
}
