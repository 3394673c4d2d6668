//! Where the camera is that sees all of a scene: known once the data is read, before anything is converted.

use super::files::Files;
use super::input::Input;
use super::loading::Loading;
use crate::scene::{FoundCamera, Scene};
use crate::{Error, Progress, RenderOptions};
use convert::visible_ends;
use glam::DVec3;
use splat_core::DAabb;
use std::borrow::Cow;

/// The scene with a camera that sees all visible objects, where it leaves the camera's place to the data, and that camera; else the scene
/// as it is. `files` keeps what is read for this.
///
/// # Errors
/// As [`crate::render`] for data that cannot be read.
pub fn fitted<'s>(
    scene: &'s Scene,
    options: &RenderOptions,
    progress: &Progress,
    files: &Files,
) -> Result<(Cow<'s, Scene>, Option<FoundCamera>), Error> {
    let Some(fit) = scene.fit else { return Ok((Cow::Borrowed(scene), None)) };
    let inputs = Loading { scene, options, progress, files }.inputs()?;
    let outlines: Vec<Outline<'_>> = inputs.iter().map(Outline::of).collect();
    let found = fit.camera(&scene.camera, &|add| outlines.iter().for_each(|outline| outline.each(add)));
    let Some(found) = found else {
        let message = "`camera`: there is nothing to see for a camera that is placed by itself";
        let hint = "add a visible object, or give the camera a position";
        return Err(Error::input(crate::printable(&scene.file), message, hint));
    };
    let scene = Scene { camera: found.camera, target: found.target, fit: None, ..scene.clone() };
    Ok((Cow::Owned(scene), Some(found)))
}

/// Points around what is seen of an object.
struct Outline<'i> {
    input: &'i Input<'i>,
    /// In the object, where they are not the data's own points.
    points: Vec<DVec3>,
}

impl<'i> Outline<'i> {
    fn of(input: &'i Input<'i>) -> Self {
        let corners = |bounds: DAabb| bounds.corners().to_vec();
        let points = match input {
            Input::Mesh(..) => Vec::new(),
            Input::Points(_, points, _) | Input::Matter(_, points, _) => points.bulk().map_or_else(Vec::new, corners),
            Input::Volume(grid, transfer, params) => {
                visible_ends(grid, transfer, params.splat.transform.scale, &params.clip)
            }
            Input::Surface(_, bounds, ..) | Input::Density(_, bounds, _) => corners(*bounds),
            Input::Procedural(shape, ..) => {
                shape.ellipsoids.iter().flat_map(|e| corners(DAabb::around(e.center, e.radii))).collect()
            }
            Input::Medium(medium, ..) => corners(medium.body.bounds()),
            Input::Rectangle(r, ..) => {
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(s, t)| r.center + r.u * s + r.v * t).to_vec()
            }
        };
        Self { input, points }
    }

    fn each(&self, add: &mut dyn FnMut(DVec3)) {
        let transform = self.input.splat().transform;
        match self.input {
            Input::Mesh(_, mesh, _) => {
                let corners = mesh.triangles.iter().flatten();
                corners.for_each(|v| add(transform.apply(mesh.origin + mesh.position[*v as usize].as_dvec3())));
            }
            Input::Points(_, points, _) | Input::Matter(_, points, _) if self.points.is_empty() => {
                let mut around = |p: DVec3| add(transform.apply(p));
                let reach = points.sparse_reach();
                for p in &points.position {
                    let p = points.origin + p.as_dvec3();
                    // Among many points a disc reaches no farther than a pixel or two.
                    match reach {
                        Some(reach) => {
                            DAabb::around(p, DVec3::splat(reach)).corners().into_iter().for_each(&mut around)
                        }
                        None => around(p),
                    }
                }
            }
            _ => self.points.iter().for_each(|p| add(transform.apply(*p))),
        }
    }
}
