//! Light for a thing that is seen for the first time: a key from the upper left of the camera, whose shadows model it, a weak fill from the
//! right without shadows, and the sky from all sides. Who goes around it sees its back, which a third one lights then.

use crate::number::{color, list};
use organza::scene::Scene;
use organza::{Context, Error};
use splat_core::Camera;
use splat_core::glam::DVec3;
use std::fmt::Write;

/// Irradiance of the key, of the fill and of what lights the back, on a plane that faces them, and radiance of the sky.
const KEY: [f32; 3] = [2.6, 2.5, 2.35];
const FILL: [f32; 3] = [0.5, 0.55, 0.65];
const BACK: [f32; 3] = [0.7, 0.75, 0.85];
const SKY: [f32; 3] = [0.13, 0.14, 0.16];

/// Where light comes from: to the right of the camera, up in the world, and towards the camera's side.
const FROM_KEY: [f64; 3] = [-0.75, 1.0, 0.55];
const FROM_FILL: [f64; 3] = [0.9, 0.15, 0.5];
const FROM_BACK: [f64; 3] = [-0.25, 0.5, -0.9];

/// The lights of a first scene for what a scene shows, as TOML: its tables `ambient` and `light`. `around` where its back is seen as well.
///
/// # Errors
/// As [`organza::fitted`], which finds the camera where the scene leaves that to the data.
pub fn lights_of(scene: &Scene, around: bool, context: Context<'_>) -> Result<String, Error> {
    let (scene, found) = organza::fitted(scene, context)?;
    Ok(lamps(&found.map_or(scene.camera, |found| found.camera), around))
}

/// The tables of the lights; `around` where the back is seen as well.
pub(crate) fn lamps(camera: &Camera, around: bool) -> String {
    let [right, up, forward] = camera.axes;
    // Level, so that the key stays above whatever the elevation; straight down it is the picture's up that is level.
    let level = DVec3::new(-forward.x, 0.0, -forward.z);
    let back =
        if level.length() > 0.1 { level.normalize() } else { DVec3::new(-up.x, 0.0, -up.z).normalize_or(DVec3::Z) };
    let direction =
        |from: [f64; 3]| list((-(right * from[0] + DVec3::Y * from[1] + back * from[2])).normalize().to_array(), 1e-3);
    let mut text = format!(
        "[ambient]                # the sky: light from all sides\ncolor = {}\n\n\
         [[light]]                # the key, from the upper left of the camera: its shadows model what is seen\n\
         kind = \"directional\"\ndirection = {}\nirradiance = {}\n\n\
         [[light]]                # a fill from the right, without shadows\n\
         kind = \"directional\"\ndirection = {}\nirradiance = {}\nshadow = false\n",
        color(SKY),
        direction(FROM_KEY),
        color(KEY),
        direction(FROM_FILL),
        color(FILL),
    );
    if around {
        let direction = direction(FROM_BACK);
        let color = color(BACK);
        let _ = write!(
            text,
            "\n[[light]]                # the back, which is seen from behind, without shadows\n\
             kind = \"directional\"\ndirection = {direction}\nirradiance = {color}\nshadow = false\n"
        );
    }
    text
}
