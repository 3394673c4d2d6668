//! Sets of particles → means of the pixels, and their error.

use super::parts::{Part, named};
use super::unit::radiance_unit;
use super::{fault, refuse};
use crate::device::{Folding, Goal, Helper};
use crate::frame::Frame;
use crate::technique::Session;
use crate::{Error, Progress, RenderOptions, stage};
use pbsr::{Ensemble, EnsembleParams, FoldParams, LitBy, Object, Renderer, depth_range};
use rayon::prelude::*;
use splat_core::raster::OpaqueImage;
use splat_core::{LayerSet, Limits, Transmittance};
use std::ops::Range;
use tsm::ShadowMap;

/// Share of the allowed memory that the particles of one batch may take.
const BATCH_SHARE: u64 = 4;

/// Folds sets of what lies in a range of depths until there are as many as asked for, or the error is small enough.
pub(super) fn fold(
    frame: &Frame<'_>,
    parts: &[&Part<'_>],
    maps: &[Option<ShadowMap>],
    range: Range<f32>,
    occluder: Option<&OpaqueImage>,
    session: &mut Session<'_>,
) -> Result<Average, Error> {
    let objects: Vec<Object<'_>> = parts.iter().map(|part| part.object()).collect();
    let origin = frame.loaded.cloud.origin;
    let shining: Vec<(LitBy<'_>, Option<&ShadowMap>)> = frame.shining(maps).collect();
    let shadow = |map| -> Option<&dyn Transmittance> { Some(map? as &ShadowMap) };
    let lights: Vec<LitBy<'_>> = shining.iter().map(|(lit, map)| LitBy { shadow: shadow(*map), ..*lit }).collect();
    let camera = &frame.camera;
    let ambient = frame.scene.ambient;
    let scene = pbsr::Scene { objects: &objects, lights: &lights, shadow_origin: origin, ambient, camera, occluder };
    let colored = frame.plan.optical_depth_planes == 3;
    let corners = parts.iter().flat_map(|part| part.corners());
    let radiance_unit = radiance_unit(frame, parts);
    let kept = EnsembleParams::of_layers(&frame.layers, colored, depth_range(corners, camera));
    let kept = EnsembleParams { radiance_unit, ..kept };
    let checkpoint = &mut session.checkpoint;
    let empty = Ensemble::new(camera.size, &kept).map_err(fault)?;
    let found = checkpoint.as_deref_mut().map(|checkpoint| checkpoint.take(&empty)).transpose()?;
    let ensemble = found.flatten().unwrap_or(empty);
    let mut average = Average { ensemble, particles: 0, interrupted: false };
    let params = FoldParams { depths: [range.start, range.end], ..fold_params(session.options) };
    let settings = &frame.settings.particles;
    let background = settings.target_error.map(|_| behind(frame));
    let mut renderer = Renderer::new();
    let mut folding = Folding::new(shining.iter().filter_map(|(_, map)| Some(((*map)?, origin))).collect());
    let helper = helper(frame, checkpoint.is_some());
    frame.progress.begin(stage::PARTICLES);
    frame.progress.add_total(u64::from(settings.repeat_level.saturating_sub(average.ensemble.levels())));
    while let Some(levels) = average.ensemble.next_step(settings.repeat_level, settings.target_error.is_some()) {
        let step = Step { until: average.ensemble.levels() + levels, helper, params, progress: frame.progress };
        let folded = step.fold(&mut renderer, &mut folding, &scene, &mut average.ensemble);
        let folded = folded.map_err(|e| match e {
            pbsr::Error::Limit(_) => refuse(&named(parts), e),
            other => fault(other),
        });
        match folded {
            Ok(particles) => average.particles += particles,
            // Two sets are a picture, with its error.
            Err(Error::Cancelled) if average.ensemble.levels() >= 2 => average.interrupted = true,
            Err(error) => return Err(error),
        }
        if let Some(checkpoint) = checkpoint.as_deref_mut() {
            checkpoint.write_if_due(&average.ensemble)?;
        }
        let reached = |target: f64| {
            let behind = |x: u32, y: u32| background.as_ref().map_or([0.0; 3], |image| image[y as usize][x as usize]);
            average.ensemble.rms_error(&behind, occluder) / f64::from(frame.settings.antialias) <= target
        };
        if average.interrupted || settings.target_error.is_some_and(reached) {
            break;
        }
    }
    if let Some(checkpoint) = checkpoint {
        checkpoint.write(&average.ensemble)?;
    }
    Ok(average)
}

/// Radiance behind every sample, by rows: looked up once, for the error is asked for again and again.
fn behind(frame: &Frame<'_>) -> Vec<Vec<[f32; 3]>> {
    let background = frame.background();
    let [width, height] = frame.camera.size;
    let row = |y: u32| (0..width).map(|x| background.radiance(x, y)).collect();
    (0..height).into_par_iter().map(row).collect()
}

pub(super) fn fold_params(options: &RenderOptions) -> FoldParams {
    FoldParams { limits: Limits::bytes(options.max_memory / BATCH_SHARE), ..FoldParams::default() }
}

/// Bytes of averaging an image of so many samples: its sums (twice, where they are written), a batch of particles, and the
/// samples when they are read. A set of more than four million particles takes more, up to a quarter of what is allowed.
pub(crate) fn average_bytes(size: [u64; 2], set: &LayerSet, colored_extinction: bool, options: &RenderOptions) -> u64 {
    let kept = EnsembleParams::of_layers(set, colored_extinction, [0.0, 1.0]);
    let samples: u64 = size.iter().product();
    let copies = 1 + u64::from(options.checkpoint.is_some());
    // Batches are over when the picture is read.
    copies * kept.bytes(size) + fold_params(options).batch_bytes().max(samples * kept.bytes_to_read_pixel())
}

/// The device that folds, if there is one and it may.
fn helper<'a>(frame: &Frame<'a>, checkpoint: bool) -> Option<&'a Helper<'a>> {
    let helper = frame.helper?;
    if checkpoint {
        helper.leave("particles with a checkpoint are the processor's, whose bits do not depend on where it went on");
    }
    (!checkpoint).then_some(helper)
}

/// Sets between two looks.
struct Step<'a> {
    until: u32,
    helper: Option<&'a Helper<'a>>,
    params: FoldParams,
    progress: &'a Progress,
}

impl Step<'_> {
    /// Folds by the device, and what that did not do by the processor, from where it was. Gives the number of particles.
    fn fold(
        &self,
        renderer: &mut Renderer,
        folding: &mut Folding<'_>,
        scene: &pbsr::Scene<'_>,
        ensemble: &mut Ensemble,
    ) -> Result<u64, pbsr::Error> {
        let by_device = match self.helper {
            Some(helper) => {
                let goal = Goal { until: self.until, max_bytes: self.params.limits.max_bytes };
                folding.fold(helper, scene, ensemble, goal, self.progress)?
            }
            None => 0,
        };
        match self.until - ensemble.levels() {
            0 => Ok(by_device),
            left => {
                let params = FoldParams { levels: left, ..self.params };
                Ok(by_device + renderer.fold(scene, ensemble, &params, Some(self.progress))?.particles)
            }
        }
    }
}

/// Sets that were folded.
pub(super) struct Average {
    pub(super) ensemble: Ensemble,
    /// Particles of the sets that this run made.
    pub(super) particles: u64,
    /// Whether it was stopped before there were enough.
    pub(super) interrupted: bool,
}
