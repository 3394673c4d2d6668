//! Finds the values that a scene leaves to shadow maps: the places where objects stop, extracted surfaces, and the camera that then
//! sees all.

use super::{Loaded, load};
use crate::load::files::once;
use crate::load::placed;
use crate::memory::loading_bytes;
use crate::scene::{ExtractSource, FoundCamera, Scene, SceneObject, Source, Stop};
use crate::shadows::{shadow_error, shadow_params};
use crate::{Context, Error, choose::settle, printable, shown};
use glam::DVec3;
use splat_core::RawPoints;
use std::borrow::Cow;
use std::sync::Arc;
use tsm::{Params, ShadowMap};

/// Fills in the values that a scene leaves to its data: the places of objects that stop, the extracted surfaces, and the fitted camera. Returns the
/// scene and that camera.
///
/// # Errors
/// As [`crate::render`] for data that cannot be read, and as [`seen`].
pub fn fitted<'s>(scene: &'s Scene, context: Context<'_>) -> Result<(Cow<'s, Scene>, Option<FoundCamera>), Error> {
    let mut settled = Cow::Borrowed(scene);
    for (stop, start) in scene.stops.iter().zip(scene.start.iter().cycle()) {
        let find = || stop_time(stop, &Eye { scene: start, context });
        let time = once(&context.files.stopped, (Stop { frame: 0, ..stop.clone() }, start.clone()), find)?;
        settled.to_mut().objects[stop.object].transform.translation = stop.path.at(time.min(stop.frame.into()));
    }
    for (i, object) in scene.objects.iter().enumerate().filter(|(_, object)| object.visible) {
        let Source::Extract(source @ ExtractSource { points: None, .. }) = &object.source else { continue };
        let part = settled.part(source.light, |o| source.sees(o));
        // Wherever it is written.
        let what = ExtractSource { written: None, ..source.clone() };
        context.files.seen.borrow_mut().retain(|((known, by), _)| *known != what || *by == part);
        let find = || seen(&settled, source, context).map(Arc::new);
        let points = once(&context.files.seen, (what, part), find)?;
        settled.to_mut().objects[i].source = Source::Extract(ExtractSource { points: Some(points), ..source.clone() });
    }
    placed(settled, context)
}

/// The scene to draw: that of [`fitted`], with a named technique for every object, and the plan's values of settings that the scene leaves open.
///
/// # Errors
/// As [`fitted`], and for a requested layer that no technique which `auto` may choose fills.
pub fn settled<'s>(scene: &'s Scene, context: Context<'_>) -> Result<(Cow<'s, Scene>, Option<FoundCamera>), Error> {
    let (scene, found) = fitted(scene, context)?;
    Ok((settle::settled(scene, context)?, found))
}

/// The first surface of some objects that a light (an extended one from its middle) sees, in the world. The surface follows from a shadow map
/// of these objects alone (Gunjee 2007, Figure 15 a).
///
/// # Errors
/// As [`crate::render`]; [`Error::Input`] where no ray meets the absorbance.
pub fn seen(scene: &Scene, source: &ExtractSource, context: Context<'_>) -> Result<RawPoints, Error> {
    let (map, origin) = Eye { scene, context }.map(source.light, &|o| source.sees(o))?;
    let points = map.first_surface(source.absorbance);
    if points.is_empty() {
        return Err(unseen(scene, source, map.most_absorbance()));
    }
    let (position, normal) = points.iter().map(|p| (p.position, p.normal)).unzip();
    Ok(RawPoints { origin, position, normal, ..RawPoints::default() })
}

/// What is said where no ray of a light meets the absorbance asked for, but `most`.
fn unseen(scene: &Scene, source: &ExtractSource, most: f32) -> Error {
    let ExtractSource { light, absorbance, objects, written, .. } = source;
    let named: Vec<String> = objects.iter().map(|name| format!("`{}`", shown(name))).collect();
    let seen = if named.is_empty() { "all that is visible".to_owned() } else { named.join(", ") };
    let (expected, found, hint) = if most > 0.0 {
        let most = format!("at most {}, which is all that a ray of light {light} meets in {seen}", rounded_down(most));
        (most, absorbance.to_string(), "ask for less, or look whether all of it casts shadows")
    } else {
        (format!("matter on rays of light {light} in {seen}"), "none".to_owned(), "look whether it casts shadows")
    };
    let message = format!("`absorbance`: expected {expected}, found {found}");
    let is_extracted =
        |object: &&SceneObject| matches!(&object.source, Source::Extract(extracted) if extracted == source);
    match (written, scene.objects.iter().find(is_extracted)) {
        (Some(written), Some(object)) => {
            written.error(&scene.file, &format!("object `{}`: {message}", shown(&object.name)), hint).into()
        }
        _ => Error::input(printable(&scene.file), message, hint),
    }
}

/// A positive number below 10 with three digits, which is not above it.
fn rounded_down(x: f32) -> String {
    let mut digits = 2;
    let mut scaled = 100.0 * f64::from(x);
    while scaled < 100.0 {
        (digits, scaled) = (digits + 1, 10.0 * scaled);
    }
    format!("{:.digits$}", scaled.floor() / 10f64.powi(digits as i32))
}

/// The last time on an object's way at which none of its splats has come past what it stops at, in frames.
fn stop_time(stop: &Stop, eye: &Eye<'_>) -> Result<f64, Error> {
    let (map, origin) = eye.map(stop.light, &|o| stop.objects.contains(&o.name))?;
    let splats = eye.splats(stop.light, &|o| o.name == eye.scene.objects[stop.object].name)?.cloud;
    let start = splats.origin - origin - stop.path.at(0.0);
    let time = map.free_until(&splats.position, &|time| (start + stop.path.at(time)).as_vec3(), stop.last);
    eye.context.files.note(&eye.scene.file, stop.said(&eye.scene.objects[stop.object].name, time));
    Ok(time)
}

/// Who looks at a scene from its lights.
struct Eye<'a> {
    scene: &'a Scene,
    context: Context<'a>,
}

impl Eye<'_> {
    /// The shadow map of a light of some objects alone, and the world position that its places are relative to.
    fn map(&self, light: usize, sees: &dyn Fn(&SceneObject) -> bool) -> Result<(ShadowMap, DVec3), Error> {
        let loaded = self.splats(light, sees)?;
        let casters = tsm::Scene { cloud: &loaded.cloud, materials: &loaded.materials, objects: &loaded.objects };
        let left = self.context.options.max_memory.saturating_sub(loaded.cloud.bytes());
        let whole = &self.scene.lights[light];
        let cells = whole.shadow_cells.or(self.scene.render.shadow.cells);
        let params = shadow_params(&self.scene.render, &loaded, cells, Params::default().tolerance, left);
        let map = ShadowMap::build(&casters, &whole.light.middle(), &params, Some(self.context.progress));
        let map = map.map_err(|e| shadow_error(&format!("light {light}"), &e))?;
        self.context.files.most.set(self.context.files.most.get().max(loaded.cloud.bytes() + map.peak_bytes()));
        Ok((map, loaded.cloud.origin))
    }

    /// The splats of some objects alone, in the scale of the scene.
    fn splats(&self, light: usize, has: &dyn Fn(&SceneObject) -> bool) -> Result<Loaded, Error> {
        let scene = self.scene.part(light, has);
        let mut loaded = load(&scene, self.context)?;
        self.context
            .files
            .most
            .set(self.context.files.most.get().max(loading_bytes(&loaded, self.context.files.bytes())));
        // From the scale of the cloud to that of the scene: a power of two.
        loaded.cloud.scale_world(libm::exp2(loaded.exponent.into()));
        Ok(loaded)
    }
}
