//! From a scene to images: prepare, draw.

use crate::device::{DeviceChoice, Helper};
use crate::draw::draw;
use crate::frame::Frame;
use crate::load::files::Files;
use crate::plan::Plan;
use crate::prepare::{Explanation, prepare};
use crate::scene::Scene;
use crate::technique::{Checkpoint, Kept, Session};
use crate::{CostRecord, Error, Layers, Progress, doubts};
use convert::read::ReadLimits;
use std::path::PathBuf;

/// What a render may take and how it treats doubtful input.
#[derive(Debug, Clone)]
pub struct RenderOptions {
    /// Bytes that all buffers together may take.
    pub max_memory: u64,
    /// Leave out records with values that are not finite instead of refusing the file.
    pub drop_invalid: bool,
    /// Refuse files with a fault that could be mended, see [`convert::read::Fix`].
    pub strict: bool,
    /// Make one point of points at the same place, for every object.
    pub merge_duplicates: bool,
    /// File of the sums of the technique `particles`: read before, if it is there, and written every few seconds, at the
    /// end and at an interrupt. A render that is stopped at any moment goes on from it and ends in the same bits.
    pub checkpoint: Option<PathBuf>,
    /// The device on which the passes run that can; `None`: the processor alone.
    pub device: Option<DeviceChoice>,
    /// Whether the device composites the splats too: beauty then differs from the processor's by rounding, up to 10⁻⁵ of
    /// the brightest splat.
    pub device_composites: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            max_memory: 8 << 30,
            drop_invalid: false,
            strict: false,
            merge_duplicates: false,
            checkpoint: None,
            device: None,
            device_composites: false,
        }
    }
}

impl RenderOptions {
    /// What a file may ask for when it is read.
    pub fn read_limits(&self) -> ReadLimits {
        ReadLimits { max_bytes: self.max_memory, drop_invalid: self.drop_invalid, strict: self.strict }
    }
}

/// A finished render.
#[derive(Debug, Clone, PartialEq)]
pub struct Render {
    /// The images that were asked for, beauty and alpha always.
    pub layers: Layers,
    /// What each pass cost.
    pub cost: CostRecord,
    /// What was done and why.
    pub plan: Plan,
    /// Sets that were averaged; `None` when the picture is not an average.
    pub sets: Option<Sets>,
    /// What a user should know of the input, one sentence each.
    pub warnings: Vec<String>,
    /// What files hold that the picture does not show, and what was made of them, one sentence each.
    pub notes: Vec<String>,
    /// What drew it: `cpu`, or the interface and the device that helped.
    pub backend: String,
}

/// Sets of particles in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sets {
    /// Sets that were averaged.
    pub averaged: u32,
    /// Most sets that were asked for.
    pub asked: u32,
    /// Whether it was cancelled before there were enough.
    pub interrupted: bool,
}

/// Renders a scene. The technique `particles` has a picture at any time: cancelled after two sets, it is that of the sets
/// so far, and [`Render::sets`] says so.
///
/// # Errors
/// [`Error::Input`] and [`Error::Io`] for data, [`Error::Limit`] before more memory is taken than allowed,
/// [`Error::Cancelled`] after `progress.cancel()`, [`Error::Gpu`] when there is no device as asked for.
pub fn render(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Render, Error> {
    render_keeping(scene, options, progress, None)
}

/// What the frames of an animation leave for the next.
#[derive(Default)]
pub(crate) struct Left {
    pub(crate) files: Files,
    pub(crate) sets: Kept,
}

impl Left {
    /// Share of the allowed memory that files may take.
    const FILES: u64 = 4;

    /// Lets files go that take more than their share, or than is left beside `other` bytes; sets may take what is then left.
    fn fit(&mut self, max_memory: u64, other: u64) {
        if self.files.bytes() > (max_memory / Self::FILES).min(max_memory.saturating_sub(other)) {
            self.files = Files::default();
        }
        self.sets.allow(max_memory, other + self.files.bytes());
    }
}

/// [`render`] with what other frames of the scene have left.
pub(crate) fn render_keeping(
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    mut left: Option<&mut Left>,
) -> Result<Render, Error> {
    let open = |path: &PathBuf| Checkpoint::open(path, scene, options, left.as_ref().map(|left| &left.sets));
    let mut checkpoint = options.checkpoint.as_ref().map(open).transpose()?;
    let helper = options.device.as_ref().map(Helper::open).transpose()?;
    let (loaded, explanation, memory) = match &left {
        Some(left) => prepare(scene, options, progress, &left.files)?,
        None => prepare(scene, options, progress, &Files::default())?,
    };
    let Explanation { plan, mut cost, mut warnings, notes, .. } = explanation;
    // A reason that is told already is enough.
    let is_empty = loaded.cloud.is_empty() && loaded.own.is_empty();
    let doubtful = is_empty || warnings.len() > loaded.warnings.len();
    if let Some(left) = left.as_deref_mut() {
        left.fit(options.max_memory, memory.total());
    }
    let device = helper.as_ref().map(|helper| (helper, options.device_composites));
    let frame = Frame::new(scene, &loaded, &plan, progress).helped_by(device);
    let kept = left.map(|left| &mut left.sets);
    let mut session = Session { options, checkpoint: checkpoint.as_mut(), kept, warnings: &mut warnings, sets: None };
    let layers = draw(&frame, &mut session, &mut cost)?;
    let sets = session.sets;
    let backend = helper.as_ref().map_or_else(|| "cpu".to_owned(), Helper::name);
    if !doubtful {
        warnings.extend(doubts::of_picture(scene, &layers));
    }
    warnings.extend(doubts::of_shadows(&plan.shadow_tables));
    warnings.extend(helper.map(Helper::said).unwrap_or_default());
    Ok(Render { layers, cost, plan, sets, warnings, notes, backend })
}
